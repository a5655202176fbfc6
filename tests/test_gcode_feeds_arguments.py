"""What F, S, T, H and M are: not in the arguments of a macro, not beside limits, and not of a tooth or a surface.

The feeds are worked out by hand from the rule that stands beside them.
"""

from __future__ import annotations

import numpy as np
import pytest
from test_gcode_followed import read

SUB = "\nM30\nO2\nG1 X1.\nM99\n"
FEEDS = [
    # Fanuc, custom macro: all letters of G65 and G66 but G, L, N, O and P are arguments; F60 of the head stays.
    ("fanuc", "G65 P2 Z-5. F30." + SUB, [60.0]),
    ("fanuc", "G1 X3.\nG65 P2 F30.\nG1 X2." + SUB, [60.0, 60.0, 60.0]),
    ("fanuc", "G95 F.1 S1000 M3\nG65 P2 S50." + SUB, [100.0]),
    ("fanuc", "G66 P2 F30.\nG67\nG94 F60. G1 X1.\nG66.1 P2\nF20. S5\nG67\nG94 G1 X2.\n", [60.0, None]),
    # a code that is not known may call a macro, of which F is an argument
    ("fanuc", "G1 X1.\nG321 F30.\nG1 X2.\nF40. X3.\n", [60.0, None, 40.0]),
    # S is a limit of the spindle's speed: Fanuc "G92 S, maximum spindle speed clamp", G50 S of other controls
    ("fanuc", "G95 F.1 S1000 M3\nG1 X1.\nG92 S3000\nX2.\nG50 S500\nX3.\n", [100.0, 100.0, 100.0]),
    ("fanuc", "G95 F.1 S1000 M3\nG92 X0. S3000\nG1 X3.\nS500 X4.\n", [None, 50.0]),
    # Siemens: G25 S and G26 S are limits; S1= names a spindle
    ("sinumerik", "G95 F0.1 S1000 M3\nG26 S3000\nG1 X1\nG25 S20\nX2\nLIMS=50\nX3\n", [100.0, 100.0, 100.0]),
    ("sinumerik", "G95 F0.1 S1000 M3\nG1 X1\nS1=400\nX2\nS200\nX3\n", [100.0, None, 20.0]),
    # Siemens: FZ= is the feed for each tooth, the number of which the tool's data state; F takes its place
    ("sinumerik", "G95 F0.1 S1000 M3\nG1 X1\nX2 FZ=0.1\nX3\nX4 F0.2\n", [100.0, None, None, 200.0]),
    # SVC= is a cutting speed, from which the radius of the tool makes one of the spindle
    ("sinumerik", "G95 F0.1 S1000 M3\nG1 X1\nSVC=50\nX2\nS500\nX3\n", [100.0, None, 50.0]),
    # Under G96, G961 and G962 S is a cutting speed in m/min; after them it is kept as it is then, until it is stated
    ("sinumerik", "G96 S50 F0.3\nG1 X1\n", [None]),
    ("sinumerik", "G96 S50 F0.3\nG97\nG1 X1\nG97 S100\nX2\n", [None, 30.0]),
    ("sinumerik", "S1000\nG96 F0.3\nG97\nG1 X1\n", [None]),
    ("sinumerik", "S1000 G961 S50 F30\nG1 X1\n", [30.0]),
    ("fanuc", "G95 F.3 S1000 M3\nG96 S50\nG1 X1.\nG97\nX2.\nS100\nX3.\n", [None, None, 30.0]),
    # G962 leaves which feed it is as it was
    ("sinumerik", "G94 F30\nG962 S50\nG1 X1\n", [None]),
    # in a block that may run or not: one of two feeds, until it is stated again
    ("fanuc", "/F300.\nG1 X1.\nF30. X2.\n", [None, 30.0]),
    ("fanuc", "/F60.\nG1 X1.\n", [60.0]),
    ("fanuc", "/F30.\n/F60.\nG1 X1.\n", [None]),
    ("fanuc", "G95 F.1 S1000 M3\n/S500\nG1 X1.\nS200\nX2.\n", [None, 20.0]),
    ("fanuc", "IF [#500 EQ 1] GOTO 10\nF30.\nN10 G1 X1.\n", [None]),
    ("linuxcnc", "o1 if [#<_x> GT 3]\nF77\no1 endif\nG1 X1\n", [None]),
    ("sinumerik", "IF R9>3\nF77\nENDIF\nG1 X1\n", [None]),
    # code that is not read may state others
    ("fanuc", "M98 P9000\nG94 G1 X1.\nF30. X2.\n", [None, 30.0]),
    # what a subprogram with SAVE has selected ends with it
    ("sinumerik", "G95 F0.1 S1000\nL5\nS500\nG1 X1\nM30\n%_N_L5_SPF\nPROC L5 SAVE\nG96\nM17\n", [50.0]),
]


@pytest.mark.parametrize(("name", "text", "feeds"), FEEDS)
def test_feeds_are_those_of_the_rule(name: str, text: str, feeds: list[float | None]) -> None:
    """[mm/min] of the motions after the head that run."""
    path = read(name, text).toolpath
    found = [path.feed[row] * 60e3 for row in range(1, len(path)) if path.kind[row]][: len(feeds)]
    assert len(found) == len(feeds)
    for value, wanted in zip(found, feeds, strict=True):
        assert np.isnan(value) if wanted is None else value == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("text", "tools"),
    [
        # T2. is #20, M6. is #13, H0. is #11: the control loads and measures nothing
        ("G65 P2 T2.\nM6" + SUB, [1]),
        ("T2\nG65 P2 M6." + SUB, [1]),
        ("G65 P2 T2. H0. M6." + SUB, [1]),
        ("G65 P9810 T2. H2. M6.\nG90 G54 G1 X1.\n", [1]),
        ("G66 P9001 T2. M6.\nG67\nG90 G54 G1 X1.\n", [1]),
        ("G66.1 P9001\nT2. M6.\nG67\nG90 G54 G1 X1.\n", [1]),
        ("T2 M6\nG1 X1.\n", [2]),
    ],
)
def test_arguments_load_no_tool(text: str, tools: list[int]) -> None:
    path = read("fanuc", "G43 H1\n" + text).toolpath
    assert [path.frames[path.tool[row]].number for row in range(1, len(tools) + 1)] == tools
    assert "GCO029" not in [finding.code for finding in read("fanuc", "G43 H1\n" + text).findings]


def test_letters_of_g66_turn_no_axis() -> None:
    path = read("fanuc", "G1 X1.\nG66 P2 A1. B2. C3.\nG67\nG90 G54 G1 X2. Y0. Z0.\n").toolpath
    assert list(path.constraints.refused) == []
    np.testing.assert_allclose(path.position[1:] * 1e3, [[1, 0, 0], [2, 0, 0]])


def test_what_a_modal_macro_leaves_is_not_known() -> None:
    """G66 calls it after each motion: it may select G91, another offset, or set a variable."""
    for after, known in (
        ("G1 X2. Y0. Z0.", False),
        ("G90 G54 G17 G1 X2. Y0. Z0.", True),
        ("G90 G54 G1 X#100", False),
    ):
        path = read("fanuc", f"#100=4.\nG66 P2\nX9.\nG67\n{after}\n").toolpath
        assert (len(path) - 1 not in path.constraints.refused) is known, after


def test_an_end_among_the_arguments_ends_nothing() -> None:
    path = read("fanuc", "G66 P2 M30.\nG67\nG90 G54 G1 X1. Y1. Z1.\n").toolpath
    assert list(path.constraints.refused) == []


def test_a_tolerance_of_blending_that_may_be_stated_is_not_known() -> None:
    path = read("linuxcnc", "G64 P0.01\nG1 X1\n/G64 P1\nX2\nG64 P0.02\nX3\nX4\n").toolpath
    np.testing.assert_allclose(path.approximation[1:4] * 1e3, [0.01, np.nan, 0.02])
