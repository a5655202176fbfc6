"""What the comments above the header state: ``# key: value``."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal, nearest
from postproc.base.geometry import Poses
from postproc.base.tables import CsvTable, comments_above, finite_number, mixes_decimals
from postproc.base.units import DEG, MM

KEYS = ("robot", "frame", "tool", "sigma_mm", "sigma_deg", "target", "base_target")
TARGETS = ("target", "base_target")
FRAMES = ("tracker", "robot")

METRES = 2.0
"""[mm] A tool or a target whose largest coordinate is below it was written in metres: none is farther than 2 m."""
SCATTER = 3.0
"""[mm] No device that measures a robot scatters by more."""

# the name of a target may hold a colon, numbers do not
_TARGET = re.compile(r"((?:base_)?target)(\s.*|\s*)[:=]([^:=]*)", re.IGNORECASE)
_KEYED = re.compile(r"([^:=]*+)[:=]\s*+(.*)")
_CLOSE = 0.75  # of difflib's ratio: sigma is close to sigma_mm, load is not close to tool


@dataclass(frozen=True)
class HeaderComments:
    """What the comments state, in SI; ``frame`` is "" and ``sigma`` NaN where not stated; ``places``: name of a target
    -> its place (3,) [m] on the flange, of those ``on_base`` in the robot base; ``lines``: name of a target -> line."""

    robot: str
    frame: str
    tool: Poses | None
    sigma: float
    sigma_turn: float | None
    places: dict[str, Floats]
    on_base: frozenset[str]
    lines: dict[str, int]
    findings: list[Finding]


def robot_named(path: Path) -> str:
    """The ``# robot:`` of a file, "" where it has none; the rest of the file may be wrong.

    Raises Refusal FIL001 (not readable), FIL003 (binary).
    """
    stated = (_keyed(text) for _, text in comments_above(path))
    return next((value for key, _, value in stated if key == "robot"), "")


def stated_in(table: CsvTable) -> HeaderComments:
    """Raises Refusal where a key occurs twice, or its value cannot be used."""
    values, findings = _stated(table)

    def named(key: str) -> str:
        line, text = values.get((key, ""), (0, ""))
        if line and not text:
            raise _wrong(table, line, f"# {key}: the name is missing")
        return text

    def numbers(key: str, counts: tuple[int, ...], form: str, name: str = "") -> list[float]:
        if (key, name) not in values:
            return []
        line, text = values[key, name]
        parsed = _numbers(text.replace(",", ".") if counts == (1,) else text)
        if parsed is not None and len(parsed) in counts:
            return parsed
        what = f"{text[:40]!r} is not understood" if parsed is None else f"{len(parsed)} numbers are given"
        help = "separate the numbers by blanks; a comma in a number is a decimal comma then, in all of them"
        raise _wrong(table, line, f"# {_title(key, name)}: {what} where {form} is expected", help)

    def sigma(key: str, unit: float) -> float | None:
        given = numbers(key, (1,), "one number without a unit")
        if given and given[0] <= 0:
            raise _wrong(table, values[key, ""][0], f"# {key}: {given[0]:g} is not above zero")
        return given[0] * unit if given else None

    tool = numbers("tool", (3, 6), "x y z [a b c] (mm, deg)")
    robot, frame = named("robot"), named("frame").lower()
    if frame and frame not in FRAMES:
        message = f"# frame: {frame[:40]!r} is not a frame{nearest(frame, FRAMES)}"
        raise _wrong(table, values["frame", ""][0], message, "use one of " + ", ".join(FRAMES))
    sigma_place, sigma_turn = sigma("sigma_mm", MM), sigma("sigma_deg", DEG)
    lines = {name: line for (key, name), (line, _) in values.items() if key in TARGETS}
    of_base = {name: text for (key, name), (_, text) in values.items() if key == "base_target"}
    for name in of_base:
        if ("target", name) in values:
            raise _wrong(table, lines[name], f"{name!r} is both a target and a base_target")
    stated = {
        name: "base_target" if name in of_base else "target" for name in lines if of_base.get(name) != ""
    }
    placed = {("tool", ""): tool[:3]}
    placed |= {(key, name): numbers(key, (3,), "x y z (mm)", name) for name, key in stated.items()}
    for key, place in placed.items():
        if place:
            findings += in_metres(f"# {_title(*key)}", place, str(table.path), values[key][0])
    if sigma_place is not None and sigma_place > SCATTER * MM:
        line = values["sigma_mm", ""][0]
        message = f"# sigma_mm: the scatter is {sigma_place / MM:g} mm, as if it were in micrometres"
        findings.append(Finding("MEA014", message, str(table.path), line, help="lengths are in mm"))
    return HeaderComments(
        robot=robot,
        frame=frame,
        tool=Poses.from_abc(np.array(tool[:3]) * MM, np.array(tool[3:] or [0.0] * 3) * DEG) if tool else None,
        sigma=np.nan if sigma_place is None else sigma_place,
        sigma_turn=sigma_turn,
        places={name: np.array(place) * MM for (_, name), place in placed.items() if name},
        on_base=frozenset(of_base),
        lines=lines,
        findings=findings,
    )


def _stated(table: CsvTable) -> tuple[dict[tuple[str, str], tuple[int, str]], list[Finding]]:
    """(key, name of a target) -> line, value; and the comments that look like keys, but are not used (MEA004)."""
    values: dict[tuple[str, str], tuple[int, str]] = {}
    findings: list[Finding] = []
    for line, text in table.comments:
        key, name, value = _keyed(text)
        uncertainty = help = ""
        if line > table.header_line:
            if key in KEYS:
                uncertainty = f"# {key}: is below the header and is ignored"
                help = "move it above the header; it applies to the whole file"
        elif key not in KEYS:
            uncertainty = _almost_a_key(text, key, value)
            help = "write # key: value with one of " + ", ".join(KEYS)
        elif (key, name) in values:
            raise _wrong(table, line, f"# {_title(key, name)} occurs in line {values[key, name][0]} already")
        elif key in TARGETS and not name:
            where = "on the flange" if key == "target" else "robot base"
            raise _wrong(
                table,
                line,
                f"# {key}: the name of the target is missing",
                f"write # {key} NAME: x y z (mm, {where})",
            )
        else:
            values[key, name] = line, value
        if uncertainty:
            findings.append(Finding("MEA004", uncertainty, str(table.path), line, help=help))
    return values, findings


def _keyed(text: str) -> tuple[str, str, str]:
    """Key in lower case, name of a target and value of ``key: value`` or ``target NAME: value``, "" without."""
    text = text.lstrip("# \t")
    target = _TARGET.fullmatch(text)
    if target:
        return target[1].lower(), target[2].strip(), target[3].strip()
    keyed = _KEYED.fullmatch(text)
    return (keyed[1].rstrip().lower(), "", keyed[2].strip()) if keyed else ("", "", "")


def _almost_a_key(text: str, key: str, value: str) -> str:
    """What is odd about a comment that was probably meant to state something, or ""."""
    if key:
        first, whole = key.partition(" ")[0], "_".join(key.split())
        if _close(whole):
            return f"{key[:40]!r} is not a key{nearest(whole, KEYS)}"
        if _close(first) not in ("", "robot", "frame") and _numbers(value):
            return f"{key[:40]!r} is not a key{nearest(first, KEYS)}"
        return ""
    first, *others = text.lower().split() or [""]
    stated = others and (first == "frame" or finite_number(others[-1]) is not None)
    return f"{text[:40]!r} has no colon after its key" if first in KEYS and stated else ""


def _close(word: str) -> str:
    """The key that ``word`` is, or differs from by a typing error, or ""."""
    return next(iter(difflib.get_close_matches(word, KEYS, 1, _CLOSE)), "")


def _numbers(text: str) -> list[float] | None:
    """Numbers separated by blanks, commas or semicolons; a comma is a decimal comma where blanks or semicolons
    separate.  None where one is no number, commas do both, or decimals are after commas and points."""
    beside_blank = ";" not in text and re.search(r",\s|\s,", text)
    if beside_blank and re.search(r"\S,\S", text):
        return None
    by_commas = beside_blank or not re.search(r"[;\s]", text)
    words = re.split(r"[,\s]+" if by_commas else r"[;\s]+", text)
    if mixes_decimals(words):
        return None
    words = [word.replace(",", ".") for word in words]
    numbers = [number for number in map(finite_number, words) if number is not None]
    return numbers if len(numbers) == len(words) else None


def _title(key: str, name: str) -> str:
    return f"{key} {name}".rstrip()


def in_metres(
    what: str, place: Sequence[float], file: str, line: int = 0, least: float = METRES
) -> list[Finding]:
    """MEA014 for a ``place`` (3,) [mm] that is nearer to its origin than ``least`` [mm]: it was written in metres."""
    largest = max(map(abs, place))
    if not 0.0 < largest < least:
        return []
    message = f"{what}: its largest coordinate is {largest:g} mm, as if it were in metres"
    return [Finding("MEA014", message, file, line, help="lengths are in mm")]


def _wrong(table: CsvTable, line: int, message: str, help: str = "") -> Refusal:
    return Refusal(Finding(table.code, message, str(table.path), line, help=help))
