"""Units in the header of a CSV: the one of the format is no part of the name, another one is refused."""

import json
from pathlib import Path

import pytest

from postproc.base.findings import Refusal
from postproc.base.tables import read_table
from postproc.base.tables.header_units import split_unit, without_units

HEADS = {
    "fx [N]": ("fx", "N"),
    "fx (n)": ("fx", "n"),
    "fx[kN]": ("fx", "kN"),
    "mx [N  m]": ("mx", "N m"),
    "fx": ("fx", ""),
    "fx]": ("fx]", ""),
    "a (b) (mm)": ("a (b)", "mm"),
    "": ("", ""),
}


@pytest.mark.parametrize("head", HEADS)
def test_a_name_and_its_unit(head):
    assert split_unit(head) == HEADS[head]


@pytest.mark.parametrize(
    ("header", "found"),
    [
        ("Line,FX [N],Other [x]", ["line", "fx", "other [x]"]),
        ("line (),fx (N),other", ["line", "fx", "other"]),
        ("line,fx [kN]", "the unit of column 'fx [kn]' is wrong: newtons are expected"),
        ("line [mm],fx", "the unit of column 'line [mm]' is wrong: this column has no unit"),
        ("line,fx,fx [N]", "column 'fx' occurs twice"),
    ],
)
def test_units_of_a_table(tmp_path, header, found):
    path = tmp_path / "table.csv"
    path.write_text(header + "\n" + ",".join("1" for _ in header.split(",")) + "\n")
    table = read_table(path, "FRC003")
    if isinstance(found, list):
        assert list(without_units(table, {"line": "", "fx": "N"}).columns) == found
    else:
        with pytest.raises(Refusal, match=r"table\.csv") as caught:
            without_units(table, {"line": "", "fx": "N"})
        assert caught.value.findings[0].message == found


@pytest.mark.parametrize("unit", [" [N]", "(N)", " [kN]"])
def test_a_table_of_forces_may_state_newtons(job, compensate, unit):
    rows = "\n".join(f"{line},-60,0,-120" for line in (8, 10))
    done = []
    for name, heads in (("plain.csv", "line,fx,fy,fz"), ("units.csv", f"line,fx{unit},fy{unit},fz{unit}")):
        (job.folder / name).write_text(f"{heads}\n{rows}\n")
        done.append(compensate("predict", job.program, "--force", job.folder / name, "--json", "-"))
    if "k" in unit:
        assert done[1].code == 1
        assert "newtons are expected" in done[1].json["findings"][0]["message"]
    else:
        assert done[0].code in (0, 3), done[0].out
        assert done[0].json["error_before_mm"]["max"] > 0.001
        assert done[0].json["error_before_mm"] == done[1].json["error_before_mm"]


def test_a_dry_run_writes_the_result_that_is_asked_for_by_name(job, compensate, tmp_path):
    result = tmp_path / "result.json"
    done = compensate(job.program, "--force", "--dry-run", "--json", result)
    assert f"nothing is written but {result}" in done.out
    assert job.nothing_written()
    stated = json.loads(result.read_text())
    assert stated["outputs"] == [str(result)]
    whole = compensate(job.program, "--force", "--json", "-").json
    assert stated["error_after_mm"] == whole["error_after_mm"]
    batch = tmp_path / "batch.json"
    assert compensate(
        "batch", job.folder / "part.src", "--force", "--dry-run", "--json", batch, "-o", tmp_path / "out"
    ).code in (0, 3)
    assert json.loads(batch.read_text())["outputs"] == [str(batch)]
    assert not Path(tmp_path / "out").exists()
