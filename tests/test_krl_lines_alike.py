"""Lines that are alike but for their numbers are read as the regular expression of common lines reads them."""

from __future__ import annotations

import random
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.base.geometry import rotation_from_abc
from postproc.base.units import DEG
from postproc.languages.krl import lines_alike as alike
from postproc.languages.krl import scan as scanning
from postproc.languages.krl.interpreter import read
from postproc.languages.krl.vectorised import VectorisedLines

COLUMNS = ("is_line", "values", "start", "stop", "motion", "approximation", "status", "turn")

FORMS = (
    "LIN {X %s,Y %s,Z %s,A %s,B %s,C %s} C_DIS\r\n",
    "LIN {X %s,Y %s,Z %s,A %s,B %s,C %s}\n",
    "  ptp  { x \t%s, Y %s,Z %s,a %s,B  %s,C %s}  c_vel \t\n",
    "LIN {X %s,Y %s,Z %s,A %s,B %s,C %s}C_ORI\n",
    "LIN {X %s,Y %s,Z %s,A %s,B %s,C %s} ; seen\n",
    "LIN {X %s,Y %s,Z %s,A %s,B %s,C %s,S 2,T 10} C_DIS\n",
    "LIN {X %s ,Y %s,Z %s,A %s,B %s,C %s } C_DIS\n",
    "LIN  {X %s,Y %s,Z %s,A %s,B %s,C %s}  C_DIS\n",
)

NUMBERS = ("0", "-1.5", "+12.250", "1234567.8901", "3.", "-0.000", "12345678901234567.5", "7")

ODD = (
    (".5", None), ("-.5", None), ("1.2.3", None), ("1-2", None), ("--1", None), ("1e3", None), ("", None),
    ("1234567890123456", None), ("V", None), ("1 2", None), ("-", None), (".", None), ("'HFF'", None),
    (None, ("LIN ", "LIN 5 ")), (None, ("LIN", "LIN1")), (None, ("X ", "X1")), (None, ("X ", "X")),
    (None, ("} ", "}7 ")), (None, (",Y", ", 5 Y")), (None, ("Y ", "Y\t")), (None, ("C_", "C 1_")),
    (None, ("\n", "\nWAIT SEC 1\n")), (None, ("\n", "\n\n")), (None, ("{X", "{ X")), (None, (",B", " ,B")),
)  # fmt: skip


def items(text: bytes) -> list[object]:
    """What the scan gives: statements, and the rows of common lines with their entries."""
    found: list[object] = []
    for item in scanning.scan(Document(Path("a.src"), text), True):
        if not isinstance(item, VectorisedLines):
            found.append(item)
            continue
        columns = [np.ascontiguousarray(getattr(item, name)) for name in COLUMNS]
        found += [
            (item.line + k, *(column[k].tobytes() for column in columns), item.external is None)
            for k in range(len(item))
        ]
    return found


def written(rng: random.Random) -> bytes:
    form = rng.choice(FORMS)
    lines = [form % tuple(rng.choice(NUMBERS[:6]) for _ in range(6)) for _ in range(rng.randint(8, 60))]
    for _ in range(rng.choice([0, 0, 1, 2])):
        at = rng.randrange(len(lines))
        number, change = rng.choice(ODD)
        if change is None:
            values = [rng.choice(NUMBERS) for _ in range(6)]
            values[rng.randrange(6)] = number
            lines[at] = form % tuple(values)
        elif rng.random() < 0.5:
            lines[at] = lines[at].replace(*change, 1)
        else:
            lines = [line.replace(*change, 1) for line in lines]
    return ("DEF a()\n" * rng.randint(0, 1) + "".join(lines) + "END" * rng.randint(0, 1)).encode()


@pytest.mark.parametrize("seed", range(40))
def test_they_are_read_as_by_the_regular_expression(seed, monkeypatch):
    rng = random.Random(seed)
    texts = [written(rng) for _ in range(40)]
    quick = [items(text) for text in texts]
    monkeypatch.setattr(scanning, "lines_alike", lambda *_: None)
    for text, found in zip(texts, quick, strict=True):
        assert found == items(text), text
    # and the quick way was taken
    monkeypatch.undo()
    form = FORMS[seed % 4]
    text = "".join(form % tuple(rng.choice(NUMBERS[:6]) for _ in range(6)) for _ in range(30)).encode()
    assert alike.lines_alike(text, 0, len(text)) is not None


def test_pieces_are_whole_lines(monkeypatch):
    monkeypatch.setattr(alike, "BLOCK", 100)
    text = "".join(FORMS[0] % tuple("123456") for _ in range(50)).encode() + b"END"
    spans = list(alike.pieces(text, 5))
    assert len(spans) > 10
    assert (spans[0][0], spans[-1][1]) == (5, len(text))
    assert all(a[1] == b[0] and text[a[1] - 1] == 10 for a, b in pairwise(spans))


@pytest.mark.parametrize("angles", [["0.000"], ["0.000", "-0.000"], ["12.500"], ["12.500", "12.501"]])
def test_equal_angles_turn_as_each_alone_does(angles):
    lines = [f"LIN {{X {k},Y 2,Z 3,A {angles[k % len(angles)]},B -0.0,C 180}}\n" for k in range(40)]
    document = Document(Path("a.src"), ("DEF a()\n" + "".join(lines) + "END\n").encode())
    quick, alone = (read((document,), fast=fast).toolpath.rotation for fast in (True, False))
    stated = [[float(angles[k % len(angles)]), -0.0, 180.0] for k in range(40)]
    assert quick.tobytes() == alone.tobytes()
    np.testing.assert_array_equal(quick, rotation_from_abc(np.array(stated) * DEG))
