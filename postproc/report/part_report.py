"""The error of a part as JSON and as lines on a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from postproc.base.units import MM
from postproc.compensation.uncertainty import Uncertainty
from postproc.report.formatting import known_mm, two_digits

if TYPE_CHECKING:
    from postproc.part.part_figures import CutForces, ErrorFigures, PartFigures, SideFigures, SurfaceGroup

SIDES = {"before": "part before", "after": "part after"}


def part_json(part: PartFigures) -> dict[str, object]:
    """The key ``part_error_mm``; lengths in mm, areas in mm2, excess above zero."""
    return {
        "points": part.points,
        "spacing": known_mm(part.spacing),
        "area_mm2": round(part.area / MM**2, 3),
        "tolerance": known_mm(part.tolerance),
        "before": _side(part.before),
        "after": None if part.after is None else _side(part.after),
        "features": _groups(part.features),
        "operations": _groups(part.operations),
        "as_posted": _forces(part.as_posted),
        "as_compensated": None if part.as_compensated is None else _forces(part.as_compensated),
    }


def _forces(side: CutForces) -> dict[str, object]:
    force = side.force
    return {
        "engagement": "nominal" if force is None else "coupled",
        "reason": side.nominal or None,
        "force_max_n": None if force is None else round(force, 6),
        "nominal_force_max_n": round(side.force_nominal, 6),
        "residual": None if side.residual is None else known_mm(side.residual),
    }


def _errors(figures: ErrorFigures) -> dict[str, float | None]:
    return {
        "gouge_max": known_mm(figures.gouge_max),
        "excess_max": known_mm(figures.excess_max),
        "rms": known_mm(figures.rms),
        "p95": known_mm(figures.p95),
        "out_of_tolerance": round(figures.out, 6),
    }


def _side(side: SideFigures) -> dict[str, object]:
    worst = side.worst
    return {
        **_errors(side.whole),
        "ci95": known_mm(side.ci95),
        "worst": {
            "line": worst.line or None,
            "error": known_mm(worst.error),
            "feature": worst.feature,
            "position": [known_mm(value) for value in worst.position],
        },
    }


def _groups(groups: Sequence[SurfaceGroup]) -> list[dict[str, object]]:
    return [
        {
            "name": group.name,
            "lines": list(group.lines),
            "area_share": round(group.area, 6),
            "before": _errors(group.before),
            "after": None if group.after is None else _errors(group.after),
        }
        for group in groups
    ]


def part_rows(part: PartFigures | None, uncertainty: Uncertainty) -> Iterator[tuple[str, str]]:
    """A line a side: largest gouge and excess, their interval, rms, what is out of tolerance, and the worst place; and
    one of the forces."""
    if part is None:
        return
    for name, side in part.sides:
        yield SIDES[name], side_sentence(side, part.tolerance, uncertainty)
    yield "part forces", forces_sentence(part)


def forces_sentence(part: PartFigures) -> str:
    """With which forces the errors of the part are predicted."""
    sides = (("as posted", part.as_posted), ("as compensated", part.as_compensated))
    words = []
    for name, forces in sides:
        if forces is not None and forces.force is None:
            words.append(f"{name} those of the nominal engagement, because {forces.nominal}")
        elif forces is not None:
            words.append(f"{name} up to {forces.force:.0f} N, engagement and deflection solved together")
    return f"{'; '.join(words)}; of the nominal engagement up to {part.as_posted.force_nominal:.0f} N"


def side_sentence(side: SideFigures, tolerance: float, uncertainty: Uncertainty) -> str:
    """The figures of a side in words."""
    whole, worst = side.whole, side.worst
    interval = ""
    if not np.isnan(side.ci95) and not uncertainty.unknown:
        least = "at least " if uncertainty.lower_bound else ""
        interval = f" +- {least}{two_digits(side.ci95 / MM)} (95 %)"
    where = f"line {worst.line}" if worst.line else "what the blank keeps"
    sign = "excess" if worst.error > 0 else "gouge"
    return (
        f"gouge {whole.gouge_max / MM:.4f}, excess {whole.excess_max / MM:.4f} mm{interval}, rms {whole.rms / MM:.4f}"
        f" mm; {100 * whole.out:.1f} % of the surface beyond {tolerance / MM:g} mm; worst: {sign}, {worst.feature},"
        f" {where}"
    )
