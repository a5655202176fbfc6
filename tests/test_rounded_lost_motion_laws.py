"""On which side of its gap an axis lies along an output that is rounded off: walked place by place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import task
from test_lost_motion import GAP, lagging, lossy

from postproc.compensation.correct import correct
from postproc.compensation.gap_sides import GapSides
from postproc.compensation.rounded_path import RoundedOutput, sides_of_output
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.robot.inverse import inverse
from postproc.toolpath import Kind

MM = 1e-3
FREE, FEW = Limits(max_growth=100.0, ramp_end=0.5 * MM), Limits()


def there_and_back(distance, aside=0.05):
    """Under force away from A1's middle and back again, with a corner that is rounded off from ``distance`` [m] on."""
    points = np.array(
        [[1.5, -0.1, 0.55], [1.5, -0.1, 0.5], [1.55, aside, 0.5], [1.6, -0.08, 0.5], [1.6, -0.08, 0.55]]
    )
    kinds = [Kind.PTP, Kind.LIN, Kind.LIN, Kind.LIN, Kind.LIN]
    job = task(points, [False, False, True, True, False], wrench=np.array([50.0, 20.0, 80.0, 0, 0, 0]), kind=kinds,
               approximation=np.array([0.0, 0.0, distance, 0.0, 0.0]))  # fmt: skip
    return lossy(job, axes=(1,))


@pytest.mark.parametrize(("distance", "limits"), [(0.0, FREE), (8 * MM, FREE), (8 * MM, FEW), (30 * MM, FEW)])
def test_the_sides_are_those_of_every_place_of_the_rounded_output_in_turn(distance, limits):
    """However many motions a path is divided into: some have no place where sides were looked for."""
    job = there_and_back(distance)
    division = subdivide(job, correct(job), limits)
    sides = sides_of_output(job, division)
    assert sides is sides_of_output(job, division)  # computed once
    motions = np.flatnonzero(job.carries[division.source])
    out = RoundedOutput(job, division, motions)
    count = max(30, 6000 // len(motions))
    motion, share = np.repeat(motions, count), np.tile(np.arange(1, count + 1) / count, len(motions))
    motion, share = np.append(motions[0], motion), np.append(0.0, share)
    command = out.commands(out.blend(out.place(motion), share))
    row = division.source[motion]
    axes = inverse(
        job.model.robot.nominal, command @ job.tool[row].inverse(), job.track.branch[row], job.track.q[row]
    ).q
    begin = axes[0] - 0.5 * GAP * sides.at(motion[:1], share[:1])[0]
    walked = lagging(axes, GAP, begin)[:, 0]
    found = sides.at(motion, share)[:, 0]
    assert walked.min() < -0.99 < 0.99 < walked.max()
    assert np.abs(found - walked).max() < 0.2  # on parabolas it is known at nine places
    assert np.mean(np.abs(found - walked)) < 0.005


def test_nothing_is_asked_for_without_gaps():
    job = task(np.array([[1.5, 0, 0.5], [1.6, 0, 0.5], [1.7, 0, 0.5]]), [False, True, True],
               approximation=np.full(3, MM))  # fmt: skip
    assert sides_of_output(job, subdivide(job, correct(job), FREE)) is None


def test_a_corner_at_which_no_axis_turns_round_keeps_its_side():
    """On along the same sense of A1: one side all along, rounded or not."""
    points = np.array(
        [[1.5, -0.2, 0.55], [1.5, -0.2, 0.5], [1.55, -0.05, 0.5], [1.56, 0.12, 0.5], [1.56, 0.12, 0.55]]
    )
    kinds = [Kind.PTP, Kind.LIN, Kind.LIN, Kind.LIN, Kind.LIN]
    job = task(points, [False, False, True, True, False], wrench=np.zeros(6), kind=kinds,
               approximation=np.array([0.0, 0.0, 20 * MM, 0.0, 0.0]))  # fmt: skip
    job = lossy(job, axes=(1,))
    division = subdivide(job, correct(job), FREE)
    sides = sides_of_output(job, division)
    motions = np.flatnonzero(job.carries[division.source])
    motion, share = np.repeat(motions[1:], 50), np.tile(np.linspace(0.02, 1.0, 50), len(motions) - 1)
    assert np.ptp(sides.at(motion, share)[:, 0]) < 1e-6
    assert abs(sides.at(motion, share)[0, 0]) == pytest.approx(1.0, abs=1e-6)


def test_of_a_motion_from_an_unknown_place_no_side_is_known():
    """Nor of the motions that it is divided into, but for those where sides were looked for."""
    job = there_and_back(8 * MM)
    division = subdivide(job, correct(job), FREE)
    lost = job.lost_motion
    keep = lost.row != 3
    names = ("row", "share", "axes", "aim", "moved")
    restart = np.where(lost.row == 4, np.append(False, lost.row[1:] != lost.row[:-1]), lost.restart)[keep]
    programmed = GapSides.of(
        (2.0 * lost.row + lost.share)[keep], lost.axes[keep], lost.programmed.gap, restart
    )
    parts = {name: getattr(lost, name)[keep] for name in names}
    unknown = replace(job, lost_motion=replace(lost, programmed=programmed, restart=restart, **parts))
    motions = np.flatnonzero((division.source == 3) & ~division.transitions)
    found = sides_of_output(unknown, replace(division)).at(motions, np.full(len(motions), 0.7))
    assert len(found) == 3
    assert (found[:-1, 0] == 0).all()
    known = np.flatnonzero(division.source == 2)[1:-3]
    one, two = (sides_of_output(j, replace(division)).at(known, np.ones(len(known))) for j in (job, unknown))
    np.testing.assert_allclose(one[:, 0], two[:, 0], atol=1e-6)
    assert (one[:, 0] != 0).all()
