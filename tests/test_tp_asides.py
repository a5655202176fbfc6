"""Fanuc TP: what motions do beside their path, and what counts from where they end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.dialect import Program
from postproc.toolpath import Toolpath

POINT = """P[{}]{{
   GP1:
\tUF : 1, UT : 1,\t\tCONFIG : '{}',
\tX = {}.000  mm,\tY = 0.000  mm,\tZ = 0.000  mm,
\tW = 180.000 deg,\tP = 0.000 deg,\tR = 0.000 deg
}};
"""


def program(*lines: str, config: str = "N U T, 0, 0, 0") -> Program:
    body = ["UFRAME_NUM=1", "UTOOL_NUM=1", *lines]
    text = "".join(f"{n:4d}:  {line} ;\n" for n, line in enumerate(body, 1))
    points = "".join(POINT.format(n, config, 10 * n) for n in range(1, 6))
    raw = f"/PROG PART\n/ATTR\n/MN\n{text}/POS\n{points}/END\n".encode()
    return DIALECTS["tp"].read((Document(Path("part.ls"), raw),))


def read(*lines: str) -> Toolpath:
    return program(*lines).toolpath


@pytest.mark.parametrize("option", ["TB .10sec,CALL OTHER", "TA .10sec,CALL OTHER(1)", "DB 5.0mm,CALL OTHER"])
def test_a_program_beside_a_motion_may_set_registers_at_any_time(option: str) -> None:
    path = read("R[1]=50", f"L P[1] R[1]mm/sec FINE {option}", "R[1]=60", "L P[2] R[1]mm/sec FINE")
    assert np.isnan(path.feed).all()
    path = read("R[1]=50", "L P[1] R[1]mm/sec FINE TA .10sec,DO[1]=ON", "R[1]=60", "L P[2] R[1]mm/sec FINE")
    np.testing.assert_allclose(path.feed, [0.05, 0.06])


def test_a_program_beside_a_motion_is_reported() -> None:
    findings = program("L P[1] 9mm/sec FINE DB 5.0mm,CALL OTHER(2)", "CALL OTHER", "CALL THIRD").findings
    assert [one.message.split()[0] for one in findings if one.code == "FTP010"] == ["OTHER", "THIRD"]
    assert [one.line for one in findings if one.code == "FTP010"] == [6, 8]


def test_a_program_beside_a_motion_decides_jumps() -> None:
    lines = [
        "R[1]=1",
        "L P[1] 9mm/sec FINE TB .10sec,CALL OTHER",
        "IF R[1]=2,JMP LBL[1]",
        "L P[2] 9mm/sec FINE",
        "LBL[1]",
    ]
    path = read(*lines, "L P[3] 9mm/sec FINE")
    assert path.predecessors[2] == (0, 1)


def test_the_motion_before_an_increment_stays() -> None:
    path = read(
        "L P[1] 9mm/sec FINE", "L P[2] 9mm/sec FINE", "L P[3] 9mm/sec FINE INC", "L P[4] 9mm/sec FINE"
    )
    assert path.constraints.refused[2].code == "FTP008"
    assert list(path.constraints.locked) == [1]
    assert "INC" in path.constraints.locked[1].message
    assert not read("L P[1] 9mm/sec FINE", "L P[2] 9mm/sec FINE Offset,PR[1]").constraints.locked


@pytest.mark.parametrize(
    ("first", "more", "limit", "known"),
    [("1", "R[1]+2", "3", (0,)), ("0.1", "R[1]+0.2", "0.3", (0, 1)), ("0.5", "R[1]*0.2", "0.1", (0, 1))],
)
def test_a_comparison_that_rounding_decides_is_not_decided(
    first: str, more: str, limit: str, known: tuple[int, ...]
) -> None:
    """0.1 + 0.2 is 0.3 or beside it, as the controller rounds: with the digits computed here it never jumps."""
    path = read(
        f"R[1]={first}",
        f"R[2]={more}",
        "L P[1] 9mm/sec FINE",
        f"IF R[2]={limit},JMP LBL[1]",
        "L P[2] 9mm/sec FINE",
        "LBL[1]",
        "L P[3] 9mm/sec FINE",
    )
    assert path.predecessors.get(2, (1,)) == known


DISTANCES = ("10", "10mm", " 7.5 mm", "R[3]", "AR[1]")


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("corner", ["CR20", "CNT50"])
@pytest.mark.parametrize(("option", "row"), [("RT_LD", 1), ("AP_LD", 0)])
def test_a_corner_beside_a_part_that_is_a_line_has_no_known_size(
    option: str, row: int, corner: str, distance: str
) -> None:
    """RT_LD: the start of the motion is a line, so the corner at its end may be smaller; AP_LD: that before it."""
    motions = [f"L P[{n}] 50mm/sec {corner}" for n in (1, 2, 3)]
    plain = read(*motions)
    motions[1] += f" {option}{distance}"
    path = read(*motions)
    assert not path.constraints.refused
    assert list(path.dump()) == list(plain.dump())
    assert list(path.constraints.no_insert_before) == [1]
    sizes, numbers = path.approximation, path.sequence.approximation_number
    assert np.isnan([sizes[row], numbers[row]]).all()
    others = [one for one in range(3) if one != row]
    assert np.array_equal(sizes[others], plain.approximation[others], equal_nan=True)
    assert np.array_equal(numbers[others], plain.sequence.approximation_number[others], equal_nan=True)


def test_a_motion_that_stops_stays_exact_beside_a_part_that_is_a_line() -> None:
    path = read("L P[1] 50mm/sec FINE", "L P[2] 50mm/sec FINE RT_LD10 AP_LD5", "L P[3] 50mm/sec CR5 RT_LD")
    assert path.approximation[:2].tolist() == [0.0, 0.0]
    assert path.constraints.refused[2].code == "FTP001"
