"""What is inserted so that the way between corrected points is right too: links where the correction steps, and
points where a straight or round way between two of them would leave the tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.blocks import ROWS, each_block, in_blocks
from postproc.compensation.between import Pieces, errors_between
from postproc.compensation.correct import Result, correct
from postproc.compensation.mirror import partly
from postproc.compensation.task import Task
from postproc.compensation.ways import begins
from postproc.findings import Finding
from postproc.geometry import Placed, PoseRows, Poses, lengths
from postproc.toolpath import Kind, Role
from postproc.units import DEG, MM

ROOM = 0.9
"""Share of the tolerance that the way between points may take: written digits take a part of the rest."""

STEP = 0.1
"""Share of the tolerance by which the correction may step, or change on a way, without a look at what that does."""

LITTLE = 3 * DEG
"""Axes that turn by less leave a robot's compliance as it is: what changes with its square is a thousandth."""

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

    source, role (M,); share (M,): of the source's way, where the motion ends; command (M): TCP poses in the robot base,
    NaN where a target is not known; centre, normal (M, 3), sweep (M,): corrected arcs in the robot base, NaN for all
    others; moved (M,): the motion is another than in the input.  held: rows that can not be corrected after all, and
    why.
    """

    source: Ints
    role: Ints
    share: Floats
    command: Placed
    centre: Floats
    normal: Floats
    sweep: Floats
    moved: Bools
    findings: tuple[Finding, ...] = ()
    held: Mapping[int, Finding] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.source)

    @cached_property
    def own(self) -> Bools:
        return np.asarray(self.role == Role.OWN)

    @cached_property
    def own_command(self) -> PoseRows:
        """(N) where the motions of the input end."""
        own = np.flatnonzero(self.own)
        return PoseRows(len(own), lambda rows: self.command[own[rows]])

    @cached_property
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
    """rows (R,): corrected motions whose way is known; of each whether a link leads to where its way begins, and the
    number of pieces.  start_at (R,): the place among ``starts`` of the TCP command where a way begins that may get a
    link, -1 of all others: they begin where the motion before them ends."""

    def __init__(self, task: Task, full: Result, limits: Limits) -> None:
        self.task, self.full, self.limits = task, full, limits
        path = task.toolpath
        self.n = len(path)
        self.rows = np.flatnonzero(full.corrected & task.ways.known)
        self.entry = begins(full.command, path, task.tool, task.model.robot, task.track)
        self.free = np.full(self.n, not limits.keep)
        self.free[list(path.whole)] = False
        self.start_at = np.full(len(self.rows), -1, np.int32)
        self.starts = self.entry[:0]
        self.linked = np.zeros(len(self.rows), bool)
        self.back = np.zeros(self.n, bool)
        self.step = np.zeros(len(self.rows))
        self.count = np.ones(len(self.rows), np.int32)
        self.least = self.count
        self.error = np.zeros(len(self.rows))
        self.held: dict[int, Finding] = {}
        self.findings: list[Finding] = []

    # links

    def link(self) -> None:
        """Where the correction steps at the begin of a motion under force, a link leads to where its own one begins."""
        task, rows, corrected = self.task, self.rows, self.full.corrected
        other = np.flatnonzero(
            np.concatenate(
                [rows[:0] > 0, *in_blocks(lambda part: task.steps(rows[part], corrected), len(rows))]
            )
        )
        self.starts = Poses(np.empty((len(other), 3, 3)), np.empty((len(other), 3)))
        self.start_at[other] = np.arange(len(other))

        def stepped(part: slice) -> None:
            at = rows[other[part]]
            own = self._commands(at, np.zeros(len(at)), "where this motion begins")
            shift, turn = task.off(at, own, self.entry[at])
            self.starts.put(part, own)
            self.step[other[part]] = np.maximum(
                np.linalg.norm(shift, axis=1) / task.tolerance,
                np.linalg.norm(turn, axis=1) / task.tolerance_angle,
            )

        each_block(stepped, len(other))
        may = self.free[rows] & task.carries[rows]
        self.linked = may & (self.step > ROOM)
        some = np.flatnonzero(may & (self.step > STEP) & ~self.linked)
        if len(some):
            self.linked[some[self._errors(some, self._least()[some]) > 1.0]] = True
        self._link_back()

    def _start(self, chosen: Ints) -> Poses:
        """The commands (A) where the ways of the motions ``chosen`` (A,) begin: behind a link, or where the motion
        before them ends."""
        found = self.entry[self.rows[chosen]]
        linked = np.flatnonzero(self.linked[chosen])
        if len(linked):
            found.put(linked, self.starts[self.start_at[chosen[linked]]])
        return found

    def _least(self) -> Ints:
        """(R,) pieces that a way has at least."""
        sweep = np.nan_to_num(self.task.ways.sweep[self.rows])
        return np.where(sweep > WIDEST, np.ceil(sweep / np.pi), 1).astype(np.int32)

    def _link_back(self) -> None:
        """An arc that is not corrected begins where it was programmed, even if the motion before it ends elsewhere."""
        path, full, ways = self.task.toolpath, self.full, self.task.ways
        arcs = np.flatnonzero((path.kind == Kind.CIRC) & ~full.corrected)
        arcs = arcs[arcs > 0]
        arcs = arcs[full.corrected[arcs - 1]]
        away = np.linalg.norm(self.entry[arcs].position - ways.begin[arcs].position, axis=1)
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
        # A motion that only turns the tool has no length to divide.
        most = np.floor(ways.length[rows] / self.limits.min_segment)
        most = np.minimum(most, max(1, int(self.limits.max_growth * self.n)) + least)
        most = np.where(can, np.maximum(least, most), least).astype(np.int32)
        fails, holds = least - 1, np.zeros(len(rows), np.int32)
        ratio = np.zeros(len(rows))
        self.count, active = least.copy(), np.flatnonzero(~self._even())
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
            self.count[active] = np.clip(guess, fails[active] + 1, top).astype(np.int32)

    def _even(self) -> Bools:
        """(R,) straight ways on which the correction hardly changes and the axes hardly turn: it lies on a line from
        begin to end, and between them nothing is off by more than a part of that change."""
        task, full, path = self.task, self.full, self.task.toolpath

        def even(part: slice) -> Bools:
            rows = self.rows[part]
            before = np.maximum(rows - 1, 0)
            alike = full.corrected[before] & (rows > 0) & (self.start_at[part] < 0)
            alike &= ~task.ways.arc[rows] & (path.tool[rows] == path.tool[before])
            for change, most in ((full.correction, task.tolerance), (full.turn, task.tolerance_angle)):
                alike &= lengths(change[rows] - change[before]) <= STEP * most
            return alike & (np.abs(task.track.q[rows] - task.track.q[before]) <= LITTLE).all(axis=1)

        return np.concatenate([np.empty(0, bool), *in_blocks(even, len(self.rows))])

    def ration(self) -> None:
        """Where all together are more than may be inserted: links first, then points, the largest errors before."""
        spare = int(self.limits.max_growth * self.n) - self.n
        spare -= int(self.back.sum()) + int((self.least - 1).sum())
        wanted = self.linked.astype(np.int64) + self.count - self.least
        if wanted.sum() <= spare:
            return
        spare = max(spare, 0)
        paid = self._first(self.linked.astype(np.int64), self.step, spare) > 0
        # where a link is not paid, nothing is left for points
        self.count = self.least + self._first(self.count - self.least, self.error, spare - int(paid.sum()))
        self.linked = paid
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

        def largest(part: slice) -> Floats:
            pieces, owner = self._pieces(chosen[part], count[part])
            off, angle = errors_between(self.task, pieces)
            size = np.maximum(off / self.task.tolerance, angle / self.task.tolerance_angle) / ROOM
            found = np.zeros(len(count[part]))
            np.maximum.at(found, owner, size)
            return found

        return np.concatenate([np.empty(0), *in_blocks(largest, len(chosen), _rows(count))])

    def _pieces(self, chosen: Ints, count: Ints) -> tuple[Pieces, Ints]:
        """The pieces of the motions ``chosen``, and the place in ``chosen`` of each."""
        rows = self.rows[chosen]
        owner = np.repeat(np.arange(len(rows)), count)
        number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        first, last = number / count[owner], (number + 1) / count[owner]
        at = rows[owner]
        end = self.full.command[at]
        inner = np.flatnonzero(number + 1 < count[owner])
        end.put(inner, self._commands(at[inner], last[inner]))
        begin = self._start(chosen[owner])
        later = np.flatnonzero(number > 0)
        begin.put(later, end[later - 1])
        pieces = Pieces.straight(at, first, last, begin, end)
        bent = np.flatnonzero(self.task.ways.arc[at])
        if len(bent):
            via = self._commands(at[bent], 0.5 * (first + last)[bent])
            normal = _normals(self.task, at[bent])
            arcs = Pieces.round(at[bent], first[bent], last[bent], begin[bent], via, end[bent], normal)
            for name in ("centre", "normal", "sweep"):
                values = getattr(pieces, name).copy()
                values[bent] = getattr(arcs, name)
                pieces = replace(pieces, **{name: values})
        return pieces, owner

    def _commands(self, rows: Ints, share: Floats, where: str = "on its way") -> Poses:
        """The commands (K) by which the tool is at the shares (K,) of the ways of ``rows`` (K,), under the force
        there."""
        wanted = self.task.ways.at(rows, share)
        if not len(rows):
            return wanted
        done = self.task.command(
            rows, wanted, self.task.force.along(rows, share), self.task.goal(rows, wanted)
        )
        bad = ~(done.reachable & done.settled & done.converged)
        self._hold(rows[bad], "COR009", f"{where} the correction leads out of reach")
        return done.command

    # the output

    def division(self) -> Division:
        task, n = self.task, self.n
        count, linked = np.ones(n, np.int32), self.back.copy()
        count[self.rows] = self.count
        linked[self.rows] = self.linked
        total = count + linked
        source = np.repeat(np.arange(n, dtype=np.int32), total)
        begin = np.cumsum(total) - total  # of the motions of each row
        number = np.arange(len(source)) - begin[source]
        is_link = linked[source] & (number == 0)
        is_own = number + 1 == total[source]
        role = np.where(is_link, Role.LINK, np.where(is_own, Role.OWN, Role.PIECE)).astype(np.int8)
        share = np.where(is_link, 0.0, (number + 1 - linked[source]) / count[source])
        del number

        inserted = np.flatnonzero(~is_own)
        there = Poses(np.empty((len(inserted), 3, 3)), np.empty((len(inserted), 3)))
        links = np.flatnonzero(is_link[inserted])
        to = source[inserted[links]]
        there.put(links, task.ways.begin[to])
        mine = np.searchsorted(self.rows, to)
        own = np.flatnonzero(self.full.corrected[to])
        there.put(links[own], self.starts[self.start_at[mine[own]]])

        arc = task.ways.arc[self.rows]
        none = np.broadcast_to(np.nan, (len(source), 3))
        ways = [none, none, none[:, 0]]
        if arc.any():
            ways = [way.copy() for way in ways]
        chosen = np.flatnonzero((self.count > 1) | arc)
        first = begin + linked

        def divided(part: slice) -> None:
            pieces, owner = self._pieces(chosen[part], self.count[chosen[part]])
            lost = task.ways.arc[pieces.rows] & ~np.isfinite(pieces.sweep)
            self._hold(pieces.rows[lost], "COR013", "the corrected points of this arc lie on no circle")
            each = self.count[chosen[part]]
            number = np.arange(len(owner)) - np.repeat(np.cumsum(each) - each, each)
            place = first[pieces.rows] + number
            inner = np.flatnonzero(number + 1 < each[owner])
            there.put(np.searchsorted(inserted, place[inner]), pieces.end[inner])
            if arc.any():
                for way, values in zip(ways, (pieces.centre, pieces.normal, pieces.sweep), strict=True):
                    way[place] = values

        each_block(divided, len(chosen), _rows(self.count[chosen]))

        full = self.full.command

        def command(rows: Ints) -> Poses:
            found = full[source[rows]]
            added = np.flatnonzero(~is_own[rows])
            if len(added):
                found.put(added, there[np.searchsorted(inserted, rows[added])])
            return found

        division = Division(
            source,
            role,
            share,
            PoseRows(len(source), command),
            ways[0],
            ways[1],
            ways[2],
            self.full.corrected[source] | is_link,
            tuple(self.findings),
            dict(sorted(self.held.items())),
        )
        return division if task.gain == 1.0 else _scaled(task, division)


def _rows(count: Ints) -> int:
    """Motions of a block whose ``count`` (A,) pieces are about as many as the rows of one."""
    return max(1, int(ROWS * len(count) / max(int(count.sum()), 1)))


def _normals(task: Task, rows: Ints) -> Floats:
    """(K, 3) about which the arcs ``rows`` (K,) have to turn; NaN where any plane will do."""
    return np.where(task.toolpath.any_plane[rows, None], np.nan, task.ways.circles(rows)[1])


def _scaled(task: Task, division: Division) -> Division:
    """The division with the share ``gain`` of every correction."""
    source, ways = division.source, task.ways

    def command(rows: Ints) -> Poses:
        found = division.command[rows]
        moved = np.flatnonzero(division.moved[rows])
        at, share = source[rows[moved]], division.share[rows[moved]]
        wanted = task.wanted[at].copy()
        on_way = np.flatnonzero(ways.known[at])
        wanted.put(on_way, ways.at(at[on_way], share[on_way]))
        found.put(moved, partly(wanted, found[moved], task.gain))
        return found

    scaled = replace(division, command=PoseRows(len(division), command))
    bent = np.flatnonzero(np.isfinite(division.sweep))
    if not len(bent):
        return scaled
    before, part = made(task, division, bent), made(task, scaled, bent)
    wanted = ways.at(source[bent], 0.5 * (before.first + before.last))
    via = partly(wanted, before.at(np.full(len(bent), 0.5)), task.gain)
    normal = _normals(task, source[bent])
    arcs = Pieces.round(part.rows, part.first, part.last, part.begin, via, part.end, normal)
    for name in ("centre", "normal", "sweep"):
        values = getattr(scaled, name).copy()
        values[bent] = getattr(arcs, name)
        scaled = replace(scaled, **{name: values})
    return scaled


def made(task: Task, division: Division, motions: Ints) -> Pieces:
    """Some ``motions`` (K,) of a division as the controller makes them, links among them."""
    source = division.source[motions]
    begin = begins(division.own_command, task.toolpath, task.tool, task.model.robot, task.track)[source]
    first = np.zeros(len(motions))
    inner = np.flatnonzero((motions > 0) & (division.source[motions - 1] == source))
    begin.put(inner, division.command[motions[inner] - 1])
    first[inner] = division.share[motions[inner] - 1]
    return Pieces(
        source,
        first,
        division.share[motions],
        begin,
        division.command[motions],
        division.centre[motions],
        division.normal[motions],
        division.sweep[motions],
    )
