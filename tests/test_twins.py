"""Effects that predict the same at every pose and under every load: no reading separates them, only an inspection."""

import numpy as np
import pytest
from measured import robot

from postproc.base.geometry import Poses
from postproc.effects import EFFECTS
from postproc.identification.unknowns import unknowns_of
from postproc.model import StiffnessModel

SAME, APART = 1e-7, 1e-2
"""Share of what one parameter does that lies outside of all that another effect can do."""

TOOL = Poses(np.eye(3), np.array([0.1, 0.5, 0.3]))
POINTS = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.3, 0.1]])
"""[m] Measured, in the frame of the tool: so each pose gives all six numbers."""

TWINS = {
    ("base_compliance", "c_rx", ("link_compliance", "A1")),
    ("base_compliance", "c_ry", ("link_compliance", "A1")),
    ("link_compliance", "c1x", ("base_compliance", "")),
    ("link_compliance", "c1y", ("base_compliance", "")),
    ("joint_compliance", "c4", ("link_compliance", "A5")),
    ("link_compliance", "c5y", ("joint_compliance", "A4")),
    ("joint_compliance", "c5", ("link_compliance", "A6")),
    ("link_compliance", "c6y", ("joint_compliance", "A5")),
}
"""Effect, its parameter, and the effect on a joint that can do the same."""

TURNED = {
    ("base_compliance", "c_rz", ("joint_compliance", "A1")),
    ("joint_compliance", "c1", ("base_compliance", "")),
}
"""The same of what no weight shows, but a pull sideways."""


def deflections(q, wrench):
    """{(effect, joint): {parameter: (n,)}} the derivative [m per usual size] of what is measured at ``q`` (N, 6) [rad]
    under ``wrench`` (N, 6) [N, N m] against no load."""
    arm = StiffnessModel.from_robot(robot("kuka_kr270")).without_effects(["gravity_compensator"])
    found: dict[tuple[str, str], dict[str, np.ndarray]] = {}
    for name in ("joint_compliance", "base_compliance", "link_compliance"):
        own = [k for k, term in enumerate(arm.terms) if term.effect.name == name]
        model = arm if own else arm.with_effect(EFFECTS[name](arm.robot.joints))
        term = own[0] if own else len(arm.terms)

        def places(model, load):
            pose = model.equilibrium(q, load, TOOL).pose
            return pose.position[:, None] + POINTS @ np.swapaxes(pose.rotation, 1, 2)

        for unknown in unknowns_of(model, term):
            value, step = model.terms[term].values[unknown.parameter.name], 1e-2 * unknown.parameter.scale
            ends = [model.with_values({unknown.key: value + by}) for by in (-step, step)]
            low, high = (places(end, wrench) - places(end, 0.0 * wrench) for end in ends)
            column = ((high - low) / (2e-2)).reshape(-1)
            found.setdefault((name, unknown.parameter.joint), {})[unknown.parameter.name] = column
    return found


def alike(found, least=1e-7):
    """Triples as in ``TWINS`` with the share outside, of what moves anything."""
    shares = {}
    for one, own in found.items():
        for name, column in own.items():
            for other, others in found.items():
                columns = [c for c in others.values() if np.linalg.norm(c) > least]
                if other == one or not columns or np.linalg.norm(column) < least:
                    continue
                basis = np.linalg.qr(np.stack(columns, axis=1))[0]
                rest = column - basis @ (basis.T @ column)
                shares[one[0], name, other] = np.linalg.norm(rest) / np.linalg.norm(column)
    return shares


@pytest.mark.parametrize("pulled", [False, True])
def test_no_pose_and_no_load_separates_twins(pulled):
    """300 poses in the whole range of the axes, each under a weight or under any force and moment: what is said to be
    the same is, and nothing else is nearly so."""
    rng = np.random.default_rng(0)
    q = rng.uniform(*robot("kuka_kr270").limits.T, (300, 6))
    wrench = np.zeros((300, 6))
    wrench[:, 2] = -rng.uniform(500.0, 2600.0, 300)
    if pulled:
        wrench = rng.normal(size=(300, 6)) * np.repeat([1000.0, 300.0], 3)
    shares = alike(deflections(q, wrench))
    expected = TWINS | TURNED if pulled else TWINS
    assert {triple for triple, share in shares.items() if share < SAME} == expected
    assert {triple for triple, share in shares.items() if share < APART} == expected


@pytest.mark.parametrize("pulled", [False, True])
def test_tilts_of_a_wrist_are_one_class_beside_the_springs_of_its_joints(pulled):
    """Two springs across each other, as stiff as each other, give way alike in every direction of their plane: so
    the tilt of A5 is one of A6 and other springs of A4 and A6.  Beside these, fitted too, no load separates it."""
    rng = np.random.default_rng(1)
    q = rng.uniform(*robot("kuka_kr270").limits.T, (300, 6))
    wrench = np.zeros((300, 6))
    wrench[:, 2] = -rng.uniform(500.0, 2600.0, 300)
    if pulled:
        wrench = rng.normal(size=(300, 6)) * np.repeat([1000.0, 300.0], 3)
    found = deflections(q, wrench)
    springs = {
        name: c
        for (effect, _), own in found.items()
        if effect == "joint_compliance"
        for name, c in own.items()
    }
    beside = {key: own | springs for key, own in found.items() if key[0] == "link_compliance"}
    shares = {
        (name, other[1]): share
        for (effect, name, other), share in alike(beside).items()
        if name in ("c2y", "c3x", "c3y", "c4x", "c4y", "c5x", "c6x")
    }
    same = {("c5x", "A4"), ("c5x", "A6"), ("c6x", "A4"), ("c6x", "A5")}
    assert {pair for pair, share in shares.items() if share < SAME} == same
    assert {pair for pair, share in shares.items() if share < APART} == same
