"""Sides of approach that no column states, where they look like an error that readings of a pose share."""

from dataclasses import replace

import numpy as np
import pytest
from blind import measured
from blind.arm import model_of, robot_file
from blind.real_worlds import campaign

from postproc.diagnosis.approach_sides import diagnose_sides
from postproc.diagnosis.diagnosis import diagnose
from postproc.effects import EFFECTS
from postproc.identification.campaign import Campaign

SIGMA = 2e-5


def read(lag: float, seed: int) -> tuple[Campaign, Campaign]:
    """Readings of an arm that lags by ``lag`` [rad] at A2, without columns of the side: and with unknown ones."""
    rng = np.random.default_rng(seed)
    design = replace(campaign(rng, 30, stated=True), jitter=0.0)
    empty = Campaign(measured.readings(design, np.zeros((len(design.q) * design.points, 3)), SIGMA))
    model = model_of(robot_file(True, False))
    there = model.with_effect(EFFECTS["hysteresis"](model.robot.joints))
    there = there.with_values({(len(there.terms) - 1, "w2"): lag})
    value = -empty.residual(empty.predicted(there), empty.start())[:, :3]
    value = value + SIGMA * rng.normal(size=value.shape)
    told = replace(empty.readings, value=value)
    return (
        Campaign(replace(told, direction=None)),
        Campaign(replace(told, direction=np.zeros_like(told.q))),
    )


@pytest.mark.parametrize("seed", [1, 2])
def test_a_lag_that_looks_like_an_error_that_poses_share_is_found(seed):
    model = model_of(robot_file(True, False))
    unstated, unknown = read(2.5e-5, seed)
    assert diagnose(unknown, model).verdict.word == "nothing_missing"
    found, findings = diagnose_sides(unstated, model)
    # without another load a gap does the same as a lag
    sets = [{(one.name, one.joint) for one in alternatives} for alternatives in found.verdict.alternatives]
    assert sets == [{("hysteresis", "A2"), ("backlash", "A2")}]
    assert "order of the rows" in findings[0].message


def test_where_nothing_lags_no_side_is_taken():
    model = model_of(robot_file(True, False))
    for seed in range(3):
        found, findings = diagnose_sides(read(0.0, seed)[0], model)
        assert found.verdict.word == "nothing_missing"
        assert findings == ()
