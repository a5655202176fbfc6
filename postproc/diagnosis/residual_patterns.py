"""Where model and measurement disagree: residuals mapped into the joints, against what could betray a cause."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.units import DEG, MM
from postproc.diagnosis.selection import basis_of, outside
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit
from postproc.robot.chain import ChainKinematics, generalized_force

BINS, POSES = 6, 6
"""Parts that a variable is divided into at most, and poses in each at least."""

CHANCE = 0.01
SHOWN = 8

FEW = 3
"""Readings that a part needs to be named."""

SIDE, SIDES = ("side", 1.0), {-1: "places from above", 0: "places of unknown side", 1: "places from below"}
READING = ("reading", 1.0)
"""Units of a sense of approach, and of the number of a reading, and how the former are called."""

FLIPS = 4000
"""Times that chance is asked."""


@dataclass(frozen=True)
class ResidualPattern:
    """A pattern: ``variable``, the ``pattern`` in words, and the ``share`` of the remaining squares that follow it
    (adjusted for the freedom of the pattern)."""

    variable: str
    pattern: str
    share: float


def residual_patterns(
    fitted: Fit, against: Fit | None = None, chance: float = CHANCE
) -> tuple[ResidualPattern, ...]:
    """The clear patterns in the residual of ``fitted``, largest first.

    Tried are a turn of each joint that depends on its own angle, torque or sense of approach, and a shift of the tool
    that depends on load, order, time, temperature or session; each as a step function in up to ``BINS`` parts, without
    what the fit could have made of it.  ``chance``: probability that any is reported although there is none.

    What is chance follows from the residual scatter of ``against``, as far as that is a better model.  Without it it
    follows from the residuals alone: readings of one pose may share errors, and a few may be outliers, so the
    residuals of each pose get a random sign (wild bootstrap by clusters; Cameron, Gelbach and Miller, Rev. Econ. Stat.
    90 (2008)).
    """
    from scipy.special import fdtrc

    campaign, weights = fitted.campaign, (against or fitted).weights
    residual = weights(np.nan_to_num(fitted.point.residual))
    taken = np.nan_to_num(np.concatenate([weights(part) for part in fitted.point.required_columns], axis=1))
    explained_by_fit = basis_of(taken)
    residual = outside(explained_by_fit, residual[:, None])[:, 0]
    squares, rows = float(residual @ residual), weights.counts
    if squares <= 0:
        return ()
    width = fitted.point.residual.shape[1]
    # a residual is smaller than the scatter by what the fit took up
    lever = 1.0 - explained_by_fit.shape[1] / rows
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (FLIPS, campaign.poses))
    clear_patterns = []
    tried = list(patterns(fitted, campaign))
    for variable, values, turns, unit in tried:
        count = len(SIDES) if unit == SIDE else max(2, min(BINS, campaign.poses // POSES))
        part, parts = _parts(np.sign(values) if unit == SIDE else values, count)
        columns = np.zeros((len(campaign), width, len(parts) if turns is not None else 3 * len(parts)))
        columns[:, :3] = _columns(part, len(parts), turns)
        basis = _clear(outside(explained_by_fit, weights(columns)))
        rank = basis.shape[1]
        if rank == 0 or rows - rank < 3:
            continue
        of_reading = (basis * residual[:, None]).reshape(len(campaign), width, rank).sum(axis=1)
        of_pose = np.zeros((campaign.poses, rank))
        np.add.at(of_pose, campaign.pose, of_reading)
        explained = float((of_pose.sum(axis=0) ** 2).sum())
        if against is None:
            by_chance = _probability(explained, ((signs @ of_pose) ** 2).sum(axis=1) / max(lever, 0.1))
        else:
            by_chance = float(fdtrc(rank, max(1, against.freedom), explained / rank / against.factor))
        share = 1.0 - (1.0 - explained / squares) * rows / (rows - rank)
        if by_chance * len(tried) < chance and share > 0:
            words = pattern_words(fitted.point.residual[:, :3], part, parts, unit)
            if variable in ("order", "time") and goes_with_poses(values, campaign.readings.q):
                words += "; but the poses were taken in such an order: measure again in random order"
            clear_patterns.append(ResidualPattern(variable, words, float(share)))
    return tuple(sorted(clear_patterns, key=lambda one: -one.share)[:SHOWN])


def _clear(columns: Floats) -> Floats:
    """Orthonormal columns (n, r) of those that are more than rounding."""
    if not columns.shape[1]:
        return columns
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(u[:, s > max(1e-6 * s[0], 1e-6)])


def _probability(observed: float, by_chance: Floats) -> float:
    """That chance makes as much as ``observed``, of its own draws: beyond the largest of that by the gamma
    distribution of their mean and variance."""
    from scipy.special import gammaincc

    count = int((by_chance >= observed).sum())
    if count >= 10:
        return (count + 1) / (len(by_chance) + 1)
    mean, variance = float(by_chance.mean()), float(by_chance.var())
    if variance <= 0:
        return 1.0 if observed <= mean else 0.0
    return float(gammaincc(mean * mean / variance, observed * mean / variance))


def patterns(
    fitted: Fit, campaign: Campaign
) -> Iterator[tuple[str, Floats, Floats | None, tuple[str, float]]]:
    """Name, value (R,), what a turn of a joint does (R, 3), None for shifts, and unit of each variable."""
    readings, predicted = campaign.readings, fitted.point.predicted
    chain = fitted.model.chain
    coordinates = chain.placed(readings.q)
    swept = chain.evaluate(coordinates, campaign.tool)
    points = campaign.points(predicted, fitted.point.nuisances.places, campaign.at)
    torque = generalized_force(swept, swept.position, readings.wrench.T)
    loaded = bool(readings.wrench.any())
    for i, joint in enumerate(fitted.model.robot.joints):
        row = chain.motor_rows[i]
        turn = _turn(swept, row, points)
        for follower, leader, ratio in chain.couplings:
            if leader == row:
                turn = turn + ratio * _turn(swept, follower, points)
        turn = np.where(readings.based[:, None], 0.0, turn)
        if campaign.tracked:
            frames = fitted.point.nuisances.frames.rotation[readings.session]
            turn = (frames @ turn[:, :, None])[:, :, 0]
        angle = ("deg", DEG) if joint.kind == "revolute" else ("mm", MM)
        yield f"{joint.name} over its angle", readings.q[:, i], turn, angle
        if loaded and np.ptp(torque[row]) > 0:
            yield f"{joint.name} over its torque", torque[row], turn, ("N m", 1.0)
        sense = campaign.conditions.direction
        if sense is not None and np.ptp(sense[campaign.at, i]) > 0:
            yield f"{joint.name} over its approach", sense[campaign.at, i], turn, SIDE
    force = np.linalg.norm(readings.wrench[:, :3], axis=1)
    if np.ptp(force) > 0:
        yield "load", force, None, ("N", 1.0)
    yield "order", np.arange(1.0, len(readings) + 1), None, READING
    for name, values, unit in (("time", readings.time, "s"), ("temperature", readings.temperature, "degC")):
        if values is not None and np.ptp(values) > 0:
            yield name, values, None, (unit, 1.0)
    if len(readings.sessions) > 1:
        yield "session", readings.session.astype(float), None, ("", 1.0)


def _turn(swept: ChainKinematics, row: int, points: Floats) -> Floats:
    """(R, 3) what a coordinate moves ``points`` (R, 3) [m] by, per rad or m."""
    axis = swept.axes[row].T
    return np.cross(axis, points - swept.origins[row].T) if swept.turns[row] else axis


def _parts(values: Floats, count: int) -> tuple[Ints, Floats]:
    """The part (R,) of ``count`` or less each value falls in, and where the parts start and end (k, 2)."""
    distinct = np.unique(values)
    if len(distinct) <= count:
        return np.searchsorted(distinct, values), np.stack([distinct, distinct], axis=1)
    edges = np.unique(np.quantile(values, np.linspace(0, 1, count + 1)))
    part = np.clip(np.searchsorted(edges, values, "right") - 1, 0, len(edges) - 2)
    return part, np.stack([edges[:-1], edges[1:]], axis=1)


def _columns(part: Ints, parts: int, turns: Floats | None) -> Floats:
    """(R, 3, k): a turn, or shifts along three axes, in each part."""
    on = (part[:, None] == np.arange(parts)).astype(float)
    if turns is not None:
        return np.asarray(turns[:, :, None] * on[:, None, :])
    return np.asarray(np.eye(3)[None, :, :, None] * on[:, None, None, :]).reshape(len(part), 3, -1)


def pattern_words(residual: Floats, part: Ints, parts: Floats, unit: tuple[str, float]) -> str:
    """Where the ``residual`` (R, 3) [m] is largest and smallest, of the ``part`` (R,) that each reading is in;
    ``parts`` (k, 2): where these start and end."""
    enough = min(FEW, int(np.bincount(part).max()))
    size = np.array(
        [
            np.sqrt(3 * np.nanmean(residual[part == k] ** 2)) if (part == k).sum() >= enough else np.nan
            for k in range(len(parts))
        ]
    )
    most, least = int(np.nanargmax(size)), int(np.nanargmin(size))

    def span(k: int) -> str:
        low, high = parts[k] / unit[1]
        if unit == SIDE:
            return SIDES[int(low)]
        if unit == READING:
            return f"readings {np.ceil(low):.0f} .. {np.floor(high):.0f}"
        return f"{low:.4g}{f' .. {high:.4g}' if high > low else ''}{f' {unit[0]}' if unit[0] else ''}"

    return f"{size[most] / MM:.3g} mm at {span(most)}, {size[least] / MM:.3g} mm at {span(least)}"


def goes_with_poses(values: Floats, q: Floats) -> bool:
    """Whether the joints ``q`` (R, n) [rad, m] explain most of ``values`` (R,): what depends on one cannot be
    distinguished from the other."""
    spread = np.where(np.ptp(q, axis=0) > 0, np.ptp(q, axis=0), 1.0)
    scaled = (q - q.mean(axis=0)) / spread
    matrix = np.column_stack([np.ones(len(q)), scaled, scaled**2])
    if len(q) < 3 * matrix.shape[1]:
        return False
    residual = values - matrix @ np.linalg.lstsq(matrix, values, rcond=None)[0]
    return bool(residual @ residual < 0.5 * ((values - values.mean()) ** 2).sum())
