"""Why motions are not corrected, and what else is told: Finding by Finding only where somebody asks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from postproc.arrays import Bools, Ints
from postproc.document import Document
from postproc.findings import Finding

HELP = {
    "GCO001": "Check what it does; if it moves, write it as G0 to G3 with numbers.",
    "GCO002": "Write X, Y and Z in the first motion after that.",
    "GCO003": "Nothing needs to be done.",
    "GCO004": "Nothing needs to be done.",
    "GCO005": "Let the post-processor write numbers.",
    "GCO006": "Write the cut as a straight run of blocks.",
    "GCO007": "Write the subprogram's blocks in the place of the call; or state modes and X, Y, Z behind it.",
    "GCO008": "Let the post-processor write cycles as single motions, or leave them uncorrected.",
    "GCO009": "Let the post-processor write the path of the tool's centre (compensation in the CAM system).",
    "GCO010": "Let the post-processor write coordinates of the base itself.",
    "GCO011": "Nothing needs to be done.",
    "GCO012": "Check begin, end and centre of the arc, and G17, G18, G19.",
    "GCO013": "Let the post-processor write tip coordinates (G43.4), or all motions with the rotary axes at 0.",
    "GCO014": "State the offset with G54 to G59; offsets lie in the cell, not in the program.",
    "GCO015": "Load a tool by number before the cut.",
    "GCO016": "Let the post-processor write it as G1, G2 and G3, or leave it uncorrected.",
    "GCO017": "Write every word once.",
    "GCO018": "Write G0, G1, G2 or G3 before it.",
    "GCO019": "Move to known X, Y and Z before G92, or leave G92 away and let the cell say where the base is.",
    "GCO020": "Write G21 or G20.",
    "GCO021": "Load a tool with T, or see that the cell's tool 1 is meant.",
    "GCO022": "Say `dialect: {name: fanuc, integer_words: um}` in the cell if the control counts increments.",
    "GCO023": "See that the cell's tool has the length that is meant.",
    "GCO024": "Offsets and tools lie in the cell; see that both agree.",
    "SIN001": "See that the cell's tools of these numbers are those; or write T=1.",
    "GCO025": "Nothing needs to be done.",
    "GCO026": "See that no such axis carries the robot or the workpiece.",
}


class Reason(NamedTuple):
    """Reasons of one code and ``cause`` are told together."""

    code: str
    message: str
    cause: str


class Refusals(Mapping[int, Finding]):
    """Row -> why it can not be corrected.

    rows (R,) ascending, reason (R,) index into ``reasons``; line, column (R,) of the motions.
    """

    def __init__(
        self, file: str, rows: Ints, reason: Ints, reasons: list[Reason], line: Ints, column: Ints
    ) -> None:
        self._file, self._rows, self._reason, self._reasons = file, rows, reason, reasons
        self._line, self._column = line, column

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[int]:
        return iter(self._rows.tolist())

    def __contains__(self, row: object) -> bool:
        return isinstance(row, int | np.integer) and self._at(int(row)) >= 0

    def __getitem__(self, row: int) -> Finding:
        at = self._at(row)
        if at < 0:
            raise KeyError(row)
        return self._finding(at, self._reasons[self._reason[at]].message)

    def _at(self, row: int) -> int:
        at = int(np.searchsorted(self._rows, row))
        return at if at < len(self._rows) and self._rows[at] == row else -1

    def _finding(self, at: int, message: str) -> Finding:
        code = self._reasons[self._reason[at]].code
        return Finding(code, message, self._file, int(self._line[at]), int(self._column[at]), HELP[code])

    def told(self) -> list[Finding]:
        """The refusals, those of one code and cause as one finding, by their first line."""
        groups: dict[tuple[str, str], int] = {}
        number = [groups.setdefault((reason.code, reason.cause), len(groups)) for reason in self._reasons]
        if not len(self._rows):
            return []
        group = np.array(number)[self._reason]
        findings = []
        _, first, count = np.unique(group, return_index=True, return_counts=True)
        last = len(group) - 1 - np.unique(group[::-1], return_index=True)[1]
        for at, many, end in sorted(zip(first.tolist(), count.tolist(), last.tolist(), strict=True)):
            message = self._reasons[self._reason[at]].message
            if many > 1:
                message += f"; {many} motions, lines {self._line[at]} to {self._line[end]}"
            findings.append(self._finding(at, message))
        return findings


class Doubts:
    """Collects a reason for each of N motions; the first that is given stays."""

    def __init__(self, n: int) -> None:
        self.reasons: list[Reason] = []
        self.why = np.full(n, -1, np.int32)
        self._number: dict[Reason, int] = {}

    def part(self, rows: slice) -> Doubts:
        """Those of some of the motions; what is refused there is refused here."""
        part = Doubts(0)
        part.reasons, part._number, part.why = self.reasons, self._number, self.why[rows]
        return part

    def _reason(self, reason: Reason) -> int:
        if reason not in self._number:
            self._number[reason] = len(self.reasons)
            self.reasons.append(reason)
        return self._number[reason]

    def refuse(self, rows: Bools, code: str, message: str, cause: str = "") -> None:
        """Refuses the motions of the mask ``rows`` that are not refused yet."""
        if rows.any():
            self.why[rows & (self.why < 0)] = self._reason(Reason(code, message, cause or message))

    def refuse_each(self, rows: Ints, messages: list[tuple[str, str, str]], which: Ints) -> None:
        """Refuses ``rows`` for the reasons (code, message, cause) of number ``which``."""
        numbers = np.array([self._reason(Reason(*message)) for message in messages])
        open_ = self.why[rows] < 0
        self.why[rows[open_]] = numbers[which[open_]]

    def done(self, document: Document, line: Ints, start: Ints, at: Ints) -> Refusals:
        """line, start (N,): of the motions' lines, ``at`` where they begin there."""
        rows = np.flatnonzero(self.why >= 0)
        column = at[rows] - start[rows] + 1
        return Refusals(str(document.path), rows, self.why[rows], self.reasons, line[rows], column)
