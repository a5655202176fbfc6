"""What a placement says of limits, reach and units."""

from __future__ import annotations

import numpy as np
import pytest
from place_cases import ROOT

from postproc.base.geometry import Poses
from postproc.base.units import DEG, are_radians
from postproc.placement.margin_words import margin_words, reach_shortfall, reach_words
from postproc.robot.description import load_robot
from postproc.robot.inverse import inverse

HOME = np.array([0.0, -90.0, 90.0, 0.0, 45.0, 0.0])
MARGINS = (5.0, 5.0)


@pytest.fixture(scope="module")
def arm():
    return load_robot(ROOT / "robots" / "kuka_kr270.yaml")


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({}, ""),
        ({4: 124.2}, "A5 is 0.8 deg from its limit of 125 deg (margin 5 deg)"),
        ({2: 160.5}, "A3 is 5.5 deg beyond its limit of 155 deg (margin 5 deg)"),
        # the shorter way round: -146 is the lower limit of A2
        ({1: 179.0}, "A2 is 35.0 deg beyond its limit of -146 deg (margin 5 deg)"),
        ({4: 3.0}, "the arm is 3.0 deg from a singularity (margin 5 deg; A5 near 0"),
    ],
    ids=str,
)
def test_the_axis_and_its_limit_are_named(arm, changed, words):
    q = HOME.copy()
    for axis, value in changed.items():
        q[axis] = value
    said = margin_words(arm, q * DEG, abs(q[4]) * DEG, MARGINS)
    assert said.startswith(words) if words else said == ""


def test_the_shortfall_is_how_far_the_target_has_to_come(arm):
    """Targets beyond the reach, moved towards the shoulder by the shortfall, are just within it."""
    rng = np.random.default_rng(5)
    rotation = np.tile(np.diag([1.0, -1.0, -1.0]), (200, 1, 1))
    position = rng.uniform([1.5, -2.0, -1.0], [3.0, 2.0, 2.0], (200, 3))
    short = reach_shortfall(arm, Poses(rotation, position))
    near, status = np.tile(HOME * DEG, (200, 1)), np.full(200, 0b010)
    reachable = inverse(arm.nominal, Poses(rotation, position), status, near).reachable
    assert (short[reachable] == 0).all()
    assert (short[~reachable] > 0).all()
    assert 20 < reachable.sum() < 180
    lengths = arm.nominal
    wrist = position - lengths.d6 * rotation[:, :, 2]
    flat = wrist[:, :2] / np.hypot(*wrist[:, :2].T)[:, None]
    shoulder = np.column_stack([lengths.a1 * flat, np.full(200, lengths.d1)])
    towards = (shoulder - wrist) / np.linalg.norm(shoulder - wrist, axis=1)[:, None]
    for more, reached in ((1e-6, True), (-1e-6, False)):
        moved = position + (short + more)[:, None] * towards
        there = inverse(arm.nominal, Poses(rotation, moved), status, near).reachable
        assert (there[~reachable] == reached).all()


def test_what_is_not_known_is_not_stated():
    assert reach_words(0.6064) == "the target is out of reach by 606 mm"
    assert reach_words(0.0) == "the target is out of reach in this configuration"
    assert reach_words(float("nan")) == "the target is out of reach"


@pytest.mark.parametrize(
    ("ends", "radians"),
    [
        ([-1.57, 1.57], True),
        ([-3.14159, 0.0], True),
        ([0.0, 0.7854], True),
        ([-90.0, 90.0], False),
        ([-1.5, 1.5], False),
        ([0.0, 0.0], False),
    ],
)
def test_angles_that_are_round_in_radians(ends, radians):
    assert are_radians(ends) == radians


def test_a_range_of_turns_in_radians_is_reported(job, compensate):
    done = compensate("place", job.program, "--force", "--turn=-1.571:1.571", "--top", "1", "--json", "-")
    found = [one for one in done.json["findings"] if one["code"] == "PLC021"]
    assert done.code == 3
    assert len(found) == 1
    assert "--turn -90" in found[0]["help"]


def test_a_zero_has_no_sign(job, compensate):
    words = ("--x", "1400:1600", "--y=-0.04:-0.01", "--top", "1")
    done = compensate("place", job.program, "--force", *words)
    assert "-0.0 " not in done.out + done.err
