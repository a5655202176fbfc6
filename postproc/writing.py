"""The compensated program as edits on its bytes, read back and checked before it may exist."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from postproc import __version__
from postproc.arrays import Bools, Floats, Ints
from postproc.cell import Cell
from postproc.compensation.between import errors_between
from postproc.compensation.correct import Result, with_residual
from postproc.compensation.division import Division, made
from postproc.compensation.task import Task
from postproc.dialects.dialect import Dialect, Moved, Program, Settings, Writing
from postproc.document import Document, Edits, apply, undone
from postproc.findings import Finding, Refusal
from postproc.geometry import Poses, on_arc, vector_from_rotation
from postproc.robot.description import Robot
from postproc.toolpath import Kind, Plan, Role, Toolpath
from postproc.units import DEG, MM

FAR = 2.5
"""Written steps by which the middle of an arc may be elsewhere than meant: its centre is rounded as well."""


@dataclass(frozen=True)
class Written:
    """``edits`` make the output; ``contents`` are its bytes, a document each; ``result`` has the residual predicted
    from the digits in them, ``division`` the commands as they are in them, and ``between`` (M,) [m] the largest
    distance from the wanted way inside of each corrected motion, NaN for all others.
    """

    edits: Edits
    contents: tuple[bytes, ...]
    result: Result
    division: Division
    between: Floats


def planned(task: Task, division: Division) -> Plan:
    """A division in the programmed bases: what a dialect is to write."""
    path, source = task.toolpath, division.source
    to_base = task.base[source].inverse()
    command = to_base @ division.command
    moved = division.moved
    turned = moved & path.oriented[source]
    link = division.links
    arc = np.isfinite(division.sweep)
    centre = (to_base @ Poses(np.eye(3), division.centre)).position
    normal = (to_base.rotation @ division.normal[..., None])[..., 0]
    return Plan(
        source,
        division.role,
        np.where(moved[:, None], command.position, path.position[source]),
        np.where(turned[:, None, None], command.rotation, path.rotation[source]),
        np.where(arc[:, None], centre, _kept(path.centre[source], moved | link)),
        np.where(arc[:, None], normal, _kept(path.normal[source], moved | link)),
        np.where(arc, division.sweep, _kept(path.sweep[source], moved | link)),
    )


def _kept(values: Floats, gone: Bools) -> Floats:
    """``values`` (M, ...) with NaN where ``gone`` (M,)."""
    return np.where(gone.reshape(-1, *[1] * (values.ndim - 1)), np.nan, values)


def written_as(cell: Cell, own_points: str) -> Writing:
    """Decimals whose rounding stays below a twentieth of the tolerances."""
    return Writing(_decimals(cell.tolerance / MM), _decimals(cell.tolerance_angle / DEG), own_points)


def write(
    program: Program,
    dialect: Dialect,
    task: Task,
    result: Result,
    division: Division,
    plan: Plan,
    moved: Moved,
    writing: Writing,
    settings: Settings,
    robot: Robot,
    stem: str,
    completed: Callable[[Toolpath], Toolpath],
) -> Written:
    """Turn a plan's edits into files, under the module name ``stem``, and read them back.

    ``completed``: fills in what a target that was read back leaves to the axis motion before it.
    Raises Refusal FIL011 (no module name) and FIL008 (what was read back is not what was meant).
    """
    edits = Edits.joined(moved.edits)
    if len(edits):
        edits = Edits.joined(edits, [dialect.marked(program, _mark(program, robot))])
    main = program.documents[0].path
    if stem != main.stem:
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]{0,23}", stem):
            raise Refusal(Finding("FIL011", f"{stem!r} can not name a module", str(main)))
        edits = Edits.joined(edits, dialect.renamed(program, stem))
    contents = _contents(program, edits)
    documents = zip(program.documents, contents, strict=True)
    read = dialect.read(tuple(Document(document.path, raw) for document, raw in documents), settings)
    back = completed(read.toolpath)
    _hold(program.toolpath, back, plan, writing, main.name)
    there = _as_written(task, division, back)
    own = there.command[np.flatnonzero(division.own)]
    return Written(edits, contents, with_residual(task, result, own), there, way_errors(task, result, there))


def way_errors(task: Task, result: Result, division: Division) -> Floats:
    """(M,) [m] the largest distance from the wanted way inside of each corrected motion, NaN for all others."""
    errors = np.full(len(division), np.nan)
    source = division.source
    chosen = np.flatnonzero(result.corrected[source] & task.ways.known[source] & ~division.links)
    if len(chosen):
        pieces = made(task, division)[chosen]
        first = (pieces.first == 0.0) & task.steps(pieces.rows, result.corrected)
        errors[chosen], _ = errors_between(task, pieces, first)
    return errors


def _as_written(task: Task, division: Division, back: Toolpath) -> Division:
    """The division with what its digits say."""
    source = division.source
    base = task.base[source]
    there = base @ back.target_in_base
    moved = division.moved
    arc = np.isfinite(division.sweep)
    return replace(
        division,
        command=Poses(
            np.where(moved[:, None, None], there.rotation, division.command.rotation),
            np.where(moved[:, None], there.position, division.command.position),
        ),
        centre=np.where(arc[:, None], (base @ Poses(np.eye(3), back.centre)).position, np.nan),
        normal=np.where(arc[:, None], (base.rotation @ back.normal[..., None])[..., 0], np.nan),
        sweep=np.where(arc, back.sweep, np.nan),
    )


def _decimals(tolerance: float) -> int:
    """Decimals whose rounding stays below a twentieth of the tolerance; three at least."""
    return max(3, math.ceil(-math.log10(tolerance / 10)))


def _mark(program: Program, robot: Robot) -> str:
    """Says which version, robot file and source made the output."""
    digests = [document.digest for document in program.documents]
    source = digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()
    return f"{__version__}, robot {robot.name} sha256:{robot.digest[:16]}, source sha256:{source[:16]}"


def _contents(program: Program, edits: Edits) -> tuple[bytes, ...]:
    """The bytes of every document with its edits.  Raises Refusal FIL008 if another byte changed."""
    contents = []
    for index, document in enumerate(program.documents):
        own = edits.of(index)
        raw = apply(document, own)
        if not undone(raw, document.raw, own):
            raise Refusal(Finding("FIL008", "bytes outside of the corrections changed", document.path.name))
        contents.append(raw)
    return tuple(contents)


def _hold(path: Toolpath, back: Toolpath, plan: Plan, writing: Writing, file: str) -> None:
    """The program read back is the one that was meant, motion by motion.  Raises Refusal FIL008."""
    source, own = plan.source, plan.own
    if len(back) != len(plan):
        raise Refusal(Finding("FIL008", f"{len(plan)} motions became {len(back)}", file))
    if not len(plan):
        return
    place = np.flatnonzero(own)
    if set(back.refused) != {int(place[row]) for row in path.refused}:
        raise Refusal(Finding("FIL008", "other motions than before are not understood", file))
    link = plan.role == Role.LINK
    for name, rows in (
        ("base", ~link | link),
        ("tool", ~link | link),
        ("kind", ~link),
        ("status", own),
        ("turn", own),
        ("axes", own),
        ("timed", own),
        ("feed", (path.kind[source] != Kind.PTP) & ~path.timed[source]),
    ):
        before = getattr(path, name)[source].reshape(len(plan), -1)
        after = getattr(back, name).reshape(len(plan), -1)
        same = ((before == after) | ((before != before) & (after != after))).all(axis=1) | ~rows
        if not same.all():
            row = int(np.argmin(same))
            raise Refusal(
                Finding("FIL008", f"the {name} of a motion changed", file, int(path.line[source[row]]))
            )
    if (back.kind[link] != Kind.LIN).any():
        raise Refusal(Finding("FIL008", "a link is no straight motion", file))
    known = np.isfinite(plan.position[:, 0])
    if not np.array_equal(np.isfinite(back.position[:, 0]), known):
        raise Refusal(Finding("FIL008", "targets were lost or appeared", file))
    # Half a written step a coordinate; three angles add up.
    step_mm, step_deg = 10.0**-writing.mm, 10.0**-writing.deg
    off = np.abs(back.position - plan.position).max(axis=1) / MM
    angle = _angle(plan.rotation, back.rotation, path.free_axis[source]) / DEG
    _close(off > 0.5001 * step_mm, off, path, source, file, "mm from what was meant")
    _close(angle > 1.5001 * step_deg, angle, path, source, file, "deg from what was meant")
    _hold_arcs(path, back, plan, step_mm, file)


def _hold_arcs(path: Toolpath, back: Toolpath, plan: Plan, step_mm: float, file: str) -> None:
    arc = np.isfinite(plan.sweep)
    if not np.array_equal(np.isfinite(back.sweep), arc):
        raise Refusal(Finding("FIL008", "arcs were lost or appeared", file))
    rows = np.flatnonzero(arc & np.append(False, np.isfinite(plan.position[:-1, 0])))
    rows = rows[(plan.source[rows] > 0)]
    half = np.full(len(rows), 0.5)
    vias = [
        on_arc(p.position[rows - 1], p.position[rows], p.centre[rows], p.normal[rows], p.sweep[rows], half)
        for p in (plan, back)
    ]
    off = np.zeros(len(plan))
    off[rows] = np.abs(vias[1] - vias[0]).max(axis=1, initial=0.0) / MM
    _close(off > FAR * step_mm, off, path, plan.source, file, "mm from the arc that was meant")


def _close(wrong: Bools, off: Floats, path: Toolpath, source: Ints, file: str, words: str) -> None:
    if wrong.any():
        row = int(np.argmax(wrong))
        line = int(path.line[int(source[row])])
        raise Refusal(Finding("FIL008", f"a target is {off[row]:.6f} {words}", file, line))


def _angle(one: Floats, other: Floats, free_axis: Floats) -> Floats:
    """(M,) [rad] between rotations, where an axis is free between its directions; 0 where one is not known."""
    turned = np.swapaxes(one, -1, -2) @ other
    known = np.isfinite(turned[:, 0, 0])
    vectors = vector_from_rotation(np.where(known[:, None, None], turned, np.eye(3)))
    axis = np.nan_to_num(free_axis)
    return np.asarray(np.linalg.norm(vectors - np.sum(vectors * axis, axis=1, keepdims=True) * axis, axis=1))
