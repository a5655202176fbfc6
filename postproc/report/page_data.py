"""What the page of one program shows: arrays of its motions in the units of people, and its worst places."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import ROWS, in_spans, select_rows
from postproc.base.document import Document, Edit, Edits
from postproc.base.sanitize import sanitize
from postproc.base.units import MM
from postproc.compensation.correct import CorrectionResult, MotionOutcome
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision
from postproc.report.page_listing import ListedLine, lines_of_findings, lines_to_list
from postproc.report.page_rows import SHOWN, rows_to_draw, worst_rows
from postproc.report.report import Report

ARC_POINTS, EACH = 60_000, (3, 23)
"""Points that draw arcs, in all about so many; of each arc no fewer and no more."""

LINES = 5
"""Lines of the text after a motion at most; a motion that was divided has as many as it has parts."""


class Output(Protocol):
    """What was written: ``edits`` on the program, the motions of the output, and ``between`` (M,) [m] how far the tool
    is from the wanted path inside of each of them, NaN where that was not looked at."""

    @property
    def edits(self) -> Sequence[Edit]: ...
    @property
    def division(self) -> Subdivision: ...
    @property
    def path_error(self) -> Floats:
        """(M,) [m] the largest distance from the wanted path inside of each motion, NaN where it is not known."""
        ...


@dataclass(frozen=True)
class WorstPlace:
    """A motion with a large error.  row: of the columns; why: what makes it one; source, written: its text before and
    after, line by line; ``written`` is () where nothing was written."""

    row: int
    why: str
    source: str
    written: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class PageData:
    """K motions of the ``motions`` of one program: those that figures and table show, mm and N.

    report: figures, findings, model and digests.  tolerance: what the output may keep.  off: motions that the
    program itself excludes.  rows (K,): the motions shown, ascending.  line, kind, state, cut (K,): as in
    Toolpath and Result; cut -1 in air.  path_length (K,) [mm]: length of the cutting path to the end of each motion.
    position (K, 3): wanted end point; arcs (A,): which of the K are arcs from the one before, and arc_points (A, B, 3)
    points inside of them; force (K, 3) [N]; deflection (K, 3) before: all in the robot base. correction (K, 3): command
    minus wanted, in the axes of the programmed base. before, after (K,): predicted error at the end points; path_error
    (K,): the largest between the points after the correction. inserted (K,): motions of the output before this one.
    widths (K, 2): half widths of the 95 % intervals of before and after; evaluated: motions at which they were
    computed, between them they are interpolated. NaN wherever a figure is not known.
    """

    report: Report
    corrected: bool
    tolerance: float
    motions: int
    off: int
    rows: Ints
    line: Ints
    kind: Ints
    state: Ints
    cut: Ints
    path_length: Floats
    position: Floats
    arcs: Ints
    arc_points: Floats
    force: Floats
    force_word: str
    deflection: Floats
    correction: Floats
    before: Floats
    after: Floats
    path_error: Floats
    inserted: Ints
    widths: Floats
    evaluated: int
    places: tuple[WorstPlace, ...]
    listing: tuple[ListedLine, ...] = ()


def page_data(
    task: CompensationProblem,
    result: CorrectionResult,
    report: Report,
    documents: Sequence[Document],
    output: Output | None = None,
    limit: int = SHOWN,
) -> PageData:
    """All that the page of ``result`` shows, ``limit`` motions at most.  documents: of the program that was read;
    output: None where nothing is corrected (a prediction)."""
    path, n = task.toolpath, len(task.toolpath)
    state, cut, scope = result.state, result.cut, result.scope
    first = np.arange(n + 1)
    between = np.full(n, np.nan)
    if output is not None:
        first = np.searchsorted(output.division.source, first)
        between = np.fmax.reduceat(output.path_error, first[:-1])
    worst = worst_rows(result, scope, between, output is not None)
    before, after, between = (_known(values, scope) for values in (result.before, result.after, between))
    size = np.sqrt(np.einsum("ni,ni->n", result.correction, result.correction))
    turns = (cut[1:] != cut[:-1]) | (state[1:] != state[:-1])
    quantities = [(1, before), (-1, before), (1, after), (-1, after), (1, between), (1, size)]
    rows = rows_to_draw(n, [row for row, _ in worst], turns, quantities, limit)
    lines = [int(path.line[row]) for row, _ in worst]
    edits = () if output is None else output.edits
    texts = source_texts(documents[0], lines, edits)
    arcs, arc_points = _arc_points(task, rows)
    return PageData(
        report=report,
        corrected=output is not None,
        tolerance=task.tolerance / MM,
        motions=n,
        off=int(np.count_nonzero(state == MotionOutcome.OFF)),
        rows=rows,
        line=select_rows(path.line, rows),
        kind=select_rows(path.kind, rows),
        state=select_rows(state, rows),
        cut=select_rows(cut, rows),
        path_length=select_rows(np.cumsum(np.where(scope, task.desired_path.length, 0.0)), rows) / MM,
        position=_by_blocks(lambda some: task.wanted[some].position, rows) / MM,
        arcs=arcs,
        arc_points=arc_points,
        force=task.force.largest_along(rows)[:, :3],
        force_word=_force_word(task),
        deflection=select_rows(result.deflection, rows) / MM,
        correction=_by_blocks(lambda some: _correction(task, result, some), rows) / MM,
        before=select_rows(before, rows) / MM,
        after=select_rows(after, rows) / MM,
        path_error=select_rows(between, rows) / MM,
        inserted=first[rows + 1] - first[rows] - 1,
        widths=np.where(scope[rows, None], _widths(report, rows), np.nan),
        evaluated=len(report.uncertainty.expanded),
        listing=_listing(documents[0], [*lines, *lines_of_findings(report.findings, task.file)], edits),
        places=tuple(
            WorstPlace(int(np.searchsorted(rows, row)), why, source, () if output is None else written)
            for (row, why), (source, written) in zip(worst, texts, strict=True)
        ),
    )


def _by_blocks(compute: Callable[[Ints], Floats], rows: Ints, each: int = 1) -> Floats:
    """(K each, 3) what ``compute`` returns for ``rows`` (K,)."""
    parts = in_spans(lambda block: compute(rows[block]), rows, ROWS // each)
    return np.concatenate([np.empty((0, 3)), *parts])


def _force_word(task: CompensationProblem) -> str:
    """What the force of a motion is called: where it changes inside of motions it is their largest."""
    ramps = task.force.ramps
    return "force" if ramps is None or not ramps.inside.any() else "largest force within the motion"


def _correction(task: CompensationProblem, result: CorrectionResult, rows: Ints) -> Floats:
    command = task.base.shared(rows).inverse() @ result.command[rows]
    return command.position - task.toolpath.position[rows]


def _arc_points(task: CompensationProblem, rows: Ints) -> tuple[Ints, Floats]:
    """Which of ``rows`` (K,) are arcs of which the start is among them as well (A,), and (A, B, 3) [mm] points evenly
    inside of them; few of each where the program has many arcs."""
    arc = task.desired_path.traceable & task.desired_path.arc
    each = int(np.clip(ARC_POINTS // max(int(arc.sum()), 1), *EACH))
    places = np.flatnonzero(arc[rows[1:]] & (np.diff(rows) == 1)) + 1
    shares = np.arange(1, each + 1) / (each + 1)

    def points(arcs: Ints) -> Floats:
        return task.desired_path.at(np.repeat(arcs, each), np.tile(shares, len(arcs))).position / MM

    return places, _by_blocks(points, rows[places], each).reshape(len(places), each, 3)


def _listing(document: Document, spoken_of: Sequence[int], edits: Iterable[Edit]) -> tuple[ListedLine, ...]:
    total = len(document.line_starts) - document.raw.endswith(b"\n")
    numbers = lines_to_list(total, spoken_of)
    texts = source_texts(document, numbers, edits)
    before = [0, *numbers]
    return tuple(
        ListedLine(number, source, written, number != last + 1)
        for number, last, (source, written) in zip(numbers, before, texts, strict=False)
    )


def source_texts(
    document: Document, lines: Sequence[int], edits: Iterable[Edit]
) -> list[tuple[str, tuple[str, ...]]]:
    """The text of each of ``lines`` (from 1) before, and what the edits make of it; "" of a line that is not there."""
    every, raw = Edits.joined(edits), document.raw
    starts = np.append(document.line_starts, len(raw))
    numbers = np.asarray(lines, np.int64).reshape(-1)
    there = (numbers > 0) & (numbers < len(starts))
    numbers = np.where(there, numbers, 1)
    own = every.start[: np.searchsorted(every.file, 1)]
    bounds = (starts[numbers - 1], starts[numbers])
    low, high = (np.searchsorted(own, bound.astype(own.dtype)).tolist() for bound in bounds)
    texts: list[tuple[str, tuple[str, ...]]] = []
    for known, start, stop, first, last in zip(
        there.tolist(), *map(np.ndarray.tolist, bounds), low, high, strict=True
    ):
        if not known:
            texts.append(("", ()))
            continue
        parts, at = [], start
        for k in range(first, last):
            parts += [raw[at : int(every.start[k])], every.texts[int(every.ends[k]) : int(every.ends[k + 1])]]
            at = int(every.stop[k])
        source = raw[start:stop].rstrip(b"\r\n")
        after = b"".join([*parts, raw[at:stop]]).splitlines()
        more = [f"{len(after) - LINES} more lines, then"] if len(after) > LINES else []
        text = _text(source)
        written = [text if row == source else _text(row) for row in after[-LINES:]]
        texts.append((text, tuple(more + written)))
    return texts


def _text(raw: bytes) -> str:
    """Bytes of a program as letters: UTF-8, or else the code page of the controllers."""
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return sanitize(text.replace("\t", "    "))


def _known(values: Floats, scope: Bools) -> Floats:
    return np.where(scope & np.isfinite(values), values, np.nan)


def _widths(report: Report, rows: Ints) -> Floats:
    """(K, 2) [mm] half widths at ``rows`` (K,), between those that were evaluated interpolated."""
    widths, uncertainty = np.full((len(rows), 2), np.nan), report.uncertainty
    for width, evaluated in zip(widths.T, uncertainty.expanded.T, strict=True):
        known = np.isfinite(evaluated)
        if known.any():
            width[:] = np.interp(rows, uncertainty.rows[: len(known)][known], evaluated[known] / MM)
    return widths
