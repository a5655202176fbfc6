"""The rows of a module as a Toolpath, and the findings."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from postproc.base.arrays import Bools, FewRows, Floats, Ints
from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.base.geometry import Poses
from postproc.base.units import MM
from postproc.languages.core.comments_in_force import VARYING, Varying
from postproc.languages.core.motion_sources import Meeting, Source
from postproc.languages.core.row_facts import (
    OTHER_PATHS,
    LockedRows,
    axis_targets,
    circles,
    follow_on,
    grouped,
    moving_external,
    only_used,
)
from postproc.languages.core.waits import Waits
from postproc.languages.rapid.grip_loads import grip_loads
from postproc.languages.rapid.module_frames import ModuleFrames
from postproc.languages.rapid.module_rows import ModuleRows, module_rows
from postproc.languages.rapid.propagation import Propagation
from postproc.languages.rapid.quaternions import rotation_from_quaternion
from postproc.languages.rapid.remarks import put_remarks
from postproc.languages.rapid.syntax_tree import Remark
from postproc.languages.rapid.target_places import RapidSourceMap
from postproc.toolpath import (
    Arcs,
    Configuration,
    EditConstraints,
    FrameRef,
    Kind,
    MotionSequence,
    MotionSpeeds,
    OrientationControl,
    Targets,
    Toolpath,
)
from postproc.toolpath.initial_state import Symbol

OTHER_QUADRANTS = "its quadrants (cf1, cf4, cf6) are not those of the motion before, and ConfL is on"
NO_WORDS = "its configuration or external axes are not known in numbers"
BLOCK = 1 << 15
"""Motions that are worked on at a time."""
SHORTEST = 0.1 * MM
"""[m] Points of an arc are not nearer to each other."""


def module_toolpath(
    document: Document, flow: Propagation, symbols: Mapping[str, Symbol]
) -> tuple[Toolpath, RapidSourceMap, list[Finding]]:
    """The motions of a module, their places in the text, and the findings."""
    rows, frames = module_rows(document, flow, symbols)
    n = len(rows)
    remarks, remark_findings = put_remarks(document, flow, rows)
    continues = _continues(rows)
    position = rows.numbers[:, :3] * MM
    kind = rows.per_row([fact.form.kind for fact in rows.facts], np.int8)
    arcs = _arcs(rows, frames, position, kind)
    unknown = sorted(rows.problems)
    refused = {row: _finding(document, rows, row, *rows.problems[row]) for row in unknown}
    facts = rows.facts
    zone, stops, waits = _zones(rows, continues, flow.waited)
    toolpath = Toolpath(
        targets=Targets(
            kind=kind,
            position=position,
            rotation=_rotations(rows.numbers[:, 3:]),
            axes=axis_targets(rows.axes, n),
            base=rows.base,
            tool=rows.tool,
            frames=tuple(frames.refs),
            external=rows.external,
        ),
        line=rows.lines,
        speeds=MotionSpeeds(_speeds(rows, flow.refreshed)),
        sequence=MotionSequence(
            approximation=zone,
            stops=stops,
            continues=continues,
            predecessors={
                row: rows.before(row)
                for row in np.flatnonzero(~continues).tolist()
                if rows.fact(row).arguments is not None
            },
            waits=waits,
        ),
        arcs=arcs,
        constraints=EditConstraints(
            refused=refused,
            locked=_locked(document, rows, flow, refused),
            no_insert_before=_no_insert_before(rows, flow.preceding, continues, refused),
        ),
        orientation_control=OrientationControl(
            mode=rows.per_row([fact.orientation for fact in facts], np.int8)
        ),
        configuration=Configuration({"quadrants": rows.quadrants, "cfx": rows.cfx}),
        remarks=remarks,
        stated_loads=grip_loads(document),
    )
    toolpath = only_used(toolpath)
    single = np.flatnonzero(~rows.texts.is_plain(np.arange(n)))
    numbers = FewRows(single, rows.numbers[single], n)
    places = RapidSourceMap(document.raw, numbers, rows.vias, rows.texts, frozenset(flow.usage.read))
    findings = [*remark_findings, *grouped(refused, rows.lines)]
    moving = moving_external(rows.external)
    if moving is not None:
        findings.append(_finding(document, rows, moving[0], "RAP022", moving[1]))
    return toolpath, places, findings


def _speeds(rows: ModuleRows, refreshed: set[Source]) -> Floats:
    """(N,) [m/s], NaN where it is not known: for motions back to the last stop too, where speeds are changed at once
    after them.  refreshed: offsets of motions after which they are."""
    speeds: Floats = rows.per_row([fact.speed * MM for fact in rows.facts], float)
    meetings: set[Meeting] = set()
    pending, done = rows.rows_of(refreshed, meetings), set()
    while pending:
        row = pending.pop()
        fact = rows.fact(row)
        if row in done or fact.stops:
            continue
        done.add(row)
        speeds[row] = np.nan
        if fact.waits != Waits.YES or row != rows.first[rows.fact_of[row]]:
            pending += rows.starts_of(row, meetings)
    return speeds


def _zones(rows: ModuleRows, continues: Bools, waited: set[Source]) -> tuple[Floats, Bools, Bools]:
    """(N,) [m] by which each motion may leave its path before the target, NaN where not known; (N,) where the robot
    stops: where the program waits before the next motion too, whatever zone is stated; (N,) where it waits, or may.
    waited: offsets of motions after which it waits, and goes on where the file does not say."""
    zone = rows.per_row([fact.zone * MM for fact in rows.facts], float)
    stops = rows.per_row([fact.stops for fact in rows.facts], np.bool_)
    waits = np.zeros(len(rows), np.bool_)
    seen: set[Meeting] = set()
    for first, _, fact in rows.each():
        if fact.waits == Waits.NO or first >= rows.never_from:
            continue
        before = rows.starts_of(first, seen)
        waits[before] = True
        before = [row for row in before if zone[row] != 0.0]
        surely = fact.waits == Waits.YES and bool(continues[first])
        zone[before] = 0.0 if surely else np.nan
        stops[before] |= surely
    for row in rows.rows_of(waited, set()):
        zone[row], waits[row] = 0.0 if stops[row] else np.nan, True
    return zone, stops, waits


def _rotations(quaternions: Floats) -> Floats:
    """(N, 3, 3) of quaternions (N, 4)."""
    found = np.empty((len(quaternions), 3, 3))
    for at in range(0, len(quaternions), BLOCK):
        found[at : at + BLOCK] = rotation_from_quaternion(quaternions[at : at + BLOCK])
    found.setflags(write=False)
    return found


def _continues(rows: ModuleRows) -> Bools:
    """(N,) each motion surely starts where the row before it ends, and no other motion starts there."""
    first = [row for row in rows.first[:-1].tolist() if row < rows.never_from]
    before = [rows.before(row) for row in first]
    joined = (np.arange(len(rows)) < rows.never_from) & (not rows.strays)
    found = follow_on(joined, first, before)
    many = {one for fact in rows.facts for one in fact.before if isinstance(one, Meeting)}
    crowd = np.array(rows.rows_of(many, set()), np.int64)
    found[crowd[crowd < len(rows) - 1] + 1] = False
    return found


def _arcs(rows: ModuleRows, frames: ModuleFrames, position: Floats, kind: Ints) -> Arcs:
    """The circles of MoveC: from where the motion before ends through the auxiliary point to the target."""
    n = len(rows)
    at = np.flatnonzero(kind == Kind.CIRC)
    if not len(at):
        return Arcs().for_motions(n)
    starts = np.full((len(at), 3), np.nan)
    for k, row in enumerate(at.tolist()):
        starts[k] = _arc_start(rows, frames, rows.before(row), row, position)
    vias = rows.vias[at] * MM
    centre, normal, sweep = circles(starts, vias, position[at], SHORTEST)
    for row in at[np.isnan(sweep)].tolist():
        rows.refuse(row, "RAP012", "its points define no circle that is known")
    columns = [np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full(n, np.nan)]
    for column, values in zip(columns, (centre, normal, sweep), strict=True):
        column[at] = values
    frame = rows.per_row([fact.arc for fact in rows.facts], np.int8)
    return Arcs(centre=columns[0], normal=columns[1], sweep=columns[2], frame=frame)


def _arc_start(
    rows: ModuleRows, frames: ModuleFrames, before: tuple[int, ...], row: int, position: Floats
) -> Floats:
    """(3,) [m] where an arc starts, in its base; refuses one of which that is not known."""
    nothing = np.full(3, np.nan)
    if len(before) != 1 or before[0] < 0 or rows.fact(before[0]).form.kind == Kind.AXIS:
        rows.refuse(row, "RAP012", "the position at its start is not known in numbers")
        return nothing
    start = before[0]
    if start in rows.problems or min(rows.base[start], rows.tool[start], rows.base[row], rows.tool[row]) < 0:
        rows.refuse(row, "RAP012", "the motion before it, where it starts, is not known")
        return nothing
    if rows.base[start] == rows.base[row] and rows.tool[start] == rows.tool[row]:
        return np.asarray(position[start])
    one, other = (_pose(frames.refs[index]) for index in (rows.base[start], rows.base[row]))
    if rows.tool[start] != rows.tool[row] or one is None or other is None:
        rows.refuse(
            row, "RAP012", "it starts with another tool, or in a work object that only the cell states"
        )
        return nothing
    there = other.inverse() @ one @ Poses(np.eye(3), position[start])
    return np.asarray(there.position)


def _pose(frame: FrameRef) -> Poses | None:
    return Poses.identity() if frame.number == 0 else frame.pose


def _no_insert_before(
    rows: ModuleRows,
    preceding: Mapping[int, Remark | Varying | None],
    continues: Bools,
    refused: Mapping[int, Finding],
) -> dict[int, str]:
    """Rows before which nothing can be inserted.  preceding: offset of a comment -> the one in force before it."""
    same = rows.quadrants >= 0
    same[1:] &= rows.quadrants[1:] == rows.quadrants[:-1]
    same[:1] = False
    no_insert_before: dict[int, str] = {}
    for start, stop, fact in rows.each():
        text = rows.texts[start]
        if text is None or fact.arguments is None:
            continue
        why = ""
        if not text.alone:
            why = "it is not the first statement in its line"
        elif fact.form.starts_process:
            why = "it starts or carries a process whose distances count from its own start"
        elif b"T" in fact.arguments.options:
            why = "its time is stated (\\T)"
        elif any(
            one.start > fact.statement.start and preceding.get(one.start) is VARYING for one in fact.remarks()
        ):
            why = "before the comment in its line several others may be in force"
        wordless = "" if text.target is not None and text.target.words else NO_WORDS
        for row in range(start, stop) if why or wordless else [start]:
            no_insert_before[row] = why or wordless
        if not why and fact.checked is not False:
            no_insert_before.update(dict.fromkeys(_without(same, start, stop), OTHER_QUADRANTS))
        no_insert_before.update(dict.fromkeys(_without(continues, start, stop), OTHER_PATHS))
    return {row: why for row, why in no_insert_before.items() if why and row not in refused}


def _without(mask: Bools, start: int, stop: int) -> list[int]:
    """The rows from ``start`` to before ``stop`` for which ``mask`` does not hold; most often it is one."""
    if stop == start + 1:
        return [] if mask[start] else [start]
    return [start + row for row in np.flatnonzero(~mask[start:stop]).tolist()]


def _locked(
    document: Document,
    rows: ModuleRows,
    flow: Propagation,
    refused: Mapping[int, Finding],
) -> dict[int, Finding]:
    """Rows from whose end a refused arc starts, or where the program reads the position."""
    locked = LockedRows(partial(_finding, document, rows), "RAP012", "RAP002")
    seen: set[Meeting] = set()
    for row in refused:
        if rows.fact(row).form.kind == Kind.CIRC:
            locked.start_arc(rows.starts_of(row, seen), int(rows.lines[row]))
    seen = set()
    for at, places in sorted(flow.reads.items()):
        locked.are_read(rows.rows_of(places, seen), document.place(at)[0])
    return locked.done()


def _finding(document: Document, rows: ModuleRows, row: int, code: str, message: str) -> Finding:
    line = int(rows.lines[row])
    column = int(rows.starts[row]) - int(document.line_starts[line - 1]) + 1
    return Finding(code, message, str(document.path), line, column)
