"""Zeros between two places each."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compensation.brackets import Brackets


def zeros(functions: list, low: np.ndarray, high: np.ndarray, steps: int) -> np.ndarray:
    """Where each of the functions is zero, after so many steps."""

    def at(place: np.ndarray) -> np.ndarray:
        return np.array([function(x) for function, x in zip(functions, place, strict=True)])

    brackets = Brackets(low, high, at(low), at(high))
    every = np.arange(len(functions))
    for _ in range(steps):
        place = brackets.secants(every)
        brackets.narrow(every, place, at(place))
    return place


def test_functions_with_a_sharp_bend_and_with_a_leap() -> None:
    """A plain secant keeps one end of a function that bends: after 12 steps it is 0.08 from the zero of the first."""
    rises = [lambda x: x - 0.3, lambda x: np.exp(8 * x) - 2.0, lambda x: 1.0 - np.exp(8 * (0.4 - x))]
    leap = [lambda x: -1.0 if x < 0.37 else 3.0]
    found = zeros(rises + leap, np.zeros(4), np.ones(4), 24)
    np.testing.assert_allclose(found[:3], [0.3, np.log(2.0) / 8, 0.4], atol=1e-9)
    assert found[3] == pytest.approx(0.37, abs=1e-3)


def test_some_of_them_alone() -> None:
    brackets = Brackets(np.zeros(3), np.ones(3), np.array([-1.0, -1.0, -3.0]), np.ones(3))
    np.testing.assert_allclose(brackets.secants(np.array([1, 2])), [0.5, 0.75])
    brackets.narrow(np.array([2]), np.array([0.75]), np.array([-1.0]))
    np.testing.assert_allclose(brackets.secants(np.arange(3)), [0.5, 0.5, 0.875])
