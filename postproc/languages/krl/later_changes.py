"""What interrupts and triggers run and change at a time of their own."""

from __future__ import annotations

import re

from postproc.languages.krl.lexing import NAME, Call, Statement, cached, without_strings
from postproc.languages.krl.statement_effects import SYSTEM, called_in, is_harmless

EVENTS = frozenset([b"INTERRUPT", b"TRIGGER", b"GLOBAL"])
"""First words of statements that say what happens at a time of its own."""
_LATER = re.compile(rb"\bDO[ \t]+(" + NAME + rb")(?:[ \t]*+\((.*)\))?", re.I)
_DO = re.compile(rb"(?<![A-Za-z0-9_$])DO(?![A-Za-z0-9_$])", re.I)
_NO_FUNCTIONS = frozenset([b"WHEN", b"DO", b"ON", b"OFF", b"ENABLE", b"DISABLE", b"DECL"])


def later_actions(statement: Statement) -> list[Call]:
    """What an interrupt or a trigger calls or assigns, the latter as a call without arguments."""
    return [Call(name.upper(), given) for name, given in _LATER.findall(statement.code)]


def starts_nothing(statement: Statement) -> bool:
    """Whether it lets nothing happen later that matters to motions: INTERRUPT OFF, or a TRIGGER that sets an output."""
    if statement.word == b"TRIGGER":
        return not later_functions(statement.code) and all(
            is_harmless(one.name) or (one.name.startswith(b"$") and one.name not in SYSTEM)
            for one in later_actions(statement)
        )
    words = statement.code.upper().split()[:2]
    return words in ([b"INTERRUPT", b"OFF"], [b"INTERRUPT", b"DISABLE"])


@cached
def later_functions(code: bytes) -> tuple[bytes, ...]:
    """The functions that the code of an interrupt or a trigger calls, with what it hands over or in its condition; not
    those of KRL itself, nor those that a trigger calls where it stands."""
    text = without_strings(code)
    done = {name.upper() for name, _ in _LATER.findall(text)}
    if text[:7].upper() == b"TRIGGER":
        text = b"".join(_DO.split(text, 1)[1:])
    return tuple(
        name for name in called_in(text) if name not in done | _NO_FUNCTIONS and not is_harmless(name)
    )
