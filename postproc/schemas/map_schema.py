"""The schema of the result of ``map``."""

from __future__ import annotations

from postproc.schemas.parts import Schema
from postproc.schemas.result_parts import (
    ENDING,
    ROBOT,
    array,
    boolean,
    by_name,
    integer,
    quantity,
    record,
    result,
    word,
)


def map_schema() -> Schema:
    ends = array(quantity("mm", "coordinate"), "first and last")
    place = by_name(quantity("mm", "coordinate in the robot base"), "x_mm, y_mm, z_mm")
    extremes = {"min": quantity("mm", "minimum"), "max": quantity("mm", "maximum")}
    return result(
        "map",
        "deflection over the workspace",
        {
            **ROBOT,
            "force": record(
                {
                    "values": array(quantity("N, N m", "component"), "fx, fy, fz, mx, my, mz"),
                    "frame": word("frame of the force"),
                },
                "the force on the tool",
            ),
            "grid": record(
                {
                    **{f"{axis}_mm": ends for axis in "xyz"},
                    "points": array(integer("points"), "points along x, y, z"),
                    "orientation_deg": array(
                        quantity("deg", "angle"), "A, B, C of the tool in the robot base"
                    ),
                    "tool": array(
                        quantity("mm, deg", "coordinate"), "x, y, z, a, b, c of the TCP on the flange"
                    ),
                    "status": integer("KUKA Status (S); null for other arms", nullable=True),
                },
                "the cells, robot base",
            ),
            "method": word("how the deflection is computed", ("linear", "equilibrium")),
            "sign": word("reading of eq. (3) of the gravity compensator; null without one", nullable=True),
            "ignore_limits": boolean("whether cells beyond the axis limits count as reached"),
            "cells": integer("cells"),
            "unreachable": integer("cells without a value"),
            "out_of_reach": integer("cells out of reach"),
            "beyond_limits": integer("cells within reach, beyond the axis limits"),
            "deflection_mm": record(extremes, "deflection", nullable=True),
            "deflection_without_compensator_mm": record(
                extremes, "deflection without the gravity compensator", nullable=True
            ),
            "compensator_difference_mm": record(extremes, "difference of the two", nullable=True),
            "extremes_at": by_name(
                record({"min": place, "max": place}, "one quantity"), "where the extremes are, by quantity"
            ),
            **ENDING,
        },
    )
