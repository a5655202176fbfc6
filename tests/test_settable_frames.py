"""Work offsets that a program writes: those of a Sinumerik ($P_UIFR), and what moves all of them."""

from __future__ import annotations

import numpy as np
import pytest
from test_gcode_followed import read

HEAD = "G17 G710 G90 G94 T1 D1\nF1000\nG54\nG1 X0 Y0 Z0\n"
END = "G1 X1 Y2 Z3\n"
QUARTER = "0 -1 0; 1 0 0; 0 0 1"


def last_base(text: str, head: str = HEAD, name: str = "sinumerik") -> str:
    """Where the base of the last motion is: "cell" its number there, "?" not known, else its origin [mm] and axes."""
    path = read(name, text + END, head).toolpath
    if path.base[-1] < 0:
        return "?"
    frame = path.frames[path.base[-1]]
    if frame.pose is None:
        return f"cell {frame.number}"
    origin = " ".join(f"{value:g}" for value in (frame.pose.position * 1e3).round(6) + 0.0)
    rows = frame.pose.rotation.round(9) + 0.0
    axes = "; ".join(" ".join(f"{value:g}" for value in row) for row in rows)
    return origin if np.array_equal(rows, np.eye(3)) else f"{origin} / {axes}"


@pytest.mark.parametrize(
    ("text", "base"),
    [
        # Siemens, job planning: what is written is active after the next G54 ... G599 of its number
        ("$P_UIFR[1]=CTRANS(X,10,Y,20,Z,-30)\nG54\n", "10 20 -30"),
        ("$P_UIFR[1]=CTRANS(X,10,Y,20,Z,-30)\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,10,Y,20,Z,-30)\nG55\nG54\n", "10 20 -30"),
        ("$P_UIFR[1]=CTRANS(X,10)\nG55\n", "cell 2"),
        ("$P_UIFR[7]=CTRANS(Z,10/4)\nG507\n", "0 0 2.5"),
        # CROT as ROT: x of the part lies along y
        ("$P_UIFR[1]=CTRANS(X,10):CROT(Z,90)\nG54\n", f"10 0 0 / {QUARTER}"),
        ("$P_UIFR[1]=CROT(Z,90)\nG54\n", f"0 0 0 / {QUARTER}"),
        ("$P_UIFR [1] = ctrans (x, 10) : crot (Z , 90)\nG54\n", f"10 0 0 / {QUARTER}"),
        # about Z, then the new Y: the part's z points along the base's y
        ("$P_UIFR[1]=CROT(Y,90,Z,90)\nG54\n", "0 0 0 / 0 -1 0; 0 0 1; -1 0 0"),
        # not in this order: the shift would be along the turned axes
        ("$P_UIFR[1]=CROT(Z,90):CTRANS(X,10)\nG54\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,10):CSCALE(X,2)\nG54\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,10):$P_UIFR[2]\nG54\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,10,C,5)\nG54\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,10,X,5)\nG54\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,R1)\nG54\n", "?"),
        ("$P_UIFR[1,X,TR]=5\nG54\n", "?"),
        ("/$P_UIFR[1]=CTRANS(X,10)\nG54\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,10)\n/G54\n", "?"),
        ("G700\n$P_UIFR[1]=CTRANS(X,10)\nG710 G54\n", "?"),
        # what is written last counts, and what is written after the selection waits for another one
        ("$P_UIFR[1]=CTRANS(X,10)\n$P_UIFR[1]=CTRANS(X,20)\nG54\n", "20 0 0"),
        ("$P_UIFR[1]=CTRANS(X,10)\n$P_UIFR[1,Y,TR]=20\nG54\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,10)\n$P_UIFR[R1]=CTRANS(X,20)\nG54\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,10)\nG54\n$P_UIFR[1]=CTRANS(X,20)\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,10)\n$P_UIFR[2]=CTRANS(X,20)\nG54\n", "10 0 0"),
        # frames that move all of them
        ("$P_BFRAME=CTRANS(X,1)\n$P_UIFR[1]=CTRANS(X,10)\nG54\n", "?"),
        ("$P_UIFR[1]=CTRANS(X,10)\n$P_BFRAME=CTRANS(X,1)\nG54\n", "?"),
    ],
)  # fmt: skip
def test_a_settable_frame_is_where_the_program_states_it_once_it_is_selected(text: str, base: str) -> None:
    assert last_base(text) == base


def test_coordinates_that_no_word_states_again_are_not_known_under_another_offset() -> None:
    path = read("sinumerik", "$P_UIFR[1]=CTRANS(X,10)\nG54\nG1 X1\nY1 Z1\n", HEAD).toolpath
    assert path.constraints.refused[1].message.startswith("Y, Z: not known since line")
    np.testing.assert_allclose(path.position[2] * 1e3, [1, 1, 1])


@pytest.mark.parametrize(
    ("external", "base"), [("X5. Y0. Z0.", "?"), ("X0. Y0. Z0.", "10 20 30"), ("X#1", "?")]
)
def test_what_moves_all_work_offsets_moves_those_that_are_written_later(external: str, base: str) -> None:
    """Fanuc: G10 L2 P0 is the external offset, which is added to G54 wherever that is."""
    text = f"G10 L2 P0 {external}\nG10 L2 P1 X10. Y20. Z30.\nG54 G0 X0. Y0. Z0.\n"
    assert last_base(text.replace("#1", "#500"), "G21 G90 G17 T1 M6\n", "fanuc") == base


@pytest.mark.parametrize("jump", ["GOTO 77", "IF [1 EQ 1] GOTO 77", "#1=77\nGOTO #1"])
def test_a_sure_jump_to_a_missing_block_ends_the_program(jump: str) -> None:
    """An alarm: what is before it runs, what is after it does not."""
    text = f"G0 X0. Y0. Z0.\nG1 X5.\n{jump}\nG1 X9.\nN80 X10.\nM30\n"
    path = read("fanuc", text, "G21 G90 G17 T1 M6\nF100.\nG54\n").toolpath
    assert sorted(path.constraints.refused) == [2, 3]
    assert {path.constraints.refused[row].code for row in (2, 3)} == {"GCO025"}
    np.testing.assert_allclose(path.position[:2] * 1e3, [[0, 0, 0], [5, 0, 0]])
