"""The floor of a whole run: what a plain program does that corrects nothing.

    python -m tests.benchmarks.floor PROGRAM OUTPUT

It reads a KRL program line by line, takes six numbers out of each LIN by one regular expression, evaluates the robot
once there with Pinocchio (flange and Jacobian), and formats and writes the line.  No inverse kinematics, force,
equilibrium, check, or report; the six numbers, scaled, serve as axis angles.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin

from postproc.robot.chain import Chain
from postproc.robot.description import find_robot, load_robot

NUMBER = r"([-+]?\d*\.?\d+)"
LINE = re.compile(r"LIN \{" + ",".join(f"{word} {NUMBER}" for word in "XYZABC") + r"\}(.*)", re.DOTALL)
FORMAT = "LIN {X %.3f,Y %.3f,Z %.3f,A %.3f,B %.3f,C %.3f}%s"
SCALE = 1e-3


def run(program: Path, output: Path) -> int:
    """How many motions were written."""
    robot = load_robot(find_robot("kuka_kr270"))
    chain = Chain(robot.joints, robot.flange)
    model, flange, count = chain.model, chain.model.getFrameId("flange"), 0
    data, axes = pin.Data(model), np.zeros(model.nq)
    frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    with open(program, newline="") as lines, open(output, "w", newline="") as out:
        for line in lines:
            found = LINE.match(line)
            if found is None:
                out.write(line)
                continue
            *words, rest = found.groups()
            x, y, z, a, b, c = axes[:] = [float(word) for word in words]
            axes *= SCALE
            pin.computeJointJacobians(model, data, axes)
            pin.updateFramePlacement(model, data, flange)
            pin.getFrameJacobian(model, data, flange, frame)
            dx, dy, dz = data.oMf[flange].translation.tolist()
            out.write(FORMAT % (x + SCALE * dx, y + SCALE * dy, z + SCALE * dz, a, b, c, rest))
            count += 1
    return count


if __name__ == "__main__":
    print(run(*map(Path, sys.argv[1:])))
