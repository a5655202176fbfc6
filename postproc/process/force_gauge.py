"""What a force gauge may do wrong: an offset, which shows in air, and channels that hit their rail."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.tables import CsvTable
from postproc.process.stated_forces import CHANNELS

SEEN = 0.02
"""An offset above this share of the largest reading is reported, where it is clear of the scatter."""

RUN = 4
"""Equal readings in a row, at the largest or smallest of all, that make a rail: this many times as many as the channel
has anywhere else (coarse steps stand still for a while at every crest)."""

VALUES = 10
"""A channel with fewer different readings states nothing of rails: it is no measured one."""


def checked_gauge(
    table: CsvTable, channels: Floats, in_air: Bools, offset: bool, findings: list[Finding]
) -> Floats:
    """The readings (M, 6), ``channels`` (M, 6) [N, N m] without the mean of those ``in_air`` (M,) where ``offset`` asks
    for it.

    Reports offset and rails.  Refusal FRC020 where an offset is to be taken off and nothing is in air.
    """
    findings += _rails(table, channels)
    if not np.any(in_air):
        if offset:
            raise Refusal(
                Finding(
                    "FRC020",
                    "no reading of this log is in air, so its offset is not observable",
                    str(table.path),
                    help="record the log from before the cut on; mark moves in air with FORCE OFF in the program",
                )
            )
        return channels
    air = channels[in_air]
    mean = air.mean(axis=0)
    words = ", ".join(f"{name} {value:.3g}" for name, value in zip(CHANNELS, mean, strict=True) if value != 0)
    if offset:
        what = f"the mean of {len(air)} readings in air is subtracted: {words or 'none'} (N, N m)"
        findings.append(Finding("FRC022", what, str(table.path)))
        return np.asarray(channels - mean)
    error = air.std(axis=0) / np.sqrt(len(air))
    scale = np.repeat(np.abs(channels).reshape(-1, 2, 3).max(axis=(0, 2)), 3)
    if np.any((np.abs(mean) > SEEN * scale) & (np.abs(mean) > 3 * error)):
        what = f"in air the log shows {words} (N, N m) as the mean of {len(air)} readings"
        row = int(table.lines[np.argmax(in_air)])
        help = "use --tare to subtract it if it is the gauge's offset"
        findings.append(Finding("FRC021", what, str(table.path), row, help=help))
    return channels


def _rails(table: CsvTable, channels: Floats) -> list[Finding]:
    findings = []
    for name, values in zip(CHANNELS, channels.T, strict=True):
        if len(np.unique(values)) < VALUES:
            continue
        edge = np.flatnonzero(
            np.append(True, values[1:] != values[:-1])
        )  # where a run of equal readings starts
        length = np.diff(np.append(edge, len(values)))
        level = values[edge]
        low, high = level.min(), level.max()
        elsewhere = length[(level != low) & (level != high)].max(initial=1)
        for rail in (low, high):
            # readings that rest at 0 are no rail, nor are they where the channel rests at other values as well
            hit = (level == rail) & (length >= RUN * elsewhere) & (rail != 0)
            if np.any(hit):
                first = edge[np.argmax(hit)]
                what = (
                    f"channel {name} stays at {rail:g} in {length[hit].sum()} readings, {length[hit].max()} in a row: "
                    "it is saturated, and the force there is larger"
                )
                findings.append(Finding("FRC023", what, str(table.path), int(table.lines[first])))
    return findings
