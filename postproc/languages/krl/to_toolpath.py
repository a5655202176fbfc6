"""The rows that were read as a Toolpath, the places of their numbers, and the findings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Floats, Ints, is_shared
from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.languages.core.motion_sources import ELSEWHERE, Meeting, Source
from postproc.languages.core.row_facts import OTHER_PATHS, LockedRows, axis_targets, grouped, used_frames
from postproc.languages.krl.advance_run import stopped_motions
from postproc.languages.krl.comments_at_rows import take_comments
from postproc.languages.krl.controller_data import with_declared, with_loads
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.krl_loads import krl_loads
from postproc.languages.krl.motion_rows import MotionRows, RowRefusal
from postproc.languages.krl.motion_table import MotionTable, Spots
from postproc.languages.krl.predecessors import (
    continuous,
    distinguished_sources,
    expanded,
    predecessors,
    single_sources,
)
from postproc.languages.krl.source_map import KrlSourceMap
from postproc.toolpath import (
    COMPUTED,
    Arcs,
    Configuration,
    EditConstraints,
    Kind,
    MotionSequence,
    MotionSpeeds,
    OrientationControl,
    OrientationMode,
    PartialTargets,
    ProgramComments,
    Targets,
    Toolpath,
)

READ_TOO = "other code reads it too"
SEVERAL = "its line runs several times"


def to_toolpath(run: ExecutionContext, places: bool) -> tuple[Toolpath, KrlSourceMap | None, list[Finding]]:
    """``places``: whether they are wanted."""
    rows = run.rows
    run.code.clear()  # the table takes up its arrays one after the other
    annotations = take_comments(rows)
    table = MotionTable(rows, places)
    single = single_sources(rows)
    _refuse_other_calls(run, table)
    _refuse_several_starts(rows, table, single)
    _lock(run)
    refused = _refused(rows, table)
    table.base, frames = with_declared(run.declarations.frames, b"BASE", table.base, tuple(run.frames.refs))
    table.tool, frames = with_declared(run.declarations.frames, b"TOOL", table.tool, frames)
    frames = with_loads(run.declarations.loads, table.tool, frames)
    table.base, table.tool, used = used_frames(table.base, table.tool, frames)
    table.blend *= MM
    table.inserted *= MM
    n = len(rows)
    anchor = _sparse((n,), np.int32(-1), {row: at.row for row, at in rows.anchors.items()})
    given = _partial_components(rows, n)
    several = _several(table)
    continues = _read_only(continuous(rows, single))
    waits = stopped_motions(rows, continues)
    stopped = _stop(table, waits)
    toolpath = Toolpath(
        targets=Targets(
            kind=_read_only(table.kind),
            position=_read_only(table.position),
            rotation=_read_only(table.rotation),
            axes=axis_targets(table.axes, n),
            base=_read_only(table.base),
            tool=_read_only(table.tool),
            frames=used,
            external=_read_only(table.external),
        ),
        line=_read_only(table.line),
        speeds=MotionSpeeds(_read_only(table.feed)),
        sequence=MotionSequence(
            approximation=_read_only(table.blend),
            stops=_stops(rows, table),
            continues=continues,
            predecessors=predecessors(rows, continues),
            waits=np.isin(np.arange(n), list(waits)) if waits else _sparse((n,), np.bool_(False), {}),
        ),
        constraints=EditConstraints(
            refused=refused,
            locked=_locked(rows, table, refused),
            no_insert_before=_no_insert_before(rows, several, continues),
            spline_headers=_entries(rows, several),
            orientation_programmed=_correctable_orientations(rows, table, single),
            inserted_approximation=_read_only(table.inserted),
        ),
        partial_targets=PartialTargets(anchor, given),
        arcs=Arcs(
            centre=_sparse((n, 3), np.nan, {row: arc[:3] for row, arc in table.ways.items()}, MM),
            normal=_sparse((n, 3), np.nan, {row: arc[3:6] for row, arc in table.ways.items()}),
            sweep=_sparse((n,), np.nan, {row: arc[6] for row, arc in table.ways.items()}, DEG),
            frame=_read_only(table.arc_frame),
        ),
        configuration=Configuration({"status": _read_only(table.status), "turn": _read_only(table.turn)}),
        orientation_control=OrientationControl(mode=_read_only(table.orientation)),
        remarks=ProgramComments(annotations, tuple(rows.comments)),
        stated_loads=krl_loads(rows.document),
    )
    found = None if table.spots is None else _places(rows, table, table.spots)
    return (
        toolpath,
        found,
        [
            *grouped(refused, table.line, lambda row: rows.reasons[row].cause),
            *_external_axis_findings(rows, table),
            *_stop_findings(rows, table, stopped),
        ],
    )


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
    )


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Read-only, so that it need not be copied."""
    array.setflags(write=False)
    return array


def _sparse(
    shape: tuple[int, ...],
    blank: float | np.int32 | np.bool_,
    filled: Mapping[int, Any],
    unit: float | Floats = 1,
) -> NDArray[Any]:
    """``blank`` everywhere but in the rows that are filled; without memory of its own where none is."""
    if not filled:
        return np.broadcast_to(blank, shape)
    array = np.full(shape, blank)
    array[list(filled)] = list(filled.values())
    return _read_only(array * unit)


def _partial_components(rows: MotionRows, n: int) -> Floats:
    known = {
        row: [np.nan if value is None else value for value in at.partial_target]
        for row, at in rows.anchors.items()
    }
    return _sparse((n, 6), np.nan, known, np.array([MM] * 3 + [DEG] * 3))


def _refuse_other_calls(run: ExecutionContext, table: MotionTable) -> None:
    """Motions of a routine that is followed from some of its calls: they also run after the other ones, so what is not
    known there cannot be corrected at all."""
    rows = run.rows
    for start, stop, routine in run.walked_rows:
        if routine.name not in run.followed:
            continue
        ranges = [(max(a, start), min(b, stop)) for a, b, _ in rows.ranges]
        refused = {row for a, b in ranges for row in range(a, b)}
        refused |= {
            row for row, reason in rows.reasons.items() if start <= row < stop and reason.code != "KRL016"
        }
        if not refused:
            continue
        lines = np.unique(table.line[sorted(refused)])
        message = (
            f"it is in the subprogram of line {routine.line}, which also runs with values that are not known"
        )
        for row in np.flatnonzero(np.isin(table.line, lines)).tolist():
            rows.reasons.setdefault(row, RowRefusal("KRL015", message, f"def {routine.line}"))


def _refuse_several_starts(rows: MotionRows, table: MotionTable, single: Bools) -> None:
    """Motions that build on others than the row before them, and are not written without these: arcs, and what starts
    where it is not known which motion precedes it."""
    many: set[Source] = set()
    for row in np.flatnonzero(~single).tolist():
        kind = table.kind[row]
        if row in rows.reasons or kind == Kind.AXIS or not (kind == Kind.CIRC or row in rows.builds_on):
            continue
        before = distinguished_sources(rows, rows.sources_of[row], many)
        if kind != Kind.CIRC and before and ELSEWHERE not in before:
            continue  # on all paths it inherits the same, and the writer completes it where one of them moves
        code = "KRL009" if kind == Kind.CIRC else "KRL008" if row in rows.relative else "KRL004"
        what = {"KRL009": "its start", "KRL008": "what it is relative to", "KRL004": "what it omits"}[code]
        why = f"several motions may precede it, and {what} is corrected with them"
        if rows.sources_of[row] == frozenset([ELSEWHERE]):
            why = f"a motion of another file precedes it, and {what} is not corrected with it"
        rows.reasons[row] = RowRefusal(code, why)
        rows.builds_on[row] = rows.sources_of[row]


def _lock(run: ExecutionContext) -> None:
    """Literals of variables that other code reads stay as they are."""
    rows, read = run.rows, run.named() | run.structure.read | run.variables.mixed
    for row, variable in rows.variables.items():
        if variable.name and _root(variable.name) in read:
            rows.locked.setdefault(row, READ_TOO)
    for row, auxiliary in rows.arcs.items():
        variable_or_none = auxiliary.variable
        if variable_or_none is not None and _root(variable_or_none.name) in read and not auxiliary.locked:
            rows.arcs[row] = auxiliary._replace(locked=READ_TOO)


def _root(name: bytes) -> bytes:
    return name.partition(b".")[0].partition(b"[")[0]


def _no_insert_before(rows: MotionRows, several: Ints, continues: Bools) -> dict[int, str]:
    """Rows before which nothing can be inserted.  ``several``: rows whose line runs several times; ``continues`` (N,):
    the motion surely starts where the row before ends."""
    no_insert_before = dict(rows.no_insert_before)
    for row in np.flatnonzero(~continues).tolist():
        if row not in rows.reasons:
            no_insert_before.setdefault(row, OTHER_PATHS)
    for row in several.tolist():
        no_insert_before.setdefault(row, SEVERAL)
    return dict(sorted(no_insert_before.items()))


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


def _correctable_orientations(rows: MotionRows, table: MotionTable, single: Bools) -> Bools:
    """(N,) motions whose orientation can be corrected by their text: not those that keep the one with which they start
    ($ORI_TYPE=#CONSTANT), nor any motion that may precede them, whose orientation they would take over."""
    keep = (table.orientation == OrientationMode.CONSTANT) & np.isin(
        table.kind, (Kind.LIN, Kind.CIRC, Kind.SPL)
    )
    if not keep.any():
        return np.broadcast_to(True, keep.shape)
    fixed = keep | np.append(keep[1:], False)
    elsewhere = [rows.sources_of.get(row, ()) for row in np.flatnonzero(keep & ~single).tolist()]
    before = expanded(rows, {source for sources in elsewhere for source in sources})
    fixed[_among(range(len(rows)), before)] = True
    return _read_only(~fixed)


def _stop(table: MotionTable, blends: dict[int, float]) -> dict[int, float]:
    """Takes up where approximations are not possible; gives these, those of motions that state none left out."""
    stated = {row: blend for row, blend in blends.items() if table.blend[row] != 0.0}
    for row, blend in stated.items():
        table.blend[row] = blend
    return stated


def _stop_findings(rows: MotionRows, table: MotionTable, stopped: dict[int, float]) -> list[Finding]:
    """Where the program states approximations at which the controller stops, or may."""
    findings = []
    for verb, found in (
        ("stops", [row for row, blend in stopped.items() if blend == 0.0]),
        ("may stop", [row for row, blend in stopped.items() if blend != 0.0]),
    ):
        if found:
            more = f"; {len(found)} motions, lines {table.line[found].min()} to {table.line[found].max()}"
            message = f"the advance run {verb} after it, and so does the robot: it is not approximated"
            if verb != "stops":
                message = f"the advance run {verb} after it: whether it is approximated is not known"
            findings.append(_finder(rows, table)(min(found), "KRL035", message + more * (len(found) > 1)))
    return findings


def _stops(rows: MotionRows, table: MotionTable) -> Bools:
    """(N,) motions at whose end the controller comes to rest."""
    stops = np.equal(table.blend, 0.0)
    stops[list(rows.passing)] = False
    return _read_only(stops)


def _number_texts(rows: MotionRows, table: MotionTable, spots: Spots) -> None:
    """Gives the rows and auxiliary points that share a literal one number."""
    n = len(rows)
    parent: dict[int, int] = {}

    def top(node: int) -> int:
        above = parent.get(node, node)
        while above != node:
            parent[node] = parent.get(above, above)
            node, above = above, parent[node]
        return node

    nodes = dict(zip(rows.arcs, range(n, n + len(rows.arcs)), strict=True))
    auxiliary = [(rows.arcs[row].file, rows.arcs[row].start) for row in nodes]
    scalar = np.array([row for row, _ in table.scalar_rows], np.int64)
    files, starts = (
        [spots_of[scalar].ravel(), np.array([one[i] for one in auxiliary], spots_of.dtype).ravel()]
        for i, spots_of in enumerate((spots.file, spots.start))
    )
    of = np.concatenate([np.repeat(scalar, 6), np.repeat(np.arange(n, n + len(nodes)), 3)])
    for one, other in _sharing(of, np.concatenate(files), np.concatenate(starts)):
        first, second = sorted((top(one), top(other)))
        if first != second:
            parent[second] = first
    for node in list(parent):
        if node < n:
            spots.text[node] = top(node)
    for row, node in nodes.items():
        if (text := top(node)) != rows.arcs[row].text:
            rows.arcs[row] = rows.arcs[row]._replace(text=text)


def _sharing(of: Ints, file: NDArray[np.int8], start: NDArray[Any]) -> Iterable[tuple[int, int]]:
    """Pairs of those of ``of`` (K,) whose literals are at one place: ``file``, ``start`` (K,), -1 for none."""
    there = start >= 0
    of, place = of[there], start[there].astype(np.int64) * 128 + file[there]
    order = np.argsort(place, kind="stable")
    place, of = place[order], of[order]
    same = np.flatnonzero(place[1:] == place[:-1])
    return zip(of[same].tolist(), of[same + 1].tolist(), strict=True)


def _finder(rows: MotionRows, table: MotionTable) -> Callable[[int, str, str], Finding]:
    raw, name = rows.document.raw, str(rows.document.path)

    def finding(row: int, code: str, message: str) -> Finding:
        at = int(table.word[row])
        return Finding(code, message, name, int(table.line[row]), at - raw.rfind(b"\n", 0, at))

    return finding


def _refused(rows: MotionRows, table: MotionTable) -> dict[int, Finding]:
    for start, stop, reason in rows.ranges:
        for row in range(start, stop):
            rows.reasons.setdefault(row, reason)
    if not rows.reasons:
        return {}
    finding = _finder(rows, table)
    return {row: finding(row, reason.code, reason.message) for row, reason in sorted(rows.reasons.items())}


def _external_axis_findings(rows: MotionRows, table: MotionTable) -> list[Finding]:
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


def _locked(rows: MotionRows, table: MotionTable, refused: dict[int, Finding]) -> dict[int, Finding]:
    """Rows that a refused motion builds on, or whose reached position the program reads."""
    if not rows.builds_on and not rows.reads:
        return {}
    locked = LockedRows(_finder(rows, table), "KRL009", "KRL002")
    every = range(len(rows))
    seen: set[Meeting] = set()
    for row in rows.builds_on:
        if row in refused:
            message = f"the motion in line {table.line[row]} depends on this end point and is not corrected"
            locked.add(
                _among(every, expanded(rows, rows.builds_on[row], seen)), rows.reasons[row].code, message
            )
    seen = set()
    for line, sources in rows.reads:
        locked.are_read(_among(every, expanded(rows, sources, seen)), line)
    return locked.done()


def _among(every: range, rows: set[int]) -> list[int]:
    """Those that are rows."""
    return [row for row in rows if row in every]
