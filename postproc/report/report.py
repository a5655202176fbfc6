"""The report of one program: figures that are computed elsewhere, as words and files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import SEVERITIES, Finding
from postproc.base.units import MM
from postproc.compensation.path_comparison import Transitions
from postproc.compensation.uncertainty import Uncertainty
from postproc.report.formatting import known, known_mm
from postproc.report.part_report import part_json
from postproc.report.result import Columns, Result
from postproc.report.result_keys import complete_result

if TYPE_CHECKING:
    from postproc.part.part_figures import PartFigures

WITHIN, UNCERTAIN, REVIEW, NOT_CORRECTED = "within_tolerance", "uncertain", "needs_review", "not_corrected"
VERDICTS = (WITHIN, UNCERTAIN, REVIEW, NOT_CORRECTED)
"""The verdicts on a correction."""


@dataclass(frozen=True)
class Spread:
    """Largest, root mean square and 95th percentile of a length [m] over motions; NaN over none."""

    max: float
    rms: float
    p95: float

    @staticmethod
    def of(values: Floats) -> Spread:
        """Of ``values`` (N,) [m]; those that are not finite are omitted."""
        seen = values[np.isfinite(values)]
        if not len(seen):
            return Spread(np.nan, np.nan, np.nan)
        return Spread(float(seen.max()), float(np.sqrt(np.mean(seen**2))), float(np.percentile(seen, 95)))

    def as_mm(self) -> dict[str, float | None]:
        values = {"max": self.max, "rms": self.rms, "p95": self.p95}
        return {key: known_mm(value) for key, value in values.items()}


@dataclass(frozen=True)
class Worst:
    """A motion with a large error: its line, and figures in mm and N."""

    line: int
    before_mm: float
    correction_mm: float
    after_mm: float
    force_n: float


@dataclass(frozen=True)
class TransitionMove:
    """An inserted motion between two corrections: the line that it precedes, and its length."""

    line: int
    length_mm: float


@dataclass(frozen=True)
class PathFigures:
    """Errors [m] at the end points of cutting motions along the feed and across it, before and after the correction;
    ``ramp`` [m]: over which a force that steps inside a cut goes over at least; ``ramps``: how many there are;
    ``longest_ramp`` [m], NaN without one, before the motion in ``longest_ramp_line``: a correction that goes back along
    the feed needs more;
    ``transitions``: what the output does where the correction changes."""

    along_before: Spread
    across_before: Spread
    along_after: Spread
    across_after: Spread
    ramp: float
    ramps: int
    longest_ramp: float
    longest_ramp_line: int
    transitions: Transitions

    def as_json(self) -> dict[str, object]:
        transitions = self.transitions
        return {
            "along_feed_mm": {"before": self.along_before.as_mm(), "after": self.along_after.as_mm()},
            "across_feed_mm": {"before": self.across_before.as_mm(), "after": self.across_after.as_mm()},
            "force_ramp_mm": round(self.ramp / MM, 6),
            "force_ramps": self.ramps,
            "force_ramp_max": {"mm": known(self.longest_ramp / MM), "line": self.longest_ramp_line},
            "lead_ins": transitions.lead_ins,
            "stops_added": transitions.stops,
            "backwards": transitions.backwards,
            "correction_rate": {
                "mm_per_mm": known(transitions.rate),
                "mm_per_s": known(transitions.speed / MM),
                "line": transitions.rate_line,
            },
        }


@dataclass(frozen=True, repr=False)
class Report(Result):
    """One program.  ``after``, ``path_error`` (between the points) and ``correction`` are None where nothing was to be
    corrected (predict).  ``uncorrected``: motions that stay as they were although they need a correction.
    ``before_inside`` [m]: largest error across the feed inside of motions along which the force changes, -inf without.
    ``tolerance`` [m] of the cell; ``motion_table``: see ``table``; ``part``: None without a stock."""

    headline = (
        "program",
        "motions",
        "corrected",
        "error_before_mm.max",
        "error_after_mm.max",
        "verdict",
        "exit",
    )

    program: str
    dialect: str
    robot: str
    motions: int
    cuts: int
    cutting: int
    corrected: int
    inserted: int
    transition_moves: tuple[TransitionMove, ...]
    uncorrected: int
    iterations: int
    gain: float
    mode: str
    force_source: str
    force_max_n: float
    force_peak_n: float
    before: Spread
    before_inside: float
    after: Spread | None
    path_error: Spread | None
    correction: Spread | None
    angle_before_deg: float
    angle_after_deg: float | None
    worst: tuple[Worst, ...]
    uncertainty: Uncertainty
    model: dict[str, object]
    digests: dict[str, str]
    findings: tuple[Finding, ...]
    outputs: tuple[str, ...] = ()
    exit: int = 0
    path: PathFigures | None = None
    path_error_deg: float | None = None
    tolerance: float = np.inf
    motion_table: Columns | None = None
    part: PartFigures | None = None

    def table(self) -> Columns:
        """One row a motion of the input, the columns of corrections.csv.  Raises ValueError where they were not kept:
        ``postproc.compensate`` and ``postproc.predict`` keep them."""
        return super().table() if self.motion_table is None else self.motion_table

    @property
    def largest_before(self) -> float:
        """[m] the largest predicted error before the correction, at the points and, where the force changes inside of
        motions, between them; NaN without any."""
        return float(np.fmax(self.before.max, self.before_inside)) if self.cutting else np.nan

    @property
    def largest_after(self) -> float:
        """[m] the largest predicted error after the correction, at the points and between them; NaN without any."""
        ends = [spread.max for spread in (self.after, self.path_error) if spread is not None]
        return float(np.fmax.reduce(ends)) if ends else np.nan

    @property
    def verdict(self) -> str | None:
        """Error plus uncertainty against the tolerance, one of ``VERDICTS``; None where nothing was to be corrected
        (predict)."""
        if self.after is None:
            return None
        if not self.corrected:
            return NOT_CORRECTED
        off = self.largest_after
        if any(finding.severity != SEVERITIES[0] for finding in self.findings) or off > self.tolerance:
            return REVIEW
        sure = off + self.uncertainty.after <= self.tolerance and not self.uncertainty.lower_bound
        return WITHIN if sure else UNCERTAIN

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        result = {
            "program": self.program,
            "dialect": self.dialect,
            "robot": self.robot,
            "motions": self.motions,
            "cuts": self.cuts,
            "cutting": self.cutting,
            "corrected": self.corrected,
            "inserted": self.inserted,
            "transition_moves": [
                {"line": move.line, "length_mm": round(move.length_mm, 6)} for move in self.transition_moves
            ],
            "uncorrected": self.uncorrected,
            "iterations": self.iterations,
            "gain": self.gain,
            "correct": self.mode,
            "force": {
                "source": self.force_source,
                "max_n": round(self.force_max_n, 3),
                "peak_n": known(round(self.force_peak_n, 3)),
            },
            "error_before_mm": {**self.before.as_mm(), "ci95": known(self.uncertainty.before / MM)},
            "largest_error_mm": {
                "before": known(self.largest_before / MM),
                "after": None if self.after is None else known(self.largest_after / MM),
            },
            "error_after_mm": {**self.after.as_mm(), "ci95": known(self.uncertainty.after / MM)}
            if self.after
            else None,
            "path_error_mm": self.path_error.as_mm() if self.path_error else None,
            **(self.path.as_json() if self.path else {}),
            "correction_mm": self.correction.as_mm() if self.correction else None,
            "angle_before_deg": {"max": known(self.angle_before_deg)},
            "angle_after_deg": None if self.angle_after_deg is None else {"max": known(self.angle_after_deg)},
            "path_error_deg": None if self.path_error_deg is None else {"max": known(self.path_error_deg)},
            "part_error_mm": None if self.part is None else part_json(self.part),
            "uncertainty": self._uncertainty(),
            "tolerance_mm": known(self.tolerance / MM),
            "verdict": self.verdict,
            "model": self.model,
            "digests": self.digests,
            "findings": [finding.as_json() for finding in self.findings],
            "outputs": list(self.outputs),
            "exit": self.exit,
        }
        return complete_result("predict" if self.after is None else "program", result)

    def _uncertainty(self) -> dict[str, object]:
        """``known``: the intervals determine it; ``before_mm``, ``after_mm``: half widths (95 %) from the stated
        intervals; ``bound_after_mm``: the largest error after stays below with 95 %, None where the uncertainty is not
        known; ``no_equilibrium``: motions without one within the intervals."""
        uncertainty, after = self.uncertainty, self.after
        bound = np.nan if after is None or uncertainty.unknown else after.max + uncertainty.after
        return {
            "known": not uncertainty.unknown,
            "lower_bound": uncertainty.lower_bound,
            "before_mm": known(uncertainty.before / MM),
            "after_mm": None if after is None else known(uncertainty.after / MM),
            "bound_after_mm": known(bound / MM),
            "budget": [{"parameter": name, "share": round(share, 6)} for name, share in uncertainty.budget],
            "effect_of_10_percent_mm": {
                name: known(length / MM) for name, length in uncertainty.effect_of_10_percent
            },
            "without_interval": [name for name, _ in uncertainty.effect_of_10_percent],
            "level_unstated": list(uncertainty.level_unstated),
            "no_equilibrium": uncertainty.unstable,
        }


class Jsonable(Protocol):
    """A result that has a machine-readable form."""

    def as_json(self) -> dict[str, object]: ...


def exit_code(findings: Sequence[Finding], strict: bool = False) -> int:
    """0 done, 3 not everything is corrected or something needs review, 1 nothing was written; ``strict``: warnings are
    errors."""
    worst = max((SEVERITIES.index(finding.severity) for finding in findings), default=0)
    return (0, 1 if strict else 3, 1)[worst]


def failure(command: str, program: str, findings: Sequence[Finding]) -> dict[str, object]:
    """The machine-readable result of a command that failed; ``program``: "" where it is about none."""
    result = {
        "program": program,
        "findings": [finding.as_json() for finding in findings],
        "outputs": [],
        "exit": 1,
    }
    return complete_result(command, result)


def in_order_of_place(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """By file and line, each once."""
    return tuple(sorted(dict.fromkeys(findings), key=lambda f: (f.file, f.line, f.column, f.code)))


def json_bytes(result: Jsonable) -> bytes:
    """A machine-readable result as the bytes of its file."""
    return (json.dumps(result.as_json(), indent=2, allow_nan=False) + "\n").encode()
