"""What the reader claims of the motions of a program, held against one execution of it."""

from __future__ import annotations

import numpy as np

from postproc.languages.dialect import Program
from rapid_judge.machine import Done, multiply, turn_vector


def disagreements(program: Program, done: list[Done]) -> list[str]:
    """What does not agree, in words."""
    path = program.toolpath
    refused = path.constraints.refused
    row_of = {int(line): row for row, line in enumerate(path.line)}
    wrong: list[str] = []
    before: int | None = None
    for motion in done:
        row = row_of.get(motion.line)
        if row is None:
            wrong.append(f"line {motion.line}: a motion that the reader does not have")
            return wrong
        if row in refused:
            if refused[row].code == "RAP009":
                wrong.append(f"line {motion.line}: it runs, and the reader says that it does not")
        else:
            wrong += [f"line {motion.line}: {what}" for what in _motion(program, row, motion)]
        at = -1 if before is None else before
        if path.continues[row]:
            if at != row - 1:
                wrong.append(f"line {motion.line}: it starts after row {at}, not after the row before it")
        elif at not in path.predecessors.get(row, ()):
            wrong.append(f"line {motion.line}: row {at} is no predecessor of row {row}")
        before = row
    return wrong


def _motion(program: Program, row: int, motion: Done) -> list[str]:
    path = program.toolpath
    wrong = []
    if motion.displaced:
        wrong.append("it is displaced")
    position, rotation = path.position[row] * 1e3, path.rotation[row]
    if not np.allclose(position, motion.target[0], atol=1e-9):
        wrong.append(f"position {position} instead of {motion.target[0]}")
    if not np.allclose(rotation, _matrix(motion.target[1]), atol=1e-9):
        wrong.append("another orientation")
    for word, claimed, actual in (
        ("speed", path.feed[row] * 1e3, motion.speed),
        ("zone", path.approximation[row] * 1e3, motion.zone),
    ):
        if actual is not None and np.isfinite(claimed) and abs(claimed - actual) > 1e-9:
            wrong.append(f"{word} {claimed} instead of {actual}")
    tool = path.frames[path.tool[row]].pose
    if tool is None or not np.allclose(tool.position * 1e3, motion.tool[1][0], atol=1e-9):
        wrong.append("another tool")
    base = path.frames[path.base[row]]
    if isinstance(motion.wobj, str):
        if base.number != 0:
            wrong.append("a work object instead of wobj0")
    else:
        user, inner = motion.wobj[3], motion.wobj[4]
        place = [a + b for a, b in zip(user[0], turn_vector(user[1], inner[0]), strict=True)]
        if base.pose is None or not np.allclose(base.pose.position * 1e3, place, atol=1e-6):
            wrong.append("another work object")
        elif not np.allclose(base.pose.rotation, _matrix(multiply(user[1], inner[1])), atol=1e-6):
            wrong.append("a work object that is turned otherwise")
    force = None
    for note in path.annotations:
        if note.row <= row and note.text.upper().startswith("FORCE"):
            force = note.text
    if force != motion.force:
        wrong.append(f"force {force!r} instead of {motion.force!r}")
    if motion.via is not None and np.isfinite(path.arcs.sweep[row]):
        end = path.position[row]
        via = np.array(motion.via[0]) * 1e-3
        radius = np.linalg.norm(end - path.arcs.centre[row])
        if abs(np.linalg.norm(via - path.arcs.centre[row]) - radius) > 1e-9:
            wrong.append("its auxiliary point is not on the arc")
    return wrong


def _matrix(q) -> np.ndarray:
    q = np.array(q) / np.linalg.norm(q)
    return np.array([turn_vector(list(q), axis) for axis in np.eye(3).tolist()]).T
