"""A plan as edits: only the literals that changed, what a changed neighbour would alter, and inserted motions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.dialects.decimals import fixed
from postproc.dialects.dialect import Moved, Plan, Program, Writing
from postproc.dialects.krl.chain import Chain
from postproc.dialects.krl.components import LETTER, Components, Task, differs
from postproc.dialects.krl.inserting import insertions
from postproc.dialects.krl.targets import FULL, single_edits
from postproc.document import Edits
from postproc.toolpath import Kind

BLOCK = 1 << 16
"""Rows that are worked on at a time."""


def moved(program: Program, plan: Plan, writing: Writing) -> Moved:
    """The edits after which the program makes the motions of ``plan``.

    Raises ValueError if a row is asked to move, or to be divided, that can not, and for an inserted arc that sweeps
    more than ``FULL``: defects of the caller.
    """
    task = Task(program, plan, writing)
    touched, way = _touched(task)
    _refuse_forbidden(task, touched, way)
    plain = touched & _plain(task)
    chain = Chain(task, touched)
    parts: list[Edits] = []
    for rows in _blocks(np.flatnonzero(touched & ~chain.depends)):
        said = task.components(rows)
        there = task.own[rows]
        wanted = task.wanted(rows, said.own, plan.position[there], plan.rotation[there])
        kept = said.kept(wanted)
        chain.written(rows, said, wanted, kept)
        simple = plain[rows]
        if simple.any():
            parts.append(_literal_edits(task, said, wanted, ~kept & simple[:, None]))
    chain.follow()
    singly = np.flatnonzero((touched & ~plain) | chain.again(way))
    single, held = single_edits(task, singly, chain.completed)
    if held:
        return Moved((), held)
    return Moved(Edits.joined(*parts, *insertions(task), single))


def _touched(task: Task) -> tuple[Bools, Bools]:
    """(N,) rows whose end is another one, and arcs whose way is."""
    path, plan, n = task.path, task.plan, len(task.path)
    touched, way = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    for rows in _blocks(np.arange(n)):
        there = task.own[rows]
        touched[rows] = differs(plan.position[there], path.position[rows]).any(axis=1)
        touched[rows] |= differs(plan.rotation[there], path.rotation[rows]).any(axis=(1, 2))
    arcs = np.flatnonzero(path.kind == Kind.CIRC)
    there = task.own[arcs]
    for new, old in ((plan.centre, path.centre), (plan.normal, path.normal), (plan.sweep, path.sweep)):
        other = differs(new[there], old[arcs])
        way[arcs] |= other.any(axis=1) if other.ndim > 1 else other
    return touched, way


def _refuse_forbidden(task: Task, touched: Bools, way: Bools) -> None:
    path = task.path
    fixed_rows = {row for row in (*path.refused, *path.pinned) if touched[row]}
    fixed_rows |= {row for row in path.refused if way[row]}
    fixed_rows |= set(np.flatnonzero(touched & (path.kind == Kind.AXIS)).tolist())
    if fixed_rows:
        raise ValueError(f"motions that can not be corrected were moved: rows {sorted(fixed_rows)[:5]}")
    whole = {row for row in (*path.refused, *path.whole) if task.inserted[row]}
    turns = task.plan.sweep[~task.plan.own] > FULL
    if turns.any():
        raise ValueError("an inserted arc of nearly a turn: three points do not hold it")
    if whole:
        raise ValueError(f"motions that can not be divided were: rows {sorted(whole)[:5]}")


def _plain(task: Task) -> Bools:
    """(N,) rows whose target are six literals that nothing else uses."""
    places = task.places
    plain = (places.start >= 0).all(axis=1) & ~task.is_relative
    plain[[*places.locked, *places.arcs]] = False
    used = np.bincount(places.text, minlength=len(plain))
    for arc in places.arcs.values():
        if arc.text < len(used):
            used[arc.text] += 1
    return np.asarray(plain & (used[places.text] == 1))


def _literal_edits(task: Task, said: Components, wanted: Floats, chosen: Bools) -> Edits:
    """Edits of the ``chosen`` (K, 6) literals to the ``wanted`` (K, 6) values."""
    start, stop, file = said.start[chosen], said.stop[chosen], said.file[chosen]
    before = np.zeros(len(start), np.uint8)
    for index, raw in enumerate(task.raws):
        here = file == index
        before[here] = raw[start[here] - 1]
    # "Z- 30" is Z and a number, "Z30.1" would be a name.
    texts, ends = fixed(wanted[chosen], said.decimals[chosen], LETTER[before])
    return Edits(file, start, stop, texts, ends)


def _blocks(rows: Ints) -> Iterator[Ints]:
    for at in range(0, len(rows), BLOCK):
        yield rows[at : at + BLOCK]
