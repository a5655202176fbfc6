"""``compensate robots``: the robots that come with the tool."""

from __future__ import annotations

import click

from postproc.cli.common import ROBOT, Out, result_options


@click.command()
@click.argument("name", type=ROBOT, required=False)
@result_options
def robots(name: str | None, json_to: str | None, quiet: bool, verbose: bool) -> None:
    """List the robots, or show one: geometry, effects, intervals and sources.

    \b
    Examples:
      compensate robots
      compensate robots kuka_kr270
    """
    from postproc.report.robot_words import list_robots, robots_json, show_robot
    from postproc.workflows.listing import robots as run

    out = Out(json_to, quiet, verbose)
    with out.refusals(writes=False):
        models = run(name)
        out.result(robots_json(models))
    if not out.quiet:
        (show_robot if name else list_robots)(out.console(), models)
