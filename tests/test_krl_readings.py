"""Small programs and all that is read from them: every motion, every finding in full, every note.

A case in ``programs/krl/readings``: ``### name``, the program (with base and tool 1 set where it begins with no DEF,
``@`` a full point), ``=== dat``, ``=== config`` and ``=== other`` with other files, and ``=== told``: a line a motion,
as in a dump, with base and tool where they are not 1, then findings (!), annotations (;) and comments (,).
Or ``=== places``: where the numbers of each motion stand, ``@1`` in the .dat.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.languages.dialect import Program
from postproc.languages.krl import interpreter
from postproc.languages.krl.source_map import Auxiliary, PointVariable

FULL = b"{X 1,Y 2,Z 3,A 4,B 5,C 6}"
HEAD = "DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n"
BUILDS = re.compile(r"(\w+): the motion in line (\d+) depends on this end point and is not corrected\Z")


def cases() -> dict[str, dict[str, str]]:
    """Name -> part ("" for the program) -> text."""
    found: dict[str, dict[str, str]] = {}
    for path in sorted((Path(__file__).parent / "programs" / "krl" / "readings").glob("*.txt")):
        for case in re.split(r"^### ", path.read_text(), flags=re.M)[1:]:
            parts = re.split(r"^=== (\w+)\n", case, flags=re.M)
            name, _, program = parts[0].partition("\n")
            assert name not in found
            found[name] = {"": program, **dict(zip(parts[1::2], parts[2::2], strict=True))}
    return found


CASES = cases()
OTHERS = {"$config.dat": "config", "other.dat": "other"}


def read(case: dict[str, str], fast: bool = True) -> Program:
    text = case[""]
    if not text.startswith(("DEF", "&")):
        text = HEAD + text + ("" if text.endswith(("END\n", "ENDFCT\n")) else "END\n")
    files = {"part.src": text}
    if "dat" in case:
        files["part.dat"] = f"DEFDAT part\n{case['dat']}ENDDAT\n"
    others = {name: case[part] for name, part in OTHERS.items() if part in case}
    documents, references = (
        tuple(Document(Path(name), text.encode("latin-1").replace(b"@", FULL)) for name, text in of.items())
        for of in (files, others)
    )
    return interpreter.read(documents, references, fast)


def told(found: Finding, line: int) -> str:
    """A finding of a motion; its place where it is not the begin of its line."""
    assert found.file == "part.src"
    assert not found.help
    place = "" if (found.line, found.column) == (line, 1) else f" at {found.line}:{found.column}"
    return f"{found.code}{place}: {found.message}"


def story(program: Program) -> list[str]:
    path = program.toolpath
    out = []
    for row, text in enumerate(path.dump()):
        line = int(path.line[row])
        text = text.partition(" refused")[0].replace(" base [1] tool [1]", "")
        if path.approximation[row] != 0:
            text += f" round {path.approximation[row] / MM:.6g}"
        if not path.continues[row]:
            text += " apart"
        if row in path.constraints.no_insert_before:
            text += f" - whole: {path.constraints.no_insert_before[row]}"
        if row in path.constraints.refused:
            text += " - refused " + told(path.constraints.refused[row], line)
        if row in path.constraints.locked:
            text += " - " + BUILDS.sub(r"kept for \2 \1", told(path.constraints.locked[row], line))
        out.append(text)
    for found in program.findings:
        assert not found.help
        out.append(f"! {found.line}:{found.column} {found.code}: {found.message}")
    for sign, notes in (";", path.annotations), (",", path.comments):
        out += [f"{sign} {note.row} {note.line} {note.text}".rstrip() for note in notes]
    return out


@pytest.mark.parametrize("name", [name for name in CASES if "told" in CASES[name]])
def test_a_program_reads_as_it_is_told(name: str) -> None:
    assert story(read(CASES[name])) == CASES[name]["told"].strip().splitlines()


@pytest.mark.parametrize("name", [name for name in CASES if " run" in name])
def test_runs_of_lines_read_as_each_line_alone(name: str) -> None:
    alone, together = read(CASES[name], fast=False), read(CASES[name])
    assert story(alone) == story(together)
    for part in "start", "stop", "file", "insert", "home", "motion", "inherits", "text":
        np.testing.assert_array_equal(getattr(alone.text, part), getattr(together.text, part))


def span(program: Program, file: int, start: int, stop: int) -> str:
    return program.documents[file].raw[start:stop].decode()


def literals(program: Program, keys: str, starts: list[int], stops: list[int], files: list[int]) -> str:
    out = []
    for key, start, stop, file in zip(keys, starts, stops, files, strict=True):
        if start < 0:
            assert stop == file == -1
        else:
            out.append(f"{key}={span(program, file, start, stop)}" + f"@{file}" * (file > 0))
    return " ".join(out) or "-"


def insertion(program: Program, home: int, at: int) -> str:
    """Three letters before the place of insertion, and one behind it."""
    if home < 0:
        assert at == -1
        return "adds at nowhere"
    return f"adds at {home}:{span(program, home, at - 3, at)}|{span(program, home, at, at + 1)}"


def point(variable: PointVariable, program: Program) -> str:
    span_of = variable.declared
    declared = "None" if span_of is None else span(program, span_of.file, span_of.start, span_of.stop)
    return (
        f"{variable.name.decode()} {variable.type.decode()} ({variable.words.decode()}) declared {declared}"
    )


def auxiliary(program: Program, arc: Auxiliary) -> list[str]:
    operand = span(program, 0, arc.operand.start, arc.operand.stop)
    via = literals(program, "XYZ", list(arc.start), list(arc.stop), list(arc.file))
    out = [f"via [{operand}] {via} {insertion(program, arc.home, arc.insert)} text {arc.text}"]
    if arc.variable is not None:
        out.append("via point " + point(arc.variable, program).partition(" declared")[0])
    if arc.locked:
        out.append(f"via locked: {arc.locked}")
    if arc.has_angle:
        angle = "computed" if arc.angle is None else span(program, 0, arc.angle.start, arc.angle.stop)
        out.append(f"CA {angle}")
    return out


def places(program: Program) -> Iterator[str]:
    text = program.text
    for row, line in enumerate(program.toolpath.line):
        word, start, stop, end = text.motion[row].tolist()
        before, operand, behind = (
            span(program, 0, *of) for of in ((word, start), (start, stop), (stop, end))
        )
        out = [f"{line}: {before}[{operand}]{behind}"]
        out.append(
            literals(program, "XYZABC", *(part[row].tolist() for part in (text.start, text.stop, text.file)))
        )
        if bits := int(text.inherits[row]):
            assert bits < 64
            out.append("from before " + "".join(key for i, key in enumerate("XYZABC") if bits >> i & 1))
        out += [insertion(program, int(text.home[row]), int(text.insert[row])), f"text {text.text[row]}"]
        if row in text.variables:
            out.append("point " + point(text.variables[row], program))
        if row in text.locked:
            out.append(f"locked: {text.locked[row]}")
        if row in text.arcs:
            out += auxiliary(program, text.arcs[row])
        if row in text.relative:
            found = text.relative[row]
            reference = found.reference
            said = "-" if reference is None else span(program, 0, reference.start, reference.stop)
            said += " in tool" * found.in_tool
            out.append(f"relative {span(program, 0, found.word.start, found.word.stop)} {said}")
        yield "; ".join(out)


@pytest.mark.parametrize("name", [name for name in CASES if "places" in CASES[name]])
def test_the_numbers_of_a_program_stand_where_it_is_told(name: str) -> None:
    assert list(places(read(CASES[name]))) == CASES[name]["places"].strip().splitlines()


@pytest.mark.parametrize(
    ("setting", "number", "pose"),
    [
        ("BAS(#BASE,0)", 0, (0, 0, 0)), ("$BASE=$WORLD", 0, (0, 0, 0)), ("$BASE=$NULLFRAME", 0, (0, 0, 0)),
        ("BAS(#INITMOV,0)", 0, (0, 0, 0)), ("$BASE=BASE_DATA[0]", 0, (0, 0, 0)), ("BAS(#BASE,1)", 1, None),
        ("$BASE={X 5,Y 0,Z 0,A 0,B 0,C 0}", None, (5, 0, 0)), ("$BASE=BASE_DATA[3]", 3, None),
        ("BASE_DATA[3]={X 5,Y 0,Z 0,A 0,B 0,C 0}\n$BASE=BASE_DATA[3]", 3, (5, 0, 0)),
        ("$BASE={X 5,Y 0,Z 0,A 0,B 0,C 0}\n$BASE.Y=4", None, (5, 4, 0)), ("$BASE=SBASE(0)", 0, (0, 0, 0)),
    ],
)  # fmt: skip
def test_the_number_and_pose_of_a_base(setting: str, number: int | None, pose: tuple | None) -> None:
    """And the line in which it is set first."""
    path = read({"": f"{setting}\n;\n{setting}\nLIN @\n"}).toolpath
    found = path.frames[path.base[0]]
    assert found.number == number
    assert (None if found.pose is None else tuple(np.round(found.pose.position / MM, 9))) == pose
    assert found.line == (2 if number == 1 else 3 + len(setting.splitlines()))
