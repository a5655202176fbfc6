"""Several files as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.units import DEG, MM
from postproc.measurements.copied_rows import each_once
from postproc.measurements.header import expected_joints, value_columns
from postproc.measurements.header_comments import FRAMES
from postproc.measurements.readings import ARRAYS, Readings, numbered
from postproc.measurements.write_csv import number_texts, pose_text


def joined(several: Sequence[Readings]) -> Readings:
    """The readings of several files, one after the other; their sessions and repeats stay apart.

    A session is called ``stem`` of its file, or ``stem:session``.  Refusal MEA008 where they differ in what must be
    the same.  Rows that are copies count once.
    """
    if len(several) == 1:
        return each_once(several[0])
    for one, other in combinations(several, 2):
        _check_alike(one, other)
    targets, _ = numbered([name for one in several for name in one.targets])
    places: dict[str, Floats] = {}
    for one in several:
        places |= one.places
    parts: dict[str, Any] = {name: [getattr(one, name) for one in several] for name in ARRAYS}
    parts["target"] = [
        np.array([targets.index(name) for name in one.targets] or [0])[one.target] for one in several
    ]
    parts["repeat"] = _apart(parts["repeat"], [int(one.repeat.max(initial=-1)) + 1 for one in several])
    parts["session"] = _apart(parts["session"], [len(one.sessions) for one in several])
    parts["file"] = _apart(parts["file"], [len(one.files) for one in several])
    if any(one.rotation is not None for one in several):
        parts["rotation"] = [
            np.full((len(one), 3, 3), np.nan) if one.rotation is None else one.rotation for one in several
        ]
    names, _ = numbered([name for one in several for name in one.extras])
    extras = {
        name: tuple(text for one in several for text in one.extras.get(name, ("",) * len(one)))
        for name in names
    }
    arrays: dict[str, Any] = {
        name: None if part[0] is None else np.concatenate(part) for name, part in parts.items()
    }
    whole = replace(
        several[0],
        files=tuple(path for one in several for path in one.files),
        digests=tuple(digest for one in several for digest in one.digests),
        robot=next((one.robot for one in several if one.robot), ""),
        targets=targets,
        places=places,
        sigma_turn=next((one.sigma_turn for one in several if one.sigma_turn is not None), None),
        sessions=tuple(
            f"{label}:{name}" if name else label
            for one, label in zip(several, _labels(several), strict=True)
            for name in one.sessions
        ),
        findings=tuple(finding for one in several for finding in one.findings),
        on_base=frozenset(name for one in several for name in one.on_base),
        extras=extras,
        **arrays,
    )
    return each_once(whole)


def _apart(parts: Sequence[Ints], counts: Sequence[int]) -> list[Ints]:
    """The numbers of each part after those of the parts before it, which have ``counts`` numbers; -1 stays."""
    starts = np.cumsum([0, *counts[:-1]])
    return [np.where(part < 0, -1, part + start) for part, start in zip(parts, starts, strict=True)]


def _labels(several: Sequence[Readings]) -> list[str]:
    """What the sessions of each are called by: the stem of its file, its path where stems are alike."""
    stems = [one.files[0].stem if len(one.files) == 1 else _named(one) for one in several]
    return [stem if stems.count(stem) == 1 else _named(one) for one, stem in zip(several, stems, strict=True)]


def _check_alike(one: Readings, other: Readings) -> None:
    """Refusal MEA008 unless the two can be read as one."""
    if set(one.digests) & set(other.digests):
        message = f"the file equals {_named(one)}: every reading would count twice"
        raise Refusal(Finding("MEA008", message, _named(other), help="name each file once"))
    here, there = _facts(one), _facts(other)
    for what, fact in here.items():
        if what in there and there[what] != fact:
            message = f"the files differ in {what}: {there[what]} here, but {fact} in {_named(one)}"
            raise Refusal(
                Finding("MEA008", message, _named(other), help="identify from each file on its own")
            )


def _facts(readings: Readings) -> dict[str, str]:
    """What must be the same where two files both state it."""
    one = readings
    facts = {
        "joints": expected_joints([name for name, _ in one.joints], one.joints),
        "values": ",".join(value_columns(one.deflection)[0]),
        "tool": "not stated" if one.tool is None else pose_text(one.tool),
    }
    if not one.deflection:
        facts["frame"] = FRAMES[one.in_robot_frame]
    columns = {"TARGET": one.targets or None, "T": one.time, "TEMP": one.temperature, "DIR1": one.direction}
    for name, column in columns.items():
        facts[f"column {name}"] = "none" if column is None else "given"
    if one.robot:
        facts["robot"] = one.robot.casefold()
    if one.sigma_turn is not None:
        facts["sigma_deg"] = f"{one.sigma_turn / DEG:.6g}"
    facts |= {f"mounting of target {name}": _mounting(one, name) for name in one.targets}
    return facts | {f"place of target {name}": number_texts(place / MM) for name, place in one.places.items()}


def _mounting(readings: Readings, name: str) -> str:
    return "on the base" if name in readings.on_base else "on the flange"


def _named(readings: Readings) -> str:
    return ", ".join(str(path) for path in readings.files) or "the plan"
