"""``compensate identify``: the words of its command line, and how it ends."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.cli.main import COMMANDS
from postproc.identification.campaign import Campaign
from postproc.measurements import measurements_csv, planned, read_measurements
from postproc.model import StiffnessModel
from postproc.robot.description import find_robot, load_robot
from postproc.workflows import identify as workflow
from postproc.workflows.identify import IdentifyRequest

WORDS = ["identify", "loads.csv", "--effects", "joint_compliance"]


@pytest.fixture
def requested(compensate, monkeypatch, tmp_path):
    """``requested(*words)``: what the workflow is asked for; it refuses."""
    monkeypatch.chdir(tmp_path)

    def call(*words) -> IdentifyRequest:
        asked = []

        def refuse(request, stage, progress):
            asked.append(request)
            raise Refusal(Finding("IDN017", "nothing", "loads.csv"))

        monkeypatch.setattr(workflow, "identify", refuse)
        done = compensate(*words)
        assert done.code == 1, done.err
        assert "nothing is written" in done.err
        (request,) = asked
        return request

    return call


@pytest.fixture(scope="module")
def loads(tmp_path_factory) -> Path:
    """A small campaign: eight poses, weights of two sizes, a reading of each; one row is wrong."""
    robot = load_robot(find_robot("kuka_kr270"))
    model = StiffnessModel.from_robot(robot)
    rng = np.random.default_rng(4)
    q = np.repeat(rng.uniform(*(0.7 * robot.limits.T), (8, 6)), 2, axis=0)
    wrench = np.zeros((16, 6))
    wrench[:, 2] = np.tile([-1200.0, -2600.0], 8)
    readings = planned(
        [(joint.name, False) for joint in robot.joints],
        q,
        wrench,
        True,
        robot="kuka_kr270",
        tool=Poses(np.eye(3), np.array([0.0, 0.5, 0.2])),
        sigma=2e-5,
    )
    campaign = Campaign(readings)
    value = campaign.expected(campaign.predicted(model.with_values({(0, "c5"): 4e-6})), campaign.start())[0]
    value += 2e-5 * rng.normal(size=value.shape)
    value[5, 1] += 1e-3
    path = tmp_path_factory.mktemp("shop") / "loads.csv"
    path.write_bytes(measurements_csv(replace(readings, value=value)))
    return path


def test_identify_is_a_command(compensate):
    assert "identify" in COMMANDS
    assert "compensate identify" in compensate("--help").out
    text = compensate("identify", "--help").out
    for word in ("Examples:", "Exit codes: 0", "--effects", "--drop-outliers", "NEW.yaml"):
        assert word in text


def test_what_is_asked_for_by_default(requested):
    assert requested(*WORDS) == IdentifyRequest(
        data=(Path("loads.csv"),), robot=None, effects=("joint_compliance",)
    )


def test_every_option_arrives(requested):
    words = "identify a.csv b.csv --effects joint_compliance,gravity_compensator.K_c --robot ur5 -o new.yml"
    words += " --tool 0,500,200,90,0,0 --priors --robust --drop-outliers --validate c.csv --validate d.csv --folds 3"
    words += " --bootstrap 50 --picture left.SVG --csv left.csv --strict --json out.json"
    assert requested(*words.split()) == IdentifyRequest(
        data=(Path("a.csv"), Path("b.csv")),
        robot="ur5",
        effects=("joint_compliance", "gravity_compensator.K_c"),
        output=Path("new.yml"),
        priors=True,
        robust=True,
        drop_outliers=True,
        validate=(Path("c.csv"), Path("d.csv")),
        folds=3,
        bootstrap=50,
        tool_mm_deg=(0.0, 500.0, 200.0, 90.0, 0.0, 0.0),
        picture=Path("left.SVG"),
        csv=Path("left.csv"),
        json=Path("out.json"),
        strict=True,
    )


def test_short_forms(requested):
    request = requested(
        *WORDS[:3], "joint_offset, link_geometry.dx2", "--tool=-10,0,0", "--folds", "0", "--bootstrap", "0"
    )
    assert request.effects == ("joint_offset", "link_geometry.dx2")
    assert request.tool_mm_deg == (-10.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert (request.folds, request.bootstrap) == (0, 0)
    assert requested(*WORDS, "--json", "-").json is None


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["identify", "--effects", "joint_compliance"], ("DATA",)),
        (["identify", "loads.csv"], ("--effects",)),
        ([*WORDS[:3], ""], ("--effects", "empty name")),
        ([*WORDS[:3], "joint_compliance,"], ("--effects", "empty name")),
        ([*WORDS[:3], "backlash,joint_offset,backlash"], ("--effects", "twice")),
        ([*WORDS, "-o", "new.txt"], ("must end in .yaml or .yml",)),
        ([*WORDS, "-o", "new"], ("must end in .yaml or .yml",)),
        ([*WORDS, "--tool", "0,300"], ("2 numbers", "x,y,z")),
        ([*WORDS, "--tool", "0,0,nan"], ("'nan' is not a number",)),
        ([*WORDS, "--folds", "1"], ("--folds", "2 or more")),
        ([*WORDS, "--folds", "-1"], ("--folds",)),
        ([*WORDS, "--folds", "2.5"], ("--folds",)),
        ([*WORDS, "--bootstrap", "3"], ("--bootstrap", "20 or more")),
        ([*WORDS, "--bootstrap", "many"], ("--bootstrap",)),
        ([*WORDS, "--picture", "left.jpg"], ("must end in .png or .svg",)),
        ([*WORDS, "--csv", "left.xlsx"], ("must end in .csv",)),
        ([*WORDS, "--json", "left.csv"], ("must end in .json",)),
        ([*WORDS, "--validate"], ("--validate",)),
        ([*WORDS, "--effect", "x"], ("--effect",)),
    ],
)
def test_wrong_command_line(compensate, tmp_path, monkeypatch, words, told):
    monkeypatch.chdir(tmp_path)
    done = compensate(*words)
    assert done.code == 2, done.out + done.err
    missing = [word for word in told if word not in done.err]
    assert not missing, done.err
    assert done.out == ""
    assert list(tmp_path.iterdir()) == []


def test_a_run(compensate, loads, tmp_path):
    files = {name: tmp_path / f"left.{name}" for name in ("csv", "png")}
    words = [
        "identify",
        loads,
        "--effects",
        "joint_compliance",
        "--drop-outliers",
        "--bootstrap",
        "20",
        "--folds",
        "4",
    ]
    done = compensate(*words, "--csv", files["csv"], "--picture", files["png"])
    assert done.code == 3, done.err
    assert done.out.startswith("5 of 6 parameters found. The residual falls from ")
    assert "excluded     joint_compliance.c1" in done.out
    assert "1 outlier (excluded)" in done.out
    for file in files.values():
        assert f"wrote {file}" in done.out
        assert file.stat().st_size > 1000
    straight = compensate(*words, "--json", "-")
    assert straight.code == 3
    found = json.loads(straight.out)
    assert abs(found["effects"]["joint_compliance"]["c5"]["value"] - 4e-6) < 2e-7
    assert [one["name"] for one in found["dropped"]] == ["joint_compliance.c1"]
    lines = loads.read_text().splitlines()
    header = next(line for line in lines if line.startswith("A1"))
    assert found["outliers"][0]["line"] == lines.index(header) + 1 + 6
    assert (found["folds"], found["bootstrap"], found["exit"]) == (4, {"draws": 20}, 3)


@pytest.mark.slow
def test_all_found(compensate, loads):
    words = ["identify", loads, "--effects", "joint_compliance.c5", "--drop-outliers", "--bootstrap", "0"]
    done = compensate(*words)
    assert done.code == 0, done.out
    assert done.out.startswith("The parameter was found.")
    assert compensate(*words, "-q").out == ""


def test_a_file_to_validate_with_is_checked_as_the_others(compensate, loads, tmp_path):
    readings = read_measurements(loads, [(f"A{k}", False) for k in range(1, 7)])
    wrong, new = tmp_path / "metres.csv", tmp_path / "new.yaml"
    wrong.write_bytes(measurements_csv(replace(readings, value=readings.value / 1e3)))
    done = compensate(
        "identify",
        loads,
        "--effects",
        "joint_compliance.c5",
        "--bootstrap",
        "0",
        "--validate",
        wrong,
        "-o",
        new,
    )
    assert done.code == 1, done.out
    assert "metres.csv" in done.err
    assert "in metres" in done.err
    assert not new.exists()


def test_a_tool_that_the_readings_contradict_is_reported(compensate, loads):
    words = ["identify", loads, "--effects", "joint_compliance.c5", "--bootstrap", "0", "--tool"]
    done = compensate(*words, "0,0,200")
    assert "IDN036 --tool is ignored: the readings state the tool 0 500 200 0 0 0" in done.err + done.out
    assert "IDN036" not in compensate(*words, "0,500,200").out


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_readings_that_are_fitted_validate_nothing(compensate, loads, tmp_path, command):
    copy = tmp_path / "copy.csv"
    copy.write_bytes(loads.read_bytes() + b"\n")
    words = [command, loads, "--validate", copy, "-o", tmp_path / "new.yaml"]
    done = compensate(*words, *(["--effects", "joint_compliance"] if command == "identify" else []))
    assert done.code == 1
    assert "copy.csv MEA008 all readings of the file are fitted" in done.err
    assert not (tmp_path / "new.yaml").exists()


def test_what_can_not_be_done(compensate, loads, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for words, told in (
        (["identify", "none.csv", "--effects", "joint_compliance"], ("FIL001", "none.csv")),
        (["identify", loads, "--effects", "joint_complaince"], ("IDN001", "did you mean 'joint_compliance'")),
        (
            ["identify", loads, "--effects", "joint_compliance", "--robot", "kuka_kr27"],
            ("CEL003", "kuka_kr270"),
        ),
    ):
        done = compensate(*words, "-o", "new.yaml", "--csv", "left.csv")
        assert done.code == 1
        for word in (*told, "nothing is written"):
            assert word in done.err
        assert list(tmp_path.iterdir()) == []
        refused = compensate(*words, "--json", "-")
        assert refused.code == 1
        assert refused.json["findings"][0]["code"] == told[0]
