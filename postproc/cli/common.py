"""Options that several commands share, and how every command ends."""

from __future__ import annotations

import contextlib
import json
import math
import re
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click
from click.shell_completion import CompletionItem

from postproc.findings import Finding, Refusal

_Command = TypeVar("_Command", bound=Callable[..., Any])

_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?\Z")

FAR = 100_000.0
"""[mm] No arm is longer."""

Numbers = tuple[float, ...]


class _RobotName(click.ParamType):
    """The name of a robot, or a robot file; a shell completes both."""

    name = "robot"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from postproc.robot.description import robot_files

        names = [CompletionItem(name) for name in robot_files() if name.startswith(incomplete)]
        return [*names, CompletionItem(incomplete, type="file")]


ROBOT = _RobotName()


def number(word: str, limit: float) -> float:
    """The number that ``word`` is, at most ``limit`` in size."""
    if not _NUMBER.match(word) or not math.isfinite(float(word)):
        raise click.BadParameter(f"{word[:40]!r} is not a number")
    if abs(float(word)) > limit:
        raise click.BadParameter(f"{word[:40]} is beyond {limit:g}")
    return float(word)


def numbers(counts: tuple[int, ...], names: str) -> Callable[[click.Context, click.Parameter, str], Numbers]:
    """Numbers between commas, as many as one of ``counts``."""

    def parse(_context: click.Context, _option: click.Parameter, text: str) -> Numbers:
        values = tuple(number(word.strip(), FAR) for word in text.split(","))
        if len(values) not in counts:
            raise click.BadParameter(f"{len(values)} numbers where {names} is needed")
        return values

    return parse


def tool_place(context: click.Context, option: click.Parameter, text: str | None) -> Numbers | None:
    """``x,y,z[,a,b,c]``, mm and deg; None where it is not given."""
    if text is None:
        return None
    place = numbers((3, 6), "x,y,z or x,y,z,a,b,c")(context, option, text)
    return (*place, 0.0, 0.0, 0.0)[:6]


def ending(*endings: str) -> Callable[[click.Context, click.Parameter, Path | None], Path | None]:
    """A file of another kind is never overwritten by a result."""

    def check(_context: click.Context, _option: click.Parameter, path: Path | None) -> Path | None:
        if path is not None and path.suffix.lower() not in endings:
            raise click.BadParameter(f"{str(path)!r} must end in {' or '.join(endings)}")
        return path

    return check


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
                help="Machining force. Alone: FORCE comments, <stem>.force.csv, or `force:` or `process:` of the cell, "
                "whichever comes first. With a value: 0,360,560@base (world, tool, feed; six numbers with moments), a "
                "CSV (by line, s_mm or t_s), or the YAML of a cutting process.",
            ),
            click.option(
                "--force-offset",
                is_flag=True,
                help="Take the mean of the force CSV in air off all its readings.",
            ),
            click.option("--robot", type=ROBOT, metavar="NAME|FILE", help="Robot instead of the cell's."),
            language_options,
            click.option("--strict", is_flag=True, help="Warnings count as errors."),
        )
    ):
        command = decorate(command)
    return result_options(command)


def language_options(command: _Command) -> _Command:
    """What a program does not say of itself."""
    for decorate in reversed(
        (
            click.option(
                "--cell", type=click.Path(path_type=Path), help="Cell file instead of the nearest cell.yaml."
            ),
            click.option(
                "--config-dat",
                type=click.Path(path_type=Path),
                metavar="FILE",
                help="The controller's $config.dat, for points and frames that stand there [the cell's].",
            ),
        )
    ):
        command = decorate(command)
    return command


def readings_options(command: _Command) -> _Command:
    """DATA, of which robot and tool they are, and the robot file that comes out."""
    for decorate in reversed(
        (
            click.argument("data", type=click.Path(path_type=Path), nargs=-1, required=True),
            click.option(
                "--robot",
                type=ROBOT,
                metavar="NAME|FILE",
                help="The robot [the one that the data name: # robot: NAME].",
            ),
            click.option(
                "-o",
                "--output",
                type=click.Path(path_type=Path, dir_okay=False),
                metavar="NEW.yaml",
                callback=ending(".yaml", ".yml"),
                help="Write the robot file with what was found; without it there is only the report.",
            ),
            click.option(
                "--tool",
                metavar="X,Y,Z[,A,B,C]",
                callback=tool_place,
                help="TCP on the flange, mm and deg, where the data do not state it (# tool: x y z) [the flange].",
            ),
        )
    ):
        command = decorate(command)
    return command


def page_option(command: _Command) -> _Command:
    """The result as a page."""
    return click.option(
        "--page",
        type=click.Path(path_type=Path, dir_okay=False),
        metavar="FILE.html",
        callback=ending(".html"),
        help="All of it as one page for a browser; needs no network.",
    )(command)


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
        from postproc.cli.console import SafeConsole

        return SafeConsole(sys.stderr if error else sys.stdout)

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
