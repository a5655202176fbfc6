"""What a motion statement says in one execution, and in all of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from postproc.languages.core.comments_in_force import CONTRADICTED, VARYING, Varying, join_comments
from postproc.languages.core.field_joins import SOMETIMES, FieldJoins, either, lost
from postproc.languages.core.motion_sources import Meeting, Source, met
from postproc.languages.core.waits import Waits
from postproc.languages.rapid.data_types import STOP_KINDS
from postproc.languages.rapid.evaluation import Evaluator
from postproc.languages.rapid.instructions import (
    HALTING,
    SHORTEST_WAIT_S,
    WAITING,
    MotionArguments,
    MotionForm,
    sort_arguments,
    switch_value,
)
from postproc.languages.rapid.program_state import ProgramState
from postproc.languages.rapid.syntax_tree import Argument, Index, Instruction, Name, PlainMotions, Remark
from postproc.languages.rapid.values import (
    Leaf,
    UnknownData,
    Value,
    joined,
    number_of,
    truth_of,
    unknown_in,
)
from postproc.toolpath import ArcFrame, Kind, OrientationMode

NAN = math.nan
LIMIT = 5000.0
"""[mm/s] that VelSet has as the largest speed where nothing else is stated: faster motions may be limited."""
DIFFERS = "it has different values in several executions of its line"

Problem = tuple[str, str]
"""Code and message of why a motion cannot be corrected."""


@dataclass(frozen=True, slots=True)
class FrameUse:
    """A tool or a work object: the name it has in the motion, "" for an expression, and its value."""

    name: bytes
    value: Value


@dataclass(frozen=True, slots=True)
class MotionFact:
    """A motion: ``target``, ``via``: its points (``via`` of an arc alone); speed, zone: [mm/s], [mm], NaN where not
    known; ``stops``: it ends in a stop point.  ``before``: motions after which it runs; ``checked``: the configuration
    of its target counts, None where that is not known.  ``lines``: the run of which it is the first motion, and for
    which it represents but for the numbers of the targets.  ``waits``: as in a ProgramState."""

    statement: Instruction
    form: MotionForm
    arguments: MotionArguments | None
    target: Value
    via: Value | None
    tool: FrameUse
    base: FrameUse
    speed: float
    zone: float
    stops: bool
    orientation: OrientationMode
    arc: ArcFrame
    before: frozenset[Source]
    force: Remark | Varying | None
    switch: Remark | Varying | None
    problem: Problem | None
    checked: bool | None
    lines: PlainMotions | None = None
    waits: Waits = Waits.NO

    @property
    def count(self) -> int:
        """How many motions it represents."""
        return 1 if self.lines is None else len(self.lines)

    def remarks(self) -> list[Remark]:
        """The comments that are in force."""
        return [one for one in (self.force, self.switch) if isinstance(one, Remark)]

    def joined(self, other: MotionFact, meeting: Meeting) -> MotionFact:
        """What holds in both executions; meeting: that of what runs before them."""
        changed = _JOINS.changes(self, other)
        return replace(self, before=met(self.before, other.before, meeting), **changed)


def _of_both(one: FrameUse, other: FrameUse) -> FrameUse:
    return FrameUse(one.name if one.name == other.name else b"", joined(one.value, other.value, DIFFERS))


def _point(one: Value | None, other: Value | None) -> Value | None:
    """A target, or an auxiliary point, which a motion has or has not."""
    if one is None:
        return None
    return UnknownData(DIFFERS) if other is None else joined(one, other, DIFFERS)


_JOINS = FieldJoins(
    {
        "target": _point,
        "via": _point,
        "tool": _of_both,
        "base": _of_both,
        "speed": lost(NAN),
        "zone": lost(NAN),
        "stops": lost(False),
        "orientation": lost(OrientationMode.UNKNOWN),
        "arc": lost(ArcFrame.UNKNOWN),
        "force": join_comments,
        "switch": join_comments,
        "problem": either,
        "checked": lost(None),
        "waits": SOMETIMES,
    }
)


def motion_fact(
    statement: Instruction, form: MotionForm, state: ProgramState, evaluator: Evaluator
) -> MotionFact:
    """The motion in ``state``."""
    arguments = sort_arguments(form, statement.arguments)
    if arguments is None:
        return not_read(statement, form, state, "its arguments are not understood")
    options = arguments.options
    points = [_value(argument, evaluator) for argument in arguments.points]
    zone, stops = _zone(arguments, evaluator)
    work_object = options.get(b"WOBJ")
    base = (
        FrameUse(b"WOBJ0", UnknownData("", b"WOBJ0"))
        if work_object is None
        else _frame(work_object, evaluator)
    )
    return MotionFact(
        statement,
        form,
        arguments,
        points[-1],
        points[0] if form.points == 2 else None,
        _frame(arguments.tool, evaluator),
        base,
        _speed(arguments, form, state, evaluator),
        zone,
        stops,
        state.orientation,
        state.arc,
        state.last,
        state.force,
        state.switch,
        _problem(state, options),
        state.checks_joint if form.kind == Kind.PTP else state.checks_linear,
        waits=state.waits,
    )


def not_read(statement: Instruction, form: MotionForm, state: ProgramState, message: str) -> MotionFact:
    """A motion of which only its place is known."""
    unknown = UnknownData(message)
    nothing = FrameUse(b"", unknown)
    return MotionFact(
        statement, form, None, unknown, unknown if form.points == 2 else None, nothing, nothing, NAN, NAN,
        False, state.orientation, state.arc, state.last, state.force, state.switch, ("RAP001", message),
        None, waits=state.waits,
    )  # fmt: skip


def override_of(arguments: tuple[Argument, ...], evaluator: Evaluator) -> float | None:
    """The factor of VelSet; a limit below usual speeds makes it unknown."""
    values = [evaluator.value(a.value) for a in arguments if a.value is not None]
    numbers = [number_of(value) for value in values]
    if len(numbers) != 2 or numbers[0] is None or numbers[1] is None or numbers[1] < LIMIT:
        return None
    return numbers[0] / 100.0


def waits_at(step: Instruction, evaluator: Evaluator) -> Waits:
    """Whether the program waits at an instruction."""
    if step.name == b"WAITTIME":
        times = [one.value for one in step.arguments if not one.name and one.value is not None]
        seconds = number_of(evaluator.value(times[0])) if len(times) == 1 else None
        stands = any(argument.name == b"INPOS" for argument in step.arguments)
        return Waits.YES if stands or (seconds or 0.0) >= SHORTEST_WAIT_S else Waits.MAYBE
    if step.name in HALTING:
        return Waits.YES
    return Waits.MAYBE if step.name in WAITING else Waits.NO


def _problem(state: ProgramState, options: dict[bytes, Argument]) -> Problem | None:
    if state.displaced:
        names = ", ".join(sorted(name.decode("latin-1") for name in state.displaced))
        return "RAP008", f"its target is displaced, or the arm is soft ({names})"
    if b"CORR" in options:
        return "RAP008", "corrections of a sensor are added to its path (\\Corr)"
    if b"ID" in options:
        return "RAP014", "it is synchronised with another robot or positioner (\\ID)"
    if state.force is VARYING or state.switch is VARYING:
        return "RAP006", CONTRADICTED
    return None


def _value(argument: Argument, evaluator: Evaluator) -> Value:
    return UnknownData("it has no value") if argument.value is None else evaluator.value(argument.value)


def _frame(argument: Argument, evaluator: Evaluator) -> FrameUse:
    expression = argument.value
    name = expression.name if isinstance(expression, Name) else b""
    return FrameUse(name, _value(argument, evaluator))


def _speed(arguments: MotionArguments, form: MotionForm, state: ProgramState, evaluator: Evaluator) -> float:
    """[mm/s] of the TCP; NaN where it follows from a time, a process, or is not known."""
    if not form.feed or b"T" in arguments.options or state.override is None or state.scaled:
        return NAN
    own = switch_value(arguments.options.get(b"V"))
    if own is not None:
        value = number_of(evaluator.value(own))
    else:
        value = number_of(first_of(_value(arguments.speed, evaluator)))
    return NAN if value is None or not 0 < value <= LIMIT else value * state.override


def _zone(arguments: MotionArguments, evaluator: Evaluator) -> tuple[float, bool]:
    """[mm] by which the TCP may leave its path before the target, and whether the robot stops there."""
    if b"INPOS" in arguments.options:  # what it states takes the place of the zone
        surely = _stops_at(arguments.options[b"INPOS"], evaluator)
        return (0.0 if surely else NAN), surely
    value = _value(arguments.zone, evaluator)
    stops = truth_of(first_of(value))
    own = switch_value(arguments.options.get(b"Z"))
    if stops is None:
        return NAN, False
    if stops:
        return 0.0, True
    size = number_of(evaluator.value(own)) if own is not None else number_of(item_of(value, 1))
    return (NAN if size is None or size < 0 else size), False


def _stops_at(argument: Argument, evaluator: Evaluator) -> bool:
    """Whether the robot surely stops at a point with this stoppointdata: not where it follows a conveyor."""
    kind = number_of(first_of(_value(argument, evaluator)))
    return kind in (STOP_KINDS[b"INPOS"], STOP_KINDS[b"STOPTIME"])


def first_of(value: Value) -> Value:
    return item_of(value, 0)


def item_of(value: Value, at: int) -> Value:
    """An item of a group, unknown where it has none."""
    if isinstance(value, Leaf):
        return UnknownData("it is no aggregate")
    if isinstance(value, UnknownData):
        return value
    return value.items[at] if at < len(value.items) else UnknownData("a component is missing")


def is_direct(argument: Argument) -> bool:
    """Whether a point is a variable or an element of an array, and not computed."""
    expression = argument.value
    while isinstance(expression, Index):
        expression = expression.base
    return isinstance(expression, Name)


def reason_of(value: Value, otherwise: str) -> str:
    """Why a value is not known."""
    unknown = unknown_in(value)
    return otherwise if unknown is None or not unknown.reason else unknown.reason
