"""Which part of a batch lies where, and what each would cut at every place."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from postproc.base.dataclass import dataclass
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.report.placement import OBJECTIVE_WORDS, CheckedShapes, PlacedFigures, checked_words
from postproc.report.result import Columns, Result
from postproc.report.result_keys import complete_result
from postproc.report.terminal import show_findings, show_rows


@dataclass(frozen=True, eq=False)
class Pair:
    """One part at one place: ``part`` number of the program; its figures there, or what it lacks."""

    part: int
    place: str
    figures: PlacedFigures | None
    lack: Finding | None = None

    def value(self, objective: str) -> float:
        """[m] the objective, infinite where a motion is not feasible."""
        return math.inf if self.figures is None else self.figures.figure(objective)


@dataclass(frozen=True, repr=False)
class PartAssignment(Result):
    """The result of ``compensate assign``.  pairs: part by part, of each all places in their order; chosen: the place
    of each part, "" without one; margins [deg] from limits and singularities; shapes: by which collisions were checked,
    None where they were not."""

    headline = ("objective", "total_mm", "largest_mm", "exit")

    programs: tuple[str, ...]
    places: tuple[str, ...]
    objective: str
    pairs: tuple[Pair, ...]
    chosen: tuple[str, ...]
    margins: tuple[float, float]
    shapes: CheckedShapes | None = None
    findings: tuple[Finding, ...] = ()
    outputs: tuple[str, ...] = ()
    exit: int = 0

    @property
    def assigned(self) -> list[Pair]:
        """The pairs that are chosen, in the order of the parts."""
        return [pair for pair in self.pairs if self.chosen[pair.part] == pair.place]

    @property
    def values(self) -> list[float]:
        """[m] the objectives of the chosen pairs."""
        return [pair.value(self.objective) for pair in self.assigned]

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        result = {
            "programs": list(self.programs),
            "places": list(self.places),
            "objective": self.objective,
            "collisions_checked": self.shapes is not None,
            "limit_margin_deg": self.margins[0],
            "singularity_margin_deg": self.margins[1],
            "assignment": [
                {"program": program, "place": place or None}
                for program, place in zip(self.programs, self.chosen, strict=True)
            ],
            "total_mm": round(sum(self.values) / MM, 7),
            "largest_mm": round(max(self.values) / MM, 7),
            "pairs": [
                {
                    "program": self.programs[pair.part],
                    "place": pair.place,
                    "objective_mm": None
                    if pair.figures is None
                    else round(pair.value(self.objective) / MM, 7),
                    "lack": "" if pair.lack is None else pair.lack.message,
                    "lack_line": 0 if pair.lack is None else pair.lack.line,
                }
                for pair in self.pairs
            ],
            "findings": [finding.as_json() for finding in self.findings],
            "outputs": list(self.outputs),
            "exit": self.exit,
        }
        return complete_result("assign", result)

    def table(self) -> Columns:
        """One row a pair."""
        return {
            "part": np.array([pair.part for pair in self.pairs]),
            "place": np.array([self.places.index(pair.place) for pair in self.pairs]),
            "objective_mm": np.array([pair.value(self.objective) / MM for pair in self.pairs]),
            "chosen": np.array([self.chosen[pair.part] == pair.place for pair in self.pairs]),
        }


def show_assignment(console: Console, done: PartAssignment, verbose: bool = False) -> None:
    """What was checked, the objective of every pair with the chosen ones marked, what is not feasible, and findings."""
    console.print(Text(checked_words(done.shapes), style="bold"), soft_wrap=True)
    total, largest = sum(done.values) / MM, max(done.values) / MM
    rows = [
        ("objective", OBJECTIVE_WORDS[done.objective]),
        ("margins", f"{done.margins[0]:g} deg from axis limits, {done.margins[1]:g} deg from singularities"),
        (
            "result",
            f"{len(done.assigned)} of {len(done.programs)} parts, {total:.3f} mm in all, {largest:.3f} mm at most",
        ),
    ]
    show_rows(console, iter(rows))
    table = Table(box=None, pad_edge=False)
    table.add_column("mm")
    for place in done.places:
        table.add_column(escape(place), justify="right")
    for k, program in enumerate(done.programs):
        cells = [_cell(pair, done) for pair in done.pairs if pair.part == k]
        table.add_row(escape(Path(program).name), *cells)
    console.print(table)
    for pair in done.pairs:
        if pair.lack is not None:
            where = f"{pair.lack.file}:{pair.lack.line}" if pair.lack.line else pair.lack.file
            console.print(Text(f"not feasible: {where} {pair.lack.message}"), soft_wrap=True)
    show_findings(console, done.findings, verbose)
    for path in done.outputs:
        console.print(Text(f"wrote {path}"), soft_wrap=True)


def _cell(pair: Pair, done: PartAssignment) -> str:
    if pair.figures is None:
        return "-"
    mark = " *" if done.chosen[pair.part] == pair.place else "  "
    return f"{pair.value(done.objective) / MM:.3f}{mark}"
