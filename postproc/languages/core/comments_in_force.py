"""FORCE and COMPENSATE comments that are in force, whatever the path to a motion."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Protocol

SPEAKS = re.compile(r"(?:FORCE|COMPENSATE)(?![A-Za-z0-9_])", re.I)
"""What a comment starts with that speaks to this tool."""
CONTRADICTED = "the FORCE or COMPENSATE comment in force differs with the path of the program"
_PLACES = {"FORCE": "force", "COMPENSATE": "switch"}
_INITIAL = ("FORCE OFF", "COMPENSATE ON")
_WORD = re.compile(r"[^ \t,]*")


class Varying(IntEnum):
    """In the place of a comment in force: it differs with the path of the program."""

    VARYING = 0


VARYING = Varying.VARYING


class Comment(Protocol):
    @property
    def text(self) -> str: ...


@dataclass(frozen=True, slots=True)
class CommentInForce:
    """A comment that is in force: the same as another one that states the same, in blanks and letters of any kind."""

    statement: str
    text: str = field(compare=False)
    line: int = field(compare=False)

    @classmethod
    def of(cls, text: str, line: int) -> CommentInForce:
        return cls(_statement(text), text, line)


InForce = CommentInForce | Varying | None
"""A comment in force, None before the first one."""


def _statement(text: str) -> str:
    """What a comment states, in blanks and letters of one kind."""
    return " ".join(text.upper().split())


def is_initial(comment: Comment | Varying | None) -> bool:
    """Whether a comment states what is so before the first one: no force acts, and motions are corrected."""
    return comment is not None and comment is not VARYING and _statement(comment.text) in _INITIAL


def join_comments(one: Comment | Varying | None, other: Comment | Varying | None) -> Comment | Varying | None:
    """What is in force where two paths meet; before the first comment all is as under FORCE OFF and COMPENSATE ON."""
    if one is None or other is None:
        return None if one is other or is_initial(one) or is_initial(other) else VARYING
    if one is VARYING or other is VARYING or _statement(one.text) != _statement(other.text):
        return VARYING
    return one


def place_of(text: str) -> str:
    """Whether a comment is from now on the ``force`` or the ``switch`` in force; "" for another one."""
    word = _WORD.match(text)
    return _PLACES.get(word[0].upper(), "") if word else ""


class ShownComments:
    """Which comments the motions so far have before them, in the order of rows."""

    def __init__(self) -> None:
        self._last: dict[str, Comment | None] = {"FORCE": None, "COMPENSATE": None}

    def add(self, comment: Comment) -> None:
        """Takes up a comment, if it speaks to this tool."""
        word = SPEAKS.match(comment.text)
        if word is not None:
            self._last[word[0].upper()] = comment

    def others(self, force: object, switch: object) -> Iterator[tuple[str, object]]:
        """The words of which another comment, or none, is in force at the next row, and that comment."""
        for word, said in (("FORCE", force), ("COMPENSATE", switch)):
            if said is not self._last[word] and not (said is None and is_initial(self._last[word])):
                yield word, said
