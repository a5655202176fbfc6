"""Polar coordinates of a Fanuc (G16): where their motions end, and that they stay as they are."""

from __future__ import annotations

import cmath
import math
import random

import numpy as np
import pytest
from test_gcode_followed import read

HEAD = "G21 G90 G40 G94 T1 M6\nF100.\nG54\nG17 G0 X1. Y2. Z3.\n"
AXES = {17: ("X", "Y", "Z"), 18: ("Z", "X", "Y"), 19: ("Y", "Z", "X")}


def ends(text: str) -> list[list[float]]:
    """[mm] of the motions after ``HEAD``, NaN where they are not known."""
    place = read("fanuc", text, HEAD).toolpath.position[1:] * 1e3
    return [[round(float(value), 6) for value in row] for row in place]


@pytest.mark.parametrize("seed", range(40))
def test_targets_are_those_that_complex_numbers_give(seed: int) -> None:
    """Each word holds until it is stated again; the third axis is a coordinate as ever."""
    draw = random.Random(seed)
    code = draw.choice((17, 18, 19))
    first, second, third = AXES[code]
    here = dict(zip("XYZ", (1.0, 2.0, 3.0), strict=True))
    lines, expected = [f"G{code} G16"], []
    radius, angle = draw.uniform(0, 50), draw.uniform(-400, 400)
    for number in range(8):
        said = {first, second} if not number else set(draw.sample("XYZ", draw.randint(1, 3)))
        radius = draw.uniform(0, 50) if first in said and number else radius
        angle = draw.uniform(-400, 400) if second in said and number else angle
        values = {first: radius, second: angle, third: draw.uniform(-9, 9)}
        lines.append("G1 " + " ".join(f"{axis}{values[axis]:.12f}" for axis in "XYZ" if axis in said))
        if said & {first, second}:
            point = cmath.rect(radius, math.radians(angle))
            here[first], here[second] = point.real, point.imag
        if third in said:
            here[third] = values[third]
        expected.append([here[axis] for axis in "XYZ"])
    here["X"] = 7.0
    expected.append([here[axis] for axis in "XYZ"])
    np.testing.assert_allclose(ends("\n".join([*lines, "G15", "G1 X7.", "M30\n"])), expected, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "known"),
    [
        ("G16\nG1 X10. Y90.\n", True),
        ("G16\nG1 Y90.\n", False),  # no radius is stated
        ("G16\nG1 X10.\n", False),
        ("G16\nG1 X-10. Y90.\n", False),  # what a negative radius is, no manual states
        ("G16\nG91 G1 X10. Y90.\n", False),
        ("G16 H2\nG1 X10. Y90.\n", False),  # Okuma: another work offset
        ("G16\nG1 X10. Y45.\nG91 Y45.\n", False),
        ("G16\nG1 X10. Y#500\n", False),
        ("G16\n/G1 X10. Y90.\n", False),
        ("G16\nG1 X10. Y0.\nG55 Y90.\n", False),
        ("G16\nG1 X10. Y0.\nG52 X0.\nY90.\n", False),
        ("G16\nG1 X10. Y0.\nG16\nY90.\n", False),
        ("G68 X0. Y0. R20.\nG16\nG1 X10. Y90.\n", False),
        ("G51 X0. Y0. P2.\nG16\nG1 X10. Y90.\n", False),
        ("#1=90.\nG16\nG1 X10. Y#1\n", True),
        ("G52 X0. Y0.\nG16\nG1 X10. Y90.\n", True),
    ],
)
def test_a_target_is_known_where_both_words_are(text: str, known: bool) -> None:
    place = ends(text)[-1]
    assert np.isfinite(place[:2]).all() == known
    if known:
        np.testing.assert_allclose(place[:2], [0, 10], atol=1e-6)


def test_the_origin_is_that_of_the_local_coordinates() -> None:
    path = read("fanuc", "G52 X100. Y50.\nG16\nG1 X10. Y180. Z0.\n", HEAD).toolpath
    np.testing.assert_allclose(path.position[-1] * 1e3, [90, 50, 0], atol=1e-6)


def test_holes_in_polar_coordinates_end_at_their_level_and_are_not_corrected() -> None:
    text = "Z20.\nG16 G98 G81 X40. Y0. Z-8. R2.\nY90.\nG15 G80\nG1 Z5.\nX5.\nM30\n"
    path = read("fanuc", text, HEAD).toolpath
    np.testing.assert_allclose(
        path.position[2:] * 1e3, [[40, 0, -8], [0, 40, -8], [0, 40, 5], [5, 40, 5]], atol=1e-6
    )
    refused = path.constraints.refused
    assert sorted(refused) == [2, 3]
    assert all("polar" in refused[row].message for row in refused)


def test_a_motion_before_whose_coordinate_is_inherited_stays() -> None:
    path = read("fanuc", "G1 Z-1.\nG16\nX40. Y0.\nG15\nG1 X5.\nM30\n", HEAD).toolpath
    assert 1 in path.constraints.locked
    path = read("fanuc", "G1 Z-1.\nG16\nX40. Y0. Z-2.\nG15\nG1 X5.\nM30\n", HEAD).toolpath
    assert 1 not in path.constraints.locked
    # an inserted block would be read as polar coordinates
    assert "polar" in path.constraints.no_insert_before[2]
    assert 3 not in path.constraints.no_insert_before


def test_other_controls_have_other_polar_modes() -> None:
    """LinuxCNC has no G16; that of controls after it is about where the tool is."""
    path = read("linuxcnc", "G16\nG1 X10. Y90.\nG15\nG1 X7.\n", HEAD.replace(" M6", "\nM6")).toolpath
    assert np.isnan(path.position[1:, 1]).all()


@pytest.mark.parametrize(
    ("text", "known"), [("G15 G43 H1 Z5.\n", True), ("G15 G17 G49 G80 H1\n", True), ("G15 H1\n", False)]
)
def test_a_length_beside_the_end_of_polar_coordinates_is_no_work_offset(text: str, known: bool) -> None:
    """G15 H is the work offset of an Okuma; beside G43 the H is that of the tool's length."""
    path = read("fanuc", f"{text}G1 X1. Y1. Z1.\n", HEAD).toolpath
    assert bool(path.base[-1] >= 0) is known
