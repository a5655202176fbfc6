"""M99 of a main program, the arguments of macros, and operators: what the manuals of the controls say they do.

The ends of the motions are worked out by hand; each rule is beside its cases.
"""

from __future__ import annotations

import pytest
from test_gcode_followed import read, run

RETURNS = [
    # M99 P in a main program goes on at the block with that number (Fanuc, operator's manual, "M99 in the main
    # program": "control is returned to the sequence number"); what it passes does not run.
    ("G1 X1.\nM99 P60\nG1 X2.\nN60 G1 X3. Y1.\nX4.\nM30\n", ["1 0 0", "3 1 0", "4 1 0", "?*"]),
    ("G1 X1.\n#1=1\nIF [#1 EQ 1] THEN M99 P60\nX2.\nN60 X3.\nM30\n", ["1 0 0", "3 0 0", "?*"]),
    ("G1 X1.\nGOTO 40\nX9.\nN40\nM99 P60\nX8.\nN60 X7.\nM30\n", ["1 0 0", "7 0 0", "?*", "?*"]),
    # on a condition that is not known, what it passes may run or not
    ("G1 X1.\nIF [#500 EQ 1] THEN M99 P60\nG1 X2.\nN60 G1 X3. Y1.\nM30\n", ["1 0 0", "?*", "3 1 0"]),
    ("G1 X1.\n/M99 P60\nG91 G1 X2.\nN60 G1 X3. Y1.\nM30\n", ["1 0 0", "?*", "?*"]),
    # a number that no block has, or that is not known, is followed nowhere
    ("G1 X1.\nM99 P61\nG1 X2.\nM30\n", ["?*", "?*"]),
    ("G1 X1.\nM99 P#500\nG1 X2.\nN5 X3.\nM30\n", ["?*", "?*", "?*"]),
    # Without P the program runs again from its start, with the modes that are in force ("returned to the start of the
    # main program").  Of the head G90 is stated again, and all of it is the same.
    ("G1 X1.\nG91 Y2.\nM99\n", ["1 0 0", "1 2 0"]),
    ("N5 G0 X0. Y0.\nG1 X1.\nG91 Y2.\nM99 P5\n", ["0 0 0*", "1 0 0*", "1 2 0*"]),
    ("N5 G90 G0 X0. Y0.\nG1 X1.\nG91 Y2.\nM99 P5\n", ["0 0 0", "1 0 0", "1 2 0"]),
    # the feed of the second pass: 60 the first time, 30 after it
    ("N5 G0 X0. Y0.\nG1 X1.\nG1 Y1. F30.\nM99 P5\n", ["0 0 0", "1 0 0*", "1 1 0"]),
    # another work offset, another tool
    ("N5 G0 X0.\nG1 X1.\nG55\nG0 X0. Y0. Z0.\nM99 P5\n", ["0 0 0*", "1 0 0*", "0 0 0"]),
    ("N5 G0 X0. Y0. Z0.\nG1 X1.\nT2 M6\nG0 X0. Y0. Z0.\nM99 P5\n", ["0 0 0*", "1 0 0*", "0 0 0"]),
    # where a line starts: from X0 the first time, from X2 the second
    ("N5 G1 X1.\nX2.\nM99 P5\n", ["1 0 0*", "2 0 0"]),
    # a variable that is counted on is another one in each pass
    ("#100=1.\nN5 G0 X0.\nG1 X#100\n#100=#100+1.\nM99 P5\n", ["0 0 0", "1 0 0*"]),
    ("N5 #100=1.\nG0 X0.\nG1 X#100\n#100=#100+1.\nM99 P5\n", ["0 0 0", "1 0 0"]),
    # a slash before it: the program may go back, or on
    ("N5 G0 X0. Y0.\nG1 X1.\nG91 Y2.\n/M99 P5\nG90 X7.\nM30\n", ["0 0 0*", "1 0 0*", "1 2 0*", "7 2 0*"]),
    ("N5 G90 G0 X0. Y0.\nG1 X1.\nG91 Y2.\n/M99 P5\nG90 X7.\nM30\n", ["0 0 0", "1 0 0", "1 2 0", "7 2 0"]),
    # in a branch, and behind a jump over it
    ("N5 G0 X0. Y0.\nG1 X1.\nG91 Y2.\nIF [#500 EQ 1] GOTO 9\nM99 P5\nN9 G90 X7.\nM30\n",
     ["0 0 0*", "1 0 0*", "1 2 0*", "7 2 0*"]),
    ("N5 G90 G0 X0. Y0.\nG1 X1.\nG91 Y2.\nIF [#500 EQ 1] GOTO 9\nM99 P5\nN9 G90 X7.\nM30\n",
     ["0 0 0", "1 0 0", "1 2 0", "7 2 0"]),
    # where the flow is not followed, nothing is said of what it repeats
    ("G1 X1.\nG91 X1.\nGOTO #500\nM99\n", ["?*", "?*"]),
    # of a subprogram it goes back to the call
    ("M98 P2\nG1 Y1.\nM30\nO2\nG1 X1.\nM99\n", ["1 0 0", "1 1 0"]),
]  # fmt: skip


@pytest.mark.parametrize(("text", "ends"), RETURNS)
def test_m99_of_a_main_program_leads_back_or_on(text: str, ends: list[str]) -> None:
    assert run("fanuc", text) == ends


def test_nothing_is_said_to_be_after_the_end_where_m99_goes_on() -> None:
    program = read("fanuc", "G1 X1.\nM99 P60\nG1 X2.\nN60 G1 X3.\nM30\n")
    (said,) = [finding for finding in program.findings if finding.code == "GCO025"]
    assert (said.line, "does not run" in said.message) == (8, True)


SUB = "\nM30\nO2\nG1 X#{} Y#{}\nM99\n"
ARGUMENTS = [
    # Fanuc, operator's manual, custom macro, "argument specification II": I, J and K again and again are #4, #5, #6,
    # #7, #8, #9 and so on; the letters that are used say which specification it is.
    ("I5. J6. I8. J9.", (4, 5), "5 6 0"),
    ("I5. J6. I8. J9.", (7, 8), "8 9 0"),
    ("A1. B2. C3. I4. J5. K6. I7. J8. K9.", (1, 9), "1 9 0"),
    ("I1. J2. K3. I4. J5. K6. I7. J8. K9. I10.", (13, 12), "10 9 0"),
    # a letter that is left out of a set leaves its variable
    ("I1. I2. K3.", (4, 7), "1 2 0"),
    ("I1. I2. K3.", (7, 9), "2 3 0"),
    ("I5. I8.", (4, 8), ""),
    # mixed, the later one holds: its example has #7 as 5 by D5., after I4.
    ("A1. B2. I-3. I4. D5.", (4, 7), "-3 5 0"),
    ("D5. I-3. I4.", (4, 7), "-3 4 0"),
    # "I, J and K need to be specified alphabetically": what another order does is not stated
    ("K7. I5.", (6, 4), ""),
    ("A1. K7. I5.", (1, 1), "1 1 0"),
    ("I1. K2. J3.", (4, 5), ""),
    # once each in this order it is specification I
    ("I5. J6. K7. D8.", (4, 7), "5 8 0"),
    ("K7. D5.", (6, 7), "7 5 0"),
    # more than ten are an alarm; of other letters twice it is not stated which holds
    (" ".join(f"I{i}." for i in range(1, 12)), (4, 7), ""),
    ("A1. A2. B3.", (1, 2), ""),
]


@pytest.mark.parametrize(("words", "variables", "end"), ARGUMENTS)
def test_letters_of_g65_set_the_variables_of_their_specification(
    words: str, variables: tuple[int, int], end: str
) -> None:
    assert run("fanuc", f"G65 P2 {words}" + SUB.format(*variables)) == [end or "?*"]


def test_arguments_are_counted_in_their_order_when_they_are_computed() -> None:
    text = "#100=5.\nG65 P2 I#100 J1. I[#100+1.]" + SUB
    assert run("fanuc", text.format(4, 7)) == ["5 6 0"]
    assert run("fanuc", text.format(4, 5)) == ["5 1 0"]


OPERATORS = [
    # Fanuc, "arithmetic and logic operation", MOD: operands are rounded to whole numbers, a negative first one gives a
    # negative result; other controls of this kind do not say so: only counts are known.
    ("fanuc", "7. MOD 3.", 1.0), ("fanuc", "9. MOD 3.", 0.0), ("fanuc", "-7. MOD 3.", None),
    ("fanuc", "7.6 MOD 3.", None), ("fanuc", "7. MOD 2.4", None), ("fanuc", "7. MOD -3.", None),
    # AND, OR and XOR work bit by bit on values (5 AND 6 is 4), and on what conditions give
    ("fanuc", "[5.] AND [6.]", None), ("fanuc", "[2.] OR [1.]", None), ("fanuc", "[1 EQ 1] AND [2 EQ 2]", 1.0),
    # Siemens, "operators": MOD and DIV are those of whole numbers (3 MOD 4 is 3, 7 DIV 4 is 1)
    ("sinumerik", "7 MOD 4", 3.0), ("sinumerik", "7 DIV 4", 1.0), ("sinumerik", "-7 MOD 4", None),
    ("sinumerik", "7.5 MOD 4", None), ("sinumerik", "-7 DIV 4", None),
]  # fmt: skip


@pytest.mark.parametrize(("name", "expression", "value"), OPERATORS)
def test_operators_are_known_where_the_manuals_agree(name: str, expression: str, value: float | None) -> None:
    text = f"G1 X=({expression})\n" if name == "sinumerik" else f"#100=[{expression}]\nG1 X#100\n"
    assert run(name, text) == ["?*" if value is None else f"{value:g} 0 0"]
