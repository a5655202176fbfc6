"""``compensate completion``: the script by which a shell completes commands, options and files."""

from __future__ import annotations

import click
from click.shell_completion import CompletionItem, get_completion_class

SHELLS = ("bash", "zsh", "fish")
VARIABLE = "_COMPENSATE_COMPLETE"
"""The environment variable by which the script asks for words."""


class Commands(click.Group):
    """A group with a default command: to complete, a first word that is no command is a program."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if ctx.resilient_parsing and args and args[0] not in self.commands:
            return "program", self.commands["program"], args
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Commands, and files: a program may be in the place of a command."""
        items = super().shell_complete(ctx, incomplete)
        if incomplete.startswith("-"):
            return items + self.commands["program"].shell_complete(ctx, incomplete)
        return [item for item in items if item.value != "program"] + [CompletionItem(incomplete, type="file")]


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the completion script of SHELL.

    \b
    Examples:
      eval "$(compensate completion bash)"            in ~/.bashrc
      eval "$(compensate completion zsh)"             in ~/.zshrc
      compensate completion fish > ~/.config/fish/completions/compensate.fish
    """
    root = context.find_root()
    script = get_completion_class(shell)
    assert script is not None
    click.echo(script(root.command, {}, "compensate", VARIABLE).source())
