"""What is written of RAPID: literals in place, targets in numbers, inserted motions; and the same as in KRL."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from drawn_plans import divided, refuse_what_may_not_move

from postproc.base.document import Document, Edit, Edits, Span, apply
from postproc.base.findings import Refusal
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.languages import DIALECTS
from postproc.languages.dialect import EditedTargets, Program, WritingSettings
from postproc.languages.permitted import refuse_other
from postproc.languages.rapid.quaternions import quaternion_from_rotation
from postproc.robot.axis_track import follow_axes, nominal_flange
from postproc.robot.description import find_robot, load_robot
from postproc.toolpath import Plan, Role, Toolpath

RAPID, KRL = DIALECTS["rapid"], DIALECTS["krl"]
WRITING = WritingSettings(mm=3, deg=3)
EXTRA = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"
HEAD = "MODULE part\nPERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];\n"


def target(x: float, y: float, z: float, q: str = "[0,0,1,0]", extra: str = EXTRA) -> str:
    return f"[[{x},{y},{z}],{q},{extra}]"


def read(text: str) -> Program:
    return RAPID.read((Document(Path("part.mod"), text.encode()),))


def module(body: str, data: str = "") -> Program:
    return read(f"{HEAD}{data}PROC main()\n{body}ENDPROC\nENDMODULE\n")


def plan_of(program: Program, moved: dict[int, tuple[float, float, float]], turn: float = 0.0) -> Plan:
    """Rows moved by so many mm, and turned by ``turn`` [rad] about z."""
    path = program.toolpath
    position, rotation = path.position.copy(), path.rotation.copy()
    for row, step in moved.items():
        position[row] += np.array(step) * MM
        rotation[row] = rotation[row] @ rotation_from_vector(np.array([0.0, 0.0, turn]))
    n = len(path)
    arcs = path.arcs
    return Plan(np.arange(n), np.zeros(n), position, rotation, arcs.centre, arcs.normal, arcs.sweep)


def edited(program: Program, plan: Plan, shared: str = "copy-inline") -> EditedTargets:
    found = RAPID.edit_targets(program, plan, WritingSettings(3, 3, shared))
    refuse_other(program, Edits.joined(found.edits), RAPID.letters)
    return found


def written(program: Program, plan: Plan, shared: str = "copy-inline") -> str:
    found = edited(program, plan, shared)
    assert not found.unwritten
    text = apply(program.documents[0], found.edits).decode()
    back = read(text).toolpath
    assert back.position / MM == pytest.approx(plan.position[:] / MM, abs=0.00051)
    return text


def test_only_the_numbers_that_change_are_edited() -> None:
    program = module(f"MoveL {target('1.00', '+2', '-3')},v100,z1,t; ! MoveL 1.00\n")
    text = written(program, plan_of(program, {0: (0.01, 0, 0)}))
    assert f"MoveL {target('1.010', '+2', '-3')},v100,z1,t; ! MoveL 1.00\n" in text


def test_a_number_in_hexadecimal_digits_is_written_as_a_decimal() -> None:
    program = module(f"MoveL {target('-0x10', '+2', '-3')},v100,z1,t;\n")
    assert "MoveL [[-15.990,2,-3],[0,0,1,0]," in written(program, plan_of(program, {0: (0.01, 0, 0)}))


def test_a_number_keeps_its_decimals_and_a_shift_below_half_of_the_last_one_is_none() -> None:
    program = module(f"MoveL {target('1.00000', '2', '3')},v100,z1,t;\n")
    assert "[[1.00001,2,3]" in written(program, plan_of(program, {0: (0.00001, 0.0004, 0)}))


def test_a_turn_writes_a_quaternion_of_length_1_with_the_digits_of_the_file() -> None:
    program = module(f"MoveL {target(1, 2, 3, '[0.7071068,0.0,0.7071068,0]')},v100,z1,t;\n")
    plan = plan_of(program, {0: (0, 0, 0)}, turn=0.01)
    text = written(program, plan)
    numbers = re.search(r"MoveL \[\[1,2,3\],\[([^\]]*)\]", text)
    assert numbers is not None
    parts = numbers[1].split(",")
    assert [len(part.partition(".")[2]) for part in parts] == [7, 5, 7, 5]
    assert np.linalg.norm([float(part) for part in parts]) == pytest.approx(1.0, abs=1e-5)
    back = read(text).toolpath.rotation[0]
    angle = np.arccos(np.clip((np.trace(back.T @ plan.rotation[0]) - 1) / 2, -1, 1))
    assert angle < 1.5e-3 * DEG


def test_a_named_point_of_one_motion_is_edited_where_it_is_declared() -> None:
    program = module(
        "MoveL p1,v100,z1,t;\nMoveL p{2},v100,z1,t;\n",
        f"CONST robtarget p1:={target(1, 2, 3)};\nPERS robtarget p{{2}}:=[{target(4, 5, 6)},\n{target(7, 8, 9)}];\n",
    )
    text = written(program, plan_of(program, {0: (1, 0, 0), 1: (0, 1, 0)}))
    assert f"CONST robtarget p1:={target('2.000', 2, 3)};" in text
    assert f"[{target(4, 5, 6)},\n{target(7, '9.000', 9)}]" in text
    assert "MoveL p1,v100,z1,t;\nMoveL p{2},v100,z1,t;\n" in text


SHARED = [
    ("MoveL p1,v100,z1,t;\nMoveL p1,v100,z1,t;\n", "is shared by several motions"),
    ("MoveL p1,v100,z1,t;\nMoveL Offs(p1,0,0,0),v100,z1,t;\n", "other code reads"),
    ("MoveL Offs(p1,0,0,0),v100,z1,t;\nMoveL p1,v100,z1,t;\n", "its target is computed"),
    ("MoveL RelTool(p1,0,0,0\\Rx:=0),v100,z1,t;\nMoveL p1,v100,z1,t;\n", "its target is computed"),
    ("MoveL p1,v100,z1,t;\nx:=p1.trans.x;\nMoveL p1,v100,z1,t;\n", "other code reads"),
]


@pytest.mark.parametrize(("body", "why"), SHARED)
def test_a_shared_or_computed_point_becomes_a_target_in_numbers(body: str, why: str) -> None:
    data = f"VAR num x;\nCONST robtarget p1:={target(1, 2, 3)};\n"
    program = module(body, data)
    plan = plan_of(program, {0: (1, 0, 0)})
    text = written(program, plan)
    assert (
        f"MoveL {target('2.000', '2.000' if 'computed' in why else 2, '3.000' if 'computed' in why else 3)}"
        in (re.sub(r"(?<=\],\[)[0.,1]{9,}(?=\],\[0,0,0,0\])", "0,0,1,0", text))
    )
    assert data in text
    kept = edited(program, plan, "keep")
    assert not len(kept.edits)
    assert {row: finding.code for row, finding in kept.unwritten.items()} == {0: "RAP015"}
    assert why in kept.unwritten[0].message


def test_a_point_in_a_statement_of_several_lines_is_not_replaced() -> None:
    program = module("MoveL\nOffs(p1,0,0,0),v100,z1,t;\n", f"CONST robtarget p1:={target(1, 2, 3)};\n")
    assert list(edited(program, plan_of(program, {0: (1, 0, 0)})).unwritten) == [0]


INSERTED = [
    ("v100,fine,t", Role.INTERMEDIATE, True, "v100,z0,t"),
    ("v100,z5,t", Role.INTERMEDIATE, True, "v100,z5,t"),
    (
        "v100\\V:=20,z5\\Z:=2\\Inpos:=i,t\\WObj:=w",
        Role.INTERMEDIATE,
        True,
        "v100\\V:=20,z5\\Z:=2,t\\WObj:=w",
    ),
    ("v100 , z5, t", Role.TRANSITION, False, "v100,fine,t"),
    ("v100,fine,t", Role.TRANSITION, True, "v100,z0,t"),
]


@pytest.mark.parametrize(("tail", "role", "flows", "new"), INSERTED)
def test_an_inserted_motion_has_the_words_of_its_source(tail: str, role: Role, flows: bool, new: str) -> None:
    data = 'PERS wobjdata w:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
    program = module(
        f"  MoveL {target(0, 0, 0)},v100,z1,t\\WObj:=w;\n  MoveL {target(10, 0, 0)},{tail};\n", data
    )
    text = written(program, divided(program, 1, role, flows))
    assert f"  MoveL {target('5.000', 0, 0)},{new};\n  MoveL {target(10, 0, 0)},{tail};\n" in text


def test_an_arc_is_divided_into_arcs_on_the_same_circle() -> None:
    program = module(
        f"MoveL {target(0, 0, 0)},v100,z1,t;\nMoveC {target(10, 10, 0)},{target(20, 0, 0)},v50,z1,t;\n"
    )
    text = written(program, divided(program, 1, Role.INTERMEDIATE, True))
    arcs = read(text).toolpath.arcs
    assert arcs.centre[1:] / MM == pytest.approx(np.array([[10, 0, 0], [10, 0, 0]]), abs=0.002)
    assert arcs.sweep[1:] / DEG == pytest.approx([90, 90], abs=0.01)
    assert text.count("MoveC") == 2


def test_an_arc_that_is_too_short_for_the_controller_is_refused() -> None:
    program = module(
        f"MoveL {target(0, 0, 0)},v100,z1,t;\nMoveC {target('0.1', '0.1', 0)},{target('0.2', 0, 0)},v50,z1,t;\n"
    )
    found = edited(program, divided(program, 1, Role.INTERMEDIATE, True))
    assert not len(found.edits)
    assert {row: why.code for row, why in found.unwritten.items()} == {1: "RAP012"}


def test_inserted_motions_take_their_external_axes_along() -> None:
    extra = ["[0,0,0,0],[100,9E9,9E9,9E9,9E9,9E9]", "[0,0,0,0],[200,9E9,9E9,9E9,9E9,9E9]"]
    program = module("".join(f"MoveL {target(10 * k, 0, 0, extra=extra[k])},v100,z1,t;\n" for k in range(2)))
    external = np.full((3, 6), np.nan)
    external[:, 0] = [100, 150, 200]
    text = written(program, divided(program, 1, Role.INTERMEDIATE, True, external))
    assert "[0,0,0,0],[150.000,9E9,9E9,9E9,9E9,9E9]],v100" in text


def test_what_may_not_move_raises() -> None:
    program = module(f"MoveL pOther,v100,z1,t;\nMoveL {target(1, 2, 3)},v100,z1,t;\n")
    refuse_what_may_not_move(program)


FORBIDDEN = [
    ("v100", "v200"), ("! said", "! done"), ("SetDO do1,1", "SetDO do1,0"), ("MoveL p1", "MoveJ p1;\nReset do1;"),
    ('"a!"', '"b!"'), ("PROC main", "PROC other"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new"), FORBIDDEN)
def test_edits_of_anything_else_are_refused(old: str, new: str) -> None:
    program = module(
        'TPWrite "a!"; SetDO do1,1;\nMoveL p1,v100,z1,t;\n! said\n',
        f"CONST robtarget p1:={target(1, 2, 3)};\n",
    )
    raw = program.documents[0].raw
    at = raw.index(old.encode())
    edit = Edit(Span(0, at, at + len(old)), new.encode())
    allowed = old.startswith(("v100",))  # in the line of a motion; the read-back check compares its speed
    if allowed:
        refuse_other(program, Edits.joined([edit]), RAPID.letters)
    else:
        with pytest.raises(Refusal):
            refuse_other(program, Edits.joined([edit]), RAPID.letters)


def test_a_number_after_a_string_with_an_exclamation_mark_is_no_comment() -> None:
    program = module(f'TPWrite "hi!"; MoveL {target(1, 2, 3)},v100,z1,t;\n')
    assert "[[2.000,2,3]" in written(program, plan_of(program, {0: (1, 0, 0)}))
    said = module(f"! MoveL {target(1, 2, 3)}\nMoveL {target(1, 2, 3)},v100,z1,t;\n")
    raw = said.documents[0].raw
    at = raw.index(b"[[1,") + 2
    with pytest.raises(Refusal):
        refuse_other(said, Edits.joined([Edit(Span(0, at, at + 1), b"2")]), RAPID.letters)


def one_target(flange: Poses, configuration: str) -> Toolpath:
    """A MoveJ to a pose (1) with these numbers as its confdata."""
    q = quaternion_from_rotation(flange.rotation, np.array([[1.0, 0, 0, 0]]))[0]
    place = ",".join(f"{value:.9f}" for value in flange.position[0] / MM)
    turn = ",".join(f"{value:.12f}" for value in q)
    target = f"[[{place}],[{turn}],[{configuration}],{EXTRA[10:]}]"
    return read(f"MODULE m\nPROC main()\nMoveJ {target},v9,fine,tool0;\nENDPROC\nENDMODULE\n").toolpath


def test_cfx_names_the_branch_that_the_robot_is_in(tmp_path: Path) -> None:
    """A MoveJ goes to the branch of its cfx, whatever the robot starts in; forward kinematics of other joint values
    that reach the target in each of the eight branches say which it is."""
    robot = load_robot(find_robot("abb_irb6700", None))
    start = np.radians([0.0, 0, 0, 0, 30, 0])
    flange = nominal_flange(robot, np.radians([[20.0, 10, 15, 30, 40, 50]]))
    seen = {}
    for cfx in range(8):
        path = one_target(flange, f"0,0,0,{cfx}")
        flanges = Poses(path.rotation, path.position)
        track = follow_axes(robot, path, flanges, start)
        if not track.reachable[0]:
            continue
        seen[cfx] = q = track.q[0]
        assert nominal_flange(robot, track.q).position == pytest.approx(flange.position, abs=1e-6)
        lengths = robot.nominal.lengths
        reach = lengths.a1 + lengths.a2 * np.sin(q[1])
        elbow = q[1] + q[2]  # of the forearm below the level
        wrist = reach + lengths.d4 * np.cos(elbow) + lengths.a3 * np.sin(elbow)
        assert (wrist < 0) == bool(cfx & 4)
        assert (q[4] < 0) == bool(cfx & 1)
        ahead = np.cos(q[2]) * lengths.d4 + np.sin(q[2]) * lengths.a3  # of the lower arm's own line
        assert (ahead < 0) == bool(cfx & 2)
    assert len(seen) >= 4


def test_a_comment_within_a_statement_is_not_taken_along() -> None:
    said = EXTRA.replace(",9E9]", "! COMPENSATE OFF\n,9E9]")
    tail = "v100 ! fast\n,z5,t"
    program = module(f"MoveL {target(0, 0, 0)},v100,z5,t;\nMoveL {target(10, 0, 0, extra=said)},{tail};\n")
    text = written(program, divided(program, 1, Role.INTERMEDIATE, True))
    assert f"MoveL {target('5.000', 0, 0)},v100,z5,t;\n" in text.replace(" ,", ",")
    assert f"{said}],{tail};" in text


@pytest.mark.parametrize(
    ("angles", "quadrants", "matches"),
    [
        ((20.0, 10, 15, 30, 40, 50), "0,0,0", True),
        ((20.0, 10, 15, 30, 40, 50), "0,4,-4", True),  # whole turns do not count
        ((20.0, 10, 15, 30, 40, 50), "-1,0,0", False),
        ((20.0, 10, 15, 30, 40, 50), "0,1,0", False),
        ((-20.0, 10, 15, 130, 40, -100), "-1,1,-2", True),
        ((-20.0, 10, 15, 130, 40, -100), "-1,1,-1", False),
        ((0.001, 10, 15, 30, 40, 50), "-1,0,0", True),  # on the border
    ],
)
def test_quadrants_are_those_of_the_axes(angles, quadrants, matches) -> None:
    """Axis angles as ABB counts them, and the place to which forward kinematics brings the flange."""
    robot = load_robot(find_robot("abb_irb6700", None))
    flange = nominal_flange(robot, np.radians([angles]))
    path = one_target(flange, f"{quadrants},0")
    track = follow_axes(robot, path, Poses(path.rotation, path.position), np.radians(angles))
    assert np.degrees(track.q[0]) == pytest.approx(angles, abs=1e-6)
    assert track.turn_matches.tolist() == [matches]
