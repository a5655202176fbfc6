"""What is asked of a placement, read and checked: programs, cell, room, and how places are compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import noted, provided
from postproc.base.read_files import read_file
from postproc.base.units import DEG, MM
from postproc.compensation.uncertain_inputs import FORCE, input_uncertainties
from postproc.effects import ComplianceLaw, Load
from postproc.model import StiffnessModel
from postproc.placement.collisions import CollisionShapes
from postproc.placement.force_turns import turned_forces
from postproc.placement.part_motions import PartMotions, join_motions
from postproc.placement.room import FREEDOMS, TRACK, UNITS, Room
from postproc.placement.score_places import COVERAGE, UNCERTAINTY, InputSpread, Scoring
from postproc.process.force_sources import not_requested
from postproc.robot.external_axes import own_column
from postproc.workflows.place_cell import MovedCell
from postproc.workflows.place_collisions import collision_shapes
from postproc.workflows.place_motions import base_of_cuts, build_motions, cell_of_all, track_of
from postproc.workflows.preparation import Prepared, Request, prepare, read_program

PROBE = 1 * DEG
"""Turn of the part by which forces in world axes are distinguished from others."""

SENSES = 4
"""Senses in which the forces are turned for the mean over their interval, beside the stated ones."""

AVERAGED = np.sqrt(2.0 * (SENSES + 1) / SENSES) / 1.96
"""Turn of those forces in half widths of the interval: their mean square about each of the two axes across the force,
with the stated ones in the mean, is that of a normal one whose 95 % interval the direction's is."""


@dataclass(frozen=True)
class PlaceRequest:
    """What the user asked for.  ranges: freedom -> (from, to) [mm or deg]; objective: one of ``OBJECTIVES``; direction:
    half width [deg] of the interval of the forces' direction, None for the cell's; limit_margin, singularity_margin
    [deg]; output: the new cell file; spin: whether the tool may turn about its spindle along the path; spin_output:
    folder of the programs that do; searched: whether places are looked for, not only those that are given;
    collisions: URDF with collision shapes, None for the robot file's own."""

    programs: tuple[Path, ...]
    force: str | None = None
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    objective: str = "across"
    direction: float | None = None
    limit_margin: float = 5.0
    singularity_margin: float = 5.0
    top: int = 10
    cell: Path | None = None
    robot: str | None = None
    config_dat: Path | None = None
    tare: bool = False
    output: Path | None = None
    picture: Path | None = None
    page: Path | None = None
    json: Path | None = None
    spin: bool = False
    spin_output: Path | None = None
    strict: bool = False
    searched: bool = True
    collisions: Path | None = None


@dataclass(frozen=True, eq=False)
class PlaceProblem:
    """Programs, their cell and what moves: all that places are compared by.  shapes: by which collisions are checked, a
    Finding that states why there are none, None where no URDF is known; few (K,): the motions that the search ended
    with."""

    request: PlaceRequest
    prepared: tuple[Prepared, ...]
    moved: MovedCell
    room: Room
    motions: PartMotions
    scoring: Scoring
    shapes: CollisionShapes | Finding | None = None
    few: Ints = field(default_factory=lambda: np.empty(0, np.int64))

    @property
    def model(self) -> StiffnessModel:
        """The one of all programs."""
        return self.prepared[0].task.model


def place_problem(request: PlaceRequest) -> PlaceProblem:
    """Reads all programs and finds what moves, where to, and by what it is compared.  Raises Refusal."""
    prepared = tuple(prepare(_main(request, path)) for path in request.programs)
    first = prepared[0]
    cell = cell_of_all([one.cell for one in prepared])
    for one, path in zip(prepared, request.programs, strict=True):
        if request.force is None:
            raise Refusal(not_requested(path, one.program.toolpath, cell))
    base = base_of_cuts(first)
    ranges = {**({} if cell.room is None else cell.room.ranges), **request.ranges}
    track = _track(request, prepared) if "track" in ranges else None
    if "track" in ranges and track is None:
        message = "neither the robot nor the cell has a linear track whose place the cell states"
        raise Refusal(Finding("PLC003", message, str(cell.path), help="omit --track"))
    turned = "tool_turn" in ranges
    about_spindle = turned or request.spin
    parts = [build_motions(one, base, about_spindle, None if track is None else track[0]) for one in prepared]
    motions = join_motions(parts)
    if "turn" in ranges:
        motions = replace(motions, world=_world_forces(request, prepared, base, parts))
    tools = {
        number
        for one in prepared
        for frame in np.unique(one.task.toolpath.tool[one.task.carries]).tolist()
        if (number := one.task.toolpath.frames[frame].number) is not None
    }
    joint = first.robot.external if track is not None and own_column(first.robot) is not None else None
    moved = MovedCell(
        cell,
        _cell_bytes(cell.path),
        base,
        tuple(sorted(tools)) if turned else (),
        None if track is None else track[0],
        joint,
    )
    room = _room(request, prepared, motions, ranges, track)
    shapes = collision_shapes(request.collisions, first)
    return PlaceProblem(request, prepared, moved, room, motions, _scoring(request, prepared, motions), shapes)


def _track(request: PlaceRequest, prepared: tuple[Prepared, ...]) -> tuple[str, float, float] | None:
    """As of ``track_of``, of all programs as they are written."""
    found = None
    for path, ready in zip(request.programs, prepared, strict=True):
        _, read, _ = read_program(path, ready.cell, request.config_dat)
        found = track_of(ready, ~np.isnan(read.toolpath.external))
    return found


def _cell_bytes(path: Path) -> bytes:
    """The bytes of a file that was read before, noted as an input.  Raises Refusal FIL001, FIL010."""
    return read_file(path)


def prepared_at(
    moved: MovedCell, place: Floats, request: PlaceRequest, texts: Mapping[Path, bytes] = MappingProxyType({})
) -> tuple[Prepared, ...]:
    """All programs as they run with the part at ``place`` (6,): the main job's own preparation of them, on the cell
    file that would be written; ``texts``: what files of the programs contain instead.  Raises Refusal as that does."""
    with noted(), provided({moved.cell.path: moved.at(place), **texts}):
        return tuple(prepare(_main(request, path)) for path in request.programs)


def input_spread(ready: Prepared) -> InputSpread:
    """What the objective ``uncertainty`` varies.  Raises Refusal PLC008 where no figure has an interval."""
    cell, model = ready.cell, ready.task.model
    known = input_uncertainties(model, cell.force_ci95, True, cell.force_vector)
    elastic = {
        index for index, term in enumerate(model.terms) if isinstance(term.effect, ComplianceLaw | Load)
    }
    models = tuple(
        model.with_values({(entry.term, entry.parameter): entry.value + entry.deviation})
        for entry in known.entries
        if entry.term in elastic and entry.deviation
    )
    force = next((entry.deviation for entry in known.entries if entry.name == FORCE), None) or 0.0
    if ready.task.force.ci95 is not None and cell.force_ci95 is None:
        force = float(np.nan_to_num(ready.task.force.ci95).max()) / COVERAGE
    if not models and not force:
        message = "no figure that the error depends on has an interval, so no place has a known uncertainty"
        help = "state force_ci95 in the cell, or ci in the robot file; or use another --objective"
        raise Refusal(Finding("PLC012", message, str(cell.path), help=help))
    return InputSpread(models, force)


def _main(request: PlaceRequest, path: Path) -> Request:
    return Request(
        program=path,
        force=request.force,
        cell=request.cell,
        robot=request.robot,
        config_dat=request.config_dat,
        tare=request.tare,
    )


def _room(
    request: PlaceRequest,
    prepared: tuple[Prepared, ...],
    motions: PartMotions,
    ranges: Mapping[str, tuple[float, float]],
    track: tuple[str, float, float] | None,
) -> Room:
    cell = prepared[0].cell
    present = np.array([*motions.origin, 0.0, 0.0, motions.track_now])
    lower, upper = present.copy(), present.copy()
    polygon = None if cell.room is None else cell.room.polygon
    if polygon is not None:
        lower[:2], upper[:2] = polygon.min(axis=0), polygon.max(axis=0)
    for name, (low, high) in ranges.items():
        at = FREEDOMS.index(name)
        ends = np.array([low, high]) * UNITS[at]
        if polygon is not None and at < 2:
            ends = np.array([max(ends[0], lower[at]), min(ends[1], upper[at])])
            if ends[0] > ends[1] or (ends[0] == ends[1] and low < high):
                message = f"the polygon of the room and the range of {name} have no place in common"
                raise Refusal(Finding("PLC002", message, str(cell.path)))
        lower[at], upper[at] = ends
    if track is not None and (lower[TRACK] < track[1] or upper[TRACK] > track[2]):
        message = f"the range of the track exceeds its limits {track[1] / MM:g} .. {track[2] / MM:g} mm"
        raise Refusal(Finding("PLC003", message, str(cell.path), help="state a range within the limits"))
    if request.searched and not (upper > lower).any() and not (request.spin and (lower == present).all()):
        message = "no freedom has a range: there is no place to search for"
        help = (
            "use --x a:b, --y a:b, --z a:b, --turn a:b, --tool-turn a:b or --spin, or state room: in the cell"
        )
        raise Refusal(Finding("PLC003", message, str(cell.path), help=help))
    return Room(lower, upper, present, polygon)


def stated_direction(ready: Prepared, request: PlaceRequest) -> float:
    """[deg] half width of the interval of the forces' direction."""
    if request.direction is not None:
        return request.direction
    vector = ready.cell.force_vector
    return 0.0 if vector is None else vector.direction / DEG


def _scoring(request: PlaceRequest, prepared: tuple[Prepared, ...], motions: PartMotions) -> Scoring:
    ready = prepared[0]
    direction = stated_direction(ready, request) * DEG
    sets = [motions.force[None]]
    if direction > 0:
        sets.append(turned_forces(motions.force, direction * AVERAGED, SENSES))
    unloaded = not ready.task.process and not ready.task.model.zero_without_load
    return Scoring(
        request.objective,
        request.limit_margin * DEG,
        request.singularity_margin * DEG,
        np.concatenate(sets),
        input_spread(ready) if request.objective == UNCERTAINTY else InputSpread(),
        unloaded and ready.task.touched_off is None,
    )


def _world_forces(
    request: PlaceRequest, prepared: tuple[Prepared, ...], base: int, parts: list[PartMotions]
) -> Bools:
    """(R,) places whose force does not turn with the part: it is the same when the part is turned a little."""
    first = parts[0]
    moved = MovedCell(prepared[0].cell, _cell_bytes(prepared[0].cell.path), base, ())
    place = np.array([*first.origin, PROBE, 0.0, first.track_now])
    fixed = []
    for one, part in zip(prepared_at(moved, place, request), parts, strict=True):
        other = build_motions(one, base, False, None)
        same = np.abs(other.force[other.scored] - part.force[part.scored]).max(axis=1) < 1e-6
        world = part.scored.copy()
        world[part.scored] = same
        fixed.append(world)
    return np.concatenate(fixed)
