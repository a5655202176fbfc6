"""Forces as they are stated: numbers in a named frame, not yet turned into the robot's axes."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, frozen
from postproc.base.findings import nearest
from postproc.process.force_profiles import ForceProfiles

LARGEST = 1e9
"""[N, N m] No force is larger."""

FRAMES = ("base", "world", "tool", "feed")
BASE, WORLD, TOOL, FEED = range(4)
CHANNELS = ("fx", "fy", "fz", "mx", "my", "mz")

FORM = "fx,fy,fz[,mx,my,mz][@base|world|tool|feed] in N and N m, for example 0,360,560@base"
_SEPARATOR = re.compile(r"\s++(?:,\s*+)?|,\s*+")
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?\Z")
_NUMBER_LIKE = re.compile(r"[-+]?([.,]?[0-9]|nan\b|inf(inity)?\b)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class StatedForces:
    """K stated wrenches [N, N m], each in the axes of its ``frame`` (K,), an index into FRAMES; and which of them each
    of N motions has, ``row`` (N,).

    ``values`` (K, 6): where the motion ends; ``start`` (K, 6): where it starts (the same where it is not given), linear
    in between.  Of the motions: ``ci95`` (N,), half width of the 95 % interval of the force as a share of it; ``peak``
    (N,) [N], the largest force along the path.  NaN where not known, None where known of no motion.  ``error`` (N,)
    [N]: standard error of the force at the ends, where it was measured.  ``radius`` (N,) [m]: of the cutter, where the
    process states it.  ``profiles``: of motions along which the force is not linear, in their frames.  ``stock``: the
    ``StockRun`` that they were computed in, if any; its type needs numba.
    """

    values: Floats
    frame: Ints
    row: Ints
    start: Floats | None = None
    ci95: Floats | None = None
    peak: Floats | None = None
    error: Floats | None = None
    radius: Floats | None = None
    profiles: ForceProfiles | None = None
    stock: object = None

    def __post_init__(self) -> None:
        k, n = len(self.values), len(self.row)
        object.__setattr__(self, "values", frozen(self.values, (k, 6)))
        object.__setattr__(self, "frame", frozen(self.frame, (k,), np.int8))
        object.__setattr__(self, "row", frozen(self.row, (n,), np.int32))
        for name, shape in (
            ("start", (k, 6)),
            ("ci95", (n,)),
            ("peak", (n,)),
            ("error", (n,)),
            ("radius", (n,)),
        ):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(getattr(self, name), shape))

    @property
    def start_values(self) -> Floats:
        """(K, 6) the wrench where a motion starts."""
        return self.values if self.start is None else self.start

    def of(self, wrenches: Floats, rows: Ints) -> Floats:
        """(M, 6) those of ``wrenches`` (K, 6) that the motions ``rows`` (M,) have."""
        return wrenches.take(self.row[rows], axis=0)

    @cached_property
    def frames(self) -> Ints:
        """(N,) the frame of each motion's wrench."""
        return self.frame[self.row]

    @property
    def acts(self) -> Bools:
        """(N,) the motion has a force or a moment on its path."""
        return self.any(range(6))

    def any(self, channels: Sequence[int]) -> Bools:
        """(N,) the motion has a part in one of the ``channels`` on its path."""
        acts = np.zeros(len(self.values), bool)
        for wrenches in (self.values, self.start_values):
            for channel in channels:
                acts |= wrenches[:, channel] != 0
        found = acts[self.row]
        if self.profiles is not None:
            inside = (self.profiles.wrench[:, list(channels)] != 0).any(axis=1)
            found[self.profiles.motion[inside]] = True
        return found

    def without(self, motions: Bools) -> StatedForces:
        """The same without a force on ``motions`` (N,)."""
        if not motions.any():
            return self
        none = np.zeros((1, 6))
        return replace(
            self,
            values=np.concatenate([self.values, none]),
            frame=np.append(self.frame, BASE),
            row=np.where(motions, len(self.values), self.row),
            start=None if self.start is None else np.concatenate([self.start, none]),
        )


class NotAForce(ValueError):
    """The text is no force; the message states why."""


def parse_force(text: str) -> tuple[tuple[float, ...], int]:
    """The six numbers [N, N m] and the frame (index into FRAMES) of ``0,360,560@base``; raises NotAForce."""
    body, at, name = text.partition("@")
    frame = parse_frame(name) if at else BASE
    words = _SEPARATOR.split(body.strip())
    if ";" in body:
        raise NotAForce("semicolons separate no numbers; use commas or blanks, and a point for decimals")
    values = [_number(word) for word in words]
    if len({"," in found for found in _SEPARATOR.findall(body.strip())}) > 1:
        raise NotAForce(
            "it mixes commas and blanks: separate the numbers by one of them, and write decimals with a point"
        )
    if len(values) not in (3, 6):
        raise NotAForce(f"{len(values)} numbers are given where 3 or 6 are needed")
    return (*values, *[0.0] * (6 - len(values))), frame


def parse_frame(name: str) -> int:
    """Index into FRAMES of a name in any case; raises NotAForce."""
    word = name.strip().lower()
    if word not in FRAMES:
        raise NotAForce(
            f"{name.strip()[:40]!r} is not a frame; use one of {', '.join(FRAMES)}{nearest(word, FRAMES)}"
        )
    return FRAMES.index(word)


def is_no_force(spec: str | None) -> bool:
    """Whether ``--force`` states that there is none: it is absent, or a wrench of zeros."""
    if not spec:
        return spec is None
    try:
        return not any(parse_force(spec)[0])
    except NotAForce:
        return False


def is_number_like(word: str) -> bool:
    """Whether a word was meant as a number, right or wrong: 12, -.5, 1e, 3N, nan."""
    return bool(_NUMBER_LIKE.match(word))


def is_force_word(word: str) -> bool:
    """Whether a word of the command line is the value of --force: a list of numbers, or a CSV or YAML file.

    A list counts whatever its length, so that a wrong one is reported rather than taken for a program's name.
    """
    if word.lower().endswith((".csv", ".yaml", ".yml")):
        return True
    parts = _SEPARATOR.split(word.partition("@")[0].strip())
    return len(parts) > 1 and all(
        _NUMBER.match(part) or part.lower().lstrip("+-") in ("nan", "inf", "") for part in parts
    )


def _number(word: str) -> float:
    if not word:
        raise NotAForce("a number is missing")
    if not _NUMBER.match(word) or not math.isfinite(float(word)):
        raise NotAForce(f"{word[:40]!r} is not a finite number")
    if abs(float(word)) > LARGEST:
        raise NotAForce(f"{word[:40]!r} exceeds {LARGEST:g} N or N m")
    return float(word)
