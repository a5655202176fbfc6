"""The same input makes the same bytes: whatever the surroundings, alone or among others, in one process or in many."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest
from batches import contents, four_programs

SURROUNDINGS = (
    {"PYTHONHASHSEED": "0", "TZ": "UTC", "LC_ALL": "C", "OPENBLAS_NUM_THREADS": "1"},
    {"PYTHONHASHSEED": "1", "TZ": "Pacific/Kiritimati", "LC_ALL": "de_DE.UTF-8", "OPENBLAS_NUM_THREADS": "2"},
    {
        "PYTHONHASHSEED": "77",
        "TZ": "America/St_Johns",
        "LC_ALL": "tr_TR.UTF-8",
        "PYTHONUTF8": "0",
        "COLUMNS": "40",
    },
    {"PYTHONHASHSEED": "random", "LANG": "ja_JP.eucJP", "PYTHONOPTIMIZE": "1", "PYTHONCOERCECLOCALE": "0"},
)


def test_surroundings_change_no_byte(job):
    job.write(["DEFDAT part", ";Gr\u00f6\u00dfe", "ENDDAT"], name="part.dat")
    made = []
    for own in SURROUNDINGS:
        shutil.rmtree(job.output.parent, ignore_errors=True)
        words = [sys.executable, "-m", "postproc", job.program, "--force", "-q"]
        plain = {key: value for key, value in os.environ.items() if not key.startswith(("LC_", "LANG", "TZ"))}
        done = subprocess.run(words, env={**plain, **own}, check=False, capture_output=True)
        assert done.returncode == 0, done.stderr
        made.append(contents(job.output.parent))
    assert len(made[0]) == 6
    assert all(one == made[0] for one in made[1:])


def test_a_second_run_over_the_first_changes_no_byte(compensate, job):
    assert compensate(job.program, "--force").code == 0
    first = contents(job.output.parent)
    assert compensate(job.program, "--force").code == 0
    assert contents(job.output.parent) == first


@pytest.mark.parametrize("umask", [0o000, 0o077])
def test_rights_change_no_byte(compensate, job, umask):
    assert compensate(job.program, "--force").code == 0
    first = contents(job.output.parent)
    before = os.umask(umask)
    try:
        assert compensate(job.program, "--force").code == 0
    finally:
        os.umask(before)
    assert contents(job.output.parent) == first
    assert job.output.stat().st_mode & 0o777 == 0o666 & ~umask


def test_one_process_or_many_or_each_alone(compensate, tmp_path):
    """A batch by one process, by two, and every program for itself make the same files."""
    folder = four_programs(tmp_path / "shop")
    results = folder / "compensated"
    made = []
    for workers in (1, 2):
        shutil.rmtree(results, ignore_errors=True)
        assert compensate("batch", folder, "--force", "-j", workers, "-q").code == 0
        made.append({name: raw for name, raw in contents(results).items() if name.startswith("p")})
    shutil.rmtree(results)
    for number in range(4):
        assert compensate(folder / f"p{number}.src", "--force", "-q").code == 0
    made.append(contents(results))
    assert len(made[0]) == 20
    assert made[0] == made[1] == made[2]
