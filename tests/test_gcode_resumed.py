"""What stands between the motions of a G-code program, and behind their words, when these are written anew."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import CELL
from gcode_writing import WRITING, read
from test_gcode_write import FANUC, HEAD, KUKA, LINUXCNC, NAMES, SINUMERIK, inserted, moved_line

from postproc.languages.dialect import Plan

ROBOT = "G90 G71 G54\nT1 M6\n"
MILL = "G54 G71 G90\nT1\nG0 X0 Y0 Z0\n"
FLAT = CELL + "orientation: {a: 0, b: 0, c: 180}\nmax_growth: 20\n"


@pytest.mark.parametrize("dialect", NAMES.values(), ids=list(NAMES))
def test_a_program_without_motions_has_no_edit(dialect) -> None:
    for text in ("", "\n", "N1", "G21\n", "%\n", "T1 D1\n"):
        program = read(dialect, text)
        moved = dialect.edit_targets(program, Plan.of(program.toolpath), WRITING)
        assert (len(moved.edits), dict(moved.unwritten)) == (0, {})


def test_what_was_lost_on_the_way_is_said_again() -> None:
    """A block that is not understood: what is inserted behind it can not leave out what held before it."""
    text = "G1 X0 Y0 Z0 A0 B0 C180 F100\nG2, X5\nG1 X20 Y0 Z0 A0 B0 C180\n"
    lines = inserted(text, KUKA, ROBOT)
    assert lines[2] == "G1 X0.000 Y0.000 Z0.500 A0.000 B0.000 C180.000"
    lines = inserted(text.replace("G2, X5\n", ""), KUKA, ROBOT)
    assert lines[1] == "G1 Z0.500"


def test_an_orientation_that_no_motion_states_is_inherited() -> None:
    text = "TRAORI\nORIEULER\nG0 X0 Y0 Z50 A2=0 B2=10 C2=0\nA2=0 B2=0 C2=0\nG1 X20 Y5 F100\nX30\n"
    program = read(SINUMERIK, MILL + text)
    assert len(SINUMERIK.edit_targets(program, Plan.of(program.toolpath), WRITING).edits) == 0
    assert "=" not in "".join(moved_line(text, len(program.toolpath) - 2, (0.1, 0, 0), SINUMERIK, MILL)[-2:])


def test_words_keep_away_from_a_name_and_from_what_does_not_close() -> None:
    assert moved_line("N1G1X10F500FNORM\n", 0, (0, 0.1, 0), SINUMERIK, MILL) == ["N1G1X10F500FNORM Y0.100"]
    for dialect, head, text in (
        (SINUMERIK, MILL, 'G1 X5 Y2=3"F5\n'),
        (SINUMERIK, MILL, "G1 X5 Y2=(3 F5\n"),
        (KUKA, ROBOT, "G1 X5 Y5 Z5 A0 B0 C180 Y2=(3\n"),
        (LINUXCNC, HEAD, "G1 X5 Q[3\n"),
        (FANUC, HEAD, "G1 X5 Q#\n"),
    ):
        path = read(dialect, head + text).toolpath
        assert path.constraints.refused[len(path) - 1].code == "GCO001", text
    path = read(SINUMERIK, MILL + 'MSG("(") G1 X5\n').toolpath
    assert not path.constraints.refused


@pytest.mark.parametrize("text", ["G1 X99999999999999999999 Y0 Z0\n", "G1 Z-10000001\n"])
def test_numbers_beyond_any_machine_are_none(text: str) -> None:
    program = read(LINUXCNC, HEAD + text + "G1 X1 Y1 Z1\nX2\n")
    path = program.toolpath
    assert path.constraints.refused[1].code == "GCO005"
    assert np.isnan(path.position[1]).any()
    assert path.known[2:].all()
    assert len(LINUXCNC.edit_targets(program, Plan.of(path), WRITING).edits) == 0


def test_a_coordinate_is_inherited_through_what_is_not_corrected() -> None:
    for text, pins in (
        ("G1 X1 Y1 Z1 F9\nG28 X0 Y0\nG1 X2 Y#1\n", [1]),
        ("G1 X1 Y1 Z1 F9\nG28 Z0\nG1 X2 Y#1 Z#1\n", []),
        ("G1 X1 Y1 Z1 F9\nG1 X#1 Y2\nG1 X3 Y#1\n", [1]),
    ):
        assert list(read(LINUXCNC, HEAD + text).toolpath.constraints.locked) == pins, text


def test_an_arc_without_an_end_has_no_way() -> None:
    path = read(LINUXCNC, HEAD + "G2 X2 I1 F9\nM2\nG2 I3\n").toolpath
    assert np.isnan(path.position[-1]).all()
    assert np.isnan(path.arcs.sweep[-1])
    assert np.isnan(path.arcs.centre[-1]).all()


def test_far_frames_are_not_known() -> None:
    path = read(KUKA, ROBOT + "#CS DEF[1][0,1e20,0,0,0,0]\n#CS ON[1]\nG1 X0 Y0 Z0 A0 B0 C180\n").toolpath
    assert 0 in path.constraints.refused


@pytest.mark.slow
def test_the_time_of_a_motion_stays(compensate, job) -> None:
    program = read(LINUXCNC, HEAD + "G1 X1 F100\nG93 X2 F5\nG94 X3 F100\n")
    assert program.toolpath.inverse_time_feed.tolist() == [False, False, True, False]
    job.cell(FLAT)
    lines = ["G21 G90 G17 G54", "T1 M6", "G0 X0 Y0 Z50", "G1 Z0 F500", "(FORCE 100 100 200 @BASE)", "G1 X10",
             "G93 X50 F4", "G3 X60 Y10 I0 J10 F3", "G94 G1 X100 F500", "(FORCE OFF)", "G0 Z50", "M30"]  # fmt: skip
    done = compensate(job.write(lines, "\n", "part.ngc"), "--force", "--json", "-")
    assert (done.code, done.json["corrected"]) == (0, 4), done.out + done.err
    written = (job.folder / "compensated" / "part.ngc").read_text()
    assert "F4" in written
    assert "F3" in written


INCHES = {
    "part.ngc": "G20 G90 G17 G54|T1 M6|G0 X0 Y0 Z2.|G1 Z0 F20.|G1 X4.|G3 X5. Y1. I0 J1.|G1 Y3. M8|G2 X6. Y4. R1.|"
    "X7. Y5. R1.|G1 X8.|G91 X.5|G3 X.5 Y.5 I0. J.5|G90 G2 X10. Y6.5 I1. J0|G0 Z2.|M30",
    "part.mpf": "G700 G90 G17 G54|T1 D1 M6|G0 X0 Y0 Z2|G1 Z0 F20|G1 X4|G3 X5 Y1 I=AC(4) J=AC(1)|G1 Y3|"
    "G2 X6 Y4 CR=1|CIP X7 Y5 I1=6.4 J1=4.9|G1 X8|G0 Z2|M30",
}


@pytest.mark.parametrize("name", INCHES)
def test_inches_and_their_arcs_through_the_whole_job(compensate, job, name: str) -> None:
    job.cell(FLAT)
    program = job.write(INCHES[name].split("|"), "\n", name)
    force = ("--force", "0,300,400@base", "--json", "-")
    done = compensate(program, *force)
    assert (done.code, done.json["uncorrected"]) == (0, 0), done.out + done.err
    assert done.json["error_before_mm"]["max"] > 1.0
    assert done.json["error_after_mm"]["max"] <= 0.001
    verified = compensate("verify", program, job.folder / "compensated" / name, *force)
    assert verified.json["original"]["max"] > 1.0
    assert verified.json["compensated"]["max"] <= 0.02
