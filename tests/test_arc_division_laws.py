"""Laws of arcs that are divided between exact points: their inserted points are rounded off by the controller."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import MM, spring

from postproc.compensation.correct import correct
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.toolpath import Arcs, EditConstraints, Kind, Role

FREE = Limits(max_growth=1000.0, ramp_end=0.1 * MM, min_segment=0.1 * MM)


def circle(radius, stated, approximation=(0.0, 0.0, 0.0, 0.0, 0.0), exact_stays=False):
    """All of a circle of ``radius`` [mm] after two lines; points that are inserted are rounded off from ``stated`` [mm]
    on."""
    points = (
        np.array([[radius, -60, 0], [radius, -40, 0], [radius, 0, 0], [radius, 0, 0], [radius, 50, 0]]) * MM
    )
    none = np.full(3, np.nan)
    force = np.tile([100.0, 0.0, 0.0], (5, 1))
    job = spring(
        points,
        [False, True, True, True, True],
        np.eye(3) * 1e-6,
        force,
        kind=[Kind.PTP, Kind.LIN, Kind.LIN, Kind.CIRC, Kind.LIN],
        approximation=np.array(approximation) * MM,
        arcs=Arcs(
            centre=np.array([none, none, none, [1.6, 0.0, 0.5], none]),
            normal=np.array([none, none, none, [0.0, 0.0, 1.0], none]),
            sweep=np.array([np.nan, np.nan, np.nan, 2 * np.pi, np.nan]),
        ),
    )
    constraints = EditConstraints(inserted_approximation=np.full(5, stated * MM), exact_stays=exact_stays)
    return replace(job, toolpath=replace(job.toolpath, constraints=constraints))


def pieces(job):
    division = subdivide(job, correct(job), FREE)
    inserted = division.role == Role.INTERMEDIATE
    assert (division.source[inserted] == 3).all()
    steps = np.diff(np.concatenate([[0.0], division.share[division.source == 3]]))
    np.testing.assert_allclose(steps, steps[0], rtol=1e-6)
    return int(inserted.sum()) + 1


@pytest.mark.parametrize("radius", [20.0, 60.0])
def test_a_circle_gets_so_many_points_that_their_parabolas_keep_the_tolerance(radius):
    """From half of a piece on, s / 2, they pass (s / 2)^2 / 8 r inside of it; no more points than that asks for."""
    count = pieces(circle(radius, 1000.0))
    off = [(np.pi * radius * MM / n) ** 2 / (8 * radius * MM) for n in (count - 1, count)]
    assert off[1] <= 0.7 * 2e-5 < off[0]  # the digits of the program take a part of the tolerance as well
    # twice the radius asks for the square root of two more
    assert pieces(circle(2 * radius, 1000.0)) == pytest.approx(np.sqrt(2) * count, abs=1.5)


def test_a_short_distance_or_exact_points_ask_for_none():
    """From 1 mm on they pass 1 / (8 x 60) mm inside: a tenth of the tolerance."""
    least = pieces(circle(60.0, 0.0))
    assert least < 6
    assert pieces(circle(60.0, 1.0)) == least
    assert pieces(circle(60.0, np.nan)) == least
    assert pieces(circle(60.0, 1000.0, exact_stays=True)) == least
    # at 3.2 mm they pass 21 um inside: only shorter pieces bring that down
    assert pieces(circle(60.0, 3.2)) > least


@pytest.mark.parametrize(
    ("approximation", "counts"),
    [
        ((0.0, 0.0, 0.0, 0.0, 0.0), True),
        ((0.0, 2.0, 0.0, 0.0, 0.0), True),
        ((0.0, 0.0, 0.0, 0.0, 2.0), True),
        ((0.0, 0.0, 2.0, 0.0, 0.0), False),
        ((0.0, 0.0, 0.0, 2.0, 0.0), False),
    ],
)
def test_only_between_exact_points_is_it_asked_for(approximation, counts):
    """Short pieces beside a corner that is rounded off itself would change that corner."""
    least = pieces(circle(60.0, 0.0))
    found = pieces(circle(60.0, 1000.0, approximation))
    assert found > 2 * least if counts else found == least
