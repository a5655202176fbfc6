"""G-code: one reader, and for every control a table of what differs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from postproc.dialects.dialect import PLAIN, Moved, Plan, Program, Settings, Writing
from postproc.dialects.gcode import detection, reader
from postproc.dialects.gcode.control import Control
from postproc.dialects.gcode.tables import FANUC, LINUXCNC
from postproc.document import Document, Edit


@dataclass(frozen=True)
class GcodeDialect:
    """G-code of one control as a ``Dialect``."""

    control: Control
    arcs_in_plane: bool = True

    @property
    def name(self) -> str:
        return self.control.name

    def claims(self, path: Path, raw: bytes) -> bool:
        return detection.CLAIMS[self.name](path, raw)

    def companions(self, path: Path) -> list[Path]:
        return []

    def read(self, documents: tuple[Document, ...], settings: Settings = PLAIN) -> Program:
        return reader.read(documents, self.control, settings)

    def moved(self, program: Program, plan: Plan, writing: Writing) -> Moved:
        raise NotImplementedError

    def marked(self, program: Program, text: str) -> Edit:
        """The mark as a comment line behind ``%`` and the program's number; parentheses in ``text`` become brackets."""
        said = f"(COMPENSATED by compensate {text.replace('(', '[').replace(')', ']')})".encode(
            "latin-1", "replace"
        )
        if program.marker is not None:
            return Edit(program.marker, said)
        document, at = program.documents[0], program.marker_at.start
        if at and document.raw[at - 1 : at] not in (b"\n", b"\xbf"):
            return Edit(program.marker_at, document.newline + said)
        return Edit(program.marker_at, said + document.newline)

    def renamed(self, program: Program, stem: str) -> list[Edit]:
        return []


CONTROLS = (FANUC, LINUXCNC)
