"""The same input makes the same bytes: whatever the surroundings, alone or among others, in one process or in many, on
one thread or on several, today or in ten years."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from batches import contents, four_programs
from conftest import CELL, LINES
from test_batch_killed import a_long_program

ROWS = 3 * 8192 + 500
"""Motions: more than some blocks of rows."""

LANGUAGES = {"de_DE.UTF-8": "de_DE", "tr_TR.UTF-8": "tr_TR", "ar_SA.UTF-8": "ar_SA"}
"""Decimal commas, an i that is no I, other digits."""

SURROUNDINGS = (
    {"PYTHONHASHSEED": "0", "TZ": "UTC", "LC_ALL": "C", "POSTPROC_THREADS": "1"},
    {
        "PYTHONHASHSEED": "1",
        "TZ": "Pacific/Kiritimati",
        "LC_ALL": "de_DE.UTF-8",
        "OPENBLAS_NUM_THREADS": "2",
        "OMP_NUM_THREADS": "2",
        "POSTPROC_THREADS": "2",
        "HOME": "/nonexistent",
        "USER": "somebody",
    },
    {
        "PYTHONHASHSEED": "77",
        "TZ": "America/St_Johns",
        "LC_ALL": "tr_TR.UTF-8",
        "PYTHONUTF8": "0",
        "COLUMNS": "40",
        "POSTPROC_THREADS": "5",
        "OMP_NUM_THREADS": "1",
        "HOME": "/",
    },
    {
        "PYTHONHASHSEED": "random",
        "LC_ALL": "ar_SA.UTF-8",
        "PYTHONOPTIMIZE": "1",
        "PYTHONCOERCECLOCALE": "0",
        "NO_COLOR": "1",
        "LOGNAME": "\u00fcnal",
    },
)
PLAIN = {key: value for key, value in os.environ.items() if not key.startswith(("LC_", "LANG", "TZ"))}

ELSEWHEN = """
import sys, time, datetime, os, platform, socket, getpass, uuid
ago = 7.3e8
for name in ("time", "monotonic", "perf_counter"):
    real = getattr(time, name)
    setattr(time, name, lambda real=real: ago - real() % 1e3 if real.__name__ == "time" else real())
for name in ("gmtime", "localtime"):
    real = getattr(time, name)
    setattr(time, name, lambda seconds=ago, real=real: real(seconds))
class Then(datetime.datetime):
    now = classmethod(lambda cls, tz=None: cls(1993, 2, 18, tzinfo=tz))
    utcnow = today = classmethod(lambda cls: cls(1993, 2, 18))
class Day(datetime.date):
    today = classmethod(lambda cls: cls(1993, 2, 18))
datetime.datetime, datetime.date = Then, Day
os.getpid = lambda: 7
platform.node = socket.gethostname = lambda: "elsewhere"
getpass.getuser = os.getlogin = lambda: "nobody"
os.cpu_count = lambda: 64
uuid.uuid4 = uuid.uuid1 = lambda: uuid.UUID(int=1)
from postproc.cli.main import run
run(sys.argv[1:])
"""
"""A run at another time, by another user of another machine."""


@pytest.fixture(scope="session")
def languages(tmp_path_factory) -> dict[str, str]:
    """Where the languages are, if this system can make them."""
    folder = tmp_path_factory.mktemp("locales")
    if shutil.which("localedef"):
        for name, source in LANGUAGES.items():
            subprocess.run(
                ["localedef", "-c", "-i", source, "-f", "UTF-8", folder / name], capture_output=True
            )
    return {"LOCPATH": str(folder)} if any(folder.iterdir()) else {}


def run(words: list[object], own: dict[str, str], folder: Path, *code: str) -> None:
    command = [sys.executable, *(("-c", code[0]) if code else ("-m", "postproc")), *map(str, words)]
    done = subprocess.run(command, env={**PLAIN, **own}, cwd=folder, check=False, capture_output=True)
    assert done.returncode in (0, 3), done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["src", "ngc"])
def test_surroundings_change_no_byte(job, languages, ending):
    """All files of a run: program, data list, report, corrections, difference, page."""
    job.write(["DEFDAT part", ";Gr\u00f6\u00dfe", "ENDDAT"], name="part.dat")
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\n")
    a_long_program(job.program, 0, ROWS)
    if ending == "ngc":
        lines = ["%", "G21 G90 G17", "T1 M6", "G54", "G0 X0 Y0 Z50", "G1 Z-2 F3000"]
        lines += [f"G1 X{0.02 * k:.3f} Y{k % 7 * 0.1:.3f}" for k in range(ROWS)]
        job.write([*lines, "G3 X600 Y0 I50 J0", "G0 Z50", "M30", "%"], name="part.ngc")
    program = job.folder / f"part.{ending}"
    made = []
    for number, own in enumerate(SURROUNDINGS):
        shutil.rmtree(job.output.parent, ignore_errors=True)
        elsewhere = job.folder / f"cwd{number}"
        elsewhere.mkdir()
        before = os.umask((0o022, 0o077, 0o000, 0o027)[number])
        try:
            run([program, "--force=-360,50,560@base", "-q"], {**own, **languages}, elsewhere)
        finally:
            os.umask(before)
        made.append(contents(job.output.parent))
    assert len(made[0]) == (6 if ending == "src" else 5)
    for one in made[1:]:
        assert one.keys() == made[0].keys()
        assert [name for name in one if one[name] != made[0][name]] == []


LOADS = Path(__file__).parents[1] / "samples" / "kr270_campaign" / "loads.csv"

OTHERS = (
    ["predict", "part.src", "--force", "--report", "out"],
    ["verify", "part.src", "part.src", "--force", "--json", "out/verified.json"],
    ["part.src", "--force", "-o", "out/", "--json", "out/again.json"],
    [
        *("map", "--robot", "kuka_kr270", "--x", "1200:2000", "--y", "-200:200", "--z", "600", "--grid", "9"),
        *("--force=-360,0,560@world", "--csv", "out/map.csv", "--picture", "out/map.svg", "--json", "out/map.json"),
    ],
    [
        *("map", "--robot", "kuka_kr270", "--x", "1200:2000", "--y", "0", "--z", "600", "--grid", "9"),
        *("--force=-360,0,560@world", "--picture", "out/map.png"),
    ],
    [
        *("plan", "--robot", "kuka_kr270", "--effects", "joint_compliance", "--poses", "6", "-o", "out/plan.csv"),
        *("--loads", "100", "--json", "out/plan.json"),
    ],
    ["identify", "loads.csv", "--effects", "joint_compliance", "--page", "out/id.html", "--json", "out/id.json"],
    ["batch", "part.src", "--force", "-o", "out/batch", "-j", "1", "--json", "out/batch.json"],
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("words", OTHERS, ids=[words[0] for words in OTHERS])
def test_another_time_user_and_machine_change_no_byte(tmp_path, words):
    """In another folder too, but for a batch, whose reports name its programs with their whole paths."""
    made = []
    for number, code in enumerate(((), (ELSEWHEN,))):
        folder = tmp_path / (f"shop{number}" if words[0] != "batch" else "shop")
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "out").mkdir(parents=True)
        (folder / "cell.yaml").write_text(CELL)
        (folder / "part.src").write_text("\r\n".join(LINES))
        shutil.copy(LOADS, folder / "loads.csv")
        run([*words, "-q"], SURROUNDINGS[number], folder, *code)
        made.append(contents(folder / "out"))
    assert made[0]
    assert made[0].keys() == made[1].keys()
    assert [name for name in made[0] if made[0][name] != made[1][name]] == []


@pytest.mark.slow
def test_a_clock_set_back_makes_nothing_anew(tmp_path):
    """What a batch did in the future is done."""
    folder = four_programs(tmp_path / "shop")
    words = ["batch", folder, "--force", "-j", "1", "-q", "--json", folder / "states.json"]
    states = []
    for code in ((), (ELSEWHEN,), ()):
        run(words, SURROUNDINGS[0], folder, *code)
        programs = json.loads((folder / "states.json").read_bytes())["programs"]
        states.append({one["state"] for one in programs})
    assert states == [{"done"}, {"unchanged"}, {"unchanged"}]


@pytest.mark.slow
def test_a_robot_file_says_its_day_and_nothing_else_of_the_time(tmp_path):
    """Which also shows that another time is another time."""
    made = []
    shutil.copy(LOADS, tmp_path / "loads.csv")
    for code in ((), (ELSEWHEN,)):
        words = ["identify", "loads.csv", "--effects", "joint_compliance", "-o", "r.yaml", "-q"]
        run(words, SURROUNDINGS[0], tmp_path, *code)
        made.append((tmp_path / "r.yaml").read_text())
    days = [set(re.findall(r"\b[0-9]{4}-[0-9]{2}-[0-9]{2}\b", text)) for text in made]
    assert days[1] - days[0] == {"1993-02-18"}
    (today,) = days[0] - days[1]
    assert made[0].replace(today, "1993-02-18") == made[1]


def test_a_second_run_over_the_first_changes_no_byte(compensate, job):
    assert compensate(job.program, "--force").code == 0
    first = contents(job.output.parent)
    assert compensate(job.program, "--force").code == 0
    assert contents(job.output.parent) == first


@pytest.mark.slow
@pytest.mark.parametrize("umask", [0o000, 0o077])
def test_rights_change_no_byte(compensate, job, umask):
    assert compensate(job.program, "--force").code == 0
    first = contents(job.output.parent)
    before = os.umask(umask)
    try:
        assert compensate(job.program, "--force").code == 0
    finally:
        os.umask(before)
    assert contents(job.output.parent) == first
    assert job.output.stat().st_mode & 0o777 == 0o666 & ~umask


@pytest.mark.slow
def test_one_process_or_many_or_each_alone(compensate, tmp_path):
    """A batch by one process, by two, and every program for itself make the same files."""
    folder = four_programs(tmp_path / "shop")
    results = folder / "compensated"
    made = []
    for workers in (1, 2):
        shutil.rmtree(results, ignore_errors=True)
        assert compensate("batch", folder, "--force", "-j", workers, "-q").code == 0
        made.append({name: raw for name, raw in contents(results).items() if name.startswith("p")})
    shutil.rmtree(results)
    for number in range(4):
        assert compensate(folder / f"p{number}.src", "--force", "-q").code == 0
    made.append(contents(results))
    assert len(made[0]) == 20
    assert made[0] == made[1] == made[2]
