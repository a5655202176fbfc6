"""From which temperature the growth of readings counts: as in a job, from the ``reference`` of the robot file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from postproc.base.findings import Finding
from postproc.effects.thermal_growth import ThermalGrowth
from postproc.measurements import Readings
from postproc.model import StiffnessModel


def counted_from(readings: Readings, model: StiffnessModel) -> Readings:
    """``readings`` whose growth counts from the temperature at which the robot of ``model`` was calibrated, without
    such a statement from their first one; by time from their first one."""
    known = stated_reference(model)
    reference = readings.calibrated_at if known is None else known
    return replace(readings, reference=reference, start=readings.started_at)


def stated_reference(model: StiffnessModel) -> float | None:
    """[degC] the temperature of the calibration that the robot file states; None where it states none."""
    effects = (term.effect for term in model.terms if isinstance(term.effect, ThermalGrowth))
    return next((effect.reference for effect in effects if effect.reference is not None), None)


def growth_findings(
    model: StiffnessModel, fitted: Readings, predicted: Sequence[Readings] = ()
) -> Iterator[Finding]:
    """What is not known of the growth in ``model``: the temperature of its calibration (IDN037), or how warm the robot
    was or how long it ran (IDN038) when it was measured: ``fitted``, or what is ``predicted`` only.  In deflections,
    which are differences, it hardly counts."""
    if fitted.deflection:
        return
    variables = set(_variables(model))
    if "temperature" in variables and fitted.temperature is not None and stated_reference(model) is None:
        yield Finding(
            "IDN037",
            "the robot file states no temperature of its calibration: thermal_growth counts from the first reading,"
            f" {fitted.calibrated_at:g} degC",
            fitted.where(0)[0],
            help="state in the robot file where its geometry is valid: options: {reference: 20} (degC)",
        )
    for readings in (fitted, *predicted):
        columns = {"temperature": ("TEMP", readings.temperature), "time": ("T", readings.time)}
        for variable in sorted(variables):
            column, values = columns[variable]
            if values is None:
                yield Finding(
                    "IDN038",
                    f"the readings have no column {column}: thermal_growth by {variable} of the robot counts as none",
                    readings.where(0)[0],
                    help=f"measure with a column {column}",
                )


def _variables(model: StiffnessModel) -> Iterator[str]:
    """By what the growth of ``model`` is that is not null."""
    for term in model.terms:
        effect = term.effect
        if isinstance(effect, ThermalGrowth) and any(
            term.values[p.name] != p.null for p in effect.parameters
        ):
            yield effect.variable
