"""A word that is put into a block changes the reading or gives a finding: none is ever dropped.

Every word of a list between any two words of every block of programs with one block of each kind; where it makes no
difference it says what is in force anyway, and stands in a list of these."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.gcode import DIALECTS

DIALECT = {dialect.name: dialect for dialect in DIALECTS}
SETTINGS = ReadingSettings(orientation=np.array([0.0, 0.0, np.pi]))
HEAD = {
    "linuxcnc": "G21 G90 G17 G54 G94 G40 G49 G91.1 G64 F900.\nT1 M6\nG43 H1\nG0 X1.5 Y2.5 Z30.5\n",
    "fanuc": "O1\nG21 G90 G17 G54 G94 G40 G49 F900.\nT1 M6\nG43 H1\nG0 X1.5 Y2.5 Z30.5\n",
    "sinumerik": "G71 G90 G17 G54 G94 G40 G64 F900\nT1 D1\nM6\nG0 X1.5 Y2.5 Z30.5\n",
}
TAIL = "G1 X50.5\nG1 Y51.5\nG1 Z20.5\nG2 X60.5 I5.\nG1 X53.5 Y54.5 Z21.5 M8\nG1 X54.5\nM30\n"
"""What follows shows what a word leaves in force: words in parts, then all, then in parts again."""
ISO_MOTIONS = ("G1 X5.5 Y6.5 F100.", "X7.5", "G2 X11.5 Y2.5 I5. J0.", "G3 X3.5 Y4.5 R9.", "G1 X[5.5+1]")
ISO_WORDS = (
    "X8.25", "Y8.25", "Z8.25", "A8.25", "B8.25", "C8.25", "U8.25", "V8.25", "W8.25", "I8.25", "J8.25", "K8.25",
    "R8.25", "P8.25", "Q8.25", "L3", "E8.25", "F333.", "S777", "T7", "G10", "G18", "G20", "G28", "G41",
    "G49", "G53", "G55", "G65", "G68", "G81", "G91", "G92", "G93", "G95", "G38.2", "G777", "M30", "M98",
    "M6", "#2=3", "X#99", "zzz", "G52", "G4", "G51 X2.",
)  # fmt: skip
ISO_OTHERS = ("T2 M6", "G43 H2", "G55", "M3 S1000", "F200.", "G80", "G91", "G18", "G20", "#1=5", "M8")
ISO_STATES = (
    "X8.25",
    "Z8.25",
    "A8.25",
    "G20",
    "G41",
    "G55",
    "G65",
    "G68",
    "G91",
    "G93",
    "G38.2",
    "G777",
    "zzz",
)
ISO_BESIDE = ("G1 X8.5 M8", "G69 X6.5")
"""Motions beside a code; spindle, feed of an axis and tool change make no difference any more in such a block."""
ISO_BESIDE_WORDS = tuple(word for word in ISO_WORDS if word not in ("E8.25", "S777", "T7", "M6"))
SINUMERIK_MOTIONS = (
    "G1 X5.5 Y6.5 F100", "X7.5", "G2 X11.5 Y2.5 I=5 J=0", "G3 X3.5 Y4.5 CR=9", "X=R1+1",
)  # fmt: skip
SINUMERIK_WORDS = (
    "X8.25", "Y8.25", "Z8.25", "A8.25", "B8.25", "C8.25", "U8.25", "I8.25", "J8.25", "K8.25", "CR=8.25", "A3=0.5",
    "E1=8.25", "F333", "S777", "T7", "D0", "G18", "G70", "G41", "G53", "G55", "G91", "G93", "G95", "G777", "M6",
    "ROT", "TRAORI", "CIP", "RND=2", "X=IC(2)", "Y=R9", "zzz", "SUPA", "AP=30", "MIRROR", "CYCLE800()", "L77", "PTP",
)  # fmt: skip
SINUMERIK_OTHERS = (
    "T2", "D2", "G55", "M3 S1000", "F200", "G91", "G18", "G70", "R1=5", "CYCLE81(50,0,2,-5)", "TRAORI",
    "MCALL CYCLE81(50,0,2,-5)",
)  # fmt: skip
SINUMERIK_STATES = ("X8.25", "Z8.25", "G70", "G41", "G55", "G91", "G93", "G777", "L77", "PTP", "zzz", "RND=2")
SILENT = {"G41 MCALL CYCLE81(50,0,2,-5)"}
"""Every block after it is a cycle, which is refused already."""


def read(name: str, text: str) -> Program:
    return DIALECT[name].read((Document(Path("part.nc"), text.encode()),), SETTINGS)


def signature(program: Program) -> list[str]:
    """Everything that a reading says."""
    path = program.toolpath
    rules = path.constraints
    said = list(path.dump())
    for found in (rules.refused, rules.locked):
        said += [f"{row} {finding.code} {finding.message}" for row, finding in found.items()]
    said += [f"{row} {why}" for row, why in rules.no_insert_before.items()]
    said += [f"{finding.code} {finding.line} {finding.message}" for finding in program.findings]
    return [*said, str(path.approximation.tolist()), str(path.inverse_time_feed.tolist())]


GROUPS = (
    ("linuxcnc", ISO_MOTIONS, ISO_WORDS),
    ("linuxcnc", ISO_OTHERS, ISO_STATES),
    ("linuxcnc", ISO_BESIDE, ISO_BESIDE_WORDS),
    ("fanuc", ISO_MOTIONS, ISO_WORDS),
    ("fanuc", ISO_OTHERS, ISO_STATES),
    ("fanuc", ISO_BESIDE, ISO_BESIDE_WORDS),
    ("sinumerik", SINUMERIK_MOTIONS, SINUMERIK_WORDS),
    ("sinumerik", SINUMERIK_OTHERS, SINUMERIK_STATES),
)


def inserted(block: str, word: str) -> list[str]:
    """The block with the word at its end, at its start and between its words."""
    parts = block.split(" ")
    places = (len(parts), 0, *range(1, len(parts)))
    return [" ".join([*parts[:at], word, *parts[at:]]) for at in places]


CASES = [
    (name, block, text)
    for name, blocks, words in GROUPS
    for block in blocks
    for word in words
    if word != block
    for text in inserted(block, word)
]


def dropped(cases: list[tuple[str, str, str]]) -> list[str]:
    """Blocks with a word that makes no difference."""
    plain = {
        (name, block): signature(read(name, HEAD[name] + block + "\n" + TAIL))
        for name, block in {(name, block) for name, block, _ in cases}
    }
    return [
        text
        for name, block, text in cases
        if text not in SILENT and signature(read(name, HEAD[name] + text + "\n" + TAIL)) == plain[name, block]
    ]


def test_no_word_is_dropped() -> None:
    assert dropped(CASES[::13]) == []


@pytest.mark.slow
def test_no_word_is_dropped_anywhere() -> None:
    assert dropped(CASES) == []


def test_a_word_between_mcall_and_its_cycle_is_not_dropped() -> None:
    cycle = "MCALL CYCLE81(50,0,2,-5)"
    texts = [f"MCALL {word} CYCLE81(50,0,2,-5)" for word in ("G70", "G55", "X8.25")]
    assert dropped([("sinumerik", cycle, text) for text in texts]) == []


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        ("TRANS X1", "TRANS X8.25 X1"), ("TRANS X1", "TRANS X1 G258"), ("TRANS X1", "G158 TRANS X1"),
        ("TRANS X1", "TRANS X1 G58"), ("ROT Z0", "ROT Z3 Z0"), ("ROT Z0", "ROT Z0 AROT"),
        ("TRANS X1", "ATRANS TRANS X1"),
    ],
)  # fmt: skip
def test_a_frame_that_is_stated_twice_is_not_known(frame: str, text: str) -> None:
    """An axis or a code of a frame is legal once in a block."""
    assert dropped([("sinumerik", frame, text)]) == []
    path = read("sinumerik", HEAD["sinumerik"] + text + "\nG1 X5 Y6 Z7\n").toolpath
    assert len(path) - 1 in path.constraints.refused


def test_a_word_that_is_dropped_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The comparison itself: a reader that overlooks words is found."""
    dialect = DIALECT["linuxcnc"]

    class Overlooking:
        def read(self, documents: tuple[Document, ...], settings: ReadingSettings) -> Program:
            raw = documents[0].raw.replace(b" Y8.25", b"")
            return dialect.read((Document(documents[0].path, raw),), settings)

    monkeypatch.setitem(DIALECT, "linuxcnc", Overlooking())  # type: ignore[arg-type]
    assert dropped([("linuxcnc", "X7.5", "X7.5 Y8.25")]) == ["X7.5 Y8.25"]
