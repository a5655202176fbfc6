"""What a program may change between a GOTO and its label: nothing else differs between the ways that lead there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

from postproc.languages.krl.lexing import Statement, identifiers
from postproc.languages.krl.program_structure import ProgramStructure, Routine
from postproc.languages.krl.statement_effects import MODAL, Effects, effects_of, functions_of, is_harmless

MOST_PAIRS = 50_000
"""Stretches times branches of a routine that are compared; with more, a label forgets all that the program changes."""

Stretch = tuple[int, int]
"""First and last index of statements."""


def resolve_jumps(found: ProgramStructure, statements: Iterable[tuple[int, Statement]]) -> None:
    """Sets ``passed_through`` of a survey: what differs between the ways that lead to a label; its blocks change it
    too.

    A stretch goes from a label to all of its GOTOs.  Stretches that overlap are one, as what one label forgets is
    carried to the other; and a block that a stretch cuts belongs to it as a whole, as its branches all begin where it
    starts.
    """
    stretches: dict[tuple[int, bytes], Stretch] = {}
    for routine in found.routine_at.values():
        inner = [
            branch
            for block in found.blocks
            if routine.start < block.start <= routine.end
            for branch in pairwise((block.start, *block.branches, block.end))
        ]
        own = {
            name: (min(at, *found.jumps[key]), max(at, *found.jumps[key]))
            for name, (at, _) in routine.labels.items()
            if (key := (routine.start, name)) in found.jumps
        }
        if len(own) * (len(inner) + len(own)) <= MOST_PAIRS:
            grown = _grown(sorted(own.values()), inner)
            for name, (low, _) in own.items():
                stretches[routine.start, name] = next(whole for whole in grown if whole[0] <= low <= whole[1])
    effects: dict[Stretch, Effects] = {stretch: set() for stretch in stretches.values()}
    waiting = sorted(effects)
    for index, statement in statements if waiting else ():
        while waiting and waiting[0][1] < index:
            del waiting[0]
        if waiting and waiting[0][0] <= index:
            effects[waiting[0]] |= _changed(found, statement)
    everything: Effects = {*MODAL, *found.effects}
    for routine in found.routine_at.values():
        for name, (_, around) in routine.labels.items():
            key = (routine.start, name)
            if key in found.jumps:
                found.passed_through[key] = effects[stretches[key]] if key in stretches else everything
                for block in around:
                    block.effects |= {"point", *found.passed_through[key]}


def _grown(stretches: list[Stretch], branches: Sequence[Stretch]) -> list[Stretch]:
    """Stretches with the branches of blocks that they cut; those that overlap as one."""
    while True:
        grown: list[Stretch] = []
        for low, high in sorted(stretches):
            for start, end in branches:
                if start < low <= end <= high or low <= start <= high < end:
                    low, high = min(low, start), max(high, end)
            if grown and low <= grown[-1][1]:
                low, high = min(low, grown[-1][0]), max(high, grown.pop()[1])
            grown.append((low, high))
        if grown == stretches:
            return grown
        stretches = grown


def _changed(found: ProgramStructure, statement: Statement) -> Effects:
    if statement.kind == "motion":
        return {"point"}
    effects, called = effects_of(statement)
    changed = set(effects)
    functions = functions_of(statement)
    if not all(map(is_harmless, functions)):
        changed |= identifiers(statement.code)
    for name in (*functions, called):
        routine: Routine | None = found.routines.get(name)
        if routine is not None:
            changed |= routine.effects
    return changed
