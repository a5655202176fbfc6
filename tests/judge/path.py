"""The motions of a program as a controller runs them: a place on them is a label, metres along the programmed polygon.

LIN goes straight and turns evenly about one axis, or rotary words run evenly; CIRC goes through three points or about
a centre; external axes go evenly.  An approximated vertex is left at d' = min($APO.CDIS, half of each neighbouring
motion) before it and met again d' after it, in between on the parabola that touches both motions (for straight ones:
the quadratic Bezier curve with the vertex as its middle point).  PTP and axis motions are air; only where they end
matters.

Points of a spline block are joined by a cubic spline over their distances: the maker's own curve is not published, and
original and output go by the same rule.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from .cell import Cell
from .motion import MM, Motion
from .robot import Robot, rotation_vector, rotation_vectors, rotations

CONTINUES = ("LIN", "CIRC", "SPL")
SHORTEST = 1e-9
NODE, NODE_ANGLE = 0.02, np.radians(4.0)


class Path:
    """The path of a program: labels s in [start[i], start[i] + length[i]] are on motion i."""

    def __init__(self, motions: list[Motion], robot: Robot, cell: Cell) -> None:
        self.motions, self.robot, self.cell = motions, robot, cell
        n = len(motions)
        self.base_turns = np.array([m.base[0] for m in motions])
        self.base_places = np.array([m.base[1] for m in motions])
        self.place = np.zeros((n, 2, 3))
        self.turned = np.zeros((n, 2, 3, 3))
        self.turn = np.zeros((n, 3))
        self.outside = np.zeros((n, 2, 6))
        self.centre, self.normal = np.zeros((n, 3)), np.tile([0.0, 0, 1], (n, 1))
        self.sweep, self.lift = np.zeros(n), np.zeros((n, 3))
        self.carried = np.zeros(n, bool)
        self.arc = np.array([m.kind == "CIRC" for m in motions], bool)
        self.words = np.zeros((n, 2, 3))
        self.rotary = np.zeros(n, bool)
        self.spline = np.zeros((n, 4, 3))
        self.bent = np.zeros(n, bool)
        self.length = np.full(n, SHORTEST)
        self._poses()
        for i, (one, two) in enumerate(pairwise(motions), 1):
            if one.words is not None and two.words is not None and two.kind in CONTINUES:
                self.words[i], self.rotary[i] = (one.words, two.words), True
        self._splines()
        self.start = np.append(0.0, np.cumsum(self.length))
        self.approximation = self._blends()

    # Poses at the ends

    def frames(self, i: np.ndarray, outside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotations and positions (K) of the bases of motions in the robot's root; outside (K, 6) [mm, deg]: E1 ..
        E6."""
        turns, places = self.base_turns[i].copy(), self.base_places[i].copy()
        root, turned = self.cell.robot_base[1] + np.zeros((len(i), 3)), self.cell.robot_base[0]
        if np.any(self.robot.rail):
            root = root + outside[:, :1] * MM * (turned @ self.robot.rail)
        for axis in self.cell.external:
            value = outside[:, axis.column]
            if axis.kind == "track":
                root = root + value[:, None] * MM * axis.direction
            elif axis.kind == "positioner":
                carried = rotations(np.radians(value)[:, None] * axis.direction)
                places = axis.point + np.einsum("kij,kj->ki", carried, places - axis.point)
                turns = carried @ turns
        return turned.T @ turns, (places - root) @ turned

    def _poses(self) -> None:
        cell, robot = self.cell, self.robot
        outside = cell.start_external
        place, turned, _ = robot.chain(cell.start[None], self.motions[0].tool)
        flange = turned[0] @ self.motions[0].tool[0].T
        pose = (flange, place[0] - flange @ self.motions[0].tool[1])  # of the flange in the robot
        for i, m in enumerate(self.motions):
            before, outside = outside, outside.copy()
            for name, value in m.external.items():
                outside[int(name[1]) - 1] = value
            self.outside[i] = before, outside
            turns, places = self.frames(np.array([i, i]), self.outside[i])
            tip = (pose[0] @ m.tool[0], pose[1] + pose[0] @ m.tool[1])
            self.turned[i, 0], self.place[i, 0] = turns[0].T @ tip[0], turns[0].T @ (tip[1] - places[0])
            if m.kind == "AXIS":
                place, turned, _ = robot.chain(m.axes[None], m.tool)
                m.rotation, m.position = turns[1].T @ turned[0], turns[1].T @ (place[0] - places[1])
            self.turned[i, 1], self.place[i, 1] = m.rotation, m.position
            self._shape(i, m)
            flange = turns[1] @ self.turned[i, 1] @ m.tool[0].T
            pose = (flange, places[1] + turns[1] @ self.place[i, 1] - flange @ m.tool[1])

    def _shape(self, i: int, m: Motion) -> None:
        p0, p1 = self.place[i]
        self.length[i] = max(np.linalg.norm(p1 - p0), SHORTEST)
        if m.kind == "CIRC":
            self._arc(i, m)
        if m.kind not in CONTINUES:
            return
        r0 = self.turned[i, 0]
        path_related = m.kind == "CIRC" and m.circle_type == "#PATH"
        carried = rotations((self.normal[i] * self.sweep[i])[None])[0] if path_related else np.eye(3)
        self.carried[i] = path_related
        if m.orientation_type == "#CONSTANT":  # what is written for the end is not gone to
            self.turned[i, 1] = carried @ r0
        self.turn[i] = rotation_vector(r0.T @ carried.T @ self.turned[i, 1])

    def _arc(self, i: int, m: Motion) -> None:
        p0, p1 = self.place[i]
        if m.via is not None:
            a, b = m.via - p0, p1 - p0
            normal = np.cross(a, b)
            square = normal @ normal
            centre = p0 + (np.cross(normal, a) * (b @ b) - np.cross(normal, b) * (a @ a)) / (2 * square)
            normal = normal / np.sqrt(square)
        else:
            centre, normal = m.centre, m.normal
        out, home = p0 - centre, p1 - centre
        out, home = (v - (v @ normal) * normal for v in (out, home))
        sweep = np.arctan2(np.cross(out, home) @ normal, out @ home)
        if sweep < 1e-9 and not (m.via is not None and sweep > 0):
            sweep += 2 * np.pi
        if m.angle is not None:
            sweep = m.angle
        self.centre[i], self.normal[i], self.sweep[i] = centre, normal, sweep
        if m.angle is None:
            self.lift[i] = p1 - centre - rotations((normal * sweep)[None])[0] @ (p0 - centre)
        else:
            self.place[i, 1] = m.position = centre + rotations((normal * sweep)[None])[0] @ (p0 - centre)
        self.length[i] = np.hypot(abs(sweep) * np.linalg.norm(out), np.linalg.norm(self.lift[i]))

    def _splines(self) -> None:
        i = 0
        while i < len(self.motions):
            if self.motions[i].kind != "SPL":
                i += 1
                continue
            j = i
            while j < len(self.motions) and (self.motions[j].kind, self.motions[j].block) == (
                "SPL",
                self.motions[i].block,
            ):
                j += 1
            points = np.concatenate([self.place[i, :1], self.place[i:j, 1]])
            knots = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
            if len(points) > 2:
                self.spline[i:j] = CubicSpline(knots, points, bc_type="natural").c.transpose(1, 0, 2)
                self.bent[i:j] = True
            i = j

    def _blends(self) -> np.ndarray:
        """(n,) [m] d' at the end of each motion."""
        blend = np.zeros(len(self.motions))
        for i, (m, after) in enumerate(pairwise(self.motions)):
            if m.approximation > 0 and m.kind in CONTINUES and after.kind in CONTINUES and m.kind != "SPL":
                blend[i] = min(m.approximation, self.length[i] / 2, self.length[i + 1] / 2)
        return blend

    # Between the ends

    def on_motion(self, i: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions (K, 3), rotations (K, 3, 3) in the base and the external axes (K, 6) at shares of motions, not
        approximated."""
        rotation = self.turned[i, 0] @ rotations(share[:, None] * self.turn[i])
        rows = np.flatnonzero(self.rotary[i])
        if len(rows):
            first, last = self.words[i[rows]].swapaxes(0, 1)
            a, b, c = ((first + share[rows, None] * (last - first))[:, k] for k in range(3))
            turned = rotations(np.outer(c, [0, 0, 1])) @ rotations(np.outer(b, [0, 1, 0]))
            rotation[rows] = turned @ rotations(np.outer(a, [1, 0, 0])) @ self.cell.orientation
        rows = np.flatnonzero(self.carried[i])
        if len(rows):
            rotation[rows] = self._carry(i[rows], share[rows]) @ rotation[rows]
        outside = self.outside[i, 0] + share[:, None] * (self.outside[i, 1] - self.outside[i, 0])
        return self.position(i, share), rotation, outside

    def _carry(self, k: np.ndarray, share: np.ndarray) -> np.ndarray:
        """(K, 3, 3) how far arcs have turned about their normals."""
        return rotations(self.normal[k] * (self.sweep[k] * share)[:, None])

    def position(self, i: np.ndarray, share: np.ndarray) -> np.ndarray:
        """(K, 3) in the base at shares of motions, not approximated."""
        t = share[:, None]
        p0 = self.place[i, 0]
        position = p0 + t * (self.place[i, 1] - p0)
        rows = np.flatnonzero(self.arc[i])
        if len(rows):
            k = i[rows]
            arm = (self.place[k, 0] - self.centre[k])[..., None]
            turned = (self._carry(k, share[rows]) @ arm)[..., 0]
            position[rows] = self.centre[k] + turned + t[rows] * self.lift[k]
        rows = np.flatnonzero(self.bent[i])
        if len(rows):
            k = i[rows]
            x = (share[rows] * self.length[k])[:, None]
            a, b, c, d = (self.spline[k, j] for j in range(4))
            position[rows] = ((a * x + b) * x + c) * x + d
        return position

    def tangent(self, i: np.ndarray, share: np.ndarray) -> np.ndarray:
        """(K, 3) unit direction of the feed on motions, not approximated."""
        along = self.place[i, 1] - self.place[i, 0]
        rows = np.flatnonzero(self.arc[i])
        if len(rows):
            k = i[rows]
            arm = (self._carry(k, share[rows]) @ (self.place[k, 0] - self.centre[k])[..., None])[..., 0]
            along[rows] = np.cross(self.normal[k], arm) * self.sweep[k][:, None] + self.lift[k]
        rows = np.flatnonzero(self.bent[i])
        if len(rows):
            k = i[rows]
            x = (share[rows] * self.length[k])[:, None]
            a, b, c = (self.spline[k, j] for j in range(3))
            along[rows] = (3 * a * x + 2 * b) * x + c
        return along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-15)

    def find(self, label: np.ndarray, low: int, high: int) -> tuple[np.ndarray, np.ndarray]:
        """The motions (K,) from ``low`` to ``high`` on which labels are, and their shares."""
        i = np.clip(np.searchsorted(self.start, label, side="right") - 1, low, high)
        return i, np.clip((label - self.start[i]) / self.length[i], 0.0, 1.0)

    def at(self, label: np.ndarray, low: int, high: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As ``on_motion`` at labels (K,), with approximated vertices."""
        i, share = self.find(label, low, high)
        position, rotation, outside = self.on_motion(i, share)
        for rows, u, before, after in self._rounded(label, i):
            one, two = self.on_motion(*before), self.on_motion(*after)
            position[rows] = (1 - u)[:, None] * one[0] + u[:, None] * two[0]
            turn = rotation_vectors(one[1].swapaxes(1, 2) @ two[1])
            rotation[rows] = one[1] @ rotations(u[:, None] * turn)
            outside[rows] = (1 - u)[:, None] * one[2] + u[:, None] * two[2]
        return position, rotation, outside

    def points(self, label: np.ndarray, low: int, high: int) -> np.ndarray:
        """(K, 3) positions alone of ``at``."""
        i, share = self.find(label, low, high)
        position = self.position(i, share)
        for rows, u, before, after in self._rounded(label, i):
            position[rows] = (1 - u)[:, None] * self.position(*before) + u[:, None] * self.position(*after)
        return position

    def _rounded(self, label: np.ndarray, i: np.ndarray) -> Iterator[tuple]:
        """Of labels (K,) on motions (K,): rows on the parabola of a vertex, how far they are on it (0 to 1), and the
        places on the motions before and after it between which they lie."""
        for side, first in ((0, i - 1), (1, i)):
            d = np.where(first >= 0, self.approximation[first], 0.0)
            inside = self.start[i + 1] - label if side else label - self.start[i]
            rows = np.flatnonzero((inside < d) & (d > 0))
            if len(rows):
                one, reach = first[rows], d[rows]
                u = 0.5 + 0.5 * (label[rows] - self.start[one + 1]) / reach
                before = one, 1 - reach * (1 - u) / self.length[one]
                yield rows, u, before, (one + 1, reach * u / self.length[one + 1])

    def direction(self, label: np.ndarray, low: int, high: int) -> np.ndarray:
        """(K, 3) derivative of the position by the label, with approximated vertices, by differences."""
        ends = self.start[low], self.start[high + 1]
        h = 1e-7
        one, two = np.clip(label - h, *ends), np.clip(label + h, *ends)
        way = self.points(two, low, high) - self.points(one, low, high)
        return way / np.maximum(two - one, 1e-12)[:, None]

    # The controller's joint angles

    def in_robot(
        self, i: np.ndarray, position: np.ndarray, rotation: np.ndarray, outside: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Poses in the robot's root of poses in the bases of motions (K,)."""
        turns, places = self.frames(i, outside)
        return places + np.einsum("kij,kj->ki", turns, position), turns @ rotation

    def joints_at_nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Labels and joint angles (M, 6) so near to each other that between them a straight line is a good guess."""
        angle = np.linalg.norm(self.turn, axis=1) + np.abs(self.sweep)
        moved = self.length + np.abs(self.outside[:, 1] - self.outside[:, 0]).max(1) * MM
        count = np.ceil(np.maximum(moved / NODE, angle / NODE_ANGLE)).astype(int)
        count = np.where([m.kind in CONTINUES for m in self.motions], np.maximum(count, 1), 1)
        i = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(i)) - np.repeat(np.cumsum(count) - count, count) + 1) / count[i]
        labels = self.start[i] + share * self.length[i]
        places, turns = self.in_robot(i, *self.at(labels, 0, len(count) - 1))
        # where a vertex is left before its point, air ends where the next motion's parabola says: near enough
        q, joints = self.cell.start, []
        for k, place, turned in zip(i.tolist(), places, turns, strict=True):
            m = self.motions[k]
            if m.kind == "AXIS":
                q = m.axes
            elif m.kind == "PTP":
                q = self.robot.reach(place, turned, m.tool, q, m.status, m.turn)
            else:
                q = self.robot.follow(place, turned, m.tool, q)
            joints.append(q)
        return np.append(0.0, labels), np.array([self.cell.start, *joints])
