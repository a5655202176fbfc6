"""One path in several languages: ``python -m tests.written_paths`` compensates drawn paths in each, and compares.

The writers share nothing with the package: the quaternions are made here.  Another language is one entry in
``WRITERS``.  They are our own, as PyPI's ``robodk`` has no posts in it.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import postproc
from postproc.base.document import Document
from postproc.base.units import DEG, MM
from postproc.languages import DIALECTS
from postproc.languages.dialect import ReadingSettings
from postproc.toolpath import Kind, Toolpath

CELL = """\
robot: kuka_kr270
tools:
  1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}
  2: {x: 100, y: -20, z: 280, a: 10, b: 20, c: 5, axis: +z}
bases:
  1: {x: 1450, y: -100, z: 600, a: 0, b: 0, c: 0}
  2: {x: 1500, y: -60, z: 640, a: 8, b: -3, c: 2}
start: [0, -90, 90, 0, 45, 0]
symbols: {tool1: 1, tool2: 2, part1: 1, part2: 2}
tolerance: 0.05  # few motions are divided: how an inserted point is rounded is of each language
max_growth: 6
"""
SYMBOLS = {"TOOL1": 1.0, "TOOL2": 2.0, "PART1": 1.0, "PART2": 2.0}
AXES = "0,-90,90,0,45,0"
FORCE = "40,360,560@base"
KINDS = ("lines", "arcs", "five axes", "frames and tools", "all")
ON_PATH = (Kind.LIN, Kind.CIRC)
"""Motions that cut; how the robot goes to where they start is of each language."""
WITHIN_MM, WITHIN_DEG = 0.0003, 0.001
"""By how much corrected poses may differ: four decimals are written, and each language has its own last digit."""


@dataclass(frozen=True)
class Step:
    """To ``place`` [mm] with the angles ``abc`` [deg] (Z, Y', X''), on an arc through ``via``; tool, base: 1 or 2;
    ``rapid``: not cutting."""

    place: np.ndarray
    abc: np.ndarray
    via: np.ndarray | None
    tool: int
    base: int
    rapid: bool


def draw(seed: int) -> list[Step]:
    """A path of the kind that is next; its first step leads to where it starts."""
    random, kind = np.random.default_rng(seed), KINDS[seed % len(KINDS)]
    place, abc = np.array([0.0, 0.0, -5.0]), np.array([0.0, 0.0, 180.0])
    tool = base = 1
    steps = []
    for number in range(int(random.integers(6, 12))):
        if kind in ("five axes", "all"):
            abc = abc + random.uniform(-3, 3, 3)
        change = number and kind in ("frames and tools", "all") and random.random() < 0.3
        if change:
            tool, base = random.integers(1, 3, 2).tolist()
        arc = number and not change and kind in ("arcs", "all") and random.random() < 0.4
        via = place + np.array([8.0, 6.0, 0.5]) if arc else None
        place = place + random.uniform([10, -10, -0.5], [20, 10, 0.5])
        through = None if via is None else np.round(via, 4)
        steps.append(
            Step(np.round(place, 4), np.round(abc, 7), through, tool, base, bool(change) or not number)
        )
    return steps


def quaternion(abc: np.ndarray) -> list[float]:
    """Of three turns, one after the other, each about an axis that the ones before have turned."""
    found = np.array([1.0, 0, 0, 0])
    for axis, angle in zip((2, 1, 0), abc, strict=True):
        turn = np.zeros(4)
        turn[0], turn[1 + axis] = math.cos(angle * DEG / 2), math.sin(angle * DEG / 2)
        w, v = found[0], found[1:]
        found = np.append(w * turn[0] - v @ turn[1:], w * turn[1:] + turn[0] * v + np.cross(v, turn[1:]))
    return found.tolist()


def _words(names: str, values: np.ndarray, digits: int, between: str, sign: str) -> str:
    return between.join(f"{name}{sign}{value:.{digits}f}" for name, value in zip(names, values, strict=True))


def krl(steps: list[Step]) -> str:
    lines = ["DEF part()", "$VEL.CP=0.05", "$CIRC_TYPE=#BASE", "$BASE=BASE_DATA[1]", "$TOOL=TOOL_DATA[1]"]
    lines.append("PTP {" + ",".join(f"A{k} {value}" for k, value in enumerate(AXES.split(","), 1)) + "}")

    def point(place: np.ndarray, abc: np.ndarray) -> str:
        return "{" + _words("XYZ", place, 4, ",", " ") + "," + _words("ABC", abc, 7, ",", " ") + "}"

    for before, step in zip([None, *steps], steps, strict=False):
        if before is not None and (before.tool, before.base) != (step.tool, step.base):
            lines += [f"$TOOL=TOOL_DATA[{step.tool}]", f"$BASE=BASE_DATA[{step.base}]"]
        end = point(step.place, step.abc)
        word = "PTP" if step.rapid else "LIN"
        lines.append(f"{word} {end}" if step.via is None else f"CIRC {point(step.via, step.abc)},{end}")
    return "\n".join([*lines, "END", ""])


def rapid(steps: list[Step]) -> str:
    rest = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"
    lines = ["MODULE part", "PROC main()", "ConfL\\Off;", "CirPathMode\\ObjectFrame;"]
    lines.append(f"MoveAbsJ [[{AXES}],[9E9,9E9,9E9,9E9,9E9,9E9]],v1000,fine,tool1\\WObj:=part1;")

    def point(place: np.ndarray, abc: np.ndarray) -> str:
        numbers = ",".join(f"{value:.4f}" for value in place)
        return f"[[{numbers}],[{','.join(f'{value:.9f}' for value in quaternion(abc))}],{rest}]"

    for step in steps:
        end = f"{point(step.place, step.abc)},v50,fine,tool{step.tool}\\WObj:=part{step.base};"
        word = "MoveJ" if step.rapid else "MoveL"
        lines.append(f"{word} {end}" if step.via is None else f"MoveC {point(step.via, step.abc)},{end}")
    return "\n".join([*lines, "ENDPROC", "ENDMODULE", ""])


def halfway(one: np.ndarray, other: np.ndarray) -> list[float]:
    """The angles W, P, R [deg] of the orientation in the middle of the even turn between two (A, B, C)."""
    start, end = np.array(quaternion(one)), np.array(quaternion(other))
    w, x, y, z = start + end if start @ end >= 0 else start - end
    size = w * w + x * x + y * y + z * z
    about_z = math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)
    about_x = math.atan2(2 * (w * x + y * z), w * w - x * x - y * y + z * z)
    return [about_x / DEG, math.asin(2 * (w * y - x * z) / size) / DEG, about_z / DEG]


def tp(steps: list[Step]) -> str:
    """Targets in a section of their own; at an auxiliary point the tool has half of its turn, as a C motion wants."""
    joints = ",\t".join(f"J{k} = {value} deg" for k, value in enumerate(AXES.split(","), 1))
    lines, points = ["J P[1] 50% FINE"], [f"P[1]{{\n   GP1:\n\tUF : 1, UT : 1,\t\n\t{joints}\n}};"]

    def point(step: Step, place: np.ndarray, wpr: list[float]) -> str:
        numbers = [f"{name} = {value:.4f}  mm" for name, value in zip("XYZ", place, strict=True)]
        numbers += [f"{name} = {value:.7f} deg" for name, value in zip("WPR", wpr, strict=True)]
        points.append(
            f"P[{len(points) + 1}]{{\n   GP1:\n\tUF : {step.base}, UT : {step.tool},\t\tCONFIG : 'N U T, 0, 0, 0',\n"
            "\t" + ",\t".join(numbers[:3]) + ",\n\t" + ",\t".join(numbers[3:]) + "\n};"
        )
        return f"P[{len(points)}]"

    before = None
    for step in steps:
        if before is None or (before.tool, before.base) != (step.tool, step.base):
            lines += [f"  UFRAME_NUM={step.base}", f"  UTOOL_NUM={step.tool}"]
        via = ""
        if step.via is not None and before is not None:
            via = point(step, step.via, halfway(before.abc, step.abc))
        end = point(step, step.place, list(step.abc[::-1]))
        if step.rapid:
            lines.append(f"J {end} 50% FINE")
        else:
            lines.append(f"C {via}\n    :  {end} 50mm/sec FINE" if via else f"L {end} 50mm/sec FINE")
        before = step
    numbered = [f"{n:4d}:{line} ;" for n, line in enumerate(lines, 1)]
    head = ["/PROG PART", "/ATTR", f"LINE_COUNT\t= {len(lines)};", "/MN"]
    return "\n".join([*head, *numbered, "/POS", *points, "/END", ""])


def gcode(steps: list[Step]) -> str:
    """As a robot control runs it that takes G-code: A, B, C are angles of the tool."""
    lines = ["G90 G71 G17", "#TRAFO OFF", "T1 M6", "#TRAFO ON", "G54 G60"]
    for before, step in zip([None, *steps], steps, strict=False):
        if before is not None and before.tool != step.tool:
            lines += ["#TRAFO OFF", f"T{step.tool} M6", "#TRAFO ON"]
        if before is not None and before.base != step.base:
            lines.append(f"G{53 + step.base}")
        end = _words("XYZ", step.place, 4, " ", "") + " " + _words("ABC", step.abc, 7, " ", "")
        arc = "" if step.via is None else " " + _words(("I1", "J1", "K1"), step.via, 4, " ", "=")
        word = "G0" if step.rapid else "G1" if step.via is None else "G2"
        lines.append(f"{word} {end}{arc} F3000")
    return "\n".join([*lines, "M30", ""])


@dataclass(frozen=True)
class Language:
    dialect: str
    suffix: str
    write: Callable[[list[Step]], str]


WRITERS = {
    "krl": Language("krl", ".src", krl),
    "rapid": Language("rapid", ".mod", rapid),
    "tp": Language("tp", ".ls", tp),
    "gcode": Language("kuka_cnc", ".nc", gcode),
}


def compensated(folder: Path, steps: list[Step], language: Language) -> tuple[int, Toolpath]:
    """The number of corrected motions, and the motions of the output as they are read back.

    Raises AssertionError where the path is not corrected.
    """
    folder.mkdir(parents=True)
    program = folder / f"part{language.suffix}"
    program.write_text(language.write(steps))
    (folder / "cell.yaml").write_text(CELL)
    report = postproc.compensate(program, force=FORCE, output=folder / "out" / program.name)
    out = folder / "out" / program.name
    read = DIALECTS[language.dialect].read(
        (Document(out, out.read_bytes()),), ReadingSettings(symbols=SYMBOLS)
    )
    assert report.exit == 0, (program, [finding.message for finding in report.findings])
    return report.to_dict()["corrected"], read.toolpath


def differences(folder: Path, seed: int) -> tuple[float, float, int]:
    """The largest differences [mm], [deg] between the corrected poses of one path in all languages, and their number.

    Raises AssertionError where the languages do not have the same motions, or nothing is corrected.
    """
    steps = draw(seed)
    found = {name: compensated(folder / name, steps, language) for name, language in WRITERS.items()}
    off, turned, poses = 0.0, 0.0, 0
    [(corrected, first), *others] = found.values()
    assert corrected, seed
    own = np.flatnonzero(np.isin(first.kind, ON_PATH))
    for name, (count, other) in zip(list(WRITERS)[1:], others, strict=True):
        rows = np.flatnonzero(np.isin(other.kind, ON_PATH))
        assert count == corrected, (seed, name, count, corrected)
        assert first.kind[own].tolist() == other.kind[rows].tolist(), (seed, name)
        off = max(off, float(np.abs(first.position[own] - other.position[rows]).max() / MM))
        traces = np.einsum("nij,nij->n", first.rotation[own], other.rotation[rows])
        turned = max(turned, float(np.degrees(np.arccos(np.clip((traces - 1) / 2, -1, 1))).max()))
        sweeps = first.arcs.sweep[own] - other.arcs.sweep[rows]
        assert not (np.abs(sweeps) > 1e-3).any(), (seed, name)
        poses += len(rows)
    return off, turned, poses


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--paths", type=int, default=200)
    asked = parser.parse_args()
    most, angle, poses, other = 0.0, 0.0, 0, 0
    with tempfile.TemporaryDirectory() as name:
        for seed in range(asked.paths):
            try:
                off, turned, count = differences(Path(name) / str(seed), seed)
            except AssertionError as error:
                other += 1
                print(f"path {seed}: {error}")
                continue
            most, angle, poses = max(most, off), max(angle, turned), poses + count
    print(f"{asked.paths} paths in {', '.join(WRITERS)}: {poses} corrected poses compared")
    print(f"largest difference {most:.5f} mm, {angle:.5f} deg; {other} paths not corrected alike")
    sys.exit(1 if other or most > WITHIN_MM or angle > WITHIN_DEG else 0)


if __name__ == "__main__":
    main()
