"""A run to which something happens: the input stays, the output is whole or absent, the next run clears up.

``POSTPROC_KILLS=200`` kills a run at two hundred random moments instead of five, and at every request to the system.
"""

from __future__ import annotations

import errno
import os
import random
import resource
import shutil
import signal
import time
from pathlib import Path

import pytest
from conftest import LINES
from faults import KILLS, Child, once, seconds, stray, there

from postproc.base.findings import Refusal
from postproc.workflows.preparation import Request
from postproc.workflows.program import compensate as compensated

EACH = 7 if KILLS == 5 else 1
"""Of the requests that a run makes of the system every seventh is tried, all of them with more kills."""
OLD, NEW = "--force=0,50,0", "--force=0,150,0"
REQUESTS = 200
"""More than a run makes of the system."""


@pytest.fixture
def shop(job):
    """A program with a data list, what two runs make of it, and how to begin anew with the first of them."""
    job.write(["DEFDAT part", "DECL REAL X=1.0", "ENDDAT"], name="part.dat")
    folder = job.output.parent
    made = {}
    for force in (OLD, NEW):
        assert Child([job.program, force], job.folder).end() in (0, 3)
        made[force] = there(folder)
    old, new = made[OLD], made[NEW]
    assert old.keys() == new.keys()
    assert sorted(old) == [
        "part.corrections.csv", "part.dat", "part.diff", "part.report.html", "part.report.json", "part.src",
    ]  # fmt: skip
    inputs = there_without_results(job.folder)

    def begin() -> None:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for name, content in old.items():
            (folder / name).write_bytes(content)

    def check() -> bool:
        """Nothing is half; True if the new program is there."""
        assert there_without_results(job.folder) == inputs
        found = there(folder)
        for name, content in found.items():
            assert content in (old[name], new[name]), f"{name} is neither the old one nor the new one"
        program = found.get("part.src")
        if program is not None:
            assert found == (new if program == new["part.src"] else old)
        return program == new["part.src"]

    return job, folder, old, new, begin, check


def there_without_results(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.mark.slow
def test_killed_at_random_moments(shop):
    job, folder, _, new, begin, check = shop
    lasts = seconds(lambda: Child([job.program, NEW], job.folder).end())
    moments, finished = random.Random(1), 0
    begin()
    for number in range(KILLS):
        if number % 5 == 4:  # what the killed ones left half-written is gone after a run
            assert Child([job.program, NEW], job.folder).end() in (0, 3)
            assert there(folder) == new
            assert stray(job.folder) == []
            begin()
        child = Child([job.program, NEW], job.folder)
        time.sleep(moments.uniform(0.0, lasts))
        os.kill(child.pid, signal.SIGKILL)
        child.end()
        finished += check()
    print(f"{KILLS} kills: {finished} after the files were written, all files whole or absent")
    assert Child([job.program, NEW], job.folder).end() in (0, 3)
    assert there(folder) == new
    assert stray(job.folder) == []


def kill() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def interrupt() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def full() -> None:
    print("request that failed")
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.slow
def test_killed_at_requests_to_the_system(shop):
    job, folder, _, new, begin, check = shop
    begin()
    states = []
    for at in range(1, REQUESTS, EACH):
        child = Child([job.program, NEW], folder, once(at, kill))
        code = child.end()
        states.append(check())
        if code != -signal.SIGKILL:
            break
    assert code in (0, 3), child.said
    assert set(states) == {False, True}
    assert there(folder) == new
    assert stray(job.folder) == []


@pytest.mark.slow
def test_interrupted_at_requests_to_the_system(shop):
    """Ctrl-C: exit code 130, all old files or all new ones."""
    job, folder, old, new, begin, check = shop
    for at in range(1, REQUESTS, EACH):
        begin()
        child = Child([job.program, NEW], folder, once(at, interrupt))
        code = child.end()
        check()
        if code != 130:
            break
        assert there(folder) in (old, new)
        assert "interrupted" in child.said
        assert "Traceback" not in child.said
    assert code in (0, 3), child.said
    assert there(folder) == new
    assert stray(job.folder) == []


@pytest.mark.slow
def test_requests_to_the_system_that_fail(shop):
    job, folder, old, new, begin, _ = shop
    refused = 0
    for at in range(1, REQUESTS, EACH):
        begin()
        child = Child([job.program, NEW], folder, once(at, full))
        code = child.end()
        reached = "request that failed" in child.said
        assert code in (0, 1, 3), child.said
        refused += code == 1
        assert there(folder) == (old if code == 1 else new), child.said
        if code == 1:
            assert "nothing is written" in child.said
            assert "FIL004" in child.said
        if not reached:
            break
    assert refused > 1


@pytest.mark.slow
def test_a_disk_that_is_full_at_any_file(shop):
    """No file may be longer than the system says; every output in turn is the first that is too long."""
    job, folder, old, new, begin, _ = shop
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    for limit in (0, *(len(content) - 1 for content in new.values())):
        begin()

        def limited(size: int = limit) -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))

        child = Child([job.program, NEW, "-q"], folder, once(1, limited))
        assert child.end() == 1, limit
        assert there(folder) == old
        assert stray(job.folder) == []
    assert resource.getrlimit(resource.RLIMIT_FSIZE) == (soft, hard)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["part.src", "part.dat"])
@pytest.mark.parametrize("stage", ["correcting", "reporting"])
def test_an_input_that_changes_while_it_is_read(shop, name, stage):
    job, folder, _, _, begin, _ = shop
    begin()
    shutil.rmtree(folder)

    def told(now: str) -> None:
        if now == stage:
            path = job.folder / name
            path.write_bytes(path.read_bytes() + b";\r\n")

    with pytest.raises(Refusal) as refusal:
        compensated(Request(job.program, force="0,150,0"), told)
    assert refusal.value.findings[0].code == "FIL010"
    assert refusal.value.findings[0].file.endswith(name)
    assert not folder.exists()


def test_an_input_that_goes_while_it_is_read(job):
    with pytest.raises(Refusal) as refusal:
        compensated(Request(job.program, force=""), lambda stage: job.program.unlink(missing_ok=True))
    assert refusal.value.findings[0].code == "FIL001"
    assert job.nothing_written()


@pytest.mark.slow
@pytest.mark.parametrize("round", range(3))
def test_runs_on_one_file_at_once(shop, round):
    """All files are of one of them."""
    job, folder, old, new, begin, _ = shop
    begin()
    children = [Child([job.program, force], job.folder) for force in (OLD, NEW, OLD, NEW)[round % 2 :]]
    assert {child.end() for child in children} <= {0, 3}
    assert there(folder) in (old, new)
    assert stray(job.folder) == []


@pytest.mark.slow
def test_runs_on_one_file_into_several_folders_at_once(shop):
    """Each makes what it makes alone, and none waits for what another one holds."""
    job, _, old, new, _, _ = shop
    wanted = {"one": (OLD, old), "two": (NEW, new), "three": (OLD, old), "four": (NEW, new)}
    children = [
        Child([job.program, force, "-o", job.folder / name / "part.src", "-q"], job.folder)
        for name, (force, _) in wanted.items()
    ]
    assert {child.end() for child in children} <= {0, 3}
    for name, (_, made) in wanted.items():
        found = there(job.folder / name)
        assert found.keys() == made.keys()
        for file in ("part.src", "part.dat", "part.corrections.csv", "part.diff"):
            assert found[file] == made[file], (name, file)
    assert stray(job.folder) == []


def test_one_folder_under_two_names_does_not_wait_for_itself(compensate, job):
    (job.folder / "same").mkdir()
    (job.folder / "link").symlink_to("same")
    done = compensate(
        job.program, "--force", "-o", job.folder / "same" / "part.src", "--report", job.folder / "link"
    )
    assert done.code == 0
    assert len(there(job.folder / "same")) == 5


@pytest.mark.slow
@pytest.mark.parametrize("when", [-1e9, 0.0, 4e9])
def test_the_clock_is_of_no_matter(compensate, job, when):
    """Files from before the first disk or from the far future: the same bytes; what a batch has done stays done."""
    assert compensate("batch", job.program, "--force", "-j", "1", "-q").code == 0
    before = there(job.output.parent)
    for path in (job.program, job.folder / "cell.yaml", *job.output.parent.glob("part.*")):
        os.utime(path, (when, when))
    again = compensate("batch", job.program, "--force", "-j", "1", "--json", "-")
    assert [one["state"] for one in again.json["programs"]] == ["unchanged"]
    job.write([line.replace("X 200.000", "X 201.000") for line in LINES])
    os.utime(job.program, (when, when))
    once_more = compensate("batch", job.program, "--force", "-j", "1", "--json", "-")
    assert [one["state"] for one in once_more.json["programs"]] == ["done"]
    assert there(job.output.parent)["part.src"] != before["part.src"]
