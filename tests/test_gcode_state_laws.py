"""What holds from block to block of G-code, against a walk through the blocks one by one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gcode_writing import read

from postproc.base.arrays import Floats, Ints
from postproc.base.document import Document, apply
from postproc.base.findings import CODES
from postproc.base.geometry import rotation_from_vector
from postproc.base.units import DEG
from postproc.languages.gcode import DIALECTS, kuka_cnc, positions
from postproc.languages.gcode import DIALECTS as GCODE
from postproc.languages.gcode.code_tables import LINUXCNC
from postproc.languages.gcode.comments import head
from postproc.languages.gcode.control import ProgrammedFrame
from postproc.languages.gcode.execution_flow import NONE_SAVED, ExecutionFlow, FlowReason
from postproc.languages.gcode.lexing import lex
from postproc.languages.gcode.modal_fill import FilledRows, everywhere, fill_modal, lookup, switched
from postproc.languages.gcode.numbered import references
from postproc.languages.gcode.orientation_words import Angles, Vector, swing
from postproc.languages.gcode.positions import AxisWords, Trace
from postproc.languages.gcode.refusals import RefusalCollector, RefusalReason
from postproc.languages.gcode.source import NONE, WordColumn, scan
from postproc.toolpath import Toolpath

NAN = np.nan
NAMES = {dialect.name: dialect for dialect in DIALECTS}


# Columns


@pytest.mark.parametrize("count", [0, 1, 3])
@pytest.mark.parametrize(
    "value", [5, NAN, True, [5.0], [1.0, 1.0], [1.0, 2.0], [NAN] * 3, np.eye(2), np.empty((0,))]
)
def test_one_value_everywhere(value: Any, count: int) -> None:
    """Takes no room where its parts are alike too."""
    column = everywhere(value, count)
    np.testing.assert_array_equal(column, np.stack([np.asarray(value)] * count) if count else column[:0])
    assert column.shape == (count, *np.asarray(value).shape)
    assert column.dtype == np.asarray(value).dtype
    assert not column.flags.writeable
    one = np.asarray(value)
    alike = one.size > 0 and (np.isnan(one).all() or bool((one == one.flat[0]).all()))
    assert (not any(column.strides)) == (alike or not one.size)
    assert everywhere(1, 2, np.int8).dtype == np.int8


def test_what_never_changes_takes_no_room() -> None:
    none = np.empty(0, np.int64)
    for at, value, first, held in (
        (none, none, 7, [7, 7, 7, 7]),
        (np.array([0]), np.array([3]), 7, [3, 3, 3, 3]),
        (np.array([0, 2]), np.array([3, 3]), 7, [3, 3, 3, 3]),
        (np.array([1]), np.array([7]), 7, [7, 7, 7, 7]),
        (np.array([0, 0]), np.array([1, 3]), 7, [3, 3, 3, 3]),
        (np.array([1]), np.array([3]), 7, [7, 3, 3, 3]),
        (np.array([0, 3]), np.array([3, 4]), 7, [3, 3, 3, 4]),
    ):
        state = fill_modal(4, at, value, first, np.int8)
        assert state.tolist() == held
        assert state.dtype == np.int8
        assert (state.strides == (0,)) == (len(set(held)) == 1)


def test_where_a_state_is_another_one() -> None:
    for state, before, expected in (
        (everywhere(2, 3, np.int8), 2, [False] * 3),
        (everywhere(2, 3, np.int8), 1, [True, False, False]),
        (everywhere(2, 0, np.int8), 1, []),
        (np.array([1, 1, 0, 2, 2]), 1, [False, False, True, True, False]),
        (np.array([1, 1, 0, -1, 2]), 0, [True, False, True, True, True]),
        (np.array([-128, 127, 127], np.int8), 127, [True, True, False]),
    ):
        assert switched(state, before).tolist() == expected


def test_what_a_state_means() -> None:
    table = np.array([1.0, 2.0, NAN])
    np.testing.assert_array_equal(lookup(np.array([0, 1, -1, 0]), table), [1, 2, NAN, 1])
    one = lookup(everywhere(1, 4, np.int8), table)
    assert (one.tolist(), one.strides) == ([2.0] * 4, (0,))
    assert lookup(everywhere(1, 0, np.int8), table).tolist() == []


def test_rows_are_filled_part_by_part() -> None:
    parts = [
        {"a": np.array([1, 1]), "b": np.array([NAN, NAN]), "c": np.array([[0.0, NAN]] * 2), "d": np.array([1.0, 2.0])},
        {"a": np.empty(0, int), "b": np.empty(0), "c": np.empty((0, 2)), "d": np.empty(0)},
        {"a": np.array([1]), "b": np.array([NAN]), "c": np.array([[0.0, NAN]]), "d": np.array([NAN])},
        {"a": everywhere(1, 2), "b": np.array([NAN, 3.0]), "c": np.array([[0.0, 0.0]] * 2), "d": everywhere(2.0, 2)},
    ]  # fmt: skip
    rows = FilledRows(5)
    for part in parts:
        rows.put(len(part["a"]), **part)
    for name, uniform in (("a", True), ("b", False), ("c", False), ("d", False)):
        column = rows.take_column(name)
        np.testing.assert_array_equal(column, np.concatenate([part[name] for part in parts]))
        assert (column.strides[0] == 0) == uniform
        assert not column.flags.writeable


def test_rows_whose_first_one_differs_are_kept() -> None:
    for first, second in (([1, 2], [2, 2]), ([2, 2], [1, 2]), ([2, 2], [2, 1]), ([2, 1], [2, 2])):
        rows = FilledRows(4)
        rows.put(2, a=np.array(first))
        rows.put(2, a=np.array(second))
        assert rows.take_column("a").tolist() == first + second


def test_words_of_blocks() -> None:
    column = WordColumn(np.array([1, 1, 4]), np.array([5.0, 6.0, 7.0]), np.array([0, 1, 2]))
    np.testing.assert_array_equal(column.last(np.arange(6)), [NAN, 6, NAN, NAN, 7, NAN])
    np.testing.assert_array_equal(column.last(np.arange(6), absent=-1), [-1, 6, -1, -1, 7, -1])
    np.testing.assert_array_equal(NONE.last(np.arange(2)), [NAN, NAN])
    for begin, stop, block, value in (
        (0, 2, [1, 1], [5, 6]),
        (1, 4, [0, 0], [5, 6]),
        (2, 5, [2], [7]),
        (2, 4, [], []),
    ):
        part = column.part(begin, stop)
        assert (part.block.tolist(), part.value.tolist(), len(part)) == (block, value, len(block))
    assert column.part(4, 5).how.tolist() == [2]


def test_blocks_of_a_program() -> None:
    found = scan(b"N1\nN2 X1 (a)\n/Y2\n\n;b\nM2 what\n#1=2\nG1 X3 Y4\n", LINUXCNC)
    blocks = found.blocks
    assert blocks.line.tolist() == [1, 2, 3, 6, 7, 8]
    assert blocks.wordy.tolist() == [False, True, True, True, False, True]
    assert blocks.deleted.tolist() == [False, False, True, False, False, False]
    assert blocks.first.tolist() == [0, 3, 14, 21, 29, 34]
    assert found.mask(ord("X")).tolist() == [False, True, False, False, False, True]
    assert found.mask(ord("X"), ord("Y")).tolist() == [False, True, True, False, False, True]
    assert found.mask().tolist() == [False] * 6
    assert {kind: rows.tolist() for kind, rows in found.noted.items()} == {"unknown": [3], "assign": [4]}
    assert found.comments.tolist() == [[9, 12, 2], [18, 20, 5]]
    assert len(found.column(ord("Q"))) == 0
    assert len(scan(b"", LINUXCNC).blocks) == 0


# Flow


def test_the_last_block_of_those_in_doubt() -> None:
    random = np.random.default_rng(1)
    for n in (0, 1, 2, 9, 30):
        doubt = random.integers(0, 3, n) * (random.random(n) < 0.7)
        no = np.zeros(n, np.bool_)
        expected = []
        for row in range(n):
            last = row
            while doubt[row] and last + 1 < n and doubt[last + 1]:
                last += 1
            expected.append(last)
        assert ExecutionFlow(doubt, no, no, no, no, no, no, no, NONE_SAVED).last.tolist() == expected
    assert FlowReason.NONE == 0


SETTINGS = (92, 201, 203, 204, 205, 206, 208, 218, 350, 425, 557, 558, 566, 569, 574, 665, 666, 669, 851, 906, 907, 908,
            913, 914)  # fmt: skip
"""M codes of printers (Marlin, RepRapFirmware) whose X, Y, Z are steps, speeds, currents or places of a probe."""


def test_settings_of_printers_are_no_motions() -> None:
    codes = sorted({code + by for code in SETTINGS for by in (-1, 0, 1)})
    text = "G21 G90\nG1 F60\n" + "".join(f"M{code} X5 Y{code}\n" for code in codes)
    path = read(NAMES["linuxcnc"], text).toolpath
    moving = {codes[line - 3] for line in path.line.tolist()}
    assert sorted(set(codes) - moving) == list(SETTINGS)


BESIDE = sorted(set("ABCDEFHIJKLMPQRSTUVW"))
WITHOUT_CODE = "IJKLPQR"
"""Letters of words beside X in a block; N and O number blocks and programs."""


def beside(name: str, words: str) -> Toolpath:
    return read(NAMES[name], f"G21 G90 G17 G54 T1\nG0 X0 Y0 Z0 A0 B0 C0\nG1 X1 F60\n{words}\n").toolpath


def is_whole(name: str, words: str) -> bool:
    path = beside(name, words)
    return len(path) - 1 in path.constraints.no_insert_before


@pytest.mark.parametrize(("name", "whole"), [("linuxcnc", "ABCDEHLMQSTUVW"), ("kuka_cnc", "DEHLMQSTUVW")])
def test_blocks_with_which_words_are_whole(name: str, whole: str) -> None:
    """Such that act, or move something beside the tool; rotary axes where they do not turn it about its tip."""
    path = beside(name, "\n".join(f"X2 {letter}1" for letter in BESIDE))
    assert (
        "".join(letter for row, letter in enumerate(BESIDE, 2) if row in path.constraints.no_insert_before)
        == whole
    )
    for name, code in (("linuxcnc", "G43.4"), ("fanuc", "G43.4")):
        assert not is_whole(name, f"{code}\nX2 B1")
    assert [is_whole("linuxcnc", f"G2 X2 I.5 P{turns}") for turns in (0, 1, 2)] == [
        False,
        False,
        True,
    ]
    assert [is_whole("fanuc", f"G2 X2 I.5 P{turns}") for turns in (0, 1, 2)] == [False] * 3
    assert [is_whole("sinumerik", f"G2 X2 I.5 TURN={turns}") for turns in (0, 1, 2)] == [True] * 3


@pytest.mark.parametrize("name", ["linuxcnc", "fanuc"])
def test_expressions_in_which_words_are_refused(name: str) -> None:
    """Those that say where the motion goes; what is said of feeds and tools is no matter of its place."""
    home = "G0 X0 Y0 Z0 A0 B0 C0 T1\nG1 X1 F60"
    letters = [letter for letter in BESIDE if letter != "M"]
    path = beside(name, "\n".join(f"{home}\nX2 {letter}#1\nA0" for letter in letters))
    codes = [
        path.constraints.refused[row].code if row in path.constraints.refused else ""
        for row in range(2, len(path))
    ]
    unused = dict.fromkeys(WITHOUT_CODE, "GCO001")
    first = {**dict.fromkeys("ABC", "GCO005"), **unused, **dict.fromkeys("UVW", "GCO016"), "T": "GCO015"}
    behind = {**dict.fromkeys("BC", "GCO013"), **dict.fromkeys("UVW" + WITHOUT_CODE, "GCO002"), "T": "GCO015"}
    assert dict(zip(letters, codes[2::4], strict=True)) == {
        letter: first.get(letter, "") for letter in letters
    }
    assert dict(zip(letters, codes[3::4], strict=True)) == {
        letter: behind.get(letter, "") for letter in letters
    }
    computed = beside(name, f"{home}\nX2 M#1\nX3").constraints.refused
    assert [computed[row].code for row in sorted(computed)[-2:]] == ["GCO005", "GCO005"]
    assert (
        beside(name, "G2 X2 I.5 P#1").constraints.refused[2].code == "GCO005" if name == "linuxcnc" else True
    )


# Coordinates


def course(random: np.random.Generator, n: int) -> AxisWords:
    kind = random.choice(4, (n, 6), p=[0.4, 0.3, 0.2, 0.1])
    value = np.round(random.normal(0, 1, (n, 6)), 3)
    value[random.random((n, 6)) < 0.05] = NAN
    lost, left = random.random((n, 6)) < 0.06, random.random((n, 6)) < 0.06
    no = np.zeros(n, np.bool_)
    return AxisWords(np.where(kind > 0, value, 0.0), kind == 1, kind == 2, lost, left, no, no)


def change(block: int, frame: ProgrammedFrame, position: Floats) -> ProgrammedFrame:
    """Turns and shifts of all kinds; every fifth says where the tool is."""
    random = np.random.default_rng(block)
    turn = np.eye(3) if block % 2 else rotation_from_vector(random.normal(0, 1, (1, 3)))[0]
    shift = random.normal(0, 1, 6)
    return ProgrammedFrame(frame.turn @ turn, position - shift if block % 5 == 0 else shift)


def walked(way: AxisWords, events: list[int]) -> tuple[Floats, Floats, Ints, Ints]:
    """Before and behind every block, which block told it last, and the frame, one block after the other."""
    n = len(way.value)
    here, origin, frame, number = np.full(6, NAN), np.full(6, -1), ProgrammedFrame(np.eye(3), np.zeros(6)), 0
    begins, ends, sources, frames = [], [], [], []
    for k in range(n):
        if k in events:
            here = np.where(way.unknown_before[k], NAN, here)
            there = frame.to_base(here)
            frame = change(k, frame, there)
            here, number = frame.from_base(there), number + 1
            origin = np.where(np.isnan(here), k, origin)
        begins.append(np.where(way.unknown_before[k], NAN, here))
        after = here.copy()
        for axis in range(6):
            value = way.value[k, axis]
            if way.sets[k, axis]:
                after[axis] = NAN if way.unknown[k, axis] else value
            elif way.unknown[k, axis] or way.unknown_before[k, axis]:
                after[axis] = NAN
            elif way.adds[k, axis]:
                after[axis] += value
            told = way.sets[k, axis] or way.unknown[k, axis] or way.unknown_before[k, axis]
            if told or (way.adds[k, axis] and np.isnan(value)):
                origin[axis] = k
        here = after
        ends.append(here)
        sources.append(origin.copy())
        frames.append(number)
    return np.array(begins), np.array(ends), np.array(sources), np.array(frames)


@pytest.mark.parametrize("parts", [[40], [1, 39], [7, 13, 20], [10] * 4])
@pytest.mark.parametrize("seed", range(5))
def test_coordinates_are_followed_from_block_to_block(seed: int, parts: list[int]) -> None:
    random = np.random.default_rng(seed)
    way = course(random, 40)
    events = sorted(set(random.integers(0, 40, seed * 2).tolist()) | ({7, 20} if seed else set()))
    trace = Trace(ProgrammedFrame(np.eye(3), np.zeros(6)), np.array(events, np.int64), change)
    found, begin = [], 0
    for size in parts:
        rows = slice(begin, begin + size)
        found.append(trace.follow(AxisWords(*(column[rows] for column in vars(way).values())), begin))
        begin += size
    begins, ends, sources, frames = walked(way, events)
    np.testing.assert_allclose(np.concatenate([part.start for part in found]), begins, atol=1e-12)
    np.testing.assert_allclose(np.concatenate([part.end for part in found]), ends, atol=1e-12)
    np.testing.assert_array_equal(np.concatenate([part.source for part in found]), sources)
    np.testing.assert_array_equal(np.concatenate([part.frame for part in found]), frames)
    np.testing.assert_array_equal(trace.frame_of(np.arange(40)), frames)
    base = np.array([trace.frames[f].to_base(end) for f, end in zip(frames, ends, strict=True)])
    np.testing.assert_allclose(np.concatenate([part.in_base() for part in found]), base, atol=1e-12)


def test_behind_too_many_changes_nothing_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(positions, "MOST", 3)
    n = 6
    none, all_ = np.zeros((n, 6), np.bool_), np.ones((n, 6), np.bool_)
    trace = Trace(
        ProgrammedFrame(np.eye(3), np.zeros(6)),
        np.arange(1, n),
        lambda *_: ProgrammedFrame(np.eye(3), np.zeros(6)),
    )
    found = trace.follow(AxisWords(np.ones((n, 6)), all_, none, none, none, none[:, 0], none[:, 0]), 0)
    assert found.frame.tolist() == [0, 1, 2, 3, 3, 3]
    assert np.isfinite(found.in_base()).all(axis=1).tolist() == [True, True, True, False, False, False]


def test_a_frame_there_and_back() -> None:
    random = np.random.default_rng(2)
    turn = rotation_from_vector(random.normal(0, 1, (1, 3)))[0]
    frame, point = ProgrammedFrame(turn, random.normal(0, 1, 6)), random.normal(0, 1, (5, 6))
    there = frame.to_base(point)
    np.testing.assert_allclose(there[:, :3], point[:, :3] @ turn.T + frame.shift[:3])
    np.testing.assert_allclose(there[:, 3:], point[:, 3:] + frame.shift[3:])
    np.testing.assert_allclose(frame.from_base(there), point, atol=1e-12)
    # Without a rotation an axis that is not known says nothing of the others.
    straight = ProgrammedFrame(np.eye(3), np.arange(6.0))
    half = np.array([NAN, 1, 2, 3, NAN, 5])
    np.testing.assert_array_equal(straight.to_base(half), half + np.arange(6))
    np.testing.assert_array_equal(straight.from_base(half), half - np.arange(6))
    assert np.isnan(frame.to_base(half)[:3]).all()


# Numbers of bases and tools


def test_frames_of_bases_and_tools() -> None:
    base, tool = np.array([2, 2, -1, 0, 2, 7]), np.array([3, 3, 3, 3, 3, 3])
    line = np.array([10, 11, 12, 13, 14, 15])
    bases, tools, frames = references(base, tool, line)
    said = [(frame.number, frame.pose is None, frame.line) for frame in frames]
    assert said == [(0, False, 13), (2, True, 10), (7, True, 15), (3, True, 10)]
    assert bases.tolist() == [1, 1, -1, 0, 1, 2]
    assert tools.tolist() == [3] * 6
    np.testing.assert_array_equal(frames[0].pose.position, np.zeros(3))  # type: ignore[union-attr]
    # A tool with the number 0 is no frame of the control's own.
    bases, tools, frames = references(np.array([-1, -1]), np.array([0, -1]), np.array([4, 5]))
    assert [(frame.number, frame.pose, frame.line) for frame in frames] == [(0, None, 4)]
    assert (bases.tolist(), tools.tolist()) == ([-1, -1], [0, -1])
    empty = references(np.empty(0, int), np.empty(0, int), np.empty(0, int))
    assert ([len(column) for column in empty]) == [0, 0, 0]


@pytest.mark.parametrize(
    ("text", "offset"),
    [
        ("5200", False), ("5201", True), ("5400", True), ("5401", False), ("7000", False), ("7001", True),
        ("7999", True), ("8000", False), ("14000", False), ("14001", True), ("20000", True), ("20001", False),
        ("2400", False), ("2401", True), ("2500", True), ("2501", True), ("2606", True), ("2806", True), ("2999", True),
        ("3000", False), ("3003", False), ("3004", False), ("3005", True), ("3006", False), ("5499", False),
        ("5521", True), ("5701", False), ("26000", True), ("26999", True), ("27000", False), ("100000", False),
        ("100051", True), ("115351", False),
        ("000005221", True), ("1", False), ("5221000000", False), ("[5221]", True), ("<a>", False), ("x", True),
    ],
)  # fmt: skip
def test_variables_that_are_offsets(text: str, offset: bool) -> None:
    """A variable that is computed may be one; those with a name are none."""
    path = read(NAMES["fanuc"], f"G21 G90 G54\nG0 X0 Y0 Z50\n#{text}=1\nG1 X1 F100\nM30\n").toolpath
    assert path.base.tolist() == [0, -1 if offset else 0]


@pytest.mark.parametrize("number", [2401, 2501, 2806, 3005, 4999])
def test_variables_of_linuxcnc_below_5000_are_the_programs_own(number: int) -> None:
    path = read(
        NAMES["linuxcnc"], f"G21 G90 G54\nG0 X0 Y0 Z50\n#{number}=1\nG1 X#{number} F100\nM2\n"
    ).toolpath
    assert path.base.tolist() == [0, 0]
    np.testing.assert_allclose(path.position[:, 0], [0, 1e-3])


WEIGHTS = (100, 101, 102, *range(129, 138), 231, 233, 234)
"""Codes of acceleration, whose percentage follows without a letter."""


def test_percentages_follow_some_codes_of_kuka_cnc() -> None:
    for code in range(400):
        notes = lex(b"G%d 50" % code, kuka_cnc.CONTROL).notes
        assert (not notes) == (code in WEIGHTS), code


# Refusals


def test_the_first_reason_stays() -> None:
    doubts = RefusalCollector(5)
    doubts.refuse(np.array([False, True, False, True, False]), "GCO001", "one")
    doubts.refuse(np.array([True, True, False, False, False]), "GCO002", "two", "do this")
    doubts.refuse(np.zeros(5, np.bool_), "GCO003", "never")
    part = doubts.part(slice(2, 5))
    reasons = [RefusalReason("GCO002", "three", "two"), RefusalReason("GCO001", "one", "one")]
    part.refuse_each(np.array([0, 1, 2]), reasons, np.array([0, 0, 1]))
    found = doubts.done(
        Document(Path("a.nc"), b""),
        np.arange(10, 15),
        np.array([0, 20, 40, 60, 80]),
        np.array([2, 20, 41, 60, 85]),
    )
    assert list(found) == [0, 1, 2, 3, 4]
    assert len(found) == 5
    said = [(found[row].code, found[row].message, found[row].line, found[row].column) for row in found]
    assert said == [
        ("GCO002", "two", 10, 3), ("GCO001", "one", 11, 1), ("GCO002", "three", 12, 2), ("GCO001", "one", 13, 1),
        ("GCO001", "one", 14, 6),
    ]  # fmt: skip
    actions = ["do this", *(CODES[code].action for code, *_ in said[1:])]
    assert [finding.advice for finding in found.values()] == actions
    assert [str(finding) for finding in found.findings()] == [
        "a.nc:10:3: GCO002 two; 2 motions, lines 10 to 12",
        "a.nc:11:1: GCO001 one; 3 motions, lines 11 to 14",
    ]


def test_rows_that_are_not_refused() -> None:
    doubts = RefusalCollector(9)
    doubts.refuse(np.isin(np.arange(9), (2, 5)), "GCO001", "one")
    found = doubts.done(Document(Path("a.nc"), b""), np.arange(9), np.zeros(9, int), np.zeros(9, int))
    assert [row in found for row in range(-1, 10)] == [row in (2, 5) for row in range(-1, 10)]
    assert np.int64(5) in found
    assert "5" not in found
    for row in (0, 3, 6, 8, 100):
        with pytest.raises(KeyError):
            found[row]
    none = RefusalCollector(3).done(Document(Path("a.nc"), b""), np.arange(3), np.arange(3), np.arange(3))
    assert (len(none), none.findings(), 0 in none) == (0, [], False)


# Orientations


def test_a_vector_points_from_the_tip_to_the_spindle() -> None:
    tool = rotation_from_vector(np.array([[np.pi, 0.0, 0.0]]))[0]
    vector = Vector((1, 2, 3), np.eye(3), tool)
    values = np.array([[0, 0, 1], [1, 0, 0], [0, 3, 0], [0, 0, -2], [NAN, 0, 5], [0, 0, 0]], float)
    found = vector.rotation(values)
    np.testing.assert_allclose(
        (found @ vector.redundant_axis)[:5],
        [[0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]],
        atol=1e-12,
    )
    assert np.isnan(found[5]).all()
    near = np.array([[0, 0, 2], [0, 0, 1], [NAN, NAN, NAN], [0, 0, 0.5], [0, 0, 0]], float)
    again = vector.values(found[:5], near)
    np.testing.assert_allclose(np.linalg.norm(again, axis=1), [2, 1, 1, 0.5, 1])
    np.testing.assert_allclose(again[:2], [[0, 0, 2], [1, 0, 0]], atol=1e-12)
    assert vector.writable(values).tolist() == [True] * 6
    unknown = Vector((1, 2, 3), np.eye(3), None)
    assert np.isnan(unknown.rotation(values)).all()
    assert np.isnan(unknown.values(found, values)).all()
    assert np.isnan(unknown.redundant_axis).all()
    assert unknown.writable(values).tolist() == [False] * 6


def test_swing_of_what_points_down_is_about_x() -> None:
    for tilt in (0.0, 1e-13):
        np.testing.assert_allclose(swing(np.array([[0, tilt, -1.0]]))[0], np.diag([1, -1, -1]), atol=1e-12)
    np.testing.assert_allclose(swing(np.array([[0, 0, 1.0]]))[0], np.eye(3), atol=1e-12)


ROTARY = Angles((65, 66, 67), ((2, 2), (1, 1), (0, 0)), np.eye(3), np.eye(3))
HEAD = Angles((-1, 66, 67), ((2, 2), (1, 1)), np.eye(3), np.eye(3), free_spin=True)
ONE = Angles((-1, -1, 67), ((2, 2),), np.eye(3), np.eye(3), free_spin=True)


def test_where_angles_say_small_changes() -> None:
    """All but near their poles: twenty times the change there is too much."""
    for b, fine in ((0, True), (80, True), (90, False), (89.99, False), (-90, False)):
        assert ROTARY.writable(np.array([[10.0, b, 20.0]])).tolist() == [fine]
    pole = np.degrees(np.arcsin(0.05))
    for b, fine in ((0, False), (0.99 * pole, False), (1.01 * pole, True), (-1.01 * pole, True), (90, True)):
        assert HEAD.writable(np.array([[NAN, b, 20.0]])).tolist() == [fine], b
    assert ONE.writable(np.zeros((2, 3))).tolist() == [False, False]
    nothing = Angles((65, 66, 67), ((2, 2), (1, 1), (0, 0)), np.eye(3), None)
    assert nothing.writable(np.full((2, 3), 10.0)).tolist() == [False, False]
    assert np.isnan(nothing.rotation(np.zeros((2, 3)))).all()
    assert np.isnan(nothing.values(np.stack([np.eye(3)] * 2), np.zeros((2, 3)))).all()
    assert np.isnan(nothing.redundant_axis).all()
    assert np.isnan(ROTARY.redundant_axis).all()
    assert HEAD.redundant_axis.tolist() == [0, 0, 1]


def test_angles_are_those_nearest() -> None:
    """On their turn, exactly; NaN where none lead there; a word that is not used has none."""
    near = np.array([[10.0, 20, 30], [370, 20, 30], [0, 0, 0], [10, 20, 30]])
    there = ROTARY.rotation(np.array([[11.0, 21, 29], [11, 21, 29], [50, -60, 70], [10, 20, 30]]))
    there[3] = NAN
    found = ROTARY.values(there, near)
    np.testing.assert_allclose(found[:3], [[11, 21, 29], [371, 21, 29], [50, -60, 70]], atol=1e-7)
    assert np.isnan(found[3]).all()
    found = HEAD.values(
        HEAD.rotation(np.array([[NAN, 30, 40], [NAN, 30, 40]])), np.array([[5.0, 29, 41], [5, 30, 40]])
    )
    np.testing.assert_allclose(found[:, 1:], [[30, 40], [30, 40]], atol=1e-7)
    assert np.isnan(found[:, 0]).all()
    # One axis reaches no other direction.
    assert np.isnan(ONE.values(HEAD.rotation(np.array([[NAN, 30.0, 40]])), np.zeros((1, 3)))).all()
    # Opposite to where the tool points: half a turn.
    tipped = HEAD.values(HEAD.rotation(np.array([[NAN, 170.0, 0]])), np.array([[NAN, 1.0, 0.5]]))
    np.testing.assert_allclose(
        HEAD.rotation(tipped)[0, :, 2], HEAD.rotation(np.array([[NAN, 170.0, 0]]))[0, :, 2], atol=1e-8
    )


def test_frame_and_tool_of_angles() -> None:
    random = np.random.default_rng(3)
    frame, tool = (rotation_from_vector(random.normal(0, 1, (1, 3)))[0] for _ in range(2))
    angles = Angles((65, 66, 67), ((2, 2), (1, 1), (0, 0)), frame, tool)
    values = np.array([[10.0, 20, 30]])
    about = [
        rotation_from_vector(angle * DEG * np.eye(3)[[axis]])[0]
        for axis, angle in ((2, 30), (1, 20), (0, 10))
    ]
    np.testing.assert_allclose(
        angles.rotation(values)[0], frame @ about[0] @ about[1] @ about[2] @ tool, atol=1e-12
    )
    np.testing.assert_allclose(angles.values(angles.rotation(values), values + 2), values, atol=1e-7)


# Files

HEADS: list[tuple[bytes, int]] = [
    (b"", 0), (b"G0", 0), (b"%", 1), (b"%\n", 2), (b"\n\n%\nG0", 4), (b"\n\nG0", 0), (b"%\n\nO1 (A)\n\nG0", 10),
    (b"%\r\n\r\nO1\r\nG0", 9), (b"\xef\xbb\xbf%\nG0", 5), (b"\xef\xbb\xbfG0", 3), (b"%_N_A_MPF\n;$PATH=/_N_X\nG0", 23),
    (b":12 ; a\nG0", 8), (b"O<abc>\nG0", 7), (b"O1 G0\n", 0), (b" % a\n O 12 \nG0", 12), (b"%\n\n", 2), (b"O1", 2),
    (b"%\n;A\nO1\n", 2), (b"%\nO1", 4),
]  # fmt: skip


@pytest.mark.parametrize(("raw", "end"), HEADS)
def test_where_the_head_of_a_program_ends(raw: bytes, end: int) -> None:
    assert head(raw) == end


KINDS: list[tuple[str, bytes, str]] = [
    # name, text, those that claim it
    ("a.nc", b"", "fanuc- linuxcnc"),
    ("a.NC", b"hello", "linuxcnc"),
    ("a.txt", b"hello", ""),
    ("a.txt", b"G1 X1\n", "linuxcnc"),
    ("a.txt", b"G21\n", ""),
    ("a.txt", b"G5\nM8\n", ""),
    ("a.txt", b"X1\n", "linuxcnc"),
    ("a.txt", b"M3 S1000\nG0 Z5\n", "linuxcnc"),
    ("a.txt", b"O100\nG1 X1\n", "fanuc linuxcnc"),
    ("a.txt", b"O100\nhello\n", ""),
    ("a.nc", b"O100\n", "fanuc linuxcnc"),
    ("a.nc", b"o100 sub\n", "linuxcnc"),
    ("a.nc", b"G1 X1\nG05.1 Q1\n", "fanuc linuxcnc"),
    ("a.nc", b"G65 P1\n", "fanuc linuxcnc"),
    ("a.nc", b"IF [1] GOTO 5\n", "fanuc linuxcnc"),
    ("a.nc", b"(M98 P1)\n", "linuxcnc"),
    ("a.mpf", b"G1 X1\n", "linuxcnc sinumerik"),
    ("a.SPF", b"G1 X1\n", "linuxcnc sinumerik"),
    ("a.nc", b"TRAORI\nG1 X1\n", "linuxcnc sinumerik"),
    ("a.nc", b"G1 X=AC(5)\n", "linuxcnc sinumerik"),
    ("a.nc", b"#TRAFO ON\nG1 X1\n", "kuka_cnc linuxcnc"),
    ("a.nc", b"N10 # CS ON[1]\n", "kuka_cnc linuxcnc"),
    ("a.nc", b"#1=5\n", "linuxcnc"),
    ("a.nc", b"DEF A()\nG1 X1\n", ""),
    ("a.nc", b"&ACCESS RVP\nG1 X1\n", ""),
    ("a.mpf", b"LIN {X 1}\nTRAORI\n", ""),
    ("a.txt", b" " * 65536 + b"\nG1 X1\n", ""),
    ("a.nc", b" " * 65536 + b"\nO100\nTRAORI\n#TRAFO ON\nDEF A()\n", "linuxcnc"),
]


@pytest.mark.parametrize(("name", "raw", "controls"), KINDS)
def test_whose_program_it_is(name: str, raw: bytes, controls: str) -> None:
    found = sorted(one.name for one in GCODE if one.claims(Path(name), raw))
    assert found == [control for control in controls.split() if not control.endswith("-")]


@pytest.mark.parametrize("newline", [b"\n", b"\r\n"])
@pytest.mark.parametrize(
    ("name", "raw", "marked"),
    [
        ("linuxcnc", b"G0 X1\n", b"(COMPENSATED by compensate [a])\nG0 X1\n"),
        ("linuxcnc", b"%\nO1\nG0\n", b"%\nO1\n(COMPENSATED by compensate [a])\nG0\n"),
        ("linuxcnc", b"%\nO1", b"%\nO1\n(COMPENSATED by compensate [a])"),
        ("linuxcnc", b"", b"(COMPENSATED by compensate [a])\n"),
        ("fanuc", b"\xef\xbb\xbfG0\n", b"\xef\xbb\xbf(COMPENSATED by compensate [a])\nG0\n"),
        ("sinumerik", b"%_N_A_MPF\nG0\n", b"%_N_A_MPF\n;COMPENSATED by compensate [a]\nG0\n"),
        ("kuka_cnc", b"G0\n;COMPENSATED by compensate x\nX1\n", b"G0\n;COMPENSATED by compensate [a]\nX1\n"),
    ],
)
def test_where_a_program_is_marked(name: str, raw: bytes, marked: bytes, newline: bytes) -> None:
    if b"\n" not in raw and newline == b"\r\n":
        return  # which newline it has is not said
    raw, marked = raw.replace(b"\n", newline), marked.replace(b"\n", newline)
    program = read(NAMES[name], raw)
    assert apply(program.documents[0], [NAMES[name].marked(program, "(a)")]) == marked
    assert NAMES[name].companions(Path("a.nc")) == []
    assert NAMES[name].renamed(program, "b") == []
