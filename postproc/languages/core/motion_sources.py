"""After which motions a motion may run: some known ones, or those that meet at a place where many paths do.

Places where paths meet are distinguished, paths through them are not: so a set of sources stays small, and all
sets together are of the size of the program.
"""

from __future__ import annotations

from collections.abc import Iterable

MOST = 30
"""Motions before another one that are distinguished."""


class Meeting:
    """A place where more paths meet than are distinguished; ``sources``: where these come from."""

    __slots__ = ("sources",)

    def __init__(self) -> None:
        self.sources: set[Source] = set()


Source = int | Meeting
"""A motion, or what an int stands for in its place; or all those that meet somewhere."""


def met(own: frozenset[Source], other: frozenset[Source], meeting: Meeting) -> frozenset[Source]:
    """The sources where paths with these meet; ``own`` itself where the other path adds nothing.  meeting: that of
    the place, which takes them up from ``MOST`` on."""
    if other <= own:
        return own
    if meeting in own:
        meeting.sources |= other
        return own
    both = own | other
    if len(both) <= MOST:
        return both
    meeting.sources |= both
    return frozenset([meeting])


def expanded(sources: Iterable[Source], visited: set[Meeting]) -> set[int]:
    """What is among sources, with those after meetings that are not in ``visited``, to which they are added."""
    found: set[int] = set()
    todo = list(sources)
    while todo:
        source = todo.pop()
        if isinstance(source, int):
            found.add(source)
        elif source not in visited:
            visited.add(source)
            todo.extend(source.sources)
    return found


def distinguished(sources: frozenset[Source]) -> bool:
    """Whether all of them are known one by one."""
    return not any(isinstance(source, Meeting) for source in sources)
