"""Which tests reach a line, and what each costs: the suite once, under coverage, a context for each test."""

from __future__ import annotations

import ast
import json
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import coverage
import pytest

EVERYONE = ""
"""Context of lines that run while modules are imported."""


class _Contexts:
    """Names each test to coverage; what a fixture of a whole file does belongs to all tests of the file."""

    def __init__(self, cover: coverage.Coverage) -> None:
        self.cover = cover
        self.seconds: dict[str, float] = {}
        self.failed: set[str] = set()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self.cover.switch_context(item.nodeid)
        start = time.process_time()
        result = yield
        self.seconds[item.nodeid] = time.process_time() - start
        self.cover.switch_context(EVERYONE)
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Iterator[None]:
        if fixturedef.scope == "function":
            return (yield)
        self.cover.switch_context(request.node.nodeid.split("::")[0])
        result = yield
        self.cover.switch_context(os.environ["PYTEST_CURRENT_TEST"].rpartition(" ")[0])
        return result

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed or report.skipped:
            self.failed.add(report.nodeid)


@dataclass(frozen=True)
class Cover:
    """``lines``: file -> line -> tests; ``seconds``: what each test that passes takes; ``imports``: file of tests ->
    the modules that it names."""

    lines: dict[str, dict[int, list[str]]]
    seconds: dict[str, float]
    imports: dict[str, list[str]]

    def reaching(self, path: str, first: int, last: int) -> list[str]:
        """Tests that run a line of first..last.  What runs at import is reached by all that run anything of the file,
        and by those that import it or its package."""
        lines = self.lines.get(path, {})
        names = {name for line in range(first, last + 1) for name in lines.get(line, [])}
        if EVERYONE in names:
            module = path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
            wanted = {module, module.rpartition(".")[0]}
            names = {name for tests in lines.values() for name in tests}
            names |= {file for file, modules in self.imports.items() if wanted & set(modules)}
        for file in [name for name in names if name and "::" not in name]:
            names |= {test for test in self.seconds if test.startswith(file + "::")}
        return sorted(names & self.seconds.keys())

    def save(self, path: Path) -> None:
        names = sorted({name for of in self.lines.values() for tests in of.values() for name in tests})
        number = {name: i for i, name in enumerate(names)}
        lines = {
            file: {line: [number[name] for name in tests] for line, tests in of.items()}
            for file, of in self.lines.items()
        }
        kept = {"names": names, "lines": lines, "seconds": self.seconds, "imports": self.imports}
        path.write_text(json.dumps(kept))


def load(path: Path) -> Cover:
    read = json.loads(path.read_text())
    names = read["names"]
    lines = {
        file: {int(line): [names[i] for i in tests] for line, tests in of.items()}
        for file, of in read["lines"].items()
    }
    return Cover(lines, read["seconds"], read["imports"])


def imported(path: Path) -> list[str]:
    """Modules that a file names in its imports, and what it takes from them."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return sorted(found)


def cover(tree: Path, packages: list[str], tests: list[str]) -> Cover:
    """Runs the tests of a tree in this process, with its package first in ``sys.path``."""
    watch = coverage.Coverage(data_file=None, include=[f"{tree}/{package}/*" for package in packages])
    contexts = _Contexts(watch)
    watch.start()
    try:
        options = ["-q", "-n", "0", "-m", "slow or not slow", "-p", "no:cacheprovider", "-p", "no:benchmark"]
        pytest.main([*tests, *options], plugins=[contexts])
    finally:
        watch.stop()
    data = watch.get_data()
    lines = {
        str(Path(file).relative_to(tree)): data.contexts_by_lineno(file)
        for file in sorted(data.measured_files())
    }
    seconds = {name: cost for name, cost in contexts.seconds.items() if name not in contexts.failed}
    return Cover(lines, seconds, {test: imported(tree / test) for test in tests})
