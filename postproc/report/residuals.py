"""Residuals of fits: lengths, their sizes, parts of the readings that are alike, one CSV for all.

All residuals are measured minus expected, in axes of the robot base.  The size of one is its length in space; where
fewer than three coordinates were measured, the length that three like them would have.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.tables import as_cell
from postproc.base.units import DEG, MM
from postproc.identification.campaign import Campaign
from postproc.identification.noise import Noise
from postproc.measurements import Readings
from postproc.report.mapped import fixed_decimals

PARTS, EACH = 8, 10
"""Into how many parts of about as many readings the range of a joint or load is cut at most, each of ``EACH`` or more.
"""


class Sizes(NamedTuple):
    """Root mean square, mean and maximum [m] of the lengths of residuals, and of how many."""

    rms: float
    mean: float
    max: float
    readings: int

    @classmethod
    def of(cls, lengths: Floats) -> Sizes | None:
        """Of ``lengths`` (R,) [m]; None where there is none; NaN are omitted."""
        seen = lengths[np.isfinite(lengths)]
        if not len(seen):
            return None
        return cls(float(np.sqrt(np.mean(seen**2))), float(seen.mean()), float(seen.max()), len(seen))


@dataclass(frozen=True)
class ResidualVariable:
    """A quantity of each reading, ``values`` (R,) in ``unit``, that residuals are looked at by."""

    name: str
    unit: str
    values: Floats

    def parts(self) -> list[Ints]:
        """The rows (K,) of readings that are alike: of each value where there are few, or of ranges."""
        distinct, of = np.unique(np.round(self.values, 6), return_inverse=True)
        if len(distinct) > PARTS:
            count = int(np.clip(len(self.values) // EACH, 2, PARTS))
            edges = np.quantile(self.values, np.arange(1, count) / count)
            of = np.searchsorted(edges, self.values, side="right")
        return [np.flatnonzero(of == k) for k in np.unique(of)]


def joint_variables(readings: Readings) -> tuple[ResidualVariable, ...]:
    """The position of each joint."""
    return tuple(
        ResidualVariable(name, "mm" if slides else "deg", column / (MM if slides else DEG))
        for (name, slides), column in zip(readings.joints, readings.q.T, strict=True)
    )


def lengths_of(residual: Floats, measured: Bools) -> Floats:
    """(R,) [m] of residuals (R, 3) of which the coordinates ``measured`` (R, 3) count; NaN where none does."""
    on = np.isfinite(residual)
    count = np.minimum(on.sum(axis=1), measured.sum(axis=1))
    square = np.where(on, residual, 0.0) ** 2
    size = np.sqrt(3.0 * square.sum(axis=1) / np.maximum(count, 1))
    return np.asarray(np.where(count > 0, size, np.nan))


def gap_of(lengths: Mapping[str, Floats], noise: Noise) -> dict[str, float]:
    """Root mean squares [mm] of ``lengths`` (R,) [m], and the scatter of the readings; what is unknown is omitted."""
    sizes = {name: Sizes.of(values) for name, values in lengths.items()}
    known = {f"{name}_rms_mm": size.rms / MM for name, size in sizes.items() if size}
    if noise.known:
        known["noise_mm"] = noise.rms / MM
    return {key: round(value, 7) for key, value in known.items()}


def poses_in_order(pose: Ints) -> Ints:
    """(R,) the number of the ``pose`` (R,) of each reading, from 1 in the order in which they were first measured."""
    _, first, of = np.unique(pose, return_index=True, return_inverse=True)
    number = np.empty(len(first), np.int64)
    number[np.argsort(first)] = np.arange(1, len(first) + 1)
    return np.asarray(number[of.reshape(-1)])


def residuals_csv(
    campaign: Campaign, residuals: Mapping[str, Floats | None], more: Mapping[str, Sequence[str]]
) -> bytes:
    """One row a reading: where it is, its axes, ``residuals`` (R, 3) [m] as coordinates and length under their
    names (empty where they are None), and ``more`` columns."""
    readings = campaign.readings
    places = [readings.where(row) for row in range(len(readings))]
    columns: dict[str, Sequence[str]] = {
        "file": [as_cell(file) for file, _ in places],
        "line": [str(line) for _, line in places],
        "pose": [str(number) for number in poses_in_order(campaign.pose)],
        "target": [as_cell(campaign.targets[k]) for k in readings.target],
        "session": [as_cell(readings.sessions[k]) for k in readings.session],
    }
    for joint in joint_variables(readings):
        columns[f"{joint.name}_{joint.unit}"] = fixed_decimals(joint.values, 6)
    measured = np.isfinite(readings.value)
    nothing = np.full((len(readings), 3), np.nan)
    for name, values in residuals.items():
        residual = nothing if values is None else values
        for axis, column in zip("xyz", residual.T, strict=True):
            columns[f"{name}_d{axis}_mm"] = fixed_decimals(column / MM, 6)
        columns[f"{name}_mm"] = fixed_decimals(lengths_of(residual, measured) / MM, 6)
    columns |= more
    for name, texts in readings.extras.items():
        columns[name if name not in columns else f"{name} (as measured)"] = [as_cell(text) for text in texts]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return stream.getvalue().encode()


def mm(length: float) -> float:
    """[mm] without rounding errors of the conversion."""
    return round(float(length) / MM, 7) + 0.0
