"""Small programs, plans for them, and what is written: each line that changes or is added, or why none is.

A case in ``programs/krl/writings.txt``: ``### name``, the program (see ``test_krl_readings``), ``=== dat``, and
``=== plan`` with lines ``LINE what numbers``, where LINE.2 is the second run of a line: ``move`` [mm] and ``turn``
(rotation vector, deg) of the end; ``slide`` [mm] of the ends from a line to another, with the arcs between; ``on``
[deg] for the end of an arc; ``piece`` and ``link`` inserted there [mm], pieces of arcs with their sweep [deg], which
the last piece gets by ``sweep``; ``digits`` and ``own`` of the writing.
``=== written``: number and text of each line as it is afterwards, ``@1`` in the .dat; or ``held``.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_krl_readings import read

from postproc.base.arrays import differs
from postproc.base.document import Document, apply
from postproc.base.geometry import rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.languages.dialect import Plan, Program, Role, WritingSettings
from postproc.languages.krl import KrlDialect
from postproc.languages.krl.write_plan import Components, other_literal, written_decimals

KRL = KrlDialect()

ROLES = {"own": Role.ORIGINAL, "piece": Role.INTERMEDIATE, "link": Role.TRANSITION}
"""The words of the recorded plans."""


def cases() -> dict[str, dict[str, str]]:
    path = Path(__file__).parent / "programs" / "krl" / "writings.txt"
    found = {}
    for case in re.split(r"^### ", path.read_text(), flags=re.M)[1:]:
        parts = re.split(r"^=== (\w+)\n", case, flags=re.M)
        name, _, program = parts[0].partition("\n")
        found[name] = {"": program, **dict(zip(parts[1::2], parts[2::2], strict=True))}
    return found


CASES = cases()


def planned(program: Program, text: str) -> tuple[Plan, WritingSettings]:
    path = program.toolpath
    plan = Plan.of(path)
    position, rotation = np.array(plan.position), np.array(plan.rotation)
    centre, sweep = plan.centre.copy(), plan.sweep.copy()
    inserted: list[tuple[int, Role, list[float]]] = []
    writing = WritingSettings(3, 3)
    for line in text.split("\n"):
        first, what, *rest = [*line.split(), "", ""]
        numbers = [float(word) for word in rest if re.fullmatch(r"-?[\d.]+", word)]
        if first == "digits":
            writing = replace(writing, mm=int(what), deg=int(rest[0]))
        elif first == "own":
            writing = replace(writing, shared_points=what)
        elif first:
            number, _, run = first.partition(".")
            row = int(np.flatnonzero(path.line == int(number))[int(run or 1) - 1])
            match what:
                case "move":
                    position[row] += np.array(numbers) * MM
                case "turn":
                    rotation[row] = rotation_from_vector(np.array(numbers) * DEG) @ rotation[row]
                case "slide":
                    until = int(numbers.pop(0))
                    for other in np.flatnonzero((path.line >= int(number)) & (path.line <= until)):
                        position[other] += np.array(numbers) * MM
                        centre[other] += np.array(numbers) * MM * (other > row)
                case "on":
                    sweep[row] += numbers[0] * DEG
                    turn = rotation_from_vector(numbers[0] * DEG * path.arcs.normal[row])
                    position[row] = centre[row] + turn @ (position[row] - centre[row])
                case "sweep":
                    sweep[row] = numbers[0] * DEG
                case _:
                    inserted.append((row, ROLES[what], numbers))
    at = [row for row, _, _ in inserted]
    source = np.insert(plan.source, at, at)
    role = np.insert(plan.role, at, [kind for _, kind, _ in inserted])
    position, rotation, centre = (
        np.insert(array, at, array[at], axis=0) for array in (position, rotation, centre)
    )
    normal = np.insert(plan.normal, at, plan.normal[at], axis=0)
    sweep = np.insert(sweep, at, sweep[at])
    for there, (_, kind, numbers) in zip(np.flatnonzero(role != Role.ORIGINAL), inserted, strict=True):
        position[there] = np.array(numbers[:3]) * MM
        if kind == Role.TRANSITION:
            centre[there] = normal[there] = sweep[there] = np.nan
        elif len(numbers) > 3:
            sweep[there] = numbers[3] * DEG
    return Plan(source, role, position, rotation, centre, normal, sweep), writing


def written(case: dict[str, str]) -> Iterator[str]:
    program = read(case)
    plan, writing = planned(program, case["plan"])
    found = KRL.edit_targets(program, plan, writing)
    for _, held in sorted(found.unwritten.items()):
        assert held.file == "part.src"
        yield f"held {held.line}:{held.column} {held.code}: {held.message}"
    if found.unwritten:
        assert not len(found.edits)
        return
    after = []
    for file, document in enumerate(program.documents):
        raw = apply(document, [edit for edit in found.edits if edit.span.file == file])
        after.append(replace(document, raw=raw))
        before, now = (text.decode().split("\n") for text in (document.raw, raw))
        for kind, _, _, low, high in difflib.SequenceMatcher(None, before, now, False).get_opcodes():
            if kind in ("replace", "insert"):
                for number in range(low, high):
                    yield f"{number + 1} {now[number]}" + f"@{file}" * (file > 0)
    back = KRL.read(tuple(after)).toolpath
    step = 0.5000001 * 10.0**-writing.mm * MM
    known = np.isfinite(plan.position)
    np.testing.assert_array_equal(np.isfinite(back.position), known)
    assert np.abs(back.position - plan.position)[known].max() <= step
    np.testing.assert_allclose(
        back.rotation[known[:, 0]], plan.rotation[known[:, 0]], atol=2 * 10.0**-writing.deg * DEG
    )
    arcs = np.isfinite(plan.sweep)
    np.testing.assert_allclose(back.arcs.centre[arcs], plan.centre[arcs], atol=10 * step)


@pytest.mark.parametrize("name", CASES)
def test_a_plan_is_written_as_it_is_told(name: str) -> None:
    assert list(written(CASES[name])) == CASES[name]["written"].strip("\n").splitlines()


POINT = "DECL FRAME P={X 1,Y 2,Z 3,A 4,B 5,C 6}"


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize(
    ("data", "after"),
    [
        (f"DEFDAT a\n{POINT}", f"DEFDAT a\n{POINT}\nDECL FRAME P_1=NEW"),
        (f"DEFDAT a\n{POINT}\n", f"DEFDAT a\n{POINT}\nDECL FRAME P_1=NEW\n"),
        (f"DEFDAT a\n{POINT} ;note\nENDDAT", f"DEFDAT a\n{POINT} ;note\nDECL FRAME P_1=NEW\nENDDAT"),
    ],
)
def test_a_new_point_stands_behind_the_old_one(data: str, after: str, newline: str) -> None:
    texts = ["DEF a()\nBAS(#INITMOV,0)\nLIN P\nLIN P\nEND\n", data]
    program = KRL.read(
        tuple(
            Document(Path(name), text.replace("\n", newline).encode())
            for name, text in zip(("a.src", "a.dat"), texts, strict=True)
        )
    )
    plan, writing = planned(program, "own copy-dat\n4 move 0 0 1")
    found = [edit for edit in KRL.edit_targets(program, plan, writing).edits if edit.span.file == 1]
    wanted = after.replace("NEW", "{X 1,Y 2,Z 4.000,A 4,B 5,C 6}").replace("\n", newline)
    assert apply(program.documents[1], found).decode() == wanted


@pytest.mark.parametrize(
    ("literal", "decimals"),
    [
        (b"- 2.50", 2), (b"1.250E1", 2), (b"1E-3", 3), (b"1.5e+2", 0), (b"1.50E1", 1), (b"'HF'", 0), (b"1.5E-20", 12),
        (b"+5", 0), (b"1.E1", 0), (b"1.", 0), (b"0.123 ", 3),
    ],
)  # fmt: skip
def test_decimals_that_a_literal_is_written_with(literal: bytes, decimals: int) -> None:
    assert written_decimals(literal) == decimals
    assert other_literal(literal)[1] == decimals


def test_values_of_literals_in_any_form() -> None:
    assert [other_literal(text)[0] for text in (b"- 2.5", b"'HF'", b"none")] == [-2.5, 15.0, 0.0]


def test_what_stays_as_it_is_written() -> None:
    """Within half a step of each literal; angles go round."""
    own = np.array([[1.0, 2.0, 3.0, 180.0, -360.0, 90.0]])
    none = np.full((1, 6), -1)
    said = Components(own, np.array([[0, 1, 2, 1, 1, 1]]), none, none, none)
    np.testing.assert_allclose(said.half_step, [[0.5, 0.05, 0.005, 0.05, 0.05, 0.05]])
    change = np.array([[0.5, -0.0499, 0.0051, -359.96, 360.04, 0.051]])
    assert said.unchanged(own + change).tolist() == [[True, True, False, True, True, False]]
    two = Components(
        np.vstack([own, own + 1]), *(np.vstack([part, part]) for part in (said.decimals, *[none] * 3))
    )
    assert two.of(np.array([False, True])).own.tolist() == (own + 1).tolist()


def test_numbers_that_differ() -> None:
    nan = math.nan
    old, new = np.array([0.0, 0.0, 1.0, nan, nan, 1.0]), np.array([1e-12, 2e-12, -1.0, nan, 1.0, nan])
    assert differs(new, old).tolist() == [False, True, True, False, True, True]
