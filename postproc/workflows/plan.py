"""The poses and loads worth measuring, on paths."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc import __version__
from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding, Refusal, nearest
from postproc.base.input_files import place
from postproc.base.tables import finite_number
from postproc.base.units import DEG, MM, to_si, words_for
from postproc.compensation.input_sensitivities import goal_sensitivities, sensitivities
from postproc.compensation.problem import rotate_wrench
from postproc.compensation.uncertain_inputs import UncertainInput
from postproc.experiments.candidate_setups import (
    CandidateSetups,
    Setups,
    readings_of,
    spacings,
)
from postproc.experiments.discrimination import apart
from postproc.experiments.measuring_order import measuring_order
from postproc.experiments.observability import measured
from postproc.experiments.pool import CANDIDATES
from postproc.experiments.precision import DesignProblem, Designs, designs, predicted
from postproc.identification.unknowns import Unknown, asked_for
from postproc.measurements import Readings, measurements_csv
from postproc.model import StiffnessModel
from postproc.output.atomic_write import write_atomically
from postproc.output.filled_tables import refuse_filled_plan
from postproc.report.page import beside
from postproc.report.planned import Planned, discrimination_words
from postproc.report.report import exit_code, json_bytes
from postproc.robot.description import Robot, find_robot, load_robot
from postproc.workflows.identify import measured_of
from postproc.workflows.plan_setups import PlanRequest, candidate_setups, implausible_lengths
from postproc.workflows.preparation import Request, Stage, prepare, silent

SIZES = (10, 15, 20, 30)
"""Numbers of poses that are looked at beside the wanted one."""

FEWEST = 6
"""Poses at which it is reported beside how far apart two effects stay."""

SHARE, SIZE_SHARE = 0.05, 0.2
"""Wanted where nothing states an interval: of the value, or of the usual size of a parameter without value."""

CUTS = 300
"""Motions of a program at which the error counts."""

CLEAR = 3.0
"""Standard deviations that distinguish two effects."""

LISTED = 3

_WANTED = re.compile(r"(?:([\w.#]+)\s*=)?\s*([-+0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(%|[A-Za-z].*)?")


def plan(request: PlanRequest, stage: Stage = silent) -> Planned:
    """The poses and loads worth measuring.  Raises Refusal, and has then written nothing."""
    _spare_inputs(request)
    stage("reading")
    robot = load_robot(find_robot(request.robot))
    model = StiffnessModel.from_robot(robot)
    asked = asked_for(model, request.effects)
    candidates = candidate_setups(request, robot, asked.model, asked.unknowns)
    implausible = implausible_lengths(request, robot)
    if request.discriminate is not None:
        planned = _discriminating_poses(request, candidates, asked.model, asked.unknowns, stage)
    else:
        planned = _for_precision(request, candidates, asked.model, asked.unknowns, stage)
    order = measuring_order(planned.setups.q, spacings(robot, DEG))
    setups = planned.setups[order]
    readings = _in_sight(candidates, planned.model, setups)
    files = {request.output: measurements_csv(readings, _about(request, planned, len(readings)))}
    reports = [path for path in (request.json, request.page) if path is not None]
    findings = (*implausible, *planned.findings)
    planned = replace(
        planned,
        setups=setups,
        readings=len(readings),
        fixed=asked.fixed,
        outputs=tuple(str(path) for path in (*files, *reports)),
        findings=findings,
        exit=exit_code(findings),
    )
    if request.json is not None:
        files[request.json] = json_bytes(planned)
    if request.page is not None:
        links = {"poses to measure (CSV)": request.output, "result (JSON)": request.json}
        from postproc.report.page_checks import planned_page  # takes its time to load

        files[request.page] = planned_page(planned, beside(request.page, links))
    write_atomically(files, last=request.output, still=lambda: refuse_filled_plan(request.output))
    return planned


def _for_precision(
    request: PlanRequest,
    candidates: CandidateSetups,
    model: StiffnessModel,
    unknowns: tuple[Unknown, ...],
    stage: Stage,
) -> Planned:
    wanted, named, source = _wanted(request, unknowns)
    tests = None
    if request.program is not None:
        stage("reading the program")
        model, tests = _tests(request, model, unknowns)
    before, findings = None, list[Finding]()
    if request.measured:
        known = measured_of(request.measured, request.robot, request.tool_mm_deg)
        before = measured(model, unknowns, known.campaign, candidates.sigma)
        findings += known.findings
    counts = np.array([unknown.prior is None for unknown in unknowns]) | named
    criterion = request.criterion or ("test" if tests is not None else "minimax")
    task = DesignProblem(model, unknowns, candidates, wanted, counts, criterion, before, tests)
    design = designs(task, request.poses, SIZES, request.seed, CANDIDATES, stage)
    return Planned(
        robot=model.robot.name,
        digest=model.robot.digest,
        effects=request.effects,
        model=design.model,
        unknowns=unknowns,
        setups_offered=candidates,
        seed=request.seed,
        criterion=criterion,
        wanted=wanted,
        wanted_source=source,
        poses=request.poses,
        setups=design.chosen[request.poses].setups,
        candidates=len(design.candidates),
        chosen=design.chosen,
        at_random=design.at_random,
        before=design.before,
        unobservable=design.unobservable,
        excluded=design.left_out,
        weakly_observable=design.weak,
        findings=(*findings, *_findings(model.robot, design)),
    )


def _discriminating_poses(
    request: PlanRequest,
    candidates: CandidateSetups,
    model: StiffnessModel,
    unknowns: tuple[Unknown, ...],
    stage: Stage,
) -> Planned:
    assert request.discriminate is not None
    model = asked_for(model, request.discriminate).model
    first, second = (asked_for(model, [word]).unknowns for word in request.discriminate)
    keys = [{unknown.key for unknown in own} for own in (first, second)]
    if keys[0] & keys[1]:
        both = " and ".join(request.discriminate)
        raise Refusal(
            Finding("PLN006", f"--discriminate: {both} have parameters in common", str(model.robot.path))
        )
    for word, own in zip(request.discriminate, (first, second), strict=True):
        if all(unknown.prior is not None for unknown in own):
            message = f"--discriminate: {word} has nothing to fit: its dimensions are known"
            raise Refusal(Finding("PLN006", message, str(model.robot.path)))
    common = tuple(unknown for unknown in unknowns if unknown.key not in keys[0] | keys[1])
    sizes = {min(FEWEST, request.poses), request.poses}
    selection = apart(model, first, second, common, candidates, sizes, request.seed, CANDIDATES, stage)
    setups = selection.chosen[request.poses]
    wanted, named, source = _wanted(request, unknowns)
    counts = np.array([unknown.prior is None for unknown in unknowns]) | named
    task = DesignProblem(model, unknowns, candidates, wanted, counts)
    findings = []
    if min(selection.separation[request.poses]) < CLEAR:
        words = discrimination_words(request.discriminate, selection.separation[request.poses])
        findings.append(Finding("PLN010", words, str(model.robot.path)))
    return Planned(
        robot=model.robot.name,
        digest=model.robot.digest,
        effects=request.effects,
        model=model,
        unknowns=unknowns,
        setups_offered=candidates,
        seed=request.seed,
        criterion="discriminate",
        wanted=wanted,
        wanted_source=source,
        poses=request.poses,
        setups=setups,
        candidates=selection.candidates,
        chosen={request.poses: predicted(task, model, setups)},
        rivals=request.discriminate,
        separation=selection.separation,
        findings=tuple(findings),
    )


def _findings(robot: Robot, design: Designs) -> list[Finding]:
    file, findings = str(robot.path), []
    for lost in design.unobservable:
        findings.append(Finding("PLN011" if lost.imitated else "PLN007", f"{lost.name}: {lost.why}", file))
    for lost in design.left_out:
        findings.append(Finding("PLN011" if lost.imitated else "PLN008", f"{lost.name}: {lost.why}", file))
    if design.weak:
        weak = "; ".join(f"{lost.name}: {lost.why}" for lost in design.weak[:LISTED])
        more = (
            f"; {len(design.weak) - LISTED} more parameters are similar" if len(design.weak) > LISTED else ""
        )
        findings.append(Finding("PLN009", weak + more, file))
    return findings


def _spare_inputs(request: PlanRequest) -> None:
    inputs = {place(path) for path in request.measured}
    inputs |= {place(path) for path in (request.program, request.cell) if path is not None}
    written = [path for path in (request.output, request.json, request.page) if path is not None]
    for path in written:
        if place(path) in inputs:
            raise Refusal(Finding("FIL007", "the output would replace an input", str(path)))
    refuse_filled_plan(request.output)


def _wanted(request: PlanRequest, unknowns: Sequence[Unknown]) -> tuple[Floats, Bools, str]:
    """Half widths (P,) [SI] of the wanted 95 % intervals, which of them (P,) the user named, and their source."""
    wanted = np.zeros(len(unknowns))
    for i, unknown in enumerate(unknowns):
        stated = None if unknown.stated is None else unknown.stated.interval
        wanted[i] = stated or SHARE * abs(unknown.value) or SIZE_SHARE * unknown.parameter.scale
    named = np.zeros(len(unknowns), bool)
    for text in sorted(request.wanted, key=lambda text: "=" in text):
        match = _WANTED.fullmatch(text.strip())
        number = None if match is None else finite_number(match[2])
        if match is None or number is None or not number > 0:
            raise _no_wish(text, "it is not NAME=VALUE with % or a unit, as c2=1% or s0=20mm or 2%")
        name, unit = match[1] or "", match[3] or ""
        rows = [i for i, unknown in enumerate(unknowns) if _is_named(unknown, name)]
        if not rows:
            names = [unknown.name for unknown in unknowns]
            raise _no_wish(text, f"{name!r} is not requested{nearest(name, names)}", ", ".join(names))
        if len(rows) > 1 and name and len({unknowns[i].name.partition(".")[0] for i in rows}) > 1:
            raise _no_wish(
                text, f"{name!r} consists of several parameters: {', '.join(unknowns[i].name for i in rows)}"
            )
        for i in rows:
            if unit != "%":
                factor = to_si(unit, unknowns[i].parameter.unit) if unit else None
                if factor is None:
                    known = ", ".join(["%", *words_for(unknowns[i].parameter.unit)])
                    raise _no_wish(
                        text, f"{unit!r} is not a unit of {unknowns[i].name}", f"use one of the units {known}"
                    )
                wanted[i] = number * factor
            elif unknowns[i].value:
                wanted[i] = number / 100 * abs(unknowns[i].value)
            elif name:
                raise _no_wish(
                    text, f"{unknowns[i].name} is zero, so {number:g} % of it is zero; state a unit"
                )
            named[i] |= bool(name)
    source = (
        f"intervals of the robot file; where it states none, {100 * SHARE:g} % of the value, or"
        f" {100 * SIZE_SHARE:g} % of its usual size"
    )
    return wanted, named, ("--wanted, else " if request.wanted else "") + source


def _is_named(unknown: Unknown, name: str) -> bool:
    """Whether ``name`` is an unknown's, its parameter's or its effect's; "" is all."""
    return name in ("", unknown.name, unknown.parameter.name, unknown.name.partition(".")[0])


def _no_wish(text: str, message: str, help: str = "") -> Refusal:
    return Refusal(Finding("PLN006", f"--wanted {text}: {message}", help=help))


def _tests(
    request: PlanRequest, model: StiffnessModel, unknowns: Sequence[Unknown]
) -> tuple[StiffnessModel, Floats]:
    """The model as it is in the cell, and R (k, P) [m per SI unit] of R^T R, the mean of S^T S over the cuts of a
    program: what the unknowns do there."""
    assert request.program is not None
    ready = prepare(Request(request.program, request.force, request.cell, request.robot))
    task = ready.task
    rows = np.flatnonzero(ready.wrenches.carries & np.isfinite(task.track.q).all(axis=1))
    if not len(rows):
        message = "no motion has a force: the error at the cuts does not depend on the requested parameters"
        raise Refusal(Finding("PLN006", message, str(request.program)))
    rows = rows[np.linspace(0, len(rows) - 1, min(CUTS, len(rows))).astype(int)]
    model = replace(model, gravity=task.model.gravity)
    entries = []
    for unknown in unknowns:
        p, value = unknown.parameter, model.terms[unknown.term].values[unknown.parameter.name]
        step = 0.1 * max(p.scale, abs(value))
        entries.append(UncertainInput(unknown.name, unknown.term, p.name, value, p.lower, p.upper, step))
    given = task.conditions.part(rows)
    q, wrench, tool = task.track.q[rows], task.wrench[rows], task.tool[rows]
    if (placed := task.robot_from_path(rows)) is not None:
        wrench = rotate_wrench(placed, wrench)
    moves = sensitivities(model, entries, q, wrench, tool, given)
    moves -= goal_sensitivities(replace(task, model=model), entries, rows, task.wanted[rows])
    moves = moves[np.isfinite(moves).all(axis=(1, 2))]
    if not moves.any():
        raise Refusal(
            Finding("PLN006", "its cuts do not depend on the requested parameters", str(request.program))
        )
    return model, np.asarray(np.linalg.qr(moves.reshape(-1, len(entries)) / np.sqrt(len(moves)), mode="r"))


def _in_sight(candidates: CandidateSetups, model: StiffnessModel, setups: Setups) -> Readings:
    """The readings to be taken."""
    visible = np.repeat(setups.visible[:, None], setups.load.shape[1], axis=1).reshape(-1)
    return readings_of(model, candidates, setups).part(np.flatnonzero(visible))


def _about(request: PlanRequest, planned: Planned, readings: int) -> list[str]:
    """Comments at the head of a plan: what it is, and what to do with it."""
    candidates = planned.setups_offered
    lines = [
        f"plan of compensate {__version__}, robot file sha256 {planned.digest[:16]}, seed {planned.seed}",
        planned.goal,
        f"{planned.poses} poses, {planned.loads_in_words}, {readings} readings",
    ]
    if candidates.deflection:
        lines.append(
            "fill in DX, DY, DZ in mm, loaded minus unloaded with the axes locked, in axes of the robot base"
        )
    else:
        lines.append("fill in X, Y, Z in mm")
    if candidates.rough:
        for name, place in zip(candidates.targets, candidates.places / MM, strict=True):
            lines.append(f"reflector {name} about {place[0]:g} {place[1]:g} {place[2]:g} mm on the flange")
    if planned.setups.direction is not None:
        lines.append(
            "approach each pose with every axis in the direction of its DIR: 1 increases and -1 decreases"
        )
    lines += [
        "measure the rows in this order, and the first pose once more at the end, where a drift is visible",
        "collisions with the surroundings are not checked: move slowly to every pose for the first time",
    ]
    return lines
