"""Readings of another robot: `identify` refuses them, whatever is asked for; those of the arm itself it does not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_sanity_checks import good

from postproc.base.findings import Refusal
from postproc.identification.campaign import Campaign
from postproc.identification.other_arm import check_arm
from postproc.model import StiffnessModel
from postproc.workflows.identify import IdentifyRequest, identify, measured_of

LOADS = Path(__file__).parent.parent / "samples" / "kr270_missing_compensator" / "loads.csv"


@pytest.mark.parametrize(("robot", "remain"), [("abb_irb6700", 69), ("ur5", 67)])
def test_deflections_of_another_arm_are_refused(robot: str, remain: int) -> None:
    measured = measured_of([LOADS], robot)
    with pytest.raises(Refusal) as caught:
        check_arm(measured.campaign, measured.model)
    (finding,) = caught.value.findings
    assert finding.code == "IDN035"
    assert f"{remain} % of the deflections remain" in finding.message


@pytest.mark.slow
def test_no_robot_file_is_written_of_them(tmp_path: Path) -> None:
    new = tmp_path / "new.yaml"
    with pytest.raises(Refusal) as caught:
        identify(
            IdentifyRequest((LOADS,), "abb_irb120", effects=("joint_compliance",), output=new, bootstrap=0)
        )
    assert caught.value.findings[0].code == "IDN035"
    assert not new.exists()


@pytest.mark.parametrize("robot", ["kuka_kr270", "kuka_kr500"])
def test_an_arm_of_nearly_the_same_lengths_is_not_refused(robot: str) -> None:
    measured = measured_of([LOADS], robot)
    bare = StiffnessModel(measured.model.robot, ())  # nothing of its stiffness is known
    check_arm(measured.campaign, bare)


@pytest.mark.parametrize("wild", [0, 1])
@pytest.mark.parametrize("kind", ["tracker", "robot", "deflections"])
def test_a_wild_reading_makes_no_other_arm(kind: str, wild: int) -> None:
    readings, asked = good(kind)
    value = readings.value.copy()
    value[:wild] += 0.8
    check_arm(Campaign(replace(readings, value=value)), asked.model)


@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_places_of_a_smaller_or_larger_arm_are_refused(factor: float) -> None:
    readings, asked = good("robot")
    with pytest.raises(Refusal) as caught:
        check_arm(Campaign(replace(readings, value=factor * readings.value)), asked.model)
    (finding,) = caught.value.findings
    assert finding.code == "IDN035"
    assert "no lengths and zeros of this arm" in finding.message
    assert np.isfinite(readings.value).all()
