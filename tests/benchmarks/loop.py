"""The mirror correction as a plain Python loop over Pinocchio calls, a pose at a time.

The same mathematics as ``postproc.compensation.mirror``, from the same start to the same tolerances: motors by the
inverse kinematics of the nominal robot (here Newton's method on SE(3) with Pinocchio's Jacobian, from the motors
before), the loaded joints by Newton steps on K theta = J^T w + M_c(q + theta) - M_c(q), the tool by Pinocchio's forward
kinematics of them, and the command moved the other way.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from postproc.base.geometry import Poses
from postproc.compensation.mirror import ANGLE_TOLERANCE, MAX_ITERATIONS, POSITION_TOLERANCE, REST
from postproc.model import MAX_STEPS, StiffnessModel
from postproc.robot.chain import Chain

INVERSE_TOLERANCE = 1e-11
"""[m, rad] far below what the two results are compared to."""


class Corrected(NamedTuple):
    """Of one pose: the command and the loaded tool's pose, axes of the robot base."""

    command: pin.SE3
    real: pin.SE3


class Loop:
    """A robot with elastic joints, a balanced compensator and one tool."""

    def __init__(self, model: StiffnessModel, tool: Poses) -> None:
        robot = model.robot
        if robot.nominal is not robot.arm:
            raise ValueError("the controller's geometry is another than the arm's")
        terms = {term.effect.name: term for term in model.terms}
        if set(terms) != {"joint_compliance", "gravity_compensator"}:
            raise ValueError(f"another model than this loop's: {sorted(terms)}")
        chain = Chain(robot.joints, robot.flange)
        self.model, flange = chain.model, chain.model.frames[chain.model.getFrameId("flange")]
        placed = flange.placement * pin.SE3(np.array(tool.rotation), np.array(tool.position))
        frame = pin.Frame("tcp", flange.parentJoint, 0, placed, pin.FrameType.OP_FRAME)
        self.tcp = self.model.addFrame(frame)
        self.data = pin.Data(self.model)
        self.stiffness = np.diag([1.0 / c for c in terms["joint_compliance"].values.values()])
        effect, self.spring = terms["gravity_compensator"].effect, terms["gravity_compensator"].values
        if (effect.preload, effect.sign) != ("balanced", "energy"):
            raise ValueError("another compensator than this loop's")
        self.joint, self.zero = effect.joint, effect.zero

    def corrected(self, wanted: pin.SE3, q: np.ndarray, wrench: np.ndarray) -> Corrected:
        """The command that brings the tool to ``wanted`` under ``wrench`` (6,), the motors of which are near ``q``."""
        command, theta = wanted.copy(), np.zeros(6)
        for _ in range(MAX_ITERATIONS + 1):
            q = self.inverse(command, q)
            real, theta = self.rest(q, wrench, theta)
            shift = real.translation - wanted.translation
            turn = pin.log3(real.rotation @ wanted.rotation.T)
            if np.linalg.norm(shift) <= POSITION_TOLERANCE and np.linalg.norm(turn) <= ANGLE_TOLERANCE:
                return Corrected(command, real)
            command = pin.SE3(pin.exp3(-turn) @ command.rotation, command.translation - shift)
        raise ArithmeticError("the loop does not settle")

    def inverse(self, target: pin.SE3, q: np.ndarray) -> np.ndarray:
        """Motors (6,) [rad] near ``q`` that bring the TCP to ``target``."""
        for _ in range(MAX_STEPS):
            pin.framesForwardKinematics(self.model, self.data, q)
            away = pin.log6(self.data.oMf[self.tcp].actInv(target)).vector
            if np.linalg.norm(away) <= INVERSE_TOLERANCE:
                return q
            jacobian = pin.computeFrameJacobian(self.model, self.data, q, self.tcp, pin.LOCAL)
            q = q + np.linalg.solve(jacobian, away)
        raise ArithmeticError("the inverse kinematics does not settle")

    def rest(self, q: np.ndarray, wrench: np.ndarray, theta: np.ndarray) -> tuple[pin.SE3, np.ndarray]:
        """The tool's pose and the displacement (6,) of the joints, from ``theta`` (6,) on."""
        balanced, _ = self.torque(q[self.joint])
        last = 0.0
        for _ in range(MAX_STEPS):
            there = q + theta
            jacobian = pin.computeFrameJacobian(
                self.model, self.data, there, self.tcp, pin.LOCAL_WORLD_ALIGNED
            )
            force = jacobian.T @ wrench
            torque, slope = self.torque(there[self.joint])
            force[self.joint] += torque - balanced
            stiffness = self.stiffness.copy()
            stiffness[self.joint, self.joint] -= slope
            step = np.linalg.solve(stiffness, force - self.stiffness @ theta)
            theta = theta + step
            size = np.abs(step).max()
            left, last = size * size / (last - size) if size < last else size, size
            if left <= REST:
                pin.framesForwardKinematics(self.model, self.data, q + theta)
                return self.data.oMf[self.tcp].copy(), theta
        raise ArithmeticError("the equilibrium does not settle")

    def torque(self, angle: float) -> tuple[float, float]:
        """[N m], [N m/rad] of the compensator: eq. (2) of Klimchik et al. and its derivative."""
        values = self.spring
        x, y, length, s0, k = (values[name] for name in ("a_x", "a_y", "L", "s0", "K_c"))
        phi = math.atan2(y, x) + angle - self.zero
        product = math.hypot(x, y) * length
        sine, cosine = math.sin(phi), math.cos(phi)
        s2 = x * x + y * y + length * length + 2 * product * cosine + values["h"] ** 2
        ratio = s0 / math.sqrt(s2)
        slope = cosine - ratio * (product / s2 * sine * sine + cosine)
        return k * (1 - ratio) * product * sine, k * product * slope
