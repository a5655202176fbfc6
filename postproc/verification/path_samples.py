"""Samples of a program along the path of the original, and where between them an error may be larger than theirs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import lengths
from postproc.verification.tool_placement import PlacedTool

PARTS = 4
"""In how many parts the distance of two samples is divided where a larger error may be between them."""

SEEN, SEEN_TURN, SEEN_SHARE = 2e-7, 2e-6, 1e-3
"""[m], [rad] and share of it by which an error between two samples may be larger than the largest one."""

NARROW = 1e-6
"""[m] Samples that are no farther apart are not divided: written digits are no finer."""


@dataclass(frozen=True, eq=False)
class PathSamples:
    """S samples, in the order of the path.

    stretch (S,), motion (S,): row of the program; share (S,) of its path; place: on the original; end (S,): the motion
    ends here; first, last (S,): of a cut; distance_along (S,) [m]: from the sample before.
    """

    stretch: Ints
    motion: Ints
    share: Floats
    place: PlacedTool
    end: Bools
    first: Bools
    last: Bools
    distance_along: Floats

    @property
    def distance(self) -> Floats:
        """(S,) [m] of the tool from the wanted path; NaN where place and force do not agree."""
        return np.where(self.place.settled, lengths(self.place.error), np.nan)

    def at(self, numbers: Ints) -> PathSamples:
        """Those of ``numbers`` (K,)."""
        return self._of(self.place.at(numbers), [values[numbers] for values in self._arrays])

    def joined(self, other: PathSamples) -> PathSamples:
        """These and those of ``other``, on other stretches, in the order of the path."""
        order, own = np.argsort(np.append(self.stretch, other.stretch), kind="stable"), len(self.stretch)
        place = PlacedTool.empty(len(order))
        place.put(np.arange(own), self.place)
        place.put(np.arange(own, len(order)), other.place)
        pairs = zip(self._arrays, other._arrays, strict=True)
        return self._of(place.at(order), [np.append(one, two)[order] for one, two in pairs])

    @property
    def _arrays(self) -> list[np.ndarray]:
        return [getattr(self, one.name) for one in fields(self) if one.name != "place"]

    @staticmethod
    def _of(place: PlacedTool, arrays: list[np.ndarray]) -> PathSamples:
        stretch, motion, share, end, first, last, distance_along = arrays
        return PathSamples(stretch, motion, share, place, end, first, last, distance_along)

    @cached_property
    def weight(self) -> Floats:
        """(S,) [m] of the program's path that each sample represents."""
        half = 0.5 * np.append(self.distance_along, 0.0)
        return half[:-1] + half[1:]

    @property
    def rms(self) -> float:
        """[m] along the path"""
        return float(np.sqrt(np.average(self.distance**2, weights=np.maximum(self.weight, 1e-12))))

    def percentile(self, share: float) -> float:
        """[m] the distance that this share of the path is below."""
        order = np.argsort(self.distance)
        total = np.cumsum(self.weight[order])
        return float(self.distance[order][np.searchsorted(total, share * total[-1])])


def places_between(samples: PathSamples, rows: Ints) -> tuple[Ints, Floats]:
    """Numbers (M,) among the motions ``rows`` (R,) and shares (M,) of them between samples where an error may be larger
    than the largest of all: by as much as the samples beside are off the straight line between their neighbours."""
    number = np.searchsorted(rows, samples.motion)
    before, after = samples.distance_along, np.append(samples.distance_along[1:], 0.0)
    same = np.append(samples.stretch[1:] == samples.stretch[:-1], False)[: len(number)]  # as the next
    here = np.flatnonzero(same & (after > NARROW))
    inner = np.flatnonzero(same[1:] & same[:-1]) + 1
    weight = before[inner] / np.maximum(before[inner] + after[inner], 1e-15)
    asked = np.zeros(len(number), bool)
    for error, size, least in (
        (samples.place.error, samples.distance, SEEN),
        (samples.place.turn[:, None], samples.place.turn, SEEN_TURN),
    ):
        off = np.zeros(len(number))
        straight = error[inner - 1] + weight[:, None] * (error[inner + 1] - error[inner - 1])
        off[inner] = lengths(error[inner] - straight)
        most = np.maximum(size[here], size[here + 1]) + np.maximum(off[here], off[here + 1])
        largest = float(size.max(initial=0.0))
        asked[here[most > largest + max(least, SEEN_SHARE * largest)]] = True
    some = np.flatnonzero(asked)
    start = np.where(number[some + 1] == number[some], samples.share[some], 0.0)
    parts = np.arange(1, PARTS) / PARTS
    share = start[:, None] + (samples.share[some + 1] - start)[:, None] * parts
    return np.repeat(number[some + 1], PARTS - 1), share.ravel()
