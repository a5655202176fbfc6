"""What was learnt from a measured part, as a table, JSON and CSV."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.learning.attribution import Attribution
from postproc.learning.causes import Cause, CauseKind
from postproc.learning.promise import Promise
from postproc.learning.unobserved import products, unobserved
from postproc.report.report import Report
from postproc.report.result import Columns, Result
from postproc.report.result_keys import complete_result
from postproc.robot.description import COVERAGE

VERDICTS = ("nothing_missing", "named", "partly_named", "ambiguous", "unknown")
GROUPS = ("robot", "force", "tool", "base", "effect")
COLUMNS = (
    "file_line", "program_line", "operation", "feature", "x_mm", "y_mm", "z_mm", "measured_mm", "alignment_mm",
    "causes_mm", "smooth_mm", "remaining_mm", "outlier",
)  # fmt: skip
"""Columns of the CSV, one row a point."""

MOST_RIVALS, MOST_PRODUCTS = 5, 10


@dataclass(frozen=True)
class LearnedPart:
    """A part: its ``file``, the SHA-256 of the program that cut it, ``rms`` [m] of its error, and the ends [m] of the
    95 % interval that was promised of it, None where another command wrote its program."""

    file: str
    program: str
    rms: float
    promised: tuple[float, float] | None


@dataclass(frozen=True, eq=False, repr=False)
class Learned(Result):
    """The result of ``compensate learn``: K points of ``measured``.  line, file (K,): of the measured point; operation,
    feature: names (K); program_line (K,); in_base (K, 3) [m]."""

    headline = ("program", "verdict", "promise.before_rms_mm", "promise.after_rms_mm", "exit")

    program: str
    robot: str
    data: tuple[tuple[str, str], ...]
    measured: int
    attribution: Attribution
    feature: tuple[str, ...]
    line: Ints
    file: Ints
    operation: tuple[str, ...]
    program_line: Ints
    in_base: Floats
    promise: Promise
    history: tuple[LearnedPart, ...]
    gain: float
    findings: tuple[Finding, ...]
    exit: int
    outputs: tuple[str, ...] = ()
    next_program: Report | None = None

    @property
    def remaining(self) -> Floats:
        """(K,) [m] of the deviations that nothing explains."""
        result = self.attribution
        return result.deviation - result.by_alignment - result.by_causes - result.by_field

    @cached_property
    def residual_rms(self) -> float:
        """[m] of the points that are no outliers."""
        return float(np.sqrt(np.mean(self.remaining[self.attribution.kept] ** 2)))

    def table(self) -> Columns:
        """One row a point, the columns of ``--csv``."""
        result = self.attribution
        place = self.in_base / MM
        values = {
            "file_line": self.line,
            "program_line": self.program_line,
            "operation": np.array(self.operation),
            "feature": np.array(self.feature),
            **dict(zip(("x_mm", "y_mm", "z_mm"), place.T, strict=True)),
            "measured_mm": result.deviation / MM,
            "alignment_mm": result.by_alignment / MM,
            "causes_mm": result.by_causes / MM,
            "smooth_mm": result.by_field / MM,
            "remaining_mm": self.remaining / MM,
            "outlier": (~result.kept).astype(int),
        }
        return {name: values[name] for name in COLUMNS}

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        result = self.attribution
        surface = result.surface
        answer = {
            "program": self.program,
            "robot": self.robot,
            "data": [{"file": name, "sha256": digest} for name, digest in self.data],
            "points": {
                "measured": self.measured,
                "used": int(result.kept.sum()),
                "outliers": int((~result.kept).sum()),
            },
            "verdict": result.verdict,
            "named": [{"effect": one.name, "likelihood_gain": round(one.gain, 3)} for one in result.named],
            "alternatives": [
                {"effect": one.name, "likelihood_gain": round(one.gain, 3)}
                for one in result.rivals[:MOST_RIVALS]
            ],
            "ambiguous": list(result.alternatives),
            "causes": [cause_entry(cause, value, width) for cause, value, width in self.causes()],
            "unobserved": list(unobserved(result)),
            "products": [
                {"causes": [one, other], "ci95": round(width, 6)}
                for one, other, width in products(result)[:MOST_PRODUCTS]
            ],
            "smooth": {
                "rms_mm": round(float(np.sqrt(np.mean(result.by_field**2))) / MM, 6),
                "length_mm": round(surface.length / MM, 3),
                "unshared_mm": round(surface.white / MM, 6),
            },
            "residual_rms_mm": round(self.residual_rms / MM, 6),
            "promise": {
                "before_rms_mm": round(self.promise.before / MM, 6),
                "after_rms_mm": round(self.promise.after / MM, 6),
                "lower_rms_mm": round(self.promise.lower / MM, 6),
                "upper_rms_mm": round(self.promise.upper / MM, 6),
            },
            "history": [_part_entry(one) for one in self.history],
            "gain": self.gain,
            "next_program": None if self.next_program is None else _following(self.next_program),
            "findings": [finding.as_json() for finding in self.findings],
            "outputs": list(self.outputs),
            "exit": self.exit,
        }
        return complete_result("learn", answer)

    def causes(self) -> list[tuple[Cause, float, float]]:
        """Each cause with its value and its standard deviation after the measurement, but those of an effect that the
        part does not distinguish from others."""
        result = self.attribution
        every = zip(result.causes, result.x.tolist(), result.deviations.tolist(), strict=True)
        return [one for one in every if not result.is_unsure(one[0])]


def _part_entry(one: LearnedPart) -> dict[str, object]:
    ends = [None, None] if one.promised is None else [round(end / MM, 6) for end in one.promised]
    return {
        "file": one.file,
        "program_sha256": one.program,
        "rms_mm": round(one.rms / MM, 6),
        "promised_lower_rms_mm": ends[0],
        "promised_upper_rms_mm": ends[1],
    }


def _following(report: Report) -> dict[str, object]:
    """What the main job made of the next program."""
    after = None if report.after is None or not np.isfinite(report.after.max) else report.after.max
    return {
        "file": report.outputs[0] if report.outputs else None,
        "corrected": report.corrected,
        "error_after_max_mm": None if after is None else round(after / MM, 6),
        "exit": report.exit,
    }


def shown_unit(cause: Cause) -> tuple[str, float]:
    """The unit in which a cause is reported, and its size."""
    if cause.is_share():
        return "1", 1.0
    if cause.unit == "m":
        return "mm", MM
    if cause.unit == "rad" and cause.kind is not CauseKind.VALUE:
        return "deg", DEG
    return cause.unit, 1.0


def cause_entry(cause: Cause, value: float, deviation: float) -> dict[str, object]:
    """Name, value with its 95 % interval, and the half width before; of a share, the factor."""
    unit, size = shown_unit(cause)
    low, high = value - COVERAGE * deviation, value + COVERAGE * deviation
    if cause.is_share():
        low, value, high = (float(np.exp(one)) for one in (low, value, high))
    return {
        "cause": cause.name,
        "group": cause.group,
        "value": _digits(value / size),
        "lower": _digits(low / size),
        "upper": _digits(high / size),
        "unit": unit,
        "before_ci95": _digits(COVERAGE * cause.deviation / size),
    }


def _digits(value: float) -> float:
    return float(f"{value:.6g}")


def learned_csv(learned: Learned) -> bytes:
    """One row a point."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    columns = learned.table()
    for row in zip(*(columns[name].tolist() for name in COLUMNS), strict=True):
        writer.writerow([f"{one:.6f}" if isinstance(one, float) else one for one in row])
    return stream.getvalue().encode()
