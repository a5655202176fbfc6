"""The measured points of parts, joined to the motions that left them and to the commands of the program that cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses, turned
from postproc.base.units import MM
from postproc.cell import frames_of
from postproc.effects import Conditions
from postproc.learning.candidates import Circumstances
from postproc.learning.causes import (
    Cause,
    PriorKnowledge,
    base_causes,
    force_causes,
    rigid_columns,
    robot_causes,
    tool_causes,
)
from postproc.learning.covariance import FREE_SHIFT, FREE_TURN, Layout
from postproc.learning.measured_part import FREEDOMS, MeasuredPart
from postproc.learning.next_program import FeedTurns
from postproc.learning.plausible import FEW_BESIDE, TOUCHED
from postproc.learning.touched_points import TouchedPoints, touched_points
from postproc.part.contact import Contacts, CuttingMotions, find_contacts
from postproc.process.operation_names import OperationNames
from postproc.verification.pairing import Pairing
from postproc.workflows.cell_force_factors import operations_of
from postproc.workflows.cell_tool_errors import tool_numbers
from postproc.workflows.learn_commands import commands_at, cutting_program
from postproc.workflows.learn_cutters import cutters_of
from postproc.workflows.learn_misplaced import PlacedPart, misplaced_findings
from postproc.workflows.preparation import Prepared, Request, prepare

FACING = np.cos(np.radians(30.0))
"""Cosine between the normals of surfaces that face the same direction, at least."""

STRAYS = 0.05
"""Share of points that may be touched by no tool without a mistake in the file."""

DEEPER = 0.02 * MM
"""A visit before the last that is predicted to cut deeper by more than this may have left the point."""


@dataclass(frozen=True, eq=False)
class CutProgram:
    """A program that was cut, with all that belongs to its surface. tool (N,): numbers; operations; spindle (N,
    3) in tool axes; corners: where the feed turns; radius (N,) [m] of the cutter; time (N,) 0..1; motions:
    those that may leave a surface; ball: tools with a ball."""

    ready: Prepared
    operations: OperationNames
    tool: Ints
    spindle: Floats
    corners: FeedTurns
    radius: Floats
    time: Floats
    motions: CuttingMotions
    ball: tuple[int, ...]
    findings: tuple[Finding, ...]


@dataclass(frozen=True, eq=False)
class Matched:
    """The points of all parts that one motion left: ``points``, their deviations (K,) [m], layout and circumstances,
    causes; file and line of each point; ``centre`` (3,) and ``axes`` (3, 3) of the base; ``measured``: points of all
    files; ``operation`` (K,): index."""

    points: TouchedPoints
    deviation: Floats
    layout: Layout
    around: Circumstances
    causes: tuple[Cause, ...]
    line: Ints
    file: Ints
    operation: Ints
    feature: tuple[str, ...]
    centre: Floats
    axes: Floats
    measured: int
    findings: tuple[Finding, ...]


def read_job(request: Request) -> CutProgram:
    """The program with its tools and operations.  Raises Refusal LRN011 for what is not known here."""
    ready = prepare(request)
    task, cell, path = ready.task, ready.cell, ready.task.toolpath
    program = str(request.program)
    if task.external is not None:
        message = (
            "external axes carry the robot or the part, and the causes of their errors are not known here"
        )
        raise Refusal(
            Finding("LRN011", message, program, help="measure a part that is cut with the arm alone")
        )
    if cell.correct == "touched_off":
        message = "correct: touched_off moves the base with every parameter of the robot"
        raise Refusal(Finding("LRN011", message, str(cell.path), help="use correct: process, or absolute"))
    if not task.carries.any():
        message = "no motion of the program has a force, so none is known to cut"
        raise Refusal(
            Finding("LRN011", message, program, help="state the forces, as the main job needs them")
        )
    frames = frames_of(cell, path, program)
    numbers = tool_numbers(path)
    cutters, findings = cutters_of(ready, numbers)
    known = {cutter.number: index for index, cutter in enumerate(cutters)}
    desired = task.desired_path
    rows = np.flatnonzero(
        task.carries & desired.traceable & (task.track.branch >= 0) & task.track.reachable
        & np.isin(numbers, list(known)) & np.isfinite(frames.spindle_in_tool[:, 0])
    )  # fmt: skip
    if not len(rows):
        message = "no cutting motion has a known start, tool and spindle axis"
        raise Refusal(Finding("LRN011", message, program, help="state the tool in the cell, with its axis"))
    motions = CuttingMotions(
        desired,
        rows,
        frames.spindle_in_tool[rows],
        np.array([known[n] for n in numbers[rows].tolist()]),
        cutters,
    )
    radius = np.zeros(len(path))
    for cutter in cutters:
        radius[numbers == cutter.number] = cutter.radius
    duration = desired.length / np.where(path.feed > 0, path.feed, np.inf)
    time = np.cumsum(duration)
    return CutProgram(
        ready,
        operations_of(cell, ready.wrenches, path),
        numbers,
        np.nan_to_num(frames.spindle_in_tool[np.arange(len(path))]),
        FeedTurns.of(desired, path, task.carries),
        radius,
        time / max(float(time[-1]), 1e-9),
        motions,
        tuple(cutter.number for cutter in cutters if cutter.shape == "ball"),
        findings,
    )


def match(
    request: Request,
    job: CutProgram,
    parts: Sequence[MeasuredPart],
    known: PriorKnowledge,
    kept: Sequence[Path] = (),
) -> Matched:
    """The points of all parts, in the state in which the robot left them; ``kept``: of ``cutting_file``.  Raises
    Refusal LRN002, LRN003, LRN004."""
    findings: list[Finding] = []
    several: list[TouchedPoints] = []
    rows: list[Ints] = []
    number = 0
    group: list[Ints] = []
    for part in parts:
        other, pairing = cutting_program(request, job.ready, part, kept)
        points, keep, reported = _touched(job, part, other, pairing)
        findings += reported
        several.append(points)
        rows.append(keep)
        group.append(number + part.part[keep])
        number += int(part.part.max()) + 1
    points = _joined(several)
    which = np.concatenate(group)
    operation = job.operations.which[points.row]
    place = points.point
    axes = points.axes[0]
    centre = place.mean(axis=0)
    rigid = rigid_columns(points, axes, centre)
    fixed = np.concatenate(
        [np.tile([word not in part.freedoms for word in FREEDOMS], (len(keep), 1))
         for part, keep in zip(parts, rows, strict=True)]
    )  # fmt: skip
    free = _free(rigid, which, fixed)
    cause_list = robot_causes(job.ready.model)
    cause_list += force_causes(operation, job.operations.names, known)
    spring = all(part.spring_pass for part in parts)
    stated = job.ready.cell.tool_errors
    cause_list += tool_causes(points, job.tool[points.row], job.ball, spring, stated)
    constrained = [one for one in range(6) if fixed[:, one].any()]
    cause_list += base_causes(rigid * fixed, constrained)
    layout = Layout(
        place,
        points.normal,
        np.concatenate([part.sigma[keep] for part, keep in zip(parts, rows, strict=True)]),
        free,
        which * len(job.operations.names) + operation,
    )
    row = points.row
    before = np.maximum(row - 1, 0)
    around = Circumstances(
        job.corners.at(row, points.share, job.radius[row]),
        job.corners.sigma_at(row, points.share, job.radius[row]),
        job.time[before] + points.share * (job.time[row] - job.time[before]),
    )
    return Matched(
        points,
        np.concatenate([part.deviation[keep] for part, keep in zip(parts, rows, strict=True)]),
        layout,
        around,
        tuple(cause_list),
        np.concatenate([part.line[keep] for part, keep in zip(parts, rows, strict=True)]),
        np.concatenate([np.full(len(keep), i) for i, keep in enumerate(rows)]),
        operation,
        tuple(part.feature[i] for part, keep in zip(parts, rows, strict=True) for i in keep.tolist()),
        centre,
        axes,
        sum(map(len, parts)),
        tuple(findings),
    )


def _free(rigid: Floats, part: Ints, fixed: Bools) -> Floats:
    """(K, A) columns of the freedoms that the alignment of each part took out, in m per standard deviation."""
    size = np.array([FREE_SHIFT] * 3 + [FREE_TURN] * 3)
    columns = []
    for number in np.unique(part).tolist():
        own = part == number
        for one in np.flatnonzero(~fixed[own].any(axis=0)).tolist():
            columns.append(np.where(own, rigid[:, one] * size[one], 0.0))
    return np.stack(columns, axis=1) if columns else np.zeros((len(part), 0))


def _touched(
    job: CutProgram, part: MeasuredPart, other: Prepared | None, pairing: Pairing | None
) -> tuple[TouchedPoints, Ints, list[Finding]]:
    """States of the points of a part, their numbers (J,), and what is reported."""
    point, normal, rotation = _in_robot(job, part)
    only = _restricted(job, part)
    contacts = find_contacts(job.motions, point, normal, only)
    findings = misplaced_findings(PlacedPart(job.motions, part, point, normal, rotation, only, contacts))
    if findings:
        raise Refusal(*findings[:1])
    keep = np.flatnonzero(contacts.touched)
    ambiguous = _ambiguous(job, point, normal, contacts)
    keep = keep[~ambiguous[keep]]
    command, gone = None, 0
    if other is not None and pairing is not None:
        command, lost = commands_at(
            job.ready, other, pairing, contacts.last.row[keep], contacts.last.share[keep]
        )
        gone = int(lost.sum())
        if gone > (1 - TOUCHED) * len(keep):
            message = f"{part.cut_with} does not lead the tool to {gone} of {len(keep)} points"
            help = "name the program that cut this part, and the original of it"
            raise Refusal(Finding("LRN002", message, str(part.file), help=help))
        keep, command = keep[~lost], command[~lost]
    points = touched_points(
        job.ready.task,
        job.spindle,
        (contacts.last.row[keep], contacts.last.share[keep]),
        (point[keep], normal[keep]),
        command,
    )
    good = np.flatnonzero(points.good & np.isfinite(points.errors(job.ready.model)))
    if len(good) < len(part):
        words = f"{len(part) - len(good)} of {len(part)} points are not used:"
        words += f" {int((~contacts.touched).sum())} are touched by no tool"
        words += f", {int(ambiguous.sum())} may be cut by more than one motion"
        if gone:
            words += f", {gone} are not reached by the program that cut the part"
        rows = np.setdiff1d(np.arange(len(part)), keep[good])
        findings.append(Finding("LRN005", words, str(part.file), int(part.line[rows[0]])))
        findings += _unused_features(part, keep[good], contacts.touched)
    if len(good) < 6:
        message = f"{len(good)} points can be used, where at least 6 are needed"
        raise Refusal(Finding("LRN003", message, str(part.file)))
    return points.part(good), keep[good], findings


def _unused_features(part: MeasuredPart, used: Ints, touched: Bools) -> list[Finding]:
    """LRN022: features, or else directions in which surfaces face, of which no point is among the ``used`` (J,); or
    else more points that are not ``touched`` (K,) than strays are."""
    feature = np.array(part.feature)
    lost = [name for name in dict.fromkeys(part.feature) if name and not (feature[used] == name).any()]
    rows = np.flatnonzero(np.isin(feature, [name for name in lost if (feature == name).sum() >= FEW_BESIDE]))
    where = f"of {', '.join(dict.fromkeys(feature[rows].tolist()))}"
    if not len(rows) and len(used):
        rows = np.flatnonzero((part.normal @ part.normal[used].T).max(axis=1) < FACING)
        axis = np.argmax(np.abs(part.normal[rows]), axis=1)
        signs = np.where(part.normal[rows, axis] > 0, "+", "-")
        faces = sorted({f"{sign}{'XYZ'[k]}" for sign, k in zip(signs.tolist(), axis.tolist(), strict=True)})
        where = f"on surfaces that face {' or '.join(faces)}"
    message = f"no point {where} is used ({len(rows)}): what is learnt, and the promise, are of the others"
    if len(rows) < FEW_BESIDE:
        rows = np.flatnonzero(~touched)
        if len(rows) < max(FEW_BESIDE, STRAYS * len(part)):
            return []
        message = (
            f"{len(rows)} of {len(part)} points are on no surface that the tools leave: these, or all of them, may be"
            " shifted; what is learnt, and the promise, are of the others"
        )
    return [Finding("LRN022", message, str(part.file), int(part.line[rows[0]]))]


def _in_robot(job: CutProgram, part: MeasuredPart) -> tuple[Floats, Floats, Floats]:
    """Points (K, 3) [m] and normals (K, 3) in the robot base, and the rotation (3, 3) of theirs.  Raises Refusal LRN001
    where the base is not clear."""
    path, task = job.ready.task.toolpath, job.ready.task
    used = np.unique(path.base[job.motions.rows])
    numbers = {path.frames[index].number: index for index in used.tolist()}
    if part.base is not None and part.base not in numbers:
        message = f"# base: {part.base} is no base in which the program cuts"
        raise Refusal(Finding("LRN001", message, str(part.file)))
    if part.base is None and len(used) > 1:
        message = "the program cuts in several bases, and the file does not state one"
        raise Refusal(Finding("LRN001", message, str(part.file), help="add # base: 1"))
    index = used[0] if part.base is None else numbers[part.base]
    row = int(job.motions.rows[np.argmax(path.base[job.motions.rows] == index)])
    base = task.base[np.array([row])]
    normal = turned(np.repeat(base.rotation, len(part), 0), part.normal)
    return base.position + turned(base.rotation, part.point), normal, base.rotation[0]


def _restricted(job: CutProgram, part: MeasuredPart) -> dict[int, Ints]:
    """Number of a point -> rows that may have left it, by LINE or OPERATION.  Raises Refusal LRN001."""
    path, only = job.ready.task.toolpath, {}
    names = {name.casefold(): index for index, name in enumerate(job.operations.names)}
    for number in range(len(part)):
        line, name = int(part.program_line[number]), part.operation[number]
        if line:
            rows = np.flatnonzero(path.line == line)
            if not len(rows):
                message = f"column LINE: line {line} of the program contains no motion"
                raise Refusal(Finding("LRN001", message, str(part.file), int(part.line[number])))
            only[number] = rows
        elif name:
            if name.casefold() not in names:
                message = f"column OPERATION: the program has no operation {name[:40]!r}"
                help = "the operations are " + ", ".join(job.operations.names)
                raise Refusal(Finding("LRN001", message, str(part.file), int(part.line[number]), help=help))
            only[number] = np.flatnonzero(job.operations.which == names[name.casefold()])
    return only


def _ambiguous(job: CutProgram, point: Floats, normal: Floats, contacts: Contacts) -> Bools:
    """(K,) points that an earlier motion is predicted to have cut deeper than the last one."""
    ambiguous = np.zeros(len(point), bool)
    twice = np.flatnonzero(contacts.before.row >= 0)
    if not len(twice):
        return ambiguous
    errors = []
    for visit in (contacts.last, contacts.before):
        states = touched_points(
            job.ready.task, job.spindle, (visit.row[twice], visit.share[twice]), (point[twice], normal[twice])
        )
        errors.append(states.errors(job.ready.model))
    ambiguous[twice] = errors[1] < errors[0] - DEEPER
    return ambiguous


def _joined(several: Sequence[TouchedPoints]) -> TouchedPoints:
    """The points of several parts."""
    first = several[0]
    if len(several) == 1:
        return first
    values: dict[str, Any] = {}
    for one in fields(TouchedPoints):
        parts = [getattr(points, one.name) for points in several]
        if isinstance(parts[0], np.ndarray):
            values[one.name] = np.concatenate(parts)
        elif isinstance(parts[0], Poses):
            values[one.name] = Poses(
                np.concatenate([p.rotation for p in parts]), np.concatenate([p.position for p in parts])
            )
        elif isinstance(parts[0], Conditions):
            values[one.name] = _joined_conditions(parts)
    return replace(first, **values)


def _joined_conditions(parts: Sequence[Conditions]) -> Conditions:
    values: dict[str, Any] = {}
    for one in fields(Conditions):
        several = [getattr(part, one.name) for part in parts]
        values[one.name] = None if several[0] is None else np.concatenate(several)
    return Conditions(**values)
