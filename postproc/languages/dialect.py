"""What a dialect is: it reads the bytes of a program into a Toolpath, and turns moved targets into edits."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from postproc.base.arrays import Floats
from postproc.base.document import Document, Edit, Span
from postproc.base.findings import Finding
from postproc.toolpath import Plan as Plan
from postproc.toolpath import Role as Role
from postproc.toolpath import Toolpath
from postproc.toolpath.initial_state import UNSTATED, InitialState, Symbol

MARK = "COMPENSATED by compensate "
"""With which the comment starts that states that a program is compensated."""


@dataclass(frozen=True)
class EditSyntax:
    """What edits are checked by where the language has no addresses: the sign with which a comment starts, and the
    signs after which a number of a target is.  Empty: comments after ; or in (), numbers after X, Y, Z, ...
    points: the first line of a section of points after all motions, and the line after its points, before which further
    points may come; 0 where the language has none."""

    comment: bytes = b""
    numbers_after: bytes = b""
    points: tuple[int, int] = (0, 0)


@dataclass(frozen=True)
class Program:
    """A program that was read.

    ``documents``: the main file first, then the files that travel with it.  ``marker``: the comment that says
    the program is compensated, if it has one.  ``marker_at``: where that comment goes (document 0).
    ``names``: spans of the module's own name, per document, to be renamed with another stem.
    ``unresolved``: what the program names and nothing that was read declares.
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
    unresolved: frozenset[str] = frozenset()
    edit_syntax: EditSyntax = EditSyntax()


@dataclass(frozen=True)
class DialectOption:
    """What a cell may state for the reader of a language.

    ``key``: in the cell's ``dialect`` section; ``about``: what it means, in a line; ``choices``: its values, any text
    without; ``is_file``: it names a file that is read and never written (see ``ReadingSettings.references``).
    """

    key: str
    about: str
    choices: tuple[str, ...] = ()
    is_file: bool = False


@dataclass(frozen=True, eq=False)
class ReadingSettings:
    """What a program does not say of itself.

    orientation (3,): A, B, C [rad] of the tool in the base where the language programs no orientation, and what the
    spin about the tool axis is measured from; None where nothing states it.  options: key of a ``DialectOption`` -> its
    value, where one is stated.  references: files that are read and never written.
    siblings: files that lie beside the program or above it and say what it does not say itself, read like these.
    symbols: name that only the controller knows (capitals) -> its value, mm and deg where it is a pose; initial: the
    state at the first statement.
    external_words: address that programs have for an external axis in place of E1 .. E6 (capitals) -> its column.
    places: what only writing needs is wanted too (``Program.text``); a dialect may give None without.
    """

    orientation: Floats | None = None
    options: Mapping[str, str] = field(default_factory=dict)
    references: tuple[Document, ...] = ()
    siblings: tuple[Document, ...] = ()
    symbols: Mapping[str, Symbol] = field(default_factory=dict)
    initial: InitialState = UNSTATED
    places: bool = True
    external_words: Mapping[str, int] = field(default_factory=dict)


PLAIN = ReadingSettings()
"""Nothing is stated."""


@dataclass(frozen=True)
class WritingSettings:
    """How numbers are written: the least decimals of lengths (mm) and angles (deg); ``shared_points``: what
    becomes of a named point that serves several motions: each gets a copy as an aggregate in its line ("copy-inline"),
    as a new point in the .dat ("copy-dat"), or the point is kept and the motions are refused ("keep")."""

    mm: int
    deg: int
    shared_points: str = "copy-inline"


@dataclass(frozen=True)
class EditedTargets:
    """A plan as edits; or ``unwritten``: rows of it that cannot move as planned, and why (then without edits)."""

    edits: Sequence[Edit]
    unwritten: Mapping[int, Finding] = field(default_factory=dict)


class Dialect(Protocol):
    @property
    def name(self) -> str: ...

    @property
    def family(self) -> str:
        """The language of which it is a dialect, as users call it."""

    @property
    def letters(self) -> bytes:
        """Capital letters of the words that its edits may take out of the line of a motion, or put in."""

    @property
    def companion_suffixes(self) -> tuple[str, ...]:
        """Suffixes, in small letters, of the files of ``companions``."""

    @property
    def suffixes(self) -> tuple[str, ...]:
        """The endings, in small letters, of files that a controller loads as a program; none where it takes any."""

    def claims(self, path: Path, raw: bytes) -> bool:
        """Whether a file of this name and content is of this dialect."""

    def companions(self, path: Path) -> list[Path]:
        """Files beside ``path`` that belong to the program and exist; they bear its name."""

    def main_file(self, companion: Path) -> Path:
        """The program whose ``companion`` a file is."""

    def siblings(
        self, program: Program, settings: ReadingSettings, beside: Path | None = None
    ) -> tuple[Document, ...]:
        """Files beside the program, not read yet, that say something of what it does not resolve.  Refusal FIL001."""

    def read(self, documents: tuple[Document, ...], settings: ReadingSettings = PLAIN) -> Program:
        """Read a program; never raises on its content: what is not understood becomes a finding."""

    def edit_targets(self, program: Program, plan: Plan, writing: WritingSettings) -> EditedTargets:
        """Edits after which the program makes the motions of ``plan``; rows that are where they were stay as written.

        Raises ValueError if a row is asked to move that ``refused`` or ``locked`` forbids, or something is inserted
        before one of ``no_insert_before``: a defect of the caller.
        """

    def marked(self, program: Program, text: str) -> Edit:
        """The edit that puts ``text`` as the marker comment into the main file."""

    def renamed(self, program: Program, stem: str) -> list[Edit]:
        """Edits that give the module another name.  Raises Refusal FIL011 for one that the language does not allow."""


MOST_ROUNDS = 5
"""Times that a program is read again with files that the last reading asked for."""


def read_with_siblings(
    dialect: Dialect, documents: tuple[Document, ...], settings: ReadingSettings, beside: Path | None = None
) -> tuple[Program, ReadingSettings]:
    """A program, read with the files beside it that say what it does not say itself; the settings that name them.

    beside: the folder where these are looked for first; None: that of the program.
    Raises Refusal FIL001 for a file or a folder that cannot be read.
    """
    program = dialect.read(documents, settings)
    for _ in range(MOST_ROUNDS):
        more = dialect.siblings(program, settings, beside)
        if not more:
            break
        settings = replace(settings, siblings=(*settings.siblings, *more))
        program = dialect.read(documents, settings)
    return program, settings


def put_mark(program: Program, comment: bytes) -> Edit:
    """The edit that puts the marker comment in the place of the one there is, or on a line of its own."""
    if program.marker is not None:
        return Edit(program.marker, comment)
    document, at = program.documents[0], program.marker_at.start
    if at and not document.raw[:at].endswith((b"\n", BOM_UTF8)):
        return Edit(program.marker_at, document.newline + comment)
    return Edit(program.marker_at, comment + document.newline)
