"""What a dialect is: it reads the bytes of a program into a Toolpath, and turns moved targets into edits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from postproc.arrays import Floats
from postproc.document import Document, Edit, Span
from postproc.findings import Finding
from postproc.toolpath import Plan as Plan
from postproc.toolpath import Role as Role
from postproc.toolpath import Toolpath


@dataclass(frozen=True)
class Program:
    """A program that was read.

    ``documents``: the main file first, then the files that travel with it.  ``marker``: the comment that says
    the program is compensated, if it has one.  ``marker_at``: where that comment goes (document 0).
    ``names``: spans of the module's own name, per document, to be renamed with another stem.
    ``text``: what the dialect knows of the text, for its own writer; nobody else reads it.
    """

    dialect: str
    documents: tuple[Document, ...]
    toolpath: Toolpath
    text: Any
    findings: tuple[Finding, ...]
    marker: Span | None
    marker_at: Span
    names: tuple[Span, ...]


@dataclass(frozen=True, eq=False)
class Settings:
    """What a program does not say of itself.

    orientation (3,): A, B, C [rad] of the tool in the base where the language programs no orientation, and what the
    spin about the tool axis is measured from; None where nothing says it.  integer_words: what X10 means where a
    control counts in increments, "mm" or "um".  references: files that are read and never written ($config.dat).
    places: what only writing needs is wanted too (``Program.text``); a dialect may give None without.
    """

    orientation: Floats | None = None
    integer_words: str = "mm"
    references: tuple[Document, ...] = ()
    places: bool = True


PLAIN = Settings()
"""Nothing is said."""


@dataclass(frozen=True)
class Writing:
    """How numbers are written: the least decimals of lengths (mm) and angles (deg); ``own_points``: what becomes of a
    named point that serves several motions: each gets its own as an aggregate in its line ("inline"), as a new point
    in the .dat ("dat"), or the motions are refused ("refuse")."""

    mm: int
    deg: int
    own_points: str = "inline"


@dataclass(frozen=True)
class Moved:
    """A plan as edits; or ``held``: rows of the input that can not move as planned, and why (then without edits)."""

    edits: Sequence[Edit]
    held: Mapping[int, Finding] = field(default_factory=dict)


class Dialect(Protocol):
    @property
    def name(self) -> str: ...

    @property
    def letters(self) -> bytes:
        """Capital letters of the words that its edits may take out of the line of a motion, or put in."""

    def claims(self, path: Path, raw: bytes) -> bool:
        """Whether a file of this name and content is of this dialect."""

    def companions(self, path: Path) -> list[Path]:
        """Files beside ``path`` that belong to the program and exist (a KRL module's .dat)."""

    def read(self, documents: tuple[Document, ...], settings: Settings = PLAIN) -> Program:
        """Read a program; never raises on its content: what is not understood becomes a finding."""

    def moved(self, program: Program, plan: Plan, writing: Writing) -> Moved:
        """Edits after which the program makes the motions of ``plan``; rows that are where they were stay as written.

        Raises ValueError if a row is asked to move that ``refused`` or ``pinned`` forbids, or something is inserted
        before one of ``whole``: a defect of the caller.
        """

    def marked(self, program: Program, text: str) -> Edit:
        """The edit that puts ``text`` as the marker comment into the main file."""

    def renamed(self, program: Program, stem: str) -> list[Edit]:
        """Edits that give the module another name."""
