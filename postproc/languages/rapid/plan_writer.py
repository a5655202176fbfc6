"""What is to be written of a plan, in the numbers and the spelling of the text."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats, Ints, differs
from postproc.base.decimals import fixed_one
from postproc.base.geometry import rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.languages.dialect import Plan, Program, WritingSettings
from postproc.languages.rapid.plain_lines import decimals_of
from postproc.languages.rapid.quaternions import quaternion_from_rotation
from postproc.languages.rapid.target_places import MotionText, PointText, RapidSourceMap
from postproc.toolpath import Toolpath

FINER = 2
"""Decimals of a quaternion beyond those of an angle in degrees: a half of the last one turns by less than it."""
FULLEST, SMALLEST = 330 * DEG, 4 * DEG
"""[rad] Sweep of an arc that three points in digits define, and that the controller takes: the points have to be 1
degree apart as seen from its start (RAPID reference, MoveC, limitations; recalled)."""
NEAREST = 0.1
"""[mm] Distance of the points of an arc (likewise)."""


class PointNumbers(NamedTuple):
    """A point: what the text says, what is wanted (3 or 7 numbers) [mm, 1], and the decimals of each."""

    own: list[float]
    wanted: list[float]
    decimals: list[int]

    def changed(self) -> list[int]:
        """The numbers that differ by more than half a written step."""
        return [
            i
            for i, (own, wanted, count) in enumerate(zip(self.own, self.wanted, self.decimals, strict=True))
            if not abs(wanted - own) <= 0.5 * 10.0**-count
        ]


class PlanWriter:
    """A program, the plan for it, and what is looked up in them.  own (N,): the motion of the plan that takes the text
    of each row."""

    def __init__(self, program: Program, plan: Plan, writing: WritingSettings) -> None:
        """Raises ValueError where the plan has not one motion with the text of every row."""
        self.program, self.plan, self.writing = program, plan, writing
        self.path: Toolpath = program.toolpath
        self.places: RapidSourceMap = program.text
        self.raw = program.documents[0].raw
        self.least = [writing.mm] * 3 + [writing.deg + FINER] * 4
        self.own: Ints = np.flatnonzero(plan.own)
        if not np.array_equal(plan.source[self.own], np.arange(len(self.path))):
            raise ValueError("a plan needs one motion with the text of every row")

    def text(self, row: int) -> MotionText:
        """Raises ValueError for a motion that is not understood."""
        text = self.places.motions[row]
        if text is None:
            raise ValueError(f"row {row} is not understood and cannot be written")
        return text

    def literal(self, spot: tuple[int, int]) -> bytes:
        return b"".join(self.raw[spot[0] : spot[1]].split())

    def decimals(self, point: PointText, count: int) -> list[int]:
        """Decimals of the first numbers of a point: those of the text, or the least."""
        return [
            max(least, decimals_of(self.literal(spot)) if spot[0] >= 0 else 0)
            for spot, least in zip(point.spots[:count], self.least[:count], strict=True)
        ]

    def spelt(self, point: PointText, numbers: PointNumbers) -> list[bytes]:
        """The numbers as they are to be written; those that stay as they are."""
        changed = set(numbers.changed())
        return [
            self.literal(spot).lstrip(b"+")
            if i not in changed and spot[0] >= 0
            else fixed_one(numbers.wanted[i], numbers.decimals[i])
            for i, spot in enumerate(point.spots[: len(numbers.wanted)])
        ]

    def wanted(self, own: Floats, rows: Ints, motions: Ints) -> Floats:
        """(K, 7) [mm, 1] targets of motions (K,) of the plan that stem from rows (K,), in the spelling of the text,
        which has the numbers ``own`` (K, 7) there."""
        numbers = own.copy()
        position, rotation = self.plan.position[motions], self.plan.rotation[motions]
        shifted = differs(position, self.path.position[rows]).any(axis=1)
        turned = differs(rotation, self.path.rotation[rows]).any(axis=(1, 2))
        numbers[shifted, :3] = position[shifted] / MM
        if turned.any():
            numbers[turned, 3:] = quaternion_from_rotation(rotation[turned], numbers[turned, 3:])
        return numbers

    def vias(self, motions: Ints) -> Floats:
        """(K, 3) [mm] points in the middle of the arcs ``motions`` (K,); NaN for motions that are no arcs."""
        plan = self.plan
        centre = plan.centre[motions]
        back = rotation_from_vector(np.nan_to_num(-0.5 * plan.sweep[motions][:, None] * plan.normal[motions]))
        radius = plan.position[motions] - centre
        return np.asarray((centre + (back @ radius[..., None])[..., 0]) / MM)

    def unfit_arc(self, motion: int) -> str:
        """Why three points in digits do not define an arc of the plan; "" where they do."""
        sweep = float(self.plan.sweep[motion])
        end = self.plan.position[np.array([motion])][0]
        radius = float(np.linalg.norm(end - self.plan.centre[motion])) / MM
        nearest = 2 * radius * min(abs(np.sin(sweep / 4)), abs(np.sin(sweep / 2)))
        if sweep > FULLEST:
            return "the corrected arc is nearly a full turn, which three points do not define"
        if sweep < SMALLEST or nearest < NEAREST:
            return "the corrected arc is too short for MoveC"
        return ""


def aggregate(texts: list[bytes], words: bytes) -> bytes:
    """A robtarget of seven numbers and its configuration and external axes."""
    return b"[[" + b",".join(texts[:3]) + b"],[" + b",".join(texts[3:]) + b"]," + words + b"]"
