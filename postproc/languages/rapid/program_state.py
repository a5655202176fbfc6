"""What holds at a place of the program: values of variables, what is in force, and where the robot is."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from postproc.languages.core.comments_in_force import Varying, join_comments
from postproc.languages.core.field_joins import SOMETIMES, FieldJoins, either, lost
from postproc.languages.core.motion_sources import START, Meeting, Source, met
from postproc.languages.core.persistent_map import KeyNumbers, PersistentMap
from postproc.languages.core.waits import Waits
from postproc.languages.rapid.syntax_tree import Remark
from postproc.languages.rapid.values import UnknownData, Value, joined
from postproc.toolpath import ArcFrame, OrientationMode


class _ValuesDiffer(Exception):
    """Two values differ."""


@dataclass(slots=True)
class ProgramState:
    """``values``: of variables that are assigned anywhere; ``last``: offsets of the motions after which the robot is
    here.  ``displaced``: instructions in force that displace targets; ``override``: factor of speeds by VelSet, None
    where it is not known; ``scaled``: something else may scale or limit them; ``orientation``: OrientationMode by
    SingArea; ``arc``: ArcFrame by CirPathMode.  ``force``, ``switch``: the FORCE and COMPENSATE comments in force;
    ``concurrent``: the program may go on while the last motion runs.
    """

    values: PersistentMap = field(default_factory=lambda: PersistentMap(KeyNumbers()))
    last: frozenset[Source] = frozenset([START])
    displaced: frozenset[bytes] = frozenset()
    override: float | None = 1.0
    scaled: bool = False
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
            self.values, self.last, self.displaced, self.override, self.scaled, self.orientation, self.arc, self.force,
            self.switch, self.checks_linear, self.checks_joint, self.waits, self.concurrent,
        )  # fmt: skip

    def take(self, other: ProgramState) -> None:
        """Becomes the other one."""
        for name in _NAMES:
            setattr(self, name, getattr(other, name))

    def put(self, name: bytes, value: Value) -> None:
        self.values = self.values.set(name, value)

    def forget_own(self, routine: bytes) -> None:
        """Takes out the data of a routine that does not outlive it."""
        for name in [name for name, _ in self.values.items() if name.startswith(routine + b"/")]:
            self.values = self.values.set(name, None)

    @property
    def known(self) -> PersistentMap:
        """What is known of variables."""
        return self.values

    def forget(self) -> None:
        """Makes every variable unknown that the program has set."""
        for name, value in self.values.items():
            if not isinstance(value, UnknownData):
                self.put(name, UnknownData(_varying(name)))

    def is_same(self, other: ProgramState) -> bool:
        """Whether the same holds in both."""
        apart = self.last == other.last and _JOINS.values(self) == _JOINS.values(other)
        return apart and same_values(self.values, other.values)

    def join(self, other: ProgramState, meeting: Meeting) -> bool:
        """Takes in what holds where another path meets this one, at the place of ``meeting``; whether anything
        changed."""
        changed = _JOINS.changes(self, other)
        values = self.values.merged(other.values, _of_paths, remembered=True)
        last = met(self.last, other.last, meeting)
        if not changed and values is self.values and last == self.last:
            return False
        self.values, self.last = values, last
        for name, value in changed.items():
            setattr(self, name, value)
        return True


_NAMES = tuple(one.name for one in fields(ProgramState))
_JOINS = FieldJoins(
    {
        "displaced": frozenset.union,
        "override": lost(None),
        "scaled": either,
        "orientation": lost(OrientationMode.UNKNOWN),
        "arc": lost(ArcFrame.UNKNOWN),
        "force": join_comments,
        "switch": join_comments,
        "checks_linear": lost(None),
        "checks_joint": lost(None),
        "waits": SOMETIMES,
        "concurrent": either,
    }
)


def _of_paths(name: bytes, one: Value | None, other: Value | None) -> Value:
    """The value of a variable where two paths meet."""
    if isinstance(one, UnknownData) and one == other:
        return one
    reason = _varying(name)
    new = UnknownData(reason) if one is None or other is None else joined(one, other, reason)
    return one if one is not None and new == one else other if other is not None and new == other else new


def _varying(name: bytes) -> str:
    """Why a variable is not known whose values differ."""
    return (
        f"{name.rpartition(b'/')[2].decode('latin-1')} has different values on several paths of the program"
    )


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
