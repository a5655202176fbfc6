"""The robot file that comes out of measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from postproc import __version__
from postproc.effects.thermal_growth import ThermalGrowth
from postproc.identification.fit import Fit
from postproc.identification.unknowns import Unknown
from postproc.measurements.readings import Readings
from postproc.model import EffectInstance
from postproc.robot.description import Robot
from postproc.robot.provenance import GAP, Identification
from postproc.robot.write_robot_file import WrittenEffect, WrittenParameter, robot_file

SAME_WIDTH, SAME_PLACE = 0.99, 0.01
"""Share of the deviation of a prior that is left, and of it by which its value moves, where readings say nothing."""

CONTRADICTS = 2.0
"""Standard deviations of both together by which readings must differ from what a robot file knows better."""


def new_robot_file(
    command: str,
    robot: Robot,
    fitted: Fit,
    effects: Sequence[str],
    gap: Mapping[str, float],
    destination: Path,
) -> bytes:
    """The bytes of ``destination``: the file of ``robot`` with the values of ``fitted``, read back by its writer.

    A dimension of which the readings show no more than its prior did keeps what the file states of it.  ``effects``: as
    they were asked for or named; ``gap``: of it those keys count that provenance knows [mm].
    """
    deviation = np.sqrt(np.diag(fitted.covariance))
    campaign, today = fitted.campaign, datetime.now(UTC).date().isoformat()
    files = [path.name for path in campaign.readings.files]
    source = f"{command}: {', '.join(files)} ({len(campaign)} readings, {campaign.poses} poses), {today}"
    is_observed = [
        _observed_value(e.unknown, e.value, d) for e, d in zip(fitted.estimates, deviation, strict=True)
    ]
    estimates = [estimate for estimate, by in zip(fitted.estimates, is_observed, strict=True) if by]
    by_key = {estimate.unknown.key: estimate for estimate in estimates}
    written = []
    for index, term in enumerate(fitted.model.terms):
        parameters, own = [], source + _counted_from(term, campaign.readings)
        for parameter in term.effect.parameters:
            name, unit, stated = parameter.name, parameter.unit, term.stated.get(parameter.name)
            estimate = by_key.get((index, name))
            if estimate is not None:
                parameters.append(WrittenParameter(name, estimate.value, unit, estimate.ci95, source=own))
            elif stated is not None:
                parameters.append(WrittenParameter.of(name, unit, stated))
            elif term.values[name] != parameter.null:
                # the others hold for this value
                fixed_source = (
                    f"{own}; the readings do not show it, and the values beside it belong to this value"
                )
                parameters.append(WrittenParameter(name, term.values[name], unit, source=fixed_source))
        if parameters or term.line:
            options = effect_options(term, campaign.readings)
            written.append(WrittenEffect(term.effect.name, options, tuple(parameters), term.line))
    size = np.where(deviation > 0, deviation, 1.0)
    correlation = fitted.covariance / np.outer(size, size)
    np.fill_diagonal(correlation, 1.0)
    correlation = correlation[np.ix_(is_observed, is_observed)]
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
        names=tuple(estimate.unknown.name for estimate in estimates),
        correlation=correlation,
    )
    return robot_file(robot, written, run, destination)


def _counted_from(term: EffectInstance, readings: Readings) -> str:
    """From which temperature a growth was counted, where the entry that it continues does not state it."""
    effect = term.effect
    if not isinstance(effect, ThermalGrowth) or effect.reference is not None or not term.line:
        return ""
    options = effect_options(term, readings)
    return f"; growth counted from {options['reference']:g} degC" if "reference" in options else ""


def effect_options(term: EffectInstance, readings: Readings) -> dict[str, object]:
    """The options of an effect; a growth by temperature with that from which the readings count it."""
    options = dict(term.effect.described())
    by_temperature = isinstance(term.effect, ThermalGrowth) and options["variable"] == "temperature"
    if by_temperature and readings.calibrated_at is not None:
        options["reference"] = round(readings.calibrated_at, 3)
    return options


def _observed_value(unknown: Unknown, value: float, deviation: float) -> bool:
    """Whether readings show more of an unknown than its prior did."""
    if unknown.prior is None:
        return True
    moved, stated = abs(value - unknown.value), unknown.stated
    if stated is not None and stated.deviation and stated.deviation <= deviation:
        return bool(moved > CONTRADICTS * np.hypot(deviation, stated.deviation))
    return deviation < SAME_WIDTH * unknown.prior or moved > SAME_PLACE * unknown.prior
