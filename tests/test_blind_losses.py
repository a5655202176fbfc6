"""How answers with and without a stated scatter are compared."""

import pytest
from blind.real_command import loss_of

TRUTH = frozenset({("backlash", "A2")})


def answer(word, named=(), sets=()):
    return {
        "verdict": word,
        "named": [{"effect": effect, "joints": [joint]} for effect, joint in named],
        "alternatives": [[{"effect": effect, "joint": joint} for effect, joint in one] for one in sets],
    }


@pytest.mark.parametrize(
    ("told", "loss"),
    [
        (answer("named", [("backlash", "A2")]), 0),
        (answer("partly_named", [("backlash", "A2")]), 0),
        (answer("ambiguous", sets=[[("backlash", "A2"), ("hysteresis", "A2")]]), 1),
        (answer("ambiguous", [("payload", "")], [[("backlash", "A2"), ("hysteresis", "A2")]]), 3),
        (answer("ambiguous", [("backlash", "A2")], [[("payload", ""), ("hysteresis", "A2")]]), 3),
        (answer("unknown"), 2),
        (answer("nothing_missing"), 2),
        (answer("named", [("backlash", "A3")]), 3),
        ({"verdict": "refused"}, 2),
    ],
)
def test_what_an_answer_is_worth(told, loss):
    assert loss_of(told, TRUTH, TRUTH) == loss


def test_nothing_is_right_where_nothing_is():
    assert loss_of(answer("nothing_missing"), frozenset(), frozenset()) == 0
    assert loss_of(answer("unknown"), frozenset(), frozenset()) == 2
