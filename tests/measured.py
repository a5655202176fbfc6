"""Readings as a model would give them, and campaigns cheap enough to be drawn by the hundred."""

from dataclasses import replace
from functools import cache

import numpy as np

from postproc.base.geometry import Poses
from postproc.identification.campaign import Campaign, Nuisances, PredictedReadings
from postproc.measurements import Readings, planned
from postproc.robot.description import find_robot, load_robot

MARKERS = {
    "M1": np.array([0.30, 0.00, 0.10]),
    "M2": np.array([-0.20, 0.25, 0.10]),
    "M3": np.array([-0.10, -0.30, 0.35]),
}
"""[m] Three reflectors on the flange."""


@cache
def robot(name):
    return load_robot(find_robot(name))


def arm(joints):
    """A robot of which nothing is known but its ``joints``."""
    return replace(robot("kuka_kr270"), joints=tuple(joints), effects=(), mechanisms=())


def plan(robot, q, wrench=None, deflection=True, in_robot_frame=False, conditions=None, **words):
    """Readings to be taken; ``words``: those of ``planned``."""
    wrench = np.zeros((len(q), 6)) if wrench is None else wrench
    joints = [(joint.name, joint.kind != "revolute") for joint in robot.joints]
    readings = planned(joints, q, wrench, deflection, **words)
    if conditions is not None:
        given = {name: getattr(conditions, name) for name in ("direction", "temperature", "time")}
        readings = replace(readings, **given)
    return replace(readings, in_robot_frame=in_robot_frame, repeat=np.full(len(q), -1))


def on_markers(q, wrench):
    """q, wrench and the words of ``planned`` for poses of which each is seen at all markers."""
    words = {
        "targets": tuple(MARKERS),
        "places": MARKERS,
        "target": np.tile(np.arange(len(MARKERS)), len(q)),
    }
    return np.repeat(q, len(MARKERS), axis=0), np.repeat(wrench, len(MARKERS), axis=0), words


def turns(count, rng):
    """(N, 3, 3) rotations, all alike probable."""
    w, x, y, z = (lambda a: a / np.linalg.norm(a, axis=0))(rng.normal(size=(4, count)))
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def somewhere(campaign, rng, reach=0.3):
    """Trackers anywhere; targets that are not stated up to ``reach`` [m] from where they are looked for."""
    start, count = campaign.start(), len(campaign.targets)
    sessions = len(campaign.readings.sessions)
    frames = Poses(turns(sessions, rng), 3.0 * rng.normal(size=(sessions, 3)))
    away = rng.normal(size=(count, 3))
    away *= reach * rng.uniform(0.2, 1.0, (count, 1)) / np.linalg.norm(away, axis=1, keepdims=True)
    places = start.places + np.where(campaign.place_known[:, None], 0.0, away)
    axes = np.where(campaign.turn_known[:, None, None], start.turns, turns(count, rng))
    return Nuisances(frames if campaign.tracked else start.frames, places, axes)


def taken(campaign, model, given=None):
    """The readings of a campaign with what ``model`` shows of it, without any scatter."""
    seen = campaign.predicted(model)
    assert seen.converged.all()
    value, rotation = campaign.expected(seen, given or campaign.start())
    return replace(campaign.readings, value=value, rotation=rotation)


def read(model, readings, rng=None):
    """Readings of ``model``; with ``rng`` from somewhere."""
    campaign = Campaign(readings)
    return taken(campaign, model, somewhere(campaign, rng) if rng else None)


def scattered(readings, sigma, rng):
    """With an error of ``sigma`` [m] in each coordinate."""
    return replace(readings, value=readings.value + sigma * rng.normal(size=readings.value.shape))


class Straight(Campaign):
    """A campaign whose readings are linear in ``unknowns``, about ``model``: as cheap as their number allows."""

    def __init__(self, readings: Readings, model, unknowns):
        super().__init__(readings)
        self.about, self.base, self.slopes = model, super().predicted(model), {}
        for unknown in unknowns:
            at = model.terms[unknown.term].values[unknown.parameter.name] + unknown.parameter.scale
            moved = super().predicted(model.with_values({unknown.key: at}))
            slope = [
                (a - b) / unknown.parameter.scale
                for a, b in zip(_moving(moved), _moving(self.base), strict=True)
            ]
            self.slopes[unknown.key] = slope

    def predicted(self, model, start=None, tolerance=0.0):
        parts = [part.copy() for part in _moving(self.base)]
        for (term, name), slope in self.slopes.items():
            step = model.terms[term].values[name] - self.about.terms[term].values[name]
            for part, by in zip(parts, slope, strict=True):
                part += step * by
        return PredictedReadings(*parts, self.base.converged)


def _moving(seen):
    return seen.rotation, seen.body, seen.tip, seen.displacement
