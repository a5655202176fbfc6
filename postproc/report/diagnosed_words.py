"""A diagnosis in one paragraph for the user of the robot: no more than the readings support."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from postproc.diagnosis.candidates import EVERY, Candidate
from postproc.diagnosis.decoys import AlternativeForm
from postproc.diagnosis.imitations import MARGIN
from postproc.diagnosis.residual_patterns import goes_with_poses
from postproc.diagnosis.verdict import Named
from postproc.identification.fit import Estimate
from postproc.report.diagnosed import Diagnosed
from postproc.report.diagnosed_detection import sentences as detection_limits
from postproc.report.diagnosed_limits import conditional, not_tested
from postproc.report.diagnosed_names import NOUNS, in_words, variable_words
from postproc.report.formatting import count, fixed, listed, shown_unit
from postproc.report.formatting import millimetres as _mm
from postproc.report.terminal import short_names

LIKELY = 1.645
"""Standard deviations within which chance leaves a difference with a probability of 95 %, to one side."""

SETTLES = LIKELY + (LIKELY**2 + MARGIN) ** 0.5
"""Standard deviations d by which two explanations must differ for one to be named with a probability of 95 %: -2
ln(likelihood) of the other is then worse by d^2 in the mean, and by d^2 - 2 d ``LIKELY`` at least, which is to be
``MARGIN``."""

KEY = 10
"""One of so many poses may show what no other does."""

PARAMETERS = 3
"""So many of an effect are in the paragraph, all in the table."""

WIDE = 1.5
"""Plausible sizes: an interval that is wider says that the readings do not distinguish a parameter from others."""

FAR_OFF = 1.5
"""Times the scatter: where more is left, yet no lack of fit, a few readings lie far off."""


def paragraph(result: Diagnosed) -> str:
    """The verdict, its uncertainty, its limits."""
    sentences = {
        "nothing_missing": _nothing_missing,
        "named": _named,
        "partly_named": _named,
        "ambiguous": _ambiguous,
        "unknown": _unknown,
    }[result.verdict.word](result)
    return " ".join([*sentences, *conditional(result), *not_tested(result)])


def headline(result: Diagnosed) -> str:
    """The verdict in a few words."""
    verdict = result.verdict
    names = ", ".join(named.candidate.label for named in result.clear)
    sets = "; ".join(" or ".join(c.label for c in one) for one in verdict.alternatives)
    words = {
        "nothing_missing": "nothing missing" + (", but parameters have moved" if verdict.refitted else ""),
        "named": f"named: {names}",
        "partly_named": f"partly named: {names}",
        "ambiguous": f"ambiguous: {sets}{_either_way(result)}{f'; named: {names}' if names else ''}",
        "unknown": "unknown: no effect that was tried explains the residual"
        if result.scatter_exceeded
        else "unknown: an effect is missing, and it is not clear which"
        if result.needs_effects
        else "unknown: not clear whether an effect is missing",
    }[verdict.word]
    return f"{words} (if the residual is scatter)" if verdict.conditional else words


def _either_way(result: Diagnosed) -> str:
    if not result.diagnosis.agreed:
        return ""
    largest = max(result.diagnosis.disagreement, default=0.0)
    return f" (the same correction within {_mm(largest)} mm)"


def _nothing_missing(result: Diagnosed) -> Iterator[str]:
    moved, is_ = result.verdict.refitted, "appears to be" if result.verdict.conditional else "is"
    if moved:
        yield (
            f"No effect {is_} missing, but {count(len(moved), 'parameter')} of the robot file"
            f" {'has' if len(moved) == 1 else 'have'} changed: {_changes(moved)}. Refitting its parameters reduces"
            f" the residual from {_mm(result.rms['before'])} to {_mm(result.rms['after'])} mm RMS."
        )
        yield from _closed(result)
    else:
        yield f"No effect {is_} missing."
        if result.rms["before"] > FAR_OFF * result.rms["after"]:
            yield (
                f"The residual of the robot file is {_mm(result.rms['before'])} mm RMS, with its parameters refitted"
                f" {_mm(result.rms['after'])} mm."
            )
    yield from _rest(result)
    if result.detectable is not None:
        yield (
            f"A missing effect of about {_mm(result.detectable)} mm RMS or more would have been found, unless"
            " parameters of the robot file imitate it."
        )
    yield from detection_limits(result)


def _named(result: Diagnosed) -> Iterator[str]:
    yield from _missing(result, result.verdict.named)
    yield from _class_of_geometry(result)
    yield from _ordered(result)
    yield from _attributed(result)
    yield from _closed(result)
    yield from _nearest(result.verdict.named)
    if result.verdict.word == "named":
        yield from _rest(result)
    else:
        yield from _more(result, "More is missing:", "after")
    yield from _moved_too(result)


def _ambiguous(result: Diagnosed) -> Iterator[str]:
    anew = ", with its parameters refitted," if result.diagnosis.base.unknowns else ""
    yield (
        f"An effect is missing: the residual of the robot file{anew} is {_mm(result.rms['refitted'])} mm RMS"
        f"{_against_scatter(result)}."
    )
    if result.clear:
        yield from _missing(result, result.clear)
    for alternatives in result.verdict.alternatives:
        one_of = " or ".join(in_words(candidate) for candidate in alternatives)
        yield f"These readings can not distinguish {one_of}: each explains them as well as the others."
    largest = max(result.diagnosis.disagreement, default=np.inf)
    if result.diagnosis.agreed:
        yield (
            f"Either way the correction is the same within {_mm(largest)} mm, anywhere in the workspace and under loads"
            " as large as those measured: the robot file can be used, whichever it is."
        )
        yield from _closed(result)
        yield from _more(result, "More is missing:", "after")
        yield from _moved_too(result)
        yield "No pose and no load of this size separates what predicts the same; only an inspection of the robot does."
        return
    measured = bool(result.diagnosis.disagreement)
    differ = f" by up to {_mm(largest)} mm" if measured and np.isfinite(largest) else ""
    gets = "gets only what is clear" if result.improves else "is not changed"
    if result.clear and not result.improves:
        gets += ": what is clear would fit worse by itself"
    yield (
        f"Elsewhere in the workspace, or under other loads, their corrections differ{differ}, so the robot file"
        f" {gets}. With all effects found the residual would be {_mm(result.rms['explained'])} mm."
    )
    yield from _more(result, "More is missing:", "explained")
    planned = result.next_poses
    if planned is None:
        yield (
            "No pose within the limits, with the loads used so far, distinguishes them better than the scatter: other"
            f" loads or targets may{_limited(result)}."
        )
        return
    first, second = (candidate.label for candidate in planned.between)
    apart = min(planned.separation)
    if apart < SETTLES:
        yield (
            f"The best {count(len(planned.poses), 'pose')} with the loads used so far would not distinguish them: there"
            f" {first} and {second} differ by {apart:.1f} standard deviations, {SETTLES:.1f} are required. Other loads"
            f" or targets, or less scatter, may{_limited(result)}."
        )
        return
    where = f" ({result.next_poses_file})" if result.next_poses_file else ""
    yield (
        f"Measure these {count(len(planned.poses), 'pose')}{where}: there {first} and {second} differ by {apart:.1f}"
        " standard deviations. Then diagnose all readings together."
    )
    if planned.beyond:
        yield (
            f"They leave the ranges measured so far of {listed(planned.beyond)}, within which nothing distinguishes"
            " the two: check that the arm, its cables and the target are free there."
        )


def _limited(result: Diagnosed) -> str:
    """Which loads are not proposed."""
    return f" ({'; '.join(result.load_limits)})" if result.load_limits else ""


def _unknown(result: Diagnosed) -> Iterator[str]:
    search = result.diagnosis.search
    if not result.scatter_exceeded:
        if result.needs_effects:
            yield (
                f"An effect is missing: the residual is {_mm(result.rms['after'])} mm RMS{_against_scatter(result)}."
                " Which one is not clear."
            )
        else:
            yield "It is not clear whether an effect is missing."
    else:
        yield (
            f"An effect is missing: the residual is {_mm(result.rms['after'])} mm RMS{_against_scatter(result)}. It is"
            f" none of the {len(result.tried)} effects that were tried."
        )
    rejected = {candidate.key for candidate, _ in result.verdict.rejected}
    near = [in_words(candidate) for candidate in search.chosen if candidate.key not in rejected]
    if near:
        yield (
            f"The best explanation is {listed(near)}, but the residual would still be"
            f" {_mm(result.rms['explained'])} mm: too much to name an effect."
        )
    yield from _rejected(result)
    if result.patterns:
        first = result.patterns[0]
        yield (
            f"The residual depends on {variable_words(first.variable)} ({100 * first.share:.0f} % of its squares;"
            f" {first.pattern}): check robot and measurement there."
        )
    yield from _moved_too(result)


def _class_of_geometry(result: Diagnosed) -> Iterator[str]:
    """What predicts the same."""
    hidden = [
        e for e in result.final.estimates if e.unknown.gauge and e.ci95 > WIDE * (e.unknown.prior or np.inf)
    ]
    if hidden and any(one.candidate.joint == EVERY for one in result.verdict.named):
        names = [e.unknown.parameter.name for e in hidden[:PARAMETERS]]
        more = [f"{len(hidden) - PARAMETERS} more"] if len(hidden) > PARAMETERS else []
        yield (
            "Some lengths, twists and zeros predict the same together: the values are the smallest plausible ones, and"
            f" their intervals hold all others; the readings hardly determine {listed([*names, *more])} alone."
        )


def _ordered(result: Diagnosed) -> Iterator[str]:
    """A drift that may as well be an effect of the poses."""
    readings = result.final.campaign.readings
    for named in result.verdict.named:
        variable = named.candidate.effect.form().get("variable")
        values = {"time": readings.time, "temperature": readings.temperature}.get(str(variable))
        if values is not None and goes_with_poses(values, readings.q):
            yield (
                f"But the {variable} follows the order of the poses, so that {named.candidate.label} may as well be an"
                " effect of the poses: measure again in random order."
            )


def _missing(result: Diagnosed, several: Sequence[Named]) -> Iterator[str]:
    """Each effect, its parameters and its displacement."""
    if len(several) > 1:
        yield f"{len(several)} effects are missing."
    for number, named in enumerate(several, 1):
        start = f"({number})" if len(several) > 1 else "The missing effect is"
        size = result.moved[named.candidate.key]
        does = ""
        if size is not None:
            does = f"; it displaces these readings by {_mm(size.rms)} mm RMS, {_mm(size.max)} mm at most"
        yield f"{start} {noun(named)} ({named.effect}: {_parameters(named)}){does}."
        if named.fixed:
            yield f"The readings do not determine {_fixed(named)}: the values above apply with these fixed."


def _fixed(named: Named) -> str:
    """``s0 (fixed at 300 mm)``"""
    units = {u.parameter.name: shown_unit(u.parameter.unit) for u in named.candidate.unknowns}
    entries = [
        f"{name} (fixed at {value / units[name][1]:.4g} {units[name][0]})" for name, value in named.fixed
    ]
    return listed(entries)


def noun(named: Named) -> str:
    """What the effect is, and where."""
    last = named.candidate.up_to_joint
    whole = f"the joints up to {last}" if last else "the joints"
    return NOUNS[named.effect].format(joints=listed(named.joints) if named.joints else whole)


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:]


def _parameters(named: Named) -> str:
    """The parameters with the smallest relative intervals."""
    several = sorted(
        named.estimates, key=lambda e: e.ci95 / max(abs(e.value - e.unknown.parameter.null), 1e-300)
    )
    entries = [f"{e.unknown.parameter.name} = {with_interval(e)}" for e in several[:PARAMETERS]]
    if len(several) > PARAMETERS:
        entries.append(f"{len(several) - PARAMETERS} more below")
    return ", ".join(entries)


def with_interval(estimate: Estimate) -> str:
    """``6.90 +- 0.40 kN/mm``"""
    word, size = shown_unit(estimate.unknown.parameter.unit)
    wide = estimate.ci95 / size
    return f"{fixed(estimate.value / size, wide)} +- {fixed(wide, wide)} {word}".rstrip()


def _attributed(result: Diagnosed) -> Iterator[str]:
    """The contribution of the effects, apart from that of refitted parameters."""
    if result.diagnosis.base.unknowns:
        several = "these effects" if len(result.verdict.named) > 1 else "this effect"
        yield (
            f"The residual of the robot file is {_mm(result.rms['before'])} mm RMS,"
            f" {_mm(result.rms['refitted'])} mm with its own parameters refitted,"
            f" and {_mm(result.rms['after'])} mm with {several}."
        )


def _closed(result: Diagnosed) -> Iterator[str]:
    """The result on held-out poses."""
    before, after = result.rms["held_out_before"], result.rms["held_out_after"]
    if not np.isfinite(before + after):
        return
    if after >= before:
        without_worst, others = _most_poses(result)
        if without_worst < before:
            yield (
                f"On held-out poses the residual falls from {_mm(before)} to {_mm(without_worst)} mm RMS, except at"
                f" {count(others, 'pose')} that can not be held out: the other poses do not show what"
                f" {'it shows' if others == 1 else 'they show'}."
            )
            return
        yield (
            f"But on held-out poses the residual does not fall: {_mm(before)} mm RMS before, {_mm(after)} mm after."
        )
        return
    scatter = result.scatter if not result.verdict.conditional else 0.0
    of = " of the part above the scatter." if scatter else "."
    share = 100.0 * min(1.0, (before - after) / max(before - scatter, 1e-300))
    yield (
        f"On held-out poses the residual falls from {_mm(before)} to {_mm(after)} mm RMS:"
        f" by {np.floor(share):.0f} %{of}"
    )


def _most_poses(result: Diagnosed) -> tuple[float, int]:
    """[m] root mean square of the residuals of held-out poses, without the worst of them, and how many those are."""
    pose, residual = result.final.campaign.pose, result.lengths["held_out_after"]
    squares = np.array([np.nansum(residual[pose == k] ** 2) for k in range(result.final.campaign.poses)])
    worst = np.argsort(-squares)[: max(1, len(squares) // KEY)]
    rest = residual[~np.isin(pose, worst)]
    return float(np.sqrt(np.nanmean(rest**2))), len(worst)


def _nearest(several: Sequence[Named]) -> Iterator[str]:
    """The next best explanation."""
    named = min(several, key=lambda one: one.evidence.margin)
    alias, margin = named.evidence.alias, named.evidence.margin
    of = f" after {named.candidate.label}" if len(several) > 1 else ""
    if alias is None:
        yield "No other effect that was tried explains nearly as much."
    elif (alias.name, alias.joint) == (named.candidate.name, named.candidate.joint) and margin < MARGIN:
        yield f"Another form of it, {alias.label}, explains nearly as much (its likelihood gain is {margin:.0f} lower)."
    elif margin < MARGIN:
        near = f"only {margin:.0f} lower" if margin >= 0.5 else "as large or larger"
        yield (
            f"The likelihood gain of the next best explanation{of}, {alias.label}, is {near}; the {named.effect} is"
            " named because the robot file describes one."
        )
    else:
        yield (
            f"The next best explanation{of}, {in_words(alias)}, fits clearly worse: its likelihood gain is"
            f" {margin:.0f} lower, where {MARGIN:.0f} would do."
        )


def _rest(result: Diagnosed) -> Iterator[str]:
    """The residual, where the fit is adequate."""
    residual = _mm(result.rms["after"])
    if result.verdict.conditional:
        return
    if result.final.is_overstated:
        yield (
            f"The residual, {residual} mm RMS, is clearly smaller than the scatter ({_mm(result.scatter)} mm, from:"
            f" {result.final.noise.source}): if that is overstated, it hides small effects."
        )
    elif result.rms["after"] > FAR_OFF * result.scatter:
        yield (
            f"The residual is {residual} mm RMS where readings scatter by {_mm(result.scatter)} mm: a few of them"
            " are far off, the others agree with the scatter."
        )
    else:
        yield f"The residual, {residual} mm RMS, is the scatter of the readings ({_mm(result.scatter)} mm)."
    for one in result.verdict.remainder[:1]:
        yield f"A small part of it, {100 * one.share:.1f} % of its squares, depends on {variable_words(one.variable)}."


def _more(result: Diagnosed, start: str, fit: str) -> Iterator[str]:
    """The part that a fit does not explain."""
    if result.scatter_exceeded:
        yield (
            f"{start} the residual is {_mm(result.rms[fit])} mm RMS{_against_scatter(result)}, and none of the"
            f" {len(result.tried)} effects that were tried explains the rest."
        )
        if result.verdict.remainder:
            first = result.verdict.remainder[0]
            yield f"It depends on {variable_words(first.variable)} ({first.pattern})."
    yield from _rejected(result)


def _rejected(result: Diagnosed) -> Iterator[str]:
    for candidate, why in result.verdict.rejected:
        words = _sentence(in_words(candidate))
        yield f"{words} would explain a part, but is not named: {why}{_better_trend(result, candidate)}."


def _better_trend(result: Diagnosed, candidate: Candidate) -> str:
    """Which form explains clearly more than an effect; "" where none does."""
    for alternative in result.diagnosis.search.rivals:
        form = alternative.candidate.effect
        if (
            alternative.of == candidate.key
            and isinstance(form, AlternativeForm)
            and alternative.fitted
            and alternative.margin < -MARGIN
        ):
            what = f"{form.about} {alternative.candidate.joint}".strip()
            return (
                f"; {what}, no effect of the library, has a likelihood gain {-alternative.margin:.0f} higher"
            )
    return ""


def _moved_too(result: Diagnosed) -> Iterator[str]:
    moved = result.verdict.refitted
    if moved:
        yield f"Parameters of the robot file have changed as well: {_changes(moved)}."


def _changes(moved: Sequence[Estimate]) -> str:
    """``c2 from 0.302 to 0.268 +- 0.003 urad/(N m)``, those that moved most in their interval first."""
    several = sorted(moved, key=lambda e: -abs(e.value - e.unknown.value) / max(e.ci95, 1e-300))[:PARAMETERS]
    entries = []
    for name, estimate in zip(short_names([e.unknown.name for e in several]), several, strict=True):
        _, size = shown_unit(estimate.unknown.parameter.unit)
        before = fixed(estimate.unknown.value / size, estimate.ci95 / size)
        entries.append(f"{name} from {before} to {with_interval(estimate)}")
    if len(moved) > PARAMETERS:
        entries.append(f"{len(moved) - PARAMETERS} more below")
    return ", ".join(entries)


def _against_scatter(result: Diagnosed) -> str:
    return "" if result.verdict.conditional else f" where readings scatter by {_mm(result.scatter)} mm"
