"""The robot cell of a program: frames, tools, force and tolerances, read from ``cell.yaml`` and checked.

The file speaks mm and deg; what is here is SI and radians.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from postproc.arrays import Floats, Ints, frozen
from postproc.findings import Finding, Refusal
from postproc.geometry import UNKNOWN, Poses, vector_from_rotation
from postproc.toolpath import FrameRef, Toolpath
from postproc.units import DEG, MM
from postproc.yamlfile import Section, load

NAME = "cell.yaml"
SAME_POSITION = 0.01 * MM
SAME_ANGLE = 0.01 * DEG
"""Within these a literal $TOOL is taken for a tool of the cell."""

KEYS = (
    "robot",
    "robot_base",
    "tools",
    "bases",
    "force",
    "force_ci95",
    "process",
    "correct",
    "start",
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
_NUMBER = re.compile(r"[1-9][0-9]{0,5}\Z")


@dataclass(frozen=True, eq=False)
class Tool:
    """``pose``: TCP in the flange.  ``axis`` (3,): unit vector of the spindle, tip-ward, in the tool's axes.

    ``mass`` [kg] and ``com`` (3,) [m, flange axes]: both or neither.
    """

    pose: Poses
    axis: Floats
    mass: float | None = None
    com: Floats | None = None


@dataclass(frozen=True)
class Controller:
    """What the controller corrects by itself: its geometric model, the sag under weight and payload."""

    absolute_accuracy: bool = False
    gravity_compensated: bool = False


@dataclass(frozen=True, eq=False)
class Cell:
    """One checked cell file.

    robot_base: robot root in $WORLD; bases: in $WORLD; orientation (3,) A, B, C: [rad];
    start_stated (6,) or (7,): joint values before the first motion, deg, mm for a linear axis;
    tolerance, max_correction, min_segment [m]; tolerance_angle [rad].  ``force`` is the text of the key, a path
    in it is relative to the cell file; ``force_line`` is where it stands.  ``force_ci95``: half width of the 95 %
    interval of all forces, as a share of them; None where nothing is stated.  ``dialect``: name of the programs'
    language, where their names and contents do not tell it; ``config_dat``: the controller's $config.dat, relative to
    the cell file.
    """

    path: Path
    robot: str
    robot_base: Poses = field(default_factory=Poses.identity)
    tools: dict[int, Tool] = field(default_factory=dict)
    bases: dict[int, Poses] = field(default_factory=dict)
    force: str | None = None
    force_line: int = 0
    force_ci95: float | None = None
    process: str | None = None
    process_line: int = 0
    correct: str = "process"
    start_stated: Floats | None = None
    start_line: int = 0
    orientation: Floats | None = None
    tolerance: float = 0.02 * MM
    tolerance_angle: float = 0.01 * DEG
    max_correction: float = 10.0 * MM
    min_segment: float = 1.0 * MM
    max_growth: float = 2.0
    controller: Controller = Controller()
    integer_words: str = "mm"
    dialect: str | None = None
    dialect_line: int = 0
    config_dat: str | None = None

    @property
    def start(self) -> Floats | None:
        """The values of ``start_stated`` as angles [rad]."""
        return None if self.start_stated is None else frozen(self.start_stated * DEG)


@dataclass(frozen=True, eq=False)
class Frames:
    """The frames of every motion.

    base_in_robot (N): programmed base in the robot root; tool_in_flange (N): TCP; spindle_in_tool (N, 3): unit
    vector of the spindle, tip-ward, in tool axes.  NaN where unknown.  Read-only.
    """

    base_in_robot: Poses
    tool_in_flange: Poses
    spindle_in_tool: Floats


def find_cell(program: Path) -> Path:
    """The ``cell.yaml`` in the program's folder or the nearest parent that has one; Refusal CEL001 if none."""
    folder = Path(os.path.abspath(program)).parent
    searched = [folder, *folder.parents]
    for place in searched:
        if os.path.isfile(place / NAME):
            return place / NAME
    names = ", ".join(str(place) for place in searched)
    raise Refusal(
        Finding(
            "CEL001",
            f"no {NAME} for this program; searched {names}",
            str(program),
            help=f"put a {NAME} beside the program or above it, or name one with --cell FILE",
        )
    )


def load_cell(path: Path) -> Cell:
    """Reads and checks a cell file.  Refusal: FIL..., YML... with file, line and key."""
    top = load(path)
    top.only(*KEYS)
    if "force" in top and "process" in top:
        raise top.error("YML004", "stands beside 'force'; only one of them can be meant", "process")
    controller = top.section("controller", None)
    controller.only("absolute_accuracy", "gravity_compensated")
    dialect = top.section("dialect", None)
    dialect.only("integer_words", "name", "config_dat")
    return Cell(
        path=path,
        robot=_word(top, "robot"),
        robot_base=_robot_base(top),
        tools={number: _tool(section) for number, section in _numbered(top, "tools")},
        bases={number: _frame(section) for number, section in _numbered(top, "bases")},
        force=_force(top),
        force_line=top.line_of("force") if "force" in top else 0,
        force_ci95=top.number("force_ci95", low=0.0, high=1.0) if "force_ci95" in top else None,
        process=_word(top, "process") if "process" in top else None,
        process_line=top.line_of("process") if "process" in top else 0,
        correct=top.text("correct", "process", ("process", "absolute")),
        start_stated=_start(top),
        start_line=top.line_of("start") if "start" in top else 0,
        orientation=_orientation(top),
        tolerance=_positive(top, "tolerance", 0.02, "mm") * MM,
        tolerance_angle=_positive(top, "tolerance_deg", 0.01, "deg") * DEG,
        max_correction=_positive(top, "max_correction", 10.0, "mm") * MM,
        min_segment=_positive(top, "min_segment", 1.0, "mm") * MM,
        max_growth=top.number("max_growth", 2.0, low=1.0),
        controller=Controller(
            controller.flag("absolute_accuracy", False), controller.flag("gravity_compensated", False)
        ),
        integer_words=dialect.text("integer_words", "mm", ("mm", "um")),
        dialect=_word(dialect, "name") if "name" in dialect else None,
        dialect_line=dialect.line_of("name") if "name" in dialect else 0,
        config_dat=_word(dialect, "config_dat") if "config_dat" in dialect else None,
    )


def frames_of(cell: Cell, toolpath: Toolpath, file: str | Path) -> Frames:
    """The base, tool and spindle axis of every motion of ``toolpath``, which was read from ``file``.

    A frame that the program gives as a pose wins over the cell's of the same number.  Refusal CEL002 for every
    frame that neither gives and that a motion with a known target uses; without such a motion it is NaN.
    """
    tools = {number: tool.pose for number, tool in cell.tools.items()}
    robot_from_world = cell.robot_base.inverse()
    known = toolpath.known | ((toolpath.anchor >= 0) & (toolpath.base >= 0) & (toolpath.tool >= 0))
    missing = _missing(cell, toolpath, toolpath.base[known], cell.bases, "base", str(file))
    missing += _missing(cell, toolpath, toolpath.tool[known], tools, "tool", str(file))
    if missing:
        raise Refusal(*missing)
    base_in_world = [_pose(frame, cell.bases) for frame in toolpath.frames]
    tool_in_flange = [_pose(frame, tools) for frame in toolpath.frames]
    base_in_robot = [robot_from_world @ pose for pose in base_in_world]
    axes = [_spindle(frame, cell) for frame in toolpath.frames]
    return Frames(
        _per_row(base_in_robot, toolpath.base),
        _per_row(tool_in_flange, toolpath.tool),
        _rows(np.array([*axes, np.full(3, np.nan)]), toolpath.tool),
    )


def _pose(frame: FrameRef, numbered: dict[int, Poses]) -> Poses:
    if frame.pose is not None:
        return frame.pose
    if frame.number == 0:  # $NULLFRAME
        return Poses.identity()
    return UNKNOWN if frame.number is None else numbered.get(frame.number, UNKNOWN)


def _spindle(frame: FrameRef, cell: Cell) -> Floats:
    """The spindle axis (3,) that goes with a tool frame; NaN where the cell has no such tool, or two that differ."""
    unknown = np.full(3, np.nan)
    if frame.number is not None:
        tool = cell.tools.get(frame.number)
        return unknown if tool is None else tool.axis
    if frame.pose is None:
        return unknown
    axes = [tool.axis for tool in cell.tools.values() if _same(tool.pose, frame.pose)]
    if not axes or any(np.max(np.abs(axis - axes[0])) > 1e-6 for axis in axes):
        return unknown
    return axes[0]


def _same(one: Poses, two: Poses) -> bool:
    away = np.linalg.norm(one.position - two.position)
    turned = np.linalg.norm(vector_from_rotation(one.rotation.T @ two.rotation))
    return bool(away <= SAME_POSITION and turned <= SAME_ANGLE)


def _missing(
    cell: Cell, toolpath: Toolpath, used: Ints, numbered: dict[int, Poses], word: str, file: str
) -> list[Finding]:
    findings: dict[int, Finding] = {}
    for index in np.unique(used):
        frame = toolpath.frames[index]
        number = frame.number
        if (
            frame.pose is not None
            or number is None
            or number == 0
            or number in numbered
            or number in findings
        ):
            continue
        listed = ", ".join(str(n) for n in sorted(numbered))
        has = (
            f"the cell {cell.path} has {word}s {listed}"
            if numbered
            else f"the cell {cell.path} has no {word}s"
        )
        findings[number] = Finding(
            "CEL002",
            f"{word} {number} is not known: the program does not give it, and {has}",
            file,
            frame.line,
            help=f"add it to {cell.path}: {word}s: {{{number}: {{x: ..., y: ..., z: ..., a: ..., b: ..., c: ...}}}}",
        )
    return list(findings.values())


def _per_row(poses: list[Poses], index: Ints) -> Poses:
    """The poses (N) that ``index`` (N,) picks; NaN for -1."""
    rotations = np.array([pose.rotation for pose in [*poses, UNKNOWN]])
    positions = np.array([pose.position for pose in [*poses, UNKNOWN]])
    return Poses(_rows(rotations, index), _rows(positions, index))


def _rows(table: Floats, index: Ints) -> Floats:
    """``table[index]``, without a copy where all rows share one entry (the usual program: 0.2 GB in 1e6 rows)."""
    if len(index) and np.all(index == index[0]):
        return np.broadcast_to(table[index[0]], (len(index), *table.shape[1:]))
    picked = table[index]
    picked.setflags(write=False)
    return picked


def _word(section: Section, key: str) -> str:
    text = section.text(key).strip()
    if not text:
        raise section.error("YML004", "is empty", key)
    return text


def _force(top: Section) -> str | None:
    if "force" not in top:
        return None
    if top.is_list("force"):
        raise top.error("YML004", "must be a text, not a list", "force", "for example force: 0,360,560@base")
    return _word(top, "force")


def _positive(section: Section, key: str, default: float, unit: str) -> float:
    value = section.number(key, default, unit=unit)
    if value <= 0:
        raise section.error("YML004", f"{value:g} is not above 0", key, f"a number in {unit}, above 0")
    return value


def _numbered(top: Section, key: str) -> list[tuple[int, Section]]:
    """The sections under ``key`` by number, which counts from 1."""
    parent = top.section(key, None)
    found = []
    for name in parent:
        if not _NUMBER.match(name):
            raise parent.error("YML004", "is not a number from 1", name, f"{key} are numbered: 1, 2, ...")
        found.append((int(name), parent.section(name)))
    return found


def _frame(section: Section, *more: str) -> Poses:
    """The pose of a section with x y z [mm] and perhaps a b c [deg]."""
    section.only(*_POSE_KEYS, *more)
    position = np.array([section.number(key, unit="mm") for key in "xyz"]) * MM
    abc = np.array([section.number(key, 0.0, unit="deg") for key in "abc"]) * DEG
    pose = Poses.from_abc(position, abc)
    return Poses(frozen(pose.rotation, (3, 3)), frozen(pose.position, (3,)))


def _robot_base(top: Section) -> Poses:
    return _frame(top.section("robot_base")) if "robot_base" in top else Poses.identity()


def _start(top: Section) -> Floats | None:
    """Six values, or seven for an arm with an external joint."""
    if "start" not in top:
        return None
    return frozen(top.numbers("start", 7 if top.length("start") == 7 else 6, unit="deg"))


def _orientation(top: Section) -> Floats | None:
    if "orientation" not in top:
        return None
    section = top.section("orientation")
    section.only("a", "b", "c")
    return frozen([section.number(key, 0.0, unit="deg") * DEG for key in "abc"], (3,))


def _tool(section: Section) -> Tool:
    pose = _frame(section, "axis", "mass", "com")
    if ("mass" in section) != ("com" in section):
        there, absent = ("mass", "com") if "mass" in section else ("com", "mass")
        raise section.error(
            "YML003", f"stands without {absent!r}", there, "a payload needs mass (kg) and com (mm)"
        )
    if "mass" not in section:
        return Tool(pose, _axis(section))
    com = frozen(np.array(section.numbers("com", 3, unit="mm")) * MM, (3,))
    return Tool(pose, _axis(section), section.number("mass", low=0.0, unit="kg"), com)


def _axis(section: Section) -> Floats:
    """Unit vector (3,) of ``axis``: a signed letter, or three numbers of any length."""
    if section.is_list("axis"):
        vector = np.array(section.numbers("axis", 3))
        largest = np.max(np.abs(vector))
        if largest == 0:
            raise section.error("YML004", "has no direction", "axis")
        vector /= largest  # squares of very large or small numbers leave the range
        return frozen(vector / np.linalg.norm(vector), (3,))
    word = section.text("axis", "+z").strip().lower()
    if word not in AXES:
        # no nearest name: z is as near to -z as to +z, and the wrong one turns the force round
        allowed = ", ".join(AXES)
        raise section.error("YML004", f"{word!r} is not one of {allowed}, nor a list [x, y, z]", "axis")
    return frozen(AXES[word], (3,))
