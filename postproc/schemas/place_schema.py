"""The schema of the result of ``place``."""

from __future__ import annotations

from postproc.cell.stated_room import RANGES
from postproc.placement.room import FREEDOMS
from postproc.placement.score_places import OBJECTIVES
from postproc.report.placement import KEYS
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
    spread,
    word,
)


def place_schema() -> Schema:
    units = dict(zip(KEYS, (RANGES[name] for name in FREEDOMS), strict=True))
    place = record(
        {
            **{key: quantity(unit, "where the freedom is") for key, unit in units.items()},
            "score_mm": quantity("mm", "objective by the linear model, averaged as asked", nullable=True),
            "error_mm": spread("predicted error, as the main job states it"),
            "across_feed_mm": spread("its part across the feed"),
            "uncertainty_mm": quantity("mm", "what remains after a correction, 95 %", nullable=True),
            "limit_margin_deg": quantity("deg", "distance from the next axis limit", nullable=True),
            "limit_margin_line": integer("line of the motion where that is"),
            "singularity_margin_deg": quantity("deg", "distance from the next singularity", nullable=True),
            "singularity_margin_line": integer("line of the motion where that is"),
            "regret": quantity(
                "1",
                "share by which the best place for a force that is turned by 20 deg is better",
                nullable=True,
            ),
            "exact": boolean(
                "whether the figures are those of the main job; else score and regret alone are known"
            ),
        },
        "one place: origin of the base in $WORLD, turns against the present, linear track",
    )
    ends = array(quantity("mm or deg", "end"), "from, to")
    alone = record(
        {
            "value": quantity("mm or deg", "best place of the freedom", nullable=True),
            "ratio": quantity("1", "objective there over that of the present place", nullable=True),
        },
        "one freedom",
    )
    turn = record(
        {
            "program": word('program of the operation, "" for the whole path'),
            "operation": word('name of the operation, "" where the program states none'),
            "first_line": integer("first line of the operation, 0 for the whole path"),
            "last_line": integer("last line of the operation"),
            "before_mm": quantity("mm", "objective with the feed as it is", nullable=True),
            "turn_deg": quantity("deg", "best turn of the feed about the vertical"),
            "after_mm": quantity("mm", "objective with the feed turned", nullable=True),
        },
        "one operation",
    )
    spin = record(
        {
            "worth": boolean("whether turning the tool along the path is worth it"),
            "reason": word('why it is not, ""'),
            "before_mm": quantity("mm", "objective with the tool as it is, by the main job", nullable=True),
            "after_mm": quantity("mm", "objective with the tool turned, by the main job", nullable=True),
            "bound_mm": quantity("mm", "least that any turn could leave, by the linear model", nullable=True),
            "gain": quantity("1", "share of the objective that the turn takes away", nullable=True),
            "error_mm": spread("predicted error with the tool turned"),
            "turn_deg": array(quantity("deg", "turn"), "least and largest"),
            "deg_per_mm": quantity("deg/mm", "fastest turn along the path", nullable=True),
            "deg_per_s": quantity("deg/s", "fastest turn at the stated feeds", nullable=True),
            "motions": integer("motions whose orientation changes"),
        },
        "a tool that turns about its spindle along the path",
        nullable=True,
    )
    return result(
        "place",
        "where a part should lie",
        {
            "programs": array(word("file of a program"), "programs that share the part"),
            **ROBOT,
            "cell": word("cell file"),
            "base": integer("number of the base that moves"),
            "objective": word("what is small at a good place", OBJECTIVES),
            "collisions_checked": boolean("whether collisions were checked"),
            "collision_shapes": record(
                {
                    "file": word("URDF"),
                    "moving": array(word("body"), "bodies of the arm"),
                    "fixed": array(word("body"), "bodies that do not move"),
                    "ignored": array(
                        array(word("body"), "a pair"),
                        "pairs that touch before the program, and are not checked",
                    ),
                },
                "by which collisions were checked",
                nullable=True,
            ),
            "motions": integer("motions of all programs"),
            "placements": integer("placements scored"),
            "searched_places": integer("places of the paths by which the search compared"),
            "checked_places": integer("places of the paths on which listed placements were checked"),
            "room": by_name(ends, "range of each free freedom"),
            "polygon_mm": array(
                array(quantity("mm", "coordinate"), "x, y"), "corners of the room", nullable=True
            ),
            "limit_margin_deg": quantity("deg", "least distance from axis limits"),
            "singularity_margin_deg": quantity("deg", "least distance from singularities"),
            "direction_deg": quantity("deg", "interval of the forces' direction that was averaged over"),
            "present": place,
            "best": place,
            "reduction": quantity(
                "1", "share of the objective that the best place takes away", nullable=True
            ),
            "places": array(place, "places, best first"),
            "alone": by_name(alone, "what each freedom brings alone"),
            "feed_turns": array(turn, "what turning the feed at the best place brings"),
            "spin_bound_mm": quantity(
                "mm",
                "least that the objective could become with a tool that turns about its spindle along the path",
                nullable=True,
            ),
            "spin": spin,
            **ENDING,
        },
    )
