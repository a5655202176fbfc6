"""The variables of a program and their values, as far as these are the same in every run."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from postproc.languages.gcode.expression_values import (
    FANUC,
    LINUXCNC,
    SINUMERIK,
    ExpressionLanguage,
    evaluate,
)

_NUMBERED = re.compile(r"#(\d{1,9})")
_PARAMETER = re.compile(r"R\d+")
_LOCAL = {id(LINUXCNC): 30, id(FANUC): 33}
_SYSTEM = {id(LINUXCNC): 5000, id(FANUC): 1000}
"""Variables from these numbers on are the control's own: positions, offsets, signals."""


class VariableValues:
    """name -> value; what is absent is not known.

    volatile: names that are never known.  parallel: the assignments of a block hold after it, so that its words and its
    other assignments have the values from before it.  in_turn: its assignments are made from left to right.
    """

    def __init__(self, language: ExpressionLanguage, known: Mapping[str, float], control: str) -> None:
        self._language = language
        self._bound = frozenset(known)
        self._local: dict[str, bool] = {}
        self._shared: dict[str, float] = {}
        self._own: dict[str, float] = {}  # what a subprogram does not see
        self._put(known)
        self._assigned: set[str] = set()
        self._other_code = False
        self.volatile: set[str] = set()
        self.parallel = language is LINUXCNC
        self.in_turn = language is SINUMERIK
        self.result = math.nan

    def evaluate(self, text: str, without: set[str]) -> tuple[float, list[str]]:
        """The value of an expression, and the names in it that are not known; those of ``without`` are not."""
        missing: list[str] = []

        def lookup(name: str) -> float:
            if name not in without and name not in self.volatile:
                value = self._table(name).get(name)
                if value is not None:
                    return value
            missing.append(name)
            return math.nan

        return evaluate(text, self._language, lookup), missing

    def name(self, target: str) -> str:
        """The variable that an assignment sets, "" where that is not known."""
        if not self._language.numbered:
            if "[" not in target:
                return target
            name, _, index = target.partition("[")
            value, _ = self.evaluate(index.rstrip("] "), set())
            if math.isnan(value):
                return ""
            return f"{name.strip()}{value:.0f}" if name.strip() == "R" else f"{name.strip()}[{value:g}]"
        text = target.replace(" ", "")
        if _NUMBERED.fullmatch(text):
            return f"#{int(text[1:])}"
        if text.startswith("#<"):
            return text
        value, _ = self.evaluate(text[1:], set()) if text.startswith("#") else (math.nan, [])
        return f"#{value:.0f}" if value == value and value == math.floor(value) else ""

    def set(self, name: str, value: float) -> None:
        if not name:
            self.forget()
            return
        self._assigned.add(name)
        number = _NUMBERED.fullmatch(name)
        system = number is not None and int(number[1]) >= _SYSTEM.get(id(self._language), 0)
        if math.isnan(value) or system:
            self._table(name).pop(name, None)
        else:
            self._table(name)[name] = value

    def _table(self, name: str) -> dict[str, float]:
        """Where the value of a variable is kept."""
        return self._own if self.is_local(name) else self._shared

    def _put(self, values: Mapping[str, float]) -> None:
        for name, value in values.items():
            if not math.isnan(value):
                self._table(name)[name] = value

    def forget(self) -> None:
        """Code that was not read ran."""
        self._other_code = True
        self._shared.clear()
        self._own.clear()

    def can_be_bound(self, name: str) -> bool:
        """Whether a value that the cell states would hold here: nothing that ran up to here may have set another."""
        return not self._other_code and name not in self._assigned and name not in self.volatile

    def is_local(self, name: str) -> bool:
        known = self._local.get(name)
        if known is None:
            known = self._local[name] = self._belongs_to_part(name)
        return known

    def _belongs_to_part(self, name: str) -> bool:
        if not self._language.numbered:
            return not _PARAMETER.fullmatch(name) and name not in self._bound
        number = _NUMBERED.fullmatch(name)
        if number is not None:
            return int(number[1]) <= _LOCAL[id(self._language)]
        return not name.startswith("#<_") and self._language is LINUXCNC

    def own(self) -> dict[str, float] | None:
        """What a subprogram without arguments has of its own at its start."""
        return None if self._language.numbered else {}

    def enter(self, arguments: dict[str, float]) -> dict[str, float]:
        """Goes into a subprogram; the variables of the caller that it does not see."""
        outer, self._own = self._own, {}
        self._put(arguments)
        return outer

    def leave(self, outer: dict[str, float]) -> None:
        """Back to the caller."""
        self._own = outer
        self.set("#<_VALUE>", self.result)
        self.result = math.nan
