"""A plan as edits: only the literals that changed, what a changed neighbour would alter, and inserted motions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools
from postproc.base.batches import in_blocks
from postproc.base.document import Edit, Edits
from postproc.base.findings import Finding
from postproc.languages.core.plan_rows import blocks
from postproc.languages.dialect import EditedTargets, Plan, Program, Role, WritingSettings
from postproc.languages.krl.dependent_targets import DependentTargets
from postproc.languages.krl.in_place import literal_edits, partial_edits
from postproc.languages.krl.inserting import insertions
from postproc.languages.krl.target_edits import FULL, single_edits
from postproc.languages.krl.write_plan import KrlWritePlan


def edit_targets(program: Program, plan: Plan, writing: WritingSettings) -> EditedTargets:
    """The edits after which the program makes the motions of ``plan``.

    Raises ValueError if a row is asked to move, or to be divided, that cannot, and for an inserted arc that sweeps
    more than ``FULL``: defects of the caller.
    """
    task = KrlWritePlan(program, plan, writing)
    for motions in blocks(np.flatnonzero(plan.role != Role.ORIGINAL)):
        if (plan.sweep[motions] > FULL).any():
            raise ValueError("an inserted arc is nearly a full turn: three points do not define it")
    entered = {row for row in task.path.constraints.spline_headers if _enters(task, row)}
    touched, way = task.touched(entered - task.path.constraints.refused.keys())
    held: dict[int, Finding] = {}
    edits = Edits.collected(_parts(task, touched, way, held))
    return EditedTargets((), held) if held else EditedTargets(edits)


def _parts(
    task: KrlWritePlan, touched: Bools, path_changes: Bools, refused: dict[int, Finding]
) -> Iterator[Iterable[Edit]]:
    """The edits, nearly all in the order of their places; ``refused`` takes up the rows that cannot move as planned."""
    private = _private(task)
    plain = touched & _plain(task, private)
    chain = DependentTargets(task, touched)
    chain.follow()
    again = (touched & ~plain) | chain.again(path_changes)
    partial = again & _partial(task, private)
    single, not_moved = single_edits(task, np.flatnonzero(again & ~partial), chain.completed)
    refused.update(not_moved)
    for row, finding in not_moved.items():
        for source in sorted(chain.moved_before(row)):
            refused.setdefault(source, _before_unwritten(task, source, finding))
    if refused:
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


def _before_unwritten(task: KrlWritePlan, row: int, finding: Finding) -> Finding:
    """Why a row stays from which another one takes components over that cannot be written: ``finding``."""
    line, column = task.documents[0].place(int(task.places.motion[row, 0]))
    why = f"the motion in line {finding.line} builds on this end point and cannot be written"
    return replace(finding, message=f"{why}: {finding.message}", line=line, column=column)


def _enters(task: KrlWritePlan, row: int) -> bool:
    """Whether all that is inserted before a row is one transition move."""
    return bool(task.inserted[row] == 1 and task.plan.role[task.own[row] - 1] == Role.TRANSITION)


def _private(task: KrlWritePlan) -> Bools:
    """(N,) rows whose literals nothing else uses."""
    places = task.places
    vias = np.array([arc.text for arc in places.arcs.values()], np.int64)
    used = np.bincount(np.concatenate([places.text, vias]))
    private = used[places.text] == 1
    private[list(places.locked)] = False
    return np.asarray(private)


def _plain(task: KrlWritePlan, private: Bools) -> Bools:
    """(N,) rows whose target are six literals that nothing else uses."""
    plain = private & (task.places.start >= 0).all(axis=1) & ~task.is_relative
    plain[list(task.places.arcs)] = False
    return np.asarray(plain)


def _partial(task: KrlWritePlan, private: Bools) -> Bools:
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
