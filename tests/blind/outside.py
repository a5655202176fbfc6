"""Effects that the library does not have; they live here and nowhere else.

    leaning_stiffness     a joint gives way the more the further another one leans: c (1 + e sin(q_k)) tau
    quadratic_bending     a link bends with the square of the torque at its joint: theta = k tau |tau|
    loose_flange          an interface that opens beyond its preload: no tilt up to a torque tau_0, c (|tau| - tau_0)
                          beyond it, across the axis of a joint
    hose_package          a hose from the shoulder to the wrist that pulls as k max(0, l - l_0)^2, loaded or not
    half_harmonic         a bearing ring that creeps: an error of a joint over two turns, sin(q / 2) and cos(q / 2)
    tracker_eccentricity  the circle of the tracker's horizontal encoder runs off centre: its azimuth is off by
                          s sin(azimuth) + c cos(azimuth)
    windup                friction in proportion to load: a gear stops short by mu c |tau| on the side it came from

Each hides in readings of one kind: the first three in deflections, the others in absolute places.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from plant import Plant

Shift = Callable[[float, np.ndarray, np.ndarray], float]
"""Torque [N m] on a coordinate, angles (6,) and senses of approach (6,) of the joints -> displacement [rad]."""


@dataclass(frozen=True)
class Law:
    """A displacement of the coordinate ``name`` beside that of its own spring."""

    name: str
    shift: Shift


@dataclass(frozen=True)
class Hose:
    """From ``start`` (3,) [m] on the ground to ``end`` (3,) on link 4: tension k max(0, l - slack)^2 [N, N/m2, m]."""

    start: np.ndarray
    end: np.ndarray
    k: float
    slack: float


class Beyond(Plant):
    """The plant with what no library has."""

    def __init__(
        self, arm, compliance, spring, hardware, laws: tuple[Law, ...] = (), hose: Hose | None = None
    ):
        super().__init__(arm, compliance, spring, hardware)
        self.laws, self.hose = laws, hose
        self._link4 = self.model.body("link4").id

    def residual(self, coordinates, free, held, wrench):
        force = super().residual(coordinates, free, held, wrench)
        for law in self.laws:
            row = self.row_of[law.name]
            stiffness = 1 / self.compliances[row]
            torque = force[row] + stiffness * (coordinates - free)[row]
            force[row] += stiffness * law.shift(torque, coordinates[self.motor_rows], self.directions)
        if self.hose is not None:
            force += self._pull()
        return force

    def _pull(self) -> np.ndarray:
        hose, linear = self.hose, np.zeros((3, self.size))
        end = self.data.xpos[self._link4] + self.data.xmat[self._link4].reshape(3, 3) @ hose.end
        mujoco.mj_jac(self.model, self.data, linear, None, end, self._link4)
        way = hose.start - end
        length = np.linalg.norm(way)
        return linear.T @ (way / length * hose.k * max(0.0, length - hose.slack) ** 2)
