"""Motions in branches that inherit components: what is written for a plan, and what an interpreter makes of it."""

from __future__ import annotations

import numpy as np
import pytest
from krl_judge.judge import Case
from krl_judge.programs import Generator
from krl_judge.written import judge_written, movable, moved, read

from postproc.languages.krl.rewritten_lines import carried

HEAD = "DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n"
FULL = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}"
SHIFT = np.array([0.25, 0.5, -0.125])


def lines_with(text: str, *shifted: int, data: str = "") -> list[str]:
    """The lines after the head with some of them moved by SHIFT; the first one is line 4."""
    program = read(Case(f"{HEAD}{text}END\n", data and f"DEFDAT part\n{data}ENDDAT\n"))
    after, kept = moved(program, dict.fromkeys(shifted, SHIFT))
    assert after is not None, kept
    return after.src.splitlines()[3:-1]


@pytest.mark.parametrize(
    ("text", "shifted", "changed"),
    [
        # what precedes the second branch is the motion before the IF, not the line before the ELSE
        (f"{FULL}\nIF $IN[1] THEN\nLIN {{Y 9}}\nELSE\nLIN {{X 7}}\nENDIF\n", 8,
         {8: "LIN {X 7.250,Y 2.500,Z 2.875,A 4,B 5,C 6}"}),
        (f"{FULL}\nIF $IN[1] THEN\nLIN {{Y 9}}\nELSE\nLIN {{X 7}}\nLIN {{Z 8}}\nENDIF\n", 8,
         {8: "LIN {X 7.250,Y 2.500,Z 2.875,A 4,B 5,C 6}", 9: "LIN {Z 8,X 7,Y 2}"}),
        (f"{FULL}\nIF $IN[1] THEN\nLIN {{Y 9}}\nELSE\nLIN {{X 7}}\nENDIF\n", 4,
         {4: "LIN {X 1.250,Y 2.500,Z 2.875,A 4,B 5,C 6}", 6: "LIN {Y 9,X 1,Z 3}", 8: "LIN {X 7,Y 2,Z 3,A 4,B 5,C 6}"}),
        # what is in the branch does not move what is in the other one
        (f"{FULL}\nIF $IN[1] THEN\nLIN {{Y 9}}\nELSE\nLIN {{X 7}}\nENDIF\n", 6,
         {6: "LIN {Y 9.500,X 1.250,Z 2.875,A 4,B 5,C 6}"}),
        # after the branches one of them may have moved
        (f"{FULL}\nIF $IN[1] THEN\nLIN {{X 7,Z 3}}\nENDIF\nLIN {{X 8}}\nLIN {{Y 8}}\n", 6,
         {6: "LIN {X 7.250,Z 2.875,Y 2.500,A 4,B 5,C 6}", 8: "LIN {X 8,Y 2,Z 3,A 4,B 5,C 6}"}),
        # a loop: its last motion precedes its first one
        (f"{FULL}\nLOOP\nLIN {{X 7}}\nLIN {{X 8}}\nENDLOOP\n", 7,
         {6: "LIN {X 7,Y 2,Z 3,A 4,B 5,C 6}", 7: "LIN {X 8.250,Y 2.500,Z 2.875,A 4,B 5,C 6}"}),
        (f"{FULL}\nIF $IN[1] THEN\nLIN_REL {{Y 9}}\nELSE\nLIN_REL {{X 7}}\nENDIF\n", 4,
         {4: "LIN {X 1.250,Y 2.500,Z 2.875,A 4,B 5,C 6}", 6: "LIN {X 1.000,Y 11.000,Z 3.000,A 4,B 5,C 6}",
          8: "LIN {X 8.000,Y 2.000,Z 3.000,A 4,B 5,C 6}"}),
    ],
)  # fmt: skip
def test_what_a_branch_inherits_is_written_where_what_may_precede_it_moves(
    text: str, shifted: int, changed: dict[int, str]
) -> None:
    expected = dict(enumerate(text.splitlines(), 4)) | changed
    assert lines_with(text, shifted) == list(expected.values())


def test_what_one_branch_leaves_otherwise_stays_with_what_precedes_it() -> None:
    """Y of the last motion is that of one of two lines: neither it nor these can move."""
    text = f"{FULL}\nIF $IN[1] THEN\nLIN {{X 7}}\nELSE\nLIN {{Y 8}}\nENDIF\nLIN {{X 9}}\n"
    assert movable(read(Case(f"{HEAD}{text}END\n")).toolpath) == {4}


def test_angles_that_do_not_count_are_not_written() -> None:
    text = f"{FULL}\n$ORI_TYPE=#CONSTANT\nIF $IN[1] THEN\nLIN {{X 5,A 9}}\nELSE\nLIN {{X 4,A 8}}\nENDIF\nLIN {{X 7}}\n"
    assert lines_with(text, 4)[-1] == "LIN {X 7,Y 2,Z 3}"


def test_the_orientation_that_a_branch_keeps_is_not_corrected_before_it() -> None:
    """With a constant orientation a motion takes that of the motion which precedes it, in the other branch too."""
    text = f"{FULL}\nIF $IN[1] THEN\n{FULL}\n{FULL}\nELSE\n$ORI_TYPE=#CONSTANT\n{FULL}\nENDIF\n"
    path = read(Case(f"{HEAD}{text}END\n")).toolpath
    assert path.constraints.orientation_programmed.tolist()[:2] == [False, True]


def test_a_line_of_which_one_run_is_not_known_is_not_completed_for_another_run() -> None:
    text = f"{FULL}\nFOR i=1 TO 2\nLIN {{Z 7}}\nPTP {{A1 5}}\nENDFOR\n"
    program = read(Case(f"{HEAD}DECL INT i\n{text}END\n"))
    after, kept = moved(program, {5: SHIFT})
    assert after is None
    assert kept == {5, 7}


def test_a_point_that_an_unknown_target_may_be_stays() -> None:
    """XP1 keeps in the .dat what the last run has left in it."""
    text = f"LIN XP1\n{FULL}\nXP1={{X 7,Y 2,Z 3,A 4,B 5,C 6}}\nLIN XP1\n"
    after = lines_with(text, 7, data="DECL E6POS XP1={X 1,Y 2,Z 3,A 4,B 5,C 6}\n")
    assert after[2:] == ["XP1={X 7,Y 2,Z 3,A 4,B 5,C 6}", "LIN {X 7.250,Y 2.500,Z 2.875,A 4,B 5,C 6}"]


@pytest.mark.parametrize(
    ("a", "b", "c"),
    [
        ("r", "100", "20"),
        ("10", "r", "20"),
        ("r", "r", "20"),
        ("10", "r", "r"),
        ("10", "90", "r"),
        ("r", "90", "20"),
    ],
)
def test_angles_of_expressions_are_written_in_the_spelling_of_the_others(a: str, b: str, c: str) -> None:
    """B beyond 90: each rotation has two spellings, and a mixture of them is another rotation."""
    value = "100" if b == "r" else "20"
    program = read(Case(f"{HEAD}DECL REAL r\nr={value}\nLIN {{X 1,Y 2,Z r,A {a},B {b},C {c}}}\nEND\n"))
    after, _ = moved(program, {6: SHIFT})
    assert after is not None
    np.testing.assert_allclose(read(after).toolpath.rotation, program.toolpath.rotation, atol=1e-5)


def test_words_in_expressions_are_not_carried_along() -> None:
    assert carried(b"{X 1,Y s[2],Z t,A e1*2}") == b""
    assert carried(b"{E6POS: S 2,X 1,T n[1,2] ,E1 s[2]}") == b"S 2,T n[1,2],E1 s[2]"


def wrong(seeds: range) -> tuple[int, list[str]]:
    count, found = 0, []
    for seed in seeds:
        moves, said = judge_written(Generator(seed).case(), seed)
        count += moves
        found += [f"seed {seed}: {one}" for one in said]
    return count, found


def test_random_programs_end_where_they_are_moved_to() -> None:
    moves, found = wrong(range(600_000, 600_030))
    assert found == []
    assert moves > 100


@pytest.mark.slow
@pytest.mark.parametrize("first", range(600_030, 600_270, 60))
def test_more_random_programs_end_where_they_are_moved_to(first: int) -> None:
    assert wrong(range(first, first + 60))[1] == []
