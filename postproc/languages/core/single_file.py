"""What is the same for languages whose programs are one file."""

from __future__ import annotations

from pathlib import Path

from postproc.base.document import Document
from postproc.languages.dialect import Program, ReadingSettings

BEGIN = 65536
"""Bytes from the start of a file by which it is claimed."""


class SingleFileDialect:
    """The part of a ``Dialect`` that asks for no other file."""

    companion_suffixes: tuple[str, ...] = ()

    def companions(self, path: Path) -> list[Path]:
        return []

    def main_file(self, companion: Path) -> Path:
        return companion

    def siblings(
        self, program: Program, settings: ReadingSettings, beside: Path | None = None
    ) -> tuple[Document, ...]:
        return ()
