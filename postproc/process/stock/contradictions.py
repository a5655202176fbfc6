"""What a process file states of tools, blank and coefficients that the program, or the cell, contradicts.

A length in inches, centimetres or metres, a radius for a diameter, a speed in another unit: each goes through every
check of a file for itself, and the forces and the correction are wrong by as much.  Nothing is guessed and nothing
changed: every contradiction is a warning that names both sides.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.process.stock.blank import corners_of
from postproc.process.stock.cutters import Cutter
from postproc.process.stock.distance import AXIS, CUTTER, REMOVES, STEP, TIP_POINT, TURN
from postproc.process.stock.engagement import EngagedMotions
from postproc.process.stock.motion_sweeps import MotionSweeps
from postproc.process.stock.stock_section import StockProcess
from postproc.toolpath import Toolpath

SAME_DIAMETER = 0.01
THINNEST, THICKEST = 1.0 * MM, 200.0 * MM
"""Diameters of the cutters of robots."""
DEEPEST_SLOT, DEEPEST = 4.0, 12.0
"""Diameters: of a cut that is at least half as wide as the tool, and of any, but for drills."""
_WIDE = 0.5
LEAST_HELIX = 2.0 * DEG
FASTEST = 5000.0 / 60
"""[m/s] of the edges: nothing is cut faster."""
FASTEST_TURN, TURNS_FAST = 60000 * 2 * np.pi / 60, 10.0 * MM
"""[rad/s] of a spindle that takes cutters above that diameter."""
FINEST_PITCH = 0.25 * MM
"""From tooth to tooth around the tool."""
LARGEST_FORCE, LARGEST_POWER = 10e3, 200e3
"""[N], [W]: no robot and no spindle has more."""
SOFTEST, HARDEST, SHARPEST, BLUNTEST = 1e6, 2e10, 1e6, 1.0 * MM
"""[Pa] of Ktc: foam and superalloys; [N/m] of Kte; and of Kte over Ktc, which is of the size of the edges' radius."""
LEAST_ASIDE, MOST_ASIDE = 0.005, 10.0
"""Of the tangential coefficient: the radial one, and any other."""
_TIMES_THE_BLANK, _LONG_BLANK, _SMALL_PROGRAM = 4.0, 2.0, 0.1
_PARALLEL, _SQUARE, _ALONG = 0.999, 0.05, 0.996  # cosines
_SHORT = 1e-6  # m
_UPRIGHT, _THROUGH = 0.9, 1e-6  # cosine, m

_RATIOS = {
    25.4: "one of them is in inches",
    1000.0: "one of them is in metres",
    10.0: "one of them is in centimetres",
    2.0: "one of them is a radius",
}


class _StatedCut(NamedTuple):
    """What of a program a tool cuts: its rows (K,), the largest axial depth where it is wide and anywhere [m], the line
    of each, largest force [N] and power [W]."""

    rows: Ints
    slot: tuple[float, int]
    depth: tuple[float, int]
    force: float
    power: float


def contradictions(
    process: StockProcess,
    sweeps: MotionSweeps,
    cut: EngagedMotions,
    toolpath: Toolpath,
    diameters: Mapping[int, float],
    tip: Mapping[int, float],
    program: str,
) -> list[Finding]:
    """STK025 to STK028, STK030.  diameters: of the cell's tools by number [m]; tip: from the flange to their tips
    [m]."""
    findings = []
    path = str(process.path)
    for index, cutter in enumerate(sweeps.cutters):
        own = np.unique(sweeps.motion[(sweeps.which == index) & (sweeps.rows[:, REMOVES] > 0)])
        if not len(own):
            continue
        rows = own[cut.cuts[own]]
        if not len(rows):
            message = (
                f"tool {cutter.number} moves at a feed in {len(own)} motions in lines {toolpath.line[own[0]]} to"
                f" {toolpath.line[own[-1]]}, and cuts nothing"
            )
            findings.append(Finding("STK027", message, program, int(toolpath.line[own[0]])))
            continue
        found = _cut_of(cutter, rows, cut, toolpath)
        speed = process.edges[cutter.number].speed
        turning = np.abs(toolpath.spindle[rows]) if speed is None else np.array([speed])
        known = turning[np.isfinite(turning)]
        for message, help in (
            *_sizes(cutter, found, diameters.get(cutter.number), tip.get(cutter.number)),
            *_helix_and_holder(cutter),
            *_edges(cutter, float(known.max(initial=0.0))),
            *_sideways(cutter, index, sweeps, cut.cuts, toolpath),
        ):
            findings.append(Finding("STK025", message, path, cutter.line, help=help))
        for message, help in _ridges(cutter, index, sweeps, cut.cuts, toolpath):
            findings.append(Finding("STK025", message, path, cutter.line, help=help))
        for message, help in _forces(cutter, found, process):
            findings.append(Finding("STK028", message, path, cutter.line, help=help))
    findings += _through(sweeps, cut, toolpath, program)
    findings += [
        Finding("STK026", message, path, process.line, help=help) for message, help in _blank(sweeps, cut)
    ]
    return findings


def _cut_of(cutter: Cutter, rows: Ints, cut: EngagedMotions, toolpath: Toolpath) -> _StatedCut:
    depth, width = cut.depth[rows], cut.width[rows]
    wide = np.where(width >= _WIDE * 2 * cutter.radius, depth, 0.0)
    at, slot = int(np.argmax(depth)), int(np.argmax(wide))
    size = np.linalg.norm(cut.largest[rows, :3], axis=1)
    return _StatedCut(
        rows,
        (float(wide[slot]), int(toolpath.line[rows[slot]])),
        (float(depth[at]), int(toolpath.line[rows[at]])),
        float(np.nan_to_num(size).max(initial=0.0)),
        float(np.abs(np.nan_to_num(cut.power[rows])).max(initial=0.0)),
    )


def _sizes(
    cutter: Cutter, found: _StatedCut, of_cell: float | None, tip: float | None
) -> Iterator[tuple[str, str]]:
    """Message and help of each contradiction to the cell, and of the cut to the diameter."""
    wide = 2 * cutter.radius
    name = f"tool {cutter.number}"
    if of_cell is not None and abs(wide - of_cell) > SAME_DIAMETER * of_cell:
        own, other = wide / MM, of_cell / MM
        message = f"{name} has the diameter {own:.6g} mm here, which is used, and {other:.6g} mm in the cell"
        yield message, _reason(max(wide / of_cell, of_cell / wide))
    if wide < THINNEST:
        inches = wide * 25.4
        message = f"{name} has a diameter of {wide / MM:.6g} mm: no robot mills with a cutter below 1 mm"
        yield message, f"is it in inches? they would be {inches / MM:.6g} mm; state mm"
    if wide > THICKEST:
        yield f"{name} has a diameter of {wide / MM:.6g} mm, above 200 mm", "state mm"
    if cutter.shape != "drill":
        for (depth, line), most, what in (
            (found.slot, DEEPEST_SLOT, "at half of its width or more"),
            (found.depth, DEEPEST, "somewhere"),
        ):
            if depth > most * wide:
                message = (
                    f"{name} with the diameter {wide / MM:.6g} mm cuts {depth / MM:.4g} mm deep {what} (line"
                    f" {line}): {depth / wide:.3g} times its diameter"
                )
                yield (
                    message,
                    "compare the diameter, its unit (mm), and the top of the blank with the program",
                )
                break
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


def _helix_and_holder(cutter: Cutter) -> Iterator[tuple[str, str]]:
    """Message and help where helix or holder are of no tool."""
    name = f"tool {cutter.number}"
    if cutter.helix is not None and 0.0 < abs(cutter.helix) < LEAST_HELIX:
        angle = cutter.helix / DEG
        message = f"{name} has a helix of {angle:.4g} deg, less than any cutter that is not straight"
        yield message, f"is it in rad? it would be {angle / DEG:.4g} deg; state deg, or 0 for straight edges"
    if cutter.shank is not None and cutter.holder is not None and cutter.holder[0] < cutter.shank:
        holder, shank = 2 * cutter.holder[0] / MM, 2 * cutter.shank / MM
        message = (
            f"{name} has a holder with the diameter {holder:.6g} mm, below that of its shank, {shank:.6g} mm"
        )
        yield message, "compare both: diameters, in mm"


def _reason(ratio: float) -> str:
    for known, words in _RATIOS.items():
        if abs(ratio - known) < 0.03 * known:
            return f"{ratio:.4g} times: {words}? state diameters in mm"
    return "state the diameter in mm in both files"


def _edges(cutter: Cutter, turning: float) -> Iterator[tuple[str, str]]:
    """turning [rad/s]: the largest speed of the spindle."""
    fast = turning * cutter.radius
    if turning > FASTEST_TURN and 2 * cutter.radius > TURNS_FAST:
        wide = 2 * cutter.radius / MM
        message = f"tool {cutter.number}, diameter {wide:.6g} mm, turns at {turning * 30 / np.pi:.6g} 1/min"
        yield message, "no spindle turns a cutter above 10 mm so fast; state spindle in 1/min"
    if fast > FASTEST:
        wide = 2 * cutter.radius / MM
        message = f"the edges of tool {cutter.number}, diameter {wide:.6g} mm, move at {fast * 60:.5g} m/min"
        yield message, "compare diameter (mm) and spindle (1/min): nothing is cut faster than 5000 m/min"
    pitch = 2 * np.pi * cutter.radius / max(cutter.teeth or 1, 1)
    if pitch < FINEST_PITCH:
        message = (
            f"tool {cutter.number} has {cutter.teeth} teeth on a diameter of {2 * cutter.radius / MM:.6g} mm,"
            f" {pitch / MM:.3g} mm from one to the next"
        )
        yield message, "compare diameter (mm) and teeth"


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


def _forces(cutter: Cutter, found: _StatedCut, process: StockProcess) -> Iterator[tuple[str, str]]:
    material = process.edges[cutter.number].material
    name = f"tool {cutter.number}"
    if material is not None:
        cutting, edge = material.coefficients.cutting, material.coefficients.edge
        ktc, kte = cutting[0], edge[0]
        if not SOFTEST <= ktc <= HARDEST:
            message = f"{name}: ktc of {ktc / 1e6:.4g} N/mm2 is that of no material"
            yield message, "1 N/mm2 is foam, 5000 N/mm2 a superalloy; state ktc, krc, kac in N/mm2"
        if kte > SHARPEST or kte > BLUNTEST * ktc > 0:
            message = (
                f"{name}: kte of {kte / 1e3:.4g} N/mm belongs to no edge for ktc of {ktc / 1e6:.4g} N/mm2"
            )
            yield message, "usual are some N/mm, 0.01 to 0.1 mm times ktc; state kte, kre, kae in N/mm"
        for names, values, unit, scale in (
            (("krc", "kac"), cutting, "N/mm2", 1e6),
            (("kre", "kae"), edge, "N/mm", 1e3),
        ):
            for other, value in zip(names, values[1:], strict=True):
                # the axial one may be as small as it likes
                if value > MOST_ASIDE * values[0] > 0 or (
                    other[1] == "r" and 0 < value < LEAST_ASIDE * values[0]
                ):
                    message = (
                        f"{name}: {other} of {value / scale:.4g} {unit} does not belong to kt{other[2]} of"
                        f" {values[0] / scale:.4g} {unit}"
                    )
                    yield message, f"usual is 0.1 to 1 times as much; state both in {unit}"
    if found.force > LARGEST_FORCE or found.power > LARGEST_POWER:
        message = (
            f"{name} has a mean force of up to {found.force:.4g} N and a power of up to {found.power / 1e3:.4g} kW: no"
            " robot mills with that"
        )
        yield message, "compare coefficients (N/mm2, N/mm), depth of cut and feed with the machine"


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
