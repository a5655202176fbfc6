"""What functions of the controller give for constants; None where that is not known.

Source: ABB, Technical reference manual, RAPID Instructions, Functions and Data types.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.units import DEG
from postproc.languages.core.rounded_numbers import are_comparable, computed
from postproc.languages.rapid.quaternions import quaternion_from_rotation, rotation_from_quaternion
from postproc.languages.rapid.values import GroupValue, Leaf, Value, number_of, numbers_of

_OF_ONE: dict[bytes, Callable[[float], float]] = {
    b"ABS": abs,
    b"SQRT": math.sqrt,
    b"EXP": math.exp,
    b"SIN": lambda x: math.sin(x * DEG),
    b"COS": lambda x: math.cos(x * DEG),
    b"TAN": lambda x: math.tan(x * DEG),
    b"ASIN": lambda x: math.asin(x) / DEG,
    b"ACOS": lambda x: math.acos(x) / DEG,
    b"ATAN": lambda x: math.atan(x) / DEG,
}
_OF_TWO: dict[bytes, Callable[[float, float], float]] = {
    b"POW": math.pow,
    b"ATAN2": lambda y, x: math.atan2(y, x) / DEG,
}
MOST_DECIMALS = 6
_Pose = tuple[Floats, Floats]
"""Position (3,) [mm] and rotation (3, 3)."""


def number_function(name: bytes, values: list[Value]) -> float | None:
    """The value of a function of numbers alone."""
    numbers = [number for value in values if (number := number_of(value)) is not None]
    if len(numbers) < len(values):
        return None
    try:
        if len(numbers) == 1 and name in _OF_ONE:
            return computed(_OF_ONE[name](numbers[0]), *numbers)
        if len(numbers) == 2 and name in _OF_TWO and any(numbers):
            return computed(_OF_TWO[name](*numbers), *numbers)
    except (ValueError, OverflowError):
        return None
    return None


def rounded(name: bytes, number: float, decimals: float) -> float | None:
    """``number`` rounded (ROUND) or cut off (TRUNC) to ``decimals``.  None where its digits beyond the controller's
    decide it: a half, and what may be below the number at which it is cut off; what is cut off below 0 is not stated.
    """
    if decimals not in range(MOST_DECIMALS + 1):
        return None
    scaled = number * 10.0**decimals
    whole = float(round(scaled)) if name == b"ROUND" else float(math.floor(scaled))
    exact = decimals == 0 and number == int(number)
    if name == b"ROUND":
        sure = are_comparable(scaled, math.floor(scaled) + 0.5) and scaled != math.floor(scaled) + 0.5
    else:
        near = float(round(scaled))
        sure = scaled >= 0 and abs(scaled - near) > 1e-5 * max(1.0, abs(scaled))
    return None if not sure and not exact else computed(whole / 10.0**decimals, number)


def pose_function(name: bytes, values: list[Value]) -> Value | None:
    """PoseMult: the second pose, which is stated in the first, where that is; PoseVect: likewise a position; PoseInv:
    the inverse of a pose."""
    first = _pose(values[0]) if values else None
    if first is None:
        return None
    place, turn = first
    if name == b"POSEINV" and len(values) == 1:
        return _shown((-turn.T @ place, turn.T))
    if len(values) != 2:
        return None
    if name == b"POSEVECT":
        vector = numbers_of(values[1], 3)
        return None if vector is None else _group(place + turn @ np.array(vector))
    second = _pose(values[1]) if name == b"POSEMULT" else None
    return None if second is None else _shown((place + turn @ second[0], turn @ second[1]))


FUNCTIONS_OF_POSES = frozenset([b"POSEMULT", b"POSEVECT", b"POSEINV"])
ROUNDING: Mapping[bytes, str] = {b"ROUND": "rounded", b"TRUNC": "cut off"}


def _pose(value: Value) -> _Pose | None:
    if not isinstance(value, GroupValue) or len(value.items) != 2:
        return None
    place, quaternion = numbers_of(value.items[0], 3), numbers_of(value.items[1], 4)
    if place is None or quaternion is None:
        return None
    turn = rotation_from_quaternion(np.array([quaternion]))[0]
    return None if np.isnan(turn).any() else (np.array(place), turn)


def _shown(pose: _Pose) -> Value:
    place, turn = pose
    return GroupValue((_group(place), _group(quaternion_from_rotation(turn[None], np.eye(1, 4))[0])))


def _group(numbers: Floats) -> Value:
    return GroupValue(tuple(Leaf(float(one)) for one in numbers))
