"""Errors that are largest between samples, near more than one of them."""

from __future__ import annotations

import numpy as np
import pytest
from spring_cases import AT, MM, output
from test_ramp_fit_laws import COMPLIANCE, TURNED, two_motions

from postproc.compensation.rounded_path import RoundedOutput
from postproc.compensation.summits import NEARLY, SUMMITS, summits


def test_summits_in_loops() -> None:
    chance = np.random.default_rng(0)
    for _ in range(300):
        sizes = chance.integers(0, 12, (int(chance.integers(1, 4)), int(chance.integers(1, 16)))).astype(
            float
        )
        if chance.random() < 0.1:
            sizes[0, -1] = np.inf
        row, number = summits(sizes)
        assert (np.diff(row) >= 0).all()
        for k, values in enumerate(sizes.tolist()):
            high = max(values)
            places = [
                i
                for i, value in enumerate(values)
                if value >= NEARLY * high
                and (i == 0 or value >= values[i - 1])
                and (i + 1 == len(values) or value > values[i + 1])
            ]
            mine = number[row == k].tolist()
            assert values.index(high) in mine
            others = sorted((values[i] for i in places if i != values.index(high)), reverse=True)
            found = [values[i] for i in mine if i != values.index(high)]
            assert sorted(found, reverse=True) == others[: SUMMITS - 1]


FITTED = [
    (2, 1.0, (-0.215165, -0.748808, -0.05)),
    (3, 0.00911007, (-0.067336, 0.243614, -0.05)),
    (3, 0.0441276, (0.413162, 4.059651, -0.05)),
    (3, 0.04956941, (0.504136, 4.6531, -0.05)),
]
"""Points [mm] that a fit placed so that the errors around them are about alike: on the second line of them they are
largest where the program's parabola ends, between two samples; 4.12 um at one, 4.37 um there."""


@pytest.mark.parametrize("noise", [0.0, 1e-7, 1e-6])
def test_no_place_of_a_rounded_path_is_farther_off_than_is_reported(noise: float) -> None:
    """Points beside a ramp of the force, of which the errors have several peaks, against many places."""
    chance = np.random.default_rng(1)
    job, _ = two_motions(np.pi / 2, TURNED, 0.5)

    def shift(row: int, share: float, place: tuple[float, float, float]) -> np.ndarray:
        on = job.desired_path.at(np.array([row]), np.array([share])).position[0]
        return AT + np.array(place) * MM - on + chance.normal(0.0, noise, 3)

    shifts = np.zeros((4, 3))
    shifts[2] = shift(*FITTED[0])
    shifts[1] = -COMPLIANCE @ (100.0, 250.0, 50.0)
    shifts[3] = -COMPLIANCE @ TURNED
    division = output(job, shifts, [(row, at, shift(row, at, place), 0.0) for row, at, place in FITTED[1:]])
    motions = np.arange(2, len(division) - 1)
    rounded = RoundedOutput(job, division, motions)
    found = rounded.largest(motions)[0]
    share = np.linspace(0.0, 1.0, 4001)
    for motion, size in zip(rounded.place(motions), found, strict=True):
        many = rounded.deviations(np.full(len(share), motion), share).shift
        assert np.linalg.norm(many, axis=1).max() < 1.005 * size + 1e-8
