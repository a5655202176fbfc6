"""Options that several commands share, and how every command ends."""

from __future__ import annotations

import contextlib
import json
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from postproc.findings import Finding, Refusal

_Command = TypeVar("_Command", bound=Callable[..., Any])


def _json_name(_context: click.Context, _option: click.Parameter, value: str | None) -> str | None:
    """A file of another kind is never overwritten by a result."""
    if value is None or value == "-" or value.lower().endswith(".json"):
        return value
    raise click.BadParameter(f"{value!r} must end in .json, or be - for standard output")


def program_options(command: _Command) -> _Command:
    """PROGRAM and what predicts it."""
    for decorate in reversed(
        (
            click.argument("program", type=click.Path(path_type=Path)),
            click.option(
                "--force",
                metavar="[SPEC]",
                default=None,
                help="Machining force. Alone: FORCE comments, <stem>.force.csv, or `force:` of the cell, whichever "
                "comes first. With a value: 0,360,560@base (world, tool, feed; six numbers with moments), or a CSV.",
            ),
            click.option("--robot", metavar="NAME|FILE", help="Robot instead of the cell's."),
            click.option(
                "--cell", type=click.Path(path_type=Path), help="Cell file instead of the nearest cell.yaml."
            ),
            click.option("--strict", is_flag=True, help="Warnings count as errors."),
        )
    ):
        command = decorate(command)
    return result_options(command)


def result_options(command: _Command) -> _Command:
    """How the result is shown."""
    for decorate in reversed(
        (
            click.option(
                "--json",
                "json_to",
                metavar="PATH|-",
                callback=_json_name,
                help="Machine-readable result, into a .json file; - is standard output.",
            ),
            click.option("-q", "--quiet", is_flag=True, help="Only errors."),
            click.option("-v", "--verbose", is_flag=True, help="With every finding, what to do."),
        )
    ):
        command = decorate(command)
    return command


class Out:
    """Standard output of one command, in words or as JSON."""

    def __init__(self, json_to: str | None, quiet: bool, verbose: bool) -> None:
        self.json_to = json_to
        self.quiet = quiet or json_to == "-"
        self.verbose = verbose

    def console(self, error: bool = False) -> Any:
        from rich.console import Console

        stream = sys.stderr if error else sys.stdout
        width = None if stream.isatty() else 160
        return Console(file=stream, width=width, highlight=False)

    @property
    def json_file(self) -> Path | None:
        """The file that the machine-readable result goes to, if it is one."""
        return Path(self.json_to) if self.json_to not in (None, "-") else None

    def result(self, result: dict[str, object], written: bool = False) -> None:
        """Write the machine-readable result where it was asked for; ``written``: the file has it already."""
        if self.json_to is None or (written and self.json_to != "-"):
            return
        text = json.dumps(result, indent=2, allow_nan=False) + "\n"
        if self.json_to == "-":
            click.echo(text, nl=False)
            return
        from postproc.publish import publish

        publish({Path(self.json_to): text.encode()})

    @contextlib.contextmanager
    def stages(self) -> Iterator[Callable[[str], None]]:
        """A function that names the stage at hand; shown on a terminal once the work takes over a second."""
        if self.quiet or not sys.stderr.isatty():
            yield lambda name: None
            return
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
        progress = Progress(*columns, console=self.console(error=True), transient=True)
        task = progress.add_task("reading")
        timer = threading.Timer(1.0, progress.start)
        timer.daemon = True
        timer.start()
        try:
            yield lambda name: progress.update(task, description=name)
        finally:
            timer.cancel()
            progress.stop()

    @contextlib.contextmanager
    def refusals(self, program: str) -> Iterator[None]:
        """Turn a Refusal into findings on standard error and exit code 1."""
        try:
            yield
        except Refusal as refusal:
            self.refused(program, refusal.findings)

    def refused(self, program: str, findings: Sequence[Finding]) -> None:
        from postproc.report.report import failure
        from postproc.report.terminal import show_findings

        with contextlib.suppress(Refusal):
            self.result(failure(program, findings))
        console = self.console(error=True)
        show_findings(console, findings)
        console.print("nothing was written" if program else "")
        raise SystemExit(1)
