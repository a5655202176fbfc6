"""Effects with values, for tests over the whole table: nothing here knows any effect by name.

An effect is made with its defaults; how large a value is follows from its parameter alone.
"""

from dataclasses import replace

import numpy as np

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.effects import EFFECTS, ComplianceLaw, Conditions
from postproc.model import EffectInstance, StiffnessModel
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint


def made(name, joints):
    return EFFECTS[name](joints)


def nulls(effect):
    return {parameter.name: parameter.null for parameter in effect.parameters}


def sampled(effect, rng):
    """Values between half of their size and the whole, within the bounds, of both signs where they may be."""
    values = {}
    for p in effect.parameters:
        sign = rng.choice([-1.0, 1.0]) if p.lower < 0 else 1.0
        values[p.name] = float(np.clip(sign * rng.uniform(0.5, 1.0) * p.scale, p.lower, p.upper))
    return values


def conditions(count, rng, payload=False, joints=6):
    """All that may be known of ``count`` states."""
    spindle = rng.normal(size=(count, 3))
    return Conditions(
        spindle=spindle / np.linalg.norm(spindle, axis=1, keepdims=True),
        direction=rng.integers(-1, 2, (count, joints)).astype(float),
        temperature=rng.uniform(-5.0, 25.0, count),
        time=rng.uniform(0.0, 3600.0, count),
        payload_mass=rng.uniform(10.0, 50.0, count) if payload else None,
        payload_com=rng.uniform(-0.2, 0.2, (count, 3)) if payload else None,
    )


def with_terms(model, *pairs):
    """The model with more effects: (effect, values)."""
    return replace(
        model, terms=(*model.terms, *(EffectInstance(effect, values, {}) for effect, values in pairs))
    )


def elastic(robot, rng):
    """A model that gives way everywhere it can in proportion to force: every such law of the table."""
    laws = [made(name, robot.joints) for name, e in EFFECTS.items() if issubclass(e, ComplianceLaw)]
    pairs = [(law, sampled(law, rng)) for law in laws if law.family == "elastic"]
    return with_terms(StiffnessModel(robot, ()), *pairs)


TOOL = Poses(rotation_from_vector([0.2, 0.5, -0.1]), np.array([0.12, -0.05, 0.25]))


def every_coordinate(joints):
    """A chain that has all extra coordinates there are."""
    six = ("x", "y", "z", "rx", "ry", "rz")
    sites = ["base", "tool", *(joint.name for joint in joints)]
    extras = [f"{site}.{word}" for site in sites for word in six]
    extras += [f"{joint.name}.growth" for joint in joints] + [f"spindle.{axis}" for axis in "xyz"]
    flange = Poses(rotation_from_vector([0.3, -0.2, 0.4]), np.array([0.05, 0.1, 0.2]))
    return Chain(joints, flange, extras)


def random_arm(rng, kinds="rrrrrr"):
    """Joints that lie anyhow to each other; ``kinds``: r turns, p slides."""
    return tuple(
        Joint(
            f"J{i}",
            Poses(rotation_from_vector(rng.uniform(-2.0, 2.0, 3)), rng.uniform(-0.7, 0.7, 3)),
            -2.5,
            2.5,
            "revolute" if kind == "r" else "prismatic",
        )
        for i, kind in enumerate(kinds, 1)
    )
