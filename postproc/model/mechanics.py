"""Chain and effects of one robot, and what they do in a state: forces, displacements, places without load."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Floats, frozen
from postproc.base.geometry import Poses
from postproc.effects import ChainState, ComplianceLaw, Conditions, Effect, Load, Offset, Values
from postproc.robot.chain import Chain, add_to_leaders, generalized_force
from postproc.robot.description import Robot, Value

STILL = 1e-9
"""[rad, m] A motor that moves less is at rest: it is the rounding of an inverse kinematics, not a motion."""

STANDARD_GRAVITY = 9.80665
"""[m/s2]"""

NOTHING = Conditions()
"""Nothing else is known of the states."""


@dataclass(frozen=True)
class EffectInstance:
    """An effect of the model with the values of its parameters (SI) and what the robot file states of them."""

    effect: Effect
    values: Values
    stated: dict[str, Value]
    line: int = 0


@dataclass(frozen=True)
class Mechanics:
    """Chain and effects of one robot; immutable.  ``gravity`` (3,) [m/s2] in axes of the robot base.

    ``covariance``: labelled names (k,) of parameters that were fitted together, and their covariance (k, k) in SI.
    """

    robot: Robot
    terms: tuple[EffectInstance, ...]
    gravity: Floats = field(default_factory=lambda: frozen([0.0, 0.0, -STANDARD_GRAVITY], (3,)))
    covariance: tuple[tuple[str, ...], Floats] | None = None

    def label(self, term: int) -> str:
        """The name of its ``term``-th effect, with a number from the second of that name on."""
        name = self.terms[term].effect.name
        earlier = sum(other.effect.name == name for other in self.terms[:term])
        return f"{name}#{earlier + 1}" if earlier else name

    @cached_property
    def chain(self) -> Chain:
        """The joints, with the extra coordinates that the effects need and no others."""
        extras = [name for term in self.terms for name in term.effect.coordinates]
        return Chain(self.robot.joints, self.robot.flange, extras)

    @cached_property
    def by_direction(self) -> bool:
        """Whether it asks how the joints came to their places."""
        return any(term.effect.by_direction for term in self.terms)

    @cached_property
    def by_gravity(self) -> bool:
        """Whether an offset asks where down is."""
        return any(term.effect.by_gravity for term in self.terms)

    @cached_property
    def gaps(self) -> Floats:
        """(n,) [rad, m] lost motion of each joint at a reversal: what is in series adds up."""
        total = np.zeros(len(self.robot.joints))
        for term in self.terms:
            if term.effect.by_direction:
                total += term.effect.gaps(term.values)
        return total

    @cached_property
    def zero_without_load(self) -> bool:
        """Whether the robot is, without a wrench, at the pose that its controller assumes."""
        return self.robot.nominal is self.robot.arm and all(
            term.effect.zero_without_load for term in self.terms
        )

    @property
    def is_compliant(self) -> bool:
        """Whether any force moves the tool."""
        return bool(self.laws)

    @cached_property
    def laws(self) -> list[tuple[ComplianceLaw, Values]]:
        return [(t.effect, t.values) for t in self.terms if isinstance(t.effect, ComplianceLaw)]

    @cached_property
    def loads(self) -> list[tuple[Load, Values]]:
        return [(t.effect, t.values) for t in self.terms if isinstance(t.effect, Load)]

    def state(
        self,
        q: Floats,
        wrench: Floats,
        tool: Poses,
        conditions: Conditions = NOTHING,
        displacement: Floats | None = None,
    ) -> ChainState:
        """What effects see of N states at motors ``q`` (N, n) [rad, m] under ``wrench`` (N, 6) [N, N m]: at rest, or
        displaced by ``displacement`` (N, m) [rad, m]."""
        conditions = self.completed(q, conditions)
        motors = np.ascontiguousarray(q.T)
        rest = self.rest(motors, conditions)
        coordinates = rest if displacement is None else rest + displacement.T
        swept = self.chain.evaluate(coordinates, tool, conditions.spindle)
        return ChainState(
            self.chain,
            self.gravity,
            motors,
            rest,
            coordinates,
            swept,
            np.asarray(wrench, float).T,
            conditions,
        )

    def completed(self, q: Floats, conditions: Conditions) -> Conditions:
        """The conditions, with senses of approach from the order of ``q`` (N, n) and where down is, where effects ask
        for these."""
        if conditions.direction is None and self.by_direction:
            conditions = replace(conditions, direction=approach(q))
        if conditions.down is None and self.by_gravity:
            down = self.gravity / np.linalg.norm(self.gravity)
            conditions = replace(conditions, down=np.broadcast_to(down, (len(q), 3)))
        return conditions

    def rest(self, motors: Floats, conditions: Conditions) -> Floats:
        """(m, N) [rad, m] coordinates without load: ``motors`` (n, N) [rad, m] and offsets."""
        rest = np.zeros((self.chain.size, motors.shape[1]))
        rest[self.chain.motors] = motors
        offset = np.zeros_like(rest)
        for term in self.terms:
            if isinstance(term.effect, Offset):
                term.effect.add_offset(term.values, self.chain, motors, conditions, offset)
        return rest + offset

    def forces(self, state: ChainState) -> tuple[Floats, Floats]:
        """Generalized forces (m, N) [N m, N] of wrench and loads, and the loads' derivatives (m, N), coordinate by
        coordinate."""
        return self.loaded(state, generalized_force(state.swept, state.swept.position, state.wrench))

    def loaded(self, state: ChainState, pushed: Floats) -> tuple[Floats, Floats]:
        """As ``forces``, two (m, N), where ``pushed`` (m, N) [N m, N] is what the wrench does alone."""
        force, slope = pushed.copy(), np.zeros_like(pushed)
        if not self.chain.couplings:
            for load, values in self.loads:
                load.add_force(values, state, force, slope)
            return force, slope
        own = np.zeros_like(pushed)
        for load, values in self.loads:
            load.add_force(values, state, own, slope)
        add_to_leaders(own, self.chain.couplings)
        for row, leader, ratio in self.chain.couplings:
            slope[leader] += ratio * ratio * slope[row]
        return force + own, slope

    def displacement(self, state: ChainState, force: Floats) -> tuple[Floats, Floats]:
        """Displacement (m, N) [rad, m] by all laws under ``force`` (m, N) [N m, N], and its derivative (m, N),
        coordinate by coordinate."""
        displacement, slope = np.zeros_like(force), np.zeros_like(force)
        for law, values in self.laws:
            law.add_displacement(values, state, force, displacement, slope)
        return displacement, slope

    def compliance(self, state: ChainState) -> Floats:
        """(N, m) [rad/(N m), m/N] compliance of each coordinate at ``state``, its own part of the loads' stiffness in
        it: 1 / (K_theta^0 + K_theta^GC(q)), eq. (6)."""
        force, slope = self.forces(state)
        _, gives = self.displacement(state, force)
        return np.asarray((gives / (1.0 - gives * slope)).T)


def approach(q: Floats) -> Floats:
    """(N, n) sense -1, 0, 1 in which each motor came to its place, from the order of the states ``q`` (N, n) [rad, m];
    the last one stays where a motor did not move by more than ``STILL``, and the first state has none."""
    travel = np.diff(q, axis=0, prepend=q[:1])
    moved = np.where(np.abs(travel) <= STILL, 0.0, np.sign(travel))
    last = np.maximum.accumulate(np.where(moved != 0, np.arange(len(q))[:, None], 0), axis=0)
    return np.take_along_axis(moved, last, axis=0)
