"""What a measured part says of its tools and its base: lines for the cell, and what to check or set."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime

from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.cell import Cell
from postproc.cell.tool_errors import OTHERS, SIZES, WALL_SIDES, ToolError
from postproc.learning.attribution import Attribution
from postproc.learning.causes import Cause
from postproc.learning.measured_part import MeasuredPart
from postproc.learning.measured_walls import MeasuredWalls
from postproc.robot.description import COVERAGE
from postproc.workflows.learn_robot import is_observed

_BASE_AXES = dict(zip("xyzuvw", ("X", "Y", "Z", "X", "Y", "Z"), strict=True))


def _measured(result: Attribution, group: str) -> Iterator[tuple[Cause, float, float]]:
    """Causes of a group, each with what was learnt and its standard deviation, in its own unit."""
    every = zip(result.causes, result.x.tolist(), result.deviations.tolist(), strict=True)
    return (one for one in every if one[0].group == group)


def tool_errors(result: Attribution, cell: Cell, walls: MeasuredWalls) -> dict[int, ToolError]:
    """The tools of the cell and of the part, with all that was learnt of them."""
    errors = dict(cell.tool_errors)
    for cause, value, _ in _measured(result, "tool"):
        number = int(cause.place.split()[-1])
        known = errors.get(number, ToolError())
        known = replace(known, walls={**known.walls, **walls.of(number)})
        size = cause.value + value
        errors[number] = (
            replace(known, radius=size) if cause.parameter == "radius" else replace(known, length=size)
        )
    return errors


def tool_error_lines(
    result: Attribution, parts: Sequence[MeasuredPart], cell: Cell, measured: MeasuredWalls
) -> bytes:
    """``tool_errors:`` for the cell; those of ``cell`` are in it; empty where the part shows nothing of a tool."""
    entries: dict[int, list[str]] = {}
    walls: dict[int, Mapping[str, int]] = {}
    observed = False
    for number, error in sorted(tool_errors(result, cell, measured).items()):
        stated = cell.tool_errors.get(number, ToolError())
        known = {name: (getattr(stated, name), getattr(stated, f"{name}_ci95")) for name in SIZES}
        learnt = {name for name, one in known.items() if one != (0.0, None)}
        for cause, value, deviation in _measured(result, "tool"):
            if cause.place == f"tool {number}" and is_observed(cause, value, deviation):
                known[cause.parameter] = cause.value + value, COVERAGE * deviation
                learnt.add(cause.parameter)
                observed = True
        words = []
        for name in SIZES:
            size, ci95 = known[name]
            if name in learnt:
                words.append(f"{name}: {size / MM:.5f}")
                words += [] if ci95 is None else [f"{name}_ci95: {ci95 / MM:.5f}"]
        if words:
            entries[number], walls[number] = words, error.walls if "radius" in learnt else {}
    if not observed:
        return b""
    names = {side: name for name, side in WALL_SIDES.items()}
    today = datetime.now(UTC).date().isoformat()
    lines = [
        f"# learnt from {', '.join(part.file.name for part in parts)}, {today}. Measure these tools: either set radius",
        "# and length where control and CAM have them, or add these lines to the cell file; never both. mm by which a",
        "# tool is larger and longer than programmed, with 95 % half widths; walls: side of the feed on which the wall",
        "# lies, seen along the spindle towards its tip, by operation or `others`; none: it cuts no wall.",
        "tool_errors:",
    ]
    for number, words in entries.items():
        sides_of = ", ".join(f'"{name}": {names[side]}' for name, side in sorted(walls[number].items()))
        lines.append(
            f"  {number}: {{{', '.join(words)}" + (f", walls: {{{sides_of}}}}}" if sides_of else "}")
        )
        if not any("radius:" in word for word in words):
            continue
        own = measured.operations.get(number, frozenset())
        several = own & (measured.both | measured.leaning)
        if several:
            quoted = ", ".join(f'"{name}"' for name in sorted(several))
            lines.append(
                f"  # no one side is right for these, with walls on both or surfaces that lean: {quoted}"
            )
        open_ones = own - set(walls[number]) - several
        if open_ones and OTHERS not in walls[number]:
            rest = ", ".join(f'"{name}": none' for name in sorted(open_ones))
            lines.append(f"  # no wall was measured of these: if they cut none, add to walls: {rest}")
    return ("\n".join(lines) + "\n").encode()


def tool_and_base_findings(result: Attribution, file: str, lines: str) -> list[Finding]:
    """Tools and bases that differ from what is programmed by more than a standard deviation: probably, or surely where
    the interval excludes none; ``lines``: file of the lines for the cell."""
    findings = []
    for cause, value, deviation in _measured(result, "tool"):
        total, width = (cause.value + value) / MM, COVERAGE * deviation / MM
        if abs(total) * MM <= deviation or not is_observed(cause, value, deviation):
            continue
        more = {"radius": ("larger", "smaller"), "length": ("longer", "shorter")}[cause.parameter][total < 0]
        word = "" if abs(total) > width else "probably "
        size = f"{abs(total):.3f} +- {width:.3f} mm ({cause.parameter})"
        message = f"{cause.place} is {word}{more} than programmed by {size}"
        help = f"measure it and set it in control and CAM, or add the lines of {lines} to the cell; not both"
        findings.append(Finding("LRN018", message, file, help=help))
    for cause, value, deviation in _measured(result, "base"):
        if abs(value) <= deviation or not is_observed(cause, value, deviation):
            continue
        turn = cause.unit == "rad"
        unit, name = (DEG, "deg") if turn else (MM, "mm")
        axis, digits = _BASE_AXES[cause.parameter], 4 if turn else 3
        word = "" if abs(value) > COVERAGE * deviation else "probably "
        size = f"{value / unit:+.{digits}f} +- {COVERAGE * deviation / unit:.{digits}f} {name}"
        message = f"the part was {word}cut {'turned about' if turn else 'shifted along'} {axis} of its base by {size}"
        help = "touch the base off again; the next program corrects it at this place, no other program does"
        findings.append(Finding("LRN018", message, file, help=help))
    return findings
