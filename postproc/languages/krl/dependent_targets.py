"""What a changed motion leaves to the motions after it: components that they take over, relative targets, arcs."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.languages.krl.write_plan import Components, KrlWritePlan

BLOCK = 1 << 14
"""Rows that are followed at a time."""

SLACK = 1.000001
"""What doubles are off by, on half a step."""
EXACT = 1e-9
"""[mm, deg] What does not count, however much of it a way along tool axes or an arc makes."""


class DependentTargets:
    """How far the written end of each row is from where the program had it, row by row.

    depends (N,): the row takes components over from the motion before, or is relative to it.  completed (N, 6):
    components that it takes over and that must be written; renewed (N,): relative motions that must be absolute.
    deviation (N, 6) [mm, deg]: written value less that of the program.
    """

    def __init__(self, task: KrlWritePlan, touched: Bools) -> None:
        self.task, self.touched = task, touched
        refused = np.zeros(len(touched), dtype=bool)
        refused[list(task.path.constraints.refused)] = True
        self._refused = refused
        self.depends: Bools = ((task.places.inherits > 0) | task.is_relative) & ~refused
        self.completed = np.zeros((len(touched), 6), dtype=bool)
        self.renewed = np.zeros(len(touched), dtype=bool)
        self.deviation: Floats = np.zeros((len(touched), 6) if self.depends.any() else (0, 6))
        self._inexact = np.zeros(len(touched), dtype=bool)
        self._after_moved = self._find_after_moved()

    def _find_after_moved(self) -> dict[int, bool]:
        """Dependent rows that others than the row before may precede -> whether the written end of one of these may be
        another one than the program has.  On all paths they inherit the same of the program, but not of a plan."""
        starts = {
            row: before for row, before in self.task.path.sequence.predecessors.items()
            if before != (row - 1,) and self.depends[row]
        }  # fmt: skip
        if not starts:
            return {}
        chained = self.depends.copy()
        chained[list(starts)] = False
        moved = self.touched | (self.task.inserted > 0)
        first = np.maximum.accumulate(np.where(chained, 0, np.arange(len(moved))))
        counted = np.cumsum(moved)
        moved = counted - counted[first] + moved[first] > 0
        users: defaultdict[int, list[int]] = defaultdict(list)
        for row, before in starts.items():
            for source in before:
                users[source].append(row)
        todo = [row for source, rows in users.items() if source >= 0 and moved[source] for row in rows]
        found = dict.fromkeys(starts, False)
        while todo:
            row = todo.pop()
            if found[row]:
                continue
            found[row] = True
            while not moved[row]:
                moved[row] = True
                todo += users.get(row, ())
                if row + 1 < len(moved) and chained[row + 1]:
                    row += 1
        return found

    def moved_before(self, row: int) -> set[int]:
        """The moved rows from whose ends a dependent row takes components over, or to which it is relative."""
        found: set[int] = set()
        todo, seen = [row], {row}
        while todo:
            at = todo.pop()
            for source in self.task.path.sequence.predecessors.get(at, (at - 1,)) if self.depends[at] else ():
                if source < 0 or source in seen:
                    continue
                seen.add(source)
                if self.touched[source]:
                    found.add(source)
                else:
                    todo.append(source)
        return found

    def follow(self) -> None:
        """Goes along the rows that depend on the one before."""
        dependent = np.flatnonzero(self.depends)
        first = np.unique(dependent - 1)
        first = first[(first >= 0) & self.touched[first] & ~self.depends[first]]
        for low in range(0, len(first), BLOCK):
            rows = first[low : low + BLOCK]
            self.deviation[rows] = _deviation(*self.task.targets(rows))
        for low in range(0, len(dependent), BLOCK):
            rows = dependent[low : low + BLOCK]
            before = np.where(rows[:, None] > 0, self.deviation[rows - 1], 0.0)  # the first depends on none
            for k in np.flatnonzero(np.isin(rows, list(self._after_moved))).tolist():
                before[k] = math.inf if self._after_moved[int(rows[k])] else 0.0
            active = self.touched[rows] | (self.task.inserted[rows] > 0)
            # Rows far after a change need not be looked at.
            if active.any() or before.any():
                self._follow(rows, before.tolist())

    def _follow(self, rows: Ints, before: list[list[float]]) -> None:
        task = self.task
        last, at = [0.0] * 6, -2
        said, wanted, kept = task.targets(rows)
        fresh: list[list[float]] = _deviation(said, wanted, kept).tolist()
        wish: list[list[float]] = _wrapped(wanted - said.own).tolist()
        half: list[float] = (0.5 * SLACK * 10.0**-task.least).tolist()
        moves = set(np.flatnonzero((~kept).any(axis=1)).tolist())
        # Angles that do not count ($ORI_TYPE=#CONSTANT) are not written: what follows would take them over.
        oriented = ~task.path.keeps_orientation[rows]
        for k, (row, bits, inserted, relative, touched) in enumerate(
            zip(
                rows.tolist(),
                (task.places.inherits[rows] & np.where(oriented, 0b111111, 0b000111)).tolist(),
                (task.inserted[rows] > 0).tolist(),
                task.is_relative[rows].tolist(),
                self.touched[rows].tolist(),
                strict=True,
            )
        ):
            taken = last if at == row - 1 and row not in self._after_moved else before[k]
            at, last = row, [0.0] * 6
            if not (touched or inserted or any(taken)):
                continue
            if relative:
                far = any(abs(t) > h for t, h in zip(taken, half, strict=True))
                turns = task.places.relative[row].in_tool and any(abs(t) > EXACT for t in taken[3:])
                if touched or inserted or far or turns:
                    self.renewed[row], last = True, fresh[k]
                else:
                    last = taken
            else:
                inherits = [i for i in range(6) if bits >> i & 1]
                wrong = [i for i in inherits if inserted or abs(taken[i] - wish[k][i]) > half[i]]
                if k in moves:
                    wrong = inherits
                elif any(i >= 3 for i in wrong):
                    # A, B and C go together: one rotation has several spellings.
                    wrong = [i for i in inherits if i >= 3 or i in wrong]
                for i in wrong:
                    self.completed[row, i] = True
                last = [t if i in inherits and i not in wrong else f
                        for i, (t, f) in enumerate(zip(taken, fresh[k], strict=True))]  # fmt: skip
            self._inexact[row] = any(abs(value) > EXACT for value in last)
            self.deviation[row] = last

    def again(self, path_changes: Bools) -> Bools:
        """(N,) rows to be written for the sake of the row before; ``path_changes`` (N,): arcs planned otherwise."""
        arcs = np.zeros(len(path_changes), dtype=bool)
        known = [row for row in self.task.places.arcs if np.isfinite(self.task.path.arcs.sweep[row])]
        arcs[known] = True
        # Where an arc with CA ends follows from where it starts.
        before = np.zeros(len(path_changes), dtype=bool)
        before[1:] = self._inexact[:-1] & self.task.has_angle[1:]
        moves = path_changes | self.touched | before | (self.task.inserted > 0)
        return np.asarray(self.completed.any(axis=1) | self.renewed | (arcs & moves & ~self._refused))


def _deviation(components: Components, wanted: Floats, unchanged: Bools) -> Floats:
    """(K, 6) what is written less what the program had: zero where its literal stays."""
    scale = 10.0**components.decimals
    rounded = np.rint(wanted * scale) / scale
    return np.where(unchanged & (components.start >= 0), 0.0, _wrapped(rounded - components.own))


def _wrapped(difference: Floats) -> Floats:
    """(K, 6) differences of components, those of angles in [-180, 180)."""
    result = difference.copy()
    result[:, 3:] = (result[:, 3:] + 180.0) % 360.0 - 180.0
    return result
