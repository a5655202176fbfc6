"""What the package asks of the allocator and of the garbage collector.

Nothing here needs numpy: the command calls it before numpy is loaded.
"""

from __future__ import annotations

import ctypes
import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager

LARGE = 1 << 24
"""Bytes of an array that is no block's (``batches``)."""

LOADED = 150_000
"""Objects that the collector knows, net of those that are gone, before it looks at any: a main job of a hundred motions
has 85,000 of them at its end."""


def free_memory() -> int | None:
    """Bytes that programs may still take without swapping; None where the system does not say."""
    try:
        with open("/proc/meminfo") as stream:
            lines = dict(line.split(":") for line in stream)
        return int(lines["MemAvailable"].split()[0]) << 10
    except (OSError, KeyError, ValueError):
        return None


def release_free_memory() -> None:
    """Give free memory back to the system: the C library (glibc) keeps what lies between blocks that are in use."""
    _allocator("malloc_trim", 0)


def use_mmap_for_large_arrays() -> None:
    """From now on arrays of more than ``LARGE`` bytes lie apart, and go back to the system as soon as they are free;
    those of blocks lie together, and what is free of them stays available: to fetch a page again takes as long as to
    compute what it holds."""
    m_trim_threshold, m_top_pad, m_mmap_threshold, m_arena_max = -1, -2, -3, -8
    _allocator("mallopt", m_mmap_threshold, LARGE)
    _allocator("mallopt", m_trim_threshold, 4 * LARGE)
    _allocator("mallopt", m_top_pad, LARGE // 2)
    _allocator("mallopt", m_arena_max, 1)


def collect_late() -> None:
    """The collector looks at nothing until ``LOADED`` objects are there that may be in a circle; from then on it does
    as always.  What is loaded at the start is fewer, and none of it ever ends."""
    usual = gc.get_threshold()

    def as_always(_phase: str, _facts: dict[str, int]) -> None:
        gc.set_threshold(*usual)
        gc.callbacks.remove(as_always)

    if usual[0] < LOADED:
        gc.callbacks.append(as_always)
        gc.set_threshold(LOADED, *usual[1:])


def leave_objects_to_the_system() -> None:
    """At the end of a process: the collector does not look for circles among what ends with it anyway."""
    gc.freeze()


def _allocator(name: str, *arguments: int) -> None:
    """Calls a function of glibc's allocator; nothing where there is none."""
    function = getattr(ctypes.CDLL(None), name, None) if sys.platform == "linux" else None
    if function is not None:
        function(*arguments)


@contextmanager
def without_garbage_collection() -> Iterator[None]:
    """For work that makes many objects of which none refers back to itself: the collector would only walk over them
    again and again."""
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            if not gc.get_freeze_count():  # as if they had been looked at: all of them are still needed
                gc.freeze()
                gc.unfreeze()
            gc.enable()
