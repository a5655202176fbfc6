"""Arcs of G-code: those that are made at random are read as they were made, and written so that they are read so."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from postproc.base.arrays import Floats
from postproc.base.geometry import on_arc, rotation_from_vector
from postproc.languages.gcode import arcs as reading
from postproc.languages.gcode import writer_arcs as writing
from postproc.languages.gcode.writer_arcs import ArcForm

NAN = np.nan
AXES = ((0, 1, 2), (2, 0, 1), (1, 2, 0))
"""First and second axis of G17, G18, G19, and the third (LinuxCNC: G18 goes from Z to X)."""


def made(random: np.random.Generator, count: int, least: float = 0.05) -> dict[str, Any]:
    """Arcs with everything about them, lengths in units of 1; least: sweep."""
    plane, counter = random.integers(0, 3, count), random.random(count) < 0.5
    radius, sweep = random.uniform(1, 50, count), random.uniform(least, 6.25 - least, count)
    start, lead = random.uniform(-np.pi, np.pi, count), random.normal(0, 5, count)
    sense = np.where(counter, 1, -1)
    centre, begin, end, normal = (np.zeros((count, 3)) for _ in range(4))
    for i in range(count):
        u, v, w = AXES[plane[i]]
        centre[i] = random.normal(0, 40, 3)
        normal[i, w] = sense[i]
        begin[i], end[i] = centre[i], centre[i]
        for point, angle in ((begin, start[i]), (end, start[i] + sense[i] * sweep[i])):
            point[i, u] += radius[i] * np.cos(angle)
            point[i, v] += radius[i] * np.sin(angle)
        end[i, w] += lead[i]
        centre[i, w] = begin[i, w]
    return {"plane": plane, "counter": counter, "radius": radius, "sweep": sweep, "centre": centre,
            "begin": begin, "end": end, "normal": normal}  # fmt: skip


def in_plane(one: dict[str, Any], values: Floats) -> Floats:
    """NaN along the third axis."""
    third = np.array([AXES[plane][2] for plane in one["plane"]])
    return np.where(np.arange(3) == third[:, None], NAN, values)


def read(begin: Floats, end: Floats, **said: Any) -> reading.ArcGeometry:
    n = len(begin)
    words = {
        "plane": np.zeros(n, np.int64), "counter": np.ones(n, np.bool_), "ijk": np.full((n, 3), NAN),
        "absolute": np.zeros(n, np.bool_), "radius": np.full(n, NAN), "turns": np.zeros(n),
    }  # fmt: skip
    plane, *rest = (words | said).values()
    return reading.arcs(np.array(begin), np.array(end), plane, reading.ArcWords(*rest))


def assert_made(found: reading.ArcGeometry, one: dict[str, Any], more: Floats | float = 0.0) -> None:
    assert not found.wrong.any()
    np.testing.assert_allclose(found.centre, one["centre"] / 1e3, atol=1e-9)
    np.testing.assert_array_equal(found.normal, one["normal"])
    np.testing.assert_allclose(found.sweep, one["sweep"] + more, atol=1e-6)


def test_an_arc_by_its_centre_is_that_arc() -> None:
    random = np.random.default_rng(1)
    one = made(random, 300)
    begin, end = one["begin"] / 1e3, one["end"] / 1e3
    turns = random.integers(0, 3, 300).astype(float)
    plain = {"plane": one["plane"], "counter": one["counter"], "turns": turns}
    from_begin, absolute = in_plane(one, one["centre"] / 1e3 - begin), in_plane(one, one["centre"] / 1e3)
    assert_made(read(begin, end, ijk=from_begin, **plain), one, 2 * np.pi * turns)
    assert_made(
        read(begin, end, ijk=absolute, absolute=np.ones(300, np.bool_), **plain), one, 2 * np.pi * turns
    )
    # I=AC( ) beside J=IC( ): each word for itself.
    mixed = random.random((300, 3)) < 0.5
    found = read(begin, end, ijk=np.where(mixed, absolute, from_begin), absolute=mixed, **plain)
    assert_made(found, one, 2 * np.pi * turns)


def test_an_arc_by_its_radius_is_that_arc() -> None:
    one = made(np.random.default_rng(2), 300)
    short = np.abs(one["sweep"] - np.pi) > 0.05  # near half a circle the radius says little of the centre
    radius = np.where(one["sweep"] > np.pi, -one["radius"], one["radius"]) / 1e3
    found = read(
        one["begin"] / 1e3, one["end"] / 1e3, plane=one["plane"], counter=one["counter"], radius=radius
    )
    assert not found.wrong.any()
    np.testing.assert_allclose(found.centre[short], one["centre"][short] / 1e3, atol=1e-7)
    np.testing.assert_allclose(found.sweep[short], one["sweep"][short], atol=1e-6)


def test_an_arc_through_a_point_is_that_arc() -> None:
    one = made(np.random.default_rng(3), 200)
    flat = np.array([AXES[plane][2] for plane in one["plane"]])[:, None] == np.arange(3)
    end = np.where(flat, one["begin"], one["end"])
    via = on_arc(one["begin"], end, one["centre"], one["normal"], one["sweep"], np.full(200, 0.4))
    found = reading.through(one["begin"] / 1e3, via / 1e3, end / 1e3, np.full(200, 2.0))
    assert not found.wrong.any()
    np.testing.assert_allclose(found.centre, one["centre"] / 1e3, atol=1e-7)
    np.testing.assert_allclose(found.normal, one["normal"], atol=1e-5)
    np.testing.assert_allclose(found.sweep, one["sweep"] + 4 * np.pi, atol=1e-5)


E_ = [0.01, 0.0, 0.0]
WRONG: list[tuple[dict[str, Any], int]] = [
    ({}, 2),  # neither I J K nor R
    ({"ijk": [0.005, NAN, NAN]}, 0),
    ({"ijk": [NAN, 0.005, NAN], "end": [0, 0.01, 0]}, 0),
    ({"ijk": [0.005, NAN, 0.0]}, 0),
    ({"ijk": [0.005, NAN, 0.001]}, 2),  # a word of another plane
    ({"ijk": [NAN, NAN, 0.005]}, 2),
    ({"ijk": [0.005, 0, NAN], "radius": 0.005}, 2),  # both
    ({"ijk": [0.005, NAN, NAN], "absolute": True}, 2),  # an absolute centre is stated whole
    ({"ijk": [0.005, 0.0, NAN], "absolute": True}, 0),
    ({"ijk": [0.006, 0.0, NAN]}, 3),
    ({"ijk": [0.0, 0.0, NAN]}, 3),
    ({"ijk": [0.0, 0.0, NAN], "end": [0, 0, 0]}, 3),
    ({"ijk": [0.005, 0.0, NAN], "end": [0, 0, 0]}, 0),  # a full circle
    ({"radius": 0.005}, 0),
    ({"radius": -0.005}, 0),
    ({"radius": 0.004}, 4),
    ({"radius": -0.004}, 4),
    ({"radius": 0.005, "end": [0, 0, 0]}, 4),
    ({"radius": 0.005, "end": [0, 0, 0.01]}, 4),
    ({"radius": 0.005, "plane": -1}, 5),
    ({"ijk": [0.005, NAN, NAN], "plane": -1}, 5),
    ({"plane": -1}, 5),
    ({"ijk": [0.005, NAN, NAN], "turns": -1.0}, 2),
    ({"ijk": [0.006, NAN, NAN], "turns": -1.0}, 3),
    ({"ijk": [0.005, NAN, NAN], "turns": 1.0}, 0),
    ({"ijk": [0.005, NAN, NAN], "begin": [NAN, 0, 0]}, 1),
    ({"ijk": [0.005, NAN, NAN], "end": [0.01, 0, NAN]}, 1),
    ({"ijk": [0.005, NAN, 0.001], "end": [0.01, NAN, 0]}, 1),
    ({"radius": 0.004, "begin": [NAN, 0, 0]}, 1),
    ({"radius": 0.005, "end": [NAN, 0, 0]}, 1),
    ({"ijk": [0.006, 0.0, NAN], "end": [0.01, 0, NAN]}, 1),
    ({"radius": 0.004, "end": [0.01, 0, NAN]}, 1),
    ({"begin": [NAN, 0, 0]}, 2),
    ({"ijk": [0.005, NAN, NAN], "plane": -1, "end": [NAN, 0, 0]}, 5),
]


@pytest.mark.parametrize(("said", "why"), WRONG)
def test_why_there_is_no_arc(said: dict[str, Any], why: int) -> None:
    said = {"begin": [0.0, 0.0, 0.0], "end": E_} | said
    found = read(**{name: np.array([value]) for name, value in said.items()})
    assert found.wrong.tolist() == [why]
    for values in (found.centre, found.normal, found.sweep):
        assert np.isfinite(values).all() == (why == 0)
        assert np.isnan(values).all() == (why > 0)


@pytest.mark.parametrize(
    ("radius", "allowed"), [(1e-3, 1e-5), (5e-3, 1e-5), (2e-2, 2e-5), (5e-2, 5e-5), (0.1, 1e-4), (2.0, 1e-4)]
)
def test_radii_may_differ_by_little(radius: float, allowed: float) -> None:
    """10 um, or a thousandth of the larger radius, but no more than 0.1 mm."""
    for sign in (1, -1):
        share = 1.0 if sign > 0 or allowed != radius / 1e3 else 1 / 1.001
        for times, why in ((0.99, 0), (1.01, 3)):
            far = radius + sign * times * allowed * share
            larger = max(far, radius) / radius if allowed == radius / 1e3 else 1.0
            end = [[radius + radius + sign * times * allowed * larger, 0, 0]]
            found = read(np.zeros((1, 3)), np.array(end), ijk=np.array([[radius, NAN, NAN]]))
            assert found.wrong.tolist() == [why], (sign, times)


@pytest.mark.parametrize("size", [1e-3, 0.05, 3.0])
def test_half_a_circle_may_have_a_rounded_radius(size: float) -> None:
    """R may be 10 um shorter than half the chord; the centre is then the middle."""
    for sign in (1.0, -1.0):
        for missing, why in ((0.9e-5, 0), (1.1e-5, 4)):
            found = read(
                np.zeros((1, 3)), np.array([[2 * size, 0, 0]]), radius=np.array([sign * (size - missing)])
            )
            assert found.wrong.tolist() == [why]
            if not why:
                np.testing.assert_allclose(found.centre, [[size, 0, 0]], atol=1e-12)
                np.testing.assert_allclose(found.sweep, [np.pi])


@pytest.mark.parametrize(("apart", "sweep"), [(0.0, 2 * np.pi), (0.9e-9, 2 * np.pi), (1.1e-9, 1.1e-7)])
def test_ends_that_are_one_make_a_full_circle(apart: float, sweep: float) -> None:
    found = read(
        np.zeros((1, 3)),
        np.array([[0.0, -apart, 0.0]]),
        ijk=np.array([[-0.01, 0.0, NAN]]),
        counter=np.array([False]),
    )
    np.testing.assert_allclose(found.sweep, [sweep], rtol=1e-4)


def test_three_points_that_are_no_arc() -> None:
    begin, via, end = (
        np.zeros((6, 3)),
        np.tile([0.005, 0.005, 0.0], (6, 1)),
        np.tile([0.01, 0.0, 0.0], (6, 1)),
    )
    via[1] = [0.005, 0, 0]
    via[2, 1] = end[3, 0] = NAN
    found = reading.through(begin, via, end, np.array([0.0, 0.0, 0.0, 0.0, -1.0, NAN]))
    assert found.wrong.tolist() == [0, 6, 1, 1, 6, 6]
    for values in (found.centre, found.normal, found.sweep):
        assert np.isfinite(values).reshape(6, -1).all(axis=1).tolist() == [True] + [False] * 5
        assert np.isnan(values[1:]).all()


# Writing: units of 1, decimals of the words

CENTRE, RADIUS, THROUGH = ArcForm.CENTRE, ArcForm.RADIUS, ArcForm.THROUGH


def task(
    one: dict[str, Any], form: ArcForm, relative: Any, own: Floats, decimals: int, turns: int = 0
) -> writing.ArcsToWrite:
    n = len(one["sweep"])
    return writing.ArcsToWrite(
        one["begin"], one["end"], one["centre"], one["normal"], one["sweep"] + 2 * np.pi * turns, one["plane"],
        np.full(n, form), ~one["counter"], np.full(n, turns), np.broadcast_to(relative, (n, 3)), own,
        np.full((n, 4), decimals), np.zeros(n),
    )  # fmt: skip


def rounded(one: dict[str, Any], decimals: int) -> dict[str, Any]:
    """As it is written: ends on the grid; the planned centre as far off as ends and rounding make it."""
    grid = {name: np.round(one[name], decimals) for name in ("begin", "end")}
    return one | grid


def ways(found: reading.ArcGeometry, begin: Floats, end: Floats) -> Floats:
    shares = [np.full(len(begin), share) for share in (0.2, 0.4, 0.6, 0.8)]
    return np.stack([on_arc(begin, end, found.centre, found.normal, found.sweep, at) for at in shares])


def back(arcs: writing.ArcsToWrite, written: writing.WrittenArcs) -> reading.ArcGeometry:
    """What a control makes of the numbers, written ones and those that stand there."""
    number = np.where(written.write, written.number, arcs.own)
    scale = 1e-3
    ijk = np.where(np.isnan(number[:, :3]), NAN, number[:, :3]) * scale
    begin, end, turns = arcs.start * scale, arcs.end * scale, arcs.turns.astype(float)
    if arcs.form[0] == ArcForm.THROUGH:
        via = np.where(np.isnan(ijk), 0.0, ijk) + np.where(arcs.relative, begin, 0.0)
        via = np.where(np.isnan(ijk) & ~arcs.relative, begin, via)
        return reading.through(begin, via, end, turns)
    by_centre = written.convert | (arcs.form == ArcForm.CENTRE)
    ijk[~by_centre] = NAN
    radius = np.where(by_centre, NAN, number[:, 3] * scale)
    words = reading.ArcWords(~arcs.clockwise, ijk, ~arcs.relative, radius, turns)
    return reading.arcs(begin, end, arcs.plane, words)


@pytest.mark.parametrize("decimals", [2, 3, 4])
@pytest.mark.parametrize("turns", [0, 2])
@pytest.mark.parametrize("relative", [True, False])
@pytest.mark.parametrize("form", [CENTRE, RADIUS, THROUGH])
def test_written_arcs_are_read_as_they_were_meant(
    form: ArcForm, relative: bool, turns: int, decimals: int
) -> None:
    """Within two steps of what is written, four for a point between; no arc of ordinary size is given up."""
    if form != CENTRE and turns:
        return
    one = rounded(
        made(np.random.default_rng(10 * decimals + turns), 200, 0.5 if form == THROUGH else 0.05), decimals
    )
    if form == THROUGH:
        third = np.array([AXES[plane][2] for plane in one["plane"]])
        one["end"][np.arange(200), third] = one["begin"][np.arange(200), third]
    # Ends that are rounded lie beside the circle: the planned one goes through them.
    middle = on_arc(one["begin"], one["end"], one["centre"], one["normal"], one["sweep"], np.full(200, 0.5))
    flat = [np.where(one["normal"] != 0, one["begin"], point) for point in (middle, one["end"])]
    fitted = reading.through(one["begin"], flat[0], flat[1], np.zeros(200))
    one |= {"centre": fitted.centre, "sweep": fitted.sweep}
    arcs = task(one, form, relative, np.full((200, 4), NAN), decimals, turns)
    written = writing.write_arcs(arcs)
    assert not written.bad.any()
    # An R leaves the centre badly determined near half a circle and near a whole one.
    turned = np.degrees(one["sweep"])
    expected = (form == RADIUS) & ((turned > 167) & (turned < 193) | (turned > 300))
    assert written.convert.tolist() == expected.tolist()
    assert written.write[:, 3].tolist() == ((form == RADIUS) & ~expected).tolist()
    # One digit more at most, and only where the rounding shows.
    assert ((written.decimals - decimals) >= 0).all()
    assert ((written.decimals - decimals) <= 1).all()
    digits = 10.0**written.decimals
    off = written.number * digits - np.rint(written.number * digits)
    assert np.abs(off[written.write]).max() < 1e-4
    found = back(arcs, written)
    assert not found.wrong.any()
    planned = reading.ArcGeometry(arcs.centre, arcs.normal, arcs.sweep, np.zeros(200, np.int64))
    read_again = reading.ArcGeometry(found.centre * 1e3, found.normal, found.sweep, found.wrong)
    apart = ways(read_again, arcs.start, arcs.end) - ways(planned, arcs.start, arcs.end)
    step = 10.0 ** -written.decimals[:, :3].min(axis=1)
    assert (np.linalg.norm(apart, axis=2).max(axis=0) <= (4.01 if form == THROUGH else 2.01) * step).all()
    # The words of the third axis are none of an arc by its centre.
    if form == CENTRE:
        assert np.isnan(in_plane(one, written.number[:, :3])).sum() == 200


@pytest.mark.parametrize(
    ("by", "stays"), [(0.0, True), (0.49, True), (0.51, False), (1.0, False), (-0.49, True)]
)
@pytest.mark.parametrize("relative", [True, False])
def test_numbers_that_are_right_stay(relative: bool, by: float, stays: bool) -> None:
    """Within half a step of what is wanted."""
    begin, end, centre = np.array([[10.0, 0, 0]]), np.array([[0.0, 10, 0]]), np.array([[0.0, 0.0, 0]])
    one = {"begin": begin, "end": end, "centre": centre, "normal": np.array([[0, 0, 1.0]]),
           "sweep": np.array([np.pi / 2]), "plane": np.array([0]), "counter": np.array([True])}  # fmt: skip
    number = centre - begin * relative
    own = np.array([[number[0, 0] + by * 1e-3, number[0, 1] + by * 1e-3, NAN, NAN]])
    written = writing.write_arcs(task(one, CENTRE, relative, own, 3))
    assert written.write.tolist() == [[not stays, not stays, False, False]]
    assert (written.number[0, :2] == own[0, :2]).all() == (stays or by == 0)
    own = np.array([[NAN, NAN, NAN, 10 + by * 1e-3]])
    written = writing.write_arcs(task(one, RADIUS, relative, own, 3))
    assert written.write.tolist() == [[False, False, False, not stays]]


@pytest.mark.parametrize(("degrees", "digits"), [(90, 3), (119, 3), (121, 4), (160, 4), (200, 4), (250, 4)])
def test_a_radius_has_a_digit_more_where_it_says_less(degrees: float, digits: int) -> None:
    angle = np.radians(degrees)
    one = {"begin": np.array([[10.0, 0, 0]]), "end": np.array([[10 * np.cos(angle), 10 * np.sin(angle), 0]]),
           "centre": np.zeros((1, 3)), "normal": np.array([[0, 0, 1.0]]), "sweep": np.array([angle]),
           "plane": np.array([0]), "counter": np.array([True])}  # fmt: skip
    written = writing.write_arcs(task(one, RADIUS, True, np.full((1, 4), NAN), 3))
    assert written.decimals[0, 3] == digits
    assert written.number[0, 3] == pytest.approx(10.0 if degrees < 180 else -10.0)


def test_absent_words_of_a_centre_are_zero() -> None:
    """From the begin they are left out where zero is meant; absolute ones are always written."""
    one = {"begin": np.array([[10.0, 0, 0]] * 2), "end": np.array([[0.0, 10, 0]] * 2), "centre": np.zeros((2, 3)),
           "normal": np.array([[0, 0, 1.0]] * 2), "sweep": np.full(2, np.pi / 2), "plane": np.zeros(2, np.int64),
           "counter": np.ones(2, np.bool_)}  # fmt: skip
    written = writing.write_arcs(
        task(one, CENTRE, np.array([[True] * 3, [False] * 3]), np.full((2, 4), NAN), 3)
    )
    assert written.write.tolist() == [[True, False, False, False], [True, True, False, False]]
    assert written.number[:, :2].tolist() == [[-10, 0], [0, 0]]


def test_an_arc_that_turns_the_other_way_is_given_up() -> None:
    one = made(np.random.default_rng(4), 50)
    flat = task(one, CENTRE, True, np.full((50, 4), NAN), 3)
    tilted = rotation_from_vector(np.array([[0.3, 0.2, 0.1]]))[0]
    for name, values in (
        ("clockwise", ~flat.clockwise),
        ("normal", flat.normal @ tilted.T),
        ("turns", flat.turns + 1),
    ):
        changed = writing.ArcsToWrite(**(vars(flat) | {name: values}))
        assert writing.write_arcs(changed).bad.all(), name
    assert not writing.write_arcs(flat).bad.any()


@pytest.mark.parametrize(("apart", "bad"), [(0.4, False), (0.6, False), (1.9, False), (2.1, True)])
def test_radii_that_differ_by_more_than_two_steps_are_given_up(apart: float, bad: bool) -> None:
    """Of a circle that nearly closes, whose centre stays where it is; from half a step on with a digit more."""
    angle = 2 * np.pi - 0.3
    end = (10 + apart * 1e-3) * np.array([[np.cos(angle), np.sin(angle), 0]])
    one = {"begin": np.array([[10.0, 0, 0]]), "end": end, "centre": np.zeros((1, 3)), "sweep": np.array([angle]),
           "normal": np.array([[0, 0, 1.0]]), "plane": np.array([0]), "counter": np.array([True])}  # fmt: skip
    written = writing.write_arcs(task(one, CENTRE, True, np.full((1, 4), NAN), 3))
    assert written.bad.tolist() == [bad]
    assert written.decimals[0, :3].tolist() == [4 if apart > 0.5 else 3] * 3


@pytest.mark.parametrize(
    ("degrees", "balanced"), [(90, True), (170, True), (190, True), (290, True), (305, False), (350, False)]
)
def test_a_centre_lies_between_ends_that_are_rounded(degrees: float, balanced: bool) -> None:
    """At the same distance from both, but where the circle nearly closes: there that would move its far side."""
    angle = np.radians(degrees)
    end = 10.0003 * np.array([[np.cos(angle), np.sin(angle), 0]])
    one = {"begin": np.array([[10.0, 0, 0]]), "end": end, "centre": np.zeros((1, 3)), "sweep": np.array([angle]),
           "normal": np.array([[0, 0, 1.0]]), "plane": np.array([0]), "counter": np.array([True])}  # fmt: skip
    written = writing.write_arcs(task(one, CENTRE, False, np.full((1, 4), NAN), 6))
    centre = np.array([[*written.number[0, :2], 0]])
    apart = np.linalg.norm(centre - one["begin"]) - np.linalg.norm(centre - end)
    assert (abs(apart) < 2e-6) == balanced
    assert (np.abs(centre).max() < 1e-9) == (not balanced)
