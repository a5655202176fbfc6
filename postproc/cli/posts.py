"""``compensate posts``: the post-processor files for CAM systems."""

from __future__ import annotations

from pathlib import Path

import click

from postproc.posts import POSTS


def _differs(file: Path, content: bytes) -> bool:
    """Whether there is a file with another content, or one that cannot be read."""
    try:
        return file.is_file() and file.read_bytes() != content
    except OSError:
        return True


@click.command()
@click.argument("system", type=click.Choice(tuple(POSTS), case_sensitive=False), required=False)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Write the file into this folder, instead of printing it.",
)
@click.option(
    "--replace",
    is_flag=True,
    help="Replace the file of this name that DIR has, with your edits in it [it is kept, and the command fails].",
)
def posts(system: str | None, output: Path | None, replace: bool) -> None:
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
    from postproc.output.atomic_write import edited_file, write_atomically
    from postproc.posts import post_file

    if replace and output is None:
        raise click.UsageError("--replace belongs to a folder: name it with -o DIR")
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
        if not replace and _differs(target, content):
            message = (
                "the folder has a file of this name that differs from the post: your edits would be lost"
            )
            help = "keep it, name another folder, or use --replace and repeat the edits"
            raise edited_file(target, message, help)
        write_atomically({target: content})
        click.echo(f"wrote {target}")
