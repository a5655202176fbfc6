"""Odd cells and numbers: no traceback, nothing moved farther than is allowed, never worse with exit code 0.

``python -m tests.odd_cells 2000`` runs as many as wanted.
"""

from __future__ import annotations

import os

import pytest
from odd_cells import wrong

COUNT = int(os.environ.get("POSTPROC_ODD_CELLS", "200"))
FAST = 20


@pytest.mark.sample(1)
@pytest.mark.parametrize("part", range(COUNT // FAST))
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_odd_cells_and_numbers(tmp_path, part):
    for seed in range(FAST * part, FAST * part + FAST):
        assert wrong(seed, tmp_path) == ""
