"""How far a prediction may be off: the intervals of the model's parameters and of the force, carried into the error.

A command is fixed and the true parameters differ by dp from those of the model: the tool's error moves by S dp, with

    S = d(tool, loaded)/dp - d(tool, unloaded)/dp         (the second part where the program's base contains it)

by central differences of the solved equilibrium, and its covariance is S C S^T (GUM, JCGM 100:2008, eq. 13).  This is
as true of the deflection before as of the residual after a correction: what the model does not know of the robot, the
correction leaves in.  A parameter is one and the same in all motions, so these errors do not average out over a
program; nor does the force's, which is taken as one scale common to all motions, or to all of an operation, as two
turns common to all motions and as one force added to all.

The largest error of a program exceeds that of any one motion more often than this motion alone does.  Its bound is
therefore a joint statement: sets of parameters are drawn, each goes through the sensitivities of all motions, and the
largest error of each set is compared with the predicted one (Monte Carlo propagation, JCGM 101:2008).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from statistics import NormalDist

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.cell import ForceVectorInterval
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.mirror import predict
from postproc.compensation.problem import CompensationProblem, rotate_wrench
from postproc.effects import Conditions
from postproc.model import NOTHING, StiffnessModel
from postproc.robot.description import COVERAGE

STEP = 0.1
"""Step of the differences, in standard deviations."""

FORCE = "force"
"""The scale of the wrenches, as a parameter."""

DIRECTION = "force_direction"
TURNS = ("turn_1", "turn_2")
"""Turns [rad] of the forces about two axes across them, as parameters of one name."""

COMPONENTS = ("force_fx", "force_fy", "force_fz")
"""A force [N] added to all others, along the axes of the programmed base."""

DRAWS, FIRST, SEED = 10_000, 500, 20240229
"""Sets of parameters drawn for the bound of the largest error: all, the first of them, and where they come from."""

MOST = 200
"""Motions that go through all draws."""

NUMBERS = 100_000
"""Numbers that go through the draws at once."""

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
class UncertainInput:
    """A figure that predictions depend on: ``name``; ``term`` of the model (-1: of the force); ``value`` and bounds
    (SI); standard ``deviation``, None where nothing states one."""

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
class InputUncertainties:
    """``entries``: figures with an interval, and their ``covariance`` (P, P); ``without_interval``: figures in use of
    which nothing is stated; ``level_unstated``: names of entries whose interval was taken for one of 95 %."""

    entries: tuple[UncertainInput, ...]
    covariance: Floats
    without_interval: tuple[UncertainInput, ...]
    level_unstated: tuple[str, ...]

    @property
    def lower_bound(self) -> bool:
        """Whether a total of the entries leaves something out."""
        return bool(self.without_interval)


def input_uncertainties(
    model: StiffnessModel,
    force_ci95: float | None = None,
    forced: bool = False,
    vector: ForceVectorInterval | None = None,
) -> InputUncertainties:
    """What is known of the figures that predictions of ``model`` depend on.

    ``force_ci95``: share of the force, 95 %; without it, and without components in ``vector``, a force that acts
    (``forced``) has no interval.  The model's
    covariance stands for what the robot file says of its parameters; others are taken as independent.  Raises
    ValueError where it has a name that the model does not have.
    """
    names, block = model.covariance or ((), np.zeros((0, 0)))
    known: list[UncertainInput] = []
    without: list[UncertainInput] = []
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
            entry = UncertainInput(
                name, index, parameter.name, value, parameter.lower, parameter.upper, deviation
            )
            if deviation is not None:
                known.append(entry)
            elif value != parameter.null:
                without.append(entry)
    has_components = vector is not None and vector.components is not None
    if force_ci95 is not None or (forced and not has_components):
        share = None if force_ci95 is None else force_ci95 / COVERAGE
        (without if share is None else known).append(
            UncertainInput(FORCE, -1, FORCE, 1.0, -np.inf, np.inf, share)
        )
    if vector is not None and forced:
        known += _vector_entries(vector)
    if set(names) - seen:
        raise ValueError(f"the covariance contains what the model does not have: {sorted(set(names) - seen)}")
    matrix = np.diag([entry.deviation or 0.0 for entry in known]) ** 2
    place = [[entry.name for entry in known].index(name) for name in names]
    matrix[np.ix_(place, place)] = block
    return InputUncertainties(tuple(known), matrix, tuple(without), tuple(unstated))


def _vector_entries(vector: ForceVectorInterval) -> list[UncertainInput]:
    """The turns and components of the force that have an interval."""
    turn = vector.direction / COVERAGE
    found = [UncertainInput(DIRECTION, -1, name, 0.0, -np.inf, np.inf, turn) for name in TURNS if turn > 0]
    if vector.components is not None:
        each = (vector.components / COVERAGE).tolist()
        found += [
            UncertainInput(name, -1, name, 0.0, -np.inf, np.inf, size)
            for name, size in zip(COMPONENTS, each, strict=True)
        ]
    return found


def _changed_wrench(entry: UncertainInput, value: float, wrench: Floats, axes: Floats | None) -> Floats:
    """The wrenches (N, 6) with one figure of the force at ``value``; ``axes`` (N, 3, 3): of the programmed base.

    A turn leaves the moment, which acts at the tool centre point, as it is.  Where no wrench acts none is added.
    """
    if entry.parameter == FORCE:
        return value * wrench
    assert axes is not None
    found = wrench.copy()
    if entry.parameter in TURNS:
        axis = _across(wrench[:, :3], axes)[TURNS.index(entry.parameter)]
        found[:, :3] = np.einsum("nij,nj->ni", rotation_from_vector(value * axis), wrench[:, :3])
    else:
        acts = wrench.any(axis=1)
        found[acts, :3] += value * axes[acts, :, COMPONENTS.index(entry.parameter)]
    return found


def _across(force: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (N, 3) across each force (N, 3) and each other, zero without a force.

    The second lies in the plane of the force and z of the programmed base ``axes`` (N, 3, 3), of x where the force
    points along z: a turn about it swings the force sideways, a turn about the first lifts it.
    """
    size = np.linalg.norm(force, axis=1, keepdims=True)
    unit = force / np.where(size > 0, size, 1.0)
    along_z = np.abs(np.sum(unit * axes[:, :, 2], axis=1)) > 0.99
    reference = np.where(along_z[:, None], axes[:, :, 0], axes[:, :, 2])
    second = reference - np.sum(reference * unit, axis=1, keepdims=True) * unit
    second = np.where(size > 0, second / np.linalg.norm(second, axis=1, keepdims=True), 0.0)
    return np.cross(unit, second), second


def sensitivities(
    model: StiffnessModel,
    entries: Sequence[UncertainInput],
    q: Floats,
    wrench: Floats,
    tool: Poses,
    conditions: Conditions = NOTHING,
    start: Floats | None = None,
    axes: Floats | None = None,
) -> Floats:
    """d(tool position)/d(figure) (N, 3, P) [m per SI unit] with the motors held at ``q`` (N, n) under ``wrench``
    (N, 6); ``start`` as of the equilibrium; ``axes`` (N, 3, 3) of the programmed base, for directions and components of
    the force.

    Central differences that stop at a parameter's bounds.  NaN where a stepped model has no equilibrium.
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
                acting = _changed_wrench(entry, value, wrench, axes)
                rest = model.equilibrium(q, acting, tool, conditions, start)
            else:
                stepped = model.with_values({(entry.term, entry.parameter): value})
                rest = stepped.equilibrium(q, wrench, tool, conditions, start)
            ends.append(np.where(rest.converged[:, None], rest.pose.position, np.nan))
        found[:, :, column] = (ends[1] - ends[0]) / (high - low)
    return found


def covariances(sensitivity: Floats, covariance: Floats) -> Floats:
    """S C S^T (N, 3, 3) [m^2] of S (N, 3, P) and C (P, P)."""
    return np.asarray(sensitivity @ covariance @ np.swapaxes(sensitivity, 1, 2))


def expanded_uncertainty(error: Floats, spread: Floats) -> Floats:
    """(N,) [m] half width of the 95 % interval of the length of ``error`` (N, 3) [m] with covariance ``spread`` (N, 3,
    3) [m2].

    Of an error that exceeds its uncertainty: along its own direction.  Elsewhere, as after a correction, the length
    that the deviation keeps below with 95 %.
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
    variance (Satterthwaite 1946; Welch 1947): g = sum lambda^2 / sum lambda, h = (sum lambda)^2 / sum lambda^2.  For
    one direction this is 1.96 sqrt(lambda), for three alike 2.80 sqrt(lambda): both exact, between them to about 1 %.
    """
    total, squares = np.trace(spread, axis1=1, axis2=2), (spread**2).sum(axis=(1, 2))
    found, some = 0.0 * total, squares > 0  # NaN where nothing is known
    total, squares = total[some], squares[some]
    found[some] = np.sqrt(squares / total * np.interp(total**2 / squares, *np.transpose(_CHI_SQUARE)))
    return found


def expanded_uncertainty_of_largest(error: Floats, sensitivity: Floats, covariance: Floats) -> float:
    """[m] by what the largest length of ``error`` (M, 3) [m] + S dp, over all motions, differs from that of ``error``
    in 95 % of all cases at most; S = ``sensitivity`` (M, 3, P), dp of ``covariance`` (P, P).  After a correction, where
    the predicted error is next to nothing, their sum is what the largest error stays below with 95 %.

    ``DRAWS`` sets dp, always the same ones, each principal axis sampled evenly (Latin hypercube): few tell a quantile
    that one or two axes dominate.  They go through the ``MOST`` motions that have the largest error most often in the
    first ``FIRST``.
    """
    values, vectors = np.linalg.eigh(covariance)
    rooted = sensitivity @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    # along the principal axes of what the parameters do to all motions: those that do nothing drop out
    weight, axes = np.linalg.eigh(np.einsum("nip,niq->pq", rooted, rooted))
    rooted = rooted @ axes[:, weight > 1e-8 * weight.max(initial=0.0)]
    if not rooted.shape[2]:
        return 0.0
    rng, normal = np.random.default_rng(SEED), NormalDist()
    even = np.array([normal.inv_cdf((i + 0.5) / DRAWS) for i in range(DRAWS)])
    drawn = np.stack([rng.permutation(even) for _ in range(rooted.shape[2])])
    first, _ = _largest(error, rooted, drawn[:, :FIRST])
    often = np.bincount(first, minlength=len(error))
    motions = np.sort(np.argsort(-often, kind="stable")[: min(MOST, np.count_nonzero(often))])
    _, size = _largest(error[motions], rooted[motions], drawn)
    return float(np.quantile(np.abs(size - np.linalg.norm(error, axis=1).max()), 0.95))


def _largest(error: Floats, rooted: Floats, drawn: Floats) -> tuple[Ints, Floats]:
    """Of every draw (P, D) of standard normal figures the motion (D,) with the largest error, and its size (D,) [m];
    ``error`` (M, 3), ``rooted`` (M, 3, P) what a standard deviation of each figure adds."""
    count = drawn.shape[1]
    motion, most = np.zeros(count, np.int64), np.full(count, -np.inf)
    each = max(1, NUMBERS // (3 * count))
    for start in range(0, len(error), each):
        part = slice(start, start + each)
        moved = (rooted[part].reshape(-1, len(drawn)) @ drawn).reshape(
            -1, 3, count
        )  # one product of matrices
        moved += error[part, :, None]
        moved *= moved
        square = moved.sum(axis=1)
        at = square.argmax(axis=0)
        size = square[at, np.arange(count)]
        motion = np.where(size > most, start + at, motion)
        most = np.maximum(most, size)
    return motion, np.sqrt(most)


def variance_shares(sensitivity: Floats, covariance: Floats) -> Floats:
    """(P,) share of each figure in the variance tr(S C S^T) of one motion, S = ``sensitivity`` (3, P), C =
    ``covariance`` (P, P); their sum is 1.

    With correlated figures: (C S^T S)_pp / tr, which can be negative.  Zeros where there is no variance.
    """
    parts = np.einsum("ip,pq,iq->p", sensitivity, covariance, sensitivity)
    total = float(parts.sum())
    return parts / total if total > 0 else np.zeros_like(parts)


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
        """Whether the intervals say nothing of the whole: there are none, or a tenth of what has none does more than
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
    forced = bool(task.wrench[rows].any())
    force = ForceUncertainty.of(task, rows, force_ci95)
    known = input_uncertainties(task.model, force.largest, forced, vector)
    if force.partly:
        lost = input_uncertainties(task.model, None, True).without_interval
        known = replace(known, without_interval=(*known.without_interval, lost[-1]))
    tenth = tuple((entry.name, np.nan) for entry in known.without_interval)
    told = Uncertainty(
        rows,
        len(known.entries),
        known.level_unstated,
        effect_of_10_percent=tenth,
        force_differs=force.differs,
    )
    if not len(rows):
        return told
    worst = int(np.nanargmax(result.before))
    place = np.array([worst])
    moved = error_sensitivities(task, known.without_interval, place, task.wanted[place])[1][0]
    length = np.linalg.norm(moved, axis=0) * [0.1 * abs(entry.value) for entry in known.without_interval]
    tenth = tuple(
        (known.without_interval[i].name, float(length[i])) for i in np.argsort(-length, kind="stable")
    )
    told = replace(told, worst=worst, effect_of_10_percent=tenth)
    if not known.entries:
        return told

    error, moves = error_sensitivities(task, known.entries, place, task.wanted[place])
    moves = force.scaled(moves, known.entries, place)
    before = expanded_uncertainty(error, covariances(moves, known.covariance))
    share = variance_shares(moves[0], known.covariance)
    blame = _by_name(known.entries, share)

    error, moves = error_sensitivities(task, known.entries, rows, result.command[rows], corrected=True)
    moves = force.scaled(moves, known.entries, rows)
    spread = covariances(moves, known.covariance)
    size = np.linalg.norm(error, axis=1)
    after = expanded_uncertainty(error, spread)
    upper = size + after
    sound = np.isfinite(upper)
    return replace(
        told,
        before=float(before[0]),
        after=expanded_uncertainty_of_largest(error[sound], moves[sound], known.covariance)
        if sound.any()
        else np.nan,
        expanded=np.stack([expanded_uncertainty(result.deflection[rows], spread), after], axis=1),
        budget=blame if share.any() else (),
        unstable=int((~sound).sum()),
    )


def _by_name(entries: Sequence[UncertainInput], share: Floats) -> tuple[tuple[str, float], ...]:
    """Names and shares (P,) of the variance, those of one name together, largest first."""
    summed: dict[str, float] = {}
    for entry, part in zip(entries, share.tolist(), strict=True):
        summed[entry.name] = summed.get(entry.name, 0.0) + part
    return tuple(sorted(summed.items(), key=lambda item: -item[1]))


@dataclass(frozen=True)
class ForceUncertainty:
    """The interval of the force as a share of it: ``largest`` of all motions, None where none has one; ``scale`` (N,):
    that of each motion over the largest, 0 where not known; ``partly``: it is not known of some that carry force;
    ``differs``: it is not the same in all that do."""

    largest: float | None
    scale: Floats
    partly: bool
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
        found = here[np.isfinite(here)]
        if not len(found):
            return ForceUncertainty(stated, np.ones(n), False, False)
        largest = float(found.max())
        scale = np.nan_to_num(each) / largest if largest > 0 else np.ones(n)
        return ForceUncertainty(largest, scale, len(found) < len(here), bool(found.min() < largest))

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


def error_sensitivities(
    task: CompensationProblem,
    entries: Sequence[UncertainInput],
    rows: Ints,
    command: Poses,
    corrected: bool = False,
) -> tuple[Floats, Floats]:
    """The error (N, 3) [m] of ``rows`` with the controller sent to ``command``, and its sensitivities S (N, 3, P);
    ``corrected`` as of ``CompensationProblem.given``."""
    model, tool, wrench = task.model, task.tool[rows], task.wrench[rows]
    wanted, placed = task.wanted[rows], task.robot_from_path(rows)
    axes = task.base[rows].rotation
    if placed is not None:
        command, wrench = placed @ command, rotate_wrench(placed, wrench)
        axes = placed.rotation @ axes
    given = task.given(rows, corrected=corrected)
    branch = (task.track.status[rows], task.track.q[rows])
    here = predict(model, command, tool, wrench, given, *branch)
    moves = sensitivities(model, entries, here.q, wrench, tool, given, here.displacement, axes)
    moves -= goal_sensitivities(task, entries, rows, wanted)
    goal = task.goal(rows, wanted)
    return here.pose.position - (goal if placed is None else placed @ goal).position, moves


def goal_sensitivities(
    task: CompensationProblem, entries: Sequence[UncertainInput], rows: Ints, wanted: Poses
) -> Floats:
    """d(goal position)/d(figure) (N, 3, P) of motions ``rows`` (N,) with targets ``wanted`` (N): a base that was
    touched off moves with what the robot does without load."""
    touched = task.touched_off
    found = np.zeros((len(rows), 3, len(entries)))
    if task.model.zero_without_load or (not task.process and touched is None):
        return found
    still = np.arange(len(rows))
    if touched is not None and not task.process:
        frame = task.toolpath.base[rows]
        still = np.flatnonzero(~touched.known[frame])
        none = np.zeros((len(touched.row), 6))
        places = sensitivities(
            task.model,
            entries,
            touched.real.q,
            none,
            touched.tool,
            touched.conditions,
            touched.real.displacement,
            task.base[touched.row].rotation,
        )
        found = touched.sensitivity(places, frame, wanted.position)
    if len(still):
        at, none = rows[still], np.zeros((len(still), 6))
        here, placed = task.unloaded(at, wanted[still]), task.robot_from_path(at)
        axes = task.base[at].rotation
        found[still] = sensitivities(
            task.model,
            entries,
            here.q,
            none,
            task.tool[at],
            task.between_sides(at),
            here.displacement,
            axes if placed is None else placed.rotation @ axes,
        )
    return found
