"""M70 to M73 of LinuxCNC: modes that are saved come back where the program says which, as in its interpreter."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gcode_judge.blocks import Block, Made
from gcode_judge.oracle import MISSING, RS274, execute

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.dialect import Program, ReadingSettings
from postproc.toolpath import Toolpath

HEAD = "G21 G90 G17 G54 G94 G40 G61 T1 M6\nG43\nG0 X0 Y0 Z0 F600\n"


def read(text: str) -> Program:
    settings = ReadingSettings(orientation=np.array([0.0, 0.0, np.pi]))
    return DIALECTS["linuxcnc"].read((Document(Path("part.ngc"), text.encode()),), settings)


def targets(path: Toolpath) -> list[tuple[float, float, float] | None]:
    """X, Y, Z [mm] of the motions, in the order in which they run; None of those that are not known."""
    refused = path.constraints.refused
    return [
        None if row in refused else tuple(np.round(path.position[row] * 1e3, 6).tolist())
        for row in range(len(path))
    ]


KNOWN = {
    "M72": ("M70\nG91 G20\nG1 X1\nM72\nG1 X50\n", [25.4, 50]),
    "M72 twice": ("M70\nG91\nG1 X1\nM72\nG91\nG1 X1\nM72\nG1 X50\n", [1, 2, 50]),
    "the last M70": ("M70\nG91\nM70\nG90\nM72\nG1 X5\nG1 X5\n", [5, 10]),
    "a subprogram": ("o1 sub\nM73\nG91\nG1 X1\no1 endsub\no1 call\nG1 X50\n", [1, 50]),
    "a subprogram that returns early": (
        "o1 sub\nM73\nG91\nG1 X1\no2 if [1 eq 1]\no1 return\no2 endif\nG1 X7\no1 endsub\no1 call\nG1 X50\n",
        [1, 50],
    ),
    "a subprogram in another": (
        "o1 sub\nM73\nG91\nG1 X1\no1 endsub\no2 sub\nM70\no1 call\nG91\nG1 X1\nM72\no2 endsub\no2 call\nG1 X50\n",
        [1, 2, 50],
    ),
    "the kind of motion stays": ("G1 X5\nM70\nG0 X6\nM72\nX7\n", [5, 6, 7]),
    "planes": ("M70\nG18\nM72\nG1 X1\nG2 X3 I1 J0\n", [1, 3]),
}


def program(name: str) -> str:
    text = KNOWN[name][0]
    at = text.rindex("endsub\n") + len("endsub\n") if text.startswith("o") else 0
    return text[:at] + HEAD + text[at:] + "M2\n"


@pytest.mark.parametrize("name", KNOWN)
def test_modes_that_are_saved_come_back(name: str) -> None:
    known = [found for found in targets(read(program(name)).toolpath) if found is not None]
    assert [found[0] for found in known[1:]] == KNOWN[name][1]


@pytest.mark.skipif(RS274 is None, reason=MISSING)
@pytest.mark.parametrize("name", KNOWN)
def test_linuxcnc_brings_them_back_alike(name: str, tmp_path: Path) -> None:
    motions = execute(Made(tuple(Block((line,)) for line in program(name).splitlines()), False, 1), tmp_path)
    assert motions is not None
    reached = [motion.end[0] for motion in motions]
    np.testing.assert_allclose(reached[1:], KNOWN[name][1], atol=2e-3)


@pytest.mark.parametrize(
    "text",
    [
        "G91\nM72\nG1 X5\n",
        "/M70\nG91\nM72\nG1 X5\n",
        "M70\nG91\nM71\nM72\nG1 X5\n",
        "M70\nG91\n/M72\nG1 X5\n",
        "G91\nM70 G90\nM72\nG1 X5\n",
        "M70\nG91 G43 H2\nM72\nG1 X5\n",
        "M70\no1 if [#5 eq 1]\nM72\no1 endif\nG91\nG1 X5\n",
    ],
)
def test_where_it_is_not_certain_what_comes_back_nothing_is_known(text: str) -> None:
    program = read(HEAD + text + "M2\n")
    assert len(program.toolpath) - 1 in program.toolpath.constraints.refused


def test_a_feed_that_another_one_replaced_is_not_known_again() -> None:
    """LinuxCNC brings it back with one decimal."""
    path = read(HEAD + "M70\nF300.\nG1 X1\nM72\nG1 X2\nF200.\nG1 X3\n" + "M2\n").toolpath
    np.testing.assert_allclose(path.feed[1:], [300 / 60e3, np.nan, 200 / 60e3])
    path = read(HEAD + "M70\nG91\nG1 X1\nM72\nG1 X2\n" + "M2\n").toolpath
    np.testing.assert_allclose(path.feed[1:], 600 / 60e3)
