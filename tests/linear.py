"""Time and memory of reading hostile files: `python -m tests.linear [WORD ...]` prints both for each case at 1 MB.

A file is what a context makes of a run: one text repeated until the file is as large as wanted, in one long line or in
as many lines.
"""

import contextlib
import gc
import importlib
import multiprocessing
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from linear_robots import (
    RAPID,
    RAPID_AROUND,
    RAPID_BODIES,
    RAPID_HEAD,
    RAPID_LINES,
    RAPID_TAIL,
    TP,
    TP_AROUND,
    TP_HEAD,
    TP_LINES,
    TP_TAIL,
)

from postproc.base.findings import Refusal

MB = 1_000_000
SECONDS, MEGABYTES = 2.0, 300.0
LONGEST = 20
"""Seconds after which a reader is stopped."""


@dataclass(frozen=True)
class Case:
    kind: str
    name: str
    head: str
    unit: str
    tail: str

    def text(self, size: int) -> bytes:
        if "%d" in self.unit:
            unit = len(self.unit) + 3
            middle = "".join(self.unit.replace("%d", str(number)) for number in range(size // unit))
        else:
            middle = self.unit * (size // len(self.unit.encode()))
        return (self.head + middle + self.tail).encode()


RUNS = {
    "blanks": " ", "tabs": "\t", "digits": "1", "zeros": "0", "letters": "a", "quotes": '"', "apostrophes": "'",
    "braces": "{", "parentheses": "(", "brackets": "[", "closed": "[]", "dots": ".", "commas": ",", "signs": "-",
    "equals": "=", "colons": ":", "semicolons": ";", "hashes": "#", "slashes": "a/", "words": "a ",
    "numbers": "1 ",
    "names": "a1.", "pairs": "a=1,",
    "mixed": "{[(,", "umlauts": "ä", "comments": "(a)", "stars": "*", "percent": "%",
}  # fmt: skip

KRL = {
    "bare": ("", ""), "X": ("X", "!"), "a": ("a", "!"), "label": ("a", ":"), "point": ("LIN {X 1", ",Y 2}"),
    "aggregate": ("LIN {", "}"), "after point": ("LIN {X 1,Y 2,Z 3} ", "x"), "name": ("LIN P", ""),
    "assignment": ("R=", "x"), "element": ("A[", "]=1"), "component": ("A.", "=1"), "BAS": ("BAS(#BASE,x", ")"),
    "call": ("F(", ")"), "FOR": ("FOR I=1 TO ", "x"), "IF": ("IF ", " THEN"), "comment": (";", ""),
    "FOLD": (";FOLD ", ""), "INLINE": (";FOLD LIN ", ""), "FORCE": (";FORCE ", ""), "DECL": ("DECL INT ", "x"),
    "WAIT": ("WAIT FOR ", "x"), "TRIGGER": ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO ", "x"), "BASE": ("$BASE=", "x"),
    "SPLINE": ("SPLINE WITH ", "x"), "DEF": ("END\nDEF ", "("), "GOTO": ("GOTO ", "x"),
}  # fmt: skip
KRL_LINES = (
    "LIN {X %d.0,Y 0,Z 0,A 0,B 0,C 180}\n", "LIN {X 1}\n", "PTP P%d\n", "a%d:\n", "GOTO a%d\n", "F%d()\n",
    "R=R+%d\n",
    "DECL INT I%d\n", "DECL E6POS P%d={X 1,Y 2}\n", ";FOLD\n", ";FOLD\n;ENDFOLD\n", "IF R==%d THEN\n", "LOOP\n",
    "END\nDEF F%d()\n", "FOR I=1 TO 2\nENDFOR\n", "FOR I=1 TO 1000000\n", "WHILE TRUE\n", "SWITCH 1\nCASE %d\n",
    "REPEAT\nUNTIL TRUE\n", ";FORCE 1 2 3\n", ";FORCE %d 2 3 @base\n", "$BASE=BASE_DATA[1]\n", "$BASE={X %d}\n",
    "BAS(#BASE,1)\n", "A[%d]=1\n", "S%d=S%d\n", "SPLINE\nSPL P%d\nENDSPLINE\n", "SPLINE\n",
    "INTERRUPT ON %d\n", "\n",
    "\r", "\r\n", "\t\n", "_ORI_TYP.", "S 1{", "FOR I=1 TO 9 LIN P%d\n",
    "FOR I=1 TO 10\nLIN_REL {X 0.1}\nENDFOR\n",
    "FOR I=1 TO 900\nLIN_REL {X 0.1}\nENDFOR\n", "P%d=P1\n", "LIN P1\n", "CIRC {X 1},{X %d}\n", "; a%d\n",
    "TRIGGER WHEN DISTANCE=0 DELAY=0 DO F%d()\n", "WAIT SEC 1\n", "ENUM E%d a,b\n", "STRUC S%d INT a\n",
    "RETURN\n", "REPEAT\nSPL {X 1}\nUNTIL $IN[1]\n", "WHILE $IN[1]\nLIN {X 1}\nENDWHILE\n", "CALL(P%d,1)\n",
    "EXT F%d(INT:IN)\n", "P%d=BASE_DATA[2]\n$BASE=P1\n",
)  # fmt: skip
AROUND = {
    "FOR": ("FOR I=1 TO 1000", "ENDFOR"), "FOR twice": ("FOR I=1 TO 9\nFOR J=1 TO 9", "ENDFOR\nENDFOR"),
    "WHILE": ("I=1\nWHILE I<9\nI=I+1", "ENDWHILE"), "REPEAT": ("I=1\nREPEAT\nI=I+1", "UNTIL I>9"),
    "LOOP": ("LOOP", "ENDLOOP"),
    "calls": ("F()\nF()\nF()\nEND\nDEF F()", ""), "GOTO": ("I=1\nagain:\nI=I+1", "IF I<9 THEN\nGOTO again\nENDIF"),
    "IF": ("IF $IN[1] THEN", "ENDIF"), "SPLINE": ("SPLINE", "ENDSPLINE"), "DEF": ("END\nDEF G()", "END\nDEF H()"),
}  # fmt: skip
BODIES = (
    "LIN {X %d.0,Y 0,Z 0,A 0,B 0,C 180}\n", "LIN_REL {X 0.1}\n", "R=R+1\n", "LIN P1\n", "; a\n",
    "IF R==%d THEN\nENDIF\n",
    "FOR K=1 TO 9\nLIN {X 1}\nENDFOR\n", "$BASE=BASE_DATA[1]\n", ";FORCE 1 2 3\n", "P[R]={X 1}\n",
    "SPL {X %d}\n", "G()\n",
)  # fmt: skip
KRL_HEAD = "DEF part()\n$BASE=BASE_DATA[1]\n$TOOL=TOOL_DATA[1]\n"

GCODE = {
    "bare": ("", ""), "X": ("X", "!"), "O": ("O", "!"), "N": ("N", "!"), "G1 X": ("G1 X1", "!"),
    "G1 X=": ("G1 X=", "x"),
    "number": ("G1 X", "."), "expression": ("G1 X[", "]"), "comment": ("(", ")"), "rest": ("G1 X1 ;", ""),
    "slash": ("/", "G1"), "percent": ("%", ""), "CS": ("#CS", "x"), "CS ON": ("#CS ON[", "x"),
    "parameter": ("#1=", "x"),
    "named": ("#<", ">=1"), "O-word": ("O1 IF [", "]"), "O-name": ("O<", "> SUB"), "GOTO": ("GOTO ", "x"),
    "IF": ("IF ", " GOTO a"), "R": ("R1=", "x"), "DEF": ("DEF REAL ", "=1"), "MSG": ('MSG("', '")'),
    "M117": ("M117 ", ""),
    "G28": ("G28 ", "#"), "G1": ("G1 ", "#"), "TRANS": ("TRANS ", "x"),
    "T": ('T="', ""), "FORCE": ("(FORCE ", ")"),
    "VAR": ("V.P.", "=1"), "CYCLE": ("CYCLE81(", ")"), "CR": ("G2 X1 CR=", ""), "A3": ("G1 A3=", " B3=1 C3=2"),
}  # fmt: skip
GCODE_LINES = (
    "X%d\n", "G1 X%d Y1 Z2 F100\n", "G2 X%d I1 J0\n", "N%d G1 X1\n",
    "(FORCE 1 2 3)\n", "(a%d)\n", "; a\n", "O%d SUB\n",
    "O%d IF [1 EQ 1]\n", "#%d=1\n", "#1=[#1+1]\n", "M98 P%d\n", "GOTO %d\n", "a%d:\n", "R%d=1\n", "R1=R1+1\n",
    "G54\nG55\n", "G10 L2 P1 X%d\n", "G92 X%d\n", "G68 X0 Y0 R%d\n", "TRANS X%d\n", "ATRANS X1\n",
    "G91\nX1\nG90\n",
    "X\n", "X1 X2\n", "T%d M6\n", "#CS DEF[%d][1,2,3,0,0,0]\n", "#CS ON[1,2,3,0,0,0]\n", "/X1\n",
    "G41 D1\n", "%\n",
    "\n", "\r", "\r\n", " \n", "\t\n", "REPEATB a%d\n", "FOR R1=1 TO 2\n", "M30\n", "G4 P1\n", "G5 X1\n",
    "G43 H%d\n", "IF [1]\n",
    "WHILE [#1 LT 9] DO1\n", "END1\n", "DEF REAL A%d\n", "SUPA G0 X1\n", "O; \r", "O0; ", "G28 X\n",
    "O%d\n", "PROC A%d\n",
    "G98 G81 X%d Y1 Z1 R2\n", "G81 X1 Z1 R2\nX1\nG80\n", "G81 X1 Z1 R2\nX%d\nX1\nX2\nX3\nX4\n",
    "G98 G18 G81 X1 Y1 R2\nG17\n", "G98 G81 X1 Z1 R2\nM8\nM9\n", "G98 G83 X1 Z1 R2 Q1\nG92 X1\n", "X%d U1\n",
)  # fmt: skip
GCODE_AROUND = {
    "M98 P100\n": ("", "M2\nO100\nG1 X1\nM99\n"), "M98 P100 L2\n": ("", "M2\nO100\nG91 G1 X1\nM99\n"),
    "G65 P100 A1\n": ("", "M2\nO100\nG1 X#1\nM99\n"),
    "O100 CALL [1]\n": ("O100 SUB\nG1 X#1\nO100 ENDSUB\n", "M2\n"),
    "G1 X#1\n": ("O1 REPEAT [9]\n#1=[#1+1]\n", "O1 ENDREPEAT\n"), "G10 L2 P1 X%d\nG1 X1\n": ("G55\n", ""),
    "G1 X[#1+%d]\n": ("WHILE [#1 LT 9] DO1\n#1=[#1+1]\n", "END1\n"), "G1 X=R1+%d\n": ("R1=0\nLOOP\n", "ENDLOOP\n"),
    "G43 H1\nX1\n": ("G10 L10 P1 Z5\n", ""), "D1\nTOFFL=2\nX1\n": ("", ""), "$P_PFRAME=CTRANS(X,%d)\nX1\n": ("", ""),
}  # fmt: skip
"""What comes again and again, and what is before and after it."""
CONTROLS = {
    "linuxcnc": "G21 G90 G17 G54\nG1 X1 F100\n",
    "fanuc": "%\nO0001\nG21 G90 G17 G54\nG1 X1 F100\n",
    "sinumerik": "G71 G90 G17 G54\nTRAORI\nSTOPRE\nG1 X1 F100\n",
    "kuka_cnc": "#TRAFO ON\nG90 G17 G54\nG1 X1 F100\n",
}

ROBOT = (Path(__file__).parent.parent / "robots" / "abb_irb120.yaml").read_text()
CELL = """\
robot: kuka_kr270
tools:
  1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}
bases:
  1: {x: 1500, y: -200, z: 600, a: 0, b: 0, c: 0}
"""
JOBS = "programs: [a.src]\nforce: true\n"
YAML = {
    "bare": ("", ""), "key": ("k", ": 1\n"), "value": ("name: ", "\n"), "text": ('name: "', '"\n'),
    "list": ("name: [", "]\n"),
    "map": ("name: {", "}\n"), "comment": ("# ", "\n"), "block": ("name: |\n  ", "\n"),
    "anchor": ("name: &", " 1\n"),
    "tag": ("name: !", " 1\n"), "joint": ("  A", ": [-1, 1]\n"), "number": ("tolerance: ", "\n"),
}  # fmt: skip
YAML_LINES = (
    "k%d: 1\n", "k: 1\n", "- 1\n", "# a\n", "\n", "\r", "'a': b\n", "{a: ", "[[", "- - ", "? a\n", "---\n",
    "a: &a%d 1\n",
    "  A%d: [-1, 1]\n", "  %d: {x: 1}\n", "- {effect: e%d}\n", "- a%d.src\n", "'*%d.src': {gain: 0.5}\n",
)  # fmt: skip

FORCES = "s_mm,FX,FY,FZ\n0,1,2,3\n"
READINGS = "A1,A2,A3,A4,A5,A6,FZ,DX,DY,DZ\n1,2,3,4,5,6,-100,0.1,0.2,0.3\n"
TABLE = {
    "bare": ("", ""), "comment": ("# a", "\n"), "value": ("# sigma_mm: ", "\n"),
    "target": ("# target", ": 1 2 3\n"),
    "target value": ("# target a: ", "\n"), "tool": ("# tool: ", "\n"), "unit": ("A1 [", "]\n"),
    "head": ("A1,", "\n"),
    "name": ("A", " [deg],A2\n"), "spaced head": ("A1", "x\n"), "quoted": ('"', '"\n'), "row": ("1,", "\n"),
}  # fmt: skip
TABLE_LINES = (
    "1,2,3,4,5,6,7,8,9,%d\n", "%d,1,2,3\n", "# a%d: 1\n", "# target M%d: 1 2 3\n", "# sigma_mm: %d\n",
    "# \n", '"\n', "\n",
    "\r", ",\n", '"a",', "%d,", "a\n", "1;2\n", "1 2\t", '""', "'=", "nan,", "1e", "1,2,3,4,5,6,7,8,9,x\n",
    "%d,-\n", "#\n", "a%d [mm],", "a%d(", "0,1,2,3\n", "-%d,1,2,3\n",
)  # fmt: skip

URDF = '<robot name="r"><link name="l"/>'
URDF_TEXTS = {
    "mesh": ('<link name="m"><visual><geometry><mesh filename="', '"/></geometry></visual></link>'),
    "link": ('<link name="', '"/>'), "joint": ('<joint name="', '" type="fixed"/>'),
    "kind": ('<joint name="a" type="', '"/>'),
    "origin": ('<joint name="a" type="fixed"><origin xyz="', '"/></joint>'), "text": ("", ""),
    "comment": ("<!-- ", " -->"),
    "parent": ('<joint name="a" type="fixed"><parent link="', '"/><child link="l"/></joint>'),
}  # fmt: skip
URDF_UNITS = (
    '<link name="l%d"/>', '<joint name="a%d" type="fixed"/>', '<mesh filename="a%d"/>', "<a>", "<a/>", "<link>",
    '<joint name="j%d" type="fixed"><parent link="l"/><child link="l"/></joint>',
    '<link name="k%d"/><joint name="j%d" type="fixed"><parent link="l"/><child link="k%d"/></joint>',
)  # fmt: skip


def _chain(size: int) -> bytes:
    """Links one after the other."""
    joint = '<link name="c{0}"/><joint name="j{0}" type="revolute"><parent link="c{1}"/><child link="c{0}"/></joint>'
    each = (joint.format(number + 1, number) for number in range(size // 110))
    return ('<robot name="r"><link name="c0"/>' + "".join(each) + "</robot>").encode()


@dataclass(frozen=True)
class Chain(Case):
    def text(self, size: int) -> bytes:
        return _chain(size)


def _cases(kind: str, head: str, contexts: dict, lines: tuple, end: str = "", tail: str = "") -> list[Case]:
    found = [
        Case(kind, f"{context}, {run}", head + before, unit, after + end + tail)
        for context, (before, after) in contexts.items()
        for run, unit in RUNS.items()
    ]
    return found + [Case(kind, repr(line), head, line, tail) for line in lines]


def _first(kind: str, contexts: dict, rest: str) -> list[Case]:
    """What is hostile comes first, then a file as it should be."""
    return [
        Case(kind, f"first {context}, {run}", before, unit, after + rest)
        for context, (before, after) in contexts.items()
        for run, unit in RUNS.items()
    ]


def all_cases() -> list[Case]:
    found = _cases("src", KRL_HEAD, KRL, KRL_LINES, "\n", "END\n")
    starts = {"nothing": "", "X": "X", "DEF": "DEF ", "GLOBAL": "GLOBAL", "&": "&ACCESS"}
    found += _first("first.src", {name: (start, "!\n") for name, start in starts.items()}, "LIN {X 1}\n")
    found += [
        Case("src", f"{name} around {body!r}", f"{KRL_HEAD}{start}\n", body, f"{end}\nEND\n")
        for name, (start, end) in AROUND.items()
        for body in BODIES
    ]
    found += _cases("dat", "DEFDAT part\n", KRL, KRL_LINES, "\n", "ENDDAT\n")
    found += _cases("mod", RAPID_HEAD, RAPID, RAPID_LINES, "\n", RAPID_TAIL)
    found += [
        Case("mod", f"{name} around {body!r}", f"{RAPID_HEAD}{start}\n", body, f"{end}{RAPID_TAIL}")
        for name, (start, end) in RAPID_AROUND.items()
        for body in RAPID_BODIES
    ]
    found += _cases("ls", TP_HEAD, TP, TP_LINES, "\n", TP_TAIL)
    found += [
        Case("ls", f"{name} around {body!r}", f"{TP_HEAD}{start}\n", body, end + TP_TAIL)
        for name, (start, end) in TP_AROUND.items()
        for body in TP_LINES
    ]
    for control, head in CONTROLS.items():
        found += _cases(control, head, GCODE, GCODE_LINES, "\n")
        found += [
            Case(control, f"between others {unit!r}", head + before, unit, after)
            for unit, (before, after) in GCODE_AROUND.items()
        ]
    found += _first("first.ngc", {start: (start, "!\n") for start in ("", *"XOG:%")}, "G1 X1\n")
    for kind, head in {"robot": ROBOT, "cell": CELL, "jobs": JOBS}.items():
        found += _cases(kind, head, YAML, YAML_LINES)
        found += _first(kind, YAML, head)
    for kind, head in {"forces": FORCES, "readings": READINGS}.items():
        found += _cases(kind, head, TABLE, TABLE_LINES)
        found += _first(kind, TABLE, head)
        found += [Case(kind, f"first {line!r}", "", line, "\n" + head) for line in TABLE_LINES]
    found += _cases("urdf", URDF, URDF_TEXTS, URDF_UNITS, "", "</robot>")
    found.append(Chain("urdf", "chain", "", "", ""))
    return found


def read_case(kind: str, folder: Path, text: bytes) -> None:
    """Reads `text` as a file of this kind; a refusal is an answer."""
    with contextlib.suppress(Refusal):
        _READERS[kind](folder, text)


def _program(name: str) -> Callable[[Path, bytes], None]:
    def read(folder: Path, text: bytes) -> None:
        path = folder / name
        path.write_bytes(text)
        if name.endswith(".dat"):
            path = folder / "part.src"
            path.write_text(KRL_HEAD + "LIN P1\nLIN P2\nEND\n")
        importlib.import_module("postproc.workflows.preparation").read_program(path)

    return read


def _yaml(kind: str) -> Callable[[Path, bytes], None]:
    def read(folder: Path, text: bytes) -> None:
        path = folder / f"{kind}.yaml"
        path.write_bytes(text)
        if kind == "robot":
            robot = importlib.import_module("postproc.robot.description").load_robot(path)
            importlib.import_module("postproc.model.files").read_terms(robot)
        elif kind == "cell":
            importlib.import_module("postproc.cell.read_cell").load_cell(path)
        else:
            (folder / "a.src").write_text(KRL_HEAD + "END\n")
            importlib.import_module("postproc.batching.job_file").jobs_of([str(path)], {})

    return read


def _forces(folder: Path, text: bytes) -> None:
    (folder / "f.csv").write_bytes(text)
    (folder / "part.src").write_text(
        KRL_HEAD + "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}\n$VEL.CP=0.05\n"
        "LIN {X 0,Y 0,Z 50,A 0,B 0,C 180}\nLIN {X 100}\nLIN {Y 100}\nEND\n"
    )
    (folder / "cell.yaml").write_text(CELL + "start: [0, -90, 90, 0, 45, 0]\n")
    importlib.import_module("postproc.api").predict(folder / "part.src", force=str(folder / "f.csv"))


def _readings(folder: Path, text: bytes) -> None:
    (folder / "r.csv").write_bytes(text)
    joints = [(f"A{number}", False) for number in range(1, 7)]
    importlib.import_module("postproc.measurements.read_csv").read_measurements(folder / "r.csv", joints)


def _urdf(folder: Path, text: bytes) -> None:
    (folder / "r.urdf").write_bytes(text)
    importlib.import_module("postproc.robot.urdf").read_urdf(folder / "r.urdf")


_READERS: dict[str, Callable[[Path, bytes], None]] = {
    "src": _program("part.src"), "first.src": _program("part.src"), "dat": _program("part.dat"),
    "mod": _program("part.mod"), "ls": _program("part.ls"),
    "linuxcnc": _program("part.ngc"), "fanuc": _program("part.nc"), "sinumerik": _program("part.mpf"),
    "kuka_cnc": _program("part.nc"), "first.ngc": _program("part.ngc"), "robot": _yaml("robot"),
    "cell": _yaml("cell"),
    "jobs": _yaml("jobs"), "forces": _forces, "readings": _readings, "urdf": _urdf,
}  # fmt: skip


@dataclass(frozen=True)
class Cost:
    """Of the processor, not of the clock: others work on the machine too."""

    seconds: float
    megabytes: float
    error: str


def measure(case: Case, size: int, longest: int = LONGEST) -> Cost:
    """Seconds and megabytes that reading takes more than this process; in a process of its own."""
    receive, send = multiprocessing.get_context("fork").Pipe(False)
    process = multiprocessing.get_context("fork").Process(target=_measured, args=(case, size, longest, send))
    process.start()
    send.close()
    try:
        cost = receive.recv()
    except EOFError:
        cost = Cost(float(longest), 0.0, "stopped")
    process.join()
    return cost


def _measured(case: Case, size: int, longest: int, send) -> None:
    signal.setitimer(signal.ITIMER_PROF, longest)
    # A collection would also visit, and copy, what the process that was forked held: it is the oldest generation, and
    # not frozen, which a command of its own is not either (the reader then would not let it be looked over).
    gc.freeze()
    gc.unfreeze()
    text = case.text(size)
    with tempfile.TemporaryDirectory() as name:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        start = time.process_time()
        error = ""
        try:
            read_case(case.kind, Path(name), text)
        except BaseException as each:
            error = repr(each)[:200]
        seconds = time.process_time() - start
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    send.send(Cost(seconds, (peak - before) / 1024, error))


def is_linear(case: Case, size: int = 50_000) -> bool:
    """Whether four times as much of ``size`` bytes takes less than eight times as long, where square growth takes 16:
    what else runs on the machine changes times of the processor by less than half."""
    few, many = (min(measure(case, each).seconds for _ in range(2)) for each in (size, 4 * size))
    return many < 8 * few


def import_readers() -> None:
    """So that no process measures imports."""
    for name in (
        "workflows.preparation",
        "batching.job_file",
        "api",
        "model.files",
        "measurements.read_csv",
        "robot.urdf",
    ):
        importlib.import_module(f"postproc.{name}")


def main(words: list[str]) -> None:
    size = int(words.pop(0)) if words and words[0].isdigit() else MB
    import_readers()
    costs = []
    for case in all_cases():
        title = f"{case.kind}: {case.name}"
        if any(word not in title for word in words):
            continue
        cost = measure(case, size)
        costs.append((cost, title))
        if cost.seconds > SECONDS * size / MB or cost.megabytes > MEGABYTES or cost.error:
            print(f"{cost.seconds:7.2f} s {cost.megabytes:6.0f} MB  {title}  {cost.error}", flush=True)
    print(f"{len(costs)} cases of {size} bytes; the slowest:")
    for cost, title in sorted(costs, key=lambda each: -each[0].seconds)[:20]:
        print(f"{cost.seconds:7.2f} s {cost.megabytes:6.0f} MB  {title}")
    print("the largest:")
    for cost, title in sorted(costs, key=lambda each: -each[0].megabytes)[:10]:
        print(f"{cost.seconds:7.2f} s {cost.megabytes:6.0f} MB  {title}")


if __name__ == "__main__":
    main(sys.argv[1:])
