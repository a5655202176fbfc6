"""The terminal, which shows texts of programs, robots and files, and is not driven by them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from postproc.base.sanitize import sanitize_lines

WIDTH = 160
"""Columns where the output is no terminal."""


class SafeConsole(Console):
    """A console on ``stream`` that shows every character that is none to read as ``?``, but for the ends of lines,
    and no ``:name:`` as a picture."""

    def __init__(self, stream: TextIO) -> None:
        width = None if stream.isatty() else WIDTH
        super().__init__(file=stream, width=width, highlight=False, emoji=False)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(sanitize_lines(segment.text), segment.style)
