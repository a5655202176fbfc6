"""The wanted way of each motion in the robot base, between its begin and its end."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.blocks import each_block
from postproc.compensation.mirror import partly
from postproc.geometry import UNKNOWN, Placed, PoseRows, Poses, on_arc, turned
from postproc.robot.description import Robot
from postproc.robot.track import Track, nominal_flange
from postproc.toolpath import Kind, Toolpath

_NO_MOVE = 1e-7
"""[m], [rad]: a motion that is not longer leads nowhere."""


@dataclass(frozen=True, eq=False)
class Ways:
    """N motions.  begin, end: TCP poses, NaN where unknown; sweep (N,) of arcs, NaN elsewhere; known (N,): LIN and CIRC
    whose way is known from begin to end; length (N,) [m], 0 where it is not."""

    path: Toolpath
    begin: PoseRows
    end: Placed
    base: Poses
    known: Bools
    length: Floats

    @staticmethod
    def of(path: Toolpath, wanted: Placed, base: Poses, tool: Poses, robot: Robot, track: Track) -> Ways:
        """``wanted`` (N): targets in the robot base; ``base``, ``tool`` (N): frames of each motion."""
        n = len(path)
        begin = begins(wanted, path, tool, robot, track).remembered()
        known = np.isin(path.kind, (Kind.LIN, Kind.CIRC)) & path.known
        length = np.zeros(n)
        ways = Ways(path, begin, wanted, base, known, length)

        def measured(block: slice) -> None:
            rows = np.arange(block.start, block.stop)
            start, end = begin[rows], wanted[rows].position
            way = np.linalg.norm(end - start.position, axis=1)
            known[block] &= np.isfinite(way) & np.isfinite(start.rotation[:, 0, 0])
            bent = np.flatnonzero(ways.arc[rows])
            if len(bent):
                centre, normal, sweep = ways.circles(rows[bent])
                radius = np.linalg.norm(start.position[bent] - centre, axis=1)
                rise = np.sum((end[bent] - start.position[bent]) * normal, axis=1)
                way[bent] = np.hypot(radius * sweep, rise)
            length[block] = np.where(known[block], way, 0.0)

        each_block(measured, n)
        return ways

    @property
    def sweep(self) -> Floats:
        return self.path.sweep

    @cached_property
    def arc(self) -> Bools:
        return np.asarray(np.isfinite(self.path.sweep))

    def circles(self, rows: Ints) -> tuple[Floats, Floats, Floats]:
        """Centre (K, 3) [m], normal (K, 3) and sweep (K,) of the arcs ``rows`` (K,), in the robot base."""
        base = self.base[rows]
        centre = base.position + turned(base.rotation, self.path.centre[rows])
        return centre, turned(base.rotation, self.path.normal[rows]), self.path.sweep[rows]

    def at(self, rows: Ints, share: Floats) -> Poses:
        """Poses (K) at the shares (K,) of the ways of ``rows`` (K,): straight or round, turning evenly."""
        begin, end = self.begin[rows], self.end[rows]
        found = between(begin, end, share)
        bent = np.flatnonzero(np.isfinite(self.sweep[rows]))
        if len(bent):
            found.position[bent] = on_arc(
                begin.position[bent], end.position[bent], *self.circles(rows[bent]), share[bent]
            )
        return found

    def tangent(self, rows: Ints, share: Floats) -> Floats:
        """(K, 3) unit vectors along the ways; zero where a motion only turns the tool."""
        step = self.end[rows].position - self.begin[rows].position
        bent = np.flatnonzero(np.isfinite(self.sweep[rows]))
        if len(bent):
            at = rows[bent]
            here = self.at(at, share[bent]).position
            centre, normal, sweep = self.circles(at)
            rise = np.sum(step[bent] * normal, axis=1)[:, None]
            step[bent] = sweep[:, None] * np.cross(normal, here - centre) + rise * normal
        length = np.linalg.norm(step, axis=1, keepdims=True)
        return np.where(length > _NO_MOVE, step / np.maximum(length, _NO_MOVE), 0.0)


def begins(end: Placed, path: Toolpath, tool: Poses, robot: Robot, track: Track) -> PoseRows:
    """Where each motion begins (N): the end pose of the one before it, with the tool of its own; NaN for the first one
    and behind a motion to an unknown place."""

    def made(rows: Ints) -> Poses:
        before = np.maximum(rows - 1, 0)
        found = end[before].copy()
        other = np.flatnonzero((path.tool[rows] != path.tool[before]) & path.known[before])
        if len(other):
            found.put(other, found[other] @ tool[before[other]].inverse() @ tool[rows[other]])
        behind_axes = np.flatnonzero(~path.known[before])
        behind_axes = behind_axes[np.isfinite(track.q[before[behind_axes]]).all(axis=1)]
        if len(behind_axes):
            flange = nominal_flange(robot, track.q[before[behind_axes]])
            found.put(behind_axes, flange @ tool[rows[behind_axes]])
        found.put(rows == 0, UNKNOWN)
        return found

    return PoseRows(len(path), made)


def between(begin: Poses, end: Poses, share: Floats) -> Poses:
    """Straight from ``begin`` to ``end`` (K), turning evenly about one axis, at the shares (K,)."""
    return partly(begin, end, share[:, None])
