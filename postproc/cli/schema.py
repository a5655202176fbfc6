"""``compensate schema``: JSON Schemas of the files that people write."""

from __future__ import annotations

import json

import click

NAMES = ("cell", "robot", "job")


@click.command()
@click.argument("name", type=click.Choice(NAMES))
def schema(name: str) -> None:
    """Print the JSON Schema (draft 2020-12) of a cell file, a robot file, or a job file of `batch`, for editors.

    \b
    Examples:
      compensate schema cell > cell.schema.json
      compensate schema robot
      compensate schema job

    Then, in the first line of a file: # yaml-language-server: $schema=cell.schema.json
    """
    from postproc.schemas import schema_of

    click.echo(json.dumps(schema_of(name), indent=2))
