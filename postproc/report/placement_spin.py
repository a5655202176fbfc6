"""What a tool that turns about its spindle along the path would bring."""

from __future__ import annotations

import math
from dataclasses import dataclass

from postproc.base.units import DEG, MM
from postproc.report.formatting import known
from postproc.report.report import Spread

WORTH = 0.95
"""Turning the tool is worth it where it leaves less than this share of the error."""

NONE = Spread(math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class SpinFigures:
    """before, after [m]: the objective as the main job predicts it, with the tool as the program has it and with the
    tool turned, NaN where no program was planned; bound [m]: the least that any turn could leave, by the linear model;
    error: with the tool turned; turn [rad]: least and largest turn; per_length [rad/m], per_time [rad/s]: fastest
    turns, NaN without; motions: whose orientations change; reason: why nothing is proposed, "" where it is worth it."""

    before: float
    after: float = math.nan
    bound: float = math.nan
    error: Spread = NONE
    turn: tuple[float, float] = (0.0, 0.0)
    per_length: float = math.nan
    per_time: float = math.nan
    motions: int = 0
    reason: str = ""

    @property
    def worth(self) -> bool:
        return not self.reason

    @property
    def gain(self) -> float:
        """Share of the objective that the turn takes away; NaN where no program was planned."""
        return 1.0 - self.after / self.before

    def as_json(self) -> dict[str, object]:
        return {
            "worth": self.worth,
            "reason": self.reason,
            "before_mm": known(self.before / MM),
            "after_mm": known(self.after / MM),
            "bound_mm": known(self.bound / MM),
            "gain": known(self.gain),
            "error_mm": self.error.as_mm(),
            "turn_deg": [round(end / DEG, 3) for end in self.turn],
            "deg_per_mm": known(self.per_length * MM / DEG),
            "deg_per_s": known(self.per_time / DEG),
            "motions": self.motions,
        }


def spin_sentence(spin: SpinFigures) -> str:
    """What a turn along the path brings, in one sentence."""
    if spin.reason:
        return f"turning the tool along the path is not worth it: {spin.reason}"
    low, high = (end / DEG for end in spin.turn)
    return (
        f"turning the tool along the path brings {spin.before / MM:.3f} to {spin.after / MM:.3f} mm"
        f" ({spin.gain:.0%} less): {low:.0f} .. {high:.0f} deg in {spin.motions} motions,"
        f" at most {spin.per_length * MM / DEG:.2f} deg/mm"
        + (f" and {spin.per_time / DEG:.0f} deg/s" if math.isfinite(spin.per_time) else "")
    )
