"""Measured forces over the path length or over time, brought to the motions of a program.

``s_mm`` counts along the programmed path from the first known point on: lines and arcs by their length, PTP by the
straight way between its ends, moves from and to axis positions and turns on the spot not at all.  ``t_s`` counts the
time at the programmed feed; motions without a feed (PTP) take none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.cell import Frames
from postproc.findings import Finding, Refusal
from postproc.forces.annotations import marked_air
from postproc.forces.gauge import checked_gauge
from postproc.forces.stated import Stated
from postproc.forces.table import read_channels, read_frames
from postproc.forces.way import Way, shifted
from postproc.forces.wrench import JUMP_OF_LARGEST, is_air
from postproc.tables import Table
from postproc.toolpath import Toolpath
from postproc.units import MM

UNITS = {"s_mm": MM, "t_s": 1.0}
"""Column -> its unit in SI."""

GAP = 10.0
"""Samples this many times further apart than usual leave a gap."""

FEW = 3
"""Samples that half a motion needs for a force that changes along it."""


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

    A motion with samples enough in both halves gets the line through the mean points of the two; one with fewer their
    mean; one without any the log between the samples around it.  ``offset``: the mean in air is taken off.
    Refusal: FRC003 (cells, order, frame), FRC013 (feed), FRC019 (log and path do not match), FRC020 (no air).
    """
    findings: list[Finding] = []
    if not len(toolpath):
        return Stated(np.zeros((0, 6)), np.zeros(0, np.int64)), ()
    scale = _scale(column, toolpath, frames, program, findings)
    place = table.numbers(column) * UNITS[column]
    _check_order(table, column, place)
    channels = read_channels(table)
    frame = _one_frame(table)
    owner = np.clip(np.searchsorted(scale.end, place, side="right"), 0, max(len(toolpath) - 1, 0))
    within = (place >= scale.begin[:1].min(initial=0.0)) & (place <= scale.end[-1:].max(initial=0.0))
    spacing = _check_extent(table, place, scale, findings)
    in_air = within & scale.air[owner]
    channels = checked_gauge(table, channels, in_air, offset, findings)

    n = len(toolpath)
    value, start, peak = _resampled(place, channels, owner, within, scale)
    value[scale.air], start[scale.air], peak[scale.air] = 0.0, 0.0, np.nan
    found = Stated(value, np.full(n, frame), start, peak=peak)
    findings += _told(table, place, channels, owner, within, spacing, scale, found, toolpath, program)
    return found, tuple(findings)


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
        raise table.error(
            row,
            column,
            f"{table.texts(column)[row]} stands behind {table.texts(column)[row - 1]}; it must not go back",
        )


def _one_frame(table: Table) -> int:
    frame = read_frames(table)
    other = np.flatnonzero(frame != frame[0])
    if len(other):
        raise table.error(
            int(other[0]), "frame", "another frame than in the rows before; a log has one frame"
        )
    return int(frame[0])


def _check_extent(table: Table, place: Floats, scale: Scale, findings: list[Finding]) -> float:
    """The usual distance of samples; Refusal FRC019 where they do not cover the cutting part of the path."""
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


def _resampled(
    place: Floats, channels: Floats, owner: Ints, within: Bools, scale: Scale
) -> tuple[Floats, Floats, Floats]:
    """Wrench at the end and at the begin (N, 6) and the largest force (N,) of every motion."""
    n = len(scale.end)
    inside = np.flatnonzero(within)
    own, at, values = owner[inside], place[inside], channels[inside]
    middle = 0.5 * (scale.begin + scale.end)
    half = 2 * own + (at >= middle[own])
    count, centre, mean = _means(half, at, values, 2 * n)
    both = count.reshape(n, 2)

    # the log itself where a motion has no sample of its own
    value = np.stack([np.interp(scale.end, place, channel) for channel in channels.T], axis=1)
    start = np.stack([np.interp(scale.begin, place, channel) for channel in channels.T], axis=1)
    some = both.sum(axis=1) > 0
    _, _, whole = _means(own, at, values, n)
    value[some], start[some] = whole[some], whole[some]
    x, y = centre.reshape(n, 2), mean.reshape(n, 2, -1)
    line = np.flatnonzero(np.all(both >= FEW, axis=1) & (x[:, 1] > x[:, 0]))
    slope = (y[line, 1] - y[line, 0]) / (x[line, 1] - x[line, 0])[:, None]
    start[line] = y[line, 0] + slope * (scale.begin[line] - x[line, 0])[:, None]
    value[line] = y[line, 1] + slope * (scale.end[line] - x[line, 1])[:, None]

    peak = np.maximum(np.linalg.norm(value[:, :3], axis=1), np.linalg.norm(start[:, :3], axis=1))
    largest = np.zeros(n)
    np.maximum.at(largest, own, np.linalg.norm(values[:, :3], axis=1))
    return value, start, np.where(some, largest, peak)


def _means(group: Ints, at: Floats, values: Floats, groups: int) -> tuple[Ints, Floats, Floats]:
    """Of each group: how many samples, and the means of their places (groups,) and values (groups, 6); 0 of none."""
    count = np.bincount(group, minlength=groups)
    safe = np.maximum(count, 1)
    centre = np.bincount(group, at, groups) / safe
    mean = np.stack([np.bincount(group, channel, groups) for channel in values.T], axis=1) / safe[:, None]
    return count, centre, mean


def _told(
    table: Table,
    place: Floats,
    channels: Floats,
    owner: Ints,
    within: Bools,
    spacing: float,
    scale: Scale,
    found: Stated,
    toolpath: Toolpath,
    program: str,
) -> list[Finding]:
    rows = scale.cutting
    if not len(rows):
        return []
    findings = []
    count = np.bincount(owner[within], minlength=len(toolpath))
    empty = rows[count[rows] == 0]
    if len(empty):
        what = f"motions without a sample of their own, taken between the samples around them: {len(empty)}"
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

    uneven, deviation = _uneven(place, channels, owner, within, scale, found)
    if len(uneven):
        worst = uneven[np.argmax(deviation)]
        what = (
            f"motions along which the force does not change evenly: {len(uneven)}; it is up to {deviation.max():.0f} N "
            f"from the line that stands for it (line {toolpath.line[worst]})"
        )
        help = "a cut that begins or ends within a motion needs a point there"
        findings.append(Finding("FRC026", what, program, int(toolpath.line[worst]), help=help))

    size = 0.5 * np.linalg.norm((found.values + found.begin)[:, :3], axis=1)
    peaks = np.zeros(len(toolpath)) if found.peak is None else found.peak
    mean, peak = rows[np.argmax(size[rows])], rows[np.argmax(peaks[rows])]
    what = (
        f"{within.sum()} samples over {len(rows)} motions, {np.median(count[rows]):g} each in the median; largest mean "
        f"force {size[mean]:.0f} N in line {toolpath.line[mean]}, largest peak {peaks[peak]:.0f} N in line "
        f"{toolpath.line[peak]}"
    )
    findings.append(Finding("FRC029", what, str(table.path)))
    return findings


def _uneven(
    place: Floats, channels: Floats, owner: Ints, within: Bools, scale: Scale, found: Stated
) -> tuple[Ints, Floats]:
    """Motions (M,) whose mean force in one of four parts is off the line [N], by more than its scatter explains."""
    inside = np.flatnonzero(within & ~scale.air[owner])
    own, at = owner[inside], place[inside]
    length = (scale.end - scale.begin)[own]
    share = (at - scale.begin[own]) / np.where(length > 0, length, 1.0)
    line = (1 - share)[:, None] * found.begin[own, :3] + share[:, None] * found.values[own, :3]
    off = channels[inside, :3] - line
    part = 4 * own + np.minimum(4 * share, 3).astype(np.int64)
    count, _, mean = _means(part, at, off, 4 * len(scale.end))
    _, _, square = _means(part, at, off**2, 4 * len(scale.end))
    scatter = np.sqrt(np.maximum(square - mean**2, 0).sum(axis=1) / np.maximum(count - 1, 1))
    distance = np.linalg.norm(mean, axis=1)
    largest = np.linalg.norm(found.values[:, :3], axis=1).max(initial=0.0)
    clear = (count >= FEW) & (distance > 2 * JUMP_OF_LARGEST * largest) & (distance > 4 * scatter)
    worst = np.where(clear, distance, 0.0).reshape(-1, 4).max(axis=1)
    rows = np.flatnonzero(worst > 0)
    return rows, worst[rows]
