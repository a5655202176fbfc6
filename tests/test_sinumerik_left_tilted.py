"""What leaves the state of a Sinumerik unknown: frames and increments, tools that stay tilted, RET, actions beside."""

from __future__ import annotations

import numpy as np
import pytest
from test_gcode_followed import read, run

INCREMENTS = [
    # Siemens, setting data 42440 $SC_FRAME_OFFSET_INCR_PROG: by it (1 is its default) an increment after a change of
    # the frame starts from the coordinate of before, else from where the tool is: of the axes that the frame moves.
    ("G1 X10\nATRANS X100\nG91 G1 X5\n", ["10 0 0", "?*"]),
    ("G1 X10\nATRANS X100\nG91 G1 Y5\n", ["10 0 0", "10 5 0"]),
    ("G1 X10\nTRANS Y-50\nG1 X20 Y=IC(10)\nY1\n", ["10 0 0", "?*", "20 -49 0"]),
    ("G1 X10\nTRANS Y-50\nG1 X20 Y5\nY=IC(10)\n", ["10 0 0", "20 -45 0", "20 -35 0"]),
    ("G1 X10\nTRANS Y-50\nTRANS\nG1 Y=IC(10)\n", ["10 0 0", "?*"]),
    ("G1 X10\nAROT Z90\nG91 G1 X1\n", ["10 0 0", "?*"]),
    ("G1 X10 Y0\nAROT X90\nG91 G1 X1\n", ["10 0 0", "11 0 0"]),
    ("G1 X10\nMIRROR X0\nG91 G1 X1\n", ["10 0 0", "?*"]),
    # a frame that is stated again moves nothing
    ("TRANS X5\nG1 X10\nTRANS X5\nG91 G1 X1\n", ["15 0 0", "16 0 0"]),
]


@pytest.mark.parametrize(("text", "ends"), INCREMENTS)
def test_increments_after_a_change_of_the_frame_are_known_of_axes_that_it_leaves(
    text: str, ends: list[str]
) -> None:
    assert run("sinumerik", text) == ends


def test_the_message_names_the_increment() -> None:
    path = read("sinumerik", "G1 X10\nATRANS X100\nG91 G1 X5\n").toolpath
    assert "an increment after a change of coordinates" in path.constraints.refused[2].message


AFTER = "TRAFOOF\nG0 X0 Y0 Z50\nG1 Z-1\nG1 X60\n"
TILTS = [
    # The rotary axes stay where a vector has put them: without TRAORI nothing is known of the tool.
    ("TRAORI\nG1 X20 A3=0.3 B3=0 C3=1\n" + AFTER, False),
    ("TRAORI\nORIEULER\nG1 X20 A2=10 B2=20 C2=0\n" + AFTER, False),
    ("TRAORI\nG1 X20 A3=0.3 B3=0 C3=1\nG1 X30 A3=0 B3=0 C3=1\n" + AFTER, True),
    ("TRAORI\nG1 X20 C3=-1\n" + AFTER, False),
    ("TRAORI\nG1 X20 A3=0.3 C3=1\n/G1 X30 A3=0 B3=0 C3=1\n" + AFTER, False),
    ("TRAORI\nROT X20\nG1 X20 A3=0 B3=0 C3=1\nROT\n" + AFTER, False),
    # words of the rotary axes state it again, all of those that the program has and no single one
    ("TRAORI\nG1 X20 A3=0.3 B3=0 C3=1\nTRAFOOF\nG0 B0 C0\n" + AFTER, True),
    ("G0 B0 C0\nTRAORI\nG1 X20 A3=0.3 B3=0 C3=1\n" + AFTER, False),
    ("G0 B0 C0\nTRAORI\nG1 X20 A3=0.3 B3=0 C3=1\nTRAFOOF\nG0 B0\n" + AFTER, False),
    ("TRAORI\nG1 X20 A3=0.3 B3=0 C3=1\nTRAFOOF\nG0 C0\n" + AFTER, False),
    # a swivelled plane brings the tool along its normal
    ('TRAORI\nG1 X20 A3=0.3 C3=1\nTRAFOOF\nCYCLE800(0,"",0,57,0,0,0,0,0,0,0,0,0,1)\n' + AFTER, True),
    # TRAORI states the direction again
    ("TRAORI\nG1 X20 A3=0.3 B3=0 C3=1\nTRAFOOF\nTRAORI\nG1 X1 Y1 Z1 A3=0 B3=0 C3=1\n", True),
]  # fmt: skip


@pytest.mark.parametrize(("text", "known"), TILTS)
def test_a_direction_leaves_the_tool_where_it_is(text: str, known: bool) -> None:
    path = read("sinumerik", text).toolpath
    refused = path.constraints.refused.get(len(path) - 1)
    assert (refused is None) is known, refused
    assert bool(np.isfinite(path.rotation[-1]).all()) is known
    if refused is not None:
        assert refused.code == "GCO013"


def test_coordinates_after_a_tilted_direction_are_stated_again() -> None:
    """Without TRAORI they are those of the machine: what no word states again is not known."""
    tilted = "TRAORI\nG1 X20 A3={} B3=0 C3=1\nTRAFOOF\nG0 B0 C0\nG1 X5\n"
    assert run("sinumerik", tilted.format("0.3"))[-1] == "?*"
    assert run("sinumerik", tilted.format("0"))[-1] == "5 0 0"


def test_directions_under_g43_5_leave_the_tool_tilted_too() -> None:
    text = "G43.5 H1\nG1 X1. I0.3 J0. K1.\nG49\nG43 H1\nG1 X2. Y0. Z0.\n"
    path = read("fanuc", text).toolpath
    assert path.constraints.refused[len(path) - 1].code == "GCO013"
    path = read("fanuc", text.replace("I0.3 J0. K1.", "")).toolpath
    assert len(path) - 1 not in path.constraints.refused


SUB = "\nG1 X60\nN30 G1 X70\nM30\n%_N_L11_SPF\nG1 X10\n"


def test_a_return_to_elsewhere_is_no_plain_one() -> None:
    """Siemens, job planning, "parameterizable subprogram return": RET("N30") goes on at N30, RET(,,2) returns from two
    subprograms."""
    assert run("sinumerik", "L11" + SUB + "RET\n") == ["10 0 0", "60 0 0", "70 0 0"]
    assert run("sinumerik", "L11" + SUB + "RET()\n") == ["10 0 0", "60 0 0", "70 0 0"]
    for returned in ('RET("N30")', "RET(,,2)", 'RET("N30",1)'):
        assert set(run("sinumerik", "L11" + SUB + returned + "\n")) == {"?*"}, returned


@pytest.mark.parametrize(
    "written", ["$P_UIFR[1]=CTRANS(X,R5)", "$P_UIFR[1,X,TR]=10", "$P_UIFR[R5]=CTRANS(X,10)"]
)
def test_a_work_offset_that_the_program_writes_is_not_that_of_the_cell(written: str) -> None:
    for before in ("", "G1 X9\n"):
        program = read(
            "sinumerik",
            f"{before}{written}\nG54\nG1 X5 Y5 Z5\n",
            "G71 G90 G17 G94 T1 D1\nG500 G0 X0 Y0 Z0\nF60\n",
        )
        path = program.toolpath
        assert path.constraints.refused[len(path) - 1].code == "GCO014"
        assert any(one.code == "GCO024" and "not known" in one.message for one in program.findings)


@pytest.mark.parametrize(
    "action",
    [
        "WHEN $A_IN[1]==1 DO DELDTG",
        "WHEN $A_IN[1]==1 DO DELDTG(X)",
        "ID=1 WHENEVER $A_IN[1]==1 DO FTOC(1,$AA_IW[X],3)",
    ],
)
def test_what_actions_end_or_shift_is_not_known(action: str) -> None:
    """Siemens, synchronized actions: DELDTG deletes the distance to go of the next motion, FTOC shifts the tool."""
    assert run("sinumerik", f"G1 X5\n{action}\nG1 X10\nX20\n") == ["5 0 0", "?*", "?*"]


def test_an_override_of_an_axis_in_an_action_leaves_the_feed_unknown() -> None:
    path = read("sinumerik", "G1 X5\nID=1 WHENEVER $A_IN[1]==1 DO $AA_OVR[X]=50\nG1 X10\n").toolpath
    assert np.isnan(path.feed[2])
    assert not np.isnan(path.feed[1])


@pytest.mark.parametrize(
    "said",
    [
        'MSG("x")',
        "T1",
        "TRANS X0",
        "BRISK",
        "G64 SOFT",
        "STOPRE",
        "R5=1",
        "G1 X=IC(0)",
        "LAB2:",
        "CYCLE800()",
    ],
)
def test_a_jump_leads_to_a_block_number_whatever_its_block_says(said: str) -> None:
    """Siemens, "jump destination: label or block number"; a label may be written as a constant string."""
    ends = run("sinumerik", f"G1 X10\nGOTOF N40\nG0 X1\nN40 {said}\nG1 X50 Y0 Z0\nM30\n")
    assert (ends[0], ends[-2]) == ("10 0 0", "50 0 0")
    assert run("sinumerik", 'G1 X10\nGOTOF "PAST"\nG1 X1\nPAST: X20\nM30\n') == ["10 0 0", "20 0 0", "?*"]
