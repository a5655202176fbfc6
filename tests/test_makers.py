"""What the makers' numbers say of the robot's configuration; and that nobody else knows these numbers."""

import ast
from pathlib import Path

import numpy as np
import pytest
from motions import motions
from sources import parse_file, walk

import postproc
from postproc.base.geometry import Poses
from postproc.robot.branches import BranchBit, negative_axes
from postproc.robot.makers import MAKERS, maker_of
from postproc.toolpath import Configuration, Kind, pack_quadrants

ROOT = Path(postproc.__file__).parent
NUMBERS = {name for maker in MAKERS for name in maker.names}


def stated(**numbers) -> Configuration:
    return Configuration({name: np.array(one) for name, one in numbers.items()}).for_motions(
        len(next(iter(numbers.values())))
    )


def test_each_number_has_one_maker():
    assert len(NUMBERS) == sum(len(maker.names) for maker in MAKERS)
    for maker in MAKERS:
        for name in maker.names:
            assert maker_of(stated(**{name: [1]})) is maker
    nobody = maker_of(Configuration().for_motions(2))
    assert nobody.names == ()
    assert nobody.branches(Configuration().for_motions(2)).tolist() == [-1, -1]
    assert nobody.turns_match(Configuration().for_motions(2), np.zeros((2, 6))).all()


B, E, F = BranchBit


@pytest.mark.parametrize(
    ("numbers", "branches"),
    [
        ({"status": [-1, 0, 1, 2, 4, 7, 8 + 6]}, [-1, 0, B, E, F, B + E + F, E + F]),
        ({"cfx": [-1, 0, 1, 2, 3, 4, 6]}, [-1, E, E + F, 0, F, B + E, B]),
        ({"nut": [-1, 0, 1, 2, 3, 4, 5]}, [-1, E, E + F, 0, F, -1, -1]),
    ],
    ids=["S", "cfx", "CONFIG"],
)
def test_branches(numbers, branches):
    configuration = stated(**numbers)
    assert maker_of(configuration).branches(configuration).tolist() == branches


def test_turns_are_those_of_the_maker():
    q = np.radians([[10.0, -90, 90, -10, 20, 100], [-10.0, -90, 90, -10, 20, 100]])
    kuka = stated(turn=[0b001010, 0b001010])
    assert negative_axes(q).tolist() == [0b001010, 0b001011]
    assert maker_of(kuka).turns_match(kuka, q).tolist() == [True, False]
    cfs = pack_quadrants((0, -1, 1))
    abb = stated(quadrants=[cfs, cfs], cfx=[0, 0])
    assert maker_of(abb).turns_match(abb, q).tolist() == [True, False]
    whole = q + np.radians([[360.0, 0, 0, 0, 0, 0]])
    assert maker_of(abb).turns_match(abb, whole).tolist() == [True, False]
    assert maker_of(abb).quadrants_change(abb, q, q[::-1]).all()
    assert not maker_of(abb).quadrants_change(abb, q, q).any()


def test_no_statement_no_change(request):
    path = motions(Poses(np.tile(np.eye(3), (3, 1, 1)), np.zeros((3, 3))), kind=Kind.PTP)
    maker = maker_of(path.configuration)
    q = np.array([[0.1, -0.2, 0.3, 0.4, 0.5, 0.6]] * 3)
    assert not maker.turns_change(None, path.configuration, q, -q).any()


def test_only_makers_and_languages_know_their_numbers():
    """S, T, cfx and the like stand as texts nowhere else in the package."""
    allowed = ("languages/", "robot/makers/", "posts/")
    found = {
        path.relative_to(ROOT).as_posix(): node.lineno
        for path in sorted(ROOT.rglob("*.py"))
        for node in walk(parse_file(path))
        if isinstance(node, ast.Subscript)
        and isinstance(node.slice, ast.Constant)
        and node.slice.value in NUMBERS
    }
    assert {name: line for name, line in found.items() if not name.startswith(allowed)} == {}
