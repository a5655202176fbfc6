"""A robot file with new values: the old file, edited where something changed; read back before it is handed out."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_DOWN, Decimal
from pathlib import Path
from typing import Self

import numpy as np
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from postproc.base.findings import Finding, Refusal
from postproc.base.units import UNITS, to_si
from postproc.base.yaml_section import YamlSection, parsed
from postproc.robot.description import EffectEntry, Robot, Value, parameter_value, robot_of
from postproc.robot.provenance import ROUNDING, Identification
from postproc.robot.read_geometry import beside
from postproc.robot.yaml_round_trip import (
    Number,
    Quoted,
    Tree,
    edited,
    extend,
    in_braces,
    in_brackets,
    put,
    tree,
)

VALUE_DIGITS = 1e-9
"""Rounding of a value, relative; coarser where its 95 % interval allows it."""

INTERVAL_DIGITS = 1e-4
"""Rounding of a value in half widths of its interval, and of that half width itself, relative."""

# of the conversion between units, relative
_NOISE = Decimal("1e-14")
# no YAML file of this house holds these, not even as an escape
_IMPOSSIBLE = re.compile("[\0\ud800-\udfff]")


@dataclass(frozen=True)
class WrittenParameter:
    """A parameter as it is to be in the file; SI.  ``ci95``: half width; ``interval``: one of a level that its
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
    """An effect as it is to be in the file.  ``line``: of the old file's entry that it continues, whose options then
    stay as they are written there; 0: it is new."""

    name: str
    options: Mapping[str, object]
    parameters: tuple[WrittenParameter, ...]
    line: int = 0


def robot_file(
    robot: Robot, effects: Sequence[WrittenEffect], identified: Identification, destination: Path
) -> bytes:
    """The bytes of a robot file ``destination``: that of ``robot`` with other values and more effects, and
    ``identified`` as the last entry of its list.

    Entries and parameters that ``effects`` do not name stay as they are; new ones follow the others.  A URDF is named
    from the folder of ``destination``.  Raises Refusal ROB001 where it would not lie below, ROB002 where ruamel.yaml
    does not read the file, FIL008 where the text read back is not what was meant; ValueError for a ``line`` without
    such an entry.
    """
    identified = replace(
        identified, data=tuple((_possible(name), digest) for name, digest in identified.data)
    )
    places = _places(robot, effects)
    moved = _moved(robot, destination)
    old = parsed(moved, robot.path)

    def edit(top: CommentedMap) -> None:
        for effect, place in places:
            if place is not None:
                _change_entry(top["effects"][place], old.sections("effects")[place], effect)
        new = [_new_effect(effect) for effect, place in places if place is None]
        if new:
            extend(top, "effects", CommentedSeq(new), gap=True)
        extend(top, "identified", CommentedSeq([_run(identified)]))

    data = edited(moved, robot.path, edit)
    _check(old, data, places, identified, destination)
    return data


def _places(robot: Robot, effects: Sequence[WrittenEffect]) -> list[tuple[WrittenEffect, int | None]]:
    """Each effect with the index of the entry that it continues, None where it is new."""
    entries = {(entry.section.line, entry.name): i for i, entry in enumerate(robot.effects)}
    for effect in effects:
        if effect.line and (effect.line, effect.name) not in entries:
            raise ValueError(f"line {effect.line} of {robot.path} does not contain {effect.name}")
    return [(effect, entries.get((effect.line, effect.name))) for effect in effects]


def _moved(robot: Robot, destination: Path) -> bytes:
    """The file's bytes, with the URDF named as it lies from the folder of ``destination``."""
    names: dict[str, str] = {}
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
                f"{file} is not in {folder}, or below, where the new robot file is written",
                "file",
                f"write the robot file to {robot.path.resolve().parent}, or copy the URDF to {there} first",
            )
        names[key] = os.path.relpath(file, folder).replace(os.sep, "/")

    def edit(top: CommentedMap) -> None:
        for key, name in names.items():
            top[key]["urdf"]["file"] = Quoted(name)

    return edited(robot.raw, robot.path, edit) if names else robot.raw


# one entry


def _change_entry(entry: CommentedMap, section: YamlSection, effect: WrittenEffect) -> None:
    """Write the parameters of an entry that changed, or that it does not have yet."""
    given, new = section.section("parameters", {}), CommentedMap()
    for parameter in effect.parameters:
        if parameter.name not in given:
            new[parameter.name] = parameter_fields(parameter, parameter.unit)
        elif not _same(given, parameter):
            put(
                entry["parameters"], parameter.name, parameter_fields(parameter, _unit_word(given, parameter))
            )
    if new:
        extend(entry, "parameters", new)


def _unit_word(section: YamlSection, parameter: WrittenParameter) -> str:
    """The word that the file uses for the unit of a parameter; that of the SI where it has none."""
    if parameter.name in section:
        word = section.section(parameter.name).text("unit")
        if to_si(word, parameter.unit) is not None:
            return word
    return parameter.unit


def _same(section: YamlSection, parameter: WrittenParameter, rounding: float = VALUE_DIGITS) -> bool:
    """Whether the file states of a parameter what is meant, within a relative rounding."""
    read = WrittenParameter.of(
        parameter.name, parameter.unit, parameter_value(section.section(parameter.name), parameter.unit)
    )
    unstated = None if parameter.ci95 is not None else parameter.interval
    pairs = ((read.value, parameter.value), (read.ci95, parameter.ci95), (read.interval, unstated))
    return read.source == _possible(parameter.source) and all(
        one is other if one is None or other is None else math.isclose(one, other, rel_tol=rounding)
        for one, other in pairs
    )


# texts


def _new_effect(effect: WrittenEffect) -> CommentedMap:
    entry = CommentedMap(effect=effect.name)
    if effect.options:
        entry["options"] = in_braces({key: _option(value) for key, value in effect.options.items()})
    if effect.parameters:
        entry["parameters"] = CommentedMap((p.name, parameter_fields(p, p.unit)) for p in effect.parameters)
    return entry


def _run(run: Identification) -> CommentedMap:
    data = [in_braces({"file": Quoted(name), "sha256": Quoted(digest)}) for name, digest in run.data]
    entry = CommentedMap(
        command=run.command,
        version=Quoted(run.version),
        date=Quoted(run.date),
        data=data or in_brackets([]),
        robot_sha256=Quoted(run.robot_digest),
        effects=in_brackets(run.effects),
        poses=run.poses,
        readings=run.readings,
        gap=in_braces({key: Number(f"{value:.6g}") for key, value in run.gap.items()}),
    )
    if run.names:
        entry["correlation"] = CommentedMap(
            (name, in_brackets([*(Number(f"{value:.6f}") for value in run.correlation[i, :i]), 1]))
            for i, name in enumerate(run.names)
        )
    return entry


def parameter_fields(parameter: WrittenParameter, word: str) -> CommentedMap:
    """``{value, unit, ci95 | ci, source}`` in the unit ``word``."""
    factor = UNITS[" ".join(word.split())][1]
    value = float(parameter.value) / factor
    interval = parameter.interval if parameter.ci95 is None else parameter.ci95
    width = None if interval is None else float(interval) / factor
    fitted = 0.0 if parameter.ci95 is None else float(parameter.ci95) / factor
    written = _rounded(value, max(VALUE_DIGITS * abs(value), INTERVAL_DIGITS * min(fitted, abs(value))))
    half = None
    if width is not None:
        half = _rounded(width, (VALUE_DIGITS if parameter.ci95 is None else INTERVAL_DIGITS) * width)
    exponent = _exponent(written or half or Decimal(0))
    fields: dict[str, object] = {"value": _number(written, exponent), "unit": word}
    if half is not None:
        if not Decimal("1e-4") <= half.scaleb(-exponent) < Decimal("1e5"):
            exponent = _exponent(half)
        if parameter.ci95 is not None:
            fields["ci95"] = _number(half, exponent)
        else:
            fields |= {"ci": _number(half, exponent), "ci_level": "unstated"}
    return in_braces(fields | {"source": Quoted(_possible(parameter.source))})


def _exponent(number: Decimal) -> int:
    """Engineering: a multiple of 3, the mantissa from 0.1 up to 100; 0 where the number reads well without one."""
    if not number or -2 <= number.adjusted() < 5:
        return 0
    return 3 * ((number.adjusted() + 1) // 3)


def _rounded(number: float, rounding: float) -> Decimal:
    """``number`` with the decimals that keep it within ``rounding``; never beyond it, as it may be at its bound."""
    if number == 0.0:
        return Decimal(0)
    exact, step = Decimal(number), Decimal(1).scaleb(math.floor(math.log10(rounding)))
    rounded = exact.quantize(step)
    if abs(rounded) > abs(exact) * (1 + _NOISE):
        rounded = exact.quantize(step, ROUND_DOWN)
    return rounded


def _number(number: Decimal, exponent: int) -> Number:
    if not number:
        return Number("0")
    digits = f"{number.scaleb(-exponent).normalize():f}"
    return Number(f"{digits}e{exponent}" if exponent else digits)


def _option(value: object) -> object:
    if isinstance(value, list | tuple):
        return in_brackets(_option(one) for one in value)
    return Number(f"{value:.12g}") if isinstance(value, int | float) else str(value)


def _possible(text: str) -> str:
    """Without NUL and halves of characters, which no robot file may hold."""
    return _IMPOSSIBLE.sub("\ufffd", text)


# reading back


def _check(
    old: YamlSection,
    data: bytes,
    places: Sequence[tuple[WrittenEffect, int | None]],
    identified: Identification,
    destination: Path,
) -> None:
    """The file read back is the old one, with what was meant.  Raises Refusal FIL008, or what the reading finds."""
    robot, new = robot_of(data, destination), parsed(data, destination)
    others = [
        [pair for pair in tree(top.node) if pair[0] not in ("effects", "identified")] for top in (old, new)
    ]
    runs = [[tree(run.node) for run in top.sections("identified")] for top in (old, new)]
    entries = old.sections("effects")
    continued = {place: effect for effect, place in places if place is not None}
    intended = [continued.get(i) for i in range(len(entries))]
    intended += [effect for effect, place in places if place is None]
    holds = (
        others[0] == others[1]
        and runs[0] == runs[1][:-1]
        and len(robot.effects) == len(intended)
        and all(
            _reads(entry, effect) for entry, effect in zip(robot.effects, intended, strict=True) if effect
        )
        and all(
            _untouched(was, effect) == _untouched(now.section, effect)
            for was, now, effect in zip(entries, robot.effects, intended, strict=False)
        )
        and _states(robot.identified[-1], identified)
    )
    if not holds:
        raise Refusal(
            Finding(
                "ROB003",
                "the self-check failed: the robot file that is read back differs from the plan",
                str(destination),
            )
        )


def _reads(entry: EffectEntry, effect: WrittenEffect) -> bool:
    given = entry.section.section("parameters", {})
    return entry.name == effect.name and all(
        parameter.name in given and _same(given, parameter, 1.1 * INTERVAL_DIGITS)
        for parameter in effect.parameters
    )


def _untouched(section: YamlSection, effect: WrittenEffect | None) -> tuple[dict[str, Tree], list[Tree]]:
    """What an entry contains beside the parameters of ``effect``."""
    written = {parameter.name for parameter in effect.parameters} if effect else set()
    others = {key: value for key, value in tree(section.node) if key != "parameters"}
    return others, [pair for pair in tree(section.section("parameters", {}).node) if pair[0] not in written]


def _states(read: Identification, expected: Identification) -> bool:
    rounding = ROUNDING * len(expected.names)
    return (
        replace(read, gap={}, correlation=expected.correlation) == replace(expected, gap={})
        and read.gap.keys() == expected.gap.keys()
        and all(math.isclose(read.gap[key], expected.gap[key], rel_tol=1e-5) for key in expected.gap)
        and bool(np.allclose(read.correlation, expected.correlation, rtol=0.0, atol=rounding))
    )
