"""What is checked of an output before it may exist: what was read back from its own bytes is what was meant, motion by
motion, in its own line, and no prediction from its digits is worse than what was there before."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Iterable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, FewRows, Floats, Ints, is_shared
from postproc.base.batches import blocks, each_block, in_blocks
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses, lengths, on_arc, turn_between
from postproc.base.units import DEG, MM
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision
from postproc.languages.dialect import MARK, Plan, Program, Role, WritingSettings
from postproc.toolpath import Annotation, FrameRef, Kind, OrientationPath, Toolpath, external_at

FAR = 2.5
"""Written steps by which the middle of an arc may be elsewhere than meant: its centre is rounded as well."""

HALF = 0.5001
"""Written steps by which a number may be elsewhere than meant."""


def intended_motions(
    task: CompensationProblem, division: Subdivision, moved: Bools, rows: Ints | slice
) -> Plan:
    """The motions ``rows`` (K,) of a division in the programmed bases; those that are not ``moved`` (M,) as the program
    has them."""
    path, source, moved = task.toolpath, division.source[rows], moved[rows]
    to_base = task.base.shared(source).inverse()
    command = to_base @ division.command[rows]
    # What is inserted has the orientation of its own place, if words state it.
    inserted = division.role[rows] != Role.ORIGINAL
    turned = moved & (
        path.constraints.orientation_programmed[source]
        | (inserted & (path.orientation_control.path[source] != 0))
    )
    arc, unchanged = np.isfinite(division.sweep[rows]), ~moved & ~division.transitions[rows]
    at, stays = np.flatnonzero(arc), np.flatnonzero(unchanged & ~arc)
    two = at.repeat(2) if len(at) == 1 else at  # one row alone is rounded otherwise
    numbers = two + rows.start if isinstance(rows, slice) else rows[two]
    own = task.base.shared(source[two]).inverse()
    centre = (own @ Poses(np.eye(3), division.centre[numbers])).position
    normal = (own.rotation @ division.normal[numbers][..., None])[..., 0]

    def select_arc(new: Floats, old: Floats | FewRows) -> Floats:
        values = np.full((len(source), *new.shape[1:]), np.nan)
        values[stays], values[at] = old[source[stays]], new[: len(at)]
        return values

    return Plan(
        source,
        division.role[rows],
        np.where(moved[:, None], command.position, path.position[source]),
        np.where(turned[:, None, None], command.rotation, path.programmed_rotation[source]),
        select_arc(centre, path.arcs.centre),
        select_arc(normal, path.arcs.normal),
        select_arc(division.sweep[numbers], path.arcs.sweep),
        approximated_motions(task, division, rows),
        division.share[rows],
    )


def approximated_motions(task: CompensationProblem, division: Subdivision, rows: Ints | slice) -> Bools:
    """(K,) inserted motions of ``rows`` (K,) at whose end nothing may stop: parts of paths, and links between two
    motions under force."""
    source, role = division.source[rows], division.role[rows]
    within = task.carries[source] & task.carries[np.maximum(source - 1, 0)] & (source > 0)
    return np.asarray((role == Role.INTERMEDIATE) | ((role == Role.TRANSITION) & within))


def check_readback(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision,
    program: Program,
    again: Program,
    back: Toolpath,
    writing: WritingSettings,
) -> None:
    """The program read back, ``again`` with its motions ``back``, is the one that was meant: the motions of
    ``division``, of which those that ``result`` does not correct are where ``program`` has them.  Raises Refusal
    FIL008."""
    path, file = task.toolpath, program.documents[0].path.name
    if len(back) != len(division):
        raise Refusal(
            Finding("FIL008", f"{len(division)} motions are planned, {len(back)} are read back", file)
        )
    place = np.flatnonzero(division.original)
    if set(back.constraints.refused) != {int(place[row]) for row in program.toolpath.constraints.refused}:
        raise Refusal(Finding("FIL008", "other motions than before are not understood", file))
    _check_frames(path, back, file)
    lines = _LineCheck(path, division, program, again)
    for one, other in ((path.annotations, back.annotations), (path.comments, back.comments)):
        lines.check_comments(one, other)
    moved = result.corrected[division.source] | division.transitions
    moved[np.flatnonzero(division.original)[division.lead_ins]] = True

    def check_block(rows: slice) -> None:
        plan = intended_motions(task, division, moved, rows)
        lines.check_motions(back, rows)
        _check_texts(path, back, plan, rows, file)
        _check_external(path, back, division, rows, writing, file)
        _check_targets(path, back, plan, rows, writing, file)

    each_block(check_block, len(division))
    _check_arcs(task, division, moved, back, 10.0**-writing.mm, file)


def _check_frames(path: Toolpath, back: Toolpath, file: str) -> None:
    """The frames that the program states are the same."""
    if len(path.frames) != len(back.frames):
        raise Refusal(Finding("FIL008", "other frames than before are set", file))
    for one, other in zip(path.frames, back.frames, strict=True):
        if not _same_frame(one, other):
            raise Refusal(Finding("FIL008", "a frame differs from the program", file, one.line))


def _same_frame(one: FrameRef, other: FrameRef) -> bool:
    if (one.number, one.entry, one.components) != (other.number, other.entry, other.components):
        return False
    poses = [frame.pose if frame.in_entry is None else frame.in_entry[1] for frame in (one, other)]
    if poses[0] is None or poses[1] is None:
        return poses[0] is poses[1]
    pairs = (poses[0].position, poses[1].position), (poses[0].rotation, poses[1].rotation)
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


class _LineCheck:
    """Where the lines of a program are in the output: after those that were inserted, one for each motion, and after
    the mark."""

    def __init__(self, path: Toolpath, division: Subdivision, program: Program, again: Program) -> None:
        self.path, self.division, self.file = path, division, program.documents[0].path.name
        # Lines before which something is inserted, once for each of it.
        self.inserted = np.sort(path.inserted_before[division.source[~division.original]])
        before, after = program.documents[0], again.documents[0]
        marked = program.marker is None and again.marker is not None
        more = (again.edit_syntax.points[0] or len(after.line_starts)) - (
            program.edit_syntax.points[0] or len(before.line_starts)
        )
        if more != len(self.inserted) + marked:
            words = f"{len(self.inserted)} inserted motions occupy {more - marked} lines"
            raise Refusal(Finding("FIL008", words, self.file))
        self.mark = _line_after_mark(program) if marked else int(np.iinfo(np.int32).max)

    def _moved(self, line: Ints, side: Literal["left", "right"]) -> Ints:
        """(K,) where lines (K,) are, before ("left") or after ("right") what is inserted there."""
        return np.asarray(line + (line >= self.mark) + np.searchsorted(self.inserted, line, side))

    def check_motions(self, back: Toolpath, rows: slice) -> None:
        """Each motion is in its own line, and what is inserted in lines right before it."""
        start = max(rows.start - 1, 0)
        source, there = self.division.source[start : rows.stop], back.line[start : rows.stop]
        line = self.path.line[source]
        first = self._moved(line, "left")
        last = self._moved(line, "right") if len(self.inserted) else first
        above = self.path.inserted_before[source]
        if self.path.constraints.spline_headers:
            added = ~self.division.original[start : rows.stop]
            first = np.where(added, self._moved(above, "left"), first)
            last = np.where(added, self._moved(above, "right"), last)
        wrong = (there < first) | (there > last)
        wrong[1:] |= (source[1:] == source[:-1]) & (there[1:] != there[:-1] + 1) & (above == line)[1:]
        if wrong.any():
            words = "a motion is not in its own line"
            raise Refusal(Finding("FIL008", words, self.file, int(line[np.argmax(wrong)])))

    def check_comments(self, one: tuple[Annotation, ...], other: tuple[Annotation, ...]) -> None:
        """Comments are as they were, and in their lines; the mark is none."""
        before, after = (_without_mark(comments) for comments in (one, other))
        lines = [np.array([comment.line for comment in part], np.int64) for part in (before, after)]
        texts = [[comment.text for comment in part] for part in (before, after)]
        if texts[0] != texts[1] or not np.array_equal(self._moved(lines[0], "right"), lines[1]):
            raise Refusal(Finding("FIL008", "comments differ from the program", self.file))


def _without_mark(comments: tuple[Annotation, ...]) -> list[Annotation]:
    return [comment for comment in comments if not comment.text.startswith(MARK)]


def _line_after_mark(program: Program) -> int:
    """The first line of the program that the mark's own line comes before."""
    document, at = program.documents[0], program.marker_at.start
    line, _ = document.place(at)
    head = document.raw[:at]
    return line if head in (b"", BOM_UTF8) or head.endswith(b"\n") else line + 1


def _stated(path: Toolpath, configuration: Iterable[str]) -> dict[str, NDArray[Any] | FewRows]:
    """Name -> column (N, ...) of what a motion states beside its target; ``configuration``: names of its numbers."""
    return {
        "base": path.base,
        "tool": path.tool,
        "kind": path.kind,
        **{name: path.configuration[name] for name in configuration},
        "axes": path.axes,
        "inverse time feed": path.inverse_time_feed,
        "approximation": path.approximation,
        "stops": path.stops,
        "orientation programmed": path.constraints.orientation_programmed,
        "continues": path.continues,
        "feed": path.feed,
    }


def _check_texts(path: Toolpath, back: Toolpath, plan: Plan, rows: slice, file: str) -> None:
    """What a motion states beside its target."""
    source, own, transition = plan.source, plan.own, plan.role == Role.TRANSITION
    every = np.ones(len(source), np.bool_)
    single_axis = path.orientation_control.path[source] == OrientationPath.SINGLE_AXIS
    checked = {
        "base": every,
        "tool": every,
        "kind": ~transition,
        "orientation programmed": own & single_axis,
        "feed": (path.kind[source] != Kind.PTP) & ~path.inverse_time_feed[source],
    }
    numbers = dict.fromkeys((*path.configuration.numbers, *back.configuration.numbers))
    again = _stated(back, numbers)
    for name, column in _stated(path, numbers).items():
        before, after = column[source], again[name][rows]
        same = (before == after) | ((before != before) & (after != after))
        wrong = ~same.reshape(len(source), -1).all(axis=1) & checked.get(name, own)
        if wrong.any():
            line = int(path.line[source[np.argmax(wrong)]])
            words = f"the {name} of a motion differs from the plan"
            raise Refusal(Finding("FIL008", words, file, line))
    halts = plan.flows & back.stops[rows] & ~path.stops[source]
    if halts.any():
        line = int(path.line[source[np.argmax(halts)]])
        raise Refusal(Finding("FIL008", "an inserted motion stops where the program does not", file, line))
    if (back.kind[rows][transition] != Kind.LIN).any():
        raise Refusal(Finding("FIL008", "a transition move is not a straight motion", file))


def _check_external(
    path: Toolpath, back: Toolpath, division: Subdivision, rows: slice, writing: WritingSettings, file: str
) -> None:
    """External axes are where the program has them, and along the path of a motion that was divided at its share."""
    moves = not (is_shared(path.external) and is_shared(back.external))
    if not moves and np.array_equal(path.external[:1], back.external[:1], equal_nan=True):
        return
    source, own = division.source[rows], division.original[rows]
    actual, end = back.external[rows], path.external[source]
    same = (actual == end) | (np.isnan(actual) & np.isnan(end))
    wanted = external_at(path, source, division.share[rows])
    with np.errstate(invalid="ignore"):
        near = np.abs(actual - wanted) <= HALF * 10.0**-writing.mm
    wrong = np.where(own[:, None], ~same, np.isfinite(wanted) & ~near).any(axis=1)
    if wrong.any():
        line = int(path.line[source[np.argmax(wrong)]])
        raise Refusal(Finding("FIL008", "the place of an external axis differs from the plan", file, line))


def _check_targets(
    path: Toolpath, back: Toolpath, plan: Plan, rows: slice, writing: WritingSettings, file: str
) -> None:
    for actual, wanted in ((back.position[rows], plan.position[:]), (back.rotation[rows], plan.rotation[:])):
        if not np.array_equal(np.isfinite(actual), np.isfinite(wanted)):
            raise Refusal(Finding("FIL008", "the known targets differ from the plan", file))
    # Half a written step a coordinate; three angles add up, and where CA ends an arc the rounding of its start does.
    step_mm, step_deg = 10.0**-writing.mm, 10.0**-writing.deg
    off = np.abs(back.position[rows] - plan.position[:]).max(axis=1) / MM
    # Rotary axes state the whole orientation that is meant, though the turn about the tool is free: no axis swings.
    by_axes = path.orientation_control.path[plan.source] == OrientationPath.ROTARY_AXES
    redundant_axis = np.where(by_axes[:, None], np.nan, path.orientation_control.redundant_axis[plan.source])
    angle = _angle(plan.rotation[:], back.rotation[rows], redundant_axis) / DEG
    most = np.where(path.kind[plan.source] == Kind.CIRC, 2 * HALF, HALF) * step_mm
    _close(off > most, off, path, plan.source, file, "mm off the plan")
    _close(angle > 3 * HALF * step_deg, angle, path, plan.source, file, "deg off the plan")


def _check_arcs(
    task: CompensationProblem, division: Subdivision, moved: Bools, back: Toolpath, step_mm: float, file: str
) -> None:
    path, source = task.toolpath, division.source
    unchanged = ~moved & ~division.transitions
    arc = np.isfinite(division.sweep) | (unchanged & np.isfinite(path.arcs.sweep[source]))
    if not np.array_equal(np.isfinite(back.arcs.sweep), arc):
        raise Refusal(Finding("FIL008", "the arcs differ from the plan", file))
    for rows in blocks(len(division)) if arc.any() else ():
        start = max(rows.start - 1, 0)
        plan = intended_motions(task, division, moved, slice(start, rows.stop))
        at = np.flatnonzero(np.isfinite(plan.sweep))
        at = at[(at > 0) & (plan.source[at] > 0)]
        at = at[np.isfinite(plan.position[at - 1, 0])]
        if not len(at):
            continue
        there, half = at + start, np.full(len(at), 0.5)
        one, other = (
            on_arc(p.position[k - 1], p.position[k], arcs.centre[k], arcs.normal[k], arcs.sweep[k], half)
            for p, arcs, k in ((plan, plan, at), (back, back.arcs, there))
        )
        off = np.abs(other - one).max(axis=1) / MM
        _close(off > FAR * step_mm, off, path, plan.source[at], file, "mm off the planned arc")


def check_residual(
    task: CompensationProblem,
    planned: CorrectionResult,
    result: CorrectionResult,
    division: Subdivision,
    writing: WritingSettings,
    file: str,
) -> None:
    """The corrections as written, of ``result`` and of ``division``, are those that were ``planned``, and
    bring no motion further off.  Raises Refusal FIL008, or COR002 where one is larger than the cell allows."""
    path, corrected = task.toolpath, result.corrected
    step = 3**0.5 * HALF * 10.0**-writing.mm * MM
    off = np.linalg.norm(result.correction - planned.correction, axis=1)
    _refuse(path, corrected & ~(off <= step), off / MM, "a correction is {:.6f} mm off the plan", file)
    size = np.linalg.norm(result.correction, axis=1)
    _refuse_large(task, np.where(corrected, size, 0.0), path.line, step, file)
    added = np.flatnonzero(division.moved & ~(division.original & corrected[division.source]))
    rows = division.source[added]
    sizes = [size[:0], *in_blocks(lambda part: _added(task, division, added[part]), len(added))]
    _refuse_large(task, np.concatenate(sizes), path.line[rows], step, file)
    passed = corrected.copy()
    if (
        division.fits is not None
    ):  # the tool is beside these points: ``corners_not_improved`` compares the paths
        own = division.fits.point[division.original[division.fits.point]]
        passed[division.source[own]] = False
    # where the robot had no equilibrium before, nothing is further off
    before, before_angle = (np.nan_to_num(a, nan=np.inf) for a in (result.before, result.before_angle))
    worse = passed & ~(result.after <= before + task.tolerance)
    _refuse(
        path,
        worse,
        result.after / MM,
        "with the written digits the tool is {:.4f} mm off, further than without the correction",
        file,
    )
    worse = (
        passed
        & path.constraints.orientation_programmed
        & ~(result.after_angle <= before_angle + task.tolerance_angle)
    )
    _refuse(
        path,
        worse,
        result.after_angle / DEG,
        "with the written digits the tool is {:.4f} deg off, further than without the correction",
        file,
    )


def _added(task: CompensationProblem, division: Subdivision, motions: Ints) -> Floats:
    """(K,) [m] how far inserted ``motions`` (K,) lead from their places of the wanted paths."""
    rows, own = division.source[motions], division.original[motions]
    wanted = task.wanted[rows].position.copy()
    wanted[~own] = task.desired_path.at(rows[~own], division.share[motions[~own]]).position
    return np.asarray(np.linalg.norm(division.command[motions].position - wanted, axis=1))


def _refuse_large(task: CompensationProblem, size: Floats, line: Ints, step: float, file: str) -> None:
    """``size`` (K,) [m] of corrections in ``line`` (K,)."""
    wrong = ~(size <= task.max_correction + step)
    if wrong.any():
        worst = int(np.argmax(np.where(wrong, np.nan_to_num(size, nan=np.inf), 0.0)))
        message = (
            f"with the written digits a correction is {size[worst] / MM:.2f} mm and exceeds max_correction"
            f" ({task.max_correction / MM:g} mm)"
        )
        help = "check force, base and tool; raise max_correction in the cell if the correction is intended"
        raise Refusal(Finding("COR002", message, file, int(line[worst]), help=help))


def _refuse(path: Toolpath, wrong: Bools, size: Floats, words: str, file: str) -> None:
    if wrong.any():
        worst = int(np.argmax(np.where(wrong, np.nan_to_num(size, nan=np.inf), -1.0)))
        raise Refusal(Finding("FIL008", words.format(size[worst]), file, int(path.line[worst])))


def _close(wrong: Bools, off: Floats, path: Toolpath, source: Ints, file: str, words: str) -> None:
    if wrong.any():
        row = int(np.argmax(wrong))
        line = int(path.line[int(source[row])])
        raise Refusal(Finding("FIL008", f"a target is {off[row]:.6f} {words}", file, line))


def _angle(one: Floats, other: Floats, redundant_axis: Floats) -> Floats:
    """(M,) [rad] between rotations, where an axis is free between its directions; 0 where one is not known."""
    known = np.isfinite(one[:, 0, 0]) & np.isfinite(other[:, 0, 0])
    if not known.all():
        one, other = (np.where(known[:, None, None], rotation, np.eye(3)) for rotation in (one, other))
    # in the turned axes: one^T other
    vectors = turn_between(np.swapaxes(other, -1, -2), np.swapaxes(one, -1, -2))
    axis = np.nan_to_num(redundant_axis)
    return lengths(vectors - np.sum(vectors * axis, axis=1, keepdims=True) * axis)
