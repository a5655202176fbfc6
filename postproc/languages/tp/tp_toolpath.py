"""The rows of a TP program as a Toolpath, and what keeps them from being edited."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial

import numpy as np

from postproc.base.arrays import Bools
from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.base.geometry import rotation_from_abc
from postproc.base.units import DEG, MM
from postproc.languages.core.motion_sources import Meeting
from postproc.languages.core.row_facts import (
    OTHER_PATHS,
    LockedRows,
    axis_targets,
    grouped,
    moving_external,
    only_used,
)
from postproc.languages.tp.payload_schedules import payload_schedules
from postproc.languages.tp.tp_arcs import arcs_of
from postproc.languages.tp.tp_listing import TpListing
from postproc.languages.tp.tp_propagation import TpPropagation
from postproc.languages.tp.tp_remarks import annotate
from postproc.languages.tp.tp_rows import TpRows
from postproc.languages.tp.tp_statements import INSERTED_CNT
from postproc.toolpath import (
    Configuration,
    EditConstraints,
    MotionSequence,
    MotionSpeeds,
    OrientationControl,
    OrientationMode,
    Targets,
    Toolpath,
)


def toolpath_of(
    document: Document, listing: TpListing, run: TpPropagation, rows: TpRows
) -> tuple[Toolpath, dict[int, tuple[int, ...]], list[Finding]]:
    """The motions, the runs of A motions (row -> rows), and the findings."""
    n = len(rows)
    remarks, findings = annotate(document, listing, run, rows)
    position = rows.numbers[:, :3] * MM
    rotation = rotation_from_abc(rows.numbers[:, 5:2:-1] * DEG) if n else np.empty((0, 3, 3))
    kinds = rows.kinds
    arcs, runs = arcs_of(rows, position, rotation, kinds)
    continues = rows.continues()
    refused = {row: row_finding(document, rows, row, *rows.problems[row]) for row in sorted(rows.problems)}
    wrist = np.array([move is not None and move.wrist for move in rows.moves], np.bool_)
    blend, stops = rows.approximations(continues)
    path = Toolpath(
        targets=Targets(
            kind=kinds,
            position=position,
            rotation=rotation,
            axes=axis_targets(rows.axes, n),
            base=rows.base,
            tool=rows.tool,
            frames=tuple(rows.frames.refs),
            external=rows.external,
        ),
        line=rows.lines,
        speeds=MotionSpeeds(rows.feed * MM),
        sequence=MotionSequence(
            approximation=blend * MM,
            approximation_number=rows.approximation_numbers(),
            stops=stops,
            continues=continues,
            predecessors={
                row: rows.before(row)
                for row in np.flatnonzero(~continues).tolist()
                if rows.moves[row] is not None
            },
            waits=rows.waiting(),
        ),
        arcs=arcs,
        constraints=EditConstraints(
            refused=refused,
            locked=_locked(document, listing, run, rows, runs),
            no_insert_before=_not_before(rows, continues, refused),
            inserted_number=INSERTED_CNT,
        ),
        orientation_control=OrientationControl(
            mode=np.where(wrist, OrientationMode.JOINT, OrientationMode.VAR).astype(np.int8)
        ),
        configuration=Configuration({"nut": rows.nut, "revolutions": rows.revolutions}),
        remarks=remarks,
        stated_loads=payload_schedules(document),
    )
    findings += grouped(refused, path.line)
    moving = moving_external(rows.external)
    if moving is not None:
        findings.append(row_finding(document, rows, moving[0], "FTP022", moving[1]))
    return only_used(path), runs, findings


def row_finding(document: Document, rows: TpRows, row: int, code: str, message: str) -> Finding:
    return Finding(code, message, str(document.path), int(rows.lines[row]), int(rows.columns[row]))


def _not_before(rows: TpRows, continues: Bools, refused: Mapping[int, Finding]) -> dict[int, str]:
    """Rows before which nothing can be inserted."""
    no_insert_before: dict[int, str] = {}
    for row, move in enumerate(rows.moves):
        if row in refused or move is None:
            continue
        if not continues[row]:
            no_insert_before[row] = OTHER_PATHS
        elif move.own:
            no_insert_before[row] = (
                "its options count from its own start (TB, TA, DB, RT_LD, AP_LD, Arc Start)"
            )
        elif move.unit in (b"sec", b"msec"):
            no_insert_before[row] = "its time is stated"
        elif move.form == b"J":
            no_insert_before[row] = "its path is that of the axes"
        elif rows.nut[row] < 0 or rows.revolutions[row] < 0:
            no_insert_before[row] = "its configuration is not read"
        elif row and rows.nut[row - 1] >= 0 and _differs(rows, row):
            no_insert_before[row] = "its configuration is not that of the motion before"
    return no_insert_before


def _differs(rows: TpRows, row: int) -> bool:
    return (rows.nut[row], rows.revolutions[row]) != (rows.nut[row - 1], rows.revolutions[row - 1])


def _locked(
    document: Document,
    listing: TpListing,
    run: TpPropagation,
    rows: TpRows,
    runs: Mapping[int, tuple[int, ...]],
) -> dict[int, Finding]:
    """Rows from whose end a refused arc starts, or where the program reads the position."""
    locked = LockedRows(partial(row_finding, document, rows), "FTP012", "FTP002")

    def free(places: Iterable[int]) -> list[int]:
        return [row for row in places if row >= 0 and row not in rows.problems]

    visited: set[Meeting] = set()
    done: set[int] = set()  # first rows of runs
    for row in rows.problems:
        move = rows.moves[row]
        if move is not None and move.form in (b"C", b"A"):
            run_of = runs.get(row, ())
            others = () if not run_of or run_of[0] in done else run_of
            done.update(others[:1])
            locked.start_arc(free((*rows.starts_of(row, visited), *others)), int(rows.lines[row]))
    visited = set()
    for row, move in enumerate(rows.moves):
        if move is not None and move.relative:
            message = f"the motion in line {rows.lines[row]} counts from its end (INC)"
            locked.add(free(rows.starts_of(row, visited)), "FTP008", message)
    visited = set()
    for at, places in sorted(run.reads.items()):
        locked.are_read(free(rows.rows_of(places, visited)), listing.statements[at].line)
    return locked.done()
