"""What holds at a place of the program: values of variables, what is in force, and where the robot is."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import IntEnum

from postproc.languages.core.motion_sources import START, Meeting, Source, met
from postproc.languages.core.persistent_map import KeyNumbers, PersistentMap
from postproc.languages.core.waits import Waits
from postproc.languages.rapid.syntax_tree import Remark
from postproc.languages.rapid.values import UnknownData, Value, joined
from postproc.toolpath import ArcFrame, OrientationMode


class Varying(IntEnum):
    """In the place of what is in force: it differs with the path of the program."""

    VARYING = 0


VARYING = Varying.VARYING


class _ValuesDiffer(Exception):
    """Two values differ."""


@dataclass(slots=True)
class ProgramState:
    """``values``: of variables that are assigned anywhere; ``last``: offsets of the motions after which the robot is
    here.  ``displaced``: instructions in force that displace targets; ``override``: factor of speeds, None where it is
    not known; ``orientation``: OrientationMode by SingArea; ``arc``: ArcFrame by CirPathMode.  ``force``, ``switch``:
    the FORCE and COMPENSATE comments in force; ``concurrent``: the program may go on while the last motion runs.
    """

    values: PersistentMap = field(default_factory=lambda: PersistentMap(KeyNumbers()))
    last: frozenset[Source] = frozenset([START])
    displaced: frozenset[bytes] = frozenset()
    override: float | None = 1.0
    orientation: OrientationMode = OrientationMode.VAR
    arc: ArcFrame = ArcFrame.PATH
    force: Remark | Varying | None = None
    switch: Remark | Varying | None = None
    checks_linear: bool | None = True
    checks_joint: bool | None = True
    waits: Waits = Waits.NO
    concurrent: bool = False

    def copy(self) -> ProgramState:
        return ProgramState(
            self.values, self.last, self.displaced, self.override, self.orientation, self.arc, self.force,
            self.switch, self.checks_linear, self.checks_joint, self.waits, self.concurrent,
        )  # fmt: skip

    def take(self, other: ProgramState) -> None:
        """Becomes the other one."""
        for one in fields(self):
            setattr(self, one.name, getattr(other, one.name))

    def put(self, name: bytes, value: Value) -> None:
        self.values = self.values.set(name, value)

    def is_same(self, other: ProgramState) -> bool:
        """Whether the same holds in both."""
        return _set_apart(self) == _set_apart(other) and same_values(self.values, other.values)

    def join(self, other: ProgramState, meeting: Meeting) -> bool:
        """Takes in what holds where another path meets this one, at the place of ``meeting``; whether anything
        changed."""
        before = self.values, _set_apart(self)
        self.values = self.values.merged(other.values, _of_paths)
        self.last = met(self.last, other.last, meeting)
        self.displaced |= other.displaced
        self.override = self.override if self.override == other.override else None
        if self.orientation != other.orientation:
            self.orientation = OrientationMode.UNKNOWN
        self.arc = self.arc if self.arc == other.arc else ArcFrame.UNKNOWN
        self.force = self.force if self.force == other.force else VARYING
        self.switch = self.switch if self.switch == other.switch else VARYING
        if self.checks_linear != other.checks_linear:
            self.checks_linear = None
        self.checks_joint = self.checks_joint if self.checks_joint == other.checks_joint else None
        self.waits = self.waits if self.waits == other.waits else Waits.MAYBE
        self.concurrent |= other.concurrent
        return self.values is not before[0] or _set_apart(self) != before[1]


def _set_apart(state: ProgramState) -> tuple[object, ...]:
    """What holds but for values."""
    return (
        state.last, state.displaced, state.override, state.orientation, state.arc, state.force, state.switch,
        state.checks_linear, state.checks_joint, state.waits, state.concurrent,
    )  # fmt: skip


def _of_paths(name: bytes, one: Value | None, other: Value | None) -> Value:
    """The value of a variable where two paths meet."""
    shown = name.rpartition(b"/")[2].decode("latin-1")
    reason = f"{shown} has different values on several paths of the program"
    new = UnknownData(reason) if one is None or other is None else joined(one, other, reason)
    return one if one is not None and new == one else new


def same_values(one: PersistentMap, other: PersistentMap) -> bool:
    """Whether the same variables have the same values."""
    try:
        one.merged(other, _checked)
    except _ValuesDiffer:
        return False
    return True


def _checked(_: bytes, one: Value | None, other: Value | None) -> Value | None:
    if one != other:
        raise _ValuesDiffer
    return one
