"""An original program and what was written for it: where the tool goes along every cut.

The wrench belongs to the place of the original's path that the deflected tool is nearest to, cut by cut.  It is found
by marching along the cut: of all places near the last one at which the tool, under the wrench of that place, has the
path square to it, the nearest.  Then the equilibrium is solved again with that wrench and the place found again,
until neither moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path as File

import numpy as np
from scipy.spatial import cKDTree

from .cell import Cell
from .force import RULE, STRETCHED, Field
from .motion import MM, Motion
from .path import Path
from .placing import Tools, beside_neighbours, divided, find_places, nearest_across_leaps
from .reader import read
from .robot import Robot, check_on_mujoco, rotation_vectors, rotations

STEP = 1.0 * MM
SAGITTA = 2e-7
"""[m] How far a curve may be from the chords between its samples."""
WORST, PARTS, ROUNDS = 6, 16, 2
"""Places with the largest errors beside which is sampled again, in so many parts of the way to the next samples, and
how often."""
PEAK, PEAKS = 2e-8, 8
"""[m] The largest errors are sampled again until the largest grows by no more than this, so often at most: where the
path turns the error has an edge, beside which it falls by as much as the tool goes on."""
BACKWARDS = 2e-6
PASSED = 8.0 * MM
"""[m] How far along the path a place may be passed beside where the tool belongs to it: where a tool leaps over a
corner, it came near to that before."""
CORRECTIONS = 8
"""Rounds in which a target is corrected: each leaves less than a hundredth of what was off."""
MATCH = 1e-9
"""[m] to which every judged state that MuJoCo is asked for again has to agree."""


class NotComparable(ValueError):
    """The output has not the cuts of the original."""


@dataclass
class Run:
    """One program on the path of the original; arrays over the samples of all cuts.

    cut, motion, line: where the program is; place [m]: label on the original's path; error (S, 3) [m]: tool minus path,
    base axes; across, along (S,) [m]; way (S,) [m]: length of the program's path that a sample stands for;
    angle, axis (S,) [rad]: of the orientation and of the tool's axis; missed (C,) [m]: how
    far the farthest place of a cut's path stays from the tool's; stops, backwards: motions; unsettled: samples whose
    place was not found.
    """

    cut: np.ndarray
    motion: np.ndarray
    line: np.ndarray
    place: np.ndarray
    error: np.ndarray
    across: np.ndarray
    along: np.ndarray
    angle: np.ndarray
    axis: np.ndarray
    missed: np.ndarray
    way: np.ndarray
    stops: int = 0
    backwards: list[int] = field(default_factory=list)
    unsettled: int = 0
    mujoco: float = 0.0

    @property
    def distance(self) -> np.ndarray:
        return np.linalg.norm(self.error, axis=1)

    @property
    def largest(self) -> float:
        """[m] the largest distance of the tool from the path or of the path from the tool's."""
        return float(max(self.distance.max(initial=0.0), self.missed.max(initial=0.0)))

    def beyond(self, tolerance: float) -> float:
        """[m] of the program's path on which the tool is farther than ``tolerance`` from where it should be."""
        return float(self.way[self.distance > tolerance].sum())

    @property
    def rms(self) -> float:
        """[m] along the path."""
        return float(np.sqrt((self.way * (self.error**2).sum(1)).sum() / self.way.sum()))

    @property
    def worst_line(self) -> int:
        return int(self.line[self.distance.argmax()]) if len(self.line) else 0


@dataclass
class Verdict:
    """The original alone and the output, both along the original's path."""

    before: Run
    after: Run
    cell: Cell
    cuts: int
    motions: tuple[int, int]


def judge(
    original: File,
    output: File,
    cell_file: File,
    ramp: float | None = None,
    step: float = STEP,
    rule: str = RULE,
) -> Verdict:
    """Run ``original`` and ``output`` from their bytes; ``ramp`` [m] where the cell states none; rule: of the force."""
    cell = Cell.load(cell_file, ramp)
    robot = Robot.find(cell.robot, cell.folder)
    first, second = (Path(read(file, cell), robot, cell) for file in (original, output))
    cuts = cuts_of(first.motions)
    others = cuts_of(second.motions)
    if len(cuts) != len(others):
        raise NotComparable(f"{len(cuts)} cuts before, {len(others)} after")
    largest = max((np.linalg.norm(m.force[0][:3]) for m in first.motions if not m.air), default=0.0)
    correct = correction_along(first) if rule == STRETCHED else None
    fields = [Field(first, low, high, cell.ramp, largest, rule, correct) for low, high in cuts]
    nodes = second.joints_at_nodes()
    others = [
        _behind_lead(first, cut, second, rows, one, nodes)
        for cut, rows, one in zip(cuts, others, fields, strict=True)
    ]
    before = _run(first, cuts, first, cuts, fields, step)
    after = _run(first, cuts, second, others, fields, step)
    return Verdict(before, after, cell, len(cuts), (len(first.motions), len(second.motions)))


def correction_along(path: Path) -> Callable[[int, np.ndarray], np.ndarray]:
    """By how much (3,) [m] the target has to be moved where a motion begins, so that the tool is there under a wrench
    (6,) in base axes; as far as the text can state it, the tool's orientation is kept too."""
    labels, joints = path.joints_at_nodes()

    def correct(i: int, wrench: np.ndarray) -> np.ndarray:
        m = path.motions[i]
        guess = np.array([[np.interp(path.start[i], labels, joints[:, j]) for j in range(6)]])
        at, outside = np.array([i]), path.outside[i, :1]
        wanted, turned = path.in_robot(at, path.place[i, :1], path.turned[i, :1], outside)
        turns, _ = path.frames(at, outside)
        own = (turns[0] @ wrench.reshape(2, 3).T).T.reshape(1, 6)
        place, rotation, spindle = wanted.copy(), turned.copy(), turned[0] @ m.spindle
        for _ in range(CORRECTIONS):
            q = path.robot.settle(place, rotation, m.tool, guess)
            real, tilted, _ = path.robot.rest(q, own, m.tool)
            back = rotation_vectors(turned @ tilted.swapaxes(1, 2))
            back = back - {"any": 0.0, "axis": (back @ spindle) * spindle, "none": back}[m.turns]
            place, rotation = place + wanted - real, rotations(back) @ rotation
        return turns[0].T @ (place - wanted)[0]

    return correct


def cuts_of(motions: list[Motion]) -> list[tuple[int, int]]:
    """First and last motion of each run of motions under force."""
    air = np.array([True, *(m.air for m in motions), True])
    first = np.flatnonzero(air[:-1] & ~air[1:])
    last = np.flatnonzero(~air[:-1] & air[1:]) - 1
    return list(zip(first.tolist(), last.tolist(), strict=True))


def _behind_lead(
    wanted: Path, cut: tuple, path: Path, rows: tuple[int, int], force: Field, nodes: tuple
) -> tuple[int, int]:
    """The motions of a cut without a straight one that leads from where the original's cut starts to where the tool is
    there under its first force: the program has it after a jump or an arc in air, before the tool meets the material,
    though behind the comment that states the force."""
    low, high = rows
    start, digits = wanted.place[cut[0], 0], 2e-6
    if high - low <= cut[1] - cut[0] or path.motions[low].kind != "LIN":
        return rows
    if np.linalg.norm(path.place[low, 0] - start) > digits:
        return rows
    there = Tools(path, rows, path.start[low + 1 : low + 2], nodes).loaded(
        force.at(wanted.start[cut[0] : cut[0] + 1])
    )[0]
    return (low + 1, high) if np.linalg.norm(there - start) < wanted.cell.tolerance else rows


def _run(wanted: Path, cuts: list, path: Path, own: list, fields: list[Field], step: float) -> Run:
    labels, joints = path.joints_at_nodes()
    parts = [
        _along(wanted, cut, path, rows, one, (labels, joints), step) | {"cut": k}
        for k, (cut, rows, one) in enumerate(zip(cuts, own, fields, strict=True))
    ]
    if not parts:
        raise NotComparable("the program has no cut")
    joined = {
        key: np.concatenate([p[key] for p in parts])
        for key in ("motion", "place", "error", "across", "along", "way", "angle", "axis")
    }
    cut = np.repeat([p["cut"] for p in parts], [len(p["motion"]) for p in parts])
    lines = np.array([m.line for m in path.motions])
    return Run(
        cut=cut,
        line=lines[joined["motion"]],
        missed=np.array([p["missed"] for p in parts]),
        stops=sum(_stops(path, *rows) for rows in own),
        backwards=[int(lines[i]) for p in parts for i in p["backwards"]],
        unsettled=sum(p["unsettled"] for p in parts),
        mujoco=max(p["mujoco"] for p in parts),
        **joined,
    )


def _stops(path: Path, low: int, high: int) -> int:
    """Exact stops inside a cut: motions that end without approximation before the last one."""
    return sum(m.approximation == 0.0 for m in path.motions[low:high])


def sample_labels(path: Path, low: int, high: int, step: float) -> np.ndarray:
    """Labels along a cut: each motion and each approximated vertex in even steps, so small that the path is nowhere
    farther than ``SAGITTA`` from the line through them."""
    some = []
    for i in range(low, high + 1):
        fine = step
        if path.arc[i]:
            radius = np.linalg.norm(path.place[i, 0] - path.centre[i])
            fine = min(step, np.sqrt(8 * radius * SAGITTA))
        count = max(4, int(np.ceil(path.length[i] / fine)))
        some.append(path.start[i] + path.length[i] * np.arange(count + 1) / count)
    for i in range(low, high):
        reach = path.approximation[i]
        turn = path.tangent(np.array([i, i + 1]), np.array([1.0, 0.0]))
        bulge = 0.25 * reach * np.linalg.norm(turn[1] - turn[0])
        count = max(8, int(np.ceil(np.sqrt(bulge / SAGITTA))))
        some.append(path.start[i + 1] + reach * np.linspace(-1, 1, count + 1))
    ends = path.start[low], path.start[high + 1]
    return np.unique(np.clip(np.concatenate(some), *ends))


def _along(wanted: Path, cut: tuple, path: Path, rows: tuple, one: Field, nodes: tuple, step: float) -> dict:
    def at(label: np.ndarray) -> Tools:
        return Tools(path, rows, label, nodes)

    label = sample_labels(path, *rows, step)
    tools = at(label)
    place, lost = find_places(wanted, cut, one, label, tools)
    for _ in range(ROUNDS):
        distance = np.linalg.norm(tools.loaded(one.at(place))[0] - wanted.points(place, *cut), axis=1)
        more = np.union1d(_beside_worst(label, distance), _at_vertices(wanted, cut, label, place))
        more = np.setdiff1d(more, label)
        found = beside_neighbours(wanted, cut, one, (label, place), more, at(more))
        gone = np.isnan(found)
        unsettled = label[lost]
        label, place = np.append(label, more[~gone]), np.append(place, found[~gone])
        order = np.argsort(label, kind="stable")
        label, place = label[order], place[order]
        if path is not wanted:  # of the original alone nothing is judged
            label, place = divided(wanted, cut, one, label, place, at)
            place = nearest_across_leaps(wanted, cut, one, label, place, at)
            label, place = divided(wanted, cut, one, label, place, at)
        tools, lost = at(label), np.isin(label, unsettled)
    if path is not wanted:
        label, place = _to_peaks(wanted, cut, one, label, place, at)
        tools, lost = at(label), np.isin(label, unsettled)
    motion, _ = path.find(label, *rows)
    wrench = one.at(place)
    there, tilted, _ = tools.loaded(wrench)
    goal, straight, _ = wanted.at(place, *cut)
    error = there - goal
    tangent = wanted.direction(place, *cut)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    along = (error * tangent).sum(1)
    spindle = path.motions[rows[0]].spindle
    some = np.unique(
        np.append(np.linspace(0, len(label) - 1, 12).astype(int), np.argsort(-(error**2).sum(1))[:4])
    )
    agree = check_on_mujoco(path.robot, tools.q[some], tools.own(wrench)[some], tools.tool)
    if agree > MATCH:
        raise ArithmeticError(f"the judge's chain and MuJoCo differ by {agree:.1e} m")
    return {
        "motion": motion,
        "place": place,
        "error": error,
        "along": along,
        "way": np.gradient(label),
        "across": np.linalg.norm(error - along[:, None] * tangent, axis=1),
        "angle": np.linalg.norm(rotation_vectors(straight.swapaxes(1, 2) @ tilted), axis=1),
        "axis": _between(straight @ spindle, tilted @ spindle),
        "missed": _missed(wanted, cut, place, there),
        "backwards": _backwards(path, rows, motion, place, wanted, cut),
        "unsettled": int(lost.sum()),
        "mujoco": agree,
    }


def _to_peaks(
    wanted: Path, cut: tuple, one: Field, label: np.ndarray, place: np.ndarray, tools_at: Callable
) -> tuple[np.ndarray, np.ndarray]:
    """Labels and places (S,), with samples beside the largest errors, ever closer, until the largest stays."""
    distance = np.linalg.norm(tools_at(label).loaded(one.at(place))[0] - wanted.points(place, *cut), axis=1)
    for _ in range(PEAKS):
        more = np.setdiff1d(
            np.union1d(_beside_worst(label, distance), _at_vertices(wanted, cut, label, place)), label
        )
        tools = tools_at(more)
        found = beside_neighbours(wanted, cut, one, (label, place), more, tools)
        good, largest = np.isfinite(found), distance.max()
        found = np.where(good, found, place[0])
        off = np.linalg.norm(tools.loaded(one.at(found))[0] - wanted.points(found, *cut), axis=1)
        order = np.argsort(np.append(label, more[good]), kind="stable")
        label, place, distance = (
            np.append(old, new[good])[order] for old, new in ((label, more), (place, found), (distance, off))
        )
        if distance.max() <= largest + PEAK:
            break
    return label, place


def _beside_worst(label: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Labels between the samples ``label`` (S,) beside those that are farther off than their neighbours, the largest
    first: a peak between two samples is not seen by them."""
    beside = np.pad(distance, 1, constant_values=-1.0)
    peaks = np.flatnonzero((distance >= beside[:-2]) & (distance >= beside[2:]))
    worst = peaks[np.argsort(-distance[peaks], kind="stable")[:WORST]]
    start = np.unique(np.clip(np.concatenate([worst - 1, worst]), 0, len(label) - 2))
    parts = np.arange(1, PARTS) / PARTS
    return (label[start, None] + parts * (label[start + 1] - label[start])[:, None]).ravel()


def _at_vertices(wanted: Path, cut: tuple, label: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Labels at which the tool passes the vertices of the original's path: the force turns there, and the error with
    it, in a peak that may lie between two samples."""
    rising = np.maximum.accumulate(place)
    inner = wanted.start[cut[0] + 1 : cut[1] + 1]
    return np.interp(inner[(inner > rising[0]) & (inner < rising[-1])], rising, label)


def _between(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    return np.arctan2(np.linalg.norm(np.cross(one, two), axis=1), (one * two).sum(1))


def _missed(wanted: Path, cut: tuple, place: np.ndarray, there: np.ndarray) -> float:
    """[m] the largest distance of a place of the cut's path from the line of the tool's places: of those beside where
    it is passed, and of the nearest one, if it is no farther along the path than ``PASSED``."""
    ends = wanted.start[cut[0]], wanted.start[cut[1] + 1]
    label = np.unique(np.concatenate([sample_labels(wanted, *cut, STEP), np.asarray(ends)]))
    points = wanted.points(label, *cut)
    near = np.searchsorted(np.maximum.accumulate(place), label)
    nearest = cKDTree(there).query(points)[1]
    nearest = np.where(np.abs(place[nearest] - label) < PASSED, nearest, near)
    best = np.full(len(label), np.inf)
    for k in [near + shift for shift in range(-6, 6)] + [nearest - 1, nearest]:
        k = np.clip(k, 0, len(there) - 2)
        start, way = there[k], there[k + 1] - there[k]
        share = np.clip(((points - start) * way).sum(1) / np.maximum((way**2).sum(1), 1e-18), 0, 1)
        best = np.minimum(best, np.linalg.norm(points - start - share[:, None] * way, axis=1))
    return float(best.max())


def _backwards(
    path: Path, rows: tuple, motion: np.ndarray, place: np.ndarray, wanted: Path, cut: tuple
) -> list[int]:
    """Motions of a cut that lead against the feed of the original's path: where they begin, in their middle, at their
    end."""
    found = []
    first = np.searchsorted(motion, np.arange(rows[0], rows[1] + 2))
    for i in range(rows[0], rows[1] + 1):
        a, b = first[i - rows[0]], first[i - rows[0] + 1] - 1
        way = path.place[i, 1] - path.place[i, 0]
        if b <= a or path.arc[i]:
            continue
        feed = wanted.direction(place[[a, (a + b) // 2, b]], *cut)
        feed /= np.linalg.norm(feed, axis=1, keepdims=True)
        if (feed @ way < -BACKWARDS).all():
            found.append(i)
    return found
