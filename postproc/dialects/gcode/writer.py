"""A plan of motions as edits of a G-code program: the numbers that change, the words and blocks that are missing."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.dialects.decimals import fixed
from postproc.dialects.dialect import Moved, Plan, Program, Role, Writing
from postproc.dialects.gcode.control import Move
from postproc.dialects.gcode.places import Places
from postproc.dialects.gcode.writer_arcs import Arcs, Form, WrittenArcs, write_arcs
from postproc.dialects.gcode.writer_blocks import Blocks, insertions
from postproc.dialects.gcode.writer_targets import Followed, Wanted, follow, follow_whole
from postproc.dialects.gcode.writer_text import (
    AXES,
    CENTRE,
    COLUMNS,
    PLANES,
    RADIUS,
    TURNED,
    Stated,
    stated,
)
from postproc.document import Edits
from postproc.findings import Finding
from postproc.toolpath import Kind

SAME = 1e-12
"""Positions [m] and rotations that differ by less are the same."""

TURN = 2 * np.pi


def moved(program: Program, plan: Plan, writing: Writing) -> Moved:
    """Edits after which the program makes the motions of ``plan`` (``Dialect.moved``).

    Arcs keep the form of their block (I J K, R, a point); an R that would leave the centre badly determined gives way
    to I J K.  Rows whose arc no numbers of their form state, or whose orientation has no words, are held.  Raises
    ValueError where a row is asked to move, or to be divided, that may not: a defect of the caller.
    """
    _allowed(program, plan)
    places: Places = program.text
    text = stated(program, writing)
    motions = _Motions(plan.source, plan.role == Role.OWN, plan.role == Role.LINK, text)
    sheet = _Sheet.empty(len(plan), text.decimals[plan.source])
    ends = _positions(program, plan, motions, sheet)
    held = _orientations(program, plan, motions, sheet)
    convert, bad = _arcs(program, plan, motions, ends, sheet)
    held |= {int(motions.row[m]): "GCW001" for m in np.flatnonzero(bad).tolist()}
    if held:
        return Moved((), {row: _finding(program, row, code) for row, code in held.items()})
    _no_empty_block(motions, sheet, ends)
    present = motions.own[:, None] & (text.word[motions.row] >= 0)
    present[:, RADIUS] &= ~convert
    literals = _literals(places, text, motions, sheet, present)
    missing = _texts(sheet, sheet.write & ~present)
    blocks = Blocks(program, text, motions.row, plan.role, convert, missing)
    return Moved(Edits.joined(literals, insertions(blocks)))


@dataclass(frozen=True, eq=False)
class _Motions:
    row: Ints
    own: Bools
    link: Bools
    text: Stated


@dataclass(frozen=True, eq=False)
class _Sheet:
    """What is written of M motions: write, number, decimals (M, 10)."""

    write: Bools
    number: Floats
    decimals: Ints

    @staticmethod
    def empty(count: int, decimals: Ints) -> _Sheet:
        shape = (count, COLUMNS)
        return _Sheet(np.zeros(shape, dtype=bool), np.full(shape, np.nan), decimals)


def _differs(new: Floats, old: Floats) -> Bools:
    with np.errstate(invalid="ignore"):
        same = (np.abs(new - old) <= SAME) | (np.isnan(new) & np.isnan(old))
    return np.asarray(~same.all(axis=tuple(range(1, same.ndim))))


def _allowed(program: Program, plan: Plan) -> None:
    path = program.toolpath
    own = plan.role == Role.OWN
    if not np.array_equal(plan.source[own], np.arange(len(path))):
        raise ValueError("a plan has one own motion for every row")
    shifted = _differs(plan.position[own], path.position) | _differs(plan.rotation[own], path.rotation)
    kept = [row for row in (*path.refused, *path.pinned) if shifted[row]]
    if kept:
        raise ValueError(f"motions that can not be corrected were moved: rows {sorted(set(kept))[:5]}")
    divided = np.intersect1d(plan.source[~own], np.array([*path.whole, *path.refused], dtype=np.int64))
    if len(divided):
        raise ValueError(f"motions that can not be divided were: rows {divided[:5].tolist()}")


def _fixed(program: Program, motions: _Motions, plan: Plan) -> Bools:
    fixed_rows = np.zeros(len(program.toolpath), dtype=bool)
    fixed_rows[list(program.toolpath.refused)] = True
    return np.asarray(fixed_rows[motions.row] | np.isnan(plan.position[:, 0]))


def _resumed(motions: _Motions, origin: Floats, ends: Floats) -> Bools:
    """(M, K) the first motions of rows that begin elsewhere than ``ends`` (M, K), where the row before ends."""
    first = np.append(True, motions.row[1:] != motions.row[:-1])[: len(motions.row)]
    return Wanted.resumed(origin, np.where(first[:, None] & (motions.row > 0)[:, None], ends, np.nan))


def _stated_columns(motions: _Motions, columns: slice) -> tuple[Floats, Bools]:
    """The numbers of the own blocks, NaN else; whether a number there is an increment."""
    text, row = motions.text, motions.row
    own = np.where(motions.own[:, None], text.value[row, columns], np.nan)
    # A word that is inserted has the mode of the block, whatever another one's IC( ) says.
    return own, np.where(np.isnan(own), text.modal[row, columns], text.relative[row, columns])


def _positions(program: Program, plan: Plan, motions: _Motions, sheet: _Sheet) -> Followed:
    """Follows X Y Z; fills their columns of the sheet."""
    path, places, text, row = program.toolpath, program.text, motions.text, motions.row
    source = np.where(motions.own[:, None], text.units(row, path.position[row]), np.nan)
    own, relative = _stated_columns(motions, AXES)
    begin = places.begin[row] / places.scale[row, None]
    wanted = Wanted(
        _reached(program, plan, motions, begin),
        source,
        own,
        relative,
        sheet.decimals[:, AXES],
        _fixed(program, motions, plan),
        _closed(program, plan, motions, sheet),
        begin,
        _resumed(motions, begin, text.units(row, path.position[row - 1])),
    )
    into = Followed.nothing(wanted)
    other = np.zeros(len(row), dtype=bool)
    for state in (places.frame, places.scale, path.base):
        other[1:] |= state[row[1:]] != state[row[:-1]]
    bounds = [0, *np.flatnonzero(other).tolist(), len(row)] if len(row) else []
    start = np.full(3, np.nan)
    for a, b in pairwise(bounds):
        if a and path.base[row[a]] == path.base[row[a - 1]]:
            start = text.units(row[[a]], text.base(row[[a - 1]], into.end[[a - 1]]))[0]
        elif a:
            start = np.full(3, np.nan)
        follow(wanted, start, a, b, into)
    sheet.write[:, AXES], sheet.number[:, AXES] = into.write, into.number
    return into


def _reached(program: Program, plan: Plan, motions: _Motions, begin: Floats) -> Floats:
    """(M, 3) where the motions end, in their frames; of refused ones what the motion behind knows of it."""
    places, row = program.text, motions.row
    wanted = motions.text.units(row, plan.position)
    same = np.zeros(len(row), dtype=bool)
    same[:-1] = True
    for state in (places.frame, places.scale):
        same[:-1] &= state[row[1:]] == state[row[:-1]]
    behind = np.roll(begin, -1, axis=0)
    return np.where(same[:, None] & np.isnan(wanted), behind, wanted)


def _closed(program: Program, plan: Plan, motions: _Motions, sheet: _Sheet) -> Bools:
    """(M, 3) the axes in which a full circle ends where it begins."""
    closed = np.zeros((len(motions.row), 3), dtype=bool)
    with np.errstate(invalid="ignore"):
        full = (plan.sweep > 6.0) & (np.abs(plan.sweep - TURN * np.rint(plan.sweep / TURN)) < 0.01)
    circles = np.flatnonzero(full & ~motions.link)
    circles = circles[circles > 0]
    row = motions.row[circles]
    apart = np.abs(
        motions.text.units(row, plan.position[circles]) - motions.text.units(row, plan.position[circles - 1])
    )
    axes = PLANES[program.text.plane[row], :2]
    near = np.take_along_axis(apart, axes, axis=1)
    step = 10.0 ** -np.take_along_axis(sheet.decimals[circles, AXES], axes, axis=1)
    both = (near <= 0.5 * step).all(axis=1)
    closed[circles[both, None], axes[both]] = True
    return closed


def _orientations(program: Program, plan: Plan, motions: _Motions, sheet: _Sheet) -> dict[int, str]:
    """Follows the words of the orientations; rows whose orientation has no words are returned."""
    path, places, row = program.toolpath, program.text, motions.row
    orient = places.orient[row]
    held: dict[int, str] = {}
    if (orient < 0).all():
        return held
    source = places.turned_values[row]
    new = np.flatnonzero((orient >= 0) & (_differs(plan.rotation, path.rotation[row]) | ~motions.own))
    values = source.copy()
    for i, orientation in enumerate(places.orientations):
        rows = new[orient[new] == i]
        values[rows] = orientation.values(plan.rotation[rows], source[rows])
        used = np.array(orientation.words) >= 0
        held |= {int(row[m]): "GCW002" for m in rows[np.isnan(values[rows][:, used]).any(axis=1)].tolist()}
    own, relative = _stated_columns(motions, TURNED)
    same = places.orient[row - 1] == orient
    before = np.where(same[:, None], places.turned_values[row - 1], np.nan)
    wanted = Wanted(
        values,
        np.where(motions.own[:, None], source, np.nan),
        own,
        relative,
        sheet.decimals[:, TURNED],
        _fixed(program, motions, plan) | (orient < 0),
        np.zeros(values.shape, dtype=bool),
        places.turned_before[row],
        _resumed(motions, places.turned_before[row], before),
    )
    into = Followed.nothing(wanted)
    bounds = [0, *(np.flatnonzero(np.diff(orient)) + 1).tolist(), len(row)]
    for a, b in pairwise(bounds):
        if orient[a] >= 0:
            unknown, orientation = np.full(3, np.nan), places.orientations[orient[a]]
            if orientation.joint:
                follow_whole(wanted, unknown, a, b, into, not orientation.angles)
            else:
                follow(wanted, unknown, a, b, into)
    sheet.write[:, TURNED], sheet.number[:, TURNED] = into.write, into.number
    return held


def _arcs(
    program: Program, plan: Plan, motions: _Motions, ends: Followed, sheet: _Sheet
) -> tuple[Bools, Bools]:
    """Fills the columns of the arcs; (M,) those whose R gives way to I J K, and those that can not be stated."""
    path, places, text = program.toolpath, program.text, motions.text
    convert, bad = np.zeros(len(plan), dtype=bool), np.zeros(len(plan), dtype=bool)
    arc = (path.kind[motions.row] == Kind.CIRC) & ~motions.link & np.isfinite(plan.sweep)
    lost = np.isfinite(path.sweep[motions.row]) & ~motions.link & np.isnan(plan.sweep)
    if lost.any():
        raise ValueError(f"arcs without a way: rows {motions.row[lost][:5].tolist()}")
    m = np.flatnonzero(arc & ~_fixed(program, motions, plan))
    row = motions.row[m]
    centre = text.units(row, plan.centre[m])
    with np.errstate(invalid="ignore"):
        changed = np.abs(ends.begin[m] - places.begin[row] / places.scale[row, None]) > 1e-9
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
    arcs = Arcs(
        ends.begin[m],
        ends.end[m],
        centre,
        normal,
        plan.sweep[m],
        places.plane[row],
        np.select([through, by_radius], [Form.THROUGH, Form.RADIUS], Form.CENTRE),
        places.move[row] == Move.CLOCKWISE,
        text.turns[row],
        np.where(np.isnan(own[:, :3]), text.modal[row, CENTRE], text.relative[row, CENTRE]),
        own,
        sheet.decimals[np.ix_(m, columns)],
    )
    written: WrittenArcs = write_arcs(arcs)
    sheet.write[np.ix_(m, columns)] = written.write
    sheet.number[np.ix_(m, columns)] = written.number
    sheet.decimals[np.ix_(m, columns)] = written.decimals
    sheet.write[m[written.convert], RADIUS] = False
    convert[m], bad[m] = written.convert, written.bad
    return convert, bad


def _no_empty_block(motions: _Motions, sheet: _Sheet, ends: Followed) -> None:
    """An inserted block without words would be no motion: it gets X."""
    empty = np.flatnonzero(~motions.own & ~sheet.write.any(axis=1))
    relative = motions.text.modal[motions.row[empty], 0]
    sheet.write[empty, 0] = True
    sheet.number[empty, 0] = np.where(relative, 0.0, ends.end[empty, 0])


def _literals(places: Places, text: Stated, motions: _Motions, sheet: _Sheet, present: Bools) -> Edits:
    """The numbers that are replaced where they stand."""
    m, column = np.nonzero(sheet.write & present)
    word = text.word[motions.row[m], column]
    words = places.text.words
    texts, ends = fixed(sheet.number[m, column], sheet.decimals[m, column])
    return Edits(np.zeros(len(m), dtype=np.int8), words.start[word], words.stop[word], texts, ends)


def _texts(sheet: _Sheet, missing: Bools) -> dict[int, dict[int, bytes]]:
    """Motion -> column -> the number of a word that is not there yet."""
    found: dict[int, dict[int, bytes]] = {}
    m, column = np.nonzero(missing)
    texts, ends = fixed(sheet.number[m, column], sheet.decimals[m, column])
    bounds = ends.tolist()
    for k, (i, j) in enumerate(zip(m.tolist(), column.tolist(), strict=True)):
        found.setdefault(i, {})[j] = texts[bounds[k] : bounds[k + 1]]
    return found


_MESSAGES = {
    "GCW001": "the corrected arc can not be written in the form of its block",
    "GCW002": "the corrected orientation has no words of this block",
}


def _finding(program: Program, row: int, code: str) -> Finding:
    document = program.documents[0]
    line = int(program.toolpath.line[row])
    return Finding(code, _MESSAGES[code], str(document.path), line, 1, "")
