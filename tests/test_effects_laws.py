"""Laws of what an effect says of itself: bounds, sizes, units, options, the forms in which it is looked for."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from effect_cases import conditions, elastic, made, nulls, random_arm, with_terms
from plant import kr270, random_angles, random_tools, random_wrenches

from postproc.base.findings import Refusal
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.base.yaml_section import parsed
from postproc.effects import EFFECTS, ChainState, Conditions, Offset
from postproc.effects.effect import Parameter

ARMS = {
    "kr270": lambda: kr270().joints,
    "any six": lambda: random_arm(np.random.default_rng(6)),
    "on a linear axis": lambda: random_arm(np.random.default_rng(7), "prrrrrr"),
}
arms = pytest.mark.parametrize("arm", ARMS)
names = pytest.mark.parametrize("name", EFFECTS)


def digits_of(number):
    """The decimal digits that count, and the power of ten: 0.02 is (2, -2)."""
    mantissa, _, power = f"{number:.12e}".partition("e")
    digits = mantissa.replace(".", "").rstrip("0")
    return int(digits or "0"), int(power)


def options(text):
    return parsed(text.encode(), Path("options.yaml"))


# Bounds and sizes


def test_a_parameter_without_bounds_may_be_any_number():
    free = Parameter("share", "1", 0.0)
    assert (free.lower, free.upper) == (-math.inf, math.inf)
    assert free.plausible == (0.0, math.inf)
    assert not free.hardware


@names
def test_dimensions_of_hardware_are_those_of_a_drawing(name):
    """They are taken from the robot file, and change nothing by themselves: all else of the effect is a fit's."""
    effect = made(name, kr270().joints)
    hardware = {one.name for one in effect.parameters if one.hardware}
    assert hardware == ({"L", "a_x", "a_y", "h"} if name == "gravity_compensator" else set())
    assert all(one.unit == "m" for one in effect.parameters if one.hardware)


def has_one_sign(effect, parameter):
    """Compliances, stiffnesses, masses, gaps, and the lengths of a spring."""
    return (
        parameter.unit in ("m/N", "rad/(N m)", "N/m", "N m/rad3", "N/m3", "kg")
        or effect.family == "gear"
        or parameter.name in ("s0", "L")
    )


@arms
@names
def test_bounds_are_round_and_even_about_the_null(name, arm):
    """A quantity that may have either sign has the same room on both sides; one that may not begins at its null."""
    effect = made(name, ARMS[arm]())
    for p in effect.parameters:
        assert p.null == 0.0
        assert p.lower == (0.0 if has_one_sign(effect, p) else -p.upper), p
        assert digits_of(p.upper)[0] in (1, 2, 5), p


def test_a_foundation_may_give_way_ten_times_more_in_turns():
    """1e-5 m/N and 1e-4 rad/(N m): the bounds of what a robot file may say."""
    for p in made("base_compliance", kr270().joints).parameters:
        assert p.upper == {"m/N": 1e-5, "rad/(N m)": 1e-4}[p.unit]


@arms
@names
def test_sizes_are_round_and_within_the_bounds(name, arm):
    for p in made(name, ARMS[arm]()).parameters:
        assert digits_of(p.scale)[0] in (1, 2, 3, 5, 6), p
        assert 0.0 < p.scale <= p.upper, p


UNITS_OF_SIZE = {
    "1": (-5, -1),
    "m": (-4, 0),
    "rad": (-5, -2),
    "kg": (0, 3),
    "kg m": (0, 3),
    "N": (0, 3),
    "N m": (0, 3),
}
"""Unit -> the powers of ten between which something is felt on an arm, and leaves it standing."""


@names
def test_sizes_are_of_the_order_of_an_arm(name):
    for p in made(name, kr270().joints).parameters:
        if p.unit in UNITS_OF_SIZE:
            low, high = UNITS_OF_SIZE[p.unit]
            assert 10.0**low <= p.scale <= 10.0**high, p


@names
def test_sizes_are_felt_and_leave_the_arm_standing(name):
    """Under a heavy load an effect of one size moves the tool by 1 um to 100 mm."""
    rng = np.random.default_rng(30)
    base = elastic(kr270(), rng)
    effect = made(name, base.robot.joints)
    q, wrench, tool = random_angles(kr270(), 10, rng), 5 * random_wrenches(10, rng), random_tools(10, rng)
    given = conditions(10, rng)
    sizes = {p.name: p.scale for p in effect.parameters}
    without = with_terms(base, (effect, nulls(effect))).equilibrium(q, wrench, tool, given)
    moved = with_terms(base, (effect, sizes)).equilibrium(q, wrench, tool, given)
    assert moved.converged.all()
    way = np.linalg.norm(moved.pose.position - without.pose.position, axis=1).max()
    assert 1e-6 < way < 0.1


def test_a_size_is_that_of_the_unit_where_none_is_said():
    """Masses, forces and angles have one size wherever they occur."""
    seen = {}
    for name in EFFECTS:
        for p in made(name, kr270().joints).parameters:
            if not p.size:
                assert seen.setdefault(p.unit, p.scale) == p.scale
            else:
                assert p.scale == p.size


# Units


TURNS = ("rx", "ry", "rz")


@arms
@names
def test_units_are_those_of_the_coordinates(name, arm):
    """An offset of a turn is an angle, one of a shift a length; compliances are that per moment or force."""
    joints = {joint.name: joint for joint in ARMS[arm]()}
    effect = made(name, tuple(joints.values()))
    for p in effect.parameters:
        turning = p.joint and joints[p.joint].kind == "revolute"
        match p.unit:
            case "rad" | "m" if effect.family == "geometric" and len(effect.coordinates) == len(
                effect.parameters
            ):
                coordinate = effect.coordinates[effect.parameters.index(p)]
                assert (p.unit == "rad") == (coordinate.rpartition(".")[2] in TURNS), p
            case "rad/(N m)" | "m/N" if effect.coordinates and name != "tool_compliance":
                coordinate = effect.coordinates[effect.parameters.index(p)]
                assert (p.unit == "rad/(N m)") == (coordinate.rpartition(".")[2] in TURNS), p
            case "rad" | "rad/(N m)" | "N m/rad3" if p.joint:
                assert turning or name == "link_geometry", p
            case "m/N" | "N/m3":
                assert not turning, p


@arms
@names
def test_a_number_in_a_name_is_that_of_the_joint(name, arm):
    """c3 is of the third joint, r54 of the fifth: counted from one."""
    joints = ARMS[arm]()
    number = {joint.name: str(i) for i, joint in enumerate(joints, 1)}
    for p in made(name, joints).parameters:
        counted = p.name.partition("_")[0].lstrip("abcdefghijklmnopqrstuvwxyz")[:1]
        if counted.isdigit() and p.joint and name != "gravity_compensator":
            assert counted == number[p.joint], p


# Options


@names
def test_options_come_back_as_they_are_described(name):
    """Every form in which an effect is looked for can be said in a robot file."""
    joints = kr270().joints
    for form in (EFFECTS[name](joints), *EFFECTS[name].variants(joints)):
        said = "".join(f"{key}: {value}\n" for key, value in form.described().items())
        again = EFFECTS[name].from_options(options(said or "{}"), joints)
        assert again.described() == form.described()
        assert again.parameters == form.parameters
        assert again.coordinates == form.coordinates


STATED = {
    "backlash": "friction: 31.5\n",
    "gravity_compensator": "joint: A3\npreload: acting\nsign: as_printed\nzero_deg: 12.5\n",
    "thermal_growth": "variable: temperature\nreference: 21.5\n",
    "transmission_error": "harmonics: [3.5]\n",
}
"""Options of the effects that have some: all of them, none at what it is without."""


@names
def test_every_option_is_described(name, compensate, tmp_path):
    """Also where a robot file is shown; which options there are is said where one is not known."""
    text, joints = STATED.get(name, ""), kr270().joints
    with pytest.raises(Refusal) as refused:
        EFFECTS[name].from_options(options("no_such_option: 1"), joints)
    known = set(re.findall(r"\w+", refused.value.findings[0].help.partition(": ")[2]))
    stated = {line.partition(": ")[0]: line.partition(": ")[2] for line in text.splitlines()}
    assert set(stated) == known
    effect = EFFECTS[name].from_options(options(text or "{}"), joints)
    assert {key: str(value) for key, value in effect.described().items()} == stated
    if not stated:
        return
    head = Path("robots/kuka_kr270.yaml").read_text().partition("\neffects:")[0]
    file = tmp_path / "robot.yaml"
    braces = ", ".join(f"{key}: {value}" for key, value in stated.items())
    file.write_text(f"{head}\neffects:\n  - effect: {name}\n    options: {{{braces}}}\n")
    shown = " ".join(compensate("robots", file).out.split())
    assert all(f"{key} {value}" in shown for key, value in stated.items())
    (page,) = compensate("robots", file, "--json", "-").json["robots"][0]["effects"].values()
    assert {key: str(page[key]) for key in stated} == stated


@names
def test_options_that_are_not_there_are_refused(name):
    with pytest.raises(Refusal):
        EFFECTS[name].from_options(options("no_such_option: 1"), kr270().joints)


@pytest.mark.parametrize(
    ("name", "option", "default", "low", "high", "rest"),
    [
        ("backlash", "friction", 20.0, 0.1, 1e5, ""),
        ("gravity_compensator", "zero_deg", 0.0, -360.0, 360.0, "joint: A2\n"),
    ],
)
def test_numbers_of_options_have_bounds_that_still_hold(name, option, default, low, high, rest):
    joints = kr270().joints

    def read(text):
        return EFFECTS[name].from_options(options(rest + text), joints).described()[option]

    assert read("" if rest else "{}") == pytest.approx(default)
    assert EFFECTS[name](joints).described()[option] == pytest.approx(default)
    for number in (low, high):
        assert read(f"{option}: {number!r}") == pytest.approx(number, rel=1e-15)
        beyond = number + math.copysign(1e-6 * abs(number), number - default)
        with pytest.raises(Refusal) as refused:
            read(f"{option}: {beyond!r}")
        assert refused.value.findings[0].line == len(rest.splitlines()) + 1


@pytest.mark.parametrize("said", ["[0]", "[-0.5]", "[1, 1]", "[2, 1, 2]", "[1, -1]"])
def test_harmonics_are_positive_and_each_once(said):
    with pytest.raises(Refusal) as refused:
        EFFECTS["transmission_error"].from_options(options(f"harmonics: {said}"), kr270().joints)
    assert refused.value.findings[0].code == "YML004"


@pytest.mark.parametrize("said", [[1.0], [0.5], [1.0, 2.0, 17.5]])
def test_harmonics_are_those_that_are_said(said):
    effect = EFFECTS["transmission_error"].from_options(options(f"harmonics: {said}"), kr270().joints)
    assert effect.described() == {"harmonics": said}


# Forms


def test_a_compensator_is_looked_for_across_the_second_turning_joint():
    """The shoulder, whatever carries the arm; an arm with one turning joint has none."""
    form = EFFECTS["gravity_compensator"]
    for kinds, joint in (("rrrrrr", "J2"), ("prrrrrr", "J3"), ("rr", "J2"), ("rpr", "J3"), ("pprr", "J4")):
        (found,) = form.variants(random_arm(np.random.default_rng(8), kinds))
        assert found.described() == {"joint": joint, "preload": "balanced", "sign": "energy", "zero_deg": 0.0}
    for kinds in ("r", "ppr", "pp"):
        assert form.variants(random_arm(np.random.default_rng(8), kinds)) == ()


def test_a_compensator_that_is_described_is_at_its_joint():
    form, joints = EFFECTS["gravity_compensator"], kr270().joints
    for name in (None, *(joint.name for joint in joints)):
        found = form.of_mechanism(joints, name, {"zero": 0.25})
        assert found.described()["joint"] == (name or joints[1].name)
        assert found.zero == 0.25
    assert form.of_mechanism(joints, None, {}).zero == 0.0


def test_a_gear_is_looked_for_with_one_wave_a_turn_and_with_two():
    found = EFFECTS["transmission_error"].variants(kr270().joints)
    assert [form.described() for form in found] == [{"harmonics": [1.0]}, {"harmonics": [2.0]}]


def test_growth_is_looked_for_with_the_temperature_and_with_the_time():
    found = EFFECTS["thermal_growth"].variants(kr270().joints)
    assert [form.described() for form in found] == [{"variable": "temperature"}, {"variable": "time"}]
    assert [{p.unit for p in form.parameters} for form in found] == [{"m/K"}, {"m/s"}]


def test_a_link_without_length_does_not_grow():
    """Joints that stand at one place have nothing between them; a micrometre is something."""
    joints = list(random_arm(np.random.default_rng(9)))
    for number, length in ((1, 0.0), (3, 1e-6)):
        place = joints[number].placement
        joints[number] = type(joints[number])(
            joints[number].name, Poses(place.rotation, np.array([0.0, length, 0.0])), -2.5, 2.5, "revolute"
        )
    assert [p.name for p in made("thermal_growth", joints).parameters] == ["g1", "g3", "g4", "g5", "g6"]


@pytest.mark.parametrize("heading", [0.0, 0.7, 0.5 * np.pi, 4.0])
def test_a_first_joint_carries_weight_where_its_axis_leans(heading):
    """To whatever side; about the vertical it only turns."""
    first, *others = kr270().joints
    for turn, leans in (
        ([0, 0, heading], False),
        (0.01 * np.array([np.cos(heading), np.sin(heading), 0]), True),
    ):
        place = Poses(
            rotation_from_vector(np.array(turn)) @ first.placement.rotation, first.placement.position
        )
        effect = made("gravity_sag", (replace(first, placement=place), *others))
        assert ({p.joint for p in effect.parameters} == {joint.name for joint in (first, *others)}) == leans
        assert {joint.name for joint in others} <= {p.joint for p in effect.parameters}


@names
def test_gaps_are_those_of_the_joints_one_by_one(name):
    effect = made(name, kr270().joints)
    if effect.by_direction:
        values = {p.name: 1e-4 * number for number, p in enumerate(effect.parameters)}
        np.testing.assert_array_equal(effect.gaps(values), list(values.values()))


# What acts


@pytest.mark.parametrize("missing", ["payload_mass", "payload_com"])
def test_a_weight_without_its_centre_is_not_guessed(missing):
    rng = np.random.default_rng(31)
    base = elastic(kr270(), rng)
    payload = made("payload", base.robot.joints)
    model = with_terms(base, (payload, nulls(payload)))
    q, wrench, tool = random_angles(kr270(), 5, rng), random_wrenches(5, rng), random_tools(5, rng)
    stated = {"payload_mass": np.full(5, 40.0), "payload_com": np.full((5, 3), 0.1)}
    without = model.equilibrium(q, wrench, tool, Conditions())
    one = model.equilibrium(q, wrench, tool, Conditions(**{**stated, missing: None}))
    assert np.array_equal(one.coordinates, without.coordinates)
    both = model.equilibrium(q, wrench, tool, Conditions(**stated))
    assert not np.array_equal(both.coordinates, without.coordinates)


@pytest.mark.parametrize("name", [name for name, effect in EFFECTS.items() if issubclass(effect, Offset)])
def test_offsets_are_linear_in_their_parameters(name):
    """Values of two parameters act as each alone, added; each does something."""
    rng = np.random.default_rng(32)
    base = elastic(kr270(), rng).without_effects(families=["elastic"])
    effect = made(name, base.robot.joints)
    q = random_angles(kr270(), 6, rng)
    given = conditions(6, rng)

    def offset(values):
        chain = with_terms(base, (effect, values)).chain
        out = np.zeros((chain.size, 6))
        effect.add_offset(values, chain, q.T, given, out)
        return out

    every = {p.name: float(rng.uniform(-1, 1)) for p in effect.parameters}
    total = sum(offset(nulls(effect) | {name: value}) for name, value in every.items())
    np.testing.assert_allclose(offset(every), total, atol=1e-14)
    for p in effect.parameters:
        one = offset(nulls(effect) | {p.name: 1.0})
        assert one.any(), p.name
        np.testing.assert_allclose(offset(nulls(effect) | {p.name: -2.0}), -2.0 * one, atol=1e-14)


# What an effect says of itself


def test_flags_are_said_where_they_hold():
    said = {
        "whole": {"gravity_sag", "joint_compliance", "joint_offset", "link_geometry", "transmission_error"},
        "by_direction": {"backlash", "hysteresis"},
        "by_gravity": {"gravity_sag"},
    }
    for flag, those in said.items():
        assert {name for name, effect in EFFECTS.items() if getattr(effect, flag)} == those
    assert {name for name, effect in EFFECTS.items() if not effect.apart} == {"link_gravity"}
    slack = {name for name, effect in EFFECTS.items() if effect(kr270().joints).zero_without_load}
    assert slack == {
        "joint_compliance",
        "gravity_compensator",
        "base_compliance",
        "link_compliance",
        "joint_stiffening",
    }


@names
def test_only_effects_by_direction_ask_how_joints_came(name):
    rng = np.random.default_rng(33)
    base = elastic(kr270(), rng)
    effect = made(name, base.robot.joints)
    model = with_terms(base, (effect, {p.name: p.scale for p in effect.parameters}))
    q, wrench, tool = random_angles(kr270(), 8, rng), random_wrenches(8, rng), random_tools(8, rng)
    given = conditions(8, rng)
    other = replace(given, direction=-given.direction)
    one, two = (model.equilibrium(q, wrench, tool, came).coordinates for came in (given, other))
    assert np.array_equal(one, two) != effect.by_direction


@pytest.mark.parametrize("preload", ["balanced", "acting"])
def test_the_force_of_a_spring_is_the_gradient_of_its_energy_in_both_preloads(preload):
    """Acting: -dU/dq of the spring itself; balanced: less its torque at rest, which the energy then holds as well."""
    rng = np.random.default_rng(34)
    robot = kr270()
    spring = EFFECTS["gravity_compensator"](robot.joints, preload=preload)
    values = {"K_c": 2e4, "s0": 0.4, "L": 0.5, "a_x": 0.3, "a_y": -0.2, "h": 0.1}
    chain = with_terms(elastic(robot, rng), (spring, values)).chain
    rest = rng.uniform(-0.4, 0.4, (chain.size, 9))
    row, step = chain.motor_rows[1], 1e-6

    def at(moved):
        there = rest.copy()
        there[row] += moved
        none = np.zeros((6, 9))
        return ChainState(chain, np.zeros(3), rest[chain.motors], rest, there, None, none, Conditions())

    def force(moved):
        out = np.zeros_like(rest), np.zeros_like(rest)
        spring.add_force(values, at(moved), *out)
        return out[0][row]

    bent = rng.uniform(-0.2, 0.2, 9)
    slope = (spring.energy(values, at(bent + step)) - spring.energy(values, at(bent - step))) / (2 * step)
    np.testing.assert_allclose(force(bent), -slope, rtol=1e-6)
    assert np.any(force(0 * bent)) == (preload == "acting")
    assert spring.zero_without_load == (preload == "balanced")
