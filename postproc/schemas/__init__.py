"""JSON Schemas (draft 2020-12) of the files that people write, for their editors.

Names of keys, units, choices, effects and parameters are those of the readers' own tables.  A schema says what one key
may hold; what goes together (limits that rise, joints as many as the geometry has) only the reader can say.
"""

from __future__ import annotations

from collections.abc import Callable

from postproc.schemas.cell import cell_schema
from postproc.schemas.job import job_schema
from postproc.schemas.parts import Schema
from postproc.schemas.robot import robot_schema

SCHEMAS: dict[str, Callable[[], Schema]] = {"cell": cell_schema, "robot": robot_schema, "job": job_schema}


def schema_of(name: str) -> Schema:
    """The schema of a kind of file: one of ``SCHEMAS``."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **SCHEMAS[name]()}
