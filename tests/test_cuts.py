"""Cuts: which motions belong together, what switches them off, and what is told of those that are left."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from motions import motions

from postproc.base.findings import CODES, Finding
from postproc.base.geometry import Poses
from postproc.compensation.cuts import (
    feed_motions,
    number_cuts,
    spread_over_cuts,
    switch_findings,
    uncorrected_findings,
)
from postproc.toolpath import Annotation


def path_of(count, annotations=(), lines=None):
    path = motions(Poses(np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))), annotations=annotations)
    return path if lines is None else replace(path, line=np.array(lines))


def numbered(scope, runs):
    """The cut of each motion, one after the other."""
    cuts, number, before = [], -1, False
    for inside, follows in zip(scope, runs, strict=True):
        if inside and not (before and follows):
            number += 1
        cuts.append(number if inside else -1)
        before = inside
    return cuts


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4])
def test_a_cut_begins_behind_air_and_where_motions_do_not_follow(count):
    for scope in product([False, True], repeat=count):
        assert number_cuts(np.array(scope, bool)).tolist() == numbered(scope, [True] * count)
        for runs in product([False, True], repeat=count):
            assert number_cuts(np.array(scope, bool), np.array(runs, bool)).tolist() == numbered(scope, runs)


CUTS = [0, 0, -1, 1, -1, -1, 2, 3, 3, -1]


@pytest.mark.parametrize(
    "blocked", [[], [2], [9], [0], [1], [3], [6], [8], [0, 8], [2, 3], [1, 6, 9], range(10)]
)
def test_what_is_blocked_blocks_its_cut(blocked):
    mask = np.zeros(10, bool)
    mask[list(blocked)] = True
    struck = {CUTS[row] for row in blocked} - {-1}
    found = spread_over_cuts(mask, np.array(CUTS))
    assert found.dtype == bool
    assert found.tolist() == [cut in struck for cut in CUTS]


def test_of_air_alone_nothing_is_blocked():
    assert spread_over_cuts(np.array([True, True]), np.array([-1, -1])).tolist() == [False, False]


SWITCHES = [
    ([], "11111"),
    ([(0, "COMPENSATE OFF")], "00000"),
    ([(2, "COMPENSATE OFF")], "11000"),
    ([(2, "  compensate \t off  ")], "11000"),
    ([(1, "COMPENSATE OFF"), (3, "COMPENSATE ON")], "10011"),
    ([(1, "Compensate Off, please"), (3, "COMPENSATE ON.")], "10011"),
    ([(1, "COMPENSATE OFFSET"), (2, "COMPENSATE ON_1"), (3, "COMPENSATE OFF9")], "11111"),
    ([(1, "COMPENSATEOFF"), (2, "NOT COMPENSATE OFF"), (3, "COMPENSATE")], "11111"),
    ([(1, "COMPENSATE OFF"), (2, "COMPENSATE OFF"), (4, "COMPENSATE ON")], "10001"),
    ([(1, "COMPENSATE OFF"), (2, "FORCE 1 2 3"), (5, "COMPENSATE ON")], "10000"),
]


@pytest.mark.parametrize(("notes", "on"), SWITCHES)
def test_a_switch_holds_from_its_motion_on(notes, on):
    path = path_of(5, tuple(Annotation(row, text, 10 + row) for row, text in notes))
    assert "".join("01"[value] for value in feed_motions(path).tolist()) == on


def test_what_begins_like_a_switch_and_is_none_is_told():
    long = "COMPENSATE " + "".join(chr(ord("a") + k % 26) for k in range(80))
    texts = [
        "COMPENSATE OFF",
        " compensate maybe ",
        "COMPENSATE ON: now",
        "FORCE 1 2 3",
        "COMPENSATE ONE",
        "no COMPENSATE",
        long,
    ]
    path = path_of(3, tuple(Annotation(1, text, 30 + k) for k, text in enumerate(texts)))
    words = "is neither COMPENSATE OFF nor COMPENSATE ON; it is ignored"
    assert switch_findings("part.src", path) == [
        Finding("COR011", f"'compensate maybe' {words}", "part.src", 31),
        Finding("COR011", f"'COMPENSATE ONE' {words}", "part.src", 34),
        Finding("COR011", f"{long[:60]!r} {words}", "part.src", 36),
    ]


LINES = [10, 11, 12, 20, 21, 22, 30, 31, 33, 40]


def left(why, cut=CUTS, lines=LINES):
    found = uncorrected_findings("part.src", path_of(len(cut), lines=lines), np.array(cut), why)
    assert all(one.file == "part.src" for one in found)
    return [(one.code, one.message, one.line, one.help) for one in found]


ONE, TWO = (
    Finding("KRL007", "serves several places", help="copy the point"),
    Finding("KIN002", "A1 is beyond"),
)
FIRST = "the cut of lines 10 to 11 (2 motions) is not corrected; "
FOURTH = "the cut of lines 31 to 33 (2 motions) is not corrected; "


@pytest.mark.parametrize(
    ("why", "told"),
    [
        ({}, []),
        ({2: ONE}, []),  # in air
        ({0: ONE}, [(FIRST + "line 10: KRL007 serves several places", 10, "copy the point")]),
        ({1: TWO, 0: ONE}, [(FIRST + "line 10: KRL007 serves several places", 10, "copy the point")]),
        ({1: TWO, 2: ONE}, [(FIRST + "line 11: KIN002 A1 is beyond", 10, CODES["KIN002"].action)]),
        (
            {3: ONE},
            [
                (
                    "the cut of lines 20 to 20 (1 motions) is not corrected; line 20: KRL007 serves several places",
                    20,
                    "copy the point",
                )
            ],
        ),
        (
            {8: TWO, 1: ONE, 7: ONE, 9: TWO},
            [
                (FIRST + "line 11: KRL007 serves several places", 10, "copy the point"),
                (FOURTH + "line 31: KRL007 serves several places", 31, "copy the point"),
            ],
        ),
    ],
)
def test_a_cut_that_is_left_is_told_once_with_its_first_reason(why, told):
    assert left(why) == [("COR003", *one) for one in told]


def test_a_motion_without_a_line_has_no_place_in_words():
    (told,) = left({1: TWO}, lines=[10, 0, *LINES[2:]])
    assert told[1] == "the cut of lines 10 to 0 (2 motions) is not corrected; KIN002 A1 is beyond"


def test_cuts_that_lie_apart_in_air_of_an_absolute_correction():
    """There every motion in air is a cut of its own."""
    cut = [0, 1, 1, 2, 3]
    found = left({1: ONE, 3: TWO}, cut, LINES[:5])
    assert [one[2] for one in found] == [11, 20]
    assert "lines 11 to 12 (2 motions)" in found[0][1]
    assert "lines 20 to 20 (1 motions)" in found[1][1]
