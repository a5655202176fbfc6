"""From wanted motions to corrected commands: what is in scope, what must stay, and by how much the rest moves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.compensation.cuts import cuts_of, left_findings, spread, switch_findings, switched_on
from postproc.compensation.mirror import partly
from postproc.compensation.task import Task
from postproc.findings import Finding, Refusal
from postproc.geometry import Poses
from postproc.robot.track import near_singular, sides, singular_words
from postproc.toolpath import Kind
from postproc.units import DEG, MM


class State(IntEnum):
    AIR = 0  # nothing to correct
    CORRECTED = 1
    LEFT = 2  # could not be corrected, told
    OFF = 3  # left alone on the program's own word (COMPENSATE OFF)


@dataclass(frozen=True)
class Result:
    """state (N,) State; cut (N,), -1 in air; command: TCP commands in the robot base; before, after (N,) [m] predicted
    position error, NaN where nothing is predicted, and before_angle, after_angle (N,) [rad]; deflection (N, 3) [m]
    before; iterations (N,); history (K + 1, N) [m]; findings."""

    state: Ints
    cut: Ints
    command: Poses
    deflection: Floats
    before: Floats
    before_angle: Floats
    after: Floats
    after_angle: Floats
    iterations: Ints
    history: Floats
    findings: tuple[Finding, ...]

    @property
    def corrected(self) -> Bools:
        return self.state == State.CORRECTED


def correct(task: Task) -> Result:
    """Correct every motion that can be.

    Raises Refusal: a cutting pose out of reach (KIN001), a configuration that nothing says (KIN004), a correction
    larger than the cell allows (COR002).
    """
    path, track, n = task.toolpath, task.track, len(task.toolpath)
    cartesian = path.known & ~np.isfinite(path.axes).all(axis=1)
    forced = task.carries
    scope = forced if task.process else forced | cartesian
    # In air every motion stands for itself; a cut stands and falls as a whole.
    cut = (
        cuts_of(scope, path.runs)
        if task.process
        else np.where(scope, np.cumsum(scope & ~(forced & _shifted(forced))) - 1, -1)
    )
    on = switched_on(path)
    findings = switch_findings(task.file, path)
    why = _held(task, scope, scope & on, findings)
    off = scope & ~on
    for row in np.flatnonzero(on & scope & spread(off, cut)):
        why.setdefault(int(row), _at(task, int(row), "COR004", "COMPENSATE is switched inside this cut"))

    # What the force does, everywhere it can be predicted; then the correction, where it may be made.
    seen = scope & cartesian & (track.status >= 0) & track.reachable
    rows = np.flatnonzero(seen)
    goal = task.goal(rows, task.wanted[rows])
    here = task.real(rows, task.wanted[rows], task.wrench[rows])
    deflection, before, before_angle = np.full((n, 3), np.nan), np.full(n, np.nan), np.full(n, np.nan)
    shift, turn = task.seen(rows, here.pose, goal)
    shift[~here.settled], turn[~here.settled] = np.nan, np.nan
    deflection[rows], before[rows] = shift, np.linalg.norm(shift, axis=1)
    before_angle[rows] = np.linalg.norm(turn, axis=1)

    may = seen & on & ~spread(_in(why, n), cut)
    rows_may = np.flatnonzero(may)
    inside = np.searchsorted(rows, rows_may)
    done = task.command(rows_may, task.wanted[rows_may], task.wrench[rows_may], goal[inside])
    _judge(task, done.reachable, done.settled, done.converged, done.q, rows_may, why, findings)
    keeps = may & ~spread(_in(why, n), cut)
    chosen = keeps[rows_may]

    rotation, position = task.wanted.rotation.copy(), task.wanted.position.copy()
    share = partly(task.wanted[rows_may], done.command, task.gain)
    moved = rows_may[chosen]
    rotation[moved], position[moved] = share.rotation[chosen], share.position[chosen]
    command = Poses(rotation, position)
    size = np.linalg.norm(position - task.wanted.position, axis=1)
    _refuse(
        task,
        np.nan_to_num(size) > task.max_correction,
        "COR002",
        f"the correction is {np.nanmax(size, initial=0.0) / MM:.2f} mm,"
        f" more than max_correction ({task.max_correction / MM:g} mm)",
        "check force, base and tool; if it is meant, raise max_correction in the cell",
    )

    state = np.full(n, State.AIR, np.int64)
    state[scope] = State.LEFT
    state[off] = State.OFF
    state[keeps] = State.CORRECTED
    # What the mirror begins with is a first step from the wanted pose.
    iterations, history = np.zeros(n, np.int64), np.full((len(done.history) + 1, n), np.nan)
    iterations[rows_may], history[0, rows_may], history[1:, rows_may] = (
        done.iterations + 1,
        before[rows_may],
        done.history,
    )
    findings += left_findings(task.file, path, cut, why)
    _warn_sides(task, done.q, rows_may, keeps, findings)
    _warn_singular(task, seen & forced, findings)
    after, after_angle = before.copy(), before_angle.copy()
    after[moved], after_angle[moved] = done.error[chosen], done.angle[chosen]
    result = Result(
        state,
        cut,
        command,
        deflection,
        before,
        before_angle,
        after,
        after_angle,
        iterations,
        history,
        tuple(findings),
    )
    # What the mirror found holds for the whole correction, and where it corrects all that shows.
    whole = task.gain == 1.0 and task.turns(moved, command.rotation[moved]) is None
    return result if whole else with_residual(task, result, command)


def with_residual(task: Task, result: Result, command: Poses) -> Result:
    """The result with its residual predicted for ``command``, the poses as they were really written."""
    rows = np.flatnonzero(result.corrected)
    here = task.real(rows, command[rows], task.wrench[rows])
    shift, turn = task.seen(rows, here.pose, task.goal(rows, task.wanted[rows]))
    after, after_angle = result.before.copy(), result.before_angle.copy()
    after[rows] = np.where(here.reachable & here.settled, np.linalg.norm(shift, axis=1), np.inf)
    after_angle[rows] = np.linalg.norm(turn, axis=1)
    return replace(result, command=command, after=after, after_angle=after_angle)


def _held(task: Task, scope: Bools, tried: Bools, findings: list[Finding]) -> dict[int, Finding]:
    """Motions that can not be corrected as they are programmed, and why; Refusal where the input must be wrong."""
    path, track, n = task.toolpath, task.track, len(task.toolpath)
    why: dict[int, Finding] = {}
    for row in np.flatnonzero(tried):
        stop = path.refused.get(int(row)) or path.pinned.get(int(row))
        if stop is not None:
            why[int(row)] = stop
    cartesian = path.known & ~np.isfinite(path.axes).all(axis=1)
    for row in np.flatnonzero(tried & ~cartesian):
        why.setdefault(int(row), _at(task, int(row), "COR003", "its target is not known"))
    free = tried & cartesian & ~_in(why, n)
    _refuse(
        task,
        free & (track.status < 0),
        "KIN004",
        "the robot's configuration is not known here",
        "give `start:` (axes before the first motion) in the cell, or S and T with the PTP before it",
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
    _note(task, why, findings, mask, "KIN002", _which_axis(task, track.q, mask))
    mask = free & ~track.reachable
    _note(task, why, findings, mask, "KIN005", "the programmed pose is out of reach")
    air = path.known & ~scope
    _note(task, {}, findings, air & ~track.reachable, "KIN005", "the programmed pose is out of reach")
    _note(task, {}, findings, ~scope & beyond, "KIN005", _which_axis(task, track.q, ~scope & beyond))
    return why


def _which_axis(task: Task, q: Floats, mask: Bools) -> str:
    """The axis that is farthest beyond its limits at the first motion of ``mask``, in words."""
    if not mask.any():
        return ""
    row = int(np.argmax(mask))
    low, high = task.model.robot.limits.T
    axis = int(np.argmax(np.maximum(low - q[row], q[row] - high)))
    joint = task.model.robot.joints[axis]
    word, unit = ("deg", DEG) if joint.kind == "revolute" else ("mm", MM)
    return (
        f"{joint.name} at {q[row, axis] / unit:.1f} {word},"
        f" limits {low[axis] / unit:g} .. {high[axis] / unit:g} {word}"
    )


def _judge(
    task: Task,
    reachable: Bools,
    settled: Bools,
    converged: Bools,
    q: Floats,
    rows: Ints,
    why: dict[int, Finding],
    findings: list[Finding],
) -> None:
    """Why motions that were tried can not be corrected after all."""
    n = len(task.toolpath)
    low, high = task.model.robot.limits.T
    beyond = ((q < low) | (q > high)).any(axis=1)
    axes = np.full((n, q.shape[1]), np.nan)
    axes[rows] = q
    struck = np.zeros(n, bool)
    struck[rows[beyond]] = True
    reasons = (
        (~reachable, "COR009", "the correction leads out of reach"),
        (~settled, "MOD002", "the robot has no stable rest under this force"),
        (~converged, "COR001", "the correction does not settle"),
        (beyond, "COR008", "the correction brings " + _which_axis(task, axes, struck)),
    )
    for failed, code, message in reasons:
        mask = np.zeros(n, bool)
        mask[rows[failed]] = True
        _note(task, why, findings, mask & ~_in(why, n), code, message)


def _note(
    task: Task, why: dict[int, Finding], findings: list[Finding], mask: Bools, code: str, message: str
) -> None:
    """Say it once for all motions of ``mask``, and remember it for each."""
    rows = np.flatnonzero(mask)
    for row in rows:
        why[int(row)] = _at(task, int(row), code, message)
    if len(rows):
        findings.append(_at(task, int(rows[0]), code, message + _more(task, rows)))


def _refuse(task: Task, mask: Bools, code: str, message: str, help: str) -> None:
    rows = np.flatnonzero(mask)
    if len(rows):
        raise Refusal(_at(task, int(rows[0]), code, message + _more(task, rows), help))


def _warn_sides(task: Task, q: Floats, rows: Ints, keeps: Bools, findings: list[Finding]) -> None:
    """S and T stand verbatim in the text: they must still be those of the corrected pose."""
    path = task.toolpath
    kept = keeps[rows] & ((path.status[rows] >= 0) | (path.turn[rows] >= 0)) & (path.kind[rows] == Kind.PTP)
    robot = task.model.robot
    before, after = sides(robot, task.track.q[rows[kept]]), sides(robot, q[kept])
    crossed = rows[kept][(before[0] != after[0]) | (before[1] != after[1])]
    if len(crossed):
        message = "the corrected pose crosses the side that S or T states" + _more(task, crossed)
        findings.append(_at(task, int(crossed[0]), "KIN006", message))


def _warn_singular(task: Task, mask: Bools, findings: list[Finding]) -> None:
    rows = np.flatnonzero(mask)
    close = rows[near_singular(task.model.robot, task.track.q[rows])]
    if len(close):
        message = singular_words(task.model.robot) + _more(task, close)
        findings.append(_at(task, int(close[0]), "KIN003", message))


def _more(task: Task, rows: Ints) -> str:
    return "" if len(rows) == 1 else f" ({len(rows)} motions, to line {task.toolpath.line[rows[-1]]})"


def _at(task: Task, row: int, code: str, message: str, help: str = "") -> Finding:
    return Finding(code, message, task.file, int(task.toolpath.line[row]), help=help)


def _in(why: dict[int, Finding], n: int) -> Bools:
    mask = np.zeros(n, bool)
    mask[list(why)] = True
    return mask


def _shifted(mask: Bools) -> Bools:
    return np.concatenate([[False], mask[:-1]])
