"""What is reported of two programs that were simulated."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from postproc.findings import Finding
from postproc.report.report import Spread
from postproc.report.terminal import show_findings
from postproc.units import MM


@dataclass(frozen=True)
class Place:
    """A place on the path: its line, the error [mm], the axis of the base along which it is largest, the force [N]."""

    line: int
    error_mm: float
    axis: str
    force_n: float


@dataclass(frozen=True)
class Way:
    """One program.  samples; error: along its cuts; ends: first and last samples of cuts; links, link_length [m] and
    on_links: motions that only lead from one correction to the next; skipped: motions that were not simulated."""

    samples: int
    error: Spread
    ends: Spread
    links: int
    link_length: float
    on_links: Spread
    skipped: int
    worst: tuple[Place, ...]

    def as_json(self) -> dict[str, object]:
        return {
            **self.error.as_mm(),
            "samples": self.samples,
            "cut_ends": self.ends.as_mm(),
            "links": {
                "count": self.links,
                "length_mm": round(self.link_length / MM, 3),
                **self.on_links.as_mm(),
            },
            "skipped": self.skipped,
            "worst": [
                {"line": p.line, "mm": round(p.error_mm, 6), "axis": p.axis, "force_n": round(p.force_n, 3)}
                for p in self.worst
            ],
        }


@dataclass(frozen=True)
class Verified:
    """Two programs under the same forces; step, tolerance [m]."""

    original_file: str
    compensated_file: str
    robot: str
    force_source: str
    motions: int
    compensated_motions: int
    step: float
    tolerance: float
    original: Way
    compensated: Way
    findings: tuple[Finding, ...]
    exit: int

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        return {
            "programs": [self.original_file, self.compensated_file],
            "robot": self.robot,
            "force": {"source": self.force_source},
            "motions": [self.motions, self.compensated_motions],
            "growth": round(self.compensated_motions / max(self.motions, 1), 6),
            "step_mm": self.step / MM,
            "tolerance_mm": self.tolerance / MM,
            "samples": self.compensated.samples,
            "original": self.original.as_json(),
            "compensated": self.compensated.as_json(),
            "findings": [finding.as_json() for finding in self.findings],
            "exit": self.exit,
        }


def show(console: Console, done: Verified, verbose: bool = False) -> None:
    """The two programs side by side, the ten worst places, and the findings."""
    console.print(
        f"{escape(done.original_file)}: {done.motions} motions; {escape(done.compensated_file)}:"
        f" {done.compensated_motions} ({done.compensated_motions / max(done.motions, 1):.3f} times as many)",
        soft_wrap=True,
    )
    console.print(
        f"robot {escape(done.robot)}, force: {escape(done.force_source)}; a sample every {done.step / MM:g} mm at"
        f" least, tolerance {done.tolerance / MM:g} mm",
        soft_wrap=True,
    )
    table = Table(box=None, pad_edge=False)
    for head in ("path error, mm", "max", "rms", "95 % below", "cut ends max", "links", "samples"):
        table.add_column(head, justify="left" if head.startswith("path") else "right")
    for name, way in (("original", done.original), ("compensated", done.compensated)):
        links = f"{way.links} ({way.link_length / MM:.1f} mm)" if way.links else "0"
        table.add_row(
            name,
            *(_mm(v) for v in (way.error.max, way.error.rms, way.error.p95, way.ends.max)),
            links,
            str(way.samples),
        )
    console.print(table)
    if done.compensated.worst:
        console.print("worst places of the compensated program")
        places = Table(box=None, pad_edge=False)
        for head in ("line", "mm", "axis", "force N"):
            places.add_column(head, justify="right")
        for place in done.compensated.worst:
            places.add_row(str(place.line), f"{place.error_mm:.4f}", place.axis, f"{place.force_n:.0f}")
        console.print(places)
    show_findings(console, done.findings, verbose)


def _mm(value: float) -> str:
    return "-" if math.isnan(value) else f"{value / MM:.4f}"
