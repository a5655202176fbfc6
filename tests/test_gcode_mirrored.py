"""Mirrored and scaled coordinates: G51.1 of a Fanuc, MIRROR and SCALE of a Sinumerik.

``Frames`` is another interpreter: it takes points through the frames one after the other, as the manuals describe them
(Fanuc, "programmable mirror image": x' = 2 c - x, the sense of an arc in a plane with one mirrored axis is reversed;
Siemens, "programmable mirroring" and "programmable scale factor").
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from gcode_writing import read, round_trip

from postproc.base.arrays import Floats
from postproc.languages.gcode import DIALECTS
from postproc.toolpath import Toolpath

DIALECT = {dialect.name: dialect for dialect in DIALECTS}
HEAD = {
    "fanuc": "O1\nG21 G90 G17 G54 G94\nT1 M6\nG0 X0. Y0. Z0.\nF300.\n",
    "sinumerik": "G71 G90 G17 G54 G94\nT1 D1\nG0 X0. Y0. Z0.\nF300\n",
}
PLANES = {17: ("X", "Y", "Z"), 18: ("Z", "X", "Y"), 19: ("Y", "Z", "X")}
Point = dict[str, float]


def factor(axis: str, by: float, centre: float = 0.0) -> Callable[[Point], Point]:
    return lambda point: {**point, axis: centre + by * (point[axis] - centre)}


def shifted(axis: str, by: float) -> Callable[[Point], Point]:
    return lambda point: {**point, axis: point[axis] + by}


def turned(angle: float) -> Callable[[Point], Point]:
    cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return lambda point: {
        **point, "X": cos * point["X"] - sin * point["Y"], "Y": sin * point["X"] + cos * point["Y"],
    }  # fmt: skip


@dataclass
class Frames:
    """The steps of the frame in force, the innermost last, and the factors of the axes."""

    steps: list[Callable[[Point], Point]] = field(default_factory=list)
    factors: dict[str, float] = field(default_factory=lambda: dict.fromkeys("XYZ", 1.0))

    def place(self, point: Point) -> list[float]:
        for step in reversed(self.steps):
            point = step(point)
        return [point[axis] for axis in "XYZ"]


class Drawn:
    """A program and where its motions end, lines from 1: text; ends: line -> place, middle of its arc or None."""

    def __init__(self, name: str, seed: int) -> None:
        self.chance, self.name = random.Random(seed), name
        self.lines = HEAD[name].splitlines()
        self.frames, self.centres = Frames(), dict[str, float]()
        self.here: Point = dict.fromkeys("XYZ", 0.0)
        self.plane, self.incremental, self.stated = 17, False, True
        self.ends: dict[int, tuple[list[float], list[float] | None]] = {}
        for _ in range(6):
            (self.mirror if name == "fanuc" else self.frame)()
            self.plane = self.chance.choice((17, 17, 18, 19))
            self.put(f"G{self.plane} G90")
            self.incremental, self.stated = False, False
            for _ in range(self.chance.randint(2, 5)):
                self.motion()

    @property
    def text(self) -> str:
        return "\n".join(self.lines) + "\nM30\n"

    def put(self, line: str) -> None:
        self.lines.append(line)

    def number(self, low: float = -50.0, high: float = 50.0) -> float:
        return round(self.chance.uniform(low, high), 3)

    def mirror(self) -> None:
        axes = self.chance.sample("XYZ", self.chance.randint(1, 2))
        if self.chance.random() < 0.6 or not self.centres:
            values = {axis: self.number() for axis in axes}
            self.centres |= values
            self.put("G90 G51.1 " + " ".join(f"{axis}{value:.3f}" for axis, value in values.items()))
        else:
            for axis in axes:
                self.centres.pop(axis, None)
            self.put("G90 G50.1 " + " ".join(f"{axis}0." for axis in axes))
        self.frames = Frames([factor(axis, -1.0, centre) for axis, centre in self.centres.items()])
        self.frames.factors |= dict.fromkeys(self.centres, -1.0)

    def frame(self) -> None:
        plain = all(value == 1.0 for value in self.frames.factors.values())
        kind = self.chance.choice(("TRANS", "MIRROR", "SCALE", *(["ROT"] if plain else [])))
        added = self.chance.random() < 0.5
        if not added:
            self.frames = Frames()
        axes = self.chance.sample("XYZ", self.chance.randint(1, 3))
        same = round(self.chance.uniform(0.4, 3.0), 2)
        if kind == "ROT":
            angle = self.number(-90, 90)
            self.frames.steps.append(turned(angle))
            words = f"Z{angle}"
        elif kind == "TRANS":
            values = {axis: self.number() for axis in axes}
            self.frames.steps += [shifted(axis, value) for axis, value in values.items()]
            words = " ".join(f"{axis}{value}" for axis, value in values.items())
        else:
            by = -1.0 if kind == "MIRROR" else same
            self.frames.steps += [factor(axis, by) for axis in axes]
            for axis in axes:
                self.frames.factors[axis] *= by
            words = " ".join(f"{axis}{0 if kind == 'MIRROR' else same}" for axis in axes)
        self.put(f"{'A' * added}{kind} {words}")

    def motion(self) -> None:
        if self.stated and self.chance.random() < 0.3:
            self.incremental = not self.incremental
            self.put("G91" if self.incremental else "G90")
        u, v, w = PLANES[self.plane]
        even = abs(abs(self.frames.factors[u]) - abs(self.frames.factors[v])) < 1e-12
        if self.stated and even and self.chance.random() < 0.5:
            return self.arc(u, v, w)
        axes = self.chance.sample("XYZ", self.chance.randint(1, 3)) if self.stated else "XYZ"
        self.stated = True
        there = {**self.here, **{axis: self.number() for axis in axes}}
        self.put("G1 " + self.words(there, axes))
        self.end(there)

    def words(self, there: Point, axes: str | list[str]) -> str:
        origin = self.here if self.incremental else dict.fromkeys("XYZ", 0.0)
        return " ".join(f"{axis}{there[axis] - origin[axis]:.4f}" for axis in axes)

    def arc(self, u: str, v: str, w: str) -> None:
        radius, begin = self.chance.uniform(5, 40), self.chance.uniform(0, 2 * np.pi)
        sweep = self.chance.uniform(0.3, 5.8) * self.chance.choice((1, -1))
        i, j = round(-radius * np.cos(begin), 4), round(-radius * np.sin(begin), 4)
        centre = {**self.here, u: self.here[u] + i, v: self.here[v] + j}

        def at(angle: float) -> Point:
            cos, sin = np.cos(angle), np.sin(angle)
            x, y = -i * cos + j * sin, -i * sin - j * cos
            return {**self.here, u: centre[u] + x, v: centre[v] + y}

        there = {**at(sweep), w: self.here[w] + (self.number(-5, 5) if self.chance.random() < 0.3 else 0.0)}
        there = {axis: round(value, 4) for axis, value in there.items()}
        half = {**at(sweep / 2), w: (self.here[w] + there[w]) / 2}
        letters = dict(zip("XYZ", "IJK", strict=True))
        if abs(sweep) < 3.0 and self.chance.random() < 0.4:
            size = np.hypot(i, j)
            how = f"R{size:.5f}" if self.name == "fanuc" else f"CR={size:.5f}"
        else:
            how = f"{letters[u]}{i:.4f} {letters[v]}{j:.4f}"
        self.put(f"G{3 if sweep > 0 else 2} {self.words(there, u + v + w)} {how}")
        self.end(there, half)

    def end(self, there: Point, half: Point | None = None) -> None:
        self.ends[len(self.lines)] = (
            self.frames.place(there),
            None if half is None else self.frames.place(half),
        )
        self.here = there


def middle_of_arc(path: Toolpath, row: int) -> Floats:
    begin, centre, normal = path.position[row - 1], path.arcs.centre[row], path.arcs.normal[row]
    angle, spoke = path.arcs.sweep[row] / 2, begin - centre
    rise = (path.position[row] - begin) @ normal / 2
    spoke = spoke - (spoke @ normal) * normal
    foot = begin - spoke
    middle = foot + np.cos(angle) * spoke + np.sin(angle) * np.cross(normal, spoke) + rise * normal
    return np.asarray(middle, dtype=np.float64)


@pytest.mark.parametrize("name", ["fanuc", "sinumerik"])
def test_points_are_where_another_interpreter_takes_them(name: str) -> None:
    for seed in range(60):
        drawn = Drawn(name, seed)
        path = read(DIALECT[name], drawn.text).toolpath
        rows = {int(line): row for row, line in enumerate(path.line)}
        for line, (end, half) in drawn.ends.items():
            row = rows[line]
            assert row not in path.constraints.refused, (seed, drawn.lines[line - 1], drawn.text)
            np.testing.assert_allclose(
                path.position[row] * 1e3, end, atol=1e-6, err_msg=f"{seed} {drawn.text}"
            )
            assert np.isfinite(path.arcs.sweep[row]) == (half is not None)
            if half is not None:
                np.testing.assert_allclose(
                    middle_of_arc(path, row) * 1e3, half, atol=0.01, err_msg=f"{seed} {line} {drawn.text}"
                )


@pytest.mark.parametrize("name", ["fanuc", "sinumerik"])
@pytest.mark.parametrize("seed", range(12))
def test_what_is_written_there_is_read_as_planned(name: str, seed: int) -> None:
    round_trip(DIALECT[name], Drawn(name, seed).text.encode(), seed)


@pytest.mark.parametrize(
    ("name", "text", "codes"),
    [
        ("fanuc", "G51.1 X0.\nG52 X5.\nG1 X1. Y1. Z1.\nG50.1 X0.\nG1 X1. Y1. Z1.\n", ["GCO019", "GCO019"]),
        ("fanuc", "G68 X0. Y0. R90.\nG52 X5.\nG1 X1. Y1. Z1.\nG69\nG1 X1. Y1. Z1.\n", ["GCO019", "GCO019"]),
        ("fanuc", "G51.1 X0.\nG68 X0. Y0. R90.\nG1 X1. Y1. Z1.\nG69\nG50.1 X0.\n", ["GCO019"]),
        ("fanuc", "G51.1 X0.\nG55\nG1 X1. Y1. Z1.\nG50.1 X0.\nG1 X1. Y1. Z1.\n", ["GCO019", ""]),
        ("fanuc", "G51.1\nG1 X1. Y1. Z1.\n", ["GCO019"]),
        ("fanuc", "G91 G51.1 X0.\nG90 G1 X1. Y1. Z1.\n", ["GCO019"]),
        ("fanuc", "G51.1 X0.\nG1 Y1.\nX1.\n", ["GCO002", ""]),
        ("fanuc", "G51.1 X0.\nG69\nG1 X1. Y1. Z1.\n", [""]),
        ("fanuc", "G50.1 X0.\nG1 X1. Y1. Z1.\n", [""]),
        ("fanuc", "G51.1 X0.\nG0 X1.\nG98 G81 X5. Z-3. R1.\n", ["GCO010"]),
        ("fanuc", "G51.1 X0.\nG43.4 H1\nG1 X1. Y1. Z1. A5.\n", ["GCO010"]),
        ("fanuc", "G101 X0.\nG1 X1. Y1. Z1.\n", ["GCO010"]),
        ("fanuc", "G51 P2.\nG1 X1. Y1. Z1.\nG50\nX1. Y1. Z1.\n", ["GCO010", ""]),
        ("sinumerik", "SCALE X2\nG1 X1 Y1\nG2 X11 I5 J0\n", ["", "GCO010"]),
        ("sinumerik", "SCALE X2 Y2\nG1 X1 Y1\nCIP X9 Y1 I1=5 J1=5\n", ["", "GCO010"]),
        ("sinumerik", "SCALE X2 Y2\nAROT Z30\nG1 X1 Y1 Z1\nSCALE\nX1 Y1 Z1\n", ["GCO019", ""]),
        ("sinumerik", "SCALE X0\nG1 X1 Y1 Z1\n", ["GCO019"]),
        ("sinumerik", "MIRROR X0\nTRAORI\nG1 X1 Y1 Z1 A3=0 B3=0 C3=1\n", ["GCO010"]),
    ],
)
def test_what_is_not_known_there_is_refused(name: str, text: str, codes: list[str]) -> None:
    path = read(DIALECT[name], HEAD[name] + text).toolpath
    feed = [
        row for row in range(1, len(path)) if path.line[row] > HEAD[name].count("\n") and path.kind[row] != 0
    ]
    found = [path.constraints.refused[row].code if row in path.constraints.refused else "" for row in feed]
    assert found[: len(codes)] == codes
