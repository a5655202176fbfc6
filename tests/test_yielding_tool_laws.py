"""Errors inside of motions of a tool that yields in proportion to the force: closed forms for tools that are early."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import MM, output, spring, with_ramp

from postproc.base.geometry import Poses, product, rotation_from_vector
from postproc.compensation.path_error import PathSegments, path_errors, path_errors_at, programmed
from postproc.compensation.rounded_path import RoundedOutput

LINE = np.array([[-160, 0, 0], [-150, 0, 0], [-50, 0, 0], [50, 0, 0]]) * MM
CARRIES = [False, True, True, True]


def turning(turns, compliance, force, **words):
    """A line on which the tool turns by ``turns`` (N,) [rad] about y up to the end of each motion."""
    job = spring(LINE, CARRIES, compliance, np.broadcast_to(force, (4, 3)), **words)
    turn = rotation_from_vector(np.outer(turns, [0.0, 1.0, 0.0]))
    rotation = product(turn, job.wanted.rotation)
    path = job.toolpath.with_columns(rotation=rotation)
    return replace(job, wanted=Poses(rotation, job.wanted.position), toolpath=path)


@pytest.mark.parametrize("early", [-0.4, 0.3])
@pytest.mark.parametrize("rate", [0.05, 2.0])
def test_a_tool_that_is_early_is_turned_as_it_is_wanted_earlier(early, rate):
    """By ``early`` mm on a motion of 100 mm that turns by ``rate``: there it should be turned by as much more."""
    compliance = np.zeros((3, 3))
    compliance[0, 0] = 1e-6
    job = turning(np.array([0.0, 0.0, 0.0, rate]), compliance, [1e3 * early, 0, 0], approximation=np.zeros(4))
    rows = np.array([3])
    assert job.desired_path.angle[3] == pytest.approx(rate, rel=1e-6)
    off, angle = path_errors(job, programmed(job, rows))
    assert off[0] < 1e-9
    assert angle[0] == pytest.approx(rate * abs(early) / 100, rel=1e-4)
    # beside the ends of the motion it is no farther on than they are
    start, end = job.desired_path.at(rows, np.zeros(1)), job.desired_path.at(rows, np.array([1e-3]))
    piece = PathSegments.straight(rows, np.zeros(1), np.array([1e-3]), start, end)
    here = path_errors_at(job, piece, np.array([5e-4]))[1][0]
    before = 0.05 if early < 0 else early  # 0.05 mm from the start on
    assert here == pytest.approx(rate * min(abs(early), before) / 100, rel=1e-3)
    # the rounded path, too, is compared with what is wanted at the place where the tool is
    division = output(job, np.zeros((4, 3)))
    division = replace(division, command=Poses(job.wanted.rotation, division.command.position))
    out = RoundedOutput(job, division, rows)
    found = out.deviations(out.place(rows), np.array([0.5]))
    assert np.linalg.norm(found.turn[0]) == pytest.approx(rate * abs(early) / 100, rel=1e-3)
    assert found.share[0] == pytest.approx(0.5 + early / 100, abs=1e-6)


@pytest.mark.parametrize("programmed_turns", [True, False])
@pytest.mark.parametrize("shown", [True, False])
def test_what_no_word_can_turn_is_shown_alone(programmed_turns, shown):
    """Sent 0.2 rad beside the wanted orientation: where none is programmed, further points take nothing of it away."""
    job = turning(np.zeros(4), None, [0, 0, 0])
    constraints = replace(job.toolpath.constraints, orientation_programmed=np.full(4, programmed_turns))
    job = replace(job, toolpath=replace(job.toolpath, constraints=constraints))
    rows = np.array([3])
    piece = programmed(job, rows)
    turn = rotation_from_vector(np.array([[0.0, 0.2, 0.0]]))
    piece = replace(piece, start=Poses(product(turn, piece.start.rotation), piece.start.position),
                    end=Poses(product(turn, piece.end.rotation), piece.end.position))  # fmt: skip
    _, angle = path_errors(job, piece, shown=shown)
    assert angle[0] == pytest.approx(0.2 if programmed_turns or shown else 0.0, abs=1e-9)
    if not shown:
        assert path_errors(job, piece)[1][0] == angle[0]


@pytest.mark.parametrize("free", [True, False])
def test_a_turn_about_a_free_axis_shows_nowhere(free):
    job = turning(np.zeros(4), None, [0, 0, 0])
    axis = np.tile([0.0, 0.0, 1.0] if free else [np.nan] * 3, (4, 1))
    control = replace(job.toolpath.orientation_control, redundant_axis=axis)
    job = replace(job, toolpath=replace(job.toolpath, orientation_control=control))
    piece = programmed(job, np.array([3]))
    turn = rotation_from_vector(np.array([[0.0, 0.1, 0.2]]))
    piece = replace(piece, start=Poses(product(turn, piece.start.rotation), piece.start.position),
                    end=Poses(product(turn, piece.end.rotation), piece.end.position))  # fmt: skip
    expected = 0.1 if free else np.hypot(0.1, 0.2)
    for shown in (True, False):
        assert path_errors(job, piece, shown=shown)[1][0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("unknown", [True, False])
@pytest.mark.parametrize("along", [-6e-5, 4e-5])
def test_on_a_ramp_the_force_is_that_of_the_place_where_the_tool_is(unknown, along):
    """Sent to the wanted places, it is at s = x + a f(s) where the distance of approximation is not known; else the
    rounded path is evaluated as a whole, and here the force is that of x.  Off the ramp both are the same."""
    across, step, ramp = 1e-6, 90.0, 20 * MM
    compliance = np.zeros((3, 3))
    compliance[0, 0], compliance[1, 0] = along, across
    force = np.zeros((4, 3))
    force[3, 0] = step
    job = spring(LINE, CARRIES, compliance, force, approximation=np.full(4, np.nan if unknown else 0.0))
    job = with_ramp(job, [3], [[step, 0, 0]], [ramp])
    rows, share = np.full(6, 3), np.array([0.03, 0.07, 0.12, 0.17, 0.5, 0.99])
    whole = programmed(job, rows)
    off, _ = path_errors_at(job, whole, share)
    x = share * 0.1
    s = x / (1.0 - along * step / ramp) if unknown else x
    s = np.where(s > ramp, x + along * step if unknown else x, s)
    np.testing.assert_allclose(off, across * step * np.clip(s / ramp, 0.0, 1.0), rtol=1e-6)
    # of motions on ramps seven places are looked at, of others three
    largest, _ = path_errors(job, whole[np.array([0])])
    assert largest[0] == pytest.approx(across * step, rel=1e-6)
    before, _ = path_errors(job, programmed(job, np.array([2])))
    assert before[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("place", [0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875])
def test_an_error_on_a_ramp_is_seen_in_eighths_of_a_motion(place):
    """The tip of a triangle, where a ramp ends under a motion that is corrected at both ends."""
    across, step = 2e-6, 60.0
    compliance = np.zeros((3, 3))
    compliance[1, 0] = across
    force = np.zeros((4, 3))
    force[3, 0] = step
    job = spring(LINE, CARRIES, compliance, force, approximation=np.zeros(4))
    job = with_ramp(job, [3], [[step, 0, 0]], [place * 100 * MM])
    piece = programmed(job, np.array([3]))
    piece.end.position[0, 1] -= across * step
    off, _ = path_errors(job, piece)
    assert off[0] == pytest.approx(across * step * (1.0 - place), rel=1e-6)
    # of what is meant to stay nothing counts
    still, _ = path_errors(job, programmed(job, np.array([3])), uncorrected_share=1.0)
    assert still[0] == pytest.approx(0.0, abs=1e-12)
