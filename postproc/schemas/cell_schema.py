"""The schema of a cell file."""

from __future__ import annotations

from postproc.cell import AXES, KEYS, MODES
from postproc.cell.stated_room import RANGES
from postproc.cell.tool_errors import LARGEST, WALL_SIDES
from postproc.languages import DIALECT_OPTIONS
from postproc.robot.external_axes import FIXED, NAMES, POSITIONER, TRACK
from postproc.robot.read_external_axes import DIRECTIONS
from postproc.schemas.parts import Schema, flag, known, listed, mapping, number, numbers, text

_NUMBERED = "^[1-9][0-9]{0,5}$"

_ABC = {"a": number("about z, deg"), "b": number("about y, deg"), "c": number("about x, deg")}
_POSE = {"x": number("mm"), "y": number("mm"), "z": number("mm"), **_ABC}
_FRAME = mapping(_POSE, ["x", "y", "z"], "x y z in mm, a b c in deg (KUKA's A, B, C)")

_TOOL = mapping(
    {
        **_POSE,
        "axis": {
            "description": "the spindle's axis in tool axes, towards the tip [+z]",
            "anyOf": [text(choices=[*AXES, *(word.upper() for word in AXES)]), numbers(3, 3)],
        },
        "mass": number("kg, with its centre `com`", 0.0),
        "com": numbers(3, 3, "centre of mass in flange axes, mm"),
        "diameter": number("of the cutter, mm", 0.01, 1000.0),
    },
    ["x", "y", "z"],
    "TOOL_DATA: the tool centre point on the flange",
    dependentRequired={"mass": ["com"], "com": ["mass"]},
)

_SYMBOL = r"^(#[0-9]+|[A-Za-z_$][A-Za-z0-9_$]*(\[[0-9]+(,[0-9]+)*\])?)$"
_COMPONENTS = mapping({}, patterns={"^[A-Za-z][A-Za-z0-9_]*$": number("of a component")}, minProperties=1)

_POINTS = listed(numbers(3, 3), "x y z in the base, mm", least=1)

_FORCE_INTERVAL: Schema = {
    "description": "half widths of the 95 % intervals of the forces",
    "anyOf": [
        number("share of the forces, common to all of them", 0.0, 1.0),
        mapping(
            {
                "scale": number("share of the forces, common to all of them", 0.0, 1.0),
                "direction_deg": number("turns of each force about two axes across it, deg [0]", 0.0, 90.0),
                **{f"f{axis}": number(f"N, along {axis} of the programmed base", 0.0) for axis in "xyz"},
            },
            dependentRequired={"fx": ["fy", "fz"], "fy": ["fx", "fz"], "fz": ["fx", "fy"]},
            minProperties=1,
        ),
    ],
}

_DIRECTION: Schema = {
    "anyOf": [text(choices=[*DIRECTIONS, *(word.upper() for word in DIRECTIONS)]), numbers(3, 3)]
}

_ADDRESS: Schema = {
    "type": "string",
    "pattern": "^(?:[UVWuvw]|[XYZUVWQxyzuvwq][1-9][0-9]?)$",
    "description": "its address in programs for a Sinumerik, where that is not its name",
}
_EXTERNAL: Schema = {
    "oneOf": [
        mapping(
            {
                "kind": {"const": TRACK},
                "direction": {**_DIRECTION, "description": "in which the axis moves the robot, world axes"},
                "limits": numbers(2, 2, "mm"),
                "start": number("value before a program states one, mm"),
                "word": _ADDRESS,
            },
            ["kind", "direction", "limits"],
        ),
        mapping(
            {
                "kind": {"const": POSITIONER},
                "axis": {
                    **_DIRECTION,
                    "description": "about which it turns the part, world axes, all at zero",
                },
                "point": numbers(3, 3, "a point of that axis in the world, mm"),
                "limits": numbers(2, 2, "deg"),
                "start": number("value before a program states one, deg"),
                "bases": {"type": "array", "items": {"type": "integer", "minimum": 1}, "minItems": 1},
                "on": text("the positioner that carries it", NAMES),
                "word": _ADDRESS,
            },
            ["kind", "axis", "point", "limits"],
        ),
        mapping({"kind": {"const": FIXED}, "word": _ADDRESS}, ["kind"], "it moves neither robot nor part"),
    ]
}

CELL: dict[str, Schema] = {
    "robot": text("a name in robots/, or a robot file relative to this one"),
    "robot_base": {**_FRAME, "description": "$WORLD -> $ROBROOT, mm and deg [0]"},
    "tools": mapping({}, about="by number, from 1: TOOL_DATA, T or D number", patterns={_NUMBERED: _TOOL}),
    "bases": mapping({}, about="by number, from 1: BASE_DATA; G54 is 1", patterns={_NUMBERED: _FRAME}),
    "force": text("fx,fy,fz[,mx,my,mz][@base|world|tool|feed] in N and N m, or a CSV"),
    "force_ci95": _FORCE_INTERVAL,
    "force_factors": mapping(
        {},
        about="operation, or others -> what `learn` found of its force",
        patterns={
            ".+": mapping(
                {
                    "factor": number("of the stated force", 0.1, 10.0),
                    "ci95": number("half width of its 95 % interval, as a share", 0.0, 2.0),
                    "turn": numbers(2, 2, "of its direction, deg: lift and swing"),
                },
                required=("factor",),
            )
        },
    ),
    "tool_errors": mapping(
        {},
        about="number of a tool -> what `learn` found of it",
        patterns={
            _NUMBERED: mapping(
                {
                    "radius": number("by which it is larger, mm", -LARGEST, LARGEST),
                    "radius_ci95": number("half width of the 95 % interval, mm", 0.0, LARGEST),
                    "length": number("by which it is longer, mm", -LARGEST, LARGEST),
                    "length_ci95": number("half width of the 95 % interval, mm", 0.0, LARGEST),
                    "walls": mapping(
                        {},
                        about="operation, or others -> side of the programmed feed, along the spindle, of the wall",
                        patterns={".+": text(choices=[*WALL_SIDES])},
                    ),
                },
                anyOf=[{"required": ["radius"]}, {"required": ["length"]}],
                dependentRequired={"radius_ci95": ["radius"], "length_ci95": ["length"]},
            )
        },
    ),
    "force_ramp": number(
        "path over which a force changes, mm [the tool's radius, where it is known]", 0.0, 500.0
    ),
    "process": text("process file (YAML)"),
    "correct": text(
        "process: the effect of the force; absolute: all errors of the model; touched_off: these less the rigid"
        " motion at touch_points [process]",
        MODES,
    ),
    "touch_points": {
        "description": "points at which the base was touched off, with correct: touched_off",
        "anyOf": [
            _POINTS,
            mapping({}, about="by number of the base", patterns={_NUMBERED: _POINTS}, minProperties=1),
        ],
    },
    "temperature": number("of the robot, degC", -10.0, 60.0),
    "start": numbers(6, 7, "axes before the first motion, deg (mm for a linear axis)"),
    "external_axes": mapping(
        dict.fromkeys(NAMES, _EXTERNAL), about="what the axes E1 to E6 of programs move"
    ),
    "symbols": mapping(
        {},
        about="values of names that only the controller knows: variables, points, frames, tool and base data; mm, deg",
        patterns={_SYMBOL: {"anyOf": [number("of a variable"), _COMPONENTS]}},
    ),
    "program_start": mapping(
        {
            "tool": number("number of the tool in the spindle", 0.0),
            "base": number("number of the base (work offset) in force", 0.0),
            **{word: number("mm, in that base") for word in "xyz"},
            **{word: number("deg") for word in "abc"},
        },
        about="the state at the first statement, where the program does not state it",
    ),
    "room": mapping(
        {
            **{key: numbers(2, 2, f"from, to, {unit}") for key, unit in RANGES.items()},
            "polygon": listed(numbers(2, 2), "corners x y of the area of the base's origin, mm", least=3),
        },
        about="where a part may be placed: the base's origin in $WORLD, turns of part and tool against the present, the"
        " linear track",
        minProperties=1,
    ),
    "orientation": mapping(_ABC, about="of the tool in the base, for programs that state none, deg"),
    "tolerance": number("path error that may remain, mm [0.02]", high=500.0, above=0.0),
    "tolerance_deg": number("the same of the orientation, deg [0.01]", high=45.0, above=0.0),
    "max_correction": number("mm; more is an error [10]", high=500.0, above=0.0),
    "min_segment": number("shortest motion after subdivision, mm [1]", high=500.0, above=0.0),
    "max_growth": number("motions of the output at most, as a multiple of the input's [2]", 1.0, 1e6),
    "controller": mapping(
        {
            "absolute_accuracy": flag("the controller corrects its geometry itself"),
            "gravity_compensated": flag("the controller corrects the deflection by weights"),
            "cycle_ms": number("interpolation cycle, ms [12]", 0.1, 100.0),
        },
        about="absolute_accuracy must be stated with correct: absolute and touched_off",
    ),
    "dialect": mapping(
        {
            "name": text("the language of the programs [detected]"),
            **{one.key: text(one.about, one.choices) for one in DIALECT_OPTIONS},
        },
        about="how programs are read",
    ),
}


def _where(modes: list[str], then: Schema, other: Schema) -> Schema:
    """A rule for cells whose ``correct`` is one of ``modes``, and one for all others."""
    chosen = {"properties": {"correct": {"enum": modes}}, "required": ["correct"]}
    return {"if": chosen, "then": then, "else": other}


_TOGETHER = [
    _where(["touched_off"], {"required": ["touch_points"]}, {"not": {"required": ["touch_points"]}}),
    _where(
        [mode for mode in MODES if mode != "process"],
        {"required": ["controller"], "properties": {"controller": {"required": ["absolute_accuracy"]}}},
        {},
    ),
]
"""What goes together with what is corrected."""


def cell_schema() -> Schema:
    return mapping(
        known(KEYS, CELL),
        ["robot"],
        "frames, tools, force and tolerances of a robot cell",
        title="cell.yaml",
        allOf=_TOGETHER,
    )
