"""A batch that is killed at any moment and run again: every result whole, none missing, no work lost but that in work.

``POSTPROC_KILLS=20`` kills it twenty times instead of three.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import CELL

pytestmark = pytest.mark.slow

KILLS = int(os.environ.get("POSTPROC_KILLS", "3"))
PROGRAMS, WORKERS = 8, 2


def a_long_program(path: Path, number: int, motions: int) -> None:
    """A cut of many short straight motions with a force; LF and CRLF files with and without a data list."""
    lines = [
        f"DEF {path.stem}()",
        "$BASE=BASE_DATA[1]",
        "$TOOL=TOOL_DATA[1]",
        "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}",
        "LIN {X 0,Y 0,Z 50,A 0,B 0,C 180}",
        ";FORCE -360 50 560 @base",
    ]
    for x in np.linspace(0.0, 400.0, motions):
        lines.append(f"LIN {{X {x:.3f},Y {30 * np.sin(x / 40 + number):.3f},Z -2,A 0,B 0,C 180}} C_DIS")
    lines += [";FORCE OFF", "LIN {X 400,Y 0,Z 80,A 0,B 0,C 180}", "END", ""]
    path.write_bytes("\r\n".join(lines).encode())
    if number % 2:
        path.with_suffix(".dat").write_bytes(f"DEFDAT {path.stem}\r\nENDDAT\r\n".encode())


def batch(folder: Path) -> subprocess.Popen:
    words = [
        sys.executable,
        "-m",
        "postproc",
        "batch",
        str(folder),
        "--force",
        "-j",
        str(WORKERS),
        "--json",
        "-",
    ]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True)


def finished(folder: Path) -> dict[str, str]:
    """name -> state, after a run to the end."""
    process = batch(folder)
    out, _ = process.communicate(timeout=300)
    assert process.returncode == 0
    return {one["name"]: one["state"] for one in json.loads(out)["programs"]}


def results(folder: Path) -> dict[str, bytes]:
    """All results but the summary, which says what was unchanged."""
    return {
        path.name: path.read_bytes()
        for path in (folder / "compensated").glob("*")
        if path.is_file() and path.name.startswith("part")
    }


@pytest.fixture(scope="module")
def shop(tmp_path_factory):
    """A folder of programs, what a run that is let alone makes of them, and how long it takes."""
    folder = tmp_path_factory.mktemp("killed")
    (folder / "cell.yaml").write_text(CELL)
    for number in range(PROGRAMS):
        a_long_program(folder / f"part{number}.src", number, 300)
    began = time.monotonic()
    assert set(finished(folder).values()) == {"done"}
    return folder, results(folder), time.monotonic() - began


@pytest.mark.parametrize("kill", range(KILLS))
def test_killed_and_run_again(shop, kill):
    folder, wanted, seconds = shop
    shutil.rmtree(folder / "compensated", ignore_errors=True)
    process = batch(folder)
    time.sleep(random.Random(kill).uniform(0.2, 1.0) * seconds)
    # The whole group, as a power cut would; or the one that has the others, as the kernel would for want of memory.
    os.killpg(process.pid, signal.SIGKILL) if kill % 2 else process.kill()
    process.communicate()
    records = {path.name[: -len(".json")] for path in (folder / "compensated" / ".compensate").glob("*.json")}
    there = {path.name for path in (folder / "compensated").glob("*.src")}
    states = finished(folder)
    have = results(folder)
    assert have.keys() == wanted.keys()
    assert all(have[name] == wanted[name] for name in wanted)
    unchanged = {name for name, state in states.items() if state == "unchanged"}
    assert unchanged >= records
    assert len(there - unchanged) <= WORKERS
    left = [path for path in folder.rglob("*") if ".tmp" in path.name or path.suffix == ".lock"]
    assert left == []


def test_a_killed_writer_leaves_the_others_whole(shop):
    """Beside a run that is killed while it writes, what is there is the whole result or none."""
    folder, wanted, seconds = shop
    shutil.rmtree(folder / "compensated", ignore_errors=True)
    process = batch(folder)
    deadline = time.monotonic() + 20 * seconds
    while not list((folder / "compensated").glob("*.src")) and time.monotonic() < deadline:
        time.sleep(0.001)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    for path in (folder / "compensated").glob("part*.src"):
        assert path.read_bytes() == wanted[path.name]
    assert set(finished(folder)) == {f"part{number}.src" for number in range(PROGRAMS)}
    assert results(folder) == wanted
