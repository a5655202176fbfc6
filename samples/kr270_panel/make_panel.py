"""Writes panel.src: four pockets in an aluminium panel, posted as a CAM system posts them for a KUKA KR 270.

The program is made from the tables below; nothing is random, so that a second run gives the same bytes.
Lengths in mm and N/mm2 as on the shop floor, except where a name says otherwise.

    python samples/kr270_panel/make_panel.py
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from postproc.base.geometry import Poses, abc_from_rotation
from postproc.robot.description import find_robot, load_robot
from postproc.robot.inverse import inverse

PLATE = (900, 600, 30)
ROBOT = load_robot(find_robot("kuka_kr270"))
BASE = Poses.from_abc([1.25, 0.45, 0.8], np.radians([-90, 0, 0]))  # a corner of the plate, Z = 0 on its top
TOOL = Poses.from_abc([0.3, 0, 0.18], np.radians([0, 90, 0]))  # spindle square to the flange, tip-ward = +Z
SPIN = np.radians(-45)  # A of the upright tool: places the flange beside the spindle, clear of A5 = 0
STATUS = 6  # of the whole program: wrist in front, elbow up, A5 < 0

DIAMETER, TEETH, SPEED = 16.0, 3, 12000  # end mill, teeth, 1/min
CLEAR, NEAR = 50.0, 1.0  # heights: of moves across the plate; of the ramp's begin over the material
RAPID, PLUNGE = 0.25, 0.05  # m/s
TOLERANCE = {"rough": 0.2, "finish": 0.02}  # chord error
LEAD = 12.0  # radius of the arcs onto and off a wall
RAMP_DEPTH, RAMP_FZ = 2.5, 0.06  # at most so deep a lap; feed per tooth in the ramp

# EN AW-7075-T6, cutting (t, r, a) in N/mm2 and edge (t, r, a) in N/mm: doi 10.1186/s10033-021-00536-9
CUTTING, EDGE = (767.0, 168.8, 222.0), (27.7, 26.6, 0.7)


@dataclass(frozen=True)
class Ring:
    """A rectangle with round corners, run counter-clockwise from the middle of its lower side."""

    x: float
    y: float
    half_x: float
    half_y: float
    radius: float

    def inside(self, distance: float) -> Ring:
        hx, hy = self.half_x - distance, self.half_y - distance
        return Ring(self.x, self.y, hx, hy, min(self.radius, hx, hy))

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (N, 2) and outward normals (N, 2) at t in [0, 9]: half side, corner, ..., half side."""
        piece = np.minimum(t.astype(int), 8)
        part = t - piece
        corner, on_arc = piece // 2, piece % 2 == 1
        across, along = self.half_x - self.radius, self.half_y - self.radius
        part = np.where(piece == 0, 0.5 + part / 2, np.where(piece == 8, part / 2, part))
        angle = np.pi / 2 * (corner - 1 + np.where(on_arc, part, 0.0))
        normal = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        ends = np.array([[-across, -along], [across, -along], [across, along], [-across, along]])
        start, end = ends[corner % 4], ends[(corner + 1) % 4]
        centre = np.where(on_arc[:, None], end, start + part[:, None] * (end - start))
        return np.array([self.x, self.y]) + centre + self.radius * normal, normal

    def steps(self, tolerance: float, longest: float) -> np.ndarray:
        """Parameters of one lap; chords leave the corners by ``tolerance`` at most."""
        turn = min(2 * np.arccos(1 - tolerance / self.radius), np.radians(22.5))
        sides = 2 * (np.array([self.half_x, self.half_y]) - self.radius)
        t = [np.zeros(1)]
        for piece in range(9):
            side = sides[piece // 2 % 2] / (2 if piece in (0, 8) else 1)
            count = int(np.ceil((np.pi / 2 / turn if piece % 2 else side / longest) - 1e-9))
            t.append(piece + np.arange(1, count + 1) / max(count, 1))
        return np.concatenate(t)


@dataclass(frozen=True)
class Operation:
    """One pocket operation.  ``ring``: the pocket's edge at its floor; ``levels``: floors, downwards."""

    name: str
    kind: str  # rough | wall | flank
    ring: Ring
    levels: tuple[float, ...]
    width: float  # ae, radial engagement
    fz: float  # feed per tooth
    leave: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)  # deg, mean and swing of the wall's lean along the contour


POCKET_A = Ring(240, 150, 110, 70, 20)
POCKET_B = Ring(640, 150, 75, 75, 75)
POCKET_C = Ring(230, 430, 150, 30, 30)
POCKET_D = Ring(640, 400, 100, 60, 40)
OPERATIONS = [
    Operation("POCKET A ROUGHING", "rough", POCKET_A, (-5, -10), 8.0, 0.12, leave=0.8),
    Operation("POCKET B ROUGHING", "rough", POCKET_B, (-8,), 6.0, 0.08, leave=0.8),
    Operation("POCKET C ADAPTIVE ROUGHING", "rough", POCKET_C, (-12,), 2.2, 0.10, leave=0.8),
    Operation("POCKET D ROUGHING", "rough", POCKET_D, (-8,), 4.5, 0.08, leave=0.8),
    Operation("POCKET A WALL FINISHING", "wall", POCKET_A, (-10,), 0.8, 0.08),
    Operation("POCKET B WALL FINISHING", "wall", POCKET_B, (-8,), 0.8, 0.10),
    Operation("POCKET C WALL FINISHING", "wall", POCKET_C, (-12,), 0.8, 0.08),
    Operation("POCKET D FLANK 5-AXIS PREFINISHING", "flank", POCKET_D, (-8,), 0.8, 0.10, 0.6, (9.0, 6.0)),
    Operation("POCKET D FLANK 5-AXIS FINISHING", "flank", POCKET_D, (-8,), 0.6, 0.11, 0.0, (9.0, 6.0)),
]


def mean_force(depth: float, width: float, fz: float) -> np.ndarray:
    """Mean force on the tool (3,) [N] in the feed frame, climb milling (width = diameter: a slot).

    Linear edge-force model, closed form between entry and exit angle; z from the tip back to the spindle,
    so that a right-hand helix, which pulls the cutter out of its holder, gives a negative Fz.
    """
    (kt, kr, ka), (et, er, ea) = CUTTING, EDGE

    def primitive(p: float) -> np.ndarray:
        s, c, s2, c2 = np.sin(p), np.cos(p), np.sin(2 * p), np.cos(2 * p)
        x = fz / 4 * (kt * c2 - kr * (2 * p - s2)) + (-et * s + er * c)
        y = fz / 4 * (kt * (2 * p - s2) + kr * c2) - (et * c + er * s)
        return TEETH * depth / (2 * np.pi) * np.array([x, y, ka * fz * c - ea * p])

    return primitive(np.pi) - primitive(np.pi - np.arccos(1 - 2 * width / DIAMETER))


def feed(fz: float) -> float:
    """Path speed [m/s] of a feed per tooth."""
    return fz * TEETH * SPEED / 60e3


@dataclass
class Program:
    """The lines of the program, and the points of its Cartesian motions."""

    lines: list[str] = field(default_factory=list)
    points: list[np.ndarray] = field(default_factory=list)  # X, Y, Z, A, B, C in the base
    speed: float = -1.0

    def set_speed(self, speed: float) -> None:
        if speed != self.speed:
            self.lines.append(f"$VEL.CP={speed:.4f}")
        self.speed = speed

    def set_force(self, force: np.ndarray | None) -> None:
        numbers = "OFF" if force is None else " ".join(f"{f:.1f}" for f in force) + " @feed"
        self.lines.append(f";FORCE {numbers}")

    def move(self, point: np.ndarray, exact: bool = False) -> None:
        """A LIN that states all six components, or only Z where nothing else changes (plunge, retract)."""
        point = np.round(point, 3) + 0.0
        if self.points and np.array_equal(point, self.points[-1]):
            return
        keys = [0, 1, 2, 3, 4, 5]
        if self.points and np.array_equal(np.delete(point, 2), np.delete(self.points[-1], 2)):
            keys = [2]
        target = ",".join(f"{'XYZABC'[k]} {point[k]:.3f}" for k in keys)
        self.lines.append(f"LIN {{{target}}}" + ("" if exact else " C_DIS"))
        self.points.append(point)

    def approach(self, point: np.ndarray) -> None:
        self.set_speed(RAPID)
        self.move(at_height(point, CLEAR))
        self.set_speed(PLUNGE)
        self.move(point, exact=True)

    def retract(self) -> None:
        self.set_force(None)
        self.set_speed(RAPID)
        self.move(at_height(self.points[-1], CLEAR), exact=True)

    def cut(self, points: np.ndarray, force: np.ndarray, speed: float, last: bool = False) -> None:
        self.set_force(force)
        self.set_speed(speed)
        for index, point in enumerate(points):
            self.move(point, exact=last and index == len(points) - 1)


def at_height(point: np.ndarray, z: float) -> np.ndarray:
    return np.concatenate([point[:2], [z], point[3:]])


def upright(xy: np.ndarray, z: np.ndarray | float) -> np.ndarray:
    """Points (N, 6) with the tool straight down."""
    rest = np.broadcast_to(np.degrees([SPIN, 0.0, np.pi]), (len(xy), 3))
    return np.column_stack([xy, np.broadcast_to(z, len(xy)), rest])


def rough(program: Program, job: Operation) -> None:
    """Ramp along the innermost ring, one lap to level it, then a spiral outwards and a last closed lap."""
    edge = job.ring.inside(DIAMETER / 2 + job.leave)
    room = min(edge.half_x, edge.half_y) - 5.0
    laps = int(np.ceil(room / job.width))
    rings = [edge.inside(room * (1 - k / laps)) for k in range(laps + 1)]
    ring, share = lap(rings[0], rings[0])
    spiral = np.concatenate([lap(*pair)[0] for pair in itertools.pairwise([*rings, edge])])
    top = 0.0
    for floor in job.levels:
        turns = int(np.ceil((top - floor) / RAMP_DEPTH))
        start = upright(ring[-1:], top + NEAR)[0]
        program.approach(start)
        down = np.concatenate([turn + share for turn in range(turns)]) / turns
        ramp = upright(np.tile(ring, (turns, 1)), top + NEAR + (floor - top - NEAR) * down)
        slot = mean_force((top - floor) / turns, DIAMETER, RAMP_FZ)
        program.cut(ramp, slot, feed(RAMP_FZ))
        program.cut(upright(ring, floor), slot / 2, feed(RAMP_FZ))
        full = mean_force(top - floor, job.width, job.fz)
        program.cut(upright(spiral, floor), full, feed(job.fz), last=True)
        program.retract()
        top = floor


def lap(one: Ring, two: Ring) -> tuple[np.ndarray, np.ndarray]:
    """One lap of a spiral from a ring to the next: points (N, 2) and the share of the lap at each of them."""
    t = two.steps(TOLERANCE["rough"], 80.0)
    outer = two.at(t)[0]
    share = np.cumsum(np.linalg.norm(np.diff(outer, axis=0), axis=1))
    share /= share[-1]
    return outer[1:] + (1 - share)[:, None] * (one.at(t)[0] - outer)[1:], share


def contour(program: Program, job: Operation) -> None:
    """One lap along the wall with arcs in and out; on a flank the tool leans with the wall."""
    floor = job.levels[-1]
    t = np.append(job.ring.steps(TOLERANCE["finish"], 5.0 if job.kind == "flank" else 60.0), 9.2)
    wall, out = job.ring.at(np.where(t > 9, t - 9, t))
    lean = np.radians(job.tilt[0] + job.tilt[1] * np.sin(4 * np.pi * t / 9))[:, None]
    tip = wall - (DIAMETER / 2 * np.cos(lean) + job.leave) * out
    path = posed(np.column_stack([tip, floor + DIAMETER / 2 * np.sin(lean)]), lean, out)
    arc = np.linspace(0.0, np.pi / 2, 9)  # the lap begins along +X, with the pocket at +Y
    away = LEAD * np.column_stack([np.cos(arc), 1 - np.sin(arc)])
    lead_in, lead_out = np.repeat(path[:1], 9, axis=0), np.repeat(path[-1:], 9, axis=0)
    lead_in[:, :2] += away * [-1, 1]
    lead_out[:, :2] += away[::-1]
    program.approach(lead_in[0])
    way = np.concatenate([lead_in[1:], path[1:], lead_out[1:]])
    program.cut(way, mean_force(-floor, job.width, job.fz), feed(job.fz), last=True)
    program.retract()


def posed(tip: np.ndarray, lean: np.ndarray, out: np.ndarray) -> np.ndarray:
    """Points (N, 6): the spindle leans from the vertical towards ``out``; its spin is held."""
    down = -np.column_stack([np.sin(lean) * out, np.cos(lean)])
    x = np.array([np.cos(SPIN), np.sin(SPIN), 0.0])
    x = x - (down @ x)[:, None] * down
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    frames = np.stack([x, np.cross(down, x), down], axis=-1)
    return np.column_stack([tip, np.degrees(abc_from_rotation(frames))])


def axes(points: list[np.ndarray]) -> np.ndarray:
    """Axis angles (N, 6) [rad] at points (N, 6) of the program."""
    x = np.array(points)
    flange = BASE @ Poses.from_abc(x[:, :3] / 1e3, np.radians(x[:, 3:])) @ TOOL.inverse()
    return inverse(ROBOT.nominal, flange, np.full(len(x), STATUS), np.zeros((len(x), 6))).q


def panel() -> Program:
    program = Program()
    program.set_force(None)
    for number, job in enumerate(OPERATIONS, 1):
        program.lines += [";", f";OPERATION {number}: {job.name}"]
        program.lines += [f";TOOL T1 ENDMILL D{DIAMETER:.0f} Z{TEETH} S{SPEED}"]
        (rough if job.kind == "rough" else contour)(program, job)
    return program


def text(program: Program) -> Iterator[str]:
    start = np.degrees(axes([at_height(program.points[0], 150.0)])[0])
    home = "PTP {" + ",".join(f"A{i} {a:.5f}" for i, a in enumerate(start, 1)) + "}"
    yield from ("&ACCESS RVP", "&REL 1", "&COMMENT PANEL 900X600X30 EN AW-7075-T6")
    yield from ("&PARAM TEMPLATE = C:\\KRC\\Roboter\\Template\\vorgabe", "&PARAM EDITMASK = *")
    yield from ("DEF panel()", ";FOLD INI", "BAS(#INITMOV,0)", ";ENDFOLD (INI)", "")
    yield f";STOCK {PLATE[0]} X {PLATE[1]} X {PLATE[2]} MM, ZERO: CORNER, TOP FACE"
    yield f";TOOL T1: END MILL DIAMETER {DIAMETER:.3f} MM, {TEETH} TEETH"
    yield from ("$BASE=BASE_DATA[1]", "$TOOL=TOOL_DATA[1]", "$ORI_TYPE=#VAR", "$APO.CDIS=0.2", "$ADVANCE=5")
    yield from ("BAS(#VEL_PTP,20)", home, "$OUT[17]=TRUE ;SPINDLE ON", "WAIT SEC 5.0")
    yield from program.lines
    yield from (";", "$OUT[17]=FALSE ;SPINDLE OFF", home, "END")


def main() -> None:
    program = panel()
    q = np.degrees(axes(program.points))
    spare = np.minimum(q - np.degrees(ROBOT.limits[:, 0]), np.degrees(ROBOT.limits[:, 1]) - q).min()
    if not (spare > 10 and np.abs(q[:, 4]).min() > 20):
        raise SystemExit(
            f"{spare:.1f} deg to an axis limit, A5 {np.abs(q[:, 4]).min():.1f} deg from zero: too near"
        )
    content = "".join(line + "\r\n" for line in text(program))
    Path(__file__).with_name("panel.src").write_bytes(content.encode("ascii"))
    print(f"panel.src: {len(program.points)} LIN; {spare:.1f} deg or more to every axis limit;", end=" ")
    print(", ".join(f"A{i + 1} {q[:, i].min():.1f}..{q[:, i].max():.1f}" for i in range(6)))


if __name__ == "__main__":
    main()
