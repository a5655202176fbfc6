"""``compensate completion``: the script by which a shell completes commands, options and files."""

from __future__ import annotations

import re
from typing import Any

import click
from click.shell_completion import CompletionItem, get_completion_class

from postproc.base.findings import resembles
from postproc.workflows.option_names import FORMER_OPTIONS

SHELLS = ("bash", "zsh", "fish")
SPREADSHEETS = (".xlsx", ".xlsm", ".xls", ".ods")

_NUMBERS = re.compile(r"[-+]?\.?\d[\d.,;]*(?:@\w+)?\Z|@\w+\Z")

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

    def invoke(self, ctx: click.Context) -> Any:
        """Invoke the command.  Raises UsageError for an option that does not exist."""
        try:
            return super().invoke(ctx)
        except click.NoSuchOption as error:
            # former names are taken, but nobody is sent to them
            given = error.option_name.lstrip("-")
            close = [name for name in error.possibilities or () if resembles(name.lstrip("-"), given)]
            names = [_present_option(name) for name in close]
            shown = " or ".join(dict.fromkeys(names))
            hint = f" Did you mean {shown}?" if shown else ""
            raise click.UsageError(f"There is no option {error.option_name!r}.{hint}", error.ctx) from None
        except click.UsageError as error:
            head, bracket, words = error.message.partition("(")
            surplus = "unexpected extra argument" in head and bracket
            if surplus and (hint := _about_surplus(words.rstrip(")").split())):
                raise click.UsageError(f"{error.message}. {hint}", error.ctx) from None
            raise

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Commands, and files: a program may be in the place of a command."""
        items = super().shell_complete(ctx, incomplete)
        if incomplete.startswith("-"):
            return items + self.commands["program"].shell_complete(ctx, incomplete)
        return [item for item in items if item.value != "program"] + [CompletionItem(incomplete, type="file")]


def _about_surplus(words: list[str]) -> str:
    """What to do with arguments that a command does not take."""
    for word in words:
        name = word.lower()
        if name.endswith(SPREADSHEETS):
            return f"{word} is a spreadsheet: save it as CSV, and name that: --force FILE.csv"
        if name.endswith(".txt"):
            return f"A force file is a CSV or YAML file: rename {word}, and name it: --force FILE.csv"
        if _NUMBERS.match(word):
            return (
                "A force is one word: --force 0,360,560@base; write decimals with a point, and quote it if it has"
                " blanks"
            )
        if name.endswith(".json"):
            return f"A force file is a CSV or YAML file, and {word} is neither: --force FILE.csv"
        if "." in word:
            return "One program is compensated in a run; compensate batch takes many"
    return ""


def _present_option(name: str) -> str:
    """``--no-insert`` for ``--keep-points``, its former name."""
    present = FORMER_OPTIONS.get(name.removeprefix("--").replace("-", "_"))
    return name if present is None else f"--{present.replace('_', '-')}"


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
