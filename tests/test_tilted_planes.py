"""Planes that programs state: G68, G68.2 with G53.1, CYCLE800."""

from __future__ import annotations

import numpy as np
import pytest
from gcode_writing import round_trip
from planes import DIALECT, HEAD, PLANES, differences, drawn, read
from test_gcode_read import read as gcode_read


@pytest.mark.sample(40)
@pytest.mark.parametrize("seed", range(300))
@pytest.mark.parametrize("name", list(PLANES))
def test_planes_are_read_as_an_interpreter_runs_them(name: str, seed: int) -> None:
    text, run = drawn(name, seed)
    found, claimed = differences(name, text, run)
    assert not found, text
    assert claimed == len(run.ends) - run.ends.count(None), text


@pytest.mark.parametrize("name", list(PLANES))
@pytest.mark.parametrize("seed", range(4))
def test_planes_are_written(name: str, seed: int) -> None:
    round_trip(DIALECT[name], drawn(name, seed)[0].encode(), seed)


def ends(name: str, text: str) -> list[str]:
    """The ends of the motions after the head; a question mark where one is not known, a star where it is refused."""
    path = read(name, HEAD[name] + text).toolpath
    found = []
    for row in range(1, len(path)):
        place = path.position[row] * 1e3
        known = np.isfinite(place).all()
        end = " ".join(f"{value + 0.0:g}" for value in np.round(place, 6)) if known else "?"
        found.append(end + "*" * (row in path.constraints.refused))
    return found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # a plane and its end leave coordinates unknown
        ("G68 X10. Y5. R90.\nG1 X12. Y5. Z1.\nG69\nG1 X1.\nY2. Z3.\n", ["10 7 1", "?*", "1 2 3"]),
        ("G68 R90.\nG1 X12. Y5. Z1.\n", ["?*"]),
        ("G68 X10. R90.\nG1 X12. Y5. Z1.\n", ["?*"]),
        ("G68 X0. Y0. R90.\nG1 X12.\nG1 Y0. Z1.\n", ["?*", "0 12 1"]),
        # in the block of a motion G69 holds already
        ("G68 X0. Y0. R90.\nG1 X1. Y2. Z3.\nG69 G1 X1. Y2. Z3.\n", ["-2 1 3", "1 2 3"]),
        ("G69\nG1 X1.\n", ["1 0 0"]),
        # an angle, a centre or a direction that is no number, steps, a second rotation, another offset, G52
        ("G68 X0. Y0.\nG1 X1. Y2. Z3.\n", ["?*"]),
        ("G68 X0. Y0. R#500\nG1 X1. Y2. Z3.\n", ["?*"]),
        ("G68 X0. Y0. Z0. I0. J0. K1. R90.\nG1 X1. Y2. Z3.\n", ["?*"]),
        ("G91 G68 X0. Y0. R90.\nG90 G1 X1. Y2. Z3.\n", ["?*"]),
        ("G68 X0. Y0. R90.\nG68 X0. Y0. R90.\nG1 X1. Y2. Z3.\nG69\nG1 X1. Y2. Z3.\n", ["?*", "1 2 3"]),
        ("G68 X0. Y0. R90.\nG55\nG1 X1. Y2. Z3.\n", ["?*"]),
        ("G68 X0. Y0. R90.\nG52 X1.\nG1 X1. Y2. Z3.\nG69\nG1 X1. Y2. Z3.\n", ["?*", "?*"]),
        ("/G68 X0. Y0. R90.\nG1 X1. Y2. Z3.\nG69\nG1 X1. Y2. Z3.\n", ["?*", "1 2 3"]),
        # an origin that is shifted before the plane stays
        ("G52 X10.\nG68 X0. Y0. R90.\nG1 X1. Y2. Z3.\nG69\nG1 X1. Y2. Z3.\n", ["8 1 3", "11 2 3"]),
        # a tool that is along a plane is not back before its axes are
        (
            "G68.2 X0. Y0. Z0. I0. J90. K0.\nG53.1\nG1 X1. Y2. Z3.\nG69\nG1 X1. Y2. Z3.\n",
            ["1 -3 2", "1 2 3*"],
        ),
        (
            "G0 A0.\nG68.2 X0. Y0. Z0. I0. J90. K0.\nG53.1\nG1 X1. Y2. Z3.\nA5.\nG69\nG1 X1. Y2. Z3.\nG0 A0.\nG1 X4.\n",
            ["0 0 0", "1 -3 2", "1 -3 2*", "1 2 3*", "1 2 3", "4 2 3"],
        ),
        ("G53.1\nG1 X1. Y2. Z3.\n", ["?*"]),
        # in a tilted plane an axis of the machine, or the tool's length, moves several coordinates
        (
            "G68.2 X0. Y0. Z0. I0. J90. K0.\nG1 X1. Y2. Z3.\nG53 Z0.\nG1 X1. Z3.\nY2.\n",
            ["1 -3 2", "?*", "?*", "1 -3 2"],
        ),
        ("G68 X0. Y0. R90.\nG1 X1. Y2. Z3.\nG28 X0.\nG1 X1. Z3.\nY2.\n", ["-2 1 3", "?*", "?*", "-2 1 3"]),
        (
            "G68.2 X0. Y0. Z0. I0. J90. K0.\nG1 X1. Y2. Z3.\nG43 H2\nG1 X1. Z3.\nY2.\n",
            ["1 -3 2", "?*", "1 -3 2"],
        ),
        (
            "G68.2 X0. Y0. Z0. I0. J90. K0.\nG53.1\nG1 X1. Y2. Z3.\nG43 H2\nG1 X1. Z3.\nX2.\n",
            ["1 -3 2", "1 -3 2", "2 -3 2"],
        ),
        # a TCP mode without words of an orientation leaves the tool along the plane, which is not read
        ("G68.2 X0. Y0. Z0. I0. J90. K0.\nG53.1\nG43.4 H1\nG1 X1. Y2. Z3.\n", ["1 -3 2*"]),
        ("G68 X0. Y0. R90.\nG53.1\nG1 X1. Y2. Z3.\n", ["?*"]),
        ("G68.2 P1 X0. Y0. Z0. I0. J90. K0.\nG1 X1. Y2. Z3.\n", ["?*"]),
        ("G68.2 X0. Y0. Z0.\nG1 X1. Y2. Z3.\n", ["?*"]),
    ],
)
def test_planes_of_a_fanuc(text: str, expected: list[str]) -> None:
    assert ends("fanuc", text) == expected


SWIVEL = 'CYCLE800(1,"TC",{state},{mode},0,0,0,90,0,0,0,0,0,{direction},100,{plane})\n'
USUAL = {"state": 0, "mode": 57, "direction": 1, "plane": 1}


@pytest.mark.parametrize(
    ("changed", "known"),
    [
        ({}, True), ({"state": 200010}, True), ({"plane": 0}, True), ({"direction": 0}, False),
        ({"direction": ""}, False),
        ({"mode": 57 + 64}, False), ({"mode": 192}, False), ({"mode": 61}, False), ({"mode": 5.5}, False),
        ({"state": 2}, False), ({"state": 20000}, False), ({"state": 100}, False), ({"plane": 2}, False),
    ],
)  # fmt: skip
def test_planes_that_are_read_of_a_sinumerik(changed: dict[str, object], known: bool) -> None:
    text = SWIVEL.format(**USUAL | changed) + "G1 X1 Y2 Z3\n"
    assert ends("sinumerik", text) == (["1 -3 2"] if known else ["?*"])


@pytest.mark.parametrize("changed", [{}, {"state": 200010}, {"plane": 0}])
@pytest.mark.parametrize("code", ["G17", "G18", "G19"])
def test_a_swivelled_plane_is_read_in_the_plane_of_its_documents_alone(
    code: str, changed: dict[str, object]
) -> None:
    """In another one than G17 its angles may be other ones: nothing is known then, whatever else it states."""
    text = f"{code}\n" + SWIVEL.format(**USUAL | changed) + "G17 G1 X1 Y2 Z3\n"
    assert ends("sinumerik", text) == (["1 -3 2"] if code == "G17" else ["?*"])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G1 X1 Y2 Z3\nSUPA G0 Z0\nG1 X1 Z3\n", ["1 -3 2", "?*", "?*"]), ("TRAORI\nG1 X1 Y2 Z3\n", ["1 -3 2*"]),
        ("TRANS X1\nG1 X1 Y2 Z3\n", ["?*"]), ("CYCLE800()\nG1 X1 Y2 Z3\n", ["?*"]),
        ('CYCLE800(1,"TC",0,57,0,0,0,0,0,0,0,0,0,1,100,1)\nG1 X1 Y2 Z3\n', ["1 2 3"]),
        # without a direction no axis moves, and the tool stays along the plane
        ('CYCLE800(1,"TC",0,57,0,0,0,0,0,0,0,0,0,0,100,1)\nG1 X1 Y2 Z3\n', ["1 2 3*"]),
        ("G1 X1 Y2 Z3\nG1 X5 A10\nG1 X6\n", ["1 -3 2", "5 -3 2*", "6 -3 2*"]),
    ],
)  # fmt: skip
def test_what_follows_a_swivelled_plane(text: str, expected: list[str]) -> None:
    assert ends("sinumerik", SWIVEL.format(**USUAL) + text) == expected


@pytest.mark.parametrize(
    ("code", "back"), [("TOROT", "TOROTOF"), ("TOFRAME", "TOROTOF"), ("PAROT", "PAROTOF")]
)
def test_what_turns_coordinates_along_the_tool_stays_when_trans_replaces_a_frame(
    code: str, back: str
) -> None:
    assert ends("sinumerik", f"{code}\nTRANS\nG1 X1 Y2 Z3\n{back}\nTRANS\nG1 X1 Y2 Z3\n") == ["?*", "1 2 3"]


@pytest.mark.parametrize("plane", ["G68 X1. Y2. R30.", "G68.2 X1. Y2. Z3. I10. J20. K30."])
def test_both_codes_end_a_plane(plane: str) -> None:
    """G69 and G69.1 are one."""
    text = "G21 G90 G17 G54 T1\nG0 X0. Y0. Z0.\n{}\nG0 X5.\n{}\nG1 X7. Y8. Z9. F600\n"
    found = [
        list(gcode_read(text.format(plane, end), "fanuc").toolpath.dump())[-1]
        for end in ("G69", "G69.1", "G90")
    ]
    assert found[0] == found[1] != found[2]
