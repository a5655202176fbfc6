"""CSV files as columns: every mistake is told with file, line and column name.

A header row, then rows with as many cells.  Comma, semicolon or tab, whichever gives the header most cells;
where it is not the comma, a decimal comma is understood.  Blank lines and lines that begin with ``#`` are skipped,
above the header also those that a spreadsheet has put in quotes.  An apostrophe before = + - @, by which a spreadsheet
is told that a cell is no formula, is not part of the cell.
"""

from __future__ import annotations

import csv
import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.arrays import Floats, Ints, frozen
from postproc.files import MAX_LINE, read_file
from postproc.findings import Finding, Refusal, nearest

_LINE_END = re.compile(r"\r\n|\n|\r")
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?\Z")
_NUMBER_CHARACTERS = frozenset("0123456789+-.eE")
_NOTHING = ' \t;,"'  # a spreadsheet writes its empty rows as separators alone
_FORMULA = re.compile(r"'*[=+\-@]")
_MISSING = frozenset(("", "-", "nan", "n/a"))


@dataclass(frozen=True, eq=False)
class Table:
    """``columns``: name in lower case -> cells as text, blanks stripped; ``lines`` (rows,): line of the file, from 1.

    ``comments``: (line, text after the #).  ``code`` is the one that errors in this table carry.  ``digest``: SHA-256
    of the bytes that were read.
    """

    path: Path
    code: str
    columns: Mapping[str, Sequence[str]]
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
                    f"unknown column {name[:40]!r}{nearest(name[:40], allowed)}",
                    "columns: " + ", ".join(allowed),
                )

    def texts(self, name: str) -> Sequence[str]:
        return self.columns[name]

    def numbers(self, name: str) -> Floats:
        """The column (rows,) as finite numbers, in the unit of the file."""
        return frozen(self._numbers(name, range(len(self))))

    def numbers_or_nan(self, name: str) -> Floats:
        """The column (rows,) as finite numbers, NaN where a cell is empty, ``-``, ``nan`` or ``n/a``."""
        cells = self.columns[name]
        missing = {cell for cell in set(cells) if is_missing(cell)}
        if not missing:
            return self.numbers(name)
        given = [row for row, cell in enumerate(cells) if cell not in missing]
        values = np.full(len(self), np.nan)
        values[given] = self._numbers(name, given)
        return frozen(values)

    def _numbers(self, name: str, rows: Sequence[int]) -> Floats:
        """The cells of some ``rows`` as finite numbers (len(rows),)."""
        cells = self.columns[name]
        if len(rows) < len(cells):
            cells = [cells[row] for row in rows]
        if self.separator != ",":
            cells = [cell.replace(",", ".", 1) if "," in cell else cell for cell in cells]
        # float() alone would also take nan, inf, 1_0 and the digits of other scripts
        if _NUMBER_CHARACTERS.issuperset("".join(cells)):
            try:
                values = np.array(list(map(float, cells)))
            except ValueError:
                pass
            else:
                if np.all(np.isfinite(values)):
                    return values
        for row, cell in zip(rows, cells, strict=True):
            shown = self.columns[name][row][:40]
            if not cell:
                raise self.error(row, name, "the cell is empty")
            if not _NUMBER.match(cell):
                raise self.error(row, name, f"{shown!r} is not a number")
            if not math.isfinite(float(cell)):
                raise self.error(row, name, f"{shown!r} is too large")
        raise ValueError("a column that is neither numbers nor wrong")

    def error(self, row: int, name: str, message: str, help: str = "") -> Refusal:
        """A Refusal that points at the cell of column ``name`` in ``row`` (from 0)."""
        return Refusal(
            Finding(self.code, f"column {name}: {message}", str(self.path), int(self.lines[row]), help=help)
        )

    def header_error(self, message: str, help: str = "") -> Refusal:
        return Refusal(Finding(self.code, message, str(self.path), self.header_line, help=help))


def read_table(path: Path, code: str) -> Table:
    """Reads a CSV file; ``code`` is the one that findings about its contents carry.

    Raises Refusal: FIL001 (not readable), FIL002 (empty), FIL003 (binary), ``code`` (header or rows are wrong).
    """
    raw = _bytes(path)
    comments: list[tuple[int, str]] = []
    lines: list[int] = []
    kept: list[str] = []
    for number, line in enumerate(_LINE_END.split(_text(raw)), start=1):
        if len(line) > MAX_LINE:
            raise Refusal(Finding(code, f"a line of more than {MAX_LINE} characters", str(path), number))
        comment = _comment(line, above=not kept)
        if comment is not None:
            comments.append((number, comment))
        elif line.strip(_NOTHING):
            lines.append(number)
            kept.append(line)
    if not kept:
        raise Refusal(Finding("FIL002", "the file has no header and no rows", str(path)))

    separator = _separator(kept[0])
    rows = _cells(path, code, kept, lines, separator)
    names = [name.strip().lower() for name in rows[0]]
    seen: set[str] = set()
    for index, name in enumerate(names, start=1):
        if not name or name in seen:
            what = "has no name" if not name else f"has the name {name[:40]!r} of one before it"
            raise Refusal(Finding(code, f"column {index} of the header {what}", str(path), lines[0]))
        seen.add(name)
    if len(rows) == 1:
        raise Refusal(Finding(code, "there is a header, but no rows", str(path), lines[0]))
    for number, row in zip(lines, rows, strict=True):
        if len(row) != len(names):
            raise Refusal(_wrong_count(path, code, number, row, names, separator))
    quoted = b"'" in raw
    columns = {
        name: [_as_text(cell.strip()) for cell in cells] if quoted else list(map(str.strip, cells))
        for name, cells in zip(names, zip(*rows[1:], strict=True), strict=True)
    }
    return Table(
        path,
        code,
        columns,
        frozen(lines[1:], (-1,), np.int64),
        lines[0],
        separator,
        tuple(comments),
        hashlib.sha256(raw).hexdigest(),
    )


def comments_above(path: Path) -> tuple[tuple[int, str], ...]:
    """(line, text after the #) of the comments above the header; the table itself may be wrong.

    Raises Refusal FIL001 (not readable), FIL003 (binary).
    """
    found = []
    for number, line in enumerate(_LINE_END.split(_text(_bytes(path))), start=1):
        comment = _comment(line, above=True)
        if comment is not None:
            found.append((number, comment))
        elif line.strip(_NOTHING):
            break
    return tuple(found)


def is_missing(cell: str) -> bool:
    """Whether a cell is empty, or says that there is nothing: ``-``, ``nan``, ``n/a`` in any case."""
    return cell.lower() in _MISSING


def as_cell(text: str) -> str:
    """``text`` as a spreadsheet takes for no formula, with an apostrophe before its = + - @; ``read_table`` takes it
    off.  Numbers stay as they are."""
    return f"'{text}" if _FORMULA.match(text) and finite_number(text) is None else text


def _as_text(cell: str) -> str:
    """What ``as_cell`` was given."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def finite_number(text: str) -> float | None:
    """The number that ``text`` is, with a decimal point; None if it is none, or too large."""
    return float(text) if _NUMBER.match(text) and math.isfinite(float(text)) else None


def _bytes(path: Path) -> bytes:
    raw = read_file(path)
    if b"\0" in raw:
        raise Refusal(Finding("FIL003", "holds NUL bytes; save it as plain text (UTF-8)", str(path)))
    return raw


def _text(raw: bytes) -> str:
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")  # an old spreadsheet's umlauts in a comment; numbers are the same


def _comment(line: str, above: bool) -> str | None:
    """The text of a comment, None if ``line`` is none.

    A spreadsheet puts a comment that holds separators in quotes and fills the row up with separators; below the
    header quotes belong to cells.
    """
    begun = line.lstrip()
    if above:
        begun = begun.lstrip('"')
    return begun[1:].rstrip(_NOTHING).strip() if begun.startswith("#") else None


def _separator(header: str) -> str:
    """The separator that cuts the header into most cells; the comma where there is but one."""

    def cells(separator: str) -> int:
        try:
            return len(next(csv.reader([header], delimiter=separator)))
        except csv.Error:
            return 0

    return max((",", ";", "\t"), key=cells)


def _cells(path: Path, code: str, kept: list[str], lines: list[int], separator: str) -> list[list[str]]:
    """The cells of each line; Refusal where quotes do not close on their line."""
    reader = csv.reader(kept, delimiter=separator, strict=True, skipinitialspace=True)
    rows: list[list[str]] = []
    what = "a quote does not close on this line"
    try:
        for row in reader:
            if reader.line_num != len(rows) + 1:
                break
            rows.append(row)
        else:
            return rows
    except csv.Error as error:
        if reader.line_num == len(rows) + 1:
            what = f"quotes or cells are wrong ({error})"
    raise Refusal(Finding(code, what, str(path), lines[len(rows)]))


def _wrong_count(
    path: Path, code: str, number: int, row: list[str], names: list[str], separator: str
) -> Finding:
    if len(row) < len(names):
        message = (
            f"{len(row)} cells where the header has {len(names)}: column {names[len(row)][:40]} is missing"
        )
        help = ""
    else:
        message = (
            f"{len(row)} cells where the header has {len(names)}: too many after column {names[-1][:40]}"
        )
        help = "a decimal comma needs semicolons between the cells" if separator == "," else ""
    return Finding(code, message, str(path), number, help=help)
