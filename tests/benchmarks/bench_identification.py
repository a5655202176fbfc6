"""What an identification costs: 1000 poses, 60 parameters; the fit, and the whole command.

    OMP_NUM_THREADS=1 python -m pytest tests/benchmarks/bench_identification.py

Time of this process, not of the clock.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from motions import milling_angles
from plant import kr270, random_wrenches

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.cli.main import run
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.unknowns import asked_for
from postproc.measurements import measurements_csv, planned
from postproc.model import StiffnessModel
from postproc.robot.description import robot_of

POSES, PARAMETERS, SECONDS = 1000, 60, 10.0

SIGMA = 3e-5
"""[m]"""

EFFECTS = (
    "joint_compliance",
    "gravity_compensator.K_c",
    "gravity_compensator.s0",
    "tool_compliance",
    "base_compliance",
    "joint_offset",
    "link_geometry",
    "transmission_error",
)

HARMONICS = """
  - effect: transmission_error
    options: {harmonics: [1, 2]}
"""

TOOL = Poses(np.eye(3), np.array([0.1, 0.2, 0.3]))


@cache
def robot_file():
    return kr270().path.read_bytes() + HARMONICS.encode()


@cache
def asked():
    return asked_for(StiffnessModel.from_robot(robot_of(robot_file(), kr270().path)), EFFECTS)


@cache
def readings():
    """Places of one reflector in the tracker's frame, under loads of any direction, of a robot that has a tenth of each
    parameter's usual size more than its file says."""
    rng = np.random.default_rng(60)
    robot, unknowns = asked().model.robot, asked().unknowns
    q = milling_angles(POSES, rng)
    wrench = 3.0 * random_wrenches(POSES, rng)
    empty = planned(
        [(joint.name, False) for joint in robot.joints], q, wrench, False, robot=robot.name, tool=TOOL,
        targets=("M1",), sigma=SIGMA,
    )  # fmt: skip
    more = {u.key: u.value + 0.1 * u.parameter.scale * rng.uniform(0.5, 1.0) for u in unknowns}
    campaign = Campaign(empty)
    place = rotation_from_vector([0.1, -0.2, 2.0]), np.array([3.0, 1.0, 0.5])
    given = replace(campaign.start(), frames=Poses(place[0][None], place[1][None]))
    value, _ = campaign.expected(campaign.predicted(asked().model.with_values(more)), given)
    return replace(empty, value=value + SIGMA * rng.normal(size=value.shape))


def test_fit(benchmark):
    assert len(asked().unknowns) == PARAMETERS
    done = benchmark.pedantic(
        lambda: fit(Campaign(readings()), asked().model, asked().unknowns), rounds=3, warmup_rounds=1
    )
    assert done.factor == 1.0
    assert benchmark.stats.stats.min < SECONDS


def test_command(benchmark, tmp_path):
    data, robot, new = (tmp_path / name for name in ("places.csv", "robot.yaml", "new.yaml"))
    data.write_bytes(measurements_csv(readings()))
    robot.write_bytes(robot_file())
    words = ["identify", data, "--robot", robot, "--effects", ",".join(EFFECTS), "-o", new, "--quiet"]

    def command():
        with pytest.raises(SystemExit) as end:
            run([str(word) for word in words])
        assert end.value.code in (0, 3)

    benchmark.pedantic(command, rounds=3, warmup_rounds=1)
    assert new.exists()
    assert benchmark.stats.stats.min < SECONDS
