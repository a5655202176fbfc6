"""Where the values of a robot file come from that the tool wrote itself: the list ``identified:``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import date

import numpy as np

from postproc.base.arrays import Floats, frozen
from postproc.base.dataclass import dataclass
from postproc.base.yaml_section import YamlSection

COMMANDS = ("identify", "diagnose", "learn")
GAP = ("before_rms_mm", "after_rms_mm", "noise_mm", "held_out_before_rms_mm", "held_out_after_rms_mm")
FORMER_GAP = {key.replace("held_out", "heldout"): key for key in GAP if "held_out" in key}
"""Former name of a key, still read -> the key."""

ROUNDING = 1e-6
"""Correlations are written with six decimals: k of them may leave an eigenvalue this far, times k, below zero."""


@dataclass(frozen=True)
class Identification:
    """One run that gave a robot file new values: an entry of ``identified:``.

    date: ISO, UTC; data: (name of the file, SHA-256) of each; robot_digest: of the robot file it started with; effects
    that it fitted, to how many poses and readings; gap: some of ``GAP`` [mm]; names (k,) of the parameters fitted, as
    effect.parameter or effect#2.parameter, and their correlation (k, k).
    """

    command: str
    version: str
    date: str
    data: tuple[tuple[str, str], ...]
    robot_digest: str
    effects: tuple[str, ...]
    poses: int
    readings: int
    gap: Mapping[str, float]
    names: tuple[str, ...]
    correlation: Floats


def read_identification(section: YamlSection) -> Identification:
    """One entry of ``identified:``, checked.  Raises Refusal with the line."""
    section.only(
        "command",
        "version",
        "date",
        "data",
        "robot_sha256",
        "effects",
        "poses",
        "readings",
        "gap",
        "correlation",
    )
    data = section.sections("data")
    for one in data:
        one.only("file", "sha256")
    gap = section.section("gap", {})
    gap.only(*GAP, *(former for former in FORMER_GAP if former in gap))
    names, correlation = _triangle(section.section("correlation", {}))
    return Identification(
        command=section.text("command", choices=COMMANDS),
        version=section.text("version"),
        date=_date(section),
        data=tuple((one.text("file"), _digest(one, "sha256")) for one in data),
        robot_digest=_digest(section, "robot_sha256"),
        effects=tuple(section.texts("effects")),
        poses=_count(section, "poses"),
        readings=_count(section, "readings"),
        gap=_gap(gap),
        names=names,
        correlation=correlation,
    )


def _gap(section: YamlSection) -> dict[str, float]:
    values = {}
    for former, key in [*((key, key) for key in GAP), *FORMER_GAP.items()]:
        if former not in section:
            continue
        if key in values:
            raise section.error("YML004", f"is the former name of {key!r}, which is given too", former)
        values[key] = section.number(former, low=0.0, unit="mm")
    return {key: values[key] for key in GAP if key in values}


def correlations(identified: Sequence[Identification]) -> tuple[tuple[str, ...], Floats]:
    """Names (k,) and correlation (k, k) of all parameters fitted.  What a later run refitted counts as it states;
    parameters of different runs are independent."""
    names: list[str] = []
    blocks: list[Floats] = []
    for run in reversed(identified):
        own = [i for i, name in enumerate(run.names) if name not in names]
        names += [run.names[i] for i in own]
        blocks.append(run.correlation[np.ix_(own, own)])
    matrix, at = np.zeros((len(names), len(names))), 0
    for block in blocks:
        rows = slice(at, at + len(block))
        matrix[rows, rows] = block
        at = rows.stop
    return tuple(names), frozen(matrix)


def _triangle(section: YamlSection) -> tuple[tuple[str, ...], Floats]:
    """The rows of a lower triangle, each under its parameter's name: correlations with those above, and 1."""
    names = tuple(section)
    matrix = np.eye(len(names))
    for i, name in enumerate(names):
        row = section.numbers(name, i + 1)
        if row[-1] != 1.0 or max(np.abs(row)) > 1.0:
            raise section.error(
                "YML004", "correlations must be within -1 .. 1, and a row must end with 1", name
            )
        matrix[i, : i + 1] = matrix[: i + 1, i] = row
    values, vectors = np.linalg.eigh(matrix)
    if values.min(initial=0.0) < -ROUNDING * len(names):
        raise section.error(
            "YML004", f"the matrix is not a correlation matrix (an eigenvalue is {values[0]:.2g})"
        )
    if values.min(initial=0.0) < 0:
        roots = vectors * np.sqrt(np.maximum(values, 0.0))
        roots /= np.linalg.norm(roots, axis=1, keepdims=True)
        matrix = roots @ roots.T
    return names, frozen(matrix)


def _date(section: YamlSection) -> str:
    text = section.text("date")
    try:
        valid = date.fromisoformat(text).isoformat() == text
    except ValueError:
        valid = False
    if not valid:
        raise section.error("YML004", f"{text!r} is not a date as 2026-01-31", "date")
    return text


def _digest(section: YamlSection, key: str) -> str:
    text = section.text(key)
    if not re.fullmatch("[0-9a-f]{64}", text):
        raise section.error("YML004", "is not a SHA-256: 64 digits 0-9, a-f", key)
    return text


def _count(section: YamlSection, key: str) -> int:
    number = section.number(key, low=0.0)
    if number != int(number):
        raise section.error("YML004", f"{number:g} is not a whole number", key)
    return int(number)
