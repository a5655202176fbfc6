"""Motions that are inserted into KRL: their approximation, and the way into a spline block.

What was written is looked at as text too, by a few lines of its own: which motion lines end exactly.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from test_krl_write_plans import FORM, POINT, RECORDS, START, divided, read, written

from postproc.languages.dialect import Role, WritingSettings
from postproc.languages.krl import KrlDialect
from postproc.languages.permitted import refuse_other

KRL = KrlDialect()
PIECE = (Role.INTERMEDIATE, (4.25, 2, 3.5))
LINK = (Role.TRANSITION, (1, 2, 4))
END = "{X 7,Y 2,Z 3,A 4,B 5,C 6}"


def exact_stops(lines: list[str]) -> list[bool]:
    """Of each motion line whether it ends exactly; inner points of spline blocks do not."""
    stops, inside = [], False
    for line in lines:
        code = line.partition(";")[0].upper().strip()
        if code.startswith("SPLINE"):
            inside = True
        elif code.startswith("ENDSPLINE"):
            inside = False
            stops[-1] = "C_SPL" not in code
        elif re.match(r"S?(LIN|PTP|CIRC)|SPL\b", code):
            stops.append(not inside and not re.search(r"\bC_(DIS|VEL|ORI|PTP|SPL)\b", code))
    return stops


@pytest.mark.parametrize(
    ("line", "behind"),
    [
        (f"LIN {END}", "C_DIS"),
        (f"LIN {END} C_DIS", "C_DIS"),
        (f"LIN {END} C_VEL ;fast", "C_VEL"),
        (f"lin {END} C_ORI", "C_ORI"),
        ("LIN {Y 2,X 7,Z 3,B 5,C 6,A 4}", "C_DIS"),
        (f"SLIN {END}", "C_SPL"),
        (f"SLIN {END} WITH $VEL.CP=0.1", "WITH $VEL.CP=0.1 C_SPL"),
        (f"SLIN {END} WITH $VEL.CP=0.1 C_SPL", "WITH $VEL.CP=0.1 C_SPL"),
        ("LIN_REL {X 6} #BASE", "C_DIS"),
        ("LIN_REL {X 6} #BASE C_VEL", "C_VEL"),
        ("CIRC {X 5,Y 9,Z 3},{X 7,Y 2,Z 3,A 4,B 5,C 6}", "C_DIS"),
        ("CIRC {X 5,Y 9,Z 3},{X 7,Y 2,Z 3,A 4,B 5,C 6},CA 200", "C_DIS"),
    ],
)
def test_a_piece_flows_like_what_it_divides_and_with_c_dis_where_that_stops(line: str, behind: str) -> None:
    program = read("$APO.CDIS=2\n" + START + line + "\n")
    found = KRL.edit_targets(program, divided(program, 1, PIECE, PIECE), WritingSettings(3, 3))
    added = [edit.text.decode() for edit in found.edits if edit.span.start == edit.span.stop]
    texts = [text for text in "".join(added).splitlines() if "LIN" in text.upper() or "CIRC" in text]
    assert len(texts) == 2
    for text in texts:
        assert text.rpartition("}")[2].strip() == behind
    assert exact_stops(texts) == [False, False]


def test_a_piece_of_an_exact_motion_adds_no_stop() -> None:
    program = read("$APO.CDIS=2\n" + START + f"LIN {END}\nLIN {END} C_DIS\n")
    wanted = divided(program, 1, PIECE, PIECE)
    lines, _ = written(program, wanted)
    assert exact_stops(lines) == [True, False, False, True, False]
    back = read("\n".join(lines) + "\n").toolpath
    assert back.stops.tolist() == exact_stops(lines)
    assert program.toolpath.stops.tolist() == [True, True, False]


def test_a_link_stops_in_the_air_and_flows_where_it_is_asked_to() -> None:
    for line, behind in ((f"LIN {END}", " C_DIS"), (f"LIN {END} C_VEL", " C_VEL"), (f"SLIN {END}", " C_SPL")):
        program = read("$APO.CDIS=2\n" + START + line + "\n")
        wanted = divided(program, 1, LINK)
        assert written(program, wanted)[0][2].endswith("}")
        flowing = replace(wanted, flows=wanted.role == Role.TRANSITION)
        assert written(program, flowing)[0][2].endswith("}" + behind)


@pytest.mark.parametrize("slur", ["", " C_DIS"])
def test_in_the_fold_of_an_inline_form_a_piece_takes_its_parameters_and_flows(slur: str) -> None:
    form = FORM.replace(" C_DIS", slur)
    program = read(START + form, POINT + RECORDS)
    lines, _ = written(program, divided(program, 1, PIECE))
    at = lines.index("LIN XP1" + slur)
    assert re.fullmatch(r"LIN \{.*\} C_DIS", lines[at - 1])
    back = read("\n".join(lines) + "\n", POINT + RECORDS).toolpath
    assert back.approximation[1] == 2.0e-3
    assert back.feed[1] == back.feed[2] == 0.1


BLOCK = """  SPLINE
    SPL {X 5,Y 2,Z 3,A 4,B 5,C 6}
    SLIN {X 9,Y 2,Z 3,A 4,B 5,C 6}
  ENDSPLINE ;done
"""


def test_points_of_a_spline_block_are_passed_and_its_last_one_is_not() -> None:
    for end, stops in (("ENDSPLINE", True), ("ENDSPLINE C_SPL", False)):
        path = read(START + BLOCK.replace("ENDSPLINE", end)).toolpath
        assert path.stops.tolist() == [True, False, stops]
    assert read(START + "SPLINE\nENDSPLINE\n").toolpath.stops.tolist() == [True]


def test_a_block_is_entered_by_a_line_before_its_header() -> None:
    program = read("$VEL.CP=0.1\n" + START + BLOCK)
    assert program.toolpath.constraints.spline_headers == {1: 3 + 3}
    lines, _ = written(program, divided(program, 1, LINK))
    assert lines[1:5] == [
        START.strip(),
        "  LIN {X 1.000,Y 2,Z 4.000,A 4,B 5,C 6}",
        *BLOCK.splitlines()[:2],
    ]


@pytest.mark.parametrize(
    ("header", "first", "link"),
    [
        ("SPLINE WITH $VEL.CP=0.2", "", "SLIN {} WITH $VEL.CP=0.2"),
        ("SPLINE WITH $VEL.CP=0.2", " WITH $VEL.CP=0.05", "SLIN {} WITH $VEL.CP=0.05"),
        ("SPLINE", " WITH $VEL.CP = 0.05", "SLIN {} WITH $VEL.CP = 0.05"),
        (
            "SPLINE WITH $BASE={X 1,Y 0,Z 0,A 0,B 0,C 0}, $TOOL=TOOL_DATA[3] ;cut",
            " WITH $VEL.CP=0.05",
            "SLIN {} WITH $BASE={X 1,Y 0,Z 0,A 0,B 0,C 0}, $TOOL=TOOL_DATA[3], $VEL.CP=0.05",
        ),
    ],
)
def test_a_block_with_conditions_is_entered_with_them(header: str, first: str, link: str) -> None:
    block = f"{header}\nSPL {END}{first}\nSPL {{X 9,Y 2,Z 3,A 4,B 5,C 6}}\nENDSPLINE\n"
    program = read("$VEL.CP=0.1\n" + START + block)
    lines, _ = written(program, divided(program, 1, LINK))
    at = lines.index(header)
    assert re.sub(r"\{X 1\.000.*?\}", "{}", lines[at - 1]) == link
    path, back = program.toolpath, read("\n".join(lines) + "\n").toolpath
    source = np.array([0, 1, 1, 2])
    for name in ("feed", "base", "tool"):
        np.testing.assert_array_equal(getattr(back, name), getattr(path, name)[source])
    assert len(back.frames) == len(path.frames)


@pytest.mark.parametrize(
    "text",
    [
        START + "TRIGGER WHEN PATH=0 DELAY=0 DO $OUT[1]=TRUE\n" + BLOCK,
        START + "PTP_SPLINE\nSPTP {X 5,Y 2,Z 3,A 4,B 5,C 6}\nENDSPLINE\n",
        "INT I\n" + START + "FOR I=1 TO 2\n" + BLOCK + "ENDFOR\n",
    ],
)
def test_where_a_block_is_not_entered(text: str) -> None:
    program = read(text)
    assert not program.toolpath.constraints.spline_headers
    assert 1 in program.toolpath.constraints.no_insert_before
    with pytest.raises(ValueError, match="divided"):
        KRL.edit_targets(program, divided(program, 1, LINK), WritingSettings(3, 3))


def test_a_trigger_inside_of_a_block_does_not_close_it() -> None:
    inner = BLOCK.replace("    SPL", "    TRIGGER WHEN PATH=0 DELAY=0 DO $OUT[1]=TRUE\n    SPL", 1)
    assert read(START + inner).toolpath.constraints.spline_headers == {1: 5}


@pytest.mark.parametrize("parts", [(PIECE,), (LINK, PIECE), (LINK, LINK)])
def test_a_block_is_entered_by_one_link_and_never_divided(parts: tuple) -> None:
    program = read(START + BLOCK)
    with pytest.raises(ValueError, match="divided"):
        KRL.edit_targets(program, divided(program, 1, *parts), WritingSettings(3, 3))
    with pytest.raises(ValueError, match="divided"):
        KRL.edit_targets(program, divided(program, 2, LINK), WritingSettings(3, 3))


def test_the_edits_before_a_header_are_permitted() -> None:
    program = read(START + BLOCK)
    found = KRL.edit_targets(program, divided(program, 1, LINK), WritingSettings(3, 3))
    refuse_other(program, found.edits, KRL.letters)


def test_a_partial_first_point_is_completed_behind_the_line_that_enters() -> None:
    program = read(START + BLOCK.replace("X 5,Y 2,Z 3,A 4,B 5,C 6", "X 5"))
    lines, _ = written(program, divided(program, 1, LINK))
    assert "SPL {X 5,Y 2,Z 3,A 4,B 5,C 6}" in lines[3]
