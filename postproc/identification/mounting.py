"""Reflectors that were mounted again between sessions, and a tracker that was moved within one: what readings show of
how they were taken, before it counts as an error of the robot."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.effects.joint_offset import JointOffset
from postproc.effects.link_geometry import LinkGeometry
from postproc.identification.campaign import Campaign, Nuisances
from postproc.identification.least_squares import at
from postproc.identification.registration import registered
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import unknowns_of
from postproc.measurements import Readings
from postproc.model import StiffnessModel

LEFT = 0.5
"""Share of the residual, root mean square, that a tracker or targets elsewhere must leave at most to be reported."""

AT_MOST = 0.02
"""Share of the extent of the measured places that a moved tracker may leave: what leaves more is no robot's error, and
its cause is another one."""

CLEAR = 5.0
"""Times what then remains that they must have moved by."""

FEWEST = 6
"""Poses on either side of a moment at which a tracker may have been moved."""

MOMENTS = 40
"""Moments that are tried first."""


@dataclass(frozen=True)
class Mounting:
    """readings: with targets and sessions as they were; findings: what was noticed."""

    readings: Readings
    findings: tuple[Finding, ...]


def check_mounting(campaign: Campaign, model: StiffnessModel) -> Mounting:
    """The readings with targets and stations that were moved as two, where that explains most of what a registration
    with ``model`` leaves."""
    readings = campaign.readings
    findings: list[Finding] = []
    if campaign.tracked and not campaign.posed:
        for check in (_moved_tracker, _moved_targets):
            changed, found = check(Campaign(readings, campaign.stated_tool), model)
            readings, findings = changed, [*findings, *found]
    return Mounting(readings, tuple(findings))


def _registered(campaign: Campaign, model: StiffnessModel) -> tuple[Nuisances, Floats]:
    """Tracker and targets, and the residuals (R, 3) [m] that they leave."""
    point = at(campaign, model, campaign.start())
    given = registered(campaign, point.predicted, np.ones(len(campaign), bool))
    return given, campaign.residual(point.predicted, given)[:, :3]


def _rms(values: Floats) -> float:
    return float(np.sqrt(3 * np.nanmean(values**2)))


def _moved_targets(campaign: Campaign, model: StiffnessModel) -> tuple[Readings, list[Finding]]:
    """Targets whose place is not stated, each by itself in every session."""
    readings = campaign.readings
    sessions = len(readings.sessions)
    if sessions < 2 or campaign.place_known.all():
        return readings, []
    names = readings.targets or ("target",)
    target = readings.target if readings.targets else np.zeros(len(readings), np.int64)
    renamed, fixed = {}, {*readings.places, *readings.on_base}
    for k, name in enumerate(names):
        for s, session in enumerate(readings.sessions):
            if name not in fixed and (target[readings.session == s] == k).any():
                renamed[k, s] = f"{name} ({session})"
    kept = [name for name in names if name in fixed]
    split = (*kept, *renamed.values())
    place = [
        split.index(renamed[k, s]) if (k, s) in renamed else split.index(names[k])
        for k, s in zip(target.tolist(), readings.session.tolist(), strict=True)
    ]
    changed = replace(readings, targets=split, target=np.array(place, np.int64))
    _, before = _registered(campaign, model)
    other = Campaign(changed, campaign.stated_tool)
    given, after = _registered(other, model)
    sizes = _rms(before), _rms(after)
    if sizes[1] > LEFT * sizes[0]:
        # what a wrong geometry leaves may be more than targets that moved
        sizes = _beside_geometry(campaign, model), _beside_geometry(other, model)
        if not sizes[1] <= LEFT * sizes[0]:
            return readings, []
    words = []
    for k, name in enumerate(names):
        places = [given.places[split.index(renamed[k, s])] for s in range(sessions) if (k, s) in renamed]
        if len(places) > 1:
            by = max(float(np.linalg.norm(place - places[0])) for place in places[1:])
            if by > CLEAR * sizes[1] / np.sqrt(len(after) / sessions):
                words.append(f"{name} by {by / MM:.2g} mm")
    if not words:
        return readings, []
    message = (
        f"the reflector was mounted again between sessions ({', '.join(words)}): one place leaves"
        f" {sizes[0] / MM:.3g} mm RMS, one for each session {sizes[1] / MM:.3g} mm; it counts as another"
        " reflector in each session"
    )
    return changed, [Finding("IDN032", message, *readings.where(0)[:1])]


def _beside_geometry(campaign: Campaign, model: StiffnessModel) -> float:
    """[m] root mean square of what tracker, targets and any geometry of the arm leave, to first order, for its degrees
    of freedom; infinite where it has none."""
    for effect in (LinkGeometry, JointOffset):
        if all(term.effect.name != effect.name for term in model.terms):
            model = model.with_effect(effect(model.robot.joints))
    unknowns = [
        unknown
        for k, term in enumerate(model.terms)
        if term.effect.name in (LinkGeometry.name, JointOffset.name)
        for unknown in unknowns_of(model, k)
    ]
    given, residual = _registered(campaign, model)
    there = at(campaign, model, given).predicted
    own = columns(campaign, model, unknowns, there, given)
    matrix = np.concatenate([own, campaign.nuisance_columns(there, given)], axis=2)[:, :3]
    target = residual.reshape(-1)
    known = np.isfinite(target)
    basis = _basis(np.nan_to_num(matrix.reshape(len(target), -1)[known]))
    target = target[known] - basis @ (basis.T @ target[known])
    freedom = len(target) - basis.shape[1]
    return float(np.sqrt(3 * target @ target / freedom)) if freedom > 0 else np.inf


def _moved_tracker(campaign: Campaign, model: StiffnessModel) -> tuple[Readings, list[Finding]]:
    """One moment at most, at which a tracker was moved within a session."""
    readings = campaign.readings
    given, before = _registered(campaign, model)
    if not np.isfinite(before).all():
        return readings, []
    moves = campaign.nuisance_columns(at(campaign, model, given).predicted, given)[:, :3]
    common = moves.reshape(3 * len(campaign), -1)
    basis, target = _basis(common), before.reshape(-1)
    whole = float(target @ target)
    best, moment, of = whole, -1, -1
    for s in range(len(readings.sessions)):
        own = np.flatnonzero(readings.session == s)
        changes = own[1:][np.diff(campaign.pose[own]) != 0]
        if len(changes) < 2 * FEWEST:
            continue
        inner = changes[FEWEST - 1 : len(changes) - FEWEST + 1]
        tried = np.unique(inner[np.linspace(0, len(inner) - 1, MOMENTS).round().astype(int)])
        while len(tried):
            sizes = [_after(moves, basis, target, own, row, s) for row in tried.tolist()]
            least = int(np.argmin(sizes))
            if sizes[least] < best:
                best, moment, of = sizes[least], int(tried[least]), s
            near = inner[
                np.abs(np.searchsorted(inner, tried[least]) - np.arange(len(inner)))
                <= len(inner) // MOMENTS + 1
            ]
            tried = near if len(tried) == min(MOMENTS, len(inner)) and len(near) < len(tried) else near[:0]
    if moment < 0 or best > (LEFT**2) * whole:
        return readings, []
    session = readings.session.copy()
    session[(readings.session == of) & (np.arange(len(session)) >= moment)] = len(readings.sessions)
    line = readings.where(moment)[1]
    name = readings.sessions[of] or "all"
    changed = replace(readings, session=session, sessions=(*readings.sessions, f"{name}, from line {line}"))
    other = Campaign(changed, campaign.stated_tool)
    _, after = _registered(other, model)
    extent = np.linalg.norm(readings.value - np.nanmedian(readings.value, axis=0), axis=1)
    if _rms(after) > LEFT * _rms(before) or _rms(after) > AT_MOST * np.nanmedian(extent):
        return readings, []
    message = (
        f"the tracker was moved before line {line}: one station leaves {_rms(before) / MM:.3g} mm RMS, two"
        f" {_rms(after) / MM:.3g} mm; the rows from there on count as another session"
    )
    return changed, [Finding("IDN033", message, readings.where(0)[0], line)]


def _after(moves: Floats, basis: Floats, target: Floats, own: Ints, row: int, session: int) -> float:
    """Squares that remain where the tracker of a session is elsewhere from ``row`` on."""
    later = own[own >= row]
    more = np.zeros((len(moves), 3, 6))
    more[later] = moves[later][:, :, 6 * session : 6 * session + 6]
    flat = more.reshape(len(target), 6)
    flat = _basis(flat - basis @ (basis.T @ flat))
    return float(target @ target - ((flat.T @ target) ** 2).sum())


def _basis(columns: Floats) -> Floats:
    length = np.linalg.norm(columns, axis=0)
    u, s, _ = np.linalg.svd(columns[:, length > 0] / length[length > 0], full_matrices=False)
    return np.asarray(u[:, s > 1e-8 * s.max(initial=0.0)])
