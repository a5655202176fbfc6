"""Robot files with numbers that built hardware does not have."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from postproc.model.stiffness import StiffnessModel
from postproc.robot.description import load_robot

ARM = (Path(__file__).parent.parent / "robots" / "kuka_kr270.yaml").read_text()
C2 = "value: 0.302e-6, unit: rad/(N m), ci: 0.004e-6, ci_level: unstated"

GAP = "  - {effect: backlash, parameters: {b1: {value: 0.5, unit: deg, source: none}}}\n"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("d1: 750", "d1: 0.75", "geometry.kuka.d1 is 0.75 mm"),
        ("a3: -55", "a3: -0.055", "geometry.kuka.a3 is -0.055 mm"),
        (C2, "value: 0.302e-9, unit: rad/(N m)", "joint_compliance.c2 is 3.02e-10"),
        (C2, "value: 0.302e-2, unit: rad/(N m)", "joint_compliance.c2 is 0.00302"),
        (
            "value: 458.00, unit: mm, ci: 27.0",
            "value: 0.458, unit: mm, ci: 0.027",
            "gravity_compensator.s0 is 0.000458",
        ),
        ("value: 184.72, unit: mm", "value: 0.18472, unit: mm", "gravity_compensator.L is 0.00018472"),
        ("kuka: {unit: mm,", "kuka: {unit: m,", "the arm is 3179 m long"),
        (
            "  A3: [-119, 155]",
            "  A3: {limits: [-119, 155], offset: 1.5708}",
            "joints.A3: the offset is 1.5708 deg, a round number if it is 1.5708 rad",
        ),
        (
            "effects:\n",
            "effects:\n" + GAP,
            "backlash.b1 is 0.00872665 rad; built hardware has 0 to 0.004 rad",
        ),
    ],
)
def test_a_number_in_another_unit_is_reported(tmp_path, old, new, said):
    assert ARM.count(old) == 1
    path = tmp_path / "arm.yaml"
    path.write_text(ARM.replace(old, new))
    findings = StiffnessModel.from_robot(load_robot(path)).plausibility_findings()
    assert [finding.code for finding in findings] == ["MOD004"]
    assert said in findings[0].message


@pytest.mark.parametrize(("unit", "many"), [("deg", 4), ("rad", 0)])
def test_an_angle_of_a_table_that_is_in_radians_is_reported(tmp_path, unit, many):
    """Four quarter turns; the two angles of zero are zero in both."""
    rows = "".join(
        f"      - {{a: 100, alpha: {angle}, d: 700}}\n" for angle in (-1.5708, 0, 1.5708, -1.5708, 1.5708, 0)
    )
    table = f"  dh:\n    unit: mm\n    angle_unit: {unit}\n    rows:\n{rows}"
    path = tmp_path / "arm.yaml"
    path.write_text(re.sub(r"  kuka: .*\n", table, ARM.partition("effects:")[0]) + "effects: []\n")
    found = StiffnessModel.from_robot(load_robot(path)).plausibility_findings()
    assert sum("a round number if it is" in finding.message for finding in found) == many


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (C2, "value: 0, unit: rad/(N m)"),
        (C2, "value: 1e-12, unit: rad/(N m), ci95: 1e-7"),  # identified, and not distinguished from none
        ("a3: -55", "a3: 0"),
    ],
)
def test_what_is_not_there_is_plausible(tmp_path, old, new):
    path = tmp_path / "arm.yaml"
    path.write_text(ARM.replace(old, new))
    assert StiffnessModel.from_robot(load_robot(path)).plausibility_findings() == []


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parent.parent / "robots").glob("*.yaml")), ids=lambda p: p.stem
)
def test_robots_of_the_package_are_plausible(path):
    assert StiffnessModel.from_robot(load_robot(path)).plausibility_findings() == []
