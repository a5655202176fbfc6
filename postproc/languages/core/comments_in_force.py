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
        return cls(" ".join(text.upper().split()), text, line)

    @property
    def is_off(self) -> bool:
        return self.statement == "FORCE OFF"


InForce = CommentInForce | Varying | None
"""A comment in force, None before the first one."""


def join_comments(one: InForce, other: InForce) -> InForce:
    """What is in force where two paths meet; before the first comment no force acts, as under FORCE OFF."""
    if one == other:
        return one
    for first, second in ((one, other), (other, one)):
        if first is None and isinstance(second, CommentInForce) and second.is_off:
            return None
    return VARYING


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
            if said is not self._last[word]:
                yield word, said
