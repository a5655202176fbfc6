"""Programs of other origin, from the folder that POSTPROC_PROGRAMS names; skipped without it."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from test_main_job import RIGID

FOLDER = os.environ.get("POSTPROC_PROGRAMS")
PROGRAMS = sorted(Path(FOLDER).rglob("*.src")) if FOLDER else []

pytestmark = pytest.mark.skipif(not FOLDER, reason="POSTPROC_PROGRAMS names no folder")

FRAMES = range(1, 17)
CELL = "\n".join(
    [
        "robot: kuka_kr270",
        "start: [0, -90, 90, 0, 45, 0]",
        "tools:",
        *(f"  {n}: {{x: 100, y: 0, z: 200, a: 0, b: 45, c: 0}}" for n in FRAMES),
        "bases:",
        *(f"  {n}: {{x: 1500, y: 0, z: 800}}" for n in FRAMES),
    ]
)


@pytest.fixture(params=PROGRAMS, ids=lambda path: path.stem[:40])
def program(request, tmp_path) -> Path:
    for path in request.param.parent.glob(request.param.stem + ".*"):
        shutil.copy(path, tmp_path)
    (tmp_path / "cell.yaml").write_text(CELL)
    (tmp_path / "rigid.yaml").write_text(RIGID)
    return tmp_path / request.param.name


def test_is_checked(compensate, program):
    assert compensate("check", program).code in (0, 3)


def test_comes_back_from_a_rigid_robot_without_force(compensate, program):
    done = compensate(program, "--force", "0,0,0", "--robot", program.with_name("rigid.yaml"))
    assert done.code in (0, 3), done.err
    assert (program.parent / "compensated" / program.name).read_bytes() == program.read_bytes()


@pytest.mark.parametrize("force", ["0,36,56@base", "-10,36,56@tool", "-10,36,-5@feed"])
def test_goes_through_the_main_job(compensate, program, force):
    done = compensate(program, f"--force={force}")
    assert done.code in (0, 1, 3)
    assert (done.code == 1) != (program.parent / "compensated" / program.name).exists()
