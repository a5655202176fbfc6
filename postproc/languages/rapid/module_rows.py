"""The motions of a module as rows, in the order in which they run first, and why some cannot be corrected."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.document import Document
from postproc.languages.rapid.data_types import ABSENT
from postproc.languages.rapid.declared_data import walk
from postproc.languages.rapid.instructions import MOTIONS, OTHER_MOTIONS
from postproc.languages.rapid.module_frames import ModuleFrames
from postproc.languages.rapid.motion_facts import MotionFact, Problem, item_of, not_read, reason_of
from postproc.languages.rapid.program_state import ELSEWHERE, START, VARYING, ProgramState
from postproc.languages.rapid.propagation import OTHER, Propagation
from postproc.languages.rapid.syntax_tree import Instruction, RapidRoutine
from postproc.languages.rapid.target_places import (
    MotionText,
    PointText,
    point_text,
    target_numbers,
)
from postproc.languages.rapid.values import Value, numbers_of
from postproc.toolpath import COMPUTED, LOST, Kind
from postproc.toolpath.initial_state import Symbol

QUADRANTS = 50
"""Quadrants from -50 to 49 are kept as numbers."""


@dataclass(slots=True)
class ModuleRows:
    """N rows: numbers (N, 7) [mm, 1], axes (N, 6) [deg], external (N, 6), vias (N, 3) [mm], as the text has them.

    offsets: of the motions -> row; problems: row -> why it cannot be corrected.
    """

    facts: list[MotionFact] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    columns: list[int] = field(default_factory=list)
    offsets: dict[int, int] = field(default_factory=dict)
    problems: dict[int, Problem] = field(default_factory=dict)
    base: list[int] = field(default_factory=list)
    tool: list[int] = field(default_factory=list)
    texts: list[MotionText | None] = field(default_factory=list)
    numbers: Floats = field(default_factory=lambda: np.empty((0, 7)))
    vias: Floats = field(default_factory=lambda: np.empty((0, 3)))
    axes: dict[int, tuple[float, ...]] = field(default_factory=dict)
    external: Floats = field(default_factory=lambda: np.empty((0, 6)))
    quadrants: list[int] = field(default_factory=list)
    cfx: list[int] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.facts)

    def refuse(self, row: int, code: str, message: str) -> None:
        self.problems.setdefault(row, (code, message))

    def before(self, row: int) -> tuple[int, ...]:
        """Rows after which a row runs; -1 for the start of the program, -2 for what it does not contain."""
        places = self.facts[row].before
        return tuple(sorted({at if at in (START, ELSEWHERE) else self.offsets[at] for at in places}))


def module_rows(
    document: Document, flow: Propagation, symbols: Mapping[str, Symbol]
) -> tuple[ModuleRows, ModuleFrames]:
    """The rows of a module, with the frames that they use."""
    rows, frames = ModuleRows(), ModuleFrames(symbols, _declared_lines(document, flow))
    for fact in flow.facts.values():
        _add(rows, document, fact)
    for fact, problem in _never_run(flow):
        rows.refuse(len(rows), *problem)
        _add(rows, document, fact)
    n = len(rows)
    numbers = [
        target_numbers(fact.target) if fact.form.kind != Kind.AXIS else [math.nan] * 7 for fact in rows.facts
    ]
    rows.numbers = np.array(numbers).reshape(n, 7)
    for part in (rows.numbers[:, :3], rows.numbers[:, 3:]):
        part[np.isnan(part).any(axis=1)] = np.nan
    rows.vias = np.full((n, 3), np.nan)
    for row, fact in enumerate(rows.facts):
        if fact.via is not None:
            rows.vias[row] = target_numbers(fact.via)[:3]
    for row, fact in enumerate(rows.facts):
        _place(rows, frames, row, fact)
    _external(rows)
    return rows, frames


def _declared_lines(document: Document, flow: Propagation) -> dict[bytes, int]:
    return {name: document.place(at)[0] for name, at in flow.data.lines.items()}


def _add(rows: ModuleRows, document: Document, fact: MotionFact) -> None:
    start = fact.statement.start
    line, column = document.place(start)
    rows.offsets[start] = len(rows)
    rows.facts.append(fact)
    rows.lines.append(line)
    rows.columns.append(column)
    rows.texts.append(_text(document.raw, fact, start - column + 1))


def _text(raw: bytes, fact: MotionFact, line_start: int) -> MotionText | None:
    if fact.arguments is None:
        return None
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
    alone = not raw[line_start : fact.statement.start].removeprefix(b"\xef\xbb\xbf").strip()
    statement = fact.statement
    return MotionText(statement.start, statement.stop, speed, zone, tool, alone, *points)


def _never_run(flow: Propagation) -> Iterator[tuple[MotionFact, Problem]]:
    """Motions that the flow does not reach, in the order of the text."""
    state = ProgramState(last=frozenset([ELSEWHERE]))
    found = []
    for routine in flow.module.routines:
        for handlers, body in ((False, routine.body), (True, routine.handlers)):
            for one in walk(body):
                if (
                    isinstance(one, Instruction)
                    and one.start not in flow.facts
                    and (one.name in MOTIONS or one.name in OTHER_MOTIONS)
                ):
                    form = MOTIONS.get(one.name, OTHER)
                    fact = not_read(one, form, state, "it is not run")
                    found.append((one.start, fact, _why(flow, routine, handlers)))
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


def _place(rows: ModuleRows, frames: ModuleFrames, row: int, fact: MotionFact) -> None:
    """Frames, axes and configuration of a row."""
    line = rows.lines[row]
    tool, base = -1, -1
    quadrants, cfx = -1, -1
    if row not in rows.problems:
        problem = fact.problem
        if problem is None and (fact.force is VARYING or fact.switch is VARYING):
            problem = (
                "RAP006",
                "the FORCE or COMPENSATE comment in force differs with the path of the program",
            )
        if problem is not None:
            rows.refuse(row, *problem)
    if fact.arguments is not None:
        found_tool, found_base = frames.tool(fact.tool, line), frames.base(fact.base, line)
        if fact.form.kind == Kind.AXIS:
            angles = numbers_of(item_of(fact.target, 0), 6)
            if angles is None or max(map(abs, angles)) >= ABSENT:
                rows.refuse(row, *_lost(fact.target))
            else:
                rows.axes[row] = angles
                quadrants = _packed(tuple(float(angles[axis] // 90.0) for axis in (0, 3, 5)))
        else:
            _check_target(rows, row, fact)
            for found in (found_tool, found_base):
                if not isinstance(found, int):
                    rows.refuse(row, *found)
            conf = numbers_of(item_of(fact.target, 2), 4)
            if conf is not None:
                quadrants = _packed(conf[:3])
                cfx = int(conf[3]) if conf[3] in range(8) and fact.checked else -1
        tool = found_tool if isinstance(found_tool, int) else -1
        base = found_base if isinstance(found_base, int) else -1
    elif fact.form.kind != Kind.OTHER or fact.problem is None:
        rows.refuse(row, "RAP001", "it is not understood")
    rows.tool.append(tool)
    rows.base.append(base)
    rows.quadrants.append(quadrants)
    rows.cfx.append(cfx)


def _check_target(rows: ModuleRows, row: int, fact: MotionFact) -> None:
    numbers = rows.numbers[row]
    if np.isnan(numbers).any():
        rows.refuse(row, *_lost(fact.target))
    elif abs(math.dist((0, 0, 0, 0), numbers[3:]) - 1.0) > 0.01:
        rows.refuse(row, "RAP004", "the quaternion of its target is not of length 1")
    elif np.abs(numbers[:3]).max() >= 1e7:
        rows.refuse(row, "RAP002", "its target is farther away than 10 km")
    if fact.via is not None and np.isnan(rows.vias[row]).any():
        rows.refuse(
            row, "RAP012", f"its auxiliary point is not known: {reason_of(fact.via, 'it is computed')}"
        )


def _lost(value: Value) -> Problem:
    reason = reason_of(value, "its target is no list of positions")
    return ("RAP003" if "is not declared" in reason else "RAP002"), reason


def _packed(quadrants: tuple[float, ...]) -> int:
    """cf1, cf4, cf6 as one number that is the same for the same three; -1 where one is no quadrant."""
    packed = 0
    for number in quadrants:
        if number != int(number) or not -QUADRANTS <= number < QUADRANTS:
            return -1
        packed = packed * 2 * QUADRANTS + int(number) + QUADRANTS
    return packed


def _external(rows: ModuleRows) -> None:
    """External axes: NaN where the text has 9E9 throughout, LOST where it had another value before."""
    n = len(rows)
    values = np.full((n, 6), np.nan)
    unknown = np.zeros(n, np.bool_)
    for row, fact in enumerate(rows.facts):
        part = item_of(fact.target, 1 if fact.form.kind == Kind.AXIS else 3)
        numbers = numbers_of(part, 6)
        if numbers is None:
            unknown[row] = True
        else:
            values[row] = numbers
    absent = np.abs(values) >= ABSENT
    stated = (np.isfinite(values) & ~absent).any(axis=0)
    values[absent] = np.nan
    values[absent & stated] = LOST
    values[unknown[:, None] & stated] = COMPUTED
    for row in np.flatnonzero(unknown).tolist():
        rows.refuse(row, "RAP019", "its external axes are not known")
    rows.external = values
