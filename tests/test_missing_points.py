"""COR006 names what keeps further points out of a motion."""

from __future__ import annotations

import pytest
from conftest import CELL, JUMPED_LINES, LINES

FINE = CELL.replace("tolerance: 0.02", "tolerance: 0.001")
FAST = [line.replace("$VEL.CP=0.05", "$VEL.CP=0.6") for line in LINES]


@pytest.mark.parametrize(
    ("lines", "cell", "options", "why"),
    [
        (JUMPED_LINES, CELL, ("--no-insert",), "leave out --no-insert"),
        (LINES, FINE + "max_growth: 1.1\n", (), "max_growth allows no further points"),
        (LINES, FINE + "min_segment: 60\n", (), "is shorter than min_segment (60 mm)"),
        (FAST, FINE + "controller: {cycle_ms: 100}\n", (), "of the controller (60.000 mm, cycle_ms)"),
    ],
)
def test_what_keeps_points_out_is_named(compensate, job, lines, cell, options, why):
    job.cell(cell)
    job.write(lines)
    done = compensate(job.program, "--force", *options, "--json", "-")
    helps = [found["help"] for found in done.json["findings"] if found["code"] == "COR006"]
    assert done.code == 3
    assert any(why in help for help in helps), helps
