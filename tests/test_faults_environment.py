"""A run that the system gives too little: files whole or absent, a true exit code, one line that says why."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from faults import KILLS, Child, once, stray, there

ROOT = Path(__file__).parent.parent
EACH = 4 if KILLS == 5 else 1
WRITTEN = 5


def limited(folder: Path, limit: str, words: str) -> tuple[int, str]:
    """``compensate WORDS`` in a shell with a limit."""
    line = f'{limit}; exec "{sys.executable}" -W ignore -m postproc {words}'
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run(
        ["bash", "-c", line], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


def whole_or_absent(job, code: int, said: str) -> None:
    assert code in (0, 1), said
    assert "Traceback" not in said
    assert "defect" not in said
    assert len(there(job.output.parent)) == (WRITTEN if code == 0 else 0), said
    assert stray(job.folder) == []
    shutil.rmtree(job.output.parent, ignore_errors=True)


@pytest.mark.slow
def test_few_open_files(job):
    """Six are the fewest with which Python itself starts in a virtual environment."""
    codes = []
    for count in range(6, 20, EACH):
        code, said = limited(job.folder, f"ulimit -n {count}", "part.src --force -q")
        whole_or_absent(job, code, said)
        codes.append(code)
    assert codes[-1] == 0


@pytest.mark.slow
def test_few_open_files_of_a_batch(job):
    """Too few for the pipes of its workers."""
    for count in (8, 12, 16):
        code, said = limited(job.folder, f"ulimit -n {count}", "batch . --force -j 4 -q")
        assert code in (0, 1), said
        assert "Traceback" not in said
        assert code == 0 or "too few files" in said


@pytest.mark.slow
def test_little_memory(job):
    """Address space [MB] from what loads no numpy to what is enough."""
    codes = []
    for size in range(40, 1400, 60 * EACH):
        code, said = limited(job.folder, f"ulimit -v {1000 * size}", "part.src --force -q")
        if (
            "OpenBLAS" in said or code == 127
        ):  # the library ends the process itself; or the system cannot start it
            assert there(job.output.parent) == {}
            continue
        whole_or_absent(job, code, said)
        codes.append(code)
        if code == 1:
            assert "memory" in said or "FIL004" in said, said
        elif code == 0 and codes.count(0) > 1:
            break
    assert 0 in codes
    assert 1 in codes


@pytest.mark.slow
def test_a_folder_that_is_deleted_under_a_run(job):
    """The folder of the results, at any request that the run makes of it."""
    code, refused = 0, 0
    for at in range(1, 200, 3 * EACH):
        job.output.parent.mkdir(exist_ok=True)
        child = Child(
            [job.program, "--force", "-q"],
            job.output.parent,
            once(at, lambda: shutil.rmtree(job.output.parent, ignore_errors=True)),
        )
        code = child.end()
        assert code in (0, 1), child.said
        assert "Traceback" not in child.said
        found = there(job.output.parent)
        assert set(found) == (set(found) if code == 0 else set()), child.said
        refused += code == 1
        if len(found) == WRITTEN and at > 60:
            break
    assert refused


@pytest.mark.parametrize(
    "words",
    [["part.src", "--force"], ["check", "part.src"], ["batch", ".", "--force"], ["batch", "night.yaml"]],
)
def test_a_working_folder_that_is_gone(compensate, tmp_path, monkeypatch, words):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    done = compensate(*words)
    assert done.code == 1, done.err
    assert "Traceback" not in done.err
    assert "defect" not in done.err
    assert done.err.count("\n") <= 3
    monkeypatch.chdir(tmp_path)


@pytest.mark.sample(5)
@pytest.mark.parametrize("length", [256, 300, 5000])
@pytest.mark.parametrize(
    "words",
    [
        ["{}.src", "--force"],
        ["part.src", "--force", "-o", "{}.src"],
        ["part.src", "--force", "-o", "{}/"],
        ["part.src", "--force", "--report", "{}"],
        ["part.src", "--force", "--cell", "{}.yaml"],
        ["part.src", "--force", "--robot", "{}.yaml"],
        ["part.src", "--force", "--json", "{}.json"],
        ["part.src", "--force", "--config-dat", "{}.dat"],
        ["part.src", "--force={}.csv"],
        ["check", "{}.src"],
        ["verify", "part.src", "{}.src", "--force"],
        ["batch", "{}", "--force"],
        ["batch", "{}.yaml"],
        ["batch", "part.src", "--force", "-o", "{}"],
        ["identify", "{}.csv", "--effects", "joint_compliance", "--robot", "kuka_kr270"],
        ["diagnose", "{}.csv", "--robot", "kuka_kr270"],
        ["robots", "{}.yaml"],
    ],
    ids=lambda words: " ".join(words),
)
def test_names_that_are_too_long(compensate, job, monkeypatch, words, length):
    monkeypatch.chdir(job.folder)
    done = compensate(*(word.format("a" * length) for word in words))
    assert done.code == 1, done.err
    assert "Traceback" not in done.err
    assert "defect" not in done.err
    assert job.nothing_written()
    assert stray(job.folder) == []
    assert sorted(path.name for path in job.folder.iterdir()) == ["cell.yaml", "part.src"]


@pytest.mark.parametrize("gain", ["nan", "inf", "-inf", "NaN", "1e309"])
def test_what_is_no_share_is_refused(compensate, job, gain):
    done = compensate(job.program, "--force", "--gain", gain)
    assert done.code == 2
    assert job.nothing_written()
