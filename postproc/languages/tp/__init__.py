"""TP, the language of Fanuc robots, as ASCII listings (.ls)."""

from __future__ import annotations

import re
from pathlib import Path

from postproc.base.document import Document, Edit
from postproc.base.findings import Finding, Refusal
from postproc.languages.core.dialect_defaults import BEGIN, DialectDefaults
from postproc.languages.dialect import (
    MARK,
    PLAIN,
    EditedTargets,
    Plan,
    Program,
    ReadingSettings,
    WritingSettings,
    put_mark,
)
from postproc.languages.tp import codes as codes

_PROGRAM = re.compile(rb"^(?:\xef\xbb\xbf)?[ \t]*+/PROG\b", re.I | re.M)
_MAIN = re.compile(rb"^[ \t]*+/MN\b", re.I | re.M)
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,35}")
LONGEST = 32
"""Letters of a comment (FANUC, operator's manual, remark instruction; recalled)."""


class TpDialect(DialectDefaults):
    """TP as a ``Dialect``."""

    name = "tp"
    family = "Fanuc TP"
    suffixes: tuple[str, ...] = (".ls",)
    letters = b'ABCDEFGHIJKLMNOPQRSTUVWXYZ;%"'  # of inserted motions and points

    def claims(self, path: Path, raw: bytes) -> bool:
        start = raw[:BEGIN]
        return _MAIN.search(start) is not None and (
            _PROGRAM.search(start) is not None or path.suffix.lower() == ".ls"
        )

    def read(self, documents: tuple[Document, ...], settings: ReadingSettings = PLAIN) -> Program:
        from postproc.languages.tp import listing_reader  # takes its time to load

        return listing_reader.read(documents, settings)

    def edit_targets(self, program: Program, plan: Plan, writing: WritingSettings) -> EditedTargets:
        from postproc.languages.tp import point_writer

        return point_writer.edit_targets(program, plan, writing)

    def marked(self, program: Program, text: str) -> Edit:
        """The mark as the first line of /MN, as far as a comment may be long: with the version alone."""
        comment = b"!" + f"{MARK}{text.partition(',')[0]}".encode("latin-1", "replace")[:LONGEST].rstrip()
        if program.marker is not None:
            return put_mark(program, comment)
        return put_mark(program, b"   1:  " + comment + b" ;")

    def renamed(self, program: Program, stem: str) -> list[Edit]:
        """Edits that call the program ``stem``, in capitals.  Raises Refusal FTP021 where that cannot name one."""
        if not _NAME.fullmatch(stem):
            message = f"the name {stem!r} cannot name a TP program"
            raise Refusal(Finding("FTP021", message, str(program.documents[0].path)))
        return [Edit(span, stem.upper().encode("latin-1")) for span in program.names]
