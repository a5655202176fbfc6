"""Link geometry: axes that do not lie where the robot's links state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import Poses
from postproc.effects.effect import Conditions, Offset, Parameter, Values, column
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint

_STATES = 60
_INDEPENDENT = 1e-6
"""A column whose part outside of the others is smaller than this share of it adds nothing."""


class LinkGeometry(Offset):
    """The axis of each joint after the first, moved in the frame of that joint: shifts d_x, d_y [m] and turns r_x, r_y
    [rad] across the axis, before its own motion: Tx(d_x) Ty(d_y) Rx(r_x) Ry(r_y) Rz(q), about the origin of the joint's
    frame (see ``LinkCompliance`` for where that lies).

    Only parameters that are not redundant are there: those that joint_offset, base_offset, tool_offset or earlier ones
    cannot imitate, found from the Jacobian at random states (Meggiolaro and Dubowsky's question of redundant error
    parameters, ICRA 2000, answered numerically).
    """

    name = "link_geometry"
    family = "geometric"
    whole = True

    def __init__(self, joints: Sequence[Joint]) -> None:
        names = [f"{joint.name}.{axis}" for joint in joints[1:] for axis in ("x", "y", "rx", "ry")]
        self.coordinates = _independent(joints, names)
        number = {joint.name: i for i, joint in enumerate(joints, 1)}
        self.parameters = tuple(self._parameter(name, number) for name in self.coordinates)

    @staticmethod
    def _parameter(coordinate: str, number: dict[str, int]) -> Parameter:
        joint, axis = coordinate.rsplit(".", 1)
        turn = axis.startswith("r")
        return Parameter(
            f"{'' if turn else 'd'}{axis}{number[joint]}",
            "rad" if turn else "m",
            0.0,
            -0.1 if turn else -0.05,
            0.1 if turn else 0.05,
            "kinematic calibration: place of an axis relative to the one before",
            joint,
        )

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        offset[[chain.index[name] for name in self.coordinates]] += column(values, self.parameters)


def _independent(joints: Sequence[Joint], names: list[str]) -> tuple[str, ...]:
    """Those of ``names`` whose motion of the tool no other frame, joint zero or earlier name can imitate."""
    frames = [f"{site}.{axis}" for site in ("base", "tool") for axis in ("x", "y", "z", "rx", "ry", "rz")]
    chain = Chain(joints, Poses.identity(), [*frames, *names])
    q = np.random.default_rng(0).uniform(-1.5, 1.5, (_STATES, len(joints)))
    motion = chain.jacobian(q, Poses.identity()).reshape(-1, chain.size)
    basis = np.empty((len(motion), 0))
    independent = []
    for name in (*frames, *(joint.name for joint in joints), *names):
        own = motion[:, chain.index[name]]
        rest = own - basis @ (basis.T @ own)
        rest -= basis @ (basis.T @ rest)
        if np.linalg.norm(rest) > _INDEPENDENT * np.linalg.norm(own):
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
            independent.append(name)
    return tuple(name for name in names if name in independent)
