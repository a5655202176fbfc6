"""Subprograms in files of their own beside a program: which are called, and the text with them after it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.base.read_files import note_absent, note_listing
from postproc.languages.core.sibling_files import document_of, files_in
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.gcode.control import Control
from postproc.languages.gcode.correctability import POSITION
from postproc.languages.gcode.detection import SUFFIXES
from postproc.languages.gcode.execution_flow import tape_blocks
from postproc.languages.gcode.run_labels import called_name
from postproc.languages.gcode.source import Source, scan

MOST_BYTES = 4_000_000
"""Bytes of all subprograms of a program; of more than so many none is read."""

_TAPE = re.compile(rb"^[ \t]*+%[^\r\n]*+", re.M)
_ARCHIVED = re.compile(r"_N_(\w+)_(?:SPF|MPF)")
_HEADED = re.compile(rb"^\s*+(?:%[^\r\n]*+\s++)?+[O:][ \t]*+(?:\d|<)", re.I)


def file_name(path: Path) -> str:
    """The name of the program in a file, as ``called_name`` gives it; "" for a file that holds none."""
    stem = path.stem.upper()
    archived = _ARCHIVED.fullmatch(stem)
    if path.suffix and path.suffix.lower() not in SUFFIXES:
        return ""
    return called_name(archived[1] if archived else stem)


def find(program: Program, settings: ReadingSettings, beside: Path | None = None) -> tuple[Document, ...]:
    """The files beside a program that hold what it calls, each the only one of its name.  Raises Refusal FIL001."""
    read = {file_name(one.path) for one in settings.siblings}
    wanted = set(program.unresolved) - read
    if not wanted:
        return ()
    folder = beside or program.documents[0].path.parent
    files = files_in(folder, lambda one: file_name(one) in wanted)
    if files is None:
        return ()
    note_listing(folder, "")
    found = []
    for name in sorted(wanted):
        mine = [one for one in files if file_name(one) == name and one.name != program.documents[0].path.name]
        if len(mine) == 1:
            found.append(document_of(mine[0]))
        elif not mine:
            note_absent(folder / name)
    if sum(len(one.raw) for one in (*found, *settings.siblings)) > MOST_BYTES:
        return ()
    # Where one reads a position, what it depends on is not followed into the program.
    return tuple(one for one in found if b"\0" not in one.raw and POSITION.search(one.raw) is None)


@dataclass(frozen=True, eq=False)
class JoinedText:
    """A program and its subprograms as one text; own: bytes of the program; starts: where each file starts."""

    source: Source
    own: int
    starts: tuple[int, ...] = ()
    files: tuple[Document, ...] = ()

    @property
    def blocks(self) -> int:
        """Blocks of the program itself."""
        return (
            int(np.searchsorted(self.source.blocks.start, self.own))
            if self.files
            else len(self.source.blocks)
        )

    def in_other_file(self, start: Ints) -> Bools:
        """(B,) blocks, by where they ``start`` (B,), that are in another file."""
        return np.asarray(start >= self.own) if self.files else np.zeros(len(start), np.bool_)

    def of_file(self, file: Document, start: Ints) -> Bools:
        """(B,) blocks of another file, by where they ``start`` (B,)."""
        at = self.files.index(file)
        return np.asarray(
            (start >= self.starts[at]) & (np.searchsorted(self.starts, start, "right") == at + 1)
        )

    def at_the_calls(self, source: Source) -> tuple[Source, Bools]:
        """A run with the blocks of other files at the places of the calls; which blocks (B,) these are."""
        lines = source.blocks
        in_other_file = self.in_other_file(lines.start)
        if not in_other_file.any():
            return source, in_other_file
        at = np.maximum(np.maximum.accumulate(np.where(in_other_file, -1, np.arange(len(in_other_file)))), 0)
        lines = replace(
            lines, start=lines.start[at], stop=lines.stop[at], first=lines.first[at], line=lines.line[at]
        )
        return Source(source.columns, lines, source.notes, source.comments), in_other_file


def join(raw: bytes, files: Sequence[Document], control: Control) -> JoinedText:
    """A program and, after its end, the files that it calls, each as a program of its name."""
    source = scan(raw, control)
    if not files:
        return JoinedText(source, len(raw))
    tape = tape_blocks(source)
    inside = np.flatnonzero(tape)
    last = int(inside[-1]) + 1 if len(inside) else len(tape)
    own = int(source.blocks.start[last]) if last < len(tape) else len(raw)
    text, starts = bytearray(raw[:own]), []
    text += b"\nM30\n"
    for file in files:
        starts.append(len(text))
        text += _as_program(file, control)
    joined = scan(bytes(text), control)
    comments = joined.comments[joined.comments[:, 0] < own]
    shown = Source(joined.columns, joined.blocks, joined.notes, comments)
    return JoinedText(shown, own, tuple(starts), tuple(files))


def files_read_too(document: Document, joined: JoinedText, missing: frozenset[str]) -> list[Finding]:
    """Which files beside the program are read, and hold what it calls."""
    names = [(file, file_name(file.path)) for file in joined.files]
    return [
        Finding("GCO032", f"{file.path} is read for the call of {name}", str(document.path))
        for file, name in names
        if name not in missing
    ]


def _as_program(file: Document, control: Control) -> bytes:
    """The text of a subprogram under a line with its name."""
    text = file.raw.removeprefix(b"\xef\xbb\xbf")
    name = file_name(file.path).encode("latin-1", "replace")
    if control.calls:
        head = b"%%_N_%s_SPF\n" % name
    else:
        head = b"" if _HEADED.match(text) or not name.isdigit() else b"O%s\n" % name
    return head + _TAPE.sub(b"", text) + b"\n"
