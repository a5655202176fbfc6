"""Data that can not be what they say are refused with the reason, and good data are not."""

from dataclasses import replace
from functools import cache
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np
import pytest
from effect_cases import TOOL, made, random_arm, sampled, with_terms
from measured import arm, on_markers, plan, read, robot, scattered

from postproc.base.findings import Refusal
from postproc.base.units import DEG
from postproc.identification.campaign import Campaign
from postproc.identification.sanity_checks import check_fit, check_numbers
from postproc.identification.unknowns import FitRequest, asked_for
from postproc.measurements import Readings
from postproc.model import StiffnessModel

SIGMA = 3e-5
"""[m]"""

PAIRS = list(combinations(range(3), 2))


class Case(NamedTuple):
    readings: Readings
    asked: FitRequest


@cache
def good(kind):
    """Good data of three joints: ``deflections``, or places in ``tracker`` or ``robot`` frame."""
    rng = np.random.default_rng(1)
    described = arm(random_arm(rng, "rrr"))
    model = StiffnessModel(described, ())
    if kind == "deflections":
        asked = asked_for(model, ["joint_compliance"])
        truth = asked.model.with_values({u.key: 20.0 * u.parameter.scale for u in asked.unknowns})
    else:
        asked = asked_for(model, ["joint_offset"])
        truth = asked.model.with_values({u.key: 2e-3 for u in asked.unknowns})
    wrench = np.zeros((10, 6))
    if kind == "deflections":
        wrench[:, :3] = 1500.0 * rng.normal(size=(10, 3))
    q, wrench, words = on_markers(rng.uniform(-2.0, 2.0, (10, 3)), wrench)
    readings = plan(
        described, q, wrench, kind == "deflections", kind == "robot", sigma=SIGMA, tool=TOOL, **words
    )
    return Case(scattered(read(truth, readings, rng), SIGMA, rng), asked)


def looked_at(readings, asked):
    """The findings on readings, or those of their refusal."""
    try:
        check_numbers(readings, asked.unknowns, asked.model)
        return check_fit(Campaign(readings), asked.model, asked.unknowns)
    except Refusal as refusal:
        return refusal.findings


def refused(readings, asked, code):
    """The message of the one finding, which must be an error of ``code``."""
    (finding,) = looked_at(readings, asked)
    assert (finding.code, finding.severity) == (code, "error")
    assert finding.help
    return finding.message


@pytest.mark.parametrize("kind", ["deflections", "tracker", "robot"])
def test_good_data_pass(kind):
    assert looked_at(*good(kind)) == ()


# What the numbers alone show


@pytest.mark.parametrize("kind", ["deflections", "tracker"])
def test_radians(kind):
    readings, asked = good(kind)
    message = refused(replace(readings, q=readings.q * DEG), asked, "IDN010")
    assert message.endswith("are they in radians?")


def test_a_sliding_joint_has_no_radians():
    """Its metres are small numbers by right, and two turning ones within a degree of zero are only alike."""
    described = arm(random_arm(np.random.default_rng(2), "prr"))
    asked = asked_for(StiffnessModel(described, ()), ["joint_offset"])
    q = np.random.default_rng(3).uniform(-1.0, 1.0, (10, 3)) * [0.05, 0.1 * DEG, 0.1 * DEG]
    readings = plan(described, q, None, False, True, tool=TOOL)
    check_numbers(readings, asked.unknowns, asked.model)


@pytest.mark.parametrize("kind", ["deflections", "tracker"])
def test_all_poses_alike(kind):
    readings, asked = good(kind)
    shake = 0.2 * DEG * np.random.default_rng(4).uniform(-1, 1, readings.q.shape)
    message = refused(replace(readings, q=readings.q[:1] + shake), asked, "IDN011")
    assert "no joint moves by more than 0.3" in message or "no joint moves by more than 0.4" in message


@pytest.mark.parametrize(("factor", "unit"), [(1e-3, "metres"), (1e3, "micrometres")])
def test_deflections_of_no_robot(factor, unit):
    readings, asked = good("deflections")
    message = refused(replace(readings, value=readings.value * factor), asked, "IDN012")
    assert f"are they in {unit}," in message


def test_deflections_without_a_load():
    readings, asked = good("deflections")
    message = refused(replace(readings, wrench=0.0 * readings.wrench), asked, "IDN013")
    assert message == "the file has deflections, but no row has a load"


def test_a_load_that_never_changes_says_nothing_of_absolute_places():
    """Of deflections it does, and of what no load is needed for."""
    always = np.tile([0.0, 0.0, -2000.0, 0.0, 0.0, 0.0], (30, 1))
    readings, asked = good("robot")
    elastic = asked_for(StiffnessModel(asked.model.robot, ()), ["joint_compliance", "joint_offset"])
    loaded = replace(readings, wrench=always)
    message = refused(loaded, elastic, "IDN013")
    assert "the wrench is the same in all rows: its effect on joint_compliance cannot be separated" in message
    check_numbers(loaded, asked.unknowns, asked.model)
    deflections, compliance = good("deflections")
    check_numbers(replace(deflections, wrench=always), compliance.unknowns, compliance.model)


def test_loads_that_change_are_fine():
    readings, _ = good("robot")
    elastic = asked_for(StiffnessModel(good("robot").asked.model.robot, ()), ["joint_compliance"])
    wrench = np.zeros((30, 6))
    wrench[::3, 2] = -2000.0
    check_numbers(replace(readings, wrench=wrench), elastic.unknowns, elastic.model)


# What shows in how badly they fit


@pytest.mark.sample(2)
@pytest.mark.parametrize(("a", "b"), PAIRS)
@pytest.mark.parametrize("kind", ["deflections", "tracker", "robot"])
def test_exchanged_columns_of_joints(kind, a, b):
    readings, asked = good(kind)
    q = readings.q.copy()
    q[:, [a, b]] = q[:, [b, a]]
    message = refused(replace(readings, q=q), asked, "IDN014")
    assert f"with the columns of J{a + 1} and J{b + 1} exchanged (" in message


@pytest.mark.sample(2)
@pytest.mark.parametrize("order", [order for order in permutations(range(3)) if order != (0, 1, 2)])
@pytest.mark.parametrize("kind", ["deflections", "robot"])
def test_exchanged_columns_of_what_was_measured(kind, order):
    readings, asked = good(kind)
    message = refused(replace(readings, value=readings.value[:, list(order)]), asked, "IDN014")
    letters = np.array(["DX", "DY", "DZ"] if kind == "deflections" else ["X", "Y", "Z"])
    still = [k for k in range(3) if order[k] == k]
    if still:
        one, other = (letters[k] for k in range(3) if k not in still)
        assert f"with {one} and {other} exchanged (" in message
    else:
        assert f"with the columns named {', '.join(letters[list(order)])} (" in message


@pytest.mark.sample(1)
@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_exchanged_columns_of_forces(a, b):
    readings, asked = good("deflections")
    wrench = readings.wrench.copy()
    wrench[:, [a, b]] = wrench[:, [b, a]]
    message = refused(replace(readings, wrench=wrench), asked, "IDN014")
    assert f"with F{'XYZ'[a]} and F{'XYZ'[b]} exchanged (" in message


def test_the_opposite_sign():
    readings, asked = good("deflections")
    message = refused(replace(readings, value=-readings.value), asked, "IDN014")
    assert "with the opposite sign of all deflections (unloaded minus loaded) (" in message


@pytest.mark.parametrize(("kind", "axis"), [("deflections", 0), ("deflections", 1), ("robot", 2)])
def test_the_opposite_sign_of_one_coordinate(kind, axis):
    readings, asked = good(kind)
    letter = f"{'D' if kind == 'deflections' else ''}{'XYZ'[axis]}"
    value = readings.value * np.where(np.arange(3) == axis, -1.0, 1.0)
    message = refused(replace(readings, value=value), asked, "IDN014")
    assert f"with the opposite sign of {letter} (" in message


@pytest.mark.sample(2)
@pytest.mark.parametrize("change", ["mirrored", "exchanged"])
@pytest.mark.parametrize("axis", range(3))
def test_a_mirrored_tracker(change, axis):
    """No tracker is left-handed, however it stands; which of its axes is wrong does not show."""
    readings, asked = good("tracker")
    if change == "mirrored":
        value = readings.value * np.where(np.arange(3) == axis, -1.0, 1.0)
    else:
        value = readings.value.copy()
        value[:, [axis, axis - 1]] = value[:, [axis - 1, axis]]
    message = refused(replace(readings, value=value), asked, "IDN014")
    assert "with two of X, Y, Z exchanged, or one of them with the other sign (" in message


@pytest.mark.sample(2)
@pytest.mark.parametrize(("unit", "size"), [("metres", 1e-3), ("inches", 1 / 25.4), ("micrometres", 1e3)])
@pytest.mark.parametrize("kind", ["tracker", "robot"])
def test_places_in_another_unit(kind, unit, size):
    readings, asked = good(kind)
    message = refused(replace(readings, value=readings.value * size), asked, "IDN014")
    assert f"with positions in {unit} (" in message


@pytest.mark.parametrize("kind", ["deflections", "tracker", "robot"])
@pytest.mark.parametrize("joint", [1, 2])
def test_the_opposite_sign_of_a_joint(kind, joint):
    readings, asked = good(kind)
    q = readings.q * np.where(np.arange(3) == joint, -1.0, 1.0)
    message = refused(replace(readings, q=q), asked, "IDN014")
    assert f"with the opposite sign of J{joint + 1} (" in message


def test_a_target_elsewhere_than_stated():
    readings, asked = good("tracker")
    first, other = readings.targets[:2]
    moved = {**readings.places, first: readings.places[first] + [0.0, 0.08, 0.1]}
    message = refused(replace(readings, places=moved), asked, "IDN014")
    assert f"with another place of target {first} than the stated one (" in message
    changed = {**readings.places, first: readings.places[other], other: readings.places[first]}
    message = refused(replace(readings, places=changed), asked, "IDN014")
    assert f"with the targets {first} and {other} exchanged (" in message


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_places_of_some_rows_in_another_unit(size):
    readings, asked = good("tracker")
    value = readings.value.copy()
    value[6:12] *= size
    message = refused(replace(readings, value=value), asked, "IDN012")
    assert "are X, Y, Z of some rows in another unit?" in message


def test_of_posed_readings_the_places_are_looked_at():
    readings, asked = good("robot")
    turned = np.tile(np.eye(3), (len(readings), 1, 1))
    posed = replace(readings, rotation=turned)
    assert looked_at(posed, asked) == ()
    message = refused(replace(posed, value=readings.value[:, [1, 0, 2]]), asked, "IDN014")
    assert "with X and Y exchanged (" in message


def test_readings_of_another_robot_are_told_and_not_explained():
    """Nothing in the file is wrong then."""
    readings, asked = good("tracker")
    other = arm(random_arm(np.random.default_rng(99), "rrr"))
    asked = asked_for(StiffnessModel(other, ()), ["joint_offset"])
    (finding,) = looked_at(readings, asked)
    assert (finding.code, finding.severity) == ("IDN015", "warning")
    readings, _ = good("deflections")
    asked = asked_for(StiffnessModel(other, ()), ["joint_compliance"])
    (finding,) = looked_at(readings, asked)
    assert finding.code == "IDN015"
    assert "% of the deflections remain" in finding.message


@pytest.mark.parametrize("place", [0.0, 1.25])
def test_one_place_for_all_poses_is_no_measurement(place):
    readings, asked = good("tracker")
    still = replace(readings, value=np.full_like(readings.value, place))
    with pytest.raises(Refusal) as caught:
        check_numbers(still, asked.unknowns, asked.model)
    assert caught.value.findings[0].code == "MEA002"
    assert f"({1e3 * place:g}, " in caught.value.findings[0].message


def test_exchanged_columns_of_a_real_robot():
    readings, asked = campaign("kuka_kr270", "deflections", np.random.default_rng(5))
    message = refused(replace(readings, q=readings.q[:, [0, 1, 2, 4, 3, 5]]), asked, "IDN014")
    assert "the columns of A4 and A5 exchanged" in message


@pytest.mark.slow
def test_exchanged_columns_of_a_wrist():
    """The tracker sees some 20 mm of it."""
    readings, asked = campaign("ur5", "tracker", np.random.default_rng(7))
    message = refused(replace(readings, q=readings.q[:, [0, 1, 2, 3, 5, 4]]), asked, "IDN014")
    assert "with the columns of J5 and J6 exchanged (" in message


def test_scatter_that_is_stated_is_no_bad_fit():
    readings, asked = good("deflections")
    loud = scattered(readings, 2e-3, np.random.default_rng(8))
    assert looked_at(replace(loud, sigma=np.full(len(loud), 2e-3)), asked) == ()
    (finding,) = looked_at(replace(loud, sigma=np.full(len(loud), np.nan)), asked)
    assert finding.code == "IDN015"


# No false alarm

SOFT = {"kuka_kr270": 1.0, "ur5": 30.0, "abb_irb120": 20.0}
"""Compliance of the joints in the usual size of the parameter."""

FORCE = {"kuka_kr270": 2600.0, "ur5": 50.0, "abb_irb120": 30.0}
"""[N]"""


def campaign(name, kind, rng, missing=(), poses=9, hung=True):
    """Good data of a robot with the effects ``missing`` from the model that is fitted: (effect, values)."""
    described = robot(name)
    bare = StiffnessModel(described, ())
    words = ["joint_compliance"] if kind == "deflections" else ["link_geometry", "joint_offset"]
    asked = asked_for(bare, words)
    soft = asked_for(bare, ["joint_compliance"])
    truth = soft.model.with_values(
        {u.key: SOFT[name] * u.parameter.scale * rng.uniform(3.0, 30.0) for u in soft.unknowns}
    )
    truth = with_terms(truth, *missing)
    wrench = np.zeros((poses, 6))
    if kind == "deflections":
        wrench[:, 2] = -FORCE[name]
        if not hung:
            wrench[:, :3] = FORCE[name] * rng.normal(size=(poses, 3))
    low, high = np.clip(described.limits, -np.pi, np.pi).T
    q, wrench, words = on_markers(rng.uniform(low, high, (poses, 6)), wrench)
    if kind != "deflections":
        words["places"] = {}
    readings = plan(described, q, wrench, kind == "deflections", sigma=SIGMA, tool=TOOL, **words)
    return Case(scattered(read(truth, readings, rng), SIGMA, rng), asked)


def lacking(names, joints, rng):
    return [(made(name, joints), sampled(made(name, joints), rng)) for name in names]


def out_of_true(joints, rng):
    """1 mm and 1 mrad in every dimension of the arm."""
    effects = [made(name, joints) for name in ("link_geometry", "joint_offset", "tool_offset")]
    return [(e, {p.name: float(1e-3 * rng.normal()) for p in e.parameters}) for e in effects]


@pytest.mark.slow
@pytest.mark.parametrize("name", SOFT)
def test_no_false_alarm(name):
    """50 campaigns of three robots: hung or pushed, with and without what the model does not know."""
    rng, joints = np.random.default_rng(6), robot(name).joints
    some = ["base_compliance", "link_compliance"]
    cases = [campaign(name, "deflections", rng) for _ in range(3)]
    cases += [campaign(name, "deflections", rng, hung=False) for _ in range(3)]
    cases += [campaign(name, "deflections", rng, lacking(some[:1], joints, rng)) for _ in range(3)]
    cases += [campaign(name, "deflections", rng, lacking(some, joints, rng), hung=False) for _ in range(2)]
    cases += [campaign(name, "tracker", rng) for _ in range(4)]
    cases += [campaign(name, "tracker", rng, out_of_true(joints, rng)) for _ in range(2)]
    told = [looked_at(*case) for case in cases]
    assert [findings for findings in told if findings] == []
