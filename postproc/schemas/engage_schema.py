"""The schema of the result of ``engage``."""

from __future__ import annotations

from postproc.report.engaged import STATES
from postproc.schemas.parts import Schema
from postproc.schemas.result_parts import ENDING, array, by_name, integer, quantity, record, result, word


def engage_schema() -> Schema:
    force = {
        "max_n": quantity(
            "N", "largest mean over a turn; null where the force of a cut is not known", nullable=True
        ),
        "mean_n": quantity("N", "mean over the path of all motions that cut", nullable=True),
        "ci95": quantity("1", "half width of its 95 % interval as a share of it", nullable=True),
    }
    tool = {
        "motions": integer("motions that cut"),
        "removal_mm3": quantity("mm3", "removed volume"),
        "ap_max_mm": quantity("mm", "largest axial depth"),
        "ae_max_mm": quantity("mm", "largest width across the feed"),
        "force_max_n": quantity("N", "largest mean force over a turn", nullable=True),
    }
    collision = {
        "line": integer("line of the motion"),
        "part": word("what collides", ("cutter", "shank", "holder")),
    }
    return result(
        "engage",
        "what a program cuts of its stock",
        {
            "program": word("file of the program"),
            "dialect": word("language of the program"),
            "process": word("process file"),
            "stock": word("kind of the blank", ("box", "cylinder", "stl", "from")),
            "motions": integer("motions of the program"),
            "states": record({state: integer(f"motions: {state}") for state in STATES}, "motions by state"),
            "force": record(force, "size of the force on the tool"),
            "removal_mm3": quantity("mm3", "removed volume"),
            "tools": by_name(record(tool, "one tool"), "what each tool cuts, by its number"),
            "collisions": array(record(collision, "one motion"), "motions that collide"),
            **ENDING,
        },
    )
