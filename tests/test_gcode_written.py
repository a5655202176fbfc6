"""Plans of single motions, and the text that they become: numbers, words and blocks, and nothing else."""

from __future__ import annotations

import re
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from gcode_writing import DOWN, WRITING, assert_reads_as, read

from postproc.base.arrays import Floats
from postproc.base.document import apply
from postproc.base.geometry import rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.languages.dialect import Plan, Program, ReadingSettings, Role, WritingSettings
from postproc.languages.gcode import DIALECTS, writer
from postproc.languages.gcode.writer_blocks import Style

NAMES = {dialect.name: dialect for dialect in DIALECTS}
HEADS = {
    "linuxcnc": "G21 G90 G17 G54\nT1 M6\nG0 X0 Y0 Z5\n",
    "fanuc": "O1\nG21 G90 G17 G54\nT1 M6\nG0 X0. Y0. Z5.\n",
    "sinumerik": "G54 G71 G90 G17\nT1 D1\nG0 X0 Y0 Z5\n",
    "kuka_cnc": "G54 G71 G90 G17\nT1\nG0 X0 Y0 Z5 A0 B0 C180\n",
}
UM = ReadingSettings(orientation=DOWN.orientation, options={"integer_words": "um"})


def plan_of(program: Program, steps: str) -> Plan:
    """The plan of a program, changed by steps: ``3 X.1 Y-2`` moves motion 3 (counted from the end: -1) by millimetres,
    its arc's centre as well; ``3 a5`` turns its tool about the base's x, y, z (a b c) by degrees; ``3 link X1 Y2 Z3``
    and ``3 piece X1 Y2 Z3`` put a motion to that point before it, all that inherit are left where they were."""
    path = program.toolpath
    own = Plan.of(path)
    position, rotation, centre = own.position.copy(), np.array(own.rotation), np.array(own.centre)
    before: dict[int, list[tuple[Role, Floats]]] = {}
    for step in filter(None, steps.split(";")):
        number, *words = step.split()
        row = int(number) % len(path)
        if words[0] in ("link", "piece"):
            role = Role.TRANSITION if words[0] == "link" else Role.INTERMEDIATE
            before.setdefault(row, []).append((role, np.array([float(word[1:]) for word in words[1:]]) * MM))
            continue
        for word in words:
            by = float(word[1:])
            if word[0] in "XYZ":
                position[row, "XYZ".index(word[0])] += by * MM
                centre[row, "XYZ".index(word[0])] += by * MM
            elif word[0] in "xyz":
                position[row, "xyz".index(word[0])] += by * MM
            elif word[0] in "ijk":
                centre[row, "ijk".index(word[0])] += by * MM
            else:
                axis = np.eye(3)["abc".index(word[0])]
                rotation[row] = rotation_from_vector(by * DEG * axis) @ rotation[row]
    rows: list[tuple[int, Role, Any]] = []
    for row in range(len(path)):
        rows += [(row, role, point) for role, point in before.get(row, [])]
        rows.append((row, Role.ORIGINAL, None))
    source = np.array([row for row, _, _ in rows], dtype=np.int64)
    inserted = np.array([role != Role.ORIGINAL for _, role, _ in rows], dtype=np.bool_)
    target = position[source]
    target[inserted] = np.array([point for _, _, point in rows if point is not None]).reshape(-1, 3)
    missing = inserted[:, None]
    return Plan(
        source, np.array([role for _, role, _ in rows]), target, rotation[source],
        np.where(missing, np.nan, centre[source]), np.where(missing, np.nan, own.normal[source]),
        np.where(inserted, np.nan, own.sweep[source]),
    )  # fmt: skip


def written(
    name: str,
    text: str,
    steps: str,
    settings: ReadingSettings = DOWN,
    writing: WritingSettings = WRITING,
    again: bool = True,
) -> str:
    """The lines behind the head; again: they are read, and say what was planned."""
    dialect, head = NAMES[name], HEADS[name]
    program = read(dialect, head + text, settings)
    plan = plan_of(program, steps)
    moved = dialect.edit_targets(program, plan, writing)
    assert not moved.unwritten, moved.unwritten
    raw = apply(program.documents[0], list(moved.edits))
    if again:
        assert_reads_as(dialect, program, plan, raw, settings, writing)
    return raw.decode("latin-1").removeprefix(head)


def parts(monkeypatch: pytest.MonkeyPatch, name: str, text: str, steps: str) -> set[str]:
    """What is written as a whole, and in parts of a motion or two."""
    dialect, head, found = NAMES[name], HEADS[name], set()
    program = read(dialect, head + text)
    plan = plan_of(program, steps)
    for rows in (1 << 14, 1, 2):
        monkeypatch.setattr(writer, "ROWS", rows)
        moved = dialect.edit_targets(program, plan, WRITING)
        found.add(apply(program.documents[0], list(moved.edits)).decode("latin-1").removeprefix(head))
    return found


TEXTS: list[tuple[str, str, str, str]] = [
    # control, text, steps, written
    # Numbers
    ("linuxcnc", "G1 X1.000 Y2 F60\n", "-1 X.1", "G1 X1.100 Y2 F60\n"),
    ("linuxcnc", "G1 X1.00000 Y2 F60\n", "-1 X.123456", "G1 X1.12346 Y2 F60\n"),
    ("linuxcnc", "G1 X 1 . 5 Y2 F60\n", "-1 X.1", "G1 X 1.600 Y2 F60\n"),
    ("linuxcnc", "N1 g1 x1 y-2 f60 (a) ;b\n", "-1 X.1 Y-.2 Z.3", "N1 g1 x1.100 y-2.200 f60 z5.300 (a) ;b\n"),
    ("linuxcnc", "G1X1F60\nY1\nX2\n", "-2 X.1", "G1X1F60\nY1 X1.100\nX2\n"),
    ("linuxcnc", "G1 X1 F60\nX2\nY5\n", "-2 Y.1", "G1 X1 F60\nX2 Y0.100\nY5\n"),
    ("linuxcnc", "G1 X1 F60\nX2\nX3\n", "-2 Y.1", "G1 X1 F60\nX2 Y0.100\nX3 Y0.000\n"),
    ("linuxcnc", "G91 G1 X1 F60\nX2\nX3\n", "-2 X.1", "G91 G1 X1 F60\nX2.100\nX2.900\n"),
    ("linuxcnc", "G91 G1 X1 F60\nX2\nY3\n", "-2 X.1 Z.2", "G91 G1 X1 F60\nX2.100 Z0.200\nY3 X-0.100 Z-0.200\n"),
    ("linuxcnc", "G20 G1 X1 F60\nX2.5\n", "-1 X.254 Y2.54", "G20 G1 X1 F60\nX2.51000 Y0.10000\n"),
    ("linuxcnc", "G1 X1 Y1 Z1 F60\nG20 X1\nG21 Y2\n", "-2 Y.1", "G1 X1 Y1 Z1 F60\nG20 X1 Y0.04331\nG21 Y2\n"),
    ("linuxcnc", "G1 X1 Y1 Z1 F60\nG52 X5\nX1\nY3\n", "-3 X.1", "G1 X1.100 Y1 Z1 F60\nG52 X5\nX1\nY3\n"),
    ("linuxcnc", "G1 X1 Y1 Z1 F60\nG52 X5\nY2\n", "-2 X.1", "G1 X1.100 Y1 Z1 F60\nG52 X5\nY2 X-4.000\n"),
    ("linuxcnc", "G1 X1 Y1 Z1 F60\nG53 G0 Z0\nX1 Y1 Z1\n", "-1 X.1", "G1 X1 Y1 Z1 F60\nG53 G0 Z0\nX1.100 Y1 Z1\n"),
    ("linuxcnc", "G1 X1 Y1 Z1 F60\nG28 X0\nX1 Y2\nZ3\n", "-1 Y.1", "G1 X1 Y1 Z1 F60\nG28 X0\nX1 Y2\nZ3 Y2.100\n"),
    ("linuxcnc", "G1 X1 Y1 Z1 F60\nG55 X1 Y1 Z1\n", "-2 X.1", "G1 X1.100 Y1 Z1 F60\nG55 X1 Y1 Z1\n"),
    ("fanuc", "G1 X1. F60\n", "-1 X.1 Y.1", "G1 X1.100 F60 Y0.100\n"),
    ("kuka_cnc", "G1 X1 F60\nX2\n", "-2 X.1", "G1 X1.100 F60\nX2\n"),
    ("kuka_cnc", "G1 X1 F60\n", "-1 c1", "G1 X1 F60 A1.000\n"),
    ("linuxcnc", "G1 X1 F60\nN5X2\n", "-1 Y.1", "G1 X1 F60\nN5X2 Y0.100\n"),
    ("linuxcnc", "G1 X1 F60\nN5 X2Y3\n", "-1 Z.1", "G1 X1 F60\nN5 X2Y3Z5.100\n"),
    ("linuxcnc", "G1 X1 F60\nN5\tX2\tY3 \n", "-1 Z.1", "G1 X1 F60\nN5\tX2\tY3 Z5.100 \n"),
    ("linuxcnc", "G1 X1 F60\nG1 x2\ng1 X3\n", "-1 Y.1;-2 Z.1", "G1 X1 F60\nG1 x2 Z5.100\ng1 X3 y0.100 z5.000\n"),
    ("linuxcnc", "G1 X1 F60\n  N7 G1X2(a b)\n", "-1 Y.1", "G1 X1 F60\n  N7 G1X2Y0.100(a b)\n"),
    ("linuxcnc", "G1 X1 F60\n/G1 X2 Y2 Z2\nG1 X1 Y1 Z1\nX2\n", "-1 Y.1",
     "G1 X1 F60\n/G1 X2 Y2 Z2\nG1 X1 Y1 Z1\nX2 Y1.100\n"),
    ("linuxcnc", "G20 G1 X1 Y1 Z1 F60\nG28 X0\nX1 Y2\nZ3\n", "-1 Y.254",
     "G20 G1 X1 Y1 Z1 F60\nG28 X0\nX1 Y2\nZ3 Y2.01000\n"),
    ("linuxcnc", "G1 X1 Y1 Z1 F60\nG28 X0\nG52 Y1\nX1 Y2\nZ3\n", "-1 Y.1",
     "G1 X1 Y1 Z1 F60\nG28 X0\nG52 Y1\nX1 Y2\nZ3 Y2.100\n"),
    ("linuxcnc", "G1 X1 Y1 Z1 F60\nG28 X0\nX2 Y2\nG28 Z0\nX1 Z1\nY5\n", "-1 X.1",
     "G1 X1 Y1 Z1 F60\nG28 X0\nX2 Y2\nG28 Z0\nX1 Z1\nY5 X1.100\n"),
    # Links and pieces
    ("linuxcnc", "G1 X1 F60\nX2\n", "-1 link X1 Y.5 Z5", "G1 X1 F60\nG1 Y0.500\nX2 Y0.000\n"),
    ("linuxcnc", "G1 X1 F60\nX2\n", "-1 piece X1.5 Y0 Z5", "G1 X1 F60\nG1 X1.500\nX2\n"),
    ("linuxcnc", "G01 X1 F60\nX2\n", "-1 piece X1.5 Y0 Z5", "G01 X1 F60\nG1 X1.500\nX2\n"),
    ("linuxcnc", "G1 X1 F60\nG01 X2 F80\n", "-1 piece X1.5 Y0 Z5", "G1 X1 F60\nG01 X1.500 F80\nG01 X2 F80\n"),
    ("linuxcnc", "G1 X1 F60\nG01 X2\n", "-1 link X1 Y.5 Z5", "G1 X1 F60\nG01 Y0.500\nG01 X2 Y0.000\n"),
    ("linuxcnc", "G1 X1 F60\n N5 x2 y1 (a)\n", "-1 piece X1.5 Y.5 Z5",
     "G1 X1 F60\n g1 x1.500 y0.500\n N5 x2 y1 (a)\n"),
    ("linuxcnc", "G1X1F60\nX2Y1F80\n", "-1 piece X1.5 Y.5 Z5", "G1X1F60\nG1X1.500Y0.500F80\nX2Y1F80\n"),
    ("linuxcnc", "G1 X1 F60\nX2 Y1\n", "-1 link X1 Y.2 Z5;-1 piece X1.5 Y.5 Z5;-1 piece X1.7 Y.6 Z5",
     "G1 X1 F60\nG1 Y0.200\nG1 X1.500 Y0.500\nG1 X1.700 Y0.600\nX2 Y1\n"),
    ("linuxcnc", "G1 X1 F60\nG17 G1 G91 X1 Y1 F9\n", "-1 piece X1.5 Y.5 Z5;-1 piece X1.7 Y.6 Z5",
     "G1 X1 F60\nG17 G91 G1 X0.500 Y0.500 F9\nG1 X0.200 Y0.100\nG17 G1 G91 X0.300 Y0.400 F9\n"),
    ("linuxcnc", "G1 X1 F60\nG0 X2 Y1\nX3\n", "-1 link X2 Y1 Z6", "G1 X1 F60\nG0 X2 Y1\nG1 Z6.000\nG0 X3 Z5.000\n"),
    ("linuxcnc", "G1 X1 F60\nG0 X2 Y1\nG0 X3\n", "-1 link X2 Y1 Z6",
     "G1 X1 F60\nG0 X2 Y1\nG1 Z6.000\nG0 X3 Z5.000\n"),
    ("linuxcnc", "G1 X1 F60\nG0 X2 Y1\nX3\n", "-1 piece X2 Y1 Z6", "G1 X1 F60\nG0 X2 Y1\nG0 Z6.000\nX3 Z5.000\n"),
    ("linuxcnc", "G1 X1 F60\nG0 X2 Y1\nX3\n", "-1 link X2 Y1 Z6;-1 piece X2 Y1 Z7",
     "G1 X1 F60\nG0 X2 Y1\nG1 Z6.000\nG0 Z7.000\nX3 Z5.000\n"),
    ("linuxcnc", "G1 X1 F60\nG2 X3 I1\nX5 I1\n", "-1 link X3 Y0 Z6",
     "G1 X1 F60\nG2 X3 I1\nG1 Z6.000\nG2 X5 I1 Z5.000\n"),
    ("linuxcnc", "G1 X1 F60\nG2 X3 I1\nN7 x5 i1\n", "-1 link X3 Y0 Z6",
     "G1 X1 F60\nG2 X3 I1\ng1 z6.000\nN7 g2 x5 i1 z5.000\n"),
    ("linuxcnc", "G1 X1 F60\nX2 Y1\nX5\n", "-1 piece X3 Y1 Z5;-2 piece X1.5 Y0 Z5",
     "G1 X1 F60\nG1 X1.500\nX2 Y1\nG1 X3.000\nX5\n"),
    ("linuxcnc", "G1 X1 Y1 F60\nX1\n", "-1 piece X1 Y1 Z5", "G1 X1 Y1 F60\nG1 X1.000\nX1\n"),
    ("kuka_cnc", "G1 X1 F60\nX2\n", "-1 link X1 Y.5 Z5", "G1 X1 F60\nG1 Y0.500\nX2 Y0.000\n"),
    ("fanuc", "N1 G1 X1. F60\nN2 X2.\n", "-1 link X1 Y.5 Z5", "N1 G1 X1. F60\nG1 Y0.500\nN2 X2. Y0.000\n"),
    # Arcs
    ("linuxcnc", "G1 X10 F60\nG3 X0 Y10 I-10 J0\n", "-1 i.1 j.1 x.1 y.1;-2 x.1 y.1",
     "G1 X10.100 F60 Y0.100\nG3 X0.100 Y10.100 I-10 J0\n"),
    ("linuxcnc", "G1 X10 F60\nG3 X0 Y10 I-10\n", "-1 X.1;-2 X.1", "G1 X10.100 F60\nG3 X0.100 Y10 I-10\n"),
    ("linuxcnc", "G1 X10 F60\nG90.1 G3 X0 Y10 I0 J0\n", "-1 X.1 Y.1;-2 X.1 Y.1",
     "G1 X10.100 F60 Y0.100\nG90.1 G3 X0.100 Y10.100 I0.100 J0.100\n"),
    ("linuxcnc", "G1 X10 F60\nG3 X0 Y10 R10\n", "-1 X.1 Y.1;-2 X.1 Y.1",
     "G1 X10.100 F60 Y0.100\nG3 X0.100 Y10.100 R10\n"),
    ("linuxcnc", "G1 X10 F60\nG3 X-10 R10 (half)\n", "-1 Y.1;-2 Y.1",
     "G1 X10 F60 Y0.100\nG3 X-10 I-10.000 J0.000 (half)\n"),
    ("linuxcnc", "G1 X10 F60\nG3 X-10 R10 Y0\nX10 R10\n", "-1 Y.1;-2 Y.1;-3 Y.1",
     "G1 X10 F60 Y0.100\nG3 X-10 I-10.000 J0.000 Y0.100\nX10 I10.000 J0.000\n"),
    ("linuxcnc", "G1 X10 F60\nG3X0Y10R10.00\n", "-1 X.123 Y.123;-2 X.123 Y.123",
     "G1 X10.123 F60 Y0.123\nG3X0.123Y10.123R10.00\n"),
    ("linuxcnc", "G18 G1 X10 F60\nG3 X0 Z15 I-10 K0\n", "-1 X.1;-2 X.1", "G18 G1 X10.100 F60\nG3 X0.100 Z15 I-10 K0\n"),
    ("linuxcnc", "G1 X10 F60\nG3 I-10\n", "-1 X.1;-2 X.1", "G1 X10.100 F60\nG3 I-10\n"),
    ("linuxcnc", "G1 X10 F60\nG3 I-10 P2\nG1 X5\n", "-2 X.1;-3 X.1", "G1 X10.100 F60\nG3 I-10 P2\nG1 X5\n"),
    ("linuxcnc", "G1 X10 F60\nG3 X0 Y10 Z6 I-10 J0\n", "-1 Z.1", "G1 X10 F60\nG3 X0 Y10 Z6.100 I-10 J0\n"),
    ("sinumerik", "G1 X10 F60\nG3 X0 Y10 CR=10\n", "-1 X.1 Y.1;-2 X.1 Y.1",
     "G1 X10.100 F60 Y0.100\nG3 X0.100 Y10.100 CR=10\n"),
    ("sinumerik", "G1 X10 F60\nG3 X-10 CR = 10\n", "-1 Y.1;-2 Y.1",
     "G1 X10 F60 Y0.100\nG3 X-10 I-10.000 J0.000\n"),
    ("sinumerik", "G1 X10 F60\nG3 X=AC(0) Y=IC(10) I=AC(0) J=IC(0)\n", "-1 X.1 Y.1;-2 X.1 Y.1",
     "G1 X10.100 F60 Y0.100\nG3 X=AC(0.100) Y=IC(10) I=AC(0.100) J=IC(0)\n"),
    ("sinumerik", "G1 X10 F60\nCIP X0 Y10 I1=7.071 J1=7.071 K1=IC(0) ;a\n", "-1 X.1 Z.5;-2 X.1 Z.5",
     "G1 X10.100 F60 Z5.500\nCIP X0.100 Y10 I1=7.171 J1=7.071 K1=IC(0) ;a\n"),
    ("sinumerik", "G1 X10 F60\nG91 CIP X-10 Y10 I1=-2.929 J1=7.071\n", "-1 X.1;-2 X.1",
     "G1 X10.100 F60\nG91 CIP X-10 Y10 I1=-2.929 J1=7.071\n"),
    ("linuxcnc", "G1 X10 F60\nG3 X0.004 Y10 I-10.003 J0.002\nG1 X5\n", "-1 Y.1",
     "G1 X10 F60\nG3 X0.004 Y10 I-10.003 J0.002\nG1 X5 Y10.100\n"),
    ("linuxcnc", "G1 X10 F60\nG3 X0.004 Y10 R10.003\nG1 X5\n", "-1 Y.1",
     "G1 X10 F60\nG3 X0.004 Y10 R10.003\nG1 X5 Y10.100\n"),
    ("linuxcnc", "G1 X10 F60\nG41 D1 G3 X0 Y10 Z5 I-10 J0\nG40 G1 X5 Y5 Z5\nX6\n", "-1 Y.1",
     "G1 X10 F60\nG41 D1 G3 X0 Y10 Z5 I-10 J0\nG40 G1 X5 Y5 Z5\nX6 Y5.100\n"),
    ("linuxcnc", "G1 X10.00000 F60\nG3 X10. Y0.0 I-10 J0\nG1 X5\n", "-2 X.12345;-3 X.12345",
     "G1 X10.12345 F60\nG3 X10.12345 Y0.0 I-10 J0\nG1 X5\n"),
    ("linuxcnc", "G1 X10.00000 F60\nG3 X10. Y0.0 I-10 J0 P2\nG1 X5\n", "-2 X.12345;-3 X.12345",
     "G1 X10.12345 F60\nG3 X10.12345 Y0.0 I-10 J0 P2\nG1 X5\n"),
    ("linuxcnc", "G19 G1 Y10.00000 F60\nG3 Y10. Z5.0 J-10 K0\nG1 X5\n", "-2 Y.12345;-3 Y.12345",
     "G19 G1 Y10.12345 F60\nG3 Y10.12345 Z5.0 J-10 K0\nG1 X5 Y10.000\n"),
    # Names and brackets
    ("sinumerik", "G1 X=IC(1) F60\n", "-1 Y.1", "G1 X=IC(1) F60 Y0.100\n"),
    ("sinumerik", "G1 F60 X=IC(1)\n", "-1 Y.1", "G1 F60 X=IC(1) Y0.100\n"),
    ("sinumerik", "G1 F60 X=IC( 1 ) ;(a)\n", "-1 X.1 Y.1", "G1 F60 X=IC( 1.100 ) Y0.100 ;(a)\n"),
    ("sinumerik", "G1F60X=AC(1)\n", "-1 Y.1", "G1F60X=AC(1)Y0.100\n"),
    ("sinumerik", "G1 X1 F60 SPOS=90 ;turn\n", "-1 Y.1", "G1 X1 F60 SPOS=90 Y0.100 ;turn\n"),
    ("sinumerik", "G1 X1 F60 ADIS=0.5\n", "-1 Y.1", "G1 X1 F60 Y0.100 ADIS=0.5\n"),
    ("sinumerik", "G1 X1 F60\nLAB: X2\n", "-1 Y.1", "G1 X1 F60\nLAB: X2 Y0.100\n"),
    ("sinumerik", "G1 X1 F60\nX=1+1 BRISK\n", "-1 X.1 Y.1", "G1 X1 F60\nX=2.100 BRISK Y0.100\n"),
    ("sinumerik", "ROT Z30\nG1 X1 Y0 F60\n", "-1 Z.1", "ROT Z30\nG1 X1 Y0 F60 Z5.1000\n"),
    ("sinumerik", "TRANS X5\nG1 X1 Y0 F60\nATRANS Y1\nX2\n", "-2 X.1 Y.1",
     "TRANS X5\nG1 X1.100 Y0.100 F60\nATRANS Y1\nX2 Y-1.000\n"),
    # Lines
    ("linuxcnc", "G1 X1 F60\r\nX2\r\n", "-1 piece X1.5 Y0 Z5", "G1 X1 F60\r\nG1 X1.500\r\nX2\r\n"),
    ("linuxcnc", "G1 X1 F60\n\n(a)\n X2", "-1 piece X1.5 Y0 Z5", "G1 X1 F60\n\n(a)\n G1 X1.500\n X2"),
    ("linuxcnc", "G1 X1 F60\nX2\n%", "-1 Y.1", "G1 X1 F60\nX2 Y0.100\n%"),
]  # fmt: skip


def in_lines(monkeypatch: pytest.MonkeyPatch, name: str, text: str) -> None:
    """The head has the newline of the text."""
    if "\r\n" in text:
        monkeypatch.setitem(HEADS, name, HEADS[name].replace("\n", "\r\n"))


@pytest.mark.sample(10)
@pytest.mark.parametrize(("name", "text", "steps", "expected"), TEXTS)
def test_what_is_written(
    name: str, text: str, steps: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_lines(monkeypatch, name, text)
    assert parts(monkeypatch, name, text, steps) == {expected}


@pytest.mark.sample(15)
@pytest.mark.parametrize(("name", "text", "steps", "expected"), TEXTS)
def test_what_is_written_is_read_as_planned(
    name: str, text: str, steps: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_lines(monkeypatch, name, text)
    assert written(name, text, steps) == expected


@pytest.mark.parametrize(
    ("name", "text", "steps", "expected"),
    [
        ("linuxcnc", "G00 X0 Y0 Z5\nG01 X1 F60\nX2\n", "-1 piece X1.5 Y0 Z5",
         "G00 X0 Y0 Z5\nG01 X1 F60\nG01 X1.500\nX2\n"),
        ("linuxcnc", "G00X0Y0Z5\nG01X1F60\nG02X3I1\nx5i1\n", "-1 link X3 Y0 Z6",
         "G00X0Y0Z5\nG01X1F60\nG02X3I1\ng01z6.000\ng02x5i1z5.000\n"),
        ("linuxcnc", "\xef\xbb\xbfG1 X1 Y2 Z3 F60\nX2\n", "0 piece X0 Y2 Z3",
         "\xef\xbb\xbfG1 X0.000 Y2.000 Z3.000 F60\nG1 X1 Y2 Z3 F60\nX2\n"),
        ("sinumerik", "TRAORI\nG0 X0 Y0 Z5 A3=0 B3=0 C3=1\nCIP X4 Y0 I1=2 J1=2 F60\nX8 I1=6 J1=2\n",
         "-1 link X4 Y0 Z5",
         "TRAORI\nG0 X0 Y0 Z5 A3=0 B3=0 C3=1\nCIP X4 Y0 I1=2 J1=2 F60\nG1 X4.000\n"
         "CIP X8 I1=6 J1=2\n"),
        ("linuxcnc", "G0 X0 Y0 Z5\n/G1 X1 F60\nG1 X2 Y0 Z5\n", "-1 X.1", "G0 X0 Y0 Z5\n/G1 X1 F60\nG1 X2.100 Y0 Z5\n"),
    ],
)  # fmt: skip
def test_what_is_written_from_the_first_line_on(
    name: str, text: str, steps: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    head = {"linuxcnc": "", "sinumerik": "G54 G71 G90 G17 T1 D1\n"}[name]
    monkeypatch.setitem(HEADS, name, head)
    assert written(name, text, steps) == expected


TURNED: list[tuple[str, str, str]] = [
    # Sinumerik behind TRAORI: text, steps, written
    ("G1 X1 A3=0 B3=0 C3=1\nX2\n", "-2 a1", "G1 X1 A3=0 B3=-0.01745 C3=0.99985\nX2 A3=0.00000 B3=0.00000 C3=1.00000\n"),
    ("G1 X1 A3=0 B3=0 C3=1\nX2\n", "-1 a1", "G1 X1 A3=0 B3=0 C3=1\nX2 A3=0.00000 B3=-0.01745 C3=0.99985\n"),
    ("G1 X1 A3=0 B3=0 C3=1\nX2\n", "-1 a1;-1 piece X1.5 Y0 Z5",
     "G1 X1 A3=0 B3=0 C3=1\nG1 X1.500 A3=0.00000 B3=-0.01745 C3=0.99985\nX2\n"),
    ("g1 x1 c3=1\nx2\n", "-1 b1;-2 b1", "g1 x1 c3=0.99985 a3=0.01745\nx2\n"),
    ("G1 X1 C3=1\nX2\n", "-1 b1;-2 b1", "G1 X1 C3=0.99985 A3=0.01745\nX2\n"),
    ("G1 X1 A3=0 B3=0 C3=2\n", "-1 b1", "G1 X1 A3=0.03490 B3=0 C3=1.99970\n"),
    ("G1 X1 A3=0 B3=1 C3=1\nX2\n", "-1 Y.1", "G1 X1 A3=0 B3=1 C3=1\nX2 Y0.100\n"),
    ("ORIEULER\nG1 X1 A2=90 B2=30 C2=0\nX2\n", "-2 b.5",
     "ORIEULER\nG1 X1 A2=90 B2=30.500 C2=0\nX2 A2=90.000 B2=30.000 C2=0.000\n"),
    ("ORIRPY\nG1 X1 A2=0 B2=30\nX2\n", "-1 b.5", "ORIRPY\nG1 X1 A2=0 B2=30\nX2 A2=0.000 B2=30.500 C2=0.000\n"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "steps", "expected"), TURNED)
def test_how_an_orientation_is_written(
    text: str, steps: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(
        HEADS, "sinumerik", "G54 G71 G90 G17\nT1 D1\nTRAORI\nG0 X0 Y0 Z5 A3=0 B3=0 C3=1\nF60\n"
    )
    assert parts(monkeypatch, "sinumerik", text, steps) == {expected}
    assert written("sinumerik", text, steps) == expected


ROTARY: list[tuple[str, str, str]] = [
    # Rotary axes of a Fanuc behind G43.4: text, steps, written
    ("G1 X1. B30. C10.\nX2.\n", "-2 c1", "G1 X1. B30. C11.000\nX2. C10.000\n"),
    ("G1 X1. B30. C10.\nX2.\n", "-1 c1", "G1 X1. B30. C10.\nX2. C11.000\n"),
    ("G1 X1. B30. C0.\nX2. B31.\n", "-1 b.5", "G1 X1. B30. C0.\nX2. B31.500\n"),
    ("G1 X1. B30. C370.\nX2.\n", "-1 c1;-2 c1", "G1 X1. B30. C371.000\nX2.\n"),
    ("G1 X10. B30. C10.\nG3 X-10. R10.\n", "-1 Y.1 c1;-2 Y.1",
     "G1 X10. B30. C10. Y0.100\nG3 X-10. I-10.000 J0.000 C11.000\n"),
    ("G91 G1 X1. B30. C10.\nX1. C5.\n", "-2 c1", "G91 G1 X1. B30. C11.000\nX1. C4.000\n"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "steps", "expected"), ROTARY)
def test_how_rotary_axes_are_written(
    text: str, steps: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    head = "O1\nG21 G90 G17 G54\nT1 M6\nG43.4 H1\nG0 X0. Y0. Z5. B0. C0.\nF60\n"
    monkeypatch.setitem(HEADS, "fanuc", head)
    assert parts(monkeypatch, "fanuc", text, steps) == {expected}
    assert written("fanuc", text, steps) == expected


def test_increments_of_angles_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    """A10000 is ten degrees where X1000 is a millimetre."""
    monkeypatch.setitem(HEADS, "fanuc", "O1\nG21 G90 G17 G54\nT1 M6\nG43.4 H1\nG0 X0. Y0. Z5. B0. C0.\nF60\n")
    text = "G1 X1000 B30000 C10000\nX2000\n"
    assert written("fanuc", text, "", UM) == text
    assert written("fanuc", text, "-2 X.1;-1 c1", UM) == "G1 X1.100 B30000 C10000\nX2000 C11.000\n"
    assert written("fanuc", text, "-2 c1", UM) == "G1 X1000 B30000 C11.000\nX2000 C10.000\n"


@pytest.mark.parametrize(
    ("name", "text", "steps", "settings", "expected"),
    [
        ("fanuc", "G1 X1000 Y5000 F60\nX2000\n", "-1 Y.3", UM, "G1 X1000 Y5000 F60\nX2000 Y5.3\n"),
        ("fanuc", "G1 X1000 Y5000 F60\nX2000\n", "-1 X.3", UM, "G1 X1000 Y5000 F60\nX2.300\n"),
        ("fanuc", "G1 X1. Y5. F60\nX2.\n", "-1 X.3 Y.04", DOWN, "G1 X1. Y5. F60\nX2.3\n"),
        ("linuxcnc", "G20 G1 X1 F60\nX2\n", "-1 Y2.54", DOWN, "G20 G1 X1 F60\nX2 Y0.100\n"),
    ],
)
def test_numbers_of_few_digits(
    name: str, text: str, steps: str, settings: ReadingSettings, expected: str
) -> None:
    """A tenth of a millimetre or less; where a number counts increments, as many as it stood there with."""
    program = read(NAMES[name], HEADS[name] + text, settings)
    moved = NAMES[name].edit_targets(program, plan_of(program, steps), WritingSettings(mm=1, deg=1))
    assert apply(program.documents[0], list(moved.edits)).decode() == HEADS[name] + expected


STYLES: list[tuple[str, bytes, bool, bool]] = [
    # text, newline, spaced, two digits
    ("G1 X1\n", b"\n", True, False), ("G1X1\n", b"\n", False, False), ("G01X1\r\n", b"\r\n", False, True),
    ("G01 X1", b"\n", True, True), ("G21G90\nG1 X1\n", b"\n", True, False), ("G1\nX1\n", b"\n", True, False),
    ("N1G00X1\nG1Y1\n", b"\n", False, True), ("G 1 X1\n", b"\n", True, False), ("X1\n", b"\n", True, False),
    ("N1\nN2\n", b"\n", True, False), ("G0X1(a b)Y2\n", b"\n", True, False), ("", b"\n", True, False),
    ("X1\nG01Y1\n", b"\n", False, True),
]  # fmt: skip


@pytest.mark.parametrize(("text", "newline", "spaced", "two"), STYLES)
def test_how_a_program_is_written(text: str, newline: bytes, spaced: bool, two: bool) -> None:
    style = Style.of(read(NAMES["linuxcnc"], text))
    assert (style.newline, style.spaced, style.two_digits) == (newline, spaced, two)


# What is refused

BODY = "G1 X10 Y0 F60\nG3 X0 Y10 I-10 J0\nG1 X5\n"


@pytest.mark.parametrize("rows", [1, 2, 9])
def test_a_defect_of_the_caller_is_told_by_its_row(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer, "ROWS", rows)
    dialect = NAMES["linuxcnc"]

    def told(text: str, change: Any) -> str:
        program = read(dialect, HEADS["linuxcnc"] + text)
        with pytest.raises(ValueError, match="row") as caught:
            dialect.edit_targets(program, change(program), WRITING)
        return str(caught.value)

    lost = "G1 X1 F60\n#1=2 G1 X2 Y1 Z5\nM8 G1 X3\n"
    assert (
        told(lost, lambda program: plan_of(program, "-2 X1"))
        == "motions that cannot be corrected are moved: rows [2]"
    )
    assert (
        told(lost, lambda program: plan_of(program, "-2 a1"))
        == "motions that cannot be corrected are moved: rows [2]"
    )
    assert (
        told(lost, lambda program: plan_of(program, "-1 piece X2 Y2 Z5"))
        == "motions that cannot be divided are divided: rows [3]"
    )
    assert (
        told(lost, lambda program: plan_of(program, "-2 piece X2 Y2 Z5"))
        == "motions that cannot be divided are divided: rows [2]"
    )

    def found(program: Program) -> Plan:
        plan = Plan.of(program.toolpath)
        return replace(plan, position=np.nan_to_num(plan.position))

    unknown = "G1 X1 F60 Y0 Z0\nG1 X#1 Y0 Z0\nX1 Y0 Z0\n"
    assert told(unknown, found) == "motions that cannot be corrected are moved: rows [2]"
    pinned = "G1 X1 F60\nX2\n#1=2 X3\n"
    assert (
        told(pinned, lambda program: plan_of(program, "-2 X1"))
        == "motions that cannot be corrected are moved: rows [2]"
    )
    assert written("linuxcnc", "G1 X1 F60\nX3\nG41 D1 G1 X2 Y1 Z5\n", "-2 piece X2 Y0 Z5")

    def sweepless(program: Program) -> Plan:
        return replace(Plan.of(program.toolpath), sweep=np.full(len(program.toolpath), np.nan))

    assert told(BODY, sweepless) == "arcs have no path: rows [2]"

    def short(program: Program) -> Plan:
        plan = Plan.of(program.toolpath)
        parts = (getattr(plan, field.name) for field in fields(plan))
        return Plan(*(part if part is None else part[1:] for part in parts))

    assert told(BODY, short) == "a plan needs one original motion for every row"


@pytest.mark.parametrize("rows", [1, 2, 9])
def test_what_no_words_state_is_held_and_told(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer, "ROWS", rows)
    dialect = NAMES["linuxcnc"]
    program = read(dialect, HEADS["linuxcnc"] + BODY)
    plan = plan_of(program, "-2 i1")
    moved = dialect.edit_targets(program, plan, WRITING)
    assert (len(moved.edits), sorted(moved.unwritten)) == (0, [2])
    finding = moved.unwritten[2]
    assert str(finding) == "part.nc:5:1: GCW001 the corrected arc cannot be written in the form of its block"
    sinumerik = NAMES["sinumerik"]
    program = read(sinumerik, "G54 G71 G90\nT1\nTRAORI\nG0 X0 Y0 Z0 B10\nG1 X1 B20 F60\nX2\n")
    moved = sinumerik.edit_targets(program, plan_of(program, "-2 a5"), WRITING)
    assert {row: str(one) for row, one in moved.unwritten.items()} == {
        1: "part.nc:5:1: GCW002 the words of this block cannot express the corrected orientation"
    }


@pytest.mark.parametrize(("mm", "deg"), [(1, 1), (2, 3), (4, 5)])
def test_digits_are_those_asked_for(mm: int, deg: int) -> None:
    """At least, and one at least."""
    text = written(
        "kuka_cnc", "G1 X1 B10 F60\n", "-1 X.33333 b.33333", writing=WritingSettings(mm=mm, deg=deg)
    )
    numbers = dict(re.findall(r"([XB])(\S+)", text))
    assert len(numbers["X"].partition(".")[2]) == mm
    assert len(numbers["B"].partition(".")[2]) == deg


@pytest.mark.parametrize(("apart", "closes"), [(0.0, True), (0.45, True), (0.55, False)])
def test_a_full_circle_closes_within_half_a_step(apart: float, closes: bool) -> None:
    """It then ends where the motion before does, with its digits; else it is no full circle, and is held."""
    program = read(NAMES["linuxcnc"], HEADS["linuxcnc"] + "G1 X10.00000 F60\nG3 X10. Y0.0 I-10 J0\nG1 X5\n")
    plan = plan_of(program, f"-3 X.12345;-2 X{0.12345 - apart * 1e-3}")
    moved = NAMES["linuxcnc"].edit_targets(program, plan, WRITING)
    assert sorted(moved.unwritten) == ([] if closes else [2])
    written = apply(program.documents[0], list(moved.edits))
    assert (b"G1 X10.12345 F60\nG3 X10.12345 Y0.0 I-10 J0\n" in written) == closes
