"""``compensate diagnose``: the words of its command line, its files, and how it ends."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.cli.main import COMMANDS
from postproc.diagnosis.diagnosis import Diagnosis, diagnose
from postproc.identification.campaign import Campaign
from postproc.measurements import measurements_csv, planned, read_measurements
from postproc.model import StiffnessModel, approach
from postproc.robot.description import find_robot, load_robot
from postproc.workflows import diagnose as workflow
from postproc.workflows import next_poses
from postproc.workflows.diagnose import DiagnoseRequest
from postproc.workflows.identify import measured_of

WORDS = ["diagnose", "loads.csv"]
SIGMA = 2e-5


@pytest.fixture
def requested(compensate, monkeypatch, tmp_path):
    """``requested(*words)``: what the workflow is asked for; it refuses."""
    monkeypatch.chdir(tmp_path)

    def call(*words) -> DiagnoseRequest:
        asked = []

        def refuse(request, stage):
            asked.append(request)
            raise Refusal(Finding("DIA001", "3 poses are too few", "loads.csv"))

        monkeypatch.setattr(workflow, "diagnose_robot", refuse)
        done = compensate(*words)
        assert done.code == 1, done.err
        assert "nothing is written" in done.err
        (request,) = asked
        return request

    return call


@pytest.fixture(scope="module")
def shop(tmp_path_factory) -> Path:
    """A folder with the readings of an arm with a compensator, and a robot file that knows only its drawing."""
    folder = tmp_path_factory.mktemp("shop")
    file = find_robot("kuka_kr270")
    text, _, _ = file.read_text().partition("  - effect: gravity_compensator")
    spring = {"name": "spring", "kind": "gravity_compensator", "joint": "A2", "source": "drawing"}
    sizes = {"L": 184.72, "a_x": 685.93, "a_y": 120.3}
    spring |= {name: {"value": value, "unit": "mm"} for name, value in sizes.items()}
    (folder / "shop.yaml").write_text(text + yaml.safe_dump({"mechanisms": [spring]}))
    robot, rng = load_robot(file), np.random.default_rng(1)
    q = rng.uniform(*robot.limits.T, (24, 6))
    wrench = np.zeros((24, 6))
    wrench[:, 2] = -2600.0
    joints = [(joint.name, False) for joint in robot.joints]
    readings = planned(joints, q, wrench, True, tool=Poses(np.eye(3), np.array([0.0, 0.5, 0.2])), sigma=SIGMA)
    campaign = Campaign(readings)
    value = campaign.expected(campaign.predicted(StiffnessModel.from_robot(robot)), campaign.start())[0]
    readings = replace(readings, value=value + SIGMA * rng.normal(size=value.shape))
    (folder / "loads.csv").write_bytes(measurements_csv(readings))
    (folder / "few.csv").write_bytes(measurements_csv(readings.part(slice(6))))
    return folder


def words_for(shop, *more):
    return ["diagnose", shop / "loads.csv", "--robot", shop / "shop.yaml", *more]


def test_diagnose_is_a_command(compensate):
    assert "diagnose" in COMMANDS
    assert "compensate diagnose" in compensate("--help").out
    text = compensate("diagnose", "--help").out
    for word in ("Examples:", "Exit codes: 0", "--next-poses", "NEW.yaml", "ambiguous"):
        assert word in text


def test_what_is_asked_for_by_default(requested):
    assert requested(*WORDS) == DiagnoseRequest(data=(Path("loads.csv"),))


def test_every_option_arrives(requested):
    words = "diagnose a.csv b.csv --robot ur5 -o new.yml --next-poses which.CSV --tool 0,500,200,90,0,0"
    words += " --picture why.SVG --csv left.csv --strict --json out.json"
    assert requested(*words.split()) == DiagnoseRequest(
        data=(Path("a.csv"), Path("b.csv")),
        robot="ur5",
        output=Path("new.yml"),
        next_poses=Path("which.CSV"),
        tool_mm_deg=(0.0, 500.0, 200.0, 90.0, 0.0, 0.0),
        picture=Path("why.SVG"),
        csv=Path("left.csv"),
        json=Path("out.json"),
        strict=True,
    )
    assert requested(*WORDS, "--json", "-").json is None


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["diagnose"], ("DATA",)),
        ([*WORDS, "-o", "new.txt"], ("must end in .yaml or .yml",)),
        ([*WORDS, "--next-poses", "which.xlsx"], ("must end in .csv",)),
        ([*WORDS, "--tool", "0,300"], ("2 numbers", "x,y,z")),
        ([*WORDS, "--picture", "why.jpg"], ("must end in .png or .svg",)),
        ([*WORDS, "--csv", "left.xlsx"], ("must end in .csv",)),
        ([*WORDS, "--json", "left.csv"], ("must end in .json",)),
        ([*WORDS, "--effects", "backlash"], ("--effects",)),
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


def test_a_run(compensate, shop, tmp_path):
    before = {path.name: path.read_bytes() for path in shop.iterdir()}
    files = {name: tmp_path / f"why.{name}" for name in ("yaml", "csv", "png", "json")}
    more = ["-o", files["yaml"], "--csv", files["csv"], "--picture", files["png"], "--json", files["json"]]
    done = compensate(*words_for(shop, *more))
    assert done.code == 0, done.out + done.err
    assert done.out.startswith("named: gravity_compensator on A2\n")
    for file in files.values():
        assert f"wrote {file}" in done.out
        assert file.stat().st_size > 1000
    found = json.loads(files["json"].read_text())
    assert (found["verdict"], found["exit"], found["robot_file"]) == ("named", 0, str(files["yaml"]))
    assert found["outputs"] == [str(file) for file in files.values()]
    assert [named["effect"] for named in found["named"]] == ["gravity_compensator"]
    # the robot file says what the report says, and explains the readings
    new = load_robot(files["yaml"])
    values = StiffnessModel.from_robot(new).terms[1].values
    for name, one in found["named"][0]["parameters"].items():
        assert values[name] == pytest.approx(one["value"], rel=1e-4)
    gap = new.identified[-1].gap
    assert gap["held_out_after_rms_mm"] == pytest.approx(found["gap"]["held_out_after_rms_mm"], rel=1e-4)
    again = compensate("diagnose", shop / "loads.csv", "--robot", files["yaml"], "--json", "-")
    assert again.code == 0, again.err
    assert again.json["verdict"] == "nothing_missing"
    assert again.json["gap"]["before_rms_mm"] == pytest.approx(found["gap"]["after_rms_mm"], rel=0.05)
    rows = list(csv.DictReader(io.StringIO(files["csv"].read_text())))
    size = np.sqrt(np.mean([float(row["after_mm"]) ** 2 for row in rows]))
    assert size == pytest.approx(found["gap"]["after_rms_mm"], abs=1e-6)
    assert {path.name: path.read_bytes() for path in shop.iterdir()} == before


@pytest.fixture(scope="module")
def found(shop) -> Diagnosis:
    measured = measured_of([shop / "loads.csv"], str(shop / "shop.yaml"))
    return diagnose(measured.campaign, measured.model)


@pytest.fixture
def named(found, monkeypatch):
    """The diagnosis of these readings, made once."""
    monkeypatch.setattr(workflow, "diagnose", lambda campaign, model, stage: found)


@pytest.fixture
def undecided(found, monkeypatch):
    """The same, but the compensator might be something else as well."""
    (one,) = found.verdict.named
    other = next(c for c in found.search.linear.candidates if (c.name, c.joint) == ("link_compliance", "A2"))
    verdict = replace(found.verdict, word="ambiguous", alternatives=((one.candidate, other),))
    doubted = replace(found, verdict=verdict, final=found.search.base, agreed=False)
    monkeypatch.setattr(workflow, "diagnose_sides", lambda campaign, model, stage: (doubted, ()))
    monkeypatch.setattr(next_poses, "CANDIDATES", 100)


@pytest.mark.parametrize("command", [("diagnose",), ("identify", "--effects", "joint_compliance")])
@pytest.mark.parametrize(("name", "kind"), [("part.src", "a program (krl)"), ("arm.yaml", "a YAML file")])
def test_a_program_in_the_place_of_readings_is_refused(compensate, tmp_path, command, name, kind):
    (tmp_path / name).write_text("DEF part()\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\nEND\n")
    done = compensate(command[0], tmp_path / name, *command[1:], "-o", tmp_path / "new.yaml")
    assert done.code == 1
    assert f"MEA013 this is {kind}" in done.err
    assert not (tmp_path / "new.yaml").exists()


@pytest.mark.slow
def test_what_can_not_be_told_apart_is_planned(compensate, shop, tmp_path, undecided, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = compensate(*words_for(shop, "-o", "new.yaml", "--json", "why.json"))
    assert done.code == 3, done.err
    plan = tmp_path / "new.next_poses.csv"
    assert {path.name for path in tmp_path.iterdir()} == {plan.name, "why.json"}, "no guess is written"
    found = json.loads((tmp_path / "why.json").read_text())
    assert (found["robot_file"], found["next_poses_file"], found["exit"]) == (None, plan.name, 3)
    joints = [(f"A{k}", False) for k in range(1, 7)]
    shown = re.sub(r",(?=,|$)", ",0", plan.read_text(), flags=re.M)
    (tmp_path / "filled.csv").write_text(shown)
    q = np.degrees(read_measurements(tmp_path / "filled.csv", joints).q)
    told = [[pose[name] for name, _ in joints] for pose in found["next_poses"]]
    np.testing.assert_allclose(q, told, atol=1e-4)
    measured_q = np.degrees(read_measurements(shop / "loads.csv", joints).q)
    room = 0.05 * np.ptp(measured_q, axis=0) + 1e-6
    outside = ((q < measured_q.min(axis=0) - room) | (q > measured_q.max(axis=0) + room)).any(axis=0)
    assert found["next_poses_beyond"] == [f"A{k + 1}" for k in np.flatnonzero(outside)]
    assert (
        max(pose["load_kg"] for pose in found["next_poses"])
        <= np.linalg.norm(read_measurements(shop / "loads.csv", joints).wrench[:, :3], axis=1).max() / 9.8
        + 0.1
    )
    assert f"({plan.name})" in done.out
    # filled in and forgotten, it is not replaced by an empty one
    plan.write_text(shown)
    again = compensate(*words_for(shop, "-o", "new.yaml"))
    assert (again.code, "FIL017" in again.err) == (1, True)
    assert plan.read_text() == shown
    # without a name for it, it is shown and not written
    alone = compensate(*words_for(shop))
    assert "--next-poses FILE.csv writes" in alone.out
    # the plan, filled in and given, is an input
    filled = shop / "new.next_poses.csv"
    try:
        filled.write_bytes((shop / "loads.csv").read_bytes())
        kept = filled.read_bytes()
        again = compensate("diagnose", filled, "--robot", shop / "shop.yaml", "-o", shop / "new.yaml")
        assert again.code == 1
        assert "FIL007" in again.err
        assert "--next-poses" in again.err
        assert filled.read_bytes() == kept
        assert not (shop / "new.yaml").exists()
    finally:
        filled.unlink()


def pulled(shop, tmp_path):
    """The readings of the shop as if their forces had been pulls, 30 degrees off the vertical."""
    readings = read_measurements(shop / "loads.csv", [(f"A{k}", False) for k in range(1, 7)])
    wrench = readings.wrench.copy()
    wrench[:, 0] = 0.5 * np.abs(wrench[:, 2])
    (tmp_path / "pulled.csv").write_bytes(measurements_csv(replace(readings, wrench=wrench)))
    return np.linalg.norm(wrench[:, :3], axis=1).max()


@pytest.mark.slow
def test_pulls_are_proposed_where_the_user_can_pull(compensate, shop, tmp_path, undecided, monkeypatch):
    monkeypatch.chdir(tmp_path)
    largest = pulled(shop, tmp_path)
    words = ["diagnose", "pulled.csv", "--robot", shop / "shop.yaml"]
    alone = compensate(*words, "-o", "new.yaml", "--json", "-")
    assert (alone.json["next_poses"], alone.json["next_poses_file"]) == (None, None)
    assert "pulls are proposed with --pulls only" in " ".join(compensate(*words).out.split())
    done = compensate(*words, "--pulls", "-o", "new.yaml", "--json", "-")
    poses = done.json["next_poses"]
    forces = np.array([[pose[f"pull_{axis}_n"] for axis in "xyz"] for pose in poses])
    weights = np.array([pose["load_kg"] for pose in poses])
    sizes = np.where(weights > 0, 9.80665 * weights, np.linalg.norm(forces, axis=1))
    np.testing.assert_allclose(sizes, largest, rtol=1e-4)
    assert (np.count_nonzero(forces, axis=1) <= 1).all(), "along one axis of the robot base each"
    lines = Path("new.next_poses.csv").read_text().splitlines()
    header = next(line for line in lines if not line.startswith("#")).split(",")
    assert {"FX", "FY", "FZ"} & set(header)


@pytest.mark.slow
def test_no_weight_above_the_payload_is_proposed(compensate, shop, tmp_path, undecided, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["diagnose", shop / "loads.csv", "--json", "-", "--robot"]
    hung = np.unique(
        np.round(np.linalg.norm(read_measurements(shop / "loads.csv", [(f"A{k}", False) for k in range(1, 7)])
                                .wrench[:, :3], axis=1) / 9.80665, 1)
    )  # fmt: skip
    light, heavy = hung[0], hung[-1]
    between = 0.5 * (light + heavy) if light < heavy else heavy - 1.0
    free = compensate(*words, shop / "shop.yaml").json["next_poses"]
    assert max(pose["load_kg"] for pose in free) == pytest.approx(heavy, abs=0.1)
    for more, robot in ((["--payload", f"{between}"], shop / "shop.yaml"), ([], tmp_path / "rated.yaml")):
        stated = f"rated_payload: {{value: {between}, unit: kg, source: plate}}\n"
        (tmp_path / "rated.yaml").write_text((shop / "shop.yaml").read_text() + stated)
        poses = compensate(*words, robot, *more).json["next_poses"]
        if light < heavy:
            assert max(pose["load_kg"] for pose in poses) <= between
        else:
            assert poses is None


@pytest.mark.slow
def test_a_plan_has_the_columns_of_the_readings(compensate, shop, tmp_path, undecided, monkeypatch):
    """So that both can be given together once it is filled in."""
    monkeypatch.chdir(tmp_path)
    joints = [(f"A{k}", False) for k in range(1, 7)]
    readings = read_measurements(shop / "loads.csv", joints)
    count = len(readings)
    warm = replace(
        readings,
        direction=approach(readings.q),
        time=60.0 * np.arange(count),
        temperature=20.0 + 0.1 * np.arange(count),
    )
    (tmp_path / "warm.csv").write_bytes(measurements_csv(warm))
    done = compensate("diagnose", "warm.csv", "--robot", shop / "shop.yaml", "-o", "new.yaml")
    assert done.code == 3, done.err
    lines = (tmp_path / "new.next_poses.csv").read_text().splitlines()
    header = next(line for line in lines if not line.startswith("#")).split(",")
    assert {"DIR1", "DIR6", "T", "TEMP", "DX"} <= set(header)
    rows = [line.split(",") for line in lines if not line.startswith("#")][1:]
    assert all(
        row[header.index("T")] == row[header.index("TEMP")] == row[header.index("DX")] == "" for row in rows
    )
    for number, row in enumerate(rows):
        for name in ("T", "TEMP", "DX", "DY", "DZ"):
            row[header.index(name)] = str(1 + number)
    comments = [line for line in lines if line.startswith("#")]
    (tmp_path / "next.csv").write_text("\n".join([*comments, ",".join(header), *map(",".join, rows)]))
    together = measured_of((tmp_path / "warm.csv", tmp_path / "next.csv"), str(shop / "shop.yaml"), None)
    assert len(together.readings) == count + len(rows)
    np.testing.assert_array_equal(together.readings.direction[count:], approach(together.readings.q[count:]))


def test_what_can_not_be_done(compensate, shop, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for words, told in (
        (["diagnose", "none.csv"], ("FIL001", "none.csv")),
        (["diagnose", shop / "few.csv", "--robot", "kuka_kr270"], ("DIA001", "6 poses", "compensate plan")),
        (["diagnose", shop / "few.csv"], ("CEL003", "--robot")),
        (words_for(shop, "--csv", shop / "loads.csv"), ("FIL007",)),
    ):
        done = compensate(*words, "-o", "new.yaml")
        assert done.code == 1
        for word in (*told, "nothing is written"):
            assert word in done.err
        assert list(tmp_path.iterdir()) == []
        refused = compensate(*words, "--json", "-")
        assert refused.code == 1
        assert refused.json["findings"][0]["code"] == told[0]


@pytest.mark.slow
def test_warnings_are_errors_if_asked_for(compensate, shop, tmp_path, named):
    text = (shop / "loads.csv").read_text()
    other = tmp_path / "other.csv"
    other.write_text(f"# robot: ur5\n{text}")
    words = ["diagnose", other, "--robot", shop / "shop.yaml", "-o", tmp_path / "new.yaml", "-q"]
    strict = compensate(*words, "--strict")
    assert (strict.code, strict.out) == (1, "")
    assert not (tmp_path / "new.yaml").exists()
    done = compensate(*words)
    assert (done.code, done.out) == (3, "")
    assert (tmp_path / "new.yaml").exists()
