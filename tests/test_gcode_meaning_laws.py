"""What words of G-code mean, by hand from the controls' manuals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gcode_writing import WRITING
from test_gcode_followed import DIALECT, read, run

from postproc.base.document import apply
from postproc.languages.dialect import Plan
from postproc.languages.gcode import reader
from postproc.languages.gcode.detection import is_fanuc, is_gcode, is_sinumerik
from postproc.toolpath import Kind


def codes(control: str, text: str) -> set[str]:
    return {finding.code for finding in read(control, text).findings}


def test_speeds_of_the_spindle() -> None:
    """M3 forward, M4 backward, M5 stops; S holds on; that of a dwell is a time, G96 leaves the sense alone."""
    text = "G1 X1\nS1000 M3\nX2\nM4\nX3\nM5\nX4\nM3 S500\nX5\nG4 S2\nX6\nM4 S200\nX7\n"
    text += "G96 D900 S150\nX8\nG97 S300 M3\nX9\n"
    speeds = read("linuxcnc", text).toolpath.speeds.spindle[1:] * 60 / (2 * np.pi)
    np.testing.assert_allclose(speeds, [np.nan, 1000, -1000, 0, 500, 500, -200, -np.inf, 300])
    unknown = read("linuxcnc", "M4\nG1 X1\n").toolpath.speeds.spindle[-1]
    assert unknown == -np.inf


FROM_LINUXCNC = [*range(10), 19, 30, *range(48, 54), *range(60, 69), *range(70, 74)]
"""Its manual's M codes, but those with P that call."""


@pytest.mark.parametrize("code", FROM_LINUXCNC)
def test_codes_of_the_manual_are_known(code: int) -> None:
    assert "GCO028" not in codes("linuxcnc", f"G1 X1\nM{code}\nG1 X2\n")


@pytest.mark.parametrize("code", [12, 15, 16, 18, 28, 31, 39, 46, 47, 54, 59, 74, 85, 96, 100, 101, 150, 199])
def test_codes_of_a_machine_are_told(code: int) -> None:
    """No manual of a control says what they do."""
    assert "GCO028" in codes("linuxcnc", f"G1 X1\nM{code}\nG1 X2\n")


@pytest.mark.parametrize("code", [96, 97, 98, 99, 198])
def test_the_p_of_a_call_selects_no_offset(code: int) -> None:
    """G54 P2 alone is G54.1 P2."""
    path = read("fanuc", "G54 P2 G0 X1. Y1. Z1.\n").toolpath
    assert path.frames[path.base[-1]].number == 102
    path = read("fanuc", f"/G54 M{code} P2\nG54 G0 X1. Y1. Z1.\nG54 M{code} P2\n").toolpath
    assert [path.frames[base].number for base in path.base[1:]] == [1]


ARCS = "G1 X10 Y0\nG2 X20 Y0 I15 J0\nG2 X10 Y0 I15 J0\n"


@pytest.mark.parametrize("head", ["", "G91.1\n", "G1 X1\n"])
@pytest.mark.parametrize("end", ["", "G91.1\n", "G90.1\n"])
def test_centres_are_coordinates_only_where_no_code_says_what_they_are(head: str, end: str) -> None:
    program = read("linuxcnc", head + ARCS + end)
    arcs = [row for row, line in enumerate(program.toolpath.line) if program.toolpath.kind[row] == Kind.CIRC]
    told = "GCO031" in {finding.code for finding in program.findings}
    stated = "1\n" in (head + end).replace("X1\n", "")
    assert told == (not stated)
    assert len([row for row in arcs if row not in program.toolpath.constraints.refused]) == (
        0 if stated else 2
    )
    if not stated:
        np.testing.assert_allclose(program.toolpath.arcs.centre[arcs], [[0.015, 0, 0]] * 2, atol=1e-12)


@pytest.mark.parametrize(
    "line",
    [
        "O1234", ":1234", "N1 G54.1 P3", "G43.4 H1", "G43.5 H1", "G234 H1", "G68.2 X0", "G65 P9000", "M98 P10", "G5 P1",
        "G05.1 Q1", "IF[#1EQ2]GOTO5", "WHILE [#1 LT 2] DO1", "GOTO 10", "G154 P2",
    ],
)  # fmt: skip
def test_a_line_tells_a_fanuc(line: str) -> None:
    """Wherever it is, in capitals or not; within a comment it tells nothing."""
    for raw in (line, line.lower(), f"G21\nG0 X1\n{line}", f"%\n{line}\nM30\n"):
        assert is_fanuc(Path("part.nc"), raw.encode()), raw
    assert not is_fanuc(Path("part.nc"), f"G21\n({line})\n".encode())
    assert not is_fanuc(Path("part.nc"), b"G21\nG0 X1\n")


@pytest.mark.parametrize(
    "line",
    [
        "TRAORI", "TRAFOOF", "SUPA G0 Z0", "MCALL", "CYCLE81(1,2)", "G710", "G642", "G505", "CIP X1",
        "TRANS X1", "ATRANS X1", "ROT Z4", 'MSG ("A")', "DEF REAL A1", "DEF INT A1", "$P_UIFR[1]=X", 'T="MILL"', "R1=4",
        "%_N_A_MPF", "STOPRE", "FNORM", "DYNNORM", "FFWON", "SOFT", "COMPCAD", "G1 X1 A3=1", "G2 X1 CR=5", "G1 X=AC(1)",
        "G1 X=IC(1)",
        "N5 TRAORI", "/TRAORI", "G3 X1 TURN=2",
    ],
)  # fmt: skip
def test_a_line_tells_a_sinumerik(line: str) -> None:
    for raw in (line, line.lower(), f"G71\nG0 X1\n{line}", f"G0 X1\r\n{line}\r\nM30\r\n"):
        assert is_sinumerik(Path("part.nc"), raw.encode()), raw
    assert not is_sinumerik(Path("part.nc"), f"G71\nG0 X1\n;{line}\n".encode())


@pytest.mark.parametrize(
    "suffix", ["nc", "ngc", "tap", "cnc", "gcode", "mpf", "spf", "eia", "iso", "min", "NC", "Gcode"]
)
def test_suffixes_of_programs(suffix: str) -> None:
    assert is_gcode(Path(f"part.{suffix}"), b"")
    assert not is_gcode(Path(f"part.{suffix}"), b"DEF PART ( )\nPTP {A1 0}\n")


@pytest.mark.parametrize(
    ("line", "is_one"),
    [
        ("G1 X1", True), ("x1 y2", True), ("N10 G01 X-.5", True), ("/G1 Z-1", True), ("G90", False), ("M3", False),
        ("LIN {X 1}", False), ("MoveL p1,v100,fine,tool0;", False), ("x = 1", False), ("just text", False),
    ],
)  # fmt: skip
def test_blocks_with_a_motion_tell_a_program(line: str, is_one: bool) -> None:
    for raw in (line, f"{line}\n", f"(head)\n{line}\n", f"{line}\r\n"):
        assert is_gcode(Path("part"), raw.encode()) == is_one, raw


def test_an_expression_states_no_decimals() -> None:
    """What is written for a computed word has the digits of the setting, not those within the expression."""
    for name, text in (
        ("linuxcnc", "#1=1\nG1 X[#1*2.000000]\nX5\n"),
        ("sinumerik", "R1=1\nG1 X=R1*2.000000\nX5\n"),
    ):
        program = read(name, text)
        path = program.toolpath
        assert path.position[1, 0] == pytest.approx(2e-3)
        position = path.position.copy()
        position[1, 0] += 1e-4
        edits = DIALECT[name].edit_targets(program, replace(Plan.of(path), position=position), WRITING)
        assert not edits.unwritten
        line = apply(program.documents[0], list(edits.edits)).decode().splitlines()[path.line[1] - 1]
        assert line in ("G1 X2.100", "G1 X=2.100"), line


PARTS = (
    "G1 X1\nG1 X2 ,R1\nM105\nG1 X3\nFOO BAR\nG1 X4\n#1=5\nG1 X#1\nG1 X6\nG1 R2 X7\nG1 X8 Y1 Z1\n"
    "G10 L2 P2 X1\nG1 X9\n"
)


def test_notes_of_other_parts_say_nothing_of_a_block(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = read("linuxcnc", PARTS)
    for size in (1, 2, 3):
        monkeypatch.setattr(reader, "PART", size)
        part = read("linuxcnc", PARTS)
        assert list(part.toolpath.dump()) == list(whole.toolpath.dump())
        assert part.findings == whole.findings


def test_arguments_of_a_macro_turn_no_axis() -> None:
    """A, B and C of G65 are variables of the macro."""
    assert run("fanuc", "G65 P2 A5. B6. C7.\nG1 Z1.\nM30\nO2\nG1 X#1 Y#2\nM99\n") == ["5 6 0", "5 6 1"]
    assert run("fanuc", "G65 P2 A5.\nG1 A5. Z1.\nM30\nO2\nG1 X#1\nM99\n") == ["5 0 0*", "5 0 1*"]


def test_a_work_offset_behind_other_settings_is_stated() -> None:
    for before in ("G10 L1 P1 Z5.", "G10 L10 P1 R2.", "G10 L2 P2 X1.", "G10 L1 P1 Z5.\nG10 L11 P1 Z5."):
        path = read("fanuc", f"{before}\nG10 L2 P1 X10. Y20. Z30.\nG0 X1. Y1. Z1.\nG1 X5.\n").toolpath
        pose = path.frames[path.base[-1]].pose
        assert pose is not None
        np.testing.assert_allclose(pose.position * 1e3, [10, 20, 30])


SETTINGS_OF_PRINTERS = [
    *(92, 201, 203, 205, 206, 218, 425, 665, 666, 851, 906, 907, 913, 914),  # Marlin
    *(208, 350, 557, 558, 566, 569, 574, 669),  # RepRapFirmware
]
"""M codes whose X Y Z are figures of the machine, by the documents of two printers."""


@pytest.mark.parametrize("control", ["linuxcnc", "fanuc"])
def test_figures_of_a_machine_are_no_place_to_go_to(control: str) -> None:
    for code in SETTINGS_OF_PRINTERS:
        assert run(control, f"G1 X1 Y2 Z3\nM{code} X100 Y5\nG1 X2\n") == ["1 2 3", "2 2 3"], code


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("G52 X5. Y7.\nG92 X0.\nG52 X0. Y0.\nG1 X20. Y0. Z0.\n", "20 0 0"),  # G92 at X0 with X0: no shift
        ("G1 X1.\nG52 X5. Y7.\nG92 X0.\nG1 X20. Y0. Z0.\n", "21 7 0"),
        ("G1 X1.\nG52 X5. Y7.\nG92 X0.\nG52 X0.\nG1 X20. Y0. Z0.\n", "21 7 0"),
        ("G1 X1.\nG52 X5. Y7.\nG92 X0.\nG52 X3. Y0.\nG1 X20. Y0. Z0.\n", "24 0 0"),
        ("G1 X1.\nG92 X0.\nG52 X3.\nG52 X0.\nG1 X20. Y0. Z0.\n", "21 0 0"),
    ],
)
def test_g92_of_a_fanuc_cancels_the_local_system_of_its_axes(text: str, end: str) -> None:
    assert run("fanuc", text)[-1] == end


CUT = "G0 X0 Y0 Z5\nG1 Z0 F100\nX5\n"
LENGTHS = [
    ("linuxcnc fanuc", "T1 M6\nG43 H1\n" + CUT + "T2 M6\n" + CUT, [9, 10]),
    ("linuxcnc fanuc", "T1 M6\nG43 H1\n" + CUT + "T2 M6\nG43 H2\n" + CUT, []),
    ("linuxcnc fanuc", "T1 M6\nG43 H1\n" + CUT + "T2 M6\nG0 X0 Y0 Z5\nG43 H2\nG1 Z0\n", []),
    ("linuxcnc fanuc", "T1 M6\nG43 H1\n" + CUT + "T2 M6\n" + CUT + "G43 H2\nX6\n", [9, 10]),
    ("linuxcnc fanuc", "T1 M6\nG43 H1\n" + CUT + "T2 M6\nG49\n" + CUT, []),
    ("linuxcnc fanuc", "T1 M6\n" + CUT + "T2 M6\n" + CUT, []),
    ("linuxcnc fanuc", "T1 M6\nG43 H2\n" + CUT + "T2 M6\n" + CUT, [3]),
    ("linuxcnc fanuc", "T1 M6\nG43 H3\n" + CUT + "T1 M6\n" + CUT, [3]),
    ("linuxcnc fanuc", "T1\nG43 H1\n" + CUT + "T2\n" + CUT, [9, 10]),
    ("linuxcnc", "T1 M6\nG43\n" + CUT + "M61 Q2\n" + CUT, [9, 10]),
    ("linuxcnc", "T1 M6\nG43\n" + CUT + "T2 M6\n" + CUT, [9, 10]),
    ("linuxcnc", "T1 M6\nG43\n" + CUT + "T2 M6\nG43\n" + CUT, []),
    ("fanuc", "T1 M6\nG43 H1\n" + CUT + "T2 M6\nG43\n" + CUT, [10, 11]),
    ("fanuc", "T1 M6\nG43.4 H1\n" + CUT + "T2 M6\n" + CUT, [9, 10]),
]
"""Controls, program after a head of a line, and where the length of another tool is reported."""


@pytest.mark.parametrize(("controls", "text", "lines"), LENGTHS)
def test_the_length_of_the_tool_before_a_change_is_reported(
    controls: str, text: str, lines: list[int]
) -> None:
    for control in controls.split():
        found = read(control, text, "G21 G90 G17 G54 G94\n")
        reported = [one for one in found.findings if one.code == "GCO023"]
        first = [reported[0].line] if reported else []
        assert first == lines[:1], control
        assert all(f"{len(lines)} blocks" in one.message for one in reported if len(lines) > 1)
