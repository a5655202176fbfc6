"""The kinematic chain: described by Pinocchio, evaluated for whole batches in numpy.

Pinocchio's model is the one description and the reference.  Its joint placements are read back into the
batch evaluation, which works component-wise on arrays with the poses in the last, contiguous axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from postproc.arrays import Floats
from postproc.geometry import Poses
from postproc.robot.description import Joint


@dataclass(frozen=True)
class Sweep:
    """The chain at N states, component first: ``axes`` and ``origins`` (n, 3, N) of the joints in the robot base,
    ``rotation`` (3, 3, N; row, column) and ``position`` (3, N) of the flange [m]."""

    axes: Floats
    origins: Floats
    rotation: Floats
    position: Floats


class Chain:
    """A serial chain of revolute joints about their own z axes, with a flange at its end."""

    def __init__(self, joints: tuple[Joint, ...], flange: Poses) -> None:
        self.model = pin.Model()
        parent = 0
        for joint in joints:
            placement = pin.SE3(np.array(joint.placement.rotation), np.array(joint.placement.position))
            parent = self.model.addJoint(parent, pin.JointModelRZ(), placement, joint.name)
        tip = pin.SE3(np.array(flange.rotation), np.array(flange.position))
        frame = pin.Frame("flange", parent, 0, tip, pin.FrameType.OP_FRAME)
        self.flange_id = self.model.addFrame(frame)
        self._placements = [self.model.jointPlacements[i] for i in range(1, self.model.njoints)]
        self._tip = self.model.frames[self.flange_id].placement

    @property
    def size(self) -> int:
        return int(self.model.nq)

    def sweep(self, q: Floats) -> Sweep:
        """Evaluate at joint angles ``q`` (n, N) [rad]."""
        n, count = q.shape
        sines, cosines = np.sin(q), np.cos(q)
        axes, origins = np.empty((n, 3, count)), np.empty((n, 3, count))
        columns = [np.repeat(unit[:, None], count, axis=1) for unit in np.eye(3)]
        position = np.zeros((3, count))
        for i, placement in enumerate(self._placements):
            position = _along(columns, placement.translation, position)
            x, y, z = (_along(columns, column) for column in placement.rotation.T)
            sine, cosine = sines[i], cosines[i]
            columns = [cosine * x + sine * y, cosine * y - sine * x, z]
            axes[i], origins[i] = z, position
        position = _along(columns, self._tip.translation, position)
        columns = [_along(columns, column) for column in self._tip.rotation.T]
        return Sweep(axes, origins, np.stack(columns, axis=1), position)

    def flange(self, q: Floats) -> Poses:
        """Flange poses at ``q`` (N, n) [rad] in the robot base."""
        swept = self.sweep(np.ascontiguousarray(q.T))
        return Poses(np.moveaxis(swept.rotation, -1, 0), np.ascontiguousarray(swept.position.T))

    def jacobian(self, q: Floats, tool: Poses) -> Floats:
        """Geometric Jacobians (N, 6, n) of the TCP: linear part first, axes of the robot base.

        Column i is [z_i x (p - p_i); z_i] (a revolute joint).
        """
        swept = self.sweep(np.ascontiguousarray(q.T))
        arm = tcp_position(swept, tool)[None] - swept.origins
        linear = np.cross(swept.axes, arm, axis=1)
        return np.moveaxis(np.concatenate([linear, swept.axes], axis=1), (0, 1, 2), (2, 1, 0))

    def reference_flange(self, q: Floats) -> Poses:
        """``flange`` by Pinocchio itself, state by state: the reference for the batch evaluation."""
        data = self.model.createData()
        rotation, position = np.empty((len(q), 3, 3)), np.empty((len(q), 3))
        for row, state in enumerate(q):
            pin.framesForwardKinematics(self.model, data, state)
            rotation[row] = data.oMf[self.flange_id].rotation
            position[row] = data.oMf[self.flange_id].translation
        return Poses(rotation, position)


def tcp_position(swept: Sweep, tool: Poses) -> Floats:
    """(3, N) [m] position of the TCP; ``tool`` is its pose on the flange, one or N."""
    offset = np.broadcast_to(tool.position, (swept.position.shape[1], 3)).T
    return swept.position + np.einsum("ijn,jn->in", swept.rotation, offset)


def generalized_force(swept: Sweep, point: Floats, wrench: Floats) -> Floats:
    """J^T w (n, N) [N m] of a wrench (6, N) [N, N m] that acts at ``point`` (3, N) [m]; robot base axes.

    tau_i = z_i . (m + (p - p_i) x f)
    """
    fx, fy, fz = wrench[:3]
    mx, my, mz = wrench[3:] + _cross(point, wrench[:3])
    px, py, pz = swept.origins[:, 0], swept.origins[:, 1], swept.origins[:, 2]
    zx, zy, zz = swept.axes[:, 0], swept.axes[:, 1], swept.axes[:, 2]
    return zx * (mx - (py * fz - pz * fy)) + zy * (my - (pz * fx - px * fz)) + zz * (mz - (px * fy - py * fx))


def _cross(a: Floats, b: Floats) -> Floats:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _along(columns: list[Floats], weights: Floats, start: Floats | None = None) -> Floats:
    """start + sum of weight * column; the many zeros of a robot's placements cost nothing."""
    total = start
    for column, weight in zip(columns, weights, strict=True):
        if weight == 0.0:
            continue
        term = column if weight == 1.0 else weight * column
        total = term if total is None else total + term
    return np.zeros_like(columns[0]) if total is None else total
