"""What a pose costs: inverse kinematics, equilibrium, linear deflection, mirror loop."""

from functools import cache

import numpy as np
import pytest
from effect_cases import TOOL, conditions, made, sampled, with_terms
from motions import milling_angles
from plant import SOFTER, kr270, random_tools, random_wrenches, with_compensator

from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import mirror
from postproc.effects import EFFECTS
from postproc.model import NOTHING, StiffnessModel
from postproc.robot.inverse import branch_of, inverse

COUNT = 2**15


@cache
def heavy():
    return StiffnessModel.from_robot(kr270())


@cache
def springs():
    """Joints that give way, and no compensator."""
    return heavy().without_effects(["gravity_compensator"])


@cache
def everything():
    rng = np.random.default_rng(31)
    joints = kr270().joints
    names = [name for name in EFFECTS if name not in ("joint_compliance", "gravity_compensator")]
    effects = [made(name, joints) for name in names]
    return with_terms(
        with_compensator(heavy(), **SOFTER), *((effect, sampled(effect, rng)) for effect in effects)
    )


@cache
def states(count):
    rng = np.random.default_rng(0)
    return milling_angles(count, rng), random_wrenches(count, rng), random_tools(count, rng), rng


def test_inverse(measured):
    q, *_ = states(COUNT)
    arm = kr270().nominal
    flange, status = heavy().chain.flange(q), branch_of(arm, q)
    found = measured(lambda: inverse(arm, flange, status, q), COUNT)
    assert np.abs(found.q - q).max() < 1e-9


@pytest.mark.parametrize("count", [COUNT, 10 * COUNT])
@pytest.mark.parametrize("tools", ["one tool", "a tool a pose"])
def test_equilibrium_with_compensator(measured, count, tools):
    q, wrench, tool, _ = states(count)
    tool = TOOL if tools == "one tool" else tool
    assert measured(lambda: heavy().equilibrium(q, wrench, tool), count).converged.all()


def test_equilibrium_of_springs(measured):
    q, wrench, *_ = states(COUNT)
    assert measured(lambda: springs().equilibrium(q, wrench, TOOL), COUNT).converged.all()


def test_equilibrium_with_all_effects(measured):
    q, wrench, tool, rng = states(COUNT)
    given = conditions(COUNT, rng)
    rest = measured(lambda: everything().equilibrium(q, wrench, tool, given), COUNT)
    assert rest.converged.mean() > 0.99


def test_linear_deflection(measured):
    q, wrench, *_ = states(COUNT)
    assert np.isfinite(measured(lambda: springs().linear_deflection(q, wrench, TOOL), COUNT)).all()


def test_mirror(measured):
    q, wrench, *_ = states(COUNT)
    model = heavy()
    wanted, status = model.chain.flange(q) @ TOOL, branch_of(model.robot.nominal, q)
    done = measured(lambda: mirror(model, wanted, wanted, LoadCase(TOOL, wrench, NOTHING, status, q)), COUNT)
    assert done.converged.all()
