"""What the page of one program shows: arrays of its motions in the units of people, and its worst places."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.compensation.correct import Result, State
from postproc.compensation.division import Division
from postproc.compensation.task import Task
from postproc.document import Document, Edit, Edits, Span, apply
from postproc.report.report import Report
from postproc.report.terminal import printable
from postproc.robot.description import COVERAGE
from postproc.units import MM

PLACES = 12
"""Worst places that the page tells, with their text."""

SHOWN = 50_000
"""Motions that the figures of a page show at most."""

BENDS, EACH = 60_000, (3, 23)
"""Points that draw arcs, in all about so many; of each arc no fewer and no more."""

LINES = 5
"""Lines of the text behind a motion at most; a motion that was divided has as many as it has parts."""


class Output(Protocol):
    """What was written: ``edits`` on the program, the motions of the output, and ``between`` (M,) [m] how far the tool
    is from the wanted way inside of each of them, NaN where that was not looked at."""

    @property
    def edits(self) -> Sequence[Edit]: ...
    @property
    def division(self) -> Division: ...
    @property
    def between(self) -> Floats: ...


@dataclass(frozen=True)
class Place:
    """A motion worth a look.  row: of the arrays; why: what makes it one; source, written: its text before and after,
    line by line; ``written`` is () where nothing was written."""

    row: int
    why: str
    source: str
    written: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class PageData:
    """N motions of one program, mm and N.

    report: figures, findings, model and digests.  tolerance: what the output may keep.  line, kind, state, cut (N,): as
    in Toolpath and Result; cut -1 in air.  way (N,) [mm]: length of the cutting path to the end of each motion.
    position (N, 3): wanted end point; arcs (K,): rows of arcs, and bends (K, B, 3) points on their way; force (N, 3)
    [N]; deflection (N, 3) before: all in the robot base.  correction (N, 3): command minus wanted, in the axes of the
    programmed base.  before, after (N,): predicted error at the end points; between (N,): the largest on the way there
    after the correction.  inserted (N,): motions of the output before this one.
    interval (N,): half width of the 95 % interval of a coordinate of the predicted place, in the direction in which it
    is largest; evaluated: motions at which it was computed, between them it is interpolated.  NaN wherever a figure is
    not known.
    """

    report: Report
    corrected: bool
    tolerance: float
    line: Ints
    kind: Ints
    state: Ints
    cut: Ints
    way: Floats
    position: Floats
    arcs: Ints
    bends: Floats
    force: Floats
    deflection: Floats
    correction: Floats
    before: Floats
    after: Floats
    between: Floats
    inserted: Ints
    interval: Floats
    evaluated: int
    places: tuple[Place, ...]

    def __len__(self) -> int:
        return len(self.line)

    @property
    def cutting(self) -> Ints:
        """Rows that carry a force, or are corrected for what else the model knows."""
        return np.flatnonzero(self.state != State.AIR)


def page_data(
    task: Task, result: Result, report: Report, documents: Sequence[Document], output: Output | None = None
) -> PageData:
    """All that the page of ``result`` shows.  documents: of the program that was read; output: None where nothing is
    corrected (a prediction)."""
    path, wanted, n = task.toolpath, task.wanted.position, len(task.toolpath)
    scope = result.state != State.AIR
    shift = (task.base.inverse() @ result.command[:]).position - path.position
    between, inserted = np.full(n, np.nan), np.zeros(n, np.int64)
    if output is not None:
        source = output.division.source
        np.fmax.at(between, source, output.between)
        inserted = np.bincount(source, minlength=n) - 1
    found = _worst(result, scope, between, output is not None)
    lines = [int(path.line[row]) for row, _ in found]
    texts = source_texts(documents[0], lines, () if output is None else output.edits)
    return PageData(
        report=report,
        corrected=output is not None,
        tolerance=task.tolerance / MM,
        line=path.line,
        kind=path.kind,
        state=result.state,
        cut=result.cut,
        way=np.cumsum(np.where(scope, task.ways.length, 0.0)) / MM,
        position=wanted / MM,
        arcs=(arcs := np.flatnonzero(task.ways.known & task.ways.arc)),
        bends=_bends(task, arcs),
        force=task.wrench[:, :3],
        deflection=result.deflection / MM,
        correction=shift / MM,
        before=_known(result.before, scope) / MM,
        after=_known(result.after, scope) / MM,
        between=_known(between, scope) / MM,
        inserted=inserted,
        interval=_interval(report, n, scope),
        evaluated=len(report.doubt.deviation),
        places=tuple(
            Place(row, why, source, () if output is None else written)
            for (row, why), (source, written) in zip(found, texts, strict=True)
        ),
    )


def _bends(task: Task, arcs: Ints) -> Floats:
    """(K, B, 3) [mm] points evenly inside of the wanted arcs; few of each where there are many arcs."""
    each = int(np.clip(BENDS // max(len(arcs), 1), *EACH))
    share = np.tile(np.arange(1, each + 1) / (each + 1), len(arcs))
    points = task.ways.at(np.repeat(arcs, each), share).position / MM
    return np.asarray(points.reshape(len(arcs), each, 3))


def shown_rows(data: PageData, limit: int = SHOWN) -> Ints:
    """Rows that figures show: all, or at most ``limit`` of many.

    Half of them lie evenly along the program, for its shape.  Of each of many stretches of the program those with the
    largest and smallest error before and after, the largest on the way and the largest correction are shown, so that
    no extreme is lost; the worst places are, and the begin and end of cuts as long as there is room.
    """
    n = len(data)
    if n <= limit:
        return np.arange(n)
    must = [np.array([0, n - 1, *(place.row for place in data.places)])]
    turn = np.flatnonzero((data.cut[1:] != data.cut[:-1]) | (data.state[1:] != data.state[:-1]))
    if 2 * len(turn) <= limit // 4:
        must.append(np.concatenate([turn, turn + 1]))
    kept = np.unique(np.concatenate(must))
    size = np.linalg.norm(data.correction, axis=1)
    quantities = (data.before, -data.before, data.after, -data.after, data.between, size)
    room = limit - len(kept)
    stretches = room // 2 // len(quantities)
    of = np.arange(n) * stretches // n
    last = np.append(np.flatnonzero(np.diff(of)), n - 1)
    chosen = [kept, np.linspace(0, n - 1, room // 2).astype(np.int64)]
    for values in quantities:
        order = np.lexsort((np.nan_to_num(values, nan=-np.inf), of))
        chosen.append(order[last])
    return np.unique(np.concatenate(chosen))


def source_texts(
    document: Document, lines: Sequence[int], edits: Iterable[Edit]
) -> list[tuple[str, tuple[str, ...]]]:
    """The text of each of ``lines`` (from 1) before, and what the edits make of it; "" of a line that is not there."""
    every = Edits.joined(edits)
    there = [0 < line <= len(document.line_starts) for line in lines]
    starts = np.unique(
        [document.line_starts[line - 1] for line, is_ in zip(lines, there, strict=True) if is_]
    )
    stops = {int(start): document.raw.find(b"\n", start) + 1 or len(document.raw) for start in starts}
    own: dict[int, list[Edit]] = {start: [] for start in stops}
    if len(starts):
        at = starts[np.maximum(np.searchsorted(starts, every.start, side="right") - 1, 0)]
        end = np.array(list(stops.values()))[np.searchsorted(starts, at)]
        for k in np.flatnonzero((every.file == 0) & (every.start >= at) & (every.start < end)):
            edit, start = every[int(k)], int(at[k])
            own[start].append(Edit(Span(0, edit.span.start - start, edit.span.stop - start), edit.text))
    told: list[tuple[str, tuple[str, ...]]] = []
    for line, is_ in zip(lines, there, strict=True):
        if not is_:
            told.append(("", ()))
            continue
        start = document.line_starts[line - 1]
        piece = Document(document.path, document.raw[start : stops[start]])
        after = apply(piece, own[start]).splitlines()
        more = [f"and {len(after) - LINES} more lines"] if len(after) > LINES else []
        told.append((_text(piece.raw.rstrip(b"\r\n")), tuple([_text(row) for row in after[-LINES:]] + more)))
    return told


def _text(raw: bytes) -> str:
    """Bytes of a program as letters: UTF-8, or else the code page of the controllers."""
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return printable(text.replace("\t", "    "))


def _worst(result: Result, scope: Bools, between: Floats, corrected: bool) -> list[tuple[int, str]]:
    """Rows of the largest errors with why: before, after, on the way; then the largest of each cut, and the next."""
    before = np.where(scope & np.isfinite(result.before), result.before, -1.0)
    order = np.argsort(-before, kind="stable")
    order = order[before[order] >= 0]
    if not len(order):
        return []
    found = {int(order[0]): "largest before"}
    after = (("largest after", result.after), ("largest on the way after", between))
    for why, values in after if corrected else ():
        error = np.where(scope & np.isfinite(values), values, -1.0)
        if error.max() > 0:
            row = int(np.argmax(error))
            found[row] = f"{found[row]}, {why}" if row in found else why
    _, first = np.unique(result.cut[order], return_index=True)
    for row in order[np.sort(first)]:
        found.setdefault(int(row), f"largest of cut {result.cut[row] + 1}" if result.cut[row] >= 0 else "")
    for row in order[: 2 * PLACES]:
        found.setdefault(int(row), "")
    return list(found.items())[:PLACES]


def _known(values: Floats, scope: Bools) -> Floats:
    return np.where(scope & np.isfinite(values), values, np.nan)


def _interval(report: Report, n: int, scope: Bools) -> Floats:
    """(N,) [mm] half width at every cutting motion, between those that were evaluated interpolated."""
    doubt = report.doubt
    known = np.isfinite(doubt.deviation)
    if not known.any():
        return np.full(n, np.nan)
    rows = doubt.rows[: len(doubt.deviation)][known]
    width = np.interp(np.arange(n), rows, COVERAGE * doubt.deviation[known] / MM)
    return np.where(scope, width, np.nan)
