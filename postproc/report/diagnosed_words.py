"""A diagnosis in one paragraph, for whoever cuts with it: no more than the readings bear."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from postproc.diagnosis.candidates import EVERY, Candidate
from postproc.diagnosis.foils import Foil
from postproc.diagnosis.verdict import MARGIN, Named
from postproc.effects import EFFECTS, ComplianceLaw
from postproc.identification.fit import Estimate, Fit
from postproc.identification.suspicion import LOADED
from postproc.report.diagnosed import USUAL, Diagnosed
from postproc.report.terminal import _once
from postproc.report.words import count, fixed, shown_unit
from postproc.units import MM

NOUNS = {
    "joint_compliance": "compliance of {joints}: the gear gives way in proportion to the torque",
    "tool_compliance": "compliance of the tool: cutter, holder and spindle give way",
    "gravity_compensator": "a gravity compensator across {joints}: a spring whose torque follows the angle",
    "link_gravity": "the arm's own weight beyond {joints}: it bends the arm",
    "payload": "a weight on the flange: it bends the arm",
    "base_compliance": "compliance of the foundation: the whole robot tilts under load",
    "link_compliance": "compliance of {joints} across the axis: bearings and links tilt under load",
    "joint_stiffening": "stiffening of {joints}: the gear grows stiffer with load",
    "backlash": "backlash in {joints}: the gear has a gap",
    "hysteresis": "hysteresis of {joints}: friction stops the joint short, on the side that it came from",
    "transmission_error": "a transmission error of {joints}: the gear runs ahead and behind with the angle",
    "joint_offset": "a wrong zero of {joints}",
    "link_geometry": "wrong geometry at {joints}: the axes do not lie where the links say",
    "joint_coupling": "a coupling in the wrist: other motors turn {joints} along",
    "tool_offset": "a shifted tool or target: it is not where it is stated",
    "base_offset": "a shifted base: the robot does not stand where it is stated",
    "thermal_growth": "growth of the links before {joints}: they lengthen as the robot warms up",
    "force_sensor": "an error of the stated forces: in their scale or their zero",
}
"""What an effect is, to those who do not know its name."""

SETTLES = MARGIN**0.5
"""Standard deviations by which two explanations must differ for one to be named."""

KEY = 10
"""One of so many poses may show what no other does."""

PARAMETERS = 3
"""So many of an effect stand in the paragraph, all in the table."""

OVERSTATED = 0.5
"""Variance over the stated one below which readings scatter by less than is stated."""

FAR_OFF = 1.5
"""Times the scatter: where more is left, yet no lack of fit, a few readings lie far off."""


def paragraph(result: Diagnosed) -> str:
    """What the verdict says, how sure it is, what it does not say."""
    told = {
        "nothing_missing": _nothing_missing,
        "named": _named,
        "partly_named": _named,
        "ambiguous": _ambiguous,
        "unknown": _unknown,
    }[result.verdict.word](result)
    return " ".join([*told, *_conditional(result), *_not_tested(result)])


def headline(result: Diagnosed) -> str:
    """The verdict in a few words."""
    verdict = result.verdict
    names = ", ".join(named.candidate.label for named in result.clear)
    sets = "; ".join(" or ".join(c.label for c in one) for one in verdict.alternatives)
    told = {
        "nothing_missing": "nothing missing" + (", but parameters have moved" if verdict.refitted else ""),
        "named": f"named: {names}",
        "partly_named": f"partly named: {names}",
        "ambiguous": f"ambiguous: {sets}{f'; named: {names}' if names else ''}",
        "unknown": "unknown: no effect that was tried explains it"
        if result.lacking
        else "unknown: not clear whether something is missing",
    }[verdict.word]
    return f"{told} (if what is left is scatter)" if verdict.conditional else told


def _nothing_missing(result: Diagnosed) -> Iterator[str]:
    moved, is_ = result.verdict.refitted, "is seen to be" if result.verdict.conditional else "is"
    if moved:
        yield (
            f"No effect {is_} missing, but {count(len(moved), 'parameter')} of the robot file"
            f" {'has' if len(moved) == 1 else 'have'} gone stale: {_changes(moved)}. With its parameters fitted anew"
            f" {_mm(result.rms['before'])} mm RMS become {_mm(result.rms['after'])}."
        )
        yield from _closed(result)
    else:
        yield f"Nothing {is_} missing."
        if result.rms["before"] > FAR_OFF * result.rms["after"]:
            yield (
                f"The robot file as it is leaves {_mm(result.rms['before'])} mm RMS, with its parameters fitted anew"
                f" {_mm(result.rms['after'])} mm."
            )
    yield from _rest(result)
    if result.detectable is not None:
        yield (
            f"A missing effect would have shown from about {_mm(result.detectable)} mm RMS on, unless parameters of the"
            " robot file imitate it."
        )


def _named(result: Diagnosed) -> Iterator[str]:
    yield from _missing(result, result.verdict.named)
    yield from _attributed(result)
    yield from _closed(result)
    yield from _nearest(result.verdict.named)
    if result.verdict.word == "named":
        yield from _rest(result)
    else:
        yield from _more(result, "That is not all:", "after")
    yield from _moved_too(result)


def _ambiguous(result: Diagnosed) -> Iterator[str]:
    anew = "even with its parameters fitted anew " if result.diagnosis.search.base.unknowns else ""
    yield (
        f"Something is missing: {anew}the robot file leaves {_mm(result.rms['refitted'])} mm RMS"
        f"{_against_scatter(result)}."
    )
    if result.clear:
        yield from _missing(result, result.clear)
    for alternatives in result.verdict.alternatives:
        one_of = " or ".join(candidate.label for candidate in alternatives)
        yield f"Whether it is {one_of}, these readings can not tell: each explains them nearly as well as the first."
    yield f"With all that was found {_mm(result.rms['explained'])} mm would be left; no robot file is made of a guess."
    yield from _more(result, "It would not be all:", "explained")
    planned = result.next_poses
    if planned is None:
        yield "No pose within the limits, with what was hung so far, tells them apart: other loads or targets may."
        return
    first, second = (candidate.label for candidate in planned.between)
    apart = min(planned.separation)
    if apart < SETTLES:
        yield (
            f"The best {count(len(planned.poses), 'pose')} with what was hung so far would not settle it: there {first}"
            f" and {second} differ by {apart:.1f} standard deviations, {SETTLES:.1f} are needed. Other loads or"
            " targets, or less scatter, may."
        )
        return
    where = f" ({result.next_poses_file})" if result.next_poses_file else ""
    yield (
        f"Measure these {count(len(planned.poses), 'pose')}{where}: there {first} and {second} differ by {apart:.1f}"
        " standard deviations. Then diagnose all readings together."
    )


def _unknown(result: Diagnosed) -> Iterator[str]:
    search = result.diagnosis.search
    if not result.lacking:
        yield "Whether something is missing is not clear."
    else:
        yield (
            f"Something is missing: {_mm(result.rms['after'])} mm RMS are left{_against_scatter(result)}. It is none of"
            f" the {len(result.tried)} effects that were tried."
        )
    rejected = {candidate.key for candidate, _ in result.verdict.rejected}
    near = [candidate.label for candidate in search.chosen if candidate.key not in rejected]
    if near:
        yield (
            f"The most that was found is {_list(near)}, and with it still {_mm(result.rms['explained'])} mm would be"
            " left: too much for a name."
        )
    yield from _rejected(result)
    if result.patterns:
        first = result.patterns[0]
        yield (
            f"What is left goes with {first.variable} ({100 * first.share:.0f} % of its squares; {first.pattern}): look"
            " there, at the robot and at the measurement."
        )
    yield from _moved_too(result)


def _missing(result: Diagnosed, several: Sequence[Named]) -> Iterator[str]:
    """What each effect is, its size, what it does."""
    if len(several) > 1:
        yield f"{len(several)} effects are missing."
    for number, named in enumerate(several, 1):
        begin = f"({number})" if len(several) > 1 else "What is missing is"
        size = result.moved[named.candidate.key]
        does = ""
        if size is not None:
            does = f"; in these readings it makes {_mm(size.rms)} mm RMS, {_mm(size.max)} mm at most"
        yield f"{begin} {noun(named)} ({named.effect}: {_parameters(named)}){does}."
        if named.held:
            yield f"The readings do not tell {_held(named)}: what stands above holds for that."


def _held(named: Named) -> str:
    """``s0 (300 mm taken)``"""
    units = {u.parameter.name: shown_unit(u.parameter.unit) for u in named.candidate.unknowns}
    told = [f"{name} ({value / units[name][1]:.4g} {units[name][0]} taken)" for name, value in named.held]
    return _list(told)


def noun(named: Named) -> str:
    """What the effect is, and where."""
    joints = _list(named.joints) if named.joints else "the joints" if named.candidate.joint == EVERY else ""
    return NOUNS[named.effect].format(joints=joints)


def _parameters(named: Named) -> str:
    """The parameters that are seen best."""
    several = sorted(
        named.estimates, key=lambda e: e.ci95 / max(abs(e.value - e.unknown.parameter.null), 1e-300)
    )
    told = [f"{e.unknown.parameter.name} = {with_interval(e)}" for e in several[:PARAMETERS]]
    if len(several) > PARAMETERS:
        told.append(f"{len(several) - PARAMETERS} more below")
    return ", ".join(told)


def with_interval(estimate: Estimate) -> str:
    """``6.90 +- 0.40 kN/mm``"""
    word, size = shown_unit(estimate.unknown.parameter.unit)
    wide = estimate.ci95 / size
    return f"{fixed(estimate.value / size, wide)} +- {fixed(wide, wide)} {word}".rstrip()


def _attributed(result: Diagnosed) -> Iterator[str]:
    """What is owed to the effects, and not to parameters that were there already."""
    if result.diagnosis.search.base.unknowns:
        several = "them" if len(result.verdict.named) > 1 else "it"
        yield (
            f"The robot file leaves {_mm(result.rms['before'])} mm RMS, {_mm(result.rms['refitted'])} mm with its own"
            f" parameters fitted anew, and {_mm(result.rms['after'])} mm with {several}."
        )


def _closed(result: Diagnosed) -> Iterator[str]:
    """What holds on poses that were not fitted."""
    before, after = result.rms["heldout_before"], result.rms["heldout_after"]
    if not np.isfinite(before + after):
        return
    if after >= before:
        kept, others = _most_poses(result)
        if kept < before:
            yield (
                f"On poses that were left out of the fit {_mm(before)} mm RMS become {_mm(kept)}, but for"
                f" {count(others, 'pose')} that can not be left out: the others do not show what"
                f" {'it shows' if others == 1 else 'they show'}."
            )
            return
        yield (
            f"But on poses that were left out of the fit it brings nothing: {_mm(before)} mm RMS before,"
            f" {_mm(after)} mm after."
        )
        return
    scatter = result.scatter if not result.verdict.conditional else 0.0
    of = " of what is more than scatter" if scatter else ""
    share = 100.0 * min(1.0, (before - after) / max(before - scatter, 1e-300))
    yield (
        f"On poses that were left out of the fit {_mm(before)} mm RMS become {_mm(after)}: {np.floor(share):.0f} %{of}"
        " is closed."
    )


def _most_poses(result: Diagnosed) -> tuple[float, int]:
    """[m] root mean square of what is left of poses not fitted, without the worst of them, and how many those are."""
    pose, left = result.final.campaign.pose, result.lengths["heldout_after"]
    squares = np.array([np.nansum(left[pose == k] ** 2) for k in range(result.final.campaign.poses)])
    worst = np.argsort(-squares)[: max(1, len(squares) // KEY)]
    rest = left[~np.isin(pose, worst)]
    return float(np.sqrt(np.nanmean(rest**2))), len(worst)


def _nearest(several: Sequence[Named]) -> Iterator[str]:
    """The explanation that comes nearest to one that was named."""
    named = min(several, key=lambda one: one.evidence.margin)
    alias, margin = named.evidence.alias, named.evidence.margin
    of = f" to {named.candidate.label}" if len(several) > 1 else ""
    if alias is None:
        yield "No other effect that was tried comes near."
    elif (alias.name, alias.joint) == (named.candidate.name, named.candidate.joint) and margin < MARGIN:
        yield f"Another form of it, {alias.label}, explains nearly as much (by {margin:.0f} in -2 ln(likelihood) less)."
    elif margin < MARGIN:
        yield (
            f"The nearest other explanation{of}, {alias.label}, fits worse by {margin:.0f} in -2 ln(likelihood) only;"
            f" the {named.effect} is taken because the robot file describes one."
        )
    else:
        yield (
            f"The nearest other explanation{of}, {alias.label}, fits clearly worse: by {margin:.0f} in"
            f" -2 ln(likelihood), where {MARGIN:.0f} are asked for."
        )


def _rest(result: Diagnosed) -> Iterator[str]:
    """What is left, where that is no lack of fit."""
    left = _mm(result.rms["after"])
    if result.verdict.conditional:
        return
    if result.verdict.lack < OVERSTATED:
        yield (
            f"What is left, {left} mm RMS, is clearly less than the scatter ({_mm(result.scatter)} mm, from:"
            f" {result.final.noise.source}): if that is too large, small effects hide behind it."
        )
    elif result.rms["after"] > FAR_OFF * result.scatter:
        yield (
            f"What is left is {left} mm RMS where readings scatter by {_mm(result.scatter)} mm: a few of them lie far"
            " off, the others scatter as they should."
        )
    else:
        yield f"What is left, {left} mm RMS, is the scatter of the readings ({_mm(result.scatter)} mm)."


def _more(result: Diagnosed, begin: str, fit: str) -> Iterator[str]:
    """What stays unexplained by a fit."""
    if result.lacking:
        yield (
            f"{begin} {_mm(result.rms[fit])} mm RMS are left{_against_scatter(result)}, and none of the"
            f" {len(result.tried)} effects that were tried explains the rest."
        )
        if result.verdict.left:
            first = result.verdict.left[0]
            yield f"It goes with {first.variable} ({first.pattern})."
    yield from _rejected(result)


def _rejected(result: Diagnosed) -> Iterator[str]:
    for candidate, why in result.verdict.rejected:
        yield f"{candidate.label} would explain a part, but is not named: {why}{_course(result, candidate)}."


def _course(result: Diagnosed, candidate: Candidate) -> str:
    """Which course explains clearly more than an effect; "" where none does."""
    for rival in result.diagnosis.search.rivals:
        course = rival.candidate.effect
        if rival.of == candidate.key and isinstance(course, Foil) and rival.fitted and rival.margin < -MARGIN:
            what = f"{course.about} {rival.candidate.joint}".strip()
            return (
                f"; {what}, no effect of the library, fits better by {-rival.margin:.0f} in -2 ln(likelihood)"
            )
    return ""


def _moved_too(result: Diagnosed) -> Iterator[str]:
    moved = result.verdict.refitted
    if moved:
        yield f"The robot file's own values have moved as well: {_changes(moved)}."


def _changes(moved: Sequence[Estimate]) -> str:
    """``c2 from 0.302 to 0.268 +- 0.003 urad/(N m)``, those that moved most in their interval first."""
    several = sorted(moved, key=lambda e: -abs(e.value - e.unknown.value) / max(e.ci95, 1e-300))[:PARAMETERS]
    told = []
    for name, estimate in zip(_once([e.unknown.name for e in several]), several, strict=True):
        _, size = shown_unit(estimate.unknown.parameter.unit)
        before = fixed(estimate.unknown.value / size, estimate.ci95 / size)
        told.append(f"{name} from {before} to {with_interval(estimate)}")
    if len(moved) > PARAMETERS:
        told.append(f"{len(moved) - PARAMETERS} more below")
    return ", ".join(told)


def _against_scatter(result: Diagnosed) -> str:
    return "" if result.verdict.conditional else f" where readings scatter by {_mm(result.scatter)} mm"


def _conditional(result: Diagnosed) -> Iterator[str]:
    if result.verdict.conditional:
        yield (
            f"All this holds if readings scatter by as much as the residuals say, {_mm(result.scatter)} mm RMS: neither"
            " SIGMA nor repeated readings state it, and an effect of that size would be taken for scatter."
        )


def _not_tested(result: Diagnosed) -> Iterator[str]:
    """What was not looked for, or only for much of it, and which readings would show it."""
    for names, begin in (
        (result.verdict.not_testable, "Not tested:"),
        (result.hardly_tested, f"Tested only for {USUAL:.0f} times their usual size or more:"),
    ):
        advised: dict[str, list[str]] = {}
        for name in names:
            advised.setdefault(shown_by(name, result.final), []).append(name)
        if advised:
            yield f"{begin} {'; '.join(f'{_list(of)} (shown by {what})' for what, of in advised.items())}."


def shown_by(name: str, fitted: Fit) -> str:
    """What would show an effect that readings and model of a fit do not."""
    effect, campaign = EFFECTS[name], fitted.campaign
    readings = campaign.readings
    if name == "thermal_growth" and readings.temperature is None and readings.time is None:
        return "a column TEMP or T while the robot warms up"
    if effect.family in ("geometric", "weight") and readings.deflection:
        return "absolute positions"
    if name == "tool_offset" and not campaign.place_known.all():
        return "targets whose places are stated"
    if effect.family == "weight" and not any(isinstance(t.effect, ComplianceLaw) for t in fitted.model.terms):
        return "a robot file that states how joints give way"
    if effect.family in LOADED and not readings.wrench.any():
        return "readings with and without a weight"
    if effect.by_direction:
        return "poses reached from both sides"
    return "other poses or loads, `compensate plan`"


def _list(words: Iterable[str]) -> str:
    """``a, b and c``"""
    several = list(words)
    return " and ".join([", ".join(several[:-1]), several[-1]] if len(several) > 1 else several)


def _mm(length: float) -> str:
    return f"{length / MM:.3f}" if length >= 0.01 * MM else f"{length / MM:.2g}"
