"""The page of a learnt part: its tables are those of the result, its points lie on the part."""

import hashlib
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import postproc
from postproc.learning.causes import PriorKnowledge
from postproc.learning.measured_part import read_measured_part
from postproc.part.surface import find_surface
from postproc.report.learned_picture import panel_values
from postproc.workflows.learn_page import part_shape
from postproc.workflows.learn_points import match, read_job
from postproc.workflows.preparation import Request

SAMPLES = Path(__file__).resolve().parent.parent / "samples"

pytestmark = pytest.mark.slow


class Tables(HTMLParser):
    """The tables of a page as lists of rows of texts."""

    def __init__(self, text):
        super().__init__()
        self.tables, self.cell = [], None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag == "table":
            self.tables.append([])
        elif tag == "tr" and self.tables:
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.cell = ""

    def handle_data(self, data):
        if self.cell is not None:
            self.cell += data

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self.tables[-1][-1].append(self.cell.strip())
            self.cell = None


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page") / "shop"
    shutil.copytree(SAMPLES / "kr270_second_part", folder)
    learned = postproc.learn(folder / "part.src", folder / "part1.csv", page=folder / "page.html")
    return learned, (folder / "page.html").read_text()


def test_the_tables_are_those_of_the_result(page):
    learned, text = page
    tables = {table[0][0]: table for table in Tables(text).tables if len(table[0]) > 3}
    causes = {row[0]: row for row in tables["cause"][1:]}
    entries = learned.to_dict()["causes"]
    assert set(causes) == {one["cause"] for one in entries}
    for one in entries:
        row = causes[one["cause"]]
        for cell, key in zip(row[5:8], ("value", "lower", "upper"), strict=True):
            assert float(cell) == pytest.approx(one[key], rel=1e-3, abs=1e-9)
        if one["unit"] == "1":
            assert (float(row[2]), float(row[4])) == pytest.approx(
                (1.0, np.exp(one["before_ci95"])), rel=1e-3
            )
        else:
            assert (float(row[2]), float(row[4])) == pytest.approx((0.0, one["before_ci95"]), rel=1e-3)
    rest = np.sort(np.abs(learned.table()["remaining_mm"]))[::-1]
    shown = [abs(float(row[9])) for row in tables["file"][1:21]]
    assert shown == pytest.approx(rest[:20].tolist(), abs=6e-5)
    assert [row[:2] for row in tables["part"][1:]] == [["1", "part1.csv"]]


def test_what_is_drawn_adds_up(page):
    """Measured is explained and remaining; each panel says its size."""
    learned, _ = page
    values = panel_values(learned)
    assert len(values["measured"]) == learned.to_dict()["points"]["used"]
    np.testing.assert_allclose(values["measured"], values["explained"] + values["remaining"], atol=1e-12)
    sizes = {name: 1e3 * np.sqrt(np.mean(value**2)) for name, value in values.items()}
    assert sizes["remaining"] < 0.1 * sizes["measured"]
    assert sizes["remaining"] == pytest.approx(learned.to_dict()["residual_rms_mm"], rel=1e-4)


def test_a_page_asks_for_nothing_and_hides_nothing_of_its_files(page):
    _, text = page
    assert not re.search(r"(src|href)=\"(https?:)?//", text)
    assert 'href="./learned/part.src"' in text


def shape_of(folder, program, rows, job=None):
    """The shape of a part of which a file has the points and normals ``rows`` (K, 6) in mm."""
    digest = hashlib.sha256((folder / program).read_bytes()).hexdigest()
    head = ["# positive: material_left", "# alignment: free", "# cut_with: original", f"# sha256: {digest}"]
    lines = [*head, "# sigma_mm: 0.01", "X,Y,Z,NX,NY,NZ,DEV"]
    for k, row in enumerate(rows):
        lines.append(",".join(f"{one:.6f}" for one in row) + f",{0.01 * (k % 3 + 1)}")
    (folder / "m.csv").write_text("\n".join(lines) + "\n")
    request = Request(folder / program, force="")
    job = job or read_job(request)
    matched = match(request, job, [read_measured_part(folder / "m.csv")], PriorKnowledge())
    return part_shape(job, matched)


def test_the_surface_of_a_stock_is_that_of_its_blank(tmp_path):
    """The mesh fills the blank of the process file, in the axes of the program's base, and points lie on it."""
    folder = tmp_path / "stock"
    shutil.copytree(SAMPLES / "kr270_stock", folder)
    job = read_job(Request(folder / "part.ngc", force=""))
    surface = find_surface(job.ready.task.force.stock.engagement.stock, 3000)
    own = np.flatnonzero(surface.sweep >= 0)[::40]
    rows = np.column_stack([1e3 * surface.points[own], surface.normals[own]])
    shape = shape_of(folder, "part.ngc", rows, job)
    low, high = 1e3 * shape.vertices.min(axis=0), 1e3 * shape.vertices.max(axis=0)
    np.testing.assert_allclose(low, [0, 0, -30], atol=0.5)
    np.testing.assert_allclose(high, [120, 80, 0], atol=0.5)
    assert len(shape.path) == 0
    away = np.linalg.norm(rows[:, None, :3] - 1e3 * shape.vertices[None], axis=2).min(axis=1)
    assert np.median(away) < 1.5


def test_without_a_stock_the_paths_are_those_of_the_program(tmp_path):
    """Their places are the literals of the program, in its base."""
    folder = tmp_path / "shop"
    shutil.copytree(SAMPLES / "kr270_second_part", folder)
    text = (folder / "part1.csv").read_text().splitlines()
    rows = [[float(one) for one in line.split(",")[:6]] for line in text if line[0].isdigit()]
    shape = shape_of(folder, "part.src", rows[:20])
    assert not len(shape.faces)
    path = 1e3 * shape.path[np.isfinite(shape.path[:, 0])]
    literals = re.findall(r"LIN \{X ([-.\d]+),Y ([-.\d]+),Z (-[.\d]+)", (folder / "part.src").read_text())
    places = np.array(literals, float)
    near = np.linalg.norm(places[:, None] - path[None], axis=2).min(axis=1)
    assert (near < 1e-3).mean() > 0.95
    assert path.min(axis=0) == pytest.approx(places.min(axis=0), abs=1e-3)
