"""What each motion of a program cuts of the blank: engagement, force, removed volume, collisions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block
from postproc.base.units import MM
from postproc.process.force_profiles import ForceProfiles
from postproc.process.stock.blank import Blank
from postproc.process.stock.cell_lists import build_stock
from postproc.process.stock.cells import Stock
from postproc.process.stock.chains import chain_contacts
from postproc.process.stock.collision import collisions
from postproc.process.stock.contact import (
    CHIP,
    COLUMNS,
    ENTRY,
    EXIT,
    FORCE,
    HIGH,
    LEFT,
    LOW,
    RATE,
    RIGHT,
    SweepCutters,
    contacts,
)
from postproc.process.stock.cutters import CUTTING, HOLDER, SHANK, Cutter
from postproc.process.stock.distance import AXIS, CUTTER, REMOVES, STEP, TIP_POINT
from postproc.process.stock.motion_sweeps import MotionSweeps
from postproc.process.stock.profile_places import profiles_of_places
from postproc.process.stock.saved_stock import Removed
from postproc.process.stock.stock_section import Edges
from postproc.toolpath import Toolpath

SPACING = 0.5
"""Radii of the cutter between two places of a motion that are looked at."""

FINER, UNEVEN = 6, 0.05
"""How many times closer they are on a sweep along which the removed area changes by more than this share."""

ALIKE = 0.01
"""Short motions are interpolated between places whose removed areas and forces are on a line up to this share."""

_STEP, _HALVINGS = 0.2, 8
"""Of two places of such a sweep one removes less than this share of the other: where it steps is halved so often."""

_AT_START = 1e-2
"""Radii of the cutter: so near to the start of a sweep it is looked at."""

LEAST_AREA = 1e-5 * MM**2
"""Across the feed: below it nothing is cut."""

_MOST_PLACES = 64  # of one sweep
_BLOCK = 64  # places that a thread takes at a time


@dataclass(frozen=True, eq=False)
class EngagedMotions:
    """Of N motions, in their feed frames (see ``milling_forces``).

    cuts (N,); volume (N,) [m3] that is removed; mean (N, 6) and largest (N, 6) wrench [N, N m] along the motion, its
    moments about the tip, NaN where feed, teeth, spindle or material are not known; where the force, or without one the
    removed area, is largest: depth (axial), width (across the feed) [m], entry and exit [rad], chip [m]; most (N, 2)
    [m]: the largest depth and the largest width anywhere along it; along (N,
    2, 6): wrench at start and end of a line through the motion; profiles: of the motions along which it changes;
    power (N,) [W], the mean; speed (N,) [rad/s].
    hits: row of a motion -> the parts that collide; uneven (U,): sweeps along which the removed area changes.
    """

    cuts: Bools
    volume: Floats
    mean: Floats
    largest: Floats
    along: Floats
    profiles: ForceProfiles
    depth: Floats
    width: Floats
    most: Floats
    entry: Floats
    exit: Floats
    chip: Floats
    power: Floats
    hits: dict[int, tuple[int, ...]]
    stock: Stock
    uneven: Ints


class PlacesInStock(NamedTuple):
    """K places that were looked at: their sweeps (K,), the lengths of path [m] that they represent, weight (K,), and
    their contacts (K, COLUMNS)."""

    sweep: Ints
    weight: Floats
    contact: Floats

    @property
    def rate(self) -> Floats:
        """(K,) [m2] the removed area across the feed."""
        return self.contact[:, RATE]

    def of(self, some: Bools) -> PlacesInStock:
        """Those of a mask (K,)."""
        return PlacesInStock(self.sweep[some], self.weight[some], self.contact[some])

    def joined(self, other: PlacesInStock) -> PlacesInStock:
        """These and the others, in the order of the sweeps."""
        sweep, weight, contact = (np.concatenate(pair) for pair in zip(self, other, strict=True))
        order = np.argsort(sweep, kind="stable")
        return PlacesInStock(sweep[order], weight[order], contact[order])


def engage(
    blank: Blank,
    sweeps: MotionSweeps,
    toolpath: Toolpath,
    edges: dict[int, Edges],
    before: Removed | None = None,
) -> EngagedMotions:
    """The engagement of the motions of ``sweeps`` in a blank; ``before``: what earlier programs removed of it."""
    rows, earlier = sweeps.rows, 0
    cutters = np.array([cutter.numbers for cutter in sweeps.cutters])
    if before is not None:
        earlier = len(before.rows)
        shifted = before.rows.copy()
        shifted[:, CUTTER] += len(cutters)
        rows = np.concatenate([shifted, rows])
        cutters = np.concatenate([cutters, before.cutters])
    stock, live = build_stock(blank, np.ascontiguousarray(rows), cutters)
    profiles = profiles_of(sweeps.cutters)
    laws = laws_of(sweeps, toolpath, edges)
    padded = np.concatenate([np.zeros((earlier, 9)), laws])
    heading = np.concatenate([np.zeros((earlier, 3)), sweeps.heading])
    cutting = SweepCutters(profiles, padded, live, heading)

    radius = np.array([cutter.radius for cutter in sweeps.cutters])[sweeps.rows[:, CUTTER].astype(int)]
    active = live[earlier:, 0] <= live[earlier:, 1]

    def look(sweep: Ints, share: Floats) -> Floats:
        """Contacts (K, COLUMNS) at shares (K,) of sweeps (K,)."""
        found = np.zeros((len(sweep), COLUMNS))

        def each(part: slice) -> None:
            contacts(stock, cutting, earlier + sweep[part], share[part], found[part])

        each_block(each, len(sweep), _BLOCK)
        return found

    def look_at(chosen: Ints) -> PlacesInStock:
        sweep, share, weight = _places(sweeps, radius, chosen)
        return PlacesInStock(sweep, weight, look(sweep, share))

    def middles(some: Ints) -> Floats:
        return look_at(some).contact

    chosen = np.flatnonzero(active & (sweeps.rows[:, REMOVES] > 0))
    short = sweeps.length[chosen] <= SPACING * radius[chosen]
    long = look_at(chosen[~short])
    short_sweeps = chosen[short]
    seen = chain_contacts(sweeps, laws, short_sweeps, SPACING * radius, ALIKE, middles)
    places = long.joined(PlacesInStock(short_sweeps, sweeps.length[short_sweeps], seen))
    uneven = np.union1d(_uneven(places.sweep, places.rate), _missed(places.sweep, places.rate, look))
    again = np.isin(places.sweep, uneven)
    places = places.of(~again).joined(_look_closer(sweeps, radius, uneven, look))
    hits = _hits(stock, sweeps, cutting, earlier, radius)
    speed = speeds_of(sweeps, toolpath, edges)
    cut = _by_motion(len(toolpath), sweeps, places, laws, speed, hits, stock)
    changing = places.of(np.isin(sweeps.motion[places.sweep], sweeps.motion[uneven]))
    forces = profiles_of_places(
        sweeps, changing.sweep, changing.weight, changing.contact[:, FORCE : FORCE + 6]
    )
    along = cut.along.copy()
    known = ~np.isnan(cut.mean[forces.motion, 0])
    for side, share in enumerate((0.0, 1.0)):
        at = np.flatnonzero(known & (forces.share == share))
        along[forces.motion[at], side] = forces.wrench[at]
    return replace(cut, along=along, profiles=forces.piecewise(), uneven=uneven)


def profiles_of(cutters: tuple[Cutter, ...]) -> Floats:
    """(T, E, 8) the profiles, with unused rows of the part 9."""
    each = [cutter.profile() for cutter in cutters]
    profiles = np.full((len(each), max(map(len, each)) + 1, 8), 9.0)
    for index, profile in enumerate(each):
        profiles[index, : len(profile)] = profile
    return profiles


def laws_of(sweeps: MotionSweeps, toolpath: Toolpath, edges: dict[int, Edges]) -> Floats:
    """(M, 9) see ``find_contact``; the feed per tooth is NaN where anything that the force needs is not known."""
    laws = np.zeros((len(sweeps.rows), 9))
    laws[:, 0] = np.nan
    speed = speeds_of(sweeps, toolpath, edges)
    for index, cutter in enumerate(sweeps.cutters):
        of = np.flatnonzero(sweeps.rows[:, CUTTER] == index)
        own = edges[cutter.number]
        if not cutter.teeth or cutter.helix is None or own.material is None:
            continue
        laws[of, 0] = toolpath.feed[sweeps.motion[of]] * (2 * np.pi / (np.abs(speed[of]) * cutter.teeth))
        known = own.material.coefficients
        laws[of, 1:] = [cutter.teeth, np.sign(cutter.helix), *known.cutting, *known.edge]
        # the other way round a left-hand helix pulls, and the tangential force is turned
        back = of[speed[of] < 0]
        for column in (2, 3, 6):
            laws[back, column] *= -1.0
    laws[~(laws[:, 0] > 0), 0] = np.nan
    return laws


def speeds_of(sweeps: MotionSweeps, toolpath: Toolpath, edges: dict[int, Edges]) -> Floats:
    """(M,) [rad/s] the speed of the spindle: that of the process file, where it states none that of the program; below
    zero where the program turns it counter-clockwise."""
    stated = np.array([edges[cutter.number].speed or np.nan for cutter in sweeps.cutters])[sweeps.which]
    program = toolpath.spindle[sweeps.motion]
    known = np.where(np.isfinite(program) & (program != 0), np.abs(program), np.nan)
    return np.where(program < 0, -1.0, 1.0) * np.where(np.isnan(stated), known, stated)


def _uneven(sweep: Ints, rate: Floats) -> Ints:
    """The sweeps along which the removed area changes: entries, exits, corners."""
    if not len(sweep):
        return sweep
    first = np.flatnonzero(np.append(True, sweep[1:] != sweep[:-1]))
    most, least = np.maximum.reduceat(rate, first), np.minimum.reduceat(rate, first)
    return sweep[first][most - least > UNEVEN * most]


def _missed(sweep: Ints, rate: Floats, look: Callable[[Ints, Floats], Floats]) -> Ints:
    """The sweeps with an end that cuts, or does not, unlike the place (K,) next to it: a plunge that just reaches
    stock, or one that starts just above.  Where a sweep that cuts goes on in one that does, its end is not looked
    at."""
    if not len(sweep):
        return sweep
    cuts, change = rate > LEAST_AREA, sweep[1:] != sweep[:-1]
    joins = cuts[1:] & cuts[:-1] & (np.diff(sweep) == 1)
    first, last = np.append(True, change & ~joins), np.append(change & ~joins, True)
    found = []
    for end, side in ((0.0, first), (1.0, last)):
        some, near = sweep[side], rate[side]
        there = look(some, np.full(len(some), end))[:, RATE]
        least, most = np.minimum(near, there), np.maximum(near, there)
        found.append(some[(least < _STEP * most) & (most > LEAST_AREA)])
    return np.union1d(*found)


def _look_closer(
    sweeps: MotionSweeps, radius: Floats, uneven: Ints, look: Callable[[Ints, Floats], Floats]
) -> PlacesInStock:
    """As ``look_at`` in ``engage``, FINER times closer and at both ends.

    Where the removed area steps between two places, as a face is met at once, the lengths that they represent meet at
    the step.
    """
    sweep, share, weight = _places(sweeps, radius, uneven, FINER)
    nothing = np.zeros(len(uneven))
    sweep = np.concatenate([sweep, uneven, uneven])
    # right at its start a tool touches just what the motion before left
    start = np.minimum(_AT_START * radius[uneven] / np.maximum(sweeps.length[uneven], 1e-9), 0.01)
    share = np.concatenate([share, start, nothing + 1])
    order = np.lexsort((share, sweep))
    sweep, share, weight = sweep[order], share[order], np.concatenate([weight, nothing, nothing])[order]
    found = look(sweep, share)
    rate = found[:, RATE]
    least, most = np.minimum(rate[1:], rate[:-1]), np.maximum(rate[1:], rate[:-1])
    at = np.flatnonzero((sweep[1:] == sweep[:-1]) & (least < _STEP * most) & (most > LEAST_AREA))
    low, high, falls = share[at], share[at + 1], rate[at] > rate[at + 1]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        cuts = look(sweep[at], middle)[:, RATE] > 0.5 * most[at]
        low, high = np.where(cuts == falls, middle, low), np.where(cuts == falls, high, middle)
    total = np.cumsum(weight)
    before = np.concatenate([[0.0], total])[np.searchsorted(sweep, sweep[at])]
    shift = 0.5 * (low + high) * sweeps.length[sweep[at]] - (total[at] - before)
    np.add.at(weight, at, shift)
    np.subtract.at(weight, at + 1, shift)
    return PlacesInStock(sweep, weight, found)


def _places(
    sweeps: MotionSweeps, radius: Floats, chosen: Ints, finer: int = 1
) -> tuple[Ints, Floats, Floats]:
    """The sweep, the share of it, and the length of path [m] that each place (K,) represents."""
    length = sweeps.length[chosen]
    count = np.clip(np.ceil(length / (SPACING * radius[chosen])), 1, _MOST_PLACES).astype(np.int64) * finer
    owner = np.repeat(np.arange(len(chosen)), count)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    share = (place + 0.5) / count[owner]
    return chosen[owner], share, (length / count)[owner]


def _hits(
    stock: Stock, sweeps: MotionSweeps, cutting: SweepCutters, earlier: int, radius: Floats
) -> dict[int, tuple[int, ...]]:
    """Row of a motion -> the parts of the tool that collide with stock along it."""
    rows = sweeps.rows
    top = np.array(
        [c.edge_length if c.length is not None or c.holder is None else c.holder[1] for c in sweeps.cutters]
    )
    above = _highest_stock(stock, rows) > top[rows[:, CUTTER].astype(int)]
    rapid = rows[:, REMOVES] == 0
    live = cutting.live[earlier:]
    tried = [(CUTTING, rapid & (live[:, 0] <= live[:, 1]))]
    for part in (SHANK, HOLDER):
        has = np.any(cutting.profiles[:, :, 0] == part, axis=1)[rows[:, CUTTER].astype(int)]
        tried.append((part, has & above))
    hits: dict[int, tuple[int, ...]] = {}
    for part, mask in tried:
        sweep, share, _ = _places(sweeps, radius, np.flatnonzero(mask))
        found = np.zeros(len(sweep), np.int8)
        parts = np.full(len(sweep), part)

        def look(
            at: slice, sweep: Ints = sweep, share: Floats = share, parts: Ints = parts, found: Ints = found
        ) -> None:
            collisions(stock, cutting, earlier + sweep[at], share[at], parts[at], found[at])

        each_block(look, len(sweep), _BLOCK)
        for motion in np.unique(sweeps.motion[sweep[found > 0]]).tolist():
            hits[motion] = (*hits.get(motion, ()), part)
    return hits


def _highest_stock(stock: Stock, rows: Floats) -> Floats:
    """(M,) [m] how far the blank reaches above the tip along the spindle, at either end of the sweeps."""
    frame = stock.blank.frame
    corners = np.array([[frame[1 + k + 3 * (corner >> k & 1)] for k in range(3)] for corner in range(8)])
    axis, tip = rows[:, AXIS : AXIS + 3], rows[:, TIP_POINT : TIP_POINT + 3]
    blank = (axis @ corners.T).max(axis=1)
    ends = [blank - np.einsum("mi,mi->m", axis, at) for at in (tip, tip + rows[:, STEP : STEP + 3])]
    return np.asarray(np.maximum(*ends))


def _by_motion(
    count: int,
    sweeps: MotionSweeps,
    places: PlacesInStock,
    laws: Floats,
    speed: Floats,
    hits: dict[int, tuple[int, ...]],
    stock: Stock,
) -> EngagedMotions:
    sweep, weight, found = places
    motion = sweeps.motion[sweep]
    touches = found[:, RATE] > LEAST_AREA
    found[~touches, RATE] = 0.0
    found[~touches, FORCE : FORCE + 6] = 0.0
    wrench = np.where(touches[:, None] & np.isnan(laws[sweep, :1]), np.nan, found[:, FORCE : FORCE + 6])
    volume: Floats = np.bincount(motion, found[:, RATE] * weight, count).astype(float)
    length = np.bincount(sweeps.motion, sweeps.length, count)
    sums = [np.bincount(motion, wrench[:, k] * weight, count).astype(float) for k in range(6)]
    mean = np.stack(sums, axis=1) / np.maximum(length, 1e-9)[:, None]
    size = np.linalg.norm(wrench[:, :3], axis=1)
    order = np.lexsort((np.where(np.isnan(size), found[:, RATE], size), motion))
    rows, last = np.unique(motion[order][::-1], return_index=True)
    best = order[::-1][last]
    table = np.zeros((count, COLUMNS))
    table[rows] = np.where(touches[best, None], found[best], 0.0)
    largest = np.zeros((count, 6))
    largest[rows] = wrench[best]
    turning = np.zeros(count)
    turning[sweeps.motion] = speed
    sizes = np.column_stack(
        [found[:, HIGH] - np.maximum(found[:, LOW], 0.0), found[:, LEFT] - found[:, RIGHT]]
    )
    most = np.zeros((count, 2))
    np.maximum.at(most, motion[touches], sizes[touches])
    cuts = volume > 0
    return EngagedMotions(
        cuts=cuts,
        volume=volume,
        mean=mean,
        largest=largest,
        along=_lines(count, motion[touches], wrench[touches]),
        profiles=ForceProfiles.none(),
        depth=np.where(cuts, table[:, HIGH] - np.maximum(table[:, LOW], 0.0), 0.0),
        width=np.where(cuts, table[:, LEFT] - table[:, RIGHT], 0.0),
        most=np.where(cuts[:, None], most, 0.0),
        entry=table[:, ENTRY],
        exit=table[:, EXIT],
        chip=np.where(np.isnan(mean[:, 0]), np.nan, table[:, CHIP]),
        power=np.where(cuts, mean[:, 5] * turning, 0.0),
        hits=hits,
        stock=stock,
        uneven=np.zeros(0, np.int64),
    )


def _lines(count: int, motion: Ints, wrench: Floats) -> Floats:
    """(N, 2, 6) the wrench at start and end of each motion: the line through the medians of both halves of its places
    in stock, so that the short ramps at entry and exit of a long cut do not bend it."""
    along = np.zeros((count, 2, 6))
    rows, first, many = np.unique(motion, return_index=True, return_counts=True)
    one = many == 1
    along[rows[one]] = wrench[first[one]][:, None, :]
    for row, start, number in zip(rows[~one], first[~one], many[~one], strict=True):
        values = wrench[start : start + number]
        half = (number + 1) // 2
        early, late = np.median(values[:half], axis=0), np.median(values[number - half :], axis=0)
        apart = (number - half) / number  # of the middles of both halves, as a share of the motion
        slope = (late - early) / max(apart, 0.5)
        middle, low, high = 0.5 * (early + late), values.min(axis=0), values.max(axis=0)
        along[row] = np.clip([middle - 0.5 * slope, middle + 0.5 * slope], low, high)
    return along
