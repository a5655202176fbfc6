"""A G-code program as a Toolpath: what the blocks ask for, where they end, and why some are not corrected."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Floats, Ints, shared
from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.base.geometry import Poses, rotation_from_abc
from postproc.base.memory import without_garbage_collection
from postproc.base.units import DEG
from postproc.languages.core.comments_in_force import CONTRADICTED
from postproc.languages.dialect import PLAIN, Program, ReadingSettings
from postproc.languages.gcode import offsets
from postproc.languages.gcode.block_arcs import arcs_of_blocks, given_by_point, unevenly_scaled
from postproc.languages.gcode.blocks import (
    AXES,
    BlockWords,
    Reasons,
    blocks,
    frame_events,
    tilted,
)
from postproc.languages.gcode.cell_options import INTEGER_WORDS, ROTARY_WORDS, TURN_PART
from postproc.languages.gcode.comments import remarks
from postproc.languages.gcode.control import (
    Control,
    Feed,
    Group,
    Move,
    Once,
    ToolAxis,
)
from postproc.languages.gcode.correctability import (
    Built,
    bind_names,
    check_correctability,
    locked_rows,
    no_insert_before,
)
from postproc.languages.gcode.cycle_ends import cycle_ends
from postproc.languages.gcode.diagnostics import diagnostics
from postproc.languages.gcode.drill_cycles import (
    DrillCycles,
    beside_holes,
    drill_cycles,
    stated_coordinates,
    with_holes,
)
from postproc.languages.gcode.execution import execute
from postproc.languages.gcode.external_axes import addresses, external_axes, moves_external, others_move
from postproc.languages.gcode.feeds import Feeds, blend_tolerances, blends, waits_after, with_stops
from postproc.languages.gcode.frame_changes import frame_blocks, frame_change
from postproc.languages.gcode.integer_words import integer_words
from postproc.languages.gcode.macro_arguments import without_arguments, without_modal_arguments
from postproc.languages.gcode.modal import modal
from postproc.languages.gcode.modal_fill import FilledRows, everywhere
from postproc.languages.gcode.motions import GcodeMotions
from postproc.languages.gcode.numbered import WorkOffsets, references, tool_lengths, tools, work_offsets
from postproc.languages.gcode.orientation_words import OrientationWords
from postproc.languages.gcode.polar_coordinates import polar_targets
from postproc.languages.gcode.positions import Positions, Trace, stated_place
from postproc.languages.gcode.program_passes import OTHERWISE_REPEATED, ProgramPass, differs_when_repeated
from postproc.languages.gcode.reference_points import reference_angles
from postproc.languages.gcode.refusals import RefusalCollector
from postproc.languages.gcode.source_map import STATE, FoldedNumbers, GcodeSourceMap
from postproc.languages.gcode.stated_kinematics import with_stated_kinematics
from postproc.languages.gcode.subprogram_files import files_read_too, join
from postproc.languages.gcode.tool_orientation import ToolOrientations
from postproc.languages.gcode.tool_tilts import tilting
from postproc.languages.gcode.words import key
from postproc.toolpath import (
    Arcs,
    EditConstraints,
    Kind,
    MotionSequence,
    MotionSpeeds,
    OrientationControl,
    ProgramComments,
    Reflections,
    Targets,
    Toolpath,
)

PART = 1 << 14
"""Blocks whose motions are worked out at a time."""


@without_garbage_collection()
def read(documents: tuple[Document, ...], control: Control, settings: ReadingSettings = PLAIN) -> Program:
    """Read a program; never raises on its content."""
    first = _read(documents, control, settings)
    if not first.execution.restarts:
        return first.program
    elsewhere = differs_when_repeated(first, lambda block: _read(documents, control, settings, block))
    return (
        _read(documents, control, settings, elsewhere=elsewhere).program if elsewhere.any() else first.program
    )


def _read(
    documents: tuple[Document, ...],
    control: Control,
    settings: ReadingSettings,
    again: int | None = None,
    elsewhere: Bools | None = None,
) -> ProgramPass:
    """A program read; again: as of ``execute``; elsewhere (N,): motions that are others when M99 has led back."""
    document = documents[0]
    joined = join(document.raw, settings.siblings, control)
    text = without_modal_arguments(joined.source, control)
    integers = integer_words(text, control, settings.options.get(INTEGER_WORDS, ""))
    own = joined.blocks if joined.files else None
    execution = execute(text, control, settings.symbols, own, integers, again)
    if joined.files and not execution.followed:
        return _read(documents, control, replace(settings, siblings=()), again, elsewhere)
    offsets_in_text = execution.source.blocks.start
    source, foreign = joined.at_the_calls(execution.source)
    source = without_arguments(source, control)
    execution = replace(execution, source=source)
    in_force = modal(execution, control, settings.initial.base)
    in_force = with_stated_kinematics(source, in_force, settings.options.get(ROTARY_WORDS, ""))
    given = blocks(source, in_force, control, integers)
    rows = np.flatnonzero(given.motion).astype(np.int32)
    offset = work_offsets(given)
    base = offset.base[rows]
    tool, named = tools(given, settings.initial.tool)
    folded_codes = np.isin(execution.folded.key, (key("G"), key("M")))
    computed = np.isin(rows, execution.folded.step[folded_codes])
    unbound = bind_names(execution)

    def followed(words: BlockWords) -> FollowedMotions:
        collector = RefusalCollector(len(rows))
        for file in joined.files:
            message = f"the motion is in {file.path.name}, which is read and not written"
            collector.refuse(joined.of_file(file, offsets_in_text[rows]), "GCO033", message)
        collector.refuse(computed, "GCO005", "a G or M code of the block is computed")
        if elsewhere is not None:
            collector.refuse(elsewhere, "GCO006", OTHERWISE_REPEATED)
        return _followed(words, rows, offset, base, tool, settings, unbound, collector)

    run, coordinates = followed(given), False
    if run.differing_radii and control.iso and given.modal.ahead[Group.ARCS] == 0:
        # Centres that no code says to be differences may be coordinates: where all arcs are some only so.
        other = given.with_absolute_centres()
        if other is not None and not (absolute := followed(other)).differing_radii:
            given, run, coordinates = other, absolute, True
    found, built, frames, orientations, collector = (
        run.columns,
        run.built,
        run.frames,
        run.orientations,
        run.collector,
    )
    lines = source.blocks
    line, start = lines.line[rows], lines.start[rows]
    axes = addresses(settings.external_words if control.further else {})
    external = external_axes(given, rows, axes)
    if control.further and (others := others_move(given, axes)):
        moving = ", ".join(f"{name} (line {lines.line[block]})" for name, block in sorted(others.items())[:6])
        message = f"axes move that are none of X, Y, Z, E1 to E6 and the rotary ones: {moving}"
        first = min((name for name in others if name[0] not in "ABCE"), default="")
        stated = f"external_axes: {{E1: {{kind: fixed, word: {first}}}}}"
        help_ = f"state in the cell what they carry: {stated} where it moves neither robot nor part; or kind: track"
        help_ = help_ if first else ""
        collector.refuse(np.ones(len(rows), np.bool_), "GCO026", message, help_)
    said = remarks(document, source, rows, execution, given.modal.flow)
    collector.refuse(said.varying, "GCO006", CONTRADICTED)
    refused = collector.done(document, line, start, lines.first[rows])
    frame_of_base, frame_of_tool, cell_frames = references(base, tool[rows], line, offset.stated)
    state = {name: found.take_column(name) for name in STATE}
    inverse_time = state["feed_mode"] == Feed.INVERSE_TIME
    drilled = found.take_column("drills")
    path = Toolpath(
        targets=Targets(
            kind=built.kind,
            position=found.take_column("place"),
            rotation=found.take_column("rotation"),
            axes=everywhere(np.full(6, np.nan), len(rows)),
            base=frame_of_base,
            tool=frame_of_tool,
            frames=cell_frames,
            external=external,
        ),
        line=line,
        speeds=MotionSpeeds(
            feed=found.take_column("feed"),
            spindle=shared(found.take_column("spindle")),
            inverse_time_feed=inverse_time if inverse_time.any() else everywhere(False, len(rows)),
        ),
        sequence=MotionSequence(
            approximation=with_stops(found.take_column("blend"), given, rows),
            continues=~(drilled | np.append(False, drilled[:-1])[: len(rows)]),
            drills=drilled,
            waits=shared(waits_after(given, rows)),
        ),
        constraints=EditConstraints(
            refused=refused,
            locked=locked_rows(document, given, built, collector, execution, run.levels),
            no_insert_before={
                **moves_external(external),
                **no_insert_before(given, rows, foreign),
                **beside_holes(drilled),
            },
            orientation_programmed=found.take_column("orientation_programmed"),
            exact_stays=True,
            ptp_may_change_configuration=False,
        ),
        arcs=Arcs(*(found.take_column(name) for name in ("centre", "normal", "sweep", "plane_free"))),
        orientation_control=OrientationControl(
            path=found.take_column("orientation_path"),
            **{
                name: found.take_column(name)
                for name in ("rotary_from", "rotary_to", "redundant_axis", "part_turn", "in_machine")
            },
        ),
        remarks=ProgramComments(said.annotations, said.comments),
        reflections=Reflections.of_frames(run.reflections, state["frame"]),
    )
    findings = [
        *files_read_too(document, joined, execution.missing),
        *refused.findings(),
        *diagnostics(document, given, rows, tool, named, settings),
    ]
    if run.along_plane >= 0:
        message = "the tool is taken as turned to the normal of the plane by the least angle"
        at = int(lines.line[run.along_plane])
        findings.append(Finding("GCO034", message, str(document.path), at, 1))
    if coordinates:
        message = "I J K are read as coordinates: only so the radii of the arcs agree"
        arc = np.flatnonzero(built.kind == Kind.CIRC)[:1]
        findings += [
            Finding("GCO031", message, str(document.path), int(line[row]), 1) for row in arc.tolist()
        ]
    program = Program(
        control.name,
        documents,
        path,
        GcodeSourceMap(
            **state,
            raw=document.raw,
            control=control,
            start=start,
            stop=lines.stop[rows],
            frames=frames,
            orientations=orientations,
            folded=FoldedNumbers.of(execution.folded, rows),
        ),
        tuple(sorted(findings, key=lambda finding: finding.line)),
        said.marker,
        said.marker_at,
        (),
        execution.missing,
    )
    return ProgramPass(program, execution, rows)


class FollowedMotions(NamedTuple):
    """The motions' columns, what others build on, the frames of the program, what its orientation words mean, and why
    motions are refused; differing_radii: arcs whose radii at start and end differ; levels (K,): blocks that state the
    level to which a drill cycle goes back; along_plane: the first block that brings the tool along a plane, -1;
    reflections (F, 3, 3): of the frames."""

    columns: FilledRows
    built: Built
    frames: Poses
    orientations: tuple[OrientationWords, ...]
    collector: RefusalCollector
    reflections: Floats
    differing_radii: int
    levels: Ints
    along_plane: int


def _followed(
    words: BlockWords,
    rows: Ints,
    offset: WorkOffsets,
    base: Ints,
    tool: Ints,
    settings: ReadingSettings,
    unbound: str,
    collector: RefusalCollector,
) -> FollowedMotions:
    """The motions in the blocks ``rows`` (N,), part by part; base (N,), tool (B,): numbers."""
    turned = None if settings.orientation is None else rotation_from_abc(settings.orientation)
    events = frame_blocks(words)
    at_start, by_setting = stated_place(settings.initial.words), words.control.increments_by_setting
    trace = Trace(offsets.start(), events, frame_change(words, events), at_start, by_setting)
    feeds, tool_orientations, away, reasons = (
        Feeds(words),
        ToolOrientations(words, turned, settings.options.get(ROTARY_WORDS) == TURN_PART),
        tilted(words, tilting(words)),
        Reasons(len(words)),
    )
    allowed = blend_tolerances(words)
    lengths = tool_lengths(words, tool)
    ends = cycle_ends(words, events, lengths.changes | offset.changed)
    references_reached = reference_angles(words, settings.symbols)
    polar = polar_targets(words)
    drills = drill_cycles(words, events, offset.changed, lengths.changes)
    found, differing = FilledRows(len(rows)), 0
    for start in range(0, max(len(words), 1), PART):
        stop = min(start + PART, len(words))
        low, high = np.searchsorted(rows, [start, stop]).tolist()
        here, own = words.part(start, stop), rows[low:high] - start
        way = frame_events(
            here,
            offset.changed[start:stop],
            away[start:stop],
            ends.level[start:stop],
            lengths.changes[start:stop],
            references_reached[start:stop],
            polar.part(start, stop),
            reasons,
        )
        where = trace.follow(way, start)
        holes = drills.part(start, stop)
        moves = _motions(here, where, trace, own, tool_orientations, holes)
        differing += int((moves.arcs.wrong == 3).sum())
        part = collector.part(slice(low, high))
        cutting = np.isin(moves.kind, (Kind.LIN, Kind.CIRC)) & lengths.off[rows[low:high]]
        part.refuse(cutting, "GCO029", "the program has switched the tool's length off")
        check_correctability(here, moves, where, base[low:high], tool[rows[low:high]], reasons, unbound, part)
        found.put(
            high - low,
            **_columns(here, where, moves, feeds, tool_orientations.turning_part),
            blend=np.where(np.isfinite(moves.room), 0.0, blends(here, own, allowed)),
            sets=stated_coordinates(ends.stated(way.sets[own, :3], rows[low:high]), moves, holes),
            lost=way.unknown[own, :3],
        )
    built = Built(rows, *(found.take_column(name) for name in ("kind", "sets", "lost", "turned")))
    frames = Poses(
        np.array([frame.turn for frame in trace.frames]),
        np.array([frame.shift[:3] for frame in trace.frames]),
    )
    levels = np.unique(ends.source[np.isfinite(drills.depth) & (ends.source >= 0)])
    along = [number for number, frame in enumerate(trace.frames) if frame.tool == ToolAxis.NORMAL]
    return FollowedMotions(
        found,
        built,
        frames,
        tuple(tool_orientations.orientations),
        collector,
        np.array([frame.reflection for frame in trace.frames]),
        differing,
        levels,
        int(trace.started(np.array(along[:1], np.int64))[0]) if along else -1,
    )


def _columns(
    words: BlockWords, where: Positions, moves: GcodeMotions, feeds: Feeds, turning_part: Bools
) -> dict[str, NDArray[Any]]:
    """What is kept of the motions of a part; turning_part (3,): as of ``ToolOrientations``."""
    rows, force, stand = moves.block, words.modal.force, moves.tool_orientation
    place = moves.place.copy()
    # beside the contour, by the tool's radius: that is also where the motion after G40 starts
    beside = force[Group.RADIUS][rows] != 0
    place[(words.modal.flow.reason[rows] != 0) | beside | np.isnan(place).any(axis=1)] = np.nan
    placed = ~np.isnan(place[:, :1])
    feed = feeds.of(rows + words.start, moves.length)
    part_turn = everywhere(np.full(3, np.nan), len(rows))
    if turning_part.any():
        at_tip = force[Group.TCP][rows] == 1
        part_turn = np.where(at_tip[:, None], np.nan, np.where(turning_part, moves.end[:, 3:] * DEG, 0.0))
        # without a TCP mode F is also that of the axes that turn the part
        turning = words.has(*AXES[3:])[rows] & (force[Group.TCP][rows] != 1)
        turning &= force[Group.FEED][rows] != Feed.INVERSE_TIME
        feed[turning & (moves.start[:, 3:] != moves.end[:, 3:]).any(axis=1)] = np.nan
    rotary_from, rotary_to = stand.rotary
    return {
        "kind": moves.kind,
        "place": place,
        "rotation": stand.rotation,
        "spindle": np.where(words.modal.flow.reason[rows] != 0, np.nan, feeds.speeds(rows + words.start)),
        "feed": np.where(moves.kind == Kind.PTP, np.nan, feed),
        "centre": np.where(placed, moves.centre, np.nan),
        "normal": np.where(placed, moves.normal, np.nan),
        "sweep": np.where(placed[:, 0], moves.arcs.sweep, np.nan),
        # controls accept no rotary words in a drill cycle
        "orientation_programmed": stand.writable & np.isnan(moves.room),
        "redundant_axis": stand.redundant_axis,
        "in_machine": stand.in_machine,
        "orientation_path": stand.path,
        "rotary_from": rotary_from,
        "rotary_to": rotary_to,
        "part_turn": part_turn,
        "plane_free": given_by_point(words, rows),
        "turned": stand.stated | (stand.orient < 0),
        "move": moves.move,
        "plane": force[Group.PLANE][rows],
        "incremental": force[Group.DISTANCE][rows] == 1,
        "arc_absolute": force[Group.ARCS][rows] == 1,
        "scale": words.length[rows],
        "increment": words.length_of_integer[rows],
        "frame": where.frame[rows],
        "start_position": moves.start[:, :3],
        "drills": np.isfinite(moves.room),
        "room": moves.room,
        "orient": stand.orient,
        "turned_values": stand.values,
        "turned_before": stand.before,
        "feed_mode": force[Group.FEED][rows],
    }


def _motions(
    words: BlockWords,
    where: Positions,
    trace: Trace,
    rows: Ints,
    tool_orientations: ToolOrientations,
    holes: DrillCycles,
) -> GcodeMotions:
    start, end = where.start[rows], where.end[rows]
    force, move = words.modal.force, words.move[rows]
    plane = force[Group.PLANE][rows]
    is_arc = np.isin(move, (Move.CLOCKWISE, Move.COUNTER, Move.THROUGH)) & ~words.machine[rows]
    is_arc &= ~unevenly_scaled(words, rows, plane, where)
    desired_path = arcs_of_blocks(words, rows, start, end, plane, is_arc)
    kind = KINDS[move]
    kind[words.modal.has(Once.HOME)[rows]] = Kind.PTP
    kind[words.modal.has(Once.PROBE)[rows]] = Kind.LIN
    kind[force[Group.AXIAL][rows] != 0] = Kind.PTP
    kind[words.modal.unknown[rows]] = Kind.OTHER
    pose = tool_orientations.of(trace, where, rows, words.start, kind == Kind.PTP)
    moves = GcodeMotions.of(rows, move, kind, plane, where, desired_path, pose)
    return with_holes(moves, holes, where)


KINDS = np.full(len(Move) + 1, Kind.OTHER, np.int8)
KINDS[[Move.RAPID, Move.LINE, Move.CLOCKWISE, Move.COUNTER, Move.THROUGH]] = (
    Kind.PTP,
    Kind.LIN,
    Kind.CIRC,
    Kind.CIRC,
    Kind.CIRC,
)
"""By Move; the last entry is that of UNKNOWN."""
