"""The part of a large campaign that a search looks at: what takes thousands of readings to show is no effect worth
having, and what a search chooses is fitted to all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Ints
from postproc.identification.campaign import Campaign, sense_of

MANY, SEARCHED = 2000, 1500
"""More readings than the first are searched in so many of them."""

OF_A_POSE = 12
"""Readings of one pose that are looked at at least."""

SEED = 20260102


def sample_of(campaign: Campaign) -> Campaign:
    """``campaign``, or of a large one whole poses at random, as many of each session, with the first reading among
    them."""
    if len(campaign) <= MANY:
        return campaign
    readings = campaign.readings
    # where the order of the rows gives it, some of them are left out
    readings = replace(readings, direction=sense_of(readings))
    rows = _rows(campaign.pose, readings.session, np.random.default_rng(SEED))
    return Campaign(readings.part(rows), campaign.stated_tool)


def _rows(pose: Ints, session: Ints, rng: np.random.Generator) -> Ints:
    """Rows (K,), rising, of ``pose`` and ``session`` (R,)."""
    dealt = rng.permutation(len(pose))
    # of each pose the first ones in a random order
    group = pose * (int(session.max()) + 1) + session
    rank = _rank(group[dealt])
    limit = max(OF_A_POSE, SEARCHED // len(np.unique(group)))
    dealt = dealt[rank < limit]
    # poses in a random order, one of each session after the other
    groups, first = np.unique(group, return_index=True)
    order = rng.permutation(len(groups))
    turn = np.empty(len(groups), np.int64)
    turn[order] = _rank(session[first][order])
    turn[groups == group[0]] = -1
    order = order[np.argsort(turn[order], kind="stable")]
    counts = np.bincount(np.searchsorted(groups, group[dealt]), minlength=len(groups))[order]
    taken = order[np.cumsum(counts) - counts < SEARCHED]
    rows = np.sort(dealt[np.isin(group[dealt], groups[taken])])
    return np.unique(np.append(rows, 0))


def _rank(labels: Ints) -> Ints:
    """(K,) how many of the same label are before each."""
    order = np.argsort(labels, kind="stable")
    starts = np.append(True, np.diff(labels[order]) != 0)
    count = np.arange(len(labels))
    rank = np.empty(len(labels), np.int64)
    rank[order] = count - np.maximum.accumulate(np.where(starts, count, 0))
    return rank
