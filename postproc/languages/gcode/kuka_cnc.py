"""KUKA.CNC: G-code that a robot control itself runs, with # commands; A, B, C are the angles of KRL."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from postproc.base.units import MM
from postproc.languages.gcode.control import (
    Control,
    Event,
    Feed,
    Group,
    ModalCode,
    Move,
    Once,
    ProgrammedFrame,
    modal_codes,
    named_codes,
)
from postproc.languages.gcode.kuka_cnc_lines import WEIGHTS, KukaCncLines
from postproc.languages.gcode.words import key

COMMENT = rb"\([^)\r\n]*\)?|;[^\r\n]*|^[ \t]*%[^\r\n]*"

_NUMBERED: tuple[tuple[Group, int, tuple[float, ...]], ...] = (
    (Group.MOTION, Move.RAPID, (0,)),
    (Group.MOTION, Move.LINE, (1,)),
    (Group.MOTION, Move.CLOCKWISE, (2,)),
    (Group.MOTION, Move.COUNTER, (3,)),
    (Group.MOTION, Move.THREAD, (33, 63, 331)),
    (Group.MOTION, Move.CYCLE, tuple(range(81, 90))),
    (Group.MOTION, Move.NOTHING, (80,)),
    (Group.SPLINE, 1, (151,)),
    (Group.SPLINE, 0, (150,)),
    (Group.MOTION, Move.OTHER, (12, 13, 301, 302, 303)),
    (Group.PLANE, 0, (17,)),
    (Group.PLANE, 1, (18,)),
    (Group.PLANE, 2, (19,)),
    (Group.DISTANCE, 0, (90,)),
    (Group.DISTANCE, 1, (91,)),
    (Group.ARCS, 1, (161,)),
    (Group.ARCS, 0, (162,)),
    (Group.UNITS, 1, (70,)),
    (Group.UNITS, 0, (71,)),
    (Group.FEED, Feed.INVERSE_TIME, (93,)),
    (Group.FEED, Feed.PER_MINUTE, (94,)),
    (Group.FEED, Feed.PER_TURN, (95, 96, 97)),
    (Group.OFFSET, 0, (53,)),
    *((Group.OFFSET, n, (53 + n,)) for n in range(1, 7)),
    (Group.PATH, 0, (60, 260)),
    (Group.PATH, 1, (61, 261)),
    (Group.RADIUS, 0, (40,)),
    (Group.RADIUS, 1, (41, 42)),
    (Group.MIRRORED, 1, (21, 22, 23, 24)),
    (Group.MIRRORED, 0, (20,)),
    (Group.ONCE, Once.DWELL, (4,)),
    (Group.ONCE, Once.HOME, (74,)),
    (Group.ONCE, Once.PROBE, (106, 107, 310)),
    (Group.ONCE, Once.FRAME, (92,)),
    (Group.NONE, 0, (8, 9, 138, 139, 140, 165, 166, 237, 238, 239, *WEIGHTS)),
)

_NAMED: tuple[tuple[Group, int, str], ...] = (
    (Group.TCP, 1, "TRAFO ON"),
    (Group.TCP, 0, "TRAFO OFF"),
    (Group.FOREIGN, 1, "MCS ON"),
    (Group.FIXTURE, 1, "ACS ON"),
    (Group.FOREIGN, 0, "MCS OFF"),
    (Group.FIXTURE, 0, "ACS OFF"),
    (Group.AXIAL, 1, "PTP ON"),
    (Group.AXIAL, 0, "PTP OFF"),
    (Group.PATH, 1, "HSC ON"),
    (Group.ONCE, Once.FRAME, "CS,CS ON,CS OFF,CS DEF,CS ADD"),
    (Group.NONE, 0, "ACS DEF"),
    (Group.SPLINE, 1, "SPLINE ON"),
    (Group.SPLINE, 0, "SPLINE OFF"),
)


NAMED, _NAMED_CODES = named_codes(_NAMED, ",")
CODES: Mapping[int, ModalCode] = modal_codes(_NUMBERED) | _NAMED_CODES

_SYSTEM = re.compile(r"#\s*+CS\s*+(DEF|ON|OFF|ADD)?\s*+(ALL)?\s*+((?:\[[^\]]*+\]\s*+)*+)$")
_IN_BRACKETS = re.compile(r"\[([^\]]*)")


_ACTIVE, _OUTER, _INNER = "systems that are on", "offset outside of them", "level of the offset in them"
_PRESET = "origin of G92"
_NOT_KNOWN = (math.nan,) * 6
_NO_OFFSET, _SHIFT = 53.0, 92.0
_NONE = ModalCode(Group.NONE, 0)
_ENDED = (0.0,)
"""The work offset in force was selected in a system that has ended, with which it ends."""


def frame(event: Event) -> ProgrammedFrame:
    """#CS DEF[n][x,y,z,a,b,c] defines a coordinate system and #CS ON[n] works in it, within those that are on already;
    #CS OFF ends the last of them, #CS OFF ALL all.  Of those with a rotation none is read: how the control takes its
    three angles is not stated.  A work offset that is selected in a system adds to those outside of it, and ends with
    it: it is read as the only one (Beckhoff, programming manual of the same kernel, coordinate systems)."""
    memory = dict(event.frame.memory or {})
    for note in event.notes:
        if note.kind == "frame":
            _command(note.text, memory)
    active = memory.get(_ACTIVE, ())
    offsets = tuple(code for code in event.codes if CODES.get(round(code * 10), _NONE).group == Group.OFFSET)
    if offsets and not active:
        memory[_OUTER], memory[_INNER] = offsets, ()
    elif offsets:
        level = (float(len(active)),)
        alone = memory.get(_OUTER, (_NO_OFFSET,)) == (_NO_OFFSET,)
        only = memory.get(_INNER, ()) in ((), _ENDED, level)
        memory[_INNER] = level if alone and only else _NOT_KNOWN
    inner = memory.get(_INNER, ())
    if _SHIFT in event.codes:  # G92: not read, whatever ends it
        memory[_PRESET] = _NOT_KNOWN
    lost = _PRESET in memory or inner == _ENDED or math.isnan(sum(inner))
    known = not lost and all(isinstance(system, tuple) for system in active)
    shift = np.sum([np.zeros(6), *active], axis=0) if known else np.array(_NOT_KNOWN)
    return ProgrammedFrame(np.eye(3), shift, memory)


def _command(text: str, memory: dict[str, Any]) -> None:
    """What a #CS command makes of ``memory``: systems by their numbers, and those that are on, in their order."""
    said = _SYSTEM.match(text)
    groups = [] if said is None else _IN_BRACKETS.findall(said[3])
    command = "" if said is None else f"{said[1] or ''} {said[2] or ''}".strip()
    number = groups[0].strip() if groups else ""
    active = memory.get(_ACTIVE, ())
    counted = all(isinstance(system, tuple) for system in active)
    if command == "DEF" and groups:
        memory[number] = _system(groups[1]) if len(groups) == 2 else _NOT_KNOWN
    elif command == "ON" and counted:
        system = _system(groups[0]) if number.count(",") == 5 else memory.get(number, _NOT_KNOWN)
        memory[_ACTIVE] = (*active, system if len(groups) == 1 else _NOT_KNOWN)
    elif command == "OFF ALL" and not groups:
        memory[_ACTIVE] = ()
        memory[_INNER] = _ENDED if memory.get(_INNER, ()) else ()
    elif command == "OFF" and not groups and counted:
        memory[_ACTIVE] = active[:-1]
        if memory.get(_INNER, ()) == (float(len(active)),):
            memory[_INNER] = _ENDED
    elif command not in ("ON", "OFF") or (command == "OFF" and groups):
        unknown = dict.fromkeys((*memory, _ACTIVE, _OUTER, _INNER), _NOT_KNOWN)
        memory.update(unknown)


def _system(text: str) -> tuple[float, ...]:
    """Shift [m, rad] of a coordinate system without rotation; not known with one, or where it is no six numbers."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 6 or any(numbers[3:]):
        return (np.nan,) * 6
    return (*(number * MM for number in numbers[:3]), 0.0, 0.0, 0.0)


CONTROL = Control(
    name="kuka_cnc",
    codes=CODES,
    line=KukaCncLines(NAMED),
    comment=COMMENT,
    start={Group.OFFSET: 0, Group.TCP: 1},
    endings=frozenset((2, 30)),
    frame=frame,
    columns=tuple(key(letter, 1) for letter in "IJK"),
    angles=((2, 0), (1, 1), (0, 2)),
    whole=True,
    layered_offsets=True,
)
"""KUKA.CNC, on a KRC."""

_CLAIM = re.compile(rb"^[ \t]*(?:N[ \t]*\d+[ \t]*)?#[ \t]*(?:TRAFO|MCS|PTP|HSC|CS|ACS|SLOPE)\b", re.I | re.M)


def claims(raw: bytes) -> bool:
    """Whether a file is for KUKA.CNC: by its # commands."""
    return _CLAIM.search(raw[:65536]) is not None
