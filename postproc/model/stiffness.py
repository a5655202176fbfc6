"""The stiffness model: one chain, the effects of a robot file with their values, and their equilibrium."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from postproc.base.arrays import Floats
from postproc.base.findings import Finding
from postproc.base.geometry import Poses
from postproc.effects import Conditions, Effect
from postproc.model.cartesian import compute_linear_deflection
from postproc.model.files import label_parameters, read_covariance, read_terms, select_covariance
from postproc.model.mechanics import NOTHING, EffectInstance, Mechanics
from postproc.model.plausibility import find_implausible
from postproc.model.sensitivity import compute_sensitivity
from postproc.model.solve import TOLERANCE, Equilibrium, solve_equilibrium, solve_motors
from postproc.robot.description import Robot, Value


@dataclass(frozen=True)
class StiffnessModel(Mechanics):
    """Chain and effects of one robot, solved; immutable."""

    @classmethod
    def from_robot(cls, robot: Robot) -> StiffnessModel:
        """The model that a robot file describes.  Raises Refusal with file, line and key."""
        model = cls(robot, read_terms(robot))
        return replace(model, covariance=read_covariance(model))

    def without_effects(self, effects: Iterable[str] = (), families: Iterable[str] = ()) -> StiffnessModel:
        """The model with some effects, or families of effects, taken out."""
        names, kinds = set(effects), set(families)
        terms = (t for t in self.terms if t.effect.name not in names and t.effect.family not in kinds)
        model = replace(self, terms=tuple(terms))
        return replace(model, covariance=select_covariance(self.covariance, dict(label_parameters(model))))

    def with_values(self, values: Mapping[tuple[int, str], float]) -> StiffnessModel:
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

    def with_effect(self, effect: Effect, stated: Mapping[str, Value] | None = None) -> StiffnessModel:
        """The model with one more effect, at its null values where ``stated`` states nothing."""
        known = dict(stated or {})
        values = {p.name: known[p.name].value if p.name in known else p.null for p in effect.parameters}
        return replace(self, terms=(*self.terms, EffectInstance(effect, values, known)))

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

        ``start`` (N, m): displacement to start with, that of a state nearby; the result does not depend on it.
        ``tolerance`` [rad, m]: what may remain after the last step, by the rate at which the steps became smaller.

        Solves theta = C(J^T w + loads) at coordinates rest + theta, the balance on the deflected pose, by a Newton
        iteration with the diagonal of the loads' and laws' derivatives.  What the diagonal omits (the lever of
        the wrench moving with the pose, weights) makes it linear with a rate of about 5e-3.
        """
        return solve_equilibrium(self, q, wrench, tool, conditions, start, tolerance)

    def inverse_equilibrium(
        self, coordinates: Floats, wrench: Floats, tool: Poses, conditions: Conditions = NOTHING
    ) -> tuple[Floats, Floats]:
        """Motors (N, n) that bring the loaded joints to ``coordinates`` (N, n), and the displacement (N, m) there.

        q = z - theta(z, q) - offsets(q): the chain is evaluated once, at z, and only what depends on the motors (a
        balanced load, an offset) is repeated.  Exact where only the joints are compliant; elsewhere a value to start
        with.
        """
        return solve_motors(self, coordinates, wrench, tool, conditions)

    def linear_deflection(
        self, q: Floats, wrench: Floats, tool: Poses, conditions: Conditions = NOTHING
    ) -> Floats:
        """Deflection twists (N, 6) [m, rad] of the TCP by eq. (5), linearized at ``q`` (N, n): J K_theta^-1 J^T w, w
        the ``wrench`` (N, 6) [N, N m]."""
        return compute_linear_deflection(self, q, wrench, tool, conditions)

    def sensitivity(
        self,
        q: Floats,
        wrench: Floats,
        tool: Poses,
        conditions: Conditions,
        displacement: Floats,
        spans: Mapping[tuple[int, str], tuple[float, float]],
    ) -> Floats:
        """(N, m, P) derivative of the coordinates at rest by parameters (SI), at an equilibrium of ``q`` (N, n) under
        ``wrench`` (N, 6) [N, N m] whose ``displacement`` (N, m) is known; ``spans``: the two values of a parameter
        whose difference approximates it.

        By the implicit function of theta = D(F(z, rest)), z = rest + theta, with C = dD/dF:

            dz/dp = (1 - C dF/dz)^-1 (d rest/dp + C (dF/dp + dF/d rest d rest/dp) + dD/dp)

        The derivatives of F by coordinates are central differences of all states at once; nothing is solved again.
        """
        return compute_sensitivity(self, q, wrench, tool, conditions, displacement, spans)

    def plausibility_findings(self) -> list[Finding]:
        """What is implausible about the model itself: a load that, with no force on the tool, deflects a joint by
        more than ``IMPLAUSIBLE_SAG`` somewhere within its limits (MOD001); links and parameters that built hardware
        does not have (MOD004)."""
        return find_implausible(self)
