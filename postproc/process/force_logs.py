"""Measured forces over the path length or over time, brought to the motions of a program.

``s_mm`` counts along the programmed path from the first known point on: lines and arcs by their length, point-to-point
motions by the straight line between their ends, moves from and to axis positions and turns on the spot not at all.
``t_s`` counts the time at the programmed feed; motions without a feed (point to point) take none, so that between cuts
they shift what is behind them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import blocks
from postproc.base.findings import Finding, Refusal
from postproc.base.tables import CsvTable
from postproc.base.units import MM
from postproc.cell import MotionFrames
from postproc.process.force_comments import marked_air
from postproc.process.force_gauge import checked_gauge
from postproc.process.force_table import read_channels, read_frames
from postproc.process.path_length import PathLength, shifted
from postproc.process.resampling import ForceReadings, resampled, uneven
from postproc.process.stated_forces import StatedForces
from postproc.process.wrenches import is_air
from postproc.toolpath import Toolpath

_SAME = 1e-9

UNITS = {"s_mm": MM, "t_s": 1.0}
"""Column -> its unit in SI."""

GAP = 10.0
"""Readings this many times further apart than usual leave a gap."""

CUTS = 0.1
"""A reading after the path of more than this share of the largest force on it is of a cut."""


@dataclass(frozen=True, eq=False)
class Scale:
    """Where the motions lie on the scale of a log: ``start``, ``end`` (N,) [m or s].

    ``air`` (N,): motions that are air.
    """

    start: Floats
    end: Floats
    air: Bools
    column: str

    @property
    def cutting(self) -> Ints:
        """Rows (K,) that are not air and take a part of the scale."""
        return np.flatnonzero(~self.air & (self.end > self.start))

    def show(self, value: float) -> str:
        return f"{self.column.split('_')[0]} = {value / UNITS[self.column]:.6g} {self.column.split('_')[1]}"


def read_log(
    table: CsvTable, column: str, toolpath: Toolpath, frames: MotionFrames, program: str, offset: bool
) -> tuple[StatedForces, tuple[Finding, ...]]:
    """What a log over ``column`` (s_mm or t_s) states for every motion: linear along it, and its peak.

    ``offset``: the mean in air is taken off.
    Refusal: FRC003 (cells, order, frame), FRC013 (feed), FRC019 (log and path do not match), FRC020 (no air).
    """
    findings: list[Finding] = []
    if not len(toolpath):
        return StatedForces(np.zeros((0, 6)), np.zeros(0, np.int8), np.zeros(0, np.int32)), ()
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
    spacing = _check_extent(table, place, scale, channels[:, :3], findings)
    in_air = np.zeros(len(place), bool)
    in_air[within] = scale.air[owner[within]]
    channels = checked_gauge(table, channels, in_air, offset, findings)

    readings = ForceReadings(owner[within], place[within], channels[within], scale.start, scale.end)
    start, value, peak, error = resampled(readings)
    start[scale.air], value[scale.air], peak[scale.air] = 0.0, 0.0, np.nan
    for array in (start, value):
        array.setflags(write=False)
    each = np.arange(len(toolpath), dtype=np.int32)
    stated = StatedForces(value, np.full(len(toolpath), frame), each, start, peak=peak, error=error)
    findings += _summary(table, readings, place, spacing, scale, stated, toolpath, program)
    return stated, tuple(findings)


def _scale(
    column: str, toolpath: Toolpath, frames: MotionFrames, program: str, findings: list[Finding]
) -> Scale:
    path_length = PathLength(toolpath, frames)
    air = is_air(toolpath) | marked_air(toolpath)
    known = np.flatnonzero(path_length.known)
    start = known[0] if len(known) else len(toolpath)
    index = np.arange(len(toolpath))
    lost = np.flatnonzero(
        ~air & (index > start) & ~(path_length.known & shifted(path_length.known) & toolpath.continues)
    )
    if len(lost):
        raise Refusal(
            Finding(
                "FRC019",
                f"the path length of {len(lost)} motions is not known, so no {column} after them is known",
                program,
                int(toolpath.line[lost[0]]),
                help="state the forces of this program by line",
            )
        )
    uncounted = (index > start) & (path_length.length == 0)
    extent = path_length.length
    if column == "t_s":
        slow = np.flatnonzero(~air & (path_length.length > 0) & ~(toolpath.feed > 0))
        if len(slow):
            raise Refusal(
                Finding(
                    "FRC013",
                    f"the feed of {len(slow)} motions is not known, so their duration is not known",
                    program,
                    int(toolpath.line[slow[0]]),
                    help="set the feed in the program before the motion ($VEL.CP, F), or record the log over s_mm",
                )
            )
        has_duration = (path_length.length > 0) & (toolpath.feed > 0)
        extent = np.where(has_duration, path_length.length / np.where(has_duration, toolpath.feed, 1.0), 0.0)
        uncounted |= (index > start) & ~has_duration
    # a first run-in to the cut is no loss; what is between cuts shifts all that comes after
    cutting = np.flatnonzero(~air & (extent > 0))
    uncounted &= (index > (cutting[0] if len(cutting) else len(index))) & (
        index < (cutting[-1] if len(cutting) else 0)
    )
    findings += _uncounted_findings(column, np.flatnonzero(uncounted), path_length, toolpath, program)
    if column == "t_s" and len(cutting):
        waits = np.flatnonzero(toolpath.sequence.waits[cutting[0] : cutting[-1]]) + cutting[0]
        findings += _wait_findings(waits, toolpath, program)
    end = np.cumsum(extent)
    return Scale(end - extent, end, air, column)


def _uncounted_findings(
    column: str, rows: Ints, path_length: PathLength, toolpath: Toolpath, program: str
) -> list[Finding]:
    """Of motions ``rows`` (K,) between cuts that take no part of the scale."""
    if column == "t_s":
        turn = np.abs(toolpath.rotation[rows] - toolpath.rotation[rows - 1]).max(axis=(1, 2))
        rests = (path_length.known & path_length.starts)[rows] & ~path_length.moved[rows] & (turn < _SAME)
        rows = rows[~rests]
    if not len(rows):
        return []
    line = int(toolpath.line[rows[0]])
    if column == "s_mm":
        what = f"{len(rows)} motions do not advance s_mm (rotations on the spot, axis positions)"
        return [Finding("FRC028", what, program, line)]
    what = (
        f"{len(rows)} motions between cuts state no feed (rapid motions, rotations on the spot, axis positions), and"
        " t_s does not count their time: the forces of all cuts after them are shifted by it"
    )
    help = "record the log over s_mm, or state the forces by line"
    return [Finding("FRC047", what, program, line, help=help)]


def _wait_findings(rows: Ints, toolpath: Toolpath, program: str) -> list[Finding]:
    """Of motions ``rows`` (K,) between cuts after which the program waits, or may, in a log over t_s."""
    if not len(rows):
        return []
    what = (
        f"after {len(rows)} motions between cuts the program waits, or may (dwells, halts, inputs, changes of tools),"
        " and t_s does not count that time: the forces of all cuts after them are shifted by it"
    )
    help = "record the log over s_mm, or state the forces by line"
    return [Finding("FRC047", what, program, int(toolpath.line[rows[0]]), help=help)]


def _check_order(table: CsvTable, column: str, place: Floats) -> None:
    back = np.flatnonzero(np.diff(place) < 0)
    if len(back):
        row = int(back[0]) + 1
        cells = table.columns[column]
        raise table.error(
            row, column, f"{cells[row]} is less than {cells[row - 1]} in the row before; it must not decrease"
        )


def _one_frame(table: CsvTable) -> int:
    frame = read_frames(table)
    other = np.flatnonzero(frame != frame[0])
    if len(other):
        raise table.error(
            int(other[0]), "frame", "the frame differs from that of the rows before; a log has one frame"
        )
    return int(frame[0])


def _check_extent(
    table: CsvTable, place: Floats, scale: Scale, force: Floats, findings: list[Finding]
) -> float:
    """The usual distance of readings; Refusal FRC019 where they do not cover the cutting part of the path.  ``force``
    (M, 3) [N]: theirs."""
    steps = np.diff(place)
    spacing = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    rows = scale.cutting
    if not len(rows):
        return spacing
    first, last, whole = scale.start[rows[0]], scale.end[rows[-1]], scale.end[-1]
    allowed = 2 * spacing + 1e-6 * whole
    message = ""
    if place[-1] < last - allowed:
        message = (
            f"the log is too short: it ends at {scale.show(place[-1])}, and the path that cuts at"
            f" {scale.show(last)}"
        )
        line = int(table.lines[-1])
    elif place[0] > first + allowed:
        message = (
            f"the log is too late: it starts at {scale.show(place[0])}, and the path that cuts at"
            f" {scale.show(first)}"
        )
        line = int(table.lines[0])
    if message:
        raise Refusal(
            Finding(
                "FRC019",
                message,
                str(table.path),
                line,
                help="use the log of this program, from its first motion on",
            )
        )
    size = np.linalg.norm(force, axis=1)
    behind = place > whole + 2 * spacing
    cuts = size[behind].max(initial=0.0) > CUTS * size[~behind].max(initial=0.0)
    if cuts or place[-1] > whole + max(2 * spacing, 0.01 * whole):
        row = int(np.argmax(place > whole + 1e-6 * spacing))
        what = f"the log continues to {scale.show(place[-1])}, and the path ends at {scale.show(whole)}"
        if cuts:
            what += f"; after it the log has forces up to {size[behind].max():.0f} N"
        findings.append(Finding("FRC027", what, str(table.path), int(table.lines[row])))
    return spacing


def _summary(
    table: CsvTable,
    readings: ForceReadings,
    place: Floats,
    spacing: float,
    scale: Scale,
    stated: StatedForces,
    toolpath: Toolpath,
    program: str,
) -> list[Finding]:
    """The findings on readings along a path, and their largest forces."""
    rows = scale.cutting
    if not len(rows):
        return []
    findings = []
    count = np.bincount(readings.own, minlength=len(toolpath))
    empty = rows[count[rows] == 0]
    if len(empty):
        what = f"{len(empty)} motions have no reading of their own and use interpolated ones"
        findings.append(Finding("FRC025", what, program, int(toolpath.line[empty[0]])))

    apart = np.flatnonzero(np.diff(place) > GAP * spacing)
    # between place[apart] and place[apart + 1]: does any motion that cuts lie there?
    hit = np.searchsorted(scale.end[rows], place[apart], side="right")
    hit = apart[(hit < len(rows)) & (scale.start[rows[np.minimum(hit, len(rows) - 1)]] < place[apart + 1])]
    if len(hit):
        widest = hit[np.argmax(place[hit + 1] - place[hit])]
        what = (
            f"the log has {len(hit)} gaps, the widest from {scale.show(place[widest])} to "
            f"{scale.show(place[widest + 1])}; the force there is interpolated"
        )
        findings.append(Finding("FRC024", what, str(table.path), int(table.lines[widest])))

    off, deviation = uneven(readings, stated.start_values, stated.values)
    off, deviation = off[~scale.air[off]], deviation[~scale.air[off]]
    if len(off):
        worst = off[np.argmax(deviation)]
        what = (
            f"the force does not change linearly along {len(off)} motions; it is up to {deviation.max():.0f} N "
            f"off the linear force (line {toolpath.line[worst]})"
        )
        help = "insert a point where a cut starts or ends within a motion"
        findings.append(Finding("FRC026", what, program, int(toolpath.line[worst]), help=help))

    size = np.zeros(len(toolpath))
    for part in blocks(len(toolpath)):
        both = stated.values[part, :3] + stated.start_values[part, :3]
        size[part] = 0.5 * np.linalg.norm(both, axis=1)
    peaks = np.zeros(len(toolpath)) if stated.peak is None else stated.peak
    mean, peak = rows[np.argmax(size[rows])], rows[np.argmax(peaks[rows])]
    what = (
        f"{len(readings.own)} readings cover {len(rows)} motions, {np.median(count[rows]):g} each in the"
        f" median; the largest "
        f"mean force is {size[mean]:.0f} N in line {toolpath.line[mean]}, the largest peak is"
        f" {peaks[peak]:.0f} N in line "
        f"{toolpath.line[peak]}"
    )
    findings.append(Finding("FRC029", what, str(table.path)))
    return findings
