"""What is told of motions that come near to what the robot can do, word for word: of joints that are given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from motions import motions
from plant import kr270

import postproc.base.batches
from postproc.base.geometry import Poses
from postproc.compensation.axis_limits import check_limits
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision
from postproc.model import NOTHING, StiffnessModel
from postproc.process import Wrenches
from postproc.robot.axis_track import AxisTrack, is_near_singular, singular_words
from postproc.robot.description import load_robot
from postproc.robot.inverse import branch_of
from postproc.toolpath import Role

TOOL = Poses(np.eye(3), np.array([0.02, 0.0, 0.3]))
HOME = [0.0, -60.0, 90.0, 10.0, 45.0, 20.0]
"""[deg] far from all limits of the KR 270 and from singular postures."""

GANTRY = """\
name: gantry
geometry:
  source: made up, three slides and a wrist
  dh:
    unit: mm
    angle_unit: deg
    rows:
      - {a: 0, alpha: -90, d: 0, theta: 0}
      - {a: 0, alpha: 90, d: 0, theta: 90}
      - {a: 0, alpha: 0, d: 0, theta: 0}
      - {a: 0, alpha: -90, d: 0}
      - {a: 0, alpha: 90, d: 0}
      - {a: 0, alpha: 0, d: 100}
joints:
  source: made up
  unit: deg
  Z: {kind: prismatic, limits: [0, 2000], unit: mm, speed: 500}
  Y: {kind: prismatic, limits: [-1500, 1500], unit: mm, speed: 500}
  X: {kind: prismatic, limits: [0, 3000], unit: mm}
  A: [-180, 180]
  B: [-120, 120]
  C: [-180, 180]
"""


@pytest.fixture(scope="module")
def gantry(tmp_path_factory):
    path = tmp_path_factory.mktemp("robot") / "gantry.yaml"
    path.write_text(GANTRY)
    return load_robot(path)


def si(robot, values):
    """Joint values (N, n) [rad, m] from degrees and millimetres."""
    kinds = [joint.kind == "prismatic" for joint in robot.joints]
    return np.where(kinds, np.asarray(values, float) * 1e-3, np.radians(values))


def told(robot, before, after, source=None, moved=None, status=None, feed=None, lines=None, closed=True):
    """Findings as (code, line, message), and those of rows that are held, of motions that the program leads to
    ``before`` (N, n) and a correction to ``after`` (M, n), in degrees and millimetres."""
    before, after = si(robot, before), si(robot, after)
    n, m = len(before), len(after)
    model = StiffnessModel(robot, ())
    wanted, command = (robot.nominal_chain.flange(q) @ TOOL for q in (before, after))
    path = motions(wanted)
    path = path.with_columns(
        feed=path.feed if feed is None else np.broadcast_to(feed, n),
        line=path.line if lines is None else np.array(lines),
    )
    branch = branch_of(robot.nominal, before) if closed else np.zeros(n, np.int8)
    yes = np.ones(n, bool)
    tool = Poses(np.tile(TOOL.rotation, (n, 1, 1)), np.tile(TOOL.position, (n, 1)))
    world = Poses(np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)))
    force = Wrenches(np.zeros((n, 6)), np.zeros((n, 6)), ~yes, "test", (), ~yes)
    track = AxisTrack(before, branch if status is None else np.array(status), yes, yes, yes)
    task = CompensationProblem(
        "part.src", path, model, track, wanted, world, tool, force, NOTHING, True, 1.0, 1.0, 1e-3, 1e-2
    )
    none = np.full((m, 3), np.nan)
    division = Subdivision(
        np.arange(m) if source is None else np.array(source),
        np.full(m, Role.ORIGINAL),
        np.ones(m),
        command,
        none,
        none,
        none[:, 0],
        np.ones(m, bool) if moved is None else np.array(moved),
    )
    findings, held = check_limits(task, division)
    assert all(one.file == "part.src" for one in (*findings, *held.values()))
    return (
        [(one.code, one.line, one.message) for one in findings],
        {row: (one.code, one.line, one.message) for row, one in held.items()},
    )


def posed(**angles):
    """HOME with some axes elsewhere: A1=20."""
    return [angles.get(f"A{i + 1}", angle) for i, angle in enumerate(HOME)]


def near(name, left, count=1, unit="deg"):
    more = f" ({count} motions)" if count > 1 else ""
    return f"the correction moves {name} to {left} {unit} from its limit{more}"


# limits of the KR 270: A1 -185 .. 185, A2 -146 .. 0, A6 -350 .. 350


@pytest.mark.parametrize(
    ("before", "after", "left"),
    [
        (183.0, 184.4, "0.60"),
        (183.9, 184.01, "0.99"),
        (183.9, 183.99, None),
        (184.1, 184.4, None),  # it was near before
        (-183.0, -184.4, "0.60"),
        (-183.9, -183.99, None),
        (-184.4, -183.0, None),
        (184.4, 183.0, None),
        (0.0, 20.0, None),
        (183.0, 184.996, "0.00"),
    ],
)
def test_an_axis_that_comes_within_a_degree_of_its_limit(before, after, left):
    found, held = told(kr270(), [posed(A1=before)], [posed(A1=after)])
    assert found == ([("KIN008", 10, near("A1", left))] if left else [])
    assert not held


def test_of_all_motions_the_nearest_is_told_and_all_are_counted():
    before = [posed(), posed(A1=183), posed(), posed(A6=347), posed(A2=-3), posed(A1=183)]
    after = [posed(), posed(A1=184.5), posed(), posed(A6=349.8), posed(A2=-0.3), posed(A1=183.5)]
    found, _ = told(kr270(), before, after)
    assert found == [("KIN008", 13, near("A6", "0.20", 3))]
    # an axis each of one motion count once
    found, _ = told(kr270(), [posed(A1=183, A6=347)], [posed(A1=184.5, A6=349.2)])
    assert found == [("KIN008", 10, near("A1", "0.50"))]


@pytest.mark.parametrize("rows", [1, 2, 3, 100])
def test_what_is_worst_is_found_in_whatever_block_it_stands(monkeypatch, rows):
    monkeypatch.setattr(postproc.base.batches, "ROWS", rows)
    robot = with_speeds(kr270(), [10.0] + [np.nan] * 5)
    for place in range(5):
        before = [posed(A1=183.0, A5=5.0 + 0.01 * i) for i in range(5)]
        after = [posed(A1=184.1, A5=5.0 + 0.01 * i) for i in range(5)]
        after[place][0], after[place][4] = 184.6, 1.0
        found, held = told(robot, before, after, feed=1e-6)
        assert found == [
            ("KIN008", 10 + place, near("A1", "0.40", 5)),
            (
                "KIN003",
                10 + place,
                f"the corrected pose is close to a singularity ({singular_words(robot)})",
            ),
        ]
        assert not held


@pytest.mark.parametrize(
    ("after", "axis"),
    [
        ({"A1": 185.1}, "A1"),
        ({"A1": -185.1}, "A1"),
        ({"A1": 185.1, "A6": 350.2}, "A6"),
        ({"A1": 185.3, "A6": 350.2}, "A1"),
        ({"A1": 185.1, "A2": 0.5}, "A2"),
        ({"A1": 184.5, "A2": 0.5}, "A2"),  # beyond is not near
    ],
)
def test_a_motion_beyond_a_limit_holds_its_row(after, axis):
    """The axis that is farthest beyond; whatever else of it comes near to a limit."""
    edge = {"A1": 183.0, "A2": 2.0, "A6": 347.0}
    start = posed(**{name: np.copysign(edge[name], after[name]) if name != "A2" else -3.0 for name in after})
    found, held = told(
        kr270(), [posed(), start], [posed(), start, posed(**after), start], [0, 1, 1, 1], lines=[40, 50]
    )
    assert held == {1: ("COR008", 50, f"an inserted motion moves {axis} beyond its limit")}
    assert found == []


def test_only_motions_that_are_moved_and_known_are_looked_at():
    before, after = [posed(A1=183)] * 4, [posed(A1=184.5)] * 4
    robot = kr270()
    assert told(robot, before, after, moved=[False] * 4) == ([], {})
    found, _ = told(robot, before, after, moved=[False, False, True, True], status=[2, 2, 2, -1])
    assert found == [("KIN008", 12, near("A1", "0.50"))]


def test_a_motion_in_no_branch_is_not_looked_at():
    """Though its joints be known, and those of the branch with the highest number."""
    robot = kr270()
    before = [-129.0, -117.0, -1.0, 9.0, -76.0, 348.0]
    assert branch_of(robot.nominal, np.radians([before])).tolist() == [7]
    after = [[*before[:5], 349.5]]
    assert told(robot, [before], after)[0] == [("KIN008", 10, near("A6", "0.50"))]
    assert told(robot, [before], after, status=[-1]) == ([], {})


def test_a_posture_that_was_singular_before_is_no_news():
    robot = kr270()
    before = [posed(A5=angle) for angle in (5.0, 0.5, 5.0, 0.5, 5.0)]
    after = [posed(A5=angle) for angle in (4.0, 0.6, 0.8, 4.0, 0.7)]
    assert is_near_singular(robot, np.radians(before)).tolist() == [False, True, False, True, False]
    found, _ = told(robot, before, after)
    words = "the corrected pose is close to a singularity"
    assert found == [
        ("KIN003", 12, f"{words} (A5 near 0, the wrist over axis 1, or the arm stretched) (2 motions)")
    ]


def test_a_slide_near_to_its_limit(gantry):
    """Within five millimetres; and beyond it."""
    home = [500.0, 0.0, 1000.0, 10.0, 60.0, 20.0]

    def at(**values):
        return [values.get(joint.name, value) for joint, value in zip(gantry.joints, home, strict=True)]

    for start, end, left in ((6.0, 4.9, "4.90"), (6.0, 5.1, None), (4.9, 4.5, None)):
        found, held = told(gantry, [at(Z=start)], [at(Z=end)], closed=False)
        assert found == ([("KIN008", 10, near("Z", left, unit="mm"))] if left else [])
        assert not held
    found, _ = told(gantry, [at(A=170)], [at(A=179.5)], closed=False)
    assert found == [("KIN008", 10, near("A", "0.50"))]
    found, held = told(gantry, [at(Y=1494)], [at(Y=1500.5)], closed=False)
    assert held == {0: ("COR008", 10, "an inserted motion moves Y beyond its limit")}
    assert found == []


# speeds


def with_speeds(robot, degrees):
    """The robot with the fastest speeds [deg/s] of its axes."""
    speeds = [None if np.isnan(speed) else np.radians(speed) for speed in degrees]
    return replace(
        robot, axes=tuple(replace(axis, speed=s) for axis, s in zip(robot.axes, speeds, strict=True))
    )


def chord(robot, one, other):
    """[m] between the places of two poses."""
    return float(
        np.linalg.norm(np.diff((robot.nominal_chain.flange(si(robot, [one, other])) @ TOOL).position, axis=0))
    )


def fast(name, needed, can, count=1, unit="deg/s"):
    more = f" ({count} motions)" if count > 1 else ""
    return f"{name} needs {needed} {unit} at the programmed feed, its speed limit is {can} {unit}{more}"


@pytest.mark.parametrize("rows", [1, 2, 3, 100])
def test_the_axis_that_is_too_fast_is_found_in_whatever_block_it_moves(monkeypatch, rows):
    monkeypatch.setattr(postproc.base.batches, "ROWS", rows)
    robot = with_speeds(kr270(), [10.0] * 6)
    for first, second in (("A1", "A6"), ("A6", "A1")):
        path = [posed()]
        for name, step in ((first, 2.0), (second, 3.0), (first, 2.5), (second, 2.0)):
            path.append([angle + step * (axis == int(name[1]) - 1) for axis, angle in enumerate(path[-1])])
        feed = [np.nan, *(chord(robot, path[i], path[i + 1]) / 0.1 for i in range(4))]
        found, _ = told(robot, path, path, feed=feed)
        assert found == [("KIN009", 12, fast(second, "30.0", "10", 4))]


@pytest.mark.parametrize(("share", "said"), [(0.89, False), (0.91, True), (3.0, True), (0.0, False)])
def test_an_axis_that_needs_more_than_nine_tenths_of_its_speed(share, said):
    """A1 turns by 2 deg; at the feed it takes 2 / (share 12.5) seconds."""
    robot = with_speeds(kr270(), [12.5, np.nan, 100.0, np.nan, np.nan, 500.0])
    path = [posed(A1=0.0), posed(A1=2.0)]
    feed = chord(robot, *path) * share * 12.5 / 2.0
    found, _ = told(robot, path, path, feed=[1e3, feed])
    assert found == ([("KIN009", 11, fast("A1", f"{share * 12.5:.1f}", "12.5"))] if said else [])


def test_of_all_axes_and_motions_the_fastest_is_told():
    robot = with_speeds(kr270(), [10.0, 10.0, np.nan, np.nan, np.nan, 10.0])
    path = [posed(A1=0), posed(A1=-1), posed(A1=-1, A6=23), posed(A1=-2, A6=23), posed(A1=-3.5, A6=25.9)]
    seconds = 0.1
    feed = [np.nan, *(chord(robot, path[i], path[i + 1]) / seconds for i in range(4))]
    found, _ = told(robot, path, path, feed=feed)
    # A1: 10, 0, 10, 15 deg/s, A6: 0, 30, 0, 29
    assert [one[:2] for one in found] == [("KIN009", 12)]
    assert found[0][2] == fast("A6", "30.0", "10", 4)


def test_speeds_are_those_between_motions_that_follow_each_other():
    """Where one between them is not moved, has no feed, or no length, nothing is known."""
    robot = with_speeds(kr270(), [1.0] * 6)
    path = [posed(A1=angle) for angle in (0.0, 3.1, 6.1, 9.0)]
    assert [one[1] for one in told(robot, path, path, feed=1.0)[0]] == [11]
    assert "(3 motions)" in told(robot, path, path, feed=1.0)[0][0][2]
    assert told(robot, path, path, feed=1.0, moved=[True, False, True, False])[0] == []
    assert [one[1] for one in told(robot, path, path, feed=1.0, moved=[False, True, False, True])[0]] == []
    assert [one[1] for one in told(robot, path, path, feed=1.0, moved=[True, False, True, True])[0]] == [13]
    assert told(robot, path, path, feed=np.nan)[0] == []
    assert told(robot, path, path, feed=np.inf)[0] == []
    assert told(robot, path[:1], path[:1], feed=1.0)[0] == []
    assert [one[1] for one in told(robot, path, path, feed=[np.nan, np.nan, 1.0, np.nan])[0]] == [12]
    # A4 and A6 turn against each other about one line: hardly any way
    still = [posed(A4=0.0, A5=45.0), posed(A4=1e-5, A5=45.0)]
    tiny = chord(robot, *still)
    assert 1e-9 < tiny < 1e-6
    assert told(robot, still, still, feed=1.0)[0] == []
    longer = [still[0], posed(A4=1e-3, A5=45.0)]
    assert chord(robot, *longer) > 1e-6
    assert len(told(robot, longer, longer, feed=1.0)[0]) == 1


def test_a_slide_that_is_too_slow(gantry):
    path = [[500.0, 0.0, 1000.0, 10.0, 60.0, 20.0], [500.0, 30.0, 1040.0, 10.0, 60.0, 20.0]]
    found, _ = told(gantry, path, path, feed=0.8, closed=False)  # 50 mm, of which 30 along Y
    assert found == [("KIN009", 11, fast("Y", "480.0", "500", unit="mm/s"))]


def test_a_link_takes_the_feed_of_the_motion_that_it_belongs_to():
    robot = with_speeds(kr270(), [10.0] + [np.nan] * 5)
    before = [posed(A1=0.0), posed(A1=4.0)]
    after = [posed(A1=0.0), posed(A1=1.0), posed(A1=4.0)]
    slow = chord(robot, after[0], after[1]) * 1.0
    found, _ = told(robot, before, after, [0, 1, 1], feed=[1e3, slow])  # 1 deg/s, then 1 deg/s
    assert found == []
    found, _ = told(robot, before, after, [0, 1, 1], feed=[1e-6, 9.6 * slow], lines=[40, 50])
    assert found == [("KIN009", 50, fast("A1", "9.6", "10", 2))]
