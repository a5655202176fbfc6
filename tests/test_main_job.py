"""The main job from the command line: what is corrected, what stays, what is told."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from conftest import CELL, JUMPED_LINES, LINES, without_inserted
from reference import reference_flange

from postproc.base.document import Document
from postproc.cell import load_cell
from postproc.languages.krl import KrlDialect
from postproc.robot.chain import Chain
from postproc.robot.description import find_robot, load_robot

NOT_UNDERSTOOD = "LIN {X gap,Y 0.000,Z -2.000,A 0.000,B 0.000,C 180.000} C_DIS"

RIGID = """\
name: rigid
geometry:
  source: none needed
  kuka: {unit: mm, d1: 750, a1: 350, a2: 1250, a3: -55, d4: 1100, d6: 230}
joints:
  source: wide
  unit: deg
  A1: [-360, 360]
  A2: [-360, 360]
  A3: [-360, 360]
  A4: [-360, 360]
  A5: [-360, 360]
  A6: [-360, 360]
"""


def test_a_cut_is_corrected_and_the_air_is_not(compensate, job):
    done = compensate(job.program, "--force", "--json", "-")
    report = done.json
    assert done.code == 0, done.err
    assert (report["motions"], report["corrected"], report["uncorrected"]) == (12, 5, 0)
    assert 0.3 < report["error_before_mm"]["max"] < 4
    assert report["error_after_mm"]["max"] <= 0.002
    assert report["force"]["max_n"] == pytest.approx(np.linalg.norm([360, 50, 560]), abs=1e-3)
    before, after = job.program.read_bytes().split(b"\r\n"), job.output.read_bytes().split(b"\r\n")
    # Nothing is inserted: the motions in air before the cuts lead into them.
    assert (report["inserted"], report["transition_moves"], report["lead_ins"]) == (0, [], 2)
    after = without_inserted(after, report)
    changed = [i for i, (old, new) in enumerate(zip(before, after, strict=True)) if old != new]
    # Lines 14 and 20 are air, but leave out what the cut before them moved: they are completed.
    assert changed == [7, 9, 10, 11, 12, 14, 16, 18, 20]
    assert b"; slot" in after[10]
    assert after[10].endswith(b"C_DIS ; slot")


def test_every_motion_ends_where_it_should(compensate, job):
    """Uncorrected partial points behind a cut still end at their own place; corrected ones at their command."""
    compensate(job.program, "--force")
    read = KrlDialect().read
    old = read((Document(job.program, job.program.read_bytes()),)).toolpath
    new = read((Document(job.output, job.output.read_bytes()),)).toolpath
    with open(job.output.with_name("part.corrections.csv"), newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [int(row["line"]) for row in rows] == old.line.tolist()
    # Where the motions of the input are among those of the output.
    ends = np.cumsum([1 + int(row["transition_moves"]) + int(row["intermediate_points"]) for row in rows]) - 1
    assert len(new) == ends[-1] + 1
    for i, row in enumerate(rows):
        if row["state"] in ("corrected", "lead_in"):
            shift = [float(row[f"correction_{c}_mm"]) for c in "xyz"]
            assert np.linalg.norm(shift) > 0.1
        else:
            shift = [0.0, 0.0, 0.0]
        if np.isfinite(old.position[i, 0]):
            np.testing.assert_allclose((new.position[ends[i]] - old.position[i]) * 1e3, shift, atol=6e-4)
    assert [row["state"] for row in rows].count("corrected") == 5
    assert [int(row["line"]) for row in rows if row["state"] == "lead_in"] == [8, 17]


def test_a_force_of_zero_changes_nothing(compensate, job):
    done = compensate(job.program, "--force=0,0,0")
    assert done.code == 0
    assert job.output.read_bytes() == job.program.read_bytes()


def test_a_rigid_robot_gives_the_file_back(compensate, job):
    (job.folder / "rigid.yaml").write_text(RIGID)
    done = compensate(job.program, "--force", "--robot", job.folder / "rigid.yaml")
    assert done.code == 3, done.err
    assert "MOD003 rigid has no compliance" in done.out
    assert "COR016" not in done.out
    assert "0 corrected, 0 not corrected" in done.out
    assert job.output.read_bytes() == job.program.read_bytes()


@pytest.mark.sample(2)
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
@pytest.mark.parametrize("bom", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("last", [True, False])
def test_all_other_bytes_stay(compensate, job, ending, bom, last):
    text = (
        ending.join(LINES + ([""] if last else []))
        .replace("; slot", ";\t Nut fr\xe4sen  ")
        .replace("LIN {X 200.000,Y 150", "\tlin  { X 200.000 ,Y 150")
    )
    raw = bom + text.encode("latin-1")
    job.program.write_bytes(raw)
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code == 0, done.err
    written = job.output.read_bytes()
    lines, new = raw.split(b"\n"), without_inserted(written.split(b"\n"), done.json)
    assert len(lines) == len(new)
    for old, now in zip(lines, new, strict=True):
        skeleton = [b"".join(c for c in _split(line) if not c[:1].isdigit()) for line in (old, now)]
        if b"{X 2" in old or b"{ X 2" in old or b"A1" in old:  # complete points: only digits may differ
            assert skeleton[0].replace(b"-", b"") == skeleton[1].replace(b"-", b"")
        elif b"LIN {" not in old:
            assert old == now


def _split(line: bytes) -> list[bytes]:
    """Runs of digits and dots, and all other bytes one by one."""
    out: list[bytes] = []
    for i in range(len(line)):
        c = line[i : i + 1]
        if c in b"0123456789." and out and out[-1][-1:] in b"0123456789.":
            out[-1] += c
        else:
            out.append(c)
    return out


def test_a_second_run_over_its_own_output_is_refused(compensate, job):
    compensate(job.program, "--force")
    again = compensate(job.output, "--force", "--cell", job.folder / "cell.yaml")
    assert again.code == 1
    assert "FIL005" in again.err
    assert not (job.output.parent / "compensated").exists()
    meant = compensate(job.output, "--force", "--cell", job.folder / "cell.yaml", "--allow-compensated")
    assert meant.code == 0
    twice = (job.output.parent / "compensated" / "part.src").read_bytes()
    assert twice.count(b";COMPENSATED ") == 1


def test_gain_applies_a_share(compensate, job):
    full = compensate(job.program, "--force", "--json", "-").json
    half = compensate(job.program, "--force", "--gain", "0.5", "--json", "-").json
    assert half["correction_mm"]["max"] == pytest.approx(0.5 * full["correction_mm"]["max"], rel=1e-3)
    assert half["error_after_mm"]["max"] == pytest.approx(0.5 * full["error_before_mm"]["max"], rel=0.01)
    assert half["exit"] == 0


def test_another_stem_renames_the_module(compensate, job):
    out = job.folder / "out" / "part_c.src"
    (job.folder / "part.dat").write_bytes(b"DEFDAT  PART\r\nDECL INT I=1\r\nENDDAT\r\n")
    done = compensate(job.program, "--force", "-o", out)
    assert done.code == 0, done.err
    assert out.read_bytes().startswith(b"DEF part_c()")
    assert out.with_suffix(".dat").read_bytes() == b"DEFDAT  part_c\r\nDECL INT I=1\r\nENDDAT\r\n"
    assert compensate(job.program, "--force", "-o", job.folder / "out" / "1-bad.src").code == 1


def test_a_folder_as_output(compensate, job):
    compensate(job.program, "--force", "-o", f"{job.folder}/new/")
    assert (job.folder / "new" / "part.src").is_file()


def test_a_name_without_suffix_as_output_is_a_folder(compensate, job):
    assert compensate(job.program, "--force", "-o", job.folder / "new").code == 0
    assert (job.folder / "new" / "part.src").is_file()


def test_an_output_named_like_its_companion(compensate, job):
    (job.folder / "part.dat").write_text("DEFDAT part\nENDDAT\n")
    done = compensate(job.program, "--force", "-o", job.folder / "new" / "other.dat")
    assert done.code == 1
    assert "FIL007" in done.err
    assert not (job.folder / "new").exists()


def test_a_point_that_continues_an_axis_motion(compensate, job):
    """Components left out after a PTP in axes are those of the place where it leads."""
    lines = [line for line in LINES if "Z 50.000,A" not in line]
    lines[5:5] = ["LIN {Z 50.000}", ";FORCE 0 100 0", "LIN {Z 20.000}", ";FORCE OFF", "LIN {Z 60.000}"]
    lines[10:12] = ["LIN {X 0.000,Y 0.000,Z 50.000,A 0.000,B 0.000,C 180.000}", "LIN {Z 0.000}"]
    job.write(lines)
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code == 0, done.err
    assert done.json["corrected"] >= 4
    assert done.json["error_after_mm"]["max"] <= 0.002
    written = without_inserted(job.output.read_bytes().decode().splitlines(), done.json)
    assert written[5].startswith("LIN {Z 50.000,X 0.")  # it leads into the cut behind it
    for component in ",X ", ",Y ", ",A ", ",B ", ",C ":
        assert component in written[7]
        assert component in written[9]
    # Where the axes lead, by Pinocchio: the point behind the cut goes back there.
    robot = load_robot(find_robot("kuka_kr270"))
    chain = Chain(robot.joints, robot.flange)
    flange = reference_flange(chain, np.deg2rad([[0, -90, 110, 0, 40, 0]]))
    cell = load_cell(job.folder / "cell.yaml")
    tcp = cell.bases[1].inverse() @ flange[0] @ cell.tools[1].pose
    numbers = dict(word.split() for word in written[9].split("{")[1].split("}")[0].split(","))
    assert float(numbers["X"]) == pytest.approx(tcp.position[0] * 1e3, abs=1e-3)
    assert float(numbers["Y"]) == pytest.approx(tcp.position[1] * 1e3, abs=1e-3)
    assert float(numbers["Z"]) == 60


def test_the_dat_travels_along(compensate, job):
    data = b"DEFDAT PART\nENDDAT"
    (job.folder / "part.dat").write_bytes(data)
    compensate(job.program, "--force")
    assert (job.output.with_suffix(".dat")).read_bytes() == data


@pytest.mark.slow
def test_force_before_and_behind_the_program(compensate, job):
    one = compensate("--force", job.program, "--json", "-").json
    two = compensate(job.program, "--force", "--json", "-").json
    assert one == two
    three = compensate("--force", "-10,360,560@base", job.program, "--json", "-").json
    assert three["force"]["source"].startswith("-10,360,560@base")


def test_force_csv_of_the_program(compensate, job):
    job.write([line for line in LINES if "FORCE" not in line])
    (job.folder / "part.force.csv").write_text("line,fx,fy,fz\n9,0,360,560\n10,0,360,560\n11,0,360,560\n")
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code == 0, done.err
    assert done.json["corrected"] == 3
    assert done.json["force"]["source"] == "part.force.csv"


def test_compensate_off_leaves_a_part_alone(compensate, job):
    lines = list(LINES)
    lines.insert(lines.index(";FORCE 0 200 0"), ";COMPENSATE OFF")
    job.write(lines)
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.code, done.json["corrected"], done.json["uncorrected"]) == (0, 4, 0)


def test_words_behind_the_switch_are_a_remark(compensate, job):
    lines = list(LINES)
    lines.insert(lines.index(";FORCE 0 200 0"), ";COMPENSATE OFF, this is probing")
    job.write(lines)
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.code, done.json["corrected"], done.json["uncorrected"]) == (0, 4, 0)


def test_a_switch_that_is_none_is_told(compensate, job):
    lines = list(LINES)
    lines.insert(lines.index(";FORCE 0 200 0"), ";COMPENSATE: OFF")
    job.write(lines)
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.code, done.json["corrected"]) == (3, 5)
    assert [f["line"] for f in done.json["findings"] if f["code"] == "COR011"] == [18]


def test_a_relative_motion_between_cuts_keeps_the_configuration(compensate, job):
    lines = list(LINES)
    lines[lines.index("LIN {X 400.000}")] = "LIN_REL {Z 100}"
    at = lines.index("LIN {Z 0.000}", 10)
    lines[at] = "LIN {X 400.000,Y 300.000,Z 0.000,A 0.000,B 0.000,C 180.000}"
    job.write(lines)
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.code, done.json["corrected"], done.json["uncorrected"]) == (0, 5, 0)


def test_stated_configurations_that_are_not_the_robots_are_told_once(compensate, job):
    job.write([line.replace("C 180.000}", "C 180.000,S 6,T 63}") for line in LINES])
    done = compensate(job.program, "--force", "--json", "-")
    told = sorted(f["message"][:12] for f in done.json["findings"] if f["code"] == "KIN007")
    assert told == ["the stated T", "the stated c"]


def test_switching_inside_a_cut_leaves_the_whole_cut(compensate, job):
    lines = list(LINES)
    lines.insert(11, ";COMPENSATE OFF")
    job.write(lines)
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code == 3
    assert {f["code"] for f in done.json["findings"]} >= {"COR003"}
    assert done.json["corrected"] == 0 or done.json["corrected"] == 1


def test_a_refused_motion_takes_only_its_own_cut(compensate, job):
    lines = list(LINES)
    lines[10] = NOT_UNDERSTOOD
    job.write(lines)
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.code, done.json["corrected"], done.json["uncorrected"]) == (3, 1, 4)
    codes = [f["code"] for f in done.json["findings"]]
    assert "KRL002" in codes
    assert codes.count("COR003") == 1
    assert job.output.read_bytes().split(b"\r\n")[10] == lines[9].encode()


def test_strict_writes_nothing_on_a_warning(compensate, job):
    lines = list(LINES)
    lines[10] = NOT_UNDERSTOOD
    job.write(lines)
    assert compensate(job.program, "--force", "--strict").code == 1
    assert job.nothing_written()


def test_nothing_is_inserted_where_it_is_not_wanted(compensate, job):
    job.write(JUMPED_LINES)
    done = compensate(job.program, "--force", "--no-insert", "--json", "-")
    assert (done.code, done.json["inserted"], done.json["corrected"]) == (3, 0, 5)
    assert "COR006" in [f["code"] for f in done.json["findings"]]
    assert job.output.read_bytes().count(b"\r\n") == job.program.read_bytes().count(b"\r\n") + 1


def test_a_loose_tolerance_inserts_nothing(compensate, job):
    job.cell(CELL.replace("tolerance: 0.02", "tolerance: 5\ntolerance_deg: 1"))
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.code, done.json["inserted"], done.json["corrected"]) == (0, 0, 5)


def test_the_limit_of_growth_is_told(compensate, job):
    job.cell(CELL.replace("tolerance: 0.02", "tolerance: 0.001") + "max_growth: 1.1\n")
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.code, done.json["inserted"], done.json["corrected"]) == (3, 1, 5)
    assert {"COR014", "COR006"} <= {f["code"] for f in done.json["findings"]}


def test_dry_run_writes_nothing(compensate, job):
    done = compensate(job.program, "--force", "--dry-run")
    assert done.code == 0
    assert job.nothing_written()


def test_predict_writes_only_the_report(compensate, job):
    done = compensate("predict", job.program, "--force", "--json", "-")
    full = compensate(job.program, "--force", "--dry-run", "--json", "-")
    assert done.json["error_before_mm"] == full.json["error_before_mm"]
    assert job.nothing_written()
    compensate("predict", job.program, "--force", "--report", job.folder / "rep")
    assert sorted(p.name for p in (job.folder / "rep").iterdir()) == [
        "part.deflection.csv",
        "part.prediction.html",
        "part.prediction.json",
    ]


def test_absolute_and_process_agree_where_the_robot_does_not_sag(compensate, job):
    one = compensate(job.program, "--force", "--json", "-").json
    job.cell(CELL + "correct: absolute\ncontroller: {absolute_accuracy: false}\n")
    two = compensate(job.program, "--force", "--json", "-").json
    assert two["error_before_mm"]["max"] == pytest.approx(one["error_before_mm"]["max"], rel=1e-6)


def test_the_diff_turns_the_input_into_the_output(compensate, job):
    compensate(job.program, "--force")
    diff = job.output.with_name("part.diff")
    assert diff.read_bytes().startswith(b"--- part.src\n+++ part.src\n@@ -1,")
    patched = job.folder / "patched"
    patched.mkdir()
    shutil.copy(job.program, patched)
    env = {**os.environ, "GIT_CEILING_DIRECTORIES": str(job.folder)}
    command = ["git", "-c", "core.autocrlf=false", "apply", "-p0", "--whitespace=nowarn", str(diff)]
    done = subprocess.run(command, cwd=patched, env=env, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (patched / "part.src").read_bytes() == job.output.read_bytes()


def test_every_hunk_of_the_diff_stands_where_it_says(compensate, job):
    """Strictly: tools that apply a diff search for a hunk that is off by some lines."""
    compensate(job.program, "--force")
    text = job.output.with_name("part.diff").read_bytes()
    hunks = re.split(rb"^@@ -(\d+),(\d+) \+(\d+),(\d+) @@\n", text, flags=re.M)[1:]
    assert len(hunks) >= 5
    for at in range(0, len(hunks), 5):
        body = hunks[at + 4].splitlines(keepends=True)
        for sign, first, count, path in ((b"-", 0, 1, job.program), (b"+", 2, 3, job.output)):
            begin, length = int(hunks[at + first]), int(hunks[at + count])
            lines = path.read_bytes().splitlines(keepends=True)[begin - 1 : begin - 1 + length]
            assert [line[1:] for line in body if line[:1] in (b" ", sign)] == lines


@pytest.mark.parametrize("line", ["WAIT SEC 1\r", ";a\rb", "LIN {X 250.000} ;a\rb"])
def test_a_carriage_return_inside_of_a_line_breaks_no_diff(compensate, job, line):
    lines = list(LINES)
    lines.insert(12, line)
    job.write(lines, "\n")
    compensate(job.program, "--force")
    diff = job.output.with_name("part.diff").read_bytes().split(b"\n")[2:]
    assert {line[:1] for line in diff if line} <= {b"@", b" ", b"+", b"-"}


def test_a_file_name_that_is_no_text(compensate, job):
    name = os.fsdecode(b"t\xe4st.src")
    try:
        program = job.write(LINES, name=name)
    except OSError:
        pytest.skip("the file system takes no such name")
    assert compensate(program, "--force").code == 0
    diff = (job.folder / "compensated" / name).with_suffix(".diff").read_bytes()
    assert diff.startswith(b"--- t\xe4st.src\n+++ t\xe4st.src\n")


def test_json_into_a_file(compensate, job):
    done = compensate(job.program, "--force", "--json", job.folder / "r" / "part.json")
    assert done.code == 0
    assert "error before" in done.out
    report = json.loads((job.folder / "r" / "part.json").read_text())
    assert report == json.loads(job.output.with_name("part.report.json").read_text())
    refused = compensate(job.program, "--force=7", "--json", job.folder / "r" / "part.json")
    assert refused.code == 1
    failed = json.loads((job.folder / "r" / "part.json").read_text())
    assert (failed["exit"], failed["outputs"], failed["findings"][0]["code"]) == (1, [], "FRC002")


def test_json_alone_on_standard_output(compensate, job):
    done = compensate(job.program, "--force", "--json", "-")
    assert set(done.json) >= {
        "program",
        "dialect",
        "robot",
        "motions",
        "corrected",
        "inserted",
        "uncorrected",
        "iterations",
        "force",
        "error_before_mm",
        "error_after_mm",
        "correction_mm",
        "findings",
        "outputs",
        "exit",
    }
    assert done.json["outputs"] == [
        str(job.output.with_name(name))
        for name in ("part.src", "part.report.json", "part.corrections.csv", "part.diff", "part.report.html")
    ]


@pytest.mark.slow
def test_a_locale_or_hash_seed_changes_no_byte(job):
    outputs = []
    for seed, locale in (("0", "C"), ("1", "de_DE.UTF-8")):
        env = {**os.environ, "PYTHONHASHSEED": seed, "LC_ALL": locale}
        command = [sys.executable, "-m", "postproc", str(job.program), "--force", "-q"]
        assert subprocess.run(command, env=env, check=False).returncode == 0
        outputs.append({p.name: p.read_bytes() for p in job.output.parent.iterdir()})
    assert outputs[0] == outputs[1]


def test_corrections_table_reads_as_csv(compensate, job):
    compensate(job.program, "--force")
    text = job.output.with_name("part.corrections.csv").read_text()
    rows = list(csv.DictReader(io.StringIO(text)))
    assert rows[4]["error_0_mm"] != ""
    assert float(rows[4]["error_1_mm"]) < 0.05 * float(rows[4]["error_0_mm"])
    assert float(rows[4]["error_after_mm"]) <= 0.002
