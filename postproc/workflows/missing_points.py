"""Why a motion whose path is beyond the tolerance has no further points."""

from __future__ import annotations

import numpy as np

from postproc.base.units import MM
from postproc.compensation.subdivision import Subdivision
from postproc.toolpath import Kind
from postproc.workflows.preparation import Prepared, Request


def why_no_more_points(request: Request, ready: Prepared, division: Subdivision, row: int) -> str:
    """What keeps further points out of the motion ``row`` of the program, and what to do: the first that applies."""
    path = ready.task.toolpath
    if request.no_insert:
        return "leave out --no-insert, then points are inserted there"
    if path.kind[row] == Kind.SPL:
        return "only the controller knows the path of a spline: program its points nearer to each other"
    if row in path.constraints.no_insert_before:
        return f"no point can be inserted into this motion: {path.constraints.no_insert_before[row]}"
    if not ready.task.desired_path.traceable[row]:
        return "no point can be inserted into this motion: where it starts is not known"
    if row in division.not_refined:
        return f"no point can be inserted into this motion: {division.not_refined[row].message}"
    if any(finding.code == "COR014" for finding in division.findings):
        return "max_growth allows no further points: state a larger one in the cell"
    length = float(ready.task.desired_path.length[row]) / int(np.sum(division.source == row))
    by_feed = float(np.nan_to_num(path.feed[row])) * 1e-3 * ready.cell.cycle_ms
    if length < 2.0 * max(by_feed, ready.cell.min_segment):
        shown = f"half of a motion of {length / MM:.3f} mm"
        if by_feed > ready.cell.min_segment:
            return (
                f"{shown} is shorter than what the tool moves in one cycle of the controller ({by_feed / MM:.3f} mm,"
                " cycle_ms): program a lower feed there"
            )
        least = f"{ready.cell.min_segment / MM:g} mm"
        return f"{shown} is shorter than min_segment ({least}): state a smaller one in the cell"
    return "more points there do not bring the path nearer: loosen the tolerance, or program this place otherwise"
