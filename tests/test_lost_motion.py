"""Lost motion along a program: sides of gaps at every place of a way, and what corrections make of them."""

from dataclasses import replace

import numpy as np
import pytest
from effect_cases import made, nulls, with_terms
from path_cases import START, circle, line, task

from postproc.base.geometry import Poses, rotation_from_abc, rotation_from_vector
from postproc.compensation.correct import correct
from postproc.compensation.gap_sides import MotorPath, Reversals
from postproc.compensation.lost_motion import ROOM, add_lost_motion, dead_band, position_digit
from postproc.compensation.reversals import find_reversals
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.robot.inverse import inverse
from postproc.toolpath import Kind

GAP = 2e-4
SPACING = 1e-3


def lossy(job, name="hysteresis", gap=GAP, axes=(1, 2), spacing=SPACING):
    effect = made(name, job.model.robot.joints)
    letter = effect.parameters[0].name[0]
    values = nulls(effect) | {f"{letter}{axis}": gap for axis in axes}
    job = replace(job, model=with_terms(job.model, (effect, values)))
    return add_lost_motion(job, START, np.full(len(job.toolpath), spacing))


def axes_along(job, count=4000):
    """Rows, shares and axes at many places of all ways that are known, one by one."""
    rows = np.repeat(np.flatnonzero(job.desired_path.traceable), count)
    along = np.tile(np.arange(1, count + 1) / count, len(rows) // count)
    flange = job.desired_path.at(rows, along) @ job.tool[rows].inverse()
    return rows, along, inverse(job.model.robot.nominal, flange, job.track.branch[rows], job.track.q[rows]).q


def lagging(axes, gap, begin):
    joint, found = begin.copy(), np.empty_like(axes)
    for k, x in enumerate(axes):
        joint = found[k] = np.minimum(np.maximum(joint, x - gap / 2), x + gap / 2)
    return (axes - found) / (gap / 2)


@pytest.mark.parametrize("job", [line(), circle(), circle(0.2, 4.0)], ids=["line", "circle", "arc"])
def test_the_sides_are_those_of_every_place_in_turn(job):
    job = lossy(job)
    rows, along, axes = axes_along(job)
    first = job.track.q[rows[0] - 1]
    begin = np.minimum(np.maximum(START, first - GAP / 2), first + GAP / 2)
    side = lagging(axes, GAP, begin)[:, :2]
    found = job.lost_motion.programmed.at(rows, along)[:, :2]
    assert np.abs(found - side).max() < 0.02
    assert side.min() < -0.99 < 0.99 < side.max()
    ends = np.arange(len(job.toolpath))
    np.testing.assert_array_equal(job.conditions.direction, job.lost_motion.programmed.at(ends))


def test_an_axis_that_turns_round_inside_of_a_line_comes_to_its_end_from_the_other_side():
    """A1 and A3 from target to target alone would not tell: A2 and A3 are where they were."""
    job = lossy(line(kind=[Kind.LIN] * 4), axes=(2,))
    q = job.track.q
    rows, _, axes = axes_along(job)
    inner = axes[(rows == 2), 1]
    sense = np.sign(inner[-1] - inner[-2])
    assert abs(q[2, 1] - q[1, 1]) < 1e-9 < 1e-2 < np.ptp(inner)
    assert job.lost_motion.programmed.at(np.array([2]))[0, 1] == pytest.approx(sense)
    assert job.lost_motion.programmed.at(np.array([2]), np.array([0.4]))[0, 1] == pytest.approx(-sense)


def test_corrections_change_sides_where_an_axis_turns_round():
    job = lossy(line(kind=[Kind.LIN] * 4), axes=(2,))
    wanted = job.lost_motion.wanted
    rows, along, axes = axes_along(job)
    cut = rows == 2
    turn = along[cut][np.argmax(np.abs(axes[cut, 1] - axes[cut, 1][0]))]
    mine = (wanted.axis == 1) & (wanted.since > wanted.line.start[2]) & (wanted.until < wanted.line.start[3])
    (since,), (until,) = wanted.since[mine], wanted.until[mine]
    row, share = wanted.line.place(np.array([since, until]))
    assert row.tolist() == [2, 2]
    # under the force the motor turns round a little elsewhere than without it
    assert share[0] == pytest.approx(turn, abs=0.02)
    assert until - since >= SPACING
    band = dead_band(job)[2, 1]
    travel = np.interp(share, along[cut], axes[cut, 1])
    assert abs(travel[1] - travel[0]) < 2 * band
    sides = wanted.at(np.full(3, 2), np.array([share[0], share.mean(), share[1]]))[:, 1]
    np.testing.assert_allclose(sides * np.sign(sides[0]), [1.0, 0.0, -1.0], atol=1e-9)


def test_reversals_are_the_places_for_points():
    job = lossy(line(kind=[Kind.LIN] * 4), axes=(2,))
    rows, along = find_reversals(job, np.full(4, SPACING))
    # where the cut starts another reversal ends, as near behind it as a point may be
    first = (rows == 2) & (along * job.desired_path.length[2] < 1.001 * SPACING)
    assert first.sum() == 1
    inside = (rows == 2) & ~first
    assert inside.sum() == 2
    wanted = job.lost_motion.wanted
    side = wanted.at(rows[inside], along[inside])[:, 1]
    assert sorted(side) == pytest.approx([-1.0, 1.0])
    assert np.diff(along[inside])[0] * job.desired_path.length[2] >= SPACING * 0.999
    far = np.full(4, 0.5)
    assert not len(find_reversals(job, far)[0])  # no point so near to an end
    assert not len(find_reversals(line(), far)[0])  # nothing is asked for
    small = lossy(line(), axes=(2,), gap=0.1 * ROOM * job.tolerance)
    assert not len(find_reversals(small, np.full(4, SPACING))[0])  # nothing shows


def test_behind_a_reversal_between_two_motions_one_point_is_enough():
    """There and straight back along a line: the motor crosses its gap behind the turning point, sooner than a point may
    be; from the nearest one on the correction runs straight."""
    points = [[1.4, 0.0, 0.6], [1.4, 0.0, 0.5], [1.4, 0.1, 0.5], [1.4, 0.0, 0.5], [1.4, 0.0, 0.6]]
    job = task(points, [False, False, True, True, False], wrench=np.zeros(6), kind=[Kind.LIN] * 5)
    job = lossy(job, axes=(1,))
    done = subdivide(job, correct(job), Limits(max_growth=100.0))
    back = np.flatnonzero(done.source == 3)
    assert 2 <= len(back) <= 3
    place = done.share[back] * job.desired_path.length[3]
    assert place[0] == pytest.approx(1e-3, rel=1e-6)
    rows, share = np.full(40, 3), np.linspace(2.5e-3, 0.1, 40) / 0.1
    ends = np.flatnonzero(np.isin(done.source, [3]))
    along = np.interp(share, done.share[ends], np.arange(len(ends)))
    low = np.minimum(along.astype(int), len(ends) - 2)
    one, two = (done.command[ends[at]].position for at in (low, low + 1))
    written = one + (along - low)[:, None] * (two - one)
    wanted = job.desired_path.at(rows, share)
    meant = job.command(rows, wanted, np.zeros((40, 6)), job.goal(rows, wanted), share=share).command.position
    assert np.abs(written - meant).max() < 2e-6


def zigzag(step, count=40, y=0.0):
    """A line away from the robot at A1 = 0, every second point ``step`` [m] beside it."""
    x = 1.4 + 0.003 * np.arange(count)
    points = np.stack([x, y + step * (np.arange(count) % 2), np.full(count, 0.5)], axis=1)
    return np.concatenate([[[1.4, y, 0.6]], points, [[1.52, y, 0.6]]])


def zigzag_task(step, **words):
    points = zigzag(step)
    carries = np.ones(len(points), bool)
    carries[[0, 1, -1]] = False
    return task(points, carries, wrench=np.zeros(6), **words)


def test_rounding_is_no_reversal():
    """1 um at 1.4 m: 7e-7 rad to and fro."""
    job = lossy(zigzag_task(1e-6), axes=(1,))
    assert np.abs(np.diff(job.track.q[1:-1, 0])).max() > 5e-7
    side = job.lost_motion.wanted.at(np.arange(1, len(job.toolpath) - 1))[:, 0]
    assert len(set(side.tolist())) == 1
    assert np.abs(np.diff(job.conditions.direction[2:-1, 0])).max() < 0.02
    assert not len(find_reversals(job, np.full(len(job.toolpath), SPACING))[0])


def test_what_is_more_than_rounding_is_a_reversal():
    job = lossy(zigzag_task(0.1e-3), axes=(1,))
    side = job.lost_motion.wanted.at(np.arange(3, len(job.toolpath) - 1))[:, 0]
    assert (side[1:] == -side[:-1]).all()


def test_the_dead_band_is_the_tolerance_at_the_tool_the_digits_or_the_gap():
    job = zigzag_task(1e-6, tolerance=2e-5)
    lever = np.hypot(*job.wanted.position[5, :2])
    assert dead_band(job)[5, 0] == pytest.approx(ROOM * 2e-5 / lever, rel=1e-6)
    # digits of 0.001 mm in each of X, Y, Z
    exact = replace(job, tolerance=1e-9)
    assert 1e-6 / lever <= dead_band(exact)[5, 0] < 3e-6 / lever
    fine = lossy(job, axes=(1,), gap=1e-7)
    assert fine.lost_motion.wanted.at(np.array([5]))[0, 0] in (-1.0, 1.0)


def test_the_dead_band_holds_the_last_digits_of_angles_where_the_tool_turns():
    """Axes found anew for targets that are a last digit of each coordinate farther move by the band in all."""
    job = replace(line(), tolerance=1e-9)
    turns = rotation_from_abc(
        np.radians([[0.0, 0.0, 180.0 + 2.0 * (k % 2)] for k in range(len(job.toolpath))])
    )
    for turned, path in (
        (False, job.toolpath),
        (True, replace(job.toolpath, targets=replace(job.toolpath.targets, rotation=turns))),
    ):
        row, robot = 2, job.model.robot.nominal
        band = dead_band(replace(job, toolpath=path))[row]
        axes = job.track.q[row : row + 1]
        flange = job.wanted[row : row + 1] @ job.tool[row : row + 1].inverse()
        moved = np.zeros(6)
        for k in range(6 if turned else 3):
            pose = job.wanted[row : row + 1]
            if k < 3:
                pose = Poses(pose.rotation, pose.position + 1e-6 * np.eye(3)[k])
            else:
                turn = rotation_from_vector(np.radians(1e-3) * np.eye(3)[k - 3 : k - 2])
                pose = Poses(turn @ pose.rotation, pose.position)
            target = pose @ job.tool[row : row + 1].inverse()
            there = inverse(robot, target, job.track.branch[row : row + 1], axes).q
            moved += np.abs(there - inverse(robot, flange, job.track.branch[row : row + 1], axes).q)[0]
        assert band == pytest.approx(moved, rel=0.01, abs=1e-9)


@pytest.mark.parametrize(
    ("places", "digit"),
    [([1.0, 20.0], 1e-3), ([1.25, 3.0], 1e-2), ([0.001, 2.0], 1e-3), ([1 / 3, 2 / 3], 1e-6)],
)
def test_the_last_digit_of_targets(places, digit):
    assert position_digit(np.array([[*places, np.nan]]) * 1e-3) == pytest.approx(digit * 1e-3)


@pytest.mark.parametrize("process", [True, False])
def test_a_corrected_joint_stands_where_it_is_wanted_but_for_a_dead_band(process):
    job = replace(circle(0.2, 6.0), process=process)
    job = lossy(job)
    lost = job.lost_motion
    run = lost.run(1.0)
    cut = (lost.row == 2) & (lost.share > 0.05) & lost.moved
    off = np.abs(run.joint - lost.aim)[cut][:, :2]
    lag = np.abs(lost.programmed.joint - lost.axes)[cut][:, :2]
    assert lag.max() == pytest.approx(GAP / 2)
    assert off.max() < 0.05 * GAP


def test_without_a_gain_the_program_runs_as_it_is_programmed():
    lost = lossy(circle()).lost_motion
    assert np.array_equal(lost.run(0.0).joint, lost.programmed.joint)


def test_half_a_correction_leaves_half_of_the_lag():
    lost = lossy(replace(circle(0.2, 6.0, wrench=np.zeros(6)), process=False), axes=(1,)).lost_motion
    cut = (lost.row == 2) & (np.abs(lost.programmed.shares[:, 0]) > 0.999) & (lost.share > 0.2)
    lag = [np.median(np.abs(lost.run(gain).joint - lost.aim)[cut, 0]) for gain in (0.0, 0.5)]
    assert lag[1] == pytest.approx(0.5 * lag[0], rel=0.1)


def test_with_process_the_goal_lies_in_the_middle_of_the_gap():
    """No base that was touched off lies on both sides: lost motion is corrected though no force makes it."""
    job = lossy(line())
    rows = np.array([1, 2])
    wanted = job.wanted[rows]
    goal = job.goal(rows, wanted)
    np.testing.assert_allclose(goal.position, wanted.position, atol=1e-9)
    none = np.zeros((2, 6))
    there = job.simulated(rows, wanted, none).pose.position
    assert (np.linalg.norm(there - goal.position, axis=1) > 0.1e-3).all()
    done = job.command(rows, wanted, none, goal)
    again = job.simulated(rows, done.command, none, corrected=True).pose.position
    np.testing.assert_allclose(again, goal.position, atol=1e-7)


def test_behind_an_unknown_place_a_side_is_unknown():
    job = line()
    q = job.track.q.copy()
    q[1] = np.nan
    job = lossy(replace(job, track=replace(job.track, q=q)), axes=(1,))
    assert job.conditions.direction[:3, 0].tolist() == [job.conditions.direction[0, 0], 0.0, 0.0]


def test_a_model_without_gaps_asks_for_nothing():
    job = line()
    assert add_lost_motion(job, START, np.full(4, SPACING)) is job


def test_places_on_the_line_of_motions():
    where = MotorPath.of(np.array([0.0, 0.5, 0.25]))
    rows, along = np.array([0, 1, 2, 1]), np.array([0.5, 0.25, 1.0, 0.0])
    position = where.position(rows, along)
    np.testing.assert_allclose(position, [0.5, 1.125, 1.75, 1.0])
    back = where.place(position)
    assert back[0].tolist() == [0, 1, 2, 1]
    np.testing.assert_allclose(back[1], along)
    before = where.place(where.position(np.array([-1]), 0.5))
    assert (before[0].tolist(), before[1].tolist()) == ([0], [0.0])
    near = where.drawn(np.array([1.0005, 1.25, 1.4995]), np.full(3, 1e-3))
    np.testing.assert_allclose(near, [1.0, 1.25, 1.5])


@pytest.mark.parametrize("sweep", [1.66, 1.70, 1.75])
def test_an_axis_that_turns_round_shortly_before_the_end_is_seen(sweep):
    """A1 turns round at 93.6 deg: between two places that are looked at first, and by the end goes less far back."""
    job = lossy(circle(0.2, sweep), axes=(1,))
    rows, _, axes = axes_along(job)
    first = job.track.q[rows[0] - 1]
    side = lagging(axes, GAP, np.minimum(np.maximum(START, first - GAP / 2), first + GAP / 2))[rows == 2, 0]
    assert abs(side[-1] - side[2000]) > 0.1
    assert job.conditions.direction[2, 0] == pytest.approx(side[-1], abs=0.02)


def test_a_correction_just_behind_a_reversal_is_that_of_the_new_side():
    job = lossy(line(wrench=np.zeros(6), kind=[Kind.LIN] * 4), axes=(2,))
    rows, along = find_reversals(job, np.full(4, SPACING))
    inside = (rows == 2) & (along * job.desired_path.length[2] > 1.001 * SPACING)
    rows, along = rows[inside], along[inside]
    wanted, none = job.desired_path.at(rows, along), np.zeros((2, 6))
    goal = job.goal(rows, wanted)
    done = job.command(rows, wanted, none, goal, share=along)
    shift = done.command.position - wanted.position
    assert np.linalg.norm(shift[1] - shift[0]) > 0.25e-3  # the whole gap at 1.27 m
    there = job.simulated(rows, done.command, none, share=along, corrected=True).pose.position
    assert np.linalg.norm(there - goal.position, axis=1).max() < ROOM * job.tolerance
    # as it is programmed the motor has not crossed the gap there
    assert abs(job.conditions_at(rows, along).direction[:, 1]).min() > 0.5
    assert np.ptp(np.sign(job.conditions_at(rows, along).direction[:, 1])) == 0


@pytest.mark.parametrize("process", [True, False])
def test_the_motors_of_a_correction_are_known_before(process):
    job = line()
    offset = made("joint_offset", job.model.robot.joints)
    model = with_terms(job.model, (offset, nulls(offset) | {"o1": 1e-3}))
    job = lossy(replace(job, model=model, process=process))
    rows = np.array([2])
    wanted = job.wanted[rows]
    done = job.command(rows, wanted, job.wrench[rows], job.goal(rows, wanted))
    lost = job.lost_motion
    end = np.flatnonzero((lost.row == 2) & (lost.share == 1.0))[0]
    motor = lost.aim[end] + 0.5 * lost.gap * lost.wanted.at(rows)[0]
    bent = np.abs(done.q[0] - job.track.q[2])
    assert bent.max() > 3e-4
    np.testing.assert_allclose(motor[:3], done.q[0, :3], atol=0.03 * bent.max())


def test_a_correction_sets_out_from_where_the_joint_lies():
    """A1 comes to the cut over a little more than half of its gap from the other side: the joint has not followed."""
    y = np.array([-0.1, 0.0, -0.3 * GAP * 1.4, -0.3 * GAP * 1.4, -0.3 * GAP * 1.4])
    points = np.stack([[1.4, 1.4, 1.4, 1.45, 1.45], y, [0.5, 0.5, 0.5, 0.5, 0.6]], axis=1)
    job = lossy(task(points, [False, False, False, True, False], wrench=np.zeros(6)), axes=(1,))
    lost = job.lost_motion
    begin = np.flatnonzero((lost.row == 3) & lost.moved)[0]
    assert abs(lost.programmed.at(np.array([2]))[0, 0]) == pytest.approx(0.4, abs=0.02)
    off = abs(lost.run(1.0).joint - lost.aim)[begin, 0]
    assert off < 0.01 * GAP


def test_sides_hold_until_their_band_is_crossed():
    where = MotorPath.of(np.full(4, 1.0))
    position = np.array([0.0, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0])
    shares = np.array([[0.5, 1.0, 0.2, -0.9, -1.0, 1.0, 0.1]]).T
    anew = np.array([True, False, False, False, False, True, False])
    turns = Reversals.of(where, position, shares, anew, np.full(4, 0.1))
    assert turns.since.tolist() == [1.0, 2.5]  # the last place of the old side; and before what is not known
    assert turns.until.tolist() == [2.5, 3.0]
    rows, along = where.place(np.array([0.5, 1.0, 1.75, 2.5, 3.5]))
    np.testing.assert_allclose(turns.at(rows, along)[:, 0], [1.0, 1.0, 0.0, -1.0, 1.0], atol=1e-12)
    # what is known of it comes later
    shares[[4, 5, 6]] = [[0.3], [0.0], [1.0]]
    shares[3] = -1.0
    later = Reversals.of(where, position, shares, anew, np.full(4, 0.1))
    assert (later.since[1], later.until[1]) == (2.5, 3.0)


def test_an_axis_that_never_turns_round_has_a_side():
    """And one that never moves has none."""
    where = MotorPath.of(np.full(3, 1.0))
    shares = np.array([[0.0, 0.4, 1.0, 0.9], [0.0, 0.0, 0.0, 0.0]]).T
    turns = Reversals.of(
        where, np.array([0.0, 1, 2, 3]), shares, np.array([True, False, False, False]), np.ones(3)
    )
    assert turns.at(np.array([0, 2])).tolist() == [[1.0, 0.0], [1.0, 0.0]]
    assert not len(turns.axis)


def test_to_and_fro_at_one_target_is_nothing():
    where = MotorPath.of(np.full(3, 1.0))
    position = np.array([0.0, 1.0, 2.0, 2.0 + 1e-5, 2.5, 3.0])
    shares = np.array([[0.0, 1.0, 1.0, -1.0, 1.0, 1.0]]).T
    turns = Reversals.of(where, position, shares, np.arange(6) == 0, np.full(3, 0.1))
    assert not len(turns.axis)
    shares[4:] = -1.0
    once = Reversals.of(where, position, shares, np.arange(6) == 0, np.full(3, 0.1))
    assert (once.since.tolist(), once.until.tolist()) == ([2.0], [2.1])
    assert (once.old.tolist(), once.new.tolist()) == ([1.0], [-1.0])


def test_with_gaps_a_prediction_starts_from_no_other_state():
    """The one nearby may lie on the other side of a gap: nothing of it goes into the result."""
    for job, same in ((lossy(circle()), True), (circle(), False)):
        rows = np.array([2])
        case = rows, job.wanted[rows], job.force.along(rows, np.ones(1))
        alone = job.simulated(*case)
        beside = job.simulated(*case, start=alone.displacement + 1e-3)
        assert np.array_equal(alone.pose.position, beside.pose.position) is same
        np.testing.assert_allclose(beside.pose.position, alone.pose.position, atol=1e-8)
