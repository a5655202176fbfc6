"""The languages that can be read, in one table."""

from __future__ import annotations

from pathlib import Path

from postproc.base.findings import Finding, Refusal
from postproc.languages import codes as codes
from postproc.languages.dialect import Dialect
from postproc.languages.gcode import DIALECTS as GCODE
from postproc.languages.gcode.cell_options import OPTIONS as GCODE_OPTIONS
from postproc.languages.krl import OPTIONS as KRL_OPTIONS
from postproc.languages.krl import KrlDialect
from postproc.languages.rapid import RapidDialect
from postproc.languages.tp import TpDialect

DIALECTS: dict[str, Dialect] = {
    dialect.name: dialect for dialect in (TpDialect(), RapidDialect(), *GCODE, KrlDialect())
}
"""Name -> dialect; the first that claims a file reads it."""

DIALECT_OPTIONS = (*GCODE_OPTIONS, *KRL_OPTIONS)
"""What a cell may state in its ``dialect`` section beside the name."""

COMPANION_SUFFIXES = tuple(sorted({suffix for one in DIALECTS.values() for suffix in one.companion_suffixes}))
"""Of files that belong to the program whose name they bear."""


_OTHER_FILES = {
    ".yaml": "a YAML file states a cell, a robot or a process: name the program, and this file with its option",
    ".yml": "a YAML file states a cell, a robot or a process: name the program, and this file with its option",
    ".csv": "a CSV file states forces or readings: name the program, and this file with --force",
    ".tp": "a .tp file is a binary TP program of Fanuc; save it as an ASCII listing (.ls)",
}
"""What to do with files of other kinds, by their suffix."""


def unread_help(path: Path, raw: bytes) -> str:
    """What to do with a file in which no motion is found; "" where that is not known."""
    if b"\r" in raw and b"\n" not in raw:
        return "its lines end in CR alone, which no controller reads: save it with Windows or Unix line ends"
    return _OTHER_FILES.get(path.suffix.lower(), "")


def detect(path: Path, raw: bytes) -> Dialect:
    """The dialect of a file by its name and content; Refusal (FIL009) if it is of none."""
    for dialect in DIALECTS.values():
        if dialect.claims(path, raw):
            return dialect
    message = f"the file contains no motion of a known language ({', '.join(DIALECTS)})"
    raise Refusal(Finding("FIL009", message, path.name, help=unread_help(path, raw)))
