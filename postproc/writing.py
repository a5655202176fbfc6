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
from postproc.blocks import blocks, in_blocks
from postproc.cell import Cell
from postproc.compensation.between import errors_between
from postproc.compensation.correct import Result, with_residual
from postproc.compensation.division import Division, made
from postproc.compensation.task import Task
from postproc.dialects.dialect import Dialect, Moved, Program, Settings, Writing
from postproc.document import Document, Edits, apply, undone
from postproc.findings import Finding, Refusal
from postproc.geometry import PoseRows, Poses, on_arc, vector_from_rotation
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
    path, source, m = task.toolpath, division.source, len(division)
    arcs = bool(np.isfinite(division.sweep).any() or np.isfinite(path.sweep).any())
    position, rotation = np.empty((m, 3)), np.empty((m, 3, 3))
    none = np.broadcast_to(np.nan, (m, 3))
    centre, normal, sweep = (np.array(way) if arcs else way for way in (none, none, none[:, 0]))

    def put(part: slice) -> None:
        at, moved = source[part], division.moved[part]
        to_base = task.base.shared(at).inverse()
        command = to_base @ division.command[part]
        turned = moved & path.oriented[at]
        position[part] = np.where(moved[:, None], command.position, path.position[at])
        rotation[part] = np.where(turned[:, None, None], command.rotation, path.rotation[at])
        if not arcs:
            return
        arc, kept = np.isfinite(division.sweep[part]), ~moved & ~division.links[part]
        there = (to_base @ Poses(np.eye(3), division.centre[part])).position
        across = (to_base.rotation @ division.normal[part][..., None])[..., 0]
        for whole, own, way in (
            (centre, path.centre, there),
            (normal, path.normal, across),
            (sweep[:, None], path.sweep[:, None], division.sweep[part][:, None]),
        ):
            whole[part] = np.where(arc[:, None], way, np.where(kept[:, None], own[at], np.nan))

    for _ in in_blocks(put, m):
        pass
    for array in (position, rotation):
        array.setflags(write=False)
    return Plan(source, division.role, position, rotation, centre, normal, sweep)


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
    result = with_residual(task, result, there.own_command)
    return Written(edits, contents, result, there, way_errors(task, result, there))


def way_errors(task: Task, result: Result, division: Division) -> Floats:
    """(M,) [m] the largest distance from the wanted way inside of each corrected motion, NaN for all others."""
    errors = np.full(len(division), np.nan)
    source, links = division.source, division.links
    chosen = np.flatnonzero(result.corrected[source] & task.ways.known[source] & ~links)

    def looked(part: slice) -> None:
        pieces = made(task, division, chosen[part])
        first = (pieces.first == 0.0) & task.steps(pieces.rows, result.corrected)
        errors[chosen[part]], _ = errors_between(task, pieces, first)

    for _ in in_blocks(looked, len(chosen)):
        pass
    return errors


def _as_written(task: Task, division: Division, back: Toolpath) -> Division:
    """The division with what its digits say."""
    source, base = division.source, task.base

    def command(rows: Ints) -> Poses:
        found = division.command[rows]
        moved = np.flatnonzero(division.moved[rows])
        found.put(moved, base.shared(source[rows[moved]]) @ back.target_in_base[rows[moved]])
        return found

    there = replace(division, command=PoseRows(len(division), command))
    bent = np.flatnonzero(np.isfinite(division.sweep))
    if not len(bent):
        return there
    centre, normal, sweep = division.centre.copy(), division.normal.copy(), division.sweep.copy()
    own = base[source[bent]]
    centre[bent] = (own @ Poses(np.eye(3), back.centre[bent])).position
    normal[bent] = (own.rotation @ back.normal[bent][..., None])[..., 0]
    sweep[bent] = back.sweep[bent]
    return replace(there, centre=centre, normal=normal, sweep=sweep)


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
        ("base", None),
        ("tool", None),
        ("kind", ~link),
        ("status", own),
        ("turn", own),
        ("axes", own),
        ("timed", own),
        ("feed", (path.kind[source] != Kind.PTP) & ~path.timed[source]),
    ):
        before, after = getattr(path, name), getattr(back, name)
        for part in blocks(len(plan)):
            one, other = before[source[part]], after[part]
            same = (one == other) | ((one != one) & (other != other))
            same = same.reshape(len(one), -1).all(axis=1)
            if rows is not None:
                same |= ~rows[part]
            if not same.all():
                row = part.start + int(np.argmin(same))
                raise Refusal(
                    Finding("FIL008", f"the {name} of a motion changed", file, int(path.line[source[row]]))
                )
    if (back.kind[link] != Kind.LIN).any():
        raise Refusal(Finding("FIL008", "a link is no straight motion", file))
    for part in blocks(len(plan)):
        _hold_targets(path, back, plan, part, writing, file)
    _hold_arcs(path, back, plan, 10.0**-writing.mm, file)


def _hold_targets(
    path: Toolpath, back: Toolpath, plan: Plan, part: slice, writing: Writing, file: str
) -> None:
    source, position = plan.source[part], plan.position[part]
    known = np.isfinite(position[:, 0])
    if not np.array_equal(np.isfinite(back.position[part][:, 0]), known):
        raise Refusal(Finding("FIL008", "targets were lost or appeared", file))
    # Half a written step a coordinate; three angles add up.
    step_mm, step_deg = 10.0**-writing.mm, 10.0**-writing.deg
    off = np.abs(back.position[part] - position).max(axis=1) / MM
    angle = _angle(plan.rotation[part], back.rotation[part], path.free_axis[source]) / DEG
    _close(off > 0.5001 * step_mm, off, path, source, file, "mm from what was meant")
    _close(angle > 1.5001 * step_deg, angle, path, source, file, "deg from what was meant")


def _hold_arcs(path: Toolpath, back: Toolpath, plan: Plan, step_mm: float, file: str) -> None:
    arc = np.isfinite(plan.sweep)
    if not np.array_equal(np.isfinite(back.sweep), arc):
        raise Refusal(Finding("FIL008", "arcs were lost or appeared", file))
    rows = np.flatnonzero(arc)
    rows = rows[(rows > 0) & (plan.source[rows] > 0)]
    rows = rows[np.isfinite(plan.position[rows - 1, 0])]
    half = np.full(len(rows), 0.5)
    vias = [
        on_arc(p.position[rows - 1], p.position[rows], p.centre[rows], p.normal[rows], p.sweep[rows], half)
        for p in (plan, back)
    ]
    off = np.abs(vias[1] - vias[0]).max(axis=1, initial=0.0) / MM
    _close(off > FAR * step_mm, off, path, plan.source[rows], file, "mm from the arc that was meant")


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
