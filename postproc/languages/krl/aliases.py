"""Names of one and the same variable: a parameter that comes back is the variable that was handed over for it, for as
long as the routine runs, and what changes one of them changes the other."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from postproc.languages.krl.lexing import identifiers, split_values
from postproc.languages.krl.program_blocks import Routine
from postproc.languages.krl.statement_effects import Effect, as_effects, returned_to

MOST_NAMES = 200
"""Names of one variable; where there are more, it may be any that the program assigns."""

Parameters = tuple[tuple[bytes, bool], ...]


class Handed(NamedTuple):
    """Arguments of a call of the routine ``names``, in its order; or, ``is_call`` not, what a statement with calls of
    the functions ``names`` mentions."""

    names: tuple[bytes, ...]
    code: bytes
    is_call: bool


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


def aliases(
    handed: Iterable[Handed], parameters: Mapping[bytes, Parameters]
) -> dict[Effect, frozenset[Effect]]:
    """Effect -> all that may be the same variable, itself among it; of names that no call hands over nothing."""
    together: dict[Effect, set[Effect]] = {}
    for group in _groups(handed, parameters):
        sets = {id(together[name]): together[name] for name in group if name in together}
        largest = max(sets.values(), key=len, default=set())
        new = set(group).union(*(names for names in sets.values() if names is not largest))
        largest |= new
        for name in new:
            together[name] = largest
    joined: dict[int, frozenset[Effect]] = {}
    for names in together.values():
        if id(names) not in joined:
            words = {name for name in names if isinstance(name, str)}
            joined[id(names)] = frozenset(names if len(names) <= MOST_NAMES else words | {"all"})
    return {name: joined[id(names)] for name, names in together.items()}
