"""Laws of the correction: what is reported is what was done, what shows is what counts, and where it begins anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import FORCE as PUSH
from path_cases import circle, corner, line
from path_cases import task as at_points
from test_mirror import CARRIES, FORCE, TOOL, Problem, full, program_angles, task

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation.axis_limits import check_limits
from postproc.compensation.correct import MotionOutcome, as_air, correct, with_residual
from postproc.compensation.desired_path import start_poses
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import pose_error, predict
from postproc.compensation.path_error import LITTLE, SHARES, SHORT, PathSegments, path_errors
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits, subdivided_motions
from postproc.compensation.uncertain_inputs import UncertainInput
from postproc.compensation.uncertainty import ForceUncertainty
from postproc.compensation.uncertainty_propagation import expanded_uncertainty, length_quantile
from postproc.model import NOTHING
from postproc.process import Wrenches
from postproc.robot.axis_track import follow_axes
from postproc.toolpath import Kind

FREE = Limits(max_growth=100.0)


# What is reported


@pytest.mark.parametrize("count", [1, 2, 40])
def test_the_iteration_ends_when_no_motion_goes_on(count):
    """Its history has one row before and one after each iteration of the motion that takes longest."""
    done = Problem(full(), count).mirror()
    assert len(done.history) == done.iterations.max() + 1
    assert np.array_equal(np.isfinite(done.history).sum(axis=0), done.iterations + 1)


@pytest.mark.parametrize("process", [True, False])
def test_iterations_are_the_steps_of_the_history(process):
    result = correct(task(process=process))
    steps = np.isfinite(result.history).sum(axis=0)
    rows = result.corrected
    assert np.array_equal(steps[rows] - 1, result.iterations[rows])
    assert (result.iterations[rows] >= 1).all()
    np.testing.assert_array_equal(result.history[0][rows], result.before[rows])
    assert not steps[~rows].any()
    assert not result.iterations[~rows].any()


Z, NONE = np.array([0.0, 0.0, 1.0]), np.full(3, np.nan)
SAID = {
    "any orientation": {},
    "no orientation": {"orientation_programmed": np.zeros(9, bool)},
    "free about z": {"redundant_axis": np.tile(Z, (9, 1))},
    "one free about z": {"redundant_axis": np.where(np.arange(9)[:, None] == 2, Z, NONE)},
    "one not oriented": {"orientation_programmed": np.arange(9) != 6},
}


@pytest.mark.parametrize("gain", [0.3, 1.0])
@pytest.mark.parametrize("said", SAID)
def test_what_is_left_is_what_the_robot_does_with_the_commands(said, gain):
    """Position, and orientation but for a turn about a free axis, whatever of it the text can say."""
    job = task(gain=gain, **SAID[said])
    result = correct(job)
    rows = np.flatnonzero(result.corrected)
    assert len(rows) == 6
    there = predict(
        job.model,
        result.command[rows],
        LoadCase(TOOL, job.wrench[rows], NOTHING, job.track.branch[rows], job.track.q[rows]),
    ).pose
    wanted = job.wanted[rows]
    shift, turn = pose_error(there, wanted)
    free = np.nan_to_num(job.toolpath.orientation_control.redundant_axis[rows])
    axis = (wanted.rotation @ free[..., None])[..., 0]
    shows = turn - np.sum(turn * axis, axis=1)[:, None] * axis
    np.testing.assert_allclose(result.after[rows], np.linalg.norm(shift, axis=1), atol=1e-9)
    np.testing.assert_allclose(result.after_angle[rows], np.linalg.norm(shows, axis=1), atol=1e-9)
    again = with_residual(job, result, result.command)
    np.testing.assert_allclose(again.after[rows], result.after[rows], atol=1e-9)
    np.testing.assert_allclose(again.after_angle[rows], result.after_angle[rows], atol=1e-9)
    np.testing.assert_allclose(again.correction, result.correction, atol=1e-15)


def test_what_is_left_across_the_path_is_what_is_perpendicular_to_the_feed():
    """Commands off by a known step: along the path, across it, and both."""
    job = line(tolerance=1e-6)
    result = correct(job)
    row = int(np.flatnonzero(result.corrected)[0])
    feed = job.desired_path.tangent(np.array([row]), np.ones(1))[0]
    across = np.cross(feed, [0.0, 0.0, 1.0])
    for along, beside in ((3e-4, 0.0), (0.0, 4e-4), (3e-4, -4e-4)):
        shift = np.zeros((len(job.toolpath), 3))
        shift[row] = along * feed + beside * across
        moved = Poses(result.command[:].rotation, result.command[:].position + shift)
        found = with_residual(job, result, moved)
        assert found.after[row] == pytest.approx(np.hypot(along, beside), rel=0.02)
        assert found.across_after[row] == pytest.approx(abs(beside), rel=0.02, abs=1e-5)
    assert np.isnan(found.across_after[~result.corrected]).all()


@pytest.mark.parametrize("said", SAID)
def test_commands_turn_only_as_the_text_can_say(said):
    job = task(**SAID[said])
    result = correct(job)
    rows = np.flatnonzero(result.corrected)
    _, turn = pose_error(result.command[rows], job.wanted[rows])
    oriented, free = (
        job.toolpath.constraints.orientation_programmed[rows],
        np.nan_to_num(job.toolpath.orientation_control.redundant_axis[rows]),
    )
    assert np.linalg.norm(turn[~oriented], axis=1).max(initial=0.0) == 0.0
    whole = oriented & ~free.any(axis=1)
    assert (np.linalg.norm(turn[whole], axis=1) > 1e-6).all()
    axis = (job.wanted[rows].rotation @ free[..., None])[..., 0]
    assert np.abs(np.sum(turn * axis, axis=1)[~whole]).max(initial=0.0) < 1e-6


# S and T


ELBOWS = {2: program_angles(), 0: np.radians([[5.0 + i, -60.0, -10.0, 10.0, 50.0, 20.0] for i in range(9)])}
"""S -> angles that have it."""


@pytest.mark.parametrize("status", ELBOWS)
def test_where_paths_meet_a_configuration_that_all_have_is_known(status):
    """That of the number 0 is one like any other."""
    continues = np.array([True] * 3 + [False] + [True] * 5)
    kinds = [Kind.LIN, Kind.PTP] + [Kind.LIN] * 7
    words = {"kind": kinds, "status": status, "continues": continues, "predecessors": {3: (1, 2)}}
    result = correct(task(ELBOWS[status], **words))
    assert result.corrected[CARRIES].all()
    assert "KIN004" not in [one.code for one in result.findings]


def crossing(q, words, sign):
    """A PTP with A6 a hair above zero, which the correction takes below (sign 1) or not (-1)."""
    q, model = q.copy(), full()
    turned = model.chain.jacobian(q[1:2], TOOL)[0, 3:, 5]
    wrench = np.where(CARRIES[:, None], FORCE, 0.0)
    wrench[1] = sign * np.concatenate([np.zeros(3), 50.0 * turned])
    q[1, 5] = 1e-6
    kinds = [Kind.LIN, words.pop("kind", Kind.PTP)] + [Kind.LIN] * 7
    return [f.code for f in correct(task(q, model=model, wrench=wrench, kind=kinds, **words)).findings]


@pytest.mark.parametrize("status", ELBOWS)
@pytest.mark.parametrize("said", ["S", "T", "S and T"])
def test_a_side_that_is_said_and_crossed_is_told(status, said):
    """An axis has a side where T states it; a motion without T, or no PTP, has none."""
    q = ELBOWS[status]
    turn = int(sum(1 << axis for axis in range(6) if q[1, axis] < 0))
    words = {"status": status if "S" in said else -1, "turn": turn if "T" in said else -1}
    assert ("KIN006" in crossing(q, dict(words), 1)) == ("T" in said)
    assert "KIN006" not in crossing(q, dict(words), -1)
    assert "KIN006" not in crossing(q, {"status": -1, "turn": -1}, 1)
    assert "KIN006" not in crossing(q, {**words, "kind": Kind.LIN}, 1)


# Numbers in words


@pytest.mark.parametrize(("axis", "degrees"), [(0, 185.5), (0, -185.5), (3, 355.0), (5, -352.0)])
def test_a_limit_is_told_as_it_is(axis, degrees):
    """The axis, where it would be and between which limits, in degrees."""
    q = program_angles()
    q[2, axis] = np.radians(degrees)
    job = task(q, max_correction=1.0)
    job = replace(job, track=replace(job.track, q=q, within=np.arange(9) != 2))
    (told,) = [f for f in correct(job).findings if f.code == "KIN002"]
    low, high = np.degrees(job.model.robot.limits[axis])
    name = job.model.robot.joints[axis].name
    assert told.message == f"{name} is at {degrees:.1f} deg, beyond its limits {low:g} .. {high:g} deg"
    assert told.line == job.toolpath.line[2]


# Between the points


def lines(lengths, tilts=None):
    """Straight pieces with the tool down, of ``lengths`` [m], turned by ``tilts`` [rad] along their way; all of the one
    motion of a cut."""
    job = line()
    n = len(lengths)
    rows, first = np.full(n, 2), np.linspace(0.1, 0.6, n)
    last = first + np.asarray(lengths) / 0.8
    begin, end = job.desired_path.at(rows, first), job.desired_path.at(rows, last)
    if tilts is not None:
        turn = rotation_from_vector(np.outer(tilts, [1.0, 0.0, 0.0]))
        end = Poses(turn @ end.rotation, end.position)
    return job, PathSegments.straight(rows, first, last, begin, end)


def looked_at(job, pieces, shares):
    """(K,) the largest error beside the way at the shares, one after the other."""
    worst = np.zeros(len(pieces))
    for share in shares:
        along = pieces.first + share * (pieces.last - pieces.first)
        here = pieces.at(np.full(len(pieces), share))
        real = job.simulated(pieces.rows, here, job.force.along(pieces.rows, along)).pose
        shift = real.position - job.goal(pieces.rows, job.desired_path.at(pieces.rows, along)).position
        way = job.desired_path.tangent(pieces.rows, along)
        shift -= np.sum(shift * way, axis=1, keepdims=True) * way
        worst = np.maximum(worst, np.linalg.norm(shift, axis=1))
    return worst


def test_long_pieces_are_looked_at_in_three_places_and_short_ones_in_the_middle():
    job, pieces = lines([0.9 * SHORT, 1.1 * SHORT, 0.2, 0.9 * SHORT], [0.0, 0.0, 0.0, 1.1 * LITTLE])
    off, _ = path_errors(job, pieces)
    long = np.array([False, True, True, True])
    middle, three = looked_at(job, pieces, [0.5]), looked_at(job, pieces, SHARES)
    assert (three > middle + 1e-9).all()
    np.testing.assert_allclose(off, np.where(long, three, middle), atol=2e-9)
    begins, _ = path_errors(job, pieces, np.array([True, False, False, True]))
    first = np.maximum(off, looked_at(job, pieces, [0.0]))
    np.testing.assert_allclose(begins, np.where([True, False, False, True], first, off), atol=2e-9)


def test_the_angle_between_is_that_from_the_wanted_orientation():
    """Pieces that turn away, evenly: a quarter, a half, three quarters of it show."""
    tilts = np.array([0.0, 0.5 * LITTLE, 2 * LITTLE])
    job, pieces = lines([0.01, 0.01, 0.01], tilts)
    _, angle = path_errors(job, pieces)
    _, still = path_errors(job, lines([0.01, 0.01, 0.01])[1])
    shares = np.array([0.5, 0.5, 0.75])
    assert np.abs(angle - shares * tilts).max() <= still.max() + 1e-6


@pytest.mark.parametrize("sweep", [np.pi / 2, np.pi, 2 * np.pi])
def test_pieces_of_an_arc_go_on_from_each_other_the_way_it_turns(sweep):
    """Their sweeps sum up to that of the arc, and none turns back."""
    job = circle(sweep=sweep)
    result = correct(job)
    division = subdivide(job, result, FREE)
    own = np.flatnonzero((division.source == 2) & ~division.transitions)
    assert len(own) > 1
    assert (division.sweep[own] > 0).all()
    assert division.sweep[own].sum() == pytest.approx(sweep, abs=5e-3)
    pieces = subdivided_motions(job, division, own)
    np.testing.assert_allclose(pieces.start.position[1:], pieces.end.position[:-1], atol=1e-12)
    np.testing.assert_allclose(np.diff(pieces.last), pieces.last[0], atol=1e-12)
    assert path_errors(job, pieces)[0].max() <= job.tolerance


@pytest.mark.parametrize("growth", [1.0, 1.5, 2.0, 3.0, 5.0])
def test_never_more_motions_than_may_be(growth):
    """What is inserted stays within the limit, and it is told exactly where that leaves some with fewer."""
    job = line(tolerance=2e-6)
    result = correct(job)
    whole, some = subdivide(job, result, FREE), subdivide(job, result, Limits(max_growth=growth))
    assert len(some) <= growth * len(job.toolpath)
    fewer = len(some) < len(whole)
    told = [finding for finding in some.findings if finding.code == "COR014"]
    assert bool(told) == fewer
    for finding in told:
        assert (
            f"({growth:g}) allows {int(growth * len(job.toolpath)) - len(job.toolpath)}:" in finding.message
        )
        assert finding.line in job.toolpath.line


@pytest.mark.parametrize("taken", [[], [0], [1, 3]])
def test_what_is_taken_for_air_is_in_no_cut_and_nothing_else_changes(taken):
    """Nothing is predicted of it, nothing corrected; a motion is in a cut, or in air."""
    result = correct(task())
    rows, n = np.flatnonzero(result.scope)[taken], len(result.state)
    found = as_air(result, rows)
    others = np.setdiff1d(np.arange(n), rows)
    for name in ("state", "cut", "correction", "turn", "deflection", "before", "after", "after_angle"):
        np.testing.assert_array_equal(getattr(found, name)[others], getattr(result, name)[others])
    assert not found.scope[rows].any()
    assert not found.corrected[rows].any()
    assert not found.correction[rows].any()
    assert not found.turn[rows].any()
    assert np.isnan(found.before[rows]).all()
    assert np.isnan(found.after[rows]).all()
    for one in (result, found):
        np.testing.assert_array_equal(one.scope, one.state != MotionOutcome.AIR)


# Where the correction begins anew


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.0 + 1e-12, 1.0 + 1e-6, 2.0, 3.0, -1.0])
def test_the_correction_begins_anew_where_the_force_is_another(factor):
    """Twice the force is another one, and so is half of it; less than digits is none."""
    job = task()
    values = np.array(job.force.values)
    begin = values.copy()
    begin[6] = factor * values[5]
    job = replace(job, force=Wrenches(values, begin, CARRIES, "test", (), np.zeros(9, bool)))
    corrected = CARRIES.copy()
    same = abs(factor - 1.0) < 1e-9
    found = job.steps(np.flatnonzero(CARRIES), corrected)
    assert found.tolist() == [True, False, False, True, not same, False]


# Doubt


def test_an_error_of_zero_has_the_doubt_of_its_deviation():
    rng = np.random.default_rng(40)
    root = rng.normal(size=(5, 3, 3)) * 1e-4
    spread = root @ np.swapaxes(root, 1, 2)
    error = np.zeros((5, 3))
    error[3:] = rng.normal(size=(2, 3))
    found = expanded_uncertainty(error, spread)
    np.testing.assert_array_equal(found[:3], length_quantile(spread)[:3])
    unit = error[3:] / np.linalg.norm(error[3:], axis=1)[:, None]
    along = np.sqrt(np.einsum("ni,nij,nj->n", unit, spread[3:], unit))
    np.testing.assert_allclose(found[3:], 1.959964 * along, rtol=1e-4)
    np.testing.assert_allclose(expanded_uncertainty(2 * error[3:], spread[3:]), found[3:], rtol=1e-12)


def test_only_the_force_counts_with_the_interval_of_each_motion():
    """Parameters are as uncertain in one motion as in another, the first effect's as the last one's."""
    moves = np.random.default_rng(41).normal(size=(4, 3, 4))
    entries = [UncertainInput(str(i), i, "c", 1.0, 0.0, 2.0, 0.1) for i in (0, 1, 2)]
    entries.append(UncertainInput("force", -1, "force", 1.0, -np.inf, np.inf, 0.1))
    scale = np.array([0.0, 0.25, 0.5, 0.75, 1.0, 1.0])
    rows = np.array([1, 3, 4, 0])
    found = ForceUncertainty(0.2, scale, False, True).scaled(moves, entries, rows)
    np.testing.assert_array_equal(found[:, :, :3], moves[:, :, :3])
    np.testing.assert_allclose(found[:, :, 3], scale[rows][:, None] * moves[:, :, 3])


# Ways


@pytest.mark.parametrize("tools", [[1, 1, 1, 1], [1, 1, 2, 2], [2, 2, 1, 1], [1, 2, 1, 2], [2, 1, 1, 2]])
def test_a_motion_begins_where_the_one_before_ended_with_its_own_tool(tools):
    """The flange stands where it stood; with another tool, counted up or down, another point is at its tip."""
    job = line()
    longer = Poses(rotation_from_vector([0.1, 0.2, 0.3]), np.array([0.05, -0.02, 0.4]))
    frames = {1: job.tool[0:1], 2: Poses(longer.rotation[None], longer.position[None])}
    tool = Poses(
        np.concatenate([frames[t].rotation for t in tools]),
        np.concatenate([frames[t].position for t in tools]),
    )
    path = job.toolpath.with_columns(tool=np.array(tools))
    begin = start_poses(job.wanted, path, tool, job.model.robot, job.track)[np.arange(4)]
    for row in range(1, 4):
        flange = job.wanted[row - 1 : row] @ tool[row - 1 : row].inverse()
        there = flange @ tool[row : row + 1]
        np.testing.assert_allclose(begin.position[row], there.position[0], atol=1e-12)
        np.testing.assert_allclose(begin.rotation[row], there.rotation[0], atol=1e-12)
    assert np.isnan(begin.position[0]).all()


@pytest.mark.parametrize("growth", [1.2, 1.4, 1.6, 1.8, 2.0, 2.4])
def test_a_way_without_its_link_is_not_divided(growth):
    """It begins beside its place, in however many pieces; links come before points."""
    job = corner(tolerance=1e-6)
    result = correct(job)
    whole, some = subdivide(job, result, FREE), subdivide(job, result, Limits(max_growth=growth))
    wanted = set(whole.source[whole.transitions].tolist())
    given = set(some.source[some.transitions].tolist())
    assert given <= wanted
    for row in wanted - given:
        assert np.count_nonzero(some.source == row) == 1
    if wanted - given:
        assert len(some) == len(job.toolpath) + len(given)


def three_lines(**words):
    """A cut of three ways, one behind the other: 0.1 m, 0.6 m, 0.3 m; the middle one errs most between its ends."""
    along = np.array([-0.5, -0.5, -0.4, 0.2, 0.5, 0.5])
    points = np.stack([np.full(6, 1.6), along, [0.6, 0.5, 0.5, 0.5, 0.5, 0.6]], axis=1)
    return at_points(points, [False, False, True, True, True, False], **words)


@pytest.mark.sample(4)
@pytest.mark.parametrize("growth", [1.0, 1.17, 1.34, 1.5, 1.67, 1.84, 2.0, 2.5])
def test_what_may_be_inserted_is_and_where_most_is_left(growth):
    """All of what is allowed, or all that is wanted; the way that errs most gets its points before the others."""
    job = three_lines(tolerance=2e-6)
    n = len(job.toolpath)
    result = correct(job)
    wanted, some = (
        subdivide(job, result, Limits(max_growth=50.0)),
        subdivide(job, result, Limits(max_growth=growth)),
    )
    full, got = (np.bincount(d.source[~d.transitions], minlength=n) - 1 for d in (wanted, some))
    links = int(wanted.transitions.sum())
    spare = int(growth * n) - n
    assert len(some) == min(n + spare, len(wanted))
    order = [3, 4, 2]  # the error between two points grows with the square of their distance
    left = max(spare - links, 0)
    for row in order:
        assert got[row] == min(left, full[row])
        left -= got[row]


def test_limits_that_nobody_stated():
    assert Limits() == Limits(no_insert=False, min_segment=1e-3, max_growth=2.0)


def test_a_posture_that_becomes_singular_is_told_at_its_line():
    """A5 stands just outside of what counts as singular in all motions; one sense of the force leads the cut in."""
    job = line()
    q = np.radians([[a1, -60.0, 90.0, 0.0, 0.0, 0.0] for a1 in (-1.0, -1.0, 0.0, 0.0)])
    q[:, 4] = np.arcsin(0.02) + 1e-5
    wanted = job.model.chain.flange(q) @ job.tool[0:1]
    path = job.toolpath.with_columns(position=wanted.position, rotation=wanted.rotation)
    track = follow_axes(job.model.robot, path, wanted @ job.tool[0:1].inverse(), q[0])
    lines = []
    for sense in (1, -1):
        near = replace(line(wrench=sense * PUSH), wanted=wanted, toolpath=path, track=track)
        result = correct(near)
        found = check_limits(near, subdivide(near, result, Limits(no_insert=True)))[0]
        lines += [finding.line for finding in found if finding.code == "KIN003"]
    assert lines == [path.line[2]]


def test_a_way_that_is_not_known_has_no_length():
    ways = line().desired_path
    assert not ways.traceable[0]  # nothing says where the first motion begins
    assert ways.traceable.any()
    assert (ways.length[~ways.traceable] == 0).all()
    assert (ways.length[ways.traceable] > 0).all()


@pytest.mark.parametrize("tools", [[0, 0], [0, 1], [1, 0]])
def test_a_correction_begins_anew_behind_another_tool(tools):
    """Whichever of the two has the larger number; nothing else changes between the two motions in air."""
    task = line()
    path = task.toolpath
    path = path.with_columns(tool=np.array([tools[0], *[tools[1]] * (len(path) - 1)]), frames=path.frames * 2)
    every = np.ones(len(path), bool)
    assert replace(task, toolpath=path).steps(np.array([1]), every)[0] == (tools[0] != tools[1])


def test_half_a_correction_is_half_of_it_on_the_way_of_an_arc_too():
    """In the middle of each arc the command lies half as far from the wanted way."""
    whole, half = (circle(gain=gain) for gain in (1.0, 0.5))
    divisions = [subdivide(task, correct(task), FREE) for task in (whole, half)]
    assert np.array_equal(divisions[0].role, divisions[1].role)
    arcs = np.flatnonzero(np.isfinite(divisions[0].sweep))
    assert len(arcs) > 1
    away = []
    for cut, division in zip((whole, half), divisions, strict=True):
        pieces = subdivided_motions(cut, division, arcs)
        middle = pieces.at(np.full(len(arcs), 0.5)).position
        wanted = cut.desired_path.at(pieces.rows, 0.5 * (pieces.first + pieces.last)).position
        away.append(middle - wanted)
    size = np.linalg.norm(away[0], axis=1)
    assert size.min() > 1e-4
    assert (np.linalg.norm(away[1] - 0.5 * away[0], axis=1) < 0.02 * size).all()
