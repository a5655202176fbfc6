"""Stated forces turned into the robot's axes, one wrench a motion.

All in arrays over the motions.  A *run* is a row of consecutive motions that carry force: what an air move, or a
motion without force, separates has nothing to say about each other's feed direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints, frozen
from postproc.cell import Cell, Frames
from postproc.findings import Finding, Refusal
from postproc.forces.stated import BASE, FEED, TOOL, WORLD, Stated
from postproc.toolpath import Kind, Toolpath
from postproc.units import DEG

SMOOTH_TURN = 30 * DEG
"""Vertices that turn by less share one wrench between both sides."""

ALONG_SPINDLE = 1 * DEG
"""A feed this near to the spindle axis has no direction across it."""

_NO_MOVE = 1e-7  # m; a tenth of the last digit that programs write


@dataclass(frozen=True, eq=False)
class Wrenches:
    """What the workpiece does to the tool, at the TCP, in the axes of the robot root [N, N m].

    values (N, 6): at the end point of each motion; start (N, 6): where it leaves the end point before it (the same
    as there, unless the force steps at that vertex).  Between them it is linear.  carries (N,): the motion was
    given a force (even where both sides of its end point cancel).
    """

    values: Floats
    start: Floats
    carries: Bools
    source: str
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.values)
        object.__setattr__(self, "values", frozen(self.values, (n, 6)))
        object.__setattr__(self, "start", frozen(self.start, (n, 6)))
        object.__setattr__(self, "carries", frozen(self.carries, (n,), np.bool_))

    @staticmethod
    def zero(n: int, source: str = "none", findings: tuple[Finding, ...] = ()) -> Wrenches:
        return Wrenches(np.zeros((n, 6)), np.zeros((n, 6)), np.zeros(n, bool), source, findings)

    def __len__(self) -> int:
        return len(self.values)

    @property
    def any(self) -> bool:
        """Whether any motion carries force."""
        return bool(np.any(self.carries))

    @property
    def max_force(self) -> float:
        """The largest force [N] of any motion."""
        forces = np.concatenate([self.values[:, :3], self.start[:, :3]])
        return float(np.sqrt(np.max(np.einsum("ni,ni->n", forces, forces), initial=0.0)))


def is_air(toolpath: Toolpath) -> Bools:
    """(N,) motions that are air whatever the force."""
    return (toolpath.kind == Kind.PTP) | (toolpath.kind == Kind.AXIS)


def turned(
    stated: Stated,
    toolpath: Toolpath,
    frames: Frames,
    cell: Cell,
    file: str,
    source: str,
    findings: tuple[Finding, ...] = (),
) -> Wrenches:
    """The stated forces in the robot's axes, at the end point of each motion.

    At a vertex inside a run that turns by less than SMOOTH_TURN: the mean of both sides, both with the orientation
    at the vertex.  Motions whose target is not known get their force unturned, so that it stays visible that they
    carry one.  Refusal FRC005 where a feed frame is needed and is not defined.
    """
    carries = np.any(stated.values != 0, axis=1) & ~is_air(toolpath)
    if not np.any(carries):
        return Wrenches.zero(len(toolpath), source, findings)
    path = _Path(toolpath, frames, carries)
    feed = None
    if np.any(carries & (stated.frame == FEED)):
        feed = _Feed(stated, toolpath, frames, path, file)
        findings = (*findings, *feed.findings)
    turn = _Turn(stated, toolpath, frames, cell, path, feed)

    n = len(toolpath)
    rows = np.flatnonzero(carries)
    own = np.zeros((n, 6))
    own[rows] = turn.at(rows, rows)
    placeholder = np.isnan(own[:, 0])
    own[placeholder] = turn.unturned(np.flatnonzero(placeholder))

    # leaving[i]: the wrench of motion i where it begins, with the orientation there
    leaving = np.full((n, 6), np.nan)
    begins = rows[path.begins[rows]]
    leaving[begins] = turn.at(begins, begins - 1)
    values, start = own.copy(), np.where(np.isnan(leaving), own, leaving)
    after = np.flatnonzero(path.smooth & ~np.isnan(leaving[:, 0]) & ~np.roll(placeholder, 1))
    shared = 0.5 * (own[after - 1] + leaving[after])
    values[after - 1] = start[after] = shared
    return Wrenches(values, start, carries, source, findings)


class _Path:
    """The end points in the robot root, and how the path turns at them.

    known (N,): the end point is known.  direction (N, 3): unit vector of the motion in space, NaN without one.
    run_start, run_stop (N,): first and last row of the run a row is in (of no use for others).
    begins (N,): the row before is known and has the same tool on the flange, so that its end pose is where this one
    begins.  smooth (N,): the vertex before this row lies in one run, is known, and turns little.
    """

    def __init__(self, toolpath: Toolpath, frames: Frames, carries: Bools) -> None:
        n = len(toolpath)
        base = frames.base_in_robot
        end = base.position + np.einsum("nij,nj->ni", base.rotation, toolpath.position)
        self.carries = carries
        self.known = (
            toolpath.known & np.isfinite(end[:, 0]) & np.isfinite(frames.tool_in_flange.position[:, 0])
        )

        begin = np.full((n, 3), np.nan)
        begin[1:] = end[:-1]
        other_tool = self._with_other_tool(toolpath, frames, begin)
        step = end - begin
        length = np.sqrt(np.einsum("ni,ni->n", step, step))
        self.moved = self.known & _shifted(self.known) & (length > _NO_MOVE)
        step[~self.moved] = np.nan
        self.direction = step / np.where(self.moved, length, 1.0)[:, None]

        before = _shifted(carries)
        index = np.arange(n)
        self.run_start = np.maximum.accumulate(np.where(carries & ~before, index, 0))
        last = carries & ~np.append(carries[1:], False)
        self.run_stop = np.minimum.accumulate(np.where(last, index, n)[::-1])[::-1]

        self.begins = self.known & _shifted(self.known) & ~other_tool
        # motions that only turn the tool do not hide the corner that they stand on: the last direction counts
        latest = self.latest(self.moved & carries)
        heading = np.where((latest >= 0)[:, None], self.direction[latest], np.nan)
        cosine = np.full(n, np.nan)
        cosine[1:] = np.einsum("ni,ni->n", heading[:-1], heading[1:])
        corner = cosine <= np.cos(SMOOTH_TURN)  # False where there is no turn to speak of
        self.smooth = carries & before & self.begins & ~corner

    def latest(self, mask: Bools) -> Ints:
        """(N,) the last row of ``mask`` at or before each row, within its run; -1 if there is none."""
        found = np.maximum.accumulate(np.where(mask, np.arange(len(mask)), -1))
        return np.where(found >= self.run_start, found, -1)

    def coming(self, mask: Bools) -> Ints:
        """(N,) the next row of ``mask`` at or after each row, within its run; -1 if there is none."""
        n = len(mask)
        found = np.minimum.accumulate(np.where(mask, np.arange(n), n)[::-1])[::-1]
        return np.where(found <= np.minimum(self.run_stop, n - 1), found, -1)

    def _with_other_tool(self, toolpath: Toolpath, frames: Frames, begin: Floats) -> Bools:
        """Rows whose tool is another than the row's before; their ``begin`` becomes that of the new TCP."""
        tool, base = frames.tool_in_flange, frames.base_in_robot
        rows = np.flatnonzero(np.append(False, toolpath.tool[1:] != toolpath.tool[:-1]))
        same = np.all(
            np.isclose(tool.rotation[rows], tool.rotation[rows - 1], 0, 1e-12), axis=(1, 2)
        ) & np.all(np.isclose(tool.position[rows], tool.position[rows - 1], 0, 1e-12), axis=1)
        rows = rows[~same]
        flange = base[rows - 1] @ toolpath.target_in_base[rows - 1] @ tool[rows - 1].inverse()
        begin[rows] = (flange @ tool[rows]).position
        other = np.zeros(len(toolpath), bool)
        other[rows] = True
        return other


class _Feed:
    """The feed frames: z from the tip back to the spindle, x the feed across it.

    back (N, 3): z at each end point.  ahead (N, 3): what becomes x when it is projected across a z: the motion's own
    direction, or the x that stays where it has none; NaN where there is none in the run.
    """

    def __init__(self, stated: Stated, toolpath: Toolpath, frames: Frames, path: _Path, file: str) -> None:
        asked = path.carries & (stated.frame == FEED)
        self._check_spindle(asked & path.known, toolpath, frames, file)
        spindle = np.einsum("nij,nj->ni", toolpath.rotation, frames.spindle_in_tool)
        self.back = -np.einsum("nij,nj->ni", frames.base_in_robot.rotation, spindle)

        across = _across(path.direction, self.back)
        own = path.carries & ~np.isnan(across[:, 0])
        latest, coming = path.latest(own), path.coming(own)
        source = np.where(latest >= 0, latest, coming)
        self.ahead = np.where((source >= 0)[:, None], across[source], np.nan)
        self.ahead[own] = path.direction[own]

        # x and y matter only to a force or moment across z
        self.across_matters = np.any(stated.values[:, [0, 1, 3, 4]] != 0, axis=1)
        needed = asked & path.known & self.across_matters
        undefined = needed & np.isnan(_across(self.ahead, self.back)[:, 0])
        # a run with an unknown target is left as it is, whatever its force
        unknown = np.append(0, np.cumsum(path.carries & ~path.known))
        stop = np.minimum(path.run_stop, len(toolpath) - 1)
        rows = np.flatnonzero(undefined & (unknown[stop + 1] == unknown[path.run_start]))
        if len(rows):
            raise Refusal(_no_direction(rows, toolpath, file))
        borrowed = np.flatnonzero(needed & (latest < 0) & (coming >= 0) & ~undefined)
        self.findings: tuple[Finding, ...] = ()
        if len(borrowed):
            message = f"direction of the next motion taken for motions before any feed: {len(borrowed)}"
            self.findings = (Finding("FRC008", message, file, int(toolpath.line[borrowed[0]])),)

    def _check_spindle(self, rows: Bools, toolpath: Toolpath, frames: Frames, file: str) -> None:
        lost = np.flatnonzero(rows & np.isnan(frames.spindle_in_tool[:, 0]))
        tools, first = np.unique(toolpath.tool[lost], return_index=True)
        findings = []
        for tool, at in zip(tools, first, strict=True):
            number = toolpath.frames[tool].number
            name = "the tool" if number is None else f"tool {number}"
            message = f"the force is in the feed frame, and the spindle axis of {name} is not known"
            if number == 0:
                help = "tool 0 is the bare flange; the program must set its tool before it cuts"
            else:
                key = "a tool with the pose of $TOOL" if number is None else name
                entry = f"{{{number or 1}: {{x: ..., y: ..., z: ..., axis: +z}}}}"
                help = f"add {key} with its axis to the cell: tools: {entry}"
            line = int(toolpath.line[lost[at]])
            findings.append(Finding("FRC005", message, file, line, help=help))
        if findings:
            raise Refusal(*findings)


class _Turn:
    """Turns the wrench stated for some motions into the robot's axes, as it acts at the end pose of others."""

    def __init__(
        self,
        stated: Stated,
        toolpath: Toolpath,
        frames: Frames,
        cell: Cell,
        path: _Path,
        feed: _Feed | None,
    ) -> None:
        self.stated = stated
        self.base_in_robot = frames.base_in_robot.rotation
        self.tool_in_base = toolpath.rotation
        self.world_in_robot = cell.robot_base.rotation.T
        self.path = path
        self.feed = feed

    def at(self, rows: Ints, at: Ints) -> Floats:
        """(M, 6) the wrenches of ``rows`` (M,) at the end poses of ``at`` (M,); NaN where that can not be known."""
        wrench = np.empty((len(rows), 2, 3))
        frame = self.stated.frame[rows]
        for code, turn in ((BASE, self._base), (WORLD, self._world), (TOOL, self._tool), (FEED, self._feed)):
            chosen = frame == code
            if len(rows) and np.all(chosen):
                wrench = turn(self._pairs(rows), rows, at)
            elif np.any(chosen):
                wrench[chosen] = turn(self._pairs(rows[chosen]), rows[chosen], at[chosen])
        return wrench.reshape(-1, 6)

    def unturned(self, rows: Ints) -> Floats:
        """(M, 6) for motions with an unknown pose: taken in the axes of their base, or of the robot."""
        wrench = self._base(self._pairs(rows), rows, rows).reshape(-1, 6)
        return np.where(np.isnan(wrench), self.stated.values[rows], wrench)

    def _pairs(self, rows: Ints) -> Floats:
        """(M, 2, 3) force and moment, as stated."""
        return self.stated.values[rows].reshape(-1, 2, 3)

    def _base(self, pairs: Floats, rows: Ints, at: Ints) -> Floats:
        return np.einsum("nij,nkj->nki", self.base_in_robot[rows], pairs)

    def _world(self, pairs: Floats, rows: Ints, at: Ints) -> Floats:
        return pairs @ self.world_in_robot.T

    def _tool(self, pairs: Floats, rows: Ints, at: Ints) -> Floats:
        in_base = np.einsum("nij,nkj->nki", self.tool_in_base[at], pairs)
        turned = np.einsum("nij,nkj->nki", self.base_in_robot[at], in_base)
        return np.where(self.path.known[at][:, None, None], turned, np.nan)

    def _feed(self, pairs: Floats, rows: Ints, at: Ints) -> Floats:
        if self.feed is None:
            raise ValueError("forces in the feed frame without feed frames")
        z = self.feed.back[at]
        x = _across(self.feed.ahead[rows], z)
        x[~self.feed.across_matters[rows]] = 0.0
        y = np.cross(z, x)
        axes = np.stack([x, y, z], axis=-2)  # (M, axis, component)
        turned = np.einsum("nki,nij->nkj", pairs, axes)
        return np.where(self.path.known[at][:, None, None], turned, np.nan)


def _across(vector: Floats, z: Floats) -> Floats:
    """(N, 3) unit vectors: ``vector`` (of unit length) projected across ``z``; NaN where it lies along it."""
    across = vector - np.einsum("ni,ni->n", vector, z)[:, None] * z
    length = np.sqrt(np.einsum("ni,ni->n", across, across))
    defined = length > np.sin(ALONG_SPINDLE)  # False for NaN
    return np.where(defined[:, None], across / np.where(defined, length, 1.0)[:, None], np.nan)


def _shifted(mask: Bools) -> Bools:
    """(N,) the mask of the row before; False for the first row."""
    shifted = np.zeros_like(mask)
    shifted[1:] = mask[:-1]
    return shifted


def _no_direction(rows: Ints, toolpath: Toolpath, file: str) -> Finding:
    more = f" (and {len(rows) - 1} more motions)" if len(rows) > 1 else ""
    return Finding(
        "FRC005",
        f"the force is in the feed frame, and no motion of this cut gives it a direction across the spindle{more}",
        file,
        int(toolpath.line[rows[0]]),
        help="give the force @tool or @base here; in @feed only fz and mz need no direction",
    )
