"""``compensate engage``: what a program cuts of its stock, and with which force."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import ROBOT, Out, language_options, require_suffix, result_options


@click.command()
@click.argument("program", type=click.Path(path_type=Path))
@click.option(
    "--process",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.yaml",
    help="Process file with `stock:` and `tools:` [the cell's].",
)
@click.option("--robot", type=ROBOT, metavar="NAME|FILE", help="Use this robot instead of the cell's.")
@language_options
@click.option(
    "--csv",
    "csv_to",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.csv",
    callback=require_suffix(".csv"),
    help="Engagement and force of every motion, one row each.",
)
@click.option(
    "--stock-out",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.stock",
    callback=require_suffix(".stock"),
    help="What the program leaves of the blank, for the next program: stock: {from: FILE.stock}.",
)
@click.option("--strict", is_flag=True, help="Treat warnings as errors: then nothing is written.")
@result_options
def engage(
    program: Path,
    process: Path | None,
    robot: str | None,
    cell: Path | None,
    config_dat: Path | None,
    csv_to: Path | None,
    stock_out: Path | None,
    strict: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Report what PROGRAM cuts of its stock: engagement, force, removed volume and collisions of each motion.

    Blank and tools are in the process file: `stock:` and `tools:`.

    \b
    Examples:
      compensate engage part.ngc
      compensate engage part.ngc --process milling.yaml --csv part.engage.csv
      compensate engage first.ngc --stock-out first.stock

    Exit codes: 0 done; 3 collisions, or something needs review; 1 failed; 2 wrong command line.
    """
    from postproc.report.engaged import show_engaged
    from postproc.workflows.engage import EngageRequest
    from postproc.workflows.engage import engage as run

    out = Out(json_to, quiet, verbose)
    request = EngageRequest(
        program=program,
        process=process,
        cell=cell,
        robot=robot,
        config_dat=config_dat,
        csv=csv_to,
        stock_out=stock_out,
        json=out.json_file,
        strict=strict,
    )
    with out.refusals(str(program)), out.stages() as stage:
        done = run(request, stage)
    out.result(done.as_json(), written=done.exit != 1)
    if not out.quiet:
        show_engaged(out.console(), done, verbose)
    raise SystemExit(done.exit)
