"""One job, in whatever process it runs: locked, done unless it is done, recorded.  Never raises on its program."""

from __future__ import annotations

import os
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass

from postproc.base.findings import Finding, Refusal
from postproc.base.system import refusal_of_the_system
from postproc.batching.files_read import code_digest, readings
from postproc.batching.job_file import Job
from postproc.batching.locking import locked
from postproc.batching.records import Record, files_around, load_record, lock_path, save_record, sweep
from postproc.report.batched import DONE, FAILED, UNCHANGED, Outcome
from postproc.report.report import failure

ReportStage = Callable[[str], None]


@dataclass(frozen=True)
class BatchItem:
    """A job with how it is to be done.  ``code``: digest of the code that asks for it; ``rerun``: also if unchanged."""

    job: Job
    code: str
    rerun: bool = False


def run_item(task: BatchItem, report_stage: ReportStage = lambda stage: None) -> Outcome:
    """Do a job.  ``report_stage`` is called with each stage."""
    start_time = time.monotonic()
    job = task.job
    try:
        if task.code != code_digest():
            message = "this worker runs another version of this package, of Python or of numpy"
            raise Refusal(Finding("BAT006", message, job.name))
        if job.request.dry_run:
            return _outcome(job, DONE, _compensated(job, report_stage), start_time)
        with locked(lock_path(job.target), lambda: report_stage("waiting for another batch")):
            return _run_once(task, report_stage, start_time)
    except Refusal as refusal:
        return failed(job, *refusal.findings, seconds=time.monotonic() - start_time)
    except Exception as error:
        if why := refusal_of_the_system(error):
            finding = Finding("BAT008", why, str(job.request.program))
            return failed(job, finding, seconds=time.monotonic() - start_time)
        message = f"{type(error).__name__}: {error}"
        finding = Finding("BAT004", message, str(job.request.program), help=traceback.format_exc())
        return failed(job, finding, seconds=time.monotonic() - start_time)


def failed(job: Job, *findings: Finding, seconds: float = 0.0) -> Outcome:
    """The outcome of a job that wrote nothing."""
    program = str(job.request.program)
    if os.path.exists(job.target) and not job.request.dry_run:
        findings += (Finding("BAT007", f"{job.target} remains from an earlier run", program),)
    return Outcome(job.name, FAILED, failure("program", program, findings), seconds)


def recorded(task: BatchItem) -> Outcome | None:
    """The outcome of a job that is done, of which nobody heard that it is; None where no record says so."""
    if task.job.request.dry_run:
        return None
    record = load_record(task.job)
    if record is None or not record.holds(task.job):
        return None
    return Outcome(task.job.name, DONE, record.result, 0.0)


def _run_once(task: BatchItem, report_stage: ReportStage, start_time: float) -> Outcome:
    job = task.job
    before = load_record(job)
    sweep(job, () if before is None else before.outputs)
    if before is not None and not task.rerun and before.holds(job):
        return _outcome(job, UNCHANGED, before.result, start_time)
    around = files_around(job)
    with readings() as inputs:
        result = _compensated(job, report_stage)
    record = Record.of(job, around, inputs, result)
    if record is not None:
        save_record(job, record)
    return _outcome(job, DONE, result, start_time)


def _compensated(job: Job, report_stage: ReportStage) -> dict[str, object]:
    from postproc.workflows.program import compensate

    return compensate(job.request, report_stage).as_json()


def _outcome(job: Job, state: str, result: dict[str, object], start_time: float) -> Outcome:
    return Outcome(job.name, state, result, time.monotonic() - start_time)
