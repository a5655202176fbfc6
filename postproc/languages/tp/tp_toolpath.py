"""The rows of a TP program as a Toolpath, and what keeps them from being edited."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from postproc.base.arrays import Bools, FewRows
from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.base.geometry import rotation_from_abc
from postproc.base.units import DEG, MM
from postproc.languages.core.row_facts import OTHER_PATHS, grouped, moving_external, only_used
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
            axes=FewRows(
                np.array(sorted(rows.axes), np.int32),
                np.array([rows.axes[row] for row in sorted(rows.axes)]).reshape(-1, 6) * DEG,
                n,
            ),
            base=rows.base,
            tool=rows.tool,
            frames=tuple(rows.frames),
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
            no_insert_before[row] = "its options count from its own start (TB, TA, DB, Arc Start)"
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
    locked: dict[int, Finding] = {}

    def lock(row: int, code: str, message: str) -> None:
        if row not in rows.problems:
            locked.setdefault(row, row_finding(document, rows, row, code, message))

    for row in rows.problems:
        move = rows.moves[row]
        if move is None or move.form not in (b"C", b"A"):
            continue
        others = [one for one in runs.get(row, ()) if one not in rows.problems]
        for one in (*rows.before(row), *others):
            if one >= 0:
                lock(
                    one,
                    "FTP012",
                    f"the arc in line {rows.lines[row]} starts at this end point and is not corrected",
                )
    for row, move in enumerate(rows.moves):
        if move is None or not move.relative:
            continue
        for one in rows.before(row):
            if one >= 0:
                lock(one, "FTP008", f"the motion in line {rows.lines[row]} counts from its end (INC)")
    for at, places in sorted(run.reads.items()):
        for place in sorted(places):
            if place >= 0:
                message = f"line {listing.statements[at].line} reads the end position of this motion"
                lock(int(rows.row_of[place]), "FTP002", message)
    return dict(sorted(locked.items()))
