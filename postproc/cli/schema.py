"""``compensate schema``: JSON Schemas of the files that people write, and of the results."""

from __future__ import annotations

import json

import click

FILES = ("cell", "robot", "job")
RESULTS = (
    "report",
    "predict",
    "check",
    "verify",
    "map",
    "place",
    "assign",
    "identify",
    "engage",
    "plan",
    "diagnose",
    "learn",
    "batch",
    "watch",
    "robots",
    "corrections",
)


@click.command()
@click.argument("name", type=click.Choice(FILES + RESULTS))
def schema(name: str) -> None:
    """Print the JSON Schema (draft 2020-12) of a file or of a result.

    Files: the cell file, the robot file, the job file of `batch`. Results: what `--json` gives; `report` is that of the
    main job, and `corrections` describes the columns of <stem>.corrections.csv. Every key has a description, every
    number its unit; keys marked deprecated are former names, which go with the next version.

    \b
    Examples:
      compensate schema cell > cell.schema.json
      compensate schema robot
      compensate schema report > report.schema.json

    For editors, in the first line of a file: # yaml-language-server: $schema=cell.schema.json
    """
    from postproc.schemas import schema_of

    click.echo(json.dumps(schema_of(name), indent=2))
