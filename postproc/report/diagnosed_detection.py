"""What could be there and not be seen: detection limits of a diagnosis, in words and as a table."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.table import Table

from postproc.diagnosis.candidates import EVERY, Candidate
from postproc.diagnosis.effect_sizes import Smallest
from postproc.report.diagnosed import Diagnosed
from postproc.report.diagnosed_names import NOUNS
from postproc.report.formatting import count, listed, shown_unit, two_digits
from postproc.report.formatting import millimetres as _mm

NAMED = 3
"""So many effects are in the paragraph, all in the table."""

SHAPE = ("force_sensor", "payload", "gravity_compensator")
"""Effects whose parameters differ in kind, each with its own name in the table."""


def sentences(result: Diagnosed) -> Iterator[str]:
    """The largest displacements that these readings can not show."""
    largest: dict[str, tuple[float, str]] = {}
    for one in sorted(_each_joint(result), key=lambda one: -one.rms):
        dormant = one.candidate.dormant_parameters
        alone = [
            (u.parameter, size)
            for u, size in zip(one.candidate.shown, one.parameters, strict=True)
            if u.parameter.name not in dormant
        ]
        if len(alone) != 1 or not one.candidate.joint or not np.isfinite(alone[0][1]):
            continue
        (parameter, limit), (word, unit) = alone[0], shown_unit(alone[0][0].unit)
        noun = NOUNS[one.candidate.name].split(":")[0].format(joints=one.candidate.joint)
        moves = f" ({_mm(one.rms)} mm RMS)" if len(one.parameters) == 1 else ""
        words = f"{noun} with {parameter.name} below {two_digits(limit / unit)} {word}".rstrip() + moves
        largest.setdefault(one.candidate.name, (one.rms, words))
    if not largest:
        return
    entries = [words for _, words in largest.values()][:NAMED]
    yield (
        f"What is smaller can be there without being seen in {count(result.final.campaign.poses, 'pose')}: for"
        f" example {listed(entries)}; the table lists the limits of all effects."
    )


def detection_table(result: Diagnosed, _verbose: bool) -> Table:
    """One row an effect and unit, one column a joint: the size from which on it would have been found, of the parameter
    that shows least; none but with the verdict that nothing is missing."""
    table = Table(box=None, pad_edge=False)
    several = _each_joint(result)
    several += [
        Smallest(one, np.inf, np.inf, (np.inf,) * len(one.shown))
        for one in result.diagnosis.search.untestable
        if one.name in {other.candidate.name for other in several} and _is_single(one)
    ]
    joints = [joint.name for joint in result.final.model.robot.joints]
    joints = [name for name in joints if any(one.candidate.joint == name for one in several)]
    whole = any(not one.candidate.joint for one in several)
    table.add_column("seen from this size on (none: at no size)")
    for name in (*joints, *(["arm"] if whole else [])):
        table.add_column(name, justify="right")
    table.add_column("unit")
    rows: dict[tuple[str, str], dict[str, float]] = {}
    for one in several:
        for unknown, size in zip(one.candidate.shown, one.parameters, strict=True):
            parameter = unknown.parameter
            if parameter.name in one.candidate.dormant_parameters:
                continue
            label = one.candidate.label.removesuffix(f" on {one.candidate.joint}")
            if one.candidate.name in SHAPE:
                label += f", {parameter.name}"
            cells = rows.setdefault((label, parameter.unit), {})
            place = one.candidate.joint or "arm"
            cells[place] = max(cells.get(place, 0.0), size)
    for (label, unit), cells in rows.items():
        word, size = shown_unit(unit)
        shown = [_cell(cells.get(name), size) for name in (*joints, *(["arm"] if whole else []))]
        table.add_row(label, *shown, word)
    return table


def _cell(limit: float | None, size: float) -> str:
    if limit is None:
        return ""
    return two_digits(limit / size) if np.isfinite(limit) else "none"


def _each_joint(result: Diagnosed) -> list[Smallest]:
    """The limits of single joints, and of effects that have none."""
    return [one for one in result.detection_limits if _is_single(one.candidate)]


def _is_single(candidate: Candidate) -> bool:
    return candidate.joint != EVERY and not candidate.up_to_joint
