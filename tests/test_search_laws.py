"""What a search may cost, and to what it is handed: how often a place on a ramp is evaluated, and how far the curve of
a ramp between arcs goes on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import AT, MM, corrected, output, spring, with_ramp
from test_ramp_points import END, bent, ramp_along

from postproc.compensation import ramp_fits
from postproc.compensation.path_error import PathSegments, path_errors_at
from postproc.compensation.ramp_fits import CLOSE_STARTS, CloseFits
from postproc.compensation.ramp_points import choose_ramp_points
from postproc.compensation.subdivision import Limits
from postproc.toolpath import Arcs, Kind


@pytest.mark.parametrize("along", [0.0, 2e-5])
def test_a_place_that_the_force_does_not_shift_along_the_path_is_looked_at_once(along, monkeypatch):
    """Only a tool that yields along the path has another force than that of its command: it takes more looks."""
    compliance = np.zeros((3, 3))
    compliance[0, 0], compliance[1, 0] = along, 1e-6
    points = np.array([[-60, 0, 0], [-50, 0, 0], [0, 0, 0], [100, 0, 0]]) * MM
    force = np.zeros((4, 3))
    force[3, 0] = 60.0
    job = spring(points, [False, True, True, True], compliance, force, approximation=np.full(4, np.nan))
    job = with_ramp(job, [3], [[60.0, 0, 0]], [5 * MM])
    rows, share = np.array([3, 3]), np.array([0.021, 0.034])
    start, end = job.desired_path.at(rows, share - 0.01), job.desired_path.at(rows, share + 0.01)
    looks = []
    plain = type(job).simulated

    def counted(self, rows, *words, **more):  # type: ignore[no-untyped-def]
        looks.append(len(rows))
        return plain(self, rows, *words, **more)

    monkeypatch.setattr(type(job), "simulated", counted)
    path_errors_at(job, PathSegments.straight(rows, share - 0.01, share + 0.01, start, end), share)
    assert (len(looks) > 2) == (along > 0)


@pytest.mark.parametrize("seed", range(4))
def test_the_curve_of_a_ramp_between_arcs_goes_on_to_the_next_points_of_the_output(seed, monkeypatch):
    """Along the arcs: back to the end of the line before them, or to a point on the arc, and on to the next point."""
    chance = np.random.default_rng(seed)
    radius = chance.uniform(120.0, 200.0) * MM
    angles = np.concatenate([[0.0, 0.0, 0.0], np.cumsum(chance.uniform(0.7, 1.0, 2))])
    points = radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    points[0] += [20 * MM, 0.0, 20 * MM]
    points[1] += [20 * MM, 0.0, 0.0]
    none = np.full(3, np.nan)
    force = np.zeros((5, 3))
    force[2:4, 0], force[4, 0] = 100.0, 1000.0
    compliance = np.diag([2e-6, 3e-6, 1e-6])
    job = spring(
        points,
        [False, False, True, True, True],
        compliance,
        force,
        kind=[Kind.PTP, Kind.LIN, Kind.LIN, Kind.CIRC, Kind.CIRC],
        approximation=np.full(5, 1.0 * MM),
        arcs=Arcs(
            centre=np.array([none, none, none, AT, AT]),
            normal=np.array([none, none, none, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]),
            sweep=np.append(np.full(3, np.nan), np.diff(angles[2:])),
        ),
    )
    beside = replace(job.toolpath.constraints, inserted_approximation=np.full(5, 1.0 * MM))
    job = replace(job, toolpath=replace(job.toolpath, constraints=beside))
    ramp = chance.uniform(4.0, 6.0) * MM
    job = with_ramp(job, [4], [[900.0, 0.0, 0.0]], [ramp])
    length = job.desired_path.length
    before = [] if seed % 2 else [chance.uniform(0.3, 0.5)]
    after = chance.uniform(0.5, 0.9)

    def shift(row: int, at: float) -> np.ndarray:
        return -compliance @ job.force.along(np.array([row]), np.array([at]))[0, :3]

    places = [(3, at) for at in before] + [(4, ramp / length[4]), (4, after)]
    shifts = np.array([shift(row, 1.0) for row in range(5)])
    division = output(job, shifts, [(row, at, shift(row, at), 0.0) for row, at in places])
    seen = []

    def noted(ramps, curves, count, allowed, names):  # type: ignore[no-untyped-def]
        seen.append((ramps, curves))
        return {}

    class NoFits:
        def curve(self, place, build):  # type: ignore[no-untyped-def]
            return build()

        def fit(self, *words):  # type: ignore[no-untyped-def]
            return None

    monkeypatch.setattr("postproc.compensation.ramp_points.fit_ramps", noted)
    choose_ramp_points(
        job, corrected(job, shifts), division, Limits(max_growth=100.0, ramp_end=0.5 * MM), {}, 10e-6,
        np.empty(0, int), NoFits(),
    )  # type: ignore[arg-type]  # fmt: skip
    ramps, curves = seen[0]
    assert ramps.row.tolist() == [4]
    assert ramps.arc.tolist() == [[True, True]]
    back = (before[0] if before else 0.0) - 1.0
    np.testing.assert_allclose(curves.ends, [[back * length[3], after * length[4]]], rtol=1e-9)


@pytest.mark.parametrize("slope", [0.3, 0.8, 1.2])
@pytest.mark.parametrize("number", range(len(CLOSE_STARTS)))
def test_points_on_the_curve_stay_where_that_is_near_enough(slope, number, monkeypatch):
    """As near to each other as lines may be short, beside both turns, and the vertex among them; each turn is looked at
    once at most."""
    turns = []
    plain = ramp_fits.closest_to_turn

    def noted(*words):  # type: ignore[no-untyped-def]
        turns.append(words[-1])
        return plain(*words)

    monkeypatch.setattr(ramp_fits, "closest_to_turn", noted)
    curve = bent(slope)
    found = CloseFits().fit(ramp_along(curve), curve, number, 1.0)
    assert found is not None
    assert turns in ([], [0, 1])
    x, y = found.place[:, 0], found.place[:, 1]
    np.testing.assert_allclose(y, slope * np.clip(x, 0.0, END), atol=1e-9)
    np.testing.assert_allclose(found.along, x, atol=1e-9)
    assert abs(x[found.own]) < 1e-9
    assert np.abs(x - END).min() < 1e-9
    lines = np.linalg.norm(np.diff(found.place, axis=0), axis=1)
    between = int(np.argmax(lines))  # from the points beside one turn to those beside the other
    assert x[between] < 0.5 * END < x[between + 1]
    short = np.delete(lines, between)
    assert short.min() > 0.6 * MM - 1e-9
    assert short.max() < 0.7 * MM
