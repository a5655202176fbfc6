"""CSV files that we write: no cell of them is a formula to a spreadsheet, whatever input was called."""

from __future__ import annotations

import csv
import io
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.base.tables import as_cell, read_table
from postproc.measurements import read_measurements
from postproc.measurements.write_csv import measurements_csv
from postproc.report.residuals import residuals_csv

NUMBER = re.compile(r"[-+]?[0-9]*\.?[0-9]+([eE][-+]?[0-9]+)?")
JOINTS = tuple((f"A{k}", False) for k in range(1, 7))
EVIL = ["=cmd|' /C calc'!A0", '=HYPERLINK("http://x")', "+1+1", "-2+3+cmd", "@SUM(1)", "'=1+1"]


def formulas(raw: bytes) -> list[str]:
    """Cells that a spreadsheet computes, whatever it takes for the separator."""
    text = raw.decode("utf-8", "surrogateescape")
    return [
        cell
        for separator in ",;\t"
        for row in csv.reader(io.StringIO(text), delimiter=separator)
        for cell in row
        if cell.strip()[:1] in tuple("=+-@")
        and cell.strip()
        and not NUMBER.fullmatch(cell.strip().split(",")[0])
    ]


def test_formulas_are_seen():
    assert formulas(b"a,b\n1,=x\n") == ["=x"]
    assert formulas(b"a;b\n1; @x\n") == [" @x"]
    assert formulas(b"a,b\n-1.5,'=x\n") == []


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["=cmd.src", "+x.src", "-x.src", "@x.src"])
def test_corrections_of_a_program_full_of_formulas(compensate, job, name):
    program = job.folder / name
    lines = (
        job.program.read_bytes()
        .replace(b"; slot", b"; =cmd|' /C calc'!A0,=1+1")
        .replace(b"DEF part", b"DEF x")
    )
    program.write_bytes(lines.replace(b"BAS(#INITMOV,0)", b"=1+1\r\n@SUM(1)\r\n;FOLD =1,+1,-1,@1"))
    done = compensate("program", "--force", "--report", job.folder / "out", "--", program)
    assert done.code in (0, 3), done.err
    table = (job.folder / "out" / f"{program.stem}.corrections.csv").read_bytes()
    assert formulas(table) == []
    done = compensate("predict", "--force", "--report", job.folder / "out", "--", program)
    assert formulas((job.folder / "out" / f"{program.stem}.deflection.csv").read_bytes()) == []


@given(st.text(st.characters(codec="utf-8", exclude_characters="\r\n\0"), min_size=1, max_size=12))
def test_a_cell_is_no_formula_and_comes_back(tmp_path_factory, text):
    text = text.strip()
    cell = as_cell(text)
    assert NUMBER.fullmatch(cell) or cell[:1] not in tuple("=+-@")
    path = tmp_path_factory.getbasetemp() / "t.csv"
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([["a", "b"], ["1", cell]])
    path.write_bytes(stream.getvalue().encode())
    assert read_table(path, "FRC003").texts("b") == [text]


def readings_of(folder, name: str, session: str):
    stream = io.StringIO()
    stream.write(f"# robot: kuka_kr270\n# target {name}: 1 2 3\n")
    columns = [f"A{k}" for k in range(1, 7)]
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([*columns, "FZ", "TARGET", "SESSION", "DX", "DY", "DZ"])
    for k in range(4):
        writer.writerow([k, -90, 90 + k, 0, 45, 0, -100, as_cell(name), as_cell(session), 0.1, -0.2, k])
    path = folder / "loads.csv"
    path.write_text(stream.getvalue())
    return read_measurements(path, JOINTS)


@pytest.mark.parametrize("name", EVIL)
def test_readings_of_targets_and_sessions_called_like_formulas(tmp_path, name):
    readings = readings_of(tmp_path, name, name)
    assert readings.targets == (name,)
    raw = measurements_csv(readings, about=["made of a,=1+1 and b;@SUM(1)"])
    assert formulas(raw) == []
    (tmp_path / "again.csv").write_bytes(raw)
    again = read_measurements(tmp_path / "again.csv", JOINTS)
    assert (again.targets, again.sessions) == (readings.targets, readings.sessions)
    assert dict(again.places).keys() == dict(readings.places).keys()


@pytest.mark.parametrize("name", EVIL)
def test_residuals_of_targets_and_sessions_called_like_formulas(tmp_path, name):
    readings = readings_of(tmp_path, name, name)

    class Campaign:
        pass

    campaign = Campaign()
    campaign.readings, campaign.targets = readings, readings.targets
    campaign.pose = np.arange(len(readings))
    raw = residuals_csv(campaign, {"before": np.full((len(readings), 3), -1e-3)}, {})
    assert formulas(raw) == []
    assert b"-1.000000" in raw
