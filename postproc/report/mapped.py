"""A surveyed workspace as a table, JSON and CSV; nothing is computed here but extremes."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from postproc.base.arrays import Floats, Ints
from postproc.base.dataclass import dataclass
from postproc.base.findings import Finding
from postproc.base.geometry import abc_from_rotation
from postproc.base.units import DEG, MM
from postproc.placement.workspace_map import MapLoad, WorkspaceMap
from postproc.report.result import Columns, Result
from postproc.report.result_keys import complete_result
from postproc.report.terminal import show_findings

_ALIKE = 1e-12
"""Deflections [m] that differ by less are the same: of two cells that mirror each other the first is named."""

MAX_SLICES = 9
"""Slices of a box that a picture shows."""


class Extreme(NamedTuple):
    """The smallest or largest value [m] of a quantity, and its row."""

    value: float
    row: int


@dataclass(frozen=True)
class MappedQuantity:
    """A length at every cell, ``values`` (N,) [m], under the names that scripts and people know it by; ``values`` None:
    there is none."""

    key: str
    title: str
    values: Floats | None

    @property
    def extremes(self) -> tuple[Extreme, Extreme] | None:
        """Least and greatest, over the cells that have a value."""
        if self.values is None or not np.isfinite(self.values).any():
            return None
        ends = float(np.nanmin(self.values)), float(np.nanmax(self.values))
        least, greatest = (
            Extreme(end, int(np.flatnonzero(np.abs(self.values - end) <= _ALIKE)[0])) for end in ends
        )
        return least, greatest

    def as_json(self) -> dict[str, float] | None:
        if self.extremes is None:
            return None
        least, greatest = self.extremes
        return {"min": round(least.value / MM, 7), "max": round(greatest.value / MM, 7)}


@dataclass(frozen=True, repr=False)
class Mapped(Result):
    """The result of ``compensate map``.

    ``axes``: names and units (deg, mm) of the robot's axes; ``frame``: that of the stated force ``stated`` (6,)
    [N, N m]; ``sign``: of the compensator's eq. (3), None without compensator; ``status``: None for an arm that has
    none.
    """

    headline = ("robot", "cells", "unreachable", "deflection_mm.min", "deflection_mm.max", "exit")

    survey: WorkspaceMap
    load: MapLoad
    robot: str
    digest: str
    axes: tuple[tuple[str, str], ...]
    effects: tuple[str, ...]
    stated: tuple[float, ...]
    frame: str
    sign: str | None
    status: int | None
    findings: tuple[Finding, ...] = ()
    outputs: tuple[str, ...] = ()
    exit: int = 0

    @property
    def quantities(self) -> tuple[MappedQuantity, MappedQuantity, MappedQuantity]:
        """As the model is, without compensator, and their difference."""
        survey = self.survey
        return (
            MappedQuantity("deflection_mm", "deflection", survey.size),
            MappedQuantity(
                "deflection_without_compensator_mm", "without gravity compensator", survey.size_without
            ),
            MappedQuantity("compensator_difference_mm", "difference of the two", survey.difference),
        )

    @property
    def cells(self) -> int:
        return len(self.survey.q)

    @property
    def unreachable(self) -> int:
        return int((~self.survey.mapped).sum())

    @property
    def force(self) -> str:
        """``(-360, 0, 560) N, (0, 0, 20) N m @world``; moments only where there are any."""
        parts = [(self.stated[:3], "N"), (self.stated[3:], "N m")]
        shown = [f"({number_list(v)}) {unit}" for v, unit in parts if any(v) or unit == "N"]
        return f"{', '.join(shown)} @{self.frame}"

    @property
    def method(self) -> str:
        return "linear" if self.load.linear else "equilibrium"

    @property
    def axis_values(self) -> Floats:
        """(N, n) in the units of ``axes``."""
        return np.asarray(self.survey.q / [DEG if unit == "deg" else MM for _, unit in self.axes])

    def place(self, row: int) -> dict[str, float]:
        """Coordinates [mm] of a cell."""
        return dict(zip(("x_mm", "y_mm", "z_mm"), _mm(self.survey.grid.positions[row]), strict=True))

    def table(self) -> Columns:
        """One row a cell, the columns of ``--csv``: place, deflection, difference, axes; NaN where there is none."""
        return {
            name: column
            for names, values, _ in _blocks(self)
            for name, column in zip(names.split(" "), values.T, strict=True)
        }

    def as_json(self) -> dict[str, object]:
        """The machine-readable result; the keys are public."""
        survey, load = self.survey, self.load
        grid, abc = survey.grid, abc_from_rotation(np.stack([load.orientation, load.tool.rotation])) / DEG
        reached = self.unreachable < self.cells
        result = {
            "robot": self.robot,
            "robot_digest": self.digest,
            "force": {"values": list(self.stated), "frame": self.frame},
            "grid": {
                "x_mm": _mm(grid.x[[0, -1]]),
                "y_mm": _mm(grid.y[[0, -1]]),
                "z_mm": _mm(grid.z[[0, -1]]),
                "points": list(grid.shape),
                "orientation_deg": np.round(abc[0], 9).tolist(),
                "tool": [*_mm(load.tool.position), *np.round(abc[1], 9).tolist()],
                "status": self.status,
            },
            "method": self.method,
            "sign": self.sign,
            "ignore_limits": load.ignore_limits,
            "cells": self.cells,
            "unreachable": self.unreachable,
            "out_of_reach": int((~survey.in_reach).sum()),
            "beyond_limits": int((survey.in_reach & ~survey.within).sum()),
            **{quantity.key: quantity.as_json() for quantity in self.quantities},
            "extremes_at": {
                quantity.key: {
                    name: self.place(extreme.row)
                    for name, extreme in zip(("min", "max"), quantity.extremes, strict=True)
                }
                for quantity in self.quantities
                if reached and quantity.extremes
            },
            "findings": [finding.as_json() for finding in self.findings],
            "outputs": list(self.outputs),
            "exit": self.exit,
        }
        return complete_result("map", result)


def show_map(console: Console, mapped: Mapped, verbose: bool = False) -> None:
    """What was asked, the extremes and where they lie."""
    head = Table(box=None, show_header=False, pad_edge=False)
    head.add_column(style="bold")
    head.add_column()
    for key, value in map_rows(mapped):
        head.add_row(key, Text(value))
    console.print(head)
    if any(quantity.extremes for quantity in mapped.quantities):
        table = Table(box=None, pad_edge=False)
        table.add_column("")
        for name in ("min mm", "at x, y, z mm", "max mm", "at x, y, z mm"):
            table.add_column(name, justify="right")
        for quantity in mapped.quantities:
            if quantity.extremes:
                cells = [
                    text
                    for extreme in quantity.extremes
                    for text in (f"{extreme.value / MM:.4f}", number_list(mapped.place(extreme.row).values()))
                ]
                table.add_row(quantity.title, *cells)
        console.print(table)
    extremes = mapped.quantities[0].extremes
    if extremes and extremes[1].value > 0:
        for name, extreme in zip(("stiffest", "softest"), extremes, strict=True):
            axes = ", ".join(
                f"{axis} {round(value, 1) + 0.0:.1f}" + (" mm" if unit == "mm" else "")
                for (axis, unit), value in zip(mapped.axes, mapped.axis_values[extreme.row], strict=True)
            )
            place = number_list(mapped.place(extreme.row).values())
            console.print(
                Text(f"{name:8} at {place} mm: {extreme.value / MM:.3f} mm, axes {axes} deg"), soft_wrap=True
            )
    show_findings(console, mapped.findings, verbose)
    for path in mapped.outputs:
        console.print(Text(f"wrote {path}"), soft_wrap=True)


def map_rows(mapped: Mapped) -> Iterator[tuple[str, str]]:
    survey, load = mapped.survey, mapped.load
    yield "robot", f"{mapped.robot}, effects: {', '.join(mapped.effects) or 'none'}"
    yield "cells", f"{region(mapped)} in the robot base: {mapped.cells} cells"
    pose = abc_from_rotation(np.stack([load.orientation, load.tool.rotation])) / DEG
    turned = f", rotated {number_list(pose[1])} deg," if np.abs(pose[1]).max() > 1e-9 else ""
    branch = "" if mapped.status is None else f", S {mapped.status}"
    yield (
        "tool",
        f"TCP {number_list(_mm(load.tool.position))} mm{turned} on the flange,"
        f" A B C {number_list(pose[0])} deg{branch}",
    )
    yield "force", mapped.force
    sign = f"; compensator: sign {mapped.sign}" if mapped.sign else "; no gravity compensator"
    method = "linear, eq. (5)" if load.linear else "balance on the deflected pose, loaded minus unloaded"
    yield "computed", method + sign
    beyond = int((survey.in_reach & ~survey.within).sum())
    limits = f"{beyond} beyond the axis limits{' (counted as reached)' if load.ignore_limits else ''}"
    yield "unreachable", f"{mapped.unreachable} cells: {int((~survey.in_reach).sum())} out of reach, {limits}"


def region(mapped: Mapped) -> str:
    """``x 200 .. 2200 (41), y 0, z 500 mm``: ranges with their number of points."""
    parts = []
    for name in "xyz":
        values = getattr(mapped.survey.grid, name) / MM
        ends = f"{values[0]:g} .. {values[-1]:g} ({len(values)})" if len(values) > 1 else f"{values[0]:g}"
        parts.append(f"{name} {ends}")
    return ", ".join(parts) + " mm"


def slices_shown(count: int) -> Ints:
    """Which (K,) of ``count`` slices a picture shows: all, or ``MAX_SLICES`` from first to last."""
    return np.unique(np.linspace(0, count - 1, min(count, MAX_SLICES)).round().astype(np.int64))


def map_csv(mapped: Mapped) -> bytes:
    """One row a cell: place, reachable 0/1, deflection with and without compensator, difference, axes.

    Empty where there is no value; the axes have values wherever the arm reaches, within its limits or not.
    """
    heads, columns = [], []
    for names, values, decimals in _blocks(mapped):
        heads += names.split(" ")
        columns += [fixed_decimals(column, decimals) for column in values.T]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(zip(*columns, strict=True))
    return stream.getvalue().encode()


def _blocks(mapped: Mapped) -> list[tuple[str, Floats, int]]:
    """Names, values (N, k) and decimals of the columns of a map."""
    survey = mapped.survey
    nothing = np.full(mapped.cells, np.nan)
    without = np.full((mapped.cells, 3), np.nan) if survey.without is None else survey.without
    as_is, bare, difference = (
        nothing if quantity.values is None else quantity.values for quantity in mapped.quantities
    )
    return [
        ("x_mm y_mm z_mm", survey.grid.positions / MM, 6),
        ("reachable", survey.mapped[:, None].astype(float), 0),
        ("dx_mm dy_mm dz_mm", survey.deflection / MM, 6),
        ("deflection_mm", as_is[:, None] / MM, 6),
        ("without_dx_mm without_dy_mm without_dz_mm", without / MM, 6),
        ("without_mm", bare[:, None] / MM, 6),
        ("difference_mm", difference[:, None] / MM, 6),
        (" ".join(f"{axis}_{unit}" for axis, unit in mapped.axes), mapped.axis_values, 6),
    ]


def fixed_decimals(values: Floats, decimals: int) -> list[str]:
    """(N,) ``values`` in fixed decimals, empty for what is not known, no minus zero."""
    rounded = np.round(values, decimals) + 0.0
    return ["" if value != value else f"{value:.{decimals}f}" for value in rounded.tolist()]


def _mm(lengths: Floats) -> list[float]:
    """[mm] without rounding errors of the conversion."""
    return [float(value) for value in np.round(lengths / MM, 9) + 0.0]


def number_list(values: object) -> str:
    return ", ".join(f"{round(float(value), 6) + 0.0:g}" for value in values)  # type: ignore[attr-defined]
