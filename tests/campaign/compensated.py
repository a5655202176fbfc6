"""Cuts that are compensated with a model, carried out by the plant."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from motions import milling_angles
from plant import Plant

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import mirror
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.unknowns import asked_for
from postproc.measurements import measurements_csv
from postproc.model import NOTHING, StiffnessModel
from postproc.robot.description import load_robot
from postproc.robot.inverse import branch_of
from postproc.workflows.identify import IdentifyRequest, identify

from . import rig
from .identified import Trial, fitted, noisy

CUTTER = Poses(rotation_from_vector([0.0, 0.5, 0.0]), np.array([0.12, 0.0, 0.25]))
"""TCP on the flange."""

FORCE = 300.0, 1000.0
"""[N]"""


@dataclass(frozen=True)
class Cuts:
    """States in a cut: ``q`` (N, 6) [rad] of the wanted pose, ``wanted`` (N) TCP in the robot base, wrench (N, 6)."""

    q: np.ndarray
    wanted: Poses
    wrench: np.ndarray


def cuts(count: int, seed: int, past_first_axis: bool = False) -> Cuts:
    """Milling poses with forces of any direction, or ``past_first_axis``: with such as put no torque on A1."""
    rng = np.random.default_rng(seed)
    q = milling_angles(count, rng)
    wanted = rig.truth().chain.flange(q) @ CUTTER
    force = rng.normal(size=(count, 3))
    if past_first_axis:
        across = np.cross([0.0, 0.0, 1.0], wanted.position)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        force -= (force * across).sum(axis=1, keepdims=True) * across
    force *= rng.uniform(*FORCE, (count, 1)) / np.linalg.norm(force, axis=1, keepdims=True)
    return Cuts(q, wanted, np.concatenate([force, np.zeros((count, 3))], axis=1))


def errors(plant: Plant, motors: np.ndarray, cuts: Cuts) -> np.ndarray:
    """(N,) [m] from where the plant's tool is wanted to where it is, with its motors at (N, 6)."""
    there = [plant.rest(q, wrench, CUTTER).position for q, wrench in zip(motors, cuts.wrench, strict=True)]
    return np.linalg.norm(np.array(there) - cuts.wanted.position, axis=1)


def share(plant: Plant, model: StiffnessModel, cuts: Cuts, before: np.ndarray) -> float:
    """Of the deflection ``before`` (N,) [m], the share that a compensation with ``model`` takes away: the median over
    the cuts."""
    status = branch_of(model.robot.nominal, cuts.q)
    done = mirror(model, cuts.wanted, cuts.wanted, LoadCase(CUTTER, cuts.wrench, NOTHING, status, cuts.q))
    assert done.converged.all()
    return float(np.median(1 - errors(plant, done.q, cuts) / before))


def found_model(trial: Trial, seed: int, campaign: int) -> StiffnessModel:
    """What a campaign finds."""
    return fitted(trial, seed, campaign).model


def begun_with(trial: Trial, seed: int, campaign: int) -> StiffnessModel:
    """What the robot file says before a campaign."""
    return rig.model_of(noisy(trial, seed, campaign)[1])


def joints_only(trial: Trial, seed: int, campaign: int) -> StiffnessModel:
    """What a campaign finds with a model that has no compensator."""
    readings, raw = noisy(trial, seed, campaign)
    bare = rig.model_of(raw).without_effects(["gravity_compensator"])
    asked = asked_for(bare, ["joint_compliance"])
    return fit(Campaign(readings), asked.model, asked.unknowns).model


def by_files(trial: Trial, seed: int, campaign: int, folder: Path) -> StiffnessModel:
    """What a campaign finds, on the way of the command: measurements and robot file in, a new robot file out."""
    readings, raw = noisy(trial, seed, campaign)
    data, robot, new = (folder / name for name in ("readings.csv", "robot.yaml", "identified.yaml"))
    data.write_bytes(measurements_csv(readings))
    robot.write_bytes(raw)
    identify(IdentifyRequest((data,), str(robot), new, effects=trial.words, folds=0, bootstrap=0))
    return StiffnessModel.from_robot(load_robot(new))
