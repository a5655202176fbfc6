"""The motions of a TP program as rows, in the order of the text, and why some cannot be corrected."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.document import Document
from postproc.languages.tp.position_data import (
    CARTESIAN,
    EXTERNAL,
    JOINTS,
    PositionGroup,
    TpPosition,
    configuration_flags,
)
from postproc.languages.tp.statement_flow import StatementFlow
from postproc.languages.tp.tp_listing import TpListing
from postproc.languages.tp.tp_propagation import CONTRADICTORY, ELSEWHERE, START, TpPropagation, TpState
from postproc.languages.tp.tp_statements import PositionUse, StatementNotRead, TpMove, TpStatement
from postproc.toolpath import LOST, FrameRef, Kind

TURNS = 50
"""Turns of an axis from -50 to 49 are kept as numbers."""
FARTHEST = 1e7
"""[mm] of a target."""


@dataclass(slots=True)
class TpRows:
    """N rows: numbers (N, 6), vias (N, 6) [mm, deg] as the text has them, axes [deg], external (N, 6) [mm or deg].

    ``at``: statement of each; ``row_of``: statement -> row; ``problems``: row -> code and reason for which it cannot be
    corrected; ``points``: target and auxiliary point, None where the file does not have it; ``before``: rows after
    which each runs, START for the start of the program, ELSEWHERE for what it does not contain.
    """

    at: list[int] = field(default_factory=list)
    moves: list[TpMove | None] = field(default_factory=list)
    row_of: dict[int, int] = field(default_factory=dict)
    lines: list[int] = field(default_factory=list)
    columns: list[int] = field(default_factory=list)
    kinds: list[int] = field(default_factory=list)
    points: list[tuple[TpPosition | None, TpPosition | None]] = field(default_factory=list)
    numbers: Floats = field(default_factory=lambda: np.empty((0, 6)))
    vias: Floats = field(default_factory=lambda: np.empty((0, 6)))
    external: Floats = field(default_factory=lambda: np.empty((0, 6)))
    axes: dict[int, tuple[float, ...]] = field(default_factory=dict)
    feed: list[float] = field(default_factory=list)
    base: list[int] = field(default_factory=list)
    tool: list[int] = field(default_factory=list)
    nut: list[int] = field(default_factory=list)
    revolutions: list[int] = field(default_factory=list)
    before: list[tuple[int, ...]] = field(default_factory=list)
    states: list[TpState | None] = field(default_factory=list)
    problems: dict[int, tuple[str, str]] = field(default_factory=dict)
    frames: list[FrameRef] = field(default_factory=list)
    assumed: dict[int, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.at)

    def refuse(self, row: int, code: str, message: str) -> None:
        self.problems.setdefault(row, (code, message))

    def approximation(self, row: int) -> float:
        """[mm] NaN where it is not known."""
        move = self.moves[row]
        word, value = (b"", None) if move is None else move.corner
        return value if value is not None and word in (b"FINE", b"CR") else np.nan

    def stops(self, row: int) -> bool:
        move = self.moves[row]
        return move is not None and move.corner[0] == b"FINE"


class RowBuilder:
    """Puts the motions of a program together."""

    def __init__(
        self, document: Document, listing: TpListing, positions: dict[int, TpPosition], run: TpPropagation
    ) -> None:
        self.document, self.listing, self.positions, self.run = document, listing, positions, run
        self.flow: StatementFlow = run.flow
        self.rows = TpRows()
        self.assigned, self.every_point, self.frames_set = assigned_data(self.flow.statements)
        self._indices: dict[tuple[bool, int], int] = {}

    def build(self) -> TpRows:
        rows = self.rows
        for at, one in enumerate(self.flow.statements):
            if isinstance(one, TpMove) or (isinstance(one, StatementNotRead) and one.moves):
                self._add(at, one if isinstance(one, TpMove) else None)
        n = len(rows)
        rows.numbers, rows.vias = np.full((n, 6), np.nan), np.full((n, 6), np.nan)
        rows.external = np.full((n, 6), np.nan)
        for row in range(n):
            self._fill(row)
        self._lose_external()
        for row in range(n):
            state = rows.states[row]
            places = frozenset([ELSEWHERE]) if state is None else state.last
            own = {at if at in (START, ELSEWHERE) else rows.row_of[at] for at in places}
            rows.before.append(tuple(sorted(own)))
        return rows

    def _add(self, at: int, move: TpMove | None) -> None:
        rows, statement = self.rows, self.listing.statements[at]
        rows.row_of[at] = len(rows)
        rows.at.append(at)
        rows.moves.append(move)
        rows.lines.append(statement.line)
        rows.columns.append(
            len(statement.text) - len(statement.text.lstrip()) + statement.start - statement.line_start + 1
        )
        rows.states.append(self.run.before.get(at))

    def _fill(self, row: int) -> None:
        rows, move, state = self.rows, self.rows.moves[row], self.rows.states[row]
        kind, feed, base, tool, nut, turns = int(Kind.OTHER), np.nan, -1, -1, -1, -1
        points: tuple[TpPosition | None, TpPosition | None] = (None, None)
        if self.flow.problem is not None:
            rows.refuse(row, "FTP007", "the structure of the program is not understood")
        elif state is None:
            rows.refuse(row, "FTP009", "the flow that the program defines does not reach it")
        elif CONTRADICTORY in (state.force, state.switch):
            rows.refuse(
                row, "FTP006", "the FORCE or COMPENSATE comment in force differs with the path of the program"
            )
        elif state.displaced:
            names = ", ".join(sorted(name.decode("latin-1") for name in state.displaced))
            rows.refuse(row, "FTP008", f"its target may be displaced ({names})")
        if move is None:
            rows.refuse(row, "FTP001", "it is not understood")
        else:
            if move.problem is not None:
                rows.refuse(row, *move.problem)
            kind = int({b"J": Kind.PTP, b"L": Kind.LIN}.get(move.form, Kind.CIRC))
            if (
                state is not None
                and move.unit in (b"mm/sec", b"cm/min", b"inch/min")
                and state.override is not None
            ):
                speed = state.value(move.value)
                feed = np.nan if speed is None or not 0 < speed < 1e6 else speed * state.override
            group = self._target(row, move)
            if group is not None:
                base = self._frame(row, group, False, state)
                tool = self._frame(row, group, True, state)
                if group.is_joint and move.form == b"J":
                    kind = int(Kind.AXIS)
                nut, turns = self._configuration(row, group, kind)
            points = self._points(move)
            if move.form == b"C":
                self._via(row, move, group)
        for values, value in (
            (rows.kinds, kind),
            (rows.base, base),
            (rows.tool, tool),
            (rows.nut, nut),
            (rows.revolutions, turns),
        ):
            values.append(value)
        rows.feed.append(float(feed))
        rows.points.append(points)

    def _points(self, move: TpMove) -> tuple[TpPosition | None, TpPosition | None]:
        found = [self.positions.get(point.number) for point in move.points]
        return found[-1], found[0] if move.form == b"C" else None

    def _group(self, row: int, number: int) -> PositionGroup | None:
        """The first motion group of a point; refuses a row whose point is not known."""
        rows = self.rows
        position = self.positions.get(number)
        if number < 0:
            return None
        if position is None:
            rows.refuse(row, "FTP003", f"P[{number}] is not in /POS")
            return None
        if position.problem:
            rows.refuse(row, "FTP004", position.problem)
            return None
        if self.every_point or number in self.assigned:
            rows.refuse(row, "FTP002", f"P[{number}] is set by the program where it runs")
            return None
        if len(position.groups) > 1 or position.groups[0].number != 1:
            rows.refuse(row, "FTP011", f"P[{number}] is of other motion groups than the first one")
            return None
        return position.groups[0]

    def _target(self, row: int, move: TpMove) -> PositionGroup | None:
        rows, number = self.rows, move.points[-1].number
        group = self._group(row, number)
        if group is None:
            return None
        external = [group.values.get(name, np.nan) for name in EXTERNAL]
        rows.external[row] = [np.nan if value is None else value for value in external]
        if any(value is None for value in external):
            rows.refuse(row, "FTP004", f"an external axis of P[{number}] is not set")
        if group.is_joint:
            angles = group.numbers(JOINTS)
            if angles is None or b"J7" in group.values or max(map(abs, angles)) > 1e4 or b"X" in group.values:
                rows.refuse(row, "FTP004", f"P[{number}] does not state six axes")
                return None
            rows.axes[row] = angles
            if move.form != b"J":
                rows.refuse(row, "FTP014", f"P[{number}] states axes, and the motion is a path of the tool")
            return group
        numbers = group.numbers(CARTESIAN)
        if numbers is None or max(map(abs, numbers)) > FARTHEST:
            rows.refuse(row, "FTP004", f"P[{number}] does not state X, Y, Z, W, P, R")
            return None
        rows.numbers[row] = numbers
        return group

    def _via(self, row: int, move: TpMove, target: PositionGroup | None) -> None:
        rows, number = self.rows, move.points[0].number
        group = self._group(row, number)
        if group is None or target is None:
            return
        numbers = group.numbers(CARTESIAN)
        if numbers is None or max(map(abs, numbers)) > FARTHEST:
            rows.refuse(row, "FTP012", f"P[{number}], its auxiliary point, does not state X, Y, Z, W, P, R")
        elif group.frames != target.frames:
            rows.refuse(row, "FTP012", "its auxiliary point is in another frame than its target")
        else:
            rows.vias[row] = numbers

    def _frame(self, row: int, group: PositionGroup, is_tool: bool, state: TpState | None) -> int:
        """Index of the base or tool of a target: that of its point, which has to be the one in force."""
        rows = self.rows
        word, name = (b"UT", "UTOOL") if is_tool else (b"UF", "UFRAME")
        stated = group.frames.get(word)
        selected = None if state is None else (state.tool if is_tool else state.base)
        if stated is not None and selected is not None and stated != selected:
            message = f"{name}_NUM={selected} is in force, and its point is in {name} {stated}"
            rows.refuse(row, "FTP005", message)
            return -1
        number = selected if stated is None else stated
        if number is None:
            rows.refuse(
                row, "FTP005", f"its {name} is not known: neither its point nor the program states it"
            )
            return -1
        if (is_tool, number) in self.frames_set or (is_tool, -1) in self.frames_set:
            rows.refuse(row, "FTP020", f"{name}[{number}] is set by the program itself")
            return -1
        if selected is None and row not in rows.problems:
            rows.assumed.setdefault(row, name)
        key = (is_tool, number)
        if key not in self._indices:
            self._indices[key] = len(rows.frames)
            rows.frames.append(FrameRef(number, None, rows.lines[row]))
        return self._indices[key]

    def _configuration(self, row: int, group: PositionGroup, kind: int) -> tuple[int, int]:
        """Flags and turns of the configuration as numbers, -1 where they are not known."""
        rows = self.rows
        if group.is_joint:
            return -1, -1
        found = None if group.config is None else configuration_flags(group.config)
        if found is None or found[0] & 4:
            if kind == Kind.PTP:
                shown = "" if group.config is None else group.config.decode("latin-1")[:30]
                rows.refuse(row, "FTP004", f"its configuration {shown!r} is none that is read")
                rows.numbers[row] = np.nan
            return -1, -1
        packed = 0
        for turn in found[1]:
            if not -TURNS <= turn < TURNS:
                return found[0], -1
            packed = packed * 2 * TURNS + turn + TURNS
        return found[0], packed

    def _lose_external(self) -> None:
        """An external axis that some points state and others do not is not known at these."""
        external = self.rows.external
        stated = np.isfinite(external).any(axis=0)
        external[np.isnan(external) & stated] = LOST


def assigned_data(statements: list[TpStatement]) -> tuple[set[int], bool, set[tuple[bool, int]]]:
    """Points that the program assigns, whether it assigns one that is computed, and frames that it assigns: whether it
    is a tool, and its number, -1 for any."""
    points: set[int] = set()
    computed = False
    frames: set[tuple[bool, int]] = set()
    for one in statements:
        action = getattr(one, "action", one)
        if isinstance(action, PositionUse):
            points |= {number for number in action.assigned if number is not None}
            computed |= None in action.assigned
            if action.frame is not None:
                frames.add((action.is_tool, action.frame))
    return points, computed, frames


def read_points(statements: list[TpStatement]) -> tuple[set[int], bool]:
    """Points that other statements read, and whether one reads a point that is computed."""
    points: set[int] = set()
    computed = False
    for one in statements:
        action = getattr(one, "action", one)
        if isinstance(action, PositionUse):
            points |= {number for number in action.read if number is not None}
            computed |= None in action.read
        if isinstance(one, TpMove):
            computed |= any(point.number < 0 and "computed" in point.reason for point in one.points)
    return points, computed
