"""The centre, radius or intermediate point of arcs, so that a control reads the arc that is meant."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import arc_through, on_arc
from postproc.languages.gcode.writer_text import PLANES

WELL = np.radians([167.0, 193.0, 300.0])
"""Sweeps up to the first and between the others leave an arc given by its radius well determined: between the first
two the centre moves by more than nine times what the radius is rounded by, beyond the last it turns with the ends."""

NEAR = 1.0
"""Written steps by which the inside of a written arc may be elsewhere than planned before a digit is added."""

FAR = 2.0
"""Written steps by which the inside of a written arc may be elsewhere than planned at all, or its radii differ; twice
as many for an arc through a point, which cannot advance along its normal evenly."""


class ArcForm(IntEnum):
    """How the block states the way of its arc."""

    CENTRE = 0
    RADIUS = 1
    THROUGH = 2


@dataclass(frozen=True, eq=False)
class ArcsToWrite:
    """K arcs in programmed units and the coordinates of their frame.

    start, end (K, 3): as written.  centre, normal (K, 3), sweep (K,): as planned.  plane (K,); form (K,) Form;
    clockwise (K,) in the coordinates of the frame; turns (K,) full turns stated apart.  relative (K, 3): I J K are from
    the start.  own (K, 4): numbers that are there for I J K R, NaN if none; decimals (K, 4).  off (K,): how far the
    start as written is from the planned one, more than half a step where it is written in a larger unit.
    """

    start: Floats
    end: Floats
    centre: Floats
    normal: Floats
    sweep: Floats
    plane: Ints
    form: Ints
    clockwise: Bools
    turns: Ints
    relative: Bools
    own: Floats
    decimals: Ints
    off: Floats


@dataclass(frozen=True, eq=False)
class WrittenArcs:
    """write (K, 4): the number of I J K R is rewritten, number (K, 4), decimals (K, 4).
    convert (K,): R is replaced by I J K.  bad (K,): no numbers of this form state the arc."""

    write: Bools
    number: Floats
    decimals: Ints
    convert: Bools
    bad: Bools


def write_arcs(arcs: ArcsToWrite) -> WrittenArcs:
    """The numbers of the arcs: a number stays where it is right within half a step."""
    count = len(arcs.sweep)
    rows = np.arange(count)
    wanted = np.full((count, 4), np.nan)
    decimals = arcs.decimals.copy()
    centre = _balanced(arcs)
    through = arcs.form == ArcForm.THROUGH
    convert = (arcs.form == ArcForm.RADIUS) & ~_well(arcs.sweep)
    by_radius = (arcs.form == ArcForm.RADIUS) & ~convert
    by_centre = ~through & ~by_radius

    middle = on_arc(arcs.start, arcs.end, arcs.centre, arcs.normal, arcs.sweep, np.full(count, 0.5))
    point = np.where(through[:, None], middle, centre)
    wanted[:, :3] = point - np.where(arcs.relative, arcs.start, 0.0)
    across = PLANES[arcs.plane, 2]
    wanted[rows[by_centre], across[by_centre]] = np.nan
    wanted[by_radius, :3] = np.nan
    radius = 0.5 * (_distance(arcs, centre, arcs.start) + _distance(arcs, centre, arcs.end))
    wanted[by_radius, 3] = np.where(arcs.sweep > np.pi, -radius, radius)[by_radius]
    # Beyond 120 deg the middle moves by more than the radius does.
    decimals[:, 3] += by_radius & (arcs.sweep > np.radians(120.0))

    number, write = _rewritten(wanted, arcs.own, decimals)
    # Rounded centres and points leave radii that differ, or another way: a digit more where that counts.
    off, unequal = _missed(arcs, number, through, by_radius)
    finer = ~by_radius & ((off > NEAR) | (unequal > 0.5))
    decimals[finer, :3] += 1
    kept = _rewritten(wanted, np.where(write, np.nan, arcs.own), decimals)
    number[finer], write[finer] = (part[finer] for part in kept)
    # An absent word is zero (or inherits): it is written where that is not meant.
    default = np.where(arcs.relative, 0.0, arcs.start)
    absent = np.isnan(arcs.own[:, :3]) & (np.abs(wanted[:, :3] - default) <= 0.5 * 10.0 ** -decimals[:, :3])
    absent &= through[:, None] | arcs.relative
    write[:, :3] &= ~absent
    number[:, :3] = np.where(absent, default, number[:, :3])
    write[:, :3] |= convert[:, None] & np.isfinite(wanted[:, :3])
    off, unequal = _missed(arcs, number, through, by_radius)
    bad = ~(off <= np.where(through, 2.0, 1.0) * FAR) | (unequal > FAR)
    return WrittenArcs(write, number, decimals, convert, bad)


def _well(sweep: Floats) -> Bools:
    return np.asarray((sweep <= WELL[0]) | ((sweep >= WELL[1]) & (sweep <= WELL[2])))


def _rewritten(wanted: Floats, own: Floats, decimals: Ints) -> tuple[Floats, Bools]:
    """The numbers, and which of them are rewritten: all that are wanted and are not there."""
    scale = 10.0**decimals
    with np.errstate(invalid="ignore"):
        stays = np.abs(wanted - own) <= 0.5 / scale + 1e-9
    return np.where(stays, own, np.rint(wanted * scale) / scale), np.isfinite(wanted) & ~stays


def _in_plane(arcs: ArcsToWrite, vectors: Floats) -> Floats:
    return np.take_along_axis(vectors, PLANES[arcs.plane, :2], axis=1)


def _balanced(arcs: ArcsToWrite) -> Floats:
    """Centres at the same distance from start and end: shifted along the chord, by what the radii differ times radius /
    chord.  Circles that nearly close stay: there that moves the far side by many digits."""
    axes = PLANES[arcs.plane, :2]
    start, end, centre = (_in_plane(arcs, p) for p in (arcs.start, arcs.end, arcs.centre))
    chord = end - start
    length = np.linalg.norm(chord, axis=1)
    radius = np.linalg.norm(centre - start, axis=1)
    usable = (arcs.form != ArcForm.THROUGH) & (length > 0) & ((arcs.sweep <= np.pi) | (length >= radius))
    unit = chord / np.where(length > 0, length, 1.0)[:, None]
    off = np.sum((centre - 0.5 * (start + end)) * unit, axis=1)
    result = arcs.centre.copy()
    np.put_along_axis(result, axes, centre - np.where(usable, off, 0.0)[:, None] * unit, axis=1)
    return result


def _centre(arcs: ArcsToWrite, number: Floats) -> Floats:
    """(K, 3) centres that I J K state."""
    return np.where(np.isnan(number[:, :3]), 0.0, number[:, :3]) + np.where(arcs.relative, arcs.start, 0.0)


def _distance(arcs: ArcsToWrite, one: Floats, other: Floats) -> Floats:
    """(K,) in the plane."""
    return np.asarray(np.linalg.norm(_in_plane(arcs, one - other), axis=1))


def _missed(arcs: ArcsToWrite, number: Floats, through: Bools, by_radius: Bools) -> tuple[Floats, Floats]:
    """(K,) how far the way that the written numbers state is from the planned one, NaN where it is none or turns
    otherwise; (K,) how much the radii at start and end differ.  In written steps."""
    count = len(arcs.sweep)
    normal = np.zeros((count, 3))
    normal[np.arange(count), PLANES[arcs.plane, 2]] = np.where(arcs.clockwise, -1.0, 1.0)
    stated = _centre(arcs, number)
    centre = np.where(by_radius[:, None], _by_radius(arcs, normal, number[:, 3]), stated)
    start, stop = arcs.start - centre, arcs.end - centre
    across = np.sum(np.cross(start, stop) * normal, axis=1)
    along = np.sum(start * stop, axis=1) - np.sum(start * normal, axis=1) * np.sum(stop * normal, axis=1)
    sweep = np.mod(np.arctan2(across, along), 2 * np.pi)
    closes = (np.abs(_in_plane(arcs, start - stop)) <= 1e-9).all(axis=1)
    sweep = np.where(closes, 2 * np.pi, sweep) + 2 * np.pi * arcs.turns
    if through.any():
        way = arc_through(arcs.start[through], stated[through], arcs.end[through])
        centre[through], normal[through], sweep[through] = way
    step = np.maximum(10.0 ** -arcs.decimals[:, :3].min(axis=1), 2.0 * arcs.off)
    worst = np.zeros(count)
    for share in (0.25, 0.5, 0.75):
        at = np.full(count, share)
        intended = on_arc(arcs.start, arcs.end, arcs.centre, arcs.normal, arcs.sweep, at)
        read = on_arc(arcs.start, arcs.end, centre, normal, sweep, at)
        worst = np.maximum(worst, np.linalg.norm(intended - read, axis=1))
    worst[~(np.abs(sweep - arcs.sweep) < np.pi)] = np.nan
    unequal = np.abs(_distance(arcs, arcs.start, stated) - _distance(arcs, arcs.end, stated))
    return worst / step, np.where(through | by_radius, 0.0, unequal / step)


def _by_radius(arcs: ArcsToWrite, normal: Floats, radius: Floats) -> Floats:
    """(K, 3) centres at a signed radius: to the left of the chord, seen along -normal; a negative one beyond it."""
    chord = arcs.end - arcs.start
    chord = chord - np.sum(chord * normal, axis=1, keepdims=True) * normal
    length = np.linalg.norm(chord, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        height = np.sqrt(radius**2 - 0.25 * length**2) * np.sign(radius)
        left = np.cross(normal, chord) / length[:, None]
    return np.asarray(arcs.start + 0.5 * chord + height[:, None] * left)
