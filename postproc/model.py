"""The stiffness model: one chain, the effects of a robot file with their values, and their equilibrium."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from postproc.arrays import Bools, Floats, Ints, frozen
from postproc.effects import EFFECTS, ComplianceLaw, Conditions, Effect, Load, Offset, State, Values
from postproc.findings import Finding, nearest
from postproc.geometry import Poses
from postproc.robot.chain import Chain, Sweep, generalized_force, jacobian
from postproc.robot.description import Robot, Value, parameter_value
from postproc.units import DEG

CHUNK = 3 << 12
"""States evaluated at once: small enough for the arrays of a sweep to stay in the cache."""

TOLERANCE = 1e-14
"""[rad] What may be left of the way to the equilibrium behind its last step, by the rate of the steps before."""

ENOUGH = 1e-11
"""[rad] Last step of a state that is at rest after all, where it can not come to the one that was asked for."""

MAX_STEPS = 60

NUDGE = 1e-9
"""[rad, m] Where an equilibrium begins: beside the unloaded pose, so that a column pressed exactly along its line falls
over instead of standing on its tip."""

ROUNDS = 3
"""Times that ``motors_at`` looks at what depends on the motors."""

STILL = 1e-9
"""[rad, m] A motor that moves less stands still: it is the rounding of an inverse kinematics, not a motion."""

STANDARD_GRAVITY = 9.80665
"""[m/s2]"""

NOTHING = Conditions()
"""Nothing else is known of the states."""

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
    """Loaded states: ``coordinates`` (N, m) [rad, m], of them ``displacement`` (N, m) by load; ``pose`` of the TCP in
    the robot base, ``mount`` (N, 3) [m] its place without the spindle's own give; ``converged`` (N,): a stable
    equilibrium was found; ``steps`` iterations of the slowest state."""

    coordinates: Floats
    displacement: Floats
    pose: Poses
    mount: Floats
    converged: Bools
    steps: int

    def part(self, rows: Ints) -> Equilibrium:
        return Equilibrium(
            # component first, as they are made
            self.coordinates.T.take(rows, axis=1).T,
            self.displacement.T.take(rows, axis=1).T,
            self.pose[rows],
            self.mount.T.take(rows, axis=1).T,
            self.converged[rows],
            self.steps,
        )


def _at_rest(swept: Sweep, coordinates: Floats, theta: Floats, good: Bools, steps: int) -> Equilibrium:
    """Of coordinates and displacements (m, N); none where the TCP is nowhere."""
    good = good & np.isfinite(swept.position).all(axis=0)
    return Equilibrium(coordinates.T, theta.T, swept.pose, swept.mount.T, good, steps)


def _joined(count: int, parts: Sequence[tuple[Ints, Equilibrium]]) -> Equilibrium:
    """``count`` states of which each part has its own."""
    rows, order = np.concatenate([rows for rows, _ in parts]), np.empty(count, np.int64)
    order[rows] = np.arange(count)
    in_order = bool((rows[1:] > rows[:-1]).all())

    def whole(take: Callable[[Equilibrium], Any]) -> Any:
        joined = np.concatenate([take(rest) for _, rest in parts])
        return joined if in_order else joined.take(order, axis=0)

    return Equilibrium(
        whole(lambda rest: rest.coordinates),
        whole(lambda rest: rest.displacement),
        Poses(whole(lambda rest: rest.pose.rotation), whole(lambda rest: rest.pose.position)),
        whole(lambda rest: rest.mount),
        whole(lambda rest: rest.converged),
        max(rest.steps for _, rest in parts),
    )


@dataclass(frozen=True)
class _Problems:
    """N states to be solved, component first: motors (n, N), rest (m, N), wrench (6, N)."""

    motors: Floats
    rest: Floats
    wrench: Floats
    tool: Poses
    conditions: Conditions

    def part(self, rows: Ints) -> _Problems:
        return _Problems(
            self.motors.take(rows, axis=1),
            self.rest.take(rows, axis=1),
            self.wrench.take(rows, axis=1),
            self.tool if self.tool.position.ndim == 1 else self.tool[rows],
            self.conditions.part(rows),
        )


@dataclass(frozen=True)
class StiffnessModel:
    """Chain and effects of one robot; immutable.  ``gravity`` (3,) [m/s2] in axes of the robot base.

    ``covariance``: labelled names (k,) of parameters that were fitted together, and their covariance (k, k) in SI.
    """

    robot: Robot
    terms: tuple[Term, ...]
    gravity: Floats = field(default_factory=lambda: frozen([0.0, 0.0, -STANDARD_GRAVITY], (3,)))
    covariance: tuple[tuple[str, ...], Floats] | None = None

    @classmethod
    def from_robot(cls, robot: Robot) -> StiffnessModel:
        """The model that a robot file describes.  Raises Refusal with file, line and key."""
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
            effect = EFFECTS[entry.name].from_options(section.section("options", {}), robot.joints)
            for term in terms:
                if (term.effect.name, term.effect.described()) == (effect.name, effect.described()):
                    raise section.error("YML004", f"the same effect stands in line {term.line}", "effect")
            given = section.section("parameters", {})
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
        model = cls(robot, tuple(terms))
        return replace(model, covariance=model._stated_covariance())

    def without(self, effects: Iterable[str] = (), families: Iterable[str] = ()) -> StiffnessModel:
        """The model with some effects, or families of effects, taken out."""
        names, kinds = set(effects), set(families)
        kept = (t for t in self.terms if t.effect.name not in names and t.effect.family not in kinds)
        model = replace(self, terms=tuple(kept))
        return replace(model, covariance=_part(self.covariance, dict(model._labelled())))

    def changed(self, values: Mapping[tuple[int, str], float]) -> StiffnessModel:
        """The model with other values (SI) of some parameters: (index of the effect in ``terms``, name) -> value."""
        if not values:
            return self
        terms = list(self.terms)
        for (term, parameter), value in values.items():
            terms[term] = replace(terms[term], values={**terms[term].values, parameter: value})
        new = replace(self, terms=tuple(terms))
        # the same effects need the same chain
        vars(new)["chain"] = self.chain
        return new

    def label(self, term: int) -> str:
        """The name of its ``term``-th effect, with a number from the second of that name on."""
        name = self.terms[term].effect.name
        earlier = sum(other.effect.name == name for other in self.terms[:term])
        return f"{name}#{earlier + 1}" if earlier else name

    def _labelled(self) -> Iterator[tuple[str, Value | None]]:
        """Each parameter as label.name, and what the robot file says of it."""
        for index, term in enumerate(self.terms):
            for parameter in term.effect.parameters:
                yield f"{self.label(index)}.{parameter.name}", term.stated.get(parameter.name)

    def _stated_covariance(self) -> tuple[tuple[str, ...], Floats] | None:
        """D R D of the file's correlations R and standard deviations D; of what has a 95 % interval there still."""
        names, relation = self.robot.correlation
        stated = {name: value.deviation for name, value in self._labelled() if value and value.level}
        deviation = np.array([stated.get(name) or 0.0 for name in names])
        return _part((names, relation * np.outer(deviation, deviation)), stated)

    def added(self, effect: Effect, stated: Mapping[str, Value] | None = None) -> StiffnessModel:
        """The model with one more effect, at its null values where ``stated`` says nothing."""
        known = dict(stated or {})
        values = {p.name: known[p.name].value if p.name in known else p.null for p in effect.parameters}
        return replace(self, terms=(*self.terms, Term(effect, values, known)))

    @cached_property
    def chain(self) -> Chain:
        """The joints, with the extra coordinates that the effects need and no others."""
        extras = (name for term in self.terms for name in term.effect.coordinates)
        return Chain(self.robot.joints, self.robot.flange, extras)

    def equilibrium(
        self,
        q: Floats,
        wrench: Floats,
        tool: Poses,
        conditions: Conditions = NOTHING,
        start: Floats | None = None,
        tolerance: float = TOLERANCE,
    ) -> Equilibrium:
        """Where the robot comes to rest with its motors at ``q`` (N, n) [rad, m] under ``wrench`` (N, 6) [N, N m] at
        the TCP, robot base axes; ``tool``: TCP on the flange, one pose or N.

        ``start`` (N, m): displacement to begin with, that of a state nearby; the result does not depend on it.
        ``tolerance`` [rad, m]: what may be left behind the last step, by the rate at which the steps became smaller.

        Solves theta = C(J^T w + loads) at coordinates rest + theta, the balance on the deflected pose, by a Newton
        iteration with the diagonal of the loads' and laws' derivatives.  What the diagonal leaves out (the lever of
        the wrench moving with the pose, weights) makes it linear with a rate of about 5e-3.
        """
        conditions = self._completed(q, conditions)
        parts: list[tuple[Ints, Equilibrium]] = []
        for begin in range(0, max(len(q), 1), CHUNK):
            rows = slice(begin, begin + CHUNK)
            motors, given = np.ascontiguousarray(q[rows].T), conditions.part(rows)
            there = _Problems(
                motors,
                self._rest(motors, given),
                np.ascontiguousarray(wrench[rows].T),
                tool if tool.position.ndim == 1 else tool[rows],
                given,
            )
            if start is None:
                aside = NUDGE * np.cos(np.arange(self.chain.size))
                theta = np.repeat(aside[:, None], motors.shape[1], axis=1)
            else:
                theta = np.array(start[rows].T, order="C")
            parts += ((begin + ended, rest) for ended, rest in self._ended(there, theta, tolerance))
        return parts[0][1] if len(parts) == 1 else _joined(len(q), parts)

    def _ended(self, given: _Problems, theta: Floats, tolerance: float) -> Iterator[tuple[Ints, Equilibrium]]:
        """The states in the order in which they come to rest: their numbers (K,) and where they do."""
        rows, steps = np.arange(theta.shape[1]), 0
        if not self._laws:
            swept = self.chain.sweep(given.rest, given.tool, given.conditions.spindle)
            yield rows, _at_rest(swept, given.rest, np.zeros_like(given.rest), np.ones(len(rows), bool), 0)
            return
        stable, last = np.ones(len(rows), bool), np.zeros(len(rows))
        while True:
            swept, step, holds = self._step(given, theta)
            theta += step
            steps += 1
            stable &= holds
            size = np.abs(step).max(axis=0)
            # of a geometric series; the first step says nothing of its rate
            left = np.where(size < last, size * size / np.where(size < last, last - size, 1.0), size)
            last, resting = size, left <= tolerance
            ends = ~(left > tolerance) if steps < MAX_STEPS else np.ones(len(rows), bool)
            if len(rows) and not ends.any():
                continue
            # The last step is so small that nothing has to be evaluated anew.  Each state stops at its own, whatever
            # the others do: what is found of it does not depend on them.
            good = stable & (resting | (size <= ENOUGH))
            there = _at_rest(swept.nudged(step), given.rest + theta, theta, good, steps)
            if ends.all():
                yield rows, there
                return
            ended, on = np.flatnonzero(ends), np.flatnonzero(~ends)
            yield rows[ended], there.part(ended)
            rows, stable, last = rows[on], stable[on], last[on]
            theta, given = theta.take(on, axis=1), given.part(on)

    def _step(self, given: _Problems, theta: Floats) -> tuple[Sweep, Floats, Bools]:
        """The chain at displacement ``theta`` (m, N), the step (m, N) of the iteration from there, and whether the
        diagonal holds (N,)."""
        coordinates = given.rest + theta
        swept = self.chain.sweep(coordinates, given.tool, given.conditions.spindle)
        state = State(
            self.chain,
            self.gravity,
            given.motors,
            given.rest,
            coordinates,
            swept,
            given.wrench,
            given.conditions,
        )
        force, slope = self._forces(state)
        target, compliance = self._displacement(state, force)
        # A load that pushes away faster than the joint holds (C dM/dq >= 1) has no stable rest.
        stiffening = 1.0 - compliance * slope
        holds = stiffening > 0
        step = (target - theta) / np.where(holds, stiffening, np.inf)
        return swept, step, np.asarray(holds.all(axis=0))

    def _displacement(self, state: State, force: Floats) -> tuple[Floats, Floats]:
        """Displacement (m, N) by all laws under ``force`` (m, N), and its derivative, coordinate by coordinate."""
        displacement, slope = np.zeros_like(force), np.zeros_like(force)
        for law, values in self._laws:
            law.add_displacement(values, state, force, displacement, slope)
        return displacement, slope

    def _completed(self, q: Floats, conditions: Conditions) -> Conditions:
        """The conditions, with the senses of approach from the order of ``q`` (N, n) where they are asked for."""
        if conditions.direction is None and any(term.effect.by_direction for term in self.terms):
            return replace(conditions, direction=approach(q))
        return conditions

    def _rest(self, motors: Floats, conditions: Conditions) -> Floats:
        """(m, N) coordinates without load: motors and offsets."""
        rest = np.zeros((self.chain.size, motors.shape[1]))
        rest[self.chain.motors] = motors
        offset = np.zeros_like(rest)
        for term in self.terms:
            if isinstance(term.effect, Offset):
                term.effect.add_offset(term.values, self.chain, motors, conditions, offset)
        return rest + offset

    def _forces(self, state: State) -> tuple[Floats, Floats]:
        """Generalized forces (m, N) of wrench and loads, and the loads' derivatives, coordinate by coordinate."""
        return self._loaded(state, generalized_force(state.swept, state.swept.position, state.wrench))

    def _loaded(self, state: State, pushed: Floats) -> tuple[Floats, Floats]:
        """As ``_forces``, of the wrench's own (m, N)."""
        force, slope = pushed.copy(), np.zeros_like(pushed)
        for load, values in self._loads:
            load.add_force(values, state, force, slope)
        return force, slope

    @cached_property
    def slack(self) -> bool:
        """Whether the robot stands, without a wrench, where its controller believes."""
        return self.robot.nominal is self.robot.arm and all(term.effect.slack for term in self.terms)

    @cached_property
    def _laws(self) -> list[tuple[ComplianceLaw, Values]]:
        return [(t.effect, t.values) for t in self.terms if isinstance(t.effect, ComplianceLaw)]

    @cached_property
    def _loads(self) -> list[tuple[Load, Values]]:
        return [(t.effect, t.values) for t in self.terms if isinstance(t.effect, Load)]

    def state(
        self,
        q: Floats,
        wrench: Floats,
        tool: Poses,
        conditions: Conditions = NOTHING,
        displacement: Floats | None = None,
    ) -> State:
        """What effects see of N states: at rest, or displaced by ``displacement`` (N, m)."""
        conditions = self._completed(q, conditions)
        motors = np.ascontiguousarray(q.T)
        rest = self._rest(motors, conditions)
        coordinates = rest if displacement is None else rest + displacement.T
        swept = self.chain.sweep(coordinates, tool, conditions.spindle)
        return State(
            self.chain,
            self.gravity,
            motors,
            rest,
            coordinates,
            swept,
            np.asarray(wrench, float).T,
            conditions,
        )

    def motors_at(
        self, coordinates: Floats, wrench: Floats, tool: Poses, conditions: Conditions = NOTHING
    ) -> tuple[Floats, Floats]:
        """Motors (N, n) that leave the loaded joints at ``coordinates`` (N, n), and the displacement (N, m) there.

        q = z - theta(z, q) - offsets(q): the chain is evaluated once, at z, and only what depends on the motors (a
        balanced load, an offset) is repeated.  Exact where only the joints give way; elsewhere a value to begin with.
        """
        conditions = self._completed(coordinates, conditions)
        state = self.state(coordinates, wrench, tool, conditions)
        rows, joints = self.chain.motor_rows, state.motors
        pushed = generalized_force(state.swept, state.swept.position, state.wrench)
        was, moved = joints, np.zeros_like(joints)
        for _ in range(ROUNDS):
            force, _ = self._loaded(state, pushed)
            theta, _ = self._displacement(state, force)
            motors = joints - theta[rows] - (state.rest[rows] - state.motors)
            before, moved = moved, motors - was
            if not moved.any():
                break
            state = replace(state, motors=motors, rest=self._rest(motors, conditions))
            was = motors
        # what is still to come, as the rest of a geometric series
        share = np.clip(moved / np.where(before == 0.0, np.inf, before), -0.5, 0.5)
        more = moved * share / (1.0 - share)
        theta[rows] -= more
        return np.asarray((motors + more).T), np.asarray(theta.T)

    def compliance(self, state: State) -> Floats:
        """(N, m) [rad/(N m), m/N] compliance of each coordinate at ``state``, its own part of the loads' stiffness in
        it: 1 / (K_theta^0 + K_theta^GC(q)), eq. (6)."""
        force, slope = self._forces(state)
        _, gives = self._displacement(state, force)
        return np.asarray((gives / (1.0 - gives * slope)).T)

    def joint_compliance(self, q: Floats) -> Floats:
        """(N, n) [rad/(N m)] compliance of the joints of the unloaded robot at ``q`` (N, n): eq. (6), inverted."""
        state = self.state(q, np.zeros((len(q), 6)), Poses.identity())
        return self.compliance(state)[:, self.chain.motor_rows]

    def linear_deflection(
        self, q: Floats, wrench: Floats, tool: Poses, conditions: Conditions = NOTHING
    ) -> Floats:
        """Deflection twists (N, 6) [m, rad] of the TCP by eq. (5), linearized at ``q`` (N, n): J K_theta^-1 J^T w."""
        state = self.state(q, np.zeros((len(q), 6)), tool, conditions)
        j = jacobian(state.swept)
        torque = np.einsum("nij,ni->nj", j, wrench)
        return np.einsum("nij,nj->ni", j, self.compliance(state) * torque)

    def cartesian_compliance(
        self, q: Floats, wrench: Floats | None, tool: Poses, conditions: Conditions = NOTHING
    ) -> Floats:
        """Change of the TCP's pose with a small wrench, (N, 6, 6) [m/N, rad/(N m), ...], robot base axes.

        Unloaded (``wrench`` None): J K_theta^-1 J^T, the inverse of eq. (5).  Loaded: at the equilibrium under
        ``wrench`` (N, 6), with the geometric stiffness: J (1 - C H)^-1 C J^T, H = d(J^T w + loads)/d(coordinates).
        """
        if wrench is None:
            state = self.state(q, np.zeros((len(q), 6)), tool, conditions)
            j = jacobian(state.swept)
            return np.einsum("nij,nj,nkj->nik", j, self.compliance(state), j)
        rest = self.equilibrium(q, wrench, tool, conditions)
        state = self.state(q, wrench, tool, conditions, rest.displacement)
        j = jacobian(state.swept)
        force, _ = self._forces(state)
        _, gives = self._displacement(state, force)
        c = gives.T[:, :, None] * np.eye(self.chain.size)
        every = np.arange(self.chain.size)
        inner = np.linalg.solve(np.eye(self.chain.size) - c @ self._curvature(state, tool, every), c)
        return np.asarray(j @ inner @ np.swapaxes(j, 1, 2))

    def cartesian_stiffness(
        self, q: Floats, tool: Poses, wrench: Floats | None = None, conditions: Conditions = NOTHING
    ) -> Floats:
        """K_C (N, 6, 6) [N/m, N/rad, ...], the inverse of ``cartesian_compliance``; eq. (5) without ``wrench``.

        Raises numpy.linalg.LinAlgError where a rigid joint or a singularity leaves a direction without compliance.
        """
        return np.asarray(np.linalg.inv(self.cartesian_compliance(q, wrench, tool, conditions)))

    def sensitivity(
        self,
        q: Floats,
        wrench: Floats,
        tool: Poses,
        conditions: Conditions,
        displacement: Floats,
        spans: Mapping[tuple[int, str], tuple[float, float]],
    ) -> Floats:
        """(N, m, P) derivative of the coordinates at rest by parameters (SI), at an equilibrium whose ``displacement``
        (N, m) is known; ``spans``: as for ``changed``, the two values of a parameter whose difference stands for it.

        By the implicit function of theta = D(F(z, rest)), z = rest + theta, with C = dD/dF:

            dz/dp = (1 - C dF/dz)^-1 (d rest/dp + C (dF/dp + dF/d rest d rest/dp) + dD/dp)

        The derivatives of F by coordinates are central differences of all states at once; nothing is solved anew.
        """
        state = self.state(q, wrench, tool, conditions, displacement)
        force, _ = self._forces(state)
        _, gives = self._displacement(state, force)
        own = np.empty((*displacement.shape, len(spans)))
        every = np.arange(self.chain.size)
        by_rest: Floats | None = None
        for k, ((term, name), ends) in enumerate(spans.items()):
            effect, values = self.terms[term].effect, self.terms[term].values
            low, high = (self._alone(effect, {**values, name: value}, state, force) for value in ends)
            moved = ((high - low) / (ends[1] - ends[0])).T
            if isinstance(effect, Load):
                moved = gives.T * moved
            elif isinstance(effect, Offset):
                if by_rest is None:
                    by_rest = gives.T[:, :, None] * self._curvature(state, tool, every, of_rest=True)
                moved = moved + (by_rest @ moved[:, :, None])[:, :, 0]
            own[:, :, k] = moved
        # what neither gives way nor is moved by a parameter stays where it is
        free = np.flatnonzero(gives.any(axis=1) | own.any(axis=(0, 2)))
        inner = np.eye(len(free)) - (gives.T[:, :, None] * self._curvature(state, tool, free))[:, free]
        own[:, free] = np.linalg.solve(inner, own[:, free])
        return own

    def _alone(self, effect: Effect, values: Values, state: State, force: Floats) -> Floats:
        """(m, N) what one effect adds: a force, an offset, or a displacement under ``force``."""
        found, slope = np.zeros_like(force), np.zeros_like(force)
        if isinstance(effect, Load):
            effect.add_force(values, state, found, slope)
        elif isinstance(effect, Offset):
            effect.add_offset(values, self.chain, state.motors, state.conditions, found)
        elif isinstance(effect, ComplianceLaw):
            effect.add_displacement(values, state, force, found, slope)
        return found

    def _curvature(self, state: State, tool: Poses, columns: Ints, of_rest: bool = False) -> Floats:
        """H (N, m, k): derivative of the generalized forces by k of the coordinates, or by the coordinates without load
        where those stay; central differences, many at once."""
        size, count, step = self.chain.size, state.motors.shape[1], 1e-6
        h = np.empty((count, size, len(columns)))
        at_once = max(1, CHUNK // max(1, 2 * count))
        for begin in range(0, len(columns), at_once):
            part = columns[begin : begin + at_once]
            rows = np.tile(np.arange(count), 2 * len(part))
            many = state.part(rows)
            moved = (many.rest if of_rest else many.coordinates).reshape(size, len(part), 2, count)
            moved[part, np.arange(len(part)), 0] += step
            moved[part, np.arange(len(part)), 1] -= step
            at = tool if tool.position.ndim == 1 else tool[rows]
            swept = self.chain.sweep(many.coordinates, at, many.conditions.spindle)
            force = self._forces(replace(many, swept=swept))[0].reshape(size, len(part), 2, count)
            slope = (force[:, :, 0] - force[:, :, 1]) / (2 * step)
            h[:, :, begin : begin + len(part)] = np.moveaxis(slope, 2, 0)
        return h

    @property
    def gives_way(self) -> bool:
        """Whether any force moves the tool."""
        return bool(self._laws)

    def doubts(self) -> list[Finding]:
        """What is implausible about the model itself: a load that, with no force on the tool, bends a joint by
        more than ``IMPLAUSIBLE_SAG`` somewhere within its limits (MOD001)."""
        limits = self.robot.limits
        angles = np.linspace(limits[:, 0], limits[:, 1], 181)
        state = self.state(angles, np.zeros((len(angles), 6)), Poses.identity())
        findings = []
        for term in self.terms:
            if not isinstance(term.effect, Load):
                continue
            force, slope = np.zeros_like(state.rest), np.zeros_like(state.rest)
            term.effect.add_force(term.values, state, force, slope)
            sag, _ = self._displacement(state, force)
            sag = np.abs(sag[self.chain.motor_rows])
            force = force[self.chain.motor_rows]
            joint, at = np.unravel_index(np.argmax(sag), sag.shape)
            if sag[joint, at] > IMPLAUSIBLE_SAG:
                findings.append(
                    Finding(
                        "MOD001",
                        f"{term.effect.name}: {abs(force[joint, at]):.0f} N m on {self.robot.joints[joint].name} at"
                        f" {angles[at, joint] / DEG:.0f} deg would bend it by {sag[joint, at] / DEG:.2f} deg",
                        str(self.robot.path),
                        term.line,
                        help="with `preload: balanced` only the change of its torque acts",
                    )
                )
        return findings


def _part(
    covariance: tuple[tuple[str, ...], Floats] | None, kept: Container[str]
) -> tuple[tuple[str, ...], Floats] | None:
    """The covariance of the names ``kept``; None of none."""
    names, matrix = covariance or ((), np.zeros((0, 0)))
    rows = [i for i, name in enumerate(names) if name in kept]
    return (tuple(names[i] for i in rows), frozen(matrix[np.ix_(rows, rows)])) if rows else None


def approach(q: Floats) -> Floats:
    """(N, n) sense -1, 0, 1 in which each motor came to its place, from the order of the states; the last one stays
    where a motor did not move by more than ``STILL``, and the first state has none."""
    way = np.diff(q, axis=0, prepend=q[:1])
    moved = np.where(np.abs(way) <= STILL, 0.0, np.sign(way))
    last = np.maximum.accumulate(np.where(moved != 0, np.arange(len(q))[:, None], 0), axis=0)
    return np.take_along_axis(moved, last, axis=0)
