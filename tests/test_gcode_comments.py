"""FORCE comments of G-code where it is not known which way the run takes: what is in force behind it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.languages.dialect import ReadingSettings
from postproc.languages.gcode import DIALECTS

HEAD = "O1\nG21 G90 G17 G54 G94\nT1 M6\nG0 X0. Y0. Z5.\nG1 Z0. F100.\n"
IF, END = "IF [#500 GT 1] THEN\n", "ENDIF\n"
LAST = "G1 X20. Y0. Z0.\nG1 X30.\n"
CALL = "M98 P2000\n"
SUB = "M30\nO2000\n(FORCE 9 9 9)\nM99\n"
MODES = "G54 G90 G17 G94 F100. "


def forces(text: str) -> dict[str, str]:
    """Block -> the FORCE comment in force at its motion, ``?`` where it differs with the path of the program."""
    raw = (HEAD + text).encode()
    dialect = next(one for one in DIALECTS if one.name == "fanuc")
    path = dialect.read((Document(Path("a.nc"), raw),), ReadingSettings(orientation=np.zeros(3))).toolpath
    lines, found = (HEAD + text).splitlines(), {}
    for row in range(len(path)):
        said = [one.text for one in path.remarks.annotations if one.row <= row]
        finding = path.constraints.refused.get(row)
        varies = finding is not None and "comment in force" in finding.message
        found[lines[path.line[row] - 1]] = "?" if varies else said[-1] if said else ""
    return found


@pytest.mark.parametrize(
    ("text", "force"),
    [
        # what an arm leaves is what is in force without it
        (f"(FORCE OFF)\n{IF}(FORCE 1 0 0)\nG1 X9. Y0. Z0.\n(FORCE OFF)\n{END}", "FORCE OFF"),
        (f"{IF}(FORCE OFF)\n{END}", "FORCE OFF"),
        (f"(FORCE 1 0 0)\n{IF}(force  1 0 0)\n{END}", "force  1 0 0"),
        (f"(FORCE 1 0 0)\n{IF}(FORCE 2 0 0)\n(FORCE 1 0 0)\n{END}", "FORCE 1 0 0"),
        # one of two arms runs
        (f"(FORCE 1 0 0)\n{IF}(FORCE 2 0 0)\nELSE\n(FORCE 2 0 0)\n{END}", "FORCE 2 0 0"),
        (f"(FORCE 1 0 0)\n{IF}(FORCE 2 0 0)\nELSE (FORCE 2 0 0)\n{END}", "FORCE 2 0 0"),
        (f"(FORCE 1 0 0)\n{IF}(FORCE 2 0 0)\nELSE\n(FORCE 3 0 0)\n{END}", "?"),
        (f"(FORCE 1 0 0)\n{IF}(FORCE 2 0 0)\nELSE\nG1 X1.\n{END}", "?"),
        # one that may run, or that is left in between
        (f"(FORCE 1 0 0)\n{IF}(FORCE 2 0 0)\n{END}", "?"),
        (f"{IF}(FORCE 2 0 0)\n{END}", "?"),
        (f"(FORCE 1 0 0)\n{IF}(FORCE 2 0 0)\nIF [#501 GT 1] GOTO 5\n(FORCE 1 0 0)\nN5\n{END}", "?"),
        # behind the branch
        (f"(FORCE 1 0 0)\n{IF}(FORCE 2 0 0)\n{END}(FORCE 3 0 0)\n", "FORCE 3 0 0"),
        (f"(FORCE 1 0 0)\n{IF}(FORCE 2 0 0)\nENDIF (FORCE 3 0 0)\n", "FORCE 3 0 0"),
        ("(FORCE 1 0 0)\nIF [#500 GT 1] GOTO 5\n(FORCE 2 0 0)\nG1 X1.\nN5\n", "?"),
        ("(FORCE 1 0 0)\nIF [#500 GT 1] GOTO 5\nG1 X1.\nN5 (FORCE 2 0 0)\n", "FORCE 2 0 0"),
        ("(FORCE 1 0 0)\nIF [#500 GT 1] GOTO 5\nG1 X1.\n(FORCE 2 0 0)\nN5\n", "?"),
        # a slash
        ("(FORCE 1 0 0)\n/ (FORCE 2 0 0)\n", "?"),
        ("(FORCE 1 0 0)\nN7 /2 (FORCE 2 0 0)\n", "?"),
        ("(FORCE 1 0 0)\n/ (A) (FORCE 2 0 0)\n", "?"),
        ("(FORCE 1 0 0)\n/ (FORCE 1 0 0)\n", "FORCE 1 0 0"),
        ("(FORCE 1 0 0)\n/G1 X9. Y0. Z0. (FORCE 2 0 0)\n", "?"),
        # loops
        ("(FORCE 1 0 0)\nWHILE [#500 GT 1] DO1\n(FORCE 2 0 0)\nG1 X9.\n(FORCE 1 0 0)\nEND1\n", "FORCE 1 0 0"),
        ("(FORCE 1 0 0)\nWHILE [#500 GT 1] DO1\n(FORCE 2 0 0)\nG1 X9.\nEND1\n", "?"),
    ],
)
def test_what_is_in_force_behind_a_branch(text: str, force: str) -> None:
    found = forces(text + LAST)
    assert found["G1 X20. Y0. Z0."] == found["G1 X30."] == force


@pytest.mark.parametrize(
    ("call", "force"),
    [
        (CALL, "FORCE 9 9 9"),
        (f"{IF}{CALL}{END}", "?"),
        (f"/{CALL}", "?"),
        (f"IF [#500 GT 1] GOTO 5\n{CALL}N5\n", "?"),
        ("M98 P3000\n", "?"),  # which may call O2000
        (f"{IF}{CALL}{END}(FORCE 2 0 0)\n", "FORCE 2 0 0"),
    ],
)
def test_a_subprogram_that_may_run_may_say_another_force(call: str, force: str) -> None:
    found = forces(f"(FORCE 1 0 0)\n{call}{MODES}{LAST}{SUB}")
    assert found[f"{MODES}G1 X20. Y0. Z0."] == found["G1 X30."] == force
