"""Forces of a program: where they come from, and how they turn into the robot's axes."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import toolpath_of
from tiers import examples

from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses, rotation_from_abc
from postproc.cell import Cell, Tool, frames_of
from postproc.process import Wrenches, is_force_word, wrenches
from postproc.toolpath import Annotation, FrameRef, Kind, Toolpath

DOWN = rotation_from_abc([0, 0, np.pi])  # tool z down, tool x forward
FRAMES = (FrameRef(1, None, 3), FrameRef(1, None, 4))
HORIZONTAL = [[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]]


def path_of(points, kinds=None, rotations=None, notes=(), frames=FRAMES, base=None, tool=None) -> Toolpath:
    """Motions to ``points`` [m] with the tool down; lines count 10, 11, ...; NaN makes a target unknown."""
    n = len(points)
    return toolpath_of(
        kind=np.full(n, Kind.LIN) if kinds is None else np.array(kinds),
        position=np.array(points, float).reshape(n, 3),
        rotation=np.tile(DOWN, (n, 1, 1)) if rotations is None else np.array(rotations),
        axes=np.full((n, 6), np.nan),
        feed=np.full(n, 0.01),
        base=np.zeros(n, int) if base is None else np.array(base),
        tool=np.ones(n, int) if tool is None else np.array(tool),
        line=np.arange(n) + 10,
        frames=tuple(frames),
        annotations=tuple(Annotation(row, text, line) for row, text, line in notes),
    )


def cell_of(**more) -> Cell:
    given = {
        "path": Path("/c/cell.yaml"),
        "robot": "r",
        "tools": {1: Tool(Poses.from_abc([0, 0, 0.2], [0, 0, 0]), np.array([0.0, 0, 1]))},
        "bases": {1: Poses.identity()},
    }
    return Cell(**{**given, **more})


def run(
    path: Toolpath, spec: str | None, cell: Cell | None = None, program: Path = Path("part.src")
) -> Wrenches:
    cell = cell or cell_of()
    return wrenches(program, path, frames_of(cell, path, program), cell, spec)


def refused(
    path: Toolpath, spec: str | None, cell: Cell | None = None, program=Path("part.src")
) -> list[Finding]:
    with pytest.raises(Refusal) as caught:
        run(path, spec, cell, program)
    return list(caught.value.findings)


def codes(result: Wrenches) -> list[str]:
    return [finding.code for finding in result.findings]


PTP_THEN = [Kind.PTP, Kind.LIN, Kind.LIN, Kind.LIN, Kind.LIN, Kind.LIN]

# ------------------------------------------------------------------------------------------- frames


def test_without_force_all_is_zero():
    result = run(path_of(HORIZONTAL, notes=[(0, "FORCE 1 2 3", 9)]), None)
    assert not result.any
    assert result.max_force == 0
    assert (result.source, result.findings, len(result)) == ("none", (), 3)
    assert not result.values.flags.writeable


def test_feed_frame_of_a_horizontal_line_with_the_tool_down():
    # along +x with the spindle above: x = +x, z = +z, y = z x x = +y
    path = path_of(HORIZONTAL, PTP_THEN[:3])
    result = run(path, "10,20,30,1,2,3@feed")
    assert np.allclose(result.values, [[0] * 6, [10, 20, 30, 1, 2, 3], [10, 20, 30, 1, 2, 3]])
    assert result.carries.tolist() == [False, True, True]
    assert result.max_force == pytest.approx(np.sqrt(1400))
    # along -y: x = -y, y = z x -y = +x
    result = run(path_of([[0, 0, 0], [0, -0.1, 0]], PTP_THEN[:2]), "10,20,30@feed")
    assert np.allclose(result.values[1], [20, -10, 30, 0, 0, 0])


def test_reversal_turns_the_force_and_is_a_step():
    path = path_of([[0, 0, 0], [0.1, 0, 0], [0, 0, 0]], PTP_THEN[:3])
    result = run(path, "10,20,30@feed")
    assert np.allclose(result.values[1:, :3], [[10, 20, 30], [-10, -20, 30]])
    assert np.allclose(result.start[:][1:, :3], [[10, 20, 30], [-10, -20, 30]])


@pytest.mark.parametrize(
    ("degrees", "shared"), [(0, True), (10, True), (29.9, True), (30.1, False), (90, False)]
)
def test_vertices_below_thirty_degrees_share_one_wrench(degrees, shared):
    a = np.radians(degrees)
    turned = np.array([np.cos(a), np.sin(a), 0])
    path = path_of([[0, 0, 0], [0.1, 0, 0], [0.1, 0, 0] + 0.1 * turned], PTP_THEN[:3])
    result = run(path, "100,0,50,0,0,7@feed")
    first, second = np.array([100, 0, 50, 0, 0, 7]), np.array([*(100 * turned + [0, 0, 50]), 0, 0, 7])
    assert np.allclose(result.values[1], 0.5 * (first + second) if shared else first)
    assert np.allclose(result.start[:][2], 0.5 * (first + second) if shared else second)
    assert np.allclose(result.values[2], second)  # the exit has its own


def test_shared_vertices_take_the_orientation_at_the_vertex():
    a = 0.3
    rotations = [DOWN, DOWN, rotation_from_abc([a, 0, 0]) @ DOWN]
    path = path_of(HORIZONTAL, PTP_THEN[:3], rotations)
    result = run(path, "10,0,0@tool")
    assert np.allclose(result.values[1, :3], [10, 0, 0])
    assert np.allclose(result.values[2, :3], [10 * np.cos(a), 10 * np.sin(a), 0])
    assert np.allclose(result.start[:][2, :3], [10, 0, 0])


def test_force_steps_are_shared_within_a_cut_and_kept_at_its_ends():
    points = [[0.1 * i, 0, 0] for i in range(6)]
    notes = [(1, "FORCE 10 0 0", 1), (2, "FORCE 20 0 0", 2), (4, "FORCE OFF", 3), (5, "force 5,0,0", 4)]
    result = run(path_of(points, PTP_THEN, notes=notes), "")
    assert np.allclose(result.values[:, 0], [0, 15, 20, 20, 0, 5])
    assert np.allclose(result.start[:][:, 0], [0, 10, 15, 20, 0, 5])
    assert result.steps.tolist() == [False, True, False, False, False, True]
    assert result.source == "FORCE comments"


def test_motions_whose_sides_cancel_still_carry_force():
    points = [[0.1 * i, 0, 0] for i in range(4)]
    notes = [(1, "FORCE 10 0 0", 1), (2, "FORCE -10 0 0", 2), (3, "FORCE 500 0 0", 3)]
    result = run(path_of(points, PTP_THEN[:4], notes=notes), "")
    assert np.allclose(result.values[1], 0)  # next to 500 N this is no jump
    assert result.carries[1]


@pytest.mark.parametrize(
    ("second", "jumps"), [(51, False), (47, True), (-100, True), (200, False), (220, True)]
)
def test_a_force_that_jumps_is_a_step(second, jumps):
    """As a turn of 30 deg: by more than 0.518 of the larger force."""
    points = [[0.1 * i, 0, 0] for i in range(3)]
    notes = [(1, "FORCE 100 0 0", 1), (2, f"FORCE {second} 0 0", 2)]
    result = run(path_of(points, PTP_THEN[:3], notes=notes), "")
    shared = 0.5 * (100 + second)
    assert np.allclose([result.values[1, 0], result.start[:][2, 0]], [100, second] if jumps else [shared] * 2)
    assert result.steps.tolist() == [False, True, jumps]


def test_a_plunge_keeps_the_last_direction():
    points = [[0, 0, 0], [0, 0.1, 0], [0, 0.1, -0.1], [0, 0.1005, -0.2], [0.1, 0.1005, -0.2]]
    result = run(path_of(points, PTP_THEN[:5]), "10,0,30@feed")
    # +y; straight down; 0.3 deg off straight down; +x
    assert np.allclose(result.values[1:, :3], [[0, 10, 30], [0, 10, 30], [0, 10, 30], [10, 0, 30]])
    (finding,) = result.findings
    assert (finding.code, finding.severity, finding.line) == ("FRC010", "info", 12)
    assert finding.message.startswith("2 motions have no feed direction")


def test_a_plunge_before_any_feed_takes_the_next_direction():
    points = [[0, 0, 0.1], [0, 0, 0], [0, 0.1, 0], [0, 0, 0.1], [0, 0, 0], [-0.1, 0, 0]]
    kinds = [Kind.PTP, Kind.LIN, Kind.LIN, Kind.PTP, Kind.LIN, Kind.LIN]
    result = run(path_of(points, kinds), "10,0,30@feed")
    assert np.allclose(result.values[[1, 4], :3], [[0, 10, 30], [-10, 0, 30]])  # of its own cut
    (finding,) = result.findings
    assert (finding.code, finding.file, finding.line) == ("FRC008", "part.src", 11)
    assert finding.message.startswith("2 motions before any feed")


def test_a_cut_that_only_plunges_has_no_direction():
    path = path_of([[0, 0, 0.1], [0, 0, 0], [0, 0, -0.1]], PTP_THEN[:3])
    for spec in ("10,0,30@feed", "0,1,0@feed", "0,0,30,1,0,0@feed", "0,0,30,0,1,0@feed"):
        (finding,) = refused(path, spec)
        assert (finding.code, finding.file, finding.line) == ("FRC005", "part.src", 11)
        assert "no motion of this cut has a feed direction across the spindle (and 1 more" in finding.message
    result = run(path, "0,0,30,0,0,2@feed")  # along the spindle no direction is needed
    assert np.allclose(result.values[1:], [[0, 0, 30, 0, 0, 2]] * 2)
    assert result.findings == ()


def test_a_direction_does_not_cross_air():
    points = [[0, 0, 0], [0.1, 0, 0], [0.1, 0, 0.1], [0.1, 0, 0]]
    path = path_of(points, [Kind.PTP, Kind.LIN, Kind.PTP, Kind.LIN])
    assert refused(path, "10,0,0@feed")[0].line == 13
    # nor a motion whose force is zero
    path = path_of(
        points,
        [Kind.PTP] + [Kind.LIN] * 3,
        notes=[(0, "FORCE 1 0 0 @feed", 1), (2, "FORCE OFF", 2), (3, "FORCE 1 0 0@feed", 3)],
    )
    assert refused(path, "")[0].line == 13


def test_a_direction_is_not_taken_from_the_cut_after():
    points = [[0, 0, 0.1], [0, 0, 0], [0, 0, 0.1], [0.1, 0, 0.1]]
    path = path_of(points, [Kind.PTP, Kind.LIN, Kind.PTP, Kind.LIN])
    assert refused(path, "10,0,0@feed")[0].line == 11


def test_a_spindle_turned_into_the_last_direction_leaves_none():
    lying = rotation_from_abc([0, np.pi / 2, 0]) @ DOWN  # the back axis along +x, where the feed went
    path = path_of([[0, 0, 0], [0.1, 0, 0], [0.1, 0, 0]], PTP_THEN[:3], [DOWN, DOWN, lying])
    (finding,) = refused(path, "10,0,0@feed")
    assert (finding.code, finding.line) == ("FRC005", 12)
    # in a cut with an unknown target it keeps its size, and is not shared with its neighbours
    points = [[np.nan] * 3, [0, 0, 0], [0.1, 0, 0], [0.1, 0, 0], [0.2, 0.01, 0]]
    path = path_of(points, rotations=[DOWN, DOWN, DOWN, lying, DOWN])
    result = run(path, "0,10,0@feed")
    assert np.allclose(np.linalg.norm(result.values, axis=1)[2:4], 10)


def test_turning_on_the_spot_keeps_the_last_direction_across_the_new_axis():
    a = 0.4
    tilted = rotation_from_abc([0, a, 0]) @ DOWN  # about +y: back axis leans from +z to +x
    path = path_of([[0, 0, 0], [0.1, 0, 0], [0.1, 0, 0]], PTP_THEN[:3], [DOWN, DOWN, tilted])
    result = run(path, "10,0,30@feed")
    x, z = np.array([np.cos(a), 0, -np.sin(a)]), np.array([np.sin(a), 0, np.cos(a)])
    assert np.allclose(result.values[2, :3], 10 * x + 30 * z)
    assert np.allclose(result.values[1, :3], [10, 0, 30])  # no turn: both sides, at the orientation before
    assert [(finding.code, finding.line) for finding in result.findings] == [("FRC010", 12)]


def test_a_turn_on_the_spot_does_not_hide_its_corner():
    points = [[0, 0, 0], [0.1, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]]
    rotations = [DOWN, DOWN, rotation_from_abc([1.0, 0, 0]) @ DOWN, rotation_from_abc([1.0, 0, 0]) @ DOWN]
    result = run(path_of(points, PTP_THEN[:4], rotations), "10,0,0@feed")
    assert np.allclose(result.values[1:, :3], [[10, 0, 0], [10, 0, 0], [0, 10, 0]])


def test_the_spindle_axis_of_the_tool_counts():
    # tool x down and forward: axis +x at 45 deg between +x and -z; z of the feed frame is its opposite
    s = np.sqrt(0.5)
    rotation = rotation_from_abc([0, np.pi / 4, 0])
    assert np.allclose(rotation @ [1, 0, 0], [s, 0, -s])
    cell = cell_of(tools={1: Tool(Poses.identity(), np.array([1.0, 0, 0]))})
    path = path_of([[0, 0, 0], [0.1, 0, 0]], PTP_THEN[:2], [rotation] * 2)
    result = run(path, "0,0,10@feed", cell)
    assert np.allclose(result.values[1, :3], [-10 * s, 0, 10 * s])
    result = run(path, "10,0,0@feed", cell)
    assert np.allclose(result.values[1, :3], [10 * s, 0, 10 * s])


def test_base_and_world_axes():
    quarter = Poses.from_abc([1, 0, 0], [np.pi / 2, 0, 0])  # x of the frame is y outside
    path = path_of(HORIZONTAL, PTP_THEN[:3])
    based = run(path, "10,20,30,1,2,3", cell_of(bases={1: quarter}))
    assert np.allclose(based.values[1], [-20, 10, 30, -2, 1, 3])
    assert np.allclose(
        run(path, "10,20,30,1,2,3@WORLD", cell_of(bases={1: quarter})).values[1], [10, 20, 30, 1, 2, 3]
    )
    robot = cell_of(robot_base=quarter)  # the robot's x is the world's y
    assert np.allclose(run(path, "10,20,30,1,2,3@world", robot).values[1], [20, -10, 30, 2, -1, 3])
    assert np.allclose(run(path, "10,20,30,1,2,3@base", robot).values[1], [20, -10, 30, 2, -1, 3])


def test_tool_axes():
    result = run(path_of(HORIZONTAL, PTP_THEN[:3]), "10,20,30,1,2,3@tool")
    assert np.allclose(result.values[1], [10, -20, -30, 1, -2, -3])


def test_directions_go_across_a_change_of_base():
    # the second base lies 1 m further in x: its point 0.1 is the first's 1.1
    cell = cell_of(bases={1: Poses.identity(), 2: Poses.from_abc([1, 0, 0], [0, 0, 0])})
    frames = (*FRAMES, FrameRef(2, None))
    path = path_of([[1, 0, 0], [0, 0.1, 0]], PTP_THEN[:2], frames=frames, base=[0, 2])
    assert np.allclose(run(path, "10,0,0@feed", cell).values[1, :3], [0, 10, 0])


def test_directions_go_across_a_change_of_tool():
    # the second TCP lies 0.1 m beside the first: with the tool down it begins at y = -0.1
    tools = {
        n: Tool(Poses.from_abc([0, y, 0.2], [0, 0, 0]), np.array([0.0, 0, 1])) for n, y in ((1, 0), (2, 0.1))
    }
    frames = (*FRAMES, FrameRef(2, None))
    path = path_of([[0, 0, 0], [0.1, 0, 0], [0.3, -0.1, 0]], PTP_THEN[:3], frames=frames, tool=[1, 1, 2])
    notes = [(1, "FORCE 10 0 0 @feed", 1), (2, "FORCE 20 0 0 @feed", 1)]
    path = path_of(path.position, PTP_THEN[:3], frames=frames, tool=[1, 1, 2], notes=notes)
    result = run(path, "", cell_of(tools=tools))
    assert np.allclose(
        result.values[:, :3], [[0, 0, 0], [10, 0, 0], [20, 0, 0]]
    )  # and no sharing between tools
    # the same tool, set again, is no change
    again = path_of(
        path.position * [1, 0, 1],
        PTP_THEN[:3],
        frames=(*FRAMES, FrameRef(1, None)),
        tool=[1, 1, 2],
        notes=notes,
    )
    assert np.allclose(run(again, "").values[:, 0], [0, 15, 20])


@settings(max_examples=examples(60), deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    st.sampled_from(["feed", "tool", "base"]),
)
def test_a_rigid_turn_of_base_and_path_turns_the_wrench_with_it(seed, abc, frame):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.choice([0, 0.03, 0.1], 12)[:, None] * rng.normal(size=(12, 3)), axis=0)
    points += [0.01, 0, 0] * np.arange(12)[:, None]
    rotations = rotation_from_abc(rng.normal(scale=0.2, size=(12, 3))) @ DOWN
    path = path_of(points, rng.choice([Kind.PTP, Kind.LIN, Kind.LIN, Kind.CIRC], 12), rotations)
    spec = f"10,20,30,1,2,3@{frame}"
    move = Poses.from_abc(rng.normal(size=3), abc)
    base = Poses.from_abc(rng.normal(size=3), rng.normal(size=3))
    try:
        here = run(path, spec, cell_of(bases={1: base}))
    except Refusal:  # a lone motion of a cut along the spindle: it has no direction there either
        refused(path, spec, cell_of(bases={1: move @ base}))
        return
    there = run(path, spec, cell_of(bases={1: move @ base}))
    for one, two in ((here.values, there.values), (here.start[:], there.start[:])):
        assert np.allclose(one.reshape(-1, 2, 3) @ move.rotation.T, two.reshape(-1, 2, 3), atol=1e-9)
    world = run(path, "10,20,30@world", cell_of(bases={1: move @ base}))
    assert np.allclose(world.values, run(path, "10,20,30@world", cell_of(bases={1: base})).values)


@settings(max_examples=examples(40), deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_feed_frame_is_right_handed_and_keeps_lengths(seed):
    rng = np.random.default_rng(seed)
    path = path_of(rng.normal(size=(2, 3)), PTP_THEN[:2], rotation_from_abc(rng.normal(size=(2, 3))))
    cell = cell_of(bases={1: Poses.from_abc(rng.normal(size=3), rng.normal(size=3))})
    x, y, z = (run(path, spec, cell).values[1, :3] for spec in ("1,0,0@feed", "0,1,0@feed", "0,0,1@feed"))
    assert np.allclose(np.cross(x, y), z)
    assert np.allclose(np.array([x, y, z]) @ np.array([x, y, z]).T, np.eye(3))
    step = path.position[1] - path.position[0]
    assert (cell.bases[1].rotation @ step) @ x > 0
    assert abs((cell.bases[1].rotation @ step) @ y) < 1e-12 + 1e-9 * np.linalg.norm(step)


# --------------------------------------------------------------------------- air, and what is unknown


def test_point_to_point_is_air_whatever_the_force():
    kinds = [Kind.PTP, Kind.AXIS, Kind.LIN, Kind.CIRC, Kind.OTHER, Kind.PTP]
    points = [[0, 0, 0], [np.nan] * 3, *[[0.1 * i, 0, 0] for i in range(4)]]
    result = run(path_of(points, kinds), "1,2,3")
    assert result.carries.tolist() == [False, False, True, True, True, False]
    assert np.all(result.values[~result.carries] == 0)


@pytest.mark.parametrize("frame", ["base", "world", "tool", "feed"])
def test_unknown_targets_keep_a_force_of_the_right_size(frame):
    points = [[0, 0, 0], [0.1, 0, 0], [np.nan] * 3, [0.3, 0, 0], [0.4, 0, 0]]
    path = path_of(points, PTP_THEN[:5], base=[0, 0, -1, 0, 0])
    result = run(path, f"10,20,30,1,2,3@{frame}")
    assert np.all(np.isfinite(result.values))
    assert np.all(np.isfinite(result.start[:]))
    assert np.allclose(np.linalg.norm(result.values[1:, :3], axis=1), np.sqrt(1400))
    assert np.allclose(np.linalg.norm(result.values[1:, 3:], axis=1), np.sqrt(14))
    assert result.carries.tolist() == [False, True, True, True, True]


def test_a_cut_with_an_unknown_target_needs_no_direction():
    # nothing after the unknown target has a direction, but that cut is left as it is anyway
    path = path_of([[0, 0, 0], [np.nan] * 3, [0.1, 0, 0]], PTP_THEN[:3])
    result = run(path, "10,0,0@feed")
    assert np.allclose(np.linalg.norm(result.values[1:], axis=1), 10)


def test_a_cut_that_ends_with_an_unknown_target_needs_no_direction():
    path = path_of([[0, 0, 0], [0, 0, -0.1], [np.nan] * 3], PTP_THEN[:3])
    result = run(path, "10,0,0@feed")
    assert np.allclose(np.linalg.norm(result.values[1:], axis=1), 10)


def test_the_first_motion_after_axes_has_no_direction_of_its_own():
    points = [[np.nan] * 3, [0, 0, 0], [0, 0.1, 0]]
    result = run(path_of(points, [Kind.AXIS, Kind.LIN, Kind.LIN]), "10,0,0@feed")
    assert np.allclose(result.values[1:, :3], [[0, 10, 0], [0, 10, 0]])
    assert codes(result) == ["FRC008"]
    (finding,) = refused(path_of(points[:2], [Kind.AXIS, Kind.LIN]), "10,0,0@feed")
    assert (finding.code, finding.line) == ("FRC005", 11)


@pytest.mark.parametrize(
    ("frame", "name", "help"),
    [
        (FrameRef(7, Poses.identity()), "tool 7", "tools: {7: {x: ..., y: ..., z: ..., axis: +z}}"),
        (FrameRef(None, Poses.identity()), "the tool", "a tool with the pose that the program sets"),
        (FrameRef(0, None), "tool 0", "bare flange"),
    ],
)
def test_an_unknown_spindle_axis_is_told(frame, name, help):
    path = path_of(HORIZONTAL, PTP_THEN[:3], frames=(FRAMES[0], frame))
    (finding,) = refused(path, "10,0,0@feed")
    assert (finding.code, finding.file, finding.line) == ("FRC005", "part.src", 11)
    assert f"the spindle axis of {name} is not known" in finding.message
    assert help in finding.help
    assert run(path, "10,0,0@tool").any


def test_an_empty_program():
    assert len(run(path_of([]), "1,2,3@feed")) == 0


# ----------------------------------------------------------------------------------- constant force


@pytest.mark.parametrize(
    ("spec", "values"),
    [
        ("0,360,560", [0, 360, 560, 0, 0, 0]),
        ("-1,2.5,+3e1@base", [-1, 2.5, 30, 0, 0, 0]),
        (" 1, 2 ,3 , 4,5,6 @ World ", [1, 2, 3, 4, 5, 6]),
        ("1 2 3", [1, 2, 3, 0, 0, 0]),
    ],
)
def test_constant_forces(spec, values):
    result = run(path_of(HORIZONTAL), spec)
    assert np.allclose(result.values, [values] * 3)
    assert result.source == spec.strip()


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("1,2", "2 numbers are given where 3 or 6"),
        ("1,2,3,4,5", "5 numbers are given where 3 or 6"),
        ("1,2,nan", "'nan' is not a finite number"),
        ("1,inf,2", "'inf' is not a finite number"),
        ("1,1e999,2", "'1e999' is not a finite number"),
        ("1,x,2", "'x' is not a finite number"),
        ("1,1_0,2", "'1_0' is not a finite number"),
        ("1,,2", "a number is missing"),
        ("1,2,3,", "a number is missing"),
        ("1,2,3@", "'' is not a frame"),
        ("1,2,3@bas", "'bas' is not a frame; use one of base, world, tool, feed; did you mean 'base'"),
        ("1,2,3@base@tool", "'base@tool' is not a frame"),
    ],
)
def test_malformed_forces_show_the_form(spec, words):
    (finding,) = refused(path_of(HORIZONTAL), spec)
    assert finding.code == "FRC002"
    assert words in finding.message
    assert "--force" in finding.message
    assert "fx,fy,fz[,mx,my,mz][@base|world|tool|feed]" in finding.help
    (finding,) = refused(path_of(HORIZONTAL), "", cell_of(force=spec, force_line=8))
    assert (finding.code, finding.file, finding.line) == ("FRC002", "/c/cell.yaml", 8)


@pytest.mark.parametrize(
    ("word", "taken"),
    [
        ("0,360,560", True),
        ("-360,0,560@world", True),
        ("1,2", True),
        ("1,2,nan", True),
        ("1,2,3@bse", True),
        ("log.CSV", True),
        ("mill.yaml", True),
        ("in.src", False),
        ("5", False),
        ("-q", False),
        ("1,a.src", False),
        ("", False),
    ],
)
def test_the_option_takes_number_lists_and_files_only(word, taken):
    assert is_force_word(word) is taken


# -------------------------------------------------------------------------------------- annotations


@pytest.mark.parametrize(
    "text", ["FORCE 1 2 3", "force 1,2,3", "Force  1, 2 ,3  @BASE", "FORCE 1 2 3 0 0 0@base", " FORCE,1,2,3 "]
)
def test_annotations_in_every_form(text):
    assert np.allclose(
        run(path_of(HORIZONTAL, notes=[(1, text, 5)]), "").values[:, :3], [[0] * 3, [1, 2, 3], [1, 2, 3]]
    )


def test_annotations_are_modal_from_their_row_on():
    notes = [(2, "FORCE 9 0 0", 6), (0, "FORCE 1 0 0", 1), (2, "FORCE 2 0 0 @world", 7), (9, "FORCE OFF", 99)]
    result = run(path_of([[0, 0.1 * (-1) ** i, 0] for i in range(4)], notes=notes), "")
    assert np.allclose(result.values[:, 0], [1, 1, 2, 2])


def test_point_to_point_motions_that_a_comment_gives_a_force_are_told():
    kinds = [Kind.PTP, Kind.LIN, Kind.PTP, Kind.AXIS, Kind.LIN, Kind.PTP, Kind.PTP, Kind.PTP]
    notes = [(1, "FORCE 10 0 0", 5), (5, "FORCE OFF", 6), (6, "FORCE 0 0 0", 7)]
    path = path_of([[0, 0.1 * (-1) ** i, 0] for i in range(8)], kinds, notes=notes)
    (finding,) = run(path, "").findings
    assert (finding.code, finding.line) == ("FRC009", 12)
    assert "(and 1 more)" in finding.message
    cell = cell_of()
    rapids = wrenches(Path("part.ngc"), path, frames_of(cell, path, Path("part.ngc")), cell, "", rapids=True)
    assert not rapids.findings


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("FORCE", "the numbers are missing"),
        ("FORCE @feed", "the numbers are missing"),
        ("FORCE 1 2", "2 numbers"),
        ("FORCE 1 2 3 4 5", "5 numbers"),
        ("FORCE 1 2 x", "'x' is not a finite number"),
        ("FORCE 3N 0 0", "'3N' is not"),
        ("FORCE nan 0 0", "'nan' is not"),
        ("FORCE -inf 0 0", "'-inf' is not"),
        ("FORCE 0 360,,560", "a number is missing"),
        ("FORCE 1 2 3 @fed", "did you mean 'feed'"),
        ("FORCE OFF now", "nothing may follow OFF"),
    ],
)
def test_malformed_annotations_are_errors_with_their_line(text, words):
    (finding,) = refused(path_of(HORIZONTAL, notes=[(0, text, 7)]), "")
    assert (finding.code, finding.file, finding.line) == ("FRC002", "part.src", 7)
    assert words in finding.message


def test_all_malformed_annotations_are_told():
    notes = [(0, "FORCE 1", 7), (1, "FORCE 1 2 3", 8), (2, "FORCE @", 9)]
    assert [finding.line for finding in refused(path_of(HORIZONTAL, notes=notes), "")] == [7, 9]


@pytest.mark.parametrize("text", ["FORCE: 1 2 3", "FORCEOFF", "FORCE=OFF"])
def test_what_was_meant_as_a_force_is_refused(text):
    notes = [(0, "FORCE 1 2 3", 7), (1, text, 8)]
    (finding,) = refused(path_of(HORIZONTAL, notes=notes), "")
    assert (finding.code, finding.file, finding.line) == ("FRC002", "part.src", 8)


@pytest.mark.parametrize("text", ["FORCE sensor zeroed", "FORCED AIR ON", "FORCE info"])
def test_comments_that_only_begin_with_force_are_told(text):
    notes = [(0, "FORCE 1 2 3", 7), (1, text, 8), (2, "COMPENSATE OFF", 9)]
    result = run(path_of(HORIZONTAL, notes=notes), "")
    (finding,) = result.findings
    assert (finding.code, finding.file, finding.line) == ("FRC006", "part.src", 8)
    assert np.allclose(result.values[2, :3], [1, 2, 3])
    # alone they are no annotations: the next source is asked, and they stay told
    assert [f.code for f in refused(path_of(HORIZONTAL, notes=notes[1:]), "")] == ["FRC001", "FRC006"]
    result = run(path_of(HORIZONTAL, notes=notes[1:]), "", cell_of(force="4,5,6"))
    assert (result.source, codes(result)) == ("cell: 4,5,6", ["FRC006"])


# ---------------------------------------------------------------------------------------- force CSV


def csv(folder: Path, text: str, name: str = "part.force.csv") -> Path:
    path = folder / name
    path.write_text(text)
    return path


AWAY = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]]  # right angles: no wrench is shared


def test_a_force_table_beside_the_program(tmp_path):
    csv(
        tmp_path,
        "Line;FX;fy;fz;mx;my;mz;frame\n11;1;2;3;4;5;6;\n13;1,5;0;0;0;0;0;Tool\n12;7;8;9;0;0;0;@world\n",
    )
    result = run(path_of(AWAY, PTP_THEN[:4]), "", program=tmp_path / "part.src")
    assert np.allclose(result.values, [[0] * 6, [1, 2, 3, 4, 5, 6], [7, 8, 9, 0, 0, 0], [1.5, 0, 0, 0, 0, 0]])
    assert (result.source, result.findings) == ("part.force.csv", ())


def test_motions_without_a_row_are_air_and_told(tmp_path):
    path = csv(tmp_path, "line,fx,fy,fz\n11,1,2,3\n")
    result = run(path_of(AWAY, PTP_THEN[:4]), str(path))
    assert result.carries.tolist() == [False, True, False, False]
    (finding,) = result.findings
    assert (finding.code, finding.severity, finding.file) == ("FRC007", "info", str(path))
    assert "2 motions have no row and count as air; the first is in line 12" in finding.message


def test_a_force_on_an_air_move_is_told(tmp_path):
    path = csv(tmp_path, "line,fx,fy,fz\n11,0,0,0\n12,1,2,3\n10,0,0,5\n13,1,1,1\n")
    result = run(path_of(AWAY, PTP_THEN[:4]), str(path))
    assert not result.carries[0]
    (finding,) = result.findings
    assert (finding.code, finding.file, finding.line) == ("FRC009", str(path), 4)
    assert "line 10 of part.src" in finding.message


@pytest.mark.parametrize(
    ("text", "code", "line", "words"),
    [
        (
            "line,fx,fy,fz\n11,1,2,3\n14,1,2,3\n",
            "FRC004",
            3,
            "line 14 of part.src contains no motion; the nearest motions are in line 13",
        ),
        ("line,fx,fy,fz\n9,1,2,3\n", "FRC004", 2, "the nearest motions are in line 10"),
        (
            "line,fx,fy,fz\n11,1,2,3\n12,1,2,3\n11,1,2,3\n",
            "FRC003",
            4,
            "line 11 has a row already, in line 2",
        ),
        ("line,fx,fy,fz\n11.5,1,2,3\n", "FRC003", 2, "'11.5' is not a line number"),
        ("line,fx,fy,fz\n0,1,2,3\n", "FRC003", 2, "'0' is not a line number"),
        ("line,fx,fy,fz\n11,1,x,3\n", "FRC003", 2, "column fy: 'x' is not a number"),
        ("line,fx,fy,fz\n11,1,nan,3\n", "FRC003", 2, "column fy: 'nan'"),
        ("line,fx,fy\n11,1,2\n", "FRC003", 1, "column 'fz' is missing"),
        ("line,fx,fy,fz,mx\n11,1,2,3,4\n", "FRC003", 1, "column 'my' is missing"),
        (
            "line,fx,fy,fz,fram\n11,1,2,3,base\n",
            "FRC003",
            1,
            "column 'fram' is unknown; did you mean 'frame'",
        ),
        ("line,fx,fy,fz,frame\n11,1,2,3,bas\n", "FRC003", 2, "column frame: 'bas' is not a frame"),
        ("fx,fy,fz\n1,2,3\n", "FRC003", 1, "no column states the place: one of line, s_mm, t_s is missing"),
        ("line,s_mm,fx,fy,fz\n11,0,1,2,3\n", "FRC003", 1, "columns line and s_mm both state the place"),
    ],
)
def test_mistakes_in_force_tables(tmp_path, text, code, line, words):
    path = csv(tmp_path, text)
    finding = refused(path_of(AWAY, PTP_THEN[:4]), str(path))[0]
    assert (finding.code, finding.file, finding.line) == (code, str(path), line)
    assert words in finding.message


def test_many_lines_without_motion_are_told_briefly(tmp_path):
    path = csv(tmp_path, "line,fx,fy,fz\n" + "".join(f"{100 + i},1,2,3\n" for i in range(30)))
    findings = refused(path_of(AWAY), str(path))
    assert len(findings) == 10
    assert "(and 20 more such rows)" in findings[-1].message


def test_between_two_motions_both_are_named(tmp_path):
    path = csv(tmp_path, "line,fx,fy,fz\n15,1,2,3\n")
    motions = path_of(AWAY)
    spread = motions.with_columns(line=np.array([10, 14, 18, 20]))
    assert "the nearest motions are in line 14 and 18" in refused(spread, str(path))[0].message


# ------------------------------------------------------------------------------------------ sources


def test_the_first_source_that_exists_is_taken(tmp_path):
    program = tmp_path / "part.src"
    cell = cell_of(path=tmp_path / "sub" / "cell.yaml", force="log.CSV", force_line=3)
    (tmp_path / "sub").mkdir()
    csv(tmp_path / "sub", "line,fx,fy,fz\n11,3,0,0\n12,3,0,0\n", "log.CSV")
    motions = path_of(HORIZONTAL, PTP_THEN[:3])
    result = run(motions, "", cell, program)
    assert (result.source, result.values[2, 0]) == ("cell: log.CSV", 3)
    csv(tmp_path, "line,fx,fy,fz\n11,2,0,0\n12,2,0,0\n")
    result = run(motions, "", cell, program)
    assert (result.source, result.values[2, 0]) == ("part.force.csv", 2)
    noted = path_of(HORIZONTAL, PTP_THEN[:3], notes=[(0, "FORCE 1 0 0", 1)])
    result = run(noted, "", cell, program)
    assert (result.source, result.values[2, 0]) == ("FORCE comments", 1)
    assert run(noted, "5,0,0", cell, program).values[2, 0] == 5
    assert not run(noted, None, cell, program).any


def test_force_off_alone_is_an_annotation():
    result = run(path_of(HORIZONTAL, notes=[(0, "FORCE OFF", 1)]), "", cell_of(force="1,2,3"))
    assert (result.source, result.any) == ("cell: 1,2,3", False)


def test_no_force_at_all_shows_all_three_ways():
    (finding,) = refused(path_of(HORIZONTAL), "")
    assert (finding.code, finding.file) == ("FRC001", "part.src")
    for way in (
        ";FORCE 0 360 560 @base",
        "(FORCE 0 360 560 @BASE)",
        "part.force.csv",
        "line,fx,fy,fz",
        "/c/cell.yaml",
    ):
        assert way in finding.help


def test_a_missing_force_table():
    assert refused(path_of(HORIZONTAL), "none.csv")[0].code == "FIL001"
    assert refused(path_of(HORIZONTAL), "none.yml")[0].code == "FIL001"


def test_a_cut_without_any_known_place_keeps_its_force(tmp_path):
    """Nothing of the path is known, so no motion begins anywhere; the force is still there to be seen."""
    n = 3
    unknown = np.full((n, 3), np.nan)
    path = toolpath_of(
        kind=np.full(n, Kind.LIN),
        position=unknown,
        rotation=np.full((n, 3, 3), np.nan),
        axes=np.full((n, 6), np.nan),
        feed=np.full(n, np.nan),
        base=np.full(n, -1),
        tool=np.full(n, -1),
        line=np.arange(1, n + 1),
        frames=(),
    )
    cell = Cell(path=tmp_path / "cell.yaml", robot="kuka_kr270")
    made = wrenches(tmp_path / "p.src", path, frames_of(cell, path, "p.src"), cell, "0,360,560")
    assert made.carries.all()
    np.testing.assert_allclose(made.values, [[0, 360, 560, 0, 0, 0]] * n)
