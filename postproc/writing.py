"""The compensated program as edits on its bytes, read back and checked before it may exist."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc import __version__
from postproc.cell import Cell
from postproc.compensation.correct import Result, Task, with_residual
from postproc.dialects.dialect import Dialect, Plan, Program, Writing
from postproc.document import Document, Edit, apply, undone
from postproc.findings import Finding, Refusal
from postproc.geometry import Poses, vector_from_rotation
from postproc.robot.description import Robot
from postproc.toolpath import Toolpath
from postproc.units import DEG, MM


@dataclass(frozen=True)
class Written:
    """``edits`` make the output; ``contents`` are its bytes, a document each; ``result`` has the residual predicted
    from the digits in them."""

    edits: tuple[Edit, ...]
    contents: tuple[bytes, ...]
    result: Result


def write(
    program: Program,
    dialect: Dialect,
    task: Task,
    result: Result,
    cell: Cell,
    robot: Robot,
    stem: str,
    completed: Callable[[Toolpath], Toolpath],
) -> Written:
    """Turn a correction into text, under the module name ``stem``.

    ``completed``: fills in what a target that was read back leaves to the axis motion before it.
    Raises Refusal FIL011 (no module name) and FIL008 (what was read back is not what was meant).
    """
    path = task.toolpath
    commanded = task.base.inverse() @ result.command
    moves = result.corrected
    planned = Poses(
        np.where(moves[:, None, None], commanded.rotation, path.rotation),
        np.where(moves[:, None], commanded.position, path.position),
    )
    decimals = {"mm": _decimals(cell.tolerance / MM), "deg": _decimals(cell.tolerance_angle / DEG)}
    plan = replace(Plan.of(path), position=planned.position, rotation=planned.rotation)
    edits = list(dialect.moved(program, plan, Writing(decimals["mm"], decimals["deg"])).edits)
    if edits:
        edits.append(dialect.marked(program, _mark(program, robot)))
    main = program.documents[0].path
    if stem != main.stem:
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]{0,23}", stem):
            raise Refusal(Finding("FIL011", f"{stem!r} can not name a module", str(main)))
        edits += dialect.renamed(program, stem)
    contents = _contents(program, edits)
    documents = zip(program.documents, contents, strict=True)
    back = completed(
        dialect.read(tuple(Document(document.path, raw) for document, raw in documents)).toolpath
    )
    _hold(path, back, planned, decimals, main.name)
    return Written(tuple(edits), contents, with_residual(task, result, task.base @ back.target_in_base))


def _decimals(tolerance: float) -> int:
    """Decimals whose rounding stays below a twentieth of the tolerance; three at least."""
    return max(3, math.ceil(-math.log10(tolerance / 10)))


def _mark(program: Program, robot: Robot) -> str:
    """Says which version, robot file and source made the output."""
    digests = [document.digest for document in program.documents]
    source = digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()
    return f"{__version__}, robot {robot.name} sha256:{robot.digest[:16]}, source sha256:{source[:16]}"


def _contents(program: Program, edits: Sequence[Edit]) -> tuple[bytes, ...]:
    """The bytes of every document with its edits.  Raises Refusal FIL008 if another byte changed."""
    contents = []
    for index, document in enumerate(program.documents):
        own = [edit for edit in edits if edit.span.file == index]
        raw = apply(document, own)
        if not undone(raw, document.raw, own):
            raise Refusal(Finding("FIL008", "bytes outside of the corrections changed", document.path.name))
        contents.append(raw)
    return tuple(contents)


def _hold(path: Toolpath, back: Toolpath, planned: Poses, decimals: Mapping[str, int], file: str) -> None:
    """The program read back is the one that was meant, motion by motion.  Raises Refusal FIL008."""
    if len(back) != len(path):
        raise Refusal(Finding("FIL008", f"{len(path)} motions became {len(back)}", file))
    if not len(path):
        return
    if back.refused.keys() != path.refused.keys():
        raise Refusal(Finding("FIL008", "other motions than before are not understood", file))
    for name in ("kind", "base", "tool", "status", "turn", "axes", "feed"):
        before, after = getattr(path, name).reshape(len(path), -1), getattr(back, name).reshape(len(path), -1)
        same = ((before == after) | ((before != before) & (after != after))).all(axis=1)
        if not same.all():
            row = int(np.argmin(same))
            raise Refusal(Finding("FIL008", f"the {name} of a motion changed", file, int(path.line[row])))
    known = np.isfinite(path.position[:, 0])
    if not np.array_equal(np.isfinite(back.position[:, 0]), known):
        raise Refusal(Finding("FIL008", "targets were lost or appeared", file))
    off = np.abs(back.position - planned.position).max(axis=1) / MM
    turned = np.swapaxes(planned.rotation, -1, -2) @ back.rotation
    angle = (
        np.linalg.norm(vector_from_rotation(np.where(known[:, None, None], turned, np.eye(3))), axis=1) / DEG
    )
    # Half a written step a coordinate; three angles add up.
    step_mm, step_deg = 10.0 ** -decimals["mm"], 10.0 ** -decimals["deg"]
    wrong = known & ((off > 0.5001 * step_mm) | (angle > 1.5001 * step_deg))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise Refusal(
            Finding(
                "FIL008",
                f"a target is {off[row]:.6f} mm, {angle[row]:.6f} deg from what was meant",
                file,
                int(path.line[row]),
            )
        )
