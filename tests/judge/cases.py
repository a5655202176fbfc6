"""Programs of the classes that matter between, before and after the poses, made by code of their own.

A case is a folder with a program and its cell; the command runs on it as a user runs it, and the judge reads what it
wrote.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .cell import Cell
from .force import RULE
from .judge import NotComparable, Verdict, judge
from .motion import MM
from .reader import read

PACKAGE = Path(__file__).parents[2]
"""Where the package that is judged lies; ``python -m tests.judge --package`` names another."""
SAMPLES, ROBOTS = PACKAGE / "samples", PACKAGE / "robots"
DEG = 180 / np.pi
FLIP = 5e-6


@dataclass(frozen=True)
class Case:
    """``build`` writes the program and its cell into a folder and returns the program.  options: of the command.
    wanted: "within" the tolerances along the path; "refused" before anything is written; "not worse" than the original,
    cut by cut; "same" bytes as the original; "steady", a correction that does not turn back.  step [m]: of the
    judge's samples.  judged: "orientation" whole, the tool's "axis" where its spin is free, or the "position" alone."""

    name: str
    build: Callable[[Path], Path]
    options: tuple[str, ...] = ()
    wanted: str = "within"
    step: float = 1.0 * MM
    judged: str = "orientation"


@dataclass
class Outcome:
    """What a case came to; mm and deg.  failed: what is not as wanted, in words."""

    case: Case
    exit: int
    verdict: Verdict | None = None
    verify: float | None = None
    verify_before: float | None = None
    flips: int = 0
    message: str = ""
    failed: list[str] = field(default_factory=list)


def run(case: Case, folder: Path, verify: bool = False, rule: str = RULE, package: Path = PACKAGE) -> Outcome:
    """Write the case into ``folder``, run the command, judge what it wrote; ``verify``: ask the command's own;
    rule: of the force at vertices."""
    program = case.build(folder)
    done = _command(program, "--force", "--quiet", *case.options, package=package)
    output = folder / "compensated" / program.name
    lines = (done.stderr + done.stdout).strip().splitlines()
    outcome = Outcome(case, done.returncode, message=lines[0].replace(str(folder), "") if lines else "")
    if case.wanted == "refused":
        told = re.search(r"\b[A-Z]{3}\d{3}\b", outcome.message)
        if done.returncode != 1 or output.exists() or not told:
            outcome.failed.append("not refused")
        return outcome
    if not output.exists():
        outcome.failed.append("nothing written")
        return outcome
    if case.wanted == "same" and output.read_bytes() != program.read_bytes():
        outcome.failed.append("motions changed")
    if case.wanted == "steady":
        outcome.flips = _flips(output, Cell.load(folder / "cell.yaml"))
        if outcome.flips:
            outcome.failed.append(f"turns back {outcome.flips} times")
        told = _command("verify", program, output, "--force", "--json", "-", package=package)
        if done.returncode == 0 and told.returncode:
            said = json.loads(told.stdout)
            outcome.failed.append("verify rejects it: " + ", ".join(_codes(said)))
        return outcome
    try:
        outcome.verdict = judge(program, output, folder / "cell.yaml", step=case.step, rule=rule)
        outcome.failed += _failures(case, outcome.verdict)
    except (NotComparable, ArithmeticError, ValueError) as error:
        outcome.failed.append(f"{type(error).__name__}: {error}")
    if not verify:
        return outcome
    told = _command("verify", program, output, "--force", "--json", "-", package=package)
    if told.stdout.lstrip().startswith("{"):
        said = json.loads(told.stdout)
        if case.wanted == "within" and done.returncode == 0 and said["exit"]:
            outcome.failed.append("verify rejects it: " + ", ".join(_codes(said)))
        found = [said.get(which) or {} for which in ("compensated", "original")]
        outcome.verify, outcome.verify_before = (
            None if one.get("max") is None else max(one["max"], one.get("missed") or 0.0) for one in found
        )
    return outcome


def _codes(said: dict) -> list[str]:
    return sorted({one["code"] for one in said["findings"] if one["severity"] != "info"})


def _command(*words: object, package: Path = PACKAGE) -> subprocess.CompletedProcess[str]:
    """The command line in a process of its own, which sees no other package than that."""
    return subprocess.run(
        [sys.executable, "-m", "postproc", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        cwd=tempfile.gettempdir(),
        env={**os.environ, "PYTHONPATH": str(package)},
    )


def _failures(case: Case, verdict: Verdict) -> list[str]:
    before, after, cell = verdict.before, verdict.after, verdict.cell
    failed: list[str] = []
    if case.wanted == "same":
        return failed
    if case.wanted == "not worse":
        for cut in np.unique(before.cut):
            ends = [(r.distance[r.cut == cut].max(), r.missed[cut]) for r in (before, after)]
            if max(ends[1]) > max(ends[0]) + 1e-6:
                failed.append(f"cut {cut + 1} is worse: {max(ends[0]) / MM:.3f} -> {max(ends[1]) / MM:.3f}")
    else:
        if after.largest > cell.tolerance:
            failed.append("position")
        if case.judged != "position" and after.axis.max() > cell.tolerance_angle:
            failed.append("tool axis")
        if case.judged == "orientation" and after.angle.max() > cell.tolerance_angle:
            failed.append("orientation")
    if after.stops > before.stops:
        failed.append(f"{after.stops - before.stops} stops")
    if len(after.backwards) > len(before.backwards):
        failed.append(f"{len(after.backwards)} backwards")
    if after.unsettled and case.wanted == "within":
        failed.append(f"{after.unsettled} places not found")
    return failed


def _flips(output: Path, cell: Cell) -> int:
    """How often a program along a straight line turns back, by more than 5 um, across that line."""
    cut = np.array([m.position for m in read(output, cell) if not m.air][2:-1])
    line = cut[-1] - cut[0]
    line /= np.linalg.norm(line)
    across = cut - np.outer(cut @ line, line)
    turns = 0
    for steps in np.diff(across, axis=0).T:
        signs = np.sign(steps[np.abs(steps) > FLIP])
        turns += int((signs[1:] != signs[:-1]).sum())
    return turns


# Programs

CELL = """\
robot: kuka_kr270
tools:
  1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}
bases:
  1: {x: 1500, y: -200, z: 600, a: 0, b: 0, c: 0}
start: [0, -90, 90, 0, 45, 0]
tolerance: 0.02
"""
FIVE_AXIS = CELL + "orientation: {a: 0, b: 0, c: 180}\ndialect: {name: fanuc}\n"
HEAD = ["DEF part()", "BAS(#INITMOV,0)", "$BASE=BASE_DATA[1]", "$TOOL=TOOL_DATA[1]"]
HOME = "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}"


def krl(
    *lines: str, cell: str = CELL, home: str = HOME, head: tuple[str, ...] = ()
) -> Callable[[Path], Path]:
    def build(folder: Path) -> Path:
        (folder / "cell.yaml").write_text(cell)
        text = "\r\n".join([*HEAD, *head, home, "$VEL.CP=0.05", *lines, "END", ""])
        (folder / "part.src").write_bytes(text.encode())
        return folder / "part.src"

    return build


def gcode(*lines: str, cell: str = FIVE_AXIS) -> Callable[[Path], Path]:
    def build(folder: Path) -> Path:
        (folder / "cell.yaml").write_text(cell)
        (folder / "part.nc").write_text("\n".join(["%", "O1", *lines, "M30", "%", ""]))
        return folder / "part.nc"

    return build


def sample(name: str, program: str, scale: float = 1.0) -> Callable[[Path], Path]:
    """A sample, with the forces of its comments scaled."""

    def build(folder: Path) -> Path:
        for file in (SAMPLES / name).iterdir():
            if file.is_file():
                shutil.copy(file, folder / file.name)
        path = folder / program
        lines = path.read_bytes().decode("latin-1").splitlines(keepends=True)

        def scaled(match: re.Match[str]) -> str:
            return match[1] + " ".join(f"{scale * float(v):.4f}" for v in match[2].split()) + match[3]

        pattern = re.compile(r"^(\s*[;(]\s*FORCE )([-\d. ]+?)(\s*@.*)$", re.S)
        if scale > 2.5:
            cell = folder / "cell.yaml"
            cell.write_text(cell.read_text() + "max_correction: 20\n")
        path.write_bytes("".join(pattern.sub(scaled, line) for line in lines).encode("latin-1"))
        return path

    return build


def pose(
    x: float, y: float, z: float, a: float = 0.0, b: float = 0.0, c: float = 180.0, more: str = ""
) -> str:
    return f"{{X {x:.3f},Y {y:.3f},Z {z:.3f},A {a:.3f},B {b:.3f},C {c:.3f}{more}}}"


CUT = ";FORCE -150 260 -60 @feed"
OFF = ";FORCE OFF"


def pole(lean: float, words: str, begin: str) -> Callable[[Path], Path]:
    """Five axes under G43.4: a cut that leans by ``lean`` deg, begun upright or leaning already, about two words."""

    def turned(b: float, c: float) -> str:
        return (
            f"B{b:.3f} C{c:.3f}"
            if words == "BC"
            else f"A{b * np.cos(c / DEG):.3f} B{b * np.sin(c / DEG):.3f}"
        )

    first = 0.0 if begin == "upright" else lean
    return gcode(
        "G21 G90 G17 G54", "T1 M6", "G43.4 H1", f"G0 X0. Y0. Z50. {turned(first, -45)}", "S9000 M3", "G1 Z0. F600",
        "(FORCE -150 260 -60 @FEED)",
        f"G1 X60. {turned(first, -45)} F1800", f"G1 X120. {turned(lean, -45)}", f"G1 X180. {turned(lean, -30)}",
        f"G1 X180. Y100. {turned(lean, 15)}", f"G1 X60. Y140. {turned(lean / 2, 60)}",
        "(FORCE OFF)", "G1 Z50. F3000",
    )  # fmt: skip


def lead_in(radius: float, lean: float) -> Callable[[Path], Path]:
    """Five axes in KRL: an arc on and an arc off, all of it leaning, the lean turning with the feed."""
    r = radius
    corners = [(0, 0, 0), (100, 0, 0), (100, 80, 90), (0, 80, 180)]
    lines = [f"LIN {pose(-r, -r, 40, 0, lean, 180)}", f"LIN {pose(-r, -r, -5, 0, lean, 180)}", CUT]
    lines.append(f"CIRC {pose(-0.2929 * r, -0.7071 * r, -5)},{pose(0, 0, -5, 0, lean, 180)} C_DIS")
    for x, y, _ in corners[1:]:
        lines.append(f"LIN {pose(x, y, -5, 0, lean * np.cos(x), 180 + lean * np.sin(y))} C_DIS")
    lines += [f"LIN {pose(0, 10, -5, 0, lean, 180)} C_DIS", f"LIN {pose(-r, -r + 10, -5, 0, lean, 180)}"]
    return krl(*lines, OFF, f"LIN {pose(-r, -r + 10, 50, 0, lean, 180)}", head=("$APO.CDIS=0.5",))


RAIL_FILE = "on_rail.yaml"


def track(begin: float, end: float, stated: str, start: float = 500.0) -> Callable[[Path], Path]:
    """A robot on a track along +y: E1 from ``begin`` to ``end`` [mm] along the cut, the part standing still.

    stated: in the robot file ("rail"), in the cell ("cell"), or not at all ("unstated")."""

    def build(folder: Path) -> Path:
        here = [begin, begin, end, end]
        more = [f",E1 {e:.3f}" for e in here]
        cell = CELL.replace("y: -200", f"y: {begin - 200:.0f}")
        if stated == "rail":
            robot = (ROBOTS / "kuka_kr270.yaml").read_text()
            robot = robot.replace("  kuka: {unit", "  rail: +y\n  kuka: {unit")
            robot = robot.replace("  A1: [", "  E1: {kind: prismatic, limits: [0, 4000], unit: mm}\n  A1: [")
            robot = re.sub(r"\bc([1-6]):", lambda c: f"c{int(c[1]) + 1}:", robot)
            rigid = "      c1: {value: 0, unit: m/N, source: rigid}\n      c2:"
            robot = robot.replace("      c2:", rigid, 1)
            (folder / RAIL_FILE).write_text(robot)
            cell = cell.replace("kuka_kr270", RAIL_FILE).replace("start: [", f"start: [{start:.0f}, ")
        elif stated == "cell":
            cell += f"external_axes: {{E1: {{kind: track, direction: +y, limits: [0, 4000], start: {start:.0f}}}}}\n"
        return krl(
            f"LIN {pose(0, 0, 50, more=more[0])}", f"LIN {pose(0, 0, 0, more=more[0])}", CUT,
            f"LIN {pose(150, 0, 0, more=more[1])} C_DIS", f"LIN {pose(150, 400, 0, more=more[2])} C_DIS",
            f"LIN {pose(0, 400, 0, more=more[3])}", OFF, f"LIN {pose(0, 400, 50, more=more[3])}",
            cell=cell, home=HOME.replace("A6 0", f"A6 0{more[0]}"), head=("$APO.CDIS=0.5",),
        )(folder)  # fmt: skip

    return build


def spline(*body: str) -> Callable[[Path], Path]:
    return krl(f"LIN {pose(0, 0, 50)}", f"LIN {pose(0, 0, 0)}", CUT, "SPLINE", *body, "ENDSPLINE", OFF,
               f"LIN {pose(300, 0, 50)}")  # fmt: skip


def circle(orientation: str, kind: str) -> Callable[[Path], Path]:
    return krl(
        f"$ORI_TYPE={orientation}", f"$CIRC_TYPE={kind}", f"LIN {pose(0, 0, 50)}", f"LIN {pose(0, 0, 0)}", CUT,
        f"LIN {pose(100, 0, 0)}", f"CIRC {pose(142.426, 17.574, 0)},{pose(160, 60, 0, a=40)}",
        f"LIN {pose(160, 160, 0, a=40)}", OFF, f"LIN {pose(160, 160, 50, a=40)}",
    )  # fmt: skip


def square(suffix: str, distance: float) -> Callable[[Path], Path]:
    corners = [(150, 0), (150, 100), (0, 100), (0, 2)]
    return krl(
        f"LIN {pose(0, 0, 50)}", f"LIN {pose(0, 0, 0)}", CUT,
        *(f"LIN {pose(x, y, 0)} {suffix}".strip() for x, y in corners), OFF, f"LIN {pose(0, 2, 50)}",
        head=(f"$APO.CDIS={distance}",),
    )  # fmt: skip


def turn_over(begin: float) -> Callable[[Path], Path]:
    """A first LIN that turns the tool by 180 deg about its own axis."""
    body = [f"LIN {pose(20 * i, 0, 0, a=begin)} C_DIS" for i in range(1, 12)]
    return krl(
        f"LIN {pose(0, 0, 50, a=0)}", f"LIN {pose(0, 0, 0, a=begin)}", CUT, *body,
        f"LIN {pose(240, 0, 0, a=begin)}", OFF, f"LIN {pose(240, 0, 50, a=begin)}", head=("$APO.CDIS=0.5",),
    )  # fmt: skip


def steps_of_force() -> Callable[[Path], Path]:
    return krl(
        f"LIN {pose(0, 0, 50)}", f"LIN {pose(0, 0, 0)}", ";FORCE -60 100 -30 @feed", f"LIN {pose(100, 0, 0)} C_DIS",
        ";FORCE -150 260 -60 @feed", f"LIN {pose(200, 0, 0)} C_DIS",
        ";FORCE 150 -260 -60 @feed", f"LIN {pose(300, 0, 0)} C_DIS",
        ";FORCE -30 50 -10 @feed", f"LIN {pose(400, 0, 0)}", OFF, f"LIN {pose(400, 0, 50)}", head=("$APO.CDIS=0.5",),
    )  # fmt: skip


def small_step_of_force() -> Callable[[Path], Path]:
    """Straight on where the force steps a little: the program has no corner there, its correction has one."""
    return krl(
        f"LIN {pose(0, 0, 50)}", f"LIN {pose(0, 0, 0)}", ";FORCE -60 100 -30 @feed", f"LIN {pose(100, 0, 0)} C_DIS",
        ";FORCE -123 212 -51 @feed", f"LIN {pose(200, 0, 0)}", OFF, f"LIN {pose(200, 0, 50)}", head=("$APO.CDIS=0.5",),
    )  # fmt: skip


def step_into_a_turn(radius: float, pieces: int, ramp: str = "") -> Callable[[Path], Path]:
    """A force that turns with the path and steps where a half circle begins: an arc, or as many straight motions."""
    turn = np.linspace(0.0, np.pi, pieces + 1)[1:]
    half = [f"X{radius * (1 - np.cos(a)):.4f} Y{radius * np.sin(a):.4f}" for a in turn]
    if pieces == 1:
        half = [f"G2 X{2 * radius:.4f} Y0. I{radius:.4f} J0."]
    body = [
        "G21 G90 G17 G54",
        "T1 M6",
        "G0 X-40. Y0. Z20.",
        "G1 Z0. F600",
        "(FORCE 250 80 0 @FEED)",
        "X0.",
        *half,
    ]
    leave = [f"G1 X{2 * radius:.4f} Y-40.", "(FORCE OFF)", "G1 Z20. F3000"]
    return gcode(*body, *leave, cell=FIVE_AXIS + ramp)


def helix(turns: int) -> Callable[[Path], Path]:
    body = [f"G3 X40. Y0. Z{-2.0 * k - 2:.3f} I-40. J0." for k in range(turns)]
    return gcode("G21 G90 G17 G54", "T1 M6", "G0 X40. Y0. Z20.", "G1 Z0. F600", "(FORCE -150 260 -60 @FEED)", *body,
                 "(FORCE OFF)", "G1 Z20. F3000", cell=FIVE_AXIS.replace("fanuc", "linuxcnc"))  # fmt: skip


LOST = """
  - effect: {}
    parameters:
      {}: {{value: 2.0e-4, unit: rad, source: made up}}
"""
RADIAL = ";FORCE -250 0 -60 @feed"


def straight(effect: str, parameter: str) -> Callable[[Path], Path]:
    """A radial line and force, of which axis 1 sees nothing but the third decimal, with lost motion there."""
    cell = CELL.replace("x: 1500, y: -200", "x: 0, y: 0").replace("kuka_kr270", "loose.yaml")
    cell += (
        "correct: absolute\ncontroller: {absolute_accuracy: false}\n"  # lost motion is there with any force
    )
    turn = np.radians(11.3)

    def at(v: float, z: float = 0.0) -> str:
        return pose((1500 + v) * np.cos(turn), (1500 + v) * np.sin(turn), z, a=11.3)

    lines = [f"LIN {at(v)} C_DIS" for v in range(3, 300, 3)]
    made = krl(f"LIN {at(0, 50)}", f"LIN {at(0)}", RADIAL, *lines, f"LIN {at(300)}", OFF, f"LIN {at(300, 50)}",
               cell=cell, head=("$APO.CDIS=0.5",))  # fmt: skip

    def build(folder: Path) -> Path:
        robot = (ROBOTS / "kuka_kr270.yaml").read_text()
        (folder / "loose.yaml").write_text(robot.rstrip() + "\n" + LOST.format(effect, parameter))
        return made(folder)

    return build


def positioner(begin: float, end: float) -> Callable[[Path], Path]:
    """A part on a table that turns about a line along z beside it, while the tool goes along the part."""
    cell = CELL + (
        "external_axes: {E1: {kind: positioner, axis: +z, point: [1650, 0, 500], limits: [-180, 180], start: 0,"
        " bases: [1]}}\n"
    )
    begun, ended = f",E1 {begin:.3f}", f",E1 {end:.3f}"
    return krl(
        f"LIN {pose(0, 100, 50, a=-begin, more=begun)}", f"LIN {pose(0, 100, 0, a=-begin, more=begun)}", CUT,
        f"LIN {pose(100, 100, 0, a=-begin, more=begun)} C_DIS", f"LIN {pose(250, 150, 0, a=-end, more=ended)} C_DIS",
        f"LIN {pose(250, 250, 0, a=-end, more=ended)}", OFF, f"LIN {pose(250, 250, 50, a=-end, more=ended)}",
        cell=cell, home=HOME.replace("A6 0", f"A6 0{begun}"), head=("$APO.CDIS=0.5",),
    )  # fmt: skip


CASES: list[Case] = [
    *(Case(f"panel, forces x {f:g}", sample("kr270_panel", "panel.src", f), step=2 * MM) for f in (0.5, 1, 2.5, 5)),
    Case("taught", sample("kr270_taught", "taught.src")),
    Case("pocket, arcs", sample("kr270_pocket", "pocket.ngc"), judged="position"),
    *(
        Case(f"pole {words} {begin}, lean {lean}", pole(lean, words, begin), judged="axis")
        for words in ("BC", "AB")
        for begin in ("upright", "leaning")
        for lean in range(9)
    ),
    *(Case(f"lead-in r {r}, lean {b}", lead_in(r, b)) for r, b in ((10, 0), (10, 8), (25, 15))),
    *(
        Case(f"track, {how}, {begin} to {end}", track(begin, end, how))
        for how in ("rail", "cell")
        for begin, end in ((500, 500), (1100, 1100), (800, 1200))
    ),
    Case("track, not stated", track(1100, 1100, "unstated"), wanted="refused"),
    *(Case(f"positioner, {a} to {b}", positioner(a, b)) for a, b in ((0, 0), (20, 20), (0, 25))),
    *(
        Case(f"axis 1 by rounding alone, {effect}", straight(effect, name), wanted="steady")
        for effect, name in (("hysteresis", "w1"), ("backlash", "b1"))
    ),
    Case("spline, SPL", spline(*(f"SPL {pose(x, y, 0)}" for x, y in ((80, 10), (160, 40), (230, 30), (300, 0))))),
    Case("spline, SLIN", spline(f"SLIN {pose(100, 0, 0)}", f"SLIN {pose(200, 20, 0)}", f"SLIN {pose(300, 0, 0)}")),
    *(
        Case(f"CIRC {ori} {kind}", circle(ori, kind))
        for ori in ("#VAR", "#CONSTANT")
        for kind in ("#BASE", "#PATH")
    ),
    Case("corners, exact", square("", 0.5)),
    *(Case(f"corners, C_DIS {d:g}", square("C_DIS", d)) for d in (0.5, 2.0)),
    Case("half a turn first", turn_over(180.0)),
    Case("steps of force", steps_of_force()),
    Case("a small step of force", small_step_of_force()),
    *(
        Case(f"step into a turn, r {r:g}, {n} motions{', ramp 20' if ramp else ''}", step_into_a_turn(r, n, ramp),
             judged="position")
        for r, n, ramp in ((4, 1, ""), (4, 1, "force_ramp: 20\n"), (8, 1, ""), (4, 36, "force_ramp: 20\n"))
    ),
    *(Case(f"helix, {n} turns", helix(n), judged="position") for n in (1, 4)),
    Case("corners, tolerance 10, no insertions", lambda f: _loose(f), ("--no-insert",), wanted="not worse"),
    Case("panel, tolerance 10, no insertions", lambda f: _loose(f, "kr270_panel", "panel.src"), ("--no-insert",),
         wanted="not worse", step=2 * MM),
    Case("taught, tolerance 10, no insertions", lambda f: _loose(f, "kr270_taught", "taught.src"), ("--no-insert",),
         wanted="not worse"),
    Case("helix, no insertions", helix(4), ("--no-insert",), wanted="not worse", judged="position"),
    Case("gain 0", square("C_DIS", 0.5), ("--gain", "0"), wanted="same"),
    Case("gain 0.5", square("C_DIS", 0.5), ("--gain", "0.5"), wanted="not worse"),
]  # fmt: skip


def _loose(folder: Path, name: str = "", program: str = "") -> Path:
    path = sample(name, program)(folder) if name else square("C_DIS", 0.5)(folder)
    cell = folder / "cell.yaml"
    cell.write_text(re.sub(r"tolerance: 0\.02", "tolerance: 10", cell.read_text()))
    return path
