"""M99 of a main program leads back to its start, or to a block: whether its motions are the same in every pass.

Codes set constants and hold on, so that what is the same in the first two passes is the same in all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Ints
from postproc.languages.dialect import Program
from postproc.languages.gcode.execution import Execution
from postproc.toolpath import Kind, Toolpath

OTHERWISE_REPEATED = (
    "M99 leads back with the modes and from the place of its block, and the motion is then another one: state G90,"
    " the plane, feed, tool, offset and a rapid to X, Y, Z where it leads to"
)
MOST_RESTARTS = 4
"""Of a program with more M99 that lead back, what they repeat is not compared."""
LAST_DIGITS = 1e-9
"""[m, rad, m/s] and of a value: numbers that differ by less are the same."""


class ProgramPass(NamedTuple):
    """A program as read, its run, and rows (N,): the steps of its motions; that run may go through it twice."""

    program: Program
    execution: Execution
    rows: Ints

    @property
    def blocks(self) -> Ints:
        """(N,) the blocks of the text that the motions are."""
        order = self.execution.order
        return self.rows if order is None else order[self.rows]


def differs_when_repeated(first: ProgramPass, again: Callable[[int], ProgramPass]) -> Bools:
    """(N,) motions of ``first`` that are corrected and are others in a second pass; ``again``: the program with a
    second pass from a block, as of ``Execution.restarts``."""
    blocks, path = first.blocks, first.program.toolpath
    corrected = np.ones(len(blocks), np.bool_)
    corrected[list(path.constraints.refused)] = False
    result = np.zeros(len(blocks), np.bool_)
    order = np.argsort(blocks, kind="stable")
    restarts = first.execution.restarts
    if len(restarts) > MOST_RESTARTS:
        return corrected
    for block in restarts:
        other = again(block)
        step = other.execution.second_pass
        if step < 0:
            return corrected
        repeated = np.flatnonzero(other.rows >= step)
        places = np.searchsorted(blocks[order], other.blocks[repeated])
        places = order[np.minimum(places, max(len(order) - 1, 0))] if len(order) else places
        known = blocks[places] == other.blocks[repeated] if len(order) else np.zeros(len(places), np.bool_)
        mine, its = places[known], repeated[known]
        result[mine[~_same(first.program, mine, other.program, its)]] = True
    return result & corrected


def _same(one: Program, rows: Ints, other: Program, others: Ints) -> Bools:
    """(K,) whether motions ``rows`` (K,) of a program are ``others`` (K,) of another one, as far as they are known."""
    same = np.ones(len(rows), np.bool_)
    for a, b in zip(_columns(one, rows), _columns(other, others), strict=True):
        alike = np.isnan(a) | np.isclose(a, b, rtol=LAST_DIGITS, atol=LAST_DIGITS)
        same &= alike.reshape(len(rows), -1).all(axis=1)
    for name in ("base", "tool"):
        stated, again = (_frames(program.toolpath) for program in (one, other))
        mine, its = getattr(one.toolpath, name)[rows], getattr(other.toolpath, name)[others]
        same &= np.array(
            [stated[i] == again[j] for i, j in zip(mine.tolist(), its.tolist(), strict=True)], np.bool_
        )
    return same


def _columns(program: Program, rows: Ints) -> Iterator[NDArray[Any]]:
    path, turns = program.toolpath, program.toolpath.orientation_control
    start = np.array(program.text.start_position[rows])
    start[path.kind[rows] == Kind.PTP] = np.nan  # where an air move comes from
    yield start
    for column in (
        path.kind, path.position, path.rotation, path.feed, path.spindle, path.external, path.approximation,
        path.arcs.centre, path.arcs.normal, path.arcs.sweep, turns.rotary_from, turns.rotary_to, turns.part_turn,
    ):  # fmt: skip
        yield np.asarray(column)[rows]


def _frames(path: Toolpath) -> list[object]:
    """What the frames of a path are, by their index; the last: one that is not known."""
    return [
        (
            frame.number,
            *(() if frame.pose is None else (frame.pose.rotation.tobytes(), frame.pose.position.tobytes())),
        )
        for frame in path.frames
    ] + [None]
