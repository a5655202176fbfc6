"""Every effect of the table, alone and all together, against MuJoCo: an engine that shares no line with it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from effect_cases import conditions, made, sampled, with_terms
from plant import SOFTER, Plant, kr270, random_angles, random_tools, random_wrenches, with_compensator

from postproc.base.geometry import vector_from_rotation
from postproc.effects import EFFECTS
from postproc.model import StiffnessModel

COUNT = 200
POSITION, ANGLE = 1e-8, 1e-8
TOGETHER = "all together"
CASES = [*EFFECTS, "all but geometry", TOGETHER]


def joints_only():
    """A stiff heavy arm: what gives way in its joints only."""
    return StiffnessModel.from_robot(kr270()).without_effects(["gravity_compensator"])


def weighed(model, amount=0.0):
    """The model with the plant's own weights instead of drawn ones, and its plant."""
    plant = Plant.of(model)
    terms = [
        replace(term, values=plant.first_moments(amount)) if term.effect.name == "link_gravity" else term
        for term in model.terms
    ]
    return replace(model, terms=tuple(terms)), plant


def case(name, rng):
    """Model and plant, the model without what is tried, and the conditions."""
    bare, joints = joints_only(), kr270().joints
    given = conditions(COUNT, rng)
    if name == "joint_compliance":
        effect = made(name, joints)
        model = with_terms(replace(bare, terms=()), (effect, sampled(effect, rng)))
        return *weighed(model), replace(bare, terms=()), given
    names = [name] if name in EFFECTS else [other for other in EFFECTS if other != "joint_compliance"]
    if name == "all but geometry":
        names = [other for other in names if EFFECTS[other].family != "geometric"]
    amount = 0.0
    if name == TOGETHER:
        # the weights are told of as they lie on one day: a link that grows moves those behind it
        amount = 12.0
        given = replace(given, temperature=np.full(COUNT, amount))
    effects = [made(other, joints) for other in names]
    model = with_terms(bare, *((effect, sampled(effect, rng)) for effect in effects))
    if name not in EFFECTS:
        # the spring of a real arm: it pulls with some kN m all the time
        paper = dict(StiffnessModel.from_robot(kr270()).terms[1].values)
        terms = [
            replace(t, values=paper) if t.effect.name == "gravity_compensator" else t for t in model.terms
        ]
        model = with_compensator(replace(model, terms=tuple(terms)), **SOFTER)
    return *weighed(model, amount), bare, given


def difference(ours, positions, rotations):
    turn = vector_from_rotation(ours.rotation @ np.swapaxes(rotations, 1, 2))
    return np.linalg.norm(ours.position - positions, axis=1).max(), np.linalg.norm(turn, axis=1).max()


@cache
def compared(name):
    """Largest difference [m], [rad] between model and plant, and what the tried effects do themselves [m], [rad]."""
    rng = np.random.default_rng(sum(name.encode()))
    model, plant, bare, given = case(name, rng)
    q, wrench = random_angles(model.robot, COUNT, rng), random_wrenches(COUNT, rng)
    tool = random_tools(COUNT, rng)
    ours, without = (m.equilibrium(q, wrench, tool, given) for m in (model, bare))
    assert ours.converged.all()
    theirs = [plant.rest(q[i], wrench[i], tool[i], given, i) for i in range(COUNT)]
    positions, rotations = np.array([r.position for r in theirs]), np.array([r.rotation for r in theirs])
    return (
        *difference(ours.pose, positions, rotations),
        *difference(without.pose, positions, rotations),
    )


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", CASES)
def test_equilibrium_agrees(name):
    shift, turn, moved, _ = compared(name)
    assert shift < POSITION
    assert turn < ANGLE
    # it is not one of zero against zero
    assert moved > 1e3 * POSITION


@pytest.mark.slow
def test_table_of_differences(capsys):
    rows = [(name, *compared(name)) for name in CASES]
    with capsys.disabled():
        print(f"\n{'largest difference to MuJoCo':32} {'m':>9} {'rad':>9}   of {'m':>9} {'rad':>9}")
        for name, *figures in rows:
            print("{:32} {:9.1e} {:9.1e}      {:9.1e} {:9.1e}".format(name, *figures))
    assert all(shift < POSITION and turn < ANGLE for _, shift, turn, *_ in rows)
