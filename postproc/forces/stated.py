"""Forces as they are stated: numbers in a named frame, not yet turned into the robot's axes."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints, frozen
from postproc.findings import nearest

FRAMES = ("base", "world", "tool", "feed")
BASE, WORLD, TOOL, FEED = range(4)
CHANNELS = ("fx", "fy", "fz", "mx", "my", "mz")

FORM = "fx,fy,fz[,mx,my,mz][@base|world|tool|feed] in N and N m, for example 0,360,560@base"
_SEPARATOR = re.compile(r"\s*,\s*|\s+")
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?\Z")
_NUMBER_LIKE = re.compile(r"[-+]?([.,]?[0-9]|nan\b|inf(inity)?\b)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Stated:
    """The wrench of each motion [N, N m] in the axes of ``frame`` (N,), an index into FRAMES.

    ``values`` (N, 6): where the motion ends; ``start`` (N, 6): where it begins (the same where it is not given), linear
    in between.  ``ci95`` (N,): half width of the 95 % interval of the force as a share of it; ``peak`` (N,) [N]: the
    largest force on the way of the motion.  NaN where not known, None where known of no motion.  ``error`` (N,) [N]:
    standard error of the force at the ends, where it was measured.
    """

    values: Floats
    frame: Ints
    start: Floats | None = None
    ci95: Floats | None = None
    peak: Floats | None = None
    error: Floats | None = None

    def __post_init__(self) -> None:
        n = len(self.values)
        object.__setattr__(self, "values", frozen(self.values, (n, 6)))
        object.__setattr__(self, "frame", frozen(self.frame, (n,), np.int64))
        for name, shape in (("start", (n, 6)), ("ci95", (n,)), ("peak", (n,)), ("error", (n,))):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(getattr(self, name), shape))

    @property
    def begin(self) -> Floats:
        """(N, 6) the wrench where each motion begins."""
        return self.values if self.start is None else self.start

    @property
    def acts(self) -> Bools:
        """(N,) the motion has a force or a moment at either end."""
        return np.any(self.values != 0, axis=1) | np.any(self.begin != 0, axis=1)


class NotAForce(ValueError):
    """The text is no force; the message says why."""


def parse_force(text: str) -> tuple[tuple[float, ...], int]:
    """The six numbers [N, N m] and the frame (index into FRAMES) of ``0,360,560@base``; raises NotAForce."""
    body, at, name = text.partition("@")
    frame = parse_frame(name) if at else BASE
    words = _SEPARATOR.split(body.strip())
    values = [_number(word) for word in words]
    if len(values) not in (3, 6):
        raise NotAForce(f"{len(values)} numbers where 3 or 6 are needed")
    return (*values, *[0.0] * (6 - len(values))), frame


def parse_frame(name: str) -> int:
    """Index into FRAMES of a name in any case; raises NotAForce."""
    word = name.strip().lower()
    if word not in FRAMES:
        raise NotAForce(f"no frame {name.strip()[:40]!r}; one of {', '.join(FRAMES)}{nearest(word, FRAMES)}")
    return FRAMES.index(word)


def is_no_force(spec: str | None) -> bool:
    """Whether ``--force`` says that there is none: it is absent, or a wrench of zeros."""
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

    A list counts whatever its length, so that a wrong one is told rather than taken for a program's name.
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
    return float(word)
