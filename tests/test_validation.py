"""Held-out readings, other campaigns and the bootstrap: what a fit is worth where it did not look."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from effect_cases import TOOL, random_arm
from measured import Straight, arm, on_markers, plan, read, robot, scattered, somewhere, taken

from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.unknowns import Unknown, asked_for
from postproc.identification.validation import bootstrap, counted, folds_of, held_out, validated
from postproc.model import StiffnessModel

SIGMA = 3e-5
"""[m]"""


class Case(NamedTuple):
    """A campaign with scatter, and the model and unknowns to fit."""

    campaign: Campaign
    model: StiffnessModel
    unknowns: tuple[Unknown, ...]


def measured(poses, rng, deflection=True, straight=False):
    """Readings of a bending arm, three targets a pose; of absolute places two of them where nothing is stated."""
    described = arm(random_arm(rng, "rrr"))
    asked = asked_for(StiffnessModel(described, ()), ["joint_compliance"])
    truth = asked.model.with_values({u.key: 5.0 * u.parameter.scale for u in asked.unknowns})
    wrench = rng.normal(size=(poses, 6)) * np.array([1000.0] * 3 + [600.0] * 3)
    q, wrench, words = on_markers(rng.uniform(-2.0, 2.0, (poses, 3)), wrench)
    if not deflection:
        words["places"] = {"M1": words["places"]["M1"]}
    readings = plan(described, q, wrench, deflection, sigma=SIGMA, tool=TOOL, **words)
    campaign = Straight(readings, asked.model, asked.unknowns) if straight else Campaign(readings)
    campaign.readings = scattered(taken(campaign, truth, somewhere(campaign, rng)), SIGMA, rng)
    return Case(campaign, asked.model, asked.unknowns)


@cache
def absolute():
    case = measured(20, np.random.default_rng(1), deflection=False)
    return case, fit(*case)


def test_folds_hold_whole_poses():
    campaign = measured(17, np.random.default_rng(2)).campaign
    fold = folds_of(campaign, 5)
    assert set(fold) == set(range(5))
    for pose in range(campaign.poses):
        assert len(set(fold[campaign.pose == pose])) == 1
    sizes = np.bincount(fold)
    assert sizes.max() - sizes.min() <= 3
    np.testing.assert_array_equal(fold, folds_of(campaign, 5))


def test_a_held_out_residual_is_that_of_a_fit_from_scratch_without_its_fold():
    case, found = absolute()
    fold, left = folds_of(case.campaign, 4), held_out(found, 4)
    for k in range(4):
        alone = fit(*case, rows=fold != k)
        np.testing.assert_allclose(left[fold == k], alone.residual[fold == k], atol=2e-3 * SIGMA)
    assert np.isfinite(left).all()


def test_a_held_out_residual_is_larger_than_a_fitted_one():
    """By as much as least squares say: (1 - H)^-1 of it, H the part of the projection within a pose."""
    case, found = absolute()
    campaign, poses = case.campaign, case.campaign.poses
    left = held_out(found, poses)
    matrix = np.concatenate([found.weights(part) for part in found.point.required_columns], axis=1)
    q = np.linalg.svd(matrix / np.linalg.norm(matrix, axis=0), full_matrices=False)[0]
    for pose in range(poses):
        own = campaign.pose == pose
        part = q[np.repeat(own, 3)]
        expected = np.linalg.solve(np.eye(len(part)) - part @ part.T, found.point.residual[own].reshape(-1))
        # the frame that the residual is turned back by is another one by next to nothing
        expected = campaign.in_base(_placed(expected, own), found.point.nuisances)
        np.testing.assert_allclose(left[own], expected[own], atol=2e-3 * SIGMA)
    assert np.sum(left**2) > 1.05 * np.sum(found.residual**2)


def _placed(values, rows):
    """(R, 3), ``values`` in ``rows``."""
    whole = np.zeros((len(rows), 3))
    whole[rows] = values.reshape(-1, 3)
    return whole


def test_what_is_held_out_is_not_used():
    """Other readings in a fold, and the prediction for it stays."""
    case, found = absolute()
    fold, before = folds_of(case.campaign, 4), held_out(found, 4)
    by = np.where(
        (fold == 1)[:, None], 10 * SIGMA * np.random.default_rng(3).normal(size=(len(fold), 3)), 0.0
    )
    moved = case.campaign.shifted(by)
    after = held_out(fit(moved, *case[1:]), 4)
    # the residuals of absolute readings stand in axes of the base, those of the tracker's frame turned
    back = found.point.nuisances.frames.rotation[0].T
    np.testing.assert_allclose(after[fold == 1], (before + by @ back.T)[fold == 1], atol=0.02 * SIGMA)
    assert np.abs(after - before)[fold != 1].max() > 0.2 * SIGMA


def test_what_does_not_count_is_not_held_out_either():
    case, _ = absolute()
    rows = np.arange(len(case.campaign)) % 7 != 0
    value = case.campaign.readings.value.copy()
    value[1, 2] = np.nan
    partly = case.campaign.shifted(np.zeros((len(rows), 3)))
    partly.readings = replace(case.campaign.readings, value=value)
    found = fit(partly, *case[1:], rows=rows)
    rows[1] = False
    np.testing.assert_array_equal(counted(found), rows)
    np.testing.assert_array_equal(np.isfinite(held_out(found, 4)).all(axis=1), rows)


def test_a_model_that_explains_more_is_better_where_it_was_not_fitted():
    case, found = absolute()
    before = fit(case.campaign, case.model, ())
    rms = [np.sqrt(np.mean(held_out(one, 5) ** 2)) for one in (before, found)]
    assert rms[1] == pytest.approx(SIGMA, rel=0.2)
    assert rms[0] > 5.0 * rms[1]


def test_a_fit_of_scatter_gains_nothing_where_it_was_not_fitted():
    rng = np.random.default_rng(4)
    described = robot("ur5")
    asked = asked_for(StiffnessModel(described, ()), ["link_geometry", "joint_offset"])
    readings = plan(described, rng.uniform(-3, 3, (14, 6)), None, False, True, tool=TOOL)
    campaign = Campaign(scattered(read(asked.model, readings), SIGMA, rng))
    before, after = fit(campaign, asked.model, ()), fit(campaign, asked.model, asked.unknowns)
    rms = [[np.sqrt(np.mean(r**2)) for r in (f.residual, held_out(f, 7))] for f in (before, after)]
    assert rms[0][0] == pytest.approx(rms[0][1])
    assert rms[1][0] < 0.9 * rms[0][0]
    assert rms[1][1] > 1.1 * rms[0][1]


# Other campaigns


def again(case, rng, given, **changes):
    """The campaign's robot, targets and truth at other poses, seen from ``given``."""
    old = case.campaign.readings
    truth = case.model.with_values({u.key: 5.0 * u.parameter.scale for u in case.unknowns})
    q, wrench, _ = on_markers(rng.uniform(-2.0, 2.0, (8, 3)), 900.0 * rng.normal(size=(8, 6)))
    readings = replace(old.part(slice(0, 24)), q=q, wrench=wrench, **changes)
    campaign = Campaign(readings)
    campaign.readings = scattered(taken(campaign, truth, given), SIGMA, rng)
    return campaign


@pytest.fixture
def fits():
    case, found = absolute()
    return case, fit(case.campaign, case.model, ()), found


def rms(residual):
    return float(np.sqrt(np.mean(residual**2)))


def test_other_readings_of_the_same_station_are_judged_from_it(fits):
    case, before, after = fits
    result = validated(before, after, again(case, np.random.default_rng(5), after.point.nuisances))
    assert not result.registered_anew
    assert rms(result.after) == pytest.approx(SIGMA, rel=0.25)
    assert rms(result.before) > 5.0 * SIGMA


def test_a_station_that_moved_is_registered_anew(fits):
    case, before, after = fits
    rng = np.random.default_rng(6)
    given = replace(after.point.nuisances, frames=somewhere(case.campaign, rng).frames)
    result = validated(before, after, again(case, rng, given))
    assert result.registered_anew
    # six of 72 numbers are fitted
    assert rms(result.after) == pytest.approx(SIGMA * np.sqrt(66 / 72), rel=0.25)
    assert rms(result.before) > 5.0 * SIGMA


def test_a_station_of_another_name_is_another_station(fits):
    """Of two sessions the second is new, of whose name the fit knows nothing."""
    case, before, after = fits
    rng = np.random.default_rng(7)
    there = somewhere(case.campaign, rng).frames
    frames = type(there)(
        np.concatenate([after.point.nuisances.frames.rotation, there.rotation]),
        np.concatenate([after.point.nuisances.frames.position, there.position]),
    )
    words = {"session": np.arange(24) // 12, "sessions": ("", "evening")}
    other = again(case, rng, replace(after.point.nuisances, frames=frames), **words)
    result = validated(before, after, other)
    assert result.registered_anew
    assert rms(result.after) == pytest.approx(SIGMA * np.sqrt(66 / 72), rel=0.25)


def test_targets_are_where_the_fit_found_them_by_their_names(fits):
    """In another order, and with one that moved."""
    case, before, after = fits
    rng, given = np.random.default_rng(8), after.point.nuisances
    names = case.campaign.targets
    order = [2, 0, 1]
    words = {"targets": tuple(names[k] for k in order), "target": np.tile([1, 2, 0], 8)}
    turned = replace(given, places=given.places[order], turns=given.turns[order])
    result = validated(before, after, again(case, rng, turned, **words))
    assert rms(result.after) == pytest.approx(SIGMA, rel=0.25)
    away = given.places.copy()
    away[2] += [5e-3, 0.0, 0.0]
    result = validated(before, after, again(case, rng, replace(given, places=away)))
    each = np.sqrt(np.mean(result.after**2, axis=1))
    moved = result.campaign.readings.target == 2
    assert each[moved].mean() > 10 * SIGMA


def test_a_new_target_is_found_from_the_new_readings(fits):
    case, before, after = fits
    rng, given = np.random.default_rng(9), after.point.nuisances
    away = given.places.copy()
    away[2] += [5e-3, -0.1, 0.0]
    words = {"targets": (*case.campaign.targets[:2], "new")}
    result = validated(before, after, again(case, rng, replace(given, places=away), **words))
    assert rms(result.after) < 1.25 * SIGMA


def test_deflections_are_judged_as_they_are():
    rng = np.random.default_rng(10)
    case = measured(15, rng)
    before, after = fit(case.campaign, case.model, ()), fit(*case)
    result = validated(before, after, again(case, rng, case.campaign.start()))
    assert not result.registered_anew
    assert rms(result.after) == pytest.approx(SIGMA, rel=0.25)
    assert rms(result.before) > 5.0 * SIGMA


# Bootstrap


@pytest.mark.slow
def test_on_well_posed_data_the_bootstrap_agrees_with_the_covariance():
    rng = np.random.default_rng(11)
    case = measured(40, rng, straight=True)
    found = fit(*case)
    drawn = bootstrap(found, 300)
    assert drawn.draws == 300
    ratio = drawn.deviation / np.sqrt(np.diag(found.covariance))
    assert (ratio > 0.8).all()
    assert (ratio < 1.25).all()


@pytest.mark.slow
def test_of_few_readings_the_bootstrap_is_not_too_narrow():
    """Half of the numbers go into where tracker and target are; what is left of an error is that much smaller."""
    rng, ratio = np.random.default_rng(15), []
    described = arm(random_arm(rng, "rrr"))
    asked = asked_for(StiffnessModel(described, ()), ["joint_offset.o2"])
    for _ in range(5):
        readings = plan(
            described, rng.uniform(-2, 2, (7, 3)), None, False, targets=("M",), tool=TOOL, sigma=SIGMA
        )
        campaign = Campaign(scattered(read(asked.model, readings, rng), SIGMA, rng))
        found = fit(campaign, asked.model, asked.unknowns)
        assert found.freedom == 21 - 11
        wide = np.sqrt(
            np.diag(found.covariance) * np.sum((found.point.residual / SIGMA) ** 2) / found.freedom
        )
        ratio.append(bootstrap(found, 80).deviation / wide)
    # the scale of the tracker, which is nearly known, counts as an unknown here
    assert 0.75 < np.mean(ratio) < 1.2


@pytest.mark.slow
def test_where_the_readings_that_count_most_scatter_most_the_bootstrap_is_wider():
    """Equal weights say too little of them then: with tails, and a scatter that grows with the lever."""
    rng, ratio = np.random.default_rng(12), []
    case = measured(40, rng, straight=True)
    exact = case.campaign.readings
    truth = case.model.with_values({u.key: 5.0 * u.parameter.scale for u in case.unknowns})
    exact = taken(case.campaign, truth)
    plain = replace(exact, sigma=np.full(len(exact), np.nan))
    lever = np.linalg.norm(exact.value, axis=1)
    for _ in range(6):
        error = rng.standard_t(3, (len(exact), 3)) * SIGMA * (lever / lever.mean())[:, None] ** 2
        case.campaign.readings = plain
        found = fit(case.campaign.shifted(error), *case[1:])
        ratio.append(bootstrap(found, 80).deviation / np.sqrt(np.diag(found.covariance)))
    assert np.mean(ratio) > 1.25


@pytest.mark.slow
def test_readings_that_share_an_error_are_drawn_together():
    rng = np.random.default_rng(13)
    case = measured(30, rng, straight=True)
    shared = np.repeat(4 * SIGMA * rng.normal(size=(30, 3)), 3, axis=0)
    found = fit(case.campaign.shifted(shared), *case[1:])
    assert found.shared_error == pytest.approx(4 * SIGMA, rel=0.3)
    ratio = bootstrap(found, 200).deviation / np.sqrt(np.diag(found.covariance))
    assert (ratio > 0.7).all()
    assert (ratio < 1.35).all()


@pytest.mark.slow
def test_a_prior_is_drawn_too():
    """Of a parameter that the readings hardly see the bootstrap gives the prior's deviation back."""
    rng = np.random.default_rng(14)
    case = measured(15, rng, straight=True)
    unknowns = tuple(
        replace(u, prior=1e-4 * u.parameter.scale, value=5 * u.parameter.scale) for u in case.unknowns
    )
    found = fit(case.campaign, case.model, unknowns)
    drawn = bootstrap(found, 300).deviation / [u.prior for u in unknowns]
    # a deviation of 300 draws is known to 4 %
    np.testing.assert_allclose(drawn, 1.0, atol=0.15)
