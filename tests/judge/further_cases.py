"""More programs: cuts that are entered and left without a stop, forces that change on arcs, closed contours, short
motions, unstated approximations, several tools, a turned robot on a track."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from .cases import CELL, CUT, FIVE_AXIS, OFF, Case, gcode, krl, pose, track

Place = tuple[float, float, float]
START: Place = (0, 0, 0)
SLANT: Place = (-30, -20, 30)


def contour(
    points: list[tuple[float, float]], suffix: str, distance: float, approach: str = "", leave: str = "",
    above: Place = (0, 0, 50),
) -> Callable[[Path], Path]:  # fmt: skip
    """Straight motions through ``points`` with the ``suffix``, from the start; how it is entered and left."""
    last = points[-1]
    return krl(
        f"LIN {pose(*above)}", f"LIN {pose(*START)} {approach}".strip(), CUT,
        *(f"LIN {pose(x, y, 0)} {suffix}" for x, y in points[:-1]), f"LIN {pose(*last, 0)} {leave}".strip(),
        OFF, f"LIN {pose(*last, 50)}", head=(f"$APO.CDIS={distance}",),
    )  # fmt: skip


SQUARE = [(150.0, 0.0), (150.0, 100.0), (0.0, 100.0), (0.0, 2.0)]


def half_circle(suffix: str) -> Callable[[Path], Path]:
    """Two quarters of a circle; the force steps between them."""
    return krl(
        f"LIN {pose(0, 0, 50)}", f"LIN {pose(*START)}", CUT, f"LIN {pose(60, 0, 0)} {suffix}".strip(),
        f"CIRC {pose(88.284, 11.716, 0)},{pose(100, 40, 0)} {suffix}".strip(), ";FORCE -40 80 -60 @feed",
        f"CIRC {pose(88.284, 68.284, 0)},{pose(60, 80, 0)} {suffix}".strip(), f"LIN {pose(0, 80, 0)}", OFF,
        f"LIN {pose(0, 80, 50)}", head=("$APO.CDIS=0.5",),
    )  # fmt: skip


def whole_circle() -> Callable[[Path], Path]:
    return krl(f"LIN {pose(0, 0, 50)}", f"LIN {pose(*START)}", CUT, f"CIRC {pose(30, 30, 0)},{pose(60, 0, 0)},CA 360",
               OFF, f"LIN {pose(0, 0, 50)}")  # fmt: skip


def short_motions() -> Callable[[Path], Path]:
    angle = np.linspace(0, 2 * np.pi, 400)[1:]
    return contour([(30 - 30 * np.cos(a), 30 * np.sin(a)) for a in angle], "C_DIS", 0.5)


def waiting(*between: str) -> Callable[[Path], Path]:
    """The square, with statements after its corners."""
    points = [f"LIN {pose(x, y, 0)} C_DIS" for x, y in SQUARE]
    body = [line for i, point in enumerate(points) for line in (point, *between[i : i + 1])]
    return krl(
        f"LIN {pose(0, 0, 50)}", f"LIN {pose(*START)}", CUT, *body, OFF, f"LIN {pose(*SQUARE[-1], 50)}",
        head=("$APO.CDIS=2",),
    )  # fmt: skip


def against_the_force(tolerance: float) -> Callable[[Path], Path]:
    """Corners to the right, where the force of the feed frame pushes the tool to the left: its correction turns back
    as the path turns on, as fast as the shortest motions can follow within 0.05 mm, not within 0.02."""
    corners = [(0, 0), (100, 0), (100, -80)]
    return krl(
        f"LIN {pose(0, -60, 40)}", f"LIN {pose(0, -60, -5)}", CUT,
        *(f"LIN {pose(x, y, -5)} C_DIS" for x, y in corners), f"LIN {pose(0, -80, -5)}", OFF,
        f"LIN {pose(0, -80, 50)}", cell=CELL.replace("tolerance: 0.02", f"tolerance: {tolerance}"),
        head=("$APO.CDIS=0.5",),
    )  # fmt: skip


def blended(word: str) -> Callable[[Path], Path]:
    return gcode(
        "G21 G90 G17 G54", "T1 M6", word, "G0 X0. Y0. Z20.", "G1 Z0. F600", "(FORCE -150 260 -60 @FEED)",
        "G1 X100. F1800", "G1 Y60.", "G1 X0.", "(FORCE OFF)", "G1 Z20. F3000",
        cell=FIVE_AXIS.replace("fanuc", "linuxcnc"),
    )  # fmt: skip


def turned_track(begin: float, end: float) -> Callable[[Path], Path]:
    """As ``track``, of a robot that is mounted turned against its direction."""

    def build(folder: Path) -> Path:
        program = track(begin, end, "cell")(folder)
        with (folder / "cell.yaml").open("a") as cell:
            cell.write("robot_base: {x: 20, y: -30, z: 10, a: 25, b: 2, c: -3}\n")
        return program

    return build


def two_tools() -> Callable[[Path], Path]:
    other = "  2: {x: 60, y: 40, z: 320, a: 10, b: 45, c: 5, axis: +z}\nbases:"
    return krl(
        f"LIN {pose(0, 0, 50)}", f"LIN {pose(*START)}", CUT, f"LIN {pose(60, 0, 0)}", OFF, f"LIN {pose(60, 0, 50)}",
        "$TOOL=TOOL_DATA[2]", f"LIN {pose(60, 0, 60)}", f"LIN {pose(60, 0, 0)}", CUT, f"LIN {pose(60, 90, 0)}", OFF,
        f"LIN {pose(60, 90, 50)}", cell=CELL.replace("bases:", other),
    )  # fmt: skip


def entered(*approach: str, leave: str, motions: tuple[str, ...]) -> Callable[[Path], Path]:
    """A cut from (0, 0, 0) through straight ``motions``, with these in air before and behind it."""
    return krl(*approach, CUT, *motions, OFF, leave)


ARC_ON = (
    f"LIN {pose(-20, -20, 0)}",
    f"CIRC {pose(-5.858, -14.142, 0)},{pose(*START)}",
)
ARC_OFF = f"CIRC {pose(5.858, 114.142, 0)},{pose(20, 120, 0)}"
IDLE = (
    f"LIN {pose(100, 0, 0)}",
    ";FORCE 0 0 0 @feed",
    f"LIN {pose(150, 0, 0)}",
    CUT,
    f"LIN {pose(250, 0, 0)}",
)


FURTHER: list[Case] = [
    Case("entered by PTP", entered(f"PTP {pose(*START)}", leave=f"PTP {pose(100, 0, 50)}",
                                   motions=(f"LIN {pose(100, 0, 0)}",))),
    Case("entered and left by arcs in air", entered(*ARC_ON, leave=ARC_OFF, motions=(f"LIN {pose(0, 100, 0)}",))),
    Case("no force between two cuts", entered(f"LIN {pose(*START)}", leave=f"LIN {pose(250, 0, 50)}", motions=IDLE)),
    Case("entered from above, C_DIS 3", contour(SQUARE, "C_DIS", 3, "C_DIS")),
    Case("entered in line, C_DIS 3", contour(SQUARE, "C_DIS", 3, "C_DIS", above=(-40, 0, 0))),
    Case("left, C_DIS 3", contour(SQUARE, "C_DIS", 3, leave="C_DIS", above=SLANT)),
    Case("entered and left, C_DIS 3", contour(SQUARE, "C_DIS", 3, "C_DIS", "C_DIS", above=SLANT)),
    Case("one motion, entered and left", contour([(200, 0)], "", 3, "C_DIS", "C_DIS", above=SLANT)),
    Case("closed, C_DIS 2", contour([(100, 0), (100, 60), (0, 60), (0, 0)], "C_DIS", 2)),
    Case("corners, stops of the advance run", waiting("WAIT SEC 0", "$OUT[3]=TRUE", "CONTINUE\n$OUT[3]=FALSE")),
    Case("corners, C_VEL", contour(SQUARE, "C_VEL", 0.5)),
    Case("corners against the force", against_the_force(0.05)),
    Case("399 short motions", short_motions()),
    Case("force steps between arcs, C_DIS", half_circle("C_DIS")),
    Case("force steps between arcs, exact", half_circle("")),
    Case("circle by CA 360", whole_circle()),
    Case("corners, G64", blended("G64"), judged="position"),
    Case("two tools", two_tools()),
    *(Case(f"turned robot, track {a} to {b}", turned_track(a, b)) for a, b in ((900, 900), (800, 1200))),
]  # fmt: skip
