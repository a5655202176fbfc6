"""The schema of the result of ``robots``."""

from __future__ import annotations

from postproc.robot.provenance import COMMANDS, GAP
from postproc.schemas.parts import Schema
from postproc.schemas.result_parts import (
    DATA,
    OPTIONS,
    array,
    by_name,
    integer,
    quantity,
    record,
    result,
    word,
)


def robots_schema() -> Schema:
    limits = by_name(array(quantity("as in name", "limit"), "lower, upper"), "limits of the axes, by name")
    run = record(
        {
            "command": word("command", COMMANDS),
            "version": word("version of compensate"),
            "date": word("date, UTC, as 2026-01-31"),
            "data": DATA,
            "robot_digest": word("SHA-256 of the robot file read, hexadecimal"),
            "effects": array(word("effect or effect.parameter"), "effects fitted"),
            "poses": integer("poses"),
            "readings": integer("readings"),
            "gap": record(
                {key: quantity("mm", "3-D RMS") for key in GAP}, "residuals before and after", optional=GAP
            ),
            "correlation": record(
                {
                    "parameters": array(word("effect.parameter"), "parameters"),
                    "rows": array(array(quantity("1", "correlation"), "one row"), "matrix"),
                },
                "correlation of the parameters fitted",
            ),
        },
        "one run of identify or diagnose",
    )
    mechanism = record(
        {
            "name": word("name"),
            "kind": word("kind"),
            "joint": word('joint, "" for none', nullable=True),
            "source": word("where it is documented"),
            "quantities": by_name(
                record(
                    {
                        "values": {"description": "number or list of numbers, as in unit"},
                        "unit": word("SI unit"),
                    },
                    "one dimension",
                ),
                "dimensions by name",
            ),
        },
        "one mechanism",
    )
    parameter = record(
        {
            "value": quantity("as in unit", "value"),
            "interval": quantity("as in unit", "half width of the interval", nullable=True),
            "level": quantity("1", "level of the interval; null where it is unstated", nullable=True),
            "source": word("where the value comes from"),
            "unit": word("SI unit"),
        },
        "one parameter",
    )
    robot = record(
        {
            "name": word("name"),
            "maker_name": word("name by its maker"),
            "file": word("path of the robot file"),
            "digest": word("SHA-256 of the robot file, hexadecimal"),
            "geometry": {
                "type": "object",
                "description": "kind, axes, link lengths (kuka_m: m), source",
                "additionalProperties": {"description": "as in the robot file"},
            },
            "limits_deg": limits,
            "limits_mm": limits,
            "external": word("external axis; null for none", nullable=True),
            "mechanisms": array(mechanism, "known hardware"),
            "identified": array(run, "runs that gave the file new values"),
            "effects": by_name(
                {
                    "type": "object",
                    "description": f"one effect: its parameters, and {OPTIONS}",
                    "required": ["parameters"],
                    "properties": {"parameters": by_name(parameter, "parameters by name")},
                    "additionalProperties": {"description": "an option of the effect"},
                },
                "effects by name",
            ),
        },
        "one robot",
    )
    return result(
        "robots",
        "the robots, or one of them",
        {"robots": array(robot, "robots"), "exit": integer("exit code of the command")},
    )
