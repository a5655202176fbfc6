"""Speeds of the spindle that a process file and the program state differently, and feeds per tooth that no cutter has:
feed, speed of the spindle or teeth have another unit than it seems."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.process.cut_checks import CheckedCut
from postproc.toolpath import Toolpath

LEAST_CHIP, LARGEST_CHIP = 0.0005 * MM, 0.1
"""[m] and of the diameter: feeds per tooth beyond have another unit than it seems."""
RUBS, RUBS_OF = 0.0025 * MM, 0.0004
"""[m] and of the diameter: a tool whose feed per tooth never exceeds the lesser cuts nothing, it rubs."""
DEEP, DEEP_CHIP, METAL = 0.15, 0.04, 300e6
"""Of the diameter, depth and feed per tooth that no cutter has in a metal, whose Ktc [Pa] is above."""
_SAME_SPEED = 0.001


def implausible_chips(cut: CheckedCut, toolpath: Toolpath, program: str, code: str) -> list[Finding]:
    """One finding where feeds per tooth of the cut are those of no cutter."""
    chip, speed, wide = cut.chips(toolpath), cut.turning(toolpath), cut.diameter
    large = chip > LARGEST_CHIP * wide
    wrong = large | (chip < LEAST_CHIP)
    if np.nan_to_num(chip).max(initial=0.0) < min(RUBS, RUBS_OF * wide):
        wrong |= np.isfinite(chip)
    if cut.material is not None and cut.material.coefficients.cutting[0] > METAL:
        deep = (chip > DEEP_CHIP * wide) & (cut.depth > DEEP * wide)
        large, wrong = large | deep, wrong | deep
    if not wrong.any():
        return []
    at = int(np.argmax(wrong))
    stated = "" if cut.speed is None else " as the process file states"
    feed = toolpath.feed[cut.rows[at]] / MM * 60
    message = (
        f"{cut.name} has a feed per tooth of {chip[at] / MM:.3g} mm here (spindle"
        f" {speed[at] * 30 / np.pi:.4g} 1/min{stated}, F {feed:.4g} mm/min, {cut.teeth} teeth), and in"
        f" {np.count_nonzero(wrong)} motions that cut an implausible one"
    )
    help = _advice(wide, chip, speed, large, wrong)
    return [Finding(code, message, program, int(toolpath.line[cut.rows[at]]), help=help)]


def _advice(wide: float, chip: Floats, speed: Floats, large: Bools, wrong: Bools) -> str:
    """Which speeds [1/min] belong to the feeds that cut, as the feed per tooth falls with the speed; masks (K,)."""
    turns = speed * 30 / np.pi
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


def stopped_spindle(cut: CheckedCut, toolpath: Toolpath, program: str, code: str) -> list[Finding]:
    """One finding where the program stops the spindle before a cut."""
    stopped = cut.rows[toolpath.spindle[cut.rows] == 0]
    if not len(stopped):
        return []
    message = f"{cut.name} cuts in {len(stopped)} motions after the program stops the spindle"
    return [Finding(code, message, program, int(toolpath.line[stopped[0]]))]


def differing_speed(cut: CheckedCut, toolpath: Toolpath, program: str, code: str) -> list[Finding]:
    """One finding where the program turns the spindle at another speed than the process file states."""
    if cut.speed is None:
        return []
    turns = np.abs(toolpath.spindle[cut.rows])
    other = np.isfinite(turns) & (turns > 0) & (np.abs(turns - cut.speed) > _SAME_SPEED * cut.speed)
    rows = cut.rows[other]
    if not len(rows):
        return []
    message = (
        f"{cut.name} cuts {len(rows)} motions at S {speed_words(turns[other])}; the process file states spindle"
        f" {cut.speed * 30 / np.pi:g} 1/min, which is used"
    )
    return [Finding(code, message, program, int(toolpath.line[rows[0]]))]


def speed_words(turns: Floats) -> str:
    """Speeds (K,) [rad/s] as a number or a range in 1/min, for messages."""
    speeds = np.unique(np.round(turns * 30 / np.pi, 3))
    return f"{speeds[0]:g}" if len(speeds) == 1 else f"{speeds[0]:g} to {speeds[-1]:g}"
