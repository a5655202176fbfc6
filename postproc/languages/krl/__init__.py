"""KRL, the language of KUKA robots: a module is a .src and, with it, a .dat."""

from __future__ import annotations

import re
from pathlib import Path

from postproc.base.document import Document, Edit
from postproc.base.findings import Finding, Refusal
from postproc.languages.core.dialect_defaults import DialectDefaults
from postproc.languages.core.sibling_files import files_in
from postproc.languages.dialect import (
    PLAIN,
    DialectOption,
    EditedTargets,
    Plan,
    Program,
    ReadingSettings,
    WritingSettings,
)
from postproc.languages.krl import codes as codes

OPTIONS = (DialectOption("config_dat", "the controller's $config.dat, relative to this file", is_file=True),)
"""What a cell may state for this language."""

_CLAIM = re.compile(
    rb"^(?:\xef\xbb\xbf)?[ \t]*(?:(?:GLOBAL[ \t]+)?DEF[ \t]+[A-Za-z_$][A-Za-z0-9_$]*[ \t]*(?:\(|;|\r?$)"
    rb"|S?(?:PTP|LIN)[ \t]*\{)",
    re.I | re.M,
)

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,23}")


class KrlDialect(DialectDefaults):
    """KRL as a ``Dialect``."""

    name = "krl"
    family = "KRL"
    comment = ";"
    letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZ"  # points have names
    companion_suffixes: tuple[str, ...] = (".dat",)
    suffixes: tuple[str, ...] = (".src", ".sub")

    def claims(self, path: Path, raw: bytes) -> bool:
        return path.suffix.lower() == ".src" or _CLAIM.search(raw) is not None

    def companions(self, path: Path) -> list[Path]:
        wanted = {(path.stem.lower(), suffix) for suffix in self.companion_suffixes}
        matches = files_in(path.parent, lambda p: (p.stem.lower(), p.suffix.lower()) in wanted) or []
        # Where several differ by case only, the one spelt as the program is.
        return sorted(matches, key=lambda p: p.stem != path.stem)[:1]

    def main_file(self, companion: Path) -> Path:
        return companion.with_suffix(".src")

    def read(self, documents: tuple[Document, ...], settings: ReadingSettings = PLAIN) -> Program:
        from postproc.languages.krl import interpreter  # takes its time to load

        return interpreter.read(
            documents,
            settings.references,
            places=settings.places,
            symbols=settings.symbols,
            initial=settings.initial,
            siblings=settings.siblings,
        )

    def siblings(
        self, program: Program, settings: ReadingSettings, beside: Path | None = None
    ) -> tuple[Document, ...]:
        from postproc.languages.krl import siblings

        return siblings.find(program, settings, beside)

    def edit_targets(self, program: Program, plan: Plan, writing: WritingSettings) -> EditedTargets:
        from postproc.languages.krl import writer

        return writer.edit_targets(program, plan, writing)

    def renamed(self, program: Program, stem: str) -> list[Edit]:
        """Edits that call the program ``stem``.  Raises Refusal (FIL011) where that cannot name a module."""
        if not _NAME.fullmatch(stem):
            message = f"the name {stem!r} cannot name a KRL module"
            raise Refusal(Finding("FIL011", message, str(program.documents[0].path)))
        return [Edit(span, stem.encode("latin-1")) for span in program.names]
