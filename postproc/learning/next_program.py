"""What was learnt, as the correction of the next program needs it: factors of the forces, and errors that are known.

The robot's parameters are in its new file.  A factor acts on the force of its operation.  The rest is a displacement of
the surface, which the goal of the correction takes into account: a longer tool along the spindle, a larger radius
towards the material (where all measured points of an operation say on which side that is), a base that was off, and,
at this place only, the smooth displacement that no cause explains.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses
from postproc.base.units import MM
from postproc.compensation.desired_path import DesiredPath
from postproc.compensation.known_error import KnownError
from postproc.compensation.tool_displacement import ToolDisplacement
from postproc.learning.attribution import Attribution
from postproc.learning.causes import CauseKind
from postproc.learning.surface_displacement import SurfaceDisplacement
from postproc.process.force_factors import ForceFactors
from postproc.process.wrenches import Wrenches
from postproc.toolpath import Toolpath

ROUNDED = 2 * MM
"""Half of the path over which a vertex counts as turned: a force does not step, and a step needs many points."""

_REACH = 0.75, 1.25
"""Radii of the cutter from a turn of the feed within which its force begins and ends to feel it."""


def force_factors(result: Attribution) -> ForceFactors:
    """The factors of an attribution; of an operation that was not measured, what all have in common."""
    common = 0.0
    own: dict[str, float] = {}
    turns: dict[str, list[float]] = {}
    for cause, value in zip(result.causes, result.x.tolist(), strict=True):
        if cause.kind is CauseKind.FORCE and cause.name == "force":
            common = value
        elif cause.kind is CauseKind.FORCE and cause.group == "force":
            own[cause.place] = value
        elif cause.kind is CauseKind.TURN_1:
            turns.setdefault(cause.place, [0.0, 0.0])[0] = value
        elif cause.kind is CauseKind.TURN_2:
            turns.setdefault(cause.place, [0.0, 0.0])[1] = value
    factor = {name: float(np.exp(common + value)) for name, value in own.items()}
    return ForceFactors(factor, {k: (v[0], v[1]) for k, v in turns.items()}, float(np.exp(common)))


@dataclass(frozen=True, eq=False)
class CornerError:
    """The further displacement where the feed turns: (exp(size c) - 1) G w, c: how far it turns, w: force and moment.

    size: logarithm of the factor of the force in a corner; radius (N,) [m] of the cutter; force (N): w; start, end (N,
    3, 6) [m/N, m/(N m)]: compliance G at the ends of each motion, linear in between."""

    size: float
    turns: FeedTurns
    radius: Floats
    force: Wrenches
    start: Floats
    end: Floats

    def at(self, rows: Ints, share: Floats) -> Floats:
        """(K, 3) [m] at the shares (K,) of motions ``rows`` (K,)."""
        more = np.expm1(self.size * self.turns.at(rows, share, self.radius[rows]))
        along = share[:, None, None]
        compliance = (1 - along) * self.start[rows] + along * self.end[rows]
        return np.asarray(more[:, None] * (compliance @ self.force.along(rows, share)[..., None])[..., 0])


def corner_size(result: Attribution) -> float:
    """Logarithm of the factor of the force in corners, 0 where none was learnt."""
    return next(
        (
            x
            for cause, x in zip(result.causes, result.x.tolist(), strict=True)
            if cause.name == "corner_force"
        ),
        0.0,
    )


@dataclass(frozen=True, eq=False)
class LearnedError(KnownError):
    """What was learnt of a part beside robot and forces.

    tool: longer and thicker tools; surface: what their radius does to surfaces that lean; base (6,): shift [m] and turn
    [rad] about ``centre`` (3,) in the axes (3, 3) of the base; drift (3,) [m] over the whole program, with ``time``
    (N,) 0..1; corners: where the force is larger there."""

    result: Attribution
    tool: ToolDisplacement
    surface: SurfaceDisplacement
    base: Floats = field(default_factory=lambda: np.zeros(6))
    centre: Floats = field(default_factory=lambda: np.zeros(3))
    axes: Floats = field(default_factory=lambda: np.eye(3))
    drift: Floats = field(default_factory=lambda: np.zeros(3))
    time: Floats = field(default_factory=lambda: np.zeros(0))
    corners: CornerError | None = None

    def at(self, rows: Ints, wanted: Poses, share: Floats | None = None) -> Floats:
        """(K, 3) [m] of motions ``rows`` (K,) at ``wanted`` (K) poses, at ``share`` (K,) of their paths."""
        along = np.ones(len(rows)) if share is None else share
        moved = self.result.field_at(wanted.position) + self.tool.at(rows, wanted, along)
        moved += self.surface.at(rows, wanted)
        if self.base.any():
            place = (wanted.position - self.centre) @ self.axes
            moved += (self.base[:3] + np.cross(self.base[3:], place)) @ self.axes.T
        if self.drift.any():
            before = self.time[np.maximum(rows - 1, 0)]
            moved += (before + along * (self.time[rows] - before))[:, None] * self.drift
        if self.corners is not None:
            moved += self.corners.at(rows, along)
        return np.nan_to_num(moved)


def learned_error(
    result: Attribution,
    tool: tuple[ToolDisplacement, SurfaceDisplacement],
    rigid: tuple[Floats, Floats],
    time: Floats,
    corners: CornerError | None,
) -> LearnedError:
    """The known error of an attribution.

    tool: as it was learnt, beside walls and on surfaces that lean; rigid: centre (3,) [m] and axes (3, 3) of the base;
    time (N,) 0..1; corners: where a force in corners was learnt.
    """
    base, drift = np.zeros(6), np.zeros(3)
    for cause, value in zip(result.causes, result.x.tolist(), strict=True):
        if cause.kind is CauseKind.SHIFT and cause.group == "base":
            base["xyzuvw".index(cause.parameter)] = value
        elif cause.kind is CauseKind.SHIFT and cause.place == "drift":
            drift["xyz".index(cause.parameter)] = value
    return LearnedError(result, *tool, base, *rigid, drift, time, corners)


@dataclass(frozen=True, eq=False)
class FeedTurns:
    """Where the feed turns.  station (V,) [m] along the program where a turn starts or ends; ``turned`` (V,) [rad]: the
    sum of all turns up to it, linear in between; end (N,) [m]: station of the end of each motion; length (N,) [m]."""

    station: Floats
    turned: Floats
    end: Floats
    length: Floats

    @staticmethod
    def of(path: DesiredPath, toolpath: Toolpath, cuts: Bools) -> FeedTurns:
        """Of a program: vertices between motions that both cut, and arcs by their whole angle at their middle; cuts
        (N,)."""
        count = len(toolpath)
        rows = np.arange(count)
        first, last = path.tangent(rows, np.zeros(count)), path.tangent(rows, np.ones(count))
        known = (np.abs(first).sum(axis=1) > 0) & (np.abs(last).sum(axis=1) > 0)
        known &= cuts
        linked = known & np.append(False, known[:-1]) & toolpath.continues
        cosine = np.clip(np.sum(first * np.roll(last, 1, axis=0), axis=1), -1.0, 1.0)
        turn = np.where(linked, np.arccos(cosine), 0.0)
        end = np.cumsum(np.maximum(path.length, 1e-6 * MM))
        start = np.append(0.0, end[:-1])
        sweep = np.where(cuts, np.minimum(np.abs(np.nan_to_num(path.sweep)), np.pi), 0.0)
        station = np.stack([start, 0.5 * (start + end)], axis=1).ravel()
        turned = np.cumsum(np.stack([turn, sweep], axis=1).ravel())
        ends = np.stack([station - ROUNDED, station + ROUNDED], axis=1).ravel()
        sums = np.stack([np.append(0.0, turned[:-1]), turned], axis=1).ravel()
        return FeedTurns(np.maximum.accumulate(ends), sums, end, path.length)

    def at(self, rows: Ints, share: Floats, radius: Floats) -> Floats:
        """(K,) 0..1 how far the feed turns (1: 90 deg) within the radius (K,) [m] of the cutter of the places at the
        shares (K,) of motions ``rows`` (K,)."""
        place = self.end[rows] - (1.0 - share) * self.length[rows]
        low, high = (np.interp(place + side * radius, self.station, self.turned) for side in (-1.0, 1.0))
        return np.asarray(np.clip((high - low) / (0.5 * np.pi), 0.0, 1.0))

    def sigma_at(self, rows: Ints, share: Floats, radius: Floats) -> Floats:
        """(K,) 0..1 standard deviation of ``at`` the shares (K,) of motions ``rows`` (K,) with a cutter of ``radius``
        (K,) [m], as it is not known from where on the force feels a turn."""
        less, more = (self.at(rows, share, reach * radius) for reach in _REACH)
        return 0.5 * (more - less)
