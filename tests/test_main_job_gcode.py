"""The main job on G-code: configuration, arcs, orientation."""

from __future__ import annotations

import pytest
from conftest import CELL

FLAT = CELL + "orientation: {a: 0, b: 0, c: 180}\nmax_growth: 20\n"


def test_a_move_to_an_unknown_place_does_not_lose_the_configuration(compensate, job):
    job.cell(FLAT)
    lines = ["G21 G90 G17 G54", "T1 M6", "G0 Z50.", "G28 Z50.", "G0 X0. Y0. Z50.", "G1 Z0. F500",
             "(FORCE 100 100 200 @BASE)", "G1 X100.", "G0 Z50.", "(FORCE OFF)", "M30"]  # fmt: skip
    program = job.write(lines, "\n", "part.ngc")
    done = compensate(program, "--force", "--json", "-")
    assert done.json["corrected"] == 1, done.out + done.err
    # nor is it told that a rapid motion under a force is not corrected
    assert not [f for f in done.json["findings"] if f["code"] in ("KIN004", "FRC009")]


def test_an_arc_through_a_point_is_corrected_as_one(compensate, job):
    job.cell(FLAT)
    lines = ["G17 G54 G90 G710", "T1 M6", "G0 X0 Y0 Z50", "G1 Z0 F500", ";FORCE 100 100 200 @base",
             "CIP X200 Y0 Z0 I1=100 J1=100 K1=0", ";FORCE OFF", "G0 Z50", "M30"]  # fmt: skip
    program = job.write(lines, "\n", "part.mpf")
    done = compensate(program, "--force", "--json", "-")
    assert (done.code, done.json["corrected"], done.json["uncorrected"]) == (0, 1, 0), done.out
    verified = compensate(
        "verify", program, job.folder / "compensated" / "part.mpf", "--force", "--json", "-"
    )
    assert verified.json["original"]["max"] > 0.3
    assert verified.json["compensated"]["max"] <= 0.02


@pytest.mark.slow
def test_what_remains_of_the_orientation_is_told(compensate, job):
    """A three-axis program can not turn the tool back."""
    job.cell(FLAT)
    lines = ["G21 G90 G17 G54", "T1 M6", "G0 X0. Y0. Z50.", "G1 Z0. F500", "(FORCE 300 100 200 @BASE)", "G1 X50.",
             "(FORCE OFF)", "G0 Z50.", "M30"]  # fmt: skip
    program = job.write(lines, "\n", "part.ngc")
    report = compensate(program, "--force", "--json", "-").json
    assert report["error_after_mm"]["max"] <= 0.002
    assert report["angle_after_deg"]["max"] > 0.5 * report["angle_before_deg"]["max"] > 0.01


def test_without_an_orientation_in_the_cell_it_is_asked_for(compensate, job):
    lines = ["G21 G90 G17 G54", "T1 M6", "G0 X0. Y0. Z50.", "G1 Z0. F500", "(FORCE 300 100 200 @BASE)", "G1 X50.",
             "(FORCE OFF)", "G0 Z50.", "M30"]  # fmt: skip
    program = job.write(lines, "\n", "part.ngc")
    done = compensate(program, "--force")
    assert done.code == 1
    assert "orientation" in done.err
    assert job.nothing_written()
