"""Pages of a program that was read, of two that were simulated, and of a plan of measurements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from rich.table import Table

from postproc.base.findings import CODES
from postproc.base.units import DEG, MM
from postproc.report import planned as planned_report
from postproc.report.checked import Checked
from postproc.report.formatting import count
from postproc.report.planned import Planned
from postproc.report.result_page import ResultPage
from postproc.report.verified import (
    PathComparison,
    Verified,
    distance_table,
    sampling_notes,
    verdict_sentence,
    worst_table,
)


def checked_page(checked: Checked, links: Mapping[str, str]) -> bytes:
    """The page of a program that was read."""
    total, refused = len(checked.toolpath), sum(checked.refused.values())
    kinds, reasons = Table(), Table()
    for head in ("kind of motion", "motions"):
        kinds.add_column(head, justify="right" if head == "motions" else "left")
    for kind, number in checked.kinds.items():
        kinds.add_row(kind, str(number))
    for head in ("not corrected because", "code", "motions"):
        reasons.add_column(head, justify="right" if head == "motions" else "left")
    for code, number in checked.refused.items():
        reasons.add_row(CODES[code].title, code, str(number))
    verdict = f"{count(total, 'motion')}: {total - refused} can be corrected, {refused} not."
    files = ", ".join(str(document.path) for document in checked.program.documents)
    return ResultPage(
        what="check",
        title=checked.program.documents[0].path.name,
        verdict=verdict if total else "The program has no motion.",
        exit=checked.exit,
        facts=[("language", checked.program.dialect), ("files", files)],
        tables=[kinds, reasons],
        findings=checked.findings,
    ).html(links)


def verified_page(done: Verified, links: Mapping[str, str]) -> bytes:
    """The page of two programs that were simulated."""
    worst = [
        _worst(one, name) for name, one in (("compensated", done.compensated), ("original", done.original))
    ]
    words = verdict_sentence(done)
    return ResultPage(
        what="verification",
        title=Path(done.compensated_file).name,
        verdict=f"{words[0].upper()}{words[1:]}.",
        exit=done.exit,
        facts=[
            ("original", f"{done.original_file}, {count(done.motions, 'motion')}"),
            ("compensated", f"{done.compensated_file}, {count(done.compensated_motions, 'motion')}"),
            ("robot", done.robot),
            ("force", done.force_source),
            ("tolerance", f"{done.tolerance / MM:g} mm, {done.tolerance_angle / DEG:g} deg"),
            ("first samples", f"{done.step / MM:g} mm apart"),
        ],
        tables=[distance_table(done), *worst],
        notes=sampling_notes(done.compensated),
        findings=done.findings,
    ).html(links)


def planned_page(planned: Planned, links: Mapping[str, str]) -> bytes:
    """The page of a plan: the intervals that it promises, and the poses in their order."""
    poses = Table()
    columns = planned.table()
    poses.add_column("pose", justify="right")
    for name in columns:
        poses.add_column(name.replace("_", " "), justify="right")
    for number, row in enumerate(zip(*columns.values(), strict=True), start=1):
        poses.add_row(str(number), *("" if math.isnan(value) else f"{value:.2f}" for value in row))
    tables = [planned_report.interval_table(planned)]
    tables += [] if planned.rivals is None else [planned_report.separation_table(planned)]
    return ResultPage(
        what="plan",
        title=planned.robot,
        verdict=f"{count(planned.poses, 'pose')}, {planned.loads_in_words}:"
        f" {planned.readings} readings {planned.goal}.",
        exit=planned.exit,
        facts=planned_report.plan_facts(planned),
        tables=[*tables, poses],
        notes=["Collisions are not checked."],
        findings=planned.findings,
        digests={planned.robot: planned.digest},
    ).html(links)


def _worst(comparison: PathComparison, name: str) -> Table:
    table = worst_table(comparison)
    table.columns[0].header = f"line of the {name} program"
    return table
