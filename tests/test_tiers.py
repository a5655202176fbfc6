"""Which tests the fast tier has."""

import os
import re
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import settings
from tiers import FAST, STOCK, examples, in_sample

import postproc


@pytest.mark.parametrize("of", [1, 2, 5, 12, 984])
@pytest.mark.parametrize("count", [1, 2, 3, 20])
def test_a_sample_has_as_many_as_asked_for_from_the_first_to_the_last(of, count):
    chosen = [k for k in range(of) if in_sample(k, of, count)]
    assert len(chosen) == min(of, count)
    assert chosen[0] == 0
    assert chosen[-1] == of - 1 or count == 1
    steps = {later - earlier for earlier, later in pairwise(chosen)}
    assert max(steps, default=0) - min(steps, default=0) <= 1


def test_laws_try_all_their_examples_where_everything_runs(request):
    share = settings.default.max_examples / 100
    if not (request.config.getoption("--hypothesis-profile") or "HYPOTHESIS_PROFILE" in os.environ):
        assert (share < 1) == (request.config.getoption("markexpr") == FAST)
    assert examples(400) == max(8, round(400 * share))
    assert examples(5) >= 5


@pytest.mark.slow
def test_a_slow_test_runs_where_it_is_asked_for(request):
    assert request.config.getoption("markexpr") != FAST


def test_every_room_has_tests_in_the_fast_tier(request):
    """A test file is of those rooms that it imports from."""
    files = {item.path for item in request.session.items if not item.get_closest_marker("slow")}
    if len(files) < 0.9 * len(list(Path(__file__).parent.glob("test_*.py"))):
        pytest.skip("not all files are collected")
    tested = {room for path in files for room in re.findall(r"\bpostproc\.(\w+)", path.read_text())}
    rooms = {path.parent.name for path in Path(postproc.__file__).parent.glob("*/__init__.py")}
    assert len(rooms) > 10
    assert rooms <= tested


def test_the_first_tests_are_those_that_simulate_a_stock(request):
    first = [item.path.name.startswith(STOCK) for item in request.session.items]
    assert first == sorted(first, reverse=True)
    assert all(any(Path(__file__).parent.glob(f"{start}*.py")) for start in STOCK)
