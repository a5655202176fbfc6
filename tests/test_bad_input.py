"""Wrong input: a clear error with its place, the right exit code, nothing written."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from conftest import CELL, LINES

from postproc.robot.description import find_robot

ROBOT = find_robot("kuka_kr270").read_text()


def refused(done, job, code: str, *words: str) -> None:
    assert done.code == 1, done.out + done.err
    assert code in done.err
    for word in words:
        assert word in done.err, f"{word!r} is not in:\n{done.err}"
    assert "nothing is written" in done.err
    assert job.nothing_written()


def test_no_program(compensate, job):
    refused(compensate(job.folder / "none.src", "--force"), job, "FIL001", "No such file")


def test_a_folder_as_program(compensate, job):
    refused(compensate(job.folder, "--force"), job, "FIL001")


def test_no_cell(compensate, job, tmp_path):
    (job.folder / "cell.yaml").unlink()
    refused(compensate(job.program, "--force"), job, "CEL001", "cell.yaml", "--cell")


def test_cell_that_is_not_there(compensate, job):
    refused(compensate(job.program, "--force", "--cell", job.folder / "x.yaml"), job, "FIL001", "x.yaml")


def test_unknown_robot_offers_the_nearest(compensate, job):
    job.cell(CELL.replace("kuka_kr270", "kuka_kr27"))
    refused(compensate(job.program, "--force"), job, "CEL003", "did you mean 'kuka_kr270'")
    job.cell(CELL)
    refused(compensate(job.program, "--force", "--robot", "kuka_270"), job, "CEL003", "kuka_kr270")


@pytest.mark.parametrize(
    ("old", "new", "code", "words"),
    [
        ("unit: N/m", "unit: N m", "YML005", ("'N m' is not a unit", "N/mm")),
        ("unit: mm, ci: 27.0", "unit: kg, ci: 27.0", "YML005", ("s0", "mm")),
        ("  A3: [-119, 155]", "  A33: [-119, 155]", "YML002", ("A33", "did you mean 'A3'")),
        ("  A3: [-119, 155]", "  A3: [155, -119]", "YML004", ("joints.A3", "lower")),
        (
            "effect: joint_compliance",
            "effect: joint_complience",
            "YML004",
            ("did you mean 'joint_compliance'",),
        ),
        ("value: 0.302e-6", "value: -0.302e-6", "YML004", ("c2", "not within")),
        ("value: 0.302e-6", "value: soft", "YML004", ("c2.value", "'soft' is not a number")),
        ("preload: balanced", "preload: balance", "YML004", ("did you mean 'balanced'",)),
        ("joint: A2,", "joint: B2,", "YML004", ("A1, A2",)),
        ("geometry:", "geometri:", "YML002", ("did you mean 'geometry'",)),
        ("  kuka: {", "  kuka: [", "YML001", ()),
    ],
)
def test_robot_file_with_a_mistake_tells_its_line(compensate, job, old, new, code, words):
    assert old in ROBOT
    path = job.folder / "robot.yaml"
    path.write_text(ROBOT.replace(old, new, 1))
    line = ROBOT[: ROBOT.index(old)].count("\n") + 1
    done = compensate(job.program, "--force", "--robot", path)
    refused(done, job, code, *words)
    assert f"robot.yaml:{line}:" in done.err or code == "YML001"


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ("", "FIL002", ()),
        ("- a\n- b\n", "YML001", ()),
        ("robot: kuka_kr270\nrobot: kuka_kr270\n", "YML004", ("twice",)),
        ("tools: {}\n", "YML003", ("robot",)),
        (CELL + "tolerence: 1\n", "YML002", ("did you mean 'tolerance'", "cell.yaml:8:1")),
        (CELL.replace("0.02", "-1"), "YML004", ("tolerance",)),
        (CELL.replace("1: {x: 1500", "2: {x: 1500"), "CEL002", ("1", "$BASE", "line 3")),
        (CELL.replace("x: 120", "x: far"), "YML004", ("far",)),
    ],
)
def test_cell_with_a_mistake_tells_its_line(compensate, job, text, code, words):
    job.cell(text)
    done = compensate(job.program, "--force")
    assert done.code == 1
    assert code in done.err
    missing = [word for word in words if word not in done.err]
    assert not missing or (code == "CEL002" and "1" in done.err)
    assert job.nothing_written()


def test_a_cutting_pose_out_of_reach(compensate, job):
    job.cell(CELL.replace("x: 1500", "x: 3500"))
    refused(compensate(job.program, "--force"), job, "KIN001", "part.src:10", "base")


def test_an_unknown_configuration(compensate, job):
    job.cell(CELL.replace("start: [0, -90, 90, 0, 45, 0]\n", ""))
    job.write([line for line in LINES if not line.startswith("PTP")])
    refused(compensate(job.program, "--force"), job, "KIN004", "start:")


@pytest.mark.parametrize(
    ("rows", "code", "words"),
    [
        ("10,0,nan,560\n", "FRC003", ("fy",)),
        ("10,0,360\n", "FRC003", ("2",)),
        ("10,0,abc,560\n", "FRC003", ("abc",)),
        ("1,0,360,560\n", "FRC004", ("line 1",)),
        ("99,0,360,560\n", "FRC004", ("99",)),
        ("10,0,1,2\n10,0,1,2\n", "FRC003", ("has a row already",)),
    ],
)
def test_force_table_with_a_mistake(compensate, job, rows, code, words):
    (job.folder / "f.csv").write_text("line,fx,fy,fz\n" + rows)
    done = compensate(job.program, "--force", job.folder / "f.csv")
    refused(done, job, code, "f.csv", *words)


@pytest.mark.parametrize("spec", ["1,2", "1,2,3@bas", "nan,1,2", "1,2,3,4,5", "1,2,inf"])
def test_force_that_is_none(compensate, job, spec):
    refused(compensate(job.program, f"--force={spec}"), job, "FRC002")


def test_no_force_shows_all_three_ways(compensate, job):
    job.write([line for line in LINES if "FORCE" not in line])
    refused(compensate(job.program, "--force"), job, "FRC001", "FORCE 0 360 560", "part.force.csv", "force:")


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"", "FIL002"),
        (b" \r\n \r\n", "FIL002"),
        (b"DEF part()\0\0", "FIL003"),
        (os.urandom(100) + b"\0", "FIL003"),
    ],
)
def test_empty_and_binary_programs(compensate, job, content, code):
    job.program.write_bytes(content)
    refused(compensate(job.program, "--force"), job, code)


def test_text_that_is_no_program(compensate, job):
    job.program.write_bytes(b"Dear reader,\nthis is a letter.\n")
    refused(compensate(job.program, "--force", "0,0,100"), job, "FIL009")


def test_the_data_list_is_missing(compensate, job):
    lines = list(LINES)
    lines[9] = "LIN XP3 C_DIS"
    job.write(lines)
    refused(compensate(job.program, "--force"), job, "FIL006", "the module's .dat", "part.src:10")


def test_a_correction_that_is_too_large(compensate, job):
    job.cell(CELL + "max_correction: 0.5\n")
    refused(compensate(job.program, "--force"), job, "COR002", "0.5 mm")


def test_output_over_the_input(compensate, job):
    before = job.program.read_bytes()
    refused(compensate(job.program, "--force", "-o", job.program), job, "FIL007")
    link = job.folder / "link.src"
    link.symlink_to(job.program)
    done = compensate(job.program, "--force", "-o", link)
    assert done.code == 1
    assert job.program.read_bytes() == before


def test_wrong_words_on_the_command_line(compensate, job):
    assert compensate(job.program, "--forse").code == 2
    typo = compensate("chek", job.program)
    assert typo.code == 2
    assert "did you mean 'check'" in typo.err
    assert compensate(job.program, "--gain", "2").code == 2
    before = job.program.read_bytes()
    assert compensate(job.program, "--force", "--json", job.program).code == 2
    assert job.program.read_bytes() == before
    assert compensate(job.program, "other.src").code == 2
    assert compensate("check").code == 2
    assert compensate("check", "--explain", "NIL000").code == 2
    assert job.nothing_written()


READ_ONLY = """
import encodings.unicode_escape, os, sys
from postproc.cli.main import run
try:
    run([*sys.argv[1:], "--dry-run"])  # loads every module while they can be read
except SystemExit:
    pass
if os.geteuid() == 0:
    os.seteuid(65534)  # root may write anywhere
run(sys.argv[1:])
"""


@pytest.mark.slow
def test_read_only_folder(job):
    for path in (job.folder, *job.folder.parents):
        if path.stat().st_uid == os.geteuid() and len(path.parts) > 2:
            path.chmod(path.stat().st_mode | 0o055)
    (job.folder / "compensated").mkdir()
    (job.folder / "compensated").chmod(0o555)
    command = [sys.executable, "-c", READ_ONLY, str(job.program), "--force"]
    done = subprocess.run(command, capture_output=True, check=False)
    assert done.returncode == 1, done.stderr
    assert b"FIL004" in done.stderr
    assert b"nothing is written" in done.stderr
    assert list((job.folder / "compensated").iterdir()) == []


FULL_DISK = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
from postproc.cli.main import run
run(sys.argv[2:])
"""


@pytest.mark.slow
@pytest.mark.parametrize("limit", [0, 100, 1500, 2500])
def test_full_disk(compensate, job, limit):
    """The system refuses to write more than ``limit`` bytes to a file; an earlier output is still there."""
    assert compensate(job.program, "--force").code == 0
    before = {path.name: path.read_bytes() for path in job.output.parent.iterdir()}
    command = [sys.executable, "-c", FULL_DISK, str(limit), str(job.program), "--force=0,50,0"]
    done = subprocess.run(
        command, capture_output=True, check=False, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    )
    assert done.returncode == 1, done.stderr
    assert b"FIL004" in done.stderr
    assert {path.name: path.read_bytes() for path in job.output.parent.iterdir()} == before
