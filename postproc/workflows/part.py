"""The error of the part of a program whose process states a stock."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.base.arrays import Ints
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.compensation.subdivision import Subdivision
from postproc.part import codes as codes
from postproc.workflows.force_log import stated_force_findings
from postproc.workflows.preparation import Prepared

if TYPE_CHECKING:
    from postproc.part.part_figures import PartError

_MOST_LINES = 12


def part_error_of(
    ready: Prepared, division: Subdivision | None
) -> tuple[PartError | None, tuple[Finding, ...]]:
    """The error of the part as posted, and with ``division`` as compensated, and the findings of it; None without a
    stock, or where it is not known."""
    task = ready.task
    if task.force.stock is None:
        return None, stated_force_findings(ready)
    from postproc.part.part_error import find_part_error  # numba: only where there is a stock
    from postproc.part.part_uncertainty import StatedIntervals, with_uncertainty
    from postproc.process.stock.simulation import StockRun

    run = task.force.stock
    assert isinstance(run, StockRun)
    factored = bool(ready.cell.force_factors) or task.known_error is not None
    why = "a measured part showed how they and the tool differ" if factored else ""
    part = find_part_error(task, run, division, as_nominal=why)
    if isinstance(part, Finding):
        return None, (part,)
    stated = StatedIntervals(ready.cell.force_ci95, ready.cell.force_vector)
    findings = _beyond_tolerance(part, task.file)
    if findings and division is not None:
        from postproc.part.places_left import find_places_left

        line = task.toolpath.line
        for left in find_places_left(part, task, run, division):
            kind = "an excess" if left.error > 0 else "a gouge"
            message = (
                f"{left.cause}: {100 * left.share:.2g} % of the surface stays out of tolerance for it"
                f" ({_lines(line[left.motions])}), with {kind} of {abs(left.error) / MM:.3f} mm here"
            )
            findings += (Finding("PRT003", message, task.file, int(line[left.worst])),)
    if len(part.unsettled):
        lines = task.toolpath.line[part.unsettled]
        message = (
            f"no position of the tool near the one before is in equilibrium with its force in {_lines(lines)}:"
            " the error of the part is less certain there"
        )
        findings += (Finding("PRT004", message, task.file, int(lines[0])),)
    return with_uncertainty(part, task, run, division, stated), findings


def _lines(lines: Ints) -> str:
    """Lines (L,) in words, up to ``_MOST_LINES`` of them by number."""
    lines = np.unique(lines)
    if len(lines) == 1:
        return f"line {lines[0]}"
    if len(lines) <= _MOST_LINES:
        return f"lines {', '.join(map(str, lines[:-1].tolist()))} and {lines[-1]}"
    return f"{len(lines)} lines from {lines[0]} to {lines[-1]}"


def _beyond_tolerance(part: PartError, file: str) -> tuple[Finding, ...]:
    after, tolerance = part.figures.after, part.figures.tolerance
    if after is None or abs(after.worst.error) <= tolerance:
        return ()
    worst = after.worst
    kind = "an excess" if worst.error > 0 else "a gouge"
    place = ", ".join(f"{value / MM:.1f}" for value in worst.position)
    message = (
        f"as compensated {100 * after.whole.out:.1f} % of the surface of the part exceeds the tolerance"
        f" {tolerance / MM:g} mm; the worst is {kind} of {abs(worst.error) / MM:.3f} mm at {place} (mm, axes of the"
        " stock)"
    )
    return (Finding("PRT002", message, file, worst.line),)
