"""Which causes made the deviations of a part: the most probable values, their intervals, and what remains.

Gauss-Newton to the maximum a posteriori: the prediction is linearised at the present values x, deviations less that
prediction are explained as in ``covariance``, and x moves to the mean; three to five rounds.  What an alignment or the
scatter of the force could have done is marginalised, outliers leave one at a time, and an effect joins the causes where
the deviations are far likelier with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.learning.candidates import Circumstances, MissingEffect, candidates
from postproc.learning.causes import Cause, CausePrediction
from postproc.learning.considered import considered_covariance
from postproc.learning.covariance import Explanation, Layout, SmoothField, choose_surface, without_field
from postproc.learning.excluded_points import MOST_OUTLIERS, OUTLIERS_EACH, find_outliers
from postproc.learning.naming import NAMED, probable_set, weigh_effects

ROUNDS = 4
SETTLED = 0.01
"""Standard deviations by which a cause still moves at the end."""

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
    rivals: effects that did not, the likeliest first; alternatives: names of effects of which the part does
    not tell which, the likeliest first; stand_in: the one of them that joined; verdict; standardised
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
    alternatives: tuple[str, ...]
    stand_in: str
    verdict: str
    standardised: Floats
    gain: float = 1.0

    @property
    def causes(self) -> tuple[Cause, ...]:
        return self.prediction.causes

    @property
    def effect_names(self) -> frozenset[str]:
        """Effects that were named, and those of which the part does not tell which."""
        return frozenset({one.name for one in self.named}.union(self.alternatives))

    @property
    def surface(self) -> SmoothField:
        return self.explained.surface

    def is_unsure(self, cause: Cause) -> bool:
        """Whether the part does not distinguish it from other effects: it is applied at this place only."""
        return bool(self.stand_in) and self.stand_in in (cause.place, cause.name)

    @property
    def evidence(self) -> float:
        """Logarithm of the probability of the deviations, outliers at their cost, and each effect that joined at that
        of having been looked for among others."""
        looked = len(self.candidates) * float(np.log(max(len(self.rivals), 1)))
        return self.explained.evidence + OUTLIERS_EACH * int((~self.kept).sum()) - looked

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


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    """The most probable causes ``x`` (P,) of a prediction, the points ``kept`` (K,), and how they are explained."""

    prediction: CausePrediction
    layout: Layout
    x: Floats
    kept: Bools
    explained: Explanation

    @property
    def evidence(self) -> float:
        """Logarithm of the probability of the deviations, outliers at their cost."""
        return self.explained.evidence + OUTLIERS_EACH * int((~self.kept).sum())

    @property
    def parts(self) -> tuple[CausePrediction, Layout, Floats, Bools, Explanation]:
        return self.prediction, self.layout, self.x, self.kept, self.explained


def attribute(
    prediction: CausePrediction, deviation: Floats, layout: Layout, around: Circumstances, search: bool = True
) -> Attribution:
    """The causes of deviations (K,) [m]; ``search``: for effects that the model misses."""
    x, kept = prediction.before[0].copy(), np.ones(len(deviation), bool)
    x, kept = _settle(prediction, deviation, layout, x, kept, outliers=True)
    explained = _explained(prediction, deviation, layout, x, kept)
    measured = layout
    bare = _Hypothesis(prediction, layout, x, kept, explained)
    named: list[Likelier] = []
    joined: list[MissingEffect] = []
    rivals: list[Likelier] = []
    alternatives: tuple[str, ...] = ()
    stand_in = ""
    offered: list[MissingEffect] | None = None
    while search:
        everything = explained
        if not kept.all():
            every = np.ones(len(kept), bool)
            everything = _linearised(prediction, deviation, layout, x, every, explained.surface)
        offered = candidates(prediction, x, around, _noise_of(layout, kept), [one.name for one in joined])
        ranked = weigh_effects(explained, everything, offered, kept)
        rivals = [Likelier(one.effect.name, one.gain) for one in ranked]
        if not rivals or rivals[0].gain < NAMED or len(named) == MOST_NAMED:
            break
        alike = probable_set(ranked)
        if len(alike) > 1 and alternatives:
            break
        best = ranked[0]
        if len(alike) > 1 and best.effect.name in ("engagement", "drift"):
            alternatives = tuple(one.effect.name for one in alike)  # the next program could not apply it
            break
        wide = best.effect.widened(best.factor)
        trial = _with_effect(prediction, wide, deviation, layout, x, best.kept)
        if trial is None:
            break
        if len(joined) == 1 and len(named) == 1 and len(alike) == 1:
            alone = _instead_of_first(bare, wide, deviation, around)
            if alone is not None and alone.evidence > trial.evidence - NAMED:
                # the first one only stood for this one
                named, joined = [rivals[0]], [best.effect]
                prediction, layout, x, kept, explained = alone.parts
                offered = None
                break
        if len(alike) > 1:
            alternatives, stand_in = tuple(one.effect.name for one in alike), best.effect.name
        else:
            named.append(rivals[0])
        joined.append(best.effect)
        prediction, layout, x, kept, explained = trial.parts
    verdict = _verdict(bool(alternatives), bool(named), explained)
    mean, covariance = explained.causes()
    if search:
        if offered is None:
            offered = candidates(prediction, x, around, _noise_of(layout, kept), [one.name for one in joined])
        covariance = covariance + considered_covariance(explained, offered, np.flatnonzero(kept))
    root = prediction.before[1]
    standardised = np.full(len(deviation), np.nan)
    standardised[kept] = explained.standardised()
    return Attribution(
        prediction,
        deviation,
        measured,
        kept,
        prediction.causes_at(mean),
        root @ covariance @ root.T,
        explained,
        tuple(named),
        tuple(joined),
        tuple(rivals),
        alternatives,
        stand_in,
        verdict,
        standardised,
    )


def _noise_of(layout: Layout, kept: Bools) -> float:
    """[m] of a point."""
    return float(np.median(layout.sigma[kept]))


def _with_effect(
    prediction: CausePrediction,
    effect: MissingEffect,
    deviation: Floats,
    layout: Layout,
    x: Floats,
    kept: Bools,
) -> _Hypothesis | None:
    """The causes with those of an effect beside them; None where they cannot be found, or are as good as null.  A gap
    acts otherwise near its null than at its size: the likelier of two starts counts."""
    trial, found = prediction.with_causes(effect.causes, effect.model, effect.wide), []
    layout = layout.with_noise(effect.column_sigma)
    for start in (0.0, 1.0):
        sizes = [start * cause.deviation for cause in effect.causes]
        try:
            moved, now = _settle(trial, deviation, layout, np.append(x, sizes), kept, outliers=True)
            fit = _Hypothesis(trial, layout, moved, now, _explained(trial, deviation, layout, moved, now))
        except np.linalg.LinAlgError:
            continue
        if np.isfinite(moved).all():
            found.append(fit)
    best = max(found, key=lambda fit: fit.evidence, default=None)
    return best if best is not None and _differs_from_null(best.explained, len(effect.causes)) else None


def _instead_of_first(
    bare: _Hypothesis, second: MissingEffect, deviation: Floats, around: Circumstances
) -> _Hypothesis | None:
    """The effect that was named second, without the one that was named first: near the null one of two that are alike
    may look likelier that is not so at its true size."""
    offered = candidates(bare.prediction, bare.x, around, _noise_of(bare.layout, bare.kept))
    own = next((one for one in offered if (one.name, one.wide) == (second.name, second.wide)), None)
    if own is None:
        return None
    factor = second.causes[0].deviation / own.causes[0].deviation
    fits = [
        _with_effect(bare.prediction, own.widened(size), deviation, bare.layout, bare.x, bare.kept)
        for size in sorted({1.0, factor})
    ]
    return max((fit for fit in fits if fit is not None), key=lambda fit: fit.evidence, default=None)


def evidence_of(prediction: CausePrediction, deviation: Floats, layout: Layout) -> float:
    """Logarithm of the probability of deviations (K,) [m] by the known causes, about their most probable values
    (Laplace's approximation), outliers at their cost; -inf where nothing can make them."""
    start, every = prediction.before[0].copy(), np.ones(len(deviation), bool)
    try:
        x, kept = _settle(prediction, deviation, layout, start, every, outliers=True)
        explained = _explained(prediction, deviation, layout, x, kept)
    except np.linalg.LinAlgError:
        return -np.inf
    return explained.evidence + OUTLIERS_EACH * int((~kept).sum())


def _differs_from_null(explained: Explanation, count: int) -> bool:
    """Whether the last ``count`` causes are as far from their null as the gain of an effect that is named says:
    m^T V^-1 m / 2 of their mean m and covariance V."""
    mean, covariance = explained.causes()
    own = mean[-count:]
    return bool(0.5 * own @ np.linalg.solve(covariance[-count:, -count:], own) > NAMED)


def _verdict(ambiguous: bool, named: bool, explained: Explanation) -> str:
    smooth = has_field(explained)
    if named:
        return "partly_named" if ambiguous or smooth else "named"
    if ambiguous:
        return "ambiguous"
    return "unknown" if smooth else "nothing_missing"


def has_field(explained: Explanation) -> bool:
    """Whether a smooth error without a name is far likelier than none."""
    if explained.surface.size == 0.0:
        return False
    return bool(explained.evidence - without_field(explained).evidence > NAMED)


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
            out = find_outliers(explained, int(MOST_OUTLIERS * len(deviation)) - int((~kept).sum()))
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
