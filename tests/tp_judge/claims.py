"""What the reader claims of the motions of a program, held against one execution of it."""

from __future__ import annotations

import numpy as np

from postproc.languages.dialect import Program
from tp_judge.machine import DoneMotion


def disagreements(program: Program, done: list[DoneMotion]) -> list[str]:
    """What does not agree, in words."""
    path = program.toolpath
    refused = path.constraints.refused
    row_of = {int(line): row for row, line in enumerate(path.line)}
    wrong: list[str] = []
    before: int | None = None
    for motion in done:
        row = row_of.get(motion.line)
        if row is None:
            return [*wrong, f"line {motion.line}: a motion that the reader does not have"]
        if row in refused:
            if refused[row].code == "FTP009":
                wrong.append(f"line {motion.line}: it runs, and the reader says that it does not")
        else:
            wrong += [f"line {motion.line}: {what}" for what in _motion(program, row, motion)]
        at = -2 if motion.from_elsewhere else -1 if before is None else before
        if path.continues[row]:
            if at != row - 1:
                wrong.append(f"line {motion.line}: it starts after row {at}, not after the row before it")
        elif at not in path.predecessors.get(row, ()):
            wrong.append(f"line {motion.line}: row {at} is no predecessor of row {row}")
        if motion.form == "C" and np.isfinite(path.arcs.sweep[row]) and at >= 0:
            wrong += [f"line {motion.line}: {what}" for what in _arc(program, row, at, motion)]
        before = row
    return wrong


def _motion(program: Program, row: int, motion: DoneMotion) -> list[str]:
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
    for word, claimed, actual in (
        ("speed", path.feed[row] * 1e3, motion.speed),
        ("corner", path.approximation[row] * 1e3, motion.corner),
    ):
        if actual is not None and np.isfinite(claimed) and abs(claimed - actual) > 1e-9:
            wrong.append(f"{word} {claimed} instead of {actual}")
    if bool(path.stops[row]) != motion.stops:
        wrong.append("it stops, or does not")
    frames = path.frames[path.base[row]].number, path.frames[path.tool[row]].number
    if frames != motion.frames:
        wrong.append(f"frames {frames} instead of {motion.frames}")
    force = None
    for note in path.annotations:
        if note.row <= row and note.text.upper().startswith("FORCE"):
            force = note.text
    if force != motion.force:
        wrong.append(f"force {force!r} instead of {motion.force!r}")
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
