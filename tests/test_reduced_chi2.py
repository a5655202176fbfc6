"""What remains of readings over their stated scatter: by all degrees of freedom, those of the robot file's own
parameters too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.base.geometry import Poses
from postproc.diagnosis.diagnosis import diagnose
from postproc.identification.campaign import Campaign
from postproc.measurements import planned
from postproc.model import StiffnessModel
from postproc.robot.description import find_robot, load_robot

SIGMA, STEP = 1e-5, 1e-8


def seen(campaign: Campaign, model: StiffnessModel) -> np.ndarray:
    return campaign.expected(campaign.predicted(model), campaign.start())[0]


@pytest.mark.parametrize("seed", [3, 4])
def test_refitted_parameters_take_their_degrees_of_freedom(seed):
    robot = load_robot(find_robot("kuka_kr270"))
    model = StiffnessModel.from_robot(robot)
    model = replace(
        model, terms=tuple(term for term in model.terms if term.effect.name == "joint_compliance")
    )
    rng = np.random.default_rng(seed)
    q = np.repeat(rng.uniform(*(0.7 * robot.limits.T), (9, 6)), 2, axis=0)
    wrench = np.zeros((18, 6))
    wrench[:, :3] = rng.normal(size=(18, 3)) * 1500.0
    joints = [(joint.name, False) for joint in robot.joints]
    tool = Poses(np.eye(3), np.array([0.0, 0.5, 0.3]))
    empty = Campaign(planned(joints, q, wrench, True, robot="kuka_kr270", tool=tool, sigma=SIGMA))
    truth = {(0, f"c{i}"): (1.0 + 0.1 * (i > 2)) * model.terms[0].values[f"c{i}"] for i in range(1, 7)}
    there = model.with_values(truth)
    value = seen(empty, there) + SIGMA * rng.normal(size=(18, 3))
    found = diagnose(Campaign(replace(empty.readings, value=value)), model)
    assert found.verdict.word == "nothing_missing"
    # plain least squares from the true values on, over what was fitted
    free = {u.key: truth[u.key] for u in found.final.unknowns}
    assert len(free) >= 4
    exact = seen(empty, there)
    columns = [(seen(empty, there.with_values({k: v + STEP})) - exact) / STEP for k, v in free.items()]
    matrix = np.stack([column.reshape(-1) for column in columns], axis=1) * 1e-6
    step, _, rank, _ = np.linalg.lstsq(matrix, (value - exact).reshape(-1), rcond=None)
    rest = ((value - exact).reshape(-1) - matrix @ step) / SIGMA
    assert rank == len(free)
    assert found.final.variance == pytest.approx(rest @ rest / (54 - len(free)), rel=1e-3)
