"""A small fixed part of ``python -m tests.campaign``: parameters from a plant that is not the model, and what they are
worth there."""

from functools import cache

import numpy as np
import pytest
from campaign import compensated, rig
from campaign.identified import Trial, fitted, found
from scipy.stats import binomtest

from postproc.identification.campaign import Campaign
from postproc.robot.description import COVERAGE

CAMPAIGNS, SEED = 40, 1

TRUE, TABLE = (np.array(list(of.values())) for of in (rig.values_of(rig.truth()), rig.TABLE_1))


@cache
def trial(poses=15, loads=rig.WEIGHT):
    return Trial("", (rig.read_off(rig.planned(rig.truth(), poses, loads), loads),))


@cache
def many():
    return found(trial(), CAMPAIGNS, SEED)


def ratios(done):
    """(7,) of the intervals of a fit to those of Table 1, infinite where one was left out."""
    wide = {estimate.unknown.parameter.name: estimate.ci95 for estimate in done.estimates}
    return np.array([wide.get(name, np.inf) for name in rig.TABLE_1]) / (TRUE * TABLE / 100)


@pytest.mark.slow
def test_plant_and_model_agree():
    """Else the campaign would be one of model errors."""
    readings = trial().readings[0]
    campaign = Campaign(readings)
    expected, _ = campaign.expected(campaign.predicted(rig.truth()), campaign.start())
    assert np.abs(expected - readings.value).max() < 1e-12
    assert np.median(np.linalg.norm(readings.value, axis=1)) > 3e-3


@pytest.mark.slow
def test_fits_begin_with_wrong_values():
    begun = rig.values_of(compensated.begun_with(trial(), SEED, 0))
    factor = np.array(list(begun.values())) / TRUE
    assert ((factor > 0.7) & (factor < 1.4)).all()
    assert np.abs(factor - 1).max() > 0.2


@pytest.mark.slow
def test_every_parameter_is_found():
    done = many()
    assert np.isfinite(done.value).all()
    error = done.value.std(axis=0, ddof=1) / np.sqrt(CAMPAIGNS)
    assert (np.abs(done.value.mean(axis=0) - TRUE) < 3.5 * error).all()


@pytest.mark.slow
def test_intervals_hold_the_truth():
    done = many()
    inside, count = int(done.covers.sum()), done.covers.size
    assert binomtest(inside, count, 0.95).pvalue > 0.01
    # and each is as wide as the found values scatter: chi with 39 degrees of freedom
    ratio = done.value.std(axis=0, ddof=1) / (done.ci95.mean(axis=0) / COVERAGE)
    assert ((ratio > 0.7) & (ratio < 1.35)).all()
    assert 0.7 < np.sqrt(np.mean(ratio**2)) < 1.2


def test_intervals_beat_table_1():
    assert (np.median(many().ci95, axis=0) / TRUE <= 0.8 * TABLE / 100).all()


@pytest.mark.slow
@pytest.mark.parametrize(("poses", "loads"), [(30, rig.WEIGHT), (15, rig.TWO_WEIGHTS)])
def test_twice_the_readings(poses, loads):
    worst = ratios(fitted(trial(poses, loads), SEED, 0)).max()
    assert worst <= 0.55
    # neither is a miracle
    assert worst > 0.8 * ratios(fitted(trial(), SEED, 0)).max() / np.sqrt(2)


@pytest.mark.slow
def test_random_designs_do_not():
    rng = np.random.default_rng(15)
    designs = [Trial("", (rig.read_off(rig.at_random(15, rng)),)) for _ in range(7)]
    worst = [ratios(fitted(design, SEED, 0)).max() for design in designs]
    assert min(worst) > 1.0
    assert np.median(worst) > 2.0


@pytest.mark.slow
@pytest.mark.parametrize("past_first_axis", [True, False])
def test_compensation_with_the_identified_file(tmp_path, past_first_axis):
    """On the way of the command, by files; forces past A1 because its compliance was not looked for."""
    plant = rig.plant()
    cut = compensated.cuts(40, SEED, past_first_axis)
    begun = compensated.errors(plant, cut.q, cut)
    assert np.median(begun) > 5e-4
    for campaign in range(2 if past_first_axis else 1):
        model = compensated.by_files(trial(), SEED, campaign, tmp_path)
        assert compensated.share(plant, model, cut, begun) >= 0.985
        if past_first_axis:
            bare = compensated.joints_only(trial(), SEED, campaign)
            assert 0.93 < compensated.share(plant, bare, cut, begun) < 0.97
            assert (
                compensated.share(plant, compensated.begun_with(trial(), SEED, campaign), cut, begun) < 0.98
            )
