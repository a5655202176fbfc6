"""The compensated program as edits on its bytes, read back and checked before it may exist."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc import __version__
from postproc.base.arrays import Floats, Ints, LazyRows, is_shared
from postproc.base.batches import each_block
from postproc.base.document import Document, Edit, Edits, apply, undone
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import PoseRows, Poses
from postproc.base.memory import release_free_memory
from postproc.base.units import DEG, MM
from postproc.cell import Cell
from postproc.compensation.corners import Corners, compare_corners, rounded_errors, with_rounded_ends
from postproc.compensation.correct import CorrectionResult, MotionOutcome, with_residual
from postproc.compensation.path_comparison import Transitions, along_and_across, evaluate_transitions
from postproc.compensation.path_error import path_errors
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision, subdivided_motions
from postproc.languages.dialect import Dialect, Program, ReadingSettings, WritingSettings
from postproc.languages.permitted import refuse_other
from postproc.output.readback_check import (
    approximated_motions,
    check_readback,
    check_residual,
    intended_motions,
)
from postproc.robot.description import Robot
from postproc.toolpath import Plan, Toolpath, external_at


@dataclass(frozen=True)
class IntendedProgram:
    """What is to be written: the corrected motions as they are computed, and the edits that make them of the
    program."""

    task: CompensationProblem
    result: CorrectionResult
    division: Subdivision
    edits: Edits


@dataclass(frozen=True)
class WrittenProgram:
    """``edits`` make the output; ``contents`` are its bytes, a document each; ``result`` has the residual predicted
    from the digits in them, ``division`` the commands as they are in them.

    residual (N,) [m], off_angle (N,) [rad]: the same residuals, from the pose that the gain asks for.
    """

    task: CompensationProblem
    edits: Edits
    contents: tuple[bytes, ...]
    result: CorrectionResult
    division: Subdivision
    residual: Floats
    off_angle: Floats

    @property
    def path_error(self) -> Floats:
        """(M,) [m] the largest distance from the wanted path inside of each corrected motion and of the corner that the
        controller rounds off at its end, where it states from where on; NaN for all others."""
        return self._path_run[0]

    @property
    def between_angle(self) -> Floats:
        """(M,) [rad] the largest angle from the wanted orientation there."""
        return self._path_run[1]

    @property
    def off_between(self) -> Floats:
        """(M,) [m] inside of each motion, not rounded off, from the path that the gain asks for."""
        return self._path_of_gain[0]

    @property
    def off_between_angle(self) -> Floats:
        """(M,) [rad] the angle there."""
        return self._path_of_gain[1]

    @property
    def error_between(self) -> Floats:
        """(M,) [m] as ``path_error``, of other corners than fitted ones as if they were not rounded off."""
        return self._path[0]

    @cached_property
    def _path(self) -> tuple[Floats, Floats]:
        return path_errors_as_written(self.task, self.result, self.division)

    @cached_property
    def _path_run(self) -> tuple[Floats, Floats]:
        errors, angles = (values.copy() for values in self._path)
        corners = self.corners.part(~self.corners.unknown)
        if self.task.gain == 1.0:  # a share of the correction moves corners as it moves the rest
            np.fmax.at(errors, corners.motion, corners.difference)
            np.fmax.at(angles, corners.motion, corners.angle)
        return errors, angles

    @cached_property
    def _path_of_gain(self) -> tuple[Floats, Floats]:
        if self.task.gain == 1.0:
            return self._path
        return path_errors_as_written(self.task, self.result, self.division, 1.0 - self.task.gain)

    @cached_property
    def _before(self) -> tuple[Floats, Floats]:
        return along_and_across(self.task, self.result)

    @property
    def along_before(self) -> Floats:
        """(N,) [m] the error along the feed at the end points without a correction, with its sign."""
        return self._before[0]

    @property
    def across_before(self) -> Floats:
        """(N,) [m] that across the feed."""
        return self._before[1]

    @cached_property
    def corners(self) -> Corners:
        """The corners that the controller rounds off."""
        return compare_corners(self.task, self.result, self.division)

    @cached_property
    def transitions(self) -> Transitions:
        """What the output does where its correction changes."""
        return evaluate_transitions(self.task, self.result, self.division)


def plan_motions(task: CompensationProblem, division: Subdivision) -> Plan:
    """A division in the programmed bases: what a dialect is to write."""
    m = len(division)

    def intended_targets(rows: Ints) -> Poses:
        part = intended_motions(task, division, division.moved, rows)
        return Poses(part.rotation[:], part.position[:])

    target = PoseRows(m, intended_targets).remembered()
    none = np.broadcast_to(np.nan, (m, 3))
    centre, normal, sweep = none, none, none[:, 0]
    if np.isfinite(division.sweep).any() or np.isfinite(task.toolpath.arcs.sweep).any():
        centre, normal, sweep = np.empty((m, 3)), np.empty((m, 3)), np.empty(m)

        def put(rows: slice) -> None:
            part = intended_motions(task, division, division.moved, rows)
            centre[rows], normal[rows], sweep[rows] = part.centre, part.normal, part.sweep

        each_block(put, m)
        for array in (centre, normal, sweep):
            array.setflags(write=False)
    division.share.setflags(write=False)  # taken as it is, not copied
    return Plan(
        division.source,
        division.role,
        LazyRows(m, lambda rows: target[rows].position),
        LazyRows(m, lambda rows: target[rows].rotation),
        centre,
        normal,
        sweep,
        approximated_motions(task, division, slice(None)),
        division.share,
        LazyRows(m, lambda rows: external_at(task.toolpath, division.source[rows], division.share[rows]))
        if not is_shared(task.toolpath.external)
        else None,
    )


def writing_settings(cell: Cell, shared_points: str) -> WritingSettings:
    """Decimals whose rounding stays below a twentieth of the tolerances.

    Raises Refusal COR022 for a tolerance below ``FINEST``.
    """
    sizes = {"tolerance": cell.tolerance / MM, "tolerance_deg": cell.tolerance_angle / DEG}
    fine = [
        Finding(
            "COR022", f"{key}: {size:.3g} is finer than {FINEST:g}, which digits can express", str(cell.path)
        )
        for key, size in sizes.items()
        if size < 0.999 * FINEST
    ]
    if fine:
        raise Refusal(*fine)
    return WritingSettings(_decimals(sizes["tolerance"]), _decimals(sizes["tolerance_deg"]), shared_points)


def edit_program(program: Program, dialect: Dialect, moved: Sequence[Edit], robot: Robot, stem: str) -> Edits:
    """The edits that make the output: those of the motions, with its mark and the module name ``stem``.

    Raises Refusal FIL008 (an edit touches what is no part of a motion), FIL011 (the stem names no program).
    """
    more: list[Edit] = []
    moved = Edits.joined(moved)
    refuse_other(program, moved, dialect.letters)
    if len(moved):
        more.append(dialect.marked(program, _mark(program, robot)))
    main = program.documents[0].path
    if stem != main.stem:
        more += dialect.renamed(program, stem)
    return Edits.joined(sorted(more, key=lambda edit: edit.span), moved)  # these are first, mostly


def write(
    program: Program,
    dialect: Dialect,
    intended: IntendedProgram,
    writing: WritingSettings,
    settings: ReadingSettings,
    completed: Callable[[Toolpath], Toolpath],
) -> WrittenProgram:
    """Turn the edits of ``program`` into the bytes of files, and read them back.

    ``completed``: fills in what a target that was read back inherits from the axis motion before it.
    Raises Refusal FIL008 (what was read back is not what was meant), COR002 (it corrects by more than may be).
    """
    documents, task, result, edits = program.documents, intended.task, intended.result, intended.edits
    contents = edited_contents(documents, edits)
    again = _read_back(documents, contents, dialect, settings)
    back = completed(again.toolpath)
    release_free_memory()
    check_readback(task, result, intended.division, program, again, back, writing)
    release_free_memory()
    there = _as_written(task, intended.division, back)
    written = _with_lead_ins(task, with_residual(task, result, there.original_command), there)
    written = with_rounded_ends(task, written, there)
    written = replace(
        written, turn=np.broadcast_to(np.nan, written.turn.shape)
    )  # it was meant for what is written
    release_free_memory()
    check_residual(task, result, written, there, writing, documents[0].path.name)
    release_free_memory()
    residuals = (
        (written.after, written.after_angle) if task.gain == 1.0 else _beside_uncorrected(task, written)
    )
    return WrittenProgram(task, edits, contents, written, there, *residuals)


def _read_back(
    documents: tuple[Document, ...], contents: tuple[bytes, ...], dialect: Dialect, settings: ReadingSettings
) -> Program:
    pairs = zip(documents, contents, strict=True)
    read = tuple(Document(document.path, raw) for document, raw in pairs)
    return replace(dialect.read(read, replace(settings, places=False)), text=None)


def _with_lead_ins(
    task: CompensationProblem, result: CorrectionResult, division: Subdivision
) -> CorrectionResult:
    """The result with the motions in air that were moved to where a cut starts corrected."""
    rows = division.lead_ins
    if not len(rows):
        return result
    state, correction = result.state.copy(), result.correction.copy()
    state[rows] = MotionOutcome.LEAD_IN
    correction[rows] = result.command[rows].position - task.wanted[rows].position
    return replace(result, state=state, correction=correction)


def _beside_uncorrected(task: CompensationProblem, result: CorrectionResult) -> tuple[Floats, Floats]:
    """(N,) [m] and (N,) [rad] how far the tool is from where the applied share of the correction brings it; NaN
    where nothing is corrected."""
    rows, uncorrected_share = np.flatnonzero(result.corrected), 1.0 - task.gain
    off, angle = np.full((2, len(result.state)), np.nan)

    def fill_distances(part: slice) -> None:
        at = rows[part]
        wanted = task.wanted[at]
        goal = task.goal(at, wanted)
        after, before = (
            task.visible_errors(
                at, task.simulated(at, command, task.wrench[at], corrected=corrected).pose, goal
            )
            for command, corrected in ((result.command[at], True), (wanted, False))
        )
        off[at], angle[at] = (
            np.linalg.norm(now - uncorrected_share * then, axis=1)
            for now, then in zip(after, before, strict=True)
        )

    each_block(fill_distances, len(rows))
    return off, angle


def path_errors_as_written(
    task: CompensationProblem, result: CorrectionResult, division: Subdivision, uncorrected_share: float = 0.0
) -> tuple[Floats, Floats]:
    """(M,) [m] and (M,) [rad] the largest distance from the wanted path, and angle from the wanted orientation, inside
    of each corrected motion under force, NaN for all others.

    ``uncorrected_share``: the share of the error without a correction that is meant to stay.
    """
    errors, angles = np.full((2, len(division)), np.nan)
    source, transitions = division.source, division.transitions
    # in air nothing is cut between the points
    cut = result.corrected & task.desired_path.traceable & task.carries
    chosen = np.flatnonzero(cut[source] & ~transitions)

    def fill_errors(part: slice) -> None:
        some = chosen[part]
        segments = subdivided_motions(task, division, some)
        first = (segments.first == 0.0) & task.steps(segments.rows, result.corrected)
        errors[some], angles[some] = path_errors(task, segments, first, uncorrected_share, shown=True)

    each_block(fill_errors, len(chosen))
    if uncorrected_share == 0.0:
        motions, off, angle = rounded_errors(task, result, division)
        errors[motions], angles[motions] = off, angle
    return errors, angles


def _as_written(task: CompensationProblem, division: Subdivision, back: Toolpath) -> Subdivision:
    """The division with the commands as written."""
    source, base = division.source, task.base

    def command(rows: Ints) -> Poses:
        at = source[rows]
        known = np.isfinite(back.position[rows, 0])
        keeps = np.flatnonzero(~known | task.toolpath.keeps_orientation[at])  # not that of the text
        poses = base.shared(at) @ back.target_in_base[rows]
        if len(keeps):
            wanted, text = task.wanted[at[keeps]], known[keeps]
            poses.rotation[keeps] = wanted.rotation
            poses.position[keeps[~text]] = wanted.position[~text]
        return poses

    there = replace(division, command=PoseRows(len(division), command).remembered(), blend=back.approximation)
    arcs = np.flatnonzero(np.isfinite(division.sweep))
    if not len(arcs):
        return there
    centre, normal, sweep = division.centre.copy(), division.normal.copy(), division.sweep.copy()
    own = base[source[arcs]]
    centre[arcs] = (own @ Poses(np.eye(3), back.arcs.centre[arcs])).position
    normal[arcs] = (own.rotation @ back.arcs.normal[arcs][..., None])[..., 0]
    sweep[arcs] = back.arcs.sweep[arcs]
    return replace(there, centre=centre, normal=normal, sweep=sweep)


FINEST = 1e-6
"""[mm], [deg] A tolerance is not smaller: of positions of meters the numbers of the machine have no more digits, after
a few operations on them."""


def _decimals(tolerance: float) -> int:
    """Decimals whose rounding stays below a twentieth of the tolerance; three at least."""
    return max(3, math.ceil(-math.log10(tolerance / 10)))


def _mark(program: Program, robot: Robot) -> str:
    """States which version, robot file and source the output is from."""
    digests = [document.digest for document in program.documents]
    source = digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()
    return f"{__version__}, robot {robot.name} sha256:{robot.digest[:16]}, source sha256:{source[:16]}"


def edited_contents(documents: tuple[Document, ...], edits: Edits) -> tuple[bytes, ...]:
    """The bytes of every document with its edits.  Raises Refusal FIL008 if another byte changed."""
    contents = []
    for index, document in enumerate(documents):
        own = edits.of(index)
        raw = apply(document, own)
        if not undone(raw, document.raw, own):
            raise Refusal(
                Finding(
                    "FIL008",
                    "the self-check failed: bytes outside the corrections differ from the program",
                    document.path.name,
                )
            )
        contents.append(raw)
    return tuple(contents)
