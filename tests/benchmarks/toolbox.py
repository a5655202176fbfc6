"""The linear deflection J K^-1 J^T F with roboticstoolbox-python, a pose at a time by its compiled functions.

    PYTHON -P tests/benchmarks/toolbox.py STATES.npz DEFLECTIONS.npy

PYTHON has roboticstoolbox-python, which needs another numpy than this project: it is a process of its own.  Each line
on its standard input asks for one more repetition, and is answered by its processor time [s].
"""

from __future__ import annotations

import sys
import time

import numpy as np
from roboticstoolbox import ET, ETS


def chain(placements: np.ndarray) -> ETS:
    """Turns about z, each in the frame (4, 4) placed in the one before; the last placement is the tool's."""
    terms = ETS()
    for placement in placements[:-1]:
        terms = terms * ET.SE3(placement) * ET.Rz()
    return terms * ET.SE3(placements[-1])


def deflection(robot: ETS, q: np.ndarray, wrench: np.ndarray, compliance: np.ndarray) -> np.ndarray:
    """(6,) [m, rad] of one pose; the pose itself is evaluated as well."""
    robot.eval(q)
    jacobian = robot.jacob0(q)
    return jacobian @ (compliance * (jacobian.T @ wrench))


def main() -> None:
    states = np.load(sys.argv[1])
    robot = chain(states["placements"])
    q, wrench, compliance = states["q"], states["wrench"], states["compliance"]
    for _ in sys.stdin:
        begin = time.process_time()
        found = [deflection(robot, *state, compliance) for state in zip(q, wrench, strict=True)]
        print(time.process_time() - begin, flush=True)
        np.save(sys.argv[2], found)


if __name__ == "__main__":
    main()
