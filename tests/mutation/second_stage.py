"""The second stage: what lived meets all other tests, slow ones too, so that a fast choice makes no survivors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import pytest

from mutation.stream import Stream


@dataclass(frozen=True)
class FurtherTests:
    """Which tests the survivors of a first stage meet, in which order, and within which seconds of the processor.

    ``known``: tests of the first stage; ``reaching``: those of them that come by a survivor; ``near``: files of tests
    that import the rooms; ``each``: seconds that one test may take, unmutated; ``all``: seconds of all of them.
    """

    known: frozenset[str]
    reaching: frozenset[str]
    near: frozenset[str]
    each: float
    all: float

    def in_order(self, items: Sequence[pytest.Item]) -> list[pytest.Item]:
        """Fast tests, then slow ones; of both first the files that come by a survivor, then those that import the
        rooms, then all others.  Not those of which the first stage saw that they come by none."""
        files = {name.split("::")[0] for name in self.reaching}

        def place(item: pytest.Item) -> tuple[bool, int]:
            file = item.nodeid.split("::")[0]
            return item.get_closest_marker("slow") is not None, (
                0 if file in files else 1 if file in self.near else 2
            )

        wanted = [item for item in items if item.nodeid not in self.known or item.nodeid in self.reaching]
        return sorted(wanted, key=place)


def further_tests(
    first: Stream, survivors: Iterable[int], near: Iterable[str], seconds: float
) -> FurtherTests:
    """For the survivors of a first stage: so many seconds of the processor for each of them."""
    alive = list(survivors)
    reaching = {name for number in alive for name in first.reached.get(number, ())}
    return FurtherTests(
        frozenset(first.seconds), frozenset(reaching), frozenset(near), seconds, seconds * len(alive)
    )
