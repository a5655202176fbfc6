"""KUKA.CNC: G-code that a robot control itself runs, with # commands; A, B, C are the angles of KRL."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

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
    (Group.MOTION, Move.SPLINE, (151,)),
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
    (Group.NONE, 0, (8, 9, 138, 139, 140, 150, 165, 166, 237, 238, 239, *WEIGHTS)),
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
)


NAMED, _NAMED_CODES = named_codes(_NAMED, ",")
CODES: Mapping[int, ModalCode] = modal_codes(_NUMBERED) | _NAMED_CODES

_SYSTEM = re.compile(r"#\s*+CS\s*+(DEF|ON|OFF|ADD)?\s*+(ALL)?\s*+((?:\[[^\]]*+\]\s*+)*+)$")
_IN_BRACKETS = re.compile(r"\[([^\]]*)")


def frame(event: Event) -> ProgrammedFrame:
    """#CS DEF[n][x,y,z,a,b,c] defines a coordinate system, #CS ON[n] works in it, #CS OFF and #CS OFF ALL in the base
    again.  One system at a time is read, and of those with a rotation none: how the control takes its three angles is
    not stated."""
    memory = dict(event.frame.memory or {})
    result = replace(event.frame, memory=memory)
    for note in event.notes:
        said = _SYSTEM.match(note.text) if note.kind == "frame" else None
        if said is None:
            continue
        groups = _IN_BRACKETS.findall(said[3])
        number = groups[0].strip() if groups else ""
        if said[1] == "DEF" and len(groups) == 2:
            memory[number] = _system(groups[1])
        elif said[1] == "OFF":
            result = ProgrammedFrame(np.eye(3), np.zeros(6), memory)
        elif said[1] == "ON" and number in memory and len(groups) == 1 and not event.frame.shift.any():
            result = ProgrammedFrame(np.eye(3), np.array(memory[number]), memory)
        elif said[1] == "ON" and len(groups) == 1 and groups[0].count(",") == 5:
            result = ProgrammedFrame(np.eye(3), np.array(_system(groups[0])), memory)
        else:
            result = ProgrammedFrame(np.eye(3), np.full(6, np.nan), memory)
    if not any(note.kind == "frame" for note in event.notes):
        return ProgrammedFrame(np.eye(3), np.full(6, np.nan), memory)
    return result


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
)
"""KUKA.CNC, on a KRC."""

_CLAIM = re.compile(rb"^[ \t]*(?:N[ \t]*\d+[ \t]*)?#[ \t]*(?:TRAFO|MCS|PTP|HSC|CS|ACS|SLOPE)\b", re.I | re.M)


def claims(raw: bytes) -> bool:
    """Whether a file is for KUKA.CNC: by its # commands."""
    return _CLAIM.search(raw[:65536]) is not None
