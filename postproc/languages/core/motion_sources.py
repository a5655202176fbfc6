"""After which motions a motion may run: some known ones, or those that meet at a place where many paths do.

Places where paths meet are distinguished, paths through them are not: so a set of sources stays small, and all
sets together are of the size of the program.
"""

from __future__ import annotations

from collections.abc import Iterable

START, ELSEWHERE = -1, -2
"""In the place of a motion: the start of the program; what the program does not contain."""

MOST = 30
"""Motions before another one that are distinguished."""
FEW = 8
"""Of them those that a place keeps apart which is met but once, and so has no meeting of its own."""


class Meeting:
    """A place where more paths meet than are distinguished; ``sources``: where these come from."""

    __slots__ = ("sources",)

    def __init__(self) -> None:
        self.sources: set[Source] = set()


Source = int | Meeting
"""A motion, or what an int stands for in its place; or all those that meet somewhere."""


def met(own: frozenset[Source], other: frozenset[Source], meeting: Meeting) -> frozenset[Source]:
    """The sources where paths with these meet; ``own`` itself where the other path adds nothing.  meeting: that of
    the place, which takes them up from ``MOST`` on, and all that come later: a loop would else distinguish one more of
    them each time."""
    if other <= own:
        return own
    if meeting in own:
        meeting.sources |= other
        return own
    both = own | other
    if len(both) <= MOST and not meeting.sources:
        return both
    meeting.sources |= both
    return frozenset([meeting])


def together(sources: frozenset[Source]) -> frozenset[Source]:
    """The same sources, as one new meeting where they are more than ``FEW``."""
    if len(sources) <= FEW:
        return sources
    meeting = Meeting()
    meeting.sources |= sources
    return frozenset([meeting])


def expanded(sources: Iterable[Source], visited: set[Meeting] | None = None) -> set[int]:
    """What is among sources, with those after meetings that are not in ``visited``, to which they are added."""
    visited = set() if visited is None else visited
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
