"""CSV files as columns: every mistake is reported with file, line and column name.

A header row, then rows with as many cells.  Comma, semicolon or tab, whichever gives the header most cells;
where it is not the comma, a decimal comma is understood, in all numbers of a file or in none.  Blank lines and lines
that start with ``#`` are skipped, above the header also those that a spreadsheet has put in quotes, and the ``sep=;``
of Excel.  An apostrophe before = + - @, by which a spreadsheet is informed that a cell is no formula, is not part of
the cell.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats, Ints, frozen
from postproc.base.findings import Finding, Refusal, nearest
from postproc.base.read_files import read_text_file
from postproc.base.tables.csv_cells import CsvColumn, find_cells
from postproc.base.tables.csv_lines import LINE_ENDS, NOTHING, CsvLines, comment, separator_of
from postproc.base.tables.csv_spelling import is_missing, is_number

_SEPARATOR = re.compile(r'"?sep=["\']?[;,|\t]["\']?[;,\t]*$', re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class CsvTable:
    """``columns``: name in lower case -> cells as text, blanks stripped; ``lines`` (rows,): line of the file, from 1.

    ``comments``: (line, text after the #).  ``code`` is the one that errors in this table carry.  ``digest``: SHA-256
    of the bytes that were read.
    """

    path: Path
    code: str
    columns: Mapping[str, CsvColumn]
    lines: Ints
    header_line: int
    separator: str
    comments: tuple[tuple[int, str], ...] = ()
    digest: str = ""

    def __len__(self) -> int:
        return len(self.lines)

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def only(self, *allowed: str) -> None:
        """Refuses any column that is not one of ``allowed``."""
        for name in self.columns:
            if name not in allowed:
                raise self.header_error(
                    f"column {name[:40]!r} is unknown{nearest(name[:40], allowed)}",
                    "the known columns are " + ", ".join(allowed),
                )

    def texts(self, name: str) -> list[str]:
        """All cells of a column as text; ``columns`` reads them one by one."""
        return list(self.columns[name])

    def numbers(self, name: str) -> Floats:
        """The column (rows,) as finite numbers, in the unit of the file."""
        return self._numbers(name, may_miss=False)

    def numbers_or_nan(self, name: str) -> Floats:
        """The column (rows,) as finite numbers, NaN where a cell is empty, ``-``, ``nan`` or ``n/a``."""
        return self._numbers(name, may_miss=True)

    def _numbers(self, name: str, may_miss: bool) -> Floats:
        comma = self.separator != ","
        self._check_decimals(name)

        def one(row: int, cell: str) -> float:
            if may_miss and is_missing(cell):
                return math.nan
            if not cell:
                raise self.error(row, name, "the cell is empty")
            written = cell.replace(",", ".", 1) if comma else cell
            if not is_number(written):
                raise self.error(row, name, f"{cell[:40]!r} is not a number")
            if not math.isfinite(float(written)):
                raise self.error(row, name, f"{cell[:40]!r} is too large")
            return float(written)

        values = self.columns[name].numbers(one, comma)
        values.setflags(write=False)
        return values

    def _check_decimals(self, name: str) -> None:
        """Refuses a number with a point in a file with decimal commas: 1.000 may be one or a thousand."""
        column = self.columns[name]
        if self.separator == "," or column.cells.decimal_comma is None:
            return
        for row, text in column.with_letter(".", without=","):
            if not is_number(text):
                continue
            at, comma = column.cells.decimal_comma
            message = (
                f"{text[:40]!r} has a point, and the decimals of this file are after a comma, as {comma[:40]!r} in"
                f" line {self.lines[at]}"
            )
            help = "write all decimals with one sign, and thousands without a separator: 1000, not 1.000"
            raise self.error(row, name, message, help)

    def error(self, row: int, name: str, message: str, help: str = "") -> Refusal:
        """A Refusal that points at the cell of column ``name`` in ``row`` (from 0)."""
        return Refusal(
            Finding(self.code, f"column {name}: {message}", str(self.path), int(self.lines[row]), help=help)
        )

    def header_error(self, message: str, help: str = "") -> Refusal:
        return Refusal(Finding(self.code, message, str(self.path), self.header_line, help=help))


def read_table(path: Path, code: str) -> CsvTable:
    """Reads a CSV file; ``code`` is the one that findings about its contents carry.

    Raises Refusal: FIL001 (not readable), FIL002 (empty), FIL003 (binary), ``code`` (header or rows are wrong).
    """
    raw = read_text_file(path, code, LINE_ENDS)
    lines = CsvLines.of(path, code, raw)
    comments, header, at, next_start = _above(lines)
    if header is None:
        raise Refusal(Finding("FIL002", "the file has no header and no rows", str(path)))
    separator = separator_of(header)
    names = [name.strip().lower() for name in lines.cells(header, at, separator)]
    if all(is_number(name) for name in names):
        raise lines.wrong(
            "the first row consists of numbers; the header is missing, which names the columns", at
        )
    seen: set[str] = set()
    for index, name in enumerate(names, start=1):
        if not name or name in seen:
            what = "has no name" if not name else f"repeats the name {name[:40]!r}"
            raise lines.wrong(f"column {index} of the header {what}", at)
        seen.add(name)

    def one(start: int, stop: int, number: int) -> list[str] | None:
        line = lines.text(start, stop)
        note = comment(line, above=False)
        if note is not None:
            comments.append((number, note))
        elif line.strip(NOTHING):
            row = lines.cells(line, number, separator)
            if len(row) != len(names):
                raise _wrong_count(lines, number, row, names, separator)
            return row
        return None

    cells = find_cells(lines, next_start, at + 1, separator, len(names), one)
    if not len(cells.number):
        raise lines.wrong("the file has a header, but no rows", at)
    return CsvTable(
        path,
        code,
        {name: CsvColumn(cells, index) for index, name in enumerate(names)},
        frozen(cells.number, (-1,), np.int64),
        at,
        separator,
        tuple(comments),
        hashlib.sha256(raw).hexdigest(),
    )


def comments_above(path: Path) -> tuple[tuple[int, str], ...]:
    """(line, text after the #) of the comments above the header; the table itself may be wrong.

    Raises Refusal FIL001 (not readable), FIL003 (binary, or an endless line).
    """
    return tuple(_above(CsvLines.of(path, "FIL003", read_text_file(path, ends=LINE_ENDS)))[0])


def _above(lines: CsvLines) -> tuple[list[tuple[int, str]], str | None, int, int]:
    """The comments above the header; the header, None where there is none, its number, and where the next line
    starts."""
    comments: list[tuple[int, str]] = []
    start, number = lines.start, 0
    while start <= len(lines.raw):
        number += 1
        stop, next_start = lines.end(start)
        line = lines.text(start, stop)
        note = comment(line, above=True)
        if note is not None:
            comments.append((number, note))
        elif line.strip(NOTHING) and not _SEPARATOR.match(line):
            return comments, line, number, next_start
        start = next_start
    return comments, None, number, start


def _wrong_count(lines: CsvLines, number: int, row: list[str], names: list[str], separator: str) -> Refusal:
    if len(row) < len(names):
        missing = f"column {names[len(row)][:40]} is missing"
        return lines.wrong(f"{len(row)} cells are found where the header has {len(names)}: {missing}", number)
    help = "a decimal comma needs semicolons between the cells" if separator == "," else ""
    message = (
        f"{len(row)} cells are found where the header has {len(names)}: there are too many after"
        f" column {names[-1][:40]}"
    )
    return lines.wrong(message, number, help)
