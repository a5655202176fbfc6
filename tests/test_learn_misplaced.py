"""`learn`: points that lie beside the surface, and files that repeat another one."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from test_learn_command import call, changed, comment, files, with_rows

pytestmark = pytest.mark.slow

SAMPLE = Path(__file__).resolve().parent.parent / "samples" / "kr270_second_part"


@pytest.fixture
def shop(tmp_path):
    shutil.copytree(SAMPLE, tmp_path / "shop")
    return tmp_path / "shop"


def on(name, change):
    """``change`` of the rows whose feature starts with ``name``."""
    return lambda lines: with_rows(
        lines, lambda rows: [change(row) if row[7].startswith(name) else row for row in rows]
    )


def all_shifted(distance):
    return on("", lambda row: [str(float(row[0]) + distance), *row[1:]])


REFUSED = {
    "columns of the normals exchanged": (
        on("WALL", lambda row: [*row[:3], row[4], row[3], *row[5:]]),
        "they would if their columns were in the order NY, NX, NZ",
    ),
    "normals of the walls into the material": (
        on("WALL", lambda row: [*row[:3], *(str(-float(one)) for one in row[3:6]), *row[6:]]),
        "they would if all had the other sign",
    ),
    "normals of the floors downwards": (
        on("FLOOR", lambda row: [*row[:5], "-1", *row[6:]]),
        "points lie on the surface that the tools leave, but their normals do not",
    ),
    "all points shifted by 1 mm": (
        all_shifted(1.0),
        "are shifted against the surface of this program by X +1.00",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_the_mistake_of_misplaced_points_is_named(shop, case):
    change, words = REFUSED[case]
    changed(shop, lambda lines: change([line for line in lines if not line.startswith("# checked:")]))
    before = files(shop)
    done = call(shop, "part.src", "part1.csv", "--positive", "material_left")
    assert done.exit_code == 1, done.output
    assert "LRN003" in done.output
    assert words in " ".join(done.output.split())
    assert files(shop) == before


def test_a_feature_of_which_no_point_is_used_is_a_warning(shop):
    """One wall lies 20 mm deeper, where no tool comes: what the others promise is not promised of it."""
    move = on("WALL A", lambda row: [*row[:2], str(float(row[2]) - 20.0), *row[3:]])
    changed(shop, lambda lines: move([line for line in lines if not line.startswith("# checked:")]))
    done = call(shop, "part.src", "part1.csv", "--dry-run", "--positive", "material_left")
    assert done.exit_code == 3, done.output
    assert "LRN022 no point of WALL A is used" in " ".join(done.output.split())


def test_a_scatter_that_is_stated_too_small_is_said(shop):
    changed(shop, comment("sigma_mm", "0.001"))
    done = call(shop, "part.src", "part1.csv", "--dry-run")
    assert "LRN023" in done.output
    assert "times the stated scatter of the probe (0.0010 mm)" in " ".join(done.output.split())


@pytest.mark.parametrize("change", ["order", "digits"])
def test_a_file_that_repeats_another_one_is_no_second_part(shop, change):
    head, rows = [], []
    for line in (shop / "part1.csv").read_text().splitlines():
        (rows if line[:1].isdigit() or line[:1] == "-" else head).append(line)
    if change == "order":
        rows.reverse()
    else:
        rows = [",".join([*row.split(",")[:6], row.split(",")[6] + "0", *row.split(",")[7:]]) for row in rows]
    (shop / "part2.csv").write_text("\n".join([*head, *rows]) + "\n")
    done = call(shop, "part.src", "part1.csv", "part2.csv")
    assert done.exit_code == 1, done.output
    assert f"LRN001 {len(rows)} of {len(rows)} rows are those of part1.csv" in " ".join(done.output.split())
