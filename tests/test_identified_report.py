"""What an identification says: sizes of residuals, sums, JSON, CSV, the terminal and the picture."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import matplotlib.image
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console
from tiers import examples

from postproc.base.findings import Finding
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.effects import EFFECTS
from postproc.effects.effect import SIZES
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.identifiable import Dropped
from postproc.identification.outliers import Outlier
from postproc.identification.unknowns import asked_for
from postproc.identification.validation import Bootstrap, held_out, validated
from postproc.measurements import planned
from postproc.model import StiffnessModel
from postproc.report import identified_picture as identified_picture_module
from postproc.report.formatting import SHOWN, fixed, shown_unit
from postproc.report.identified import Identified, identified_csv
from postproc.report.identified_picture import MAX_POINTS, identified_picture, rows_to_draw
from postproc.report.identified_terminal import show_identified, verdict
from postproc.report.residuals import PARTS, ResidualVariable, Sizes, lengths_of, poses_in_order
from postproc.robot.description import find_robot, load_robot

PLACES = {
    "M1": np.array([0.3, 0.0, 0.1]),
    "M2": np.array([-0.2, 0.25, 0.1]),
    "M3": np.array([-0.1, -0.3, 0.35]),
}
SIGMA = 2e-5
TRUTH = {(0, f"c{k}"): c * 1e-6 for k, c in enumerate((0.3, 0.25, 0.5, 2.2, 4.0, 2.0), 1)}
CONTRACT = ("before_rms_mm", "after_rms_mm", "noise_mm", "held_out_before_rms_mm", "held_out_after_rms_mm")


def kr270() -> StiffnessModel:
    return StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270"))).without_effects(
        ["gravity_compensator"]
    )


def measured(model, poses=10, force=(700.0, -400.0, -2600.0), tracked=False, sigma=SIGMA, seed=1):
    """Readings of three targets at random poses, as ``model`` gives them, with scatter."""
    robot, rng = model.robot, np.random.default_rng(seed)
    q = np.repeat(rng.uniform(*(0.7 * robot.limits.T), (poses, 6)), 3, axis=0)
    wrench = np.zeros((3 * poses, 6))
    wrench[:, :3] = force
    if tracked:
        wrench[::2] = 0.0
    readings = planned(
        [(joint.name, False) for joint in robot.joints],
        q,
        wrench,
        not tracked,
        robot=robot.name,
        tool=Poses(np.eye(3), np.array([0.0, 0.5, 0.2])),
        targets=list(PLACES),
        places=PLACES,
        target=np.tile([0, 1, 2], poses),
        sigma=SIGMA,
    )
    campaign = Campaign(readings)
    frame = campaign.start()
    if tracked:
        there = Poses(rotation_from_vector(np.array([[0.1, -0.2, 2.0]])), np.array([[3.0, -1.0, 0.5]]))
        frame = replace(frame, frames=there)
    value = campaign.expected(campaign.predicted(model), frame)[0]
    value = value + sigma * rng.normal(size=value.shape)
    lines = np.arange(len(value)) + 4
    return replace(
        readings, value=value, files=(Path("loads.csv"),), digests=("0" * 64,), file=lines * 0, line=lines
    )


def found(readings, words=("joint_compliance",), model=None, rows=None, folds=0, **change) -> Identified:
    """The readings identified."""
    model = model or kr270()
    campaign, asked = Campaign(readings), asked_for(model, words)
    before = fit(campaign, model, (), rows)
    after = fit(campaign, asked.model, asked.unknowns, rows)
    given = {
        "robot": model.robot.name,
        "robot_file": model.robot.path,
        "robot_digest": model.robot.digest,
        "data": tuple(
            (path.name, digest) for path, digest in zip(readings.files, readings.digests, strict=True)
        ),
        "effects": tuple(words),
        "before": before,
        "after": after,
        "fixed": asked.fixed,
        "held_out_before": held_out(before, folds) if folds else None,
        "held_out_after": held_out(after, folds) if folds else None,
        "folds": folds,
        "validation": None,
        "outliers": (),
        "outliers_excluded": False,
        "bootstrap": None,
    }
    return Identified(**{**given, **change})


@pytest.fixture(scope="module")
def plant():
    return kr270().with_values(TRUTH)


@pytest.fixture(scope="module")
def result(plant):
    return found(measured(plant), folds=5)


@pytest.fixture(scope="module")
def tracked(plant):
    return found(measured(plant, tracked=True), ["joint_compliance", "joint_offset"])


def told(result, verbose=False, width=160) -> str:
    stream = io.StringIO()
    show_identified(Console(file=stream, width=width), result, verbose)
    return stream.getvalue()


def table(result) -> tuple[list[str], list[dict[str, str]]]:
    reader = csv.DictReader(io.StringIO(identified_csv(result).decode(), newline=""))
    return list(reader.fieldnames), list(reader)


# Sizes of residuals


def test_the_gap_is_that_of_the_residuals(result):
    def rms(values):
        return 1e3 * np.sqrt(np.mean(np.sum(values**2, axis=1)))

    gap = result.gap_mm()
    assert set(gap) == set(CONTRACT)
    assert gap["before_rms_mm"] == pytest.approx(rms(result.before.residual), abs=1e-6)
    assert gap["after_rms_mm"] == pytest.approx(rms(result.after.residual), abs=1e-6)
    assert gap["held_out_after_rms_mm"] == pytest.approx(rms(result.held_out_after), abs=1e-6)
    assert gap["noise_mm"] == pytest.approx(1e3 * np.sqrt(3) * SIGMA, rel=1e-6)
    # what was found explains the readings; poses that were not fitted a little less well
    assert (
        gap["after_rms_mm"] < gap["held_out_after_rms_mm"] < 2 * gap["noise_mm"] < 0.2 * gap["before_rms_mm"]
    )
    told = result.as_json()["gap"]
    assert {key: told[key] for key in CONTRACT} == gap
    assert told["after_max_mm"] == pytest.approx(
        1e3 * np.linalg.norm(result.after.residual, axis=1).max(), abs=1e-6
    )


def test_lengths_do_not_depend_on_how_many_coordinates_were_measured():
    rng = np.random.default_rng(0)
    residual = rng.normal(size=(20000, 3))
    sizes = []
    for count in (1, 2, 3):
        seen = np.arange(3) < count
        left = np.where(seen, residual, np.nan)
        sizes.append(Sizes.of(lengths_of(left, np.isfinite(left))).rms)
        # turned into other axes, what was not measured counts as zero there
        turned = np.where(seen, residual, 0.0) @ rotation_from_vector(np.array([0.3, 1.0, -0.5])).T
        assert Sizes.of(lengths_of(turned, np.isfinite(left))).rms == pytest.approx(sizes[-1])
    np.testing.assert_allclose(sizes, np.sqrt(3), rtol=0.02)
    assert np.isnan(lengths_of(np.full((1, 3), np.nan), np.ones((1, 3), bool))).all()
    assert Sizes.of(np.array([np.nan])) is None


def test_outliers_left_out_do_not_count(plant):
    readings = measured(plant)
    value = readings.value.copy()
    value[7] += [2e-3, 0, 0]
    readings = replace(readings, value=value)
    rows = np.arange(len(readings)) != 7
    outlier = (Outlier(7, "loads.csv", 11, 2e-3, 99.0, "fits no other value"),)
    without = found(readings, rows=rows, folds=3, outliers=outlier, outliers_excluded=True)
    assert without.counts.sum() == len(readings) - 1
    assert without.as_json()["fitted_readings"] == len(readings) - 1
    assert np.isnan([lengths[7] for lengths in without.lengths.values()]).all()
    assert without.gap_mm()["after_rms_mm"] < 0.05
    along = without.as_json()["residuals"]["direction"]["x"]["after_rms_mm"]
    assert along < without.gap_mm()["after_rms_mm"]
    with_it = found(readings, outliers=outlier)
    assert with_it.gap_mm()["after_rms_mm"] > 0.3
    # the CSV tells what is left of it all the same
    _, cells = table(without)
    assert [(row["line"], row["fitted"]) for row in cells if row["outlier"] == "1"] == [("11", "0")]
    assert float(cells[7]["after_mm"]) == pytest.approx(2.0, abs=0.15)
    assert cells[7]["held_out_mm"] == ""


@given(st.lists(st.floats(-360, 360).map(lambda v: round(v, 1)), min_size=1, max_size=300))
@settings(max_examples=examples(60), deadline=None)
def test_parts_hold_every_reading_once(values):
    variable = ResidualVariable("A1", "deg", np.array(values))
    parts = variable.parts()
    assert sorted(np.concatenate(parts).tolist()) == list(range(len(values)))
    assert len(parts) <= PARTS
    assert all(len(part) for part in parts)
    inside = [variable.values[part] for part in parts]
    assert all(low.max() < high.min() for low, high in pairwise(inside))
    if len(set(values)) <= PARTS:
        assert [set(part) for part in inside] == [{value} for value in sorted(set(values))]


def test_poses_are_numbered_in_the_order_of_time():
    assert poses_in_order(np.array([5, 5, 2, 9, 2])).tolist() == [1, 1, 2, 3, 2]


def test_load_is_the_force_or_else_the_torque(plant, result, tracked):
    assert (tracked.load.name, tracked.load.unit) == ("force", "N")
    np.testing.assert_allclose(np.unique(tracked.load.values), [0.0, np.linalg.norm([700, -400, 2600])])
    assert result.load.unit == "N m"
    # J^T w by the work that the force does along a small turn of each joint
    readings, step = result.after.campaign.readings, 1e-6
    rigid = replace(plant, terms=())

    def place(q):
        return rigid.equilibrium(q, 0 * readings.wrench, readings.tool).pose.position

    torque = []
    for k in range(6):
        turn = step * np.eye(6)[k]
        way = (place(readings.q + turn) - place(readings.q - turn)) / (2 * step)
        torque.append(np.abs((way * readings.wrench[:, :3]).sum(axis=1)))
    np.testing.assert_allclose(result.load.values, np.max(torque, axis=0), rtol=1e-5)
    pulled = replace(readings, wrench=-readings.wrench)
    against = replace(result, after=replace(result.after, campaign=Campaign(pulled)))
    np.testing.assert_allclose(np.sort(against.load.values), np.sort(result.load.values))
    nothing = replace(readings, wrench=0 * readings.wrench)
    unloaded = replace(result, after=replace(result.after, campaign=Campaign(nothing)))
    assert unloaded.load is None


# Parameters


def test_json_holds_what_was_found(result, plant):
    found = json.loads(json.dumps(result.as_json(), allow_nan=False))
    parameters = found["effects"]["joint_compliance"]
    stated = {u.parameter.name: u.stated for u in result.after.asked}
    assert list(parameters) == [f"c{k}" for k in range(1, 7)]
    for name, one in parameters.items():
        assert abs(one["value"] - TRUTH[0, name]) < 2 * one["ci95"]
        assert one["ci95"] < 0.2 * one["value"]
        assert one["unit"] == "rad/(N m)"
        assert one["before"] == (stated[name].value if stated[name] else None)
    assert found["rank"] == 6
    assert found["condition"] >= 1
    assert (found["readings"], found["poses"], found["targets"], found["sessions"]) == (30, 10, 3, 1)
    assert found["dropped"] == found["at_bound"] == found["sums"] == found["outliers"] == []
    assert found["noise"] == {"sigma_mm": 0.02, "source": "stated", "exceeded": False, "shared_mm": 0.0}
    assert found["exit"] == 0


def test_what_the_robot_file_does_not_state_was_nothing_before(tracked):
    found = tracked.as_json()
    assert found["measured"] == "position"
    assert {one["before"] for one in found["effects"]["joint_offset"].values()} == {None}
    assert all(one["before"] > 0 for one in found["effects"]["joint_compliance"].values())


def test_json_of_residuals_adds_up(result):
    found = result.as_json()["residuals"]
    gap = result.as_json()["gap"]
    square = sum(found["direction"][axis]["after_rms_mm"] ** 2 for axis in "xyz")
    assert square == pytest.approx(gap["after_rms_mm"] ** 2, rel=1e-4)
    for by in (*found["joint"].values(), found["load"], found["order"]):
        parts = by["parts"]
        assert sum(part["readings"] for part in parts) == 30
        for key in ("before_rms_mm", "held_out_after_rms_mm"):
            mean = sum(part["readings"] * part[key] ** 2 for part in parts) / 30
            assert mean == pytest.approx(gap[key] ** 2, rel=1e-4)
    assert set(found["joint"]) == {f"A{k}" for k in range(1, 7)}


def test_parameters_that_show_together_are_told_as_their_sum(plant):
    """The turn of the base about the axis of A1 gives way as A1 does: only c1 + c_rz shows, wherever c_rz stands."""
    base = EFFECTS["base_compliance"](plant.robot.joints)
    model = kr270().with_effect(base).with_values({(1, "c_rz"): 1e-7})
    result = found(measured(plant), ["joint_compliance.c1", "base_compliance.c_rz"], model.with_values(TRUTH))
    (one,) = result.sums
    assert list(one.of) == ["joint_compliance.c1", "base_compliance.c_rz"]
    assert one.of["base_compliance.c_rz"] == pytest.approx(1.0, rel=1e-6)
    assert abs(one.value - TRUTH[0, "c1"]) < 2 * one.ci95
    assert one.ci95 < 0.02 * one.value
    # the parameter that stays where it was takes its part out of the other
    estimate = result.as_json()["effects"]["joint_compliance"]["c1"]["value"]
    assert estimate + 1e-7 == pytest.approx(one.value, rel=1e-9)
    (dropped,) = result.as_json()["dropped"]
    assert (dropped["name"], dropped["value"]) == ("base_compliance.c_rz", 1e-7)
    text = f"sum          joint_compliance.c1 + base_compliance.c_rz = {fixed(1e6 * one.value, 1e6 * one.ci95)} +- "
    assert text in told(result)


def test_a_sum_is_of_those_that_show_together(result):
    together = (("joint_compliance.c3", 2.0), ("joint_compliance.c5", -1.0))
    dropped = Dropped("joint_compliance.c6", "is observable only together with c3, c5", together)
    unknowns = result.after.unknowns[:5]
    after = replace(
        result.after, unknowns=unknowns, covariance=result.after.covariance[:5, :5], dropped=(dropped,)
    )
    sums = replace(result, after=after).sums
    assert [dict(one.of) for one in sums] == [
        {"joint_compliance.c3": 1.0, "joint_compliance.c6": 2.0},
        {"joint_compliance.c5": 1.0, "joint_compliance.c6": -1.0},
    ]
    values = {estimate.unknown.parameter.name: estimate.value for estimate in result.after.estimates}
    assert sums[0].value == pytest.approx(values["c3"] + 2 * values["c6"])
    assert sums[1].value == pytest.approx(values["c5"] - values["c6"])
    assert sums[1].ci95 == result.after.estimates[4].ci95


def test_a_sum_is_told_in_the_units_that_people_read(result):
    robot = result.after.model.robot
    model = kr270().with_effect(EFFECTS["joint_offset"](robot.joints)).with_values({(1, "o1"): 2e-3})
    unknowns = asked_for(model, ["joint_compliance.c1", "joint_offset.o1", "joint_stiffening.k1"])
    together = (("joint_compliance.c1", -3e-4),)
    after = replace(
        result.after,
        asked=unknowns.unknowns,
        point=replace(result.after.point, model=unknowns.model.with_values({(0, "c1"): 4e-7})),
        unknowns=unknowns.unknowns[:1],
        covariance=np.array([[1e-16]]),
        quantile=2.0,
        dropped=(Dropped("joint_offset.o1", "is observable only together with", together),),
    )
    changed = replace(result, after=after)
    # 4e-7 - 3e-4 * 2e-3 = -2e-7 rad/(N m); 3e-4 rad/(N m) a rad are 0.3 urad/(N m) a mrad
    assert changed.sums[0].value == pytest.approx(-2e-7)
    assert "joint_compliance.c1 - 0.3 joint_offset.o1 = -0.200 +- 0.020 urad/(N m)" in told(changed)


def test_a_parameter_at_its_bound_is_named(result):
    point = result.after.point
    bound = replace(point, model=point.model.with_values({(0, "c1"): 0.0}))
    bounded = replace(result, after=replace(result.after, point=bound))
    assert bounded.as_json()["at_bound"] == ["joint_compliance.c1"]
    assert bounded.as_json()["effects"]["joint_compliance"]["c1"]["at_bound"] is True
    assert re.search(r"  c1 .* at its bound", told(bounded))


def test_the_bootstrap_stands_beside_an_interval_that_it_finds_too_narrow(result):
    deviation = np.sqrt(np.diag(result.after.covariance)) * [1.0, 1.3, 1.0, 2.0, 1.0, 0.5]
    drawn = replace(result, bootstrap=Bootstrap(deviation, 200))
    parameters = drawn.as_json()["effects"]["joint_compliance"].values()
    ratios = [one["bootstrap_ci95"] / one["ci95"] for one in parameters]
    np.testing.assert_allclose(ratios, [1.0, 1.3, 1.0, 2.0, 1.0, 0.5])
    lines = [line for line in told(drawn).splitlines() if "by bootstrap" in line]
    assert [line.split()[0] for line in lines] == ["c4"], "a narrower one is no reason for a note"
    assert "checked by a bootstrap of 200 draws" in told(drawn)


def test_correlations_are_told(result):
    close = np.array([[1.0, 0.95], [0.95, 1.0]])
    deviation = np.sqrt(np.diag(result.after.covariance))
    relation = np.eye(6)
    relation[np.ix_([2, 4], [2, 4])] = close
    after = replace(result.after, covariance=relation * np.outer(deviation, deviation))
    changed = replace(result, after=after)
    (pair,) = changed.as_json()["correlations"]
    assert set(pair[:2]) == {"joint_compliance.c3", "joint_compliance.c5"}
    assert pair[2] == pytest.approx(0.95)
    assert "correlations above 0.9: joint_compliance.c5 / c3 +0.95" in told(changed)
    assert "correlations above 0.9: none" in told(result)


def test_without_stated_scatter_it_is_that_of_the_residuals(plant):
    readings = replace(measured(plant), sigma=np.full(30, np.nan))
    result = found(readings)
    assert result.sigma == pytest.approx(SIGMA, rel=0.2)
    assert "noise_mm" not in result.gap_mm()
    found_json = json.loads(json.dumps(result.as_json(), allow_nan=False))
    assert found_json["gap"]["noise_mm"] is None
    assert found_json["gap"]["held_out_after_rms_mm"] is None
    assert found_json["noise"]["source"] == "residuals"
    assert "no SIGMA is stated" in verdict(result)


def test_validation_is_told(plant, result):
    other = measured(plant, poses=4, seed=8)
    other = replace(other, files=(Path("later.csv"),))
    checked = replace(result, validation=validated(result.before, result.after, Campaign(other)))
    told_of = checked.as_json()["validation"]
    assert (told_of["data"], told_of["readings"], told_of["registration_refitted"]) == (
        ["later.csv"],
        12,
        False,
    )
    assert told_of["after_rms_mm"] < 0.1 < told_of["before_rms_mm"]
    assert told_of["before_rms_mm"] == pytest.approx(
        1e3 * np.sqrt(np.mean(np.sum(checked.validation.before**2, axis=1))), abs=1e-6
    )
    assert re.search(r"validation, after +0\.0\d\d .* 12\n", told(checked))
    assert result.as_json()["validation"] is None


def test_exit_is_that_of_the_worst_finding(result):
    warned = replace(result, findings=(Finding("IDN018", "2 mm off"), Finding("IDN025", "a and b")))
    assert (result.exit, warned.exit, replace(warned, strict=True).exit) == (0, 3, 1)
    assert [one["code"] for one in warned.as_json()["findings"]] == ["IDN018", "IDN025"]


# CSV


def test_csv_has_a_row_for_each_reading(result):
    heads, rows = table(result)
    readings = result.after.campaign.readings
    assert heads[:5] == ["file", "line", "pose", "target", "session"]
    assert heads[5:11] == [f"A{k}_deg" for k in range(1, 7)]
    assert len(rows) == 30
    for k, row in enumerate(rows):
        assert (row["file"], row["line"]) == ("loads.csv", str(readings.line[k]))
        assert (row["pose"], row["target"]) == (str(k // 3 + 1), f"M{k % 3 + 1}")
        np.testing.assert_allclose(
            [float(row[f"A{j}_deg"]) for j in range(1, 7)], np.degrees(readings.q[k]), atol=1e-6
        )
    for name, values in (
        ("before", result.before.residual),
        ("after", result.after.residual),
        ("held_out", result.held_out_after),
    ):
        cells = [[float(row[f"{name}_d{axis}_mm"]) for axis in "xyz"] for row in rows]
        np.testing.assert_allclose(cells, 1e3 * values, atol=1e-6)
        length = [float(row[f"{name}_mm"]) for row in rows]
        np.testing.assert_allclose(length, 1e3 * np.linalg.norm(values, axis=1), atol=2e-6)
    assert {row["outlier"] for row in rows} == {"0"}
    assert {row["fitted"] for row in rows} == {"1"}
    without = replace(result, held_out_before=None, held_out_after=None)
    assert table(without)[0] == heads
    assert {row["held_out_dx_mm"] for row in table(without)[1]} == {""}


# Terminal


def test_the_terminal_tells_every_parameter(result):
    text = told(result)
    assert "30 readings (deflections) at 10 poses, 3 targets, 1 session" in text
    for estimate in result.after.estimates:
        cells = next(
            line for line in text.splitlines() if line.startswith(f"  {estimate.unknown.parameter.name} ")
        )
        value, wide = (float(cells.split()[k]) for k in (2, 3))
        assert value == pytest.approx(1e6 * estimate.value, abs=0.06e6 * estimate.ci95)
        assert wide == pytest.approx(1e6 * estimate.ci95, rel=0.06)
        assert "urad/(N m)" in cells
    gap = result.gap_mm()
    assert re.search(rf"the robot file +{gap['before_rms_mm']:.3f} ", text)
    assert re.search(rf"fitted +{gap['after_rms_mm']:.3f} ", text)
    assert re.search(rf"5-fold\), after +{gap['held_out_after_rms_mm']:.3f} ", text)


def test_the_terminal_tells_of_the_tracker(tracked):
    text = told(tracked)
    assert "(positions in the tracker's frame)" in text
    assert "registration alone" in text
    (dropped,) = tracked.as_json()["dropped"]
    assert dropped["name"] == "joint_offset.o1"
    assert f"excluded     joint_offset.o1: {dropped['why']}" in text


def test_verdicts(result):
    after, held = result.after, result.held_out_after
    assert verdict(result).startswith("All 6 parameters found. The residual falls from ")
    assert verdict(result).endswith("they show nothing more.")
    outlier = (Outlier(0, "loads.csv", 4, 1e-3, 50.0, "?"),)
    for change, words in (
        ({"held_out_after": 1000 * held}, "do not use it"),
        ({"outliers": outlier}, "1 outlier among the readings"),
        ({"after": replace(after, freedom=0)}, "as many unknowns as measured numbers"),
        ({"after": replace(after, scatter_exceeded=True)}, "the model lacks an effect"),
        ({"after": replace(after, unknowns=after.unknowns[:2])}, "2 of 6 parameters found"),
    ):
        assert words in verdict(replace(result, **change))
    assert "check these first" not in verdict(replace(result, outliers=outlier, outliers_excluded=True))


def test_long_lists_are_cut_unless_all_is_asked_for(result):
    outliers = tuple(Outlier(k, "loads.csv", k + 4, 1e-3, 50.0, "a broken beam") for k in range(9))
    dropped = tuple(Dropped(f"link_geometry.d{k}", f"is observable too weakly: +- {k} m") for k in range(8))
    after = replace(result.after, dropped=dropped)
    names = {one.name: one for one in dropped}
    asked = (*after.asked, *(replace(after.asked[0], name=name) for name in names))
    many = replace(result, outliers=outliers, after=replace(after, asked=asked))
    short, long = told(many), told(many, verbose=True)
    assert short.count("a broken beam") == short.count("is observable too weakly") == SHOWN
    assert "and 4 more (-v shows all)" in short
    assert "and 3 more (-v shows all)" in short
    assert long.count("a broken beam") == 9
    assert long.count("is observable too weakly") == 8
    assert "  loads.csv:4 1 mm off, 50 sigma: a broken beam" in short


def test_what_the_tables_say_is_not_said_twice(result):
    findings = (Finding("IDN020", "c1: no reading depends on it"), Finding("IDN024", "3 times the scatter"))
    text, long = (told(replace(result, findings=findings), verbose) for verbose in (False, True))
    assert "IDN020" not in text
    assert "IDN024" in text
    assert "IDN020" in long


def test_sixty_parameters_stay_readable(result):
    unknown = result.after.unknowns[0]
    unknowns = tuple(
        replace(unknown, name=f"effect_{k // 20}.c{k}", parameter=replace(unknown.parameter, name="c1"))
        for k in range(60)
    )
    after = replace(result.after, unknowns=unknowns, asked=unknowns, covariance=1e-18 * np.eye(60))
    text = told(replace(result, after=after), width=100)
    assert max(len(line.rstrip()) for line in text.splitlines()[1:]) <= 100
    assert sum(bool(re.match(r"  c\d+ ", line)) for line in text.splitlines()) == 60
    assert sum(bool(re.match(r"effect_\d +$", line)) for line in text.splitlines()) == 3


def test_names_do_not_drive_the_terminal(result):
    hostile = replace(result, data=(("a\x1b[2J[red].csv", "0" * 64),), outputs=("out\x1b[2J.yaml",))
    text = told(hostile)
    assert "\x1b" not in text
    assert "a?[2J[red].csv" in text


@given(
    st.floats(-1e5, 1e5).filter(lambda v: abs(v) > 1e-7),
    st.floats(1e-6, 1e4),
    st.sampled_from([1.0, 1e-3, 10.0]),
)
@settings(max_examples=examples(100), deadline=None)
def test_two_digits_of_the_interval(value, interval, scale):
    value, interval = scale * value, scale * interval
    shown = fixed(value, interval)
    assert abs(float(shown) - value) <= 0.0501 * interval + 1e-9 * abs(value) or "e" in shown
    assert float(fixed(interval, interval)) == pytest.approx(interval, rel=0.051)


def test_numbers_that_are_none():
    assert fixed(float("nan"), 1.0) == "-"
    assert fixed(0.25, 0.0) == "0.25"
    assert fixed(-0.001, 1.0) == "0.0"


@pytest.mark.parametrize("unit", SIZES)
def test_shown_units_are_what_they_say(unit):
    """A unit as its factors: what stands behind the stroke divides, a digit behind a unit is its power."""
    sizes = {"mm": 1e-3, "um": 1e-6, "m": 1.0, "mrad": 1e-3, "urad": 1e-6, "rad": 1.0, "kN": 1e3, "N": 1.0}
    sizes |= {"kg": 1.0, "K": 1.0, "s": 1.0, "h": 3600.0}

    def size_of(word: str) -> tuple[float, dict[str, int]]:
        size, dimension, power = 1.0, {}, 1
        for token in re.findall(r"[A-Za-z]+\d?|/", word):
            if token == "/":
                power = -1
            else:
                name, raised = (token[:-1], int(token[-1])) if token[-1].isdigit() else (token, 1)
                size *= sizes[name] ** (power * raised)
                kind = {"mm": "m", "um": "m", "mrad": "rad", "urad": "rad", "kN": "N", "h": "s"}.get(
                    name, name
                )
                dimension[kind] = dimension.get(kind, 0) + power * raised
        return size, dimension

    word, size = shown_unit(unit)
    assert size_of(word)[0] == pytest.approx(size)
    assert size_of(word)[1] == size_of("" if unit == "1" else unit)[1]
    # a size that is felt is neither written with an exponent nor with many zeros
    assert 1e-2 < SIZES[unit] / size < 1e4


# Picture


def drawn(monkeypatch, result):
    """The panels of the figure that is drawn of ``result``."""
    figures = []
    monkeypatch.setattr(identified_picture_module, "rendered", lambda draw, kind: figures.append(draw()))
    identified_picture(result, "png")
    return [axes for axes in figures[0].axes if axes.get_visible()]


@pytest.mark.slow
def test_picture_files(result, tmp_path):
    raw = identified_picture(result, "png")
    assert raw == identified_picture(result, "png")
    (tmp_path / "left.png").write_bytes(raw)
    pixels = matplotlib.image.imread(tmp_path / "left.png")
    assert min(pixels.shape[:2]) > 500
    shapes = ElementTree.fromstring(identified_picture(result, "svg")).iter()
    names = [node.get("id", "") for node in shapes]
    assert sum(bool(re.fullmatch(r"axes_\d+", name)) for name in names) >= 9


def test_the_picture_shows_each_reading_in_its_place(monkeypatch, result):
    panels = drawn(monkeypatch, result)
    labels = [axes.get_xlabel() for axes in panels]
    assert labels[:6] == [f"A{k}, deg" for k in range(1, 7)]
    assert labels[6:8] == ["largest joint torque, N m", "reading"]
    assert labels[8].startswith("direction")
    angle = np.degrees(result.after.campaign.readings.q[:, 1])
    for line, residual in zip(
        panels[1].lines[:2], (result.before.residual, result.after.residual), strict=True
    ):
        np.testing.assert_allclose(line.get_xdata(), angle)
        size = 1e3 * np.linalg.norm(residual, axis=1)
        least = panels[1].get_ylim()[0]
        np.testing.assert_allclose(line.get_ydata(), np.maximum(size, least))
        assert size.max() < panels[1].get_ylim()[1]
    point = result.after.point
    small = replace(point, residual=np.where(np.arange(30)[:, None] == 3, 1e-12, point.residual))
    (first, *_) = drawn(monkeypatch, replace(result, after=replace(result.after, point=small)))
    assert first.lines[1].get_ydata()[3] == pytest.approx(first.get_ylim()[0])
    mean = panels[8].lines[0].get_ydata()
    np.testing.assert_allclose(mean, 1e3 * np.sqrt(np.mean(result.before.residual**2, axis=0)))


def test_the_picture_shows_what_there_is(monkeypatch, result, tracked):
    def legend(result):
        return [text.get_text() for text in drawn(monkeypatch, result)[0].figure.legends[0].get_texts()]

    assert [text.split(" (")[0] for text in legend(result)] == [
        "before",
        "fitted",
        "held-out poses",
        "scatter of the readings",
    ]
    outlier = (Outlier(3, "loads.csv", 7, 1e-3, 50.0, "?"),)
    assert legend(replace(result, outliers=outlier))[-1] == "outlier"
    assert "held-out poses (line: RMS)" not in legend(tracked)
    unstated = replace(result.after, noise=replace(result.after.noise, known=False))
    assert not any("scatter" in text for text in legend(replace(result, after=unstated)))
    assert len(drawn(monkeypatch, tracked)) == 9


def test_the_largest_of_many_readings_are_drawn():
    size = np.abs(np.random.default_rng(2).normal(size=10_000))
    size[[17, 4000]] = [np.nan, 90.0]
    rows = rows_to_draw(size)
    assert len(rows) == len(np.unique(rows)) == MAX_POINTS
    assert 4000 in rows
    assert 17 not in rows
    assert size[rows].max() == 90.0
    # the others are spread over the campaign
    assert np.histogram(rows, 10, (0, 10_000))[0].min() > 0.8 * MAX_POINTS / 10
    assert rows_to_draw(size[:45]).tolist() == [row for row in range(45) if row != 17]
