"""Comments that were meant to speak to this tool, and do not: they are told, never passed over."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from conftest import LINES

import postproc
from postproc.base.findings import Refusal
from postproc.cell import load_cell
from postproc.compensation.cuts import switch_findings
from postproc.process.force_comments import read_annotations
from postproc.workflows.preparation import read_program

SAMPLES = Path(__file__).resolve().parent.parent / "samples"

CUT = LINES.index(";FORCE -360 50 560 @base")
OFF = LINES.index(";FORCE OFF")


def changed(job, at, comment):
    lines = list(LINES)
    lines[at] = comment
    job.write(lines)


@pytest.mark.parametrize(
    "comment",
    [
        *(";FORCE: -360 50 560", ";FORCE=-360,50,560", ";FORCE-360 50 560", ";FORCE0 360 560"),
        *(
            ";FORSE -360 50 560",
            ";FROCE -360 50 560 @base",
            ";FORC 0 360 560",
            ";forces 0 360 560",
            ";FORCE_0 360 560",
        ),
        *(";FORCE X-360 Y50 Z560", ";FORCE FX=0 FY=360 FZ=560", ";Forse: 0, 360, 560"),
    ],
)
def test_a_force_in_another_spelling_is_refused(compensate, job, comment):
    changed(job, CUT, comment)
    done = compensate(job.program, "--force")
    assert done.code == 1
    assert f"part.src:{CUT + 1} FRC002" in done.err
    assert "write FORCE fx fy fz" in done.err
    assert job.nothing_written()


@pytest.mark.parametrize(
    "comment", [";FORCE OF", ";FORCE OFFF", ";FORCE 0FF", ";FORCE: OFF", ";FORSE OFF", ";FORCE=OFF"]
)
def test_a_force_that_would_not_end_is_refused(compensate, job, comment):
    changed(job, OFF, comment)
    done = compensate(job.program, "--force")
    assert done.code == 1
    assert f"part.src:{OFF + 1} FRC002" in done.err
    assert job.nothing_written()


@pytest.mark.parametrize(
    "comment",
    [
        *(
            ";source 1 2 3",
            ";forged 12.3.2024 by hand",
            ";FORMER 3",
            ";X 1 Y 2 Z 3",
            ";Forward",
            ";office 1 2 3",
        ),
        *(";FORK OF THE HOUSE", ";PARSE 0 1 2"),
    ],
)
def test_other_comments_are_comments(compensate, job, comment):
    changed(job, 1, comment)
    assert compensate(job.program, "--force", "--dry-run").code == 0


@pytest.mark.parametrize(
    "comment", [";COMPENSATION OFF", ";COMPENSTE OFF", ";COMPENSATE: OFF", ";COMPENSATE OF"]
)
def test_a_switch_that_does_not_switch_is_reported(compensate, job, comment):
    changed(job, 1, comment)
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code == 3
    assert ("COR011", 2) in [(one["code"], one["line"]) for one in done.json["findings"]]


def test_comments_that_only_end_a_force_state_none(compensate, job):
    """Where FORCE OFF alone is stated, the force of the cell holds for the motions that are not under it."""
    changed(job, CUT, ";nothing")
    lines = [line for line in job.program.read_text().splitlines() if line != ";FORCE 0 200 0"]
    job.write(lines)
    assert compensate(job.program, "--force", "--dry-run", "--json", "-").json["verdict"] == "not_corrected"
    with (job.folder / "cell.yaml").open("a") as stream:
        stream.write("force: 0,360,560\n")
    done = compensate(job.program, "--force", "--dry-run", "--json", "-")
    assert done.json["force"]["max_n"] == pytest.approx(665.7, abs=0.1)
    stated = compensate(job.program, "--force=0,360,560", "--dry-run", "--json", "-")
    assert 0 < done.json["corrected"] < stated.json["corrected"]


@pytest.mark.parametrize(
    "comment",
    [
        *(" ;FORSE -360 50 560", "; Forse: 0, 360, 560", " ;FORCE0 360 560", ";FROCE OFF"),
        *(" ;COMPENSATION OFF", " ;COMPENSTE OFF"),
    ],
)
@pytest.mark.parametrize("among_plain_lines", [False, True])
def test_behind_a_motion_on_its_line(job, comment, among_plain_lines):
    """The reader passes runs of plain lines over together, whatever the comment behind them is about."""
    lines, at = list(LINES), CUT + 1
    if among_plain_lines:
        plain = [f"LIN {{X {1000 + k},Y 0,Z 900,A 0,B 90,C 0}} C_DIS ;point {k}" for k in range(30)]
        lines, at = [*LINES[:at], *plain, *LINES[at:]], at + 20
    assert lines[at].startswith("LIN")
    lines[at] = lines[at].partition(";")[0] + comment
    job.write(lines)
    said = comment.partition(";")[2].strip()
    toolpath = read_program(job.program, load_cell(job.folder / "cell.yaml"))[1].toolpath
    assert [(note.line, note.text) for note in toolpath.comments if note.line == at + 1] == [(at + 1, said)]
    if "COMP" in comment:
        assert ("COR011", at + 1) in [(one.code, one.line) for one in switch_findings("part.src", toolpath)]
    else:
        with pytest.raises(Refusal) as refused:
            read_annotations(toolpath, "part.src")
        assert [(one.code, one.line) for one in refused.value.findings] == [("FRC002", at + 1)]


@pytest.mark.parametrize(
    "comment", [";point 1 2 3", ";source 1 2 3", ";forward", ";X 1 Y 2 Z 3", ";corner off"]
)
def test_other_comments_behind_a_motion_are_passed_over(job, comment):
    lines = list(LINES)
    lines[CUT + 1] = lines[CUT + 1] + " " + comment
    job.write(lines)
    toolpath = read_program(job.program, load_cell(job.folder / "cell.yaml"))[1].toolpath
    assert not [note for note in toolpath.comments if note.line == CUT + 2]


@pytest.mark.parametrize(
    ("name", "comment"),
    [
        ("irb6700_pocket/pocket.mod", "! FORSE 120 260 -60"),
        ("kr270_pocket/pocket.ngc", "(FORSE 120 260 -60)"),
        ("kr270_pocket/pocket.ngc", "; Forse: 120, 260, -60"),
    ],
)
def test_behind_a_motion_in_every_language(compensate, tmp_path, name, comment):
    folder = tmp_path / "sample"
    shutil.copytree((SAMPLES / name).parent, folder)
    program = folder / Path(name).name
    lines = program.read_text().splitlines()
    moves = ("MoveL ", "G1 ")
    at = [number for number, line in enumerate(lines) if any(word in line for word in moves)][-3]
    lines[at] = f"{lines[at]} {comment}"
    program.write_text("\n".join([*lines, ""]))
    done = compensate(program, "--force")
    assert done.code == 1
    assert f":{at + 1} FRC002" in done.err
    assert not (folder / "compensated").exists()


@pytest.mark.parametrize("comment", ["! FORSE 120 260 -60", "// FORCE 120 260 -60", "--eg: FORSE OFF"])
@pytest.mark.parametrize("behind", [" {} ;", "; {} ;", "; {}"])
def test_in_tp_nothing_stands_behind_a_motion(tmp_path, comment, behind):
    program = tmp_path / "pocket.ls"
    lines = (SAMPLES / "m900ib_pocket/pocket.ls").read_text().splitlines()
    at = [number for number, line in enumerate(lines) if "L P[" in line][-3]
    lines[at] = lines[at].rstrip(" ;") + behind.format(comment)
    program.write_text("\n".join([*lines, ""]))
    found = [(one.code, one.line) for one in postproc.check(program).findings]
    assert {("FTP001", at + 1), ("FTP007", at + 1)} & set(found)


@pytest.mark.parametrize(
    "name", ["irb6700_pocket/pocket.mod", "m900ib_pocket/pocket.ls", "kr270_pocket/pocket.ngc"]
)
def test_in_every_language(compensate, tmp_path, name):
    folder = tmp_path / "sample"
    shutil.copytree((SAMPLES / name).parent, folder)
    program = folder / Path(name).name
    raw = program.read_bytes()
    program.write_bytes(raw.replace(b"FORCE 120", b"FORSE 120", 1))
    done = compensate(program, "--force")
    assert done.code == 1
    assert f":{raw[: raw.index(b'FORCE 120')].count(10) + 1} FRC002 'FORSE 120 260 -60" in done.err
    assert not (folder / "compensated").exists()


@pytest.mark.parametrize(("option", "reported"), [("--force=0,360,560", True), ("--force", False)])
def test_a_value_of_the_option_that_takes_the_place_of_comments_is_reported(
    compensate, tmp_path, option, reported
):
    folder = tmp_path / "sample"
    shutil.copytree((SAMPLES / "kr270_pocket"), folder)
    program = folder / "pocket.ngc"
    first = program.read_bytes().split(b"FORCE", 1)[0].count(b"\n") + 1
    done = compensate(program, option, "--dry-run")
    assert (f"pocket.ngc:{first} FRC035 " in done.out + done.err) == reported
