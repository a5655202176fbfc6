"""What the cell states of the controller's own data: ``symbols`` and ``program_start``."""

from __future__ import annotations

import re
from collections.abc import Mapping

from postproc.base.yaml_section import YamlSection
from postproc.toolpath.initial_state import InitialState, Symbol

_NAME = re.compile(r"(?:#\d+|[A-Za-z_$][A-Za-z0-9_$]*(?:\[\d+(?:,\d+)*\])?)\Z")
_COMPONENT = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_WORDS = ("x", "y", "z", "a", "b", "c")


def read_symbols(top: YamlSection) -> Mapping[str, Symbol]:
    """``symbols``: name in capitals -> number, or component in capitals -> number.  Refusal YML004."""
    if "symbols" not in top:
        return {}
    section = top.section("symbols")
    symbols: dict[str, Symbol] = {}
    for name in section:
        if not _NAME.match(name):
            raise section.error(
                "YML004",
                "is no name of the controller",
                name,
                'write a name as the program does: XHOME, FDAT_ACT, UFRAME[2], "#501", R12',
            )
        if name.upper() in symbols:
            raise section.error("YML004", "is stated twice: names are the same in capitals", name)
        symbols[name.upper()] = (
            _aggregate(section, name) if section.is_mapping(name) else section.number(name)
        )
    return symbols


def _aggregate(section: YamlSection, name: str) -> Mapping[str, float]:
    parts = section.section(name)
    values: dict[str, float] = {}
    for part in parts:
        if not _COMPONENT.match(part) or part.upper() in values:
            raise parts.error(
                "YML004", "is no component, or is stated twice", part, "write X, A1, TOOL_NO ..."
            )
        values[part.upper()] = parts.number(part)
    if not values:
        raise section.error("YML003", "states no component", name)
    return values


def read_program_start(top: YamlSection) -> InitialState:
    """``program_start``: {tool, base, x, y, z, a, b, c} where each may be absent.  Refusal YML004."""
    if "program_start" not in top:
        return InitialState()
    section = top.section("program_start")
    section.only("tool", "base", *_WORDS)
    words = {
        key.upper(): section.number(key, unit="deg" if key in "abc" else "mm")
        for key in _WORDS
        if key in section
    }
    return InitialState(_number(section, "tool"), _number(section, "base"), words)


def _number(section: YamlSection, key: str) -> int | None:
    if key not in section:
        return None
    value = section.number(key, low=0.0)
    if value != int(value):
        raise section.error("YML004", f"{value:g} is no whole number", key)
    return int(value)
