"""Arms without a closed form: Newton's inverse kinematics, axes along a program, and the whole job on such an arm."""

import math
from dataclasses import replace

import numpy as np
import pytest
from motions import motions

from postproc.base.findings import Finding
from postproc.base.geometry import Poses, rotation_from_vector, vector_from_rotation
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import mirror, pose_error, predict
from postproc.effects.effect import Conditions
from postproc.model import StiffnessModel
from postproc.robot import newton
from postproc.robot.axis_track import follow_axes, is_near_singular, nominal_flange, singular_words
from postproc.robot.description import find_robot, load_robot
from postproc.robot.geometries import SerialArm
from postproc.robot.inverse import branch_of, inverse
from postproc.robot.newton import FAR, TOLERANCE, solver_of
from postproc.robot.stated_branches import stated_changes
from postproc.toolpath import Configuration, Kind

DEG = math.pi / 180

# the 7-joint arm of KUKA's LBR type: its third joint is the one that programs call E1
SEVEN = """\
name: seven
geometry:
  source: made up, of the type of an LBR iiwa
  dh:
    unit: mm
    angle_unit: deg
    rows:
      - {a: 0, alpha: -90, d: 340}
      - {a: 0, alpha: 90, d: 0}
      - {a: 0, alpha: 90, d: 400}
      - {a: 0, alpha: -90, d: 0}
      - {a: 0, alpha: -90, d: 400}
      - {a: 0, alpha: 90, d: 0}
      - {a: 0, alpha: 0, d: 126}
joints:
  source: made up
  unit: deg
  external: E1
  A1: [-170, 170]
  A2: [-120, 120]
  E1: [-170, 170]
  A3: [-120, 120]
  A4: [-170, 170]
  A5: [-120, 120]
  A6: [-175, 175]
"""
RAIL_JOINT = "  E1: {kind: prismatic, limits: [0, 6000], unit: mm}\n  A1:"


@pytest.fixture(scope="module")
def ur5():
    return load_robot(find_robot("ur5"))


@pytest.fixture(scope="module")
def seven(tmp_path_factory):
    path = tmp_path_factory.mktemp("robot") / "seven.yaml"
    path.write_text(SEVEN, encoding="utf-8")
    return load_robot(path)


@pytest.fixture(scope="module")
def on_rail(tmp_path_factory):
    """The KR 270 on a linear axis along its +y."""
    text = find_robot("kuka_kr270").read_text(encoding="utf-8")
    text = (
        text[: text.index("effects:")].replace("  kuka:", "  rail: +y\n  kuka:").replace("  A1:", RAIL_JOINT)
    )
    path = tmp_path_factory.mktemp("robot") / "rail.yaml"
    path.write_text(text, encoding="utf-8")
    return load_robot(path)


def as_general(robot):
    """A KUKA-type arm as any serial arm: solved by Newton's method instead of the closed form."""
    arm = robot.nominal
    links = arm.links()
    tip = links[-1].after.inverse() @ arm.flange()
    return replace(robot, nominal=SerialArm("dh", arm.axes, tuple(links), tip, robot.external))


def states(robot, count, seed=0):
    low, high = robot.limits.T
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def left_over(robot, q, pose):
    """Largest distance [m] and turn [rad] to the poses."""
    back = nominal_flange(robot, q)
    turn = vector_from_rotation(back.rotation @ np.swapaxes(pose.rotation, 1, 2))
    return max(
        np.linalg.norm(back.position - pose.position, axis=1).max(), np.linalg.norm(turn, axis=1).max()
    )


# Newton's inverse


@pytest.mark.parametrize("name", ["ur5", "seven", "staubli_tx2_90l"])
def test_there_and_back_from_nearby(name, request):
    robot = load_robot(find_robot(name)) if name == "staubli_tx2_90l" else request.getfixturevalue(name)
    q = states(robot, 4000)
    pose = nominal_flange(robot, q)
    near = q + np.random.default_rng(1).uniform(-0.02, 0.02, q.shape)
    if robot.external is not None:
        near[:, robot.external] = q[:, robot.external]
    found = inverse(robot.nominal, pose, np.zeros(len(q), int), near)
    assert found.reachable.all()
    assert left_over(robot, found.q, pose) < 1.01 * TOLERANCE
    clear = ~is_near_singular(robot, q)
    assert clear.mean() > 0.8
    assert np.abs(found.q - q)[clear].max() < 1e-9


def test_held_joint_keeps_its_value(seven):
    q = states(seven, 300)
    near = q + np.random.default_rng(1).uniform(-0.05, 0.05, q.shape)
    found = inverse(seven.nominal, nominal_flange(seven, q), np.zeros(300, int), near)
    assert np.array_equal(found.q[found.reachable, 2], near[found.reachable, 2])
    assert found.reachable.mean() > 0.85
    rows = found.reachable
    assert left_over(seven, found.q[rows], nominal_flange(seven, q)[rows]) < 1e-12


def test_closed_form_and_newton_are_one(on_rail):
    """The KR 270 on its rail: the closed form of the branch and Newton's from nearby give the same axes."""
    q = states(on_rail, 1000)
    pose = nominal_flange(on_rail, q)
    near = q + np.random.default_rng(1).uniform(-0.02, 0.02, q.shape)
    near[:, 0] = q[:, 0]
    closed = inverse(on_rail.nominal, pose, branch_of(on_rail.nominal, q), near)
    general = as_general(on_rail)
    assert np.abs(nominal_flange(general, q).position - pose.position).max() < 1e-13
    numeric = inverse(general.nominal, pose, np.zeros(1000, int), near)
    assert closed.reachable.all()
    assert numeric.reachable.all()
    clear = ~is_near_singular(on_rail, q)
    assert np.abs(closed.q - numeric.q)[clear].max() < 1e-9
    assert np.array_equal(numeric.q[:, 0], q[:, 0])


def test_branch_is_that_of_near(ur5):
    """The same pose from elbow up, elbow down and wrist flipped: each stays what it is."""
    up = np.radians([[20.0, -80, 90, -100, -80, 30]])
    pose = nominal_flange(ur5, up)
    found = {}
    for name, other in {
        "up": up,
        "down": np.radians([[20.0, -5, -90, 5, -80, 30]]),
        "flipped": np.radians([[20.0, -80, 90, 80, 80, 210]]),
    }.items():
        result = inverse(ur5.nominal, pose, np.zeros(1, int), other)
        assert result.reachable.all()
        assert left_over(ur5, result.q, pose) < 1e-12
        found[name] = result.q[0]
    assert found["up"] == pytest.approx(up[0], abs=1e-10)
    assert found["down"][2] < -0.5
    assert found["flipped"][4] > 0.5


def test_turns_are_those_of_near(ur5):
    q = np.radians([[20.0, -80, 90, -100, -80, 30]])
    pose = nominal_flange(ur5, q)
    for turns in ([0, 0, 0, 0, 0, 1], [1, 0, 0, 1, 0, 0], [-1, 0, 0, 0, 0, -1]):
        near = q + 2 * np.pi * np.array(turns) + 0.01
        found = inverse(ur5.nominal, pose, np.zeros(1, int), near)
        assert found.q == pytest.approx(near - 0.01, abs=1e-9)


def test_out_of_reach_is_not_reachable(ur5):
    q = states(ur5, 50)
    pose = nominal_flange(ur5, q)
    away = pose.position / np.linalg.norm(pose.position, axis=1)[:, None] * 1.3
    found = inverse(ur5.nominal, Poses(pose.rotation, away), np.zeros(50, int), q)
    assert not found.reachable.any()
    assert np.isnan(found.q).all()
    inside = np.array([[0.02, 0.0, 0.3]])
    found = inverse(ur5.nominal, Poses(np.eye(3)[None], inside), np.zeros(1, int), q[:1])
    assert not found.reachable.any()


def test_edge_of_reach(ur5):
    """Arm nearly stretched: a step inwards is reached, a step beyond is not."""
    q = np.radians([[10.0, -40, 1.0, -60, 50, 20]])
    pose = nominal_flange(ur5, q)
    wrist = np.array([math.cos(10 * DEG), math.sin(10 * DEG), 0])
    out = -(wrist * math.cos(40 * DEG) - [0, 0, math.sin(40 * DEG)])
    for push, expected in ((-1e-3, True), (1e-3, False)):
        moved = Poses(pose.rotation, pose.position + push * out)
        assert inverse(ur5.nominal, moved, np.zeros(1, int), q).reachable[0] == expected


def test_unknown_stays_unknown(ur5):
    q = np.radians([[20.0, -80, 90, -100, -80, 30]])
    pose = nominal_flange(ur5, np.repeat(q, 3, axis=0))
    position = pose.position.copy()
    position[1] = np.nan
    near = np.repeat(q, 3, axis=0)
    near[2, 0] = np.nan
    found = inverse(ur5.nominal, Poses(pose.rotation, position), np.zeros(3, int), near)
    assert found.reachable.tolist() == [True, False, False]
    assert np.isnan(found.q[1:]).all()
    none = inverse(ur5.nominal, pose[:0], np.zeros(0, int), near[:0])
    assert none.q.shape == (0, 6)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["ur5", "seven", "staubli_tx2_90l"])
def test_far_target_is_found_within_the_limits(name, request):
    """From one posture for all, even a singular one: what can be reached is, within the limits."""
    robot = load_robot(find_robot(name)) if name == "staubli_tx2_90l" else request.getfixturevalue(name)
    q = 0.95 * states(robot, 200)
    if robot.external is not None:
        q[:, robot.external] = 0.0
    pose = nominal_flange(robot, q)
    middle = np.zeros_like(q)
    found = inverse(robot.nominal, pose, np.zeros(200, int), middle)
    assert found.reachable.mean() > 0.98
    rows = found.reachable
    assert left_over(robot, found.q[rows], pose[rows]) < 1e-12
    low, high = robot.limits.T
    inside = ((found.q >= low - 1e-9) & (found.q <= high + 1e-9)).all(axis=1)
    assert inside[rows].mean() > 0.98


def test_a_correction_never_jumps_to_another_branch(ur5):
    """Just beyond reach, with ``near`` at the edge: other branches are no answer."""
    q = np.radians([[10.0, -40, 0.5, -60, 50, 20]])
    pose = nominal_flange(ur5, q)
    base = np.array([0.0, 0, 0.089159])
    out = (pose.position - base) / np.linalg.norm(pose.position - base)
    found = inverse(ur5.nominal, Poses(pose.rotation, pose.position + 0.02 * out), np.zeros(1, int), q)
    assert solver_of(ur5.nominal).distance(q, Poses(pose.rotation, pose.position + 0.02 * out))[0] < FAR
    assert not found.reachable[0]


def test_singular_places_are_told(ur5, seven):
    clear = np.radians([20.0, -80, 90, -100, -80, 30])
    assert not is_near_singular(ur5, clear[None])[0]
    for axis, degrees in ((4, 0.0), (4, 0.3), (4, 180.0), (2, 0.0), (2, 0.4)):
        q = clear.copy()
        q[axis] = degrees * DEG
        assert is_near_singular(ur5, q[None])[0]
    assert "move far for a small step" in singular_words(ur5)
    bent = np.radians([10.0, 30, 0, -80, 10, 60, 20])
    assert not is_near_singular(seven, bent[None])[0]
    bent[3] = 0.0
    assert is_near_singular(seven, bent[None])[0]


def test_singular_words_name_the_joint(on_rail):
    assert singular_words(on_rail).startswith("A5 near 0")


def test_no_s_and_t(ur5):
    q = states(ur5, 10)
    assert branch_of(ur5.nominal, q).tolist() == [0] * 10
    turned = stated_changes(ur5, Configuration({"turn": np.zeros(10)}).for_motions(10), q, -q)
    assert not turned.crossed.any()


# along a program

START = np.radians([10.0, -80, 100, -110, -80, 15])


def winding(robot, count, start=START, wide=0.1, spin=6.0):
    """A path that goes in circles and turns the tool ``spin`` rad in all."""
    home = nominal_flange(robot, start[None])[0]
    s = np.linspace(0, 1, count)
    laps = 2 * np.pi * 7 * s
    place = np.stack([wide * (np.cos(laps) - 1) + 0.05 * s, wide * np.sin(laps), -0.05 * s], axis=1)
    turn = np.stack([0.2 * np.sin(9 * s), 0 * s, spin * s], axis=1)
    return Poses(rotation_from_vector(turn) @ home.rotation, home.position + place)


@pytest.mark.sample(1)
@pytest.mark.parametrize("count", [1, 2, 3, 10, 400, 1001])
def test_path_is_followed_as_if_motion_by_motion(ur5, count):
    target = winding(ur5, count)
    track = follow_axes(ur5, motions(target), target, START)
    assert track.reachable.all()
    assert track.turn_matches.all()
    assert track.branch.tolist() == [0] * count
    assert left_over(ur5, track.q, target) < 1e-12
    solver, q = solver_of(ur5.nominal), START[None]
    for row in range(count):
        q, *_ = solver.follow(q, target[row : row + 1])
        assert np.abs(q[0] - track.q[row]).max() < 1e-9
    if count > 100:
        assert np.abs(np.diff(track.q, axis=0)).max() < 0.3


def test_path_turns_on_beyond_half_a_turn_and_limits_are_told(ur5):
    target = winding(ur5, 500, spin=8.0)
    track = follow_axes(ur5, motions(target), target, START)
    assert np.abs(np.diff(track.q, axis=0)).max() < 0.3
    assert abs(track.q[-1, 5]) > 2 * np.pi
    assert np.array_equal(track.within, (np.abs(track.q) <= 2 * np.pi + 1e-9).all(axis=1))
    assert 0 < track.within.sum() < 500


@pytest.mark.slow
def test_a_stretch_begun_elsewhere_is_marched_again(ur5):
    """The ends of the stretches alone would lose the whole turn that the path makes between them."""
    count = 64  # stretches of 8 rows: the tool goes once round in each
    target = winding(ur5, count, wide=0.01, spin=0.0)
    spin = 2 * np.pi * np.arange(count) / 8
    turn = rotation_from_vector(np.stack([0 * spin, 0 * spin, spin], axis=1))
    target = Poses(turn @ target.rotation, target.position)
    track = follow_axes(ur5, motions(target), target, START)
    solver, q = solver_of(ur5.nominal), START[None]
    for row in range(count):
        q, *_ = solver.follow(q, target[row : row + 1])
        assert np.abs(q[0] - track.q[row]).max() < 1e-9
    assert track.q[-1, 5] - START[5] < -40  # seven whole turns and more


def flipped(robot, q):
    """The same poses with the wrist on the other side."""
    near = q + np.array([0, 0, 0, np.pi, 0, np.pi])
    near[:, 4] *= -1
    wrist = inverse(robot.nominal, nominal_flange(robot, q), np.zeros(len(q), int), near)
    assert wrist.reachable.all()
    assert (np.sign(wrist.q[:, 4]) == -np.sign(q[:, 4])).all()
    return wrist.q


def test_axis_motion_sets_where_it_goes_on(ur5):
    q = np.repeat(START[None], 6, axis=0)
    q[:, 5] += np.arange(6) * 0.1
    q[3:] = flipped(ur5, q)[3:]
    target = nominal_flange(ur5, q)
    track = follow_axes(ur5, motions(target, axes={3: q[3]}), target, START)
    assert np.abs(track.q - q).max() < 1e-8
    # nothing before the axis motion is known without a start
    track = follow_axes(ur5, motions(target, axes={3: q[3]}), target, None)
    assert track.branch.tolist() == [-1, -1, -1, 0, 0, 0]
    assert np.isnan(track.q[:3]).all()
    assert track.reachable.all()
    assert np.abs(track.q[3:] - q[3:]).max() < 1e-8


def test_home_is_where_the_program_starts(ur5):
    target = winding(ur5, 6)
    other = flipped(ur5, START[None])[0]
    lost = Poses(target.rotation.copy(), target.position.copy())
    lost.rotation[3], lost.position[3] = np.nan, np.nan
    kinds = [Kind.LIN, Kind.AXIS, Kind.LIN, Kind.PTP, Kind.LIN, Kind.LIN]
    for code, status in (("KRL016", 0), ("KRL003", -1)):
        words = {"kind": kinds, "axes": {1: other}, "refused": {3: Finding(code, "HOME")}}
        track = follow_axes(ur5, motions(lost, **words), lost, START)
        assert track.branch.tolist() == [0, 0, 0, status, status, status]
        assert np.isfinite(track.q[4]).all() == (status == 0)
        assert np.sign(track.q[:3, 4]).tolist() == [-1, 1, 1]
        if status == 0:
            assert np.sign(track.q[4:, 4]).tolist() == [-1, -1]
        assert np.isnan(track.q[3]).all()


def test_s_of_a_ptp_says_nothing_here(ur5):
    """Neither does it bring back a posture that was lost, nor does it choose one."""
    target = winding(ur5, 4)
    words = {"kind": [Kind.LIN, Kind.OTHER, Kind.PTP, Kind.LIN], "refused": {1: Finding("KRL001", "spline")}}
    lost = Poses(target.rotation.copy(), target.position.copy())
    lost.rotation[1], lost.position[1] = np.nan, np.nan
    track = follow_axes(ur5, motions(lost, **words, status=6, turn=5), lost, START)
    assert track.branch.tolist() == [0, -1, -1, -1]
    assert np.isnan(track.q[1:]).all()
    track = follow_axes(ur5, motions(target, kind=Kind.PTP, status=6, turn=5), target, START)
    assert np.abs(track.q - follow_axes(ur5, motions(target), target, START).q).max() < 1e-12
    assert track.turn_matches.all()


def test_motion_out_of_reach_is_passed_over(ur5):
    target = winding(ur5, 30)
    position = target.position.copy()
    # turned towards a place behind the robot, the arm is in another posture
    position[[0, 7, 8]] = [3.0, -2.0, -1.0]
    track = follow_axes(ur5, motions(target), Poses(target.rotation, position), START)
    assert np.flatnonzero(~track.reachable).tolist() == [0, 7, 8]
    assert np.isnan(track.q[[0, 7, 8]]).all()
    whole = follow_axes(ur5, motions(target), target, START)
    rows = track.reachable
    assert np.abs(track.q[rows] - whole.q[rows]).max() < 1e-8


def test_ptp_may_take_another_branch_where_its_own_has_no_way():
    """The far side of the base: no straight way there, but a point to point motion needs none."""
    robot = load_robot(find_robot("staubli_tx2_90l"))
    start = np.radians([0.0, 20, 90, 0, 60, 0])
    there = np.radians([[170.0, 30, 80, 10, 50, 0]])
    target = nominal_flange(robot, there)
    track = follow_axes(robot, motions(target, kind=Kind.PTP), target, start)
    assert track.reachable.all()
    assert track.within.all()
    assert left_over(robot, track.q, target) < 1e-12


def straight_ways(robot, count, seed=5):
    """Random straight motions: starts (N, 6), targets (N), where 200 small steps lead, and if these were smooth."""
    solver, rng = solver_of(robot.nominal), np.random.default_rng(seed)
    low, high = robot.limits.T
    starts = rng.uniform(np.maximum(low, -np.pi), np.minimum(high, np.pi), (count, 6))
    starts = starts[~is_near_singular(robot, starts)]
    here = nominal_flange(robot, starts)
    way, turn = (size * rng.normal(size=(len(starts), 3)) for size in (0.25 * solver.size, 0.5))
    q, smooth = starts.copy(), np.ones(len(starts), bool)
    for step in np.arange(1, 201) / 200:
        between = Poses(rotation_from_vector(step * turn) @ here.rotation, here.position + step * way)
        there, good = solver.solve(q, between)
        smooth &= good & (np.abs(there - q).max(axis=1) < 0.15)
        q[smooth] = there[smooth]
    return starts, between, q, smooth


def each_from(robot, starts, target, kind):
    """Axes (N, 6) at the end of motions, each after an axis motion to its own start."""
    n = len(starts)
    twice = Poses(np.repeat(target.rotation, 2, axis=0), np.repeat(target.position, 2, axis=0))
    axes = {2 * row: start for row, start in enumerate(starts)}
    kinds = np.tile([Kind.AXIS, kind], n)
    return follow_axes(robot, motions(twice, kind=kinds, axes=axes), twice, None).q[1::2]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur5", "staubli_tx2_90l"])
def test_long_straight_motion_stays_in_its_branch(name):
    """One long LIN ends where many small steps lead, and where these lead nowhere it is not reached."""
    robot = load_robot(find_robot(name))
    starts, target, q, smooth = straight_ways(robot, 150)
    assert 0.3 < smooth.mean() < 0.9
    found = each_from(robot, starts, target, Kind.LIN)
    reached = np.isfinite(found).all(axis=1)
    same = np.abs(found - q).max(axis=1) < 1e-6
    assert same[smooth].mean() > 0.98
    assert (reached & ~same)[smooth].mean() < 0.02
    assert reached[~smooth].mean() < 0.1


@pytest.mark.slow
def test_motion_that_is_not_reached_leaves_the_posture(ur5):
    """Out of the start's posture, to where no path leads, and back: the posture is still that of the start."""
    starts, target, _, smooth = straight_ways(ur5, 150)
    rows = np.flatnonzero(~smooth)
    n = len(rows)
    home = nominal_flange(ur5, starts[rows])
    there, back = target[rows], home
    rotation = np.stack([home.rotation, there.rotation, back.rotation], axis=1).reshape(-1, 3, 3)
    position = np.stack([home.position, there.position, back.position], axis=1).reshape(-1, 3)
    axes = {3 * i: starts[row] for i, row in enumerate(rows)}
    path = Poses(rotation, position)
    kinds = np.tile([Kind.AXIS, Kind.LIN, Kind.LIN], n)
    track = follow_axes(ur5, motions(path, kind=kinds, axes=axes), path, None)
    lost = ~track.reachable[1::3]
    assert lost.sum() > 20
    assert np.abs(track.q[2::3] - starts[rows])[lost].max() < 1e-9


@pytest.mark.slow
def test_point_to_point_needs_no_straight_way(ur5):
    """The same targets as PTP: all that can be reached at all are, within the limits."""
    starts, target, _, smooth = straight_ways(ur5, 150)
    within_reach = inverse(ur5.nominal, target, np.zeros(len(starts), int), np.zeros_like(starts)).reachable
    rows = np.flatnonzero(~smooth & within_reach)
    assert len(rows) > 10
    lin = each_from(ur5, starts[rows], target[rows], Kind.LIN)
    ptp = each_from(ur5, starts[rows], target[rows], Kind.PTP)
    assert np.isnan(lin).any(axis=1).mean() > 0.7
    reached = np.isfinite(ptp).all(axis=1)
    assert reached.mean() >= 0.95
    assert np.abs(ptp[reached]).max() <= 2 * np.pi
    assert left_over(ur5, ptp[reached], target[rows[reached]]) < 1e-12


def test_ptp_takes_a_turn_that_the_limits_allow(ur5):
    low = replace(ur5, nominal=narrow(ur5.nominal, 5, -200 * DEG, 200 * DEG))
    low = replace(
        low, joints=low.nominal.joints([axis.name for axis in low.nominal.axes], low.nominal.limits)
    )
    q = np.repeat(START[None], 3, axis=0)
    q[:, 5] = np.radians([190.0, 220.0, 230.0])
    target = nominal_flange(ur5, q)
    track = follow_axes(low, motions(target, kind=[Kind.LIN, Kind.PTP, Kind.LIN]), target, q[0])
    assert np.degrees(track.q[:, 5]) == pytest.approx([190, -140, -130])
    track = follow_axes(low, motions(target), target, q[0])
    assert np.degrees(track.q[:, 5]) == pytest.approx([190, 220, 230])
    assert track.within.tolist() == [True, False, False]


def narrow(arm, column, low, high):
    axes = list(arm.axes)
    axes[column] = replace(axes[column], lower=low, upper=high)
    return replace(arm, axes=tuple(axes))


def test_many_motions_are_followed_fast(ur5, monkeypatch):
    """Side by side, not one after the other: the calls grow with the root of the motions."""
    calls = []
    solve = newton.Solver.solve
    monkeypatch.setattr(
        newton.Solver, "solve", lambda self, *a, **k: (calls.append(1), solve(self, *a, **k))[1]
    )
    target = winding(ur5, 2500)
    assert follow_axes(ur5, motions(target), target, START).reachable.all()
    assert len(calls) < 400


# seven joints


def test_external_joint_keeps_its_start(seven):
    start = np.radians([10.0, 30, 20, -80, 10, 60, 20])
    target = winding(seven, 200, start, wide=0.05, spin=1.0)
    track = follow_axes(seven, motions(target), target, start)
    assert track.reachable.all()
    assert track.q.shape == (200, 7)
    assert track.q[:, 2] == pytest.approx(20 * DEG, abs=0)
    assert left_over(seven, track.q, target) < 1e-12
    assert np.abs(np.diff(track.q, axis=0)).max() < 0.2


def test_axis_motion_of_seven_joints_states_six(seven):
    start = np.radians([10.0, 30, 20, -80, 10, 60, 20])
    q = np.repeat(start[None], 3, axis=0)
    q[1:, 0] += 0.3
    target = nominal_flange(seven, q)
    six = np.delete(q[1], 2)
    track = follow_axes(seven, motions(target, axes={1: six}), target, start)
    assert np.abs(track.q - q).max() < 1e-9
    track = follow_axes(seven, motions(target, axes={1: six}), target, None)
    assert track.branch.tolist() == [-1] * 3
    assert np.isnan(track.q).all()


def test_kuka_on_its_rail_is_followed(on_rail):
    """S and T hold on the rail as they do on the floor, for the six axes of the arm."""
    floor = load_robot(find_robot("kuka_kr270"))
    q = np.tile(np.radians([10.0, -60, 80, 150, 45, 30]), (5, 1))
    q[:, 3] += np.arange(5) * 0.3
    target = nominal_flange(floor, q)
    moved = Poses(target.rotation, target.position + np.array([0, 2.5, 0]))
    words = {"kind": [Kind.LIN, Kind.PTP, Kind.LIN, Kind.LIN, Kind.LIN], "status": [-1, 6, -1, -1, -1]}
    words |= {"turn": [-1, 0b010010, -1, -1, -1], "axes": {3: q[3]}}
    ours = follow_axes(on_rail, motions(moved, **words), moved, np.array([2.5, *q[0]]))
    theirs = follow_axes(floor, motions(target, **words), target, q[0])
    assert np.abs(ours.q[:, 1:] - theirs.q).max() < 1e-12
    assert ours.q[:, 0].tolist() == [2.5] * 5
    for name in ("branch", "reachable", "within", "turn_matches"):
        assert np.array_equal(getattr(ours, name), getattr(theirs, name))
    assert np.array_equal(branch_of(on_rail.nominal, ours.q), branch_of(floor.nominal, theirs.q))
    assert np.array_equal(is_near_singular(on_rail, ours.q), is_near_singular(floor, theirs.q))
    lost = follow_axes(on_rail, motions(moved, **words), moved, None)
    assert lost.branch.tolist() == [-1] * 5


def test_straight_wrist_of_an_arm_that_counts_otherwise():
    """A5 = 0 on an arm whose axes 4 and 6 count the other way: A4 stays, A6 takes the rest."""
    robot = load_robot(find_robot("abb_irb120"))
    q = np.radians([[10.0, 20, 10, 50, 30, 10], [12.0, 20, 10, 120, 0, 20], [14.0, 20, 10, 60, 20, 40]])
    target = nominal_flange(robot, q)
    track = follow_axes(robot, motions(target), target, q[0])
    assert np.degrees(track.q[1]) == pytest.approx([12, 20, 10, 50, 0, 90], abs=1e-6)
    assert np.abs(track.q - q)[[0, 2]].max() < 1e-9
    assert left_over(robot, track.q, target) < 1e-12


# the whole job

SOFT = """
effects:
  - effect: joint_compliance
    parameters:
      c1: {value: 5.0e-5, unit: rad/(N m), source: made up}
      c2: {value: 4.0e-5, unit: rad/(N m), source: made up}
      c3: {value: 6.0e-5, unit: rad/(N m), source: made up}
      c4: {value: 2.0e-4, unit: rad/(N m), source: made up}
      c5: {value: 2.0e-4, unit: rad/(N m), source: made up}
      c6: {value: 2.0e-4, unit: rad/(N m), source: made up}
"""


def soft(folder):
    text = find_robot("ur5").read_text(encoding="utf-8").replace("name: ur5", "name: soft", 1)
    path = folder / "soft.yaml"
    path.write_text(text + SOFT, encoding="utf-8")
    return path


def test_mirror_on_a_general_arm(tmp_path):
    model = StiffnessModel.from_robot(load_robot(soft(tmp_path)))
    robot = model.robot
    wanted = winding(robot, 200)
    track = follow_axes(robot, motions(wanted), wanted, START)
    tool = Poses.identity()
    wrench = np.tile([30.0, -20, 60, 0.5, 0.2, 0.1], (200, 1))
    done = mirror(model, wanted, wanted, LoadCase(tool, wrench, Conditions(), track.branch, track.q))
    assert done.converged.all()
    assert np.nanmin(done.history[0]) > 2e-4
    real = predict(model, done.command, LoadCase(tool, wrench, Conditions(), track.branch, track.q))
    shift, turn = pose_error(real.pose, wanted)
    assert np.linalg.norm(shift, axis=1).max() < 1e-8
    assert np.linalg.norm(turn, axis=1).max() < 1e-8
    assert np.abs(done.q - track.q).max() < 0.1


CELL = """\
robot: soft.yaml
tools:
  1: {x: 0, y: 0, z: 100, a: 0, b: 0, c: 0, axis: +z}
bases:
  1: {x: -500, y: -200, z: 50, a: 0, b: 0, c: 0}
start: [10, -80, 100, -110, -80, 15]
"""
PROGRAM = [
    "DEF part()",
    "$BASE=BASE_DATA[1]",
    "$TOOL=TOOL_DATA[1]",
    "PTP {A1 10,A2 -80,A3 100,A4 -110,A5 -80,A6 15}",
    "LIN {X 0.000,Y 0.000,Z 50.000,A 0.000,B 0.000,C 180.000}",
    "LIN {Z 0.000}",
    ";FORCE -30 5 60 @base",
    "LIN {X 50.000,Y 0.000,Z -2.000,A 0.000,B 0.000,C 180.000}",
    "LIN {X 50.000,Y 80.000,Z -2.000,A 10.000,B 0.000,C 180.000}",
    ";FORCE OFF",
    "LIN {Z 50.000}",
    "END",
]


def test_main_job(compensate, job):
    soft(job.folder)
    job.cell(CELL)
    job.write(PROGRAM)
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code in (0, 3), done.err
    found = done.json
    assert found["robot"] == "soft"
    assert found["corrected"] == 2
    assert found["uncorrected"] == 0
    assert found["error_before_mm"]["max"] > 0.1
    assert found["error_after_mm"]["max"] < 0.002
    assert job.output.exists()


def test_main_job_on_a_rail(compensate, job):
    """The cell that works on the floor works 2 m down a rigid rail, with the base moved along."""
    plain = compensate(job.program, "--force", "--json", "-").json
    before = job.output.read_bytes()
    text = find_robot("kuka_kr270").read_text(encoding="utf-8")
    text = text.replace("  kuka:", "  rail: +y\n  kuka:").replace("  A1:", RAIL_JOINT)
    for i in range(6, 0, -1):  # c1 is the rail's own
        text = text.replace(f"      c{i}:", f"      c{i + 1}:")
    (job.folder / "rail.yaml").write_text(text, encoding="utf-8")
    cell = (job.folder / "cell.yaml").read_text(encoding="utf-8")
    cell = cell.replace("kuka_kr270", "rail.yaml").replace("y: -200", "y: 1800")
    job.cell(cell.replace("start: [0,", "start: [2000, 0,"))
    found = compensate(job.program, "--force", "--json", "-").json
    assert found["corrected"] == plain["corrected"] > 0
    for name in ("error_before_mm", "correction_mm"):
        assert found[name]["max"] == pytest.approx(plain[name]["max"], rel=1e-9)
    # every line but the mark, which names the robot file, is the same
    mark = [line for line in before.splitlines() if b"sha256" in line]
    after = job.output.read_bytes().splitlines()
    assert [line for line in after if b"sha256" not in line] == [
        line for line in before.splitlines() if line not in mark
    ]


def test_partial_point_after_an_axis_motion_on_a_rail(compensate, job):
    """What it leaves out is where the axis motion led, the rail where ``start`` says."""
    lines = job.program.read_text(encoding="latin-1").splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("LIN {X 0.000"))
    lines[first] = "LIN {Z 60.000}"
    lines = [*lines[: first + 1], ";FORCE -360 50 560 @base", "LIN {Z 40.000}", ";FORCE OFF", "END"]
    job.write(lines)
    floor = compensate("predict", job.program, "--force", "--json", "-").json
    text = find_robot("kuka_kr270").read_text(encoding="utf-8")
    text = text.replace("  kuka:", "  rail: +y\n  kuka:").replace("  A1:", RAIL_JOINT)
    for i in range(6, 0, -1):
        text = text.replace(f"      c{i}:", f"      c{i + 1}:")
    (job.folder / "rail.yaml").write_text(text, encoding="utf-8")
    cell = (job.folder / "cell.yaml").read_text(encoding="utf-8")
    cell = cell.replace("kuka_kr270", "rail.yaml").replace("y: -200", "y: 1800")
    job.cell(cell.replace("start: [0,", "start: [2000, 0,"))
    rail = compensate("predict", job.program, "--force", "--json", "-").json
    assert floor["error_before_mm"]["max"] > 0.1
    assert rail["error_before_mm"]["max"] == pytest.approx(floor["error_before_mm"]["max"], rel=1e-9)


def test_start_of_another_count_is_told(compensate, job):
    cell = (job.folder / "cell.yaml").read_text(encoding="utf-8").replace("start: [0,", "start: [0, 0,")
    job.cell(cell)
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code == 1
    (finding,) = done.json["findings"]
    assert finding["code"] == "YML004"
    assert "7 values are given; kuka_kr270 has 6 joints" in finding["message"]
    assert finding["line"] == cell[: cell.index("start")].count("\n") + 1
