"""Reversal errors through the whole command: a circle on a machine with gaps in A1 and A2 (ISO 230-4), and a straight
line whose first axis moves by rounding only."""

from functools import cache

import numpy as np
import pytest
from circles import BASE, CENTRE, LEAD, POSE, RADIUS, Machine, circle, form, point
from conftest import CELL
from judge.cell import Cell
from judge.path import Path as Way
from judge.reader import read
from judge.robot import Robot as JudgedArm
from test_inverse_general import CELL as GENERAL
from test_inverse_general import soft

from postproc.base.document import Document
from postproc.compensation.reversals import find_reversals
from postproc.languages import detect
from postproc.model import StiffnessModel
from postproc.robot.description import find_robot, load_robot
from postproc.workflows.preparation import Request, prepare

KR270 = find_robot("kuka_kr270")
GAP = 2e-4
WRENCH = np.array([1.0, 0, 1, 0, 0, 0])
LETTERS = {"hysteresis": "w", "backlash": "b"}


@cache
def machine():
    robot = load_robot(find_robot("kuka_kr270"))
    return Machine(StiffnessModel.from_robot(robot), GAP * np.array([1.0, 1, 0, 0, 0, 0]))


def drawn(text):
    """[mm] the form error of the last full turn of a program's circle."""
    places, loaded = machine().drawn(text, WRENCH)
    around = places[loaded][:, :2] - CENTRE
    angle = np.unwrap(np.arctan2(around[:, 1], around[:, 0]))
    return form(places[loaded][angle - angle[0] >= LEAD])


@cache
def before():
    return drawn("\n".join(circle()))


def arm(job, effect, gap, axes=(1, 2), **cell):
    known = find_robot("kuka_kr270").read_text().rstrip()
    values = "".join(
        f"      {LETTERS[effect]}{i}: {{value: {gap:.6g}, unit: rad, source: test}}\n" for i in axes
    )
    (job.folder / "arm.yaml").write_text(f"{known}\n  - effect: {effect}\n    parameters:\n{values}")
    keys = "".join(f"{key}: {value}\n" for key, value in cell.items())
    job.cell(CELL.replace("kuka_kr270", "arm.yaml") + keys)


ABSOLUTE = {"correct": "absolute", "controller": "{absolute_accuracy: false}"}


@pytest.mark.slow
def test_the_circle_shows_the_gaps():
    """A1 turns round where the radius of the robot touches the circle: its gap times the distance from A1 is a step."""
    lever = np.hypot(*(CENTRE + BASE[:2]))
    assert before() == pytest.approx(GAP * lever, rel=0.15)
    still = Machine(StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270"))), np.zeros(6))
    places, loaded = still.drawn("\n".join(circle()), WRENCH)
    assert form(places[loaded]) < 0.003  # digits, chords and a newton


@pytest.mark.slow
@pytest.mark.parametrize("cell", [{}, ABSOLUTE], ids=["process", "absolute"])
@pytest.mark.parametrize("effect", LETTERS)
def test_reversal_errors_of_a_circle_are_corrected(compensate, job, effect, cell):
    arm(job, effect, GAP, **cell)
    done = compensate(job.write(circle()), "--force", "-q")
    assert done.code in (0, 3), done.err
    after = drawn(job.output.read_text())
    print(f"\n{effect}: circular form error {before():.3f} mm, corrected {after:.4f} mm")
    assert after < before() / 15


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.7, 1.3])
@pytest.mark.parametrize("effect", LETTERS)
def test_a_gap_known_to_a_third_leaves_a_third(compensate, job, effect, share):
    arm(job, effect, share * GAP)
    assert compensate(job.write(circle()), "--force", "-q").code in (0, 3)
    after = drawn(job.output.read_text())
    print(f"\n{effect} x {share}: circular form error {before():.3f} mm, corrected {after:.3f} mm")
    assert after < 0.36 * before()


def with_points(lines, task, arcs):
    """The circle in arcs that end where ``reversals`` asks for it; behind one a little later, for the digits."""
    rows, along = find_reversals(task, np.full(len(task.toolpath), 1e-3))
    first = int(np.flatnonzero(np.isfinite(task.toolpath.arcs.sweep))[0])
    inside = (rows >= first) & (rows < first + arcs)
    place = task.lost_motion.wanted.line.position(rows[inside], along[inside])
    behind = np.abs(place[:, None] - task.lost_motion.wanted.until).min(axis=1) < 1e-9
    whole = 2 * np.pi + LEAD
    angle = (rows[inside] - first + along[inside]) / arcs * whole + behind * 0.3 / RADIUS
    ends = np.sort(np.concatenate([angle, whole * np.arange(1, arcs + 1) / arcs]))
    begin, end = lines.index(";FORCE 1 0 1 @base"), lines.index(";FORCE OFF")
    pairs = zip(np.append(0.0, ends), ends, strict=False)
    ways = [f"CIRC {point((one + two) / 2)},{point(two)}" for one, two in pairs]
    return [*lines[: begin + 1], *ways, *lines[end:]]


@pytest.mark.slow
def test_arcs_need_points_at_reversals_and_no_more(compensate, job):
    arm(job, "hysteresis", GAP, max_growth=20)
    arcs = 5
    lines = circle(arcs=arcs)
    source = job.write(lines)
    compensate(source, "--force", "-q")
    without = drawn(job.output.read_text())
    task = prepare(Request(source, force="")).task
    divided = with_points(lines, task, arcs)
    assert len(divided) - len(lines) <= 2 * 5  # A1 and A2 turn round five times
    compensate(job.write(divided), "--force", "-q", "--allow-compensated")
    after = drawn(job.output.read_text())
    print(
        f"\n5 arcs: circular form error {before():.3f} mm, corrected {without:.3f} mm, with points {after:.4f} mm"
    )
    assert after < before() / 10


def rounded_circle(job):
    """[mm] the largest distance of the tool from the circle on the path that a controller makes of the output, with its
    parabolas, as the independent judge reads it."""
    way = Way(
        read(job.output, Cell.load(job.folder / "cell.yaml")),
        JudgedArm(KR270),
        Cell.load(job.folder / "cell.yaml"),
    )
    loaded = [i for i, motion in enumerate(way.motions) if not motion.air]
    low, high = loaded[0] - 2, loaded[-1]
    label = np.arange(way.start[low], way.start[high + 1], 2e-4)
    motion, _ = way.find(label, low, high)
    place, rotation, _ = way.at(label, low, high)
    tool = machine().followed(place + BASE / 1000, rotation, np.isin(motion, loaded), WRENCH)[
        motion >= loaded[0]
    ]
    return np.hypot(np.hypot(*(tool[:, :2] - CENTRE).T) - RADIUS, tool[:, 2]).max()


@pytest.mark.slow
def test_axes_cross_their_gaps_where_the_rounded_path_lets_them(compensate, job):
    """What is reported, what ``verify`` finds and what the machine does where points inserted in arcs are rounded."""
    arm(job, "hysteresis", GAP)
    source = job.write(circle(arcs=5))
    done = compensate(source, "--force", "--json", "-")
    warnings = {finding["code"] for finding in done.json["findings"] if finding["severity"] == "warning"}
    assert warnings == {"FRC034"}  # the force is 1 N
    reported = done.json["path_error_mm"]["max"]
    verified = compensate("verify", source, job.output, "--force", "--json", "-").json["compensated"]["max"]
    cut = rounded_circle(job)
    print(f"\nreported {reported:.4f} mm, verified {verified:.4f}, on the machine {cut:.4f}")
    assert verified == pytest.approx(reported, abs=1e-3)
    assert cut == pytest.approx(reported, abs=1e-3)


def straight(steps=60):
    """Away from the robot at A1 = 0, Y to and fro by the third decimal."""
    ways = [f"LIN {{X {100 + 3 * k}.000,Y 200.00{k % 2},Z 0.000,{POSE}}} C_DIS" for k in range(1, steps)]
    return [
        "DEF part()",
        "BAS(#INITMOV,0)",
        "$BASE=BASE_DATA[1]",
        "$TOOL=TOOL_DATA[1]",
        "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}",
        "$VEL.CP=0.05",
        f"LIN {{X 100.000,Y 150.000,Z 50.000,{POSE}}}",
        f"LIN {{X 100.000,Y 200.000,Z 0.000,{POSE}}}",
        ";FORCE 1 0 1 @base",
        *ways,
        ";FORCE OFF",
        "LIN {Z 50.000}",
        "END",
    ]


def corrections_of(source, output):
    """(59,) [mm] by how much the motions of ``straight`` are moved in Y, from the last one on."""
    first, second = (
        detect(path, path.read_bytes()).read((Document(path, path.read_bytes()),)).toolpath
        for path in (source, output)
    )
    back = np.arange(1, 60)  # the last motion but one is the first
    rows = [len(path) - 1 - back for path in (second, first)]
    return 1000 * (second.position[rows[0]] - first.position[rows[1]])[:, 1]


@pytest.mark.sample(2)
@pytest.mark.parametrize("cell", [{}, ABSOLUTE], ids=["process", "absolute"])
@pytest.mark.parametrize("effect", LETTERS)
def test_rounding_of_a_straight_line_changes_no_side(compensate, job, effect, cell):
    arm(job, effect, GAP, (1,), **cell)
    source = job.write(straight())
    done = compensate(source, "--force", "-q")
    assert done.code in (0, 3), done.err
    moved = corrections_of(source, job.output)
    assert np.abs(moved).min() > 0.1  # half the gap at 1.6 m
    assert len(set(np.sign(moved))) == 1
    assert np.abs(np.diff(moved)).max() < 0.003


@pytest.mark.slow
@pytest.mark.parametrize("effect", LETTERS)
@pytest.mark.parametrize("robot", ["general", "rail"])
def test_arms_of_other_kinds_have_lost_motion_too(compensate, job, robot, effect):
    """An arm solved by Newton's method, and one on a rail: a cut there and back, every axis with a gap."""
    gaps = "".join(
        f"      {LETTERS[effect]}{i}: {{value: 2e-4, unit: rad, source: t}}\n" for i in range(2, 7)
    )
    cut = [
        ";FORCE -3 1 2 @base",
        *(f"LIN {{X {x}.000,Y 10.000,Z 0.000,{POSE}}}" for x in range(1, 30)),
        *(f"LIN {{X {x}.000,Y 11.000,Z 0.000,{POSE}}}" for x in range(29, 0, -1)),
        ";FORCE OFF",
    ]
    lines = ["DEF part()", "$BASE=BASE_DATA[1]", "$TOOL=TOOL_DATA[1]"]
    if robot == "general":
        soft(job.folder)
        job.cell(GENERAL)
        lines += ["PTP {A1 10,A2 -80,A3 100,A4 -110,A5 -80,A6 15}"]
        file = job.folder / "soft.yaml"
    else:
        text = find_robot("kuka_kr270").read_text().replace("  kuka:", "  rail: +y\n  kuka:")
        text = text.replace("  A1:", "  E1: {kind: prismatic, limits: [0, 6000], unit: mm}\n  A1:")
        for i in range(6, 0, -1):
            text = text.replace(f"      c{i}:", f"      c{i + 1}:")
        file = job.folder / "rail.yaml"
        file.write_text(text)
        cell = CELL.replace("kuka_kr270", "rail.yaml").replace("y: -200", "y: 1800")
        job.cell(cell.replace("start: [0,", "start: [2000, 0,"))
        lines += ["PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}"]
    file.write_text(file.read_text().rstrip() + f"\n  - effect: {effect}\n    parameters:\n{gaps}")
    ends = [f"LIN {{X 0.000,Y {y}.000,Z {z}.000,{POSE}}}" for y, z in ((0, 50), (10, 0), (10, 50))]
    source = job.write([*lines, *ends[:2], *cut, ends[2], "END"])
    done = compensate(source, "--force", "--json", "-")
    assert done.code in (0, 3), done.err
    assert done.json["uncorrected"] == 0
    assert done.json["error_before_mm"]["max"] > 0.05
    assert done.json["error_after_mm"]["max"] < 0.01
