"""Which lines of a program a page has: all of a short one, of a long one those around what the page speaks of."""

from __future__ import annotations

from collections.abc import Iterable

from postproc.base.dataclass import dataclass
from postproc.base.findings import Finding

WHOLE = 3000
"""A program of so many lines is listed as a whole, and no more lines are listed of a longer one."""
AROUND = 15
"""Lines before and after each place of a longer one."""


@dataclass(frozen=True)
class ListedLine:
    """A line of the program: its number from 1, its text, and its lines in the output; gap: lines before it are left
    out."""

    number: int
    source: str
    written: tuple[str, ...]
    gap: bool


def lines_to_list(total: int, spoken_of: Iterable[int]) -> list[int]:
    """Numbers, from 1, of the lines that are listed of ``total``; of a long one those around the
    first that are ``spoken_of``."""
    if total <= WHOLE:
        return list(range(1, total + 1))
    chosen: set[int] = set()
    for line in spoken_of:
        near = set(range(max(1, line - AROUND), min(total, line + AROUND) + 1))
        if len(chosen | near) > WHOLE:
            break
        chosen |= near
    return sorted(chosen)


def lines_of_findings(findings: Iterable[Finding], program: str) -> list[int]:
    """The lines of the program that findings are about."""
    return [finding.line for finding in findings if finding.file == program and finding.line]
