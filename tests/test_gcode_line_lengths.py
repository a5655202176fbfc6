"""No line is written that is longer than its control reads; LinuxCNC itself says which lines it reads."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from gcode_judge.oracle import MISSING, RS274
from gcode_writing import WRITING, read

from postproc.base.document import apply
from postproc.base.units import MM
from postproc.languages.dialect import EditedTargets, Plan, Role
from postproc.languages.gcode import DIALECTS

NAMES = {dialect.name: dialect for dialect in DIALECTS}
HEAD = {
    "linuxcnc": "G21 G90 G17 G54 G94\nT1 M6\nG0 X0 Y0 Z5\n",
    "fanuc": "O1\nG21 G90 G17 G54\nT1 M6\nG0 X0. Y0. Z5.\n",
    "sinumerik": "G71 G90 G17 G54\nT1 D1\nG0 X0 Y0 Z5\n",
}
LONGEST = {"linuxcnc": 252, "sinumerik": 511}
"""Characters without the end of the line."""


def program_of(control: str, length: int, newline: str = "\n") -> str:
    """A line of so many characters, and a short one after it."""
    line = "G1 X1 F600 " + (";" if control == "sinumerik" else "(")
    line += "c" * (length - len(line) - 1) + ("c" if control == "sinumerik" else ")")
    return (HEAD[control] + line + "\nG1 X2 Y1\nM2\n").replace("\n", newline)


def moved(control: str, text: str, millimetres: float, between: bool = False) -> tuple[EditedTargets, bytes]:
    """The program with its feed motions moved along X; between: a block is inserted before the long one."""
    program = read(NAMES[control], text)
    plan = Plan.of(program.toolpath)
    position = plan.position.copy()
    position[1:, 0] += millimetres * MM
    plan = Plan(plan.source, plan.role, position, plan.rotation, plan.centre, plan.normal, plan.sweep)
    if between:
        at = np.array([0, 1, 1, 2])
        halfway = position[at].copy()
        halfway[1] = (position[0] + position[1]) / 2
        role = np.array([Role.ORIGINAL, Role.INTERMEDIATE, Role.ORIGINAL, Role.ORIGINAL])
        plan = Plan(at, role, halfway, plan.rotation[at], plan.centre[at], plan.normal[at], plan.sweep[at],
                    np.array([1.0, 0.5, 1.0, 1.0]))  # fmt: skip
    edits = NAMES[control].edit_targets(program, plan, WRITING)
    return edits, apply(program.documents[0], edits.edits)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("control", LONGEST)
def test_a_line_grows_up_to_what_the_control_reads(control: str, newline: str) -> None:
    longest = LONGEST[control] + 1 - len(newline)
    grown = len("X1.123") - len("X1")
    edits, raw = moved(control, program_of(control, longest - grown, newline), 0.123)
    assert not edits.unwritten
    assert max(map(len, raw.split(newline.encode()))) == longest
    edits, _ = moved(control, program_of(control, longest - grown + 1, newline), 0.123)
    assert {row: finding.code for row, finding in edits.unwritten.items()} == {1: "GCW004"}
    assert edits.unwritten[1].line == HEAD[control].count("\n") + 1


def test_what_was_too_long_before_or_does_not_grow_is_written() -> None:
    assert not moved("linuxcnc", program_of("linuxcnc", 300), 0.123)[0].unwritten
    assert not moved("linuxcnc", program_of("linuxcnc", 252).replace("X1 ", "X1.500 "), 0.123)[0].unwritten
    assert not moved("fanuc", program_of("fanuc", 600), 0.123)[0].unwritten


def test_a_block_before_the_line_does_not_lengthen_it() -> None:
    edits, raw = moved("linuxcnc", program_of("linuxcnc", 248), 0.123, between=True)
    assert not edits.unwritten
    assert raw.count(b"G1 X") == 3
    assert max(map(len, raw.split(b"\n"))) == 252


@pytest.mark.skipif(RS274 is None, reason=MISSING)
def test_linuxcnc_reads_the_longest_line_and_no_longer_one(tmp_path: Path) -> None:
    for newline, longest in (("\n", 252), ("\r\n", 251)):
        for length in (longest, longest + 1):
            file = tmp_path / "part.ngc"
            file.write_bytes(program_of("linuxcnc", length, newline).replace("T1 M6" + newline, "").encode())
            done = subprocess.run([RS274, "-g", str(file)], capture_output=True, text=True, timeout=60)
            assert ("PROGRAM_END" in done.stdout) == (length == longest), (length, newline)
