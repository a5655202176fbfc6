"""What is to be written of a plan, in the numbers and the spelling of the text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, differs
from postproc.base.decimals import fixed_one
from postproc.base.geometry import abc_from_rotation, rotation_from_vector, turn_between
from postproc.base.units import DEG, MM
from postproc.languages.dialect import Plan, Program, WritingSettings
from postproc.languages.tp.position_data import CARTESIAN, EXTERNAL, TpPosition
from postproc.languages.tp.tp_source_map import TpSourceMap
from postproc.languages.tp.tp_statements import TpMove
from postproc.toolpath import Kind, Role, Toolpath

FULLEST, SMALLEST = 330 * DEG, 1 * DEG
"""[rad] Sweep of an arc that three points in digits define."""
NEAREST = 0.1
"""[mm] Distance of the points of an arc."""
CHUNK = 1 << 14
"""Motions whose targets are computed at a time."""


class SixNumbers(NamedTuple):
    """X, Y, Z [mm], W, P, R [deg]: what the text says, what is wanted, and the decimals of each."""

    own: list[float]
    wanted: list[float]
    decimals: list[int]

    def changed(self) -> dict[bytes, bytes]:
        """Name -> new literal of the numbers that differ by more than half a written step."""
        pairs = zip(CARTESIAN, self.own, self.wanted, self.decimals, strict=True)
        return {
            name: fixed_one(wanted, count)
            for name, own, wanted, count in pairs
            if not abs(wanted - own) <= 0.5 * 10.0**-count
        }


class TpPlanNumbers:
    """A program, the plan for it, and what is looked up in them.  own (N,): the motion of the plan that takes the text
    of each row."""

    def __init__(self, program: Program, plan: Plan, writing: WritingSettings) -> None:
        """Raises ValueError where the plan has not one motion with the text of every row."""
        self.program, self.plan, self.writing = program, plan, writing
        self.path: Toolpath = program.toolpath
        self.places: TpSourceMap = program.text
        self.raw = program.documents[0].raw
        self.least = [writing.mm] * 3 + [writing.deg] * 3
        self.own: Ints = np.flatnonzero(plan.own)
        if not np.array_equal(plan.source[self.own], np.arange(len(self.path))):
            raise ValueError("a plan needs one motion with the text of every row")

    def move(self, row: int) -> TpMove:
        """Raises ValueError for a motion that is not understood."""
        move = self.places.moves[row]
        if move is None:
            raise ValueError(f"row {row} is not understood and cannot be written")
        return move

    def point(self, row: int) -> TpPosition:
        """Raises ValueError for a motion without a target in /POS."""
        point = self.places.points[row][0]
        if point is None:
            raise ValueError(f"row {row} has no target")
        return point

    def decimals(self, point: TpPosition) -> list[int]:
        """Of the six numbers of a point: those of the text, or the least."""
        spans = point.groups[0].spans
        return [
            max(least, _decimals_of(self.raw[slice(*spans[name])]))
            for name, least in zip(CARTESIAN, self.least, strict=True)
        ]

    def wanted(self, rows: Ints, motions: Ints) -> Floats:
        """(K, 6) [mm, deg] targets of motions (K,) of the plan that stem from rows (K,), in the spelling of the
        text."""
        numbers = self.places.numbers[rows].copy()
        position, rotation = self.plan.position[motions], self.plan.rotation[motions]
        shifted = differs(position, self.path.position[rows]).any(axis=1)
        turned = differs(rotation, self.path.rotation[rows]).any(axis=(1, 2))
        numbers[shifted, :3] = position[shifted] / MM
        if turned.any():
            near = numbers[turned, 5:2:-1] * DEG
            numbers[turned, 3:] = abc_from_rotation(rotation[turned], near)[:, ::-1] / DEG
        return numbers

    def vias(self, motions: Ints, near: Floats) -> Floats:
        """(K, 6) [mm, deg] points in the middle of the arcs ``motions`` (K,), with half of the turn of the tool, in the
        spelling of ``near`` (K, 6)."""
        plan = self.plan
        centre = plan.centre[motions]
        back = rotation_from_vector(-0.5 * plan.sweep[motions][:, None] * plan.normal[motions])
        radius = plan.position[motions] - centre
        place = centre + (back @ radius[..., None])[..., 0]
        start = plan.rotation[np.maximum(motions - 1, 0)]
        turn = rotation_from_vector(0.5 * turn_between(start, plan.rotation[motions]))
        angles = abc_from_rotation(turn @ start, near[:, 5:2:-1] * DEG)[:, ::-1] / DEG
        return np.concatenate([place / MM, angles], axis=1)

    def unfit_arc(self, motion: int) -> str:
        """Why three points in digits do not define an arc of the plan; "" where they do."""
        sweep = float(self.plan.sweep[motion])
        end = self.plan.position[np.array([motion])][0]
        radius = float(np.linalg.norm(end - self.plan.centre[motion])) / MM
        nearest = 2 * radius * min(abs(np.sin(sweep / 4)), abs(np.sin(sweep / 2)))
        if sweep > FULLEST:
            return "the corrected arc is nearly a full turn, which three points do not define"
        if sweep < SMALLEST or nearest < NEAREST:
            return "the corrected arc is too short for C"
        return ""

    def touched(self) -> tuple[Bools, Bools]:
        """(N,) rows whose end is another one, and arcs whose path is."""
        path, plan, own = self.path, self.plan, self.own
        n = len(path)
        touched, way = np.zeros(n, np.bool_), np.zeros(n, np.bool_)
        for at in range(0, n, CHUNK):
            rows = np.arange(at, min(at + CHUNK, n))
            there = own[rows]
            touched[rows] = differs(plan.position[there], path.position[rows]).any(axis=1)
            touched[rows] |= differs(plan.rotation[there], path.rotation[rows]).any(axis=(1, 2))
        arcs = np.flatnonzero(path.kind == Kind.CIRC)
        there = own[arcs]
        way[arcs] = differs(plan.centre[there], path.arcs.centre[arcs]).any(axis=1)
        way[arcs] |= differs(plan.normal[there], path.arcs.normal[arcs]).any(axis=1)
        way[arcs] |= differs(plan.sweep[there], path.arcs.sweep[arcs])
        return touched, way

    def refuse_forbidden(self, touched: Bools, way: Bools) -> None:
        """touched, way (N,): as of ``touched``.  Raises ValueError where the plan moves or divides what cannot be: a
        defect of the caller."""
        path, plan = self.path, self.plan
        fixed = path.constraints
        moved = {row for row in (*fixed.refused, *fixed.locked) if touched[row]}
        moved |= {row for row in fixed.refused if way[row]}
        moved |= set(np.flatnonzero(touched & (path.kind == Kind.AXIS)).tolist())
        if moved:
            raise ValueError(f"motions that cannot be corrected are moved: rows {sorted(moved)[:5]}")
        divided = set(plan.source[plan.role != Role.ORIGINAL].tolist())
        wrong = divided & {*fixed.refused, *fixed.no_insert_before}
        if wrong:
            raise ValueError(f"motions that cannot be divided are divided: rows {sorted(wrong)[:5]}")


class NewPoints:
    """Points that are added to /POS, with numbers above those that the file has or names."""

    def __init__(self, task: TpPlanNumbers) -> None:
        self.task = task
        places = task.places
        self.next = max([0, *places.positions, *places.uses, *places.read]) + 1
        self.texts: list[bytes] = []

    def add(self, source: TpPosition, literals: Mapping[bytes, bytes], named: bool = False) -> int:
        """The number of a new point: ``source`` with other ``literals`` by their names; ``named``: and its comment."""
        number, self.next = self.next, self.next + 1
        raw, spans = self.task.raw, source.groups[0].spans
        parts = [(*source.number_span, b"%d" % number)]
        comment = raw[slice(*source.comment)]
        if not (named and comment.isascii() and comment.replace(b" ", b"").replace(b'"', b"")[1:].isalnum()):
            parts.append((*source.comment, b""))
        parts += [(*spans[name], text) for name, text in literals.items()]
        text, at = b"", source.start
        for start, stop, new in sorted(parts):
            text += raw[at:start] + new
            at = stop
        self.texts.append(text + raw[at : source.stop] + self.task.program.documents[0].newline)
        return number

    def external(self, source: TpPosition, now: list[float], end: list[float]) -> dict[bytes, bytes] | None:
        """Literals of external axes at ``now`` (6) [mm or deg] instead of ``end`` (6); None where they are not
        known."""
        literals: dict[bytes, bytes] = {}
        for name, there, last in zip(EXTERNAL, now, end, strict=True):
            if there == last or (there != there and last != last):
                continue
            if not np.isfinite(there) or name not in source.groups[0].spans:
                return None
            literals[name] = fixed_one(there, self.task.least[0])
        return literals


def _decimals_of(literal: bytes) -> int:
    """The decimals that a literal is written with, its exponent considered."""
    mantissa, _, exponent = literal.upper().partition(b"E")
    return min(max(len(mantissa.partition(b".")[2]) - int(exponent or b"0"), 0), 12)
