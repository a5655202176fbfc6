"""Runs of common lines of RAPID: read together they are what they are one by one, and so is what is written of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from postproc.base.arrays import FewRows
from postproc.base.document import Document, Edit
from postproc.base.units import MM
from postproc.languages import DIALECTS
from postproc.languages.dialect import Program, ReadingSettings, WritingSettings
from postproc.languages.rapid import module_reader
from postproc.languages.rapid.plain_lines import FEWEST, MOST
from postproc.toolpath import Kind, Plan, Role

HEAD = """MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
PERS wobjdata w:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];
PERS wobjdata moving:=[FALSE,FALSE,"STN",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
CONST speeddata vm:=[33,500,5000,1000];
CONST robtarget p1:=[[1,2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
VAR num n:=2;
"""


STATEMENTS = [
    *["! FORCE 1 2 3", "! FORCE OFF", "! words", "ConfL\\Off;", "ConfL\\On;", "ConfJ\\On;", "PDispSet d;", "PDispOff;"],
    *["MoveC p1,[[5,6,7],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t;", "MoveL p1,v50,z1,t;", "n:=n+1;"],
    *["x:=CRobT();", "VelSet 50,5000;", "MoveAbsJ [[0,0,0,0,90,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t;", "other;", ""],
    *["IF n=2", "MoveL", "! COMPENSATE OFF", "SetDO d,1; MoveL p1,v50,z1,t;", "sub;", "SingArea\\Wrist;", "?;"],
]  # fmt: skip
TAILS = [
    *[
        ",v50,z1,t\\WObj:=w;",
        ",v50,fine,t;",
        ", vm , z10\\Z:=2, t \\WObj:=wobj0;",
        ",[20,500,5000,1000],z0,t;",
    ],
    *[",v50,z1,unknown;", ",v50\\T:=2,z1,t\\WObj:=w;", ",v50,z1,t\\WObj:=moving;", ",v50,z1,t\\Corr;"],
    *[",v50\\V:=n,z1,t;", ",v50 z1,t;", ",vmax,z1,t;", ",v50,z1,t\\ID:=n;"],
]
QUATERNIONS = ["0,0,1,0", "1,0,0,0", "-.5,0.5,-0.5,+0.5", "0.70710678,0,7.0710678E-01,0"]
BLOCKS = [("IF di1=1 THEN", "ENDIF"), ("WHILE di1=1 DO", "ENDWHILE"), ("FOR i FROM 1 TO 3 DO", "ENDFOR")]
AXES = ["9E9,9E9,9E9,9E9,9E9,9E9", "9E+09,9E+09,9E+09,9E+09,9E+09,9E+09"]


class Drawing:
    """A program of runs of lines that are alike, some of which are not quite, and of other statements."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)
        self.declared: list[str] = []

    def program(self) -> bytes:
        lines = ["PROC main()", *self.block(), "ENDPROC", "PROC sub()", *self.block(1)]
        lines += ["ERROR", *self.block(1), "ENDPROC", "ENDMODULE", ""]
        newline = self.random.choice(["\n", "\r\n"])
        if self.random.random() < 0.1:
            self.random.shuffle(self.declared)
        return (HEAD + "".join(self.declared) + "\n".join(lines)).replace("\n", newline).encode()

    def block(self, depth: int = 0) -> list[str]:
        lines: list[str] = []
        for _ in range(self.random.randint(1, 3)):
            kind = self.random.randint(0, 7)
            if kind < 4 or depth > 1:
                lines += self.run() if self.random.random() < 0.6 else self.named()
            elif kind < 6:
                lines.append(self.random.choice(STATEMENTS))
            else:
                first, last = self.random.choice(BLOCKS)
                lines += [first, *self.block(depth + 1), last]
        return lines

    def run(self) -> list[str]:
        count = self.random.randint(FEWEST - 2, 2 * FEWEST)
        word, tail = self.random.choice(["MoveL", "MoveL", "MOVEJ", "moveL"]), self.random.choice(TAILS)
        exotic, indent = self.random.randint(-3, count), self.random.choice(["", "  ", "\t"])
        return [f"{indent}{word} {self.target(place == exotic)}{tail}" for place in range(count)]

    def named(self) -> list[str]:
        """Declarations, and motions to them; some of them are there again otherwise."""
        count = self.random.randint(FEWEST - 2, 2 * FEWEST)
        first, exotic = len(self.declared) + 10, self.random.randint(-6, count)
        kind = self.random.choice(
            ["CONST robtarget", "LOCAL CONST robtarget", "pers RobTarget", "VAR robtarget"]
        )
        names = [f"t{number}" for number in range(first, first + count)]
        self.declared += [
            f"{kind} {name}:={self.target(place == exotic).strip()};\n" for place, name in enumerate(names)
        ]
        word, tail = self.random.choice(["MoveL", "MoveJ", "moveL"]), self.random.choice(TAILS)
        lines = [f"{word} {name}{tail}" for name in names]
        if self.random.random() < 0.3:
            self.random.shuffle(lines)
        one = self.random.choice(names)
        more = [
            f"! {one.upper()}", f"MoveL {one},v50,z1,t;", f"MoveL Offs({one},1,0,0),v50,z1,t;", f"x:={one}.trans.x;",
            f"VAR robtarget {one};", f"{one}.trans.x:=3;", f"TPWrite \"{one}\";", f"sub2 {one};", f"{one}x:=1;",
        ]  # fmt: skip
        if self.random.random() < 0.5:
            lines.insert(self.random.randint(0, len(lines)), self.random.choice(more))
        if self.random.random() < 0.2:
            self.declared.append(self.declared[-1])
        return lines

    def number(self) -> str:
        """One of several spellings of a number, and of one beside it."""
        value = self.random.choice([0.0, -12.5, 250.125, 1e3])
        spellings = [f"{value:g}", f"{value:.3f}", f"+{abs(value):.1f}", f"{value:.6E}", f"{int(value)}."]
        return self.random.choice([*spellings, f"{value:.20f}"])

    def target(self, exotic: bool) -> str:
        blank = self.random.choice(["", "", " ", "\t "])
        parts = [
            ",".join(self.number() for _ in range(3)),
            self.random.choice(QUATERNIONS),
            self.random.choice(["0,0,0,0", "0,0,0,0", "-1,0,-2,1"]),
            self.random.choice(AXES),
        ]
        strange = ["1,2," + "1" * 400, "n,2,3", "1E8,2,3", "1,- 5,3", "1,2"]
        if exotic:
            place = self.random.randint(0, 3)
            others = [strange, ["0,0,0.9,0"], ["0,0,0.5,9"], ["500.25,9E9,9E9,9E9,9E9,9E9"]]
            parts[place] = self.random.choice(others[place])
        text = "[" + ",".join(f"[{part}]" for part in parts) + "]"
        return text.replace(",", f"{blank},{blank}").replace("[", f"[{blank}").replace("]", f"{blank}]")


def read(raw: bytes, fast: bool) -> Program:
    return module_reader.read((Document(Path("part.mod"), raw),), ReadingSettings(), fast)


def differences(one: Any, other: Any) -> list[str]:
    """Where two values differ, through all their fields and arrays."""
    return list(_differences(one, other, ""))


def _differences(one: Any, other: Any, where: str) -> Iterator[str]:
    if isinstance(one, FewRows):
        one, other = ([each.rows, each.values, each.shape] for each in (one, other))
    if isinstance(one, np.ndarray):
        if one.dtype != other.dtype or not np.array_equal(one, other, equal_nan=one.dtype.kind == "f"):
            yield where
    elif is_dataclass(one) and not isinstance(one, type):
        for field in fields(one):
            yield from _differences(
                getattr(one, field.name), getattr(other, field.name), f"{where}.{field.name}"
            )
    elif isinstance(one, list | tuple) and len(one) == len(other):
        for place, pair in enumerate(zip(one, other, strict=True)):
            yield from _differences(*pair, f"{where}[{place}]")
    elif isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        for key in one:
            yield from _differences(one[key], other[key], f"{where}[{key}]")
    elif one != other:
        yield where


def planned(program: Program, seed: int) -> Plan:
    """Some motions moved and turned, some with another one before them."""
    random, path = np.random.default_rng(seed), program.toolpath
    n, fixed = len(path), path.constraints
    kept = np.zeros(n, bool)
    kept[[*fixed.refused, *fixed.locked]] = True
    kept |= (path.kind == Kind.AXIS) | (path.kind == Kind.CIRC)
    moves = ~kept & (random.random(n) < 0.7)
    before = moves & (random.random(n) < 0.3)
    before[list(fixed.no_insert_before)] = False
    source = np.repeat(np.arange(n), 1 + before)
    role = np.zeros(len(source))
    role[np.append(source[1:] == source[:-1], False)] = Role.TRANSITION
    position = path.position[source] + np.where(
        moves[source, None], random.normal(size=(len(source), 3)) * MM, 0.0
    )
    turn = np.linalg.qr(np.eye(3) + 0.01 * random.normal(size=(3, 3)))[0]
    turn *= np.sign(np.diag(turn))
    rotation = path.rotation[source].copy()
    turned = moves[source] & (random.random(len(source)) < 0.5)
    rotation[turned] = rotation[turned] @ turn
    arcs = path.arcs
    return Plan(
        source, role, position, rotation, arcs.centre[source], arcs.normal[source], arcs.sweep[source]
    )


def same_edits(some: Sequence[Edit], others: Sequence[Edit]) -> bool:
    """Whether two lists of edits are one; a number with 12 decimals may differ in the last one."""
    if [edit.span for edit in some] != [edit.span for edit in others]:
        return False
    pairs = ((a.text, b.text) for a, b in zip(some, others, strict=True))
    return all(
        a == b or (len(a) == len(b) and a[-13:-12] == b"." and abs(float(a) - float(b)) < 2e-12)
        for a, b in pairs
    )


def compare(raw: bytes, seed: int) -> int:
    """Holds both ways of reading against each other; the motions that were read in runs."""
    quick, general = read(raw, True), read(raw, False)
    assert differences(quick.toolpath, general.toolpath) == []
    assert quick.findings == general.findings
    n = len(quick.toolpath)
    every = np.arange(n)
    assert differences(quick.text.numbers(every), general.text.numbers(every)) == []
    assert differences(quick.text.vias, general.text.vias) == []
    assert [quick.text.motions[row] for row in range(n)] == [general.text.motions[row] for row in range(n)]
    assert quick.text.read == general.text.read
    for shared in ("copy-inline", "keep"):
        edits, others = (
            DIALECTS["rapid"].edit_targets(one, planned(one, seed), WritingSettings(3, 3, shared))
            for one in (quick, general)
        )
        assert edits.unwritten == others.unwritten
        assert same_edits(edits.edits, others.edits)
    return int(quick.text.motions.is_plain(every).sum())


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(0, 240, 20))
def test_runs_of_common_lines_are_what_they_are_one_by_one(seed: int) -> None:
    together = sum(compare(Drawing(one).program(), one) for one in range(seed, seed + 20))
    assert together > 200


def lines(count: int, tail: str = ",v50,z1,t\\WObj:=w;") -> list[str]:
    extra = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"
    return [f"MoveL [[{i * 0.25:.3f},{-i},2],[0,0,1,0],{extra}]{tail}" for i in range(count)]


def program(body: list[str]) -> bytes:
    return (HEAD + "\n".join(["PROC main()", *body, "ENDPROC", "ENDMODULE", ""])).encode()


@pytest.mark.parametrize(
    ("body", "together"),
    [
        (lines(FEWEST), FEWEST),
        (lines(FEWEST - 1), 0),
        ([*lines(20), *lines(20, ",v80,z1,t;")], 40),
        (["MoveL", *lines(20)], 19),
        (["IF n=2", *lines(20)], 19),
        ([*lines(10), "! FORCE 1 2 3", *lines(10)], 20),
        ([*lines(10), lines(1)[0].replace("0.000", "1" * 400), *lines(10)], 0),
        ([line + " ! words" for line in lines(20)], 0),
        (lines(20, ",v50,z1,t\\WObj:=w);"), 0),
    ],
)
def test_which_lines_are_read_together(body: list[str], together: int) -> None:
    assert compare(program(body), 1) == together


def test_named_targets_that_nothing_else_names_are_read_together() -> None:
    names = [f"CONST robtarget q{n}:={line[6:].partition(',v50')[0]};" for n, line in enumerate(lines(20))]
    moves = [f"MoveL q{n},v50,z1,t\\WObj:=w;" for n in range(20)]

    def together(body: list[str]) -> int:
        text = HEAD + "\n".join([*names, "PROC main()", *body, "ENDPROC", "ENDMODULE", ""])
        return compare(text.encode(), 1)

    assert together(moves) == 20
    assert together(moves[::-1]) == 20
    assert together([*moves[:10], "! FORCE 1 2 3", *moves[10:]]) == 20
    for other in ("MoveL Offs(q9,0,0,1),v50,z1,t;", "! q9", "q9:=p1;", "MoveJ Q9,v50,z1,t;"):
        assert together([*moves, other]) == 9 + 10
    assert together([*moves, "VAR robtarget q15;"]) == 15


@pytest.mark.slow
def test_long_runs_are_read_in_parts() -> None:
    count = MOST + 100
    found = read(program(lines(count)), True)
    path = found.toolpath
    assert path.position / MM == pytest.approx(
        np.stack([np.arange(count) * 0.25, -np.arange(count), np.full(count, 2)], 1)
    )
    assert (path.line == 9 + np.arange(count)).all()
    assert path.continues.all()
    assert found.text.motions.is_plain(np.arange(count)).all()
