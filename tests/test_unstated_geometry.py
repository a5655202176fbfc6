"""Of geometry that predicts the same readings, the most plausible is reported, whatever the robot file states."""

from dataclasses import replace

import numpy as np
import pytest
from blind.arm import joints, model_of, robot_file
from blind.cases import cases, made
from blind.real_worlds import campaign
from test_equivalent_models import read

from postproc.diagnosis.search import model_unknowns
from postproc.diagnosis.unstated_geometry import take_in_unstated_geometry
from postproc.effects import EFFECTS
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.unknowns import unknowns_of, with_gauge

ZERO = 0.01
"""[rad] by which A3 was mastered wrongly."""


def seen_of(model, off, seed):
    """30 poses of ``model`` with parameters that are ``off`` (SI)."""
    rng = np.random.default_rng(seed)
    names = {f"{t.effect.name}.{p}": (i, p) for i, t in enumerate(model.terms) for p in t.values}
    design = replace(campaign(rng, 30, stated=True), jitter=0.0)
    return read(design, model.with_values({names[name]: value for name, value in off.items()}), rng)


def geometry_of(found):
    """effect.parameter -> estimate of lengths, twists and zeros."""
    return {e.unknown.name: e for e in found.estimates if e.unknown.plausible is not None}


def test_a_zero_that_no_file_states_is_not_made_of_lengths_that_cancel():
    seen = seen_of(model_of(robot_file(True, False)), {"joint_offset.o3": ZERO}, 5)
    model = model_of(robot_file(True, False, [("joint_offset", "A3")]))
    without = fit(seen, model, model_unknowns(model))
    lengths = [abs(e.value) for name, e in geometry_of(without).items() if name.startswith("link_geometry")]
    assert max(lengths) > 3e-3
    found = take_in_unstated_geometry(without)
    values = geometry_of(found)
    zero = values.pop("joint_offset.o3")
    assert abs(zero.value - ZERO) < zero.ci95 < 0.3 * ZERO
    assert max(abs(e.value) for e in values.values()) < 1e-3
    assert {u.name for u in found.asked} >= {"joint_offset.o3", *(u.name for u in without.asked)}


def test_plausible_geometry_is_left_alone():
    seen = seen_of(model_of(robot_file(True, False)), {"link_geometry.dx4": 5e-4}, 6)
    model = model_of(robot_file(True, False, [("joint_offset", "A3")]))
    alone = fit(seen, model, model_unknowns(model))
    assert take_in_unstated_geometry(alone) is alone


@pytest.mark.slow
def test_a_small_tool_offset_is_not_made_of_a_large_one_and_zeros_that_cancel():
    run = made(cases("single", 16, 101)[15])
    assert run.case.effects == ("tool_offset",)
    model = model_of(run.robot).with_effect(EFFECTS["tool_offset"](joints()))
    own = [u for u in model_unknowns(model) if u.term < len(model.terms) - 1]
    free = with_gauge(unknowns_of(model, len(model.terms) - 1))
    values = geometry_of(fit(Campaign(run.readings), model, [*own, *free]))
    true = run.true()
    for name in ("x", "y", "z", "rx", "ry", "rz"):
        estimate = values[f"tool_offset.{name}"]
        assert abs(estimate.value) < (1e-3 if name in "xyz" else 4e-3), name
        assert abs(estimate.value - true[f"tool_offset.{name}"]) < estimate.ci95, name
