"""The stiffness of a robot over its workspace: the deflection under one wrench at every cell of a grid."""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.geometry import Poses
from postproc.effects.gravity_compensator import GravityCompensator
from postproc.model import StiffnessModel
from postproc.robot.branches import BranchBit
from postproc.robot.inverse import inverse

MAX_CELLS = 1_000_000
"""More cells than a picture can show or a spreadsheet can open."""

BATCH = 8192
"""Cells evaluated at once."""

MARGIN = 1e-9
"""An axis [rad] that is on its limit is within."""


@dataclass(frozen=True, eq=False)
class WorkspaceGrid:
    """Places of the TCP in the robot base: all combinations of the coordinates ``x``, ``y``, ``z``, (K,) [m] each."""

    x: Floats
    y: Floats
    z: Floats

    @property
    def shape(self) -> tuple[int, int, int]:
        return len(self.x), len(self.y), len(self.z)

    @property
    def positions(self) -> Floats:
        """(N, 3) [m]; z runs fastest, x slowest."""
        return np.stack(np.meshgrid(self.x, self.y, self.z, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True)
class MapLoad:
    """What is asked at every cell.  ``tool``: TCP on the flange; ``orientation`` (3, 3) of the tool in the robot
    base; ``wrench`` (6,) [N, N m] at the TCP, robot base axes; ``branch``: that of the arm, see ``BranchBit``.

    ``linear``: eq. (5), linearized at the unloaded pose, in place of the balance on the deflected one.
    """

    tool: Poses
    orientation: Floats
    wrench: Floats
    branch: int = BranchBit.ELBOW
    linear: bool = False
    ignore_limits: bool = False


@dataclass(frozen=True, eq=False)
class WorkspaceMap:
    """A surveyed grid, one row a cell in the order of ``grid.positions``.

    ``q`` (N, n) [rad], NaN out of reach; ``in_reach`` (N,) the arm gets there; ``within`` (N,) and inside of its axis
    limits; ``mapped`` (N,) the cells that were asked for and can be had; ``deflection`` (N, 3) [m] of the TCP in robot
    base axes, what the wrench does; ``without`` (N, 3) [m]: the same without gravity compensator, None if there is
    none. Deflections are NaN where not mapped, and where the loaded arm has no equilibrium.
    """

    grid: WorkspaceGrid
    q: Floats
    in_reach: Bools
    within: Bools
    mapped: Bools
    deflection: Floats
    without: Floats | None

    @property
    def size(self) -> Floats:
        """(N,) [m] length of the deflection."""
        return np.asarray(np.linalg.norm(self.deflection, axis=1))

    @property
    def size_without(self) -> Floats | None:
        """(N,) [m] of ``without``."""
        return None if self.without is None else np.asarray(np.linalg.norm(self.without, axis=1))

    @property
    def difference(self) -> Floats | None:
        """(N,) [m] length of the difference of both deflection vectors."""
        if self.without is None:
            return None
        return np.asarray(np.linalg.norm(self.deflection - self.without, axis=1))

    @property
    def unsettled(self) -> Bools:
        """(N,) mapped cells in which the arm finds no equilibrium."""
        lost = np.isnan(self.deflection).any(axis=1)
        if self.without is not None:
            lost |= np.isnan(self.without).any(axis=1)
        return np.asarray(self.mapped & lost)


def has_compensator(model: StiffnessModel) -> bool:
    return any(isinstance(term.effect, GravityCompensator) for term in model.terms)


def with_sign(model: StiffnessModel, sign: str) -> StiffnessModel:
    """The model with eq. (3) of its compensators read as ``energy`` or ``as_printed``."""
    terms = []
    for term in model.terms:
        if isinstance(term.effect, GravityCompensator):
            effect = copy.copy(term.effect)
            effect.sign = sign
            term = replace(term, effect=effect)
        terms.append(term)
    return replace(model, terms=tuple(terms))


def evaluate_workspace(model: StiffnessModel, grid: WorkspaceGrid, load: MapLoad) -> WorkspaceMap:
    """The deflection at every cell of ``grid``, in batches."""
    places, axes = grid.positions, len(model.robot.limits)
    count = len(places)
    q, in_reach, within = np.empty((count, axes)), np.empty(count, bool), np.empty(count, bool)
    mapped, deflection, without = np.empty(count, bool), np.empty((count, 3)), np.empty((count, 3))
    bare = model.without_effects([GravityCompensator.name]) if has_compensator(model) else None
    for start in range(0, count, BATCH):
        rows = slice(start, start + BATCH)
        q[rows], in_reach[rows], within[rows] = _arm(model, places[rows], load)
        mapped[rows] = in_reach[rows] if load.ignore_limits else within[rows]
        deflection[rows] = _deflection(model, q[rows], mapped[rows], load)
        if bare is not None:
            without[rows] = _deflection(bare, q[rows], mapped[rows], load)
    for array in (q, in_reach, within, mapped, deflection, without):
        array.setflags(write=False)
    return WorkspaceMap(grid, q, in_reach, within, mapped, deflection, None if bare is None else without)


def _arm(model: StiffnessModel, places: Floats, load: MapLoad) -> tuple[Floats, Bools, Bools]:
    """Angles that the controller takes to bring the TCP to ``places`` (N, 3); in reach; within the axis limits."""
    count, robot = len(places), model.robot
    flange = Poses(np.broadcast_to(load.orientation, (count, 3, 3)), places) @ load.tool.inverse()
    low, high = robot.limits.T
    middle = np.nan_to_num((low + high) / 2)
    solution = inverse(
        robot.nominal, flange, np.full(count, load.branch), np.broadcast_to(middle, (count, len(middle)))
    )
    inside = ((solution.q >= low - MARGIN) & (solution.q <= high + MARGIN)).all(axis=1)
    return solution.q, solution.reachable, solution.reachable & inside


def _deflection(model: StiffnessModel, angles: Floats, mapped: Bools, load: MapLoad) -> Floats:
    """(N, 3) [m] how far the wrench moves the TCP, loaded minus unloaded; NaN where not mapped or never at rest."""
    q = angles[mapped]
    wrench = np.tile(load.wrench, (len(q), 1))
    moved = np.full((len(angles), 3), np.nan)
    if load.linear:
        moved[mapped] = model.linear_deflection(q, wrench, load.tool)[:, :3]
        return moved
    loaded = model.equilibrium(q, wrench, load.tool)
    free = model.equilibrium(q, np.zeros_like(wrench), load.tool)
    rests = (loaded.converged & free.converged)[:, None]
    moved[mapped] = np.where(rests, loaded.pose.position - free.pose.position, np.nan)
    return moved
