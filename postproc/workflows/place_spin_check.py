"""The check of a program whose tool was turned: read back, every motion is what it was but for that turn.

Nothing here knows how the text was written, or by how much the tool was to turn: both programs are read, their motions
are followed, and the tool's tip, its axis, its feed and its force are compared along each of them.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block
from postproc.base.findings import Finding, Refusal
from postproc.base.units import DEG, MM
from postproc.languages.dialect import WritingSettings
from postproc.placement import codes as codes
from postproc.workflows.preparation import Prepared

SHARED_POINTS = "copy-inline"
"""What becomes of a named point that serves several motions."""

SHARES = (0.25, 0.5, 0.75, 1.0)
"""Of each path, at which both programs are compared."""

SAME_FORCE = 1e-3
"""Share of the largest force by which forces may differ."""


def check_turned(before: Prepared, after: Prepared, axes: Floats, writing: WritingSettings) -> None:
    """``after`` makes the motions of ``before`` with the tool turned about ``axes`` (N, 3), its spindle in tool axes,
    NaN where the tool may not turn at all.  Raises Refusal FIL008."""
    one, other, file = before.task.toolpath, after.task.toolpath, before.task.file
    if len(one) != len(other):
        _fail(file, f"{len(one)} motions are planned, {len(other)} are read back")
    for name in ("kind", "line", "feed", "base", "tool", "approximation", "stops", "continues", "external"):
        same = _same(getattr(one, name), getattr(other, name))
        if not same.all():
            _fail(file, f"the {name} of a motion differs from the program", int(one.line[np.argmin(same)]))
    same = _same(one.axes[np.arange(len(one))], other.axes[np.arange(len(one))])
    same &= np.asarray(before.task.carries == after.task.carries)
    if not same.all():
        _fail(file, "a motion differs from the program", int(one.line[np.argmin(same)]))
    if set(one.constraints.refused) != set(other.constraints.refused):
        _fail(file, "other motions than before are not understood")
    if [note.text for note in one.annotations] != [note.text for note in other.annotations]:
        _fail(file, "comments differ from the program")
    _check_paths(before, after, axes, writing)


def _check_paths(before: Prepared, after: Prepared, axes: Floats, writing: WritingSettings) -> None:
    """The tool's tip and axis, at the ends and along the paths."""
    path, desired = before.task.toolpath, before.task.desired_path
    step = 0.51 * 10.0**-writing.mm * MM
    # at the ends three angles are rounded; between them a tolerance of the cell was kept
    angles = {1.0: 3 * 0.51 * 10.0**-writing.deg * DEG}
    ends = np.flatnonzero(path.known)
    for share in SHARES:
        rows = ends if share == 1.0 else ends[desired.traceable[ends] & np.isfinite(desired.angle[ends])]
        allowed = angles.get(share, before.cell.tolerance_angle + angles[1.0])

        def compare(part: slice, rows: Ints = rows, share: float = share, allowed: float = allowed) -> None:
            at = rows[part]
            shares = np.full(len(at), share)
            one, other = (task.desired_path.at(at, shares) for task in (before.task, after.task))
            off = np.linalg.norm(one.position - other.position, axis=1)
            _refuse(before, at, off > step, "the tool's tip of a motion is elsewhere")
            turned = np.isfinite(axes[at, 0])
            axis = np.where(turned[:, None], axes[at], [0.0, 0.0, 1.0])
            here, there = (np.einsum("nij,nj->ni", pose.rotation, axis) for pose in (one, other))
            away = np.linalg.norm(np.cross(here, there), axis=1)
            wrong = (away > np.sin(allowed)) | (np.sum(here * there, axis=1) < 0)
            wrong |= ~turned & (np.abs(one.rotation - other.rotation).max(axis=(1, 2)) > allowed)
            _refuse(before, at, wrong, "the tool's axis of a motion points elsewhere")

        each_block(compare, len(rows))


def check_forces(before: Prepared, after: Prepared) -> None:
    """What the workpiece does to the tool is the same.  Raises Refusal PLC014 where a statement turns with the tool."""
    task = before.task
    rows = np.flatnonzero(task.carries | after.task.carries)
    one, other = (np.asarray(part.wrench[rows]) for part in (task, after.task))
    sizes = np.abs(one).reshape(-1, 2, 3).max(axis=(0, 2)) if len(rows) else np.zeros(2)
    allowed = SAME_FORCE * np.repeat(np.maximum(sizes, [1e-6, 1e-9]), 3)
    wrong = (np.abs(one - other) > allowed).any(axis=1)
    if wrong.any():
        line = int(task.toolpath.line[rows[np.argmax(wrong)]])
        message = (
            "the force of this motion is stated in the tool frame, which turns, and the real force does not"
        )
        help = "state the force @feed or @base"
        raise Refusal(Finding("PLC014", message, task.file, line, help=help))


def _same(one: Floats, other: Floats) -> Bools:
    """(N,) whether rows are equal, unknown ones too."""
    one, other = np.asarray(one), np.asarray(other)
    return np.asarray(((one == other) | ((one != one) & (other != other))).reshape(len(one), -1).all(axis=1))


def _refuse(ready: Prepared, rows: Ints, wrong: Bools, words: str) -> None:
    if wrong.any():
        _fail(ready.task.file, words, int(ready.task.toolpath.line[rows[np.argmax(wrong)]]))


def _fail(file: str, words: str, line: int = 0) -> None:
    raise Refusal(Finding("FIL008", f"the turned program does not pass its check: {words}", file, line))
