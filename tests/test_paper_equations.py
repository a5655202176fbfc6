"""Eqs (1) to (6) of Klimchik et al. and the map of their machining square, each against another way to get it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import load_of
from plant import kr270, random_angles, random_tools, with_compensator

from postproc.base.geometry import Poses, rotation_from_abc, vector_from_rotation
from postproc.base.units import DEG
from postproc.effects.gravity_compensator import GravityCompensator
from postproc.model import StiffnessModel
from postproc.robot.inverse import inverse

A2 = 1
TABLE_1 = {"K_c": 1 / 0.144e-6, "s0": 0.458, "L": 0.18472, "a_x": 0.68593, "a_y": 0.12030, "h": 0.0}

springs = st.fixed_dictionaries(
    {
        "K_c": st.floats(1e3, 1e8),
        "s0": st.floats(0.0, 1.5),
        "L": st.floats(0.05, 0.4),
        "a_x": st.floats(0.5, 1.0),
        "a_y": st.floats(-0.5, 0.5),
        "h": st.floats(0.0, 0.3),
    }
)
angles = st.floats(-math.pi, math.pi)


def spring(values, angle, effect=None):
    return (effect or GravityCompensator(kr270().joints, A2)).spring(
        values, np.atleast_1d(np.asarray(angle, float))
    )


def model(**change):
    return with_compensator(StiffnessModel.from_robot(kr270()), **change)


def compliance_only():
    return model().without_effects(["gravity_compensator"])


# Eq. (1)


@settings(deadline=None)
@given(values=springs, angle=angles, zero=st.floats(-1.0, 1.0))
def test_length_is_the_distance_of_the_two_points(values, angle, zero):
    """Seen along the axis of A2, x forward and z up: P0 at (-a_x, -a_y), P1 on the arm, which falls as A2 grows."""
    p0 = np.array([-values["a_x"], 0.0, -values["a_y"]])
    turned = angle - zero
    p1 = np.array([values["L"] * np.cos(turned), values["h"], -values["L"] * np.sin(turned)])
    found = spring(values, angle, GravityCompensator(kr270().joints, A2, zero=zero)).length
    assert found[0] == pytest.approx(np.linalg.norm(p1 - p0), rel=1e-12)


def test_length_as_printed():
    a, alpha = math.hypot(0.68593, 0.12030), math.atan2(0.12030, 0.68593)
    for q in np.radians([-146.0, -90.0, -30.0, 0.0]):
        s = math.sqrt(a**2 + 0.18472**2 + 2 * a * 0.18472 * math.cos(alpha + q))
        assert spring(TABLE_1, q).length[0] == pytest.approx(s, rel=1e-14)


# Eq. (2)


@settings(deadline=None)
@given(values=springs, angle=angles)
def test_torque_is_the_slope_of_the_energy(values, angle):
    step = 1e-5
    down, up = spring(values, [angle - step, angle + step]).energy
    scale = values["K_c"] * max(values["s0"], 1.0)
    assert spring(values, angle).torque[0] == pytest.approx(-(up - down) / (2 * step), abs=1e-8 * scale)


def test_torque_as_printed():
    a, alpha = math.hypot(0.68593, 0.12030), math.atan2(0.12030, 0.68593)
    for q in np.radians([-146.0, -90.0, -30.0, 0.0]):
        s = spring(TABLE_1, q).length[0]
        moment = TABLE_1["K_c"] * (1 - 0.458 / s) * a * 0.18472 * math.sin(alpha + q)
        assert spring(TABLE_1, q).torque[0] == pytest.approx(moment, rel=1e-12)


def test_size_of_the_printed_spring():
    """With Table 1's stiffness in N/m the torque reaches 347 kN m: no balancer (a heavy arm needs 10 to 15)."""
    low, high = kr270().limits[A2]
    torque = np.abs(spring(TABLE_1, np.linspace(low, high, 2001)).torque).max()
    assert torque == pytest.approx(346.76e3, rel=1e-4)
    acting, balanced = model(preload="acting"), model()
    assert [finding.code for finding in acting.plausibility_findings()] == ["MOD001"]
    assert balanced.plausibility_findings() == []


# Eqs (3), (4)


def eta(values, angle):
    """Eq. (4), as printed."""
    a, alpha = math.hypot(values["a_x"], values["a_y"]), math.atan2(values["a_y"], values["a_x"])
    s = math.sqrt(a**2 + values["L"] ** 2 + 2 * a * values["L"] * math.cos(alpha + angle) + values["h"] ** 2)
    lever = a * values["L"] / s**2 * math.sin(alpha + angle) ** 2
    return math.cos(alpha + angle) - values["s0"] / s * (lever + math.cos(alpha + angle))


@settings(deadline=None)
@given(values=springs, angle=angles)
def test_curvature_of_the_energy_is_minus_kc_a_l_eta(values, angle):
    step = 1e-5
    down, up = spring(values, [angle - step, angle + step]).torque
    curvature = -(up - down) / (2 * step)
    product = values["K_c"] * math.hypot(values["a_x"], values["a_y"]) * values["L"]
    scale = values["K_c"] * max(values["s0"], 1.0)
    assert curvature == pytest.approx(-product * eta(values, angle), abs=1e-7 * scale)
    assert spring(values, angle).slope[0] == pytest.approx(-curvature, abs=1e-7 * scale)


@pytest.mark.parametrize("preload", ["balanced", "acting"])
@pytest.mark.parametrize("sign", ["energy", "as_printed"])
def test_slope_belongs_to_the_force(preload, sign):
    """What the solver is given as derivative is that of the force, at displaced coordinates."""
    effect = GravityCompensator(kr270().joints, A2, preload, sign)
    motors = random_angles(kr270(), 20, np.random.default_rng(4)).T
    here, step = motors + 1e-3, np.zeros_like(motors)
    step[A2] = 1e-6
    up, down = (load_of(effect, TABLE_1, kr270(), here + move, motors)[0] for move in (step, -step))
    force, slope = load_of(effect, TABLE_1, kr270(), here, motors)
    np.testing.assert_allclose((up - down)[A2] / 2e-6, slope[A2], rtol=1e-5, atol=10.0)
    others = np.arange(6) != A2
    assert not force[others].any()
    assert not slope[others].any()


def test_preload_is_the_torque_at_the_motor_angle():
    motors = random_angles(kr270(), 20, np.random.default_rng(5)).T
    torque = spring(TABLE_1, motors[A2]).torque
    for sign in ("energy", "as_printed"):
        at_rest = load_of(
            GravityCompensator(kr270().joints, A2, "balanced", sign), TABLE_1, kr270(), motors, motors
        )[0]
        assert not at_rest.any()
        acting = load_of(
            GravityCompensator(kr270().joints, A2, "acting", sign), TABLE_1, kr270(), motors, motors
        )[0]
        np.testing.assert_allclose(acting[A2], torque, rtol=1e-14)


def joint_compliance(robot, q):
    """(N, 6) of the joints of the unloaded robot: eq. (6), inverted."""
    state = robot.state(q, np.zeros((len(q), 6)), Poses.identity())
    return robot.compliance(state)[:, robot.chain.motor_rows]


def test_printed_sign_flips_the_increment():
    q = random_angles(kr270(), 50, np.random.default_rng(6))
    bare = 1 / joint_compliance(compliance_only(), q)
    energy = 1 / joint_compliance(model(), q) - bare
    printed = 1 / joint_compliance(model(sign="as_printed"), q) - bare
    np.testing.assert_allclose(printed, -energy, atol=1e-6)
    expected = [
        TABLE_1["K_c"] * math.hypot(0.68593, 0.12030) * 0.18472 * eta(TABLE_1, angle) for angle in q[:, A2]
    ]
    np.testing.assert_allclose(printed[:, A2], expected, rtol=1e-6)
    assert np.median(np.abs(expected)) > 1e5


# Eqs (5), (6)


def test_joint_stiffness_is_the_sum_on_the_diagonal():
    q = random_angles(kr270(), 50, np.random.default_rng(7))
    bare, whole = joint_compliance(compliance_only(), q), joint_compliance(model(), q)
    table = np.array([3.774, 0.302, 0.406, 3.002, 3.303, 2.365]) * 1e-6
    np.testing.assert_allclose(bare, np.broadcast_to(table, bare.shape), rtol=1e-14)
    slope = spring(TABLE_1, q[:, A2]).slope
    added = np.zeros_like(q)
    added[:, A2] = -slope
    np.testing.assert_allclose(1 / whole, 1 / table + added, rtol=1e-6)


@pytest.mark.parametrize("build", [compliance_only, model])
def test_cartesian_stiffness_is_that_of_the_solved_equilibrium(build):
    """K_C^-1 against central differences of the equilibrium, force by force, at 1 N and 1 N m."""
    robot, rng = build(), np.random.default_rng(8)
    q, tool = random_angles(kr270(), 10, rng), random_tools(10, rng)
    q[:, 4] = np.sign(q[:, 4]) * np.clip(np.abs(q[:, 4]), 0.5, None)
    measured = np.empty((10, 6, 6))
    for i, unit in enumerate(np.eye(6)):
        up, down = (robot.equilibrium(q, np.tile(sign * unit, (10, 1)), tool).pose for sign in (1.0, -1.0))
        measured[:, :3, i] = (up.position - down.position) / 2
        turn = up.rotation @ np.swapaxes(down.rotation, 1, 2)
        measured[:, 3:, i] = vector_from_rotation(turn) / 2
    compliance = np.stack(
        [robot.linear_deflection(q, np.tile(unit, (10, 1)), tool) for unit in np.eye(6)], axis=2
    )
    scale = np.abs(compliance).max(axis=(1, 2), keepdims=True)
    assert (np.abs(measured - compliance) / scale).max() < 1e-8
    np.testing.assert_allclose(compliance, np.swapaxes(compliance, 1, 2), atol=1e-9 * scale.max())
    wrench = rng.normal(size=(10, 6)) * [300.0, 300, 300, 30, 30, 30]
    through = (compliance @ wrench[..., None])[..., 0]
    np.testing.assert_allclose(robot.linear_deflection(q, wrench, tool), through, rtol=1e-6)


def test_a_case_by_hand():
    """Upright arm, forearm level, force straight down at the flange: only A2, A3 and A5 bend, with known levers."""
    robot = compliance_only()
    q = np.radians([[0.0, -90, 90, 0, 0, 0]])
    force = 560.0
    deflection = robot.linear_deflection(q, np.array([[0, 0, -force, 0, 0, 0.0]]), Poses.identity())[0]
    torques = {"A2": 1.33 * force, "A3": 1.33 * force, "A5": 0.23 * force}
    turns = [0.302e-6 * torques["A2"], 0.406e-6 * torques["A3"], 3.303e-6 * torques["A5"]]
    # each turn lowers the flange by its lever; A2 also throws it forward by its height over axis 2, A3 by -55 mm
    down = turns[0] * 1.33 + turns[1] * 1.33 + turns[2] * 0.23
    forward = turns[0] * (1.25 - 0.055) + turns[1] * -0.055
    np.testing.assert_allclose(deflection, [forward, 0, -down, 0, sum(turns), 0], rtol=1e-12, atol=1e-18)


# The machining square, under one reading of what the paper leaves open


def square():
    """Angles, wrenches and tool: tool down, TCP 300 mm off the flange, x 0.2..2.2 m, y +-1 m, z 500 mm."""
    x, y = np.meshgrid(np.linspace(0.2, 2.2, 41), np.linspace(-1.0, 1.0, 41), indexing="ij")
    position = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.5)], axis=1)
    tool = Poses(np.eye(3), np.array([0.0, 0.0, 0.3]))
    down = rotation_from_abc([0.0, math.pi, 0.0])
    flange = Poses(np.broadcast_to(down, (x.size, 3, 3)), position) @ tool.inverse()
    robot = kr270()
    found = inverse(robot.nominal, flange, np.full(x.size, 0b010), np.zeros((x.size, 6)))
    assert found.reachable.all()
    wrench = np.broadcast_to([-360.0, 0, 560, 0, 0, 0], (x.size, 6))
    low, high = robot.limits.T
    within = ((found.q >= low) & (found.q <= high)).all(axis=1)
    return found.q, wrench, tool, within


def test_map_of_the_square():
    q, wrench, tool, within = square()

    def deflection(robot):
        return robot.linear_deflection(q, wrench, tool)[:, :3] * 1e3

    bare, energy, printed = (deflection(m) for m in (compliance_only(), model(), model(sign="as_printed")))
    size = np.linalg.norm(bare, axis=1)
    assert (~within).sum() == 235
    assert [f"{size.min():.3f}", f"{size[within].min():.3f}"] == ["0.274", "0.398"]
    assert [f"{size.max():.3f}", f"{size[within].max():.3f}"] == ["3.487", "3.487"]
    assert f"{np.linalg.norm(energy, axis=1).max():.4f}" == "3.5065"
    assert f"{np.linalg.norm(printed, axis=1).max():.3f}" == "3.472"
    assert f"{np.linalg.norm(energy - bare, axis=1).max():.4f}" == "0.0863"
    assert f"{np.linalg.norm(printed - bare, axis=1).max():.4f}" == "0.0688"


def test_linear_answer_is_close_to_the_equilibrium():
    """At these loads eq. (5) misses the deflected balance by some tens of micrometres, and by more than noise."""
    q, wrench, tool, _ = square()
    robot = model()
    rest = robot.equilibrium(q, wrench, tool)
    assert rest.converged.all()
    free = robot.equilibrium(q, 0 * wrench, tool)
    bent = rest.pose.position - free.pose.position
    miss = np.linalg.norm(bent - robot.linear_deflection(q, wrench, tool)[:, :3], axis=1)
    assert 1e-6 < miss.max() < 50e-6


def test_zero_of_q_and_unit_of_kc():
    """The other readings of the paper move the effect of the compensator."""
    q, wrench, tool, _ = square()
    bare = compliance_only().linear_deflection(q, wrench, tool)[:, :3]

    def change(**options):
        return np.linalg.norm(model(**options).linear_deflection(q, wrench, tool)[:, :3] - bare, axis=1).max()

    assert f"{change(zero=90 * DEG) * 1e3:.4f}" == "0.0506"
    assert f"{change(zero=90 * DEG, sign='as_printed') * 1e3:.4f}" == "0.0595"
    as_angle = 1 / (0.144e-6 * math.hypot(0.68593, 0.12030) * 0.18472)
    assert 0.3e-3 < change(K_c=as_angle, sign="as_printed") < 1e-3


def test_null_compensator_is_none():
    q, wrench, tool, _ = square()
    null = model(K_c=0.0)
    assert np.array_equal(
        null.equilibrium(q, wrench, tool).coordinates,
        compliance_only().equilibrium(q, wrench, tool).coordinates,
    )
    rigid = replace(null, terms=())
    assert np.array_equal(rigid.equilibrium(q, wrench, tool).coordinates, q)
