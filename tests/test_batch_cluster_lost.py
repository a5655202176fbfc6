"""A cluster whose scheduler or client goes away: what is done is reported as done, what nobody wants is not done."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import distributed
import pytest
from conftest import CELL
from test_batch_killed import a_long_program

from postproc.batching.cluster import run_on_cluster
from postproc.batching.files_read import code_digest
from postproc.batching.item import BatchItem, recorded, run_item
from postproc.batching.job_file import jobs_of

pytestmark = pytest.mark.slow


@pytest.fixture
def parts(tmp_path):
    (tmp_path / "cell.yaml").write_text(CELL)
    for number in range(6):
        a_long_program(tmp_path / f"part{number}.src", number, 200)
    return tmp_path


def tasks_of(folder) -> list[BatchItem]:
    return [BatchItem(job, code_digest()) for job in jobs_of([str(folder)], {"force": ""}).jobs]


def test_what_is_on_record_is_done(parts):
    task = tasks_of(parts)[0]
    assert recorded(task) is None
    done = run_item(task)
    known = recorded(task)
    assert known is not None
    assert (known.state, known.result) == (done.state, done.result)
    task.job.target.write_bytes(b"another")
    assert recorded(task) is None


def test_what_was_done_before_the_scheduler_is_lost_is_reported_as_done(parts):
    tasks = tasks_of(parts)
    outcomes = {}
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as lost:
        for number, outcome in run_on_cluster(tasks, lost.scheduler_address, lambda number, stage: None):
            outcomes[number] = outcome
            if len(outcomes) == 1:  # while it is not asked, others are done
                deadline = time.monotonic() + 120
                while sum(task.job.target.exists() for task in tasks) < 3 and time.monotonic() < deadline:
                    time.sleep(0.02)
                time.sleep(0.5)
                lost.close()
    assert sorted(outcomes) == list(range(len(tasks)))
    for number, task in enumerate(tasks):
        state = outcomes[number].state
        assert state == ("done" if recorded(task) else "failed"), (number, state)
    assert [one.state for one in outcomes.values()].count("done") >= 3


def test_workers_stop_for_a_client_that_is_killed(parts):
    """Those at work write nothing more, those that wait do not start."""
    for number in range(6, 30):
        a_long_program(parts / f"part{number}.src", number, 200)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as cluster:
        words = ["batch", str(parts), "--force", "--dask", cluster.scheduler_address, "-q"]
        client = subprocess.Popen([sys.executable, "-m", "postproc", *words])
        folder, deadline = parts / "compensated", time.monotonic() + 120
        while not list(folder.glob("*.src")) and time.monotonic() < deadline:
            time.sleep(0.005)
        os.kill(client.pid, signal.SIGKILL)
        client.wait()
        time.sleep(1.0)  # what was being written is written
        written = sorted(path.name for path in folder.glob("*.src"))
        time.sleep(4.0)
        assert sorted(path.name for path in folder.glob("*.src")) == written
    assert 1 <= len(written) < 20
