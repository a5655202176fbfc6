"""How far a prediction may be off: the intervals of the model's parameters and of the force, carried into the error.

A command is fixed and the true parameters differ by dp from those of the model: the tool's error moves by S dp, with

    S = d(tool, loaded)/dp - d(tool, unloaded)/dp         (the second part where the program's base contains it)

by central differences of the solved equilibrium (``input_sensitivities``), and its covariance is S C S^T (GUM, JCGM
100:2008, eq. 13; ``uncertainty_propagation``).  This is as true of the deflection before as of the residual after a
correction: what the model does not know of the robot, the correction does not remove.  A parameter is one and the same
in all motions, so these errors do not average out over a program; nor does the force's, which is taken as one scale
common to all motions, or to all of an operation, as two turns common to all motions and as one force added to all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.batches import in_spans, select_rows
from postproc.base.geometry import Poses, lengths
from postproc.cell import ForceVectorInterval
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.input_sensitivities import error_sensitivities
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.uncertain_inputs import (
    FORCE,
    UncertainInput,
    input_uncertainties,
)
from postproc.compensation.uncertainty_propagation import (
    covariances,
    expanded_uncertainty,
    expanded_uncertainty_of_largest,
    variance_shares,
)

WORST, EVEN = 500, 1500
"""Motions evaluated at most: those with the largest errors, and others evenly along the program."""


@dataclass(frozen=True)
class Uncertainty:
    """The uncertainty of one program's prediction.

    before, after [m]: half width of the 95 % interval of the largest error, before at the motion that has it, after of
    all motions together; NaN where nothing is known. rows (M,): motions evaluated; expanded (M, 2) [m]:
    ``expanded_uncertainty`` of the error there before and after. worst: row of the largest error before, -1 without
    any; there: ``budget`` (name, share of the variance), and ``effect_of_10_percent`` (name, [m] that 10 % of it would
    move the tool) of the figures without an interval, largest first. intervals: figures with one.  unstable: motions
    evaluated that have no equilibrium within the intervals; they are not in ``after``.  force_differs: the interval of
    the force is not the same share in all motions.
    """

    rows: Ints
    intervals: int
    level_unstated: tuple[str, ...]
    worst: int = -1
    before: float = np.nan
    after: float = np.nan
    expanded: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    budget: tuple[tuple[str, float], ...] = ()
    effect_of_10_percent: tuple[tuple[str, float], ...] = ()
    unstable: int = 0
    force_differs: bool = False

    @property
    def lower_bound(self) -> bool:
        """Whether something that the prediction depends on is not in the intervals."""
        return bool(self.effect_of_10_percent) or self.unstable > 0

    @property
    def unknown(self) -> bool:
        """Whether the intervals do not cover the whole: there are none, or a tenth of what has none does more than
        all of them."""
        return bool(np.isnan(self.before)) or any(
            length > self.before for _, length in self.effect_of_10_percent
        )


def evaluate_uncertainty(
    task: CompensationProblem,
    result: CorrectionResult,
    force_ci95: float | None = None,
    vector: ForceVectorInterval | None = None,
) -> Uncertainty:
    """The uncertainty of a prediction, and of what remains after its correction; ``InputUncertainties`` states what the
    others are.

    ``force_ci95``: share of the force, 95 %; without it what the source of the forces knows of each motion; ``vector``:
    intervals of its direction and components. Evaluated are all motions up to ``WORST + EVEN``; of more, those with the
    largest errors before and after and others evenly along the program: the cost of a program of a million motions is
    that of 2,000.
    """
    rows = select_motions(result)
    forced = bool(select_rows(task.wrench, rows).any())
    force = ForceUncertainty.of(task, rows, force_ci95)
    known = input_uncertainties(task.model, force.largest, forced, vector)
    if force.incomplete:
        lost = input_uncertainties(task.model, None, True).without_interval
        known = replace(known, without_interval=(*known.without_interval, lost[-1]))
    tenth = tuple((entry.name, np.nan) for entry in known.without_interval)
    uncertainty = Uncertainty(
        rows,
        len(known.entries),
        known.level_unstated,
        effect_of_10_percent=tenth,
        force_differs=force.differs,
    )
    if not len(rows):
        return uncertainty
    worst = int(np.nanargmax(result.before))
    place = np.array([worst])
    _, (moved,) = error_sensitivities(task, known.without_interval, place, task.wanted[place])
    length = np.linalg.norm(moved, axis=0) * [0.1 * abs(entry.value) for entry in known.without_interval]
    tenth = tuple(
        (known.without_interval[i].name, float(length[i])) for i in np.argsort(-length, kind="stable")
    )
    uncertainty = replace(uncertainty, worst=worst, effect_of_10_percent=tenth)
    if not known.entries:
        return uncertainty

    error, moves = error_sensitivities(task, known.entries, place, task.wanted[place])
    moves = force.scaled(moves, known.entries, place)
    before = expanded_uncertainty(error, covariances(moves, known.covariance))
    share = variance_shares(moves[0], known.covariance)
    budget = _by_name(known.entries, share)

    error, moves = _corrected_sensitivities(task, result, known.entries, rows)
    error = _with_rounded(result, rows, error)
    moves = force.scaled(moves, known.entries, rows)
    spread = covariances(moves, known.covariance)
    size = np.linalg.norm(error, axis=1)
    after = expanded_uncertainty(error, spread)
    upper = size + after
    sound = np.isfinite(upper)
    return replace(
        uncertainty,
        before=float(before[0]),
        after=expanded_uncertainty_of_largest(error[sound], moves[sound], known.covariance)
        if sound.any()
        else np.nan,
        expanded=np.stack(
            [expanded_uncertainty(select_rows(result.deflection, rows), spread), after], axis=1
        ),
        budget=budget if share.any() else (),
        unstable=int((~sound).sum()),
    )


def _corrected_sensitivities(
    task: CompensationProblem, result: CorrectionResult, entries: Sequence[UncertainInput], rows: Ints
) -> tuple[Floats, Floats]:
    """``error_sensitivities`` (K, 3), (K, 3, P) of ``rows`` (K,) as they are corrected."""

    def of_part(part: slice) -> tuple[Floats, Floats]:
        some = rows[part]
        return error_sensitivities(task, entries, some, _commands(task, result, some), corrected=True)

    error, moves = zip(*in_spans(of_part, rows), strict=True)
    return np.concatenate(error), np.concatenate(moves)


def _commands(task: CompensationProblem, result: CorrectionResult, rows: Ints) -> Poses:
    """Commands (K) with which the tool comes to the ends of the motions ``rows`` (K,), or nearest to them."""
    command = result.command[rows]
    at = np.flatnonzero(np.isin(rows, result.rounded))
    if len(at):
        some = rows[at]
        wanted = task.wanted[some]
        command = command.copy()
        command.put(at, task.command(some, wanted, task.wrench[some], task.goal(some, wanted)).command)
    return command


def _with_rounded(result: CorrectionResult, rows: Ints, error: Floats) -> Floats:
    """``error`` (K, 3) [m] with what remains at fitted corners, in the direction in which most is uncertain."""
    at = np.flatnonzero(np.isin(rows, result.rounded))
    error = error.copy()
    direction = result.deflection[rows[at]]
    error[at] = direction * (result.after[rows[at]] / np.maximum(lengths(direction), 1e-12))[:, None]
    return error


def _by_name(entries: Sequence[UncertainInput], share: Floats) -> tuple[tuple[str, float], ...]:
    """Names and shares (P,) of the variance, those of one name together, largest first."""
    summed: dict[str, float] = {}
    for entry, part in zip(entries, share.tolist(), strict=True):
        summed[entry.name] = summed.get(entry.name, 0.0) + part
    return tuple(sorted(summed.items(), key=lambda item: -item[1]))


@dataclass(frozen=True)
class ForceUncertainty:
    """The interval of the force as a share of it: ``largest`` of all motions, None where none has one; ``scale`` (N,):
    that of each motion over the largest, 0 where not known; ``incomplete``: it is not known of some that carry force;
    ``differs``: it is not the same in all that do."""

    largest: float | None
    scale: Floats
    incomplete: bool
    differs: bool

    @staticmethod
    def of(task: CompensationProblem, rows: Ints, stated: float | None) -> ForceUncertainty:
        """Of the motions ``rows`` (K,) at which something is predicted; ``stated``: the share of an interval that holds
        for all."""
        n = len(task.wrench)
        each = np.full(n, np.nan) if task.force.ci95 is None else task.force.ci95
        if stated is not None:
            each = np.full(n, stated)
        here = each[rows[task.carries[rows]]]
        known = here[np.isfinite(here)]
        if not len(known):
            return ForceUncertainty(stated, np.ones(n), False, False)
        largest = float(known.max())
        scale = np.nan_to_num(each) / largest if largest > 0 else np.ones(n)
        return ForceUncertainty(largest, scale, len(known) < len(here), bool(known.min() < largest))

    def scaled(self, moves: Floats, entries: Sequence[UncertainInput], rows: Ints) -> Floats:
        """Sensitivities (M, 3, P), ``moves`` (M, 3, P) of ``rows`` (M,), in which the force's counts with the interval
        of each motion."""
        weight = np.ones((len(rows), len(entries)))
        for column, entry in enumerate(entries):
            if entry.name == FORCE:
                weight[:, column] = self.scale[rows]
        return moves * weight[:, None]


def select_motions(result: CorrectionResult) -> Ints:
    """Rows (M,) at which something is predicted; of many, the worst and a choice."""
    rows = np.flatnonzero(np.isfinite(result.before) & np.isfinite(result.after))
    if len(rows) <= WORST + EVEN:
        return rows
    half = WORST // 2
    chosen = [np.argpartition(-error[rows], half)[:half] for error in (result.before, result.after)]
    chosen.append(np.linspace(0, len(rows) - 1, EVEN).round().astype(np.int64))
    return np.asarray(rows[np.unique(np.concatenate(chosen))])
