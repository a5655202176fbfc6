"""What is reported of a program as it was read: of its text, and of stated configurations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal, Topic
from postproc.base.units import DEG, MM
from postproc.cell import Cell
from postproc.languages.dialect import Program
from postproc.robot.axis_track import AxisTrack, branch_matches
from postproc.robot.description import Robot
from postproc.robot.makers import maker_of
from postproc.toolpath import Kind, Toolpath
from postproc.workflows.machine_vectors import MESSAGE

FASTEST = 100.0
"""[m/s] Feeds above it are written in another unit, or mistyped: points that the controller runs without slowing are
farther apart than any cut is long."""


def reader_findings(program: Program, path: Toolpath) -> list[Finding]:
    """The findings of the reader, but for the external axes: what they carry, the cell has stated by now; and the
    motions at which one of them is not known, or the orientation is in axes of the machine.

    Raises Refusal FIL015 where a motion states a feed that no machine has.
    """
    _refuse_impossible_feeds(path, program.documents[0].path)
    findings = [finding for finding in program.findings if finding.topic is not Topic.EXTERNAL_AXES]
    refused = path.constraints.refused.values()
    for lost in (
        [finding for finding in refused if finding.code == "EXT004"],
        [finding for finding in refused if finding.message == MESSAGE],
    ):
        if lost:
            more = f" ({len(lost)} motions)" if len(lost) > 1 else ""
            findings.append(replace(lost[0], message=lost[0].message + more))
    return findings


def _refuse_impossible_feeds(path: Toolpath, file: Path) -> None:
    beyond = np.flatnonzero((path.feed > FASTEST) & ~path.inverse_time_feed)
    if len(beyond):
        feed = f"the feed is {float(path.feed[beyond[0]]):g} m/s ({len(beyond)} motions)"
        message = f"{feed}; no machine is faster than {FASTEST:g} m/s"
        raise Refusal(Finding("FIL015", message, str(file), int(path.line[beyond[0]])))


def start_findings(cell: Cell, robot: Robot, start: Floats | None) -> list[Finding]:
    """CEL014 where the cell's start (n,) [rad, m] is beyond the limit of an axis: no program begins there."""
    if start is None or not cell.start_line:
        return []
    low, high = robot.limits.T
    beyond = np.flatnonzero((start < low - 1e-9) | (start > high + 1e-9))
    if not len(beyond):
        return []
    joint = robot.joints[beyond[0]]
    unit, word = (DEG, "deg") if joint.kind == "revolute" else (MM, "mm")
    value, *ends = (float(one[beyond[0]] / unit) + 0.0 for one in (start, low, high))
    message = f"start: {joint.name} is {value:g} {word}, and its limits are {ends[0]:g} .. {ends[1]:g} {word}"
    return [Finding("CEL014", message, str(cell.path), cell.start_line)]


def configuration_findings(program: Path, path: Toolpath, track: AxisTrack) -> list[Finding]:
    """Where the stated configuration of a motion and the axes that bring the robot there disagree (KIN007, KIN013)."""
    # A path motion keeps the branch that the robot is in, whatever its target states.
    elsewhere = ~branch_matches(path, track) & path.known & np.isin(path.kind, (Kind.LIN, Kind.CIRC))
    turned = ~track.turn_matches
    maker = maker_of(path.configuration)
    has_quadrants = bool(maker.quadrant_message)
    findings = []
    for code, mask, message in (
        ("KIN007", turned & (not has_quadrants), maker.turn_message),
        ("KIN013", turned & has_quadrants & ~elsewhere, maker.turn_message),
        (
            "KIN007",
            elsewhere,
            f"the stated configuration ({maker.branch_word}) is not the one in which the robot reaches this pose",
        ),
    ):
        rows = np.flatnonzero(mask)
        if len(rows):
            more = f" ({len(rows)} motions, to line {path.line[rows[-1]]})" if len(rows) > 1 else ""
            findings.append(Finding(code, message + more, str(program), int(path.line[rows[0]])))
    return findings
