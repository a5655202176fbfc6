"""The lines of a CSV file, one by one: comments, blank ones, and cells with all that quotes can do."""

from __future__ import annotations

import codecs
import csv
import re
from pathlib import Path

from postproc.base.dataclass import dataclass
from postproc.base.findings import Finding, Refusal

NOTHING = ' \t;,"'
"""A spreadsheet writes its empty rows as separators alone."""

LINE_ENDS = (b"\n", b"\r")
_LINE_END = re.compile(rb"\r\n|\n|\r")
_BLOCK = 1 << 20


@dataclass(frozen=True)
class CsvLines:
    """The text of a file; ``start``: where its first line does.  ``code``: of the findings about it."""

    path: Path
    code: str
    raw: bytes
    encoding: str
    start: int

    @staticmethod
    def of(path: Path, code: str, raw: bytes) -> CsvLines:
        """UTF-8, or an old spreadsheet's umlauts: numbers are the same."""
        if not _is_utf8(raw):
            return CsvLines(path, code, raw, "latin-1", 0)
        return CsvLines(path, code, raw, "utf-8", 3 if raw.startswith(codecs.BOM_UTF8) else 0)

    def end(self, start: int) -> tuple[int, int]:
        """Where the line that starts at ``start`` ends, and where the next one starts."""
        match = _LINE_END.search(self.raw, start)
        return match.span() if match else (len(self.raw), len(self.raw) + 1)

    def text(self, start: int, stop: int) -> str:
        return self.raw[start:stop].decode(self.encoding)

    def wrong(self, message: str, number: int, help: str = "") -> Refusal:
        return Refusal(Finding(self.code, message, str(self.path), number, help=help))

    def cells(self, line: str, number: int, separator: str) -> list[str]:
        """The cells of a line, unchanged.  Refusal where its quotes are wrong or do not close."""
        try:
            return next(csv.reader([line], delimiter=separator, strict=True, skipinitialspace=True))
        except csv.Error as error:
            what = f"the quotes or cells are wrong ({error})"
            if str(error) == "unexpected end of data":
                what = "the quotes are wrong: a quote does not end on this line"
            raise self.wrong(what, number) from None


def comment(line: str, above: bool) -> str | None:
    """The text of a comment, None if ``line`` is none.

    A spreadsheet puts a comment that holds separators in quotes and fills the row up with separators; below the
    header quotes belong to cells.
    """
    text = line.lstrip()
    if above:
        text = text.lstrip('"')
    return text[1:].rstrip(NOTHING).strip() if text.startswith("#") else None


def separator_of(header: str) -> str:
    """The separator that cuts the header into most cells; the comma where there is but one."""

    def cells(separator: str) -> int:
        try:
            return len(next(csv.reader([header], delimiter=separator)))
        except csv.Error:
            return 0

    return max((",", ";", "\t"), key=cells)


def _is_utf8(raw: bytes) -> bool:
    if raw.isascii():
        return True
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for start in range(0, len(raw), _BLOCK):
            decoder.decode(raw[start : start + _BLOCK])
        decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        return False
    return True
