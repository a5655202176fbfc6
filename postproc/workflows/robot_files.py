"""The robot file that comes out of measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from postproc import __version__
from postproc.identification.fit import Fit
from postproc.robot.description import Robot
from postproc.robot.provenance import GAP, Identification
from postproc.robot.writing import WrittenEffect, WrittenParameter, robot_file


def new_robot_file(
    command: str,
    robot: Robot,
    fitted: Fit,
    effects: Sequence[str],
    gap: Mapping[str, float],
    destination: Path,
) -> bytes:
    """The bytes of ``destination``: the file of ``robot`` with what ``fitted`` found, read back by its writer.

    ``effects``: as they were asked for or named; ``gap``: of it those keys count that provenance knows [mm].
    """
    campaign, today = fitted.campaign, datetime.now(UTC).date().isoformat()
    files = [path.name for path in campaign.readings.files]
    source = f"{command}: {', '.join(files)} ({len(campaign)} readings, {campaign.poses} poses), {today}"
    found = {estimate.unknown.key: estimate for estimate in fitted.estimates}
    written = []
    for index, term in enumerate(fitted.model.terms):
        parameters = []
        for parameter in term.effect.parameters:
            name, unit, stated = parameter.name, parameter.unit, term.stated.get(parameter.name)
            estimate = found.get((index, name))
            if estimate is not None:
                parameters.append(WrittenParameter(name, estimate.value, unit, estimate.ci95, source=source))
            elif stated is not None:
                parameters.append(WrittenParameter.of(name, unit, stated))
        if parameters or term.line:
            options = term.effect.described()
            written.append(WrittenEffect(term.effect.name, options, tuple(parameters), term.line))
    deviation = np.sqrt(np.diag(fitted.covariance))
    size = np.where(deviation > 0, deviation, 1.0)
    correlation = fitted.covariance / np.outer(size, size)
    np.fill_diagonal(correlation, 1.0)
    run = Identification(
        command=command,
        version=__version__,
        date=today,
        data=tuple(zip(files, campaign.readings.digests, strict=True)),
        robot_digest=robot.digest,
        effects=tuple(effects),
        poses=campaign.poses,
        readings=len(campaign),
        gap={key: value for key, value in gap.items() if key in GAP},
        names=tuple(estimate.unknown.name for estimate in fitted.estimates),
        correlation=correlation,
    )
    return robot_file(robot, written, run, destination)
