"""``verify``: what the tool does along the written ways, and which motions belong together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import LINES
from ways_at_work import circle, corner, line

from postproc.compensation.correct import correct
from postproc.compensation.division import Limits, divide
from postproc.geometry import Poses
from postproc.toolpath import Kind, Toolpath
from postproc.units import MM
from postproc.verification import Different, _alignment, matched, simulate, worst_places
from postproc.workflows.preparation import Request, prepare
from postproc.writing import planned


def prepared(path):
    return prepare(Request(program=path, force="")).task


def as_run(task, limits=None, gain=1.0):
    """The task of the program that a correction makes of ``task``, without going through a text."""
    task = replace(task, gain=gain)
    division = divide(task, correct(task), limits or Limits(max_growth=100.0))
    plan, old = planned(task, division), task.toolpath
    kind = np.where(division.links, Kind.LIN, old.kind[plan.source])
    path = Toolpath(
        kind=kind,
        position=plan.position[:],
        rotation=plan.rotation[:],
        axes=old.axes[plan.source],
        feed=old.feed[plan.source],
        base=old.base[plan.source],
        tool=old.tool[plan.source],
        status=old.status[plan.source],
        turn=old.turn[plan.source],
        line=np.arange(len(plan)) + 100,
        frames=old.frames,
        centre=plan.centre,
        normal=plan.normal,
        sweep=plan.sweep,
    )
    base, tool = task.base[plan.source], task.tool[plan.source]
    track = replace(task.track, q=task.track.q[plan.source], status=task.track.status[plan.source])
    run = replace(task, toolpath=path, wanted=base @ path.target_in_base, base=base, tool=tool, track=track)
    return run, division


@pytest.mark.parametrize("build", [line, circle, corner])
def test_a_correction_holds_on_another_way_of_looking(build):
    task = build()
    run, division = as_run(task)
    match = matched(task, run)
    np.testing.assert_array_equal(match, np.flatnonzero(division.own))
    before = simulate(task, task, np.arange(len(task.toolpath)))
    after = simulate(task, run, match)
    assert before.distance.max() > 1 * MM
    assert after.distance[~after.link].max() <= task.tolerance
    assert after.links == division.links.sum()
    ends = after.distance[after.first | after.last]
    assert len(ends) == 2
    assert ends.max() <= task.tolerance


def test_a_narrow_view_matches_the_same(monkeypatch):
    task = circle(diameter=1.2, tolerance=1e-6)
    run, division = as_run(task, Limits(max_growth=1000.0, min_segment=1e-3))
    whole = matched(task, run)
    np.testing.assert_array_equal(whole, np.flatnonzero(division.own))
    rows = np.arange(1000)
    more = 40
    place = np.cumsum(np.tile([1e-3, 0, 0], (1000, 1)), axis=0)
    extra = np.sort(np.random.default_rng(2).choice(999, more, replace=False))
    longer = np.insert(place, extra, place[extra] + [0, 2e-3, 0], axis=0)
    one, other = (replace(task, wanted=Poses.from_abc(at, np.zeros_like(at))) for at in (place, longer))
    monkeypatch.setattr("postproc.verification.STATES", 0)
    monkeypatch.setattr("postproc.verification.LEAST_WIDTH", 8)
    found = _alignment(one, place, other, rows, 0, more)
    np.testing.assert_array_equal(longer[found], place)


def test_without_points_of_its_own_the_middle_is_seen():
    task = line()
    run, _ = as_run(task, Limits(min_segment=10.0, max_growth=100.0))
    after = simulate(task, run, matched(task, run))
    assert 0.05 * MM < after.distance[~after.link].max() < 0.2 * MM


def test_half_a_correction_leaves_half_the_error():
    task = corner()
    before = simulate(task, task, np.arange(len(task.toolpath)))
    run, _ = as_run(task, gain=0.5)
    after = simulate(task, run, matched(task, run))
    assert after.distance[~after.link].max() == pytest.approx(before.distance.max() / 2, rel=0.02)


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
    found = simulate(task, run, matched(task, run))
    assert found.distance.max() == pytest.approx(0.3 * MM, rel=1e-3)
    (at, error, axis, _), *_ = worst_places(found, run.toolpath)
    assert (at, axis) == (11, "Y") or (at, axis) == (10, "Y")
    assert error == pytest.approx(0.3 * MM, rel=1e-3)


def test_points_on_the_way_change_nothing(job):
    source = job.write(LINES)
    more = list(LINES)
    at = more.index("LIN {X 200.000,Y 0.000,Z -2.000,A 0.000,B 0.000,C 180.000} C_DIS ; slot")
    for x in (180, 160, 140, 120):
        more.insert(at, f"LIN {{X {x}.000,Y 0.000,Z -2.000,A 0.000,B 0.000,C 180.000}} C_DIS")
    other = job.write(more, name="more.src")
    task, run = prepared(source), prepared(other)
    one = simulate(task, task, np.arange(len(task.toolpath)))
    two = simulate(task, run, matched(task, run))
    assert two.distance.max() == pytest.approx(one.distance.max(), rel=1e-3)
    assert not two.link.any()


@pytest.mark.parametrize("lost", [4, 9, 14, 18])
def test_a_program_that_lacks_a_motion_is_another_one(job, lost):
    source = job.write(LINES)
    other = job.write([*LINES[:lost], *LINES[lost + 1 :]], name="other.src")
    task, run = prepared(source), prepared(other)
    with pytest.raises(Different):
        matched(task, run)


def test_the_command(compensate, job):
    assert compensate(job.program, "--force", "-q").code == 0
    done = compensate("verify", job.program, job.output, "--force", "--json", "-")
    assert done.code == 0
    assert done.json["original"]["max"] > 1
    assert done.json["compensated"]["max"] <= 0.02
    assert done.json["compensated"]["cut_ends"]["max"] <= 0.05
    assert done.json["compensated"]["links"]["count"] == 2
    assert done.json["samples"] > 500
    assert len(done.json["compensated"]["worst"]) <= 10
    said = compensate("verify", job.program, job.output, "--force")
    assert "compensated" in said.out
    assert "worst places" in said.out


def test_the_original_itself_is_above_tolerance_and_has_no_mark(compensate, job):
    done = compensate("verify", job.program, job.program, "--force", "--json", "-")
    assert done.code == 3
    assert {finding["code"] for finding in done.json["findings"]} >= {"VER002", "VER003"}
    assert done.json["original"] == done.json["compensated"]


def test_without_force_there_is_nothing_to_look_at(compensate, job):
    done = compensate("verify", job.program, job.program)
    assert done.code == 3
    assert "VER004" in done.out


@pytest.mark.parametrize("words", [["nowhere.src"], []])
def test_a_missing_program(compensate, job, words):
    assert compensate("verify", job.program, *words, "--force").code == (1 if words else 2)
