"""The same batch on a Dask cluster: the same bytes, also where a worker dies."""

from __future__ import annotations

import json
import os
import signal
import socket
import time

import distributed
import pytest
from conftest import CELL
from test_batch_killed import a_long_program

from postproc.base.findings import Refusal
from postproc.batching.cluster import run_on_cluster
from postproc.batching.files_read import code_digest
from postproc.batching.item import BatchItem
from postproc.batching.job_file import jobs_of

PROGRAMS = 8


@pytest.fixture(scope="module")
def cluster():
    """Two worker processes on the loopback."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as cluster:
        yield cluster


@pytest.fixture
def parts(tmp_path):
    (tmp_path / "cell.yaml").write_text(CELL)
    for number in range(PROGRAMS):
        a_long_program(tmp_path / f"part{number}.src", number, 200)
    return tmp_path


def results(folder) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (folder / "compensated").iterdir() if path.is_file()}


@pytest.mark.slow
def test_the_same_bytes_as_on_this_machine(compensate, parts, cluster):
    here = compensate("batch", parts, "--force", "--json", "-")
    assert here.code == 0, here.err
    wanted = results(parts)
    there = compensate(
        "batch", parts, "--force", "--rerun", "--dask", cluster.scheduler_address, "--json", "-"
    )
    assert there.code == 0, there.err
    assert there.json == here.json
    assert results(parts) == wanted
    again = compensate("batch", parts, "--force", "--dask", cluster.scheduler_address, "--json", "-")
    assert {one["state"] for one in again.json["programs"]} == {"unchanged"}


@pytest.mark.slow
def test_a_worker_that_is_killed_is_survived(compensate, parts, cluster):
    compensate("batch", parts, "--force", "-q")
    wanted = {name: text for name, text in results(parts).items() if name.startswith("part")}
    jobs = jobs_of([str(parts)], {"force": ""})
    tasks = [BatchItem(job, code_digest(), rerun=True) for job in jobs.jobs]
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        workers = client.run(os.getpid)
    assert len(set(workers.values())) == 2
    outcomes, killed, began = {}, False, time.monotonic()
    for number, outcome in run_on_cluster(tasks, cluster.scheduler_address, lambda number, stage: None):
        outcomes[number] = outcome
        if not killed:
            os.kill(next(iter(workers.values())), signal.SIGKILL)
            killed = True
    assert {outcome.state for outcome in outcomes.values()} == {"done"}
    assert sorted(outcomes) == list(range(PROGRAMS))
    assert time.monotonic() - began < 120
    assert {name: text for name, text in results(parts).items() if name.startswith("part")} == wanted
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)


@pytest.mark.slow
def test_a_cluster_that_is_lost_midway_is_told(parts):
    """What was done stays, and the rest is not waited for."""
    jobs = jobs_of([str(parts)], {"force": ""})
    tasks = [BatchItem(job, code_digest()) for job in jobs.jobs]
    outcomes = {}
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as lost:
        for number, outcome in run_on_cluster(tasks, lost.scheduler_address, lambda number, stage: None):
            outcomes[number] = outcome
            lost.close()
    assert sorted(outcomes) == list(range(PROGRAMS))
    states = [outcome.state for outcome in outcomes.values()]
    assert states.count("done") >= 1
    assert states.count("failed") >= 1
    for outcome in outcomes.values():
        assert outcome.state == "done" or outcome.findings[0].code in ("BAT005", "BAT006")


@pytest.mark.slow
def test_one_that_fails_stops_no_other(compensate, parts, cluster):
    (parts / "bad.src").write_bytes(b"DEF bad()\r\nLIN {X 1}\r\n\0END\r\n")
    done = compensate("batch", parts, "--force", "--dask", cluster.scheduler_address, "--json", "-")
    assert done.code == 1
    ended = {one["name"]: one["state"] for one in done.json["programs"]}
    assert ended.pop("bad.src") == "failed"
    assert set(ended.values()) == {"done"}


def test_no_cluster_is_told_before_anything_begins(compensate, parts, monkeypatch):
    from postproc.batching import cluster as module

    monkeypatch.setattr(module, "PATIENCE", 1.0)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    done = compensate("batch", parts, "--force", "--dask", address, "--json", "-")
    assert done.code == 1
    assert json.loads(done.out)["findings"][0]["code"] == "BAT006"
    assert not (parts / "compensated").exists()


@pytest.mark.parametrize("address", ["no address", "host", "tcp://host", "host:port", ":8786", "tcp://a/b:1"])
def test_what_is_no_address_is_told_at_once(address):
    with pytest.raises(Refusal) as refusal:
        list(run_on_cluster([], address, lambda number, stage: None))
    assert "is not the address" in refusal.value.findings[0].message


@pytest.mark.slow
def test_a_cluster_without_workers_is_told(parts, monkeypatch):
    from postproc.batching import cluster as module

    monkeypatch.setattr(module, "PATIENCE", 2.0)
    with (
        distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0") as empty,
        pytest.raises(Refusal) as refusal,
    ):
        list(run_on_cluster([], empty.scheduler_address, lambda number, stage: None))
    assert "no workers" in refusal.value.findings[0].message
