"""At which joints an effect is that was fitted to all of them."""

from types import SimpleNamespace

import numpy as np
import pytest

from postproc.diagnosis.candidates import EVERY
from postproc.diagnosis.verdict import clear_joints

JOINTS = 6


def fitted(values, covariance):
    """``values`` (6, 2) of two parameters a joint, and their ``covariance`` (12, 12): candidate, estimates, fit."""
    unknowns = [
        SimpleNamespace(key=(0, f"p{k}"), parameter=SimpleNamespace(joint=f"A{k // 2 + 1}", null=0.0))
        for k in range(2 * JOINTS)
    ]
    estimates = [SimpleNamespace(unknown=u, value=v) for u, v in zip(unknowns, np.ravel(values), strict=True)]
    fit = SimpleNamespace(unknowns=unknowns, covariance=covariance, freedom=300)
    return SimpleNamespace(joint=EVERY), estimates, fit


def test_two_parameters_of_which_only_the_sum_is_determined_are_clear_together():
    values, covariance = np.zeros((JOINTS, 2)), np.eye(2 * JOINTS)
    values[3] = 5.0, 5.0
    covariance[6:8, 6:8] = [[100.0, -99.5], [-99.5, 100.0]]
    assert clear_joints(*fitted(values, covariance)) == ("A4",)


def test_chance_names_no_joint_more_often_than_once_in_twenty():
    rng, wrong = np.random.default_rng(0), 0
    for _ in range(400):
        wrong += bool(clear_joints(*fitted(rng.normal(size=(JOINTS, 2)), np.eye(2 * JOINTS))))
    assert wrong <= 32  # 0.05 * 400, and three standard deviations


@pytest.mark.parametrize("size", [6.0, -6.0])
def test_every_joint_that_is_off_is_named(size):
    values = np.zeros((JOINTS, 2))
    values[[0, 4], [1, 0]] = size
    assert clear_joints(*fitted(values, np.eye(2 * JOINTS))) == ("A1", "A5")
