"""Which routines of a file call which, through others too."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from postproc.languages.core.reach import reached
from postproc.languages.krl.program_blocks import Routine


def closure(routines: Mapping[bytes, Routine], names: Iterable[bytes]) -> set[bytes]:
    """The routines among ``names``, and all that they call."""
    return reached(routines.keys() & set(names), lambda name: routines[name].calls & routines.keys())


def callers(routines: Mapping[bytes, Routine], names: Iterable[bytes]) -> set[bytes]:
    """The routines among ``names``, and all that call one of them, or call what calls one ..."""
    callers_of: dict[bytes, set[bytes]] = {}
    for name, routine in routines.items():
        for call in routine.calls:
            callers_of.setdefault(call, set()).add(name)
    return reached(routines.keys() & set(names), lambda name: callers_of.get(name, ()))
