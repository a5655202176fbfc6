"""Faults planted in written programs: ``verify`` rejects every one of them.

The faults are planted in the text of what was written, by numbers and lines, without the readers of this package.  A
fault is rejected where the run ends with another code than 0 and says something that it does not say without it.
"""

import re
import shutil
from pathlib import Path

import pytest

from postproc.base.findings import Refusal
from postproc.workflows.preparation import Request
from postproc.workflows.program import compensate
from postproc.workflows.verify import verify

SAMPLES = Path(__file__).parent.parent / "samples"


class Text:
    """The written files of one program, in which a fault is planted."""

    def __init__(self, folder, names):
        self.folder = folder
        self.lines = {name: (folder / name).read_bytes().decode("latin-1").split("\n") for name in names}

    def write(self, folder):
        folder.mkdir(exist_ok=True)
        for name, lines in self.lines.items():
            (folder / name).write_bytes("\n".join(lines).encode("latin-1"))

    def find(self, name, pattern, number):
        """The row of the ``number``-th line with ``pattern``."""
        rows = [row for row, line in enumerate(self.lines[name]) if re.search(pattern, line)]
        return rows[number]

    def add(self, name, pattern, number, word, value):
        """Adds ``value`` to the number behind ``word``."""
        row = self.find(name, pattern, number)
        line = self.lines[name][row]
        new, count = re.subn(
            rf"(?<![A-Za-z0-9]){word}( ?)(-?[\d.]+)",
            lambda found: f"{word}{found[1]}{float(found[2]) + value:.5f}",
            line,
            count=1,
        )
        assert count == 1, line
        self.lines[name][row] = new

    def replace(self, name, pattern, number, old, new):
        row = self.find(name, pattern, number)
        assert old in self.lines[name][row], self.lines[name][row]
        self.lines[name][row] = self.lines[name][row].replace(old, new, 1)

    def drop(self, name, pattern, number):
        del self.lines[name][self.find(name, pattern, number)]

    def copy(self, name, pattern, number):
        """A copy of the line, before it; its number says where a fault goes on."""
        row = self.find(name, pattern, number)
        self.lines[name].insert(row, self.lines[name][row])

    def swap(self, name, pattern, one, other):
        a, b = self.find(name, pattern, one), self.find(name, pattern, other)
        rows = self.lines[name]
        assert rows[a] != rows[b]
        rows[a], rows[b] = rows[b], rows[a]


def angle(name, pattern, number, word, value):
    return f"{word} {value:+g} in {name} {number}", lambda text: text.add(name, pattern, number, word, value)


def dropped(name, pattern, number):
    return f"line {number} of {name} is missing", lambda text: text.drop(name, pattern, number)


def swapped(name, pattern, one, other):
    return f"lines {one} and {other} of {name} are swapped", lambda text: text.swap(name, pattern, one, other)


def copied(name, pattern, number, word=None, value=0.0):
    def plant(text):
        text.copy(name, pattern, number)
        if word:
            text.add(name, pattern, number, word, value)

    return f"line {number} of {name} comes twice, {word} {value:+g}", plant


def other(name, pattern, number, old, new):
    return (
        f"{old!r} is {new!r} in {name} {number}",
        lambda text: text.replace(name, pattern, number, old, new),
    )


P, CUT = "panel.src", r"LIN \{X .* C_DIS"
PANEL = [
    angle(P, CUT, 30, "A", 0.1),
    angle(P, CUT, 45, "B", 0.1),
    angle(P, CUT, 60, "C", -0.1),
    angle(P, CUT, 12, "X", 0.1),
    angle(P, CUT, 21, "X", -0.1),
    angle(P, CUT, 33, "Y", 0.1),
    angle(P, CUT, 47, "Z", 0.1),
    angle(P, CUT, 70, "Z", -0.1),
    dropped(P, CUT, 25),
    dropped(P, CUT, 40),
    copied(P, CUT, 50),
    copied(P, CUT, 33, "Z", 0.1),
    copied(P, CUT, 61, "Y", -0.3),
    swapped(P, CUT, 30, 31),
    swapped(P, CUT, 52, 54),
    other(P, CUT, 35, " C_DIS", ""),
    other(P, r"\$VEL.CP=0.0360", 0, "0.0360", "0.0720"),
    other(P, r"\$TOOL=", 0, "TOOL_DATA[1]", "{X 300,Y 0,Z 180,A 0,B 89.9,C 0}"),
    other(P, r"\$BASE=", 0, "BASE_DATA[1]", "{X 1250,Y 450.1,Z 800,A -90,B 0,C 0}"),
    other(P, CUT, 41, ",A -", ",A "),
    angle(P, r"LIN \{X .*Z 50\.", 0, "Z", 0.1),
    angle(P, r"LIN \{X .*Z 50\.", 0, "A", 0.1),
    angle(P, r"PTP \{A1", 0, "A1", 0.1),
]

S, D, POINT = "taught.src", "taught.dat", r"DECL E6POS XP"
TAUGHT = [
    angle(D, POINT + "4=", 0, "X", 0.1),
    angle(D, POINT + "5=", 0, "Y", -0.1),
    angle(D, POINT + "3=", 0, "Z", 0.1),
    angle(D, POINT + "4=", 0, "A", 0.1),
    angle(D, POINT + "4=", 0, "B", 0.1),
    angle(D, POINT + "5=", 0, "C", -0.1),
    angle(D, POINT + "1=", 0, "Z", 0.1),
    angle(D, POINT + "2=", 0, "X", 0.1),
    dropped(S, r"^LIN XP4", 0),
    swapped(S, r"^LIN XP", 2, 4),
    other(D, r"DECL FDAT FP4=", 0, "TOOL_NO 1", "TOOL_NO 2"),
    other(D, r"DECL FDAT FP4=", 0, "BASE_NO 1", "BASE_NO 2"),
    other(S, r"^LIN XP3 C_DIS", 0, " C_DIS", ""),
]

M = "bracket.src"
MILLING = [
    angle(M, r"^CIRC", 0, "X", 0.3),
    angle(M, r"^CIRC", 1, "Y", -0.3),
    angle(M, r"^LIN \{X .*Y .*Z -", 1, "A", 0.1),
    angle(M, r"^LIN \{X .*Y .*Z -", 2, "Y", 0.1),
    angle(M, r"^LIN \{X 440.000,Y -2.000", 0, "Y", 0.1),
    swapped(M, r"^CIRC", 0, 1),
    swapped(M, r"^LIN \{X 440.000", 0, 1),
    dropped(M, r"^CIRC", 1),
    dropped(M, r"^LIN \{X 440.000,Y -1.500", 0),
    other(M, r"^\$VEL.CP=0.0600", 0, "0.0600", "0.0500"),
]

G, FEED = "pocket.ngc", r"^G[123] .*X"
POCKET = [
    angle(G, FEED, 8, "X", 0.1),
    angle(G, FEED, 11, "Y", -0.1),
    angle(G, r"^G3 .*I", 1, "X", 0.1),
    angle(G, r"^G3 .*I", 3, "I", 0.3),
    angle(G, r"^G0 X.*Z30", 0, "X", 0.1),
    angle(G, r"^G0 X.*Z2", 1, "Y", 0.1),
    angle(G, r"F1800", 3, "F", 10),
    dropped(G, FEED, 14),
    dropped(G, r"^G3 ", 4),
    swapped(G, FEED, 20, 22),
    other(G, r"^G21", 0, "G54", "G55"),
    other(G, r"^G3 .*X", 2, "G3", "G2"),
    other(G, FEED, 9, "X", "Z-1.9 X"),
]

FAULTS = [
    pytest.param(sample, plant, id=f"{sample}: {name}")
    for sample, faults in (("panel", PANEL), ("taught", TAUGHT), ("milling", MILLING), ("pocket", POCKET))
    for name, plant in faults
]


def shortened_panel(folder):
    """The first operation of the panel."""
    rows = (folder / P).read_text().splitlines()
    first, last = (next(n for n, row in enumerate(rows) if f"OPERATION {k}" in row) for k in (2, 9))
    end = next(n for n, row in enumerate(rows) if n > last and row.startswith("PTP"))
    (folder / P).write_text("\n".join(rows[:first] + rows[end:]) + "\n")


def one_force(folder):
    """One force for all cuts, in the base: none steps, so that nothing else is told but the fault."""
    for file in folder.iterdir():
        if file.suffix in (".src", ".ngc"):
            text = re.sub(
                r"FORCE -?\d[^)\r\n]*", "FORCE 60 180 -60 @base", file.read_bytes().decode("latin-1")
            )
            file.write_bytes(text.encode("latin-1"))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Name of a sample -> its original, what was written for it, and what ``verify`` says of that."""
    known = {}

    def made(name):
        if name not in known:
            folder = tmp_path_factory.mktemp(name) / f"kr270_{name}"
            shutil.copytree(SAMPLES / f"kr270_{name}", folder, ignore=shutil.ignore_patterns("compensated"))
            if name == "panel":
                shortened_panel(folder)
            one_force(folder)
            files = {"panel": [P], "taught": [S, D], "milling": [M], "pocket": [G]}[name]
            request = Request(folder / files[0], force="")
            compensate(request)
            known[name] = (
                request,
                folder / "compensated",
                files,
                said(request, folder / "compensated" / files[0]),
            )
        return known[name]

    return made


def said(request, program):
    """How ``verify`` ends, and what it says that is no info."""
    try:
        done = verify(request, program)
    except Refusal as refusal:
        return 1, {(one.code, one.message) for one in refusal.findings}
    told = {(one.code, one.message) for one in done.findings if one.severity != "info"}
    return done.exit, told


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["panel", "taught", "milling", "pocket"])
def test_what_was_written_is_not(written, name):
    code, told = written(name)[3]
    if name == "milling":  # a straight line that ends in a stop is divided, and stops where it is
        told = {one for one in told if "the motion stops where the original flows" not in one[1]}
        code = 0
    assert (code, told) == (0, set())


@pytest.mark.sample(1)
@pytest.mark.parametrize(("name", "plant"), FAULTS)
def test_a_planted_fault_is_rejected(written, tmp_path, name, plant):
    request, folder, files, before = written(name)
    text = Text(folder, files)
    plant(text)
    text.write(tmp_path / "compensated")
    code, told = said(request, tmp_path / "compensated" / files[0])
    assert code in (1, 3)
    assert told - before[1]


def test_there_are_fifty_of_them():
    assert len(FAULTS) >= 50
