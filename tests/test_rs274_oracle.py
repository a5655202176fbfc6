"""LinuxCNC's own interpreter, rs274, as the judge of every end point and arc.

``POSTPROC_RS274_PROGRAMS`` says how many programs are made up (60 without it).  rs274 prints four decimals of the
program's unit, in coordinates of the offset in force without that of G92, which it states apart.
"""

import os
import random
import re
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.base.geometry import on_arc
from postproc.languages.gcode import DIALECTS
from postproc.toolpath import Kind

RS274 = shutil.which("rs274")
needs_rs274 = pytest.mark.skipif(
    RS274 is None, reason="rs274 is missing: install the package linuxcnc-uspace"
)
LINUXCNC = next(one for one in DIALECTS if one.name == "linuxcnc")
CASES = Path(__file__).parent / "programs" / "linuxcnc"
COUNT = int(os.environ.get("POSTPROC_RS274_PROGRAMS", "60"))
NEAR = 1e-4 * (1 + 1e-6)
_CALL = re.compile(r"^\s*\d+ N\S*\s+([A-Z0-9_]+)\(([^)]*)\)", re.M)
_AXES = {"XY": (0, 1, 2), "XZ": (2, 0, 1), "YZ": (1, 2, 0)}


class Canon(NamedTuple):
    """A motion of rs274: end and, of arcs, two points on the way [m]; ``unit`` [m] of its numbers and of the shift."""

    kind: Kind
    end: np.ndarray
    between: np.ndarray | None
    unit: float
    centre: np.ndarray | None = None
    turn: float = 0.0


def canonical(program: Path, folder: Path) -> list[Canon] | None:
    """What rs274 makes of a program; None where it does not accept it."""
    (folder / "tool.tbl").write_text("".join(f"T{n} P{n} D0.0 Z0.0 ;\n" for n in range(1, 100)))
    # Offsets G54 to G59.3, inches: the motions must not depend on them.
    rows = [f"{5221 + 20 * n + i}\t{(n + 1) * (i + 1) * 0.5}\n" for n in range(9) for i in range(3)]
    (folder / "fresh.var").write_text("5161\t0.0\n" + "".join(rows))
    command = [str(RS274), "-g", "-n", "2", "-t", "tool.tbl", "-v", "fresh.var", str(program)]
    done = subprocess.run(command, cwd=folder, capture_output=True, timeout=60, check=False)
    text = done.stdout.decode("latin-1")
    if (
        done.returncode
        or "executing" not in (text + done.stderr.decode("latin-1"))
        or "PROGRAM_END" not in text
    ):
        return None
    motions: list[Canon] = []
    unit, stated, axes, shift, here = 1e-3, 1e-3, _AXES["XY"], np.zeros(3), np.zeros(3)
    for name, arguments in _CALL.findall(text):
        if name == "USE_LENGTH_UNITS":
            unit = 25.4e-3 if "INCH" in arguments else 1e-3
        elif name == "SELECT_PLANE":
            axes = _AXES[arguments[-2:]]
        elif name == "SET_G92_OFFSET":
            shift, stated = np.array([float(word) for word in arguments.split(",")[:3]]) * unit, unit
        elif name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED"):
            here = np.array([float(word) for word in arguments.split(",")[:3]]) * unit + shift
            motions.append(
                Canon(Kind.PTP if name == "STRAIGHT_TRAVERSE" else Kind.LIN, here, None, max(unit, stated))
            )
        elif name == "ARC_FEED":
            one, two, c1, c2, turn, third = (float(word) * unit for word in arguments.split(",")[:6])
            end, centre = np.zeros(3), here.copy()
            end[list(axes)] = one, two, third
            end += shift
            centre[list(axes[:2])] = (c1 + shift[axes[0]], c2 + shift[axes[1]])
            rounds = round(turn / unit)
            motions.append(_arc(here, end, centre, axes, rounds, max(unit, stated)))
            here = end
    return motions


def _arc(
    begin: np.ndarray, end: np.ndarray, centre: np.ndarray, axes: tuple, rounds: int, unit: float
) -> Canon:
    """The arc's points after a third and two thirds of its angle, by its own trigonometry."""
    u, v, w = axes
    first = np.arctan2(begin[v] - centre[v], begin[u] - centre[u])
    last = np.arctan2(end[v] - centre[v], end[u] - centre[u])
    sense = 1 if rounds > 0 else -1
    angle = (sense * (last - first)) % (2 * np.pi)
    if np.hypot(end[u] - begin[u], end[v] - begin[v]) < 2e-4 * 25.4e-3:
        angle = 2 * np.pi
    angle += 2 * np.pi * (abs(rounds) - 1)
    radius = np.hypot(begin[u] - centre[u], begin[v] - centre[v])
    points = []
    for share in (1 / 3, 2 / 3):
        at = first + sense * angle * share
        point = np.zeros(3)
        point[u], point[v] = centre[u] + radius * np.cos(at), centre[v] + radius * np.sin(at)
        point[w] = begin[w] + share * (end[w] - begin[w])
        points.append(point)
    return Canon(Kind.CIRC, end, np.array(points), unit, centre, sense * angle)


def agree(program: Path, folder: Path) -> int:
    """Compares the motions of a program that rs274 accepts; how many ends were compared.

    Where a coordinate is not known here, because an offset changed that only the control knows, there is nothing to
    compare; what is compared may not be less than rs274 moves.
    """
    canon = canonical(program, folder)
    if canon is None:
        return 0
    path = LINUXCNC.read((Document(program, program.read_bytes()),)).toolpath
    rows = [
        row
        for row in range(len(path))
        if row not in path.constraints.refused or path.constraints.refused[row].code != "GCO025"
    ]
    assert len(rows) == len(canon), f"{len(rows)} motions, rs274 has {len(canon)}"
    compared, before = 0, 0.0
    for row, motion in zip(rows, canon, strict=True):
        where = f"line {path.line[row]}"
        assert path.kind[row] == motion.kind, where
        known = np.isfinite(path.position[row])
        np.testing.assert_allclose(
            path.position[row][known], motion.end[known], rtol=0, atol=NEAR * motion.unit, err_msg=where
        )
        compared += bool(known.all())
        if motion.between is not None and row not in path.constraints.refused:
            begin = path.position[row - 1]
            # The begin has four decimals of the unit that was in force there.
            for share, point in zip((1 / 3, 2 / 3), motion.between, strict=True):
                at = on_arc(
                    begin[None], path.position[row][None], path.arcs.centre[row][None], path.arcs.normal[row][None],
                    path.arcs.sweep[row][None], np.array([share]),
                )  # fmt: skip
                np.testing.assert_allclose(
                    np.ravel(at), point, rtol=0, atol=3 * NEAR * max(motion.unit, before), err_msg=where
                )
            plane = np.abs(path.arcs.normal[row]) < 0.5
            np.testing.assert_allclose(
                path.arcs.centre[row][plane],
                motion.centre[plane],
                rtol=0,
                atol=NEAR * motion.unit,
                err_msg=where,
            )
            assert np.sign(path.arcs.normal[row].sum()) == np.sign(motion.turn), where
            assert abs(path.arcs.sweep[row] - abs(motion.turn)) < 1e-2, where
        before = motion.unit
    return compared


class Made:
    """Makes up programs that LinuxCNC accepts, and keeps account of where they are."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.lines: list[str] = []
        self.here = np.zeros(3)
        self.shift = np.zeros(3)
        self.relative = self.absolute_centres = False
        self.inch = False
        self.plane = 17

    def text(self) -> str:
        self.lines += ["%", "G21 G90 G17 G54 G94 F500"]
        self.jump("G0")
        for _ in range(self.random.randint(5, 40)):
            step = self.random.choices(
                (self.line, self.arc, self.mode, self.offset, self.noise), (40, 35, 15, 6, 4)
            )[0]
            step()
        self.lines += ["M2", "%"]
        return "\n".join(self.lines) + "\n"

    def number(self, value: float) -> str:
        text = f"{value:.{self.random.choice((4, 5, 6))}f}"
        shape = self.random.random()
        if shape < 0.2:
            text = text.rstrip("0")
        if shape < 0.1 and value >= 0:
            text = "+" + text
        return text

    def word(self, letter: str, value: float) -> tuple[str, float]:
        """A word, and the value that its digits have."""
        text = self.number(value)
        name = letter.lower() if self.random.random() < 0.2 else letter
        return name + self.random.choice(("", "", " ")) + text, float(text)

    def put(self, *words: str) -> None:
        words = tuple(word for word in words if word)
        glue = self.random.choice(("", " ", "  ", "\t"))
        # A number must not run into a following one: words begin with letters, so nothing is needed.
        line = glue.join(words)
        if self.random.random() < 0.1:
            line = f"N{self.random.randint(1, 9999)} " + line
        if self.random.random() < 0.1:
            line += self.random.choice((" (G1 X99)", " ; Y7", "(a)"))
        self.lines.append(line)

    def target(self, end: np.ndarray, which: list[int]) -> list[str]:
        """Words for these axes; ``here`` becomes what they say."""
        words = []
        for axis in which:
            base = self.here[axis] if self.relative else 0.0
            word, value = self.word("XYZ"[axis], end[axis] - base)
            words.append(word)
            self.here[axis] = base + value
        self.random.shuffle(words)
        return words

    def place(self) -> np.ndarray:
        size = 4.0 if self.inch else 100.0
        return np.array([self.random.uniform(-size, size) for _ in range(3)])

    def jump(self, code: str) -> None:
        self.put(code, *self.target(self.place(), [0, 1, 2]))

    def line(self) -> None:
        which = self.random.sample([0, 1, 2], self.random.randint(1, 3))
        self.put(self.random.choice(("G1", "g01", "G0", "G1")), *self.target(self.place(), which))

    def arc(self) -> None:
        u, v, w = _AXES[{17: "XY", 18: "XZ", 19: "YZ"}[self.plane]]
        code = self.random.choice(("G2", "G3", "g02", "G03"))
        radius = self.random.uniform(0.5, 3.0) if self.inch else self.random.uniform(5, 60)
        angle, sweep = self.random.uniform(0, 2 * np.pi), self.random.uniform(0.2, 6.0)
        end = self.here.copy()
        if self.random.random() < 0.4:
            end[w] += self.random.uniform(-1, 1)
        begin = self.here.copy()
        if self.random.random() < 0.3:
            # By its radius: end first, then a radius that reaches it.
            chord = self.random.uniform(0.4, 1.8) * radius
            end[u], end[v] = begin[u] + chord * np.cos(angle), begin[v] + chord * np.sin(angle)
            words = self.target(end, [u, v] + [w] * bool(end[w] != begin[w]))
            size = self.random.choice((1, -1)) * radius
            self.put(code, *words, self.word("R", size)[0])
            return
        words, centre = [], begin.copy()
        for axis, offset in ((u, radius * np.cos(angle)), (v, radius * np.sin(angle))):
            base = begin[axis] if not self.absolute_centres else 0.0
            word, value = self.word("IJK"[axis], begin[axis] + offset - base)
            words.append(word)
            centre[axis] = base + value
        more = [w] * bool(end[w] != begin[w])
        if self.random.random() < 0.2:
            ends = self.target(end, more)
        else:
            turn = sweep if code[-1] == "3" else -sweep
            du, dv = begin[u] - centre[u], begin[v] - centre[v]
            end[u] = centre[u] + du * np.cos(turn) - dv * np.sin(turn)
            end[v] = centre[v] + du * np.sin(turn) + dv * np.cos(turn)
            ends = self.target(end, [u, v, *more])
        turns = f"P{self.random.randint(1, 3)}" if self.random.random() < 0.15 else ""
        self.put(code, *ends, *words, turns)

    def mode(self) -> None:
        choice = self.random.randrange(4)
        if choice == 0:
            self.plane = self.random.choice((17, 18, 19))
            self.put(f"G{self.plane}")
        elif choice == 1:
            self.relative = not self.relative
            self.put("G91" if self.relative else "G90")
        elif choice == 2:
            self.absolute_centres = not self.absolute_centres
            self.put("G90.1" if self.absolute_centres else "G91.1")
        else:
            self.inch = not self.inch
            factor = 1 / 25.4 if self.inch else 25.4
            self.here, self.shift = self.here * factor, self.shift * factor
            self.put("G20" if self.inch else "G21")

    def offset(self) -> None:
        choice = self.random.randrange(3)
        axes = self.random.sample([0, 1, 2], self.random.randint(1, 3))
        if choice == 0:
            self.put(f"G{self.random.choice((54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3))}")
            was, self.relative = self.relative, False
            if was:
                self.put("G90")
            self.jump("G0")
            return
        words = []
        for axis in axes:
            word, value = self.word("XYZ"[axis], self.random.uniform(-2, 2))
            words.append(word)
            if choice == 1:  # G92: here is ...
                self.shift[axis] += self.here[axis] - value
                self.here[axis] = value
            else:
                self.here[axis] += self.shift[axis] - value
                self.shift[axis] = value
        self.put("G92" if choice == 1 else "G52", *words)
        if self.random.random() < 0.3:
            self.here, self.shift = self.here + self.shift, np.zeros(3)
            self.put("G92.1")

    def noise(self) -> None:
        self.put(
            self.random.choice(
                ("", "(X5)", "M3 S1000", "G4 P0.1", "; X1", "S900", "M8", "F200.5", "G94 F300", "G40")
            )
        )


@pytest.mark.sample(10)
@needs_rs274
@pytest.mark.parametrize("program", sorted(CASES.glob("*.ngc")), ids=lambda path: path.stem)
def test_case_files(program: Path, tmp_path: Path) -> None:
    agree(program, tmp_path)


@pytest.mark.slow
@needs_rs274
def test_most_case_files_are_accepted(tmp_path: Path) -> None:
    programs = sorted(CASES.glob("*.ngc"))
    assert sum(agree(program, tmp_path) > 0 for program in programs) >= 0.5 * len(programs) > 0


@pytest.mark.slow
@needs_rs274
def test_made_up_programs(tmp_path: Path) -> None:
    compared = refused = 0
    for seed in range(COUNT):
        program = tmp_path / "made.ngc"
        program.write_text(Made(seed).text())
        try:
            found = agree(program, tmp_path)
        except AssertionError as error:
            raise AssertionError(f"seed {seed}: {error}\n{program.read_text()}") from None
        refused += not found
        compared += found
    assert refused <= 0.05 * COUNT, f"rs274 takes {refused} of {COUNT} programs for wrong"
    assert compared > 10 * COUNT
