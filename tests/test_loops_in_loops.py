"""What loops around many statements cost: what changes between places, and few passes."""

from __future__ import annotations

import pytest
from linear import all_cases, import_readers, is_linear

from postproc.languages.core.flow_runner import FlowRunner
from postproc.languages.core.motion_sources import MOST, START, Meeting, Source, expanded, met
from postproc.languages.core.persistent_map import KeyNumbers, PersistentMap
from postproc.languages.rapid.parsing import ModuleParser
from postproc.languages.rapid.propagation import Propagation
from postproc.languages.rapid.tokens import Tokens


def _merges(count: int) -> int:
    """How often values are merged where two versions that share nothing meet after each change of both."""
    asked = 0

    def merge(key: int, one: str | None, other: str | None) -> str:
        nonlocal asked
        asked += 1
        return "varies"

    numbers = KeyNumbers()
    own = other = PersistentMap(numbers)
    for key in range(count):
        own, other = own.set(key, "one"), other.set(key, "other")
    for key in range(count):
        own = own.set(key, "one again")
        other = own.merged(other, merge, remembered=True).set(key, "other again")
    plain = own.merged(other, merge)
    assert dict(own.merged(other, merge, remembered=True).items()) == dict(plain.items())
    return asked


def test_merging_along_a_program_takes_what_changes():
    few, many = _merges(500), _merges(1000)
    assert few > 500
    assert many < 3 * few


@pytest.mark.parametrize("places", [MOST - 5, MOST + 5, 100, 400])
def test_a_loop_around_places_where_motions_meet_is_stable_after_few_passes(places):
    """Each place may be passed without its motion: those before the next pass are all, after a few passes."""
    meetings = [Meeting() for _ in range(places + 1)]
    first: frozenset[Source] = frozenset([START])
    passes = 0
    while True:
        passes += 1
        last = first
        for motion in range(places):
            last = met(last, frozenset([motion]), meetings[motion])
        after = met(first, last, meetings[places])
        if after == first:
            break
        first = after
    assert passes <= 4
    assert expanded(first) >= {START, *range(places)}


@pytest.mark.parametrize(
    ("text", "first", "names", "rest"),
    [
        (b"a b, c; d;", 0, {b"A", b"B", b"C"}, b"D"),
        (b"a 'x\" ;\nendproc", 0, {b"A"}, b"ENDPROC"),
        (b"endif endif", 0, {b"ENDIF"}, b"ENDIF"),
        (b"a ! b;\n c", 0, {b"A", b"C"}, b""),
        (b'a "b;" c', 0, {b"A", b"C"}, b""),
        (b"x! z\n y endif", 1, {b"X", b"Y"}, b"ENDIF"),
    ],
)
def test_a_statement_that_is_not_understood_is_passed(text, first, names, rest):
    """Up to its semicolon or the word of a block, with the names in it; comments in it are kept, once."""
    tokens = Tokens(text)
    for _ in range(first):
        tokens.take()
    assert tokens.skip(0, frozenset([b"ENDIF", b"ENDPROC"])) == names
    assert tokens.next.text == rest
    assert len(tokens.comments) == text.count(b"!")
    assert not text[tokens.before : tokens.next.start].strip() or b"!" in text


def test_data_of_main_alone_makes_no_further_run(monkeypatch):
    """Main starts again with what its last run left: its own data is not of it."""
    starts = []
    start = FlowRunner.start
    monkeypatch.setattr(FlowRunner, "start", lambda runner: (starts.append(0), start(runner)))
    body = b"VAR num a;\nConfL\\Off;\na:=3;\nFOR i FROM 1 TO 3 DO\na:=i;\nENDFOR\n"
    raw = b"MODULE m\nPROC main()\n" + body + b"ENDPROC\nENDMODULE\n"
    Propagation(ModuleParser(raw).file(), raw).run()
    assert len(starts) == 2


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["WHILE thrice around 'VAR num", "GOTO around 'VAR num", "FOR in WHILE around 'FOR k"]
)
def test_loops_around_much_are_read_in_linear_time(name):
    import_readers()
    [case] = [each for each in all_cases() if each.kind == "mod" and each.name.startswith(name)]
    assert is_linear(case)
