"""The console script: finds the command, and turns findings into words and exit codes."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator, Mapping, Sequence

import click

from postproc import __version__
from postproc.base.findings import nearest
from postproc.base.memory import (
    collect_late,
    leave_objects_to_the_system,
    use_mmap_for_large_arrays,
)
from postproc.cli.completion import Commands
from postproc.cli.signals import ended_in_words
from postproc.cli.streams import guarded_streams
from postproc.output.publications import publications


class _CommandModules(Mapping[str, click.Command]):
    """Each command of its own module, which has its name: loaded when it is asked for, as a run has one command."""

    names = (
        *("program", "check", "predict", "verify", "map", "place", "assign", "engage", "identify", "plan"),
        *("diagnose", "learn", "batch", "watch", "robots", "posts", "schema", "completion"),
    )

    def __getitem__(self, name: str) -> click.Command:
        if name not in self.names:
            raise KeyError(name)
        module = importlib.import_module(f"postproc.cli.{name}")
        command: click.Command = getattr(module, "map_" if name == "map" else name)
        return command

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


COMMANDS = _CommandModules()


@click.group(cls=Commands, commands=COMMANDS, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="compensate")
def main() -> None:
    """Compensate the deflection of an industrial robot in its milling program.

    Without a command, PROGRAM is compensated:

    \b
      compensate panel.src --force                    forces that belong to the program
      compensate panel.src --force=-60,0,120@feed     one force, in the feed frame
      compensate panel.src --force --gain 0.5         a first cut with half the correction
      compensate check panel.src                      read it only, report what is not understood
      compensate predict panel.src --force            the deflection at every pose
      compensate verify panel.src compensated/panel.src --force     the path error of both programs
      compensate engage panel.ngc                     what it cuts of its stock, and with which force
      compensate map --robot kuka_kr270 ...           the deflection over the workspace
      compensate place panel.src --force --x 850:1650 where the part deflects the robot least
      compensate assign a.src b.src --force --at ...  which part of a batch lies where
      compensate identify loads.csv --effects ...     parameters of the robot from measurements
      compensate plan --effects ... --poses 15 ...    the poses and loads worth measuring
      compensate diagnose loads.csv                   the effects that the robot file misses
      compensate learn panel.src part1.csv            from a measured part to a better next program
      compensate batch parts --force                  many programs in parallel
      compensate watch outbox --force                 every program that arrives in a folder
      compensate posts freecad -o DIR                 post and compensate in one step, from a CAM system
    """


def run(argv: Sequence[str] | None = None) -> None:
    """Entry point of the console script.  Raises SystemExit with the exit code."""
    words = list(sys.argv[1:] if argv is None else argv)
    # the matrices here are small: threads for them cost more than they give, and runs beside each other fight
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    use_mmap_for_large_arrays()
    if argv is None:
        collect_late()
    try:
        _guarded(words, and_exits=argv is None)
    finally:
        if argv is None:
            leave_objects_to_the_system()


def _guarded(words: list[str], and_exits: bool) -> None:
    """``_run`` with streams that may fail."""
    before = publications()
    with guarded_streams() as out:
        try:
            _run(words, and_exits)
        except SystemExit as end:
            out.flush()
            if not out.problem or end.code not in (None, 0, 3):
                raise
            written = publications() > before
            if not out.reader_left:
                known = "the files are written" if written else "the result is lost"
                click.echo(f"standard output cannot be written ({out.problem}); {known}", err=True)
            if written:
                raise
            raise SystemExit(1) from None


def _run(words: list[str], and_exits: bool) -> None:
    if words and words[0].isalpha() and words[0] not in COMMANDS and not os.path.exists(words[0]):
        hint = "; see compensate --help" if words[0].lower() == "help" else nearest(words[0], COMMANDS)
        click.echo(f"Error: neither a command nor an existing file has the name {words[0]!r}{hint}", err=True)
        raise SystemExit(2)
    with ended_in_words(and_exits):
        main.main(args=normalized(words), prog_name="compensate")


def normalized(arguments: list[str]) -> list[str]:
    """The arguments with the default command named and the value of ``--force`` tied to it.

    ``--force`` takes the next word only if it is a list of numbers or ends in .csv, .yaml or .yml.
    """
    if not arguments or arguments[0] in ("-h", "--help", "--version"):
        return arguments or ["--help"]
    if "--force" not in arguments:
        return arguments if arguments[0] in COMMANDS else ["program", *arguments]
    from postproc.process.stated_forces import is_force_word

    words = arguments if arguments[0] in COMMANDS else ["program", *arguments]
    result: list[str] = []
    at = 0
    while at < len(words):
        word = words[at]
        at += 1
        if word == "--":
            return [*result, *words[at - 1 :]]
        if word == "--force":
            follows = words[at] if at < len(words) else ""
            if follows and is_force_word(follows):
                word, at = f"--force={follows}", at + 1
            else:
                word = "--force="
        result.append(word)
    return result
