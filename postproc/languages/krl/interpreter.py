"""Reads a KRL program: its lines, what they change where, then what runs."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from postproc.base.byte_search import find_word, occurs
from postproc.base.document import Document, Span
from postproc.base.findings import Finding
from postproc.base.memory import without_garbage_collection
from postproc.languages.dialect import MARK, Program
from postproc.languages.krl.aliases import aliases, parameters_of
from postproc.languages.krl.controller_data import declared_frames, declared_loads, entry_of, start_with
from postproc.languages.krl.data import (
    Declarations,
    at_the_start,
    bind_symbols,
    read_data,
    read_references,
)
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.flow_frames import Restart, Unfollowed
from postproc.languages.krl.lexing import FRAME_TABLES, Head, Statement, StatementKind, lines, module_name
from postproc.languages.krl.motion_rows import MotionRows
from postproc.languages.krl.open_blocks import BUDGET
from postproc.languages.krl.other_modules import is_module, read_modules, visible
from postproc.languages.krl.program_flow import ProgramFlow
from postproc.languages.krl.program_structure import ProgramStructure, program_structure
from postproc.languages.krl.scan import scan
from postproc.languages.krl.target import shown
from postproc.languages.krl.to_toolpath import to_toolpath
from postproc.languages.krl.value_types import structures_of
from postproc.languages.krl.variables import Variables
from postproc.languages.krl.vectorised import Item
from postproc.toolpath import FrameRef, Kind, Toolpath
from postproc.toolpath.initial_state import UNSTATED, InitialState, Symbol

NO_SYMBOLS: Mapping[str, Symbol] = MappingProxyType({})
MOST_NAMES = 8
"""Names that one finding lists."""
MOST_READINGS = 3
"""Readings in which jumps are followed that turned out to be uncertain; then none is followed."""

_TCP = re.compile(rb"#[Tt][Cc][Pp]")
_TURNING = re.compile(
    rb"_(?:TYPE?+|MODE)(?:(?<=ORI_TYP)|(?<=ORI_TYPE)|(?<=CIRC_TYP)|(?<=CIRC_TYPE)|(?<=CIRC_MODE))"
    rb"[ \t]*+(?:\.[A-Z_. \t]{0,200}+)?+=?+[ \t]*+(?!#[ \t]*(?:VAR|BASE)\b)",
    re.I,
)
"""Where the tool turns otherwise than usual; it starts with what is no letter, so that it is found fast."""

_OVERRIDE = re.compile(rb"\$(?:OV_(?:PRO|ROB|APPL)|RED_VEL)", re.I)

_MARK = f";{MARK}".encode()
_MARKER = re.compile(rb"(?:\xef\xbb\xbf)?([ \t]*" + _MARK + rb"[^\r\n]*)")
_MOTION = Statement(StatementKind.MOTION, b"", b"", 0, 0)


@without_garbage_collection()
def read(
    documents: tuple[Document, ...],
    references: Sequence[Document] = (),
    fast: bool = True,
    places: bool = True,
    symbols: Mapping[str, Symbol] = NO_SYMBOLS,
    initial: InitialState = UNSTATED,
    siblings: Sequence[Document] = (),
) -> Program:
    """Reads a program; ``fast=False`` takes the general way for the common lines too, with the same result.

    references: files that are read and never written, such as $config.dat; places: whether the program is to be
    written, else its ``text`` is None; symbols, initial, siblings: as of ``ReadingSettings``.
    """
    source = documents[0]
    code = list(scan(source, fast))
    data = [*references, *(one for one in siblings if not is_module(one))]
    declarations = Declarations(structures=structures_of(documents, data))
    for file, document in enumerate(documents[1:], 1):
        read_data(declarations, document, file)
    own = frozenset([*declarations.declared, *declarations.records])
    read_references(declarations, data)
    bind_symbols(declarations, symbols, own)
    declarations.frames, declarations.loads = declared_frames(data), declared_loads(data)
    others = read_modules(siblings, data, symbols)
    effects = visible(others, declarations)
    surveyed = program_structure(
        _statements(code), effects, {**others.directions(), **dict(_directions(code))}
    )
    others.share(surveyed, declarations.types.keys() - declarations.shared)
    surveyed.aliases = aliases(surveyed.handed, parameters_of(surveyed.routines))
    read = (*documents, *references, *siblings)
    has_tcp = any(occurs(_TCP, document.raw) for document in read)
    has_turning = any(occurs(_TURNING, document.raw) for document in read)
    unfollowed = Unfollowed(labels=_far_labels(surveyed))
    for reading in range(MOST_READINGS + 1):
        run = ExecutionContext(
            source,
            code,
            surveyed,
            declarations,
            _variables(declarations, surveyed),
            has_tcp,
            has_turning,
            any(occurs(_OVERRIDE, document.raw) for document in read),
            MotionRows(source),
            others,
            effects,
        )
        start_with(run, initial, symbols)
        flow = ProgramFlow(run, unfollowed)
        try:
            flow.all()
            break
        except Restart:
            if reading == MOST_READINGS - 1:
                unfollowed = _nothing_followed(surveyed)
    _report_structure(run)
    _report_forms(run)
    marker_at = _marker_at(source, code)
    toolpath, text, refusals = to_toolpath(run, places)
    entries = _frames_used(toolpath)
    unresolved = _unresolved(run, entries)
    _report_siblings(run, references, siblings, entries)
    findings = sorted([*run.findings, *refusals], key=lambda finding: (finding.line, finding.column))
    return Program(
        dialect="krl",
        documents=documents,
        toolpath=toolpath,
        text=text,
        findings=tuple(findings),
        marker=_marker(source.raw),
        marker_at=marker_at,
        names=tuple(_names(documents)),
        unresolved=unresolved,
    )


def _directions(code: Sequence[Item]) -> Iterator[tuple[bytes, tuple[bool, ...]]]:
    """Name of each routine, and of each of its parameters whether it comes back changed."""
    for item in code:
        if isinstance(item, Statement) and isinstance(item.strings, Head):
            yield item.strings.name, tuple(back for _, back in item.strings.parameters)


def _frames_used(toolpath: Toolpath) -> dict[str, FrameRef]:
    """The entries of BASE_DATA and TOOL_DATA that motions have and whose pose the program does not state."""
    found = {}
    for table, used in ((b"BASE", toolpath.base), (b"TOOL", toolpath.tool)):
        for index in np.unique(used).tolist():
            frame = toolpath.frames[index] if index >= 0 else None
            if frame is not None and frame.entry and frame.pose is None:
                found[entry_of(table, frame.entry)] = frame
    return found


def _unresolved(run: ExecutionContext, entries: Mapping[str, FrameRef]) -> frozenset[str]:
    """Names that the program asks for and no file that was read declares; routines with ().  entries: of BASE_DATA and
    TOOL_DATA that motions have."""
    known = {*FRAME_TABLES, *run.declarations.types, *run.declarations.values, *run.declarations.records}
    known |= {name for routine in run.structure.routine_at.values() for name in routine.types}
    names = {name for name in run.variables.asked - known if not name.startswith(b"$")}
    calls = run.unread | {name for of in run.others.unread.values() for name in of}
    unknown = (entry for entry, frame in entries.items() if frame.declared is None)
    return frozenset([*map(shown, names), *(f"{shown(name)}()" for name in calls), *unknown])


def _report_siblings(
    run: ExecutionContext,
    references: Sequence[Document],
    siblings: Sequence[Document],
    entries: Mapping[str, FrameRef],
) -> None:
    """Says which files beside the program are read, and for what; of ``references``, which the user names, for which
    ``entries`` of BASE_DATA and TOOL_DATA."""
    used: dict[str, list[str]] = {}
    for name in sorted(run.variables.asked & run.declarations.origin.keys() - set(FRAME_TABLES)):
        used.setdefault(run.declarations.origin[name], []).append(shown(name))
    for name, (module, _) in sorted(run.others.routines.items()):
        used.setdefault(module.document.path.name, []).append(f"{shown(name)}()")
    frames: dict[str, list[str]] = {}
    for entry, frame in entries.items():
        if frame.declared is not None:
            word = "tool" if entry.startswith("TOOL") else "base"
            file = run.declarations.frames[entry][1]
            frames.setdefault(file, []).append(f"{entry} (where the cell has no such {word})")
    for document in (*references, *siblings):
        names = [*(used.get(document.path.name, ()) if document in siblings else ())]
        names += frames.get(document.path.name, ())
        if names:
            more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
            message = f"{document.path} is read for {', '.join(names[:MOST_NAMES])}{more}"
            run.findings.append(Finding("KRL033", message, str(run.document.path)))


def _statements(code: Sequence[Item]) -> Iterator[tuple[int, Statement]]:
    """Index and statement; what runs of common lines change, one motion does."""
    return ((i, item if isinstance(item, Statement) else _MOTION) for i, item in enumerate(code))


def _variables(declarations: Declarations, surveyed: ProgramStructure) -> Variables:
    fixed, changing = at_the_start(declarations, surveyed.assigned)
    variables = Variables(fixed)
    for name, entry in changing.items():
        variables.replace(name, entry)
    return variables


def _far_labels(surveyed: ProgramStructure) -> set[tuple[int, bytes]]:
    """The labels to which a GOTO leads back over more statements than are followed again."""
    found = set()
    for (start, name), (_, last) in surveyed.jumps.items():
        at, _ = surveyed.routine_at[start].labels.get(name, (last, ()))
        if last - at > BUDGET:
            found.add((start, name))
    return found


def _nothing_followed(surveyed: ProgramStructure) -> Unfollowed:
    labels = {
        (routine.start, name) for routine in surveyed.routine_at.values() for name in routine.labels
    } & surveyed.jumps.keys()
    return Unfollowed(set(), labels, everything=True)


def _report_structure(run: ExecutionContext) -> None:
    name = str(run.document.path)
    for line, what in run.structure.unclosed:
        run.findings.append(Finding("KRL014", what, name, line, 1))
    if not run.structure.has_routine:
        first = next((n for n, a, b in lines(run.document) if run.document.raw[a:b].strip()), 1)
        run.findings.append(Finding("KRL018", "the file has no DEF", name, first, 1))


def _report_forms(run: ExecutionContext) -> None:
    """Reports statements with words that have no meaning there, but those that are rows, refused as motions."""
    chunks = (chunk for chunk in run.rows.chunks if isinstance(chunk, list))
    rows = {row.line for chunk in chunks for row in chunk if row.kind == Kind.OTHER}
    for item in run.code:
        if isinstance(item, Statement) and item.code in run.structure.ill_formed and item.line not in rows:
            message = f"'{shown(item.code)}' is not understood; what it does is not known"
            run.add_finding("KRL034", message, item)


def _marker(raw: bytes) -> Span | None:
    """The first line that is the comment of a compensated program."""
    at = find_word(raw, _MARK)
    while at >= 0:
        found = _MARKER.match(raw, raw.rfind(b"\n", 0, at) + 1)
        if found:
            return Span(0, *found.span(1))
        at = find_word(raw, _MARK, raw.find(b"\n", at) + 1 or len(raw))
    return None


def _marker_at(document: Document, code: Sequence[Item]) -> Span:
    """After the first DEF line; without one after the header lines."""
    for item in code:
        if isinstance(item, Statement) and item.kind == StatementKind.DEF:
            behind = document.raw.find(b"\n", item.at) + 1 or len(document.raw)
            return Span(0, behind, behind)
    at = len(BOM_UTF8) if document.raw.startswith(BOM_UTF8) else 0
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
