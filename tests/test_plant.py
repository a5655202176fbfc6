"""The plant itself: where a gap makes its force uneven, it still comes to rest, and where it would stay."""

import numpy as np
import pytest
from plant import Hardware, Plant, Spring, kr270

from postproc.base.geometry import Poses
from postproc.effects import Conditions
from postproc.effects.gravity_compensator import GravityCompensator
from postproc.model import StiffnessModel

COMPLIANCE = np.array([3.61e-6, 3.37e-7, 4.29e-7, 2.74e-6, 3.55e-6, 2.86e-6])
TOOL = Poses(np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]), np.array([0.3, 0.0, 0.18]))


def arm_with_gap(gap: float, spring: float) -> Plant:
    """A gap [rad] in A2, and the file's balancer times ``spring``."""
    robot = kr270()
    effect, values = next(
        (t.effect, t.values)
        for t in StiffnessModel.from_robot(robot).terms
        if isinstance(t.effect, GravityCompensator)
    )
    balancer = Spring(**{**values, "K_c": spring * values["K_c"]}, zero=effect.zero, balanced=True)
    return Plant(robot.arm, COMPLIANCE, balancer, Hardware(gap=np.array([0, gap, 0, 0, 0, 0])))


def test_an_arm_whose_torque_passes_through_its_gap_comes_to_rest() -> None:
    """There Newton's method goes round three places without end."""
    plant = arm_with_gap(2.7246e-4, 1.0363947753516622)
    motors = np.array([0.14507415, -1.30677989, 2.16557258, -2.08446941, 1.16967144, 2.53624463])
    force = np.array([78.10919169, 38.26423872, -15.16632204, 0, 0, 0])
    came = Conditions(direction=np.array([[1.0, 1, -1, 1, 1, -1]]))
    at_rest = plant.rest(motors, force, TOOL, came).coordinates
    assert at_rest[1] - motors[1] == pytest.approx(1.168e-4, abs=2e-7)
    # the torque on A2 that is left there, over the whole gap
    free = plant.coordinates_of(motors)
    plant.place(free, free)
    held = -plant.data.qfrc_passive.copy()
    left = plant.residual(plant.coordinates_of(at_rest), free, held, force)[plant.free_rows]
    assert np.abs(left).max() < 1e-6


@pytest.mark.parametrize("seed", range(12))
def test_an_arm_does_not_rest_between_the_sides_of_a_gap(seed: int) -> None:
    """A place from which a small push takes it to a side is none."""
    rng = np.random.default_rng(seed)
    plant = arm_with_gap(4e-4, 1.2)
    motors = np.array([0, -1.3, 2.1, 0, 1.2, 0]) + rng.uniform(-0.5, 0.5, 6)
    force = np.array([*rng.normal(0, 150, 3), 0, 0, 0])
    at_rest = plant.rest(
        motors, force, TOOL, Conditions(direction=rng.choice([-1.0, 1.0], (1, 6)))
    ).coordinates
    free = plant.coordinates_of(motors)
    plant.place(free, free)
    held = -plant.data.qfrc_passive.copy()
    slope = plant.slope(plant.coordinates_of(at_rest), free, held, force)
    assert np.linalg.eigvals(slope).real.max() < 0
