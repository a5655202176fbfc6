"""A plan of motions as edits of a G-code program: the numbers that change, the words and blocks that are missing."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, differs
from postproc.base.batches import in_blocks
from postproc.base.decimals import fixed
from postproc.base.document import Edits
from postproc.base.findings import Finding
from postproc.base.geometry import lengths
from postproc.languages.core.plan_rows import refuse_divided, refuse_moved
from postproc.languages.dialect import EditedTargets, Plan, Program, Role, WritingSettings
from postproc.languages.gcode.control import Move
from postproc.languages.gcode.source_map import SourceMapPart
from postproc.languages.gcode.writer_arcs import ArcForm, ArcsToWrite, WrittenArcs, write_arcs
from postproc.languages.gcode.writer_blocks import BlockInsertions, Style, insertions
from postproc.languages.gcode.writer_targets import Followed, Wanted, follow, follow_whole
from postproc.languages.gcode.writer_text import (
    AXES,
    CENTRE,
    COLUMNS,
    PLANES,
    RADIUS,
    TURNED,
    ProgrammedWords,
)
from postproc.languages.gcode.written_lines import overlong
from postproc.languages.gcode.written_motions import WrittenMotions
from postproc.toolpath import Kind

TURN = 2 * np.pi

ROWS = 1 << 14
"""Motions of the program that are written at a time."""


def edit_targets(program: Program, plan: Plan, writing: WritingSettings) -> EditedTargets:
    """Edits after which the program makes the motions of ``plan`` (``Dialect.moved``).

    Arcs keep the form of their block (I J K, R, a point); an R that would leave the centre badly determined is replaced
    to I J K.  Rows whose arc no numbers of their form state, or whose orientation has no words, are held.  Raises
    ValueError where a row is asked to move, or to be divided, that may not: a defect of the caller.
    """
    path, style, forbidden = program.toolpath, Style.of(program), _Forbidden.of(program)
    if not np.array_equal(plan.source[plan.role == Role.ORIGINAL], np.arange(len(path))):
        raise ValueError("a plan needs one original motion for every row")
    held: dict[int, str] = {}
    edits: list[Edits] = []
    ends = Ends(np.full(3, np.nan), np.full(3, np.nan))

    def gathered(rows: slice) -> WrittenMotions:
        motions = WrittenMotions.of(program, plan, writing, rows.start, rows.stop, forbidden.rows)
        forbidden.check(motions, rows.start)
        return motions

    for motions in in_blocks(gathered, len(path), ROWS):  # only what is written depends on what is before
        written, bad, ends = _written(style, motions, ends)
        held |= {row + motions.first: code for row, code in bad.items()}
        edits.append(written)
    if held:
        return EditedTargets((), {row: _finding(program, row, code) for row, code in held.items()})
    return EditedTargets(Edits.joined(*edits))


def _written(style: Style, motions: WrittenMotions, before: Ends) -> tuple[Edits, dict[int, str], Ends]:
    """The edits of some motions; those that are held, and why; where the words are after the last of them."""
    text, places = motions.text, motions.places
    sheet = _Literals.empty(len(motions), text.decimals[motions.row])
    ends = _positions(motions, sheet, before.position)
    held, turned = _orientations(motions, sheet, before.turned)
    convert, bad = _arcs(motions, ends, sheet)
    held |= {int(motions.row[m]): "GCW001" for m in np.flatnonzero(bad).tolist()}
    held |= {int(motions.row[m]): "GCW003" for m in np.flatnonzero(_above_plane(motions)).tolist()}
    after = Ends(ends.end[-1], turned)
    if held:
        return Edits.joined(()), held, after
    _no_empty_block(motions, sheet, ends)
    present = motions.own[:, None] & (text.word[motions.row] >= 0)
    present[:, RADIUS] &= ~convert
    literals = _literals(places, text, motions, sheet, present)
    missing = _texts(sheet, sheet.write & ~present)
    blocks = BlockInsertions(style, places, text, motions.row, motions.role, convert, missing)
    edits = Edits.joined(literals, insertions(blocks))
    edited = np.unique(motions.row[motions.own & ~motions.fixed])
    held |= dict.fromkeys(overlong(edits, places, edited, style.longest).tolist(), "GCW004")
    return edits, held, after


@dataclass(frozen=True, eq=False)
class Ends:
    """Where the words of the axes, ``position`` (3,), and those of the orientation, ``turned`` (3,), are after a
    motion, as numbers of its frame; NaN where not known."""

    position: Floats
    turned: Floats


@dataclass(frozen=True, eq=False)
class _Forbidden:
    """rows (N,): refused; still (N,): may not move; whole (N,): may not be divided."""

    rows: Bools
    still: Bools
    whole: Bools

    @staticmethod
    def of(program: Program) -> _Forbidden:
        path = program.toolpath
        masks = [np.zeros(len(path), np.bool_) for _ in range(3)]
        own = path.constraints
        for mask, found in zip(masks, (own.refused, own.locked, own.no_insert_before), strict=True):
            mask[np.array([*found], dtype=np.int64)] = True
        refused, fixed_, whole = masks
        return _Forbidden(refused, refused | fixed_, refused | whole)

    def check(self, motions: WrittenMotions, start: int) -> None:
        own = motions.own
        rows = motions.row[own]
        path = motions.path
        shifted = differs(motions.plan.position[own], path.position[rows]).any(axis=1)
        shifted |= differs(motions.plan.rotation[own], path.rotation[rows]).any(axis=(1, 2))
        refuse_moved((np.flatnonzero(shifted & self.still[rows + motions.first]) + start).tolist())
        rows = motions.row[~own] + motions.first
        refuse_divided(np.unique(rows[self.whole[rows]]).tolist())


@dataclass(frozen=True, eq=False)
class _Literals:
    """What is written of M motions: write, number, decimals (M, 10)."""

    write: Bools
    number: Floats
    decimals: Ints

    @staticmethod
    def empty(count: int, decimals: Ints) -> _Literals:
        shape = (count, COLUMNS)
        return _Literals(np.zeros(shape, dtype=bool), np.full(shape, np.nan), decimals)


def _resumed(motions: WrittenMotions, origin: Floats, ends: Floats) -> Bools:
    """(M, K) the first motions of rows that start elsewhere than ``ends`` (M, K), where the row before ends."""
    first = np.append(True, motions.row[1:] != motions.row[:-1])[: len(motions.row)]
    return Wanted.resumed(origin, np.where(first[:, None] & (motions.row > 0)[:, None], ends, np.nan))


def _stated_columns(motions: WrittenMotions, columns: slice) -> tuple[Floats, Bools]:
    """The numbers of the own blocks, NaN else; whether a number there is an increment."""
    text, row = motions.text, motions.row
    own = np.where(motions.own[:, None], text.value[row, columns], np.nan)
    # A word that is inserted has the mode of the block, whatever another one's IC( ) says.
    return own, np.where(np.isnan(own), text.modal[row, columns], text.relative[row, columns])


def _positions(motions: WrittenMotions, literals: _Literals, before: Floats) -> Followed:
    """Follows X Y Z from where the motion ahead ended; fills their columns of the sheet."""
    path, places, text, row = motions.path, motions.places, motions.text, motions.row
    source = np.where(motions.own[:, None], text.units(row, path.position[row]), np.nan)
    own, relative = _stated_columns(motions, AXES)
    start = places.start_position[row] / places.scale[row, None]
    wanted = Wanted(
        _reached(motions, start),
        source,
        own,
        relative,
        literals.decimals[:, AXES],
        motions.fixed,
        _closed(motions, literals),
        start,
        _resumed(motions, start, text.units(row, path.position[row - 1])),
    )
    into = Followed.nothing(wanted)
    other = np.zeros(len(row), dtype=bool)
    for state in (places.frame, places.scale, path.base):
        other |= state[row] != state[row - 1]
    other[1:] &= row[1:] != row[:-1]
    bounds = [0, *(np.flatnonzero(other[1:]) + 1).tolist(), len(row)]
    for a, b in pairwise(bounds):
        end = into.end[a - 1] if a else before
        if row[a] == 0 or path.base[row[a]] != path.base[row[a] - 1]:
            end = np.full(3, np.nan)
        elif other[a]:
            end = text.units(row[[a]], text.base(row[[a]] - 1, end[None]))[0]
        follow(wanted, end, a, b, into)
    literals.write[:, AXES], literals.number[:, AXES] = into.write, into.number
    return into


def _reached(motions: WrittenMotions, start: Floats) -> Floats:
    """(M, 3) where the motions end, in their frames; of refused ones what the motion after knows of it."""
    places, row = motions.places, motions.row
    wanted = motions.text.units(row, motions.plan.position)
    following = np.append(row[1:], motions.last)
    same = following >= 0
    for state in (places.frame, places.scale):
        same &= state[following] == state[row]
    behind = np.concatenate([start[1:], places.start_position[[motions.last]] / places.scale[motions.last]])
    return np.where(same[:, None] & np.isnan(wanted), behind, wanted)


def _closed(motions: WrittenMotions, literals: _Literals) -> Bools:
    """(M, 3) the axes in which a full circle ends where it starts."""
    plan, closed = motions.plan, np.zeros((len(motions), 3), dtype=bool)
    with np.errstate(invalid="ignore"):
        full = (plan.sweep > 6.0) & (np.abs(plan.sweep - TURN * np.rint(plan.sweep / TURN)) < 0.01)
    circles = np.flatnonzero(full & ~motions.is_transition)
    row = motions.row[circles]
    before = np.where(circles[:, None] > 0, plan.position[circles - 1], plan.before)
    apart = np.abs(motions.text.units(row, plan.position[circles]) - motions.text.units(row, before))
    axes = PLANES[motions.places.plane[row], :2]
    near = np.take_along_axis(apart, axes, axis=1)
    step = 10.0 ** -np.take_along_axis(literals.decimals[circles, AXES], axes, axis=1)
    both = (near <= 0.5 * step).all(axis=1)
    closed[circles[both, None], axes[both]] = True
    return closed


def _orientations(
    motions: WrittenMotions, literals: _Literals, before: Floats
) -> tuple[dict[int, str], Floats]:
    """Follows the words of the orientations from where they are; gives rows whose orientation has no words, and where
    the words are after the motions."""
    path, places, row = motions.path, motions.places, motions.row
    orient, rotation = places.orient[row], motions.plan.rotation
    held: dict[int, str] = {}
    if (orient < 0).all():
        return held, np.full(3, np.nan)
    source = places.turned_values[row]
    new = np.flatnonzero(
        (orient >= 0) & (differs(rotation, path.rotation[row]).any(axis=(1, 2)) | ~motions.own)
    )
    values = source.copy()
    # What the words of the source say at the place of each motion: of the angles of an orientation those near to it.
    begin = places.turned_before[row]
    share = np.where(motions.own, 1.0, motions.plan.share)[:, None]
    place = np.where(np.isfinite(begin), source + (1.0 - share) * (np.nan_to_num(begin) - source), source)
    for i, orientation in enumerate(places.orientations):
        rows = new[orient[new] == i]
        if len(rows):
            values[rows] = orientation.values(rotation[rows], place[rows])
            used = np.array(orientation.words) >= 0
            lost = rows[np.isnan(values[rows][:, used]).any(axis=1)]
            held |= {int(row[m]): "GCW002" for m in lost.tolist()}
    own, relative = _stated_columns(motions, TURNED)
    same = (places.orient[row - 1] == orient) & (row > 0)
    ahead = np.where(same[:, None], places.turned_values[row - 1], np.nan)
    wanted = Wanted(
        values,
        np.where(motions.own[:, None], source, np.nan),
        own,
        relative,
        literals.decimals[:, TURNED],
        motions.fixed | (orient < 0),
        np.zeros(values.shape, dtype=bool),
        places.turned_before[row],
        _resumed(motions, places.turned_before[row], ahead),
    )
    into = Followed.nothing(wanted)
    bounds = [0, *(np.flatnonzero(np.diff(orient)) + 1).tolist(), len(row)]
    for a, b in pairwise(bounds):
        if orient[a] >= 0:
            start = before if a == 0 and same[0] else np.full(3, np.nan)
            orientation = places.orientations[orient[a]]
            if orientation.joint:
                follow_whole(wanted, start, a, b, into, not orientation.angles)
            else:
                follow(wanted, start, a, b, into)
    literals.write[:, TURNED], literals.number[:, TURNED] = into.write, into.number
    return held, into.end[-1]


def _arcs(motions: WrittenMotions, ends: Followed, literals: _Literals) -> tuple[Bools, Bools]:
    """Fills the columns of the arcs; (M,) those whose R is replaced by I J K, and those that cannot be stated."""
    path, places, text, plan = motions.path, motions.places, motions.text, motions.plan
    convert, bad = np.zeros(len(motions), dtype=bool), np.zeros(len(motions), dtype=bool)
    arc = (path.kind[motions.row] == Kind.CIRC) & ~motions.is_transition & np.isfinite(plan.sweep)
    lost = np.isfinite(path.sweep[motions.row]) & ~motions.is_transition & np.isnan(plan.sweep)
    if lost.any():
        raise ValueError(f"arcs have no path: rows {(motions.row[lost] + motions.first)[:5].tolist()}")
    m = np.flatnonzero(arc & ~motions.fixed)
    row = motions.row[m]
    centre = text.units(row, plan.centre[m])
    with np.errstate(invalid="ignore"):
        changed = np.abs(ends.start[m] - places.start_position[row] / places.scale[row, None]) > 1e-9
        changed |= np.abs(ends.end[m] - text.units(row, path.position[row])) > 1e-9
        changed |= np.abs(centre - text.units(row, path.centre[row])) > 1e-9
    touched = changed.any(axis=1) | ~motions.own[m]
    m, row, centre = m[touched], row[touched], centre[touched]
    if not len(m):
        return convert, bad
    through = text.through[row]
    by_radius = text.word[row, RADIUS] >= 0
    columns = np.r_[CENTRE, RADIUS]
    own = np.where(motions.own[m, None], text.value[row][:, columns], np.nan)
    normal = (text.inverse[row] @ plan.normal[m][..., None])[..., 0]
    normal *= np.sign(np.linalg.det(text.inverse[row]))[:, None]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    before = text.units(row, np.where(m[:, None] > 0, plan.position[m - 1], plan.before))
    arcs = ArcsToWrite(
        ends.start[m],
        ends.end[m],
        centre,
        normal,
        plan.sweep[m],
        places.plane[row],
        np.select([through, by_radius], [ArcForm.THROUGH, ArcForm.RADIUS], ArcForm.CENTRE),
        places.move[row] == Move.CLOCKWISE,
        text.turns[row],
        np.where(np.isnan(own[:, :3]), text.modal[row, CENTRE], text.relative[row, CENTRE]),
        own,
        literals.decimals[np.ix_(m, columns)],
        np.nan_to_num(np.abs(ends.start[m] - before)).max(axis=1),
    )
    written: WrittenArcs = write_arcs(arcs)
    literals.write[np.ix_(m, columns)] = written.write
    literals.number[np.ix_(m, columns)] = written.number
    literals.decimals[np.ix_(m, columns)] = written.decimals
    literals.write[m[written.convert], RADIUS] = False
    convert[m], bad[m] = written.convert, written.bad
    return convert, bad


def _above_plane(motions: WrittenMotions) -> Bools:
    """(M,) drill cycles that would end above their R, which stays."""
    room, row = motions.places.room[motions.row], motions.row
    drills = np.flatnonzero(np.isfinite(room))
    above = np.zeros(len(motions), dtype=bool)
    change = motions.plan.position[drills] - motions.path.position[row[drills]]
    above[drills] = lengths(change) >= room[drills]
    return above


def _no_empty_block(motions: WrittenMotions, literals: _Literals, ends: Followed) -> None:
    """An inserted block without words would be no motion: it gets X."""
    empty = np.flatnonzero(~motions.own & ~literals.write.any(axis=1))
    relative = motions.text.modal[motions.row[empty], 0]
    literals.write[empty, 0] = True
    literals.number[empty, 0] = np.where(relative, 0.0, ends.end[empty, 0])


def _literals(
    places: SourceMapPart, text: ProgrammedWords, motions: WrittenMotions, literals: _Literals, present: Bools
) -> Edits:
    """The numbers that are replaced where they are."""
    m, column = np.nonzero(literals.write & present)
    word = text.word[motions.row[m], column]
    words = places.text.words
    texts, ends = fixed(literals.number[m, column], literals.decimals[m, column])
    return Edits(np.zeros(len(m), dtype=np.int8), words.start[word], words.stop[word], texts, ends)


def _texts(literals: _Literals, missing: Bools) -> dict[int, dict[int, bytes]]:
    """Motion -> column -> the number of a word that is not there yet."""
    found: dict[int, dict[int, bytes]] = {}
    m, column = np.nonzero(missing)
    texts, ends = fixed(literals.number[m, column], literals.decimals[m, column])
    bounds = ends.tolist()
    for k, (i, j) in enumerate(zip(m.tolist(), column.tolist(), strict=True)):
        found.setdefault(i, {})[j] = texts[bounds[k] : bounds[k + 1]]
    return found


_MESSAGES = {
    "GCW001": "the corrected arc cannot be written in the form of its block",
    "GCW003": "the correction is as large as the distance from R to the depth of the hole",
    "GCW002": "the words of this block cannot express the corrected orientation",
    "GCW004": "the line of the corrected block would be longer than the control reads",
}


def _finding(program: Program, row: int, code: str) -> Finding:
    document = program.documents[0]
    line = int(program.toolpath.line[row])
    return Finding(code, _MESSAGES[code], str(document.path), line, 1, "")
