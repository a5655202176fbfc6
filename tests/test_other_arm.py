"""Readings of another robot: `identify` refuses them, whatever is asked for; those of the arm itself it does not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blind.other_arms import COBOT, World, csv_of, drawn_poses
from test_sanity_checks import good

from postproc.base.findings import Refusal
from postproc.identification.campaign import Campaign
from postproc.identification.mounting import check_mounting
from postproc.identification.other_arm import check_arm
from postproc.measurements import measurements_csv
from postproc.model import StiffnessModel
from postproc.workflows.diagnose import DiagnoseRequest, diagnose_robot
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


def places_of(robot: str):
    """What was measured, with the places of the TCP instead of deflections, and these (R, 3) [m]."""
    measured = measured_of([LOADS], robot)
    readings = measured.readings
    places = (measured.model.chain.flange(readings.q) @ measured.campaign.tool).position
    bare = replace(
        readings, value=places, deflection=False, in_robot_frame=True, wrench=np.zeros_like(readings.wrench)
    )
    return bare, StiffnessModel(measured.model.robot, ())


def test_readings_of_other_poses_are_not_diagnosed_as_a_missing_effect(tmp_path: Path) -> None:
    """All measured values were one pose below their angles: it was reported that an effect is missing."""
    readings, _ = places_of("kuka_kr270")
    shifted = replace(readings, value=np.roll(readings.value, 1, axis=0))
    file = tmp_path / "shifted.csv"
    file.write_bytes(measurements_csv(shifted))
    with pytest.raises(Refusal) as caught:
        diagnose_robot(DiagnoseRequest(data=(file,), robot="kuka_kr270"))
    assert caught.value.findings[0].code == "IDN035"


@pytest.mark.parametrize(("later", "moved"), [(1.0, True), (1e-3, False)])
def test_a_tracker_was_moved_only_where_that_explains_the_readings(
    tmp_path: Path, later: float, moved: bool
) -> None:
    """Of readings whose later half was in metres 360 mm remained with two stations: the tripod was blamed."""
    rng = np.random.default_rng(5)
    robot, data = tmp_path / "robot.yaml", tmp_path / "data.csv"
    robot.write_bytes(COBOT.file())
    data.write_bytes(csv_of(World.of(COBOT), drawn_poses(COBOT, 30, rng), rng))
    measured = measured_of([data], str(robot))
    value = measured.readings.value.copy()
    half = np.arange(len(value)) >= len(value) // 2
    value[half] = later * value[half] + [0.05, -0.02, 0.01]
    tracked = Campaign(replace(measured.readings, value=value))
    codes = [finding.code for finding in check_mounting(tracked, measured.model).findings]
    assert codes == (["IDN033"] if moved else [])
