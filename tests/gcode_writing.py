"""Plans of G-code programs at random, what comes out when they are written, and what reading that again must give."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.document import Document, apply, undone
from postproc.base.geometry import arc_in_plane, on_arc, rotation_from_vector, vector_from_rotation
from postproc.base.units import DEG, MM
from postproc.languages.dialect import PLAIN, Plan, Program, ReadingSettings, Role, WritingSettings
from postproc.languages.gcode import GcodeDialect
from postproc.languages.gcode.control import Feed
from postproc.languages.gcode.writer_text import stated
from postproc.toolpath import Kind, Toolpath

WRITING = WritingSettings(mm=3, deg=3)
DOWN = ReadingSettings(orientation=np.array([0.3, 0.0, np.pi]))


def read(dialect: GcodeDialect, raw: bytes | str, settings: ReadingSettings = DOWN) -> Program:
    text = raw if isinstance(raw, bytes) else raw.encode("latin-1")
    return dialect.read((Document(Path("part.nc"), text),), settings)


def begins(path: Toolpath) -> Floats:
    """(N, 3) where the motions begin, as far as that is in their base."""
    before = np.concatenate([np.full((1, 3), np.nan), path.position[:-1]])
    if len(path):
        before[1:][path.base[1:] != path.base[:-1]] = np.nan
    return before


def free(path: Toolpath) -> np.ndarray:
    """(N,) rows that may be moved."""
    rows = path.known.copy()
    rows[[*path.constraints.refused, *path.constraints.locked]] = False
    return rows


def random_plan(
    program: Program,
    seed: int,
    size: float = 1e-4,
    share: float = 0.7,
    divided: float = 0.3,
    turn: float = 1e-3,
) -> Plan:
    """Some motions moved by some tenths of a millimetre and turned where they can be, with pieces and links before
    some; arcs through the moved begin, middle and end; circles that nearly close are divided."""
    random = np.random.default_rng(seed)
    path, through = program.toolpath, stated(program.text.part(0, len(program.toolpath)), WRITING).through
    n = len(path)
    movable = free(path)
    moves = movable & (random.random(n) < share)
    end = path.position + np.where(moves[:, None], random.normal(0, size, (n, 3)), 0.0)
    turns = rotation_from_vector(
        random.normal(0, turn, (n, 3)) * (moves & path.constraints.orientation_programmed)[:, None]
    )
    rotation = np.where(
        moves[:, None, None] & path.constraints.orientation_programmed[:, None, None],
        turns @ path.rotation,
        path.rotation,
    )
    start = begins(path)
    groups: list[tuple[int, Role, Floats, Floats, Floats]] = []
    last = np.full(3, np.nan)
    for row in range(n):
        begin = last if row and path.base[row] == path.base[row - 1] else np.full(3, np.nan)
        arc = path.kind[row] == Kind.CIRC and np.isfinite(path.arcs.sweep[row])
        whole = (
            row in path.constraints.no_insert_before
            or row in path.constraints.refused
            or not moves[row]
            or not np.isfinite(begin).all()
        )
        if not arc:
            if not whole and random.random() < divided and path.kind[row] == Kind.LIN:
                if random.random() < 0.5:
                    begin = begin + random.normal(0, size, 3)
                    groups.append((row, Role.TRANSITION, begin, rotation[row], np.full(7, np.nan)))
                middle = 0.5 * (begin + end[row]) + random.normal(0, size, 3)
                groups.append((row, Role.INTERMEDIATE, middle, rotation[row], np.full(7, np.nan)))
            groups.append((row, Role.ORIGINAL, end[row], rotation[row], np.full(7, np.nan)))
        else:
            if through[row] and movable[row]:
                # Three points: no advance along the normal.
                end[row] -= path.arcs.normal[row] * ((end[row] - begin) @ path.arcs.normal[row])
            groups += _arc(
                path,
                row,
                start[row],
                begin,
                end[row],
                rotation[row],
                whole,
                moves[row],
                random,
                divided,
                through[row],
            )
        last = groups[-1][2]
    ways = np.array([group[4] for group in groups]).reshape(-1, 7)
    return Plan(
        np.array([group[0] for group in groups]),
        np.array([group[1] for group in groups]),
        np.array([group[2] for group in groups]).reshape(-1, 3),
        np.array([group[3] for group in groups]).reshape(-1, 3, 3),
        ways[:, :3],
        ways[:, 3:6],
        ways[:, 6],
    )


def _arc(path, row, start, begin, end, rotation, whole, moves, random, divided, flat):
    """An arc, or two, from ``begin``; as it is where nothing moves."""
    own = np.concatenate([path.arcs.centre[row], path.arcs.normal[row], [path.arcs.sweep[row]]])
    if row in path.constraints.refused or (not moves and np.array_equal(begin, start)):
        return [(row, Role.ORIGINAL, path.position[row], rotation, own)]
    source = [
        on_arc(start[None], path.position[[row]], own[None, :3], own[None, 3:6], own[6:], np.array([t]))[0]
        for t in (0.25, 0.5, 0.75)
    ]
    through = [
        point + random.normal(0, 2e-5, 3) + 0.5 * (begin - start + end - path.position[row])
        for point in source
    ]
    link = []
    if (
        not whole
        and not flat
        and np.linalg.norm(path.position[row] - start) > 0.002
        and random.random() < divided
    ):
        begin = begin + random.normal(0, 1e-4, 3)
        link = [(row, Role.TRANSITION, begin, rotation, np.full(7, np.nan))]
    long = np.linalg.norm(path.position[row] - start) > 0.002
    two = not whole and (own[6] > np.radians(300) or (long and random.random() < divided))
    if two:
        first = _through(begin, through[0], through[1], own)
        second = _through(through[1], through[2], end, own)
        if not np.isfinite([*first, *second]).all():
            two = False
    if two:
        return [
            *link,
            (row, Role.INTERMEDIATE, through[1], rotation, first),
            (row, Role.ORIGINAL, end, rotation, second),
        ]
    extra = np.floor(own[6] / (2 * np.pi) - 1e-9) * 2 * np.pi
    if own[6] > 6 or extra:
        # A circle that must stay whole moves as it is.
        way = own.copy()
        way[:3] += begin - start
        return [(row, Role.ORIGINAL, path.position[row] + begin - start, rotation, way)]
    way = _through(begin, through[1], end, own)
    if not np.isfinite(way).all() or abs(way[6] - own[6]) > 1.0:
        # Shorter than what it is moved by: as it is.
        way = own.copy()
        way[:3] += begin - start
        end = path.position[row] + begin - start
    return [*link, (row, Role.ORIGINAL, end, rotation, way)]


def _through(begin, via, end, own):
    centre, normal, sweep = arc_in_plane(begin[None], via[None], end[None], own[None, 3:6])
    return np.concatenate([centre[0], normal[0], sweep])


def written(dialect: GcodeDialect, program: Program, plan: Plan, writing: WritingSettings = WRITING) -> bytes:
    """The output; every byte outside of the edits is checked."""
    moved = dialect.edit_targets(program, plan, writing)
    assert not moved.unwritten, moved.unwritten
    document = program.documents[0]
    raw = apply(document, moved.edits)
    assert undone(raw, document.raw, moved.edits)
    return raw


def assert_reads_as(
    dialect: GcodeDialect,
    program: Program,
    plan: Plan,
    raw: bytes,
    settings: ReadingSettings = DOWN,
    writing: WritingSettings = WRITING,
) -> Program:
    """Read again, every motion ends where the plan says, on the way that it says, with all else as it was."""
    before = program.toolpath
    again = dialect.read((dataclasses.replace(program.documents[0], raw=raw),), settings)
    path = again.toolpath
    assert len(path) == len(plan), raw.decode("latin-1")
    source = plan.source
    own = plan.role == Role.ORIGINAL
    link = plan.role == Role.TRANSITION
    step = np.full(len(source), 10.0**-writing.mm * MM)
    half = 0.5 * step * (1 + 1e-3) + 1e-9

    kind = np.where(link, Kind.LIN, before.kind[source])
    np.testing.assert_array_equal(path.kind, kind)
    for name in ("base", "tool"):
        assert [_number(path, i) for i in getattr(path, name)] == [
            _number(before, i) for i in getattr(before, name)[source]
        ]
    air = link & (before.kind[source] == Kind.PTP)
    # F of inverse time goes with the length.
    timed = program.text.feed_mode[source] == Feed.INVERSE_TIME
    same = np.isclose(path.feed, before.feed[source], rtol=np.where(timed, 0.2, 1e-9), equal_nan=True)
    assert same[~air].all()
    np.testing.assert_array_equal(
        path.constraints.orientation_programmed, before.constraints.orientation_programmed[source]
    )
    own_rows = np.flatnonzero(own)
    codes = {
        int(source[m]): path.constraints.refused[m].code for m in own_rows if m in path.constraints.refused
    }
    assert codes == {row: finding.code for row, finding in before.constraints.refused.items()}
    assert all(m not in path.constraints.refused for m in np.flatnonzero(~own))

    known = np.isfinite(plan.position).all(axis=1)
    np.testing.assert_array_equal(np.isfinite(path.position).all(axis=1), known)
    off = np.abs(path.position - plan.position)[known]
    reach = half
    # A closed circle ends where the motion before did, in the digits of that.
    with np.errstate(invalid="ignore"):
        reach = np.where(plan.sweep > 6, np.maximum(reach, np.roll(half, 1)), reach)
    assert (off <= reach[known, None]).all(), f"{off.max() / MM} mm\n" + raw.decode("latin-1")
    _assert_turned(path, plan, before, writing)
    arc = np.flatnonzero(np.isfinite(plan.sweep) & np.isfinite(path.arcs.sweep) & (kind == Kind.CIRC))
    np.testing.assert_array_equal(np.isfinite(path.arcs.sweep), np.isfinite(plan.sweep) & (kind == Kind.CIRC))
    if len(arc):
        _assert_arcs(path, plan, arc, step, raw)
    return again


def _assert_arcs(path: Toolpath, plan: Plan, arc, step, raw) -> None:
    meant = np.concatenate([np.full((1, 3), np.nan), plan.position[:-1]])[arc]
    read_begin = begins(path)[arc]
    assert np.isfinite(read_begin).all()
    for share in (0.3, 0.5, 0.8):
        at = np.full(len(arc), share)
        one = on_arc(meant, plan.position[arc], plan.centre[arc], plan.normal[arc], plan.sweep[arc], at)
        two = on_arc(
            read_begin,
            path.position[arc],
            path.arcs.centre[arc],
            path.arcs.normal[arc],
            path.arcs.sweep[arc],
            at,
        )
        off = np.linalg.norm(one - two, axis=1)
        worst = int(np.argmax(off / step[arc]))
        assert (off <= 2.5 * step[arc]).all(), f"arc {arc[worst]}: {off[worst] / MM} mm\n" + raw.decode(
            "latin-1"
        )


def _assert_turned(path: Toolpath, plan: Plan, before: Toolpath, writing: WritingSettings) -> None:
    oriented = (before.constraints.orientation_programmed & before.known)[plan.source]
    if not oriented.any():
        return
    redundant_axis = before.orientation_control.redundant_axis[plan.source]
    spins = oriented & np.isfinite(redundant_axis[:, 0])
    # Half a step in each of three angles, or a little less of a vector's components.
    most = 3 * 0.5 * 10.0**-writing.deg * DEG * 1.01 + 1e-8
    whole = oriented & ~spins
    left = vector_from_rotation(np.swapaxes(path.rotation[whole], 1, 2) @ plan.rotation[whole])
    assert (np.linalg.norm(left, axis=1) <= most).all()
    axis = redundant_axis[spins][..., None]
    apart = np.cross((path.rotation[spins] @ axis)[..., 0], (plan.rotation[spins] @ axis)[..., 0])
    assert (np.linalg.norm(apart, axis=1) <= most).all()


def _number(path: Toolpath, index: int) -> int | None:
    return None if index < 0 else path.frames[index].number


def round_trip(
    dialect: GcodeDialect,
    raw: bytes,
    seed: int,
    settings: ReadingSettings = DOWN,
    writing: WritingSettings = WRITING,
    **change: float,
) -> bytes:
    """Reads, moves at random, writes, reads again; the output."""
    program = dialect.read((Document(Path("part.nc"), raw),), settings)
    plan = random_plan(program, seed, **change)
    output = written(dialect, program, plan, writing)
    assert_reads_as(dialect, program, plan, output, settings, writing)
    return output


__all__ = [
    "DOWN",
    "PLAIN",
    "WRITING",
    "assert_reads_as",
    "free",
    "random_plan",
    "read",
    "round_trip",
    "written",
]
