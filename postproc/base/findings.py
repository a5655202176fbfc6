"""What the tool reports about its input: one type, and the table of the codes that the rooms define.

A finding states what (code, message), where (file, line, column) and what to do (help).  Its severity comes from its
code: ``info`` needs no action, ``warning`` means that something is not corrected or needs review, ``error`` means that
nothing is written.  Every room defines its own codes (``define``); ``postproc.codes`` imports them all.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

SEVERITIES = ("info", "warning", "error")


class Topic(StrEnum):
    """What a code of one language means to rooms that know no language."""

    NONE = ""
    HOME = "home"  # the motion goes to the controller's home position
    UNDECLARED_POINT = "undeclared point"  # the file that declares the point is not there
    EXTERNAL_AXES = "external axes"  # they move, and the program alone does not state what they carry


class Code(NamedTuple):
    severity: str  # info | warning | error
    title: str
    meaning: str
    consequence: str  # why it matters
    action: str  # what to do
    example: str
    topic: Topic = Topic.NONE

    @property
    def explanation(self) -> str:
        """What it means, why it matters and what to do."""
        return f"{self.meaning} {self.consequence} {self.action}"


CODES: dict[str, Code] = {}
"""The codes of the rooms that are imported; all of them after ``import postproc.codes``."""


def define(codes: Mapping[str, Code]) -> Mapping[str, Code]:
    """Enter the codes of a room into ``CODES``; ValueError for one that another room has."""
    twice = sorted(code for code in codes if CODES.get(code, codes[code]) != codes[code])
    if twice:
        raise ValueError(f"these codes belong to another room: {', '.join(twice)}")
    CODES.update(codes)
    return codes


@dataclass(frozen=True, slots=True)
class Finding:
    """One report about the input.  ``line`` and ``column`` count from 1; 0 where there is none."""

    code: str
    message: str
    file: str = ""
    line: int = 0
    column: int = 0
    help: str = ""

    def __post_init__(self) -> None:
        if self.code not in CODES:
            raise ValueError(f"the code {self.code} is not defined")

    @property
    def severity(self) -> str:
        return CODES[self.code].severity

    @property
    def topic(self) -> Topic:
        return CODES[self.code].topic

    @property
    def advice(self) -> str:
        """What to do: of this finding, or of its code."""
        return self.help or CODES[self.code].action

    @property
    def place(self) -> str:
        """``file:line:column`` as far as it is known."""
        parts = [self.file, *(str(n) for n in (self.line, self.column) if n)]
        return ":".join(part for part in parts if part)

    def __str__(self) -> str:
        return f"{self.place}{': ' if self.place else ''}{self.code} {self.message}"

    def as_json(self) -> dict[str, object]:
        return {
            "code": self.code,
            "severity": self.severity,
            "file": self.file,
            "line": self.line,
            "column": self.column,
            "message": self.message,
            "help": self.advice,
        }


class Refusal(Exception):
    """The work cannot be done; it carries the findings that state why."""

    def __init__(self, *findings: Finding) -> None:
        super().__init__("; ".join(str(finding) for finding in findings))
        self.findings = findings


LONGEST_WORD = 100
"""Longer words are not compared: that takes the product of their lengths."""


def resembles(word: str, wanted: str) -> bool:
    """Whether ``word``, in any case, is ``wanted`` or a misspelling of it."""
    word, wanted = word.upper(), wanted.upper()
    if abs(len(word) - len(wanted)) > 2:
        return False
    return difflib.SequenceMatcher(None, word, wanted).ratio() >= 0.75


def nearest(word: str, words: Iterable[str]) -> str:
    """``; did you mean 'x'?`` for a misspelt word, or nothing."""
    if len(word) > LONGEST_WORD:
        return ""
    match = difflib.get_close_matches(word, [each for each in words if len(each) <= LONGEST_WORD], 1, 0.5)
    return f"; did you mean {match[0]!r}?" if match else ""
