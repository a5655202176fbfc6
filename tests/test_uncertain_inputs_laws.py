"""Intervals of 95 % and the standard deviations made of them: of the force, its direction and its components."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm
from test_expanded_uncertainty import paper

from postproc.cell import ForceVectorInterval
from postproc.compensation.uncertain_inputs import input_uncertainties


@pytest.mark.parametrize("seed", range(3))
def test_a_normal_figure_is_outside_of_its_interval_once_in_twenty_times(seed):
    """A half width h is that of a deviation d with P(|x| > h) = 0.05; a figure of width 0 is none."""
    chance = np.random.default_rng(seed)
    share, direction = chance.uniform(0.1, 3.0, 2)
    components = chance.uniform(0.5, 90.0, 3)
    model = paper()
    alone = len(input_uncertainties(model).entries)
    known = input_uncertainties(model, share, True, ForceVectorInterval(direction, components))
    widths = [share, direction, direction, *components]
    entries = known.entries[alone:]
    assert len(entries) == len(widths)
    for entry, width in zip(entries, widths, strict=True):
        assert entry.deviation is not None
        assert 2 * norm.sf(width / entry.deviation) == pytest.approx(0.05, rel=1e-3), entry.name
    np.testing.assert_allclose(
        np.diag(known.covariance)[alone:], [float(entry.deviation or 0.0) ** 2 for entry in entries]
    )
    straight = input_uncertainties(model, share, True, ForceVectorInterval(0.0, components))
    assert [one.name for one in straight.entries[alone:]] == [one.name for one in (entries[0], *entries[3:])]
