"""KRL, the language of KUKA robots: a module is a .src and, with it, a .dat."""

from __future__ import annotations

import re
from pathlib import Path

from postproc.dialects.dialect import PLAIN, Moved, Plan, Program, Settings, Writing
from postproc.dialects.krl import interpreter, writer
from postproc.document import Document, Edit
from postproc.findings import Finding, Refusal

_CLAIM = re.compile(
    rb"^(?:\xef\xbb\xbf)?[ \t]*(?:(?:GLOBAL[ \t]+)?DEF[ \t]+[A-Za-z_$][A-Za-z0-9_$]*[ \t]*(?:\(|;|\r?$)"
    rb"|S?(?:PTP|LIN)[ \t]*\{)",
    re.I | re.M,
)


class KrlDialect:
    """KRL as a ``Dialect``."""

    name = "krl"
    letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZ"  # points have names

    def claims(self, path: Path, raw: bytes) -> bool:
        return path.suffix.lower() == ".src" or _CLAIM.search(raw) is not None

    def companions(self, path: Path) -> list[Path]:
        wanted = (path.stem.lower(), ".dat")
        try:
            beside = sorted(path.parent.iterdir())
        except FileNotFoundError:
            return []
        except OSError as error:
            message = f"its folder can not be listed ({error.strerror}), and a .dat may belong to it"
            raise Refusal(Finding("FIL001", message, str(path))) from None
        matches = [p for p in beside if (p.stem.lower(), p.suffix.lower()) == wanted and p.is_file()]
        # Where several differ by case only, the one spelt as the program is.
        return sorted(matches, key=lambda p: p.stem != path.stem)[:1]

    def read(self, documents: tuple[Document, ...], settings: Settings = PLAIN) -> Program:
        return interpreter.read(documents, settings.references, places=settings.places)

    def moved(self, program: Program, plan: Plan, writing: Writing) -> Moved:
        return writer.moved(program, plan, writing)

    def marked(self, program: Program, text: str) -> Edit:
        comment = b";COMPENSATED by compensate " + text.encode("latin-1", "replace")
        if program.marker is not None:
            return Edit(program.marker, comment)
        document, at = program.documents[0], program.marker_at.start
        before = document.raw[:at]
        if before and not before.endswith((b"\n", b"\xef\xbb\xbf")):
            return Edit(program.marker_at, document.newline + comment)
        return Edit(program.marker_at, comment + document.newline)

    def renamed(self, program: Program, stem: str) -> list[Edit]:
        return [Edit(span, stem.encode("latin-1", "replace")) for span in program.names]
