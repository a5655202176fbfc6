"""``compensate watch``: a hot folder."""

from __future__ import annotations

import contextlib
import json
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import click

from postproc.cli.common import Out, many_programs_options, result_options
from postproc.cli.decimal_option import Decimal
from postproc.cli.signals import SIGNALS, Stopped

if TYPE_CHECKING:
    from postproc.report.batched import Outcome

POLL = 0.5
"""[s] Between two looks at the folder."""


@click.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@many_programs_options
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Folder of the results [compensated/ in FOLDER].",
)
@click.option(
    "--settle",
    type=Decimal(0.0, 3600.0),
    default=2.0,
    show_default=True,
    metavar="S",
    help="A program is complete when it has not changed for so long.",
)
@click.option("--once", is_flag=True, help="Stop when no program is waiting any more.")
@result_options
def watch(
    folder: Path,
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
    settle: float,
    once: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Compensate every program that arrives in FOLDER, once, when it has stopped growing.

    The result and its reports go to compensated/; the program itself moves to done/ with its .dat and forces, or to
    failed/ with a report that states why. Killed and started again, it continues where it stopped. Stop it with Ctrl-C.
    With --json - every program is one line of JSON.

    \b
    Examples:
      compensate watch /srv/cam/outbox --force
      compensate watch outbox --force -o /srv/robot/inbox --settle 5
      compensate watch outbox --force --once --json -

    Exit codes: with --once that of the worst program, as of `batch`; 1 failed; 2 wrong command line; 128 + the number
    of the signal that stops it.
    """
    from postproc.batching.hot_folder import HotFolder
    from postproc.batching.job_file import options_of_words, refuse_unusable
    from postproc.report.batched import RANKS
    from postproc.report.result_keys import complete_result

    if json_to not in (None, "-"):
        raise click.UsageError("--json accepts only - here: one line is written for each program")
    if not folder.is_dir():
        raise click.UsageError(
            f"the folder {str(folder)!r} does not exist: create it, and let the CAM system export to it"
        )
    out = Out(json_to, quiet, verbose)
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
    )
    with out.refusals():
        refuse_unusable(options)
    worst = 0

    def listen(outcome: Outcome) -> None:
        nonlocal worst
        worst = max(worst, outcome.exit, key=RANKS.index)
        if json_to == "-":
            click.echo(json.dumps(complete_result("watch", outcome.as_json())))
        elif not out.quiet:
            click.echo(f"{time.strftime('%H:%M:%S')} {_line(outcome)}")

    def postpone(outcome: Outcome) -> None:
        click.echo(f"{time.strftime('%H:%M:%S')} {_line(outcome)}; it stays, and is tried again", err=True)

    hot = HotFolder(folder.absolute(), None if output is None else output.absolute(), options, settle)
    with (
        out.refusals(),
        _interruptible(),
        hot.exclusive(lambda: click.echo("another run watches this folder", err=True)),
    ):
        if not out.quiet:
            click.echo(f"watching {folder}; results go to {hot.results}", err=True)
        while True:
            moved = hot.step(listen, postpone=postpone)
            if once and not moved and not hot.waiting():
                break
            if not moved:
                time.sleep(POLL)
    raise SystemExit(worst)


def _line(outcome: Outcome) -> str:
    """``panel.src done: within tolerance; 3.056 mm before, 0.0008 mm after``"""
    before, after = outcome.figure("error_before_mm"), outcome.figure("error_after_mm")
    figures = "" if before is None or after is None else f"; {before:.3f} mm before, {after:.4f} mm after"
    gravest = outcome.gravest
    why = "" if gravest is None else f"; {gravest.code} {gravest.message}"
    verdict = "" if outcome.verdict == "-" else f": {outcome.verdict}"
    return f"{outcome.name} {outcome.state}{verdict}{figures}{why}"


@contextlib.contextmanager
def _interruptible() -> Iterator[None]:
    """A signal stops the watch at once, whatever was written before: all that it does can be continued."""

    def stop(number: int, _frame: FrameType | None) -> None:
        end = Stopped(128 + number)
        end.words = "the watch is stopped; the same command continues from here"
        raise end

    heard = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, stop) for number in heard}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
