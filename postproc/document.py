"""A source file as bytes, and edits on it.

A source is never rebuilt: a change is a list of edits (span, text) that are spliced into the
bytes.  What no edit covers is copied, so the result is lossless by construction.
"""

from __future__ import annotations

import hashlib
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path


@dataclass(frozen=True, slots=True, order=True)
class Span:
    """The bytes ``start .. stop - 1`` of document number ``file`` of a program; empty where start == stop."""

    file: int
    start: int
    stop: int


@dataclass(frozen=True, slots=True)
class Edit:
    """``text`` takes the place of ``span``; an empty span inserts."""

    span: Span
    text: bytes


@dataclass(frozen=True)
class Document:
    """The raw bytes of one file, and where its lines begin."""

    path: Path
    raw: bytes

    @cached_property
    def line_starts(self) -> list[int]:
        """Offset of the first byte of every line (the byte after each LF; CRLF and LF alike)."""
        starts = [0]
        find = self.raw.find
        at = find(b"\n")
        while at >= 0:
            starts.append(at + 1)
            at = find(b"\n", at + 1)
        return starts

    @cached_property
    def newline(self) -> bytes:
        """The line ending this file uses (of its first line; LF where it has none)."""
        at = self.raw.find(b"\n")
        return b"\r\n" if at > 0 and self.raw[at - 1 : at] == b"\r" else b"\n"

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the bytes, hexadecimal."""
        return hashlib.sha256(self.raw).hexdigest()

    def place(self, offset: int) -> tuple[int, int]:
        """Line and column, both from 1, of a byte."""
        line = bisect_right(self.line_starts, offset)
        return line, offset - self.line_starts[line - 1] + 1

    def line(self, number: int) -> bytes:
        """The bytes of a line (from 1) without its ending."""
        start = self.line_starts[number - 1]
        stop = self.line_starts[number] if number < len(self.line_starts) else len(self.raw)
        return self.raw[start:stop].rstrip(b"\r\n")


def apply(document: Document, edits: Iterable[Edit]) -> bytes:
    """The bytes of ``document`` with ``edits`` spliced in.

    Edits at one place are written in the order given.  Raises ValueError on an overlap or a span
    outside of the document: a defect of the program, never of its input.
    """
    pieces: list[bytes] = []
    at = 0
    for edit in in_order(edits):
        if not at <= edit.span.start <= edit.span.stop <= len(document.raw):
            raise ValueError(f"edits overlap or leave the document at byte {edit.span.start}")
        pieces += (document.raw[at : edit.span.start], edit.text)
        at = edit.span.stop
    pieces.append(document.raw[at:])
    return b"".join(pieces)


def in_order(edits: Iterable[Edit]) -> list[Edit]:
    """Edits by place; stable, so two insertions at one place keep their order."""
    return sorted(edits, key=lambda edit: (edit.span.start, edit.span.stop))


def undone(written: bytes, original: bytes, edits: Sequence[Edit]) -> bool:
    """Whether ``written`` is ``original`` in every byte that no edit covers, and each edit's text in its place.

    Goes by the written bytes, on another way than ``apply``: it takes the texts out again and compares.
    """
    at = shift = 0
    for edit in in_order(edits):
        begin = edit.span.start + shift
        if written[at + shift : begin] != original[at : edit.span.start]:
            return False
        if written[begin : begin + len(edit.text)] != edit.text:
            return False
        shift += len(edit.text) - (edit.span.stop - edit.span.start)
        at = edit.span.stop
    return written[at + shift :] == original[at:]
