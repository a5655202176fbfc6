"""The rows of a module as a Toolpath, and the findings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from postproc.base.arrays import FewRows, Floats, Ints
from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.base.geometry import Poses, arc_through
from postproc.base.units import DEG, MM
from postproc.languages.rapid.module_frames import ModuleFrames
from postproc.languages.rapid.module_rows import ModuleRows, module_rows
from postproc.languages.rapid.propagation import Propagation
from postproc.languages.rapid.quaternions import rotation_from_quaternion
from postproc.languages.rapid.remarks import put_remarks
from postproc.languages.rapid.target_places import RapidSourceMap
from postproc.toolpath import (
    Arcs,
    Configuration,
    EditConstraints,
    FrameRef,
    Kind,
    OrientationControl,
    Toolpath,
)
from postproc.toolpath.initial_state import Symbol

OTHER_PATHS = "several paths of the program lead to it or from the motion before it"
SHORTEST = 0.1 * MM
"""[m] Points of an arc are not nearer to each other."""


def module_toolpath(
    document: Document, flow: Propagation, symbols: Mapping[str, Symbol]
) -> tuple[Toolpath, RapidSourceMap, list[Finding]]:
    """The motions of a module, their places in the text, and the findings."""
    rows, frames = module_rows(document, flow, symbols)
    n = len(rows)
    before = [rows.before(row) for row in range(n)]
    remarks, remark_findings = put_remarks(document, flow, rows)
    continues = _continues(before)
    position = rows.numbers[:, :3] * MM
    rotation = rotation_from_quaternion(rows.numbers[:, 3:])
    kind = np.array([fact.form.kind for fact in rows.facts], np.int8)
    arcs = _arcs(rows, frames, before, position, kind)
    unknown = sorted(rows.problems)
    refused = {row: _finding(document, rows, row, *rows.problems[row]) for row in unknown}
    zones = np.array([fact.zone for fact in rows.facts])
    toolpath = Toolpath(
        kind=kind,
        position=position,
        rotation=rotation,
        axes=FewRows(
            np.array(sorted(rows.axes), np.int32),
            np.array([rows.axes[row] for row in sorted(rows.axes)]).reshape(-1, 6) * DEG,
            n,
        ),
        feed=np.array([fact.speed for fact in rows.facts]) * MM,
        base=np.array(rows.base, np.int32),
        tool=np.array(rows.tool, np.int32),
        line=np.array(rows.lines, np.int32),
        frames=tuple(frames.refs),
        arcs=arcs,
        constraints=EditConstraints(
            refused=refused,
            locked=_locked(document, rows, before, flow, refused),
            no_insert_before=_whole(rows, continues, refused),
        ),
        orientation_control=OrientationControl(
            mode=np.array([fact.orientation for fact in rows.facts], np.int8)
        ),
        configuration=Configuration(
            {"quadrants": np.array(rows.quadrants, np.int32), "cfx": np.array(rows.cfx, np.int32)}
        ),
        external=rows.external,
        approximation=zones * MM,
        stops=np.array([fact.stops for fact in rows.facts], np.bool_),
        continues=continues,
        predecessors={
            row: before[row]
            for row in range(n)
            if not continues[row] and rows.facts[row].arguments is not None
        },
        annotations=remarks.annotations,
        comments=remarks.comments,
    )
    toolpath = _only_used(toolpath)
    texts = tuple(rows.texts)
    places = RapidSourceMap(
        rows.numbers, rows.vias, texts, frozenset(flow.usage.read), RapidSourceMap.count_uses(texts)
    )
    findings = [*remark_findings, *_grouped(rows, refused), *_moving_external(document, rows)]
    return toolpath, places, findings


def _only_used(path: Toolpath) -> Toolpath:
    """Without the frames that no motion has: nobody needs to know their pose."""
    used = np.unique(np.concatenate([path.base, path.tool]))
    used = used[used >= 0]
    new = np.full(len(path.frames) + 1, -1, np.int32)
    new[used] = np.arange(len(used))
    return replace(
        path, base=new[path.base], tool=new[path.tool], frames=tuple(path.frames[i] for i in used.tolist())
    )


def _continues(before: list[tuple[int, ...]]) -> np.ndarray:
    """(N,) each motion surely starts where the row before it ends, and no other motion starts there."""
    followers: dict[int, int] = {}
    for places in before:
        for one in places:
            followers[one] = followers.get(one, 0) + 1
    found = [places == (row - 1,) and followers[row - 1] == 1 for row, places in enumerate(before)]
    return np.array(found, np.bool_)


def _arcs(
    rows: ModuleRows, frames: ModuleFrames, before: list[tuple[int, ...]], position: Floats, kind: Ints
) -> Arcs:
    """The circles of MoveC: from where the motion before ends through the auxiliary point to the target."""
    n = len(rows)
    at = np.flatnonzero(kind == Kind.CIRC)
    if not len(at):
        return Arcs().for_motions(n)
    starts = np.full((len(at), 3), np.nan)
    for k, row in enumerate(at.tolist()):
        starts[k] = _arc_start(rows, frames, before[row], row, position)
    vias = rows.vias[at] * MM
    centre, normal, sweep = arc_through(starts, vias, position[at])
    near = np.min(
        [
            np.linalg.norm(a - b, axis=1)
            for a, b in ((starts, vias), (vias, position[at]), (starts, position[at]))
        ],
        axis=0,
    )
    with np.errstate(invalid="ignore"):
        lost = ~np.isfinite(sweep) | ~np.isfinite(centre).all(axis=1) | (near < SHORTEST)
    for row in at[lost].tolist():
        rows.refuse(row, "RAP012", "its points define no circle that is known")
    centre[lost], normal[lost], sweep[lost] = np.nan, np.nan, np.nan
    columns = [np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full(n, np.nan)]
    for column, values in zip(columns, (centre, normal, sweep), strict=True):
        column[at] = values
    frame = np.array([fact.arc for fact in rows.facts], np.int8)
    return Arcs(centre=columns[0], normal=columns[1], sweep=columns[2], frame=frame)


def _arc_start(
    rows: ModuleRows, frames: ModuleFrames, before: tuple[int, ...], row: int, position: Floats
) -> Floats:
    """(3,) [m] where an arc starts, in its base; refuses one of which that is not known."""
    nothing = np.full(3, np.nan)
    if len(before) != 1 or before[0] < 0 or rows.facts[before[0]].form.kind == Kind.AXIS:
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


def _whole(rows: ModuleRows, continues: np.ndarray, refused: Mapping[int, Finding]) -> dict[int, str]:
    """Rows before which nothing can be inserted."""
    whole: dict[int, str] = {}
    for row, fact in enumerate(rows.facts):
        text = rows.texts[row]
        if row in refused or text is None:
            continue
        if not continues[row]:
            whole[row] = OTHER_PATHS
        elif not text.alone:
            whole[row] = "it is not the first statement in its line"
        elif fact.form.starts_process:
            whole[row] = "it starts or carries a process whose distances count from its own start"
        elif fact.arguments is not None and b"T" in fact.arguments.options:
            whole[row] = "its time is stated (\\T)"
        elif fact.checked is not False and not (row and rows.quadrants[row] == rows.quadrants[row - 1] >= 0):
            whole[row] = "its quadrants (cf1, cf4, cf6) are not those of the motion before, and ConfL is on"
        elif text.target is None or not text.target.words:
            whole[row] = "its configuration or external axes are not known in numbers"
    return whole


def _locked(
    document: Document,
    rows: ModuleRows,
    before: list[tuple[int, ...]],
    flow: Propagation,
    refused: Mapping[int, Finding],
) -> dict[int, Finding]:
    """Rows from whose end a refused arc starts, or where the program reads the position."""
    locked: dict[int, Finding] = {}
    for row in refused:
        if rows.facts[row].form.kind != Kind.CIRC:
            continue
        for one in before[row]:
            if one >= 0:
                message = f"the arc in line {rows.lines[row]} starts at this end point and is not corrected"
                locked.setdefault(one, _finding(document, rows, one, "RAP012", message))
    for at, places in sorted(flow.reads.items()):
        for place in sorted(places):
            if place >= 0:
                one = rows.offsets[place]
                message = f"line {document.place(at)[0]} reads the end position of this motion"
                locked.setdefault(one, _finding(document, rows, one, "RAP002", message))
    return dict(sorted(locked.items()))


def _finding(document: Document, rows: ModuleRows, row: int, code: str, message: str) -> Finding:
    return Finding(code, message, str(document.path), rows.lines[row], rows.columns[row])


def _grouped(rows: ModuleRows, refused: Mapping[int, Finding]) -> list[Finding]:
    """The refusals, those of one code and cause as one finding."""
    groups: dict[tuple[str, str], list[int]] = {}
    for row, finding in refused.items():
        groups.setdefault((finding.code, finding.message), []).append(row)
    found = []
    for chosen in groups.values():
        first = refused[chosen[0]]
        if len(chosen) > 1:
            lines = [rows.lines[row] for row in chosen]
            message = f"{first.message}; {len(chosen)} motions, lines {min(lines)} to {max(lines)}"
            first = replace(first, message=message)
        found.append(first)
    return found


def _moving_external(document: Document, rows: ModuleRows) -> list[Finding]:
    """External axes that do not stay where they are first."""
    moving = []
    for axis in range(6):
        values = rows.external[:, axis]
        stated = values[~np.isnan(values)]
        if len(stated) and (not np.isfinite(stated).all() or (stated != stated[0]).any()):
            moving.append((int(np.argmax(~np.isnan(values) & (values != stated[0]))), f"E{axis + 1}"))
    if not moving:
        return []
    verb = "moves" if len(moving) == 1 else "move"
    message = f"{', '.join(name for _, name in moving)} {verb}; the cell must state what external axes carry"
    return [_finding(document, rows, min(moving)[0], "RAP022", message)]
