"""What is reported of the corners that the controller rounds off."""

from __future__ import annotations

import numpy as np

from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.compensation.unknown_distance import largest_distance
from postproc.output.write import WrittenProgram
from postproc.workflows.preparation import Prepared


def corner_findings(ready: Prepared, written: WrittenProgram) -> list[Finding]:
    """Approximated corners of the output that differ from the path of the original by more than the tolerance: where
    the approximation is stated (COR017), and where it is not (COR015)."""
    corners, tolerance, findings = written.corners, ready.cell.tolerance, []
    if ready.task.gain < 1.0:  # a share of the correction moves corners as it moves the rest
        return []
    for code, stated in (("COR017", ~corners.unknown), ("COR015", corners.unknown)):
        above = stated & ~(corners.difference <= tolerance)
        if not above.any():
            continue
        worst = int(np.argmax(np.where(above, np.nan_to_num(corners.difference, posinf=np.inf), -1.0)))
        off, distance = corners.difference[worst] / MM, corners.distance[worst] / MM
        limit = f"tolerance {tolerance / MM:g} mm ({int(above.sum())} corners, the worst here)"
        message = f"a corner that the controller approximates from {distance:.2f} mm on differs"
        help = (
            "use a smaller approximation distance there, or a smaller feed, with which points may be nearer to each"
            " other, or state a longer force_ramp in the cell if the force changes more slowly"
        )
        if code == "COR015":
            within = np.floor(largest_distance(ready.task, written.division, corners) / MM * 100) / 100
            message = (
                f"no approximation distance is stated; all corners are within the tolerance if the controller"
                f" approximates from {within:.2f} mm on at most; with half of each motion, as far as it may, one"
                " differs"
            )
            help = f"limit what the control approximates to {within:.2f} mm, or state the distance in the program"
        message += f" by {off:.4f} mm from that of the original, {limit}"
        line = int(ready.task.toolpath.line[corners.row[worst]])
        findings.append(Finding(code, message, ready.task.file, line, help=help))
    return findings
