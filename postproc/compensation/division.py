"""What is inserted so that the way between corrected points is right too: links where the correction steps, and
points where a straight or round way between two of them would leave the tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.compensation.between import Pieces, errors_between
from postproc.compensation.correct import Result, correct
from postproc.compensation.mirror import partly
from postproc.compensation.task import Task
from postproc.compensation.ways import begins
from postproc.findings import Finding
from postproc.geometry import Poses
from postproc.toolpath import Kind, Role
from postproc.units import DEG, MM

ROOM = 0.9
"""Share of the tolerance that the way between points may take: written digits take a part of the rest."""

STEP = 0.1
"""Share of the tolerance by which the correction may step without a look at what that does to the way behind it."""

WIDEST = 300 * DEG
"""An arc that turns further is divided: the moved end of a nearly full circle could lie on the wrong side."""

SAME = 1e-9
"""[m] Points that are nearer are one."""

_ORDER = {False: 2.0, True: 3.0}
"""The error between points of a straight piece falls with the square of its length, that of an arc through three
points with the third power at least; where to look first for the number that is enough."""


@dataclass(frozen=True)
class Limits:
    """What may be inserted.  keep: nothing; min_segment [m]: no piece is shorter; max_growth: the output has at most
    so many times the motions of the input."""

    keep: bool = False
    min_segment: float = 1.0 * MM
    max_growth: float = 2.0


@dataclass(frozen=True)
class Division:
    """M motions of the output for the N of the input, see ``Plan``.

    source, role (M,); share (M,): of the source's way, where the motion ends; command: TCP poses in the robot base,
    NaN where a target is not known; centre, normal (M, 3), sweep (M,): corrected arcs in the robot base, NaN for all
    others; moved (M,): the motion is another than in the input.  held: rows that can not be corrected after all, and
    why.
    """

    source: Ints
    role: Ints
    share: Floats
    command: Poses
    centre: Floats
    normal: Floats
    sweep: Floats
    moved: Bools
    findings: tuple[Finding, ...] = ()
    held: Mapping[int, Finding] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.source)

    @property
    def own(self) -> Bools:
        return np.asarray(self.role == Role.OWN)

    @property
    def links(self) -> Bools:
        return np.asarray(self.role == Role.LINK)

    @property
    def inserted(self) -> int:
        return int(np.sum(self.role != Role.OWN))


def divide(task: Task, result: Result, limits: Limits) -> Division:
    """The motions of the output: end points as ``result`` has them, links and further points where they are needed."""
    full = result
    if task.gain != 1.0:  # the points of a first cut are those of the last one
        full = correct(replace(task, gain=1.0, max_correction=np.inf))
        full = replace(full, state=result.state)
    search = _Search(task, full, limits)
    search.link()
    search.refine()
    search.ration()
    return search.division()


class _Search:
    """rows (R,): corrected motions whose way is known; of each the start (TCP command where its way begins), whether a
    link leads there, and the number of pieces."""

    def __init__(self, task: Task, full: Result, limits: Limits) -> None:
        self.task, self.full, self.limits = task, full, limits
        path = task.toolpath
        self.n = len(path)
        self.rows = np.flatnonzero(full.corrected & task.ways.known)
        self.entry = begins(full.command, path, task.tool, task.model.robot, task.track)
        self.free = np.full(self.n, not limits.keep)
        self.free[list(path.whole)] = False
        self.start = self.entry[self.rows]
        self.linked = np.zeros(len(self.rows), bool)
        self.back = np.zeros(self.n, bool)
        self.step = np.zeros(len(self.rows))
        self.count = np.ones(len(self.rows), np.int64)
        self.least = self.count
        self.error = np.zeros(len(self.rows))
        self.held: dict[int, Finding] = {}
        self.findings: list[Finding] = []

    # links

    def link(self) -> None:
        """Where the correction steps at the begin of a motion under force, a link leads to where its own one begins."""
        task, rows = self.task, self.rows
        own = self._own_begins()
        shift, turn = task.off(rows, own, self.entry[rows])
        self.step = np.maximum(
            np.linalg.norm(shift, axis=1) / task.tolerance,
            np.linalg.norm(turn, axis=1) / task.tolerance_angle,
        )
        may = self.free[rows] & task.carries[rows]
        self._start_at(own, may & (self.step > ROOM))
        some = np.flatnonzero(may & (self.step > STEP) & ~self.linked)
        if len(some):
            late = np.zeros(len(rows), bool)
            late[some] = self._errors(some, self._least()[some]) > 1.0
            self._start_at(own, late)
        self._link_back()

    def _start_at(self, own: Poses, linked: Bools) -> None:
        self.linked = self.linked | linked
        self.start = Poses(
            np.where(linked[:, None, None], own.rotation, self.start.rotation),
            np.where(linked[:, None], own.position, self.start.position),
        )

    def _least(self) -> Ints:
        """(R,) pieces that a way has at least."""
        sweep = np.nan_to_num(self.task.ways.sweep[self.rows])
        return np.where(sweep > WIDEST, np.ceil(sweep / np.pi), 1).astype(np.int64)

    def _own_begins(self) -> Poses:
        """The commands (R) by which the tool is where the ways begin, under the force of that motion there."""
        task, rows = self.task, self.rows
        wrench = task.force.along(rows, np.zeros(len(rows)))
        found = Poses(self.start.rotation.copy(), self.start.position.copy())
        other = np.flatnonzero(task.steps(rows, self.full.corrected))
        if len(other):
            at = rows[other]
            begin = task.ways.begin[at]
            done = task.command(at, begin, wrench[other], task.goal(at, begin))
            bad = ~(done.reachable & done.settled & done.converged)
            self._hold(at[bad], "COR009", "where this motion begins the correction leads out of reach")
            found.rotation[other], found.position[other] = done.command.rotation, done.command.position
        return found

    def _link_back(self) -> None:
        """An arc that is not corrected begins where it was programmed, even if the motion before it ends elsewhere."""
        path, full = self.task.toolpath, self.full
        arcs = np.flatnonzero((path.kind == Kind.CIRC) & ~full.corrected)
        arcs = arcs[arcs > 0]
        arcs = arcs[full.corrected[arcs - 1] & np.isfinite(self.task.ways.begin.position[arcs, 0])]
        away = np.linalg.norm(self.entry.position[arcs] - self.task.ways.begin.position[arcs], axis=1)
        arcs = arcs[away > SAME]
        self.back[arcs[self.free[arcs]]] = True
        self._hold(
            arcs[~self.free[arcs]] - 1, "COR013", "an arc that stays as it is begins where this motion ends"
        )

    def _hold(self, rows: Ints, code: str, message: str) -> None:
        for row in rows.tolist():
            line = int(self.task.toolpath.line[row])
            self.held.setdefault(row, Finding(code, message, self.task.file, line))

    # pieces

    def refine(self) -> None:
        """The smallest number of even pieces with which each way is within the tolerance, or the most that may be."""
        ways, rows = self.task.ways, self.rows
        arc = ways.arc[rows]
        self.least = least = self._least()
        # A way that begins beside its place stays beside it, in however many pieces.
        can = self.free[rows] & (self.linked | (self.step <= ROOM))
        if not self.limits.keep:
            self._hold(
                rows[(least > 1) & ~can], "COR013", "an arc of nearly a full turn can not be divided here"
            )
        most = np.maximum(least, np.floor(ways.length[rows] / self.limits.min_segment).astype(np.int64))
        # A motion that only turns the tool has no length to divide.
        most = np.where(can, np.minimum(most, max(1, int(self.limits.max_growth * self.n)) + least), least)
        fails, holds = least - 1, np.zeros(len(rows), np.int64)
        ratio = np.zeros(len(rows))
        self.count, active = least.copy(), np.arange(len(rows))
        while len(active):
            found = self._errors(active, self.count[active])
            self.error[active] = np.where(self.count[active] == least[active], found, self.error[active])
            good = found <= 1.0
            won, lost = active[good], active[~good]
            holds[won] = self.count[won]
            fails[lost], ratio[lost] = self.count[lost], found[~good]
            going = np.where(
                holds[active] > 0, holds[active] - fails[active] > 1, fails[active] < most[active]
            )
            self.count[active] = np.where(holds[active] > 0, holds[active], most[active])
            active = active[going]
            power = 1.0 / np.where(arc[active], _ORDER[True], _ORDER[False])
            guess = np.ceil(np.maximum(fails[active], 1) * np.minimum(ratio[active], 1e6) ** power)
            top = np.where(holds[active] > 0, holds[active] - 1, most[active])
            self.count[active] = np.clip(guess, fails[active] + 1, top).astype(np.int64)

    def ration(self) -> None:
        """Where all together are more than may be inserted: links first, then points, the largest errors before."""
        spare = int(self.limits.max_growth * self.n) - self.n
        spare -= int(self.back.sum()) + int((self.least - 1).sum())
        wanted = self.linked.astype(np.int64) + self.count - self.least
        if wanted.sum() <= spare:
            return
        spare = max(spare, 0)
        paid = self._first(self.linked.astype(np.int64), self.step, spare) > 0
        unlinked = self.linked & ~paid
        more = np.where(unlinked, 0, self.count - self.least)
        self.count = self.least + self._first(more, self.error, spare - int(paid.sum()))
        entry = self.entry[self.rows]
        self.linked = paid
        self.start = Poses(
            np.where(unlinked[:, None, None], entry.rotation, self.start.rotation),
            np.where(unlinked[:, None], entry.position, self.start.position),
        )
        left = np.flatnonzero(self.linked + self.count - self.least < wanted)
        first = int(self.rows[left[np.argmax(np.maximum(self.step, self.error)[left])]])
        self.findings.append(
            Finding(
                "COR014",
                f"{int(wanted.sum())} motions would have to be inserted, max_growth ({self.limits.max_growth:g}) allows"
                f" {spare}: {len(left)} motions have fewer than they need (the largest error here)",
                self.task.file,
                int(self.task.toolpath.line[first]),
                help="raise max_growth or tolerance in the cell",
            )
        )

    @staticmethod
    def _first(wanted: Ints, need: Floats, spare: int) -> Ints:
        """(R,) how many of ``wanted`` (R,) each gets of ``spare``, those with the largest ``need`` (R,) first."""
        order = np.argsort(-need, kind="stable")
        before = np.cumsum(wanted[order]) - wanted[order]
        given = np.zeros_like(wanted)
        given[order] = np.clip(spare - before, 0, wanted[order])
        return given

    def _errors(self, chosen: Ints, count: Ints) -> Floats:
        """(A,) what is left between the points of the motions ``chosen`` (A,) in ``count`` (A,) even pieces, in parts
        of what may be left."""
        pieces, owner = self._pieces(chosen, count)
        off, angle = errors_between(self.task, pieces)
        size = np.maximum(off / self.task.tolerance, angle / self.task.tolerance_angle) / ROOM
        largest = np.zeros(len(chosen))
        np.maximum.at(largest, owner, size)
        return largest

    def _pieces(self, chosen: Ints, count: Ints) -> tuple[Pieces, Ints]:
        """The pieces of the motions ``chosen``, and the place in ``chosen`` of each."""
        rows = self.rows[chosen]
        owner = np.repeat(np.arange(len(rows)), count)
        number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        first, last = number / count[owner], (number + 1) / count[owner]
        final = number + 1 == count[owner]
        at = rows[owner]
        end = self._copied(self.full.command[at])
        self._aim(end, np.flatnonzero(~final), at, last)
        begin = self._copied(self.start[chosen[owner]])
        later = np.flatnonzero(number > 0)
        begin.rotation[later], begin.position[later] = end.rotation[later - 1], end.position[later - 1]
        pieces = Pieces.straight(at, first, last, begin, end)
        bent = np.flatnonzero(self.task.ways.arc[at])
        if len(bent):
            via = self._copied(self.task.ways.at(at[bent], 0.5 * (first + last)[bent]))
            self._aim(via, np.arange(len(bent)), at[bent], 0.5 * (first + last)[bent])
            normal = _normals(self.task, at[bent])
            arcs = Pieces.round(at[bent], first[bent], last[bent], begin[bent], via, end[bent], normal)
            for name in ("centre", "normal", "sweep"):
                values = getattr(pieces, name).copy()
                values[bent] = getattr(arcs, name)
                pieces = replace(pieces, **{name: values})
        return pieces, owner

    def _aim(self, poses: Poses, places: Ints, rows: Ints, share: Floats) -> None:
        """Sets ``poses`` at ``places`` to the commands for the shares of the ways there."""
        if not len(places):
            return
        at, along = rows[places], share[places]
        wanted = self.task.ways.at(at, along)
        done = self.task.command(at, wanted, self.task.force.along(at, along), self.task.goal(at, wanted))
        bad = ~(done.reachable & done.settled & done.converged)
        self._hold(at[bad], "COR009", "on its way the correction leads out of reach")
        poses.rotation[places], poses.position[places] = done.command.rotation, done.command.position

    @staticmethod
    def _copied(poses: Poses) -> Poses:
        return Poses(poses.rotation.copy(), poses.position.copy())

    # the output

    def division(self) -> Division:
        task, n = self.task, self.n
        pieces, _ = self._pieces(np.arange(len(self.rows)), self.count)
        lost = self.task.ways.arc[pieces.rows] & ~np.isfinite(pieces.sweep)
        self._hold(pieces.rows[lost], "COR013", "the corrected points of this arc lie on no circle")
        count, linked = np.ones(n, np.int64), self.back.copy()
        count[self.rows] = self.count
        linked[self.rows] = self.linked
        total = count + linked
        source = np.repeat(np.arange(n), total)
        number = np.arange(len(source)) - np.repeat(np.cumsum(total) - total, total)
        is_link = linked[source] & (number == 0)
        role = np.where(is_link, Role.LINK, np.where(number + 1 == total[source], Role.OWN, Role.PIECE))
        share = np.where(is_link, 0.0, (number + 1 - linked[source]) / count[source])

        command = self._copied(self.full.command[source])
        corrected = np.zeros(n, bool)
        corrected[self.rows] = True
        divided = np.flatnonzero(corrected[source] & ~is_link)  # in the order of ``pieces``
        command.rotation[divided], command.position[divided] = pieces.end.rotation, pieces.end.position
        to = np.flatnonzero(is_link)
        starts = self.task.ways.begin[source[to]]
        mine = np.searchsorted(self.rows, source[to])
        own = np.flatnonzero(corrected[source[to]])
        starts = self._copied(starts)
        starts.rotation[own] = self.start.rotation[mine[own]]
        starts.position[own] = self.start.position[mine[own]]
        command.rotation[to], command.position[to] = starts.rotation, starts.position
        centre, normal = np.full((len(source), 3), np.nan), np.full((len(source), 3), np.nan)
        sweep = np.full(len(source), np.nan)
        centre[divided], normal[divided], sweep[divided] = pieces.centre, pieces.normal, pieces.sweep
        moved = self.full.corrected[source] | is_link
        found = Division(
            source, role, share, command, centre, normal, sweep, moved, tuple(self.findings), self.held
        )
        return found if task.gain == 1.0 else _scaled(task, found)


def _normals(task: Task, rows: Ints) -> Floats:
    """(K, 3) about which the arcs ``rows`` (K,) have to turn; NaN where any plane will do."""
    return np.where(task.toolpath.any_plane[rows, None], np.nan, task.ways.normal[rows])


def _scaled(task: Task, division: Division) -> Division:
    """The division with the share ``gain`` of every correction."""
    rows = np.flatnonzero(division.moved)
    source = division.source[rows]
    ways = task.ways
    wanted = Poses(task.wanted.rotation[source].copy(), task.wanted.position[source].copy())
    on_way = np.flatnonzero(ways.known[source])
    there = ways.at(source[on_way], division.share[rows][on_way])
    wanted.rotation[on_way], wanted.position[on_way] = there.rotation, there.position
    share = partly(wanted, division.command[rows], task.gain)
    command = Poses(division.command.rotation.copy(), division.command.position.copy())
    command.rotation[rows], command.position[rows] = share.rotation, share.position
    scaled = replace(division, command=command)
    bent = np.flatnonzero(np.isfinite(division.sweep))
    if not len(bent):
        return scaled
    before, after = made(task, division), made(task, scaled)
    middle = 0.5 * (before.first + before.last)[bent]
    wanted = ways.at(division.source[bent], middle)
    via = partly(wanted, before[bent].at(np.full(len(bent), 0.5)), task.gain)
    normal = _normals(task, division.source[bent])
    part = after[bent]
    arcs = Pieces.round(part.rows, part.first, part.last, part.begin, via, part.end, normal)
    for name in ("centre", "normal", "sweep"):
        values = getattr(scaled, name).copy()
        values[bent] = getattr(arcs, name)
        scaled = replace(scaled, **{name: values})
    return scaled


def made(task: Task, division: Division) -> Pieces:
    """The M motions of a division as the controller makes them, links among them."""
    source, m = division.source, len(division)
    own = np.flatnonzero(division.own)
    entry = begins(division.command[own], task.toolpath, task.tool, task.model.robot, task.track)
    rotation, position = entry.rotation[source], entry.position[source]
    inner = np.flatnonzero(source[1:] == source[:-1]) + 1
    rotation[inner], position[inner] = (
        division.command.rotation[inner - 1],
        division.command.position[inner - 1],
    )
    first = np.zeros(m)
    first[inner] = division.share[inner - 1]
    return Pieces(
        source,
        first,
        division.share,
        Poses(rotation, position),
        division.command,
        division.centre,
        division.normal,
        division.sweep,
    )
