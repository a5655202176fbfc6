"""From which odds of the other sign on a measured part is refused, and when its user is asked or warned."""

from types import SimpleNamespace

import numpy as np
import pytest

from postproc.learning import other_readings
from postproc.learning.other_readings import StatedPart, check_readings

COUNT = 30


def fail(*_):
    raise np.linalg.LinAlgError


def codes(monkeypatch, odds, seen=False, repeated=False, learnt=1.0, gain=1.0) -> list[str]:
    """Of a part with the odds exp(``odds``) of the other sign; ``learnt``: share of it that is taken off."""
    monkeypatch.setattr(other_readings, "evidence_of", lambda *_: 7.0 + odds)
    monkeypatch.setattr(other_readings, "attribute", fail)
    deviation = np.linspace(-1e-4, 1e-4, COUNT)
    layout = SimpleNamespace(free=np.zeros((COUNT, 0)), sigma=np.full(COUNT, 1e-5))
    result = SimpleNamespace(
        deviation=deviation,
        evidence=7.0,
        layout=layout,
        kept=np.ones(COUNT, bool),
        by_causes=learnt * deviation,
        by_field=np.zeros(COUNT),
    )
    part = StatedPart(np.ones(COUNT, bool), False, "part1.csv", seen, repeated)
    return [one.code for one in check_readings(None, result, None, [part], gain)]


@pytest.mark.parametrize(
    ("odds", "expected"),
    [
        (50.0, ["LRN004"]),
        (4.0, ["LRN004"]),
        (2.0, ["LRN020"]),
        (-2.0, ["LRN020"]),
        (-6.8, ["LRN020"]),
        (-7.0, []),
    ],
)
def test_odds_of_a_thousand_are_enough_and_of_twenty_too_much(monkeypatch, odds, expected):
    assert codes(monkeypatch, odds) == expected
    assert codes(monkeypatch, odds, seen=True) == []


@pytest.mark.parametrize(
    ("odds", "expected"), [(50.0, ["LRN004"]), (9.0, ["LRN019"]), (-2.0, ["LRN019"]), (-7.0, [])]
)
def test_a_sign_that_is_stated_again_is_refused_only_where_it_is_absurd(monkeypatch, odds, expected):
    assert codes(monkeypatch, odds, repeated=True) == expected


@pytest.mark.parametrize(("learnt", "gain"), [(0.1, 1.0), (1.0, 0.1), (0.0, 1.0)])
def test_a_next_part_that_is_no_worse_either_way_is_only_warned_of(monkeypatch, learnt, gain):
    assert codes(monkeypatch, 0.0, learnt=learnt, gain=gain) == ["LRN019"]


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0, 1.5])
def test_no_correction_is_without_loss_with_both_signs(share):
    """|e - c|^2 + |-e - c|^2 = 2 |e|^2 + 2 |c|^2: one of both is larger than |e| for any c but 0."""
    rng = np.random.default_rng(3)
    for _ in range(200):
        e, c = rng.normal(size=COUNT), share * rng.normal(size=COUNT)
        assert max(np.linalg.norm(e - c), np.linalg.norm(-e - c)) > np.linalg.norm(e)
