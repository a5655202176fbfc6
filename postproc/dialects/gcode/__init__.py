"""G-code: one reader, and for every control a table of what differs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from postproc.dialects.dialect import PLAIN, Moved, Plan, Program, Settings, Writing
from postproc.dialects.gcode import detection, reader, writer
from postproc.dialects.gcode.control import Control
from postproc.dialects.gcode.kuka_cnc import CONTROL as KUKA_CNC
from postproc.dialects.gcode.sinumerik import CONTROL as SINUMERIK
from postproc.dialects.gcode.sinumerik import with_tools
from postproc.dialects.gcode.tables import FANUC, LINUXCNC
from postproc.document import Document, Edit


@dataclass(frozen=True)
class GcodeDialect:
    """G-code of one control as a ``Dialect``.

    semicolon: comments begin with one, parentheses are none; prepared: the control with what a program names.
    """

    control: Control
    semicolon: bool = False
    prepared: Callable[[bytes], Control] | None = None

    @property
    def name(self) -> str:
        return self.control.name

    @property
    def letters(self) -> bytes:
        """Those of coordinates, of G and F that hold for inserted blocks too, and of CIP and EX."""
        return b"ABCEFGIJKPRXYZ"

    def claims(self, path: Path, raw: bytes) -> bool:
        return detection.CLAIMS[self.name](path, raw)

    def companions(self, path: Path) -> list[Path]:
        return []

    def read(self, documents: tuple[Document, ...], settings: Settings = PLAIN) -> Program:
        control = self.control if self.prepared is None else self.prepared(documents[0].raw)
        return reader.read(documents, control, settings)

    def moved(self, program: Program, plan: Plan, writing: Writing) -> Moved:
        return writer.moved(program, plan, writing)

    def marked(self, program: Program, text: str) -> Edit:
        """The mark as a comment line behind ``%`` and the program's number; parentheses in ``text`` become brackets."""
        plain = "COMPENSATED by compensate " + text.replace("(", "[").replace(")", "]")
        said = (f";{plain}" if self.semicolon else f"({plain})").encode("latin-1", "replace")
        if program.marker is not None:
            return Edit(program.marker, said)
        document, at = program.documents[0], program.marker_at.start
        if at and document.raw[at - 1 : at] not in (b"\n", b"\xbf"):
            return Edit(program.marker_at, document.newline + said)
        return Edit(program.marker_at, said + document.newline)

    def renamed(self, program: Program, stem: str) -> list[Edit]:
        return []


DIALECTS = (
    GcodeDialect(KUKA_CNC, semicolon=True),
    GcodeDialect(SINUMERIK, semicolon=True, prepared=with_tools),
    GcodeDialect(FANUC),
    GcodeDialect(LINUXCNC),
)
"""In the order in which they are asked whether a file is theirs."""
