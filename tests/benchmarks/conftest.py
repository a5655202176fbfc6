"""Benchmarks share the helpers of the tests, one run of the main job, and a table of times a motion.

    OMP_NUM_THREADS=1 python -m pytest tests/benchmarks

Processor time of one thread: what else the machine does is not counted.
"""

import os
import sys
import time
from pathlib import Path

import pytest

os.environ.setdefault("POSTPROC_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.benchmarks.work import work_of

MOTIONS = 20_000

TABLE: dict[str, float] = {}
"""Name of a case -> us a motion."""


@pytest.fixture(scope="session", params=["krl", "gcode"])
def work(request, tmp_path_factory):
    """The job on a program of each language."""
    return work_of(tmp_path_factory.mktemp("work"), request.param, MOTIONS)


@pytest.fixture(scope="session")
def krl(tmp_path_factory):
    return work_of(tmp_path_factory.mktemp("krl"), "krl", MOTIONS)


@pytest.fixture
def measured(benchmark, request):
    """``measured(work, count)``: what ``work()`` returns, and the time of it for each of ``count`` in the table."""

    def call(work, count=MOTIONS):
        result = benchmark.pedantic(work, rounds=5, warmup_rounds=1)
        us = benchmark.stats.stats.min / count * 1e6
        TABLE[request.node.name.removeprefix("test_").replace("_", " ")] = us
        benchmark.extra_info["us a motion"] = us
        return result

    return call


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config):
    """One process, with nothing beside it."""
    config.option.numprocesses = 0


def pytest_collection_modifyitems(items):
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.benchmark(timer=time.process_time))


def pytest_terminal_summary(terminalreporter):
    if TABLE:
        terminalreporter.write_sep("-", "processor time, least of the rounds")
    for name, us in TABLE.items():
        terminalreporter.write_line(f"{name:56} {us:9.3f} us a motion")
