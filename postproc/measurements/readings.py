"""Readings as arrays: what was commanded, what was hung there, what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from postproc.base.arrays import Bools, Floats, Ints, frozen
from postproc.base.findings import Finding
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM

INDICES = ("target", "repeat", "session", "file", "line")
ARRAYS = ("q", "wrench", "value", "rotation", "sigma", "time", "temperature", "direction", *INDICES)
"""What has one row a reading."""


@dataclass(frozen=True, eq=False)
class Readings:
    """R readings in the order of time.

    ``files``, ``digests``: where they were read, SHA-256 of the bytes; ``robot``: as the file names it, "" where it
    does not; ``joints``: (name, whether it slides) of the columns of ``q``; ``tool``: TCP on the flange, None where not
    stated.

    ``deflection``: ``value`` is loaded minus unloaded, robot base axes; else the absolute place, in the robot base
    (``in_robot_frame``) or in the tracker's frame.  ``targets``: names of the measured points, () where there is one
    unnamed point; ``places``: name -> (3,) [m] on the flange, of those that are stated; ``on_base``: names of those
    that are fixed to the robot base instead, places in its axes.  ``extras``: name -> text (R,) of columns that are no
    part of the format.

    q (R, n) [rad, m] as commanded; wrench (R, 6) [N, N m] at the TCP, robot base axes; value (R, 3) [m], NaN where a
    coordinate is missing; rotation (R, 3, 3) of the pose, or of the turn from unloaded to loaded, NaN where missing,
    None without; target (R,) index into ``targets``, 0 without; sigma (R,) [m] one sigma per coordinate of the row as
    given, NaN where not stated; ``sigma_turn`` [rad] the same of the angles, None where not stated.

    repeat (R,): rows that repeat one state share a number from 0, -1 elsewhere; session (R,) index into ``sessions``;
    time (R,) [s], temperature (R,) [degC], direction (R, n) sense of approach -1, 0, 1, each None where not stated.
    ``reference`` [degC], ``start`` [s]: from which growth counts; None: that of the first reading.

    file (R,) index into ``files`` and line (R,): where the row is, -1 and 0 for a row of no file.
    """

    files: tuple[Path, ...]
    digests: tuple[str, ...]
    robot: str
    joints: tuple[tuple[str, bool], ...]
    deflection: bool
    in_robot_frame: bool
    tool: Poses | None
    targets: tuple[str, ...]
    places: Mapping[str, Floats]
    q: Floats
    wrench: Floats
    value: Floats
    rotation: Floats | None
    target: Ints
    sigma: Floats
    sigma_turn: float | None
    repeat: Ints
    session: Ints
    sessions: tuple[str, ...]
    time: Floats | None
    temperature: Floats | None
    direction: Floats | None
    file: Ints
    line: Ints
    findings: tuple[Finding, ...] = ()
    on_base: frozenset[str] = frozenset()
    extras: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    reference: float | None = None
    start: float | None = None

    def __post_init__(self) -> None:
        n = len(self.joints)
        columns = {"q": (n,), "wrench": (6,), "value": (3,), "rotation": (3, 3), "direction": (n,)}
        for name in ARRAYS:
            values = getattr(self, name)
            if values is not None:
                shape = (len(self.q), *columns.get(name, ()))
                dtype = np.int64 if name in INDICES else np.float64
                object.__setattr__(self, name, frozen(values, shape, dtype))
        places = {name: frozen(place, (3,)) for name, place in self.places.items()}
        object.__setattr__(self, "places", places)

    def __len__(self) -> int:
        return len(self.q)

    def part(self, rows: Any) -> Readings:
        """Some of the readings; the names of targets, sessions and files stay, and so does what growth counts from."""
        given: dict[str, Any] = {name: getattr(self, name) for name in ARRAYS}
        given = {name: None if values is None else values[rows] for name, values in given.items()}
        kept = np.arange(len(self))[rows].tolist()
        extras = {name: tuple(texts[row] for row in kept) for name, texts in self.extras.items()}
        return replace(self, **given, extras=extras, reference=self.calibrated_at, start=self.started_at)

    @property
    def calibrated_at(self) -> float | None:
        """[degC] from which growth by temperature counts; None without temperatures."""
        return _first(self.temperature, self.reference)

    @property
    def started_at(self) -> float | None:
        """[s] from which growth by time counts; None without times."""
        return _first(self.time, self.start)

    @property
    def warmth(self) -> Floats | None:
        """(R,) [K] over the temperature from which growth counts; None without temperatures."""
        return _over(self.temperature, self.calibrated_at)

    @property
    def elapsed(self) -> Floats | None:
        """(R,) [s] since the time from which growth counts; None without times."""
        return _over(self.time, self.started_at)

    @property
    def based(self) -> Bools:
        """(R,) readings of a target on the base."""
        names = self.targets or ("",)
        return np.array([name in self.on_base for name in names])[self.target]

    def where(self, row: int) -> tuple[str, int]:
        """File and line of a reading; ("", 0) for one of no file."""
        file = int(self.file[row])
        return ("", 0) if file < 0 else (str(self.files[file]), int(self.line[row]))


def _first(values: Floats | None, stated: float | None) -> float | None:
    if values is None or not len(values):
        return None
    return float(values[0]) if stated is None else stated


def _over(values: Floats | None, zero: float | None) -> Floats | None:
    return None if values is None or zero is None else np.asarray(values - zero)


def planned(
    joints: Sequence[tuple[str, bool]],
    q: Floats,
    wrench: Floats,
    deflection: bool,
    robot: str = "",
    tool: Poses | None = None,
    targets: Sequence[str] = (),
    places: Mapping[str, Floats] | None = None,
    target: Ints | None = None,
    sigma: float = np.nan,
    direction: Floats | None = None,
) -> Readings:
    """Readings that are still to be taken, of no file: ``q`` (R, n) [rad, m] under ``wrench`` (R, 6) [N, N m];
    ``target`` (R,) index into ``targets``, ``direction`` (R, n) sense of approach, ``places``: name -> (3,) [m] on the
    flange.  Values are NaN, places will be in the tracker's frame; rows of one state repeat each other."""
    r = len(q)
    target = np.zeros(r, np.int64) if target is None else target
    return Readings(
        files=(),
        digests=(),
        robot=robot,
        joints=tuple(joints),
        deflection=deflection,
        in_robot_frame=False,
        tool=tool,
        targets=tuple(targets),
        places=places or {},
        q=q,
        wrench=wrench,
        value=np.full((r, 3), np.nan),
        rotation=None,
        target=target,
        sigma=np.full(r, sigma),
        sigma_turn=None,
        repeat=alike(q, wrench, target, direction),
        session=np.zeros(r, np.int64),
        sessions=("",),
        time=None,
        temperature=None,
        direction=direction,
        file=np.full(r, -1),
        line=np.zeros(r, np.int64),
    )


def joint_units(joints: Sequence[tuple[str, bool]]) -> Floats:
    """(n,) SI units in a unit of the file: deg of a joint that turns, mm of one that slides."""
    return np.array([MM if slides else DEG for _, slides in joints])


def alike(*columns: ArrayLike | None) -> Ints:
    """(R,) rows that are equal in all ``columns`` (R,) or (R, k), as far as these are given, share a number from 0, in
    the order of their first; -1 for a row that is like no other."""
    keys = np.column_stack([np.asarray(column, float) for column in columns if column is not None])
    if not len(keys):
        return np.empty(0, np.int64)
    order = np.lexsort(keys.T)
    starts = np.append(True, (keys[order][1:] != keys[order][:-1]).any(axis=1))
    group = np.empty(len(keys), np.int64)
    group[order] = np.cumsum(starts) - 1
    first = order[starts]  # the sort is stable
    several = np.flatnonzero(np.bincount(group) > 1)
    number = np.full(len(first), -1)
    number[several[np.argsort(first[several])]] = np.arange(len(several))
    return np.asarray(number[group])


def numbered(texts: Sequence[str]) -> tuple[tuple[str, ...], Ints]:
    """The different texts in the order of their first, and the number (R,) of each one."""
    known: dict[str, int] = {}
    numbers = [known.setdefault(text, len(known)) for text in texts]
    return tuple(known), np.array(numbers, dtype=np.int64)
