"""Texts of programs, robots and files do not drive the terminal that shows them."""

from __future__ import annotations

import io
import json
import re
import unicodedata

import pytest
from conftest import CELL, LINES
from hypothesis import example, given
from hypothesis import strategies as st
from rich.table import Table
from rich.text import Text

from postproc.base.sanitize import sanitize, sanitize_lines
from postproc.cli.console import SafeConsole
from postproc.robot.description import find_robot

EVIL = "\x1b]0;owned\x07\x1b[31m\x9b31m\u202edcba\u2066\u200b\u2028"
"""Sets a title, a colour by two ways, turns the direction of writing, hides, and ends a line."""


def driving(text: str) -> list[str]:
    return [one for one in text if one != "\n" and unicodedata.category(one) in ("Cc", "Cf", "Zl", "Zp")]


@given(st.text())
@example(EVIL + "\u2029\x00\n\t")
def test_what_is_shown_is_to_be_read(text):
    stream = io.StringIO()
    console = SafeConsole(stream)
    table = Table(title=Text(text))
    table.add_column(Text(text))
    table.add_row(Text(text))
    for one in (Text(text), table):
        console.print(one)
    assert driving(stream.getvalue()) == []
    for shown, keeps in ((sanitize(text), ""), (sanitize_lines(text), "\n")):
        wanted = [one if one in keeps or not (driving(one) or one == "\n") else "?" for one in text]
        assert shown == "".join(wanted)


@pytest.fixture
def evil(job):
    """A program and a robot of hostile names, full of hostile texts."""
    robot = job.folder / f"r{EVIL}.yaml"
    text = find_robot("kuka_kr270").read_text()
    text = re.sub(r"(?m)^name: .*$", lambda _: "name: " + json.dumps("r" + EVIL), text)
    robot.write_text(text)
    lines = [LINES[0], ";" + EVIL, ";FORCE " + EVIL, f"X{EVIL}()", *LINES[1:]]
    lines += ["DEF x()", f"LIN {EVIL}", f"LIN {{X {EVIL}}}", "END"]
    program = job.folder / f"p{EVIL}.src"
    program.write_bytes("\r\n".join(lines).encode())
    job.cell(CELL.replace("kuka_kr270", json.dumps(robot.name)))
    return program, robot


@pytest.mark.slow
def test_nothing_of_it_reaches_the_terminal(compensate, job, evil, monkeypatch):
    program, robot = evil
    monkeypatch.chdir(job.folder)
    output = job.output.parent / program.name
    table = job.folder / f"f{EVIL}.csv"
    table.write_text(f"line,fx,fy,fz\n{EVIL},1,2,3\n")
    readings = job.folder / f"m{EVIL}.csv"
    rows = "".join(
        f"{9 * k},{-90 + 3 * k},{60 + 9 * k},{8 * k},{45 - 9 * k},{k},{-300 * k},s{EVIL[:9]},0.{k},0.1,-0.{k}\n"
        for k in range(1, 10)
    )
    readings.write_text("A1,A2,A3,A4,A5,A6,FZ,SESSION,DX,DY,DZ\n" + rows)
    plane = ["--x", "1500:1600", "--y", "0", "--z", "900", "--grid", "2", "--force=0,0,9"]
    shown = 0
    for words, codes in (
        (["program", program, "--force", "-v"], (0, 3)),
        (["program", program, "--force", table], (1,)),
        (["program", program, f"--force={EVIL}"], (1,)),
        (["program", program, "--cell", EVIL], (1,)),
        (["check", program, "-v"], (3,)),
        (["predict", program, "--force"], (0, 3)),
        (["verify", program, output, "--force"], (0, 3)),
        (["batch", program, "--force", "-j", "1", "-v"], (0, 3)),
        (["batch", f"{EVIL}*"], (1,)),
        (["robots"], (0,)),
        (["robots", robot], (0,)),
        (["robots", EVIL], (1,)),
        (["map", "--robot", robot, *plane], (0, 3)),
        (["identify", readings, "--robot", robot, "--effects", "joint_compliance"], (0, 1, 3)),
        (["diagnose", readings, "--robot", robot], (0, 1, 3)),
        (["identify", readings, "--robot", robot, "--effects", EVIL], (1, 2)),
        (["plan", "--robot", robot, "--effects", EVIL, "--poses", "8", "-o", "plan.csv"], (1, 2)),
        ([EVIL], (1, 2)),
        (["--" + EVIL], (2,)),
        (["schema", EVIL], (2,)),
        (["check", "--explain", EVIL], (2,)),
    ):
        done = compensate(*words)
        assert done.code in codes, ascii(done.out + done.err)
        assert driving(done.out + done.err) == [], ascii(words)
        shown += "owned" in done.out + done.err
    assert shown > 10
