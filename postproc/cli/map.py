"""``compensate map``: the deflection over a plane or a box of the workspace."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.cli.common import (
    FAR,
    ROBOT,
    Numbers,
    Out,
    number,
    numbers,
    page_option,
    picture_option,
    require_suffix,
    result_options,
)


def _range(_context: click.Context, _option: click.Parameter, text: str) -> Numbers:
    """``a:b`` or one value, mm."""
    values = tuple(number(word.strip(), FAR) for word in text.split(":"))
    if len(values) > 2:
        raise click.BadParameter(f"{text[:40]!r} is neither one value nor a range a:b")
    if len(values) == 2 and not values[0] < values[1]:
        raise click.BadParameter(
            f"the range {text[:40]!r} must ascend: {values[0]:g} is not below {values[1]:g}"
        )
    return values


@click.command("map")
@click.option("--robot", type=ROBOT, required=True, metavar="NAME|FILE", help="The robot.")
@click.option(
    "--x", required=True, metavar="A:B", callback=_range, help="Range or one value, mm, robot base."
)
@click.option("--y", required=True, metavar="A:B", callback=_range, help="The same for y.")
@click.option("--z", required=True, metavar="A:B", callback=_range, help="The same for z.")
@click.option(
    "--grid",
    type=click.IntRange(1, 1_000_000),
    default=21,
    show_default=True,
    help="Points along each range; 1 is its middle.",
)
@click.option(
    "--tool",
    metavar="X,Y,Z[,A,B,C]",
    default="0,0,0",
    callback=numbers((3, 6), "x,y,z or x,y,z,a,b,c"),
    help="TCP on the flange, mm and deg [the flange].",
)
@click.option(
    "--orientation",
    metavar="A,B,C",
    default="0,0,180",
    show_default=True,
    callback=numbers((3,), "A,B,C"),
    help="Orientation of the tool in the robot base, deg.",
)
@click.option(
    "--force",
    required=True,
    metavar="SPEC",
    help="Force on the tool at the TCP: 0,360,560@base (or world, which is the same here; or tool), N; six numbers "
    "with moments in N m.",
)
@click.option(
    "--linear",
    is_flag=True,
    help="Use the linear model, eq. (5), instead of the equilibrium on the deflected pose.",
)
@click.option(
    "--sign",
    type=click.Choice(["energy", "as_printed"]),
    help="Reading of eq. (3) of the gravity compensator [that of the robot file].",
)
@click.option("--ignore-limits", is_flag=True, help="Count cells beyond the axis limits as reached.")
@click.option(
    "--status",
    type=click.IntRange(0, 7),
    help="KUKA Status (S) of the arm, the sum of 1 wrist overhead, 2 elbow up, 4 A5 below zero [2].",
)
@picture_option("Draw the map; for a box, slices along z.")
@page_option
@click.option(
    "--csv",
    "csv_to",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.csv",
    callback=require_suffix(".csv"),
    help="Write one row per cell.",
)
@result_options
def map_(
    robot: str,
    x: Numbers,
    y: Numbers,
    z: Numbers,
    grid: int,
    tool: Numbers,
    orientation: Numbers,
    force: str,
    linear: bool,
    sign: str | None,
    ignore_limits: bool,
    status: int | None,
    picture: Path | None,
    page: Path | None,
    csv_to: Path | None,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Map the deflection by a force over the workspace, and how much the gravity compensator changes it.

    Two ranges give a plane, three a box, one a line; the deflection is that of the force alone, loaded minus unloaded.

    \b
    Examples:
      compensate map --robot kuka_kr270 --x 800:2200 --y=-1000:1000 --z 500 --tool 0,0,300 --force=-360,0,560
      compensate map --robot kuka_kr270 --x 800:2200 --y 0 --z 200:1800 --force 0,0,-500@tool --picture map.png
      compensate map --robot kuka_kr270 --x 800:2200 --y=-900:900 --z 300:1500 --grid 15 --force 300,0,0 --csv box.csv

    Exit codes: 0 done; 3 nothing in reach, or something needs review; 1 failed; 2 wrong command line.
    """
    from postproc.placement.workspace_map import MAX_CELLS
    from postproc.process.stated_forces import FEED, FORM, FRAMES, NotAForce, parse_force
    from postproc.report.mapped import show_map
    from postproc.workflows.map import MapRequest, map_workspace

    try:
        wrench, frame = parse_force(force)
    except NotAForce as error:
        raise click.BadParameter(f"{error}; a map accepts {FORM}", param_hint="--force") from None
    if frame == FEED:
        raise click.BadParameter(
            "a map has no feed direction: give the force @base or @tool", param_hint="--force"
        )
    if not any(wrench):
        raise click.BadParameter("a force of zero deflects nothing", param_hint="--force")
    ranged = sum(len(values) == 2 for values in (x, y, z))
    if grid**ranged > MAX_CELLS:
        raise click.BadParameter(
            f"{grid} points along {ranged} ranges make {grid**ranged:.3g} cells, more than the limit of {MAX_CELLS}",
            param_hint="--grid",
        )
    if picture is not None and (ranged == 0 or grid == 1):
        raise click.BadParameter("a single cell cannot be drawn", param_hint="--picture")

    out = Out(json_to, quiet, verbose)
    request = MapRequest(
        robot=robot,
        ranges_mm=(x, y, z),
        points=grid,
        tool_mm_deg=(*tool, 0.0, 0.0, 0.0)[:6],
        orientation_deg=orientation,
        wrench=wrench,
        frame=FRAMES[frame],
        linear=linear,
        sign=sign,
        ignore_limits=ignore_limits,
        status=status,
        picture=picture,
        page=page,
        csv=csv_to,
        json=out.json_file,
    )
    with out.refusals(), out.stages() as stage:
        done = map_workspace(request, stage)
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show_map(out.console(), done, verbose)
    raise SystemExit(done.exit)
