"""The motions of a TP program as rows, in the order of the text, and why some cannot be corrected."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.document import Document
from postproc.languages.core.comments_in_force import CONTRADICTED, VARYING
from postproc.languages.core.frame_table import FrameTable
from postproc.languages.core.motion_sources import ELSEWHERE, START, Meeting, Source, distinguished, expanded
from postproc.languages.core.waits import Waits
from postproc.languages.tp.position_data import (
    CARTESIAN,
    EXTERNAL,
    JOINTS,
    PositionGroup,
    TpPositions,
    configuration_flags,
)
from postproc.languages.tp.statement_flow import StatementFlow
from postproc.languages.tp.tp_listing import NumberedStatement, TpListing
from postproc.languages.tp.tp_propagation import (
    TpPropagation,
    TpState,
)
from postproc.languages.tp.tp_statements import PositionUse, StatementNotRead, TpMove, TpStatement
from postproc.toolpath import LOST, FrameRef, Kind

_CR = 1e6
"""Numbers of registers that have a distance are this far from those of registers that have a number of CNT."""

TURNS = 50
"""Turns of an axis from -50 to 49 are kept as numbers."""
FARTHEST = 1e7
"""[mm] of a target."""


class TpRows:
    """N rows: numbers (N, 6), vias (N, 6) [mm, deg] as the text has them, axes [deg], external (N, 6) [mm or deg].

    ``at`` (N,): statement of each; ``row_of`` (S,): row of each statement, -1 without; ``starts`` (N,): offsets of
    their texts; ``targets``, ``middles`` (N,): numbers of their points, -1 without; ``states``: what holds before each,
    None where it is not run; ``problems``: row -> code and reason for which it cannot be corrected; ``jumps``: row ->
    rows after which it runs, where that is not the row before it alone: START for the start of the program, ELSEWHERE
    for what it does not contain, and alone where they are too many to be distinguished (``paths``: these, as
    statements); ``waits``: rows before which the program waits -> whether it surely does.
    """

    def __init__(self, at: list[int], moves: list[TpMove | None], run: TpPropagation) -> None:
        n = len(at)
        self.at, self.moves = np.array(at, np.int64), moves
        self.row_of = np.full(len(run.before), -1, np.int32)
        self.row_of[self.at] = np.arange(n)
        self.states: list[TpState | None] = [run.before[one] for one in at]
        self.starts = np.empty(n, np.int64)
        self.lines, self.columns = np.empty(n, np.int32), np.empty(n, np.int32)
        self.kinds, self.feed = np.full(n, Kind.OTHER, np.int8), np.full(n, np.nan)
        self.numbers, self.vias = np.full((n, 6), np.nan), np.full((n, 6), np.nan)
        self.external = np.full((n, 6), np.nan)
        self.targets, self.middles = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
        self.base, self.tool = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
        self.nut, self.revolutions = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
        self.paths: dict[int, frozenset[Source]] = {}
        self.jumps = self._jumps(run)
        self.waits = {int(self.row_of[one]): waits == Waits.YES for one, waits in run.waits.items()}
        self.axes: dict[int, tuple[float, ...]] = {}
        self.problems: dict[int, tuple[str, str]] = {}
        self.frames = FrameTable()
        self.assumed: dict[int, str] = {}

    def _jumps(self, run: TpPropagation) -> dict[int, tuple[int, ...]]:
        found: dict[int, tuple[int, ...]] = {}
        for row, (at, state) in enumerate(zip(self.at.tolist(), self.states, strict=True)):
            last = run.jumps.get(at)
            if state is None:
                found[row] = (ELSEWHERE,)
            elif last is not None and not distinguished(last):
                self.paths[row], found[row] = last, (ELSEWHERE,)
            elif last is not None:
                own = {self._row(one) for one in expanded(last, set())}
                if own != {row - 1}:
                    found[row] = tuple(sorted(own))
        return found

    def _row(self, statement: int) -> int:
        return statement if statement in (START, ELSEWHERE) else int(self.row_of[statement])

    def __len__(self) -> int:
        return len(self.at)

    def before(self, row: int) -> tuple[int, ...]:
        """Rows after which a row runs, as ``jumps`` has them."""
        return self.jumps.get(row, (row - 1,))

    def starts_of(self, row: int, visited: set[Meeting]) -> list[int]:
        """The rows after which a row runs, with those after meetings that are not in ``visited``."""
        if row in self.paths:
            return self.rows_of(self.paths[row], visited)
        return [one for one in self.before(row) if one >= 0]

    def rows_of(self, statements: Iterable[Source], visited: set[Meeting]) -> list[int]:
        """The rows among statements of motions, likewise."""
        found = (self._row(one) for one in expanded(statements, visited))
        return sorted({row for row in found if row >= 0})

    def continues(self) -> Bools:
        """(N,) each motion surely starts where the row before it ends, and no other motion starts there."""
        n = len(self)
        plain = np.ones(n, np.bool_)
        plain[list(self.jumps)] = False
        follow = np.zeros(n + 1, np.int64)  # motions that start where a row ends; the last one: at the start
        follow[np.arange(-1, n - 1)[plain]] += 1
        for places in self.jumps.values():
            follow[[one for one in places if one != ELSEWHERE]] += 1
        visited: set[Meeting] = set()
        for row, sources in self.paths.items():
            follow[self.starts_of(row, visited)] += 1
            follow[-1] += START in sources or any(START in one.sources for one in visited)
        return np.asarray(plain & (follow[np.arange(-1, n - 1)] == 1))

    def refuse(self, row: int, code: str, message: str) -> None:
        self.problems.setdefault(row, (code, message))

    def approximations(self, continues: Bools) -> tuple[Floats, Bools]:
        """(N,) [mm] by which each motion may leave its path before the target, NaN where not known; (N,) where the
        robot stops: where the program waits before the next motion too.  continues (N,): as above."""
        corners = [(b"", None) if move is None else move.corner for move in self.moves]
        known = (b"FINE", b"CR")
        blend = np.array([np.nan if value is None or word not in known else value for word, value in corners])
        stops = np.array([word == b"FINE" for word, _ in corners], np.bool_)
        cut_short = self._cut_short()
        blend[cut_short] = np.where(stops[cut_short], blend[cut_short], np.nan)
        visited: set[Meeting] = set()
        for row, surely in self.waits.items():
            before = [one for one in self.starts_of(row, visited) if not stops[one]]
            ends = surely and bool(continues[row])
            blend[before], stops[before] = (0.0 if ends else np.nan), ends
        return blend, stops

    def waiting(self) -> Bools:
        """(N,) motions after which the program waits, or may."""
        found, visited = np.zeros(len(self), np.bool_), set[Meeting]()
        for row in self.waits:
            found[list(self.starts_of(row, visited))] = True
        return found

    def _cut_short(self) -> list[int]:
        """Rows at whose end the corner may be smaller than stated, as a motion starts or ends in a line."""
        found: set[int] = set()
        for row, move in enumerate(self.moves):
            if move is not None and b"RT" in move.linear:
                found.add(row)
            if move is not None and b"AP" in move.linear:
                found.update(self.starts_of(row, set()))
        return sorted(found)

    def approximation_numbers(self) -> Floats:
        """(N,) numbers of CNT; below zero those of the registers that have the number of CNT, or of CR, for which the
        distance is not known; NaN for FINE, for CR with its distance and where no number says how large the corner
        is."""
        numbers = np.full(len(self), np.nan)
        for row, move in enumerate(self.moves):
            if move is None or move.corner[0] == b"FINE":
                continue
            word, value = move.corner
            if value is None:
                digits = re.search(rb"R\[\s*(\d+)", move.termination)
                numbers[row] = -1.0 - (float(digits[1]) if digits else 0.0) - (_CR if word == b"CR" else 0.0)
            elif word == b"CNT":
                numbers[row] = value
        numbers[self._cut_short()] = np.nan
        return numbers


class RowBuilder:
    """Puts the motions of a program together."""

    def __init__(
        self, document: Document, listing: TpListing, positions: TpPositions, run: TpPropagation
    ) -> None:
        self.document, self.listing, self.positions = document, listing, positions
        self.flow: StatementFlow = run.flow
        self.rows = _rows(run)
        self.assigned, self.every_point, self.frames_set = assigned_data(self.flow.statements)

    def build(self) -> TpRows:
        for row, at in enumerate(self.rows.at.tolist()):
            self._fill(row, self.listing.statements[at])
        self._lose_external()
        return self.rows

    def _fill(self, row: int, statement: NumberedStatement) -> None:
        rows, move, state = self.rows, self.rows.moves[row], self.rows.states[row]
        text = statement.text
        rows.starts[row], rows.lines[row] = statement.start, statement.line
        rows.columns[row] = len(text) - len(text.lstrip()) + statement.start - statement.line_start + 1
        if self.flow.problem is not None:
            rows.refuse(row, "FTP007", "the structure of the program is not understood")
        elif state is None:
            rows.refuse(row, "FTP009", "the flow that the program defines does not reach it")
        elif VARYING in (state.force, state.switch):
            rows.refuse(row, "FTP006", CONTRADICTED)
        elif state.displaced:
            names = ", ".join(sorted(name.decode("latin-1") for name in state.displaced))
            rows.refuse(row, "FTP008", f"its target may be displaced ({names})")
        if move is None:
            rows.refuse(row, "FTP001", "it is not understood")
        else:
            if move.problem is not None:
                rows.refuse(row, *move.problem)
            numbers = [int(text[slice(*one.span)]) if one.span[0] >= 0 else -1 for one in move.points]
            rows.targets[row] = numbers[-1]
            rows.middles[row] = numbers[0] if move.form == b"C" else -1
            kind = {b"J": Kind.PTP, b"L": Kind.LIN}.get(move.form, Kind.CIRC)
            rows.feed[row] = _feed(move, state)
            group = self._target(row, move, numbers[-1])
            if group is not None:
                rows.base[row] = self._frame(row, group, False, state)
                rows.tool[row] = self._frame(row, group, True, state)
                if group.is_joint and move.form == b"J":
                    kind = Kind.AXIS
                rows.nut[row], rows.revolutions[row] = self._configuration(row, group, kind)
            if move.form == b"C":
                self._via(row, numbers[0], group)
            rows.kinds[row] = kind

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

    def _target(self, row: int, move: TpMove, number: int) -> PositionGroup | None:
        rows = self.rows
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

    def _via(self, row: int, number: int, target: PositionGroup | None) -> None:
        rows = self.rows
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
        return rows.frames.index((is_tool, number), lambda: FrameRef(number, None, int(rows.lines[row])))

    def _configuration(self, row: int, group: PositionGroup, kind: int) -> tuple[int, int]:
        """Flags and turns of the configuration as numbers, -1 where they are not known."""
        rows = self.rows
        if group.is_joint:
            return -1, -1
        found = None if group.config is None else configuration_flags(group.config)
        if found is None or found[0] & 4:
            if kind == Kind.PTP:
                shown = "" if group.config is None else group.config.decode("latin-1")[:30]
                why = "none that is read" if found is None else "with B, for which no joints are computed"
                rows.refuse(row, "FTP004", f"its configuration {shown!r} is {why}")
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
        if stated.any():
            external[np.isnan(external) & stated] = LOST
        else:
            self.rows.external = np.broadcast_to(np.nan, external.shape)


def _feed(move: TpMove, state: TpState | None) -> float:
    """[mm/s] of the TCP; NaN where it is not known, or follows from a time or from axes."""
    if state is None or state.override is None or state.slowed or move.paced:
        return np.nan
    speed = state.value(move.value) if move.unit in (b"mm/sec", b"cm/min", b"inch/min") else None
    return np.nan if speed is None or not 0 < speed < 1e6 else speed * state.override


def _rows(run: TpPropagation) -> TpRows:
    """The motions of a program, of which only the order is known."""
    at: list[int] = []
    moves: list[TpMove | None] = []
    for place, one in enumerate(run.flow.statements):
        if isinstance(one, TpMove) or (isinstance(one, StatementNotRead) and one.moves):
            at.append(place)
            moves.append(one if isinstance(one, TpMove) else None)
    return TpRows(at, moves, run)


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
            computed |= any("computed" in point.reason for point in one.points)
    return points, computed
