"""Operations that a cell names in force_factors and tool_errors, held against those of the program."""

from __future__ import annotations

import pytest
from conftest import CELL, LINES

PROGRAM = [
    line.replace(";FORCE -360", "; OPERATION 1 - OUTSIDE CONTOUR ROUGHING\r\n;FORCE -360")
    .replace("LIN {X 200.000,Y 150", "; OPERATION 2 - WALL B\r\nLIN {X 200.000,Y 150")
    for line in LINES
]  # fmt: skip


@pytest.mark.parametrize(
    ("stated", "codes", "words"),
    [
        ('force_factors: {"OUTSIDE CONTOUR ROUHGING": {factor: 1.2}}', ["CEL015"], "did you mean 'OUTSIDE CONTOUR R"),
        ('force_factors: {OUTSIDE: {factor: 1.2}}', ["CEL015"], "did you mean 'OUTSIDE CONTOUR ROUGHING'"),
        ('force_factors: {"wall b": {factor: 1.2}, SLOT: {factor: 1}}', ["CEL016", "FRC039"], "this program: SLOT"),
        ('force_factors: {"WALL A": {factor: 1.2}}', ["CEL015"], "no operation of force_factors is in the program"),
        ('force_factors: {"WALL A": {factor: 1.2}, others: {factor: 1.1}}', ["CEL016", "FRC039"], "program: WALL A"),
        ('tool_errors: {1: {radius: 0.1, walls: {WALLS: left, "WALL B": left, others: right}}}', ["CEL016"], "WALLS"),
        ('tool_errors: {1: {radius: 0.1, walls: {CONTOUR: left, others: right}}}', ["CEL015"], "tool_errors: 1: walls"),
        ('tool_errors: {2: {radius: 0.1, walls: {CONTOUR: left}}}', [], ""),
    ],
)  # fmt: skip
def test_names_that_the_program_does_not_have_are_reported(compensate, job, stated, codes, words):
    job.cell(CELL + stated + "\n")
    job.write(PROGRAM)
    done = compensate("predict", job.program, "--force", "--json", "-")
    found = [one for one in done.json["findings"] if one["code"] in ("CEL015", "CEL016", "FRC039")]
    assert [one["code"] for one in found] == codes
    assert words in " | ".join(one["message"] for one in found)
    assert all(one["line"] == CELL.count("\n") + 1 for one in found)
