"""A robot file with new values: the old file's text, edited where something changed and nowhere else.

Comments, blank lines, entries and parameters that did not change are copied; the result is read back before it is
handed out.
"""

from __future__ import annotations

import codecs
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_DOWN, Decimal
from pathlib import Path
from typing import Self

import numpy as np
import yaml

from postproc.findings import Finding, Refusal
from postproc.robot.description import EffectEntry, Robot, Value, parameter_value, robot_of
from postproc.robot.layout import (
    Edit,
    Part,
    entries_of,
    in_one_line,
    indented,
    inserted_after,
    key_node,
    keys_of,
    line_end,
    replaced_by_block,
    spliced,
    stop,
    value_node,
)
from postproc.robot.provenance import ROUNDING, Identification
from postproc.robot.reading import beside
from postproc.units import UNITS, to_si
from postproc.yamlfile import Section, parsed

VALUE_DIGITS = 1e-9
"""Rounding of a value, relative; coarser where its 95 % interval allows it."""

INTERVAL_DIGITS = 1e-4
"""Rounding of a value in half widths of its interval, and of that half width itself, relative."""

# of the conversion between units, relative
_NOISE = Decimal("1e-14")
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_.#+-]*")
# no YAML file of this house holds these, not even as an escape
_IMPOSSIBLE = re.compile("[\0\ud800-\udfff]")


@dataclass(frozen=True)
class WrittenParameter:
    """A parameter as it is to stand in the file; SI.  ``ci95``: half width; ``interval``: one of a level that its
    source does not state, where there is no ``ci95``."""

    name: str
    value: float
    unit: str
    ci95: float | None = None
    interval: float | None = None
    source: str = ""

    @classmethod
    def of(cls, name: str, unit: str, stated: Value) -> Self:
        """What a file states already."""
        known, unknown = (stated.interval, None) if stated.level else (None, stated.interval)
        return cls(name, stated.value, unit, known, unknown, stated.source)


@dataclass(frozen=True)
class WrittenEffect:
    """An effect as it is to stand in the file.  ``line``: of the old file's entry that it continues, whose options then
    stay as they are written there; 0: it is new."""

    name: str
    options: Mapping[str, object]
    parameters: tuple[WrittenParameter, ...]
    line: int = 0


def robot_file(
    robot: Robot, effects: Sequence[WrittenEffect], identified: Identification, destination: Path
) -> bytes:
    """The bytes of a robot file ``destination``: that of ``robot`` with other effects, and ``identified`` as the last
    entry of its list.

    Entries of the old file that no effect continues are left out; new effects follow the others.  A URDF is named from
    the folder of ``destination``.  Raises Refusal ROB001 where it would not lie below, ROB002 for a layout that can not
    be edited, FIL008 where the text read back is not what was meant; ValueError for a ``line`` without such an entry.
    """
    identified = replace(
        identified, data=tuple((_possible(name), digest) for name, digest in identified.data)
    )
    continued, new = _matched(robot, effects)
    moved = _moved(robot, destination)
    top = parsed(moved, robot.path)
    if in_one_line(top.node):
        raise top.error(
            "ROB002",
            "the whole file stands in one pair of braces",
            help="write its first level as lines `key: value`",
        )
    text = moved.decode("utf-8-sig")
    edits, blocks = _effect_edits(text, top, continued, new)
    more, block = _appended(text, top, "identified", [_identified_lines(identified)])
    edits, blocks = edits + more, blocks + block
    if blocks:
        end = top.node.end_mark.index
        below = "".join(f"\n{indented(block, top.node.start_mark.column)}\n" for block in blocks)
        edits.append(Edit(end, end, below if text[:end].endswith("\n") else "\n" + below))
    newline = "\r\n" if "\r\n" in text[: text.find("\n") + 1] else "\n"
    edits = [edit._replace(text=edit.text.replace("\n", newline)) for edit in edits]
    data = _encoded(spliced(text, edits), moved)
    _hold(top, data, [*(effect for effect in continued if effect), *new], identified, destination)
    return data


def _matched(
    robot: Robot, effects: Sequence[WrittenEffect]
) -> tuple[list[WrittenEffect | None], list[WrittenEffect]]:
    """The effect that continues each entry of the file, or None; and those that are new."""
    new = [effect for effect in effects if not effect.line]
    left = [effect for effect in effects if effect.line]
    continued: list[WrittenEffect | None] = []
    for entry in robot.effects:
        here = [e for e in left if (e.line, e.name) == (entry.section.line, entry.name)][:1]
        left = [effect for effect in left if effect not in here]
        continued.append(here[0] if here else None)
    if left:
        raise ValueError(f"no {left[0].name} stands in line {left[0].line} of {robot.path}")
    return continued, new


# files beside


def _moved(robot: Robot, destination: Path) -> bytes:
    """The file's bytes, with the URDF named as it lies from the folder of ``destination``."""
    text, edits = robot.raw.decode("utf-8-sig"), []
    top, folder = parsed(robot.raw, robot.path), destination.parent.resolve()
    for key in ("geometry", "controller"):
        if key not in top or "urdf" not in top.section(key):
            continue
        given = top.section(key).section("urdf")
        file, there = beside(given), (folder / given.text("file")).resolve()
        if there.is_relative_to(folder) and there.is_file() and there.read_bytes() == file.read_bytes():
            continue
        if not file.is_relative_to(folder):
            raise given.error(
                "ROB001",
                f"{file} does not lie in {folder}, or below, where the new robot file goes",
                "file",
                f"write the robot file to {robot.path.resolve().parent}, or copy the URDF to {there} first",
            )
        node = value_node(given, "file")
        name = os.path.relpath(file, folder).replace(os.sep, "/")
        edits.append(Edit(node.start_mark.index, stop(text, node), _quoted(name)))
    return _encoded(spliced(text, edits), robot.raw)


def _encoded(text: str, like: bytes) -> bytes:
    """Bytes of ``text``, with the byte order mark if ``like`` begins with one."""
    return (codecs.BOM_UTF8 if like.startswith(codecs.BOM_UTF8) else b"") + text.encode()


# lists


def _effect_edits(
    text: str, top: Section, continued: Sequence[WrittenEffect | None], new: Sequence[WrittenEffect]
) -> tuple[list[Edit], list[str]]:
    """Edits of the list of effects, and where it is absent its block."""
    edits: list[Edit] = []
    if continued:
        parts, sections = entries_of(text, top, "effects"), top.sections("effects")
        for part, section, effect in zip(parts, sections, continued, strict=True):
            gone = [Edit(part.start, part.stop, "")]
            edits += gone if effect is None else _entry_edits(text, section, effect)
    more, blocks = _appended(text, top, "effects", [_effect_lines(effect) for effect in new], "\n\n")
    return edits + more, blocks


def _appended(
    text: str, top: Section, key: str, entries: Sequence[str], gap: str = "\n"
) -> tuple[list[Edit], list[str]]:
    """Edits that append entries to the list under ``key``, and where it is absent its block."""
    if not entries:
        return [], []
    if all(word.value != key for word, _ in top.node.value):
        return [], [f"{key}:\n" + indented(gap.join(entries), 2)]
    parts = entries_of(text, top, key)
    if parts:
        return inserted_after(parts[-1], entries, gap), []
    return replaced_by_block(text, top, key, entries, 2, gap), []


# one entry


def _entry_edits(text: str, section: Section, effect: WrittenEffect) -> list[Edit]:
    """Edits of an entry that goes on, if any of its parameters changed, came or went."""
    given = section.section("parameters", {})
    fresh = {p.name: f"{_word(p.name)}: {_parameter(p, _unit_word(given, p))}" for p in effect.parameters}
    changed = [p.name for p in effect.parameters if p.name in given and not _same(given, p)]
    if not changed and {*given} == {*fresh}:
        return []
    there = any(word.value == "parameters" for word, _ in section.node.value)
    if not in_one_line(section.node):
        column = section.node.value[0][0].start_mark.column
        if not there:
            part = Part(0, line_end(text, stop(text, section.node)), column)
            return inserted_after(part, ["parameters:\n" + indented("\n".join(fresh.values()), 2)])
        if in_one_line(value_node(section, "parameters")):
            return replaced_by_block(text, section, "parameters", [*fresh.values()], column + 2)
        return _parameter_edits(text, section, fresh, changed)
    braces = f"{{{', '.join(fresh.values())}}}"
    if not there:
        end = stop(text, section.node.value[-1][1])
        return [Edit(end, end, f", parameters: {braces}")]
    node = value_node(section, "parameters")
    begin = len(text[: node.start_mark.index].rstrip(" \t"))
    return [Edit(begin, stop(text, node), " " + braces)]


def _parameter_edits(
    text: str, section: Section, fresh: Mapping[str, str], changed: Sequence[str]
) -> list[Edit]:
    """Edits of parameters that stand on lines of their own."""
    given, edits = section.section("parameters"), []
    parts = keys_of(text, section, "parameters")
    for name, part in parts.items():
        if name not in fresh:
            edits.append(Edit(part.start, part.stop, ""))
        elif name in changed:
            value, key = value_node(given, name), key_node(given, name)
            edits.append(Edit(key.start_mark.index, stop(text, value), fresh[name]))
    last = [*parts.values()][-1]
    return edits + inserted_after(last, [line for name, line in fresh.items() if name not in parts])


def _unit_word(given: Section, parameter: WrittenParameter) -> str:
    """The word that the file uses for the unit of a parameter; that of the SI where it has none."""
    if parameter.name in given:
        word = given.section(parameter.name).text("unit")
        if to_si(word, parameter.unit) is not None:
            return word
    return parameter.unit


def _same(given: Section, parameter: WrittenParameter, rounding: float = VALUE_DIGITS) -> bool:
    """Whether the file says of a parameter what is meant, within a relative rounding."""
    read = WrittenParameter.of(
        parameter.name, parameter.unit, parameter_value(given.section(parameter.name), parameter.unit)
    )
    unstated = None if parameter.ci95 is not None else parameter.interval
    pairs = ((read.value, parameter.value), (read.ci95, parameter.ci95), (read.interval, unstated))
    return read.source == _possible(parameter.source) and all(
        one is other if one is None or other is None else math.isclose(one, other, rel_tol=rounding)
        for one, other in pairs
    )


# texts


def _effect_lines(effect: WrittenEffect) -> str:
    lines = [f"- effect: {effect.name}"]
    if effect.options:
        options = (f"{_word(key)}: {_option(value)}" for key, value in effect.options.items())
        lines.append(f"  options: {{{', '.join(options)}}}")
    if effect.parameters:
        lines.append("  parameters:")
        lines += [f"    {_word(p.name)}: {_parameter(p, p.unit)}" for p in effect.parameters]
    return "\n".join(lines)


def _identified_lines(run: Identification) -> str:
    gap = ", ".join(f"{key}: {value:.6g}" for key, value in run.gap.items())
    lines = [
        f"command: {run.command}",
        f"version: {_word(run.version)}",
        f"date: {_quoted(run.date)}",
        "data:" if run.data else "data: []",
        *(f"  - {{file: {_quoted(name)}, sha256: {_quoted(digest)}}}" for name, digest in run.data),
        f"robot_sha256: {_quoted(run.robot_digest)}",
        f"effects: [{', '.join(_word(name) for name in run.effects)}]",
        f"poses: {run.poses}",
        f"readings: {run.readings}",
        f"gap: {{{gap}}}",
    ]
    if run.names:
        lines.append("correlation:")
    for i, name in enumerate(run.names):
        row = "".join(f"{value:.6f}, " for value in run.correlation[i, :i])
        lines.append(f"  {_word(name)}: [{row}1]")
    return "- " + "\n  ".join(lines)


def _parameter(parameter: WrittenParameter, word: str) -> str:
    """``{value, unit, ci95 | ci, source}`` in the unit ``word``."""
    factor = UNITS[" ".join(word.split())][1]
    value = float(parameter.value) / factor
    interval = parameter.interval if parameter.ci95 is None else parameter.ci95
    width = None if interval is None else float(interval) / factor
    exponent = _exponent(value or width or 0.0)
    fitted = 0.0 if parameter.ci95 is None else float(parameter.ci95) / factor
    rounding = max(VALUE_DIGITS * abs(value), INTERVAL_DIGITS * min(fitted, abs(value)))
    fields = [f"value: {_number(value, rounding, exponent)}", f"unit: {word}"]
    if width is not None:
        if not 1e-4 <= width / 10.0**exponent < 1e5:
            exponent = _exponent(width)
        if parameter.ci95 is not None:
            fields.append(f"ci95: {_number(width, INTERVAL_DIGITS * width, exponent)}")
        else:
            fields += [f"ci: {_number(width, VALUE_DIGITS * width, exponent)}", "ci_level: unstated"]
    return "{" + ", ".join([*fields, f"source: {_quoted(_possible(parameter.source))}"]) + "}"


def _exponent(number: float) -> int:
    """Engineering: a multiple of 3, the mantissa from 0.1 up to 100; 0 where the number reads well without one."""
    if number == 0.0 or 1e-2 <= abs(number) < 1e5:
        return 0
    return 3 * math.floor((math.log10(abs(number)) + 1.0) / 3.0)


def _number(number: float, rounding: float, exponent: int) -> str:
    """``number`` with the decimals that keep it within ``rounding``; never beyond it, as it may be at its bound."""
    if number == 0.0:
        return "0"
    exact, step = Decimal(number), Decimal(1).scaleb(math.floor(math.log10(rounding)))
    rounded = exact.quantize(step)
    if abs(rounded) > abs(exact) * (1 + _NOISE):
        rounded = exact.quantize(step, ROUND_DOWN)
    digits = f"{rounded.scaleb(-exponent).normalize():f}"
    return f"{digits}e{exponent}" if exponent else digits


def _option(value: object) -> str:
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_option(one) for one in value) + "]"
    return f"{value:.12g}" if isinstance(value, int | float) else _word(str(value))


def _word(text: str) -> str:
    """A word as it is, anything else in quotes."""
    plain = _WORD.fullmatch(text) and text.lower() not in ("null", "true", "false", "yes", "no", "on", "off")
    return text if plain else _quoted(text)


def _quoted(text: str) -> str:
    """In double quotes, on one line, with escapes for all that is not printed."""
    return '"' + "".join(_escaped(character) for character in text) + '"'


def _escaped(character: str) -> str:
    if character in '"\\':
        return "\\" + character
    if character.isprintable():
        return character
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def _possible(text: str) -> str:
    """Without NUL and halves of characters, which no robot file may hold."""
    return _IMPOSSIBLE.sub("\ufffd", text)


# reading back


def _hold(
    old: Section,
    data: bytes,
    effects: Sequence[WrittenEffect],
    identified: Identification,
    destination: Path,
) -> None:
    """The file read back is the old one, with what was meant.  Raises Refusal FIL008, or what the reading finds."""
    robot, new = robot_of(data, destination), parsed(data, destination)
    kept = [key for key in old if key not in ("effects", "identified")]
    before = _tree(value_node(old, "identified")) if "identified" in old else []
    holds = (
        [key for key in new if key not in ("effects", "identified")] == kept
        and all(_tree(value_node(old, key)) == _tree(value_node(new, key)) for key in kept)
        and _tree(value_node(new, "identified"))[:-1] == before
        and len(robot.effects) == len(effects)
        and all(_reads(entry, effect) for entry, effect in zip(robot.effects, effects, strict=True))
        and _tells(robot.identified[-1], identified)
    )
    if not holds:
        raise Refusal(Finding("FIL008", "the robot file read back is not what was meant", str(destination)))


def _tree(node: yaml.Node) -> list[object]:
    """What a node holds, without where and how it is written."""
    if isinstance(node, yaml.MappingNode):
        return [(key.value, _tree(value)) for key, value in node.value]
    if isinstance(node, yaml.SequenceNode):
        return [_tree(item) for item in node.value]
    return [node.value]


def _reads(entry: EffectEntry, effect: WrittenEffect) -> bool:
    given = entry.section.section("parameters", {})
    return (
        entry.name == effect.name
        and {*given} == {parameter.name for parameter in effect.parameters}
        and all(_same(given, parameter, 1.1 * INTERVAL_DIGITS) for parameter in effect.parameters)
    )


def _tells(read: Identification, meant: Identification) -> bool:
    rounding = ROUNDING * len(meant.names)
    return (
        replace(read, gap={}, correlation=meant.correlation) == replace(meant, gap={})
        and read.gap.keys() == meant.gap.keys()
        and all(math.isclose(read.gap[key], meant.gap[key], rel_tol=1e-5) for key in meant.gap)
        and bool(np.allclose(read.correlation, meant.correlation, rtol=0.0, atol=rounding))
    )
