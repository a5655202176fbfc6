"""Every part inside is broken once: a run then refuses, or says so, and writes no wrong program as if it were right.

A break stands for a defect that nobody knows of yet: what is checked on every output at run time has to see it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from conftest import CELL
from conftest import JUMPED_LINES as LINES

import postproc.compensation.problem as task_module
import postproc.output.write as writing_module
import postproc.workflows.program as program_module
from postproc.base.document import Edit, Span
from postproc.base.geometry import PoseRows, Poses, rotation_from_vector
from postproc.compensation.subdivision import Subdivision
from postproc.languages import DIALECTS

FRAMES = CELL.replace(
    "bases:",
    "  2: {x: 130, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}\n"
    "bases:\n  2: {x: 1510, y: -200, z: 600, a: 0, b: 0, c: 0}",
)
"""A second tool and a second base, so that a wrong number of one is no error by itself."""

STATED = [*LINES]
STATED[6] = STATED[6].replace("}", ",S 2,T 2}")
STATED[10] = STATED[10].replace("}", ",S 2,T 2}")

BLOCKS = [
    "%", "(PART)", "G21 G90 G17 G94", "G54", "T1 M6", "G64 P0.01", "G0 X0 Y0 Z50", "M8", "G0 Z0", "F3000",
    "(FORCE -360 50 560 @base)", "G1 X100 Y0 Z-2", "X200", "G3 X250 Y50 I0 J50", "G1 Y150", "(FORCE OFF)",
    "G0 Z50", "G0 X0", "M9", "M30", "%",
]  # fmt: skip


# edits


def more_edits(monkeypatch, change: Callable[[list[Edit], bytes], list[Edit]]) -> None:
    """What a dialect makes of a plan, changed."""
    for dialect in {type(one) for one in DIALECTS.values()}:
        real = dialect.edit_targets

        def moved(self, program, plan, writing, real=real):
            made = real(self, program, plan, writing)
            if made.unwritten:
                return made
            return replace(made, edits=change(list(made.edits), program.documents[0].raw))

        monkeypatch.setattr(dialect, "edit_targets", moved)


def instead(raw: bytes, text: bytes, new: bytes) -> Edit:
    at = raw.index(text)
    return Edit(Span(0, at, at + len(text)), new)


def number(edits: list[Edit]) -> int:
    """The place of an edit of a number of a cut."""
    return next(
        k for k, e in enumerate(edits) if e.span.stop > e.span.start and e.text.strip(b"-.0123456789") == b""
    )


def another_digit(edits: list[Edit]) -> list[Edit]:
    k = number(edits)
    text = edits[k].text
    return [
        *edits[:k],
        replace(edits[k], text=text[:-1] + bytes([48 + (text[-1] - 47) % 10])),
        *edits[k + 1 :],
    ]


def a_byte_too_many(edits: list[Edit]) -> list[Edit]:
    k = number(edits)
    span = edits[k].span
    return [*edits[:k], replace(edits[k], span=replace(span, start=span.start - 1)), *edits[k + 1 :]]


def of_an_edit(text: bytes, new: bytes):
    return lambda edits, raw: [*edits, instead(raw, text, new)]


def inserted(before: bytes, line: bytes):
    return lambda edits, raw: [*edits, Edit(Span(0, raw.index(before), raw.index(before)), line + b"\r\n")]


def without(k: int):
    return lambda edits, raw: edits[:k] + edits[k + 1 :]


def no_links(edits: list[Edit], raw: bytes) -> list[Edit]:
    return [edit for edit in edits if edit.span.stop > edit.span.start]


REFUSED_EDITS = {
    "a digit": lambda edits, raw: another_digit(edits),
    "an edit is lost": lambda edits, raw: without(number(edits))(edits, raw),
    "insertions are lost": no_links,
    "a motion twice": inserted(b"LIN {Y 300", b"LIN {Y 300.000}"),
    "a motion of no length": inserted(b"LIN {X 400", b"LIN_REL {X 0.0}"),
    "a jump": inserted(b"LIN {X 400", b"PTP {A1 20}"),
    "a motion is gone": of_an_edit(b"LIN {X 400.000}", b""),
    "motions change places": lambda edits, raw: [
        *edits,
        instead(raw, b"LIN {X 400.000}", b"LIN {Z 0.000}"),
        instead(raw, b"LIN {Z 0.000}\r\n;FORCE 0", b"LIN {X 400.000}\r\n;FORCE 0"),
    ],
    "the base": of_an_edit(b"BASE_DATA[1]", b"BASE_DATA[2]"),
    "the tool": of_an_edit(b"TOOL_DATA[1]", b"TOOL_DATA[2]"),
    "the feed": of_an_edit(b"CP=0.05", b"CP=2.00"),
    "an axis": of_an_edit(b"A1 0,", b"A1 9,"),
    "air": of_an_edit(b"LIN {X 400.000", b"LIN {X 405.000"),
    "air by a hair": of_an_edit(b"LIN {X 400.000", b"LIN {X 400.001"),
    "S": of_an_edit(b"S 2,", b"S 6,"),
    "T": of_an_edit(b"T 2}", b"T 3}"),
    "a kind": of_an_edit(b"LIN {X 400.000}", b"PTP {X 400.000}"),
    "rubbish": of_an_edit(b"LIN {X 400.000}", b"LIN {X 400.000"),
    "a byte too many": lambda edits, raw: a_byte_too_many(edits),
}  # fmt: skip

BESIDE = {
    "a comment is eaten": of_an_edit(b" ; slot", b""),
    "C_DIS is eaten": of_an_edit(b"C_DIS ; slot", b"; slot"),
    "a call is eaten": of_an_edit(b"BAS(#INITMOV,0)", b""),
    "a force": of_an_edit(b";FORCE 0 200 0", b";FORCE 0 300 0"),
    "an output": inserted(b"LIN {X 400", b"$OUT[1]=TRUE"),
    "a halt": inserted(b"LIN {X 400", b"HALT"),
    "a comment more": inserted(b"LIN {X 400", b";x"),
}
"""Edits of what is no motion."""

IN_BLOCKS = {
    "a digit": lambda edits, raw: another_digit(edits),
    "an edit is lost": lambda edits, raw: without(number(edits))(edits, raw),
    "insertions are lost": no_links,
    "the offset": of_an_edit(b"G54", b"G55"),
    "the tool": of_an_edit(b"T1", b"T2"),
    "the feed": of_an_edit(b"F3000", b"F9000"),
    "a rapid": of_an_edit(b"G0 X0\r", b"G1 X0\r"),
    "the sense of an arc": of_an_edit(b"G3 ", b"G2 "),
    "inches": of_an_edit(b"G21", b"G20"),
    "increments": of_an_edit(b"G90", b"G91"),
    "a block is gone": of_an_edit(b"G0 X0\r\n", b""),
}
BESIDE_BLOCKS = {
    "coolant": of_an_edit(b"M8", b"M9"),
    "the smoothing": of_an_edit(b"G64 P0.01", b"G61"),
    "a comment": of_an_edit(b"(PART)", b"(WART)"),
    "a force": of_an_edit(b"(FORCE OFF)", b"(FORCE 1 2 3)"),
}


# what is meant


def corrections(change: Callable[[Poses, Poses], None]):
    """``change(command, wanted)`` alters the poses that the mirror has found."""

    def breaks(monkeypatch) -> None:
        real = task_module.mirror

        def mirror(model, wanted, *rest, **more):
            done = real(model, wanted, *rest, **more)
            command = Poses(done.command.rotation.copy(), done.command.position.copy())
            if len(command):
                change(command, wanted)
            return replace(done, command=command)

        monkeypatch.setattr(task_module, "mirror", mirror)

    return breaks


def divisions(change: Callable[[Subdivision, np.ndarray, Poses], None]):
    """``change(division, moved, command)`` alters which motions of the output move, and where."""

    def breaks(monkeypatch) -> None:
        real = program_module.fit_corners  # the last that decides where the output goes

        def divide(task, *rest):
            result, made = real(task, *rest)
            moved, there = made.moved.copy(), made.command[np.arange(len(made))]
            command = Poses(there.rotation.copy(), there.position.copy())
            change(made, moved, command)
            return result, replace(made, moved=moved, command=PoseRows(len(made), lambda rows: command[rows]))

        monkeypatch.setattr(program_module, "fit_corners", divide)

    return breaks


def own(division: Subdivision, row: int) -> int:
    """The motion of the output that takes the text of a row."""
    return int(np.flatnonzero(division.original & (division.source == row))[0])


CUT, AIR = 4, 8
"""Rows of a cut and of air in ``LINES``."""


def off(command: Poses, wanted: Poses) -> np.ndarray:
    """(K, 3) [m]"""
    return command.position - wanted.position


def spun(command: Poses, at: object, angle: float) -> None:
    command.rotation[at] = rotation_from_vector(np.array([angle, 0.0, 0.0])) @ command.rotation[at]


def mirrored(command: Poses, wanted: Poses, change: Callable[[np.ndarray], np.ndarray]) -> None:
    command.position[:] = wanted.position + change(off(command, wanted))


def shifted(command: Poses, at: object, mm: float) -> None:
    command.position[at] += [0.0, 0.0, 1e-3 * mm]


def let_stay(division: Subdivision, moved: np.ndarray, _command: Poses) -> None:
    moved[own(division, CUT)] = False


def air(change: Callable[[Poses, int], None]):
    def breaks(division: Subdivision, moved: np.ndarray, command: Poses) -> None:
        at = own(division, AIR)
        moved[at] = True
        change(command, at)

    return divisions(breaks)


def link(mm: float):
    return divisions(lambda d, m, c: shifted(c, np.flatnonzero(d.transitions)[-1:], mm))


def end(mm: float):
    return divisions(lambda d, m, c: shifted(c, own(d, CUT), mm))


def exchanged(division: Subdivision, _moved: np.ndarray, command: Poses) -> None:
    one, two = own(division, CUT), own(division, CUT + 1)
    command.position[[one, two]] = command.position[[two, one]]


MEANT = {
    "not a number": corrections(lambda c, w: c.position.__setitem__((0, 0), np.nan)),
    "infinite": corrections(lambda c, w: c.position.__setitem__((0, 0), np.inf)),
    "no rotation": corrections(lambda c, w: c.rotation.__setitem__(0, np.nan)),
    "the wrong side": corrections(lambda c, w: mirrored(c, w, lambda shift: -shift)),
    "twice": corrections(lambda c, w: mirrored(c, w, lambda shift: 2 * shift)),
    "none": corrections(lambda c, w: mirrored(c, w, lambda shift: 0 * shift)),
    "metres of millimetres": corrections(lambda c, w: mirrored(c, w, lambda shift: 1e3 * shift)),
    "millimetres of metres": corrections(lambda c, w: mirrored(c, w, lambda shift: 1e-3 * shift)),
    "another axis": corrections(lambda c, w: mirrored(c, w, lambda shift: shift[:, ::-1])),
    "11 mm at a place": corrections(lambda c, w: shifted(c, -1, 11)),
    "0.1 mm at a place": corrections(lambda c, w: shifted(c, -1, 0.1)),
    "a turn of a degree": corrections(lambda c, w: spun(c, slice(None), 0.02)),
    "a corrected motion stays": divisions(let_stay),
    "air moves by 5 mm": air(lambda command, at: shifted(command, at, 5)),
    "air is turned": air(lambda command, at: spun(command, at, 0.1)),
    "a link is 11 mm beside": link(11),
    "a link is 1 mm beside": link(1),
    "an end is 11 mm beside": end(11),
    "an end is 0.1 mm beside": end(0.1),
    "ends change places": divisions(exchanged),
}


def elsewhere(monkeypatch) -> None:
    real = writing_module.apply
    monkeypatch.setattr(
        writing_module, "apply", lambda document, edits: real(document, edits).replace(b"BAS(", b"BAT(")
    )


# the runs


@pytest.fixture
def shop(compensate, job):
    """Runs a program of the cell and tells what came of it."""
    job.cell(FRAMES + "orientation: {a: 0, b: 0, c: 180}\n")

    def run(lines: list[str], *words: str, name: str = "part.src"):
        program = job.write(lines, name=name)
        return compensate(program, "--force", *words), job.output.parent / name

    return run


def refused(done, output) -> None:
    assert done.code == 1, done.out
    assert "nothing is written" in done.err
    assert "Traceback" not in done.err
    assert not output.parent.exists()


def test_as_they_are_nothing_is_told(shop):
    done, output = shop(STATED)
    assert (done.code, output.exists()) == (3, True)
    assert "KIN007" in done.out  # S and T of the example are made up
    assert "COR005" not in done.out + done.err
    assert shop(LINES)[0].code == 0
    assert shop(BLOCKS, name="part.ngc")[0].code in (0, 3)


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", REFUSED_EDITS)
def test_edits_that_change_a_motion_are_refused(shop, monkeypatch, name):
    more_edits(monkeypatch, REFUSED_EDITS[name])
    refused(*shop(STATED))


@pytest.mark.parametrize("name", BESIDE)
def test_edits_beside_the_motions_are_refused(shop, monkeypatch, name):
    more_edits(monkeypatch, BESIDE[name])
    refused(*shop(STATED))


@pytest.mark.sample(5)
@pytest.mark.parametrize("name", IN_BLOCKS)
def test_edits_that_change_a_block_are_refused(shop, monkeypatch, name):
    more_edits(monkeypatch, IN_BLOCKS[name])
    refused(*shop(BLOCKS, name="part.ngc"))


@pytest.mark.parametrize("name", BESIDE_BLOCKS)
def test_edits_beside_the_blocks_are_refused(shop, monkeypatch, name):
    more_edits(monkeypatch, BESIDE_BLOCKS[name])
    refused(*shop(BLOCKS, name="part.ngc"))


def test_bytes_that_no_edit_covers_are_refused(shop, monkeypatch):
    elsewhere(monkeypatch)
    refused(*shop(LINES))


@pytest.mark.sample(3)
@pytest.mark.parametrize("gain", ["1", "0.5"])
@pytest.mark.parametrize("name", MEANT)
def test_corrections_that_are_wrong_are_refused_or_told(shop, monkeypatch, name, gain):
    MEANT[name](monkeypatch)
    done, output = shop(LINES, "--gain", gain)
    assert done.code in (1, 3), done.out
    assert "Traceback" not in done.err
    assert output.exists() == (done.code == 3)
    if done.code == 3:
        said = done.out + done.err
        assert any(code in said for code in ("COR001", "COR003", "COR005", "COR006", "COR009")), said


def test_a_cut_that_starts_elsewhere_from_run_to_run_is_reported(compensate, job):
    """Behind a branch only the end point is corrected for certain; what follows is corrected as ever."""
    branch = [
        "IF $IN[1] THEN",
        "LIN {Z 40.000}",
        "ELSE",
        "LIN {Z 60.000}",
        "ENDIF",
        ";FORCE -360 50 560 @base",
    ]
    lines = [*LINES[:8], *branch, *LINES[9:]]
    job.write(lines)
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code == 3
    found = [one for one in done.json["findings"] if one["code"] == "COR023"]
    assert [one["line"] for one in found] == [15]
    assert "after line 10 or 12" in found[0]["message"]
    job.write([*lines[:13], "LIN {X 50.000,Y 0.000,Z 20.000,A 0.000,B 0.000,C 180.000}", *lines[13:]])
    again = compensate(job.program, "--force", "--json", "-")
    assert "COR023" not in {one["code"] for one in again.json["findings"]}


def test_a_feed_force_behind_a_branch_in_the_cut_is_reported(compensate, job):
    """Where the tool comes from varies, and with it the direction of the force."""
    branch = [";FORCE -360 50 560 @feed", "IF $IN[1] THEN", "LIN {Y 20.000}", "ENDIF"]
    job.write([*LINES[:8], *branch, *LINES[9:]])
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code == 3, done.err
    assert any("FRC005" in one["code"] + one["message"] for one in done.json["findings"])
