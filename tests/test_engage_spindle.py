"""The speed of the spindle: of the process file, else the S that the program has in force at each motion."""

import csv
import json

import numpy as np
import pytest

pytest.importorskip("numba")

from test_engage_command import STOCK, call, folder, state
from test_gcode_read import read

__all__ = ["folder"]
TOOL = "tools: {1: {shape: flat, diameter: 16, length: 40, teeth: 3, helix: 30%s}}\n"
ALLOY = "defaults: {material: EN AW-7075-T6}\n"
SLOT = "G21 G90 G17 G54\nT1 M6\n%s\nG0 X-20 Y30 Z5\nG0 Z-5\nG1 X50 F3600\n%s\nG1 X120\nG0 Z30\nM2\n"


def chips(folder, *lines, spindle=""):
    """Result, and the chip of both motions in stock [mm]."""
    state(folder, STOCK + TOOL % spindle + ALLOY)
    (folder / "part.ngc").write_text(SLOT % lines)
    result = json.loads(call(folder, "--csv", folder / "out.csv", "--json", "-").stdout)
    rows = csv.DictReader((folder / "out.csv").read_text().splitlines())
    return result, [float(row["chip_mm"]) for row in rows if row["state"] == "cut"]


def codes(result):
    return {one["code"]: one for one in result["findings"] if one["code"] in ("STK020", "STK021")}


def test_the_speed_of_the_program_is_used_motion_by_motion(folder):
    """Feed per tooth f / (n z) by hand: 3600 mm/min at 12000 and 8000 1/min with 3 teeth."""
    result, found = chips(folder, "S12000 M3", "S8000")
    assert found == pytest.approx([3600 / 12000 / 3, 3600 / 8000 / 3], rel=1e-3)
    finding = codes(result)["STK020"]
    assert "8000 to 12000 1/min in 2 motions" in finding["message"]
    same, stated = chips(folder, "S12000 M3", "", spindle=", spindle: 12000")
    assert stated == pytest.approx([0.1, 0.1], rel=1e-3)
    assert codes(same) == {}


def test_a_speed_that_differs_is_reported_and_the_file_is_used(folder):
    state(folder, STOCK + TOOL % ", spindle: 12000" + ALLOY)
    (folder / "part.ngc").write_text(SLOT % ("S8000 M3", ""))
    result = json.loads(call(folder, "--csv", folder / "out.csv", "--json", "-", code=3).stdout)
    finding = codes(result)["STK021"]
    assert "S 8000" in finding["message"]
    assert "12000 1/min, which is used" in finding["message"]
    rows = csv.DictReader((folder / "out.csv").read_text().splitlines())
    assert [float(row["chip_mm"]) for row in rows if row["state"] == "cut"] == pytest.approx(
        [0.1] * 2, rel=1e-3
    )


@pytest.mark.parametrize(
    "lines", [("", ""), ("S12000 M3", "M5"), ("G96 D3000 S200 M3", ""), ("G92 S3000", "")]
)
def test_without_a_speed_the_main_job_refuses(folder, lines):
    state(folder, STOCK + TOOL % "" + ALLOY)
    (folder / "part.ngc").write_text(SLOT % lines)
    result = json.loads(call(folder, "--json", "-", code=3).stdout)
    (finding,) = [one for one in result["findings"] if one["code"] == "STK015"]
    assert "no spindle (or S in the program)" in finding["message"]


def test_modal_words():
    lines = ["G21 G90 G94 F100", "G1 X1", "S600 M3", "G1 X2", "G4 S5", "G1 X3", "M5", "G1 X4", "M3", "G1 X5"]
    text = "\n".join([*lines, "S300 G1 X6", "G96 S20", "G1 X7", "M2", ""])
    turns = read(text).toolpath.spindle * 30 / np.pi
    np.testing.assert_allclose(turns, [np.nan, 600, 600, 0, 600, 300, np.nan])
    turns = read("G21 G90 G94 F100\nM4\nG1 X1\nS600\nG1 X2\nM3 G1 X3\nM2\n").toolpath.spindle * 30 / np.pi
    np.testing.assert_allclose(turns, [-np.inf, -600, 600])


def test_the_other_way_round_is_the_mirror_image(folder):
    """Blank, path and hand of the tool mirrored in the plane of feed and spindle: so are force and moment."""
    forces = []
    for y, helix, switch in ((22.5, 30, "S12000 M3"), (37.5, -30, "S12000 M4")):
        box = [[0, 22.5, -30], [100, 60, 0]] if y == 22.5 else [[0, 0, -30], [100, 37.5, 0]]
        tool = TOOL.replace("helix: 30", f"helix: {helix}")
        state(folder, f"stock: {{box: {box}}}\n" + tool % "" + ALLOY)
        (folder / "part.ngc").write_text((SLOT % (switch, "")).replace("Y30", f"Y{y}"))
        result = json.loads(
            call(folder, "--csv", folder / "out.csv", "--json", "-", code=0 if helix > 0 else 3).stdout
        )
        assert any(one["code"] == "STK022" for one in result["findings"]) == (helix < 0)
        row = list(csv.DictReader((folder / "out.csv").read_text().splitlines()))[3]
        forces.append([float(row[k]) for k in ("fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm", "power_w")])
    assert abs(forces[0][1]) > 50
    np.testing.assert_allclose(
        np.array(forces[1]) * [1, -1, 1, -1, 1, -1, 1], forces[0], rtol=1e-3, atol=0.01
    )


def test_a_cut_with_a_spindle_that_stands_is_reported(folder):
    state(folder, STOCK + TOOL % ", spindle: 12000" + ALLOY)
    (folder / "part.ngc").write_text(SLOT % ("S12000 M3", "M5"))
    result = json.loads(call(folder, "--json", "-", code=3).stdout)
    assert [one["line"] for one in result["findings"] if one["code"] == "STK023"] == [8]
