"""The force CSV by line: one row a motion, by the line of the program that holds it."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.tables import CsvTable
from postproc.process.force_comments import marked_air
from postproc.process.force_gauge import checked_gauge
from postproc.process.stated_forces import BASE, CHANNELS, LARGEST, NotAForce, StatedForces, parse_frame
from postproc.process.wrenches import is_air
from postproc.toolpath import Toolpath

PLACES = ("line", "s_mm", "t_s")
UNITS_OF_COLUMNS = {
    **dict(zip((*PLACES, "frame"), ("", "mm", "s", ""), strict=True)),
    **dict(zip(CHANNELS, 3 * ("N",) + 3 * ("N m",), strict=True)),
}
"""Column -> its unit."""

FORM = (
    "line (of the motion, from 1) or s_mm (path length) or t_s (time at programmed feed), then fx,fy,fz[,mx,my,mz]"
    "[,frame] in N and N m"
)

_SHOWN = 10


def place_column(table: CsvTable) -> str:
    """Which of PLACES the table has; Refusal where it has none or several, or columns are wrong or missing."""
    table.only(*PLACES, *CHANNELS, "frame")
    places = [name for name in PLACES if name in table]
    if not places:
        raise table.header_error(f"no column states the place: one of {', '.join(PLACES)} is missing", FORM)
    if len(places) > 1:
        raise table.header_error(
            f"columns {' and '.join(places)} both state the place; use only one of them", FORM
        )
    needed = CHANNELS if any(name in table for name in CHANNELS[3:]) else CHANNELS[:3]
    for name in needed:
        if name not in table:
            raise table.header_error(f"column {name!r} is missing", FORM)
    return places[0]


def read_channels(table: CsvTable, spare: int = 0) -> Floats:
    """(N + spare, 6) [N, N m]; moments that are not there are 0, and so are ``spare`` rows at the end."""
    values = np.zeros((len(table) + spare, 6))
    for index, name in enumerate(CHANNELS):
        if name in table:
            numbers = table.numbers(name)
            values[: len(table), index] = numbers
            beyond = np.flatnonzero(np.abs(numbers) > LARGEST)
            if len(beyond):
                row = int(beyond[0])
                raise table.error(
                    row, name, f"{table.columns[name][row][:40]!r} exceeds {LARGEST:g} N or N m"
                )
    return values


def read_force_table(
    table: CsvTable, toolpath: Toolpath, program: str, offset: bool
) -> tuple[StatedForces, tuple[Finding, ...]]:
    """What the CSV states for every motion; zero for those it does not name (reported as FRC007).

    ``offset``: the mean of the rows of air moves is taken off all rows.  Refusal FRC003 (header or cells), FRC004 (a
    line without a motion), FRC020 (no row of an air move).
    """
    findings: list[Finding] = []
    lines, order = _lines(table)
    values = read_channels(table, spare=1)
    frame = np.append(read_frames(table), np.int8(BASE))

    # every motion of the program finds its row: a line may hold several motions where a dialect allows it
    place = np.minimum(np.searchsorted(lines[order], toolpath.line), len(lines) - 1)
    row = order[place]
    has_row = lines[row] == toolpath.line
    used = np.zeros(len(table), bool)
    used[row[has_row]] = True
    if not np.all(used):
        raise Refusal(*_no_motion(table, lines, np.flatnonzero(~used), toolpath, program))

    air = is_air(toolpath) | marked_air(toolpath)
    in_air = np.zeros(len(table), bool)
    in_air[row[has_row & air]] = True
    if offset:
        values[:-1] = checked_gauge(table, values[:-1], in_air, offset, findings)
    values.setflags(write=False)
    stated = StatedForces(values, frame, np.where(has_row & ~air, row, len(table)))
    lost = np.flatnonzero(has_row & air)
    lost = lost[np.any(values[row[lost]] != 0, axis=1)]
    if len(lost) and not offset:
        first = lost[0]
        what = f"line {toolpath.line[first]} of {program} is an air move (PTP, G0 or FORCE OFF); its force is ignored"
        more = f" (and {len(lost) - 1} more)" if len(lost) > 1 else ""
        findings.append(Finding("FRC009", what + more, str(table.path), int(table.lines[row[first]])))
    without = np.flatnonzero(~has_row & ~air)
    if len(without):
        first_line = f"the first is in line {toolpath.line[without[0]]} of {program}"
        what = f"{len(without)} motions have no row and count as air; {first_line}"
        findings.append(Finding("FRC007", what, str(table.path)))
    return stated, tuple(findings)


def _lines(table: CsvTable) -> tuple[Ints, Ints]:
    """(rows,) the line of the program that each row is for, and the rows in the order of these."""
    numbers = table.numbers("line")
    wrong = np.flatnonzero((numbers != np.floor(numbers)) | (numbers < 1) | (numbers > 2**53))
    if len(wrong):
        shown = table.columns["line"][int(wrong[0])]
        raise table.error(
            int(wrong[0]), "line", f"{shown!r} is not a line number", "write whole numbers from 1"
        )
    lines = numbers.astype(np.int64)
    order = np.argsort(lines, kind="stable")
    twice = np.flatnonzero(lines[order][1:] == lines[order][:-1])
    if len(twice):
        first, second = order[twice[0]], order[twice[0] + 1]
        message = f"line {lines[second]} has a row already, in line {table.lines[first]} of this file"
        raise table.error(int(second), "line", message)
    return lines, order


def read_frames(table: CsvTable) -> Ints:
    """(rows,) the frame of each row, an index into FRAMES; Refusal FRC003 where it is none."""
    if "frame" not in table:
        return np.broadcast_to(np.int8(BASE), len(table))
    known, frames = {"": BASE}, bytearray()
    for row, text in enumerate(table.columns["frame"]):
        frame = known.get(text)
        if frame is None:
            try:
                frame = known[text] = parse_frame(text.removeprefix("@"))
            except NotAForce as error:
                raise table.error(row, "frame", str(error)) from None
        frames.append(frame)
    return np.frombuffer(bytes(frames), np.int8)


def _no_motion(table: CsvTable, lines: Ints, rows: Ints, toolpath: Toolpath, program: str) -> list[Finding]:
    motions = np.unique(toolpath.line)
    findings = []
    for count, row in enumerate(rows[:_SHOWN], start=1):
        at = int(np.searchsorted(motions, lines[row]))
        near = [str(line) for line in motions[max(at - 1, 0) : at + 1]]
        message = f"line {lines[row]} of {program} contains no motion"
        message += f"; the nearest motions are in line {' and '.join(near)}" if near else ""
        if count == _SHOWN < len(rows):
            message += f" (and {len(rows) - _SHOWN} more such rows)"
        findings.append(Finding("FRC004", message, str(table.path), int(table.lines[row]), help=FORM))
    return findings
