"""Motions that turn the tool by half a turn: which way the axes go, and that a cut behind one is corrected.

The axes are followed here on their own: in small steps along the way that the track says, each from the one before.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from motions import motions
from path_cases import task as task_to
from plant import kr270

from postproc.base.geometry import Poses, abc_from_rotation, lengths, rotation_from_vector, turn_between
from postproc.base.units import DEG, MM
from postproc.compensation.correct import correct
from postproc.compensation.desired_path import DesiredPath
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.robot.axis_track import follow_axes, nominal_flange
from postproc.robot.half_turns import HALF, HalfTurns, TurnChoices, choose_senses
from postproc.robot.inverse import inverse
from postproc.toolpath import Kind

CLEAR = [10.0, -60.0, 80.0, 20.0, 45.0, 30.0]
TOOL = Poses(rotation_from_vector(np.array([0.0, 0.5, 0.0])), np.array([0.1, 0.0, 0.2]))


@pytest.fixture(scope="module")
def robot():
    return kr270()


def steps(**axes):
    """(N, 6) [rad]: a clear posture whose named axes go through the given degrees."""
    count = max(len(values) for values in axes.values())
    q = np.tile(CLEAR, (count, 1))
    for name, values in axes.items():
        q[:, int(name[1]) - 1] = values
    return q * DEG


def tracked(robot, q, start, nudge=0.0, **words):
    """The track of motions to the postures ``q``; ``nudge`` [rad] turns every flange about its own axis."""
    target = nominal_flange(robot, q)
    spin = rotation_from_vector(np.array([0.0, 0.0, nudge]))
    target = Poses(target.rotation @ spin, target.position)
    return follow_axes(robot, motions(target, **words), target, start)


def degrees(track, axis):
    return (track.q[:, axis] / DEG).round(6).tolist()


@pytest.mark.parametrize("nudge", [0.0, 1e-15, -1e-15, 1e-12, -1e-12])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_half_turn_stays_within_the_limits_whatever_rounding_says(robot, sign, nudge):
    q = steps(A6=[200.0, 380.0, 390.0]) * np.array([1, 1, 1, 1, 1, sign])
    track = tracked(robot, q, q[0], nudge, kind=[Kind.LIN, Kind.LIN, Kind.LIN])
    assert np.allclose(track.q[:, 5] / DEG, np.array([200, 20, 30]) * sign, atol=1e-6)
    assert track.within.all()


@pytest.mark.parametrize("nudge", [0.0, 1e-15, -1e-15, 1e-12, -1e-12])
@pytest.mark.parametrize("begin", [0.0, 180.0, -180.0, 90.0, -60.0])
def test_of_two_senses_that_both_go_the_result_does_not_depend_on_rounding(robot, begin, nudge):
    q = steps(A6=[begin, begin + 180.0, begin, begin + 180.0])
    track = tracked(robot, q, q[0], nudge)
    plain = tracked(robot, q, q[0])
    assert np.allclose(track.q, plain.q, atol=1e-9)
    assert track.within.all()
    assert np.abs(track.q[:, 5]).max() < 240.001 * DEG
    assert list(track.half_turns.rows) == [1, 2, 3]


@pytest.mark.slow
def test_chains_of_half_turns_stay_within_the_limits(robot):
    """Half turns and small turns by turns, 60,000 of them: one sense alone would leave the limits soon."""
    a6 = np.cumsum(np.tile([180.0, 7.0, -180.0, -7.0, 180.0, 0.0], 10_000)) + 170.0
    q = steps(A6=wrapped_degrees(a6))
    track = tracked(robot, q, steps(A6=[170.0])[0])
    assert track.within.all()
    # the short way between any two, half turns one way or the other
    step = np.abs(np.diff(np.concatenate([[170.0], track.q[:, 5] / DEG])))
    assert step.max() < 180.0 + 0.01


def wrapped_degrees(angle):
    return (np.asarray(angle) + 180.0) % 360.0 - 180.0


def test_a_half_turn_later_makes_room_for_what_comes_behind_it(robot):
    """Either sense of the half turn goes; only one leaves room for the turns that follow it."""
    for sign in (1, -1):
        q = steps(A6=[-90.0, 90.0, 190.0, 290.0, 340.0]) * np.array([1, 1, 1, 1, 1, sign])
        track = tracked(robot, q, q[0])
        assert track.within.all()
        assert degrees(track, 5) == [sign * a for a in (-90, 90, 190, 290, 340)]
        q = steps(A6=[-90.0, -270.0, -300.0, -345.0]) * np.array([1, 1, 1, 1, 1, sign])
        track = tracked(robot, q, q[0])
        assert track.within.all()


def test_what_states_its_axes_or_turns_ends_what_a_half_turn_decides(robot):
    q = steps(A6=[200.0, 20.0, 340.0, 160.0])
    track = tracked(robot, q, q[0], axes={2: q[2]})
    assert degrees(track, 5) == [200.0, 20.0, 340.0, 160.0]
    # A6 at -160 deg by its T, a half turn from there, and on
    q = steps(A6=[30.0, -160.0, 20.0, 30.0])
    kind = [Kind.LIN, Kind.PTP, Kind.LIN, Kind.LIN]
    track = tracked(robot, q, q[0], kind=kind, status=[-1, 2, -1, -1], turn=[-1, 0b100010, -1, -1])
    assert degrees(track, 5) == [30.0, -160.0, 20.0, 30.0]


def test_nothing_within_the_limits_is_told_as_it_is(robot):
    q = steps(A6=[200.0, 290.0, 380.0, 470.0])
    track = tracked(robot, q, q[0])
    assert degrees(track, 5) == [200.0, 290.0, 380.0, 470.0]
    assert track.within.tolist() == [True, True, False, False]


def test_a_turn_that_is_written_shorter_goes_the_short_way(robot):
    for off in (0.005, -0.005):
        q = steps(A6=[0.0, 180.0 - off])
        track = tracked(robot, q, q[0])
        assert degrees(track, 5)[1] == pytest.approx(180.0 - off if off > 0 else -180.0 - off, abs=1e-6)
    # and further from half a turn there is no choice, limits or not
    q = steps(A6=[200.0, 379.5])
    track = tracked(robot, q, q[0])
    assert degrees(track, 5)[1] == pytest.approx(379.5)
    assert track.within.tolist() == [True, False]
    assert not len(track.half_turns.rows)
    assert HALF < 0.5 * DEG


def test_a_ptp_by_half_a_turn_of_one_axis(robot):
    q = steps(A6=[200.0, 380.0, 390.0])
    track = tracked(robot, q, q[0], kind=[Kind.LIN, Kind.PTP, Kind.LIN])
    assert degrees(track, 5) == [200.0, 20.0, 30.0]
    assert not len(track.half_turns.rows)
    q = steps(A1=[100.0, 280.0])
    track = tracked(robot, q, q[0], kind=[Kind.LIN, Kind.PTP])
    assert degrees(track, 0) == [100.0, -80.0]


def densely(robot, track, target, tool, count=2000):
    """A1, A4, A6 at the end of the way from the first motion to the second, followed in small steps."""
    begin, end = (Poses(target.rotation[[k]], target.position[[k]]) @ tool for k in (0, 1))
    turn = turn_between(begin.rotation, end.rotation)
    track.half_turns.put(np.array([1]), turn)
    q = track.q[[0]]
    for share in np.linspace(0, 1, count + 1)[1:]:
        rotation = rotation_from_vector(share * turn) @ begin.rotation
        position = begin.position + share * (end.position - begin.position)
        q = inverse(robot.nominal, Poses(rotation, position) @ tool.inverse(), track.branch[[1]], q).q
    return q[0]


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(12))
def test_wide_turns_are_followed_on_their_way(robot, seed):
    """Random large turns of a tilted tool: the axes are those to which small steps along the way lead."""
    rng = np.random.default_rng(seed)
    first = np.radians(CLEAR) + rng.uniform(-0.4, 0.4, 6)
    begin = nominal_flange(robot, first[None]) @ TOOL
    axis = rng.normal(size=3)
    angle = rng.choice([np.pi, 0.98 * np.pi, 0.8 * np.pi])
    turn = rotation_from_vector(angle * axis / np.linalg.norm(axis))
    end = Poses(turn @ begin.rotation, begin.position + rng.uniform(-0.1, 0.1, (1, 3)))
    target = (
        Poses(np.concatenate([begin.rotation, end.rotation]), np.concatenate([begin.position, end.position]))
        @ TOOL.inverse()
    )
    tool = Poses(np.tile(TOOL.rotation, (2, 1, 1)), np.tile(TOOL.position, (2, 1)))
    track = follow_axes(robot, motions(target @ TOOL), target, first, None, tool)
    if not track.reachable.all():
        pytest.skip("out of reach")
    q = densely(robot, track, target, TOOL)
    if not np.isfinite(q).all():
        pytest.skip("the way is out of reach")
    assert np.allclose(q, track.q[1], atol=1e-6)


def test_the_wanted_way_turns_in_the_sense_of_the_axes(robot):
    """Half way between, A6 stands between its two ends."""
    for a6 in ([200.0, 380.0], [-200.0, -380.0], [0.0, 180.0]):
        q = steps(A6=a6)
        track = tracked(robot, q, q[0])
        target = nominal_flange(robot, q)
        path = motions(target)
        none = Poses(np.tile(np.eye(3), (2, 1, 1)), np.zeros((2, 3)))
        ways = DesiredPath.of(path, target, none, none, robot, track)
        middle = ways.at(np.array([1]), np.array([0.5]))
        between = 0.5 * (track.q[0] + track.q[1])
        expected = nominal_flange(robot, between[None])
        assert lengths(turn_between(middle.rotation, expected.rotation))[0] < 1e-6
        assert np.abs(middle.position - expected.position).max() < 1e-9


def test_the_wanted_way_turns_in_either_sense_that_it_is_told(robot):
    q = steps(A6=[0.0, 180.0])
    track = tracked(robot, q, q[0])
    target = nominal_flange(robot, q)
    none = Poses(np.tile(np.eye(3), (2, 1, 1)), np.zeros((2, 3)))
    for sign in (1, -1):
        vector = sign * track.half_turns.vector
        told = replace(track, half_turns=HalfTurns(track.half_turns.rows, vector))
        middle = DesiredPath.of(motions(target), target, none, none, robot, told).at(
            np.array([1]), np.array([0.5])
        )
        expected = rotation_from_vector(0.5 * vector) @ target.rotation[:1]
        assert np.abs(middle.rotation - expected).max() < 1e-9


def test_choices_are_the_best_of_all(robot):
    """Against all combinations of up to eight choices, with steps that make some impossible."""
    rng = np.random.default_rng(3)
    low, high = np.radians([-185.0, -350.0, -350.0]), np.radians([185.0, 350.0, 350.0])
    for _ in range(40):
        count = int(rng.integers(2, 9))
        place = np.sort(rng.choice(np.arange(1, 30), count, replace=False))
        value = np.cumsum(rng.normal(0, 0.6, (30, 3)) * [0.1, 0.3, 1.0], axis=0) + np.array([0.0, 0.0, 2.0])
        more = np.zeros((count, 3))
        more[:, 2] = rng.choice([-2 * np.pi, 2 * np.pi], count)
        value[:, 2] += np.cumsum(np.isin(np.arange(30), place) * np.pi * rng.choice([-1, 1], 30))

        def excess(take, place=place, more=more, value=value):
            here = value + np.cumsum(
                [more[place == k][0] * take[place == k][0] if k in place else np.zeros(3) for k in range(30)],
                axis=0,
            )
            worst = 0.0
            for a, b in zip([0, *place], [*place, 30], strict=True):
                part = here[a:b]
                over = np.maximum(part.max(0) - high, 0) + np.maximum(low - part.min(0), 0) if b > a else 0
                worst += np.sum(over)
            return worst

        found = choose_senses(value, np.array([0]), TurnChoices(place, more), low, high)
        every = [excess(np.array([bool(n >> k & 1) for k in range(count)])) for n in range(2**count)]
        assert excess(found) == pytest.approx(min(every), abs=1e-9)


CELL = """robot: kuka_kr270
tools:
  1: {x: 0, y: 0, z: 250, a: 0, b: 0, c: 0, axis: +z}
bases:
  1: {x: 1500, y: -200, z: 600, a: 0, b: 0, c: 0}
start: [0, -90, 90, 0, 45, 0]
"""


def program(a6: float, half: bool) -> list[str]:
    """A cut that begins with a LIN from a posture with A6 at ``a6``, which turns the tool by half a turn."""
    robot = kr270()
    q = np.radians([[0.0, -80.0, 110.0, 0.0, 60.0, a6]])
    base = Poses(np.eye(3), np.array([1.5, -0.2, 0.6]))
    tcp = base.inverse() @ nominal_flange(robot, q) @ Poses(np.eye(3), np.array([0.0, 0.0, 0.25]))
    turn = rotation_from_vector(np.array([0.0, 0.0, math.pi if half else 0.0]))
    x, y, z = (tcp.position[0] / MM).tolist()
    a, b, c = (abc_from_rotation(tcp.rotation[0] @ turn) / DEG).tolist()
    lines = [
        "DEF part()",
        "BAS(#INITMOV,0)",
        "$BASE=BASE_DATA[1]",
        "$TOOL=TOOL_DATA[1]",
        f"PTP {{A1 0,A2 -80,A3 110,A4 0,A5 60,A6 {a6}}}",
        "$VEL.CP=0.05",
    ]
    for k in range(6):
        if k == 2:
            lines.append(";FORCE -360 50 560 @base")
        lines.append(f"LIN {{X {x + 10 * k:.3f},Y {y:.3f},Z {z:.3f},A {a:.3f},B {b:.3f},C {c:.3f}}} C_DIS")
    return [
        *lines,
        ";FORCE OFF",
        f"LIN {{X {x:.3f},Y {y:.3f},Z {z + 50:.3f},A {a:.3f},B {b:.3f},C {c:.3f}}}",
        "END",
    ]


@pytest.mark.slow
@pytest.mark.parametrize("a6", [200, -200, 175, 0])
def test_a_cut_behind_a_half_turn_is_corrected(compensate, job, a6):
    job.cell(CELL)
    for half in (True, False):
        done = compensate(job.write(program(a6, half)), "--force", "--json", "-")
        assert done.code == 0, done.err
        assert done.json["corrected"] == 4
        assert done.json["error_after_mm"]["max"] < 0.01
        assert not [f for f in done.json["findings"] if f["code"] in ("KIN002", "KIN005", "COR008")]
        for left in job.folder.joinpath("compensated").iterdir():
            left.unlink()


def test_a_cut_that_turns_by_half_a_turn_is_corrected_in_parts():
    """The corrected ends of a half turn could lie nearer the other way round: a point in between says which way."""
    points = [[1.6, -0.1, 0.6], [1.6, -0.1, 0.5], [1.6, 0.1, 0.5], [1.6, 0.1, 0.6]]
    task = task_to(points, [False, False, True, False], tolerance=0.5e-3)
    rotation = task.toolpath.rotation.copy()
    rotation[2:] = rotation[2:] @ rotation_from_vector(np.array([0.0, 0.0, math.pi]))
    path = task.toolpath.with_columns(rotation=rotation)
    wanted = Poses(rotation, task.wanted.position)
    flange = wanted @ task.tool.inverse()
    track = follow_axes(
        task.model.robot, path, flange, np.radians([0.0, -90.0, 90.0, 0.0, 45.0, 0.0]), task.base, task.tool
    )
    assert 2 in track.half_turns.rows
    task = replace(task, toolpath=path, wanted=wanted, track=track, tolerance_angle=1.0)
    division = subdivide(task, correct(task), Limits(max_growth=10.0))
    own = np.flatnonzero(division.original)[2]
    assert division.source[own - 1] == 2
    turns = [
        lengths(turn_between(division.command[[k - 1]].rotation, division.command[[k]].rotation))[0]
        for k in (own - 1, own)
    ]
    assert max(turns) < 0.75 * np.pi
