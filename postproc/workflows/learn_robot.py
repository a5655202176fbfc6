"""The robot file and the force factors that come out of a measured part."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from postproc import __version__
from postproc.cell import Cell
from postproc.cell.description import ForceFactor
from postproc.cell.tool_errors import OTHERS
from postproc.learning.attribution import Attribution
from postproc.learning.causes import Cause, CauseKind
from postproc.learning.measured_part import MeasuredPart
from postproc.robot.description import COVERAGE, Robot
from postproc.robot.provenance import Identification
from postproc.robot.write_robot_file import WrittenEffect, WrittenParameter, robot_file

SAME_WIDTH, SAME_PLACE = 0.97, 0.05
"""Share of the deviation before that is left, and of it by which the value moved, where a part does not show it."""


def is_observed(cause: Cause, value: float, deviation: float) -> bool:
    """Whether the part says more of a cause than was known before."""
    return deviation < SAME_WIDTH * cause.deviation or abs(value) > SAME_PLACE * cause.deviation


def learned_robot_file(
    result: Attribution,
    robot: Robot,
    parts: Sequence[MeasuredPart],
    gap: dict[str, float],
    destination: Path,
    at_this_place: bool = False,
) -> bytes | None:
    """The bytes of ``destination``: the file of ``robot`` with what was learnt of its parameters, intervals and
    correlations; None where nothing was; ``at_this_place``: with an effect that cannot be distinguished from others."""
    kinds = (CauseKind.SHARE, CauseKind.VALUE)
    numbers = [
        i
        for i, cause in enumerate(result.causes)
        if cause.kind in kinds
        and is_observed(cause, float(result.x[i]), float(result.deviations[i]))
        and (at_this_place or not result.is_unsure(cause))
    ]
    if not numbers:
        return None
    today = datetime.now(UTC).date().isoformat()
    files = ", ".join(part.file.name for part in parts)
    source = f"learn: {files} ({int(result.kept.sum())} points of a part), {today}"
    model = result.prediction.model
    found = {(result.causes[i].term, result.causes[i].parameter): i for i in numbers}
    written, names = [], []
    order: list[int] = []
    for index, term in enumerate(model.terms):
        parameters = []
        for parameter in term.effect.parameters:
            stated, number = term.stated.get(parameter.name), found.get((index, parameter.name))
            if number is not None:
                cause, x = result.causes[number], float(result.x[number])
                share = cause.kind is CauseKind.SHARE
                value = cause.value * float(np.exp(x)) if share else x
                width = COVERAGE * float(result.deviations[number]) * (value if share else 1.0)
                value = float(np.clip(value, parameter.lower, parameter.upper))
                parameters.append(
                    WrittenParameter(parameter.name, value, parameter.unit, width, source=source)
                )
                names.append(f"{model.label(index)}.{parameter.name}")
                order.append(number)
            elif stated is not None:
                parameters.append(WrittenParameter.of(parameter.name, parameter.unit, stated))
        if parameters or term.line:
            written.append(
                WrittenEffect(term.effect.name, term.effect.described(), tuple(parameters), term.line)
            )
    covariance = result.covariance[np.ix_(order, order)]
    size = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(size, size)
    np.fill_diagonal(correlation, 1.0)
    run = Identification(
        command="learn",
        version=__version__,
        date=today,
        data=tuple((part.file.name, part.digest) for part in parts),
        robot_digest=robot.digest,
        effects=tuple(dict.fromkeys(name.split(".")[0].split("#")[0] for name in names)),
        poses=len(result.kept),
        readings=int(result.kept.sum()),
        gap=gap,
        names=tuple(names),
        correlation=correlation,
    )
    return robot_file(robot, written, run, destination)


def force_factor_lines(result: Attribution, parts: Sequence[MeasuredPart], cell: Cell) -> bytes:
    """``force_factors:`` for the cell: the factor of the force of each operation, with its 95 % interval as a share;
    those of ``cell`` are in it."""
    common = next((i for i, c in enumerate(result.causes) if c.name == "force"), None)
    if common is None:
        return b""
    today = datetime.now(UTC).date().isoformat()
    lines = [
        f"# learnt from {', '.join(part.file.name for part in parts)}, {today}: add these lines to the cell file.",
        "# factor: of the stated force of an operation, ci95 of it as a share (95 %); turn: of its direction, deg,",
        "# about the axis that lifts it and the one that swings it. Another operation has the factor of `others`.",
        "force_factors:",
    ]
    others = cell.force_factors.get(OTHERS, ForceFactor(1.0))
    own = [
        (i, c)
        for i, c in enumerate(result.causes)
        if c.group == "force" and c.kind is CauseKind.FORCE and c.place
    ]
    for i, cause in own:
        stated = cell.force_factors.get(cause.place, others)
        factor = stated.factor * float(np.exp(result.x[common] + result.x[i]))
        pick = np.zeros(len(result.x))
        pick[[common, i]] = 1.0
        width = COVERAGE * float(np.sqrt(pick @ result.covariance @ pick))
        turns = [
            float(np.rad2deg(result.x[j] + stated.turn[0 if c.kind is CauseKind.TURN_1 else 1]))
            for j, c in enumerate(result.causes)
            if c.place == cause.place and c.kind in (CauseKind.TURN_1, CauseKind.TURN_2)
        ]
        words = ", ".join(f"{turn:.3f}" for turn in turns)
        lines.append(f'  "{cause.place}": {{factor: {factor:.4f}, ci95: {width:.4f}, turn: [{words}]}}')
    width = COVERAGE * float(result.deviations[common])
    lines.append(f"  others: {{factor: {others.factor * np.exp(result.x[common]):.4f}, ci95: {width:.4f}}}")
    return ("\n".join(lines) + "\n").encode()
