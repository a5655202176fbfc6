"""The search for what is missing: linear steps over all candidates, non-linear fits of what they choose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.candidates import Candidate, candidates, is_visible
from postproc.diagnosis.decoys import AlternativeForm, decoys
from postproc.diagnosis.nonlinear_effects import Outside, evaluate_at_size, whole
from postproc.diagnosis.selection import (
    Explained,
    Problem,
    basis_of,
    beside,
    complexity_penalty,
    counts,
    explained,
    outside,
    problem,
    residual_of,
    scatter,
    selected,
)
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit, fit
from postproc.identification.least_squares import Point, at, prior_rows, scales
from postproc.identification.noise import Weighting
from postproc.identification.unknowns import Unknown, unknowns_of, with_mechanism
from postproc.model import StiffnessModel

PASSES = 4
"""Of choosing and fitting, until the choice stands."""

LOOSE, BESIDE = 0.5, 0.05
"""Standard deviation of what a robot file states, as shares of the value and of the largest of its kind."""

IMITATED = 1e-3
"""Share of a column that must lie outside of what the robot file's own parameters do."""

CLOSE, CLOSE_SHARE, RIVALS = 30.0, 0.05, 3
"""Alternatives are fitted where -2 ln(likelihood) is linearly worse by less than this, or than this share of the gain;
so many at most."""

FORM = 0.01
"""Share of what another effect explains that one must explain itself: no form in the library is exact, and what a large
effect does beside its form looks like small ones."""

SHARED = 1.0
"""Stated standard deviations that readings of a pose may share: of a robot that does not quite come back, of one
unloaded reading.  What they share beyond that is no scatter."""

WILD = 5.0
"""Standard deviations that a reading counts with at most."""

Key = tuple[str, str]
"""Label of an effect's form, and its joint."""


@dataclass(frozen=True, eq=False)
class Linear:
    """A search's last step.  candidates: what was looked at, group by group of ``problem``; whitened and as they are:
    residual (n,) without what was chosen, common (n, k) columns that are explained anyway, columns (n, p) of each
    candidate; the last ``priors`` rows are no readings; ``weights`` that it was whitened with."""

    candidates: tuple[Candidate, ...]
    problem: Problem
    residual: Floats
    common: Floats
    columns: tuple[Floats, ...]
    priors: int
    weights: Weighting


@dataclass(frozen=True, eq=False)
class Alternative:
    """A ``candidate`` in the place of the choice ``of``: by how much -2 ln(likelihood) is ``worse``, and what it pays
    ``more`` for its parameters (negative: less); ``fitted``, or only linearly so."""

    of: Key
    candidate: Candidate
    worse: float
    more: float
    fitted: bool

    @property
    def margin(self) -> float:
        """By how much it is the lesser explanation; negative: the better one."""
        return self.worse + self.more

    @property
    def foil(self) -> bool:
        """Whether it is never named itself."""
        return isinstance(self.candidate.effect, AlternativeForm)


@dataclass(frozen=True, eq=False)
class Search:
    """What a search came to.

    base: the model as it is, its own parameters refitted; final: with what was ``chosen``; untestable: candidates
    that these readings cannot show; linear, explained: the last choice; rivals: those of
    what was chosen, nearest first.
    """

    base: Fit
    final: Fit
    chosen: tuple[Candidate, ...]
    untestable: tuple[Candidate, ...]
    linear: Linear
    explained: Explained
    rivals: tuple[Alternative, ...]


def model_unknowns(model: StiffnessModel) -> tuple[Unknown, ...]:
    """The parameters that the robot file states: they may have changed since, but a known arm is not any arm.

    Each has a prior as wide as ``LOOSE`` of its value and ``BESIDE`` of the largest of its kind in the effect; none
    where all of a kind are stated as zero.  Dimensions of hardware keep the interval of the robot file.
    """
    found: list[Unknown] = []
    for term in range(len(model.terms)):
        own = [u for u in unknowns_of(model, term) if u.stated is not None and not u.fixed]
        for unknown in own:
            parameter = unknown.parameter
            if parameter.hardware:
                found.append(unknown)
                continue
            like = [abs(u.value - u.parameter.null) for u in own if u.parameter.unit == parameter.unit]
            wide = LOOSE * abs(unknown.value - parameter.null) + BESIDE * max(like)
            found.append(replace(unknown, prior=wide or None))
    return tuple(found)


def search(campaign: Campaign, base: Fit, banned: Sequence[Key] = ()) -> Search:
    """Chooses among all effects of the library those that the readings ask for, beyond ``base``: the model of the robot
    file with its own parameters refitted.  ``banned``: candidates that were found not to hold."""
    chosen: tuple[Candidate, ...] = ()
    fitted = base
    tried: set[frozenset[Key]] = set()
    # what a missing effect does to all readings of a pose looks like an error that they share
    weights = replace(base.weights, shared=0.0)
    every = drop_confounded(base, weights, candidates(campaign, base.model, base.point.given))
    shown = [c for c in every if is_visible(c, weights) and c.key not in banned]
    hidden = tuple(c for c in every if not is_visible(c, weights))
    while True:
        linear = _linear(campaign, base, weights, fitted, chosen, shown)
        if not chosen:
            shown = list(linear.candidates)
        before = {c.key for c in chosen}
        start = [i for i, c in enumerate(linear.candidates) if c.key in before]
        found = selected(linear.problem, range(len(linear.candidates)), start)
        now = tuple(linear.candidates[g] for g in found.groups)
        keys = frozenset(c.key for c in now)
        if keys == before or keys in tried or len(tried) >= PASSES:
            last = explained(linear.problem, start)
            against = _alternatives(campaign, base, fitted, linear, last)
            better = next((r for r in against if r.fitted and not r.foil and r.margin < -1.0), None)
            done = Search(base, fitted, chosen, hidden, linear, last, against)
            if better is None or len(tried) >= PASSES:
                return done
            now = tuple(better.candidate if c.key == better.of else c for c in chosen)
            keys = frozenset(c.key for c in now)
            if keys in tried:
                return done
        tried.add(keys)
        chosen, fitted = _confirmed(campaign, base, now, shown)
        weights = limit_shared_scatter(base, fitted)


def drop_confounded(base: Fit, weights: Weighting, every: Sequence[Candidate]) -> list[Candidate]:
    """The candidates without those parameters that, in their usual size, do nothing to be seen but what parameters of
    the robot file, or tracker and targets, do as well: a gain of the force is a softer arm."""
    basis = basis_of(np.nan_to_num(np.concatenate([weights(part) for part in base.point.taken], axis=1)))
    found = []
    for c in every:
        columns = np.nan_to_num(weights(c.columns))
        size = np.linalg.norm(columns, axis=0)
        own = np.linalg.norm(outside(basis, columns), axis=0) > np.maximum(IMITATED * size, c.least)
        if own.any():
            # of those that only shape what another does nothing is said by themselves
            own |= np.array([u.parameter.name in c.dormant_parameters for u in c.unknowns])
        if own.any() and not own.all():
            c = replace(
                c,
                unknowns=tuple(u for u, alone in zip(c.unknowns, own.tolist(), strict=True) if alone),
                columns=c.columns[:, :, own],
            )
        found.append(c if own.any() else replace(c, columns=np.zeros_like(c.columns)))
    return found


def _confirmed(
    campaign: Campaign, base: Fit, chosen: tuple[Candidate, ...], shown: Sequence[Candidate]
) -> tuple[tuple[Candidate, ...], Fit]:
    """Those of ``chosen`` that count as well where what readings of a pose share is taken from a fit without them, and
    that are not small beside others; the weakest first.  And the fit with them."""
    fitted, among = with_effects(campaign, base, chosen) if chosen else base, len(shown)
    while chosen:
        linear = _linear(campaign, base, limit_shared_scatter(base, base), fitted, chosen, chosen)
        places = range(len(chosen))
        without = [explained(linear.problem, [g for g in places if g != gone]) for gone in places]
        weakest = int(np.argmin([one.squares for one in without]))
        rest = tuple(c for k, c in enumerate(chosen) if k != weakest)
        fit_of_rest = with_effects(campaign, base, rest) if rest else base
        weights = limit_shared_scatter(base, fit_of_rest)
        given = _linear(campaign, base, weights, fitted, chosen, chosen).problem
        others = [g for g in places if g != weakest]
        gains = [one.squares - explained(linear.problem, places).squares for one in without]
        if min(gains) >= FORM * max(gains) and counts(
            given, explained(given, others), explained(given, places), among
        ):
            break
        chosen, fitted = rest, fit_of_rest
    return chosen, fitted


def limit_shared_scatter(base: Fit, fitted: Fit) -> Weighting:
    """The weights of ``fitted`` for what was fitted; readings of a pose share no more than scatter can be."""
    shared = fitted.weights.shared
    if base.noise.known:
        shared = min(shared, SHARED * float(np.median(base.noise.sigma)))
    return replace(fitted.plain_weights, shared=shared)


def _linear(
    campaign: Campaign,
    base: Fit,
    weights: Weighting,
    fitted: Fit,
    chosen: Sequence[Candidate],
    shown: Sequence[Candidate],
) -> Linear:
    """The problem that the candidates' columns make of what ``fitted`` leaves without what was chosen; priors of the
    model's own parameters count as rows."""
    own, nuisance = base.point.taken
    prior = prior_rows(base.unknowns) * np.sqrt(fitted.factor)
    prior = prior[prior.any(axis=1)]
    away = np.array([u.value for u in base.unknowns]) - _values(fitted.model, base.unknowns)

    def tall(columns: Floats, below: Floats) -> Floats:
        return np.nan_to_num(np.concatenate([weights(columns), below]))

    def readings(columns: Floats) -> Floats:
        return tall(columns, np.zeros((len(prior), columns.shape[2])))

    common = np.concatenate([tall(own, prior), readings(nuisance)], axis=1)
    basis = basis_of(common)
    looked = _as_fitted(campaign, fitted, chosen, shown)
    with_chosen = [readings(c.columns) for c in looked if c.only]
    beyond = basis_of(np.concatenate([common, *with_chosen], axis=1)) if with_chosen else basis
    looked = tuple(
        _as_grown(campaign, fitted, c, lambda columns: outside(beyond, readings(columns)))
        if c.nonlinear and not c.only and not (c.start and chosen)
        else c
        for c in looked
    )
    # so that with what was found of each nothing else is left than by the fit
    found = [c.columns @ in_scales(fitted, c.only) for c in looked if c.only]
    residual = tall(sum(found, fitted.point.residual), prior @ (away / scales(base.unknowns)))
    columns = tuple(readings(c.columns) for c in looked)
    groups = [(own, _reach(c)) for own, c in zip(columns, looked, strict=True)]
    made = problem(residual, basis, groups, weights.counts + len(prior), base.noise.known)
    return Linear(looked, made, residual, common, columns, len(prior), weights)


def _as_grown(campaign: Campaign, fitted: Fit, candidate: Candidate, beyond: Outside) -> Candidate:
    """The candidate with its columns at the size that explains the most of what ``fitted`` leaves."""
    model, unknowns = composed(fitted.model, [candidate])
    large = evaluate_at_size(campaign, fitted.point, model, unknowns, beyond)
    return replace(candidate, columns=large.columns, start=tuple(large.values.tolist()))


def in_scales(fitted: Fit, unknowns: Sequence[Unknown]) -> Floats:
    """(P,) what was found of unknowns, from their nulls, in their scales."""
    nulls = np.array([u.parameter.null for u in unknowns])
    return (fitted.point.values(unknowns) - nulls) / scales(unknowns)


def _values(model: StiffnessModel, unknowns: Sequence[Unknown]) -> Floats:
    return np.array([model.terms[u.term].values[u.parameter.name] for u in unknowns])


def squares_of(fitted: Fit, weights: Weighting, variance: float) -> float:
    """Squares that a fit leaves, of readings [their variance by ``weights``, wild ones cut] and of priors; ``variance``
    of the readings as they are seen to scatter."""
    level = np.sqrt(variance)
    left = np.minimum(np.abs(weights(fitted.point.residual)), WILD * level)
    values = fitted.point.values(fitted.unknowns)
    priors = sum(
        (level * (u.value - value) / u.prior) ** 2
        for u, value in zip(fitted.unknowns, values.tolist(), strict=True)
        if u.prior is not None
    )
    return float(left @ left) + float(priors)


def _alternatives(
    campaign: Campaign, base: Fit, fitted: Fit, linear: Linear, last: Explained
) -> tuple[Alternative, ...]:
    """Other candidates in the place of each choice that explain at least half of what it does, nearest first; the
    nearest are fitted: what is linear is only nearly so."""
    given, chosen = linear.problem, [linear.candidates[g] for g in last.groups]
    variance = scatter(given, last)
    here = squares_of(fitted, fitted.weights, variance)
    found: list[Alternative] = []
    for group in last.groups:
        mine = linear.candidates[group]
        rest = explained(given, tuple(g for g in last.groups if g != group))
        gain, left = rest.squares - last.squares, residual_of(given, rest)

        def paid(columns: Floats, rest: Explained = rest, left: Floats = left) -> float:
            return complexity_penalty(beside(given, rest, columns), left, variance)

        def scaled(g: int) -> Floats:
            return given.matrix[:, given.places[g]] * given.size[given.places[g]]

        own, of_mine = paid(scaled(group)), []
        against = [
            *enumerate(linear.candidates),
            *((-1, decoy) for decoy in decoys(base.model, campaign.readings.q, mine)),
        ]
        for other, candidate in against:
            if other in last.groups or candidate.contains(mine) or mine.contains(candidate):
                continue
            if candidate.nonlinear:
                instead, squares, columns = _instead(campaign, fitted, linear, rest, mine, candidate)
            else:
                instead, squares = candidate, explained(given, (*rest.groups, other)).squares
                columns = scaled(other)
            if rest.squares - squares > 0.5 * gain:
                worse = float(squares - last.squares) / variance
                of_mine.append(Alternative(mine.key, instead, worse, paid(columns) - own, False))
        of_mine.sort(key=lambda rival: rival.margin)
        for k, rival in enumerate(of_mine[:RIVALS]):
            if rival.margin < max(CLOSE, CLOSE_SHARE * gain / variance):
                there = with_effects(campaign, base, [rival.candidate if c is mine else c for c in chosen])
                worse = float(squares_of(there, fitted.weights, variance) - here) / variance
                of_mine[k] = replace(rival, worse=worse, fitted=True)
        found += of_mine
    return tuple(sorted(found, key=lambda rival: rival.margin))


def _instead(
    campaign: Campaign, fitted: Fit, linear: Linear, rest: Explained, mine: Candidate, other: Candidate
) -> tuple[Candidate, float, Floats]:
    """``other``, that is not linear in its size, as large as explains the most in the place of ``mine`` beside
    ``rest``; the squares that are left then, and its columns outside of what is explained anyway."""
    without = _without(campaign, fitted, [mine])
    model, unknowns = composed(without.model, [other])
    basis = basis_of(linear.common)
    beyond = basis_of(np.concatenate([linear.common, *(linear.columns[g] for g in rest.groups)], axis=1))

    def readings(columns: Floats) -> Floats:
        below = np.zeros((linear.priors, columns.shape[2]))
        return np.nan_to_num(np.concatenate([linear.weights(columns), below]))

    large = evaluate_at_size(
        campaign, without, model, unknowns, lambda columns: outside(beyond, readings(columns))
    )
    gain = float(large.target @ large.target - large.left @ large.left)
    alternative = replace(other, columns=large.columns, start=tuple(large.values.tolist()))
    return alternative, rest.squares - gain, outside(basis, readings(large.columns))


def with_effects(campaign: Campaign, base: Fit, chosen: Sequence[Candidate]) -> Fit:
    """The non-linear fit with the effects ``chosen`` added to ``base``, its own unknowns fitted along."""
    model, unknowns = composed(base.model, chosen)
    start: dict[tuple[int, str], float] = {}
    for candidate in chosen:
        start |= _begun(campaign, base, model, candidate)
    own = [u for u in base.asked if u.key in {b.key for b in base.unknowns}]
    # what turns out not to be seen stays where it is begun with: without a length a spring is none
    looked = [replace(u, value=start.get(u.key, u.value)) if u.prior is None else u for u in unknowns]
    return fit(campaign, model.with_values(start), [*own, *looked], given=base.point.given)


def _begun(
    campaign: Campaign, base: Fit, model: StiffnessModel, candidate: Candidate
) -> dict[tuple[int, str], float]:
    """Values to start a fit of ``candidate`` in ``model`` with; those that no reading sees stay at their null."""
    term = _term_of(model, candidate)
    if term is None or not candidate.start:
        return {}
    nulls = {(term, u.parameter.name): u.parameter.null for u in candidate.unknowns}
    start = dict(zip(nulls, candidate.start, strict=True))
    there = at(campaign, model.with_values(start), base.point.given)
    if not there.predicted.converged.all():
        return {}
    for key, null in nulls.items():
        without = at(
            campaign, model.with_values({**start, key: null}), base.point.given, there.predicted.displacement
        )
        moved = np.linalg.norm(base.weights(np.nan_to_num(without.residual - there.residual)))
        if without.predicted.converged.all() and moved < 1.0:
            start[key] = null
    return start


def composed(
    model: StiffnessModel, chosen: Sequence[Candidate]
) -> tuple[StiffnessModel, tuple[Unknown, ...]]:
    """``model`` with the effects of ``chosen``, and their unknowns in it."""
    unknowns: list[Unknown] = []
    for candidate in chosen:
        term = _term_of(model, candidate)
        if term is None:
            if any(mechanism.kind == candidate.name for mechanism in model.robot.mechanisms):
                model = with_mechanism(model, type(candidate.effect))
            else:
                model = model.with_effect(candidate.effect)
            term = len(model.terms) - 1
        names = {u.parameter.name for u in candidate.unknowns}
        known = {u.key for u in unknowns}
        unknowns += [u for u in unknowns_of(model, term) if u.parameter.name in names and u.key not in known]
    return model, tuple(unknowns)


def _term_of(model: StiffnessModel, candidate: Candidate) -> int | None:
    wanted = (candidate.name, candidate.effect.described())
    for index, term in enumerate(model.terms):
        if (term.effect.name, term.effect.described()) == wanted:
            return index
    return None


def _as_fitted(
    campaign: Campaign, fitted: Fit, chosen: Sequence[Candidate], looked: Sequence[Candidate]
) -> tuple[Candidate, ...]:
    """The candidates, those chosen with their columns at the fit instead of at their null."""
    own, _ = fitted.point.taken
    values = in_scales(fitted, fitted.unknowns)
    there: dict[Key, Candidate] = {}
    for candidate in chosen:
        term = _term_of(fitted.model, candidate)
        names = {u.parameter.name for u in candidate.unknowns}
        at = [i for i, u in enumerate(fitted.unknowns) if u.term == term and u.parameter.name in names]
        if not at:
            continue
        columns = np.nan_to_num(own[:, :, at])
        if candidate.nonlinear:
            does = _without(campaign, fitted, [candidate]).residual - fitted.point.residual
            columns = whole(columns, np.nan_to_num(does), values[at])
        there[candidate.key] = candidate.fitted(columns, [fitted.unknowns[i] for i in at])
    return tuple(there.get(c.key, c) for c in looked)


def _without(campaign: Campaign, fitted: Fit, chosen: Sequence[Candidate]) -> Point:
    """The fitted model with what was chosen put back to its null: what there is to explain."""
    nulls: dict[tuple[int, str], float] = {}
    for candidate in chosen:
        term = _term_of(fitted.model, candidate)
        if term is not None:
            nulls |= {(term, u.parameter.name): u.parameter.null for u in candidate.unknowns}
    if not nulls:
        return fitted.point
    return at(campaign, fitted.model.with_values(nulls), fitted.point.given)


def _reach(candidate: Candidate) -> Floats:
    """(p, 2) how far each parameter may go from its null, in its scale."""
    return np.array(
        [
            [
                (u.parameter.lower - u.parameter.null) / u.parameter.scale,
                (u.parameter.upper - u.parameter.null) / u.parameter.scale,
            ]
            for u in candidate.shown
        ]
    )
