"""What holds at a place of the program: values of variables, what is in force, and where the robot is."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import IntEnum

from postproc.languages.core.waits import Waits
from postproc.languages.rapid.syntax_tree import Remark
from postproc.languages.rapid.values import UnknownData, Value, joined
from postproc.toolpath import ArcFrame, OrientationMode

START, ELSEWHERE = -1, -2
"""In the place of a motion: the start of the program; what the program does not contain."""


class Varying(IntEnum):
    """In the place of what is in force: it differs with the path of the program."""

    VARYING = 0


VARYING = Varying.VARYING


@dataclass(slots=True)
class ProgramState:
    """``values``: of variables that are assigned anywhere; ``last``: offsets of the motions after which the robot is
    here.  ``displaced``: instructions in force that displace targets; ``override``: factor of speeds, None where it is
    not known; ``orientation``: OrientationMode by SingArea; ``arc``: ArcFrame by CirPathMode.  ``force``, ``switch``:
    the FORCE and COMPENSATE comments in force.
    """

    values: dict[bytes, Value] = field(default_factory=dict)
    last: frozenset[int] = frozenset([START])
    displaced: frozenset[bytes] = frozenset()
    override: float | None = 1.0
    orientation: OrientationMode = OrientationMode.VAR
    arc: ArcFrame = ArcFrame.PATH
    force: Remark | Varying | None = None
    switch: Remark | Varying | None = None
    checks_linear: bool | None = True
    checks_joint: bool | None = True
    waits: Waits = Waits.NO

    def copy(self) -> ProgramState:
        new = ProgramState()
        new.take(self)
        new.values = dict(self.values)
        return new

    def take(self, other: ProgramState) -> None:
        """Becomes the other one, and shares its values."""
        for one in fields(self):
            setattr(self, one.name, getattr(other, one.name))

    def join(self, other: ProgramState) -> bool:
        """Takes in what holds where another path meets this one; whether anything changed."""
        changed = False
        for name in self.values.keys() | other.values.keys():
            one, two = self.values.get(name), other.values.get(name)
            shown = name.rpartition(b"/")[2].decode("latin-1")
            reason = f"{shown} has different values on several paths of the program"
            new = UnknownData(reason) if one is None or two is None else joined(one, two, reason)
            if new != one:
                self.values[name] = new
                changed = True
        merged = {
            "last": self.last | other.last,
            "displaced": self.displaced | other.displaced,
            "override": self.override if self.override == other.override else None,
            "orientation": self.orientation
            if self.orientation == other.orientation
            else OrientationMode.UNKNOWN,
            "arc": self.arc if self.arc == other.arc else ArcFrame.UNKNOWN,
            "force": self.force if self.force == other.force else VARYING,
            "checks_linear": self.checks_linear if self.checks_linear == other.checks_linear else None,
            "checks_joint": self.checks_joint if self.checks_joint == other.checks_joint else None,
            "waits": self.waits if self.waits == other.waits else Waits.MAYBE,
            "switch": self.switch if self.switch == other.switch else VARYING,
        }
        for name_, value in merged.items():
            if getattr(self, name_) != value:
                setattr(self, name_, value)
                changed = True
        return changed
