"""The loaded equilibrium against MuJoCo, an engine that shares no line with it."""

from dataclasses import replace

import numpy as np
import pytest
from plant import SOFTER, Plant, kr270, random_angles, random_tools, random_wrenches, with_compensator

from postproc.base.geometry import vector_from_rotation
from postproc.model import StiffnessModel
from postproc.robot.geometries import KukaLengths

COUNT = 100


def states(seed, robot):
    rng = np.random.default_rng(seed)
    return random_angles(robot, COUNT, rng), random_wrenches(COUNT, rng), random_tools(COUNT, rng)


def disagreement(model, plant, seed):
    """(N,) [m] and (N,) [rad] between the model's equilibria and the plant's."""
    q, wrench, tool = states(seed, model.robot)
    ours = model.equilibrium(q, wrench, tool)
    assert ours.converged.all()
    theirs = [plant.rest(q[i], wrench[i], tool[i]) for i in range(COUNT)]
    shift = ours.pose.position - np.array([rest.position for rest in theirs])
    turn = ours.pose.rotation @ np.swapaxes(np.array([rest.rotation for rest in theirs]), 1, 2)
    # the joints' displacements are large against the difference: the test is not one of zero against zero
    assert np.abs(ours.coordinates - q).max() > 1e-4
    return np.linalg.norm(shift, axis=1), np.linalg.norm(vector_from_rotation(turn), axis=1)


def full():
    return StiffnessModel.from_robot(kr270())


def other_arm():
    """Another arm, so that no length may stand for another one."""
    robot = kr270()
    arm = KukaLengths(d1=0.675, a1=0.34, a2=1.15, a3=0.041, d4=1.2, d6=0.24)
    names = [joint.name for joint in robot.joints]
    limits = [(joint.lower, joint.upper) for joint in robot.joints]
    changed = replace(robot, arm=arm, nominal=arm, joints=arm.joints(names, limits), flange=arm.flange())
    model = replace(full(), robot=changed)
    return with_compensator(model, **SOFTER, zero=-0.4, h=0.15, s0=0.3, L=0.31, a_x=0.2, a_y=-0.5)


MODELS = {
    "joint compliance": lambda: full().without_effects(["gravity_compensator"]),
    "compensator of Table 1, balanced": full,
    "softer compensator, acting": lambda: with_compensator(full(), **SOFTER),
    "another arm, spring askew": other_arm,
}


@pytest.mark.parametrize("name", MODELS)
def test_equilibrium_agrees(name):
    model = MODELS[name]()
    shift, turn = disagreement(model, Plant.of(model), seed=270)
    assert shift.max() < 1e-9
    assert turn.max() < 1e-9


@pytest.mark.parametrize("change", [{}, SOFTER])
def test_only_the_energy_sign_agrees(change):
    """The printed sign of eq. (3) is no spring: held against one, it is off by much more than the energy's."""
    energy = with_compensator(full(), **change)
    printed = with_compensator(energy, sign="as_printed")
    plant = Plant.of(energy)
    assert disagreement(energy, plant, seed=3)[0].max() < 1e-9
    assert disagreement(printed, plant, seed=3)[0].max() > 1e-6


@pytest.mark.parametrize("change", [{}, SOFTER, {"zero": 0.3, "h": 0.2, "s0": 0.9}])
def test_spring_length_energy_torque_and_tangent(change):
    """MuJoCo's tendon has the length, energy and torque of the spring; its finite difference the tangent stiffness."""
    model = with_compensator(full(), **change)
    plant = Plant.of(model)
    term = next(t for t in model.terms if t.effect.name == "gravity_compensator")
    compliance = next(t for t in model.terms if t.effect.name == "joint_compliance").values["c2"]
    values = term.values
    a, alpha = np.hypot(values["a_x"], values["a_y"]), np.arctan2(values["a_y"], values["a_x"])
    q = random_angles(model.robot, 30, np.random.default_rng(12))
    spring = term.effect.spring(values, q[:, 1])
    step = 1e-5
    for i in range(len(q)):
        up, down = q[i].copy(), q[i].copy()
        up[1] += step
        down[1] -= step
        slope = -(plant.passive(up, q[i])[1] - plant.passive(down, q[i])[1]) / (2 * step)

        # K - K_c a L eta, eta of eq. (4) written out
        phi, s = alpha + q[i, 1] - term.effect.zero, spring.length[i]
        ratio, product = values["s0"] / s, a * values["L"]
        eta = np.cos(phi) - ratio * (product / s**2 * np.sin(phi) ** 2 + np.cos(phi))
        assert slope == pytest.approx(1 / compliance - values["K_c"] * product * eta, rel=1e-7)

        assert s == pytest.approx(plant.spring_length(q[i]), abs=1e-13)
        assert spring.energy[i] == pytest.approx(plant.energy(q[i], q[i]), rel=1e-10, abs=1e-6)
        assert spring.torque[i] == pytest.approx(plant.passive(q[i], q[i])[1], rel=1e-10, abs=1e-6)
