"""Runs of motions in the form that nearly all lines of a generated program have, read together with numpy."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from postproc.base.array_storage import ArrayStore
from postproc.base.arrays import Ints
from postproc.base.decimals import literals, other_literal
from postproc.base.document import offset_type
from postproc.languages.rapid.syntax_tree import Instruction, PlainMotions, PlainPlaces

FEWEST, MOST = 8, 1 << 14
"""Lines of a run that are read together: with fewer it does not pay, with more it takes memory."""
WORDS = frozenset([b"MOVEL", b"MOVEJ"])
CORRECTED = 7
"""Numbers of a target that can be corrected: x, y, z, q1 to q4."""

BLANK = rb"[ \t]*+"
_NUMBER = rb"[-+]?(?:[0-9]++(?:\.[0-9]*+)?+|\.[0-9]++)(?:[eE][-+]?[0-9][0-9]?+)?+"


def _list(items: list[bytes]) -> bytes:
    return rb"\[" + (BLANK + rb",").join(BLANK + item for item in items) + BLANK + rb"\]"


TARGET = _list([_list([_NUMBER] * count) for count in (3, 4, 4, 6)])
MOTION_WORD, MOTION_TAIL = rb"[Mm][Oo][Vv][Ee][LlJj]", BLANK + rb",[^;!\"()\r\n]++;"
LINE_END = BLANK + rb"\r?\n"
_LINE = re.compile(rb"(" + MOTION_WORD + rb")[ \t]++" + TARGET + rb"(" + MOTION_TAIL + rb")" + LINE_END)
_RUN = re.compile(
    _LINE.pattern
    + rb"(?:" + BLANK + rb"\1[ \t]++" + TARGET + rb"\2" + LINE_END + rb"){%d,%d}+" % (FEWEST - 1, MOST - 1)
)  # fmt: skip
"""Lines that are alike but for the numbers of their targets."""
_EACH_NUMBER = re.compile(rb"[-+0-9.eE]++")
_DIGITS = np.zeros(256, np.bool_)
_DIGITS[list(b"0123456789.")] = True
_SIGNS = np.zeros(256, np.bool_)
_SIGNS[list(b"+-")] = True


class PlainReader:
    """Finds the runs of a text.  ``passed``: before this byte is none that has not been found."""

    def __init__(self, raw: bytes) -> None:
        self._raw, self._passed, self._store = raw, 0, ArrayStore()

    def run(self, first: Instruction) -> PlainMotions | None:
        """The run that starts with the statement ``first``; None where there is none."""
        raw, start = self._raw, first.start
        if start < self._passed or first.name not in WORDS or _LINE.match(raw, start) is None:
            return None
        head = max(raw.rfind(b"\n", 0, start), raw.rfind(b"\r", 0, start)) + 1
        if raw[head:start].strip(b" \t"):
            return None
        found = _RUN.match(raw, start)
        if found is None or found.end(2) != first.stop:
            return None
        run = self._read(first, found.end(), found.end(2) - found.start(2))
        if run is None:
            self._passed = found.end()
        return run

    def _read(self, first: Instruction, end: int, tail: int) -> PlainMotions | None:
        """The run up to byte ``end``; ``tail``: bytes after the target of each.  None where a number is too large."""
        start = first.start
        text = np.frombuffer(self._raw, np.uint8, end - start, start)
        begins = np.concatenate([[0], np.flatnonzero(text == 0x0A)[:-1] + 1])
        semicolons = np.flatnonzero(text == 0x3B)
        stops = semicolons[np.searchsorted(semicolons, begins)] + 1
        first_at, after = number_places(text, begins)
        values, _ = literals(text, first_at.ravel(), after.ravel(), other_literal)
        extras, which = self._extras(after[:, -1] + start, stops - tail + start)
        if not (np.isfinite(values).all() and np.isfinite(extras).all()):
            return None
        while (blank := text[begins] <= 0x20).any():
            begins += blank
        small = np.min_scalar_type(int((stops - begins).max()))
        keep, from_start = self._store.keep, begins[:, None]
        places = PlainPlaces(
            starts=keep((begins + start).astype(offset_type(len(self._raw)))),
            targets=keep((stops - tail - begins).astype(small)),
            stops=keep((stops - begins).astype(small)),
            literals=keep((first_at - from_start).astype(small)),
            literal_stops=keep((after - from_start).astype(small)),
        )
        values = keep(values.reshape(first_at.shape))
        return PlainMotions(first, places, values, extras, keep(which.astype(np.int32)), end)

    def _extras(self, start: Ints, stop: Ints) -> tuple[NDArray[np.float64], Ints]:
        """Configurations and external axes (U, 10) that occur, and which of them each line has (K,)."""
        raw = self._raw
        rests = [raw[a:b] for a, b in zip(start.tolist(), stop.tolist(), strict=True)]
        number = {rest: place for place, rest in enumerate(dict.fromkeys(rests))}
        known = [each_number(rest) for rest in number]
        return np.array(known), np.fromiter((number[rest] for rest in rests), np.int64, len(rests))


def each_number(text: bytes) -> list[float]:
    """The numbers of lists."""
    return [float(one) for one in _EACH_NUMBER.findall(text)]


def number_places(text: NDArray[np.uint8], begins: Ints) -> tuple[Ints, Ints]:
    """Where the first numbers (K, 7) after the places starts (K,) in text (M,) start, and where they end."""
    inside = _DIGITS[text]
    # an exponent, and its sign, are of the number before
    inside[1:] |= ((text[1:] | 0x20) == ord("e")) & inside[:-1]
    inside |= _SIGNS[text]
    edges = np.flatnonzero(inside[1:] != inside[:-1]) + 1  # a line starts and ends with none of them
    first, after = edges[0::2], edges[1::2]
    each = np.searchsorted(first, begins)[:, None] + np.arange(CORRECTED)
    return first[each], after[each]
