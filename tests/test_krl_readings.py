"""Small programs and all that is read from them: every motion, every finding in full, every note.

A case in ``programs/krl/readings``: ``### name``, the program (with base and tool 1 set where it begins with no DEF,
``@`` a full point), ``=== dat`` and ``=== config`` with the other files, and ``=== told``: a line a motion, as in a
dump, with base and tool where they are not 1, then findings (!), annotations (;) and comments (,).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from postproc.dialects.dialect import Program
from postproc.dialects.krl import interpreter
from postproc.dialects.krl.rows import HELP
from postproc.document import Document
from postproc.findings import Finding
from postproc.units import MM

FULL = b"{X 1,Y 2,Z 3,A 4,B 5,C 6}"
HEAD = "DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n"
BUILDS = re.compile(r"(\w+): the motion in line (\d+) builds on this end point and is not corrected\Z")


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


def read(case: dict[str, str], fast: bool = True) -> Program:
    text = case[""]
    if not text.startswith(("DEF", "&")):
        text = HEAD + text + ("" if text.endswith(("END\n", "ENDFCT\n")) else "END\n")
    files = {"part.src": text}
    if "dat" in case:
        files["part.dat"] = f"DEFDAT part\n{case['dat']}ENDDAT\n"
    documents, references = (
        tuple(Document(Path(name), text.encode("latin-1").replace(b"@", FULL)) for name, text in of.items())
        for of in (files, {"$config.dat": case["config"]} if "config" in case else {})
    )
    return interpreter.read(documents, references, fast)


def told(found: Finding, line: int) -> str:
    """A finding of a motion; its place where it is not the begin of its line."""
    assert found.file == "part.src"
    assert found.help == HELP.get(found.code, "")
    place = "" if (found.line, found.column) == (line, 1) else f" at {found.line}:{found.column}"
    return f"{found.code}{place}: {found.message}"


def story(program: Program) -> list[str]:
    path = program.toolpath
    out = []
    for row, text in enumerate(path.dump()):
        line = int(path.line[row])
        text = text.partition(" refused")[0].replace(" base [1] tool [1]", "")
        if path.blend[row] != 0:
            text += f" round {path.blend[row] / MM:.6g}"
        if not path.runs[row]:
            text += " apart"
        if row in path.whole:
            text += f" - whole: {path.whole[row]}"
        if row in path.refused:
            text += " - refused " + told(path.refused[row], line)
        if row in path.pinned:
            text += " - " + BUILDS.sub(r"kept for \2 \1", told(path.pinned[row], line))
        out.append(text)
    for found in program.findings:
        assert found.help == HELP.get(found.code, "")
        out.append(f"! {found.line}:{found.column} {found.code}: {found.message}")
    for sign, notes in (";", path.annotations), (",", path.comments):
        out += [f"{sign} {note.row} {note.line} {note.text}".rstrip() for note in notes]
    return out


@pytest.mark.parametrize("name", CASES)
def test_a_program_reads_as_it_is_told(name: str) -> None:
    assert story(read(CASES[name])) == CASES[name]["told"].strip().splitlines()


@pytest.mark.parametrize("name", [name for name in CASES if " run" in name])
def test_runs_of_lines_read_as_each_line_alone(name: str) -> None:
    alone, together = read(CASES[name], fast=False), read(CASES[name])
    assert story(alone) == story(together)
    for part in "start", "stop", "file", "insert", "home", "motion", "inherits", "text":
        np.testing.assert_array_equal(getattr(alone.text, part), getattr(together.text, part))
