"""The record of measured parts beside the cell: earlier parts are learnt from again together with the new one.

What an earlier run wrote may have cut the next part, and the run after it writes to the same place: a copy of each next
program is kept under its SHA-256 before anything is written over it.  A run that is killed at any moment leaves the
record of before or of after, and repeating it gives the same.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import place
from postproc.base.read_files import read_file
from postproc.base.system import relative_path
from postproc.languages import COMPANION_SUFFIXES
from postproc.learning.history import (
    DamagedRecord,
    PartHistory,
    RecordedPart,
    RecordedStep,
    read_history,
)
from postproc.learning.measured_part import MeasuredPart, read_measured_part
from postproc.output.atomic_write import write_atomically
from postproc.robot.description import Robot
from postproc.workflows.learn_commands import SHORT
from postproc.workflows.learn_points import CutProgram
from postproc.workflows.preparation import Request

KEPT = "cut"
"""Folder beside the next program with the programs that were written there, each in a folder of its SHA-256."""

LARGEST = 10_000_000
"""[bytes] of a record."""

ANEW = "name all parts that count together with --new-history"


@dataclass(frozen=True)
class Remembered:
    """``path`` of the record; ``history``: what it holds, or a new one; ``raw``: its bytes, None where there is none;
    ``parts``: all parts to learn from, the earlier ones first; ``kept``: folders of programs that cut."""

    path: Path
    history: PartHistory
    raw: bytes | None
    parts: tuple[MeasuredPart, ...]
    kept: tuple[Path, ...]
    findings: tuple[Finding, ...] = field(default=())

    def refuse_changed(self) -> None:
        """Raises Refusal FIL010 where another run has written the record since it was read."""
        now = self.path.read_bytes() if self.path.is_file() else None
        if now != self.raw:
            raise Refusal(Finding("FIL010", "another run has written this record meanwhile", str(self.path)))


def record_path(job: CutProgram, program: Path) -> Path:
    """Where the record of a program is: beside its cell."""
    cell = job.ready.cell.path
    folder = cell.parent if cell.is_file() else program.parent
    return folder / f"{program.stem}.parts.json"


def remember(
    job: CutProgram,
    main: Request,
    named: Sequence[MeasuredPart],
    path: Path,
    new_history: bool,
    next_folder: Path,
) -> Remembered:
    """The parts of the record at ``path`` and those ``named`` now.  Raises Refusal LRN001, LRN015.

    new_history: without what the record holds; next_folder: of the next program.
    """
    inputs = _inputs(job)
    new = PartHistory(inputs[main.program.name], main.force or "", inputs)
    raw = read_file(path, LARGEST) if path.is_file() else None
    kept = [next_folder / KEPT]
    if raw is None or new_history:
        _refuse_counted_twice(job.ready.robot, named)
        return Remembered(path, new, raw, tuple(named), tuple(kept))
    try:
        history = read_history(raw)
    except DamagedRecord as error:
        raise _refused(path, f"the record of parts cannot be used: {error}", ANEW) from None
    _refuse_foreign(history, new, path)
    for step in history.steps:
        if step.file:
            folder = (path.parent / step.file).parent.parent
            kept += [] if folder in kept else [folder]
    parts, findings = _joined(history, named, path)
    _refuse_counted_twice(job.ready.robot, parts)
    return Remembered(path, history, raw, tuple(parts), tuple(kept), tuple(findings))


def _inputs(job: CutProgram) -> dict[str, str]:
    """Name -> SHA-256 of every file that predicts the program; of several with one name, their joint digest."""
    found: dict[str, str] = {}
    for path, digest in sorted(job.ready.inputs.digests.items()):
        name = path.name
        found[name] = hashlib.sha256((found[name] + digest).encode()).hexdigest() if name in found else digest
    return found


def _refuse_foreign(history: PartHistory, now: PartHistory, path: Path) -> None:
    """A record of another program, cell, robot file or force."""
    if history.program != now.program:
        message = "this record belongs to another program, or to an earlier version of this one"
        raise _refused(path, message, f"name another record with --history, or {ANEW}")
    changed = [
        name for name in {**history.inputs, **now.inputs} if history.inputs.get(name) != now.inputs.get(name)
    ]
    if changed or history.force != now.force:
        what = ", ".join(sorted(changed)) if changed else "--force"
        verb = "has" if len(changed) < 2 else "have"
        message = (
            f"{what} {verb} changed since the earlier parts were learnt from: their causes would be wrong"
        )
        raise _refused(path, message, f"undo the change until the parts are done, or {ANEW}")


def _joined(
    history: PartHistory, named: Sequence[MeasuredPart], path: Path
) -> tuple[list[MeasuredPart], list[Finding]]:
    """The recorded parts, read again, then those that are new."""
    parts: list[MeasuredPart] = []
    findings = []
    left = list(named)
    for recorded in history.parts:
        file = path.parent / recorded.file
        same = next((one for one in left if one.digest == recorded.sha256), None)
        instead = next((one for one in left if place(one.file) == place(file)), None)
        if same is None and instead is not None:
            message = "the file has changed since it was learnt from; its present deviations count"
            findings.append(Finding("LRN016", message, str(instead.file)))
        chosen = same or instead
        if chosen is not None:
            left.remove(chosen)
            parts.append(chosen)
            continue
        if not file.is_file():
            message = f"{recorded.file}, a part of this record, is not there"
            raise _refused(path, message, f"name the file where it is now, or {ANEW}")
        part = read_measured_part(file)
        if part.digest != recorded.sha256:
            message = f"{recorded.file} is not what was learnt from"
            raise _refused(path, message, f"name the file, so that its present deviations count, or {ANEW}")
        parts.append(part)
    return [*parts, *left], findings


def _refuse_counted_twice(robot: Robot, parts: Sequence[MeasuredPart]) -> None:
    """A robot file that was learnt from one of the parts knows it already."""
    known = {digest for run in robot.identified for _, digest in run.data}
    for part in parts:
        if part.digest in known:
            message = f"{robot.path.name} was learnt from this part already, so it would count twice"
            help = "name the robot file of before with --robot or in the cell, or only parts that came later"
            raise Refusal(Finding("LRN015", message, str(part.file), help=help))


def _refused(path: Path, message: str, help: str) -> Refusal:
    return Refusal(Finding("LRN015", message, str(path), help=help))


@contextmanager
def kept_before(program: Path) -> Iterator[None]:
    """Keeps a program while another one is written to its place; after an error there is no new copy of it."""
    there = program.is_file() and kept_place(program, hashlib.sha256(read_file(program)).hexdigest()).exists()
    kept = keep_program(program)
    try:
        yield
    except BaseException:
        if kept is not None and not there:
            for path in (kept, *map(kept.with_suffix, COMPANION_SUFFIXES)):
                path.unlink(missing_ok=True)
            for folder in (kept.parent, kept.parent.parent):
                with suppress(OSError):  # it has other programs
                    folder.rmdir()
        raise


def keep_program(program: Path) -> Path | None:
    """Copies a program that lies where the next one is written to a folder of its SHA-256; its place there."""
    if not program.is_file():
        return None
    raw = read_file(program)
    kept = kept_place(program, hashlib.sha256(raw).hexdigest())
    files = {kept: raw}
    for suffix in COMPANION_SUFFIXES:
        companion = program.with_suffix(suffix)
        if companion.is_file():
            files[kept.with_suffix(suffix)] = read_file(companion)
    missing = {path: content for path, content in files.items() if not path.is_file()}
    if missing:
        write_atomically(missing)
    return kept


def kept_place(program: Path, digest: str) -> Path:
    """Of the copy of a program with this SHA-256."""
    return program.parent / KEPT / digest[:SHORT] / program.name


def record_step(remembered: Remembered, programs: Sequence[str], step: RecordedStep) -> PartHistory:
    """The record with this run; programs: SHA-256 of what cut each part."""
    folder = remembered.path.parent
    parts = tuple(
        RecordedPart(Path(relative_path(part.file, folder)).as_posix(), part.digest, digest)
        for part, digest in zip(remembered.parts, programs, strict=True)
    )
    return remembered.history.with_step(parts, step)
