"""Programs that are deep or endless: nobody writes them, and nobody is to wait for them, or to buy memory."""

from __future__ import annotations

import os
import resource
from pathlib import Path

import pytest
from conftest import CELL, LINES
from faults import Child
from test_hostile import within_bounds

DEEP = 100_000
MB = 1_000_000

HEAD, CUT, END = LINES[:8], LINES[8:-1], LINES[-1:]


def around(begin: str, end: str) -> list[str]:
    """The cut inside of a hundred thousand of these."""
    return [*HEAD, *begin.split("\n") * DEEP, *CUT, *end.split("\n") * DEEP, *END]


def target(text: str) -> list[str]:
    return [line.replace("X 100.000", f"X {text}") for line in LINES]


def statement(text: str) -> list[str]:
    return [*HEAD, text, *CUT, *END]


PROGRAMS = {
    "folds": around(";FOLD x", ";ENDFOLD"),
    "folds that stay open": [*HEAD, *[";FOLD x"] * DEEP, *CUT, *END],
    "conditions": around("IF $IN[1] THEN", "ENDIF"),
    "conditions that hold": around("IF TRUE THEN", "ENDIF"),
    "conditions that stay open": [*HEAD, *["IF TRUE THEN"] * DEEP, *CUT, *END],
    "loops": around("WHILE $IN[1]", "ENDWHILE"),
    "loops that run once": around("REPEAT", "UNTIL TRUE"),
    "endless loops": around("LOOP", "ENDLOOP"),
    "choices": around("SWITCH 1\nCASE 1", "ENDSWITCH"),
    "brackets of a number": target("(" * DEEP + "100.0" + ")" * DEEP),
    "indices": target("[" * DEEP + "100.0" + "]" * DEEP),
    "aggregates": target("{X " * DEEP + "100.0" + "}" * DEEP),
    "brackets": statement("R=" + "(" * DEEP + "1" + ")" * DEEP),
    "signs": statement("R=" + "-" * DEEP + "1"),
    "negations": statement("R=" + "NOT " * DEEP + "TRUE"),
    "sums": statement("R=" + "1+" * DEEP + "1"),
    "frames": [line.replace("LIN {X 100", "LIN " + "{X 0}:" * DEEP + "{X 100") for line in LINES],
    "calls": [
        *HEAD, "S0()", *CUT, *END,
        *(line for k in range(DEEP // 5) for line in (f"DEF S{k}()", f"S{k + 1}()", "END")),
    ],
    "calls that give back": [
        *HEAD, "DECL REAL X0", "S0(X0)", *CUT, *END,
        *(line for k in range(DEEP // 5) for line in (f"DEF S{k}(X{k}:OUT)", f"S{k + 1}(X{k})", "END")),
    ],
    "a call of itself": [*HEAD, "part()", *CUT, *END],
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", PROGRAMS)
def test_deep_programs(job, name):
    """Compensated, left and told, or refused: in its time, and never by the end of a stack."""
    job.write(PROGRAMS[name])
    code, said = within_bounds([job.program, "--force", "-q"], job.folder)
    assert code in (0, 1, 3), said
    assert "defect" not in said
    assert job.nothing_written() == (code == 1)


BLOCKS = {
    "brackets": ("ngc", "G1 X" + "[" * DEEP + "1" + "]" * DEEP),
    "comments": ("ngc", "(" * DEEP + "x" + ")" * DEEP),
    "parameters of parameters": ("ngc", "G1 X" + "#" * DEEP + "1"),
    "signs": ("ngc", "G1 X[" + "-" * DEEP + "1]"),
    "sums": ("ngc", "G1 X[" + "1+" * DEEP + "1]"),
    "functions": ("ngc", "#1=" + "SIN[" * DEEP + "1" + "]" * DEEP),
    "conditions": (
        "ngc",
        "\n".join(
            [*(f"O{k} IF [1 EQ 1]" for k in range(DEEP // 4)), *(f"O{k} ENDIF" for k in range(DEEP // 4))]
        ),
    ),
    "loops": ("nc", "WHILE[#1LT1]DO1\n" * DEEP + "END1\n" * DEEP),
    "subprograms": ("nc", "M98 P1\n" * DEEP),
    "conditions of the Sinumerik": ("mpf", "IF 1==1\n" * DEEP + "ENDIF\n" * DEEP),
    "brackets of the Sinumerik": ("mpf", "R1=" + "(" * DEEP + "1" + ")" * DEEP),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BLOCKS)
def test_deep_blocks(job, name):
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\n")
    ending, text = BLOCKS[name]
    path = job.folder / f"part.{ending}"
    path.write_text(f"%\nG21 G90 G17\nT1 M6\nG54\n{text}\nG1 X10 Y0 Z0 F100\nX20\nM30\n%\n")
    code, said = within_bounds([path, "--force=0,0,99", "-q"], job.folder)
    assert code in (0, 1, 3), said
    assert "defect" not in said
    assert job.nothing_written() == (code == 1)


# endless ones


SIZE = 400 * MB
MOST = 150 * MB


def peak(words: list[object], folder: Path) -> tuple[int, str, int]:
    """Exit code, words, and the most memory [bytes] of a run beside what this process has."""
    with open("/proc/self/statm") as stream:
        mine = int(stream.read().split()[1]) * resource.getpagesize()
    child = Child(words, folder)
    code = child.end()
    assert child.memory > 0
    return code, child.said, child.memory - mine


def endless(path: Path, head: bytes, filler: bytes) -> None:
    """400 MB; those of NUL take no room on the disk."""
    with path.open("wb") as stream:
        stream.write(head)
        if filler == b"\0":
            stream.truncate(SIZE)
            return
        part = filler * (4 * MB // len(filler))
        for _ in range(SIZE // len(part)):
            stream.write(part)


@pytest.mark.sample(2)
@pytest.mark.parametrize("filler", [b"\0", b"1 "], ids=["NUL", "numbers"])
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a.src", ["a.src", "--force=0,0,9"]),
        ("a.nc", ["check", "a.nc"]),
        ("a.csv", ["part.src", "--force", "a.csv"]),
        ("a.csv", ["identify", "a.csv", "--robot", "kuka_kr270", "--effects", "joint_compliance"]),
        ("a.dat", ["part.src", "--force=0,0,9", "--config-dat", "a.dat"]),
    ],
    ids=["program", "blocks", "forces", "readings", "config"],
)
def test_an_endless_line_is_not_read_to_its_end(job, monkeypatch, name, words, filler):
    monkeypatch.chdir(job.folder)
    endless(job.folder / name, b"DEF a()\n" if name != "a.csv" else b"line,fx,fy,fz\n", filler)
    try:
        code, said, most = peak(words, job.folder)
    finally:
        (job.folder / name).unlink()
    assert code == 1, said
    assert "FIL003" in said or "FRC003" in said or "MEA" in said
    assert "defect" not in said
    assert most < MOST


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a.yaml", ["part.src", "--force=0,0,9", "--cell", "a.yaml"]),
        ("a.yaml", ["part.src", "--force=0,0,9", "--robot", "a.yaml"]),
        ("a.yaml", ["part.src", "--force", "a.yaml"]),
        ("a.yaml", ["batch", "a.yaml"]),
        ("a.yaml", ["robots", "a.yaml"]),
    ],
    ids=["cell", "robot", "process", "jobs", "shown"],
)
def test_an_endless_yaml_file_is_not_read(job, monkeypatch, name, words):
    monkeypatch.chdir(job.folder)
    endless(job.folder / name, b"a: 1\n", b"\0")
    code, said, most = peak(words, job.folder)
    assert code == 1, said
    assert "larger than" in said
    assert most < MOST


def test_a_program_that_is_too_large_is_told_its_limit(job):
    with job.program.open("r+b") as stream:
        stream.truncate(1_000_000_001)
    code, said, most = peak([job.program, "--force"], job.folder)
    assert code == 1, said
    assert "larger than 1000000000 bytes" in said
    assert most < MOST
    assert os.path.getsize(job.program) == 1_000_000_001
