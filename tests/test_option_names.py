"""Options under their former names: taken by the command line, job files and Python as the present ones, and told."""

from __future__ import annotations

import warnings
from pathlib import Path

import click
import pytest
from conftest import CELL

import postproc
from postproc.base.findings import Refusal
from postproc.batching.job_file import PROGRAM_KEYS, jobs_of
from postproc.cli.common import FORMER_NAMES, RenamedOption
from postproc.cli.main import COMMANDS
from postproc.workflows.option_names import FORMER_OPTIONS, FORMER_VALUES

RENAMED = {
    (name, option.name): (COMMANDS[name], option)
    for name in COMMANDS
    for option in COMMANDS[name].params
    if isinstance(option, RenamedOption)
}
WORDS = {
    "program": ["a.src"],
    "predict": ["a.src"],
    "verify": ["a.src", "b.src"],
    "place": ["a.src"],
    "assign": ["a.src", "--at", "a=1,2,3"],
    "learn": ["a.src", "b.csv"],
    "batch": ["a.src"],
    "watch": ["."],
}


def read(command: str, *words: str) -> tuple[dict[str, object], list[str]]:
    """What a command is given for its words, and the notes on former names."""
    context = COMMANDS[command].make_context(command, [*WORDS[command], *words])
    return context.params, context.meta.get(FORMER_NAMES, [])


def option_of(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def test_every_former_name_is_of_an_option():
    assert set(FORMER_OPTIONS.values()) == {option for _, option in RENAMED}


@pytest.mark.parametrize(("command", "option"), RENAMED)
def test_former_options_mean_the_present_ones(command, option):
    former = next(name for name, present in FORMER_OPTIONS.items() if present == option)
    values = FORMER_VALUES.get(option, {})
    ends = [((f"{option_of(former)}={old}",), (f"{option_of(option)}={new}",)) for old, new in values.items()]
    ends += [((option_of(former), old), (option_of(option), new)) for old, new in values.items()]
    for old, new in ends or [((option_of(former),), (option_of(option),))]:
        told, notes = read(command, *old)
        wanted, none = read(command, *new)
        assert told == wanted != read(command)[0]
        assert any(
            note.startswith(f"{option_of(former)} is now called {option_of(option)}") for note in notes
        )
        assert none == []
        with pytest.raises(click.BadParameter, match=f"former name of {option_of(option)}"):
            read(command, *old, *new)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_the_present_names_only(command):
    told = COMMANDS[command].get_help(click.Context(COMMANDS[command], info_name=command))
    assert not [name for name in FORMER_OPTIONS if option_of(name) in told.split()]
    offered = COMMANDS[command].shell_complete(click.Context(COMMANDS[command], info_name=command), "--")
    assert not {option_of(name) for name in FORMER_OPTIONS} & {item.value for item in offered}


def test_a_misspelt_option_leads_to_the_present_names_only(compensate, job):
    run = compensate(job.program, "--keep-point")
    assert run.code == 2
    assert "--no-insert" in run.err
    assert "--keep-points" not in run.err


@pytest.mark.slow
def test_the_note_disturbs_no_script(compensate, job):
    done = compensate(job.program, "--force", "--keep-points", "--own-points", "refuse")
    assert done.code == 0
    assert "note: --keep-points is now called --no-insert\n" in done.err
    assert "note: --shared-points refuse is now called keep\n" in done.err
    assert "note: " not in done.out
    assert compensate(job.output, "--force", "--cell", job.folder / "cell.yaml").code == 1
    again = compensate(job.output, "--force", "--cell", job.folder / "cell.yaml", "--again", "-q")
    assert (again.code, again.out, again.err) == (0, "", "")
    piped = compensate(job.program, "--force", "--keep-points", "--json", "-")
    assert (piped.err, piped.json["exit"]) == ("", 0)


def job_file(folder: Path, text: str) -> Path:
    (folder / "cell.yaml").write_text(CELL)
    (folder / "a.src").write_text("DEF a()\nEND\n")
    path = folder / "jobs.yaml"
    path.write_text(f"programs: a.src\n{text}")
    return path


def test_former_keys_of_a_job_file(tmp_path):
    keys = {former: key for former, key in FORMER_OPTIONS.items() if key in PROGRAM_KEYS}
    assert len(keys) == 4
    old = "".join(f"{former}: {'dat' if former == 'own_points' else 'true'}\n" for former in keys)
    new = "".join(f"{key}: {'copy-dat' if key == 'shared_points' else 'true'}\n" for key in keys.values())
    (first,) = jobs_of([str(job_file(tmp_path, old))], {}).jobs
    (second,) = jobs_of([str(job_file(tmp_path, new))], {}).jobs
    assert first == second
    assert (first.request.shared_points, first.request.no_insert) == ("copy-dat", True)
    (third,) = jobs_of([str(job_file(tmp_path, "overrides:\n  a.src: {again: true}\n"))], {}).jobs
    assert third.request.allow_compensated
    for wrong, said in (
        (old + new, "former name of"),
        ("own_points: dta\n", "copy-inline, copy-dat, keep"),
        ("keep_point: true\n", "the key is unknown"),
    ):
        with pytest.raises(Refusal) as refused:
            jobs_of([str(job_file(tmp_path, wrong))], {})
        assert said in refused.value.findings[0].message


def test_former_names_in_python(job):
    with pytest.warns(DeprecationWarning, match="'keep_points' is now called 'no_insert'"):
        old = postproc.compensate(job.program, force=True, keep_points=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        new = postproc.compensate(job.program, force=True, no_insert=True)
    assert old.as_json() == new.as_json()
    with pytest.warns(DeprecationWarning, match="shared_points='refuse' is now called 'keep'"):
        postproc.compensate(job.program, force=True, shared_points="refuse", dry_run=True)
    with pytest.raises(TypeError, match="former name"):
        postproc.predict(job.program, force=True, tare=False, force_offset=False)
    with pytest.raises(ValueError, match="copy-inline, copy-dat, keep"):
        postproc.compensate(job.program, force=True, shared_points="dta")
