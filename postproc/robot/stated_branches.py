"""The branch of the inverse kinematics that a program states, in the words of its robots' maker."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import DEG
from postproc.robot.description import Robot
from postproc.robot.geometries import SerialArm
from postproc.robot.inverse import status_of, turn_of
from postproc.toolpath import Configuration, unpack_quadrants

SIGN_MARGIN = 0.01 * DEG
"""An axis nearer to a border than this is on both sides of it: taught values are rounded."""

TURNED = [-6, -3, -1]
"""Of the last six axes those whose turns makers state: 1, 4 and 6."""


def stated_branches(configuration: Configuration) -> Ints:
    """(N,) the branch, bits as in KUKA's status S: wrist behind axis 1, elbow, A5 < 0; -1 where none is stated.

    ABB's cfx is 4 (wrist centre behind axis 1) + 2 (behind the lower arm) + 1 (axis 5 negative): ABB, Technical
    reference manual, RAPID Instructions, Functions and Data types, confdata (recalled, and as posts for it write it).
    The elbow bit of S is set with the wrist centre in front of the lower arm.

    Fanuc's flags are 4 for B (bottom: wrist centre behind axis 1), 2 for D (elbow down) and 1 for F (flip: axis 5
    positive as Fanuc counts it, which is negative as KUKA does); B is not read here: FANUC, operator's manual of
    R-30iB, configuration (recalled; N U T with J5 = -90 is the tool pointing down from a level forearm).
    """
    status, cfx, nut = configuration["status"], configuration["cfx"], configuration["nut"]
    if (nut >= 0).any():
        known = (nut >= 0) & (nut & 4 == 0)
        return np.asarray(np.where(known, (~(nut >> 1) & 1) << 1 | (nut & 1) << 2, status))
    if not (cfx >= 0).any():
        return status
    branch = (cfx >> 2 & 1) | (~(cfx >> 1) & 1) << 1 | (cfx & 1) << 2
    return np.asarray(np.where(status >= 0, status, np.where(cfx >= 0, branch, -1)))


def sides(robot: Robot, q: Floats) -> tuple[Ints, Ints]:
    """S (N,) and T (N,) of joint values ``q`` (N, n) [rad, m], as a program of KUKA would state them; both 0 for an arm
    of another geometry."""
    if isinstance(robot.nominal, SerialArm):
        return np.zeros(len(q), np.int64), np.zeros(len(q), np.int64)
    return status_of(robot.nominal, q), turn_of(q[:, -6:])


def changed_sides(robot: Robot, stated: Configuration, before: Floats, after: Floats) -> dict[str, Bools]:
    """Name of what is stated -> (N,) where joint values ``before`` and ``after`` (N, n) [rad, m] differ in it.

    ``status``: S, or what cfx or the flags of Fanuc say.  ``turn``: the sign of an axis.  ``quadrants``: axis 1, 4 or 6
    is in another quarter of a turn (cf1, cf4, cf6 of ABB: 0 is 0 to 90 deg, -1 is -90 to 0).  ``revolutions``: it is in
    another turn (Fanuc: 0 is -180 to 179 deg).
    """
    one, other = sides(robot, before), sides(robot, after)

    def other_part(start: float, size: float) -> Bools:
        parts = [(q[:, TURNED] - start) // size for q in (before, after)]
        return np.asarray((parts[0] != parts[1]).any(axis=1))

    return {
        "status": (stated_branches(stated) >= 0) & (one[0] != other[0]),
        "turn": (stated["turn"] >= 0) & (one[1] != other[1]),
        "quadrants": (stated["quadrants"] >= 0) & other_part(0.0, 0.5 * np.pi),
        "revolutions": (stated["revolutions"] >= 0) & other_part(-np.pi, 2 * np.pi),
    }


def turns_match(stated: Configuration, q: Floats) -> Bools:
    """(N,) the stated T and quadrants are those of joint values ``q`` (N, n) [rad, m], or are not stated; an axis
    within ``SIGN_MARGIN`` of a border is on both sides of it.  Of quadrants whole turns do not count."""
    arm, known = q[:, -6:], np.isfinite(q[:, -6:])
    bits = (stated["turn"][:, None] >> np.arange(6)) & 1 == 1
    wrong = (stated["turn"] >= 0)[:, None] & (bits != (arm < 0)) & (np.abs(arm) > SIGN_MARGIN) & known
    turned, quarter = arm[:, TURNED], 0.5 * np.pi
    away = np.abs(turned - quarter * np.round(turned / quarter)) > SIGN_MARGIN
    supervised = (stated["quadrants"] >= 0) & (stated["cfx"] >= 0)
    other = np.floor(np.nan_to_num(turned) / quarter).astype(np.int64) - unpack_quadrants(stated["quadrants"])
    elsewhere = supervised[:, None] & (other % 4 != 0) & away & known[:, TURNED]
    return np.asarray(~wrong.any(axis=1) & ~elsewhere.any(axis=1))


def mismatch_words(stated: Configuration) -> str:
    """What is reported where a corrected pose needs another full turn of an axis than is stated."""
    if "revolutions" in stated.numbers:
        return "the target has a CONFIG mismatch: the corrected pose is in another turn of J1, J4 or J6"
    return "the target has a Status/Turn mismatch: the corrected pose is on the other side of an axis angle"
