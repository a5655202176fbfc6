"""`verify` where a cut runs back over its own path, and where circles are smaller than the displacement."""

from __future__ import annotations

import pytest
from conftest import CELL

FLAT = (
    CELL.replace("z: 600, a: 0", "z: 600, a: 30")
    + "orientation: {a: 0, b: 0, c: 180}\nforce: 150,-120,80@base\n"
)
HEAD = ["G21 G17 G90 G94", "G54", "G0 X100 Y100 Z50", "G1 Z0 F1000"]
CUTS = {
    "back and forth": ["G1 X150", "G1 X100", "G1 X150", "G1 X120"],
    "back at once": ["G1 X120 Y140", "G1 X100 Y100"],
    "small circles": ["G2 I0.1 J0", "G1 X110", "G2 I0.5 J0", "G1 X130 Y110"],
    "small circles one after the other": ["G3 I0 J0.2", "G3 I0 J0.2", "G1 X130 Y110"],
}


@pytest.mark.parametrize("cut", CUTS)
def test_the_original_has_a_figure(compensate, tmp_path, cut):
    """The force is the same everywhere, and so is, nearly, the displacement: the tool is beside the path by the part of
    it across the path at least; by all of it at most, but where a displaced circle goes past the line before it."""
    (tmp_path / "cell.yaml").write_text(FLAT)
    program = tmp_path / "part.nc"
    program.write_text("\n".join([*HEAD, *CUTS[cut], "G0 Z50", "M2", ""]))
    done = compensate(program, "--force", "--json", "-")
    assert done.code == 0
    size = done.json["error_before_mm"]["max"]
    judged = compensate("verify", program, tmp_path / "compensated" / "part.nc", "--force", "--json", "-")
    assert judged.code == 0
    original, after = (judged.json[name] for name in ("original", "compensated"))
    assert after["max"] < 0.02
    assert original["rms"] < original["max"] < 1.5 * size
    assert original["max"] > 0.3 * size
