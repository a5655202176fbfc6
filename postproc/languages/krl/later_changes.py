"""What interrupts and triggers run and change at a time of their own.

A parameter that comes back is the variable that was handed over for it, for as long as the routine runs: what changes
one of them later changes the other.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from postproc.languages.krl.lexing import (
    NAME,
    Call,
    Statement,
    identifiers,
    kept,
    split_values,
    without_strings,
)
from postproc.languages.krl.program_blocks import Routine
from postproc.languages.krl.statement_effects import (
    Effect,
    as_effects,
    called_in,
    is_harmless,
    returned_to,
)

EVENTS = frozenset([b"INTERRUPT", b"TRIGGER", b"GLOBAL"])
"""First words of statements that say what happens at a time of its own."""
_LATER = re.compile(rb"\bDO[ \t]+(" + NAME + rb")(?:[ \t]*+\((.*)\))?", re.I)
_DO = re.compile(rb"(?<![A-Za-z0-9_$])DO(?![A-Za-z0-9_$])", re.I)
_NO_FUNCTIONS = frozenset([b"WHEN", b"DO", b"ON", b"OFF", b"ENABLE", b"DISABLE", b"DECL"])
Parameters = tuple[tuple[bytes, bool], ...]


class Handed(NamedTuple):
    """Arguments of a call of the routine ``names``, in its order; or, ``is_call`` not, what a statement with calls of
    the functions ``names`` mentions."""

    names: tuple[bytes, ...]
    code: bytes
    is_call: bool


def later_actions(statement: Statement) -> list[Call]:
    """What an interrupt or a trigger calls or assigns, the latter as a call without arguments."""
    return [Call(name.upper(), given) for name, given in _LATER.findall(statement.code)]


@kept
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


def spread(
    later: Iterable[Effect], handed: Iterable[Handed], parameters: Mapping[bytes, Parameters]
) -> set[Effect]:
    """What changes later where ``later`` does: besides, the variables that are handed over for parameters among it,
    and the parameters for which variables among it are handed over; ``parameters``: name of a routine -> its own, and
    whether each comes back."""
    found, groups = set(later), list(_groups(handed, parameters)) if later else []
    groups_of: defaultdict[Effect, list[int]] = defaultdict(list)
    for number, group in enumerate(groups):
        for name in group:
            groups_of[name].append(number)
    todo = [name for name in found if name in groups_of]
    while todo:
        for number in groups_of.pop(todo.pop(), ()):
            new, groups[number] = groups[number] - found, frozenset()
            found |= new
            todo += new
    return found


def _groups(handed: Iterable[Handed], parameters: Mapping[bytes, Parameters]) -> Iterator[frozenset[Effect]]:
    """Names that may be one and the same variable."""
    for names, code, is_call in handed:
        if not is_call:
            back = {name for of in names for name, comes_back in parameters.get(of, ()) if comes_back}
            if back:
                yield frozenset([*back, *as_effects(identifiers(code))])
            continue
        for (name, comes_back), text in zip(parameters.get(names[0], ()), split_values(code), strict=False):
            given = returned_to(text) if comes_back else None
            if given is not None:
                yield frozenset([name, *as_effects([given])])


def parameters_of(routines: Mapping[bytes, Routine]) -> dict[bytes, Parameters]:
    """Name of a routine -> its parameters."""
    return {name: routine.parameters for name, routine in routines.items()}
