"""Nothing that is read costs more than linear time: no regular expression, no reader."""

from __future__ import annotations

import re
import time

import pytest
from linear import MB, MEGABYTES, SECONDS, all_cases, import_readers, is_linear, measure
from patterns import Pattern, find_patterns
from regex_cost import find_ambiguity

LARGE = {
    "postproc.languages.krl.scan._RUN",
    "postproc.languages.rapid.plain_lines._RUN",
    "postproc.languages.rapid.named_lines._MOTIONS",
}
"""Lines of `_LINE` or `_MOTION` one after the other, all possessive: one line is looked at instead."""

CASES = {f"{case.kind}: {case.name}": case for case in all_cases()}
PARTS = 32
"""Shares of the patterns, one a test."""
RUNS = (*" \t0aA\"'{}([],.-=:;#/", "a ", "1,", "[0", "S ")


@pytest.mark.parametrize(
    ("pattern", "use", "linear"),
    [
        (r"a*b", "match", True),
        (r"a*b", "search", False),
        (r"(?<!a)a*b", "search", True),
        (r"\ba+b", "search", True),
        (r"^a*b", "search", True),
        (r"a*b?", "search", True),
        (r"a*a*b", "match", False),
        (r"a*+a*b", "match", True),
        (r"(a*)*b", "match", False),
        (r"(a|a)*b", "match", False),
        (r"\s*(x)?\s*y", "match", False),
        (r"\s*+(x\s*+)?y", "match", True),
        (r"(.*?)([0-9]+)", "fullmatch", False),
        (r"\d+\.?\d*x", "match", False),
        (r"(?:\d++(?:\.\d*+)?|\.\d++)x", "match", True),
        (r"x(.*)TO(?s:(.*)\Z)", "match", True),
        (r"(?:\[[^\]]*\]\s*)*x", "match", True),
        (r"(?=\s*x)\s*y", "match", True),
        (r"(?:(?!\s*x)\s)*y", "match", False),
    ],
)
def test_the_cost_of_a_pattern(pattern, use, linear):
    assert (find_ambiguity(re.compile(pattern), use) is None) == linear


def patterns() -> list[Pattern]:
    """Of the package, in their order; asked for by a test, not while tests are collected."""
    return [each for each in find_patterns() if each[0] not in LARGE]


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_no_pattern_costs_more_than_linear_time(part):
    costly = {}
    for name, pattern, use in patterns()[part::PARTS]:
        if ambiguity := find_ambiguity(pattern, use):
            costly[name] = ambiguity
    assert not costly


@pytest.mark.slow
def test_all_modules_are_looked_at():
    places = {name for name, _, _ in patterns()}
    assert len(patterns()) > 120
    assert {
        "postproc.languages.krl.lexing._ASSIGNMENT",
        "postproc.languages.gcode.kuka_cnc._SYSTEM",
    } <= places


def _time(pattern: re.Pattern, use: str, text: str | bytes) -> float:
    least = float("inf")
    for _ in range(3):
        start = time.process_time()
        if use == "search":
            for _ in pattern.finditer(text):
                pass
        else:
            getattr(pattern, use)(text)
        least = min(least, time.process_time() - start)
    return least


def _texts(pattern: re.Pattern, size: int) -> list[str | bytes]:
    """Runs, alone and after what the pattern starts with."""
    starts = sorted({"", *re.findall(r"[A-Z]{2,}|[A-Z#$;(\[%O]", str(pattern.pattern))})[:12]
    runs = [run * (size // len(run)) for run in RUNS]
    texts: list = [before + run + after for before in starts for run in runs for after in ("", "!\n")]
    return [text.encode() for text in texts] if isinstance(pattern.pattern, bytes) else texts


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_measured_time_of_patterns(part):
    """The judgement above, in time of the processor: quadratic time at 20,000 characters is more than a second."""
    for name, pattern, use in patterns()[part::PARTS]:
        for text in _texts(pattern, 20_000):
            assert _time(pattern, use, text) < 0.3, (name, text[:20])


SAMPLE = [name for place, name in enumerate(CASES) if place % 191 == 0]


@pytest.mark.sample(24)
@pytest.mark.parametrize("name", SAMPLE)
def test_a_hostile_file_is_read_or_refused_in_time(name):
    import_readers()
    cost = measure(CASES[name], MB // 10)
    assert not cost.error
    assert cost.seconds < 2 * SECONDS
    assert cost.megabytes < MEGABYTES


@pytest.mark.slow
@pytest.mark.parametrize("kind", sorted({case.kind for case in CASES.values()}))
def test_hostile_files_are_read_in_linear_time(kind):
    """Four times as much takes four times as long: judged where it takes so long that it can be judged."""
    import_readers()
    of_kind = [(name, case) for name, case in CASES.items() if case.kind == kind]
    for name, case in of_kind[:: 1 if kind == "urdf" else 25]:
        small = measure(case, MB // 10)
        assert not small.error, name
        assert small.seconds < 2 * SECONDS, name
        assert small.megabytes < MEGABYTES, name
        if small.seconds > 0.3:
            assert is_linear(case, MB // 20), name
