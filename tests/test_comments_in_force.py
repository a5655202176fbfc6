"""What is in force where paths meet: a lattice, whatever the order in which they come."""

from __future__ import annotations

from itertools import product

import pytest

from postproc.languages.core.comments_in_force import VARYING, CommentInForce, join_comments

OFF, ONE, SAME, TWO = (
    CommentInForce.of(text, line)
    for line, text in enumerate(("FORCE OFF", "FORCE 1 0 0", "force  1 0 0", "FORCE 2 0 0"))
)
EVERY = (None, OFF, ONE, TWO, VARYING)
ON = CommentInForce.of("compensate  on", 9)


def test_the_join_of_paths_is_a_lattice() -> None:
    for one, other, third in product(EVERY, repeat=3):
        assert join_comments(one, other) == join_comments(other, one)
        both = join_comments(join_comments(one, other), third)
        assert both == join_comments(one, join_comments(other, third))
        assert join_comments(one, one) == one


@pytest.mark.parametrize(
    ("one", "other", "joined"),
    [
        (None, OFF, None), (None, ONE, VARYING), (ONE, SAME, ONE), (ONE, TWO, VARYING), (OFF, ONE, VARYING),
        (OFF, VARYING, VARYING), (None, ON, None), (ON, CommentInForce.of("COMPENSATE OFF", 10), VARYING),
    ],
)  # fmt: skip
def test_what_is_in_force_where_two_paths_meet(one, other, joined) -> None:
    assert join_comments(one, other) == joined
