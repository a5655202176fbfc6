"""Loops, branches, jumps and calls of drawn programs, read as a walk through their tree runs them."""

from __future__ import annotations

import itertools
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from gcode_flow_programs import WRITERS, Drawing, Tree, Writer
from gcode_judge.misreadings import written as made_of
from gcode_judge.oracle import MISSING, RS274, execute
from test_gcode_followed import HEAD, read, run

from postproc.toolpath import Toolpath

Place = tuple[float, ...]
AT_A_TIME = 4
"""Programs of a test."""
BATCHES = pytest.mark.parametrize("batch", range(10))
CONTROLS = pytest.mark.parametrize("control", WRITERS)


@cache
def drawn(control: str, seed: int, doubts: bool) -> tuple[Tree, Writer]:
    tree = Drawing(seed, control, doubts).tree()
    return tree, WRITERS[control](tree, seed)


def batch_of(control: str, batch: int, doubts: bool) -> list[tuple[Tree, Writer]]:
    seeds = range(batch * AT_A_TIME, (batch + 1) * AT_A_TIME)
    return [drawn(control, seed, doubts) for seed in seeds]


def rounded(place: np.ndarray | Place) -> Place:
    return tuple((np.round(place, 6) + 0.0).tolist())


def lines_of(tree: Tree, writer: Writer, answers: tuple[int, ...] = ()) -> list[tuple[int, Place]]:
    """The motions of a run: their lines, and where they end [mm]."""
    lines = {id(node): line for line, node in writer.nodes.items()}
    return [(lines[id(ran.node)], rounded(ran.end)) for ran in tree.run(answers)]


def located(path: Toolpath, first: int = 1) -> list[tuple[int, Place]]:
    """The motions after the head whose end is known: their lines and ends [mm]."""
    known = np.isfinite(path.position).all(axis=1)
    rows = [row for row in range(first, len(path)) if known[row]]
    return [(int(path.line[row]), rounded(path.position[row] * 1e3)) for row in rows]


def refused_lines(path: Toolpath) -> set[int]:
    return {int(path.line[row]) for row in path.constraints.refused}


@CONTROLS
@BATCHES
def test_what_is_decided_runs_as_the_tree_says(control: str, batch: int) -> None:
    """Pass by pass; what runs once can be corrected, what runs several times or never can not."""
    for tree, writer in batch_of(control, batch, False):
        path = read(control, writer.text, "").toolpath
        ran = lines_of(tree, writer)
        assert located(path) == ran, writer.text
        often = Counter(line for line, _ in ran)
        assert refused_lines(path) == {line for line in writer.nodes if often[line] != 1}, writer.text


@CONTROLS
@BATCHES
def test_comments_are_passed_as_often_as_the_tree_says(control: str, batch: int) -> None:
    """The one in force at each motion is that which the run passed last."""
    for tree, writer in batch_of(control, batch, False):
        path = read(control, writer.text, "").toolpath
        said = {note.row: note.text.rpartition(" ")[2] for note in path.annotations}
        last, found = 0, []
        for row in range(len(located(path, 0))):
            last = int(said.get(row, last))
            found.append(last)
        assert found[1:] == [ran.said for ran in tree.run()], writer.text


ANSWERS = [answers * 4 for answers in itertools.product((0, 1, 2), repeat=3)]
"""How often what may run or not runs: none, all, and mixed."""


def check_claims(tree: Tree, writer: Writer, path: Toolpath) -> None:
    """What is claimed of a motion is so in every run."""
    runs = [lines_of(tree, writer, answers) for answers in ANSWERS]
    refused = refused_lines(path)
    claimed = {line: place for line, place in located(path) if line not in refused}
    for ran in runs:
        places = dict(ran)
        often = Counter(line for line, _ in ran)
        for line, place in claimed.items():
            assert (often[line], places.get(line)) == (1, place), f"line {line} of\n{writer.text}"


def sure_lines(tree: Tree, writer: Writer) -> set[int]:
    """Motions that run once, of which nothing hangs on what may run or not."""
    lines = {id(node): line for line, node in writer.nodes.items()}
    found = set(writer.nodes)
    for answers in ANSWERS:
        ran = tree.run(answers)
        often = Counter(lines[id(one.node)] for one in ran)
        found &= {lines[id(one.node)] for one in ran if one.sure and often[lines[id(one.node)]] == 1}
    return found


@CONTROLS
@BATCHES
def test_what_is_claimed_beside_what_may_run_or_not_is_so_in_every_run(control: str, batch: int) -> None:
    for tree, writer in batch_of(control, batch, True):
        check_claims(tree, writer, read(control, writer.text, "").toolpath)


@CONTROLS
@BATCHES
def test_the_force_of_what_is_claimed_is_so_in_every_run(control: str, batch: int) -> None:
    """The comment in force at a motion that can be corrected is that which every run passes last before it."""
    for tree, writer in batch_of(control, batch, True):
        path = read(control, writer.text, "").toolpath
        lines = {id(node): line for line, node in writer.nodes.items()}
        every = [{lines[id(ran.node)]: ran.said for ran in tree.run(answers)} for answers in ANSWERS]
        said = {note.row: int(note.text.rpartition(" ")[2]) for note in path.annotations}
        last = 0
        for row in range(len(path)):
            last, line = said.get(row, last), int(path.line[row])
            if line in lines.values() and row not in path.constraints.refused:
                assert {one[line] for one in every} == {last}, f"line {line} of\n{writer.text}"


@CONTROLS
@BATCHES
def test_what_hangs_on_nothing_uncertain_is_known(control: str, batch: int) -> None:
    """But behind a call that may happen or not: what it leaves is not followed."""
    for tree, writer in batch_of(control, batch, True):
        path = read(control, writer.text, "").toolpath
        known = {line for line, _ in located(path)} - refused_lines(path)
        missing = sure_lines(tree, writer) - known
        assert not missing, f"{missing} of\n{writer.text}"


@BATCHES
def test_what_is_claimed_in_the_order_of_the_text_is_so_in_every_run(batch: int) -> None:
    """A return that is in no subprogram is not followed; nor is then the flow."""
    for seed in range(batch * AT_A_TIME, (batch + 1) * AT_A_TIME):
        tree, _ = drawn("linuxcnc", seed, True)
        writer = WRITERS["linuxcnc"](tree, seed, "o999 return\n")
        path = read("linuxcnc", writer.text, "").toolpath
        check_claims(tree, writer, path)
        top = {id(node) for node in tree.main if node.name == "place"}
        places = {line for line, node in writer.nodes.items() if id(node) in top}
        assert tree.subs or places <= {line for line, _ in located(path)}


def otherwise(text: str, control: str, kind: str) -> str:
    """The same program written in another way, line by line."""
    lines = text.splitlines()
    if kind == "comments":
        mark = ";" if control == "sinumerik" else "("
        return "\n".join(f"{line} {mark}X9{')' if mark == '(' else ''}" for line in lines) + "\n"
    if kind == "lower case":
        return text.lower()
    if kind == "windows":
        return text.replace("\n", "\r\n")
    blank = "\t" if control == "linuxcnc" else "  "
    return text.replace(" ", blank)


@CONTROLS
@pytest.mark.parametrize("kind", ["comments", "lower case", "windows", "blanks"])
@pytest.mark.parametrize("seed", range(100, 104))
def test_other_writings_of_a_program_run_alike(control: str, kind: str, seed: int) -> None:
    for doubts in (False, True):
        _, writer = drawn(control, seed, doubts)
        paths = [
            read(control, text, "").toolpath for text in (writer.text, otherwise(writer.text, control, kind))
        ]
        assert located(paths[0]) == located(paths[1])
        assert refused_lines(paths[0]) == refused_lines(paths[1])


@pytest.mark.skipif(RS274 is None, reason=MISSING)
@pytest.mark.parametrize(
    "batch", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)]
)
def test_linuxcnc_runs_the_trees_alike(batch: int, tmp_path: Path) -> None:
    """So that what is compared above is no error in common."""
    for seed in range(batch * 12, (batch + 1) * 12):
        tree, writer = drawn("linuxcnc", seed, False)
        motions = execute(made_of(writer.text), tmp_path)
        assert motions is not None, writer.text
        ran = lines_of(tree, writer)
        assert [motion.line for motion in motions[1:]] == [line for line, _ in ran]
        ends = np.array([end for _, end in ran])
        np.testing.assert_allclose([motion.end for motion in motions[1:]], ends, atol=1e-3)


BY_HAND = [
    # how often a call runs is not known: it is no call that runs once
    ("fanuc", "M98 P2 L#500\nG1 Y1.\nM30\nO2\nG91 G1 X1.\nG90\nM99\n", ["?*", "?*"]),
    ("fanuc", "#1=2\nM98 P2 L#1\nG1 Y1.\nM30\nO2\nG91 G1 X1.\nG90\nM99\n", ["1 0 0*", "2 0 0*", "2 1 0"]),
    ("fanuc", "M98 P2 L1.5\nG1 Y1.\nM30\nO2\nG91 G1 X1.\nG90\nM99\n", ["?*", "?*"]),
    ("fanuc", "M98 P2 L-1\nG1 Y1.\nM30\nO2\nG91 G1 X1.\nG90\nM99\n", ["?*", "?*"]),
    ("fanuc", "G65 P2 L#500\nG1 Y1.\nM30\nO2\nG91 G1 X1.\nG90\nM99\n", ["?*", "?*"]),
    ("fanuc", "M97 P2 L#500\nG1 Y1.\nM30\nN2 G91 G1 X1.\nG90\nM99\n", ["?*", "?*"]),
    ("sinumerik", "L5 P=R90\nG1 Y1\nM30\n%_N_L5_SPF\nG91 G1 X1\nG90\nM17\n", ["?*", "?*"]),
    # of two counts none is the packed one
    ("fanuc", "M98 P30003\nG1 Y1.\nM30\nO3\nG91 G1 X1.\nG90\nM99\n", ["1 0 0*", "2 0 0*", "3 0 0*", "3 1 0"]),
    ("fanuc", "M98 P30003 L2\nG1 Y1.\nM30\nO3\nG91 G1 X1.\nG90\nM99\n", ["?*", "?*"]),
    # from a block of the subprogram on
    ("fanuc", "M98 P2 Q5\nG1 Y1.\nM30\nO2\nG1 X1.\nN5 G1 Z1.\nM99\n", ["?*", "?*", "?*"]),
    ("fanuc", "M98 P2 Q#500\nG1 Y1.\nM30\nO2\nG1 X1.\nN5 G1 Z1.\nM99\n", ["?*", "?*", "?*"]),
    # where a jump leads to
    ("fanuc", "#100=7\nGOTO#100\nG1 X1.\nN7 G1 Y1.\nM30\n", ["0 1 0", "?*"]),
    ("fanuc", "#100=7\nGOTO[#100+1]\nG1 X1.\nN8 G1 Y1.\nM30\n", ["0 1 0", "?*"]),
    ("fanuc", "GOTO#500\nG1 X1.\nN8 G1 Y1.\nM30\n", ["?*", "?*"]),
    (
        "sinumerik", "G1 X1\nR1=2\nCASE R1 OF 1 GOTOF A1 2 GOTOF B1 DEFAULT GOTOF C1\nA1: G1 X5\nB1: G1 X7\n"
        "C1: G1 X3 Y1\n", ["1 0 0", "?*", "?*", "3 1 0"],
    ),
    (
        "sinumerik", "G1 X1\nR1=2\nCASE R1 OF 1 GOTOF A1 2 GOTOF \"B\"<<R1\nA1: G1 X5\nB2: G1 X7\n",
        ["?*", "?*", "?*"],
    ),
    ("sinumerik", "A1: G1 X=IC(1)\nG1 X=IC(1)\nIF R90>1 GOTOB A1\nG1 Y1\nA1: G1 Z1\n", ["?*", "?*", "?*", "?*"]),
    # a slash before a call of LinuxCNC
    ("linuxcnc", "G1 X5\nO1 SUB\nG91\nO1 ENDSUB\n/O1 CALL\nG1 X2 Y2 Z2\n", ["5 0 0", "?*"]),
    ("linuxcnc", "G1 X5\nO1 SUB\nG91\nO1 ENDSUB\n/ O1 CALL\nG1 X2 Y2 Z2\n", ["5 0 0", "?*"]),
    ("linuxcnc", "#101=4\nO1 SUB\n#101=2\nO1 ENDSUB\n/O1 CALL\nG1 X#101\n", ["?*"]),
    # what a subprogram gives back, and what it sees
    ("linuxcnc", "O1 SUB\nO1 ENDSUB [#1+2]\nO1 CALL [3]\nG1 X#<_value>\n", ["5 0 0"]),
    (
        "linuxcnc", "O1 SUB\nO2 IF [#1 EQ 3]\nO1 RETURN [7]\nO2 ENDIF\nO1 ENDSUB [#1+2]\nO1 CALL [3]\n"
        "G1 X#<_value>\nO1 CALL [4]\nY#<_value>\n", ["7 0 0", "7 6 0"],
    ),
    ("linuxcnc", "O<Hole> SUB\n#<d>=#1\nG1 Z-#<d>\nO<hole> ENDSUB\no<hole> call [3]\n", ["0 0 -3"]),
    ("linuxcnc", "#<d>=2\nO1 SUB\n#<d>=4\nO1 ENDSUB\nO1 CALL\nG1 X#<d>\n", ["2 0 0"]),
    ("linuxcnc", "#<_d>=2\nO1 SUB\n#<_d>=4\nO1 ENDSUB\nO1 CALL\nG1 X#<_d>\n", ["4 0 0"]),
    ("linuxcnc", "#30=2\n#31=2\nO1 SUB\n#30=4\n#31=4\nO1 ENDSUB\nO1 CALL\nG1 X#30 Y#31\n", ["2 4 0"]),
    ("fanuc", "#33=2.\n#100=2.\nG65 P2\nG1 X#33 Y#100\nM30\nO2\n#33=4.\n#100=4.\nM99\n", ["2 4 0"]),
    ("fanuc", "#34=2.\nG65 P2\nG1 X#34\nM30\nO2\n#34=4.\nM99\n", ["4 0 0"]),
    ("fanuc", "#1=4.\nM98 P2\nG1 X#1\nM30\nO2\n#1=9.\nM99\n", ["9 0 0"]),
    ("sinumerik", "R1=1\nL5\nG1 X=R1\nM30\n%_N_L5_SPF\nR1=2\nM17\n", ["2 0 0"]),
    ("sinumerik", "DEF REAL _A=1\nL5\nG1 X=_A\nM30\n%_N_L5_SPF\nDEF REAL _A=4\nG1 Y=_A\nM17\n", ["0 4 0", "1 4 0"]),
    ("sinumerik", "PART\nG1 X1\nM30\n%_N_PART_SPF\nG1 Y4\nRET\n", ["0 4 0", "1 4 0"]),
    # the end of a subprogram with SAVE restores the G functions and the frame of its caller
    ("sinumerik", "G1 X1\nPART\nX2\nM30\n%_N_PART_SPF\nPROC PART\nG91 X5\nM17\n", ["1 0 0", "6 0 0", "8 0 0"]),
    ("sinumerik", "G1 X1\nPART\nX2\nM30\n%_N_PART_SPF\nPROC PART SAVE\nG91 X5\nM17\n", ["1 0 0", "6 0 0", "2 0 0"]),
    ("sinumerik", "G1 X1\nPART\nX2\nM30\n%_N_PART_SPF\nPROC PART DISPLOF SAVE\nG70\nRET\n", ["1 0 0", "2 0 0"]),
    ("sinumerik", "TRANS X10\nG1 X1\nPART\nX2\nM30\n%_N_PART_SPF\nPROC PART SAVE\nATRANS X5 Y1\nX3\nM17\n",
     ["11 0 0", "18 0 0", "12 0 0"]),
    ("sinumerik", "G1 X1\nPART\nX2 Y2 Z2\nM30\n%_N_PART_SPF\nPROC PART SAVE\nTOROT\nM17\n", ["1 0 0", "?*"]),
    ("sinumerik", "L5 P2\nG1 Y1\nM30\n%_N_L5_SPF\nPROC L5 SAVE\nG1 X1\nG91\nM17\n", ["1 0 0*", "1 0 0*", "1 1 0"]),
    (
        "sinumerik", "L5\nG1 X1\nM30\n%_N_L5_SPF\nPROC L5 SAVE\nTRANS Y3\nL6\nG1 X2\nM17\n"
        "%_N_L6_SPF\nG91\nTRANS Y4\nM17\n", ["2 0 0", "1 0 0"],
    ),
    (
        "sinumerik", "L5\nG1 X1\nM30\n%_N_L5_SPF\nG91\nTRANS Y3\nL6\nG1 X2\nM17\n"
        "%_N_L6_SPF\nPROC L6 SAVE\nG90\nTRANS Y4\nM17\n", ["2 0 0", "3 0 0"],
    ),
    # the arguments of G65: the variables of their letters
    *(
        ("fanuc", f"G65 P2 {letter}5.\nM30\nO2\nG1 X#{number}\nM99\n", ["5 0 0"])
        for letter, number in zip("DEFHIJKMQRSTUVWXYZ", (7, 8, 9, 11, 4, 5, 6, 13, *range(17, 27)), strict=True)
    ),
    # modes that are brought back; other codes leave them alone
    ("linuxcnc", "G1 X1\nM70\nG91\nM72\nX2 Y2 Z2\n", ["1 0 0", "2 2 2"]),
    ("linuxcnc", "G1 X1\nM70\nG91\nM8\nX2 Y2 Z2\nG90 X3 Y3 Z3\n", ["1 0 0", "3 2 2", "3 3 3"]),
    # parts that are repeated
    ("sinumerik", "A1:\nG1 X=IC(1)\nENDLABEL:\nG1 X5\nREPEAT A1 P=2\nG1 Y1\n",
     ["1 0 0*", "5 0 0", "6 0 0*", "7 0 0*", "7 1 0"]),
    ("sinumerik", "A1: G1 X=IC(1)\nG1 Y=IC(1)\nREPEATB A1 P=2\nG1 Z1\n",
     ["1 0 0*", "1 1 0", "2 1 0*", "3 1 0*", "3 1 1"]),
    ("sinumerik", "A1:\nG1 X=IC(1)\nREPEAT A1\nG1 Y1\n", ["1 0 0*", "2 0 0*", "2 1 0"]),
    ("sinumerik", "A1:\nG1 X=IC(1)\nB1:\nG1 Z1\nREPEAT A1 B1 P=0\nG1 Z3\n", ["1 0 0", "1 0 1", "1 0 3"]),
    # whether the block of the last label is repeated is not certain: where it says something, nothing is claimed
    ("sinumerik", "A1: G1 X=IC(1)\nG1 Y=IC(1)\nN5 B1:\nREPEAT A1 B1\nG1 Z1\n",
     ["1 0 0*", "1 1 0*", "2 1 0*", "2 2 0*", "2 2 1"]),
    ("sinumerik", "A1: G1 X=IC(1)\nB1: G1 Y=IC(1)\nREPEAT A1 B1 P=2\nG1 X9 Y9 Z1\n", ["?*", "?*", "9 9 1"]),
    ("sinumerik", "A1: G1 X=IC(1)\nENDLABEL: G1 Y=IC(1)\nREPEAT A1 P=2\nG1 X9 Y9 Z1\n", ["?*", "?*", "9 9 1"]),
    ("sinumerik", "REPEAT A1 B1\nA1: G1 X=IC(1)\nB1: G1 Y=IC(1)\nG1 X9 Y9 Z1\n", ["?*", "?*", "9 9 1"]),
    ("sinumerik", "R1=0\nA1: G1 X1\nB1: R1=R1+1\nREPEAT A1 B1\nG1 X9 Y=R1\n", ["?*", "?*"]),
    ("sinumerik", "A1:\nG1 X=IC(1)\nREPEAT A1 P=R90\nG1 X3 Y1 Z2\n", ["?*", "3 1 2"]),
    # LinuxCNC after a BREAK of a REPEAT, and CONTINUE of a DO
    ("linuxcnc", "#1=0\nO1 REPEAT [3]\nG1 X1\nO2 IF [#1 EQ 0]\nO1 BREAK\nO2 ENDIF\nO1 ENDREPEAT\nG1 X2 Y1 Z3\n",
     ["?*", "2 1 3"]),
    ("linuxcnc", "#1=0\nO1 DO\n#1=[#1+1]\nO2 IF [#1 EQ 2]\nO1 CONTINUE\nO2 ENDIF\nG1 X#1\nO1 WHILE [#1 LT 3]\nG1 Y1\n",
     ["1 0 0*", "3 0 0*", "3 1 0"]),
    # what stands behind a condition
    ("fanuc", "#1=2\nIF[#1EQ2]THEN G1 X4.\nX5.\n", ["4 0 0", "5 0 0"]),
    ("fanuc", "#1=2\nIF[#1EQ3]THEN G1 X4.\nX5.\n", ["5 0 0", "?*"]),
    ("fanuc", "G1 X1.\nIF[#500EQ3]THEN X4.\nX5. Y1. Z1.\n", ["1 0 0", "?*", "5 1 1"]),
    # what a block that may not run sets alone is not known
    ("fanuc", "#1=1.\n#2=2.\n/#1=7.\nG1 Y#2\nX#1\n", ["0 2 0", "?*"]),
    ("fanuc", "#1=1.\n#2=2.\nIF[#500GT1]THEN #1=7.\nG1 Y#2\nX#1\n", ["0 2 0", "?*"]),
    ("fanuc", "#2=2.\n/M98 P2\nG1 X#2\nM30\nO2\n#2=3.\nM99\n", ["?*"]),
]  # fmt: skip
"""Control, program, and the ends of its motions as the controls' manuals have them."""


@pytest.mark.parametrize(("control", "text", "ends"), BY_HAND)
def test_flow_by_hand(control: str, text: str, ends: list[str]) -> None:
    assert run(control, text) == ends


@pytest.mark.skipif(RS274 is None, reason=MISSING)
def test_linuxcnc_runs_what_is_derived_by_hand(tmp_path: Path) -> None:
    """Up to the first motion that is not known."""
    for control, text, ends in BY_HAND:
        if control == "linuxcnc":
            motions = execute(made_of(HEAD[control] + text + "M2\n"), tmp_path)
            known = list(itertools.takewhile(lambda end: "?" not in end, ends))
            if motions is None:  # it has no BREAK of a REPEAT
                assert not known
                continue
            found = [" ".join(f"{value + 0.0:g}" for value in np.round(one.end, 3)) for one in motions[1:]]
            assert found[: len(known)] == [end.rstrip("*") for end in known], text


@pytest.mark.parametrize(
    ("control", "text", "names"),
    [
        ("fanuc", "M98 P9\n", {"9"}), ("fanuc", "M98 P31234\n", {"31234", "1234"}), ("fanuc", "M98 P9999\n", {"9999"}),
        ("fanuc", "G65 P0007 X1.\n", {"7"}), ("fanuc", "M97 P50\n", set()), ("fanuc", "M98 P#500\n", set()),
        ("fanuc", "M98 P1.5\n", set()), ("fanuc", "M98 P0\n", set()), ("fanuc", "/M98 P9\n", {"9"}),
        ("fanuc", "#1=9\nM98 P#1\n", {"9"}), ("fanuc", "M98 P2\nM30\nO2\nM98 P3\nM99\n", {"3"}),
        ("fanuc", "IF[#500EQ1]GOTO5\nM98 P9\nN5\n", {"9"}), ("linuxcnc", "O<Part> CALL\n", {"PART"}),
        ("linuxcnc", "O7 CALL [1]\n", {"7"}), ("linuxcnc", "O1 SUB\nO1 ENDSUB\nO1 CALL\n", set()),
        ("sinumerik", "L9\n", {"L9"}), ("sinumerik", "POCKET\n", {"POCKET"}),
        ("sinumerik", "L9\nM30\n%_N_L9_SPF\nM17\n", set()),
    ],
)  # fmt: skip
def test_what_is_called_and_not_in_the_file(control: str, text: str, names: set[str]) -> None:
    assert read(control, text).unresolved == names
