"""``compensate verify``: is the tool on the path, all along it."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import ROBOT, Out, language_options, page_option, result_options, tare_option
from postproc.cli.decimal_option import Decimal


@click.command()
@click.argument("original", type=click.Path(path_type=Path))
@click.argument("compensated", type=click.Path(path_type=Path))
@click.option(
    "--force", metavar="[SPEC]", default=None, help="Machining force on the original, as for the main job."
)
@tare_option
@click.option("--robot", type=ROBOT, metavar="NAME|FILE", help="Use this robot instead of the cell's.")
@language_options
@click.option(
    "--step",
    type=Decimal(0.01, 1000.0),
    default=4.0,
    show_default=True,
    metavar="MM",
    help="Distance of the first samples along the path; samples are doubled until the errors no longer change.",
)
@click.option("--strict", is_flag=True, help="Treat warnings as errors.")
@page_option
@result_options
def verify(
    original: Path,
    compensated: Path,
    force: str | None,
    tare: bool,
    robot: str | None,
    cell: Path | None,
    config_dat: Path | None,
    step: float,
    strict: bool,
    page: Path | None,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Simulate ORIGINAL and COMPENSATED along their paths as the controller interpolates them, and report the errors.

    Both files are read and sampled until twice as many samples no longer change the errors.  The force on the tool is
    that at the nearest point of the original's path.  Other differences are reported: statements and words of motions,
    stops, backward motions, missing points, frames, feeds, external axes, points in air; and a mark whose digests are
    not those of ORIGINAL and of the robot.

    \b
    Examples:
      compensate verify panel.src compensated/panel.src --force
      compensate verify part.ngc compensated/part.ngc --force 0,360,560@base --step 0.5 --json -

    Exit codes: 0 within the tolerances and no other difference; 3 above a tolerance, another difference, or an error
    that could not be computed; 1 not the same program; 2 wrong command line.
    """
    from postproc.base.units import MM
    from postproc.report.verified import show
    from postproc.workflows.preparation import Request
    from postproc.workflows.verify import verify as run

    out = Out(json_to, quiet, verbose)
    request = Request(
        program=original,
        force=force,
        tare=tare,
        cell=cell,
        robot=robot,
        strict=strict,
        json=out.json_file,
        config_dat=config_dat,
    )
    with out.refusals(str(original)), out.stages() as stage:
        done = run(request, compensated, step * MM, stage, page)
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show(out.console(), done, verbose)
        if page is not None:
            click.echo(f"wrote {page}")
    raise SystemExit(done.exit)
