"""``compensate PROGRAM``: the main job."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

import click

from postproc.cli.common import Out, allow_compensated_option, insertion_options, program_options
from postproc.cli.decimal_option import Decimal
from postproc.workflows.option_names import SHARED_POINTS


@click.command()
@program_options
@click.option(
    "--gain",
    type=Decimal(0.0, 1.0),
    default=1.0,
    show_default=True,
    help="Share of the correction that is applied; make first cuts with 0.5.",
)
@click.option(
    "-o",
    "--output",
    type=str,
    metavar="PATH",
    help="File or folder of the result [compensated/<same name>]. Another stem renames the module.",
)
@click.option(
    "--report",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder of the reports [beside the result].",
)
@click.option(
    "--stdin-name",
    metavar="NAME",
    help="With PROGRAM -: the path of the program that is read from standard input; its cell, .dat and forces are"
    " searched there.",
)
@insertion_options
@click.option("--dry-run", is_flag=True, help="Do everything but write files; a FILE of --json is written.")
@allow_compensated_option
def program(
    program: Path,
    force: str | None,
    tare: bool,
    robot: str | None,
    cell: Path | None,
    config_dat: Path | None,
    strict: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
    gain: float,
    output: str | None,
    report: Path | None,
    stdin_name: str | None,
    no_insert: bool,
    shared_points: str | None,
    dry_run: bool,
    allow_compensated: bool,
) -> None:
    """Compensate PROGRAM for the deflection of the robot (the default command).

    Writes compensated/<same name> beside the input, with a report, the corrections of every motion, and a diff.
    The input is never touched.

    \b
    Examples:
      compensate panel.src --force
      compensate panel.src --force 0,360,560@base --cell cell.yaml -o out/panel.src
      compensate panel.src --force panel.force.csv --gain 0.5 --json -
      compensate panel.src --force milling.yaml
      compensate - -o - --stdin-name parts/panel.src --force < panel.src > out.src

    Exit codes: 0 done; 3 written, but not everything is corrected or something needs review; 1 nothing was written; 2
    wrong command line.
    """
    from postproc.base.input_files import provided
    from postproc.cli.streams import write_bytes
    from postproc.workflows.preparation import Request
    from postproc.workflows.program import compensate

    streamed = output == "-"
    if streamed and json_to == "-":
        raise click.UsageError("standard output can take either the program or the JSON result")
    if (str(program) == "-") != (stdin_name is not None):
        raise click.UsageError(
            "PROGRAM - needs its name: --stdin-name panel.src"
            if stdin_name is None
            else "--stdin-name needs PROGRAM -, which is read from standard input"
        )
    given: dict[Path, bytes] = {}
    if stdin_name is not None:
        program = Path(stdin_name)
        given[program] = sys.stdin.buffer.read()
    target = None if output is None or streamed else Path(output)
    if target is not None and output is not None and output.endswith(("/", "\\")):
        target = target / program.name
    taken: list[bytes] = []
    out = Out(json_to, quiet, verbose, to_error=streamed)
    with provided(given), out.refusals(str(program)), out.stages() as stage:
        done = compensate(
            Request(
                program=program,
                force=force,
                tare=tare,
                cell=cell,
                robot=robot,
                gain=gain,
                output=target,
                report=report,
                strict=strict,
                dry_run=dry_run,
                allow_compensated=allow_compensated,
                json=out.json_file,
                no_insert=no_insert,
                shared_points=shared_points or SHARED_POINTS[0],
                config_dat=config_dat,
                stream=taken.append if streamed else None,
            ),
            stage,
        )
    for content in taken:
        write_bytes(content)
    out.result(done.as_json(), written=True)
    if not out.quiet:
        from postproc.report.terminal import show

        with contextlib.suppress(OSError):  # the terminal may be gone; what is written is written
            show(out.console(), done, verbose)
        if dry_run:
            but = "" if out.json_file is None else f" but {out.json_file}"
            click.echo(f"this is a dry run: nothing is written{but}", err=streamed)
    raise SystemExit(done.exit)
