"""What a run of a module takes up of motions, comments, calls and readings, in the order in which they run."""

from __future__ import annotations

from collections import defaultdict

from postproc.languages.core.motion_sources import Meeting, Source
from postproc.languages.rapid.motion_facts import MotionFact
from postproc.languages.rapid.syntax_tree import Remark


class RunRecord:
    """``facts``: offset of a motion -> its fact; ``passed``: comments with the number of motions before each;
    ``calls``: name of what is not followed -> offset of its first call; ``reads``: where the place of the robot is read
    -> the motions after which; ``refreshed``: motions after which speeds are changed at once; ``rows``: how
    many motions there are."""

    def __init__(self) -> None:
        self.facts: dict[int, MotionFact] = {}
        self.passed: dict[int, tuple[Remark, int]] = {}
        self.calls: dict[bytes, int] = {}
        self.reads: defaultdict[int, set[Source]] = defaultdict(set)
        self.refreshed: set[Source] = set()
        self.rows = 0
        self._meetings: defaultdict[int, Meeting] = defaultdict(Meeting)

    def clear(self) -> None:
        """Forgets all of it, before another run."""
        for store in (self.facts, self.passed, self.calls, self.reads, self.refreshed, self._meetings):
            store.clear()
        self.rows = 0

    def motion(self, at: int, fact: MotionFact) -> None:
        """Takes up the fact of the motion at an offset: what holds in all of its executions."""
        known = self.facts.get(at)
        self.facts[at] = fact if known is None else known.joined(fact, self._meetings[at])
        self.rows += fact.count if known is None else 0
