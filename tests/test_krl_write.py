"""What the writer makes of moved targets: only what must change, and it reads back as it was meant."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest
from fuzz.examine import examined
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.base.arrays import Floats
from postproc.base.document import Document, Edit, Span, apply, undone
from postproc.base.geometry import rotation_from_abc, rotation_from_vector, vector_from_rotation
from postproc.base.units import DEG, MM
from postproc.languages.dialect import Plan, Program, WritingSettings
from postproc.languages.krl import KrlDialect

KRL = KrlDialect()
CASES = Path(__file__).parent / "programs" / "krl"
WRITING = WritingSettings(mm=3, deg=3)
FRAMES = "DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n"
HALF_STEP_MM = 0.00050001


def read(text: str | bytes, data: str = "") -> Program:
    raw = text if isinstance(text, bytes) else text.encode("latin-1")
    docs = [Document(Path("part.src"), raw)]
    if data:
        docs.append(Document(Path("part.dat"), f"DEFDAT part\n{data}ENDDAT\n".encode()))
    return KRL.read(tuple(docs))


def written(program: Program, edits: list[Edit]) -> tuple[Document, ...]:
    """The documents with the edits in them; every byte outside of the edits is checked."""
    result = []
    for file, document in enumerate(program.documents):
        own = [edit for edit in edits if edit.span.file == file]
        raw = apply(document, own)
        assert undone(raw, document.raw, own)
        result.append(dataclasses.replace(document, raw=raw))
    return tuple(result)


def edits(program: Program, position: Floats, rotation: Floats) -> list[Edit]:
    plan = dataclasses.replace(Plan.of(program.toolpath), position=position, rotation=rotation)
    found = KRL.edit_targets(program, plan, WRITING)
    assert not found.unwritten
    return list(found.edits)


def moved(program: Program, position: Floats, rotation: Floats) -> tuple[Document, ...]:
    return written(program, edits(program, position, rotation))


def line_moved(line: str, by_mm: tuple[float, float, float] = (0, 0, 0), turn_deg: float = 0.0) -> str:
    """One motion line after its target was shifted, and turned about the base's Z."""
    program = read(FRAMES + line + "\nEND\n")
    assert not program.toolpath.constraints.refused
    turn = rotation_from_vector(np.array([0, 0, turn_deg * DEG]))
    documents = moved(
        program, program.toolpath.position + np.array(by_mm) * MM, turn @ program.toolpath.rotation
    )
    return documents[0].line(4).decode("latin-1")


def assert_reached(documents: tuple[Document, ...], position: Floats, rotation: Floats) -> None:
    """Read again, every row is where it was meant within half a written step."""
    again = KRL.read(documents).toolpath
    known = np.isfinite(position[:, 0])
    np.testing.assert_array_equal(np.isfinite(again.position[:, 0]), known)
    assert np.all(np.abs(again.position[known] - position[known]) <= HALF_STEP_MM * MM)
    turned = vector_from_rotation(np.swapaxes(again.rotation[known], -1, -2) @ rotation[known])
    # Half a step in each of A, B and C, which add up at most.
    assert np.all(np.linalg.norm(turned, axis=-1) <= 3 * 0.00050001 * DEG)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("path", sorted(CASES.glob("*.src")), ids=lambda path: path.stem)
def test_the_same_targets_give_no_edit(path: Path, newline: str) -> None:
    docs = tuple(
        Document(p, p.read_bytes().replace(b"\n", newline.encode())) for p in (path, *KRL.companions(path))
    )
    program = KRL.read(docs)
    assert edits(program, program.toolpath.position, program.toolpath.rotation) == []


@pytest.mark.parametrize("path", sorted(CASES.glob("*.src")), ids=lambda path: path.stem)
def test_every_literal_replaced_by_itself_is_the_same_file(path: Path) -> None:
    program = KRL.read(tuple(Document(p, p.read_bytes()) for p in (path, *KRL.companions(path))))
    places = program.text
    spans = {
        Span(int(places.file[row, i]), int(places.start[row, i]), int(places.stop[row, i]))
        for row in range(len(program.toolpath))
        for i in range(6)
        if places.start[row, i] >= 0
    }
    assert spans
    edits = [Edit(s, program.documents[s.file].raw[s.start : s.stop]) for s in spans]
    for before, after in zip(program.documents, written(program, edits), strict=True):
        assert before.raw == after.raw


NUMBERS = st.floats(-3000, 3000).map(lambda v: round(v, 3))
ANGLES = st.floats(-180, 180).map(lambda v: round(v, 3))
LITERALS = ["{:.3f}", "{:.5f}", "{:.0f}", "{:+.1f}", "{:.4e}", "{:.0f}."]


@st.composite
def programs(draw: st.DrawFn) -> str:
    """A straight run: a full point, then full and partial ones, with keys in any order and literals of any form."""
    lines = []
    for i in range(draw(st.integers(1, 7))):
        keys = draw(st.permutations("XYZABC"))
        if i:
            keys = keys[: draw(st.integers(0, 6))]
        form = draw(st.sampled_from(LITERALS))
        parts = [f"{k} {form.format(draw(NUMBERS if k in 'XYZ' else ANGLES))}" for k in keys]
        if not parts or draw(st.booleans()):
            parts.insert(draw(st.integers(0, len(parts))), "E1 0.0")
        lines.append(draw(st.sampled_from(["LIN", "PTP"])) + " {" + ",".join(parts) + "} C_DIS")
    return FRAMES + draw(st.sampled_from(["\n", "\r\n"])).join([*lines, "END"])


@settings(deadline=None, max_examples=examples(250))
@given(programs(), st.data())
def test_moved_rows_reach_their_target_and_the_others_stay(text: str, data: st.DataObject) -> None:
    program = read(text)
    path = program.toolpath
    assert not path.constraints.refused
    n = len(path)
    moves = np.array(data.draw(st.lists(st.booleans(), min_size=n, max_size=n)), dtype=bool)
    steps = st.lists(st.floats(-0.9, 0.9), min_size=6, max_size=6)
    change = np.array(data.draw(st.lists(steps, min_size=n, max_size=n))) * moves[:, None]
    position = path.position + change[:, :3] * MM
    rotation = np.where(
        moves[:, None, None], rotation_from_vector(change[:, 3:] * DEG) @ path.rotation, path.rotation
    )
    documents = moved(program, position, rotation)
    assert_reached(documents, position, rotation)
    if not moves.any():
        assert documents[0].raw == program.documents[0].raw


@settings(deadline=None, max_examples=examples(60))
@given(st.sampled_from(sorted(CASES.glob("*.src"))), st.integers(0, 2**32 - 1))
def test_cases_moved_at_random_reach_their_targets(path: Path, seed: int) -> None:
    move_at_random(path, seed)


@pytest.mark.skipif("POSTPROC_PROGRAMS" not in os.environ, reason="POSTPROC_PROGRAMS names no folder")
def test_programs_of_a_folder_moved_at_random_reach_their_targets() -> None:
    for path in Path(os.environ["POSTPROC_PROGRAMS"]).rglob("*"):
        if path.suffix.lower() == ".src":
            move_at_random(path, 1)


def move_at_random(path: Path, seed: int) -> None:
    documents = tuple(Document(p, p.read_bytes()) for p in (path, *KRL.companions(path)))
    examined(KRL, documents, np.random.default_rng(seed))


@pytest.mark.parametrize(
    ("line", "result"),
    [
        ("LIN {X 1.000,Y 2.000,Z 3.000,A 4,B 5,C 6}", "LIN {X 1.100,Y 2.000,Z 3.000,A 4,B 5,C 6}"),
        ("LIN {X 1,Y 2,Z 40,A 4,B 5,C 6}", "LIN {X 1.100,Y 2,Z 40,A 4,B 5,C 6}"),
        ("lin{z - 30,x+1.5,y 2,a 4,b 5,c 6}", "lin{z - 30,x 1.600,y 2,a 4,b 5,c 6}"),
        ("LIN {X -0.1,Y 2,Z 3,A 4,B 5,C 6}", "LIN {X 0.000,Y 2,Z 3,A 4,B 5,C 6}"),
        ("LIN {X 1.00000,Y 2,Z 3,A 4,B 5,C 6}", "LIN {X 1.10000,Y 2,Z 3,A 4,B 5,C 6}"),
        ("LIN {X 1.2E-05,Y 2,Z 3,A 4,B 5,C 6}", "LIN {X 0.100012,Y 2,Z 3,A 4,B 5,C 6}"),
        ("LIN {X'B11',Y 2,Z 3,A 4,B 5,C 6}", "LIN {X 3.100,Y 2,Z 3,A 4,B 5,C 6}"),
        ("LIN {X\t1. , Y 2,Z 3,A 4,B 5,C 6}C_DIS ;x", "LIN {X\t1.100 , Y 2,Z 3,A 4,B 5,C 6}C_DIS ;x"),
    ],
)
def test_only_the_literal_that_moved_is_written(line: str, result: str) -> None:
    assert line_moved(line, (0.1, 0, 0)) == result


def test_a_sign_that_leaves_makes_room_for_the_number() -> None:
    assert (
        line_moved("LIN {X-0.1,Y 2,Z- 3,A 4,B 5,C 6}", (1, 0, 5)) == "LIN {X 0.900,Y 2,Z 2.000,A 4,B 5,C 6}"
    )
    assert line_moved("LIN {X-5.1,Y 2,Z 3,A 4,B 5,C 6}", (1, 0, 0)) == "LIN {X-4.100,Y 2,Z 3,A 4,B 5,C 6}"


def test_less_than_half_a_step_is_not_written() -> None:
    line = "LIN {X 1.00,Y 2.0000,Z 3,A 4,B 5,C 6}"
    assert line_moved(line, (0.0004, 0.00004, 0.0004)) == line
    assert line_moved(line, (0, 0.00006, 0)) == line.replace("2.0000", "2.0001")


def test_the_angles_stay_on_their_side() -> None:
    assert "A -179.900,B 5,C 6" in line_moved("LIN {X 1,Y 2,Z 3,A 180,B 5,C 6}", turn_deg=0.1)
    assert "A 4.100,B 170,C 6" in line_moved("LIN {X 1,Y 2,Z 3,A 4,B 170,C 6}", turn_deg=0.1)
    assert "A 14,B 90,C 16" in line_moved("LIN {X 1,Y 2,Z 3,A 14,B 90,C 16}", (5, 0, 0))


def test_another_spelling_of_the_same_rotation_is_no_change() -> None:
    program = read(FRAMES + "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\nEND\n")
    same = rotation_from_abc(np.array([[184, 175, 186]]) * DEG)
    assert edits(program, program.toolpath.position, same) == []


def test_a_touched_partial_point_is_written_whole() -> None:
    text = FRAMES + "LIN {X 1,Y 2,Z 3.25,A 4,B 5,C 6}\nLIN {Y 20,S 2} C_DIS\nptp {e1 5}\nEND\n"
    program = read(text)
    position = program.toolpath.position.copy()
    position[1:, 1] += 0.5 * MM
    documents = moved(program, position, program.toolpath.rotation)
    assert documents[0].line(5) == b"LIN {Y 20.500,X 1,Z 3.25,A 4,B 5,C 6,S 2} C_DIS"
    assert documents[0].line(6) == b"ptp {x 1,y 20.500,z 3.25,a 4,b 5,c 6,e1 5}"


def test_what_inherits_from_a_moved_point_keeps_its_own_place() -> None:
    text = FRAMES + "LIN {X 1.25,Y 2,Z 3,A 4,B 5,C 6}\nLIN {Y 20}\nLIN {Y 21}\nLIN {X 9}\nEND\n"
    program = read(text)
    position = program.toolpath.position.copy()
    position[0] += [0.5 * MM, 0.5 * MM, 0]
    documents = moved(program, position, program.toolpath.rotation)
    assert documents[0].line(4) == b"LIN {X 1.750,Y 2.500,Z 3,A 4,B 5,C 6}"
    assert documents[0].line(5) == b"LIN {Y 20,X 1.25}"
    assert documents[0].raw.endswith(b"LIN {Y 21}\nLIN {X 9}\nEND\n")


def test_points_of_the_dat_are_edited_there() -> None:
    data = "DECL E6POS XP1={X 1.5,Y 2,Z 3,A 4,B 5,C 6,S 2,T 35}\n"
    program = read(FRAMES + "LIN XP1\nLIN {Z 7}\nEND\n", data)
    position = program.toolpath.position.copy()
    position[0, 0] += 0.5 * MM
    source, dat = moved(program, position, program.toolpath.rotation)
    assert b"XP1={X 2.000,Y 2,Z 3,A 4,B 5,C 6,S 2,T 35}" in dat.raw
    assert source.line(5) == b"LIN {Z 7,X 1.5}"
    assert_reached((source, dat), position, program.toolpath.rotation)


@pytest.mark.parametrize("line", ["LIN_REL {X way}", "LIN nowhere", "PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}"])
def test_what_can_not_be_written_is_not_taken(line: str) -> None:
    program = read(FRAMES + "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n" + line + "\nEND\n")
    position = np.where(np.isnan(program.toolpath.position), 0.0, program.toolpath.position)
    with pytest.raises(ValueError, match="cannot be corrected"):
        edits(program, position, program.toolpath.rotation)


def test_a_pinned_point_is_not_moved() -> None:
    program = read(FRAMES + "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\nLIN_REL {X way}\nEND\n")
    with pytest.raises(ValueError, match="cannot be corrected"):
        edits(program, program.toolpath.position + 1e-3, program.toolpath.rotation)


@pytest.mark.parametrize(
    ("raw", "result"),
    [
        (b"&REL 1\r\nDEF a()\r\nEND\r\n", b"&REL 1\r\nDEF a()\r\n;COMPENSATED by compensate x\r\nEND\r\n"),
        (b"&REL 1\nLIN {X 1}\n", b"&REL 1\n;COMPENSATED by compensate x\nLIN {X 1}\n"),
        (b"\xef\xbb\xbfLIN {X 1}", b"\xef\xbb\xbf;COMPENSATED by compensate x\nLIN {X 1}"),
        (b"\xef\xbb\xbfDEF a()\nEND", b"\xef\xbb\xbfDEF a()\n;COMPENSATED by compensate x\nEND"),
        (b"DEF a()", b"DEF a()\n;COMPENSATED by compensate x"),
        (
            b"DEF a()\r\n;COMPENSATED by compensate old  \r\nEND",
            b"DEF a()\r\n;COMPENSATED by compensate x\r\nEND",
        ),
        (b"", b";COMPENSATED by compensate x\n"),
    ],
)
def test_the_marker_is_written_once(raw: bytes, result: bytes) -> None:
    program = read(raw)
    marked = apply(program.documents[0], [KRL.marked(program, "x")])
    assert marked == result
    again = read(marked)
    assert again.marker is not None
    assert apply(again.documents[0], [KRL.marked(again, "x")]) == result


def test_a_program_without_the_marker_has_none() -> None:
    assert read(b'DEF a()\n;COMPENSATE OFF\nmsg=";COMPENSATED by compensate x"\nEND\n').marker is None
    assert read(b"DEF a()\n;COMPENSATED for the wear of the tool\nEND\n").marker is None


def test_renaming_changes_the_module_name_in_both_files() -> None:
    text = b"\xef\xbb\xbf&COMMENT DEF old\n;DEF old()\n def  Old ( )\nEND\nDEF old2()\nEND\n"
    program = KRL.read(
        (Document(Path("old.src"), text), Document(Path("old.dat"), b"defdat OLD public\nENDDAT"))
    )
    source, data = written(program, KRL.renamed(program, "new_name"))
    assert source.raw == text.replace(b"def  Old", b"def  new_name")
    assert data.raw == b"defdat new_name public\nENDDAT"
