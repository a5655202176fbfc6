"""How far a prediction may be off: the intervals of the model's parameters and of the force, carried into the error.

A command is fixed and the true parameters differ by dp from those of the model: the tool's error moves by S dp, with

    S = d(tool, loaded)/dp - d(tool, unloaded)/dp         (the second part where the program's base contains it)

by central differences of the solved equilibrium, and its covariance is S C S^T (GUM, JCGM 100:2008, eq. 13).  This is
as true of the deflection before as of the residual after a correction: what the model does not know of the robot, the
correction leaves in.  A parameter is one and the same in all motions, so these errors do not average out over a
program; nor does the force's, which is taken as one scale common to all motions, or to all of an operation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.arrays import Floats, Ints
from postproc.compensation.correct import Result
from postproc.compensation.mirror import predict
from postproc.compensation.task import Task
from postproc.effects import Conditions
from postproc.geometry import Poses
from postproc.model import NOTHING, StiffnessModel
from postproc.robot.description import COVERAGE

STEP = 0.1
"""Step of the differences, in standard deviations."""

FORCE = "force"
"""The scale of the wrenches, as a parameter."""

WORST, EVEN = 500, 1500
"""Motions evaluated at most: those with the largest errors, and others evenly along the program."""

_CHI_SQUARE = (
    (1.0, 3.84146),
    (1.25, 4.43224),
    (1.5, 4.98020),
    (2.0, 5.99146),
    (2.5, 6.92808),
    (3.0, 7.81473),
)
"""95 % quantile of chi-square by degrees of freedom."""


@dataclass(frozen=True)
class Unsure:
    """A figure that predictions hang on: ``name``; ``term`` of the model (-1: the force); ``value`` and bounds (SI);
    standard ``deviation``, None where nothing states one."""

    name: str
    term: int
    parameter: str
    value: float
    lower: float
    upper: float
    deviation: float | None

    @property
    def step(self) -> float:
        """For differences: a share of the standard deviation, of the value where there is none."""
        return STEP * (0.1 * abs(self.value) if self.deviation is None else self.deviation)


@dataclass(frozen=True)
class Spreads:
    """``entries``: figures with an interval, and their ``covariance`` (P, P); ``without_interval``: figures in use of
    which nothing is stated; ``level_unstated``: names of entries whose interval was taken for one of 95 %."""

    entries: tuple[Unsure, ...]
    covariance: Floats
    without_interval: tuple[Unsure, ...]
    level_unstated: tuple[str, ...]

    @property
    def lower_bound(self) -> bool:
        """Whether a total of the entries leaves something out."""
        return bool(self.without_interval)


def spreads(model: StiffnessModel, force_ci95: float | None = None, forced: bool = False) -> Spreads:
    """What is known of the figures that predictions of ``model`` hang on.

    ``force_ci95``: share of the force, 95 %; without it a force that acts (``forced``) has no interval.  The model's
    covariance stands for what the robot file says of its parameters; others are taken as independent.  Raises
    ValueError where it has a name that the model does not have.
    """
    names, block = model.covariance or ((), np.zeros((0, 0)))
    known: list[Unsure] = []
    without: list[Unsure] = []
    unstated: list[str] = []
    seen: set[str] = set()
    for index, term in enumerate(model.terms):
        label = model.label(index)
        for parameter in term.effect.parameters:
            name, value = f"{label}.{parameter.name}", float(term.values[parameter.name])
            stated = term.stated.get(parameter.name)
            deviation = None
            if name in names:
                at = names.index(name)
                deviation = float(np.sqrt(block[at, at]))
            elif stated is not None and stated.interval is not None:
                deviation = stated.deviation
                if stated.level is None:
                    unstated.append(name)
            seen.add(name)
            entry = Unsure(name, index, parameter.name, value, parameter.lower, parameter.upper, deviation)
            if deviation is not None:
                known.append(entry)
            elif value != parameter.null:
                without.append(entry)
    if forced or force_ci95 is not None:
        share = None if force_ci95 is None else force_ci95 / COVERAGE
        (without if share is None else known).append(Unsure(FORCE, -1, FORCE, 1.0, -np.inf, np.inf, share))
    if set(names) - seen:
        raise ValueError(f"covariance of what the model does not have: {sorted(set(names) - seen)}")
    matrix = np.diag([entry.deviation or 0.0 for entry in known]) ** 2
    place = [[entry.name for entry in known].index(name) for name in names]
    matrix[np.ix_(place, place)] = block
    return Spreads(tuple(known), matrix, tuple(without), tuple(unstated))


def sensitivities(
    model: StiffnessModel,
    entries: Sequence[Unsure],
    q: Floats,
    wrench: Floats,
    tool: Poses,
    conditions: Conditions = NOTHING,
    start: Floats | None = None,
) -> Floats:
    """d(tool position)/d(figure) (N, 3, P) [m per SI unit] with the motors held at ``q`` (N, n) under ``wrench``
    (N, 6); ``start`` as of the equilibrium.

    Central differences that stop at a parameter's bounds.  NaN where a stepped model has no stable rest.
    """
    found = np.zeros((len(q), 3, len(entries)))
    for column, entry in enumerate(entries):
        low = max(entry.value - entry.step, entry.lower)
        high = min(entry.value + entry.step, entry.upper)
        if not low < high:
            continue
        ends = []
        for value in (low, high):
            if entry.term < 0:
                rest = model.equilibrium(q, value * wrench, tool, conditions, start)
            else:
                stepped = model.changed({(entry.term, entry.parameter): value})
                rest = stepped.equilibrium(q, wrench, tool, conditions, start)
            ends.append(np.where(rest.converged[:, None], rest.pose.position, np.nan))
        found[:, :, column] = (ends[1] - ends[0]) / (high - low)
    return found


def covariances(sensitivity: Floats, covariance: Floats) -> Floats:
    """S C S^T (N, 3, 3) [m^2] of S (N, 3, P) and C (P, P)."""
    return np.asarray(sensitivity @ covariance @ np.swapaxes(sensitivity, 1, 2))


def half_widths(error: Floats, spread: Floats) -> Floats:
    """(N,) [m] half width of the 95 % interval of the length of ``error`` (N, 3) [m] with covariance ``spread``.

    Of an error that stands clear of its doubt: along its own direction.  Elsewhere, as after a correction, the
    length that the deviation keeps below with 95 %.
    """
    size, found = np.linalg.norm(error, axis=1), length_quantile(spread)
    clear = size > found
    unit = error[clear] / size[clear, None]
    along = np.einsum("ni,nij,nj->n", unit, spread[clear], unit)
    found[clear] = COVERAGE * np.sqrt(np.maximum(along, 0.0))
    return found


def length_quantile(spread: Floats) -> Floats:
    """(N,) [m] 95 % quantile of the length of a deviation with covariance (N, 3, 3).

    Its square is a sum of lambda_i chi-square_1, lambda the eigenvalues, taken for g chi-square_h of the same mean and
    variance (Welch and Satterthwaite): g = sum lambda^2 / sum lambda, h = (sum lambda)^2 / sum lambda^2.  For one
    direction this is 1.96 sqrt(lambda), for three alike 2.80 sqrt(lambda): both exact, between them to about 1 %.
    """
    total, squares = np.trace(spread, axis1=1, axis2=2), (spread**2).sum(axis=(1, 2))
    found, some = 0.0 * total, squares > 0  # NaN where nothing is known
    total, squares = total[some], squares[some]
    found[some] = np.sqrt(squares / total * np.interp(total**2 / squares, *np.transpose(_CHI_SQUARE)))
    return found


def shares(sensitivity: Floats, covariance: Floats) -> Floats:
    """(P,) share of each figure in the variance tr(S C S^T) of one motion, S (3, P); their sum is 1.

    With correlated figures: (C S^T S)_pp / tr, which can be negative.  Zeros where there is no variance.
    """
    parts = np.einsum("ip,pq,iq->p", sensitivity, covariance, sensitivity)
    total = float(parts.sum())
    return parts / total if total > 0 else np.zeros_like(parts)


@dataclass(frozen=True)
class Doubt:
    """The doubt of one program's prediction.

    before, after [m]: half width of the 95 % interval of the largest error; NaN where nothing is known.
    rows (M,): motions evaluated; widths (M, 2) [m]: ``half_widths`` of the error there before and after.
    worst: row of the largest error before, -1 without any; there: ``blame`` (name, share of the variance), and
    ``tenth`` (name, [m] that 10 % of it would move the tool) of the figures without an interval, largest first.
    intervals: figures with one.  unstable: motions evaluated that have no stable rest within the intervals; they are
    not in ``after``.  force_differs: the interval of the force is not the same share in all motions.
    """

    rows: Ints
    intervals: int
    level_unstated: tuple[str, ...]
    worst: int = -1
    before: float = np.nan
    after: float = np.nan
    widths: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    blame: tuple[tuple[str, float], ...] = ()
    tenth: tuple[tuple[str, float], ...] = ()
    unstable: int = 0
    force_differs: bool = False

    @property
    def lower_bound(self) -> bool:
        """Whether something that the prediction hangs on is not in the intervals."""
        return bool(self.tenth) or self.unstable > 0


def doubt_of(task: Task, result: Result, force_ci95: float | None = None) -> Doubt:
    """The doubt of a prediction, and of what remains after its correction; ``spreads`` says what the others are.

    ``force_ci95``: share of the force, 95 %; without it what the source of the forces knows of each motion.
    Evaluated are all motions up to ``WORST + EVEN``; of more, those with the largest errors before and after and
    others evenly along the program: the cost of a program of a million motions is that of 2,000.
    """
    rows = _evaluated(result)
    forced = bool(task.wrench[rows].any())
    force = _ForceShare.of(task, rows, force_ci95)
    known = spreads(task.model, force.largest, forced)
    if force.partly:
        lost = spreads(task.model, None, True).without_interval
        known = replace(known, without_interval=(*known.without_interval, lost[-1]))
    tenth = tuple((entry.name, np.nan) for entry in known.without_interval)
    told = Doubt(rows, len(known.entries), known.level_unstated, tenth=tenth, force_differs=force.differs)
    if not len(rows):
        return told
    worst = int(np.nanargmax(result.before))
    place = np.array([worst])
    moved = _errors(task, known.without_interval, place, task.wanted[place])[1][0]
    length = np.linalg.norm(moved, axis=0) * [0.1 * abs(entry.value) for entry in known.without_interval]
    tenth = tuple(
        (known.without_interval[i].name, float(length[i])) for i in np.argsort(-length, kind="stable")
    )
    told = replace(told, worst=worst, tenth=tenth)
    if not known.entries:
        return told

    error, moves = _errors(task, known.entries, place, task.wanted[place])
    moves = force.scaled(moves, known.entries, place)
    before = half_widths(error, covariances(moves, known.covariance))
    share = shares(moves[0], known.covariance)
    blame = tuple((known.entries[i].name, float(share[i])) for i in np.argsort(-share, kind="stable"))

    error, moves = _errors(task, known.entries, rows, result.command[rows])
    moves = force.scaled(moves, known.entries, rows)
    spread = covariances(moves, known.covariance)
    size = np.linalg.norm(error, axis=1)
    after = half_widths(error, spread)
    upper = size + after
    sound = np.isfinite(upper)
    return replace(
        told,
        before=float(before[0]),
        after=float(upper[sound].max() - size[sound].max()) if sound.any() else np.nan,
        widths=np.stack([half_widths(result.deflection[rows], spread), after], axis=1),
        blame=blame if share.any() else (),
        unstable=int((~sound).sum()),
    )


@dataclass(frozen=True)
class _ForceShare:
    """The interval of the force as a share of it: ``largest`` of all motions, None where none has one; ``scale`` (N,):
    that of each motion over the largest, 0 where not known; ``partly``: it is not known of some that carry force;
    ``differs``: it is not the same in all that do."""

    largest: float | None
    scale: Floats
    partly: bool
    differs: bool

    @staticmethod
    def of(task: Task, rows: Ints, stated: float | None) -> _ForceShare:
        n = len(task.wrench)
        each = np.full(n, np.nan) if task.force.ci95 is None else task.force.ci95
        if stated is not None:
            each = np.full(n, stated)
        here = each[rows[task.carries[rows]]]
        found = here[np.isfinite(here)]
        if not len(found):
            return _ForceShare(stated, np.ones(n), False, False)
        largest = float(found.max())
        scale = np.nan_to_num(each) / largest if largest > 0 else np.ones(n)
        return _ForceShare(largest, scale, len(found) < len(here), bool(found.min() < largest))

    def scaled(self, moves: Floats, entries: Sequence[Unsure], rows: Ints) -> Floats:
        """Sensitivities (M, 3, P) of ``rows`` in which the force's counts with the interval of each motion."""
        weight = np.ones((len(rows), len(entries)))
        for column, entry in enumerate(entries):
            if entry.term < 0:
                weight[:, column] = self.scale[rows]
        return moves * weight[:, None]


def _evaluated(result: Result) -> Ints:
    """Rows at which something is predicted; of many, the worst and a choice."""
    rows = np.flatnonzero(np.isfinite(result.before) & np.isfinite(result.after))
    if len(rows) <= WORST + EVEN:
        return rows
    half = WORST // 2
    chosen = [np.argpartition(-error[rows], half)[:half] for error in (result.before, result.after)]
    chosen.append(np.linspace(0, len(rows) - 1, EVEN).round().astype(np.int64))
    return np.asarray(rows[np.unique(np.concatenate(chosen))])


def _errors(task: Task, entries: Sequence[Unsure], rows: Ints, command: Poses) -> tuple[Floats, Floats]:
    """The error (N, 3) [m] of ``rows`` with the controller sent to ``command``, and its sensitivities S (N, 3, P)."""
    model, tool, wrench = task.model, task.tool[rows], task.wrench[rows]
    given = task.conditions.part(rows)
    branch = (task.track.status[rows], task.track.q[rows])
    here = predict(model, command, tool, wrench, given, *branch)
    moves = sensitivities(model, entries, here.q, wrench, tool, given, here.displacement)
    if not task.process:
        return here.pose.position - task.wanted.position[rows], moves
    none = np.zeros_like(wrench)
    still = predict(model, task.wanted[rows], tool, none, given, *branch)
    moves -= sensitivities(model, entries, still.q, none, tool, given, still.displacement)
    return here.pose.position - still.pose.position, moves
