"""python -m tests.planes [--count N] [--seed S]: planes that programs state (G68, G68.2 with G53.1, CYCLE800) as the
reader has them, against an interpreter that shares no code with it.

It is written from the manuals' description alone, in lists of floats: a program is drawn as steps, the interpreter runs
the steps, the reader the text.
"""

from __future__ import annotations

import argparse
import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from postproc.base.document import Document
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.gcode import DIALECTS

DIALECT = {dialect.name: dialect for dialect in DIALECTS}
HEAD = {
    "fanuc": "O1\nG21 G90 G17 G54 G94\nT1 M6\nG43 H1\nG0 X0. Y0. Z0.\nF60.\n",
    "sinumerik": "G71 G90 G17 G54 G94\nT1 D1\nG0 X0 Y0 Z0\nF60\n",
}
DOWN = np.array([0.0, 0.0, math.pi])
Matrix = list[list[float]]


def about(axis: int, degrees: float) -> Matrix:
    """A right-handed turn about X, Y or Z (0, 1, 2)."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = [[float(i == j) for j in range(3)] for i in range(3)]
    one, two = (axis + 1) % 3, (axis + 2) % 3
    turn[one][one] = turn[two][two] = c
    turn[one][two], turn[two][one] = -s, s
    return turn


def product(one: Matrix, other: Matrix) -> Matrix:
    return [[sum(one[i][k] * other[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def applied(turn: Matrix, point: list[float]) -> list[float]:
    return [sum(turn[i][k] * point[k] for k in range(3)) for i in range(3)]


@dataclass
class Interpreted:
    """The frame in force, and the ends of the motions with the tool's axis, both in the base; None where the end is not
    known: axes turn where a plane has ended."""

    turn: Matrix = field(default_factory=lambda: about(0, 0.0))
    origin: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    at: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    axis: list[float] = field(default_factory=lambda: [0.0, 0.0, 1.0])
    ends: list[tuple[list[float], list[float]] | None] = field(default_factory=list)

    def go(self, point: list[float]) -> None:
        self.at = [o + p for o, p in zip(self.origin, applied(self.turn, point), strict=True)]
        self.ends.append((self.at, self.axis))

    def place(self, turn: Matrix, origin: list[float]) -> None:
        self.origin = [o + p for o, p in zip(self.origin, applied(self.turn, origin), strict=True)]
        self.turn = product(self.turn, turn)

    def clear(self) -> None:
        self.turn, self.origin = about(0, 0.0), [0.0, 0.0, 0.0]


def number(random_: random.Random, size: float = 80.0) -> float:
    return round(random_.uniform(-size, size), random_.choice((0, 1, 3)))


def moves(random_: random.Random, run: Interpreted) -> Iterator[str]:
    point = [number(random_) for _ in range(3)]
    run.go(point)
    yield "G1 X{:.3f} Y{:.3f} Z{:.3f}".format(*point)
    for _ in range(random_.randint(0, 3)):
        changed = random_.sample(range(3), random_.randint(1, 3))
        for axis in changed:
            point[axis] = number(random_)
        run.go(point)
        yield " ".join(["G1", *(f"{'XYZ'[axis]}{point[axis]:.3f}" for axis in changed)])


def fanuc_plane(random_: random.Random, run: Interpreted) -> Iterator[str]:
    """A plane, motions in it, and its end; the tool stays along a tilted plane until rotary words bring it back."""
    if random_.random() < 0.5:
        axis = random_.randrange(3)
        yield f"G{ {2: 17, 1: 18, 0: 19}[axis] }"
        centre, angle = [number(random_) for _ in range(3)], number(random_, 180.0)
        centre[axis] = 0.0
        turn = about(axis, angle)
        run.place(turn, [c - t for c, t in zip(centre, applied(turn, centre), strict=True)])
        words = [f"{'XYZ'[k]}{centre[k]:.3f}" for k in range(3) if k != axis]
        yield " ".join(["G68", *words, f"R{angle:.3f}"])
        yield from moves(random_, run)
        run.clear()
        yield "G69"
        yield "G17"
    else:
        origin, angles = [number(random_) for _ in range(3)], [number(random_, 170.0) for _ in range(3)]
        turn = product(product(about(2, angles[0]), about(0, angles[1])), about(2, angles[2]))
        run.place(turn, origin)
        yield "G68.2 " + " ".join(f"{w}{v:.3f}" for w, v in zip("XYZIJK", [*origin, *angles], strict=True))
        if random_.random() < 0.7:
            run.axis = [row[2] for row in run.turn]
            yield "G53.1"
        yield from moves(random_, run)
        run.clear()
        yield "G69"
        run.axis = [0.0, 0.0, 1.0]
        yield "G0 B0. C0."
        run.ends.append(None)


MODES = {57: (0, 1, 2), 45: (0, 2, 1), 54: (1, 0, 2), 30: (1, 2, 0), 39: (2, 0, 1), 27: (2, 1, 0)}
"""_MODE -> the axes of the three turns, as posts name them: ABC, ACB, BAC, BCA, CAB, CBA."""


def sinumerik_plane(random_: random.Random, run: Interpreted) -> Iterator[str]:
    for added in range(random_.randint(1, 2)):
        if not added:
            run.clear()
        mode = random_.choice(list(MODES))
        before, angles, after = ([number(random_, size) for _ in range(3)] for size in (50.0, 170.0, 50.0))
        turn = about(0, 0.0)
        for axis, angle in zip(MODES[mode], angles, strict=True):
            turn = product(turn, about(axis, angle))
        run.place(turn, [b + a for b, a in zip(before, applied(turn, after), strict=True)])
        run.axis = [row[2] for row in run.turn]
        numbers = ",".join(f"{value:.3f}" for value in (*before, *angles, *after))
        state = random_.choice((0, 100000, 200000)) + added
        yield f'CYCLE800(1,"TC",{state},{mode},{numbers},{random_.choice((-1, 1))},100,1)'
    yield from moves(random_, run)
    if random_.random() < 0.7:
        run.clear()
        run.axis = [0.0, 0.0, 1.0]
        yield 'CYCLE800(1,"TC",0,57,0,0,0,0,0,0,0,0,0,-1,100,1)'
        yield from moves(random_, run)


PLANES = {"fanuc": fanuc_plane, "sinumerik": sinumerik_plane}


def drawn(name: str, seed: int) -> tuple[str, Interpreted]:
    random_, run = random.Random(f"{name} {seed}"), Interpreted()
    lines = []
    for _ in range(random_.randint(1, 4)):
        lines += PLANES[name](random_, run)
    head = HEAD[name].replace("Z0.\n", "Z0. B0. C0.\n") if name == "fanuc" else HEAD[name]
    return head + "\n".join(lines) + "\n", run


def read(name: str, text: str) -> Program:
    return DIALECT[name].read((Document(Path("part.nc"), text.encode()),), ReadingSettings(orientation=DOWN))


def differences(name: str, text: str, run: Interpreted) -> tuple[list[str], int]:
    """Motions that are claimed elsewhere than the interpreter has them; how many are claimed."""
    path = read(name, text).toolpath
    found, claimed = [], 0
    for row, expected_end in enumerate(run.ends, start=1):
        if row in path.constraints.refused or not np.isfinite(path.position[row]).all():
            continue
        claimed += 1
        if expected_end is None:
            found.append(f"line {path.line[row]}: an end that is not known")
            continue
        end, axis = expected_end
        tool = path.rotation[row]
        # the tool points down in the base where its frame's z is up, and is turned no further than that takes
        expected = math.acos(min(1.0, max(-1.0, axis[2])))
        down = np.diag([1.0, -1.0, -1.0])
        turned = math.acos(min(1.0, max(-1.0, (np.trace(tool @ down.T) - 1) / 2)))
        if np.abs(path.position[row] * 1e3 - end).max() > 1e-6:
            found.append(f"line {path.line[row]}: {path.position[row] * 1e3} for {end}")
        if np.abs(tool[:, 2] + axis).max() > 1e-9 or abs(turned - expected) > 1e-6:
            found.append(f"line {path.line[row]}: tool along {tool[:, 2]} for {axis}")
    return found, claimed


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.planes", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="programs a control [1000]")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for name in PLANES:
        motions = claimed = differ = 0
        for seed in range(options.seed, options.seed + options.count):
            text, run = drawn(name, seed)
            found, here = differences(name, text, run)
            claimed, differ = claimed + here, differ + bool(found)
            motions += len(run.ends) - run.ends.count(None)
            if found:
                print(text, *found, sep="\n")
        print(
            f"{name}: {options.count} programs, {motions} motions, {claimed} claimed, {differ} programs differ"
        )


if __name__ == "__main__":
    main()
