"""What a pose costs: equilibrium, mirror loop, all effects.

    OMP_NUM_THREADS=1 python -m pytest tests/benchmarks

Time of this process, not of the clock: what else the machine does is not counted.  ``us_per_pose`` stands in the extra
info of each case (``--benchmark-json FILE``) and in the table below the run.
"""

import time
from functools import cache

import numpy as np
import pytest
from effects_at_work import TOOL, conditions, made, sampled, with_terms
from motions import milling_angles
from plant import SOFTER, kr270, random_tools, random_wrenches, with_compensator

from postproc.compensation.mirror import mirror
from postproc.effects import EFFECTS
from postproc.model import NOTHING, StiffnessModel
from postproc.robot.inverse import status_of

EQUILIBRIUM_US, MIRROR_US, ALL_TIMES = 4.0, 10.0, 10.0
"""Goals: microseconds a pose on one core, and how many times the goal of the KR 270 all effects may take."""

pytestmark = pytest.mark.benchmark(timer=time.process_time)

TABLE: dict[str, float] = {}


@pytest.fixture(scope="module", autouse=True)
def table():
    yield
    print("\n" + "\n".join(f"{name:44} {us:8.2f} us a pose" for name, us in TABLE.items()))
    for tools in ("one tool", "a tool a pose"):
        few, many = (TABLE.get(f"equilibrium, {tools}, {count}") for count in (10**5, 10**6))
        if few and many:
            print(f"{f'growth exponent from 1e5 to 1e6, {tools}':44} {1 + np.log10(many / few):8.2f}")


@cache
def heavy():
    return StiffnessModel.from_robot(kr270())


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


def measured(benchmark, name, count, work):
    result = benchmark.pedantic(work, rounds=5 if count < 10**6 else 3, warmup_rounds=1)
    TABLE[name] = benchmark.extra_info["us_per_pose"] = benchmark.stats.stats.min / count * 1e6
    benchmark.extra_info["poses"] = count
    return result


@pytest.mark.parametrize("count", [10**4, 10**5, 10**6])
@pytest.mark.parametrize("tools", ["one tool", "a tool a pose"])
def test_equilibrium_with_compensator(benchmark, count, tools):
    q, wrench, tool, _ = states(count)
    tool = TOOL if tools == "one tool" else tool
    rest = measured(
        benchmark, f"equilibrium, {tools}, {count}", count, lambda: heavy().equilibrium(q, wrench, tool)
    )
    assert rest.converged.all()


def test_mirror_loop(benchmark):
    count = 10**5
    q, wrench, _, _ = states(count)
    model = heavy()
    wanted = model.chain.flange(q) @ TOOL
    status = status_of(model.robot.nominal, q)
    done = measured(
        benchmark,
        f"mirror, {count}",
        count,
        lambda: mirror(model, wanted, wanted, TOOL, wrench, NOTHING, status, q),
    )
    assert done.converged.all()


def test_all_effects(benchmark):
    count = 10**5
    q, wrench, tool, rng = states(count)
    given = conditions(count, rng)
    rest = measured(
        benchmark,
        f"equilibrium, all effects, {count}",
        count,
        lambda: everything().equilibrium(q, wrench, tool, given),
    )
    assert rest.converged.mean() > 0.99
    benchmark.extra_info["coordinates"] = everything().chain.size
