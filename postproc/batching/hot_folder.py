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
CHANGED, UNREADABLE, SHORT = "FIL010", "FIL001", "BAT008"
"""Findings of a file that was written meanwhile, of one that cannot be read, of a system that is short of something."""
RETRY = 60.0
"""[s] After which a program that could not be read is tried again though it has not changed."""
MISTAKES = frozenset(["FRC030"])
"""Findings of the command line, not of a program: the watch ends with them, and the programs stay."""

Listen = Callable[[Outcome], None]
"""Gets every outcome, after its program was moved; or that of a program that stays and is tried again."""
FileStamp = tuple[int, int]
"""Size and time of change of a file, by which a later version of it is known."""


def _ignore(outcome: Outcome) -> None:
    pass


@dataclass
class _FileState:
    """``state``: size and time of a file; ``since``: when it was first seen so (monotonic, s)."""

    state: FileStamp
    since: float


@dataclass
class _Postponed:
    """A program that cannot be compensated now: ``stamps`` of its files; ``until`` (monotonic, s): the next attempt."""

    stamps: dict[Path, FileStamp | None]
    until: float


@dataclass
class HotFolder:
    """folder: where programs arrive; output: where results go; options: fields of a ``Request``; settle [s]: how long a
    file must not change."""

    folder: Path
    output: Path | None = None
    options: OptionValues = field(default_factory=dict)
    settle: float = 2.0
    _file_states: dict[Path, _FileState] = field(default_factory=dict)
    _postponed: dict[Path, _Postponed] = field(default_factory=dict)

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

    def step(self, listen: Listen = _ignore, now: float | None = None, postpone: Listen = _ignore) -> int:
        """Compensates and moves every program that is whole; gives how many.  ``postpone`` gets the outcome of one that
        cannot be read now, once.  Raises Refusal where no program can be compensated as the options say (FRC030)."""
        now = time.monotonic() if now is None else now
        return sum(self._take(*whole, listen, postpone, now) for whole in list(self._whole(now)))

    def _programs(self) -> list[Path]:
        with os.scandir(self.folder) as entries:
            files = [
                Path(entry.path) for entry in entries if entry.is_file() and not entry.name.startswith(".")
            ]
        return sorted(path for path in files if path.name != CELL and is_program(path))

    def _whole(self, now: float) -> Iterator[tuple[Path, dict[Path, FileStamp | None]]]:
        """Programs that are whole, each with its files as they are."""
        programs = self._programs()
        for path in programs:
            states = self._stamps(path)
            for member, state in states.items():
                seen = self._file_states.get(member)
                if state is None or seen is None or seen.state != state:
                    self._file_states[member] = _FileState(state or (-1, -1), now)
            settled = all(now - self._file_states[member].since >= self.settle for member in states)
            waits = self._postponed.get(path)
            if waits is not None and waits.stamps == states and now < waits.until:
                continue
            if settled and states[path] is not None:
                yield path, states
        known = {member for path in programs for member in self._group(path)}
        self._file_states = {path: seen for path, seen in self._file_states.items() if path in known}

    def _group(self, program: Path) -> list[Path]:
        """The program and what lies beside it under its name."""
        names = {f"{program.stem}{ending}".lower() for ending in COMPANIONS}
        beside = [path for path in self.folder.iterdir() if path.name.lower() in names and path != program]
        return [program, *sorted(beside)]

    def _stamps(self, program: Path) -> dict[Path, FileStamp | None]:
        return {member: _state(member) for member in self._group(program)}

    def _take(
        self,
        program: Path,
        stamps: dict[Path, FileStamp | None],
        listen: Listen,
        postpone: Listen,
        now: float,
    ) -> int:
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
        if outcome.state == FAILED and any(finding.code == CHANGED for finding in outcome.findings):
            return 0
        if outcome.state == FAILED and any(_passes(finding, stamps) for finding in outcome.findings):
            known = self._postponed.get(program)
            self._postponed[program] = _Postponed(stamps, now + RETRY)
            if known is None or known.stamps != stamps:
                postpone(outcome)
            return 0
        if any(stamp not in (None, stamps.get(member)) for member, stamp in self._stamps(program).items()):
            return 0  # a later version came meanwhile: it is compensated, not moved away
        self._postponed.pop(program, None)
        self._move(program, stamps, outcome)
        listen(outcome)
        return 1

    def _move(self, program: Path, stamps: dict[Path, FileStamp | None], outcome: Outcome) -> None:
        lost = outcome.state == FAILED
        place = self.folder / (REFUSED if lost else ARCHIVE)
        # what another program waits for stays
        others = [path for path in self._programs() if path != program]
        needed = {member for path in others for member in self._group(path)}
        group = [one for one in stamps if one == program or one not in needed]
        number = 1
        while any(_numbered(place, member, number).exists() for member in group):
            number += 1
        moves = {str(one): [str(_numbered(place, one, number)), *(stamps[one] or (0, 0))] for one in group}
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
        """Does what the journal says; twice is the same as once.  What is there in a later version stays."""
        try:
            moves: Mapping[str, tuple[str, int, int]] = json.loads(self._journal.read_bytes())
        except (OSError, ValueError):
            return
        for source, (target, *stamp) in moves.items():
            inside = Path(source).parent == self.folder and Path(target).parent.parent == self.folder
            if inside and _state(Path(source)) == tuple(stamp) and not os.path.lexists(target):
                Path(target).parent.mkdir(parents=True, exist_ok=True)
                os.replace(source, target)
        self._journal.unlink()


def _numbered(folder: Path, path: Path, number: int) -> Path:
    """``panel.src``, or ``panel~2.src`` where earlier ones are there."""
    stem, dot, endings = path.name.partition(".")
    return folder / (path.name if number == 1 else f"{stem}~{number}{dot}{endings}")


def _passes(finding: Finding, stamps: Mapping[Path, FileStamp | None]) -> bool:
    """Whether what is found may pass by itself: a file of the program is still with its writer, the system is short."""
    return finding.code == SHORT or (finding.code == UNREADABLE and Path(finding.file) in stamps)


def _state(path: Path) -> FileStamp | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_size, status.st_mtime_ns
