"""Two programs simulated densely along their interpolated ways: where the tool is beside the path that was wanted.

It goes another way than the compensation: the programs are read from their files, their motions matched by where they
lead, sampled evenly along their length, and the force at a sample is that of the nearest place on the original path.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.blocks import each_block
from postproc.compensation.task import Task
from postproc.geometry import Poses, on_arc, rotation_from_vector, vector_from_rotation
from postproc.toolpath import Kind, Toolpath
from postproc.units import MM

STEP = 1.0 * MM
"""Distance of samples along a motion."""

LEAST = 5
"""Samples of a motion at least, its ends among them."""

STEPS = 4
"""Newton's steps to the place on the path that is nearest to the tool."""

STATES, LEAST_WIDTH = 50_000_000, 256
"""Numbers that the matching of motions keeps, and how many extra motions it holds in view at least."""

NEAR = 1e-4
"""[m] A motion that ends within this of where a motion of the original begins is a link to it."""

_WAY = (Kind.LIN, Kind.CIRC)


class Different(ValueError):
    """The second program does not make the motions of the first; ``line`` of the first program where it is seen."""

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(message)
        self.line = line


@dataclass(frozen=True)
class Simulation:
    """S samples of a program that runs in the place of the original.

    motion (S,): row of this program; row (S,): row of the original that it stands for; error (S, 3) [m]: predicted tool
    minus the nearest place of the wanted path, robot base axes, and in the axes of the programmed base; link (S,): the
    motion is a link; first, last (S,): first and last sample of a cut; force (S,) [N]; skipped: motions on cuts
    that are not simulated (splines, unknown places, out of reach).
    """

    motion: Ints
    row: Ints
    error: Floats
    error_in_base: Floats
    link: Bools
    first: Bools
    last: Bools
    force: Floats
    links: int
    link_length: float
    skipped: int

    @property
    def distance(self) -> Floats:
        """(S,) [m]"""
        return np.asarray(np.linalg.norm(self.error, axis=1))


def matched(original: Task, run: Task) -> Ints:
    """(N,) the row of ``run`` that ends where each row of ``original`` ends; raises Different.

    Jumps (PTP, axis motions) are matched in their order: nothing is inserted before them.  Between two of them the
    rows are matched in order so that the sum of the squared distances is least, each to where the row of ``original``
    ends or to where its deflection turned round would put that, whichever is nearer.
    """
    one, other = original.toolpath, run.toolpath
    jumps = [np.flatnonzero(np.isin(path.kind, _WAY, invert=True)) for path in (one, other)]
    if len(jumps[0]) != len(jumps[1]) or (one.kind[jumps[0]] != other.kind[jumps[1]]).any():
        raise Different("the two programs do not have the same jumps and other motions")
    found = np.full(len(one), -1)
    found[jumps[0]] = jumps[1]
    expected = _expected(original)
    bounds = zip(
        np.append(-1, jumps[0]), np.append(jumps[0], len(one)),
        np.append(-1, jumps[1]), np.append(jumps[1], len(other)), strict=True,
    )  # fmt: skip
    for a, b, c, d in bounds:
        more = (d - c) - (b - a)
        rows = np.arange(a + 1, b)
        if more < 0:
            raise Different(
                "the second program has fewer motions here", int(one.line[min(a + 1, len(one) - 1)])
            )
        if not len(rows):
            if more:
                raise Different(
                    "the second program has motions where the first has none", int(one.line[max(a, 0)])
                )
            continue
        found[rows] = (
            rows - a + c if not more else c + 1 + _alignment(original, expected, run, rows, c + 1, more)
        )
    return found


def _expected(original: Task) -> Floats:
    """(N, 3) [m] where a corrected row would about end: as far on the other side as the force moves the tool."""
    place = original.wanted[:].position.copy()
    rows = np.flatnonzero(original.carries & original.toolpath.known & (original.track.status >= 0))
    wanted = original.wanted[rows]
    real = original.real(rows, wanted, original.wrench[rows]).pose.position
    place[rows] -= np.nan_to_num(real - original.goal(rows, wanted).position)
    return place


def _alignment(original: Task, expected: Floats, run: Task, rows: Ints, begin: int, more: int) -> Ints:
    """(n,) which rows of ``run``, counted from ``begin``, end where ``rows`` (n,) end; ``more`` of them are extra, and
    the last one is not.

    Dynamic programming over the number of extra rows so far, of which no more than ``width`` are held in view at once:
    all of them but in very long programs.
    """
    n = len(rows)
    width = min(more + 1, max(LEAST_WIDTH, STATES // n))
    place, wanted = run.wanted[begin : begin + n + more].position, original.wanted[rows].position
    came, low = np.zeros((n, width), np.int32), np.zeros(n, np.int64)
    total, first = np.zeros(width), 0
    for i, row in enumerate(rows.tolist()):
        here = min(max(first, first + int(np.argmin(total)) - width // 4), more + 1 - width)
        goals = np.stack([wanted[i], expected[row]])
        away = place[i + here : i + here + width] - goals[:, None]
        cost = np.nan_to_num(np.einsum("gij,gij->gi", away, away).min(axis=0))
        best = np.minimum.accumulate(total)
        source = first + np.maximum.accumulate(np.where(total <= best, np.arange(width), 0))
        # what is in view now, from what was in view before: the best with no more extra rows
        seen = np.minimum(np.arange(here, here + width) - first, width - 1)
        came[i], low[i] = source[seen], here
        total, first = best[seen] + cost, here
    offset, at = np.empty(n, np.int64), more
    for i in range(n - 1, -1, -1):
        offset[i] = at
        at = int(came[i, at - low[i]])
    return np.arange(n) + offset


def simulate(original: Task, run: Task, match: Ints, step: float = STEP) -> Simulation:
    """The tool along the ways of ``run`` on the cuts of ``original``; ``match`` as of ``matched``."""
    owner = _owners(match, len(run.toolpath))
    ways = run.ways
    wanted = original.carries if original.process else np.isin(original.toolpath.kind, _WAY)
    inside = (owner >= 0) & wanted[np.maximum(owner, 0)]
    can = (
        ways.known
        & original.ways.known[np.maximum(owner, 0)]
        & (original.track.status[np.maximum(owner, 0)] >= 0)
    )
    rows = np.flatnonzero(inside & can)
    count = np.maximum(LEAST, np.ceil(ways.length[rows] / step).astype(np.int64) + 1)
    motion = np.repeat(rows, count)
    number = np.arange(len(motion)) - np.repeat(np.cumsum(count) - count, count)
    share = number / (np.repeat(count, count) - 1)
    row = owner[motion]
    # The motions that stand for one of the original share its way, about evenly.
    begin = np.append(0, match[:-1] + 1)
    guess = (motion - begin[row] + share) / (match[row] - begin[row] + 1)

    goes_on = ~original.force.steps & original.ways.known & original.carries
    goes_on &= np.append(False, original.carries[:-1])
    error, nearest, force = np.empty((len(motion), 3)), np.empty(len(motion)), np.empty(len(motion))

    def looked(part: slice) -> None:
        error[part], nearest[part], force[part] = _beside(
            original, run, goes_on, motion[part], row[part], share[part], guess[part]
        )

    each_block(looked, len(motion))
    at_end = number + 1 == np.repeat(count, count)
    is_link = _links(original, run, rows, owner, nearest[at_end])
    seen = np.isfinite(error[:, 0])
    link = is_link[np.searchsorted(rows, motion)]
    first, last = _cut_ends(original, row, link)
    in_base = np.einsum("nji,nj->ni", original.base.rotation[row], error)
    return Simulation(
        motion[seen],
        row[seen],
        error[seen],
        in_base[seen],
        link[seen],
        first[seen],
        last[seen],
        force[seen],
        int(is_link.sum()),
        float(ways.length[rows[is_link]].sum()),
        int(inside.sum()) - len(np.unique(motion[seen])),
    )


def _owners(match: Ints, count: int) -> Ints:
    """(M,) the original row that each row of a program stands for: the next one that ends with it or later."""
    owner = np.full(count, -1)
    owner[match] = np.arange(len(match))
    later = np.minimum.accumulate(np.where(owner >= 0, owner, len(match))[::-1])[::-1]
    return np.where(later < len(match), later, -1)


def _beside(
    original: Task, run: Task, goes_on: Bools, motion: Ints, row: Ints, share: Floats, guess: Floats
) -> tuple[Floats, Floats, Floats]:
    """The tool (S, 3) [m] beside the wanted path, the share (S,) of the original's motion ``row`` (S,) where it is
    nearest, and the force (S,) [N] there.  ``goes_on`` (N,): the cut and its force go on from the motion before."""
    command = _sampled(run, motion, share)
    error, at, force = _nearest(original, row, command, guess)
    # A tool that is a little ahead of an end may already be on the way of the next motion, or still on the one before.
    for end, other in ((1.0, 1), (0.0, -1)):
        vertex = row + (other == 1)  # the motion that begins where the two meet
        some = np.flatnonzero((at == end) & (vertex < len(goes_on)))
        some = some[goes_on[vertex[some]]]
        if len(some):
            there, _, _ = _nearest(original, row[some] + other, command[some], np.full(len(some), 1.0 - end))
            closer = np.linalg.norm(there, axis=1) < np.linalg.norm(error[some], axis=1)
            error[some[closer]] = there[closer]
    return error, at, force


def _nearest(original: Task, row: Ints, command: Poses, guess: Floats) -> tuple[Floats, Floats, Floats]:
    """As ``_beside``, of the ways of ``row`` (S,) alone, with the controller sent to ``command`` (S)."""
    length = np.maximum(original.ways.length[row], 1e-9)
    at = np.clip(_projected(original, row, command.position, guess), 0.0, 1.0)
    error = np.full((len(row), 3), np.nan)
    for step in range(STEPS):
        wrench = original.force.along(row, at)
        real = original.real(row, command, wrench)
        goal = original.goal(row, _sampled(original, row, at)).position
        error = np.where((real.reachable & real.settled)[:, None], real.pose.position - goal, np.nan)
        ahead = np.sum(error * original.ways.tangent(row, at), axis=1) / length
        if step < STEPS - 1:
            at = np.clip(at + np.nan_to_num(ahead), 0.0, 1.0)
    # What is left ahead of the last step is beside nothing, but at the ends of a motion it may be.
    inside = (at > 0.0) & (at < 1.0)
    along = original.ways.tangent(row, at)
    error = np.where(inside[:, None], error - np.sum(error * along, axis=1, keepdims=True) * along, error)
    return error, at, np.linalg.norm(original.force.along(row, at)[:, :3], axis=1)


def _sampled(task: Task, rows: Ints, share: Floats) -> Poses:
    """Programmed poses (S) at the shares of motions, as a controller interpolates them."""
    ways = task.ways
    begin, end = ways.begin[rows], ways.end[rows]
    turn = vector_from_rotation(np.swapaxes(begin.rotation, -1, -2) @ end.rotation)
    rotation = begin.rotation @ rotation_from_vector(share[:, None] * turn)
    position = begin.position + share[:, None] * (end.position - begin.position)
    bent = np.flatnonzero(ways.arc[rows])
    at = rows[bent]
    position[bent] = on_arc(
        begin.position[bent],
        end.position[bent],
        *ways.circles(at),
        share[bent],
    )
    return Poses(rotation, position)


def _projected(task: Task, rows: Ints, place: Floats, guess: Floats) -> Floats:
    """(S,) the share of the ways of ``rows`` that is nearest to ``place`` (S, 3), not bounded; of the turns of an arc
    the one nearest to ``guess`` (S,)."""
    ways = task.ways
    begin = ways.begin[rows].position
    step = ways.end[rows].position - begin
    square = np.maximum(np.sum(step**2, axis=1), 1e-18)
    share = np.sum((place - begin) * step, axis=1) / square
    bent = np.flatnonzero(ways.arc[rows])
    at = rows[bent]
    centre, normal, sweep = ways.circles(at)
    out, here = begin[bent] - centre, place[bent] - centre
    angle = np.arctan2(
        np.sum(np.cross(out, here) * normal, axis=1),
        np.sum(out * (here - np.sum(here * normal, axis=1, keepdims=True) * normal), axis=1),
    )
    angle += 2 * np.pi * np.round((guess[bent] * sweep - angle) / (2 * np.pi))
    share[bent] = angle / sweep
    return share


def _links(original: Task, run: Task, rows: Ints, owner: Ints, at_end: Floats) -> Bools:
    """(R,) motions of ``run`` that lead to where the original's motion begins, and no further."""
    extra = np.append(owner[1:] == owner[:-1], False)  # another one of the same original motion follows
    return extra[rows] & (at_end * original.ways.length[owner[rows]] < NEAR)


def _cut_ends(original: Task, row: Ints, link: Bools) -> tuple[Bools, Bools]:
    """First and last sample of each cut, links apart."""
    carries = original.carries
    number = np.cumsum(carries & ~np.append(False, carries[:-1]))
    cut = np.where(link, -1, number[row])
    place = np.flatnonzero(cut >= 0)
    first, last = np.zeros(len(row), bool), np.zeros(len(row), bool)
    if len(place):
        change = np.flatnonzero(np.diff(cut[place])) + 1
        first[place[np.append(0, change)]] = True
        last[place[np.append(change - 1, len(place) - 1)]] = True
    return first, last


def worst_places(
    simulation: Simulation, path: Toolpath, count: int = 10
) -> list[tuple[int, float, str, float]]:
    """line, error [m], axis of the base along which it is largest, force [N] of the motions with the largest errors."""
    distance = np.where(simulation.link, -1.0, simulation.distance)
    found: list[tuple[int, float, str, float]] = []
    seen: set[int] = set()
    for sample in np.argsort(-distance, kind="stable"):
        motion = int(simulation.motion[sample])
        if distance[sample] < 0 or len(found) == count:
            break
        if motion not in seen:
            seen.add(motion)
            axis = "XYZ"[int(np.argmax(np.abs(simulation.error_in_base[sample])))]
            found.append(
                (int(path.line[motion]), float(distance[sample]), axis, float(simulation.force[sample]))
            )
    return found
