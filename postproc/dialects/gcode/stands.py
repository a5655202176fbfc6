"""The tool's orientation from the words of the blocks.

Rotary axes A, B, C turn the tool against the part: R(A, B, C) = Rz(C) Ry(B) Rx(A) in the base's axes, and the tool
stands at R turned, with ``turned`` its orientation at A = B = C = 0; an axis that no block names stays at 0. That
holds where X, Y, Z are the tool's tip (TCP modes); else where the tip is, and how the part stands, is the machine's
own, and only blocks with all rotary axes at 0 say where the tool is. Controls of robots take A, B, C as angles of the
tool's frame itself (``Control.whole``). A vector, or angles A2= B2= C2=, say where the tool points in the programmed
coordinates; they hold until another block states an orientation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.dialects.gcode.blocks import Blocks
from postproc.dialects.gcode.control import Group
from postproc.dialects.gcode.orientation import Angles, Orientation, Vector
from postproc.dialects.gcode.positions import Positions
from postproc.dialects.gcode.words import key
from postproc.units import DEG

WHOLE = 1e-9
"""[rad] a rotary axis this near to 0 stands at 0."""

ROTARY, VECTOR, EULER, RPY = range(4)
_NOWHERE = -1
_ROTARY_KEYS = (key("A"), key("B"), key("C"))
_SEQUENCES = {EULER: ((2, 0), (0, 1), (2, 2)), RPY: ((2, 2), (1, 1), (0, 0))}


@dataclass(frozen=True, eq=False)
class Stand:
    """rotation (N, 3, 3); oriented (N,): the words can be written; free_axis (N, 3): as in a Toolpath; wrong (N,):
    0, or 1 rotary axes away from 0 or not known without a TCP mode, 2 not known in one.  orient (N,), orientations,
    values, before (N, 3): as in Places.  stated (N,): the block itself states the whole orientation in force."""

    rotation: Floats
    oriented: Bools
    free_axis: Floats
    wrong: Ints
    orient: Ints
    orientations: tuple[Orientation, ...]
    values: Floats
    before: Floats
    stated: Bools


def stands(given: Blocks, where: Positions, rows: Ints, rapid: Bools, turned: Floats | None) -> Stand:
    """The orientation of the motions in the blocks ``rows`` (N,).

    rapid (N,): air; turned (3, 3): the tool in the base at A = B = C = 0, None where nothing says it.
    """
    n = len(rows)
    words = given.text.words.key
    used = np.array([bool((words == one).any()) for one in _ROTARY_KEYS])
    tcp = given.modal.force[Group.TCP] == 1
    kind, stating = _kinds(given, tcp, bool(used.any()))
    result = Stand(
        np.full((n, 3, 3), np.nan) if turned is None else np.broadcast_to(turned, (n, 3, 3)).copy(),
        np.zeros(n, np.bool_),
        np.full((n, 3), np.nan),
        np.zeros(n, np.int64),
        np.full(n, -1),
        (),
        np.full((n, 3), np.nan),
        np.full((n, 3), np.nan),
        np.zeros(n, np.bool_),
    )
    if not used.any() and not (kind > ROTARY).any():
        return result
    _machine(where, rows, rapid, used, tcp[rows], kind[rows], result)
    found: list[Orientation] = []
    turns = np.array([frame.turn for frame in where.frames])
    inside = tcp[rows] & (kind[rows] != _NOWHERE)
    pairs = np.stack([kind[rows], np.where(kind[rows] == ROTARY, 0, where.frame[rows])], axis=1)
    for one, number in np.unique(pairs[inside], axis=0).tolist():
        here = np.flatnonzero(inside & (pairs == (one, number)).all(axis=1))
        orientation = _orientation(given, one, turns[number], turned, used)
        result.orient[here] = len(found)
        found.append(orientation)
        values = _values(given, where, one, rows[here], stating[rows[here]], turned, turns, used, orientation)
        shifted = np.array([frame.shift[3:].any() for frame in where.frames])[where.frame[rows[here]]]
        result.values[here] = values
        ahead = here[(rows[here] > 0) & ((one == ROTARY) | (kind[rows[here] - 1] == one))]
        block = rows[ahead]
        if one == ROTARY:
            result.before[ahead] = np.where(used, where.begin[block, 3:] / DEG, np.nan)
        else:
            said = stating[block - 1]
            result.before[ahead] = _values(given, where, one, block, said, turned, turns, used, orientation)
        present = np.stack(
            [given.of(address)[rows[here]] >= 0 for address in orientation.words if address >= 0], axis=1
        )
        result.stated[here] = present.any(axis=1) if orientation.joint else present.all(axis=1)
        columns = np.array(orientation.words) >= 0
        known = np.isfinite(values[:, columns]).all(axis=1)
        result.wrong[here[~known]] = 2
        good = here[known]
        result.rotation[here] = np.nan
        result.rotation[good] = orientation.rotation(values[known])
        result.oriented[good] = orientation.writable(values[known]) & ~shifted[known]
        result.free_axis[good] = orientation.free_axis
    return Stand(**{**result.__dict__, "orientations": tuple(found)})


def _kinds(given: Blocks, tcp: Bools, rotary: bool) -> tuple[Ints, Ints]:
    """(B,) what states the orientation in force, _NOWHERE where nothing known does; the block that states it."""
    n = len(given)
    control = given.control
    stated = np.full(n, _NOWHERE)
    marks = np.zeros(n, np.bool_)
    euler = given.modal.force[Group.EULER]
    for keys, kind in (
        (control.euler, np.where(euler == 1, RPY, EULER)),
        (control.vector, np.full(n, VECTOR)),
    ):
        if keys:
            has = given.has(*keys)
            stated[has], marks[has] = kind[has], True
            stated[has & (euler < 0) & (kind != VECTOR)] = _NOWHERE
    if rotary:
        has = given.has(*_ROTARY_KEYS)
        stated[has], marks[has] = ROTARY, True
    doubtful = given.modal.flow.doubt != 0
    lost = (marks & doubtful) | given.modal.flow.forget
    changed = np.concatenate([[False], tcp[1:] != tcp[:-1]]) if n else marks
    # A vector does not outlast its mode; positions of rotary axes do.
    stated[lost] = _NOWHERE
    fresh = marks | lost | changed
    at = np.maximum.accumulate(np.where(fresh, np.arange(n), -1))
    kind = np.where(at >= 0, stated[np.maximum(at, 0)], _NOWHERE)
    return np.where((kind == _NOWHERE) & rotary, ROTARY, kind), at


def _machine(
    where: Positions, rows: Ints, rapid: Bools, used: Bools, tcp: Bools, kind: Ints, result: Stand
) -> None:
    """Motions without a TCP mode: their rotary axes have to be at 0 from begin to end."""
    end, begin = np.where(used, where.end[rows, 3:], 0.0), np.where(used, where.begin[rows, 3:], 0.0)
    unknown = np.isnan(end).any(axis=1)
    away = (np.abs(end) > WHOLE).any(axis=1) | (~rapid & (np.abs(begin) > WHOLE).any(axis=1))
    wrong = ~tcp & (unknown | away | (kind > ROTARY))
    result.wrong[wrong] = 1
    result.wrong[tcp & (kind == _NOWHERE)] = 2
    result.rotation[wrong | (tcp & (kind == _NOWHERE))] = np.nan


def _orientation(given: Blocks, kind: int, turn: Floats, turned: Floats | None, used: Bools) -> Orientation:
    control = given.control
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


def _values(
    given: Blocks,
    where: Positions,
    kind: int,
    blocks: Ints,
    stating: Ints,
    turned: Floats | None,
    turns: Floats,
    used: Bools,
    orientation: Orientation,
) -> Floats:
    """(n, 3) numbers in force at the end of ``blocks`` (n,), of which ``stating`` (n,) state them."""
    if kind == ROTARY:
        return np.where(used, where.end[blocks, 3:] / DEG, np.nan)
    keys = given.control.vector if kind == VECTOR else given.control.euler
    at = np.maximum(stating, 0)
    present = np.stack([given.of(one)[at] >= 0 for one in keys], axis=1)
    numbers = np.stack([given.number(one)[at] for one in keys], axis=1)
    values = np.where(present, numbers, 0.0)
    # Stated in other coordinates: where it points stays.
    for number in np.unique(where.frame[at]).tolist():
        other = np.flatnonzero((where.frame[at] == number) & (where.frame[blocks] != number))
        if len(other):
            told = _orientation(given, kind, turns[number], turned, used)
            values[other] = orientation.values(told.rotation(values[other]), values[other])
    return np.asarray(values)
