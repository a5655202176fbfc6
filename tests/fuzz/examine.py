"""What must hold for any bytes: read without a crash and in time, nothing lost, and moved as planned."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.document import Document, apply, undone
from postproc.base.geometry import rotation_from_vector, vector_from_rotation
from postproc.base.units import DEG, MM
from postproc.languages.dialect import PLAIN, Dialect, Program, ReadingSettings, WritingSettings
from postproc.toolpath import Kind, Plan, Role, Toolpath

WRITING = WritingSettings(mm=3, deg=3)
HALF_MM = 0.50001e-3
"""Half of a written step [mm], and what doubles are off by."""
FARTHEST = 1e4
"""[m] of a target or a centre."""
ANGLES = 3 * 0.50001e-3
"""[deg] half a step in each of three angles."""


class Broken(Exception):
    """Something that must hold does not."""


@dataclass(frozen=True)
class Seen:
    """Seconds of reading, how many motions there were and how many of them moved."""

    seconds: float
    motions: int
    moved: int


def examined(
    dialect: Dialect,
    documents: tuple[Document, ...],
    random: np.random.Generator,
    settings: ReadingSettings = PLAIN,
) -> Seen:
    """Reads, writes unchanged, moves at random and reads back.  Raises Broken, or what the code raises."""
    begin = time.process_time()
    program = dialect.read(documents, settings)
    seconds = time.process_time() - begin
    path = program.toolpath
    for finding in program.findings:
        if finding.line > len(documents[0].line_starts) and len(documents) == 1:
            raise Broken(f"a finding in line {finding.line} of {len(documents[0].line_starts)}")
    for _ in path.dump():
        pass
    same = dialect.edit_targets(program, Plan.of(path), WRITING)
    if len(same.edits) or same.unwritten:
        raise Broken(
            f"the plan that leaves all as it is gives {len(same.edits)} edits, {len(same.unwritten)} held"
        )
    moved = 0
    if len(path):
        moved = _moved(dialect, program, random, settings)
    return Seen(seconds, len(path), moved)


def _moved(dialect: Dialect, program: Program, random: np.random.Generator, settings: ReadingSettings) -> int:
    path = program.toolpath
    n = len(path)
    share = random.choice([0.1, 0.6, 1.0])
    free = movable(path) & (random.random(n) < share)
    shift = random.normal(0, 0.2 * MM, (n, 3))
    turn = random.normal(0, 1e-3, (n, 3)) * (random.random() < 0.7)
    divided = np.flatnonzero(dividable(path) & (random.random(n) < random.choice([0.0, 0.0, 0.2])))
    writing = replace(
        WRITING, shared_points=str(random.choice(["copy-inline", "copy-inline", "copy-dat", "keep"]))
    )
    for _ in range(20):
        plan = planned(path, free, shift, turn, divided)
        found = dialect.edit_targets(program, plan, writing)
        if not found.unwritten:
            break
        if len(found.edits):
            raise Broken("edits besides rows that are held")
        rows = list(found.unwritten)
        if not free[rows].any() and not np.isin(divided, rows).any() and not _near(rows, free, n):
            raise Broken(f"rows {rows[:5]} are held that do not move")
        free[rows] = False
        free[[row - 1 for row in rows if row]] = False
        divided = divided[~np.isin(divided, rows)]
    else:
        raise Broken("rows are held again and again")
    written = []
    for index, document in enumerate(program.documents):
        edits = [edit for edit in found.edits if edit.span.file == index]
        raw = apply(document, edits)
        if not undone(raw, document.raw, edits):
            raise Broken("a byte changed that no edit covers")
        written.append(Document(document.path, raw))
    _compare(path, plan, dialect.read(tuple(written), replace(settings, places=False)).toolpath)
    return int(free.sum())


def _near(rows: list[int], free: Bools, n: int) -> bool:
    """Whether what these rows build on moves."""
    return any(free[max(row - 2, 0) : row + 1].any() for row in rows)


def movable(path: Toolpath) -> Bools:
    """(N,) the motions that may be planned elsewhere."""
    free = path.known & (path.kind != Kind.AXIS) & (path.partial_targets.inherits_from_row < 0)
    free[[*path.constraints.refused, *path.constraints.locked]] = False
    # Beyond it doubles do not hold the digits that are written.
    with np.errstate(invalid="ignore"):
        return (
            free
            & (np.abs(path.position).max(axis=1) < FARTHEST)
            & ~(np.abs(path.arcs.centre).max(axis=1) > FARTHEST)
        )


def dividable(path: Toolpath) -> Bools:
    """(N,) the straight motions, and plane arcs of no more than a turn and a half, that another one may be inserted
    before."""
    free = (
        path.known
        & ((path.kind == Kind.LIN) | (path.kind == Kind.CIRC))
        & (path.partial_targets.inherits_from_row < 0)
    )
    free[[*path.constraints.refused, *path.constraints.no_insert_before]] = False
    arcs = np.flatnonzero(path.kind == Kind.CIRC)
    before = np.maximum(arcs - 1, 0)
    advance = np.sum((path.position[arcs] - path.position[before]) * path.arcs.normal[arcs], axis=1)
    free[arcs] &= (np.abs(advance) < 1e-9) & (path.base[arcs] == path.base[before]) & (arcs > 0)
    free[arcs] &= path.arcs.sweep[arcs] < 600 * DEG
    return free


def planned(path: Toolpath, free: Bools, shift: Floats, turn: Floats, divided: np.ndarray) -> Plan:
    """A plan in which ``free`` rows are shifted (N, 3) and turned, arcs together with what they begin at, and a
    piece or a link stands before each of ``divided``; of an arc it is its first half."""
    n = len(path)
    shift = _joined(path, np.where(free[:, None], shift, 0.0))
    turns = (
        free
        & path.constraints.orientation_programmed
        & np.isnan(path.orientation_control.redundant_axis[:, 0])
    )
    turned = rotation_from_vector(np.where(turns[:, None], turn, 0.0))
    rotation = np.where(turns[:, None, None], turned @ path.rotation, path.rotation)
    moves = (shift != 0).any(axis=1)[:, None]
    position = np.where(moves, path.position + shift, path.position)
    centre = np.where(moves, path.arcs.centre + shift, path.arcs.centre)
    source = np.sort(np.concatenate([np.arange(n), divided])).astype(np.int64)
    own = np.append(source[1:] != source[:-1], True) if len(source) else np.empty(0, bool)
    arcs = path.kind[source] == Kind.CIRC
    sweep = path.arcs.sweep[source] * np.where(np.isin(source, divided), 0.5, 1.0)
    role = np.where(own, Role.ORIGINAL, np.where(arcs | (source % 3 > 0), Role.INTERMEDIATE, Role.TRANSITION))
    half = rotation_from_vector(np.nan_to_num(-sweep[:, None] * path.arcs.normal[source]))
    halves = centre[source] + (half @ (position[source] - centre[source])[..., None])[..., 0]
    aside = position[source] + np.array([1.0, -2.0, 3.0]) * MM
    there = np.where(own[:, None], position[source], np.where(arcs[:, None], halves, aside))
    return Plan(source, role, there, rotation[source], centre[source], path.arcs.normal[source], sweep)


def _joined(path: Toolpath, shift: Floats) -> Floats:
    """Shifts (N, 3) with which arcs stay as they are: each moves with its begin, or neither moves."""
    arcs = np.flatnonzero(path.kind == Kind.CIRC)
    for row in arcs.tolist():
        shift[row] = shift[row - 1] if row and shift[row].any() else 0.0
    stiff = arcs[(arcs > 0)]
    apart = path.base[stiff] != path.base[stiff - 1]
    while True:
        apart = apart | (shift[stiff] != shift[stiff - 1]).any(axis=1)
        wrong = stiff[apart]
        if not (shift[wrong].any() or shift[wrong - 1].any()):
            return shift
        shift[wrong] = shift[wrong - 1] = 0.0


def _compare(path: Toolpath, plan: Plan, back: Toolpath) -> None:
    """What was read back is the plan, motion by motion."""
    source = plan.source
    if len(back) != len(plan):
        raise Broken(f"{len(plan)} motions became {len(back)}")
    own = plan.own
    codes = {row: finding.code for row, finding in path.constraints.refused.items()}
    again = {int(source[m]): finding.code for m, finding in back.constraints.refused.items()}
    if codes != again:
        differ = set(codes.items()) ^ set(again.items())
        raise Broken(f"other refusals: {sorted(differ)[:3]}")
    for name in ("kind", "base", "tool", "axes", "feed", *path.configuration.numbers, "inverse_time_feed"):
        if name in path.configuration.numbers:
            before, after = path.configuration[name][source], back.configuration[name]
        else:
            before, after = getattr(path, name)[source], getattr(back, name)[:]
        if name in ("base", "tool"):
            before, after = _frames(path, before), _frames(back, after)
        same = (before == after) | ((before != before) & (after != after))
        same = same.all(axis=1) if same.ndim > 1 else same
        if name == "feed":
            same |= path.inverse_time_feed[source]
        if not same.all():
            m = int(np.argmin(same))
            raise Broken(f"the {name} of row {source[m]} (line {path.line[source[m]]}) changed")
    known = np.isfinite(plan.position)
    if not np.array_equal(known, np.isfinite(back.position)):
        raise Broken("targets were lost or appeared")
    off = np.abs(np.nan_to_num(back.position - plan.position)).max(axis=1) / MM
    # where CA ends an arc the rounding of its begin adds up
    off[path.kind[source] == Kind.CIRC] /= 2
    _within(off, HALF_MM, "mm", path, plan)
    said = np.isfinite(plan.rotation[:, 0, 0])
    if not np.array_equal(said, np.isfinite(back.rotation[:, 0, 0])):
        raise Broken("orientations were lost or appeared")
    turned = np.swapaxes(plan.rotation[said], -1, -2) @ back.rotation[said]
    angle = np.zeros(len(plan))
    angle[said] = np.linalg.norm(vector_from_rotation(turned), axis=1) / DEG
    _within(angle, ANGLES, "deg", path, plan)
    _compare_ways(path, plan, back)
    assert own.sum() == len(path)


def _compare_ways(path: Toolpath, plan: Plan, back: Toolpath) -> None:
    """Arcs pass through the same places: half way, within what rounding their three points does."""
    arcs = np.isfinite(plan.sweep) & np.isfinite(plan.centre[:, 0])
    if not np.array_equal(arcs, np.isfinite(back.arcs.sweep) & np.isfinite(back.arcs.centre[:, 0])):
        raise Broken("the way of an arc was lost or appeared")
    if not arcs.any():
        return
    middles = []
    for some, end in ((plan, plan.position), (back.arcs, back.position)):
        turn = rotation_from_vector(-0.5 * some.sweep[arcs, None] * some.normal[arcs])
        radius = end[arcs] - some.centre[arcs]
        middles.append(some.centre[arcs] + (turn @ radius[..., None])[..., 0])
    off = np.zeros(len(plan))
    # Begin and end that are close to each other hold the middle opposite to them less well: its distance from the
    # chord by the chord, (1 + |cos(sweep / 2)|) / (2 |sin(sweep / 2)|).
    sine, cosine = (np.abs(turn(plan.sweep[arcs] / 2)) for turn in (np.sin, np.cos))
    lever = np.maximum(1.0, 0.5 * (1.0 + cosine) / np.maximum(sine, 1e-3))
    lever = np.where(plan.sweep[arcs] < np.pi, 1.0, lever)
    off[arcs] = np.abs(middles[0] - middles[1]).max(axis=1) / MM / lever
    _within(off, 4 * HALF_MM, "mm half way of an arc", path, plan)


def _within(off: Floats, limit: float, unit: str, path: Toolpath, plan: Plan) -> None:
    if len(off) and not off.max() <= limit:
        m = int(np.argmax(off))
        row = int(plan.source[m])
        what = Role(int(plan.role[m])).name.lower()
        raise Broken(
            f"row {row} ({what}, line {path.line[row]}) is {off[m]:.6f} {unit} from where it was meant"
        )


def _frames(path: Toolpath, index: np.ndarray) -> np.ndarray:
    """Numbers of frames that are the same wherever they stand in ``frames``: poses, not places."""
    known: list[tuple[object, ...]] = []
    for frame in path.frames:
        pose = (
            ()
            if frame.pose is None
            else tuple(np.round([*frame.pose.position, *frame.pose.rotation.ravel()], 9))
        )
        known.append((frame.number, pose))
    names = {key: float(abs(hash(key)) % 2**40) for key in Counter(known)}
    return np.array([-1.0 if i < 0 else names[known[i]] for i in index.tolist()])
