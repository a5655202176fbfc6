"""What was done, beside the results: so that it is done once, and again when anything of it changed.

``<folder of the output>/.compensate/<name of the output>.json``, written after the outputs and atomically: a run that
was killed has no record, and is done again.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from postproc.base.findings import Refusal
from postproc.batching.files_read import ABSENT, code_digest, digest_of
from postproc.batching.job_file import Job
from postproc.cell import find_cell
from postproc.output import atomic_write

STATE = ".compensate"
"""Folder of records and locks, in each folder of results."""


@dataclass(frozen=True)
class Record:
    """A run that ended well.

    code: digest of what computed; options: of the request; around: what lies about the program and would be read if
    it were there; inputs, outputs: path -> SHA-256; result: the machine-readable report.
    """

    code: str
    options: dict[str, str]
    around: list[str]
    inputs: dict[str, str]
    outputs: dict[str, str]
    result: dict[str, object]

    @staticmethod
    def of(job: Job, around: list[str], inputs: dict[str, str], result: dict[str, object]) -> Record | None:
        """The record of a run that has just ended; None where an input is no longer what was read.

        around: ``files_around`` before the run, which has not seen what came later.
        """
        outputs = [str(path) for path in result["outputs"]]  # type: ignore[attr-defined]
        inputs = {path: digest for path, digest in inputs.items() if path not in outputs}
        digests = {path: digest_of(path) for path in outputs}
        if ABSENT in digests.values() or not _still(inputs):
            return None
        return Record(code_digest(), _options(job), around, inputs, digests, result)

    @property
    def sound(self) -> bool:
        """Whether it is what a run writes: the folder of results is open to everybody who may write there."""
        texts = [self.code, *self.around] if isinstance(self.around, list) else [None]
        for part in (self.options, self.inputs, self.outputs):
            texts += [*part, *part.values()] if isinstance(part, dict) else [None]
        whole = isinstance(self.result, dict) and isinstance(self.result.get("outputs"), list)
        return whole and all(isinstance(text, str) for text in texts)

    def holds(self, job: Job) -> bool:
        """Whether doing the job again would give what is there."""
        return (
            (self.code, self.options, self.around) == (code_digest(), _options(job), files_around(job))
            and _still(self.inputs)
            and _still(self.outputs)
        )


def lock_path(target: Path) -> Path:
    """The lock of an output, or of a summary."""
    return target.parent / STATE / f"{target.name}.lock"


def files_around(job: Job) -> list[str]:
    """Files beside the program that carry its stem, and the cell that it would find."""
    program = job.request.program
    stem = f"{program.stem}.".casefold()
    try:
        names = [entry.name for entry in os.scandir(program.parent) if entry.name.casefold().startswith(stem)]
    except OSError:
        names = []
    if job.request.cell is None:
        with contextlib.suppress(Refusal):
            names.append(str(find_cell(program)))
    return sorted(names)


def load_record(job: Job) -> Record | None:
    """The record of a job; None where there is none that can be read, or something else is in its place."""
    path = _path(job)
    try:
        record = Record(**json.loads(path.read_bytes())) if path.is_file() else None
    except (OSError, ValueError, TypeError, RecursionError):
        return None
    return record if record is not None and record.sound else None


def save_record(job: Job, record: Record) -> None:
    text = json.dumps(asdict(record), indent=1, allow_nan=False) + "\n"
    atomic_write.write_atomically({_path(job): text.encode()})


def sweep(job: Job, outputs: Iterable[str]) -> None:
    """Take away what a run that was killed left half-written of the job's outputs and its record."""
    atomic_write.sweep([job.target, _path(job), *map(Path, outputs)])


def _path(job: Job) -> Path:
    return job.target.parent / STATE / f"{job.target.name}.json"


def _still(digests: dict[str, str]) -> bool:
    return all(digest_of(path) == digest for path, digest in digests.items())


def _options(job: Job) -> dict[str, str]:
    return {name: repr(str(v) if isinstance(v, Path) else v) for name, v in asdict(job.request).items()}
