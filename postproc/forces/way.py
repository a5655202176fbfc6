"""The way of the tool centre point in the robot root: where motions begin and end, how they run, how the path turns.

A *run* is a row of consecutive motions that carry force: what an air move, or a motion without force, separates has
nothing to say about each other's feed direction.
"""

from __future__ import annotations

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.cell import Frames
from postproc.geometry import Poses, rotation_from_vector
from postproc.toolpath import Toolpath
from postproc.units import DEG

SMOOTH_TURN = 30 * DEG
"""Vertices that turn by less share one wrench between both sides."""

_NO_MOVE = 1e-7  # m; a tenth of the last digit that programs write


class Way:
    """All in arrays over the motions.

    known (N,): target, base and tool are known.  begins (N,): the row before is known and has the same tool on the
    flange, so that its end pose is where this one begins.  moved (N,): the motion has a length, ``length`` (N,) [m],
    0 where it has none or is not known.  direction (N, 2, 3): unit tangent at its begin and at its end, NaN without
    one.  arc (N,): the motion is an arc of known begin; sweep (N,) [rad].
    """

    def __init__(self, toolpath: Toolpath, frames: Frames) -> None:
        n = len(toolpath)
        base = frames.base_in_robot
        end = base.position + np.einsum("nij,nj->ni", base.rotation, toolpath.position)
        self.known = (
            toolpath.known & np.isfinite(end[:, 0]) & np.isfinite(frames.tool_in_flange.position[:, 0])
        )
        begin = np.full((n, 3), np.nan)
        begin[1:] = end[:-1]
        other_tool = self._with_other_tool(toolpath, frames, begin)
        self.begins = self.known & shifted(self.known) & ~other_tool

        there = self.known & shifted(self.known)
        step = end - begin
        length = np.sqrt(np.einsum("ni,ni->n", step, step))
        self.sweep = toolpath.sweep
        self.arc = there & np.isfinite(toolpath.sweep)
        arcs = np.flatnonzero(self.arc)
        self._lay(arcs, toolpath, base[arcs], begin[arcs], step[arcs])
        length[arcs] = np.hypot(
            self.sweep[arcs] * np.sqrt(np.einsum("ni,ni->n", self._radius, self._radius)), self._rise
        )
        self.moved = there & (length > _NO_MOVE)
        self.length = np.where(self.moved, length, 0.0)
        step[~self.moved] = np.nan
        chord = step / np.where(self.moved, length, 1.0)[:, None]
        self.direction = np.stack([chord, chord], axis=1)
        arcs = np.flatnonzero(self.arc & self.moved)
        for side in (0, 1):
            self.direction[arcs, side] = self._bent(arcs, np.full(len(arcs), float(side)))

    def tangent(self, rows: Ints, fraction: Floats) -> Floats:
        """(K, 3) unit tangent of ``rows`` (K,) at the shares ``fraction`` (K,) of their way; NaN without one."""
        found = self.direction[rows, 0]
        curved = np.flatnonzero(self.arc[rows] & self.moved[rows])
        found[curved] = self._bent(rows[curved], fraction[curved])
        return found

    def _lay(self, rows: Ints, toolpath: Toolpath, base: Poses, begin: Floats, step: Floats) -> None:
        """The arcs ``rows`` (M,) in the robot root: normal, radius vector at the begin (M, 3), rise, sweep (M,)."""
        self._place = np.full(len(toolpath), -1)
        self._place[rows] = np.arange(len(rows))
        self._normal = np.einsum("nij,nj->ni", base.rotation, toolpath.normal[rows])
        centre = base.position + np.einsum("nij,nj->ni", base.rotation, toolpath.centre[rows])
        out = begin - centre
        self._radius = out - np.einsum("ni,ni->n", out, self._normal)[:, None] * self._normal
        self._rise = np.einsum("ni,ni->n", step, self._normal)

    def _bent(self, rows: Ints, fraction: Floats) -> Floats:
        """The tangent of arcs with radius vector r, normal n, sweep s and rise h: s n x R(n, t s) r + h n."""
        at = self._place[rows]
        normal, sweep = self._normal[at], self.sweep[rows, None]
        radius = rotation_from_vector(fraction[:, None] * sweep * normal) @ self._radius[at][..., None]
        tangent = sweep * np.cross(normal, radius[..., 0]) + self._rise[at, None] * normal
        return np.asarray(tangent / np.linalg.norm(tangent, axis=1, keepdims=True))

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


class Runs:
    """The runs of the motions that carry force.

    start, stop (N,): first and last row of the run that a row is in (of no use for others).  smooth (N,): the vertex
    before this row lies in one run, is known, and turns by less than SMOOTH_TURN.
    """

    def __init__(self, way: Way, carries: Bools) -> None:
        n = len(carries)
        index = np.arange(n)
        before = shifted(carries)
        self.start = np.maximum.accumulate(np.where(carries & ~before, index, 0))
        last = carries & ~np.append(carries[1:], False)
        stop = np.minimum.accumulate(np.where(last, index, n)[::-1])[::-1]
        self.stop = np.minimum(stop, n - 1)

        # motions that only turn the tool do not hide the corner that they stand on: the last direction counts
        latest = self.latest(way.moved & carries)
        heading = np.where((latest >= 0)[:, None], way.direction[latest, 1], np.nan)
        cosine = np.full(n, np.nan)
        cosine[1:] = np.einsum("ni,ni->n", heading[:-1], way.direction[1:, 0])
        corner = cosine <= np.cos(SMOOTH_TURN)  # False where there is no turn to speak of
        self.smooth = carries & before & way.begins & ~corner

    def latest(self, mask: Bools) -> Ints:
        """The last entry of ``mask`` at or before each, within its run; -1 if there is none.

        ``mask`` (N,) over the motions, or (2 N,) over their begins and ends in turn: the result counts alike.
        """
        sides = len(mask) // max(len(self.start), 1)
        found = np.maximum.accumulate(np.where(mask, np.arange(len(mask)), -1))
        return np.where(found >= sides * np.repeat(self.start, sides), found, -1)

    def coming(self, mask: Bools) -> Ints:
        """The next entry of ``mask`` at or after each, within its run; -1 if there is none."""
        n = len(mask)
        sides = n // max(len(self.start), 1)
        found = np.minimum.accumulate(np.where(mask, np.arange(n), n)[::-1])[::-1]
        return np.where(found < sides * np.repeat(self.stop + 1, sides), found, -1)


def shifted(mask: Bools) -> Bools:
    """(N,) the mask of the row before; False for the first row."""
    moved = np.zeros_like(mask)
    moved[1:] = mask[:-1]
    return moved
