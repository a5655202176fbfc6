"""All mutants in one process that has imported, collected and run the tests once.

First each test is run as it is, and what it comes by is noted.  Then, for each mutant, a process is forked in which the
function that holds the mutant has the mutated code (``probes.swap_of``), and in it the tests that come by the mutant
are run, the quickest and those that killed before first, up to the first that fails.  Fixtures are prepared anew there,
and what functions of the tree have cached is forgotten.

What is left to a judgement of its own (``judging``): mutants of what runs at import alone, functions too.
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
from itertools import zip_longest
from pathlib import Path
from typing import Any, Protocol

import pytest
from _pytest.runner import runtestprotocol

from mutation import judging
from mutation.mutants import Mutant
from mutation.probes import Probes, forget_results, swap_of

WALL_TIMES = 20.0
"""Seconds by the clock that a run may take, a processor second that it is given."""
LIVES, FALLS = 0, 1
"""Exit codes of a run."""


@dataclass
class Stream:
    """``seconds``: what each test takes that passes; ``reached``: number of a mutant -> tests that come by it; ``ran``:
    those that tests come by while they run, and not only what they import;
    ``verdicts``: number of a mutant -> (verdict, test at which it fell); ``ended``: all that can be done here is;
    ``not_run``: tests for which the seconds had no room."""

    seconds: dict[str, float] = field(default_factory=dict)
    reached: dict[int, list[str]] = field(default_factory=dict)
    ran: set[int] = field(default_factory=set)
    verdicts: dict[int, tuple[str, str]] = field(default_factory=dict)
    ended: bool = False
    not_run: int = 0

    def add(self, line: dict[str, Any]) -> None:
        if "ended" in line:
            self.ended, self.not_run = True, line.get("not run", 0)
            return
        if "mutant" in line:
            self.verdicts[line["mutant"]] = line["verdict"], line["test"]
            return
        self.seconds[line["test"]] = line["seconds"]
        self.ran |= set(line["ran"])
        for number in line["reached"]:
            self.reached.setdefault(number, []).append(line["test"])

    def kills(self) -> Counter[str]:
        """How many mutants fell at each test."""
        return Counter(test for verdict, test in self.verdicts.values() if verdict != "survived")

    def choice(self, number: int, seconds: float) -> dict[str, float]:
        """Tests that come by a mutant, with what they take, in the order in which it meets them: quick ones and those
        that killed before; of so many seconds in all, or the first alone."""
        cost, kills = self.seconds, self.kills()
        names = sorted(self.reached.get(number, ()), key=lambda name: (cost[name] + 0.02) / (1 + kills[name]))
        chosen: dict[str, float] = {}
        spent = 0.0
        for name in names:
            spent += cost[name]
            if spent <= seconds or not chosen:
                chosen[name] = cost[name]
        return chosen


class Further(Protocol):
    """Which tests run, in which order; seconds of the processor that each and all may take, unmutated."""

    each: float
    all: float

    def in_order(self, items: Sequence[pytest.Item]) -> list[pytest.Item]: ...


class TooLong(BaseException):
    """A test takes more seconds than it may; no ``Exception``, which a law would try to make smaller."""


def _too_long(*_: Any) -> None:
    raise TooLong


def load(path: Path) -> Stream:
    """What a run left, whole or not."""
    stream = Stream()
    for text in path.read_text().splitlines() if path.exists() else ():
        stream.add(json.loads(text))
    return stream


class _Runner:
    """The plug-in of pytest that runs the tests, and then some of them again for each mutant."""

    def __init__(
        self,
        tree: Path,
        mutants: Sequence[tuple[Mutant, str]],
        probes: Probes,
        log: Path,
        seconds: float,
        further: Further | None,
    ) -> None:
        self.further = further
        self.tree, self.mutants, self.probes, self.log, self.budget = tree, mutants, probes, log, seconds
        self.stream = load(log)
        self.fixtures: dict[int, set[int]] = {}
        """id of a fixture of a wider scope -> what it comes by."""
        self.collected: dict[str, set[int]] = {}
        """File of tests -> what its import comes by."""
        self.failed: set[str] = set()
        self.imported: dict[str, set[int]] = {}
        """File of tests -> mutants that run at import, of the modules that it imports."""

    def keep(self, line: dict[str, Any]) -> None:
        self.stream.add(line)
        with self.log.open("a", encoding="utf-8") as out:
            out.write(json.dumps(line) + "\n")

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

    def prepared(self, item: Any) -> set[int]:
        """What the fixtures of wider scopes that a test has come by."""
        found: set[int] = set()
        for definitions in item._fixtureinfo.name2fixturedefs.values():
            for one in definitions:
                found |= self.fixtures.get(id(one), set())
        return found

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed or report.skipped:
            self.failed.add(report.nodeid)

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        if self.further is not None:
            items[:] = self.further.in_order(items)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        own: set[int] = set()
        before = self.probes.reached.turn(own)
        if self.further is not None:
            signal.signal(signal.SIGPROF, _too_long)
            signal.setitimer(signal.ITIMER_PROF, self.further.each)
        start = time.process_time()
        result = yield
        seconds = time.process_time() - start
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        self.probes.reached.turn(before)
        if item.nodeid in self.failed:
            own, ran = set(), []
        else:
            ran = sorted(own | self.prepared(item))
            file = item.nodeid.split("::")[0]
            own |= (
                self.prepared(item)
                | self.collected.get(file, set())
                | self.probes.of_tables
                | self.read(file)
            )
        self.keep({"test": item.nodeid, "seconds": seconds, "reached": sorted(own), "ran": ran})
        return result

    def read(self, file: str) -> set[int]:
        """Mutants that run at import, of the modules that a file of tests imports."""
        if file not in self.imported:
            names = judging.imported(self.tree / file)
            self.imported[file] = set().union(*(self.probes.at_import.get(name, set()) for name in names))
        return self.imported[file]

    # -- the runs --------------------------------------------------------------------------------------------------

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        items = [item for item in session.items if item.nodeid not in self.stream.seconds]
        spent = sum(self.stream.seconds.values())
        for item, following in zip_longest(items, items[1:]):
            is_last = self.further is not None and spent >= self.further.all
            session.config.hook.pytest_runtest_protocol(item=item, nextitem=None if is_last else following)
            spent += self.stream.seconds[item.nodeid]
            if is_last:
                break
        gc.collect()
        gc.freeze()
        by_name = {item.nodeid: item for item in session.items}
        for number in range(len(self.mutants)):
            if number not in self.stream.verdicts:
                self.judge(number, by_name)
        self.keep({"ended": True, "not run": len(set(by_name) - set(self.stream.seconds))})
        return True

    def judge(self, number: int, items: dict[str, pytest.Item]) -> None:
        """Lets a mutant meet its tests; nothing is kept of one that can not be put in place."""
        mutant, text = self.mutants[number]
        chosen = self.stream.choice(number, self.budget)
        swap = swap_of(self.tree, mutant, text, (self.tree / mutant.path).read_text(encoding="utf-8"))
        if not chosen or swap is None or number not in self.stream.ran:
            return
        note = self.log.with_suffix(".note")
        note.write_text("")
        sys.stdout.flush()
        pid = os.fork()
        if pid == 0:
            code = FALLS
            try:
                os.setsid()
                resource.setrlimit(resource.RLIMIT_AS, (judging.MEMORY, judging.MEMORY))
                signal.signal(signal.SIGPROF, signal.SIG_DFL)
                signal.signal(signal.SIGTERM, signal.SIG_DFL)
                swap.put_in_place()
                forget_results(self.tree)
                code = _run([items[name] for name in chosen], chosen, note)
            finally:
                os._exit(code)
        limit = sum(map(judging.limit, chosen.values()))
        status = judging.wait(pid, WALL_TIMES * limit)
        verdict = "timeout" if status is None else judging.ended(status, {LIVES: "survived"})
        self.keep(
            {"mutant": number, "verdict": verdict, "test": "" if verdict == "survived" else note.read_text()}
        )


def _run(items: Sequence[Any], seconds: dict[str, float], note: Path) -> int:
    """Runs tests up to the first that fails; each has a limit."""
    for item, following in zip_longest(items, items[1:]):
        note.write_text(item.nodeid)
        signal.setitimer(signal.ITIMER_PROF, judging.limit(seconds[item.nodeid]))
        item._initrequest()
        if any(report.failed for report in runtestprotocol(item, log=False, nextitem=following)):
            return FALLS
    return LIVES


def is_near(tree: Path, test: str, packages: Sequence[str]) -> bool:
    """Whether a file of tests imports what is in the packages, itself or through modules of the tests, or the package
    around them, which leads to it."""
    names = tuple(package.replace("/", ".") for package in packages)
    around = {name.rpartition(".")[0] for name in names if name.count(".") > 1}
    open_, seen = [tree / test], set()
    while open_:
        found = judging.imported(open_.pop())
        if any(one.startswith(names) or one in around for one in found):
            return True
        paths = {_of_tests(tree, one) for one in found} - {None} - seen
        seen |= paths
        open_ += [path for path in paths if path is not None]
    return False


def _of_tests(tree: Path, module: str) -> Path | None:
    """The file of a module of the tests, None for another."""
    path = (tree / "tests").joinpath(*module.split("."))
    files = (path.with_suffix(".py"), path / "__init__.py")
    return next((one for one in files if one.is_file()), None)


def run(
    tree: Path,
    mutants: Sequence[tuple[Mutant, str]],
    tests: Sequence[str],
    log: Path,
    seconds: float,
    tier: str,
    further: Further | None = None,
) -> Stream:
    """Runs files of tests in a process of its own, and at most so many processor seconds of them for a mutant.  A run
    that was stopped goes on where it was.  ``further``: which of them, and how long, all without it."""
    seen = load(log)
    if seen.ended:
        return seen
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
            plugin = _Runner(tree, mutants, probes, log, seconds, further)
            options = [*judging.OPTIONS, "--hypothesis-profile", judging.PROFILE, "-m", tier]
            code = int(pytest.main([*tests, *options], plugins=[plugin]))
        finally:
            sys.stdout.flush()
            os._exit(code)
    status = judging.wait(pid, None)
    ended = {0, judging.FAILED} | (
        {judging.NO_TESTS} if load(log).seconds else set()
    )  # all had been run before
    if status is None or os.WIFSIGNALED(status) or os.WEXITSTATUS(status) not in ended:
        raise RuntimeError(f"the tests did not run to their end: see {log.with_suffix('.words')}")
    return load(log)
