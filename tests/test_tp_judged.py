"""What the reader claims of Fanuc TP, held against an interpreter that runs the programs with random inputs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from case_files import TP_CASES
from tp_judge.claims import disagreements
from tp_judge.machine import TpMachine
from tp_judge.programs import FurtherTpWriter, TpWriter

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.dialect import Program

RUNS = 4


def read(text: str) -> Program:
    return DIALECTS["tp"].read((Document(Path("part.ls"), text.encode()),))


def judged(seed: int, shown=lambda text: text, writer=TpWriter) -> tuple[Program, list[str], int]:
    """The program of a seed as the reader sees it ``shown``, what its executions say against it, and how many motions
    they had."""
    text = writer(np.random.default_rng(seed)).program()
    program = read(shown(text))
    wrong, count = [], 0
    for run in range(RUNS):
        done = TpMachine(text, np.random.default_rng([seed, run])).run()
        count += len(done)
        wrong += disagreements(program, done)
    return program, wrong, count


def held(seeds: range, writer=TpWriter) -> tuple[int, int, int]:
    """Motions, those of them that the reader claims to know, and motions that were executed."""
    motions = known = executed = 0
    for seed in seeds:
        program, wrong, count = judged(seed, writer=writer)
        assert not wrong, (seed, wrong[:3])
        motions += len(program.toolpath)
        known += len(program.toolpath) - len(program.toolpath.constraints.refused)
        executed += count
    return motions, known, executed


def test_every_claim_holds_in_every_execution() -> None:
    motions, known, executed = held(range(40))
    assert known > 0.4 * motions
    assert executed > motions


@pytest.mark.slow
def test_every_claim_holds_in_every_execution_of_many_programs() -> None:
    motions, known, _ = held(range(1000, 2000))
    assert motions > 5000
    assert known > 0.4 * motions


def test_every_claim_of_further_options_holds() -> None:
    motions, known, executed = held(range(3000, 3040), FurtherTpWriter)
    assert known > 0.3 * motions
    assert executed > motions


@pytest.mark.slow
def test_every_claim_of_further_options_holds_in_many_programs() -> None:
    motions, known, _ = held(range(4000, 4600), FurtherTpWriter)
    assert motions > 3000
    assert known > 0.3 * motions


BEYOND = [
    "any_frame",
    "arcs",
    "calls",
    "feeds_in_registers",
    "jumps",
    "loops",
    "names",
    "outputs_and_options",
    "registers",
    "remarks",
    "speeds",
    "spelling",
    "taught_line",
]
"""Cases with forms that the interpreter does not run: names in brackets, axis targets, inputs, other spellings."""


@pytest.mark.parametrize(
    "path", [path for path in TP_CASES.good if path.stem not in BEYOND], ids=lambda path: path.stem
)
def test_every_claim_of_a_case_holds(path: Path) -> None:
    text = path.read_text("latin-1")
    for run in range(RUNS):
        done = TpMachine(text, np.random.default_rng(run)).run()
        assert disagreements(TP_CASES.read(text), done) == []


MISREADINGS = {
    "a corner": ("CR10", "CR11"),
    "a stop": ("FINE", "CR10"),
    "a speed": ("50mm/sec", "60mm/sec"),
    "a unit": ("cm/min", "mm/sec"),
    "a force": ("FORCE", "FORCED"),
    "an offset": (" Offset,PR[1]", ""),
    "weaving": ("Weave Sine[1]", "WAIT R[1]"),
    "a point": ("P[4] ", "P[5] "),
    "an auxiliary point": ("C P[4]", "C P[5]"),
    "a register": ("R[2]=R[1]+5", "R[2]=R[1]+6"),
    "an override": ("OVERRIDE=50%", "OVERRIDE=51%"),
    "an assigned point": ("P[3]=PR[1]", "R[8]=5"),
    "a condition": ("R[3]=1", "R[3]=2"),
    "a jump": ("JMP LBL[10]", "R[8]=1"),
    "a call": ("CALL OTHER", "R[8]=1"),
    "an angle": ("W = 180.000", "W = 181.000"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", MISREADINGS)
def test_a_misreading_is_found(name: str) -> None:
    old, new = MISREADINGS[name]
    assert any(judged(seed, lambda text: text.replace(old, new))[1] for seed in range(120))


FURTHER_MISREADINGS = {
    "a program beside a motion": (
        ("TB .20sec,CALL OTHER", "TA .20sec,CALL OTHER(1)", "DB 3.0mm,CALL OTHER"),
        "",
    ),
    "an increment": ((" INC",), ""),
    "a skip": (("Skip,LBL",), "ACC50 ;!"),
    "a coordinated motion": ((" COORD",), ""),
    "a second group": (("   GP2:\n\tUF : 1, UT : 1,\n\tJ1= 5.000 deg\n",), ""),
    "a name in brackets": (("P[3:corner]",), "P[4]"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FURTHER_MISREADINGS)
def test_a_misreading_of_further_options_is_found(name: str) -> None:
    old, new = FURTHER_MISREADINGS[name]

    def shown(text: str) -> str:
        for words in old:
            text = text.replace(words, new)
        return text

    assert any(judged(seed, shown, FurtherTpWriter)[1] for seed in range(200))
