"""A third opinion on how far a written program's tool is off the wanted path, by brute force.

``python -m tests.judge --third yes ...`` has it as a further column.  The error, as the documents state it: the force
belongs to the place s on the wanted path g that the *deflected* tool is beside, and it is that force F(s) which
deflects the tool x of the command c,

    (x(c, F(s)) - g(s)) . g'(s) = 0,  from ahead to behind as s grows,

and |x - g| is the error.  Of several such places the nearest to the tool counts.  The largest error is the least upper
bound along the commands: where the place leaps, both sides of the leap count.

Here the wanted path is a set of points, so dense that nothing has to be looked for: at every one of them within a
window the tool of every command is put under the force of that point, and all changes of sign are places.  There is no
guess but the window, no grid of displacements, no linear tool, no fixed point.  What a path, a force and a loaded tool
are is asked of the judge's reader, force and chain, about which ``verify`` and the judge agree; the places are its
own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as File

import numpy as np

from .cell import Cell
from .force import RULE, STRETCHED, Field
from .judge import correction_along, cuts_of
from .motion import MM
from .path import Path
from .reader import read
from .robot import Robot

STEP, POINT, FINE, MANY = 0.1 * MM, 0.02 * MM, 1e-6, 100
"""[m] Of the commands, of the wanted path's points, and of so many of these to either side of the places of two
commands that have another one put between them."""
BATCH, HALVINGS = 16, 26
LEAP = 0.01 * MM
"""By how much more than the command a place may go on between two commands without a look at those between."""
NEAREST = 1e-8
"""[m] Commands that are so near to each other are the two sides of a leap."""
WORST, PARTS, ROUNDS = 6, 16, 2


@dataclass
class Places:
    """label (S,) of commands, place (S,) on the wanted path, distance (S,) [m] of the tool from it."""

    label: np.ndarray
    place: np.ndarray
    distance: np.ndarray

    def joined(self, other: Places) -> Places:
        order = np.argsort(np.append(self.label, other.label), kind="stable")
        keys = ("label", "place", "distance")
        return Places(*(np.append(getattr(self, k), getattr(other, k))[order] for k in keys))


class Cut:
    """One cut of the wanted path, and the same cut of the program."""

    def __init__(self, wanted: Path, cut: tuple, path: Path, rows: tuple, force: Field, nodes: tuple) -> None:
        self.wanted, self.cut, self.path, self.rows, self.force, self.nodes = (
            wanted,
            cut,
            path,
            rows,
            force,
            nodes,
        )
        self.low, self.high = wanted.start[cut[0]], wanted.start[cut[1] + 1]
        self.points = self._dense(wanted, cut, POINT)

    @staticmethod
    def _dense(path: Path, cut: tuple, step: float) -> np.ndarray:
        """Labels of a cut in even steps, on both sides of each vertex, and along its parabola."""
        low, high = path.start[cut[0]], path.start[cut[1] + 1]
        vertices = path.start[cut[0] : cut[1] + 2]
        some = [np.linspace(low, high, int((high - low) / step) + 2), vertices - 1e-7, vertices + 1e-7]
        for i in range(cut[0], cut[1]):
            some.append(path.start[i + 1] + path.approximation[i] * np.linspace(-1, 1, 65))
        return np.unique(np.clip(np.concatenate(some), low, high))

    def _tool(self, label: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where commands at labels (S,) are, and their tools under the forces of ``place`` (S,): (S, 3) [m] each."""
        single, own = np.unique(label, return_inverse=True)
        motion, _ = self.path.find(single, *self.rows)
        position, rotation, outside = self.path.at(single, *self.rows)
        command, turned = self.path.in_robot(motion, position, rotation, outside)
        guess = np.stack([np.interp(single, self.nodes[0], self.nodes[1][:, j]) for j in range(6)], axis=1)
        tool = self.path.motions[self.rows[0]].tool
        q = self.path.robot.settle(command, turned, tool, guess)[own]
        turns, places = (v[own] for v in self.path.frames(motion, outside))
        wrench = (self.force.at(place).reshape(-1, 2, 3) @ turns.swapaxes(1, 2)).reshape(-1, 6)
        there = np.einsum("kji,kj->ki", turns, self.path.robot.rest(q, wrench, tool)[0] - places)
        return position[own], there

    def ahead(self, label: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far (S,) [m] the tools of commands at labels (S,) are ahead of ``place`` (S,) under the force there, and
        how far off (S,)."""
        error = self._tool(label, place)[1] - self.wanted.points(place, *self.cut)
        return (error * self.wanted.direction(place, *self.cut)).sum(1), np.linalg.norm(error, axis=1)

    def candidates(self, label: np.ndarray, points: list) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of commands (S,) all places among the labels ``points`` of each: numbers (C,) of the commands, places,
        distances [m]."""
        owner, at = np.repeat(np.arange(len(label)), [len(p) for p in points]), np.concatenate(points)
        ahead, _ = self.ahead(label[owner], at)
        k = np.flatnonzero((ahead[:-1] > 0) & (ahead[1:] <= 0) & (owner[:-1] == owner[1:]))
        row, a, b = owner[k], at[k], at[k + 1]
        for _ in range(HALVINGS):
            middle = 0.5 * (a + b)
            first = self.ahead(label[row], middle)[0] > 0
            a, b = np.where(first, middle, a), np.where(first, b, middle)
        k = np.flatnonzero(((at == self.low) & (ahead <= 0)) | ((at == self.high) & (ahead > 0)))
        row, place = np.append(row, owner[k]), np.append(0.5 * (a + b), at[k])
        return row, place, self.ahead(label[row], place)[1]

    def nearest(self, label: np.ndarray, about: np.ndarray, window: float, fine: bool = False) -> Places:
        """Of commands (S,) the nearest place no farther than ``window`` [m] from those ``about`` (S, 2); ``fine``: with
        points ``FINE`` about these."""
        found = []
        for first in range(0, len(label), BATCH):
            part = slice(first, first + BATCH)
            points = []
            for sides in about[part]:
                low, high = np.searchsorted(self.points, [sides.min() - window, sides.max() + window])
                near = self.points[low:high]
                if fine:
                    more = np.concatenate([one + np.arange(-MANY, MANY + 1) * FINE for one in sides])
                    near = np.unique(np.append(near, more[(more >= near[0]) & (more <= near[-1])]))
                points.append(near)
            row, place, distance = self.candidates(label[part], points)
            order = np.lexsort((distance, row))
            best = order[np.append(True, row[order][1:] != row[order][:-1])[: len(order)]]
            found.append(np.stack([label[part][row[best]], place[best], distance[best]]))
        return Places(*np.concatenate(found, axis=1)) if found else Places(*np.zeros((3, 0)))

    def run(self) -> Places:
        label = self._dense(self.path, self.rows, STEP)
        some = np.linspace(label[0], label[-1], 50)
        free, there = self._tool(some, self.low + (some - label[0]) / np.ptp(label) * (self.high - self.low))
        window = 2.0 * MM + 1.5 * float(np.linalg.norm(there - free, axis=1).max())
        found, last = Places(*np.zeros((3, 0))), self.low
        for first in range(0, len(label), BATCH):
            part = label[first : first + BATCH]
            more = self.nearest(part, last + np.subtract.outer(part - part[0], [0.0, 0.0]), window)
            found = found.joined(more)
            last = more.place[-1] if len(more.place) else last
        for _ in range(ROUNDS):
            found = self._beside_worst(self._across_leaps(found, window), window)
        return self._across_leaps(found, window)

    def _about(self, found: Places, label: np.ndarray, window: float) -> Places:
        """With the places of further commands, which are between those that are there."""
        k = np.clip(np.searchsorted(found.label, label), 1, len(found.label) - 1)
        about = np.stack([found.place[k - 1], found.place[k]], axis=1)
        return found.joined(self.nearest(label, about, window, fine=True))

    def _across_leaps(self, found: Places, window: float) -> Places:
        """Commands between those whose places are apart, by halves, until they are two sides of a leap."""
        while True:
            step = np.diff(found.label)
            k = np.flatnonzero((np.abs(np.diff(found.place)) > 2 * step + LEAP) & (step > NEAREST))
            if not len(k):
                return found
            found = self._about(found, 0.5 * (found.label[k] + found.label[k + 1]), window)

    def _beside_worst(self, found: Places, window: float) -> Places:
        beside = np.pad(found.distance, 1, constant_values=-1.0)
        peaks = np.flatnonzero((found.distance >= beside[:-2]) & (found.distance >= beside[2:]))
        worst = peaks[np.argsort(-found.distance[peaks], kind="stable")[:WORST]]
        start = np.unique(np.clip(np.append(worst - 1, worst), 0, len(found.label) - 2))
        start = start[np.diff(found.label)[start] > 100 * NEAREST]
        parts = np.arange(1, PARTS) / PARTS
        more = found.label[start, None] + parts * (found.label[start + 1] - found.label[start])[:, None]
        return self._about(found, more.ravel(), window)


def third(original: File, output: File, cell_file: File) -> tuple[float, int, list[Places]]:
    """[m] the largest error of ``output``, its line there, and the places of each cut."""
    cell = Cell.load(cell_file)
    robot = Robot.find(cell.robot, cell.folder)
    first, second = (Path(read(file, cell), robot, cell) for file in (original, output))
    largest = max((np.linalg.norm(m.force[0][:3]) for m in first.motions if not m.air), default=0.0)
    correct = correction_along(first) if RULE == STRETCHED else None
    nodes, every, worst, line = second.joints_at_nodes(), [], 0.0, 0
    for cut, rows in zip(cuts_of(first.motions), cuts_of(second.motions), strict=True):
        force = Field(first, *cut, cell.ramp, largest, RULE, correct)
        every.append(Cut(first, cut, second, rows, force, nodes).run())
        k = int(np.argmax(every[-1].distance))
        if every[-1].distance[k] > worst:
            worst = float(every[-1].distance[k])
            line = second.motions[int(second.find(every[-1].label[k : k + 1], *rows)[0][0])].line
    return worst, line, every
