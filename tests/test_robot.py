"""The arm: forward and inverse kinematics, KUKA's senses and S and T, axes along a program, and robot files."""

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from motions import milling_angles, motions
from plant import kr270, random_angles, random_tools
from reference import reference_flange

from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses, vector_from_rotation, wrapped
from postproc.model import StiffnessModel
from postproc.robot.axis_track import follow_axes, is_near_singular
from postproc.robot.branches import negative_axes
from postproc.robot.chain import Chain, generalized_force
from postproc.robot.description import find_robot, load_robot, robot_files
from postproc.robot.geometries import KukaLengths
from postproc.robot.inverse import branch_of, inverse
from postproc.toolpath import Kind

DEG = math.pi / 180
OTHER = KukaLengths(d1=0.675, a1=0.34, a2=1.15, a3=0.041, d4=1.2, d6=0.24)


@pytest.fixture(scope="module")
def robot():
    return kr270()


@pytest.fixture(scope="module")
def chain(robot):
    return Chain(robot.joints, robot.flange)


def chain_of(arm, robot):
    limits = [(joint.lower, joint.upper) for joint in robot.joints]
    return Chain(arm.joints([joint.name for joint in robot.joints], limits), arm.flange())


def apart(one, other):
    """Largest distance [m] and turn [rad] between two batches of poses."""
    turn = vector_from_rotation(one.rotation @ np.swapaxes(other.rotation, -1, -2))
    return (
        np.linalg.norm(one.position - other.position, axis=-1).max(),
        np.linalg.norm(turn, axis=-1).max(),
    )


# forward kinematics


def test_batch_is_pinocchios(robot):
    for arm in (robot.arm, OTHER):
        arms = chain_of(arm, robot)
        q = random_angles(robot, 200, np.random.default_rng(1))
        ours, reference = arms.flange(q), reference_flange(arms, q)
        assert np.abs(ours.position - reference.position).max() < 1e-14
        assert np.abs(ours.rotation - reference.rotation).max() < 1e-14


def test_jacobian_is_pinocchios(chain, robot):
    rng = np.random.default_rng(2)
    q, tool = random_angles(robot, 50, rng), random_tools(50, rng)
    ours = chain.jacobian(q, tool)
    flange = chain.model.frames[chain.model.getFrameId("flange")]
    for row in range(len(q)):
        model = chain.model.copy()
        place = flange.placement * pin.SE3(tool.rotation[row], tool.position[row])
        tcp = model.addFrame(pin.Frame("tcp", flange.parentJoint, 0, place, pin.FrameType.OP_FRAME))
        data = model.createData()
        reference = pin.computeFrameJacobian(model, data, q[row], tcp, pin.LOCAL_WORLD_ALIGNED)
        assert np.abs(ours[row] - reference).max() < 1e-14


def test_jacobian_is_the_derivative(chain, robot):
    rng = np.random.default_rng(3)
    q, tool = random_angles(robot, 50, rng), random_tools(50, rng)
    jacobian = chain.jacobian(q, tool)
    step = 1e-6
    for axis in range(6):
        move = step * np.eye(6)[axis]
        up, down = chain.flange(q + move) @ tool, chain.flange(q - move) @ tool
        linear = (up.position - down.position) / (2 * step)
        angular = vector_from_rotation(up.rotation @ np.swapaxes(down.rotation, 1, 2)) / (2 * step)
        assert np.abs(jacobian[:, :3, axis] - linear).max() < 1e-9
        assert np.abs(jacobian[:, 3:, axis] - angular).max() < 1e-9


def test_generalized_force_is_the_jacobian_transposed(chain, robot):
    rng = np.random.default_rng(4)
    q, tool, wrench = random_angles(robot, 50, rng), random_tools(50, rng), rng.normal(size=(50, 6))
    swept = chain.evaluate(np.ascontiguousarray(q.T), tool)
    torque = generalized_force(swept, swept.position, wrench.T)
    assert np.abs(torque.T - np.einsum("nij,ni->nj", chain.jacobian(q, tool), wrench)).max() < 1e-14


# KUKA's senses


def flange_at(chain, *degrees):
    return chain.flange(np.radians([degrees]))[0]


def test_upright_arm_with_level_forearm(chain):
    pose = flange_at(chain, 0, -90, 90, 0, 0, 0)
    assert pose.position == pytest.approx([1.680, 0.0, 1.945], abs=1e-14)
    assert pose.rotation[:, 2] == pytest.approx([1, 0, 0], abs=1e-15)


def test_zero_pose_is_stretched_forward(chain):
    pose = flange_at(chain, 0, 0, 0, 0, 0, 0)
    assert pose.position == pytest.approx([0.350 + 1.250 + 1.100 + 0.230, 0.0, 0.750 - 0.055], abs=1e-14)
    # the flange looks ahead (z), its x down
    assert pose.rotation == pytest.approx(np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]), abs=1e-15)


@pytest.mark.parametrize("angle", [10, 90, 170])
def test_a1_turns_clockwise_seen_from_above(chain, angle):
    x, y, _ = flange_at(chain, angle, -90, 90, 0, 0, 0).position
    assert math.atan2(y, x) == pytest.approx(-angle * DEG)


def test_a2_and_a3_turn_down(chain):
    level = flange_at(chain, 0, -90, 90, 0, 0, 0).position
    assert flange_at(chain, 0, -80, 90, 0, 0, 0).position[2] < level[2] - 0.1
    assert flange_at(chain, 0, -90, 100, 0, 0, 0).position[2] < level[2] - 0.1


def test_a5_at_90_points_the_tool_down(chain):
    pose = flange_at(chain, 0, -90, 90, 0, 90, 0)
    assert pose.rotation[:, 2] == pytest.approx([0, 0, -1], abs=1e-15)
    assert pose.position == pytest.approx([1.450, 0.0, 1.945 - 0.230], abs=1e-14)


def test_a4_and_a6_turn_about_minus_x(chain):
    """About -x what points down goes to the robot's right, -y: (-x) x (-z) = -y."""
    pose = flange_at(chain, 0, -90, 90, 90, 90, 0)
    assert pose.rotation[:, 2] == pytest.approx([0, -1, 0], abs=1e-15)
    pose = flange_at(chain, 0, -90, 90, 0, 0, 90)
    assert pose.rotation[:, 0] == pytest.approx([0, -1, 0], abs=1e-15)


# inverse kinematics


@pytest.mark.parametrize("arm", [None, OTHER])
def test_inverse_of_forward_in_all_branches(robot, arm):
    arm = arm or robot.arm
    arms, rng = chain_of(arm, robot), np.random.default_rng(5)
    q = rng.uniform(-math.pi, math.pi, (4000, 6))
    branch = branch_of(arm, q)
    assert sorted(set(branch)) == list(range(8))
    pose = arms.flange(q)
    found = inverse(arm, pose, branch, q)
    assert found.reachable.all()
    far, turned = apart(arms.flange(found.q), pose)
    assert far < 1e-9
    assert turned < 1e-9
    clear = ~is_near_singular(replace(robot, nominal=arm), q)
    assert clear.sum() > 3000
    assert np.array_equal(branch_of(arm, found.q[clear]), branch[clear])
    assert np.abs(found.q - q)[clear].max() < 1e-10


def test_every_branch_reaches_the_pose_its_own_way(chain, robot):
    """A pose over the robot's head side: the branches that reach it are different angles, each with its own S."""
    q = np.radians([[20.0, -100, 110, 30, 50, 70]])
    pose = chain.flange(np.repeat(q, 8, axis=0))
    found = inverse(robot.arm, pose, np.arange(8), np.zeros((8, 6)))
    assert found.reachable.sum() >= 4
    rows = np.flatnonzero(found.reachable)
    far, turned = apart(chain.flange(found.q[rows]), pose[rows])
    assert far < 1e-9
    assert turned < 1e-9
    assert np.array_equal(branch_of(robot.arm, found.q[rows]), rows)
    for one in rows:
        for other in rows[rows > one]:
            assert np.abs(wrapped(found.q[one] - found.q[other])).max() > 0.1


def test_turns_are_those_nearest_to_the_wish(chain, robot):
    q = milling_angles(200, np.random.default_rng(6))
    turns = np.random.default_rng(7).integers(-1, 2, (200, 3))
    far = q.copy()
    far[:, [0, 3, 5]] += 2 * math.pi * turns
    found = inverse(robot.arm, chain.flange(q), branch_of(robot.arm, q), far + 0.5)
    assert np.abs(found.q - far).max() < 1e-10


@pytest.mark.parametrize("branch", range(8))
def test_out_of_reach(robot, branch):
    """Too far, and for the arm that looks ahead also too near to its shoulder."""
    wrist = np.array([[4.0, 0, 1.0], [0, 0, 9.0], [-6.0, 1, 1], [0.40, 0.0, 0.75]])[: 3 if branch & 1 else 4]
    turned = np.broadcast_to(np.eye(3), (len(wrist), 3, 3))
    pose = Poses(turned, wrist + robot.arm.d6 * np.array([0, 0, 1.0]))
    found = inverse(robot.arm, pose, np.full(len(wrist), branch), np.zeros((len(wrist), 6)))
    assert not found.reachable.any()
    assert np.isnan(found.q).any(axis=1).all()


def test_reach_ends_where_the_arm_is_stretched(chain, robot):
    """A step inside of the sphere is reached, a step outside is not; 2700 mm is the reach to the wrist."""
    tilt = math.atan2(0.055, 1.1)
    assert 0.35 + 1.25 + math.hypot(1.1, 0.055) == pytest.approx(2.700, abs=0.002)
    q = np.array([[0.3, -0.4, -tilt + 1e-4, 0.2, 0.5, 0.1]])
    pose = chain.flange(q)
    wrist = pose.position - robot.arm.d6 * pose.rotation[:, :, 2]
    shoulder = np.array([0.35 * math.cos(0.3), -0.35 * math.sin(0.3), 0.75])
    out = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    for push, expected in ((-1e-6, True), (1e-6, False)):
        moved = Poses(pose.rotation, pose.position + push * out)
        assert inverse(robot.arm, moved, np.array([2]), q).reachable[0] == expected


def test_undefined_axes_take_the_wish(chain, robot):
    """A5 = 0: A4 as wished, A6 the rest.  Wrist over axis 1: A1 as wished."""
    q = np.radians([[10.0, -90, 90, 40, 0, 25]])
    for wish in (40.0, -30.0, 170.0):
        near = np.radians([[0.0, 0, 0, wish, 0, 0]])
        found = inverse(robot.arm, chain.flange(q), branch_of(robot.arm, q), near)
        assert found.q[0, 3] == pytest.approx(wish * DEG)
        assert max(apart(chain.flange(found.q), chain.flange(q))) < 1e-9
    second, tilt = math.hypot(1.1, 0.055), math.atan2(0.055, 1.1)
    a2 = -math.pi / 2
    a23 = math.acos(-(0.35 + 1.25 * math.cos(a2)) / second) - tilt  # wrist centre on axis 1
    q = np.array([[0.7, a2, a23 - a2, 0.2, 0.9, 0.4]])
    found = inverse(robot.arm, chain.flange(q), branch_of(robot.arm, q), q)
    assert found.q[0, 0] == pytest.approx(0.7)
    assert max(apart(chain.flange(found.q), chain.flange(q))) < 1e-8


# S and T


@pytest.mark.parametrize(
    ("degrees", "status"),
    [
        ((0, -90, 90, 0, 45, 0), 0b010),  # elbow above the line, wrist ahead, A5 positive
        ((0, -90, 90, 0, -45, 0), 0b110),
        ((0, -30, -10, 0, 45, 0), 0b000),  # A3 below -2.86 deg: past the stretched arm
        ((0, -30, -2.9, 0, 45, 0), 0b000),
        ((0, -30, -2.8, 0, 45, 0), 0b010),
        ((0, -146, -10, 0, 45, 0), 0b001),  # arm thrown back: wrist behind axis 1
        ((0, -146, 0, 0, -45, 0), 0b111),
        ((123, -90, 90, 200, 45, -300), 0b010),  # A1, A4, A6 have no say
    ],
)
def test_status_bits(robot, degrees, status):
    assert branch_of(robot.arm, np.radians([degrees]))[0] == status


def test_turn_bits():
    q = np.array(
        [[0.1] * 6, [-0.1] * 6, [0.0] * 6, [0.1, -0.1, 0.1, -4.0, 0.1, 0.1], [4.0, 0, 0, 0, 0, -4.0]]
    )
    assert negative_axes(q).tolist() == [0, 0b111111, 0, 0b001010, 0b100000]


def test_near_singular_places(robot):
    clear = np.radians([0.0, -60, 80, 0, 45, 0])
    assert not is_near_singular(robot, clear[None])[0]
    for axis, degrees in ((4, 1.0), (4, -1.0), (2, -2.86), (2, -2.0)):
        q = clear.copy()
        q[axis] = degrees * DEG
        assert is_near_singular(robot, q[None])[0]
    for axis, degrees in ((4, 1.3), (2, -1.5)):
        q = clear.copy()
        q[axis] = degrees * DEG
        assert not is_near_singular(robot, q[None])[0]
    upright = math.acos(-0.35 / math.hypot(1.1, 0.055)) + math.pi / 2 - math.atan2(0.055, 1.1)
    for off, expected in (
        (0.0, True),
        (0.02, True),
        (0.04, False),
    ):  # wrist that far (rad x 1.1 m) from axis 1
        q = np.array([[0.0, -math.pi / 2, upright - off, 0, 0.8, 0]])
        assert is_near_singular(robot, q)[0] == expected


# follow: the axes along a program


def tracked(robot, chain, q, start, **words):
    """The track of motions whose flange poses are those of ``q``."""
    target = chain.flange(q)
    return follow_axes(robot, motions(target, **words), target, start)


def steps(**axes):
    """(N, 6) [rad]: a clear pose whose named axes go through the given degrees."""
    count = max(len(values) for values in axes.values())
    q = np.tile([10.0, -60.0, 80.0, 20.0, 45.0, 30.0], (count, 1))
    for name, values in axes.items():
        q[:, int(name[1]) - 1] = values
    return q * DEG


@pytest.mark.parametrize("axis", ["A4", "A6"])
@pytest.mark.parametrize("way", [1, -1])
def test_path_is_followed_across_half_a_turn(robot, chain, axis, way):
    q = steps(**{axis: way * np.arange(100.0, 341.0, 20.0)})
    track = tracked(robot, chain, q, q[0])
    assert np.abs(track.q - q).max() < 1e-9
    assert track.within.all()
    # and on, beyond the limit of 350 deg: followed, and told
    q = steps(**{axis: way * np.arange(100.0, 420.0, 20.0)})
    track = tracked(robot, chain, q, q[0])
    assert np.abs(track.q - q).max() < 1e-9
    assert np.array_equal(track.within, np.abs(q).max(axis=1) < 350 * DEG)


def test_limits_are_flagged_either_side(robot, chain):
    q = steps(A1=[184.9, 185.1, -184.9, -185.1])
    track = tracked(robot, chain, q, None, axes=dict(enumerate(q)))
    assert track.within.tolist() == [True, False, True, False]
    q = steps(A2=[-145, -0.5, 0.5], A3=[100, 100, 100])
    assert tracked(robot, chain, q, q[0]).within.tolist() == [True, True, False]
    q = steps(A5=[124.9, 125.1])
    assert tracked(robot, chain, q, q[0]).within.tolist() == [True, False]


def test_axis_motion_sets_branch_and_turns(robot, chain):
    q = steps(A4=[20, 200, 210, 220])
    track = tracked(robot, chain, q, None, axes={1: q[1]})
    assert track.branch.tolist() == [-1, 2, 2, 2]
    assert np.isnan(track.q[0]).all()
    assert np.abs(track.q[1:] - q[1:]).max() < 1e-9
    assert track.reachable.all()


@pytest.mark.parametrize("sign", [1, -1])
def test_stated_turn_resets_the_turns(robot, chain, sign):
    """A4 at +190 or at -170 deg: T says which, and the path goes on from there."""
    q = steps(A4=[150.0, 190.0, 200.0])
    q[1:, 3] -= 0 if sign > 0 else 2 * math.pi
    track = tracked(
        robot,
        chain,
        q,
        q[0],
        kind=[Kind.LIN, Kind.PTP, Kind.LIN],
        status=[-1, 2, -1],
        turn=[-1, negative_axes(q)[1], -1],
    )
    assert np.abs(track.q - q).max() < 1e-9
    assert track.turn_matches.all()


def test_path_motions_do_not_obey_s_and_t(robot, chain):
    """A LIN keeps its branch and goes the short way whatever stands with it; that a T is wrong is told."""
    q = steps(A4=[150.0, 190.0])
    other = negative_axes(q)[1] ^ 0b001000
    track = tracked(robot, chain, q, q[0], status=[-1, 6], turn=[-1, other])
    assert np.abs(track.q - q).max() < 1e-9
    assert track.branch.tolist() == [2, 2]
    assert track.turn_matches.tolist() == [True, False]


def test_ptp_takes_the_branch_of_its_s(robot, chain):
    q = steps(A5=[45.0, 45.0, 45.0])
    track = tracked(robot, chain, q, q[0], kind=Kind.PTP, status=[-1, 6, -1])
    assert track.branch.tolist() == [2, 6, 6]
    assert track.q[1:, 4] == pytest.approx(-45 * DEG)
    far, turned = apart(chain.flange(track.q), chain.flange(q))
    assert max(far, turned) < 1e-9
    assert np.array_equal(branch_of(robot.nominal, track.q), track.branch)


@pytest.mark.parametrize("axis", range(6))
def test_turn_of_a_defined_axis_that_is_wrong_is_told(robot, chain, axis):
    q = steps(A4=[20.0])
    stated = int(negative_axes(q)[0]) ^ (1 << axis)
    track = tracked(robot, chain, q, q[0], kind=Kind.PTP, status=2, turn=stated)
    # A1, A4, A6 can obey by a whole turn (A1 then leaves its limits); the others can not
    assert track.turn_matches[0] == (axis in (0, 3, 5))
    assert track.within[0] == (axis != 0)


def test_turn_near_zero_is_not_held_against_rounding(robot, chain):
    q = steps(A4=[0.005, -0.005])
    track = tracked(robot, chain, q, q[0], kind=Kind.PTP, status=2, turn=[0b001010, 0b000010])
    assert np.abs(track.q - q).max() < 1e-9
    assert track.turn_matches.all()


def test_home_is_where_the_program_starts(robot, chain):
    q = steps(A5=[45.0, -45.0, -45.0, 45.0, 45.0])
    home = Finding("KRL016", "HOME")
    words = {"kind": [Kind.PTP, Kind.PTP, Kind.LIN, Kind.PTP, Kind.LIN], "status": [2, 6, -1, -1, -1]}
    target = chain.flange(q)
    unknown = Poses(target.rotation.copy(), target.position.copy())
    unknown.rotation[3], unknown.position[3] = np.nan, np.nan
    track = follow_axes(robot, motions(unknown, **words, refused={3: home}), unknown, q[0])
    assert track.branch.tolist() == [2, 6, 6, 2, 2]
    assert np.abs(track.q - q)[[0, 1, 2, 4]].max() < 1e-9
    assert np.isnan(track.q[3]).all()
    # a PTP to a place that nothing tells loses the branch instead, until something says it
    other = {3: Finding("KRL003", "not declared")}
    track = follow_axes(robot, motions(unknown, **words, refused=other), unknown, q[0])
    assert track.branch.tolist() == [2, 6, 6, -1, -1]
    assert np.isnan(track.q[3:]).all()
    assert track.reachable.all()


def test_motion_of_unknown_kind_loses_the_branch_where_it_leads_nowhere_known(robot, chain):
    q = steps(A5=[45.0, 45.0, 45.0, 45.0])
    kinds = [Kind.LIN, Kind.OTHER, Kind.LIN, Kind.LIN]
    known = tracked(robot, chain, q, q[0], kind=kinds, axes={3: q[3]})
    assert known.branch.tolist() == [2, 2, 2, 2]
    target = chain.flange(q)
    target.rotation[1], target.position[1] = np.nan, np.nan
    track = follow_axes(robot, motions(target, kind=kinds, axes={3: q[3]}), target, q[0])
    assert track.branch.tolist() == [2, -1, -1, 2]


def test_unknown_start(robot, chain):
    q = steps(A4=[20.0, 30.0, 40.0])
    track = tracked(robot, chain, q, None)
    assert track.branch.tolist() == [-1, -1, -1]
    assert np.isnan(track.q).all()
    assert track.reachable.all()
    assert track.turn_matches.all()
    empty = tracked(robot, chain, np.empty((0, 6)), None)
    assert empty.q.shape == (0, 6)


def test_straight_wrist_takes_a4_of_the_row_before(robot, chain):
    q = steps(A4=[50.0, 120.0, 170.0, 60.0], A5=[30.0, 0.0, 0.0, 20.0], A6=[10.0, 20.0, 30.0, 40.0])
    track = tracked(robot, chain, q, q[0])
    assert track.q[1:3, 3] == pytest.approx(50 * DEG)
    assert track.q[1:3, 5] == pytest.approx(np.radians([90.0, 150.0]))
    assert np.abs(track.q[[0, 3]] - q[[0, 3]]).max() < 1e-9
    assert max(apart(chain.flange(track.q), chain.flange(q))) < 1e-9


def test_straight_wrist_at_the_first_row_takes_a4_of_the_start(robot, chain):
    q = steps(A4=[70.0], A5=[0.0])
    start = steps(A4=[-40.0])[0]
    track = tracked(robot, chain, q, start)
    assert track.q[0, 3] == pytest.approx(-40 * DEG)


def test_out_of_reach_is_flagged_and_passed(robot, chain):
    q = steps(A4=[170.0, 180.0, 190.0])
    target = chain.flange(q)
    position = target.position.copy()
    position[1] += 5.0
    track = follow_axes(robot, motions(target), Poses(target.rotation, position), q[0])
    assert track.reachable.tolist() == [True, False, True]
    assert np.isnan(track.q[1]).any()
    assert np.abs(track.q[[0, 2]] - q[[0, 2]]).max() < 1e-9


def test_nominal_geometry_is_the_controllers(robot, chain):
    """The controller inverts with what it believes, not with what the arm is."""
    believed = replace(robot, nominal=OTHER)
    q = steps(A4=[20.0, 30.0])
    target = chain_of(OTHER, robot).flange(q)
    assert np.abs(follow_axes(believed, motions(target), target, q[0]).q - q).max() < 1e-9


# Robot files


def test_installed_file_holds_table_1_digit_for_digit(robot):
    """Klimchik et al., Table 1: value and half width as printed there."""
    table = {
        "c1": (3.774e-6, None),
        "c2": (0.302e-6, 0.004e-6),
        "c3": (0.406e-6, 0.008e-6),
        "c4": (3.002e-6, 0.115e-6),
        "c5": (3.303e-6, 0.162e-6),
        "c6": (2.365e-6, 0.095e-6),
        "s0": (458.00 * 1e-3, 27.0 * 1e-3),
        "L": (184.72 * 1e-3, 0.06 * 1e-3),
        "a_x": (685.93 * 1e-3, 0.70 * 1e-3),
        "a_y": (120.30 * 1e-3, 0.69 * 1e-3),
    }
    terms = StiffnessModel.from_robot(robot).terms
    stated = {name: value for term in terms for name, value in term.stated.items()}
    assert set(stated) == {*table, "K_c"}
    for name, (value, interval) in table.items():
        assert (stated[name].value, stated[name].interval) == (value, interval)
        assert stated[name].level is None  # the paper does not say which
        assert "Table 1" in stated[name].source
    assert stated["K_c"].value == pytest.approx(1 / 0.144e-6, rel=1e-6)
    assert stated["K_c"].interval == pytest.approx(0.031e-6 / 0.144e-6**2, rel=1e-3)
    lengths = [robot.arm.d1, robot.arm.a1, robot.arm.a2, robot.arm.a3, robot.arm.d4, robot.arm.d6]
    assert lengths == pytest.approx([0.750, 0.350, 1.250, -0.055, 1.100, 0.230], rel=1e-15)
    assert robot.nominal == robot.arm
    limits = [(-185, 185), (-146, 0), (-119, 155), (-350, 350), (-125, 125), (-350, 350)]
    np.testing.assert_allclose(robot.limits, np.radians(limits), rtol=1e-15)
    balancer = terms[1].effect
    assert balancer.described() == {"joint": "A2", "preload": "balanced", "sign": "energy", "zero_deg": 0}


def test_every_installed_file_loads():
    files = robot_files()
    assert "kuka_kr270" in files
    for name, path in files.items():
        assert find_robot(name) == path
        found = load_robot(path)
        assert found.name == name
        StiffnessModel.from_robot(found)


def refused(action):
    with pytest.raises(Refusal) as caught:
        action()
    assert len(caught.value.findings) == 1
    return caught.value.findings[0]


ERRORS = {
    "unit of a length": ("{unit: mm, d1", "{unit: deg, d1", "YML005", "these are allowed here: m, mm"),
    "unit of the limits": ("  unit: deg", "  unit: mm", "YML005", "these are allowed here: rad, deg"),
    "unit of a compliance": ("0.302e-6, unit: rad/(N m)", "0.302e-6, unit: N m/rad", "YML005", "rad/(N m)"),
    "unit of another compliance": (
        "0.302e-6, unit: rad/(N m)",
        "0.302e-6, unit: mm/N",
        "YML005",
        "rad/(N m)",
    ),
    "unit of a spring": ("unit: N/m", "unit: N", "YML005", "did you mean"),
    "unknown key at the top": ("effects:", "efects:", "YML002", "did you mean 'effects'"),
    "unknown key of the geometry": ("  kuka: {", "  kukka: {", "YML002", "did you mean 'kuka'"),
    "unknown length": ("d6: 230", "d7: 230", "YML002", "did you mean"),
    "the joint is unknown": ("  A6: [", "  A7: [", "YML002", "did you mean"),
    "unknown key of an effect": ("    options: {", "    option: {", "YML002", "did you mean 'options'"),
    "unknown option": ("preload: balanced", "prelaod: balanced", "YML002", "did you mean 'preload'"),
    "unknown parameter": ("      c2: {", "      cc2: {", "YML002", "did you mean"),
    "unknown key of a parameter": ("ci: 0.115e-6", "ci98: 0.115e-6", "YML002", "did you mean"),
    "reversed limits": ("A2: [-146, 0]", "A2: [0, -146]", "YML004", "the lower limit must be below"),
    "limits in the wrong unit": ("  unit: deg", "  unit: rad", "YML004", "exceeds 1000 deg"),
    "one limit only": ("A2: [-146, 0]", "A2: [-146]", "YML004", "a list of 2 numbers"),
    "no forearm": ("d4: 1100", "d4: 0", "YML004", "must be positive"),
    "negative compliance": (
        "value: 0.302e-6",
        "value: -0.302e-6",
        "YML004",
        "-3.02e-07 rad/(N m) is not within",
    ),
    "negative interval": ("ci: 0.115e-6", "ci: -0.115e-6", "YML004", "not within"),
    "spring out of bounds": (
        "K_c:\n        value: 6.944444e6",
        "K_c:\n        value: 6.9e12",
        "YML004",
        "N/m is not within",
    ),
    "unknown effect": (
        "effect: joint_compliance",
        "effect: joint_complience",
        "YML004",
        "mean 'joint_compliance'",
    ),
    "value with its unit": ("value: 0.302e-6,", "value: 0.302e-6 rad,", "YML004", "is not a number"),
    "value that is a list": ("value: 0.302e-6,", "value: [0.302e-6],", "YML004", "is not a number"),
    "length that is a word": ("d1: 750", "d1: high", "YML004", "is not a number"),
    "joint that is not there": ("joint: A2", "joint: A9", "YML004", "not one of A1, A2"),
    "unknown sign": ("sign: energy", "sign: printed", "YML004", "did you mean 'as_printed'"),
    "unknown preload": ("preload: balanced", "preload: balance", "YML004", "did you mean 'balanced'"),
    "zero that is no angle": ("zero_deg: 0", "zero_deg: 500", "YML004", "not within -360 .. 360"),
    "interval of two kinds": (
        "0.115e-6, ci_level: unstated",
        "0.1e-6, ci95: 0.1e-6",
        "YML004",
        "stated twice",
    ),
    "level of an interval": (
        "0.115e-6, ci_level: unstated",
        "0.115e-6, ci_level: high",
        "YML004",
        "unstated",
    ),
}


@pytest.mark.parametrize("case", ERRORS)
def test_wrong_robot_file_is_told_with_its_line(tmp_path, case):
    old, new, code, words = ERRORS[case]
    text = find_robot("kuka_kr270").read_text(encoding="utf-8")
    assert text.count(old) == 1
    path = tmp_path / "arm.yaml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    finding = refused(lambda: StiffnessModel.from_robot(load_robot(path)))
    assert finding.code == code
    assert words in f"{finding.message} | {finding.help}"
    assert finding.file == str(path)
    assert finding.line == text[: text.index(old)].count("\n") + 1


MISSING = {
    "name": ("name: kuka_kr270\n", "", "maker_name:"),
    "source of a value": (', source: "Klimchik et al., Table 1, k2"', "", "      c2:"),
    "unit of a value": ("value: 0.302e-6, unit: rad/(N m)", "value: 0.302e-6", "      c2:"),
    "value": ("value: 0.302e-6, ", "", "      c2:"),
    "level of an interval": ("0.004e-6, ci_level: unstated", "0.004e-6", "      c2:"),
    "a length": (", d6: 230", "", "  kuka:"),
    "a joint": ("  A6: [-350, 350]\n", "", "  source: Software"),
    "unit of the limits": ("  unit: deg\n", "", "  source: Software"),
    "joint of the spring": ("joint: A2, ", "", "    options:"),
    "name of an effect": ("effect: joint_compliance\n    ", "", "  - parameters:"),
}


@pytest.mark.parametrize("case", MISSING)
def test_missing_key_is_told_with_the_line_of_its_section(tmp_path, case):
    old, new, section = MISSING[case]
    text = find_robot("kuka_kr270").read_text(encoding="utf-8")
    assert text.count(old) == 1
    text = text.replace(old, new)
    path = tmp_path / "arm.yaml"
    path.write_text(text, encoding="utf-8")
    finding = refused(lambda: StiffnessModel.from_robot(load_robot(path)))
    assert finding.code == "YML003"
    assert "missing" in finding.message
    assert finding.line == text[: text.index(section)].count("\n") + 1


def test_unknown_robot_is_told_with_the_nearest_name(tmp_path):
    finding = refused(lambda: find_robot("kuka_kr27"))
    assert finding.code == "CEL003"
    assert "did you mean 'kuka_kr270'" in finding.message
    finding = refused(lambda: find_robot("arm.yaml", tmp_path))
    assert finding.code == "CEL003"
    assert str(tmp_path / "arm.yaml") in finding.message
    (tmp_path / "arm.yaml").write_text("name: x\n", encoding="utf-8")
    assert find_robot("arm.yaml", tmp_path) == tmp_path / "arm.yaml"


def test_controller_may_believe_another_geometry(tmp_path):
    text = find_robot("kuka_kr270").read_text(encoding="utf-8")
    believed = "controller: {source: guess, kuka: {unit: m, d1: 0.7, a1: 0.3, a2: 1.2, a3: 0, d4: 1, d6: 0.2}}\njoints:"
    path = tmp_path / "arm.yaml"
    path.write_text(text.replace("joints:", believed, 1), encoding="utf-8")
    found = load_robot(path)
    assert found.nominal == KukaLengths(0.7, 0.3, 1.2, 0.0, 1.0, 0.2)
    assert found.arm == kr270().arm
