"""Writes taught.src and taught.dat: a slot and a rectangular groove, taught with inline forms (KSS 8).

Each point is what a controller stores at a touch-up: the pose of the axes as they stand (here to 0.001 deg,
hence the crooked numbers), in single precision, with their status and turn.  Nothing is random.

    python samples/kr270_taught/make_taught.py
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.base.geometry import Poses, abc_from_rotation
from postproc.robot.branches import negative_axes
from postproc.robot.chain import Chain
from postproc.robot.description import find_robot, load_robot
from postproc.robot.inverse import branch_of, inverse

ROBOT = load_robot(find_robot("kuka_kr270"))
BASE = Poses.from_abc([1.4513, -0.1186, 0.7204], np.radians([12.3, 0.05, -0.08]))  # a fixture, touched off
TOOL = Poses.from_abc([0.30142, -0.00035, 0.17984], np.radians([0.21, 89.87, 0]))  # +Z: spindle, tip-ward
SPIN = 82.7  # A of the upright tool, deg: the flange lies beside the spindle, clear of A5 = 0
STATUS = 6  # wrist in front, elbow up, A5 < 0
READING = 0.001  # deg, step of the axis readings
FEED, RAPID = 0.02, 0.25  # m/s

# N along the feed, to its left, up: a full slot of 3 mm at 0.1 mm a tooth (the formula is in kr270_panel),
# and half of it for a ramp or for the wedge that a ramp leaves
SLOT, RAMP = (-114, 252, -67), (-57, 126, -34)


@dataclass(frozen=True)
class Step:
    """One motion: its kind, the tip X, Y, Z in the fixture [mm], its speed, and whether it is rounded."""

    kind: str  # PTP or LIN
    target: tuple[float, float, float]
    speed: float = FEED
    rounded: bool = False


def force(feed: str, numbers: tuple[int, int, int] = SLOT) -> str:
    """A FORCE comment in the axes of the base, for a feed along one of them."""
    along, left, up = numbers
    x, y = {"+X": (along, left), "+Y": (-left, along), "-X": (-along, -left), "-Y": (left, -along)}[feed]
    return f";FORCE {x} {y} {up} @base"


def slot() -> Iterator[Step | str]:
    """200 mm along X, 3 mm deep there and 6 mm deep back."""
    yield Step("PTP", (20, 40, 80), rounded=True)
    yield Step("LIN", (20, 40, 1), RAPID)
    yield from (force("+X", RAMP), Step("LIN", (60, 40, -3), rounded=True))
    yield from (force("+X"), Step("LIN", (220, 40, -3)))
    yield from (force("-X", RAMP), Step("LIN", (180, 40, -6), rounded=True))
    yield from (force("-X"), Step("LIN", (20, 40, -6)))
    yield from (force("+X", RAMP), Step("LIN", (60, 40, -6)))
    yield from (";FORCE OFF", Step("LIN", (60, 40, 60), RAPID, rounded=True))


def groove() -> Iterator[Step | str]:
    """160 x 90 mm, counter-clockwise, in two laps of 3 mm."""
    yield Step("PTP", (150, 100, 60), rounded=True)
    yield Step("LIN", (150, 100, 1), RAPID)
    for floor in (-3, -6):
        yield from (force("+X", RAMP), Step("LIN", (190, 100, floor), rounded=True))
        yield from (force("+X"), Step("LIN", (230, 100, floor), rounded=True))
        yield from (force("+Y"), Step("LIN", (230, 190, floor), rounded=True))
        yield from (force("-X"), Step("LIN", (70, 190, floor), rounded=True))
        yield from (force("-Y"), Step("LIN", (70, 100, floor), rounded=True))
        yield from (force("+X"), Step("LIN", (150, 100, floor), rounded=True))
    yield from (force("+X", RAMP), Step("LIN", (190, 100, -6)))
    yield from (";FORCE OFF", Step("LIN", (190, 100, 80), RAPID, rounded=True))


PROGRAM = [
    *("home", "", ";END MILL D16, 3 TEETH: START THE SPINDLE BY HAND, 4000 1/MIN", "HALT", ";FORCE OFF"),
    *("", ";SLOT", *slot(), "", ";GROOVE", *groove(), "", "home"),
]
STEPS = [line for line in PROGRAM if isinstance(line, Step)]


def taught() -> tuple[np.ndarray, np.ndarray]:
    """X, Y, Z, A, B, C [mm, deg] of the points (N, 6) and the axes [rad] they were taught at."""
    xyz = np.array([step.target for step in STEPS], dtype=float)
    wanted = BASE @ Poses.from_abc(xyz / 1e3, np.radians(np.tile([SPIN, 0.0, 180.0], (len(xyz), 1))))
    found = inverse(
        ROBOT.nominal, wanted @ TOOL.inverse(), np.full(len(xyz), STATUS), np.zeros((len(xyz), 6))
    )
    q = np.radians(np.round(np.degrees(found.q) / READING) * READING)
    spare = np.degrees(np.minimum(q - ROBOT.limits[:, 0], ROBOT.limits[:, 1] - q)).min()
    if not spare > 10:
        raise SystemExit(f"{spare:.1f} deg to an axis limit: too near")
    pose = BASE.inverse() @ Chain(ROBOT.joints, ROBOT.flange).flange(q) @ TOOL
    return np.column_stack([pose.position * 1e3, np.degrees(abc_from_rotation(pose.rotation))]), q


def number(value: float) -> str:
    """As a controller prints a REAL: single precision, nine digits, always with a point."""
    text = f"{np.float32(value):.9G}"
    return text if "." in text or "E" in text else text + ".0"


def header() -> Iterator[str]:
    yield from ("&ACCESS RVP", "&REL 14", "&PARAM EDITMASK = *")
    yield r"&PARAM TEMPLATE = C:\KRC\Roboter\Template\vorgabe"


def inline_form(index: int, step: Step) -> Iterator[str]:
    point = f"P{index}"
    data, unit = (f"PDAT{index}", "%") if step.kind == "PTP" else (f"CPDAT{index}", "m/s")
    speed = "30" if step.kind == "PTP" else f"{step.speed:g}"
    zone = {"PTP": "C_PTP", "LIN": "C_DIS"}[step.kind] if step.rounded else ""
    shown = f"{step.kind} {point}{' CONT' if zone else ''} Vel={speed} {unit} {data} Tool[1]:spindle Base[1]:fixture"
    stored = f"1:{step.kind}, 2:{point}, 3:{zone}, 5:{speed}, 7:{data}"
    yield f";FOLD {shown};%{{PE}}%R 8.3.38,%MKUKATPBASIS,%CMOVE,%V{step.kind},%P {stored}"
    yield from (
        "$BWDSTART=FALSE",
        f"{'PDAT_ACT=P' if step.kind == 'PTP' else 'LDAT_ACT=L'}{data}",
        f"FDAT_ACT=F{point}",
    )
    yield f"BAS(#{'PTP' if step.kind == 'PTP' else 'CP'}_PARAMS,{speed})"
    yield f"{step.kind} X{point} {zone}".rstrip()
    yield from (";ENDFOLD", "")


def home() -> Iterator[str]:
    stored = "1:PTP, 2:HOME, 3:, 5:30, 7:DEFAULT"
    yield f";FOLD PTP HOME Vel=30 % DEFAULT;%{{PE}}%R 8.3.38,%MKUKATPBASIS,%CMOVE,%VPTP,%P {stored}"
    yield from ("$BWDSTART=FALSE", "PDAT_ACT=PDEFAULT", "FDAT_ACT=FHOME", "BAS(#PTP_PARAMS,30)")
    yield from ("$H_POS=XHOME", "PTP XHOME", ";ENDFOLD")


def source() -> Iterator[str]:
    yield from (*header(), "DEF TAUGHT( )", ";FOLD INI;%{PE}", "  ;FOLD BASISTECH INI")
    yield from ("    GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )", "    INTERRUPT ON 3 ")
    yield from ("    BAS (#INITMOV,0 )", "  ;ENDFOLD (BASISTECH INI)", ";ENDFOLD (INI)", "")
    index = 0
    for line in PROGRAM:
        if isinstance(line, Step):
            index += 1
            yield from inline_form(index, line)
        else:
            yield from home() if line == "home" else [line]
    yield from ("", "END")


def data_list() -> Iterator[str]:
    yield from (
        *header(),
        "DEFDAT  TAUGHT",
        ";FOLD EXTERNAL DECLARATIONS;%{PE}%MKUKATPBASIS,%CEXT,%VCOMMON,%P",
    )
    yield from (
        ";FOLD BASISTECH EXT;%{PE}%MKUKATPBASIS,%CEXT,%VEXT,%P",
        "EXT  BAS (BAS_COMMAND  :IN,REAL  :IN )",
    )
    yield from ("DECL INT SUCCESS", ";ENDFOLD (BASISTECH EXT)", ";ENDFOLD (EXTERNAL DECLARATIONS)", "")
    points, q = taught()
    external = ",".join(f"E{i} 0.0" for i in range(1, 7))
    for index, (step, point, s, t) in enumerate(
        zip(STEPS, points, branch_of(ROBOT.nominal, q), negative_axes(q), strict=True), 1
    ):
        pose = ",".join(f"{key} {number(value)}" for key, value in zip("XYZABC", point, strict=True))
        yield f"DECL E6POS XP{index}={{{pose},S {s},T {t},{external}}}"
        yield f'DECL FDAT FP{index}={{TOOL_NO 1,BASE_NO 1,IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}}'
        if step.kind == "PTP":
            yield f"DECL PDAT PPDAT{index}={{VEL 30.0,ACC 100.0,APO_DIST 50.0,APO_MODE #CPTP,GEAR_JERK 50.0}}"
        else:
            blend = "2.0" if step.rounded else "100.0"
            yield (
                f"DECL LDAT LCPDAT{index}={{VEL {step.speed:g},ACC 100.0,APO_DIST {blend},APO_FAC 50.0,AXIS_VEL 100.0,"
                "AXIS_ACC 100.0,ORI_TYP #VAR,CIRC_TYP #BASE,JERK_FAC 50.0,GEAR_JERK 50.0,EXAX_IGN 0}"
            )
    yield from ("", "ENDDAT")


if __name__ == "__main__":
    for name, lines in (("taught.src", source()), ("taught.dat", data_list())):
        content = "".join(line + "\r\n" for line in lines)
        Path(__file__).with_name(name).write_bytes(content.encode("ascii"))
