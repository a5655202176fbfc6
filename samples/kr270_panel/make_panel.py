"""Writes panel.src: four pockets in an aluminium panel, posted as a CAM system posts them for a KUKA KR 270.

The program is made from the tables below; nothing is random, so that a second run gives the same bytes.
Lengths in mm and N/mm2 as on the shop floor, except where a name says otherwise.

    python samples/kr270_panel/make_panel.py [--check]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from postproc.geometry import Poses, abc_from_rotation
from postproc.model import StiffnessModel
from postproc.robot.description import find_robot, load_robot
from postproc.robot.inverse import inverse

PLATE = (900, 600, 30)
BASE = Poses.from_abc([1.25, 0.45, 0.8], np.radians([-90, 0, 0]))  # corner of the plate, Z = 0 on its upper face
TOOL = Poses.from_abc([0.3, 0.0, 0.18], np.radians([0, 90, 0]))  # spindle square to the flange, tool +Z towards the tip
SPIN = np.radians(-45)  # A of the upright tool: places the flange beside the spindle, clear of A5 = 0
STATUS = 6  # of the whole program: wrist in front, elbow up, A5 < 0

ROBOT = load_robot(find_robot("kuka_kr270"))

DIAMETER, TEETH, SPEED = 16.0, 3, 12000  # end mill, teeth, 1/min
CLEAR, NEAR = 50.0, 0.5  # height of moves across the plate; distance above the material where the ramp begins
RAPID, PLUNGE = 0.25, 0.05  # m/s
TOLERANCE = {"rough": 0.1, "finish": 0.01}  # chord error
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

    @property
    def length(self) -> float:
        return 4 * (self.half_x + self.half_y) - (8 - 2 * np.pi) * self.radius

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (N, 2) and outward normals (N, 2) at t in [0, 9]: half side, corner, side, ..., half side."""
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
        """Parameters of one lap whose chords stay within ``tolerance`` of the corners."""
        turn = min(2 * np.arccos(1 - tolerance / self.radius), np.radians(12))
        sides = (2 * (self.half_x - self.radius), 2 * (self.half_y - self.radius))
        lap = [0.0]
        for piece in range(9):
            side = sides[piece // 2 % 2] * (0.5 if piece in (0, 8) else 1.0)
            count = np.pi / 2 / turn if piece % 2 else side / longest
            count = int(np.ceil(count - 1e-9))
            lap.extend(piece + np.arange(1, count + 1) / max(count, 1))
        return np.array(lap)


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


POCKET_A = Ring(250, 150, 130, 85, 20)
POCKET_B = Ring(660, 150, 80, 80, 80)
POCKET_C = Ring(230, 430, 150, 30, 30)
POCKET_D = Ring(640, 420, 110, 75, 40)
OPERATIONS = [
    Operation("POCKET A ROUGHING", "rough", POCKET_A, (-5, -10), 8.0, 0.12, leave=0.5),
    Operation("POCKET B ROUGHING", "rough", POCKET_B, (-5, -10), 8.0, 0.12, leave=0.5),
    Operation("POCKET C ADAPTIVE ROUGHING", "rough", POCKET_C, (-12,), 2.5, 0.10, leave=0.5),
    Operation("POCKET D ROUGHING", "rough", POCKET_D, (-4, -8), 7.0, 0.10, leave=0.5),
    Operation("POCKET A WALL FINISHING", "wall", POCKET_A, (-10,), 0.5, 0.08),
    Operation("POCKET B WALL FINISHING", "wall", POCKET_B, (-10,), 0.5, 0.08),
    Operation("POCKET C WALL FINISHING", "wall", POCKET_C, (-12,), 0.5, 0.08),
    Operation("POCKET D FLANK 5-AXIS PREFINISHING", "flank", POCKET_D, (-8,), 1.2, 0.08, 0.4, (9.0, 6.0)),
    Operation("POCKET D FLANK 5-AXIS FINISHING", "flank", POCKET_D, (-8,), 0.4, 0.08, 0.0, (9.0, 6.0)),
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
    """Path speed [m/s]."""
    return fz * TEETH * SPEED / 60e3


@dataclass
class Program:
    """The lines of the program and, for the check, the pose, force and kind of every Cartesian motion."""

    lines: list[str] = field(default_factory=list)
    points: list[np.ndarray] = field(default_factory=list)  # X, Y, Z, A, B, C in the base
    forces: list[np.ndarray] = field(default_factory=list)  # in the feed frame; zero in the air
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    speed: float = -1.0

    def add(self, *lines: str) -> None:
        self.lines.extend(lines)

    def set_speed(self, speed: float) -> None:
        if speed != self.speed:
            self.add(f"$VEL.CP={speed:.4f}")
        self.speed = speed

    def set_force(self, force: np.ndarray | None) -> None:
        self.force = np.zeros(3) if force is None else np.round(force, 1)
        x, y, z = self.force
        self.add(";FORCE OFF" if force is None else f";FORCE {x:.1f} {y:.1f} {z:.1f} @feed")

    def move(self, point: np.ndarray, exact: bool = False) -> None:
        """A LIN that states all six components, or only Z where nothing else changes (plunge, retract)."""
        point = np.round(point, 3) + 0.0
        keys = range(6)
        if self.points and np.array_equal(np.delete(point, 2), np.delete(self.points[-1], 2)):
            keys = [2]
        target = ",".join(f"{'XYZABC'[k]} {point[k]:.3f}" for k in keys)
        self.add(f"LIN {{{target}}}" + ("" if exact else " C_DIS"))
        self.points.append(point)
        self.forces.append(self.force)

    def air(self, *points: np.ndarray) -> None:
        """Up, across and down: the first two rounded, the last one exact, at plunge feed."""
        for index, point in enumerate(points):
            self.set_speed(RAPID if index < len(points) - 1 else PLUNGE)
            self.move(point, exact=index == len(points) - 1)

    def retract(self) -> None:
        self.set_force(None)
        self.set_speed(RAPID)
        self.move(at_height(self.points[-1], CLEAR), exact=True)

    def cut(self, points: np.ndarray, force: np.ndarray, speed: float, last: bool = True) -> None:
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
    laps = int(np.ceil((min(edge.half_x, edge.half_y) - 6.0) / job.width))
    rings = [edge.inside((laps - k) * job.width) for k in range(laps + 1)] if laps else [edge]
    lap = rings[0].steps(TOLERANCE["rough"], 20.0)
    top = 0.0
    for floor in job.levels:
        turns = int(np.ceil((top - floor) / RAMP_DEPTH))
        way = np.concatenate([lap[1:] / 9 + turn for turn in range(turns)])
        start = upright(rings[0].at(np.zeros(1))[0], top + NEAR)[0]
        program.air(at_height(start, CLEAR), start)
        inner = np.tile(rings[0].at(lap[1:])[0], (turns, 1))
        depth = (top - floor) / turns
        slot = mean_force(depth, DIAMETER, RAMP_FZ)
        program.cut(upright(inner, top + NEAR + (floor - top - NEAR) * way / turns), slot, feed(RAMP_FZ), False)
        program.cut(upright(rings[0].at(lap[1:])[0], floor), slot / 2, feed(RAMP_FZ), False)
        spiral = []
        for one, two in [*zip(rings, rings[1:], strict=False), (rings[-1], rings[-1])]:
            t = two.steps(TOLERANCE["rough"], 30.0)[1:]
            weight = (t / 9)[:, None]
            spiral.append((1 - weight) * one.at(t)[0] + weight * two.at(t)[0])
        full = mean_force(top - floor, job.width, job.fz)
        program.cut(upright(np.concatenate(spiral), floor), full, feed(job.fz))
        program.retract()
        top = floor


def contour(program: Program, job: Operation) -> None:
    """One lap along the wall with arcs in and out; on a flank the tool leans with the wall."""
    radius, floor = DIAMETER / 2, job.levels[-1]
    longest = 4.0 if job.kind == "flank" else 40.0
    t = np.append(job.ring.steps(TOLERANCE["finish"], longest), 9.0 + 0.2)
    wall, out = job.ring.at(np.where(t > 9, t - 9, t))
    lean = np.radians(job.tilt[0] + job.tilt[1] * np.sin(2 * np.pi * t / 9 * 2))[:, None]
    tip = wall - (radius * np.cos(lean) + job.leave) * out
    path = posed(np.column_stack([tip, floor + radius * np.sin(lean)]), lean, out)
    arc, bend = np.linspace(0.0, np.pi / 2, 9), 12.0
    side = bend * np.column_stack([1 - np.sin(arc), np.cos(arc)])  # leaves along +X, ends straight into the pocket
    head = np.repeat(path[:1], 9, axis=0)
    tail = np.repeat(path[-1:], 9, axis=0)
    head[:, :2] += np.column_stack([-side[:, 1], side[:, 0]])
    tail[:, :2] += np.column_stack([side[::-1, 1], side[::-1, 0]])
    start = head[0]
    program.air(at_height(start, CLEAR), at_height(start, start[2]))
    force = mean_force(-floor, job.width, job.fz)
    program.cut(np.concatenate([head[1:], path[1:], tail[1:]]), force, feed(job.fz))
    program.retract()


def posed(tip: np.ndarray, lean: np.ndarray, out: np.ndarray) -> np.ndarray:
    """Points (N, 6): the spindle leans from the vertical towards ``out``; its spin is held."""
    down = -np.column_stack([np.sin(lean) * out, np.cos(lean)])
    x = np.array([np.cos(SPIN), np.sin(SPIN), 0.0])
    x = x - (down @ x)[:, None] * down
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    frames = np.stack([x, np.cross(down, x), down], axis=-1)
    return np.column_stack([tip, np.degrees(abc_from_rotation(frames))])


def axes(program: Program) -> np.ndarray:
    """Axis angles (N, 6) [rad] along the program."""
    x = np.array(program.points)
    flange = BASE @ Poses.from_abc(x[:, :3] / 1e3, np.radians(x[:, 3:])) @ TOOL.inverse()
    found = inverse(ROBOT.nominal, flange, np.full(len(x), STATUS), np.zeros((len(x), 6)))
    return found.q


def panel() -> tuple[Program, list[tuple[str, int, int]]]:
    program, parts = Program(), []
    program.set_force(None)
    for number, job in enumerate(OPERATIONS, 1):
        first = len(program.points)
        program.add(";", f";OPERATION {number}: {job.name}")
        program.add(f";TOOL T1 ENDMILL D{DIAMETER:.0f} Z{TEETH} S{SPEED}")
        (rough if job.kind == "rough" else contour)(program, job)
        parts.append((job.name, first, len(program.points)))
    return program, parts


def text(program: Program) -> Iterator[str]:
    start = np.degrees(axes(program)[0])
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


def check(program: Program, parts: list[tuple[str, int, int]]) -> None:
    """Prints axis ranges, and force and linear deflection (eq. 5 at the end of each motion) by operation."""
    q, force, x = axes(program), np.array(program.forces), np.array(program.points)
    low, high = np.degrees(q.min(axis=0)), np.degrees(q.max(axis=0))
    print("axes:", *(f"A{i + 1} {low[i]:.1f}..{high[i]:.1f}" for i in range(6)))
    spare = np.minimum(low - np.degrees(ROBOT.limits[:, 0]), np.degrees(ROBOT.limits[:, 1]) - high)
    print(f"least distance to a limit {spare.min():.1f} deg, largest step {np.degrees(np.ptp(q[:2], 0).max()):.1f}")
    z = -Poses.from_abc(x[:, :3], np.radians(x[:, 3:])).rotation[:, :, 2]
    ahead = np.diff(x[:, :3], axis=0, prepend=x[:1, :3])
    ahead -= np.sum(ahead * z, axis=1, keepdims=True) * z
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
    in_base = force[:, :1] * ahead + force[:, 1:2] * np.cross(z, ahead) + force[:, 2:] * z
    wrench = np.column_stack([in_base @ BASE.rotation.T, np.zeros_like(force)])
    bent = StiffnessModel.from_robot(ROBOT).linear_deflection(q, wrench, TOOL)[:, :3]
    bent = np.linalg.norm(bent, axis=1) * 1e3
    cutting = force.any(axis=1)
    for name, first, last in [*parts, ("ALL", 0, len(x))]:
        rows = np.flatnonzero(cutting[first:last]) + first
        size = np.linalg.norm(force[rows], axis=1)
        cuts = np.count_nonzero(np.diff(cutting[first:last].astype(int), prepend=0) == 1)
        print(f"{name:36s} {last - first:5d} LIN, {len(rows):5d} cutting in {cuts:2d} cuts,", end=" ")
        print(f"{size.min():.0f}..{size.max():.0f} N, {bent[rows].min():.2f}..{bent[rows].max():.2f} mm")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--check", action="store_true", help="print axis ranges, forces and deflections")
    arguments = parser.parse_args()
    made, operations = panel()
    content = "".join(line + "\r\n" for line in text(made))
    Path(__file__).with_name("panel.src").write_bytes(content.encode("ascii"))
    if arguments.check:
        check(made, operations)
