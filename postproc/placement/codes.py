"""The codes of the findings of the placement of parts."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "PLC001": Code(
            "info",
            "collisions are not checked",
            meaning="Reach, axis limits and singularities of every motion are checked, collisions are not.",
            consequence="The arm may hit the part, the table or itself at the new place.",
            action="Check the program at the new place in a simulation, and run it first in T1.",
            example="Any run of `compensate place` without collision shapes.",
        ),
        "PLC002": Code(
            "error",
            "no place in the room is feasible",
            meaning="At every place that was looked at a motion is out of reach, or too close to a limit.",
            consequence="There is no place to propose.",
            action="Increase the room, reduce --limit-margin or --singularity-margin, or turn the part or the tool.",
            example="A room of 100 mm at the edge of the reach.",
        ),
        "PLC003": Code(
            "error",
            "part cannot be moved by the cell",
            meaning="The place of the part, or a frame of its tool, is not a number of the cell file.",
            consequence="A new cell file would not move the cut.",
            action="Let the program use a numbered base of the cell, or omit the freedom that the message names.",
            example="`$BASE = {X 1250, Y 450, ...}` in the program.",
        ),
        "PLC004": Code(
            "error",
            "programs do not share a part",
            meaning="The programs are in different cells, or cut in different bases.",
            consequence="One place cannot be chosen for them.",
            action="Name programs that are cut at one place, in one cell.",
            example="Two programs with BASE_DATA[1] and BASE_DATA[2].",
        ),
        "PLC005": Code(
            "error",
            "nothing is cut",
            meaning="No motion of the programs carries a force that moves the tool.",
            consequence="Every place is as good as any other.",
            action="State a force: --force, as in the main job.",
            example="A program without FORCE comments, and no --force.",
        ),
        "PLC006": Code(
            "info",
            "present place violates a margin",
            meaning="At the present place a motion is out of reach or closer to a limit than the margin.",
            consequence="The present place would not be proposed; it is compared all the same.",
            action="See the message, and lower the margin if it is intended.",
            example="A5 at 3 deg with a margin of 5 deg.",
        ),
        "PLC007": Code(
            "info",
            "best place is at the edge of the room",
            meaning="The best place is at the edge of a freedom's range.",
            consequence="A larger room would contain a better place.",
            action="Enlarge the range if the cell permits it.",
            example="x 1649.9 of --x 850:1650.",
        ),
        "PLC008": Code(
            "info",
            "uncertainty is not complete",
            meaning="Figures that the uncertainty depends on have no interval.",
            consequence="The real uncertainty is larger, and the best place for it may be another one.",
            action="State intervals in the robot file and force_ci95 in the cell.",
            example="joint_compliance.c1 of a robot file without `ci`.",
        ),
        "PLC009": Code(
            "info",
            "candidates were dropped",
            meaning="The check of the whole program, path by path, excludes places that the search proposed.",
            consequence="They are not listed.",
            action="None is needed.",
            example="An approach from the home position that leads through a singularity.",
        ),
        "PLC010": Code(
            "info",
            "no place is better",
            meaning="The best place found is not better than the present one by one percent.",
            consequence="Moving the part is not worth it.",
            action="Enlarge the room, or leave the part where it is.",
            example="A room of 10 mm around the present place.",
        ),
        "PLC011": Code(
            "info",
            "search follows the force alone",
            meaning="With correct: absolute or touched_off the search uses a simpler error; listed figures are exact.",
            consequence="A place that is a little better may be missed.",
            action="None is needed.",
            example="`correct: touched_off`.",
        ),
        "PLC012": Code(
            "error",
            "uncertainty is not known anywhere",
            meaning="The objective is the uncertainty, and no figure that it depends on has an interval.",
            consequence="All places would be alike.",
            action="State force_ci95 in the cell, or `ci` in the robot file, or use another --objective.",
            example="--objective uncertainty with a robot file without `ci`.",
        ),
    }
)
