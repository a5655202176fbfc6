"""``compensate diagnose``: what a robot file misses, by its name."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import Numbers, Out, ending, page_option, readings_options, result_options


@click.command()
@readings_options
@click.option(
    "--next-poses",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.csv",
    callback=ending(".csv"),
    help="Where two explanations fit alike: a plan of poses that tell them apart [beside NEW.yaml].",
)
@click.option(
    "--picture",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.png|svg",
    callback=ending(".png", ".svg"),
    help="Draw the gap per pose before and after, what betrays the effect, and the evidence per candidate.",
)
@page_option
@click.option(
    "--csv",
    "csv_to",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.csv",
    callback=ending(".csv"),
    help="What is left of every reading, one row each.",
)
@click.option("--strict", is_flag=True, help="Warnings count as errors: then nothing is written.")
@result_options
def diagnose(
    data: tuple[Path, ...],
    robot: str | None,
    output: Path | None,
    tool: Numbers | None,
    next_poses: Path | None,
    picture: Path | None,
    page: Path | None,
    csv_to: Path | None,
    strict: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Find where the robot file and the measurements in DATA (CSV) disagree, and name the effect that is missing.

    The verdict is one of: nothing missing (what is left is scatter, or old parameters have moved); named; partly named
    (more is missing than could be named); ambiguous (several effects explain the readings alike: a plan of poses that
    tell them apart is made); unknown (something is missing, and it is no effect that is known). A name is only given
    for what also holds on poses that were left out, and fits clearly better than anything else.

    \b
    Examples:
      compensate diagnose loads.csv
      compensate diagnose loads.csv --robot kuka_kr270 -o kr270_shop.yaml --picture why.png
      compensate diagnose loads.csv which.csv -o kr270_shop.yaml --json -

    Exit codes: 0 named, or nothing is missing; 3 partly named, ambiguous or unknown, or something deserves a look; 1
    could not, nothing was written; 2 command line.
    """
    from postproc.report.diagnosed_terminal import show_diagnosed
    from postproc.workflows.diagnose import DiagnoseRequest, diagnose_robot

    out = Out(json_to, quiet, verbose)
    request = DiagnoseRequest(
        data=data,
        robot=robot,
        output=output,
        next_poses=next_poses,
        tool_mm_deg=tool,
        picture=picture,
        page=page,
        csv=csv_to,
        json=out.json_file,
        strict=strict,
    )
    with out.refusals("diagnose"), out.stages() as stage:
        done = diagnose_robot(request, stage)
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show_diagnosed(out.console(), done, verbose)
    raise SystemExit(done.exit)
