"""JSON Schemas (draft 2020-12) of the files that people write, for their editors, and of the results, for scripts.

Of files: names of keys, units, choices, effects and parameters are those of the readers' own tables.  A schema states
what one key may hold; what goes together (limits that rise, joints as many as the geometry has) only the reader checks.
"""

from __future__ import annotations

from collections.abc import Callable

from postproc.schemas.assign_schema import assign_schema
from postproc.schemas.cell_schema import cell_schema
from postproc.schemas.diagnose_schema import diagnose_schema
from postproc.schemas.engage_schema import engage_schema
from postproc.schemas.identify_schema import identify_schema
from postproc.schemas.job_schema import job_schema
from postproc.schemas.learn_schema import learn_schema
from postproc.schemas.map_schema import map_schema
from postproc.schemas.parts import Schema
from postproc.schemas.place_schema import place_schema
from postproc.schemas.plan_schema import plan_schema
from postproc.schemas.program_results import (
    batch_schema,
    check_schema,
    corrections_schema,
    predict_schema,
    report_schema,
    verify_schema,
    watch_schema,
)
from postproc.schemas.robot_schema import robot_schema
from postproc.schemas.robots_schema import robots_schema

SCHEMAS: dict[str, Callable[[], Schema]] = {"cell": cell_schema, "robot": robot_schema, "job": job_schema}
"""Of the files that people write."""

RESULT_SCHEMAS: dict[str, Callable[[], Schema]] = {
    "report": report_schema,
    "predict": predict_schema,
    "check": check_schema,
    "verify": verify_schema,
    "map": map_schema,
    "place": place_schema,
    "assign": assign_schema,
    "identify": identify_schema,
    "engage": engage_schema,
    "plan": plan_schema,
    "diagnose": diagnose_schema,
    "learn": learn_schema,
    "batch": batch_schema,
    "watch": watch_schema,
    "robots": robots_schema,
    "corrections": corrections_schema,
}
"""Of the results: JSON by command (report: of the main job), and the table of corrections."""


def schema_of(name: str) -> Schema:
    """The schema of a kind of file or result: one of ``SCHEMAS`` or ``RESULT_SCHEMAS``."""
    schema = {**SCHEMAS, **RESULT_SCHEMAS}[name]()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
