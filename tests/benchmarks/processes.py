"""One process: how long it took, by the clock and by the processor, and its largest memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import postproc


class Cost(NamedTuple):
    """Wall and processor time (user and system) [s], largest memory [MB]."""

    wall: float
    cpu: float
    memory: float


@cache
def as_installed() -> dict[str, str]:
    """The environment of a program that is installed: its byte code is there, whatever this process was told."""
    environment = {name: word for name, word in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    words = [sys.executable, "-m", "compileall", "-q", str(Path(postproc.__file__).parent)]
    subprocess.run(words, check=True, env=environment)
    return environment


def cost_of(words: Sequence[object], good: Sequence[int] = (0,)) -> Cost:
    """Run ``words``; raises SystemExit where it does not end with a code in ``good``."""
    environment = as_installed()
    begin = time.perf_counter()
    process = subprocess.Popen([str(word) for word in words], stdout=subprocess.DEVNULL, env=environment)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - begin
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in good:
        raise SystemExit(f"{' '.join(map(str, words))} ended with {process.returncode}")
    return Cost(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024 / 1e6)


def compensation(program: Path, count: int) -> Cost:
    """The main job as a user starts it: all reports, and what was written is read back.

    Raises SystemExit where fewer than ``count`` motions were corrected: it would not be the cost of correcting them.
    """
    cost = cost_of([sys.executable, "-m", "postproc", program, "--force", "-q"], (0, 3))
    report = json.loads((program.parent / "compensated" / f"{program.stem}.report.json").read_bytes())
    if report["corrected"] < count:
        raise SystemExit(f"{program.name}: {report['corrected']} of {count} motions were corrected: void")
    return cost
