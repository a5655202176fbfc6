"""The stiffness model: one chain, the effects of a robot file with their values, and their equilibrium."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc.arrays import Bools, Floats
from postproc.effects import EFFECTS, ComplianceLaw, Effect, Load, Values
from postproc.findings import Finding, nearest
from postproc.geometry import Poses
from postproc.robot.chain import Chain, generalized_force, tcp_position
from postproc.robot.description import Robot, Value, parameter_value
from postproc.units import DEG

CHUNK = 8192
"""States evaluated at once: small enough for the arrays of a sweep to stay in the cache."""

STEP_TOLERANCE = 1e-14
"""Largest last step of the equilibrium [rad]; the next error is smaller by the rate of convergence."""

MAX_STEPS = 60

IMPLAUSIBLE_SAG = 0.5 * DEG
"""A joint that its own balancer bends this far is not balanced: some ten times what weight does to a heavy arm."""


@dataclass(frozen=True)
class Term:
    """An effect of the model with the values of its parameters (SI) and what the robot file says of them."""

    effect: Effect
    values: Values
    stated: dict[str, Value]
    line: int = 0


@dataclass(frozen=True)
class Equilibrium:
    """Loaded states: ``coordinates`` (N, n) [rad], motor angle plus displacement; ``pose`` of the TCP in the robot
    base; ``converged`` (N,): a stable equilibrium was found; ``steps`` iterations of the slowest state."""

    coordinates: Floats
    pose: Poses
    converged: Bools
    steps: int


@dataclass(frozen=True)
class StiffnessModel:
    """Chain and effects of one robot; immutable."""

    robot: Robot
    terms: tuple[Term, ...]

    @classmethod
    def from_robot(cls, robot: Robot) -> StiffnessModel:
        """The model that a robot file describes.  Raises Refusal with file, line and key."""
        names = tuple(joint.name for joint in robot.joints)
        terms: list[Term] = []
        for entry in robot.effects:
            section = entry.section
            if entry.name not in EFFECTS:
                raise section.error(
                    "YML004",
                    f"{entry.name!r} is no effect{nearest(entry.name, EFFECTS)}",
                    "effect",
                    "known effects: " + ", ".join(EFFECTS),
                )
            section.only("effect", "options", "parameters")
            effect = EFFECTS[entry.name].from_options(section.section("options", {}), names)
            for term in terms:
                if (term.effect.name, term.effect.described()) == (effect.name, effect.described()):
                    raise section.error("YML004", f"the same effect stands in line {term.line}", "effect")
            given = section.section("parameters")
            given.only(*(parameter.name for parameter in effect.parameters))
            stated, values = {}, {}
            for parameter in effect.parameters:
                values[parameter.name] = parameter.null
                if parameter.name not in given:
                    continue
                value = parameter_value(given.section(parameter.name), parameter.unit)
                if not parameter.lower <= value.value <= parameter.upper:
                    raise given.error(
                        "YML004",
                        f"{value.value:g} {parameter.unit} is not within"
                        f" {parameter.lower:g} .. {parameter.upper:g} {parameter.unit}",
                        parameter.name,
                    )
                stated[parameter.name], values[parameter.name] = value, value.value
            terms.append(Term(effect, values, stated, section.line))
        return cls(robot, tuple(terms))

    def without(self, effects: Iterable[str] = (), families: Iterable[str] = ()) -> StiffnessModel:
        """The model with some effects, or families of effects, taken out."""
        names, kinds = set(effects), set(families)
        kept = (t for t in self.terms if t.effect.name not in names and t.effect.family not in kinds)
        return replace(self, terms=tuple(kept))

    def changed(self, term: int, parameter: str, value: float) -> StiffnessModel:
        """The model with another value (SI) of one parameter of its ``term``-th effect."""
        old = self.terms[term]
        new = replace(old, values={**old.values, parameter: value})
        return replace(self, terms=(*self.terms[:term], new, *self.terms[term + 1 :]))

    @cached_property
    def chain(self) -> Chain:
        return Chain(self.robot.joints, self.robot.flange)

    def equilibrium(self, q: Floats, wrench: Floats, tool: Poses) -> Equilibrium:
        """Where the robot comes to rest with its motors at ``q`` (N, n) [rad] under ``wrench`` (N, 6) [N, N m] at the
        TCP, robot base axes; ``tool``: TCP on the flange, one pose or N.

        Solves theta = C(J(q + theta)^T w + loads(q + theta)), the balance on the deflected pose, by a Newton
        iteration with the diagonal of the loads' and laws' derivatives; the small rest of the Jacobian (the
        wrench's lever moving with the pose) makes it linear with a rate of about 5e-3.
        """
        count = len(q)
        coordinates, converged, steps = np.empty_like(q), np.empty(count, bool), 0
        rotation, position = np.empty((count, 3, 3)), np.empty((count, 3))
        for start in range(0, count, CHUNK):
            rows = slice(start, start + CHUNK)
            part = self._equilibrium(
                np.ascontiguousarray(q[rows].T), np.ascontiguousarray(wrench[rows].T), _rows(tool, rows)
            )
            coordinates[rows], converged[rows] = part.coordinates, part.converged
            rotation[rows], position[rows] = part.pose.rotation, part.pose.position
            steps = max(steps, part.steps)
        return Equilibrium(coordinates, Poses(rotation, position), converged, steps)

    def _equilibrium(self, q: Floats, wrench: Floats, tool: Poses) -> Equilibrium:
        theta = np.zeros_like(q)
        step = np.full(q.shape, np.inf)
        swept = self.chain.sweep(q)
        stable = np.ones(q.shape[1], bool)
        steps = 0
        while self.terms and steps < MAX_STEPS:
            force = generalized_force(swept, tcp_position(swept, tool), wrench)
            slope = np.zeros_like(force)
            for term in self.terms:
                if isinstance(term.effect, Load):
                    extra, extra_slope = term.effect.force(term.values, q + theta, q)
                    force += extra
                    slope += extra_slope
            target, compliance = np.zeros_like(force), np.zeros_like(force)
            for term in self.terms:
                if isinstance(term.effect, ComplianceLaw):
                    bent, gives = term.effect.displacement(term.values, force)
                    target += bent
                    compliance += gives
            # A load that pushes away faster than the joint holds (C dM/dq >= 1) has no stable rest.
            stiffening = 1.0 - compliance * slope
            stable &= (stiffening > 0).all(axis=0)
            step = (target - theta) / np.where(stiffening > 0, stiffening, np.inf)
            theta += step
            steps += 1
            swept = self.chain.sweep(q + theta)
            if not np.nanmax(np.abs(step), initial=0.0) > STEP_TOLERANCE:
                break
        rested = (np.abs(step) < 1e-11).all(axis=0) if self.terms else np.isfinite(q).all(axis=0)
        turned = np.moveaxis(swept.rotation, -1, 0) @ tool.rotation
        pose = Poses(turned, np.ascontiguousarray(tcp_position(swept, tool).T))
        return Equilibrium(
            (q + theta).T, pose, stable & rested & np.isfinite(pose.position).all(axis=1), steps
        )

    def joint_compliance(self, q: Floats) -> Floats:
        """(N, n) [rad/(N m)] compliance of each coordinate, unloaded: 1 / (K_theta^0 + K_theta^GC(q)), eq. (6)."""
        angles = np.ascontiguousarray(q.T)
        force, slope = np.zeros_like(angles), np.zeros_like(angles)
        for term in self.terms:
            if isinstance(term.effect, Load):
                extra, extra_slope = term.effect.force(term.values, angles, angles)
                force, slope = force + extra, slope + extra_slope
        gives = np.zeros_like(angles)
        for term in self.terms:
            if isinstance(term.effect, ComplianceLaw):
                gives = gives + term.effect.displacement(term.values, force)[1]
        return np.asarray((gives / (1.0 - gives * slope)).T)

    def linear_deflection(self, q: Floats, wrench: Floats, tool: Poses) -> Floats:
        """Deflection twists (N, 6) [m, rad] of the TCP by eq. (5), linearized at ``q``: J K_theta^-1 J^T w."""
        jacobian = self.chain.jacobian(q, tool)
        torque = np.einsum("nij,ni->nj", jacobian, wrench)
        return np.einsum("nij,nj->ni", jacobian, self.joint_compliance(q) * torque)

    def cartesian_stiffness(self, q: Floats, tool: Poses) -> Floats:
        """K_C = (J K_theta^-1 J^T)^-1 (N, 6, 6) [N/m, N/rad, ...], eq. (5); robot base axes, unloaded.

        Raises numpy.linalg.LinAlgError where a rigid joint or a singularity leaves a direction without compliance.
        """
        jacobian = self.chain.jacobian(q, tool)
        compliance = np.einsum("nij,nj,nkj->nik", jacobian, self.joint_compliance(q), jacobian)
        return np.asarray(np.linalg.inv(compliance))

    def doubts(self) -> list[Finding]:
        """What is implausible about the model itself: a load that, with no force on the tool, bends a joint by
        more than ``IMPLAUSIBLE_SAG`` somewhere within its limits (MOD001)."""
        limits = self.robot.limits
        angles = np.linspace(limits[:, 0], limits[:, 1], 181).T
        findings = []
        for term in self.terms:
            if not isinstance(term.effect, Load):
                continue
            force = term.effect.force(term.values, angles, angles)[0]
            sag = np.zeros_like(force)
            for law in self.terms:
                if isinstance(law.effect, ComplianceLaw):
                    sag += np.abs(law.effect.displacement(law.values, force)[0])
            joint, state = np.unravel_index(np.argmax(sag), sag.shape)
            if sag[joint, state] > IMPLAUSIBLE_SAG:
                findings.append(
                    Finding(
                        "MOD001",
                        f"{term.effect.name}: {abs(force[joint, state]):.0f} N m on {self.robot.joints[joint].name} at"
                        f" {angles[joint, state] / DEG:.0f} deg would bend it by {sag[joint, state] / DEG:.2f} deg",
                        str(self.robot.path),
                        term.line,
                        help="with `preload: balanced` only the change of its torque acts",
                    )
                )
        return findings


def _rows(tool: Poses, rows: slice) -> Poses:
    return tool if tool.position.ndim == 1 else tool[rows]
