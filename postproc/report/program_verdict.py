"""The verdict on one program: error plus uncertainty against the tolerance, in one word and one sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence

from postproc.base.units import MM
from postproc.compensation.uncertain_inputs import COMPONENTS, DIRECTION, FORCE
from postproc.report.formatting import two_digits
from postproc.report.report import NOT_CORRECTED, REVIEW, UNCERTAIN, Report

_NAMED = 2
"""Quantities that are worth measuring, at most."""

_SHARE = 0.2
"""What adds less than this share of the largest contribution is not named."""


def verdict_sentence(report: Report) -> str:
    """The verdict with its figures; empty where nothing was to be corrected."""
    word = report.verdict
    if word is None:
        return ""
    if word == NOT_CORRECTED:
        return "not corrected"
    if word == REVIEW:
        return f"needs review: {_reasons(report)}"
    allowed = f"the tolerance {report.tolerance / MM:g} mm"
    uncertainty = report.uncertainty
    if word == UNCERTAIN:
        width = f"{'at least ' if uncertainty.lower_bound else ''}{two_digits(uncertainty.after / MM)} mm"
        fits = report.largest_after + uncertainty.after <= report.tolerance
        names = _names(
            uncertainty.effect_of_10_percent if uncertainty.unknown or fits else uncertainty.budget
        )
        measure = f": measure {names}" if names else ""
        if uncertainty.unknown:
            return f"corrected, but the uncertainty is not known{measure}"
        if fits:
            return f"corrected, but the uncertainty, {width}, is not known in full{measure}"
        if uncertainty.after > report.tolerance:
            return f"corrected, but uncertainty {width} exceeds {allowed}{measure}"
        off = two_digits(report.largest_after / MM)
        return f"corrected, but error {off} mm and uncertainty {width} together exceed {allowed}{measure}"
    return (
        f"within tolerance: error {two_digits(report.largest_after / MM)} mm and uncertainty"
        f" {two_digits(uncertainty.after / MM)} mm, tolerance {report.tolerance / MM:g} mm"
    )


def _names(ranked: Sequence[tuple[str, float]]) -> str:
    """The first of the quantities that contribute most; ``ranked``: name and contribution, largest first."""
    named = [name for name, size in ranked if size >= _SHARE * ranked[0][1] and not math.isnan(size)]
    words = ["the force" if name in (FORCE, DIRECTION, *COMPONENTS) else name for name in named]
    return " or ".join(list(dict.fromkeys(words))[:_NAMED])


def _reasons(report: Report) -> str:
    warnings = sum(finding.severity != "info" for finding in report.findings)
    if warnings:
        return "1 finding" if warnings == 1 else f"{warnings} findings"
    return (
        f"error {two_digits(report.largest_after / MM)} mm exceeds the tolerance {report.tolerance / MM:g} mm"
    )
