"""Values of KRL: numbers, words, structures; frames as numbers.

A structure is a dict of its components.  UNDETERMINED is what the description of the language leaves open.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np


class Stop(Exception):
    """The program does not go on: an error of its own, or what it does next is not determined."""


class Undetermined:
    def __repr__(self) -> str:
        return "undetermined"


UNDETERMINED = Undetermined()

FRAME = ("X", "Y", "Z", "A", "B", "C")
AXES = ("A1", "A2", "A3", "A4", "A5", "A6")
EXTERNAL = ("E1", "E2", "E3", "E4", "E5", "E6")

REAL, INT, BOOL, CHAR, WORD = "REAL", "INT", "BOOL", "CHAR", "word"
STRUCTURES: dict[str, dict[str, str]] = {
    "FRAME": dict.fromkeys(FRAME, REAL),
    "POS": {**dict.fromkeys(FRAME, REAL), "S": INT, "T": INT},
    "E3POS": {**dict.fromkeys(FRAME + EXTERNAL[:3], REAL), "S": INT, "T": INT},
    "E6POS": {**dict.fromkeys(FRAME + EXTERNAL, REAL), "S": INT, "T": INT},
    "AXIS": dict.fromkeys(AXES, REAL),
    "E6AXIS": dict.fromkeys(AXES + EXTERNAL, REAL),
    "INERTIA": dict.fromkeys(FRAME[:3], REAL),
    "LOAD": {"M": REAL, "CM": "FRAME", "J": "INERTIA"},
    "CP": dict.fromkeys(("CP", "ORI1", "ORI2"), REAL),
    "APO": dict.fromkeys(("CPTP", "CDIS", "CORI", "CVEL"), REAL),
    "FDAT": {"TOOL_NO": INT, "BASE_NO": INT, "IPO_FRAME": WORD, "POINT2": CHAR},
    "LDAT": {**dict.fromkeys(("VEL", "ACC", "APO_DIST", "APO_FAC"), REAL), "ORI_TYP": WORD, "CIRC_TYP": WORD},
    "PDAT": {**dict.fromkeys(("VEL", "ACC", "APO_DIST", "GEAR_JERK"), REAL), "APO_MODE": WORD},
}


@dataclass
class Cell:
    """A place that holds a value of a type; without a value yet it is None.  ``parts``: components, or elements by
    their indices."""

    type: str
    value: object = None
    parts: dict = field(default_factory=dict)
    is_array: bool = False


def new_cell(type_: str, structures: dict, sizes: tuple[int, ...] = ()) -> Cell:
    if sizes:
        cell = Cell(type_, is_array=True)
        for index in np.ndindex(*sizes):
            cell.parts[tuple(i + 1 for i in index)] = new_cell(type_, structures)
        return cell
    if type_ in structures:
        return Cell(type_, parts={k: new_cell(of, structures) for k, of in structures[type_].items()})
    return Cell(type_)


def is_set(cell: Cell) -> bool:
    return any(map(is_set, cell.parts.values())) if cell.parts else cell.value is not None


def copied(cell: Cell) -> Cell:
    return Cell(cell.type, cell.value, {k: copied(part) for k, part in cell.parts.items()}, cell.is_array)


def restore(cell: Cell, earlier: Cell) -> None:
    """Gives the place, of which others may know, the value of its earlier copy."""
    cell.value = earlier.value
    for key, part in cell.parts.items():
        restore(part, earlier.parts[key])


def content(cell: Cell) -> object:
    """The value; of a structure a dict of what is set."""
    if cell.is_array:
        raise Stop("an array has no value")
    if cell.parts:
        return {key: content(part) for key, part in cell.parts.items() if is_set(part)}
    return cell.value


def assign(cell: Cell, value: object, left_out: object = UNDETERMINED) -> None:
    """Components that the new value does not have: unset ones stay so, others become ``left_out``."""
    if cell.is_array:
        raise Stop("an array is assigned")
    if cell.parts:
        if value is UNDETERMINED:
            value = dict.fromkeys(cell.parts, UNDETERMINED)
        if not isinstance(value, dict):
            raise Stop("a structure takes a simple value")
        if not any(key in cell.parts for key in value):
            raise Stop("nothing fits")
        for key, part in cell.parts.items():
            if key in value:
                assign(part, value[key], left_out)
            elif is_set(part):
                if part.parts:
                    raise Stop("a part of a structure is left out")
                part.value = left_out
        return
    cell.value = converted(cell.type, value)


def converted(type_: str, value: object) -> object:
    if value is None:
        raise Stop("a value that is not set")
    if value is UNDETERMINED:
        return value
    if type_ in (INT, REAL):
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise Stop("no number")
        return float(value) if type_ == REAL else rounded(value)
    wanted = bool if type_ == BOOL else str
    if not isinstance(value, wanted):
        raise Stop(f"no {type_}")
    return value


def rounded(value: float) -> int:
    return int(math.copysign(math.floor(abs(value) + 0.5), value))


def rotation(a: float, b: float, c: float) -> np.ndarray:
    """R = Rz(A) Ry(B) Rx(C) [deg]."""
    (ca, cb, cc), (sa, sb, sc) = np.cos(np.radians([a, b, c])), np.sin(np.radians([a, b, c]))
    about_z = np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
    about_y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    about_x = np.array([[1, 0, 0], [0, cc, -sc], [0, sc, cc]])
    return about_z @ about_y @ about_x


def matrix(frame: dict) -> np.ndarray:
    """(4, 4) [mm] of a frame, all of whose six components are numbers."""
    values = [frame.get(key) for key in FRAME]
    if None in values:
        raise Stop("a frame that is not set in full")
    out = np.eye(4)
    if UNDETERMINED in values:
        return out * math.nan
    out[:3, :3] = rotation(*values[3:])
    out[:3, 3] = values[:3]
    return out


def frame_of(transform: np.ndarray) -> dict:
    if np.isnan(transform).any():
        return dict.fromkeys(FRAME, UNDETERMINED)
    r = transform[:3, :3]
    b = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
    if abs(math.cos(b)) < 1e-9:
        raise Stop("angles at the pole are a choice of the controller")
    a, c = math.atan2(r[1, 0], r[0, 0]), math.atan2(r[2, 1], r[2, 2])
    return dict(zip(FRAME, [*map(float, transform[:3, 3]), *map(math.degrees, (a, b, c))], strict=True))


def product(left: dict, right: dict) -> dict:
    """left : right; status, turn and external axes are those of the right one."""
    out = frame_of(matrix(left) @ matrix(right))
    return {**{k: v for k, v in right.items() if k not in FRAME}, **out}


def inverse(frame: dict) -> dict:
    return frame_of(np.linalg.inv(matrix(frame)))
