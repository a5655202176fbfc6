"""What the blocks of the motions state, in columns: the numbers that a plan may change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import MM
from postproc.languages.dialect import WritingSettings
from postproc.languages.gcode.blocks import SMALL_ANGLE
from postproc.languages.gcode.control import Move
from postproc.languages.gcode.source_map import SourceMapPart
from postproc.languages.gcode.words import NAMES, How, key

AXES, TURNED, CENTRE, RADIUS = slice(0, 3), slice(3, 6), slice(6, 9), 9
"""Columns: X Y Z; the words of the orientation; I J K (of an arc through a point I1 J1 K1); R."""

COLUMNS = 10
MOST_DECIMALS = 9
VECTOR_DECIMALS = 2
"""Decimals of a unit vector beyond those of an angle [deg]: half a step of it turns by less than half one of that."""

TURN = NAMES
"""Key of TURN=."""

PLANES = np.array([[0, 1, 2], [2, 0, 1], [1, 2, 0]])
"""First and second axis of the planes XY, ZX, YZ, and the axis normal to them."""


@dataclass(frozen=True, eq=False)
class ProgrammedWords:
    """N motions, ten columns.

    word: row in the words, -1 where absent; keys: the address of each column, -1 where it has none; value: the numbers
    as the control reads them, programmed units; relative: the number is an increment; modal: a number that is inserted
    is one; decimals: with which a number is written.  turns (N,): full turns of an arc that the block states apart;
    through (N,): arcs through a point.
    inverse (N, 3, 3), origin (N, 3), scale (N,): units = inverse @ (base - origin) / scale.
    """

    word: Ints
    keys: Ints
    value: Floats
    relative: Bools
    modal: Bools
    decimals: Ints
    turns: Ints
    through: Bools
    inverse: Floats
    origin: Floats
    scale: Floats

    def base(self, rows: Ints, units: Floats) -> Floats:
        """(m, 3) [m] in the base of ``units`` (m, 3), numbers of the frames of ``rows`` (m,)."""
        ahead = np.linalg.inv(self.inverse[rows]) @ (units * self.scale[rows, None])[..., None]
        return np.asarray(ahead[..., 0] + self.origin[rows])

    def units(self, rows: Ints, position: Floats) -> Floats:
        """(m, 3): ``position`` (m, 3) [m] in the base as numbers of the frames of ``rows`` (m,)."""
        back = self.inverse[rows] @ (position - self.origin[rows])[..., None]
        return np.asarray(back[..., 0] / self.scale[rows, None])


def stated(places: SourceMapPart, writing: WritingSettings) -> ProgrammedWords:
    """The columns of motions."""
    n, orient = len(places), places.orient
    through = _through(places)
    keys = _keys(places, orient, through)
    index = {address: column for column, address in enumerate(places.columns)}
    word = np.full((n, COLUMNS), -1)
    for address in np.unique(keys[keys >= 0]).tolist():
        if address in index:
            rows, columns = np.nonzero(keys == address)
            word[rows, columns] = places.word[rows, index[address]]
    words = places.text.words
    how = np.where(word >= 0, words.how[word], How.NUMBER) if len(words) else np.zeros(word.shape, np.int64)
    value = np.where(word >= 0, words.value[word], np.nan) if len(words) else np.full(word.shape, np.nan)
    counted = np.ones(word.shape)
    lengths = np.r_[0:3, 6:10]
    # Where mm or inch is not known, neither is the increment.
    ratio = np.nan_to_num(places.increment / places.scale, nan=1.0)[:, None]
    counted[:, lengths], counted[:, TURNED] = ratio, np.where(ratio == 1.0, 1.0, SMALL_ANGLE)
    integer = how == How.INTEGER
    value[integer] *= counted[integer]
    modal = _modal(places, orient, through)
    inverse = np.asarray(np.linalg.inv(places.frames.rotation), dtype=np.float64)
    decimals = np.maximum(_written_decimals(places, word), _least(places, orient, writing))
    whole = integer & (counted != 1.0)
    # X10 of a control that counts in increments has the decimals of the increment.
    finest = np.ceil(-np.log10(np.where(whole, counted, 1.0)) - 1e-9).astype(np.int64)
    return ProgrammedWords(
        word,
        keys,
        value,
        (modal | (how == How.INCREMENTAL)) & (how != How.ABSOLUTE),
        modal,
        np.minimum(np.maximum(decimals, finest), MOST_DECIMALS),
        _turns(places, index),
        through,
        inverse[places.frame],
        places.frames.position[places.frame],
        places.scale,
    )


def _through(places: SourceMapPart) -> Bools:
    """(N,) arcs through a point: CIP, or G2 and G3 with I1=."""
    through = np.asarray(places.move == Move.THROUGH)
    for letter in "IJK":
        if key(letter, 1) in places.columns:
            through |= places.column(letter, 1) >= 0
    return through


def _keys(places: SourceMapPart, orient: Ints, through: Bools) -> Ints:
    keys = np.full((len(orient), COLUMNS), -1)
    keys[:, AXES] = [key(letter) for letter in "XYZ"]
    keys[:, CENTRE] = [key(letter) for letter in "IJK"]
    keys[through, CENTRE] = [key(letter, 1) for letter in "IJK"]
    keys[:, RADIUS] = np.where(through, -1, key("R"))
    for i, orientation in enumerate(places.orientations):
        keys[orient == i, TURNED] = orientation.words
    return keys


def _least(places: SourceMapPart, orient: Ints, writing: WritingSettings) -> Ints:
    """(N, 10) the least decimals: those of which a step in the program's unit is no more than one of mm; one more in
    turned coordinates, whose roundings add up in the base."""
    rotation = np.abs(places.frames.rotation)
    factor = np.linalg.norm(places.frames.rotation, axis=1).max(axis=1)
    turned = np.any(np.minimum(rotation, np.abs(rotation - factor[:, None, None])) > 1e-9, axis=(1, 2))
    unit = places.scale * factor[places.frame]
    finer = np.ceil(np.log10(np.nan_to_num(unit / MM, nan=1.0)) - 1e-9).astype(np.int64)
    lengths = writing.mm + finer + turned[places.frame]
    least = np.repeat(lengths[:, None], COLUMNS, axis=1)
    angles = np.array(
        [writing.deg if o.angles else writing.deg + VECTOR_DECIMALS for o in places.orientations] + [0]
    )
    least[:, TURNED] = angles[orient][:, None]
    return np.asarray(np.maximum(least, 1))


def _modal(places: SourceMapPart, orient: Ints, through: Bools) -> Bools:
    """(N, 10) plain numbers are increments."""
    relative = np.zeros((len(orient), COLUMNS), dtype=bool)
    relative[:, AXES] = places.incremental[:, None]
    joint = np.array([o.joint for o in places.orientations] + [True])
    relative[:, TURNED] = (places.incremental & ~joint[orient])[:, None]
    relative[:, CENTRE] = np.where(through, places.incremental, ~places.arc_absolute)[:, None]
    return relative


def _turns(places: SourceMapPart, index: dict[int, int]) -> Ints:
    """(N,) full turns beyond the first one or a part of it: P - 1, TURN=."""
    turns = np.zeros(len(places), dtype=np.int64)
    arc = (places.move == Move.CLOCKWISE) | (places.move == Move.COUNTER)
    for address, first in ((key("P"), 1), (TURN, 0)):
        if address in index:
            word = places.word[:, index[address]]
            rows = np.flatnonzero(arc & (word >= 0))
            turns[rows] = np.rint(np.nan_to_num(places.text.words.value[word[rows]])).astype(np.int64) - first
    return np.maximum(turns, 0)


def _written_decimals(places: SourceMapPart, word: Ints) -> Ints:
    """(N, 10) digits after the point of the numbers as they are in the text."""
    words = places.text.words
    if not len(words):
        return np.zeros(word.shape, dtype=np.int64)
    start, end = places.span
    raw = np.frombuffer(places.raw, dtype=np.uint8)[start:end]
    points = np.append(np.flatnonzero(raw == ord(".")), len(raw)) + start
    point = points[np.searchsorted(points, words.start)]
    behind = np.where((point < words.stop) & ~places.computed, words.stop - point - 1, 0)
    return np.where(word >= 0, behind[word], 0)
