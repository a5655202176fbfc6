"""A cell with external axes, computed once more: reader, kinematics and statics of their own, in plain numpy.

Nothing of the package is used.  Lengths in m, angles in rad; poses are 4 x 4 matrices.  The arm is a KR 270-2 (axes
A1 -z, A2 +y, A3 +y, A4 -x, A5 +y, A6 -x; stretched forward at zero; the flange's z along the forearm) whose joints are
springs: theta = c J^T w, with J at the deflected joints.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

D1, A1, A2, A3, D4, D6 = 0.750, 0.350, 1.250, -0.055, 1.100, 0.230
COMPLIANCE = np.array([3.774e-6, 0.302e-6, 0.406e-6, 3.002e-6, 3.303e-6, 2.365e-6])
AXES = np.array([(0, 0, -1), (0, 1, 0), (0, 1, 0), (-1, 0, 0), (0, 1, 0), (-1, 0, 0)], float)
OFFSETS = np.array(
    [(0, 0, 0), (A1, 0, D1), (A2, 0, 0), (D4, 0, A3), (0, 0, 0), (0, 0, 0)], float
)  # from the axis before

WORDS = re.compile(r"([XYZABC]|[AE][1-6])\s+(-?[0-9.]+)")


def turn(axis, angle):
    """Rotation matrix about a unit vector: Rodrigues' formula."""
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def log(rotation):
    """Rotation vector, of angles well below half a turn."""
    odd = 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = np.linalg.norm(odd)
    return odd if sine < 1e-12 else odd / sine * np.arctan2(sine, 0.5 * (np.trace(rotation) - 1))


def pose(x, y, z, a=0.0, b=0.0, c=0.0):
    """From mm and deg, R = Rz(A) Ry(B) Rx(C)."""
    made = np.eye(4)
    a, b, c = np.radians([a, b, c])
    made[:3, :3] = turn((0, 0, 1), a) @ turn((0, 1, 0), b) @ turn((1, 0, 0), c)
    made[:3, 3] = np.array([x, y, z]) / 1000
    return made


def shift(vector):
    made = np.eye(4)
    made[:3, 3] = vector
    return made


def screw(axis, point, angle):
    """The motion of space by ``angle`` about the line through ``point`` along ``axis``."""
    made = np.eye(4)
    made[:3, :3] = turn(axis, angle)
    made[:3, 3] = np.asarray(point) - made[:3, :3] @ point
    return made


def forward(q, tool):
    """TCP in the robot base, and the Jacobian (6, 6) there."""
    rotation, place = np.eye(3), np.zeros(3)
    axes, origins = [], []
    for axis, offset, angle in zip(AXES, OFFSETS, q, strict=True):
        place = place + rotation @ offset
        axes.append(rotation @ axis)
        origins.append(place)
        rotation = rotation @ turn(axis, angle)
    flange = np.eye(4)
    flange[:3, :3] = rotation @ turn((0, 1, 0), np.pi / 2)
    flange[:3, 3] = place + rotation @ (D6, 0, 0)
    tcp = flange @ tool
    jacobian = np.array(
        [np.concatenate([np.cross(z, tcp[:3, 3] - p), z]) for z, p in zip(axes, origins, strict=True)]
    ).T
    return tcp, jacobian


def inverse(target, tool, near):
    """Joint angles for a TCP in the robot base, by Newton's method from ``near``."""
    q = np.array(near, float)
    for _ in range(60):
        tcp, jacobian = forward(q, tool)
        error = np.concatenate([target[:3, 3] - tcp[:3, 3], log(target[:3, :3] @ tcp[:3, :3].T)])
        if np.abs(error).max() < 1e-13:
            return q
        step = np.linalg.solve(jacobian, error)
        q += step * min(1.0, 0.3 / np.abs(step).max())
    raise AssertionError("no solution")


@dataclass
class Motion:
    """``target`` in the base, None for an axis motion; ``axes`` (6,); ``e`` (6,) mm or deg at its end."""

    target: np.ndarray | None
    axes: np.ndarray | None
    e: np.ndarray
    force: np.ndarray | None
    line: int


def read(text, points=None, start=0.0):
    """The motions of a program; ``points``: name -> text of its aggregate; E before it is stated is ``start``."""
    values, e, force, found = {}, np.full(6, float(start)), None, []
    for line, words in enumerate(text.splitlines(), 1):
        said = words.strip()
        if said.startswith(";FORCE"):
            force = None if "OFF" in said else np.array([float(w) for w in said.split()[1:] if w[0] != "@"])
        match = re.match(r"(PTP|LIN)\s+(\{.*?\}|\w+)", said)
        if not match:
            continue
        stated = {key: float(value) for key, value in WORDS.findall((points or {}).get(match[2], match[2]))}
        e = e.copy()
        for key in [key for key in stated if key[0] == "E"]:
            e[int(key[1]) - 1] = stated.pop(key)
        if "A1" in stated:
            axes = np.radians([stated[f"A{i}"] for i in range(1, 7)])
            found.append(Motion(None, axes, e, None, line))
        else:
            values |= stated
            target = pose(*(values[key] for key in "XYZABC"))
            found.append(Motion(target, None, e, None if match[1] == "PTP" else force, line))
    return found


@dataclass
class Scene:
    """The cell: ``tracks`` number of E -> direction in the world; ``turns`` [(number of E, axis, point)] of what the
    base stands on, the lowest first, in the world at zero."""

    base: np.ndarray
    robot_base: np.ndarray = field(default_factory=lambda: np.eye(4))
    tool: np.ndarray = field(default_factory=lambda: pose(0, 0, 250))
    tracks: dict = field(default_factory=dict)
    turns: list = field(default_factory=list)

    def part(self, e):
        """The programmed base in the world."""
        placed = np.eye(4)
        for number, axis, point in self.turns:
            placed = placed @ screw(
                np.asarray(axis, float), np.asarray(point) / 1000, np.radians(e[number - 1])
            )
        return placed @ self.base

    def robot(self, e):
        """The robot base in the world."""
        moved = sum(
            (e[number - 1] / 1000 * np.asarray(way, float) for number, way in self.tracks.items()),
            np.zeros(3),
        )
        return shift(moved) @ self.robot_base

    def tool_at(self, command, e, force, near):
        """The tool in the base when the controller is sent to ``command`` under ``force`` (3,) in base axes, and the
        motor angles."""
        to_base = np.linalg.inv(self.part(e)) @ self.robot(e)
        q = inverse(np.linalg.inv(to_base) @ command, self.tool, near)
        wrench = np.concatenate([to_base[:3, :3].T @ force, np.zeros(3)])
        theta = np.zeros(6)
        for _ in range(60):
            _, jacobian = forward(q + theta, self.tool)
            theta = COMPLIANCE * (jacobian.T @ wrench)
        return to_base @ forward(q + theta, self.tool)[0], q


def between(one, two, share):
    """Straight from pose to pose, turning evenly."""
    made = np.eye(4)
    vector = log(one[:3, :3].T @ two[:3, :3])
    angle = np.linalg.norm(vector)
    made[:3, :3] = one[:3, :3] @ (turn(vector / angle, share * angle) if angle else np.eye(3))
    made[:3, 3] = one[:3, 3] + share * (two[:3, 3] - one[:3, 3])
    return made


def beside(place, corners):
    """Distance of a place from the straight lines between corners, and where: (line, share)."""
    best = (np.inf, 0, 0.0)
    for i, (a, b) in enumerate(pairwise(corners)):
        way = b - a
        length = way @ way
        share = 0.0 if length < 1e-18 else float(np.clip((place - a) @ way / length, 0, 1))
        best = min(best, (float(np.linalg.norm(a + share * way - place)), i, share))
    return best
