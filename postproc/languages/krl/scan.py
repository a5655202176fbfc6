"""Lines as statements; runs of common lines are read together, with numpy on their bytes."""

from __future__ import annotations

import math
import re
from codecs import BOM_UTF8
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.base.array_storage import ArrayStore
from postproc.base.arrays import Floats, is_shared
from postproc.base.batches import in_blocks
from postproc.base.decimals import literals
from postproc.base.document import Document, offset_type
from postproc.languages.krl.external_axes import UNSTATED, six
from postproc.languages.krl.lexing import Statement, StatementKind, statement
from postproc.languages.krl.lines_alike import lines_alike, pieces
from postproc.languages.krl.spatial import Numbers
from postproc.languages.krl.target import COMPONENTS, KrlTarget, parse
from postproc.languages.krl.vectorised import Item, VectorisedLines
from postproc.toolpath.meant_comments import MAY_BE_MEANT

FEWEST, MOST = 8, 1 << 14
"""Lines of a run that are read together: with fewer it does not pay, with more it takes memory."""

_B = rb"[ \t]*+"
_REAL = rb"[-+]?\d{1,15}+(?:\.\d{0,20}+)?+"
_STATE = rb"(?:\d{1,9}+|'[Bb][01]{1,30}+')"
_MORE = (
    rb"(?:" + b"".join(_B + rb"," + _B + key + rb"(?=[ \t'])" + _B + _STATE for key in (b"S", b"T")) + rb")?+"
    + b"".join(rb"(?:" + _B + rb"," + _B + rb"E%d[ \t]++" % i + _REAL + rb")?+" for i in range(1, 7))
)  # fmt: skip
_LINE = (
    _B + rb"(?:LIN|PTP)" + _B + rb"\{"
    + (_B + rb",").join(_B + key + rb"[ \t]++" + _REAL for key in COMPONENTS)
    + rb"(?:" + _B + rb"\}|" + _MORE + _B + rb"\})"
    + _B + rb"(?:C_(?:DIS|VEL|ORI|PTP)" + _B + rb")?+"
    + rb"(?:;(?![ \t]*(?:FORCE|COMPENSATE|%s))[^\r\n{}]*+)?+\r?\n" % MAY_BE_MEANT
)  # fmt: skip
_RUN = re.compile(rb"^(?:%s){%d,%d}+" % (_LINE, FEWEST, MOST), re.I | re.M)
_EXTERNAL = re.compile(rb"(?<![ \t])" + _B + rb"," + _B + rb"[Ee]([1-6])[ \t]++(" + _REAL + rb")")
_IN_NUMBER = np.zeros(256, bool)
_IN_NUMBER[list(b"0123456789.+-")] = True


def scan(document: Document, fast: bool) -> Iterator[Item]:
    """The statements of a program in the order of the text, without its header; ``fast``: runs of common lines as
    one."""
    items = _items(document, fast)
    for item in items:
        if isinstance(item, Statement) and item.kind == StatementKind.HEADER:
            continue
        yield item
        if not isinstance(item, Statement) or item.kind != StatementKind.COMMENT:
            break
    yield from items


def _items(document: Document, fast: bool) -> Iterator[Item]:
    raw = document.raw
    store = ArrayStore()
    line, place = 1, len(BOM_UTF8) if raw.startswith(BOM_UTF8) else 0
    parts = list(pieces(raw, place)) if fast else []
    read = in_blocks(lambda part: [_runs(raw, *piece) for piece in parts[part]], len(parts), 1)
    for start, stop, found in chain.from_iterable(chain.from_iterable(read)):
        yield from _lines(raw, line, place, start)
        line += raw.count(b"\n", place, start)
        vectorised = _compacted(found, line, store)
        yield vectorised
        line += len(vectorised)
        place = stop
    yield from _lines(raw, line, place, len(raw))


def _runs(raw: bytes, start: int, stop: int) -> list[tuple[int, int, VectorisedLines]]:
    """The runs of common lines between two bytes that start a line, each with its span."""
    alike = lines_alike(raw, start, stop)
    if alike is not None and len(alike) >= FEWEST:
        return [(start, stop, alike)]
    spans = [found.span() for found in _RUN.finditer(raw, start, stop)]
    return [(*span, _vectorised_lines(raw, *span)) for span in spans]


def _compacted(vectorised: VectorisedLines, line: int, store: ArrayStore) -> VectorisedLines:
    """The same where it takes no more memory than it needs, with the number of its first line."""
    external = vectorised.external
    return replace(
        vectorised,
        line=line,
        is_line=store.keep(vectorised.is_line),
        values=store.keep(vectorised.values),
        start=store.keep(vectorised.start),
        stop=store.keep(vectorised.stop),
        motion=store.keep(vectorised.motion),
        approximation=store.keep(vectorised.approximation),
        external=store.keep(external) if external is not None and not is_shared(external) else external,
    )


def _lines(raw: bytes, line: int, start: int, stop: int) -> Iterator[Item]:
    while start < stop:
        end = raw.find(b"\n", start, stop)
        end = stop if end < 0 else end + 1
        found = statement(raw, line, start, end)
        if found is not None:
            yield found
        start, line = end, line + 1


def _vectorised_lines(raw: bytes, start: int, stop: int) -> VectorisedLines:
    """The common lines from byte ``start`` to ``stop``, as if they were the first ones."""
    text = np.frombuffer(raw, np.uint8, stop - start, start)
    ends = np.flatnonzero(text == 0x0A)
    begins = np.concatenate([[0], ends[:-1] + 1])
    opening, closing = np.flatnonzero(text == 0x7B), np.flatnonzero(text == 0x7D)
    inside = _IN_NUMBER[text]
    edges = np.flatnonzero(inside[1:] != inside[:-1]) + 1  # a line starts and ends with neither
    first, after = edges[0::2], edges[1::2]
    six = np.searchsorted(first, begins)[:, None] + np.arange(6)
    starts, stops = first[six], after[six]
    word = begins.copy()
    while (blank := text[word] <= 0x20).any():
        word += blank
    approximation, code = _approximations(text, closing)
    status, turn, external = _states(raw, start, stops[:, 5], closing)
    offset = offset_type(len(raw))
    motion = np.stack([word, opening, closing + 1, code], axis=1)
    return VectorisedLines(
        line=1,
        is_line=(text[word] | 0x20) == ord("l"),
        values=literals(text, starts.ravel(), stops.ravel(), _long)[0].reshape(-1, 6),
        start=(starts + start).astype(offset),
        stop=(stops + start).astype(offset),
        motion=(motion + start).astype(offset),
        status=status,
        turn=turn,
        approximation=approximation,
        external=external,
    )


def _long(text: bytes) -> tuple[float, int]:
    """A number of more digits than are read in bulk."""
    return float(text), 0


def _approximations(text: NDArray[Any], closing: NDArray[Any]) -> tuple[NDArray[np.int8], NDArray[Any]]:
    """Kind of the approximation (see ``VectorisedLines``) after a brace, and where the code of the line ends."""
    word = closing + 1
    while (blank := (text[word] == 0x20) | (text[word] == 0x09)).any():
        word += blank
    there = (text[word] | 0x20) == ord("c")
    rows = np.flatnonzero(there)
    approximation, code = np.zeros(len(closing), np.int8), closing + 1
    approximation[rows] = np.where((text[word[rows] + 2] | 0x20) == ord("d"), 1, 2)
    code[rows] = word[rows] + len("C_DIS")
    return approximation, code


def _states(
    raw: bytes, start: int, after: NDArray[Any], closing: NDArray[Any]
) -> tuple[NDArray[np.int32], NDArray[np.int32], Floats | None]:
    """S, T and the external axes of the lines, which are between their last angle and the brace."""
    rows = np.flatnonzero(closing > after)
    if not len(rows):
        none = np.broadcast_to(np.int32(-1), len(closing))
        return none, none, None
    status, turn = np.full(len(closing), -1, np.int32), np.full(len(closing), -1, np.int32)
    rests = [
        raw[a:b]
        for a, b in zip((after[rows] + start).tolist(), (closing[rows] + start).tolist(), strict=True)
    ]
    number = {rest: i for i, rest in enumerate(dict.fromkeys(rests))}
    known = [_state(rest) for rest in number]
    which = np.fromiter((number[rest] for rest in rests), np.int64, len(rests))
    status[rows], turn[rows] = np.array([found[:2] for found in known], np.int32)[which].T
    each = np.array([found[2] for found in known])
    if np.isnan(each).all():
        return status, turn, None
    if len(rows) == len(closing) and len(np.unique(each, axis=0)) == 1:
        return status, turn, np.broadcast_to(each[0], (len(closing), 6))
    external = np.full((len(closing), 6), np.nan)
    external[rows] = each[which]
    return status, turn, external


def _state(rest: bytes) -> tuple[int, int, Numbers]:
    """S, T and E1..E6 of what is after the last angle."""
    found = _EXTERNAL.search(rest)
    if found is None:
        return *_bits(rest), UNSTATED
    values = [math.nan] * 6
    for axis, value in _EXTERNAL.findall(rest):
        values[int(axis) - 1] = float(value)
    return *_bits(rest[: found.start()]), six(values)


@lru_cache(maxsize=1024)
def _bits(rest: bytes) -> tuple[int, int]:
    target = parse(b"{X 0" + rest + b"}", 0, 0)
    return (target.status, target.turn) if isinstance(target, KrlTarget) else (-1, -1)
