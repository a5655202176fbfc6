"""The statements and the mark of two programs, compared: what the second one states that is no correction."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.languages.dialect import Program
from postproc.robot.description import Robot
from postproc.toolpath import Toolpath
from postproc.verification.motion_ends import MotionEnds, elsewhere
from postproc.verification.stated_texts import MovingLines, StatementForm, Statements, program_lines
from postproc.verification.stated_texts_gcode import GcodeStatements
from postproc.verification.stated_texts_krl import KrlStatements
from postproc.verification.stated_texts_rapid import RapidStatements
from postproc.verification.stated_texts_tp import TpStatements
from postproc.verification.statement_comparison import (
    StatementChange,
    StatementDifference,
    compare_statements,
    new_points,
)

FORMS: Mapping[str, StatementForm] = {
    "KRL": KrlStatements(),
    "G-code": GcodeStatements(),
    "RAPID": RapidStatements(),
    "Fanuc TP": TpStatements(),
}
"""Language -> how it states motions and points."""

LONGEST = 60
"""Signs of a statement that a message shows."""

_SOURCE = re.compile(rb"\bsource sha256:([0-9a-f]{16})")


@dataclass(frozen=True)
class _Side:
    """A file of one of the programs."""

    document: Document
    statements: Statements

    def shown(self, number: int) -> str:
        """A statement as it is written, as far as its first line goes."""
        text = self.document.line(self.line(number)).decode("latin-1").strip()
        return repr(text if len(text) <= LONGEST else text[: LONGEST - 3] + "...")

    def line(self, number: int) -> int:
        return self.statements.lines[number]


def statement_findings(
    family: str, programs: Sequence[Program], paths: Sequence[Toolpath], ends: MotionEnds | None = None
) -> list[Finding]:
    """What the second of two programs of a language states that the first does not, and the other way round: VER005,
    one finding a kind and file; of motions the words beside their targets.

    ``paths``: the motions of the programs; ``ends``: where they end, None where it is not known: then a statement may
    follow another motion with the same words than in the first program.
    """
    form = FORMS[family]
    sides = [
        [
            _Side(document, statements)
            for document, statements in zip(
                program.documents, form.read(program_lines(program), MovingLines.of(path)), strict=True
            )
        ]
        for program, path in zip(programs, paths, strict=True)
    ]
    if len(sides[0]) != len(sides[1]):
        more, without = (0, 1) if len(sides[0]) > len(sides[1]) else (1, 0)
        file, beside = sides[more][-1].document.path, sides[without][0].document.path
        return [Finding("VER005", f"{file.name} has no counterpart beside {beside.name}", str(file))]
    points = new_points(*([side.statements for side in files] for files in sides))
    findings: list[Finding] = []
    for one, two in zip(*sides, strict=True):
        compared = compare_statements(one.statements, two.statements, form, points)
        differences = compared.differences
        if ends is not None and one is sides[0][0]:  # the first file has the motions
            statements, lines = (one.statements, two.statements), (paths[0].line, paths[1].line)
            moved = elsewhere(compared.same, statements, lines, ends)
            differences += [StatementDifference(StatementChange.ELSEWHERE, *pair) for pair in moved.tolist()]
        for change in StatementChange:
            some = [each for each in differences if each.change is change]
            if some:
                findings.append(_finding(change, some, one, two))
    return findings


def _finding(
    change: StatementChange, differences: Sequence[StatementDifference], one: _Side, two: _Side
) -> Finding:
    first, last = differences[0], differences[-1]
    side, number, end = (
        (one, first.one, last.one) if change is StatementChange.MISSING else (two, first.two, last.two)
    )
    count = len(differences)
    more = f" ({count} statements, to line {side.line(end)})" if count > 1 else ""
    if change is StatementChange.OTHER:
        message = f"the program states {two.shown(first.two)} in the place of {one.shown(first.one)}"
    elif change is StatementChange.ADDED:
        message = f"the program states {two.shown(first.two)}, which the original does not state there"
    elif change is StatementChange.ELSEWHERE:
        message = (
            f"{two.shown(first.two)} follows another motion than in the original, line {one.line(first.one)}"
        )
    else:
        message = f"{one.shown(first.one)} is missing in the compensated program"
    return Finding("VER005", message + more, str(side.document.path), side.line(number))


def mark_findings(compensated: Program, original: Program, robot: Robot) -> list[Finding]:
    """Digests in the mark of the second program that are not those of the original and of the robot: VER009."""
    if compensated.marker is None:
        return []
    document = compensated.documents[0]
    mark = document.raw[compensated.marker.start : compensated.marker.stop]
    line, _ = document.place(compensated.marker.start)
    findings = []
    source = _SOURCE.search(mark)
    if source is not None:
        own = _digest(original.documents)
        if source[1].decode() != own[:16]:
            message = (
                f"the program was compensated from a file with sha256 {source[1].decode()}, and the original has"
                f" {own[:16]}"
            )
            findings.append(Finding("VER009", message, str(document.path), line))
    named, separator, rest = mark.partition(b" robot ")[2].partition(b" sha256:")
    digest = rest[:16].decode("latin-1")
    if separator and digest != robot.digest[:16]:
        message = (
            f"the program was compensated with the robot {named.decode('latin-1')}, sha256 {digest},"
            f" and this run has {robot.name}, sha256 {robot.digest[:16]}"
        )
        findings.append(Finding("VER009", message, str(document.path), line))
    return findings


def _digest(documents: Sequence[Document]) -> str:
    """Of one file its SHA-256, of several that of their digests in a row."""
    digests = [hashlib.sha256(document.raw).hexdigest() for document in documents]
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()
