"""Parameters that the readings do not ask for stay where the robot file states them."""

from dataclasses import replace

import numpy as np
import pytest
from blind import measured
from blind.arm import model_of, robot_file
from blind.real_worlds import campaign
from test_diagnosis import linear_problem

from postproc.diagnosis.search import model_unknowns
from postproc.diagnosis.selection import explained, gain_by_chance, probability
from postproc.diagnosis.unmoved_parameters import restore_unmoved_parameters
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit


def fitted(off, seed=1, sigma=2e-5, weights=False):
    """A file that states all of its geometry, its fit to readings of an arm whose parameters are ``off`` (SI), and that
    arm."""
    model = model_of(robot_file(True, weights))
    design = replace(campaign(np.random.default_rng(seed), 30, stated=True), jitter=0.0)
    rng = np.random.default_rng(seed)
    empty = Campaign(measured.readings(design, np.zeros((len(design.q) * design.points, 3)), sigma))
    names = {f"{t.effect.name}.{p}": (i, p) for i, t in enumerate(model.terms) for p in t.values}
    true = model.with_values({names[name]: value for name, value in off.items()})
    at = empty.predicted(true)
    given = empty.start()
    value = -empty.residual(at, given)[:, :3]
    value += sigma * rng.normal(size=value.shape)
    seen = Campaign(replace(empty.readings, value=value))
    return model, fit(seen, model, model_unknowns(model)), true


def moved(model, found):
    """Parameters of a fit that are not where the file has them."""
    return {
        f"{t.effect.name}.{p}"
        for k, t in enumerate(found.model.terms)
        for p, v in t.values.items()
        if v != model.terms[k].values[p]
    }


def test_one_length_moves_alone():
    model, every, true = fitted({"link_geometry.dx4": 2e-4})
    assert len(moved(model, every)) > 15
    found = restore_unmoved_parameters(every)
    assert moved(model, found) == {"link_geometry.dx4"}
    (one,) = (e for e in found.estimates if e.unknown.name == "link_geometry.dx4")
    assert abs(one.value - 2e-4) < 5e-6
    # that the others are not asked for does not make them exact
    (beside,) = (e for e in every.estimates if e.unknown.name == "link_geometry.dx4")
    assert one.ci95 == pytest.approx(beside.ci95, rel=1e-3)
    # poses that were not measured are predicted better
    q = model.robot.limits.mean(axis=1) + 0.7 * np.random.default_rng(3).normal(size=(50, 6))
    tool = every.campaign.tool
    places = [
        m.equilibrium(q, np.zeros((50, 6)), tool).pose.position for m in (true, every.model, found.model)
    ]
    error = [np.sqrt(np.mean((place - places[0]) ** 2)) for place in places[1:]]
    assert error[1] < 0.6 * error[0]


def test_a_geometry_that_is_off_everywhere_is_fitted_everywhere():
    rng = np.random.default_rng(4)
    names = [f"link_geometry.{d}{j}" for j in (2, 3, 4, 5) for d in ("dx", "dy", "rx", "ry")]
    model, every, _ = fitted(dict(zip(names, rng.normal(0.0, 5e-4, len(names)), strict=True)))
    found = restore_unmoved_parameters(every)
    assert len(moved(model, found)) >= 12
    weights = every.plain_weights
    squares = [float((weights(one.point.residual) ** 2).sum()) for one in (every, found)]
    assert squares[1] < 1.05 * squares[0]


def test_nothing_moves_where_nothing_is_off():
    model, every, _ = fitted({})
    assert moved(model, restore_unmoved_parameters(every)) == set()


@pytest.mark.slow
def test_compliances_and_weights_that_are_as_stated_stay():
    model, every, _ = fitted({"link_geometry.dx4": 2e-4}, weights=True)
    assert {"joint_compliance.c2", "link_gravity.mx2"} <= moved(model, every)
    found = moved(model, restore_unmoved_parameters(every))
    # of forty that are tried one or the other explains its price by chance
    assert "link_geometry.dx4" in found
    assert len(found) < len(moved(model, every)) / 4


def test_what_all_together_leave_undetermined_does_not_come_in_by_holding_others():
    """Weights of neighbouring links trade off: with one of them taken as stated the other would look well determined,
    beside an interval that knows nothing of that."""
    model, every, _ = fitted({"link_gravity.mx2": 390.0, "joint_compliance.c2": 3e-7}, weights=True)
    left = {u.key for u in every.asked} - {u.key for u in every.unknowns}
    assert {model.terms[term].effect.name for term, _ in left} >= {"link_gravity"}
    found = restore_unmoved_parameters(every)
    assert found is not every
    assert {u.key for u in found.unknowns} <= {u.key for u in every.unknowns}
    assert all(found.model.terms[t].values[p] == model.terms[t].values[p] for t, p in left)


@pytest.mark.parametrize("clusters", [8, 15, 200])
def test_chance_of_readings_that_share_errors_is_that_of_few_poses(clusters):
    """The share of draws in which readings of one pose, whose error is estimated from as many, explain as much."""
    given = replace(linear_problem(3000, 1.0), clusters=clusters)
    rng = np.random.default_rng(2)
    z, spread = rng.normal(size=200_000), rng.chisquare(clusters - 1, 200_000) / (clusters - 1)
    for gain in (4.0, 10.0):
        wanted = np.mean(z**2 / spread > gain)
        assert probability(given, gain, 1, 1.0, given.freedom) == pytest.approx(wanted, rel=0.15, abs=2e-5)
    limit = gain_by_chance(given, 1, given.freedom, 45)
    assert probability(given, limit, 1, 1.0, given.freedom) * 45 == pytest.approx(0.001, rel=1e-6)
    alone = replace(given, clusters=0)
    assert gain_by_chance(alone, 1, 1, 45) < limit
    assert explained(given, ()).squares == explained(alone, ()).squares
