"""The forces of a cutting process: operations joined to the motions of a program, one mean force a motion."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.findings import Finding, Refusal
from postproc.base.units import MM
from postproc.cell import MotionFrames
from postproc.process.feed_frames import ALONG_SPINDLE
from postproc.process.force_comments import marked_air
from postproc.process.milling_forces import mean_force, peak_share
from postproc.process.mirrored_cuts import cut_sides, oblique_findings
from postproc.process.operation_checks import check_operations
from postproc.process.path_length import PathLength, shifted
from postproc.process.process_file import Operation, read_process
from postproc.process.stated_forces import FEED, StatedForces
from postproc.process.wrenches import is_air
from postproc.toolpath import Annotation, Kind, Toolpath

UNUSUAL = 2.0
"""A feed this many times the usual one of its operation is reported: it may be a move through air."""

_SHOWN = 5


def process_forces(
    path: Path, toolpath: Toolpath, frames: MotionFrames, program: str
) -> tuple[StatedForces, tuple[Finding, ...]]:
    """The mean milling force of every motion that an operation of the process file ``path`` has, in the feed frame.

    Air, with no force, are: motions of no operation, point-to-point and rapid motions, those under FORCE OFF, at the
    operation's ``rapid`` and above, those that come from axis positions (approaches, with no known direction), and
    those along the spindle axis (of plunges the model knows nothing).  Where the program mirrors the side that is cut,
    the spindle turns as before: climb milling is conventional milling there.  Refusal: of the file; FRC011
    where no operation has any motion; FRC013 where a feed is not known; FRC033 under M4.  Findings: also FRC041 to
    FRC046, where an operation contradicts program, cell, or what tools and robots are.
    """
    operations = read_process(path)
    joined = join(operations, toolpath)
    findings = _unjoined(operations, joined, toolpath, path, program)
    cutting = (joined >= 0) & ~is_air(toolpath) & ~marked_air(toolpath)
    rapid = np.array([operation.rapid for operation in operations])[joined]
    cutting &= ~(toolpath.feed >= rapid)
    along = _along_spindle(cutting, toolpath, frames)
    approach = cutting & ~shifted(toolpath.kind != Kind.AXIS)
    if np.any(free := along | approach):
        what = (
            f"{along.sum()} motions along the spindle and {approach.sum()} from axis positions have"
            f" no computed force"
        )
        findings.append(Finding("FRC014", what, program, int(toolpath.line[np.argmax(free)])))
    cutting &= ~free
    side = cut_sides(toolpath, frames)
    oblique = np.flatnonzero(cutting & (side == 0))
    findings += oblique_findings(oblique, "have no computed force", toolpath, program)
    cutting[oblique] = False
    back = np.flatnonzero(cutting & (toolpath.spindle < 0))
    if len(back):
        message = f"the spindle rotates counter-clockwise in {len(back)} cutting motions"
        raise Refusal(Finding("FRC033", message, program, int(toolpath.line[back[0]])))
    _check_feed(operations, joined, cutting, toolpath, path, program)
    findings += _passed_over(operations, joined, cutting, toolpath, program)

    n = len(toolpath)
    values, row = [np.zeros((1, 6))], np.zeros(n, np.int32)
    ci95, peak, radius = np.full(n, np.nan), np.full(n, np.nan), np.full(n, np.nan)
    motions = {
        index: np.flatnonzero(cutting & (joined == index)) for index in np.unique(joined[cutting]).tolist()
    }
    acting = [(operations[index], rows[side[rows] > 0]) for index, rows in motions.items()]
    acting += [(operations[index].as_mirrored(), rows[side[rows] < 0]) for index, rows in motions.items()]
    for operation, rows in acting:
        if not len(rows):
            continue
        feed = operation.feed_per_tooth(toolpath.feed[rows])
        usual = float(np.median(feed))
        share = peak_share(operation.cut, usual)
        different, which = np.unique(feed, return_inverse=True)
        force = np.zeros((len(different), 6))
        force[:, :3] = mean_force(operation.cut, different)
        row[rows] = which + sum(map(len, values))
        values.append(force)
        peak[rows] = (share * np.linalg.norm(force[:, :3], axis=1))[which]
        radius[rows] = 0.5 * operation.cut.diameter
        ci95[rows] = np.nan if operation.material.ci95 is None else operation.material.ci95
        findings += _summary(operation, rows, feed, usual, share, toolpath, path, program)
    findings += check_operations(operations, motions, toolpath, frames.diameters, path, program)
    stated = np.concatenate(values)
    return StatedForces(stated, np.full(len(stated), FEED), row, ci95=ci95, peak=peak, radius=radius), tuple(
        findings
    )


def join(operations: Sequence[Operation], toolpath: Toolpath) -> Ints:
    """(N,) the operation of every motion, -1 without one; lines count before names, names before tools.

    A name holds from its comment to the next comment with a name of the process, or to the next change of tool; of two
    names in one comment the longer counts.  A name has to be there as whole words; case and blanks do not matter.
    """
    n = len(toolpath)
    owner = np.full(n, -1)
    numbers = np.array([frame.entry or 0 for frame in toolpath.frames] + [0])
    tool = numbers[toolpath.tool]
    for index, operation in enumerate(operations):
        if operation.tool:
            owner[tool == operation.tool] = index
    named = [(name, index) for index, name in enumerate(o.name for o in operations) if name]
    rows, which = [-1], [-1]
    for comment in sorted(toolpath.comments, key=lambda c: (c.row, c.line)):
        match = _longest(comment, named)
        if match >= 0:
            rows.append(comment.row)
            which.append(match)
    place = np.searchsorted(np.array(rows), np.arange(n), side="right") - 1
    changes = np.append(0, np.cumsum(tool[1:] != tool[:-1]))[:n]
    same_tool = changes[np.maximum(np.array(rows)[place], 0)] == changes
    by_name = np.where(same_tool, np.array(which)[place], -1)
    owner = np.where(by_name >= 0, by_name, owner)
    for index, operation in enumerate(operations):
        if operation.lines[1]:
            owner[(toolpath.line >= operation.lines[0]) & (toolpath.line <= operation.lines[1])] = index
    return owner


def _longest(comment: Annotation, named: Sequence[tuple[str, int]]) -> int:
    text = " ".join(comment.text.split())
    matches = [
        (len(name), index)
        for name, index in named
        if re.search(rf"(?<!\w){re.escape(name)}(?!\w)", text, re.IGNORECASE)
    ]
    return max(matches)[1] if matches else -1


def _along_spindle(cutting: Bools, toolpath: Toolpath, frames: MotionFrames) -> Bools:
    """(N,) straight motions, of those that are ``cutting``, along the spindle axis at their end; False where one of
    them is not known."""
    path_length = PathLength(toolpath, frames)
    along = np.zeros(len(toolpath), bool)

    def compare(part: slice) -> None:
        rows = part.start + np.flatnonzero(cutting[part] & ~path_length.arc[part])
        spindle = np.einsum("nij,nj->ni", toolpath.rotation[rows], frames.spindle_in_tool[rows])
        spindle = np.einsum("nij,nj->ni", frames.base_in_robot.rotation[rows], spindle)
        cosine = np.abs(np.einsum("ni,ni->n", path_length.tangent(rows, 1.0), spindle))
        along[rows] = cosine >= np.cos(ALONG_SPINDLE)

    for _ in in_blocks(compare, len(toolpath)):
        pass
    return along


def _check_feed(
    operations: Sequence[Operation],
    joined: Ints,
    cutting: Bools,
    toolpath: Toolpath,
    file: Path,
    program: str,
) -> None:
    lost = np.flatnonzero(cutting & ~(toolpath.feed > 0))
    if not len(lost):
        return
    operation = operations[joined[lost[0]]]
    raise Refusal(
        Finding(
            "FRC013",
            f"the feed of {len(lost)} motions of operation {operation.label} ({file.name}:{operation.line}) is not "
            "known, so the feed per tooth is not known",
            program,
            int(toolpath.line[lost[0]]),
            help="set the feed in the program before the motion ($VEL.CP, F), or mark air with FORCE OFF",
        )
    )


def _unjoined(
    operations: Sequence[Operation], joined: Ints, toolpath: Toolpath, path: Path, program: str
) -> list[Finding]:
    """Operations without motions, and motions without an operation.  Refusal FRC011 where nothing was joined."""
    findings = []
    for index, operation in enumerate(operations):
        if not np.any(joined == index):
            what = f"operation {operation.label} has no motion in {Path(program).name}"
            findings.append(
                Finding("FRC012", what, str(path), operation.line, help=_offers(operation, toolpath))
            )
    if len(findings) == len(operations):
        lines = f"; lines {toolpath.line[0]} to {toolpath.line[-1]} contain motions" if len(toolpath) else ""
        raise Refusal(
            Finding(
                "FRC011",
                f"no operation of {path.name} has a motion in {Path(program).name}{lines}",
                str(path),
                operations[0].line,
                help=findings[0].help,
            )
        )
    free = np.flatnonzero((joined < 0) & ~is_air(toolpath) & ~marked_air(toolpath))
    if len(free):
        what = (
            f"{len(free)} motions belong to no operation and count as air; the first is in line"
            f" {toolpath.line[free[0]]}"
        )
        findings.append(Finding("FRC007", what, program, int(toolpath.line[free[0]])))
    return findings


def _passed_over(
    operations: Sequence[Operation], joined: Ints, cutting: Bools, toolpath: Toolpath, program: str
) -> list[Finding]:
    """Cuts that count to the operation named last although a comment in the air before them names none."""
    named = [(operation.name, index) for index, operation in enumerate(operations) if operation.name]
    starts = np.flatnonzero(cutting & ~shifted(cutting))
    before: dict[int, list[Annotation]] = {}
    for comment in toolpath.comments:
        at = int(np.searchsorted(starts, comment.row))
        # no motion may cut between the comment and the cut
        if at < len(starts) and not cutting[comment.row : starts[at]].any():
            before.setdefault(int(starts[at]), []).append(comment)
    silent = [
        comments[-1]
        for start, comments in sorted(before.items())
        if operations[joined[start]].name and all(_longest(comment, named) < 0 for comment in comments)
    ]
    if not silent:
        return []
    first = silent[0]
    message = (
        f"{len(silent)} cuts start after a comment that names no operation of the process, and count to the one "
        f"named before; the first comment is {' '.join(first.text.split())[:40]!r}"
    )
    return [Finding("FRC018", message, program, first.line)]


def _offers(operation: Operation, toolpath: Toolpath) -> str:
    """What the program has of the kind by which an operation is joined."""
    if operation.name:
        texts = list(
            dict.fromkeys(" ".join(c.text.split())[:40] for c in toolpath.comments if c.text.strip())
        )
        shown = ", ".join(map(repr, texts[:_SHOWN])) + (", ..." if len(texts) > _SHOWN else "")
        return (
            f"the program has the comments {shown}"
            if texts
            else "the program has no comments that could match a name"
        )
    if operation.tool:
        used = {toolpath.frames[index].entry for index in np.unique(toolpath.tool) if index >= 0}
        numbers = ", ".join(str(number) for number in sorted(n for n in used if n))
        if numbers:
            return f"the program uses the tools {numbers}"
        return "no tool of the program has a number, and its $TOOL has the pose of no tool of the cell"
    return "write the lines of motions in the program, from 1"


def _summary(
    operation: Operation,
    rows: Ints,
    feed: Floats,
    usual: float,
    share: float,
    toolpath: Toolpath,
    path: Path,
    program: str,
) -> list[Finding]:
    """What an operation came to, and what of it needs review."""
    x, y, z = mean_force(operation.cut, np.array([usual]))[0]
    size = float(np.linalg.norm([x, y, z]))
    first, last = toolpath.line[rows[0]], toolpath.line[rows[-1]]
    message = (
        f"operation {operation.label}: {len(rows)} motions in lines {first} to {last} have a feed per tooth of "
        f"{usual / MM:.3g} mm, the mean force is {x:.1f}, {y:.1f}, {z:.1f} N @feed, up to"
        f" {share * size:.0f} N within a "
        f"tooth period; {operation.material.name}"
    )
    if operation.material.ci95 is not None:
        message += f", +- {100 * operation.material.ci95:.0f} %"
    findings = [Finding("FRC015", message, str(path), operation.line)]
    if not operation.material.axial and operation.cut.helix:
        what = (
            f"operation {operation.label}: {operation.material.name} has no known axial coefficients; Fz is 0"
        )
        findings.append(Finding("FRC016", what, str(path), operation.line))
    fast = np.flatnonzero(feed > UNUSUAL * usual)
    if len(fast):
        what = (
            f"operation {operation.label}: {len(fast)} motions have more than {UNUSUAL:g} times its usual feed, up to "
            f"{feed.max() / MM:.3g} mm per tooth, and count as cutting"
        )
        slowest = toolpath.feed[rows[fast]].min()
        help = f"if they are in air, state rapid: {slowest:g} (m/s) in the operation, or mark them FORCE OFF"
        findings.append(Finding("FRC017", what, program, int(toolpath.line[rows[fast[0]]]), help=help))
    return findings
