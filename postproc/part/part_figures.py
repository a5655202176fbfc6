"""The error of a part in figures: of its whole surface, of a kind of feature, of an operation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Floats, Ints

WrenchAlong = Callable[[Ints, Floats], Floats]

FEATURES = ("floor", "wall", "slope")
"""By the angle of the normal to the spindle of the motion that made the surface: to 10 deg, from 80 deg, between."""


@dataclass(frozen=True)
class ErrorFigures:
    """Of points of a surface: largest gouge and largest excess [m], both from 0; root mean square and 95th percentile
    of the size [m] by area; out: share of the area whose error exceeds the tolerance."""

    gouge_max: float
    excess_max: float
    rms: float
    p95: float
    out: float

    @staticmethod
    def of(error: Floats, area: Floats, tolerance: float) -> ErrorFigures:
        """Of errors (K,) [m] above zero where material remains, at points that stand for ``area`` (K,) [m2]; one point
        at least."""
        size, total = np.abs(error), float(area.sum())
        order = np.argsort(size)
        at = int(np.searchsorted(np.cumsum(area[order]), 0.95 * total))
        return ErrorFigures(
            max(0.0, float(-error.min())),
            max(0.0, float(error.max())),
            float(np.sqrt(np.sum(area * error**2) / total)),
            float(size[order[min(at, len(size) - 1)]]),
            float(area[size > tolerance].sum() / total),
        )


@dataclass(frozen=True)
class WorstPoint:
    """The point with the largest error: position [m] in the axes of the stock; line: of the motion that left the
    surface there, 0 for that of the blank; error [m] with its sign; feature: one of FEATURES."""

    position: tuple[float, float, float]
    line: int
    error: float
    feature: str


@dataclass(frozen=True)
class SideFigures:
    """A part as posted, or as compensated.  ci95 [m]: half width of the 95 % interval of the largest error, as far as
    the inputs have intervals; NaN where none has."""

    whole: ErrorFigures
    worst: WorstPoint
    ci95: float = np.nan


@dataclass(frozen=True)
class SurfaceGroup:
    """Points with a feature or an operation in common: its name, the lines from and to, share of the area; figures as
    posted and as compensated, None where nothing is."""

    name: str
    lines: tuple[int, int]
    area: float
    before: ErrorFigures
    after: ErrorFigures | None


@dataclass(frozen=True)
class CutForces:
    """What is known of the forces of a side, under which the robot yields and cuts more or less than it is meant to.
    nominal: why they are those of the nominal engagement, "" where they were solved together with the displacement;
    force_nominal, force [N]: the largest of both; residual [m]: what remains between both displacements of a place."""

    nominal: str
    force_nominal: float
    force: float | None
    residual: float | None


@dataclass(frozen=True)
class PartFigures:
    """points that the program makes, their grid's spacing [m], their area [m2]; tolerance [m]; as posted, and as
    compensated where it is; features and operations: those that have points; as_posted, as_compensated: forces."""

    points: int
    spacing: float
    area: float
    tolerance: float
    before: SideFigures
    after: SideFigures | None
    features: tuple[SurfaceGroup, ...]
    operations: tuple[SurfaceGroup, ...]
    as_posted: CutForces
    as_compensated: CutForces | None

    @property
    def sides(self) -> tuple[tuple[str, SideFigures], ...]:
        """Their names and figures."""
        before = ("before", self.before)
        return (before,) if self.after is None else (before, ("after", self.after))


@dataclass(frozen=True, eq=False)
class Surface:
    """K points of a part.

    points, normals (K, 3) [m]: in the axes of the stock, normals point out of the material; sweep (K,): whose surface
    it is, -1 for that of the blank and within 1 um of an edge; area (K,) [m2] that each represents; spacing [m] of the
    grid.  vertices (V, 3) [m], faces (F, 3): the mesh; vertex (K, 4): the vertices around each point.
    """

    points: Floats
    normals: Floats
    sweep: Ints
    area: Floats
    spacing: float
    vertices: Floats
    faces: Ints
    vertex: Ints


@dataclass(frozen=True, eq=False)
class PartSide:
    """The errors (K,) [m] of a part at the points that its program makes; motion (K,): that left the surface there, -1
    for the blank; share (K,) of its path, and arm (K, 3) [m] from the tip there to the point, axes of the stock."""

    error: Floats
    motion: Ints
    share: Floats
    arm: Floats


@dataclass(frozen=True, eq=False)
class PartError:
    """The error of a part: ``figures``, the ``surface`` with its points that are ``own`` (K,) to the program, and the
    errors there as posted, and as compensated where it is.  wrenches: of both sides, of motions (K,) at shares (K,) the
    wrench (K, 6), None where it is that of the task; unsettled (U,): motions with a place without equilibrium."""

    figures: PartFigures
    surface: Surface
    own: Ints
    before: PartSide
    after: PartSide | None
    wrenches: tuple[WrenchAlong | None, WrenchAlong | None] = (None, None)
    unsettled: Ints = field(default_factory=lambda: np.empty(0, np.int64))

    def vertex_errors(self, side: PartSide) -> Floats:
        """(V,) [m] the largest error, with its sign, around each vertex of the mesh; NaN where the blank is left."""
        values = np.full(len(self.surface.vertices), np.nan)
        order = np.argsort(np.abs(side.error), kind="stable")
        for corner in range(4):
            at = self.surface.vertex[self.own[order], corner]
            larger = ~(np.abs(values[at]) > np.abs(side.error[order]))
            values[at[larger]] = side.error[order][larger]
        return values
