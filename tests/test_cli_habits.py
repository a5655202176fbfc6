"""What people expect of a command line: examples, completion, no colours where none are wanted, quiet in a pipe."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from benchmarks.parts import program
from conftest import CELL, LINES

from postproc.cli.main import COMMANDS, normalized

COMPENSATE = [sys.executable, "-m", "postproc"]
ESCAPE = re.compile(rb"\x1b\[[0-9;?]*[A-Za-z]")
COLOUR = re.compile(rb"\x1b\[(?:[0-9]+;)*(?:3[0-9]|4[0-9]|9[0-7])(?:;[0-9]+)*m")


def on_a_terminal(words: list[str], folder: Path, **environment: str) -> bytes:
    """All that a command prints where standard output and error are a terminal."""
    master, slave = pty.openpty()
    cleaned = {
        key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "FORCE_COLOR", "COLUMNS")
    }
    process = subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=slave,
        stderr=slave,
        cwd=folder,
        env={**cleaned, "TERM": "xterm-256color", **environment},
    )
    os.close(slave)
    said = b""
    while True:
        if not select.select([master], [], [], 60)[0]:
            process.kill()
            raise AssertionError("it says nothing more")
        try:
            piece = os.read(master, 1 << 16)
        except OSError:  # the other end is closed
            break
        if not piece:
            break
        said += piece
    process.wait()
    os.close(master)
    return said


# ------------------------------------------------------------------------------------------------------- help


def examples(command: click.Command) -> list[str]:
    """The command lines below ``Examples:`` of a help text, continued lines put together."""
    found: list[str] = []
    text = (command.help or "").replace("\b", "")
    for line in text.partition("Examples:")[2].splitlines():
        if line.strip().startswith(("compensate ", "eval ")):
            found.append(line.strip())
        elif line.startswith("          ") and found:
            found[-1] += " " + line.strip()
        elif not line.strip() and found:
            break
    return found


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_examples_that_parse(name):
    lines = examples(COMMANDS[name])
    assert lines, f"compensate {name} --help shows no example"
    for line in lines:
        line = re.sub(r'eval "\$\((.*)\)".*', r"\1", line)
        words = normalized(shlex.split(re.split("  | [<>] ", line)[0])[1:])
        command = COMMANDS[words[0]]
        with command.make_context(words[0], words[1:]):
            pass


def test_help_is_light():
    code = "import sys, postproc.cli.main, json; print(json.dumps(sorted(sys.modules)))"
    loaded = set(
        json.loads(subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout)
    )
    assert not loaded & {
        "numpy",
        "scipy",
        "pinocchio",
        "yaml",
        "ruamel",
        "rich",
        "matplotlib",
        "jinja2",
        "distributed",
    }


def test_a_small_program_loads_what_it_needs(tmp_path):
    """Of the libraries and rooms that take their time to load, those that a short program has work for."""
    path = program(tmp_path, "krl", 20)
    code = (
        "import sys, json; from postproc.cli.main import run\n"
        "try: run(sys.argv[1:])\nexcept SystemExit as end: code = end.code\n"
        "print(json.dumps([code, sorted(sys.modules)]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path), "--force", "-q"], capture_output=True, check=True, text=True
    )
    code, loaded = json.loads(done.stdout)
    assert code == 0
    libraries = {name.partition(".")[0] for name in loaded}
    assert not libraries & {
        *("scipy", "pinocchio", "numba", "ruamel", "rich", "matplotlib", "distributed", "trimesh", "asyncio"),
    }
    rooms = {name.split(".")[1] for name in loaded if name.startswith("postproc.")}
    assert not rooms & {"placement", "learning", "diagnosis", "identification", "experiments", "verification"}
    assert not rooms & {"measurements"}
    assert not {name for name in loaded if name.startswith("postproc.process.stock.")} - {
        "postproc.process.stock.codes",
        "postproc.process.stock.stated_stock",
    }
    assert not {"pyexpat", "postproc.part.part_figures"} & set(loaded)
    assert "postproc.cli.program" in loaded
    assert not {f"postproc.cli.{name}" for name in COMMANDS} & set(loaded) - {
        "postproc.cli.program",
        "postproc.cli.completion",
    }
    assert not {name for name in loaded if name.startswith("postproc.languages.gcode.")} - {
        "postproc.languages.gcode.cell_options",
        "postproc.languages.gcode.codes",
        "postproc.languages.gcode.detection",
    }


def test_a_small_program_is_not_searched_for_circles(tmp_path):
    """What the start loads stays, and what is there at the end goes with the process: neither is collected."""
    code = (
        "import atexit, gc, sys\nfrom postproc.cli.main import run\n"
        "gc.collect(0)\nbefore = gc.get_stats()[0]['collections']\n"
        "atexit.register(lambda: print(gc.get_stats()[0]['collections'] - before, gc.get_count()[0],"
        " gc.get_freeze_count()))\nrun()"
    )
    words = [sys.executable, "-c", code, str(program(tmp_path, "krl", 20)), "--force", "-q"]
    done = subprocess.run(words, capture_output=True, check=True, text=True)
    collections, young, frozen = map(int, done.stdout.split())
    assert collections == 0
    assert young < 100 < 10_000 < frozen


def test_the_collector_works_as_always_after_the_start():
    code = (
        "import gc\nfrom postproc.base.memory import LOADED, collect_late\n"
        "usual = gc.get_threshold()\ncollect_late()\nassert gc.get_threshold()[0] == LOADED\n"
        "kept = [[] for _ in range(LOADED + 1000)]\nassert gc.get_threshold() == usual and not gc.callbacks"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_as_a_module():
    done = subprocess.run([*COMPENSATE, "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()[0]) == (0, "compensate,")
    assert subprocess.run([*COMPENSATE, "--nonsense"], capture_output=True).returncode == 2


# ------------------------------------------------------------------------------------------------- completion


def completed(folder: Path, *words: str) -> list[tuple[str, str]]:
    """(kind, word) that bash is offered for the last of ``words``."""
    environment = {
        **os.environ,
        "COMP_WORDS": " ".join(["compensate", *words]),
        "COMP_CWORD": str(len(words)),
        "_COMPENSATE_COMPLETE": "bash_complete",
    }
    done = subprocess.run(COMPENSATE, capture_output=True, text=True, cwd=folder, env=environment, check=True)
    return [tuple(line.split(",", 1)) for line in done.stdout.splitlines()]


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("words", "there", "not_there"),
    [
        (["che"], [("plain", "check"), ("file", "che")], ["batch"]),
        (["part.src", "--ga"], [("plain", "--gain")], ["--dump"]),
        (["check", "--d"], [("plain", "--dump")], ["--gain"]),
        (["--dry"], [("plain", "--dry-run")], []),
        (["batch", "--da"], [("plain", "--dask")], []),
        (["schema", "c"], [("plain", "cell")], ["robot"]),
        (["completion", ""], [("plain", "bash"), ("plain", "zsh"), ("plain", "fish")], []),
        (["predict", "pa"], [("file", "pa")], []),
        (["robots", "kuka_"], [("plain", "kuka_kr270"), ("file", "kuka_")], ["ur5"]),
        (["part.src", "--robot", "ur"], [("plain", "ur5")], ["kuka_kr270"]),
    ],
)
def test_words_are_completed(tmp_path, words, there, not_there):
    offered = completed(tmp_path, *words)
    assert set(there) <= set(offered)
    assert not {word for _, word in offered} & set(not_there)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_scripts_are_scripts(compensate, tmp_path, shell):
    done = compensate("completion", shell)
    assert done.code == 0
    assert "_COMPENSATE_COMPLETE" in done.out
    if shutil.which(shell):
        script = tmp_path / "script"
        script.write_text(done.out)
        subprocess.run([shell, "-n", str(script)], check=True)
    assert compensate("completion", "tcsh").code == 2


# ---------------------------------------------------------------------------------------- colours and progress


@pytest.mark.slow
def test_colours_on_a_terminal_unless_unwanted(tmp_path):
    words = [*COMPENSATE, "check", "none.src"]
    assert COLOUR.search(on_a_terminal(words, tmp_path))
    said = on_a_terminal(words, tmp_path, NO_COLOR="1")
    assert b"FIL001" in said
    assert not COLOUR.search(said)


@pytest.mark.slow
def test_quiet_in_a_pipe(job):
    for words in (["part.src", "--force"], ["batch", "part.src", "--force"], ["robots"]):
        done = subprocess.run([*COMPENSATE, *words], capture_output=True, cwd=job.folder)
        assert done.returncode == 0
        assert done.stderr == b""
        assert done.stdout
        assert not ESCAPE.search(done.stdout)
        assert b"\r" not in done.stdout
    done = subprocess.run([*COMPENSATE, "part.src", "--force", "-q"], capture_output=True, cwd=job.folder)
    assert (done.stdout, done.stderr) == (b"", b"")


@pytest.mark.slow
def test_a_batch_shows_its_progress_on_a_terminal(job):
    for number in range(6):
        job.write(LINES, name=f"p{number}.src")
    said = on_a_terminal([*COMPENSATE, "batch", ".", "--force"], job.folder)
    assert b"0/7" in said
    assert b"p0.src" in said
    assert b"motions/s" in said
    assert b"7 programs: 7 done" in ESCAPE.sub(b"", said)


# -------------------------------------------------------------------------------------- places in YAML files


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [
        (CELL + "tolerence: 1\n", 8, 1),
        (CELL.replace("y: 0, z: 250", "y: zero, z: 250"), 3, 15),
        (CELL.replace("y: 0, z: 250", "z: 250"), 3, 6),
        (CELL.replace("axis: +z", "axis: up"), 3, 48),
        (CELL.replace("  1: {x: 1500", "  one: {x: 1500"), 5, 3),
        (CELL + "controller: {absolute: true}\n", 8, 14),
        (CELL + "bases: [\n", 9, 1),
        ("- robot\n", 1, 1),
    ],
)
def test_errors_in_yaml_point_at_line_and_column(compensate, job, text, line, column):
    job.cell(text)
    done = compensate(job.program, "--force")
    assert done.code == 1
    assert done.err.startswith(f"{job.folder / 'cell.yaml'}:{line}:{column} ")
    assert job.nothing_written()
