"""The path of the tool centre point in the robot root: where motions start and end, how they run, how the path turns.

A *run* is a row of consecutive motions that carry force: what an air move, or a motion without force, separates does
not share its feed direction.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.base.units import DEG
from postproc.cell import MotionFrames
from postproc.toolpath import Toolpath

SMOOTH_TURN = 30 * DEG
"""Vertices that turn by less share one wrench between both sides."""

_NO_MOVE = 1e-7  # m; a tenth of the last digit that programs write


class PathLength:
    """The path of N motions; what takes more than a few bytes a motion is computed for the rows asked for.

    known (N,): target, base and tool are known.  starts (N,): the row before is known and has the same tool on the
    flange, so that its end pose is where this one starts, on every path of the program (``continues`` (N,)).
    moved (N,): the motion has a length, ``length`` (N,) [m], 0 where it has none or is not known.  arc (N,): the motion
    is an arc of known start; sweep (N,) [rad].
    """

    def __init__(self, toolpath: Toolpath, frames: MotionFrames) -> None:
        n = len(toolpath)
        self._toolpath, self._base = toolpath, frames.base_in_robot
        self.sweep = toolpath.arcs.sweep
        self._end = np.empty((n, 3))

        def place_ends(rows: slice) -> None:
            base = frames.base_in_robot[rows]
            turned = np.einsum("nij,nj->ni", base.rotation, toolpath.position[rows])
            np.add(base.position, turned, out=self._end[rows])

        for _ in in_blocks(place_ends, n):
            pass
        tool = np.isfinite(frames.tool_in_flange.position[:, 0])
        self.known = toolpath.known & tool & np.isfinite(self._end[:, 0])
        self.continues = toolpath.continues
        there = self.known & shifted(self.known) & self.continues
        self._changed, self._from = _with_other_tool(toolpath, frames)
        self.starts = there.copy()
        self.starts[self._changed] = False
        self.arc = there & np.isfinite(toolpath.arcs.sweep)
        self.moved, self.length = np.zeros(n, bool), np.zeros(n)

        def measure(rows: slice) -> None:
            start, step = self._step(np.arange(rows.start, rows.stop))
            length = np.sqrt(np.einsum("ni,ni->n", step, step))
            curved = np.flatnonzero(self.arc[rows])
            arcs = rows.start + curved
            _, radius, rise = self._arc_geometry(arcs, start[curved], step[curved])
            length[curved] = np.hypot(self.sweep[arcs] * np.sqrt(np.einsum("ni,ni->n", radius, radius)), rise)
            self.moved[rows] = there[rows] & (length > _NO_MOVE)
            self.length[rows] = np.where(self.moved[rows], length, 0.0)

        for _ in in_blocks(measure, n):
            pass

    def tangent(self, rows: Ints, fraction: Floats | float) -> Floats:
        """(K, 3) unit tangent of ``rows`` (K,) at the shares ``fraction`` (K,) of their path; NaN without one."""
        start, step = self._step(rows)
        length = np.where(self.moved[rows], self.length[rows], np.nan)
        tangents = step / length[:, None]
        curved = np.flatnonzero(self.arc[rows] & self.moved[rows])
        if len(curved):
            arcs, share = rows[curved], np.broadcast_to(fraction, len(rows))[curved]
            tangents[curved] = self._arc_tangents(arcs, share, start[curved], step[curved])
        return tangents

    @property
    def turns_along(self) -> Bools:
        """(N,) arcs with which the tool turns."""
        return self._toolpath.arcs.turns_along

    def arc_turn(self, rows: Ints) -> Floats:
        """(K, 3) [rad] by which the tool turns with the arcs ``rows`` (K,), in the robot root; 0 on others."""
        return self._toolpath.arcs.turn(rows, self._base.rotation[rows])

    def _step(self, rows: Ints) -> tuple[Floats, Floats]:
        """(K, 3) [m] where motions start, NaN where that is not known, and from there to their end."""
        start = self._end.take(np.maximum(rows - 1, 0), axis=0)
        start[rows == 0] = np.nan
        if len(self._changed):
            at = np.minimum(np.searchsorted(self._changed, rows), len(self._changed) - 1)
            other = self._changed[at] == rows
            start[other] = self._from[at[other]]
        return start, self._end.take(rows, axis=0) - start

    def _arc_geometry(self, rows: Ints, start: Floats, step: Floats) -> tuple[Floats, Floats, Floats]:
        """The arcs ``rows`` (M,) in the robot root: normal, radius vector at the start (M, 3), rise (M,)."""
        base, path = self._base, self._toolpath
        rotation = base.rotation[rows]
        normal = np.einsum("nij,nj->ni", rotation, path.arcs.normal[rows])
        out = start - (base.position[rows] + np.einsum("nij,nj->ni", rotation, path.arcs.centre[rows]))
        radius = out - np.einsum("ni,ni->n", out, normal)[:, None] * normal
        return normal, radius, np.asarray(np.einsum("ni,ni->n", step, normal))

    def _arc_tangents(self, rows: Ints, fraction: Floats, start: Floats, step: Floats) -> Floats:
        """The tangent of arcs with radius vector r, normal n, sweep s and rise h: s n x R(n, t s) r + h n."""
        normal, first_radius, rise = self._arc_geometry(rows, start, step)
        sweep = self.sweep[rows, None]
        radius = rotation_from_vector(fraction[:, None] * sweep * normal) @ first_radius[..., None]
        tangent = sweep * np.cross(normal, radius[..., 0]) + rise[:, None] * normal
        return np.asarray(tangent / np.linalg.norm(tangent, axis=1, keepdims=True))


def _with_other_tool(toolpath: Toolpath, frames: MotionFrames) -> tuple[Ints, Floats]:
    """Rows (M,) whose tool is another than the row's before, and where its TCP is there (M, 3) [m]."""
    tool, base = frames.tool_in_flange, frames.base_in_robot
    rows = np.flatnonzero(np.append(False, toolpath.tool[1:] != toolpath.tool[:-1]))
    same = np.all(np.isclose(tool.rotation[rows], tool.rotation[rows - 1], 0, 1e-12), axis=(1, 2)) & np.all(
        np.isclose(tool.position[rows], tool.position[rows - 1], 0, 1e-12), axis=1
    )
    rows = rows[~same]
    target = Poses(toolpath.rotation[rows - 1], toolpath.position[rows - 1])
    flange = base[rows - 1] @ target @ tool[rows - 1].inverse()
    return rows, (flange @ tool[rows]).position


class MotionRuns:
    """The runs of the motions that carry force.

    start, stop (N,): first and last row of the run that a row is in (of no use for others).  smooth (N,): the vertex
    before this row lies in one run, is known, and turns by less than SMOOTH_TURN.
    """

    def __init__(self, path_length: PathLength, carries: Bools) -> None:
        n = len(carries)
        index = np.arange(n, dtype=np.int32)
        before = shifted(carries) & path_length.continues
        self.start = np.maximum.accumulate(np.where(carries & ~before, index, np.int32(0)))
        last = carries & ~np.append(carries[1:] & path_length.continues[1:], False)
        stop = np.minimum.accumulate(np.where(last, index, np.int32(n))[::-1])[::-1]
        self.stop = np.minimum(stop, np.int32(n - 1))

        # motions that only turn the tool do not hide the corner that they are on: the last direction counts
        latest = self.latest(path_length.moved & carries)
        self.smooth = carries & before & path_length.starts

        def mark_corners(rows: slice) -> None:
            inner = rows.start + np.flatnonzero(self.smooth[rows])
            lead = latest[inner - 1]
            heading = np.where((lead >= 0)[:, None], path_length.tangent(np.maximum(lead, 0), 1.0), np.nan)
            cosine = np.einsum("ni,ni->n", heading, path_length.tangent(inner, 0.0))
            self.smooth[inner[cosine <= np.cos(SMOOTH_TURN)]] = (
                False  # not where there is no turn to speak of
            )

        for _ in in_blocks(mark_corners, n):
            pass

    def latest(self, mask: Bools) -> Ints:
        """The last entry of ``mask`` at or before each, within its run; -1 if there is none.

        ``mask`` (N,) over the motions, or (2 N,) over their starts and ends in turn: the result, of the same shape,
        counts alike.
        """
        sides = len(mask) // max(len(self.start), 1)
        index = np.arange(len(mask), dtype=np.int32)
        entry = np.maximum.accumulate(np.where(mask, index, np.int32(-1)))
        entry[entry < np.repeat(np.int32(sides) * self.start, sides)] = -1
        return entry

    def coming(self, mask: Bools) -> Ints:
        """The next entry of ``mask`` (N,), or (2 N,), at or after each, within its run, in the same shape; -1 if there
        is none."""
        n = len(mask)
        sides = n // max(len(self.start), 1)
        index = np.arange(n, dtype=np.int32)
        entry = np.minimum.accumulate(np.where(mask, index, np.int32(n))[::-1])[::-1]
        entry[entry >= np.repeat(np.int32(sides) * (self.stop + np.int32(1)), sides)] = -1
        return entry


def shifted(mask: Bools) -> Bools:
    """(N,) ``mask`` (N,) of the row before; False for the first row."""
    moved = np.zeros_like(mask)
    moved[1:] = mask[:-1]
    return moved
