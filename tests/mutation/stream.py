"""All mutants in one run of the tests: each test is run as it is, and then once more for each mutant that it comes by.

Imports, collection and what fixtures prepare are paid once for all.  The further runs are processes forked where the
test has just passed, in which the function that holds the mutant has the mutated code (``probes.swap_of``); what a
fixture of a wider scope reaches is prepared anew there.  A mutant that falls meets no further test.

What is left to a judgement of its own (``judging``): mutants of what runs at import, and those that no test here kills;
``Stream.reached`` says which tests come by each, and what these cost.
"""

from __future__ import annotations

import gc
import json
import os
import resource
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from _pytest.runner import runtestprotocol

from mutation import judging
from mutation.mutants import Mutant
from mutation.probes import Probes, Swap, forget_results, swap_of

DEAR_S = 2.0
"""A test of more processor seconds meets mutants later, if these still live."""
WALL_TIMES = 20.0
"""Seconds by the clock that a run may take, a processor second that it is given."""
LIVES, FALLS = 0, 1
"""Exit codes of a run."""
OF_FUNCTION = 2
"""Parametrisations of a test that a mutant meets here: the others are left over."""
BUDGET_S = 4.0
"""Processor seconds of these runs that a mutant may take: a judgement of its own then costs less."""
LIVED = "lived"


@dataclass
class Stream:
    """``seconds``: what each test takes that passes; ``reached``: number of a mutant -> tests that come by it;
    ``met``: those at which it lived; ``killed``: number of a mutant -> (verdict, test)."""

    seconds: dict[str, float] = field(default_factory=dict)
    reached: dict[int, list[str]] = field(default_factory=dict)
    met: dict[int, set[str]] = field(default_factory=dict)
    killed: dict[int, tuple[str, str]] = field(default_factory=dict)

    def add(self, line: dict[str, Any]) -> None:
        test = line["test"]
        self.seconds[test] = line["seconds"]
        for number in line["reached"]:
            self.reached.setdefault(number, []).append(test)
        for number in line["met"]:
            self.met.setdefault(number, set()).add(test)
        for number, verdict in line["killed"]:
            self.killed[number] = verdict, test


def load(path: Path) -> Stream:
    """What a run left, whole or not."""
    stream = Stream()
    for text in path.read_text().splitlines() if path.exists() else ():
        stream.add(json.loads(text))
    return stream


class _Runner:
    """The plug-in of pytest that runs tests again for mutants."""

    def __init__(self, tree: Path, mutants: Sequence[tuple[Mutant, str]], probes: Probes, log: Path) -> None:
        self.tree, self.mutants, self.probes, self.log = tree, mutants, probes, log
        self.stream = load(log)
        self.sources = {mutant.path: (tree / mutant.path).read_text() for mutant, _ in mutants}
        self.fixtures: dict[int, set[int]] = {}
        """id of a fixture of a wider scope -> what it comes by."""
        self.collected: dict[str, set[int]] = {}
        """File of tests -> what its import comes by."""
        self.failed: set[str] = set()
        self.spent: dict[int, float] = {}
        self.swaps: dict[int, Swap | None] = {}
        self.functions: Counter[tuple[int, str]] = Counter()
        self.start = time.monotonic()

    # -- which mutants a test comes by -----------------------------------------------------------------------------

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector: pytest.Collector) -> Iterator[None]:
        before = self.probes.reached.turn(set())
        try:
            return (yield)
        finally:
            file = collector.nodeid.split("::")[0]
            self.collected.setdefault(file, set()).update(self.probes.reached.turn(before))

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Iterator[None]:
        if fixturedef.scope == "function":
            return (yield)
        before = self.probes.reached.turn(set())
        try:
            return (yield)
        finally:
            self.fixtures[id(fixturedef)] = self.probes.reached.turn(before)

    def prepared(self, item: Any) -> tuple[set[int], set[int]]:
        """What the fixtures of a test come by: those of its file, and those of the whole run."""
        of_file: set[int] = set()
        of_run: set[int] = set()
        for definitions in item._fixtureinfo.name2fixturedefs.values():
            for one in definitions:
                (of_run if one.scope == "session" else of_file).update(self.fixtures.get(id(one), ()))
        return of_file, of_run

    # -- the runs --------------------------------------------------------------------------------------------------

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items[:] = [item for item in items if item.nodeid not in self.stream.seconds]
        gc.collect()
        gc.freeze()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed or report.skipped:
            self.failed.add(report.nodeid)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        own: set[int] = set()
        before = self.probes.reached.turn(own)
        start = time.process_time()
        result = yield
        seconds = time.process_time() - start
        self.probes.reached.turn(before)
        line = {"test": item.nodeid, "seconds": seconds, "reached": [], "met": [], "killed": []}
        if item.nodeid not in self.failed:
            of_file, of_run = self.prepared(item)
            imported = self.collected.get(item.nodeid.split("::")[0], set())
            line["reached"] = sorted(own | of_file | of_run | imported)
            if seconds <= DEAR_S:
                for number in sorted(own | of_file):
                    verdict = self.meet(item, number, seconds, number in of_file)
                    if verdict == LIVED:
                        line["met"].append(number)
                    elif verdict:
                        line["killed"].append((number, verdict))
        self.stream.add(line)
        with self.log.open("a", encoding="utf-8") as out:
            out.write(json.dumps(line) + "\n")
        return result

    def meet(self, item: pytest.Item, number: int, seconds: float, anew: bool) -> str:
        """How a mutant fares at a test; empty where it is not asked, or can not be put in place."""
        function = number, item.nodeid.partition("[")[0]
        if number in self.stream.killed or self.spent.get(number, 0.0) > BUDGET_S:
            return ""
        if number not in self.swaps:
            mutant, text = self.mutants[number]
            self.swaps[number] = swap_of(self.tree, mutant, text, self.sources[mutant.path])
        swap = self.swaps[number]
        if swap is None or self.functions[function] >= OF_FUNCTION:
            return ""
        self.functions[function] += 1
        start = os.times()
        verdict = self.run(item, swap, seconds, anew)
        end = os.times()
        used = end.children_user + end.children_system - start.children_user - start.children_system
        self.spent[number] = self.spent.get(number, 0.0) + used
        return verdict

    def run(self, item: pytest.Item, swap: Swap, seconds: float, anew: bool) -> str:
        sys.stdout.flush()
        limit = judging.LIMIT_S + judging.LIMIT_TIMES * seconds
        pid = os.fork()
        if pid == 0:
            self._child(item, swap, limit, anew)
        status = judging.wait(pid, WALL_TIMES * limit)
        if status is None:
            return "timeout"
        if os.WIFSIGNALED(status):
            return "timeout" if os.WTERMSIG(status) == signal.SIGPROF else "killed"
        return LIVED if os.WEXITSTATUS(status) == LIVES else "killed"

    def _child(self, item: Any, swap: Swap, limit: float, anew: bool) -> None:
        """Never returns."""
        code = FALLS
        try:
            os.setsid()
            resource.setrlimit(resource.RLIMIT_AS, (judging.MEMORY, judging.MEMORY))
            signal.signal(signal.SIGPROF, signal.SIG_DFL)
            signal.setitimer(signal.ITIMER_PROF, limit)
            gc.disable()
            swap.put_in_place()
            forget_results(self.tree)
            chain = item.listchain()
            if anew:
                kept = [
                    one for one in chain if not isinstance(one, pytest.Module | pytest.Class | pytest.Item)
                ]
                item.session._setupstate.teardown_exact(SimpleNamespace(listchain=lambda: kept))
            item._initrequest()
            following = SimpleNamespace(listchain=lambda: chain[:-1])
            reports = runtestprotocol(item, log=False, nextitem=following)
            code = FALLS if any(report.failed for report in reports) else LIVES
        finally:
            os._exit(code)


def order(tree: Path, tests: Sequence[str], packages: Sequence[str]) -> list[str]:
    """Files of tests, those first that import what is in the packages: what they test is near, and quick."""
    names = [package.replace("/", ".") for package in packages]

    def far(test: str) -> bool:
        return not any(one.startswith(name) for one in judging.imported(tree / test) for name in names)

    return sorted(tests, key=far)


def run(
    tree: Path,
    mutants: Sequence[tuple[Mutant, str]],
    tests: Sequence[str],
    log: Path,
    tier: str,
) -> Stream:
    """Runs files of tests in a process of its own.  A run that was stopped goes on where it was."""
    pid = os.fork()
    if pid == 0:
        code = 70
        try:
            os.setsid()
            out = os.open(log.with_suffix(".words"), os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(out, 1)
            os.dup2(out, 2)
            judging.stay(tree)
            probes = Probes(tree, [mutant for mutant, _ in mutants])
            probes.install()
            os.environ["POSTPROC_THREADS"] = "1"  # a fork takes one thread along
            plugin = _Runner(tree, mutants, probes, log)
            options = [*judging.OPTIONS, "--hypothesis-profile", judging.PROFILE, "-m", tier]
            code = int(pytest.main([*tests, *options], plugins=[plugin]))
        finally:
            sys.stdout.flush()
            os._exit(code)
    status = judging.wait(pid, None)
    ended = {0, judging.FAILED} | ({judging.NO_TESTS} if log.exists() else set())  # all had been done before
    if status is None or os.WIFSIGNALED(status) or os.WEXITSTATUS(status) not in ended:
        raise RuntimeError(f"the tests did not run to their end: see {log.with_suffix('.words')}")
    return load(log)
