"""Where the tracker and the targets are, before anything else is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses
from postproc.identification.campaign import Campaign, Nuisances, PredictedReadings

MAX_STEPS = 60
SAMPLE = 300
"""Readings used while the tracker's turn is searched for."""

FOLLOWED = 4
"""Starts that are followed after their first steps."""


def registered(campaign: Campaign, predicted: PredictedReadings, rows: Bools) -> Nuisances:
    """Nuisances with the least squares of ``rows`` (R,), every session by itself, the largest first.

    The turn of a tracker may be any, and the place of a target on the flange enters together with it: Gauss-Newton
    from the 24 turns of a cube, the best of which are followed, and the best of these refined.
    """
    given = campaign.start()
    session = campaign.readings.session
    usable = rows & np.isfinite(campaign.readings.value).all(axis=1) & predicted.converged[campaign.at]
    if campaign.tracked:
        for k in np.argsort(-np.bincount(session[usable], minlength=len(campaign.readings.sessions))):
            own = np.flatnonzero(usable & (session == k)).astype(np.int64)
            if len(own):
                given = _session(campaign, predicted, given, int(k), own)
        if len(campaign.readings.sessions) > 1 and not campaign.place_known.all():
            # each session has put the targets where it wants them
            rows_of_all = np.flatnonzero(usable).astype(np.int64)
            given = _descended(campaign, predicted, given, rows_of_all, MAX_STEPS)[0]
    if campaign.posed and campaign.still is None:
        given = _turned_targets(campaign, predicted, given, usable)
    return given


def _session(
    campaign: Campaign, predicted: PredictedReadings, nuisances: Nuisances, k: int, own: Ints
) -> Nuisances:
    some = own[np.linspace(0, len(own) - 1, min(len(own), SAMPLE)).round().astype(int)]
    few, all_of_few = campaign.seen_in(some), np.arange(len(some))
    tries = []
    for turn in _cube_turns():
        rotation = nuisances.frames.rotation.copy()
        rotation[k] = turn
        start = replace(nuisances, frames=Poses(rotation, nuisances.frames.position))
        tries.append(_descended(few, predicted, start, all_of_few, 3))
    tries = [
        _descended(few, predicted, tried, all_of_few, 12) for tried, _ in sorted(tries, key=_size)[:FOLLOWED]
    ]
    return _descended(campaign, predicted, min(tries, key=_size)[0], own, MAX_STEPS)[0]


def _size(tried: tuple[Nuisances, float]) -> float:
    return tried[1]


def _descended(
    campaign: Campaign, predicted: PredictedReadings, nuisances: Nuisances, rows: Ints, steps: int
) -> tuple[Nuisances, float]:
    """Gauss-Newton on positions: the nuisances, and the mean square that remains [m2]."""
    last, before = np.inf, nuisances
    if len(rows) < len(campaign):
        campaign = campaign.seen_in(rows)
    for _ in range(steps):
        residual = campaign.residual(predicted, nuisances)[:, :3]
        size = float(np.mean(residual**2))
        if not size < last * (1 - 1e-9):
            return before, last
        last, before = size, nuisances
        columns = campaign.nuisance_columns(predicted, nuisances)[:, :3]
        if campaign.scaled:  # of an arm that is not calibrated the scale says nothing yet
            columns[:, :, -1] = 0.0
        matrix = columns.reshape(residual.size, -1)
        step = np.linalg.lstsq(matrix.T @ matrix, matrix.T @ residual.reshape(-1), rcond=1e-13)[0]
        nuisances = campaign.moved(nuisances, np.asarray(step, float))
    return nuisances, last


def _turned_targets(
    campaign: Campaign, predicted: PredictedReadings, nuisances: Nuisances, usable: Bools
) -> Nuisances:
    """The axes of targets whose turn is not stated: the mean over all readings."""
    readings, turns = campaign.readings, nuisances.turns.copy()
    assert readings.rotation is not None
    rotation = campaign.turned(predicted, campaign.at)
    if campaign.tracked:
        rotation = nuisances.frames.rotation[readings.session] @ rotation
    for k in np.flatnonzero(~campaign.turn_known):
        own = usable & (readings.target == k) & np.isfinite(readings.rotation).all(axis=(1, 2))
        if own.any():
            total = (np.swapaxes(rotation[own], 1, 2) @ readings.rotation[own]).sum(axis=0)
            u, _, v = np.linalg.svd(total)
            turns[k] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
    return replace(nuisances, turns=turns)


def _cube_turns() -> list[Floats]:
    """The 24 rotations of a cube."""
    turns = []
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        for sign in np.ndindex(2, 2):
            turn = np.eye(3)[list(order)] * (1.0 - 2.0 * np.array([*sign, 0]))[:, None]
            turn[2] *= np.linalg.det(turn)
            turns.append(turn)
    return turns
