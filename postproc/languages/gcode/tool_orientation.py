"""The tool's orientation from the words of the blocks.

Rotary axes A, B, C turn the tool against the part: R(A, B, C) = Rz(C) Ry(B) Rx(A) in the base's axes, and the tool
is at R turned, with ``turned`` its orientation at A = B = C = 0; an axis that no block names stays at 0. That
holds where X, Y, Z are the tool's tip (TCP modes); else the place of the tip and the orientation of the part are the
machine's own, and only blocks with all rotary axes at 0 say where the tool is, unless the cell states that they turn
the part (``cell_options.TURN_PART``): then the tool is turned nowhere. Controls of robots take A, B, C as angles of
the tool's frame itself (``Control.whole``). A vector, or angles A2= B2= C2=, say where the tool points in
the programmed coordinates; they hold until another block states an orientation.

Between two blocks rotary axes run linearly, as they do under G43.4, under ORIAXES and in the kinematics of LinuxCNC;
what says a direction runs on a great circle (ORIVECT, ORIPLANE); angles of the tool's frame turn evenly about one axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import DEG
from postproc.languages.gcode.blocks import BlockWords
from postproc.languages.gcode.control import Group, ToolAxis
from postproc.languages.gcode.modal_fill import everywhere
from postproc.languages.gcode.orientation_words import Angles, OrientationWords, Vector, swing
from postproc.languages.gcode.positions import Positions, Trace
from postproc.languages.gcode.tool_tilts import ToolTilts, directing
from postproc.languages.gcode.words import key
from postproc.toolpath import OrientationPath

WHOLE = 1e-9
"""[rad] a rotary axis this near to 0 is at 0."""

ROTARY, VECTOR, EULER, RPY = range(4)
_NOWHERE, _UNREAD = -1, -2
"""Nothing states an orientation; what states it is not read."""
_ROTARY_KEYS = (key("A"), key("B"), key("C"))
_SEQUENCES = {EULER: ((2, 0), (0, 1), (2, 2)), RPY: ((2, 2), (1, 1), (0, 0))}


@dataclass(frozen=True, eq=False)
class ToolOrientation:
    """rotation (N, 3, 3); writable (N,): the words can be written; redundant_axis (N, 3): redundant axis; wrong (N,):
    0, or 1 rotary axes away from 0 or not known without a TCP mode, 2 not known in one, 3 the tool is along a plane
    that is no longer in force, 4 it is where a direction that is no longer in force has left it.
    orient (N,) row in ``ToolOrientations.orientations``, -1 where none is in force;
    values, before (N, 3): as in Places.  stated (N,): the block itself states the whole orientation in force.
    path (N,) OrientationPath.  in_machine (N,): the words are in the axes of the machine (ORIMKS)."""

    rotation: Floats
    writable: Bools
    redundant_axis: Floats
    wrong: Ints
    orient: Ints
    values: Floats
    before: Floats
    stated: Bools
    path: Ints
    in_machine: Bools

    @staticmethod
    def unsaid(count: int, turned: Floats | None) -> ToolOrientation:
        """Of ``count`` motions, at the rotation ``turned`` (3, 3) or at none known, whose text states nothing of the
        orientation."""
        nothing = everywhere(np.full(3, np.nan), count)
        no = everywhere(False, count)
        return ToolOrientation(
            everywhere(np.full((3, 3), np.nan) if turned is None else turned, count),
            no,
            nothing,
            everywhere(0, count, np.int8),
            everywhere(-1, count, np.int16),
            nothing,
            nothing,
            no,
            everywhere(OrientationPath.SINGLE_AXIS, count, np.int8),
            no,
        )

    @property
    def rotary(self) -> tuple[Floats, Floats]:
        """(N, 3) [rad] the words of rotary axes just before the block and at its end; NaN where they do not turn the
        tool."""
        by_axes = (self.path == OrientationPath.ROTARY_AXES)[:, None]
        if not by_axes.any():
            nothing = everywhere(np.full(3, np.nan), len(by_axes))
            return nothing, nothing
        before, values = (np.where(by_axes, words * DEG, np.nan) for words in (self.before, self.values))
        return before, values


class ToolOrientations:
    """The orientation of the motions of a program, which come block by block."""

    def __init__(self, words: BlockWords, turned: Floats | None, turn_part: bool = False) -> None:
        """given: the whole program; turned (3, 3): the tool in the base at A = B = C = 0; None where none is stated;
        turn_part: without a TCP mode rotary axes turn the part."""
        self._given, self._turned, self.turn_part = words, turned, turn_part
        self._tcp = words.modal.force[Group.TCP] == 1
        self._used = np.array([len(words.words(one)) > 0 for one in _ROTARY_KEYS])
        others = (*words.control.vector, *words.control.euler)
        self._none = not self._used.any() and not any(len(words.words(one)) for one in others)
        self._none &= not words.noted("spin").any() and not directing(words).any()
        if not self._none:
            self._kind, self._stating = _kinds(words, self._tcp, bool(self._used.any()))
            self._tilts = ToolTilts.of(words, np.array(_ROTARY_KEYS)[self._used])
        self.orientations: list[OrientationWords] = []
        self._number: dict[tuple[int, int], int] = {}

    @property
    def turning_part(self) -> Bools:
        """(3,) words A, B, C with which the program turns the part where no TCP mode is in force."""
        return self._used & self.turn_part

    def of(self, trace: Trace, where: Positions, rows: Ints, first: int, rapid: Bools) -> ToolOrientation:
        """Of motions in blocks ``rows`` (N,) of ``where``, which starts at block ``first``; rapid (N,): air."""
        used = self._used
        result = ToolOrientation.unsaid(len(rows), self._turned)
        tool = np.array([frame.tool for frame in where.frames])[where.frame[rows]]
        if self._none and not tool.any():
            return result
        result = ToolOrientation(**{name: np.array(column) for name, column in result.__dict__.items()})
        blocks = rows + first
        if not self._none:
            turning = np.zeros(3, np.bool_) if self.turn_part else used
            _machine(where, rows, rapid, turning, self._tcp[blocks], self._kind[blocks], result)
        if tool.any():
            self._along_planes(trace, where, rows, blocks, tool, result)
        if not self._none and (left := ~self._tcp[blocks] & self._tilts.left(trace, blocks)).any():
            result.wrong[left], result.rotation[left] = 4, np.nan
        if self._none:
            return result
        kind = self._kind[blocks]
        inside = self._tcp[blocks] & (kind >= 0)
        given = self._given.part(first, first + len(where.frame))
        moved = np.array([frame.shift[3:].any() for frame in where.frames])
        pairs = np.stack([kind, np.where(kind == ROTARY, 0, where.frame[rows])], axis=1)
        for one, frame in np.unique(pairs[inside], axis=0).tolist():
            here = np.flatnonzero(inside & (pairs == (one, frame)).all(axis=1))
            number = self._orientation(one, frame, where)
            orientation = self.orientations[number]
            result.orient[here] = number
            shifted = moved[where.frame[rows[here]]]
            ends = where.end[rows[here], 3:]
            values = self._values(trace, one, blocks[here], ends, orientation)
            result.values[here] = values
            ahead = here[(blocks[here] > 0) & ((one == ROTARY) | (self._kind[blocks[here] - 1] == one))]
            starts = where.start[rows[ahead], 3:]
            result.before[ahead] = self._values(trace, one, blocks[ahead], starts, orientation, 1)
            present = np.stack(
                [given.has(address)[rows[here]] for address in orientation.words if address >= 0], axis=1
            )
            result.stated[here] = present.any(axis=1) if orientation.joint else present.all(axis=1)
            columns = np.array(orientation.words) >= 0
            known = np.isfinite(values[:, columns]).all(axis=1)
            if one == VECTOR:
                known &= values.any(axis=1)
            if one != ROTARY:
                in_machine = self._by_machine(blocks[here])
                known &= ~(in_machine & self._in_turned_frame(trace, blocks[here]))
                result.in_machine[here] = in_machine
            result.wrong[here[~known]] = 2
            good = here[known]
            result.rotation[here] = np.nan
            result.rotation[good] = orientation.rotation(values[known])
            # A pair of axes can be written at its pole as well: the outer one stays near its place (rotary.pointing).
            pair = one == ROTARY and int(self._used.sum()) == 2 and self._turned is not None
            result.writable[good] = (pair | orientation.writable(values[known])) & ~shifted[known]
            result.path[good] = self._path(one)
            result.redundant_axis[good] = orientation.redundant_axis
        return result

    def _along_planes(
        self, trace: Trace, where: Positions, rows: Ints, blocks: Ints, tool: Ints, result: ToolOrientation
    ) -> None:
        """Motions in frames whose z axis the tool is along, tool (N,) ToolAxis, until a rotary axis moves; and after
        them, where no words of rotary axes say where it is."""
        tcp = self._tcp[blocks]
        moved = np.sort(np.concatenate([self._given.words(one).block for one in _ROTARY_KEYS]))
        since = trace.started(where.frame[rows])
        turned_since = np.searchsorted(moved, blocks, side="right") > np.searchsorted(
            moved, since, side="left"
        )
        normal = (tool == ToolAxis.NORMAL) & ~tcp
        result.wrong[normal] = np.where(turned_since[normal], 1, 0)
        away = ~tcp & (tool == ToolAxis.UNKNOWN) & ~self._used.any()
        result.wrong[away] = 3
        unsaid = tcp & (tool != ToolAxis.STATED) & self._none
        result.wrong[unsaid] = 2
        result.rotation[away | unsaid | (normal & turned_since)] = np.nan
        for frame in np.unique(where.frame[rows[normal & ~turned_since]]).tolist():
            here = normal & ~turned_since & (where.frame[rows] == frame)
            if self._turned is not None:
                direction = swing(where.frames[frame].turn[None, :, 2])
                result.rotation[here] = direction @ self._turned

    def _by_machine(self, blocks: Ints) -> Bools:
        """(n,) ``blocks`` (n,) whose tool vector is in coordinates of the machine, or may be."""
        machine = self._given.modal.force[Group.ORIENTED]
        return np.asarray((machine[self._stating[blocks]] != 0) | (machine[blocks] != 0))

    def _in_turned_frame(self, trace: Trace, blocks: Ints) -> Bools:
        """(n,) ``blocks`` (n,) whose tool vector is stated, or used, where a frame of the program turns the part."""
        turned = np.array([not np.array_equal(frame.turn, np.eye(3)) for frame in trace.frames])
        return np.asarray(turned[trace.frame_of(self._stating[blocks])] | turned[trace.frame_of(blocks)])

    def _path(self, kind: int) -> OrientationPath:
        """How the orientation runs between two blocks that state it by words of a kind."""
        if kind != ROTARY:
            return OrientationPath.GREAT_CIRCLE
        whole = bool(self._used.all()) and self._given.control.whole
        return OrientationPath.SINGLE_AXIS if whole else OrientationPath.ROTARY_AXES

    def _orientation(self, kind: int, frame: int, where: Positions) -> int:
        """Row in ``orientations`` of the meaning that the words of a kind have in a frame."""
        if (kind, frame) not in self._number:
            self._number[kind, frame] = len(self.orientations)
            turn = where.frames[frame].turn
            self.orientations.append(_orientation(self._given, kind, turn, self._turned, self._used))
        return self._number[kind, frame]

    def _values(
        self,
        trace: Trace,
        kind: int,
        blocks: Ints,
        axes: Floats,
        orientation: OrientationWords,
        earlier: int = 0,
    ) -> Floats:
        """(n, 3) numbers in force at the end of ``blocks`` (n,), or ``earlier`` ones; ``axes`` (n, 3) [rad] there."""
        if kind == ROTARY:
            return np.where(self._used, axes / DEG, np.nan)
        given = self._given
        keys = given.control.vector if kind == VECTOR else given.control.euler
        at = self._stating[blocks - earlier]
        values = np.stack([given.words(one).last(at, absent=0.0) for one in keys], axis=1)
        # Stated in other coordinates: where it points stays.
        stated, now = trace.frame_of(at), trace.frame_of(blocks)
        for number in np.unique(stated).tolist():
            other = np.flatnonzero((stated == number) & (now != number))
            if len(other):
                turned = _orientation(given, kind, trace.frames[number].turn, self._turned, self._used)
                values[other] = orientation.values(turned.rotation(values[other]), values[other])
        return np.asarray(values)


def _kinds(words: BlockWords, tcp: Bools, rotary: bool) -> tuple[Ints, Ints]:
    """(B,) what states the orientation in force, _NOWHERE where nothing known does; the block that states it."""
    n = len(words)
    control = words.control
    stated = np.full(n, _NOWHERE, np.int8)
    marks = np.zeros(n, np.bool_)
    euler = words.modal.force[Group.EULER]
    for keys, kind in (
        (control.euler, np.where(euler == 1, RPY, EULER)),
        (control.vector, np.full(n, VECTOR)),
    ):
        if keys:
            has = words.has(*keys)
            stated[has], marks[has] = kind[has], True
            stated[has & (euler < 0) & (kind != VECTOR)] = _UNREAD
    if rotary:
        has = words.has(*_ROTARY_KEYS)
        stated[has], marks[has] = ROTARY, True
    uncertain = words.modal.flow.reason != 0
    lost = (marks & uncertain) | words.modal.flow.forget
    changed = np.concatenate([[False], tcp[1:] != tcp[:-1]]) if n else marks
    # A vector does not outlast its mode; positions of rotary axes do.
    stated[lost] = _NOWHERE
    fresh = marks | lost | changed
    at = np.maximum.accumulate(np.where(fresh, np.arange(n, dtype=np.int32), np.int32(0)))
    kind = stated[at]
    kind = np.where((kind == _NOWHERE) & rotary, np.int8(ROTARY), kind)
    # the turn of the tool about its axis, once it is stated, stays
    return np.where(np.logical_or.accumulate(words.noted("spin")), np.int8(_UNREAD), kind), at


def _machine(
    where: Positions, rows: Ints, rapid: Bools, used: Bools, tcp: Bools, kind: Ints, result: ToolOrientation
) -> None:
    """Motions without a TCP mode: their rotary axes have to be at 0 from start to end."""
    end, start = np.where(used, where.end[rows, 3:], 0.0), np.where(used, where.start[rows, 3:], 0.0)
    unknown = np.isnan(end).any(axis=1)
    away = (np.abs(end) > WHOLE).any(axis=1) | (~rapid & (np.abs(start) > WHOLE).any(axis=1))
    wrong = ~tcp & (unknown | away | (kind > ROTARY))
    result.wrong[wrong] = 1
    result.wrong[tcp & (kind < 0)] = 2
    result.rotation[wrong | (tcp & (kind < 0))] = np.nan


def _orientation(
    block_words: BlockWords, kind: int, turn: Floats, turned: Floats | None, used: Bools
) -> OrientationWords:
    control = block_words.control
    if kind == VECTOR:
        return Vector((control.vector[0], control.vector[1], control.vector[2]), turn, turned)
    if kind in _SEQUENCES:
        words = (control.euler[0], control.euler[1], control.euler[2])
        return Angles(words, _SEQUENCES[kind], turn, turned, free_spin=True, joint=True)
    a, b, c = (one if use else -1 for one, use in zip(_ROTARY_KEYS, used.tolist(), strict=True))
    if used.all():
        tool = np.eye(3) if control.whole else turned
        return Angles((a, b, c), control.angles, np.eye(3), tool)
    sequence = tuple((axis, axis) for axis in (2, 1, 0) if used[axis])
    return Angles((a, b, c), sequence, np.eye(3), turned, free_spin=True)
