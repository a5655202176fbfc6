"""By how much the displacement on a spline may be another than the one that is corrected."""

from __future__ import annotations

import numpy as np
import pytest
from spring_cases import MM, corrected, spring, with_ramp

from postproc.compensation.splines import unknown_displacements
from postproc.toolpath import Kind


@pytest.mark.parametrize("seed", range(8))
def test_a_point_of_a_spline_is_unknown_by_what_its_chord_bends_and_no_other_point_is(seed):
    """Half of what the force changes along the chord, all of it where a spline starts or ends; only what is cut."""
    chance = np.random.default_rng(seed)
    n = 9
    points = np.cumsum(chance.uniform(10.0, 30.0, (n, 3)), axis=0) * MM
    kind = np.array([Kind.PTP, Kind.LIN, *chance.choice([Kind.SPL, Kind.SPL, Kind.LIN], n - 2)])
    carries = np.append([False, False], chance.random(n - 2) < 0.8)
    force = carries[:, None] * chance.uniform(-300.0, 300.0, (n, 3))
    compliance = np.diag(chance.uniform(1e-6, 3e-6, 3))
    job = spring(points, carries, compliance, force, kind=kind)
    starts = np.flatnonzero(carries[1:] & carries[:-1]) + 1
    job = with_ramp(job, starts, force[starts] - force[starts - 1], np.full(len(starts), 5.0 * MM))
    result = corrected(job, np.zeros((n, 3)))
    rows, size = unknown_displacements(job, result)
    spline = [row for row in range(n) if kind[row] == Kind.SPL and carries[row] and result.corrected[row]]
    assert rows.tolist() == spline
    for row, found in zip(spline, size, strict=True):
        ends = [job.force.along(np.array([row]), np.array([share]))[0, :3] for share in (0.0, 1.0)]
        bend = np.linalg.norm(compliance @ (ends[1] - ends[0]))
        inside = row - 1 in spline and row + 1 in spline
        assert found == pytest.approx((0.5 if inside else 1.0) * bend, abs=1e-12)
