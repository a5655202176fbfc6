"""What a process file states of tools and blank that the cut, the path in the blank, or the cell contradicts.

What needs no blank is checked as it is without one: see ``cut_checks``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.cell import MotionFrames
from postproc.process.cut_checks import CheckCodes, CheckedCut, wrong_forces, wrong_sizes
from postproc.process.stock.blank import corners_of
from postproc.process.stock.cutters import Cutter
from postproc.process.stock.distance import AXIS, CUTTER, REMOVES, STEP, TIP_POINT, TURN
from postproc.process.stock.engagement import EngagedMotions
from postproc.process.stock.motion_sweeps import MotionSweeps
from postproc.process.stock.stock_section import StockProcess
from postproc.toolpath import Toolpath

_TIMES_THE_BLANK, _LONG_BLANK, _SMALL_PROGRAM = 4.0, 2.0, 0.1
_PARALLEL, _SQUARE, _ALONG = 0.999, 0.05, 0.996  # cosines
_SHORT = 1e-6  # m
_UPRIGHT, _THROUGH = 0.9, 1e-6  # cosine, m

OF_STOCK = CheckCodes(
    comment="STK019", speed="STK021", stopped="STK023", chip="STK024", size="STK025", force="STK028"
)


def checked_cuts(process: StockProcess, sweeps: MotionSweeps, cut: EngagedMotions) -> dict[int, CheckedCut]:
    """What each tool that cuts is stated to be, and what it cuts, by its index in ``sweeps``."""
    cuts = {}
    for index, cutter in enumerate(sweeps.cutters):
        rows = np.unique(sweeps.motion[(sweeps.which == index) & (sweeps.rows[:, REMOVES] > 0)])
        rows = rows[cut.cuts[rows]]
        if not len(rows):
            continue
        size = np.linalg.norm(cut.largest[rows, :3], axis=1)
        own = process.edges[cutter.number]
        cuts[index] = CheckedCut(
            name=f"tool {cutter.number}",
            numbers=(cutter.number,),
            diameter=2 * cutter.radius,
            teeth=cutter.teeth,
            helix=cutter.helix,
            speed=own.speed,
            material=own.material,
            file=str(process.path),
            line=cutter.line,
            rows=rows,
            depth=cut.depth[rows],
            width=cut.width[rows],
            force=float(np.nan_to_num(size).max(initial=0.0)),
            power=float(np.abs(np.nan_to_num(cut.power[rows])).max(initial=0.0)),
            drills=cutter.shape == "drill",
        )
    return cuts


def contradictions(
    process: StockProcess,
    sweeps: MotionSweeps,
    cut: EngagedMotions,
    checked: Mapping[int, CheckedCut],
    toolpath: Toolpath,
    frames: MotionFrames,
    program: str,
) -> list[Finding]:
    """STK025 to STK028, STK030.  checked: as of ``checked_cuts``."""
    findings = []
    path, tip = str(process.path), _tips(toolpath, frames)
    for index, cutter in enumerate(sweeps.cutters):
        own = np.unique(sweeps.motion[(sweeps.which == index) & (sweeps.rows[:, REMOVES] > 0)])
        if not len(own):
            continue
        if index not in checked:
            message = (
                f"tool {cutter.number} moves at a feed in {len(own)} motions in lines {toolpath.line[own[0]]} to"
                f" {toolpath.line[own[-1]]}, and cuts nothing"
            )
            findings.append(Finding("STK027", message, program, int(toolpath.line[own[0]])))
            continue
        findings += wrong_sizes(checked[index], frames.diameters, toolpath, OF_STOCK.size)
        for message, help in (
            *_lengths(cutter, tip.get(cutter.number)),
            *_sideways(cutter, index, sweeps, cut.cuts, toolpath),
            *_ridges(cutter, index, sweeps, cut.cuts, toolpath),
        ):
            findings.append(Finding(OF_STOCK.size, message, path, cutter.line, help=help))
        findings += wrong_forces(checked[index], OF_STOCK.force)
    findings += _through(sweeps, cut, toolpath, program)
    findings += [
        Finding("STK026", message, path, process.line, help=help) for message, help in _blank(sweeps, cut)
    ]
    return findings


def _tips(toolpath: Toolpath, frames: MotionFrames) -> dict[int, float]:
    """Number of a tool -> how far its tip is from the flange [m]."""
    tools, first = np.unique(toolpath.tool, return_index=True)
    away = np.linalg.norm(frames.tool_in_flange.position[first], axis=1)
    numbers = [toolpath.frames[index].number if index >= 0 else None for index in tools.tolist()]
    return {
        number: far
        for number, far in zip(numbers, away.tolist(), strict=True)
        if number is not None and np.isfinite(far)
    }


def _lengths(cutter: Cutter, tip: float | None) -> Iterator[tuple[str, str]]:
    """Message and help where edges or holder are longer than the tool is in the cell, or the holder is thinner than
    the shank.  tip [m]: from the flange."""
    name = f"tool {cutter.number}"
    for what, value in (
        ("its edges end", cutter.length),
        ("its holder starts", None if cutter.holder is None else cutter.holder[1]),
    ):
        if tip is not None and value is not None and value > tip > _SHORT:
            message = (
                f"{name}: {what} {value / MM:.6g} mm above the tip, which the cell has {tip / MM:.6g} mm from the"
                " flange"
            )
            yield message, "compare the length with that of the tool in the cell; state mm"
    if cutter.shank is not None and cutter.holder is not None and cutter.holder[0] < cutter.shank:
        holder, shank = 2 * cutter.holder[0] / MM, 2 * cutter.shank / MM
        message = (
            f"{name} has a holder with the diameter {holder:.6g} mm, below that of its shank, {shank:.6g} mm"
        )
        yield message, "compare both: diameters, in mm"


def _sideways(
    cutter: Cutter, index: int, sweeps: MotionSweeps, cuts: Bools, toolpath: Toolpath
) -> Iterator[tuple[str, str]]:
    """A drill that cuts across its axis."""
    if cutter.shape != "drill":
        return
    own = np.flatnonzero((sweeps.which == index) & (sweeps.rows[:, REMOVES] > 0) & cuts[sweeps.motion])
    step = sweeps.rows[own, STEP : STEP + 3]
    size = np.linalg.norm(step, axis=1)
    along = np.abs(np.einsum("mi,mi->m", step, sweeps.rows[own, AXIS : AXIS + 3]))
    across = np.unique(sweeps.motion[own[(size > _SHORT) & (along < _ALONG * size)]])
    if len(across):
        message = (
            f"tool {cutter.number} is a drill, and cuts across its axis in {len(across)} motions (the first in line"
            f" {toolpath.line[across[0]]})"
        )
        yield (
            message,
            "a drill has no edges at its side: is the shape another one, or the tool of another program?",
        )


def _ridges(
    cutter: Cutter, index: int, sweeps: MotionSweeps, cuts: Bools, toolpath: Toolpath
) -> Iterator[tuple[str, str]]:
    """Zigzags in the material whose neighbouring passes are farther apart than the tool is wide, seen along the
    spindle: they may rise and fall."""
    own = np.flatnonzero((sweeps.which == index) & (sweeps.rows[:, REMOVES] > 0))
    step, axis = sweeps.rows[own, STEP : STEP + 3], sweeps.rows[own, AXIS : AXIS + 3]
    rise = np.einsum("mi,mi->m", step, axis)
    size = np.linalg.norm(step - rise[:, None] * axis, axis=1)
    moves = size > _SHORT
    own, step, axis, rise, size = own[moves], step[moves], axis[moves], rise[moves], size[moves]
    if len(own) < 5:
        return
    way = (step - rise[:, None] * axis) / size[:, None]
    level = (np.abs(rise) < size) & ~sweeps.rows[own, TURN : TURN + 3].any(axis=1)
    order = np.cumsum(
        np.linalg.norm(sweeps.rows[:, STEP : STEP + 3], axis=1) > _SHORT
    )  # some motions move nothing
    joined = (np.diff(order[own]) == 1) & (sweeps.rows[own[1:], CUTTER] == sweeps.rows[own[:-1], CUTTER])
    tip = sweeps.rows[own, TIP_POINT : TIP_POINT + 3]
    joined &= np.linalg.norm(tip[1:] - tip[:-1] - step[:-1], axis=1) < _SHORT
    joined &= np.einsum("mi,mi->m", axis[1:], axis[:-1]) > 1 - 1e-9
    goes_on = joined & (np.einsum("mi,mi->m", way[1:], way[:-1]) > _PARALLEL)
    first = np.flatnonzero(np.append(True, ~goes_on))  # of each straight part of the path
    linked = np.append(False, joined)[first]
    length = np.add.reduceat(size, first)
    engaged = np.add.reduceat(cuts[sweeps.motion[own]].astype(int), first) > 0
    flat = np.minimum.reduceat(level.astype(int), first) > 0
    way = way[first]
    if len(first) < 5:
        return
    k = np.arange(len(first) - 4)  # pass, link, pass, link, pass

    def cosine(a: int, b: int) -> Floats:
        return np.asarray(np.einsum("ki,ki->k", way[k + a], way[k + b]))

    good = linked[k + 1] & linked[k + 2] & linked[k + 3] & linked[k + 4]
    for at in range(5):
        good &= flat[k + at] & (engaged[k + at] if at % 2 == 0 else True)
    good &= (cosine(0, 2) < -_PARALLEL) & (cosine(2, 4) < -_PARALLEL) & (cosine(1, 3) > _PARALLEL)
    good &= np.abs(cosine(0, 1)) < _SQUARE
    apart = np.maximum(length[k + 1], length[k + 3])
    wrong = np.flatnonzero(good & (apart > 2 * cutter.radius * (1 + 1e-6)))
    if not len(wrong):
        return
    worst = int(wrong[np.argmax(apart[wrong])])
    lines = toolpath.line[sweeps.motion[own[first[[worst, worst + 4]]]]]
    message = (
        f"tool {cutter.number} with the diameter {2 * cutter.radius / MM:.6g} mm cuts passes that are"
        f" {apart[worst] / MM:.4g} mm apart (lines {lines[0]} to {lines[1]}): ridges of"
        f" {(apart[worst] - 2 * cutter.radius) / MM:.4g} mm remain between them"
    )
    yield message, "is the diameter a radius, or in another unit than mm?"


def _through(
    sweeps: MotionSweeps, cut: EngagedMotions, toolpath: Toolpath, program: str
) -> Iterator[Finding]:
    """Where tips leave the box around the blank on the side to which the tool points, while they cut."""
    low, high = corners_of(cut.stock.blank)
    own = np.flatnonzero((sweeps.rows[:, REMOVES] > 0) & cut.cuts[sweeps.motion])
    rows = sweeps.rows[own]
    axis, tip, step = (rows[:, at : at + 3] for at in (AXIS, TIP_POINT, STEP))
    beyond = np.full(len(own), -np.inf)
    for k in range(3):
        for sign, face in ((1.0, low[k]), (-1.0, high[k])):
            deepest = sign * face - np.minimum(sign * tip[:, k], sign * (tip[:, k] + step[:, k]))
            beyond = np.where(sign * axis[:, k] > _UPRIGHT, deepest, beyond)
    at = int(np.argmax(beyond))
    if beyond[at] > _THROUGH:
        message = (
            f"the blank is cut through: the tip of a tool that cuts is up to {beyond[at] / MM:.4g} mm below its bottom"
            f" here, and below it in {len(np.unique(sweeps.motion[own[beyond > _THROUGH]]))} motions"
        )
        yield Finding("STK030", message, program, int(toolpath.line[sweeps.motion[own[at]]]))


def _blank(sweeps: MotionSweeps, cut: EngagedMotions) -> Iterator[tuple[str, str]]:
    """The size of the blank against the way of the tips at a feed."""
    low, high = corners_of(cut.stock.blank)
    blank = high - low
    rows = sweeps.rows[sweeps.rows[:, REMOVES] > 0]
    tip, step = rows[:, TIP_POINT : TIP_POINT + 3], rows[:, STEP : STEP + 3]
    ends = np.concatenate([tip, tip + step])
    way = ends.max(axis=0) - ends.min(axis=0)
    wide = 2 * max(cutter.radius for cutter in sweeps.cutters)
    small = np.count_nonzero(way - 2 * wide > _TIMES_THE_BLANK * blank) >= 2
    large = blank.max() > _LONG_BLANK and np.count_nonzero(way < _SMALL_PROGRAM * blank) >= 2
    if small or large:
        sizes = [" x ".join(f"{value / MM:.4g}" for value in size) for size in (blank, way)]
        message = f"the blank is {sizes[0]} mm, and the tip moves over {sizes[1]} mm at a feed"
        yield (
            message,
            f"is the blank in {'inches, centimetres or metres' if small else 'a smaller unit'}? state mm",
        )
