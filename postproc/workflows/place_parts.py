"""Which part of a batch lies where: several parts, several places, on paths."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import Inputs, noted
from postproc.base.input_files import place as real_path
from postproc.base.paged_memory import large_arrays_in_files
from postproc.output.atomic_write import write_atomically
from postproc.placement.collisions import CollisionShapes
from postproc.placement.room import TURN, UNITS
from postproc.report.assignment import Pair, PartAssignment
from postproc.report.placement import PlacedFigures
from postproc.report.report import exit_code, in_order_of_place, json_bytes
from postproc.workflows.place_collisions import checked_shapes, shape_findings
from postproc.workflows.place_exact import exact_figures
from postproc.workflows.place_problem import PlaceProblem, PlaceRequest, place_problem
from postproc.workflows.place_units import metre_findings, metre_places, radian_places
from postproc.workflows.preparation import Stage, silent

DECIMALS = 3
"""Of the millimetres of a place: it is a fixture that is there already, and known as it was measured."""


@dataclass(frozen=True)
class AssignRequest:
    """What the user asked for.  common: how places are compared, its programs are the parts; places: name -> x, y, z
    [mm] of the base's origin in $WORLD and turn [deg] against the present; cells: folder for the cell files."""

    common: PlaceRequest
    places: Mapping[str, tuple[float, float, float, float]]
    cells: Path | None = None


def assign(request: AssignRequest, stage: Stage = silent) -> PartAssignment:
    """The assignment of parts to places with the least sum of their objectives, of the most parts that have a feasible
    place at all.  Raises Refusal, and has then written nothing."""
    with large_arrays_in_files(*request.common.programs), noted() as inputs:
        return _assign(request, inputs, stage)


def _assign(request: AssignRequest, inputs: Inputs, stage: Stage) -> PartAssignment:
    common = request.common
    _refuse_one_spot(request)
    problems = []
    for program in common.programs:
        stage(f"reading {program.name}")
        own = replace(common, programs=(program,), ranges={}, searched=False)
        problem = place_problem(own)
        problems.append(replace(problem, moved=replace(problem.moved, decimals=DECIMALS)))
    pairs = []
    for k, problem in enumerate(problems):
        for name, stated in request.places.items():
            stage(f"predicting {common.programs[k].name} at {name}")
            pairs.append(_pair(problem, k, name, stated))
    count = len(request.places)
    table = np.array([pair.value(common.objective) for pair in pairs]).reshape(len(problems), count)
    chosen = assign_places(table)
    if (chosen < 0).all():
        lacks = [replace(pair.lack, code="PLC016") for pair in pairs if pair.lack is not None]
        raise Refusal(*lacks)
    names = list(request.places)
    shapes = [problem.shapes for problem in problems]
    findings = [one for problem in problems[:1] for one in shape_findings(problem.shapes, problem.prepared)]
    file = str(problems[0].moved.cell.path)
    findings += metre_findings(request.places, file) + radian_places(request.places, file)
    for k in np.flatnonzero(chosen < 0).tolist():
        findings.append(
            _without(pairs[k * count : (k + 1) * count], common.objective, str(common.programs[k]))
        )
    done = PartAssignment(
        programs=tuple(str(path) for path in common.programs),
        places=tuple(names),
        objective=common.objective,
        pairs=tuple(pairs),
        chosen=tuple(names[at] if at >= 0 else "" for at in chosen.tolist()),
        margins=(common.limit_margin, common.singularity_margin),
        shapes=checked_shapes(shapes[0]) if all(isinstance(one, CollisionShapes) for one in shapes) else None,
        findings=tuple(in_order_of_place(findings)),
    )
    return _written(request, done, problems, chosen, inputs)


def _refuse_one_spot(request: AssignRequest) -> None:
    """Raises Refusal PLC023 where two places for several parts have the same origin."""
    spots: dict[tuple[float, ...], str] = {}
    if len(request.common.programs) < 2:
        return
    for name, (*spot, _) in request.places.items():
        other = spots.setdefault(tuple(round(length, DECIMALS) for length in spot), name)
        if other != name:
            message = f"the places {other} and {name} are at one spot, where one part alone can lie"
            help = "state each place once; of one spot with several turns, the one to use"
            raise Refusal(Finding("PLC023", message, str(request.common.programs[0]), help=help))


def assign_places(values: Floats) -> Ints:
    """(P,) the place of each part, -1 without one, from ``values`` (P, Q), infinite where a pair is not feasible: as
    many parts as possible have one, and of all such assignments the sum of their values is the least (Kuhn's problem,
    solved as by Crouse 2016, doi:10.1109/TAES.2016.140952)."""
    feasible = np.isfinite(values)
    scale = float(np.max(values, where=feasible, initial=0.0)) or 1.0
    # one pair that is not feasible costs more than all others together
    cost = np.where(feasible, np.where(feasible, values, 0.0) / scale, 2.0 * len(values) + 1.0)
    rows, columns = linear_sum_assignment(cost)
    chosen = np.full(len(values), -1)
    chosen[rows] = np.where(feasible[rows, columns], columns, -1)
    return chosen


def _pair(problem: PlaceProblem, part: int, name: str, stated: tuple[float, float, float, float]) -> Pair:
    place = problem.room.present.copy()
    place[: TURN + 1] = np.array(stated) * UNITS[: TURN + 1]
    figures = exact_figures(problem, place)
    if isinstance(figures, PlacedFigures):
        return Pair(part, name, figures)
    message = f"at place {name}: {figures.message}"
    help = metre_places({name: stated}).get(name, figures.help)
    return Pair(part, name, None, replace(figures, message=message, help=help))


def _without(pairs: list[Pair], objective: str, program: str) -> Finding:
    """PLC017: why a part has no place."""
    lacks = [pair.lack for pair in pairs if pair.lack is not None]
    if len(lacks) == len(pairs):
        message = f"this part is feasible at no place; {lacks[0].message}"
        return Finding("PLC017", message, lacks[0].file, lacks[0].line)
    best = min(pairs, key=lambda pair: pair.value(objective))
    message = f"this part has no place: another part lies better at {best.place}"
    return Finding("PLC017", message, program)


def _written(
    request: AssignRequest, done: PartAssignment, problems: list[PlaceProblem], chosen: Ints, inputs: Inputs
) -> PartAssignment:
    """Writes the cell files and the result together."""
    common = request.common
    done = replace(done, exit=exit_code(done.findings, common.strict))
    if done.exit == 1:
        raise Refusal(*done.findings)
    files: dict[Path, bytes] = {}
    if request.cells is not None:
        for problem, at in zip(problems, chosen.tolist(), strict=True):
            if at < 0:
                continue
            path = request.cells / f"{problem.request.programs[0].stem}.cell.yaml"
            if real_path(path) in {real_path(other) for other in files}:
                raise Refusal(Finding("FIL007", "two outputs have the same name", str(path)))
            place = problem.room.present.copy()
            place[: TURN + 1] = np.array(list(request.places.values())[at]) * UNITS[: TURN + 1]
            files[path] = problem.moved.in_folder(problem.moved.at(place), path)
    names = [*files, *([] if common.json is None else [common.json])]
    done = replace(done, outputs=tuple(str(path) for path in names))
    if common.json is not None:
        files[common.json] = json_bytes(done)
    read = [inputs, *(one.inputs for problem in problems for one in problem.prepared)]
    for one in read:
        one.refuse_outputs(names)

    def refuse_changed() -> None:
        for one in read:
            one.refuse_changed()

    refuse_changed()
    write_atomically(files, still=refuse_changed)
    return done
