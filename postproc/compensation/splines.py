"""What is not known of a spline: the path between its points, and with it the feed that a force turns with, is the
controller's own."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.geometry import lengths
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.problem import CompensationProblem
from postproc.toolpath import Kind


def unknown_displacements(task: CompensationProblem, result: CorrectionResult) -> tuple[Ints, Floats]:
    """Rows (K,) of the corrected points of splines, and (K,) [m] by how much the displacement of the tool on the path
    to each of them may be another than the one that is corrected.

    A correction takes the feed to run along the chords.  At a point of a spline the feed lies between those of both
    sides, where the correction has their mean; where a spline starts or ends it turns as far away from its chord.  So
    the displacement is unknown by half of what the force changes it by from the start of the chord to its end, and at
    the ends of a spline by all of that.
    """
    spline = result.corrected & (task.toolpath.kind == Kind.SPL) & task.carries
    rows = np.flatnonzero(spline)
    inside = np.append(False, spline)[rows] & np.append(spline, False)[rows + 1]

    def changed(part: slice) -> Floats:
        at = rows[part]
        wanted = task.wanted[at]
        start, end = (
            task.simulated(at, wanted, task.force.along(at, np.full(len(at), share))).pose.position
            for share in (0.0, 1.0)
        )
        return lengths(end - start)

    change = np.concatenate([np.empty(0), *in_blocks(changed, len(rows))])
    return rows, np.where(inside, 0.5, 1.0) * change
