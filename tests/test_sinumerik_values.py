"""Values of a Sinumerik: assignments from left to right, operators of letters in words, parameters of subprograms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.dialect import ReadingSettings

HEAD = "G71 G90 G17 G54 T1 D1\nG0 X0 Y0 Z0 F600\n"


def ends(text: str) -> list[list[float] | None]:
    """X, Y [mm] of the motions behind the first one, in the order in which they run; None of those that are not
    known."""
    settings = ReadingSettings(orientation=np.array([0.0, 0.0, np.pi]))
    path = DIALECTS["sinumerik"].read((Document(Path("part.mpf"), text.encode()),), settings).toolpath
    values = np.round(path.position[:, :2] * 1e3, 6)
    return [values[row].tolist() if path.known[row] else None for row in range(1, len(path))]


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("R1=5 R2=R1*2 R1=R2+1\nG1 X=R2 Y=R1\n", [10, 11]),
        ("R1=2\nR1=R1+1 R2=R1\nG1 X=R1 Y=R2\n", [3, 3]),
        ("R[1]=9 R[2]=3 R[R2]=7\nG1 X=R2 Y=R3\n", [3, 7]),
        ("R3=10 MOD 4 R4=7 DIV R3\nG1 X=R3 Y=R4\n", [2, 3]),
        ("R1=9\nG1 X=10 MOD 4 Y=R1 DIV 2 M8\n", [2, 4]),
        ("G1 X=(9 MOD 4)*2 Y=AC(7 MOD 4)\n", [2, 3]),
    ],
)
def test_values_are_those_of_the_control(text: str, end: list[float]) -> None:
    assert ends(HEAD + text + "M30\n") == [end]


@pytest.mark.parametrize(
    "text",
    [
        "R1=R9 R2=R1\nG1 X=R2\n",  # what R9 is, nobody says
        "/R1=5 R2=R1\nG1 X=R2\n",
        "R2=4\nG1 X=R2 R2=5\n",
        "G1 X=10 MOD\n",
        "G1 X=-7 MOD 3\n",
    ],
)
def test_what_is_not_certain_is_not_known(text: str) -> None:
    assert ends(HEAD + text + "M30\n") == [None]


CALLED = "%_N_MAIN_MPF\n" + HEAD + "R1=3\n{}\nM30\n%_N_UP1_SPF\n{}\nG1 X=A Y=B\nRET\n"


@pytest.mark.parametrize(
    ("call", "head", "end"),
    [
        ("UP1(R1+1,2)", "PROC UP1(REAL A, REAL B)", [4, 2]),
        ("UP1( 1.5 , (2+R1)*2 )", "PROC UP1(REAL A,REAL B) SAVE", [1.5, 10]),
        ("UP1(1)", "PROC UP1(REAL A, REAL B)", None),  # the other one has no value
        ("UP1(1,2,3)", "PROC UP1(REAL A, REAL B)", None),
        ("UP1(R1,2)", "PROC UP1(VAR REAL A, REAL B)", None),  # it may come back changed
        ("UP1(1.5,2)", "PROC UP1(INT A, REAL B)", None),
        ("UP1(R9,2)", "PROC UP1(REAL A, REAL B)", None),
    ],
)
def test_a_subprogram_has_the_values_that_it_is_called_with(
    call: str, head: str, end: list[float] | None
) -> None:
    assert ends(CALLED.format(call, head)) == [end]
