"""Where a part should lie: the placement of programs, on paths."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import Inputs, noted
from postproc.base.paged_memory import large_arrays_in_files
from postproc.output.atomic_write import write_atomically
from postproc.placement.collisions import CollisionShapes, first_collision
from postproc.placement.margin_words import margin_words, reach_shortfall, reach_words
from postproc.placement.room import FREEDOMS, UNITS
from postproc.placement.score_places import joint_margins, score_places
from postproc.placement.search_places import SearchResult, distinct, search_places
from postproc.report.placement import PlacedFigures, Placement
from postproc.report.placement_spin import spin_sentence
from postproc.report.report import exit_code, in_order_of_place, json_bytes
from postproc.workflows.place_cell import refuse_same_file
from postproc.workflows.place_collisions import checked_shapes, shape_findings
from postproc.workflows.place_compare import compare_freedoms, regret_of, score_grid, spin_bound
from postproc.workflows.place_exact import exact_figures
from postproc.workflows.place_feed import feed_turns
from postproc.workflows.place_problem import PlaceProblem, PlaceRequest, place_problem, stated_direction
from postproc.workflows.place_spin import SpunPrograms, spin_programs
from postproc.workflows.place_units import metre_ranges, metres_help, radian_ranges, room_elsewhere
from postproc.workflows.preparation import Stage, silent

POOL = 1500
"""Places that the regret is taken against."""

EXACT = 20_000
"""Places on paths up to which every listed place is predicted as the main job does; of more, the best one and the
present."""


def place(request: PlaceRequest, stage: Stage = silent) -> Placement:
    """The places of a room by what the programs would cut there.  Raises Refusal, and has then written nothing."""
    with large_arrays_in_files(*request.programs), noted() as inputs:
        return _place(request, inputs, stage)


def _place(request: PlaceRequest, inputs: Inputs, stage: Stage) -> Placement:
    stage("reading")
    if request.spin_output is not None and not request.spin:
        message = "a folder for programs with a turned tool is named, and no turn is asked for"
        raise Refusal(Finding("PLC003", message, str(request.programs[0]), help="add --spin"))
    problem = place_problem(request)
    if request.spin_output is not None:
        _refuse_unplaced(problem)
    if not len(problem.room.free):
        return _spun_here(problem, inputs, stage)
    shapes = problem.shapes if isinstance(problem.shapes, CollisionShapes) else None
    result = search_places(problem.model, problem.motions, problem.room, problem.scoring, stage, shapes)
    stage("predicting the best places")
    problem = replace(problem, few=result.few)
    present, lost = _present(problem)
    ranked, dropped = _ranked(problem, result)
    if not ranked:
        raise Refusal(_no_place(problem, result, dropped))
    best = ranked[0]
    stage("comparing freedoms")
    findings = [*lost, *_findings(problem, present, best, dropped)]
    done = replace(
        _whole(problem, present),
        looked=result.looked,
        searched=len(result.few),
        places=tuple(ranked),
        alone=compare_freedoms(problem),
        feed=feed_turns(problem, best.place),
        spin=spin_bound(problem, best.place),
        grid=score_grid(problem, best.place),
        findings=tuple(findings),
    )
    return _written(problem, *_spun(problem, done, stage), inputs)


def _whole(problem: PlaceProblem, present: PlacedFigures) -> Placement:
    """What is known of a placement before any place was looked for."""
    request, prepared = problem.request, problem.prepared
    return Placement(
        programs=tuple(str(path) for path in request.programs),
        robot=prepared[0].robot.name,
        digest=prepared[0].robot.digest,
        cell=str(problem.moved.cell.path),
        base=problem.moved.base,
        objective=request.objective,
        motions=sum(len(one.task.toolpath) for one in prepared),
        checked=len(problem.motions),
        room=problem.room,
        margins=(request.limit_margin, request.singularity_margin),
        direction=stated_direction(prepared[0], request),
        present=present,
        shapes=checked_shapes(problem.shapes),
    )


def _refuse_unplaced(problem: PlaceProblem) -> None:
    """Raises Refusal PLC003 where turned programs would be written for a place that no cell file states."""
    request = problem.request
    if len(problem.room.free) and request.output is None:
        message = "programs with a turned tool would be written for a place that no cell file states"
        help = "write the cell as well, with -o CELL.yaml"
        raise Refusal(Finding("PLC003", message, str(request.programs[0]), help=help))


def _spun_here(problem: PlaceProblem, inputs: Inputs, stage: Stage) -> Placement:
    """The result where only the tool may turn along the path, and the part stays."""
    place = problem.room.present
    stage("predicting the present place")
    present = exact_figures(problem, None)
    assert isinstance(present, PlacedFigures)
    score = score_places(problem.model, problem.motions, problem.room, problem.scoring, place[None])
    present = replace(present, score=float(score.values[0].mean()))
    findings = shape_findings(problem.shapes, problem.prepared)
    done = replace(_whole(problem, present), feed=feed_turns(problem, place), findings=tuple(findings))
    return _written(problem, *_spun(problem, done, stage), inputs)


def _spun(problem: PlaceProblem, done: Placement, stage: Stage) -> tuple[Placement, SpunPrograms | None]:
    """``done`` with what a tool that turns along the path brings at its best place, and the programs."""
    request = problem.request
    if not request.spin:
        return done, None
    stage("turning the tool along the path")
    spun = spin_programs(problem, done.best.place)
    file = str(request.programs[0])
    findings = list(done.findings)
    if spun.figures.worth:
        findings.append(Finding("PLC015", spin_sentence(spun.figures), file))
    if request.spin_output is not None and spun.unwritable is not None:
        findings.append(spun.unwritable)
    elif request.spin_output is not None and not spun.texts:
        findings.append(Finding("PLC014", f"no program is written: {spin_sentence(spun.figures)}", file))
    return replace(done, spun=spun.figures, findings=tuple(findings)), spun


def _present(problem: PlaceProblem) -> tuple[PlacedFigures, list[Finding]]:
    """The figures of the present place; without figures, and why, where the main job cannot predict it."""
    try:
        figures = exact_figures(problem, None)
    except Refusal as refusal:
        figures = refusal.findings[0]
    if isinstance(figures, PlacedFigures):
        return figures, []
    message = f"the present place has no figures: {figures.message}"
    lost = Finding("PLC006", message, figures.file, figures.line)
    return PlacedFigures(problem.room.present, exact=False), [lost]


def _ranked(problem: PlaceProblem, result: SearchResult) -> tuple[list[PlacedFigures], list[Finding]]:
    """The best places that are apart and hold for every motion, best first; why others were dropped."""
    request, room = problem.request, problem.room
    pool = result.pool.part(np.flatnonzero(result.pool.violation == 0))
    if not len(pool.places):
        return [], []
    whole = len(problem.motions) <= EXACT
    chosen = distinct(room, pool.places, 2 * request.top if whole else request.top + 2)
    places = np.unique(room.rounded(pool.places[chosen]), axis=0)
    full = score_places(problem.model, problem.motions, room, problem.scoring, places)
    regret = regret_of(problem, places, pool.places[:: max(1, len(pool.places) // POOL)])
    ranked: list[PlacedFigures] = []
    dropped: list[Finding] = []
    for at in full.order().tolist():
        if full.violation[at] > 0 or len(ranked) == request.top:
            continue
        figures = PlacedFigures(full.places[at], exact=False)
        if whole or not ranked:
            exact = exact_figures(problem, full.places[at])
            if isinstance(exact, Finding):
                dropped.append(exact)
                continue
            figures = exact
        score = float(full.value[at])
        ranked.append(replace(figures, score=score, regret=float(regret[at])))
    return ranked, dropped


def _no_place(problem: PlaceProblem, result: SearchResult, dropped: list[Finding]) -> Finding:
    """PLC002: which motion and which limit is nearest to feasible; ``dropped``: why the best places are not."""
    request, room = problem.request, problem.room
    if dropped:
        words = f"of {result.looked} places the {len(dropped)} best ones that are apart are not feasible"
        return replace(dropped[0], message=f"{words}; of the first, {dropped[0].message}")
    near = result.pool.places[result.pool.order()[:1]]
    whole = score_places(problem.model, problem.motions, room, problem.scoring, near, detailed=True)
    assert whole.lack is not None
    at = int(whole.lack[0].argmax())
    where = ", ".join(
        f"{name} {near[0, i] / UNITS[i]:.1f}" for i, name in enumerate(FREEDOMS) if i in room.free
    )
    hit = None
    if isinstance(problem.shapes, CollisionShapes) and not whole.lack[0].any():
        q, _, _ = joint_margins(problem.model, problem.motions, near)
        hit = first_collision(problem.shapes, q[0])
    if hit is not None:
        at, (one, other) = hit
        what = f"{one} collides with {other}"
    else:
        what = _lacking(problem, near, at)
    line, file = int(problem.motions.line[at]), str(request.programs[int(problem.motions.program[at])])
    count = int((whole.lack[0] > 0).sum())
    message = (
        f"none of {result.looked} places is feasible; at the nearest one ({where}) {what} in this motion"
    )
    if count > 1:
        message += f", and {count - 1} other places of the paths are not feasible either"
    return Finding("PLC002", message, file, line, help=metres_help(request.ranges) or room_elsewhere(room))


def _lacking(problem: PlaceProblem, near: Floats, at: int) -> str:
    """Which limit the motion ``at`` of the search violates most with the part at ``near`` (1, 6)."""
    request, motions, robot = problem.request, problem.motions, problem.model.robot
    q, limit, singular = joint_margins(problem.model, motions, near)
    if not np.isfinite(limit[0, at]):
        return reach_words(float(reach_shortfall(robot, motions.flanges(near))[at]))
    margins = (request.limit_margin, request.singularity_margin)
    return margin_words(robot, q[0, at], float(singular[0, at]), margins) or "the path cannot be followed"


def _findings(
    problem: PlaceProblem, present: PlacedFigures, best: PlacedFigures, dropped: list[Finding]
) -> list[Finding]:
    request, cell = problem.request, str(problem.moved.cell.path)
    found = shape_findings(problem.shapes, problem.prepared)
    lacks = present.limit_deg < request.limit_margin or present.singular_deg < request.singularity_margin
    if lacks:
        message = (
            f"at the present place the nearest axis limit is {present.limit_deg:.1f} deg away, the nearest"
            f" singularity {present.singular_deg:.1f} deg"
        )
        found.append(Finding("PLC006", message, str(request.programs[0]), present.limit_line))
    found += metre_ranges(request.ranges, cell) + radian_ranges(problem.room, cell)
    edges = problem.room.at_edge(best.place)
    if edges:
        found.append(Finding("PLC007", f"the best place is at the edge of: {', '.join(edges)}", cell))
    if dropped:
        message = (
            f"{len(dropped)} places fail the check of every path and are not listed: {dropped[0].message}"
        )
        found.append(Finding("PLC009", message, dropped[0].file, dropped[0].line))
    if best.figure(request.objective) > 0.99 * present.figure(request.objective):
        found.append(Finding("PLC010", "no place of the room is better than the present one", cell))
    if not problem.prepared[0].task.process:
        found.append(Finding("PLC011", "the search compares places by a linear model", cell))
    if best.lower_bound:
        found.append(
            Finding("PLC008", "not every figure that the uncertainty depends on has an interval", cell)
        )
    return found


def _written(problem: PlaceProblem, done: Placement, spun: SpunPrograms | None, inputs: Inputs) -> Placement:
    """Writes cell file, turned programs, picture, page and result together."""
    request = problem.request
    done = replace(done, findings=tuple(in_order_of_place(done.findings)))
    done = replace(done, exit=exit_code(done.findings, request.strict))
    if done.exit == 1:
        raise Refusal(*done.findings)
    files: dict[Path, bytes] = {}
    if request.output is not None:
        refuse_same_file(problem.moved.cell, request.output)
        raw = problem.moved.at(done.best.place)
        files[request.output] = problem.moved.in_folder(raw, request.output)
    if request.spin_output is not None and spun is not None and spun.unwritable is None:
        for path, text in spun.texts.items():
            target = request.spin_output / path.name
            if target in files:
                raise Refusal(Finding("FIL007", "two outputs have the same name", str(target)))
            files[target] = text
    if request.picture is not None:
        from postproc.report.placement_picture import placement_picture

        files[request.picture] = placement_picture(done, request.picture.suffix[1:].lower())
    names = [*files, *(path for path in (request.json, request.page) if path is not None)]
    done = replace(done, outputs=tuple(str(path) for path in names))
    if request.page is not None:
        from postproc.report.page import beside
        from postproc.report.placement_page import placement_page

        links = {"cell file": request.output, "picture": request.picture, "result (JSON)": request.json}
        files[request.page] = placement_page(done, beside(request.page, links))
    if request.json is not None:
        files[request.json] = json_bytes(done)
    read = [inputs, *(one.inputs for one in problem.prepared)]
    for one in read:
        one.refuse_outputs(names)

    def refuse_changed() -> None:
        for one in read:
            one.refuse_changed()

    refuse_changed()
    write_atomically(files, still=refuse_changed)
    return done
