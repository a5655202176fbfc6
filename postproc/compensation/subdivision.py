"""The motions of the output: those of the program, and what is inserted between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.dataclass import dataclass
from postproc.base.findings import Finding
from postproc.base.geometry import Placed, PoseRows
from postproc.base.units import MM
from postproc.compensation.desired_path import start_poses
from postproc.compensation.path_error import PathSegments
from postproc.compensation.problem import CompensationProblem
from postproc.toolpath import Role


@dataclass(frozen=True)
class Limits:
    """What may be inserted.  keep: nothing; min_segment [m]: no segment is shorter, nor than what the tool moves in
    ``cycle`` [s], an interpolation cycle of the controller; max_growth: the output has at most so many times the
    motions of the input, or ``least`` more than that has; ramp_end [m]: where a ramp ends a point may be as near to
    another as this."""

    no_insert: bool = False
    min_segment: float = 1.0 * MM
    max_growth: float = 2.0
    cycle: float = 0.0
    least: int = 0
    ramp_end: float = 1.0 * MM

    def inserted(self, count: int) -> int:
        """Motions that may be inserted into a program of ``count``."""
        return max(int(self.max_growth * count) - count, self.least)


@dataclass(frozen=True)
class CornerFits:
    """Approximated corners whose points were moved, so that the rounded path follows that of the original.  point (P,):
    motions of the output that end in such points: the tool is not there; corner (P,): the motion among them at whose
    end the corner itself is; before (P,): the error there without, in parts of the allowed one; inserted
    (P,): so many points on a ramp of the force, 0 of other corners."""

    point: Ints
    corner: Ints
    before: Floats
    inserted: Ints


@dataclass(frozen=True)
class Subdivision:
    """M motions of the output for the N of the input, see ``Plan``.

    source, role (M,); share (M,): of the source's path, where the motion ends; command (M): TCP poses in the robot
    base, NaN where a target is not known; centre, normal (M, 3), sweep (M,): corrected arcs in the robot base, NaN for
    all others; moved (M,): the motion is another than in the input.  not_refined: rows that cannot be corrected after
    all, and why.  lead_ins (L,): motions in air of the input that end where the cut after them starts corrected.
    blend (M,) [m]: of each motion as in a Toolpath, where it was written.  fits: corners that were fitted.
    """

    source: Ints
    role: Ints
    share: Floats
    command: Placed
    centre: Floats
    normal: Floats
    sweep: Floats
    moved: Bools
    findings: tuple[Finding, ...] = ()
    not_refined: Mapping[int, Finding] = field(default_factory=dict)
    lead_ins: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    blend: Floats | None = None
    fits: CornerFits | None = None

    def __len__(self) -> int:
        return len(self.source)

    @cached_property
    def original(self) -> Bools:
        """(N,) the row is a motion of the program."""
        return np.asarray(self.role == Role.ORIGINAL)

    @cached_property
    def original_command(self) -> PoseRows:
        """(N) where the motions of the input end."""
        own = np.flatnonzero(self.original)
        return PoseRows(len(own), lambda rows: self.command[own[rows]])

    @cached_property
    def transitions(self) -> Bools:
        """(N,) the row is a transition move."""
        return np.asarray(self.role == Role.TRANSITION)

    @property
    def inserted(self) -> int:
        return int(np.sum(self.role != Role.ORIGINAL))


def subdivided_motions(task: CompensationProblem, division: Subdivision, motions: Ints) -> PathSegments:
    """Some ``motions`` (K,) of a division as the controller makes them, transition moves among them."""
    source = division.source[motions]
    robot, track = task.model.robot, task.track
    start = start_poses(division.original_command, task.toolpath, task.tool, robot, track, task.external)[
        source
    ]
    first = np.zeros(len(motions))
    inner = np.flatnonzero((motions > 0) & (division.source[motions - 1] == source))
    start.put(inner, division.command[motions[inner] - 1])
    first[inner] = division.share[motions[inner] - 1]
    return PathSegments(
        source,
        first,
        division.share[motions],
        start,
        division.command[motions],
        division.centre[motions],
        division.normal[motions],
        division.sweep[motions],
    )
