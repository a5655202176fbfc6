"""Who knows the truth: how large it shows in readings, and whether anything else of the library could be it.

All in standard deviations of the readings and outside of what is explained anyway: tracker, targets that are not
stated, and the parameters that the robot file states, each as far as it may plausibly be off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from postproc.base.geometry import Poses
from postproc.effects import EFFECTS, Effect
from postproc.identification.campaign import Campaign, Nuisances
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import Unknown, unknowns_of, with_mechanism
from postproc.measurements import Readings
from postproc.model import StiffnessModel

from .design import Design
from .hidden import Hidden

PLAUSIBLE = 10.0
"""Usual sizes by which a stated parameter may be off."""

MARGIN = 10.0
"""By how much -2 ln(likelihood), on the average over what parameters may be, of anything else must be worse than the
truth's for an oracle to tell them apart."""

TWIN, TWIN_SHARE = 4.0, 0.05
"""Squares of a signal, in variances and as a share of all, that an equal one may miss."""

CURVED = 0.005
"""Share of a change of geometry that its first order may miss: a hundredth of a radian is no small turn."""

SEEN = 1e-3
"""Share of a column that must stand outside of what is explained anyway."""


@dataclass(frozen=True)
class Rival:
    """An effect of the library on a joint ("" where it is of none) in the place of the truth: how much worse it is."""

    effect: str
    joint: str
    margin: float


class Oracle:
    """Of one campaign; ``readings``: with values that need not be known."""

    def __init__(self, model: StiffnessModel, readings: Readings, design: Design, sigma: float) -> None:
        self.model, self.campaign, self.sigma = model, Campaign(readings), sigma
        frame = Poses.identity() if design.frame is None else design.frame
        start = self.campaign.start()
        into = design.tool.inverse()
        places = design.targets @ into.rotation.T + into.position if len(design.targets) else start.places
        frames = Poses(frame.rotation[None], frame.position[None])
        self.given = Nuisances(frames, places, start.turns)
        seen = self.campaign.predicted(model)
        nuisance = self._flat(self.campaign.nuisance_columns(seen, self.given))
        own = self._flat(self._columns(model, own_unknowns(model)))
        limits = np.eye(own.shape[1]) / PLAUSIBLE
        self.explained = np.concatenate(
            [
                np.column_stack([own, nuisance]),
                np.column_stack([limits, np.zeros((len(limits), nuisance.shape[1]))]),
            ]
        )
        length = np.linalg.norm(self.explained, axis=0)
        u, s, _ = np.linalg.svd(self.explained / np.where(length > 0, length, 1.0), full_matrices=False)
        self._basis = u[:, s > 1e-9 * s[0]]
        self._free = _basis(np.column_stack([own, nuisance]))
        self.rows = len(own)
        self.freedom = self.rows - nuisance.shape[1]

    def outside(self, values: np.ndarray) -> np.ndarray:
        """(n + P, k) of whitened ``values`` (n, k), without what is explained anyway."""
        whole = np.concatenate([values, np.zeros((len(self.explained) - len(values), values.shape[1]))])
        left = whole - self._basis @ (self._basis.T @ whole)
        return left - self._basis @ (self._basis.T @ left)

    def shown(self, signal: np.ndarray) -> float:
        """SNR of a ``signal`` (R, 3) [m]: RMS, over sigma, of what is not explained anyway."""
        return float(np.linalg.norm(self.outside(self._flat(signal[:, :, None]))) / np.sqrt(self.rows))

    def rivals(
        self, truth: Hidden, size: float, rest: np.ndarray, others: list[tuple[Hidden, float]]
    ) -> list[Rival]:
        """What else might be in the place of ``truth``, nearest first.  ``rest`` (R, 3) [m]: the readings without all
        that is not hidden, noise included; ``others``: what is hidden beside it."""
        y = self.outside(self._flat(rest[:, :, None]))[:, 0]
        beside = [self.outside(self._flat(self._of(hidden, s))) for hidden, s in others]
        basis = _basis(np.column_stack([np.empty((len(y), 0)), *beside]))

        def gain(moves: np.ndarray) -> float:
            own = self.outside(self._flat(moves))
            return likelihood_gain(own - basis @ (basis.T @ own), y - basis @ (basis.T @ y))

        mine = self._of(truth, size)
        signal = self.outside(self._flat(mine))
        signal = _project(_basis(signal - basis @ (basis.T @ signal)), y)
        best, found = gain(mine), []
        for effect, joint, moves in self._library():
            if (effect, joint) != (truth.effect, truth.joint):
                own = self.outside(self._flat(moves))
                missed = signal - _project(_basis(own - basis @ (basis.T @ own)), signal)
                # what predicts the same is no worse, however many parameters it has
                found.append(Rival(effect, joint, 0.0 if _is_little(missed, signal) else best - gain(moves)))
        return sorted([*found, Rival("nothing", "", best)], key=lambda rival: rival.margin)

    def is_own(self, truth: Hidden, size: float) -> bool:
        """Whether parameters that the robot file states do the same as ``truth``, however far they have to go: a zero
        of a joint is a shift and a twist of the axes after it."""
        model = joined(self.model, truth.made)
        values = truth.at(size)
        unknowns = [u for u in unknowns_in(truth, model) if u.parameter.name in values]
        share = np.array(
            [(values[u.parameter.name] - u.parameter.null) / u.parameter.scale for u in unknowns]
        )
        signal = self._flat(self._of(truth, size)[:, :, : len(share)]) @ share
        missed = signal - _project(self._free, signal)
        return float(np.linalg.norm(missed)) < CURVED * float(np.linalg.norm(signal))

    def beyond(self, signal: np.ndarray) -> float:
        """SNR of what of a ``signal`` no single effect of the library can imitate either."""
        y = self.outside(self._flat(signal[:, :, None]))[:, 0]
        least = np.linalg.norm(y)
        for _, _, moves in self._library():
            basis = _basis(self.outside(self._flat(moves)))
            least = min(least, np.linalg.norm(y - basis @ (basis.T @ y)))
        return float(least / np.sqrt(self.rows))

    def _flat(self, values: np.ndarray) -> np.ndarray:
        """(3 R, k) of (R, 3, k), in standard deviations."""
        return values.reshape(3 * len(values), values.shape[2]) / self.sigma

    def _columns(self, model: StiffnessModel, unknowns: list[Unknown]) -> np.ndarray:
        return np.nan_to_num(
            columns(self.campaign, model, unknowns, self.campaign.predicted(model), self.given)
        )

    def _of(self, hidden: Hidden, size: float) -> np.ndarray:
        """(R, 3, p) columns of what is hidden, where it is."""
        model = joined(self.model, hidden.made)
        term = term_of(model, hidden.made)
        values = hidden.at(size)
        model = model.with_values({(term, name): value for name, value in values.items()})
        return self._columns(model, unknowns_in(hidden, model))

    def _library(self):
        """(effect, joint, columns (R, 3, p)) of all that the model lacks."""
        if not hasattr(self, "_known"):
            self._known = list(self._looked_up())
        return self._known

    def _looked_up(self):
        for name, kind in EFFECTS.items():
            if name == "base_offset" and self.campaign.tracked:
                continue
            for effect in kind.variants(self.model.robot.joints):
                model = joined(self.model, effect)
                term = term_of(model, effect)
                unknowns = [u for u in unknowns_of(model, term) if u.stated is None and not u.fixed]
                if not unknowns:
                    continue
                # what moves nothing at its null is looked at in its usual size
                moves = self._columns(model, unknowns)
                if not np.abs(moves).max() > 0:
                    model = model.with_values({u.key: u.parameter.scale for u in unknowns})
                    moves = self._columns(model, unknowns)
                if not effect.apart or effect.whole:
                    yield name, "", moves
                for joint in dict.fromkeys(u.parameter.joint for u in unknowns):
                    own = [i for i, u in enumerate(unknowns) if u.parameter.joint == joint]
                    if np.linalg.norm(moves[:, :, own]) / self.sigma > SEEN:
                        yield name, joint, moves[:, :, own]


def likelihood_gain(columns: np.ndarray, y: np.ndarray) -> float:
    """Fall of -2 ln(likelihood) of ``y`` (n,) with ``columns`` (n, p) whose coefficients are normal with one deviation,
    the likeliest; p(y) is normal with the covariance 1 + u^2 C C'."""
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    s, along = s[s > 0], (u.T @ y)[s > 0]

    def less(log_u: float) -> float:
        variance = 1.0 + (np.exp(log_u) * s) ** 2
        return float((along**2 / variance + np.log(variance) - along**2).sum())

    if not len(s):
        return 0.0
    grid = np.linspace(np.log(1e-3 / s.max()), np.log(1e5 / s.max()), 60)
    start = grid[np.argmin([less(x) for x in grid])]
    return -float(min(0.0, minimize_scalar(less, bounds=(start - 1, start + 1), method="bounded").fun))


def joined(model: StiffnessModel, effect: Effect) -> StiffnessModel:
    """The model with an effect, at its null where the model does not have it."""
    if any(term.effect.name == effect.name for term in model.terms):
        return model
    return (
        with_mechanism(model, type(effect))
        if effect.name == "gravity_compensator"
        else model.with_effect(effect)
    )


def term_of(model: StiffnessModel, effect: Effect) -> int:
    return next(i for i, term in enumerate(model.terms) if term.effect.name == effect.name)


def unknowns_in(hidden: Hidden, model: StiffnessModel) -> list[Unknown]:
    """What an oracle has to find of what is hidden: how large it is."""
    named = {**hidden.values, **hidden.fixed}
    of = unknowns_of(model, term_of(model, hidden.made))
    return [u for u in of if u.parameter.name in named and not u.parameter.hardware]


def own_unknowns(model: StiffnessModel) -> list[Unknown]:
    """What the robot file states."""
    every = [u for term in range(len(model.terms)) for u in unknowns_of(model, term)]
    return [u for u in every if u.stated is not None and not u.fixed]


def _project(basis: np.ndarray, values: np.ndarray) -> np.ndarray:
    return basis @ (basis.T @ values)


def _is_little(missed: np.ndarray, signal: np.ndarray) -> bool:
    squares = float(missed @ missed)
    return squares < TWIN and squares < TWIN_SHARE * float(signal @ signal)


def _basis(part: np.ndarray) -> np.ndarray:
    """Orthonormal columns of those of ``part`` that show."""
    if not part.shape[1]:
        return part
    u, s, _ = np.linalg.svd(part, full_matrices=False)
    return u[:, s > max(SEEN, 1e-6 * s[0])]
