"""Texts of programs, robots, files and readings do nothing on a page, and are no formula in a table."""

from __future__ import annotations

import json
import re
import unicodedata
from html.parser import HTMLParser

import pytest
from conftest import CELL, LINES
from test_hostile_tables import formulas

from postproc.robot.description import find_robot

MARK = "OWNED"
TURNED = "\u202edcba\u2066\u200b\u2028\x9b"
"""Turns the direction of writing, hides, ends a line, begins an escape."""

EVIL = (
    f"<script>alert('{MARK}')</script>\"'><img src=x onerror=alert('{MARK}')></title></style></textarea>"
    f"--><svg/onload=alert('{MARK}')>{{{{7*7}}}}{TURNED}{{%{MARK}%}}${{{MARK}}}&lt;script&gt;\\u003cscript\\u003e]]>"
)
FILE = f"<img src=x onerror=alert('{MARK}')>{TURNED}\"'&<svg onload=alert('{MARK}')>"
"""A name that a file may have: no slash."""


class Page(HTMLParser):
    """What a browser would run."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.ran: list[str] = []
        self.shown = ""
        self.inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.inside = tag
        for name, value in attributes:
            if name.startswith("on") or (value or "").strip().lower().startswith(
                ("javascript:", "data:text")
            ):
                self.ran.append(f"{tag} {name}={value}")
            if name in ("src", "href") and re.match(r"(https?:)?//", value or ""):
                self.ran.append(f"{tag} {name}={value}")
        if tag in ("img", "iframe", "object", "embed", "base", "form", "link"):
            self.ran += [f"{tag} {dict(attributes)}"] * (
                MARK in str(attributes) or "x" in dict(attributes).values()
            )

    def handle_endtag(self, tag: str) -> None:
        self.inside = ""

    def handle_data(self, data: str) -> None:
        if self.inside != "script":
            self.shown += data
        elif re.search(rf"(?<!\\)\balert\('{MARK}'\)", data) and not _is_data(data):
            self.ran.append(f"script {data[:80]}")


def _is_data(text: str) -> bool:
    """Whether a script is one JSON text, or assigns one."""
    body = re.sub(r"^\s*(const|let|var|window\.)?\s*\w*\s*=\s*", "", text.strip()).rstrip(";")
    try:
        json.loads(body)
    except ValueError:
        return False
    return True


@pytest.fixture
def made(compensate, job, monkeypatch):
    """The folder with all pages and tables made of hostile names and texts."""
    monkeypatch.chdir(job.folder)
    robot = job.folder / f"r{FILE}.yaml"
    text = find_robot("kuka_kr270").read_text()
    robot.write_text(re.sub(r"(?m)^name: .*$", lambda _: "name: " + json.dumps(EVIL), text))
    lines = [LINES[0], ";" + EVIL, *LINES[1:]]
    lines = [line + " ; " + EVIL if "slot" in line else line for line in lines]
    lines += [f"PTP {EVIL}", f"LIN {{X {EVIL}}}"]
    program = job.folder / f"p{FILE}.src"
    program.write_bytes("\r\n".join(lines).encode())
    job.cell(CELL.replace("kuka_kr270", json.dumps(robot.name)))
    readings = job.folder / f"m{FILE}.csv"
    session = "=cmd|" + EVIL.replace('"', '""')
    rows = "".join(
        f"{9 * k},{3 * k - 90},{60 + 9 * k},{8 * k},{45 - 9 * k},{k},{-300 * (k % 3)},{100 * k},"
        f'"{session}",0.0{k},0.1,-0.{k}\n'
        for k in range(1, 10)
    )
    readings.write_text("A1,A2,A3,A4,A5,A6,FZ,FX,SESSION,DX,DY,DZ\n" + rows)
    of = ["--robot", robot, "--effects", "joint_compliance"]
    plane = ["--x", "1500:1700", "--y", "0", "--z", "900", "--grid", "3", "--force=0,0,900"]
    for words in (
        ["program", "--force", "--", program],
        ["predict", "--force", "--report", "predicted", program],
        ["verify", "--force", program, job.output.parent / program.name, "--json", "verified.json"],
        ["batch", program, "--force", "-o", "many", "-j", "1"],
        ["identify", readings, *of, "--page", "identified.html", "-o", "identified.yaml"],
        ["diagnose", readings, "--robot", robot, "--page", "diagnosed.html", "-o", "diagnosed.yaml"],
        ["plan", *of, "--poses", "6", "--loads", "100", "-o", "plan.csv"],
        ["map", "--robot", robot, *plane, "--csv", "map.csv", "--picture", "map.svg"],
    ):
        done = compensate(*words)
        assert done.code in (0, 1, 3), done.err
        assert "defect" not in done.err, done.err[-900:]
    return job.folder


@pytest.mark.slow
def test_pages_run_nothing_of_it(made):
    pages = list(made.rglob("*.html")) + list(made.rglob("*.svg"))
    assert len(pages) >= 5
    shown = 0
    for page in pages:
        looked = Page(page.read_text())
        assert looked.ran == [], page.name
        shown += MARK in looked.shown
    assert shown >= 4


@pytest.mark.slow
def test_pages_are_read_as_they_stand(made):
    """Nothing in them, and in what their scripts are given, turns what is written, or hides."""
    for page in [*made.rglob("*.html"), *made.rglob("*.svg")]:
        text = re.sub(r"\\u([0-9a-fA-F]{4})", lambda found: chr(int(found[1], 16)), page.read_text())
        assert "dcba" in text
        kinds = {
            one for one in set(text) - set("\n\t") if unicodedata.category(one) in ("Cc", "Cf", "Zl", "Zp")
        }
        assert kinds == set(), page.name


@pytest.mark.slow
def test_tables_hold_no_formula(made):
    tables = [path for path in made.rglob("*.csv") if not path.name.startswith("m<")]
    assert len(tables) >= 4
    for table in tables:
        assert formulas(table.read_bytes()) == [], table.name


@pytest.mark.slow
def test_robot_files_are_read_again(compensate, made):
    for name in ("identified.yaml", "diagnosed.yaml"):
        if (made / name).exists():
            assert compensate("robots", made / name).code == 0


@pytest.mark.parametrize(
    "text",
    [
        f"<img src=x onerror=alert('{MARK}')>", "<a href='javascript:1'>", "<script src='//x'></script>",
        f"<script>alert('{MARK}')</script>", "<p onclick=1>", "<iframe src='https://x'>",
    ],
)  # fmt: skip
def test_what_a_page_would_run_is_seen(text):
    assert Page(f"<p>{text}").ran
    assert Page(f"<script>const data = {json.dumps({'a': f'alert({MARK!r})'})};</script>").ran == []
