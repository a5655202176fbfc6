"""Why motions are not corrected, and what else is reported: Finding by Finding only where somebody asks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.base.document import Document
from postproc.base.findings import Finding


class RefusalReason(NamedTuple):
    """Reasons of one code and ``cause`` are reported together; help: what to do, "" for what the code says."""

    code: str
    message: str
    cause: str
    help: str = ""


class Refusals(Mapping[int, Finding]):
    """Row -> why it cannot be corrected.

    rows (R,) ascending, reason (R,) index into ``reasons``; line, column (R,) of the motions.
    """

    def __init__(
        self, file: str, rows: Ints, reason: Ints, reasons: list[RefusalReason], line: Ints, column: Ints
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
        reason = self._reasons[self._reason[at]]
        line, column = int(self._line[at]), int(self._column[at])
        return Finding(reason.code, message, self._file, line, column, reason.help)

    def findings(self) -> list[Finding]:
        """The refusals, those of one code and cause as one finding, by their first line."""
        groups: dict[tuple[str, str], int] = {}
        number = [groups.setdefault((reason.code, reason.cause), len(groups)) for reason in self._reasons]
        if not len(self._rows):
            return []
        group = np.array(number)[self._reason]
        findings = []
        order = np.lexsort((self._line, group))
        _, first, count = np.unique(group[order], return_index=True, return_counts=True)
        ends = order[first + count - 1].tolist()
        for at, many, end in sorted(zip(order[first].tolist(), count.tolist(), ends, strict=True)):
            message = self._reasons[self._reason[at]].message
            if many > 1:
                message += f"; {many} motions, lines {self._line[at]} to {self._line[end]}"
            findings.append(self._finding(at, message))
        return findings


class RefusalCollector:
    """Collects a reason for each of N motions; the first that is given stays."""

    def __init__(self, n: int) -> None:
        self.reasons: list[RefusalReason] = []
        self.why = np.full(n, -1, np.int32)
        self._number: dict[RefusalReason, int] = {}

    def part(self, rows: slice) -> RefusalCollector:
        """Those of some of the motions; what is refused there is refused here."""
        part = RefusalCollector(0)
        part.reasons, part._number, part.why = self.reasons, self._number, self.why[rows]
        return part

    def _reason(self, reason: RefusalReason) -> int:
        if reason not in self._number:
            self._number[reason] = len(self.reasons)
            self.reasons.append(reason)
        return self._number[reason]

    def refuse(self, rows: Bools, code: str, message: str, help: str = "") -> None:
        """Refuses the motions of the mask ``rows`` (N,) that are not refused yet."""
        if rows.any():
            self.why[rows & (self.why < 0)] = self._reason(RefusalReason(code, message, message, help))

    def refuse_each(self, rows: Ints, reasons: list[RefusalReason], which: Ints) -> None:
        """Refuses ``rows`` (K,) for the reasons of number ``which`` (K,)."""
        numbers = np.array([self._reason(reason) for reason in reasons])
        open_ = self.why[rows] < 0
        self.why[rows[open_]] = numbers[which[open_]]

    def done(self, document: Document, line: Ints, start: Ints, at: Ints) -> Refusals:
        """line (N,) and start (N,) [bytes]: of the motions' lines, ``at`` (N,) [bytes] where they start there."""
        rows = np.flatnonzero(self.why >= 0)
        column = at[rows] - start[rows] + 1
        return Refusals(str(document.path), rows, self.why[rows], self.reasons, line[rows], column)
