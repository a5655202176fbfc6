"""What most languages do alike."""

from __future__ import annotations

from pathlib import Path

from postproc.base.document import Document, Edit
from postproc.languages.dialect import MARK, Program, ReadingSettings, put_mark

BEGIN = 65536
"""Bytes from the start of a file by which it is claimed."""


class DialectDefaults:
    """The part of a ``Dialect`` of programs that are one file, ask for no other one and have no name in it.

    ``comment``: the sign with which a comment starts.
    """

    comment: str = ""
    companion_suffixes: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()

    def companions(self, path: Path) -> list[Path]:
        return []

    def main_file(self, companion: Path) -> Path:
        return companion

    def siblings(
        self, program: Program, settings: ReadingSettings, beside: Path | None = None
    ) -> tuple[Document, ...]:
        return ()

    def marked(self, program: Program, text: str) -> Edit:
        return put_mark(program, f"{self.comment}{MARK}{text}".encode("latin-1", "replace"))

    def renamed(self, program: Program, stem: str) -> list[Edit]:
        """Nothing: a program keeps its name in a file of any name."""
        return []
