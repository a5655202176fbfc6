"""Intervals where all readings between two motions share at which angles the joints came to rest."""

from dataclasses import replace

import numpy as np
import pytest
from blind import measured
from blind.arm import model_of, robot_file
from blind.cases import cases, made
from blind.real_worlds import campaign

from postproc.diagnosis.search import model_unknowns
from postproc.effects import EFFECTS
from postproc.effects.joint_offset import JointOffset
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.joint_scatter import Part, Scatter, moments, scatter_of, with_scatter_of_joints
from postproc.identification.noise import Weighting
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import unknowns_of

SIGMA, REST = 1e-5, 1e-5
"""[m] of a reading, [rad] of where a joint comes to rest."""


def parts(rng, groups=40, each=6):
    """Two parts of a scatter: what groups share, and what pairs of groups share."""
    group = np.repeat(np.arange(groups), each)
    return (
        Part(rng.normal(size=(len(group), 3)), group // 2),
        Part(rng.normal(size=(len(group), 2)), group),
    )


def drawn(rng, of, sizes):
    """Numbers with variance 1 each, and what they share."""
    found = rng.normal(size=len(of[0].group))
    for part, size in zip(of, sizes, strict=True):
        shared = np.sqrt(size) * rng.normal(size=(part.group.max() + 1, part.moves.shape[1]))
        found += (part.moves * shared[part.group]).sum(axis=1)
    return found


def test_sizes_of_the_parts_come_out_whatever_a_fit_has_taken_out():
    rng = np.random.default_rng(1)
    of = parts(rng)
    q = np.linalg.qr(rng.normal(size=(240, 60)))[0]
    found = []
    for _ in range(300):
        z = drawn(rng, of, (0.3, 0.8))
        z -= q @ (q.T @ z)
        found.append(np.linalg.solve(*moments(of, q, z, len(z))))
    scatter = np.std(found, axis=0) / np.sqrt(len(found))
    assert np.all(np.abs(np.mean(found, axis=0) - [1.0, 0.3, 0.8]) < 4.0 * scatter)
    assert np.all(scatter < 0.03)


@pytest.mark.parametrize("shared", [0.0, 0.7])
def test_covariance_of_what_a_fit_gives_is_that_of_the_scatter(shared):
    rng = np.random.default_rng(2)
    pose = np.repeat(np.arange(20), 4)
    weights = Weighting(rng.uniform(0.5, 2.0, (80, 3)), pose, shared)
    group = np.repeat(pose, 3)
    of = Part(rng.normal(size=(240, 3)), group), Part(rng.normal(size=(240, 2)), np.repeat(np.arange(40), 6))
    gain = rng.normal(size=(5, 240))
    whitening = weights((np.eye(240) / weights.weight.reshape(-1)[:, None]).reshape(80, 3, 240))
    covariance = 0.9 * np.eye(240)
    for part, size in zip(of, (0.2, 0.5), strict=True):
        covariance += size * (part.group[:, None] == part.group) * (part.moves @ part.moves.T)
    wanted = gain @ (whitening @ covariance @ whitening.T - 1.3 * np.eye(240)) @ gain.T
    assert Scatter(0.9, (0.2, 0.5), of, weights, 1.3).excess(gain) == pytest.approx(wanted)


def arm():
    """A campaign, an arm that lags at A2, its unknowns, and the moves (R, 3, 6) [m/rad] of readings by joints."""
    rng = np.random.default_rng(3)
    design = replace(campaign(rng, 30, stated=True), jitter=0.0)
    sigma = float(np.sqrt(SIGMA**2 + (REST * 1.2) ** 2))
    seen = Campaign(measured.readings(design, np.zeros((len(design.q) * design.points, 3)), sigma))
    model = model_of(robot_file(True, False))
    lag = EFFECTS["hysteresis"](model.robot.joints)
    own = model_unknowns(model)
    model = model.with_effect(lag)
    term = len(model.terms) - 1
    model = model.with_values({(term, "w2"): 2e-4})
    new = [u for u in unknowns_of(model, term) if u.parameter.name == "w2"]
    at = next(i for i, t in enumerate(model.terms) if t.effect.name == JointOffset.name)
    zeros = unknowns_of(model, at)
    predicted = seen.predicted(model)
    moves = columns(seen, model, zeros, predicted, seen.start()) / [u.parameter.scale for u in zeros]
    exact = -seen.residual(predicted, seen.start())[:, :3]
    return design, seen, model, [*own, *new], exact, moves


def test_the_lag_of_a_joint_is_as_uncertain_as_that_joint_rests():
    design, seen, model, unknowns, exact, moves = arm()
    rng = np.random.default_rng(4)
    visit = np.repeat(np.arange(len(design.q)), len(exact) // len(design.q))
    away = []
    for _ in range(60):
        rest = REST * rng.normal(size=(len(design.q), 6))
        value = exact + (moves @ rest[visit][..., None])[..., 0] + SIGMA * rng.normal(size=exact.shape)
        found = fit(Campaign(replace(seen.readings, value=value)), model, unknowns, near=True)
        for one in (found, with_scatter_of_joints(found)):
            (lag,) = (e for e in one.estimates if e.unknown.parameter.name == "w2")
            away.append((lag.value - 2e-4) / lag.ci95)
    plain, covered = np.array(away).reshape(-1, 2).T
    assert np.mean(np.abs(plain) > 1.0) > 0.15
    assert np.mean(np.abs(covered) > 1.0) < 0.1
    # no wider than need be
    assert np.sqrt(np.mean(covered**2)) > 0.4


def test_readings_that_scatter_alone_keep_their_intervals():
    _, seen, model, unknowns, exact, _ = arm()
    ratios = []
    for seed in range(6):
        scatter = SIGMA * np.random.default_rng(seed).normal(size=exact.shape)
        found = fit(Campaign(replace(seen.readings, value=exact + scatter)), model, unknowns, near=True)
        scattered = with_scatter_of_joints(found)
        ratios += [b.ci95 / a.ci95 for a, b in zip(found.estimates, scattered.estimates, strict=True)]
    assert 0.9 < np.mean(ratios) < 1.1
    assert max(ratios) < 1.6


def test_differences_at_one_place_of_the_joints_know_nothing_of_it():
    run = made(cases("null_clean", 1, 3)[0])
    assert run.design.deflection
    model = model_of(robot_file(False, False))
    found = fit(Campaign(run.readings), model, model_unknowns(model))
    assert scatter_of(found) is None
    assert with_scatter_of_joints(found) is found
