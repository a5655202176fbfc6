"""Where the controller was sent when a compensated program cut a place of the original."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses
from postproc.base.units import MM
from postproc.verification.pairing import Pairing
from postproc.workflows.preparation import Prepared

_SEARCH, _SEARCH_SHARE = 20 * MM, 0.03
_AWAY = 12 * MM


def commands_at(
    ready: Prepared, other: Prepared, pairing: Pairing, row: Ints, share: Floats
) -> tuple[Poses, Bools]:
    """Poses (K) that program ``other`` commands where the original is at ``share`` (K,) of motions ``row`` (K,), and
    (K,) whether that is not known: the place of the paired cut, about as far along its path, that is nearest to where
    the model would send the controller.  A correction is longer than what two models differ by."""
    task, run = ready.task, other.task
    wanted = task.desired_path.at(row, share)
    wrench = task.force.along(row, share)
    sent = task.command(row, wanted, wrench, task.goal(row, wanted, share), share=share)
    aim = np.where(sent.converged[:, None], sent.command.position, wanted.position)
    lost = np.ones(len(row), bool)
    at, along = np.zeros(len(row), np.int64), np.zeros(len(row))
    cuts = pairing.stretches
    cut = np.searchsorted(cuts.start, row, side="right") - 1
    for number in np.unique(cut).tolist():
        if number < 0:
            continue
        own = np.flatnonzero((cut == number) & (row < cuts.stop[number]))
        first, last = int(pairing.start[number]), int(pairing.stop[number])
        if not len(own) or last <= first:
            continue
        rows = np.arange(first, last)
        start, end = run.desired_path.start[rows], run.desired_path.end[rows]
        length = task.desired_path.length[cuts.start[number] : cuts.stop[number]]
        station = np.append(0.0, np.cumsum(length))
        place = station[row[own] - cuts.start[number]] + share[own] * length[row[own] - cuts.start[number]]
        ends = np.cumsum(run.desired_path.length[rows])
        scale = ends[-1] / max(float(station[-1]), 1e-9)
        for one, where in zip(own.tolist(), (place * scale).tolist(), strict=True):
            slack = _SEARCH + _SEARCH_SHARE * where
            low = int(np.searchsorted(ends, where - slack))
            high = min(int(np.searchsorted(ends, where + slack)) + 1, len(rows))
            step = end.position[low:high] - start.position[low:high]
            away = aim[one] - start.position[low:high]
            t = np.clip(
                np.sum(away * step, axis=1) / np.maximum(np.sum(step * step, axis=1), 1e-18), 0.0, 1.0
            )
            distance = np.linalg.norm(away - t[:, None] * step, axis=1)
            best = int(np.nanargmin(distance)) if np.isfinite(distance).any() else -1
            if best >= 0 and distance[best] < _AWAY:
                at[one], along[one], lost[one] = rows[low + best], t[best], False
    poses = run.desired_path.at(at, along)
    return poses, lost
