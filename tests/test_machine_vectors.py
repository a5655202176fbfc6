"""Tool vectors in the axes of the machine (ORIMKS), in cells whose bases are rotated against these or not."""

from pathlib import Path

import pytest
from test_tool_weights import ARM, COMPLIANCE

import postproc

PROGRAM = """G90 G71 G17 G94 G54 T1 D1
TRAORI
{mode}
G0 X0 Y0 Z50 A3=0 B3=0 C3=1
G1 Z0 F1000
G1 X50 A3=0.1 B3=0 C3=1
ORIWKS
G1 X60 A3=0.1 B3=0 C3=1
M30
"""


def run(folder: Path, mode: str, base: str, robot_base: str = "") -> tuple[list[str], list[str]]:
    """Findings of tool vectors, and what becomes of the motions of the cut."""
    (folder / "arm.yaml").write_text(ARM + COMPLIANCE)
    (folder / "cell.yaml").write_text(
        f"""robot: arm.yaml
{robot_base}
tools: {{1: {{x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: -z}}}}
bases: {{1: {{x: 1450, y: -100, z: 600, {base}}}}}
start: [0, -90, 90, 0, 45, 0]
orientation: {{a: 0, b: 0, c: 180}}
"""
    )
    path = folder / "p.mpf"
    path.write_text(PROGRAM.format(mode=mode))
    report = postproc.compensate(path, force="0,0,-100@base", dry_run=True)
    found = [one.message for one in report.findings if one.code == "GCO013"]
    return found, report.table()["state"][1:].tolist()


FLAT = "a: 0, b: 0, c: 0"


@pytest.mark.parametrize("base", ["a: 30, b: 0, c: 0", "a: 0, b: 1, c: 0"])
def test_a_vector_of_the_machine_on_a_rotated_base_is_not_certain(tmp_path: Path, base: str) -> None:
    (message,), states = run(tmp_path, "ORIMKS", base)
    assert "ORIMKS" in message
    assert "3 motions" in message
    assert states == ["uncorrected"] * 3
    assert run(tmp_path, "ORIWKS", base) == ([], ["corrected"] * 3)


def test_on_a_base_with_the_axes_of_the_machine_it_is(tmp_path: Path) -> None:
    assert run(tmp_path, "ORIMKS", FLAT) == ([], ["corrected"] * 3)


def test_the_robot_may_stand_rotated_as_well(tmp_path: Path) -> None:
    found, _ = run(tmp_path, "ORIMKS", FLAT, "robot_base: {x: 0, y: 0, z: 0, a: 90, b: 0, c: 0}")
    assert len(found) == 1
