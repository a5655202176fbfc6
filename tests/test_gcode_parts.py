"""G-code is read and written part by part: where the parts are cut changes nothing, and what a program has nowhere
takes no room."""

from dataclasses import replace
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from gcode_writing import WRITING, random_plan, read

from postproc.base.arrays import Floats
from postproc.base.document import Document, apply
from postproc.languages.dialect import Program
from postproc.languages.gcode import DIALECTS, reader, source, writer
from postproc.languages.gcode.code_tables import LINUXCNC
from postproc.languages.gcode.modal_fill import FilledRows, everywhere, fill_modal
from postproc.languages.gcode.source import scan
from postproc.toolpath import Plan, Toolpath
from postproc.toolpath.columns import MotionColumns

PROGRAMS = Path(__file__).parent / "programs"
COLUMNS = (
    "kind position rotation axes feed base tool line arcs.centre arcs.normal arcs.sweep arcs.plane_free"
    " approximation constraints.orientation_programmed orientation_control.redundant_axis inverse_time_feed"
)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "SIZE", 30)
    monkeypatch.setattr(reader, "PART", 3)
    monkeypatch.setattr(writer, "ROWS", 2)


def read_all() -> dict[Path, Program]:
    """Every program of the tests, good and bad, by its control."""
    return {
        path: dialect.read((Document(path, path.read_bytes()),))
        for dialect in DIALECTS
        for path in sorted((PROGRAMS / dialect.name).rglob("*"))
        if path.is_file() and path.suffix not in (".txt", ".dump")
    }


@pytest.fixture(scope="module")
def whole() -> dict[Path, Program]:
    return read_all()


@pytest.mark.slow
def test_parts_are_read_as_the_whole(whole: dict[Path, Program], small: None) -> None:
    assert len(whole) > 40
    for path, program in read_all().items():
        one, other = program.toolpath, whole[path].toolpath
        for name in COLUMNS.split():
            # Increments are summed from the begin of a part.
            column = attrgetter(name)
            np.testing.assert_allclose(
                column(one), column(other), rtol=1e-12, atol=1e-13, err_msg=f"{path} {name}"
            )
        for name in ("refused", "locked", "no_insert_before"):
            assert dict(getattr(one.constraints, name)) == dict(getattr(other.constraints, name)), path
        for name in ("annotations", "comments", "frames"):
            assert str(getattr(one, name)) == str(getattr(other, name)), path
        assert program.findings == whole[path].findings
        assert (program.marker, program.marker_at) == (whole[path].marker, whole[path].marker_at)


TEXT = """\
%
(part) G21 G90 G17 G54
T1 M6
G0 X0 Y0 Z5
G1 Z-1 F100
X10 (along)
G2 X20 Y10 I10
G91 G1 X1 Y1

G1 Y-2.5
G3 X5 Y5 R5
X1
G90 G1 X40 Y10
X30
G3 I-5 J0
G2 X30 Y10 I5 J2
G1 Y12
G1 X31
G53 G0 Z1
G0 Z2
G1 X#1 Z1
Y8
X30 Y9
G92 X0
G1 X1 Y2
Y3
G92.1
G55 G0 X1 Y1 Z1
G1 X3
Y4 Z2
G20 G1 X1.
X1.25 Y1.5
M30
"""


@pytest.mark.sample(2)
@pytest.mark.parametrize("seed", range(12))
def test_parts_are_written_as_the_whole(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Words that are left out, increments, arcs, links and points between, across the cuts."""
    dialect = next(one for one in DIALECTS if one.name == "linuxcnc")
    program = read(dialect, TEXT)
    plan = random_plan(program, seed)
    written = apply(program.documents[0], dialect.edit_targets(program, plan, WRITING).edits)
    for rows in (1, 2, 5):
        monkeypatch.setattr(writer, "ROWS", rows)
        assert apply(program.documents[0], dialect.edit_targets(program, plan, WRITING).edits) == written


def test_a_circle_closes_where_the_part_before_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    dialect = next(one for one in DIALECTS if one.name == "linuxcnc")
    program = read(
        dialect, "G21 G90 G17 G54 T1\nG0 X0 Y0 Z5\nG1 X10.00000 Y0 F50\nG3 X10. Y0.0 I-10 J0\nM2\n"
    )
    plan = Plan.of(program.toolpath)
    shift = np.array([1.2345e-4, 4e-7, 0])
    position, centre = plan.position + shift * [[0], [1], [1]], plan.centre + shift * [0, 1, 0]
    plan = replace(plan, position=position, centre=centre)
    for rows in (1, 2, 9):
        monkeypatch.setattr(writer, "ROWS", rows)
        written = apply(program.documents[0], dialect.edit_targets(program, plan, WRITING).edits)
        assert b"G1 X10.12345 Y0 F50\nG3 X10.12345 " in written


def test_words_of_a_part_are_those_of_the_whole(whole: dict[Path, Program]) -> None:
    for program in whole.values():
        places, raw = program.text, program.documents[0].raw
        n = len(program.toolpath)
        every = places.part(0, n)
        for begin in range(0, n, 3):
            part = places.part(begin, min(begin + 3, n))
            for row in range(len(part)):
                for k in range(len(part.columns)):
                    texts = [
                        raw[p.text.words.at[p.word[r, k]] : p.text.words.stop[p.word[r, k]]]
                        if p.word[r, k] >= 0
                        else None
                        for p, r in ((part, row), (every, begin + row))
                    ]
                    assert texts[0] == texts[1]
                assert part.insert[row] == every.insert[begin + row]
                assert (part.verb[row] < 0) == (every.verb[begin + row] < 0)


def bytes_of(thing: object) -> int:
    """Bytes of the arrays of an object and its parts that have more than one row of values."""
    values = vars(thing).values()
    arrays = [value for value in values if isinstance(value, np.ndarray)]
    parts = sum(bytes_of(value) for value in values if isinstance(value, MotionColumns))
    return parts + sum(array.nbytes for array in arrays if array.strides[:1] != (0,))


def long(arcs: bool) -> bytes:
    head = ["G21 G90 G17 G54", "T1 M6", "G0 X0 Y0 Z5"]
    body = [f"G1 X{i % 300}.125 Y{i % 70}.250 Z-1.000 F3000" for i in range(20000)]
    if arcs:
        body[4::5] = ["G3 X1.000 Y2.000 R300.000"] * len(body[4::5])
    return "\n".join([*head, *body, "M30", ""]).encode()


@pytest.mark.parametrize("arcs", [False, True])
def test_a_motion_takes_few_bytes(arcs: bool) -> None:
    """Position, feed, line, kind; the begin and the line's place for the writer; centre, normal and sweep with arcs."""
    program = read(next(one for one in DIALECTS if one.name == "linuxcnc"), long(arcs))
    path: Toolpath = program.toolpath
    n = len(path)
    # The orientation is one, which a toolpath may hold once or in every row.
    rotation = path.rotation.nbytes if path.rotation.strides[0] else 0
    assert bytes_of(path) - rotation <= (24 + 8 + 4 + 1 + 56 * arcs + 2) * n
    assert bytes_of(program.text) <= (24 + 8 + 2) * n
    for name in (
        "partial_targets.inherits_from_row",
        "orientation_control.redundant_axis",
        "inverse_time_feed",
        "constraints.orientation_programmed",
        "approximation",
    ):
        column = attrgetter(name)(path)
        assert not any(column.strides), name
        assert not column.flags.writeable


def test_a_column_of_words_is_what_stands_there() -> None:
    found = scan(b"G1 X1 Y2.5\n\nY-3 X7\nX8 (X9)\nM30\n", LINUXCNC)
    x = found.columns[ord("X")]
    assert (x.block.tolist(), x.value.tolist()) == ([0, 1, 2], [1, 7, 8])
    assert found.blocks.line.tolist() == [1, 3, 4, 5]
    assert x.part(1, 3).block.tolist() == [0, 1]
    assert x.last(np.array([0, 2, 3])).tolist()[:2] == [1, 8]
    assert np.isnan(x.last(np.array([3]))).all()


def test_what_is_in_force_is_the_last_that_was_said() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        n = int(rng.integers(1, 12))
        at = np.sort(rng.integers(0, n, rng.integers(0, 8)))
        value = rng.integers(0, 3, len(at))
        expected, k = [], 0
        state = 7
        for row in range(n):
            while k < len(at) and at[k] == row:
                state, k = int(value[k]), k + 1
            expected.append(state)
        assert fill_modal(n, at, value, 7, np.int8).tolist() == expected


def test_columns_are_filled_part_by_part() -> None:
    rng = np.random.default_rng(5)
    for changes in (0, 1, 4):
        parts: list[Floats] = [everywhere(np.full(3, np.nan), 4) for _ in range(5)]
        for k in rng.integers(0, 5, changes).tolist():
            parts[k] = rng.normal(size=(4, 3))
        rows = FilledRows(20)
        for part in parts:
            rows.put(4, column=part, none=part[:, 0] * np.nan)
        np.testing.assert_array_equal(rows.take_column("column"), np.concatenate(parts))
        assert not any(rows.take_column("none").strides)
    empty = FilledRows(0)
    empty.put(0, column=np.empty((0, 3)))
    assert empty.take_column("column").shape == (0, 3)
