"""A blank that is stated beside the place for which the program is made.

A program that is made for its blank leaves it by about as much on every side, and its first level is no deeper than the
next ones.  Where it does not, no single motion is wrong: every force follows from a blank that is not there.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.process.stock.blank import corners_of
from postproc.process.stock.cutters import Cutter
from postproc.process.stock.distance import AXIS, CUTTER, REMOVES, STEP, TIP_POINT
from postproc.process.stock.engagement import EngagedMotions
from postproc.process.stock.motion_sweeps import MotionSweeps
from postproc.process.stock.stock_section import FOOT, StockProcess
from postproc.toolpath import Toolpath

FAR_BEYOND = 2.0
"""Diameters, from the touch of the tool on: no approach and no overrun at a feed is longer."""
FEWEST_PASSES, FEWEST_LEVELS = 3, 4
DEEPER = 1.25
"""How many times as deep as the steps between levels of one height the first of them is at most."""
_PARALLEL, _ACROSS = 0.999, 0.1  # cosines
_SHORT, _LEVEL = 1e-6, 1e-5  # m
_ALIKE = 0.02  # of a step
_DEEPER_BY = 0.3 * MM


class _Passes(NamedTuple):
    """K parts of the path of one tool that go on in one direction across the spindle: ends (K, 2, 3) [m], their rows
    (K,), axes (K, 3), and how deep they cut (K,) [m]; those that cut nothing are omitted."""

    ends: Floats
    row: Ints
    axis: Floats
    depth: Floats


def misplaced_blank(
    process: StockProcess, sweeps: MotionSweeps, cut: EngagedMotions, toolpath: Toolpath
) -> list[Finding]:
    """STK032 and STK033, at the blank of the process file."""
    low, high = corners_of(cut.stock.blank)
    foot = f"; {FOOT}" if process.blank == "cylinder" else ""
    findings = []
    for index, cutter in enumerate(sweeps.cutters):
        passes = _passes(index, sweeps, cut)
        for code, found in (
            ("STK032", _one_sided(cutter, passes, low, high, toolpath)),
            ("STK033", _first_level(cutter, passes, toolpath)),
        ):
            findings += [
                Finding(code, message, str(process.path), process.line, help=help + foot)
                for message, help in found
            ]
    return findings


def _passes(index: int, sweeps: MotionSweeps, cut: EngagedMotions) -> _Passes:
    """Those of a cutter."""
    own = np.flatnonzero((sweeps.which == index) & (sweeps.rows[:, REMOVES] > 0))
    step, axis = sweeps.rows[own, STEP : STEP + 3], sweeps.rows[own, AXIS : AXIS + 3]
    rise = np.einsum("mi,mi->m", step, axis)
    flat = step - rise[:, None] * axis
    size = np.linalg.norm(flat, axis=1)
    moves = size > _SHORT
    own, axis, rise, flat, size = own[moves], axis[moves], rise[moves], flat[moves], size[moves]
    rows = sweeps.rows[own]
    tip, end = (
        rows[:, TIP_POINT : TIP_POINT + 3],
        rows[:, TIP_POINT : TIP_POINT + 3] + rows[:, STEP : STEP + 3],
    )
    way, level = flat / size[:, None], np.abs(rise) < size
    goes_on = np.zeros(len(own), bool)
    goes_on[1:] = (
        (np.linalg.norm(tip[1:] - end[:-1], axis=1) < _SHORT)
        & (rows[1:, CUTTER] == rows[:-1, CUTTER])
        & (np.einsum("mi,mi->m", way[1:], way[:-1]) > _PARALLEL)
        & (level[1:] & level[:-1])
    )
    first = np.flatnonzero(~goes_on)
    if not len(first):
        return _Passes(np.zeros((0, 2, 3)), first, np.zeros((0, 3)), np.zeros(0))
    last = np.append(first[1:], len(own)) - 1
    motion = sweeps.motion[own]
    depth = np.maximum.reduceat(np.where(cut.cuts[motion], cut.depth[motion], 0.0), first)
    some = (depth > 0) & level[first]
    ends = np.stack([tip[first], end[last]], axis=1)
    return _Passes(ends[some], motion[first][some], axis[first][some], depth[some])


def _one_sided(
    cutter: Cutter, passes: _Passes, low: Floats, high: Floats, toolpath: Toolpath
) -> Iterator[tuple[str, str]]:
    """Passes far beyond one side of the box around the blank that all end inside of it at the other."""
    step = passes.ends[:, 1] - passes.ends[:, 0]
    length = np.linalg.norm(step, axis=1)
    for k, name in enumerate("XYZ"):
        along = np.abs(step[:, k]) > _PARALLEL * length
        along &= np.abs(passes.axis[:, k]) < _ACROSS
        at = np.sort(passes.ends[along][:, :, k], axis=1)
        if len(at) < FEWEST_PASSES:
            continue
        # how far each end is outside of the blank, below zero inside
        below, above = low[k] - at[:, 0], at[:, 1] - high[k]
        for here, there, side in ((below, above, "low"), (above, below, "high")):
            far = here - cutter.radius > FAR_BEYOND * 2 * cutter.radius
            inside = there < -cutter.radius
            leaves = (here > 0) | (there > 0)
            if far.sum() < FEWEST_PASSES or not (far & inside)[leaves].all():
                continue
            line = toolpath.line[passes.row[np.flatnonzero(along)[far]]]
            message = (
                f"{far.sum()} passes of tool {cutter.number} (lines {line.min()} to {line.max()}) reach up to"
                f" {here[far].max() / MM:.4g} mm beyond the {side} side of the blank in {name}, and all end inside of"
                f" it at the other side, at least {-there[far].max() / MM:.4g} mm before it"
            )
            yield message, f"compare the corners of the blank in {name} with the zero point of the program"


def _first_level(cutter: Cutter, passes: _Passes, toolpath: Toolpath) -> Iterator[tuple[str, str]]:
    """A first level that is deeper than the equal steps to the next ones."""
    if len(passes.row) < FEWEST_LEVELS or np.any(passes.axis @ passes.axis[0] < 1 - 1e-9):
        return
    height = passes.ends @ passes.axis[0]
    flat = np.abs(height[:, 1] - height[:, 0]) < _LEVEL
    row, depth, height = passes.row[flat], passes.depth[flat], height[flat, 0]
    levels: list[float] = []
    for value in height.tolist():
        if not levels or value < levels[-1] - _LEVEL:
            levels.append(value)
    if len(levels) < FEWEST_LEVELS:
        return
    steps = -np.diff(levels)
    if steps.max() - steps[0] > _ALIKE * steps[0] or (steps[:-1] < (1 - _ALIKE) * steps[0]).any():
        return  # the last may be what remains
    first = np.flatnonzero(np.abs(height - levels[0]) < _LEVEL)
    at = int(first[np.argmax(depth[first])])
    if depth[at] > max(DEEPER * steps[0], steps[0] + _DEEPER_BY):
        message = (
            f"tool {cutter.number} cuts {depth[at] / MM:.3g} mm deep in its first level (line"
            f" {toolpath.line[row[at]]}), and goes {steps[0] / MM:.4g} mm deeper in each of the next ones"
        )
        yield message, "compare the top of the blank with the zero point of the program"
