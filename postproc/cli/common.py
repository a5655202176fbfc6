"""Options that several commands share, and how every command ends."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from postproc.findings import Finding, Refusal

_Command = TypeVar("_Command", bound=Callable[..., Any])


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
                "--json", "json_to", metavar="PATH|-", help="Machine-readable result; - is standard output."
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

    def result(self, result: dict[str, object]) -> None:
        """Write the machine-readable result where it was asked for."""
        if self.json_to is None:
            return
        text = json.dumps(result, indent=2, allow_nan=False) + "\n"
        if self.json_to == "-":
            click.echo(text, nl=False)
            return
        from postproc.publish import publish

        publish({Path(self.json_to): text.encode()})

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
