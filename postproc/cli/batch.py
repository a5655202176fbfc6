"""``compensate batch``: many programs."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from postproc.cli.common import (
    Out,
    RenamedOption,
    allow_compensated_option,
    many_programs_options,
    result_options,
)
from postproc.cli.signals import Stopped

if TYPE_CHECKING:
    from postproc.batching.batch import Watch
    from postproc.batching.job_file import Jobs
    from postproc.report.batched import Outcome


@click.command()
@click.argument("jobs", nargs=-1, metavar="JOBS...")
@many_programs_options
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Folder of the results; it repeats the folder structure of the programs [compensated/ beside JOBS].",
)
@allow_compensated_option
@click.option("--dry-run", is_flag=True, help="Do everything but write files; a FILE of --json is written.")
@click.option(
    "-j",
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Number of parallel processes [all cores].",
)
@click.option("--dask", metavar="ADDRESS", help="Run on the Dask cluster of this scheduler: tcp://host:8786.")
@click.option("--fail-fast", is_flag=True, help="Stop at the first program that fails.")
@click.option(
    "--rerun", cls=RenamedOption, is_flag=True, help="Compensate all programs, also those done and unchanged."
)
@click.option(
    "--allow-outside", is_flag=True, help="Allow a job file to name programs and outputs outside its folder."
)
@result_options
def batch(
    jobs: tuple[str, ...],
    force: str | None,
    tare: bool,
    robot: str | None,
    cell: Path | None,
    config_dat: Path | None,
    gain: float | None,
    output: Path | None,
    no_insert: bool,
    shared_points: str | None,
    strict: bool,
    allow_compensated: bool,
    dry_run: bool,
    workers: int | None,
    dask: str | None,
    fail_fast: bool,
    rerun: bool,
    allow_outside: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Compensate many programs: JOBS are a job file (YAML), or folders, files and patterns.

    Programs run in parallel; one that fails does not stop the others. A second run skips every program that is done and
    unchanged (program, cell, robot, forces, options, version, and the results themselves), so an interrupted or killed
    batch continues where it stopped. summary.html and summary.json are written to the folder of the results. Options
    of the command line override the job file.

    \b
    A job file (`compensate schema job` describes it):
      programs: [parts/*.src, "**/*.nc"]
      force: true                         # the forces that belong to each program
      output: out
      overrides:
        parts/door.src: {gain: 0.5, force: "0,360,560@base"}

    \b
    Examples:
      compensate batch night.yaml
      compensate batch parts --force -o out
      compensate batch "parts/**/*.src" --force=-60,0,120@feed -j 4
      compensate batch night.yaml --dask tcp://127.0.0.1:8786

    Exit codes, of the worst program: 0 done; 3 written, but not everything is corrected or something needs review; 1
    failed or not run; 2 wrong command line.
    """
    if not jobs:
        lost = force is not None and force.lower().endswith((".yaml", ".yml"))
        hint = f"; --force uses {force} as its value: write the programs before --force" if lost else ""
        raise click.UsageError(f"name a job file, a folder, or programs{hint}")
    if dask is not None and workers is not None:
        raise click.UsageError("--workers applies to this machine; a Dask cluster has its own workers")

    from postproc.batching.batch import BatchRequest, run_batch
    from postproc.batching.job_file import options_of_words
    from postproc.report.batched_terminal import show_batched

    options = options_of_words(
        force=force,
        robot=robot,
        cell=cell,
        config_dat=config_dat,
        gain=gain,
        tare=tare,
        no_insert=no_insert,
        shared_points=shared_points,
        strict=strict,
        allow_compensated=allow_compensated,
        dry_run=dry_run,
    )
    out = Out(json_to, quiet, verbose)
    request = BatchRequest(
        words=jobs,
        options=options,
        output=output,
        workers=workers,
        dask=dask,
        fail_fast=fail_fast,
        rerun=rerun,
        allow_outside=allow_outside,
        json=out.json_file,
    )
    try:
        with out.refusals(), _watched(out) as watch:
            done = run_batch(request, watch)
    except Stopped as end:
        end.words = (
            "the batch is interrupted; the finished programs remain: the same command continues from there"
        )
        raise
    out.result(done.as_json(), written=not dry_run)
    if not out.quiet:
        with contextlib.suppress(OSError):  # the terminal may be gone; what is written is written
            show_batched(out.console(), done, verbose)
        if dry_run:
            but = "" if out.json_file is None else f" but {out.json_file}"
            click.echo(f"this is a dry run: nothing is written{but}")
    raise SystemExit(done.exit)


@contextlib.contextmanager
def _watched(out: Out) -> Iterator[Watch | None]:
    """Progress on a terminal: how many, which are in work, how fast."""
    if out.quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.markup import escape
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from postproc.base.sanitize import sanitize
    from postproc.batching.batch import Watch

    columns = (
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    progress = Progress(*columns, console=out.console(error=True), transient=True)

    class ProgressBar(Watch):
        """A bar with the names of what is in work."""

        def __init__(self) -> None:
            self.at: dict[str, str] = {}
            self.motions, self.start_time = 0, time.monotonic()
            self.task = progress.add_task("", total=None, rate="")

        def started(self, jobs: Jobs) -> None:
            progress.update(self.task, total=len(jobs.jobs))

        def stage(self, name: str, stage: str) -> None:
            self.at[name] = stage
            self._show()

        def ended(self, outcome: Outcome) -> None:
            self.at.pop(outcome.name, None)
            self.motions += int(outcome.result.get("motions", 0)) if outcome.state == "done" else 0
            progress.advance(self.task)
            self._show()

        def _show(self) -> None:
            words = ", ".join(f"{escape(sanitize(name))}: {stage}" for name, stage in self.at.items())
            rate = self.motions / max(time.monotonic() - self.start_time, 1e-3)
            progress.update(
                self.task, description=words, rate=f"{rate:.0f} motions/s" if self.motions else ""
            )

    with progress:
        yield ProgressBar()
