"""The languages that can be read, in one table."""

from __future__ import annotations

from pathlib import Path

from postproc.base.findings import Finding, Refusal
from postproc.languages import codes as codes
from postproc.languages.dialect import Dialect
from postproc.languages.gcode import DIALECTS as GCODE
from postproc.languages.krl import KrlDialect

DIALECTS: dict[str, Dialect] = {dialect.name: dialect for dialect in (*GCODE, KrlDialect())}
"""Name -> dialect; the first that claims a file reads it."""


def detect(path: Path, raw: bytes) -> Dialect:
    """The dialect of a file by its name and content; Refusal (FIL009) if it is of none."""
    for dialect in DIALECTS.values():
        if dialect.claims(path, raw):
            return dialect
    known = ", ".join(DIALECTS)
    raise Refusal(Finding("FIL009", f"the file contains no motion of a known language ({known})", path.name))
