"""The contract of every effect, over the table: a new one is held to it without a line here."""

from dataclasses import replace

import numpy as np
import pytest
from effect_cases import (
    TOOL,
    conditions,
    elastic,
    every_coordinate,
    made,
    nulls,
    random_arm,
    sampled,
    with_terms,
)
from motions import milling_angles
from plant import kr270, random_angles, random_tools, random_wrenches
from reference import reference_flange

from postproc.base.geometry import Poses, vector_from_rotation
from postproc.base.units import UNITS
from postproc.effects import EFFECTS, ChainState, ComplianceLaw, Conditions, EnergyLoad, Load, Offset
from postproc.model import StiffnessModel, solve
from postproc.robot.chain import Chain
from postproc.robot.description import Value

NAMES = """
joint_compliance tool_compliance gravity_compensator link_gravity gravity_sag payload base_compliance link_compliance
joint_stiffening backlash hysteresis transmission_error joint_offset link_geometry joint_coupling
tool_offset base_offset thermal_growth force_sensor
"""
UPRIGHT = np.array([0.0, 0.0, -9.81])
GRAVITY = np.array([1.2, -2.3, -9.4])
"""[m/s2] not along any axis, so that no component can hide."""


def of_kind(kind):
    return [name for name, effect in EFFECTS.items() if issubclass(effect, kind)]


ARMS = {
    "kr270": lambda: kr270().joints,
    "any six": lambda: random_arm(np.random.default_rng(6)),
    "on a linear axis": lambda: random_arm(np.random.default_rng(7), "prrrrrr"),
}
arms = pytest.mark.parametrize("arm", ARMS)


def state_of(joints, rng, count=12, gravity=GRAVITY):
    """States somewhere, of a chain with every coordinate there is, all of them displaced."""
    chain = every_coordinate(joints)
    motors = rng.uniform(-1.5, 1.5, (len(joints), count))
    rest = rng.uniform(-0.05, 0.05, (chain.size, count))
    rest[chain.motors] += motors
    coordinates = rest + rng.uniform(-0.05, 0.05, rest.shape)
    given = conditions(count, rng, payload=True, joints=len(joints))
    return at(
        ChainState(chain, gravity, motors, rest, rest, None, random_wrenches(count, rng).T, given),
        coordinates,
    )


def at(state, coordinates):
    """The state with its coordinates elsewhere."""
    swept = state.chain.evaluate(coordinates, TOOL, state.conditions.spindle)
    return replace(state, coordinates=coordinates, swept=swept)


def beside(state, row, step):
    moved = state.coordinates.copy()
    moved[row] += step
    return at(state, moved)


def force_of(load, values, state):
    force, slope = np.zeros_like(state.rest), np.zeros_like(state.rest)
    load.add_force(values, state, force, slope)
    return force, slope


def displacement_of(law, values, state, force):
    displacement, slope = np.zeros_like(force), np.zeros_like(force)
    law.add_displacement(values, state, force, displacement, slope)
    return displacement, slope


def offset_of(effect, values, state):
    offset = np.zeros_like(state.rest)
    effect.add_offset(values, state.chain, state.motors, state.conditions, offset)
    return offset


def problem(count, seed, robot=None):
    """Angles, wrenches, tools and conditions; nothing hangs on the flange that no effect speaks of."""
    rng = np.random.default_rng(seed)
    robot = robot or kr270()
    return (
        random_angles(robot, count, rng),
        random_wrenches(count, rng),
        random_tools(count, rng),
        conditions(count, rng),
    )


def pose_difference(one, other):
    """(N, 6) [m, rad]"""
    turn = vector_from_rotation(one.rotation @ np.swapaxes(other.rotation, 1, 2))
    return np.concatenate([one.position - other.position, turn], axis=1)


# The table


def test_names_are_those_of_the_public_list():
    assert list(EFFECTS) == NAMES.split()
    assert [effect.name for effect in EFFECTS.values()] == NAMES.split()


@arms
@pytest.mark.parametrize("name", EFFECTS)
def test_parameters_are_described(name, arm):
    joints = ARMS[arm]()
    effect = made(name, joints)
    assert effect.parameters
    assert effect.family in ("elastic", "gear", "weight", "geometric", "sensor")
    assert isinstance(effect, Offset | Load | ComplianceLaw)
    assert effect.__doc__
    names = [parameter.name for parameter in effect.parameters]
    assert len(set(names)) == len(names)
    assert len(set(effect.coordinates)) == len(effect.coordinates)
    assert set(effect.coordinates) <= set(every_coordinate(joints).names)
    units = {si for si, _ in UNITS.values()}
    for p in effect.parameters:
        assert p.unit in units
        assert p.unit in UNITS  # a file can say it as it is
        assert UNITS[p.unit][1] == 1.0
        assert p.lower < p.upper
        assert p.lower <= p.null <= p.upper
        assert p.source
        assert not p.joint or p.joint in [joint.name for joint in joints]
        if p.name[-1].isdigit():
            assert p.joint


def test_table(capsys):
    joints = kr270().joints
    with capsys.disabled():
        print()
        for name in EFFECTS:
            effect = made(name, joints)
            ways = [
                word
                for kind, word in ((Offset, "offset"), (Load, "load"), (ComplianceLaw, "law"))
                if isinstance(effect, kind)
            ]
            print(
                f"{name:20} {'+'.join(ways):7} {effect.family:10} {len(effect.parameters):2} "
                f"{' '.join(p.name for p in effect.parameters)[:60]:60} {' '.join(effect.coordinates)[:40]}"
            )


# Null is absent, and every parameter does something


@pytest.mark.parametrize("name", EFFECTS)
def test_null_is_absent(name):
    base = elastic(kr270(), np.random.default_rng(1))
    effect = made(name, base.robot.joints)
    q, wrench, tool, given = problem(40, 2)
    without = base.equilibrium(q, wrench, tool, given)
    null = with_terms(base, (effect, nulls(effect)))
    here = null.equilibrium(q, wrench, tool, given)
    assert here.converged.all()
    assert np.abs(here.pose.position - without.pose.position).max() <= 3e-14
    assert np.abs(here.pose.rotation - without.pose.rotation).max() <= 1e-14
    shared = [null.chain.index[coordinate] for coordinate in base.chain.names]
    np.testing.assert_allclose(here.coordinates[:, shared], without.coordinates, rtol=1e-14, atol=1e-16)
    others = np.setdiff1d(np.arange(null.chain.size), shared)
    assert not here.coordinates[:, others].any()


@arms
@pytest.mark.parametrize("name", EFFECTS)
def test_null_writes_nothing(name, arm):
    """Neither force nor displacement nor offset; what hangs on the flange by the cell's word is no parameter."""
    rng = np.random.default_rng(3)
    joints = ARMS[arm]()
    effect, state = made(name, joints), state_of(ARMS[arm](), rng)
    given = replace(state.conditions, payload_mass=None, payload_com=None)
    state = replace(state, conditions=given)
    for written in outputs(effect, nulls(effect), state, rng):
        assert not written.any()
    assert any(written.any() for written in outputs(effect, sampled(effect, rng), state, rng))


def outputs(effect, values, state, rng):
    if isinstance(effect, Offset):
        yield offset_of(effect, values, state)
    if isinstance(effect, Load):
        yield from force_of(effect, values, state)
    if isinstance(effect, ComplianceLaw):
        yield from displacement_of(effect, values, state, rng.normal(size=state.rest.shape) * 300.0)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", EFFECTS)
def test_sensitivity_is_smooth_and_every_parameter_does_something(name):
    rng = np.random.default_rng(4)
    base = elastic(kr270(), rng)
    effect = made(name, base.robot.joints)
    values = sampled(effect, rng)
    model = with_terms(base, (effect, values))
    term, (q, wrench, tool, given) = len(model.terms) - 1, problem(15, 5)

    def pose(parameter, value):
        rest = model.with_values({(term, parameter.name): value}).equilibrium(q, 5 * wrench, tool, given)
        assert rest.converged.all()
        return rest.pose

    for parameter in effect.parameters:
        here, slopes = values[parameter.name], []
        for step in (2e-2 * abs(here), 1e-2 * abs(here)):
            ends = (pose(parameter, here + step), pose(parameter, here - step))
            slopes.append(pose_difference(*ends) / (2 * step))
        size = np.abs(slopes[1]).max()
        assert size * abs(here) > 1e-10, parameter.name
        # central differences at h and h / 2 differ by three quarters of an h^2 term
        assert np.abs(slopes[0] - slopes[1]).max() < 2e-3 * size + 1e-13 / abs(here), parameter.name


# Derivatives


@pytest.mark.sample(2)
@arms
@pytest.mark.parametrize("gravity", [GRAVITY, UPRIGHT], ids=["tilted", "upright"])
@pytest.mark.parametrize("name", of_kind(EnergyLoad))
def test_slope_of_a_load_is_the_derivative_of_its_force(name, gravity, arm):
    rng = np.random.default_rng(8)
    joints = ARMS[arm]()
    load, state = made(name, joints), state_of(joints, rng, gravity=gravity)
    values = sampled(load, rng)
    _, slope = force_of(load, values, state)
    found, scale = jacobian_of(load, values, state)
    np.testing.assert_allclose(np.einsum("iin->in", found), slope, atol=3e-8 * scale, rtol=3e-7)


@pytest.mark.parametrize("name", of_kind(Load))
def test_a_load_asks_for_places_without_load_only_if_it_says_so(name):
    rng = np.random.default_rng(5)
    joints = kr270().joints
    load = made(name, joints)
    values, state = sampled(load, rng), state_of(joints, rng)
    moved = replace(state, rest=state.rest + rng.uniform(1e-3, 2e-3, state.rest.shape))
    same = np.array_equal(force_of(load, values, state)[0], force_of(load, values, moved)[0])
    assert same != load.by_rest


def jacobian_of(load, values, state, step=1e-5):
    """(m, m, N) d force_i / d coordinate_k by central differences, and its size."""
    columns = []
    for k in range(state.chain.size):
        up, down = (force_of(load, values, beside(state, k, sign * step))[0] for sign in (1, -1))
        columns.append((up - down) / (2 * step))
    found = np.stack(columns, axis=1)
    return found, np.abs(found).max() + np.abs(force_of(load, values, state)[0]).max()


@pytest.mark.sample(4)
@arms
@pytest.mark.parametrize("name", of_kind(EnergyLoad))
def test_force_is_the_gradient_of_one_energy(name, arm):
    rng = np.random.default_rng(9)
    joints = ARMS[arm]()
    load, state = made(name, joints), state_of(joints, rng)
    values, step = sampled(load, rng), 1e-5
    force, _ = force_of(load, values, state)
    energy = load.energy(values, state)
    assert energy.shape == (state.motors.shape[1],)
    for k in range(state.chain.size):
        up, down = (load.energy(values, beside(state, k, sign * step)) for sign in (1, -1))
        np.testing.assert_allclose(
            -(up - down) / (2 * step),
            force[k],
            rtol=1e-6,
            atol=1e-7 * np.abs(force).max() + 3e-16 * np.abs(energy).max() / step,
            err_msg=state.chain.names[k],
        )
    found, scale = jacobian_of(load, values, state)
    np.testing.assert_allclose(found, np.swapaxes(found, 0, 1), atol=1e-7 * scale)


@arms
@pytest.mark.parametrize("name", of_kind(ComplianceLaw))
def test_slope_of_a_law_is_the_derivative_of_its_displacement(name, arm):
    rng = np.random.default_rng(10)
    joints = ARMS[arm]()
    law, state = made(name, joints), state_of(joints, rng)
    values = sampled(law, rng)
    force = rng.normal(size=state.rest.shape) * np.array([0.0, 1.0, 10.0, 1000.0])[rng.integers(0, 4, 12)]
    _, slope = displacement_of(law, values, state, force)
    assert (slope >= 0).all()  # nothing moves against the force
    # without load everything is slack, but for what friction holds where it came from
    idle = replace(state, conditions=replace(state.conditions, direction=None))
    assert not displacement_of(law, values, idle, 0 * force)[0].any()
    for k in range(state.chain.size):
        ends = []
        for sign in (1, -1):
            pushed = force.copy()
            pushed[k] += sign * 1e-3
            ends.append(displacement_of(law, values, state, pushed)[0])
        expected = np.zeros_like(force)
        expected[k] = slope[k]
        np.testing.assert_allclose(
            (ends[0] - ends[1]) / 2e-3, expected, rtol=1e-6, atol=1e-7 * slope.max() + 1e-16
        )


# Batches


@pytest.mark.sample(5)
@pytest.mark.parametrize("name", EFFECTS)
def test_batch_is_row_by_row(name):
    rng = np.random.default_rng(11)
    base = elastic(kr270(), rng)
    effect = made(name, base.robot.joints)
    model = with_terms(base, (effect, sampled(effect, rng)))
    q, wrench, tool, given = problem(8, 12)
    for some in (given, replace(given, payload_mass=np.full(8, 30.0), payload_com=np.full((8, 3), 0.1))):
        batch = model.equilibrium(q, wrench, tool, some)
        for i in range(8):
            row = slice(i, i + 1)
            alone = model.equilibrium(q[row], wrench[row], tool[row], some.part(row))
            assert np.abs(alone.coordinates - batch.coordinates[row]).max() < 1e-14
            assert np.abs(alone.pose.position - batch.pose.position[row]).max() < 1e-14
            assert np.abs(alone.pose.rotation - batch.pose.rotation[row]).max() < 1e-14


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", EFFECTS)
def test_chunk_borders_do_not_matter(name, monkeypatch):
    """Also where the order of the states counts: the senses of approach are found before the states are cut up."""
    rng = np.random.default_rng(13)
    base = elastic(kr270(), rng)
    effect = made(name, base.robot.joints)
    model = with_terms(base, (effect, sampled(effect, rng)))
    q, wrench, tool, given = problem(23, 14)
    for some in (given, replace(given, direction=None), Conditions()):
        whole = model.equilibrium(q, wrench, tool, some)
        with monkeypatch.context() as cut:
            cut.setattr(solve, "CHUNK", 5)
            pieces = model.equilibrium(q, wrench, tool, some)
        assert np.abs(pieces.coordinates - whole.coordinates).max() < 1e-14
        assert np.abs(pieces.pose.position - whole.pose.position).max() < 1e-14
        assert pieces.steps == whole.steps


def test_more_states_than_a_chunk():
    rng = np.random.default_rng(15)
    base = elastic(kr270(), rng)
    effects = [made(name, base.robot.joints) for name in EFFECTS]
    model = with_terms(base, *((effect, sampled(effect, rng)) for effect in effects))
    count = solve.CHUNK + 3
    q, wrench, tool, given = problem(count, 16)
    whole = model.equilibrium(q, wrench, tool, given)
    for rows in (slice(0, 4), slice(solve.CHUNK - 2, count)):
        piece = model.equilibrium(q[rows], wrench[rows], tool[rows], given.part(rows))
        assert np.abs(piece.coordinates - whole.coordinates[rows])[piece.converged].max() < 1e-13
        assert np.array_equal(piece.converged, whole.converged[rows])


# Manners


@arms
@pytest.mark.parametrize("name", EFFECTS)
def test_effects_add_and_touch_nothing_else(name, arm):
    """Inputs are read-only here, and what stands in the outputs stays in the sum."""
    rng = np.random.default_rng(17)
    joints = ARMS[arm]()
    effect, state = made(name, joints), state_of(joints, rng)
    values = sampled(effect, rng)
    swept = state.swept
    inputs = [state.gravity.copy(), state.motors, state.rest, state.coordinates, state.wrench]
    inputs += [*swept.axes, *swept.origins, swept.position, *swept.tcp, swept.flange[1], *swept.flange[0]]
    inputs += [column for link in swept.links for column in link]
    inputs += [v for v in vars(state.conditions).values() if v is not None]
    state = replace(state, gravity=inputs[0])
    force = rng.normal(size=state.rest.shape) * 300.0
    force.setflags(write=False)
    for array in inputs:
        array.setflags(write=False)
    before = dict(values)

    def call(*out):
        if isinstance(effect, Offset):
            assert effect.add_offset(values, state.chain, state.motors, state.conditions, out[0]) is None
        elif isinstance(effect, Load):
            assert effect.add_force(values, state, *out) is None
        else:
            assert effect.add_displacement(values, state, force, *out) is None

    clean = [np.zeros_like(state.rest) for _ in range(2)]
    call(*clean)
    there = [rng.normal(size=state.rest.shape) for _ in range(2)]
    sums = [array.copy() for array in there]
    call(*sums)
    for array, start, added in zip(sums, there, clean, strict=True):
        np.testing.assert_allclose(array, start + added, rtol=1e-12, atol=1e-9 * np.abs(added).max() + 1e-15)
        untouched = added == 0
        assert np.array_equal(array[untouched], start[untouched])
    assert values == before


# Laws of more than one state, by hand


def test_backlash_takes_the_side_of_the_load():
    """All gap in A2: upright arm, force straight down or up 1.33 m in front of axis 2, and none."""
    joints = kr270().joints
    law = made("backlash", joints)
    values = nulls(law) | {"b2": 1e-3}
    model = with_terms(bare(), (law, values))
    q = np.tile(np.radians([0.0, -90, 90, 0, 0, 0]), (3, 1))
    wrench = np.outer([-1.0, 1.0, 0.0], [0.0, 0, 560, 0, 0, 0])
    rest = model.equilibrium(q, wrench, Poses.identity())
    assert rest.converged.all()
    np.testing.assert_allclose(rest.displacement[:, 1], [0.5e-3, -0.5e-3, 0.0], rtol=1e-12, atol=1e-15)
    assert not np.delete(rest.displacement, 1, axis=1).any()
    # A2 turns the flange down by its lever of 1.33 m
    assert rest.pose.position[0, 2] - rest.pose.position[2, 2] == pytest.approx(-1.33 * 0.5e-3, rel=1e-3)


def test_backlash_under_a_load_within_the_transition():
    joints = kr270().joints
    law = made("backlash", joints)
    model = with_terms(bare(), (law, nulls(law) | {"b2": 1e-3}))
    q = np.radians([[0.0, -90, 90, 0, 0, 0]])
    wrench = np.array([[0.0, 0, 0, 0, 7.0, 0]])  # A2 turns about +y: 7 N m, whatever the pose
    found = model.equilibrium(q, wrench, Poses.identity()).displacement[0, 1]
    assert found == pytest.approx(0.5e-3 * 0.5 * (np.tanh(0.7 - 2) + np.tanh(0.7 + 2)), rel=1e-12)


def test_backlash_without_load_stays_on_the_side_it_came_from():
    joints = kr270().joints
    law = made("backlash", joints)
    model = with_terms(bare(), (law, nulls(law) | {"b2": 1e-3}))
    q = np.tile(np.radians([0.0, -90, 90, 0, 0, 0]), (3, 1))
    came = np.zeros((3, 6))
    came[:, 1] = [1.0, -1.0, 0.0]
    none = np.zeros((3, 6))
    rest = model.equilibrium(q, none, Poses.identity(), Conditions(direction=came))
    side = np.tanh(2.0)
    np.testing.assert_allclose(rest.displacement[:, 1], np.array([-side, side, 0.0]) * 0.5e-3, rtol=1e-12)
    heavy = np.tile([0.0, 0, -560, 0, 0, 0], (3, 1))
    pressed = model.equilibrium(q, heavy, Poses.identity(), Conditions(direction=came))
    np.testing.assert_allclose(pressed.displacement[:, 1], 0.5e-3, rtol=1e-9)


@pytest.mark.parametrize("ahead", [-1.0, -0.4, 0.0, 0.7, 1.0])
def test_backlash_within_the_gap_holds_its_place_until_the_load_is_more_than_friction(ahead):
    joints = kr270().joints
    law = made("backlash", joints)
    model = with_terms(bare(), (law, nulls(law) | {"b2": 1e-3}))
    q = np.tile(np.radians([0.0, -90, 90, 0, 0, 0]), (4, 1))
    came = np.tile([0.0, ahead, 0, 0, 0, 0], (4, 1))
    torque = np.array([0.0, 5.0, 60.0, -60.0])  # N m, friction 20; A2 turns about +y
    wrench = np.outer(torque, [0.0, 0, 0, 0, 1, 0])
    side = (
        model.equilibrium(q, wrench, Poses.identity(), Conditions(direction=came)).displacement[:, 1] / 0.5e-3
    )
    assert side[0] == pytest.approx(-np.tanh(2.0) * ahead, abs=1e-12)
    assert side[1] == pytest.approx(side[0], abs=0.1)
    np.testing.assert_allclose(side[2:], [1.0, -1.0], atol=1e-3)


def bare():
    return elastic(kr270(), np.random.default_rng(0)).without_effects(families=["elastic"])


def hysteresis(width):
    effect = made("hysteresis", kr270().joints)
    return with_terms(bare(), (effect, nulls(effect) | {"w1": width, "w3": 2 * width}))


def coordinates_of(model, q, **given):
    q = np.asarray(q, float)
    return model.equilibrium(
        q, np.zeros((len(q), 6)), Poses.identity(), Conditions(**given)
    ).coordinates - q.astype(float)


def test_hysteresis_follows_the_order_of_states():
    q = np.zeros((6, 6))
    q[:, 0] = [0.0, 0.1, 0.1, 0.3, 0.2, 0.2]
    q[:, 2] = [0.5, 0.4, 0.3, 0.3, 0.6, 0.6 - 1e-12]  # the last is rounding, not a motion
    found = coordinates_of(hysteresis(1e-3), q)
    np.testing.assert_allclose(found[:, 0], np.array([0, -1, -1, -1, 1, 1]) * 0.5e-3, atol=1e-16)
    np.testing.assert_allclose(found[:, 2], np.array([0, 1, 1, 1, -1, -1]) * 1e-3, atol=1e-15)
    assert not found[:, [1, 3, 4, 5]].any()
    # backwards, every sense turns round
    back = coordinates_of(hysteresis(1e-3), q[::-1])
    np.testing.assert_allclose(back[:, 0], np.array([0, 0, -1, 1, 1, 1]) * 0.5e-3, atol=1e-16)


def test_a_stated_sense_of_approach_counts_and_order_does_not():
    q = np.zeros((3, 6))
    q[:, 0] = [0.0, 0.1, 0.2]
    direction = np.zeros((3, 6))
    direction[:, 0] = [1, 0, -1]
    found = coordinates_of(hysteresis(1e-3), q, direction=direction)
    np.testing.assert_allclose(found[:, 0], [-0.5e-3, 0.0, 0.5e-3], atol=1e-16)


# Offsets against Pinocchio on a robot that has them built in


def rigid_pose(*pairs, given=None, q=None, wrench=None, tool=TOOL):
    model = with_terms(bare(), *pairs)
    wrench = np.zeros((len(q), 6)) if wrench is None else wrench
    return model.equilibrium(q, wrench, tool, given or Conditions()).pose


def angles(count=20, seed=18):
    return random_angles(kr270(), count, np.random.default_rng(seed))


def reference(q, joints=None, tool=TOOL):
    """TCP poses by Pinocchio of the rigid robot, or of another with its ``joints``."""
    robot = kr270()
    return reference_flange(Chain(joints or robot.joints, robot.flange), q) @ tool


def same(found, expected):
    np.testing.assert_allclose(found.position, expected.position, atol=1e-13)
    np.testing.assert_allclose(found.rotation, expected.rotation, atol=1e-13)


def drawn(name, seed=19):
    effect = made(name, kr270().joints)
    return effect, sampled(effect, np.random.default_rng(seed))


def test_joint_offset_is_another_angle():
    effect, values = drawn("joint_offset")
    q = angles()
    same(rigid_pose((effect, values), q=q), reference(q + [values[f"o{i}"] for i in range(1, 7)]))
    only = nulls(effect) | {"o2": 0.01}
    same(rigid_pose((effect, only), q=q), reference(q + np.array([0, 0.01, 0, 0, 0, 0])))


def test_transmission_error_is_a_wave_of_the_commanded_angle():
    effect = made("transmission_error", kr270().joints)
    q = angles()
    values = nulls(effect) | {"s2_1": 1e-3, "c2_1": 2e-3, "s5_1": -1e-3}
    turned = q.copy()
    turned[:, 1] += 1e-3 * np.sin(q[:, 1]) + 2e-3 * np.cos(q[:, 1])
    turned[:, 4] -= 1e-3 * np.sin(q[:, 4])
    same(rigid_pose((effect, values), q=q), reference(turned))
    # the wave is one of what the controller says: a joint offset does not move it
    offset = made("joint_offset", kr270().joints)
    both = rigid_pose((offset, nulls(offset) | {"o2": 0.1}), (effect, values), q=q)
    same(both, reference(turned + np.array([0, 0.1, 0, 0, 0, 0])))


def test_transmission_error_has_one_pair_a_harmonic():
    effect = EFFECTS["transmission_error"](kr270().joints, (1.0, 2.0, 17.5))
    assert len(effect.parameters) == 6 * 3 * 2
    q = angles()
    values = nulls(effect) | {"c1_17.5": 1e-3}
    same(
        rigid_pose((effect, values), q=q),
        reference(q + np.outer(np.cos(17.5 * q[:, 0]), [1e-3, 0, 0, 0, 0, 0])),
    )


def test_joint_coupling_turns_the_later_wrist_axes():
    effect = made("joint_coupling", kr270().joints)
    assert [p.name for p in effect.parameters] == ["r54", "r64", "r65"]
    q = angles()
    values = {"r54": 0.01, "r64": -0.02, "r65": 0.03}
    turned = q.copy()
    turned[:, 4] += 0.01 * q[:, 3]
    turned[:, 5] += -0.02 * q[:, 3] + 0.03 * q[:, 4]
    same(rigid_pose((effect, values), q=q), reference(turned))
    # of fewer than four joints all are the last three
    for count, names in ((3, ["r21", "r31", "r32"]), (2, ["r21"]), (1, [])):
        short = made("joint_coupling", kr270().joints[:count])
        assert [p.name for p in short.parameters] == names


def frame(values):
    """Shift, then turns about x, the new y, the newest z."""

    def turn(axis, angle):
        (i, j), matrix = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis], np.eye(3)
        matrix[i, i] = matrix[j, j] = np.cos(angle)
        matrix[i, j], matrix[j, i] = -np.sin(angle), np.sin(angle)
        return matrix

    rotation = turn("x", values["rx"]) @ turn("y", values["ry"]) @ turn("z", values["rz"])
    return Poses(rotation, np.array([values["x"], values["y"], values["z"]]))


LARGE = {"x": 0.1, "y": -0.2, "z": 0.3, "rx": 0.4, "ry": -0.5, "rz": 0.6}


def test_base_offset_stands_on_the_left_and_tool_offset_on_the_right():
    q, joints = angles(), kr270().joints
    base, tool = made("base_offset", joints), made("tool_offset", joints)
    same(rigid_pose((base, LARGE), q=q), frame(LARGE) @ reference(q))
    same(rigid_pose((tool, LARGE), q=q), reference(q) @ frame(LARGE))
    same(rigid_pose((tool, LARGE), (base, LARGE), q=q), frame(LARGE) @ reference(q) @ frame(LARGE))


@pytest.mark.parametrize("variable", ["temperature", "time"])
def test_thermal_growth_lengthens_the_given_link(variable):
    robot = kr270()
    effect = EFFECTS["thermal_growth"](robot.joints, variable)
    assert [p.name for p in effect.parameters] == ["g2", "g3", "g4"]
    q, amount = angles(5), np.array([-3.0, 0.0, 1.0, 10.0, 20.0])
    for number in (2, 3, 4):
        values = nulls(effect) | {f"g{number}": 1e-4}
        found = rigid_pose((effect, values), given=Conditions(**{variable: amount}), q=q)
        for row, kelvin in enumerate(amount):
            joints = list(robot.joints)
            joint = joints[number - 1]
            place = joint.placement.position
            longer = place * (1 + 1e-4 * kelvin / np.linalg.norm(place))
            joints[number - 1] = replace(joint, placement=Poses(joint.placement.rotation, longer))
            same(found[row : row + 1], reference(q[row : row + 1], joints))
    # nothing is known of it: nothing grows
    same(rigid_pose((effect, nulls(effect) | {"g3": 1e-4}), q=q), reference(q))


def test_link_geometry_moves_the_axes():
    """Each axis shifted along x and y of its joint's frame, then turned about x and the new y."""
    robot, q = kr270(), angles()
    effect, values = drawn("link_geometry")
    joints = []
    for i, joint in enumerate(robot.joints, 1):
        get = {axis: values.get(f"d{axis}{i}", 0.0) for axis in "xy"}
        get |= {f"r{axis}": values.get(f"r{axis}{i}", 0.0) for axis in "xy"}
        joints.append(replace(joint, placement=joint.placement @ frame({"z": 0.0, "rz": 0.0, **get})))
    same(rigid_pose((effect, values), q=q), reference(q, joints))


def rank_of(matrix):
    """Rank by singular values, and the gap that tells it: the last that counts over the first that does not."""
    values = np.linalg.svd(matrix / np.linalg.norm(matrix, axis=0), compute_uv=False)
    rank = int((values > 1e-9 * values[0]).sum())
    return rank, values[rank - 1] / values[rank] if rank < len(values) else np.inf


UNIVERSAL = [f"{site}.{word}" for site in ("base", "tool") for word in ("x", "y", "z", "rx", "ry", "rz")]


@pytest.mark.parametrize(
    ("arm", "rank"), [("kr270", 30), ("any six", 30), ("ur5", 30), ("on a linear axis", 32)]
)
def test_link_geometry_is_complete(arm, rank):
    """4 parameters a turning joint, 2 a sliding one and 6 are all that can be seen (Everett, Driels, Mooring 1987);
    found here by singular values of the regressor that has six error parameters at every joint."""
    joints = dh_arm() if arm == "ur5" else ARMS[arm]()
    chain = every_coordinate(joints)
    q = np.random.default_rng(20).uniform(-2.5, 2.5, (80, len(joints)))
    regressor = chain.jacobian(q, TOOL).reshape(-1, chain.size)

    def columns(names):
        return regressor[:, [chain.index[name] for name in names]]

    motors = [joint.name for joint in joints]
    six = [f"{joint.name}.{word}" for joint in joints for word in ("x", "y", "z", "rx", "ry", "rz")]
    everything, gap = rank_of(columns([*UNIVERSAL, *motors, *six]))
    assert gap > 1e4
    assert everything == rank
    kept = made("link_geometry", joints).coordinates
    assert rank_of(columns([*UNIVERSAL, *motors, *kept]))[0] == everything
    # two lengths and two twists of every joint after the first, as a mechanic knows them
    assert len(kept) == 4 * (len(joints) - 1)


def dh_arm():
    """A UR5 by its Denavit-Hartenberg table: two parallel pairs of axes and no spherical wrist."""
    table = [
        (0.089159, 0.0, np.pi / 2),
        (0.0, -0.425, 0.0),
        (0.0, -0.39225, 0.0),
        (0.10915, 0.0, np.pi / 2),
        (0.09465, 0.0, -np.pi / 2),
        (0.0823, 0.0, 0.0),
    ]
    template, joints, before = random_arm(np.random.default_rng(0)), [], Poses.identity()
    for joint, (d, a, alpha) in zip(template, table, strict=True):
        up = Poses(np.eye(3), np.array([0.0, 0.0, d]))
        joints.append(replace(joint, placement=before @ up))
        c, s = np.cos(alpha), np.sin(alpha)
        before = Poses(np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]]), np.array([a, 0.0, 0.0]))
    return tuple(joints)


def test_force_sensor_is_another_wrench():
    rng = np.random.default_rng(21)
    base = elastic(kr270(), rng)
    gauge = made("force_sensor", base.robot.joints)
    values = sampled(gauge, rng)
    q, wrench, tool, given = problem(30, 22)
    wrench[0] = 0.0
    bias = np.array([values[name] for name in ("fx", "fy", "fz", "mx", "my", "mz")])
    really = (1 + values["gain"]) * (wrench - bias)
    really[0] = 0.0  # a tool that touches nothing
    found = with_terms(base, (gauge, values)).equilibrium(q, wrench, tool, given)
    expected = base.equilibrium(q, really, tool, given)
    np.testing.assert_allclose(found.coordinates, expected.coordinates, rtol=1e-13, atol=1e-15)


def test_a_stated_payload_weighs_as_one_of_the_effect():
    rng = np.random.default_rng(23)
    base = elastic(kr270(), rng)
    payload = made("payload", base.robot.joints)
    q, wrench, tool, given = problem(20, 24)
    com = np.array([0.1, -0.2, 0.3])
    values = {"mass": 40.0, "x": com[0], "y": com[1], "z": com[2]}
    stated = replace(given, payload_mass=np.full(20, 40.0), payload_com=np.tile(com, (20, 1)))
    one = with_terms(base, (payload, values)).equilibrium(q, wrench, tool, given)
    other = with_terms(base, (payload, nulls(payload))).equilibrium(q, wrench, tool, stated)
    np.testing.assert_allclose(one.coordinates, other.coordinates, rtol=1e-13, atol=1e-15)
    # without the effect, weights on the flange are nobody's business
    unsaid = base.equilibrium(q, wrench, tool, stated)
    assert np.array_equal(unsaid.coordinates, base.equilibrium(q, wrench, tool, given).coordinates)


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_what_is_slack_moves_nothing_without_a_wrench(name):
    """The states of the model without a wrench are those of a rigid arm, or the effect does not say so."""
    robot = kr270()
    effect = EFFECTS[name](robot.joints)
    rng = np.random.default_rng(8)
    values = {p.name: Value(p.null + 0.3 * p.scale, None, None, "test") for p in effect.parameters}
    model = replace(StiffnessModel.from_robot(robot), terms=()).with_effect(effect, values)
    q = milling_angles(20, rng)
    there = model.equilibrium(q, np.zeros((20, 6)), Poses.identity()).pose
    rigid = model.chain.flange(q)
    stands = np.allclose(there.position, rigid.position, atol=1e-9) and np.allclose(
        there.rotation, rigid.rotation, atol=1e-9
    )
    assert stands or not effect.zero_without_load
    assert model.zero_without_load is effect.zero_without_load
