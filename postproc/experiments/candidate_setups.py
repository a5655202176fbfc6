"""What can be set up and measured: poses within limits, room and sight, loads that can be hung."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.measurements import Readings, planned
from postproc.model import StiffnessModel
from postproc.robot.description import Robot

MARGIN, MARGIN_SLIDING = 1.0 * DEG, 10.0 * MM
"""What a pose keeps away from the limits of an axis."""

STEP, STEP_SLIDING = 0.1 * DEG, 0.1 * MM
"""Axes are planned in whole steps: what a person types is what was planned."""

SLIDING_DEG = 10.0 * MM / DEG
"""[m/rad] A travel of 10 mm of a sliding axis counts as one degree."""

BATCH, TRIES = 8192, 40
"""Random poses checked together, and how often."""

ON_AXIS = 1.0 * MM
"""A reflector nearer than this to the flange's axis faces along it."""


@dataclass(frozen=True)
class CandidateSetups:
    """What can be measured, and how well.

    tool: TCP on the flange, where loads hang; targets (T): names of the reflectors, () where the TCP itself is
    measured; places (T, 3) [m] of what is measured, on the flange; rough: they are known roughly, and found with the
    fit.  loads (L,) [kg] that can be hung; each_load: all at every pose, or else one.  deflection: loaded minus
    unloaded is measured, or else places; sigma [m]: one standard deviation of each coordinate of that.

    limits (n, 2) [rad, m] of the axes; box (3, 2) [m], robot base: where TCP, flange and reflectors may be; tracker
    (3,) [m], robot base, None: every reflector is seen; cone [rad]: half angle about the direction in which a
    reflector faces; spacing [rad]: two poses differ by that in one axis at least; spread: and by that share of the
    ranges of the axes in the mean.  pulls (P, 3) [N]: forces at the TCP, robot base axes, that can be pulled with, each
    an alternative to the loads.  shared [m]: one standard deviation of what the readings of a pose have in common in
    each coordinate, beside ``sigma``.
    """

    tool: Poses
    targets: tuple[str, ...]
    places: Floats
    rough: bool
    loads: Floats
    each_load: bool
    deflection: bool
    sigma: float
    limits: Floats
    box: Floats
    tracker: Floats | None
    cone: float
    spacing: float
    pulls: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    spread: float = 0.0
    shared: float = 0.0

    @property
    def facing(self) -> Floats:
        """(T, 3) unit vectors on the flange in which reflectors face: straight away from the flange's axis."""
        away = self.places * [1.0, 1.0, 0.0]
        length = np.linalg.norm(away, axis=1, keepdims=True)
        return np.where(length > ON_AXIS, away / np.maximum(length, ON_AXIS), [0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Setups:
    """C poses to set up.

    q (C, n) [rad, m]; load (C, l) [kg]: hung there, one after the other; visible (C, T): targets in sight; direction
    (C, n): sense -1, 1 in which each axis comes to its place, None where that does not matter; pull (C, 3) [N]: what
    is pulled with there, beside the load, None where nothing is.
    """

    q: Floats
    load: Floats
    visible: Bools
    direction: Floats | None = None
    pull: Floats | None = None

    def __len__(self) -> int:
        return len(self.q)

    def __getitem__(self, rows: Any) -> Setups:
        direction, pull = (None if one is None else one[rows] for one in (self.direction, self.pull))
        return Setups(self.q[rows], self.load[rows], self.visible[rows], direction, pull)

    def __add__(self, other: Setups) -> Setups:
        pairs = (self.direction, other.direction), (self.pull, other.pull)
        direction, pull = (
            None if one is None or more is None else np.concatenate([one, more]) for one, more in pairs
        )
        return Setups(
            np.concatenate([self.q, other.q]),
            np.concatenate([self.load, other.load]),
            np.concatenate([self.visible, other.visible]),
            direction,
            pull,
        )


def usable_limits(robot: Robot, stated: Mapping[str, tuple[float, float]]) -> Floats:
    """(n, 2) [rad, m] between which axes are planned: those of the robot file less a margin, of an axis that turns
    further than once round one turn only, about zero; ``stated``: narrower ones, by the name of the joint.

    Raises Refusal PLN001 where nothing remains.
    """
    limits = []
    for joint in robot.joints:
        turns = joint.kind == "revolute"
        margin, unit, word = (MARGIN, DEG, "deg") if turns else (MARGIN_SLIDING, MM, "mm")
        low, high = joint.lower + margin, joint.upper - margin
        if joint.name in stated:
            wish = stated[joint.name]
            narrowed = max(low, wish[0]), min(high, wish[1])
            if not narrowed[0] <= narrowed[1]:
                message = (
                    f"{joint.name} cannot move within {wish[0] / unit:g} .. {wish[1] / unit:g} {word}: its limits,"
                    f" reduced by a margin, are {low / unit:g} .. {high / unit:g} {word}"
                )
                raise Refusal(Finding("PLN001", message, str(robot.path)))
            limits.append(narrowed)
            continue
        if turns and not high - low < 2 * np.pi:
            low = min(max(low, -np.pi), high - 2 * np.pi) if np.isfinite(high) else max(low, -np.pi)
            high = low + 2 * np.pi
        limits.append((low, high))
    return np.array(limits)


def steps(robot: Robot) -> Floats:
    """(n,) [rad, m] in whole numbers of which axes are planned."""
    return np.array([STEP if joint.kind == "revolute" else STEP_SLIDING for joint in robot.joints])


def spacings(robot: Robot, spacing: float) -> Floats:
    """(n,) [rad, m] of each axis, of a ``spacing`` [rad]."""
    return np.array([spacing * (1.0 if joint.kind == "revolute" else SLIDING_DEG) for joint in robot.joints])


def spreads(candidates: CandidateSetups) -> Floats | None:
    """(n,) [rad, m] of each axis, whose shares sum up to 1 where two poses differ by ``candidates.spread``; None
    without."""
    ranges = candidates.limits[:, 1] - candidates.limits[:, 0]
    moves = ranges > 0
    if not candidates.spread or not moves.any():
        return None
    return np.where(moves, candidates.spread * moves.sum() * ranges, np.inf)


def drawn(model: StiffnessModel, candidates: CandidateSetups, count: int, rng: np.random.Generator) -> Setups:
    """``count`` random poses that can be set up and seen, or as many as are found; each with all of its loads, or once
    with each.

    Raises Refusal PLN001 where there is none.
    """
    batches: list[Floats] = []
    inside = total = have = 0
    for _ in range(TRIES):
        low, high = candidates.limits.T
        q = _rounded(model.robot, candidates, rng.uniform(low, high, (BATCH, len(low))))
        roomy, visible = _allowed(model, candidates, q)
        usable = roomy & visible.any(axis=1)
        total, inside, have = total + BATCH, inside + int(roomy.sum()), have + int(usable.sum())
        batches.append(q[usable])
        if have >= count:
            break
    q = np.concatenate(batches)[:count]
    if not len(q):
        lost = (
            "TCP, flange and reflectors are never all inside the box"
            if not inside
            else f"{inside} are inside the box, but the tracker sees no reflector there"
        )
        raise Refusal(
            Finding(
                "PLN001",
                f"none of {total} random poses can be measured: {lost}",
                str(model.robot.path),
                help="check --box and --limits (mm, deg), and --tracker, --cone and the places of the --target",
            )
        )
    direction = None
    if any(term.effect.by_direction for term in model.terms):
        direction = rng.choice([-1.0, 1.0], q.shape)
    visible = _allowed(model, candidates, q)[1]
    if not len(candidates.pulls) and (candidates.each_load or len(candidates.loads) == 1):
        return Setups(q, np.tile(candidates.loads, (len(q), 1)), visible, direction)
    once = Setups(q, np.zeros((len(q), 1)), visible, direction)
    choices = len(candidates.loads) + len(candidates.pulls)
    rows = np.repeat(np.arange(len(q)), choices)
    load = np.tile(np.append(candidates.loads, np.zeros(len(candidates.pulls))), len(q))[:, None]
    if not len(candidates.pulls):
        return replace(once[rows], load=load)
    pull = np.concatenate([np.zeros((len(candidates.loads), 3)), candidates.pulls])
    return replace(once[rows], load=load, pull=np.tile(pull, (len(q), 1)))


def around(
    model: StiffnessModel,
    candidates: CandidateSetups,
    setups: Setups,
    share: float,
    copies: int,
    rng: np.random.Generator,
) -> Setups:
    """Poses near those of ``setups``, ``copies`` of each as far as they are allowed: every other axis moved by some
    ``share`` of its range."""
    parents = np.repeat(np.arange(len(setups)), copies)
    span = candidates.limits[:, 1] - candidates.limits[:, 0]
    step = (
        rng.normal(0.0, share, (len(parents), len(span)))
        * span
        * rng.integers(0, 2, (len(parents), len(span)))
    )
    q = _rounded(model.robot, candidates, setups.q[parents] + step)
    roomy, visible = _allowed(model, candidates, q)
    usable = roomy & visible.any(axis=1)
    return replace(setups[parents[usable]], q=q[usable], visible=visible[usable])


def _rounded(robot: Robot, candidates: CandidateSetups, q: Floats) -> Floats:
    """The axes in whole steps, within the limits."""
    step = steps(robot)
    low, high = (
        np.ceil(candidates.limits[:, 0] / step - 1e-9),
        np.floor(candidates.limits[:, 1] / step + 1e-9),
    )
    return np.asarray(np.clip(np.round(q / step), low, np.maximum(low, high)) * step)


def _allowed(model: StiffnessModel, candidates: CandidateSetups, q: Floats) -> tuple[Bools, Bools]:
    """(N,) whether the carried points are inside the box; (N, T) whether the tracker sees the targets."""
    flange = model.chain.flange(q)
    points = np.concatenate([np.zeros((1, 3)), candidates.tool.position[None], candidates.places])
    at = flange.position[:, None] + np.einsum("nij,tj->nti", flange.rotation, points)
    inside = ((at >= candidates.box[:, 0]) & (at <= candidates.box[:, 1])).all(axis=(1, 2))
    if candidates.tracker is None:
        return inside, np.ones((len(q), len(candidates.places)), bool)
    sight = candidates.tracker - at[:, 2:]
    faces = np.einsum("nij,tj->nti", flange.rotation, candidates.facing)
    cosine = (faces * sight).sum(axis=2) / np.maximum(np.linalg.norm(sight, axis=2), 1e-12)
    return inside, cosine >= np.cos(candidates.cone)


def readings_of(model: StiffnessModel, candidates: CandidateSetups, setups: Setups) -> Readings:
    """The readings of all targets under all loads at every pose, in this order; also of targets out of sight."""
    robot = model.robot
    count, loads, targets = len(setups), setups.load.shape[1], len(candidates.places)
    row = np.repeat(np.arange(count), loads * targets)
    load = np.repeat(setups.load.reshape(-1), targets)
    wrench = np.zeros((len(row), 6))
    wrench[:, :3] = load[:, None] * model.gravity
    if setups.pull is not None:
        wrench[:, :3] += setups.pull[row]
    readings = planned(
        [(joint.name, joint.kind != "revolute") for joint in robot.joints],
        setups.q[row],
        wrench,
        candidates.deflection,
        robot=robot.name,
        tool=candidates.tool,
        targets=candidates.targets,
        places={} if candidates.rough else dict(zip(candidates.targets, candidates.places, strict=False)),
        target=np.tile(np.arange(targets), count * loads),
        sigma=candidates.sigma,
    )
    return readings if setups.direction is None else replace(readings, direction=setups.direction[row])
