"""The error of the part of a program whose process states a stock."""

from __future__ import annotations

from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.compensation.subdivision import Subdivision
from postproc.part.part_figures import PartError
from postproc.workflows.force_log import logged_force_findings
from postproc.workflows.preparation import Prepared


def part_error_of(
    ready: Prepared, division: Subdivision | None
) -> tuple[PartError | None, tuple[Finding, ...]]:
    """The error of the part as posted, and with ``division`` as compensated, and the findings of it; None without a
    stock, or where it is not known."""
    task = ready.task
    if task.force.stock is None:
        return None, logged_force_findings(ready)
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
    return with_uncertainty(part, task, run, division, stated), _beyond_tolerance(part, task.file)


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
