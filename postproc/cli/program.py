"""``compensate PROGRAM``: the main job."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import Out, program_options


@click.command()
@program_options
@click.option(
    "--gain",
    type=click.FloatRange(0.0, 1.0),
    default=1.0,
    show_default=True,
    help="Share of the correction that is applied; first cuts are made with 0.5.",
)
@click.option(
    "-o",
    "--output",
    type=str,
    metavar="PATH",
    help="File or folder of the result [compensated/<same name>]. Another stem renames the module.",
)
@click.option(
    "--report", type=click.Path(path_type=Path), metavar="DIR", help="Folder of the reports [beside it]."
)
@click.option("--keep-points", is_flag=True, help="Insert no motion; what that leaves on the way is told.")
@click.option(
    "--own-points",
    type=click.Choice(["inline", "dat", "refuse"]),
    default="inline",
    show_default=True,
    help="A named point that serves several motions: each gets its own as numbers in its line, as a new point in the "
    ".dat, or none of them is moved.",
)
@click.option("--dry-run", is_flag=True, help="Do everything but write.")
@click.option("--again", is_flag=True, help="Compensate a program that is compensated already.")
def program(
    program: Path,
    force: str | None,
    force_offset: bool,
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
    keep_points: bool,
    own_points: str,
    dry_run: bool,
    again: bool,
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

    Exit codes: 0 done; 3 written, but something was left or deserves a look; 1 nothing written; 2 command line.
    """
    from postproc.report.terminal import show
    from postproc.workflows.preparation import Request
    from postproc.workflows.program import compensate

    target = None if output is None else Path(output)
    if target is not None and output is not None and output.endswith(("/", "\\")):
        target = target / program.name
    out = Out(json_to, quiet, verbose)
    with out.refusals(str(program)), out.stages() as stage:
        done = compensate(
            Request(
                program=program,
                force=force,
                force_offset=force_offset,
                cell=cell,
                robot=robot,
                gain=gain,
                output=target,
                report=report,
                strict=strict,
                dry_run=dry_run,
                again=again,
                json=out.json_file,
                keep_points=keep_points,
                own_points=own_points,
                config_dat=config_dat,
            ),
            stage,
        )
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show(out.console(), done, verbose)
        if dry_run:
            click.echo("dry run: nothing was written")
    raise SystemExit(done.exit)
