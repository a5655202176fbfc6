"""The motions of a module as rows, in the order in which they run first, and why some cannot be corrected."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Floats, Ints, shared, sums
from postproc.base.batches import blocks
from postproc.base.document import Document
from postproc.languages.core.comments_in_force import CONTRADICTED, VARYING
from postproc.languages.core.motion_sources import ELSEWHERE, Meeting, Source, distinguished, expanded
from postproc.languages.rapid.data_types import ABSENT
from postproc.languages.rapid.declared_data import walk
from postproc.languages.rapid.instructions import MOTIONS, OTHER_MOTIONS
from postproc.languages.rapid.module_frames import ModuleFrames
from postproc.languages.rapid.motion_facts import MotionFact, Problem, item_of, not_read, reason_of
from postproc.languages.rapid.program_state import ProgramState
from postproc.languages.rapid.propagation import OTHER, Propagation
from postproc.languages.rapid.quaternions import WORST
from postproc.languages.rapid.syntax_tree import Instruction, PlainMotions, RapidRoutine
from postproc.languages.rapid.target_places import (
    NUMBERS,
    MotionText,
    MotionTexts,
    PointText,
    point_text,
    target_numbers,
)
from postproc.languages.rapid.values import Value, numbers_of
from postproc.toolpath import COMPUTED, LOST, Kind, pack_quadrants
from postproc.toolpath.initial_state import Symbol

FARTHEST = 1e7
"""[mm]"""
_UNKNOWN, _LENGTH, _FAR, _VIA = (np.uint8(bit) for bit in (1, 2, 4, 8))


@dataclass(slots=True)
class ModuleRows:
    """N rows of M facts: numbers (N, 7) [mm, 1], axes [deg] of some, external (N, 6), vias (N, 3) [mm], as the text has
    them.

    first (M + 1,): row of the first motion of each fact; fact_of (N,).  starts (N,): offsets of the statements; lines
    (N,): their numbers.  base, tool (N,): indices of frames, -1 where not known; quadrants, cfx (N,): -1 likewise.
    never_from: the first row of those that never run.  strays: the robot may be elsewhere before each.  problems: row
    -> why it cannot be corrected.  ends: offset of the last motion of a fact -> its row.
    """

    facts: list[MotionFact]
    first: Ints
    fact_of: Ints
    starts: Ints
    lines: Ints
    numbers: Floats
    vias: Floats
    external: Floats
    base: Ints
    tool: Ints
    quadrants: Ints
    cfx: Ints
    texts: MotionTexts
    never_from: int
    strays: bool
    ends: dict[int, int] = field(default_factory=dict)
    problems: dict[int, Problem] = field(default_factory=dict)
    axes: dict[int, tuple[float, ...]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.fact_of)

    def fact(self, row: int) -> MotionFact:
        return self.facts[int(self.fact_of[row])]

    def each(self) -> Iterator[tuple[int, int, MotionFact]]:
        """The facts with their first row and the row after their last one."""
        bounds = self.first.tolist()
        return zip(bounds[:-1], bounds[1:], self.facts, strict=True)

    def per_row(self, values: list[Any], dtype: Any) -> NDArray[Any]:
        """(N,) of what each fact has."""
        return np.array(values, dtype)[self.fact_of]

    def refuse(self, row: int, code: str, message: str) -> None:
        self.problems.setdefault(row, (code, message))

    def refuse_all(self, rows: Iterable[int], problem: Problem) -> None:
        for row in rows:
            self.problems.setdefault(row, problem)

    def before(self, row: int) -> tuple[int, ...]:
        """Rows after which a row runs; -1 for the start of the program, -2 for what it does not contain, and alone
        where they are too many to be distinguished."""
        at = self.fact_of[row]
        if self.first[at] < row < self.never_from:
            return (ELSEWHERE, row - 1) if self.strays else (row - 1,)
        places = self.facts[at].before
        if not distinguished(places):
            return (ELSEWHERE,)
        return tuple(sorted({self._row(one) for one in expanded(places, set())}))

    def starts_of(self, row: int, visited: set[Meeting]) -> list[int]:
        """The rows among the sources of a row, with those after meetings that are not in ``visited``."""
        at = self.fact_of[row]
        if self.first[at] < row < self.never_from:
            return [row - 1]
        return self.rows_of(self.facts[at].before, visited)

    def rows_of(self, sources: Iterable[Source], visited: set[Meeting]) -> list[int]:
        """The rows among offsets of motions, with those after meetings that are not in ``visited``."""
        return sorted({row for one in expanded(sources, visited) if (row := self._row(one)) >= 0})

    def _row(self, source: int) -> int:
        """The row of the motion at an offset; one that is in no row ends elsewhere."""
        return self.ends.get(source, ELSEWHERE) if source >= 0 else source


def module_rows(
    document: Document, flow: Propagation, symbols: Mapping[str, Symbol]
) -> tuple[ModuleRows, ModuleFrames]:
    """The rows of a module, with the frames that they use."""
    frames = ModuleFrames(symbols, _declared_lines(document, flow), flow.usage.written)
    never = list(_never_run(flow))
    rows = _rows(document, list(flow.facts.values()), [fact for fact, _ in never], flow.usage.strays)
    bounds = rows.first.tolist()[len(flow.facts) :]
    for (_, problem), start, stop in zip(never, bounds[:-1], bounds[1:], strict=True):
        rows.refuse_all(range(start, stop), problem)
    odd = _odd_targets(rows)
    for start, stop, fact in rows.each():
        _place(rows, frames, range(start, stop), fact, odd)
    _external(rows)
    return rows, frames


def _rows(document: Document, run: list[MotionFact], never: list[MotionFact], strays: bool) -> ModuleRows:
    """The rows of facts, those that run and those that never do, without frames, configurations and external axes."""
    facts = [*run, *never]
    first = sums(np.array([fact.count for fact in facts], np.int64))
    n = int(first[-1])
    starts, numbers = np.empty(n, np.int64), np.full((n, NUMBERS), np.nan)
    arcs = any(fact.via is not None for fact in facts)
    vias = np.full((n, 3), np.nan) if arcs else np.broadcast_to(np.nan, (n, 3))
    ends: dict[int, int] = {}
    for at, fact in zip(first.tolist(), facts, strict=False):
        lines = fact.lines
        if lines is not None:
            rows = slice(at, at + len(lines))
            starts[rows] = lines.places.starts
            ends[lines.last] = rows.stop - 1
            if fact.arguments is not None:
                numbers[rows] = lines.values
            continue
        starts[at] = fact.statement.start
        ends[fact.statement.start] = at
        if fact.form.kind != Kind.AXIS:
            numbers[at] = target_numbers(fact.target)
        if fact.via is not None:
            vias[at] = target_numbers(fact.via)[:3]
    for part in (numbers[:, :3], numbers[:, 3:]):
        part[np.isnan(part).any(axis=1)] = np.nan
    fact_of = np.repeat(np.arange(len(facts), dtype=np.int32), np.diff(first))
    texts = [_text(document, fact) for fact in facts]
    places = [None if fact.lines is None else fact.lines.places for fact in facts]
    return ModuleRows(
        facts=facts,
        first=first,
        fact_of=fact_of,
        starts=starts,
        lines=np.searchsorted(document.line_starts, starts, side="right").astype(np.int32),
        numbers=numbers,
        vias=vias,
        external=np.broadcast_to(np.nan, (n, 6)),
        base=np.full(n, -1, np.int32),
        tool=np.full(n, -1, np.int32),
        quadrants=np.full(n, -1, np.int32),
        cfx=np.full(n, -1, np.int32),
        texts=MotionTexts(document.raw, texts, places, first, fact_of),
        never_from=int(first[len(run)]),
        strays=strays,
        ends=ends,
    )


def _declared_lines(document: Document, flow: Propagation) -> dict[bytes, int]:
    return {name: document.place(at)[0] for name, at in flow.data.lines.items()}


def _text(document: Document, fact: MotionFact) -> MotionText | None:
    """That of a fact; of a run that of its first motion."""
    if fact.arguments is None:
        return None
    raw, statement = document.raw, fact.statement
    line_start = statement.start - document.place(statement.start)[1] + 1
    given, options = fact.arguments, fact.arguments.options

    def shown(*names: bytes) -> bytes:
        return b"".join(
            raw[options[name].start : options[name].stop].strip() for name in names if name in options
        )

    speed = raw[given.speed.start : given.speed.stop] + shown(b"V")
    zone = raw[given.zone.start : given.zone.stop] + shown(b"Z")
    tool = raw[given.tool.start : given.tool.stop] + shown(b"WOBJ", b"TLOAD")
    points: list[PointText | None] = [None, None]
    if fact.form.kind != Kind.AXIS:
        points[0] = point_text(given.points[-1], fact.target, raw)
        if fact.via is not None:
            points[1] = point_text(given.points[0], fact.via, raw)
    alone = not raw[line_start : statement.start].removeprefix(b"\xef\xbb\xbf").strip()
    return MotionText(statement.start, statement.stop, speed, zone, tool, alone, *points)


def _never_run(flow: Propagation) -> Iterator[tuple[MotionFact, Problem]]:
    """Motions that the flow does not reach, in the order of the text."""
    state = ProgramState(last=frozenset([ELSEWHERE]))
    found = []
    for routine in flow.module.routines:
        for handlers, body in ((False, routine.body), (True, routine.handlers)):
            for one in walk(body):
                run = one if isinstance(one, PlainMotions) else None
                statement = one if run is None else run.first
                if (
                    isinstance(statement, Instruction)
                    and statement.start not in flow.facts
                    and (statement.name in MOTIONS or statement.name in OTHER_MOTIONS)
                ):
                    form = MOTIONS.get(statement.name, OTHER)
                    fact = replace(not_read(statement, form, state, "it is not run"), lines=run)
                    found.append((statement.start, fact, _why(flow, routine, handlers)))
    for _, fact, problem in sorted(found, key=lambda item: item[0]):
        yield fact, problem


def _why(flow: Propagation, routine: RapidRoutine, handlers: bool) -> Problem:
    name = routine.name.decode("latin-1")
    if flow.is_unclear(routine):
        return "RAP007", f"the structure of {name} is not understood"
    if handlers:
        return "RAP009", f"it is in an error handler of {name}"
    if routine.kind != b"PROC":
        word = "trap" if routine.kind == b"TRAP" else "function"
        return "RAP009", f"it is in the {word} {name}"
    return "RAP009", "the flow that the program's constants define does not reach it"


def _place(
    rows: ModuleRows, frames: ModuleFrames, these: range, fact: MotionFact, odd: NDArray[np.uint8]
) -> None:
    """Frames, axes and configuration of the rows of a fact; odd: see ``_odd_targets``."""
    first = these.start
    line = int(rows.lines[first])
    problem = fact.problem
    if problem is None and (fact.force is VARYING or fact.switch is VARYING):
        problem = "RAP006", CONTRADICTED
    if problem is not None:
        rows.refuse_all(these, problem)
    if fact.arguments is None:
        if fact.form.kind != Kind.OTHER or fact.problem is None:
            rows.refuse_all(these, ("RAP001", "it is not understood"))
        return
    found_tool, found_base = frames.tool(fact.tool, line), frames.base(fact.base, line)
    if fact.form.kind == Kind.AXIS:
        _place_axes(rows, first, fact)
    else:
        _check_targets(rows, these, fact, odd)
        for found in (found_tool, found_base):
            if not isinstance(found, int):
                rows.refuse_all(these, found)
        _place_configurations(rows, these, fact)
    if isinstance(found_tool, int):
        rows.tool[these.start : these.stop] = found_tool
    if isinstance(found_base, int):
        rows.base[these.start : these.stop] = found_base


def _place_axes(rows: ModuleRows, row: int, fact: MotionFact) -> None:
    angles = numbers_of(item_of(fact.target, 0), 6)
    if angles is None or max(map(abs, angles)) >= ABSENT:
        rows.refuse(row, *_lost(fact.target))
    else:
        rows.axes[row] = angles
        rows.quadrants[row] = pack_quadrants(tuple(float(angles[axis] // 90.0) for axis in (0, 3, 5)))


def _place_configurations(rows: ModuleRows, these: range, fact: MotionFact) -> None:
    def packed(conf: tuple[float, ...] | None) -> tuple[int, int]:
        if conf is None:
            return -1, -1
        return pack_quadrants(conf[:3]), int(conf[3]) if conf[3] in range(8) and fact.checked else -1

    part = slice(these.start, these.stop)
    if fact.lines is None:
        rows.quadrants[part], rows.cfx[part] = packed(numbers_of(item_of(fact.target, 2), 4))
    else:
        each = np.array([packed(tuple(conf)) for conf in fact.lines.extras[:, :4].tolist()], np.int32)
        rows.quadrants[part], rows.cfx[part] = each[fact.lines.which].T


def _odd_targets(rows: ModuleRows) -> NDArray[np.uint8]:
    """(N,) what is wrong with a target, as bits: not known, a quaternion of another length, far, an unknown via."""
    found = np.zeros(len(rows), np.uint8)
    for part in blocks(len(rows)):
        numbers = rows.numbers[part]
        unknown = np.isnan(numbers).any(axis=1)
        size = np.sqrt((numbers[:, 3:] ** 2).sum(axis=1))
        found[part] = unknown * _UNKNOWN | ~(unknown | (np.abs(size - 1.0) <= WORST)) * _LENGTH
        found[part] |= (np.abs(numbers[:, :3]).max(axis=1) >= FARTHEST) * _FAR
        found[part] |= np.isnan(rows.vias[part]).any(axis=1) * _VIA
    return found


def _check_targets(rows: ModuleRows, these: range, fact: MotionFact, odd: NDArray[np.uint8]) -> None:
    found = odd[these.start : these.stop]
    for row in these if len(these) == 1 else (these.start + np.flatnonzero(found & ~_VIA)).tolist():
        wrong = int(odd[row])
        if wrong & _UNKNOWN:
            rows.refuse(row, *_lost(fact.target))
        elif wrong & _LENGTH:
            rows.refuse(row, "RAP004", "the quaternion of its target is not of length 1")
        if wrong & _FAR:
            rows.refuse(row, "RAP002", "its target is farther away than 10 km")
    if fact.via is not None and odd[these.start] & _VIA:
        message = f"its auxiliary point is not known: {reason_of(fact.via, 'it is computed')}"
        rows.refuse(these.start, "RAP012", message)


def _lost(value: Value) -> Problem:
    reason = reason_of(value, "its target is no list of positions")
    return ("RAP003" if "is not declared" in reason else "RAP002"), reason


def _external(rows: ModuleRows) -> None:
    """External axes: NaN where the text has 9E9 throughout, LOST where it had another value before."""
    unknown: list[range] = []
    known: list[tuple[slice, Floats, Ints]] = []
    for row, stop, fact in rows.each():
        numbers = numbers_of(item_of(fact.target, 1 if fact.form.kind == Kind.AXIS else 3), 6)
        if fact.lines is not None and fact.arguments is not None:
            known.append((slice(row, stop), fact.lines.extras[:, 4:], fact.lines.which))
        elif numbers is None:
            unknown.append(range(row, stop))
        else:
            known.append((slice(row, stop), np.array([numbers]), np.zeros(1, np.int32)))
    rows.refuse_all(chain.from_iterable(unknown), ("RAP019", "its external axes are not known"))
    stated = np.zeros(6, np.bool_)
    for _, each, _ in known:
        stated |= (np.abs(each) < ABSENT).any(axis=0)
    if not stated.any():
        return
    values = np.full((len(rows), 6), np.nan)
    for part in unknown:
        values[part.start : part.stop, stated] = COMPUTED
    for place, each, which in known:
        there = np.where(np.abs(each) < ABSENT, each, np.where(stated, LOST, np.nan))
        values[place] = there[which]
    rows.external = shared(values)
