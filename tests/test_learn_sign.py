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


def findings_of(program, row, seed, hidden, worn, count, sign=1.0, places=False) -> list[str]:
    """Codes of a part of the blind benchmark, whose DEV count the other way with the sign -1."""
    rng = np.random.default_rng([seed, zlib.crc32(row.encode())])
    surface = surface_of(program.parent, *surface_points(COUNT, rng))
    operations = [name for name in surface.program.operations.names if name != "tool 1"]
    truth = draw_truth(rng, operations, hidden, 0.0, worn)
    chosen = rng.choice(COUNT, count, replace=False)
    first = program.parent / "compensated" / "part.src"
    errors = cut(surface, truth, truth.plant(), first, rng)
    path = program.parent / "m.csv"
    write_csv(path, surface, chosen, sign * probe(surface, errors, chosen, 1e-5, rng), first, 1e-5, places)
    try:
        return [one.code for one in postproc.learn(program, path, dry_run=True).findings]
    except postproc.Refusal as refusal:
        return [one.code for one in refusal.findings]


def test_an_effect_that_the_robot_file_misses_is_no_wrong_sign(program):
    """A worn gear: the known causes alone explain the other sign exp(8.7) times better, a loop only the stated one."""
    worn = program, "worn_hysteresis", 9100, ("hysteresis",), 4.0, 120
    good = findings_of(*worn)
    assert "LRN012" in good
    assert not {"LRN004", "LRN019"} & set(good)
    assert findings_of(*worn, sign=-1.0) == ["LRN004"]


def test_a_sign_that_nothing_shows_is_said_and_places_show_it(program):
    plain = program, "same100", 7003, (), 1.0, 100
    assert "LRN019" in findings_of(*plain)
    assert "LRN019" not in findings_of(*plain, places=True)
