"""Factors by which the forces of operations differ from what is stated, as a measured part shows them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import rotation_from_vector, turned
from postproc.process.force_ramps import Ramps
from postproc.process.operation_names import OperationNames
from postproc.process.wrenches import Wrenches


@dataclass(frozen=True, eq=False)
class ForceFactors:
    """By operation: ``factor`` of its force, ``turn`` (2,) [rad] about the axes across it, ``ci95``: half width of
    the 95 % interval of the factor as a share; ``common``: factor of all others."""

    factor: Mapping[str, float]
    turn: Mapping[str, tuple[float, float]]
    common: float = 1.0
    ci95: Mapping[str, float] = field(default_factory=dict)

    def acting(self, forces: Wrenches, operations: OperationNames, base: Floats) -> Wrenches:
        """Forces (N) with these factors; base (N, 3, 3): axes of the programmed base."""
        if not forces.any:
            return forces
        count = len(forces)
        rows = np.arange(count)
        scale = np.array([self.factor.get(name, self.common) for name in operations.names])[operations.which]
        turns = np.array([self.turn.get(name, (0.0, 0.0)) for name in operations.names])[operations.which]

        def act(wrench: Floats, at: Ints) -> Floats:
            """(K, 6) ``wrench`` (K, 6) of the motions ``at`` (K,)."""
            moved = wrench * scale[at, None]
            first, second = axes_across(wrench[:, :3], base[at])
            rotation = rotation_from_vector(turns[at, :1] * first + turns[at, 1:] * second)
            moved[:, :3] = turned(rotation, moved[:, :3])
            return np.asarray(moved)

        known = np.array([self.ci95.get(name, np.nan) for name in operations.names])[operations.which]
        if forces.ci95 is not None:
            known = np.where(np.isnan(known), forces.ci95, known)
        acting = replace(
            forces,
            values=act(forces.values[rows], rows),
            start=act(forces.start[rows], rows),
            ci95=None if np.isnan(known).all() else known,
            ramps=None,
        )
        if forces.ramps is None:
            return acting
        extent = np.zeros(count)
        extent[forces.ramps.row] = forces.ramps.extent
        profiles, steps = (forces.ramps.only(some) for some in (forces.ramps.inside, ~forces.ramps.inside))
        if len(profiles.row):
            at, share, _ = profiles.places()
            rest = act(replace(forces, ramps=profiles).along(at, share), at) - acting.along(at, share)
            rest[(share == 0.0) | (share == 1.0)] = 0.0
            acting = replace(acting, ramps=Ramps.profile(at, share, rest, extent))
        stepping, length, early = steps.steps()
        return acting.ramped(stepping, length, extent, early)


def axes_across(force: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (K, 3) across each force (K, 3) and each other; the second lies in the plane of the force and z
    of the base ``axes`` (K, 3, 3), of x where the force points along z.  Zero without a force."""
    size = np.linalg.norm(force, axis=1, keepdims=True)
    unit = force / np.where(size > 0, size, 1.0)
    along_z = np.abs(np.sum(unit * axes[:, :, 2], axis=1)) > 0.99
    reference = np.where(along_z[:, None], axes[:, :, 0], axes[:, :, 2])
    second = reference - np.sum(reference * unit, axis=1, keepdims=True) * unit
    second = np.where(
        size > 0, second / np.maximum(np.linalg.norm(second, axis=1, keepdims=True), 1e-12), 0.0
    )
    return np.cross(unit, second), second
