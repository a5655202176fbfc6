"""Registration: wherever the tracker stands and the target sits, both are found, before anything is known of them."""

from dataclasses import replace

import numpy as np
import pytest
from effect_cases import TOOL
from measured import plan, robot, scattered, somewhere, taken

from postproc.base.geometry import vector_from_rotation
from postproc.identification.campaign import Campaign
from postproc.identification.registration import registered
from postproc.model import StiffnessModel

ROUNDING = 1e-9
"""[m]"""

NAMES = ("M1", "M2", "M3")


def visit(name, count, rng, targets=(), places=(), sessions=1, posed=False, tool=TOOL):
    """A campaign of an arm that does not bend, what it sees, and where all is; ``places``: of the targets, stated."""
    described = robot(name)
    low, high = np.clip(described.limits, -np.pi, np.pi).T
    stated = {target: rng.uniform(-0.3, 0.3, 3) for target in places}
    words = {"targets": targets, "places": stated, "tool": tool}
    if targets:
        words["target"] = np.arange(count) % len(targets)
    readings = plan(described, rng.uniform(low, high, (count, 6)), None, False, **words)
    session = np.arange(count) * sessions // count
    readings = replace(readings, session=session, sessions=tuple("abc"[:sessions]))
    if posed:
        readings = replace(readings, rotation=np.full((count, 3, 3), np.nan))
    campaign, model = Campaign(readings), StiffnessModel(described, ())
    given = somewhere(campaign, rng, 0.5)
    campaign.readings = taken(campaign, model, given)
    return campaign, campaign.predicted(model), given


def left(campaign, seen, given):
    """(R, 3 or 6) residuals, of the readings that there are."""
    return np.nan_to_num(campaign.residual(seen, given))


def everything(campaign):
    return np.ones(len(campaign), bool)


@pytest.mark.slow
def test_any_turn_of_a_tracker_is_found_and_any_place_of_its_target():
    """200 draws: no turn is too far from where the search begins."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        campaign, seen, given = visit("ur5", 8, rng, ("M",))
        found = registered(campaign, seen, everything(campaign))
        assert np.abs(left(campaign, seen, found)).max() < ROUNDING
        np.testing.assert_allclose(found.places, given.places, atol=1e-6)
        np.testing.assert_allclose(found.frames.rotation, given.frames.rotation, atol=1e-6)
        np.testing.assert_allclose(found.frames.position, given.frames.position, atol=1e-6)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("places", [(), ("M1",), ("M2", "M3"), NAMES], ids=len)
@pytest.mark.parametrize("name", ["kuka_kr270", "abb_irb120"])
def test_several_targets_stated_or_not(name, places, seed):
    rng = np.random.default_rng(seed)
    campaign, seen, given = visit(name, 24, rng, NAMES, places)
    assert list(campaign.place_known) == [target in places for target in NAMES]
    found = registered(campaign, seen, everything(campaign))
    assert np.abs(left(campaign, seen, found)).max() < ROUNDING
    np.testing.assert_allclose(found.places, given.places, atol=1e-6)
    stated = campaign.place_known
    np.testing.assert_array_equal(found.places[stated], campaign.stated_places[stated])


@pytest.mark.sample(3)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("posed", [False, True])
def test_every_session_has_its_station(posed, seed):
    """The targets stay where they are."""
    rng = np.random.default_rng(seed)
    campaign, seen, given = visit("kuka_kr270", 45, rng, NAMES, ("M1",), sessions=3, posed=posed)
    found = registered(campaign, seen, everything(campaign))
    assert len(found.frames) == 3
    assert np.abs(left(campaign, seen, found)).max() < ROUNDING
    apart = vector_from_rotation(found.frames.rotation @ np.swapaxes(given.frames.rotation, 1, 2))
    assert np.abs(apart).max() < 1e-6
    np.testing.assert_allclose(found.frames.position, given.frames.position, atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_axes_of_a_target_are_found_with_its_place(seed):
    """One that is only seen from one side at that."""
    rng = np.random.default_rng(seed)
    campaign, seen, given = visit("abb_irb120", 6, rng, ("M",), posed=True)
    assert not campaign.turn_known.any()
    found = registered(campaign, seen, everything(campaign))
    assert np.abs(left(campaign, seen, found)).max() < ROUNDING
    np.testing.assert_allclose(found.turns, given.turns, atol=1e-7)


def test_the_axes_of_a_stated_tool_are_taken_as_they_are():
    campaign, seen, _ = visit("abb_irb120", 6, np.random.default_rng(5), posed=True)
    assert campaign.turn_known.all()
    assert campaign.place_known.all()
    found = registered(campaign, seen, everything(campaign))
    np.testing.assert_array_equal(found.turns, campaign.stated_turns)
    assert np.abs(left(campaign, seen, found)).max() < ROUNDING


def test_without_a_stated_tool_the_tcp_is_a_target_like_any():
    campaign, seen, given = visit("ur5", 12, np.random.default_rng(6), posed=True, tool=None)
    assert not campaign.turn_known.any()
    assert not campaign.place_known.any()
    found = registered(campaign, seen, everything(campaign))
    np.testing.assert_allclose(found.places, given.places, atol=1e-6)
    assert np.abs(left(campaign, seen, found)).max() < ROUNDING


@pytest.mark.parametrize("seed", range(6))
def test_missing_coordinates_do_no_harm(seed):
    """Nor do readings that are left out, and whole ones that are wrong among these."""
    rng = np.random.default_rng(seed)
    campaign, seen, given = visit("kuka_kr270", 30, rng, ("M",), posed=True)
    value, rotation = campaign.readings.value.copy(), campaign.readings.rotation.copy()
    value[rng.random(value.shape) < 0.2] = np.nan
    rotation[rng.random(30) < 0.3] = np.nan
    rows = rng.random(30) < 0.8
    value[~rows] = rng.normal(size=(int((~rows).sum()), 3))
    campaign.readings = replace(campaign.readings, value=value, rotation=rotation)
    found = registered(campaign, seen, rows)
    assert np.abs(left(campaign, seen, found)[rows]).max() < ROUNDING
    np.testing.assert_allclose(found.places, given.places, atol=1e-6)


def test_it_is_the_least_squares():
    """What is left is at right angles to everything that tracker and target can do, and no larger than the scatter."""
    rng, sigma = np.random.default_rng(7), 2e-3
    campaign, seen, given = visit("kuka_kr270", 40, rng, NAMES[:2])
    campaign.readings = scattered(campaign.readings, sigma, rng)
    found = registered(campaign, seen, everything(campaign))
    size = np.linalg.norm(left(campaign, seen, found))
    assert size < np.linalg.norm(left(campaign, seen, given))
    columns = campaign.nuisance_columns(seen, found).reshape(120, -1)
    # the scale of the tracker is left for the fit
    columns = (columns / np.linalg.norm(columns, axis=0))[:, :-1]
    assert np.abs(columns.T @ left(campaign, seen, found).reshape(-1)).max() < 1e-6 * size
    freedom = 120 - np.linalg.matrix_rank(columns)
    assert freedom == 120 - 12
    assert size / np.sqrt(freedom) == pytest.approx(sigma, rel=4 / np.sqrt(2 * freedom))


def test_in_the_robot_frame_nothing_is_registered():
    described, rng = robot("ur5"), np.random.default_rng(8)
    campaign = Campaign(plan(described, rng.uniform(-3, 3, (5, 6)), None, False, True, tool=TOOL))
    assert campaign.nuisance_names == ()
    model = StiffnessModel(described, ())
    campaign.readings = replace(taken(campaign, model), value=rng.normal(size=(5, 3)))
    found = registered(campaign, campaign.predicted(model), everything(campaign))
    np.testing.assert_array_equal(found.frames.rotation, [np.eye(3)])
    np.testing.assert_array_equal(found.places, campaign.stated_places)
