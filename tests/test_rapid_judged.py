"""What the reader claims of RAPID, held against an interpreter that runs the programs with random inputs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from case_files import RAPID_CASES
from rapid_judge.claims import disagreements
from rapid_judge.further import FurtherWriter
from rapid_judge.machine import Machine
from rapid_judge.programs import Writer

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.dialect import Program

RUNS = 4


def read(text: str) -> Program:
    return DIALECTS["rapid"].read((Document(Path("part.mod"), text.encode()),))


def judged(seed: int, shown=lambda text: text) -> tuple[Program, list[str]]:
    """The program of a seed as the reader sees it ``shown``, and what its executions say against it."""
    text = Writer(np.random.default_rng(seed)).program()
    program = read(shown(text))
    wrong = []
    for run in range(RUNS):
        wrong += disagreements(program, Machine(text, np.random.default_rng([seed, run])).run())
    return program, wrong


def judged_further(seed: int, shown=lambda text: text) -> tuple[Program, list[str]]:
    """As ``judged``, of programs with further forms, which are also run one after the other."""
    text = FurtherWriter(np.random.default_rng(seed)).program()
    program = read(shown(text))
    wrong = []
    for run in range(RUNS):
        machine = Machine(text, np.random.default_rng([seed, run]))
        for done in [machine.run()] if run % 2 else machine.cycles(3):
            wrong += disagreements(program, done)
    return program, wrong


def held(seeds: range, judge=judged) -> tuple[int, int]:
    """How many motions there are, and how many of them the reader claims to know."""
    motions = known = 0
    for seed in seeds:
        program, wrong = judge(seed)
        assert not wrong, (seed, wrong[:3])
        motions += len(program.toolpath)
        known += len(program.toolpath) - len(program.toolpath.constraints.refused)
    return motions, known


def test_every_claim_holds_in_every_execution() -> None:
    motions, known = held(range(20))
    assert known > 0.25 * motions


@pytest.mark.slow
def test_every_claim_holds_in_every_execution_of_many_programs() -> None:
    motions, known = held(range(1000, 1200))
    assert motions > 1200
    assert known > 0.25 * motions


def test_every_claim_of_further_forms_holds() -> None:
    motions, known = held(range(5000, 5020), judged_further)
    assert known > 0.08 * motions


@pytest.mark.slow
def test_every_claim_of_further_forms_holds_in_many_programs() -> None:
    motions, known = held(range(6000, 6300), judged_further)
    assert motions > 2000
    assert known > 0.1 * motions


BEYOND = [
    "arrays",
    "assigned_components",
    "forms",
    "frames",
    "handling_cell",
    "inline",
    "mill_with_calls",
    "no_main",
    "parameters",
    "paths_module",
    "records",
    "several_lines",
    "speeds",
]
"""Cases with forms that the interpreter does not run: axis targets, several motions in a line, waits, other entries."""


@pytest.mark.parametrize(
    "path", [path for path in RAPID_CASES.good if path.stem not in BEYOND], ids=lambda path: path.stem
)
def test_every_claim_of_a_case_holds(path: Path) -> None:
    text = path.read_text("latin-1")
    for run in range(RUNS):
        done = Machine(text, np.random.default_rng(run)).run()
        assert disagreements(RAPID_CASES.read(text), done) == []


MISREADINGS = {
    "a zone": ("z10", "z15"),
    "a speed": ("v50,", "v60,"),
    "a force": ("FORCE 1 2 3", "FORCE 1 2 4"),
    "a displacement": ("PDispSet d1;", "WaitTime 1;"),
    "an assignment": ("n1:=", "n2:="),
    "a component": (".trans.x", ".trans.y"),
    "an index": ("pa{1}", "pa{2}"),
    "a sense of rotation": ("\\Rx:=10", "\\Rx:=-10"),
    "a work object": ("\\WObj:=w1", "\\WObj:=w2"),
    "a tool": (",t1", ",t2"),
    "a condition": ("n1>1", "n1>2"),
    "a call": ("sub2;", "WaitTime 1;"),
    "an order": ("Offs(p3,1,0,0)", "p3"),
    "a step": ("1 TO 3", "1 TO 0 STEP 1"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", MISREADINGS)
def test_a_misreading_is_found(name: str) -> None:
    old, new = MISREADINGS[name]
    assert any(judged(seed, lambda text: text.replace(old, new))[1] for seed in range(200))


FURTHER_MISREADINGS = {
    "stop point data": ("z10\\Inpos:=inpos50", "z10"),
    "a concurrent wait": ("\\Conc,", ""),
    "a routine that a motion calls": ("n3:=7;\nENDPROC", "ENDPROC"),
    "a part of a record": ("ma{1}.at,", "ma{2}.at,"),
    "an element": ("pv{1}", "pv{2}"),
    "a tool that changes": (",t3", ",t1"),
    "a moving work object": ("\\WObj:=w4", "\\WObj:=w1"),
    "a work object on the robot": ("\\WObj:=w5", "\\WObj:=w1"),
    "soft servos": ("SoftAct 1,20;", "SetDO do5,1;"),
    "an offset of axes": ("EOffsSet e1;", "SetDO do5,1;"),
    "a call of a text": ('%"sub"+"2"%;', "SetDO do5,1;"),
    "a call of itself": ("IF a>0 sub3 a-1;", "a:=a;"),
    "an override": ("VelSet 50,5000;", "VelSet 60,5000;"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FURTHER_MISREADINGS)
def test_a_misreading_of_further_forms_is_found(name: str) -> None:
    old, new = FURTHER_MISREADINGS[name]
    assert any(judged_further(seed, lambda text: text.replace(old, new))[1] for seed in range(500))
