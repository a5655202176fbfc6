"""The wanted way of each motion in the robot base, between its begin and its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.compensation.mirror import partly
from postproc.geometry import Poses, on_arc
from postproc.robot.description import Robot
from postproc.robot.track import Track, nominal_flange
from postproc.toolpath import Kind, Toolpath

_NO_MOVE = 1e-7
"""[m], [rad]: a motion that is not longer leads nowhere."""


@dataclass(frozen=True)
class Ways:
    """N motions.  begin, end: TCP poses, NaN where unknown; centre, normal (N, 3), sweep (N,) of arcs, NaN elsewhere;
    known (N,): LIN and CIRC whose way is known from begin to end; length (N,) [m], 0 where it is not."""

    begin: Poses
    end: Poses
    centre: Floats
    normal: Floats
    sweep: Floats
    known: Bools
    length: Floats

    @staticmethod
    def of(path: Toolpath, wanted: Poses, base: Poses, tool: Poses, robot: Robot, track: Track) -> Ways:
        """``wanted`` (N): targets in the robot base; ``base``, ``tool`` (N): frames of each motion."""
        centre = (base @ Poses(np.eye(3), path.centre)).position
        normal = (base.rotation @ path.normal[..., None])[..., 0]
        begin = begins(wanted, path, tool, robot, track)
        path_motion = (path.kind == Kind.LIN) | (path.kind == Kind.CIRC)
        known = (
            path_motion & path.known & np.isfinite(begin.position[:, 0]) & np.isfinite(wanted.position[:, 0])
        )
        known &= np.isfinite(begin.rotation[:, 0, 0])
        straight = np.linalg.norm(wanted.position - begin.position, axis=1)
        radius = np.linalg.norm(begin.position - centre, axis=1)
        rise = np.sum((wanted.position - begin.position) * normal, axis=1)
        arc = np.isfinite(path.sweep)
        length = np.where(arc, np.hypot(radius * path.sweep, rise), straight)
        return Ways(begin, wanted, centre, normal, path.sweep, known, np.where(known, length, 0.0))

    @property
    def arc(self) -> Bools:
        return np.asarray(np.isfinite(self.sweep))

    def at(self, rows: Ints, share: Floats) -> Poses:
        """Poses (K) at the shares (K,) of the ways of ``rows`` (K,): straight or round, turning evenly."""
        found = between(self.begin[rows], self.end[rows], share)
        bent = np.flatnonzero(self.arc[rows])
        if len(bent):
            at = rows[bent]
            found.position[bent] = on_arc(
                self.begin.position[at],
                self.end.position[at],
                self.centre[at],
                self.normal[at],
                self.sweep[at],
                share[bent],
            )
        return found

    def tangent(self, rows: Ints, share: Floats) -> Floats:
        """(K, 3) unit vectors along the ways; zero where a motion only turns the tool."""
        step = self.end.position[rows] - self.begin.position[rows]
        bent = np.flatnonzero(self.arc[rows])
        if len(bent):
            at = rows[bent]
            here = self.at(at, share[bent]).position
            normal = self.normal[at]
            rise = np.sum(step[bent] * normal, axis=1)[:, None]
            step[bent] = self.sweep[at, None] * np.cross(normal, here - self.centre[at]) + rise * normal
        length = np.linalg.norm(step, axis=1, keepdims=True)
        return np.where(length > _NO_MOVE, step / np.where(length > 0, length, 1.0), 0.0)


def begins(end: Poses, path: Toolpath, tool: Poses, robot: Robot, track: Track) -> Poses:
    """Where each motion begins (N): the end pose of the one before it, with the tool of its own; NaN for the first one
    and behind a motion to an unknown place."""
    n = len(path)
    rotation, position = np.full((n, 3, 3), np.nan), np.full((n, 3), np.nan)
    if n < 2:
        return Poses(rotation, position)
    rotation[1:], position[1:] = end.rotation[:-1], end.position[:-1]
    other = np.flatnonzero((path.tool[1:] != path.tool[:-1]) & path.known[:-1]) + 1
    if len(other):
        there = end[other - 1] @ tool[other - 1].inverse() @ tool[other]
        rotation[other], position[other] = there.rotation, there.position
    on_axes = np.flatnonzero(~path.known[:-1] & np.isfinite(track.q[:-1]).all(axis=1)) + 1
    if len(on_axes):
        there = nominal_flange(robot, track.q[on_axes - 1]) @ tool[on_axes]
        rotation[on_axes], position[on_axes] = there.rotation, there.position
    return Poses(rotation, position)


def between(begin: Poses, end: Poses, share: Floats) -> Poses:
    """Straight from ``begin`` to ``end`` (K), turning evenly about one axis, at the shares (K,)."""
    return partly(begin, end, share[:, None])
