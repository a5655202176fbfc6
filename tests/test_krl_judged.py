"""The reader of KRL before a judge of its own: random programs, executed as the controller would.

First the judge is held itself: the interpreter against executions that are worked out by hand from the description of
the language (``krl_judge/executions.txt``: ``### name``, a program as in the readings, ``=== dat``, ``=== inputs`` with
what $IN[n] shows one time after the other, ``=== runs`` with a line a motion: ``~`` is given by axis angles, ``?`` is
not determined), then the comparison against readers that are made wrong.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from krl_judge.claims import Claim, Tables, read_claims
from krl_judge.judge import TABLES, Case, align, differs, execute, judge, judge_split, shrunk
from krl_judge.machine import load, run
from krl_judge.misreadings import MISREADINGS, Misreading
from krl_judge.motions import Executed, Six
from krl_judge.programs import Generator
from krl_judge.syntax import routines
from krl_judge.values import Stop, rotation

FULL = "{X 1,Y 2,Z 3,A 4,B 5,C 6}"
HEAD = "DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n"


# The interpreter


def executions() -> dict[str, tuple[str, ...]]:
    text = (Path(__file__).parent / "krl_judge" / "executions.txt").read_text().replace("@", FULL)
    out = {}
    for case in re.split(r"^### ", text, flags=re.M)[1:]:
        parts = re.split(r"^=== (\w+)\n", case, flags=re.M)
        name, _, program = parts[0].partition("\n")
        others = dict(zip(parts[1::2], parts[2::2], strict=True))
        out[name] = program, others.get("dat", ""), others.get("inputs", ""), others["runs"]
    return out


EXECUTIONS = executions()


def number(value: float | None) -> str:
    return "~" if value is None else "?" if math.isnan(value) else f"{round(value, 6) + 0.0:.6g}"


def six(values: Six) -> str:
    return " ".join(map(number, values))


def frame(name: str, values: Six | None) -> str:
    table = TABLES[{"base": "BASE_DATA", "tool": "TOOL_DATA"}[name]]
    known = next((str(n) for n, entry in table.items() if entry == values), None)
    said = "-" if values is None else known or six(values)
    return f" {name} {said}" if said != "1" else ""


def told(motion: Executed) -> str:
    out = f"{motion.line} {motion.kind} {six(motion.axes or motion.target)}"
    if motion.origin is not None and None in motion.target and motion.axes is None:
        out += f" from {six(motion.origin)}"
    if motion.arc is not None:
        centre, normal, sweep = motion.arc
        out += f" about {six(tuple(centre))} by {number(sweep * round(normal[2]))}"
    out += frame("base", motion.base) + frame("tool", motion.tool)
    if motion.feed is not None:
        out += f" feed {number(motion.feed)}"
    if motion.axes is None and motion.approximation != 0:
        out += " round " + ("otherwise" if motion.approximation is None else number(motion.approximation))
    out += f" force {motion.force}" if motion.force else ""
    return out + (f" {motion.ori_type}" if motion.ori_type not in (None, "#VAR") else "")


@pytest.mark.parametrize("name", EXECUTIONS)
def test_a_program_is_executed_as_by_hand(name: str) -> None:
    program, dat, shown, expected = EXECUTIONS[name]
    if not program.startswith("DEF"):
        program = HEAD + program + ("" if program.endswith(("END\n", "ENDFCT\n")) else "END\n")
    inputs = {}
    for line in shown.splitlines():
        n, *values = map(int, line.split())
        inputs[n] = tuple(map(bool, values))
    done = run(routines(program), load(TABLES, dat), inputs)
    assert [told(motion) for motion in done.motions] == expected.strip().splitlines()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("LOOP\nENDLOOP\n", "end"), ("LIN {X 1,X 2}\n", "twice"), ("n=5\n", "not declared"), ("EXIT\n", "EXIT"),
        ("PTP {X 1,A1 2}\n", "axes"), ("LIN {A1 2}\n", "axis angles"), ("LIN {X 1} 5\n", "too much"),
        ("DECL INT n\nn=TRUE\n", "number"), ("sub()\n", "not there"), ("DECL INT k[2]\nk[3]=1\n", "nothing"),
        ("IF 5 THEN\nENDIF\n", "BOOL"), ("BAS(#BASE,99)\n", "no such"), ("DECL BOOL b\nb=1==TRUE\n", "kinds"),
        ("DECL INT i\nFOR i=1 TO 3\nENDFOR\nWHILE i<3\nENDWHILE\n", "determined"),
    ],
)  # fmt: skip
def test_what_is_wrong_or_open_stops_a_program(text: str, why: str) -> None:
    done = run(routines(f"{HEAD}{text}LIN {FULL}\nEND\n"), load(TABLES), {})
    assert why in done.stopped
    assert not done.motions


@pytest.mark.parametrize(
    "text",
    ["", "LIN {X 1}\n", "DEF a()\nIF TRUE THEN\nEND\n", "DEF a()\nENDIF\nEND\n", "DEF a()\nEND\nEND\n",
     "DEF a()\nDEF b()\nEND\n", "DEF a()\nEND\nDEF a()\nEND\n", "DEF a()\nx:\nx:\nEND\n", "DEF a()\nELSE\nEND\n"],
)  # fmt: skip
def test_what_is_no_program_is_none(text: str) -> None:
    with pytest.raises(Stop):
        routines(text)


def test_the_dat_keeps_what_a_run_leaves() -> None:
    memory = load(TABLES, f"DECL FRAME P={FULL}")
    code = routines(f"{HEAD}LIN P\nP.X=P.X+1\nEND\n")
    assert [run(code, memory, {}).motions[0].target[0] for _ in range(3)] == [1, 2, 3]


# The comparison


def fault(change: Callable[[Claim], Claim], wanted: Callable[[Claim], bool]) -> Callable:
    """A reader that is wrong of the last row that is wanted."""

    def reader(src: str, dat: str, config: str, tables: Tables) -> list[Claim]:
        rows = read_claims(src, dat, config, tables)
        at = next((k for k in reversed(range(len(rows))) if rows[k].claimed and wanted(rows[k])), None)
        if at is not None:
            rows[at] = change(rows[at])
        return rows

    return reader


def shifted(values: np.ndarray | None, by: float) -> np.ndarray:
    assert values is not None
    out = np.array(values, float)
    out.flat[0] += by
    return out


def moved(frame: np.ndarray | None) -> np.ndarray:
    assert frame is not None
    out = frame.copy()
    out[2, 3] += 1e-5
    return out


def on_pose(row: Claim) -> bool:
    return row.partial is None and row.axes is None


SMALL_TURN = rotation(2e-7, 0, 0)
PROGRAM = f"""\
DEF part()
DECL INT i
BAS(#BASE,1)
$TOOL={{X 0,Y 0,Z 100,A 0,B 0,C 0}}
$VEL.CP=0.1
$APO.CDIS=2
PTP {{A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}}
;FORCE 10 0 0
LIN {{Z 5}}
LIN {FULL} C_DIS
FOR i=1 TO 3
LIN {{X i}}
ENDFOR
CIRC {{X 10,Y 10,Z 3}},{{X 20,Y 2}}
END
"""
FAULTS = {
    "position": fault(lambda r: replace(r, position=shifted(r.position, 2e-6)), on_pose),
    "orientation": fault(lambda r: replace(r, rotation=r.rotation @ SMALL_TURN), on_pose),
    "base": fault(lambda r: replace(r, base=moved(r.base)), on_pose),
    "tool": fault(lambda r: replace(r, tool=moved(r.tool)), on_pose),
    "axes": fault(lambda r: replace(r, axes=shifted(r.axes, 1e-6)), lambda r: r.axes is not None),
    "partial": fault(lambda r: replace(r, partial=r.partial + 1e-5), lambda r: r.partial is not None),
    "origin": fault(lambda r: replace(r, origin=shifted(r.origin, 1e-6)), lambda r: r.partial is not None),
    "force": fault(lambda r: replace(r, force=""), lambda r: r.force != ""),
    "kind": fault(lambda r: replace(r, kind="SPL"), on_pose),
    "feed": fault(lambda r: replace(r, feed=r.feed + 0.001), on_pose),
    "approximation": fault(lambda r: replace(r, approximation=1.5), lambda r: r.approximation > 0),
    "orientation type": fault(lambda r: replace(r, orientation="#JOINT"), on_pose),
    "arc": fault(lambda r: replace(r, arc=(*r.arc[:2], r.arc[2] + 0.01)), lambda r: r.arc is not None),
    "missing": lambda *of: [row for row in read_claims(*of) if row.kind != "CIRC"],
    "never": lambda *of: [replace(row, claimed=False, never=True) for row in read_claims(*of)],
    "one pass": lambda *of: [row for row in read_claims(*of) if row.line != 12 or row.position[0] == 1],
    "passes backwards": lambda *of: read_claims(*of)[::-1],
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_wrong_reader_is_caught(name: str) -> None:
    case = Case(PROGRAM)
    assert not judge(case).disagreements
    if name == "orientation type":  # nothing in the program sets one
        case = replace(case, src=PROGRAM.replace("$VEL", "$ORI_TYPE=#VAR\n$VEL"))
    assert judge(case, FAULTS[name]).disagreements


BRANCHES = f"""\
DEF part()
DECL REAL x
BAS(#BASE,1)
BAS(#TOOL,1)
x=10
LIN {FULL}
IF $IN[1] THEN
BAS(#BASE,2)
x=20
LIN {{Z 9}}
ENDIF
LIN {FULL}
BAS(#BASE,1)
LIN {{X x,Y 2,Z 3,A 4,B 5,C 6}}
LIN {FULL}
END
"""


def careless(line: int) -> Callable:
    """A reader that takes a branch for run through, or for passed over."""

    def reader(src: str, dat: str, config: str, tables: Tables) -> list[Claim]:
        through = read_claims(
            src.replace("IF $IN[1] THEN\n", "\n").replace("ENDIF\n", "\n"), dat, config, tables
        )
        rows = read_claims(src, dat, config, tables)
        of_line = next(t for t in through if t.line == line)
        return [replace(of_line, apart=row.apart) if row.line == line else row for row in rows]

    return reader


INPUTS = ({1: (False,)}, {1: (True,)})


@pytest.mark.parametrize("line", [12, 14])
def test_one_value_where_inputs_decide_is_caught(line: int) -> None:
    case = Case(BRANCHES, inputs=INPUTS)
    assert not judge(case).disagreements
    assert [found.line for found in judge(case, careless(line)).disagreements] == [line]
    for inputs in INPUTS[1:]:  # one run alone does not tell
        assert not judge(replace(case, inputs=(inputs,)), careless(line)).disagreements


def altered(pattern: str, by: str) -> Callable:
    """A reader to which some words are others."""

    def reader(src: str, dat: str, config: str, tables: Tables) -> list[Claim]:
        return read_claims(re.sub(pattern, by, src, flags=re.I | re.M), dat, config, tables)

    return reader


def in_text(src: str, dat: str, config: str, tables: Tables) -> list[Claim]:
    """A reader to which the last FORCE comment above a motion in the text is in force there."""
    last, forces = "", [""]
    for line in src.splitlines():
        said = re.match(r"\s*;FORCE (.*)", line)
        last = last if said is None else said[1].replace("OFF", "")
        forces.append(last)
    return [replace(row, force=forces[row.line]) for row in read_claims(src, dat, config, tables)]


CARELESS = {
    "inputs are true": (altered(r"\$IN\s*\[[^\]]*\]", "TRUE"), 0.3),
    "inputs are false": (altered(r"\$IN\s*\[[^\]]*\]", "FALSE"), 0.3),
    "no jump is taken": (altered(r"^\s*GOTO.*$", ""), 0.05),
    "no component is set": (altered(r"^\s*\w+\s*\.\s*[XYZABC]\s*=.*$", ""), 0.02),
    "no frame is set in a table": (altered(r"^\s*(BASE|TOOL)_DATA\s*\[.*$", ""), 0.02),
    "no subprogram is called": (altered(r"^\s*sub\d\s*\(.*$", ""), 0.05),
    "no record of frames is taken": (altered(r"^\s*FDAT_ACT\s*=.*$", "FDAT_ACT={TOOL_NO 1,BASE_NO 1}"), 0.05),
    "comments follow the text": (in_text, 0.1),
    "nothing comes later": (altered(r"^\s*(TRIGGER|INTERRUPT)\b.*$", ""), 0.02),
    "what a call gets is its own": (altered(r":\s*OUT|(?<=,p)(?=\))", ":IN"), 0.02),
}
"""And the share of random programs in which that shows, at least."""


@pytest.mark.slow
@pytest.mark.parametrize("name", CARELESS)
def test_a_careless_reader_is_caught_in_random_programs(name: str) -> None:
    reader, share = CARELESS[name]
    caught = 0
    for seed in range(1, 41):
        case = Generator(seed).case()
        found = judge(case).disagreements
        caught += any(wrong not in found for wrong in judge(case, reader).disagreements)
    assert caught >= share * 40


def test_passes_backwards_are_caught_where_inputs_are_read() -> None:
    case = Case(PROGRAM.replace("CIRC", "WAIT FOR $IN[1]\nCIRC"), inputs=INPUTS)
    assert not judge(case).disagreements
    assert judge(case, FAULTS["passes backwards"]).disagreements


def test_a_value_that_a_former_run_leaves_is_caught() -> None:
    case = Case(f"{HEAD}LIN P\nP.X=9\nEND\n", f"DECL FRAME P={FULL}\n")
    assert not judge(case).disagreements
    first = read_claims(f"{HEAD}LIN {FULL}\nEND\n", "", "", TABLES)
    assert judge(case, lambda *of: first).disagreements


def claim(x: float, claimed: bool = True) -> Claim:
    row = read_claims(f"{HEAD}LIN {{X {x},Y 2,Z 3,A 4,B 5,C 6}}\nEND\n", "", "", TABLES)[0]
    return replace(row, claimed=claimed)


def motion(x: float) -> Executed:
    return execute(Case(f"{HEAD}LIN {{X {x},Y 2,Z 3,A 4,B 5,C 6}}\nEND\n"))[0].motions[0]


@pytest.mark.parametrize(
    ("rows", "motions", "inputs", "known", "right"),
    [
        ((1,), (1, 1, 1), False, 3, True), ((1,), (1, 2), False, 2, False), ((1, 2), (1, 2), False, 2, True),
        ((1, 2), (2, 1), False, 2, False), ((1, 2, 3), (1, 3), False, 2, True), ((1, 2, 3), (3, 1), False, 1, False),
        ((1, 2), (1, 2, 1, 2), True, 4, True), ((1, 2), (2, 2), True, 2, True), ((1, 2), (1, 3), True, 1, False),
        ((1, None), (1, 5), False, 1, True), ((1, None), (5, 5), False, 1, False), ((None, 2), (7, 2), True, 1, True),
    ],
)  # fmt: skip
def test_rows_and_executions_of_a_line(
    rows: tuple, motions: tuple, inputs: bool, known: int, right: bool
) -> None:
    """None: a row without a claim."""
    of = [claim(0, False) if x is None else claim(x) for x in rows]
    found, why = align(of, [motion(x) for x in motions], inputs)
    assert (found, not why) == (known, right)


def test_a_claim_is_true_or_tells_why_not() -> None:
    assert not differs(claim(1), motion(1))
    assert "target" in differs(claim(1), motion(1.00001))
    assert not differs(claim(5, False), motion(1))


def test_a_program_is_shrunk_to_what_disagrees() -> None:
    case = Generator(3).case()
    wrong = f"LIN {FULL}\nLIN {{X 9}}\n"
    body = case.src.splitlines(keepends=True)
    end = next(n for n, line in enumerate(body) if line.strip().upper() == "END")
    case = replace(
        case,
        src=HEAD
        + "DECL INT i\n"
        + wrong
        + "i=5\nWHILE i<6\ni=i+1\nENDWHILE\nEND\n"
        + "".join(body[end + 1 :]),
    )
    reader = altered(r"X 9\}", "X 8}")
    small = shrunk(
        case, lambda smaller: any(d.word == "target" for d in judge(smaller, reader).disagreements)
    )
    assert [
        line.strip() for line in small.src.upper().splitlines()
    ] == f"{HEAD}{wrong}END\n".upper().splitlines()
    assert not small.dat
    assert len(small.inputs) == 1


# The reader


@pytest.mark.parametrize("once", MISREADINGS, ids=lambda once: once.name)
def test_what_was_misread_is_not_any_more(once: Misreading) -> None:
    assert not judge(once.case).disagreements


def disagreements(seeds: range) -> list[str]:
    out = []
    for seed in seeds:
        case = Generator(seed).case()
        out += [f"seed {seed}, line {found.line}: {found.what}" for found in judge(case).disagreements]
    return out


def test_the_reader_agrees_with_what_runs() -> None:
    """``python -m tests.krl_judge`` shows the smallest program of each disagreement."""
    assert not disagreements(range(1, 41))


@pytest.mark.slow
@pytest.mark.parametrize("start", range(41, 401, 90))
def test_the_reader_agrees_with_what_runs_in_more_programs(start: int) -> None:
    assert not disagreements(range(start, start + 90))


@pytest.mark.slow
def test_the_programs_are_worth_judging() -> None:
    """They run, most of them to their end; the reader claims a good part of what they execute."""
    verdicts = [judge(Generator(seed).case()) for seed in range(1, 21)]
    assert sum(v.stopped for v in verdicts) < 0.15 * sum(v.runs for v in verdicts)
    assert sum(v.known for v in verdicts) > 0.15 * sum(v.motions for v in verdicts) > 100


@pytest.mark.slow
@pytest.mark.parametrize("first", range(600_000, 600_040, 10))
def test_what_other_modules_leave_is_what_they_leave(first: int) -> None:
    """The same programs with each routine but the first in a module of its own."""
    known = 0
    for seed in range(first, first + 10):
        verdict = judge_split(Generator(seed).case())
        assert not verdict.disagreements, (seed, verdict.disagreements)
        known += verdict.known
    assert known
