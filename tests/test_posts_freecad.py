"""The post-processor file in a real FreeCAD without a screen: box with a pocket, posted, compensated."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import CELL

from postproc.posts import post_file

FREECAD = next((path for name in ("freecadcmd", "FreeCADCmd") if (path := shutil.which(name))), None)
COMMAND = Path(sys.executable).with_name("compensate")
KNOWN = f"--compensate '{COMMAND}' --material 'EN AW-7075-T6' --helix 30"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(FREECAD is None, reason="no FreeCAD on this machine: apt-get install freecad-python3"),
]

CASES = {
    "pocket": {"arguments": KNOWN},
    "rounded": {"arguments": f"{KNOWN} --precision 2 --gain 0.5"},
    "inch": {"arguments": f"{KNOWN} --inches"},
    "short": {"arguments": f"{KNOWN} --inch"},
    "stated": {"arguments": f"{KNOWN} --force=0,100,200@base", "pattern": "ZigZag"},
    "zigzag": {"arguments": KNOWN, "pattern": "ZigZag"},
    "no_material": {"arguments": f"--compensate '{COMMAND}' --helix 30"},
    "no_speed": {"arguments": KNOWN, "speed": 0.0},
    "no_command": {"arguments": f"{KNOWN} --compensate /nowhere/compensate"},
    "no_robot": {"arguments": f"{KNOWN} --robot no_such_robot"},
    "misspelt": {"arguments": f"{KNOWN} --metarial steel"},
}


@pytest.fixture(scope="module")
def posted(tmp_path_factory):
    """All cases in one FreeCAD: name -> its folder and what FreeCAD had of it.  Each output exists before."""
    folder = tmp_path_factory.mktemp("freecad")
    macros = folder / "home" / ".local" / "share" / "FreeCAD" / "Macro"
    macros.mkdir(parents=True)
    shutil.copy(post_file("freecad"), macros)
    cases = []
    for name, case in CASES.items():
        (folder / name).mkdir()
        (folder / name / "cell.yaml").write_text(CELL + "orientation: {a: 0, b: 0, c: 180}\nmax_growth: 4\n")
        (folder / name / f"{name}.ngc").write_text("(of the day before)\n")
        cases.append({"file": str(folder / name / f"{name}.ngc"), **case})
    environment = os.environ | {
        "HOME": str(folder / "home"),
        "LC_ALL": "C.UTF-8",
        "QT_QPA_PLATFORM": "offscreen",
        "CASES": json.dumps(cases),
        "RESULT": str(folder / "result.json"),
    }
    job = Path(__file__).with_name("freecad_jobs.py")
    words = [str(FREECAD), str(job)]
    quiet = {"stdin": subprocess.DEVNULL, "capture_output": True, "check": False}
    done = subprocess.run(words, env=environment, timeout=300, **quiet)
    assert (folder / "result.json").exists(), done.stdout[-2000:] + done.stderr[-2000:]
    came = json.loads((folder / "result.json").read_text())
    return {name: (folder / name, result) for name, result in zip(CASES, came, strict=True)}


def processes(folder, name):
    """Rows of the process file, which is JSON in every row."""
    text = (folder / "uncompensated" / f"{name}.process.yaml").read_text()
    return [json.loads(row) for row in re.findall(r"^  - (\{.*\})  # Pocket$", text, re.M)]


def test_a_pocket_is_posted_and_compensated_in_one_run(posted):
    folder, came = posted["pocket"]
    output = folder / "pocket.ngc"
    assert came == {"failed": False, "text": output.read_text(), "file": str(output)}
    report = json.loads((folder / "uncompensated" / "pocket.report.json").read_text())
    assert report["cutting"] > 100
    assert report["uncorrected"] == 0
    assert report["error_before_mm"]["max"] > 0.5
    assert report["error_after_mm"]["max"] < 0.001
    assert output.read_text() != (folder / "uncompensated" / "pocket.ngc").read_text()


def test_the_process_is_that_of_the_job(posted):
    """The blank is 1 mm higher than the part: from 21 to 12 mm in levels of 2.5 mm, the last one is 1.5 mm."""
    folder, _ = posted["pocket"]
    rows = processes(folder, "pocket")
    assert [row["axial_depth"] for row in rows] == [2.5, 2.5, 2.5, 1.5]
    for row in rows:
        assert (row["diameter"], row["radial_width"], row["teeth"]) == (5.0, 2.0, 3)
        assert (row["spindle"], row["helix"], row["direction"]) == (12000.0, 30.0, "down")
    # every cut at a height is in the lines of its depth, and nothing else
    lines = (folder / "uncompensated" / "pocket.ngc").read_text().split("\n")
    heights = [18.5, 16.0, 13.5, 12.0]
    for row, height in zip(rows, heights, strict=True):
        first, last = row["lines"]
        inside = [line for line in lines[first - 1 : last] if re.match(r"G[123] ", line)]
        assert len(inside) > 20
        assert sum(f"Z{height:.3f}" in line for line in inside) > 20
        before = [line for line in lines[: first - 1] if f"Z{height:.3f}" in line]
        assert len(before) <= 1  # the plunge


def test_arguments_are_passed_on(posted):
    folder, _ = posted["rounded"]
    assert re.search(r"X\d+\.\d\d ", (folder / "uncompensated" / "rounded.ngc").read_text())
    report = json.loads((folder / "uncompensated" / "rounded.report.json").read_text())
    assert report["gain"] == 0.5


@pytest.mark.parametrize("name", ["inch", "short"])
def test_inches_are_inches(posted, name):
    """Also where the argument is abbreviated, as ``linuxcnc_post`` understands it."""
    folder, _ = posted[name]
    assert "G20" in (folder / "uncompensated" / f"{name}.ngc").read_text()
    depths = [row["axial_depth"] for row in processes(folder, name)]
    assert depths == pytest.approx([2.5, 2.5, 2.5, 1.5], abs=0.01)


def test_a_stated_force_needs_nothing_of_the_operations(posted):
    folder, came = posted["stated"]
    assert came["file"] == str(folder / "stated.ngc")
    report = json.loads((folder / "uncompensated" / "stated.report.json").read_text())
    assert report["force"]["max_n"] == pytest.approx(223.607, abs=1e-3)
    assert not list((folder / "uncompensated").glob("*.yaml"))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("zigzag", ["Pocket cuts back and forth (ZigZag)", '--cut "Pocket=down,2"', "--force"]),
        ("no_material", ["the force of Pocket is not known without: --material"]),
        ("no_speed", ["spindle speed of its tool controller"]),
        ("no_command", ["'/nowhere/compensate' does not start", "--compensate"]),
        ("no_robot", ["exit code of the command is 1", "no_such_robot"]),
        ("misspelt", ["linuxcnc_post does not take", "--metarial"]),
    ],
)
def test_a_failure_leaves_no_program(posted, name, words):
    folder, came = posted[name]
    assert not (folder / f"{name}.ngc").exists()
    for word in words:
        assert word in came["error"]
