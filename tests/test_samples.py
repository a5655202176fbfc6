"""The samples: corrected, on the path, made again byte for byte."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import without_inserted

SAMPLES = Path(__file__).resolve().parent.parent / "samples"


@pytest.fixture
def sample(tmp_path):
    def copy(name: str) -> Path:
        target = tmp_path / name
        shutil.copytree(SAMPLES / name, target, ignore=shutil.ignore_patterns("compensated"))
        return target

    return copy


NUMBER = re.compile(rb"-?\d+\.\d+")


def test_panel(compensate, sample):
    program = sample("kr270_panel") / "panel.src"
    done = compensate(program, "--force", "--json", "-")
    report = done.json
    assert done.code == 0, done.err
    assert report["motions"] >= 2000
    assert report["uncorrected"] == 0
    assert 0.3 <= report["error_before_mm"]["max"] <= 4
    assert report["error_after_mm"]["max"] <= 0.002
    before = program.read_bytes().split(b"\r\n")
    after = (program.parent / "compensated" / "panel.src").read_bytes().split(b"\r\n")
    marker = [line for line in after if line.startswith(b";COMPENSATED ")]
    assert len(marker) == 1
    assert (
        after.index(marker[0]) == before.index(next(line for line in before if line.startswith(b"DEF "))) + 1
    )
    assert report["inserted"] <= 0.3 * report["motions"]
    after = without_inserted(after, report)
    assert len(before) == len(after)
    for old, new in zip(before, after, strict=True):
        if old != new and b"{X " in old:
            assert NUMBER.sub(b"#", old) == NUMBER.sub(b"#", new)
        elif old != new:  # a partial point, completed
            assert old.startswith(b"LIN {Z ")


@pytest.mark.slow
def test_taught(compensate, sample):
    folder = sample("kr270_taught")
    done = compensate(folder / "taught.src", "--force", "--json", "-")
    # its corners, approximated from 2 mm on, follow those of the original
    assert [f["code"] for f in done.json["findings"] if f["severity"] != "info"] == []
    assert done.code == 0, done.err
    assert (done.json["corrected"], done.json["lead_ins"], done.json["stops_added"]) == (18, 2, 0)
    assert done.json["backwards"] == 0
    assert done.json["path_error_mm"]["max"] <= 0.02
    before = (folder / "taught.src").read_bytes().splitlines()
    after = (folder / "compensated" / "taught.src").read_bytes().splitlines()
    # what is inserted stands between the lines of the original
    new = iter(after)
    assert all(line in new for line in before)
    assert len(after) == len(before) + 1 + done.json["inserted"]
    data = [(folder / where / "taught.dat").read_bytes() for where in (".", "compensated")]
    changed = [(old, new) for old, new in zip(*(d.splitlines() for d in data), strict=True) if old != new]
    assert len(changed) == 18 + done.json["lead_ins"]
    for old, new in changed:
        assert old.startswith(b"DECL E6POS XP")
        assert old[old.index(b",S ") :] == new[new.index(b",S ") :]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "growth"),
    [("kr270_panel/panel.src", 1.006), ("kr270_taught/taught.src", 2.8), ("kr270_pocket/pocket.ngc", 2.0)],
)
def test_the_tool_is_on_the_path(compensate, sample, name, growth):
    """All along it; where the controller rounds corners off, as far from it as was reported."""
    folder, file = name.split("/")
    program = sample(folder) / file
    report = compensate(program, "--force", "--json", "-").json
    done = compensate("verify", program, program.parent / "compensated" / file, "--force", "--json", "-")
    rounded = [f["message"] for f in report["findings"] if f["code"] == "COR017"]
    assert done.code == (3 if rounded else 0), done.out
    assert 0.3 <= done.json["original"]["max"] <= 4
    told = float(re.search(r"differs by ([0-9.]+) mm", rounded[0])[1]) if rounded else 0.02
    assert done.json["compensated"]["max"] <= 1.02 * told
    assert done.json["compensated"]["cut_ends"]["max"] <= 0.05
    assert done.json["compensated"]["converged"]
    assert done.json["compensated"]["backwards"] == 0
    assert done.json["growth"] <= growth


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "script", "files"),
    [
        ("kr270_panel", "make_panel.py", ["panel.src"]),
        ("kr270_taught", "make_taught.py", ["taught.src", "taught.dat"]),
    ],
)
def test_a_sample_can_be_made_again(sample, name, script, files):
    folder = sample(name)
    before = [(folder / file).read_bytes() for file in files]
    for file in files:
        (folder / file).unlink()
    subprocess.run([sys.executable, script], cwd=folder, check=True, capture_output=True)
    assert [(folder / file).read_bytes() for file in files] == before
