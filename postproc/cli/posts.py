"""``compensate posts``: the post-processor files for CAM systems."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.posts import POSTS


@click.command()
@click.argument("system", type=click.Choice(tuple(POSTS), case_sensitive=False), required=False)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Write the file into this folder, instead of printing it.",
)
def posts(system: str | None, output: Path | None) -> None:
    """List the post-processors for CAM systems, or print the file of SYSTEM.

    The file makes the CAM system post and compensate in one step; where that fails, no program is written. Its first
    lines state what it needs.

    \b
    Examples:
      compensate posts
      compensate posts freecad -o ~/.local/share/FreeCAD/Macro
      compensate posts robodk -o C:/RoboDK/Posts
    """
    from postproc.cli.common import Out
    from postproc.output.atomic_write import write_atomically
    from postproc.posts import post_file

    if system is None:
        for name, file in POSTS.items():
            click.echo(f"{name:8} {file}")
        return
    content = post_file(system).read_bytes()
    if output is None:
        click.echo(content, nl=False)
        return
    out = Out(None, False, False)
    with out.refusals():
        if not output.is_dir():
            raise click.UsageError(
                f"the folder {str(output)!r} does not exist: name that of {system}'s posts"
            )
        target = output / POSTS[system]
        write_atomically({target: content})
        click.echo(f"wrote {target}")
