"""Whether other joint values are still in the configuration that a program states."""

from __future__ import annotations

from typing import NamedTuple

from postproc.base.arrays import Bools, Floats
from postproc.robot.description import Robot
from postproc.robot.inverse import branch_of
from postproc.robot.makers import maker_of
from postproc.toolpath import Configuration


class StatedChanges(NamedTuple):
    """Of N motions. crossed (N,): a motion to what is stated ends in another branch, or in another turn of an axis;
    other_quadrant (N,): an axis is in another quadrant than is stated, which some controls supervise."""

    crossed: Bools
    other_quadrant: Bools


def stated_changes(robot: Robot, stated: Configuration, before: Floats, after: Floats) -> StatedChanges:
    """Where joint values ``before`` and ``after`` (N, n) [rad, m] differ in what is ``stated``, of N motions."""
    maker, arm = maker_of(stated), robot.nominal
    other_branch = (maker.branches(stated) >= 0) & (branch_of(arm, before) != branch_of(arm, after))
    return StatedChanges(
        other_branch | maker.turns_change(arm, stated, before, after),
        maker.quadrants_change(stated, before, after),
    )
