"""What is reported of the corners that the controller rounds off."""

from __future__ import annotations

import numpy as np

from postproc.base.findings import Finding
from postproc.base.units import MM
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
        if code == "COR015":
            message = (
                f"no approximation distance is stated; with the largest possible one,"
                f" {distance:.2f} mm, a corner differs"
            )
        message += f" by {off:.4f} mm from that of the original, {limit}"
        help = (
            "use a smaller approximation distance there, or a smaller feed, with which points may be nearer to each"
            " other, or state a longer force_ramp in the cell if the force changes more slowly"
        )
        line = int(ready.task.toolpath.line[corners.row[worst]])
        findings.append(Finding(code, message, ready.task.file, line, help=help))
    return findings
