"""What a program cuts, as a table, JSON and CSV; nothing is computed here but sums."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from postproc.base.arrays import Floats, Ints
from postproc.base.dataclass import dataclass
from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.report.result import Columns, Result
from postproc.report.result_keys import complete_result
from postproc.report.terminal import show_findings

STATES = ("air", "cut", "collision")
COLUMNS = (
    "line", "ap_mm", "ae_mm", "phi_entry_deg", "phi_exit_deg", "chip_mm", "removal_mm3", "mrr_mm3_s",
    "fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm", "force_max_n", "power_w", "state",
)  # fmt: skip
"""Columns of the CSV, one row a motion; what is not known is empty."""


@dataclass(frozen=True, eq=False, repr=False)
class Engaged(Result):
    """The result of ``compensate engage``: N motions.

    line (N,); state (N,): index into STATES; values (N, 15): the other columns of the CSV, in its units; mean (N,) and
    largest (N,) [N]: size of the force along each motion; weight (N,): length of the motions.  by_tool: number ->
    motions that cut, removed mm3, largest ap and ae mm, largest force N.
    """

    headline = ("program", "force.max_n", "removal_mm3", "exit")

    program: str
    dialect: str
    process: str
    blank: str
    line: Ints
    state: Ints
    values: Floats
    mean: Floats
    largest: Floats
    weight: Floats
    by_tool: dict[int, tuple[int, float, float, float, float]]
    ci95: float | None
    collisions: tuple[tuple[int, str], ...]
    findings: tuple[Finding, ...] = ()
    outputs: tuple[str, ...] = ()
    exit: int = 0

    @property
    def max_force(self) -> float | None:
        """[N] the largest mean force over a turn; None where the force of a cut is not known."""
        cut = self.state > 0
        return None if np.isnan(self.largest[cut]).any() else float(self.largest.max(initial=0.0))

    @property
    def mean_force(self) -> float | None:
        """[N] the mean over the path of all motions that cut; None where the force of a cut is not known."""
        cut = np.asarray(self.state > 0) & (self.weight > 0)
        if np.isnan(self.mean[cut]).any():
            return None
        return float(np.average(self.mean[cut], weights=self.weight[cut])) if cut.any() else 0.0

    @property
    def removal(self) -> float:
        """[mm3]"""
        return float(self.values[:, COLUMNS.index("removal_mm3") - 1].sum())

    def table(self) -> Columns:
        """One row a motion, the columns of ``--csv``; NaN where a figure is not known."""
        columns = dict(zip(COLUMNS[1:-1], self.values.T, strict=True))
        return {"line": self.line, **columns, "state": np.array(STATES)[self.state]}

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        states = np.bincount(self.state, minlength=len(STATES)).tolist()
        result = {
            "program": self.program,
            "dialect": self.dialect,
            "process": self.process,
            "stock": self.blank,
            "motions": len(self.line),
            "states": dict(zip(STATES, states, strict=True)),
            "force": {
                "max_n": _rounded(self.max_force, 6),
                "mean_n": _rounded(self.mean_force, 6),
                "ci95": self.ci95,
            },
            "removal_mm3": round(self.removal, 6),
            "tools": {
                str(number): {
                    "motions": motions,
                    "removal_mm3": round(volume, 6),
                    "ap_max_mm": round(depth, 6),
                    "ae_max_mm": round(width, 6),
                    "force_max_n": _rounded(force, 6),
                }
                for number, (motions, volume, depth, width, force) in self.by_tool.items()
            },
            "collisions": [{"line": line, "part": part} for line, part in self.collisions],
            "findings": [finding.as_json() for finding in self.findings],
            "outputs": list(self.outputs),
            "exit": self.exit,
        }
        return complete_result("engage", result)


def engaged_csv(engaged: Engaged) -> bytes:
    """One row a motion, in the units that its heads say."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for line, values, state in zip(
        engaged.line.tolist(), engaged.values.tolist(), engaged.state.tolist(), strict=True
    ):
        writer.writerow([line, *(_text(value) for value in values), STATES[state]])
    return stream.getvalue().encode()


def show_engaged(console: Console, engaged: Engaged, verbose: bool = False) -> None:
    """What was cut, with which force, tool by tool."""
    head = Table(box=None, show_header=False, pad_edge=False)
    head.add_column(style="bold")
    head.add_column()
    for key, value in _rows(engaged):
        head.add_row(key, Text(value))
    console.print(head)
    table = Table(box=None, pad_edge=False)
    for name in ("tool", "motions", "removal mm3", "ap up to mm", "ae up to mm", "force up to N"):
        table.add_column(name, justify="right")
    for number, (motions, volume, depth, width, force) in engaged.by_tool.items():
        shown = "not known" if np.isnan(force) else f"{force:.0f}"
        table.add_row(str(number), str(motions), f"{volume:.0f}", f"{depth:.3f}", f"{width:.3f}", shown)
    console.print(table)
    show_findings(console, engaged.findings, verbose)
    for path in engaged.outputs:
        console.print(Text(f"wrote {path}"), soft_wrap=True)


def _rows(engaged: Engaged) -> Iterator[tuple[str, str]]:
    air, cut, collision = np.bincount(engaged.state, minlength=3).tolist()
    yield "program", f"{engaged.program} ({engaged.dialect}), {len(engaged.line)} motions"
    yield "stock", f"{engaged.blank}, tools of {engaged.process}"
    yield "motions", f"{cut} cut, {air} in air, {collision} collide"
    yield "removed", f"{engaged.removal:.0f} mm3"
    if engaged.max_force is None or engaged.mean_force is None:
        yield "force", "not known"
    else:
        interval = "" if engaged.ci95 is None else f", +- {100 * engaged.ci95:.0f} % (95 %)"
        interval = interval or ", interval not stated"
        yield "force", f"max {engaged.max_force:.0f} N, mean {engaged.mean_force:.0f} N over a turn{interval}"


def engaged_table(
    volume: Floats, time: Floats, mean: Floats, largest: Floats, geometry: Floats, power: Floats
) -> Floats:
    """(N, 15) the columns of the CSV between line and state.  volume (N,) [m3], time (N,) [s], mean (N, 6) [N, N m],
    largest (N,) [N], geometry (N, 5): depth, width [m], entry, exit [rad], chip [m]; power (N,) [W]."""
    scaled = geometry / np.array([MM, MM, DEG, DEG, MM])
    rate = np.where(time > 0, volume / MM**3 / np.where(time > 0, time, 1.0), np.nan)
    rate = np.where(volume > 0, rate, 0.0)
    return np.column_stack([scaled, volume / MM**3, rate, mean, largest, power])


def _text(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.6f}".rstrip("0").rstrip(".") if value else "0"


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None or np.isnan(value) else round(value, digits)
