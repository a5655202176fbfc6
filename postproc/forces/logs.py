"""Measured forces over the path length or over time, brought to the motions of a program.

``s_mm`` counts along the programmed path from the first known point on: lines and arcs by their length, PTP by the
straight way between its ends, moves from and to axis positions and turns on the spot not at all.  ``t_s`` counts the
time at the programmed feed; motions without a feed (PTP) take none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.blocks import blocks
from postproc.cell import Frames
from postproc.findings import Finding, Refusal
from postproc.forces.annotations import marked_air
from postproc.forces.gauge import checked_gauge
from postproc.forces.resampling import Readings, resampled, uneven
from postproc.forces.stated import Stated
from postproc.forces.table import read_channels, read_frames
from postproc.forces.way import Way, shifted
from postproc.forces.wrench import is_air
from postproc.tables import Table
from postproc.toolpath import Toolpath
from postproc.units import MM

UNITS = {"s_mm": MM, "t_s": 1.0}
"""Column -> its unit in SI."""

GAP = 10.0
"""Readings this many times further apart than usual leave a gap."""


@dataclass(frozen=True, eq=False)
class Scale:
    """Where the motions lie on the scale of a log: ``begin``, ``end`` (N,) [m or s].

    ``air`` (N,): motions that are air.
    """

    begin: Floats
    end: Floats
    air: Bools
    column: str

    @property
    def cutting(self) -> Ints:
        """Rows that are not air and take a part of the scale."""
        return np.flatnonzero(~self.air & (self.end > self.begin))

    def show(self, value: float) -> str:
        return f"{self.column.split('_')[0]} = {value / UNITS[self.column]:.6g} {self.column.split('_')[1]}"


def read_log(
    table: Table, column: str, toolpath: Toolpath, frames: Frames, program: str, offset: bool
) -> tuple[Stated, tuple[Finding, ...]]:
    """What a log over ``column`` (s_mm or t_s) states for every motion: linear along it, and its peak.

    ``offset``: the mean in air is taken off.
    Refusal: FRC003 (cells, order, frame), FRC013 (feed), FRC019 (log and path do not match), FRC020 (no air).
    """
    findings: list[Finding] = []
    if not len(toolpath):
        return Stated(np.zeros((0, 6)), np.zeros(0, np.int8), np.zeros(0, np.int32)), ()
    scale = _scale(column, toolpath, frames, program, findings)
    place = table.numbers(column) * UNITS[column]
    _check_order(table, column, place)
    channels = read_channels(table)
    frame = _one_frame(table)
    owner = np.minimum(np.searchsorted(scale.end, place, side="right"), len(toolpath) - 1).astype(np.int32)
    # places ascend
    within = slice(
        *(int(np.searchsorted(place, *edge)) for edge in ((0.0, "left"), (scale.end[-1], "right")))
    )
    spacing = _check_extent(table, place, scale, findings)
    in_air = np.zeros(len(place), bool)
    in_air[within] = scale.air[owner[within]]
    channels = checked_gauge(table, channels, in_air, offset, findings)

    readings = Readings(owner[within], place[within], channels[within], scale.begin, scale.end)
    start, value, peak, error = resampled(readings)
    start[scale.air], value[scale.air], peak[scale.air] = 0.0, 0.0, np.nan
    for made in (start, value):
        made.setflags(write=False)
    each = np.arange(len(toolpath), dtype=np.int32)
    stated = Stated(value, np.full(len(toolpath), frame), each, start, peak=peak, error=error)
    findings += _told(table, readings, place, spacing, scale, stated, toolpath, program)
    return stated, tuple(findings)


def _scale(column: str, toolpath: Toolpath, frames: Frames, program: str, findings: list[Finding]) -> Scale:
    way = Way(toolpath, frames)
    air = is_air(toolpath) | marked_air(toolpath)
    known = np.flatnonzero(way.known)
    start = known[0] if len(known) else len(toolpath)
    index = np.arange(len(toolpath))
    lost = np.flatnonzero(~air & (index > start) & ~(way.known & shifted(way.known)))
    if len(lost):
        raise Refusal(
            Finding(
                "FRC019",
                f"the way of a motion is not known, and with it no {column} behind it ({len(lost)} such motions)",
                program,
                int(toolpath.line[lost[0]]),
                help="give the forces of this program by line",
            )
        )
    uncounted = (index > start) & (way.length == 0)
    extent = way.length
    if column == "t_s":
        slow = np.flatnonzero(~air & (way.length > 0) & ~(toolpath.feed > 0))
        if len(slow):
            raise Refusal(
                Finding(
                    "FRC013",
                    f"the feed of {len(slow)} motions is not known, and with it the time that they take",
                    program,
                    int(toolpath.line[slow[0]]),
                    help="set the feed in the program before the motion ($VEL.CP, F), or log over s_mm",
                )
            )
        timed = (way.length > 0) & (toolpath.feed > 0)
        extent = np.where(timed, way.length / np.where(timed, toolpath.feed, 1.0), 0.0)
        uncounted |= (index > start) & ~timed
    # a first run-in to the cut is no loss; what stands between cuts shifts all that comes after
    cutting = np.flatnonzero(~air & (extent > 0))
    uncounted &= (index > (cutting[0] if len(cutting) else len(index))) & (
        index < (cutting[-1] if len(cutting) else 0)
    )
    if np.any(uncounted):
        what = f"motions that take no part of {column} (turns on the spot, axis positions"
        what += ", moves without a feed)" if column == "t_s" else ")"
        row = int(np.argmax(uncounted))
        findings.append(Finding("FRC028", f"{what}: {uncounted.sum()}", program, int(toolpath.line[row])))
    end = np.cumsum(extent)
    return Scale(end - extent, end, air, column)


def _check_order(table: Table, column: str, place: Floats) -> None:
    back = np.flatnonzero(np.diff(place) < 0)
    if len(back):
        row = int(back[0]) + 1
        cells = table.columns[column]
        raise table.error(row, column, f"{cells[row]} stands behind {cells[row - 1]}; it must not go back")


def _one_frame(table: Table) -> int:
    frame = read_frames(table)
    other = np.flatnonzero(frame != frame[0])
    if len(other):
        raise table.error(
            int(other[0]), "frame", "another frame than in the rows before; a log has one frame"
        )
    return int(frame[0])


def _check_extent(table: Table, place: Floats, scale: Scale, findings: list[Finding]) -> float:
    """The usual distance of readings; Refusal FRC019 where they do not cover the cutting part of the path."""
    steps = np.diff(place)
    spacing = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    rows = scale.cutting
    if not len(rows):
        return spacing
    first, last, whole = scale.begin[rows[0]], scale.end[rows[-1]], scale.end[-1]
    allowed = 2 * spacing + 1e-6 * whole
    message = ""
    if place[-1] < last - allowed:
        message = f"the log ends at {scale.show(place[-1])}, the path that cuts at {scale.show(last)}"
        line = int(table.lines[-1])
    elif place[0] > first + allowed:
        message = f"the log begins at {scale.show(place[0])}, the path that cuts at {scale.show(first)}"
        line = int(table.lines[0])
    if message:
        raise Refusal(
            Finding(
                "FRC019",
                message,
                str(table.path),
                line,
                help="is it the log of this program, from its first motion on?",
            )
        )
    if place[-1] > whole + max(2 * spacing, 0.01 * whole):
        row = int(np.argmax(place > whole + 1e-6 * spacing))
        what = f"the log goes on to {scale.show(place[-1])}, the path ends at {scale.show(whole)}"
        findings.append(Finding("FRC027", what, str(table.path), int(table.lines[row])))
    return spacing


def _told(
    table: Table,
    readings: Readings,
    place: Floats,
    spacing: float,
    scale: Scale,
    stated: Stated,
    toolpath: Toolpath,
    program: str,
) -> list[Finding]:
    """What there is to say of readings on a path, and their largest forces."""
    rows = scale.cutting
    if not len(rows):
        return []
    findings = []
    count = np.bincount(readings.own, minlength=len(toolpath))
    empty = rows[count[rows] == 0]
    if len(empty):
        what = f"motions without a reading of their own, taken between those around them: {len(empty)}"
        findings.append(Finding("FRC025", what, program, int(toolpath.line[empty[0]])))

    apart = np.flatnonzero(np.diff(place) > GAP * spacing)
    # between place[apart] and place[apart + 1]: does any motion that cuts lie there?
    hit = np.searchsorted(scale.end[rows], place[apart], side="right")
    hit = apart[(hit < len(rows)) & (scale.begin[rows[np.minimum(hit, len(rows) - 1)]] < place[apart + 1])]
    if len(hit):
        widest = hit[np.argmax(place[hit + 1] - place[hit])]
        what = (
            f"gaps in the log: {len(hit)}, the widest from {scale.show(place[widest])} to "
            f"{scale.show(place[widest + 1])}; the force there is taken from its ends"
        )
        findings.append(Finding("FRC024", what, str(table.path), int(table.lines[widest])))

    off, deviation = uneven(readings, stated.begin, stated.values)
    off, deviation = off[~scale.air[off]], deviation[~scale.air[off]]
    if len(off):
        worst = off[np.argmax(deviation)]
        what = (
            f"motions along which the force does not change evenly: {len(off)}; it is up to {deviation.max():.0f} N "
            f"from the line that stands for it (line {toolpath.line[worst]})"
        )
        help = "a cut that begins or ends within a motion needs a point there"
        findings.append(Finding("FRC026", what, program, int(toolpath.line[worst]), help=help))

    size = np.zeros(len(toolpath))
    for part in blocks(len(toolpath)):
        both = stated.values[part, :3] + stated.begin[part, :3]
        size[part] = 0.5 * np.linalg.norm(both, axis=1)
    peaks = np.zeros(len(toolpath)) if stated.peak is None else stated.peak
    mean, peak = rows[np.argmax(size[rows])], rows[np.argmax(peaks[rows])]
    what = (
        f"{len(readings.own)} readings on {len(rows)} motions, {np.median(count[rows]):g} each in the median; largest "
        f"mean force {size[mean]:.0f} N in line {toolpath.line[mean]}, largest peak {peaks[peak]:.0f} N in line "
        f"{toolpath.line[peak]}"
    )
    findings.append(Finding("FRC029", what, str(table.path)))
    return findings
