"""What is to be written of a plan, in the numbers and the spelling of the text."""

from __future__ import annotations

from postproc.base.arrays import Floats, Ints
from postproc.base.decimals import decimals_of
from postproc.base.units import DEG, MM
from postproc.languages.core.plan_rows import ArcLimits, PlannedNumbers, PlanRows
from postproc.languages.dialect import Plan, Program, WritingSettings
from postproc.languages.rapid.quaternions import quaternion_from_rotation
from postproc.languages.rapid.target_places import MotionText, PointText, RapidSourceMap

FINER = 2
"""Decimals of a quaternion beyond those of an angle in degrees: a half of the last one turns by less than it."""


class PlanWriter(PlanRows):
    """The rows of a module beside a plan, with their text."""

    limits = ArcLimits(330 * DEG, 4 * DEG, 0.1, "MoveC")
    """The points have to be 0.1 mm apart, and 1 degree as seen from the start (RAPID reference, MoveC, limitations;
    recalled)."""

    def __init__(self, program: Program, plan: Plan, writing: WritingSettings) -> None:
        """Raises ValueError where the plan has not one motion with the text of every row."""
        super().__init__(program, plan, writing)
        self.places: RapidSourceMap = program.text
        self.least = [writing.mm] * 3 + [writing.deg + FINER] * 4

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

    def spelt(self, point: PointText, numbers: PlannedNumbers) -> list[bytes]:
        """The numbers as they are to be written; those that stay as they are."""
        changed = set(numbers.changed())
        return [
            self.literal(spot).lstrip(b"+") if i not in changed and spot[0] >= 0 else numbers.literal(i)
            for i, spot in enumerate(point.spots[: len(numbers.wanted)])
        ]

    def wanted(self, own: Floats, rows: Ints, motions: Ints) -> Floats:
        """(K, 7) [mm, 1] targets of motions (K,) of the plan that stem from rows (K,), in the spelling of the text,
        which has the numbers ``own`` (K, 7) there."""
        numbers = own.copy()
        shifted, turned = self.moved(rows, motions)
        numbers[shifted, :3] = self.plan.position[motions[shifted]] / MM
        if turned.any():
            rotation = self.plan.rotation[motions[turned]]
            numbers[turned, 3:] = quaternion_from_rotation(rotation, numbers[turned, 3:])
        return numbers


def aggregate(texts: list[bytes], words: bytes) -> bytes:
    """A robtarget of seven numbers and its configuration and external axes."""
    return b"[[" + b",".join(texts[:3]) + b"],[" + b",".join(texts[3:]) + b"]," + words + b"]"
