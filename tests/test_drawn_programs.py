"""Programs, cells and arms drawn at random: what is written for them, and what ``verify`` says of it, before a judge
that shares no code with the package."""

from __future__ import annotations

from pathlib import Path

import pytest
from judge.cases import CELL, Case, krl, pose, run
from judge.drawn import defects, drawn

SEEDS = [3, 12, 14, 17, 20, 24, 28, 31, 34, 36, 42]


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_is_wrong_in_silence(tmp_path: Path, seed: int) -> None:
    outcome = run(drawn(seed), tmp_path, verify=True)
    assert outcome.verdict is not None, outcome.message
    assert defects(outcome) == []


@pytest.mark.slow
def test_an_arc_between_stops_is_not_cut_short(tmp_path: Path) -> None:
    """What is inserted into it flows, with the approximation that is stated: as short as the tolerance needs."""
    build = krl(
        f"LIN {pose(0, 0, 50)}", f"LIN {pose(0, 0, 0)}", ";FORCE -60 100 -30 @feed", f"LIN {pose(60, 0, 0)}",
        ";FORCE 40 -30 -20 @feed", f"CIRC {pose(64, 4, 0)},{pose(60, 8, 0)}", f"LIN {pose(0, 8, 0)}", ";FORCE OFF",
        f"LIN {pose(0, 8, 50)}", head=("$APO.CDIS=3",), cell=CELL + "max_growth: 20\n",
    )  # fmt: skip
    outcome = run(Case("arc between stops", build), tmp_path)
    assert outcome.verdict is not None
    assert outcome.verdict.motions[1] > outcome.verdict.motions[0]
    assert (outcome.exit, outcome.failed) == (0, [])


def test_the_judge_sees_what_is_wrong(tmp_path: Path) -> None:
    """A point of the output that is 0.1 mm beside its place."""
    from judge.judge import judge

    case = drawn(12)
    outcome = run(case, tmp_path)
    assert outcome.verdict is not None
    output = tmp_path / "compensated" / "part.src"
    lines = output.read_bytes().split(b"\r\n")
    at = next(i for i, line in enumerate(lines) if line.startswith(b"LIN") and b";FORCE" in lines[i - 1])
    x = float(lines[at].split(b"X ")[1].split(b",")[0])
    lines[at] = lines[at].replace(f"X {x:.3f}".encode(), f"X {x + 0.1:.3f}".encode())
    output.write_bytes(b"\r\n".join(lines))
    worse = judge(tmp_path / "part.src", output, tmp_path / "cell.yaml", rule="after")
    assert worse.after.largest > outcome.verdict.after.largest + 0.05e-3
