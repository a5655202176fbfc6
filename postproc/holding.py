"""What an output is held to before it may exist: what was read back from its own bytes is what was meant, motion by
motion, in its own line, and no prediction from its digits is worse than what was there before."""

from __future__ import annotations

from typing import Literal

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.blocks import blocks, each_block, in_blocks
from postproc.compensation.correct import Result
from postproc.compensation.division import Division
from postproc.compensation.task import Task
from postproc.dialects.dialect import Plan, Program, Role, Writing
from postproc.findings import Finding, Refusal
from postproc.geometry import Poses, lengths, on_arc, turn_between
from postproc.toolpath import Annotation, FrameRef, Kind, Toolpath
from postproc.units import DEG, MM

FAR = 2.5
"""Written steps by which the middle of an arc may be elsewhere than meant: its centre is rounded as well."""

HALF = 0.5001
"""Written steps by which a number may be elsewhere than meant."""

MARK = "COMPENSATED by compensate "
"""With which the comment begins that says that a program is compensated."""

BOM = b"\xef\xbb\xbf"


def meant(task: Task, division: Division, moved: Bools, rows: Ints | slice) -> Plan:
    """Some motions of a division in the programmed bases; those that are not ``moved`` (M,) as the program has them."""
    path, source, moved = task.toolpath, division.source[rows], moved[rows]
    to_base = task.base.shared(source).inverse()
    command = to_base @ division.command[rows]
    turned = moved & path.oriented[source]
    arc, kept = np.isfinite(division.sweep[rows]), ~moved & ~division.links[rows]
    centre = (to_base @ Poses(np.eye(3), division.centre[rows])).position
    normal = (to_base.rotation @ division.normal[rows][..., None])[..., 0]

    def way(new: Floats, old: Floats) -> Floats:
        more = (1,) * (new.ndim - 1)
        stays = np.where(kept.reshape(-1, *more), old[source], np.nan)
        return np.where(arc.reshape(-1, *more), new, stays)

    return Plan(
        source,
        division.role[rows],
        np.where(moved[:, None], command.position, path.position[source]),
        np.where(turned[:, None, None], command.rotation, path.rotation[source]),
        way(centre, path.centre),
        way(normal, path.normal),
        way(division.sweep[rows], path.sweep),
    )


def hold(
    task: Task,
    result: Result,
    division: Division,
    program: Program,
    again: Program,
    back: Toolpath,
    writing: Writing,
) -> None:
    """The program read back, ``again`` with its motions ``back``, is the one that was meant: the motions of
    ``division``, of which those that ``result`` does not correct are where ``program`` has them.  Raises Refusal
    FIL008."""
    path, file = task.toolpath, program.documents[0].path.name
    if len(back) != len(division):
        raise Refusal(Finding("FIL008", f"{len(division)} motions became {len(back)}", file))
    place = np.flatnonzero(division.own)
    if set(back.refused) != {int(place[row]) for row in program.toolpath.refused}:
        raise Refusal(Finding("FIL008", "other motions than before are not understood", file))
    _hold_frames(path, back, file)
    lines = _Lines(path, division, program, again)
    for one, other in ((path.annotations, back.annotations), (path.comments, back.comments)):
        lines.hold_comments(one, other)
    moved = result.corrected[division.source] | division.links

    def held(rows: slice) -> None:
        plan = meant(task, division, moved, rows)
        lines.hold_motions(back, rows)
        _hold_texts(path, back, plan, rows, file)
        _hold_targets(path, back, plan, rows, writing, file)

    each_block(held, len(division))
    _hold_arcs(task, division, moved, back, 10.0**-writing.mm, file)


def _hold_frames(path: Toolpath, back: Toolpath, file: str) -> None:
    """The frames that the program says are the same."""
    if len(path.frames) != len(back.frames):
        raise Refusal(Finding("FIL008", "other frames than before are set", file))
    for one, other in zip(path.frames, back.frames, strict=True):
        if not _same_frame(one, other):
            raise Refusal(Finding("FIL008", "a frame changed", file, one.line))


def _same_frame(one: FrameRef, other: FrameRef) -> bool:
    if one.number != other.number or (one.pose is None) != (other.pose is None):
        return False
    if one.pose is None or other.pose is None:
        return True
    pairs = (one.pose.position, other.pose.position), (one.pose.rotation, other.pose.rotation)
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


class _Lines:
    """Where the lines of a program are in the output: behind those that were inserted, one for each motion, and behind
    the mark."""

    def __init__(self, path: Toolpath, division: Division, program: Program, again: Program) -> None:
        self.path, self.division, self.file = path, division, program.documents[0].path.name
        # Lines before which something is inserted, once for each of it.
        self.inserted = np.sort(path.line[division.source[~division.own]])
        before, after = program.documents[0], again.documents[0]
        marked = program.marker is None and again.marker is not None
        more = len(after.line_starts) - len(before.line_starts)
        if more != len(self.inserted) + marked:
            words = f"{len(self.inserted)} inserted motions have {more - marked} lines"
            raise Refusal(Finding("FIL008", words, self.file))
        self.mark = _line_behind_mark(program) if marked else int(np.iinfo(np.int32).max)

    def _moved(self, line: Ints, side: Literal["left", "right"]) -> Ints:
        """(K,) where lines (K,) are, before ("left") or behind ("right") what is inserted there."""
        return np.asarray(line + (line >= self.mark) + np.searchsorted(self.inserted, line, side))

    def hold_motions(self, back: Toolpath, rows: slice) -> None:
        """Each motion stands in its own line, and what is inserted in lines right before it."""
        begin = max(rows.start - 1, 0)
        source, there = self.division.source[begin : rows.stop], back.line[begin : rows.stop]
        line = self.path.line[source]
        first = self._moved(line, "left")
        last = self._moved(line, "right") if len(self.inserted) else first
        wrong = (there < first) | (there > last)
        wrong[1:] |= (source[1:] == source[:-1]) & (there[1:] != there[:-1] + 1)
        if wrong.any():
            words = "a motion is not in its own line"
            raise Refusal(Finding("FIL008", words, self.file, int(line[np.argmax(wrong)])))

    def hold_comments(self, one: tuple[Annotation, ...], other: tuple[Annotation, ...]) -> None:
        """Comments are as they were, and in their lines; the mark is none."""
        before, after = (_without_mark(said) for said in (one, other))
        lines = [np.array([said.line for said in part], np.int64) for part in (before, after)]
        texts = [[said.text for said in part] for part in (before, after)]
        if texts[0] != texts[1] or not np.array_equal(self._moved(lines[0], "right"), lines[1]):
            raise Refusal(Finding("FIL008", "comments changed", self.file))


def _without_mark(said: tuple[Annotation, ...]) -> list[Annotation]:
    return [comment for comment in said if not comment.text.startswith(MARK)]


def _line_behind_mark(program: Program) -> int:
    """The first line of the program that the mark's own line comes before."""
    document, at = program.documents[0], program.marker_at.start
    line, _ = document.place(at)
    head = document.raw[:at]
    return line if head in (b"", BOM) or head.endswith(b"\n") else line + 1


def _hold_texts(path: Toolpath, back: Toolpath, plan: Plan, rows: slice, file: str) -> None:
    """What a motion says beside its target."""
    source, own, link = plan.source, plan.own, plan.role == Role.LINK
    for name, chosen in (
        ("base", ~link | link),
        ("tool", ~link | link),
        ("kind", ~link),
        ("status", own),
        ("turn", own),
        ("axes", own),
        ("timed", own),
        ("blend", own),
        ("oriented", own),
        ("runs", own),
        ("feed", (path.kind[source] != Kind.PTP) & ~path.timed[source]),
    ):
        before, after = getattr(path, name)[source], getattr(back, name)[rows]
        same = (before == after) | ((before != before) & (after != after))
        wrong = ~same.reshape(len(source), -1).all(axis=1) & chosen
        if wrong.any():
            line = int(path.line[source[np.argmax(wrong)]])
            raise Refusal(Finding("FIL008", f"the {name} of a motion changed", file, line))
    if (back.kind[rows][link] != Kind.LIN).any():
        raise Refusal(Finding("FIL008", "a link is no straight motion", file))


def _hold_targets(
    path: Toolpath, back: Toolpath, plan: Plan, rows: slice, writing: Writing, file: str
) -> None:
    for found, wanted in ((back.position[rows], plan.position[:]), (back.rotation[rows], plan.rotation[:])):
        if not np.array_equal(np.isfinite(found), np.isfinite(wanted)):
            raise Refusal(Finding("FIL008", "targets were lost or appeared", file))
    # Half a written step a coordinate; three angles add up, and where CA ends an arc the rounding of its begin does.
    step_mm, step_deg = 10.0**-writing.mm, 10.0**-writing.deg
    off = np.abs(back.position[rows] - plan.position[:]).max(axis=1) / MM
    angle = _angle(plan.rotation[:], back.rotation[rows], path.free_axis[plan.source]) / DEG
    most = np.where(path.kind[plan.source] == Kind.CIRC, 2 * HALF, HALF) * step_mm
    _close(off > most, off, path, plan.source, file, "mm from what was meant")
    _close(angle > 3 * HALF * step_deg, angle, path, plan.source, file, "deg from what was meant")


def _hold_arcs(
    task: Task, division: Division, moved: Bools, back: Toolpath, step_mm: float, file: str
) -> None:
    path, source = task.toolpath, division.source
    kept = ~moved & ~division.links
    arc = np.isfinite(division.sweep) | (kept & np.isfinite(path.sweep[source]))
    if not np.array_equal(np.isfinite(back.sweep), arc):
        raise Refusal(Finding("FIL008", "arcs were lost or appeared", file))
    for rows in blocks(len(division)) if arc.any() else ():
        begin = max(rows.start - 1, 0)
        plan = meant(task, division, moved, slice(begin, rows.stop))
        at = np.flatnonzero(np.isfinite(plan.sweep))
        at = at[(at > 0) & (plan.source[at] > 0)]
        at = at[np.isfinite(plan.position[at - 1, 0])]
        if not len(at):
            continue
        there, half = at + begin, np.full(len(at), 0.5)
        one, other = (
            on_arc(p.position[k - 1], p.position[k], p.centre[k], p.normal[k], p.sweep[k], half)
            for p, k in ((plan, at), (back, there))
        )
        off = np.abs(other - one).max(axis=1) / MM
        _close(off > FAR * step_mm, off, path, plan.source[at], file, "mm from the arc that was meant")


def hold_residual(
    task: Task, planned: Result, result: Result, division: Division, writing: Writing, file: str
) -> None:
    """The corrections that the digits say, of ``result`` and of ``division``, are those that were ``planned``, and
    bring no motion further off.  Raises Refusal FIL008, or COR002 where one is larger than the cell allows."""
    path, corrected = task.toolpath, result.corrected
    step = 3**0.5 * HALF * 10.0**-writing.mm * MM
    off = np.linalg.norm(result.correction - planned.correction, axis=1)
    _refuse(path, corrected & ~(off <= step), off / MM, "a correction is {:.6f} mm from what was meant", file)
    size = np.linalg.norm(result.correction, axis=1)
    _refuse_large(task, np.where(corrected, size, 0.0), path.line, step, file)
    added = np.flatnonzero(~division.own)
    rows = division.source[added]
    sizes = [size[:0], *in_blocks(lambda part: _added(task, division, added[part]), len(added))]
    _refuse_large(task, np.concatenate(sizes), path.line[rows], step, file)
    worse = corrected & ~(result.after <= result.before + task.tolerance)
    _refuse(
        path,
        worse,
        result.after / MM,
        "as written the tool would be {:.4f} mm off, further than before",
        file,
    )
    worse = corrected & path.oriented & ~(result.after_angle <= result.before_angle + task.tolerance_angle)
    _refuse(
        path,
        worse,
        result.after_angle / DEG,
        "as written the tool would be {:.4f} deg off, further than before",
        file,
    )


def _added(task: Task, division: Division, motions: Ints) -> Floats:
    """(K,) [m] how far inserted ``motions`` (K,) lead from their places of the wanted ways."""
    wanted = task.ways.at(division.source[motions], division.share[motions])
    return np.asarray(np.linalg.norm(division.command[motions].position - wanted.position, axis=1))


def _refuse_large(task: Task, size: Floats, line: Ints, step: float, file: str) -> None:
    """``size`` (K,) [m] of corrections in ``line`` (K,)."""
    wrong = ~(size <= task.max_correction + step)
    if wrong.any():
        worst = int(np.argmax(np.where(wrong, np.nan_to_num(size, nan=np.inf), 0.0)))
        message = (
            f"as written a correction is {size[worst] / MM:.2f} mm, more than max_correction"
            f" ({task.max_correction / MM:g} mm)"
        )
        help = "check force, base and tool; if it is meant, raise max_correction in the cell"
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


def _angle(one: Floats, other: Floats, free_axis: Floats) -> Floats:
    """(M,) [rad] between rotations, where an axis is free between its directions; 0 where one is not known."""
    known = np.isfinite(one[:, 0, 0]) & np.isfinite(other[:, 0, 0])
    if not known.all():
        one, other = (np.where(known[:, None, None], rotation, np.eye(3)) for rotation in (one, other))
    # in the turned axes: one^T other
    vectors = turn_between(np.swapaxes(other, -1, -2), np.swapaxes(one, -1, -2))
    axis = np.nan_to_num(free_axis)
    return lengths(vectors - np.sum(vectors * axis, axis=1, keepdims=True) * axis)
