"""The codes of LinuxCNC and of Fanuc, and of controls that follow them (Haas, Mach, Okuma in ISO, printers)."""

from __future__ import annotations

import math

from postproc.languages.gcode import expression_values, general_lines, offsets
from postproc.languages.gcode.control import (
    READ,
    UNKNOWN,
    Control,
    Feed,
    Group,
    ModalCode,
    Move,
    Once,
    modal_codes,
)
from postproc.languages.gcode.tilted_planes import with_planes

COMMENT = rb"\((?:[^()\r\n]++|\([^()\r\n]*+\))*+\)?|;[^\r\n]*"
"""Parentheses, one pair of which may hold others; or from a semicolon on."""

_WORD = rb"[A-Za-z][ \t]*+[-+]?+[ \t]*+(?:\d[\d \t]*+(?:\.[\d \t]*+)?+|\.[ \t]*+\d[\d \t]*+|[#\[][^;(\r\n]*+)"
END_OF_BLOCK = (
    rb"\((?:[^()\r\n]++|\([^()\r\n]*+\))*+\)?|;(?![ \t]*+/?+[ \t]*+(?:"
    + _WORD
    + rb")++(?:[;(\r\n]|\Z))[^\r\n]*"
)
"""The same of controls to which a semicolon is the end of a block: with words after it, it starts no comment."""


_COMMON = modal_codes(
    (
        (Group.MOTION, Move.RAPID, (0,)),
        (Group.MOTION, Move.LINE, (1,)),
        (Group.MOTION, Move.CLOCKWISE, (2,)),
        (Group.MOTION, Move.COUNTER, (3,)),
        (Group.MOTION, Move.THREAD, (33, 34)),
        (Group.MOTION, Move.CYCLE, (73, 74, 76, 81, 82, 83, 84, 85, 86, 87, 88, 89)),
        (Group.MOTION, Move.NOTHING, (80,)),
        (Group.PLANE, 0, (17,)),
        (Group.PLANE, 1, (18,)),
        (Group.PLANE, 2, (19,)),
        (Group.DISTANCE, 0, (90,)),
        (Group.DISTANCE, 1, (91,)),
        (Group.ARCS, 1, (90.1,)),
        (Group.ARCS, 0, (91.1,)),
        (Group.UNITS, 1, (20,)),
        (Group.UNITS, 0, (21,)),
        (Group.FEED, Feed.INVERSE_TIME, (93,)),
        (Group.FEED, Feed.PER_MINUTE, (94,)),
        (Group.FEED, Feed.PER_TURN, (95,)),
        (Group.SPINDLE, 1, (96,)),
        (Group.SPINDLE, 0, (97,)),
        (Group.RETURN, 0, (98,)),
        (Group.RETURN, 1, (99,)),
        *((Group.OFFSET, 1 + n, (54 + n,)) for n in range(6)),
        *((Group.OFFSET, 6 + n, (59 + n / 10,)) for n in range(1, 10)),
        (Group.PATH, 0, (61, 61.1)),
        (Group.PATH, 1, (64,)),
        (Group.LENGTH, 1, (43,)),
        (Group.LENGTH, 0, (49,)),
        (Group.RADIUS, 0, (40,)),
        (Group.RADIUS, 1, (41, 41.1, 42, 42.1)),
        (Group.ONCE, Once.DWELL, (4,)),
        (Group.ONCE, Once.SETTING, (10, 11)),
        (Group.ONCE, Once.HOME, (28, 29, 30)),
        (Group.ONCE, Once.OTHER, (22,)),
        (Group.ONCE, Once.STORE, (28.1, 30.1)),
        (Group.ONCE, Once.PROBE, (31, 37)),
        (Group.MOTION, Move.OTHER, (38.2, 38.3, 38.4, 38.5)),
        (Group.ONCE, Once.LOCAL, (52,)),
        (Group.ONCE, Once.MACHINE, (53,)),
        (Group.ONCE, Once.SHIFT, (92,)),
        (Group.ONCE, Once.UNSHIFT, (92.1,)),
        (Group.NONE, 0, (9, 23, 62, 63, 103, 187)),
        # Codes of Fanuc that have no other meaning in LinuxCNC.
        (Group.TURNED, 1, (68, 68.1, 68.2, 68.3, 68.4, 254)),
        (Group.TURNED, 0, (69, 69.1, 255)),
        (Group.SCALED, 1, (51,)),
        (Group.SCALED, 0, (50,)),
        (Group.MIRRORED, 1, (51.1, 101)),
        (Group.MIRRORED, 0, (50.1, 100)),
        (Group.POLAR, 1, (16,)),
        (Group.POLAR, 0, (15,)),
        (Group.MACRO, 1, (66, 66.1)),
        (Group.MACRO, 0, (67,)),
        (Group.OFFSET, 100, (54.1, 154)),
        (Group.ONCE, Once.CALL, (65,)),
        (Group.ONCE, Once.OTHER, (10.6, 53.1)),
    )
)

_TIP = {
    **dict.fromkeys(
        (430, 490), (ModalCode(Group.TCP, 0), ModalCode(Group.LENGTHS, 0), ModalCode(Group.FOREIGN, 0))
    ),
    **dict.fromkeys((434, 2340), (ModalCode(Group.LENGTH, 1), ModalCode(Group.FOREIGN, 0))),
    435: (ModalCode(Group.LENGTH, 1), ModalCode(Group.FOREIGN, 1)),
}
"""G43 and G49 end the modes that G43.1, G43.4 and G43.5 start; under the last, I J K are a direction of the tool."""

_ARGUMENTS = {
    **dict.fromkeys(
        (71, 109, 431, 510, 511, 501, 660, 661, 680, 681, 682, 683, 684, 1070),
        (ModalCode(Group.ONCE, Once.OTHER),),
    ),
    500: (ModalCode(Group.ONCE, Once.SHIFT),),
    **dict.fromkeys((382, 383, 384, 385), (ModalCode(Group.ONCE, Once.PROBE),)),
}
"""Codes whose axis words are no targets; G50 X Z of lathes sets coordinates as G92 does.  What follows G38.2 without a
code is a probing move too."""

_DRILLS = frozenset((73, 74, 81, 82, 83, 84, 85, 86, 88, 89))
"""Without G76 (a thread, or a hole that is left beside its axis) and G87 (from below)."""

LINUXCNC = Control(
    name="linuxcnc",
    line=general_lines.line,
    comment=COMMENT,
    iso=True,
    also={**_TIP, **_ARGUMENTS},
    codes={
        **_COMMON,
        **modal_codes(
            (
                (Group.MOTION, Move.SPLINE, (5, 5.1, 5.2, 5.3)),
                (Group.MOTION, Move.OTHER, (12, 13, 33.1, 70, 71, 71.1, 71.2, 72, 72.1, 72.2)),
                (Group.DIAMETER, 1, (7,)),
                (Group.DIAMETER, 0, (8,)),
                (Group.PLANE, -1, (17.1, 18.1, 19.1)),
                (Group.LENGTHS, 1, (43.1, 43.2)),
                (Group.ONCE, Once.SUSPEND, (92.2,)),
                (Group.ONCE, Once.RESTORE, (92.3,)),
                (Group.TCP, 1, (43.4, 43.5)),
            )
        ),
    },
    start={Group.RETURN: UNKNOWN},
    feed_before_units=True,
    expressions=expression_values.LINUXCNC,
    frame=offsets.one_shift,
    # CENTER_ARC_RADIUS_TOLERANCE_MM and _INCH of its interp_internal.hh
    radius_gap=(0.02e-3 * math.sqrt(2), 0.002 * 25.4e-3 * math.sqrt(2)),
    drills=_DRILLS,
    states_tool=61,
    keeps_length=True,
    saves_modes=True,
    longest_line=253,  # LINELEN 255 of its interp_internal.hh; _read refuses what fills its buffer
)
"""LinuxCNC, and ISO code that is of no other control."""

FANUC = Control(
    name="fanuc",
    line=general_lines.line,
    comment=END_OF_BLOCK,
    iso=True,
    also={
        **_TIP,
        **_ARGUMENTS,
        **dict.fromkeys((680, 682), (ModalCode(Group.PLACED, 1),)),
        **dict.fromkeys((690, 691), (ModalCode(Group.TURNED, 0),)),
        **dict.fromkeys((501, 511), (ModalCode(Group.MIRRORED, READ),)),  # along which axes, the frame states
    },
    codes={
        **_COMMON,
        **modal_codes(
            (
                (Group.NONE, 0, (5, 5.1, 8, 8.1, 64.1, 61.2, 107.1, 50.2, 69.3)),
                (
                    Group.MOTION,
                    Move.OTHER,
                    (2.2, 3.2, 2.3, 3.3, 2.4, 3.4, 12, 13, 34, 35, 36, 37.1, 70, 71, 72, 75, 77, 78, 150),
                ),
                (Group.MOTION, Move.SPLINE, (6.2,)),
                (Group.TCP, 1, (43.4, 43.5, 234)),
                (Group.LENGTHS, 1, (43.1, 43.2, 43.3, 43.7, 44, 45, 46, 47, 48)),
                *((Group.OFFSET, 101 + n, (110 + n,)) for n in range(20)),
                (Group.MOTION, Move.THREAD, (32,)),
                (
                    Group.RADIUS,
                    1,
                    (*(41 + n / 10 for n in range(2, 7)), *(42 + n / 10 for n in range(2, 7)), 141),
                ),
                (Group.LENGTHS, 1, (43.8, 43.9, 143)),
                (Group.TURNED, 1, (68.5, 68.6)),
                (Group.DIAMETER, 1, (10.9,)),
                (Group.BENT, 1, (7, 7.1, 107, 51.2, 54.2, 54.4)),
                (Group.FACE, 1, (112, 12.1)),
                (Group.ONCE, Once.FRAME, (68, 68.2, 53.1, 51.1, 50.1)),
                (Group.PLACED, 0, (69, 69.1)),
                (Group.FACE, 0, (113, 13.1)),  # G113 only where such a mode is in force, see modal
            )
        ),
    },
    frame=with_planes(offsets.two_shifts),
    cycle_apart=True,
    increments=True,
    turns=(0, 0),
    expressions=expression_values.FANUC,
    drills=_DRILLS,
)
"""Fanuc, and controls that follow it: Haas, Brother, Okuma and Mitsubishi in ISO code."""
