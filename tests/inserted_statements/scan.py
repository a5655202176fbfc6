"""Puts a statement before probe motions at a place of a program, and compares the reading with the one without it.

A statement that acts on the path, its speed, tool, frame or load must change what is said of the program: a row, a
refusal, a finding. One that acts on nothing must leave every motion as it is. In the program that is compared with, a
comment of as many lines stands in its place, so that all lines keep their numbers.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from postproc.languages.dialect import Program

ACTS, IDLE = "acts", "idle"


@dataclass(frozen=True)
class Statement:
    """option: it stands in a motion of its own, the first one of the probes."""

    text: str
    effect: str
    option: bool = False


@dataclass(frozen=True)
class Language:
    """How programs of a language are taken apart.

    places: indices of the lines of a program before which a statement may stand.  insert: a program with lines before
    one of its lines, and whatever the statements refer to.  probe: the lines of the probe motions, with an option of
    the first one.  prepare: what is put before it all, so that base, tool and speed are known.  blank: a line that says
    nothing.
    """

    name: str
    statements: tuple[Statement, ...]
    places: Callable[[str], list[int]]
    insert: Callable[[str, int, list[str]], str]
    probe: Callable[[str], list[str]]
    prepare: tuple[str, ...]
    blank: str
    read: Callable[[str], Program]


@dataclass(frozen=True)
class Reading:
    """rows: what is said of each motion; further: everything else."""

    rows: list[str]
    further: list[str]

    @classmethod
    def of(cls, program: Program) -> Reading:
        return cls(rows_of(program), further_of(program))


@dataclass(frozen=True)
class Wrong:
    """A statement at a place: silent, or needlessly costly."""

    kind: str
    statement: Statement
    line: int
    what: str = ""

    def __str__(self) -> str:
        return f"{self.kind}: {self.statement.text!r} before line {self.line + 1}{self.what and ': ' + self.what}"


def judged(language: Language, text: str, chosen: Callable[[list], list] = list) -> Iterator[Wrong | None]:
    """What is wrong of each statement at each place (None where nothing is); ``chosen``: which of them are tried."""
    pairs = [(place, statement) for place in language.places(text) for statement in language.statements]
    plain: dict[tuple[int, int], Reading | None] = {}
    for place, statement in chosen(pairs):
        lines = [] if statement.option else statement.text.split("\n")
        key = place, len(lines)
        if key not in plain:
            plain[key] = _without(language, text, place, [language.blank] * len(lines))
        before = plain[key]
        if before is None:
            continue
        probe = language.probe(statement.text if statement.option else "")
        other = language.read(language.insert(text, place, [*language.prepare, *lines, *probe]))
        yield _wrong(statement, place, before, Reading.of(other))


def _without(language: Language, text: str, place: int, blanks: list[str]) -> Reading | None:
    """What is said without the statement; None where the probes are not all known."""
    program = language.read(language.insert(text, place, [*language.prepare, *blanks, *language.probe("")]))
    return Reading.of(program) if _known(program, language, text, place, len(blanks)) else None


def few(count: int, seed: int) -> Callable[[list], list]:
    """A choice of ``count`` of the pairs of place and statement, another one with each seed."""
    return lambda pairs: random.Random(seed).sample(pairs, min(count, len(pairs)))


def _known(program: Program, language: Language, text: str, place: int, more: int) -> bool:
    """Whether all probes run, can be corrected, and have a speed, a base and a tool."""
    path = program.toolpath
    mark = language.insert(text, place, [*language.prepare, *[language.blank] * more, "\0"])
    first = mark[: mark.index("\0")].count("\n") + 1
    lines = range(first, first + len(language.probe("")))
    rows = [row for row, line in enumerate(path.line) if int(line) in lines]
    if len(rows) < len(lines) or any(row in path.constraints.refused for row in rows):
        return False
    frames = [*path.base[rows], *path.tool[rows]]
    return min(frames) >= 0 and bool(np.isfinite([*path.feed[rows[:1]], *path.approximation[rows[:1]]]).all())


def _wrong(statement: Statement, place: int, before: Reading, after: Reading) -> Wrong | None:
    if statement.effect == ACTS:
        return Wrong("silent", statement, place) if before == after else None
    if len(before.rows) != len(after.rows):
        return Wrong("needless", statement, place, "another number of motions")
    differs = [f"{b} <- {a}" for a, b in zip(before.rows, after.rows, strict=True) if a != b]
    return Wrong("needless", statement, place, differs[0]) if differs else None


def rows_of(program: Program) -> list[str]:
    """What is said of each motion."""
    refused = program.toolpath.constraints.refused
    return [
        f"{line} {refused[row].message if row in refused else ''}"
        for row, line in enumerate(program.toolpath.dump())
    ]


def further_of(program: Program) -> list[str]:
    """Everything else that a reading says."""
    path = program.toolpath
    said = [f"{row} {finding.code} {finding.message}" for row, finding in path.constraints.locked.items()]
    said += [f"{row} {why}" for row, why in path.constraints.no_insert_before.items()]
    said += [f"{finding.code} {finding.line} {finding.message}" for finding in program.findings]
    modes = path.orientation_control.mode, path.approximation, path.stops, path.continues
    return [*said, *(str(one.tolist()) for one in modes), str(path.stated_loads)]
