"""Data that cannot be what they claim: degrees that are radians, millimetres that are metres, exchanged columns.

What the numbers alone show is checked before anything is fitted.  What shows in how badly a model fits is
tried out: the one change to the data that makes the fit much better is named.  Nothing is ever changed silently.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.identification.campaign import Campaign, sense_of
from postproc.identification.changed_readings import changed_readings
from postproc.identification.least_squares import at, bounded_step, descended, reach, with_columns
from postproc.identification.noise import noise_of, weighting
from postproc.identification.registration import registered
from postproc.identification.unknowns import Unknown
from postproc.measurements import Readings
from postproc.model import StiffnessModel

TURN = 6.6
"""[deg] A little more than the radians of a full turn."""

ALIKE = 1.0 * DEG
"""Joints that all move by less are in one pose."""

STIFF, SOFT = 5e-8, 2e-4
"""[m/N] No robot has a smaller or a larger compliance."""

UNITS = (
    (9.80665, "the forces in kg"),
    (1.0 / 25.4, "the deflections in inches"),
    (1e-3, "the deflections in metres"),
    (1e3, "the deflections in micrometres, or the forces in kN"),
)
"""Ratio of deflections to those that the robot file foresees, and the unit that would make it so."""

ABOUT, ALONG = 1.4, 0.9
"""How far a ratio may be from that of a unit, and the cosine of deflections with those foreseen from which on there is
a ratio."""

GAP, SEVERAL = 50.0, 3
"""Ratio of distances from the origin between which no row is, and rows on either side: of another unit."""

FAR = 3.0 * MM
"""Absolute positions that a registration leaves further away, root mean square, are checked."""

TRIED, POOR = 0.03, 0.3
"""Shares of the deflections that a fit leaves, root mean square: from the first on changes to the data are tried out,
from the second on it is reported where none helps."""

SCATTER = 2.0
"""Times the stated scatter: what remains below that is no reason to check."""

MUCH_BETTER = 1.0 / 3.0
"""A change to the data is named if it leaves at most this share."""

ENOUGH = 300
"""Readings that show whether a fit is bad."""

LOOKED_AT = 60
"""Readings that alternatives are tried on."""

FOLLOWED = 4
"""Changes to the data that are fitted on after their first step."""

PART, SHIFT_TRIED = 12, 5000
"""Readings that show that a part of a file belongs to other rows, and how many a file may have to be checked."""

ENDS = 3, 8
"""One over the share of the rows at an end of the file that is taken to be right, the larger share first."""

LOADED = ("elastic", "gear", "sensor")
"""Families of effects that only a load shows."""


def check_numbers(readings: Readings, unknowns: Sequence[Unknown], model: StiffnessModel) -> None:
    """Raises Refusal for readings whose numbers alone cannot be right: IDN010 radians, IDN011 all poses alike, MEA002
    one place for all poses, IDN012 metres or micrometres, IDN013 no load, or always the same one where that states
    nothing."""
    file = str(readings.files[0]) if readings.files else ""
    turning = np.array([not slides for _, slides in readings.joints])
    spread = np.ptp(readings.q, axis=0)
    angles = np.abs(readings.q[:, turning])
    if (
        len(readings) > 2
        and angles.max(initial=0.0) < TURN * DEG
        and spread[turning].max(initial=0.0) > 0.3 * DEG
    ):
        raise Refusal(
            Finding(
                "IDN010",
                f"no joint angle exceeds {angles.max() / DEG:.3g} deg: are they in radians?",
                file,
                help="the columns A1..An are in degrees",
            )
        )
    if np.all(np.where(turning, spread / ALIKE, spread / (10 * MM)) < 1.0):
        raise Refusal(
            Finding(
                "IDN011",
                f"all poses are alike: no joint moves by more than {spread[turning].max(initial=0.0) / DEG:.2g} deg",
                file,
                help="one pose cannot separate the parameters; `compensate plan` proposes poses that do",
            )
        )
    value = readings.value[~readings.based]
    if not readings.deflection and len(value) > 2 and (value == value[0]).all():
        raise Refusal(
            Finding(
                "MEA002",
                f"X, Y, Z are the same in all rows ({', '.join(f'{x / MM:g}' for x in value[0])} mm), although the"
                " joints move",
                file,
                help="fill in the measured values",
            )
        )
    _check_loads(readings, unknowns, model, file)
    if readings.deflection:
        _check_size(readings, file)
    else:
        _check_units_of_rows(readings)


def _check_loads(readings: Readings, unknowns: Sequence[Unknown], model: StiffnessModel, file: str) -> None:
    families = {model.terms[u.term].effect.family for u in unknowns}
    force = readings.wrench
    if not force.any() and readings.deflection:
        raise Refusal(
            Finding(
                "IDN013",
                "the file has deflections, but no row has a load",
                file,
                help="add the columns FX, FY, FZ [N], MX, MY, MZ [N m]",
            )
        )
    names = sorted(
        {model.terms[u.term].effect.name for u in unknowns if model.terms[u.term].effect.family in LOADED}
    )
    constant = np.ptp(force, axis=0).max() <= 1e-6 * max(1.0, float(np.abs(force).max()))
    if not readings.deflection and force.any() and constant and families & set(LOADED):
        raise Refusal(
            Finding(
                "IDN013",
                f"the wrench is the same in all rows: its effect on {', '.join(names)} cannot be separated from the"
                " geometry of the robot",
                file,
                help="measure poses with and without the load, or with loads of different size",
            )
        )


def _check_units_of_rows(readings: Readings) -> None:
    """Refuses (IDN012) places of which some are far nearer to the origin than all others, and none is in between."""
    size = np.linalg.norm(np.nan_to_num(readings.value), axis=1)
    rows = np.flatnonzero((size > 0) & ~readings.based)
    rows = rows[np.argsort(size[rows], kind="stable")]
    apart = size[rows[1:]] > GAP * size[rows[:-1]]
    apart[: SEVERAL - 1] = apart[len(apart) + 1 - SEVERAL :] = False
    if not apart.any():
        return
    near, far = rows[: np.argmax(apart) + 1], rows[np.argmax(apart) + 1 :]
    file, line = readings.where(int(near.min()))
    times = float(np.median(size[far]) / np.median(size[near]))
    raise Refusal(
        Finding(
            "IDN012",
            f"the places of {len(near)} rows from line {line} on are some {times:.0f} times nearer to the origin than"
            " the others: are X, Y, Z of some rows in another unit?",
            file,
            line,
            help="X, Y, Z are in mm in all rows",
        )
    )


def _check_size(readings: Readings, file: str) -> None:
    """Compares deflections with what robots deflect by under these forces."""
    size = np.linalg.norm(np.nan_to_num(readings.value), axis=1)
    force = np.linalg.norm(readings.wrench[:, :3], axis=1)
    both = (force > 0) & np.isfinite(readings.value).all(axis=1) & ~readings.based
    if not both.any():
        return
    gives = float(np.median(size[both] / force[both]))
    if gives < STIFF:
        what, like = "stiffer than any robot", "metres"
    elif gives > SOFT:
        what, like = "softer than any robot", "micrometres"
    else:
        return
    raise Refusal(
        Finding(
            "IDN012",
            f"deflections of {np.median(size[both]) / MM:.3g} mm under {np.median(force[both]):.0f} N make the robot"
            f" {what}: are they in {like}, or the forces in another unit than N?",
            file,
            help="DX, DY, DZ are in mm, forces in N",
        )
    )


def check_fit(campaign: Campaign, model: StiffnessModel, unknowns: Sequence[Unknown]) -> tuple[Finding, ...]:
    """Raises Refusal (IDN014) for readings that fit badly, but well after one change to the data, and names it; reports
    IDN015 where they fit badly and no change helps.

    Tried are exchanged columns of joints, of measured coordinates and of forces, a wrong sign and other units.
    """
    if campaign.readings.rotation is not None:
        campaign = Campaign(replace(campaign.readings, rotation=None, sigma_turn=None), campaign.stated_tool)
    _check_rows(campaign, model)
    if len(campaign) > ENOUGH:
        some = np.linspace(0, len(campaign) - 1, ENOUGH).round().astype(int)
        campaign = Campaign(campaign.readings.part(some), campaign.stated_tool)
    remaining, signal = _remaining_share(campaign, model, unknowns)
    if campaign.readings.deflection:
        _check_scale(campaign, model)
    if not _badly(campaign, remaining, signal, TRIED):
        return ()
    some = np.unique(np.linspace(0, len(campaign) - 1, LOOKED_AT).round().astype(int))
    if len(campaign) <= LOOKED_AT:
        some = np.arange(len(campaign))
    few = campaign.readings.part(some)
    here, _ = _remaining_share(Campaign(few, campaign.stated_tool), model, unknowns)
    tried = list(changed_readings(few, campaign))
    # the linear problem shows which changes may help
    sizes = _first_steps([changed for _, changed in tried], campaign.stated_tool, model, unknowns)
    nearest = [tried[k] for k in np.argsort(sizes, kind="stable")[:FOLLOWED] if sizes[k] < here]
    best, word = np.inf, ""
    for words, changed in nearest:
        there = _remaining_share(Campaign(changed, campaign.stated_tool), model, unknowns)[0]
        if there < best:
            best, word = there, words
    file = str(campaign.readings.files[0]) if campaign.readings.files else ""
    if best < MUCH_BETTER * here:
        raise Refusal(
            Finding(
                "IDN014",
                f"the readings do not fit this robot ({here / MM:.3g} mm remain, root mean square), but they do with"
                f" {word} ({best / MM:.3g} mm)",
                file,
                help="correct the file if the change is right; it is never changed silently",
            )
        )
    remaining, _ = _remaining_share(campaign, model, unknowns, True)
    if not _badly(campaign, remaining, signal, POOR):
        return ()
    what = f"{remaining / MM:.3g} mm remain, root mean square"
    if campaign.readings.deflection:
        what = f"{100 * remaining / signal:.0f} % of the deflections remain"
    return (
        Finding(
            "IDN015",
            f"the readings do not fit well: {what}",
            file,
            help="check robot, tool and effects; `compensate robots NAME` lists what the model contains",
        ),
    )


def _check_rows(campaign: Campaign, model: StiffnessModel) -> None:
    """Refuses (IDN034) absolute readings of which those before some row, or after it, fit the rows above or below."""
    readings = campaign.readings
    if readings.deflection or len(readings) > SHIFT_TRIED or len(readings) < 4 * PART:
        return
    point = at(campaign, model, campaign.start())
    every = np.ones(len(campaign), bool)
    if not point.predicted.converged.all():
        return
    given = registered(campaign, point.predicted, every)
    if _rms(campaign.residual(point.predicted, given)[:, :3]) < FAR:
        return
    for share, start in ((share, start) for share in ENDS for start in (True, False)):
        part = every.copy()
        part[len(part) // share :] = False
        rows = part if start else part[::-1]
        if len(np.unique(readings.session[rows])) < len(readings.sessions) or rows.sum() < PART:
            continue
        given = registered(campaign, point.predicted, rows)
        expected, _ = campaign.expected(point.predicted, given)
        away = np.linalg.norm(readings.value - expected, axis=1)
        fits = away < 3 * FAR
        if not fits[rows].mean() > 0.9:
            continue
        # the longest part that does not fit, at the other end
        wrong = ~fits if start else ~fits[::-1]
        first = next((k for k in range(len(wrong)) if wrong[k:].mean() > 0.9 and wrong[k]), len(wrong))
        span = np.arange(first, len(wrong)) if start else np.arange(0, len(wrong) - first)
        if len(span) < PART:
            continue
        for step in [s for k in range(1, 1 + max(1, len(readings.targets))) for s in (k, -k)]:
            inner = span[(span + step >= 0) & (span + step < len(wrong))]
            inner = inner[np.isin(inner + step, span)]
            same = readings.target[inner + step] == readings.target[inner]
            if len(inner) < PART or not same.all():
                continue
            off = np.linalg.norm(readings.value[inner + step] - expected[inner], axis=1)
            if np.median(off) < 3 * FAR < np.median(away[inner]):
                file, line = readings.where(int(span[0] if start else span[-1]))
                poses = max(1, abs(step) // max(1, len(readings.targets)))
                count = "one pose" if poses == 1 else f"{poses} poses"
                side = "below" if step > 0 else "above"
                raise Refusal(
                    Finding(
                        "IDN034",
                        f"{'from' if start else 'up to'} line {line} on the joint angles belong to the readings"
                        f" {count} {side}"
                        if start
                        else f"up to line {line} the joint angles belong to the readings {count} {side}",
                        file,
                        line,
                        help="move the measured values there, and check where a row was skipped or is there twice",
                    )
                )


def _check_scale(campaign: Campaign, model: StiffnessModel) -> None:
    """Refuses (IDN012) deflections that are those of the robot file times the ratio of two units.  Stiffnesses that it
    states without an interval may be anything, and foresee nothing."""
    sure = [
        t for t in model.terms if t.effect.family == "elastic" and any(v.interval for v in t.stated.values())
    ]
    if not sure:
        return
    expected, _ = campaign.expected(campaign.predicted(model), campaign.start())
    both = np.isfinite(expected) & np.isfinite(campaign.readings.value)
    foreseen, measured = expected[both], campaign.readings.value[both]
    size = float(np.linalg.norm(foreseen) * np.linalg.norm(measured))
    if not foreseen @ measured > ALONG * size:
        return
    ratio = float(np.linalg.norm(measured) / np.linalg.norm(foreseen))
    for factor, unit in UNITS:
        if 1.0 / ABOUT < ratio / factor < ABOUT:
            raise Refusal(
                Finding(
                    "IDN012",
                    f"deflections are {ratio:.2g} times those that the robot file predicts: are {unit}?",
                    str(campaign.readings.files[0]) if campaign.readings.files else "",
                    help="DX, DY, DZ are in mm, forces in N; if they are, the intervals of the robot file are wrong",
                )
            )


def _badly(campaign: Campaign, remaining: float, signal: float, share: float) -> bool:
    if remaining < SCATTER * noise_of(campaign.readings).rms:
        return False
    return remaining > (share * signal if campaign.readings.deflection else FAR)


def _first_steps(
    tried: Sequence[Readings], tool: Poses | None, model: StiffnessModel, unknowns: Sequence[Unknown]
) -> list[float]:
    """[m] root mean square of what the first step of a fit foresees to remain of each of ``tried``, which differ in
    angles, loads and values; of absolute readings what a registration leaves."""
    if not tried[0].deflection:
        return [_remaining_share(Campaign(one, tool), model, unknowns)[0] for one in tried]
    # the states of all at once
    count = len(tried[0])
    came = [sense_of(one) for one in tried]
    joined = replace(
        tried[0].part(np.tile(np.arange(count), len(tried))),
        q=np.concatenate([one.q for one in tried]),
        wrench=np.concatenate([one.wrench for one in tried]),
        value=np.concatenate([one.value for one in tried]),
        direction=np.concatenate(came),
    )
    campaign = Campaign(joined, tool)
    point = with_columns(campaign, at(campaign, model, campaign.start()), unknowns)
    columns = np.nan_to_num(np.concatenate(point.required_columns, axis=2))
    limits, sizes = reach(campaign, point, unknowns), []
    for k, one in enumerate(tried):
        rows = slice(k * count, (k + 1) * count)
        residual = point.residual[rows]
        weights = weighting(campaign.seen_in(np.arange(count)), noise_of(one), residual)
        step = bounded_step(weights(columns[rows]), weights(residual), *limits, len(unknowns))
        sizes.append(_rms(residual - columns[rows] @ step))
    return sizes


def _remaining_share(
    campaign: Campaign, model: StiffnessModel, unknowns: Sequence[Unknown], fitted: bool = False
) -> tuple[float, float]:
    """[m] root mean square of what a fit leaves (of absolute readings, unless ``fitted``, a registration alone), and of
    what was measured."""
    rows = np.ones(len(campaign), bool)
    point = at(campaign, model, campaign.start())
    given = registered(campaign, point.predicted, rows)
    point = replace(point, nuisances=given, residual=campaign.residual(point.predicted, given))
    if campaign.readings.deflection or fitted:
        weights = weighting(campaign, noise_of(campaign.readings), point.residual)
        point = descended(campaign, point, unknowns, weights, max_steps=3)
    return _rms(point.residual), _rms(campaign.readings.value)


def _rms(values: Floats) -> float:
    return float(np.sqrt(3 * np.nanmean(values**2)))
