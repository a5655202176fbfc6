"""The rows that were read as a Toolpath, the places of their numbers, and the findings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Bools, FewRows, Floats, Ints
from postproc.dialects.krl.places import Places
from postproc.dialects.krl.rows import HELP, Reason, Rows
from postproc.dialects.krl.run import Run
from postproc.dialects.krl.state import Source
from postproc.dialects.krl.survey import closure
from postproc.dialects.krl.table import Spots, Table
from postproc.findings import Finding
from postproc.toolpath import FrameRef, Toolpath
from postproc.units import DEG, MM

READ_TOO = "other code reads it too"
SEVERAL = "its line runs several times"


def finished(
    run: Run, text_called: Iterable[bytes], places: bool
) -> tuple[Toolpath, Places | None, list[Finding]]:
    """``text_called``: routines that were called where it is not known that, or with what, they run; ``places``:
    whether they are wanted."""
    rows = run.rows
    elsewhere = _other_calls(run, text_called)
    run.code.clear()  # the table takes up its arrays one after the other
    table = Table(rows, places)
    for begin, stop, reason in elsewhere:
        for row in np.flatnonzero((table.line >= begin) & (table.line <= stop)).tolist():
            rows.reasons.setdefault(row, reason)
    _lock(run)
    refused = _refused(rows, table)
    table.base, table.tool, used = _used(table.base, table.tool, run.frames.refs())
    table.blend *= MM
    n = len(rows)
    anchor = _sparse((n,), np.int32(-1), {row: at.row for row, at in rows.anchors.items()})
    given = _given(rows, n)
    axes = np.array(list(table.axes.values())).reshape(-1, 6) * DEG
    toolpath = Toolpath(
        kind=_kept(table.kind),
        position=_kept(table.position),
        rotation=_kept(table.rotation),
        axes=FewRows(np.array(list(table.axes), np.int32), _kept(axes), n),
        feed=_kept(table.feed),
        base=_kept(table.base),
        tool=_kept(table.tool),
        status=_kept(table.status),
        turn=_kept(table.turn),
        line=_kept(table.line),
        frames=used,
        refused=refused,
        pinned=_pinned(rows, table, refused),
        annotations=tuple(rows.annotations),
        anchor=anchor,
        given=given,
        centre=_sparse((n, 3), np.nan, {row: way[:3] for row, way in table.ways.items()}, MM),
        normal=_sparse((n, 3), np.nan, {row: way[3:6] for row, way in table.ways.items()}),
        sweep=_sparse((n,), np.nan, {row: way[6] for row, way in table.ways.items()}, DEG),
        blend=_kept(table.blend),
        free_axis=np.broadcast_to(np.nan, (n, 3)),
        whole=_whole(rows, table),
        comments=tuple(rows.comments),
        runs=_runs(rows, n),
    )
    found = None if table.spots is None else _places(rows, table, table.spots)
    return toolpath, found, [*_told(rows, table, refused), *_told_external(rows, table)]


def _places(rows: Rows, table: Table, spots: Spots) -> Places:
    _number_texts(rows, table, spots)
    return Places(
        start=spots.start,
        stop=spots.stop,
        file=spots.file,
        inherits=spots.inherits,
        insert=spots.insert,
        home=spots.home,
        motion=spots.motion,
        text=spots.text,
        variables=rows.variables,
        locked=rows.locked,
        arcs=rows.arcs,
        relative=rows.relative,
        inline=rows.inline,
    )


def _kept(array: NDArray[Any]) -> NDArray[Any]:
    """Read-only, so that it need not be copied."""
    array.setflags(write=False)
    return array


def _sparse(
    shape: tuple[int, ...], blank: float | np.int32, filled: Mapping[int, Any], unit: float | Floats = 1
) -> NDArray[Any]:
    """``blank`` everywhere but in the rows that are filled; without memory of its own where none is."""
    if not filled:
        return np.broadcast_to(blank, shape)
    array = np.full(shape, blank)
    array[list(filled)] = list(filled.values())
    return _kept(array * unit)


def _given(rows: Rows, n: int) -> Floats:
    known = {
        row: [np.nan if value is None else value for value in at.given] for row, at in rows.anchors.items()
    }
    return _sparse((n, 6), np.nan, known, np.array([MM] * 3 + [DEG] * 3))


def _used(base: Ints, tool: Ints, frames: tuple[FrameRef, ...]) -> tuple[Ints, Ints, tuple[FrameRef, ...]]:
    """The indices and frames without those that no motion has: nobody needs to know their pose."""
    present = np.zeros(len(frames) + 1, bool)
    present[base] = present[tool] = True  # the last entry is for those that are not known, -1
    kept = np.flatnonzero(present[:-1]).tolist()
    renamed = np.full(len(frames) + 1, -1, dtype=np.int32)
    renamed[kept] = np.arange(len(kept))
    return renamed[base], renamed[tool], tuple(frames[i] for i in kept)


def _other_calls(run: Run, text_called: Iterable[bytes]) -> list[tuple[int, int, Reason]]:
    """First and last line of routines that also run where their values are not known: they can not be corrected for the
    calls that are followed."""
    survey = run.survey
    found = []
    for name in closure(survey, [*text_called, *survey.later]):
        if name in run.followed:
            routine = survey.routines[name]
            last = run.code[min(routine.end, len(run.code) - 1)]
            reason = Reason("KRL015", run.why_walked(routine), f"def {routine.line}")
            found.append((routine.line, last.line, reason))
    return found


def _lock(run: Run) -> None:
    """Literals of variables that other code reads stay as they are."""
    rows, read = run.rows, run.mentioned | run.survey.read
    for row, variable in rows.variables.items():
        if variable.name and _root(variable.name) in read:
            rows.locked.setdefault(row, READ_TOO)
    for row, auxiliary in rows.arcs.items():
        variable_or_none = auxiliary.variable
        if variable_or_none is not None and _root(variable_or_none.name) in read and not auxiliary.locked:
            rows.arcs[row] = replace(auxiliary, locked=READ_TOO)


def _root(name: bytes) -> bytes:
    return name.partition(b".")[0].partition(b"[")[0]


def _runs(rows: Rows, n: int) -> Bools:
    """(N,) all but the motions that never run, or stand in routines of which it is not known when they do."""
    runs = np.ones(n, np.bool_)
    for first, last in rows.apart:
        runs[first : last + 1] = False
    return runs


def _whole(rows: Rows, table: Table) -> dict[int, str]:
    """Rows before which nothing can be inserted."""
    whole = dict(rows.whole)
    if not (table.line[1:] > table.line[:-1]).all():
        ordered = np.sort(table.line)
        again = np.unique(ordered[1:][ordered[1:] == ordered[:-1]])
        if len(again):
            for row in np.flatnonzero(np.isin(table.line, again)).tolist():
                whole.setdefault(row, SEVERAL)
    return dict(sorted(whole.items()))


def _number_texts(rows: Rows, table: Table, spots: Spots) -> None:
    """Gives the rows and auxiliary points that share a literal one number."""
    n = len(rows)
    parent: dict[int, int] = {}
    first: dict[tuple[int, int], int] = {}

    def top(node: int) -> int:
        above = parent.get(node, node)
        while above != node:
            parent[node] = parent.get(above, above)
            node, above = above, parent[node]
        return node

    def take(node: int, files: Iterable[int], starts: Iterable[int]) -> None:
        for place in zip(files, starts, strict=True):
            if place[1] >= 0 and (other := first.setdefault(place, node)) != node:
                one, two = sorted((top(node), top(other)))
                parent[two] = one

    for row, found in table.loose:
        if found.target is not None:
            take(row, found.target.file, found.target.start)
    nodes = dict(zip(rows.arcs, range(n, n + len(rows.arcs)), strict=True))
    for row, node in nodes.items():
        take(node, rows.arcs[row].file, rows.arcs[row].start)
    for node in list(parent):
        if node < n:
            spots.text[node] = top(node)
    for row, node in nodes.items():
        rows.arcs[row] = replace(rows.arcs[row], text=top(node))


def _finder(rows: Rows, table: Table) -> Callable[[int, str, str], Finding]:
    raw, name = rows.document.raw, str(rows.document.path)

    def finding(row: int, code: str, message: str) -> Finding:
        at = int(table.word[row])
        column = at - raw.rfind(b"\n", 0, at)
        return Finding(code, message, name, int(table.line[row]), column, HELP.get(code, ""))

    return finding


def _refused(rows: Rows, table: Table) -> dict[int, Finding]:
    for begin, stop, reason in rows.ranges:
        for row in range(begin, stop):
            rows.reasons.setdefault(row, reason)
    if not rows.reasons:
        return {}
    finding = _finder(rows, table)
    return {row: finding(row, reason.code, reason.message) for row, reason in sorted(rows.reasons.items())}


def _told(rows: Rows, table: Table, refused: dict[int, Finding]) -> list[Finding]:
    """The refusals, those of one code and cause as one finding."""
    groups: dict[tuple[str, str], list[int]] = {}
    for row in refused:
        reason = rows.reasons[row]
        groups.setdefault((reason.code, reason.cause or reason.message), []).append(row)
    findings = []
    for found in groups.values():
        first = refused[found[0]]
        if len(found) == 1:
            findings.append(first)
            continue
        places = table.line[found]
        message = f"{first.message}; {len(found)} motions, lines {places.min()} to {places.max()}"
        findings.append(replace(first, message=message))
    return findings


def _told_external(rows: Rows, table: Table) -> list[Finding]:
    names = {key.decode(): row for key, row in sorted(rows.moving.items()) if row < len(rows)}
    if not names:
        return []
    verb = "moves" if len(names) == 1 else "move"
    message = f"{', '.join(names)} {verb}; robot and base are taken as standing still"
    return [_finder(rows, table)(min(names.values()), "KRL022", message)]


def _pinned(rows: Rows, table: Table, refused: dict[int, Finding]) -> dict[int, Finding]:
    """Rows that a refused motion builds on, or whose reached position the program reads."""
    pins: dict[int, Finding] = {}
    if not rows.builds_on and not rows.reads:
        return pins
    finding = _finder(rows, table)
    seen: set[Source] = set()
    for row in rows.builds_on:
        if row in refused:
            message = f"the motion in line {table.line[row]} builds on this end point and is not corrected"
            for pin in _rows_of(rows, rows.builds_on[row], seen):
                pins.setdefault(pin, finding(pin, rows.reasons[row].code, message))
    seen = set()
    for line, sources in rows.reads:
        for pin in _rows_of(rows, sources, seen):
            message = f"line {line} reads the position that this motion reaches"
            pins.setdefault(pin, finding(pin, "KRL002", message))
    return dict(sorted(pins.items()))


def _rows_of(rows: Rows, sources: frozenset[Source], seen: set[Source]) -> set[int]:
    """The rows after which the robot may stand, marks of labels and routines followed to their callers; what ``seen``
    has was given before."""
    found: set[int] = set()
    todo: list[Source] = list(sources)
    while todo:
        source = todo.pop()
        if source in seen:
            continue
        seen.add(source)
        if isinstance(source, int):
            if source < len(rows):
                found.add(source)
        else:
            todo.extend(rows.sources[source])
    return found
