"""The schema of a cell file."""

from __future__ import annotations

from postproc.cell import AXES, KEYS
from postproc.schemas.parts import Schema, flag, known, mapping, number, numbers, text

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
    },
    ["x", "y", "z"],
    "TOOL_DATA: the tool centre point on the flange",
    dependentRequired={"mass": ["com"], "com": ["mass"]},
)

CELL: dict[str, Schema] = {
    "robot": text("a name in robots/, or a robot file relative to this one"),
    "robot_base": {**_FRAME, "description": "$WORLD -> $ROBROOT, mm and deg [0]"},
    "tools": mapping({}, about="by number, from 1: TOOL_DATA, T or D number", patterns={_NUMBERED: _TOOL}),
    "bases": mapping({}, about="by number, from 1: BASE_DATA; G54 is 1", patterns={_NUMBERED: _FRAME}),
    "force": text("fx,fy,fz[,mx,my,mz][@base|world|tool|feed] in N and N m, or a CSV"),
    "force_ci95": number("the forces are known to this share (95 %)", 0.0, 1.0),
    "process": text("process file (YAML)"),
    "correct": text("what the force does, or all that the model knows [process]", ["process", "absolute"]),
    "start": numbers(6, 7, "axes before the first motion, deg (mm for a linear axis)"),
    "orientation": mapping(_ABC, about="of the tool in the base, for programs that state none, deg"),
    "tolerance": number("path error that may stay, mm [0.02]", above=0.0),
    "tolerance_deg": number("the same of the orientation, deg [0.01]", above=0.0),
    "max_correction": number("mm; more is an error [10]", above=0.0),
    "min_segment": number("shortest motion that is made by dividing one, mm [1]", above=0.0),
    "max_growth": number("motions of the output at most, as a multiple of the input's [2]", 1.0),
    "controller": mapping(
        {
            "absolute_accuracy": flag("the controller corrects its geometry itself"),
            "gravity_compensated": flag("the controller corrects what weights do"),
        },
        about="with correct: absolute",
    ),
    "dialect": mapping(
        {
            "name": text("the language of the programs [found by their text]"),
            "integer_words": text("what X10 means", ["mm", "um"]),
            "config_dat": text("the controller's $config.dat, relative to this file"),
        },
        about="how programs are read",
    ),
}


def cell_schema() -> Schema:
    return mapping(
        known(KEYS, CELL), ["robot"], "frames, tools, force and tolerances of a robot cell", title="cell.yaml"
    )
