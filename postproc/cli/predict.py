"""``compensate predict``: the deflection at every pose."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import Out, program_options


@click.command()
@program_options
@click.option(
    "--report",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write <stem>.deflection.csv, <stem>.prediction.json and <stem>.prediction.html to this folder.",
)
def predict(
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
    report: Path | None,
) -> None:
    """Predict how far the tool is off at every pose of PROGRAM; no program is written.

    \b
    Examples:
      compensate predict panel.src --force
      compensate predict panel.src --force 0,360,560 --report reports

    Exit codes: 0 done; 3 something needs review; 1 failed; 2 wrong command line.
    """
    from postproc.report.terminal import show
    from postproc.workflows.preparation import Request
    from postproc.workflows.program import predict as run

    out = Out(json_to, quiet, verbose)
    request = Request(
        program=program,
        force=force,
        tare=tare,
        cell=cell,
        config_dat=config_dat,
        robot=robot,
        report=report,
        strict=strict,
        json=out.json_file,
    )
    with out.refusals(str(program)), out.stages() as stage:
        done = run(request, stage)
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show(out.console(), done, verbose)
    raise SystemExit(done.exit)
