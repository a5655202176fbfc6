"""Which contacts of short motions are looked at, and which are interpolated, with contacts that are functions."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("numba")

from postproc.process.stock.chains import chain_contacts
from postproc.process.stock.contact import COLUMNS, FORCE, RATE
from postproc.process.stock.distance import AXIS, ROW, STEP, TIP_POINT

MM, COUNT, EVEN = 1e-3, 200, 0.01


def looked_at(rate, force=None, turns=None):
    """Contacts (COUNT, COLUMNS) along motions of 1 mm, 2.5 mm between two that are looked at, and how many were.

    rate: removed area at places x [mm]; force: likewise, else as large; turns: motion from which on the path turns."""
    rows = np.zeros((COUNT, ROW))
    way = np.tile([MM, 0.0, 0.0], (COUNT, 1))
    if turns is not None:
        way[turns:] = [0.0, MM, 0.0]
    rows[:, STEP : STEP + 3] = way
    rows[:, TIP_POINT : TIP_POINT + 3] = np.cumsum(way, axis=0) - way
    rows[:, AXIS + 2] = 1.0
    sweeps = SimpleNamespace(rows=rows, length=np.full(COUNT, MM))
    seen = []

    def look(some):
        seen.extend(some.tolist())
        found = np.zeros((len(some), COLUMNS))
        x = some + 0.5
        found[:, RATE] = rate(x)
        found[:, FORCE] = (rate if force is None else force)(x)
        return found

    laws, every = np.ones((COUNT, 9)), np.arange(COUNT)
    found = chain_contacts(sweeps, laws, every, np.full(COUNT, 2.5 * MM), EVEN, look)
    assert len(seen) == len(set(seen))
    return found, len(seen)


def x():
    return np.arange(COUNT) + 0.5


def test_what_goes_on_evenly_is_looked_at_as_closely_as_a_long_motion():
    found, many = looked_at(lambda at: 1 + 0 * at)
    assert np.all(found[:, RATE] == 1)
    assert many < 0.45 * COUNT


def test_what_rises_evenly_is_interpolated_too():
    found, many = looked_at(lambda at: 1 + 0.02 * at)
    assert found[:, RATE] == pytest.approx(1 + 0.02 * x())
    assert many < 0.45 * COUNT


def test_a_bend_is_interpolated_to_a_part_of_what_it_may_be_off():
    def wave(at):
        return 1 + 0.3 * np.sin(at / 12)

    found, many = looked_at(wave)
    off = np.abs(found[:, RATE] / wave(x()) - 1)
    assert many < 0.5 * COUNT
    assert 1e-4 < off.max() < 0.5 * EVEN


@pytest.mark.parametrize("period", [4.0, 7.0, 9.0])
def test_what_bends_by_more_is_looked_at(period):
    def wave(at):
        return 1 + 0.3 * np.sin(2 * np.pi * at / period)

    found, _ = looked_at(wave)
    assert np.abs(found[:, RATE] / wave(x()) - 1).max() < EVEN


@pytest.mark.parametrize("first", [100.0, 101.3, 102.6])
def test_a_step_a_dip_and_an_end_of_the_cut_are_looked_at(first):
    for low, last in ((0.5, 300.0), (0.5, first + 4), (0.0, 300.0), (0.0, first + 4)):

        def rate(at, low=low, last=last):
            return np.where((at > first) & (at < last), low, 1.0)

        found, many = looked_at(rate)
        assert np.allclose(found[:, RATE], rate(x()), atol=1e-12)
        assert many < (0.6 if low > 0 else 0.8) * COUNT  # in air each is looked at


def test_a_force_that_turns_is_looked_at_where_the_area_stays():
    def force(at):
        return np.where(at > 100, 2.0, 1.0)

    found, _ = looked_at(lambda at: 1 + 0 * at, force)
    assert np.allclose(found[:, FORCE], force(x()), atol=1e-12)


def test_without_a_known_force_the_area_counts():
    found, many = looked_at(lambda at: 1 + 0.02 * at, lambda at: np.nan * at)
    assert found[:, RATE] == pytest.approx(1 + 0.02 * x())
    assert many < 0.45 * COUNT


def test_a_path_that_turns_starts_another_chain():
    found, _ = looked_at(lambda at: np.where(at < 100, 1.0, 0.9), turns=100)
    assert np.allclose(found[:, RATE], np.where(x() < 100, 1.0, 0.9), atol=1e-12)
