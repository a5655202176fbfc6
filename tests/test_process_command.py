"""Forces of a process and of logs through the command: what is told, and that mistakes write nothing."""

import re
from pathlib import Path

import numpy as np
import pytest
from conftest import CELL, LINES
from test_milling import MM, cut_of

from postproc.process.milling_forces import mean_force

BRACKET = Path(__file__).parents[1] / "samples" / "kr270_milling" / "bracket.src"

PROCESS = """\
operations:
  - name: POCKET
    diameter: 16
    teeth: 3
    helix: 30
    axial_depth: 5
    radial_width: 8
    direction: down
    spindle: 12000
    material: EN AW-7075-T6
    rapid: 0.04
"""


@pytest.fixture
def milling(job):
    """The small program without its own forces, with an operation's name, and the process beside it."""
    lines = [line for line in LINES if "FORCE" not in line]
    lines.insert(6, ";1 POCKET")
    lines.insert(6, "$VEL.CP=0.03")
    job.write(lines)
    (job.folder / "milling.yaml").write_text(PROCESS)
    return job


def test_the_sample_has_three_operations_with_an_interval_each(compensate):
    done = compensate("predict", BRACKET, "--force", "--json", "-")
    report = done.json
    assert report["force"]["source"] == "cell: milling.yaml"
    told = [f["message"] for f in report["findings"] if f["code"] == "FRC015"]
    assert [re.match(r"operation '(.*?)': (\d+) motions", message).groups() for message in told] == [
        ("SLOT", "3"),
        ("OUTSIDE CONTOUR ROUGHING", "3"),
        ("OUTSIDE CONTOUR FINISHING", "3"),
    ]
    assert "+- 47 %" in told[0]
    assert "own coefficients, +- 15 %" in told[2]
    # nothing rapid, no plunge and no retract is milling
    assert report["cutting"] == 9
    assert report["cuts"] == 3
    assert report["uncertainty"]["budget"][0]["parameter"] == "force"
    assert "force" not in report["uncertainty"]["without_interval"]
    assert report["error_before_mm"]["ci95"] > 0.3 * report["error_before_mm"]["max"]


def test_a_process_as_the_value_of_the_option(compensate, milling):
    done = compensate("predict", milling.program, "--force", milling.folder / "milling.yaml", "--json", "-")
    report = done.json
    assert report["force"]["source"] == "milling.yaml"
    mean = mean_force(cut_of(), np.array([0.05 * MM]))[0]  # 0.03 m/s, 600 teeth a second
    assert report["force"]["max_n"] == pytest.approx(np.linalg.norm(mean), abs=1e-3)
    assert report["force"]["peak_n"] > 1.3 * report["force"]["max_n"]
    assert "FRC015" in [f["code"] for f in report["findings"]]


LITERAL = "$TOOL={FRAME: X 120.0,Y 0.0,Z 250.0,A 0.0,B 30.0,C 0.0}"


@pytest.mark.parametrize(
    ("edit", "joined"),
    [
        (lambda cell: cell, True),
        (lambda cell: cell.replace("  1: {x: 120", "  4: {x: 120"), False),
        (
            lambda cell: cell.replace(
                "bases:", "  3: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}\nbases:"
            ),
            False,
        ),
    ],
    ids=["same pose", "another number", "two of that pose"],
)
def test_a_literal_tool_is_the_cells_tool_of_its_pose(compensate, milling, edit, joined):
    """Its cutting process belongs to it, where it is the only one of that pose."""
    milling.program.write_text(milling.program.read_text().replace("$TOOL=TOOL_DATA[1]", LITERAL))
    (milling.folder / "milling.yaml").write_text(PROCESS.replace("name: POCKET", "tool: 1"))
    milling.cell(edit(CELL))
    done = compensate("predict", milling.program, "--force", milling.folder / "milling.yaml", "--json", "-")
    if joined:
        assert done.json["cutting"] == 6
    else:
        assert done.code == 1
        assert "FRC011" in done.err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("radial_width: 8", "radial_width: 17", "17 mm is wider than the cutter"),
        ("teeth: 3", "teeth: 0", "0 is not a whole number from 1"),
        ("    spindle: 12000\n", "", "'spindle' is missing"),
        ("EN AW-7075-T6", "unobtainium", "known: EN AW-7075-T6"),
    ],
)
def test_a_wrong_process_writes_nothing(compensate, milling, old, new, words):
    (milling.folder / "milling.yaml").write_text(PROCESS.replace(old, new))
    milling.cell(CELL + "process: milling.yaml\n")
    done = compensate(milling.program, "--force")
    assert done.code == 1
    assert re.search(r"milling\.yaml:\d+:\d+ YML00\d ", done.err)
    assert words in done.err
    assert milling.nothing_written()


def log_of(job, end, step=1.0, column="s_mm", force=300.0, offset=0.0):
    place = np.arange(0, end + step / 2, step)
    rows = [f"{s:g},{offset:g},{force + offset:g},{offset:g},base" for s in place]
    path = job.folder / "gauge.csv"
    path.write_text("\n".join([f"{column},fx,fy,fz,frame", *rows]) + "\n")
    return path


# from the first known point on: 50 mm down, the cut of 100, 100, 150, 150 mm, up, across, down, 50 mm, up
LENGTH = 50 + np.hypot(100, 2) + 100 + 150 + 150 + 52 + np.hypot(200, 0) + 50 + 50 + 80


def test_a_log_over_the_path_length(compensate, milling):
    done = compensate("predict", milling.program, "--force", log_of(milling, 1200), "--json", "-")
    report = done.json
    assert report["force"] == {"source": "gauge.csv", "max_n": 300.0, "peak_n": 300.0}
    assert "FRC029" in [f["code"] for f in report["findings"]]


@pytest.mark.parametrize(
    ("edit", "code", "words"),
    [
        (lambda text: "\n".join(text.splitlines()[:400]) + "\n", "FRC019", "it ends at s = 398 mm"),
        (lambda text: text.replace("\n5,0,300", "\n5,nan,300"), "FRC003", "'nan' is not a number"),
        (lambda text: text.replace("0,base\n9,", "0,bsae\n9,"), "FRC003", "'bsae' is not a frame"),
        (lambda text: text.replace("\n7,", "\n70,"), "FRC003", "must not decrease"),
    ],
)
def test_a_wrong_log_writes_nothing(compensate, milling, edit, code, words):
    path = log_of(milling, 1200)
    text = path.read_text()
    assert edit(text) != text
    path.write_text(edit(text))
    done = compensate(milling.program, "--force", path)
    assert done.code == 1
    assert re.search(rf"gauge\.csv:\d+ {code} ", done.err)
    assert words in done.err
    assert milling.nothing_written()


def test_the_offset_option_needs_air_and_a_log(compensate, milling):
    done = compensate("predict", milling.program, "--force", log_of(milling, 1200), "--tare")
    assert done.code == 1
    assert "FRC020 no reading of this log is in air" in done.err
    done = compensate("predict", milling.program, "--tare")
    assert done.code == 1
    assert "there is no --force" in done.err
    lines = [line for line in LINES if not line.startswith(";FORCE ")]
    lines.insert(7, ";FORCE OFF")
    milling.write(lines)
    done = compensate(
        "predict",
        milling.program,
        "--force",
        log_of(milling, 1200, offset=5.0),
        "--tare",
        "--json",
        "-",
    )
    assert "FRC022" in [f["code"] for f in done.json["findings"]]
