"""Figures as people read them: units, digits, counts, lists that are cut."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from postproc.base.units import MM

if TYPE_CHECKING:
    from postproc.identification.campaign import Campaign

UNITS = {
    "m": ("mm", MM),
    "rad": ("mrad", 1e-3),
    "rad/(N m)": ("urad/(N m)", 1e-6),
    "m/N": ("mm/kN", MM / 1e3),
    "N/m": ("N/mm", 1.0 / MM),
    "N m/rad": ("kN m/rad", 1e3),
    "N m/rad3": ("N m/mrad3", 1e9),
    "N/m3": ("kN/mm3", 1e3 / MM**3),
    "m/K": ("um/K", MM / 1e3),
    "m/s": ("mm/h", MM / 3600.0),
    "1": ("", 1.0),
}
"""SI unit -> the unit that people read, and its size; others are read as they are."""

SHOWN = 5
"""Of long lists, unless ``--verbose`` asks for all."""


def shown_unit(unit: str) -> tuple[str, float]:
    """The unit that people read and its size in SI ``unit``."""
    return UNITS.get(unit, (unit, 1.0))


def in_decimals(value: float | None, decimals: int, missing: str = "-") -> str:
    """``value`` with so many decimals, a zero without a sign; ``missing`` where there is none."""
    if value is None or not math.isfinite(value):
        return missing
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def fixed(value: float, interval: float) -> str:
    """``value`` to two digits of ``interval``, without an exponent where that can be read."""
    if not math.isfinite(value):
        return "-"
    if interval <= 0 or not math.isfinite(interval):
        return f"{value:.6g}"
    decimals = 1 - math.floor(math.log10(interval))
    if decimals > 9 or abs(value) >= 1e9:
        return f"{value:.3e}"
    return f"{round(value, decimals) + 0.0:.{max(0, decimals)}f}"


def two_digits(value: float) -> str:
    """Two significant digits without an exponent."""
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else "-"
    return f"{value:.{max(0, 1 - math.floor(math.log10(abs(value))))}f}"


def some(lines: Sequence[str], verbose: bool) -> list[str]:
    """All of them, or the first and how many more."""
    if verbose or len(lines) <= SHOWN:
        return list(lines)
    return [*lines[:SHOWN], f"and {len(lines) - SHOWN} more (-v shows all)"]


def count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def campaign_in_words(campaign: Campaign) -> str:
    """``30 readings (deflections) at 10 poses, 3 targets, 1 session``"""
    readings = campaign.readings
    kind = "deflections" if readings.deflection else "positions"
    frame = " in the tracker's frame" if campaign.tracked else ""
    return (
        f"{count(len(readings), 'reading')} ({kind}{frame}) at {count(campaign.poses, 'pose')},"
        f" {count(len(campaign.targets), 'target')}, {count(len(readings.sessions), 'session')}"
    )


def listed(words: Iterable[str]) -> str:
    """``a, b and c``"""
    several = list(words)
    return " and ".join([", ".join(several[:-1]), several[-1]] if len(several) > 1 else several)


def millimetres(length: float) -> str:
    """``0.123`` of a length [m], two digits of one below 0.01 mm."""
    if length < 1e-4 * MM:
        return "0.0001"
    return f"{length / MM:.3f}" if length >= 0.01 * MM else f"{length / MM:.2g}"


def known(value: float, decimals: int = 7) -> float | None:
    """A figure of a result, rounded; None where it is not finite."""
    return round(value, decimals) if math.isfinite(value) else None


def known_mm(length: float) -> float | None:
    """A length [m] of a result in mm; None where it is not finite."""
    return known(length / MM)
