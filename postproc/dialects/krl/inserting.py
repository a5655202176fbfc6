"""Motions that are inserted before a line: pieces of its way, and straight links to where that begins."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from postproc.arrays import Bools, Floats, Ints, sums
from postproc.decimals import fixed, fixed_one
from postproc.dialects.dialect import Role
from postproc.dialects.krl.arcs import half_way
from postproc.dialects.krl.components import LETTER, Components, Task
from postproc.dialects.krl.lexing import BOM
from postproc.dialects.krl.own_points import aggregate, carried
from postproc.document import Edit, Edits, Span, gathered

BLOCK = 1 << 15
"""Motions that are written at a time."""

_DEEPEST = 80
"""Blanks of an indentation."""

_BLANKS = np.isin(np.arange(256), np.frombuffer(b" \t", np.uint8))
_CONDITIONS = re.compile(rb"\bWITH\b.*?(?=(?:[ \t,]C_(?:DIS|VEL|ORI|PTP|SPL))?[ \t]*\Z)", re.I | re.S)
_WORD = re.compile(rb"[A-Za-z_]+")


def insertions(task: Task, among: Ints) -> Iterator[Edits]:
    """The edits that insert motions of the plan before rows (K,) that follow each other."""
    first, behind = int(task.own[among[0]] - task.inserted[among[0]]), int(task.own[among[-1]])
    chosen = first + np.flatnonzero(task.plan.role[first:behind] != Role.OWN)
    source = task.documents[0]
    for at in range(0, len(chosen), BLOCK):
        block = chosen[at : at + BLOCK]
        rows = task.plan.source[block]
        said = task.components(rows)
        wanted = task.wanted(rows, said.own, task.plan.position[block], task.plan.rotation[block])
        kept = said.kept(wanted)
        line = np.searchsorted(source.line_starts, task.places.motion[rows, 0], side="right") - 1
        start = source.line_starts[line]
        if source.raw.startswith(BOM):
            start[line == 0] = len(BOM)
        many = _copied(task, block, rows, start)
        # Motions of one row stay in their order.
        many &= ~np.isin(rows, rows[~many])
        single = [
            Edit(Span(0, int(start[k]), int(start[k])), _line(task, int(block[k]), said, wanted, kept, k))
            for k in np.flatnonzero(~many).tolist()
        ]
        if many.any():
            yield _copies(task, rows[many], said.of(many), wanted[many], kept[many], start[many])
        yield Edits.joined(single)


def _line(task: Task, motion: int, said: Components, wanted: Floats, kept: Bools, k: int) -> bytes:
    """The line of a motion of the plan, in numbers, with the words of its source; a link goes straight and exact."""
    row, places = int(task.plan.source[motion]), task.places
    raw, newline = task.documents[0].raw, task.documents[0].newline
    at, start, stop, end = places.motion[row].tolist()
    found = _WORD.match(raw, at)
    word = found[0] if found else b"LIN"
    relative, arc, variable = places.relative.get(row), places.arcs.get(row), places.variables.get(row)
    texts = task.texts(said, wanted, kept, k)
    target = aggregate(texts, carried(raw[start:stop]) if variable is None else variable.words)
    if relative is not None:
        word = word[: -len(b"_REL")]
        stop = stop if relative.reference is None else relative.reference.stop
    if arc is not None and arc.angle is not None:
        stop = arc.angle.stop
    behind = raw[stop:end]
    if task.plan.role[motion] == Role.LINK:
        spline = word[:1] in b"Ss"
        behind = (_CONDITIONS.search(behind) or [b""])[0] if spline else b""
        behind = b" " + behind if behind else b""
        word = (word[:1] if spline else b"") + (b"lin" if word.islower() else b"LIN")
    elif arc is not None:
        via = half_way(task.plan, np.array([motion]))[0].tolist()
        target = aggregate([fixed_one(value, int(task.least[0])) for value in via], b"") + b"," + target
    indent = raw[raw.rfind(b"\n", 0, at) + 1 : at]
    return (indent if not indent.strip() else b"") + word + b" " + target + behind + newline


def _copied(task: Task, block: Ints, rows: Ints, begin: Ints) -> Bools:
    """(K,) pieces whose line is that of their source, with other numbers in its literals."""
    places, raw = task.places, task.raws[0]
    word, first, last, _ = places.motion[rows].T
    here = (
        (places.file[rows] == 0)
        & (places.start[rows] >= first[:, None])
        & (places.stop[rows] <= last[:, None])
    )
    many = here.all(axis=1) & task.is_inline[rows] & (task.plan.role[block] == Role.PIECE)
    many &= word - begin <= _DEEPEST
    for i in range(int((word - begin)[many].max(initial=0))):
        many &= (begin + i >= word) | _BLANKS[raw[np.minimum(begin + i, len(raw) - 1)]]
    return many


def _copies(task: Task, rows: Ints, said: Components, wanted: Floats, kept: Bools, begin: Ints) -> Edits:
    """The lines of pieces (K,): the bytes of their source between its literals, and the numbers.

    Each line is 14 parts: from its begin to the first literal, the first number, ..., to the end of the code, newline.
    """
    order = np.argsort(said.start, axis=1)
    start, stop = (
        np.take_along_axis(part, order, axis=1).astype(np.int64) for part in (said.start, said.stop)
    )
    end = task.places.motion[rows, 3]
    # What stays is taken from the text, what does not from ``texts``.
    new = ~np.take_along_axis(kept, order, axis=1)
    numbers, decimals = (
        np.take_along_axis(wanted, order, axis=1),
        np.take_along_axis(said.decimals, order, axis=1),
    )
    low = int(begin.min())
    texts, ends = fixed(numbers[new], decimals[new], LETTER[task.raws[0][start - 1]][new])
    newline = task.documents[0].newline
    source = np.concatenate(
        [task.raws[0][low : int(end.max())], np.frombuffer(texts, np.uint8), np.frombuffer(newline, np.uint8)]
    )
    size = len(source) - len(texts) - len(newline)
    parts = np.empty((len(rows), 14), np.int64)
    lengths = np.empty((len(rows), 14), np.int64)
    parts[:, 0], lengths[:, 0] = begin - low, start[:, 0] - begin
    parts[:, 1:12:2], lengths[:, 1:12:2] = start - low, stop - start
    parts[:, 2:13:2] = stop - low
    lengths[:, 2:11:2], lengths[:, 12] = start[:, 1:] - stop[:, :-1], end - stop[:, 5]
    parts[:, 13], lengths[:, 13] = len(source) - len(newline), len(newline)
    parts[:, 1:12:2][new] = size + ends[:-1]
    lengths[:, 1:12:2][new] = np.diff(ends)
    blob = gathered(source, parts.ravel(), lengths.ravel())
    at = begin.astype(task.places.motion.dtype)
    return Edits(np.zeros(len(rows), np.int8), at, at, blob, sums(lengths.sum(axis=1)))
