"""Readings that no arm of this kind can make: those of another robot.

What a fit leaves shows that an effect is missing, or that the arm is another one.  The latter remains whatever is free:
of places every length, twist and zero, of deflections the compliance of every joint, bearing and of the base.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.units import MM
from postproc.identification.campaign import Campaign
from postproc.identification.least_squares import at, descended
from postproc.identification.noise import noise_of, weighting
from postproc.identification.registration import registered
from postproc.identification.sanity_checks import ENOUGH, FAR, POOR, SCATTER
from postproc.identification.unknowns import Unknown, asked_for, with_gauge
from postproc.model import StiffnessModel

GEOMETRY = ("joint_offset", "link_geometry")
ELASTIC = ("joint_compliance", "link_compliance", "base_compliance")

EXTENT = 0.02
"""Share of the extent of the measured places that may remain: a calibrated arm leaves a ten-thousandth, another one of
the same kind some twentieth."""

ROUNDS, STEPS, FAR_OUT = 3, 6, 5.0
"""Fits, each without the readings that the one before left further away than so many medians; steps of each."""


def check_arm(campaign: Campaign, model: StiffnessModel) -> None:
    """Raises Refusal IDN035 for readings that no lengths and zeros, or no stiffness, of this arm explain."""
    readings = campaign.readings
    readings = replace(readings, rotation=None, sigma_turn=None)
    if len(readings) > ENOUGH:
        readings = readings.part(np.linspace(0, len(readings) - 1, ENOUGH).round().astype(int))
    campaign = Campaign(readings, campaign.stated_tool)
    asked = asked_for(model, ELASTIC if readings.deflection else GEOMETRY)
    unknowns = with_gauge(asked.unknowns)
    rows: Bools = np.asarray(np.isfinite(readings.value).all(axis=1))
    remaining = 0.0
    for _ in range(ROUNDS):
        away = _distances(campaign, asked.model, unknowns, rows)
        remaining = float(np.median(away[rows]))
        kept = rows & (away < FAR_OUT * remaining)
        if kept.sum() == rows.sum():
            break
        rows = kept
    value = readings.value[rows]
    if remaining < SCATTER * noise_of(readings).rms:
        return
    file = str(readings.files[0]) if readings.files else ""
    if readings.deflection:
        extent = float(np.median(np.linalg.norm(value, axis=1)))
        if remaining <= POOR * extent:
            return
        message = (
            f"no stiffness of this arm explains the readings: {100 * remaining / extent:.0f} % of the deflections"
            " remain even with all its joints, bearings and the base compliant"
        )
        help = (
            "check robot, joint angles and loads; state the column SIGMA where the readings scatter so much;"
            " `compensate diagnose` looks for other effects"
        )
        raise Refusal(Finding("IDN035", message, file, help=help))
    extent = float(np.median(np.linalg.norm(value - np.median(value, axis=0), axis=1)))
    if remaining <= max(FAR, EXTENT * extent):
        return
    message = (
        f"no lengths and zeros of this arm explain the readings: {remaining / MM:.3g} mm remain of places that are"
        f" {extent / MM:.3g} mm from their middle, even with all of them free"
    )
    help = "check robot, joint angles and the order of the rows: these are readings of another robot, or of other poses"
    raise Refusal(Finding("IDN035", message, file, help=help))


def _distances(campaign: Campaign, model: StiffnessModel, unknowns: Sequence[Unknown], rows: Bools) -> Floats:
    """(R,) [m] what a fit of ``rows`` (R,) leaves of each reading; not finite where there is none."""
    point = at(campaign, model, campaign.start())
    given = registered(campaign, point.predicted, rows)
    residual = campaign.residual(point.predicted, given)
    point = replace(point, nuisances=given, residual=residual)
    some = np.where(rows[:, None], residual, np.nan)
    weights = weighting(campaign, noise_of(campaign.readings), some)
    point = descended(campaign, point, unknowns, weights, max_steps=STEPS)
    return np.asarray(np.linalg.norm(point.residual[:, :3], axis=1))
