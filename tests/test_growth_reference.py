"""Zero points of what readings are taken under: temperatures count from that of the calibration, as in a job, and the
order of the rows ends with a file."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from warm_arm import REFERENCE, SIGMA, STATED, TRUE, robot, written

from postproc.identification.campaign import Campaign, sense_of
from postproc.measurements import joined, read_measurements
from postproc.robot.description import load_robot
from postproc.workflows.diagnose import DiagnoseRequest, diagnose_robot
from postproc.workflows.identify import IdentifyRequest, identify

JOINTS = [(f"A{i}", False) for i in range(1, 7)]


def codes(findings) -> dict[str, str]:
    return {finding.code: finding.message for finding in findings}


def growth_of(result) -> tuple[float, float]:
    (found,) = [e for e in result.after.estimates if e.unknown.name == "thermal_growth.g2"]
    return found.value, found.ci95


@pytest.mark.parametrize("start", [20.0, 30.0, 12.0])
@pytest.mark.parametrize("frame", ["robot", "tracker"])
def test_growth_counts_from_the_reference_and_not_from_the_first_reading(tmp_path, start, frame):
    data = written(tmp_path / "warm.csv", start, 5, frame=frame)
    asked = IdentifyRequest((data,), robot(tmp_path, REFERENCE), effects=("thermal_growth.g2",), bootstrap=0)
    result = identify(asked)
    value, ci95 = growth_of(result)
    assert ci95 < 2e-6
    assert value == pytest.approx(TRUE, abs=2 * ci95)
    assert not {"IDN029", "IDN037", "IDN038"} & set(codes(result.findings))


def test_a_file_that_is_predicted_counts_from_the_same_temperature(tmp_path):
    data, other = written(tmp_path / "a.csv", 30.0, 5), written(tmp_path / "b.csv", 38.0, 6)
    for options in (REFERENCE, "{variable: temperature}"):
        file = robot(tmp_path, options)
        asked = IdentifyRequest(
            (data,), file, effects=("thermal_growth.g2", "link_geometry.dx2", "link_geometry.dy2"), bootstrap=0,
            validate=(other,),
        )  # fmt: skip
        result = identify(asked)
        assert np.sqrt(np.mean(result.validation.after**2)) < 2 * SIGMA, options
    found = diagnose_robot(DiagnoseRequest((data,), robot(tmp_path, REFERENCE, STATED), validate=(other,)))
    assert found.validation[0].after.rms < 2 * np.sqrt(3) * SIGMA


def test_growth_that_the_robot_file_states_is_no_geometry(tmp_path):
    data = written(tmp_path / "warm.csv", 30.0, 5)
    known = diagnose_robot(DiagnoseRequest((data,), robot(tmp_path, REFERENCE, STATED)))
    assert known.diagnosis.verdict.word == "nothing_missing"
    found = diagnose_robot(DiagnoseRequest((data,), robot(tmp_path, REFERENCE)))
    assert [(n.effect, n.joints) for n in found.diagnosis.verdict.named] == [("thermal_growth", ("A2",))]
    assert not {"IDN037", "IDN038"} & set(codes([*known.findings, *found.findings]))


def test_without_a_reference_it_is_said_from_where_growth_counts(tmp_path):
    data, new = written(tmp_path / "warm.csv", 30.0, 5), tmp_path / "new.yaml"
    file = robot(tmp_path, "{variable: temperature}", STATED)
    asked = IdentifyRequest(
        (data,),
        file,
        new,
        effects=("thermal_growth.g2", "link_geometry.dx2", "link_geometry.dy2"),
        bootstrap=0,
    )
    result = identify(asked)
    value, ci95 = growth_of(result)
    assert value == pytest.approx(TRUE, abs=2 * ci95)
    assert "first reading, 30 degC" in codes(result.findings)["IDN037"]
    assert "growth counted from 30 degC" in re.sub(r"\s+", " ", new.read_text())
    found = diagnose_robot(DiagnoseRequest((data,), file))
    assert "first reading, 30 degC" in codes(found.findings)["IDN037"]


@pytest.mark.parametrize(
    ("options", "unit", "column"), [(REFERENCE, "m/K", "TEMP"), ("{variable: time}", "m/s", "T")]
)
def test_growth_without_its_column_is_reported(tmp_path, options, unit, column):
    data = written(tmp_path / "bare.csv", 30.0, 5, column="")
    file = robot(tmp_path, options, STATED.replace("m/K", unit))
    for result in (
        identify(IdentifyRequest((data,), file, effects=("link_geometry.dx2",), bootstrap=0)),
        diagnose_robot(DiagnoseRequest((data,), file)),
    ):
        assert f"no column {column}" in codes(result.findings)["IDN038"]
        assert result.exit == 3
    measured = written(tmp_path / "warm.csv", 30.0, 6, column)
    asked = IdentifyRequest((measured,), file, effects=("link_geometry.dx2",), bootstrap=0)
    assert "IDN038" not in codes(identify(asked).findings)


def test_readings_that_are_taken_out_leave_the_zero_points_where_they_were(tmp_path):
    readings = replace(
        read_measurements(written(tmp_path / "warm.csv", 30.0, 5), JOINTS), time=np.linspace(500.0, 600.0, 50)
    )
    rest = Campaign(readings.part(np.arange(4, 50)))
    given = rest.conditions.part(rest.at)
    np.testing.assert_allclose(given.temperature, np.repeat(0.4 * np.arange(2, 25), 2), atol=1e-9)
    np.testing.assert_allclose(given.time, np.linspace(500.0, 600.0, 50)[4:] - 500.0, atol=1e-9)


def test_no_joint_came_to_the_first_pose_of_a_file_from_the_last_one_of_another(tmp_path):
    files = [written(tmp_path / f"{name}.csv", 20.0, seed) for seed, name in enumerate("ab")]
    several = [read_measurements(path, JOINTS) for path in files]
    sense = sense_of(joined(several))
    for part, one in zip((sense[:50], sense[50:]), several, strict=True):
        travel = np.sign(np.diff(one.q[::2], axis=0))
        np.testing.assert_array_equal(part[::2], np.concatenate([np.zeros((1, 6)), travel]))
        np.testing.assert_array_equal(part[1::2], part[::2])


def test_sides_by_the_order_of_rows_predict_other_readings_too(tmp_path):
    """Where the order of the rows shows a lag, other readings are predicted with it."""
    data, other = (written(tmp_path / f"{k}.csv", 20.0, k, column="", lag=2e-4) for k in (7, 8))
    file = robot(tmp_path, REFERENCE)
    found = diagnose_robot(DiagnoseRequest((data,), file, validate=(other,)))
    assert "order of the rows" in codes(found.findings)["DIA003"]
    assert found.validation[0].after.rms < 3 * np.sqrt(3) * SIGMA
    assert found.validation[0].before.rms > 6 * np.sqrt(3) * SIGMA
    assert load_robot(Path(file)).name == "kuka_kr270"
