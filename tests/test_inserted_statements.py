"""A statement of the manual that acts on motions shows in the reading; one that does not costs no motion.

Statements of each language are put before known motions, at places of programs that the judges of the language draw.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from inserted_statements.drawn import LANGUAGES, drawn
from inserted_statements.scan import Language, Wrong, few, judged

from postproc.languages.dialect import Program


def wrong_in(language: Language, seeds: range, each: int) -> tuple[list[Wrong], int]:
    """What is silent or needless, and how many statements were judged."""
    found = [one for seed in seeds for one in judged(language, drawn(language.name, seed), few(each, seed))]
    return [one for one in found if one is not None], len(found)


@pytest.mark.parametrize("name", LANGUAGES)
def test_no_statement_is_lost_and_none_costs_motions(name: str) -> None:
    wrong, count = wrong_in(LANGUAGES[name], range(100, 103), 40)
    assert list(map(str, wrong)) == []
    assert count > 25


@pytest.mark.slow
@pytest.mark.parametrize("name", LANGUAGES)
def test_no_statement_is_lost_and_none_costs_motions_in_many_programs(name: str) -> None:
    wrong, count = wrong_in(LANGUAGES[name], range(2000, 2040), 120)
    assert list(map(str, wrong)) == []
    assert count > 1000


@pytest.mark.parametrize(
    ("name", "text", "other", "kind"),
    [
        ("krl", "$TECH[1].MODE=#CYCLE", ";", "silent"),
        ("rapid", "SoftAct 1,50;", "! nothing", "silent"),
        ("tp", "UTOOL_NUM=2", "!nothing", "silent"),
        ("krl", "WAIT SEC 0.5", "$BASE=elsewhere(1)", "needless"),
        ("rapid", "WaitTime 0.5;", "PDispSet d71;", "needless"),
        ("tp", "WAIT .50(sec)", "UFRAME_NUM=R[9]", "needless"),
    ],
)
def test_a_reader_that_overlooks_a_statement_or_takes_it_for_another_is_found(
    name: str, text: str, other: str, kind: str
) -> None:
    """The comparison itself."""
    language = LANGUAGES[name]
    statement = next(one for one in language.statements if one.text == text)

    def reading(read: Callable[[str], Program]) -> Callable[[str], Program]:
        return lambda program: read(program.replace(text, other))

    mistaken = replace(language, statements=(statement,), read=reading(language.read))
    found = [
        one.kind
        for seed in range(100, 104)
        for one in judged(mistaken, drawn(name, seed), few(6, seed))
        if one is not None and one.statement is statement
    ]
    assert kind in found
    assert set(found) == {kind}
