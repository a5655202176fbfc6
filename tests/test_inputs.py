"""The files of a run: what changes while it runs is told, and no output is one of them."""

from __future__ import annotations

import ast
import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import CELL
from faults import Child, once, stray, there
from sources import parse_file, walk

import postproc
from postproc.base.findings import Refusal
from postproc.base.input_files import note, noted
from postproc.base.read_files import read_file
from postproc.batching.files_read import code_digest
from postproc.batching.item import BatchItem, run_item
from postproc.batching.job_file import Job
from postproc.workflows.preparation import Request
from postproc.workflows.program import compensate, predict
from postproc.workflows.verify import verify

ARM = """\
<robot name="arm">
  <link name="l0"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="l4"/>
  <link name="l5"/><link name="l6"/>
  <joint name="j1" type="revolute"><parent link="l0"/><child link="l1"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3"/></joint>
  <joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3"/></joint>
  <joint name="j3" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3"/></joint>
  <joint name="j4" type="revolute"><parent link="l3"/><child link="l4"/><origin xyz="1 0 0"/><axis xyz="1 0 0"/>
    <limit lower="-3" upper="3"/></joint>
  <joint name="j5" type="revolute"><parent link="l4"/><child link="l5"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3"/></joint>
  <joint name="j6" type="revolute"><parent link="l5"/><child link="l6"/><axis xyz="1 0 0"/>
    <limit lower="-3" upper="3"/></joint>
</robot>
"""
ROBOT = """\
name: arm
geometry: {source: made up, urdf: {file: arm.urdf}}
joints:
  source: made up
  unit: deg
  J1: [-170, 170]
  J2: [-170, 170]
  J3: [-170, 170]
  J4: [-170, 170]
  J5: [-170, 170]
  J6: [-170, 170]
effects:
  - effect: joint_compliance
    parameters:
""" + "".join(
    f"      c{joint}: {{value: 1.0e-6, unit: rad/(N m), source: made up}}\n" for joint in range(1, 7)
)
LINES = [
    "DEF part()",
    "$BASE={X 0,Y 0,Z 1000,A 0,B 0,C 0}",
    "$TOOL=TOOL_DATA[1]",
    "$VEL.CP=0.05",
    "PTP {A1 0,A2 0,A3 30,A4 0,A5 60,A6 0}",
    ";CUT",
    "LIN {Y 50.0}",
    "LIN {Y 100.0}",
    "LIN {Y 150.0,Z 20.0}",
    "END",
]
MILLING = """\
operations:
  - {name: CUT, diameter: 16, teeth: 3, helix: 30, axial_depth: 5, radial_width: 8, direction: down, spindle: 12000,
     material: EN AW-7075-T6}
"""
FILES = ("part.src", "part.dat", "cell.yaml", "own.yaml", "arm.urdf", "config.dat", "log.csv", "milling.yaml")


@pytest.fixture
def request_(job):
    """A program whose run reads every kind of file."""
    folder = job.folder
    job.write(LINES)
    job.write(["DEFDAT part", "ENDDAT"], name="part.dat")
    (folder / "own.yaml").write_text(ROBOT)
    (folder / "arm.urdf").write_text(ARM)
    (folder / "config.dat").write_text("DEFDAT $CONFIG\nENDDAT\n")
    (folder / "log.csv").write_text("line,fx,fy,fz\n8,0,9,9\n9,0,9,9\n")
    (folder / "milling.yaml").write_text(MILLING)
    job.cell(
        CELL.replace("kuka_kr270", "own.yaml").replace("45, 0]", "45, 0]\ndialect: {config_dat: config.dat}")
    )
    return Request(job.program, force="")


def forces(name: str) -> str:
    return "milling.yaml" if name == "milling.yaml" else "log.csv"


def at(request: Request, name: str, **other) -> Request:
    """The request with the force file that is to change, or any."""
    return replace(request, force=str(request.program.with_name(forces(name))), **other)


def changing(path: Path, stage: str = "correcting"):
    """Tells of stages that change a file as one begins: by one byte, at the same size and time."""

    def told(now: str) -> None:
        if now == stage:
            raw, status = path.read_bytes(), path.stat()
            path.write_bytes(raw[:-1] + (b" " if raw.endswith(b"\n") else b"\n"))
            os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))

    return told


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_every_input_that_changes_is_told_and_nothing_is_written(request_, job, name):
    before = set(there(job.folder))
    with pytest.raises(Refusal) as refusal:
        compensate(at(request_, name), changing(job.folder / name))
    (told,) = refusal.value.findings
    assert (told.code, Path(told.file)) == ("FIL010", job.folder / name)
    assert set(there(job.folder)) == before


@pytest.mark.slow
def test_an_input_that_changes_while_the_results_are_written(job):
    """At every request to the system: the results are those of what is there, or there are none."""
    folder, before = job.output.parent, job.program.read_bytes()
    codes = []
    for at in range(1, 200, 3):
        job.program.write_bytes(before)
        shutil.rmtree(folder, ignore_errors=True)
        child = Child([job.program, "--force"], folder, once(at, lambda: changing(job.program)("correcting")))
        codes.append(child.end())
        if codes[-1] == 1:
            assert "FIL010" in child.said
            assert there(folder) == {}
            assert stray(folder) == []
        if job.program.read_bytes() == before:
            break
    assert codes.count(1) > 3
    assert codes[-1] == 0


@pytest.mark.parametrize("name", ["part.src", "arm.urdf", "milling.yaml"])
def test_a_prediction_of_inputs_that_change(request_, job, name):
    with pytest.raises(Refusal, match="FIL010"):
        predict(at(request_, name, report=job.folder / "out"), changing(job.folder / name, "predicting"))
    assert not (job.folder / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["part.src", "compensated/part.src", "arm.urdf", "log.csv", "cell.yaml"])
def test_a_verification_of_inputs_that_change(request_, job, name):
    whole = at(request_, name)
    assert compensate(whole).exit == 0
    result = job.folder / "result.json"
    assert verify(replace(whole, json=result), job.output).exit == 0
    result.unlink()
    with pytest.raises(Refusal, match="FIL010"):
        verify(replace(whole, json=result), job.output,
               stage=changing(job.folder / name, "simulating the original"))  # fmt: skip
    assert not result.exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_no_input_is_an_output(request_, job, name):
    """Neither of the main job nor of the others, under any of its names."""
    (job.folder / "also").symlink_to(job.folder)
    before = there(job.folder)
    for place in (job.folder / name, job.folder / "also" / name):
        for run in (
            lambda path: compensate(at(request_, name, output=path)),
            lambda path: compensate(at(request_, name, json=path)),
            lambda path: predict(at(request_, name, json=path)),
            lambda path: verify(at(request_, name, json=path), job.program),
        ):
            with pytest.raises(Refusal) as refusal:
                run(place)
            assert {told.code for told in refusal.value.findings} == {"FIL007"}
            assert there(job.folder) == before


def test_the_compensated_program_is_an_input_of_its_verification(request_, job):
    whole = at(request_, "log.csv")
    compensate(whole)
    before = job.output.read_bytes()
    with pytest.raises(Refusal, match="FIL007"):
        verify(replace(whole, json=job.output), job.output)
    assert job.output.read_bytes() == before


def test_a_force_that_the_cell_names_and_this_run_does_not_read(request_, job):
    cell = job.folder / "cell.yaml"
    cell.write_text(cell.read_text() + "process: milling.yaml\n")
    with pytest.raises(Refusal, match="FIL007"):
        compensate(at(request_, "log.csv", json=job.folder / "milling.yaml"))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["arm.urdf", "log.csv"])
def test_a_batch_with_an_input_that_changes(request_, job, name):
    whole = at(request_, name, output=job.output)
    task = BatchItem(Job("part.src", job.output, whole), code_digest())
    failed = run_item(task, changing(job.folder / name))
    assert failed.state == "failed"
    assert [told["code"] for told in failed.result["findings"]] == ["FIL010"]
    assert not job.output.exists()
    assert run_item(task).state == "done"
    assert run_item(task).state == "unchanged"
    changing(job.folder / name)("correcting")
    assert run_item(task).state == "done"


def test_a_file_that_is_read_twice_and_is_not_the_same(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"one")
    with noted() as inputs:
        read_file(path)
        read_file(path)
        path.write_bytes(b"two")
        with pytest.raises(Refusal, match="FIL010"):
            read_file(path)
    assert list(inputs.digests) == [path]
    assert read_file(path) == b"two"  # nobody notes it any more
    with noted() as others:
        read_file(path)
    others.refuse_changed()


def test_what_is_gone_or_no_file_any_more(tmp_path):
    paths = [tmp_path / name for name in ("gone", "folder", "pipe", "same")]
    with noted() as inputs:
        for path in paths:
            path.write_bytes(b"x")
            read_file(path)
    for path in paths[:3]:
        path.unlink()
    paths[1].mkdir()
    os.mkfifo(paths[2])
    with pytest.raises(Refusal) as refusal:
        inputs.refuse_changed()
    assert [(told.code, told.file) for told in refusal.value.findings] == [
        ("FIL001", str(paths[0])), ("FIL010", str(paths[1])), ("FIL010", str(paths[2])),
    ]  # fmt: skip


def test_a_run_inside_of_another_has_its_own_inputs(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    with noted() as outer:
        note(one, b"")
        with noted() as inner:
            note(two, b"")
        note(one, b"")
    assert (list(outer.digests), list(inner.digests)) == ([one], [two])


READERS = {"read_bytes", "read_text", "open"}
ELSEWHERE = (
    "batching/",
    "posts/",
    "cli/posts.py",
    "base/locks.py",
    "base/memory.py",
    "base/paged_memory.py",
    "output/atomic_write.py",
    "base/read_files.py",
    "cli/streams.py",
    "process/stock/compiled.py",
    "base/input_files.py",
    "report/compiled_templates.py",
    "report/page.py",
    "robot/write_robot_file.py",
    "workflows/kinds.py",
    "workflows/learn_history.py",
)
"""What is read there is no input: standard streams, sources of the package, records, locks, heads of files that a batch
looks at, parts of a page, results, files of other systems, what the system says of memory."""


@pytest.mark.slow
def test_whatever_is_read_is_noted():
    """``read_files.read_file`` and ``read_files.read_text_file`` are the only ways to the bytes of a file."""
    root, found = Path(postproc.__file__).parent, []
    for path in sorted(root.rglob("*.py")):
        name = path.relative_to(root).as_posix()
        if name.startswith(ELSEWHERE):
            continue
        for node in walk(parse_file(path)):
            if isinstance(node, ast.Call):
                called = getattr(node.func, "attr", getattr(node.func, "id", ""))
                if called in READERS:
                    found.append(f"{name}:{node.lineno} {called}")
    assert found == []


@pytest.mark.slow
@pytest.mark.parametrize(("option", "name"), [("-o", "loop.src"), ("--json", "loop.json")])
def test_a_link_that_leads_to_itself_is_replaced(compensate, job, option, name):
    """It is no input, and it is nothing else."""
    loop = job.folder / name
    loop.symlink_to(name)
    done = compensate(job.program, "--force", option, loop)
    assert done.code == 0, done.err
    assert loop.is_file()
    assert not loop.is_symlink()
