"""Stated forces turned into the robot's axes, along the path of each motion.  All in arrays over the motions."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from postproc.base.arrays import Bools, FewRows, Floats, Ints, frozen, is_shared, numbers
from postproc.base.batches import blocks, in_blocks, select_rows
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import lengths
from postproc.base.units import DEG
from postproc.cell import Cell, MotionFrames
from postproc.process.feed_frames import FeedFrames
from postproc.process.force_profiles import ForceProfiles
from postproc.process.force_ramps import Ramps
from postproc.process.force_turning import Turning
from postproc.process.path_length import SMOOTH_TURN, MotionRuns, PathLength
from postproc.process.stated_forces import BASE, FEED, TOOL, WORLD, StatedForces
from postproc.toolpath import Kind, Toolpath

MOST = 1e5
"""[N, N m] No robot carries a larger force."""

LEAST = 2.0
"""[N, N m] A force of no component of which is larger moves no robot by what a tolerance is: it was written in kN."""

JUMP = float(2 * np.sin(SMOOTH_TURN / 2))
"""A force that changes by more than this share of the larger one is a step: as much as a turn of SMOOTH_TURN makes."""

JUMP_OF_LARGEST = 0.05
"""Changes below this share of the program's largest force are no steps."""

STRAIGHT = 15 * DEG
"""Along an arc that turns by less a profile is straight in the axes of the robot."""

CLEAR = 4.0
"""A measured force jumps where it does by more than so many of its standard errors."""


@dataclass(frozen=True, eq=False)
class Wrenches:
    """What the workpiece does to the tool, at the TCP, in the axes of the robot root [N, N m].

    values (N, 6): at the end point of each motion; start (N, 6): at the end point before it (the same
    as there, unless the force steps at that vertex; stored only where it is another); both without ``ramps``.
    ``along`` states what acts there and between.  carries (N,): the motion was given a force (even where both sides of
    its end point cancel).
    steps (N,): it carries force, and the wrench does not go over from the motion before: a cut starts, the path turns
    by SMOOTH_TURN or more, or the force jumps.  ramps: how it goes over where it would step inside a cut.
    measured: the forces are a log's, whose steps are what was measured.
    ci95, peak, radius (N,), stock: as of ``StatedForces``.  undirected (N,): as of ``FeedFrames``, None where all are
    False.
    """

    values: Floats
    start: Floats | StartWrenches
    carries: Bools
    source: str
    findings: tuple[Finding, ...] = ()
    steps: Bools = field(default_factory=lambda: np.zeros(0, bool))
    turning: Turning | None = None
    ci95: Floats | None = None
    peak: Floats | None = None
    ramps: Ramps | None = None
    measured: bool = False
    radius: Floats | None = None
    undirected: Bools | None = None
    stock: object = None

    def __post_init__(self) -> None:
        n = len(self.values)
        object.__setattr__(self, "values", frozen(self.values, (n, 6)))
        if isinstance(self.start, np.ndarray):
            object.__setattr__(self, "start", StartWrenches(self.start, self.values))
        object.__setattr__(self, "carries", frozen(self.carries, (n,), np.bool_))
        object.__setattr__(self, "steps", frozen(self.steps, (n,), np.bool_))

    @staticmethod
    def zero(n: int, source: str = "none", findings: tuple[Finding, ...] = ()) -> Wrenches:
        nothing, never = np.broadcast_to(0.0, (n, 6)), np.broadcast_to(False, n)
        return Wrenches(nothing, nothing, never, source, findings, never)

    def __len__(self) -> int:
        return len(self.values)

    @cached_property
    def any(self) -> bool:
        """Whether any motion carries force."""
        return bool(np.any(self.carries))

    @cached_property
    def max_force(self) -> float:
        """The largest force [N] at either end of any motion, and where its profile bends."""
        if not self.any:
            return 0.0
        sides = (self.values, self.start)
        largest = max(_largest(side[rows]) for side in sides for rows in blocks(len(self)))
        if self.ramps is not None:
            largest = max(largest, _largest(self.along(*self.ramps.ends())))
        return float(np.sqrt(largest))

    @property
    def peak_force(self) -> float:
        """The largest force [N] along the path of any motion, of a tooth or of a reading; NaN where none is known."""
        peak = np.full(1, np.nan) if self.peak is None else self.peak
        return float(np.nanmax(peak)) if np.any(np.isfinite(peak)) else np.nan

    @cached_property
    def at_end(self) -> Floats:
        """(N, 6) the wrench at the end point of each motion, ramps included."""
        if self.ramps is None:
            return self.values
        rows, values = np.unique(self.ramps.row), self.values.copy()
        values[rows] += self.ramps.at(rows, np.ones(len(rows)))
        return frozen(values)

    def largest_along(self, rows: Ints) -> Floats:
        """(K, 6) the wrench of the motions ``rows`` (K,) where their profile has its largest force; at the end of those
        without one."""
        wrench = select_rows(self.at_end, rows)
        if self.ramps is None or not self.ramps.inside.any():
            return wrench
        at, share, _ = self.ramps.only(self.ramps.inside).places()
        there = self.along(at, share)
        order = np.lexsort((lengths(there[:, :3]), at))
        last = np.append(at[order][1:] != at[order][:-1], True)
        motion, largest = at[order][last], there[order][last]
        place = np.minimum(np.searchsorted(motion, rows), len(motion) - 1)
        own = motion[place] == rows
        wrench[own] = largest[place[own]]
        return wrench

    @cached_property
    def inner_steps(self) -> Ints:
        """Motions (K,) with which the wrench steps inside a cut."""
        before = np.append(False, self.carries[:-1])
        return np.flatnonzero(self.steps & before)

    def ramped(self, rows: Ints, length: Floats, extent: Floats, early: Floats) -> Wrenches:
        """The same, where the steps at the start of the motions ``rows`` (K,) go over along ``length`` (K,) [m] of the
        path, the shares ``early`` (K,) of them before it; extent (N,) [m]: lengths of the motions."""
        if not len(rows):
            return self
        step = self.start[rows] - self.values[rows - 1]
        steps, carries = self.steps.copy(), np.asarray(self.carries)
        steps[rows] = False
        late, lead = np.flatnonzero(early < 1.0), np.flatnonzero(early > 0.0)
        after = (1.0 - early[late])[:, None] * step[late]
        ramps = Ramps.of(rows[late], after, length[late], extent, carries)
        if len(lead):
            ahead = early[lead, None] * step[lead]
            ramps = ramps.joined(Ramps.leading(rows[lead], ahead, length[lead], extent, carries))
        ramps = ramps.shared(rows, early)
        if self.turning is not None:
            ramps = ramps.turned(self.turning, self.turning.breaks() | self.steps | ~carries)
        return replace(self, steps=steps, ramps=ramps if self.ramps is None else self.ramps.joined(ramps))

    def along(self, rows: Ints, fraction: Floats) -> Floats:
        """(K, 6) the wrench at the shares ``fraction`` (K,), 0 to 1, of the path of the motions ``rows`` (K,).

        Linear between ``start`` and ``values``, with what ``ramps`` add.  On an arc a force stated in the feed frame or
        the tool frame is linear in that frame, which turns with the tangent or with the tool.
        """
        share = fraction[:, None]
        wrench = (1 - share) * self.start[rows] + share * self.values[rows]
        if self.turning is not None and (turned := np.flatnonzero(self.turning.mask[rows])).size:
            at = rows[turned]
            wrench[turned] = self.turning.along(at, fraction[turned], self.start[at], self.values[at])
        if self.ramps is not None:
            wrench += self.ramps.at(rows, fraction)
        return wrench


class StartWrenches:
    """(N, 6) wrenches where motions start: those of ``values`` (N, 6) where the motion before ends, but in few rows."""

    def __init__(self, start: Floats, values: Floats) -> None:
        other = np.append(True, (start[1:] != values[:-1]).any(axis=1))[: len(start)]
        rows = np.flatnonzero(other)
        self._values, self._own = values, FewRows(rows, frozen(start[rows]), len(start))

    def __getitem__(self, rows: Any) -> Floats:
        """As of an array, by rows: numbers from 0, a mask or a slice."""
        chosen = numbers(rows, len(self._values))
        own = self._own[chosen]
        return np.where(np.isnan(own), self._values[np.maximum(chosen - 1, 0)], own)


def is_air(toolpath: Toolpath) -> Bools:
    """(N,) motions that are air whatever the force."""
    return np.asarray((toolpath.kind == Kind.PTP) | (toolpath.kind == Kind.AXIS))


def turn_to_robot_axes(
    stated: StatedForces,
    toolpath: Toolpath,
    frames: MotionFrames,
    cell: Cell,
    file: str,
    source: str,
    findings: tuple[Finding, ...] = (),
) -> Wrenches:
    """The stated forces in the robot's axes, at both ends of each motion.

    At a vertex inside a run that turns by less than SMOOTH_TURN, and where the force does not jump: the mean of both
    sides, both with the orientation at the vertex.  Motions whose target is not known get their force unturned, so
    that it stays visible that they carry one.  Refusal FRC005 where a feed frame is needed and is not defined.
    """
    carries = stated.acts & ~is_air(toolpath)
    if not np.any(carries):
        return Wrenches.zero(len(toolpath), source, findings)
    largest = max(_largest_size(stated.values), _largest_size(stated.start_values))
    if largest > MOST:
        message = f"{source}: no robot carries a force of {largest:.3g} N (or N m)"
        raise Refusal(Finding("FRC002", message, file, help="state forces in N and moments in N m"))
    if 0 < largest < LEAST and stated.stock is None:  # what a stock computes is in N
        message = f"the largest force is {largest:.3g} N (or N m), as if it were in kN"
        help = f"forces are in N: in kN this would be {1000 * largest:.3g}"
        findings = (*findings, Finding("FRC034", message, file, help=help))
    _check_world(stated, carries, toolpath, frames, file)
    path_length = PathLength(toolpath, frames)
    runs = MotionRuns(path_length, carries)
    feed = None
    if np.any(carries & (stated.frames == FEED)):
        feed = FeedFrames(stated, toolpath, frames, path_length, runs, carries, file)
        findings = (*findings, *feed.findings)
    turn = _WrenchTurning(stated, toolpath, frames, cell, path_length, feed)

    n = len(toolpath)
    values, start = np.zeros((n, 6)), np.zeros((n, 6))
    placed, steps = np.zeros(n, bool), carries.copy()

    def fill_ends(part: slice) -> float:
        """The wrenches of both sides of no vertex shared yet; the square of the largest force."""
        rows = part.start + np.flatnonzero(carries[part])
        own = turn.at_end(rows, stated.values)
        unknown = np.isnan(own[:, 0])
        own[unknown] = turn.unturned(rows[unknown], stated.values)
        values[rows], placed[rows] = own, ~unknown
        return _largest(own)

    largest = float(np.sqrt(max(in_blocks(fill_ends, n))))

    def fill_starts(part: slice) -> None:
        rows = part.start + np.flatnonzero(carries[part])
        # where no vertex is known to start at, the end's pose has to serve
        leaving = np.full((len(rows), 6), np.nan)
        starts = path_length.starts[rows]
        leaving[starts] = turn.at_start(rows[starts], stated.start_values)
        lost = np.isnan(leaving[:, 0])
        instead = turn.at_end(rows[lost], stated.start_values)
        unknown = np.isnan(instead[:, 0])
        instead[unknown] = turn.unturned(rows[lost][unknown], stated.start_values)
        leaving[lost] = instead
        start[rows] = leaving

        shared = runs.smooth[rows] & ~lost & placed[rows - 1]
        after, leaving = rows[shared], leaving[shared]
        own = values[after - 1]
        scatter = (
            np.zeros(1) if stated.error is None else np.hypot(stated.error[after - 1], stated.error[after])
        )
        even = ~_jumps(own, leaving, largest, scatter)
        after = after[even]
        # no other vertex has these two
        values[after - 1] = start[after] = 0.5 * (own[even] + leaving[even])
        steps[after] = False

    for _ in in_blocks(fill_starts, n):
        pass
    for array in (values, start, steps):
        array.setflags(write=False)
    wrenches = Wrenches(
        values,
        start,
        carries,
        source,
        findings,
        steps,
        turn.turning(carries),
        stated.ci95,
        stated.peak,
        measured=stated.error is not None,
        radius=stated.radius,
        undirected=None
        if feed is None or not feed.undirected.any()
        else frozen(feed.undirected, None, np.bool_),
        stock=stated.stock,
    )
    if stated.profiles is None:
        return wrenches
    return replace(wrenches, ramps=_profile_ramps(stated.profiles, wrenches, turn, path_length))


def _largest_size(values: Floats) -> float:
    """The largest size among ``values`` (...)."""
    return float(np.maximum(values.max(), -values.min()))


def _profile_ramps(
    profiles: ForceProfiles, wrenches: Wrenches, turn: _WrenchTurning, path_length: PathLength
) -> Ramps | None:
    """What the profiles of motions add to their forces, which are linear between their ends."""
    known = wrenches.carries & path_length.starts & path_length.known & (path_length.length > 0)
    if turn.feed is not None:
        known &= ~turn.feed.undirected
    turns = np.where(path_length.arc, np.nan_to_num(path_length.sweep), 0.0)
    profiles = profiles.of(known).divided(turns, STRAIGHT)
    rows, share, wrench = profiles.motion, profiles.share, profiles.wrench
    if not len(rows):
        return None
    rest = turn.along(rows, share, wrench) - wrenches.along(rows, share)
    rest[(share == 0.0) | (share == 1.0)] = 0.0  # there the vertex decides
    return Ramps.profile(rows, share, rest, path_length.length)


def _check_world(
    stated: StatedForces, carries: Bools, toolpath: Toolpath, frames: MotionFrames, file: str
) -> None:
    """Refuse a force in world axes on a part that a positioner turns under it."""
    if frames.external is None:
        return
    wrong = np.flatnonzero(carries & (stated.frames == WORLD) & frames.external.turns_part)
    if len(wrong):
        raise Refusal(
            Finding(
                "EXT005",
                "the force is in world axes, and the part rotates in them",
                file,
                int(toolpath.line[wrong[0]]),
                help="state it @base (it rotates with the part), @tool or @feed",
            )
        )


def _largest(wrenches: Floats) -> float:
    """The square of the largest force of (M, 6)."""
    force = wrenches[:, :3]
    return float(np.max(np.einsum("ni,ni->n", force, force), initial=0.0))


def _jumps(one: Floats, two: Floats, largest: float, scatter: Floats) -> Bools:
    """(M,) whether the force between ``one`` and ``two`` (M, 6) changes by more than JUMP, and clear of its
    ``scatter`` (M,) [N]; ``largest`` [N]: of the program."""
    size = np.maximum(lengths(one[:, :3]), lengths(two[:, :3]))
    change = lengths(two[:, :3] - one[:, :3])
    return np.asarray(
        (change > np.maximum(JUMP * size, JUMP_OF_LARGEST * largest)) & (change > CLEAR * scatter)
    )


class _WrenchTurning:
    """Turns the wrenches stated for motions into the robot's axes, as they act where those start or end."""

    def __init__(
        self,
        stated: StatedForces,
        toolpath: Toolpath,
        frames: MotionFrames,
        cell: Cell,
        path_length: PathLength,
        feed: FeedFrames | None,
    ) -> None:
        self.stated = stated
        self.base_in_robot = frames.base_in_robot.rotation
        self.tool_in_base = toolpath.rotation
        self.world_in_robot = cell.robot_base.rotation.T
        self.path_length = path_length
        self.feed = feed

    def at_end(self, rows: Ints, values: Floats) -> Floats:
        """(M, 6) ``values`` (K, 6) of ``rows`` (M,) at their end poses; NaN where that cannot be known."""
        return self._turned(rows, values, 1)

    def at_start(self, rows: Ints, values: Floats) -> Floats:
        """(M, 6) the same at the poses in which they start, the end poses of the rows before."""
        return self._turned(rows, values, 0)

    def unturned(self, rows: Ints, values: Floats) -> Floats:
        """(M, 6) for motions with an unknown pose: taken in the axes of their base, or of the robot."""
        own = self.stated.of(values, rows)
        wrench = self._base(own.reshape(-1, 2, 3), rows, 1).reshape(-1, 6)
        return np.where(np.isnan(wrench), own, wrench)

    def along(self, rows: Ints, share: Floats, wrench: Floats) -> Floats:
        """(K, 6) ``wrench`` (K, 6), stated at the shares ``share`` (K,) of the motions ``rows`` (K,)."""
        own = wrench.reshape(-1, 2, 3)
        turned = self._base(own, rows, 1)
        across = self.stated.frames[rows] == FEED
        if self.feed is not None and across.any():
            turned[across] = own[across] @ self.feed.along(rows[across], share[across])
        return np.asarray(turned.reshape(-1, 6))

    def turning(self, carries: Bools) -> Turning | None:
        """The frames that turn along the path, where there are any."""
        frame, known = self.stated.frames, self.path_length.starts
        turns = known & (frame == TOOL)
        framed = frame == TOOL
        if self.feed is not None:
            turns |= known & (frame == FEED) & self.feed.matters & ~self.feed.undirected
            framed |= (frame == FEED) & (self.feed.matters | self.path_length.turns_along)
        mask = carries & framed & self.path_length.arc & known
        if not (mask | (carries & turns)).any():
            return None
        arc_turn = self.path_length.arc_turn
        return Turning(
            mask, frame == FEED, carries & turns, self.feed, self.base_in_robot, self.tool_in_base, arc_turn
        )

    def _turned(self, rows: Ints, values: Floats, side: int) -> Floats:
        own = self.stated.of(values, rows).reshape(-1, 2, 3)
        wrench = np.empty_like(own)
        frame = self.stated.frames[rows]
        for code, turn in ((BASE, self._base), (WORLD, self._world), (TOOL, self._tool), (FEED, self._feed)):
            chosen = frame == code
            if len(rows) and np.all(chosen):
                wrench = turn(own, rows, side)
            elif np.any(chosen):
                wrench[chosen] = turn(own[chosen], rows[chosen], side)
        return wrench.reshape(-1, 6)

    def _base(self, pairs: Floats, rows: Ints, side: int) -> Floats:
        if is_shared(self.base_in_robot):
            return _turned_alike(pairs, self.base_in_robot[0])
        return np.asarray(np.einsum("nij,nkj->nki", self.base_in_robot[rows], pairs))

    def _world(self, pairs: Floats, rows: Ints, side: int) -> Floats:
        return _turned_alike(pairs, self.world_in_robot)

    def _tool(self, pairs: Floats, rows: Ints, side: int) -> Floats:
        at = rows - (1 - side)
        in_base = np.einsum("nij,nkj->nki", self.tool_in_base[at], pairs)
        turned = np.einsum("nij,nkj->nki", self.base_in_robot[at], in_base)
        return np.where(self.path_length.known[at][:, None, None], turned, np.nan)

    def _feed(self, pairs: Floats, rows: Ints, side: int) -> Floats:
        if self.feed is None:
            raise ValueError("forces in the feed frame need feed frames")
        turned = np.einsum("nki,nij->nkj", pairs, self.feed.end(rows, side))
        return np.where(self.path_length.known[rows - (1 - side)][:, None, None], turned, np.nan)


def _turned_alike(pairs: Floats, rotation: Floats) -> Floats:
    """Forces and moments (K, 2, 3) [N, N m] turned by one ``rotation`` (3, 3), as one product of matrices."""
    return np.asarray((pairs.reshape(-1, 3) @ rotation.T).reshape(pairs.shape))
