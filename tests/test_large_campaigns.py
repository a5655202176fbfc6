"""Thousands of readings: what a search looks at, and what all of them are used for."""

from dataclasses import replace

import numpy as np
import pytest
from measured import plan, robot
from scipy.optimize import lsq_linear
from test_diagnosis import campaign_of, stated

from postproc.diagnosis.diagnosis import diagnose
from postproc.diagnosis.sample import MANY, SEARCHED, sample_of
from postproc.identification.bounded import bounded_least_squares
from postproc.identification.campaign import Campaign
from postproc.model import approach


@pytest.mark.parametrize("seed", range(40))
def test_least_squares_between_bounds_are_those_of_scipy(seed):
    rng = np.random.default_rng(seed)
    columns = int(rng.integers(1, 20))
    matrix = rng.normal(size=(columns + seed % 7, columns)) * 10 ** rng.uniform(-2, 2, columns)
    target = rng.normal(size=len(matrix))
    low, high = -rng.exponential(0.3, columns), rng.exponential(0.3, columns)
    low[rng.random(columns) < 0.2] = 0.0
    here = bounded_least_squares(matrix, target, low, high)
    there = lsq_linear(matrix, target, (low, high), "bvls", tol=1e-14).x
    assert ((here >= low) & (here <= high)).all()
    squares = [float(((matrix @ x - target) ** 2).sum()) for x in (here, there)]
    assert squares[0] <= squares[1] * (1 + 1e-9)


def readings(poses, of_each, sessions, seed=0):
    rng = np.random.default_rng(seed)
    arm = robot("kuka_kr270")
    q = np.repeat(rng.uniform(*arm.limits.T, (poses, 6)), of_each, axis=0)
    planned = plan(arm, q, deflection=False)
    part = np.repeat(np.minimum(np.arange(poses) // (poses // 2), len(sessions) - 1), of_each)
    part[: 5 * of_each] = len(sessions) - 1  # the last one is small
    return replace(planned, sessions=sessions, session=part)


def test_a_small_campaign_is_looked_at_whole():
    campaign = Campaign(readings(100, 6, ("",)))
    assert sample_of(campaign) is campaign


@pytest.mark.parametrize(("poses", "of_each"), [(5000, 1), (700, 6), (20, 400)])
def test_of_a_large_one_whole_poses_of_all_sessions(poses, of_each):
    campaign = Campaign(readings(poses, of_each, ("S1", "S2", "S3")))
    assert len(campaign) > MANY
    part = sample_of(campaign).readings
    assert 0.6 * SEARCHED < len(part) <= 1.2 * SEARCHED
    np.testing.assert_array_equal(part.q[0], campaign.readings.q[0])
    assert set(part.session) == {0, 1, 2}
    counts = np.unique(part.q, axis=0, return_counts=True)[1]
    assert counts.min() >= min(of_each, 12)
    if poses == 20:
        assert len(counts) == 20  # no pose is given up for another's readings
    # rows that are left out change no sense of approach
    whole = {
        tuple(q): tuple(sense)
        for q, sense in zip(campaign.readings.q, approach(campaign.readings.q), strict=True)
    }
    if of_each == 1:
        assert all(whole[tuple(q)] == tuple(sense) for q, sense in zip(part.q, part.direction, strict=True))


@pytest.mark.slow
def test_what_a_search_in_a_part_finds_is_fitted_to_all():
    true = stated()
    (term,) = true.terms
    true = true.with_values({(0, "c2"): 1.6 * term.values["c2"]})
    campaign = campaign_of(true, poses=300, loads=(1200.0, 2600.0, 2000.0))
    assert len(campaign) > MANY
    done = diagnose(campaign, stated())
    assert len(done.search.base.campaign) < 1.2 * SEARCHED
    assert len(done.final.campaign) == len(done.stated.campaign) == len(campaign)
    (all_of,) = [e for e in done.final.estimates if e.unknown.parameter.name == "c2"]
    (part_of,) = [e for e in done.search.final.estimates if e.unknown.parameter.name == "c2"]
    assert abs(all_of.value - 1.6 * term.values["c2"]) < 2 * all_of.ci95
    share = np.sqrt(len(done.search.base.campaign) / len(campaign))
    # no smaller than by all readings; what the fit leaves out is in it too
    assert 0.8 * share * part_of.ci95 < all_of.ci95 < 0.005 * all_of.value
