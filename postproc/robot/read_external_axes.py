"""The key ``external_axes`` of a cell file, and the external axes of a program filled in and checked against it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.base.arrays import Bools, Floats, frozen, is_shared
from postproc.base.findings import Finding, Refusal
from postproc.base.units import MM
from postproc.base.yaml_section import YamlSection
from postproc.robot.description import Robot
from postproc.robot.external_axes import (
    FIXED,
    NAMES,
    POSITIONER,
    TRACK,
    ExternalAxis,
    joint_unit,
    needed_rows,
    own_column,
)
from postproc.toolpath import COMPUTED, Toolpath

KEY = "external_axes"
KINDS = {
    TRACK: ("direction", "limits", "start", "word"),
    POSITIONER: ("axis", "point", "limits", "start", "bases", "on", "word"),
    FIXED: ("word",),
}
"""Kinds of external axes, and the keys of each."""

DIRECTIONS = {
    sign + letter: tuple((1.0 if sign == "+" else -1.0) * (i == k) for i in range(3))
    for k, letter in enumerate("xyz")
    for sign in "+-"
}
WORD = re.compile(r"[UVW]|[XYZUVWQ][1-9][0-9]?")
"""Addresses that an external axis may have in G-code."""
SLACK = 1e-6
"""[mm, deg] What a value may be beyond its limit: the rounding of its digits."""

SHOWN = (
    "external_axes: {E1: {kind: track, direction: +y, limits: [0, 4000]}}, or kind: positioner with axis, point, limits"
    " and bases, or kind: fixed where it moves neither robot nor part"
)


def read_external(top: YamlSection) -> tuple[ExternalAxis, ...]:
    """The external axes of a cell.  Raises Refusal YML... with file, line and key."""
    if KEY not in top:
        return ()
    section = top.section(KEY)
    section.only(*NAMES)
    axes = tuple(_axis(section, name) for name in NAMES if name in section)
    _check_stacks(section, {axis.name: axis for axis in axes})
    words = [axis.word for axis in axes if axis.word]
    for axis in axes:
        if words.count(axis.word) > 1:
            raise section.section(axis.name).error("YML004", f"{axis.word} is two axes of the cell", "word")
    return axes


def _axis(section: YamlSection, name: str) -> ExternalAxis:
    given, line = section.section(name), section.line_of(name)
    kind = given.text("kind", choices=tuple(KINDS))
    given.only("kind", *KINDS[kind])
    word = given.text("word").strip().upper() if "word" in given else ""
    if word and not WORD.fullmatch(word):
        raise given.error(
            "YML004", f"{word!r} is no address of a further axis", "word", "write Y2, U, Q1 ..."
        )
    if kind == FIXED:
        return ExternalAxis(name, kind, np.zeros(3), np.zeros(3), -np.inf, np.inf, line=line, word=word)
    unit = "mm" if kind == TRACK else "deg"
    lower, upper = given.numbers("limits", 2, unit=unit)
    if not lower < upper:
        raise given.error("YML004", "the lower limit must be below the upper one", "limits")
    start = given.number("start", unit=unit) if "start" in given else None
    if start is not None and not lower <= start <= upper:
        raise given.error(
            "YML004", f"{start:g} {unit} is not within the limits, {lower:g} .. {upper:g} {unit}", "start"
        )
    if kind == TRACK:
        return ExternalAxis(
            name, kind, _direction(given, "direction"), np.zeros(3), lower, upper, start, line=line, word=word
        )
    point = frozen(np.array(given.numbers("point", 3, unit="mm")) * MM, (3,))
    bases = _bases(given) if "bases" in given else ()
    on = given.text("on", choices=NAMES) if "on" in given else None
    direction = _direction(given, "axis")
    return ExternalAxis(name, kind, direction, point, lower, upper, start, bases, on, line, word)


def _direction(section: YamlSection, key: str) -> Floats:
    """Unit vector (3,): a signed letter, or three numbers of any length."""
    if section.is_list(key):
        vector = np.array(section.numbers(key, 3))
        largest = np.abs(vector).max()
        if largest == 0:
            raise section.error("YML004", "has no direction", key)
        vector = vector / largest
        return frozen(vector / np.linalg.norm(vector), (3,))
    word = section.text(key).strip().lower()
    if word not in DIRECTIONS:
        allowed = ", ".join(DIRECTIONS)
        raise section.error("YML004", f"{word!r} is not one of {allowed}, nor a list [x, y, z]", key)
    return frozen(DIRECTIONS[word], (3,))


def _bases(section: YamlSection) -> tuple[int, ...]:
    numbers = section.numbers("bases", None)
    if any(number < 1 or number != int(number) for number in numbers):
        raise section.error("YML004", "must be numbers of bases, from 1", "bases")
    return tuple(int(number) for number in numbers)


def _check_stacks(section: YamlSection, axes: Mapping[str, ExternalAxis]) -> None:
    """Every positioner carries something, no base is on two of them, and none is on itself."""
    carried: dict[int, str] = {}
    for name, axis in axes.items():
        given = section.section(name)
        for base in axis.bases:
            if carried.setdefault(base, name) != name:
                raise given.error("YML004", f"base {base} is carried by {carried[base]} already", "bases")
        if axis.on is not None and (axis.on not in axes or axes[axis.on].kind != POSITIONER):
            raise given.error("YML004", f"{axis.on} is not a positioner of this cell", "on")
        if axis.kind == POSITIONER and not axis.bases and all(other.on != name for other in axes.values()):
            raise given.error(
                "YML003",
                "it carries nothing",
                help="state the bases that rotate with it (bases: [1]), or the axis that it carries (on:)",
            )
        below, seen = axis.on, {name}
        while below is not None:
            if below in seen:
                raise given.error("YML004", "the positioners carry each other in a circle", "on")
            seen.add(below)
            below = axes[below].on if below in axes else None


def fill_external_axes(
    path: Toolpath, axes: Sequence[ExternalAxis], robot: Robot, start: Floats | None, file: Path, cell: Path
) -> Toolpath:
    """``path`` with the external axes that move robot or part where they are: as the program states them, before that
    where the cell's ``start`` puts them; NaN where that is not known, and then the motion is refused.

    start (n,) [rad, m]: of the robot's joints.  Raises Refusal: EXT001 (nothing states what an axis carries), EXT002
    (nothing states where it is), EXT003 (beyond its limits).
    """
    named = {axis.column: axis for axis in axes}
    own = own_column(robot)
    if own in named:
        message = f"{NAMES[own]} is a joint of the robot {robot.name} already"
        raise Refusal(Finding("YML004", message, str(cell), named[own].line, help="remove it from the cell"))
    unknown = [k for k in np.flatnonzero(path.moves_external).tolist() if k != own and k not in named]
    if unknown:
        raise Refusal(*(_unknown(path, k, file, cell) for k in unknown))
    needed = needed_rows(path)
    places = [
        (_Place.of_axis(axis), needed & _matters(axis, axes, path)) for axis in axes if axis.kind != FIXED
    ]
    if own is not None:
        places.append((_Place.of_joint(robot, own, start), needed))
    if not places:
        return path
    columns: dict[int, Floats] = {}
    refused = dict(path.constraints.refused)
    for place, needed in places:
        values = place.fill(path.external[:, place.column])
        place.check(values, needed, path, file, cell)
        for row in np.flatnonzero(needed & np.isinf(values)).tolist():
            refused.setdefault(row, place.not_known(values[row], path, row, file))
        columns[place.column] = np.where(np.isfinite(values), values, np.nan)
    return path.with_columns(external=_with(path.external, columns)).with_refused(refused)


def _matters(axis: ExternalAxis, axes: Sequence[ExternalAxis], path: Toolpath) -> Bools:
    """(N,) motions whose place depends on ``axis``: of a positioner those in a base that it carries, and those before
    them, from where these start."""
    if axis.kind != POSITIONER:
        return np.ones(len(path), np.bool_)
    carried, names = set(axis.bases), {axis.name}
    for _ in axes:
        above = [other for other in axes if other.on in names]
        names |= {other.name for other in above}
        carried |= {base for other in above for base in other.bases}
    on = np.array([*((frame.entry or 0) in carried for frame in path.frames), False])
    own = on[path.base]
    return np.asarray(own | np.append(own[1:], False))


def follow_external_axes(
    path: Toolpath, axes: Sequence[ExternalAxis], robot: Robot, file: Path
) -> list[Finding]:
    """What the external axes do that move robot or part, in words (EXT006); ``path``: with them filled in."""
    units = {
        axis.column: ("mm" if axis.kind == TRACK else "deg", axis.kind) for axis in axes if axis.kind != FIXED
    }
    own = own_column(robot)
    if own is not None:
        units[own] = ("mm" if joint_unit(robot) == MM else "deg", f"joint of {robot.name}")
    rows, parts = np.flatnonzero(needed_rows(path)) if units else np.empty(0, np.int64), []
    for column, (unit, what) in sorted(units.items()):
        values = path.external[rows, column]
        values = values[np.isfinite(values)]
        if not values.any():
            continue
        low, high = values.min(), values.max()
        extent = f"{low:g} {unit}" if low == high else f"{low:g} .. {high:g} {unit}"
        parts.append(f"{NAMES[column]} ({what}) {'is at' if low == high else 'moves in'} {extent}")
    return [Finding("EXT006", "; ".join(parts), str(file), int(path.line[rows[0]]))] if parts else []


def _unknown(path: Toolpath, column: int, file: Path, cell: Path) -> Finding:
    """That nothing states what an external axis carries."""
    name, values = NAMES[column], path.external[:, column]
    there = np.isfinite(values) & (values != 0) | (values == COMPUTED)
    row = int(np.argmax(there))
    target = "a value that is not a number of the program" if values[row] == COMPUTED else f"{values[row]:g}"
    known = values[np.isfinite(values)]
    moves = len(known) and (known != known[0]).any()
    message = (
        f"{name} moves to {target}{' and to other values' if moves else ''}; the cell does not state"
        f" what it carries"
    )
    return Finding("EXT001", message, str(file), int(path.line[row]), help=f"add it to {cell}: {SHOWN}")


@dataclass(frozen=True)
class _Place:
    """The place of one external axis: its column, limits and start in the unit of the text (mm or deg).  ``key``: what
    gives the start in the cell file; ``strict``: without a start nothing can be predicted, which is refused here."""

    column: int
    lower: float
    upper: float
    start: float | None
    unit: str
    key: str
    strict: bool

    @staticmethod
    def of_axis(axis: ExternalAxis) -> _Place:
        unit = "mm" if axis.kind == TRACK else "deg"
        key = f"start: below {KEY}, {axis.name}"
        return _Place(axis.column, axis.lower, axis.upper, axis.start, unit, key, True)

    @staticmethod
    def of_joint(robot: Robot, column: int, start: Floats | None) -> _Place:
        assert robot.external is not None
        unit, (lower, upper) = joint_unit(robot), robot.limits[robot.external]
        word = "deg" if robot.joints[robot.external].kind == "revolute" else "mm"
        first = None if start is None else float(start[robot.external] / unit)
        return _Place(column, float(lower / unit), float(upper / unit), first, word, "start:", False)

    @property
    def name(self) -> str:
        return NAMES[self.column]

    def fill(self, values: Floats) -> Floats:
        """(N,) with what is known before the program states the axis; the start all along where it never does."""
        start = np.nan if self.start is None else self.start
        if not (np.isfinite(values) | (values == COMPUTED)).any():
            return np.broadcast_to(start, values.shape)
        return np.where(np.isnan(values), start, values)

    def check(self, values: Floats, needed: Bools, path: Toolpath, file: Path, cell: Path) -> None:
        """Raises Refusal EXT002, EXT003."""
        lost = needed & np.isnan(values)
        if self.strict and lost.any():
            raise Refusal(
                Finding(
                    "EXT002",
                    f"the place of {self.name} is not known here: the program does not state it before this motion",
                    str(file),
                    int(path.line[np.argmax(lost)]),
                    help=f"add {self.key} in {cell}",
                )
            )
        beyond = (
            needed & np.isfinite(values) & ((values < self.lower - SLACK) | (values > self.upper + SLACK))
        )
        if beyond.any():
            row = int(np.argmax(beyond))
            raise Refusal(
                Finding(
                    "EXT003",
                    f"{self.name} is at {values[row]:g} {self.unit}, beyond its limits {self.lower:g} .."
                    f" {self.upper:g} {self.unit}"
                    + (f" ({int(beyond.sum())} motions)" if beyond.sum() > 1 else ""),
                    str(file),
                    int(path.line[row]),
                    help="check the program, or the limits that cell or robot file state",
                )
            )

    def not_known(self, value: float, path: Toolpath, row: int, file: Path) -> Finding:
        reason = "an earlier statement may move it"
        if value == COMPUTED:
            reason = "its value is computed, or it moves asynchronously"
        return Finding(
            "EXT004",
            f"the place of {self.name} is not known: {reason}",
            str(file),
            int(path.line[row]),
            help=f"state {self.name} as a number in this motion",
        )


def _with(external: Floats, columns: Mapping[int, Floats]) -> Floats:
    """(N, 6) with other columns; one row for all where they do not change."""
    if len(external) and is_shared(external) and all(map(_even, columns.values())):
        row = external[0].copy()
        row[list(columns)] = [values[0] for values in columns.values()]
        return np.broadcast_to(row, external.shape)
    filled = external.copy()
    for column, values in columns.items():
        filled[:, column] = values
    return filled


def _even(values: Floats) -> bool:
    """Whether all are the same number, or none."""
    return bool(((values == values[0]) | (np.isnan(values) & np.isnan(values[0]))).all())
