"""The verdict on a search: four gates before an effect is named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.diagnosis.candidate_fits import has_zeros
from postproc.diagnosis.candidates import EVERY, Candidate, names_of
from postproc.diagnosis.decoys import HAS_DECOYS
from postproc.diagnosis.residual_patterns import ResidualPattern, residual_patterns
from postproc.diagnosis.search_result import Alternative, Search
from postproc.diagnosis.selection import (
    Explained,
    Problem,
    clipped_squares,
    explained,
    probability,
    scatter,
)
from postproc.effects.joint_offset import JointOffset
from postproc.identification.fit import Estimate, Fit
from postproc.identification.validation import folds_of

VERDICTS = ("nothing_missing", "named", "partly_named", "ambiguous", "unknown")

FOLDS = 15
"""Parts that poses are left out in; each pose by itself where there are fewer."""

SEEN = 1e-8
"""Share of a column's squares that readings must show to predict others."""

OUTLIER_LIMIT = 5.0

USUAL = 3.0
"""Times what was found of an effect that it is expected to be, of readings that were left out."""

MARGIN = 10.0
"""By how much -2 ln(likelihood) of the nearest other explanation must be worse: odds of 150 to 1."""

CLEAR, THERE = 1.5, 1.0
"""Intervals by which a value must be off to be clearly elsewhere, and to be there at all."""

BUILT = 4.6
"""By how much -2 ln(likelihood) of what is no such thing must be better to question hardware that the robot file
describes: odds of 10 to 1."""

UNUSUAL = 3.0
"""Usual sizes from which on a parameter has to be determined well to be believed."""

EXCESS = 3.0
"""Standard deviations of its own by which the remaining variance must exceed the stated one to be a lack of fit."""

STRUCTURE = 0.001
"""Probability that what remains shows a pattern by chance: one that follows a joint is no scatter, however small."""

TOLERATED = 0.15
"""Share of the variance that heavier tails than normal may add."""

EXPLAINS = 0.9
"""Share of the variance beyond scatter that a name must take away where some remains."""

EVERY_ARM = {"joint_offset": 0.5, "link_geometry": 0.5, "joint_compliance": 0.75, "link_gravity": 0.75}
"""The same of what every arm has: a geometry that is not quite the nominal one, weight and gears that deflect."""

WORST = 1.1
"""By how much the largest residual of poses that were left out may grow with an effect."""


NOT_ENOUGH = "too much would remain for a name"
OTHER_COURSE = "the readings follow another course than that of this effect"
SIZE_UNDETERMINED = "it would have to be unusually large, and the readings hardly determine its size"


@dataclass(frozen=True)
class Evidence:
    """For one candidate.  gain: fall of -2 ln(likelihood) with it; chance: probability of that without it, among all
    candidates; heldout, regions, sessions: fall of the same for poses, regions and sessions left out (NaN where there
    are too few); margin: of the nearest other candidate in its place, ``alias``; worst: the largest residual of poses
    left out with it, over that without it."""

    gain: float
    chance: float
    heldout: float
    regions: float
    sessions: float
    margin: float
    alias: Candidate | None
    worst: float = 1.0

    @property
    def is_sufficient(self) -> bool:
        """Whether the gain is there on readings that were left out."""
        gains = (self.heldout, self.regions, self.sessions)
        return all(gain > 0 for gain in gains if np.isfinite(gain))


@dataclass(frozen=True)
class Named:
    """A missing effect: its ``joints`` that clearly have it (() where it is of none), parameters with intervals;
    ``fixed``: names of those that the readings do not determine, and the values (SI) that the others are valid for."""

    candidate: Candidate
    joints: tuple[str, ...]
    estimates: tuple[Estimate, ...]
    evidence: Evidence
    fixed: tuple[tuple[str, float], ...] = ()

    @property
    def effect(self) -> str:
        return self.candidate.name


@dataclass(frozen=True)
class Verdict:
    """``word`` of ``VERDICTS``.  named: where the verdict is named, partly_named or ambiguous; alternatives: sets of
    candidates that explain the same; refitted: own parameters of the model that clearly moved; reduced_chi2: remaining
    variance over the stated one; conditional: nothing states the scatter, so a lack of fit cannot be detected;
    remainder: patterns in what remains after all that was chosen."""

    word: str
    named: tuple[Named, ...]
    alternatives: tuple[tuple[Candidate, ...], ...]
    not_testable: tuple[str, ...]
    refitted: tuple[Estimate, ...]
    reduced_chi2: float
    conditional: bool
    rejected: tuple[tuple[Candidate, str], ...] = ()
    remainder: tuple[ResidualPattern, ...] = ()


def judge(search: Search) -> Verdict:
    """The verdict on a search."""
    linear, last = search.linear, search.explained
    named, rejected, aliases = [], [], []
    zeros: list[tuple[Candidate, Evidence]] = []
    for g in last.groups:
        candidate, its = linear.candidates[g], _evidence(search, last, g)
        estimates = _estimates(search.final, candidate, search)
        bounded = all(e.at_bound for e in estimates)
        several = ambiguity_set(search, g, not bounded and _is_observable(candidate, estimates))
        if _of_another_course(search, candidate):
            rejected.append((candidate, OTHER_COURSE))
        elif not its.is_sufficient:
            rejected.append((candidate, "no gain on held-out readings"))
        elif its.worst > WORST:
            rejected.append((candidate, "it makes the largest residual of held-out poses larger"))
        elif is_implausible(estimates):
            rejected.append((candidate, SIZE_UNDETERMINED))
        elif bounded and len(several) == 1:
            rejected.append((candidate, "its parameters would have to lie at their bounds"))
        else:
            joints, fixed = _joints(candidate, estimates), _fixed_values(search.final, candidate, estimates)
            named.append(Named(candidate, joints, estimates, its, fixed))
            aliases.append(several)
            if has_zeros(candidate):
                zeros.append((candidate, its))
    chi2, unexplained = reduced_chi2_of(search, last)
    patterns = residual_patterns(search.final, chance=STRUCTURE)
    unexplained = unexplained or bool(patterns)
    bare, _ = reduced_chi2_of(search, explained(linear.problem, ()))
    # two forms of one effect on one joint do not make its name uncertain
    sets = tuple(a for a in aliases if len({(c.name, c.joint) for c in a}) > 1)
    formless = any(why == OTHER_COURSE for _, why in rejected)
    taken = 1.0 - (chi2 - 1.0) / (bare - 1.0) if linear.problem.known and bare > 1.0 else 1.0
    if formless or unexplained:
        # what is certain stays, whatever remains
        kept = [
            k
            for k, one in enumerate(named)
            if taken >= EVERY_ARM.get(one.effect, np.inf if formless else EXPLAINS)
        ]
        rest = [one.candidate for k, one in enumerate(named) if k not in kept]
        named = [named[k] for k in kept]
        aliases = [aliases[k] for k in kept]
        sets = tuple(a for a in aliases if len({(c.name, c.joint) for c in a}) > 1)
        if named:
            rejected += [(candidate, NOT_ENOUGH) for candidate in rest]
    if not named:
        word = "unknown" if unexplained or rejected else "nothing_missing"
    elif sets:
        word = "ambiguous"
    else:
        word = "partly_named" if unexplained or rejected else "named"
    kept_keys = {one.candidate.key for one in named}
    named += [
        more for whole, its in zeros if whole.key in kept_keys for more in _zeros_of(search, named, its)
    ]
    testable = set(names_of(linear.candidates))
    hidden = tuple(name for name in names_of(search.untestable) if name not in testable)
    return Verdict(
        word,
        tuple(named),
        sets,
        hidden,
        (),
        chi2,
        not linear.problem.known,
        tuple(rejected),
        patterns,
    )


def _zeros_of(search: Search, named: Sequence[Named], its: Evidence) -> list[Named]:
    """The zeros of joints that were found with the geometry of the whole arm, where any is clearly there."""
    if any(one.effect == JointOffset.name for one in named):
        return []
    whole = [c for c in search.linear.candidates if (c.name, c.joint) == (JointOffset.name, EVERY)]
    for candidate in whole:
        estimates = _estimates(search.final, candidate, search)
        joints = _joints(candidate, estimates)
        if joints:
            return [Named(candidate, joints, estimates, its)]
    return []


def _is_observable(candidate: Candidate, estimates: Sequence[Estimate]) -> bool:
    """Whether the readings determine all parameters of an effect that something else imitates, and that it is there."""
    if candidate.name not in HAS_DECOYS:
        return True
    is_clear = {
        e.unknown.parameter.name: abs(e.value - e.unknown.parameter.null) > THERE * e.ci95 for e in estimates
    }
    there = all(clear for name, clear in is_clear.items() if name not in candidate.dormant_parameters)
    return there and is_clear.keys() >= {p.name for p in candidate.effect.parameters if not p.hardware}


def _fixed_values(
    final: Fit, candidate: Candidate, estimates: Sequence[Estimate]
) -> tuple[tuple[str, float], ...]:
    """Names and values (SI) of an effect's parameters that were not found, but are not at their null."""
    estimated = {e.unknown.parameter.name for e in estimates}
    term = next(
        (
            t
            for t in final.model.terms
            if (t.effect.name, t.effect.described()) == (candidate.name, candidate.effect.described())
        ),
        None,
    )
    if term is None:
        return ()
    names = [u.parameter.name for u in candidate.unknowns if u.parameter.name not in estimated]
    nulls = {u.parameter.name: u.parameter.null for u in candidate.unknowns}
    return tuple((name, float(term.values[name])) for name in names if term.values[name] != nulls[name])


def reduced_chi2_of(search: Search, last: Explained) -> tuple[float, bool]:
    """Remaining variance over the stated one, and whether that is clearly more; where nothing states it, never."""
    given = search.linear.problem
    freedom = max(1, given.freedom - last.rank)
    variance = clipped_squares(given, last) / freedom
    spread = np.sqrt(2.0 / freedom)
    repeats = search.base.noise.freedom if search.base.noise.source == "repeats" else 0
    if repeats:
        spread = np.sqrt(spread**2 + 2.0 / repeats)
    return variance, given.known and variance > 1.0 + TOLERATED + EXCESS * spread


def _evidence(search: Search, last: Explained, group: int) -> Evidence:
    linear, given = search.linear, search.linear.problem
    without = explained(given, tuple(g for g in last.groups if g != group))
    variance = scatter(given, last)
    squares = without.squares - last.squares
    chance = probability(given, squares, last.rank - without.rank, variance, given.freedom - last.rank)
    campaign = search.base.campaign
    heldout, regions, sessions = (
        held_out_gain(search, last, group, rows)
        for rows in (folds_of(campaign, min(FOLDS, campaign.poses)), _regions(search), _sessions(search))
    )
    worst = worst_ratio(search, last, group, folds_of(campaign, min(FOLDS, campaign.poses)))
    nearest = next(iter(_against(search, linear.candidates[group])), None)
    margin, alias = (np.inf, None) if nearest is None else (nearest.margin, nearest.candidate)
    among = len(linear.candidates)
    gain = squares / variance
    return Evidence(gain, min(1.0, chance * among), heldout, regions, sessions, margin, alias, worst)


def ambiguity_set(search: Search, group: int, observable: bool) -> tuple[Candidate, ...]:
    """The candidate, and what explains the same.  Hardware that the robot file describes is taken to be there where its
    parameters are ``observable``, as long as what is no such thing explains no more."""
    mine = search.linear.candidates[group]
    built = any(mechanism.kind == mine.name for mechanism in search.base.model.robot.mechanisms)
    against = _against(search, mine)
    near = [
        r.candidate for r in against if r.margin < (-BUILT if built and observable and r.is_decoy else MARGIN)
    ]
    # of one effect the form with fewest parameters
    several = [mine, *near]
    return (mine, *(c for c in near if not any(c is not one and c.contains(one) for one in several)))


def is_implausible(estimates: Sequence[Estimate]) -> bool:
    """Whether all that was found is beyond plausible sizes, with intervals of more than half of it: past the load at
    which a tooth changes sides, say, readings do not determine how wide its gap is."""
    sizes = [(abs(e.value - e.unknown.parameter.null), e.unknown.parameter.scale, e.ci95) for e in estimates]
    return bool(sizes) and all(size > UNUSUAL * scale and wide > 0.5 * size for size, scale, wide in sizes)


def _of_another_course(search: Search, candidate: Candidate) -> bool:
    """Whether another course over the same joint or time, one that no effect has, clearly explains more."""
    against = [r for r in search.rivals if r.of == candidate.key and r.is_decoy and r.fitted]
    return any(r.margin < -MARGIN for r in against)


def _against(search: Search, mine: Candidate) -> list[Alternative]:
    """What may be taken for ``mine``, nearest first; other courses where they are no mere variants of it."""
    return [r for r in search.rivals if r.of == mine.key and (mine.name in HAS_DECOYS or not r.is_decoy)]


def held_out_gain(search: Search, last: Explained, group: int, part: Ints | None) -> float:
    """Fall of -2 ln(likelihood) of readings left out, part by part, with the group; ``part`` (R,): the part of each
    reading, -1 in none; NaN without parts.

    A reading is predicted with the uncertainty of the fit of the others: where that has to extrapolate, it
    has little weight.  Outliers count up to 5 standard deviations.  A part that is more than half of all is never left
    out: a few poses measured later do not foretell a whole campaign.
    """
    if part is None:
        return np.nan
    large = np.flatnonzero(2 * np.bincount(part) > len(part))
    part = np.where(np.isin(part, large), -1, part)
    if not (part >= 0).any() or (len(large) == 0 and len(np.unique(part)) < 2):
        return np.nan
    linear, given = search.linear, search.linear.problem
    rows = len(linear.residual) - linear.priors
    # priors are never left out
    of = np.append(np.repeat(part, rows // len(part)), np.full(linear.priors, -1))
    variance = scatter(given, last)

    def surprise(groups: Sequence[int]) -> float:
        columns = [linear.common, *(linear.columns[g] for g in groups)]
        matrix = np.concatenate(columns, axis=1)
        own = np.concatenate([np.zeros(linear.common.shape[1]), *(_expected(given, last, g) for g in groups)])
        matrix = np.concatenate([matrix, np.diag(own)[own > 0]])
        more = len(matrix) - len(of)
        target = np.append(linear.residual, np.zeros(more))
        return _misfit(matrix, target, np.append(of, np.full(more, -1)), variance)

    return surprise([g for g in last.groups if g != group]) - surprise(last.groups)


def worst_ratio(search: Search, last: Explained, group: int, part: Ints) -> float:
    """The largest residual of a pose left out with the group, over that without it."""
    linear = search.linear
    rows = len(linear.residual) - linear.priors
    of = np.append(np.repeat(part, rows // len(part)), np.full(linear.priors, -1))
    pose = np.repeat(search.base.campaign.pose, rows // len(part))

    def largest(groups: Sequence[int]) -> float:
        matrix = np.concatenate([linear.common, *(linear.columns[g] for g in groups)], axis=1)
        away = _left_out(matrix, linear.residual, of)[:rows]
        return float(np.sqrt(np.bincount(pose, away**2).max()))

    without = largest([g for g in last.groups if g != group])
    return largest(last.groups) / without if without > 0 else 1.0


def _left_out(matrix: Floats, target: Floats, part: Ints) -> Floats:
    """(n,) residuals of ``target`` (n,), each part predicted from the others by ``matrix`` (n, k)."""
    size = np.linalg.norm(matrix, axis=0)
    scaled = matrix[:, size > 0] / size[size > 0]
    whole, aim, away = scaled.T @ scaled, scaled.T @ target, np.zeros(len(target))
    for k in np.unique(part[part >= 0]):
        out = scaled[part == k]
        value, vector = np.linalg.eigh(whole - out.T @ out)
        root = vector / np.sqrt(np.maximum(value, SEEN))
        away[part == k] = target[part == k] - out @ (root @ (root.T @ (aim - out.T @ target[part == k])))
    return away


def _expected(given: Problem, last: Explained, group: int) -> Floats:
    """(p,) one over the deviation that is expected of each parameter of a chosen group, in its scale: ``USUAL`` times
    the largest that was found of it."""
    on = np.isin(last.columns, given.places[group])
    largest = np.abs(last.coefficients[on] / given.size[given.places[group]]).max(initial=0.0)
    return np.full(len(given.places[group]), 1.0 / (USUAL * largest) if largest > 0 else 0.0)


def _misfit(matrix: Floats, target: Floats, part: Ints, variance: float) -> float:
    """-2 ln(likelihood) of ``target`` (n,), each part predicted from the others by ``matrix`` (n, k)."""
    size = np.linalg.norm(matrix, axis=0)
    scaled = matrix[:, size > 0] / size[size > 0]
    whole, aim, total = scaled.T @ scaled, scaled.T @ target, 0.0
    for k in np.unique(part[part >= 0]):
        out = scaled[part == k]
        value, vector = np.linalg.eigh(whole - out.T @ out)
        root = vector / np.sqrt(np.maximum(value, SEEN))
        away = target[part == k] - out @ (root @ (root.T @ (aim - out.T @ target[part == k])))
        # of a part that is left out as a whole what all share, as where its tracker is, is uncertain together:
        # the covariance is variance (1 + B B'), B = out root
        b = out @ root
        gram = np.eye(b.shape[1]) + b.T @ b
        shared = np.linalg.solve(gram, b.T @ away)
        own = (away - b @ shared) ** 2 / variance
        total += float(np.minimum(own, OUTLIER_LIMIT**2).sum() + len(own) * np.log(variance))
        total += float(min(shared @ shared / variance, OUTLIER_LIMIT**2 * len(shared)) + np.linalg.slogdet(gram)[1])
    return total


def _regions(search: Search) -> Ints | None:
    """(R,) a region of the joints' space for each reading; None with too few poses."""
    from scipy.cluster.vq import kmeans2

    campaign = search.base.campaign
    if campaign.poses < 24:
        return None
    q = campaign.readings.q
    spread = np.where(np.ptp(q, axis=0) > 1e-9, np.ptp(q, axis=0), 1.0)
    _, label = kmeans2(q / spread, 4, minit="++", rng=np.random.default_rng(0))
    return label if min(np.bincount(label, minlength=4)) > 0 else None


def _sessions(search: Search) -> Ints | None:
    session = search.base.campaign.readings.session
    return session if len(np.unique(session)) > 1 else None


def _estimates(final: Fit, candidate: Candidate, search: Search) -> tuple[Estimate, ...]:
    names = {u.parameter.name for u in candidate.unknowns}
    base = len(search.base.model.terms)
    same = candidate.effect.described()
    return tuple(
        e
        for e in final.estimates
        if e.unknown.parameter.name in names
        and (term := final.model.terms[e.unknown.term]).effect.name == candidate.name
        and term.effect.described() == same
        and (e.unknown.term >= base or e.unknown.stated is None)
    )


def _joints(candidate: Candidate, estimates: Sequence[Estimate]) -> tuple[str, ...]:
    if candidate.joint != EVERY:
        return (candidate.joint,) if candidate.joint else ()
    clear = [e.unknown.parameter.joint for e in estimates if abs(e.value - e.unknown.parameter.null) > e.ci95]
    return tuple(dict.fromkeys(clear))


def refitted(final: Fit) -> tuple[Estimate, ...]:
    """The model's own parameters that the readings clearly put elsewhere than the robot file does."""
    moved = []
    for estimate in final.estimates:
        stated = estimate.unknown.stated
        if stated is None or estimate.unknown.parameter.hardware:
            continue
        uncertainty = np.hypot(estimate.ci95, stated.interval or 0.0)
        if abs(estimate.value - stated.value) > CLEAR * uncertainty:
            moved.append(estimate)
    return tuple(moved)
