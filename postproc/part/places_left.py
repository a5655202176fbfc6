"""Why a place of the part stays out of tolerance although the program is corrected, and by which motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision
from postproc.part.coupled_engagement import AFTER, find_vertices
from postproc.part.part_error import paths_of
from postproc.part.part_figures import PartError, PartSide
from postproc.process.stock.simulation import StockRun

UNCORRECTED = "no correction is written for the motion"
TURNS = "the path turns inside of the cut, and the force with it at once; the correction follows along a motion only"
CHANGES = "the force changes inside of the motion where the tool enters, leaves or meets a corner"


class PlacesLeft(NamedTuple):
    """Places of the part that are out of tolerance for one ``cause``: the motions (L,) that leave them, the worst of
    these, the error [m] there and the share [-] of the surface of the program."""

    cause: str
    motions: Ints
    worst: int
    error: float
    share: float


def find_places_left(
    part: PartError, task: CompensationProblem, run: StockRun, division: Subdivision
) -> list[PlacesLeft]:
    """The causes of what stays out of tolerance as compensated, the largest error first; no place of unknown cause."""
    side = part.after
    assert side is not None
    area = part.surface.area[part.own]
    out = (np.abs(side.error) > part.figures.tolerance) & (side.motion >= 0)
    motion = np.maximum(side.motion, 0)
    uncorrected = ~_corrected(division, len(task.toolpath))[motion]
    turning = _near_vertex(side, motion, task, run)
    changing = np.isin(motion, run.sweeps.motion[run.engagement.uneven])
    left = []
    seen = np.zeros(len(out), bool)
    for cause, holds in ((UNCORRECTED, uncorrected), (TURNS, turning), (CHANGES, changing)):
        at = np.flatnonzero(out & holds & ~seen)
        seen |= holds
        if len(at):
            worst = at[np.argmax(np.abs(side.error[at]))]
            share = float(area[at].sum() / area.sum())
            motions = np.unique(motion[at])
            left.append(PlacesLeft(cause, motions, int(motion[worst]), float(side.error[worst]), share))
    return sorted(left, key=lambda one: -abs(one.error))


def _corrected(division: Subdivision, count: int) -> Bools:
    """(N,) motions of which any part is moved."""
    corrected = np.zeros(count, bool)
    corrected[division.source[division.moved]] = True
    return corrected


def _near_vertex(side: PartSide, motion: Ints, task: CompensationProblem, run: StockRun) -> Bools:
    """(K,) points that are left near a vertex inside of a cut."""
    paths = paths_of(run)
    start, end = find_vertices(paths)
    length = task.desired_path.length
    before, after = np.full((2, len(length)), np.inf)
    for which, at, share in ((after, start, paths.share[:, 0]), (before, end, paths.share[:, 1])):
        which[paths.motion[at]] = share[at]
    gap = np.minimum(_gap(side.share - after[motion]), _gap(before[motion] - side.share))
    return np.asarray(np.isfinite(gap) & (np.nan_to_num(gap, posinf=0.0) * length[motion] <= AFTER))


def _gap(share: Floats) -> Floats:
    """Shares of the path behind a vertex, infinite where there is none."""
    return np.where(np.isfinite(share), np.maximum(share, 0.0), np.inf)
