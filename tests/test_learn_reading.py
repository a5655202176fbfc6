"""The CSV of a measured part: what is wrong is told in words with its line, and nothing is guessed."""

from pathlib import Path

import numpy as np
import pytest

from postproc.base.findings import Refusal
from postproc.learning.measured_part import FREEDOMS, read_measured_part

HEAD = {
    "positive": "material_left",
    "alignment": "free",
    "cut_with": "original",
    "sha256": "0123456789abcdef",
    "sigma_mm": "0.01",
}
COLUMNS = "X,Y,Z,NX,NY,NZ,DEV"
ROWS = [f"{10 * i},{5 * i * i},-3,0,{0.6 if i % 2 else -0.6},0.8,{0.01 * i - 0.02:.3f}" for i in range(8)]


def write(folder: Path, head=None, columns=COLUMNS, rows=None) -> Path:
    lines = [f"# {key}: {value}" for key, value in {**HEAD, **(head or {})}.items() if value is not None]
    path = folder / "part.csv"
    path.write_text("\n".join([*lines, columns, *(ROWS if rows is None else rows)]) + "\n")
    return path


def refused(path: Path):
    with pytest.raises(Refusal) as caught:
        read_measured_part(path)
    (finding,) = caught.value.findings
    assert finding.code == "LRN001"
    return finding


def test_what_is_read(tmp_path):
    part = read_measured_part(write(tmp_path))
    np.testing.assert_allclose(part.point[2], [0.02, 0.02, -0.003])
    np.testing.assert_allclose(part.normal[2], [0, -0.6, 0.8])
    np.testing.assert_allclose(part.deviation, 1e-3 * (0.01 * np.arange(8) - 0.02), atol=1e-12)
    np.testing.assert_allclose(part.sigma, 1e-5)
    assert (part.freedoms, part.cut_with, part.base) == (FREEDOMS, "", None)


def test_the_sign_turns_the_deviations(tmp_path):
    left = read_measured_part(write(tmp_path)).deviation
    missing = read_measured_part(write(tmp_path, {"positive": "material_missing"})).deviation
    np.testing.assert_array_equal(missing, -left)


def test_units_may_stand_in_the_header_and_are_checked(tmp_path):
    part = read_measured_part(write(tmp_path, columns="X [mm],Y [mm],Z [mm],NX,NY,NZ,DEV (mm)"))
    assert len(part) == 8
    assert "unit" in refused(write(tmp_path, columns="X,Y,Z,NX,NY,NZ,DEV [um]")).message


def test_decimal_commas_and_points_in_one_file_are_refused(tmp_path):
    """A file with commas throughout is read as the one with points."""
    head, columns = {"sigma_mm": "0,01"}, COLUMNS.replace(",", ";")
    rows = [row.replace(",", ";").replace(".", ",") for row in ROWS]
    part = read_measured_part(write(tmp_path, head, columns, rows))
    np.testing.assert_array_equal(part.deviation, read_measured_part(write(tmp_path)).deviation)
    rows[3] = rows[3].replace("30;", "1.030;", 1)
    finding = refused(write(tmp_path, head, columns, rows))
    assert "'1.030' has a point" in finding.message
    assert finding.line == len(HEAD) + 5


@pytest.mark.parametrize("place", ["20,5 20.0 -3", "20,0;20.0;-3"])
def test_a_checked_place_with_commas_and_points_is_refused(tmp_path, place):
    finding = refused(write(tmp_path, {"checked": f"{place} material_missing"}))
    assert "checked" in finding.message
    assert "is not understood" in finding.message


@pytest.mark.parametrize("key", sorted(HEAD))
def test_every_mandatory_comment_is_asked_for(tmp_path, key):
    assert key in refused(write(tmp_path, {key: None})).message


@pytest.mark.parametrize(
    ("head", "word"),
    [
        ({"positive": "up"}, "positive"),
        ({"alignment": "best"}, "alignment"),
        ({"alignment": "partial"}, "alignment"),
        ({"alignment": "partial x q"}, "alignment"),
        ({"alignment": "free x"}, "alignment"),
        ({"sha256": "12"}, "sha256"),
        ({"sigma_mm": "0"}, "sigma_mm"),
        ({"sigma_mm": "small"}, "sigma_mm"),
        ({"probe_radius": "1.5"}, "probe_radius"),
        ({"spring_pass": "maybe"}, "spring_pass"),
        ({"base": "first"}, "base"),
        ({"positve": "material_left"}, "positve"),
    ],
)
def test_a_comment_that_is_not_understood_is_refused_with_its_line(tmp_path, head, word):
    finding = refused(write(tmp_path, head))
    assert word in finding.message
    assert 1 <= finding.line <= len(HEAD) + 1


@pytest.mark.parametrize(
    ("columns", "rows", "word"),
    [
        ("X,Y,Z,NX,NY,DEV,NZZ", None, "nzz"),
        ("X,Y,Z,NX,NY,NZ,MEASURED", None, "'DEV' is missing, and 'measured' is unknown"),
        (COLUMNS + ",ID", [f"{row},7" for row in ROWS], "'id' is unknown"),
        (COLUMNS, ["mm,mm,mm,,,,mm", *ROWS], "not a number"),
        (COLUMNS, [*ROWS, "8 points"], "1 cells"),
        (COLUMNS + ",MX", [f"{row},7" for row in ROWS], "'MY' is missing"),
        (COLUMNS, [*ROWS[:7], "1,2,3,0,0,2,0.1"], "normal has the length 2"),
        (COLUMNS, [*ROWS[:7], "1,2,3,0,0,1,9"], "9 mm is more than"),
        (COLUMNS, [*ROWS[:7], "90000,2,3,0,0,1,0.1"], "away"),
        (COLUMNS, [*ROWS[:7], "1,2,3,0,0,1,x"], "not a number"),
        (COLUMNS, [*ROWS, ROWS[3]], "occurs twice"),
        (COLUMNS, ROWS[:4], "4 of 4 rows"),
        (COLUMNS, [f"0.0{i},0.01,0.0{i},0,0,1,0.00{i}" for i in range(8)], "within"),
        (COLUMNS, [f"{i},{i * i},0,0,0,1,0.000{i}" for i in range(8)], "no deviation exceeds"),
        (COLUMNS, [f"{i},{i * i},0,0,0,1,0" for i in range(8)], "zero"),
        (COLUMNS + ",SIGMA", [f"{row},-1" for row in ROWS], "-1 mm"),
        (COLUMNS + ",LINE", [f"{row},2.5" for row in ROWS], "LINE"),
    ],
)
def test_rows_that_cannot_be_are_refused(tmp_path, columns, rows, word):
    finding = refused(write(tmp_path, None, columns, rows))
    assert word.lower() in finding.message.lower()
    assert finding.help


def test_points_without_a_deviation_are_reported_and_excluded(tmp_path):
    part = read_measured_part(write(tmp_path, rows=[*ROWS, "1,2,3,0,0,1,"]))
    assert len(part) == 8
    (finding,) = part.findings
    assert (finding.code, finding.line) == ("LRN005", len(HEAD) + 1 + 9)


def placed(sign: float = 1.0, off: float = 0.0, shift: float = 0.0) -> list[str]:
    """Rows with the measured places of their deviations times ``sign``, ``off`` mm farther out; the part is shifted by
    ``shift`` mm."""
    rows = []
    for i in range(30):
        point = np.array([10.0 * i, 5.0 * i * i, -3.0 * (i % 3)])
        normal = [np.array([0, 0.6, 0.8]), np.array([0, -0.6, 0.8]), np.array([0.8, 0, 0.6])][i % 3]
        size = 0.05 * np.sin(2.0 * i) + 0.01
        place = point + (sign * size + off) * normal + [shift, 0, -shift]
        rows.append(",".join(f"{one:.4f}" for one in (*point, *normal, size, *place)))
    return rows


PLACED = COLUMNS + ",MX,MY,MZ"


def test_measured_places_show_the_sign(tmp_path):
    assert read_measured_part(write(tmp_path, None, PLACED, placed())).sign_seen
    assert read_measured_part(write(tmp_path, None, PLACED, placed(shift=0.3))).sign_seen
    missing = {"positive": "material_missing"}
    assert read_measured_part(write(tmp_path, missing, PLACED, placed(-1.0))).sign_seen
    assert not read_measured_part(write(tmp_path)).sign_seen


@pytest.mark.parametrize(
    ("head", "rows", "word"),
    [
        ({}, placed(-1.0), "the other side"),
        ({"positive": "material_missing"}, placed(), "the other side"),
        ({}, placed(0.0), "by DEV"),
        ({"alignment": "datum"}, placed(shift=0.3), "by DEV"),
        ({"alignment": "datum"}, placed(off=1.0), "by DEV"),
    ],
)
def test_measured_places_that_contradict_the_deviations_are_refused(tmp_path, head, rows, word):
    assert word in refused(write(tmp_path, head, PLACED, rows)).message
