"""What of a program may be edited."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding
from postproc.toolpath.columns import MotionColumns, column, not_given


@dataclass(frozen=True)
class EditConstraints(MotionColumns):
    """What keeps the text of N motions from being edited, or motions from being inserted.

    ``refused``: row -> why that motion can not be corrected by an edit of its own (its target is not known, its text
    serves another motion too, ...).
    ``locked``: row -> why that motion can not be corrected either: a later, refused motion builds on its end point and
    would move with it.
    ``no_insert_before``: row -> why no motion can be inserted before it (a spline, a TRIGGER, a line that runs many
    times).
    ``spline_headers``: row -> line of the header of the spline block that starts with it.  Such a row is in
    ``no_insert_before``, but one straight transition move may precede that line.
    ``orientation_programmed`` (N,): the text programs the orientation and it can be written; else it is given from
    outside and only the position can be corrected.
    ``inserted_approximation`` (N,) [m]: of points that are inserted into a motion that ends exactly; NaN where it is
    not known.
    ``inserted_number``: the number that these state in the place of a distance (CNT), None where they state none.
    ``exact_stays``: what is inserted before an end point that is passed exactly is passed exactly as well (G61);
    without, it is approximated.
    ``ptp_may_change_configuration``: a point-to-point motion may lead into another configuration of the robot;
    without, no motion does.
    """

    refused: Mapping[int, Finding] = field(default_factory=dict)
    locked: Mapping[int, Finding] = field(default_factory=dict)
    no_insert_before: Mapping[int, str] = field(default_factory=dict)
    spline_headers: Mapping[int, int] = field(default_factory=dict)
    orientation_programmed: Bools = field(
        default_factory=not_given, metadata=column(dtype=np.bool_, default=True)
    )
    inserted_approximation: Floats = field(default_factory=not_given, metadata=column(default=np.nan))
    inserted_number: float | None = None
    exact_stays: bool = False
    ptp_may_change_configuration: bool = True
