"""Where the stock lies, and what was cut of it before each motion: other bases, a table that turns, branches, routines
of other files.  What is removed is counted by hand: a cutter of 16 mm, 5 mm deep, across 100 mm."""

import json

import numpy as np
import pytest

pytest.importorskip("numba")

from click.testing import CliRunner
from test_engage_command import CELL, STOCK, TOOLS, call, folder, refused, state

from postproc.cli.main import main
from postproc.robot.description import find_robot

__all__ = ["folder"]
SLOT = 100 * 16 * 5  # mm3
BASE_2 = "bases: {1: {x: 1450, y: -100, z: 600, a: 0, b: 0, c: 0}, 2: {x: 1450, y: -100, z: 603, a: 0, b: 0, c: 0}}"
HEAD = "G21 G90 G17 G54\nT1 M6\n"


def cell(folder, **changed):
    text = CELL.format(robot=find_robot("kuka_kr270")).replace(
        "bases: {1: {x: 1450, y: -100, z: 600, a: 0, b: 0, c: 0}}", BASE_2
    )
    for old, new in changed.items():
        text = text.replace(*{"dialect": ("{name: linuxcnc}", new)}[old])
    (folder / "cell.yaml").write_text(text)


def engaged(folder, program="part.ngc", code=0):
    result = CliRunner().invoke(main, ["engage", str(folder / program), "--json", "-"])
    assert result.exit_code == code, result.output + result.stderr
    return json.loads(result.stdout)


AIR = {
    "in the base of the cut": "",
    "in another base": "G55\nG1 X-20 Y30 Z15 F6000\nG54\n",
    "there and back": "G1 X-20 Y30 Z20 F6000\nG55\nG1 X-20 Y30 Z15\nG54\n",
}


@pytest.mark.parametrize("air", AIR.values(), ids=AIR.keys())
def test_the_blank_lies_in_the_base_of_the_first_motion_that_cuts(folder, air):
    """Base 2 is 3 mm higher: there the slot would be 8 mm deep."""
    cell(folder)
    text = HEAD + f"G0 X-20 Y30 Z15\n{air}G1 X-20 Y30 Z-5 F6000\nG1 X120 F3600\nG0 Z30\nM2\n"
    (folder / "part.ngc").write_text(text)
    assert engaged(folder)["removal_mm3"] == pytest.approx(SLOT, rel=0.003)
    state(folder, STOCK.replace("]]}", "]], base: 2}") + TOOLS)
    assert engaged(folder)["removal_mm3"] == pytest.approx(SLOT * 8 / 5, rel=0.003)


def test_a_base_in_which_no_motion_is_can_be_stated(folder):
    cell(folder)
    state(folder, STOCK.replace("]]}", "]], base: 2}") + TOOLS)
    assert engaged(folder)["removal_mm3"] == pytest.approx(SLOT * 8 / 5, rel=0.003)
    state(folder, STOCK.replace("]]}", "]], base: 3}") + TOOLS)
    refused(folder, "STK010", "base 3", line=1)


def test_where_each_base_has_its_first_cut_in_the_other_one_it_has_to_be_stated(folder):
    """In base 1 the motion in base 2 cuts first, 2 mm deep; 10 mm higher it is in air, and that in base 1 cuts."""
    cell(folder)
    text = CELL.format(robot=find_robot("kuka_kr270")).replace(
        "bases: {1: {x: 1450, y: -100, z: 600, a: 0, b: 0, c: 0}}",
        "bases: {1: {x: 1450, y: -100, z: 600, a: 0, b: 0, c: 0}, 2: {x: 1450, y: -100, z: 590, a: 0, b: 0, c: 0}}",
    )
    (folder / "cell.yaml").write_text(text)
    # of the blank in base 1 (top 600 in the world) both cut, base 2 first; of that in base 2 (top 590) only the last
    text = HEAD + (
        "G0 X-20 Y30 Z15\nG55\nG1 X-20 Y30 Z8 F6000\nX120\nZ30\nG54\nG1 X-20 Y30 Z15\nZ-15\nX120\nZ30\nM2\n"
    )
    (folder / "part.ngc").write_text(text)
    refused(folder, "STK036", "bases 2, 1", "base: in stock")
    for base, depth in ((1, 15), (2, 5)):
        state(folder, STOCK.replace("]]}", f"]], base: {base}}}") + TOOLS)
        assert engaged(folder)["removal_mm3"] == pytest.approx(SLOT * depth / 5, rel=0.003)


def test_a_stock_that_was_left_lies_in_the_base_in_which_it_was_left(folder):
    """The second program cuts 4 mm aside: 4 of its 16 mm are still there."""
    cell(folder)
    call(folder, "--stock-out", folder / "one.stock")
    second = HEAD + "G0 X-20 Y34 Z5\nG0 Z-5\nG1 X120 F3600\nG0 Z30\nM2\n"
    state(folder, "stock: {from: one.stock}\n" + TOOLS)
    (folder / "part.ngc").write_text(second)
    assert engaged(folder)["removal_mm3"] == pytest.approx(SLOT / 4, rel=0.003)
    # 3 mm higher in its own base, 8 mm deep of which 5 are cut
    (folder / "part.ngc").write_text(second.replace("G54", "G55").replace("Z-5", "Z-11"))
    refused(folder, "STK036", "in the axes of base 1", "1 if it still lies there, or 2 if")
    state(folder, "stock: {from: one.stock, base: 1}\n" + TOOLS)
    assert engaged(folder)["removal_mm3"] == pytest.approx(100 * (4 * 5 + 16 * 3), rel=0.003)
    state(folder, "stock: {from: one.stock, base: 2}\n" + TOOLS)
    assert engaged(folder)["removal_mm3"] == pytest.approx(100 * (4 * 5 + 16 * 6), rel=0.003)
    # a file of an earlier version says nothing of its base
    with np.load(folder / "one.stock") as archive:
        kept = {name: archive[name] for name in archive if name != "base"}
    with (folder / "one.stock").open("wb") as file:
        np.savez_compressed(file, **kept)
    state(folder, "stock: {from: one.stock}\n" + TOOLS)
    assert engaged(folder)["removal_mm3"] == pytest.approx(100 * (4 * 5 + 16 * 6), rel=0.003)


TABLE = "%\nO1\nG21 G90 G17 G54 G94\nT1 M6\nS12000 M3\n"
TABLE += "G0 X-20. Y{0}. Z5. A0. B0. C{1}.\nG0 Z-5.\nG1 X120. F3600.\nG0 Z30.\n"
TURNED = "G0 C{0}.\nG0 X-20. Y45.\nG0 Z-5.\nG1 X120. F3600.\nG0 Z30.\n"


@pytest.mark.parametrize("turn", [180, 1])
def test_a_stock_does_not_turn_with_a_table_whose_axis_is_not_stated(folder, turn):
    cell(folder, dialect="{name: fanuc, rotary_words: part}")
    start = TABLE.format(15, 0)
    (folder / "part.ngc").write_text(start + TURNED.format(turn) + "M30\n%\n")
    refused(folder, "STK035", "turned the part", line=13)
    (folder / "part.ngc").write_text(start + TURNED.format(0) + "M30\n%\n")
    assert engaged(folder)["removal_mm3"] == pytest.approx(2 * SLOT, rel=0.003)
    # elsewhere from the beginning: the blank is as it lies then; and back in air
    (folder / "part.ngc").write_text(TABLE.format(15, turn) + "G0 C0.\nM30\n%\n")
    assert engaged(folder)["removal_mm3"] == pytest.approx(SLOT, rel=0.003)


KRL = """DEF part()
$BASE=BASE_DATA[1]
$TOOL=TOOL_DATA[1]
$VEL.CP=0.06
PTP {{A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0}}
{}END
"""


def pass_at(y, z=-5):
    """Four lines: to the start, down, along, up."""
    return (
        f"PTP {{X -20,Y {y},Z 30,A 0,B 0,C 180,S 'B010',T 'B000010'}}\n"
        f"PTP {{X -20,Y {y},Z {z},A 0,B 0,C 180,S 'B010',T 'B000010'}}\n"
        f"LIN {{X 120,Y {y},Z {z},A 0,B 0,C 180}}\nLIN {{X 120,Y {y},Z 30,A 0,B 0,C 180}}\n"
    )


ONE, TWO, AIR_PASS = pass_at(30), pass_at(34), pass_at(30, 20)
FLOWS = {
    "in order": (ONE + TWO, None),
    "if, else": ("IF $IN[1] THEN\n" + ONE + "ELSE\n" + TWO + "ENDIF\n", (12, "line 9 may be skipped")),
    "if": ("IF $IN[1] THEN\n" + ONE + "ENDIF\n" + TWO, (12, "line 9 may be skipped")),
    "case": (
        "SWITCH A\nCASE 1\n" + ONE + "CASE 2\n" + TWO + "ENDSWITCH\n",
        (13, "line 10 may be skipped"),
    ),
    "goto": ("IF $IN[1] THEN\nGOTO X\nENDIF\n" + ONE + "X:\n" + TWO, (14, "line 11 may be skipped")),
    "while": ("WHILE $IN[1]\n" + ONE + "ENDWHILE\n" + TWO, (7, "line 9 may run several times")),
    "air in a branch": ("IF $IN[1] THEN\n" + AIR_PASS + "ENDIF\n" + ONE, None),
    "nothing after it": (ONE + "IF $IN[1] THEN\n" + AIR_PASS + "ENDIF\n", None),
    "constant": ("FOR I=1 TO 1\n" + ONE + "ENDFOR\n" + TWO, None),
}


@pytest.mark.parametrize(("text", "told"), FLOWS.values(), ids=FLOWS.keys())
def test_cuts_that_may_not_run_once_are_reported(folder, text, told):
    cell(folder)
    (folder / "cell.yaml").write_text(
        (folder / "cell.yaml").read_text().replace("dialect: {name: linuxcnc}\n", "")
    )
    declared = "DECL INT A, I\n"
    (folder / "part.src").write_text(KRL.format(text).replace("DEF part()\n", "DEF part()\n" + declared))
    found = engaged(folder, "part.src", 3 if told else 0)
    own = [one for one in found["findings"] if one["code"] == "STK034"]
    assert len(own) == bool(told)
    if told:
        line, words = told
        assert own[0]["line"] == line + 1
        _, at, runs = words.split(" ", 2)
        assert f"in line {int(at) + 1} {runs}" in own[0]["message"]


def test_a_routine_of_another_file_may_cut(folder):
    cell(folder)
    (folder / "cell.yaml").write_text(
        (folder / "cell.yaml").read_text().replace("dialect: {name: linuxcnc}\n", "")
    )
    (folder / "rough.src").write_text("DEF rough()\n" + ONE + "END\n")
    (folder / "part.src").write_text(KRL.format("rough()\n" + TWO))
    found = engaged(folder, "part.src", 3)
    (own,) = (one for one in found["findings"] if one["code"] == "STK034")
    assert (own["line"], "may cut" in own["message"]) == (7, True)
    # one that does not move the robot changes nothing
    (folder / "rough.src").write_text("DEF rough()\n$OUT[1]=TRUE\nEND\n")
    assert not [one for one in engaged(folder, "part.src")["findings"] if one["code"] == "STK034"]
