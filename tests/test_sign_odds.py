"""From which odds of the other sign on a measured part is refused, and from which its user is warned."""

from types import SimpleNamespace

import numpy as np
import pytest

from postproc.learning import other_readings
from postproc.learning.other_readings import StatedPart, check_readings


def fail(*_):
    raise np.linalg.LinAlgError


@pytest.mark.parametrize(
    ("odds", "codes"),
    [(50.0, ["LRN004"]), (4.0, ["LRN004"]), (2.0, ["LRN019"]), (-2.0, ["LRN019"]), (-4.0, [])],
)
def test_odds_of_twenty_decide(monkeypatch, odds, codes):
    monkeypatch.setattr(other_readings, "evidence_of", lambda *_: 7.0 + odds)
    monkeypatch.setattr(other_readings, "attribute", fail)
    result = SimpleNamespace(deviation=np.ones(30), evidence=7.0, layout=None)
    part = StatedPart(np.ones(30, bool), False, "part1.csv", False)
    assert [one.code for one in check_readings(None, result, None, [part])] == codes
    seen = StatedPart(np.ones(30, bool), False, "part1.csv", True)
    assert check_readings(None, result, None, [seen]) == []
