"""Options that several commands share, and how every command ends."""

from __future__ import annotations

import contextlib
import copy
import json
import math
import re
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click
from click.shell_completion import CompletionItem
from click.types import StringParamType

from postproc.base.findings import Finding, Refusal
from postproc.cli.decimal_option import Decimal
from postproc.workflows.option_names import SHARED_POINTS, former_names_of, present_value

_Command = TypeVar("_Command", bound=Callable[..., Any])

_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?\Z")

FAR = 100_000.0
"""[mm] No arm is longer."""

Numbers = tuple[float, ...]


class _RobotName(StringParamType):
    """The name of a robot, or a robot file; a shell completes both."""

    name = "robot"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from postproc.robot.description import robot_files

        names = [CompletionItem(name) for name in robot_files() if name.startswith(incomplete)]
        return [*names, CompletionItem(incomplete, type="file")]


ROBOT = _RobotName()


FORMER_NAMES = "postproc.former_names"
"""Key of a context's ``meta``: notes on former names that the command line uses."""


class RenamedOption(click.Option):
    """An option that is also taken under its former names and with its former values (``FORMER_OPTIONS``); help and
    completion show the present ones only."""

    @property
    def _former(self) -> dict[str, str]:
        """Former option as it is typed -> the key of its value in what the parser gives."""
        return {
            f"--{name.replace('_', '-')}": f"{name} (former)" for name in former_names_of(self.name or "")
        }

    def add_to_parser(self, parser: Any, ctx: click.Context) -> None:
        super().add_to_parser(parser, ctx)
        for word, key in self._former.items():
            former = copy.copy(self)
            former.opts, former.name = [word], key
            click.Option.add_to_parser(former, parser, ctx)

    def consume_value(self, ctx: click.Context, opts: Mapping[str, Any]) -> tuple[Any, Any]:
        """The value, under whichever name it is given.  Raises BadParameter where both are."""
        value, source = super().consume_value(ctx, opts)
        for word, key in self._former.items():
            if key not in opts:
                continue
            if self.name in opts:
                raise click.BadParameter(
                    f"is the former name of {self.opts[0]}, which is given too", param_hint=word
                )
            value, source = opts[key], click.core.ParameterSource.COMMANDLINE
            ctx.meta.setdefault(FORMER_NAMES, []).append(f"{word} is now called {self.opts[0]}")
        present = present_value(self.name or "", value)
        if present is not value:
            ctx.meta.setdefault(FORMER_NAMES, []).append(f"{self.opts[0]} {value} is now called {present}")
        return present, source


def number(word: str, limit: float) -> float:
    """The number that ``word`` is, at most ``limit`` in size.  Raises BadParameter."""
    if "," in word and _NUMBER.match(word.replace(",", ".", 1)):
        raise click.BadParameter(f"{word[:40]!r} has a decimal comma; write {word.replace(',', '.', 1)}")
    if not _NUMBER.match(word) or not math.isfinite(float(word)):
        raise click.BadParameter(f"{word[:40]!r} is not a number")
    if abs(float(word)) > limit:
        raise click.BadParameter(f"{word[:40]} exceeds {limit:g}")
    return float(word)


def numbers(counts: tuple[int, ...], names: str) -> Callable[[click.Context, click.Parameter, str], Numbers]:
    """Numbers between commas, as many as one of ``counts``."""

    def parse(_context: click.Context, _option: click.Parameter, text: str) -> Numbers:
        values = tuple(number(word.strip(), FAR) for word in text.split(","))
        if len(values) not in counts:
            raise click.BadParameter(f"{len(values)} numbers are given where {names} is needed")
        return values

    return parse


def tool_place(context: click.Context, option: click.Parameter, text: str | None) -> Numbers | None:
    """``x,y,z[,a,b,c]``, mm and deg; None where it is not given."""
    if text is None:
        return None
    place = numbers((3, 6), "x,y,z or x,y,z,a,b,c")(context, option, text)
    return (*place, 0.0, 0.0, 0.0)[:6]


def require_suffix(*endings: str) -> Callable[[click.Context, click.Parameter, Path | None], Path | None]:
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


def with_options(command: _Command, *options: Callable[[_Command], _Command]) -> _Command:
    """A command with these options, the first of which its help shows first."""
    for decorate in reversed(options):
        command = decorate(command)
    return command


def tare_option(command: _Command) -> _Command:
    """The zero of a measured force."""
    return click.option(
        "--tare",
        cls=RenamedOption,
        is_flag=True,
        help="Subtract the mean force in air from all readings of the force CSV.",
    )(command)


def insertion_options(command: _Command) -> _Command:
    """What the output may hold that the input does not: inserted motions and copies of points."""
    return with_options(
        command,
        click.option(
            "--no-insert",
            cls=RenamedOption,
            is_flag=True,
            help="Insert no motions; the path error that remains between the points is reported.",
        ),
        click.option(
            "--shared-points",
            cls=RenamedOption,
            type=click.Choice(SHARED_POINTS),
            help="What happens to a named point that several motions use: each motion gets a copy in its own line, "
            "or as a new point in the .dat, or the point is kept and these motions are not corrected "
            f"[{SHARED_POINTS[0]}].",
        ),
    )


def many_programs_options(command: _Command) -> _Command:
    """What predicts and corrects each of many programs."""
    return with_options(
        command,
        click.option(
            "--force",
            metavar="[SPEC]",
            default=None,
            help="Machining force of every program. Without a value: the forces that belong to each program; with "
            "a value: 0,360,560@base or a CSV, as in the main job.",
        ),
        tare_option,
        click.option(
            "--robot", type=ROBOT, metavar="NAME|FILE", help="Use this robot instead of the cells'."
        ),
        language_options,
        click.option("--gain", type=Decimal(0.0, 1.0), help="Share of the correction that is applied [1]."),
        insertion_options,
        click.option("--strict", is_flag=True, help="Treat warnings as errors."),
    )


def allow_compensated_option(command: _Command) -> _Command:
    """Whether a program may be compensated twice."""
    return click.option(
        "--allow-compensated",
        cls=RenamedOption,
        is_flag=True,
        help="Accept a program that carries the mark of an earlier compensation.",
    )(command)


def program_options(command: _Command) -> _Command:
    """PROGRAM and what predicts it."""
    return with_options(
        result_options(command),
        click.argument("program", type=click.Path(path_type=Path)),
        click.option(
            "--force",
            metavar="[SPEC]",
            default=None,
            help="Machining force. Without a value: FORCE comments, <stem>.force.csv, or `force:` or `process:` "
            "of the cell, whichever comes first. With a value: 0,360,560@base (world, tool, feed; six numbers "
            "with moments), a CSV (by line, s_mm or t_s), or the YAML file of a cutting process.",
        ),
        tare_option,
        click.option(
            "--robot", type=ROBOT, metavar="NAME|FILE", help="Use this robot instead of the cell's."
        ),
        language_options,
        click.option("--strict", is_flag=True, help="Treat warnings as errors."),
    )


def language_options(command: _Command) -> _Command:
    """What a program does not state itself."""
    return with_options(
        command,
        click.option(
            "--cell",
            type=click.Path(path_type=Path),
            help="Use this cell file instead of the nearest cell.yaml.",
        ),
        click.option(
            "--config-dat",
            type=click.Path(path_type=Path),
            metavar="FILE",
            help="The controller's $config.dat, for points and frames defined there [the cell's].",
        ),
    )


def readings_options(command: _Command) -> _Command:
    """DATA, their robot and tool, and the new robot file."""
    return with_options(
        command,
        click.argument("data", type=click.Path(path_type=Path), nargs=-1, required=True),
        click.option(
            "--robot",
            type=ROBOT,
            metavar="NAME|FILE",
            help="Robot [the one named in the data: # robot: NAME].",
        ),
        click.option(
            "-o",
            "--output",
            type=click.Path(path_type=Path, dir_okay=False),
            metavar="NEW.yaml",
            callback=require_suffix(".yaml", ".yml"),
            help="Write a new robot file with the identified values [only report].",
        ),
        click.option(
            "--tool",
            metavar="X,Y,Z[,A,B,C]",
            callback=tool_place,
            help="TCP on the flange, mm and deg, if the data do not state it (# tool: x y z) [the flange].",
        ),
    )


def picture_option(help: str) -> Callable[[_Command], _Command]:
    """The result as a picture."""
    return click.option(
        "--picture",
        type=click.Path(path_type=Path, dir_okay=False),
        metavar="FILE.png|svg",
        callback=require_suffix(".png", ".svg"),
        help=help,
    )


def page_option(command: _Command) -> _Command:
    """The result as a page."""
    return click.option(
        "--page",
        type=click.Path(path_type=Path, dir_okay=False),
        metavar="FILE.html",
        callback=require_suffix(".html"),
        help="Write the result as one HTML page that needs no network.",
    )(command)


def residual_options(command: _Command) -> _Command:
    """The residual of every reading as a table, and how warnings count."""
    return with_options(
        command,
        click.option(
            "--csv",
            "csv_to",
            type=click.Path(path_type=Path, dir_okay=False),
            metavar="FILE.csv",
            callback=require_suffix(".csv"),
            help="The residual of every reading, one row each.",
        ),
        click.option("--strict", is_flag=True, help="Warnings count as errors: then nothing is written."),
    )


def result_options(command: _Command) -> _Command:
    """How the result is shown."""
    return with_options(
        command,
        click.option(
            "--json",
            "json_to",
            metavar="PATH|-",
            callback=_json_name,
            help="Write the machine-readable result to a .json file; - is standard output.",
        ),
        click.option("-q", "--quiet", is_flag=True, help="Print errors only."),
        click.option(
            "-v",
            "--verbose",
            is_flag=True,
            help="Print with every finding what to do, and long lists in full.",
        ),
    )


class Out:
    """Standard output of one command, in words or as JSON; ``to_error``: standard output takes the program itself, and
    words go to standard error."""

    def __init__(self, json_to: str | None, quiet: bool, verbose: bool, to_error: bool = False) -> None:
        self.json_to = json_to
        self.to_error = to_error
        self.quiet = quiet or json_to == "-"
        self.verbose = verbose
        context = click.get_current_context()
        self.command = context.command.name or ""
        for note in () if self.quiet else context.meta.get(FORMER_NAMES, ()):
            click.echo(f"note: {note}", err=True)

    def console(self, error: bool = False) -> Any:
        from postproc.cli.console import SafeConsole

        return SafeConsole(sys.stderr if error or self.to_error else sys.stdout)

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
        from postproc.output.atomic_write import write_atomically

        write_atomically({Path(self.json_to): text.encode()})

    @contextlib.contextmanager
    def stages(self) -> Iterator[Callable[[str], None]]:
        """A function that names the current stage; shown on a terminal once the work takes over a second."""
        if self.quiet or not sys.stderr.isatty():
            yield lambda name: None
            return
        current = ["reading"]
        shown: list[Any] = []

        def show() -> None:
            from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

            columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
            progress = Progress(*columns, console=self.console(error=True), transient=True)
            progress.add_task(current[0])
            shown.append(progress)
            progress.start()

        def name_stage(name: str) -> None:
            current[0] = name
            for progress in shown:
                progress.update(progress.task_ids[0], description=name)

        timer = threading.Timer(1.0, show)
        timer.daemon = True
        timer.start()
        try:
            yield name_stage
        finally:
            timer.cancel()
            timer.join()  # it may be about to show
            with contextlib.suppress(OSError):  # the terminal may be gone
                for progress in shown:
                    progress.stop()

    @contextlib.contextmanager
    def refusals(self, program: str = "", writes: bool = True) -> Iterator[None]:
        """Turn a Refusal into findings on standard error and exit code 1.  program: that the command is about; writes:
        whether the command writes files."""
        try:
            yield
        except Refusal as refusal:
            self.refused(program, refusal.findings, writes)

    def refused(self, program: str, findings: Sequence[Finding], writes: bool) -> None:
        """Shows the findings of a refusal and writes them as the result.  Raises SystemExit with exit code 1."""
        from postproc.report.report import failure
        from postproc.report.terminal import show_findings

        with contextlib.suppress(Refusal):
            self.result(failure(self.command, program, findings))
        console = self.console(error=True)
        show_findings(console, findings)
        if writes:
            console.print("nothing is written")
        raise SystemExit(1)
