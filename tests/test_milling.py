"""The milling force model against numerical integration of the force of an edge, and against published sums."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.process.materials import find_material
from postproc.process.milling_forces import (
    Coefficients,
    Engagement,
    engagement,
    force,
    mean_force,
    peak_share,
)

# Table 5 of doi 10.1186/s10033-021-00536-9, row [190]: EN AW-7075-T6, in N/mm2 and N/mm
KTC, KRC, KAC, KTE, KRE, KAE = 767.01, 168.8, 222.0, 27.7, 26.6, 0.7
ALLOY = Coefficients((KTC * 1e6, KRC * 1e6, KAC * 1e6), (KTE * 1e3, KRE * 1e3, KAE * 1e3))
MM = 1e-3


def cut_of(direction="down", width=8.0, diameter=16.0, teeth=3, depth=5.0, helix=30.0, coefficients=ALLOY):
    return Engagement(
        diameter * MM,
        teeth,
        np.radians(helix),
        depth * MM,
        *engagement(direction, width * MM, diameter * MM),
        coefficients,
    )


def edge_by_edge(cut: Engagement, feed: float) -> np.ndarray:
    """Mean over one turn of what one edge element does, by geometry and Gauss' quadrature, times teeth and height.

    Its own way: the tooth is a point on a circle, its velocity and the outward radius are vectors, the chip is what
    the feed has moved along that radius; the window comes from where the point is, not from angles.
    """
    material = np.array([np.cos(cut.entry), np.cos(cut.exit)])  # y / radius of both ends of the engagement

    def on_tool(turn: float, part: int) -> float:
        outward = np.array([np.sin(turn), np.cos(turn), 0.0])
        motion = np.array([np.cos(turn), -np.sin(turn), 0.0])  # clockwise, seen from above
        chip = feed * outward[0]
        if chip <= 0 or not material.min() <= outward[1] <= material.max():
            return 0.0
        kt, kr, ka = (
            c * chip + e for c, e in zip(cut.coefficients.cutting, cut.coefficients.edge, strict=True)
        )
        down = np.array([0.0, 0.0, -1.0])
        # the chip holds the edge back, presses it inwards, and lifts the chip: the helix pulls the tool down
        return float((-kt * motion - kr * outward + np.sign(cut.helix) * ka * down)[part])

    # between the angles at which the edge comes in and goes out the force is smooth
    bounds = np.arccos(np.sort(material)[::-1])
    node, weight = np.polynomial.legendre.leggauss(60)
    turns = bounds.mean() + 0.5 * np.ptp(bounds) * node
    total = [0.5 * np.ptp(bounds) * weight @ [on_tool(turn, part) for turn in turns] for part in range(3)]
    return np.array(total) * cut.teeth * cut.depth / (2 * np.pi)


@settings(max_examples=examples(60), deadline=None)
@given(
    st.sampled_from(["up", "down", "slot"]),
    st.floats(0.02, 1.0),
    st.integers(1, 12),
    st.floats(0.01, 0.5),
    st.sampled_from([-30.0, 0.0, 45.0]),
    st.lists(st.floats(1.0, 3000.0), min_size=6, max_size=6),
)
def test_the_mean_is_the_integral_of_the_instantaneous_force(direction, share, teeth, feed, helix, k):
    coefficients = Coefficients((k[0] * 1e6, k[1] * 1e6, k[2] * 1e6), (k[3] * 1e2, k[4] * 1e2, k[5] * 1e2))
    cut = cut_of(direction, 16.0 * share, teeth=teeth, helix=helix, coefficients=coefficients)
    found, wanted = mean_force(cut, np.array([feed * MM]))[0], edge_by_edge(cut, feed * MM)
    assert np.allclose(found, wanted, rtol=0, atol=1e-9 * np.linalg.norm(wanted))


@pytest.mark.sample(9)
@pytest.mark.parametrize("direction", ["up", "down", "slot"])
@pytest.mark.parametrize("helix", [0.0, 10.0, 30.0, -45.0])
@pytest.mark.parametrize("teeth", [1, 3, 4])
def test_the_mean_over_a_period_does_not_know_the_helix(direction, helix, teeth):
    """Discs that lag behind each other come by the same angles, only later."""
    cut = cut_of(direction, 5.0, teeth=teeth, helix=helix)
    angle = np.arange(20_000) * (2 * np.pi / teeth / 20_000)
    mean = force(cut, 0.1 * MM, angle, discs=12).mean(axis=0)
    wanted = mean_force(cut, np.array([0.1 * MM]))[0]
    assert np.allclose(mean, wanted, rtol=0, atol=2e-4 * np.linalg.norm(wanted))
    other = mean_force(cut_of(direction, 5.0, teeth=teeth, helix=1.0), np.array([0.1 * MM]))[0]
    assert np.allclose(wanted[:2], other[:2], rtol=1e-12)
    assert wanted[2] == pytest.approx(np.sign(helix) * other[2], rel=1e-12)


def test_the_helix_smooths_the_force_within_a_period():
    straight, steep = (peak_share(cut_of(width=4.0, depth=12.0, helix=h), 0.1 * MM) for h in (0.0, 45.0))
    assert 1.0 < steep < 0.7 * straight
    # a slot with straight flutes and four teeth: two are always in the cut
    assert peak_share(cut_of("slot", 16.0, teeth=4, helix=0.0), 0.1 * MM) < 1.3


def test_published_means_of_a_slot():
    """For a slot the sums are in the textbooks: Fx = -N a c Krc / 4 - N a Kre / pi,
    Fy = N a c Ktc / 4 + N a Kte / pi, axially N a c Kac / pi + N a Kae / 2; a = 5 mm, c = 0.1 mm, N = 3."""
    found = mean_force(cut_of("slot", 16.0), np.array([0.1 * MM]))[0]
    x = -3 * 5 * (0.1 * 168.8 / 4 + 26.6 / np.pi)
    y = 3 * 5 * (0.1 * 767.01 / 4 + 27.7 / np.pi)
    z = -3 * 5 * (0.1 * 222.0 / np.pi + 0.7 / 2)
    assert np.allclose(found, [x, y, z], rtol=1e-12)
    assert np.allclose(
        found, [-190.3060, 419.8878, -111.2471], atol=5e-5
    )  # N, added up by hand from the table


@pytest.mark.parametrize("direction", ["up", "down"])
def test_half_engagement_in_closed_form(direction):
    """50 %, phi over a right angle: up milling holds the tool back, down milling draws it along."""
    found = mean_force(cut_of(direction, 8.0), np.array([0.1 * MM]))[0]
    c, scale = 0.1, 3 * 5 / (2 * np.pi)
    if direction == "up":
        x = -scale * (c / 4 * (2 * KTC + np.pi * KRC) + KTE + KRE)
        y = scale * (c / 4 * (np.pi * KTC - 2 * KRC) + KTE - KRE)
    else:
        x = scale * (c / 4 * (2 * KTC - np.pi * KRC) + KTE - KRE)
        y = scale * (c / 4 * (np.pi * KTC + 2 * KRC) + KTE + KRE)
    z = -scale * (c * KAC + KAE * np.pi / 2)
    assert np.allclose(found, [x, y, z], rtol=1e-12)
    wanted = {"up": [-252.8368, 126.2914, -55.6236], "down": [62.5311, 293.5951, -55.6236]}[direction]
    assert np.allclose(found, wanted, rtol=0, atol=1e-4)  # N, by hand from the table


def test_both_halves_are_a_slot():
    up, down, slot = (
        mean_force(cut_of(d, w), np.array([0.08 * MM]))[0] for d, w in (("up", 8), ("down", 8), ("slot", 16))
    )
    assert np.allclose(up + down, slot, rtol=1e-12)
    assert np.sign(up).tolist() == [-1, 1, -1]
    assert np.sign(down).tolist() == [1, 1, -1]
    assert down[1] > up[1] * 1.3


def test_force_grows_with_feed_teeth_and_depth_as_it_should():
    feed = np.array([0.0, 0.1, 0.2]) * MM
    found = mean_force(cut_of(), feed)
    assert np.allclose(found[2] - found[1], found[1] - found[0])
    assert not np.allclose(found[0], 0)  # the edges rub without any chip
    for changed in ({"teeth": 6}, {"depth": 10.0}):
        assert np.allclose(mean_force(cut_of(**changed), feed), 2 * found)


def test_the_force_of_one_straight_tooth_is_seen_only_in_the_cut():
    cut = cut_of("down", 8.0, teeth=1, helix=1e-6)
    found = force(cut, 0.1 * MM, np.radians([45.0, 89.0, 135.0, 179.0, 181.0, 300.0]), discs=1)
    assert np.any(found != 0, axis=1).tolist() == [False, False, True, True, False, False]
    s = np.sqrt(0.5)
    tangential, radial, axial = (5 * (k * 0.1 * s + e) for k, e in ((KTC, KTE), (KRC, KRE), (KAC, KAE)))
    assert np.allclose(found[2], [s * tangential - s * radial, s * tangential + s * radial, -axial])


def test_the_table_states_what_its_source_does():
    material = find_material("EN AW-7075-T6")
    assert np.allclose(material.coefficients.cutting, np.array([KTC, KRC, KAC]) * 1e6)
    assert np.allclose(material.coefficients.edge, np.array([KTE, KRE, KAE]) * 1e3)
    assert material.ci95 == pytest.approx((1319.41 - 600.46) / 2 / 767.01)
    assert "[190]" in material.source
    assert material.date == "2021"


@pytest.mark.parametrize("name", ["en aw-7075-t6", "7075-T6", "Al 7075 T6", "AA7075-T6", "AlZn5.5MgCu-T6"])
def test_materials_go_by_several_names(name):
    assert find_material(name) is find_material("EN AW-7075-T6")


def test_what_one_publication_states_has_no_interval():
    for name in ("EN AW-6082-T6", "EN AW-6061-T6"):
        assert find_material(name).ci95 is None
    assert not find_material("6061-T6").axial
    assert find_material("7075") is None
