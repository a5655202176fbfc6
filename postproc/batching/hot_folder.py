"""A hot folder: every program that arrives in it whole is compensated once, and moved away.

A program is whole when neither it nor what lies beside it under its name has changed for a while.  Then it goes through
the same steps as one of a batch, which leave a record, and is moved to ``done/`` or ``failed/`` together with its
companions.  A run that is killed at any moment is continued by the next one: what is recorded as done is not computed
again, and a move that had started is finished from its journal.
"""

from __future__ import annotations

import contextlib
import json
import os
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from postproc.base.findings import Finding, Refusal
from postproc.batching.files_read import code_digest
from postproc.batching.item import BatchItem, failed, run_item
from postproc.batching.job_file import FOLDER, OptionValues, jobs_of
from postproc.batching.locking import locked
from postproc.batching.programs import is_program
from postproc.batching.records import STATE
from postproc.cell import NAME as CELL
from postproc.languages import COMPANION_SUFFIXES
from postproc.output.atomic_write import write_atomically
from postproc.report.batched import FAILED, Outcome
from postproc.workflows.replaced_reports import program_of

ARCHIVE, REFUSED = "done", "failed"
"""Folders, in the hot one, of the programs that were compensated and of those that could not be."""
COMPANIONS = (*COMPANION_SUFFIXES, ".force.csv")
TRANSIENT = frozenset(["FIL001", "FIL010", "BAT008"])
"""Findings of a program that is still being written, or of a system that is short of something: it is tried again."""
MISTAKES = frozenset(["FRC030"])
"""Findings of the command line, not of a program: the watch ends with them, and the programs stay."""

Listen = Callable[[Outcome], None]
"""Gets every outcome, after its program was moved."""


@dataclass
class _FileState:
    """``state``: size and time of a file; ``since``: when it was first seen so (monotonic, s)."""

    state: tuple[int, int]
    since: float


@dataclass
class HotFolder:
    """folder: where programs arrive; output: where results go; options: fields of a ``Request``; settle [s]: how long a
    file must not change."""

    folder: Path
    output: Path | None = None
    options: OptionValues = field(default_factory=dict)
    settle: float = 2.0
    _file_states: dict[Path, _FileState] = field(default_factory=dict)
    _waits: dict[Path, tuple[int, int]] = field(default_factory=dict)

    @property
    def results(self) -> Path:
        """The folder of the compensated programs."""
        return self.folder / FOLDER if self.output is None else self.output

    @contextlib.contextmanager
    def exclusive(self, waits: Callable[[], None] = lambda: None) -> Iterator[None]:
        """Keeps other watchers out of the folder; what an earlier one had started to move is moved.  ``waits`` is
        called where another one watches it.  Raises Refusal FIL004 where the folder takes no file."""
        with locked(self.folder / STATE / "watch.lock", waits):
            self._finish_moves()
            yield

    def waiting(self) -> bool:
        """Whether a program is in the folder that is neither done nor left to its writer."""
        return bool(self._programs())

    def step(self, listen: Listen = lambda outcome: None, now: float | None = None) -> int:
        """Compensates and moves every program that is whole; gives how many.  Raises Refusal where no program can be
        compensated as the options say (FRC030)."""
        ready = list(self._whole(time.monotonic() if now is None else now))
        return sum(self._take(program, listen) for program in ready)

    def _programs(self) -> list[Path]:
        with os.scandir(self.folder) as entries:
            files = [
                Path(entry.path) for entry in entries if entry.is_file() and not entry.name.startswith(".")
            ]
        return sorted(path for path in files if path.name != CELL and is_program(path))

    def _whole(self, now: float) -> Iterator[Path]:
        programs = self._programs()
        for path in programs:
            group = self._group(path)
            states = {member: _state(member) for member in group}
            for member, state in states.items():
                seen = self._file_states.get(member)
                if state is None or seen is None or seen.state != state:
                    self._file_states[member] = _FileState(state or (-1, -1), now)
            settled = all(now - self._file_states[member].since >= self.settle for member in group)
            own = states[path]
            if settled and own is not None and self._waits.get(path) != own:
                yield path
        known = {member for path in programs for member in self._group(path)}
        self._file_states = {path: seen for path, seen in self._file_states.items() if path in known}

    def _group(self, program: Path) -> list[Path]:
        """The program and what lies beside it under its name."""
        names = {f"{program.stem}{ending}".lower() for ending in COMPANIONS}
        beside = [path for path in self.folder.iterdir() if path.name.lower() in names and path != program]
        return [program, *sorted(beside)]

    def _take(self, program: Path, listen: Listen) -> int:
        before = _state(program)
        try:
            (job,) = jobs_of([str(program)], self.options, self.results).jobs
        except (Refusal, ValueError):
            return 0  # it is gone
        page = (job.request.report or job.target.parent) / f"{job.target.stem}.report.json"
        if other := program_of(page, program, job.target):
            message = f"{other} and {program.name} would be written to reports of the same name, {page.name}"
            help = "rename one of the programs, or move the results of the other one to another folder"
            outcome = failed(job, Finding("BAT002", message, str(program), help=help))
        else:
            outcome = run_item(BatchItem(job, code_digest()))
        if outcome.state == FAILED and (mistakes := [f for f in outcome.findings if f.code in MISTAKES]):
            raise Refusal(*mistakes)  # every program would fail by it, and be moved away
        if outcome.state == FAILED and any(finding.code in TRANSIENT for finding in outcome.findings):
            if before is not None:
                self._waits[program] = before  # until it changes
            return 0
        self._move(program, outcome)
        listen(outcome)
        return 1

    def _move(self, program: Path, outcome: Outcome) -> None:
        lost = outcome.state == FAILED
        place = self.folder / (REFUSED if lost else ARCHIVE)
        # what another program waits for stays
        others = [path for path in self._programs() if path != program]
        needed = {member for path in others for member in self._group(path)}
        group = [one for one in self._group(program) if one == program or one not in needed]
        number = 1
        while any(_numbered(place, member, number).exists() for member in group):
            number += 1
        moves = {str(member): str(_numbered(place, member, number)) for member in group}
        report = {}
        if lost:
            why = _numbered(place, program.with_suffix(".report.json"), number)
            report[why] = (json.dumps(outcome.result, indent=2) + "\n").encode()
        write_atomically({**report, self._journal: (json.dumps(moves) + "\n").encode()})
        self._finish_moves()

    @property
    def _journal(self) -> Path:
        return self.folder / STATE / "moves.json"

    def _finish_moves(self) -> None:
        """Does what the journal says; twice is the same as once."""
        try:
            moves: Mapping[str, str] = json.loads(self._journal.read_bytes())
        except (OSError, ValueError):
            return
        for source, target in moves.items():
            inside = Path(source).parent == self.folder and Path(target).parent.parent == self.folder
            if inside and os.path.lexists(source) and not os.path.lexists(target):
                Path(target).parent.mkdir(parents=True, exist_ok=True)
                os.replace(source, target)
        self._journal.unlink()


def _numbered(folder: Path, path: Path, number: int) -> Path:
    """``panel.src``, or ``panel~2.src`` where earlier ones are there."""
    stem, dot, endings = path.name.partition(".")
    return folder / (path.name if number == 1 else f"{stem}~{number}{dot}{endings}")


def _state(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_size, status.st_mtime_ns
