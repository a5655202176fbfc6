"""What the reader claims of the motions of a program, held against one execution of it."""

from __future__ import annotations

import judged_motions
import numpy as np
from judged_motions import other_numbers

from postproc.base.geometry import Poses
from postproc.languages.dialect import Program
from postproc.toolpath import OrientationMode
from rapid_judge.machine import Done, multiply, turn_vector

NEAR = 1e-3
"""[mm, 1] Numbers of single precision, computed several times, are as near."""


def disagreements(program: Program, done: list[Done]) -> list[str]:
    """What does not agree, in words."""
    return judged_motions.disagreements(
        program, done, "RAP009", _motion, lambda motion: -2 if motion.elsewhere else None
    )


def _motion(program: Program, row: int, motion: Done, _: int) -> list[str]:
    path = program.toolpath
    wrong = []
    if motion.displaced:
        wrong.append("it is displaced")
    if motion.word == "moveextj":
        return [*wrong, "it moves external axes alone"]
    if motion.word == "moveabsj":
        if not np.allclose(np.degrees(path.axes[row]), motion.target[0], atol=NEAR):
            wrong.append("other axes")
        return wrong
    position, rotation = path.position[row] * 1e3, path.rotation[row]
    if not np.allclose(position, motion.target[0], atol=NEAR):
        wrong.append(f"position {position} instead of {motion.target[0]}")
    if not np.allclose(rotation, _matrix(motion.target[1]), atol=NEAR):
        wrong.append("another orientation")
    wrong += other_numbers(
        row, [("speed", path.feed, motion.speed), ("zone", path.approximation, motion.zone)]
    )
    if path.orientation_control.mode[row] == (OrientationMode.VAR if motion.wrist else OrientationMode.JOINT):
        wrong.append("another SingArea")
    tool = path.frames[path.tool[row]].pose
    if motion.tool[0] is not True:
        wrong.append("a tool on the robot")
    elif tool is None or not _same(tool, motion.tool[1]):
        wrong.append("another tool")
    base = path.frames[path.base[row]]
    if isinstance(motion.wobj, str):
        if base.number != 0:
            wrong.append("a work object instead of wobj0")
    elif motion.wobj[0] or not motion.wobj[1]:
        wrong.append("a work object that stands still")
    else:
        user, inner = motion.wobj[3], motion.wobj[4]
        place = [a + b for a, b in zip(user[0], turn_vector(user[1], inner[0]), strict=True)]
        if base.pose is None or not _same(base.pose, [place, multiply(user[1], inner[1])]):
            wrong.append("another work object")
    if motion.via is not None and np.isfinite(path.arcs.sweep[row]):
        end = path.position[row]
        via = np.array(motion.via[0]) * 1e-3
        radius = np.linalg.norm(end - path.arcs.centre[row])
        if abs(np.linalg.norm(via - path.arcs.centre[row]) - radius) > 1e-3 * NEAR:
            wrong.append("its auxiliary point is not on the arc")
    return wrong


def _same(pose: Poses, stated: list) -> bool:
    return np.allclose(pose.position * 1e3, stated[0], atol=NEAR) and np.allclose(
        pose.rotation, _matrix(stated[1]), atol=NEAR
    )


def _matrix(q) -> np.ndarray:
    q = np.array(q) / np.linalg.norm(q)
    return np.array([turn_vector(list(q), axis) for axis in np.eye(3).tolist()]).T
