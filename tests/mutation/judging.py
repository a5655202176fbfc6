"""One mutant against its tests: in a process of its own, forked where all that is slow to import is there already."""

from __future__ import annotations

import ast
import contextlib
import functools
import os
import resource
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import hypothesis
import pytest

LIMIT_S, LIMIT_TIMES = 5.0, 10.0
"""Processor seconds that a test may take: a constant, and so many times what it takes unmutated."""
WALL_S = 900.0
MEMORY = 8 << 30
HEAVY = (
    "numpy",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.spatial.transform",
    "scipy.stats",
    "scipy.sparse.linalg",
    "pinocchio",
    "matplotlib.figure",
    "yaml",
    "click",
    "rich.console",
    "jinja2",
)
NO_TESTS = 5
FAILED = 1
FAST, ALL = "not slow", "slow or not slow"
"""Tiers, as ``-m`` has them."""
PROFILE = "mutation"
"""Of hypothesis."""
OPTIONS = ["-q", "-n", "0", "--tb=line"]
OPTIONS += [word for name in ("cacheprovider", "benchmark", "randomly") for word in ("-p", f"no:{name}")]


def warm(tier: str = ALL) -> None:
    """Imports what every judgement needs and no mutant touches."""
    for name in HEAVY:
        __import__(name)
    register_profile(tier)


def register_profile(tier: str) -> None:
    """How hypothesis draws: alike for every mutant."""
    # what fails is not made smaller, and nothing hangs on the speed of this machine
    phases = [hypothesis.Phase.explicit, hypothesis.Phase.generate]
    hypothesis.settings.register_profile(
        PROFILE,
        max_examples=10 if tier == FAST else 100,
        deadline=None,
        phases=phases,
        derandomize=True,
        database=None,
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    hypothesis.settings.load_profile(PROFILE)


@functools.cache  # many files of tests import the same modules of the tests
def imported(path: Path) -> list[str]:
    """Modules that a file names in its imports, and what it takes from them."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return sorted(found)


def wait(pid: int, seconds: float | None) -> int | None:
    """The status with which a child ended; None where it did not within so many seconds by the clock: it is killed.
    It leads a group of processes, which goes with it; so it does where this process is told to end."""
    end = None if seconds is None else time.monotonic() + seconds
    nap, done, status = 0.001, 0, 0
    try:
        while not done and (end is None or time.monotonic() < end):
            time.sleep(nap)
            nap = min(1.5 * nap, 0.05)
            done, status = os.waitpid(pid, os.WNOHANG)
    finally:
        if not done:
            with contextlib.suppress(ProcessLookupError):  # before it leads a group
                os.killpg(pid, signal.SIGKILL)
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
    return status if done else None


def limit(seconds: float) -> float:
    """Processor seconds that a test may take which takes ``seconds`` unmutated."""
    return LIMIT_S + LIMIT_TIMES * seconds


class _Chosen:
    """Runs the chosen tests, in the given order, each with a limit; notes the first that fails."""

    def __init__(self, seconds: dict[str, float], note: Path) -> None:
        self.place = {name: place for place, name in enumerate(seconds)}
        self.seconds = seconds
        self.note = note

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        chosen = {item.nodeid: item for item in items if item.nodeid in self.place}
        items[:] = sorted(chosen.values(), key=lambda item: self.place[item.nodeid])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self.note.write_text(item.nodeid)
        signal.setitimer(signal.ITIMER_PROF, limit(self.seconds[item.nodeid]))
        return (yield)


def _child(tree: Path, seconds: dict[str, float], note: Path, words: Path, tier: str) -> None:
    """Never returns: the exit code is pytest's."""
    code = 70
    try:
        os.setsid()
        out = os.open(words, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 1)
        os.dup2(out, 2)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        for number in (signal.SIGPROF, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, 60.0)
        stay(tree)
        os.environ["PYTHONDONTWRITEBYTECODE"] = "1"  # a mutant leaves no byte code behind
        sys.dont_write_bytecode = True
        register_profile(tier)
        files = list(dict.fromkeys(name.split("::")[0] for name in seconds))
        options = ["-x", *OPTIONS, "--hypothesis-profile", PROFILE, "-m", tier]
        code = int(pytest.main([*files, *options], plugins=[_Chosen(seconds, note)]))
    finally:
        sys.stdout.flush()
        os._exit(code)


def stay(tree: Path) -> None:
    """From here on the tree's package and tests are imported, also by commands that the tests start."""
    home = Path(__file__).parent.parent
    sys.path[:] = [str(tree), *(name for name in sys.path if name and Path(name) not in (home, home.parent))]
    os.environ["PYTHONPATH"] = str(tree)
    os.chdir(tree)


def judge(tree: Path, seconds: dict[str, float], folder: Path, tier: str = ALL) -> tuple[str, str]:
    """("killed" | "timeout" | "survived", the test at which it ended): tests -> processor seconds, in their order."""
    note, words = folder / "note", folder / "words"
    note.write_text("import")
    pid = os.fork()
    if pid == 0:
        _child(tree, seconds, note, words, tier)
    status = wait(pid, WALL_S)
    return verdict(status, words) if status is not None else "timeout", note.read_text()


def ended(status: int, otherwise: dict[int, str]) -> str:
    """What a status says of a mutant: "timeout", "killed", or what ``otherwise`` says of an exit code."""
    if os.WIFSIGNALED(status):
        return "timeout" if os.WTERMSIG(status) == signal.SIGPROF else "killed"
    return otherwise.get(os.WEXITSTATUS(status), "killed")


def verdict(status: int, words: Path) -> str:
    code: Any = None if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)
    if code == NO_TESTS or code in (3, 4, 70):
        raise RuntimeError(f"the tests did not run (pytest {code}): see {words}")
    return ended(status, {0: "survived"})
