"""The schema of a robot file."""

from __future__ import annotations

import re
from typing import Any

from postproc.base.units import UNITS, words_for
from postproc.effects import EFFECTS, Parameter
from postproc.robot.description import find_robot, load_robot
from postproc.robot.provenance import COMMANDS, FORMER_GAP, GAP
from postproc.robot.read_geometry import KINDS
from postproc.schemas.parts import Schema, former_name_of, listed, mapping, number, numbers, text

__all__ = ["robot_schema"]

_JOINT = "[A-Za-z][A-Za-z0-9_]*$"
_SOURCE = text("where the figures come from: paper, data sheet, page")
_LENGTH = text("unit of lengths", words_for("m"))
_ANGLE = text("unit of angles", words_for("rad"))

_FRAME = mapping(
    {"unit": _LENGTH, "angle_unit": _ANGLE, **{key: number() for key in "xyzabc"}}, ["unit", "angle_unit"]
)

_LINKS: dict[str, Schema] = {
    "kuka": mapping(
        {
            "unit": _LENGTH,
            **{name: number() for name in ("d1", "a1", "a3", "d6")},
            **{name: number(above=0.0) for name in ("a2", "d4")},
        },
        ["unit", "d1", "a1", "a2", "a3", "d4", "d6"],
        "link lengths of an arm of KUKA's kind",
    ),
    **{
        kind: mapping(
            {
                "unit": _LENGTH,
                "angle_unit": _ANGLE,
                "rows": listed(
                    mapping({key: number() for key in ("a", "alpha", "d", "theta")}, ["a", "alpha", "d"]),
                    least=1,
                ),
            },
            ["unit", "angle_unit", "rows"],
            about,
        )
        for kind, about in (("dh", "Denavit-Hartenberg parameters"), ("mdh", "modified (Craig's) parameters"))
    },
    "urdf": mapping(
        {
            "file": text("in the folder of this file or below"),
            "base": text("name of the URDF link"),
            "tip": text("name of the URDF link"),
        },
        ["file"],
    ),
}


def _geometry(about: str) -> Schema:
    return mapping(
        {
            **{kind: _LINKS[kind] for kind in KINDS},
            "source": _SOURCE,
            "rail": text("a linear axis under a KUKA-type arm", [s + a for a in "xyz" for s in "+-"]),
            "base": _FRAME,
            "flange": _FRAME,
        },
        ["source"],
        about,
        oneOf=[{"required": [kind]} for kind in KINDS],
        dependentSchemas={
            "kuka": {"not": {"anyOf": [{"required": ["base"]}, {"required": ["flange"]}]}},
            "rail": {"required": ["kuka"]},
        },
    )


def _axis(kind: str, si_unit: str, required: tuple[str, ...]) -> Schema:
    """A joint in full."""
    return mapping(
        {
            "limits": numbers(2, 2),
            "kind": {"const": kind},
            "unit": text(choices=words_for(si_unit)),
            "sign": {"enum": [1, -1]},
            "offset": number(),
            "interaction": text("the joint before on top of whose value programs count this one"),
        },
        ["limits", *required],
    )


_JOINTS = mapping(
    {
        "source": _SOURCE,
        "unit": _ANGLE,
        "external": text("the joint of seven that the program does not move"),
    },
    ["source", "unit"],
    "the joints in the order of the chain: [lower, upper], or limits with kind, unit, sign, offset, interaction",
    {
        f"^(?!(?:source|unit|external)$){_JOINT}": {
            "anyOf": [
                numbers(2, 2, "lower and upper limit"),
                _axis("revolute", "rad", ()),
                _axis("prismatic", "m", ("kind", "unit")),
                mapping(
                    {
                        "follows": mapping({}, [], "ratio to each joint that moves it", {_JOINT: number()}),
                        "kind": {"enum": ["revolute", "prismatic"]},
                        "unit": text(choices=(*words_for("rad"), *words_for("m"))),
                        "offset": number(),
                    },
                    ["follows"],
                    "a joint without a motor, which a linkage or a gear moves",
                ),
            ]
        }
    },
)

_MASSES = mapping(
    {"source": _SOURCE, "unit": text(choices=words_for("kg")), "com_unit": _LENGTH},
    ["source", "unit", "com_unit"],
    "mass and centre of the link that a joint moves",
    {
        f"^(?!(?:source|unit|com_unit)$){_JOINT}": mapping(
            {"mass": number(low=0.0), "com": numbers(3, 3)}, ["mass", "com"]
        )
    },
)

_MECHANISM: Schema = {
    "type": "object",
    "properties": {key: text() for key in ("name", "kind", "joint", "about", "source")},
    "required": ["name", "kind", "source"],
    "additionalProperties": mapping(
        {
            "value": {"anyOf": [number(), numbers(3, 3)]},
            "unit": text(choices=UNITS),
            "source": text(),
        },
        ["value", "unit"],
    ),
}

_SHA = {"type": "string", "pattern": "^[0-9a-f]{64}$"}

_IDENTIFIED = mapping(
    {
        "command": text(choices=COMMANDS),
        "version": text(),
        "date": {"type": "string", "pattern": "^[0-9]{4}-[0-9]{2}-[0-9]{2}$"},
        "data": listed(mapping({"file": text(), "sha256": _SHA}, ["file", "sha256"])),
        "robot_sha256": _SHA,
        "effects": listed(text()),
        "poses": {"type": "integer", "minimum": 0},
        "readings": {"type": "integer", "minimum": 0},
        "gap": mapping(
            {
                **{key: number("mm", 0.0) for key in GAP},
                **{former: former_name_of(key, number(low=0.0)) for former, key in FORMER_GAP.items()},
            }
        ),
        "correlation": {"type": "object", "additionalProperties": numbers(1, None)},
    },
    ["command", "version", "date", "robot_sha256", "effects", "poses", "readings"],
    "a run of the tool that gave this file new values",
)

OPTIONS: dict[str, dict[str, Schema]] = {
    "gravity_compensator": {
        "joint": text("the joint that the spring acts on"),
        "preload": text(choices=("balanced", "acting")),
        "sign": text(choices=("energy", "as_printed")),
        "zero_deg": number(low=-360.0, high=360.0),
    },
    "backlash": {"friction": number("N m, N", 0.1, 1e5)},
    "thermal_growth": {
        "variable": text(choices=("temperature", "time")),
        "reference": number("temperature of the calibration, degC", -10.0, 60.0),
    },
    "transmission_error": {"harmonics": numbers(1, None)},
}
"""Options of the effects that have some."""

NEEDED = {"gravity_compensator": ["joint"]}
"""Options that have no default."""


def robot_schema() -> Schema:
    return mapping(
        {
            "name": text("as the file is named"),
            "maker_name": text(),
            "about": text(),
            "geometry": _geometry("the geometry of the arm itself"),
            "controller": _geometry("the geometry by which the controller calculates [the arm's own]"),
            "joints": _JOINTS,
            "masses": _MASSES,
            "effects": listed(
                {"type": "object", "required": ["effect"], "oneOf": [_effect(name) for name in EFFECTS]},
                "causes of the arm's deviation from the controller's geometry",
            ),
            "rated_payload": mapping(
                {"value": number(low=0.0), "unit": text(choices=words_for("kg")), "source": _SOURCE},
                ["value", "unit", "source"],
                "the heaviest that the robot may carry",
            ),
            "mechanisms": listed(_MECHANISM, "hardware whose effect may or may not be modelled"),
            "identified": listed(_IDENTIFIED),
        },
        ["name", "geometry", "joints"],
        "geometry, joints and effects of a robot; every figure with its source",
        title="robot file",
    )


def _effect(name: str) -> Schema:
    """One entry of ``effects:``.  Numbers in the names of its parameters stand for joints."""
    units: dict[str, set[str]] = {}
    for parameter in _parameters(name):
        pattern = re.sub(r"[0-9]+", r"[0-9]+(\\.[0-9]+)?", re.escape(parameter.name).replace(r"\-", "-"))
        units.setdefault(f"^{pattern}$", set()).add(parameter.unit)
    return mapping(
        {
            "effect": {"const": name},
            "options": mapping(OPTIONS.get(name, {}), NEEDED.get(name, ())),
            "parameters": mapping({}, patterns={at: _value(allowed) for at, allowed in units.items()}),
        },
        ["effect", *(["options"] if name in NEEDED else [])],
    )


def _parameters(name: str) -> list[Parameter]:
    """Parameters of an effect in all its forms, on an arm that all effects know."""
    joints = load_robot(find_robot("kuka_kr270")).joints
    kind: Any = EFFECTS[name]
    forms = [kind(joints), *kind.variants(joints)]
    for option, schema in OPTIONS.get(name, {}).items():
        forms += [kind(joints, **{option: choice}) for choice in schema.get("enum", ()) if option != "joint"]
    return [parameter for form in forms for parameter in form.parameters]


def _value(si_units: set[str]) -> Schema:
    words = [word for unit in sorted(si_units) for word in words_for(unit)]
    return mapping(
        {
            "value": number(),
            "unit": text(choices=words),
            "ci95": number("half width of the 95 % interval", 0.0),
            "ci": number("half width of an interval whose level the source does not state", 0.0),
            "ci_level": text(choices=("unstated",)),
            "source": _SOURCE,
        },
        ["value", "unit", "source"],
        dependentSchemas={"ci": {"anyOf": [{"required": ["ci_level"]}, {"required": ["ci95"]}]}},
    )
