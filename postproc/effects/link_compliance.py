"""Link compliance: bearings and links that tilt across the axis of their joint."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.effects.effect import LinearCompliance, Parameter
from postproc.robot.geometries import Joint


class LinkCompliance(LinearCompliance):
    """theta = c tau, c [rad/(N m)]: two small turns per joint, theta_x then theta_y about the x and y axes of its
    frame, before its own motion: Rx(theta_x) Ry(theta_y) Rz(q), or Tz(q) of a sliding joint.

    They turn about the origin of the joint's frame, and where on the axis that lies counts: all that follows moves by
    the turn crossed with its distance from there.  It is where ``Joint.placement`` puts it: of ``kuka`` lengths the
    origin of the robot base for A1, the middle of the axis, in the plane of the arm, for A2 and A3, and the wrist
    centre for A4, A5 and A6 alike; of a Denavit-Hartenberg row, standard or modified, the point at d along the axis; of
    a URDF the origin of the joint.  An own linear axis (``rail``) has its frame in the origin of the robot base.

    The x and y axes do not turn with the joint itself.  Of ``kuka`` lengths in the zero pose, in axes X, Y, Z of the
    robot base: A1 has x = X, y = -Y; A2, A3 and A5 x = Z, y = X; A4 and A6 x = Z, y = Y.  A joint that its controller
    counts with ``sign: -1`` has y and z reversed, and one with an ``offset`` starts turned by it about z.

    tau = x . (m + (p - p_i) x f) of the wrench (f, m) at the TCP p, with p_i the origin, and the moment of all weights
    after it about the same axis; y likewise, with the axis that theta_x has turned.
    """

    name = "link_compliance"
    family = "elastic"

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "cross-axis virtual springs of an extended VJM"
        self.parameters = tuple(
            Parameter(f"c{i}{axis}", "rad/(N m)", 0.0, 0.0, 1e-4, source, joint.name)
            for i, joint in enumerate(joints, 1)
            for axis in "xy"
        )
        self.coordinates = tuple(f"{joint.name}.r{axis}" for joint in joints for axis in "xy")
