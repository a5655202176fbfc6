"""The rows that were read as a Toolpath, the places of their numbers, and the findings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, FewRows, Floats, Ints, is_shared
from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.modal_state import Source
from postproc.languages.krl.motion_rows import MotionRows, RowRefusal
from postproc.languages.krl.motion_table import MotionTable, Spots
from postproc.languages.krl.program_structure import closure
from postproc.languages.krl.source_map import KrlSourceMap
from postproc.toolpath import (
    COMPUTED,
    Arcs,
    Configuration,
    EditConstraints,
    FrameRef,
    Kind,
    OrientationControl,
    OrientationMode,
    PartialTargets,
    Toolpath,
)

READ_TOO = "other code reads it too"
SEVERAL = "its line runs several times"


def to_toolpath(
    run: ExecutionContext, text_called: Iterable[bytes], places: bool
) -> tuple[Toolpath, KrlSourceMap | None, list[Finding]]:
    """``text_called``: routines that were called where it is not known that, or with what, they run; ``places``:
    whether they are wanted."""
    rows = run.rows
    elsewhere = _other_calls(run, text_called)
    run.code.clear()  # the table takes up its arrays one after the other
    table = MotionTable(rows, places)
    for start, stop, reason in elsewhere:
        for row in np.flatnonzero((table.line >= start) & (table.line <= stop)).tolist():
            if (
                rows.reasons.setdefault(row, reason).code == "KRL023"
            ):  # not reached by the calls that are followed
                rows.reasons[row] = reason
    _lock(run)
    refused = _refused(rows, table)
    table.base, table.tool, used = _used(table.base, table.tool, run.frames.refs())
    table.blend *= MM
    n = len(rows)
    anchor = _sparse((n,), np.int32(-1), {row: at.row for row, at in rows.anchors.items()})
    given = _given(rows, n)
    axes = np.array(list(table.axes.values())).reshape(-1, 6) * DEG
    several = _several(table)
    toolpath = Toolpath(
        kind=_kept(table.kind),
        position=_kept(table.position),
        rotation=_kept(table.rotation),
        axes=FewRows(np.array(list(table.axes), np.int32), _kept(axes), n),
        feed=_kept(table.feed),
        base=_kept(table.base),
        tool=_kept(table.tool),
        line=_kept(table.line),
        frames=used,
        constraints=EditConstraints(
            refused=refused,
            locked=_pinned(rows, table, refused),
            no_insert_before=_whole(rows, several),
            spline_headers=_entries(rows, several),
            orientation_programmed=_oriented(table),
        ),
        annotations=tuple(rows.annotations),
        partial_targets=PartialTargets(anchor, given),
        arcs=Arcs(
            centre=_sparse((n, 3), np.nan, {row: arc[:3] for row, arc in table.ways.items()}, MM),
            normal=_sparse((n, 3), np.nan, {row: arc[3:6] for row, arc in table.ways.items()}),
            sweep=_sparse((n,), np.nan, {row: arc[6] for row, arc in table.ways.items()}, DEG),
            frame=_kept(table.arc_frame),
        ),
        approximation=_kept(table.blend),
        comments=tuple(rows.comments),
        executes=_runs(rows, n),
        stops=_stops(rows, table),
        configuration=Configuration({"status": _kept(table.status), "turn": _kept(table.turn)}),
        orientation_control=OrientationControl(mode=_kept(table.orientation)),
        external=_kept(table.external),
    )
    found = None if table.spots is None else _places(rows, table, table.spots)
    return toolpath, found, [*_reported(rows, table, refused), *_told_external(rows, table)]


def _places(rows: MotionRows, table: MotionTable, spots: Spots) -> KrlSourceMap:
    _number_texts(rows, table, spots)
    return KrlSourceMap(
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


def _given(rows: MotionRows, n: int) -> Floats:
    known = {
        row: [np.nan if value is None else value for value in at.partial_target]
        for row, at in rows.anchors.items()
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


def _other_calls(run: ExecutionContext, text_called: Iterable[bytes]) -> list[tuple[int, int, RowRefusal]]:
    """First and last line of routines that also run where their values are not known: they cannot be corrected for the
    calls that are followed."""
    survey = run.survey
    found = []
    for name in closure(survey, [*text_called, *survey.later]):
        if name in run.followed:
            routine = survey.routines[name]
            last = run.code[min(routine.end, len(run.code) - 1)]
            reason = RowRefusal("KRL015", run.why_walked(routine), f"def {routine.line}")
            found.append((routine.line, last.line, reason))
    return found


def _lock(run: ExecutionContext) -> None:
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


def _runs(rows: MotionRows, n: int) -> Bools:
    """(N,) all but the motions that never run, or are in routines of which it is not known when they do."""
    runs = np.ones(n, np.bool_)
    for first, last in rows.apart:
        runs[first : last + 1] = False
    return runs


def _whole(rows: MotionRows, several: Ints) -> dict[int, str]:
    """Rows before which nothing can be inserted.  ``several``: rows whose line runs several times."""
    whole = dict(rows.whole)
    for row in several.tolist():
        whole.setdefault(row, SEVERAL)
    return dict(sorted(whole.items()))


def _several(table: MotionTable) -> Ints:
    """Rows whose line runs several times."""
    if (table.line[1:] > table.line[:-1]).all():
        return np.empty(0, np.int64)
    ordered = np.sort(table.line)
    again = np.unique(ordered[1:][ordered[1:] == ordered[:-1]])
    return np.flatnonzero(np.isin(table.line, again))


def _entries(rows: MotionRows, several: Ints) -> dict[int, int]:
    """First points of spline blocks that run once."""
    again = set(several.tolist()) if rows.entries else set()
    return {row: line for row, line in rows.entries.items() if row not in again}


def _oriented(table: MotionTable) -> Bools:
    """(N,) motions whose orientation can be corrected by their text: not those that keep the one with which they start
    ($ORI_TYPE=#CONSTANT), nor the motion before, whose orientation all of them would take over."""
    keep = (table.orientation == OrientationMode.CONSTANT) & np.isin(
        table.kind, (Kind.LIN, Kind.CIRC, Kind.SPL)
    )
    if not keep.any():
        return np.broadcast_to(True, keep.shape)
    return _kept(~(keep | np.append(keep[1:], False)))


def _stops(rows: MotionRows, table: MotionTable) -> Bools:
    """(N,) motions at whose end the controller comes to rest."""
    stops = np.equal(table.blend, 0.0)
    stops[list(rows.passing)] = False
    return _kept(stops)


def _number_texts(rows: MotionRows, table: MotionTable, spots: Spots) -> None:
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


def _finder(rows: MotionRows, table: MotionTable) -> Callable[[int, str, str], Finding]:
    raw, name = rows.document.raw, str(rows.document.path)

    def finding(row: int, code: str, message: str) -> Finding:
        at = int(table.word[row])
        column = at - raw.rfind(b"\n", 0, at)
        return Finding(code, message, name, int(table.line[row]), column)

    return finding


def _refused(rows: MotionRows, table: MotionTable) -> dict[int, Finding]:
    for start, stop, reason in rows.ranges:
        for row in range(start, stop):
            rows.reasons.setdefault(row, reason)
    if not rows.reasons:
        return {}
    finding = _finder(rows, table)
    return {row: finding(row, reason.code, reason.message) for row, reason in sorted(rows.reasons.items())}


def _reported(rows: MotionRows, table: MotionTable, refused: dict[int, Finding]) -> list[Finding]:
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


def _told_external(rows: MotionRows, table: MotionTable) -> list[Finding]:
    """What ``check`` says of external axes that do not stay where they are first."""
    first: dict[str, int] = {}
    if not is_shared(table.external):
        for axis, values in enumerate(table.external.T):
            there = np.isfinite(values) | (values == COMPUTED)
            away = there & (values != values[np.argmax(there)])
            if away.any() or (values == COMPUTED).any():
                first[f"E{axis + 1}"] = int(np.argmax(away | (values == COMPUTED)))
    elif (computed := np.isin(table.external[:1], COMPUTED)).any():
        first = {f"E{axis + 1}": 0 for axis in np.flatnonzero(computed[0])}
    if not first:
        return []
    verb = "moves" if len(first) == 1 else "move"
    message = f"{', '.join(first)} {verb}; the cell must state what external axes carry"
    return [_finder(rows, table)(min(first.values()), "KRL022", message)]


def _pinned(rows: MotionRows, table: MotionTable, refused: dict[int, Finding]) -> dict[int, Finding]:
    """Rows that a refused motion builds on, or whose reached position the program reads."""
    pins: dict[int, Finding] = {}
    if not rows.builds_on and not rows.reads:
        return pins
    finding = _finder(rows, table)
    seen: set[Source] = set()
    for row in rows.builds_on:
        if row in refused:
            message = f"the motion in line {table.line[row]} depends on this end point and is not corrected"
            for pin in _rows_of(rows, rows.builds_on[row], seen):
                pins.setdefault(pin, finding(pin, rows.reasons[row].code, message))
    seen = set()
    for line, sources in rows.reads:
        for pin in _rows_of(rows, sources, seen):
            message = f"line {line} reads the end position of this motion"
            pins.setdefault(pin, finding(pin, "KRL002", message))
    return dict(sorted(pins.items()))


def _rows_of(rows: MotionRows, sources: frozenset[Source], seen: set[Source]) -> set[int]:
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
