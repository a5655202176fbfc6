"""``python -m tests.planted_faults``: faults planted in written programs, and how many of them ``verify`` rejects.

They are planted in the text of what was written, by numbers and lines, without the readers of this package.  A fault is
rejected where the run ends with another code than 0 and says something that it does not say without it.
"""

import re
import shutil
import sys
import tempfile
from pathlib import Path

from postproc.base.findings import Refusal
from postproc.workflows.preparation import Request
from postproc.workflows.program import compensate
from postproc.workflows.verify import verify

ROOT = Path(__file__).parent.parent


class Text:
    """The written files of one program, in which a fault is planted."""

    def __init__(self, folder, names):
        self.folder = folder
        self.lines = {name: (folder / name).read_bytes().decode("latin-1").split("\n") for name in names}

    def write(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
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
            rf"(?<![A-Za-z0-9]){word}(\s*=?\s*)(-?[\d.]+)",
            lambda found: f"{word}{found[1]}{float(found[2]) + value:.5f}",
            line,
            count=1,
        )
        assert count == 1, line
        self.lines[name][row] = new

    def add_at(self, name, pattern, number, place, value):
        """Adds ``value`` to the number at ``place``, from 0, in the brackets of the line."""
        row = self.find(name, pattern, number)
        start = self.lines[name][row].index("[[")
        found = list(re.finditer(r"-?\d[\d.]*(?:E\d+)?", self.lines[name][row][start:]))[place]
        new, one, two = f"{float(found[0]) + value:.6f}", start + found.start(), start + found.end()
        self.lines[name][row] = self.lines[name][row][:one] + new + self.lines[name][row][two:]

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


def component(name, pattern, number, place, value):
    return (
        f"number {place} {value:+g} in {name} {number}",
        lambda text: text.add_at(name, pattern, number, place, value),
    )


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
    other(P, CUT, 37, " C_DIS", " C_VEL"),
    other(P, r"\$APO.CDIS=", 0, "CDIS=", "CDIS=1"),
    other(P, r"\$APO.CDIS=", 0, "$APO.CDIS=", "$APO.CVEL=50\n$APO.CDIS="),
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
    other(S, r"^LIN XP3 C_DIS", 0, " C_DIS", " C_ORI"),
    other(D, r"APO_DIST", 0, "APO_DIST ", "APO_DIST 1"),
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
    other(G, FEED, 12, "X", "G64 P0.3 X"),
    other(G, r"^G21", 0, "G21", "G61 G21"),
]

R, MOVE_L, MOVE_C = "pocket.mod", r"MoveL \[\[.*v50", r"MoveC "
RAPID = [
    component(R, MOVE_L, 0, 0, 0.1),
    component(R, MOVE_L, 1, 1, -0.1),
    component(R, MOVE_L, 2, 2, 0.1),
    component(R, MOVE_L, 3, 3, 0.00087),  # 0.1 deg
    component(R, MOVE_L, 4, 6, 0.00087),
    component(R, MOVE_C, 1, 0, 0.3),
    component(R, MOVE_C, 2, 17, 0.1),
    component(R, r"MoveL \[\[.*v20,", 1, 1, 0.1),
    dropped(R, MOVE_C, 3),
    dropped(R, MOVE_L, 2),
    swapped(R, MOVE_C, 0, 2),
    swapped(R, MOVE_L, 1, 3),
    copied(R, MOVE_L, 2),
    other(R, MOVE_L, 1, "v50", "v60"),
    other(R, MOVE_L, 2, "z1", "fine"),
    other(R, MOVE_L, 1, "z1", "z5"),
    other(R, r"MoveL Offs", 0, "0,0,10", "0,0,9.9"),
    other(R, "wobjdata wPart", 0, "[1600,-80,900]", "[1600.1,-80,900]"),
]

T, PLACE, ANGLES = "pocket.ls", r"^\tX = ", r"^\tW = "
TP = [
    angle(T, PLACE, 2, "X", 0.1),
    angle(T, PLACE, 3, "Y", -0.1),
    angle(T, PLACE, 5, "Z", 0.1),
    angle(T, PLACE, 20, "X", 0.3),
    angle(T, ANGLES, 2, "W", 0.1),
    angle(T, ANGLES, 4, "P", 0.1),
    angle(T, ANGLES, 5, "R", -0.1),
    angle(T, PLACE, 0, "Y", 0.1),
    dropped(T, r":L P\[7\]", 0),
    dropped(T, r":L P\[13\]", 0),
    swapped(T, r":L P\[\d+\] 50mm", 1, 3),
    copied(T, r":L P\[10\]", 0),
    other(T, r":L P\[7\]", 0, "50mm", "60mm"),
    other(T, r":L P\[10\]", 0, "CNT100", "FINE"),
    other(T, r":L P\[10\]", 0, "CNT100", "CNT50"),
    other(T, r":L P\[7\]", 0, "CNT100", "CNT99"),
    other(T, r":L P\[7\]", 0, "CNT100", "CR5"),
    other(T, r":L P\[10\]", 0, "CNT100", "CNT R[1]"),
    other(T, r":L P\[7\]", 0, "P[7]", "P[10]"),
    other(T, r"UTOOL_NUM=1", 0, "UTOOL_NUM=1", "UTOOL_NUM=2"),
]

E, ALONG = "part.src", r"^LIN .*E1 "
TRACK = [
    angle(E, ALONG, 3, "E1", 1.0),
    angle(E, ALONG, 5, "E1", -0.1),
    angle(E, ALONG, 2, "X", 0.1),
    angle(E, ALONG, 4, "Y", -0.1),
    angle(E, ALONG, 4, "A", 0.1),
    dropped(E, ALONG, 4),
    swapped(E, ALONG, 3, 5),
    other(E, ALONG, 4, "E1 ", "E2 "),
]

SAMPLES = {
    "panel": (PANEL, [P], "KRL"),
    "taught": (TAUGHT, [S, D], "KRL, .dat"),
    "milling": (MILLING, [M], "KRL"),
    "pocket": (POCKET, [G], "G-code"),
    "rapid": (RAPID, [R], "RAPID"),
    "tp": (TP, [T], "TP"),
    "track": (TRACK, [E], "KRL, E1"),
}
"""Name -> faults, files, dialect."""


def shortened_panel(folder):
    """The first operation of the panel."""
    rows = (folder / P).read_text().splitlines()
    first, last = (next(n for n, row in enumerate(rows) if f"OPERATION {k}" in row) for k in (2, 9))
    end = next(n for n, row in enumerate(rows) if n > last and row.startswith("PTP"))
    (folder / P).write_text("\n".join(rows[:first] + rows[end:]) + "\n")


def one_force(folder):
    """One force for all cuts, in the base: none steps, so that nothing else is told but the fault."""
    for file in folder.iterdir():
        if file.suffix in (".src", ".ngc", ".mod", ".ls"):
            text = re.sub(
                r"FORCE -?\d[^);\r\n]*", "FORCE 60 180 -60 @base ", file.read_bytes().decode("latin-1")
            )
            file.write_bytes(text.encode("latin-1"))


def along_a_track(folder):
    """A robot on a track goes from 800 to 1200 mm along the cut."""
    cell = """robot: kuka_kr270
tools:
  1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}
bases:
  1: {x: 1500, y: 600, z: 600, a: 0, b: 0, c: 0}
start: [0, -90, 90, 0, 45, 0]
tolerance: 0.02
external_axes: {E1: {kind: track, direction: +y, limits: [0, 4000], start: 800}}
"""
    ends = [(0, 0, 50, 800), (0, 0, 0, 800), (150, 0, 0, 800), (150, 400, 0, 1200), (0, 400, 0, 1200)]
    lines = [f"LIN {{X {x},Y {y},Z {z},A 0,B 0,C 180,E1 {e}}} C_DIS" for x, y, z, e in ends]
    lines = [*lines[:2], ";FORCE -150 260 -60 @feed", *lines[2:], ";FORCE OFF"]
    head = ["DEF part()", "$BASE=BASE_DATA[1]", "$TOOL=TOOL_DATA[1]", "$APO.CDIS=0.5", "$VEL.CP=0.05"]
    home = "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0,E1 800}"
    away = "LIN {X 0,Y 400,Z 50,A 0,B 0,C 180,E1 1200}"
    (folder / "cell.yaml").write_text(cell)
    (folder / E).write_text("\n".join([*head, home, *lines, away, "END", ""]))


def sample(folder, name):
    """A sample's folder."""
    shutil.copytree(
        ROOT / "samples" / name, folder, ignore=shutil.ignore_patterns("compensated"), dirs_exist_ok=True
    )


class Written:
    """What was written for a sample into a folder: request, files, and what ``verify`` says of it without a fault."""

    def __init__(self, name, folder):
        self.files = SAMPLES[name][1]
        folder.mkdir(parents=True, exist_ok=True)
        if name == "track":
            along_a_track(folder)
        elif name == "rapid":
            sample(folder, "irb6700_pocket")
        elif name == "tp":
            sample(folder, "m900ib_pocket")
        else:
            sample(folder, f"kr270_{name}")
        if name == "panel":
            shortened_panel(folder)
        one_force(folder)
        self.request = Request(folder / self.files[0], force="")
        self.output = folder / "compensated"
        compensate(self.request)
        self.code, self.findings = said(self.request, self.output / self.files[0])

    def rejects(self, plant, folder):
        """Whether ``verify`` rejects the program with the fault, in a folder of its own."""
        text = Text(self.output, self.files)
        plant(text)
        text.write(folder / "compensated")
        code, findings = said(self.request, folder / "compensated" / self.files[0])
        return code in (1, 3) and bool(findings - self.findings)


def said(request, program):
    """How ``verify`` ends, and what it says that is no info."""
    try:
        done = verify(request, program)
    except Refusal as refusal:
        return 1, {(one.code, one.message) for one in refusal.findings}
    told = {(one.code, one.message) for one in done.findings if one.severity != "info"}
    return done.exit, told


def main():
    total, seen = 0, 0
    with tempfile.TemporaryDirectory() as place:
        for name, (faults, _, dialect) in SAMPLES.items():
            written = Written(name, Path(place) / name)
            missed = [
                fault
                for number, (fault, plant) in enumerate(faults)
                if not written.rejects(plant, Path(place) / f"{name}{number}")
            ]
            total, seen = total + len(faults), seen + len(faults) - len(missed)
            print(
                f"{name:8} {dialect:10} {len(faults) - len(missed):3} of {len(faults):3} rejected", flush=True
            )
            for fault in missed:
                print(f"    not rejected: {fault}")
    print(f"{seen} of {total} rejected")
    return int(seen < total)


if __name__ == "__main__":
    sys.exit(main())
