"""Written programs before an independent judge: on MuJoCo, from their bytes, along the whole path.

The first half holds the judge itself: against MuJoCo, against closed forms, and with faults planted into programs of
its own making.  The second half runs the command on the cases of ``judge.cases``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from judge.cases import CASES, CELL, CUT, OFF, Case, krl, lead_in, pose, run, steps_of_force
from judge.cell import Cell
from judge.force import Field
from judge.further_cases import FURTHER, against_the_force
from judge.judge import judge
from judge.motion import DEG, MM, from_abc
from judge.path import Path as Way
from judge.reader import read
from judge.robot import Robot, check_on_mujoco, rotation_vectors, rotations
from judge.third import third

ROBOT = Path(__file__).parents[1] / "robots" / "kuka_kr270.yaml"


@pytest.fixture(scope="module")
def robot() -> Robot:
    return Robot(ROBOT)


def way(folder: Path, *lines: str, **more: object) -> Way:
    program = krl(*lines, **more)(folder)  # type: ignore[arg-type]
    cell = Cell.load(folder / "cell.yaml")
    return Way(read(program, cell), Robot.find(cell.robot, cell.folder), cell)


# The judge


def test_its_chain_and_its_equilibrium_are_those_of_mujoco(robot: Robot) -> None:
    rng = np.random.default_rng(3)
    q = rng.uniform(*robot.limits.T, (300, 6))
    wrench = rng.normal(size=(300, 6)) * [600, 600, 600, 60, 60, 60]
    tool = (rotations(rng.normal(size=(1, 3)))[0], np.array([0.3, -0.1, 0.2]))
    assert check_on_mujoco(robot, q, wrench, tool) < 1e-9


def test_its_arm_turns_as_the_maker_says(robot: Robot) -> None:
    """A1 about -z, A2 and A3 downwards, A4 and A6 about the forearm the other way round; by hand from the lengths."""
    tool = (np.eye(3), np.zeros(3))
    angles = np.array(
        [[0, 0, 0, 0, 0, 0], [90, -90, 90, 0, 0, 0], [0, -90, 90, 0, 90, 0], [0, -90, 90, 90, 90, 0]]
    )
    place, turned, _ = robot.chain(angles * DEG, tool)
    flange = [[2.93, 0, 0.695], [0, -(0.35 + 1.33), 1.945], [1.45, 0, 1.715], [1.45, -0.23, 1.945]]
    np.testing.assert_allclose(place, flange, atol=1e-12)
    np.testing.assert_allclose(turned[:, :, 2], [[1, 0, 0], [0, -1, 0], [0, 0, -1], [0, -1, 0]], atol=1e-12)
    turned = robot.chain(np.array([[0, -90, 90, 0, 0, 90.0]]) * DEG, tool)[1][0]
    np.testing.assert_allclose(turned[:, 0], [0, -1, 0], atol=1e-12)  # -z, turned about -x


def test_its_compensator_is_a_spring_with_the_right_slope(robot: Robot) -> None:
    angle, h = np.linspace(-2.4, -0.1, 40), 1e-6
    spring = robot.spring
    assert spring is not None
    ends = [spring.torque(angle + side * h)[0] for side in (-1, 1)]
    np.testing.assert_allclose(spring.torque(angle)[1], (ends[1] - ends[0]) / (2 * h), rtol=1e-6)


def test_its_rotations_go_there_and_back() -> None:
    rng = np.random.default_rng(4)
    vectors = rng.normal(size=(500, 3))
    vectors *= (rng.uniform(0, np.pi - 1e-6, 500) / np.linalg.norm(vectors, axis=1))[:, None]
    np.testing.assert_allclose(rotation_vectors(rotations(vectors)), vectors, atol=1e-9)


@pytest.mark.slow
def test_an_inverse_is_an_inverse_in_its_branch(robot: Robot) -> None:
    rng = np.random.default_rng(5)
    tool = (from_abc(10, 80, 5), np.array([0.3, 0, 0.2]))
    for q in rng.uniform([-1, -2, 1, 0.5, -1.5, -1], [1, -1, 2, 1, -0.5, 1], (20, 6)):
        place, turned, _ = robot.chain(q[None], tool)
        found = robot.reach(place[0], turned[0], tool, q + 0.2, *robot.status(q))
        np.testing.assert_allclose(found, q, atol=1e-8)


def test_an_approximated_vertex_is_a_parabola(tmp_path: Path) -> None:
    path = way(tmp_path, f"LIN {pose(0, 0, 0)}", f"LIN {pose(100, 0, 0)} C_DIS", f"LIN {pose(100, 50, 0)}",
               head=("$APO.CDIS=4",))  # fmt: skip
    vertex = path.start[3]
    place = path.points(vertex + np.array([-4, -2, 0, 2, 4]) * MM, 2, 3) / MM
    np.testing.assert_allclose(place[:, 0], [96, 100 - 2.25, 99, 99.75, 100], atol=1e-9)
    np.testing.assert_allclose(place[:, 1], [0, 0.25, 1, 2.25, 4], atol=1e-9)


def test_a_vertex_is_left_at_half_of_a_short_motion(tmp_path: Path) -> None:
    path = way(tmp_path, f"LIN {pose(0, 0, 0)}", f"LIN {pose(100, 0, 0)} C_DIS", f"LIN {pose(100, 6, 0)} C_DIS",
               f"LIN {pose(0, 6, 0)}", head=("$APO.CDIS=40",))  # fmt: skip
    np.testing.assert_allclose(path.approximation[2:4] / MM, [3, 3], atol=1e-9)


@pytest.mark.parametrize(
    ("orientation", "circle", "middle", "end"),
    [
        ("#VAR", "#BASE", 20, 40),
        ("#CONSTANT", "#BASE", 0, 0),
        ("#VAR", "#PATH", 20, 40),
        ("#CONSTANT", "#PATH", 45, 90),
    ],
)
def test_the_orientation_along_an_arc(
    tmp_path: Path, orientation: str, circle: str, middle: float, end: float
) -> None:
    path = way(
        tmp_path, f"LIN {pose(100, 0, 0, c=0)}", f"$ORI_TYPE={orientation}", f"$CIRC_TYPE={circle}",
        f"CIRC {pose(70.7106781, 70.7106781, 0)},{pose(0, 100, 0, a=40, c=0)}",
    )  # fmt: skip
    row, share = np.array([2, 2]), np.array([0.5, 1.0])
    place, turned, _ = path.on_motion(row, share)
    np.testing.assert_allclose(np.linalg.norm(place, axis=1) / MM, 100, atol=1e-3)
    expected = [from_abc(a, 0, 0) for a in (middle, end)]
    np.testing.assert_allclose(turned, expected, atol=1e-4)


def test_the_feed_frame_and_a_ramp(tmp_path: Path) -> None:
    """Tool down, feed along x and then along y: the same force in the feed frame turns with it, over 5 mm."""
    path = way(tmp_path, f"LIN {pose(0, 0, 0)}", ";FORCE 10 20 30 @feed", f"LIN {pose(100, 0, 0)}",
               f"LIN {pose(100, 50, 0)}", cell=CELL.replace("b: 30", "b: 0"))  # fmt: skip
    one = Field(path, 2, 3, 5 * MM, 50.0)
    label = path.start[2] + np.array([0, 50, 97.5, 98.75, 100, 101.25, 102.5, 150]) * MM
    expected = np.array([
        [10, 20, 30], [10, 20, 30], [10, 20, 30], [2.5, 17.5, 30],
        [-5, 15, 30], [-12.5, 12.5, 30], [-20, 10, 30], [-20, 10, 30],
    ])  # fmt: skip
    np.testing.assert_allclose(one.at(label)[:, :3], expected, atol=1e-6)


def test_a_slight_turn_is_the_mean_of_both_sides(tmp_path: Path) -> None:
    path = way(tmp_path, f"LIN {pose(0, 0, 0)}", ";FORCE 100 0 0 @feed", f"LIN {pose(100, 0, 0)}",
               f"LIN {pose(200, 36.397, 0)}", cell=CELL.replace("b: 30", "b: 0"))  # fmt: skip
    one = Field(path, 2, 3, 5 * MM, 100.0)
    straight = np.array([100.0, 0, 0])
    turned = 100 * np.array([np.cos(20 * DEG), np.sin(20 * DEG), 0])
    middle = 0.5 * (turned + straight)
    places = path.start[3] + np.array([-100, -50, 0]) * MM
    expected = [straight, 0.5 * (middle + straight), middle]
    np.testing.assert_allclose(one.at(places)[:, :3], expected, atol=1e-3)


def perfect(folder: Path, count: int = 60) -> tuple[Path, Path]:
    """A cut and, by the judge's own arm alone, the program that takes its deflection away: dense points."""
    lines = [f"LIN {pose(3 * i, 0.01 * i * i, 0, a=0.2 * i)}" for i in range(1, count + 1)]
    head = [f"LIN {pose(0, 0, 50)}", f"LIN {pose(0, 0, 0)}", CUT]
    tail = [OFF, f"LIN {pose(3 * count, 40, 50)}"]
    program = krl(*head, *lines, *tail)(folder)
    cell = Cell.load(folder / "cell.yaml")
    path = Way(read(program, cell), Robot.find(cell.robot, cell.folder), cell)
    rows = np.arange(3, 3 + count)
    field = Field(path, 3, 2 + count, 5 * MM, 306.0)
    labels = np.append(path.start[3], path.start[rows + 1])
    index = np.append(3, rows)
    place, turned, outside = path.at(labels, 3, 2 + count)
    turns, places = path.frames(index, outside)
    wrench = (turns @ field.at(labels).reshape(-1, 2, 3).swapaxes(1, 2)).swapaxes(1, 2).reshape(-1, 6)
    nodes, joints = path.joints_at_nodes()
    q = np.stack([np.interp(labels, nodes, joints[:, j]) for j in range(6)], axis=1)
    tool, aim_place, aim_turn = path.motions[3].tool, place.copy(), turned.copy()
    for _ in range(8):
        target = places + np.einsum("kij,kj->ki", turns, aim_place), turns @ aim_turn
        q = path.robot.settle(*target, tool, q)
        real, tilted, _ = path.robot.rest(q, wrench, tool)
        real, tilted = np.einsum("kji,kj->ki", turns, real - places), turns.swapaxes(1, 2) @ tilted
        aim_place = aim_place + place - real
        aim_turn = turned @ tilted.swapaxes(1, 2) @ aim_turn

    def target_of(k: int) -> str:
        m = aim_turn[k]
        b = np.arctan2(-m[2, 0], np.hypot(m[0, 0], m[1, 0]))
        a, c = np.arctan2(m[1, 0], m[0, 0]), np.arctan2(m[2, 1], m[2, 2])
        numbers = zip("XYZABC", [*(aim_place[k] / MM), a / DEG, b / DEG, c / DEG], strict=True)
        return "{" + ",".join(f"{key} {value:.7f}" for key, value in numbers) + "}"

    output = folder / "compensated"
    output.mkdir()
    made = krl(
        head[0], f"LIN {target_of(0)}", CUT, *(f"LIN {target_of(k)}" for k in range(1, count + 1)), *tail
    )
    (output / "part.src").write_bytes(made(output).read_bytes())
    return program, output / "part.src"


def test_a_program_without_error_is_judged_so_and_its_original_by_its_deflection(tmp_path: Path) -> None:
    program, output = perfect(tmp_path)
    verdict = judge(program, output, tmp_path / "cell.yaml")
    assert verdict.after.largest < 1e-6
    assert verdict.after.angle.max() < 1e-5
    assert 1.5 * MM < verdict.before.largest < 4 * MM
    assert (verdict.after.stops, verdict.before.stops) == (59, 59)
    assert not verdict.after.backwards
    assert not verdict.after.unsettled


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("word", "by"), [("X", 0.1), ("Y", -0.1), ("Z", 0.1), ("A", 0.1), ("B", -0.1), ("C", 0.1)]
)
@pytest.mark.parametrize("line", [12, 40, 68])
def test_a_planted_fault_is_seen(tmp_path: Path, word: str, by: float, line: int) -> None:
    program, output = perfect(tmp_path)
    lines = output.read_bytes().decode().split("\r\n")
    assert lines[line].startswith("LIN")
    lines[line] = re.sub(rf"{word} ([-\d.]+)", lambda m: f"{word} {float(m[1]) + by:.7f}", lines[line])
    output.write_bytes("\r\n".join(lines).encode())
    after = judge(program, output, tmp_path / "cell.yaml").after
    if word in "XYZ":
        # along the feed a point between others moves nothing across it, but at the end of the cut
        assert after.largest > (0.05 if word != "X" or line == 68 else 0.0) * MM
        assert abs(after.worst_line - line - 1) <= 1 or word == "X"
    else:
        assert after.angle.max() > 0.09 * DEG


@pytest.mark.slow
def test_a_missing_point_and_one_that_stops_are_seen(tmp_path: Path) -> None:
    program, output = perfect(tmp_path)
    text = output.read_bytes().decode().split("\r\n")
    output.write_bytes("\r\n".join([*text[:40], *text[70:]]).encode())
    assert judge(program, output, tmp_path / "cell.yaml").after.largest > 0.05 * MM
    swapped = [*text[:40], text[42], text[41], text[40], *text[43:]]
    output.write_bytes("\r\n".join(swapped).encode())
    assert judge(program, output, tmp_path / "cell.yaml").after.backwards


def test_a_cut_that_ends_too_early_is_seen(tmp_path: Path) -> None:
    program, output = perfect(tmp_path)
    lines = output.read_bytes().decode().split("\r\n")
    output.write_bytes("\r\n".join([*lines[:60], *lines[69:]]).encode())
    after = judge(program, output, tmp_path / "cell.yaml").after
    assert after.distance.max() < 0.05 * MM
    assert after.largest > 20 * MM


@pytest.mark.slow
def test_an_edge_between_its_samples_is_seen(tmp_path: Path) -> None:
    """Where the arc meets the line the error falls by 1.3 um a um of the path.  Two rounds of further samples beside
    the largest ended 1.5 um below it; brute force finds 0.0276 mm or more, ``verify`` 0.0279."""
    program = lead_in(10, 0)(tmp_path)
    after = judge(
        program, Path(__file__).parent / "judge" / "edge_at_a_vertex.src", tmp_path / "cell.yaml"
    ).after
    assert after.largest == pytest.approx(0.0279 * MM, abs=1e-7)


# The cases

REPORTED = re.compile(r"pole BC \w+, lean 0|lead-in r 10|CIRC #CONSTANT|steps of|spline, SPL")
"""Cases that are not within the tolerance, which the command reports: corrections that change faster than motions of
one interpolation cycle can follow, poles of B and C, tools that keep their orientation, and what a controller does
between the points of a spline."""

EITHER = re.compile(r"lead-in r 25")
"""0.0199 and 0.0206 mm with vector units that round sums differently; beyond the tolerance it is reported."""

SLOW = re.compile(r"panel, forces x (0.5|2.5)|panel, tol|lean [1345679]$")
"""Cases that ``python -m tests.judge`` runs, and not the tests."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", [c for c in [*CASES, *FURTHER] if not SLOW.search(c.name)], ids=lambda c: c.name
)
def test_the_written_path(case: Case, tmp_path: Path) -> None:
    outcome = run(case, tmp_path)
    if REPORTED.match(case.name):
        assert outcome.failed, "as it should be now: take it out of REPORTED"
        assert outcome.exit == 3
    elif not (EITHER.match(case.name) and outcome.exit == 3):
        assert not outcome.failed, f"{outcome.failed} {outcome.message}"


@pytest.mark.slow
def test_verify_agrees_where_the_tool_may_be_at_two_places(tmp_path: Path) -> None:
    """The correction turns back at the corner, so that the path is square to the tool before and after it: the nearer
    of both counts, over all of the stretch on which there are two.  So does a search by brute force."""
    outcome = run(Case("corners against the force", against_the_force(0.02)), tmp_path, verify=True)
    assert outcome.exit == 3
    assert outcome.verdict is not None
    assert outcome.verify == pytest.approx(outcome.verdict.after.largest / MM, abs=1e-3)
    program, output = tmp_path / "part.src", tmp_path / "compensated" / "part.src"
    by_force, _, _ = third(program, output, tmp_path / "cell.yaml")
    assert outcome.verdict.after.largest == pytest.approx(by_force, abs=2e-7)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("build", "nearest", "most"), [(lead_in(10, 0), 0.020, 0.0213), (steps_of_force(), 0.0208, 0.0220)]
)
def test_what_no_points_hold_is_followed_as_near_as_they_can(
    tmp_path: Path, build: Callable[[Path], Path], nearest: float, most: float
) -> None:
    """From an arc into a line to the right: 0.043 mm by the points of the
    corner alone; where the force turns round: 0.036 mm.  No search found points that are nearer than ``nearest``.
    Judge, ``verify`` and the report say the same of them: 0.0279, 0.0279 and 0.0259 mm when the report's search
    for the place where the force turns ended early, and the points with it."""
    outcome = run(Case("followed", build), tmp_path, verify=True)
    assert outcome.exit == 3
    assert outcome.verdict is not None
    largest = outcome.verdict.after.largest / MM
    assert nearest < largest < most
    assert outcome.verify == pytest.approx(largest, abs=1e-3)
    reported = json.loads((tmp_path / "compensated" / "part.report.json").read_text())["path_error_mm"]
    assert reported["max"] == pytest.approx(largest, abs=1e-3)
