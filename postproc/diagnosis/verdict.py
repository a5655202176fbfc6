"""The verdict on a search: four gates before an effect is named."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from postproc.diagnosis.candidate_fits import has_zeros
from postproc.diagnosis.candidates import EVERY, Candidate, fewest_parameters, names_of
from postproc.diagnosis.decoys import HAS_DECOYS
from postproc.diagnosis.held_out import (
    FOLDS,
    held_out_gain,
    left_out_variance,
    regions_of,
    sessions_of,
    worst_ratio,
)
from postproc.diagnosis.imitations import (
    MARGIN,
    changes_with_posture,
    follows_another_course,
    is_implausible,
    is_in_another_course,
    is_out_of_bounds,
    laws_on_one_joint,
)
from postproc.diagnosis.residual_patterns import ResidualPattern, residual_patterns
from postproc.diagnosis.search_result import Alternative, Search
from postproc.diagnosis.selection import (
    Explained,
    clipped_squares,
    explained,
    probability,
    scatter,
)
from postproc.effects.joint_offset import JointOffset
from postproc.identification.fit import Estimate, Fit
from postproc.identification.validation import folds_of

VERDICTS = ("nothing_missing", "named", "partly_named", "ambiguous", "unknown")


CLEAR, THERE = 1.5, 1.0
"""Intervals by which a value must be off to be clearly elsewhere, and to be there at all."""

BUILT = 4.6
"""By how much -2 ln(likelihood) of what is no such thing must be better to question hardware that the robot file
describes: odds of 10 to 1."""

EXCESS = 3.0
"""Standard deviations of its own by which the remaining variance must exceed the stated one to be a lack of fit."""

STRUCTURE = 0.001
"""Probability that what remains shows a pattern by chance: one that follows a joint is no scatter, however small."""

FAINT = 1 / 16
"""Share of the remaining squares up to which a pattern, where the scatter is known, leaves a name as it is: a quarter
of the scatter."""

TOLERATED = 0.15
"""Share of the variance that heavier tails than normal may add."""

EXPLAINS = 0.9
"""Share of the variance beyond scatter that a name must take away where some remains."""

EVERY_ARM = {
    "joint_offset": 0.5,
    "link_geometry": 0.5,
    "joint_compliance": 0.75,
    "link_gravity": 0.75,
    "gravity_sag": 0.75,
}
"""The same of what every arm has: a geometry that is not quite the nominal one, weight and gears that deflect."""

WORST = 1.1
"""By how much the largest residual of poses that were left out may grow with an effect."""


CHANCE_OF_JOINT = 0.05
"""Probability that any joint without an effect that is fitted to all of them is reported to have it."""

NOT_ENOUGH = "too much would remain for a name"
AS_WELL = "another course over the same joint explains as much, and more remains than scatter"
OTHER_COURSE = "the readings follow another course than that of this effect"
OTHER_SIZES = "it would have to be of another size at other angles of the other joints"
AT_BOUNDS = "its parameters would have to lie at their bounds"
FORMLESS = (OTHER_COURSE, OTHER_SIZES)
"""Reasons that say that what is missing has no form that is known."""

PART_OF_COURSE = "what it would explain is a part of that other course"
TWO_LAWS = "it fits only beside another law of lost motion on the same joint, and more remains than scatter"
ONLY_TOGETHER = "it fits only beside an effect that the readings cannot distinguish from others"
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
    """``word`` of ``VERDICTS``. named: where the verdict is named, partly_named or ambiguous; alternatives: sets of
    candidates that explain the same; refitted: own parameters of the model that clearly moved; conditional: nothing
    states the scatter, so a lack of fit cannot be detected; remainder: patterns in what remains after all that was
    chosen."""

    word: str
    named: tuple[Named, ...]
    alternatives: tuple[tuple[Candidate, ...], ...]
    not_testable: tuple[str, ...]
    refitted: tuple[Estimate, ...]
    conditional: bool
    rejected: tuple[tuple[Candidate, str], ...] = ()
    remainder: tuple[ResidualPattern, ...] = ()


def judge(search: Search) -> Verdict:
    """The verdict on a search."""
    linear, last = search.linear, search.explained
    named, rejected, aliases = [], [], []
    zeros: list[tuple[Candidate, Evidence]] = []
    groups: list[int] = []
    patterns = residual_patterns(search.confirmed, chance=STRUCTURE)
    unexplained = more_remains(search, patterns)
    for g in last.groups:
        candidate, its = linear.candidates[g], _evidence(search, last, g)
        estimates = _estimates(search.confirmed, candidate, search)
        bounded = all(e.at_bound for e in estimates)
        several = ambiguity_set(search, g, not bounded and _is_observable(candidate, estimates))
        if follows_another_course(search, candidate, -MARGIN):
            rejected.append((candidate, OTHER_COURSE))
        elif changes_with_posture(search, last, g):
            rejected.append((candidate, OTHER_SIZES))
        elif (
            unexplained
            and candidate.name not in HAS_DECOYS
            and follows_another_course(search, candidate, MARGIN)
        ):
            rejected.append((candidate, AS_WELL))
        elif not its.is_sufficient:
            rejected.append((candidate, "no gain on held-out readings"))
        elif its.worst > WORST:
            rejected.append((candidate, "it makes the largest residual of held-out poses larger"))
        elif is_implausible(estimates):
            rejected.append((candidate, SIZE_UNDETERMINED))
        elif (bounded and len(several) == 1) or any(map(is_out_of_bounds, estimates)):
            rejected.append((candidate, AT_BOUNDS))
        else:
            joints, fixed = (
                clear_joints(candidate, estimates, search.confirmed),
                _fixed_values(search.confirmed, candidate, estimates),
            )
            named.append(Named(candidate, joints, estimates, its, fixed))
            groups.append(g)
            aliases.append(several)
            if has_zeros(candidate):
                zeros.append((candidate, its))
    bare, _ = reduced_chi2_of(search, explained(linear.problem, ()))
    # two forms of one effect on one joint do not make its name uncertain
    sets = tuple(a for a in aliases if len({(c.name, c.joint) for c in a}) > 1)
    if unexplained:
        doubled = laws_on_one_joint([one.candidate for one in named])
        rejected += [(one.candidate, TWO_LAWS) for one in named if one.candidate in doubled]
        kept = [k for k, one in enumerate(named) if one.candidate not in doubled]
        named, aliases = [named[k] for k in kept], [aliases[k] for k in kept]
        groups = [groups[k] for k in kept]
        sets = tuple(a for a in aliases if len({(c.name, c.joint) for c in a}) > 1)
    formless = any(why in FORMLESS for _, why in rejected)
    if formless:
        # a zero of the joint that follows another course may be a part of that course
        kept = [k for k, g in enumerate(groups) if not is_in_another_course(search, last, g)]
        rejected += [(one.candidate, PART_OF_COURSE) for k, one in enumerate(named) if k not in kept]
        named, aliases = [named[k] for k in kept], [aliases[k] for k in kept]
        groups = [groups[k] for k in kept]
    if formless or unexplained:
        # what is certain stays, whatever remains: it must take its share by itself
        rare = np.inf if formless else EXPLAINS
        kept = list(range(len(named)))
        while kept:
            alone = _remaining_variance(search, explained(linear.problem, [groups[k] for k in kept]))
            taken = _explained_share(alone, bare, linear.problem.known)
            still = [k for k in kept if taken >= EVERY_ARM.get(named[k].effect, rare)]
            if still == kept:
                break
            kept = still
        rest = [one.candidate for k, one in enumerate(named) if k not in kept]
        named = [named[k] for k in kept]
        aliases = [aliases[k] for k in kept]
        sets = tuple(a for a in aliases if len({(c.name, c.joint) for c in a}) > 1)
        if named:
            rejected += [(candidate, NOT_ENOUGH) for candidate in rest]
    if not named:
        word = "unknown" if unexplained or patterns or rejected else "nothing_missing"
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
        not linear.problem.known,
        tuple(rejected),
        patterns,
    )


def _explained_share(variance: float, bare: float, known: bool) -> float:
    """Share of the variance beyond scatter that is explained; of one that is not known, of all."""
    floor = 1.0 if known else 0.0
    return 1.0 - (variance - floor) / (bare - floor) if bare > floor else 1.0


def _zeros_of(search: Search, named: Sequence[Named], its: Evidence) -> list[Named]:
    """The zeros of joints that were found with the geometry of the whole arm, where any is clearly there."""
    if any(one.effect == JointOffset.name for one in named):
        return []
    whole = [c for c in search.linear.candidates if (c.name, c.joint) == (JointOffset.name, EVERY)]
    for candidate in whole:
        estimates = _estimates(search.confirmed, candidate, search)
        # they belong to a geometry that is shown already: each counts for itself
        off = [e for e in estimates if abs(e.value - e.unknown.parameter.null) > e.ci95]
        joints = tuple(dict.fromkeys(e.unknown.parameter.joint for e in off))
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
            if (t.effect.name, t.effect.form()) == (candidate.name, candidate.effect.form())
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


def _elsewhere(search: Search, last: Explained) -> tuple[float, int]:
    """``left_out_variance`` of regions, of poses where these are few; none where nothing states the scatter."""
    if not search.linear.problem.known:
        return 0.0, 0
    campaign, part = search.base.campaign, regions_of(search)
    return left_out_variance(
        search, last, folds_of(campaign, min(FOLDS, campaign.poses)) if part is None else part
    )


def _remaining_variance(search: Search, last: Explained) -> float:
    """The variance that remains, where the fit was or elsewhere, over the stated one."""
    return max(reduced_chi2_of(search, last)[0], _elsewhere(search, last)[0])


def more_remains(search: Search, patterns: Sequence[ResidualPattern]) -> bool:
    """Whether more than scatter remains of what was chosen, whose residual has clear ``patterns``."""
    known = search.linear.problem.known
    if reduced_chi2_of(search, search.explained)[1]:
        return True
    return any(not known or one.share > FAINT for one in patterns)


def _evidence(search: Search, last: Explained, group: int) -> Evidence:
    linear, given = search.linear, search.linear.problem
    without = explained(given, tuple(g for g in last.groups if g != group))
    variance = scatter(given, last)
    squares = without.squares - last.squares
    chance = probability(given, squares, last.rank - without.rank, variance, given.freedom - last.rank)
    campaign = search.base.campaign
    heldout, regions, sessions = (
        held_out_gain(search, last, group, rows)
        for rows in (folds_of(campaign, min(FOLDS, campaign.poses)), regions_of(search), sessions_of(search))
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
    return (mine, *(c for c in fewest_parameters([mine, *near]) if c is not mine))


def _against(search: Search, mine: Candidate) -> list[Alternative]:
    """What may be taken for ``mine``, nearest first; other courses where they are no mere variants of it."""
    return [r for r in search.rivals if r.of == mine.key and (mine.name in HAS_DECOYS or not r.is_decoy)]


def _estimates(final: Fit, candidate: Candidate, search: Search) -> tuple[Estimate, ...]:
    names = {u.parameter.name for u in candidate.unknowns}
    base = len(search.base.model.terms)
    same = candidate.effect.form()
    return tuple(
        e
        for e in final.estimates
        if e.unknown.parameter.name in names
        and (term := final.model.terms[e.unknown.term]).effect.name == candidate.name
        and term.effect.form() == same
        and (e.unknown.term >= base or e.unknown.stated is None)
    )


def clear_joints(candidate: Candidate, estimates: Sequence[Estimate], final: Fit) -> tuple[str, ...]:
    """The joints that clearly have an effect, as ``final`` has its ``estimates``: where its parameters there, together,
    are off by more than chance leaves of any of the joints that were looked at (Bonferroni)."""
    from scipy.special import fdtri

    if candidate.joint != EVERY:
        return (candidate.joint,) if candidate.joint else ()
    place = {unknown.key: k for k, unknown in enumerate(final.unknowns)}
    deviation = np.sqrt(np.diag(final.covariance))
    own: dict[str, list[Estimate]] = {}
    for estimate in estimates:
        own.setdefault(estimate.unknown.parameter.joint, []).append(estimate)
    clear = []
    for joint, several in own.items():
        rows = [place[e.unknown.key] for e in several]
        off = np.array([e.value - e.unknown.parameter.null for e in several]) / deviation[rows]
        among = final.covariance[np.ix_(rows, rows)] / np.outer(deviation[rows], deviation[rows])
        limit = len(rows) * fdtri(len(rows), max(1, final.freedom), 1.0 - CHANCE_OF_JOINT / len(own))
        if off @ np.linalg.solve(among, off) > limit:
            clear.append(joint)
    return tuple(clear)


def with_estimates(verdict: Verdict, final: Fit, search: Search) -> Verdict:
    """The verdict with what ``final`` has of the parameters that are named; those that it does not have are as they
    were found in ``search``."""
    named = []
    for one in verdict.named:
        found = _estimates(final, one.candidate, search)
        named.append(replace(one, estimates=found) if found else one)
    return replace(verdict, named=tuple(named))


def refitted(final: Fit, additional: Set[tuple[int, str]] = frozenset()) -> tuple[Estimate, ...]:
    """The model's own parameters that the readings clearly put elsewhere than the robot file does; those of
    ``additional`` keys count as stated at their null."""
    moved = []
    for estimate in final.estimates:
        unknown, stated = estimate.unknown, estimate.unknown.stated
        if (stated is None and unknown.key not in additional) or unknown.parameter.hardware:
            continue
        before, interval = (
            (unknown.parameter.null, 0.0) if stated is None else (stated.value, stated.interval)
        )
        if abs(estimate.value - before) > CLEAR * np.hypot(estimate.ci95, interval or 0.0):
            moved.append(estimate)
    return tuple(moved)
