"""What stands in the place of an input: every kind of input, every kind of thing that is none."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from conftest import CELL, LINES

PLAIN = [line for line in LINES if "FORCE" not in line]
PLANE = ["--x", "1500", "--y", "0", "--z", "900", "--grid", "2", "--force=0,0,9"]

KINDS = {
    "program": ("part.src", ["part.src", "--force=0,0,9"]),
    "program that is checked": ("part.src", ["check", "part.src"]),
    "program that is predicted": ("part.src", ["predict", "part.src", "--force=0,0,9"]),
    "program of a batch": ("part.src", ["batch", "part.src", "--force=0,0,9", "-j", "1"]),
    "program that is verified": ("other.src", ["verify", "part.src", "other.src", "--force=0,0,9"]),
    "cell": ("a.yaml", ["part.src", "--force=0,0,9", "--cell", "a.yaml"]),
    "robot": ("a.yaml", ["part.src", "--force=0,0,9", "--robot", "a.yaml"]),
    "robot that is shown": ("a.yaml", ["robots", "a.yaml"]),
    "robot of a map": ("a.yaml", ["map", "--robot", "a.yaml", *PLANE]),
    "config": ("config.dat", ["part.src", "--force=0,0,9", "--config-dat", "config.dat"]),
    "force": ("f.csv", ["part.src", "--force", "f.csv"]),
    "process": ("p.yaml", ["part.src", "--force", "p.yaml"]),
    "job file": ("jobs.yaml", ["batch", "jobs.yaml"]),
    "readings": ("loads.csv", ["identify", "loads.csv", "--robot", "kuka_kr270", "--effects", "joint_compliance"]),
    "readings of a diagnosis": ("loads.csv", ["diagnose", "loads.csv", "--robot", "kuka_kr270"]),
}  # fmt: skip
"""Name of the input, and the words of a run that reads it."""


def pipe(path: Path) -> None:
    os.mkfifo(path)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def memory(path: Path) -> None:
    path.symlink_to("/proc/self/mem")


def folder(path: Path) -> None:
    path.mkdir()


def nowhere(path: Path) -> None:
    path.symlink_to("nowhere")


def nul(path: Path) -> None:
    path.write_bytes(b"DEF a()\n\0END\n")


def wide(path: Path) -> None:
    path.write_bytes("DEF a()\nEND\n".encode("utf-16"))


def empty(path: Path) -> None:
    path.write_bytes(b"")


def noise(path: Path) -> None:
    path.write_bytes(bytes(range(256)) * 64)


@pytest.fixture
def shop(job, monkeypatch):
    monkeypatch.chdir(job.folder)
    job.write(PLAIN)
    return job


@pytest.mark.sample(6)
@pytest.mark.parametrize("make", [pipe, device, memory, folder, nowhere, nul, wide, empty, noise])
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_input_is_told(compensate, shop, kind, make):
    """A sentence and exit code 1, at once and without a file written, whatever stands there."""
    name, words = KINDS[kind]
    (shop.folder / name).unlink(missing_ok=True)
    make(shop.folder / name)
    done = compensate(*words)
    if (kind, make) == ("config", empty):  # it says nothing, and nothing is asked of it
        return
    assert done.code == 1, done.out + done.err
    assert "defect" not in done.err
    assert name.partition(".")[0] in done.out + done.err
    assert not list(shop.folder.rglob("*.report.json"))


@pytest.mark.parametrize("make", [pipe, device, folder, nowhere])
@pytest.mark.parametrize("name", ["cell.yaml", "part.force.csv", "part.dat"])
def test_what_is_looked_for_and_is_no_file_is_not_there(compensate, shop, name, make):
    (shop.folder / name).unlink(missing_ok=True)
    make(shop.folder / name)
    done = compensate("part.src", "--force")
    assert done.code == 1
    assert {"cell.yaml": "CEL001"}.get(name, "FRC001") in done.err


@pytest.mark.parametrize("kind", KINDS)
def test_a_link_that_leads_to_itself(compensate, shop, kind):
    name, words = KINDS[kind]
    (shop.folder / name).unlink(missing_ok=True)
    (shop.folder / name).symlink_to(name)
    done = compensate(*words)
    assert done.code == 1
    assert "defect" not in done.err


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    "words",
    [
        ["-o", "loop.src"],
        ["-o", "loop/"],
        ["--report", "loop"],
        ["--json", "loop.json"],
        ["-o", "loop.src", "--dry-run"],
    ],
)
def test_an_output_that_is_a_link_to_itself(compensate, shop, words):
    for name in ("loop.src", "loop", "loop.json"):
        (shop.folder / name).symlink_to(name)
    done = compensate("part.src", "--force=0,0,9", *words)
    assert done.code in (0, 1, 3)
    assert "defect" not in done.err


# numbers and words that only look like it


ALIKE = [
    "\u0663\u0666\u0660",
    "\uff11\uff10",
    "\u2212360",
    "1_000",
    "0x10",
    "1e",
    "--1",
    "1,5",
    "\u00bd",
    "\u2460",
    "1\u200b0",
]


@pytest.mark.sample(1)
@pytest.mark.parametrize("number", ALIKE)
def test_what_looks_like_a_number_is_none(compensate, shop, number):
    for spec in (f"0,0,{number}", f"{number},0,0@base"):
        if number == "1,5":
            continue
        assert compensate("part.src", f"--force={spec}").code == 1
    (shop.folder / "f.csv").write_text(f'line,fx,fy,fz\n10,0,0,"{number}"\n')
    assert number == "1,5" or compensate("part.src", "--force", "f.csv").code == 1
    shop.cell(CELL.replace("tolerance: 0.02", f"tolerance: {number}"))
    done = compensate("part.src", "--force=0,0,9")
    assert done.code == 1
    assert "tolerance" in done.err
    shop.cell(CELL)
    assert compensate("part.src", "--force=0,0,9", "--gain", number).code == 2
    assert compensate("map", "--robot", "kuka_kr270", *PLANE, "--tool", f"0,0,{number}").code == 2
    if number != "--1":  # in KRL a difference, and understood as one
        lines = [line.replace("Z -2.000", f"Z {number}") for line in PLAIN]
        shop.program.write_bytes("\r\n".join(lines).encode())
        assert compensate("part.src", "--force=0,0,9").code in (1, 3)
    (shop.folder / "part.ngc").write_text(f"G21 G90\nT1\nG54\nG0 X0 Y0 Z50\nG1 Z0 F500\nX{number}\nY9\nM30\n")
    shop.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\n")
    assert compensate("part.ngc", "--force=0,0,9").code in (1, 3)
    assert compensate("check", "part.ngc").code == 3


@pytest.mark.parametrize("word", ["\uff2c\uff29\uff2e", "L\u0406N", "L\u200bIN", "\u202eLIN", "LIN\u00a0"])
def test_what_looks_like_a_motion_is_told(compensate, shop, word):
    lines = [*PLAIN]
    lines[9] = lines[9].replace("LIN", word)
    shop.program.write_bytes("\r\n".join(lines).encode())
    done = compensate("check", "part.src")
    assert done.code == 3
