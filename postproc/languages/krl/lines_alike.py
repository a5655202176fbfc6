"""Lines that are all alike but for their six numbers, as nearly all of a generated program are: read without looking at
each by a regular expression."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from postproc.base.decimals import literals
from postproc.base.document import BLOCK, offset_type
from postproc.languages.krl.target import COMPONENTS
from postproc.languages.krl.vectorised import VectorisedLines

_IN_NUMBERS = b"0123456789.+-"
_IN_NUMBER = np.zeros(256, bool)
_IN_NUMBER[list(_IN_NUMBERS)] = True
_FORM = re.compile(
    rb"([ \t]*+)(LIN|PTP)[ \t]*+\{[ \t]*+"
    + b",[ \t]*+".join(key + rb"[ \t]++" for key in COMPONENTS)
    + rb"\}[ \t]*+(C_(?:DIS|VEL|ORI|PTP))?+[ \t]*+\r?+\n",
    re.I,
)
"""A line without the letters of its numbers; as a comma or the brace follows on blanks alone, a number is between them
where it ends at each of these."""
_AFTER = np.frombuffer(b",,,,,}", np.uint8)


def pieces(raw: bytes, start: int) -> Iterator[tuple[int, int]]:
    """Spans of whole lines of ``raw`` from ``start`` on, each as long as is read at a time."""
    while start < len(raw):
        stop = raw.find(b"\n", start + BLOCK) + 1 or len(raw)
        yield start, stop
        start = stop


def lines_alike(raw: bytes, start: int, stop: int) -> VectorisedLines | None:
    """The lines from byte ``start`` to ``stop``, as if they were the first ones; None where they are not all alike, or
    have a number of another form than digits with a sign and a point."""
    first = raw[start : raw.find(b"\n", start, stop) + 1].translate(None, _IN_NUMBERS)
    form = _FORM.fullmatch(first)
    rest = b"" if form is None else raw[start:stop].translate(None, _IN_NUMBERS)
    count = len(rest) // len(first) if first else 0
    if form is None or rest != first * count:
        return None
    text = np.frombuffer(raw, np.uint8, stop - start, start)
    inside = _IN_NUMBER[text]
    edges = np.flatnonzero(inside[1:] != inside[:-1]) + 1  # it starts and ends with neither
    if len(edges) != 12 * count or inside[0]:
        return None
    starts, stops = (np.ascontiguousarray(edges[at::2]).reshape(count, 6) for at in (0, 1))
    signed = starts + ((text[starts] == ord("-")) | (text[starts] == ord("+")))
    if not ((text[stops] == _AFTER) & (text[signed] != ord("."))).all():
        return None
    try:
        values = literals(text, starts.ravel(), stops.ravel(), _other)[0].reshape(count, 6)
    except _OtherForm:
        return None
    begins = np.concatenate([[0], stops[:-1, 5] + (len(first) - first.index(b"}"))])
    offset, closing = offset_type(len(raw)), stops[:, 5] + 1
    code = closing if form[3] is None else closing + (form.end(3) - first.index(b"}") - 1)
    motion = np.stack([begins + form.end(1), begins + first.index(b"{"), closing, code], axis=1)
    none = np.broadcast_to(np.int32(-1), count)
    kind = 0 if form[3] is None else 1 if form[3].upper() == b"C_DIS" else 2
    return VectorisedLines(
        line=1,
        is_line=np.full(count, form[2].upper() == b"LIN"),
        values=values,
        start=(starts + start).astype(offset),
        stop=(stops + start).astype(offset),
        motion=(motion + start).astype(offset),
        status=none,
        turn=none,
        approximation=np.full(count, kind, np.int8),
    )


class _OtherForm(Exception):
    """A number is not digits with a sign and a point."""


def _other(_: bytes) -> tuple[float, int]:
    raise _OtherForm
