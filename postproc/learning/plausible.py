"""Deviations that no cause can have made: mistakes of the file, reported before anything is learnt from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, islice

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.learning.attribution import Attribution
from postproc.learning.causes import CauseKind, CausePrediction
from postproc.learning.covariance import FIELDS, WHITES, Explanation, Layout, SmoothField, choose_surface
from postproc.learning.excluded_points import MOST_OUTLIERS, OUTLIERS_EACH, find_outliers
from postproc.learning.measured_part import MeasuredPart

LIKELIER = 3.0
"""Logarithm: how much likelier the deviations must be of a compensated program than of the original."""

EXCHANGED, MOST_PAIRS = 10.0, 60
"""The same if they count the other way or are exchanged between two features; pairs that are tried."""

OFFSET = 0.13 * MM
"""[m] An offset of all deviations that no tool has, but the smallest tips of probes (0.15 mm of radius): worn gears may
shift most of them by 0.1 mm."""

QUIET, FEW = 0.5, 12
"""Deviations of so many times the stated scatter are too small; fewer points do not show it."""

FAR_OUT = 5.0
"""Standard deviations before the measurement beyond which a cause is no longer one."""

REMAINING = 1.8
"""Deviations of left-out points that remain are too large for a probe from so many times its scatter on."""

UNEXPLAINED, PER_POINT = 0.6, 0.5
"""Share of the deviations of left-out points that may remain where the causes make the deviations of a point, in the
mean, less than exp(0.5) times likelier than a scatter without order does."""

CONFIRMED = 5.0
"""Logarithm: how much likelier the deviations must be by the causes than by a scatter without order, which rows in
another order are: at most one such file in 150 is (Markov's inequality)."""

SCATTERS = np.append(WHITES, [0.2 * MM, 0.4 * MM, 0.8 * MM, 1.6 * MM])
"""[m] of deviations that have no order."""

ROBUST = 6
"""Rounds in which points that lie elsewhere lose their weight."""

COPIED, SAME = 0.6, 5e-6
"""Share of points that lie off the nominal surface by their own deviation, to [m]."""

FEW_BESIDE = 3
"""Points that no tool touches, from which on they may show that all of them are shifted."""

SHIFTED, ALIKE = 0.06 * MM, 0.9
"""[m] A shift of all points beyond chords and roundings; share of the points that lie as far off as it says."""

TOUCHED = 0.75
"""Share of points that tools of the program have to touch."""


@dataclass(frozen=True, eq=False)
class FirstLook:
    """Deviations (K,) [m] beside what the causes predict before anything is learnt: ``errors`` (K,) [m], ``columns``
    (K, P) [m per standard deviation], ``by_force`` (K,) [m per share of the force]."""

    layout: Layout
    deviation: Floats
    errors: Floats
    columns: Floats
    by_force: Floats

    def part(self, rows: Ints) -> FirstLook:
        """Of some points (J,)."""
        own = self.layout.part(rows), self.deviation[rows], self.errors[rows], self.columns[rows]
        return FirstLook(*own, self.by_force[rows])

    @staticmethod
    def of(prediction: CausePrediction, deviation: Floats, layout: Layout) -> FirstLook:
        """Of deviations (K,) [m]."""
        mean, root = prediction.before
        columns, errors = prediction.columns(mean), prediction.errors(mean)
        names = [cause.name for cause in prediction.causes]
        by_force = columns[:, names.index("force")] if "force" in names else np.zeros(len(errors))
        return FirstLook(layout, deviation, errors, columns @ root, by_force)

    def evidence(self, deviation: Floats, errors: Floats) -> float:
        """Logarithm of the probability of deviations (K,) [m] where the program makes errors (K,) [m]."""
        whole = Explanation(self.layout, SmoothField(), deviation - errors, self.columns, self.by_force)
        return choose_surface(whole, 1).evidence

    def robust_evidence(self, deviation: Floats) -> float:
        """The same of deviations (K,) [m] with their outliers excluded, each at its cost."""
        whole = Explanation(self.layout, SmoothField(), deviation - self.errors, self.columns, self.by_force)
        out = find_outliers(whole, int(MOST_OUTLIERS * len(deviation)))
        inside = np.setdiff1d(np.arange(len(deviation)), out)
        return choose_surface(whole.part(inside), 1).evidence + OUTLIERS_EACH * len(out)


def check_deviations(
    look: FirstLook,
    feature: Sequence[str],
    original: bool,
    file: str,
    several: bool = False,
    sign_seen: bool = False,
) -> list[Finding]:
    """Whether the deviations are too small for the probe, or far likelier with the other sign, exchanged between two of
    the features (K,), or of a compensated program where the ``original`` is stated; ``several``: other parts show
    the causes too, which are not known here; ``sign_seen``: the part itself shows the sign."""
    enough = EXCHANGED if several else LIKELIER
    quiet = _check_size(look, file)
    if quiet:
        return quiet
    present = look.evidence(look.deviation, look.errors)
    turned = -np.inf if sign_seen else look.evidence(-look.deviation, look.errors) - present
    compensated = look.evidence(look.deviation, 0 * look.errors) - present if original else -np.inf
    if compensated > max(enough if several else 0.0, turned):
        return [wrong_program(compensated, file)]
    if turned > EXCHANGED:  # closer odds are judged with the effects that each reading asks for
        return [wrong_sign(turned, file)]
    return _check_offset(look, present, file) or _check_features(look, feature, present, file)


def wrong_program(gain: float, file: str) -> Finding:
    """That a compensated program cut the part; gain: logarithm of how much likelier that is."""
    message = (
        f"the deviations are exp({gain:.0f}) times likelier of a compensated program than of the original, which the"
        " file states"
    )
    help = "state the program that really ran: `# cut_with: compensated/part.src`, and its sha256"
    return Finding("LRN002", message, file, help=help)


def wrong_sign(gain: float, file: str) -> Finding:
    """That DEV counts the other way; gain: logarithm of how much likelier that is."""
    message = (
        f"the deviations are exp({gain:.0f}) times likelier with the other sign: probably they count what is missing"
        " as positive, or the reverse"
    )
    help = (
        "look at a place with a large deviation again, correct `# positive:` if it is wrong, and add the line"
        " `# checked: X Y Z material_left` (or material_missing), or the measured places as columns MX, MY, MZ"
    )
    return Finding("LRN004", message, file, help=help)


def _check_size(look: FirstLook, file: str) -> list[Finding]:
    """Whether the deviations scatter less than the probe, which no part can."""
    layout = look.layout
    taken = np.linalg.qr(layout.free[:, np.abs(layout.free).any(axis=0)])[0]
    aligned = look.deviation - taken @ (taken.T @ look.deviation)
    free = len(aligned) - taken.shape[1]
    size = float(np.sqrt(np.sum((aligned / layout.sigma) ** 2) / max(free, 1)))
    if free < FEW or size >= QUIET:
        return []
    rms = float(np.sqrt(np.mean(aligned**2))) / MM
    message = f"the deviations are {rms:.4f} mm RMS, {size:.1g} times the stated scatter of the probe"
    help = "DEV is in mm (not in inches or m); sigma_mm is the standard deviation of one deviation"
    return [Finding("LRN004", message, file, help=help)]


def _check_offset(look: FirstLook, present: float, file: str) -> list[Finding]:
    """Whether all deviations are too large by the same, as with the radius of the probe in them."""
    middle = float(np.median(look.deviation - look.errors))
    if abs(middle) < OFFSET or look.evidence(look.deviation - middle, look.errors) - present < EXCHANGED:
        return []
    message = f"the deviations are far likelier if {middle / MM:.2f} mm are taken off all of them"
    help = "the radius of the probe is probably still in DEV: let its software remove it"
    return [Finding("LRN004", message, file, help=help)]


def _check_features(look: FirstLook, feature: Sequence[str], present: float, file: str) -> list[Finding]:
    names = sorted({name for name in feature if name})
    rows = {name: np.array([i for i, one in enumerate(feature) if one == name]) for name in names}
    best, pair, likeliest = 0.0, ("", ""), look.deviation
    for one, other in islice(combinations(names, 2), MOST_PAIRS):
        count = min(len(rows[one]), len(rows[other]))
        first, second = rows[one][:count], rows[other][:count]
        exchanged = look.deviation.copy()
        exchanged[first], exchanged[second] = look.deviation[second], look.deviation[first]
        gain = look.evidence(exchanged, look.errors) - present
        if gain > best:
            best, pair, likeliest = gain, (one, other), exchanged
    if best <= EXCHANGED:
        return []
    # single points that are far off, as in corners, may like another place better
    best = look.robust_evidence(likeliest) - look.robust_evidence(look.deviation)
    if best <= EXCHANGED:
        return []
    message = (
        f"the deviations are exp({best:.0f}) times likelier if those of {pair[0]} and {pair[1]} are exchanged"
    )
    help = "check which rows of the measuring report belong to which feature"
    return [Finding("LRN004", message, file, help=help)]


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


def find_shift(normal: Floats, off: Floats) -> Floats | None:
    """The shift d (3,) [m] by which points with normals (K, 3) lie beside the surface: off (K,) [m] is n . d of nearly
    all of them; None where there is none."""
    shift: Floats = np.zeros(3)
    rest: Floats = off
    weight = np.ones(len(off))
    for _ in range(ROBUST):
        shift = np.asarray(np.linalg.lstsq(weight[:, None] * normal, weight * off, rcond=None)[0], float)
        rest = np.abs(off - normal @ shift)
        weight = 1.0 / np.maximum(rest, 0.1 * SHIFTED)
    if not len(off):
        return None
    found = np.linalg.norm(shift) >= SHIFTED and np.mean(rest < 0.5 * SHIFTED) >= ALIKE
    return shift if found else None


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
        kind = "a smooth error" if surface.size >= FIELDS[-1] else "an error of each point for itself"
        message = (
            f"they need {kind} of {max(surface.size, surface.white) / MM:.2f} mm or more, which nothing in a"
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
    remains = float(np.sqrt(np.mean(rest**2))) > REMAINING * float(np.sqrt(np.mean(sigma**2)))
    share = float(np.mean(rest**2) / max(float(np.mean(aligned**2)), 1e-18))
    gain, count = _gain_over_scatter(result), len(result.deviation)
    if remains and (gain < CONFIRMED or (share > UNEXPLAINED and gain < PER_POINT * count)):
        message = (
            f"the {count} points do not confirm each other ({100 * share:.0f} % of the squares of held-out deviations"
            " remain): rows may be in another order than their deviations, the part may be another one, or the points"
            " are too few"
        )
        help = (
            "compare some rows with the measuring report; measure more points, or those that --plan chooses"
        )
        findings.append(Finding("LRN004", message, file, help=help))
    return findings


def scatter_findings(result: Attribution, file: str) -> list[Finding]:
    """LRN023: what neither causes nor smooth error explain is clearly larger than the stated scatter of the probe."""
    rest = (result.deviation - result.by_alignment - result.by_causes - result.by_field)[result.kept]
    remains, stated = (float(np.sqrt(np.mean(one**2))) for one in (rest, result.layout.sigma[result.kept]))
    if len(rest) < FEW or remains < REMAINING * stated:
        return []
    message = (
        f"{remains / MM:.4f} mm RMS remain unexplained, {remains / stated:.2g} times the stated scatter of the probe"
        f" ({stated / MM:.4f} mm): sigma_mm is too small, or something differs from point to point"
    )
    help = "measure some points again: what they show again is of the part, the rest is of the probe"
    return [Finding("LRN023", message, file, help=help)]


def _gain_over_scatter(result: Attribution) -> float:
    """Logarithm of how much likelier the deviations are by causes and smooth error than by a scatter that no two points
    share, after the alignment, outliers at their cost."""
    count = len(result.deviation)
    none, zero = np.zeros((count, 0)), np.zeros(count)
    scatters = [
        Explanation(result.layout, SmoothField(white=float(white)), result.deviation, none, zero)
        for white in SCATTERS
    ]
    best = max(one.evidence - one.surface.logarithm for one in scatters)
    own = result.explained.evidence - result.surface.logarithm
    return own + OUTLIERS_EACH * int((~result.kept).sum()) - best


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
