"""What explanations that the readings do not distinguish predict over the workspace: whether it matters for cutting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.candidate_fits import keys_of, point_without, with_effects
from postproc.diagnosis.candidates import Candidate
from postproc.effects import Conditions
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit
from postproc.identification.least_squares import descended
from postproc.model import StiffnessModel

STATES = 400
"""States of the workspace that explanations are compared at."""

AGREES = 0.1
"""Share of the scatter within which two corrections are the same."""

TRIED = 3
"""Explanations of a set that are compared with the first."""


def largest_disagreement(
    campaign: Campaign,
    base: Fit,
    final: Fit,
    chosen: Sequence[Candidate],
    alternatives: Sequence[Candidate],
) -> float:
    """[m] between what ``final`` and the same with an alternative in the place of the first one predict over the
    workspace and the loads that were used; infinite where an alternative has no equilibrium there.

    The alternative is fitted to what ``final`` predicts at the measured states, and starts with its values of what the
    robot file states, so that only what it can not imitate counts, neither the scatter nor what is known of those.
    Where tracker or targets are unknowns, what they make up for does not count: a base is touched off, and a tool is
    calibrated, with the robot itself.
    """
    first, *others = alternatives
    expected = campaign.shifted(-np.nan_to_num(final.point.residual))
    largest, base = 0.0, _with_values_of(base, final)
    states = _states(campaign, final.model)
    here = _places(campaign, final.model, *states)
    for other in others[:TRIED]:
        there = with_effects(expected, base, [other if c.key == first.key else c for c in chosen])
        difference = _places(campaign, there.model, *states) - here
        if not np.isfinite(difference).all():
            return np.inf
        difference = _beyond_touching_off(campaign, final.model, states[0], difference)
        largest = max(largest, float(np.linalg.norm(difference, axis=1).max()))
    return largest


def _with_values_of(base: Fit, final: Fit) -> Fit:
    """``base`` with its own parameters as ``final`` has them, as if the robot file stated these values."""
    values = {u.key: final.model.terms[u.term].values[u.parameter.name] for u in base.unknowns}
    asked = tuple(replace(u, value=values.get(u.key, u.value)) for u in base.asked)
    return replace(base, asked=asked, point=replace(base.point, model=base.model.with_values(values)))


def without_effects(campaign: Campaign, fitted: Fit, gone: Sequence[Candidate]) -> Fit:
    """The fit with the effects ``gone`` at their null, all other parameters as they were estimated beside them; tracker
    and targets found again."""
    keys: set[tuple[int, str]] = set()
    for candidate in gone:
        keys |= keys_of(fitted.model, candidate).keys()
    rest = [i for i, u in enumerate(fitted.unknowns) if u.key not in keys]
    point = descended(campaign, point_without(campaign, fitted, gone), (), fitted.plain_weights)
    own, nuisance = fitted.point.required_columns
    return replace(
        fitted,
        asked=tuple(u for u in fitted.asked if u.key not in keys),
        point=replace(point, columns=own[:, :, rest], nuisance=nuisance),
        unknowns=tuple(fitted.unknowns[i] for i in rest),
        covariance=fitted.covariance[np.ix_(rest, rest)],
    )


def _states(campaign: Campaign, model: StiffnessModel) -> tuple[Floats, Floats, Conditions]:
    """Joints (N, n) within their limits with the tool above the floor, wrenches (N, 6) as large as those that were used
    and of any direction, and conditions as they were met."""
    rng = np.random.default_rng(0)
    bounds = []
    for joint in model.robot.joints:
        turns = joint.kind == "revolute"
        reach = np.pi if turns else 1.0
        low = joint.lower if np.isfinite(joint.lower) else -reach
        high = joint.upper if np.isfinite(joint.upper) else reach
        bounds.append(
            (max(low, -np.pi), min(high, np.pi)) if turns and high - low > 2 * np.pi else (low, high)
        )
    low, high = np.array(bounds).T
    q = rng.uniform(low, high, (8 * STATES, len(low)))
    height = (model.chain.flange(q) @ campaign.tool).position[:, 2]
    above = q[height > min(0.0, float(np.median(height)))]
    q = above[:STATES]
    size = np.linalg.norm(campaign.readings.wrench[:, :3], axis=1).max(initial=0.0)
    way = rng.normal(size=(len(q), 3))
    wrench = np.zeros((len(q), 6))
    wrench[:, :3] = size * way / np.linalg.norm(way, axis=1, keepdims=True)
    seen = campaign.conditions
    row = rng.integers(0, len(campaign.q), len(q))
    given = Conditions(
        direction=None if seen.direction is None else rng.choice([-1.0, 1.0], q.shape),
        temperature=None if seen.temperature is None else seen.temperature[row],
        time=None if seen.time is None else seen.time[row],
    )
    return q, wrench, given


def _places(
    campaign: Campaign, model: StiffnessModel, q: Floats, wrench: Floats, conditions: Conditions
) -> Floats:
    """(N, 3) [m] of the TCP, or its displacement by the wrench where such were measured; NaN without equilibrium."""
    rest = model.equilibrium(q, wrench, campaign.tool, conditions)
    place = np.where(rest.converged[:, None], rest.pose.position, np.nan)
    if campaign.still is None:
        return place
    still = model.equilibrium(q, np.zeros_like(wrench), campaign.tool, conditions)
    return np.asarray(place - np.where(still.converged[:, None], still.pose.position, np.nan))


def _beyond_touching_off(campaign: Campaign, model: StiffnessModel, q: Floats, difference: Floats) -> Floats:
    """(N, 3) ``difference`` without a motion of the base and a shift of the tool, as far as those are unknowns."""
    columns = []
    pose = model.chain.flange(q) @ campaign.tool
    if campaign.tracked:
        columns += [
            np.broadcast_to(np.eye(3), (len(q), 3, 3)),
            np.cross(np.eye(3), pose.position[:, None, :]),
        ]
    if not campaign.place_known.all():
        columns.append(np.swapaxes(pose.rotation, 1, 2))
    if not columns:
        return difference
    matrix = np.swapaxes(np.concatenate(columns, axis=1), 1, 2).reshape(3 * len(q), -1)
    flat = difference.reshape(-1)
    return np.asarray(flat - matrix @ np.linalg.lstsq(matrix, flat, rcond=None)[0]).reshape(-1, 3)
