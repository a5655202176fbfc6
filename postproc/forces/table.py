"""The force CSV: one row a motion, by the line of the program that holds it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from postproc.arrays import Ints
from postproc.findings import Finding, Refusal
from postproc.forces.stated import BASE, NotAForce, Stated, parse_frame
from postproc.forces.wrench import is_air
from postproc.tables import Table, read_table
from postproc.toolpath import Toolpath

COLUMNS = ("line", "fx", "fy", "fz", "mx", "my", "mz", "frame")
FORM = "line,fx,fy,fz[,mx,my,mz][,frame] in N and N m; line is the motion's in the program, from 1"
_SHOWN = 10


def read_force_table(path: Path, toolpath: Toolpath, program: str) -> tuple[Stated, tuple[Finding, ...]]:
    """What the CSV states for every motion; zero for those it does not name (told as FRC007).

    Refusal FRC002 (a column of another version), FRC003 (header or cells), FRC004 (a line without a motion).
    """
    table = read_table(path, "FRC003")
    _check_columns(table)
    lines = _lines(table)
    values = np.zeros((len(table), 6))
    for index, name in enumerate(COLUMNS[1:7]):
        if name in table:
            values[:, index] = table.numbers(name)
    frame = _frames(table)

    # every motion of the program finds its row: a line may hold several motions where a dialect allows it
    order = np.argsort(lines, kind="stable")
    place = np.minimum(np.searchsorted(lines[order], toolpath.line), len(lines) - 1)
    row = order[place]
    found = lines[row] == toolpath.line
    used = np.zeros(len(table), bool)
    used[row[found]] = True
    if not np.all(used):
        raise Refusal(*_no_motion(table, lines, np.flatnonzero(~used), toolpath, program))

    stated = Stated(np.where(found[:, None], values[row], 0.0), np.where(found, frame[row], BASE))
    findings = []
    air = is_air(toolpath)
    lost = np.flatnonzero(air & np.any(stated.values != 0, axis=1))
    if len(lost):
        first = lost[0]
        what = f"line {toolpath.line[first]} of {program} is an air move (PTP or G0); its force was not used"
        more = f" (and {len(lost) - 1} more)" if len(lost) > 1 else ""
        findings.append(Finding("FRC009", what + more, str(path), int(table.lines[row[first]])))
    without = np.flatnonzero(~found & ~air)
    if len(without):
        first_line = f"the first is in line {toolpath.line[without[0]]} of {program}"
        what = f"motions without a row, taken as air: {len(without)}; {first_line}"
        findings.append(Finding("FRC007", what, str(path)))
    return stated, tuple(findings)


def _check_columns(table: Table) -> None:
    for name in ("s_mm", "t_s"):
        if name in table:
            raise Refusal(
                Finding(
                    "FRC002",
                    f"column {name!r} is not supported by this version, which reads 'line'",
                    str(table.path),
                    table.header_line,
                    help=FORM,
                )
            )
    table.only(*COLUMNS)
    needed = COLUMNS[:7] if any(name in table for name in COLUMNS[4:7]) else COLUMNS[:4]
    for name in needed:
        if name not in table:
            raise table.header_error(f"column {name!r} is missing", FORM)


def _lines(table: Table) -> Ints:
    numbers = table.numbers("line")
    wrong = np.flatnonzero((numbers != np.floor(numbers)) | (numbers < 1) | (numbers > 2**53))
    if len(wrong):
        shown = table.texts("line")[wrong[0]]
        raise table.error(int(wrong[0]), "line", f"{shown!r} is not a line number", "whole numbers from 1")
    lines = numbers.astype(np.int64)
    order = np.argsort(lines, kind="stable")
    twice = np.flatnonzero(lines[order][1:] == lines[order][:-1])
    if len(twice):
        first, second = order[twice[0]], order[twice[0] + 1]
        message = f"line {lines[second]} has a row already, in line {table.lines[first]} of this file"
        raise table.error(int(second), "line", message)
    return lines


def _frames(table: Table) -> Ints:
    if "frame" not in table:
        return np.full(len(table), BASE)
    texts = table.texts("frame")
    known = {"": BASE}
    for row, text in enumerate(texts):
        if text not in known:
            try:
                known[text] = parse_frame(text.removeprefix("@"))
            except NotAForce as error:
                raise table.error(row, "frame", str(error)) from None
    return np.array([known[text] for text in texts], dtype=np.int64)


def _no_motion(table: Table, lines: Ints, rows: Ints, toolpath: Toolpath, program: str) -> list[Finding]:
    motions = np.unique(toolpath.line)
    findings = []
    for count, row in enumerate(rows[:_SHOWN], start=1):
        at = int(np.searchsorted(motions, lines[row]))
        near = [str(line) for line in motions[max(at - 1, 0) : at + 1]]
        message = f"line {lines[row]} of {program} holds no motion"
        message += f"; the nearest motions are in line {' and '.join(near)}" if near else ""
        if count == _SHOWN < len(rows):
            message += f" (and {len(rows) - _SHOWN} more such rows)"
        findings.append(Finding("FRC004", message, str(table.path), int(table.lines[row]), help=FORM))
    return findings
