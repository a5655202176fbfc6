"""Where the tool is behind drill cycles, and which holes they drill: against a walk through drawn programs, and against
what may be between them.

G99 goes back to R, G98 to where the series of cycles began (LinuxCNC's manual, canned cycles; Fanuc's, initial level).
"""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from gcode_judge.judging import judge
from gcode_judge.misreadings import written as made_of
from gcode_judge.oracle import MISSING, RS274
from test_gcode_followed import HEAD, read, run

Place = dict[str, float]
CONTROLS = pytest.mark.parametrize("control", ["linuxcnc", "fanuc"])
PLANES = {17: "XYZ", 18: "ZXY", 19: "YZX"}
"""The axes of the plane, and the one along which a cycle works."""


class Walk:
    """A drawn program, and where each of its blocks leads: ``ends``: line -> place [mm], None where controls differ;
    ``holes``: line -> the bottom."""

    def __init__(self, seed: int, control: str) -> None:
        self.chance = random.Random(seed)
        self.lines = HEAD[control].splitlines()
        self.here: Place = dict.fromkeys("XYZ", 0.0)
        self.known = True
        self.ends: dict[int, Place | None] = {}
        self.holes: dict[int, Place] = {}
        for _ in range(3):
            self.series()

    def number(self, low: float = -9.0, high: float = 9.0) -> float:
        return round(self.chance.uniform(low, high), 2)

    def put(self, words: list[str], move: Place | None = None) -> None:
        self.chance.shuffle(words)
        self.lines.append(" ".join(words))
        if move is not None:
            self.here |= move
            self.ends[len(self.lines)] = dict(self.here) if self.known else None

    def goes(self, code: str, axes: str) -> None:
        move = {axis: self.number() for axis in axes}
        if len(axes) == 3:
            self.known = True
        self.put([code, *(f"{axis}{value:.2f}" for axis, value in move.items())], move)

    def series(self) -> None:
        plane = self.chance.choice((17, 17, 18, 19))
        one, two, along = PLANES[plane]
        self.put([f"G{plane}"])
        self.goes(self.chance.choice(("G0", "G1")), "XYZ")
        level, back, first, since_99 = 0.0, 98, True, False
        depth = plane_of_r = code = 0
        for _ in range(self.chance.randint(1, 6)):
            words: list[str] = []
            if first:
                level, since_99 = self.here[along], not self.known
                code, back = self.chance.choice((73, 81, 82, 83, 85)), self.chance.choice((98, 98, 99))
                words = [f"G{code}", f"G{back}"]
            elif self.chance.random() < 0.2:
                back = self.chance.choice((98, 99))
                words.append(f"G{back}")
            if first or self.chance.random() < 0.3:
                depth = self.number(-20, -10)
                plane_of_r = self.number(-9, min(level, 8.0)) if self.chance.random() < 0.8 else self.number()
                words += [f"{along}{depth:.2f}", f"R{plane_of_r:.2f}"]
            move = {
                axis: self.number() for axis in self.chance.sample((one, two), self.chance.choice((1, 2)))
            }
            words += [f"{axis}{value:.2f}" for axis, value in move.items()]
            words += ["Q1."] if code in (73, 83) and first else ["P.1"] if code == 82 and first else []
            self.put(words)
            self.here |= move
            self.holes[len(self.lines)] = self.here | {along: depth}
            since_99 |= back == 99
            # Below R the controls differ; what a G98 after a G99 goes back to is not followed.
            self.known = back == 99 or (level >= plane_of_r and not since_99)
            self.here[along] = plane_of_r if back == 99 else max(level, plane_of_r)
            since_99 |= not self.known
            first = False
            if self.chance.random() < 0.2:
                self.goes(self.chance.choice(("G0", "G1")), self.chance.choice(("XYZ", one, two, one + two)))
                first = True
        self.put(["G80"])
        self.goes("G0", self.chance.choice((one, two, one + two)))
        self.goes("G1", self.chance.choice((one, two)))

    @property
    def text(self) -> str:
        return "\n".join([*self.lines, "M2", ""])


@CONTROLS
@pytest.mark.parametrize("seed", range(40))
def test_cycles_end_where_a_walk_through_them_ends(control: str, seed: int) -> None:
    walk = Walk(seed, control)
    path = read(control, walk.text, "").toolpath
    rows = {int(line): row for row, line in enumerate(path.line)}
    for line, place in {**walk.ends, **walk.holes}.items():
        row = rows[line]
        if place is None:
            assert not np.isfinite(path.position[row]).all(), walk.text
            continue
        assert path.drills[row] == (line in walk.holes)
        np.testing.assert_allclose(
            path.position[row] * 1e3,
            [place[axis] for axis in "XYZ"],
            atol=1e-9,
            err_msg=f"{line} of {walk.text}",
        )
        assert row not in path.constraints.refused


BLOCKS = ["G0 X0. Y0. Z20.", "{} G81 X1. Y1. Z-5. R2.", "X2.", "G80", "G0 X5. Y5.", "G1 X7."]
BETWEEN_HOLES = 2


def with_block(block: str, at: int, back: str = "G98") -> str:
    """Two holes, with a block at a place of them."""
    lines = [line.format(back) for line in BLOCKS]
    return "\n".join([*lines[:at], block, *lines[at:]]) + "\n"


HARMLESS = [
    "S1000 M3", "G4 P1", "M8", "(x)", "G17", "G90", "G54", "G94", "F100.", "N5", "G21", "G40", "G61", "G10 L2 P2 Z5.",
]  # fmt: skip


@CONTROLS
@pytest.mark.parametrize("block", HARMLESS)
def test_what_moves_nothing_changes_no_hole_and_no_level(control: str, block: str) -> None:
    for back, level in (("G98", 20), ("G99", 2)):
        for at in (1, 2, 3, 4):
            ends = run(control, with_block(block, at, back))
            assert ends == ["0 0 20", "1 1 -5", "2 1 -5", f"5 5 {level}", f"7 5 {level}"]
    plain = read(control, with_block("", 1)).toolpath
    assert read(control, with_block(block, BETWEEN_HOLES)).toolpath.drills.tolist() == plain.drills.tolist()


ELSEWHERE = [
    "G28 Z0.", "G28", "G91 G28 Z0.\nG90", "G30 Z0.", "G53 G0 Z0.", "G38.2 Z-5.", "G31 Z-5.", "G65 P9000", "M98 P9000",
    "G10 L2 P1 Z5.", "G55", "G43 H1", "G43.1 Z2.", "G1 X5. X6.", "/G1 Z9.", "/G91", "/G55", "/G43 H1", "FOO BAR",
    "G1 Z#500", "G68 R5.", "G51 P2.", "G16", "#5223=4", "G72 X1.",
]  # fmt: skip
"""Behind these the tool is not where the last Z said, or may not be."""


@CONTROLS
@pytest.mark.parametrize("block", ELSEWHERE)
def test_no_level_is_claimed_behind_what_leads_elsewhere(control: str, block: str) -> None:
    """Before the first hole G98 would go back there; behind the last one the tool is there."""
    for at in (1, 3):
        ends = run(control, with_block(block, at))
        assert all("?" in end or "*" in end for end in ends[-2:]), (at, ends)
    drills = read(control, with_block(block, BETWEEN_HOLES)).toolpath
    assert drills.drills.sum() - len({*np.flatnonzero(drills.drills)} & {*drills.constraints.refused}) < 2


@CONTROLS
@pytest.mark.parametrize("code", ["G0", "G1"])
@pytest.mark.parametrize("by", [3.0, -3.0, 30.0])
def test_a_level_behind_a_difference_is_no_coordinate(control: str, code: str, by: float) -> None:
    """It is by so much away from the last coordinate, or not claimed; before the first hole, and behind the last."""
    between = f"G91 {code} Z{by:.1f}\nG90"
    for at, level in ((1, 20.0 + by), (3, 20.0), (5, 20.0 + by)):
        for end in run(control, with_block(between, at))[-2:]:
            place = end.rstrip("*").split(" ")
            assert place[-1] in ("?", f"{level:g}", f"{20.0 + by:g}"), (at, end)


@CONTROLS
def test_a_level_is_no_number_of_another_unit(control: str) -> None:
    """LinuxCNC goes back to the number that R or the level had, in the unit that is in force."""
    for back in ("G98", "G99"):
        assert run(control, with_block("G20", BETWEEN_HOLES, back))[-1].startswith("?")
        assert (
            run(control, with_block("G20\nG21", BETWEEN_HOLES, back))[-1]
            == f"7 5 {20 if back == 'G98' else 2}"
        )


def test_what_follows_a_probing_move_of_linuxcnc_probes_too() -> None:
    assert run("linuxcnc", "G1 X1\nG38.2 Z-5\nX2 Y2 Z2\nG1 X3 Y3 Z3\n") == ["1 0 0", "?*", "?*", "3 3 3"]
    assert run("linuxcnc", "G1 X1\nG31 Z-5\nG1 X2 Y2 Z2\nX3\n") == ["1 0 0", "?*", "2 2 2", "3 2 2"]


@pytest.mark.parametrize(
    ("text", "ends"),
    [
        ("G0 Z40\nCYCLE82(30,0,2,-5)\nX1\n", ["0 0 40", "1 0 30"]),
        ("G18 G0 Y40\nCYCLE82(30,0,2,-5)\nX1\n", ["0 40 0", "1 30 0"]),
        ("G19 G0 X40\nCYCLE82(30,0,2,-5)\nY1\n", ["40 0 0", "30 1 0"]),
        ("G0 Z40\nMCALL CYCLE81(30,0,2,-5)\nX1 Y1\nMCALL\nX2\n", ["0 0 40", "1 1 30*", "2 1 30"]),
        ("G0 Z40\nMCALL CYCLE81(30,0,2,-5)\nX1\nMCALL CYCLE81(50,0,2,-5)\nX2\nMCALL\nX3\n",
         ["0 0 40", "1 0 30*", "2 0 50*", "3 0 50"]),
        ("G0 Z40\n/CYCLE82(30,0,2,-5)\nX1\n", ["0 0 40", "?*"]),
        ("G0 Z40\nCYCLE82(R90,0,2,-5)\nX1\n", ["0 0 40", "?*"]),
        ("G0 Z40\nR1=3\nCYCLE82(R1*10,0,2,-5)\nX1\n", ["0 0 40", "1 0 30"]),
        ("G0 Z40\nMCALL CYCLE81(30,0,2,-5)\nG70\nX1\nMCALL\nG71 X2\n", ["0 0 40", "?*", "?*"]),
        ("G70\nG0 Z4\nCYCLE82(3,0,2,-5)\nX1\n", ["0 0 101.6", "25.4 0 76.2"]),
    ],
)  # fmt: skip
def test_cycles_with_names_end_in_their_plane(text: str, ends: list[str]) -> None:
    """The first argument is the coordinate to which they go back, along the axis normal to the plane."""
    assert run("sinumerik", text) == ends


AT_RS274 = [
    *HARMLESS, *ELSEWHERE, "G20", "G18", "G1 X3.", "G1 U1.", "G33 Z3. K1.", "G91 G1 Z3.\nG90", "T2 M6", "G73",
    "G0 Z15.", "G49", "G92 Z3.", "G52 Z1.", "G28.1", "G92.1", "G92.2", "G92.3", "/G18",
]  # fmt: skip


@pytest.mark.skipif(RS274 is None, reason=MISSING)
@pytest.mark.parametrize(
    "block", ["G20", "G38.2 Z-5.", *(pytest.param(one, marks=pytest.mark.slow) for one in AT_RS274)]
)
def test_linuxcnc_is_where_it_is_claimed(block: str, tmp_path: Path) -> None:
    for back in ("G98", "G99"):
        for at in (1, 2, 3, 4):
            made = made_of(HEAD["linuxcnc"] + with_block(block, at, back) + "M2\n")
            found = judge(made, tmp_path)
            assert found is None or not found.differences, made.text
