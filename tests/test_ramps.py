"""Forces that step inside a cut go over along the path: by a scalar walk along it, and by what the correction does."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from judge.cases import FIVE_AXIS, gcode, steps_of_force
from judge.drawn import drawn
from judge.force import STRETCHED, Field
from judge.judge import Cell, Path, Robot, correction_along, cuts_of, read
from path_cases import corner, line
from spring_cases import MM, spring

from postproc.compensation.ramped_forces import STEEPEST, add_force_ramps, correction_steps
from postproc.process import Wrenches
from postproc.process.force_ramps import Ramps
from postproc.toolpath import Kind
from postproc.workflows.preparation import Request, prepare


def some_ramps(seed: int):
    """Motions of random lengths in some cuts, steps at some of them, and ramps of other lengths than those."""
    rng = np.random.default_rng(seed)
    n = 40
    extent = rng.uniform(0.0, 3.0, n) * (rng.random(n) > 0.1)
    carries = rng.random(n) > 0.15
    inner = np.flatnonzero(carries[1:] & carries[:-1]) + 1
    rows = np.sort(rng.choice(inner, min(8, len(inner)), replace=False))
    return rows, rng.normal(size=(len(rows), 6)), rng.uniform(0.5, 6.0, len(rows)), extent, carries, rng


@pytest.mark.parametrize("seed", range(20))
def test_a_ramp_adds_what_is_left_of_its_step(seed):
    """Walked by hand: from the step on, through the motions behind it, no further than its cut."""
    rows, step, length, extent, carries, rng = some_ramps(seed)
    ramps = Ramps.of(rows, step, length, extent, carries)
    motions, share = rng.integers(0, len(extent), 200), rng.random(200)
    share[:40] = rng.integers(0, 2, 40)
    found = ramps.at(motions, share)
    for motion, t, added in zip(motions, share, found, strict=True):
        expected = np.zeros(6)
        for row, change, long in zip(rows, step, length, strict=True):
            if row > motion or not carries[row : motion + 1].all():
                continue
            walked = extent[row:motion].sum() + t * extent[motion]
            if walked < long:
                expected -= (1 - walked / long) * change
        np.testing.assert_allclose(added, expected, atol=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_a_share_of_a_step_goes_over_before_it(seed):
    """Walked by hand: back from the step, no further than to the start of its cut; and after it the rest."""
    rows, _, length, extent, carries, rng = some_ramps(seed)
    extent = np.maximum(extent, 0.1)
    values = rng.normal(size=(len(extent), 6)) * carries[:, None]
    early = rng.choice([0.0, 0.3, 1.0], len(rows))
    steps = np.zeros(len(extent), bool)
    steps[rows] = True
    force = Wrenches(values, values, carries, "test", (), steps)
    ramped = force.ramped(rows, length, extent, early)
    motions, share = rng.integers(1, len(extent), 200), rng.random(200)
    expected = np.zeros((200, 6))
    for k, (motion, t) in enumerate(zip(motions, share, strict=True)):
        for row, long, part in zip(rows, length, early, strict=True):
            change = values[row] - values[row - 1]
            if row > motion and carries[motion:row].all():
                walked = (1 - t) * extent[motion] + extent[motion + 1 : row].sum()
                expected[k] += max(1 - walked / long, 0) * part * change
            elif row <= motion and carries[row : motion + 1].all():
                walked = extent[row:motion].sum() + t * extent[motion]
                expected[k] -= max(1 - walked / long, 0) * (1 - part) * change
    np.testing.assert_allclose(ramped.ramps.at(motions, share), expected, atol=1e-12)
    found, _, shares = ramped.ramps.steps()
    np.testing.assert_array_equal(found, rows)
    np.testing.assert_allclose(shares, early, atol=1e-12)


@pytest.mark.parametrize("radius", [0.3, 1.0, 4.0, 20.0])
@pytest.mark.parametrize("motion", ["arc", "polyline"])
@pytest.mark.parametrize("ramp", ["", "force_ramp: 20\n"])
def test_a_force_of_one_size_is_nowhere_larger_where_the_path_turns(tmp_path, radius, motion, ramp):
    """Stated along the feed, of one size from a corner on: turning with the path, on its ramp too."""
    turn = np.linspace(0.0, np.pi, 37)[1:]
    if motion == "arc":
        half = [f"G2 X{2 * radius:.4f} Y0 I{radius:.4f} J0"]
    else:
        half = [f"X{radius * (1 - np.cos(a)):.4f} Y{radius * np.sin(a):.4f}" for a in turn]
    body = ["G21 G90 G17 G54 F2000", "T1 M6", "G0 X-40. Y0. Z20.", "G1 Z0. F600", "X0.", *half]
    program = gcode(*body, f"G1 X{2 * radius:.4f} Y-40.", "Z20. F3000", cell=FIVE_AXIS + ramp)(tmp_path)
    task = prepare(Request(program, force="250,80,0@feed")).task
    assert task.force.ramps is not None
    size = np.hypot(250.0, 80.0)
    cut = np.flatnonzero(task.carries)
    rows, share = np.repeat(cut, 101), np.tile(np.linspace(0.0, 1.0, 101), len(cut))
    found = np.linalg.norm(task.force.along(rows, share)[:, :3], axis=1)
    assert found.max() < size * (1 + 1e-6)
    assert task.force.max_force < size * (1 + 1e-6)


@pytest.mark.parametrize("early", [0.3, 1.0])
@pytest.mark.parametrize("motion", ["arc", "polyline"])
@pytest.mark.parametrize("length", [3e-3, 20e-3])
def test_a_force_that_goes_over_before_its_corner_is_nowhere_larger(tmp_path, motion, early, length):
    """The corner ends a half circle, over which the ramp leads backwards."""
    turn = np.linspace(0.0, np.pi, 37)[1:]
    half = [f"X{4 * (1 - np.cos(a)):.4f} Y{4 * np.sin(a):.4f}" for a in turn]
    half = ["G2 X8. Y0. I4. J0."] if motion == "arc" else half
    body = [
        "G21 G90 G17 G54",
        "T1 M6",
        "G0 X0. Y-40. Z20.",
        "G1 Z0. F600",
        "G1 Y0.",
        *half,
        "G1 X60. Y0.",
        "Z20.",
    ]
    task = prepare(Request(gcode(*body)(tmp_path), force="250,80,0@feed")).task
    rows = task.force.ramps.steps()[0]
    bare = replace(task.force, ramps=None, steps=task.force.steps | np.isin(np.arange(len(task.force)), rows))
    every = np.full(len(rows), length), task.desired_path.length, np.full(len(rows), early)
    cut = np.flatnonzero(task.carries)
    at, share = np.repeat(cut, 101), np.tile(np.linspace(0.0, 1.0, 101), len(cut))
    found = np.linalg.norm(bare.ramped(rows, *every).along(at, share)[:, :3], axis=1)
    assert found.max() < np.hypot(250.0, 80.0) * (1 + 1e-6)


@pytest.mark.parametrize("motion", ["arc", "polyline"])
def test_the_smaller_a_step_the_less_the_force_differs(tmp_path, motion):
    """Where the force turns with the path behind it."""
    turn = np.linspace(0.0, np.pi, 37)[1:]
    half = [f"X{4 * (1 - np.cos(a)):.4f} Y{4 * np.sin(a):.4f}" for a in turn]
    half = ["G2 X8. Y0. I4. J0."] if motion == "arc" else half
    rows, share = np.repeat(np.arange(40), 51), np.tile(np.linspace(0.0, 1.0, 51), 40)

    def along(before):
        lines = [
            "G0 X0. Y-40. Z20.",
            "G1 Z0. F600",
            f"(FORCE {before} 80 0 @FEED)",
            "Y0.",
            "(FORCE 250 80 0 @FEED)",
        ]
        program = gcode("G21 G90 G17 G54", "T1 M6", *lines, *half, "(FORCE OFF)", "G1 Z20. F3000")(tmp_path)
        force = prepare(Request(program, force="")).task.force
        if before != 250:
            force = replace(force, steps=force.steps | (np.arange(len(force)) == 3))
            length = np.full(len(force), 0.3e-3)
            force = force.ramped(np.array([3]), np.array([6e-3]), length, np.zeros(1))
        some = rows < len(force) - 1
        return force.along(rows[some], share[some])

    even = along(250)
    for step in (1.0, 1e-3):
        assert np.abs(along(250 - step) - even).max() < 1.5 * step


@pytest.mark.parametrize("seed", range(16000, 16008))
def test_forces_are_those_of_another_reader(tmp_path, seed):
    """Of programs drawn at random: its own statements of what acts on ramps, along polylines and arcs."""
    program = drawn(seed).build(tmp_path)
    cell = Cell.load(tmp_path / "cell.yaml")
    path = Path(read(program, cell), Robot.find(cell.robot, cell.folder), cell)
    largest = max(np.linalg.norm(m.force[0][:3]) for m in path.motions if not m.air)
    correct = correction_along(path)
    task = prepare(Request(program, force="")).task
    rows, share = iter(np.flatnonzero(task.carries)), np.linspace(1e-6, 1.0 - 1e-6, 13)
    for low, high in cuts_of(path.motions):
        field = Field(path, low, high, cell.ramp, largest, STRETCHED, correct)
        for motion in range(low, high + 1):
            row = next(rows)
            found = task.force.along(np.full(13, row), share).reshape(-1, 2, 3) @ task.base.rotation[row]
            expected = field.at(path.start[motion] + share * path.length[motion])
            np.testing.assert_allclose(found.reshape(-1, 6), expected, atol=1e-3 * largest)


@pytest.mark.parametrize("seed", range(5))
def test_a_ramp_ends_inside_of_the_motion_that_it_is_said_to_end_in(seed):
    rows, step, length, extent, carries, _ = some_ramps(seed)
    ramps = Ramps.of(rows, step, length, extent, carries)
    told = list(zip(*ramps.ends(), strict=True))
    expected = []
    for row, long in zip(rows, length, strict=True):
        motion, walked = row, 0.0
        while motion < len(extent) and carries[motion]:
            if walked < long < walked + extent[motion]:
                expected.append((motion, (long - walked) / extent[motion]))
                break
            walked += extent[motion]
            motion += 1
    assert len(told) == len(expected)
    np.testing.assert_allclose(told, sorted(expected))


def test_the_motion_before_a_step_keeps_its_force_and_the_one_behind_it_gets_its_own():
    task = add_force_ramps(stepped(), 5e-3)
    force, row = task.force, np.array([3])
    before, behind = task.force.values[2], task.force.values[3]
    np.testing.assert_array_equal(force.at_end[2], before)
    np.testing.assert_allclose(force.along(row, np.zeros(1))[0], before)
    length, extent = force.ramps.length[0], task.desired_path.length[3]
    for part, share in ((0.25, 0.25), (1.0, 1.0), (1.5, 1.0)):
        found = force.along(row, np.array([part * length / extent]))[0]
        np.testing.assert_allclose(found, before + share * (behind - before))
    assert not task.steps(row, np.ones(5, bool))[0]


def stepped():
    """The corner, as forces are read: its cut goes on, and steps at the corner."""
    task = corner()
    steps = np.array([False, False, True, True, False])
    return replace(task, force=replace(task.force, steps=steps))


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_no_correction_goes_back_faster_than_the_path_goes_on(sense):
    """What it goes forth, or aside, makes no ramp longer than it is stated."""
    task = stepped()
    values = task.force.values.copy()
    values[2:4, :3] *= sense
    task = replace(task, force=replace(task.force, values=values, start=values))
    back = -correction_steps(task, np.array([3]))[0, 1]  # the feed goes along y
    assert (back > 0) == (sense > 0)
    for ramp in (1e-3, 20e-3):
        length = add_force_ramps(task, ramp).force.ramps.length[0]
        assert length == pytest.approx(max(ramp, back / STEEPEST))
    # what goes back by less than it goes on never stops
    assert 0.5 < STEEPEST < 1.0


@pytest.mark.parametrize("size", [1e-6, 0.1, 2.0])
@pytest.mark.parametrize("component", range(6))
def test_no_step_in_a_cut_is_too_small_or_too_large_for_a_ramp(component, size):
    """Of any component, by a share of the largest force: from before the step the force goes on without one."""
    task = stepped()
    values = np.where(task.carries[:, None], task.force.values[2], 0.0)
    change = size * np.abs(values).max()
    values[3, component] += change
    ramped = add_force_ramps(replace(task, force=replace(task.force, values=values, start=values)), 5e-3)
    places = np.linspace(0.0, 1.0, 2001)
    force = ramped.force.along(np.full(len(places), 3), places)
    assert np.abs(force[0] - values[2]).max() < 1e-9 * change + 1e-12
    assert np.abs(np.diff(force, axis=0)).max() < 0.2 * change
    assert not ramped.steps(np.array([3]), np.ones(5, bool))[0]


@pytest.mark.parametrize(
    ("column", "rows", "value"),
    [
        ("branch", [3], -1),
        ("reachable", [3], False),
        ("reachable", [2], False),
        ("tool", [3, 4], 0),
        ("tool", [0, 1], 0),
        ("kind", [2], Kind.CIRC),  # whose path is not known: nothing states through where
        ("branch", [1, 4], -1),
        ("reachable", [0, 1, 4], False),
    ],
)
def test_a_step_keeps_its_place_where_its_vertex_is_not_known(column, rows, value):
    """What the correction would be there, with both forces, is known only from the motions beside it."""
    task = stepped()
    if column in ("tool", "kind"):
        values = getattr(task.toolpath, column).copy()
        values[rows] = value
        task = replace(task, toolpath=task.toolpath.with_columns(**{column: values}))
    else:
        values = getattr(task.track, column).copy()
        values[rows] = value
        task = replace(task, track=replace(task.track, **{column: values}))
    ramped = add_force_ramps(task, 5e-3)
    beside = {2, 3} if column in ("reachable", "kind") else {3}
    assert (ramped is task) == bool(beside & set(rows))


def test_what_was_measured_and_what_does_not_change_keep_their_steps():
    measured = stepped()
    measured = replace(measured, force=replace(measured.force, measured=True))
    assert add_force_ramps(measured, 5e-3) is measured
    same = stepped()
    values = np.where(same.carries[:, None], same.force.values[2], 0.0)
    same = replace(same, force=replace(same.force, values=values, start=values))
    assert add_force_ramps(same, 5e-3).force.ramps is None
    alone = line()
    assert add_force_ramps(alone, 5e-3) is alone


def test_a_ramp_of_many_motions_reaches_their_end_points():
    """Motions shorter than the ramp: their ends have a part of the new force."""
    n = 6
    values = np.zeros((n, 6))
    values[1:3, 0], values[3:, 0] = 100.0, 300.0
    steps = np.array([False, True, False, True, False, False])
    force = Wrenches(values, values, values.any(axis=1), "test", (), steps)
    ramped = force.ramped(np.array([3]), np.array([2.5]), np.ones(n), np.zeros(1))
    np.testing.assert_allclose(ramped.at_end[:, 0], [0, 100, 100, 180, 260, 300])
    np.testing.assert_array_equal(ramped.steps, [False, True, False, False, False, False])
    assert force.ramped(np.empty(0, int), np.empty(0), np.ones(n), np.empty(0)) is force


@pytest.mark.parametrize(
    ("feed", "cell", "length"),
    [
        (0.02, "", 5.0),
        (0.2, "", 5.0),
        (0.05, "force_ramp: 3\n", 3.0),
        (0.2, "tools:\n  1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z, diameter: 16}\n", 8.0),
    ],
)
def test_how_long_a_ramp_is(tmp_path, feed, cell, length):
    """The length that is stated, else the cutter's radius, else 5 mm."""
    lines = steps_of_force()(tmp_path).read_bytes().replace(b"$VEL.CP=0.05", f"$VEL.CP={feed}".encode())
    (tmp_path / "part.src").write_bytes(lines)
    stated = (tmp_path / "cell.yaml").read_text()
    if cell.startswith("tools"):
        stated = re.sub(r"tools:\n .*\n", "", stated)
    (tmp_path / "cell.yaml").write_text(stated + cell)
    ramps = prepare(Request(tmp_path / "part.src", force="")).task.force.ramps
    np.testing.assert_allclose(ramps.steps()[1], length * 1e-3)


@pytest.mark.parametrize("kind", [Kind.LIN, Kind.SPL, Kind.PTP])
def test_a_step_goes_over_on_a_path_that_is_known_alone(kind):
    """On the way to a point of a spline, or with PTP, the force steps as it is stated."""
    points = np.array([[0, 0, 20], [0, 0, 0], [100, 0, 0], [100, 100, 0]]) * MM
    force = np.array([[0, 0, 0], [0, 0, 0], [100, 0, 0], [0, 300, 0]])
    kinds = [Kind.PTP, Kind.LIN, Kind.LIN, kind]
    job = spring(points, [False, False, True, True], 1e-6 * np.eye(3), force, kind=kinds)
    job = replace(job, force=replace(job.force, steps=np.arange(4) == 3))
    found = add_force_ramps(job, 5 * MM).force
    at = found.along(np.array([3, 3]), np.array([0.0, 1.0]))[:, :3]
    np.testing.assert_allclose(at, force[[2, 3]] if kind == Kind.LIN else force[[3, 3]], atol=1e-9)
    assert found.steps.tolist() == [False, False, False, kind != Kind.LIN]
