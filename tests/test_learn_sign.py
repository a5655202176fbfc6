"""The sign of the deviations: what points and measured places show of it, and what is said where nothing does."""

import zlib

import numpy as np
import pytest
from blind_parts.cutting import cut, probe, surface_of, write_csv
from blind_parts.shop import surface_points, write_shop
from blind_parts.truth import draw_truth

import postproc

pytestmark = pytest.mark.slow

COUNT = 140


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    path = write_shop(tmp_path_factory.mktemp("sign") / "shop")
    postproc.compensate(path, force=True)
    return path


def codes_of(
    program, row, seed, hidden, worn, count, sign=1.0, checked=False, places=False, **options
) -> list[str]:
    """Codes of a part of the blind benchmark, whose DEV count the other way with the sign -1."""
    rng = np.random.default_rng([seed, zlib.crc32(row.encode())])
    surface = surface_of(program.parent, *surface_points(COUNT, rng))
    operations = [name for name in surface.program.operations.names if name != "tool 1"]
    truth = draw_truth(rng, operations, hidden, 0.0, worn)
    chosen = rng.choice(COUNT, count, replace=False)
    first = program.parent / "compensated" / "part.src"
    errors = cut(surface, truth, truth.plant(), first, rng)
    path = program.parent / "m.csv"
    true = probe(surface, errors, chosen, 1e-5, rng)
    write_csv(path, surface, chosen, sign * true, first, 1e-5, places, checked, found=true)
    try:
        return [one.code for one in postproc.learn(program, path, dry_run=True, **options).findings]
    except postproc.Refusal as refusal:
        return [one.code for one in refusal.findings]


def test_an_effect_that_the_robot_file_misses_is_no_wrong_sign(program):
    """A worn gear: the known causes alone explain the other sign exp(8.7) times better, a loop only the stated one."""
    worn = program, "worn_hysteresis", 9100, ("hysteresis",), 4.0, 120
    good = codes_of(*worn)
    assert "LRN012" in good
    assert not {"LRN004", "LRN019", "LRN020"} & set(good)
    assert codes_of(*worn, sign=-1.0) == ["LRN004"]


PLAIN = "same100", 7003, (), 1.0, 100


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_sign_that_nothing_shows_has_to_be_stated_again(program, sign):
    assert codes_of(program, *PLAIN, sign) == ["LRN020"]


@pytest.mark.parametrize("way", [{"places": True}, {"checked": True}])
def test_a_second_look_shows_the_sign(program, way):
    assert not {"LRN004", "LRN019", "LRN020"} & set(codes_of(program, *PLAIN, **way))
    if "checked" in way:
        assert codes_of(program, *PLAIN, sign=-1.0, **way) == ["LRN001"]


def test_a_sign_that_is_only_said_twice_is_warned_of(program):
    assert "LRN019" in codes_of(program, *PLAIN, positive="material_left")
    assert codes_of(program, *PLAIN, positive="material_missing") == ["LRN001"]


def test_a_program_that_is_no_worse_either_way_needs_no_second_look(program):
    """With a hundredth of the correction the next part is the same with either sign."""
    codes = codes_of(program, *PLAIN, gain=0.01)
    assert "LRN019" in codes
    assert "LRN020" not in codes


def test_a_worn_gear_is_no_radius_of_a_probe(program):
    """A gap moves most of the points by 0.1 mm to one side."""
    codes = codes_of(program, "worn_backlash", 40007, ("backlash",), 4.0, 120, checked=True)
    assert "LRN004" not in codes
