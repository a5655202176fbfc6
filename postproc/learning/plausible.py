"""Deviations that no cause can have made: mistakes of the file, reported before anything is learnt from them."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.learning.attribution import Attribution
from postproc.learning.causes import CauseKind, CausePrediction
from postproc.learning.covariance import FIELDS, WHITES, Explanation, Layout, SmoothField, choose_surface
from postproc.learning.measured_part import MeasuredPart

LIKELIER = 3.0
"""Logarithm: how much likelier the deviations must be with the other sign."""

FAR_OUT = 5.0
"""Standard deviations before the measurement beyond which a cause is no longer one."""

LOUD = 3.0
"""Deviations that are so many times the scatter of the probe have something to explain."""

UNEXPLAINED = 0.6
"""Share of the deviations of left-out points that may remain."""

COPIED, SAME = 0.6, 5e-6
"""Share of points that lie off the nominal surface by their own deviation, to [m]."""

TOUCHED = 0.75
"""Share of points that tools of the program have to touch."""


def check_sign(prediction: CausePrediction, deviation: Floats, layout: Layout, file: str) -> list[Finding]:
    """Whether the deviations (K,) [m] are far likelier with the other sign."""
    mean, root = prediction.before
    columns, errors = prediction.columns(mean), prediction.errors(mean)
    scaled = columns @ root
    by_force = next(
        (columns[:, i] for i, cause in enumerate(prediction.causes) if cause.name == "force"), 0 * errors
    )
    likely = [
        choose_surface(
            Explanation(layout, SmoothField(), sign * deviation - errors, scaled, by_force), 1
        ).evidence
        for sign in (1.0, -1.0)
    ]
    if likely[1] - likely[0] <= LIKELIER:
        return []
    message = (
        f"the deviations are exp({likely[1] - likely[0]:.0f}) times likelier with the other sign: probably they"
        " count what is missing as positive, or the reverse"
    )
    return [
        Finding(
            "LRN004", message, file, help="check the line `# positive:` against a place that was cut too deep"
        )
    ]


def check_nominal(part: MeasuredPart, distance: Floats) -> list[Finding]:
    """Whether X, Y, Z are measured places: then they lie off the nominal surface by what DEV says; distance (K,) [m] of
    the points to the tool, NaN where none touches."""
    known = np.isfinite(distance)
    if known.sum() < 6 or float(np.median(np.abs(part.deviation))) < 2 * SAME:
        return []
    share = float(np.mean(np.abs(part.deviation - np.where(known, distance, np.inf)) < SAME))
    if share < COPIED:
        return []
    message = (
        f"the points lie off the nominal surface by their own deviations ({100 * share:.0f} % of them): X, Y, Z are"
        " the measured places"
    )
    return [
        Finding("LRN004", message, str(part.file), help="export the nominal points of the measuring plan")
    ]


def check_explained(result: Attribution, file: str) -> list[Finding]:
    """Whether the causes contradict what is known of them, or predict left-out points no better than nothing does."""
    findings = []
    for cause, value in zip(result.causes, result.x.tolist(), strict=True):
        ratio = abs(value) / cause.deviation
        if ratio > FAR_OUT and cause.group != "effect":
            unit = 1.0 if cause.unit == "1" else MM
            size = (
                f"{100 * np.expm1(value):+.0f} %"
                if cause.is_share()
                else f"{value / unit:+.3f} {_word(cause.unit)}"
            )
            message = f"{cause.name} would have to be off by {size}, {ratio:.0f} times what is expected of it"
            if cause.kind is CauseKind.SHIFT and cause.parameter == "radius":
                message += "; the radius of the probe may still be in the deviations"
            findings.append(Finding("LRN004", message, file))
    surface = result.surface
    if surface.size >= FIELDS[-1] or surface.white >= WHITES[-1]:
        kind = "smooth error" if surface.size >= FIELDS[-1] else "error of each point for itself"
        message = (
            f"they need a {kind} of {max(surface.size, surface.white) / MM:.2f} mm or more, which nothing in a"
            " cell makes: rows may be in another order, or the radius of the probe is still in the deviations"
        )
        findings.append(Finding("LRN004", message, file))
    rest = result.explained.left_out()
    own = result.explained
    alone = Explanation(
        own.layout, SmoothField(100e-6, 2.0), result.deviation[result.kept], 0 * own.columns, 0 * own.by_force
    )
    aligned = alone.left_out()
    sigma = own.layout.sigma
    loud = float(np.sqrt(np.mean(aligned**2))) > LOUD * float(np.sqrt(np.mean(sigma**2)))
    share = float(np.mean(rest**2) / max(float(np.mean(aligned**2)), 1e-18))
    if loud and share > UNEXPLAINED:
        message = (
            f"the causes predict held-out points no better than nothing does ({100 * share:.0f} % of the squares remain"
            "): rows may be in another order than their deviations, or the part is another one"
        )
        findings.append(Finding("LRN004", message, file))
    return findings


def _word(unit: str) -> str:
    return {"m": "mm", "rad": "mrad"}.get(unit, unit)


def check_contacts(part: MeasuredPart, touched: Bools) -> list[Finding]:
    """Whether most points lie on the surface of this part: those that are ``touched`` (K,)."""
    share = float(touched.mean())
    if share >= TOUCHED:
        return []
    message = f"the program has tools that touch {int(touched.sum())} of {len(part)} points"
    help = (
        "X, Y, Z are nominal points in the axes of the program's $BASE, in mm, and NX, NY, NZ lead out of the material;"
        " check base, unit and program"
    )
    return [Finding("LRN003", message, str(part.file), help=help)]
