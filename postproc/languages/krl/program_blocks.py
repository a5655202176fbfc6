"""Blocks and routines of a program, and what each may change."""

from __future__ import annotations

from dataclasses import dataclass, field

from postproc.languages.krl.statement_effects import Effects


@dataclass(eq=False)
class Block:
    """An IF, SWITCH, loop or spline block: what it may change, and the routines it calls.

    start, end: index of its first and last statement; branches: those of its ELSE, CASE, DEFAULT; broken: its end is
    missing, or blocks in it are nested too deep; leaves: an EXIT leads out of it; has_labels: a GOTO leads to a
    label in it; is_entered: one from outside of it.
    """

    word: bytes
    line: int
    start: int
    end: int = -1
    branches: list[int] = field(default_factory=list)
    effects: Effects = field(default_factory=set)
    calls: set[bytes] = field(default_factory=set)
    broken: bool = False
    leaves: bool = False
    has_labels: bool = False
    is_entered: bool = False


@dataclass(eq=False)
class Routine(Block):
    """A DEF or DEFFCT of the file.  types: the variables that it declares and their types, parameters included."""

    name: bytes = b""
    is_main: bool = False
    is_global: bool = False
    is_function: bool = False
    parameters: tuple[tuple[bytes, bool], ...] = ()
    types: dict[bytes, bytes] = field(default_factory=dict)
    labels: dict[bytes, tuple[int, tuple[Block, ...]]] = field(default_factory=dict)
