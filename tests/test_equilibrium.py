"""The solved equilibrium: its derivative, how fast it is found, from where, and when there is none."""

from dataclasses import replace

import numpy as np
import pytest
from effect_cases import TOOL, conditions, elastic, made, sampled, with_terms
from plant import SOFTER, kr270, random_angles, random_tools, random_wrenches, with_compensator

from postproc.base.geometry import Poses, vector_from_rotation
from postproc.effects import EFFECTS
from postproc.model import NOTHING, StiffnessModel, compute_curvature, solve
from postproc.robot.chain import Chain


def full(**change):
    return with_compensator(StiffnessModel.from_robot(kr270()), **change)


def joints_only(factor=1.0, **values):
    """Without the compensator; all joints ``factor`` times as soft, then some of them as given."""
    model = full().without_effects(["gravity_compensator"])
    (term,) = model.terms
    softer = {name: factor * value for name, value in term.values.items()}
    return replace(model, terms=(replace(term, values=softer | values),))


def everything(without=()):
    """Every effect of the table; the compensator is one of a real arm."""
    rng = np.random.default_rng(31)
    joints = kr270().joints
    names = [name for name in EFFECTS if name not in ("joint_compliance", "gravity_compensator", *without)]
    effects = [made(name, joints) for name in names]
    return with_terms(full(**SOFTER), *((effect, sampled(effect, rng)) for effect in effects))


def problem(count, seed, share=1.0):
    rng = np.random.default_rng(seed)
    q = random_angles(kr270(), count, rng)
    return q, share * random_wrenches(count, rng), random_tools(count, rng), conditions(count, rng)


# The derivative


MODELS = {
    "joints": (joints_only, 1.0),
    "joints, ten times the force": (joints_only, 10.0),
    "compensator": (full, 1.0),
    "acting compensator": (lambda: full(**SOFTER), 3.0),
    "all that is elastic": (lambda: elastic(kr270(), np.random.default_rng(30)), 3.0),
    "every effect": (lambda: everything(["force_sensor"]), 1.0),
}
SIZE = {"every effect": 0.05}
"""[N, N m] of the small wrench, 1 elsewhere: a joint crosses its gap within some 10 N m."""


def measured_compliance(model, q, wrench, tool, given, small=1.0):
    """(N, 6, 6) central differences of the equilibrium, force by force; by Richardson to fourth order."""
    columns = []
    for unit in np.eye(6):
        both = []
        for size in (2 * small, small):
            ends = [
                model.equilibrium(q, wrench + sign * size * unit, tool, given).pose for sign in (1.0, -1.0)
            ]
            turn = vector_from_rotation(ends[0].rotation @ np.swapaxes(ends[1].rotation, 1, 2))
            shift = ends[0].position - ends[1].position
            both.append(np.concatenate([shift, turn], axis=1) / (2 * size))
        columns.append((4 * both[1] - both[0]) / 3)
    return np.stack(columns, axis=2)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", MODELS)
def test_a_conservative_arm_has_a_symmetric_compliance(name):
    """Only a moment that keeps its axes as it turns does work that depends on the way."""
    build, share = MODELS[name]
    model = build()
    q, wrench, tool, given = problem(25, 32, share)
    forces = wrench * [1, 1, 1, 0, 0, 0]
    assert model.equilibrium(q, forces, tool, given).converged.all()
    small = SIZE.get(name, 1.0)
    even = measured_compliance(model, q, forces, tool, given, small)[:, :3, :3]
    scale = np.abs(even).max(axis=(1, 2), keepdims=True)
    assert (np.abs(even - np.swapaxes(even, 1, 2)) / scale).max() < 1e-7 / small


def linear(model, q, tool, given=NOTHING):
    """(N, 6, 6) the compliance of eq. (5), force by force."""
    return np.stack(
        [model.linear_deflection(q, np.tile(unit, (len(q), 1)), tool, given) for unit in np.eye(6)], axis=2
    )


@pytest.mark.parametrize("build", [joints_only, lambda: elastic(kr270(), np.random.default_rng(30))])
def test_linear_deflection_is_the_derivative_at_rest(build):
    """Eq. (5)."""
    model = build()
    q, wrench, tool, given = problem(25, 33)
    expected = measured_compliance(model, q, 0 * wrench, tool, given)
    scale = np.abs(expected).max(axis=(1, 2), keepdims=True)
    assert (np.abs(linear(model, q, tool, given) - expected) / scale).max() < 1e-8


def test_load_changes_the_compliance():
    """The geometric term is there, and of the size of the lever's change."""
    q, wrench, tool, given = problem(25, 34, 10.0)
    model = joints_only()
    unloaded = linear(model, q, tool)
    loaded = measured_compliance(model, q, wrench, tool, given)
    change = np.abs(loaded - unloaded).max(axis=(1, 2)) / np.abs(unloaded).max(axis=(1, 2))
    assert 1e-3 < np.median(change) < 0.2


# How fast


def steps_of(model, q, wrench, tool, given, monkeypatch, count=10):
    """(count, N, m) displacement after 1, 2, ... steps."""
    after = []
    for limit in range(1, count + 1):
        with monkeypatch.context() as short:
            short.setattr(solve, "MAX_STEPS", limit)
            after.append(model.equilibrium(q, wrench, tool, given, tolerance=0.0).displacement)
    return np.array(after)


def rate_in_theory(model, q, wrench, tool, given):
    """(N,) spectral radius of (1 - C S)^-1 C (H - S): what the diagonal S of the loads leaves of H."""
    rest = model.equilibrium(q, wrench, tool, given)
    state = model.state(q, wrench, tool, given, rest.displacement)
    force, slope = model.forces(state)
    target, gives = np.zeros_like(force), np.zeros_like(force)
    for law, values in model.laws:
        law.add_displacement(values, state, force, target, gives)
    diagonal = slope.T[:, :, None] * np.eye(model.chain.size)
    left = compute_curvature(model, state, tool, np.arange(model.chain.size)) - diagonal
    factor = (gives / (1 - gives * slope)).T
    return np.abs(np.linalg.eigvals(factor[:, :, None] * left)).max(axis=1)


@pytest.mark.parametrize(
    ("build", "share"),
    [
        (lambda: joints_only(30.0), 1.0),
        (lambda: full(**SOFTER), 30.0),
        (lambda: elastic(kr270(), np.random.default_rng(30)), 100.0),
        (lambda: everything(["backlash", "joint_stiffening"]), 30.0),
    ],
    ids=["soft joints", "compensator", "elastic", "every effect"],
)
def test_rate_is_the_spectral_radius_of_what_the_diagonal_leaves_out(build, share, monkeypatch):
    model = build()
    q, wrench, tool, given = problem(40, 36, share)
    rested = model.equilibrium(q, wrench, tool, given).converged
    q, wrench, tool, given = q[rested], wrench[rested], tool[rested], given.part(rested)
    assert len(q) >= 30
    theory = rate_in_theory(model, q, wrench, tool, given)
    after = steps_of(model, q, wrench, tool, given, monkeypatch, 14)
    size = np.linalg.norm(np.diff(after, axis=0), axis=2)
    # the slope of log(step) over the last steps that stand clear of rounding
    fitted = np.full(len(q), np.nan)
    for row, sizes in enumerate(size.T):
        clear = np.flatnonzero(sizes > 1e-13)
        tail = clear[clear >= clear[-1] - 4]
        tail = tail[tail >= 1]
        if len(tail) >= 3:
            fitted[row] = np.exp(np.polyfit(tail, np.log(sizes[tail]), 1)[0])
    seen = np.isfinite(fitted)
    assert seen.sum() >= 20
    assert (fitted[seen] < 1.3 * theory[seen] + 1e-3).all()
    np.testing.assert_allclose(np.median(fitted[seen] / theory[seen]), 1.0, atol=0.15)


def test_rate_of_the_heavy_arm():
    """The 5e-3 that the model speaks of."""
    q, wrench, tool, given = problem(300, 37)
    rate = rate_in_theory(full(), q, wrench, tool, given)
    assert 1e-3 < np.median(rate) < 6e-3
    assert rate.max() < 2e-2
    assert full().equilibrium(q, wrench, tool, given).steps <= 8


# From where


@pytest.mark.parametrize("build", [full, everything], ids=["compensator", "every effect"])
def test_a_warm_start_gives_the_same_in_fewer_steps(build):
    model = build()
    q, wrench, tool, given = problem(200, 38)
    cold = model.equilibrium(q, wrench, tool, given)
    assert cold.converged.all()
    nearby = model.equilibrium(q + 1e-4, 1.001 * wrench, tool, given)
    starts = {
        "itself": (cold.displacement, cold.steps - 3),
        "a state nearby": (nearby.displacement, cold.steps - 1),
        "elsewhere": (cold.displacement[::-1], cold.steps + 3),
        "opposite": (-cold.displacement, cold.steps + 3),
    }
    for start, most in starts.values():
        warm = model.equilibrium(q, wrench, tool, given, start)
        assert warm.converged.all()
        assert np.abs(warm.coordinates - cold.coordinates).max() < 2e-13
        assert np.abs(warm.pose.position - cold.pose.position).max() < 6e-13
        assert warm.steps <= most


def test_the_start_is_not_written_to():
    model = full()
    q, wrench, tool, given = problem(5, 39)
    start = np.full((5, 6), 1e-3)
    start.setflags(write=False)
    model.equilibrium(q, wrench, tool, given, start)


def test_what_effects_see_of_a_state_stays_together():
    """Also when most states are done and the others go on alone."""
    counts = []

    class Watched(EFFECTS["joint_compliance"]):
        def add_displacement(self, values, state, *arrays):
            rows = state.conditions.time.astype(int)
            counts.append(len(rows))
            assert np.array_equal(state.motors, q[rows].T)
            assert np.array_equal(state.rest, q[rows].T)
            assert np.array_equal(state.wrench, wrench[rows].T)
            assert state.swept.position.shape == (3, len(rows))
            super().add_displacement(values, state, *arrays)

    base = joints_only()
    model = with_terms(replace(base, terms=()), (Watched(kr270().joints), base.terms[0].values))
    q, wrench, tool, given = problem(500, 42)
    rest = model.equilibrium(q, wrench, tool, replace(given, time=np.arange(500.0)))
    assert rest.converged.all()
    assert counts[0] == 500
    assert counts[-1] < 300


# When there is none


def column(angle=0.0):
    """The arm stretched forward, A1 turned by ``angle``: seen from above, a rod on a hinge."""
    return np.array([[angle, -0.3, 0.3, 0.0, 0.0, 0.0]])


@pytest.mark.parametrize("angle", [0.0, 0.5])
@pytest.mark.parametrize("factor", [0.5, 0.9, 1.1, 2.0, 4.0, 20.0])
def test_a_rod_pushed_along_its_line_buckles(factor, angle):
    """Only A1 gives way; a push P along the arm of length r tips it over where P r c > 1, exactly along as well."""
    c1 = 1e-5
    model = joints_only(0.0, c1=c1)
    q = column(angle)
    tip = model.chain.flange(q) @ TOOL_AHEAD
    reach = np.hypot(*tip.position[0, :2])
    away = np.array([*tip.position[0, :2], 0.0]) / reach
    push = -factor / (c1 * reach) * away
    rest = model.equilibrium(q, np.concatenate([push, np.zeros(3)])[None], TOOL_AHEAD)
    assert np.isfinite(rest.coordinates).all()
    standing = np.abs(rest.displacement[0, 0]) < 1e-6
    if factor < 1:
        assert rest.converged[0]
        assert standing
    else:
        # it fell over: to a rest where sin(x) / x = 1 / factor, or to none that was found
        assert not (rest.converged[0] and standing)
        if rest.converged[0]:
            x = rest.displacement[0, 0]
            assert np.sin(x) / x == pytest.approx(1 / factor, abs=1e-9)


TOOL_AHEAD = Poses(np.eye(3), np.array([0.0, 0.0, 0.3]))


@pytest.mark.parametrize("factor", [1e3, 1e4, 1e5])
def test_a_soft_elbow_pushed_into_a_fold_is_told(factor):
    """A3 a thousand times and more as soft, the arm nearly straight, 2 kN back along it."""
    model = joints_only(1.0, c3=0.406e-6 * factor)
    q = np.tile(np.radians([0.0, -20, 10, 0, 30, 0]), (4, 1))
    wrench = np.outer([0.0, 1.0, 1.0, -1e-3], [-2000.0, 0, 0, 0, 0, 0])
    rest = model.equilibrium(q, wrench, TOOL)
    assert rest.converged[[0, 3]].all() or factor > 1e4
    assert not rest.converged[[1, 2]].any() or factor == 1e3
    good = rest.converged
    assert np.isfinite(rest.pose.position[good]).all()
    # what is called a rest is one, and one that resists
    state = model.state(q, wrench, TOOL, displacement=rest.displacement)
    force = model.forces(state)[0]
    compliance = np.array([model.terms[0].values[f"c{i}"] for i in range(1, 7)])
    assert np.abs(rest.displacement - compliance * force.T)[good].max() < 1e-10
    stiffness = np.diag(1 / compliance) - compute_curvature(model, state, TOOL, np.arange(model.chain.size))
    symmetric = 0.5 * (stiffness + np.swapaxes(stiffness, 1, 2))
    assert (np.linalg.eigvalsh(symmetric)[good] > 0).all()


def test_a_compensator_stronger_than_its_joint_is_told():
    q = np.radians([[0.0, angle, 60, 0, 45, 0] for angle in (-140.0, -100.0, -60.0, -15.0)])
    wrench = np.tile([100.0, 0, 300, 0, 0, 0], (4, 1))
    for preload in ("balanced", "acting"):
        model = full(K_c=1e8, preload=preload)
        rest = model.equilibrium(q, wrench, TOOL)
        assert np.isfinite(rest.coordinates).all()
        # there, the joint's own 3.3e6 N m/rad and the spring's are one negative stiffness
        joint, spring = model.terms
        falls = joint.values["c2"] * spring.effect.spring(spring.values, q[:, 1]).slope >= 1
        assert falls.tolist() == [False, False, False, True]
        assert not rest.converged[falls].any()
        assert rest.converged[~falls].all() or preload == "acting"


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_a_state_that_is_not_known_is_no_rest_and_spoils_no_other():
    model = full()
    q, wrench, tool, given = problem(6, 40)
    expected = model.equilibrium(q, wrench, tool, given)
    q[1, 2], wrench[3, 4], tool.position[4, 0] = np.nan, np.nan, np.inf
    found = model.equilibrium(q, wrench, tool, given)
    assert found.converged.tolist() == [True, False, True, False, False, True]
    good = found.converged
    assert np.abs(found.coordinates - expected.coordinates)[good].max() < 1e-15
    assert found.steps <= expected.steps
    alone = model.equilibrium(q[1:2], wrench[1:2], tool[1:2], given.part(slice(1, 2)))
    assert not alone.converged[0]


def test_pushed_beyond_all_measure_nothing_is_called_a_rest():
    """Forces up to a million times too large: no exception, and no rest that is not one."""
    model = full(**SOFTER)
    q, wrench, tool, given = problem(300, 41)
    wrench[:, 3:] = 0.0  # forces have an energy, so that a stable rest is a minimum
    for share in (1e2, 1e3, 1e4, 1e6):
        rest = model.equilibrium(q, share * wrench, tool, given)
        good = rest.converged
        assert np.isfinite(rest.pose.position[good]).all()
        if not good.any():
            continue
        state = model.state(
            q[good], share * wrench[good], tool[good], given.part(good), rest.displacement[good]
        )
        force = model.forces(state)[0]
        compliance = np.array([model.terms[0].values[f"c{i}"] for i in range(1, 7)])
        miss = np.abs(rest.displacement[good] - compliance * force.T)
        assert miss.max() < 1e-10 + 1e-12 * np.abs(force).max()
        stiffness = np.diag(1 / compliance) - compute_curvature(
            model, state, tool[good], np.arange(model.chain.size)
        )
        assert (np.linalg.eigvalsh(0.5 * (stiffness + np.swapaxes(stiffness, 1, 2))) > 0).all()
    assert not rest.converged.all()


@pytest.mark.parametrize("extras", [(), ("base.x", "A3.ry", "tool.rx", "tool.z", "spindle.x", "spindle.z")])
def test_a_nudge_is_a_sweep_to_first_order(extras):
    robot = kr270()
    chain = Chain(robot.joints, robot.flange, extras)
    rng = np.random.default_rng(8)
    at = rng.uniform(-1.0, 1.0, (chain.size, 20))
    step = rng.uniform(-1.0, 1.0, (chain.size, 20)) * 1e-5
    there, exact = (
        chain.evaluate(at, TOOL_AHEAD).first_order_update(step),
        chain.evaluate(at + step, TOOL_AHEAD),
    )
    for near, far in ((there.position, exact.position), (there.mount, exact.mount)):
        assert np.abs(near - far).max() < 1e-8
        assert np.abs(far - chain.evaluate(at, TOOL_AHEAD).position).max() > 1e-6
    assert np.abs(np.array(there.tcp) - np.array(exact.tcp)).max() < 1e-8
