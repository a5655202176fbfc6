"""Twenty points: what confirms itself is learnt from, and rows in another order are not."""

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
    path = write_shop(tmp_path_factory.mktemp("few") / "shop")
    postproc.compensate(path, force=True)
    return path


def refused(program, seed: int, shuffled: bool) -> list[str]:
    """Messages of a part of the blind benchmark with 20 points; ``shuffled``: their deviations in another order."""
    rng = np.random.default_rng([seed, zlib.crc32(b"same20")])
    surface = surface_of(program.parent, *surface_points(COUNT, rng))
    truth = draw_truth(rng, [name for name in surface.program.operations.names if name != "tool 1"])
    chosen = rng.choice(COUNT, 20, replace=False)
    first = program.parent / "compensated" / "part.src"
    deviation = probe(surface, cut(surface, truth, truth.plant(), first, rng), chosen, 1e-5, rng)
    if shuffled:
        deviation = rng.permutation(deviation)
    path = program.parent / "m.csv"
    write_csv(path, surface, chosen, deviation, first, 1e-5)
    try:
        postproc.learn(program, path, dry_run=True)
    except postproc.Refusal as refusal:
        return [f"{one.code} {one.message}" for one in refusal.findings]
    return []


def test_a_part_that_its_causes_explain_is_learnt_from(program):
    """Held-out points are predicted badly, as each of them is needed, and yet all are far likelier by the causes."""
    assert refused(program, 40001, shuffled=False) == []


@pytest.mark.parametrize("seed", [40002, 40004])
def test_rows_in_another_order_are_refused(program, seed):
    (message,) = refused(program, seed, shuffled=True)
    assert message.startswith("LRN004")
    assert "another order" in message
