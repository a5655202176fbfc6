"""A hot folder: every program once, whole, none lost, whenever the watch is killed."""

from __future__ import annotations

import hashlib
import json
import os
import random
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import CELL, LINES

from postproc.base.findings import Finding
from postproc.batching import hot_folder
from postproc.batching.hot_folder import RETRY, HotFolder
from postproc.batching.item import failed

PROGRAM = ("\r\n".join(LINES) + "\r\n").encode("latin-1")


@pytest.fixture
def hot(tmp_path):
    folder = tmp_path / "outbox"
    folder.mkdir()
    (folder / "cell.yaml").write_text(CELL)
    return folder


def named(name):
    return PROGRAM.replace(b"DEF part()", f"DEF {name}()".encode())


def words(folder, *more):
    return ["watch", folder, "--force", "--settle", "0", "--once", *more]


def test_programs_are_compensated_and_moved(compensate, hot):
    (hot / "one.src").write_bytes(named("one"))
    (hot / "two.src").write_bytes(named("two").replace(b"LIN {X 100.000", b"LIN {X 100,000"))
    (hot / "two.dat").write_bytes(b"DEFDAT two\r\nENDDAT\r\n")
    (hot / "three.src").write_bytes(b"DEF three()\r\nEND\r\n")
    done = compensate(*words(hot, "--json", "-"))
    rows = [json.loads(line) for line in done.out.splitlines()]
    assert {row["name"]: row["state"] for row in rows} == {
        "one.src": "done",
        "two.src": "done",
        "three.src": "failed",
    }
    assert done.code == 1
    left = {path.name for path in hot.iterdir() if path.is_file()}
    assert left == {"cell.yaml"}
    assert {path.name for path in (hot / "done").iterdir()} == {"one.src", "two.src", "two.dat"}
    why = json.loads((hot / "failed" / "three.report.json").read_bytes())
    assert why["findings"][0]["code"] == "FIL009"
    assert (hot / "compensated" / "one.src").read_bytes() != named("one")
    assert (hot / "compensated" / "one.report.html").exists()


@pytest.mark.slow
def test_a_forgotten_force_ends_the_watch_and_the_programs_stay(compensate, hot):
    for name in ("one", "two"):
        (hot / f"{name}.src").write_bytes(named(name))
    done = compensate("watch", hot, "--settle", "0", "--once")
    assert done.code == 1
    assert "FRC030" in done.err
    assert {path.name for path in hot.iterdir() if path.is_file()} == {"cell.yaml", "one.src", "two.src"}
    assert not (hot / "failed").exists()
    assert compensate(*words(hot)).code == 0


def test_the_same_name_again_keeps_the_earlier_one(compensate, hot):
    for _ in range(2):
        (hot / "one.src").write_bytes(named("one"))
        assert compensate(*words(hot)).code == 0
    assert {path.name for path in (hot / "done").iterdir()} == {"one.src", "one~2.src"}


def test_a_program_that_grows_is_waited_for(hot):
    watched = HotFolder(hot, options={"force": ""}, settle=1.0)
    program = hot / "one.src"
    program.write_bytes(named("one")[:-90])
    assert watched.step(now=0.0) == 0
    assert watched.step(now=0.9) == 0
    program.write_bytes(named("one"))
    assert watched.step(now=1.1) == 0
    (hot / "one.dat").write_bytes(b"DEFDAT one\r\n")
    assert watched.step(now=2.0) == 0  # its data list has just come
    assert watched.step(now=3.2) == 1
    assert not watched.waiting()
    assert (hot / "done" / "one.src").read_bytes() == named("one")


def stamp(path):
    return path.stat().st_size, path.stat().st_mtime_ns


EMPTY = b"DEF one()\r\nEND\r\n"


@pytest.mark.parametrize("first", [named("one"), EMPTY], ids=["done", "failed"])
@pytest.mark.parametrize("late", ["one.src", "one.dat"])
def test_what_arrives_during_the_run_is_not_moved_away(hot, monkeypatch, first, late):
    """A later version, or a data list that comes late: the program is compensated again with it."""
    (hot / "one.src").write_bytes(first)
    texts = {
        "one.src": named("one").replace(b"X 100.000", b"X 101.000"),
        "one.dat": b"DEFDAT one\r\nENDDAT\r\n",
    }
    run_item, outcomes = hot_folder.run_item, []

    def overtaken(item):
        outcome = run_item(item)
        if not outcomes:
            (hot / late).write_bytes(texts[late])
        outcomes.append(outcome)
        return outcome

    monkeypatch.setattr(hot_folder, "run_item", overtaken)
    watched = HotFolder(hot, options={"force": ""}, settle=0.0)
    assert watched.step(now=0.0) == 0
    assert {path.name for path in hot.iterdir() if path.is_file()} == {"cell.yaml", "one.src", late}
    assert watched.step(now=1.0) == 1
    lost = outcomes[1].state == "failed"
    assert (hot / ("failed" if lost else "done") / late).read_bytes() == texts[late]
    assert lost == (first == EMPTY and late == "one.dat")


def test_a_later_version_is_not_moved_for_the_one_before_a_kill(hot, monkeypatch):
    (hot / "one.src").write_bytes(named("one"))
    ended, replace = HotFolder(hot, options={"force": ""}, settle=0.0), os.replace

    def kill(source, target):
        if Path(source).name == "one.src" and Path(target).parent.name == "done":
            raise KeyboardInterrupt
        replace(source, target)

    with monkeypatch.context() as context, ended.exclusive():
        context.setattr(os, "replace", kill)
        with pytest.raises(KeyboardInterrupt):
            ended.step(now=0.0)
    later = named("one").replace(b"X 100.000", b"X 101.000")
    (hot / "one.src").write_bytes(later)
    watched = HotFolder(hot, options={"force": ""}, settle=0.0)
    with watched.exclusive():
        assert not (hot / "done" / "one.src").exists()
        assert watched.step(now=0.0) == 1
    assert (hot / "done" / "one.src").read_bytes() == later
    report = json.loads((hot / "compensated" / "one.report.json").read_bytes())
    assert report["digests"]["one.src"] == hashlib.sha256(later).hexdigest()


def test_a_program_that_cannot_be_read_is_named_once_and_tried_again(hot, monkeypatch):
    (hot / "one.src").write_bytes(named("one"))
    run_item, runs, postponed = hot_folder.run_item, [], []

    def unreadable(item):
        runs.append(item)
        finding = Finding("FIL001", "the file cannot be read: Input/output error", str(hot / "one.src"))
        return failed(item.job, finding) if len(runs) < 3 else run_item(item)

    monkeypatch.setattr(hot_folder, "run_item", unreadable)
    watched = HotFolder(hot, options={"force": ""}, settle=0.0)
    times = (0.0, 1.0, RETRY + 1, RETRY + 2, 2 * RETRY + 2)
    assert [watched.step(now=now, postpone=postponed.append) for now in times] == [0, 0, 0, 0, 1]
    assert len(runs) == 3
    assert [outcome.findings[0].code for outcome in postponed] == ["FIL001"]


def test_a_cell_that_changes_during_the_run_makes_no_program_wait(hot, monkeypatch):
    (hot / "one.src").write_bytes(named("one"))
    run_item, runs = hot_folder.run_item, []

    def changing(item):
        runs.append(item)
        if len(runs) > 1:
            return run_item(item)
        return run_item(item, lambda stage: (hot / "cell.yaml").write_text(f"{CELL}max_correction: 9\n"))

    monkeypatch.setattr(hot_folder, "run_item", changing)
    watched = HotFolder(hot, options={"force": ""}, settle=0.0)
    assert [watched.step(now=now) for now in (0.0, 1.0)] == [0, 1]


def test_a_file_of_the_cell_that_is_missing_fails_the_program(hot):
    (hot / "cell.yaml").write_text(CELL + "process: nowhere.yaml\n")
    (hot / "one.src").write_bytes(
        b"\r\n".join(line for line in named("one").split(b"\r\n") if b"FORCE" not in line)
    )
    assert HotFolder(hot, options={"force": ""}, settle=0.0).step(now=0.0) == 1
    assert "nowhere.yaml" in (hot / "failed" / "one.report.json").read_text()


def test_a_journal_moves_nothing_outside(hot, tmp_path):
    (tmp_path / "secret").write_text("x")
    (hot / ".compensate").mkdir()
    moves = {
        str(tmp_path / "secret"): [str(hot / "done" / "secret"), *stamp(tmp_path / "secret")],
        str(hot / "cell.yaml"): [str(tmp_path / "c"), *stamp(hot / "cell.yaml")],
    }
    (hot / ".compensate" / "moves.json").write_text(json.dumps(moves))
    with HotFolder(hot).exclusive():
        pass
    assert (tmp_path / "secret").exists()
    assert (hot / "cell.yaml").exists()


@pytest.mark.parametrize(
    ("words_", "said"),
    [
        (["--force=0,360"], ["FRC002", "2 numbers"]),
        (["--force", "log.csv"], ["FIL001", "log.csv"]),
        (["--cell", "cel.yaml"], ["FIL001", "cel.yaml"]),
        (["--robot", "kuka_kr27"], ["CEL003", "did you mean"]),
    ],
    ids=str,
)
def test_options_that_no_program_could_use_are_refused_at_once(compensate, hot, words_, said):
    """Before a program arrives: a watcher that fails each of them is started in the evening, found in the morning."""
    done = compensate("watch", hot, "--settle", "0", "--once", *words_)
    assert done.code == 1
    assert [word for word in said if word not in done.err] == [], done.err


@pytest.mark.slow
def test_killed_at_random_moments_every_program_is_done_once(hot):
    count, kills = 12, int(os.environ.get("POSTPROC_KILLS", "50"))
    waiting = [(f"p{number}", named(f"p{number}")) for number in range(count)]
    chance = random.Random(3)
    command = [sys.executable, "-m", "postproc", *map(str, words(hot, "-q", "--json", "-"))]
    rows = []
    for kill in range(kills):
        if waiting and kill % 3 == 0:
            name, text = waiting.pop()
            (hot / f"{name}.src").write_bytes(text)
        run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        time.sleep(chance.uniform(0.2, 1.5))
        run.kill()
        rows += [json.loads(line) for line in run.communicate()[0].splitlines() if line.endswith(b"}")]
    for name, text in waiting:
        (hot / f"{name}.src").write_bytes(text)
    last = subprocess.run(command, stdout=subprocess.PIPE, timeout=600)
    assert last.returncode == 0
    archived = {path.name: path.read_bytes() for path in (hot / "done").iterdir()}
    assert archived == {f"p{number}.src": named(f"p{number}") for number in range(count)}
    assert {path.name for path in hot.iterdir() if path.is_file()} == {"cell.yaml"}
    assert not (hot / "failed").exists()
    results = hot / "compensated"
    texts = ((results / f"p{n}.src").read_bytes().replace(b"p%d" % n, b"p", 1) for n in range(count))
    bodies = {re.sub(rb";COMPENSATED[^\r\n]*", b"", text) for text in texts}
    assert len(bodies) == 1
    for number in range(count):
        report = json.loads((results / f"p{number}.report.json").read_bytes())
        assert report["corrected"] > 0
    assert not [path for path in results.rglob("*") if path.name.endswith(".tmp")]


def test_a_signal_stops_it(hot):
    command = [sys.executable, "-m", "postproc", "watch", str(hot), "--force", "--settle", "0"]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert run.stderr is not None
    assert run.stderr.readline().startswith("watching")
    (hot / "one.src").write_bytes(named("one"))
    deadline = time.monotonic() + 60
    while not Path(hot, "done", "one.src").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    run.terminate()
    _, words_of_end = run.communicate(timeout=60)
    assert run.returncode == 128 + 15
    assert "continues from here" in words_of_end


GCODE = """\
%
G21 G90 G17 G54
T1 M6
S9000 M3
G0 X150. Y60. Z30.
(FORCE 120 260 -60 @BASE)
G1 Z-2. F400
G1 X230. F1800
(FORCE OFF)
G0 Z30.
M30
%
"""


def reports_of(folder):
    return {
        Path(json.loads(path.read_bytes())["program"]).name: path.read_bytes()
        for path in folder.glob("*.report.json")
    }


def test_no_program_takes_the_reports_of_another(compensate, hot):
    """Two programs whose reports have one name: the second is refused, and the reports of the first stay."""
    (hot / "cell.yaml").write_text(f"{CELL}orientation: {{a: 0, b: 0, c: 180}}\n")
    (hot / "one.ngc").write_text(GCODE)
    (hot / "one.src").write_bytes(named("one"))
    (hot / "one.dat").write_bytes(b"DEFDAT one\r\nENDDAT\r\n")
    done = compensate(*words(hot, "--json", "-"))
    rows = {row["name"]: row for row in map(json.loads, done.out.splitlines())}
    assert {name: row["state"] for name, row in rows.items()} == {"one.ngc": "done", "one.src": "failed"}
    assert rows["one.src"]["findings"][0]["code"] == "BAT002"
    assert done.code == 1
    assert {path.name for path in (hot / "done").iterdir()} == {"one.ngc"}
    assert {"one.src", "one.dat"} <= {path.name for path in (hot / "failed").iterdir()}
    kept = reports_of(hot / "compensated")
    assert kept.keys() == {"one.ngc"}
    assert not (hot / "compensated" / "one.src").exists()
    # somebody who asks for it by name replaces them, and reads of it
    alone = hot / "failed" / "one.src"
    command = [alone, "--force", "-o", hot / "compensated", "--cell", hot / "cell.yaml"]
    done = compensate(*command)
    assert done.code == 0
    assert "FIL016 the reports replace those of one.ngc" in (done.out + done.err).replace("\n", " ")
    assert "FIL016" not in compensate(*command).out
    assert reports_of(hot / "compensated").keys() == {"one.src"}


def test_predictions_of_another_program_are_replaced_in_words(compensate, hot):
    (hot / "cell.yaml").write_text(f"{CELL}orientation: {{a: 0, b: 0, c: 180}}\n")
    (hot / "one.ngc").write_text(GCODE)
    (hot / "one.src").write_bytes(named("one"))
    predict = ["predict", "--force", "--report", hot / "shown"]
    assert compensate(*predict, hot / "one.src").code == 0
    done = compensate(*predict, hot / "one.ngc", "--json", "-")
    (found,) = [one for one in done.json["findings"] if one["code"] == "FIL016"]
    assert found["message"] == "the reports replace those of one.src, which have the same names"
