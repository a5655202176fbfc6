"""``compensate verify``: is the tool on the path, all along it."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import ROBOT, Out, language_options, result_options


@click.command()
@click.argument("original", type=click.Path(path_type=Path))
@click.argument("compensated", type=click.Path(path_type=Path))
@click.option(
    "--force", metavar="[SPEC]", default=None, help="Machining force of the original, as for the main job."
)
@click.option(
    "--force-offset", is_flag=True, help="Take the offset that a force log shows in air off its forces."
)
@click.option("--robot", type=ROBOT, metavar="NAME|FILE", help="Robot instead of the cell's.")
@language_options
@click.option(
    "--step",
    type=click.FloatRange(0.01, 1000.0),
    default=1.0,
    show_default=True,
    metavar="MM",
    help="Distance of the samples along the path; each motion has five at least.",
)
@click.option("--strict", is_flag=True, help="Warnings count as errors.")
@result_options
def verify(
    original: Path,
    compensated: Path,
    force: str | None,
    force_offset: bool,
    robot: str | None,
    cell: Path | None,
    config_dat: Path | None,
    step: float,
    strict: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Simulate ORIGINAL and what was made of it along their interpolated paths, and tell the path error of each.

    Both are read from their files and sampled densely; the force at each place is that of the original's path there.

    \b
    Examples:
      compensate verify panel.src compensated/panel.src --force
      compensate verify part.ngc compensated/part.ngc --force 0,360,560@base --step 0.5 --json -

    Exit codes: 0 within the tolerance; 3 above it, or something could not be simulated; 1 not the same program.
    """
    from postproc.report.verified import show
    from postproc.units import MM
    from postproc.workflows.preparation import Request
    from postproc.workflows.verify import verify as run

    out = Out(json_to, quiet, verbose)
    request = Request(
        program=original,
        force=force,
        force_offset=force_offset,
        cell=cell,
        robot=robot,
        strict=strict,
        json=out.json_file,
        config_dat=config_dat,
    )
    with out.refusals(str(original)), out.stages() as stage:
        done = run(request, compensated, step * MM, stage)
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show(out.console(), done, verbose)
    raise SystemExit(done.exit)
