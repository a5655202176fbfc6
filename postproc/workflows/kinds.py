"""What kind of file was given in the place of measurements, or of the controller's data."""

from __future__ import annotations

from pathlib import Path

from postproc.base.document import Document
from postproc.base.findings import Finding, Refusal
from postproc.base.read_files import read_text_file
from postproc.languages import DIALECTS
from postproc.measurements import codes as codes

HEAD = 1 << 16
"""Bytes of a file that show whether it is a program."""


READINGS = (
    "identify and diagnose want measurements of the robot",
    "give a CSV of readings (axes A1, A2, ... and X, Y, Z or DX, DY, DZ; `compensate plan` writes one to fill in);"
    " `compensate predict` reports the deflection along a program",
)
PART = (
    "a measured part is wanted here",
    "name the program first, then the CSV of the measured part: compensate learn PROGRAM MEASURED.csv",
)
"""What is wanted, and what to do, of each kind of measurements."""


def check_kind(path: Path, wanted: tuple[str, str] = READINGS) -> None:
    """Raises Refusal MEA013 for a program or a YAML file in the place of measurements; ``wanted``: what is, and what to
    do."""
    what = "a YAML file" if path.suffix.lower() in (".yaml", ".yml") else ""
    if not what and path.suffix.lower() != ".csv" and path.is_file():
        with path.open("rb") as file:
            head = file.read(HEAD)
        claims = [dialect.name for dialect in DIALECTS.values() if dialect.claims(path, head)]
        what = f"a program ({claims[0]})" if claims else ""
    if what:
        raise Refusal(
            Finding(
                "MEA013",
                f"this is {what}; {wanted[0]}",
                str(path),
                help=wanted[1],
            )
        )


def read_controller_data(path: Path) -> Document:
    """The controller's $config.dat.  Raises Refusal FIL009 for a file that is no data list."""
    document = Document(path, read_text_file(path))
    if b"DEFDAT" not in document.raw.upper():
        help = "name the controller's $config.dat: its first statement is DEFDAT $CONFIG"
        raise Refusal(Finding("FIL009", "this file is no data list of a controller", str(path), help=help))
    return document
