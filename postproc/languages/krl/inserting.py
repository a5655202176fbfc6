"""Motions that are inserted before a line: segments of its path, and straight transition moves to where that starts."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Iterator

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, sums
from postproc.base.decimals import fixed, fixed_one
from postproc.base.document import Document, Edit, Edits, Span, gathered
from postproc.languages.dialect import Role
from postproc.languages.krl.arcs import half_way
from postproc.languages.krl.lexing import statement, value_end
from postproc.languages.krl.rewritten_lines import aggregate, carried
from postproc.languages.krl.target import EXTERNAL
from postproc.languages.krl.write_plan import LETTER, Components, KrlWritePlan, written_decimals

BLOCK = 1 << 15
"""Motions that are written at a time."""

_APPROXIMATION_OF = {b"S": b" C_SPL", b"P": b" C_PTP"}
APPROXIMATION = b" C_DIS"
"""With which an inserted motion flows where its source ends exactly; by the first letter of the word, else
``APPROXIMATION``."""

_DEEPEST = 80
"""Blanks of an indentation."""

_BLANKS = np.isin(np.arange(256), np.frombuffer(b" \t", np.uint8))
_WITH = re.compile(rb"\bWITH\b", re.I)
_LAST = re.compile(rb"[ \t,]C_(?:DIS|VEL|ORI|PTP|SPL)\Z", re.I)
_APPROXIMATION = re.compile(rb"(?<![A-Za-z0-9_$])C_(?:DIS|VEL|ORI|PTP|SPL)(?![A-Za-z0-9_$])", re.I)
_WORD = re.compile(rb"[A-Za-z_]+")


def insertions(task: KrlWritePlan, among: Ints) -> Iterator[Edits]:
    """The edits that insert motions of the plan before rows (K,) that follow each other."""
    first, after = int(task.own[among[0]] - task.inserted[among[0]]), int(task.own[among[-1]])
    chosen = first + np.flatnonzero(task.plan.role[first:after] != Role.ORIGINAL)
    source = task.documents[0]
    for at in range(0, len(chosen), BLOCK):
        block = chosen[at : at + BLOCK]
        rows = task.plan.source[block]
        said = task.components(rows)
        wanted = task.wanted(rows, said.own, task.plan.position[block], task.plan.rotation[block])
        kept = said.unchanged(wanted)
        line = np.searchsorted(source.line_starts, task.places.motion[rows, 0], side="right") - 1
        if task.path.constraints.spline_headers:
            line = task.path.inserted_before[rows] - 1
        start = source.line_starts[line]
        if source.raw.startswith(BOM_UTF8):
            start[line == 0] = len(BOM_UTF8)
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


def _line(
    task: KrlWritePlan, motion: int, components: Components, wanted: Floats, unchanged: Bools, k: int
) -> bytes:
    """The line of a motion of the plan, in numbers, with the words of its source; a transition move goes straight.

    A motion that ``flows`` is approximated as its source is, with C_DIS (in splines C_SPL) where that is not; another
    transition move ends exactly.
    """
    row, places = int(task.plan.source[motion]), task.places
    raw, newline = task.documents[0].raw, task.documents[0].newline
    at, start, stop, end = places.motion[row].tolist()
    found = _WORD.match(raw, at)
    word = found[0] if found else b"LIN"
    relative, arc, variable = places.relative.get(row), places.arcs.get(row), places.variables.get(row)
    texts = task.texts(components, wanted, unchanged, k)
    words = carried(raw[start:stop]) if variable is None else variable.words
    if b"E" in words.upper() and (relative is not None or task.plan.external is not None):
        words = _intermediate_points(
            words, *_external(task, motion, row), relative is not None, int(task.least[0])
        )
    target = aggregate(texts, words)
    if relative is not None:
        word = word[: -len(b"_REL")]
        stop = stop if relative.reference is None else relative.reference.stop
    if arc is not None and arc.angle is not None:
        stop = arc.angle.stop
    after = raw[stop:end]
    if task.plan.role[motion] == Role.TRANSITION:
        word, after = _transition_words(task, row, word, after, bool(task.plan.flows[motion]))
    elif arc is not None:
        via = half_way(task.plan, np.array([motion]))[0].tolist()
        target = aggregate([fixed_one(value, int(task.least[0])) for value in via], b"") + b"," + target
    if task.plan.flows[motion] and _APPROXIMATION.search(after) is None:
        after += _APPROXIMATION_OF.get(word[:1].upper(), APPROXIMATION)
    indent = raw[raw.rfind(b"\n", 0, at) + 1 : at]
    if row in task.path.constraints.spline_headers:
        above = task.documents[0].line(task.path.constraints.spline_headers[row])
        indent = above[: len(above) - len(above.lstrip(b" \t"))]
    return (indent if not indent.strip() else b"") + word + b" " + target + after + newline


def _transition_words(
    task: KrlWritePlan, row: int, word: bytes, after: bytes, flows: bool
) -> tuple[bytes, bytes]:
    """The word of a transition move, and what is after its target: the conditions of its source, and the approximation
    of that where it ``flows``.  Before a spline block it is a LIN, or where the block has conditions an SLIN with
    them."""
    source, entered = task.documents[0], task.path.constraints.spline_headers.get(row)
    own = _with_clause(after) if word[:1] in b"Ss" else b""
    if entered is not None:
        own = _joined(_conditions(source, entered), own)
    spline = bool(own) if entered is not None else word[:1] in b"Ss"
    approximations = _APPROXIMATION.findall(after) if flows and entered is None else []
    name = b"slin" if word.islower() else b"SLIN"
    return name[0 if spline else 1 :], b"".join(b" " + part for part in (own, *approximations) if part)


def _conditions(source: Document, line: int) -> bytes:
    """The WITH of the header of a spline block."""
    text = source.line(line)
    header = statement(text, line, 0, len(text))
    return b"" if header is None else _with_clause(header.code)


def _with_clause(code: bytes) -> bytes:
    """From WITH to the end, without an approximation after it; b"" where there is none."""
    match = _WITH.search(code)
    if match is None:
        return b""
    clause = code[match.start() :].rstrip(b" \t")
    last = _LAST.search(clause, max(len(clause) - 6, 0))
    return clause if last is None else clause[: last.start()]


def _joined(outer: bytes, inner: bytes) -> bytes:
    """One WITH of two, of which the inner one goes before where both set the same."""
    said = [_assignments(clause[len(b"WITH") :]) for clause in (outer, inner)]
    names = {text.partition(b"=")[0].strip().upper() for text in said[1]}
    kept = [text for text in said[0] if text.partition(b"=")[0].strip().upper() not in names]
    return b"WITH " + b", ".join(kept + said[1]) if kept or said[1] else b""


def _assignments(clause: bytes) -> list[bytes]:
    """What a WITH sets, one by one."""
    found, place = [], 0
    while place < len(clause):
        end = value_end(clause, place)
        found.append(clause[place:end].strip())
        place = end + 1
    return [text for text in found if text]


def _external(task: KrlWritePlan, motion: int, row: int) -> tuple[Floats, Floats]:
    """(6,) where E1..E6 are at the end of a motion of the plan, and at the end of its source."""
    end = task.path.external[row]
    external = task.plan.external
    return (end if external is None else external[np.array([motion])][0]), end


def _intermediate_points(words: bytes, now: Floats, end: Floats, relative: bool, least: int) -> bytes:
    """S, T and E1..E6 of a motion, as one that is inserted before it says them: with E at ``now`` (6,) instead of
    ``end`` (6,), in the decimals of the text or ``least``.  ``relative``: the words of the text are steps.  What is not
    known is left out: the axis then moves with the last part."""
    said = []
    for word in words.split(b","):
        key, _, text = word.strip().partition(b" ")
        if key.upper() not in EXTERNAL:
            said.append(word)
            continue
        axis = key[1] - ord("1")
        if relative or now[axis] != end[axis]:
            if not np.isfinite(now[axis]):
                continue
            text = fixed_one(float(now[axis]), max(written_decimals(text.strip()), least))
        said.append(key + b" " + text)
    return b",".join(said)


def _copied(task: KrlWritePlan, block: Ints, rows: Ints, start: Ints) -> Bools:
    """(K,) segments whose line is that of their source, with other numbers in its literals."""
    places, raw = task.places, task.raws[0]
    word, first, last, end = places.motion[rows].T
    here = (
        (places.file[rows] == 0)
        & (places.start[rows] >= first[:, None])
        & (places.stop[rows] <= last[:, None])
    )
    many: Bools = here.all(axis=1) & task.is_inline[rows] & (task.plan.role[block] == Role.INTERMEDIATE)
    # what ends exactly gets a word of its own: that of a LIN, after nothing else
    many &= (task.path.approximation[rows] != 0) | ((last == end) & (raw[word] & 0xDF == ord("L")))
    many &= word - start <= _DEEPEST
    if task.plan.external is not None:
        now, end = task.plan.external[block], task.path.external[rows]
        many &= ((now == end) | (np.isnan(now) & np.isnan(end))).all(axis=1)
    for i in range(int((word - start)[many].max(initial=0))):
        many &= (start + i >= word) | _BLANKS[raw[np.minimum(start + i, len(raw) - 1)]]
    return many


def _copies(
    task: KrlWritePlan, rows: Ints, components: Components, wanted: Floats, unchanged: Bools, line_start: Ints
) -> Edits:
    """The lines of segments (K,): the bytes of their source between its literals, and the numbers.

    Each line is 15 parts: from its start to the first literal, the first number, ..., to the end of the code, an
    approximation where that has none, newline.
    """
    order = np.argsort(components.start, axis=1)
    start, stop = (
        np.take_along_axis(part, order, axis=1).astype(np.int64)
        for part in (components.start, components.stop)
    )
    end = task.places.motion[rows, 3]
    # What stays is taken from the text, what does not from ``texts``.
    new = ~np.take_along_axis(unchanged, order, axis=1)
    numbers, decimals = (
        np.take_along_axis(wanted, order, axis=1),
        np.take_along_axis(components.decimals, order, axis=1),
    )
    low = int(line_start.min())
    texts, ends = fixed(numbers[new], decimals[new], LETTER[task.raws[0][start - 1]][new])
    newline = task.documents[0].newline
    source = np.concatenate(
        [
            task.raws[0][low : int(end.max())],
            *(np.frombuffer(b, np.uint8) for b in (texts, APPROXIMATION, newline)),
        ]
    )
    size = len(source) - len(texts) - len(APPROXIMATION) - len(newline)
    parts = np.empty((len(rows), 15), np.int64)
    lengths = np.empty((len(rows), 15), np.int64)
    parts[:, 0], lengths[:, 0] = line_start - low, start[:, 0] - line_start
    parts[:, 1:12:2], lengths[:, 1:12:2] = start - low, stop - start
    parts[:, 2:13:2] = stop - low
    lengths[:, 2:11:2], lengths[:, 12] = start[:, 1:] - stop[:, :-1], end - stop[:, 5]
    parts[:, 13] = size + len(texts)
    lengths[:, 13] = np.where(task.path.approximation[rows] == 0, len(APPROXIMATION), 0)
    parts[:, 14], lengths[:, 14] = len(source) - len(newline), len(newline)
    parts[:, 1:12:2][new] = size + ends[:-1]
    lengths[:, 1:12:2][new] = np.diff(ends)
    blob = gathered(source, parts.ravel(), lengths.ravel())
    at = line_start.astype(task.places.motion.dtype)
    return Edits(np.zeros(len(rows), np.int8), at, at, blob, sums(lengths.sum(axis=1)))
