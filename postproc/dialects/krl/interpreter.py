"""A KRL program, line by line: the state before each motion, and the motions."""

from __future__ import annotations

import re
from collections.abc import Iterator

from postproc.dialects.dialect import Program
from postproc.dialects.krl import motions
from postproc.dialects.krl.assignments import assign, command, declare
from postproc.dialects.krl.data import Declarations, read_data
from postproc.dialects.krl.lexing import (
    BOM,
    LOOPS,
    SPLINES,
    Assignment,
    Call,
    Declared,
    Statement,
    identifiers,
    lines,
    module_name,
    statement,
)
from postproc.dialects.krl.rows import HELP, Rows
from postproc.dialects.krl.run import Open, Run
from postproc.dialects.krl.state import State
from postproc.dialects.krl.survey import (
    HIDDEN,
    PATH_FROM_FILE,
    Block,
    Routine,
    functions_of,
    is_harmless,
    survey,
)
from postproc.dialects.krl.target import QUICK, quick
from postproc.document import Document, Span
from postproc.findings import Finding
from postproc.toolpath import Annotation

_ANNOTATION = re.compile(rb";[ \t]*(?:FORCE|COMPENSATE)(?![A-Za-z0-9_])", re.I)
_WITH = re.compile(rb"\bWITH\b", re.I)
_MARKER = re.compile(rb"^(?:\xef\xbb\xbf)?([ \t]*;COMPENSATED by compensate [^\r\n]*)", re.M)
_MOTION = Statement("motion", b"", b"", 0, 0)

Line = Statement | tuple[int, int, int]
"""A statement, or line, start and stop of a motion in the common form."""


def read(documents: tuple[Document, ...], fast: bool = True) -> Program:
    """Reads a program; ``fast=False`` takes the general way for the common form too, with the same result."""
    source = documents[0]
    found = list(_scan(source, fast))
    surveyed = survey((i, s if isinstance(s, Statement) else _MOTION) for i, s in enumerate(found))
    declarations = read_data(documents[1], 1) if len(documents) > 1 else Declarations()
    has_tcp = any(b"#TCP" in document.raw.upper() for document in documents)
    run = Run(source, surveyed, declarations, has_tcp, Rows(source))
    run.state.variables.update(declarations.points)
    for index, item in enumerate(found):
        if isinstance(item, Statement):
            _step(run, index, item)
        else:
            match = QUICK.match(source.raw, item[1], item[2])
            assert match is not None
            motions.move_to(run, match[1].upper(), item[0], match.start(1), quick(match))
    declared = {id(point) for point in declarations.points.values()}
    run.rows.judge_points(run.mentioned, surveyed.assigned, declared)
    _tell_structure(run)
    toolpath, places, refusals = run.rows.finished(run.frames)
    findings = sorted([*run.findings, *refusals], key=lambda finding: (finding.line, finding.column))
    marker = _MARKER.search(source.raw)
    return Program(
        dialect="krl",
        documents=documents,
        toolpath=toolpath,
        text=places,
        findings=tuple(findings),
        marker=Span(0, *marker.span(1)) if marker else None,
        marker_at=_marker_at(source, found),
        names=tuple(_names(documents)),
    )


def _scan(document: Document, fast: bool) -> Iterator[Line]:
    raw = document.raw
    for line, start, stop in lines(document):
        if fast and QUICK.match(raw, start, stop):
            yield line, start, stop
        else:
            found = statement(raw, line, start, stop)
            if found is not None:
                yield found


def _step(run: Run, index: int, item: Statement) -> None:
    if item.comment and _ANNOTATION.match(item.comment):
        text = item.comment[1:].decode("latin-1").strip()
        run.rows.annotations.append(Annotation(len(run.rows), text, item.line))
    for name in functions_of(item):
        _called(run, item, name, item.code)
    for what, block in run.survey.events.get(index, ()):
        if what == "open":
            _open(run, block, item)
        elif what == "branch":
            _branch(run, block)
        else:
            _close(run, block, item.line)
    kind, said = item.kind, item.said
    if kind == "motion":
        motions.move(run, item)
    elif isinstance(said, Assignment):
        assign(run, item, said)
    elif isinstance(said, Declared):
        declare(run, said)
    elif isinstance(said, Call):
        _call(run, item, said)
    elif kind == "label" and isinstance(said, bytes):
        _label(run, item, said)
    elif kind == "goto" and isinstance(said, bytes):
        run.rows.sources[b"label " + said] |= run.state.sources
    elif kind == "other" and run.survey.has_routine and HIDDEN.search(item.code):
        motions.unknown_motion(run, item)
    elif kind in ("open", "branch", "close", "kept", "other"):
        run.mentioned |= identifiers(item.code)


def _open(run: Run, block: Block, item: Statement) -> None:
    if isinstance(block, Routine):
        points = run.declarations.points
        if not block.is_main:
            # What the program assigned before the call is not known here.
            points = {k: p for k, p in points.items() if k.split(b"[")[0] not in run.survey.assigned}
        run.state = State(variables=dict(points))
        if not block.is_main:
            mark = b"routine %d" % block.line
            run.state.sources = frozenset([mark])
            run.state.lose_point("it is where the caller left the robot")
        run.stack = [Open(block, run.state)]
        return
    run.stack.append(Open(block, run.state.copy()))
    if block.word in LOOPS:
        run.forget(block.effects, f"in the loop of line {block.line}")
    elif block.word in SPLINES and _WITH.search(item.code):
        run.forget({"base", "tool"}, f"in the spline of line {block.line}: it has a WITH")


def _branch(run: Run, block: Block) -> None:
    opened = run.stack[-1]
    opened.sources |= run.state.sources
    run.state = opened.entry.copy()


def _close(run: Run, block: Block, line: int) -> None:
    opened = run.stack.pop()
    if isinstance(block, Routine):
        run.state = State()
        run.stack = []
    elif block.word in SPLINES:
        # What a WITH of the spline set ends with it.
        frames = (run.state.base, run.state.tool)
        run.state.base, run.state.tool = opened.entry.base, opened.entry.tool
        if frames != (run.state.base, run.state.tool):
            run.state.lose_point(f"after the spline of line {block.line}")
    else:
        sources = opened.sources | opened.entry.sources | run.state.sources
        run.state = opened.entry
        shown = block.word.decode("latin-1")
        run.forget(block.effects, f"after the {shown} block of lines {block.line} to {line}")
        run.state.sources = sources


def _call(run: Run, item: Statement, said: Call) -> None:
    if said.name == b"BAS":
        command(run, item, said.arguments)
        return
    run.mentioned |= identifiers(said.arguments)
    _called(run, item, said.name, said.arguments)


def _called(run: Run, item: Statement, name: bytes, given: bytes) -> None:
    """Takes up that a routine or function ran; the names in ``given`` may come back from it changed."""
    words = identifiers(given)
    shown = name.decode("latin-1")
    why = f"after the call of {shown} in line {item.line}"
    routine = run.survey.routines.get(name)
    if routine is not None:
        run.rows.sources[b"routine %d" % routine.line] |= run.state.sources
        run.forget(routine.effects | words, why)
        return
    if is_harmless(name):
        return
    run.forget({"point", *words}, why)
    if name.startswith(PATH_FROM_FILE):
        run.tell("KRL021", f"{shown} reads its path from a file; nothing of that is corrected", item)
    else:
        message = (
            f"{shown} was not read: after it the position is not known; base and tool are taken as unchanged"
        )
        run.tell("KRL010", message, item)


def _label(run: Run, item: Statement, name: bytes) -> None:
    if name not in run.survey.jumps:
        return
    shown = name.decode("latin-1")
    lost: set[str | bytes] = {"point", "base", "tool", *run.survey.effects}
    run.forget(lost, f"after the label {shown} in line {item.line}")
    run.state.sources |= {b"label " + name}
    run.tell("KRL020", f"a GOTO leads to {shown}: base, tool and position are not known from here on", item)


def _tell_structure(run: Run) -> None:
    name = str(run.document.path)
    for line, what in run.survey.unclosed:
        run.findings.append(Finding("KRL014", what, name, line, 1, HELP["KRL014"]))
    if not run.survey.has_routine:
        first = next((n for n, a, b in lines(run.document) if run.document.raw[a:b].strip()), 1)
        run.findings.append(Finding("KRL018", "the file has no DEF", name, first, 1))


def _marker_at(document: Document, found: list[Line]) -> Span:
    """Behind the first DEF line; without one behind the header lines."""
    starts = [*document.line_starts[1:], len(document.raw)]
    for item in found:
        if isinstance(item, Statement) and item.kind == "def":
            return Span(0, starts[item.line - 1], starts[item.line - 1])
    at = len(BOM) if document.raw.startswith(BOM) else 0
    for _, start, stop in lines(document):
        if not document.raw[start:stop].lstrip().startswith(b"&"):
            break
        at = stop
    return Span(0, at, at)


def _names(documents: tuple[Document, ...]) -> Iterator[Span]:
    for file, (document, word) in enumerate(zip(documents, (b"DEF", b"DEFDAT"), strict=False)):
        found = module_name(document.raw, word)
        if found:
            yield Span(file, *found)
