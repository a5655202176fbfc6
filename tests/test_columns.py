"""A table in bulk is the table that the csv module writes, row by row."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from postproc.report import columns
from postproc.report.columns import Numbers, Words, csv_bytes


@pytest.mark.parametrize("rows", [0, 1, 7, 1000])
def test_it_is_what_the_csv_module_writes(rows, monkeypatch):
    monkeypatch.setattr(columns, "ROWS", 300)  # several parts
    rng = np.random.default_rng(4)
    small = rng.normal(size=rows) * 10.0 ** rng.integers(-9, 7, rows)
    small[rng.random(rows) < 0.2] = np.nan
    small[rng.random(rows) < 0.1] = 0.0
    small[rng.random(rows) < 0.1] = -1e-9
    codes, words = rng.integers(0, 3, rows), ["LIN", "", "CIRC"]
    made = csv_bytes(
        [Numbers("line", np.arange(rows) + 1.0), Numbers("x_mm", small, 6), Words("kind", codes, words)]
    )
    stream = io.StringIO()
    table = csv.writer(stream, lineterminator="\n")
    table.writerow(["line", "x_mm", "kind"])
    for row in range(rows):
        text = "" if np.isnan(small[row]) else f"{round(float(small[row]), 6) + 0.0:.6f}"
        table.writerow([row + 1, text, words[codes[row]]])
    assert made.decode() == stream.getvalue()
