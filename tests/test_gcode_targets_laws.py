"""Targets as numbers: a control that reads what is written arrives where it was meant to, and no number is written
that need not be."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from postproc.base.arrays import Floats
from postproc.languages.gcode.writer_targets import Followed, Wanted, follow, follow_whole

NAN = np.nan


def motions(random: np.random.Generator, n: int, columns: int = 3) -> Wanted:
    """Absolute, relative and absent words, some of them off by some of a step; full circles, blocks that stay."""
    shape = (n, columns)
    source: Floats = np.asarray(np.round(np.cumsum(random.normal(0, 3, shape), axis=0), 2), np.float64)
    relative = np.repeat(random.random((n, 1)) < 0.3, columns, axis=1)
    begin = np.concatenate([np.zeros((1, columns)), source[:-1]])
    absent = random.random(shape) < 0.4
    # An absent word: the motion ends where it begins.
    for row in range(n):
        source[row] = np.where(absent[row], source[row - 1] if row else 0.0, source[row])
        begin[row] = source[row - 1] if row else 0.0
    decimals = random.integers(2, 5, shape)
    fixed = random.random(n) < 0.2
    moved: Floats = source + random.choice([0, 0, 0.3, -0.45, 0.55, 2.0], shape) * 10.0**-decimals
    wanted: Floats = np.where(fixed[:, None], source, moved)
    return Wanted(
        wanted, source, np.where(absent, NAN, np.where(relative, source - begin, source)), relative, decimals,
        fixed, np.zeros(shape, np.bool_), begin, np.zeros(shape, np.bool_),
    )  # fmt: skip


def followed(wanted: Wanted, start: Floats | None = None, a: int = 0, b: int | None = None) -> Followed:
    into = Followed.nothing(wanted)
    n, columns = wanted.wanted.shape
    follow(wanted, np.zeros(columns) if start is None else start, a, n if b is None else b, into)
    return into


def arrived(wanted: Wanted, into: Followed, start: float, column: int) -> Floats:
    """Where a control arrives with what is written."""
    at, ends = start, []
    for k in range(len(wanted.fixed)):
        word = into.number[k, column] if into.write[k, column] else wanted.own[k, column]
        if np.isfinite(word):
            at = at + word if wanted.relative[k, column] else word
        ends.append(at)
    return np.array(ends)


@pytest.mark.parametrize("seed", range(20))
def test_a_control_arrives_where_it_was_meant_to(seed: int) -> None:
    """Within half a step; blocks that stay carry on by their increments what came before."""
    random = np.random.default_rng(seed)
    wanted = replace(motions(random, 40), fixed=np.zeros(40, np.bool_))
    before = wanted.decimals.copy()
    into = followed(wanted)
    for column in range(3):
        ends = arrived(wanted, into, 0.0, column)
        np.testing.assert_allclose(into.end[:, column], ends, atol=1e-12)
        half = 0.5 * 10.0 ** -wanted.decimals[:, column]
        assert (np.abs(ends - wanted.wanted[:, column]) <= half + 2e-9).all()
        np.testing.assert_array_equal(into.start[:, column], np.append(0.0, into.end[:-1, column]))
    np.testing.assert_array_equal(wanted.decimals, before)
    digits = into.number * 10.0**before
    assert np.abs(digits - np.rint(digits))[into.write].max() < 1e-6


@pytest.mark.parametrize("seed", range(20))
def test_a_number_is_written_only_where_it_is_needed(seed: int) -> None:
    """As it stands, or absent, it would lead farther than half a step from where it should."""
    wanted = motions(np.random.default_rng(seed), 40)
    into = followed(wanted)
    assert not into.write[wanted.fixed].any()
    for k, column in np.argwhere(~wanted.fixed[:, None] & np.ones((1, 3), np.bool_)).tolist():
        own, origin = wanted.own[k, column], into.start[k, column]
        there = origin if np.isnan(own) else own + origin * wanted.relative[k, column]
        off = abs(there - wanted.wanted[k, column]) / 10.0 ** -wanted.decimals[k, column]
        assert into.write[k, column] == (off > 0.5 + 1e-4), (k, column, off)


def one(own: float, want: float, source: float, **said: Any) -> tuple[Wanted, Followed]:
    """One motion of one column from 10; two decimals."""
    words = {
        "relative": False,
        "fixed": False,
        "closed": False,
        "origin": 10.0,
        "resumes": False,
        "start": 10.0,
    } | said
    wanted = Wanted(
        np.array([[want]]), np.array([[source]]), np.array([[own]], float), np.array([[words["relative"]]]),
        np.array([[2]]), np.array([words["fixed"]]), np.array([[words["closed"]]]), np.array([[words["origin"]]]),
        np.array([[words["resumes"]]]),
    )  # fmt: skip
    return wanted, followed(wanted, np.array([words["start"]]))


ONES: list[tuple[float, float, float, dict[str, Any], float | None, float]] = [
    # own, wanted, source, further, the number that is written, where the motion ends
    (1, 1.004, 1, {}, None, 1),
    (1, 1.0051, 1, {}, 1.01, 1.01),
    (1, 0.9949, 1, {}, 0.99, 0.99),
    (1, NAN, 1, {}, None, 1),
    (NAN, NAN, 10, {}, None, NAN),
    (NAN, 10.004, 10, {}, None, 10),
    (NAN, 10.0051, 10, {}, 10.01, 10.01),
    (NAN, 10.004, 10, {"start": 10.01}, 10.0, 10.0),
    (NAN, 10.004, 10, {"start": 10.008}, None, 10.008),
    (2, 12.004, 12, {"relative": True}, None, 12),
    (2, 12.004, 12, {"relative": True, "start": 10.01}, 1.99, 12),
    (2, 12.1, 12, {"relative": True}, 2.1, 12.1),
    (NAN, 10.1, 10, {"relative": True}, 0.1, 10.1),
    (2, NAN, 12, {"relative": True}, None, NAN),
    # Where it begins is not known: an increment stays, and what did not move.
    (2, 12.1, 12, {"relative": True, "start": NAN}, None, 12.1),
    (NAN, 10.004, 10, {"start": NAN}, None, 10.004),
    (NAN, 10.1, 10, {"start": NAN}, 10.1, 10.1),
    (NAN, 10.1, NAN, {"start": NAN}, 10.1, 10.1),
    (NAN, 10.1, NAN, {"relative": True, "start": NAN}, None, 10.1),
    # What stays: with a number it ends there, without one where it begins.
    (1, 1.0, 1, {"fixed": True}, None, 1.0),
    (1, 1.1, 1, {"fixed": True}, None, 1.1),
    (NAN, 10.0, 10, {"fixed": True, "start": 10.3}, None, 10.3),
    (NAN, 12.0, 12, {"fixed": True, "start": 10.3}, None, 12.0),
    (NAN, 10.0, 10, {"fixed": True, "start": NAN}, None, 10.0),
    (2, 12.0, 12, {"fixed": True, "relative": True, "start": 10.3}, None, 12.0),
    # It begins elsewhere than the motion before ends.
    (NAN, 10.0, 10, {"resumes": True, "start": 11.0}, None, 10.0),
    (NAN, 11.0, 11, {"resumes": True, "start": 11.0}, 11.0, 11.0),
    (2, 12.0, 12, {"resumes": True, "relative": True, "start": 11.0}, None, 12.0),
    (NAN, 10.0, 10, {"resumes": True, "origin": NAN, "start": 11.0}, None, 10.0),
    (NAN, 10.0, 10, {"fixed": True, "resumes": True, "start": 11.0}, None, 10.0),
    # A circle closes where it begins, with the digits that this takes.
    (10, 10.0, 10, {"closed": True}, None, 10),
    (10, 10.1, 10, {"closed": True, "start": 10.123}, 10.123, 10.123),
    (10, 10.1, 10, {"closed": True, "start": 10.1234567}, 10.1234567, 10.1234567),
    (10, 10.0, 10, {"closed": True, "start": 10.004}, 10.004, 10.004),
    (NAN, 10.1, 10, {"closed": True, "start": 10.123}, None, 10.123),
    (0, 10.1, 10, {"closed": True, "relative": True, "start": 10.123}, None, 10.123),
    (10, 10.1, 10, {"closed": True, "start": NAN}, 10.1, 10.1),
    (10, 10.004, 10, {"closed": True, "start": NAN}, None, 10.004),
]


@pytest.mark.parametrize(("own", "want", "source", "said", "written", "end"), ONES)
def test_a_number_alone(
    own: float, want: float, source: float, said: dict[str, Any], written: float | None, end: float
) -> None:
    wanted, into = one(own, want, source, **said)
    assert into.write.tolist() == [[written is not None]]
    np.testing.assert_allclose(into.number, [[own if written is None else written]], atol=1e-12)
    np.testing.assert_allclose(into.end, [[end]], atol=1e-12)
    begin = said.get("origin", 10.0) if said.get("resumes") else said.get("start", 10.0)
    np.testing.assert_array_equal(into.start, [[begin]])
    digits = len(f"{written:.9f}".rstrip("0").partition(".")[2]) if said.get("closed") and written else 2
    assert wanted.decimals.tolist() == [[max(2, digits)]]


def test_only_the_motions_of_a_frame_are_followed() -> None:
    wanted = motions(np.random.default_rng(3), 12)
    whole, into = followed(wanted), Followed.nothing(wanted)
    follow(wanted, np.zeros(3), 0, 5, into)
    assert np.isnan(into.end[5:]).all()
    assert np.isnan(into.start[5:]).all()
    assert not into.write[5:].any()
    follow(wanted, into.end[4], 5, 12, into)
    for name in ("start", "end", "write", "number"):
        np.testing.assert_array_equal(getattr(into, name), getattr(whole, name))


@pytest.mark.parametrize(
    ("origin", "before", "resumes"),
    [(1.0, 1.0, False), (1.0, 1.0000009, False), (1.0, 1.0000011, True), (1.0, NAN, False), (NAN, 1.0, True),
     (NAN, NAN, False), (1.0, 0.9999989, True)],
)  # fmt: skip
def test_where_a_motion_begins_elsewhere(origin: float, before: float, resumes: bool) -> None:
    assert Wanted.resumed(np.array([[origin]]), np.array([[before]])).tolist() == [[resumes]]


# Words that are one whole

VECTORS: list[tuple[list[float], list[float], dict[str, Any], list[bool], list[float]]] = [
    # own, wanted, further, which are written, where the words stand behind it
    ([0, 0, 1], [0, 0, 1], {}, [False] * 3, [0, 0, 1]),
    ([0, 0, 1], [0.004, 0, 1], {}, [False] * 3, [0, 0, 1]),
    ([0, 0, 1], [0.0051, 0, 1], {}, [True, False, False], [0.01, 0, 1]),
    ([0, NAN, 1], [0, 0.004, 1], {}, [False] * 3, [0, 0, 1]),  # an absent one beside another is zero
    ([0, NAN, 1], [0, 0.02, 1], {}, [False, True, False], [0, 0.02, 1]),
    ([0, NAN, 1], [NAN, 0.02, 1], {}, [False, True, False], [0, 0.02, 1]),
    ([NAN] * 3, [0, 0, 1], {}, [False] * 3, [0, 0, 1]),
    ([NAN] * 3, [0, 0, 2], {}, [False] * 3, [0, 0, 1]),  # the length of a vector says nothing
    ([NAN] * 3, [0, 0.02, 1], {}, [True] * 3, [0, 0.02, 1]),
    ([NAN] * 3, [0, 0.02, 1], {"before": [0, 0.02, 1]}, [False] * 3, [0, 0.02, 1]),
    ([NAN] * 3, [0, 0.02, 1], {"before": [0, 0.04, 2]}, [False] * 3, [0, 0.04, 2]),
    ([NAN] * 3, [0, 0.02, 1], {"before": [NAN] * 3, "source": [0, 0.02, 1]}, [False] * 3, [0, 0.02, 1]),
    ([NAN] * 3, [0, 0.02, 1], {"before": [NAN] * 3}, [True] * 3, [0, 0.02, 1]),
    ([NAN] * 3, [0, 0.02, 1], {"before": [NAN, 0, 1]}, [True] * 3, [0, 0.02, 1]),
    ([NAN] * 3, [0, 0.02, 1], {"fixed": True}, [False] * 3, [0, 0.02, 1]),
    ([0, 0, 1], [0, 0.02, 1], {"fixed": True}, [False] * 3, [0, 0.02, 1]),
    ([NAN] * 3, [0, NAN, 1], {}, [False] * 3, [0, NAN, 1]),
    ([NAN] * 3, [0, 0, 1], {"resumes": True, "before": [0, 1, 0]}, [False] * 3, [0, 0, 1]),
    ([NAN] * 3, [0, 0, 1], {"resumes": True, "origin": [0, 1, 0]}, [True] * 3, [0, 0, 1]),
]


@pytest.mark.parametrize("vector", [True, False])
@pytest.mark.parametrize(("own", "want", "said", "written", "end"), VECTORS)
def test_words_that_are_one_whole(
    own: list[float],
    want: list[float],
    said: dict[str, Any],
    written: list[bool],
    end: list[float],
    vector: bool,
) -> None:
    """Written beside a row of another frame, which it leaves alone."""
    row = lambda values: np.array([values, [9.0] * 3], dtype=float)  # noqa: E731
    wanted = Wanted(
        row(want), row(said.get("source", [0, 0, 1])), row(own), np.zeros((2, 3), np.bool_), np.full((2, 3), 2),
        np.array([said.get("fixed", False), False]), np.zeros((2, 3), np.bool_), row(said.get("origin", [0, 0, 1])),
        np.array([[said.get("resumes", False)] * 3, [False] * 3]),
    )  # fmt: skip
    into = Followed.nothing(wanted)
    before = np.array(said.get("before", [0.0, 0, 1]))
    follow_whole(wanted, before, 0, 1, into, vector)
    if not vector and (want == [0, 0, 2] or said.get("before") == [0, 0.04, 2]):
        written, end = [True] * 3, want  # angles are no vector
    assert into.write.tolist() == [written, [False] * 3]
    np.testing.assert_allclose(into.end[0], np.array(end), atol=1e-12)
    assert np.isnan(into.end[1]).all()
    expected = np.where(written, np.array(end), np.array(own))
    np.testing.assert_allclose(into.number[0], np.asarray(expected, np.float64), atol=1e-12)
    begin = wanted.origin[0] if said.get("resumes") else before
    np.testing.assert_array_equal(into.start[0], begin)


def test_words_that_are_one_whole_are_inherited() -> None:
    """Three motions: the vector of the first holds for the second, and is said again for the third."""
    nan = [NAN] * 3
    wanted = Wanted(
        np.array([[0, 0.1, 1], [0, 0.102, 1], [0, 0.2, 1]]), np.zeros((3, 3)), np.array([[0, 0.1, 1], nan, nan]),
        np.zeros((3, 3), np.bool_), np.full((3, 3), 2), np.zeros(3, np.bool_), np.zeros((3, 3), np.bool_),
        np.zeros((3, 3)), np.zeros((3, 3), np.bool_),
    )  # fmt: skip
    into = Followed.nothing(wanted)
    follow_whole(wanted, np.array([0, 0, 1.0]), 0, 3, into, True)
    assert into.write.tolist() == [[False] * 3, [False] * 3, [True] * 3]
    np.testing.assert_allclose(into.end, [[0, 0.1, 1], [0, 0.1, 1], [0, 0.2, 1]])
    np.testing.assert_allclose(into.start, [[0, 0, 1], [0, 0.1, 1], [0, 0.1, 1]])
