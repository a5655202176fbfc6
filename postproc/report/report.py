"""What is reported of one program: figures that were computed elsewhere, put into words and files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from postproc.arrays import Floats
from postproc.compensation.doubt import Doubt
from postproc.findings import SEVERITIES, Finding
from postproc.units import MM


@dataclass(frozen=True)
class Spread:
    """Largest, root mean square and 95th percentile of a length [m] over motions; NaN over none."""

    max: float
    rms: float
    p95: float

    @staticmethod
    def of(values: Floats) -> Spread:
        seen = values[np.isfinite(values)]
        if not len(seen):
            return Spread(np.nan, np.nan, np.nan)
        return Spread(float(seen.max()), float(np.sqrt(np.mean(seen**2))), float(np.percentile(seen, 95)))

    def as_mm(self) -> dict[str, float | None]:
        values = {"max": self.max, "rms": self.rms, "p95": self.p95}
        return {key: round(v / MM, 7) if np.isfinite(v) else None for key, v in values.items()}


@dataclass(frozen=True)
class Worst:
    """A motion worth a look: its line, and figures in mm and N."""

    line: int
    before_mm: float
    correction_mm: float
    after_mm: float
    force_n: float


@dataclass(frozen=True)
class Link:
    """A motion that leads from one correction to the next: the line before which it stands, and its length."""

    line: int
    length_mm: float


@dataclass(frozen=True)
class Report:
    """One program.  ``after``, ``between`` (the way between points) and ``correction`` are None where nothing was
    corrected (predict)."""

    program: str
    dialect: str
    robot: str
    motions: int
    cuts: int
    cutting: int
    corrected: int
    inserted: int
    links: tuple[Link, ...]
    left: int
    iterations: int
    gain: float
    mode: str
    force_source: str
    force_max_n: float
    force_peak_n: float
    before: Spread
    after: Spread | None
    between: Spread | None
    correction: Spread | None
    angle_before_deg: float
    angle_after_deg: float | None
    worst: tuple[Worst, ...]
    doubt: Doubt
    model: dict[str, object]
    digests: dict[str, str]
    findings: tuple[Finding, ...]
    outputs: tuple[str, ...] = ()
    exit: int = 0
    extra: dict[str, object] = field(default_factory=dict)

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        return {
            "program": self.program,
            "dialect": self.dialect,
            "robot": self.robot,
            "motions": self.motions,
            "cuts": self.cuts,
            "cutting": self.cutting,
            "corrected": self.corrected,
            "inserted": self.inserted,
            "links": [{"line": link.line, "mm": round(link.length_mm, 6)} for link in self.links],
            "left": self.left,
            "iterations": self.iterations,
            "gain": self.gain,
            "correct": self.mode,
            "force": {
                "source": self.force_source,
                "max_n": round(self.force_max_n, 3),
                "peak_n": _finite(round(self.force_peak_n, 3)),
            },
            "error_before_mm": {**self.before.as_mm(), "ci95": _finite(self.doubt.before / MM)},
            "error_after_mm": {**self.after.as_mm(), "ci95": _finite(self.doubt.after / MM)}
            if self.after
            else None,
            "way_after_mm": self.between.as_mm() if self.between else None,
            "correction_mm": self.correction.as_mm() if self.correction else None,
            "angle_before_deg": {"max": _finite(self.angle_before_deg)},
            "angle_after_deg": None
            if self.angle_after_deg is None
            else {"max": _finite(self.angle_after_deg)},
            "doubt": _doubt(self.doubt),
            "model": self.model,
            "digests": self.digests,
            "findings": [finding.as_json() for finding in self.findings],
            "outputs": list(self.outputs),
            "exit": self.exit,
            **self.extra,
        }


class Jsonable(Protocol):
    """A result that has a machine-readable form."""

    def as_json(self) -> dict[str, object]: ...


def exit_code(findings: Sequence[Finding], strict: bool = False) -> int:
    """0 done, 3 something was left or deserves a look, 1 nothing was written; ``strict``: warnings are errors."""
    worst = max((SEVERITIES.index(finding.severity) for finding in findings), default=0)
    return (0, 1 if strict else 3, 1)[worst]


def failure(program: str, findings: Sequence[Finding]) -> dict[str, object]:
    """The machine-readable result where nothing could be done."""
    return {
        "program": program,
        "findings": [finding.as_json() for finding in findings],
        "outputs": [],
        "exit": 1,
    }


def in_order_of_place(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """By file and line, each said once."""
    return tuple(sorted(dict.fromkeys(findings), key=lambda f: (f.file, f.line, f.column, f.code)))


def with_outputs(report: Report, outputs: Sequence[str]) -> Report:
    return replace(report, outputs=tuple(outputs))


def _doubt(doubt: Doubt) -> dict[str, object]:
    return {
        "lower_bound": doubt.lower_bound,
        "without_interval": [name for name, _ in doubt.tenth],
        "ten_percent_mm": {name: _finite(length / MM) for name, length in doubt.tenth},
        "level_unstated": list(doubt.level_unstated),
        "blame": [{"parameter": name, "share": round(share, 6)} for name, share in doubt.blame],
        "unstable": doubt.unstable,
    }


def _finite(value: float) -> float | None:
    return round(value, 7) if np.isfinite(value) else None


def json_bytes(result: Jsonable) -> bytes:
    """A machine-readable result as the bytes of its file."""
    return (json.dumps(result.as_json(), indent=2, allow_nan=False) + "\n").encode()
