"""Values of expressions: constants, and UnknownData with its reason for everything else."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from postproc.base.geometry import rotation_from_abc, rotation_from_vector
from postproc.base.units import DEG
from postproc.languages.core.rounded_numbers import WHOLE, are_comparable, computed
from postproc.languages.rapid.data_types import RECORDS, Components
from postproc.languages.rapid.function_values import (
    FUNCTIONS_OF_POSES,
    ROUNDING,
    number_function,
    pose_function,
    rounded,
)
from postproc.languages.rapid.quaternions import quaternion_from_rotation, rotation_from_quaternion
from postproc.languages.rapid.syntax_tree import (
    AND_AFTER_NOT,
    GOES_ON,
    SENSE,
    Aggregate,
    Argument,
    Component,
    Expression,
    FunctionCall,
    Index,
    Name,
    NumberLiteral,
    OperatorExpression,
    Star,
    StringLiteral,
    presence_name,
)
from postproc.languages.rapid.values import (
    FALSE,
    TRUE,
    GroupValue,
    Leaf,
    UnknownData,
    Value,
    number_of,
    numbers_of,
    plain,
    truth_of,
    unknown_in,
)

Typed = tuple[Value, bytes]
"""A value and its type, b"" where that is not known."""

ROUNDED = "it is decided by how the controller rounds"

_COMPARISONS: dict[bytes, Callable[[float, float], bool]] = {
    b"<": lambda a, b: a < b,
    b">": lambda a, b: a > b,
    b"<=": lambda a, b: a <= b,
    b">=": lambda a, b: a >= b,
}


@dataclass(slots=True, eq=False)
class Evaluator:
    """``look``: the value and type of a name; ``records``: further types; ``shadowed``: functions of the program,
    whose names mean these."""

    look: Callable[[bytes], Typed]
    records: Mapping[bytes, Components] = field(default_factory=dict)
    shadowed: frozenset[bytes] = frozenset()

    def value(self, expression: Expression) -> Value:
        return self.typed(expression)[0]

    def typed(self, expression: Expression) -> Typed:
        """The value of an expression, and its type."""
        return _TYPED[type(expression)](self, expression)

    def _name(self, expression: Name) -> Typed:
        if expression.name in (b"TRUE", b"FALSE"):
            return (TRUE if expression.name == b"TRUE" else FALSE), b"BOOL"
        return self.look(expression.name)

    def assigned_place(self, target: Expression) -> tuple[bytes | None, tuple[int, ...]]:
        """The variable to which an assignment goes, and the indices of the part that it sets, -1 where not known."""
        parts: list[Index | Component] = []
        while isinstance(target, Index | Component):
            parts.insert(0, target)
            target = target.base
        if not isinstance(target, Name):
            return None, ()
        place: list[int] = []
        for part in parts:
            if isinstance(part, Index):
                numbers = [number_of(self.value(index)) for index in part.indices]
                place += [-1 if one is None or one != int(one) else int(one) - 1 for one in numbers]
            else:
                names = [name for name, _ in self.components(self.typed(part.base)[1])]
                place.append(names.index(part.name) if part.name in names else -1)
        return target.name, tuple(place)

    def components(self, kind: bytes) -> Components:
        """Those of a type, () of one that has none."""
        return RECORDS.get(kind) or self.records.get(kind, ())

    def _component(self, expression: Component) -> Typed:
        value, kind = self.typed(expression.base)
        for place, (name, part) in enumerate(self.components(kind)):
            if name == expression.name:
                if isinstance(value, GroupValue) and len(value.items) == len(self.components(kind)):
                    return value.items[place], part
                return (
                    value if isinstance(value, UnknownData) else UnknownData("its component is not known")
                ), part
        return UnknownData(f"{_shown(expression.name)} is no component that is known"), b""

    def _element(self, expression: Index) -> Typed:
        value, kind = self.typed(expression.base)
        for index in expression.indices:
            number = number_of(self.value(index))
            if number is None or number != int(number):
                return UnknownData("the index of an array is not a constant"), kind
            if not isinstance(value, GroupValue):
                return (value if isinstance(value, UnknownData) else UnknownData("it is not an array")), kind
            if not 1 <= number <= len(value.items):
                return UnknownData("the index is outside of its array"), kind
            value = value.items[int(number) - 1]
        return value, kind

    def _operation(self, expression: OperatorExpression) -> Value:
        """The value of an expression of operators; of a long one from its innermost first operand on."""
        chain = [expression]
        while isinstance(first := chain[-1].operands[0], OperatorExpression):
            chain.append(first)
        value = self.value(first)
        for one in reversed(chain):
            value = self._operated(one.operator, [value, *map(self.value, one.operands[1:])])
        return value

    def _operated(self, operator: bytes, values: list[Value]) -> Value:
        if operator == b"()":
            return values[0]
        if operator in (b"AND", b"OR"):
            truths = [truth_of(value) for value in values]
            decided = operator == b"OR"
            if decided in truths:
                return TRUE if decided else FALSE
            if None in truths:
                return next(
                    (v for v in values if isinstance(v, UnknownData)), UnknownData("it is no truth value")
                )
            return FALSE if decided else TRUE
        unknown = next((found for value in values if (found := unknown_in(value)) is not None), None)
        if unknown is not None:
            return unknown
        if operator == AND_AFTER_NOT:
            return UnknownData("AND after NOT has no brackets: it is not known what NOT negates")
        if operator in (SENSE, GOES_ON):
            return _of_loop(values)
        if operator == b"NOT":
            truth = truth_of(values[0])
            return UnknownData("it is no truth value") if truth is None else FALSE if truth else TRUE
        return _combined(operator, values)

    def _call(self, expression: FunctionCall) -> Typed:
        name, arguments = expression.name, expression.arguments
        if name in self.shadowed:
            return UnknownData(f"{_shown(name)} is computed where the program runs"), b""
        required = [argument.value for argument in arguments if not argument.name]
        if name == b"PRESENT" and len(arguments) == 1 and isinstance(required[0], Name):
            return self.look(presence_name(required[0].name))[0], b"BOOL"
        values = [self.value(one) for one in required if one is not None]
        for value in values:
            unknown = unknown_in(value)
            if unknown is not None:
                return unknown, b""
        if name == b"OFFS" and len(required) == len(arguments) == 4:
            return _offs(values), b"ROBTARGET"
        if name == b"RELTOOL" and len(required) == 4:
            return self._rel_tool(values, arguments), b"ROBTARGET"
        if name in (b"ORIENTZYX", b"NORIENT") and len(required) == len(arguments):
            return _orientation(values), b"ORIENT"
        if name in FUNCTIONS_OF_POSES and len(required) == len(arguments):
            kind = b"POS" if name == b"POSEVECT" else b"POSE"
            return pose_function(name, values) or UnknownData(f"{_shown(name)} has no value there"), kind
        if name in ROUNDING and len(required) == 1:
            return self._rounded(name, values[0], arguments[1:]), b"NUM"
        number = number_function(name, values) if len(required) == len(arguments) else None
        if number is not None:
            return Leaf(number), b"NUM"
        return UnknownData(f"{_shown(name)} is computed where the program runs"), b""

    def _rounded(self, name: bytes, value: Value, options: tuple[Argument, ...]) -> Value:
        """Round and Trunc; how many decimals is an option of them."""
        decimals: float | None = 0.0
        if options:
            known = len(options) == 1 and options[0].name == b"DEC" and options[0].value is not None
            decimals = number_of(self.value(options[0].value)) if known and options[0].value else None
        number = number_of(value)
        found = None if number is None or decimals is None else rounded(name, number, decimals)
        if found is None:
            return UnknownData(f"what is {ROUNDING[name]} is decided by how the controller rounds")
        return Leaf(found)

    def _rel_tool(self, values: list[Value], arguments: tuple[Argument, ...]) -> Value:
        """The target displaced by dx, dy, dz in tool axes, then turned about the tool's x, the new y and z axes."""
        angles = dict.fromkeys((b"RX", b"RY", b"RZ"), 0.0)
        for argument in arguments:
            if not argument.name:
                continue
            angle = None if argument.value is None else self.value(argument.value)
            number = None if angle is None else number_of(angle)
            if argument.name not in angles or number is None:
                return (
                    angle
                    if isinstance(angle, UnknownData)
                    else UnknownData("an argument of RelTool is not known")
                )
            angles[argument.name] = number
        target = values[0]
        steps = [number_of(value) for value in values[1:]]
        if not isinstance(target, GroupValue) or len(target.items) != 4 or None in steps:
            return UnknownData("it is no target")
        position, quaternion = numbers_of(target.items[0], 3), numbers_of(target.items[1], 4)
        if position is None or quaternion is None:
            return UnknownData("it is no target")
        rotation = rotation_from_quaternion(np.array([quaternion]))[0]
        if np.isnan(rotation).any():
            return UnknownData("the length of its quaternion is not 1")
        moved = np.array(position) + rotation @ np.array(steps, float)
        turn = np.eye(3)
        for axis, angle_deg in zip(np.eye(3), angles.values(), strict=True):
            turn = turn @ rotation_from_vector(axis * angle_deg * DEG)
        new = quaternion_from_rotation((rotation @ turn)[None], np.array([quaternion]))[0]
        turned = (
            GroupValue(tuple(Leaf(float(q)) for q in new)) if any(angles.values()) else plain(target.items[1])
        )
        place = GroupValue(tuple(Leaf(float(x)) for x in moved))
        return GroupValue((place, turned, *map(plain, target.items[2:])))


def is_component(target: Expression) -> bool:
    """Whether an assignment goes to a component of a variable that is no array."""
    base: Expression | None = None
    while isinstance(target, Index | Component):
        base, target = target, target.base
    return isinstance(base, Component)


def unknown_record(
    kind: bytes, components: Callable[[bytes], Components], unknown: UnknownData, depth: int = 0
) -> Value:
    """A record of a type of which no component is known."""
    parts = components(kind) if depth < 8 else ()
    if not parts:
        return unknown
    return GroupValue(tuple(unknown_record(part, components, unknown, depth + 1) for _, part in parts))


def _offs(values: list[Value]) -> Value:
    """The target displaced in the axes of its work object."""
    target, steps = values[0], [number_of(value) for value in values[1:]]
    if not isinstance(target, GroupValue) or len(target.items) != 4:
        return UnknownData("it is no target")
    position = numbers_of(target.items[0], 3)
    if position is None or None in steps:
        return UnknownData("it is no target")
    place = GroupValue(tuple(Leaf(x + (d or 0.0)) for x, d in zip(position, steps, strict=True)))
    return GroupValue((place, *map(plain, target.items[1:])))


def _orientation(values: list[Value]) -> Value:
    """OrientZYX: of turns about z, the new y and the new x axis [deg]; NOrient: one of length 1."""
    angles = [number_of(value) for value in values]
    if len(angles) == 3 and None not in angles:
        abc = np.array([angles], float) * DEG
        turn = quaternion_from_rotation(rotation_from_abc(abc), np.array([[1.0, 0.0, 0.0, 0.0]]))[0]
    else:
        parts = numbers_of(values[0], 4) if len(values) == 1 else None
        turn = np.array(parts if parts is not None else np.zeros(4))
        if not 0.5 < float(np.linalg.norm(turn)) < 2:
            return UnknownData("it is no orientation")
        turn = turn / np.linalg.norm(turn)
    return GroupValue(tuple(Leaf(float(one)) for one in turn))


def _combined(operator: bytes, values: list[Value]) -> Value:
    """Numbers, and sums of positions."""
    if len(values) == 1:
        number = number_of(values[0])
        if number is None:
            return UnknownData("its value is not known")
        return Leaf(-number if operator == b"-" else number)
    if operator in (b"=", b"<>"):
        if not _comparable(*values):
            return UnknownData(ROUNDED)
        same = plain(values[0]) == plain(values[1])
        return TRUE if same == (operator == b"=") else FALSE
    one, other = (number_of(value) for value in values)
    if one is not None and other is not None:
        return _of_numbers(operator, one, other)
    vectors = [numbers_of(value, 3) for value in values]
    if operator in (b"+", b"-") and vectors[0] is not None and vectors[1] is not None:
        sense = 1.0 if operator == b"+" else -1.0
        pairs = zip(vectors[0], vectors[1], strict=True)
        return GroupValue(tuple(Leaf(a + sense * b) for a, b in pairs))
    return UnknownData("it is computed")


def _of_loop(values: list[Value]) -> Value:
    """1 or -1 of the first and the last value of a FOR; of its variable, the last value and the step whether it goes
    on, for whole numbers: what rounding does to others is not known."""
    numbers = [number_of(value) for value in values]
    known = [number for number in numbers if number is not None]
    if len(known) < len(numbers):
        return UnknownData("the bounds of a loop are not known")
    if len(known) == 2:
        return Leaf(1.0 if known[0] <= known[1] else -1.0)
    at, last, step = known
    if step == 0 or not all(one == int(one) and abs(one) < WHOLE for one in (at, step)):
        return UnknownData("a loop counts in parts")
    return TRUE if (last - at) * step >= 0 else FALSE


def _comparable(one: Value, other: Value) -> bool:
    """Whether it is known that two values are the same, or are not, in the numbers of the controller."""
    if isinstance(one, GroupValue) and isinstance(other, GroupValue):
        return all(_comparable(*pair) for pair in zip(one.items, other.items, strict=False))
    numbers = number_of(one), number_of(other)
    return numbers[0] is None or numbers[1] is None or are_comparable(numbers[0], numbers[1])


def _of_numbers(operator: bytes, one: float, other: float) -> Value:
    if operator in _COMPARISONS:
        if not are_comparable(one, other):
            return UnknownData(ROUNDED)
        return TRUE if _COMPARISONS[operator](one, other) else FALSE
    if operator in (b"+", b"-", b"*"):
        value = one + other if operator == b"+" else one - other if operator == b"-" else one * other
        return Leaf(computed(value, one, other)) if math.isfinite(value) else UnknownData("it is too large")
    if operator == b"/" and other != 0 and math.isfinite(one / other):
        return Leaf(computed(one / other, one, other))
    if operator in (b"DIV", b"MOD") and other > 0 and one >= 0 and one == int(one) and other == int(other):
        return Leaf(float(one // other if operator == b"DIV" else one % other))
    return UnknownData("it is computed")


_TYPED: dict[type[Expression], Callable[[Evaluator, Any], Typed]] = {
    NumberLiteral: lambda self, one: (Leaf(one.value, one.start, one.stop), b"NUM"),
    StringLiteral: lambda self, one: (Leaf(one.value), b"STRING"),
    Name: Evaluator._name,
    Aggregate: lambda self, one: (GroupValue(tuple(map(self.value, one.items))), b""),
    Component: Evaluator._component,
    Index: Evaluator._element,
    OperatorExpression: lambda self, one: (self._operation(one), b""),
    FunctionCall: Evaluator._call,
    Star: lambda self, one: (UnknownData("its target is stored outside of the text (*)"), b""),
}
"""What gives the value and the type of each form of an expression."""


def _shown(name: bytes) -> str:
    return name.decode("latin-1")[:40]
