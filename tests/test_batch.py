"""A batch at work: every program once, none stops another, the same bytes however it is run."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from urllib.parse import unquote

import pytest
from batches import WRONG, contents, four_programs, program
from conftest import CELL, LINES

from postproc.batching.files_read import code_digest
from postproc.batching.item import BatchItem, run_item
from postproc.batching.job_file import jobs_of
from postproc.report.batched import Outcome

ROBOT = Path(__file__).resolve().parent.parent / "robots" / "kuka_kr270.yaml"


@pytest.fixture
def parts(tmp_path):
    """A folder of four programs in a cell."""
    return four_programs(tmp_path / "parts")


def states(done) -> dict[str, str]:
    return {one["name"]: one["state"] for one in done.json["programs"]}


def test_every_program_is_what_the_main_job_makes_of_it(compensate, parts, tmp_path):
    done = compensate("batch", parts, "--force", "--json", "-", "-j", "2")
    assert done.code == 0, done.err
    assert done.err == ""
    summary = done.json
    assert (summary["done"], summary["failed"], summary["exit"]) == (4, 0, 0)
    assert [one["name"] for one in summary["programs"]] == ["p0.src", "p1.src", "p2.src", "p3.src"]
    assert json.loads((parts / "compensated" / "summary.json").read_bytes()) == summary
    for number in range(4):
        single = tmp_path / "single" / f"p{number}.src"
        alone = compensate(parts / f"p{number}.src", "--force", "-o", single, "--json", "-")
        assert alone.code == 0
        assert single.read_bytes() == (parts / "compensated" / f"p{number}.src").read_bytes()
        entry = summary["programs"][number]
        for key in ("motions", "corrected", "uncorrected", "error_before_mm", "error_after_mm", "findings"):
            assert entry[key] == alone.json[key]
    assert not list((parts / "compensated").rglob("*.lock"))
    assert not list(parts.rglob("*.tmp*"))


@pytest.mark.slow
def test_the_same_bytes_on_one_and_on_many_processes(compensate, parts):
    compensate("batch", parts, "--force", "-j", "1")
    one = contents(parts / "compensated")
    shutil.rmtree(parts / "compensated")
    compensate("batch", parts, "--force", "-j", "3")
    assert contents(parts / "compensated") == one
    assert "p3.report.json" in one


@pytest.mark.slow
def test_the_page_links_every_report_and_shows_hostile_names_as_text(compensate, parts):
    odd = "a<script>alert(1)<script>%20&b.src"
    program(parts / odd)
    program(parts / "bad.src", 0, WRONG)
    done = compensate("batch", parts, "--force", "--json", "-")
    assert done.code == 1
    page = (parts / "compensated" / "summary.html").read_text()
    links = set(re.findall(r'href="(\./[^"]*)"', page))
    there = {unquote(link)[2:] for link in links}
    for one in done.json["programs"]:
        report = [path for path in one["outputs"] if path.endswith((".report.html", ".report.json"))]
        assert not report or any(Path(path).name in there for path in report)
    assert all((parts / "compensated" / name).is_file() for name in there)
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert" in page
    assert "KIN001" in page


@pytest.mark.slow
def test_one_that_fails_stops_no_other(compensate, parts):
    program(parts / "bad.src", 0, WRONG)
    program(parts / "p9.src").write_bytes(b"")
    done = compensate("batch", parts, "--force", "--json", "-")
    assert done.code == 1
    ended = states(done)
    assert (ended.pop("bad.src"), ended.pop("p9.src")) == ("failed", "failed")
    assert set(ended.values()) == {"done"}
    by_name = {one["name"]: one for one in done.json["programs"]}
    assert by_name["bad.src"]["findings"][0]["code"] == "KIN001"
    assert by_name["p9.src"]["findings"][0]["code"] == "FIL002"
    shown = compensate("batch", parts, "--force").out
    assert "KIN001" in shown
    assert "2 failed" in shown


@pytest.mark.slow
def test_the_exit_code_is_that_of_the_worst(compensate, parts):
    assert compensate("batch", parts, "--force").code == 0
    lines = [*LINES[:10], "LIN {X $POS_ACT.X,Y 0,Z 0}", *LINES[10:]]
    program(parts / "look.src", 0, lines)
    assert compensate("batch", parts, "--force").code == 3
    assert compensate("batch", parts, "--force", "--strict").code == 1


@pytest.mark.slow
def test_fail_fast_stops(compensate, parts):
    program(parts / "bad.src", 0, ["; the largest begins first" + " " * 5000, *WRONG])
    done = compensate("batch", parts, "--force", "--fail-fast", "-j", "1", "--json", "-")
    assert done.code == 1
    ended = states(done)
    assert ended.pop("bad.src") == "failed"
    assert set(ended.values()) == {"not run"}
    assert not (parts / "compensated" / "p0.src").exists()


@pytest.mark.slow
def test_a_dry_run_writes_nothing(compensate, parts):
    before = sorted(parts.rglob("*"))
    done = compensate("batch", parts, "--force", "--dry-run", "--json", "-")
    assert (done.code, done.json["done"]) == (0, 4)
    assert sorted(parts.rglob("*")) == before


# ----------------------------------------------------------------------------------------------- done once


def run(*words: object, rerun: bool = False, **said: object) -> dict[str, Outcome]:
    """The outcomes of a batch that is done in this process, by name."""
    jobs = jobs_of([str(word) for word in words], {"force": "", **said})
    return {job.name: run_item(BatchItem(job, code_digest(), rerun)) for job in jobs.jobs}


def done(outcomes: dict[str, Outcome]) -> list[str]:
    """The names of what was done this time; all else is unchanged."""
    assert {outcome.state for outcome in outcomes.values()} <= {"done", "unchanged"}
    return [name for name, outcome in outcomes.items() if outcome.state == "done"]


@pytest.mark.slow
def test_what_is_unchanged_is_not_done_again(parts):
    first = run(parts)
    assert len(done(first)) == 4
    stamps = {path: path.stat().st_mtime_ns for path in (parts / "compensated").glob("p*")}
    again = run(parts)
    assert done(again) == []
    assert {path: path.stat().st_mtime_ns for path in stamps} == stamps
    assert {name: one.result for name, one in again.items()} == {
        name: one.result for name, one in first.items()
    }
    assert len(done(run(parts, rerun=True))) == 4


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_bytes()
    assert old.encode() in text
    path.write_bytes(text.replace(old.encode(), new.encode()))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "same"),
    [
        (lambda parts: edit(parts / "p1.src", "X 100.000", "X 100.001"), False),
        (lambda parts: (parts / "p1.dat").write_text("DEFDAT p1\nENDDAT\n"), False),
        (lambda parts: (parts / "compensated" / "p1.src").unlink(), True),
        (lambda parts: edit(parts / "compensated" / "p1.src", "; slot", "; Slot"), True),
        (lambda parts: (parts / "compensated" / "p1.corrections.csv").write_text("mine"), True),
        (lambda parts: (parts / "compensated" / "p1.report.json").unlink(), True),
        (lambda parts: (parts / "compensated" / ".compensate" / "p1.src.json").write_text('{"half": '), True),
        (lambda parts: (parts / "compensated" / ".compensate" / "p1.src.json").unlink(), True),
    ],
    ids=[
        "program",
        "companion",
        "gone",
        "altered",
        "report altered",
        "report gone",
        "record half",
        "record gone",
    ],
)
def test_what_changed_is_done_again_and_nothing_else(parts, change, same):
    run(parts)
    want = contents(parts / "compensated")
    change(parts)
    assert done(run(parts)) == ["p1.src"]
    assert (contents(parts / "compensated") == want) == same
    assert done(run(parts)) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        lambda parts: edit(parts / "cell.yaml", "x: 1500", "x: 1501"),
        lambda parts: edit(parts / "arm.yaml", "value: 3.774e-6", "value: 3.775e-6"),
        lambda parts: edit(parts / "f.csv", "10,0,200,0", "10,0,201,0"),
    ],
    ids=["cell", "robot", "force"],
)
def test_what_all_share_is_watched(parts, change):
    shutil.copy(ROBOT, parts / "arm.yaml")
    (parts / "cell.yaml").write_text(CELL.replace("kuka_kr270", "arm.yaml"))
    (parts / "f.csv").write_text("line,fx,fy,fz\n10,0,200,0\n11,0,200,0\n12,0,200,0\n")
    assert len(done(run(parts, force=str(parts / "f.csv")))) == 4
    assert done(run(parts, force=str(parts / "f.csv"))) == []
    change(parts)
    assert len(done(run(parts, force=str(parts / "f.csv")))) == 4


@pytest.mark.slow
def test_options_and_a_nearer_cell_are_watched(parts):
    run(parts)
    assert len(done(run(parts, gain=0.5))) == 4
    assert done(run(parts, gain=0.5)) == []
    (parts / "sub").mkdir()
    shutil.move(parts / "p0.src", parts / "sub" / "p0.src")
    run(parts / "**/*.src")
    (parts / "sub" / "cell.yaml").write_text(CELL)
    assert done(run(parts / "**/*.src")) == ["sub/p0.src"]
    assert done(run(parts / "**/*.src")) == []


@pytest.mark.slow
def test_a_force_beside_the_program_is_watched(parts):
    program(parts / "p1.src", 0, [line for line in LINES if "FORCE" not in line])
    (parts / "cell.yaml").write_text(CELL + "force: 0,100,0@base\n")
    run(parts)
    (parts / "p1.force.csv").write_text("line,fx,fy,fz\n10,0,200,0\n")
    assert done(run(parts)) == ["p1.src"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("p1.dat", "DEFDAT p1\nENDDAT\n"),
        ("p1.force.csv", "line,fx,fy,fz\n10,0,200,0\n"),
        ("cell.yaml", CELL + "max_correction: 9\n"),
    ],
)
def test_what_comes_during_a_run_is_done_with_by_the_next(parts, name, text):
    folder = parts / "deep"
    folder.mkdir()
    shutil.move(parts / "p1.src", folder / "p1.src")
    (job,) = jobs_of([str(folder / "p1.src")], {"force": ""}).jobs
    item = BatchItem(job, code_digest())
    assert (
        run_item(item, lambda stage: (folder / name).write_text(text) if stage == "reporting" else None).state
        == "done"
    )
    assert [run_item(item).state for _ in range(2)] == ["done", "unchanged"]


@pytest.mark.slow
def test_an_output_of_an_earlier_run_is_told(parts):
    run(parts)
    program(parts / "p1.src", 0, WRONG)
    outcome = run(parts)["p1.src"]
    assert outcome.exit == 1
    assert [finding.code for finding in outcome.findings][-1] == "BAT007"


@pytest.mark.slow
def test_the_command_says_what_is_unchanged(compensate, parts):
    compensate("batch", parts, "--force")
    again = compensate("batch", parts, "--force", "--json", "-")
    assert set(states(again).values()) == {"unchanged"}
    assert set(states(compensate("batch", parts, "--force", "--rerun", "--json", "-")).values()) == {"done"}
