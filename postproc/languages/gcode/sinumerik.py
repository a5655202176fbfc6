"""Siemens Sinumerik 840D: its codes and names as data, its frames, and the dialect."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from postproc.base.geometry import rotation_from_abc, rotation_from_vector
from postproc.base.units import DEG
from postproc.languages.gcode import expression_values
from postproc.languages.gcode.control import (
    UNKNOWN,
    Control,
    Event,
    Feed,
    Group,
    ModalCode,
    Move,
    Once,
    ProgrammedFrame,
    ToolAxis,
    modal_codes,
    named_codes,
)
from postproc.languages.gcode.offsets import start
from postproc.languages.gcode.sinumerik_expression import constant
from postproc.languages.gcode.sinumerik_lines import RETRACT, RPL, TURN, SinumerikLines
from postproc.languages.gcode.tilted_planes import swivelled
from postproc.languages.gcode.words import key

COMMENT = rb'("[^"\r\n]*"?)|;[^\r\n]*'

BEGIN = 65536
"""Bytes from the start of a file that are searched for the control that it is for."""

_NUMBERED: tuple[tuple[Group, int, tuple[float, ...]], ...] = (
    (Group.MOTION, Move.RAPID, (0,)),
    (Group.MOTION, Move.LINE, (1,)),
    (Group.MOTION, Move.CLOCKWISE, (2,)),
    (Group.MOTION, Move.COUNTER, (3,)),
    (Group.MOTION, Move.THREAD, (33, 34, 35, 63, 331, 332, 335, 336)),
    (Group.MOTION, Move.OTHER, (147, 148, 247, 248, 347, 348)),
    (Group.PLANE, 0, (17,)),
    (Group.PLANE, 1, (18,)),
    (Group.PLANE, 2, (19,)),
    (Group.DISTANCE, 0, (90,)),
    (Group.DISTANCE, 1, (91,)),
    (Group.UNITS, 1, (70, 700)),
    (Group.UNITS, 0, (71, 710)),
    (Group.BENT, 1, (291,)),  # blocks of another control until G290
    (Group.FEED, Feed.INVERSE_TIME, (93,)),
    (Group.FEED, Feed.PER_MINUTE, (94, 961, 971)),
    (Group.FEED, Feed.PER_TURN, (95, 96, 97, 973)),
    (Group.FEED, UNKNOWN, (962, 972)),  # the one in force before, or another
    (Group.OFFSET, 0, (500,)),
    *((Group.OFFSET, n, (53 + n,)) for n in range(1, 5)),
    *((Group.OFFSET, n, (500 + n,)) for n in range(5, 100)),
    (Group.PATH, 0, (60,)),
    (Group.PATH, 1, (64, 641, 642, 643, 644, 645)),
    (Group.RADIUS, 0, (40,)),
    (Group.RADIUS, 1, (41, 42)),
    (Group.ONCE, Once.DWELL, (4,)),
    (Group.ONCE, Once.OTHER, (25, 26, 110, 111, 112)),
    (Group.ONCE, Once.HOME, (74, 75, 76)),
    (Group.ONCE, Once.MACHINE, (53, 153)),
    (Group.ONCE, Once.FRAME, (58, 59, 158, 258, 259)),
    (
        Group.NONE,
        0,
        (
            9,
            62,
            140,
            141,
            142,
            143,
            290,
            340,
            341,
            450,
            451,
            460,
            461,
            462,
            601,
            602,
            603,
            621,
            *range(810, 830),
        ),
    ),
)

_NAMED: tuple[tuple[Group, int, str], ...] = (
    (Group.MOTION, Move.THROUGH, "CIP"),
    (Group.MOTION, Move.OTHER, "CT INVCW INVCCW"),
    (Group.MOTION, Move.SPLINE, "POLY ASPLINE BSPLINE CSPLINE"),
    (Group.TCP, 1, "TRAORI"),
    (Group.TCP, 0, "TRAFOOF TRANSMIT TRACYL TRAANG TRACON"),
    (Group.FOREIGN, 1, "TRANSMIT TRACYL TRAANG TRACON TRAFOON"),
    (Group.BENT, 1, "GEOAX"),
    (Group.FOREIGN, 0, "TRAFOOF TRAORI"),
    (Group.AXIAL, 1, "PTP PTPG0 PTPWOC"),
    (Group.AXIAL, 0, "CP"),
    (Group.EULER, 0, "ORIEULER"),
    (Group.EULER, 1, "ORIRPY"),
    (Group.EULER, -1, "ORIRPY2"),
    (Group.DIAMETER, 1, "DIAMON DIAM90 DIAMCYCOF DIAMONA DIAM90A DIAMCHAN DIAMCHANA"),
    (Group.DIAMETER, 0, "DIAMOFA"),
    (Group.CARRIER, 1, "TCARR(ON)"),
    (Group.CARRIER, 0, "TCARR(OFF)"),
    (Group.OFFSETS, 1, "TOFF(ON)"),
    (Group.OFFSETS, 0, "TOFF(OFF)"),
    (Group.OVERRIDE, 1, "OVR(ON)"),
    (Group.OVERRIDE, 0, "OVR(OFF)"),
    (Group.FEED_AXES, 1, "FGROUP(OTHER)"),
    (Group.FEED_AXES, 0, "FGROUP(XYZ)"),
    (Group.ROUNDING, 1, "RNDM(ON)"),
    (Group.ROUNDING, 0, "RNDM(OFF)"),
    (Group.DIAMETER, 0, "DIAMOF"),
    (Group.MACRO, 1, "MCALL()"),
    (Group.MACRO, 2, "MCALL(CYCLE)"),
    (Group.MACRO, 0, "MCALL_OFF"),
    (Group.ONCE, Once.MACHINE, "SUPA G53"),
    (Group.ONCE, Once.PROBE, "MEAS MEAW MEASA MEAWA MEAC"),
    (
        Group.ONCE,
        Once.FRAME,
        "TRANS ATRANS ROT AROT ROTS AROTS SCALE ASCALE MIRROR AMIRROR TOFRAME TOFRAMEX TOFRAMEY TOFRAMEZ TOROT TOROTX "
        "TOROTY TOROTZ TOROTOF PAROT PAROTOF CYCLE800",
    ),
    (
        Group.NONE,
        0,
        "WALIMON WALIMOF "
        "FNORM FLIN FCUB FPO BRISK SOFT DRIVE FFWON FFWOF COMPON COMPCURV COMPCAD COMPSURF COMPOF FIFOCTRL STARTFIFO "
        "STOPFIFO DYNNORM DYNPOS DYNROUGH DYNSEMIFIN DYNFINISH DYNPREC CUT2D CUT2DF CUT3DC CUT3DF CUT3DFS CUT3DFF CDON "
        "CDOF CDOF2 NORM KONT KONTT KONTC SPCON SPCOF CFC CFTCP CFIN SPATH UPATH LFTXT LFWP LFPOS STOPRE RTLION RTLIOF "
        "CPRECON CPRECOF SBLON SBLOF ORISON ORISOF ORIAXES ORIVECT ORIPLANE ORIMACHAX ORIVIRTAX "
        "ADISPOSA DISPLOF DISPLON TCOABS TCOFR TCOFRX TCOFRY TCOFRZ NOC FEEDOF BNAT BTAN BAUTO ENAT ETAN EAUTO "
        "ORIROTA ORIROTR ORIROTT ORIROTC OSC OSD OSSE OST OSOF GFRAME0 PTPON LIFTFAST ACCLIMA SPIF1 SPIF2",
    ),
    (Group.EULER, -1, "ORIVIRT1 ORIVIRT2"),  # virtual axes as machine data define them
    (Group.ORIENTED, 0, "ORIWKS"),
    (Group.ORIENTED, 1, "ORIMKS"),
)


NAMED, _NAMED_CODES = named_codes(_NAMED)
CODES: Mapping[int, ModalCode] = modal_codes(_NUMBERED) | _NAMED_CODES

_FRAMES = {
    NAMED[name.encode()][0]: name
    for name in ("TRANS", "ATRANS", "ROT", "AROT", "SCALE", "ASCALE", "MIRROR", "AMIRROR", "CYCLE800")
}
_ALONG_TOOL = {
    NAMED[name.encode()][0]
    for name in ("TOFRAME", "TOFRAMEX", "TOFRAMEY", "TOFRAMEZ", "TOROT", "TOROTX", "TOROTY")
} | {NAMED[b"TOROTZ"][0], NAMED[b"PAROT"][0]}
"""What turns the coordinates along the tool or the part, and stays when a programmable frame takes another's place."""
_ALONG_TOOL_ENDS = {NAMED[b"TOROTOF"][0], NAMED[b"PAROTOF"][0]}
_FRAME_CODE = ModalCode(Group.ONCE, Once.FRAME)
_AXES = tuple(key(letter) for letter in "XYZABC")
_NORMAL = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])


def frame(event: Event) -> ProgrammedFrame:
    """The programmable frame after TRANS, ROT ...: absolute ones take the place of the whole frame, A... ones go
    on from it.  ROT X Y Z turns about Z, the new Y, the new X; RPL= about the axis normal to the plane.  CYCLE800
    without a plane leaves no frame.  SCALE multiplies and MIRROR reverses the coordinates of the axes that they name.
    Frames that come from the machine, and rotations of scaled or mirrored coordinates, are not read: where they are in
    force the place is not known."""
    unknown = ProgrammedFrame(np.eye(3), np.full(6, np.nan), event.frame.memory)
    if event.frame.memory is None and _ALONG_TOOL.intersection(event.codes):
        return replace(unknown, memory=_ORIENTED)
    if event.frame.memory == _ORIENTED and _ALONG_TOOL_ENDS.intersection(event.codes):
        return replace(unknown, memory=None)
    said = [_FRAMES[code] for code in event.codes if code in _FRAMES]
    changes = [code for code in event.codes if CODES.get(round(code * 10)) == _FRAME_CODE]
    if len(said) != 1 or len(changes) != 1:
        return unknown
    name = said[0]
    if name == "CYCLE800":
        return _swivelled(event)
    base = event.frame
    if not name.startswith("A"):
        base = ProgrammedFrame(np.eye(3), np.zeros(6), event.frame.memory)
    given = np.array([event.words.get(axis, 0.0) for axis in _AXES])
    if event.frame.memory is not None:
        return unknown
    if not (set(_AXES) | {RPL}) & set(event.words):
        return base
    if name.endswith("TRANS"):
        shift = given * np.array([event.scale] * 3 + [DEG] * 3)
        return replace(base, shift=base.shift + np.concatenate([base.turn @ shift[:3], shift[3:]]))
    if name.endswith(("SCALE", "MIRROR")):
        if {*_AXES[3:], RPL} & set(event.words):
            return unknown
        if name.endswith("MIRROR"):
            return base.mirrored(np.array([-1.0 if axis in event.words else 1.0 for axis in _AXES[:3]]))
        factors = np.array([event.words.get(axis, 1.0) for axis in _AXES[:3]])
        known = (np.isfinite(factors) & (factors > 0)).all()
        return replace(base, turn=base.turn @ np.diag(factors)) if known else unknown
    if not base.rigid or not name.endswith("ROT"):
        return unknown
    angle = event.words.get(RPL)
    turn = rotation_from_abc(given[[2, 1, 0]] * DEG)
    if angle is not None:
        turn = rotation_from_vector(_NORMAL[event.plane] * angle * DEG)
    if not np.isfinite(turn).all():
        return unknown
    return replace(base, turn=base.turn @ turn)


_SWIVELLED, _ORIENTED = "swivelled", "oriented"
"""What a frame remembers: a plane of CYCLE800, or what TOROT and the like state, is in force."""


def _swivelled(event: Event) -> ProgrammedFrame:
    """After CYCLE800: shifts and angles (arguments 5 to 13) that are all 0 bring the rotary axes back and leave no
    frame; without arguments the axes stay where they are, so that a plane that was swivelled is not undone; others are
    a plane, see ``tilted_planes``."""
    text = next((note.text for note in event.notes if note.kind == "swivel"), "?")
    arguments = [part.strip() for part in text.strip("() \t").split(",")]
    values = [constant(part.encode()) if part else 0.0 for part in arguments]
    if len(arguments) > 12 and not any(value != 0 for value in values[4:13]):
        # axes that are not at 0 already go to where the data of the swivelling unit say; without a direction none moves
        moves = event.frame.memory is None or (len(values) > 13 and abs(values[13]) == 1)
        tool = ToolAxis.STATED if moves else ToolAxis.UNKNOWN
        return replace(start(), tool=tool, rotary=np.where(event.position[3:] == 0, 0.0, np.nan))
    if arguments == [""] and event.frame.memory is None:
        return start()
    plane = swivelled(event, arguments, values)
    if plane is not None:
        return replace(plane, memory=_SWIVELLED)
    return ProgrammedFrame(np.eye(3), np.full(6, np.nan), _SWIVELLED)


EULER, VECTOR = (tuple(key(letter, index) for letter in "ABC") for index in (2, 3))

CONTROL = Control(
    name="sinumerik",
    codes=CODES,
    line=SinumerikLines(NAMED, {}),
    comment=COMMENT,
    # G70 and G71 say the unit of coordinates; F stays in that of the machine's basic system, mm.
    also={
        **dict.fromkeys((700, 710, 7100), (ModalCode(Group.FEED_UNITS, 0),)),
        7000: (ModalCode(Group.FEED_UNITS, 1),),
        # S is a cutting speed until another code of their group
        **dict.fromkeys((960, 9610, 9620), (ModalCode(Group.SPINDLE, 1),)),
        **dict.fromkeys((930, 940, 950, 970, 9710, 9720, 9730), (ModalCode(Group.SPINDLE, 0),)),
    },
    feed_units=Group.FEED_UNITS,
    start={Group.OFFSET: 0},
    endings=frozenset((2, 17, 30)),
    turns=(TURN, 0),
    frame=frame,
    columns=(RPL, TURN, RETRACT, *(key(letter, 1) for letter in "IJK"), *EULER, *VECTOR),
    angles=((0, 0), (1, 1), (2, 2)),
    whole=True,
    vector=VECTOR,
    euler=EULER,
    calls=frozenset((key("L"),)),
    retract=RETRACT,
    parameter="R",
    further=True,
    offsets=key("D"),
    expressions=expression_values.SINUMERIK,
    increments_by_setting=True,  # SD42440 $SC_FRAME_OFFSET_INCR_PROG
    longest_line=512,  # programming manual "fundamentals", block length
)
"""Sinumerik 840D, its own language (G290)."""

_TOOL = re.compile(rb'(?<![A-Za-z_])T[ \t]*=[ \t]*("[^"\r\n]*")', re.I)
_CLAIM = re.compile(
    rb"^[ \t]*(?:/\d?[ \t]*)?(?:N\d+[ \t]*)?(?:TRAORI|TRAFOOF|SUPA|MCALL|CYCLE8\d+[ \t]*\(|G7[01]0\b|G64[1-5]\b|"
    rb"G5[0-9][0-9]\b|CIP\b|A?TRANS\b|A?ROT\b|MSG[ \t]*\(|DEF[ \t]+(?:REAL|INT)\b|\$[PATM][A-Z]*_|T=\"|R\d+=|"
    rb"%_N_|STOPRE|FNORM|DYN[A-Z]+\b|FFWON|SOFT\b|COMPCAD|G\d{1,3}[^;(\r\n]*(?:\bCR=|[A-C]3=|=AC\(|=IC\(|TURN=))",
    re.I | re.M,
)


def with_tools(raw: bytes) -> Control:
    """The control with the named tools of a program: T="MILL10" is the tool whose number is its place among the
    names, in the order in which they appear."""
    tools: dict[bytes, int] = {}
    for found in _TOOL.finditer(raw):
        tools.setdefault(found[1], len(tools) + 1)
    return replace(CONTROL, line=SinumerikLines(NAMED, tools)) if tools else CONTROL


def claims(suffix: str, raw: bytes) -> bool:
    """Whether a file is for a Sinumerik: by its name, or by words that no other control has."""
    return suffix.lower() in (".mpf", ".spf") or _CLAIM.search(raw[:BEGIN]) is not None
