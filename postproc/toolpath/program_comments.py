"""The comments of a program."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Annotation:
    """A comment before the motion ``row``; one that speaks to this tool (FORCE, COMPENSATE) holds from there on."""

    row: int
    text: str
    line: int


@dataclass(frozen=True)
class ProgramComments:
    """``annotations``: comments that speak to this tool; ``comments``: all others that are alone on their line."""

    annotations: tuple[Annotation, ...] = ()
    comments: tuple[Annotation, ...] = ()
