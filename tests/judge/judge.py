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

from .cell import Cell
from .force import CENTRED, STRETCHED, Field
from .motion import MM, Motion
from .path import Path
from .reader import read
from .robot import Robot, check_on_mujoco, rotation_vectors

STEP = 1.0 * MM
SAGITTA = 2e-7
"""[m] How far a curve may be from the chords between its samples."""
GRID, POINTS = 0.02 * MM, 50_000
"""Steps in which places are looked for, larger where a cut would have more of them."""
NEARBY = 5.0 * MM
"""A tool this far from the path counts, along a stretch of it, as much as a jump along the path of the same length."""
MARCHES, ROUNDS, BESIDE = 3, 8, 6
REACHES, CLOSE = (1.1, 3.3, 10.0, 30.0, 100.0), (0.5, 3.0, 10.0)
"""Steps of the grid to either side in which a place is looked for again, one after the other."""
SETTLED = 1e-10
BACKWARDS = 2e-6
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
    rule: str = CENTRED,
) -> Verdict:
    """Run ``original`` and ``output`` from their bytes; ``ramp`` [m] where the cell states none; rule: of the force."""
    cell = Cell.load(cell_file, ramp)
    robot = Robot.find(cell.robot, cell.folder)
    first, second = (Path(read(file, cell), robot, cell) for file in (original, output))
    cuts = _cuts(first.motions)
    others = _cuts(second.motions)
    if len(cuts) != len(others):
        raise NotComparable(f"{len(cuts)} cuts before, {len(others)} after")
    largest = max((np.linalg.norm(m.force[0][:3]) for m in first.motions if not m.air), default=0.0)
    deflect = _deflection(first) if rule == STRETCHED else None
    fields = [Field(first, low, high, cell.ramp, largest, rule, deflect) for low, high in cuts]
    before = _run(first, cuts, first, cuts, fields, step)
    after = _run(first, cuts, second, others, fields, step)
    return Verdict(before, after, cell, len(cuts), (len(first.motions), len(second.motions)))


def _deflection(path: Path) -> Callable[[int, np.ndarray], np.ndarray]:
    """How far (3,) [m] the tool gives way where a motion begins, under a wrench (6,) in base axes."""
    labels, joints = path.joints_at_nodes()

    def deflect(i: int, wrench: np.ndarray) -> np.ndarray:
        q = np.array([[np.interp(path.start[i], labels, joints[:, j]) for j in range(6)]])
        turns, _ = path.frames(np.array([i]), path.outside[i, :1])
        own = (turns[0] @ wrench.reshape(2, 3).T).T.reshape(1, 6)
        tool = path.motions[i].tool
        return turns[0].T @ (path.robot.rest(q, own, tool)[0][0] - path.robot.chain(q, tool)[0][0])

    return deflect


def _cuts(motions: list[Motion]) -> list[tuple[int, int]]:
    """First and last motion of each run of motions under force."""
    air = np.array([True, *(m.air for m in motions), True])
    first = np.flatnonzero(air[:-1] & ~air[1:])
    last = np.flatnonzero(~air[:-1] & air[1:]) - 1
    return list(zip(first.tolist(), last.tolist(), strict=True))


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


def _samples(path: Path, low: int, high: int, step: float) -> np.ndarray:
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
    robot = path.robot
    label = _samples(path, *rows, step)
    motion, _ = path.find(label, *rows)
    tool = path.motions[rows[0]].tool
    position, rotation, outside = path.at(label, *rows)
    command, turned = path.in_robot(motion, position, rotation, outside)
    guess = np.stack([np.interp(label, nodes[0], nodes[1][:, j]) for j in range(6)], axis=1)
    q = robot.settle(command, turned, tool, guess)
    turns, places = path.frames(motion, outside)
    to_base = turns.swapaxes(1, 2)  # from the robot's axes to the base's

    def loaded(wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tool (S, 3), (S, 3, 3) in the base and its compliance (S, 3, 6) under wrenches (S, 6) in base axes."""
        own = (wrench.reshape(-1, 2, 3) @ to_base).reshape(-1, 6)
        place, tilted, compliance = robot.rest(q, own, tool)
        gives = np.concatenate([to_base @ compliance[:, :3, k : k + 3] @ turns for k in (0, 3)], axis=2)
        return np.einsum("kij,kj->ki", to_base, place - places), to_base @ tilted, gives

    low, high = wanted.start[cut[0]], wanted.start[cut[1] + 1]
    share = (label - label[0]) / max(label[-1] - label[0], 1e-12)
    wrench = one.at(low + share * (high - low))
    for _ in range(MARCHES):
        there, tilted, gives = loaded(wrench)
        place = _march(wanted, cut, one, label, there, wrench, gives)
        place, lost = _settled(wanted, cut, one, place, loaded)
        if not lost.any():
            break
        wrench = one.at(place)
    there, tilted, gives = loaded(one.at(place))
    # beside a corner places may have been looked for on the wrong side: those between the good ones are others
    away = np.linalg.norm(there - wanted.points(place, *cut), axis=1)
    near = np.lib.stride_tricks.sliding_window_view(np.pad(away, BESIDE, mode="edge"), 2 * BESIDE + 1)
    good = ~lost & (away <= 2.0 * np.median(near, axis=1) + 1e-7)
    between = np.interp(label, label[good], place[good]) if good.any() else place
    other, still = _settled(wanted, cut, one, between, loaded, CLOSE)
    nearer = ~still & (
        lost | (np.linalg.norm(loaded(one.at(other))[0] - wanted.points(other, *cut), axis=1) < away)
    )
    place, lost = np.where(nearer, other, place), lost & ~nearer
    wrench = one.at(place)
    there, tilted, gives = loaded(wrench)
    goal, straight, _ = wanted.at(place, *cut)
    error = there - goal
    tangent = wanted.direction(place, *cut)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    along = (error * tangent).sum(1)
    spindle = path.motions[rows[0]].spindle
    own = (wrench.reshape(-1, 2, 3) @ to_base).reshape(-1, 6)
    some = np.unique(
        np.append(np.linspace(0, len(q) - 1, 12).astype(int), np.argsort(-(error**2).sum(1))[:4])
    )
    agree = check_on_mujoco(robot, q[some], own[some], tool)
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


def _settled(
    wanted: Path, cut: tuple, one: Field, place: np.ndarray, loaded: Callable, reaches: tuple = REACHES
) -> tuple[np.ndarray, np.ndarray]:
    """Labels (S,) near ``place`` at which the tool, under the wrench of that place, has the path square to it, and
    which were not found; ``loaded``: wrenches to the tool and its compliance."""
    for _ in range(ROUNDS):
        wrench = one.at(place)
        there, _, gives = loaded(wrench)
        found, lost = _refined(wanted, cut, one, place, there, wrench, gives, reaches)
        moved, place = np.abs(found - place).max(), found
        if moved < SETTLED:
            break
    return place, lost


def _between(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    return np.arctan2(np.linalg.norm(np.cross(one, two), axis=1), (one * two).sum(1))


def _march(
    wanted: Path,
    cut: tuple,
    one: Field,
    label: np.ndarray,
    there: np.ndarray,
    wrench: np.ndarray,
    gives: np.ndarray,
) -> np.ndarray:
    """(S,) labels, on a grid, that the tool passes in turn.

    At each sample the places in a window at which the path is square to the way to the tool are candidates.  Of all
    ways through them that is taken which is nearest to the tool, and which goes on along the path as the program goes
    on: a path that comes back the same way is not taken for its first leg again."""
    low, high = wanted.start[cut[0]], wanted.start[cut[1] + 1]
    grid = np.linspace(low, high, min(max(int((high - low) / GRID), 8), POINTS) + 1)
    points, forces = wanted.points(grid, *cut), one.at(grid)
    tangents = wanted.direction(grid, *cut)
    free = there - np.einsum("kij,kj->ki", gives, wrench)
    reach = np.linalg.norm(np.einsum("kij,kj->ki", gives, wrench), axis=1).max()
    ahead = np.append(0.0, np.diff(label))
    size = grid[1] - grid[0]
    window, last, farthest = int((1.5 * reach + 2 * MM) / size) + 2, 0, 0
    steps = (ahead * 1.5 / size).astype(int) + 2 * window
    candidates, costs = [], []
    for k in range(len(label)):
        a, b = max(farthest - window, 0), min(last + steps[k], len(grid) - 1) + 1
        beside = free[k] + forces[a:b] @ gives[k].T - points[a:b]
        ahead_of = np.einsum("ij,ij->i", beside, tangents[a:b])
        square = np.einsum("ij,ij->i", beside, beside)
        here = np.flatnonzero((ahead_of[:-1] > 0) & (ahead_of[1:] <= 0))
        here = np.where(square[here] < square[here + 1], here, here + 1)
        if a == 0 and ahead_of[0] <= 0:
            here = np.append(here, 0)
        if b == len(grid) and ahead_of[-1] >= 0:
            here = np.append(here, len(square) - 1)
        if not len(here):
            here = np.array([square.argmin()])
        last = a + int(here[square[here].argmin()])
        farthest = max(farthest, last)
        candidates.append(a + here)
        costs.append(square[here] * (max(ahead[k], 0.1 * MM) / NEARBY**2))
    return grid[_cheapest(candidates, costs, ahead / size, size)]


def _cheapest(candidates: list, costs: list, ahead: np.ndarray, size: float) -> np.ndarray:
    """One candidate of each sample, so that the sum of ``costs`` and of what they are off the program's own steps
    ``ahead`` (S,), in grid steps of ``size`` [m], is least."""
    total, came = costs[0] + candidates[0] * size, []
    for k in range(1, len(candidates)):
        if len(candidates[k]) == 1 and len(candidates[k - 1]) == 1:
            came.append(np.zeros(1, int))
            total = costs[k]
            continue
        off = np.abs(candidates[k][:, None] - candidates[k - 1] - ahead[k]) * size + total
        came.append(off.argmin(1))
        total = costs[k] + off.min(1)
    chosen = [int(total.argmin())]
    for back in reversed(came):
        chosen.append(int(back[chosen[-1]]))
    return np.array([c[i] for c, i in zip(candidates, reversed(chosen), strict=True)])


def _refined(
    wanted: Path,
    cut: tuple,
    one: Field,
    place: np.ndarray,
    there: np.ndarray,
    wrench: np.ndarray,
    gives: np.ndarray,
    reaches: tuple,
) -> tuple[np.ndarray, np.ndarray]:
    """The labels (S,) near ``place`` at which the path is square to the way to the tool, by bisection and
    secants; which were not found."""
    ends = wanted.start[cut[0]], wanted.start[cut[1] + 1]
    size = max(GRID, (ends[1] - ends[0]) / POINTS)

    def ahead_of(rows: np.ndarray, at: np.ndarray) -> np.ndarray:
        tool = there[rows] + np.einsum("kij,kj->ki", gives[rows], one.at(at) - wrench[rows])
        return ((tool - wanted.points(at, *cut)) * wanted.direction(at, *cut)).sum(1)

    rows = np.arange(len(place))
    a, b = place.copy(), place.copy()
    fa, fb = np.zeros(len(rows)), np.zeros(len(rows))
    lost = np.ones(len(rows), bool)
    for reach in reaches:
        some = np.flatnonzero(lost)
        a[some], b[some] = (np.clip(place[some] + side * reach * size, *ends) for side in (-1, 1))
        fa[some], fb[some] = ahead_of(some, a[some]), ahead_of(some, b[some])
        lost = ((fa <= 0) & (a > ends[0])) | ((fb >= 0) & (b < ends[1]))
    found = np.where(fa <= 0, a, b)
    rows = np.flatnonzero((fa > 0) & (fb < 0))
    a, b, fa, fb = a[rows], b[rows], fa[rows], fb[rows]
    for turn in range(60):
        if not len(rows):
            break
        middle = 0.5 * (a + b) if turn % 3 == 2 else a + (b - a) * fa / (fa - fb)
        f = ahead_of(rows, middle)
        found[rows] = middle
        done = (np.abs(f) < 1e-13) | (b - a < 1e-12)
        left = f > 0
        a, fa = np.where(left, middle, a), np.where(left, f, fa)
        b, fb = np.where(left, b, middle), np.where(left, fb, f)
        rows, a, b, fa, fb = (v[~done] for v in (rows, a, b, fa, fb))
    return found, lost


def _missed(wanted: Path, cut: tuple, place: np.ndarray, there: np.ndarray) -> float:
    """[m] the largest distance of a place of the cut's path from the line of the tool's places."""
    ends = wanted.start[cut[0]], wanted.start[cut[1] + 1]
    label = np.unique(np.concatenate([_samples(wanted, *cut, STEP), np.asarray(ends)]))
    points = wanted.points(label, *cut)
    near = np.searchsorted(np.maximum.accumulate(place), label)
    best = np.full(len(label), np.inf)
    for shift in range(-6, 6):
        k = np.clip(near + shift, 0, len(there) - 2)
        start, way = there[k], there[k + 1] - there[k]
        share = np.clip(((points - start) * way).sum(1) / np.maximum((way**2).sum(1), 1e-18), 0, 1)
        best = np.minimum(best, np.linalg.norm(points - start - share[:, None] * way, axis=1))
    return float(best.max())


def _backwards(
    path: Path, rows: tuple, motion: np.ndarray, place: np.ndarray, wanted: Path, cut: tuple
) -> list[int]:
    """Motions of a cut that lead against the feed of the original's path, where they begin and where they end."""
    found = []
    first = np.searchsorted(motion, np.arange(rows[0], rows[1] + 2))
    for i in range(rows[0], rows[1] + 1):
        a, b = first[i - rows[0]], first[i - rows[0] + 1] - 1
        way = path.place[i, 1] - path.place[i, 0]
        if b <= a or path.arc[i]:
            continue
        feed = wanted.direction(place[[a, b]], *cut)
        feed /= np.linalg.norm(feed, axis=1, keepdims=True)
        if (feed @ way < -BACKWARDS).all():
            found.append(i)
    return found
