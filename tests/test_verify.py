"""``verify``: what the tool does along the written paths, and which motions belong together."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from conftest import LINES
from motions import toolpath_of
from path_cases import circle, line
from path_cases import task as hand_made

from postproc.base.units import MM
from postproc.compensation.correct import correct
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.output.write import plan_motions
from postproc.report.report import Spread
from postproc.report.verified import verdict_sentence
from postproc.toolpath import Arcs, Configuration, Kind
from postproc.verification.pairing import Different, pair_motions
from postproc.verification.simulator import Simulator
from postproc.workflows.preparation import Request, prepare
from postproc.workflows.verify import verify


def prepared(path):
    return prepare(Request(program=path, force="")).task


def as_run(task, limits=None, gain=1.0):
    """The task of the program that a correction makes of ``task``, without going through a text."""
    task = replace(task, gain=gain)
    division = subdivide(task, correct(task), limits or Limits(max_growth=100.0))
    plan, old = plan_motions(task, division), task.toolpath
    kind = np.where(division.transitions, Kind.LIN, old.kind[plan.source])
    path = toolpath_of(
        kind=kind,
        position=plan.position[:],
        rotation=plan.rotation[:],
        axes=old.axes[plan.source],
        feed=old.feed[plan.source],
        base=old.base[plan.source],
        tool=old.tool[plan.source],
        configuration=Configuration({k: one[plan.source] for k, one in old.configuration.numbers.items()}),
        line=np.arange(len(plan)) + 100,
        frames=old.frames,
        arcs=Arcs(plan.centre, plan.normal, plan.sweep),
        approximation=old.approximation[plan.source],
        stops=old.stops[plan.source],
    )
    base, tool = task.base[plan.source], task.tool[plan.source]
    track = replace(task.track, q=task.track.q[plan.source], branch=task.track.branch[plan.source])
    run = replace(task, toolpath=path, wanted=base @ path.target_in_base, base=base, tool=tool, track=track)
    return run, division


def simulated(task, run):
    """``run`` in the place of ``task``, and the original itself."""
    pairing = pair_motions(task, run)
    simulator, cuts = Simulator.of(task, pairing), pairing.stretches
    return simulator.run(task, cuts.start, cuts.stop), simulator.run(run, pairing.start, pairing.stop)


def bend():
    """A right angle under one force."""
    points = [[1.5, 0, 0.6], [1.5, 0, 0.5], [1.6, 0, 0.5], [1.6, 0.1, 0.5], [1.6, 0.1, 0.6]]
    return hand_made(points, [False, False, True, True, False])


@pytest.mark.parametrize("build", [line, circle, bend])
def test_a_correction_holds_on_another_way_of_looking(build):
    task = build()
    run, division = as_run(task)
    before, after = simulated(task, run)
    assert before.samples.distance.max() > 1 * MM
    assert after.converged
    assert after.largest <= task.tolerance
    assert len(after.approaches) == division.transitions.sum() == 1
    assert after.change <= 2e-7
    assert (after.samples.first | after.samples.last).sum() == 2


def test_without_points_of_its_own_the_middle_is_seen():
    task = line()
    run, _ = as_run(task, Limits(min_segment=10.0, max_growth=100.0))
    _, after = simulated(task, run)
    assert 0.05 * MM < after.largest < 0.2 * MM
    middle = after.samples.share[np.argmax(after.samples.distance)]
    assert 0.3 < middle < 0.7


def test_half_a_correction_leaves_half_the_error():
    task = line()
    run, _ = as_run(task, gain=0.5)
    before, after = simulated(task, run)
    assert after.largest == pytest.approx(before.largest / 2, rel=0.02)


def test_what_lies_beside_the_path_is_measured(job):
    """Without compliance to speak of: a path written 0.3 mm beside its place is 0.3 mm beside it, wherever."""
    lines = list(LINES)
    lines[8] = ";FORCE 0.001 0 0 @base"
    lines[17] = ";FORCE 0 0.001 0 @base"
    source = job.write(lines)
    beside = [
        row.replace("Y 0.000", "Y 0.300") if row.startswith("LIN {X") and "Z -2" in row else row
        for row in lines
    ]
    other = job.write(beside, name="beside.src")
    task, run = prepared(source), prepared(other)
    _, found = simulated(task, run)
    assert found.largest == pytest.approx(0.3 * MM, rel=1e-3)
    worst = int(np.argmax(found.samples.distance))
    assert run.toolpath.line[found.samples.motion[worst]] in (10, 11)


def test_points_on_the_way_change_nothing(job):
    source = job.write(LINES)
    more = list(LINES)
    at = more.index("LIN {X 200.000,Y 0.000,Z -2.000,A 0.000,B 0.000,C 180.000} C_DIS ; slot")
    for x in (180, 160, 140, 120):
        more.insert(at, f"LIN {{X {x}.000,Y 0.000,Z -2.000,A 0.000,B 0.000,C 180.000}} C_DIS")
    other = job.write(more, name="more.src")
    one, two = simulated(prepared(source), prepared(other))
    assert two.largest == pytest.approx(one.largest, rel=1e-3)
    assert not len(two.approaches)


@pytest.mark.parametrize("lost", [4, 9, 14, 18])
def test_a_program_that_lacks_a_motion_is_another_one(job, lost):
    source = job.write(LINES)
    other = job.write([*LINES[:lost], *LINES[lost + 1 :]], name="other.src")
    task, run = prepared(source), prepared(other)
    with pytest.raises(Different):
        pair_motions(task, run)


def test_the_command(compensate, job):
    assert compensate(job.program, "--force", "-q").code == 0
    done = compensate("verify", job.program, job.output, "--force", "--json", "-")
    assert done.code == 0
    assert done.json["original"]["max"] > 1
    assert done.json["compensated"]["max"] <= 0.02
    assert done.json["compensated"]["cut_ends"]["max"] <= 0.05
    assert done.json["compensated"]["stops"] <= done.json["original"]["stops"]
    assert done.json["compensated"]["backwards"] == 0
    assert done.json["compensated"]["converged"]
    assert done.json["compensated"]["orientation_deg"] <= 0.01
    assert done.json["compensated"]["doubling"]["mm"] <= 2e-4
    assert done.json["samples"] > 100
    assert len(done.json["compensated"]["worst"]) <= 10
    said = compensate("verify", job.program, job.output, "--force")
    assert "compensated" in said.out
    assert "worst places" in said.out
    assert "verdict: within tolerance along the whole path: 0.0" in said.out
    assert done.json["verdict"] == "within_tolerance"


def test_the_verdict_is_on_position_and_orientation(compensate, job):
    """Each alone is enough; without a figure of one of them there is none."""
    compensate(job.program, "--force", "-q")
    done = verify(Request(program=job.program, force=""), job.output)
    assert done.verdict == "within_tolerance"
    for change, words in (
        ({"turn": 1.01 * done.tolerance_angle}, "needs review: 0.0101 deg exceeds the tolerance 0.01 deg"),
        (
            {"error": Spread(2 * done.tolerance, 0.0, 0.0)},
            "needs review: 0.0400 mm exceeds the tolerance 0.02 mm",
        ),
    ):
        worse = replace(done, compensated=replace(done.compensated, **change))
        assert (worse.verdict, verdict_sentence(worse)) == ("needs_review", words)
    for change in ({"turn": np.nan}, {"converged": False}):
        unknown = replace(done, compensated=replace(done.compensated, **change))
        assert unknown.verdict is None
        assert "within" not in verdict_sentence(unknown)


def test_the_original_itself_is_above_tolerance_and_has_no_mark(compensate, job):
    done = compensate("verify", job.program, job.program, "--force", "--json", "-")
    assert done.code == 3
    assert {finding["code"] for finding in done.json["findings"]} >= {"VER002", "VER003"}
    assert done.json["original"] == done.json["compensated"]
    assert done.json["verdict"] == "needs_review"
    said = compensate("verify", job.program, job.program, "--force").out
    assert re.search(
        r"verdict: needs review: \d\.\d{4} mm exceeds the tolerance 0\.02 mm, 0\.\d{4} deg", said
    )


@pytest.mark.parametrize("command", ["verify", "predict"])
def test_without_force_there_is_nothing_to_predict(compensate, job, command):
    done = compensate(command, job.program, *[job.program] * (command == "verify"))
    assert done.code == 1
    assert "FRC030" in done.err
    assert "add --force to the command" in done.err


def test_a_program_that_never_cuts_with_a_force(compensate, job):
    done = compensate("verify", job.program, job.program, "--force", "0,0,0@base")
    assert done.code == 3
    assert "VER004" in done.out
    assert "verdict: no motion cuts with a force" in done.out


@pytest.mark.parametrize("words", [["nowhere.src"], []])
def test_a_missing_program(compensate, job, words):
    assert compensate("verify", job.program, *words, "--force").code == (1 if words else 2)


def test_of_a_spline_the_points_alone_are_compared_and_that_is_said(compensate, job):
    points = [line.split(" C_DIS")[0].replace("LIN ", "SPL ") for line in LINES[9:12]]
    job.write([*LINES[:9], "SPLINE", *points, "ENDSPLINE", *LINES[13:]])
    compensate(job.program, "--force")
    said = compensate("verify", job.program, job.output, "--force")
    assert "along the whole path" not in said.out
    assert "points of splines or drilled holes are compared alone" in said.out
