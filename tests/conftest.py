"""Fixtures: the command line in this process, and a small milling program in a cell of its own."""

from __future__ import annotations

import csv
import json
import os
import signal
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

if sys.dont_write_bytecode:
    # Hundreds of processes load the package: it is compiled once, and no file is written beside a source.
    sys.dont_write_bytecode = False
    sys.pycache_prefix = str(Path(__file__).parent.parent / ".pytest_cache" / "bytecode")
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import valid_results  # before what it checks
from tiers import choose_profile, mark_samples, skip_when_late, stock_first

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command does, before numpy is there

import postproc.codes  # noqa: F401  findings of all rooms can be made
from postproc.cli.main import run

# In the background of a shell, or under nohup, these are ignored, by all that is started here too.
for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
    if signal.getsignal(number) == signal.SIG_IGN:
        signal.signal(number, handler)


def pytest_addoption(parser):
    parser.addoption(
        "--slow-minutes", type=float, help="skip slow tests that have not begun after so many minutes"
    )


def pytest_configure(config):
    choose_profile(config)


@pytest.hookimpl(tryfirst=True)  # before the marks are asked for
def pytest_collection_modifyitems(items):
    mark_samples(items)
    stock_first(items)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    skip_when_late(item)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    """What other processes of a test printed or wrote as a result is what its schema says."""
    with valid_results.printed_results() as printed:
        outcome = yield
    folder = item.funcargs.get("tmp_path")
    files = [] if folder is None else sorted(Path(folder).rglob("*.json"))
    faults = [fault for text in printed for fault in valid_results.faults_of_text(text)]
    for path in files[: valid_results.MOST_FILES]:
        faults += [f"{path.name}: {fault}" for fault in valid_results.faults_of_file(path)]
    assert not faults, "\n".join(faults)
    return outcome


CELL = """\
robot: kuka_kr270
tools:
  1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}
bases:
  1: {x: 1500, y: -200, z: 600, a: 0, b: 0, c: 0}
start: [0, -90, 90, 0, 45, 0]
tolerance: 0.02
"""

LINES = [
    "DEF part()",
    "BAS(#INITMOV,0)",
    "$BASE=BASE_DATA[1]",
    "$TOOL=TOOL_DATA[1]",
    "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}",
    "$VEL.CP=0.05",
    "LIN {X 0.000,Y 0.000,Z 50.000,A 0.000,B 0.000,C 180.000}",
    "LIN {Z 0.000}",
    ";FORCE -360 50 560 @base",
    "LIN {X 100.000,Y 0.000,Z -2.000,A 0.000,B 0.000,C 180.000} C_DIS",
    "LIN {X 200.000,Y 0.000,Z -2.000,A 0.000,B 0.000,C 180.000} C_DIS ; slot",
    "LIN {X 200.000,Y 150.000,Z -2.000,A 0.000,B 0.000,C 180.000} C_DIS",
    "LIN {Y 300.000}",
    ";FORCE OFF",
    "LIN {Z 50.000}",
    "LIN {X 400.000}",
    "LIN {Z 0.000}",
    ";FORCE 0 200 0",
    "LIN {X 450.000}",
    ";FORCE OFF",
    "LIN {Z 80.000}",
    "END",
]

JUMPED_LINES = [
    line.replace("LIN {Z 0.000}", "PTP {X 0.000,Y 0.000,Z 0.000,A 0.000,B 0.000,C 180.000}") for line in LINES
]
"""The same; a jump before its first cut, which a transition move has to enter."""
JUMPED_LINES[16] = LINES[16]


@dataclass
class Done:
    """How a run ended."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> dict:
        return json.loads(self.out)


@pytest.fixture
def compensate(capsys):
    """``compensate(*words)`` runs the command line and returns how it ended."""

    def call(*words: object) -> Done:
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            run([str(word) for word in words])
        text = capsys.readouterr()
        code = end.value.code
        return Done(0 if code is None else int(code), text.out, text.err)

    return call


def without_inserted(lines: list, report: dict) -> list:
    """The lines of a KRL output as they would be without its marker and the motions inserted into it."""
    (table,) = (path for path in report["outputs"] if path.endswith(".corrections.csv"))
    with open(table, newline="") as stream:
        rows = [
            (int(row["line"]), int(row["transition_moves"]) + int(row["intermediate_points"]))
            for row in csv.DictReader(stream)
        ]
    assert report["inserted"] == sum(count for _, count in rows)
    mark = ";COMPENSATED by compensate "
    kept = [line for line in lines if (mark.encode() if isinstance(line, bytes) else mark) not in line]
    assert len(kept) == len(lines) - 1
    for line, count in rows:  # before that line of the input; those before are gone already
        for _ in range(count):
            gone = kept.pop(line - 1)
            assert b"LIN {" in gone if isinstance(gone, bytes) else "LIN {" in gone, gone
    return kept


@dataclass
class Job:
    """A folder with a cell and a program."""

    folder: Path

    @property
    def program(self) -> Path:
        return self.folder / "part.src"

    @property
    def output(self) -> Path:
        return self.folder / "compensated" / "part.src"

    def write(self, lines: list[str], ending: str = "\r\n", name: str = "part.src") -> Path:
        path = self.folder / name
        path.write_bytes((ending.join(lines) + ending).encode("latin-1"))
        return path

    def cell(self, text: str) -> None:
        (self.folder / "cell.yaml").write_text(text)

    def nothing_written(self) -> bool:
        return not (self.folder / "compensated").exists()


@pytest.fixture
def job(tmp_path) -> Job:
    made = Job(tmp_path)
    made.cell(CELL)
    made.write(LINES)
    return made
