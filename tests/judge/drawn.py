"""Programs, cells and arms drawn at random, of the kinds that the readers here know.

``python -m tests.judge --drawn COUNT [--seed S]``: what the command writes for them before the judge.  A defect is an
output with exit 0 that is out of tolerance or has motions backwards, and, with any exit, an error that ``verify`` does
not see.

Drawn are: link lengths, limits' branch, compliances and the spring of a KUKA arm; base, tool, robot_base; straight and
round motions of 2 to 150 mm with corners of all angles, ramps, leaning tools, even turns of the tool; exact stops,
C_DIS of several distances, stops of the advance run, G61 and G64; forces in all four frames with moments, steps of
force, air between cuts, two tools and two bases; tolerances, ramps of the force.  Not drawn: what the path of a
controller leaves open (PTP under force, free splines, tracks).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from .cases import ROBOTS, Case, Outcome, gcode, krl
from .motion import from_abc
from .robot import rotations

ABOVE = np.array([0.0, 0.0, 50.0])
STOPS = ["WAIT SEC 0", "$OUT[3]=TRUE", "CONTINUE\n$OUT[3]=FALSE", "$VEL.CP=0.03"]
HOME = "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}"


SEEN = 1e-3
"""[mm] by which ``verify`` may differ from the judge."""


def defects(outcome: Outcome) -> list[str]:
    """What is wrong in silence, in words."""
    if (
        outcome.verdict is None
    ):  # refused, or not to be judged: a pose that its inverse kinematics does not reach
        return []
    wrong = list(outcome.failed) if outcome.exit == 0 else []
    wrong = [
        word for word in wrong if not word.endswith("stops")
    ]  # what is inserted under G61 stops, and is told
    if outcome.verify is None:  # where force and place do not converge it gives no figure, and says so
        return [word for word in wrong if word != "verify rejects it: VER007"]
    off = abs(outcome.verify - 1e3 * outcome.verdict.after.largest)
    return wrong + ([f"verify is {off:.4f} mm off"] if off > SEEN else [])


def drawn(seed: int) -> Case:
    """The case of a seed; which of the languages, by its parity."""
    rng = np.random.default_rng(seed)
    build, judged = _krl(rng, np.random.default_rng([seed, 1])) if seed % 2 == 0 else _gcode(rng)
    name = f"drawn {seed}, {'KRL' if seed % 2 == 0 else 'G-code'}"
    return Case(name, build, judged=judged)


def _arm(rng: np.random.Generator) -> str:
    """A robot file: the KR 270's with other lengths and compliances, with its spring or without."""
    text = (ROBOTS / "kuka_kr270.yaml").read_text()
    for name, value in (("d1", 750), ("a1", 350), ("a2", 1250), ("a3", -55), ("d4", 1100), ("d6", 230)):
        text = re.sub(rf"\b{name}: {value}\b", f"{name}: {value * rng.uniform(0.8, 1.2):.1f}", text)
    text = re.sub(
        r"(c\d:\s*\{value: )([\d.e-]+)",
        lambda found: f"{found[1]}{float(found[2]) * 3 ** rng.uniform(-1, 1):.4e}",
        text,
    )
    if rng.random() < 0.4:
        text = text[: text.index("  - effect: gravity_compensator")]
    return text


def _frame(values: np.ndarray, angles: np.ndarray) -> str:
    words = [f"{k}: {v:.2f}" for k, v in zip("xyz", values, strict=True)]
    return "{" + ", ".join([*words, *(f"{k}: {v:.2f}" for k, v in zip("abc", angles, strict=True))]) + "}"


def _cell(rng: np.random.Generator, tools: int, more: str = "") -> str:
    lines, diameter = ["robot: arm.yaml", "tools:"], rng.choice([8, 16, 20])
    for number in range(1, tools + 1):
        place = rng.uniform([60, -40, 150], [250, 40, 350])
        turned = rng.uniform([-20, 10, -20], [20, 60, 20])
        lines.append(f"  {number}: {_frame(place, turned)[:-1]}, axis: +z, diameter: {diameter}}}")
    lines.append("bases:")
    for number in (1, 2):
        place = rng.uniform([1250, -500, 350], [1700, 300, 800])
        lines.append(f"  {number}: {_frame(place, rng.uniform(-1, 1, 3) * [40, 4, 4])}")
    if rng.random() < 0.3:
        lines.append(f"robot_base: {_frame(rng.uniform(-80, 80, 3), rng.uniform(-3, 3, 3))}")
    lines.append("start: [0, -90, 110, 0, 40, 0]")
    lines.append(f"tolerance: {rng.choice([0.01, 0.02, 0.05])}")
    if rng.random() < 0.3:
        lines.append(f"force_ramp: {rng.uniform(2, 20):.1f}")
    lines.append("max_correction: 8\nmax_growth: 20")
    return "\n".join(lines) + "\n" + more


class _Walk:
    """A cutter's path in base axes [mm], tool orientation as lean and turn about the vertical [deg]."""

    def __init__(self, rng: np.random.Generator, leans: bool) -> None:
        self.rng, self.leans = rng, leans
        self.place = rng.uniform([0, 0, -20], [60, 60, 0])
        self.heading = rng.uniform(0, 360)
        self.lean, self.turn = (rng.uniform(2, 15), rng.uniform(-30, 30)) if leans else (0.0, 0.0)

    def step(self) -> np.ndarray:
        """The end of the next motion; turns by little, by a corner, or back."""
        rng = self.rng
        self.heading += rng.choice(
            [rng.normal(0, 8), rng.uniform(-100, 100), 90, -90], p=[0.6, 0.2, 0.1, 0.1]
        )
        length = rng.choice([rng.uniform(2, 8), rng.uniform(10, 60), rng.uniform(60, 150)], p=[0.3, 0.4, 0.3])
        middle = np.array([60.0, 60.0])
        if np.linalg.norm(self.place[:2] - middle) > 200:
            self.heading = np.degrees(np.arctan2(*(middle - self.place[:2])[::-1])) + rng.uniform(-30, 30)
        angle, rise = np.radians(self.heading), rng.choice([0, 0, 0.1, -0.1])
        way = np.array([np.cos(angle), np.sin(angle), rise])
        self.place = np.round(self.place + length * way, 3)
        if self.leans:
            self.lean = float(np.clip(self.lean + rng.normal(0, 1.5), 1, 25))
            self.turn += rng.normal(0, 3)
        return self.place

    def via(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """A point beside the middle of a chord: an arc of 20 to 200 deg."""
        chord = (end - start)[:2]
        half = self.rng.uniform(10, 100) * self.rng.choice([-1, 1])
        bulge = 0.5 * np.linalg.norm(chord) * np.tan(0.5 * np.radians(half))
        across = np.array([-chord[1], chord[0]]) / np.linalg.norm(chord)
        return np.append(0.5 * (start + end)[:2] + bulge * across, 0.5 * (start + end)[2])

    def abc(self) -> tuple[float, ...]:
        """KUKA's angles of a tool that points down, leaned about a horizontal line."""
        axis = np.array([np.cos(np.radians(self.turn)), np.sin(np.radians(self.turn)), 0.0])
        turned = rotations((axis * np.radians(self.lean))[None])[0] @ from_abc(0, 0, 180)
        b = np.arctan2(-turned[2, 0], np.hypot(turned[0, 0], turned[1, 0]))
        a, c = np.arctan2(turned[1, 0], turned[0, 0]), np.arctan2(turned[2, 1], turned[2, 2])
        return tuple(np.degrees([a, b, c]))


def _force(rng: np.random.Generator) -> tuple[str, str]:
    """Numbers and frame of a FORCE comment."""
    force = rng.normal(size=3) * [150, 150, 60] * rng.choice([0.3, 0.6, 1.2])
    moment = rng.normal(size=3) * 4 if rng.random() < 0.3 else []
    frame = rng.choice(["feed", "base", "world", "tool"], p=[0.6, 0.2, 0.1, 0.1])
    return " ".join(f"{v:.1f}" for v in (*force, *moment)), str(frame)


def _pose(place: np.ndarray, walk: _Walk) -> str:
    a, b, c = walk.abc()
    x, y, z = place
    return f"{{X {x:.3f},Y {y:.3f},Z {z:.3f},A {a:.4f},B {b:.4f},C {c:.4f}}}"


def _krl(rng: np.random.Generator, stops: np.random.Generator) -> tuple[Callable[[Path], Path], str]:
    """stops: draws where the program stops its advance run, in one of three programs."""
    stopping = 0.2 if stops.random() < 1 / 3 else 0.0
    tools = int(rng.integers(1, 3))
    style = rng.choice(["exact", "flowing", "mixed"], p=[0.3, 0.5, 0.2])
    lines: list[str] = []
    for cut in range(int(rng.integers(1, 4))):
        walk = _Walk(rng, bool(rng.random() < 0.5))
        if cut and rng.random() < 0.5:
            lines.append(f"$BASE=BASE_DATA[{rng.integers(1, 3)}]")
            lines.append(f"$TOOL=TOOL_DATA[{rng.integers(1, tools + 1)}]")
        above = walk.place + ABOVE
        lines += [f"PTP {_pose(above, walk)}", f"LIN {_pose(walk.place, walk)}"]
        numbers, frame = _force(rng)
        lines.append(f";FORCE {numbers} @{frame}")
        for number in range(int(rng.integers(2, 12))):
            if number and rng.random() < 0.15:
                numbers, frame = _force(rng)
                lines.append(f";FORCE {numbers} @{frame}")
            flows = style == "flowing" or (style == "mixed" and rng.random() < 0.5)
            suffix = " C_DIS" if flows else ""
            start = walk.place
            end = walk.step()
            if rng.random() < 0.2:
                via = walk.via(start, end)
                lines.append(f"CIRC {_pose(via, walk)},{_pose(end, walk)}{suffix}")
            else:
                lines.append(f"LIN {_pose(end, walk)}{suffix}")
            if stops.random() < stopping:
                lines += stops.choice(STOPS).split("\n")
        lines.append(f"LIN {_pose(walk.step(), walk)}")
        lines += [";FORCE OFF", f"LIN {_pose(walk.place + ABOVE, walk)}"]
    cell, arm = _cell(rng, tools), _arm(rng)
    head = (f"$APO.CDIS={rng.choice([0.1, 0.5, 1, 3])}",)
    made = krl(*lines, cell=cell, home=HOME, head=head)

    def build(folder: Path) -> Path:
        (folder / "arm.yaml").write_text(arm)
        return made(folder)

    return build, "orientation"


def _gcode(rng: np.random.Generator) -> tuple[Callable[[Path], Path], str]:
    leans = bool(rng.random() < 0.4)
    lines = ["G21 G90 G17 G54", "T1 M6"]
    lines += ["G43.4 H1"] if leans else [str(rng.choice(["G61", "G64"]))]
    for cut in range(int(rng.integers(1, 3))):
        if cut and not leans and rng.random() < 0.5:
            lines.append(f"G{rng.integers(54, 56)}")
        walk = _Walk(rng, leans)

        def words(place: np.ndarray, walk: _Walk = walk) -> str:
            x, y, z = place
            turned = f" B{walk.lean:.3f} C{walk.turn:.3f}" if leans else ""
            return f"X{x:.3f} Y{y:.3f} Z{z:.3f}{turned}"

        lines += [f"G0 {words(walk.place + ABOVE)}", "S9000 M3", f"G1 {words(walk.place)} F1200"]
        numbers, frame = _force(rng)
        lines.append(f"(FORCE {numbers} @{frame})")
        for number in range(int(rng.integers(2, 12))):
            if number and rng.random() < 0.15:
                numbers, frame = _force(rng)
                lines.append(f"(FORCE {numbers} @{frame})")
            start = walk.place
            end = walk.step()
            if rng.random() < 0.25 and not leans:
                chord, turn = (end - start)[:2], int(rng.integers(2, 4))
                offset = rng.uniform(-1, 1) * np.linalg.norm(chord)
                across = np.array([-chord[1], chord[0]]) / np.linalg.norm(chord)
                i, j = 0.5 * chord + offset * across
                lines.append(f"G{turn} {words(end)} I{i:.4f} J{j:.4f} F1800")
            else:
                lines.append(f"G1 {words(end)} F1800")
        lines += ["(FORCE OFF)", f"G1 {words(walk.place + ABOVE)} F3000"]
    dialect = "fanuc" if leans else "linuxcnc"
    cell = _cell(rng, 1, f"orientation: {{a: 0, b: 0, c: 180}}\ndialect: {{name: {dialect}}}\n")
    made, arm = gcode(*lines, cell=cell), _arm(rng)

    def build(folder: Path) -> Path:
        (folder / "arm.yaml").write_text(arm)
        return made(folder)

    return build, "axis" if leans else "position"
