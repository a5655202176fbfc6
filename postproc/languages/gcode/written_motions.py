"""The motions of a plan that are written at a time, with what the program says of them."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.dataclass import dataclass
from postproc.languages.dialect import Plan, Program, Role, WritingSettings
from postproc.languages.gcode.source_map import SourceMapPart
from postproc.languages.gcode.writer_text import ProgrammedWords, stated


@dataclass(frozen=True, eq=False)
class SourcePath:
    """Rows of a Toolpath: kind, base, sweep (N,), position, centre (N, 3), rotation (N, 3, 3), as there."""

    kind: Ints
    base: Ints
    position: Floats
    rotation: Floats
    centre: Floats
    sweep: Floats


@dataclass(frozen=True, eq=False)
class PlannedMotions:
    """Motions of a plan: position, centre, normal (M, 3), rotation (M, 3, 3), sweep, share (M,), as there; before (3,):
    where the one ahead of them ends."""

    position: Floats
    rotation: Floats
    centre: Floats
    normal: Floats
    sweep: Floats
    share: Floats
    before: Floats


@dataclass(frozen=True, eq=False)
class WrittenMotions:
    """M motions of a plan, and the rows that they stem from with the one ahead and the one after them.

    first: number of row 0 in the program; row (M,); last: the row after them, -1 where there is none; role, own,
    is_transition (M,): of the plan; fixed (M,): the block must stay as it is.
    """

    places: SourceMapPart
    text: ProgrammedWords
    path: SourcePath
    plan: PlannedMotions
    first: int
    row: Ints
    last: int
    role: Ints
    own: Bools
    is_transition: Bools
    fixed: Bools

    def __len__(self) -> int:
        return len(self.row)

    @staticmethod
    def of(
        program: Program, plan: Plan, writing: WritingSettings, start: int, stop: int, refused: Bools
    ) -> WrittenMotions:
        """The motions of the rows start .. stop - 1; ``refused`` (N,): rows that stay."""
        path = program.toolpath
        first, behind = max(start - 1, 0), min(stop + 1, len(path))
        places = program.text.part(first, behind)
        low, high = np.searchsorted(plan.source, [start, stop]).tolist()
        rows, motions = slice(first, behind), slice(low, high)
        before = plan.position[low - 1 : low][0] if low else np.full(3, np.nan)
        here = PlannedMotions(
            plan.position[motions],
            plan.rotation[motions],
            plan.centre[motions],
            plan.normal[motions],
            plan.sweep[motions],
            plan.share[motions],
            before,
        )
        row, role = plan.source[motions] - first, plan.role[motions]
        return WrittenMotions(
            places,
            stated(places, writing),
            SourcePath(
                path.kind[rows],
                path.base[rows],
                path.position[rows],
                path.rotation[rows],
                path.arcs.centre[rows],
                path.arcs.sweep[rows],
            ),
            here,
            first,
            row,
            stop - first if behind > stop else -1,
            role,
            role == Role.ORIGINAL,
            role == Role.TRANSITION,
            refused[rows][row] | np.isnan(here.position[:, 0]),
        )
