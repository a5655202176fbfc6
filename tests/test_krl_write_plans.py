"""What a plan makes of points, lines and arcs: own points, relative motions, auxiliary points, inserted motions."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from fuzz.examine import examined
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.base.document import Document, apply, undone
from postproc.base.geometry import rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.languages.dialect import EditedTargets, Plan, Program, ReadingSettings, Role, WritingSettings
from postproc.languages.krl import KrlDialect
from postproc.languages.krl.dependent_targets import BLOCK

KRL = KrlDialect()
HEAD = "DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n"
START = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"


def read(text: str, data: str = "", newline: str = "\n") -> Program:
    texts = [HEAD + text + "END\n"] + ([f"DEFDAT part\n{data}ENDDAT\n"] if data else [])
    names = ("part.src", "part.dat")
    return KRL.read(
        tuple(
            Document(Path(n), t.replace("\n", newline).encode()) for n, t in zip(names, texts, strict=False)
        )
    )


def plan(program: Program, **shifts: tuple[float, float, float]) -> Plan:
    """The program's plan with rows shifted [mm]: ``r0=(1, 0, 0)``; arcs as they stand."""
    position = program.toolpath.position.copy()
    for name, shift in shifts.items():
        position[int(name[1:])] += np.array(shift) * MM
    return dataclasses.replace(Plan.of(program.toolpath), position=position)


def written(
    program: Program, wanted: Plan, shared_points: str = "copy-inline"
) -> tuple[list[str], list[str]]:
    """The lines behind the head, and of the .dat, of the program with a plan in it, read back and compared."""
    found = KRL.edit_targets(program, wanted, WritingSettings(3, 3, shared_points))
    assert not found.unwritten
    documents = []
    for index, document in enumerate(program.documents):
        edits = [edit for edit in found.edits if edit.span.file == index]
        raw = apply(document, edits)
        assert undone(raw, document.raw, edits)
        documents.append(dataclasses.replace(document, raw=raw))
    back = KRL.read(tuple(documents)).toolpath
    assert len(back) == len(wanted)
    known = np.isfinite(wanted.position)
    np.testing.assert_array_equal(np.isfinite(back.position), known)
    assert np.abs(back.position - wanted.position)[known].max() <= 0.50001e-3 * MM
    said = known[:, 0]
    np.testing.assert_allclose(back.rotation[said], wanted.rotation[said], atol=3 * 0.0005 * DEG)
    texts = [document.raw.decode().splitlines() for document in documents]
    return texts[0][3:-1], texts[1][1:-1] if len(texts) > 1 else []


def held(program: Program, wanted: Plan, shared_points: str = "copy-inline") -> EditedTargets:
    found = KRL.edit_targets(program, wanted, WritingSettings(3, 3, shared_points))
    assert len(found.edits) == 0
    assert found.unwritten
    for row, finding in found.unwritten.items():
        assert finding.line == program.toolpath.line[row]
    return found


POINT = "DECL E6POS XP1={X 1.5,Y 2,Z 3,A 4,B 5,C 6,S 2,T 35,E1 7.0}\n"


def test_a_point_of_two_motions_that_want_the_same_is_edited_once() -> None:
    program = read("LIN XP1\nPTP XP1 C_DIS\n", POINT)
    lines, data = written(program, plan(program, r0=(0.5, 0, 0), r1=(0.5, 0, 0)))
    assert lines == ["LIN XP1", "PTP XP1 C_DIS"]
    assert data == [POINT.replace("X 1.5", "X 2.000").strip()]


@pytest.mark.parametrize("axis", [0, 2], ids=["C", "A"])
def test_a_point_of_two_motions_whose_angle_passes_180_is_edited_once(axis: int) -> None:
    """179.9998 and -179.9998 deg are 0.0004 deg apart: one correction within half a step, of any angle."""
    point = "DECL POS XP1={X 1.5,Y 2,Z 3,A 0,B 0,C 0}\n"
    program = read("LIN XP1\nPTP XP1 C_DIS\n", point)
    turned = program.toolpath.rotation.copy()
    for row, angle in enumerate((179.9998, -179.9998)):
        turned[row] = rotation_from_vector(np.eye(3)[axis] * angle * DEG) @ turned[row]
    wanted = dataclasses.replace(Plan.of(program.toolpath), rotation=turned)
    lines, data = written(program, wanted)
    assert lines == ["LIN XP1", "PTP XP1 C_DIS"]
    key = "AC"[axis == 0]
    assert data in ([point.replace(f"{key} 0", f"{key} {sign}180.000").strip()] for sign in ("", "-"))


def test_a_point_of_motions_that_differ_stays_with_the_first_and_the_others_get_their_own() -> None:
    program = read("LIN XP1 C_DIS ;first\nLIN XP1 C_VEL\nLIN XP1\n", POINT)
    wanted = plan(program, r0=(0.5, 0, 0), r1=(0, 0.25, 0), r2=(0, 0.25, 0))
    lines, data = written(program, wanted)
    own = "{X 1.5,Y 2.250,Z 3,A 4,B 5,C 6,S 2,T 35,E1 7.0}"
    assert lines == ["LIN XP1 C_DIS ;first", f"LIN {own} C_VEL", f"LIN {own}"]
    assert data == [POINT.replace("X 1.5", "X 2.000").strip()]
    lines, data = written(program, wanted, "copy-dat")
    assert lines == ["LIN XP1 C_DIS ;first", "LIN XP1_1 C_VEL", "LIN XP1_1"]
    assert data == [POINT.replace("X 1.5", "X 2.000").strip(), f"DECL E6POS XP1_1={own}"]
    assert held(program, wanted, "keep").unwritten.keys() == {1, 2}
    assert held(program, wanted, "keep").unwritten[1].code == "KRL007"


def test_a_point_that_another_motion_needs_where_it_is_stays() -> None:
    program = read("LIN XP1\nLIN XP1\nLIN XP1\n", POINT)
    lines, data = written(program, plan(program, r0=(0.5, 0, 0), r2=(0, 0, 1)))
    assert lines[1] == "LIN XP1"
    assert lines[0].startswith("LIN {X 2.000,Y 2,")
    assert lines[2].startswith("LIN {X 1.5,Y 2,Z 4.000,")
    assert data == [POINT.strip()]


def test_names_of_new_points_are_new_and_not_too_long() -> None:
    name = "a" * 24
    data = f"DECL FRAME {name}={{X 1,Y 2,Z 3,A 4,B 5,C 6}}\nDECL INT {'A' * 22}_1\n"
    program = read(f"LIN {name}\nLIN {name}\n", data)
    lines, after = written(program, plan(program, r1=(0, 0, 1)), "copy-dat")
    assert lines[1] == "LIN " + "a" * 22 + "_2"
    assert after[1] == "DECL FRAME " + "a" * 22 + "_2={X 1,Y 2,Z 4.000,A 4,B 5,C 6}"


def test_elements_of_arrays_get_points_of_their_own() -> None:
    data = "DECL POS P[2]\nP[1]={X 1,Y 2,Z 3,A 4,B 5,C 6}\nP[2]={X 1,Y 2,Z 3,A 4,B 5,C 6,S 2,T 0}\n"
    program = read("LIN P[2]\nLIN P[2]\n", data)
    lines, after = written(program, plan(program, r1=(0, 0, 1)))
    assert lines == ["LIN P[2]", "LIN {X 1,Y 2,Z 4.000,A 4,B 5,C 6,S 2,T 0}"]
    assert after == data.splitlines()
    lines, after = written(program, plan(program, r0=(0, 0, 1)))
    assert lines[0].startswith("LIN {X 1,Y 2,Z 4.000")


FORM = """;FOLD LIN P1 CONT Vel=0.1 m/s CPDAT1 Tool[1] Base[1];%{PE}
LDAT_ACT=LCPDAT1
FDAT_ACT=FP1
BAS(#CP_PARAMS,0.1)
LIN XP1 C_DIS
;ENDFOLD
"""
RECORDS = """DECL FDAT FP1={TOOL_NO 1,BASE_NO 1,IPO_FRAME #BASE}
DECL LDAT LCPDAT1={VEL 0.10000,ACC 100.000,APO_DIST 2.000}
"""


def test_inline_forms_are_corrected_in_the_dat_and_their_folds_stay() -> None:
    program = read(FORM, POINT + RECORDS)
    lines, data = written(program, plan(program, r0=(0.5, 0, 0)))
    assert lines == FORM.splitlines()
    assert data[0] == POINT.replace("X 1.5", "X 2.000").strip()


def test_a_point_of_two_inline_forms_gets_a_new_point_in_the_dat() -> None:
    program = read(FORM + FORM, POINT + RECORDS)
    lines, data = written(program, plan(program, r0=(0.5, 0, 0), r1=(0, 0.5, 0)))
    assert lines == [*FORM.splitlines(), *FORM.replace("LIN XP1", "LIN XP1_1").splitlines()]
    assert data[:2] == [
        POINT.replace("X 1.5", "X 2.000").strip(),
        "DECL E6POS XP1_1={X 1.5,Y 2.500,Z 3,A 4,B 5,C 6,S 2,T 35,E1 7.0}",
    ]


@pytest.mark.parametrize("at", range(1, 5))
def test_nothing_is_inserted_before_a_form_that_sets_another_base(at: int) -> None:
    """Wherever the fold has a comment of its own: what holds before the form holds at its first line."""
    lines = FORM.splitlines(keepends=True)
    text = "".join([*lines[:at], ";checked by the shift\n", *lines[at:]])
    same, other = (read(text, POINT + RECORDS.replace("BASE_NO 1", f"BASE_NO {number}")) for number in (1, 2))
    assert not same.toolpath.constraints.no_insert_before
    assert other.toolpath.constraints.no_insert_before == {
        0: "it is an inline form that sets another base or tool"
    }


def test_a_relative_motion_behind_a_moved_point_ends_where_it_did() -> None:
    program = read(START + "LIN_REL {Z 10.25} #BASE C_DIS ;up\nLIN_REL {X 1}\n")
    lines, _ = written(program, plan(program, r0=(0.5, 0, 0)))
    assert lines == [
        "LIN {X 1.500,Y 2,Z 3,A 4,B 5,C 6}",
        "LIN {X 1.000,Y 2.000,Z 13.250,A 4,B 5,C 6} C_DIS ;up",
        "LIN_REL {X 1}",
    ]


def test_a_relative_motion_in_tool_axes_is_written_absolutely() -> None:
    program = read(START + "lin_rel{Z 10} #tool\n")
    lines, _ = written(program, plan(program, r1=(0.5, 0, 0)))
    assert lines[0] == START.strip()
    assert lines[1].startswith("lin{X ")
    assert "#" not in lines[1]


def test_a_moved_relative_motion_leaves_the_next_where_it_is() -> None:
    program = read(START + "LIN_REL {Z 10}\nLIN_REL {Z 10}\nLIN_REL {Z 10}\n")
    lines, _ = written(program, plan(program, r1=(0, 0.5, 0)))
    assert lines[3] == "LIN_REL {Z 10}"
    assert lines[2] == "LIN {X 1.000,Y 2.000,Z 23.000,A 4,B 5,C 6}"


def test_a_component_that_is_assigned_is_edited_there() -> None:
    data = "DECL E6POS P={X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
    program = read("P.X = 12.5\nLIN P\n", data)
    lines, after = written(program, plan(program, r0=(0.5, 0, 0)))
    assert lines == ["P.X = 13.000", "LIN P"]
    assert after == [data.strip()]


def test_a_computed_target_gets_an_aggregate_in_its_line() -> None:
    data = "DECL E6POS P={X 1,Y 2,Z 3,A 0,B 0,C 0,S 2,T 1}\n"
    program = read("LIN P:{X 0,Y 4,Z 0,A 0,B 0,C 0} C_DIS\n", data)
    if 0 in program.toolpath.constraints.refused:
        pytest.skip("the operator is not read")
    lines, _ = written(program, plan(program, r0=(0.5, 0, 0)))
    assert lines[0].startswith("LIN {X 1.500,Y 6.000,Z 3.000,A 0.000,B 0.000,C 0.000")
    assert lines[0].endswith("} C_DIS")


def test_lines_that_run_several_times_move_together_or_not_at_all() -> None:
    program = read(START + "FOR I=1 TO 3\nLIN {X 9,Y 2,Z 3,A 4,B 5,C 6}\nENDFOR\n")
    assert len(program.toolpath) == 4
    same = plan(program, r1=(1, 0, 0), r2=(1, 0, 0), r3=(1, 0, 0))
    lines, _ = written(program, same)
    assert lines[2] == "LIN {X 10.000,Y 2,Z 3,A 4,B 5,C 6}"
    assert held(program, plan(program, r1=(1, 0, 0), r2=(0, 1, 0))).unwritten.keys() == {1, 2}
    assert held(program, plan(program, r2=(1, 0, 0))).unwritten.keys() == {2}


ARC = "CIRC {X 10,Y 10,Z 0},{X 20,Y 0,Z 0,A 0,B 0,C 0} C_DIS ;arc\n"
FLAT = "LIN {X 0,Y 0,Z 0,A 0,B 0,C 0}\n"


def with_arc(program: Program, row: int, shift: tuple[float, float, float], grow: float = 0.0) -> Plan:
    """Begin, end and centre of the arc at ``row`` shifted [mm], and its end moved on along it [rad]."""
    path = program.toolpath
    wanted = plan(program, **{f"r{row - 1}": shift, f"r{row}": shift})
    centre, sweep, position = path.arcs.centre.copy(), path.arcs.sweep.copy(), wanted.position.copy()
    centre[row] += np.array(shift) * MM
    sweep[row] += grow
    turn = rotation_from_vector(grow * path.arcs.normal[row])
    position[row] = centre[row] + turn @ (position[row] - centre[row])
    return dataclasses.replace(wanted, centre=centre, sweep=sweep, position=position)


def arcs_agree(program: Program, wanted: Plan, row: int, text: list[str]) -> None:
    back = read("".join(line + "\n" for line in text)).toolpath
    assert abs(back.arcs.sweep[row] - wanted.sweep[row]) < 1e-3
    np.testing.assert_allclose(back.arcs.centre[row], wanted.centre[row], atol=5e-6)
    np.testing.assert_allclose(back.arcs.normal[row], wanted.normal[row], atol=1e-3)


def test_the_auxiliary_point_of_a_moved_arc_stands_half_way() -> None:
    program = read(FLAT + ARC)
    wanted = with_arc(program, 1, (1, 2, 3))
    lines, _ = written(program, wanted)
    assert lines[1] == "CIRC {X 11.000,Y 12.000,Z 3.000},{X 21.000,Y 2.000,Z 3.000,A 0,B 0,C 0} C_DIS ;arc"
    wanted = with_arc(program, 1, (0, 0, 0), 30 * DEG)
    lines, _ = written(program, wanted)
    arcs_agree(program, wanted, 1, lines)


def test_an_arc_whose_begin_alone_moves_gets_a_new_auxiliary_point() -> None:
    program = read("LIN {X 0,Y 0.5,Z 0,A 0,B 0,C 0}\n" + ARC)
    path = program.toolpath
    wanted = Plan.of(path)
    centre, sweep, normal = wanted.centre.copy(), wanted.sweep.copy(), wanted.normal.copy()
    centre[1], sweep[1], normal[1] = [0.01, 0, 0], np.pi, [0, 0, -1]
    position = wanted.position.copy()
    position[0] = 0
    wanted = dataclasses.replace(wanted, position=position, centre=centre, sweep=sweep, normal=normal)
    lines, _ = written(program, wanted)
    assert lines[1] == ARC.strip()
    arcs_agree(program, wanted, 1, lines)


def test_the_angle_of_an_arc_is_dropped_when_its_end_is_written() -> None:
    program = read(FLAT + "CIRC {X 10,Y 10,Z 0},{X 20,Y 0,Z 0,A 0,B 0,C 0},CA 90 C_DIS\n")
    np.testing.assert_allclose(program.toolpath.position[1] / MM, [10, 10, 0], atol=1e-9)
    wanted = with_arc(program, 1, (0, 0, 1))
    lines, _ = written(program, wanted)
    assert lines[1].startswith("CIRC {X 2.929,Y 7.071,Z 1.000},{X 10.000,Y 10.000,Z 1.000,A 0,")
    assert lines[1].endswith("} C_DIS")
    assert "CA" not in lines[1]
    arcs_agree(program, wanted, 1, lines)


@pytest.mark.parametrize("angle", ["360", "400.5", "-360"])
def test_a_full_circle_keeps_its_angle(angle: str) -> None:
    program = read(FLAT + f"CIRC {{X 10,Y 10,Z 0}},{{X 20,Y 0,Z 0,A 0,B 0,C 0}},CA {angle} C_DIS\n")
    wanted = with_arc(program, 1, (1, 0, 0))
    lines, _ = written(program, wanted)
    assert ",CA " in lines[1]
    arcs_agree(program, wanted, 1, lines)


def test_an_auxiliary_point_that_serves_elsewhere_too_is_kept_there() -> None:
    data = "DECL E6POS M={X 10,Y 10,Z 0,A 0,B 0,C 0}\n"
    program = read(FLAT + "CIRC M,{X 20,Y 0,Z 0,A 0,B 0,C 0}\nLIN M\n", data)
    lines, after = written(program, with_arc(program, 1, (1, 0, 0)))
    assert lines[1] == "CIRC {X 11.000,Y 10.000,Z 0.000},{X 21.000,Y 0,Z 0,A 0,B 0,C 0}"
    assert lines[2] == "LIN M"
    assert after == [data.strip()]


def divided(program: Program, row: int, *parts: tuple[Role, tuple[float, float, float]]) -> Plan:
    """The program's plan with motions inserted before a row, at X, Y, Z [mm]; the row's orientation."""
    base = Plan.of(program.toolpath)
    source = np.insert(base.source, row, [row] * len(parts))
    role = np.insert(base.role, row, [int(part[0]) for part in parts])
    position = np.insert(base.position, row, [np.array(part[1]) * MM for part in parts], axis=0)
    return Plan(
        source, role, position, base.rotation[source], base.centre[source], base.normal[source], base.sweep[source]
    )  # fmt: skip


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_pieces_and_links_stand_before_the_line(newline: str) -> None:
    program = read(START + "  \tLIN {X 7.50000, Y 2,Z 3,A 4,B 5,C 6 ,E1 9.5} C_DIS ;a cut\n", newline=newline)
    wanted = divided(program, 1, (Role.TRANSITION, (1, 2, 4)), (Role.INTERMEDIATE, (4.25, 2, 3.5)))
    found = KRL.edit_targets(program, wanted, WritingSettings(3, 3))
    document = program.documents[0]
    after = apply(document, found.edits)
    assert after.count(newline.encode()) == document.raw.count(newline.encode()) + 2
    lines = after.decode().split(newline)
    assert lines[4:7] == [
        "  \tLIN {X 1.00000,Y 2,Z 4.000,A 4,B 5,C 6,E1 9.5}",
        "  \tLIN {X 4.25000,Y 2,Z 3.500,A 4,B 5,C 6,E1 9.5} C_DIS",
        "  \tLIN {X 7.50000, Y 2,Z 3,A 4,B 5,C 6 ,E1 9.5} C_DIS ;a cut",
    ]
    written(program, wanted)


def test_pieces_alone_are_copies_of_the_line() -> None:
    line = "  slin{y 2,x+7.5,Z- 3,a 4,b 5,c 6} with $vel.cp=0.1 c_dis;cut"
    program = read(START + line + "\n")
    lines, _ = written(program, divided(program, 1, (Role.INTERMEDIATE, (4.25, 2, 3.5))))
    assert lines[1] == "  slin{y 2,x 4.250,Z 3.500,a 4,b 5,c 6} with $vel.cp=0.1 c_dis"
    assert lines[2] == line


def test_a_link_of_a_spline_motion_is_one_with_its_conditions() -> None:
    program = read(START + "SLIN {X 7,Y 2,Z 3,A 4,B 5,C 6} WITH $VEL.CP=0.1 C_DIS\n")
    lines, _ = written(program, divided(program, 1, (Role.TRANSITION, (4.25, 2, 3.5))))
    assert lines[1].startswith("SLIN {X 4.250,Y 2,Z 3.500,A 4,B 5,C 6} WITH $VEL.CP=0.1")


def test_a_partial_point_behind_a_piece_is_completed() -> None:
    program = read(START + "LIN {X 9}\nLIN {Y 9}\n")
    lines, _ = written(program, divided(program, 1, (Role.INTERMEDIATE, (4.25, 2, 3.5))))
    assert lines[1] == "LIN {X 4.250,Y 2,Z 3.500,A 4,B 5,C 6} C_DIS"
    assert lines[2] == "LIN {X 9,Y 2,Z 3,A 4,B 5,C 6}"
    assert lines[3] == "LIN {Y 9}"


def test_a_relative_motion_behind_a_piece_is_absolute() -> None:
    program = read(START + "LIN_REL {X 8} C_DIS\n")
    lines, _ = written(program, divided(program, 1, (Role.INTERMEDIATE, (4.25, 2, 3))))
    assert lines[1:] == [
        "LIN {X 4.250,Y 2.000,Z 3.000,A 4,B 5,C 6} C_DIS",
        "LIN {X 9.000,Y 2.000,Z 3.000,A 4,B 5,C 6} C_DIS",
    ]


def test_an_arc_is_divided_in_arcs() -> None:
    program = read(FLAT + ARC)
    path = program.toolpath
    wanted = divided(program, 1, (Role.INTERMEDIATE, (10, 10, 0)))
    sweep = wanted.sweep.copy()
    sweep[1:] = np.pi / 2
    wanted = dataclasses.replace(wanted, sweep=sweep)
    lines, _ = written(program, wanted)
    assert lines[1] == "CIRC {X 2.929,Y 7.071,Z 0.000},{X 10.000,Y 10.000,Z 0,A 0,B 0,C 0} C_DIS"
    assert lines[2] == "CIRC {X 17.071,Y 7.071,Z 0},{X 20,Y 0,Z 0,A 0,B 0,C 0} C_DIS ;arc"
    assert len(path) == 2


def test_nothing_is_inserted_where_it_may_not_be() -> None:
    program = read(START + "SPLINE\nSPL {X 9,Y 2,Z 3,A 4,B 5,C 6}\nENDSPLINE\n")
    assert 1 in program.toolpath.constraints.no_insert_before or 1 in program.toolpath.constraints.refused
    with pytest.raises(ValueError, match="divided"):
        KRL.edit_targets(
            program, divided(program, 1, (Role.INTERMEDIATE, (4.25, 2, 3.5))), WritingSettings(3, 3)
        )


def test_a_plan_without_a_row_is_an_error() -> None:
    program = read(START + START)
    wanted = Plan.of(program.toolpath)
    with pytest.raises(ValueError, match="every row"):
        KRL.edit_targets(program, dataclasses.replace(wanted, role=np.array([1, 0])), WritingSettings(3, 3))


NUMBER = st.floats(-500, 500).map(lambda v: f"{v:.3f}")
PARTS = st.lists(st.sampled_from("XYZABC"), min_size=1, max_size=6, unique=True)


@st.composite
def lines(draw: st.DrawFn) -> str:
    def point(keys: str | list[str] = "XYZABC") -> str:
        return "{" + ",".join(f"{key} {draw(NUMBER)}" for key in keys) + "}"

    return draw(
        st.sampled_from(
            [
                f"LIN {point()} C_DIS",
                f"PTP {point()}",
                f"SLIN {point()} WITH $VEL.CP=0.1",
                f"LIN {point(draw(PARTS))}",
                f"LIN P{draw(st.integers(1, 3))}",
                f"PTP P{draw(st.integers(1, 3))}",
                f"LIN Q[{draw(st.integers(1, 2))}] C_VEL",
                f"LIN_REL {point(draw(st.sampled_from(['X', 'XZ', 'ZYX'])))}",
                f"LIN_REL {point('Z')} #TOOL C_DIS",
                f"CIRC {point('XYZ')},{point()}",
                f"CIRC P{draw(st.integers(1, 3))},{point()}",
                f"CIRC {point('XYZ')},P{draw(st.integers(1, 3))} C_DIS",
                f"CIRC {point()},{point()},CA {draw(st.integers(-420, 420))}",
                f"P{draw(st.integers(1, 3))}.{draw(st.sampled_from('XYZ'))} = {draw(NUMBER)}",
                f"P{draw(st.integers(1, 3))} = {point()}",
                f"FOR I=1 TO 2\nLIN {point()}\nENDFOR",
                "FOR I=1 TO 2\nLIN Q[I]\nENDFOR",
                "$BASE=BASE_DATA[2]",
                "PTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0}",
                "WAIT SEC 0",
            ]
        )
    )


@st.composite
def datas(draw: st.DrawFn) -> str:
    def value() -> str:
        return ",".join(f"{key} {draw(NUMBER)}" for key in "XYZABC") + draw(
            st.sampled_from(["", ",S 2,T 35", ",E1 5.0"])
        )

    points = "".join(f"DECL E6POS P{i}={{{value()}}}\n" for i in (1, 2, 3))
    return points + "DECL E6POS Q[2]\n" + "".join(f"Q[{i}]={{{value()}}}\n" for i in (1, 2))


@settings(deadline=None, max_examples=examples(400))
@given(st.lists(lines(), max_size=8), datas(), st.integers(0, 2**32 - 1), st.sampled_from(["\n", "\r\n"]))
def test_programs_of_all_sorts_make_the_motions_of_random_plans(
    body: list[str], data: str, seed: int, newline: str
) -> None:
    text = HEAD + "LIN {X 100,Y 0,Z 50,A 10,B 20,C 30}\n" + "".join(line + "\n" for line in body) + "END\n"
    documents = tuple(
        Document(Path(name), raw.replace("\n", newline).encode())
        for name, raw in (("part.src", text), ("part.dat", f"DEFDAT part\n{data}ENDDAT\n"))
    )
    examined(KRL, documents, np.random.default_rng(seed))


def test_a_point_of_a_file_that_is_never_written_gives_way_to_an_aggregate() -> None:
    config = "DEFDAT $CONFIG\nDECL GLOBAL E6POS XSAFE={X 1,Y 2,Z 3,A 4,B 5,C 6,S 2,T 35}\nENDDAT\n"
    references = ReadingSettings(references=(Document(Path("$config.dat"), config.encode()),))
    program = KRL.read((Document(Path("part.src"), (HEAD + "LIN XSAFE C_DIS\nEND\n").encode()),), references)
    assert not program.toolpath.constraints.refused
    for shared_points in ("copy-inline", "copy-dat"):
        found = KRL.edit_targets(program, plan(program, r0=(0, 0, 1)), WritingSettings(3, 3, shared_points))
        (edit,) = found.edits
        assert edit.text.startswith(b"{X 1")
        assert b"Z 4.000," in edit.text
        assert edit.text.endswith(b",S 2,T 35}")
        after = apply(program.documents[0], found.edits).splitlines()[3]
        assert after.startswith(b"LIN {X 1")
        assert after.endswith(b"} C_DIS")


def test_pieces_of_the_first_line_stand_behind_a_byte_order_mark() -> None:
    raw = b"\xef\xbb\xbfLIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\r\nLIN {X 2}"
    settings = b"BAS(#BASE,1)\r\nBAS(#TOOL,1)\r\n"
    program = KRL.read((Document(Path("part.src"), raw),))
    assert len(program.toolpath) == 2
    if 0 in program.toolpath.constraints.refused:
        program = KRL.read((Document(Path("part.src"), raw[:3] + settings + raw[3:]),))
    found = KRL.edit_targets(
        program, divided(program, 0, (Role.INTERMEDIATE, (0, 2, 3))), WritingSettings(3, 3)
    )
    after = apply(program.documents[0], found.edits)
    assert after.startswith(b"\xef\xbb\xbf")
    assert after.count(b"\xef\xbb\xbf") == 1
    assert after.endswith(
        b"LIN {X 0.000,Y 2,Z 3,A 4,B 5,C 6} C_DIS\r\nLIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\r\nLIN {X 2}"
    )


def test_a_list_of_partial_points_is_completed_where_a_neighbour_moves() -> None:
    """As a slicer writes them: X, Y, Z only, in many lines."""
    random = np.random.default_rng(7)
    rows = random.normal(0, 100, (300, 3)).tolist()
    program = read(
        START + "".join("LIN {{X {:.2f}, Y {:.3f}, Z {:.0f}}} c_vel\n".format(*row) for row in rows)
    )
    path = program.toolpath
    free = random.random(len(path)) < 0.5
    position = path.position + free[:, None] * random.normal(0, 2e-4, (len(path), 3))
    turned = rotation_from_vector(free[:, None] * random.normal(0, 1e-3, (len(path), 3))) @ path.rotation
    wanted = dataclasses.replace(Plan.of(path), position=position, rotation=turned)
    lines, _ = written(program, wanted)
    assert len(lines) == len(path)
    still = ~free & ~np.roll(free, 1)
    source = program.documents[0].raw.decode().splitlines()[3:-1]
    assert all(lines[row] == source[row] for row in np.flatnonzero(still).tolist())
    changed = np.flatnonzero(free).tolist()
    assert all(f"{key} " in lines[row] for row in changed for key in "XYZABC")


def test_what_is_taken_over_is_judged_by_the_digits_that_are_written() -> None:
    program = read(START + "LIN_REL {X 0.0004}\nLIN {Y 9}\nLIN {Y 10}\n")
    lines, _ = written(program, plan(program, r0=(0, 1, 0), r2=(0.0003, 0, 0)))
    assert lines[1] == "LIN {X 1.000,Y 2.000,Z 3.000,A 4,B 5,C 6}"
    assert lines[2] == "LIN {Y 9,X 1.001}"
    assert lines[3] == "LIN {Y 10,X 1.000}"


def test_what_is_taken_over_from_a_refused_relative_motion_is_where_that_ends() -> None:
    program = read(START + "CIRC_REL {X .,Y 10},{X 20}\nLIN {Y 500}\nLIN {Y 600}\n")
    assert set(program.toolpath.constraints.refused) == {1}
    assert set(program.toolpath.constraints.locked) == {0}
    lines, _ = written(program, plan(program, r2=(1, 0, 0)))
    assert lines[2] == "LIN {Y 500,X 22.000,Z 3.000,A 4,B 5,C 6}"
    assert lines[3] == "LIN {Y 600,X 21.000}"


def test_an_arc_with_an_angle_ends_where_it_did_when_its_begin_is_rounded() -> None:
    program = read(FLAT + "LIN_REL {X 0.0004}\nCIRC {X 0.5,Y 0.1,Z 0},{X 1,Y 0,Z 0,A 0,B 0,C 0},CA 200\n")
    lines, _ = written(program, plan(program, r0=(0, 0, 1)))
    assert lines[1].startswith("LIN {X 0.000,")
    assert "CA" not in lines[2]


def test_angles_that_are_taken_over_are_completed_together() -> None:
    program = read(START + "LIN {X 9}\n")
    turn = rotation_from_vector(np.array([[0, 0, 0.1 * DEG], [0, 0, 0]]))
    wanted = dataclasses.replace(Plan.of(program.toolpath), rotation=turn @ program.toolpath.rotation)
    lines, _ = written(program, wanted)
    assert lines == ["LIN {X 1,Y 2,Z 3,A 4.100,B 5,C 6}", "LIN {X 9,A 4,B 5,C 6}"]


def test_a_partial_point_behind_an_arc_with_an_angle_takes_its_orientation() -> None:
    program = read(FLAT + "CIRC {X 10,Y 10,Z 0},{X 20,Y 0,Z 0,A 1.25,B 2,C 3},CA 90\nLIN {Z 5}\n")
    lines, _ = written(program, plan(program, r2=(0, 0, 1)))
    assert lines[1].endswith(",CA 90")
    assert lines[2] == "LIN {Z 6.000,X 10.000,Y 10.000,A 1.25,B 2,C 3}"


def test_an_auxiliary_point_stays_where_its_arc_stays() -> None:
    data = "DECL E6POS M={X 10,Y 10,Z 0,A 0,B 0,C 0}\n"
    program = read(FLAT + "CIRC M,{X 20,Y 0,Z 0,A 0,B 0,C 0}\nLIN M\n", data)
    lines, after = written(program, plan(program, r2=(1, 0, 0)))
    assert lines[2] == "LIN {X 11.000,Y 10,Z 0,A 0,B 0,C 0}"
    assert after == [data.strip()]


@pytest.mark.parametrize(
    ("line", "data"),
    [("HIGH = XP1.Z + 5\n", POINT), ("", POINT.replace("DECL", "DECL GLOBAL"))],
    ids=["read by other code", "global"],
)
def test_a_point_that_others_may_read_stays(line: str, data: str) -> None:
    program = read(line + "LIN XP1\n", data)
    lines, after = written(program, plan(program, r0=(0, 0, 1)))
    assert lines[-1] == "LIN {X 1.5,Y 2,Z 4.000,A 4,B 5,C 6,S 2,T 35,E1 7.0}"
    assert after == [data.strip()]
    assert held(program, plan(program, r0=(0, 0, 1)), "keep").unwritten.keys() == {0}


def test_an_aggregate_that_runs_several_times_is_not_completed_for_one_of_them() -> None:
    program = read(START + "FOR I=1 TO 2\nLIN {E1 5.0}\nLIN {X 7}\nENDFOR\n")
    assert len(program.toolpath) == 5
    # what precedes it cannot move either
    assert held(program, plan(program, r0=(0, 0, 1))).unwritten.keys() == {0, 1}


@pytest.mark.slow
def test_a_change_is_followed_over_the_blocks_that_rows_are_taken_in() -> None:
    count = BLOCK + 3
    program = read(START + "".join(f"LIN {{Y {i}}}\n" for i in range(count)))
    lines, _ = written(program, plan(program, **{f"r{BLOCK}": (0.5, 0, 0)}))
    source = program.documents[0].raw.decode().splitlines()[3:-1]
    assert lines[BLOCK] == f"LIN {{Y {BLOCK - 1},X 1.500,Z 3,A 4,B 5,C 6}}"
    assert lines[BLOCK + 1] == f"LIN {{Y {BLOCK},X 1}}"
    assert lines[:BLOCK] + lines[BLOCK + 2 :] == source[:BLOCK] + source[BLOCK + 2 :]
