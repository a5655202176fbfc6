"""The controller's own data, beside a program."""

from __future__ import annotations

from pathlib import Path

from postproc.base.document import Document
from postproc.base.findings import Finding, Refusal
from postproc.base.read_files import read_text_file
from postproc.languages import codes as codes


def read_controller_data(path: Path) -> Document:
    """The controller's $config.dat.  Raises Refusal FIL009 for a file that is no data list."""
    document = Document(path, read_text_file(path))
    if b"DEFDAT" not in document.raw.upper():
        help = "name the controller's $config.dat: its first statement is DEFDAT $CONFIG"
        raise Refusal(Finding("FIL009", "this file is no data list of a controller", str(path), help=help))
    return document
