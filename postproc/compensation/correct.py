"""From wanted motions to corrected commands: what is in scope, what must stay, and by how much the rest moves."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block, in_blocks
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Placed, PoseRows, Poses, lengths, product, rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.compensation.cuts import (
    feed_motions,
    number_cuts,
    spread_over_cuts,
    switch_findings,
    uncorrected_findings,
)
from postproc.compensation.mirror import Correction, pose_error
from postproc.compensation.problem import CompensationProblem
from postproc.robot.axis_track import is_near_singular, singular_words
from postproc.robot.makers import maker_of
from postproc.robot.stated_branches import stated_changes
from postproc.toolpath import Kind


class MotionOutcome(IntEnum):
    AIR = 0  # nothing to correct
    CORRECTED = 1
    UNCORRECTED = 2  # could not be corrected, reported
    OFF = 3  # switched off by the program (COMPENSATE OFF)
    LEAD_IN = 4  # in air, and ends where the cut after it starts corrected


@dataclass(frozen=True)
class CorrectionResult:
    """state (N,) State; cut (N,), -1 in air; command (N): TCP commands in the robot base; correction (N, 3) [m]: their
    place minus the wanted one, 0 where nothing is corrected; turn (N, 3) [rad]: by how much they are
    meant to be turned, NaN after the writing; before, after (N,) [m] predicted position error, NaN where
    nothing is predicted, and before_angle, after_angle (N,) [rad]; deflection (N, 3) [m] before; iterations (N,);
    history (K + 1, N) [m]; findings.  across_after (N,) [m]: the part of the error after across the feed, known after
    the writing.  rounded (R,): rows that end in a point of a fitted corner, where the tool never is: their errors after
    are those of the rounded path."""

    state: Ints
    cut: Ints
    command: Placed
    correction: Floats
    turn: Floats
    deflection: Floats
    before: Floats
    before_angle: Floats
    after: Floats
    after_angle: Floats
    iterations: Ints
    history: Floats
    findings: tuple[Finding, ...]
    across_after: Floats = field(default_factory=lambda: np.empty(0))
    rounded: Ints = field(default_factory=lambda: np.empty(0, np.int64))

    @property
    def scope(self) -> Bools:
        """(N,) motions of cuts, corrected or not."""
        return np.asarray(self.cut >= 0)

    @property
    def corrected(self) -> Bools:
        """(N,) the motion is corrected."""
        return np.asarray(self.state == MotionOutcome.CORRECTED)


def correct(task: CompensationProblem) -> CorrectionResult:
    """Correct every motion that can be.

    Raises Refusal: a cutting pose out of reach (KIN001), a configuration that nothing states (KIN004), a correction
    larger than the cell allows (COR002).
    """
    path, track, n = task.toolpath, task.track, len(task.toolpath)
    cartesian = path.known & ~path.on_axes
    forced = task.carries
    scope = forced if task.process else forced | cartesian
    # In air every motion is corrected by itself; a cut is corrected as a whole or not at all.
    cut = (
        number_cuts(scope, path.continues)
        if task.process
        else np.where(scope, np.cumsum(scope & ~(forced & _shifted(forced))) - 1, -1)
    )
    on = feed_motions(path)
    findings = switch_findings(task.file, path)
    why = _uncorrectable(task, scope, scope & on, findings)
    off = scope & ~on
    for row in np.flatnonzero(on & scope & spread_over_cuts(off, cut)):
        why.setdefault(int(row), _at(task, int(row), "COR004", "COMPENSATE is switched inside this cut"))

    # What the force does, everywhere it can be predicted; the correction, where it may be made.
    predictable = np.flatnonzero(scope & cartesian & (track.branch >= 0) & track.reachable)
    may = on & ~spread_over_cuts(_in(why, n), cut) & task.deflects
    corrections = _Findings(n)
    for block in in_blocks(
        lambda part: _correct_block(task, predictable[part], may[predictable[part]]), len(predictable)
    ):
        corrections.put(block)
    corrections.judged(task, why, findings)
    keeps = corrections.tried & ~spread_over_cuts(_in(why, n), cut)

    shift, turn = task.gain * corrections.shift, task.gain * corrections.turn
    shift[~keeps], turn[~keeps] = 0.0, 0.0
    size = lengths(shift)
    _refuse(
        task,
        size > task.max_correction,
        "COR002",
        f"the correction is {size.max(initial=0.0) / MM:.2f} mm,"
        f" which exceeds max_correction ({task.max_correction / MM:g} mm)",
        "check force, base and tool; raise max_correction in the cell if the correction is intended",
    )

    state = np.full(n, MotionOutcome.AIR, np.int8)
    state[scope] = MotionOutcome.UNCORRECTED if task.deflects else MotionOutcome.AIR
    state[off] = MotionOutcome.OFF
    state[keeps] = MotionOutcome.CORRECTED
    findings += uncorrected_findings(task.file, path, cut, why)
    corrections.warn_quadrants(task, keeps, findings)
    _warn_singular(task, predictable[forced[predictable]], findings)
    moved = np.flatnonzero(keeps)
    after, after_angle = corrections.before.copy(), corrections.before_angle.copy()
    after[moved], after_angle[moved] = corrections.error[moved], corrections.angle[moved]
    result = CorrectionResult(
        state,
        cut,
        PoseRows(n, lambda rows: _moved(task.wanted[rows], shift[rows], turn[rows])).remembered(),
        shift,
        turn,
        corrections.deflection,
        corrections.before,
        corrections.before_angle,
        after,
        after_angle,
        corrections.iterations,
        corrections.history,
        tuple(findings),
    )
    # What the mirror found holds for the whole correction.
    return result if task.gain == 1.0 else with_residual(task, result, result.command)


def as_air(result: CorrectionResult, rows: Ints) -> CorrectionResult:
    """The result with the motions ``rows`` (K,) in air, of which nothing is predicted: what they end at is the start of
    a cut, and they are not corrected for an end of their own."""
    if not len(rows):
        return result

    def with_rows(values: np.ndarray, value: float) -> np.ndarray:
        changed = np.array(values)
        changed[rows] = value
        return changed

    return replace(
        result,
        state=with_rows(result.state, MotionOutcome.AIR),
        cut=with_rows(result.cut, -1),
        correction=with_rows(result.correction, 0.0),
        turn=with_rows(result.turn, 0.0),
        deflection=with_rows(result.deflection, np.nan),
        before=with_rows(result.before, np.nan),
        before_angle=with_rows(result.before_angle, np.nan),
        after=with_rows(result.after, np.nan),
        after_angle=with_rows(result.after_angle, np.nan),
    )


def _moved(wanted: Poses, shift: Floats, turn: Floats) -> Poses:
    """``wanted`` (K), shifted by (K, 3) [m] and turned by (K, 3) [rad] in place."""
    return Poses(product(rotation_from_vector(turn), wanted.rotation), wanted.position + shift)


def with_residual(task: CompensationProblem, result: CorrectionResult, command: Placed) -> CorrectionResult:
    """The result with its residual predicted for ``command``, the poses as they were really written."""
    rows = np.flatnonzero(result.corrected)
    after, after_angle = result.before.copy(), result.before_angle.copy()
    correction = result.correction.copy()
    beside = np.full(len(result.state), np.nan, np.float32)

    def predicted(part: slice) -> None:
        at = rows[part]
        there, wanted = command[at], task.wanted[at]
        here = task.simulated(at, there, task.wrench[at], corrected=True)
        shift, turn = task.visible_errors(at, here.pose, task.goal(at, wanted))
        after[at] = np.where(here.reachable & here.settled, lengths(shift), np.inf)
        after_angle[at] = lengths(turn)
        ahead = np.sum(shift * task.desired_path.tangent(at, np.ones(len(at))), axis=1)
        beside[at] = np.sqrt(np.maximum(np.einsum("ni,ni->n", shift, shift) - ahead**2, 0.0))
        correction[at] = there.position - wanted.position

    each_block(predicted, len(rows))
    return replace(
        result,
        command=command,
        correction=correction,
        after=after,
        after_angle=after_angle,
        across_after=np.asarray(beside),
    )


class _CorrectedBlock(NamedTuple):
    """What a block of motions is found to do.  rows (K,): all that were predicted, with deflection (K, 3) [m], before
    (K,) [m] and before_angle [rad]; tried (T,): those of them that were corrected, by shift (T, 3) [m] and turn (T, 3)
    [rad]; angle (T,) [rad]: what then shows on the part; crossed (T,): to where the stated configuration means another
    full turn; other_quadrant (T,): than stated; beyond (T,): the limits of an axis."""

    rows: Ints
    deflection: Floats
    before: Floats
    before_angle: Floats
    tried: Ints
    shift: Floats
    turn: Floats
    done: Correction
    angle: Floats
    crossed: Bools
    other_quadrant: Bools
    beyond: Bools


def _correct_block(task: CompensationProblem, rows: Ints, may: Bools) -> _CorrectedBlock:
    """Predict the motions ``rows`` (K,), and correct those that ``may`` (K,) be."""
    wanted, wrench = task.wanted[rows], task.wrench[rows]
    goal = task.goal(rows, wanted)
    q = task.track.q[rows]
    start, displacement = task.start_command(rows, wanted, wrench, goal, q if goal is wanted else None)
    here = task.simulated(rows, wanted, wrench, displacement, q)
    shift, turn = task.visible_errors(rows, here.pose, goal)
    shift[~here.settled], turn[~here.settled] = np.nan, np.nan
    tried, wanted = rows[may], wanted[may]
    done = task.command(tried, wanted, wrench[may], goal[may], (start[may], displacement[may]))
    path, robot = task.toolpath, task.model.robot
    low, high = robot.limits.T
    crossed = other_quadrant = path.configuration.stated[tried]
    if crossed.any():
        sides = stated_changes(robot, path.configuration.of(tried), task.track.q[tried], done.q)
        crossed, other_quadrant = sides.crossed & (path.kind[tried] == Kind.PTP), sides.other_quadrant
    return _CorrectedBlock(
        rows,
        shift,
        lengths(shift),
        lengths(turn),
        tried,
        *pose_error(done.command, wanted),
        done,
        lengths(task.visible_turn(tried, goal[may], done.turn)),
        crossed,
        other_quadrant,
        ((done.q < low) | (done.q > high)).any(axis=1),
    )


class _Findings:
    """What was found of all N motions, as in ``CorrectionResult``; shift, turn (N, 3): whole corrections; tried (N,):
    those that were corrected."""

    def __init__(self, n: int) -> None:
        self.tried = np.zeros(n, bool)
        self.deflection = np.full((n, 3), np.nan)
        self.before, self.before_angle = np.full(n, np.nan), np.full(n, np.nan)
        self.shift, self.turn = np.zeros((n, 3)), np.zeros((n, 3))
        self.error, self.angle = np.full(n, np.nan), np.full(n, np.nan)
        self.iterations = np.zeros(n, np.int8)
        self.history = np.full((1, n), np.nan)
        self.failed: dict[str, list[Ints]] = {}
        self.other_quadrant: list[int] = []
        self.axes: Floats = np.empty((0, 0))

    def put(self, block: _CorrectedBlock) -> None:
        """Takes what was found of a block."""
        rows, tried, done = block.rows, block.tried, block.done
        self.deflection[rows], self.before[rows] = block.deflection, block.before
        self.before_angle[rows] = block.before_angle
        self.tried[tried] = True
        self.shift[tried], self.turn[tried] = block.shift, block.turn
        self.error[tried], self.angle[tried] = done.error, block.angle
        # What the mirror starts with is a first step from the wanted pose.
        self.iterations[tried] = done.iterations + 1
        more = len(done.history) + 1 - len(self.history)
        if more > 0:
            self.history = np.concatenate([self.history, np.full((more, self.history.shape[1]), np.nan)])
        self.history[0, tried] = self.before[tried]
        self.history[1 : len(done.history) + 1, tried] = done.history
        self.other_quadrant += tried[block.other_quadrant].tolist()
        beyond = block.beyond & done.converged  # what is not is reported as that
        for code, failed in (
            ("COR009", ~done.reachable),
            ("MOD002", ~done.settled),
            ("COR001", ~done.converged),
            ("COR008", beyond),
            ("KIN006", block.crossed & done.converged),
        ):
            self.failed.setdefault(code, []).append(tried[failed])
        if not len(self.axes):
            self.axes = done.q[beyond][:1]

    def judged(self, task: CompensationProblem, why: dict[int, Finding], findings: list[Finding]) -> None:
        """Notes why motions that were tried cannot be corrected after all."""
        words = {
            "COR009": "the corrected pose is out of reach",
            "MOD002": "the robot has no equilibrium under this force",
            "COR001": "the correction does not converge",
            "COR008": "the corrected pose exceeds the limits: "
            + (_axis_beyond(task, self.axes[0]) if len(self.axes) else ""),
            "KIN006": maker_of(task.toolpath.configuration).mismatch_message,
        }
        for code, parts in self.failed.items():
            rows = np.concatenate(parts)
            _note(task, why, findings, rows[~_in(why, len(self.before))[rows]], code, words[code])

    def warn_quadrants(self, task: CompensationProblem, keeps: Bools, findings: list[Finding]) -> None:
        """Quadrants are verbatim in the text: the axes of the corrected pose should still be in them."""
        rows = np.array([row for row in self.other_quadrant if keeps[row]], np.int64)
        if len(rows):
            message = maker_of(task.toolpath.configuration).quadrant_message
            findings.append(_at(task, int(rows[0]), "KIN013", message + _further_findings(task, rows)))


def _uncorrectable(
    task: CompensationProblem, scope: Bools, tried: Bools, findings: list[Finding]
) -> dict[int, Finding]:
    """Motions that cannot be corrected as they are programmed, and why; Refusal where the input must be wrong."""
    path, track, n = task.toolpath, task.track, len(task.toolpath)
    cartesian = path.known & ~path.on_axes
    lost = np.flatnonzero(tried & ~cartesian)
    unknown = _at(task, int(lost[0]), "COR003", "its target is not known") if len(lost) else None
    why = {row: unknown for row in lost.tolist() if unknown}
    for stops in (path.constraints.locked, path.constraints.refused):
        why.update({row: stop for row, stop in stops.items() if tried[row]})
    if task.force.undirected is not None:
        message = "the force is in the feed frame, and several motions may precede this one: where it comes from varies"
        for row in np.flatnonzero(tried & task.force.undirected).tolist():
            why.setdefault(row, _at(task, row, "FRC005", message))
    free = tried & cartesian & ~_in(why, n)
    # what no state before it settles on every path is no mistake of the cell
    late = np.maximum.accumulate(~path.continues) & free & (track.branch < 0)
    message = "the robot's configuration differs with the path of the program that leads here"
    _note(task, why, findings, np.flatnonzero(late), "KIN004", message)
    free &= ~late
    _refuse(
        task,
        free & (track.branch < 0),
        "KIN004",
        "the robot's configuration is not known here",
        "add `start:` (axes before the first motion) to the cell, or state S and T in the PTP before it",
    )
    _refuse(
        task,
        free & task.carries & ~track.reachable,
        "KIN001",
        "the programmed pose is out of reach",
        "check the base, the tool and the robot of the cell against the program",
    )
    beyond = track.reachable & ~track.within
    mask = free & beyond
    _note(task, why, findings, np.flatnonzero(mask), "KIN002", _which_axis(task, mask))
    rows = np.flatnonzero(free & ~track.reachable)
    _note(task, why, findings, rows, "KIN005", "the programmed pose is out of reach")
    rows = np.flatnonzero(path.known & ~scope & ~track.reachable)
    _note(task, {}, findings, rows, "KIN005", "the programmed pose is out of reach")
    mask = ~scope & beyond
    _note(task, {}, findings, np.flatnonzero(mask), "KIN005", _which_axis(task, mask))
    return why


def _which_axis(task: CompensationProblem, mask: Bools) -> str:
    """The axis that is farthest beyond its limits at the first motion of ``mask``, in words."""
    return _axis_beyond(task, task.track.q[np.argmax(mask)]) if mask.any() else ""


def _axis_beyond(task: CompensationProblem, q: Floats) -> str:
    """The axis of ``q`` (n,) that is farthest beyond its limits, in words."""
    low, high = task.model.robot.limits.T
    axis = int(np.argmax(np.maximum(low - q, q - high)))
    joint = task.model.robot.joints[axis]
    word, unit = ("deg", DEG) if joint.turns else ("mm", MM)
    return (
        f"{joint.name} is at {q[axis] / unit:.1f} {word},"
        f" beyond its limits {low[axis] / unit:g} .. {high[axis] / unit:g} {word}"
    )


def _note(
    task: CompensationProblem,
    why: dict[int, Finding],
    findings: list[Finding],
    rows: Ints,
    code: str,
    message: str,
) -> None:
    """Report it once for all ``rows``, and remember it for each."""
    if len(rows):
        why.update(dict.fromkeys(rows.tolist(), _at(task, int(rows[0]), code, message)))
        findings.append(_at(task, int(rows[0]), code, message + _further_findings(task, rows)))


def _refuse(task: CompensationProblem, mask: Bools, code: str, message: str, help: str) -> None:
    rows = np.flatnonzero(mask)
    if len(rows):
        raise Refusal(_at(task, int(rows[0]), code, message + _further_findings(task, rows), help))


def _warn_singular(task: CompensationProblem, rows: Ints, findings: list[Finding]) -> None:
    robot, q = task.model.robot, task.track.q
    parts = in_blocks(lambda part: rows[part][is_near_singular(robot, q[rows[part]])], len(rows))
    close = np.concatenate([rows[:0], *parts])
    if len(close):
        message = singular_words(robot) + _further_findings(task, close)
        findings.append(_at(task, int(close[0]), "KIN003", message))


def _further_findings(task: CompensationProblem, rows: Ints) -> str:
    return "" if len(rows) == 1 else f" ({len(rows)} motions, to line {task.toolpath.line[rows[-1]]})"


def _at(task: CompensationProblem, row: int, code: str, message: str, help: str = "") -> Finding:
    return Finding(code, message, task.file, int(task.toolpath.line[row]), help=help)


def _in(why: dict[int, Finding], n: int) -> Bools:
    mask = np.zeros(n, bool)
    mask[list(why)] = True
    return mask


def _shifted(mask: Bools) -> Bools:
    return np.concatenate([[False], mask[:-1]])
