"""A plan as edits: only the literals that changed, what a changed neighbour would alter, and inserted motions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from postproc.arrays import Bools, Ints
from postproc.blocks import each_block, in_blocks
from postproc.dialects.dialect import Moved, Plan, Program, Role, Writing
from postproc.dialects.krl.chain import Chain
from postproc.dialects.krl.components import Task, differs
from postproc.dialects.krl.in_place import literal_edits, partial_edits
from postproc.dialects.krl.inserting import insertions
from postproc.dialects.krl.targets import FULL, single_edits
from postproc.document import Edit, Edits
from postproc.findings import Finding
from postproc.toolpath import Kind

BLOCK = 1 << 14
"""Rows that are worked on at a time."""


def moved(program: Program, plan: Plan, writing: Writing) -> Moved:
    """The edits after which the program makes the motions of ``plan``.

    Raises ValueError if a row is asked to move, or to be divided, that can not, and for an inserted arc that sweeps
    more than ``FULL``: defects of the caller.
    """
    task = Task(program, plan, writing)
    touched, way = _touched(task)
    _refuse_forbidden(task, touched, way)
    held: dict[int, Finding] = {}
    edits = Edits.collected(_parts(task, touched, way, held))
    return Moved((), held) if held else Moved(edits)


def _parts(task: Task, touched: Bools, way: Bools, held: dict[int, Finding]) -> Iterator[Iterable[Edit]]:
    """The edits, nearly all in the order of their places; ``held`` takes up the rows that can not move as planned."""
    private = _private(task)
    plain = touched & _plain(task, private)
    chain = Chain(task, touched)
    chain.follow()
    again = (touched & ~plain) | chain.again(way)
    partial = again & _partial(task, private)
    single, not_moved = single_edits(task, np.flatnonzero(again & ~partial), chain.completed)
    held.update(not_moved)
    if held:
        return

    def written(block: slice) -> Edits:
        rows = np.arange(block.start, block.stop)
        return Edits.joined(
            literal_edits(task, rows[plain[rows] & ~chain.depends[rows]]),
            partial_edits(task, rows[partial[rows]], chain.completed),
            *insertions(task, rows),
        )

    yield from in_blocks(written, len(touched))
    yield single


def _touched(task: Task) -> tuple[Bools, Bools]:
    """(N,) rows whose end is another one, and arcs whose way is."""
    path, plan, n = task.path, task.plan, len(task.path)
    touched, way = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)

    def ends(rows: slice) -> None:
        there = task.own[rows]
        touched[rows] = differs(plan.position[there], path.position[rows]).any(axis=1)
        touched[rows] |= differs(plan.rotation[there], path.rotation[rows]).any(axis=(1, 2))

    each_block(ends, n)
    for rows in _blocks(np.flatnonzero(path.kind == Kind.CIRC)):
        there = task.own[rows]
        for new, old in ((plan.centre, path.centre), (plan.normal, path.normal), (plan.sweep, path.sweep)):
            other = differs(new[there], old[rows])
            way[rows] |= other.any(axis=1) if other.ndim > 1 else other
    return touched, way


def _refuse_forbidden(task: Task, touched: Bools, way: Bools) -> None:
    path = task.path
    fixed_rows = {row for row in (*path.refused, *path.pinned) if touched[row]}
    fixed_rows |= {row for row in path.refused if way[row]}
    fixed_rows |= set(np.flatnonzero(touched & (path.kind == Kind.AXIS)).tolist())
    if fixed_rows:
        raise ValueError(f"motions that can not be corrected were moved: rows {sorted(fixed_rows)[:5]}")
    whole = {row for row in (*path.refused, *path.whole) if task.inserted[row]}
    inserted = _blocks(np.flatnonzero(task.plan.role != Role.OWN))
    if any((task.plan.sweep[motions] > FULL).any() for motions in inserted):
        raise ValueError("an inserted arc of nearly a turn: three points do not hold it")
    if whole:
        raise ValueError(f"motions that can not be divided were: rows {sorted(whole)[:5]}")


def _private(task: Task) -> Bools:
    """(N,) rows whose literals nothing else uses."""
    places = task.places
    vias = np.array([arc.text for arc in places.arcs.values()], np.int64)
    used = np.bincount(np.concatenate([places.text, vias]))
    private = used[places.text] == 1
    private[list(places.locked)] = False
    return np.asarray(private)


def _plain(task: Task, private: Bools) -> Bools:
    """(N,) rows whose target are six literals that nothing else uses."""
    plain = private & (task.places.start >= 0).all(axis=1) & ~task.is_relative
    plain[list(task.places.arcs)] = False
    return np.asarray(plain)


def _partial(task: Task, private: Bools) -> Bools:
    """(N,) rows whose target is an aggregate in a line that runs once; it leaves out components of the row before."""
    places = task.places
    left_out = np.unpackbits(places.inherits[:, None], axis=1, count=6, bitorder="little")
    partial = private & task.is_inline & (places.inherits > 0) & (places.home == 0)
    partial &= ((places.start >= 0) | left_out).all(axis=1)
    words = places.motion[:, 0]
    if (words[1:] <= words[:-1]).any():
        _, where, counts = np.unique(words, return_inverse=True, return_counts=True)
        partial &= counts[where] == 1
    return np.asarray(partial)


def _blocks(rows: Ints) -> Iterator[Ints]:
    for at in range(0, len(rows), BLOCK):
        yield rows[at : at + BLOCK]
