"""What is written of Fanuc TP: numbers in place, new points, inserted and renumbered lines; and the same as in KRL."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from drawn_plans import divided, refuse_what_may_not_move

import postproc
from postproc.base.document import Document, Edit, Edits, Span, apply
from postproc.base.findings import Refusal
from postproc.base.geometry import Poses, rotation_from_abc, rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.languages import DIALECTS
from postproc.languages.dialect import EditedTargets, Program, ReadingSettings, WritingSettings
from postproc.languages.permitted import refuse_other
from postproc.robot.axis_track import follow_axes, nominal_flange
from postproc.robot.description import find_robot, load_robot
from postproc.toolpath import Kind, Plan, Role

TP, KRL = DIALECTS["tp"], DIALECTS["krl"]
CASES = Path(__file__).parent / "programs" / "tp"


def read(text: str) -> Program:
    return TP.read((Document(Path("part.ls"), text.encode("latin-1")),))


def point(n: int, *values: str | float, name: str = "", more: str = "") -> str:
    x, y, z, w, p, r = (*values, *("0.000", "0.000", "0.000", "180.000", "0.000", "0.000")[len(values) :])
    label = f'P[{n}:"{name}"]' if name else f"P[{n}]"
    return (
        f"{label}{{\n   GP1:\n\tUF : 1, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
        f"\tX = {x}  mm,\tY = {y}  mm,\tZ = {z}  mm,\n"
        f"\tW = {w} deg,\tP = {p} deg,\tR = {r} deg{more}\n}};\n"
    )


def listing(statements: list[str], points: list[str], count: int | None = None) -> Program:
    lines = "".join(f"{n:4d}:{one} ;\n" for n, one in enumerate(statements, 1))
    total = len(statements) if count is None else count
    return read(f"/PROG PART\n/ATTR\nLINE_COUNT\t= {total};\n/MN\n{lines}/POS\n{''.join(points)}/END\n")


def plan_of(program: Program, moved: dict[int, tuple[float, float, float]], turn: float = 0.0) -> Plan:
    """Rows moved by so many mm, and turned by ``turn`` [rad] about x."""
    path = program.toolpath
    position, rotation = path.position.copy(), path.rotation.copy()
    centre = path.arcs.centre.copy()
    for row, step in moved.items():
        position[row] += np.array(step) * MM
        centre[row] += np.array(step) * MM
        rotation[row] = rotation_from_vector(np.array([turn, 0.0, 0.0])) @ rotation[row]
    n = len(path)
    return Plan(np.arange(n), np.zeros(n), position, rotation, centre, path.arcs.normal, path.arcs.sweep)


def edited(program: Program, plan: Plan, shared: str = "copy-inline") -> EditedTargets:
    found = TP.edit_targets(program, plan, WritingSettings(3, 3, shared))
    refuse_other(program, Edits.joined(found.edits), TP.letters)
    return found


def written(program: Program, plan: Plan, shared: str = "copy-inline") -> str:
    """The text with the edits and the mark; it makes the motions of the plan, and its lines are counted."""
    found = edited(program, plan, shared)
    assert not found.unwritten
    mark = [TP.marked(program, "1.2.3, robot x")] if len(found.edits) else []
    text = apply(program.documents[0], sorted([*mark, *found.edits], key=lambda edit: edit.span)).decode(
        "latin-1"
    )
    back = read(text)
    assert back.toolpath.position / MM == pytest.approx(plan.position[:] / MM, abs=0.00051, nan_ok=True)
    main = text.partition("/MN\n")[2].partition("/POS")[0]
    numbers = [int(number) for number in re.findall(r"^ *(\d+) *:", main, re.M)]
    assert numbers == list(range(1, len(numbers) + 1))
    assert "FTP019" not in {finding.code for finding in back.findings}
    return text


FRAMES = ["  UFRAME_NUM=1", "  UTOOL_NUM=1"]


def test_only_the_numbers_that_change_are_edited() -> None:
    program = listing([*FRAMES, "L P[1] 50mm/sec FINE"], [point(1, "  1.00", "+2", "-.5")])
    text = written(program, plan_of(program, {0: (0.01, 0, 0)}))
    assert "X =   1.010  mm,\tY = +2  mm,\tZ = -.5  mm,\n\tW = 180.000 deg" in text
    assert "   1:  !COMPENSATED by compensate 1.2.3 ;\n   2:  UFRAME_NUM=1 ;\n" in text
    assert "   4:L P[1] 50mm/sec FINE ;\n" in text
    assert "LINE_COUNT\t= 4;" in text


def test_a_number_keeps_its_decimals_and_a_shift_below_half_of_the_last_one_is_none() -> None:
    program = listing([*FRAMES, "L P[1] 50mm/sec FINE"], [point(1, "1.00000", "2", "3")])
    assert "X = 1.00001  mm,\tY = 2  mm" in written(program, plan_of(program, {0: (0.00001, 0.0004, 0)}))


def test_a_turn_is_written_in_the_spelling_of_the_text() -> None:
    program = listing([*FRAMES, "L P[1] 50mm/sec FINE"], [point(1, 1, 2, 3, "179.9950", "0.000", "-170.0")])
    plan = plan_of(program, {0: (0, 0, 0)}, turn=0.001)
    text = written(program, plan)
    back = read(text).toolpath.rotation[0]
    angle = np.arccos(np.clip((np.trace(back.T @ plan.rotation[0]) - 1) / 2, -1, 1))
    assert angle < 1.5e-3 * DEG
    numbers = re.search(r"W = (\S+) deg,\tP = (\S+) deg,\tR = (\S+) deg", text)
    assert numbers is not None
    assert [len(number.partition(".")[2]) for number in numbers.groups()] == [4, 3, 1]
    assert "X = 1  mm" in text


@pytest.mark.parametrize(
    "more", ["L P[1:a b] 50mm/sec FINE", "  PR[1]=P[1]", "  R[1]=P[1,1]", "  PR[2]=P[R[1]]"]
)
def test_a_shared_point_gets_a_copy_with_a_new_number(more: str) -> None:
    program = listing(
        [*FRAMES, "L P[1:a b] 50mm/sec FINE", more], [point(1, 1, 2, 3, name="a b"), point(7, 4)]
    )
    plan = plan_of(program, {0: (1, 0, 0)})
    text = written(program, plan)
    assert "L P[8:a b] 50mm/sec FINE ;\n" in text
    assert point(1, 1, 2, 3, name="a b") in text
    assert text.endswith(point(7, 4) + point(8, "2.000", 2, 3, name="a b") + "/END\n")
    kept = edited(program, plan, "keep")
    assert not len(kept.edits)
    assert {row: finding.code for row, finding in kept.unwritten.items()} == {0: "FTP015"}


def test_a_new_point_takes_no_number_that_a_statement_names() -> None:
    program = listing(
        [*FRAMES, "L P[1] 50mm/sec FINE", "L P[1] 50mm/sec FINE", "L P[2] 50mm/sec FINE"], [point(1, 1, 2, 3)]
    )
    assert "L P[3] 50mm/sec FINE" in written(program, plan_of(program, {0: (1, 0, 0)}))


INSERTED = [
    ("50mm/sec FINE", Role.INTERMEDIATE, True, "50mm/sec CNT100"),
    ("50mm/sec CNT60", Role.INTERMEDIATE, True, "50mm/sec CNT60"),
    ("300cm/min CNT60 ACC80 PTH", Role.INTERMEDIATE, True, "300cm/min CNT60 ACC80 PTH"),
    ("R[1:v]mm/sec CR5", Role.TRANSITION, False, "R[1:v]mm/sec FINE"),
    ("50mm/sec FINE", Role.TRANSITION, True, "50mm/sec CNT100"),
]


@pytest.mark.parametrize(("words", "role", "flows", "new"), INSERTED)
def test_an_inserted_motion_has_the_words_of_its_source(
    words: str, role: Role, flows: bool, new: str
) -> None:
    points = [point(1, "0.000"), point(2, "10.000", name="end")]
    program = listing([*FRAMES, "L P[1] 50mm/sec CNT100", f"L P[2:end] {words}"], points)
    text = written(program, divided(program, 1, role, flows))
    assert f"   4:L P[1] 50mm/sec CNT100 ;\n   5:L P[3] {new}    ;\n   6:L P[2:end] {words} ;\n/POS" in text
    assert text.endswith("".join([*points, point(3, "5.000"), "/END\n"]))
    assert "LINE_COUNT\t= 6;" in text


def test_lines_keep_their_width_and_continued_lines_have_no_number() -> None:
    statements = [
        *FRAMES,
        *(["  R[1]=1"] * 5),
        "L P[1] 50mm/sec FINE",
        "C P[2]    \n    :  P[3] 50mm/sec FINE   ",
    ]
    program = listing(statements, [point(1), point(2, "10.000", "10.000"), point(3, "20.000")])
    text = written(program, divided(program, 1, Role.INTERMEDIATE, True))
    assert "   9:L P[1]" in text
    assert (
        "  10:C P[4] P[5] 50mm/sec CNT100    ;\n  11:C P[2]    \n    :  P[3] 50mm/sec FINE    ;\n/POS" in text
    )
    arcs = read(text).toolpath.arcs
    assert arcs.centre[1:] / MM == pytest.approx(np.array([[10, 0, 0], [10, 0, 0]]), abs=0.002)
    assert arcs.sweep[1:] / DEG == pytest.approx([90, 90], abs=0.01)


@pytest.mark.parametrize("count", [0, 17])
def test_a_line_count_that_was_not_true_stays(count: int) -> None:
    program = listing([*FRAMES, "L P[1] 50mm/sec FINE"], [point(1, 1, 2, 3)], count)
    found = edited(program, plan_of(program, {0: (1, 0, 0)}))
    assert f"LINE_COUNT\t= {count};" in apply(program.documents[0], found.edits).decode()


@pytest.mark.parametrize(
    "moved", [{2: (0.5, 0, 0)}, {4: (0, 0.5, 0)}, {row: (0.1 * row, 0, 0) for row in range(1, 7)}]
)
def test_a_run_of_a_motions_becomes_lines_and_arcs_where_it_is_no_longer_round(moved) -> None:
    program = read((CASES / "arc_runs.ls").read_text())
    text = written(program, plan_of(program, moved))
    assert "A P[" not in text
    forms = re.findall(r"^ *\d+:([LC]) ", text, re.M)
    assert forms == list("LLCCCCCL")
    assert re.search(
        r"^   5:L P\[2\] 50mm/sec CNT100 ;\n   6:C P\[10\] P\[3\] 50mm/sec CNT100 ;$", text, re.M
    )


def test_a_run_of_a_motions_stays_where_a_motion_beside_it_moves() -> None:
    program = read((CASES / "arc_runs.ls").read_text())
    text = written(program, plan_of(program, {7: (0, 0, 1)}))
    assert text.count("A P[") == 6


def test_an_arc_that_is_too_short_is_refused() -> None:
    points = [point(1), point(2, "0.100", "0.100"), point(3, "0.200")]
    program = listing([*FRAMES, "L P[1] 50mm/sec FINE", "C P[2] P[3] 50mm/sec FINE"], points)
    found = edited(program, divided(program, 1, Role.INTERMEDIATE, True))
    assert not len(found.edits)
    assert {row: why.code for row, why in found.unwritten.items()} == {1: "FTP012"}


def test_inserted_motions_take_their_external_axes_along() -> None:
    more = ",\n\tE1 =   {:7.3f}  mm"
    points = [point(n, f"{10 * n}.000", more=more.format(100 * n)) for n in (1, 2)]
    program = listing([*FRAMES, "L P[1] 50mm/sec FINE", "L P[2] 50mm/sec FINE"], points)
    external = np.full((3, 6), np.nan)
    external[:, 0] = [100, 150, 200]
    text = written(program, divided(program, 1, Role.INTERMEDIATE, True, external))
    assert point(3, "15.000", more=more.format(150)) in text


def test_what_may_not_move_raises() -> None:
    program = listing([*FRAMES, "L P[9] 50mm/sec FINE", "L P[1] 50mm/sec FINE TA .5sec,DO[1]=ON"], [point(1)])
    refuse_what_may_not_move(program)


FORBIDDEN = [
    ("!said", "!done"),
    ("DO[1]=ON", "DO[1]=OFF"),
    ("/PROG PART", "/PROG PARX"),
    ("UTOOL_NUM", "UFRAME_NUM"),
]


@pytest.mark.parametrize(("old", "new"), FORBIDDEN)
def test_edits_of_anything_else_are_refused(old: str, new: str) -> None:
    program = listing([*FRAMES, "  !said", "  DO[1]=ON", "L P[1] 50mm/sec FINE"], [point(1)])
    at = program.documents[0].raw.index(old.encode())
    edit = Edit(Span(0, at, at + len(old)), new.encode())
    with pytest.raises(Refusal):
        refuse_other(program, Edits.joined([edit]), TP.letters)


def test_the_mark_is_put_once_and_replaced_by_the_next_one() -> None:
    program = listing([*FRAMES, "L P[1] 50mm/sec FINE"], [point(1, 1, 2, 3)])
    text = written(program, plan_of(program, {0: (1, 0, 0)}))
    again = read(text)
    assert again.marker is not None
    assert not again.toolpath.comments
    back = apply(again.documents[0], [TP.marked(again, "9.8.7, robot y")]).decode()
    assert back == text.replace("1.2.3", "9.8.7")
    mark = re.search(r"!(.*) ;", text)
    assert mark is not None
    assert len(mark[1]) <= 32


def test_a_program_is_renamed_in_capitals() -> None:
    program = listing([*FRAMES, "L P[1] 50mm/sec FINE"], [point(1)])
    text = apply(program.documents[0], TP.renamed(program, "part_2")).decode()
    assert text.startswith("/PROG PART_2\n/ATTR")
    with pytest.raises(Refusal) as refused:
        TP.renamed(program, "part-2")
    assert refused.value.findings[0].code == "FTP021"


CELL = """\
robot: kuka_kr270
tools: {1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}}
bases: {1: {x: 1450, y: -100, z: 600, a: 0, b: 0, c: 0}}
start: [0, -90, 90, 0, 45, 0]
tolerance: 0.02
max_growth: 6
"""


def two_programs(folder: Path, seed: int) -> tuple[Path, Path]:
    """One path, with lines, arcs and turns of the tool, as KRL and as TP."""
    random = np.random.default_rng(seed)
    krl = ["DEF part()", "$BASE=BASE_DATA[1]", "$TOOL=TOOL_DATA[1]", "$VEL.CP=0.05", "$CIRC_TYPE=#BASE"]
    krl += ["PTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0}"]
    statements = [*FRAMES, "J P[1] 50% FINE"]
    axes = ",\t".join(f"J{k}= {value:.3f} deg" for k, value in enumerate((0, -90, 90, 0, 45, 0), 1))
    points = [f"P[1]{{\n   GP1:\n\tUF : 1, UT : 1,\t\n\t{axes}\n}};\n"]
    position, abc = np.array([0.0, 0.0, -5.0]), np.array([0.0, 0.0, 180.0])

    def spelt(position, abc) -> tuple[str, int]:
        numbers = [f"{value:.4f}" for value in position]
        angles = [f"{value:.7f}" for value in abc]
        points.append(point(len(points) + 1, *numbers, *angles[::-1]))
        pairs = zip("XYZABC", [*numbers, *angles], strict=True)
        return "{" + ",".join(f"{k} {v}" for k, v in pairs) + "}", len(points)

    for _ in range(int(random.integers(6, 14))):
        arc = random.random() < 0.25 and len(krl) > 7
        end_abc = abc if arc else abc + random.uniform(-3, 3, 3)
        if arc:
            via = spelt(position + np.array([8.0, 6.0, 0.5]), end_abc)
        position, abc = position + random.uniform([10, -10, -0.5], [20, 10, 0.5]), end_abc
        end = spelt(position, abc)
        if arc:
            krl.append(f"CIRC {via[0]},{end[0]}")
            statements.append(f"C P[{via[1]}]    \n    :  P[{end[1]}] 50mm/sec FINE   ")
        else:
            krl.append(f"LIN {end[0]}")
            statements.append(f"L P[{end[1]}] 50mm/sec FINE   ")
    one, other = folder / "part.src", folder / "part.ls"
    one.write_text("\n".join([*krl, "END"]) + "\n")
    other.write_bytes(listing(statements, points).documents[0].raw)
    (folder / "cell.yaml").write_text(CELL)
    return one, other


def same_as_krl(folder: Path, seed: int) -> int:
    """Holds the corrected poses of one path written in both languages to be the same; how many there are."""
    folder.mkdir()
    paths, exits = [], []
    for program, dialect in zip(two_programs(folder, seed), (KRL, TP), strict=True):
        report = postproc.compensate(program, force="40,360,560@base", output=folder / "out" / program.name)
        exits.append(report.exit)
        out = folder / "out" / program.name
        paths.append(dialect.read((Document(out, out.read_bytes()),), ReadingSettings()).toolpath)
    assert exits[0] == exits[1]
    one, other = paths
    assert one.kind.tolist() == other.kind.tolist()
    moving = one.kind != Kind.AXIS
    assert one.position[moving] / MM == pytest.approx(other.position[moving] / MM, abs=0.0003)
    turns = np.einsum("nij,nij->n", one.rotation[moving], other.rotation[moving])
    assert np.degrees(np.arccos(np.clip((turns - 1) / 2, -1, 1))).max() < 1e-3
    assert one.arcs.sweep == pytest.approx(other.arcs.sweep, abs=1e-3, nan_ok=True)
    return int(moving.sum()) if exits[0] == 0 else 0


@pytest.mark.slow
def test_a_path_in_tp_is_corrected_as_the_same_path_in_krl(tmp_path: Path) -> None:
    assert same_as_krl(tmp_path / "one", 3) > 8


@pytest.mark.slow
def test_many_paths_in_tp_are_corrected_as_in_krl(tmp_path: Path) -> None:
    counts = [same_as_krl(tmp_path / str(seed), seed) for seed in range(100, 112)]
    assert sum(count > 0 for count in counts) > 5


FANUC = "fanuc_m900ib_700"


def chain(joints: np.ndarray) -> np.ndarray:
    """(4, 4) [m] the flange of an M-900iB/700 at angles between its links, by the frames of its ROS description."""
    origins = [(0, 0, 0), (0.41, 0, 0), (0, 0, 1.12), (0, 0, 0.25), (1.285, 0, 0), (0.3, 0, 0)]
    axes = [(0, 0, 1), (0, 1, 0), (0, -1, 0), (-1, 0, 0), (0, -1, 0), (-1, 0, 0)]
    pose = np.eye(4)
    for origin, axis, angle in zip(origins, axes, joints, strict=True):
        step = np.eye(4)
        step[:3, 3] = origin
        step[:3, :3] = rotation_from_vector(np.array(axis) * angle)
        pose = pose @ step
    tool = np.eye(4)
    tool[:3, :3] = np.array([[0, 0, 1], [0, -1, 0], [1, 0, 0]])
    return pose @ tool


@pytest.mark.parametrize("seed", range(5))
def test_j3_counts_from_the_level_whatever_j2_is(seed: int) -> None:
    robot = load_robot(find_robot(FANUC, None))
    shown = np.random.default_rng(seed).uniform(-0.5, 0.5, (1, 6))
    between = shown.copy()
    between[0, 2] += shown[0, 1]
    flange = nominal_flange(robot, robot.joint_values(shown))
    expected = chain(between[0])
    assert flange.position[0] == pytest.approx(expected[:3, 3], abs=1e-9)
    assert flange.rotation[0] == pytest.approx(expected[:3, :3], abs=1e-9)
    moved = shown.copy()
    moved[0, 1] += 0.1
    forearm = [robot.joint_values(one)[0, 2] - one[0, 1] for one in (shown, moved)]
    assert forearm[0] == pytest.approx(forearm[1])


def test_n_u_t_is_the_branch_of_a_j_motion() -> None:
    """J to a target in each of the configurations that are read reaches it in that configuration."""
    robot = load_robot(find_robot(FANUC, None))
    start = robot.joint_values(np.radians([[0.0, 0, 0, 0, -30, 0]]))[0]
    flange = nominal_flange(robot, robot.joint_values(np.radians([[20.0, 10, -15, 30, -40, 50]])))
    angles = np.degrees(_wpr(flange.rotation[0]))
    seen = {}
    for config in ("N U T", "F U T", "N D T", "F D T"):
        text = point(1, *(f"{v:.9f}" for v in flange.position[0] / MM), *(f"{v:.9f}" for v in angles))
        text = text.replace("N U T", config).replace("UF : 1, UT : 1", "UF : 0, UT : 0")
        path = listing(["J P[1] 50% FINE"], [text]).toolpath
        track = follow_axes(robot, path, Poses(path.rotation, path.position), start)
        assert track.reachable[0]
        seen[config] = track.q[0]
        assert nominal_flange(robot, track.q).position == pytest.approx(flange.position, abs=1e-6)
        assert (track.q[0][4] > 0) == (config[0] == "F")
    assert np.degrees(seen["N U T"]) == pytest.approx([20, 10, -5, 30, -40, 50], abs=1e-4)
    assert seen["N D T"][2] < seen["N U T"][2]
    assert rotation_from_abc(np.radians(angles[::-1])) == pytest.approx(flange.rotation[0])


def _wpr(rotation: np.ndarray) -> np.ndarray:
    """W, P, R [rad]: turns about the fixed axes x, y, z."""
    p = np.arcsin(-rotation[2, 0])
    return np.array(
        [np.arctan2(rotation[2, 1], rotation[2, 2]), p, np.arctan2(rotation[1, 0], rotation[0, 0])]
    )


@pytest.mark.parametrize("name", ["J3: {limits: [-130, 30], sign: -1, offset: 90, interaction: J4}"])
def test_a_joint_interacts_only_with_one_before_it(name: str, tmp_path: Path) -> None:
    text = find_robot(FANUC, None).read_text()
    (tmp_path / "robot.yaml").write_text(re.sub(r"J3: .*", name, text))
    with pytest.raises(Refusal):
        load_robot(tmp_path / "robot.yaml")


@pytest.mark.slow
def test_the_main_job_on_a_soft_fanuc_is_read_back_and_verified(tmp_path: Path) -> None:
    """The sample, on its robot with an invented compliance: shared points, arcs and axis positions."""
    sample = Path(__file__).parents[1] / "samples" / "m900ib_pocket"
    text = (sample / "pocket.ls").read_text()
    assert text.count("P[2:above]") == 3
    (tmp_path / "pocket.ls").write_text(text.replace("FORCE 120 260 -60", "FORCE 120 860 -60"))
    shutil.copy(sample / "arm.yaml", tmp_path)
    cell = (sample / "cell.yaml").read_text()
    (tmp_path / "cell.yaml").write_text(cell + "max_growth: 6\n")
    report = postproc.compensate(tmp_path / "pocket.ls", force=True)
    assert report.exit == 0
    out = tmp_path / "compensated" / "pocket.ls"
    program = read(out.read_text())
    assert program.marker is not None
    assert {finding.code for finding in program.findings} == set()
    verified = postproc.verify(tmp_path / "pocket.ls", out, force=True)
    figures = verified.to_dict()
    assert figures["original"]["max"] > 0.5
    assert figures["compensated"]["max"] < 0.02
    errors = report.to_dict()
    assert errors["error_before_mm"]["max"] > 0.5
    assert errors["error_after_mm"]["max"] < 0.005


def test_a_zero_force_writes_the_same_bytes(tmp_path: Path) -> None:
    sample = Path(__file__).parents[1] / "samples" / "m900ib_pocket"
    for name in ("pocket.ls", "cell.yaml", "arm.yaml"):
        (tmp_path / name).write_bytes((sample / name).read_bytes())
    raw = re.sub(rb"!FORCE [^;]*;", b"!FORCE 0 0 0 ;", (tmp_path / "pocket.ls").read_bytes())
    (tmp_path / "pocket.ls").write_bytes(raw)
    postproc.compensate(tmp_path / "pocket.ls", force=True, output=tmp_path / "out" / "pocket.ls")
    written_file = tmp_path / "out" / "pocket.ls"
    assert written_file.read_bytes() == raw
