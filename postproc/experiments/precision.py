"""Designs for precise parameters: the choice of setups, and the intervals that a fit to them will state."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.units import MM
from postproc.experiments.candidate_setups import CandidateSetups, Setups, drawn, spacings
from postproc.experiments.criteria import AtTestPoses, Criterion, Determinant, Minimax
from postproc.experiments.exchange import CandidateSet, exchanged, grown, random_choice
from postproc.experiments.observability import Observability, influential, judged, observability
from postproc.experiments.pool import (
    CANDIDATES,
    Choice,
    Pool,
    Stage,
    enough,
    pooled,
    refined,
    rested,
    silent,
)
from postproc.experiments.unobservable import reason
from postproc.identification.identifiable import COVERAGE, UNSEEN, Dropped, basis
from postproc.identification.least_squares import prior_rows, scales
from postproc.identification.unknowns import Unknown
from postproc.model import StiffnessModel

FEW = 300
"""Of them, to check whether an effect is dormant."""

STARTS = 3
"""Random designs that the exchange also starts with."""

RANDOM = 20
"""Random designs to compare with."""

LOOSE = 1e-6
"""Information of what nothing is known of: an interval of 1,000 times the wanted one, 1 m of a nuisance."""

HOPELESS = 10.0
"""What stays so many times as wide as wanted is given up, and the others are not spoiled for it."""


@dataclass(frozen=True)
class DesignProblem:
    """What is asked for.

    wanted (P,) [SI]: half widths of the 95 % intervals; counts (P,): whether an unknown is to be made precise.  before:
    readings that exist.  tests (k, P) [m per SI unit]: R of R^T R, the mean of S^T S over the poses that matter, S what
    the unknowns do there; None without.
    """

    model: StiffnessModel
    unknowns: tuple[Unknown, ...]
    setups: CandidateSetups
    wanted: Floats
    counts: Bools
    criterion: str = "minimax"
    before: Observability | None = None
    tests: Floats | None = None


@dataclass(frozen=True)
class Design:
    """A choice of setups.  ci95 (P,) [SI]: what a fit will state, NaN of what it must leave out (``dropped``); worst:
    largest ratio to the wanted ones, infinite where one that counts is left out; test [m]: root mean square of the
    standard deviation at the poses that matter, NaN without."""

    setups: Setups
    ci95: Floats
    worst: float
    dropped: tuple[Dropped, ...]
    test: float


@dataclass(frozen=True)
class UnobservableParameter:
    """A parameter that is not observable, or too weakly, and why in words.  imitated: a place of the tracker or of
    its targets does the same, which is no loss."""

    name: str
    why: str
    imitated: bool = False


@dataclass(frozen=True)
class Designs:
    """Designs by number of poses.

    model: with effects that were dormant at the sizes of their parameters; candidates: that there were to choose from;
    at_random: medians over random designs of the intervals (P,) and of their worst ratio; before: intervals (P,) by the
    readings that exist, None without; unobservable: what no pose can show; left_out, weak: what the design of the
    wanted number of poses does not show, or less precisely than wanted, weakest first.
    """

    model: StiffnessModel
    candidates: Setups
    chosen: dict[int, Design]
    at_random: dict[int, tuple[Floats, float]]
    before: Floats | None
    unobservable: tuple[UnobservableParameter, ...]
    left_out: tuple[UnobservableParameter, ...]
    weak: tuple[UnobservableParameter, ...]


def designs(
    task: DesignProblem,
    poses: int,
    others: Iterable[int] = (),
    seed: int = 1,
    candidates: int = CANDIDATES,
    stage: Stage = silent,
) -> Designs:
    """The best design found of ``poses`` setups, and of ``others`` beside it: a larger one is never worse.

    Others for which there are not enough distinct poses are left out.  Raises Refusal PLN001 (no pose can be measured),
    PLN002 (nothing that is asked for can be seen), PLN003 (no rest), PLN004 (not enough distinct poses).
    """
    rng, allowed, unknowns = np.random.default_rng(seed), task.setups, task.unknowns
    stage("looking for poses")
    setups = drawn(task.model, allowed, candidates, rng)
    model = influential(task.model, unknowns, allowed, setups[:FEW])

    def evaluated(some: Setups) -> Pool:
        return pooled(some, observability(model, unknowns, allowed, some))

    stage("computing what poses show")
    start = rested(model, setups, evaluated)
    whole = judged(model, unknowns, start.shown, task.before)[1]
    unobservable = tuple(_unobservable(task, model, start, dropped) for dropped in whole.dropped)
    if not whole.observable:
        lost = "; ".join(f"{one.name}: {one.why}" for one in unobservable)
        message = f"no parameter is observable at any pose: {lost}"
        raise Refusal(Finding("PLN002", message, str(model.robot.path)))
    observable = list(whole.observable)
    sizes = sorted({poses, *others})
    task = replace(task, counts=task.counts & np.isin(range(len(unknowns)), observable))
    hopeful = task
    while True:
        criterion = _criterion(hopeful, observable, len(start.shown.names))

        def chosen_from(pool: Pool, start_choice: Choice, criterion: Criterion = criterion) -> Choice:
            return _by_size(choices_of(task, observable, pool), criterion, sizes, start_choice, rng)

        pool, chosen = refined(model, allowed, start, evaluated, chosen_from, rng, stage)
        enough(model, allowed, poses, poses if poses in chosen else max(chosen, default=0))
        wide = ~(_design(task, model, pool[chosen[poses]]).ci95 < HOPELESS * task.wanted)
        if not (hopeful.counts & wide).any() or not (hopeful.counts & ~wide).any():
            break
        hopeful = replace(hopeful, counts=hopeful.counts & ~wide)
        if task.criterion == "test":
            break
    stage("comparing with random poses")
    some = choices_of(task, observable, start)
    best = {size: _design(hopeful, model, pool[rows]) for size, rows in chosen.items()}
    never = {lost.name for lost in unobservable}
    missed = [dropped for dropped in best[poses].dropped if dropped.name not in never]
    before = None if task.before is None else judged(model, unknowns, start.shown[:0], task.before)[0]
    return Designs(
        model=model,
        candidates=start.setups,
        chosen=best,
        at_random={size: _at_random(hopeful, model, start, some, size, rng) for size in chosen},
        before=before,
        unobservable=unobservable,
        left_out=tuple(_unobservable(task, model, start, dropped) for dropped in missed),
        weak=_weak(task, model, start, best[poses]),
    )


def predicted(task: DesignProblem, model: StiffnessModel, setups: Setups) -> Design:
    """What any setups will show."""
    return _design(task, model, Pool(setups, observability(model, task.unknowns, task.setups, setups)))


def choices_of(task: DesignProblem, observable: Sequence[int], pool: Pool) -> CandidateSet:
    """The pool for the exchange: the unknowns ``observable`` in wanted standard deviations, and nuisances [mm,
    mrad]."""
    unit = task.wanted[list(observable)] / COVERAGE
    per_scale = unit / scales(task.unknowns)[list(observable)]
    rows = np.concatenate(
        [pool.shown.columns[:, :, list(observable)] * per_scale, pool.shown.nuisance * MM], axis=2
    )
    base = LOOSE * np.eye(rows.shape[2])
    known = prior_rows(task.unknowns)[np.ix_(observable, observable)] * per_scale
    block = known.T @ known
    if task.before is not None:
        own, frames = task.before.columns[0][:, list(observable)] * per_scale, basis(task.before.nuisance[0])
        own = own - frames @ (frames.T @ own)
        block = block + own.T @ own
    base[: len(observable), : len(observable)] += block
    return CandidateSet(rows, pool.setups.q, spacings(task.model.robot, task.setups.spacing), base)


def _criterion(task: DesignProblem, observable: Sequence[int], nuisances: int) -> Criterion:
    counts = task.counts[list(observable)]
    counts = np.concatenate(
        [counts if counts.any() else np.ones(len(observable), bool), np.zeros(nuisances, bool)]
    )
    if task.criterion == "minimax":
        return Minimax(counts)
    if task.criterion == "d":
        return Determinant(counts)
    assert task.tests is not None
    root = task.tests[:, list(observable)] * (task.wanted[list(observable)] / COVERAGE)
    return AtTestPoses(np.concatenate([root, np.zeros((len(root), nuisances))], axis=1))


def _by_size(
    choices: CandidateSet,
    criterion: Criterion,
    sizes: Sequence[int],
    start_choice: Choice,
    rng: np.random.Generator,
) -> Choice:
    """The best choice of each size: started with the given ones, or with the best next setups and at random; and with
    the next smaller choice."""
    by_size: dict[int, Sequence[int]] = {}
    last: Sequence[int] = ()
    for size in sizes:
        tried = [grown(choices, criterion, last, size)]
        if start_choice:
            tried += [list(start_choice[size])] if size in start_choice else []
        else:
            tried += [grown(choices, criterion, (), size)] if last else []
            tried += [random_choice(choices, size, rng) for _ in range(STARTS)]
        done = [exchanged(choices, criterion, choice) for choice in tried if len(choice) == size]
        if not done:
            break
        by_size[size] = last = min(done, key=lambda pair: pair[1])[0]
    return by_size


def _design(task: DesignProblem, model: StiffnessModel, pool: Pool) -> Design:
    ci95, analysis = judged(model, task.unknowns, pool.shown, task.before)
    ratio = np.where(np.isnan(ci95), np.inf, ci95) / task.wanted
    test = np.nan
    if task.tests is not None and analysis.observable:
        observable = list(analysis.observable)
        root = task.tests[:, observable] * scales(task.unknowns)[observable]
        test = float(np.sqrt(np.einsum("ki,ij,kj->", root, analysis.covariance, root)))
    return Design(pool.setups, ci95, float(ratio[task.counts].max(initial=0.0)), analysis.dropped, test)


def _at_random(
    task: DesignProblem,
    model: StiffnessModel,
    pool: Pool,
    choices: CandidateSet,
    size: int,
    rng: np.random.Generator,
) -> tuple[Floats, float]:
    """Medians over random designs of the intervals (P,), infinite where one is left out, and of the worst ratio."""
    tried = [_design(task, model, pool[random_choice(choices, size, rng)]) for _ in range(RANDOM)]
    wide = [np.where(np.isnan(one.ci95), np.inf, one.ci95) for one in tried]
    return np.median(wide, axis=0), float(np.median([one.worst for one in tried]))


def _unobservable(
    task: DesignProblem, model: StiffnessModel, pool: Pool, dropped: Dropped
) -> UnobservableParameter:
    """Why an unknown is left out, with what the offered loads and poses have to do with it."""
    at = [unknown.name for unknown in task.unknowns].index(dropped.name)
    redundant = dropped.why.startswith("is observable only together")
    if redundant:
        return UnobservableParameter(dropped.name, dropped.why, imitated=not dropped.together)
    still = bool(np.linalg.norm(pool.shown.columns[:, :, at]) < UNSEEN)
    more = reason(model, task.unknowns[at], task.setups, pool.setups, still)
    return UnobservableParameter(dropped.name, f"{dropped.why}; {more}" if more else dropped.why)


def _weak(
    task: DesignProblem, model: StiffnessModel, pool: Pool, design: Design
) -> tuple[UnobservableParameter, ...]:
    """What a design shows less precisely than wanted."""
    ratio = np.where(task.counts, np.nan_to_num(design.ci95 / task.wanted), 0.0)
    weak = []
    for at in np.argsort(-ratio, kind="stable"):
        if ratio[at] <= 1.0:
            break
        more = reason(model, task.unknowns[at], task.setups, pool.setups, still=False)
        what = f"{ratio[at]:.2g} times as wide as requested"
        weak.append(UnobservableParameter(task.unknowns[at].name, f"{what}; {more}" if more else what))
    return tuple(weak)
