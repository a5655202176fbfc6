"""The schema of the result of ``plan``."""

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


def plan_schema() -> Schema:
    width = record(
        {
            "ci95": quantity("as in unit", "half width of the 95 % interval", nullable=True),
            "unit": word("SI unit"),
        },
        "one parameter",
    )
    intervals = by_name(by_name(width, "parameters by name"), "by effect")
    lost = array(
        record({"name": word("effect.parameter"), "why": word("reason")}, "one parameter"), "parameters"
    )
    ratio = quantity("1", "worst ratio of an interval to the wanted one", nullable=True)
    of_random = {
        "type": "object",
        "description": "intervals by effect, and the worst ratio",
        "properties": {"worst_ratio": ratio},
        "required": ["worst_ratio"],
        "additionalProperties": by_name(width, "parameters by name"),
    }
    return result(
        "plan",
        "poses and loads to measure",
        {
            **ROBOT,
            "effects": array(word("effect or effect.parameter"), "effects to identify"),
            "kind": word("what is measured", ("deflection", "absolute")),
            "sigma_mm": quantity("mm", "scatter per coordinate, one sigma"),
            "loads_kg": array(quantity("kg", "mass"), "loads"),
            "each_load": boolean("whether every load is measured at every pose"),
            "criterion": word("criterion of the plan"),
            "seed": integer("seed of the random poses"),
            "candidates": integer("candidate poses"),
            "poses": integer("poses of the plan"),
            "readings": integer("readings of the plan"),
            "wanted": {**intervals, "description": "wanted intervals, by effect"},
            "before": {
                **intervals,
                "type": ["object", "null"],
                "description": "intervals of the existing readings, by effect",
            },
            "intervals": by_name(intervals, "predicted intervals, by number of poses"),
            "worst_ratio": by_name(ratio, "worst ratio, by number of poses"),
            "test_rms_mm": by_name(
                quantity("mm", "predicted error at the cuts of the test program, RMS", nullable=True),
                "by number of poses",
            ),
            "random_poses": by_name(of_random, "predicted intervals of random poses, by their number"),
            "unobservable": {**lost, "description": "parameters that no pose shows"},
            "excluded": {**lost, "description": "parameters that the plan does not show"},
            "weakly_observable": {**lost, "description": "parameters with an interval wider than wanted"},
            "discriminate": array(word("effect"), "two effects to distinguish", nullable=True),
            "separation": by_name(
                array(quantity("1", "standard deviations", nullable=True), "both ways"),
                "expected separation, by number of poses",
            ),
            "fixed": array(word("effect.parameter"), "dimensions of hardware that are not fitted"),
            **ENDING,
        },
    )
