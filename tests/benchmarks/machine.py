"""What a measurement was made on."""

from __future__ import annotations

import os
import platform
from datetime import date
from importlib.metadata import version


def heading() -> str:
    """Processor, what else it does, memory, versions, date: one line each."""
    processor = next(
        (line.split(":")[1].strip() for line in _lines("/proc/cpuinfo") if line.startswith("model name")),
        platform.machine(),
    )
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    said = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "pin"))
    return (
        f"{date.today().isoformat()}, {len(os.sched_getaffinity(0))} cores of {processor}, {memory:.0f} GiB,"
        f" load {os.getloadavg()[0]:.1f} before\nPython {platform.python_version()}, {said}"
    )


def _lines(path: str) -> list[str]:
    try:
        with open(path) as stream:
            return stream.readlines()
    except OSError:
        return []
