"""The frames that the motions of a program use."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from postproc.toolpath import FrameRef


class FrameTable:
    """``refs``: the frames, each once."""

    def __init__(self) -> None:
        self.refs: list[FrameRef] = []
        self._known: dict[Hashable, int] = {}

    def index(self, key: Hashable, frame: Callable[[], FrameRef]) -> int:
        """Of the frame with this ``key``, which is what ``frame`` gives where there is none yet."""
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = len(self.refs)
            self.refs.append(frame())
        return found
