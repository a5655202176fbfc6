"""The report on two programs that were simulated."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.report.formatting import in_decimals, known
from postproc.report.report import REVIEW, WITHIN, Spread
from postproc.report.result import Columns, Result, columns_of
from postproc.report.result_keys import complete_result
from postproc.report.terminal import show_findings


@dataclass(frozen=True)
class WorstError:
    """A place on the path: its line, the error [mm], the axis of the base along which it is largest, the force [N]."""

    line: int
    error_mm: float
    axis: str
    force_n: float


@dataclass(frozen=True)
class PathComparison:
    """One program.  samples; error: distance of the tool from the desired path, along its cuts; ends: at the first and
    last places of cuts, along_at_ends [m] the share of it along the path; missed [m]: the largest distance of an end
    point of the desired path from the path of the tool; turn [rad]: the largest error of the orientation; change [m],
    change_turn [rad]: what twice as many samples changed of the largest; stops: exact stops inside cuts; backwards:
    motions against the feed;
    approaches, approach_length [m]: motions in air to where a cut starts corrected; unknown_corners: approximated by a
    distance that is not known, run as they are programmed; points_alone: motions of whose path only the controller
    knows more than the end point, as of splines and drilled holes; skipped: motions that were not simulated;
    converged: force and place agree everywhere, else there are no figures."""

    samples: int
    error: Spread
    ends: Spread
    along_at_ends: float
    missed: float
    turn: float
    change: float
    change_turn: float
    stops: int
    backwards: int
    approaches: int
    approach_length: float
    unknown_corners: int
    points_alone: int
    skipped: int
    converged: bool
    worst: tuple[WorstError, ...]

    def worst_as_json(self) -> list[dict[str, object]]:
        """The worst places."""
        return [
            {"line": p.line, "mm": round(p.error_mm, 6), "axis": p.axis, "force_n": round(p.force_n, 3)}
            for p in self.worst
        ]

    def as_json(self) -> dict[str, object]:
        return {
            **self.error.as_mm(),
            "samples": self.samples,
            "converged": self.converged,
            "orientation_deg": known(self.turn / DEG),
            "missed": known(self.missed / MM),
            "cut_ends": {**self.ends.as_mm(), "along": known(self.along_at_ends / MM)},
            "doubling": {"mm": known(self.change / MM), "deg": known(self.change_turn / DEG)},
            "stops": self.stops,
            "backwards": self.backwards,
            "approaches": {"count": self.approaches, "length_mm": round(self.approach_length / MM, 3)},
            "unknown_corners": self.unknown_corners,
            "points_alone": self.points_alone,
            "skipped": self.skipped,
            "worst": self.worst_as_json(),
        }


@dataclass(frozen=True, repr=False)
class Verified(Result):
    """Two programs under the same forces; step, tolerance [m], tolerance_angle [rad]."""

    headline = ("original.max", "compensated.max", "tolerance_mm", "exit")

    original_file: str
    compensated_file: str
    robot: str
    force_source: str
    motions: int
    compensated_motions: int
    step: float
    tolerance: float
    tolerance_angle: float
    original: PathComparison
    compensated: PathComparison
    findings: tuple[Finding, ...]
    exit: int

    @property
    def verdict(self) -> str | None:
        """Whether the compensated program is within the tolerances along its whole path; None where that is not known,
        or nothing cuts with a force."""
        error, turn = self.compensated.error.max, self.compensated.turn
        if not self.compensated.converged or math.isnan(error) or math.isnan(turn):
            return None
        return WITHIN if error <= self.tolerance and turn <= self.tolerance_angle else REVIEW

    def table(self) -> Columns:
        """The worst places of both programs: program, line, mm, axis, force_n."""
        programs = (("original", self.original), ("compensated", self.compensated))
        rows = [{"program": name, **place} for name, one in programs for place in one.worst_as_json()]
        return columns_of(rows)

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        result = {
            "programs": [self.original_file, self.compensated_file],
            "robot": self.robot,
            "force": {"source": self.force_source},
            "motions": [self.motions, self.compensated_motions],
            "growth": round(self.compensated_motions / max(self.motions, 1), 6),
            "step_mm": self.step / MM,
            "tolerance_mm": self.tolerance / MM,
            "tolerance_deg": self.tolerance_angle / DEG,
            "converged": self.original.converged and self.compensated.converged,
            "samples": self.compensated.samples,
            "original": self.original.as_json(),
            "compensated": self.compensated.as_json(),
            "verdict": self.verdict,
            "findings": [finding.as_json() for finding in self.findings],
            "exit": self.exit,
        }
        return complete_result("verify", result)


def verdict_sentence(done: Verified) -> str:
    """The verdict with its figures."""
    if not done.compensated.converged:
        return "not known: force and position do not converge everywhere in the compensated program"
    if done.verdict is None:
        return "no motion cuts with a force: there is no error to compare"
    comparison = done.compensated
    found = (
        (
            f"{comparison.error.max / MM:.4f} mm",
            f"{done.tolerance / MM:g} mm",
            comparison.error.max > done.tolerance,
        ),
        (
            f"{comparison.turn / DEG:.4f} deg",
            f"{done.tolerance_angle / DEG:g} deg",
            comparison.turn > done.tolerance_angle,
        ),
    )
    if done.verdict == WITHIN:
        where = "where it is compared" if comparison.points_alone else "along the whole path"
        return f"within tolerance {where}: " + ", ".join(
            f"{value} of {allowed}" for value, allowed, _ in found
        )
    exceeded = [f"{value} exceeds the tolerance {allowed}" for value, allowed, beyond in found if beyond]
    return f"needs review: {', '.join(exceeded)}"


def show(console: Console, done: Verified, verbose: bool = False) -> None:
    """The two programs side by side, the ten worst places, and the findings."""
    console.print(
        f"{escape(done.original_file)}: {done.motions} motions; {escape(done.compensated_file)}:"
        f" {done.compensated_motions} ({done.compensated_motions / max(done.motions, 1):.3f} times as many)",
        soft_wrap=True,
    )
    console.print(
        f"robot {escape(done.robot)}, force: {escape(done.force_source)}; tolerance {done.tolerance / MM:g} mm,"
        f" {done.tolerance_angle / DEG:g} deg",
        soft_wrap=True,
    )
    console.print(distance_table(done))
    console.print(f"verdict: {verdict_sentence(done)}", soft_wrap=True)
    for note in sampling_notes(done.compensated):
        console.print(note, soft_wrap=True)
    if done.compensated.worst:
        console.print("worst places of the compensated program")
        console.print(worst_table(done.compensated))
    show_findings(console, done.findings, verbose)


def distance_table(done: Verified) -> Table:
    """Both programs: distance of the tool from the path, orientation, stops."""
    table = Table(box=None, pad_edge=False)
    heads = (
        "distance from the path, mm",
        "max",
        "rms",
        "95 % below",
        "cut ends",
        "along",
        "orientation, deg",
        "stops",
        "backward",
    )
    for number, head in enumerate((*heads, "samples")):
        table.add_column(head, justify="right" if number else "left")
    for name, comparison in (("original", done.original), ("compensated", done.compensated)):
        table.add_row(
            name,
            *(
                in_decimals(v / MM, 4)
                for v in (
                    comparison.error.max,
                    comparison.error.rms,
                    comparison.error.p95,
                    comparison.ends.max,
                    comparison.along_at_ends,
                )
            ),
            "-" if math.isnan(comparison.turn) else f"{comparison.turn / DEG:.4f}",
            *(str(count) for count in (comparison.stops, comparison.backwards, comparison.samples)),
        )
    return table


def worst_table(comparison: PathComparison) -> Table:
    """The places with the largest errors of one program."""
    places = Table(box=None, pad_edge=False)
    for head in ("line", "mm", "axis", "force N"):
        places.add_column(head, justify="right")
    for place in comparison.worst:
        places.add_row(str(place.line), f"{place.error_mm:.4f}", place.axis, f"{place.force_n:.0f}")
    return places


def sampling_notes(comparison: PathComparison) -> list[str]:
    """How well the figures of a program are known, and what they leave out."""
    notes = [_describe_sampling(comparison)]
    if comparison.approaches:
        length = comparison.approach_length / MM
        notes.append(f"{comparison.approaches} lead-ins and lead-outs in air, {length:.1f} mm")
    if comparison.points_alone:
        notes.append(
            f"{comparison.points_alone} points of splines or drilled holes are compared alone, and no path between them"
        )
    if comparison.unknown_corners:
        notes.append(
            f"{comparison.unknown_corners} points have an unknown approximation distance; both programs are simulated"
            " through these points"
        )
    return notes


def _describe_sampling(comparison: PathComparison) -> str:
    if not comparison.converged:
        return "force and position do not converge everywhere in the compensated program: its errors are not known"
    if math.isnan(comparison.ends.max):
        return "no path between end points is sampled"
    if math.isnan(comparison.change):
        return "the samples are not doubled: there are too many"
    return (
        f"twice as many samples change the largest error by {comparison.change / MM * 1e3:.2f} um,"
        f" and the largest orientation error by {comparison.change_turn / DEG:.5f} deg"
    )
