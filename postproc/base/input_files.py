"""The files that a run has read: what was in each of them, and whether it still is.

Whatever reads a file does so by ``postproc.base.read_files``, and that notes it here: no list of inputs is maintained
by hand, which would forget the file that a later version reads.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from contextvars import ContextVar
from pathlib import Path
from types import MappingProxyType

from postproc.base.batches import in_blocks
from postproc.base.findings import Code, Finding, Refusal, define
from postproc.base.system import FileSet

CODES = define(
    {
        "FIL001": Code(
            "error",
            "file cannot be read",
            meaning="The operating system refuses to open or to list this file or folder.",
            consequence="Without it the command cannot start.",
            action="Check the path and the right to read it.",
            example=(
                "`compensate panel.src` where panel.src is a folder, or is readable by another user only."
            ),
        ),
        "FIL002": Code(
            "error",
            "file is empty",
            meaning="The file has no content, or only blank lines.",
            consequence="An empty program, cell or table contains nothing to work on.",
            action="Name the right file, or export it again.",
            example="A panel.src of 0 bytes after an interrupted copy.",
        ),
        "FIL003": Code(
            "error",
            "file is not plain text",
            meaning="The file contains NUL bytes (binary, or UTF-16) or endless lines.",
            consequence="Positions in it could not be edited without damage.",
            action="Save the file as plain text (UTF-8 or Latin-1).",
            example="A program that an editor saved as UTF-16.",
        ),
        "FIL007": Code(
            "error",
            "output would replace an input",
            meaning="The path of an output is the path of a file that the same run reads.",
            consequence="Inputs are never overwritten.",
            action="Name another output with -o, --report or the option that the message names.",
            example="`compensate panel.src -o panel.src`.",
        ),
        "FIL010": Code(
            "error",
            "input changed while it was read",
            meaning="Another process wrote the file between two readings of the same run.",
            consequence="The result would mix two versions of the file.",
            action="Wait until the other process is done, and run the command again.",
            example="The CAM system exports panel.src again while it is compensated.",
        ),
    }
)

_provided: ContextVar[Mapping[Path, bytes]] = ContextVar("provided", default=MappingProxyType({}))
_noting: ContextVar[Inputs | None] = ContextVar("noting", default=None)


class Inputs:
    """``digests``: path, as it was named -> SHA-256 of what was read of it."""

    def __init__(self) -> None:
        self.digests: dict[Path, str] = {}

    def refuse_changed(self) -> None:
        """Refusal FIL010 for every file that no longer holds what was read, FIL001 for those that are gone."""
        read = [(path, digest) for path, digest in self.digests.items() if path not in _provided.get()]
        known = in_blocks(lambda part: _finding_of_change(*read[part.start]), len(read), 1)
        findings = [finding for finding in known if finding is not None]
        if findings:
            raise Refusal(*findings)

    def refuse_outputs(self, outputs: Iterable[Path], named: Iterable[Path] = ()) -> None:
        """Refusal FIL007 for every output that is one of these files, or of those that are ``named`` and not read."""
        inputs = FileSet((*self.digests, *named))
        findings = [
            Finding("FIL007", "this output is an input of the same run", str(path))
            for path in outputs
            if path in inputs
        ]
        if findings:
            raise Refusal(*findings)


def place(path: Path) -> Path:
    """Where a path leads, to be compared with others; a link that leads to itself is its own place."""
    return Path(os.path.normcase(os.path.realpath(path)))


@contextlib.contextmanager
def noted() -> Iterator[Inputs]:
    """Notes every file that is read inside of the ``with``, in this thread."""
    inputs = Inputs()
    before = _noting.set(inputs)
    try:
        yield inputs
    finally:
        _noting.reset(before)


@contextlib.contextmanager
def provided(contents: Mapping[Path, bytes]) -> Iterator[None]:
    """Inside of the ``with``, what is read of these paths is ``contents``, whatever the disk has there."""
    token = _provided.set(contents)
    try:
        yield
    finally:
        _provided.reset(token)


def provided_content(path: Path) -> bytes | None:
    """What is provided for a path; None where the disk has it."""
    return _provided.get().get(path)


def note(path: Path, raw: bytes) -> None:
    """``raw`` was read of ``path``.  Refusal FIL010 where an earlier reading gave something else."""
    inputs = _noting.get()
    if inputs is None:
        return
    digest = hashlib.sha256(raw).hexdigest()
    if inputs.digests.setdefault(path, digest) != digest:
        raise Refusal(_changed(path))


def _finding_of_change(path: Path, digest: str) -> Finding | None:
    """What is reported where a file does not have this digest; None where it has."""
    try:
        # by its bytes: its time may have been set back
        if path.is_file() and _digest_of(path) == digest:
            return None
        path.stat()
    except OSError as error:
        return Finding("FIL001", f"the file cannot be read any more: {error.strerror}", str(path))
    return _changed(path)


def _digest_of(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _changed(path: Path) -> Finding:
    return Finding("FIL010", "the file changed while it was read", str(path))
