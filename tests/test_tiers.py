"""Which tests the fast tier has."""

import os
from itertools import pairwise

import pytest
from hypothesis import settings
from tiers import FAST, examples, in_sample


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
