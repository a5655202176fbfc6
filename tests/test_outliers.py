"""Outliers: readings that belong to nothing are found and named, and good ones are left alone."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from effect_cases import TOOL, made, random_arm, sampled, with_terms
from measured import Straight, arm, on_markers, plan, scattered, somewhere, taken

from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.outliers import outliers
from postproc.identification.unknowns import Unknown, asked_for
from postproc.model import StiffnessModel

SIGMA = 3e-5
"""[m]"""

POSES, READINGS = 15, 45
EVERY = np.ones(READINGS, bool)


class Case(NamedTuple):
    """An exact campaign, and the model and unknowns to fit."""

    campaign: Campaign
    model: StiffnessModel
    unknowns: tuple[Unknown, ...]


@cache
def exact(kind="deflections", missing=()):
    """Three joints, 15 poses, three targets, or as many ``close`` together; ``missing``: effects of the arm that the
    model does not have."""
    rng = np.random.default_rng(1)
    described = arm(random_arm(rng, "rrr"))
    word = "joint_offset" if kind == "tracker" else "joint_compliance"
    asked = asked_for(StiffnessModel(described, ()), [word])
    size = 3.0 if kind == "tracker" else 20.0
    truth = asked.model.with_values({u.key: size * u.parameter.scale for u in asked.unknowns})
    truth = with_terms(
        truth, *((made(n, described.joints), sampled(made(n, described.joints), rng)) for n in missing)
    )
    wrench = rng.normal(size=(POSES, 6)) * np.array([1000.0] * 3 + [600.0] * 3)
    q, wrench, words = on_markers(rng.uniform(-2.0, 2.0, (POSES, 3)), wrench)
    if kind == "close":
        words["places"] = {name: 0.01 * place for name, place in words["places"].items()}
    readings = plan(described, q, wrench, kind != "tracker", sigma=SIGMA, tool=TOOL, **words)
    stands = {"file": np.zeros(READINGS, int), "line": np.arange(2, READINGS + 2)}
    readings = replace(readings, files=(Path("data.csv"),), **stands)
    campaign = Campaign(readings)
    if kind != "tracker" and not missing:
        campaign = Straight(readings, asked.model, asked.unknowns)
    given = somewhere(campaign, rng)
    campaign.readings = taken(campaign, truth, given)
    return Case(campaign, asked.model, asked.unknowns)


def told(case, readings):
    """What is told of ``readings`` in the campaign's place."""
    campaign = case.campaign.shifted(np.zeros((READINGS, 3)))
    campaign.readings = readings
    return outliers(fit(campaign, case.model, case.unknowns), EVERY)


def spoilt(case, rows, rng):
    """The readings with scatter, and others in ``rows``: row -> value."""
    readings = scattered(case.campaign.readings, SIGMA, rng)
    value = readings.value.copy()
    for row, other in rows.items():
        value[row] = other
    return replace(readings, value=value)


def clearly(case, one, other, rng):
    """A row at random of which ``other`` is far from ``one`` (R, 3)."""
    apart = np.linalg.norm(one - other, axis=1)
    return int(rng.choice(np.flatnonzero(apart > 30 * SIGMA)))


SEEDS = pytest.mark.parametrize("seed", range(3))


@SEEDS
@pytest.mark.parametrize("kind", ["deflections", "tracker"])
def test_a_broken_beam(kind, seed):
    case, rng = exact(kind), np.random.default_rng(seed)
    row, away = int(rng.integers(READINGS)), rng.normal(size=3)
    away *= 0.05 / np.linalg.norm(away)
    found, _ = told(case, spoilt(case, {row: case.campaign.readings.value[row] + away}, rng))
    (outlier,) = found
    assert (outlier.row, outlier.file, outlier.line) == (row, "data.csv", row + 2)
    assert outlier.what.startswith("fits no other value: was the beam interrupted")
    assert outlier.distance == pytest.approx(0.05, rel=0.05)
    assert outlier.sigmas > 500


@SEEDS
@pytest.mark.parametrize("kind", ["deflections", "tracker"])
def test_mistaken_reflectors(kind, seed):
    """Each is told to fit the other."""
    case, rng = exact(kind), np.random.default_rng(seed)
    exactly = case.campaign.readings.value
    pairs = [
        row
        for row in range(READINGS - 1)
        if row % 3 != 2 and np.linalg.norm(exactly[row] - exactly[row + 1]) > 1e-3
    ]
    row = int(rng.choice(pairs))
    found, _ = told(case, spoilt(case, {row: exactly[row + 1], row + 1: exactly[row]}, rng))
    assert {outlier.row for outlier in found} == {row, row + 1}
    one, other = f"M{row % 3 + 1}", f"M{row % 3 + 2}"
    what = {outlier.row: outlier.what for outlier in found}
    assert (
        what[row]
        == f"fits target {other} (line {row + 3}) instead of {one}: are they mistaken for each other?"
    )
    assert (
        what[row + 1]
        == f"fits target {one} (line {row + 2}) instead of {other}: are they mistaken for each other?"
    )


@SEEDS
@pytest.mark.parametrize("kind", ["deflections", "tracker"])
def test_a_row_in_the_wrong_place(kind, seed):
    """The value of another pose."""
    case, rng = exact(kind), np.random.default_rng(seed)
    exactly = case.campaign.readings.value
    row = clearly(case, exactly, np.roll(exactly, -3, axis=0), rng)
    found, _ = told(case, spoilt(case, {row: exactly[(row + 3) % READINGS]}, rng))
    (outlier,) = found
    assert outlier.row == row
    assert (
        outlier.what == f"fits the state of line {(row + 3) % READINGS + 2}: is the row in the wrong place?"
    )


@SEEDS
def test_a_row_in_the_wrong_place_among_targets_that_lie_close(seed):
    """That those of one pose nearly coincide says nothing against it."""
    case, rng = exact("close"), np.random.default_rng(seed)
    exactly = case.campaign.readings.value
    row = clearly(case, exactly, np.roll(exactly, -3, axis=0), rng)
    (outlier,), _ = told(case, spoilt(case, {row: exactly[(row + 3) % READINGS]}, rng))
    assert outlier.what.startswith("fits the state of line ")
    assert ((row + 3) % READINGS) // 3 == (int(outlier.what.split()[5].rstrip(":")) - 2) // 3


@SEEDS
def test_the_opposite_sign(seed):
    case, rng = exact(), np.random.default_rng(seed)
    exactly = case.campaign.readings.value
    row = clearly(case, exactly, -exactly, rng)
    (outlier,), _ = told(case, spoilt(case, {row: -exactly[row]}, rng))
    assert outlier.row == row
    assert outlier.what == "fits with the opposite sign: is it unloaded minus loaded?"


@pytest.mark.sample(4)
@SEEDS
@pytest.mark.parametrize(("a", "b"), [(0, 1), (0, 2), (1, 2)])
@pytest.mark.parametrize("kind", ["deflections", "tracker"])
def test_exchanged_axes(kind, a, b, seed):
    case, rng = exact(kind), np.random.default_rng(seed)
    exactly = case.campaign.readings.value
    turned = exactly.copy()
    turned[:, [a, b]] = turned[:, [b, a]]
    row = clearly(case, exactly, turned, rng)
    (outlier,), _ = told(case, spoilt(case, {row: turned[row]}, rng))
    assert outlier.row == row
    assert outlier.what == f"fits with {'XYZ'[a]} and {'XYZ'[b]} exchanged"


@pytest.mark.sample(6)
@SEEDS
@pytest.mark.parametrize("alike", [False, True])
@pytest.mark.parametrize("kind", ["deflections", "tracker"])
def test_several_do_not_hide_each_other(kind, alike, seed):
    """Five of 45, all to one side even."""
    case, rng = exact(kind), np.random.default_rng(seed)
    rows = rng.choice(READINGS, 5, replace=False)
    away = np.full((5, 3), 2e-3) if alike else 2e-3 * rng.normal(size=(5, 3))
    exactly = case.campaign.readings.value
    found, robust = told(case, spoilt(case, dict(zip(rows, exactly[rows] + away, strict=True)), rng))
    assert {outlier.row for outlier in found} == set(rows)
    assert [o.sigmas for o in found] == sorted((o.sigmas for o in found), reverse=True)
    # the fit that tells them is hardly moved by them
    clean = np.setdiff1d(np.arange(READINGS), rows)
    assert np.sqrt(np.mean(robust.residual[clean] ** 2)) < 2.0 * SIGMA


@SEEDS
@pytest.mark.parametrize("kind", ["deflections", "tracker"])
def test_a_pose_that_is_not_the_one_of_its_rows(kind, seed):
    """All its readings are told, and it makes no error that poses share."""
    case, rng = exact(kind), np.random.default_rng(seed)
    first = 3 * int(rng.integers(POSES))
    exactly, away = case.campaign.readings.value, 2e-3 * rng.normal(size=3)
    rows = {row: exactly[row] + away for row in range(first, first + 3)}
    found, _ = told(case, spoilt(case, rows, rng))
    assert {outlier.row for outlier in found} == set(rows)


@pytest.mark.slow
@pytest.mark.parametrize("stated", [SIGMA, SIGMA / 3, np.nan], ids=["stated", "too small", "not stated"])
def test_among_good_readings_there_are_none(stated):
    """Once in a hundred campaigns one is told: of 200 that is 2, and more than 5 in two cases of a hundred."""
    case, rng, alarms = exact(), np.random.default_rng(2), 0
    readings = replace(case.campaign.readings, sigma=np.full(READINGS, stated))
    for _ in range(200):
        found, _ = told(case, scattered(readings, SIGMA, rng))
        alarms += len(found) > 0
    assert alarms <= 5


@SEEDS
@pytest.mark.parametrize("size", [SIGMA, SIGMA / 30])
def test_one_that_is_just_too_far_is_found(size, seed):
    """Eight standard deviations, whether these are stated, or small and seen."""
    case, rng = exact(), np.random.default_rng(seed)
    row, away = int(rng.integers(READINGS)), rng.normal(size=3)
    value = case.campaign.readings.value + size * rng.normal(size=(READINGS, 3))
    value[row] = case.campaign.readings.value[row] + 8 * size * away / np.linalg.norm(away)
    stated = np.full(READINGS, size if size == SIGMA else np.nan)
    found, _ = told(case, replace(case.campaign.readings, value=value, sigma=stated))
    assert [outlier.row for outlier in found] == [row]
    assert outlier_limit(READINGS) < found[0].sigmas < 12


def outlier_limit(count):
    """One of ``count`` good readings is further in one of a hundred campaigns."""
    from scipy.stats import chi

    return chi.ppf(0.99 ** (1 / count), 3)


@pytest.mark.slow
def test_exact_readings_have_none():
    """What is left of them is rounding, and as heavy-tailed as that is."""
    for kind in ("deflections", "tracker"):
        case = exact(kind)
        unstated = replace(case.campaign.readings, sigma=np.full(READINGS, np.nan))
        assert told(case, unstated)[0] == ()


def test_what_the_model_lacks_makes_no_outliers():
    """Far more is left than the scatter then, but of all readings."""
    rng = np.random.default_rng(3)
    case = exact("deflections", ("base_compliance", "link_compliance"))
    found, used = told(case, scattered(case.campaign.readings, SIGMA, rng))
    assert used.scatter_exceeded
    assert np.sqrt(np.mean(used.residual**2)) > 5 * SIGMA
    assert len(found) <= 2


def test_readings_that_are_left_out_are_not_told():
    case, rng = exact(), np.random.default_rng(4)
    readings = spoilt(case, {7: case.campaign.readings.value[7] + 0.01}, rng)
    campaign = case.campaign.shifted(np.zeros((READINGS, 3)))
    campaign.readings = readings
    rows = np.arange(READINGS) != 7
    found, used = outliers(fit(campaign, case.model, case.unknowns, rows), rows)
    assert found == ()
    assert not used.weights.weight[7].any()


def test_a_missing_coordinate_is_no_outlier():
    case, rng = exact(), np.random.default_rng(5)
    readings = spoilt(case, {7: [np.nan, 0.05, np.nan]}, rng)
    found, _ = told(
        case, replace(readings, value=np.where(np.arange(READINGS)[:, None] == 9, np.nan, readings.value))
    )
    (outlier,) = found
    assert outlier.row == 7
    assert outlier.distance == pytest.approx(0.05, rel=0.1)
