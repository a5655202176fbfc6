"""The cell file ``cell.yaml``, read and checked.

The file is in mm and deg; what is read is in SI units and radians.
"""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats, frozen
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.base.yaml_section import YamlSection, load
from postproc.cell.controller_state import read_program_start, read_symbols
from postproc.cell.description import MODES, Cell, Controller, ForceFactor, ForceVectorInterval, Tool
from postproc.cell.implausible import implausible
from postproc.cell.stated_room import read_room
from postproc.cell.tool_errors import OTHERS, read_tool_error
from postproc.languages import DIALECT_OPTIONS
from postproc.robot.read_external_axes import read_external

NAME = "cell.yaml"

SAME_PLACE = 1.0 * MM
"""Touch points that are nearer to each other than this do not determine a direction."""
LARGEST_LENGTH, LARGEST_ANGLE, LARGEST_PLACE = 500.0, 45.0, 1e5
"""[mm], [deg] The largest numbers of the path that a cell can mean (a ramp is as long as the largest tool's radius),
and the farthest touch point."""
MOST_GROWTH, LARGEST_FORCE = 1e6, 1e6
"""The same of ``max_growth``, and of a component of the force [N]."""
ON_A_LINE = 0.01
"""Touch points lie on a line where their extent across it is less than this share of that along it."""

KEYS = (
    "robot",
    "robot_base",
    "tools",
    "bases",
    "force",
    "force_ci95",
    "force_ramp",
    "force_factors",
    "tool_errors",
    "process",
    "correct",
    "touch_points",
    "temperature",
    "start",
    "external_axes",
    "symbols",
    "program_start",
    "room",
    "orientation",
    "tolerance",
    "tolerance_deg",
    "max_correction",
    "min_segment",
    "max_growth",
    "controller",
    "dialect",
)
_POSE_KEYS = ("x", "y", "z", "a", "b", "c")
AXES = {
    sign + name: tuple((1.0 if sign == "+" else -1.0) if i == k else 0.0 for i in range(3))
    for k, name in enumerate("xyz")
    for sign in "+-"
}
_RESEMBLING = (".yaml", ".yml", ".yaml.txt", ".yml.txt", ".json")
_NUMBER = re.compile(r"[1-9][0-9]{0,5}\Z")
_WORD = re.compile(r"[\w-]+")


def _resembling(folder: Path) -> str:
    """The name of a file in ``folder`` that was meant as the cell; "" without one."""
    try:
        names = sorted(os.listdir(folder))
    except OSError:
        return ""
    return next((name for name in names if _resembles_cell(name.lower())), "")


def _resembles_cell(name: str) -> bool:
    """Whether a file of this name (small letters) could be meant as the cell: my_cell.yml, cell.yaml.txt."""
    suffix = max((one for one in _RESEMBLING if name.endswith(one)), key=len, default="")
    stem = name.removesuffix(suffix).rpartition(".")[2]
    return bool(suffix) and "cell" in stem and _WORD.fullmatch(stem) is not None


def find_cell(program: Path) -> Path:
    """The ``cell.yaml`` in the program's folder or the nearest parent that has one; Refusal CEL001 if none."""
    folder = Path(os.path.abspath(program)).parent
    searched = [folder, *folder.parents]
    for place in searched:
        if os.path.isfile(place / NAME):
            return place / NAME
    names = ", ".join(str(place) for place in searched)
    help = f"put a {NAME} beside the program or above it, or name one with --cell FILE"
    if resembling := _resembling(folder):
        help = f"{resembling} is not read: rename it to {NAME}, or name it with --cell {resembling}"
    raise Refusal(
        Finding(
            "CEL001",
            f"no {NAME} exists for this program; {names} were searched",
            str(program),
            help=help,
        )
    )


def load_cell(path: Path) -> Cell:
    """Reads and checks a cell file.  Refusal: FIL..., YML... with file, line and key."""
    top = load(path)
    top.only(*KEYS)
    if "force" in top and "process" in top:
        raise top.error("YML004", "excludes 'force'; state only one of them", "process")
    controller = top.section("controller", None)
    controller.only("absolute_accuracy", "gravity_compensated", "cycle_ms")
    correct = top.text("correct", "process", MODES)
    if correct != "process" and "absolute_accuracy" not in controller:
        raise top.error(
            "CEL010",
            f"{correct} needs to know whether the controller corrects its geometry itself",
            "correct",
            "state it: controller: {absolute_accuracy: false}, or true for a robot with an absolutely accurate model;"
            " otherwise its geometry errors may be corrected twice",
        )
    scale, vector = _force_interval(top)
    dialect = top.section("dialect", None)
    dialect.only("name", *(option.key for option in DIALECT_OPTIONS))
    cell = Cell(
        path=path,
        robot=_word(top, "robot"),
        robot_base=_robot_base(top),
        tools={number: _tool(section) for number, section in _numbered(top, "tools")},
        bases={number: _frame(section) for number, section in _numbered(top, "bases")},
        force=_force(top),
        force_line=top.line_of("force") if "force" in top else 0,
        force_ci95=scale,
        process=_word(top, "process") if "process" in top else None,
        correct=correct,
        start_stated=_start(top),
        start_line=top.line_of("start") if "start" in top else 0,
        orientation=_orientation(top),
        tolerance=_positive(top, "tolerance", 0.02, "mm", LARGEST_LENGTH) * MM,
        tolerance_angle=_positive(top, "tolerance_deg", 0.01, "deg", LARGEST_ANGLE) * DEG,
        max_correction=_positive(top, "max_correction", 10.0, "mm", LARGEST_LENGTH) * MM,
        min_segment=_positive(top, "min_segment", 1.0, "mm", LARGEST_LENGTH) * MM,
        max_growth=top.number("max_growth", 2.0, low=1.0, high=MOST_GROWTH),
        growth_stated="max_growth" in top,
        segment_stated="min_segment" in top,
        controller=Controller(
            controller.flag("absolute_accuracy", False),
            controller.flag("gravity_compensated", False),
            controller.number("cycle_ms", 12.0, low=0.1, high=100.0, unit="ms"),
        ),
        dialect=_word(dialect, "name") if "name" in dialect else None,
        dialect_line=dialect.line_of("name") if "name" in dialect else 0,
        dialect_options={
            option.key: dialect.text(option.key, "", option.choices)
            if option.choices
            else _word(dialect, option.key)
            for option in DIALECT_OPTIONS
            if option.key in dialect
        },
        force_vector=vector,
        force_factors=_force_factors(top),
        force_factors_line=top.line_of("force_factors") if "force_factors" in top else 0,
        tool_errors={number: read_tool_error(section) for number, section in _numbered(top, "tool_errors")},
        tool_errors_line=top.line_of("tool_errors") if "tool_errors" in top else 0,
        force_ramp=_ramp(top),
        touch_points=_touch_points(top, correct),
        touch_line=top.line_of("touch_points") if "touch_points" in top else 0,
        temperature=(
            top.number("temperature", low=-10.0, high=60.0, unit="degC") if "temperature" in top else None
        ),
        temperature_line=top.line_of("temperature") if "temperature" in top else 0,
        external_axes=read_external(top),
        symbols=read_symbols(top),
        program_start=read_program_start(top),
        room=read_room(top),
    )
    return replace(cell, findings=implausible(top, cell))


def _word(section: YamlSection, key: str) -> str:
    text = section.text(key).strip()
    if not text:
        raise section.error("YML004", "is empty", key)
    return text


def _force(top: YamlSection) -> str | None:
    if "force" not in top:
        return None
    if top.is_list("force"):
        raise top.error(
            "YML004", "must be a text and not a list", "force", "write for example force: 0,360,560@base"
        )
    return _word(top, "force")


def _ramp(top: YamlSection) -> float | None:
    """[m] the stated path over which a force changes."""
    if "force_ramp" not in top:
        return None
    return top.number("force_ramp", low=0.0, high=LARGEST_LENGTH, unit="mm") * MM


def _positive(section: YamlSection, key: str, default: float, unit: str, most: float) -> float:
    value = section.number(key, default, high=most, unit=unit)
    if value <= 0:
        raise section.error("YML004", f"{value:g} is not above 0", key, f"write a number in {unit}, above 0")
    return value


def _numbered(top: YamlSection, key: str) -> list[tuple[int, YamlSection]]:
    """The sections under ``key`` by number, which counts from 1."""
    parent = top.section(key, None)
    sections = []
    for name in parent:
        if not _NUMBER.match(name):
            raise parent.error("YML004", "is not a number from 1", name, f"{key} are numbered: 1, 2, ...")
        sections.append((int(name), parent.section(name)))
    return sections


def _frame(section: YamlSection, *more: str) -> Poses:
    """The pose of a section with x y z [mm] and perhaps a b c [deg]."""
    section.only(*_POSE_KEYS, *more)
    position = np.array([section.number(key, unit="mm") for key in "xyz"]) * MM
    abc = np.array([section.number(key, 0.0, unit="deg") for key in "abc"]) * DEG
    pose = Poses.from_abc(position, abc)
    return Poses(frozen(pose.rotation, (3, 3)), frozen(pose.position, (3,)))


def _robot_base(top: YamlSection) -> Poses:
    return _frame(top.section("robot_base")) if "robot_base" in top else Poses.identity()


def _start(top: YamlSection) -> Floats | None:
    """Six values, or seven for an arm with an external joint."""
    if "start" not in top:
        return None
    return frozen(top.numbers("start", 7 if top.length("start") == 7 else 6, unit="deg"))


def _orientation(top: YamlSection) -> Floats | None:
    if "orientation" not in top:
        return None
    section = top.section("orientation")
    section.only("a", "b", "c")
    return frozen([section.number(key, 0.0, unit="deg") * DEG for key in "abc"], (3,))


def _force_factors(top: YamlSection) -> dict[str, ForceFactor]:
    """Operation, in upper case -> its factor."""
    factors = {}
    section = top.section("force_factors", {})
    for key in section:
        one = section.section(key)
        one.only("factor", "ci95", "turn")
        name = key if key == OTHERS else " ".join(key.split()).upper()
        if name in factors:
            raise section.error("YML004", f"the operation {name!r} occurs twice", key)
        turn = one.numbers("turn", 2, unit="deg") if "turn" in one else [0.0, 0.0]
        if max(abs(angle) for angle in turn) > 90:
            raise one.error("YML004", "the turn exceeds 90 deg", "turn")
        factors[name] = ForceFactor(
            one.number("factor", low=0.1, high=10.0),
            one.number("ci95", low=0.0, high=2.0) if "ci95" in one else None,
            (turn[0] * DEG, turn[1] * DEG),
        )
    return factors


def _force_interval(top: YamlSection) -> tuple[float | None, ForceVectorInterval | None]:
    """The interval of the forces' scale, as a share of them, and those of their direction and components.

    ``force_ci95`` is one number, the scale, or a mapping ``{scale, direction_deg, fx, fy, fz}``.
    """
    if "force_ci95" not in top:
        return None, None
    if not top.is_mapping("force_ci95"):
        return top.number("force_ci95", low=0.0, high=1.0), None
    section = top.section("force_ci95")
    names = ("fx", "fy", "fz")
    section.only("scale", "direction_deg", *names)
    stated = [name for name in names if name in section]
    absent = [name for name in names if name not in section]
    if not stated and "scale" not in section and "direction_deg" not in section:
        raise section.error(
            "YML003", "states nothing", help="write for example {scale: 0.2, direction_deg: 10}"
        )
    if stated and absent:
        raise section.error(
            "YML003",
            f"is incomplete: {absent[0]!r} is missing",
            stated[0],
            "state the intervals of all three components (N); 0 for one that is known exactly",
        )
    scale = section.number("scale", low=0.0, high=1.0) if "scale" in section else None
    direction = section.number("direction_deg", 0.0, low=0.0, high=90.0, unit="deg") * DEG
    components = None
    if stated:
        bounds = {"low": 0.0, "high": LARGEST_FORCE}
        components = frozen([section.number(name, **bounds, unit="N") for name in names], (3,))
    return scale, ForceVectorInterval(direction, components)


def _touch_points(top: YamlSection, correct: str) -> dict[int | None, Floats]:
    """The places at which bases were touched off, by the number of the base; None is the only one."""
    if (correct == "touched_off") != ("touch_points" in top):
        if correct == "touched_off":
            raise top.error(
                "YML003",
                "touched_off needs 'touch_points'",
                "correct",
                "touch_points: [[x, y, z], ...] in mm: the places in the base where it is touched off",
            )
        raise top.error("YML004", "needs 'correct: touched_off', and is ignored without it", "touch_points")
    if correct != "touched_off":
        return {}
    if top.is_list("touch_points"):
        return {None: _places(top, "touch_points")}
    numbered = top.section("touch_points")
    places: dict[int | None, Floats] = {}
    for name in numbered:
        if not _NUMBER.match(name):
            raise numbered.error("YML004", "is not a number from 1", name, "bases are numbered: 1, 2, ...")
        places[int(name)] = _places(numbered, name)
    if not places:
        raise top.error("YML003", "contains no touch point", "touch_points")
    return places


def _places(section: YamlSection, key: str) -> Floats:
    """(K, 3) [m] touch points that lie apart and, three and more of them, not on a line."""
    points = np.array(section.rows(key, 3, unit="mm")) * MM
    if np.abs(points).max() > LARGEST_PLACE * MM:
        far = float(np.abs(points).max()) / MM
        message = f"{far:g} mm is not within {-LARGEST_PLACE:g} .. {LARGEST_PLACE:g}"
        raise section.error("YML004", message, key, "write places in the base, in mm")
    apart = np.linalg.norm(points[:, None] - points[None], axis=2) + np.diag(np.full(len(points), np.inf))
    if apart.min() < SAME_PLACE:
        one, other = np.unravel_index(int(np.argmin(apart)), apart.shape)
        raise section.error(
            "YML004",
            f"points {one + 1} and {other + 1} are the same place",
            key,
            "name points that are far apart",
        )
    if len(points) > 2:
        extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if extent[1] < ON_A_LINE * extent[0]:
            raise section.error(
                "YML004",
                f"the {len(points)} points are on one line, about which the base can rotate",
                key,
                "add a point off the line, or give two points only",
            )
    return frozen(points, (-1, 3))


def _tool(section: YamlSection) -> Tool:
    pose = _frame(section, "axis", "mass", "com", "diameter")
    diameter = None
    if "diameter" in section:
        diameter = section.number("diameter", low=0.01, high=1000.0, unit="mm") * MM
    if ("mass" in section) != ("com" in section):
        there, absent = ("mass", "com") if "mass" in section else ("com", "mass")
        raise section.error(
            "YML003", f"is incomplete: {absent!r} is missing", there, "a payload needs mass (kg) and com (mm)"
        )
    if "mass" not in section:
        return Tool(pose, _axis(section), diameter=diameter)
    com = frozen(np.array(section.numbers("com", 3, unit="mm")) * MM, (3,))
    return Tool(pose, _axis(section), section.number("mass", low=0.0, unit="kg"), com, diameter)


def _axis(section: YamlSection) -> Floats:
    """Unit vector (3,) of ``axis``: a signed letter, or three numbers of any length."""
    if section.is_list("axis"):
        vector = np.array(section.numbers("axis", 3))
        largest = np.max(np.abs(vector))
        if largest == 0:
            raise section.error("YML004", "has no direction", "axis")
        vector /= largest  # squares of very large or small numbers overflow or underflow
        return frozen(vector / np.linalg.norm(vector), (3,))
    word = section.text("axis", "+z").strip().lower()
    if word not in AXES:
        # no nearest name: z is as near to -z as to +z, and the wrong one turns the force round
        allowed = ", ".join(AXES)
        raise section.error("YML004", f"{word!r} is not one of {allowed}, nor a list [x, y, z]", "axis")
    return frozen(AXES[word], (3,))
