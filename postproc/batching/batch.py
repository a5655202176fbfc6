"""``compensate batch`` as a function on paths."""

from __future__ import annotations

import time
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path

import postproc.codes  # noqa: F401  a worker reports findings of any room
from postproc.base.batches import cores
from postproc.batching.cluster import run_on_cluster
from postproc.batching.files_read import code_digest
from postproc.batching.item import BatchItem
from postproc.batching.job_file import Jobs, OptionValues, jobs_of
from postproc.batching.locking import locked
from postproc.batching.processes import run_here
from postproc.batching.records import lock_path
from postproc.output.atomic_write import write_atomically
from postproc.report.batched import Batched, Outcome, not_run, summary_json
from postproc.report.batched_page import batch_page


@dataclass(frozen=True)
class BatchRequest:
    """What the user asked for.

    words: one job file, or folders, files and patterns; options: fields of a ``Request`` that are set for all
    programs, and win over a job file; workers: processes, all cores by default; dask: address of a scheduler instead;
    rerun: also what is unchanged.
    """

    words: tuple[str, ...]
    options: OptionValues = field(default_factory=dict)
    output: Path | None = None
    workers: int | None = None
    dask: str | None = None
    fail_fast: bool = False
    rerun: bool = False
    allow_outside: bool = False
    json: Path | None = None


class Watch:
    """Whoever wants to see a batch at work; this one does not."""

    def started(self, jobs: Jobs) -> None:
        """The jobs are checked, and start."""

    def stage(self, name: str, stage: str) -> None:
        """A program is at another stage."""

    def ended(self, outcome: Outcome) -> None:
        """A program is done."""


def run_batch(request: BatchRequest, watch: Watch | None = None) -> Batched:
    """Do a batch and write its summary.

    Raises Refusal, before anything is done, for what is wrong with the jobs or the cluster; what is wrong with one
    program is an outcome.
    """
    watch = watch or Watch()
    start_time = time.monotonic()
    jobs = jobs_of(request.words, request.options, request.output, request.allow_outside)
    tasks = [BatchItem(job, code_digest(), request.rerun) for job in jobs.jobs]
    names = [job.name for job in jobs.jobs]
    watch.started(jobs)

    def stages(number: int, stage: str) -> None:
        watch.stage(names[number], stage)

    by_number: dict[int, Outcome] = {}
    if request.dask is not None:
        running = run_on_cluster(tasks, request.dask, stages)
    else:
        running = run_here(tasks, request.workers or cores(), stages)
    with closing(running) as done:
        for number, outcome in done:
            by_number[number] = outcome
            watch.ended(outcome)
            if request.fail_fast and outcome.exit == 1:
                break
    outcomes = tuple(
        by_number.get(number) or not_run(job.name, str(job.request.program))
        for number, job in enumerate(jobs.jobs)
    )
    skipped = tuple(str(path) for path in jobs.passed_over)
    batched = Batched(jobs.root, outcomes, (), skipped, time.monotonic() - start_time)
    if not request.options.get("dry_run"):
        return _published(batched, request.json)
    if request.json is not None:  # asked for by name
        batched = replace(batched, outputs=(str(request.json),))
        write_atomically({request.json: summary_json(batched)})
    return batched


def _published(batched: Batched, json: Path | None) -> Batched:
    """The batch with its summary written."""
    page, data = batched.root / "summary.html", batched.root / "summary.json"
    paths = [page, data, *([] if json is None else [json])]
    batched = replace(batched, outputs=tuple(str(path) for path in paths))
    text = summary_json(batched)
    with locked(lock_path(data)):
        write_atomically({page: batch_page(batched), **dict.fromkeys(paths[1:], text)})
    return batched
