"""A G-code program as a Toolpath: what the blocks ask for, where they end, and why some are not corrected."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.dialects.dialect import PLAIN, Program, Settings
from postproc.dialects.gcode import offsets
from postproc.dialects.gcode.arcs import Arcs, arcs, through
from postproc.dialects.gcode.blocks import THROUGH, Blocks, blocks, course
from postproc.dialects.gcode.comments import remarks
from postproc.dialects.gcode.control import Control, Event, Feed, Frame, Group, Move, Once
from postproc.dialects.gcode.feeds import feeds
from postproc.dialects.gcode.judging import judged, pinned
from postproc.dialects.gcode.lexing import FARTHEST, lex
from postproc.dialects.gcode.modal import modal
from postproc.dialects.gcode.motions import Motions
from postproc.dialects.gcode.numbered import references, spoiled, tools
from postproc.dialects.gcode.places import COLUMNS, Places
from postproc.dialects.gcode.positions import Positions, positions
from postproc.dialects.gcode.stands import stands
from postproc.dialects.gcode.telling import told
from postproc.dialects.gcode.words import How, Note, Text, key
from postproc.document import Document
from postproc.geometry import Poses, rotation_from_abc
from postproc.toolpath import Kind, Toolpath
from postproc.units import MM


def read(documents: tuple[Document, ...], control: Control, settings: Settings = PLAIN) -> Program:
    """Read a program; never raises on its content."""
    document = documents[0]
    text = lex(document.raw, control)
    given = blocks(text, modal(text, control), control, control.increments and settings.integer_words == "um")
    offset = spoiled(given)
    way, reasons, reason = course(given, offset.at)
    events = _events(given)
    where = positions(way, offsets.start(), events, _change(given, events))
    tool, named = tools(given)

    rows = np.flatnonzero(given.motion)
    base = np.where(offset.bad, -1, given.modal.force[Group.OFFSET])[rows]
    turned = None if settings.orientation is None else rotation_from_abc(settings.orientation)
    moves = _motions(given, where, rows, turned)
    doubts = judged(given, moves, where, base, tool[rows], reasons, reason)
    start = text.blocks.start[rows]
    refused = doubts.done(document, text.blocks.line[rows], start, _first(text)[rows])
    frame_of_base, frame_of_tool, frames = references(base, tool[rows], text.blocks.line[rows])
    said = remarks(document, text, text.blocks.line[rows])
    place = moves.place.copy()
    place[(given.modal.flow.doubt[rows] != 0) | np.isnan(place).any(axis=1)] = np.nan
    placed = ~np.isnan(place[:, :1])
    path = Toolpath(
        kind=moves.kind,
        position=place,
        rotation=moves.stand.rotation,
        axes=np.full((len(rows), 6), np.nan),
        feed=np.where(moves.kind == Kind.PTP, np.nan, feeds(given, rows, moves.length)),
        base=frame_of_base,
        tool=frame_of_tool,
        status=np.full(len(rows), -1),
        turn=np.full(len(rows), -1),
        line=text.blocks.line[rows],
        frames=frames,
        refused=refused,
        pinned=pinned(document, given, moves, way, doubts),
        annotations=said.annotations,
        centre=np.where(placed, moves.centre, np.nan),
        normal=np.where(placed, moves.normal, np.nan),
        sweep=np.where(placed[:, 0], moves.arcs.sweep, np.nan),
        blend=_blend(given, rows),
        whole=_whole(given, rows),
        comments=said.comments,
        oriented=moves.stand.oriented,
        free_axis=moves.stand.free_axis,
        any_plane=_by_point(given, rows),
        timed=given.modal.force[Group.FEED][rows] == Feed.INVERSE_TIME,
        branches=False,
    )
    findings = [*refused.told(), *told(document, given, rows, tool, named, settings)]
    return Program(
        control.name,
        documents,
        path,
        _places(given, where, moves),
        tuple(sorted(findings, key=lambda finding: finding.line)),
        said.marker,
        said.marker_at,
        (),
    )


def _first(text: Text) -> Ints:
    """(B,) offset of the first word of every block, or of the block."""
    first = text.blocks.start.copy()
    first[text.words.block[::-1]] = text.words.at[::-1]
    return first


def _events(given: Blocks) -> Ints:
    """Blocks that change the frame: G92 and G52 only with coordinates."""
    mentioned = given.has(*(key(letter) for letter in "XYZABC"))
    always = given.modal.has(Once.UNSHIFT, Once.SUSPEND, Once.RESTORE, Once.FRAME)
    return np.flatnonzero(
        (always | (given.modal.has(Once.SHIFT, Once.LOCAL) & mentioned)) & given.modal.flow.tape
    )


def _change(given: Blocks, events: Ints) -> Callable[[int, Frame, Floats], Frame]:
    """The frame behind a block that changes it; unknown where the block may not run."""
    words, change = given.text.words, given.control.frame
    notes: dict[int, list[Note]] = {block: [] for block in events.tolist()}
    for note in given.text.notes if notes else ():
        if note.block in notes:
            notes[note.block].append(note)
    first = np.searchsorted(words.block, np.arange(len(given) + 1))

    def changed(block: int, frame: Frame, position: Floats) -> Frame:
        rows = slice(int(first[block]), int(first[block + 1]))
        keys, values, hows = words.key[rows].tolist(), words.value[rows].tolist(), words.how[rows].tolist()
        small = given.length_of_integer[block] / given.length[block]
        values = [
            value * small if how == How.INTEGER else value for value, how in zip(values, hows, strict=True)
        ]
        codes = tuple(
            value for one, value in zip(keys, words.value[rows].tolist(), strict=True) if one == key("G")
        )
        event = Event(
            dict(zip(keys, values, strict=True)),
            int(given.modal.once[block]),
            tuple(notes.get(block, ())),
            codes,
            int(given.modal.force[Group.PLANE][block]),
            float(given.length[block]),
            frame,
            position,
        )
        after = change(event)
        after = replace(after, shift=np.where(np.abs(after.shift) > FARTHEST * MM, np.nan, after.shift))
        if given.modal.flow.doubt[block]:
            same = (after.shift == frame.shift) | (np.isnan(after.shift) & np.isnan(frame.shift))
            return Frame(after.turn, np.where(same, frame.shift, np.nan), after.memory)
        return after

    return changed


def _motions(given: Blocks, where: Positions, rows: Ints, turned: Floats | None) -> Motions:
    begin, end = where.begin[rows], where.end[rows]
    force, move = given.modal.force, given.move[rows]
    plane = force[Group.PLANE][rows]
    bent = np.isin(move, (Move.CLOCKWISE, Move.COUNTER, Move.THROUGH)) & ~given.machine[rows]
    ways = _arcs(given, rows, begin, end, plane, bent)
    kind = KINDS[move]
    kind[given.modal.has(Once.HOME)[rows]] = Kind.PTP
    kind[given.modal.has(Once.PROBE)[rows]] = Kind.LIN
    kind[force[Group.AXIAL][rows] != 0] = Kind.PTP
    kind[given.modal.unknown[rows] >= 0] = Kind.OTHER
    pose = stands(given, where, rows, kind == Kind.PTP, turned)
    return Motions.of(rows, move, kind, plane, begin, end, where, ways, pose)


def _by_point(given: Blocks, rows: Ints) -> Bools:
    """(N,) arcs, if they are some, that a point on their way gives."""
    words = given.has(*THROUGH)[rows] if THROUGH[0] in given.columns else np.zeros(len(rows), np.bool_)
    return np.asarray(words | (given.move[rows] == Move.THROUGH))


def _arcs(given: Blocks, rows: Ints, begin: Floats, end: Floats, plane: Ints, bent: Bools) -> Arcs:
    n = len(rows)
    result = Arcs(np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full(n, np.nan), np.zeros(n, np.int64))
    between = _by_point(given, rows)
    word, usual = given.control.turns
    turns = np.zeros(n)
    if word in given.columns:
        turns = np.nan_to_num(given.number(word)[rows] - usual)
    for some, keys in ((bent & ~between, tuple(key(letter) for letter in "IJK")), (bent & between, THROUGH)):
        if not some.any():
            continue
        at = rows[some]
        hows = np.stack([given.how(one)[at] for one in keys], axis=1)
        values = np.stack([given.lengths(one)[at] for one in keys], axis=1)
        group = Group.DISTANCE if keys is THROUGH else Group.ARCS
        relative = given.modal.force[group][at] == 1
        absolute = np.where(hows == How.ABSOLUTE, True, (relative != (group == Group.DISTANCE))[:, None])
        absolute &= hows != How.INCREMENTAL
        if keys is THROUGH:
            via = np.where(absolute & (hows >= 0), values, begin[some, :3] + np.where(hows >= 0, values, 0.0))
            found = through(begin[some, :3], via, end[some, :3], turns[some])
        else:
            counter, radius = given.move[at] == Move.COUNTER, given.lengths(key("R"))[at]
            found = arcs(
                begin[some, :3], end[some, :3], plane[some], counter, values, absolute, radius, turns[some]
            )
        for name in ("centre", "normal", "sweep", "wrong"):
            getattr(result, name)[some] = getattr(found, name)
    return result


def _blend(given: Blocks, rows: Ints) -> Floats:
    """(N,) [m]: 0 in exact modes, what P of G64 allows, NaN where nothing bounds it."""
    path = given.modal.force[Group.PATH]
    code = np.isin(given.text.words.value, (64.0,)) & (given.text.words.key == key("G"))
    says = np.zeros(len(given), np.bool_)
    says[given.text.words.block[code]] = True
    at = np.maximum.accumulate(np.where(says, np.arange(len(given)), -1))
    allowed = np.where(at >= 0, given.lengths(key("P"))[np.maximum(at, 0)], np.nan)
    return np.where(path == 0, 0.0, np.where(path == 1, allowed, np.nan))[rows]


def _whole(given: Blocks, rows: Ints) -> dict[int, str]:
    """Motions before which nothing may be inserted, because their block says more than the motion."""
    words, modal, n = given.text.words, given.modal, len(given)
    more = given.has(*(key(letter) for letter in "ESTHDLQUVW")) | given.noted(
        "assign", "corner", "axis", "polar"
    )
    more[words.block[np.isin(words.key, (key("M"), *given.control.columns)) & ~np.isin(words.key, _WAY)]] = (
        True
    )
    codes = np.flatnonzero(words.key == key("G"))
    said = np.bincount(words.block[codes], minlength=n)
    silent = (modal.verb >= 0).astype(np.int64)
    for group in (Group.PLANE, Group.DISTANCE, Group.ARCS, Group.UNITS):
        silent[modal.states[group]] += 1
    more |= said != silent
    word, usual = given.control.turns
    if word in given.columns:
        more |= given.number(word) > usual
    # Machine axes: what is inserted has no words for them.
    more |= given.has(*(key(letter) for letter in "ABC")) & (modal.force[Group.TCP] != 1)
    timed = modal.force[Group.FEED] == Feed.INVERSE_TIME
    found: dict[int, str] = {}
    for mask, why in (
        (timed, "F is the time of the whole block (G93)"),
        (more, "its block says more than the motion"),
        (modal.flow.entered, "a jump leads to its block"),
    ):
        found.update(dict.fromkeys(np.flatnonzero(mask[rows]).tolist(), why))
    return found


_WAY = tuple(key(letter, index) for letter in "ABCIJK" for index in (1, 2, 3))
"""Words of the way itself: the point between, orientations."""


def _places(given: Blocks, where: Positions, moves: Motions) -> Places:
    rows, force = moves.block, given.modal.force
    columns = (*COLUMNS, *given.control.columns)
    return Places(
        text=given.text,
        block=rows,
        columns=columns,
        word=given.word[rows][:, [given.columns.index(one) for one in columns]],
        verb=given.modal.verb[rows],
        insert=given.text.blocks.code[rows],
        move=moves.move,
        plane=moves.plane,
        incremental=force[Group.DISTANCE][rows] == 1,
        arc_absolute=force[Group.ARCS][rows] == 1,
        scale=given.length[rows],
        increment=given.length_of_integer[rows],
        frame=where.frame[rows],
        frames=Poses(
            np.array([frame.turn for frame in where.frames]),
            np.array([frame.shift[:3] for frame in where.frames]),
        ),
        begin=moves.begin[:, :3],
        orient=moves.stand.orient,
        orientations=moves.stand.orientations,
        turned_values=moves.stand.values,
        turned_before=moves.stand.before,
        feed_mode=force[Group.FEED][rows],
    )


KINDS = np.full(len(Move) + 1, Kind.OTHER)
KINDS[[Move.RAPID, Move.LINE, Move.CLOCKWISE, Move.COUNTER, Move.THROUGH]] = (
    Kind.PTP,
    Kind.LIN,
    Kind.CIRC,
    Kind.CIRC,
    Kind.CIRC,
)
"""By Move; the last entry is that of UNKNOWN."""
