"""What the reader claims of the motions of a program, held against one execution of it."""

from __future__ import annotations

import judged_motions
import numpy as np
from judged_motions import other_numbers

from postproc.languages.dialect import Program
from tp_judge.machine import DoneMotion


def disagreements(program: Program, done: list[DoneMotion]) -> list[str]:
    """What does not agree, in words."""
    return judged_motions.disagreements(
        program, done, "FTP009", _motion, lambda motion: -2 if motion.from_elsewhere else None
    )


def _motion(program: Program, row: int, motion: DoneMotion, start: int) -> list[str]:
    path = program.toolpath
    wrong = []
    if motion.displaced:
        wrong.append("it is displaced")
    if motion.joint:
        if not np.allclose(np.degrees(path.axes[row]), motion.target, atol=1e-9):
            wrong.append("other axes")
    else:
        if not np.allclose(path.position[row] * 1e3, motion.target[:3], atol=1e-9):
            wrong.append(f"position {path.position[row] * 1e3} instead of {motion.target[:3]}")
        if not np.allclose(path.rotation[row], _matrix(motion.target[3:]), atol=1e-9):
            wrong.append("another orientation")
    wrong += other_numbers(
        row, [("speed", path.feed, motion.speed), ("corner", path.approximation, motion.corner)]
    )
    if bool(path.stops[row]) != motion.stops:
        wrong.append("it stops, or does not")
    frames = path.frames[path.base[row]].number, path.frames[path.tool[row]].number
    if frames != motion.frames:
        wrong.append(f"frames {frames} instead of {motion.frames}")
    if motion.form == "C" and np.isfinite(path.arcs.sweep[row]) and start >= 0:
        wrong += _arc(program, row, start, motion)
    return wrong


def _arc(program: Program, row: int, start: int, motion: DoneMotion) -> list[str]:
    """Start, auxiliary point and end are on the circle, the auxiliary point between the others."""
    path = program.toolpath
    centre, normal, sweep = path.arcs.centre[row], path.arcs.normal[row], path.arcs.sweep[row]
    via = np.array(motion.via[:3]) * 1e-3
    ends = [path.position[start] - centre, via - centre, path.position[row] - centre]
    sizes = [np.linalg.norm(one) for one in ends]
    if max(sizes) - min(sizes) > 1e-7:
        return ["its three points are not on the arc"]
    turns = [np.arctan2(np.cross(ends[0], one) @ normal, ends[0] @ one) % (2 * np.pi) for one in ends[1:]]
    if not (0 < turns[0] < turns[1] and abs(turns[1] - sweep) < 1e-6):
        return ["its auxiliary point is not between start and end"]
    return []


def _matrix(angles: list[float]) -> np.ndarray:
    """W about x, then P about y, then R about z, all fixed."""
    result = np.eye(3)
    for angle, (i, j) in zip(np.radians(angles), ((1, 2), (2, 0), (0, 1)), strict=True):
        turn = np.eye(3)
        turn[i, i] = turn[j, j] = np.cos(angle)
        turn[j, i], turn[i, j] = np.sin(angle), -np.sin(angle)
        result = turn @ result
    return result
