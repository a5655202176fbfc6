"""RAPID, the language of ABB robots: modules in .mod, .prg and .sys files."""

from __future__ import annotations

import re
from pathlib import Path

from postproc.base.document import Document
from postproc.languages.core.dialect_defaults import BEGIN, DialectDefaults
from postproc.languages.dialect import (
    PLAIN,
    EditedTargets,
    Plan,
    Program,
    ReadingSettings,
    WritingSettings,
)
from postproc.languages.rapid import codes as codes

_MODULE = re.compile(
    rb"^(?:\xef\xbb\xbf)?[ \t]*+MODULE[ \t]++[A-Za-z][A-Za-z0-9_]*+[ \t]*+(?:\(|!|\r?$)", re.I | re.M
)
_ROUTINE = re.compile(rb"^[ \t]*+(?:LOCAL[ \t]++)?PROC[ \t]++[A-Za-z][A-Za-z0-9_]*+[ \t]*+\(", re.I | re.M)


class RapidDialect(DialectDefaults):
    """RAPID as a ``Dialect``."""

    name = "rapid"
    family = "RAPID"
    suffixes: tuple[str, ...] = (".mod", ".modx", ".prg", ".sys", ".sysx")
    comment = "!"
    letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZ\\;"  # of inserted motions, and of Offs and RelTool

    def claims(self, path: Path, raw: bytes) -> bool:
        start = raw[:BEGIN]
        if _MODULE.search(start) is not None:
            return True
        return path.suffix.lower() in self.suffixes and _ROUTINE.search(start) is not None

    def read(self, documents: tuple[Document, ...], settings: ReadingSettings = PLAIN) -> Program:
        from postproc.languages.rapid import module_reader  # takes its time to load

        return module_reader.read(documents, settings)

    def edit_targets(self, program: Program, plan: Plan, writing: WritingSettings) -> EditedTargets:
        from postproc.languages.rapid import target_writer

        return target_writer.edit_targets(program, plan, writing)
