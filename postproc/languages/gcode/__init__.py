"""G-code: one reader, and for every control a table of what differs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from postproc.base.document import Document, Edit
from postproc.languages.core.dialect_defaults import DialectDefaults
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
from postproc.languages.gcode import codes as codes
from postproc.languages.gcode import detection

if TYPE_CHECKING:
    from postproc.languages.gcode.control import Control


@dataclass(frozen=True)
class GcodeDialect(DialectDefaults):
    """G-code of one control as a ``Dialect``.

    recognises: whether a file of this name and content is for it.  control: its table, with what a program of these
    bytes names; made where it is asked for, as tables take their time to build.  semicolon: comments start with one,
    parentheses are none.
    """

    name: str
    recognises: Callable[[Path, bytes], bool]
    control: Callable[[bytes], Control]
    semicolon: bool = False

    family: ClassVar[str] = "G-code"
    letters: ClassVar[bytes] = (
        b"ABCEFGIJKPRXYZ"  # coordinates, G and F that hold for inserted blocks too, CIP, EX
    )

    def claims(self, path: Path, raw: bytes) -> bool:
        return self.recognises(path, raw)

    def siblings(
        self, program: Program, settings: ReadingSettings, beside: Path | None = None
    ) -> tuple[Document, ...]:
        from postproc.languages.gcode import subprogram_files

        return subprogram_files.find(program, settings, beside) if self.name != "kuka_cnc" else ()

    def read(self, documents: tuple[Document, ...], settings: ReadingSettings = PLAIN) -> Program:
        raw = b"\n".join(one.raw for one in (documents[0], *settings.siblings))
        from postproc.languages.gcode import reader  # takes its time to load

        return reader.read(documents, self.control(raw), settings)

    def edit_targets(self, program: Program, plan: Plan, writing: WritingSettings) -> EditedTargets:
        from postproc.languages.gcode import writer

        return writer.edit_targets(program, plan, writing)

    def marked(self, program: Program, text: str) -> Edit:
        """The mark as a comment line after ``%`` and the program's number; parentheses in ``text`` become brackets."""
        plain = MARK + text.replace("(", "[").replace(")", "]")
        said = (f";{plain}" if self.semicolon else f"({plain})").encode("latin-1", "replace")
        return put_mark(program, said)


def _kuka_cnc(raw: bytes) -> Control:
    from postproc.languages.gcode.kuka_cnc import CONTROL

    return CONTROL


def _sinumerik(raw: bytes) -> Control:
    from postproc.languages.gcode.sinumerik import with_tools

    return with_tools(raw)


def _fanuc(raw: bytes) -> Control:
    from postproc.languages.gcode.code_tables import FANUC

    return FANUC


def _linuxcnc(raw: bytes) -> Control:
    from postproc.languages.gcode.code_tables import LINUXCNC

    return LINUXCNC


DIALECTS = (
    GcodeDialect("kuka_cnc", detection.is_kuka_cnc, _kuka_cnc, semicolon=True),
    GcodeDialect("sinumerik", detection.is_sinumerik, _sinumerik, semicolon=True),
    GcodeDialect("fanuc", detection.is_fanuc, _fanuc),
    GcodeDialect("linuxcnc", detection.is_gcode, _linuxcnc),
)
"""In the order in which they are asked whether a file is theirs."""
