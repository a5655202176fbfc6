"""The schema of the result of ``assign``."""

from __future__ import annotations

from postproc.placement.score_places import OBJECTIVES
from postproc.schemas.parts import Schema
from postproc.schemas.result_parts import ENDING, array, boolean, integer, quantity, record, result, word


def assign_schema() -> Schema:
    chosen = record(
        {
            "program": word("file of the part's program"),
            "place": {**word("name of its place, null without one"), "type": ["string", "null"]},
        },
        "one part",
    )
    pair = record(
        {
            "program": word("file of the part's program"),
            "place": word("name of the place"),
            "objective_mm": quantity(
                "mm", "objective there, null where a motion is not feasible", nullable=True
            ),
            "lack": word('the motion and the limit that make it infeasible, ""'),
            "lack_line": integer("line of that motion, 0 without"),
        },
        "one part at one place",
    )
    return result(
        "assign",
        "which part lies where",
        {
            "programs": array(word("file of a program"), "the parts"),
            "places": array(word("name of a place"), "the places"),
            "objective": word("what is small at a good place", OBJECTIVES),
            "collisions_checked": boolean("whether collisions were checked"),
            "limit_margin_deg": quantity("deg", "least distance from axis limits"),
            "singularity_margin_deg": quantity("deg", "least distance from singularities"),
            "assignment": array(chosen, "place of each part"),
            "total_mm": quantity("mm", "sum of the objectives of the chosen pairs"),
            "largest_mm": quantity("mm", "largest of them"),
            "pairs": array(pair, "every part at every place"),
            **ENDING,
        },
    )
