"""G-code of LinuxCNC's grammar as it is read, against LinuxCNC's own interpreter (``python -m tests.gcode_judge``)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gcode_judge.blocks import Made
from gcode_judge.comparison import Comparison, compare
from gcode_judge.generator import make
from gcode_judge.judging import Totals, judge, judge_seeds, shrink
from gcode_judge.misreadings import MISREADINGS, written
from gcode_judge.oracle import MISSING, RS274, execute
from gcode_judge.reading import Reading, Row, read

pytestmark = pytest.mark.skipif(RS274 is None, reason=MISSING)

LEAST_ACCEPTED = 0.8
SLOW_PARTS, SLOW_PART = 10, 50


def check(totals: Totals) -> None:
    """Most programs are accepted, and none is read otherwise."""
    assert totals.accepted >= LEAST_ACCEPTED * totals.programs
    assert totals.known > 0
    for seed, difference in totals.differing.items():
        made = shrink(seed, difference)
        pytest.fail(
            f"seed {seed}, line {difference.line}: {difference.kind}: {difference.message}; shrunk:\n{made.text}"
        )


def test_made_up_programs_are_read_as_linuxcnc_runs_them():
    check(judge_seeds(range(22, 82)))


@pytest.mark.slow
@pytest.mark.parametrize("part", range(SLOW_PARTS))
def test_more_made_up_programs_are_read_as_linuxcnc_runs_them(part: int):
    start = 1000 + part * SLOW_PART
    check(judge_seeds(range(start, start + SLOW_PART)))


@pytest.mark.parametrize("name", MISREADINGS)
def test_what_was_misread_is_not_any_more(name: str, tmp_path: Path):
    for delete in (False, True):
        found = judge(replace(written(MISREADINGS[name]), delete=delete), tmp_path)
        assert found is not None, "rs274 does not accept it"
        assert not found.differences
        assert found.known


@pytest.mark.parametrize(
    ("unit", "radius", "gap"), [("G21", 10, 0.028), ("G21", 5, 0.027), ("G20", 1, 0.0027)]
)
def test_radii_may_differ_as_linuxcnc_allows(unit: str, radius: float, gap: float, tmp_path: Path):
    for more, allowed in ((0.0, True), (0.05 * gap, False)):
        text = f"{unit} G90 G0 X0 Y0 Z0\nF100 G2 X{2 * radius + gap + more:.5f} Y0 I{radius}\nM2"
        made = written(text)
        motions, (_, arc) = execute(made, tmp_path), read(made).rows
        assert (motions is not None) == allowed
        assert (arc.code == "") == allowed
        if allowed:
            assert not compare(motions, read(made)).differences


@pytest.mark.slow
def test_numbering_the_lines_changes_no_motion(tmp_path: Path):
    compared = 0
    for seed in range(500, 512):
        made = make(seed, ("compensated",))
        numbered, plain = (execute(made, tmp_path, numbered=flag) for flag in (True, False))
        assert (numbered is None) == (plain is None)
        for one, other in zip(numbered or [], plain or [], strict=True):
            np.testing.assert_array_equal(one.end, other.end)
            assert one.kind == other.kind
            compared += 1
    assert compared > 50


def test_every_seed_makes_its_own_program_again():
    assert make(7) == make(7) != make(8)


# Planted faults

PROGRAM = written(
    "G21 G90 G17 G54 G94 F500\nT1 M6\nG0 X10 Y0 Z5\nG1 Z-1\nG1 X20 Y5\nG2 X30 Y5 I5 J-2\nG91 G1 X1.5\nG90\n"
    "G18 G3 X40 Z-5 R30\nG20 G1 X1.25 Y.5\nG0 Z1\nM2\n"
)
FIRST_FEED, ARC, INCH = 1, 3, 6


def changed(change: Callable[[list[Row]], None]) -> Callable[[Made], Reading]:
    """The reader with a fault."""

    def reader(made: Made) -> Reading:
        found = read(made)
        rows = list(found.rows)
        change(rows)
        return replace(found, rows=tuple(rows))

    return reader


def moved(row: int, by: float) -> Callable[[list[Row]], None]:
    def change(rows: list[Row]) -> None:
        rows[row] = replace(rows[row], end=rows[row].end + np.array([0.0, 0.0, by]))

    return change


def with_row(row: int, **values: object) -> Callable[[list[Row]], None]:
    def change(rows: list[Row]) -> None:
        rows[row] = replace(rows[row], **values)  # type: ignore[arg-type]

    return change


def swapped(rows: list[Row]) -> None:
    rows[FIRST_FEED], rows[FIRST_FEED + 1] = rows[FIRST_FEED + 1], rows[FIRST_FEED]


FAULTS: dict[str, tuple[Callable[[list[Row]], None], str]] = {
    "a value one last digit off": (moved(FIRST_FEED, 1e-4), "target"),
    "a value of inches off": (moved(INCH, 2e-3), "target"),
    "a motion less": (lambda rows: rows.pop(FIRST_FEED) and None, "missing"),
    "a last motion less": (lambda rows: rows.pop() and None, "missing"),
    "a motion twice": (lambda rows: rows.insert(ARC, rows[ARC]), "extra"),
    "a motion that does not run": (with_row(FIRST_FEED, line=1), "extra"),
    "two motions in the other order": (swapped, "order"),
    "a rapid for a feed": (with_row(FIRST_FEED, kind="PTP"), "kind"),
    "a line for an arc": (with_row(ARC, kind="LIN"), "kind"),
    "the other sense of an arc": (with_row(ARC, normal=np.array([0.0, 0.0, 1.0])), "arc"),
    "another plane": (with_row(ARC, normal=np.array([0.0, 1.0, 0.0])), "arc"),
    "another centre": (with_row(ARC, centre=np.array([25.0, 3.01, -1.0])), "arc"),
    "a turn more": (with_row(ARC, sweep=9.0), "arc"),
    "another work offset": (with_row(FIRST_FEED, base=2), "base"),
    "another tool": (with_row(FIRST_FEED, tool=2), "tool"),
}


def judged(reader: Callable[[Made], Reading], folder: Path) -> Comparison:
    motions = execute(PROGRAM, folder)
    assert motions is not None
    return compare(motions, reader(PROGRAM))


def test_the_program_of_the_faults_is_read_whole_and_rightly(tmp_path: Path):
    found = judged(read, tmp_path)
    assert not found.differences
    assert found.known == found.motions == 8


@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_caught(fault: str, tmp_path: Path):
    change, kind = FAULTS[fault]
    found = judged(changed(change), tmp_path)
    assert kind in {difference.kind for difference in found.differences}


def test_what_the_reader_says_it_does_not_know_is_no_difference_but_counted(tmp_path: Path):
    change = with_row(FIRST_FEED, code="GCO002", end=np.full(3, np.nan))
    found = judged(changed(change), tmp_path)
    assert not found.differences
    assert found.known == found.motions - 1


def test_a_changed_work_offset_is_not_that_of_the_cell(tmp_path: Path):
    made = written("G21 G90 G10 L2 P1 X5\nT1 M6\nG0 X1 Y1 Z1\nM2\n")
    motions = execute(made, tmp_path)
    found = read(made)
    rows = tuple(replace(row, base=1, code="") for row in found.rows)
    assert motions is not None
    assert "offset" in {one.kind for one in compare(motions, replace(found, rows=rows)).differences}
