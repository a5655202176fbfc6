"""The parts of a schema."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

Schema = dict[str, Any]


def describe(schema: Schema, about: str) -> Schema:
    """The schema with the description that an editor shows."""
    return {"description": about, **schema} if about else schema


def number(
    about: str = "", low: float | None = None, high: float | None = None, above: float | None = None
) -> Schema:
    """A number within ``low`` .. ``high``, or larger than ``above``."""
    bounds = {"minimum": low, "maximum": high, "exclusiveMinimum": above}
    return describe(
        {"type": "number", **{key: value for key, value in bounds.items() if value is not None}}, about
    )


def numbers(least: int, most: int | None, about: str = "") -> Schema:
    """A list of ``least`` .. ``most`` numbers."""
    length = {"minItems": least} if most is None else {"minItems": least, "maxItems": most}
    return describe({"type": "array", "items": {"type": "number"}, **length}, about)


def text(about: str = "", choices: Iterable[str] = ()) -> Schema:
    allowed = list(choices)
    return describe({"type": "string", **({"enum": allowed} if allowed else {"minLength": 1})}, about)


def flag(about: str = "") -> Schema:
    return describe({"type": "boolean"}, about)


def listed(items: Schema, about: str = "", least: int = 0) -> Schema:
    return describe({"type": "array", "items": items, **({"minItems": least} if least else {})}, about)


def mapping(
    properties: Mapping[str, Schema],
    required: Sequence[str] = (),
    about: str = "",
    patterns: Mapping[str, Schema] | None = None,
    **more: Any,
) -> Schema:
    """Keys and values; a key that is neither one of ``properties`` nor of ``patterns`` is wrong."""
    schema: Schema = {"type": "object", "properties": dict(properties), "additionalProperties": False}
    if required:
        schema["required"] = list(required)
    if patterns:
        schema["patternProperties"] = dict(patterns)
    return describe({**schema, **more}, about)


def former_name_of(key: str, schema: Schema) -> Schema:
    """The schema of the former name of ``key``."""
    return {**schema, "description": f"former name of {key}", "deprecated": True}


def known(keys: Iterable[str], described: Mapping[str, Schema]) -> dict[str, Schema]:
    """The reader's ``keys`` as they are described; one that is not described yet may hold anything."""
    return {key: described.get(key, {}) for key in keys}
