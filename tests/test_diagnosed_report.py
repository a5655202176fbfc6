"""What a diagnosis says: sizes of effects, JSON, CSV, the paragraph and tables on a terminal, the picture."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from measured import MARKERS, on_markers, plan, scattered, somewhere, taken
from rich.console import Console
from scipy.stats import f

from postproc.base.findings import Finding
from postproc.base.geometry import Poses
from postproc.diagnosis.candidates import EVERY
from postproc.diagnosis.decoys import decoys
from postproc.diagnosis.diagnosis import diagnose
from postproc.diagnosis.effect_sizes import SURELY, moved, smallest
from postproc.diagnosis.imitations import MARGIN
from postproc.diagnosis.residual_patterns import READING, SIDE, pattern_words
from postproc.diagnosis.selection import CHANCE, selected
from postproc.diagnosis.verdict import OTHER_COURSE, VERDICTS, Evidence, Named
from postproc.effects import EFFECTS
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.unknowns import asked_for
from postproc.identification.validation import held_out
from postproc.measurements import planned
from postproc.model import StiffnessModel
from postproc.report import diagnosed_picture as picture_module
from postproc.report.diagnosed import Diagnosed, NextPoses, diagnosed_csv
from postproc.report.diagnosed_detection import detection_table
from postproc.report.diagnosed_limits import evidence_words
from postproc.report.diagnosed_names import variable_words
from postproc.report.diagnosed_picture import BARS, betrayals, diagnosed_picture, roles_of, series
from postproc.report.diagnosed_terminal import show_diagnosed
from postproc.report.diagnosed_words import NOUNS, headline, noun, paragraph
from postproc.report.formatting import two_digits
from postproc.robot.description import Mechanism, Quantity, find_robot, load_robot
from postproc.robot.provenance import GAP

SIGMA = 2e-5
TOOL = Poses(np.eye(3), np.array([0.0, 0.5, 0.2]))
GEARS = {(0, f"c{k}"): c * 1e-6 for k, c in enumerate((3.0, 0.27, 0.45, 2.5, 4.0, 2.1), 1)}
"""Not as the robot file states them."""

NO_NUMBER = re.compile(r"\b(nan|None|inf)\b")


def complete() -> StiffnessModel:
    """The arm that is measured."""
    return StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270"))).with_values(GEARS)


def stated() -> StiffnessModel:
    """Its robot file: without the compensator, of which a drawing is known."""
    known = StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270")))
    drawn = {k: Quantity(np.array([known.terms[1].values[k]]), "m", "") for k in ("L", "a_x", "a_y")}
    mechanism = Mechanism("spring", "gravity_compensator", "A2", "", "drawing", drawn, 0)
    bare = known.without_effects(["gravity_compensator"])
    return replace(bare, robot=replace(bare.robot, mechanisms=(mechanism,)))


def readings_of(model, poses=20, seed=0, **words):
    """Readings of three targets under a weight, of ``model`` and with scatter."""
    rng = np.random.default_rng(seed)
    wrench = np.zeros((poses, 6))
    wrench[:, 2] = -2600.0
    q, wrench, markers = on_markers(rng.uniform(*model.robot.limits.T, (poses, 6)), wrench)
    readings = plan(model.robot, q, wrench, tool=TOOL, sigma=SIGMA, **markers, **words)
    campaign = Campaign(readings)
    given = somewhere(campaign, rng) if campaign.tracked else None
    readings = scattered(taken(campaign, model, given), SIGMA, rng)
    return replace(
        readings,
        files=(Path("loads.csv"),),
        digests=("0" * 64,),
        file=0 * readings.line,
        line=np.arange(len(q)) + 9,
    )


def diagnosed(readings, **change) -> Diagnosed:
    model = stated()
    found = diagnose(Campaign(readings), model)
    given = {
        "robot": "kuka_kr270",
        "robot_digest": "1" * 64,
        "robot_path": Path("kuka_kr270.yaml"),
        "data": (("loads.csv", "0" * 64),),
        "diagnosis": found,
        "held_out_before": held_out(found.stated, 5),
        "held_out_after": held_out(found.final, 5),
        "next_poses": None,
    }
    return Diagnosed(**{**given, **change})


@pytest.fixture(scope="module")
def spring():
    """Of an arm with a compensator that its robot file does not have; something else comes near."""
    result = diagnosed(readings_of(complete()))
    (named,) = result.verdict.named
    alias = next(c for c in result.diagnosis.search.linear.candidates if c.name == "link_compliance")
    near = replace(named, evidence=replace(named.evidence, alias=alias, margin=72.4))
    return judged(result, result.verdict.word, named=(near,), refitted=moved_gears(result))


@pytest.fixture(scope="module")
def stale():
    """Of an arm whose gears are not as the robot file says."""
    result = diagnosed(readings_of(complete().without_effects(["gravity_compensator"])))
    return judged(result, result.verdict.word, refitted=moved_gears(result))


def moved_gears(result):
    return tuple(
        e
        for e in result.final.estimates
        if e.unknown.stated and e.unknown.parameter.name in ("c3", "c4", "c5", "c6")
    )


def judged(result, word, final=None, **change) -> Diagnosed:
    """The result with another verdict."""
    verdict = replace(result.verdict, word=word, **change)
    found = replace(result.diagnosis, verdict=verdict, final=final or result.final)
    return replace(result, diagnosis=found)


def lacking(result, word="unknown", **change) -> Diagnosed:
    """The result as if readings scattered by a third of what they do."""
    search = result.diagnosis.search
    given, last = search.linear.problem, search.explained
    search = replace(
        search,
        linear=replace(search.linear, problem=replace(given, residual=3 * given.residual)),
        explained=replace(last, squares=9 * last.squares, coefficients=3 * last.coefficients),
    )
    found = replace(result, diagnosis=replace(result.diagnosis, search=search))
    return judged(found, word, search.base, **{"named": (), **change})


def doubtful(result) -> Diagnosed:
    """The compensator, or else what is nearest to it."""
    (named,) = result.verdict.named
    sets = ((named.candidate, named.evidence.alias),)
    return judged(result, "ambiguous", result.diagnosis.search.base, alternatives=sets)


def next_poses(result, **change) -> NextPoses:
    q, wrench, markers = on_markers(
        np.radians([[0, -90, 90, 0, 45.5, 0], [10, -20, 30, 40, 50, -60]]), np.zeros((2, 6))
    )
    wrench[:, 2] = -9.80665 * np.repeat([100.0, 265.0], len(MARKERS))
    joints = [(joint.name, False) for joint in result.final.model.robot.joints]
    readings = planned(joints, q, wrench, True, tool=TOOL, **markers, **change)
    (between,) = doubtful(result).verdict.alternatives
    return NextPoses(readings, between, (6.2, 7.1))


def told(result, verbose=False, width=160) -> str:
    stream = io.StringIO()
    show_diagnosed(Console(file=stream, width=width), result, verbose)
    return stream.getvalue()


def every_verdict(spring, stale) -> dict[str, Diagnosed]:
    few = ((spring.verdict.named[0].candidate, "no gain on held-out readings"),)
    return {
        "named": spring,
        "nothing_missing": stale,
        "nothing at all": judged(stale, "nothing_missing", refitted=()),
        "ambiguous": doubtful(spring),
        "ambiguous, planned": replace(doubtful(spring), next_poses=next_poses(spring)),
        "partly_named": judged(spring, "partly_named", rejected=few),
        "partly_named, lack": lacking(spring, "partly_named", named=spring.verdict.named),
        "unknown": lacking(spring),
        "unknown, rejected": judged(stale, "unknown", rejected=few),
    }


# What was found


@pytest.mark.slow
def test_the_diagnoses_are_what_they_are_made_of(spring, stale):
    assert spring.verdict.word == "named"
    (named,) = spring.verdict.named
    assert (named.effect, named.joints) == ("gravity_compensator", ("A2",))
    assert stale.verdict.word == "nothing_missing"
    assert stale.verdict.refitted
    assert not spring.scatter_exceeded
    assert not stale.scatter_exceeded
    assert lacking(spring).scatter_exceeded


def test_the_gap_is_that_of_the_fits(spring):
    def rms(values):
        return 1e3 * np.sqrt(np.mean(np.sum(values**2, axis=1)))

    gap, search = spring.gap_mm(), spring.diagnosis.search
    assert list(gap) == list(GAP)
    assert gap["before_rms_mm"] == pytest.approx(rms(spring.diagnosis.stated.residual), abs=1e-6)
    assert gap["after_rms_mm"] == pytest.approx(rms(spring.final.residual), abs=1e-6)
    assert gap["held_out_before_rms_mm"] == pytest.approx(rms(spring.held_out_before), abs=1e-6)
    assert gap["held_out_after_rms_mm"] == pytest.approx(rms(spring.held_out_after), abs=1e-6)
    assert gap["noise_mm"] == pytest.approx(1e3 * np.sqrt(3) * SIGMA, rel=1e-6)
    assert 1e3 * spring.rms["refitted"] == pytest.approx(rms(search.base.residual), abs=1e-6)
    assert 1e3 * spring.rms["explained"] == pytest.approx(rms(search.final.residual), abs=1e-6)
    assert spring.rms["after"] < spring.rms["held_out_after"] < spring.rms["refitted"] < spring.rms["before"]


@pytest.mark.parametrize("word", VERDICTS)
@pytest.mark.parametrize("code", ["IDN016", "IDN024", None])
@pytest.mark.parametrize("strict", [False, True])
def test_exit(stale, word, code, strict):
    findings = (Finding(code, ""),) if code else ()
    result = replace(judged(stale, word), findings=findings, strict=strict)
    warned = code == "IDN016"
    if warned and strict:
        assert result.exit == 1
    else:
        assert result.exit == (0 if word in ("named", "nothing_missing") and not warned else 3)


def test_a_robot_file_is_only_improved_by_what_is_known(stale):
    improves = [word for word in VERDICTS if judged(stale, word).improves]
    assert improves == ["nothing_missing", "named", "partly_named"]
    unmoved = judged(stale, "nothing_missing", refitted=())
    assert unmoved.improves == (unmoved.rms["held_out_after"] < 0.9 * unmoved.rms["held_out_before"])
    assert not replace(unmoved, held_out_after=unmoved.held_out_before).improves


# Sizes of effects


def test_what_an_effect_moves_is_what_the_model_without_it_would_leave(spring):
    (named,) = spring.verdict.named
    model = spring.final.model
    without = model.without_effects(["gravity_compensator"])
    campaign = spring.final.campaign
    start = campaign.start()
    by = (
        campaign.expected(campaign.predicted(model), start)[0]
        - campaign.expected(campaign.predicted(without), start)[0]
    )
    np.testing.assert_allclose(moved(spring.diagnosis.search.final, named), by, atol=1e-9)
    size = spring.moved[named.candidate.key]
    assert size.rms == pytest.approx(np.sqrt(np.mean(np.sum(by**2, axis=1))), rel=1e-6)
    assert size.max == pytest.approx(np.linalg.norm(by, axis=1).max(), rel=1e-6)


def test_what_the_tracker_takes_up_is_not_moved(spring):
    """A zero of the first axis turns all positions: so does the tracker."""
    readings = readings_of(complete(), poses=8, deflection=False)
    campaign, model = Campaign(readings), complete()
    sizes = {}
    for number in (1, 2):
        asked = asked_for(model, [f"joint_offset.o{number}"])
        fitted = fit(campaign, asked.model, ())
        shifted = fitted.model.with_values({u.key: 1e-3 for u in asked.unknowns})
        fitted = replace(fit(campaign, shifted, ()), unknowns=asked.unknowns, covariance=np.eye(1))
        named = Named(
            spring.verdict.named[0].candidate, (), fitted.estimates, spring.verdict.named[0].evidence
        )
        by = moved(fitted, named)
        sizes[number] = np.sqrt(np.mean(by**2))
    assert sizes[1] < 1e-3 * sizes[2]
    assert sizes[2] > 1e-4


def test_gains_of_all_candidates(spring, stale):
    search, gains = spring.diagnosis.search, spring.gains
    names = [candidate.name for candidate in search.linear.candidates]
    (group,) = search.explained.groups
    few = np.array([len(candidate.unknowns) <= 2 for candidate in search.linear.candidates])
    assert names[int(np.argmax(gains.alone * few))] == names[group] == "gravity_compensator"
    assert gains.alone[group] == pytest.approx(gains.beside[group]) == pytest.approx(search_gain(spring))
    others = np.arange(len(names)) != group
    # what the compensator explains no other has to
    assert gains.beside[others].max() < 0.6 * gains.alone[others].max()
    assert (gains.beside < gains.needed)[others].all()
    assert gains.alone[group] > gains.needed[group]
    np.testing.assert_array_equal(stale.gains.alone, stale.gains.beside)
    single = [len(candidate.unknowns) == 1 for candidate in stale.diagnosis.search.linear.candidates]
    poses = stale.diagnosis.search.base.campaign.poses
    np.testing.assert_allclose(stale.gains.needed[single], f.isf(CHANCE / len(single), 1, poses - 1))


def search_gain(result) -> float:
    return result.verdict.named[0].evidence.gain


def test_what_would_have_shown_is_found_that_often(stale):
    """Readings that hold an effect of just that size, with other scatter each time."""
    search, rng = stale.diagnosis.search, np.random.default_rng(5)
    linear, given = search.linear, search.linear.problem
    sizes = {one.candidate.key: one for one in smallest(search)}
    shares = {1.0: [], 0.5: []}
    for g, candidate in enumerate(linear.candidates):
        size = sizes[candidate.key]
        if len(candidate.unknowns) > 1 or candidate.nonlinear or not 0 < size.usual < 100:
            continue
        (place,) = given.places[g]
        column = size.usual * given.matrix[:, place] * np.linalg.norm(linear.columns[g])
        for share, found in list(shares.items()) * 3:
            scatter = rng.normal(size=given.residual.shape)
            scatter -= (given.residual == 0) * scatter
            drawn = replace(given, residual=share * column + scatter)
            found.append(bool(selected(drawn, range(len(linear.candidates))).groups))
    assert len(shares[1.0]) >= 12
    assert np.mean(shares[1.0]) > SURELY - 0.15
    assert np.mean(shares[0.5]) < 0.6


def test_the_size_that_would_have_shown_is_that_of_the_effect(stale):
    final = stale.final
    campaign, start = final.campaign, final.campaign.start()
    for name in ("backlash.b2", "backlash.b3", "backlash.b5"):
        asked = asked_for(final.model, [name])
        (unknown,) = asked.unknowns
        (one,) = (
            one
            for one in smallest(stale.diagnosis.search)
            if (one.candidate.name, one.candidate.joint) == (name.partition(".")[0], unknown.parameter.joint)
        )
        model = asked.model.with_values({unknown.key: one.usual * unknown.parameter.scale})
        before, after = (campaign.expected(campaign.predicted(m), start)[0] for m in (final.model, model))
        assert one.rms == pytest.approx(np.sqrt(np.mean(np.sum((after - before) ** 2, axis=1))), rel=0.05)


def test_what_shows_is_told(spring, stale):
    sizes = np.array([one.rms for one in smallest(stale.diagnosis.search)])
    assert np.mean(sizes[np.isfinite(sizes)] <= stale.detectable) == pytest.approx(0.9, abs=0.03)
    # half as large as the scatter of one reading, or more: there are many
    assert 0.2 * stale.scatter < stale.detectable < 3 * stale.scatter
    # what changes little under load vanishes from differences
    assert {"transmission_error", "hysteresis", "joint_offset"} <= set(stale.verdict.not_testable)
    assert not {"backlash", "joint_stiffening", "link_compliance"} & set(stale.hardly_tested)
    assert "gravity_compensator" not in spring.hardly_tested
    assert {"backlash", "gravity_compensator"} <= set(stale.tried)
    assert "thermal_growth" not in stale.tried
    assert "thermal_growth" in stale.verdict.not_testable


# JSON and CSV

KEYS = {
    "verdict",
    "named",
    "ambiguous",
    "not_testable",
    "refitted",
    "residual_patterns",
    "gap",
    "next_poses",
    "next_poses_beyond",
    "robot_file",
}
KEYS |= {
    "alternatives",
    "conditional",
    "reduced_chi2",
    "rejected",
    "robot",
    "data",
    "findings",
    "outputs",
    "exit",
}


def test_json_of_a_name(spring):
    found = json.loads(json.dumps(spring.as_json(), allow_nan=False))
    assert set(found) >= KEYS
    assert (found["verdict"], found["exit"], found["ambiguous"], found["next_poses"]) == (
        "named",
        0,
        [],
        None,
    )
    assert {key: found["gap"][key] for key in GAP} == spring.gap_mm()
    (named,) = found["named"]
    assert (named["effect"], named["joints"]) == ("gravity_compensator", ["A2"])
    truth = complete().terms[1].values
    for name, unit in (("K_c", "N/m"), ("s0", "m")):
        one = named["parameters"][name]
        assert one["unit"] == unit
        assert abs(one["value"] - truth[name]) < 2 * one["ci95"] < truth[name]
    evidence = named["evidence"]
    assert evidence["likelihood_gain"] == search_gain(spring)
    assert 0 < evidence["expected_by_chance"] < 1e-8, "a small number is no zero"
    assert set(evidence) >= {
        "likelihood_gain",
        "expected_by_chance",
        "held_out_poses",
        "held_out_regions",
        "held_out_sessions",
        "margin_to_next",
        "next",
    }
    assert evidence["held_out_sessions"] is None
    assert set(evidence["next"]) == {"effect", "joint", "options", "label"}
    for one in found["refitted"]:
        term, name = one["parameter"].split(".")
        assert term == "joint_compliance"
        assert abs(one["value"] - GEARS[0, name]) < 2 * one["ci95"] < abs(one["value"] - one["before"])
    assert all(
        0 < one["share"] <= 1 for one in found["residual_patterns"] + found["residual_patterns_refitted"]
    )


def test_json_of_what_can_not_be_told_apart(spring):
    result = doubtful(spring)
    found = result.as_json()
    (named,) = spring.verdict.named
    alias = named.evidence.alias
    assert found["ambiguous"] == [["gravity_compensator", alias.name]]
    first = found["alternatives"][0][0]
    assert (first["effect"], first["joint"]) == ("gravity_compensator", "A2")
    assert (first["label"], first["options"]["joint"]) == ("gravity_compensator on A2", "A2")
    assert found["named"] == [], "what may be another is not named"
    assert found["exit"] == 3
    # each name once, each set once
    pair = (named.candidate, alias, replace(alias, joint="A5"))
    twice = judged(result, "ambiguous", alternatives=(pair, pair[:2]))
    assert twice.as_json()["ambiguous"] == [["gravity_compensator", alias.name]]
    planned = replace(result, next_poses=next_poses(spring), next_poses_file="which.csv").as_json()
    first, second = planned["next_poses"]
    assert first == pytest.approx(
        {"A1": 0, "A2": -90, "A3": 90, "A4": 0, "A5": 45.5, "A6": 0, "load_kg": 100}
    )
    assert second["load_kg"] == pytest.approx(265)
    assert planned["next_poses_file"] == "which.csv"
    assert [one["effect"] for one in planned["next_poses_between"]] == ["gravity_compensator", alias.name]
    sense = np.tile([1, -1, 0, 1, 1, 1], (2 * len(MARKERS), 1))
    sensed = replace(result, next_poses=next_poses(spring, direction=sense)).as_json()
    assert [sensed["next_poses"][0][f"DIR{k}"] for k in (1, 2, 3)] == [1, -1, 0]


def test_json_knows_no_numbers_that_are_none(spring, stale):
    alone = Evidence(5.0, 0.5, np.nan, np.nan, np.nan, np.inf, None)
    (named,) = spring.verdict.named
    result = judged(spring, "named", named=(replace(named, evidence=alone),), conditional=True)
    found = json.loads(json.dumps(result.as_json(), allow_nan=False))
    assert {found["named"][0]["evidence"][key] for key in ("margin_to_next", "held_out_poses", "next")} == {
        None
    }
    assert found["reduced_chi2"] is None, "a variance over nothing stated"
    assert not NO_NUMBER.search(told(result))
    for one in every_verdict(spring, stale).values():
        json.dumps(one.as_json(), allow_nan=False)


def test_csv_has_a_row_for_each_reading(spring):
    reader = csv.DictReader(io.StringIO(diagnosed_csv(spring).decode(), newline=""))
    rows = list(reader)
    assert len(rows) == len(spring.final.campaign)
    assert rows[4]["file"] == "loads.csv"
    assert (rows[4]["line"], rows[4]["pose"], rows[4]["target"], rows[4]["fitted"]) == ("13", "2", "M2", "1")
    for name, values in (
        ("before", spring.diagnosis.stated.residual),
        ("after", spring.final.residual),
        ("held_out", spring.held_out_after),
    ):
        cells = [[float(row[f"{name}_d{axis}_mm"]) for axis in "xyz"] for row in rows]
        np.testing.assert_allclose(cells, 1e3 * values, atol=1e-6)


# Words


def test_every_effect_has_words():
    assert set(NOUNS) == set(EFFECTS)
    joints = StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270"))).robot.joints
    for name, words in NOUNS.items():
        by_joint = {parameter.joint for parameter in EFFECTS[name](joints).parameters} != {""}
        assert not ("{joints}" in words and not by_joint), name


def test_a_paragraph_of_each_verdict(spring, stale):
    for name, result in every_verdict(spring, stale).items():
        text = paragraph(result)
        assert text.endswith("."), name
        assert not NO_NUMBER.search(text), text
        assert "  " not in text
        assert "thermal_growth" in text, "what was not tested is said"
        assert headline(result).startswith(result.verdict.word.replace("_", " "))
        conditional = judged(result, result.verdict.word, conditional=True)
        assert "neither SIGMA nor repeated readings state it" in paragraph(conditional)
        assert "where readings scatter by" not in paragraph(conditional), "nobody knows that"
        assert "is the scatter of the readings" not in paragraph(conditional)
        assert "state it" not in text


def millimetres(length) -> str:
    return f"{1e3 * length:.3f} mm"


def test_what_is_said_of_a_name(spring):
    text = paragraph(spring)
    (named,) = spring.verdict.named
    spring_constant = next(e for e in named.estimates if e.unknown.parameter.name == "K_c")
    value, wide = (float(word) for word in re.search(r"K_c = (\d+) \+- (\d+) N/mm", text).groups())
    assert 1e3 * value == pytest.approx(spring_constant.value, abs=0.06 * spring_constant.ci95)
    assert 1e3 * wide == pytest.approx(spring_constant.ci95, rel=0.06)
    assert text.startswith("The missing effect is a gravity compensator across A2")
    assert f"displaces these readings by {millimetres(spring.moved[named.candidate.key].rms)} RMS" in text
    assert (
        f"robot file is {millimetres(spring.rms['before'])} RMS, {millimetres(spring.rms['refitted'])} with its own"
        in text
    )
    assert (
        f"falls from {1e3 * spring.rms['held_out_before']:.3f} to {millimetres(spring.rms['held_out_after'])} RMS"
        in text
    )
    share = int(re.search(r"by (\d+) % of the part above the scatter", text)[1])
    beyond = spring.rms["held_out_before"] - spring.scatter
    assert share == pytest.approx(
        100 * (spring.rms["held_out_before"] - spring.rms["held_out_after"]) / beyond, abs=1.01
    )
    assert (
        f"({named.evidence.alias.label}), fits clearly worse: its likelihood gain is {named.evidence.margin:.0f} lower"
        in text
    )
    assert "joint_compliance.c5 from 3.303 to" in text
    assert "would have been found" not in text
    alone = replace(named, evidence=replace(named.evidence, alias=None, margin=np.inf))
    assert "No other effect that was tried explains nearly as much." in paragraph(
        judged(spring, "named", named=(alone,))
    )


def test_several_names(spring):
    (named,) = spring.verdict.named
    nearer = replace(named.evidence, margin=11.0)
    other = replace(named, evidence=nearer, joints=(), candidate=replace(named.candidate, joint=EVERY))
    text = paragraph(judged(spring, "named", named=(named, other)))
    assert text.startswith("2 effects are missing. (1) a gravity compensator across A2:")
    assert "(2) a gravity compensator across the joints:" in text
    # the doubt of both is that of the more doubtful one
    assert f" ({named.evidence.alias.label}), fits clearly worse: its likelihood gain is 11 lower" in text


def test_what_does_not_hold_elsewhere_is_told(spring):
    text = paragraph(replace(spring, held_out_after=2 * spring.held_out_before))
    assert "on held-out poses the residual does not fall" in text
    assert "above the scatter" not in text


def test_what_can_be_there_unseen_is_stated(stale, spring):
    limits = {(one.candidate.label): one for one in stale.detection_limits}
    one = limits["backlash on A2"]
    (size,) = one.parameters
    text = paragraph(stale)
    assert (
        f"What is smaller can be there without being seen in {stale.final.campaign.poses} poses: for" in text
    )
    table = detection_table(stale, False)
    rows = list(zip(*(column.cells for column in table.columns), strict=True))
    (row,) = (cells for cells in rows if cells[0] == "backlash")
    heads = [str(column.header) for column in table.columns]
    assert row[heads.index("A2")] == two_digits(size / 1e-3)
    assert row[-1] == "mrad"
    entry = next(e for e in stale.as_json()["detection_limits"] if e["label"] == "backlash on A2")
    assert entry["parameters"] == {"b2": {"smallest": size, "unit": "rad"}}
    assert entry["displacement_rms_mm"] == pytest.approx(1e3 * one.rms, rel=1e-3)
    # what is named elsewhere is no limit
    assert spring.as_json()["detection_limits"] == []
    assert not detection_table(spring, True).row_count
    assert "without being seen" not in paragraph(spring)


@pytest.mark.parametrize(
    ("variable", "words"),
    [
        ("A2 over its torque", "the torque of A2"),
        ("A3 over its approach", "the side from which A3 comes"),
        ("order", "the order of the readings"),
        ("load", "the load"),
    ],
)
def test_what_a_residual_depends_on_is_a_phrase(variable, words):
    assert variable_words(variable) == words


def test_what_is_said_of_nothing(stale):
    text = paragraph(stale)
    moved_ = len(stale.verdict.refitted)
    assert text.startswith(f"No effect is missing, but {moved_} parameters of the robot file have changed: ")
    assert f"The residual, {millimetres(stale.rms['after'])} RMS, is the scatter of the readings" in text
    assert (
        f"A missing effect of about {millimetres(stale.detectable)} RMS or more would have been found" in text
    )
    nothing = paragraph(judged(stale, "nothing_missing", refitted=()))
    assert nothing.startswith("No effect is missing. The residual of the robot file is")
    good = judged(stale, "nothing_missing", refitted=())
    good = replace(good, diagnosis=replace(good.diagnosis, stated=stale.final))
    assert paragraph(good).startswith("No effect is missing. The residual")
    assert paragraph(judged(good, "nothing_missing", conditional=True)).startswith(
        "No effect appears to be missing. A missing effect"
    )
    quiet = replace(stale.final, variance=0.3, freedom=60)
    assert "clearly smaller than the scatter (" in paragraph(judged(stale, "nothing_missing", quiet))
    few = replace(quiet, freedom=4)  # chance leaves as little
    assert "clearly smaller than the scatter (" not in paragraph(judged(stale, "nothing_missing", few))
    wild = np.array(stale.final.residual)
    wild[0] += 3e-3
    far = replace(stale)
    far.__dict__["rms"] = {**stale.rms, "after": 4 * stale.scatter}
    assert "a few of them are far off" in paragraph(far)


def test_what_is_said_of_doubt(spring):
    result = doubtful(spring)
    (named,) = spring.verdict.named
    alias = named.evidence.alias.label
    text = paragraph(result)
    assert (
        "These readings can not distinguish a gravity compensator across A2 (gravity_compensator on A2) or "
        in text
    )
    assert f" ({alias}): each explains" in text
    assert "so the robot file is not changed" in text
    assert "No pose within the limits" in text
    assert "K_c" not in text
    more = lacking(result, "ambiguous", named=result.verdict.named)
    assert "More is missing" not in text
    assert f"More is missing: the residual is {millimetres(result.rms['explained'])} RMS" in paragraph(more)
    planned = replace(result, next_poses=next_poses(spring))
    assert "Measure these 2 poses: there gravity_compensator on A2" in paragraph(planned)
    assert "by 6.2 standard deviations" in paragraph(planned)
    assert "ranges measured so far" not in paragraph(planned)
    far = replace(planned, next_poses=replace(planned.next_poses, beyond=("A2", "A4")))
    assert "They leave the ranges measured so far of A2 and A4" in paragraph(far)
    near = replace(planned, next_poses=replace(planned.next_poses, separation=(9.0, 0.4)))
    assert "would not distinguish them: there gravity_compensator on A2" in paragraph(near)
    assert "differ by 0.4 standard deviations, 5.2 are required" in paragraph(near)
    assert "Measure these" not in paragraph(near)
    assert "Measure these 2 poses (which.csv): " in paragraph(replace(planned, next_poses_file="which.csv"))


def test_a_pose_that_can_not_be_left_out(stale):
    """One that alone shows something says nothing against the rest."""
    worse = stale.held_out_after.copy()
    worse[stale.final.campaign.pose == 3] += 5e-3
    text = paragraph(replace(stale, held_out_after=worse))
    kept = np.delete(stale.held_out_after, np.flatnonzero(stale.final.campaign.pose == 3), axis=0)
    rms = np.sqrt(np.mean(np.sum(kept**2, axis=1)))
    (told,) = re.findall(r" to (\S+) mm RMS, except at 2 poses that can not be held out", text)
    assert float(told) == pytest.approx(1e3 * rms, rel=0.15)
    assert "does not fall" not in text


def test_hardware_that_is_known_is_taken(spring):
    (named,) = spring.verdict.named
    near = replace(named, evidence=replace(named.evidence, margin=2.4))
    text = paragraph(judged(spring, "named", named=(near,)))
    assert "is only 2 lower" in text
    assert "the gravity_compensator is named because the robot file describes one" in text
    assert "clearly worse" not in text


def test_what_is_said_of_the_unknown(spring, stale):
    result = lacking(spring)
    text = paragraph(result)
    assert text.startswith(
        f"An effect is missing: the residual is {millimetres(result.rms['after'])} RMS where readings scatter"
    )
    assert f"none of the {len(result.tried)} effects that were tried" in text
    assert (
        "The best explanation is a gravity compensator across A2 (gravity_compensator on A2), but the residual would"
        " still be"
        f" {millimetres(result.rms['explained'])}" in text
    )
    assert f"The residual depends on {variable_words(result.patterns[0].variable)} (" in text
    rejected = (
        (stale.diagnosis.search.linear.candidates[0], "its parameters would have to lie at their bounds"),
    )
    unclear = judged(stale, "unknown", rejected=rejected)
    assert paragraph(unclear).startswith("It is not clear whether an effect is missing.")
    assert "is not named: its parameters would have to lie at their bounds" in paragraph(unclear)
    assert headline(unclear) == "unknown: not clear whether an effect is missing"
    alone = judged(spring, "unknown", final=spring.diagnosis.base, named=(), rejected=rejected)
    assert headline(alone) == "unknown: an effect is missing, and it is not clear which"
    assert paragraph(alone).startswith(
        f"An effect is missing: the residual is {millimetres(alone.rms['after'])} RMS where readings scatter by"
    )
    assert "Which one is not clear." in paragraph(alone)
    part = lacking(spring, "partly_named", named=spring.verdict.named)
    assert f"More is missing: the residual is {millimetres(part.rms['after'])} RMS" in paragraph(part)


def test_what_the_readings_follow_instead(spring):
    found = spring.diagnosis.search
    (named,) = spring.verdict.named
    (foil,) = (rival for rival in found.rivals if rival.is_decoy)
    model, campaign = found.base.model, found.base.campaign

    def text(effect, joint, worse):
        mine = replace(named.candidate, effect=effect, joint=joint)
        course = decoys(model, campaign, mine)[0]
        rival = replace(foil, of=mine.key, candidate=course, worse=worse, more=0.0, fitted=True)
        result = lacking(spring, rejected=((mine, OTHER_COURSE),))
        search = replace(result.diagnosis.search, rivals=(rival,))
        return paragraph(replace(result, diagnosis=replace(result.diagnosis, search=search)))

    assert (
        "is not named: the readings follow another course than that of this effect; a stiffness that varies freely"
        " with the angle of A2, no effect of the library, has a likelihood gain 130 higher."
    ) in text(named.candidate.effect, "A2", -130.0)
    assert "higher" not in text(named.candidate.effect, "A2", -0.9 * MARGIN)
    wave = EFFECTS["transmission_error"](model.robot.joints)
    assert "; an error that comes back 0.5 times a turn of A4, no effect" in text(wave, "A4", -20.0)
    growth = EFFECTS["thermal_growth"](model.robot.joints)
    assert "; a drift of the whole arm, no effect" in text(growth, "A3", -20.0)


def test_what_would_show_what_was_not_tested(stale):
    fitted = stale.final
    assert evidence_words("joint_offset", fitted) == "absolute positions"
    assert evidence_words("thermal_growth", fitted).startswith("a column TEMP")
    assert evidence_words("hysteresis", fitted) == "poses reached from both sides"
    # no pose moves a target on the flange by what the spindle gives
    assert evidence_words("tool_compliance", fitted).startswith("readings at the tip of the tool")
    assert "compensate plan" in evidence_words("link_compliance", fitted)
    warm = replace(fitted.campaign.readings, temperature=np.linspace(20, 30, len(fitted.campaign)))
    assert evidence_words("thermal_growth", replace(fitted, campaign=Campaign(warm))) == "absolute positions"
    readings = readings_of(complete(), poses=2, deflection=False)
    idle = replace(readings, wrench=0 * readings.wrench)
    there = replace(fitted, campaign=Campaign(idle))
    assert evidence_words("joint_compliance", there) == "readings with and without a weight"
    unplaced = replace(there, campaign=Campaign(replace(idle, places={})))
    assert evidence_words("tool_offset", unplaced) == "targets with stated positions"
    rigid = replace(fitted.point, model=replace(fitted.model, terms=()))
    assert "joint compliance" in evidence_words("payload", replace(there, point=rigid))


# Terminal


def test_the_tables_tell_what_was_found(spring):
    text = told(spring)
    assert text.startswith("named: gravity_compensator on A2\nThe missing effect is")
    (named,) = spring.verdict.named
    assert "60 readings (deflections) at 20 poses, 3 targets, 1 session" in text
    for estimate in named.estimates:
        (row,) = re.findall(rf"^  {estimate.unknown.parameter.name} +(\d+) +(\d+)", text, re.M)
        size = {"N/m": 1e3, "m": 1e-3}[estimate.unknown.parameter.unit]
        assert float(row[0]) * size == pytest.approx(estimate.value, abs=0.06 * estimate.ci95)
        assert float(row[1]) * size == pytest.approx(estimate.ci95, rel=0.06)
    evidence = re.search(r"^gravity_compensator on A2 +(\d+) +(\S+) .* next: (.+?) *$", text, re.M)
    assert float(evidence[1]) == pytest.approx(named.evidence.gain, abs=0.51)
    assert evidence[3] == named.evidence.alias.label
    for one in spring.verdict.refitted:
        assert re.search(rf"^{one.unknown.name} +{1e6 * one.unknown.value:.3f}", text, re.M)
    for name, words in (("before", "robot file"), ("refitted", "its own parameters refitted")):
        assert re.search(rf"^{words} +{1e3 * spring.rms[name]:.3f} ", text, re.M)
    first = spring.patterns[0]
    assert re.search(rf"^{first.variable} +{100 * first.share:.0f} %", text, re.M)
    assert "-o NEW.yaml writes the new robot file" in text
    assert "-o NEW.yaml" not in told(replace(spring, robot_file="new.yaml", outputs=("new.yaml",)))
    assert max(len(line.rstrip()) for line in told(spring, width=110).splitlines()[1:]) <= 110


def test_the_tables_of_doubt(spring):
    result = replace(doubtful(spring), next_poses=next_poses(spring))
    text = told(result)
    keys = [candidate.key for candidate in spring.diagnosis.search.linear.candidates]
    for candidate in result.verdict.alternatives[0]:
        gain = spring.gains.alone[keys.index(candidate.key)]
        assert re.search(rf"^{re.escape(candidate.label)} +{gain:.0f} *$", text, re.M)
    assert re.search(r"^1 +0\.0 +-90\.0 +90\.0 +0\.0 +45\.5 +0\.0 +100\.0", text, re.M)
    assert "--next-poses FILE.csv writes the poses" in text
    assert "--next-poses" not in told(replace(result, next_poses_file="which.csv"))
    assert "-o NEW.yaml" not in text
    assert "DIR" not in text
    sense = np.ones((2 * len(MARKERS), 6))
    assert "columns DIR of the plan" in told(replace(result, next_poses=next_poses(spring, direction=sense)))


def test_every_verdict_is_shown(spring, stale):
    for result in every_verdict(spring, stale).values():
        text = told(result)
        assert text.startswith(headline(result))
        assert not NO_NUMBER.search(text)
    long, short = told(lacking(spring), verbose=True), told(lacking(spring))
    assert len(long.splitlines()) >= len(short.splitlines())


def test_names_do_not_drive_the_terminal(spring):
    hostile = replace(spring, data=(("a\x1b[2J[red].csv", "0" * 64),), outputs=("out\x1b[2J.yaml",))
    text = told(hostile)
    assert "\x1b" not in text
    assert "a?[2J[red].csv" in text


# Picture


def drawn(monkeypatch, result):
    """The panels of the figure that is drawn of ``result``."""
    figures = []
    monkeypatch.setattr(picture_module, "rendered", lambda draw, kind: figures.append(draw()))
    diagnosed_picture(result, "png")
    return figures[0].axes


@pytest.mark.slow
def test_picture_files(spring):
    raw = diagnosed_picture(spring, "png")
    assert raw == diagnosed_picture(spring, "png")
    assert raw.startswith(b"\x89PNG")
    shapes = ElementTree.fromstring(diagnosed_picture(spring, "svg")).iter()
    assert sum(bool(re.fullmatch(r"axes_\d+", node.get("id", ""))) for node in shapes) == 4


def test_the_picture_shows_the_gap_of_each_pose(monkeypatch, spring):
    gap, *_ = drawn(monkeypatch, spring)
    lines = {line.get_label(): line for line in gap.lines}
    assert list(lines)[:2] == ["robot file", "its parameters refitted"]
    for label, residual in (
        ("robot file", spring.diagnosis.stated.residual),
        ("final model", spring.final.residual),
        ("final model, held-out poses", spring.held_out_after),
    ):
        mean = np.sqrt(np.mean(np.sum(residual.reshape(20, 3, 3) ** 2, axis=2), axis=1))
        order = [int(text.get_text()) - 1 for text in gap.get_xticklabels()]
        np.testing.assert_allclose(lines[label].get_ydata(), 1e3 * mean[order], rtol=1e-9)
    assert (np.diff(lines["robot file"].get_ydata()) <= 0).all()


def test_the_picture_shows_what_betrays_the_effect(monkeypatch, spring, stale):
    first, second = betrayals(spring)
    assert {one.variable.name for one in (first, second)} == {"A2 over its torque", "A2 over its angle"}
    angle = next(one for one in (first, second) if one.variable.unit == "deg")
    campaign = spring.final.campaign
    np.testing.assert_allclose(angle.variable.values, np.degrees(campaign.readings.q[:, 1]))
    # along the way that each target takes when A2 turns
    model, seen = replace(spring.final.model, terms=()), []
    for step in (-1e-6, 1e-6):
        moved_ = replace(campaign.readings, q=campaign.readings.q + step * np.eye(6)[1], deflection=False)
        there = Campaign(replace(moved_, in_robot_frame=True))
        seen.append(there.expected(there.predicted(model), there.start())[0])
    way = (seen[1] - seen[0]) / np.linalg.norm(seen[1] - seen[0], axis=1)[:, None]
    for values, fitted in ((angle.before, spring.diagnosis.search.base), (angle.after, spring.final)):
        np.testing.assert_allclose(values, 1e3 * np.sum(fitted.residual * way, axis=1), atol=2e-3)
    assert np.std(angle.after) < 0.3 * np.std(angle.before)
    panels = drawn(monkeypatch, spring)
    assert len(panels) == 4
    assert "of the residual" in panels[1].get_title()
    # where nothing betrays anything, the order of the readings is shown once
    calm = replace(stale)
    calm.__dict__["patterns"] = ()
    (only,) = betrayals(calm)
    assert (only.variable.name, only.turning) == ("order", False)
    np.testing.assert_allclose(only.after, 1e3 * np.linalg.norm(stale.final.residual, axis=1))
    assert len(drawn(monkeypatch, calm)) == 3


def test_the_picture_shows_the_evidence(monkeypatch, spring):
    *_, bars = drawn(monkeypatch, spring)
    labels = [text.get_text() for text in bars.get_yticklabels()]
    assert labels[0] == "gravity_compensator on A2"
    assert spring.verdict.named[0].evidence.alias.label in labels
    assert len(labels) == BARS
    widths = [patch.get_width() for patch in bars.patches[::2]]
    assert widths == sorted(widths, reverse=True)
    assert widths[0] == pytest.approx(search_gain(spring))
    rejected = judged(
        doubtful(spring), "ambiguous", rejected=((spring.diagnosis.search.linear.candidates[-1], ""),)
    )
    roles = roles_of(rejected)
    assert sorted(roles.values()) == ["indistinguishable", "indistinguishable", "rejected"]
    assert sorted(roles_of(spring).values()) == ["named", "next explanation"]


def test_each_fit_is_drawn_once(spring, stale):
    assert series(spring) == ["before", "refitted", "after", "held_out_after"]
    assert series(stale) == ["before", "after", "held_out_after"]
    assert series(doubtful(spring)) == ["before", "explained", "after", "held_out_after"]


def test_no_noun_has_an_empty_place(spring):
    """A weight of the whole arm stands beside no joint."""
    whole = next(c for c in candidates_of(spring, "link_gravity") if not c.up_to_joint)
    part = next(c for c in candidates_of(spring, "link_gravity") if c.up_to_joint)
    (named,) = spring.verdict.named
    assert noun(replace(named, candidate=whole, joints=())).startswith(
        "the arm's own weight beyond the joints:"
    )
    assert f"up to {part.up_to_joint}:" in noun(replace(named, candidate=part, joints=()))


def candidates_of(result, name):
    search = result.diagnosis.search
    return [c for c in (*search.linear.candidates, *search.untestable) if c.name == name]


def test_words_of_patterns_name_sides_and_readings():
    residual = np.zeros((9, 3))
    residual[0], residual[5:] = 9e-3, 1e-3
    part = np.array([1, 0, 0, 0, 0, 2, 2, 2, 2])
    words = pattern_words(residual, part, np.array([[-1.0, -1.0], [0.0, 0.0], [1.0, 1.0]]), SIDE)
    # the one reading of no side is no part
    assert words == "1.73 mm at places from below, 0 mm at places from above"
    rows = pattern_words(residual, part, np.array([[1.0, 3.7], [3.7, 6.3], [6.3, 9.0]]), READING)
    assert rows == "1.73 mm at readings 7 .. 9, 0 mm at readings 1 .. 3"
