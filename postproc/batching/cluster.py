"""The same tasks on a Dask cluster, whose workers see the same folders under the same paths."""

from __future__ import annotations

import logging
import re
import uuid
from collections.abc import Generator, Sequence
from concurrent.futures import CancelledError
from typing import Any

from postproc.base.findings import Finding, Refusal
from postproc.batching.files_read import code_digest
from postproc.batching.item import BatchItem, failed, recorded, run_item
from postproc.batching.processes import Stages, died
from postproc.report.batched import Outcome

PATIENCE = 30.0
"""[s] How long a cluster may be without a worker, and how long it takes to answer at first."""

_ADDRESS = re.compile(r"([a-z]+://)?([^\s/:\[\]]+|\[[0-9A-Fa-f:.%a-z]+\]):[0-9]{1,5}/?")

EXTRA = "pip install 'postproc[cluster]'"


def run_on_cluster(
    tasks: Sequence[BatchItem], address: str, stages: Stages
) -> Generator[tuple[int, Outcome], None, None]:
    """Do the tasks on the cluster whose scheduler is at ``address``; yields (number, outcome) as they are done.

    The scheduler gives the tasks of a worker that died to another one.  Where it is lost itself, or all of its workers
    for longer than ``PATIENCE``, the remaining tasks fail, but for those that are on record as done.  Workers stop what
    they do for a client that is gone, before they write it.  Raises Refusal BAT006, before anything is done, where
    the cluster is not there, has no workers, or workers of another version.
    """
    if not _ADDRESS.fullmatch(address):  # the client would wait for it, and end in a traceback
        raise _unusable(
            f"{address!r} is not the address of a scheduler", "write an address such as tcp://127.0.0.1:8786"
        )
    distributed = _distributed()
    try:
        client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise _unusable(f"no scheduler answers at {address}: {_line(error)}") from None
    try:
        _check(client, address)
        name = uuid.uuid4().hex
        pending = {
            client.submit(_run_on_worker, task, key=f"compensate-{name}-{number}", pure=False): number
            for number, task in enumerate(tasks)
        }
        try:
            while pending:
                ready, lost = _ready(distributed, client, list(pending))
                for future in sorted(ready, key=pending.__getitem__):
                    number = pending.pop(future)
                    yield number, _outcome(distributed, tasks[number], future)
                if lost:
                    for number in pending.values():
                        lost_item = failed(tasks[number].job, _finding(f"{lost}: {address}"))
                        yield number, recorded(tasks[number]) or lost_item
                    return
        finally:
            client.cancel(list(pending))
    finally:
        client.close()


def _ready(distributed: Any, client: Any, futures: list[Any]) -> tuple[set[Any], str]:
    """Futures that have ended, and what keeps all others from it."""
    try:
        with client.as_current():
            return distributed.wait(futures, PATIENCE, "FIRST_COMPLETED").done, ""
    except TimeoutError:
        return set(), "" if client.scheduler_info()["workers"] else "the cluster has no workers any more"
    except CancelledError:
        return {
            future for future in futures if future.status == "finished"
        }, "the connection to the cluster is lost"


def _outcome(distributed: Any, task: BatchItem, future: Any) -> Outcome:
    try:
        outcome: Outcome = future.result()
    except distributed.KilledWorker as error:
        return recorded(task) or died(task, f"the workers that computed it died: {_line(error)}")
    except (Exception, CancelledError) as error:  # done perhaps, with a result that did not arrive
        return recorded(task) or died(task, f"{type(error).__name__}: {_line(error)}")
    return outcome


def _run_on_worker(task: BatchItem) -> Outcome:
    return run_item(task, _stop_without_client)


def _stop_without_client(_stage: str) -> None:
    """Refusal BAT006 at the next stage of a task that nobody waits for any more: its client was stopped or killed."""
    from distributed import get_worker

    worker = get_worker()
    task = worker.state.tasks.get(worker.get_current_task())
    if task is None or task.state == "cancelled":
        raise Refusal(_finding("the batch that asked for this program is gone"))


def _check(client: Any, address: str) -> None:
    """Every worker has this package, in the same version."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        raise _unusable(f"the cluster at {address} has no workers") from None
    try:
        digests = client.run(code_digest)
    except Exception as error:  # whatever keeps a worker from importing this package
        raise _unusable(f"a worker cannot run this package: {_line(error)}") from None
    others = sorted(worker for worker, digest in digests.items() if digest != code_digest())
    if others:
        raise _unusable(
            f"some workers have another version of this package, of Python or of numpy: {', '.join(others)}"
        )


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise _unusable("the package dask.distributed is not installed", EXTRA) from None
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # its message is given here, in words
    return distributed


def _unusable(message: str, help: str = "") -> Refusal:
    return Refusal(_finding(message, help))


def _finding(message: str, help: str = "") -> Finding:
    return Finding("BAT006", message, help=help)


def _line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
