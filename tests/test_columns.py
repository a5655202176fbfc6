"""A table in bulk is the table that the csv module writes, row by row."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from postproc.report.csv_columns import NumberColumn, TextColumn, csv_parts


@pytest.mark.parametrize("rows", [0, 1, 7, 1000])
def test_it_is_what_the_csv_module_writes(rows):
    rng = np.random.default_rng(4)
    small = rng.normal(size=rows) * 10.0 ** rng.integers(-9, 7, rows)
    small[rng.random(rows) < 0.2] = np.nan
    small[rng.random(rows) < 0.1] = 0.0
    small[rng.random(rows) < 0.1] = -1e-9
    codes, words = rng.integers(0, 3, rows), ["LIN", "", "CIRC", "LONGER"]
    large = rng.integers(-(10**6), 10**6, rows) * np.where(rng.random(rows) < 0.1, 1e14, 0.125)
    none = np.full(rows, np.nan)

    def columns(part):
        return [
            NumberColumn("line", np.arange(rows)[part] + 1.0),
            NumberColumn("x_mm", small[part], 6),
            TextColumn("kind", codes[part], words),
            NumberColumn("large", large[part], 9),
            NumberColumn("one", np.full(rows, -2.5)[part], 3),
            NumberColumn("none", none[part], 3),
            NumberColumn("bound", np.where(small > 0, np.inf, -np.inf)[part], 3),
        ]

    made = b"".join(csv_parts(columns, rows, 300))  # several parts
    stream = io.StringIO()
    table = csv.writer(stream, lineterminator="\n")
    table.writerow(["line", "x_mm", "kind", "large", "one", "none", "bound"])

    def text(value, decimals):
        return "" if np.isnan(value) else f"{round(float(value), decimals) + 0.0:.{decimals}f}"

    for row in range(rows):
        texts = text(small[row], 6), words[codes[row]], text(large[row], 9)
        table.writerow([row + 1, *texts, "-2.500", "", ""])
    assert made.decode() == stream.getvalue()
