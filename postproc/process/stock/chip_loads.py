"""Feeds per tooth that no cutter has: feed, speed of the spindle or teeth have another unit than it seems."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.process.stock.cutters import Cutter
from postproc.process.stock.engagement import EngagedMotions, laws_of, speeds_of
from postproc.process.stock.motion_sweeps import MotionSweeps
from postproc.process.stock.stock_section import StockProcess
from postproc.toolpath import Toolpath

LEAST_CHIP, LARGEST_CHIP = 0.0005 * MM, 0.1
"""[m] and of the diameter: feeds per tooth beyond have another unit than it seems."""
RUBS, RUBS_OF = 0.0025 * MM, 0.0004
"""[m] and of the diameter: a tool whose feed per tooth never exceeds the lesser cuts nothing, it rubs."""
DEEP, DEEP_CHIP, METAL = 0.15, 0.04, 300e6
"""Of the diameter, depth and feed per tooth that no cutter has in a metal, whose Ktc [Pa] is above."""


def implausible_chips(
    sweeps: MotionSweeps, cut: EngagedMotions, process: StockProcess, toolpath: Toolpath, program: str
) -> list[Finding]:
    """STK024, one for each tool."""
    chip, speed = laws_of(sweeps, toolpath, process.edges)[:, 0], speeds_of(sweeps, toolpath, process.edges)
    findings = []
    for index, cutter in enumerate(sweeps.cutters):
        wide, material = 2 * cutter.radius, process.edges[cutter.number].material
        own = (sweeps.which == index) & cut.cuts[sweeps.motion]
        large = own & (chip > LARGEST_CHIP * wide)
        wrong = large | own & (chip < LEAST_CHIP)
        if np.nanmax(chip[own], initial=0.0) < min(RUBS, RUBS_OF * wide):
            wrong |= own & np.isfinite(chip)
        if material is not None and material.coefficients.cutting[0] > METAL:
            deep = own & (chip > DEEP_CHIP * wide) & (cut.depth[sweeps.motion] > DEEP * wide)
            large, wrong = large | deep, wrong | deep
        if not wrong.any():
            continue
        at = int(np.argmax(wrong))
        stated = "" if process.edges[cutter.number].speed is None else " as the process file states"
        feed = toolpath.feed[sweeps.motion[at]] / MM * 60
        message = (
            f"tool {cutter.number} has a feed per tooth of {chip[at] / MM:.3g} mm here (spindle"
            f" {abs(speed[at]) * 30 / np.pi:.4g} 1/min{stated}, F {feed:.4g} mm/min, {cutter.teeth} teeth), and in"
            f" {len(np.unique(sweeps.motion[wrong]))} motions that cut an implausible one"
        )
        help = _advice(cutter, chip, speed, large, wrong)
        findings.append(Finding("STK024", message, program, int(toolpath.line[sweeps.motion[at]]), help=help))
    return findings


def _advice(cutter: Cutter, chip: Floats, speed: Floats, large: Bools, wrong: Bools) -> str:
    """Which speeds [1/min] belong to the feeds that cut, as the feed per tooth falls with the speed; masks (M,)."""
    turns, wide = np.abs(speed) * 30 / np.pi, 2 * cutter.radius
    if large.any():
        least = np.max(turns[large] * chip[large]) / (LARGEST_CHIP * wide)
        return (
            f"a cutter of {wide / MM:.4g} mm needs at least {least:.4g} 1/min for this feed: compare the spindle"
            " (1/min), F and the teeth with the machine"
        )
    most = np.min(turns[wrong] * chip[wrong]) / LEAST_CHIP
    return (
        f"this feed needs at most {most:.4g} 1/min: compare F (its unit, G94, G95), the spindle (1/min) and the teeth"
        " with the machine"
    )
