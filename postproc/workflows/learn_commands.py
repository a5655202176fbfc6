"""The program that cut a part, and where it sent the controller when it cut a place of the original."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.base.read_files import read_text_file
from postproc.base.units import MM
from postproc.learning.measured_part import MeasuredPart
from postproc.verification.pairing import Different, Pairing, pair_motions
from postproc.workflows.preparation import Prepared, Request, prepare

SHORT = 12
"""Digits of a SHA-256 that name a kept program."""

_SEARCH, _SEARCH_SHARE = 20 * MM, 0.03
_AWAY = 12 * MM


def cutting_file(main: Path, part: MeasuredPart, kept: Sequence[Path] = ()) -> tuple[Path, str]:
    """The file of the program that cut ``part``, and its SHA-256; ``kept``: folders with copies of programs by the
    start of their SHA-256.  Raises Refusal LRN002."""
    places = [main]
    if part.cut_with:
        places = [folder / part.cut_with for folder in (part.file.parent, main.parent)]
    places += [folder / part.program_digest[:SHORT] / main.name for folder in kept]
    found = [path for path in places if path.is_file()]
    for path in found:
        digest = hashlib.sha256(read_text_file(path)).hexdigest()
        if digest.startswith(part.program_digest):
            return path, digest
    if not found:
        message = f"# cut_with: {part.cut_with} is neither beside this file nor beside {main.name}"
        raise Refusal(Finding("LRN002", message, str(part.file), help="name the program that cut the part"))
    digest = hashlib.sha256(read_text_file(found[0])).hexdigest()
    message = (
        f"{found[0].name} is not the program that cut this part: its SHA-256 starts with {digest[:SHORT]}"
    )
    help = f"the file states {part.program_digest[:SHORT]}; name the program as it ran, not a later one"
    raise Refusal(Finding("LRN002", message, str(part.file), help=help))


def cutting_program(
    request: Request, ready: Prepared, part: MeasuredPart, kept: Sequence[Path] = ()
) -> tuple[Prepared | None, Pairing | None]:
    """The program that cut ``part``, None for the original; ``kept``: of ``cutting_file``.  Raises Refusal LRN002."""
    main = request.program
    path, _ = cutting_file(main, part, kept)
    if path.resolve() == main.resolve():
        return None, None
    cell = ready.cell.path
    other = prepare(replace(request, program=path, force=None, cell=cell if cell.is_file() else request.cell))
    try:
        pairing = pair_motions(ready.task, other.task)
        _check_air(ready, other, pairing)
    except Different as error:
        message = f"{path.name} does not come from {main.name}: {error}"
        raise Refusal(
            Finding("LRN002", message, str(part.file), help="name the original of this program")
        ) from None
    return other, pairing


def _check_air(ready: Prepared, other: Prepared, pairing: Pairing) -> None:
    """A correction leaves air moves where they are, but for the one to the start of a cut.  Raises Different."""
    one, run = ready.task.toolpath, other.task.toolpath
    apart = np.linalg.norm(run.position[pairing.run_air] - one.position[pairing.air], axis=1)
    far = np.flatnonzero(np.nan_to_num(apart) > ready.cell.max_correction)
    if len(far):
        first = int(far[0])
        line, its = int(one.line[pairing.air[first]]), int(run.line[pairing.run_air[first]])
        message = (
            f"its line {its} ends {apart[first] / MM:.0f} mm from where line {line} of the original does"
        )
        raise Different(message, line)


def commands_at(
    ready: Prepared, other: Prepared, pairing: Pairing, row: Ints, share: Floats
) -> tuple[Poses, Bools]:
    """Poses (K) that program ``other`` commands where the original is at ``share`` (K,) of motions ``row`` (K,), and
    (K,) whether that is not known: the place of the paired cut, about as far along its path, that is nearest to where
    the model would send the controller.  A correction is longer than what two models differ by."""
    task, run = ready.task, other.task
    wanted = task.desired_path.at(row, share)
    wrench = task.force.along(row, share)
    sent = task.command(row, wanted, wrench, task.goal(row, wanted, share), share=share)
    aim = np.where(sent.converged[:, None], sent.command.position, wanted.position)
    lost = np.ones(len(row), bool)
    at, along = np.zeros(len(row), np.int64), np.zeros(len(row))
    cuts = pairing.stretches
    cut = np.searchsorted(cuts.start, row, side="right") - 1
    for number in np.unique(cut).tolist():
        if number < 0:
            continue
        own = np.flatnonzero((cut == number) & (row < cuts.stop[number]))
        first, last = int(pairing.start[number]), int(pairing.stop[number])
        if not len(own) or last <= first:
            continue
        rows = np.arange(first, last)
        start, end = run.desired_path.start[rows], run.desired_path.end[rows]
        length = task.desired_path.length[cuts.start[number] : cuts.stop[number]]
        station = np.append(0.0, np.cumsum(length))
        place = station[row[own] - cuts.start[number]] + share[own] * length[row[own] - cuts.start[number]]
        ends = np.cumsum(run.desired_path.length[rows])
        scale = ends[-1] / max(float(station[-1]), 1e-9)
        for one, where in zip(own.tolist(), (place * scale).tolist(), strict=True):
            slack = _SEARCH + _SEARCH_SHARE * where
            low = int(np.searchsorted(ends, where - slack))
            high = min(int(np.searchsorted(ends, where + slack)) + 1, len(rows))
            step = end.position[low:high] - start.position[low:high]
            away = aim[one] - start.position[low:high]
            t = np.clip(
                np.sum(away * step, axis=1) / np.maximum(np.sum(step * step, axis=1), 1e-18), 0.0, 1.0
            )
            distance = np.linalg.norm(away - t[:, None] * step, axis=1)
            best = int(np.nanargmin(distance)) if np.isfinite(distance).any() else -1
            if best >= 0 and distance[best] < _AWAY:
                at[one], along[one], lost[one] = rows[low + best], t[best], False
    poses = run.desired_path.at(at, along)
    return poses, lost
