"""``compensate diagnose``: the effects that a robot file misses."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import (
    Numbers,
    Out,
    page_option,
    picture_option,
    readings_options,
    require_suffix,
    residual_options,
    result_options,
)
from postproc.cli.decimal_option import Decimal


@click.command()
@readings_options
@click.option(
    "--next-poses",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.csv",
    callback=require_suffix(".csv"),
    help="If two explanations fit alike: write a plan of poses that distinguish them [beside NEW.yaml].",
)
@click.option(
    "--payload",
    type=Decimal(0.0, 1e5, min_open=True),
    metavar="KG",
    help="Heaviest weight that the next poses may hang [rated_payload of the robot file].",
)
@click.option(
    "--pulls",
    is_flag=True,
    help="The TCP can be pulled in any direction: the next poses may use forces as large as those measured.",
)
@click.option(
    "--validate",
    type=click.Path(path_type=Path, dir_okay=False),
    multiple=True,
    metavar="FILE.csv",
    help="Readings that are not diagnosed: the residuals of each file before and after. May be repeated.",
)
@picture_option("Draw the gap per pose before and after, residual patterns, and the evidence per candidate.")
@page_option
@residual_options
@result_options
def diagnose(
    data: tuple[Path, ...],
    robot: str | None,
    output: Path | None,
    tool: Numbers | None,
    next_poses: Path | None,
    payload: float | None,
    pulls: bool,
    validate: tuple[Path, ...],
    picture: Path | None,
    page: Path | None,
    csv_to: Path | None,
    strict: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Find where the robot file and the measurements in DATA (CSV) differ, and name the missing effect.

    The verdict is one of: nothing missing (the residual is scatter, or old parameters have changed); named; partly
    named (more is missing than can be named); ambiguous (several effects explain the readings alike: a plan of poses
    that distinguish them is written); unknown (an effect is missing, and it is none of the known ones). An effect is
    only named if it also reduces the residual on held-out poses and fits clearly better than any other. Effects that
    predict the same are ambiguous; the robot file is written where all of them give the same correction.

    Backlash and hysteresis depend on the side from which a joint came: state it in the columns DIR1, DIR2, ... (1, -1).

    \b
    Examples:
      compensate diagnose loads.csv
      compensate diagnose loads.csv --robot kuka_kr270 -o kr270_shop.yaml --picture why.png
      compensate diagnose loads.csv which.csv -o kr270_shop.yaml --json -

    Exit codes: 0 named, or nothing missing; 3 partly named, ambiguous or unknown, or something needs review; 1 failed,
    nothing was written; 2 wrong command line.
    """
    from postproc.report.diagnosed_terminal import show_diagnosed
    from postproc.workflows.diagnose import DiagnoseRequest, diagnose_robot

    out = Out(json_to, quiet, verbose)
    request = DiagnoseRequest(
        data=data,
        robot=robot,
        output=output,
        next_poses=next_poses,
        payload_kg=payload,
        pulls=pulls,
        validate=validate,
        tool_mm_deg=tool,
        picture=picture,
        page=page,
        csv=csv_to,
        json=out.json_file,
        strict=strict,
    )
    with out.refusals(), out.stages() as stage:
        done = diagnose_robot(request, stage)
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show_diagnosed(out.console(), done, verbose)
    raise SystemExit(done.exit)
