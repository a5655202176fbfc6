"""Laws of G-code that hold for any program: what codes mean, where words and findings stand, blocks of rows, and what
of a Sinumerik is not read rather than misread."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gcode_writing import DOWN, WRITING, random_plan, read

from postproc.base.document import Document, apply
from postproc.base.geometry import rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.languages.dialect import Plan, Program, ReadingSettings
from postproc.languages.gcode import DIALECTS, kuka_cnc, sinumerik, source
from postproc.languages.gcode import reader as reader_module
from postproc.languages.gcode import writer as writer_module
from postproc.languages.gcode.code_tables import FANUC, LINUXCNC
from postproc.languages.gcode.control import Control, Feed, Group, ModalCode, Move, Once
from postproc.languages.gcode.lexing import lex
from postproc.languages.gcode.words import How

ROOT = Path(__file__).parent / "programs"
NAMES = {dialect.name: dialect for dialect in DIALECTS}
CONTROLS: dict[str, tuple[Control, dict[bytes, tuple[float, ...]]]] = {
    "linuxcnc": (LINUXCNC, {}),
    "fanuc": (FANUC, {}),
    "kuka_cnc": (kuka_cnc.CONTROL, kuka_cnc.NAMED),
    "sinumerik": (sinumerik.CONTROL, sinumerik.NAMED),
}
CASES = [
    path
    for name in NAMES
    for path in sorted((ROOT / name).rglob("*"))
    if path.is_file() and path.suffix != ".dump"
]
cases = pytest.mark.parametrize("path", CASES, ids=lambda path: f"{path.parent.name}-{path.stem}")


def dialect_of(path: Path):
    return NAMES[next(part for part in reversed(path.parts) if part in NAMES)]


def settings_of(path: Path) -> ReadingSettings:
    return ReadingSettings(
        orientation=DOWN.orientation, options={"integer_words": "um" if "_um" in path.stem else "mm"}
    )


def program(path: Path) -> Program:
    return dialect_of(path).read((Document(path, path.read_bytes()),), settings_of(path))


PLAIN = re.compile(rb"[-+]?[\d. \t]+")

# Codes


def meaning(code: ModalCode) -> str:
    """``MOTION LINE``, ``UNITS 1``"""
    words = {Group.MOTION: Move, Group.ONCE: Once, Group.FEED: Feed}.get(code.group)
    return f"{code.group.name} {words(code.value).name if words and code.value >= 0 else code.value}"


def listing(control: Control, named: dict[bytes, tuple[float, ...]]) -> list[str]:
    """What each code of a control says, one meaning a line; and what is in force before anything is said."""
    names: dict[int, str] = {
        round(number * 10): name.decode() for name, numbers in named.items() for number in numbers
    }
    found: dict[str, list[int]] = {}
    for number, code in control.codes.items():
        found.setdefault(meaning(code), []).append(number)
    for number, codes in control.also.items():
        for code in codes:
            found.setdefault(f"also {meaning(code)}", []).append(number)
    lines = [
        f"{what}: {' '.join(names.get(n, f'G{n / 10:g}') for n in sorted(found[what]))}"
        for what in sorted(found)
    ]
    lines += [
        f"begins with {meaning(ModalCode(group, value))}" for group, value in sorted(control.start.items())
    ]
    return [
        *lines,
        f"ends with {' '.join(f'M{n}' for n in sorted(control.endings))}",
        f"turns {control.turns} cycle apart {control.cycle_apart} increments {control.increments} "
        f"angles {control.angles} whole {control.whole} further {control.further}",
    ]


@pytest.mark.parametrize("name", CONTROLS)
def test_codes_mean_what_is_listed(name: str) -> None:
    """The list is read beside the manual of the control: what a code means changes there or nowhere."""
    assert listing(*CONTROLS[name]) == (ROOT / "codes" / f"{name}.txt").read_text().splitlines()


# Places


@cases
def test_words_stand_where_their_numbers_are(path: Path) -> None:
    """A word begins with its address; its number's bytes are its value; one without a number has no place for it."""
    raw = path.read_bytes()
    control = sinumerik.with_tools(raw) if "sinumerik" in path.parts else CONTROLS[dialect_of(path).name][0]
    text = lex(raw, control)
    words, lines = text.words, text.blocks
    for k in range(len(words)):
        at, start, stop, block = (int(a[k]) for a in (words.at, words.start, words.stop, words.block))
        assert lines.start[block] <= at < stop <= lines.stop[block]
        assert start == -1 or at < start < stop or (start == at and raw[at : at + 1].isdigit())
        if start >= 0 and PLAIN.fullmatch(raw[start:stop]):
            assert float(raw[start:stop].translate(None, b" \t")) == words.value[k]
        elif start < 0:
            assert words.how[k] != How.NUMBER
    feeds = np.flatnonzero(np.frombuffer(raw, np.uint8) == 10)
    assert np.array_equal(lines.line, 1 + np.searchsorted(feeds, lines.start))


@pytest.mark.sample(27)
@cases
def test_findings_point_into_their_file(path: Path) -> None:
    found = program(path)
    document = found.documents[0]
    for finding in [*found.findings, *found.toolpath.constraints.refused.values()]:
        assert 1 <= finding.line <= len(document.line_starts)
        assert 1 <= finding.column <= max(len(document.line(finding.line)), 1), finding


# Blocks


@pytest.mark.sample(2)
@cases
def test_parts_do_not_matter(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Read and written in parts of a few rows, a program is the same motions and the same edits."""
    whole = program(path)
    plan = random_plan(whole, 7)
    edits = dialect_of(path).edit_targets(whole, plan, WRITING)
    for size in (1, 2, 3, 7):
        monkeypatch.setattr(reader_module, "PART", size)
        monkeypatch.setattr(writer_module, "ROWS", size)
        monkeypatch.setattr(source, "SIZE", 16 * size)
        part = program(path)
        assert list(part.toolpath.dump()) == list(whole.toolpath.dump())
        assert part.findings == whole.findings
        again = dialect_of(path).edit_targets(part, plan, WRITING)
        assert list(again.edits) == list(edits.edits)
        assert again.unwritten == edits.unwritten


# Sinumerik: nothing is misread

HEAD = "G71 G90 G17 G54 T1 D1\nTRAORI\nG0 X0 Y0 Z100 A3=0 B3=0 C3=1\nF1000\n"


def body(text: str) -> Program:
    return read(NAMES["sinumerik"], HEAD + text + "\n")


def refused(found: Program) -> list[int]:
    return sorted(found.toolpath.constraints.refused)


@pytest.mark.parametrize("word", ["A1.5=1", "A-3=1", "A3 3=1", "3=1", "A=", "A3=", "X==1"])
def test_an_address_that_is_none_is_not_read(word: str) -> None:
    """It is told, and the motion stays as it is."""
    found = body(f"G1 X1 Y2 Z3 {word}")
    assert refused(found)[-1:] == [len(found.toolpath) - 1] or not found.toolpath.known[-1]
    assert found.findings


VIRTUAL = (("ORIVIRT1", False), ("ORIVIRT2", False))
"""Machine data state what these angles are."""


@pytest.mark.parametrize("angles", ["A2=10 B2=20 C2=30", "A2=0 B2=0 C2=0", "C2=5"])
def test_angles_of_a_mode_that_is_not_read_turn_nothing(angles: str) -> None:
    """ORIRPY2 takes them in another order: the orientation is not known; a tool vector is one in every mode."""
    for mode, known in (("ORIEULER", True), ("ORIRPY", True), ("ORIRPY2", False), *VIRTUAL):
        path = body(f"{mode}\nG1 X1 Y2 Z3 {angles}").toolpath
        said = len(path) - 1 not in path.constraints.refused and bool(np.isfinite(path.rotation[-1]).all())
        assert said == known, mode
        vector = body(f"{mode}\nG1 X1 Y2 Z3 A3=0 B3=1 C3=1").toolpath
        assert not vector.constraints.refused
        np.testing.assert_allclose(vector.rotation[-1][:, 2], [0, -(0.5**0.5), -(0.5**0.5)], atol=1e-12)


def test_angles_of_the_two_modes_that_are_read_turn_as_they_say() -> None:
    turned = {
        mode: body(f"{mode}\nG1 X1 A2=10 B2=20 C2=30").toolpath.rotation[-1]
        for mode in ("ORIEULER", "ORIRPY")
    }
    assert not np.allclose(turned["ORIEULER"], turned["ORIRPY"], atol=5 * DEG)


@pytest.mark.parametrize(
    ("text", "known"),
    [
        ("G1 X1 A3=0 B3=1 C3=1", True),
        ("ORIMKS\nG1 X1 A3=0 B3=1 C3=1", True),
        ("TRANS X5\nORIMKS\nG1 X1 Y0 Z0 A3=0 B3=1 C3=1", True),
        ("ROT Z30\nG1 X1 Y0 Z0 A3=0 B3=1 C3=1", True),
        ("ROT Z30\nORIMKS\nG1 X1 Y0 Z0 A3=0 B3=1 C3=1", False),
        ("ORIMKS\nA3=0 B3=1 C3=1\nROT Z30\nG1 X1 Y0 Z0", False),
        ("ROT Z30\nORIMKS\nA3=0 B3=1 C3=1\nORIWKS\nROT\nG1 X1 Y0 Z0", False),
        ("ROT Z30\nORIMKS\nORIWKS\nG1 X1 Y0 Z0 A3=0 B3=1 C3=1", True),
        ("ROT Z30\nORIMKS\nORIEULER\nG1 X1 Y0 Z0 A2=0 B2=9 C2=0", False),
        # how far the tool turns about its axis
        ("G1 X1 A3=0 B3=1 C3=1 THETA=0", False),
        ("THETA=40\nG1 X1 A3=0 B3=1 C3=1", False),
        ("G1 X1 THETA=IC(4)\nG1 X2", False),
        ("ORIROTR\nG1 X1 A3=0 B3=1 C3=1", True),
        ("ORIROTC\nG1 X1 A3=0 B3=1 C3=1", False),
    ],
)
def test_a_tool_vector_that_is_not_certain_turns_nothing(text: str, known: bool) -> None:
    found = body(text)
    path, last = found.toolpath, len(found.toolpath) - 1
    assert bool(np.isfinite(path.rotation[-1]).all()) == known
    assert (path.constraints.refused[last].code if last in path.constraints.refused else "") == (
        "" if known else "GCO013"
    )
    assert np.isfinite(path.rotation[0]).all()


def test_the_turn_of_a_tool_without_vectors_is_not_known_either() -> None:
    head = "G71 G90 G17 G54 T1 D1\nTRAORI\nG0 X0 Y0 Z100\nF1000\n"
    assert not read(NAMES["sinumerik"], head + "G1 X1\n").toolpath.constraints.refused
    assert 1 in read(NAMES["sinumerik"], head + "G1 X1 THETA=20\n").toolpath.constraints.refused


@pytest.mark.parametrize("turns", [0, 1, 2, 5])
def test_turns_of_an_arc_are_those_said(turns: int) -> None:
    """TURN= counts those beyond the first, P of LinuxCNC all of them."""
    found = body(f"G1 X10 Y0 Z0\nG2 X10 Y0 I-10 J0 TURN={turns}\n").toolpath
    assert abs(found.arcs.sweep[-1]) == pytest.approx(2 * np.pi * (turns + 1))
    if turns:
        other = read(
            NAMES["linuxcnc"], f"G21 G90 G17 T1\nG0 X10 Y0 Z0\nF600\nG2 X10 Y0 I-10 J0 P{turns}\n"
        ).toolpath
        assert abs(other.arcs.sweep[-1]) == pytest.approx(2 * np.pi * turns)


# Digits

SHARES = (0.1, 0.4, 0.49, 0.51, 0.55, 0.6, 0.7, 0.9, 1.0, 1.4, 1.6)
"""Of a written step."""
START = {
    "linuxcnc": "G21 G90 G17 G54 T1\nG0 X0 Y0 Z0\n",
    "fanuc": "G21 G90 G17 G54 T1\nG0 X0. Y0. Z0.\n",
    "sinumerik": HEAD,
    "kuka_cnc": "G71 G90 G17 G54 T1\nG0 X0 Y0 Z0 A0 B0 C180\n",
}


@pytest.mark.sample(8)
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("name", NAMES)
def test_a_number_changes_where_another_is_nearer(name: str, share: float, sign: int) -> None:
    """Half of a written step and not less: what is read again is never farther than that from what was planned."""
    found = read(NAMES[name], START[name] + "G1 X1. Y2. Z3. F1000\nG1 X4. Y5. Z6.\nG1 X7. Y8. Z9.\n")
    step = 10.0**-WRITING.mm * MM
    for axis in range(3):
        position = found.toolpath.position.copy()
        position[-2, axis] += sign * share * step
        edits = NAMES[name].edit_targets(found, replace(Plan.of(found.toolpath), position=position), WRITING)
        assert not edits.unwritten
        assert bool(len(edits.edits)) == (share > 0.5)
        raw = apply(found.documents[0], list(edits.edits))
        again = read(NAMES[name], raw).toolpath.position
        assert np.abs(again - position).max() <= 0.5001 * step


@pytest.mark.parametrize("share", SHARES)
def test_a_tool_vector_changes_where_another_is_nearer(share: float) -> None:
    """It is written as one whole, in digits of its own: 1e-3 of it are a milliradian."""
    found = body("G1 X1. Y2. Z3. A3=0 B3=0 C3=1\nG1 X4. Y5. Z6.\n")
    step = 10.0**-WRITING.deg
    for axis in ([1.0, 0.0, 0.0], [0.0, -1.0, 0.0]):
        rotation = found.toolpath.rotation.copy()
        rotation[-2:] = rotation_from_vector(share * step * np.array(axis)) @ rotation[-2:]
        edits = NAMES["sinumerik"].edit_targets(
            found, replace(Plan.of(found.toolpath), rotation=rotation), WRITING
        )
        assert not edits.unwritten
        again = read(NAMES["sinumerik"], apply(found.documents[0], list(edits.edits))).toolpath.rotation
        apart = np.linalg.norm(np.cross(again[-2:, :, 2], rotation[-2:, :, 2]), axis=1)
        assert apart.max() <= 0.5001 * step


@pytest.mark.sample(5)
@pytest.mark.parametrize("words", ["A2=0 B2=0 C2=0", "A2=10 B2=20 C2=30"])
@pytest.mark.parametrize("share", SHARES)
def test_angles_change_where_others_are_nearer(words: str, share: float) -> None:
    found = body(f"ORIRPY\nG1 X1. Y2. Z3. {words}\nG1 X4. Y5. Z6.\n")
    step = 10.0**-WRITING.deg * DEG
    for axis in np.eye(3):
        rotation = found.toolpath.rotation.copy()
        rotation[-2:] = rotation_from_vector(share * step * axis) @ rotation[-2:]
        edits = NAMES["sinumerik"].edit_targets(
            found, replace(Plan.of(found.toolpath), rotation=rotation), WRITING
        )
        assert not edits.unwritten
        again = read(NAMES["sinumerik"], apply(found.documents[0], list(edits.edits))).toolpath.rotation
        # The tool may spin: two of the three angles say where it points.
        apart = np.linalg.norm(np.cross(again[-2:, :, 2], rotation[-2:, :, 2]), axis=1)
        assert apart.max() <= 2 * 0.5001 * step


@pytest.mark.parametrize("code", ["G52", "G92"])
@pytest.mark.parametrize(("unit", "whole"), [("G21", "X1000 Y-2500 Z3000"), ("G20", "X10000 Y-25000 Z30000")])
def test_shifts_count_increments_too(code: str, unit: str, whole: str) -> None:
    """A control that takes X1000 for a millimetre does so wherever it says a length."""
    micro = ReadingSettings(orientation=DOWN.orientation, options={"integer_words": "um"})
    ends = []
    for said in (whole, "X1. Y-2.5 Z3."):
        text = f"{unit} G90 G17 G54 T1\nG0 X0. Y0. Z0.\n{code} {said}\nG1 X4. Y5. Z6. F100\n"
        ends.append(read(NAMES["fanuc"], text, micro).toolpath.position)
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-12)
    text = f"{unit} G90 G17 G54 T1\nG0 X0. Y0. Z0.\nG1 X4. Y5. Z6. F100\n"
    assert np.abs(ends[0][-1] - read(NAMES["fanuc"], text, micro).toolpath.position[-1]).max() > 0.5 * MM
