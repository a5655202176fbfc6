"""Two tiers: plain ``pytest`` runs the fast one, ``pytest -m "slow or not slow"`` everything.

``@pytest.mark.slow`` leaves a test to the second.  ``@pytest.mark.sample(k)`` leaves all but k of its parametrisations
to it, which lie evenly from the first to the last.  ``examples(n)`` is how many examples a law tries: n, a tenth in the
fast tier.  ``--slow-minutes m`` bounds the time on a slow machine: slow tests not begun m minutes after the start are
skipped, and say so.
"""

from __future__ import annotations

import os
import time

import pytest
from hypothesis import settings

BEGIN = time.monotonic()
"""When this process began."""

FAST = "not slow"
"""Of ``-m``, as pyproject.toml has it."""

settings.register_profile("fast", max_examples=10, deadline=None, derandomize=True)
settings.register_profile("full", max_examples=100, deadline=None)


def examples(count: int) -> int:
    """Examples of a law under the profile that is loaded: ``count`` under ``full``."""
    share = settings.default.max_examples / settings.get_profile("full").max_examples
    return max(min(count, 8), round(share * count))


def choose_profile(config: pytest.Config) -> None:
    """Loads what ``--hypothesis-profile`` or HYPOTHESIS_PROFILE names, else that of the tier that is asked for."""
    tier = "fast" if config.getoption("markexpr") == FAST else "full"
    name = config.getoption("--hypothesis-profile") or os.environ.get("HYPOTHESIS_PROFILE") or tier
    settings.load_profile(name)


def mark_samples(items: list[pytest.Item]) -> None:
    """Makes those parametrisations slow that are not in the sample of their test."""
    groups: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("sample"):
            if not hasattr(item, "callspec"):
                raise pytest.UsageError(f"{item.nodeid}: a sample of what has no parametrisations")
            groups.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for group in groups.values():
        (count,) = group[0].get_closest_marker("sample").args
        for k, item in enumerate(group):
            if not in_sample(k, len(group), count):
                item.add_marker(pytest.mark.slow)


def skip_when_late(item: pytest.Item) -> None:
    """Skips a slow test if the minutes for such have passed since this process began."""
    minutes = item.config.getoption("slow_minutes")
    if minutes is not None and item.get_closest_marker("slow") and time.monotonic() - BEGIN > 60.0 * minutes:
        pytest.skip(f"{minutes:g} minutes for slow tests had passed")


STOCK = ("test_engage", "test_part_")
"""Starts of the names of files whose tests simulate a stock."""


def stock_first(items: list[pytest.Item]) -> None:
    """Puts the tests that simulate a stock before all others, else in their order: its loops are compiled at the first
    call, which takes long, by the one process that gets the first tests, and the others load them."""
    items.sort(key=lambda item: not item.path.name.startswith(STOCK))


def in_sample(k: int, of: int, count: int) -> bool:
    """Whether the ``k``-th of so many is one of ``count`` that lie evenly from the first to the last."""
    if count >= of or of == 1:
        return True
    chosen = {round(i * (of - 1) / max(count - 1, 1)) for i in range(count)}
    return k in chosen
