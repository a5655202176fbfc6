"""Coordinate systems and splines of KUKA.CNC, as the manuals of its kernel (Beckhoff TF5200, ISG) describe them."""

from __future__ import annotations

import random

import numpy as np
import pytest
from test_gcode_followed import read

HEAD = "#TRAFO ON\nG90 G71 T1\nF1000\nG0 X0 Y0 Z0 A0 B0 C0\n"
MOVE = "G1 X1 Y2 Z3 A0 B0 C0\n"
UNKNOWN = (np.nan,) * 3


def places(text: str) -> list[list[float]]:
    """[mm] of the motions after ``HEAD``."""
    path = read("kuka_cnc", text, HEAD).toolpath
    return [[round(float(value), 6) for value in row] for row in path.position[1:] * 1e3]


@pytest.mark.parametrize("seed", range(20))
def test_systems_are_linked_in_their_order(seed: int) -> None:
    """An independent stack: #CS ON works within what is on, #CS OFF ends the last one, #CS OFF ALL all."""
    draw = random.Random(seed)
    shifts = {number: [draw.randint(-50, 50) for _ in range(3)] for number in (1, 2, 3)}
    text = "".join(f"#CS DEF[{number}][{x},{y},{z},0,0,0]\n" for number, (x, y, z) in shifts.items())
    stack: list[list[int]] = []
    expected = []
    for _ in range(30):
        command = draw.choice(("ON", "ON", "HERE", "OFF", "OFF", "ALL"))
        if command == "ON":
            number = draw.choice((1, 2, 3))
            stack.append(shifts[number])
            text += f"#CS ON[{number}]\n"
        elif command == "HERE":
            here = [draw.randint(-50, 50) for _ in range(3)]
            stack.append(here)
            text += f"#CS ON[{here[0]},{here[1]},{here[2]},0,0,0]\n"
        elif command == "OFF":
            stack = stack[:-1]
            text += "#CS OFF\n"
        else:
            stack = []
            text += "#CS OFF ALL\n"
        text += MOVE
        expected.append([start + sum(one[i] for one in stack) for i, start in enumerate((1.0, 2.0, 3.0))])
    np.testing.assert_allclose(places(text), expected, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # how the three angles turn is not stated; the system ends as any other one
        ("#CS ON[1,0,0,0,0,30]\n" + MOVE + "#CS OFF\n" + MOVE, [UNKNOWN, (1, 2, 3)]),
        # an offset of the system ends with it
        ("#CS ON[1,1,1,0,0,0]\nG54\n" + MOVE + "#CS OFF\n" + MOVE, [(2, 3, 4), UNKNOWN]),
        ("#CS ON[1,1,1,0,0,0]\nG54\n" + MOVE + "#CS OFF ALL\nG54\n" + MOVE, [(2, 3, 4), (1, 2, 3)]),
        ("#CS ON[1,1,1,0,0,0]\nG54\n#CS OFF\n#CS ON[2,2,2,0,0,0]\nG55\n" + MOVE, [(3, 4, 5)]),
        # and adds to that outside of it
        ("G54\n#CS ON[1,1,1,0,0,0]\n" + MOVE + "G54\n" + MOVE, [(2, 3, 4), UNKNOWN]),
        ("#CS ON[1,1,1,0,0,0]\nG54\n#CS ON[1,1,1,0,0,0]\n" + MOVE + "G55\n" + MOVE, [(3, 4, 5), UNKNOWN]),
        ("G54\n" + MOVE + "G53\n#CS ON[1,1,1,0,0,0]\nG55\n" + MOVE, [(1, 2, 3), (2, 3, 4)]),
        # how many are on is not known
        ("#CS ADD[A][1,1,1,0,0,0]\n" + MOVE + "#CS OFF\n" + MOVE + "#CS OFF ALL\nG54\n" + MOVE,
         [UNKNOWN, UNKNOWN, (1, 2, 3)]),
        ("/#CS ON[1,1,1,0,0,0]\n" + MOVE + "#CS OFF\n" + MOVE + "#CS OFF ALL\n" + MOVE,
         [UNKNOWN, UNKNOWN, (1, 2, 3)]),
        ("#CS DEF[1][1,1,1,0,0,0]\n#CS DEF ACT[1]\n#CS OFF ALL\nG54\n#CS ON[1]\n" + MOVE, [UNKNOWN]),
        # G92 moves the origin, whatever ends
        ("G92 X5\n#CS OFF ALL\nG54\n" + MOVE, [UNKNOWN]),
    ],
)  # fmt: skip
def test_what_is_known_of_systems_and_offsets(text: str, expected: list[tuple[float, ...]]) -> None:
    np.testing.assert_allclose(places(text), expected, atol=1e-6)


@pytest.mark.parametrize(
    ("on", "off"), [("G151", "G150"), ("#SPLINE ON", "#SPLINE OFF"), ("#SET SPLINE ON", "#SET SPLINE OFF")]
)
def test_a_spline_leads_through_the_targets_of_lines(on: str, off: str) -> None:
    """G0 and G1 state its points: they are no lines between on and off."""
    path = read("kuka_cnc", f"{on}\nG1 X1\nX2 Y1\n{off}\nX3\nG1 X4\n", HEAD).toolpath
    assert sorted(path.constraints.refused) == [1, 2]
    assert "spline" in path.constraints.refused[1].message


def test_the_definition_of_the_place_of_a_part_changes_nothing() -> None:
    path = read("kuka_cnc", f"G54\n#ACS DEF[1][1,2,3,0,0,0]\n{MOVE}", HEAD).toolpath
    assert not path.constraints.refused
