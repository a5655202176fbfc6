"""What kind of file was given in the place of measurements."""

from __future__ import annotations

from pathlib import Path

from postproc.base.findings import Finding, Refusal
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
