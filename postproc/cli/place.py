"""``compensate place``: where a part should lie."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from postproc.base.units import WHOLE_TURN
from postproc.cli.common import FAR, Out, number, page_option, picture_option, require_suffix, result_options
from postproc.cli.comparison_options import comparison_options
from postproc.cli.decimal_option import Decimal

Range = tuple[float, float]

TURNS = ("turn", "tool_turn")

_Command = TypeVar("_Command", bound=Callable[..., Any])


def _range(_context: click.Context, option: click.Parameter, text: str | None) -> Range | None:
    """``a:b`` or one value, in mm or deg."""
    if text is None:
        return None
    words = text.split(":")
    if len(words) > 2:
        raise click.BadParameter(f"{text[:40]!r} is neither one value nor a range a:b")
    limit = WHOLE_TURN if option.name in TURNS else FAR
    values = [number(word.strip(), limit) for word in words]
    if len(values) == 1:
        return values[0], values[0]
    low, high = values
    if not low < high:
        help = f"write {high:g}:{low:g}" if low > high else f"for one value write {low:g}"
        raise click.BadParameter(
            f"the range {text[:40]!r} has no width: {low:g} is not below {high:g}; {help}"
        )
    return low, high


def _range_option(name: str, about: str) -> Callable[[_Command], _Command]:
    return click.option(f"--{name}", metavar="A:B", callback=_range, help=about)


@click.command("place")
@click.argument("programs", nargs=-1, required=True, type=click.Path(path_type=Path))
@_range_option("x", "Range or one value of the base's origin in $WORLD, mm.")
@_range_option("y", "The same for y.")
@_range_option("z", "The same for z.")
@_range_option(
    "turn", "Turn of the part about the vertical through that origin, deg, against the present one."
)
@_range_option("tool-turn", "Turn of the tool about its spindle, deg, against the present one.")
@_range_option("track", "Range of the linear track that the cell puts in its place, mm.")
@comparison_options
@click.option(
    "--direction",
    type=Decimal(0.0, 90.0),
    metavar="DEG",
    help="Average the objective over force directions within this interval [force_ci95: direction_deg of the cell].",
)
@click.option("--top", type=click.IntRange(1, 100), default=10, show_default=True, help="Places to list.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="CELL.yaml",
    callback=require_suffix(".yaml", ".yml"),
    help="Write the cell file with the best place, comments kept [only report].",
)
@click.option(
    "--spin",
    is_flag=True,
    help="Turn the tool about its spindle along the path: state what it would bring. For rotating tools.",
)
@click.option(
    "--spin-output",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="With --spin: write the programs with other A, B, C into this folder, if it is worth it.",
)
@picture_option("Draw the objective over x and y, with the present and the best place.")
@page_option
@result_options
def place(
    programs: tuple[Path, ...],
    force: str | None,
    x: Range | None,
    y: Range | None,
    z: Range | None,
    turn: Range | None,
    tool_turn: Range | None,
    track: Range | None,
    objective: str,
    direction: float | None,
    limit_margin: float,
    singularity_margin: float,
    top: int,
    collisions: Path | None,
    robot: str | None,
    cell: Path | None,
    config_dat: Path | None,
    tare: bool,
    output: Path | None,
    spin: bool,
    spin_output: Path | None,
    picture: Path | None,
    page: Path | None,
    strict: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Find where a part should lie: where PROGRAMS deflect the robot least, before any correction.

    No byte of the programs changes: the base moves in the cell file (`bases`), and the tool frame turns (`tools`);
    --spin-output alone writes programs. The ranges of `room:` in the cell hold where no option states one.
    Collisions are checked where shapes are known (--collisions), else not, and the result says so.

    \b
    Examples:
      compensate place panel.src --force --x 850:1650 --y 50:850
      compensate place panel.src --force --x 850:1650 --y 50:850 --z 600:1000 --turn=-90:90 -o placed.yaml
      compensate place first.src second.src --force --x 850:1650 --tool-turn=-180:180 --page place.html
      compensate place panel.src --force --spin --spin-output turned

    Exit codes: 0 done; 3 something needs review; 1 failed, no place is feasible; 2 wrong command line.
    """
    from postproc.report.placement import show_placement
    from postproc.workflows.place import place as run
    from postproc.workflows.place_problem import PlaceRequest

    out = Out(json_to, quiet, verbose)
    stated = {"x": x, "y": y, "z": z, "turn": turn, "tool_turn": tool_turn, "track": track}
    request = PlaceRequest(
        programs=programs,
        force=force,
        ranges={name: ends for name, ends in stated.items() if ends is not None},
        objective=objective,
        direction=direction,
        limit_margin=limit_margin,
        singularity_margin=singularity_margin,
        top=top,
        cell=cell,
        robot=robot,
        collisions=collisions,
        config_dat=config_dat,
        tare=tare,
        output=output,
        spin=spin,
        spin_output=spin_output,
        picture=picture,
        page=page,
        json=out.json_file,
        strict=strict,
    )
    with out.refusals(str(programs[0])), out.stages() as stage:
        done = run(request, stage)
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show_placement(out.console(), done, verbose)
    raise SystemExit(done.exit)
