"""The languages that can be read, in one table."""

from __future__ import annotations

import re
from pathlib import Path

from postproc.base.findings import Finding, Refusal
from postproc.languages import codes as codes
from postproc.languages.dialect import Dialect
from postproc.languages.gcode import DIALECTS as GCODE
from postproc.languages.krl import KrlDialect
from postproc.languages.rapid import RapidDialect

DIALECTS: dict[str, Dialect] = {dialect.name: dialect for dialect in (RapidDialect(), *GCODE, KrlDialect())}
"""Name -> dialect; the first that claims a file reads it."""


_OTHER_FILES = {
    ".yaml": "a YAML file states a cell, a robot or a process: name the program, and this file with its option",
    ".yml": "a YAML file states a cell, a robot or a process: name the program, and this file with its option",
    ".csv": "a CSV file states forces or readings: name the program, and this file with --force",
    ".tp": "a .tp file is a binary TP program of Fanuc; export G-code or KRL from the CAM system",
}
"""What to do with files of other kinds, by their suffix."""

_OTHER_LANGUAGES = (("a TP program of Fanuc", (".ls",), re.compile(rb"^[ \t]*/PROG\b", re.M | re.I)),)
"""Languages that are recognised and not read: name, suffixes, and what such a file holds."""


def detect(path: Path, raw: bytes) -> Dialect:
    """The dialect of a file by its name and content; Refusal (FIL009) if it is of none."""
    for dialect in DIALECTS.values():
        if dialect.claims(path, raw):
            return dialect
    suffix, known = path.suffix.lower(), ", ".join(DIALECTS)
    for language, suffixes, pattern in _OTHER_LANGUAGES:
        if suffix in suffixes and re.search(pattern, raw):
            message = f"the file is {language}, a language that is not read; known are {known}"
            raise Refusal(
                Finding("FIL009", message, path.name, help="export KRL or G-code from the CAM system")
            )
    message = f"the file contains no motion of a known language ({known})"
    raise Refusal(Finding("FIL009", message, path.name, help=_OTHER_FILES.get(suffix, "")))
