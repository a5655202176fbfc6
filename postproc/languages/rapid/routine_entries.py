"""Where a module is entered: by its main routine, by what nothing in it calls, and where the flow is not shown."""

from __future__ import annotations

from collections.abc import Set

from postproc.languages.rapid.declared_data import DeclaredData, Usage
from postproc.languages.rapid.syntax_tree import Module, RapidRoutine
from postproc.languages.rapid.values import UnknownData, Value


def program_entries(module: Module, usage: Usage) -> tuple[RapidRoutine | None, list[RapidRoutine]]:
    """The main routine, None where none is known, and every procedure that may be started, the main one first."""
    called = set().union(*usage.calls.values()) if usage.calls else set()
    entries = [
        routine
        for routine in module.routines
        if routine.kind == b"PROC" and (routine.name not in called or routine.name == b"MAIN")
    ]
    main = next((routine for routine in reversed(module.routines) if routine.name == b"MAIN"), None)
    if main is None and len(entries) == 1:
        main = entries[0]
    return main, sorted(entries, key=lambda routine: routine is not main)


def run_aside(module: Module, usage: Usage) -> set[bytes]:
    """Routines that are also run where the flow does not show it: by traps, error handlers and synchronous calls of
    motions, by functions, and by calls whose procedure a string names."""
    functions = [routine.name for routine in module.routines if routine.kind == b"FUNC"]
    late = [name for names in usage.calls.values() for name in names if usage.is_late(name)]
    return usage.aside | usage.reached([*functions, *late])


def run_again(
    names: Set[bytes], entries: list[RapidRoutine], main: RapidRoutine | None, usage: Usage
) -> list[bytes]:
    """Routines of ``names`` that move the robot, without those of ``entries`` that are not the main one."""
    return sorted((names & usage.moves) - {one.name for one in entries if one is not main})


def value_at_start(data: DeclaredData, name: bytes, is_main: bool) -> Value:
    """The value of a variable of the module where a routine is entered."""
    shown = name.decode("latin-1")
    if not is_main:
        return UnknownData(f"{shown} is assigned elsewhere")
    if data.kind_of(name) == b"PERS":
        return UnknownData(f"{shown} has at the start the value of an earlier run")
    return data.look(name)[0]
