"""``compensate learn``: from a measured part to causes and a better next program."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import Out, insertion_options, page_option, program_options, require_suffix
from postproc.cli.decimal_option import Decimal
from postproc.learning.deviation_signs import SIGNS


@click.command()
@program_options
@insertion_options
@click.argument("measured", type=click.Path(path_type=Path), nargs=-1, required=True)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Folder of the next program, the new robot file, force factors and tool errors [learned/ beside PROGRAM].",
)
@click.option(
    "--gain",
    type=Decimal(0.0, 1.0),
    default=1.0,
    help="Share of what was learnt that the next program applies [1].",
)
@click.option(
    "--history",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.json",
    callback=require_suffix(".json"),
    help="Record of the parts of earlier runs, which count too [<stem>.parts.json beside the cell].",
)
@click.option(
    "--new-history",
    is_flag=True,
    help="Replace that record: only the parts that are named count.",
)
@click.option(
    "--positive",
    type=click.Choice(SIGNS),
    help="State again what a positive DEV of MEASURED is, where neither the points show it nor a line `# checked:` or"
    " measured places (LRN020).",
)
@click.option(
    "--known-force",
    type=Decimal(0.002, 1.0),
    metavar="SHARE",
    help="Half width of the 95 % interval of all forces, as a gauge showed it: 0.1 for 10 % [the cell's].",
)
@click.option(
    "--push",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.csv",
    help="Push test: joint values, FX,FY,FZ at the tool centre point and its displacement DX,DY,DZ, as `identify` reads"
    " them; it separates compliances from forces.",
)
@click.option(
    "--csv",
    "csv_to",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.csv",
    callback=require_suffix(".csv"),
    help="Measured, explained and remaining deviation of every point, one row each.",
)
@page_option
@click.option(
    "--plan",
    "plan_points",
    type=click.IntRange(6, 500),
    metavar="N",
    help="Choose the N most informative points of one file, in which DEV may be missing, and write them to --csv"
    " [<stem>.measure.csv beside the file].",
)
@click.option("--dry-run", is_flag=True, help="Report only, write nothing.")
def learn(
    program: Path,
    measured: tuple[Path, ...],
    force: str | None,
    tare: bool,
    robot: str | None,
    cell: Path | None,
    config_dat: Path | None,
    no_insert: bool,
    shared_points: str | None,
    output: Path | None,
    gain: float,
    history: Path | None,
    new_history: bool,
    positive: str | None,
    known_force: float | None,
    push: Path | None,
    csv_to: Path | None,
    page: Path | None,
    plan_points: int | None,
    dry_run: bool,
    strict: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Learn from MEASURED, deviations of parts that PROGRAM cut: their causes, and a better next program.

    Parts of earlier runs count too: they are in a record beside the cell, and programs that were written are kept under
    cut/ beside the next one.

    PROGRAM is the original, not the compensated one. MEASURED are CSVs with the columns X,Y,Z,NX,NY,NZ,DEV (nominal
    point and outward normal in $BASE, mm) and the comments positive, alignment, cut_with, sha256 and sigma_mm.  Where
    the points do not show the sign of DEV, a second look at the part does: checked (or columns MX,MY,MZ).

    \b
    Examples:
      compensate learn panel.src part1.csv
      compensate learn panel.src part2.csv            (and the parts of the runs before)
      compensate learn panel.src part1.csv part2.csv --new-history -o next
      compensate learn panel.src points.csv --plan 30 --csv measure.csv
      compensate learn panel.src part1.csv --known-force 0.1 --page part1.html

    Exit codes: 0 done; 3 done, and something needs review; 1 failed, nothing written; 2 wrong command line.
    """
    from postproc.report.learned_terminal import show_learned
    from postproc.workflows.learn import LearnRequest
    from postproc.workflows.learn import learn as run
    from postproc.workflows.preparation import Request

    out = Out(json_to, quiet, verbose)
    request = LearnRequest(
        main=Request(
            program=program,
            force="" if force is None else force,
            cell=cell,
            robot=robot,
            strict=strict,
            no_insert=no_insert,
            shared_points=shared_points or "copy-inline",
            config_dat=config_dat,
            tare=tare,
        ),
        measured=measured,
        known_force=known_force,
        push=push,
        output=output,
        gain=gain,
        history=history,
        new_history=new_history,
        positive=positive or "",
        csv=csv_to,
        page=page,
        json=out.json_file,
        strict=strict,
        dry_run=dry_run,
    )
    if plan_points is not None:
        if json_to is not None or dry_run or output is not None or page is not None:
            raise click.UsageError(
                "--plan writes --csv only, and excludes --json, --output, --page and --dry-run"
            )
        from postproc.workflows.learn_plan import plan

        with out.refusals(str(program)), out.stages() as stage:
            chosen = plan(request, plan_points, stage)
        if not out.quiet:
            click.echo(
                f"{chosen.points} of {chosen.offered} points: the errors of the surface may be"
                f" {chosen.before_mm:.3f} mm RMS before they are measured, {chosen.after_mm:.3f} mm after"
            )
            click.echo(f"wrote {chosen.path}; DEV and the comments above the header are to be filled in")
        return
    with out.refusals(str(program)), out.stages() as stage:
        done = run(request, stage)
    out.result(done.as_json(), written=done.exit != 1 and not dry_run)
    if not out.quiet:
        show_learned(out.console(), done, verbose)
    raise SystemExit(done.exit)
