"""Words and codes that only look as if they changed nothing: beside M codes, in calls, dwells, cycles of the control.

What a block means here is taken from the manuals of the controls: R beside G1 rounds a corner or is an error, whatever
M code is in the block; G4 takes its X or P as a time; G65 counts a length without a point in increments.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.gcode import DIALECTS

DIALECT = {dialect.name: dialect for dialect in DIALECTS}
HEAD = {
    "linuxcnc": "G21 G90 G17 G54 G94 G40\nT1 M6\nG43 H1\nG0 X0. Y0. Z5.\nG1 Z0. F500.\n",
    "fanuc": "O1\nG21 G90 G17 G54 G94 G40\nT1 M6\nG43 H1\nG0 X0. Y0. Z5.\nG1 Z0. F500.\n",
    "sinumerik": "G71 G90 G17 G54 G94 G40\nT1 D1\nM6\nG0 X0 Y0 Z5\nG1 Z0 F500\n",
}


def read(name: str, text: str) -> Program:
    document = Document(Path("part.nc"), (HEAD[name] + text).encode())
    return DIALECT[name].read((document,), ReadingSettings(orientation=np.array([0.0, 0.0, np.pi])))


def ends(name: str, text: str) -> list[str]:
    """The ends of the motions after the head [mm]; a question mark where one is refused or not known."""
    path, first = read(name, text).toolpath, 2
    return [
        "?" if row in path.constraints.refused or not path.known[row]
        else " ".join(f"{value + 0.0:g}" for value in np.round(path.position[row] * 1e3, 4))
        for row in range(first, len(path))
    ]  # fmt: skip


def codes(name: str, text: str) -> set[str]:
    return {finding.code for finding in read(name, text).findings}


@pytest.mark.parametrize("word", ["R2.", "I1.", "K1.", "P1", "Q1.", "L2"])
@pytest.mark.parametrize("other", ["M8", "S900 M3", "M5", "G69", "G15", "G97"])
@pytest.mark.parametrize("name", ["linuxcnc", "fanuc"])
def test_a_code_without_words_of_its_own_takes_none(name: str, other: str, word: str) -> None:
    assert ends(name, f"G1 X5. {other}\nX6.\n") == ["5 0 0", "6 0 0"]
    assert ends(name, f"G1 X5. {word} {other}\nX6.\n") == ["?", "?"]


def test_m_codes_have_their_own_words() -> None:
    assert ends("linuxcnc", "M66 P1 L3 Q2\nG1 X5. M62 P1\n") == ["5 0 0"]
    assert ends("fanuc", "G1 X5. M19 R45.\nG2 X9. R2. M8\n") == ["5 0 0", "9 0 0"]
    assert "GCO001" not in codes("fanuc", "M3 P2 S900\nG1 X5.\n")  # beside no motion it can change none


@pytest.mark.parametrize("dwell", ["G4 P2000 X3.", "G4 X3. Y2.", "G4 P1 Z3."])
def test_a_dwell_of_a_fanuc_is_no_motion(dwell: str) -> None:
    assert ends("fanuc", f"{dwell}\nY5.\n") == ["?", "?"]
    assert ends("fanuc", "G4 X3.\nY5.\nG4 P2000\nX1.\n") == ["0 5 0", "1 5 0"]


@pytest.mark.parametrize("block", ["G12 I5.", "G13 I5. F100.", "G150 P7", "G70 I5. J0. L4", "G37.1", "G36"])
def test_what_a_control_cuts_without_axis_words_is_reported(block: str) -> None:
    after = "G1 X3. Y3. Z3.\n"
    assert "GCO016" in codes("fanuc", block + "\n" + after)
    assert ends("fanuc", block + "\n" + after) == ["3 3 3"]


@pytest.mark.parametrize("code", ["G34", "G35", "G36"])
def test_holes_of_a_pattern_end_elsewhere(code: str) -> None:
    """The last hole of a pattern is where the tool is then, not its centre."""
    assert ends("fanuc", f"{code} X1. Y1. I5. J0. K4\nG1 Z2.\n") == ["?", "?"]


SUB = "G1 X70. Y70. Z9.\nM30\nO5\nG1 X#24 Y#25\nM99\n"


def test_arguments_in_increments_are_not_known() -> None:
    assert ends("fanuc", "G65 P5 X5. Y6.\n" + SUB)[0] == "5 6 0"
    # 900000 is a coordinate in increments only: X5 of G65 is then 0.005, if the machine is set so
    counted = "G1 X900000\nG65 P5 X5 Y6.\n" + SUB
    assert ends("fanuc", counted)[:2] == ["900 0 0", "?"]
    assert ends("fanuc", counted.replace("X5 ", "X5. "))[:2] == ["900 0 0", "5 6 0"]
    assert ends("fanuc", counted.replace("X5 Y6.", "X5 Y6"))[:2] == ["900 0 0", "?"]
    assert "GCO027" in codes("fanuc", "G65 P5 X5 Y6.\n" + SUB)
    assert "GCO027" in codes("fanuc", "G2 X10. Y0. I5 J0.\n")
    assert "GCO027" not in codes("fanuc", "G65 P5 X5. Y6.\n" + SUB)


@pytest.mark.parametrize("word", ["K2", "H5", "Q5", "R1."])
def test_a_call_with_a_word_of_unknown_meaning_is_not_followed(word: str) -> None:
    plain = "M98 P5\nG1 X70. Y70. Z9.\nM30\nO5\nG1 X1.\nM99\n"
    assert ends("fanuc", plain) == ["1 0 0", "70 70 9"]
    assert "GCO007" in codes("fanuc", plain.replace("P5", f"P5 {word}"))


@pytest.mark.parametrize("frame", ["G158 X5", "G258 RPL=30", "G259 RPL=30"])
def test_frames_of_older_sinumerik_are_not_passed_over(frame: str) -> None:
    assert ends("sinumerik", f"G1 X1 Y1 Z1\n{frame}\nG1 X1 Y1 Z1\n") == ["1 1 1", "?"]


@pytest.mark.parametrize("number", ["1e-05", "5E-1", "1E3", "5.e+2"])
@pytest.mark.parametrize("name", ["linuxcnc", "fanuc", "sinumerik"])
def test_an_exponent_is_taken_by_some_controls_only(name: str, number: str) -> None:
    """A program in C reads 1e-05 as a number, LinuxCNC as 1 and the address E."""
    assert ends(name, f"G1 X{number}\nG1 X6. Y3.\n") == ["?", "6 3 0"]
    assert "GCO005" in codes(name, f"G1 Y{number} X2.\n")


def test_an_address_e_of_its_own_is_no_exponent() -> None:
    assert ends("linuxcnc", "G1 X5.E0.1\nX6. E-1\n") == ["5 0 0", "6 0 0"]


def test_a_code_and_a_number_beyond_all_machines_have_no_exponent() -> None:
    """Printers write G92E0 and X50E8 without blanks; 5 km may be 5000 E3."""
    assert ends("linuxcnc", "G92E0\nG1E3\nG1X50E8\n") == ["50 0 0"]
    assert ends("linuxcnc", "G1X5000E3\nX50E5\nX0E5\nX1Y-3E7\n") == ["?", "?", "?", "1 -3 0"]
