"""What interrupts and triggers run and change at a time of their own."""

from __future__ import annotations

import re

from postproc.languages.krl.lexing import NAME, Call, Statement, cached, identifiers, without_strings
from postproc.languages.krl.statement_effects import (
    READS_POSITION,
    Directions,
    called_in,
    functions_of,
    is_harmless,
    returned_by,
)
from postproc.languages.krl.system_variables import SYSTEM, has_unknown_effect

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


def variables_of_unknown_effect(statement: Statement, known: Directions) -> set[bytes]:
    """Variables of the controller whose effect is not known and that a statement sets otherwise than by an assignment
    of its own: an interrupt or a trigger does, or a routine for whose parameter they are handed over.

    known: name of a routine -> of each parameter whether it comes back changed.
    """
    if b"$" not in statement.code:
        return set()
    names: set[bytes | str] = set()
    calls, functions = [], functions_of(statement)
    if statement.word in EVENTS:
        calls = later_actions(statement)
        functions += later_functions(statement.code)
        names.update(one.name for one in calls)
    elif isinstance(statement.strings, Call):
        calls = [statement.strings]
    for call in calls:
        if call.name in known:
            names |= returned_by(call, known)
    if any(any(known.get(function, ())) for function in functions):
        names |= identifiers(statement.code)
    return {
        name
        for name in names
        if isinstance(name, bytes) and has_unknown_effect(name) and not READS_POSITION.match(name)
    }
