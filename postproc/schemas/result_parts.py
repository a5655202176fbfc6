"""The parts of the schema of a result: every key with what it means, every number with its unit (``unit``; "1": none).

A consumer may find more keys than a schema of his version knows: objects are open.  All keys that are not optional are
always there; what is not known is null.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from postproc.base.findings import SEVERITIES
from postproc.report.result_keys import FORMER_KEYS, SCHEMA_VERSION
from postproc.schemas.parts import Schema, former_name_of


def quantity(unit: str, about: str, nullable: bool = False) -> Schema:
    """A number in ``unit``."""
    return {"type": _or_null("number", nullable), "unit": unit, "description": about}


def integer(about: str, nullable: bool = False) -> Schema:
    """A count, or a line."""
    return {"type": _or_null("integer", nullable), "unit": "1", "description": about}


def word(about: str, choices: Sequence[str] = (), nullable: bool = False) -> Schema:
    allowed = [*choices, None] if nullable else list(choices)
    return {
        "type": _or_null("string", nullable),
        "description": about,
        **({"enum": allowed} if choices else {}),
    }


def boolean(about: str) -> Schema:
    return {"type": "boolean", "description": about}


def array(items: Schema, about: str, nullable: bool = False) -> Schema:
    return {"type": _or_null("array", nullable), "items": items, "description": about}


def record(
    properties: Mapping[str, Schema], about: str, nullable: bool = False, optional: Sequence[str] = ()
) -> Schema:
    """An object with known keys."""
    return {
        "type": _or_null("object", nullable),
        "properties": dict(properties),
        "required": [key for key in properties if key not in optional],
        "description": about,
    }


def by_name(values: Schema, about: str, nullable: bool = False) -> Schema:
    """An object whose keys are names: of effects, parameters, files."""
    return {"type": _or_null("object", nullable), "additionalProperties": values, "description": about}


def _or_null(kind: str, nullable: bool) -> str | list[str]:
    return [kind, "null"] if nullable else kind


FINDINGS = array(
    record(
        {
            "code": word("code of the finding; `compensate check --explain CODE` explains it"),
            "severity": word("how serious it is", SEVERITIES),
            "file": word('file that it is about, "" for none'),
            "line": integer("line in the file, from 1; 0 where it is about no line"),
            "column": integer("column in the line, from 1; 0 where it is about no column"),
            "message": word("what is wrong"),
            "help": word("what to do"),
        },
        "one finding",
    ),
    "findings, by file and line",
)
OUTPUTS = array(word("path"), "files written")
ENDING = {"findings": FINDINGS, "outputs": OUTPUTS, "exit": integer("exit code of the command")}
DATA = array(
    record({"file": word("name"), "sha256": word("SHA-256 of the file, hexadecimal")}, "one file"),
    "files of measurements read",
)
ROBOT = {"robot": word("name of the robot"), "robot_digest": word("SHA-256 of the robot file, hexadecimal")}
OPTIONS = "options of the effect"


def spread(about: str, nullable: bool = False, **more: Schema) -> Schema:
    """Maximum, root mean square and 95th percentile of a length."""
    return record(
        {
            "max": quantity("mm", "maximum", nullable=True),
            "rms": quantity("mm", "root mean square", nullable=True),
            "p95": quantity("mm", "95th percentile", nullable=True),
            **more,
        },
        about,
        nullable,
    )


def result(
    command: str, about: str, properties: Mapping[str, Schema], optional: Sequence[str] = ()
) -> Schema:
    """The schema of what a command gives with ``--json``: its result, or the rest of it where it failed."""
    envelope = {
        "schema_version": {**integer("version of the keys"), "const": SCHEMA_VERSION},
        "version": word("version of compensate"),
        "command": {"const": command, "description": "command that gives this result"},
    }
    whole = record({**envelope, **properties}, about, optional=optional)
    for place, names in FORMER_KEYS.get(command, {}).items():
        for holder in _holders(whole, place.split(".") if place else []):
            for former, present in names.items():
                _add_former(holder, former, present)
    failed = record(
        {
            **envelope,
            "program": word('program that the command is about, "" for none'),
            **ENDING,
        },
        "the command failed; nothing was written",
    )
    failed["properties"]["exit"] = {**integer("exit code of the command"), "const": 1}
    return {"title": f"result of compensate {command}", "description": about, "anyOf": [whole, failed]}


def _holders(schema: Schema, place: Sequence[str]) -> list[Schema]:
    """The schemas of the objects at a place of ``FORMER_KEYS``."""
    if not place:
        return [schema]
    step, *rest = place
    if step != "*":
        return _holders(schema["properties"][step], rest)
    inner = schema["items"] if "items" in schema else schema["additionalProperties"]
    return _holders(inner, rest)


def _add_former(holder: Schema, former: str, present: str) -> None:
    described = holder
    for step in present.split("."):
        described = described["properties"][step]
    name, dot, inner = former.partition(".")
    properties = holder["properties"]
    if dot:
        properties.setdefault(name, {**record({}, "former names of keys elsewhere"), "deprecated": True})
        properties = properties[name]["properties"]
    properties[inner if dot else name] = former_name_of(present, described)
