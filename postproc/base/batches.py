"""Many rows, block by block: arrays of a block stay in the cache, and the blocks go to all cores.

numpy lets other threads run while it computes.  Blocks are cut by number of rows alone, so a result does not depend on
how many threads there are.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Ints
from postproc.base.paged_memory import release_pages, with_small_arrays

T = TypeVar("T")

ROWS = 3 << 12
"""Rows of a block."""

SPAN = 1 << 19
"""Rows of a program over which those of one block lie at most where they are chosen here and there: of an array in a
file all pages between them count as resident once they are read."""

THREADS = "POSTPROC_THREADS"
"""Environment variable: threads at most; all cores without it."""

MOST = 8
"""Threads at most: what is not numpy's runs in one of them at a time."""

_inside = threading.local()


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads() -> int:
    """Threads that work on blocks."""
    word = os.environ.get(THREADS, "")
    return min(MOST, int(word) if word.isdecimal() and int(word) else cores())


def blocks(count: int, rows: int = 0) -> list[slice]:
    """The blocks of ``count`` rows, of ``ROWS`` each where ``rows`` states nothing else."""
    rows = rows or ROWS
    return [slice(start, min(start + rows, count)) for start in range(0, count, rows)]


def spans(chosen: Ints, rows: int = 0) -> list[slice]:
    """Blocks of ``chosen`` (K,), ascending numbers of rows of a program, of ``ROWS`` each where ``rows`` states nothing
    else; those of one lie within ``SPAN`` rows, but for one that would be alone, as that is rounded otherwise."""
    if not len(chosen):
        return []
    cuts = np.searchsorted(chosen, np.arange(SPAN, int(chosen[-1]) + 1, SPAN)).tolist()
    parts: list[slice] = []
    for low, high in pairwise([0, *cuts, len(chosen)]):
        for part in blocks(high - low, rows):
            first, stop = low + part.start, low + part.stop
            if parts and (parts[-1].stop - parts[-1].start == 1 or stop - first == 1 == len(chosen) - first):
                parts[-1] = slice(parts[-1].start, stop)
            else:
                parts.append(slice(first, stop))
    return parts


def in_blocks(work: Callable[[slice], T], count: int, rows: int = 0) -> Iterator[T]:
    """``work`` of every block of ``count`` rows, in their order.

    Few blocks are ahead of the one that is asked for.  Inside of another block all is done where it is asked for.
    What ``work`` raises is raised here; blocks that have not started are then given up.
    """
    return _in_order(work, blocks(count, rows))


def in_spans(work: Callable[[slice], T], chosen: Ints, rows: int = 0) -> Iterator[T]:
    """As ``in_blocks``, of the blocks of ``chosen`` (K,), ascending numbers of rows that lie here and there in a
    program."""
    return _in_order(work, spans(chosen, rows))


def select_rows(values: Any, chosen: Ints) -> NDArray[Any]:
    """``values[chosen]`` (K, ...) of an array (N, ...), or of what gives its rows by their numbers; ``chosen`` (K,)
    ascend and lie here and there."""
    parts = []
    for part in spans(chosen, len(chosen)):
        parts.append(values[chosen[part]])
        release_pages()
    return np.concatenate(parts) if parts else np.asarray(values[chosen])


def _in_order(work: Callable[[slice], T], parts: list[slice]) -> Iterator[T]:
    workers = threads()
    if len(parts) < 2 or getattr(_inside, "block", False):
        yield from map(work, parts)
        return
    if workers < 2:
        for part in parts:
            yield with_small_arrays(work, part)
            release_pages()
        return

    def within(part: slice) -> T:
        _inside.block = True
        return work(part)

    with ThreadPoolExecutor(workers, "block") as pool:
        ahead: deque[Future[T]] = deque()
        try:
            for part in parts:
                ahead.append(pool.submit(within, part))
                if len(ahead) > workers:
                    yield ahead.popleft().result()
                    release_pages()
            while ahead:
                yield ahead.popleft().result()
        finally:
            for future in ahead:
                future.cancel()


def each_block(work: Callable[[slice], None], count: int, rows: int = 0) -> None:
    """``work`` of every block of ``count`` rows, which puts what it finds in its place."""
    for _ in in_blocks(work, count, rows):
        pass
