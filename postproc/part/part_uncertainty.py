"""How far the error of a part may be off: the intervals of the model's parameters and of the force, carried to the
surface.

At a point with the normal n that the tool left at one place of its path the error changes by n . S dp when the
parameters differ by dp from those of the model; S are the derivatives of the place of the tool that touches the point,
with its turn, by differences of the solved equilibrium.  Source: JCGM 100:2008, eq. 13.  Where a change of the
displacement makes another motion leave the surface, this is its first order only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, turned
from postproc.cell import ForceVectorInterval
from postproc.compensation.input_sensitivities import goal_sensitivities, sensitivities
from postproc.compensation.problem import CompensationProblem, rotate_wrench
from postproc.compensation.subdivision import Subdivision
from postproc.compensation.uncertain_inputs import InputUncertainties, input_uncertainties
from postproc.compensation.uncertainty import ForceUncertainty
from postproc.compensation.uncertainty_propagation import expanded_uncertainty_of_largest
from postproc.part.displacement import Displacements
from postproc.part.part_figures import PartError, PartSide
from postproc.process.stock.simulation import StockRun
from postproc.robot.description import COVERAGE

WORST, EVEN = 300, 700
"""Points evaluated: those with the largest errors, and others evenly over the surface."""


@dataclass(frozen=True)
class StatedIntervals:
    """What the cell states of the force: share of its size (95 %), and of its direction and components; None where it
    states nothing."""

    force_ci95: float | None = None
    vector: ForceVectorInterval | None = None


def with_uncertainty(
    part: PartError,
    task: CompensationProblem,
    run: StockRun,
    division: Subdivision | None,
    stated: StatedIntervals,
) -> PartError:
    """``part`` with the intervals of its largest errors; as it is where no input has one."""
    force = ForceUncertainty.of(task, np.flatnonzero(task.carries), stated.force_ci95)
    known = input_uncertainties(task.model, force.largest, bool(task.carries.any()), stated.vector)
    if not known.entries:
        return part
    displaced = Displacements(task, run.sweeps.in_stock, wrench=part.wrenches[0])
    figures = part.figures
    before = replace(figures.before, ci95=_interval(part, part.before, displaced, known, force))
    after = figures.after
    if after is not None and part.after is not None:
        displaced = replace(displaced, division=division, wrench=part.wrenches[1])
        after = replace(after, ci95=_interval(part, part.after, displaced, known, force))
    return replace(part, figures=replace(figures, before=before, after=after))


def _interval(
    part: PartError,
    side: PartSide,
    displaced: Displacements,
    known: InputUncertainties,
    force: ForceUncertainty,
) -> float:
    """[m] the half width of the largest error: as posted at the point that has it, as compensated, where the predicted
    error is next to nothing, of all points together; NaN where it is not known."""
    chosen = _chosen(side)
    if not len(chosen):
        return np.nan
    normals = part.surface.normals[part.own[chosen]]
    slopes = _slopes(displaced, side, chosen, normals, known, force)
    sound: Bools = np.all(np.isfinite(slopes), axis=1)
    if not sound[0]:
        return np.nan
    if displaced.division is None:
        return float(COVERAGE * np.sqrt(max(float(slopes[0] @ known.covariance @ slopes[0]), 0.0)))
    error = side.error[chosen][sound, None] * normals[sound]
    along = normals[sound][:, :, None] * slopes[sound][:, None, :]
    return expanded_uncertainty_of_largest(error, along, known.covariance)


def _chosen(side: PartSide) -> Ints:
    """(M,) points, the one with the largest error first, that motions left."""
    order = np.argsort(-np.abs(side.error), kind="stable")
    order = order[side.motion[order] >= 0]
    rest = order[WORST:]
    even = rest[np.linspace(0, len(rest) - 1, min(EVEN, len(rest))).round().astype(np.int64)]
    return np.concatenate([order[:WORST], np.unique(even)])


def _slopes(
    displaced: Displacements,
    side: PartSide,
    chosen: Ints,
    normals: Floats,
    known: InputUncertainties,
    force: ForceUncertainty,
) -> Floats:
    """(M, P) derivatives of the errors at the points ``chosen`` (M,) with ``normals`` (M, 3)."""
    task = displaced.task
    motion, share = side.motion[chosen], side.share[chosen]
    real, _ = displaced.predicted(motion, share)
    from_stock = np.swapaxes(displaced.to_stock(motion), 1, 2)
    arm, normal = turned(from_stock, side.arm[chosen]), turned(from_stock, normals)
    wanted = task.desired_path.at(motion, share)
    wrench, axes = displaced.wrench_at(motion, share), task.base[motion].rotation
    placed = task.robot_from_path(motion, share)
    held = turned(np.swapaxes(wanted.rotation, 1, 2), arm)  # in the axes of the tool
    if placed is not None:
        wrench, axes = rotate_wrench(placed, wrench), placed.rotation @ axes
        arm, normal = turned(placed.rotation, arm), turned(placed.rotation, normal)
    # the same load at the point of the tool that touches the surface
    wrench = np.concatenate([wrench[:, :3], wrench[:, 3:] - np.cross(arm, wrench[:, :3])], axis=1)
    tool = task.tool[motion] @ Poses(np.broadcast_to(np.eye(3), (len(motion), 3, 3)), held)
    given = task.conditions_at(motion, share, corrected=displaced.division is not None)
    moves = sensitivities(task.model, known.entries, real.q, wrench, tool, given, real.displacement, axes)
    moves -= goal_sensitivities(task, known.entries, motion, wanted)
    return np.asarray(np.einsum("mi,mip->mp", normal, force.scaled(moves, known.entries, motion)))
