"""``compensate assign``: which part of a batch lies where."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import FAR, Out, number, result_options
from postproc.cli.comparison_options import comparison_options

Place = tuple[float, float, float, float]


def _places(_context: click.Context, _option: click.Parameter, texts: tuple[str, ...]) -> dict[str, Place]:
    """``NAME=x,y,z`` or ``NAME=x,y,z,turn`` in mm and deg."""
    found: dict[str, Place] = {}
    for text in texts:
        name, equals, values = text.partition("=")
        name, words = name.strip(), [word.strip() for word in values.split(",")]
        if not equals or not name or len(words) not in (3, 4):
            raise click.BadParameter(f"{text[:40]!r} is no place NAME=x,y,z or NAME=x,y,z,turn")
        if name in found:
            raise click.BadParameter(f"the place {name[:40]!r} is stated twice")
        x, y, z, turn = *(number(word, FAR) for word in words[:3]), number((*words, "0")[3], 360.0)
        found[name] = (x, y, z, turn)
    return found


@click.command("assign")
@click.argument("programs", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--at",
    "places",
    multiple=True,
    required=True,
    callback=_places,
    metavar="NAME=X,Y,Z[,TURN]",
    help="A place: origin of the base in $WORLD, mm, and turn about the vertical through it, deg, against the "
    "present. Once for each place.",
)
@comparison_options
@click.option(
    "--cells",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Write a cell file for each part that has a place, PROGRAM.cell.yaml [only report].",
)
@result_options
def assign(
    programs: tuple[Path, ...],
    force: str | None,
    places: dict[str, Place],
    objective: str,
    limit_margin: float,
    singularity_margin: float,
    collisions: Path | None,
    robot: str | None,
    cell: Path | None,
    config_dat: Path | None,
    tare: bool,
    cells: Path | None,
    strict: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Find which part lies where: each of PROGRAMS is a part, and each --at a place for one of them.

    Every part is predicted at every place, as the main job would; as many parts as possible get a feasible place, and
    the sum of their objectives is the least. Pairs that are not feasible are reported with motion and limit. Collisions
    are checked where shapes are known (--collisions), else not, and the result says so.

    \b
    Examples:
      compensate assign a.src b.src --force --at front=1250,450,800 --at back=1250,-450,800,180
      compensate assign a.src b.src c.src --force --at 1=1250,450,800 --at 2=1500,0,700 --cells placed

    Exit codes: 0 done; 3 a part has no place; 1 failed, no part has one; 2 wrong command line.
    """
    from postproc.report.assignment import show_assignment
    from postproc.workflows.place_parts import AssignRequest
    from postproc.workflows.place_parts import assign as run
    from postproc.workflows.place_problem import PlaceRequest

    out = Out(json_to, quiet, verbose)
    common = PlaceRequest(
        programs=programs,
        force=force,
        objective=objective,
        limit_margin=limit_margin,
        singularity_margin=singularity_margin,
        cell=cell,
        robot=robot,
        collisions=collisions,
        config_dat=config_dat,
        tare=tare,
        json=out.json_file,
        strict=strict,
    )
    with out.refusals(str(programs[0])), out.stages() as stage:
        done = run(AssignRequest(common, places, cells), stage)
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show_assignment(out.console(), done, verbose)
    raise SystemExit(done.exit)
