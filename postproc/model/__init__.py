"""The stiffness model of a robot: its parts, its equilibrium, and what follows from it."""

from postproc.model import codes as codes
from postproc.model.mechanics import NOTHING, STANDARD_GRAVITY, EffectInstance, Mechanics, approach
from postproc.model.sensitivity import compute_curvature
from postproc.model.solve import MAX_STEPS, Equilibrium
from postproc.model.stiffness import StiffnessModel

__all__ = [
    "MAX_STEPS",
    "NOTHING",
    "STANDARD_GRAVITY",
    "EffectInstance",
    "Equilibrium",
    "Mechanics",
    "StiffnessModel",
    "approach",
    "compute_curvature",
]
