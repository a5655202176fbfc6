"""What is implausible about a model itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

import numpy as np

from postproc.base.findings import Finding
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM, are_radians
from postproc.effects import Load
from postproc.model.mechanics import Mechanics
from postproc.robot.geometries import KukaLengths, KukaVariant

IMPLAUSIBLE_SAG = 0.5 * DEG
"""A joint that its own balancer deflects this far is not balanced: some ten times what weight does to a heavy arm."""

FARTHEST = 12.0
"""[m] The links of an arm with its foot are shorter together; a rail is no link."""

SHORT = 5.0 * MM
"""The links of an arm that carries a spindle are longer, or have no length."""


def find_implausible(model: Mechanics) -> list[Finding]:
    """``StiffnessModel.plausibility_findings``: see there."""
    limits = model.robot.limits
    angles = np.linspace(limits[:, 0], limits[:, 1], 181)
    state = model.state(angles, np.zeros((len(angles), 6)), Poses.identity())
    findings = [*_links(model), *_angles(model), *_parameters(model)]
    for term in model.terms:
        if not isinstance(term.effect, Load):
            continue
        force, slope = np.zeros_like(state.rest), np.zeros_like(state.rest)
        term.effect.add_force(term.values, state, force, slope)
        sag, _ = model.displacement(state, force)
        sag = np.abs(sag[model.chain.motor_rows])
        force = force[model.chain.motor_rows]
        joint, at = np.unravel_index(np.argmax(sag), sag.shape)
        if sag[joint, at] > IMPLAUSIBLE_SAG:
            findings.append(
                Finding(
                    "MOD001",
                    f"{term.effect.name}: {abs(force[joint, at]):.0f} N m on {model.robot.joints[joint].name} at"
                    f" {angles[at, joint] / DEG:.0f} deg would deflect it by {sag[joint, at] / DEG:.2f} deg",
                    str(model.robot.path),
                    term.line,
                    help="state `preload: balanced` if only the change of its torque acts",
                )
            )
    return findings


def _links(model: Mechanics) -> Iterator[Finding]:
    """Links that are short or long as if they were in another unit."""
    reach = sum(float(np.linalg.norm(joint.placement.position)) for joint in model.robot.joints)
    if reach > FARTHEST:
        message = f"the arm is {reach:.4g} m long: the unit of its lengths is probably another one"
        yield Finding(
            "MOD004", message, str(model.robot.path), help="check the lengths of geometry and `unit`"
        )
    arm = model.robot.nominal
    lengths = arm.lengths if isinstance(arm, KukaVariant) else arm
    if not isinstance(lengths, KukaLengths):
        return
    for name, length in asdict(lengths).items():
        if 0.0 < abs(length) < SHORT:
            message = (
                f"geometry.kuka.{name} is {length / MM:g} mm; is it in another unit than the other lengths?"
            )
            yield Finding("MOD004", message, str(model.robot.path), help="check the length and `unit`")


def _angles(model: Mechanics) -> Iterator[Finding]:
    """Offsets of joints, and angles between their axes, that are round numbers if they are radians."""
    arm = model.robot.nominal
    stated = [
        (f"joints.{axis.name}: the offset", axis.offset / DEG)
        for axis in getattr(arm, "axes", ())
        if axis.kind == "revolute"
    ]
    for index, link in enumerate(arm.links()):
        for pose in (link.before, link.after):
            x, z = pose.rotation[:, 0], pose.rotation[:, 2]
            sizes = np.arccos(np.clip(z[2], -1.0, 1.0)), np.arctan2(x[1], x[0])
            stated += [
                (f"geometry: an angle of the frame of joint {index + 1}", float(angle) / DEG)
                for angle in sizes
            ]
    for what, angle in stated:
        if are_radians([round(angle, 9)]):
            message = f"{what} is {angle:.6g} deg, a round number if it is {angle:.6g} rad"
            yield Finding("MOD004", message, str(model.robot.path), help="check the angle and its unit")


def _parameters(model: Mechanics) -> Iterator[Finding]:
    """Parameters that built hardware does not have, whatever lies within their intervals."""
    for index, term in enumerate(model.terms):
        for parameter in term.effect.parameters:
            value = abs(term.values[parameter.name])
            stated = term.stated.get(parameter.name)
            width = 0.0 if stated is None or stated.interval is None else stated.interval
            low, high = parameter.plausible
            if value > 0.0 and (value + width < low or value - width > high):
                yield Finding(
                    "MOD004",
                    f"{model.label(index)}.{parameter.name} is {value:g} {parameter.unit}; built hardware has"
                    f" {low:g} to {high:g} {parameter.unit}",
                    str(model.robot.path),
                    term.line,
                    help="check the value and its unit",
                )
