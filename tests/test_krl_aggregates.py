"""Aggregates and targets of motions: in which order and how they are written says nothing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.languages.krl.operands import take_apart
from postproc.languages.krl.target import KrlTarget, parse

CARTESIAN, AXES = ("X", "Y", "Z", "A", "B", "C"), ("A1", "A2", "A3", "A4", "A5", "A6")
EXTERNAL = tuple(f"E{axis}" for axis in range(1, 7))
BLANKS = st.sampled_from(["", " ", "\t", "  "])
REALS = st.builds(
    "{}{}{}{}".format,
    st.sampled_from(["", "-", "+"]),
    st.integers(0, 10**6),
    st.sampled_from(["", ".", ".5", ".000125"]),
    st.sampled_from(["", "E2", "e-05", "E+1"]),
)
BITS = st.one_of(st.integers(0, 10**9 - 1).map(str), st.integers(0, 63).map("'B{:b}'".format))


@st.composite
def aggregates(draw: st.DrawFn) -> list[tuple[str, str]]:
    """Keys and literals in their usual order."""
    if draw(st.booleans()):
        keys = [key for key in (*CARTESIAN, "S", "T", *EXTERNAL) if draw(st.booleans())]
        keys = keys if set(keys) & set(CARTESIAN) else ["X", *keys]
    else:
        keys = [key for key in (*AXES, *EXTERNAL) if draw(st.booleans())]
        keys = keys if set(keys) & set(AXES) else ["A1", *keys]
    return [(key, draw(BITS if key in ("S", "T") else REALS)) for key in keys]


def written(draw: st.DrawFn, parts: list[tuple[str, str]], tag: str = "") -> bytes:
    fields = [f"{draw(BLANKS)}{key} {draw(BLANKS)}{value}{draw(BLANKS)}" for key, value in parts]
    return f"{{{draw(BLANKS)}{tag}{','.join(fields)}}}".encode()


def said(text: bytes, found: KrlTarget) -> dict[str, object]:
    """What a target says, whatever its order: its values, its literals where they are said to be, and the rest."""
    literals = [
        text[start:stop] if start >= 0 else None for start, stop in zip(found.start, found.stop, strict=True)
    ]
    return {
        "values": found.values,
        "axes": found.axes,
        "literals": literals,
        "files": found.file,
        "bits": (found.status, found.turn),
        "external": sorted(found.external),
        "home": found.home,
    }


@given(st.data())
def test_the_order_of_components_says_nothing(data):
    draw = data.draw
    parts = draw(aggregates())
    axes = parts[0][0] in AXES
    tag = draw(st.sampled_from(["", "", "E6AXIS: " if axes else "E6POS: ", "AXIS :" if axes else "frame :"]))
    usual = written(draw, parts, tag)
    other = written(draw, [*draw(st.permutations(parts))], tag)
    one, two = parse(usual, 0, 0), parse(other, 0, 0)
    assert isinstance(one, KrlTarget)
    assert isinstance(two, KrlTarget)
    assert said(usual, one) == said(other, two)
    literal = dict(parts)
    if not axes:
        assert [b"" if text is None else text for text in said(usual, one)["literals"]] == [
            literal.get(key, "").encode() for key in CARTESIAN
        ]
        last = max(one.stop)
        assert one.insert == last
    else:
        assert usual[one.insert : one.insert + 2] == parts[0][0].encode()


@given(st.data(), st.integers(1, 10**6), st.integers(-1, 1))
def test_a_place_in_the_file_moves_places_alone(data, at, file):
    parts = data.draw(aggregates())
    text = written(data.draw, parts)
    here, there = parse(text, 0, file), parse(text, at, file)
    assert isinstance(here, KrlTarget)
    assert isinstance(there, KrlTarget)
    assert there.insert == here.insert + at
    assert there.start == tuple(place + at if place >= 0 else -1 for place in here.start)
    assert there._replace(start=here.start, stop=here.stop, insert=here.insert) == here


@pytest.mark.parametrize(
    "text",
    [b"{}", b"{ }", b"{X}", b"{X 1,}", b"{X 1,,Y 2}", b"{,X 1}", b"{X 1 Y 2}", b"{X 1,X 2}", b"{X 1.2.3}",
     b"{X 1,A1 2}", b"{A1 2,X 1}", b"{X 1E}", b"{X 1E999}", b"{S 2}", b"{X 1,S -1}", b"{X 1,S 1.5}", b"{X -}",
     b"{NAME: X 1}", b"{X1}", b"{X 1,Q 2}", b"{A1 1,S 2}", b"{X 1}}", b"{{X 1}", b"{X\n1}"],
)  # fmt: skip
def test_what_is_no_plain_aggregate_is_told_or_read_by_its_components(text):
    found = parse(text, 0, 0)
    if isinstance(found, KrlTarget):
        assert text in (b"{S 2}", b"{A1 1,S 2}")
        assert (found.status, found.start) == (2, (-1,) * 6)
    else:
        assert found.code in ("KRL001", "KRL002")


POINTS = st.sampled_from(["{X 1,Y 2}", "P1", "XP1 ", " $POS_ACT", "{X 1} ", "WITHIN", "C_DISX"])
SLURS = st.sampled_from(["C_DIS", "c_ptp", "C_VEL", "C_ORI", "C_SPL"])


@given(st.lists(POINTS, min_size=1, max_size=2), st.lists(SLURS, max_size=2), st.booleans())
def test_common_motions_are_taken_apart_as_any_other(points, words, blank):
    """One with a reference is none of the common form; what it shares with one reads alike."""
    code = f"LIN {','.join(points)}{' ' if blank or points[-1][-1] not in ' }' else ''}{' '.join(words)}".encode()
    common = take_apart(code, 3)
    assert [code[a:b].decode() for a, b in common.points] == [point.strip() for point in points]
    assert common.approximations == tuple(word.upper().encode() for word in words)
    assert (common.reference, common.clause, common.not_understood) == (None, b"", b"")
    other = take_apart(code + b" #BASE", 3)
    assert other.points == common.points
    assert other.approximations == common.approximations


@pytest.mark.parametrize("code", [b"LIN C_DIS", b"LIN WITH $VEL.CP=1", b"LIN P1 C_DIS P2", b"LIN ,P1"])
def test_what_no_motion_may_say_is_no_point(code):
    parts = take_apart(code, 3)
    assert len(parts.points) == code.count(b"P1")
    assert (parts.not_understood != b"") == (b" P2" in code or b"," in code)
