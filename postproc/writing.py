"""The compensated program as edits on its bytes, read back and checked before it may exist."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc import __version__
from postproc.arrays import Bools, Floats, Ints
from postproc.blocks import blocks, each_block
from postproc.cell import Cell
from postproc.compensation.between import errors_between
from postproc.compensation.correct import Result, with_residual
from postproc.compensation.division import Division, made
from postproc.compensation.task import Task
from postproc.dialects.dialect import Dialect, Program, Settings, Writing
from postproc.document import Document, Edit, Edits, apply, undone
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
    m = len(division)
    position, rotation = np.empty((m, 3)), np.empty((m, 3, 3))
    arcs = bool(np.isfinite(division.sweep).any() or np.isfinite(task.toolpath.sweep).any())
    none = np.broadcast_to(np.nan, (m, 3))
    centre, normal, sweep = (np.array(way) if arcs else way for way in (none, none, none[:, 0]))

    def put(rows: slice) -> None:
        part = _planned(task, division, rows)
        position[rows], rotation[rows] = part.position, part.rotation
        if arcs:
            centre[rows], normal[rows], sweep[rows] = part.centre, part.normal, part.sweep

    each_block(put, m)
    for array in (position, rotation, centre, normal, sweep):
        array.setflags(write=False)
    return Plan(division.source, division.role, position, rotation, centre, normal, sweep)


def _planned(task: Task, division: Division, rows: slice) -> Plan:
    """Some motions of the plan."""
    path, source, moved = task.toolpath, division.source[rows], division.moved[rows]
    to_base = task.base.shared(source).inverse()
    command = to_base @ division.command[rows]
    turned = moved & path.oriented[source]
    arc, kept = np.isfinite(division.sweep[rows]), ~moved & ~division.links[rows]
    centre = (to_base @ Poses(np.eye(3), division.centre[rows])).position
    normal = (to_base.rotation @ division.normal[rows][..., None])[..., 0]

    def way(new: Floats, old: Floats) -> Floats:
        more = (1,) * (new.ndim - 1)
        stays = np.where(kept.reshape(-1, *more), old[source], np.nan)
        return np.where(arc.reshape(-1, *more), new, stays)

    return Plan(
        source,
        division.role[rows],
        np.where(moved[:, None], command.position, path.position[source]),
        np.where(turned[:, None, None], command.rotation, path.rotation[source]),
        way(centre, path.centre),
        way(normal, path.normal),
        way(division.sweep[rows], path.sweep),
    )


def written_as(cell: Cell, own_points: str) -> Writing:
    """Decimals whose rounding stays below a twentieth of the tolerances."""
    return Writing(_decimals(cell.tolerance / MM), _decimals(cell.tolerance_angle / DEG), own_points)


def edited(program: Program, dialect: Dialect, moved: Sequence[Edit], robot: Robot, stem: str) -> Edits:
    """The edits that make the output: those of the motions, with its mark and the module name ``stem``.

    Raises Refusal FIL011 (no module name).
    """
    more: list[Edit] = []
    if len(moved):
        more.append(dialect.marked(program, _mark(program, robot)))
    main = program.documents[0].path
    if stem != main.stem:
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]{0,23}", stem):
            raise Refusal(Finding("FIL011", f"{stem!r} can not name a module", str(main)))
        more += dialect.renamed(program, stem)
    return Edits.joined(sorted(more, key=lambda edit: edit.span), moved)  # these stand first, mostly


def write(
    documents: tuple[Document, ...],
    dialect: Dialect,
    task: Task,
    result: Result,
    division: Division,
    edits: Edits,
    writing: Writing,
    settings: Settings,
    completed: Callable[[Toolpath], Toolpath],
) -> Written:
    """Turn the edits of ``documents`` into files, and read them back.

    ``completed``: fills in what a target that was read back leaves to the axis motion before it.
    Raises Refusal FIL008 (what was read back is not what was meant).
    """
    contents = _contents(documents, edits)
    back = completed(_read_back(documents, contents, dialect, settings))
    _hold(task, division, back, writing, documents[0].path.name)
    there = _as_written(task, division, back)
    result = with_residual(task, result, there.own_command)
    return Written(edits, contents, result, there, way_errors(task, result, there))


def _read_back(
    documents: tuple[Document, ...], contents: tuple[bytes, ...], dialect: Dialect, settings: Settings
) -> Toolpath:
    pairs = zip(documents, contents, strict=True)
    return dialect.read(tuple(Document(document.path, raw) for document, raw in pairs), settings).toolpath


def way_errors(task: Task, result: Result, division: Division) -> Floats:
    """(M,) [m] the largest distance from the wanted way inside of each corrected motion, NaN for all others."""
    errors = np.full(len(division), np.nan)
    source, links = division.source, division.links
    chosen = np.flatnonzero(result.corrected[source] & task.ways.known[source] & ~links)

    def looked(part: slice) -> None:
        pieces = made(task, division, chosen[part])
        first = (pieces.first == 0.0) & task.steps(pieces.rows, result.corrected)
        errors[chosen[part]], _ = errors_between(task, pieces, first)

    each_block(looked, len(chosen))
    return errors


def _as_written(task: Task, division: Division, back: Toolpath) -> Division:
    """The division with what its digits say."""
    source, base = division.source, task.base

    def command(rows: Ints) -> Poses:
        found = task.wanted[source[rows]].copy()
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


def _contents(documents: tuple[Document, ...], edits: Edits) -> tuple[bytes, ...]:
    """The bytes of every document with its edits.  Raises Refusal FIL008 if another byte changed."""
    contents = []
    for index, document in enumerate(documents):
        own = edits.of(index)
        raw = apply(document, own)
        if not undone(raw, document.raw, own):
            raise Refusal(Finding("FIL008", "bytes outside of the corrections changed", document.path.name))
        contents.append(raw)
    return tuple(contents)


def _hold(task: Task, division: Division, back: Toolpath, writing: Writing, file: str) -> None:
    """The program read back is the one that was meant, motion by motion.  Raises Refusal FIL008."""
    path, own = task.toolpath, division.own
    if len(back) != len(division):
        raise Refusal(Finding("FIL008", f"{len(division)} motions became {len(back)}", file))
    place = np.flatnonzero(own)
    if set(back.refused) != {int(place[row]) for row in path.refused}:
        raise Refusal(Finding("FIL008", "other motions than before are not understood", file))

    def held(rows: slice) -> None:
        plan = _planned(task, division, rows)
        _hold_texts(path, back, plan, rows, file)
        _hold_targets(path, back, plan, rows, writing, file)

    each_block(held, len(division))
    _hold_arcs(task, division, back, 10.0**-writing.mm, file)


def _hold_texts(path: Toolpath, back: Toolpath, plan: Plan, rows: slice, file: str) -> None:
    """What a motion says beside its target."""
    source, own, link = plan.source, plan.own, plan.role == Role.LINK
    for name, chosen in (
        ("base", ~link | link),
        ("tool", ~link | link),
        ("kind", ~link),
        ("status", own),
        ("turn", own),
        ("axes", own),
        ("timed", own),
        ("feed", (path.kind[source] != Kind.PTP) & ~path.timed[source]),
    ):
        before, after = getattr(path, name)[source], getattr(back, name)[rows]
        same = (before == after) | ((before != before) & (after != after))
        wrong = ~same.reshape(len(source), -1).all(axis=1) & chosen
        if wrong.any():
            line = int(path.line[source[np.argmax(wrong)]])
            raise Refusal(Finding("FIL008", f"the {name} of a motion changed", file, line))
    if (back.kind[rows][link] != Kind.LIN).any():
        raise Refusal(Finding("FIL008", "a link is no straight motion", file))


def _hold_targets(
    path: Toolpath, back: Toolpath, plan: Plan, rows: slice, writing: Writing, file: str
) -> None:
    if not np.array_equal(np.isfinite(back.position[rows, 0]), np.isfinite(plan.position[:, 0])):
        raise Refusal(Finding("FIL008", "targets were lost or appeared", file))
    # Half a written step a coordinate; three angles add up.
    step_mm, step_deg = 10.0**-writing.mm, 10.0**-writing.deg
    off = np.abs(back.position[rows] - plan.position).max(axis=1) / MM
    angle = _angle(plan.rotation, back.rotation[rows], path.free_axis[plan.source]) / DEG
    _close(off > 0.5001 * step_mm, off, path, plan.source, file, "mm from what was meant")
    _close(angle > 1.5001 * step_deg, angle, path, plan.source, file, "deg from what was meant")


def _hold_arcs(task: Task, division: Division, back: Toolpath, step_mm: float, file: str) -> None:
    path, source = task.toolpath, division.source
    kept = ~division.moved & ~division.links
    arc = np.isfinite(division.sweep) | (kept & np.isfinite(path.sweep[source]))
    if not np.array_equal(np.isfinite(back.sweep), arc):
        raise Refusal(Finding("FIL008", "arcs were lost or appeared", file))
    for rows in blocks(len(division)) if arc.any() else ():
        begin = max(rows.start - 1, 0)
        plan = _planned(task, division, slice(begin, rows.stop))
        at = np.flatnonzero(np.isfinite(plan.sweep))
        at = at[(at > 0) & (plan.source[at] > 0)]
        at = at[np.isfinite(plan.position[at - 1, 0])]
        if not len(at):
            continue
        there, half = at + begin, np.full(len(at), 0.5)
        one, other = (
            on_arc(p.position[k - 1], p.position[k], p.centre[k], p.normal[k], p.sweep[k], half)
            for p, k in ((plan, at), (back, there))
        )
        off = np.abs(other - one).max(axis=1) / MM
        _close(off > FAR * step_mm, off, path, plan.source[at], file, "mm from the arc that was meant")


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
