"""``compensate identify``: parameters of effects from measurements."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from postproc.cli.common import (
    Numbers,
    Out,
    page_option,
    picture_option,
    readings_options,
    residual_options,
    result_options,
)

FEWEST_DRAWS = 20
"""Fewer draws do not determine an interval."""


def split_words(_context: click.Context, _option: click.Parameter, texts: tuple[str, ...]) -> tuple[str, ...]:
    """``a,b.c`` as its words, of all times that the option is given.  Raises BadParameter for an empty word and for one
    that comes twice."""
    text = ",".join(texts)
    words = tuple(word.strip() for word in text.split(","))
    if not all(words):
        raise click.BadParameter(f"{text[:40]!r} contains an empty name; write effect,effect.parameter")
    if len(set(words)) < len(words):
        raise click.BadParameter(f"{text[:40]!r} names an effect twice")
    return words


def _none_or(least: int) -> Callable[[click.Context, click.Parameter, int | None], int | None]:
    """A number that is 0 or not below ``least``."""

    def check(_context: click.Context, _option: click.Parameter, number: int | None) -> int | None:
        if number is not None and 0 < number < least:
            raise click.BadParameter(f"{number} is too few: use {least} or more, or 0 for none")
        return number

    return check


@click.command()
@click.option(
    "--effects",
    required=True,
    metavar="EFFECT[.PARAMETER],...",
    multiple=True,
    callback=split_words,
    help="Effects to identify, or single parameters of them. An effect that the robot file does not have is added.",
)
@readings_options
@click.option(
    "--priors",
    is_flag=True,
    help="Use every interval of the robot file as prior information, not only those of dimensions of hardware.",
)
@click.option("--robust", is_flag=True, help="Reduce the weight of outliers (Huber).")
@click.option("--drop-outliers", is_flag=True, help="Exclude outliers from the fit.")
@click.option(
    "--validate",
    type=click.Path(path_type=Path),
    metavar="OTHER.csv",
    multiple=True,
    help="Readings that are predicted but not fitted; repeat the option for several files.",
)
@click.option(
    "--folds",
    type=click.IntRange(0, 1000),
    default=5,
    show_default=True,
    callback=_none_or(2),
    help="Number of folds of the cross-validation on held-out poses; 0 skips it.",
)
@click.option(
    "--bootstrap",
    type=click.IntRange(0, 100_000),
    metavar="N",
    callback=_none_or(FEWEST_DRAWS),
    help="Check the intervals with so many bootstrap draws; 0 skips it [200 for few poses].",
)
@picture_option("Draw the residuals by joint, direction, load and order.")
@page_option
@residual_options
@result_options
def identify(
    data: tuple[Path, ...],
    effects: tuple[str, ...],
    robot: str | None,
    output: Path | None,
    tool: Numbers | None,
    priors: bool,
    robust: bool,
    drop_outliers: bool,
    validate: tuple[Path, ...],
    folds: int,
    bootstrap: int | None,
    picture: Path | None,
    page: Path | None,
    csv_to: Path | None,
    strict: bool,
    json_to: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Identify parameters of effects from the measurements in DATA (CSV), with 95 % intervals.

    Parameters that the readings do not determine keep their values and are listed: those without influence, those that
    only show as a sum, and those that the position of the tracker imitates. Every fit includes the positions of tracker
    and targets where they are not stated. Residuals are reported for the fitted readings and for held-out poses.

    \b
    Examples:
      compensate identify loads.csv --effects joint_compliance,gravity_compensator -o kr270_shop.yaml
      compensate identify poses.csv --robot ur5 --effects joint_offset,link_geometry --validate later.csv
      compensate identify loads.csv --effects gravity_compensator.K_c --picture fit.png --csv residuals.csv --json -

    Exit codes: 0 all parameters identified; 3 done, but not all identified or something needs review (outliers, bounds,
    no improvement on held-out poses); 1 failed, nothing was written; 2 wrong command line.
    """
    from postproc.report.identified_terminal import show_identified
    from postproc.workflows.identify import IdentifyRequest
    from postproc.workflows.identify import identify as run

    out = Out(json_to, quiet, verbose)
    request = IdentifyRequest(
        data=data,
        robot=robot,
        effects=effects,
        output=output,
        priors=priors,
        robust=robust,
        drop_outliers=drop_outliers,
        validate=validate,
        folds=folds,
        bootstrap=bootstrap,
        tool_mm_deg=tool,
        picture=picture,
        page=page,
        csv=csv_to,
        json=out.json_file,
        strict=strict,
    )
    with out.refusals(), out.stages() as stage:
        done = run(request, stage, lambda name, at, of: stage(f"{name} {at} of {of}"))
    out.result(done.as_json(), written=True)
    if not out.quiet:
        show_identified(out.console(), done, verbose)
    raise SystemExit(done.exit)
