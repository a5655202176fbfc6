"""Tasks on the processes of this machine.  A process that dies takes one attempt of one task with it, nothing else."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from types import FrameType

from postproc.base.batches import THREADS, cores
from postproc.base.findings import Finding
from postproc.batching.item import BatchItem, failed, run_item
from postproc.report.batched import Outcome

ATTEMPTS = 2
"""A task whose process dies is tried once more: most were killed for want of memory, beside others."""

SERIAL = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""One thread a process: matrices are small here, and processes beside each other already use all cores."""

Stages = Callable[[int, str], None]
"""Receives the number of a task and the name of the stage that it is at."""

_SPAWN = multiprocessing.get_context("spawn")


def run_here(
    tasks: Sequence[BatchItem], workers: int, stages: Stages
) -> Generator[tuple[int, Outcome], None, None]:
    """Do the tasks in ``workers`` processes; yields (number, outcome) as they are done.

    Large programs start first, so that none of them is alone at the end.  Closed early, what is in work is given up.
    """
    for name in SERIAL:
        os.environ.setdefault(name, "1")
    os.environ.setdefault(THREADS, str(max(1, cores() // max(1, min(workers, len(tasks))))))
    waiting = deque(sorted(range(len(tasks)), key=lambda number: (-_size(tasks[number]), number)))
    attempts = [0] * len(tasks)
    pool = [_Worker() for _ in range(min(workers, len(tasks)))]
    try:
        while True:
            for worker in pool:
                if worker.number is None and waiting:
                    worker.start(waiting.popleft(), tasks)
            busy = {worker.pipe: worker for worker in pool if worker.number is not None}
            if not busy:
                return
            for pipe in wait(list(busy)):
                worker = busy[pipe]  # type: ignore[index]
                number = worker.number
                assert number is not None
                answer = worker.answer()
                if isinstance(answer, str):
                    stages(number, answer)
                    continue
                if answer is None:
                    attempts[number] += 1
                    pool[pool.index(worker)] = _Worker()
                    if attempts[number] < ATTEMPTS:
                        waiting.append(number)
                        continue
                    answer = died(
                        tasks[number], f"its process ended with {worker.end_reason()}, {ATTEMPTS} times"
                    )
                worker.number = None
                yield number, answer
    finally:
        for worker in pool:
            worker.end()


def died(task: BatchItem, how: str) -> Outcome:
    """The outcome of a task whose process is gone."""
    return failed(task.job, Finding("BAT005", how, str(task.job.request.program)))


def _size(task: BatchItem) -> int:
    try:
        return task.job.request.program.stat().st_size
    except OSError:
        return 0


class _Worker:
    """A process that takes one task after another; ``number``: of the one in work."""

    def __init__(self) -> None:
        self.pipe, other = _SPAWN.Pipe()
        self.process: BaseProcess = _SPAWN.Process(target=_serve, args=(other,), daemon=True)
        with _block_interrupt():
            self.process.start()
        other.close()
        self.number: int | None = None

    def start(self, number: int, tasks: Sequence[BatchItem]) -> None:
        self.number = number
        with contextlib.suppress(
            OSError
        ):  # it died while idle: its pipe is at its end, and `answer` states so
            self.pipe.send(tasks[number])

    def answer(self) -> Outcome | str | None:
        """What the process sends next: a stage, or an outcome; None if it is gone."""
        try:
            message: Outcome | str = self.pipe.recv()
        except (EOFError, OSError):
            return None
        return message

    def end_reason(self) -> str:
        self.process.join()
        code = self.process.exitcode or 0
        return signal.Signals(-code).name if code < 0 else f"code {code}"

    def end(self) -> None:
        """Idle ones see the end of their pipe; one at work is terminated, and removes its half-written files."""
        self.pipe.close()
        if self.number is not None:
            self.process.terminate()
        self.process.join()


@contextlib.contextmanager
def _block_interrupt() -> Iterator[None]:
    """Ctrl-C waits: a process started meanwhile inherits that, and is not interrupted before it can ignore it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # where it has to be started, it lets the interrupt through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(pipe: Connection) -> None:
    """The life of a worker process."""
    # a Ctrl-C is the business of the process that started it all
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _exit_on_signal)
    threading.Thread(target=_follow, daemon=True).start()
    with contextlib.closing(pipe):
        while True:
            try:
                task = pipe.recv()
            except (EOFError, OSError):
                return
            try:
                pipe.send(run_item(task, pipe.send))
            except OSError:
                return


def _follow() -> None:
    """Die with the parent: a worker whose batch was killed must not write any more."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _exit_on_signal(_number: int, _frame: FrameType | None) -> None:
    sys.exit(128 + signal.SIGTERM)
