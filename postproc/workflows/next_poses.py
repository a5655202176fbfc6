"""Poses to measure next, where explanations cannot be distinguished: where these disagree most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Refusal
from postproc.base.units import DEG
from postproc.diagnosis.candidate_fits import composed, with_effects
from postproc.diagnosis.candidates import Candidate
from postproc.diagnosis.diagnosis import Diagnosis
from postproc.experiments.candidate_setups import (
    CandidateSetups,
    Setups,
    readings_of,
    spacings,
    usable_limits,
)
from postproc.experiments.discrimination import KnownReadings, apart
from postproc.experiments.measuring_order import measuring_order
from postproc.identification.fit import Fit
from postproc.identification.unknowns import Unknown
from postproc.measurements import Readings
from postproc.model import STANDARD_GRAVITY, StiffnessModel, approach
from postproc.report.diagnosed import HANGS, NextPoses
from postproc.report.diagnosed_words import SETTLES
from postproc.workflows.identify import Measured

NEXT = 6
"""Poses proposed to distinguish two explanations."""

HARDLY = 0.5
"""Standard deviations between two explanations below which poses are not worth measuring."""

LOADS = 3
"""Of the weights that were hung, so many different ones are proposed again."""

FINE = 1e-6
"""[m] Scatter that poses are proposed for at least."""

TRIED = 2
"""Explanations of a set that the first is distinguished from."""

WIDER = 0.05
"""Share of the range of an axis by which next poses may leave what was measured."""

CANDIDATES = 300
"""Poses to choose from."""

SPREAD = 0.15
"""Share of the ranges of the axes, in the mean, by which two proposed poses differ at least: what is repeated at one
pose repeats its errors too.  Of two random poses it is a third."""


def next_poses(measured: Measured, diagnosis: Diagnosis, payload: float, pulls: bool) -> NextPoses | None:
    """Poses, of those loads and targets that were used, at which the explanations disagree most; None where none do.
    ``payload`` [kg]: the heaviest weight that may be hung; ``pulls``: forces can be pulled with."""
    candidates = _candidate_setups(measured, diagnosis.search.final, payload, pulls)
    # where the arm was it can go again
    narrow = replace(candidates, limits=_measured_ranges(measured.readings.q, candidates.limits))
    if measured.readings.deflection and not len(candidates.loads) + len(candidates.pulls):
        return None  # what can be hung or pulled with is not known
    sets = [(first, others[:TRIED]) for first, *others in diagnosis.verdict.alternatives]
    # poses that differ less are better than none
    for offered in (narrow, candidates, replace(candidates, spread=0.0)):
        plans = [
            plan for first, others in sets for plan in _plans(measured, diagnosis, offered, first, others)
        ]
        best = max(plans, key=lambda plan: min(plan.separation), default=None)
        if best is not None and (min(best.separation) >= SETTLES or offered is not narrow):
            return replace(best, beyond=_beyond(measured, best, narrow.limits))
    return None


def _measured_ranges(q: Floats, limits: Floats) -> Floats:
    """(n, 2) [rad, m] the ranges of ``q`` (R, n), a little widened, within the ``limits`` (n, 2)."""
    low, high = q.min(axis=0), q.max(axis=0)
    wider = WIDER * (high - low)
    return np.stack(
        [np.clip(low - wider, *limits.T), np.maximum(np.clip(high + wider, *limits.T), limits[:, 0])], axis=1
    )


def _beyond(measured: Measured, plan: NextPoses, ranges: Floats) -> tuple[str, ...]:
    """Names of the joints that a plan moves out of ``ranges`` (n, 2) [rad, m]."""
    q = plan.readings.q
    out = np.flatnonzero(((q < ranges[:, 0] - 1e-9) | (q > ranges[:, 1] + 1e-9)).any(axis=0))
    return tuple(measured.robot.joints[i].name for i in out)


def _plans(
    measured: Measured,
    diagnosis: Diagnosis,
    candidates: CandidateSetups,
    first: Candidate,
    others: Sequence[Candidate],
) -> list[NextPoses]:
    """A plan for each of the ``others``; or one for all, where as many poses, a part for each, settle all."""
    models = [_both(diagnosis, candidates, first, other) for other in others]

    def poses(pair: ExplanationPair, count: int, aside: int = 0) -> tuple[Setups, tuple[float, float]] | None:
        """``count`` of them, other ones of another seed, ``aside``."""
        try:
            found = apart(
                pair.model,
                pair.first,
                pair.second,
                pair.common,
                candidates,
                (count,),
                seed=1 + aside,
                candidates=CANDIDATES,
                before=pair.known,
            )
        except Refusal:
            return None
        return found.chosen[count], found.separation[count]

    def plan(
        pair: ExplanationPair, other: Candidate, setups: Setups, separation: tuple[float, float]
    ) -> NextPoses:
        setups = setups[measuring_order(setups.q, spacings(measured.robot, candidates.spacing))]
        return NextPoses(
            _like(measured, readings_of(pair.model, candidates, setups)), (first, other), separation
        )

    entries = [(pair, other) for pair, other in zip(models, others, strict=True) if pair is not None]
    if len(entries) > 1:
        parts = [poses(pair, NEXT // len(entries), k) for k, (pair, _) in enumerate(entries)]
        each = [part for part in parts if part is not None]
        least = [min(separation) for _, separation in each]
        if len(each) == len(entries) and min(least) >= SETTLES:
            together, *further = (setups for setups, _ in each)
            for more in further:
                together = together + more
            nearest = int(np.argmin(least))
            return [plan(*entries[nearest], together, each[nearest][1])]
    alone = [(pair, other, poses(pair, NEXT)) for pair, other in entries]
    return [
        plan(pair, other, *found)
        for pair, other, found in alone
        if found is not None and min(found[1]) >= HARDLY
    ]


class ExplanationPair(NamedTuple):
    """Two explanations as the unknowns ``first`` and ``second`` of one ``model``, ``common`` ones beside, and what was
    read."""

    model: StiffnessModel
    first: tuple[Unknown, ...]
    second: tuple[Unknown, ...]
    common: list[Unknown]
    known: KnownReadings


def _both(
    diagnosis: Diagnosis, candidates: CandidateSetups, one: Candidate, other: Candidate
) -> ExplanationPair | None:
    """The model with both, each as large as it was fitted; None where the other one has no equilibrium."""
    search = diagnosis.search
    base, rest = search.base, [c for c in search.chosen if c.key != one.key]
    try:
        there = with_effects(base.campaign, base, [other, *rest], exact=False)
    except Refusal:
        return None
    model, first = composed(base.model, [one])
    model, second = composed(model, [other])
    model, beside = composed(model, rest)
    of_rest = {k: v for c in rest for k, v in _values(search.final, beside, c).items()}
    model = model.with_values(_values(search.final, first, one) | _values(there, second, other) | of_rest)
    # what else is fitted imitates too, as far as readings and priors let it
    keys = {u.key for u in (*first, *second)}
    common = [u for u in (*base.unknowns, *beside) if u.key not in keys]
    weights = search.final.weights
    scale = float(np.median(search.final.noise.sigma)) / candidates.sigma
    weights = replace(weights, weight=weights.weight * scale, shared=candidates.shared)
    known = KnownReadings(base.campaign, search.final.point.nuisances, weights)
    return ExplanationPair(model, first, second, common, known)


def _like(measured: Measured, planned: Readings) -> Readings:
    """The plan with the columns that the readings so far have, so that both can be read as one: time and temperature
    are to be filled in, senses of approach follow from the order."""
    before, empty = measured.readings, np.full(len(planned), np.nan)
    direction = planned.direction
    if before.direction is None:
        direction = None
    elif direction is None:
        direction = approach(planned.q)
    return replace(
        planned,
        in_robot_frame=before.in_robot_frame,
        tool=before.tool,
        places={name: place for name, place in before.places.items() if name not in before.on_base},
        time=None if before.time is None else empty,
        temperature=None if before.temperature is None else empty,
        direction=direction,
    )


def _values(final: Fit, unknowns: Sequence[Unknown], candidate: Candidate) -> dict[tuple[int, str], float]:
    """The fitted values of a candidate's parameters, as values of a model in which they are ``unknowns``."""
    wanted = (candidate.name, candidate.effect.form())
    fitted = next((t.values for t in final.model.terms if (t.effect.name, t.effect.form()) == wanted), {})
    return {u.key: fitted[u.parameter.name] for u in unknowns if u.parameter.name in fitted}


def _candidate_setups(measured: Measured, final: Fit, payload: float, pulls: bool) -> CandidateSetups:
    """What was measured with: targets, weights within the payload, scatter; and pulls where there can be such."""
    readings, campaign = measured.readings, measured.campaign
    in_flange = campaign.tool.rotation @ final.point.nuisances.places[:, :, None]
    moving = ~campaign.on_base
    loads = within_payload(hung_weights(readings), payload)
    pulled = pulls_like(readings) if pulls else np.zeros((0, 3))
    scale = float(np.sqrt(final.factor))
    if len(loads) > LOADS:
        loads = loads[np.linspace(0, len(loads) - 1, LOADS).round().astype(int)]
    return CandidateSetups(
        tool=campaign.tool,
        targets=tuple(name for name in readings.targets if name not in readings.on_base),
        places=(in_flange[:, :, 0] + campaign.tool.position)[moving],
        rough=campaign.tracked,
        loads=loads if len(loads) or readings.deflection else np.zeros(1),
        pulls=pulled,
        each_load=False,
        deflection=readings.deflection,
        sigma=max(FINE, scale * float(np.median(final.noise.sigma))),
        shared=scale * final.weights.shared,
        limits=usable_limits(measured.robot, {}),
        box=_box(),
        tracker=None,
        cone=np.pi,
        spacing=5 * DEG,
        spread=SPREAD,
    )


def hung_weights(readings: Readings) -> Floats:
    """(L,) [kg] weights that were hung: forces straight down, not pulls; 0 too where places without a load are
    measured."""
    force = readings.wrench[:, :3]
    size = np.linalg.norm(force, axis=1)
    down = -force[:, 2] >= HANGS * size
    loads = np.unique(np.round(size[down] / STANDARD_GRAVITY, 1))
    return loads[loads > 0] if readings.deflection else loads


def within_payload(loads: Floats, payload: float) -> Floats:
    """(K,) [kg] those of ``loads`` (L,) that the robot may carry."""
    return loads[loads <= payload]


def pulls_like(readings: Readings) -> Floats:
    """(6, 3) [N] along and against each axis of the robot base, as large as the largest force that was measured with;
    none where there was none."""
    size = float(np.linalg.norm(readings.wrench[:, :3], axis=1).max(initial=0.0))
    return size * np.concatenate([np.eye(3), -np.eye(3)]) if size > 0 else np.zeros((0, 3))


def _box() -> Floats:
    """Nothing below the floor that the robot is on."""
    return np.array([[-np.inf, np.inf], [-np.inf, np.inf], [0.0, np.inf]])
