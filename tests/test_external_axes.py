"""External axes: tracks that carry the robot, positioners that carry the part, judged by a cell of plain numpy."""

from __future__ import annotations

import re
from itertools import pairwise

import jsonschema_rs
import numpy as np
import pytest
from external_plant import COMPLIANCE, Scene, beside, between, forward, log, pose, read
from motions import motions

from postproc.base.findings import Refusal
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.compensation.correct import correct
from postproc.languages.krl import inserting
from postproc.robot.axis_track import follow_axes
from postproc.robot.description import load_robot
from postproc.schemas.cell_schema import cell_schema
from postproc.workflows.preparation import Request, prepare
from postproc.workflows.program import compensate

ROBOT = """\
name: arm
geometry:
  source: none needed
{rail}  kuka: {{unit: mm, d1: 750, a1: 350, a2: 1250, a3: -55, d4: 1100, d6: 230}}
joints:
  source: wide
  unit: deg
{joint}  A1: [-185, 185]
  A2: [-146, 0]
  A3: [-119, 155]
  A4: [-350, 350]
  A5: [-125, 125]
  A6: [-350, 350]
effects:
  - effect: joint_compliance
    parameters:
{values}
"""


def robot(rail="", joint=""):
    values = "\n".join(
        f"      c{i + 1 + bool(joint)}: {{value: {c}, unit: rad/(N m), source: Table 1}}"
        for i, c in enumerate(COMPLIANCE)
    )
    return ROBOT.format(rail=rail, joint=joint, values=values)


ON_RAIL = robot("  rail: +y\n", "  E1: {kind: prismatic, limits: [-2000, 4000], unit: mm}\n")

CELL = """\
robot: arm.yaml
max_growth: 20
tools: {{1: {{x: 0, y: 0, z: 250}}}}
bases:
  1: {{x: 1500, y: {y}, z: 600}}
  2: {{x: 1500, y: 0, z: 600}}
{more}"""

START = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 90,A6 180%s}"
"""With the tool pointing down over the base."""

HEAD = "DEF part()\n$BASE=BASE_DATA[1]\n$TOOL=TOOL_DATA[1]\n$VEL.CP=0.05\n"
CONSTANT = HEAD + "\n".join(
    [
        START % ",E1 1100",
        "LIN {X 0,Y 0,Z 50,A 0,B 0,C 180,E1 1100}",
        ";FORCE 100 300 200 @base",
        "LIN {X 0,Y 0,Z 0,A 0,B 0,C 180,E1 1100}",
        "LIN {X 0,Y 400,Z 0,A 0,B 0,C 180,E1 1100}",
        "LIN {X 250,Y 400,Z 0,A 20,B 5,C 180,E1 1100}",
        ";FORCE OFF",
        "LIN {X 250,Y 400,Z 50,A 20,B 5,C 180,E1 1100}",
        "END",
    ]
)
"""A track that stands where the program puts it."""

MOVING = HEAD + "\n".join(
    [
        START % ",E1 200",
        "LIN {X 0,Y 0,Z 50,A 0,B 0,C 180,E1 200}",
        ";FORCE 100 300 200 @base",
        "LIN {X 0,Y 0,Z 0,A 0,B 0,C 180}",
        "LIN {Y 400,E1 600.0}",
        "LIN {X 250,Y 400,A 20,B 5}",
        "LIN {X 250,Y 100,E1 125.5}",
        ";FORCE OFF",
        "LIN {Z 50}",
        "END",
    ]
)
"""A track that moves along the cut, and points that leave out what stays."""


def job(folder, program, more="", arm=None, y=0):
    (folder / "arm.yaml").write_text(robot() if arm is None else arm)
    (folder / "cell.yaml").write_text(CELL.format(more=more, y=y))
    (folder / "part.src").write_text(program)
    return folder / "part.src"


def judged(source, scene, points=None, start=0.0, tolerance=0.02):
    """The job done; its poses and errors are those of the plain cell, and the tool of what it wrote is on the path."""
    request = Request(program=source, force="")
    ready = prepare(request)
    found = correct(ready.task)
    commanded = read(source.read_text(), points, start)
    near = np.radians([0, -90, 90, 0, 90, 180])
    corners: list[list[np.ndarray]] = []
    before: list[tuple[float, float]] = []
    assert len(commanded) == len(ready.task.toolpath)
    for row, motion in enumerate(commanded):
        if motion.target is None:
            near = motion.axes
            continue
        force = np.zeros(3) if motion.force is None else motion.force
        tool, near = scene.tool_at(motion.target, motion.e, force, near)
        assert ready.task.track.q[row, -6:] == pytest.approx(near, abs=1e-9)
        if motion.force is not None:
            shift = np.linalg.norm(tool[:3, 3] - motion.target[:3, 3])
            turn = np.linalg.norm(log(tool[:3, :3] @ motion.target[:3, :3].T))
            assert found.before[row] == pytest.approx(shift, abs=2e-10)
            assert found.before_angle[row] == pytest.approx(turn, abs=2e-10)
            before.append((shift, turn))
            if commanded[row - 1].force is None:
                corners.append([commanded[row - 1].target])
            corners[-1].append(motion.target)
    assert max(before)[0] > 1 * MM  # there is something to correct
    report = compensate(request)
    assert report.exit == 0, report.findings
    written = read((source.parent / "compensated" / source.name).read_text(), points, start)
    worst = along_the_cuts(written, scene, corners)
    assert worst[0] < tolerance * MM
    assert worst[1] < 0.02 * DEG
    return report, written


def along_the_cuts(written, scene, corners, samples=7):
    """Largest distance [m] and angle [rad] of the tool from the wanted path, on all motions of the cuts but the
    transition with which each begins."""
    near, cut, worst = np.radians([0, -90, 90, 0, 90, 180]), -1, [0.0, 0.0]
    for before, motion in pairwise(written):
        if motion.force is None:
            continue
        if before.force is None:
            cut += 1
            continue
        for share in np.linspace(0, 1, samples):
            command = between(before.target, motion.target, share)
            e = before.e + share * (motion.e - before.e)
            tool, near = scene.tool_at(command, e, motion.force, near)
            wanted = corners[cut]
            off, line, at = beside(tool[:3, 3], [target[:3, 3] for target in wanted])
            there = between(wanted[line], wanted[line + 1], at)
            angle = np.linalg.norm(log(tool[:3, :3] @ there[:3, :3].T))
            worst = [max(worst[0], off), max(worst[1], angle)]
    return worst


TRACKS = {
    "y": ("+y", (0, 1, 0)),
    "against y": ("-y", (0, -1, 0)),
    "x": ("+x", (1, 0, 0)),
    "skew": ("[2, 3, 0.5]", np.array([2, 3, 0.5]) / np.linalg.norm([2, 3, 0.5])),
}
LIMITS = "limits: [-2000, 4000]"


@pytest.mark.sample(1)
@pytest.mark.parametrize("way", TRACKS.values(), ids=TRACKS)
def test_a_track_that_stands_where_the_program_puts_it(tmp_path, way):
    text, direction = way
    base = np.array([1500, 0, 600]) + 1100 * np.array(direction)
    more = f"external_axes:\n  E1: {{kind: track, direction: {text}, {LIMITS}}}\n"
    source = job(tmp_path, CONSTANT, more)
    cell = tmp_path / "cell.yaml"
    cell.write_text(
        cell.read_text().replace(
            "{x: 1500, y: 0, z: 600}", "{{x: {}, y: {}, z: {}}}".format(*base.tolist()), 1
        )
    )
    judged(source, Scene(pose(*base), tracks={1: direction}))


@pytest.mark.slow
@pytest.mark.parametrize("way", TRACKS.values(), ids=TRACKS)
def test_a_track_that_moves_along_the_cut(tmp_path, way):
    text, direction = way
    more = f"tolerance: 0.004\nexternal_axes:\n  E1: {{kind: track, direction: {text}, {LIMITS}}}\n"
    report, written = judged(
        job(tmp_path, MOVING, more), Scene(pose(1500, 0, 600), tracks={1: direction}), tolerance=0.004
    )
    assert "E1 (track) moves in 125.5 .. 600 mm" in [found.message for found in report.findings]
    stands = {float(motion.e[0]) for motion in written}
    assert {200.0, 600.0, 125.5} <= stands
    if text != "+y":  # where the robot does not just go along with the cut, points are needed on the way
        assert len(stands) > 3


@pytest.mark.slow
def test_a_robot_that_stands_turned_and_two_tracks(tmp_path):
    """Directions are those of the world, whatever way the robot looks; two tracks make a gantry."""
    more = (
        "robot_base: {x: 300, y: -100, z: 50, a: 30, b: 4, c: -3}\nexternal_axes:\n"
        f"  E1: {{kind: track, direction: +x, {LIMITS}}}\n  E3: {{kind: track, direction: [0, 3, -1], {LIMITS}}}\n"
    )
    program = MOVING.replace("E1 200", "E1 200,E3 0").replace("Y 400,E1 600.0", "Y 400,E1 350.0,E3 -80")
    down = np.array([0, 3, -1]) / np.sqrt(10)
    scene = Scene(
        pose(1500, 0, 600), pose(300, -100, 50, 30, 4, -3), tracks={1: np.array([1.0, 0, 0]), 3: down}
    )
    judged(job(tmp_path, program, more), scene)


@pytest.mark.slow
def test_a_rail_of_the_robot_file(tmp_path):
    """The external joint is where the program has it, the robot file's own way of saying a track."""
    scene = Scene(pose(1500, 0, 600), tracks={1: np.array([0, 1, 0])})
    judged(job(tmp_path, MOVING, arm=ON_RAIL), scene)


def test_what_the_program_says_goes_before_the_start_of_the_cell(tmp_path):
    scene = Scene(pose(1500, 1100, 600), tracks={1: np.array([0, 1, 0])})
    judged(job(tmp_path, CONSTANT, "start: [500, 0, -90, 90, 0, 90, 180]\n", ON_RAIL, y=1100), scene)


@pytest.mark.slow
@pytest.mark.parametrize(
    "stated", ["", ",E1 0"], ids=["the start of the cell", "what the program says first"]
)
def test_before_the_program_says_it_the_start_does(tmp_path, stated):
    """Until E1 is stated the track is where the cell starts it, and behind that where the program has it."""
    program = CONSTANT.replace(",E1 1100", "").replace(START % "", START % stated)
    at = 500 if not stated else 0
    for number, (more, arm) in enumerate(
        [
            ("start: [500, 0, -90, 90, 0, 90, 180]\n", ON_RAIL),
            (f"external_axes:\n  E1: {{kind: track, direction: +y, {LIMITS}, start: 500}}\n", None),
        ]
    ):
        folder = tmp_path / str(number)
        folder.mkdir()
        source = job(folder, program, more, arm, y=at)
        judged(source, Scene(pose(1500, at, 600), tracks={1: np.array([0, 1, 0])}), start=500)


def test_points_of_a_dat_and_an_axis_start(tmp_path):
    """E1 stands in the points of the data list; the axis start says it for the first straight motion."""
    points = {
        "XHIGH": "{X 0,Y 0,Z 50,A 0,B 0,C 180,E1 700.0,E2 0.0}",
        "XLOW": "{X 0,Y 0,Z 0,A 0,B 0,C 180,E1 700.0,E2 0.0}",
        "XSIDE": "{X 0,Y 400,Z 0,A 0,B 0,C 180,E1 300.0,E2 0.0}",
        "XEND": "{X 250,Y 400,Z 0,A 20,B 5,C 180}",
    }
    lines = [START % ",E1 700", "LIN XHIGH", ";FORCE 100 300 200 @base", "LIN XLOW", "LIN XSIDE", "LIN XEND"]
    lines += [";FORCE OFF", "LIN XHIGH", "END"]
    more = f"external_axes:\n  E1: {{kind: track, direction: -y, {LIMITS}}}\n"
    source = job(tmp_path, HEAD + "\n".join(lines), more)
    kinds = {name: "FRAME" if name == "XEND" else "E6POS" for name in points}
    declared = "\n".join(f"DECL {kinds[name]} {name}={text}" for name, text in points.items())
    (tmp_path / "part.dat").write_text(f"DEFDAT part\n{declared}\nENDDAT\n")
    request = Request(program=source, force="", shared_points="copy-inline")
    report, scene = compensate(request), Scene(pose(1500, 0, 600), tracks={1: np.array([0, -1, 0])})
    assert report.exit == 0, report.findings
    out = tmp_path / "compensated"
    changed = {
        line.split("=")[0].split()[-1]: line.split("=")[1]
        for line in (out / "part.dat").read_text().splitlines()
        if line.startswith("DECL")
    }
    for name in ("XHIGH", "XLOW", "XSIDE"):
        assert changed[name].split("E1")[1] == points[name].split("E1")[1]
    assert "E1" not in changed["XEND"]
    written = read((out / "part.src").read_text(), changed)
    original = read(source.read_text(), points)
    corners = [[motion.target for motion in original[1:5]]]
    worst = along_the_cuts(written, scene, corners)
    assert worst[0] < 0.02 * MM
    assert worst[1] < 0.02 * DEG


TABLE = "external_axes:\n  E2: {kind: positioner, axis: +z, point: [1400, 150, 0], limits: [-360, 360], bases: [1]}\n"
TURNING = HEAD + "\n".join(
    [
        START % ",E1 0,E2 -20",
        "LIN {X 0,Y 0,Z 50,A 0,B 0,C 180,E1 0,E2 -20}",
        ";FORCE 100 300 200 @base",
        "LIN {Z 0}",
        "LIN {X 100,Y 200,E2 25}",
        "LIN {X 250,Y 200,A 20}",
        "LIN {X 250,Y 0,E2 -15.5}",
        ";FORCE OFF",
        "LIN {Z 50}",
        "END",
    ]
)
"""A table that turns under the tool."""


@pytest.mark.slow
def test_a_table_that_turns_under_the_tool(tmp_path):
    scene = Scene(pose(1500, 0, 600), turns=[(2, (0, 0, 1), (1400, 150, 0))])
    _, written = judged(job(tmp_path, TURNING, TABLE), scene)
    assert len(written) > 10  # the straight motions on the part are bent for the robot


def test_a_table_that_stands_turned(tmp_path):
    scene = Scene(pose(1500, 0, 600), turns=[(2, (0, 0, 1), (1400, 150, 0))])
    program = TURNING.replace("E2 25", "E2 -20").replace("E2 -15.5", "E2 -20")
    report, _ = judged(job(tmp_path, program, TABLE), scene)
    assert "E2 (positioner) is at -20 deg" in [found.message for found in report.findings]


@pytest.mark.slow
def test_a_table_that_tilts_and_turns_and_a_track(tmp_path):
    """The turning axis stands on the tilting one, the robot on a track: all of them move in the cut."""
    more = (
        "robot_base: {x: 100, y: 50, z: 20, a: -15, b: 2, c: 1}\n"
        f"external_axes:\n  E1: {{kind: track, direction: +y, {LIMITS}}}\n"
        "  E2: {kind: positioner, axis: [1, 0.2, 0], point: [1500, 100, 400], limits: [-90, 90]}\n"
        "  E3: {kind: positioner, axis: +z, point: [1480, 90, 0], limits: [-360, 360], bases: [1, 5], on: E2}\n"
    )
    program = TURNING.replace("E1 0,E2 -20", "E1 100,E2 5,E3 10").replace("E2 25", "E1 200,E2 -8,E3 30")
    program = program.replace("E2 -15.5", "E2 3.25,E3 0")
    tilt = np.array([1, 0.2, 0]) / np.sqrt(1.04)
    scene = Scene(
        pose(1500, 0, 600),
        pose(100, 50, 20, -15, 2, 1),
        tracks={1: np.array([0, 1, 0])},
        turns=[(2, tilt, (1500, 100, 400)), (3, (0, 0, 1), (1480, 90, 0))],
    )
    judged(job(tmp_path, program, more), scene)


def test_a_base_beside_the_table_stays(tmp_path):
    """Base 2 does not stand on the table: what the table does is nothing to it."""
    scene = Scene(pose(1500, 0, 600))
    judged(job(tmp_path, TURNING.replace("BASE_DATA[1]", "BASE_DATA[2]"), TABLE), scene)


@pytest.mark.slow
def test_an_axis_that_carries_nothing(tmp_path):
    scene = Scene(pose(1500, 0, 600))
    judged(job(tmp_path, MOVING, "external_axes: {E1: {kind: fixed}}\n"), scene)


def test_axes_that_are_all_zero_are_nothing(tmp_path):
    judged(job(tmp_path, CONSTANT.replace("E1 1100", "E1 0.0,E2 0,E3 0")), Scene(pose(1500, 0, 600)))


# what is refused

TRACK_CELL = f"external_axes:\n  E1: {{kind: track, direction: +y, {LIMITS}}}\n"
REFUSED = {
    "moving, unknown": (MOVING, "", "EXT001", 5, "E1 moves to 200 and to other values"),
    "constant, unknown": (CONSTANT, "", "EXT001", 5, "the cell does not state what it carries"),
    "one of two unknown": (TURNING.replace("E1 0", "E1 7"), TABLE, "EXT001", 5, "E1 moves to 7;"),
    "computed, unknown": (
        CONSTANT.replace("E1 1100", "E4 far"),
        "",
        "EXT001",
        5,
        "a value that is not a number of the program",
    ),
    "beyond its limits": (
        CONSTANT.replace("E1 1100", "E1 4001"),
        TRACK_CELL,
        "EXT003",
        5,
        "E1 is at 4001 mm",
    ),
    "beyond on the way": (MOVING.replace("E1 600.0", "E1 -2000.5"), TRACK_CELL, "EXT003", 9, "-2000.5 mm"),
    "never said": (
        CONSTANT.replace(",E1 1100", ""),
        TRACK_CELL,
        "EXT002",
        5,
        "the place of E1 is not known here",
    ),
    "said too late": (MOVING.replace(",E1 200", ""), TRACK_CELL, "EXT002", 5, "does not state it before"),
    "a force in the world": (TURNING.replace("@base", "@world"), TABLE, "EXT005", 8, "world axes"),
}


@pytest.mark.parametrize("case", REFUSED.values(), ids=REFUSED)
def test_what_moves_unknown_things_is_refused(tmp_path, case):
    program, more, code, line, words = case
    source = job(tmp_path, program, more)
    with pytest.raises(Refusal) as refused:
        compensate(Request(program=source, force=""))
    first = refused.value.findings[0]
    assert (first.code, first.line) == (code, line)
    assert words in first.message
    assert first.help
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.yaml", "cell.yaml", "part.src"]


def test_a_positioner_matters_where_it_carries_the_base(tmp_path):
    """Nothing states E2 for motions in base 1, which it does not carry; for base 2, and the way there, it is needed."""
    table = TABLE.replace("bases: [1]", "bases: [2]")
    plain = re.sub(r",E[12] [-\d.]+", "", TURNING)
    for name, more in (("alone", ""), ("beside", table)):
        (tmp_path / name).mkdir()
        source = job(tmp_path / name, plain, more)
        compensate(Request(program=source, force=""))
    alone, beside = (
        (tmp_path / name / "compensated" / "part.src").read_text() for name in ("alone", "beside")
    )
    assert [line for line in alone.splitlines() if line.startswith("LIN")] == [
        line for line in beside.splitlines() if line.startswith("LIN")
    ]
    later = plain.replace(
        ";FORCE OFF", "$BASE=BASE_DATA[2]\nLIN {X 10,Y 10,Z 0,A 0,B 0,C 180,E2 5}\n;FORCE OFF"
    )
    with pytest.raises(Refusal) as refused:
        compensate(Request(program=job(tmp_path / "beside", later, table), force=""))
    (found,) = refused.value.findings
    assert found.code == "EXT002"
    assert found.line == later[: later.index("$BASE=BASE_DATA[2]")].count("\n")


BAD_CELLS = {
    "a track without a direction": ("E1: {kind: track, limits: [0, 1]}", "YML003", "direction"),
    "a direction of no length": ("E1: {kind: track, direction: [0, 0, 0], limits: [0, 1]}", "YML004", "direction"),
    "a direction of another kind": ("E1: {kind: track, direction: y, limits: [0, 1]}", "YML004", "+x"),
    "a track without limits": ("E1: {kind: track, direction: +y}", "YML003", "limits"),
    "limits the wrong way": ("E1: {kind: track, direction: +y, limits: [5, 1]}", "YML004", "below"),
    "a start beyond": ("E1: {kind: track, direction: +y, limits: [0, 1], start: 2}", "YML004", "not within"),
    "a positioner without an axis": (
        "E1: {kind: positioner, point: [0, 0, 0], limits: [0, 1], bases: [1]}", "YML003", "axis"),
    "a positioner without a point": ("E1: {kind: positioner, axis: +z, limits: [0, 1], bases: [1]}", "YML003", "point"),
    "a positioner of nothing": (
        "E1: {kind: positioner, axis: +z, point: [0, 0, 0], limits: [0, 1]}", "YML003", "carries nothing"),
    "a base that is not a number": (
        "E1: {kind: positioner, axis: +z, point: [0, 0, 0], limits: [0, 1], bases: [1.5]}", "YML004", "bases"),
    "on what is not there": (
        "E1: {kind: positioner, axis: +z, point: [0, 0, 0], limits: [0, 1], bases: [1], on: E2}", "YML004", "E2"),
    "on itself": (
        "E1: {kind: positioner, axis: +z, point: [0, 0, 0], limits: [0, 1], bases: [1], on: E1}", "YML004", "circle"),
    "an unknown kind": ("E1: {kind: rail, direction: +y, limits: [0, 1]}", "YML004", "track"),
    "an unknown key": ("E1: {kind: track, directoin: +y, limits: [0, 1]}", "YML002", "direction"),
    "an unknown axis": ("E7: {kind: fixed}", "YML002", "E6"),
    "a key of another kind": ("E1: {kind: fixed, limits: [0, 1]}", "YML002", "limits"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD_CELLS.values(), ids=BAD_CELLS)
def test_a_cell_that_says_too_little_is_refused(tmp_path, case):
    text, code, words = case
    source = job(tmp_path, CONSTANT, f"external_axes:\n  {text}\n")
    with pytest.raises(Refusal) as refused:
        compensate(Request(program=source, force=""))
    first = refused.value.findings[0]
    assert first.code == code
    assert first.line >= 6 or code == "YML003"
    assert words in f"{first.message} {first.help}"
    assert not (tmp_path / "compensated").exists()


def test_one_base_on_two_tables_is_refused(tmp_path):
    one = "{kind: positioner, axis: +z, point: [0, 0, 0], limits: [0, 1], bases: [1]}"
    source = job(tmp_path, CONSTANT, f"external_axes:\n  E1: {one}\n  E2: {one}\n")
    with pytest.raises(Refusal, match="base 1 is carried by E1 already"):
        compensate(Request(program=source, force=""))


def test_a_joint_of_the_robot_is_no_axis_of_the_cell(tmp_path):
    source = job(tmp_path, CONSTANT, TRACK_CELL, ON_RAIL)
    with pytest.raises(Refusal, match="is a joint of the robot"):
        compensate(Request(program=source, force=""))


TOUCHED = (
    "correct: touched_off\ncontroller: {absolute_accuracy: false}\ntouch_points: [[0, 0, 0], [250, 400, 0]]\n"
)


def test_a_base_that_was_touched_off_beside_a_moving_axis_is_refused(tmp_path):
    """Nothing says where the axis stood meanwhile; the program with the same axis at rest is corrected."""
    source = job(tmp_path, MOVING, TOUCHED + TRACK_CELL)
    with pytest.raises(Refusal) as refused:
        compensate(Request(program=source, force=""))
    (first,) = refused.value.findings
    assert (first.code, first.file) == ("CEL012", str(tmp_path / "cell.yaml"))
    assert "external axes move in this program" in first.message
    assert first.help
    assert not (tmp_path / "compensated").exists()


def test_a_base_is_touched_off_where_the_axis_stands(tmp_path):
    """A robot that its track brought along with the base touches what it would touch without both."""
    found = []
    for name, program, more, y in (
        ("with", CONSTANT, TOUCHED + TRACK_CELL, 1100),
        ("without", CONSTANT.replace(",E1 1100", ""), TOUCHED, 0),
    ):
        (tmp_path / name).mkdir()
        found.append(
            correct(prepare(Request(program=job(tmp_path / name, program, more, y=y), force="")).task)
        )
    one, other = found
    assert one.corrected.any()
    assert np.abs(one.correction - other.correction).max() < 1e-9
    assert np.abs(one.correction).max() > 1e-4


def test_a_base_is_touched_off_with_the_rail_of_the_robot_as_at_the_first_cut(tmp_path):
    report = compensate(Request(program=job(tmp_path, MOVING, TOUCHED, ON_RAIL), force=""))
    (told,) = [f.message for f in report.findings if f.code == "COR032"]
    assert "with the external axis as there" in told


# what is read, written and read back

UR5_ON_RAIL = """\
name: ur5_on_rail
geometry:
  source: none needed
  dh:
    unit: mm
    angle_unit: deg
    rows:
      - {a: 0, alpha: 90, d: 0}
      - {a: 0, alpha: 90, d: 89.159}
      - {a: -425, alpha: 0, d: 0}
      - {a: -392.25, alpha: 0, d: 0}
      - {a: 0, alpha: 90, d: 109.15}
      - {a: 0, alpha: -90, d: 94.65}
      - {a: 0, alpha: 0, d: 82.3}
joints:
  source: wide
  unit: deg
  E1: {kind: prismatic, limits: [-1000, 1000], unit: mm}
  J1: [-360, 360]
  J2: [-360, 360]
  J3: [-360, 360]
  J4: [-360, 360]
  J5: [-360, 360]
  J6: [-360, 360]
"""
DH = [
    (0, 90, None),
    (0, 90, 89.159),
    (-425, 0, 0),
    (-392.25, 0, 0),
    (0, 90, 109.15),
    (0, -90, 94.65),
    (0, 0, 82.3),
]


def flange_on_rail(q):
    """Rz(theta) Tz(d) Tx(a) Rx(alpha), row by row; the first row slides."""
    at = np.eye(4)
    for (a, alpha, d), value in zip(DH, q, strict=True):
        theta, along = (0.0, value * 1000) if d is None else (np.degrees(value), d)
        at = at @ pose(0, 0, 0, theta) @ pose(0, 0, along) @ pose(a, 0, 0) @ pose(0, 0, 0, 0, 0, alpha)
    return at


def test_any_arm_on_a_rail_is_followed(tmp_path):
    """An arm without closed form, whose first joint the program moves by E1: on straight motions and behind jumps."""
    (tmp_path / "arm.yaml").write_text(UR5_ON_RAIL)
    arm, count = load_robot(tmp_path / "arm.yaml"), 60
    wave = np.linspace(0, 2 * np.pi, count)[:, None]
    q = np.radians([30, -70, 80, 20, 60, 10]) + 0.1 * np.sin(wave * np.arange(1, 7))
    e1 = 400 * np.sin(wave[:, 0]) + 50
    e1[30:] += 200  # a jump of the rail
    q = np.column_stack([e1 * MM, q])
    there = np.array([flange_on_rail(row) for row in q])
    target = Poses(there[:, :3, :3], there[:, :3, 3])
    external = np.full((count, 6), np.nan)
    external[:, 0] = e1
    path = motions(target, axes={40: q[40, 1:]}, external=external)
    track = follow_axes(arm, path, target, q[0])
    assert np.abs(track.q - q).max() < 1e-9
    external[:5, 0] = np.nan  # before the program states it, it is where the cell starts it
    again = follow_axes(arm, motions(target, external=external), target, q[0])
    assert again.q[:5, 0] == pytest.approx([q[0, 0]] * 5, abs=0)
    assert np.abs(again.q[5:] - q[5:]).max() < 1e-9
    lost = follow_axes(
        arm, motions(target, external=np.where(external == e1[7], np.inf, external)), target, q[0]
    )
    assert lost.branch[6:9].tolist() == [0, -1, 0]


def edited(source, old, new):
    text = source.read_text()
    assert text.count(old) == 1
    source.write_text(text.replace(old, new))
    return source


def test_where_the_axis_is_not_known_the_motion_is_left(tmp_path):
    """A cut behind a branch that inputs decide, in which E1 may have moved, stays, unless it states E1 again."""
    branch = "IF $IN[1] THEN\nLIN {X 0,Y 0,Z 60,E1 900}\nENDIF\nLIN {X 0,Y 0,Z 50,A 0,B 0,C 180%s}\n;FORCE"
    source = edited(job(tmp_path, CONSTANT.replace(",E1 1100", ""), TRACK_CELL), START % "", START % ",E1 0")
    source.write_text(source.read_text().replace(";FORCE 100", branch % "" + " 100"))
    report = compensate(Request(program=source, force=""))
    assert report.exit == 3
    assert "EXT004" in [finding.code for finding in report.findings]
    assert report.corrected == 0
    source.write_text(
        source.read_text().replace("Z 50,A 0,B 0,C 180}\n;FORCE 1", "Z 50,A 0,B 0,C 180,E1 0}\n;FORCE 1")
    )
    again = compensate(Request(program=source, force=""))
    assert "EXT004" not in [finding.code for finding in again.findings]
    assert again.corrected == 3


def test_a_computed_value_leaves_the_motion(tmp_path):
    source = edited(job(tmp_path, MOVING, TRACK_CELL), "LIN {Y 400,E1 600.0}", "LIN {Y 400,E1 far}")
    report = compensate(Request(program=source, force=""))
    told = next(finding for finding in report.findings if finding.code == "EXT004")
    assert (report.exit, report.corrected, told.line) == (3, 0, 9)


def test_what_was_read_back_is_held_to_its_axes(tmp_path, monkeypatch):
    """A writer that puts an external axis elsewhere, by more than half a digit, is not believed."""
    more = f"tolerance: 0.004\nexternal_axes:\n  E1: {{kind: track, direction: +x, {LIMITS}}}\n"
    source = job(tmp_path, MOVING, more)
    assert compensate(Request(program=source, force="", dry_run=True)).exit == 0
    write = inserting.aggregate

    def shifted(texts, words):
        return write(
            texts, re.sub(rb"(?<=E1 )[^,]+", lambda value: b"%.3f" % (float(value[0]) + 0.002), words)
        )

    monkeypatch.setattr(inserting, "aggregate", shifted)
    with pytest.raises(Refusal, match="the place of an external axis differs"):
        compensate(Request(program=source, force=""))
    # an inserted motion that already says where the axis is at the end of its source
    monkeypatch.setattr(
        inserting, "aggregate", lambda texts, words: write(texts, re.sub(rb"E1 [^,]+", b"E1 600.0", words))
    )
    with pytest.raises(Refusal, match="the place of an external axis differs"):
        compensate(Request(program=source, force=""))


def test_words_of_the_program_stay_as_they_are(tmp_path):
    """E of corrected motions is verbatim, whatever its spelling; inserted ones have it in no fewer decimals."""
    more = f"tolerance: 0.004\nexternal_axes:\n  E1: {{kind: track, direction: +x, {LIMITS}}}\n"
    source = edited(job(tmp_path, MOVING, more), "E1 600.0", "E1 +600.00000")
    assert compensate(Request(program=source, force="")).exit == 0
    lines = (tmp_path / "compensated" / "part.src").read_text().splitlines()
    words = [
        line[line.index("E1") : line.index("}")] for line in lines if line.startswith("LIN") and "E1" in line
    ]
    assert words.count("E1 +600.00000") == 1
    assert words.count("E1 125.5") == 1
    others = [word for word in words if word not in ("E1 +600.00000", "E1 125.5", "E1 200")]
    assert others
    assert {len(word.partition(".")[2]) for word in others} == {5, 4}


def test_a_step_of_the_axis_is_followed(tmp_path):
    """LIN_REL moves E1 by what it states."""
    source = job(tmp_path, MOVING.replace(";FORCE OFF", ";FORCE OFF\nLIN_REL {Z 20,E1 -25.5}"), TRACK_CELL)
    path = prepare(Request(program=source, force="")).task.toolpath
    assert path.external[:, 0].tolist() == [200, 200, 200, 600, 600, 125.5, 100, 100]


@pytest.mark.parametrize(
    ("statement", "known"),
    [
        ("ASYPTP {E1 1000}", [True, False, True]),
        ("ASYPTP {E2 1000}", [True, True, True]),
        ("$EX_AX_IGNORE=1", [True, False, False]),
        ("$ASYNC_AXIS='B0001'", [True, False, False]),
        ("$EX_AX_IGNORE=1\n$EX_AX_IGNORE=0", [True, False, True]),
        ("$EX_AX_IGNORE=1\n$EX_AX_IGNORE=1", [True, False, False]),
        ("$EX_AX_IGNORE=0", [True, True, True]),
    ],
)
@pytest.mark.parametrize("many", [1, 20], ids=["a line", "a run of lines"])
def test_axes_that_go_by_themselves_are_not_known(tmp_path, statement, known, many):
    """What the controller moves beside its motions, or leaves out of them, stands where nobody knows."""
    full = "LIN {X 0,Y 0,Z 50,A 0,B 0,C 180%s}\n"
    text = full % ",E1 100" + statement + "\n" + full % "" + (full % ",E1 200") * many
    more = TRACK_CELL + "  E2: {kind: fixed}\n"
    path = prepare(Request(program=job(tmp_path, HEAD + text + "END\n", more))).task.toolpath
    assert np.isfinite(path.external[:3, 0]).tolist() == known
    assert np.isfinite(path.external[2:, 0]).tolist() == [known[2]] * many


def test_the_schema_knows_what_the_reader_reads():
    check = jsonschema_rs.Draft202012Validator(cell_schema())
    good = [
        {"kind": "track", "direction": "+y", "limits": [0, 4000], "start": 5},
        {
            "kind": "positioner",
            "axis": [0, 0, 1],
            "point": [1, 2, 3],
            "limits": [0, 1],
            "bases": [1],
            "on": "E2",
        },
        {"kind": "fixed"},
        {"kind": "fixed", "word": "y2"},
    ]
    for axis in good:
        assert check.is_valid({"robot": "x", "external_axes": {"E1": axis}})
    bad = [{"kind": "track", "limits": [0, 1]}, {"kind": "fixed", "limits": [0, 1]}, {"kind": "rail"}, {}]
    bad += [{"kind": "fixed", "word": "A3"}, {"kind": "fixed", "word": "Y"}, {"kind": "fixed", "word": ""}]
    bad += [{**good[1], "bases": []}, {**good[1], "bases": [0]}, {**good[0], "direction": "y"}]
    for axis in bad:
        assert not check.is_valid({"robot": "x", "external_axes": {"E1": axis}})
    assert not check.is_valid({"robot": "x", "external_axes": {"E7": good[0]}})


def test_where_motions_begin(tmp_path):
    """Behind axis motions and changes of the base, with a table and a track that have moved by then."""
    more = TABLE + f"  E1: {{kind: track, direction: +y, {LIMITS}}}\n"
    lines = [
        START % ",E1 100,E2 10",
        "LIN {X 0,Y 0,Z 80,A 0,B 0,C 180,E1 150,E2 15}",
        START.replace("A1 0", "A1 5") % ",E1 160,E2 25",
        "LIN {X 10,Y 20,Z 60,E2 20}",  # A, B, C are those that the axes bring
        ";FORCE 100 300 200 @base",
        "LIN {Z 0,E1 120}",
        ";FORCE OFF",
        "$BASE=BASE_DATA[2]",
        "LIN {X 0,Y 0,Z 80,A 0,B 0,C 180,E1 200,E2 -5}",
        "$BASE=BASE_DATA[1]",
        "LIN {X 0,Y 0,Z 80,A 0,B 0,C 180,E2 0}",
        "END",
    ]
    task = prepare(Request(program=job(tmp_path, HEAD + "\n".join(lines), more), force="")).task
    on_table = Scene(
        pose(1500, 0, 600), tracks={1: np.array([0, 1.0, 0])}, turns=[(2, (0, 0, 1), (1400, 150, 0))]
    )
    beside_it = Scene(pose(1500, 0, 600), tracks=on_table.tracks)
    scenes = [on_table] * 5 + [beside_it, on_table]
    e = np.zeros((7, 6))
    e[:, :2] = [(100, 10), (150, 15), (160, 25), (160, 20), (120, 20), (200, -5), (200, 0)]
    assert task.toolpath.external[:, :2].tolist() == e[:, :2].tolist()

    def in_base(row, at):
        """The base of a motion in the world, with the axes where they stand at ``at``."""
        return scenes[row].part(e[at])

    def end(row):
        """The TCP in the world at the end of a motion."""
        if row in (0, 2):
            return (
                on_table.robot(e[row])
                @ forward(np.radians([5 * (row == 2), -90, 90, 0, 90, 180]), on_table.tool)[0]
            )
        here = task.toolpath.target_in_base[row]
        return in_base(row, row) @ matrix(here)

    turned = np.linalg.inv(in_base(3, 2)) @ end(2)
    assert task.toolpath.rotation[3] == pytest.approx(turned[:3, :3], abs=1e-12)
    rows = np.arange(7)
    begins = task.base[rows].inverse() @ task.desired_path.start[rows]
    for row in range(1, 7):
        wanted = np.linalg.inv(in_base(row, row - 1)) @ end(row - 1)
        assert matrix(begins[row]) == pytest.approx(wanted, abs=1e-12), row


def matrix(there):
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = there.rotation, there.position
    return made


def test_a_cut_that_begins_in_another_base_is_refused(tmp_path):
    """With the table turned nobody knows which way such a motion goes on the part."""
    program = TURNING.replace("LIN {Z 0}", "$BASE=BASE_DATA[2]\nLIN {X 0,Y 0,Z 0,A 0,B 0,C 180}")
    with pytest.raises(Refusal, match="at another place than that of the motion before"):
        compensate(Request(program=job(tmp_path, program, TABLE), force=""))
