"""Mutants of the project's own programs, and input that is made to hurt: no crash, no byte lost, moved as planned.

``python -m tests.fuzz FOLDER`` does the same with programs of a folder, as often as wanted.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from fuzz.command import SETTINGS, Source, run, sources
from fuzz.examine import Broken, examined
from fuzz.hostile import hostile
from fuzz.mutations import MUTATIONS, mutated

from postproc.base.document import Document, Edit, Span
from postproc.languages import DIALECTS
from postproc.languages.dialect import Dialect

TESTS = Path(__file__).parent
HELD = DIALECTS
"""Dialects of which all mutants must hold."""
LARGEST = 40_000
SIZE = 100_000
"""Bytes of an input that is made to hurt; ``python -m tests.fuzz --hostile`` takes ten times as much, and the time."""


@cache
def programs() -> tuple[Source, ...]:
    found = [*sources(TESTS / "programs"), *sources(TESTS.parent / "samples")]
    return tuple(
        source for source in found if source.dialect.name in HELD and len(source.documents[0].raw) <= LARGEST
    )


@pytest.mark.slow
@pytest.mark.parametrize("hundred", range(6))
def test_mutants_are_read_moved_and_lose_no_byte(hundred: int) -> None:
    assert {source.dialect.name for source in programs()} == set(HELD)
    for number in range(100 * hundred, 100 * hundred + 100):
        done = run(programs()[number % len(programs())], 1, number, timed=False)
        assert not done.failure, f"run {number}, {done.name}, {done.mutation}: {done.failure} ({done.place})"


@pytest.mark.sample(5)
@pytest.mark.parametrize("source", programs(), ids=lambda source: source.documents[0].path.name)
def test_programs_as_they_are_move_at_random(source: Source) -> None:
    for seed in range(3):
        done = run(source, seed, 0, only=("nothing",), timed=False)
        assert not done.failure, done.failure
        assert [d.raw for d in done.documents] == [d.raw for d in source.documents]


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", hostile(1))
@pytest.mark.parametrize("dialect", HELD.values(), ids=list(HELD))
def test_hostile_input_is_read(dialect: Dialect, name: str) -> None:
    suffix = "src" if dialect.name == "krl" else "nc"
    document = Document(Path(f"a.{suffix}"), hostile(SIZE)[name])
    source = Source(dialect, (document,))
    done = run(source, 1, 0, only=("nothing",), timed=False)
    assert not done.failure, f"{done.failure} ({done.place})"


def test_every_mutation_changes_something_and_comes_again_with_its_seed() -> None:
    raw = b"DEF a()\r\nLIN {X 1.5,Y 2}\r\nEND\r\n" * 20
    for name in MUTATIONS:
        found = [mutated(raw, np.random.default_rng(seed), (name,)) for seed in range(30)]
        again = [mutated(raw, np.random.default_rng(seed), (name,)) for seed in range(30)]
        assert found == again
        assert any(text != raw for _, text in found) == (name != "nothing")


class _Forgetful:
    """A dialect that reads well and writes a row too few, or one too many."""

    def __init__(self, dialect: Dialect, wrong: str) -> None:
        self.dialect, self.wrong = dialect, wrong

    def read(self, documents, settings):
        return self.dialect.read(documents, settings)

    def edit_targets(self, program, plan, writing):
        found = self.dialect.edit_targets(program, plan, writing)
        edits = list(found.edits)
        if self.wrong == "left out" and edits:
            edits.pop(len(edits) // 2)
        if self.wrong == "too much" and not edits:
            at = program.documents[0].raw.rfind(b"X") + 2
            edits.append(Edit(Span(0, at, at + 1), b"7"))
        return type(found)(tuple(edits), found.unwritten)


@pytest.mark.parametrize("wrong", ["left out", "too much"])
def test_a_writer_that_is_wrong_is_found(wrong: str) -> None:
    raw = (
        b"DEF a()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n"
        + b"LIN {X 1.000,Y 2.000,Z 3.000,A 0.000,B 0.000,C 0.000}\n" * 9
    )
    documents = (Document(Path("a.src"), raw + b"END\n"),)
    liar: Dialect = _Forgetful(DIALECTS["krl"], wrong)  # type: ignore[assignment]
    with pytest.raises(Broken):
        examined(liar, documents, np.random.default_rng(1), SETTINGS)
