"""Lines as statements; runs of common lines are read together, with numpy on their bytes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import chain, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.blocks import in_blocks
from postproc.decimals import literals
from postproc.dialects.krl.bulk import Bulk
from postproc.dialects.krl.lexing import BOM, statement
from postproc.dialects.krl.run import Item
from postproc.dialects.krl.target import COMPONENTS, External, Target, parse
from postproc.document import BLOCK, Document, Store, offset_type

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
    + rb"(?:;(?![ \t]*(?:FORCE|COMPENSATE))[^\r\n{}]*+)?+\r?\n"
)  # fmt: skip
_RUN = re.compile(rb"^(?:%s){%d,%d}+" % (_LINE, FEWEST, MOST), re.I | re.M)
_IN_NUMBER = np.zeros(256, bool)
_IN_NUMBER[list(b"0123456789.+-")] = True


def scan(document: Document, fast: bool) -> Iterator[Item]:
    """The statements of a program in the order of the text; ``fast``: runs of common lines as one."""
    raw = document.raw
    store = Store()
    line, place = 1, len(BOM) if document.raw.startswith(BOM) else 0
    runs = [found.span() for found in _RUN.finditer(raw, place)] if fast else []
    groups = _groups(runs)
    read = in_blocks(
        lambda part: [_bulk(raw, *run) for group in groups[part] for run in group], len(groups), 1
    )
    for (start, stop), found in zip(runs, chain.from_iterable(read), strict=True):
        yield from _lines(raw, line, place, start)
        line += raw.count(b"\n", place, start)
        bulk = _kept(found, line, store)
        yield bulk
        line += len(bulk)
        place = stop
    yield from _lines(raw, line, place, len(raw))


def _groups(runs: Sequence[tuple[int, int]]) -> list[Sequence[tuple[int, int]]]:
    """The runs, in groups of as many bytes as are read at a time."""
    ends = np.cumsum([stop - start for start, stop in runs])
    cuts = np.searchsorted(ends, np.arange(BLOCK, ends[-1] if runs else 0, BLOCK)) + 1
    bounds = [0, *np.unique(cuts).tolist(), len(runs)]
    return [runs[a:b] for a, b in pairwise(bounds) if a < b]


def _kept(bulk: Bulk, line: int, store: Store) -> Bulk:
    """The same where it takes no more memory than it needs, with the number of its first line."""
    return replace(
        bulk,
        line=line,
        is_line=store.keep(bulk.is_line),
        values=store.keep(bulk.values),
        start=store.keep(bulk.start),
        stop=store.keep(bulk.stop),
        motion=store.keep(bulk.motion),
        slur=store.keep(bulk.slur),
    )


def _lines(raw: bytes, line: int, start: int, stop: int) -> Iterator[Item]:
    while start < stop:
        end = raw.find(b"\n", start, stop)
        end = stop if end < 0 else end + 1
        found = statement(raw, line, start, end)
        if found is not None:
            yield found
        start, line = end, line + 1


def _bulk(raw: bytes, start: int, stop: int) -> Bulk:
    """The common lines from byte ``start`` to ``stop``, as if they were the first ones."""
    text = np.frombuffer(raw, np.uint8, stop - start, start)
    ends = np.flatnonzero(text == 0x0A)
    begins = np.concatenate([[0], ends[:-1] + 1])
    opening, closing = np.flatnonzero(text == 0x7B), np.flatnonzero(text == 0x7D)
    inside = _IN_NUMBER[text]
    edges = np.flatnonzero(inside[1:] != inside[:-1]) + 1  # a line begins and ends with neither
    first, behind = edges[0::2], edges[1::2]
    six = np.searchsorted(first, begins)[:, None] + np.arange(6)
    starts, stops = first[six], behind[six]
    word = begins.copy()
    while (blank := text[word] <= 0x20).any():
        word += blank
    slur, code = _approximations(text, closing)
    status, turn, external = _states(raw, start, stops[:, 5], closing)
    offset = offset_type(len(raw))
    motion = np.stack([word, opening, closing + 1, code], axis=1)
    return Bulk(
        line=1,
        is_line=(text[word] | 0x20) == ord("l"),
        values=literals(text, starts.ravel(), stops.ravel(), _long)[0].reshape(-1, 6),
        start=(starts + start).astype(offset),
        stop=(stops + start).astype(offset),
        motion=(motion + start).astype(offset),
        status=status,
        turn=turn,
        slur=slur,
        external=external,
    )


def _long(text: bytes) -> tuple[float, int]:
    """A number of more digits than are read in bulk."""
    return float(text), 0


def _approximations(text: NDArray[Any], closing: NDArray[Any]) -> tuple[NDArray[np.int8], NDArray[Any]]:
    """Kind of the approximation (see ``Bulk.slur``) behind a brace, and where the code of the line ends."""
    word = closing + 1
    while (blank := (text[word] == 0x20) | (text[word] == 0x09)).any():
        word += blank
    there = (text[word] | 0x20) == ord("c")
    rows = np.flatnonzero(there)
    slur, code = np.zeros(len(closing), np.int8), closing + 1
    slur[rows] = np.where((text[word[rows] + 2] | 0x20) == ord("d"), 1, 2)
    code[rows] = word[rows] + len("C_DIS")
    return slur, code


def _states(
    raw: bytes, start: int, behind: NDArray[Any], closing: NDArray[Any]
) -> tuple[NDArray[np.int32], NDArray[np.int32], tuple[tuple[int, External], ...]]:
    """S, T and the external axes of the lines, which stand between their last angle and the brace."""
    rows = np.flatnonzero(closing > behind)
    if not len(rows):
        none = np.broadcast_to(np.int32(-1), len(closing))
        return none, none, ()
    status, turn = np.full(len(closing), -1, np.int32), np.full(len(closing), -1, np.int32)
    rests = [
        raw[a:b]
        for a, b in zip((behind[rows] + start).tolist(), (closing[rows] + start).tolist(), strict=True)
    ]
    known = {rest: _state(rest) for rest in set(rests)}
    found = np.array([known[rest][:2] for rest in rests], np.int32)
    status[rows], turn[rows] = found[:, 0], found[:, 1]
    external: dict[External, int] = {}
    for row, rest in zip(rows.tolist(), rests, strict=True):
        if known[rest][2]:
            external.setdefault(known[rest][2], row)
    return status, turn, tuple((row, axes) for axes, row in external.items())


@lru_cache(maxsize=1024)
def _state(rest: bytes) -> tuple[int, int, External]:
    target = parse(b"{X 0" + rest + b"}", 0, 0)
    return (target.status, target.turn, target.external) if isinstance(target, Target) else (-1, -1, ())
