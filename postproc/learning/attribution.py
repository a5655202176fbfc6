"""Which causes made the deviations of a part: the most probable values, their intervals, and what remains.

Gauss-Newton to the maximum a posteriori: the prediction is linearised at the present values x, deviations less that
prediction are explained as in ``covariance``, and x moves to the mean; three to five rounds.  What an alignment or the
scatter of the force could have done is marginalised, outliers leave one at a time, and an effect joins the causes where
the deviations are far likelier with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import log_ndtr

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import MM
from postproc.learning.candidates import FACTORS, Circumstances, MissingEffect, candidates
from postproc.learning.causes import Cause, CauseKind, CausePrediction
from postproc.learning.covariance import Explanation, Layout, SmoothField, choose_surface

ROUNDS = 4
SETTLED = 0.01
"""Standard deviations by which a cause still moves at the end."""

OUTLIER, MOST_OUTLIERS = 4.0, 0.1
"""Standardised residual of an outlier, times the scatter of all where that is larger; share of points at most."""

OUTLIERS_EACH = float(np.log(0.01) + np.log(1.0 / (1.0 * MM)))
"""Logarithm of the probability density of an outlier: one in a hundred, anywhere within a millimetre."""

TOUCHED = 3.0
"""An effect acts on a point where one standard deviation of it is so many times the scatter of the probe."""

NAMED, AHEAD = np.log(100.0), np.log(10.0)
"""Logarithms: how much likelier the deviations are with an effect that is named than without it (some twenty are
looked for), and than with any other."""

MOST_NAMED = 2


@dataclass(frozen=True)
class Likelier:
    """An effect ``name`` with which the deviations are exp(``gain``) times likelier than without."""

    name: str
    gain: float


@dataclass(frozen=True, eq=False)
class Attribution:
    """What K points say of P causes.

    prediction: of all points with the causes; deviation (K,) [m]; kept (K,): no outlier; x (P,): the causes in their
    own units, logarithms of shares; covariance (P, P); explained: of the kept points at x; named: effects that joined;
    rivals: effects that did not, the likeliest first; verdict; standardised
    (K,): residuals of left-out points; gain: share of what was learnt that is applied.
    """

    prediction: CausePrediction
    deviation: Floats
    layout: Layout
    kept: Bools
    x: Floats
    covariance: Floats
    explained: Explanation
    named: tuple[Likelier, ...]
    candidates: tuple[MissingEffect, ...]
    rivals: tuple[Likelier, ...]
    verdict: str
    standardised: Floats
    gain: float = 1.0

    @property
    def causes(self) -> tuple[Cause, ...]:
        return self.prediction.causes

    @property
    def surface(self) -> SmoothField:
        return self.explained.surface

    @cached_property
    def deviations(self) -> Floats:
        """(P,) standard deviations of the causes after the measurement."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @cached_property
    def kept_rows(self) -> Ints:
        return np.flatnonzero(self.kept)

    @cached_property
    def by_causes(self) -> Floats:
        """(K,) [m] what the causes explain of each point, corrections of the program included."""
        return self.prediction.errors(self.x)

    @cached_property
    def by_learning(self) -> Floats:
        """(K,) [m] what the causes explain beyond what was known of them before."""
        return self.by_causes - self.prediction.errors(0 * self.x)

    def damped(self, gain: float) -> Attribution:
        """With ``gain`` of what was learnt: causes and smooth displacement."""
        return replace(self, x=gain * self.x, gain=gain)

    def field_at(self, place: Floats) -> Floats:
        """(J, 3) [m] the smooth displacement at places (J, 3) [m] that no cause explains."""
        if self.surface.size == 0.0:
            return np.zeros((len(place), 3))
        own = self.explained.layout
        return self.explained.layout.fields_at(self.surface, place) @ (
            self.gain * own.normal * self.explained.alpha[:, None]
        )

    @cached_property
    def by_field(self) -> Floats:
        """(K,) [m] of the smooth displacement at each point."""
        return np.asarray(np.sum(self.field_at(self.layout.place) * self.layout.normal, axis=1))

    @cached_property
    def by_alignment(self) -> Floats:
        """(K,) [m] what the alignment of the measured part took."""
        weight = self.explained.layout.free.T @ self.explained.alpha
        return np.asarray(self.layout.free @ weight)


def attribute(
    prediction: CausePrediction, deviation: Floats, layout: Layout, around: Circumstances, search: bool = True
) -> Attribution:
    """The causes of deviations (K,) [m]; ``search``: for effects that the model misses."""
    kept = np.ones(len(deviation), bool)
    x, kept = _settle(prediction, deviation, layout, prediction.before[0].copy(), kept, outliers=True)
    explained = _explained(prediction, deviation, layout, x, kept)
    named: list[Likelier] = []
    joined: list[MissingEffect] = []
    rivals: list[Likelier] = []
    verdict = "nothing_missing"
    while search:
        noise = float(np.median(layout.sigma[kept]))
        offered = candidates(prediction, x, around, noise, [one.name for one in named])
        everything = _linearised(
            prediction, deviation, layout, x, np.ones(len(kept), bool), explained.surface
        )
        gains = _gains(explained, everything, offered, kept)
        rivals = [Likelier(offered[i].name, gain.gain) for i, gain in _ranked(gains)]
        if not rivals or rivals[0].gain < NAMED:
            break
        if len(rivals) > 1 and rivals[0].gain - rivals[1].gain < AHEAD:
            verdict = "ambiguous"
            break
        if len(named) == MOST_NAMED:
            break
        best = _ranked(gains)[0][0]
        candidate, factor = offered[best], gains[best].factor
        wider = [replace(cause, deviation=factor * cause.deviation) for cause in candidate.causes]
        trial = prediction.with_causes(wider, candidate.model)
        try:
            moved, kept_now = _settle(
                trial, deviation, layout, np.append(x, np.zeros(len(wider))), gains[best].kept, outliers=True
            )
        except np.linalg.LinAlgError:
            break
        if not np.isfinite(moved).all() or _is_null(trial, moved, len(wider)):
            break
        named.append(rivals[0])
        joined.append(candidate)
        prediction, x, kept = trial, moved, kept_now
        explained = _explained(prediction, deviation, layout, x, kept)
    verdict = _verdict(verdict, bool(named), explained)
    mean, covariance = explained.causes()
    root = prediction.before[1]
    standardised = np.full(len(deviation), np.nan)
    standardised[kept] = explained.standardised()
    return Attribution(
        prediction,
        deviation,
        layout,
        kept,
        prediction.causes_at(mean),
        root @ covariance @ root.T,
        explained,
        tuple(named),
        tuple(joined),
        tuple(rivals),
        verdict,
        standardised,
    )


def _is_null(prediction: CausePrediction, x: Floats, count: int) -> bool:
    """Whether all of the last ``count`` causes are at their null: their sign is not one that they can have."""
    return bool(np.all(np.abs(x[-count:]) < 0.05 * prediction.deviations[-count:]))


def _verdict(verdict: str, named: bool, explained: Explanation) -> str:
    smooth = has_field(explained)
    if named:
        return "partly_named" if verdict == "ambiguous" or smooth else "named"
    if verdict == "ambiguous":
        return "ambiguous"
    return "unknown" if smooth else "nothing_missing"


def has_field(explained: Explanation) -> bool:
    """Whether a smooth error without a name is far likelier than none."""
    if explained.surface.size == 0.0:
        return False
    none = choose_surface_without_field(explained)
    return bool(explained.evidence - none.evidence > NAMED)


def choose_surface_without_field(explained: Explanation) -> Explanation:
    """The greatest evidence without a smooth error."""
    from postproc.learning.covariance import WHITES

    every = [explained.with_surface(SmoothField(0.0, explained.surface.length, float(w))) for w in WHITES]
    return max(every, key=lambda one: one.evidence)


def _explained(
    prediction: CausePrediction,
    deviation: Floats,
    layout: Layout,
    x: Floats,
    kept: Bools,
    start: SmoothField | None = None,
) -> Explanation:
    """The deviations explained with the prediction linearised at ``x`` (P,), and the surface chosen."""
    return choose_surface(_linearised(prediction, deviation, layout, x, kept, start or SmoothField()))


def _linearised(
    prediction: CausePrediction,
    deviation: Floats,
    layout: Layout,
    x: Floats,
    kept: Bools,
    surface: SmoothField,
) -> Explanation:
    rows = np.flatnonzero(kept)
    part, own = prediction.part(rows), layout.part(rows)
    columns = part.columns(x)
    errors = part.errors(x)
    mean, root = prediction.before
    rest = deviation[rows] - errors + columns @ (x - mean)
    if not np.isfinite(rest).all() or not np.isfinite(columns).all():
        raise np.linalg.LinAlgError("a point has no equilibrium with these causes")
    return Explanation(own, surface, rest, columns @ root, _by_force(part, columns))


def _by_force(part: CausePrediction, columns: Floats) -> Floats:
    """(K,) [m] error per share of the force of all operations."""
    for number, cause in enumerate(part.causes):
        if cause.name == "force":
            return np.asarray(columns[:, number])
    return np.zeros(len(columns))


def _settle(
    prediction: CausePrediction, deviation: Floats, layout: Layout, x: Floats, kept: Bools, outliers: bool
) -> tuple[Floats, Bools]:
    """The most probable causes (P,), and the points (K,) that are no outliers."""
    scale = prediction.deviations
    surface = SmoothField(FIRST_FIELD)
    for turn in range(ROUNDS):
        explained = _linearised(prediction, deviation, layout, x, kept, surface)
        if turn < 2 and outliers:
            out = _outliers(explained, len(deviation), int((~kept).sum()))
            if len(out):
                kept = kept.copy()
                kept[np.flatnonzero(kept)[out]] = False
                explained = explained.part(np.setdiff1d(np.arange(len(explained.rest)), out))
        explained = choose_surface(explained, 1)
        surface = explained.surface
        new = prediction.causes_at(explained.causes()[0])
        moved = float(np.max(np.abs(new - x) / scale, initial=0.0))
        x = new
        if moved < SETTLED and turn > 0:
            break
    return x, kept


FIRST_FIELD = 10e-6
"""[m] Size of the smooth field before anything is known of it."""


def _outliers(explained: Explanation, count: int, gone: int) -> Ints:
    """Points that all others and the causes contradict, one at a time, the farthest first."""
    inside = np.arange(len(explained.rest))
    out: list[int] = []
    most = int(MOST_OUTLIERS * count) - gone
    now = explained
    while len(out) < most and len(inside) > 6:
        size = np.abs(now.standardised())
        scatter = max(1.0, 1.4826 * float(np.median(size)))
        worst = int(np.argmax(size))
        if size[worst] <= OUTLIER * scatter:
            break
        out.append(int(inside[worst]))
        inside = np.delete(inside, worst)
        now = explained.part(inside)
    return np.array(sorted(out), np.int64)


@dataclass(frozen=True, eq=False)
class _Gain:
    """By how much the evidence grows with a candidate, with which factor of its size, and the points (K,) that are then
    no outliers."""

    gain: float
    factor: float
    kept: Bools


def _gains(
    explained: Explanation, everything: Explanation, offered: Sequence[MissingEffect], kept: Bools
) -> list[_Gain]:
    """Of each candidate; everything: all points, outliers included.

    An outlier that the candidate acts on may be none with it: points in corners, say, where only a force in corners
    shows."""
    present = explained.evidence + OUTLIERS_EACH * int((~kept).sum())
    found = []
    for candidate in offered:
        touched = np.abs(candidate.columns).max(axis=1) > TOUCHED * np.median(everything.layout.sigma)
        best = _Gain(-np.inf, 1.0, kept)
        for points in [kept] + ([kept | touched] if (touched & ~kept).any() else []):
            rows = np.flatnonzero(points)
            own = explained if points is kept else everything.part(rows)
            for start in (own, choose_surface_without_field(own)):
                for factor in FACTORS:
                    with_it = start.with_columns(factor * candidate.columns[rows])
                    gain = evidence_with(with_it, candidate) + OUTLIERS_EACH * int((~points).sum()) - present
                    if gain > best.gain:
                        best = _Gain(gain, factor, points)
        found.append(best)
    for i, _ in _ranked(found)[:3]:
        rows, columns = np.flatnonzero(found[i].kept), found[i].factor * offered[i].columns
        own = explained if found[i].kept is kept else everything.part(rows)
        full = choose_surface(own.with_columns(columns[rows]))
        gain = evidence_with(full, offered[i]) + OUTLIERS_EACH * int((~found[i].kept).sum()) - present
        found[i] = replace(found[i], gain=max(found[i].gain, gain))
    return found


def evidence_with(explained: Explanation, candidate: MissingEffect) -> float:
    """Of an explanation whose last causes are those of a candidate.  A parameter that has no negative values has half
    of the normal distribution before and its share above null after: ln p + sum ln(2 Phi(mean / deviation))."""
    evidence = explained.evidence
    bounded = [i for i, c in enumerate(candidate.causes, -len(candidate.causes)) if c.kind is CauseKind.VALUE]
    if bounded:
        mean, covariance = explained.causes()
        ratio = mean[bounded] / np.sqrt(np.maximum(np.diag(covariance)[bounded], 1e-12))
        evidence += float(np.sum(np.log(2.0) + log_ndtr(ratio)))
    return evidence


def _ranked(gains: Sequence[_Gain]) -> list[tuple[int, _Gain]]:
    return sorted(enumerate(gains), key=lambda one: -one[1].gain)
