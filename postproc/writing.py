"""The compensated program as edits on its bytes, read back and checked before it may exist."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc import __version__
from postproc.arrays import Floats, Ints, LazyRows
from postproc.blocks import each_block, give_back
from postproc.cell import Cell
from postproc.compensation.between import errors_between
from postproc.compensation.correct import Result, with_residual
from postproc.compensation.division import Division, made
from postproc.compensation.task import Task
from postproc.dialects.dialect import Dialect, Program, Settings, Writing
from postproc.dialects.permitted import refuse_other
from postproc.document import Document, Edit, Edits, apply, undone
from postproc.findings import Finding, Refusal
from postproc.geometry import PoseRows, Poses
from postproc.holding import hold, hold_residual, meant
from postproc.robot.description import Robot
from postproc.toolpath import Plan, Toolpath
from postproc.units import DEG, MM


@dataclass(frozen=True)
class Written:
    """``edits`` make the output; ``contents`` are its bytes, a document each; ``result`` has the residual predicted
    from the digits in them, ``division`` the commands as they are in them.

    off (N,) [m], off_angle (N,) [rad]: the same residuals, from what the gain leaves.
    """

    task: Task
    edits: Edits
    contents: tuple[bytes, ...]
    result: Result
    division: Division
    off: Floats
    off_angle: Floats

    @cached_property
    def between(self) -> Floats:
        """(M,) [m] the largest distance from the wanted way inside of each corrected motion, NaN for all others."""
        return way_errors(self.task, self.result, self.division)

    @cached_property
    def off_between(self) -> Floats:
        """(M,) [m] the same, from the way that the gain leaves."""
        if self.task.gain == 1.0:
            return self.between
        return way_errors(self.task, self.result, self.division, 1.0 - self.task.gain)


def planned(task: Task, division: Division) -> Plan:
    """A division in the programmed bases: what a dialect is to write."""
    m = len(division)

    def made(rows: Ints) -> Poses:
        part = meant(task, division, division.moved, rows)
        return Poses(part.rotation[:], part.position[:])

    target = PoseRows(m, made).remembered()
    none = np.broadcast_to(np.nan, (m, 3))
    centre, normal, sweep = none, none, none[:, 0]
    if np.isfinite(division.sweep).any() or np.isfinite(task.toolpath.sweep).any():
        centre, normal, sweep = np.empty((m, 3)), np.empty((m, 3)), np.empty(m)

        def put(rows: slice) -> None:
            part = meant(task, division, division.moved, rows)
            centre[rows], normal[rows], sweep[rows] = part.centre, part.normal, part.sweep

        each_block(put, m)
        for array in (centre, normal, sweep):
            array.setflags(write=False)
    return Plan(
        division.source,
        division.role,
        LazyRows(m, lambda rows: target[rows].position),
        LazyRows(m, lambda rows: target[rows].rotation),
        centre,
        normal,
        sweep,
    )


def written_as(cell: Cell, own_points: str) -> Writing:
    """Decimals whose rounding stays below a twentieth of the tolerances."""
    return Writing(_decimals(cell.tolerance / MM), _decimals(cell.tolerance_angle / DEG), own_points)


def edited(program: Program, dialect: Dialect, moved: Sequence[Edit], robot: Robot, stem: str) -> Edits:
    """The edits that make the output: those of the motions, with its mark and the module name ``stem``.

    Raises Refusal FIL008 (an edit touches what is no part of a motion), FIL011 (no module name).
    """
    more: list[Edit] = []
    moved = Edits.joined(moved)
    refuse_other(program, moved, dialect.letters)
    if len(moved):
        more.append(dialect.marked(program, _mark(program, robot)))
    main = program.documents[0].path
    if stem != main.stem:
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]{0,23}", stem):
            raise Refusal(Finding("FIL011", f"{stem!r} can not name a module", str(main)))
        more += dialect.renamed(program, stem)
    return Edits.joined(sorted(more, key=lambda edit: edit.span), moved)  # these stand first, mostly


def write(
    program: Program,
    dialect: Dialect,
    task: Task,
    result: Result,
    division: Division,
    edits: Edits,
    writing: Writing,
    settings: Settings,
    completed: Callable[[Toolpath], Toolpath],
) -> Written:
    """Turn the edits of ``program`` into files, and read them back.

    ``completed``: fills in what a target that was read back leaves to the axis motion before it.
    Raises Refusal FIL008 (what was read back is not what was meant), COR002 (it corrects by more than may be).
    """
    documents = program.documents
    contents = _contents(documents, edits)
    again = _read_back(documents, contents, dialect, settings)
    back = completed(again.toolpath)
    give_back()
    hold(task, result, division, program, again, back, writing)
    give_back()
    there = _as_written(task, division, back)
    written = with_residual(task, result, there.own_command)
    written = replace(
        written, turn=np.broadcast_to(np.nan, written.turn.shape)
    )  # it was meant for what is written
    give_back()
    hold_residual(task, result, written, there, writing, documents[0].path.name)
    give_back()
    left = (written.after, written.after_angle) if task.gain == 1.0 else _beside_left(task, written)
    return Written(task, edits, contents, written, there, *left)


def _read_back(
    documents: tuple[Document, ...], contents: tuple[bytes, ...], dialect: Dialect, settings: Settings
) -> Program:
    pairs = zip(documents, contents, strict=True)
    read = tuple(Document(document.path, raw) for document, raw in pairs)
    return replace(dialect.read(read, replace(settings, places=False)), text=None)


def _beside_left(task: Task, result: Result) -> tuple[Floats, Floats]:
    """(N,) [m] and (N,) [rad] how far the tool is from where the part of the correction that is made leaves it; NaN
    where nothing is corrected."""
    rows, left = np.flatnonzero(result.corrected), 1.0 - task.gain
    off, angle = np.full((2, len(result.state)), np.nan)

    def predicted(part: slice) -> None:
        at = rows[part]
        wanted = task.wanted[at]
        goal = task.goal(at, wanted)
        after, before = (
            task.seen(at, task.real(at, command, task.wrench[at]).pose, goal)
            for command in (result.command[at], wanted)
        )
        off[at], angle[at] = (
            np.linalg.norm(now - left * then, axis=1) for now, then in zip(after, before, strict=True)
        )

    each_block(predicted, len(rows))
    return off, angle


def way_errors(task: Task, result: Result, division: Division, left: float = 0.0) -> Floats:
    """(M,) [m] the largest distance from the wanted way inside of each corrected motion, NaN for all others.

    ``left``: the share of the error without a correction that is meant to stay.
    """
    errors = np.full(len(division), np.nan)
    source, links = division.source, division.links
    chosen = np.flatnonzero(result.corrected[source] & task.ways.known[source] & ~links)

    def looked(part: slice) -> None:
        pieces = made(task, division, chosen[part])
        first = (pieces.first == 0.0) & task.steps(pieces.rows, result.corrected)
        errors[chosen[part]], _ = errors_between(task, pieces, first, left)

    each_block(looked, len(chosen))
    return errors


def _as_written(task: Task, division: Division, back: Toolpath) -> Division:
    """The division with what its digits say."""
    source, base = division.source, task.base

    def command(rows: Ints) -> Poses:
        found = task.wanted[source[rows]].copy()
        known = np.flatnonzero(np.isfinite(back.position[rows, 0]))
        found.put(known, base.shared(source[rows[known]]) @ back.target_in_base[rows[known]])
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
