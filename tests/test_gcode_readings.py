"""Small programs of G-code beside all that is read of them: every motion with its modes, every finding in full; and
beside what their blocks state, as numbers that may be written anew.

A file holds the control (and how the cell reads it), the program, a line of dashes, and the reading.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from postproc.base.arrays import Floats
from postproc.base.document import Document
from postproc.base.geometry import abc_from_rotation
from postproc.base.units import DEG, MM
from postproc.languages.dialect import Program, ReadingSettings, WritingSettings
from postproc.languages.gcode import DIALECTS
from postproc.languages.gcode.control import Feed
from postproc.languages.gcode.writer_text import stated
from postproc.toolpath import Kind

PROGRAMS = Path(__file__).parent / "programs"
CASES, STATED = (sorted((PROGRAMS / name).glob("*.txt")) for name in ("readings", "stated"))
NAMES = {dialect.name: dialect for dialect in DIALECTS}
DOWN = np.array([0.0, 0.0, np.pi])
RULE = "--------\n"


def read(head: str, text: str) -> Program:
    name, *words = head.split()
    orientation = None if "unoriented" in words else DOWN
    integers = next((word for word in ("um", "undecided") if word in words), "mm").replace("undecided", "")
    settings = ReadingSettings(orientation=orientation, options={"integer_words": integers})
    return NAMES[name].read((Document(Path("part.nc"), text.encode("latin-1")),), settings)


def number(value: float) -> str:
    return "?" if np.isnan(value) else f"{round(value, 4) + 0.0:g}"


def letters(names: str, values: Floats) -> str:
    return " ".join(f"{name}{number(value)}" for name, value in zip(names, values, strict=True))


def reading(program: Program) -> Iterator[str]:
    path, text = program.toolpath, program.text
    for row in range(len(path)):
        said = [f"{path.line[row]} {Kind(path.kind[row]).name}", letters("XYZ", path.position[row] / MM)]
        if np.isnan(path.rotation[row, 0, 0]):
            said.append("ABC?")
        elif text.orient[row] >= 0:
            said.append(letters("ABC", abc_from_rotation(path.rotation[row]) / DEG))
        if np.isfinite(path.arcs.sweep[row]):
            centre, normal = path.arcs.centre[row] / MM, path.arcs.normal[row]
            said.append(
                f"arc {letters('XYZ', centre)} {letters('UVW', normal)} {number(path.arcs.sweep[row] / DEG)}deg"
            )
        if text.orient[row] >= 0:
            ways = "written" if path.constraints.orientation_programmed[row] else "kept"
            said.append(f"{letters('abc', text.turned_values[row])} {ways}")
            said.append(f"from {letters('abc', text.turned_before[row])}")
            if np.isfinite(path.orientation_control.redundant_axis[row, 0]):
                said.append(f"about {letters('xyz', path.orientation_control.redundant_axis[row])}")
        said.append(f"F{number(path.feed[row] / MM * 60)}")
        for letter, index in (("G", path.base[row]), ("T", path.tool[row])):
            frame = path.frames[index] if index >= 0 else None
            said.append(f"{letter}{frame.number if frame else '?'}{'w' if frame and frame.pose else ''}")
        said.append(f"from {letters('XYZ', text.start_position[row] / MM)}")
        said.append(f"blend {number(path.approximation[row] / MM)}" if path.approximation[row] > 0 else "")
        said.append("exact" if path.approximation[row] == 0 else "")
        said.append({0: "", 1: "G18", 2: "G19"}.get(int(text.plane[row]), "plane?"))
        said.append("G91" if text.incremental[row] else "")
        said.append("centres absolute" if text.arc_absolute[row] else "")
        said.append("any plane" if path.arcs.plane_free[row] and path.kind[row] == Kind.CIRC else "")
        if text.scale[row] != MM or text.increment[row] != MM:
            said.append(f"unit {number(text.scale[row] / MM)} {number(text.increment[row] / MM)}")
        if text.frame[row]:
            said.append(f"frame {letters('XYZ', text.frames.position[text.frame[row]] / MM)}")
        if text.feed_mode[row] != Feed.PER_MINUTE:
            said.append(f"feed {text.feed_mode[row]}")
        said.append("timed" if path.inverse_time_feed[row] else "")
        yield " ".join(word for word in said if word)
        for name in ("refused", "locked"):
            finding = getattr(path.constraints, name).get(row)
            if finding:
                yield f"  {name} {finding.code} {finding.line}:{finding.column} {finding.message}"
        if row in path.constraints.no_insert_before:
            yield f"  whole: {path.constraints.no_insert_before[row]}"
    for note in path.annotations:
        yield f"speaks before {note.row} line {note.line}: {note.text}"
    for note in path.comments:
        yield f"comment before {note.row} line {note.line}: {note.text}"
    yield f"mark {program.marker_at.start}" + (f" in place of {program.marker}" if program.marker else "")
    for finding in program.findings:
        yield f"{finding.code} {finding.line}:{finding.column} {finding.message}"
        yield f"  {finding.advice}"


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_a_program_reads_as_said(path: Path) -> None:
    program, expected = path.read_text(encoding="latin-1").split(RULE)
    head, text = program.split("\n", 1)
    assert list(reading(read(head, text))) == expected.splitlines()


def blocks(program: Program) -> Iterator[str]:
    """Of every column its address and number (r: an increment), the digits with which it is written (r: an increment
    where it is not there yet), and what stands there; the word of the motion, and what is behind the last word."""
    part = program.text.part(0, len(program.toolpath))
    text, words, raw = stated(part, WritingSettings(mm=3, deg=2)), part.text.words, part.raw
    for row in range(len(part)):
        said = []
        for column, key in enumerate(text.keys[row].tolist()):
            value, relative = text.value[row, column], text.relative[row, column]
            mode = f".{text.decimals[row, column]}{'r' * bool(text.modal[row, column])}"
            name = "-" if key < 0 else chr(key & 0xFF) + (f"{key // 256 - 1}=" if key > 255 else "")
            number = "" if np.isnan(value) else f"{value:.12g}{'r' * bool(relative)}"
            k = int(text.word[row, column])
            literal = raw[words.start[k] : words.stop[k]].decode() if k >= 0 else ""
            said.append(f"{name}{number}{mode}" + (f"<{literal}>" if k >= 0 else ""))
        verb = part.verb[row]
        said.append(raw[words.at[verb] : words.stop[verb]].decode() if verb >= 0 else "inherited")
        said += [f"turns {text.turns[row]}"] * bool(text.turns[row]) + ["through"] * bool(text.through[row])
        stop = part.text.blocks.stop[part.block[row]]
        said.append(f"before {raw[part.insert[row] : stop].decode()!r}")
        yield f"{program.toolpath.line[row]} " + " ".join(said)


@pytest.mark.parametrize("path", STATED, ids=lambda path: path.stem)
def test_blocks_state_what_is_said(path: Path) -> None:
    program, expected = path.read_text(encoding="latin-1").split(RULE)
    head, text = program.split("\n", 1)
    assert list(blocks(read(head, text))) == expected.splitlines()
