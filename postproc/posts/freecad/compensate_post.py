"""FreeCAD post-processor: what ``linuxcnc_post`` posts, compensated for the deflection of the robot.

``compensate posts freecad -o FOLDER`` puts this file into FreeCAD's macro folder; then ``compensate`` is one of a job's
post-processors.  The posted program goes to ``uncompensated/`` beside the output, with a process file of what its
operations cut, and the command ``compensate`` writes the output.  Where anything fails the output does not exist.  It
runs in FreeCAD's Python (0.20 and 0.21; later ones do not state the output file to a post) and needs nothing but the
command; ``cell.yaml`` is looked for beside the output and above.  ``--inches``, ``--precision`` and other arguments are
passed on to ``linuxcnc_post``.
"""

from __future__ import annotations

import argparse
import importlib
import json
import math
import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import FreeCAD

try:
    import linuxcnc_post
except ImportError:  # not loaded by FreeCAD's loader of posts, which puts their folder on the path
    from PathScripts.post import linuxcnc_post
else:
    linuxcnc_post = importlib.reload(linuxcnc_post)  # it keeps the arguments of the last job

UNITS = "G21"
MACHINE_NAME = "robot"
FOLDER = "uncompensated"
DIRECTIONS = {"Climb": "down", "Conventional": "up"}
ONE_WAY = ("Offset",)
"""Patterns whose passes all have the material on the side that ``CutMode`` states; the others go back and forth."""
PATTERNS = ("OffsetPattern", "ClearingPattern", "CutPattern")
"""Properties that state the pattern, by kind of operation and version of FreeCAD."""
FLAT_TOOLS = ("endmill",)
"""Shapes of tools that cut as the process file says: with their whole diameter at every depth."""
UNIT_CODES = {"20": 25.4, "21": 1.0}
"""G code -> mm."""
MOTION_CODES = ("0", "1", "2", "3", "33.1", "38.2", "73", "74", *map(str, range(80, 90)))
"""G codes of which one is in force: motions, and cycles, whose coordinates are those of a hole."""
SAME = 1e-6
"""[mm] Heights nearer than this are one."""
_WORD = re.compile(r"([A-Z])\s*([-+]?[0-9.]+)")

TOOLTIP = __doc__


class _ArgumentParser(argparse.ArgumentParser):
    def error(self, message: str) -> Any:
        """Raises ValueError: a wrong argument must not end FreeCAD."""
        raise ValueError(f"{message}; the arguments of this post-processor are:\n{self.format_help()}")


parser = _ArgumentParser(prog="compensate", add_help=False, allow_abbrev=False)
parser.add_argument("--compensate", default="compensate", metavar="COMMAND", help="the command or its path")
parser.add_argument("--cell", help="the cell file [the nearest cell.yaml]")
parser.add_argument("--robot", help="use this robot instead of the cell's")
parser.add_argument("--gain", help="share of the correction that is applied [1]")
parser.add_argument(
    "--force",
    nargs="?",
    const="",
    help="a force as of the command (0,360,560@base), instead of one that follows from the operations; without a value"
    " that of the cell",
)
parser.add_argument("--material", help="of the part, by its name in the table of materials")
parser.add_argument("--helix", type=float, help="angle of the cutter's edges, deg")
parser.add_argument("--teeth", type=int, help="number of the cutter's edges [Flutes of the tool]")
parser.add_argument(
    "--cut",
    action="append",
    default=[],
    metavar="LABEL=DIRECTION,WIDTH",
    help="how an operation cuts that does not state it: down, up or slot, and its radial width in mm",
)
TOOLTIP_ARGS = parser.format_help()


class Cut(NamedTuple):
    """A stretch of the posted program at one height: first and last line, axial depth [mm]."""

    first: int
    last: int
    depth: float


def export(objectslist: list[Any], filename: str, argstring: str) -> str:
    """Post and compensate: the text of the output.  Raises RuntimeError, from the ValueError or OSError that says what
    is wrong; then there is no ``filename``."""
    target = Path(filename).absolute()
    try:
        if filename == "-":
            raise ValueError(
                "the output needs a file name: set the output file of the job (FreeCAD 0.20 and 0.21);"
                " later versions state none: post with linuxcnc_post into a folder that compensate watch looks at"
            )
        target.unlink(missing_ok=True)
        options, others = parser.parse_known_args(shlex.split(argstring or ""))
        posted = target.parent / FOLDER / target.name
        lines = _post(objectslist, posted, others).split("\n")
        force = options.force
        if force is None:
            cuts = list(_process_rows(objectslist, lines, options))
            force = str(_write_process(cuts, posted))
        return _compensate(posted, target, force, options)
    except Exception as error:
        if filename != "-":
            target.unlink(missing_ok=True)
        message = f"compensate: {target.name} is not posted: {error}"
        FreeCAD.Console.PrintError(message + "\n")
        raise RuntimeError(message) from error


def _post(objectslist: list[Any], posted: Path, others: list[str]) -> str:
    if "--no-comments" in others:
        raise ValueError(
            "--no-comments is not possible: comments state which lines belong to which operation"
        )
    posted.parent.mkdir(parents=True, exist_ok=True)
    posted.unlink(missing_ok=True)
    words = " ".join(shlex.quote(word) for word in [*others, "--no-show-editor"])
    try:
        text = linuxcnc_post.export(objectslist, str(posted), words)
    except SystemExit:  # its parser of arguments would end FreeCAD
        text = None
    if text is None or not posted.exists():
        raise ValueError(f"linuxcnc_post does not take the job or the arguments {words}")
    return str(text)


def _compensate(posted: Path, target: Path, force: str, options: Any) -> str:
    command = shutil.which(options.compensate)
    words = [command] if command else shlex.split(options.compensate)
    words += [str(posted), f"--force={force}", "-o", str(target), "--report", str(posted.parent)]
    for name in ("cell", "robot", "gain"):
        value = getattr(options, name)
        words += [] if value is None else [f"--{name}", value]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONHOME"}  # FreeCAD's own
    try:
        done = subprocess.run(words, env=environment, capture_output=True, check=False)
    except OSError as error:
        raise ValueError(f"{words[0]!r} does not start ({error}): state its path by --compensate") from error
    printed = (done.stdout + done.stderr).decode("utf-8", "replace")
    if done.returncode not in (0, 3) or not target.exists():
        raise ValueError(f"the exit code of the command is {done.returncode}:\n{printed}")
    console = FreeCAD.Console
    (console.PrintWarning if done.returncode else console.PrintMessage)(printed)
    return target.read_bytes().decode("utf-8", "replace")


def _process_rows(objectslist: list[Any], lines: list[str], options: Any) -> Iterator[str]:
    """The operations of the process file.  Raises ValueError where the job does not state what one cuts."""
    stated = dict(_stated_cut(words) for words in options.cut)
    operations = list(_operations(objectslist, lines))
    labels = [label for label, *_ in operations]
    for label in stated:
        if label not in labels:
            raise ValueError(
                f"--cut {label!r}: the program has no such operation; it has {', '.join(labels)}"
            )
    for label, obj, first, last in operations:
        cuts = list(_levels(lines, first, last, obj))
        if not cuts:
            FreeCAD.Console.PrintWarning(
                f"compensate: {label} cuts nothing at one height: it is not corrected\n"
            )
            continue
        edges = _edges(label, obj, options)
        direction, width = stated.get(label) or _direction_and_width(label, obj, edges["diameter"])
        edges.update(
            {"direction": direction} if width is None else {"direction": direction, "radial_width": width}
        )
        for cut in cuts:
            row = {"lines": [cut.first, cut.last], "axial_depth": round(cut.depth, 6), **edges}
            yield f"  - {json.dumps(row)}  # {' '.join(label.split())}"


def _write_process(rows: list[str], posted: Path) -> Path:
    if not rows:
        raise ValueError("no operation cuts at one height: state a force, --force 0,360,560@base")
    path = posted.with_name(f"{posted.stem}.process.yaml")
    path.write_text("\n".join(["operations:", *rows, ""]), encoding="utf-8")
    return path


def _operations(objectslist: list[Any], lines: list[str]) -> Iterator[tuple[str, Any, int, int]]:
    """Label, object and indices of the first and last line of every operation with a tool that is in the program."""
    at = 0
    for obj in objectslist:
        if not getattr(obj, "Active", True) or not getattr(getattr(obj, "Base", None), "Active", True):
            continue
        ends = []
        for word in ("begin", "finish"):
            comment = f"({word} operation: {obj.Label})"
            at = next((k for k in range(at, len(lines)) if lines[k].endswith(comment)), -1)
            if at < 0:
                raise ValueError(
                    f"the posted program has no comment {comment}: give the operation a plain label"
                )
            ends.append(at)
        if _property(obj, "ToolController") is not None:
            yield obj.Label, obj, ends[0], ends[1]


def _levels(lines: list[str], first: int, last: int, obj: Any) -> Iterator[Cut]:
    """Stretches of straight and circular cuts at one height.  Each takes what is between it and the height before,
    ``StartDepth`` first, and at most ``StepDown``; a motion above ``StartDepth`` or to another height is no cut."""
    top, step = _length(obj, "StartDepth"), _length(obj, "StepDown")
    height, depth, stretch = top, 0.0, None  # of the last cut, and its lines
    for index, start, end in _feed_motions(lines[: last + 1]):
        if index < first or start[:2] == end[:2]:
            continue
        flat = abs(end[2] - start[2]) < SAME and (top is None or end[2] < top - SAME)
        if stretch and not (flat and height is not None and abs(end[2] - height) < SAME):
            yield Cut(stretch[0] + 1, stretch[1] + 1, depth)
            stretch = None
        if not flat:
            continue
        if stretch is None:
            stretch = [index, index]
            above = top if height is None or end[2] > height + SAME else height
            if above is not None and above - end[2] > SAME:
                depth = above - end[2]
            depth = min(depth or step or 0.0, step or depth)
            if depth <= 0:
                raise ValueError(f"{obj.Label} has neither a start depth above its cuts nor a step down")
            height = end[2]
        stretch[1] = index
    if stretch:
        yield Cut(stretch[0] + 1, stretch[1] + 1, depth)


def _feed_motions(lines: list[str]) -> Iterator[tuple[int, tuple[float, ...], tuple[float, ...]]]:
    """Index, start and end [mm] of every G1, G2 and G3; NaN where a coordinate was never programmed."""
    place, motion, unit = {"X": math.nan, "Y": math.nan, "Z": math.nan}, "", 1.0
    for index, line in enumerate(lines):
        words = _WORD.findall(re.sub(r"\(.*?\)", "", line))
        codes = [value.lstrip("0") or "0" for letter, value in words if letter == "G"]
        unit = next((UNIT_CODES[code] for code in codes if code in UNIT_CODES), unit)
        motion = next((code for code in codes if code in MOTION_CODES), motion)
        start = tuple(place.values())
        place.update((letter, float(value) * unit) for letter, value in words if letter in place)
        moved = any(letter in "XYZIJ" for letter, _ in words)
        if moved and motion in ("1", "2", "3"):
            yield index, start, tuple(place.values())


def _edges(label: str, obj: Any, options: Any) -> dict[str, Any]:
    """Keys of the process file that belong to tool and material."""
    control = _property(obj, "ToolController")
    tool = control.Tool
    shape = str(getattr(tool, "ShapeType", None) or getattr(tool, "ShapeName", None) or FLAT_TOOLS[0])
    if shape.lower().rstrip("0123456789") not in FLAT_TOOLS:  # FreeCAD numbers what it has open already
        raise ValueError(
            f"the force of {label} is known for flat end mills, and its tool is a {shape}: state --force"
        )
    teeth = options.teeth or int(getattr(tool, "Flutes", 0) or 0)
    speed = float(control.SpindleSpeed)
    missing = [
        words
        for words, value in (
            ("--material, the part's", options.material),
            ("--helix, the angle of the cutter's edges", options.helix),
            ("--teeth, or Flutes of the tool", teeth),
            ("the spindle speed of its tool controller", speed > 0),
        )
        if value in (None, "", 0, False)
    ]
    if missing:
        raise ValueError(f"the force of {label} is not known without: {'; '.join(missing)}; or state --force")
    if getattr(control, "SpindleDir", "Forward") != "Forward":
        raise ValueError(f"the spindle of {label} does not turn forward: state --force")
    diameter = tool.Diameter
    return {
        "diameter": round(float(getattr(diameter, "Value", diameter)), 6),
        "teeth": teeth,
        "helix": options.helix,
        "spindle": speed,
        "material": options.material,
    }


def _direction_and_width(label: str, obj: Any, diameter: float) -> tuple[str, float | None]:
    share, mode = _property(obj, "StepOver"), _property(obj, "CutMode")
    pattern = next((value for name in PATTERNS if (value := _property(obj, name)) is not None), None)
    help = f'state it in the arguments, --cut "{label}=down,{0.4 * diameter:g}" (down, up or slot; mm), or --force'
    if pattern is not None and pattern not in ONE_WAY:
        raise ValueError(
            f"{label} cuts back and forth ({pattern}): choose the pattern {ONE_WAY[0]}, or {help}"
        )
    if share is None or mode not in DIRECTIONS:
        raise ValueError(f"{label} does not state its direction and radial width: {help}")
    share = float(getattr(share, "Value", share)) / 100.0
    return ("slot", None) if share >= 1.0 else (DIRECTIONS[mode], round(share * diameter, 6))


def _stated_cut(words: str) -> tuple[str, tuple[str, float | None]]:
    label, equal, value = words.rpartition("=")
    direction, _, width = value.partition(",")
    if not equal or direction not in ("down", "up", "slot") or bool(width) == (direction == "slot"):
        raise ValueError(f"--cut {words!r}: write LABEL=down,WIDTH or LABEL=up,WIDTH or LABEL=slot")
    return label, (direction, float(width) if width else None)


def _length(obj: Any, name: str) -> float | None:
    value = _property(obj, name)
    return None if value is None else float(getattr(value, "Value", value))


def _property(obj: Any, name: str) -> Any:
    """Of the operation, or of that below its dress-ups; None where it has none."""
    while obj is not None and not isinstance(obj, (list, tuple)):
        if hasattr(obj, name):
            return getattr(obj, name)
        obj = getattr(obj, "Base", None)
    return None
