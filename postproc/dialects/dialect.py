"""What a dialect is: it reads the bytes of a program into a Toolpath, and turns moved targets into edits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from postproc.arrays import Floats, Ints
from postproc.document import Document, Edit, Span
from postproc.findings import Finding
from postproc.toolpath import Toolpath


@dataclass(frozen=True)
class Places:
    """Where the numbers of a motion stand in the text.

    start, stop (N, 6): byte range of the literals of X, Y, Z, A, B, C; -1 where the text has none.
    file (N,): the document that holds them, -1 where the motion has no aggregate of numbers.
    insert (N,): offset at which missing components are inserted (behind the last component).
    """

    start: Ints
    stop: Ints
    file: Ints
    insert: Ints


@dataclass(frozen=True)
class Program:
    """A program that was read.

    ``documents``: the main file first, then the files that travel with it.  ``marker``: the comment that says
    the program is compensated, if it has one.  ``marker_at``: where that comment goes (document 0).
    ``names``: spans of the module's own name, per document, to be renamed with another stem.
    """

    dialect: str
    documents: tuple[Document, ...]
    toolpath: Toolpath
    places: Places
    findings: tuple[Finding, ...]
    marker: Span | None
    marker_at: Span
    names: tuple[Span, ...]


class Dialect(Protocol):
    name: str

    def claims(self, path: Path, raw: bytes) -> bool:
        """Whether a file of this name and content is of this dialect."""

    def companions(self, path: Path) -> list[Path]:
        """Files beside ``path`` that belong to the program and exist (a KRL module's .dat)."""

    def read(self, documents: tuple[Document, ...]) -> Program:
        """Read a program; never raises on its content: what is not understood becomes a finding."""

    def moved(
        self, program: Program, position: Floats, rotation: Floats, decimals: Mapping[str, int]
    ) -> list[Edit]:
        """Edits that bring the targets to ``position`` (N, 3) [m], ``rotation`` (N, 3, 3) in the programmed base."""

    def marked(self, program: Program, text: str) -> Edit:
        """The edit that puts ``text`` as the marker comment into the main file."""

    def renamed(self, program: Program, stem: str) -> list[Edit]:
        """Edits that give the module another name."""
