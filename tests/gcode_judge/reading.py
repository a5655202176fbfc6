"""What the reader of ``postproc`` claims to know of a program: nothing else here names it."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.toolpath import Kind

from .blocks import Made

MM = 1e-3
_LINES = re.compile(r"lines (\d+) to (\d+)")


@dataclass(frozen=True)
class Row:
    """A motion as it is read; lengths in mm.

    code: of the finding that says that the motion is not known or not corrected, "" without.  end, centre, normal (3,),
    NaN where not known.  base, tool: their numbers, -1 where not known.  offset (3,), turn [deg]: the base in the
    machine where the program states it, else NaN.  continues: it follows the row before it, and no other.
    drills: its end is the bottom of a hole.
    """

    line: int
    kind: str
    end: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    sweep: float
    base: int
    tool: int
    code: str
    offset: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    turn: float = float("nan")
    continues: bool = True
    drills: bool = False

    @property
    def claimed(self) -> bool:
        """The reader says that it knows the target, whether it may be corrected or not."""
        return self.located

    @property
    def located(self) -> bool:
        return bool(np.isfinite(self.end).all())


@dataclass(frozen=True)
class Reading:
    """rows in the order of the reader; findings: code -> lines (first, last) that one of them names."""

    rows: tuple[Row, ...]
    findings: tuple[tuple[str, int, int], ...]

    def reported(self, line: int) -> bool:
        """A warning, or a finding of its own, names the line."""
        return any(first <= line <= last for _, first, last in self.findings)

    def may_end_before(self, row: int) -> bool:
        """A finding says that the program may end before a row."""
        lines = [row.line for row in self.rows[: row + 1]]
        ends = [finding[1:] for finding in self.findings if finding[0] == MAY_END]
        return any(first <= line <= last for first, last in ends for line in lines)


MAY_END = "GCO030"
UNSAID = ("GCO020", "GCO021", "GCO022", "GCO023", "GCO027", "GCO028")
"""Findings that say nothing of a motion: unit and tool that are assumed."""


def read(made: Made) -> Reading:
    """The reader's result for a program."""
    path = Path("made.ngc")
    program = DIALECTS["linuxcnc"].read((Document(path, made.text.encode("latin-1")),))
    toolpath = program.toolpath

    def number(index: int) -> int:
        found = toolpath.frames[index].number if index >= 0 else None
        return -1 if found is None else found

    rows = []
    for row in range(len(toolpath)):
        pose = toolpath.frames[toolpath.base[row]].pose if toolpath.base[row] >= 0 else None
        placed = {}
        if pose is not None:
            turn = np.degrees(np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0]))
            placed = {"offset": np.array(pose.position) / MM, "turn": float(turn)}
        rows.append(
            Row(
                line=int(toolpath.line[row]),
                kind=Kind(toolpath.kind[row]).name,
                end=np.array(toolpath.position[row]) / MM,
                centre=np.array(toolpath.arcs.centre[row]) / MM,
                normal=np.array(toolpath.arcs.normal[row]),
                sweep=float(toolpath.arcs.sweep[row]),
                base=number(int(toolpath.base[row])),
                tool=number(int(toolpath.tool[row])),
                code=toolpath.constraints.refused[row].code if row in toolpath.constraints.refused else "",
                continues=not toolpath.paths_meet[row],
                drills=bool(toolpath.drills[row]),
                **placed,
            )
        )
    findings = []
    for finding in program.findings:
        if finding.code in UNSAID:
            continue
        line = finding.line or 0
        span = _LINES.search(finding.message)
        first = int(span[1]) if span and finding.code == MAY_END else line
        findings.append((finding.code, first, int(span[2]) if span else line))
    return Reading(tuple(rows), tuple(findings))
