"""Options that ``place`` and ``assign`` share: how places of a part are compared, and what is feasible."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from postproc.cli.common import ROBOT, language_options, require_suffix, tare_option, with_options
from postproc.cli.decimal_option import Decimal

_Command = TypeVar("_Command", bound=Callable[..., Any])


def comparison_options(command: _Command) -> _Command:
    """By which forces and errors places are compared, and how far from limits, singularities and collisions."""
    return with_options(
        command,
        click.option("--force", metavar="[SPEC]", default=None, help="Machining force, as in the main job."),
        click.option(
            "--objective",
            type=click.Choice(["across", "max", "p95", "uncertainty"]),
            default="across",
            show_default=True,
            help="What is small at a good place: the largest error across the feed, which marks the part; the "
            "largest error; the 95th percentile of all errors; the uncertainty after compensation.",
        ),
        _margin("limit", 90.0, "Distance of every turning axis from its limits."),
        _margin("singularity", 60.0, "Distance from singularities, as an angle of A5."),
        click.option(
            "--collisions",
            type=click.Path(path_type=Path, dir_okay=False),
            metavar="FILE.urdf",
            callback=require_suffix(".urdf"),
            help="Check collisions of the arm with itself and with fixed bodies by these shapes [the robot file's "
            "URDF].",
        ),
        click.option(
            "--robot", type=ROBOT, metavar="NAME|FILE", help="Use this robot instead of the cell's."
        ),
        language_options,
        tare_option,
        click.option("--strict", is_flag=True, help="Treat warnings as errors: then nothing is written."),
    )


def _margin(name: str, largest: float, about: str) -> Callable[[_Command], _Command]:
    return click.option(
        f"--{name}-margin",
        type=Decimal(0.0, largest),
        default=5.0,
        show_default=True,
        metavar="DEG",
        help=about,
    )
