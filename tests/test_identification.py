"""Identification: what was put into readings comes out, with intervals that hold, or is told not to be seen."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from effect_cases import TOOL, conditions, made, nulls, random_arm, sampled, with_terms
from measured import MARKERS, Straight, arm, on_markers, plan, read, robot, scattered, somewhere, taken

from postproc.base.findings import Refusal
from postproc.base.geometry import Poses, vector_from_rotation
from postproc.effects import EFFECTS, ComplianceLaw, Offset
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.identifiable import identifiability
from postproc.identification.noise import Weighting, noise_of, shared_error
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import Unknown, asked_for, with_gauge
from postproc.model import StiffnessModel
from postproc.robot.description import Value

SIGMA = 3e-5
"""[m]"""


# The contract of every effect: what is there is found, from its null


def unknowns_of(model, term):
    """All parameters of an effect but the dimensions of hardware."""
    effect, values = model.terms[term].effect, model.terms[term].values
    return tuple(
        Unknown(f"{effect.name}.{p.name}", term, p, values[p.name])
        for p in effect.parameters
        if not p.hardware
    )


def put_to(model, term, values):
    return model.with_values({(term, name): value for name, value in values.items()})


KINDS = ("tracker", "robot frame", "deflections")


def hidden(name, kind, rng):
    """Readings of an arm with an effect, the model with its null, its term, and its values."""
    described = arm(random_arm(rng, "rrr"))
    joints, count = described.joints, 40
    springs = [made(n, joints) for n, e in EFFECTS.items() if issubclass(e, ComplianceLaw) and n != name]
    springs = [law for law in springs if law.family == "elastic" and not law.coordinates]
    model = with_terms(StiffnessModel(described, ()), *((law, sampled(law, rng)) for law in springs))
    effect = made(name, joints)
    values = sampled(effect, rng)
    known = {p.name: values[p.name] for p in effect.parameters if p.hardware}
    model = with_terms(model, (effect, {**nulls(effect), **known}))
    wrench = rng.normal(size=(count, 6)) * np.array([6000.0] * 3 + [900.0] * 3)
    wrench[rng.random(count) < 0.2] = 0.0
    q, given = rng.uniform(-2.0, 2.0, (count, 3)), conditions(count, rng, joints=3)
    if kind == "tracker":
        readings = plan(described, q, 0.0 * wrench, False, conditions=given, targets=("M",), tool=TOOL)
    else:
        readings = plan(described, q, wrench, kind == "deflections", True, given, tool=TOOL)
    return readings, model, len(model.terms) - 1, values


def missed(found, values):
    """[scales] How far each estimate is from its value, with what it stands for of those that it hides."""
    off = {}
    for estimate in found.estimates:
        meant = values[estimate.unknown.parameter.name]
        for dropped in found.dropped:
            share = dict(dropped.together).get(estimate.unknown.name, 0.0)
            meant += share * values[dropped.name.split(".")[1]]
        off[estimate.unknown.name] = abs(estimate.value - meant) / estimate.unknown.parameter.scale
    return off


@pytest.mark.sample(3)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", EFFECTS)
def test_what_is_there_is_found_from_its_null(name, kind):
    rng = np.random.default_rng(5 + KINDS.index(kind))
    readings, model, term, values = hidden(name, kind, rng)
    truth, unknowns = put_to(model, term, values), unknowns_of(model, term)
    if name == "link_geometry":  # redundant: what predicts the same is told apart by a prior
        unknowns = with_gauge(unknowns)
    found = fit(Campaign(read(truth, readings, rng)), model, unknowns)
    alone = [dropped.name.split(".")[1] for dropped in found.dropped if not dropped.together]
    if found.unknowns and alone:
        # what moves next to nothing moves a little: once more, without
        values |= {name: model.terms[term].values[name] for name in alone}
        truth = put_to(model, term, values)
        found = fit(Campaign(read(truth, readings, rng)), model, unknowns)
    kept, left = [u.name for u in found.unknowns], [d.name for d in found.dropped]
    assert sorted(kept + left) == sorted(u.name for u in unknowns)
    assert all(dropped.why for dropped in found.dropped)
    for unknown in unknowns:
        if unknown.name in left:
            assert found.model.terms[term].values[unknown.parameter.name] == unknown.value
    # the weights of sums come from differences, and mass times length is no sum
    together = any(dropped.together for dropped in found.dropped)
    tolerance = (2e-2 if name == "payload" else 1e-3) if together else 1e-6
    if name != "link_geometry":
        assert max(missed(found, values).values(), default=0.0) < tolerance
    assert np.abs(found.residual).max() < 3e-9
    if kind != "tracker":
        assert kept or issubclass(EFFECTS[name], Offset)


@pytest.mark.parametrize("name", [name for name, effect in EFFECTS.items() if issubclass(effect, Offset)])
def test_deflections_guess_no_offset(name):
    """Where a joint stands elsewhere the same load bends it by next to the same."""
    rng = np.random.default_rng(3)
    readings, model, term, values = hidden(name, "deflections", rng)
    unknowns = unknowns_of(model, term)
    readings = scattered(read(put_to(model, term, values), readings), SIGMA, rng)
    found = fit(Campaign(replace(readings, sigma=np.full(len(readings), SIGMA))), model, unknowns)
    for estimate in found.estimates:
        assert abs(estimate.value - values[estimate.unknown.parameter.name]) < 2.0 * estimate.ci95


def test_growth_counts_from_the_first_reading():
    """What was there before is geometry."""
    readings, model, term, values = hidden("thermal_growth", "robot frame", np.random.default_rng(4))
    campaign = Campaign(readings)
    grown, still = (campaign.predicted(one).tip[campaign.at] for one in (put_to(model, term, values), model))
    np.testing.assert_array_equal(grown[0], still[0])
    assert (np.abs(grown - still).max(axis=1)[1:] > 1e-6).all()


# Derivatives


def visit(deflection, rng, posed=True):
    """A campaign of two sessions, one stated and two unknown targets, with rotations, its model and where all is."""
    described = arm(random_arm(rng, "rrr"))
    model = asked_for(StiffnessModel(described, ()), ["joint_compliance", "link_geometry"]).model
    model = model.with_values({(0, p.name): p.scale for p in model.terms[0].effect.parameters})
    count = 24
    q, wrench = rng.uniform(-2.0, 2.0, (count, 3)), 1e4 * rng.normal(size=(count, 6))
    words = {"targets": tuple(MARKERS), "places": {"M1": MARKERS["M1"]}, "target": np.arange(count) % 3}
    readings = plan(described, q, wrench, deflection, tool=TOOL, **words)
    readings = replace(readings, session=np.arange(count) // 2 % 2, sessions=("am", "pm"))
    if posed:
        readings = replace(readings, rotation=np.full((count, 3, 3), np.nan))
    campaign = Campaign(readings)
    return campaign, model, somewhere(campaign, rng)


def difference(one, other):
    """(R, 6) of two expectations."""
    turn = vector_from_rotation(one[1] @ np.swapaxes(other[1], 1, 2))
    return np.concatenate([one[0] - other[0], turn], axis=1)


@pytest.mark.parametrize("deflection", [False, True])
def test_nuisance_columns_are_the_derivative_of_what_is_expected(deflection):
    campaign, model, given = visit(deflection, np.random.default_rng(11))
    seen = campaign.predicted(model)
    found = campaign.nuisance_columns(seen, given)
    names = campaign.nuisance_names
    assert len(names) == (6 if deflection else 2 * 6 + 2 * 3 + 3 * 3 + 1)
    assert found.shape == (len(campaign), 6, len(names))
    step = 1e-5
    for k, name in enumerate(names):
        ends = [
            campaign.expected(seen, campaign.moved(given, way * step * np.eye(len(names))[k]))
            for way in (1, -1)
        ]
        slope = difference(*ends) / (2 * step)
        np.testing.assert_allclose(found[:, :, k], slope, atol=1e-8, err_msg=name)
        assert np.abs(slope).max() > 1e-4, name


def test_without_rotations_the_columns_are_those_of_the_positions():
    rng = np.random.default_rng(12)
    campaign, model, _ = visit(False, rng, posed=False)
    given, seen = somewhere(campaign, rng), campaign.predicted(model)
    posed = Campaign(replace(campaign.readings, rotation=np.full((len(campaign), 3, 3), np.nan)))
    rows = [
        posed.nuisance_names.index(name) for name in campaign.nuisance_names if name in posed.nuisance_names
    ]
    assert len(rows) == len(campaign.nuisance_names)
    np.testing.assert_array_equal(
        campaign.nuisance_columns(seen, given), posed.nuisance_columns(seen, given)[:, :3, rows]
    )


@pytest.mark.sample(4)
@pytest.mark.parametrize("at_tip", [False, True])
@pytest.mark.parametrize("deflection", [False, True])
@pytest.mark.parametrize("name", EFFECTS)
def test_columns_are_the_derivative_of_what_is_expected(name, deflection, at_tip):
    """Of every parameter of every effect, on an arm whose joints, base and tool give way under weights."""
    rng = np.random.default_rng(13)
    described = arm(random_arm(rng, "rrr"))
    beside = ["joint_compliance", "base_compliance", "tool_compliance", "link_gravity", "gravity_compensator"]
    effects = [made(n, described.joints) for n in [*beside, *([] if name in beside else [name])]]
    model = with_terms(StiffnessModel(described, ()), *((effect, sampled(effect, rng)) for effect in effects))
    term = next(k for k, effect in enumerate(effects) if effect.name == name)
    count = 24
    q, wrench = (
        rng.uniform(-2.0, 2.0, (count, 3)),
        3e3 * rng.normal(size=(count, 6)) * [1, 1, 1, 0.1, 0.1, 0.1],
    )
    words = {"targets": tuple(MARKERS), "places": {"M1": MARKERS["M1"]}, "target": np.arange(count) % 3}
    readings = plan(described, q, wrench, deflection, tool=TOOL, **({} if at_tip else words))
    readings = replace(
        readings,
        rotation=np.full((count, 3, 3), np.nan),
        session=np.arange(count) // 2 % 2,
        sessions=("am", "pm"),
        temperature=rng.uniform(20.0, 35.0, count),
    )
    campaign = Campaign(readings)
    given = somewhere(campaign, rng)
    unknowns, seen = unknowns_of(model, term), campaign.predicted(model, None, 1e-14)
    assert seen.converged.all()
    found = columns(campaign, model, unknowns, seen, given)
    assert np.abs(found).max() > 0 or (deflection and isinstance(effects[term], Offset))
    for k, unknown in enumerate(unknowns):
        p, value = unknown.parameter, model.terms[term].values[unknown.parameter.name]
        slopes = []
        for step in (0.02 * p.scale, 0.01 * p.scale):
            ends = [
                campaign.expected(
                    campaign.predicted(model.with_values({unknown.key: value + way * step})), given
                )
                for way in (1, -1)
            ]
            slopes.append(difference(*ends) * p.scale / (2 * step))
        # of central differences with steps h and h / 2 a third of their difference is left
        best = slopes[1] + (slopes[1] - slopes[0]) / 3.0
        np.testing.assert_allclose(
            found[:, :, k], best, atol=2e-5 * np.abs(best).max() + 1e-9, err_msg=p.name
        )


def test_columns_stop_at_bounds(monkeypatch):
    """A compliance of zero has a derivative to one side, and nothing beyond its bounds is ever tried."""
    rng = np.random.default_rng(14)
    campaign, model, given = visit(False, rng)
    unknowns, tried = unknowns_of(model, 0), []
    p, law = unknowns[0].parameter, type(model.terms[0].effect)
    plain = law.add_displacement

    def watched(self, values, *others):
        tried.append(values[p.name])
        plain(self, values, *others)

    for bound, inward in ((p.lower, 1.0), (p.upper, -1.0)):
        model = model.with_values({(0, p.name): bound})
        ends = [
            campaign.predicted(model.with_values({(0, p.name): bound + inward * h * p.scale}))
            for h in (0.0, 0.01)
        ]
        tried.clear()
        with monkeypatch.context() as patch:
            patch.setattr(law, "add_displacement", watched)
            found = columns(campaign, model, unknowns[:1], ends[0], given)[:, :, 0]
        assert p.lower <= min(tried) < max(tried) <= p.upper
        slope = difference(*(campaign.expected(seen, given) for seen in ends[::-1])) * inward / 0.01
        if ends[0].converged.all():
            np.testing.assert_allclose(found, slope, atol=1e-4 * np.abs(slope).max())


def test_states_without_rest_are_not_expected_anywhere():
    campaign, model, given = visit(True, np.random.default_rng(15))
    seen = campaign.predicted(model)
    lost = np.arange(len(seen.converged)) == campaign.still[7]
    position, _ = campaign.expected(replace(seen, converged=~lost), given)
    gone = (campaign.at == campaign.still[7]) | (campaign.still == campaign.still[7])
    np.testing.assert_array_equal(np.isnan(position).all(axis=1), gone)
    assert gone[7]
    assert not gone.all()


# Statistics: intervals hold what they promise


class Drawn(NamedTuple):
    """A cheap campaign, its model and unknowns, and their true values."""

    campaign: Straight
    model: StiffnessModel
    unknowns: tuple[Unknown, ...]
    values: np.ndarray


POSES, READINGS = 15, 45


@cache
def drawable():
    """Deflections of three joints at 15 poses of three targets, free of scatter."""
    rng = np.random.default_rng(20)
    described = arm(random_arm(rng, "rrr"))
    asked = asked_for(StiffnessModel(described, ()), ["joint_compliance"])
    truth = asked.model.with_values({u.key: 5.0 * u.parameter.scale for u in asked.unknowns})
    wrench = rng.normal(size=(POSES, 6)) * np.array([1000.0] * 3 + [600.0] * 3)
    q, wrench, words = on_markers(rng.uniform(-2.0, 2.0, (POSES, 3)), wrench)
    campaign = Straight(plan(described, q, wrench, sigma=SIGMA, **words), asked.model, asked.unknowns)
    campaign.readings = taken(campaign, truth)
    values = np.array([5.0 * u.parameter.scale for u in asked.unknowns])
    return Drawn(campaign, asked.model, asked.unknowns, values)


def stating(campaign, sigma):
    """The campaign with another stated scatter."""
    rows = np.broadcast_to(np.asarray(sigma, float), len(campaign))
    stated = campaign.shifted(np.zeros((len(campaign), 3)))
    stated.readings = replace(campaign.readings, sigma=rows)
    return stated


def alone(rng, size=SIGMA):
    return np.reshape(size, (-1, 1)) * rng.normal(size=(READINGS, 3))


def together(rng, size):
    """What all readings of a pose have in common."""
    return size * np.repeat(rng.normal(size=(POSES, 3)), READINGS // POSES, axis=0)


def gross(rng):
    """One reading in twenty is anywhere."""
    error = alone(rng)
    error[rng.choice(READINGS, 2, replace=False)] += 100 * SIGMA * rng.normal(size=(2, 3))
    return error


UNEQUAL = SIGMA * np.repeat(np.where(np.arange(POSES) % 5 == 0, 5.0, 0.5), READINGS // POSES)


class Setting(NamedTuple):
    """What is stated, what errors there are, and what is to be told about them in at least and at most this share."""

    sigma: object
    error: object
    exceeded: tuple[float, float] = (0.0, 0.04)
    shared: tuple[float, float] = (0.0, 0.02)
    robust: bool = False
    factor: float = 1.0


SETTINGS = {
    "stated": Setting(SIGMA, alone),
    "not stated": Setting(np.nan, alone, (0.0, 0.0), factor=9.0),
    "stated too small": Setting(SIGMA / 3.0, alone, (1.0, 1.0), factor=9.0),
    "stated by row": Setting(UNEQUAL, lambda rng: alone(rng, UNEQUAL)),
    "shared": Setting(SIGMA, lambda rng: alone(rng) + together(rng, SIGMA), shared=(0.95, 1.0)),
    "shared, not stated": Setting(
        np.nan, lambda rng: alone(rng) + together(rng, 2 * SIGMA), (0.0, 0.0), (0.99, 1.0), factor=9.0
    ),
    "gross": Setting(SIGMA, gross, (0.0, 0.15), robust=True, factor=1.1),
}


@pytest.mark.slow
@pytest.mark.parametrize("setting", SETTINGS.values(), ids=SETTINGS)
def test_intervals_cover_the_truth_as_often_as_they_say(setting):
    """400 campaigns of three parameters: 95 % of 1200, with a standard deviation of 0.63 % for independent ones."""
    drawn, rng, draws = drawable(), np.random.default_rng(21), 400
    campaign = stating(drawn.campaign, setting.sigma)
    inside, exceeded, shared, factor = [], [], [], []
    for _ in range(draws):
        found = fit(campaign.shifted(setting.error(rng)), drawn.model, drawn.unknowns, robust=setting.robust)
        off = np.array([e.value for e in found.estimates]) - drawn.values
        inside += list(np.abs(off) < [e.ci95 for e in found.estimates])
        exceeded.append(found.scatter_exceeded)
        shared.append(found.shared_error)
        factor.append(found.factor)
    assert len(inside) == 3 * draws
    assert 0.95 - 4 * 0.0063 < np.mean(inside) < 0.95 + 4 * 0.0063
    assert setting.exceeded[0] <= np.mean(exceeded) <= setting.exceeded[1]
    assert setting.shared[0] <= np.mean(np.array(shared) > 0) <= setting.shared[1]
    assert np.mean(factor) == pytest.approx(setting.factor, rel=0.05)


def test_the_scatter_is_the_stated_one_else_that_of_repeats():
    rng = np.random.default_rng(22)
    campaign = drawable().campaign
    many = np.repeat(np.arange(READINGS), 20)
    repeated = scattered(campaign.readings.part(many), SIGMA, rng)
    repeated = replace(repeated, sigma=np.full(len(many), np.nan), repeat=many)
    noise = noise_of(repeated)
    assert noise.known
    assert noise.freedom == 3 * READINGS * 19
    # a standard deviation of f degrees of freedom is known to 1 / sqrt(2 f)
    assert noise.sigma == pytest.approx(SIGMA, rel=4 / np.sqrt(2 * noise.freedom))
    assert noise.rms == pytest.approx(np.sqrt(3) * noise.repeats)
    assert not noise_of(replace(repeated, repeat=np.full(len(many), -1))).known
    partly = np.where(many % 2 == 0, 2e-5, np.nan)
    partly[0] = 7e-5
    np.testing.assert_array_equal(noise_of(replace(repeated, sigma=partly)).sigma[:21:20], [7e-5, 2e-5])


def test_nothing_more_can_be_taken_off_at_the_solution():
    """What is left is at right angles to all columns, and has the freedom of the rest."""
    rng = np.random.default_rng(25)
    readings, model, term, values = hidden("joint_offset", "tracker", rng)
    readings = scattered(read(put_to(model, term, values), readings, rng), SIGMA, rng)
    found = fit(
        Campaign(replace(readings, sigma=np.full(len(readings), np.nan))), model, unknowns_of(model, term)
    )
    matrix = np.concatenate([found.weights(part) for part in found.point.required_columns], axis=1)
    left = found.weights(found.point.residual)
    # the scale of the tracker, the last one, is held by what is known of trackers
    share = (matrix.T @ left / np.linalg.norm(matrix, axis=0))[:-1]
    assert np.abs(share).max() < 1e-3 * np.linalg.norm(left) / np.sqrt(len(left))
    assert found.freedom == 3 * 40 - len(found.unknowns) - len(found.campaign.nuisance_names)
    # and what is known of them counts as a reading
    assert found.factor * found.freedom == pytest.approx(left @ left, rel=1e-4)


def test_an_exact_fit_ends_where_the_rough_one_does():
    """Nothing explains readings that are a thousand scatters off: their variance weighs the scale of a tracker no more
    in the round that makes the fit exact."""
    rng = np.random.default_rng(26)
    readings, model, term, values = hidden("joint_offset", "tracker", rng)
    readings = scattered(read(put_to(model, term, values), readings, rng), 1000 * SIGMA, rng)
    campaign = Campaign(replace(readings, sigma=np.full(len(readings), SIGMA)))
    rough, found = (fit(campaign, model, (), exact=exact) for exact in (False, True))
    assert found.factor > 1e4
    assert found.point.nuisances.scale == pytest.approx(rough.point.nuisances.scale, abs=1e-8)
    left, least = (one.weights(one.point.residual) for one in (found, rough))
    assert left @ left == pytest.approx(least @ least, rel=1e-6)


@pytest.mark.sample(2)
@pytest.mark.parametrize("size", [1.0, 0.05])
@pytest.mark.parametrize("known", [True, False])
def test_what_poses_share_is_told_apart_from_what_a_fit_took(known, size):
    """Few poses and many columns that move a pose as a whole: the moments are those of what is left.

    Where no scatter is stated the ratio counts, whatever the size.
    """
    rng, poses, each = np.random.default_rng(26), 20, 4
    pose = np.repeat(np.arange(poses), each)
    weights = Weighting(np.full((poses * each, 3), 1.0 / SIGMA), pose)
    columns = np.repeat(rng.normal(size=(poses, 3, 30)), each, axis=0) + 0.1 * rng.normal(
        size=(poses * each, 3, 30)
    )
    q = np.linalg.qr(columns.reshape(-1, 30))[0]
    squares = []
    for _ in range(300):
        error = rng.normal(size=(poses * each, 3)) + 1.5 * np.repeat(
            rng.normal(size=(poses, 3)), each, axis=0
        )
        error = error.reshape(-1) * (SIGMA if known else SIGMA * size)
        left = (error - q @ (q.T @ error)).reshape(-1, 3)
        squares.append((shared_error(left, weights, columns, known) / SIGMA) ** 2)
    # 300 of them with 30 of 60 degrees of freedom: the mean is known to 2 %
    assert np.mean(squares) == pytest.approx(1.5**2, rel=0.12)


def with_priors(unknowns, deviation, away=0.0):
    """Each stated ``deviation`` [its scale] wide, and ``away`` from the truth."""
    scale = [u.parameter.scale for u in unknowns]
    return tuple(
        replace(u, value=(5.0 + away) * size, prior=deviation * size, stated=Value(u.value, size, 0.95, ""))
        for u, size in zip(unknowns, scale, strict=True)
    )


@pytest.mark.parametrize("away", [0.0, 0.1, 3.0])
@pytest.mark.parametrize("stated", [SIGMA, SIGMA / 3.0, np.nan], ids=["stated", "too small", "not stated"])
def test_a_prior_counts_as_a_reading_of_its_deviation(stated, away):
    """Inverse variances add, whatever the readings say of their own scatter; one that contradicts them moves them by
    its share."""
    drawn, rng = drawable(), np.random.default_rng(23)
    campaign = stating(drawn.campaign, stated).shifted(alone(rng))
    plain = fit(campaign, drawn.model, drawn.unknowns)
    unknowns = with_priors(drawn.unknowns, 0.1, away)
    found = fit(campaign, drawn.model, unknowns)
    scale = np.array([u.parameter.scale for u in unknowns])
    know = np.linalg.inv(plain.covariance / np.outer(scale, scale))
    if not plain.noise.known or plain.scatter_exceeded:
        know *= plain.factor / found.factor
    posterior = np.linalg.inv(know + np.eye(3) / 0.1**2)
    deviation = np.sqrt(np.diag(found.covariance)) / scale
    np.testing.assert_allclose(deviation, np.sqrt(np.diag(posterior)), rtol=0.02)
    assert (deviation < 0.1).all()
    at, other = (np.array([e.value for e in f.estimates]) / scale for f in (plain, found))
    expected = posterior @ (know @ at + np.full(3, 5.0 + away) / 0.1**2)
    np.testing.assert_allclose(other, expected, atol=0.02 * deviation.min() + 0.002 * away)


def test_a_prior_that_is_wrong_makes_no_scatter():
    """However much it leaves unexplained, and poses have much of that in common."""
    drawn, rng = drawable(), np.random.default_rng(27)
    found = fit(drawn.campaign.shifted(alone(rng)), drawn.model, with_priors(drawn.unknowns, 0.01, 3.0))
    assert (found.factor, found.scatter_exceeded, found.shared_error) == (1.0, False, 0.0)
    assert np.sqrt(np.mean(found.residual**2)) > 1.5 * SIGMA


@pytest.mark.slow
@pytest.mark.parametrize("stated", [SIGMA / 3.0, np.nan], ids=["too small", "not stated"])
def test_posterior_intervals_cover(stated):
    drawn, rng, inside = drawable(), np.random.default_rng(24), []
    campaign = stating(drawn.campaign, stated)
    for _ in range(150):
        unknowns = with_priors(drawn.unknowns, 0.05)
        unknowns = tuple(replace(u, value=u.value + u.prior * float(rng.normal())) for u in unknowns)
        found = fit(campaign.shifted(alone(rng)), drawn.model, unknowns)
        off = np.array([e.value for e in found.estimates]) - drawn.values
        inside += list(np.abs(off) < [e.ci95 for e in found.estimates])
    assert np.mean(inside) == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / len(inside)))


# What readings can tell


def test_a_vertical_load_does_not_show_the_vertical_joint():
    described, rng = robot("kuka_kr270"), np.random.default_rng(30)
    model = StiffnessModel.from_robot(described).without_effects(["gravity_compensator"])
    asked = asked_for(model, ["joint_compliance"])
    low, high = described.limits.T
    wrench = np.tile([0.0, 0.0, -2600.0, 0.0, 0.0, 0.0], (15, 1))
    readings = read(model, plan(described, rng.uniform(low, high, (15, 6)), wrench, tool=TOOL))
    started = model.with_values({u.key: 2.0 * u.value for u in asked.unknowns})
    unknowns = [replace(u, value=2.0 * u.value) for u in asked.unknowns]
    found = fit(Campaign(readings), started, unknowns)
    assert [(d.name, d.why, d.together) for d in found.dropped] == [
        ("joint_compliance.c1", "no reading depends on it", ())
    ]
    for estimate in found.estimates:
        assert 2.0 * estimate.value == pytest.approx(estimate.unknown.value, rel=1e-6)
    assert found.model.terms[0].values["c1"] == 2.0 * model.terms[0].values["c1"]


def test_the_first_zero_is_part_of_the_registration():
    described, rng = robot("abb_irb120"), np.random.default_rng(31)
    asked = asked_for(StiffnessModel(described, ()), ["joint_offset"])
    truth = asked.model.with_values({u.key: 0.01 * (k + 1) for k, u in enumerate(asked.unknowns)})
    q = rng.uniform(*described.limits.T, (20, 6))
    free = read(truth, plan(described, q, None, False, targets=("M",), tool=TOOL), rng)
    found = fit(Campaign(free), asked.model, asked.unknowns)
    first = found.dropped[0]
    assert (first.name, first.together) == ("joint_offset.o1", ())
    assert first.why == "is observable only together with the registration"
    assert {d.name for d in found.dropped} <= {"joint_offset.o1", "joint_offset.o6"}
    fixed = read(truth, plan(described, q, None, False, True, tool=TOOL))
    found = fit(Campaign(fixed), asked.model, asked.unknowns)
    assert not found.dropped
    np.testing.assert_allclose([e.value for e in found.estimates], 0.01 * np.arange(1, 7), atol=1e-9)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_two_joints_on_one_axis_are_told_as_their_sum(way):
    """The weight is what the second counts in units of the first; along it no reading moves."""
    rng = np.random.default_rng(32)
    joints = list(random_arm(rng, "rrr"))
    turned = np.diag([1.0, way, way])
    joints[1] = replace(joints[1], placement=Poses(turned, np.zeros(3)))
    described = arm(joints)
    asked = asked_for(StiffnessModel(described, ()), ["joint_offset"])
    readings = plan(described, rng.uniform(-2.0, 2.0, (20, 3)), None, False, True, tool=TOOL)
    truth = asked.model.with_values({(0, "o1"): 1e-3, (0, "o2"): 4e-3, (0, "o3"): 2e-3})
    found = fit(Campaign(read(truth, readings)), asked.model, asked.unknowns)
    (dropped,) = found.dropped
    assert dropped.name == "joint_offset.o2"
    ((other, weight),) = dropped.together
    assert (other, weight) == ("joint_offset.o1", pytest.approx(way))
    assert dropped.why == "is observable only together with joint_offset.o1"
    np.testing.assert_allclose([e.value for e in found.estimates], [1e-3 + way * 4e-3, 2e-3], atol=1e-9)


@pytest.mark.parametrize("name", ["link_gravity"])
def test_along_what_is_only_seen_together_no_reading_moves(name):
    rng = np.random.default_rng(33)
    readings, model, term, values = hidden(name, "robot frame", rng)
    unknowns = unknowns_of(model, term)
    campaign = Campaign(read(put_to(model, term, values), readings))
    found = fit(campaign, model, unknowns)
    sums = [dropped for dropped in found.dropped if dropped.together]
    assert sums
    here = campaign.points(campaign.predicted(found.model), found.point.nuisances.places, campaign.at)
    for dropped in sums:
        moves = {}
        for hidden_name, share in ((dropped.name, 1.0), *((n, -w) for n, w in dropped.together)):
            unknown = next(u for u in unknowns if u.name == hidden_name)
            at = found.model.terms[term].values[unknown.parameter.name]
            moves[unknown.key] = at + share * 50.0
        there, alone = (
            campaign.points(
                campaign.predicted(found.model.with_values(m)), found.point.nuisances.places, campaign.at
            )
            for m in (moves, dict([next(iter(moves.items()))]))
        )
        assert np.abs(there - here).max() < 1e-4 * np.abs(alone - here).max()


def test_what_is_seen_too_weakly_is_left_as_it_was():
    """An interval wider than the value, than the stated value, and than ten usual sizes says nothing."""
    drawn = drawable()
    exact = fit(stating(drawn.campaign, SIGMA), drawn.model, drawn.unknowns)
    wide = np.array([e.ci95 / e.unknown.parameter.scale for e in exact.estimates])
    worst = int(np.argmax(wide))
    for share, kept in ((0.97, True), (1.03, False)):
        # nothing is there to be seen, so that ten sizes are the limit
        loud = stating(drawn.campaign, SIGMA * share * 10.0 / wide[worst])
        loud.readings = replace(loud.readings, value=np.zeros((READINGS, 3)))
        found = fit(loud, drawn.model, drawn.unknowns)
        assert (drawn.unknowns[worst].name in [u.name for u in found.unknowns]) == kept
        if not kept:
            (dropped,) = found.dropped
            assert dropped.why.startswith("is observable too weakly: +- ")
            assert found.model.terms[0].values[drawn.unknowns[worst].parameter.name] == 0.0
            assert dropped.together == ()


def test_a_value_pulled_below_its_bound_stays_there():
    drawn, rng, at_bound = drawable(), np.random.default_rng(34), 0
    nothing = stating(drawn.campaign, SIGMA)
    nothing.readings = replace(nothing.readings, value=np.zeros((READINGS, 3)))
    for _ in range(30):
        found = fit(nothing.shifted(alone(rng)), drawn.model, drawn.unknowns)
        for estimate in found.estimates:
            assert estimate.value >= 0.0
            assert estimate.at_bound == (estimate.value == 0.0)
            at_bound += estimate.at_bound
    # half of the errors pull down
    assert 0.3 < at_bound / 90 < 0.7


def test_beside_a_bound_the_others_are_the_least_squares_without_it():
    drawn, rng, compared = drawable(), np.random.default_rng(35), 0
    nothing = stating(drawn.campaign, SIGMA)
    nothing.readings = replace(nothing.readings, value=np.zeros((READINGS, 3)))
    for _ in range(12):
        campaign = nothing.shifted(alone(rng))
        found = fit(campaign, drawn.model, drawn.unknowns)
        inside = tuple(e.unknown for e in found.estimates if not e.at_bound)
        if 0 < len(inside) < 3:
            others = fit(campaign, drawn.model, inside)
            values = [e.value for e in found.estimates if not e.at_bound]
            wide = np.array([e.ci95 for e in others.estimates])
            np.testing.assert_allclose(values / wide, [e.value for e in others.estimates] / wide, atol=1e-3)
            compared += 1
    assert compared > 3


def test_fewer_numbers_than_unknowns_are_refused():
    drawn = drawable()
    few = drawn.campaign.readings.part(slice(0, 1))
    more = [replace(u, name=f"{u.name}{k}") for k in range(2) for u in drawn.unknowns]
    with pytest.raises(Refusal) as refusal:
        fit(Campaign(few), drawn.model, more)
    assert refusal.value.findings[0].code == "IDN002"


# The linear algebra of it


def problem(rng, rows=40, count=4, nuisances=2):
    """Unknowns of different sizes, and what moves: columns per scale, nuisances."""
    described = arm(random_arm(rng, "rrrr"))
    unknowns = asked_for(StiffnessModel(described, ()), ["joint_offset"]).unknowns[:count]
    sizes = 10.0 ** rng.uniform(-5, 1, count)
    unknowns = [
        replace(u, parameter=replace(u.parameter, size=float(size)), value=1e3 * float(size))
        for u, size in zip(unknowns, sizes, strict=True)
    ]
    return unknowns, rng.normal(size=(rows, count)), rng.normal(size=(rows, nuisances))


def told(unknowns, found, nuisance, prior=None):
    count = len(unknowns)
    prior = np.zeros((count, count)) if prior is None else prior
    values = np.array([u.value for u in unknowns])
    names = [f"registration.{k}" for k in range(nuisance.shape[1])]
    return identifiability(unknowns, found, nuisance, names, prior, values)


def test_the_covariance_is_that_of_the_parameters_among_all_unknowns():
    rng = np.random.default_rng(40)
    unknowns, found, nuisance = problem(rng)
    prior = np.diag([0.0, 3.0, 0.0, 1.0])
    result = told(unknowns, found, nuisance, prior)
    both = np.concatenate([found, nuisance], axis=1)
    information = both.T @ both
    information[:4, :4] += prior**2
    np.testing.assert_allclose(result.covariance, np.linalg.inv(information)[:4, :4], rtol=1e-9, atol=1e-14)
    assert result.observable == (0, 1, 2, 3)


def test_insight_does_not_depend_on_units():
    """Neither on those of the parameters nor, the covariance aside, on that of the readings."""
    rng = np.random.default_rng(41)
    unknowns, found, nuisance = problem(rng)
    found = np.column_stack([found, found @ [1.0, 0.0, 2.0, 0.0]])
    extra = replace(unknowns[0], name="sum", parameter=replace(unknowns[0].parameter, size=1.0), value=1e3)
    unknowns = [*unknowns, extra]
    one = told(unknowns, found, nuisance)
    by = 10.0 ** rng.uniform(-3, 3, 5)
    scaled = [
        replace(u, parameter=replace(u.parameter, size=u.parameter.scale * float(b)))
        for u, b in zip(unknowns, by, strict=True)
    ]
    other = told(scaled, found * by, nuisance * [1e3, 1e-4])
    assert other.observable == one.observable == (0, 1, 2, 3)
    assert other.condition == pytest.approx(one.condition, rel=1e-6)
    np.testing.assert_allclose(other.covariance * np.outer(by[:4], by[:4]), one.covariance, rtol=1e-6)
    assert [d.why for d in other.dropped] == [d.why for d in one.dropped]
    weights = dict(one.dropped[0].together)
    # per scale: 1 and 2; in SI those times the scale of each over that of the sum
    expected = {u.name: k * u.parameter.scale for u, k in zip(unknowns[:3:2], (1.0, 2.0), strict=True)}
    assert weights == pytest.approx(expected, rel=1e-6)
    assert dict(other.dropped[0].together) == pytest.approx(weights, rel=1e-6)
    louder = told(unknowns, 7.0 * found, 7.0 * nuisance)
    assert louder.observable == one.observable
    assert louder.condition == pytest.approx(one.condition, rel=1e-9)
    np.testing.assert_allclose(49.0 * louder.covariance, one.covariance, rtol=1e-9)


def test_the_condition_is_that_of_columns_of_one_length():
    """Two columns that make an angle a have the condition cot(a / 2)."""
    rng = np.random.default_rng(42)
    unknowns, _, _ = problem(rng, count=2)
    for angle in (0.5 * np.pi, 0.3, 0.01):
        found = np.zeros((40, 2))
        found[0] = [3.0, 500.0 * np.cos(angle)]
        found[1] = [0.0, 500.0 * np.sin(angle)]
        assert told(unknowns, found, np.zeros((40, 0))).condition == pytest.approx(
            1 / np.tan(angle / 2), rel=1e-6
        )


def test_what_a_registration_does_as_well_is_told_so():
    rng = np.random.default_rng(43)
    unknowns, found, nuisance = problem(rng)
    found[:, 2] = nuisance @ [1.0, -2.0]
    result = told(unknowns, found, nuisance)
    assert result.observable == (0, 1, 3)
    assert [(d.name, d.why, d.together) for d in result.dropped] == [
        (unknowns[2].name, "is observable only together with the registration", ())
    ]
    # known before, it is not: a prior is a reading that the registration does not move
    result = told(unknowns, found, nuisance, np.diag([0.0, 0.0, 0.01, 0.0]))
    assert result.observable == (0, 1, 2, 3)
    assert result.covariance[2, 2] == pytest.approx(1e4)
