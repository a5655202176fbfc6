"""What a batch stands on: what is read, who is at work, and processes that die."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from batches import a_job, four_programs, program
from conftest import CELL

from postproc.base.findings import Refusal
from postproc.batching import files_read as reading
from postproc.batching.files_read import code_digest, digest_of, readings
from postproc.batching.item import BatchItem, run_item
from postproc.batching.locking import locked
from postproc.batching.processes import run_here
from postproc.report.batched import Outcome


@pytest.fixture
def parts(tmp_path):
    """A folder of four programs in a cell."""
    return four_programs(tmp_path / "parts")


def test_readings_see_what_is_opened(tmp_path):
    read, other, written = tmp_path / "read", tmp_path / "other", tmp_path / "written"
    read.write_text("a")
    other.write_text("b")
    other.read_text()
    with readings() as seen:
        read.read_text()
        assert digest_of(read) == seen[str(read)]
        written.write_text("c")
        with pytest.raises(FileNotFoundError):
            (tmp_path / "absent").read_text()
        Path(reading.__file__).read_text()
    other.read_text()
    assert seen == {str(read): digest_of(read), str(tmp_path / "absent"): "absent"}


@pytest.mark.slow
def test_an_input_that_changes_under_way_leaves_no_record(parts, monkeypatch):
    job = a_job(parts, "p0.src")

    def meddled(stage: str) -> None:
        (parts / "cell.yaml").write_text(CELL + "# another\n")

    outcome = run_item(BatchItem(job, code_digest()), meddled)
    assert (outcome.state, outcome.findings[0].code) == ("failed", "FIL010")
    assert not (parts / "compensated" / "p0.src").exists()
    assert not (parts / "compensated" / ".compensate").exists()
    assert run_item(BatchItem(job, code_digest())).state == "done"
    assert run_item(BatchItem(job, code_digest())).state == "unchanged"


def test_code_of_another_version_is_refused(parts):
    outcome = run_item(BatchItem(a_job(parts, "p0.src"), "0" * 64))
    assert (outcome.state, outcome.findings[0].code) == ("failed", "BAT006")


def test_a_defect_is_an_outcome(parts, monkeypatch):
    from postproc.workflows import program as workflow

    monkeypatch.setattr(workflow, "compensate", lambda request, stage: 1 // 0)
    outcome = run_item(BatchItem(a_job(parts, "p0.src"), code_digest()))
    assert (outcome.state, outcome.exit, outcome.findings[0].code) == ("failed", 1, "BAT004")
    assert "ZeroDivisionError" in outcome.findings[0].message
    assert not (parts / "compensated").exists()


HOLD = """
import sys
from pathlib import Path
from postproc.batching.locking import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def holder(path: Path) -> subprocess.Popen:
    """A process that holds the lock until its input ends."""
    words, pipe = [sys.executable, "-c", HOLD, str(path)], subprocess.PIPE
    process = subprocess.Popen(words, stdin=pipe, stdout=pipe)
    assert process.stdout.readline() == b"held\n"
    return process


def test_a_lock_waits_for_its_holder_and_survives_its_death(tmp_path):
    path = tmp_path / "state" / "x.lock"
    waited: list[int] = []
    process = holder(path)

    def wait() -> None:
        waited.append(1)
        process.stdin.close()

    with locked(path, wait):
        assert process.wait() == 0
    assert waited == [1]
    assert not path.parent.exists()
    process = holder(path)
    process.kill()
    process.wait()
    assert path.exists()
    with locked(path, lambda: waited.append(2)):
        pass
    assert waited == [1]
    assert not path.exists()


COUNT = """
import sys
from pathlib import Path
from postproc.batching.locking import locked
counter = Path(sys.argv[1])
for _ in range(150):
    with locked(counter.parent / "state" / "x.lock"):
        number = int(counter.read_text())
        counter.write_text(str(number + 1))
"""


def test_a_folder_that_takes_no_lock_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "nowhere").symlink_to(tmp_path / "none" / "none")
    for place in ("file", "nowhere"):
        with pytest.raises(Refusal) as refusal, locked(tmp_path / place / "state" / "x.lock"):
            pass
        assert refusal.value.findings[0].code == "FIL004"


@pytest.mark.slow
def test_nobody_is_beside_the_holder_of_a_lock(tmp_path):
    """Also while its file comes and goes: of every addition nothing is lost."""
    counter = tmp_path / "counter"
    counter.write_text("0")
    adding = [subprocess.Popen([sys.executable, "-c", COUNT, str(counter)]) for _ in range(4)]
    assert [process.wait() for process in adding] == [0, 0, 0, 0]
    assert counter.read_text() == "600"


@pytest.mark.slow
def test_two_batches_in_one_folder_share_the_work(parts):
    words = [sys.executable, "-m", "postproc", "batch", str(parts), "--force", "-j", "2", "--json", "-"]
    both = [subprocess.Popen(words, stdout=subprocess.PIPE) for _ in range(2)]
    results = [json.loads(process.communicate()[0]) for process in both]
    assert [process.returncode for process in both] == [0, 0]
    ended = [[one["state"] for one in result["programs"]] for result in results]
    for pair in zip(*ended, strict=True):
        assert sorted(pair) == ["done", "unchanged"]
    assert not list(parts.rglob("*.tmp*")) + list(parts.rglob("*.lock"))


# ------------------------------------------------------------------------------------------ processes that die


def worker_ids(parent: int) -> list[int]:
    """Children of a process that are workers of a batch."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                words = (entry / "cmdline").read_bytes().split(b"\0")
                status = (entry / "status").read_text()
            except OSError:
                continue
            if f"PPid:\t{parent}\n" in status and any(b"spawn_main" in word for word in words):
                found.append(int(entry.name))
    return found


class Deadly(BatchItem):
    """A task whose process is killed as it takes it, the first ``times`` times: counted in a file."""

    def __reduce__(self):
        return _deadly, (self.job, self.code)


def _deadly(job, code):
    import multiprocessing

    if multiprocessing.parent_process() is not None:
        counter = job.request.program.with_suffix(".deaths")
        left = int(counter.read_text())
        if left:
            counter.write_text(str(left - 1))
            os.kill(os.getpid(), signal.SIGKILL)
    return BatchItem(job, code)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc")
@pytest.mark.parametrize(("deaths", "state"), [(1, "done"), (2, "failed")])
def test_a_worker_that_dies_takes_nothing_with_it(parts, deaths, state):
    (parts / "p1.deaths").write_text(str(deaths))
    tasks = [BatchItem(a_job(parts, f"p{number}.src"), code_digest()) for number in range(4)]
    tasks[1] = Deadly(tasks[1].job, code_digest())
    outcomes: dict[int, Outcome] = dict(run_here(tasks, 2, lambda number, stage: None))
    assert sorted(outcomes) == [0, 1, 2, 3]
    assert outcomes.pop(1).state == state
    assert {outcome.state for outcome in outcomes.values()} == {"done"}


@pytest.mark.slow
def test_what_died_twice_is_told(parts):
    (parts / "p1.deaths").write_text("9")
    ((number, outcome),) = run_here(
        [Deadly(a_job(parts, "p1.src"), code_digest())], 4, lambda number, stage: None
    )
    assert (number, outcome.findings[0].code) == (0, "BAT005")
    assert "SIGKILL" in outcome.findings[0].message
    assert (parts / "p1.deaths").read_text() == "7"


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc")
def test_workers_die_with_their_batch(parts, tmp_path):
    for number in range(4, 40):
        program(parts / f"p{number}.src", number)
    words = [sys.executable, "-m", "postproc", "batch", str(parts), "--force", "-j", "2", "-q"]
    process = subprocess.Popen(words)
    deadline = time.monotonic() + 300
    while not (parts / "compensated" / "p1.src").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    workers = worker_ids(process.pid)
    assert workers
    process.kill()
    process.wait()
    while any(Path(f"/proc/{worker}").exists() for worker in workers) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(Path(f"/proc/{worker}").exists() for worker in workers)


def interrupted(parts, begun, delay=0.0):
    """A batch to whose process group an interrupt is sent ``delay`` s after ``begun(process)``; what it wrote."""
    words = [sys.executable, "-m", "postproc", "batch", str(parts), "--force", "-j", "2"]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
    deadline = time.monotonic() + 300
    while not begun(process) and time.monotonic() < deadline:
        time.sleep(0.005)
    time.sleep(delay)
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=300)
    assert out == b""
    return process, err


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc")
@pytest.mark.parametrize("delay", [0.0, 0.05, 0.2, 0.5])
def test_workers_that_only_begin_leave_an_interrupt_to_their_batch(parts, delay):
    for number in range(4, 20):
        program(parts / f"p{number}.src", number)
    process, err = interrupted(parts, lambda process: worker_ids(process.pid), delay)
    assert process.returncode == 130
    assert b"Traceback" not in err


@pytest.mark.slow
def test_an_interrupted_batch_ends_in_words(parts):
    for number in range(4, 200):
        program(parts / f"p{number}.src", number)
    process, err = interrupted(parts, lambda _: list((parts / "compensated").glob("*.src")))
    assert process.returncode == 130
    assert b"continues from there" in err
    assert b"Traceback" not in err
    assert not list(parts.rglob("*.tmp*"))
