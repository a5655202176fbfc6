"""A copy of a row is no reading: in one file, of another file, and in what validates a fit."""

import numpy as np
import pytest

from postproc.base.findings import Refusal
from postproc.measurements import joined, not_fitted, read_measurements

SIX = tuple((f"A{i}", False) for i in range(1, 7))
"""Six joints that turn."""


@pytest.fixture
def readings(tmp_path):
    """Reads a file of ``rows`` (lines) that states a scatter and ``comments``."""

    def read(rows, name="loads.csv", sigma="0.03", comments=("# robot: one",), columns=""):
        path = tmp_path / name
        head = [*comments, f"# sigma_mm: {sigma}", f"A1,A2,A3,A4,A5,A6,FZ,DX,DY,DZ{columns}"]
        path.write_text("\n".join([*head, *rows]) + "\n")
        return read_measurements(path, SIX)

    return read


def campaign(states=5, repeats=3, decimals=4, scatter=0.03, seed=3):
    """Lines of repeated states under weights, whose three values scatter [mm] and are written with ``decimals``."""
    random = np.random.default_rng(seed)
    lines = []
    for _ in range(states):
        q = ",".join(f"{angle:.3f}" for angle in random.uniform(-80, 80, 6))
        mean = random.normal(0, 1, 3)
        for _ in range(repeats):
            value = ",".join(f"{one:.{decimals}f}" for one in mean + random.normal(0, scatter, 3))
            lines.append(f"{q},-1500,{value}")
    return lines


def test_pasted_rows_count_once(readings):
    rows = campaign()
    whole = joined([readings([*rows, *rows[:3], *rows[:3]])])
    assert len(whole) == len(rows)
    (finding,) = [one for one in whole.findings if one.code == "MEA012"]
    assert "6 readings are copies digit by digit, the first one of line 4" in finding.message
    assert finding.line == 4 + len(rows)


@pytest.mark.parametrize("changes", ["time", "session", "value", "weight"])
def test_a_row_that_differs_in_one_thing_is_a_reading(readings, changes):
    rows = campaign(states=1, repeats=1) * 8
    columns = {"time": ",T", "session": ",SESSION"}.get(changes, "")
    if columns:
        rows = [f"{row},{number}" for number, row in enumerate(rows)]
    elif changes == "value":
        rows = [f"{row[:-1]}{number}" for number, row in enumerate(rows)]
    else:
        rows = [row.replace("-1500", f"-15{number}0") for number, row in enumerate(rows)]
    whole = joined([readings(rows, columns=columns)])
    assert len(whole) == 8
    assert not any(one.code == "MEA012" for one in whole.findings)


@pytest.mark.parametrize(("decimals", "scatter"), [(1, 0.03), (2, 0.003), (2, 0.01), (1, 0.1), (3, 0.03)])
def test_repeats_that_rounding_makes_equal_are_readings(readings, decimals, scatter):
    rows = campaign(states=12, repeats=10, decimals=decimals, scatter=scatter)
    whole = joined([readings(rows, sigma=str(scatter))])
    assert len(whole) == len(rows)


def test_what_is_fitted_validates_nothing(readings):
    fitted = readings(campaign())
    for rows in (campaign(), [*campaign()[2:]]):
        with pytest.raises(Refusal, match=r"MEA008 .*fitted.*nothing"):
            not_fitted(readings(rows, name="again.csv"), fitted)
    other = readings([*campaign(seed=4), *campaign()[:4]], name="partly.csv")
    assert len(not_fitted(other, fitted)) == len(campaign())
    (finding,) = not_fitted(other, fitted).findings
    assert finding.code == "MEA012"
    assert "loads.csv (line 4)" in finding.message
    assert not not_fitted(readings(campaign(seed=5), name="new.csv"), fitted).findings


def test_another_robot_validates_nothing(readings):
    other = readings(campaign(seed=4), name="other.csv", comments=("# robot: two",))
    with pytest.raises(Refusal, match=r"other.csv: MEA008 the readings are of the robot 'two', .* of 'one'"):
        not_fitted(other, readings(campaign()))
    unstated = readings(campaign(seed=4), name="unstated.csv", comments=())
    assert len(not_fitted(unstated, readings(campaign()))) == len(campaign())
