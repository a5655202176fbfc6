"""How the force of a motion changes on its way: entries, exits and corners, as few straight parts as show it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints

NEAR = 0.01
"""Share of a motion's largest force by which its profile may differ from the places that were looked at."""

MOST_PARTS = 24
"""Straight parts of a profile; an entry or an exit takes three to eight."""


@dataclass(frozen=True, eq=False)
class ForceProfiles:
    """Wrenches [N, N m] at P places of motions, straight in between.

    motion (P,), ascending; share (P,) of the motion's path, ascending in each, 0 and 1 among them; wrench (P, 6): in
    the frame of the motion's force at that place.
    """

    motion: Ints
    share: Floats
    wrench: Floats

    @staticmethod
    def none() -> ForceProfiles:
        """Of no motion."""
        return ForceProfiles(np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 6)))

    def piecewise(self) -> ForceProfiles:
        """Those that are more than one straight part."""
        _, whose, many = np.unique(self.motion, return_inverse=True, return_counts=True)
        chosen = many[whose] > 2
        return ForceProfiles(self.motion[chosen], self.share[chosen], self.wrench[chosen])

    def of(self, motions: Bools) -> ForceProfiles:
        """Those of ``motions`` (N,)."""
        chosen = motions[self.motion]
        return ForceProfiles(self.motion[chosen], self.share[chosen], self.wrench[chosen])

    def divided(self, turn: Floats, most: float) -> ForceProfiles:
        """The same with further places, where a motion turns by more than ``most`` [rad] from one to the next; turn
        (N,) [rad]: of each motion in whole, evenly."""
        within = np.append(self.motion[1:] == self.motion[:-1], False)[: len(self.motion)]
        step = np.where(within, np.append(np.diff(self.share), 0.0)[: len(within)], 0.0)
        many = np.maximum(np.ceil(step * turn[self.motion] / most - 1e-9), 1).astype(np.int64)
        place = np.repeat(np.arange(len(many)), many)
        part = (np.arange(len(place)) - np.repeat(np.cumsum(many) - many, many)) / many[place]
        after = np.minimum(place + 1, len(many) - 1)
        wrench = self.wrench[place] + part[:, None] * (self.wrench[after] - self.wrench[place])
        return ForceProfiles(self.motion[place], self.share[place] + part * step[place], wrench)


def reduce_profiles(motion: Ints, share: Floats, wrench: Floats, spacing: Floats) -> ForceProfiles:
    """The profiles of places (K,) with ``wrench`` (K, 6), in the order of ``motion`` (K,) and ``share`` (K,).

    The ends of each motion, and of the other places that which differs most from the straight parts so far, until none
    differs by more than ``NEAR``; none nearer to another than ``spacing`` (K,), a share of the motion (Ramer, An
    iterative procedure for the polygonal approximation of plane curves, 1972, doi:10.1016/S0146-664X(72)80017-0; all
    motions at once).
    """
    if not len(motion):
        return ForceProfiles.none()
    first = np.flatnonzero(np.append(True, motion[1:] != motion[:-1]))
    last = np.append(first[1:], len(motion)) - 1
    owner = np.repeat(np.arange(len(first)), last - first + 1)
    # what is nearest to an end holds up to it
    share = share.copy()
    share[first], share[last] = 0.0, 1.0
    single = first[first == last]
    kept = np.zeros(len(motion), bool)
    kept[first] = kept[last] = True
    place = 2.0 * owner + share
    force = wrench[:, :3]
    allowed = NEAR * np.maximum.reduceat(np.linalg.norm(force, axis=1), first)
    for _ in range(MOST_PARTS):
        at = np.flatnonzero(kept)
        straight = np.stack([np.interp(place, place[at], force[at, k]) for k in range(3)], axis=1)
        off = np.linalg.norm(force - straight, axis=1)
        nearest = np.searchsorted(place[at], place)
        before, after = at[np.maximum(nearest - 1, 0)], at[np.minimum(nearest, len(at) - 1)]
        off[np.minimum(np.abs(place - place[before]), np.abs(place[after] - place)) < spacing] = 0.0
        order = np.lexsort((off, owner))
        worst = order[np.append(owner[order][1:] != owner[order][:-1], True)]
        worst = worst[off[worst] > allowed]
        if not len(worst):
            break
        kept[worst] = True
    at = np.flatnonzero(kept)
    twice = np.isin(at, single)  # one place holds for the whole motion
    number = np.repeat(at, 1 + twice)
    shares = share[number]
    again = np.append(False, number[1:] == number[:-1])
    shares[np.append(again[1:], False)], shares[again] = 0.0, 1.0
    return ForceProfiles(motion[number], shares, wrench[number])
