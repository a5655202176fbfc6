"""FORCE comments: modal, from their line on.

``FORCE fx fy fz [mx my mz] [@frame]`` in N and N m, or ``FORCE OFF``; blanks or commas between, any case.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.base.findings import Finding, Refusal
from postproc.process.stated_forces import BASE, NotAForce, StatedForces, is_number_like, parse_force
from postproc.process.wrenches import is_air
from postproc.toolpath import Annotation, Toolpath
from postproc.toolpath.meant_comments import meant_as_force

FORM = "write FORCE fx fy fz [mx my mz] [@base|world|tool|feed] in N and N m, or FORCE OFF"
_FORCE = re.compile(r"force", re.IGNORECASE)
_REST = re.compile(r"force(?=[\s,@]|\Z)[\s,]*", re.IGNORECASE)

_OFF = ((0.0,) * 6, BASE)


def read_annotations(
    toolpath: Toolpath, file: str, rapids: bool = False
) -> tuple[StatedForces | None, tuple[Finding, ...]]:
    """What the FORCE comments state for every motion; None where there is none.

    Comments that only start with FORCE are reported (FRC006), and motions that are air whatever their force (FRC009),
    unless these are ``rapids`` (G0), with which nobody cuts.  Refusal FRC002 for every malformed one, and for every
    comment that was meant to be one.
    """
    rows, forces = [], []
    ignored, wrong = [], []
    for annotation in sorted(toolpath.annotations, key=lambda a: a.row):
        if not _FORCE.match(annotation.text.strip()):
            continue
        try:
            force = _parse(annotation)
        except NotAForce as error:
            message = f"{annotation.text.strip()[:60]!r}: {error}"
            wrong.append(Finding("FRC002", message, file, annotation.line, help=FORM))
            continue
        if force is None and meant_as_force(annotation.text):
            wrong.append(_misspelt(annotation, file))
            continue
        if force is None:
            message = f"{annotation.text.strip()[:60]!r} is not a force; it is ignored"
            ignored.append(Finding("FRC006", message, file, annotation.line, help=FORM))
            continue
        rows.append(annotation.row)
        forces.append(force)
    wrong += [_misspelt(comment, file) for comment in toolpath.comments if meant_as_force(comment.text)]
    if wrong:
        raise Refusal(*wrong)
    if not rows:
        return None, tuple(ignored)
    values = np.array([_OFF[0], *(value for value, _ in forces)])
    frames = np.array([_OFF[1], *(frame for _, frame in forces)])
    stated = StatedForces(values, frames, latest(rows, len(toolpath)))
    return stated, (*ignored, *([] if rapids else _jumps(stated, toolpath, file)))


def _misspelt(comment: Annotation, file: str) -> Finding:
    message = f"{comment.text.strip()[:60]!r} resembles a force comment, and is none"
    return Finding("FRC002", message, file, comment.line, help=FORM)


def _jumps(stated: StatedForces, toolpath: Toolpath, file: str) -> list[Finding]:
    """The point-to-point motions for which a comment states a force, as one finding."""
    lost = np.flatnonzero(stated.acts & is_air(toolpath))
    if not len(lost):
        return []
    line = int(toolpath.line[lost[0]])
    more = f" (and {len(lost) - 1} more)" if len(lost) > 1 else ""
    what = (
        f"line {line} is a point-to-point motion under a FORCE comment: it is taken as air and not corrected"
    )
    help = "write a straight line (LIN, MoveL, L) where it cuts, and FORCE OFF before it where it does not"
    return [Finding("FRC009", what + more, file, line, help=help)]


def marked_air(toolpath: Toolpath) -> Bools:
    """(N,) motions under FORCE OFF: air, whatever another source states of their force."""
    rows, off = [], [False]
    for annotation in sorted(toolpath.annotations, key=lambda a: a.row):
        with contextlib.suppress(NotAForce):
            force = _parse(annotation)
            if force is not None:
                rows.append(annotation.row)
                off.append(force == _OFF)
    return np.array(off)[latest(rows, len(toolpath))]


def latest(rows: Sequence[int], count: int) -> Ints:
    """(count,) how many of the ascending ``rows`` lie at or before each of ``count`` motions: the last one's number
    from 1, 0 where there is none yet."""
    lasts = np.diff(np.clip([0, *rows, count], 0, count))
    return np.repeat(np.arange(len(rows) + 1, dtype=np.int32), lasts)


def _parse(annotation: Annotation) -> tuple[tuple[float, ...], int] | None:
    """The force of a comment; None where it is no annotation; raises NotAForce where it is a malformed one."""
    text = annotation.text.strip()
    word = _REST.match(text)
    if word is None:
        return None
    rest = text[word.end() :]
    second = re.split(r"[\s,]", rest, maxsplit=1)[0]
    if second.lower() == "off":
        if rest[len(second) :].strip():
            raise NotAForce("nothing may follow OFF")
        return _OFF
    if second and not second.startswith("@") and not is_number_like(second):
        return None
    if not rest.partition("@")[0].strip():
        raise NotAForce("the numbers are missing")
    return parse_force(rest)
