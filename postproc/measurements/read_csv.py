"""Reads the CSV of readings: comments, header and rows, each refused where they are wrong."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding, Refusal, nearest
from postproc.base.geometry import rotation_from_abc
from postproc.base.tables import CsvTable, is_missing, read_table
from postproc.base.units import DEG, MM
from postproc.measurements.header import WRENCH, direction_columns, split_columns, value_columns
from postproc.measurements.header_comments import HeaderComments, stated_in
from postproc.measurements.readings import Readings, joint_units, numbered
from postproc.measurements.repeats import with_repeats

_SHOWN = 5


def read_measurements(path: Path, joints: Sequence[tuple[str, bool]]) -> Readings:
    """Reads the CSV of a robot with these ``joints``: (name, whether it slides), in the order of the chain.

    Raises Refusal: FIL001..FIL003 (no text), MEA001 (comments, header or rows are wrong), MEA002 (no readings yet).
    """
    axes, table, deflection, extra = split_columns(read_table(path, "MEA001"), joints)
    stated = stated_in(table)
    findings = list(stated.findings)
    if extra.columns:
        these = "these columns are" if len(extra.columns) > 1 else "this column is"
        message = (
            f"the format has no {', '.join(extra.columns)}: {these} ignored, and kept in the CSV of residuals"
        )
        findings.append(Finding("MEA010", message, str(path), table.header_line))
    if deflection and stated.frame == "tracker":
        message = "# frame: tracker is ignored: DX, DY, DZ are in the axes of the robot base"
        findings.append(Finding("MEA009", message, str(path)))

    # rows without a reading are excluded, but their values are checked as well
    values, angles = value_columns(deflection)
    q = np.stack([axes.numbers(name) for name in axes.columns], axis=1) * joint_units(joints)
    wrench = np.nan_to_num(_block(table, WRENCH))
    value = _block(table, values) * MM
    sigma = _sigma(table, stated.sigma)
    rotation = rotation_from_abc(_turns(table, angles)) if angles[0] in table else None
    direction = _directions(table, len(joints))
    names = _names(table, "TARGET", "the name of the target is missing in this row")
    visits = _names(table, "SESSION", "state it in every row, or remove the column", may_be_empty=True)

    still = np.array([name in stated.on_base for name in names])
    lost = _placeholders(value, wrench, deflection) & ~(still & deflection)
    if lost.any():
        lines = table.lines[lost]
        message = (
            f"a lost beam is written as 0, 0, 0 ({_lines(lines)}):"
            f" {'this reading is' if len(lines) == 1 else f'these {len(lines)} readings are'} excluded"
        )
        findings.append(Finding("MEA011", message, str(path), int(lines[0]), help="remove the zeros"))
        value = np.where(lost[:, None], np.nan, value)
    measured = ~np.isnan(value).all(axis=1)
    rows = np.flatnonzero(measured)
    if not len(rows):
        message = (
            f"the file contains no readings yet: {', '.join(values)} are empty in all rows ({len(table)})"
        )
        raise Refusal(Finding("MEA002", message, str(path), help="fill in the measured values"))
    if len(rows) + lost.sum() < len(table):
        unmeasured = table.lines[~(measured | lost)]
        message = f"{len(unmeasured)} rows have no reading and are excluded ({_lines(unmeasured)})"
        findings.append(Finding("MEA003", message, str(path), int(unmeasured[0])))

    targets, target = numbered(_of(names, rows))
    if "TARGET" not in table:
        targets = ()
    sessions, session = numbered(_of(visits, rows))
    findings += _check_targets(table, stated, names)
    time = _complete(table, "T", rows)
    temperature = _complete(table, "TEMP", rows)
    findings += _check_time(table, time, session, rows)
    readings = Readings(
        files=(path,),
        digests=(table.digest,),
        robot=stated.robot,
        joints=tuple(joints),
        deflection=deflection,
        in_robot_frame=stated.frame == "robot",
        tool=stated.tool,
        targets=targets,
        places={name: place for name, place in stated.places.items() if name in targets},
        q=q[rows],
        wrench=wrench[rows],
        value=value[rows],
        rotation=None if rotation is None else rotation[rows],
        target=target,
        sigma=sigma[rows],
        sigma_turn=stated.sigma_turn,
        repeat=np.full(len(rows), -1),
        session=session,
        sessions=sessions,
        time=time,
        temperature=temperature,
        direction=None if direction is None else direction[rows],
        file=np.zeros(len(rows), np.int64),
        line=table.lines[rows],
        findings=tuple(findings),
        on_base=frozenset(name for name in stated.on_base if name in targets),
        extras={name: tuple(_of(extra.texts(name), rows)) for name in extra.columns},
    )
    return with_repeats(readings, _of(table.texts("REPEAT"), rows) if "REPEAT" in table else [])


def _placeholders(value: Floats, wrench: Floats, deflection: bool) -> Bools:
    """(rows,) values that are zero in every coordinate where no reading is: of a deflection only under a load, and not
    where all of a file are."""
    zero = (value == 0.0).all(axis=1)
    if deflection:
        zero &= wrench.any(axis=1)
    return np.asarray(zero & (~zero & ~np.isnan(value).all(axis=1)).any())


def _column(table: CsvTable, name: str) -> Floats:
    """(rows,), NaN where a cell or the column is missing."""
    return table.numbers_or_nan(name) if name in table else np.full(len(table), np.nan)


def _block(table: CsvTable, names: Sequence[str]) -> Floats:
    """(rows, len(names)), NaN where a cell or a column is missing."""
    return np.stack([_column(table, name) for name in names], axis=1)


def _sigma(table: CsvTable, stated: float) -> Floats:
    """(rows,) [m]: the cell, else what the file states."""
    sigma = _column(table, "SIGMA")
    wrong = np.flatnonzero(sigma <= 0)
    if len(wrong):
        shown = table.texts("SIGMA")[wrong[0]]
        raise table.error(int(wrong[0]), "SIGMA", f"{shown} is not above zero")
    return np.where(np.isnan(sigma), stated, sigma * MM)


def _turns(table: CsvTable, names: Sequence[str]) -> Floats:
    """(rows, 3) [rad] A, B, C, NaN where all three are missing."""
    turns = _block(table, names) * DEG
    missing = np.isnan(turns)
    gaps = np.argwhere(missing & ~missing.all(axis=1, keepdims=True))
    if len(gaps):
        row, column = gaps[0]
        help = f"{', '.join(names)}: state all three, or none"
        raise table.error(int(row), names[column], "the cell is empty", help)
    return turns


def _directions(table: CsvTable, count: int) -> Floats | None:
    """(rows, n) sense of approach, 0 where it is not stated; None where it nowhere is."""
    names = direction_columns(count)
    block = _block(table, names)
    if np.isnan(block).all():
        return None
    sense = np.nan_to_num(block)
    wrong = np.argwhere(~np.isin(sense, (-1.0, 0.0, 1.0)))
    if len(wrong):
        row, column = wrong[0]
        shown = table.texts(names[column])[row]
        raise table.error(
            int(row), names[column], f"{shown!r} is not a direction of approach", "use -1, 0 or 1"
        )
    return sense


def _names(table: CsvTable, name: str, help: str, may_be_empty: bool = False) -> Sequence[str]:
    """The cells of a column of names, all "" without it, or if no cell is filled in and it ``may_be_empty``."""
    nothing = [""] * len(table)
    if name not in table:
        return nothing
    cells = table.texts(name)
    empty = [row for row, cell in enumerate(cells) if is_missing(cell)]
    if may_be_empty and len(empty) == len(cells):
        return nothing
    if empty:
        raise table.error(empty[0], name, "the cell is empty", help)
    return cells


def _complete(table: CsvTable, name: str, rows: Ints) -> Floats | None:
    """A number of every reading, None where no reading has one."""
    numbers = _column(table, name)[rows]
    empty = np.isnan(numbers)
    if empty.all():
        return None
    if empty.any():
        help = "state it for every reading, or remove the column"
        raise table.error(int(rows[np.argmax(empty)]), name, "the cell is empty", help)
    return numbers


def _check_targets(table: CsvTable, stated: HeaderComments, names: Sequence[str]) -> list[Finding]:
    """Names that differ from a stated one by case are refused; stated places of no row are reported (MEA005)."""
    spelled = {name.casefold(): name for name in stated.places}
    used = dict.fromkeys(names)
    for name in used:
        other = spelled.get(name.casefold())
        if other is not None and name not in stated.places:
            help = f"line {stated.lines[other]} states the place of {other!r}; write both alike"
            message = f"{name!r} differs from {other!r} by its case"
            raise table.error(names.index(name), "TARGET", message, help)
    findings = []
    for name, line in stated.lines.items():
        if name not in used:
            what = nearest(name, used) if "TARGET" in table else "; the file has no column TARGET"
            message = f"no row has the target {name!r}{what}"
            findings.append(Finding("MEA005", message, str(table.path), line))
    return findings


def _check_time(table: CsvTable, time: Floats | None, session: Ints, rows: Ints) -> list[Finding]:
    """Whether T falls from one reading of a session to the next (MEA006)."""
    if time is None:
        return []
    order = np.argsort(session, kind="stable")
    back = (np.diff(time[order]) < 0) & (np.diff(session[order]) == 0)
    if not back.any():
        return []
    row = int(rows[np.min(order[1:][back])])
    message = f"column T: {table.texts('T')[row]} is before the time of the reading above it"
    more = f" (and {back.sum() - 1} more)" if back.sum() > 1 else ""
    help = "sort the rows into the order in which they were measured"
    return [Finding("MEA006", message + more, str(table.path), int(table.lines[row]), help=help)]


def _of(cells: Sequence[str], rows: Ints) -> list[str]:
    return [cells[row] for row in rows.tolist()]


def _lines(lines: Ints) -> str:
    shown = ", ".join(str(line) for line in lines[:_SHOWN])
    more = f" and {len(lines) - _SHOWN} more" if len(lines) > _SHOWN else ""
    return f"line{'s' if len(lines) > 1 else ''} {shown}{more}"
