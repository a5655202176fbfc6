"""Reads a RAPID module: its statements, what holds where, its motions."""

from __future__ import annotations

from codecs import BOM_UTF8
from functools import partial

import numpy as np

from postproc.base.document import Document, Span
from postproc.base.findings import Finding
from postproc.base.memory import without_garbage_collection
from postproc.languages.core.row_facts import not_understood
from postproc.languages.dialect import EditSyntax, Program, ReadingSettings
from postproc.languages.rapid.module_toolpath import module_toolpath
from postproc.languages.rapid.parsing import ModuleParser
from postproc.languages.rapid.propagation import Propagation
from postproc.languages.rapid.remarks import find_marker
from postproc.languages.rapid.step_budget import TooLong
from postproc.languages.rapid.syntax_tree import Module

SYNTAX = EditSyntax(comment=b"!", numbers_after=b"[,")


@without_garbage_collection()
@np.errstate(
    over="ignore", invalid="ignore"
)  # numbers that no robot has are refused, of whatever size they are
def read(documents: tuple[Document, ...], settings: ReadingSettings, fast: bool = True) -> Program:
    """The program of a file; never raises on its content.

    ``fast=False`` takes the general way for the common lines too, with the same result.
    """
    document = documents[0]
    module = ModuleParser(document.raw, fast).file()
    flow = Propagation(module, document.raw)
    findings: list[Finding] = []
    try:
        flow.run()
    except TooLong:
        message = "calls and loops run more statements than are followed: no motion is corrected"
        findings.append(_finding(document, "RAP017", message, 0))
        for store in (flow.facts, flow.passed, flow.calls, flow.reads):
            store.clear()
    toolpath, places, more = module_toolpath(document, flow, settings.symbols)
    findings += [*more, *_structure(document, module, flow), *_calls(document, flow)]
    at = _below(document.raw, module.name_stop)
    return Program(
        dialect="rapid",
        documents=documents,
        toolpath=toolpath,
        text=places if settings.places else None,
        findings=tuple(sorted(findings, key=lambda finding: (finding.line, finding.column))),
        marker=find_marker(document.raw),
        marker_at=Span(0, at, at),
        names=(),
        edit_syntax=SYNTAX,
    )


def _below(raw: bytes, at: int) -> int:
    """Where the line after a byte starts; without a module the start of the file."""
    if at < 0:
        return len(BOM_UTF8) if raw.startswith(BOM_UTF8) else 0
    return raw.find(b"\n", at) + 1 or len(raw)


def _structure(document: Document, module: Module, flow: Propagation) -> list[Finding]:
    found = []
    if module.name_stop < 0:
        found.append(_finding(document, "RAP018", "the file has no MODULE", 0))
    elif module.unclosed >= 0:
        found.append(_finding(document, "RAP007", "the MODULE has no end", module.unclosed))
    for routine in module.routines:
        name = routine.name.decode("latin-1")
        if routine.broken >= 0:
            message = f"the structure of {name} is not understood here"
            found.append(_finding(document, "RAP007", message, min(routine.broken, len(document.raw))))
        elif flow.is_unclear(routine):
            message = f"{name} is the name of several routines, or a label of it is missing or there twice"
            found.append(_finding(document, "RAP007", message, routine.start))
    unread_statements = [
        *module.unread_statements,
        *(one for one in flow.unread.values() if one.start not in flow.facts),
    ]
    texts = [(document.raw[one.start : one.stop], one.start) for one in unread_statements]
    return found + not_understood(texts, partial(_finding, document, "RAP001"))


def _calls(document: Document, flow: Propagation) -> list[Finding]:
    """Calls of what the file does not contain, and others that are not followed, once each."""
    return [
        _finding(document, "RAP010", f"{name.decode('latin-1')[:40]} {_why_unread(name, flow)}", at)
        for name, at in flow.calls.items()
    ]


def _why_unread(name: bytes, flow: Propagation) -> str:
    if flow.usage.is_late(name):
        return "names the procedure by a text: it may move the robot"
    if name in flow.routines:
        return "calls itself, is called too deep or too often, or is not understood: not each of its runs is followed"
    return "is not in this file: it may move the robot"


def _finding(document: Document, code: str, message: str, at: int) -> Finding:
    return Finding(code, message, str(document.path), *document.place(at))
