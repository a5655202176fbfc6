"""The terminal, which shows texts of programs, robots and files, and is not driven by them."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from typing import TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

WIDTH = 160
"""Columns where the output is no terminal."""


class SafeConsole(Console):
    """A console on ``stream`` that shows every character that is none to read as ``?``: control characters and escapes,
    those that turn the direction of writing or take no room, and separators of lines and paragraphs."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__(file=stream, width=None if stream.isatty() else WIDTH, highlight=False)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(readable(segment.text), segment.style)


def readable(text: str) -> str:
    """``text`` with ``?`` for every character of the categories Cc, Cf, Zl and Zp, but for the ends of lines."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        "?" if one != "\n" and unicodedata.category(one) in ("Cc", "Cf", "Zl", "Zp") else one for one in text
    )
