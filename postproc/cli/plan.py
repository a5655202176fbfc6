"""``compensate plan``: the poses and loads worth measuring."""

from __future__ import annotations

import math
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
    require_suffix,
    result_options,
    tool_place,
)
from postproc.cli.decimal_option import Decimal
from postproc.cli.identify import split_words

MOST = 200
"""Largest number of poses of a plan."""

Range = tuple[float, float]


def _loads(_context: click.Context, _option: click.Parameter, texts: tuple[str, ...]) -> Numbers:
    """``kg,kg``, of all times that the option is given; none below zero."""
    loads = tuple(number(word.strip(), FAR) for text in texts if text for word in text.split(","))
    if any(load < 0 for load in loads):
        raise click.BadParameter("a weight cannot be below zero")
    return loads


def _targets(
    context: click.Context, option: click.Parameter, texts: tuple[str, ...]
) -> tuple[tuple[str, Numbers], ...]:
    """``NAME=x,y,z``, each name once."""
    places: dict[str, Numbers] = {}
    for text in texts:
        name, equals, place = (part.strip() for part in text.partition("="))
        if not equals or not name or any(sign in name for sign in ',;"#:'):
            raise click.BadParameter(f"{text[:40]!r} is not NAME=x,y,z")
        if name.casefold() in map(str.casefold, places):
            raise click.BadParameter(f"{name!r} occurs twice")
        places[name] = numbers((3,), "x,y,z")(context, option, place)
    return tuple(places.items())


def _wishes(_context: click.Context, _option: click.Parameter, texts: tuple[str, ...]) -> tuple[str, ...]:
    """``NAME=VALUE`` or ``VALUE``, each name once."""
    names = [text.partition("=")[0].strip() if "=" in text else "" for text in texts]
    for name in names:
        if names.count(name) > 1:
            raise click.BadParameter(f"{name!r} occurs twice" if name else "a value for all occurs twice")
    return texts


def _place(context: click.Context, option: click.Parameter, text: str | None) -> Numbers | None:
    return None if text is None else numbers((3,), "x,y,z")(context, option, text)


def _ends(text: str) -> Range:
    """``a:b``, either end may be left open."""
    low, colon, high = (part.strip() for part in text.partition(":"))
    ends = (number(low, FAR) if low else -math.inf), (number(high, FAR) if high else math.inf)
    if not colon or not ends[0] < ends[1]:
        raise click.BadParameter(f"{text[:40]!r} is not an ascending range a:b")
    return ends


def _box(_context: click.Context, _option: click.Parameter, text: str) -> tuple[Range, ...]:
    ranges = tuple(_ends(part) for part in text.split(","))
    if len(ranges) != 3:
        raise click.BadParameter(
            f"{len(ranges)} ranges are given where x0:x1,y0:y1,z0:z1 is needed; an end may be open as in :,:,0:"
        )
    return ranges


def _limits(
    _context: click.Context, _option: click.Parameter, texts: tuple[str, ...]
) -> tuple[tuple[str, Range], ...]:
    """``A2=-140:-20``, each joint once."""
    ranges: dict[str, Range] = {}
    for text in texts:
        name, equals, ends = (part.strip() for part in text.partition("="))
        if not equals or not name:
            raise click.BadParameter(f"{text[:40]!r} is not JOINT=a:b")
        if name.casefold() in map(str.casefold, ranges):
            raise click.BadParameter(f"{name!r} occurs twice")
        ranges[name] = _ends(ends)
    return tuple(ranges.items())


def _pair(context: click.Context, option: click.Parameter, text: str | None) -> tuple[str, ...] | None:
    """Two different names."""
    if text is None:
        return None
    words = split_words(context, option, (text,))
    if len(words) != 2:
        raise click.BadParameter(f"{text[:40]!r} is not two effects: a,b")
    return words


@click.command()
@click.option("--robot", type=ROBOT, required=True, metavar="NAME|FILE", help="The robot.")
@click.option(
    "--effects",
    required=True,
    metavar="EFFECT[.PARAMETER],...",
    multiple=True,
    callback=split_words,
    help="Effects to identify, or single parameters of them.",
)
@click.option("--poses", required=True, type=click.IntRange(1, MOST), help="Number of poses of the plan.")
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="PLAN.csv",
    callback=require_suffix(".csv"),
    help="The plan: a file to fill in with readings, then the input of `identify`.",
)
@click.option(
    "--loads",
    metavar="KG,KG",
    multiple=True,
    callback=_loads,
    help="Loads that can be hung at the TCP; all of them at every pose [absolute: none].",
)
@click.option("--one-load", is_flag=True, help="Use one load per pose, the most informative one.")
@click.option(
    "--tool",
    metavar="X,Y,Z[,A,B,C]",
    default="0,0,0",
    callback=tool_place,
    help="TCP on the flange, mm and deg, where the load hangs; off the last axis, to load it too [the flange].",
)
@click.option(
    "--target",
    "targets",
    metavar="NAME=X,Y,Z",
    multiple=True,
    callback=_targets,
    help="A reflector and its position on the flange, mm; repeat the option for several [the TCP is measured].",
)
@click.option(
    "--rough-targets",
    is_flag=True,
    help="The positions of the reflectors are approximate; `identify` has to find them.",
)
@click.option(
    "--kind",
    type=click.Choice(["deflection", "absolute"]),
    help="What is measured: loaded minus unloaded, or positions by a tracker [deflection for effects of load].",
)
@click.option(
    "--sigma",
    type=Decimal(0.0, 100.0, min_open=True),
    default=0.03,
    show_default=True,
    metavar="MM",
    help="Scatter of each measured coordinate (of the difference, for deflections), one sigma.",
)
@click.option(
    "--criterion",
    type=click.Choice(["minimax", "d", "test"]),
    help="Worst ratio of an interval to the wanted one; D-optimal; error at the cuts of --test [test with --test, else "
    "minimax].",
)
@click.option(
    "--wanted",
    metavar="[NAME=]VALUE",
    multiple=True,
    callback=_wishes,
    help="Wanted half width of the 95 % interval: c2=1%, s0=20mm, or 2% for all [those of the robot file].",
)
@click.option(
    "--test",
    "test_program",
    type=click.Path(path_type=Path),
    metavar="PROGRAM",
    help="A program whose error at the cuts is to be small. With its cell and its forces, as in the main job.",
)
@click.option("--force", metavar="[SPEC]", help="Machining force of --test [the forces that belong to it].")
@click.option(
    "--cell",
    type=click.Path(path_type=Path),
    help="Use this cell for --test instead of the nearest cell.yaml.",
)
@click.option(
    "--tracker",
    metavar="X,Y,Z",
    callback=_place,
    help="Position of the tracker in the robot base, mm; only visible reflectors are planned [all are visible].",
)
@click.option(
    "--cone",
    type=Decimal(0.0, 180.0, min_open=True),
    metavar="DEG",
    help="A reflector is visible to --tracker within this angle of its axis, which points away from the flange's axis "
    "[60].",
)
@click.option(
    "--box",
    metavar="X0:X1,Y0:Y1,Z0:Z1",
    default=":,:,0:",
    show_default=True,
    callback=_box,
    help="Allowed space of TCP, flange and reflectors, mm, robot base; ends may be open.",
)
@click.option(
    "--limits",
    metavar="JOINT=A:B",
    multiple=True,
    callback=_limits,
    help="Narrower range of an axis, deg or mm; repeat the option for several [the robot file's, less 1 deg].",
)
@click.option(
    "--spacing",
    type=Decimal(0.0, 90.0),
    default=5.0,
    show_default=True,
    metavar="DEG",
    help="Smallest difference of two poses in their most different axis.",
)
@click.option(
    "--measured",
    type=click.Path(path_type=Path),
    metavar="DATA.csv",
    multiple=True,
    help="Existing readings to include; with the tool of --tool where they state none. Repeat the option for several "
    "files.",
)
@click.option(
    "--discriminate",
    metavar="A,B",
    callback=_pair,
    help="Choose poses that distinguish these two effects, each fitted together with --effects.",
)
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    default=1,
    show_default=True,
    help="Seed of the random poses.",
)
@page_option
@result_options
def plan(
    robot: str,
    effects: tuple[str, ...],
    poses: int,
    output: Path,
    loads: Numbers,
    one_load: bool,
    tool: Numbers,
    targets: tuple[tuple[str, Numbers], ...],
    rough_targets: bool,
    kind: str | None,
    sigma: float,
    criterion: str | None,
    wanted: tuple[str, ...],
    test_program: Path | None,
    force: str | None,
    cell: Path | None,
    tracker: Numbers | None,
    cone: float | None,
    box: tuple[Range, ...],
    limits: tuple[tuple[str, Range], ...],
    spacing: float,
    measured: tuple[Path, ...],
    discriminate: tuple[str, str] | None,
    seed: int,
    page: Path | None,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Plan which poses and loads to measure, so that `identify` finds the parameters of EFFECTS precisely.

    Poses are within the axis limits, the box and the view of the tracker. The result predicts the 95 % intervals that
    `identify` will state, for 10, 15, 20, 30 and the wanted number of poses and for random poses, and lists parameters
    that are not observable, and why. Collisions are not checked.

    \b
    Examples:
      compensate plan --robot kuka_kr270 --effects joint_compliance,gravity_compensator --poses 15 --loads 265
          --tool 0,500,300 --target M1=300,0,100 --target M2=-150,260,100 --target M3=-150,-260,100 -o plan.csv
      compensate plan --robot ur5 --effects joint_offset,link_geometry --poses 40 --target T=0,60,80 --rough-targets
          --tracker 2500,0,800 -o poses.csv
      compensate plan --robot kuka_kr270 --effects joint_compliance --discriminate gravity_compensator,link_compliance
          --poses 6 --loads 265 --tool 0,500,300 -o which.csv

    Exit codes: 0 done; 3 done, but a requested parameter is not observable; 1 failed; 2 wrong command line.
    """
    from postproc.report.planned import show_plan
    from postproc.workflows.plan import plan as run
    from postproc.workflows.plan_setups import CONE, PlanRequest

    if criterion == "test" and test_program is None:
        raise click.BadParameter("needs a program: --test PROGRAM", param_hint="--criterion test")
    if test_program is None and (force is not None or cell is not None):
        option = "--cell" if force is None else "--force"
        raise click.BadParameter("belongs to a program: --test PROGRAM", param_hint=option)
    if rough_targets and not targets:
        raise click.BadParameter("needs --target NAME=x,y,z, at least roughly", param_hint="--rough-targets")
    if cone is not None and tracker is None:
        raise click.BadParameter("needs --tracker X,Y,Z, from where reflectors are seen", param_hint="--cone")
    if one_load and len(loads) < 2:
        raise click.BadParameter("needs several --loads to choose from", param_hint="--one-load")
    if discriminate is not None and (criterion or test_program or measured):
        raise click.BadParameter("excludes --criterion, --test and --measured", param_hint="--discriminate")

    out = Out(json_to, quiet, verbose)
    request = PlanRequest(
        robot=robot,
        effects=effects,
        poses=poses,
        output=output,
        loads=loads,
        one_load=one_load,
        tool_mm_deg=tool,
        targets=targets,
        rough_targets=rough_targets,
        kind=kind,
        sigma_mm=sigma,
        criterion=criterion,
        wanted=wanted,
        program=test_program,
        force=force or "",
        cell=cell,
        tracker_mm=tracker,
        cone_deg=CONE if cone is None else cone,
        box_mm=box,
        limits=limits,
        spacing_deg=spacing,
        measured=measured,
        discriminate=discriminate,
        seed=seed,
        json=out.json_file,
        page=page,
    )
    with out.refusals(), out.stages() as stage:
        done = run(request, stage)
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show_plan(out.console(), done, verbose)
    raise SystemExit(done.exit)
