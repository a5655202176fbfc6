"""``compensate plan`` through the command line: the file it writes, what it says, wrong input."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

from postproc.base.findings import Refusal
from postproc.base.units import DEG, MM
from postproc.experiments import pool, precision
from postproc.identification.campaign import Campaign
from postproc.measurements import measurements_csv, read_measurements
from postproc.model import StiffnessModel
from postproc.output.filled_tables import refuse_filled_plan
from postproc.report.planned import discrimination_words
from postproc.robot.description import find_robot, load_robot
from postproc.workflows import plan as workflow

ROBOT = ["plan", "--robot", "kuka_kr270"]
LEVER = ["--tool", "0,500,300", "--loads", "265"]
TARGETS = ["--target", "M1=300,0,100", "--target", "M2=-150,260,100", "--target", "M3=-150,-260,100"]
TABLE_1 = ["--effects", "joint_compliance,gravity_compensator"]
TWO = ["--effects", "joint_compliance.c2,joint_compliance.c3"]


@pytest.fixture(autouse=True)
def _short_search(monkeypatch):
    monkeypatch.setattr(workflow, "CANDIDATES", 100)
    monkeypatch.setattr(workflow, "SIZES", (8, 12))
    monkeypatch.setattr(pool, "NEARBY", 60)
    monkeypatch.setattr(pool, "SHARES", (0.05, 0.01))
    monkeypatch.setattr(precision, "RANDOM", 5)
    monkeypatch.setattr(precision, "STARTS", 1)


@pytest.fixture
def out(tmp_path):
    return tmp_path / "plan.csv"


def joints(model):
    return [(joint.name, joint.kind != "revolute") for joint in model.robot.joints]


def kr270() -> StiffnessModel:
    return StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270")))


def body(path) -> tuple[list[str], list[dict[str, str]]]:
    """Comments and rows of a plan."""
    lines = path.read_text().splitlines()
    return [line for line in lines if line.startswith("#")], list(
        csv.DictReader(line for line in lines if not line.startswith("#"))
    )


def filled_in(path, model):
    """The plan with what the model says, written back as a person would; the readings."""
    text = path.read_text()
    tenth = re.sub(r",,,$", ",0,0,0", text, flags=re.MULTILINE)
    path.write_text(tenth)
    readings = read_measurements(path, joints(model))
    campaign = Campaign(readings)
    value = campaign.expected(campaign.predicted(model), campaign.start())[0]
    measured = path.with_name("measured.csv")
    measured.write_bytes(measurements_csv(type(readings)(**{**vars(readings), "value": value})))
    return measured, readings


# The way of a campaign: plan, measure, identify


def test_plan_is_filled_in_and_identified(compensate, out):
    page = out.with_suffix(".json")
    done = compensate(*ROBOT, *TABLE_1, *LEVER, *TARGETS, "--poses", 10, "-o", out, "--json", page)
    assert (done.code, done.err) == (3, "")  # c1
    comments, rows = body(out)
    assert len(rows) == 30
    assert "# robot: kuka_kr270" in comments
    assert "# tool: 0 500 300 0 0 0" in comments
    assert "# sigma_mm: 0.03" in comments
    assert "# target M2: -150 260 100" in comments
    assert {row["TARGET"] for row in rows} == {"M1", "M2", "M3"}
    assert all(row["DX"] == row["DY"] == row["DZ"] == "" for row in rows)
    assert {row["FZ"] for row in rows} == {"-2598.76"}
    axes = {tuple(row[f"A{i}"] for i in range(1, 7)) for row in rows}
    assert len(axes) == 10
    assert all(re.fullmatch(r"-?[0-9]+\.[0-9]000", axis) for pose in axes for axis in pose)

    result = json.loads(page.read_text())
    assert (result["poses"], result["readings"], result["criterion"], result["exit"]) == (
        10,
        30,
        "minimax",
        3,
    )
    assert result["outputs"] == [str(out), str(page)]
    assert list(result["intervals"]) == ["8", "10", "12"]
    assert [one["name"] for one in result["unobservable"]] == ["joint_compliance.c1"]
    assert "pull sideways" in result["unobservable"][0]["why"]
    assert result["fixed"] == ["gravity_compensator.h"]

    measured, readings = filled_in(out, kr270())
    # the comments of a plan are no keys gone wrong
    assert [finding.code for finding in readings.findings] == []
    found = compensate("identify", measured, *TABLE_1, "--bootstrap", 0, "--folds", 0, "--json", "-")
    stated, foreseen = found.json["effects"], result["intervals"]["10"]
    assert foreseen["joint_compliance"].pop("c1") == {"ci95": None, "unit": "rad/(N m)"}
    for effect, parameters in foreseen.items():
        for name, parameter in parameters.items():
            assert parameter["ci95"] == pytest.approx(stated[effect][name]["ci95"], rel=5e-3)
            assert parameter["unit"] == stated[effect][name]["unit"]

    # what was measured counts in the next plan
    more = [
        *ROBOT,
        *TABLE_1,
        *LEVER,
        *TARGETS,
        "--poses",
        8,
        "--measured",
        measured,
        "-o",
        out.with_name("next.csv"),
        "--json",
        "-",
    ]
    again = compensate(*more).json
    s0 = [again[key]["gravity_compensator"]["s0"]["ci95"] for key in ("before",)]
    s0 += [again["intervals"][size]["gravity_compensator"]["s0"]["ci95"] for size in ("8", "12")]
    assert s0[0] == pytest.approx(foreseen["gravity_compensator"]["s0"]["ci95"], rel=5e-3)
    assert s0 == sorted(s0, reverse=True)


def test_table_of_a_plan(compensate, out):
    done = compensate(*ROBOT, *TABLE_1, *LEVER, *TARGETS, "--poses", 10, "-o", out)
    for words in (
        "10 poses, each with 265 kg: 30 readings",
        "deflection, loaded minus unloaded, of M1, M2, M3; 0.03 mm per coordinate (1 sigma)",
        "smallest worst ratio of an interval to the wanted one",
        "A1 is vertical, so an attached weight applies 0 N m to it: pull sideways",
        f"wrote {out}",
    ):
        assert words in done.out
    assert re.search(r"value +wanted +8 poses +10 poses +12 poses +10 random", done.out)
    assert re.search(r"joint_compliance\.c1 .* 5 % +- +- +- +-", done.out)
    assert re.search(r"gravity_compensator\.s0 +458 mm +5\.9 %( +[0-9.]+ %){4}", done.out)
    assert re.search(r"worst / wanted +([0-9.]+ +){3}", done.out)
    quiet = compensate(*ROBOT, *TABLE_1, *LEVER, "--poses", 10, "-o", out, "-q")
    assert (quiet.code, quiet.out) == (3, "")


def test_same_seed_same_plan(compensate, out):
    words = [*ROBOT, *TWO, *LEVER, "--poses", 5, "-o", out]
    plans = []
    for seed in (4, 4, 5):
        assert compensate(*words, "--seed", seed).code == 0
        plans.append(out.read_bytes())
    assert plans[0] == plans[1] != plans[2]


@pytest.mark.parametrize(
    ("options", "rows", "loads"),
    [
        (["--loads", "125,265", "--poses", "6"], 12, {"-1225.83", "-2598.76"}),
        (["--loads", "0,125,265", "--poses", "6"], 12, {"-1225.83", "-2598.76"}),
        (["--loads", "125,265", "--one-load", "--poses", "6"], 6, {"-2598.76"}),
        (["--loads", "265", "--poses", "12"], 12, {"-2598.76"}),
        (["--loads", "0,265", "--poses", "6", "--kind", "absolute"], 12, {"0", "-2598.76"}),
    ],
)
def test_loads(compensate, out, options, rows, loads):
    done = compensate(*ROBOT, *TWO, "--tool", "0,500,300", *options, "-o", out)
    assert done.code == 0
    _, found = body(out)
    assert len(found) == rows
    assert {row["FZ"] for row in found} == loads


def test_rows_are_a_short_way(compensate, out):
    compensate(*ROBOT, *TWO, *LEVER, *TARGETS, "--poses", 12, "-o", out)
    _, rows = body(out)
    q = np.array([[float(row[f"A{i}"]) for i in range(1, 7)] for row in rows])
    assert (q[::3] == q[1::3]).all()

    def way(order):
        return np.abs(np.diff(q[::3][order], axis=0)).max(axis=1).sum()

    rng = np.random.default_rng(0)
    assert way(range(12)) < 0.9 * np.median([way(rng.permutation(12)) for _ in range(50)])


def test_places_by_a_tracker(compensate, out):
    """A calibration: no load, the tracker anywhere, the reflectors somewhere on the flange."""
    words = ["plan", "--robot", "ur5", "--effects", "joint_offset", "--poses", 12, "-o", out, "--json", "-"]
    done = compensate(*words, *TARGETS[:4], "--rough-targets", "--tracker", "3000,0,500", "--cone", "70")
    assert done.code == 0
    comments, rows = body(out)
    assert "# frame: tracker" in comments
    assert not any(comment.startswith("# target") for comment in comments)
    assert "# reflector M1 about 300 0 100 mm on the flange" in comments
    assert {"X", "Y", "Z", "TARGET"} <= set(rows[0])
    assert done.json["kind"] == "absolute"
    # the turn of the first joint is that of the tracker
    assert [finding["code"] for finding in done.json["findings"]][:1] == ["PLN011"]
    assert done.json["intervals"]["12"]["joint_offset"]["o1"]["ci95"] is None
    assert done.json["intervals"]["12"]["joint_offset"]["o2"]["ci95"] > 0
    _, readings = filled_in(out, StiffnessModel.from_robot(load_robot(find_robot("ur5"))))
    assert [finding.code for finding in readings.findings] == []
    assert done.json["readings"] == len(rows) < 24


def test_sense_of_approach_is_stated(compensate, out):
    done = compensate(
        *ROBOT, "--effects", "hysteresis", "--kind", "absolute", "--poses", 8, "-o", out, "--sigma", 0.01
    )
    assert done.code in (0, 3)
    comments, rows = body(out)
    assert any("in the direction of its DIR" in comment for comment in comments)
    assert {row[f"DIR{i}"] for row in rows for i in range(1, 7)} == {"-1", "1"}
    _, readings = filled_in(out, kr270())
    assert readings.direction is not None
    assert [finding.code for finding in readings.findings] == []


def test_limits_box_and_spacing(compensate, out):
    options = [
        "--limits",
        "A2=-100:-50",
        "--limits",
        "a6=-20:20",
        "--box",
        "500:2500,-900:900,300:",
        "--spacing",
        12,
    ]
    assert compensate(*ROBOT, *TWO, *LEVER, "--poses", 6, *options, "-o", out).code == 0
    _, rows = body(out)
    q = np.array([[float(row[f"A{i}"]) for i in range(1, 7)] for row in rows])
    assert (q[:, 1] >= -100).all()
    assert (q[:, 1] <= -50).all()
    assert (np.abs(q[:, 5]) <= 20).all()
    for i in range(6):
        for k in range(i):
            assert np.abs(q[i] - q[k]).max() >= 12 - 1e-9
    flange = kr270().chain.flange(q * DEG)
    tcp = (flange.position + flange.rotation @ [0.0, 0.5, 0.3]) / MM
    assert (tcp >= [500, -900, 300]).all()
    assert (tcp[:, :2] <= [2500, 900]).all()


def test_what_is_wanted(compensate, out):
    words = [*ROBOT, *TWO, *LEVER, "--poses", 6, "-o", out, "--json", "-"]
    plain = compensate(*words).json["wanted"]["joint_compliance"]
    assert plain["c2"]["ci95"] == pytest.approx(0.004e-6)
    wished = compensate(*words, "--wanted", "c2=0.1%", "--wanted", "2%").json["wanted"]["joint_compliance"]
    assert wished["c2"]["ci95"] == pytest.approx(0.302e-9)
    assert wished["c3"]["ci95"] == pytest.approx(0.02 * 0.406e-6)
    strict = compensate(*words, "--wanted", "joint_compliance.c2 = 1e-9 rad/(N m)").json
    assert strict["wanted"]["joint_compliance"]["c2"]["ci95"] == pytest.approx(1e-9)
    # c2 gets the poses then
    loose = compensate(*words, "--wanted", "c2=50%").json
    c2 = [found["intervals"]["8"]["joint_compliance"]["c2"]["ci95"] for found in (strict, loose)]
    assert c2[0] < c2[1]


@pytest.mark.slow
def test_poses_for_a_program(compensate, job, out):
    """The error at the cuts is told, and smaller than with poses for the intervals."""
    words = [*ROBOT, *TABLE_1, *LEVER, "--poses", 8, "--test", job.program, "-o", out, "--json", "-"]
    by_test, by_worst = (compensate(*words, *more).json for more in ([], ["--criterion", "minimax"]))
    assert (by_test["criterion"], by_worst["criterion"]) == ("test", "minimax")
    assert 0 < by_test["test_rms_mm"]["8"] < by_worst["test_rms_mm"]["8"]
    stronger = compensate(*words, "--force=-3600,500,5600").json
    assert stronger["test_rms_mm"]["8"] > 5 * by_test["test_rms_mm"]["8"]
    assert "error at the cuts, rms" in compensate(*words[:-2]).out


def test_what_a_touched_off_base_holds_is_no_error_at_the_cuts(compensate, job, out):
    """Offsets of the joints are in a base that was touched off with them; other programs have all of their error."""
    words = [
        "plan",
        "--robot",
        "kuka_kr270",
        "--effects",
        "joint_offset",
        "--poses",
        8,
        "--test",
        job.program,
    ]
    words += ["-o", out, "--json", "-"]
    process = compensate(*words).json["test_rms_mm"]["8"]
    cell = job.folder / "cell.yaml"
    cell.write_text(cell.read_text() + "correct: absolute\ncontroller: {absolute_accuracy: false}\n")
    assert compensate(*words).json["test_rms_mm"]["8"] > 20 * process


@pytest.mark.slow
def test_poses_that_tell_effects_apart(compensate, out):
    words = [*ROBOT, "--effects", "joint_compliance", *LEVER, *TARGETS, "--poses", 8, "-o", out]
    words += ["--discriminate", "gravity_compensator,link_compliance"]
    done = compensate(*words, "--json", "-")
    assert done.code == 0
    assert list(done.json["separation"]) == ["6", "8"]
    assert min(done.json["separation"]["8"]) > min(done.json["separation"]["6"]) > 3
    assert done.json["discriminate"] == ["gravity_compensator", "link_compliance"]
    shown = compensate(*words).out
    assert re.search(r"gravity_compensator against link_compliance +[0-9.]+ +[0-9.]+", shown)
    assert re.search(r"6 poses +8 poses", shown)
    # what is fitted beside explains some of it
    words[words.index("--effects") + 1] = "joint_compliance.c1"
    assert min(compensate(*words, "--json", "-").json["separation"]["8"]) > 1.05 * min(
        done.json["separation"]["8"]
    )
    words[words.index("--effects") + 1] = "joint_compliance"
    # ten times the scatter: nothing is told apart any more
    blunt = compensate(*words, "--sigma", 3, "--json", "-")
    assert blunt.code == 3
    assert [finding["code"] for finding in blunt.json["findings"]] == ["PLN010"]


def test_the_harder_one_is_named():
    assert (
        discrimination_words(("a", "b"), (1.0, 9.0))
        == "a can be mistaken for b: they differ by 1.0 standard deviations"
    )
    assert (
        discrimination_words(("a", "b"), (9.0, 1.0))
        == "b can be mistaken for a: they differ by 1.0 standard deviations"
    )


# Wrong input


def test_all_of_an_axis_is_no_wider_than_it_is(compensate, out):
    options = ["--poses", 4, "--limits", "A2=-146:0", "--limits", "A3=:"]
    assert compensate(*ROBOT, *TWO, *LEVER, *options, "-o", out).code == 0


@pytest.mark.parametrize(
    ("options", "named", "written"),
    [
        (["--target", "M1=0.3,0,0.1"], "--target M1", "0.3 mm"),
        (["--tool", "0,-0.5,0.3"], "--tool", "0.5 mm"),
        (["--target", "M1=300,0,100", "--tracker=3,0,-1"], "--tracker", "3 mm"),
    ],
)
def test_lengths_in_metres_are_reported(compensate, out, options, named, written):
    """As ``identify`` reports them above its readings."""
    done = compensate(*ROBOT, *TWO, "--loads", 265, "--poses", 6, *options, "-o", out, "--json", "-")
    assert done.code == 3
    (found,) = [one for one in done.json["findings"] if one["code"] == "MEA014"]
    assert found["message"] == f"{named}: its largest coordinate is {written}, as if it were in metres"
    assert out.exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "Missing option"),
        (["--poses", "0"], "0"),
        (["--poses", "5", "--loads", "-3"], "below zero"),
        (["--poses", "5", "--loads", "a"], "not a number"),
        (["--poses", "5", "--target", "M1"], "not NAME=x,y,z"),
        (["--poses", "5", "--target", "M1=1,2"], "x,y,z is needed"),
        (["--poses", "5", "--target", "a=1,2,3", "--target", "A=1,2,4"], "occurs twice"),
        (["--poses", "5", "--box", "0:1,0:1"], "2 ranges"),
        (["--poses", "5", "--box", "5:1,:,:"], "ascending"),
        (["--poses", "5", "--limits", "A2"], "not JOINT=a:b"),
        (["--poses", "5", "--criterion", "test"], "--test PROGRAM"),
        (["--poses", "5", "--cone", "10"], "needs --tracker"),
        (["--poses", "5", "--force"], "--test PROGRAM"),
        (["--poses", "5", "--rough-targets"], "--target"),
        (["--poses", "5", "--loads", "5", "--one-load"], "several --loads"),
        (["--poses", "5", "--discriminate", "backlash"], "two effects"),
        (["--poses", "5", "--discriminate", "backlash,hysteresis", "--criterion", "d"], "excludes"),
        (["--poses", "5", "--sigma", "0"], "0"),
        (["--poses", "5", "-o", "plan.txt"], "must end in .csv"),
        (["--poses", "5", "--effects", "a,,b"], "empty name"),
    ],
)
def test_wrong_command_line(compensate, out, options, words):
    output = () if "-o" in options else ("-o", out)
    effects = () if "--effects" in options else TWO
    done = compensate(*ROBOT, *effects, *output, *options)
    assert done.code == 2
    assert words in done.err
    assert not out.exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ["--effects", "joint_complianze"],
            "IDN001 'joint_complianze' is not an effect; did you mean 'joint_compliance'?",
        ),
        ([*TWO], "PLN005 deflections are the loaded minus the unloaded place, and no load is given"),
        ([*TWO, "--loads", "0"], "PLN005"),
        ([*TWO, *LEVER, "--limits", "A9=0:1"], "PLN006 --limits: 'A9' is not a joint"),
        ([*TWO, *LEVER, "--limits", "A2=10:20"], "PLN001 A2 cannot move within 10 .. 20 deg"),
        (
            [*TWO, *LEVER, "--limits", "A2=-200:50"],
            "PLN006 --limits: the range A2=-200:50 is beyond the limits -146 .. 0 deg of kuka_kr270",
        ),
        ([*TWO, *LEVER, "--limits", "A2=-146.01:"], "PLN006 --limits: the range A2=-146.01:inf is beyond"),
        ([*TWO, *LEVER, "--limits", "A2=:0.01"], "PLN006 --limits: the range A2=-inf:0.01 is beyond"),
        ([*TWO, *LEVER, "--wanted", "c9=1%"], "PLN006 --wanted c9=1%: 'c9' is not requested"),
        (
            [*TWO, *LEVER, "--wanted", "c2=1mm"],
            "PLN006 --wanted c2=1mm: 'mm' is not a unit of joint_compliance.c2",
        ),
        ([*TWO, *LEVER, "--wanted", "c2"], "PLN006 --wanted c2: it is not NAME=VALUE"),
        ([*TWO, *LEVER, "--wanted", "c2=-1%"], "PLN006"),
        (["--effects", "joint_offset", "--wanted", "o2=1%"], "o2 is zero, so 1 % of it is zero"),
        (["--effects", "joint_compliance.c1", *LEVER], "PLN002 no parameter is observable at any pose"),
        ([*TWO, *LEVER, "--test", "nowhere.src"], "FIL001"),
        ([*TWO, *LEVER, "--measured", "nowhere.csv"], "FIL001"),
        (
            [*TWO, *LEVER, "--discriminate", "backlash,backlash.b2"],
            "PLN006 --discriminate: backlash and backlash.b2",
        ),
        ([*TWO, *LEVER, "--discriminate", "gravity_compensator.L,backlash"], "its dimensions are known"),
    ],
)
def test_refusals(compensate, out, options, words):
    done = compensate(*ROBOT, "--poses", 5, "-o", out, *options)
    assert done.code == 1
    assert words in done.err.replace("\n", " ")
    assert "nothing is written" in done.err
    assert not out.exists()


def test_lists_may_be_given_in_several_times(compensate, tmp_path):
    """All of them count: none is lost because another one came after it."""
    plans = []
    for name, words in (
        ("one.csv", ["--effects", "joint_compliance.c2,joint_compliance.c3", "--loads", "100,200"]),
        ("several.csv", ["--effects=joint_compliance.c2", "--effects=joint_compliance.c3"]),
    ):
        loads = [] if "--loads" in words else ["--loads=100", "--loads=200"]
        done = compensate(*ROBOT, *words, *loads, "--tool", "0,500,300", "--poses", 5, "-o", tmp_path / name)
        assert done.code in (0, 3), done.err
        plans.append((tmp_path / name).read_text())
    assert plans[0] == plans[1]
    twice = compensate(*ROBOT, *TWO, *LEVER, "--poses", 5, "-o", tmp_path / "no.csv", *2 * ["--wanted=c2=1%"])
    assert twice.code == 2
    assert "'c2' occurs twice" in twice.err


def test_robot_that_does_not_exist(compensate, out):
    done = compensate("plan", "--robot", "kr271", *TWO, *LEVER, "--poses", 5, "-o", out)
    assert done.code == 1
    assert "CEL003" in done.err


def test_a_load_above_the_rated_payload(compensate, out, tmp_path):
    robot = tmp_path / "rated.yaml"
    stated = find_robot("kuka_kr270").read_text()
    robot.write_text(f"{stated}\nrated_payload: {{value: 260, unit: kg, source: data sheet}}\n")
    words = ["plan", "--robot", robot, *TWO, "--tool", "0,500,300", "--poses", 5, "-o", out, "--loads"]
    done = compensate(*words, "100,265")
    assert done.code == 1
    assert "PLN006 a load of 265 kg is above the rated payload of 260 kg" in done.err.replace("\n", " ")
    assert not out.exists()
    assert compensate(*words, "100,260").code in (0, 3)


def test_names_of_two_effects_are_told(compensate, out):
    words = [*ROBOT, "--effects", "payload,tool_offset", "--poses", 5, "-o", out]
    done = compensate(*words, "--wanted", "x=1mm")
    assert done.code == 1
    assert "PLN006 --wanted x=1mm: 'x' consists of several parameters: payload.x, tool_offset.x" in done.err


def test_inputs_are_not_replaced(compensate, job, out):
    done = compensate(*ROBOT, *TWO, *LEVER, "--poses", 5, "--measured", out, "-o", out)
    assert (done.code, "FIL007" in done.err) == (1, True)


@pytest.mark.parametrize(
    "spelling", [str, lambda text: text.replace(",", ";"), lambda text: text.replace("\n", "\r\n")]
)
def test_a_plan_with_readings_is_not_replaced(compensate, out, spelling):
    words = [*ROBOT, *TWO, *LEVER, "--poses", 5, "-o", out]
    assert compensate(*words).code in (0, 3)
    assert compensate(*words, "--seed", 2).code in (0, 3)  # an empty one is
    filled = spelling(out.read_text().replace(",,,", ",0.1,0.2,0.3", 1)).encode()
    out.write_bytes(filled)
    done = compensate(*words)
    assert (done.code, "FIL017" in done.err) == (1, True)
    assert out.read_bytes() == filled


def test_program_without_force_tests_nothing(compensate, job, out):
    done = compensate(*ROBOT, *TWO, *LEVER, "--poses", 5, "--test", job.program, "--force=0,0,0", "-o", out)
    assert done.code == 1
    assert "no motion has a force" in done.err


def test_help_names_the_contract(compensate):
    done = compensate("plan", "--help")
    assert done.code == 0
    for option in ("--effects", "--poses", "--discriminate", "--loads", "-o"):
        assert option in done.out


def test_a_table_that_cannot_be_read_is_not_replaced(tmp_path, monkeypatch):
    """It may have readings."""
    there = tmp_path / "plan.csv"
    there.write_text("pose\n")

    def read_bytes(path):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", read_bytes)
    with pytest.raises(Refusal, match="cannot be read, so it is not replaced: Permission denied"):
        refuse_filled_plan(there)
    refuse_filled_plan(tmp_path / "none.csv")
