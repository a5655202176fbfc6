"""What a correction says, word for word: every reason for which motions are left or a program is refused."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

import numpy as np
import pytest
from test_mirror import ALL, CARRIES, FIRST_LEFT, A, C, full, program_angles, switch, task

import postproc.base.batches
from postproc.base.findings import CODES, Finding, Refusal
from postproc.base.geometry import Poses
from postproc.compensation.correct import MotionOutcome, correct
from postproc.compensation.problem import CompensationProblem
from postproc.toolpath import Configuration, Kind

LEFT, OFF = MotionOutcome.UNCORRECTED, MotionOutcome.OFF
SECOND_LEFT = [A, C, C, C, A, LEFT, LEFT, LEFT, A]
BOTH_LEFT = [A, LEFT, LEFT, LEFT, A, LEFT, LEFT, LEFT, A]


def words(result):
    assert all(one.file == "part.src" for one in result.findings)
    return [(one.code, one.line, one.message, one.help) for one in result.findings]


def cut_left(first, last, reason, help=""):
    """What is told of a cut; the help is that of the reason, or of the reason's code."""
    code = reason.split(": ")[1][:6]
    return (
        "COR003",
        first,
        f"the cut of lines {first} to {last} (3 motions) is not corrected; {reason}",
        help or CODES[code].action,
    )


FIRST = (11, 13)
SECOND = (15, 17)


def lost(*rows):
    """A task whose targets of ``rows`` are not known."""
    job = task()
    position = job.wanted.position.copy()
    position[list(rows)] = np.nan
    return task(wanted=Poses(job.wanted.rotation, position))


def far(*rows, **more):
    """A task whose targets of ``rows`` are far out of reach."""
    wanted = task().wanted
    position = wanted.position.copy()
    position[list(rows)] += [3.0, 0.0, 0.0]
    return task(wanted=Poses(wanted.rotation, position), **more)


def standing(**degrees):
    """A task in which axis 1 of some rows stands beyond its limits: _2=185.5."""
    job = task(max_correction=10.0)
    q, within = job.track.q.copy(), np.ones(9, bool)
    for name, value in degrees.items():
        q[int(name[1:]), 0], within[int(name[1:])] = np.radians(value), False
    return replace(job, track=replace(job.track, q=q, within=within))


# before anything is computed


def test_targets_that_are_not_known():
    result = correct(lost(2))
    assert result.state.tolist() == FIRST_LEFT
    assert words(result) == [cut_left(*FIRST, "line 12: COR003 its target is not known")]
    # the place is that of the first of them, in every cut that has one
    result = correct(lost(3, 5, 6))
    assert result.state.tolist() == BOTH_LEFT
    assert words(result) == [
        cut_left(*FIRST, "line 13: COR003 its target is not known"),
        cut_left(*SECOND, "line 15: COR003 its target is not known"),
    ]
    assert words(correct(lost(0, 4))) == []


ONE, OTHER = Finding("KRL007", "one", help="do this"), Finding("KRL008", "other", help="do that")


@pytest.mark.parametrize(
    ("pinned", "refused", "told"),
    [
        ({1: ONE}, {}, ["line 11: KRL007 one", "do this"]),
        ({}, {3: OTHER}, ["line 13: KRL008 other", "do that"]),
        ({2: ONE}, {2: OTHER}, ["line 12: KRL008 other", "do that"]),
        ({2: ONE}, {3: OTHER}, ["line 12: KRL007 one", "do this"]),
        ({0: ONE}, {4: OTHER}, None),
    ],
)
def test_motions_that_their_text_holds(pinned, refused, told):
    result = correct(task(locked=pinned, refused=refused))
    assert words(result) == ([cut_left(*FIRST, *told)] if told else [])


def test_axes_beyond_their_limits():
    limits = "beyond its limits -185 .. 185 deg"
    result = correct(standing(_2=185.54))
    assert result.state.tolist() == FIRST_LEFT
    words_ = f"A1 is at 185.5 deg, {limits}"
    assert words(result) == [("KIN002", 12, words_, ""), cut_left(*FIRST, f"line 12: KIN002 {words_}")]
    result = correct(standing(_3=-186.0, _6=188.0))
    assert result.state.tolist() == BOTH_LEFT
    words_ = f"A1 is at -186.0 deg, {limits}"
    assert words(result) == [
        ("KIN002", 13, words_ + " (2 motions, to line 16)", ""),
        cut_left(*FIRST, f"line 13: KIN002 {words_}"),
        cut_left(*SECOND, f"line 16: KIN002 {words_}"),
    ]
    # in air they are told and hinder nothing
    result = correct(standing(_4=187.0))
    assert result.state.tolist() == ALL
    assert words(result) == [("KIN005", 14, f"A1 is at 187.0 deg, {limits}", "")]
    result = correct(standing(_0=187.0, _8=186.0))
    assert words(result) == [("KIN005", 10, f"A1 is at 187.0 deg, {limits} (2 motions, to line 18)", "")]


def test_the_axis_that_is_farthest_beyond_is_told():
    q = program_angles()
    q[1] = np.radians([186.0, 2.5, 110.0, 10.0, 127.0, 352.25])
    for axis, said in (
        (1, "A2 is at 2.5 deg, beyond its limits -146 .. 0 deg"),
        (5, "A6 is at 352.2 deg, beyond its limits -350 .. 350 deg"),
        (4, "A5 is at 127.0 deg, beyond its limits -125 .. 125 deg"),
        (0, "A1 is at 186.0 deg, beyond its limits -185 .. 185 deg"),
    ):
        job = task(program_angles(), max_correction=1.0)
        job = replace(job, track=replace(job.track, q=q, within=np.arange(9) != 1))
        assert words(correct(job))[0] == ("KIN002", 11, said, "")
        q[1, axis] = program_angles()[1, axis]  # the next time another one is


def test_poses_out_of_reach():
    said = "the programmed pose is out of reach"
    assert words(correct(far(4))) == [("KIN005", 14, said, "")]
    assert words(correct(far(0, 4, 8))) == [("KIN005", 10, said + " (3 motions, to line 18)", "")]
    # of an absolute correction air is a cut of its own, and left
    result = correct(far(0, 4, process=False))
    assert result.state.tolist() == [LEFT, C, C, C, LEFT, C, C, C, C]
    assert result.cut.tolist() == [0, 1, 1, 1, 2, 3, 3, 3, 4]
    single = "the cut of lines {0} to {0} (1 motions) is not corrected; line {0}: KIN005 " + said
    assert words(result) == [
        ("KIN005", 10, said + " (2 motions, to line 14)", ""),
        ("COR003", 10, single.format(10), CODES["KIN005"].action),
        ("COR003", 14, single.format(14), CODES["KIN005"].action),
    ]
    for row in (1, 2, 5, 7):
        assert refusal(far(row)) == (
            "KIN001",
            10 + row,
            said,
            "check the base, the tool and the robot of the cell against the program",
        )
    assert refusal(far(3, 4, 6))[1:3] == (13, said + " (2 motions, to line 16)")
    # what is switched off, or held for another reason, is not asked for
    job = far(2, annotations=switch((0, "COMPENSATE OFF"), (4, "COMPENSATE ON")))
    assert words(correct(job)) == []
    assert [one[0] for one in words(correct(far(2, refused={2: ONE})))] == ["COR003"]


def refusal(job):
    with pytest.raises(Refusal) as caught:
        correct(job)
    (one,) = caught.value.findings
    assert one.file == "part.src"
    return one.code, one.line, one.message, one.help


def test_a_configuration_that_is_not_known():
    said = "the robot's configuration is not known here"
    help_ = "add `start:` (axes before the first motion) to the cell, or state S and T in the PTP before it"
    assert refusal(task(start=False)) == ("KIN004", 11, said + " (6 motions, to line 17)", help_)
    job = task(start=False, axes={4: program_angles()[4]})
    assert refusal(job) == ("KIN004", 11, said + " (3 motions, to line 13)", help_)
    job = task(start=False, refused={1: ONE, 2: ONE, 5: ONE, 6: ONE, 7: ONE})
    assert refusal(job) == ("KIN004", 13, said, help_)


def test_a_correction_that_is_too_large():
    job = task()
    size = np.linalg.norm(correct(job).correction, axis=1)
    rows = np.flatnonzero(size > 0)
    for row in rows:
        limit = (1 - 1e-5) * size[row]
        above = np.flatnonzero(size > limit)
        more = "" if len(above) == 1 else f" ({len(above)} motions, to line {10 + above[-1]})"
        assert refusal(replace(job, max_correction=limit)) == (
            "COR002",
            10 + above[0],
            f"the correction is {1e3 * size.max():.2f} mm, which exceeds max_correction ({1e3 * limit:g} mm){more}",
            "check force, base and tool; raise max_correction in the cell if the correction is intended",
        )
    assert not correct(replace(job, max_correction=(1 + 1e-5) * size.max())).findings
    half = replace(job, gain=0.5, max_correction=0.50001 * size.max())
    assert not correct(half).findings


@pytest.mark.parametrize(
    ("rows", "left", "line"),
    [
        ((2, 3), "111000", 11),
        ((1, 3), "111000", 13),
        ((3, 9), "111111", 11),
        ((6, 7), "000111", 15),
        ((0, 6), "000111", 16),
    ],
)
def test_switching_inside_of_a_cut(rows, left, line):
    job = task(annotations=switch((rows[0], "COMPENSATE OFF"), (rows[1], "COMPENSATE ON")))
    result = correct(job)
    said = [one for one in words(result) if one[0] == "COR003"]
    place = FIRST if left[0] == "1" else SECOND
    assert said == [cut_left(*place, f"line {line}: COR004 COMPENSATE is switched inside this cut")]
    assert words(result) == said
    off = [row for row in range(9) if rows[0] <= row < rows[1]]
    for k, row in enumerate(np.flatnonzero(CARRIES)):
        expected = OFF if row in off else LEFT if left[k] == "1" else C
        assert result.state[row] == expected


def test_a_comment_that_is_no_switch_is_told():
    result = correct(task(annotations=switch((2, "COMPENSATE MAYBE"))))
    assert result.state.tolist() == ALL
    assert words(result) == [
        ("COR011", 12, "'COMPENSATE MAYBE' is neither COMPENSATE OFF nor COMPENSATE ON; it is ignored", "")
    ]


# what a correction is found to do


@dataclass(frozen=True)
class Made(CompensationProblem):
    """A task of which some corrections end as they are told to: row -> what is false, the angle of axis 1 [deg] or of
    another, or which limit axis 1 is at."""

    ends: dict = field(default_factory=dict)

    def command(self, rows, *given, **more):
        done = super().command(rows, *given, **more)
        flags = {name: getattr(done, name).copy() for name in ("reachable", "settled", "converged", "q")}
        for k, row in enumerate(rows.tolist()):
            for end in self.ends.get(row, ()):
                if end in flags:
                    flags[end][k] = False
                elif end in ("low", "high"):
                    flags["q"][k, 0] = self.model.robot.limits[0, int(end == "high")]
                else:
                    axis, angle = end if isinstance(end, tuple) else (0, end)
                    flags["q"][k, axis] = np.radians(angle)
        return replace(done, **flags)


def made(ends, **more):
    job = task(**more)
    return Made(**{one.name: getattr(job, one.name) for one in fields(CompensationProblem)}, ends=ends)


REACH, REST, SETTLE = (
    ("COR009", "the corrected pose is out of reach"),
    ("MOD002", "the robot has no equilibrium under this force"),
    ("COR001", "the correction does not converge"),
)


def beyond(angle):
    return (
        "COR008",
        f"the corrected pose exceeds the limits: A1 is at {angle} deg, beyond its limits -185 .. 185 deg",
    )


U, S, N = ("reachable", "converged"), ("settled", "converged"), ("converged",)


@pytest.mark.sample(16)
@pytest.mark.parametrize(
    ("ends", "told", "reasons"),
    [
        ({1: U}, [(REACH, 11, "")], {FIRST: (11, REACH)}),
        ({2: S}, [(REST, 12, "")], {FIRST: (12, REST)}),
        ({3: N}, [(SETTLE, 13, "")], {FIRST: (13, SETTLE)}),
        ({5: (185.25,)}, [(beyond("185.2"), 15, "")], {SECOND: (15, beyond("185.2"))}),
        ({5: (-185.26,)}, [(beyond("-185.3"), 15, "")], {SECOND: (15, beyond("-185.3"))}),
        ({5: (184.99,), 6: (-184.99,)}, [], {}),
        ({5: ("high",), 6: ("low",)}, [], {}),
        # what comes first counts, of one motion and of a cut
        (
            {1: (*U, *S, 190.0), 2: (*S, 191.0), 3: (*N, 192.0)},
            [(REACH, 11, ""), (REST, 12, ""), (SETTLE, 13, "")],
            {FIRST: (11, REACH)},
        ),
        # an axis is told of a correction that settles
        (
            {5: (*N, 190.0), 6: (186.0,)},
            [(SETTLE, 15, ""), (beyond("186.0"), 16, "")],
            {SECOND: (15, SETTLE)},
        ),
        ({3: U, 2: N, 1: S}, [(REACH, 13, ""), (REST, 11, ""), (SETTLE, 12, "")], {FIRST: (11, REST)}),
        (
            {1: U, 3: U, 6: U, 7: N},
            [(REACH, 11, " (3 motions, to line 16)"), (SETTLE, 17, "")],
            {FIRST: (11, REACH), SECOND: (16, REACH)},
        ),
        (
            {2: (186.0,), 5: (187.0,), 6: (188.0,)},
            [(beyond("186.0"), 12, " (3 motions, to line 16)")],
            {FIRST: (12, beyond("186.0")), SECOND: (15, beyond("186.0"))},
        ),
    ],
)
@pytest.mark.parametrize("size", [1, 2, 4, 100])
def test_corrections_that_do_not_end_well(monkeypatch, size, ends, told, reasons):
    monkeypatch.setattr(postproc.base.batches, "ROWS", size)
    result = correct(made(ends))
    expected = [(code, line, message + more, "") for (code, message), line, more in told]
    for cut, (line, (code, message)) in reasons.items():
        expected.append(cut_left(*cut, f"line {line}: {code} {message}"))
    assert words(result) == expected
    left = [rows for rows, cut in ((range(1, 4), FIRST), (range(5, 8), SECOND)) if cut in reasons]
    state = np.array(ALL)
    for rows in left:
        state[list(rows)] = LEFT
    assert result.state.tolist() == state.tolist()
    for rows in left:
        np.testing.assert_array_equal(result.after[list(rows)], result.before[list(rows)])
        np.testing.assert_array_equal(result.after_angle[list(rows)], result.before_angle[list(rows)])
        assert not result.correction[list(rows)].any()
    assert (np.linalg.norm(result.correction[result.state == C], axis=1) > 1e-4).all()


SIDES = "the target has a Status/Turn mismatch: the corrected pose is on the other side of an axis angle"
KINDS = [Kind.LIN, Kind.PTP, Kind.PTP, Kind.LIN, Kind.LIN, Kind.PTP, Kind.LIN, Kind.PTP, Kind.LIN]
STATED = {"kind": KINDS, "status": 2, "turn": 2, "max_correction": 10.0}


@pytest.mark.parametrize(
    ("ends", "told", "reasons"),
    [
        ({}, [], {}),
        ({1: (-5.0,)}, [(11, "")], {FIRST: 11}),
        ({3: (-5.0,), 6: (-5.0,)}, [], {}),  # no PTP
        (
            {7: (-5.0,), 2: (-5.0,), 5: (-5.0,)},
            [(12, " (3 motions, to line 17)")],
            {FIRST: 12, SECOND: 15},
        ),
        ({5: (-5.0,), 2: (5.0,)}, [(15, "")], {SECOND: 15}),
        ({5: ((4, -50.0),)}, [(15, "")], {SECOND: 15}),  # S and T
    ],
)
def test_sides_that_are_crossed(ends, told, reasons):
    """S 2 and T 2 are what the program says; turned back A1 stands on the other side of zero: a whole turn away."""
    expected = [("KIN006", line, SIDES + more, "") for line, more in told]
    expected += [cut_left(*cut, f"line {line}: KIN006 {SIDES}") for cut, line in reasons.items()]
    assert words(correct(made(ends, **STATED))) == expected


def test_the_first_reason_counts():
    result = correct(made({1: (-5.0,), 3: N, 7: (-5.0,)}, **STATED))
    assert [one[:2] for one in words(result)] == [
        ("COR001", 13),
        ("KIN006", 11),
        ("COR003", 11),
        ("COR003", 15),
    ]


@pytest.mark.parametrize(("status", "turn"), [(2, -1), (-1, 2), (-1, -1)])
def test_axes_have_no_side_where_no_turn_is_stated(status, turn):
    result = correct(made({2: (-5.0,)}, **{**STATED, "status": status, "turn": turn}))
    assert [one.code for one in result.findings] == (["KIN006", "COR003"] if turn > 0 else [])


@pytest.mark.parametrize("kind", [Kind.PTP, Kind.LIN])
def test_another_quadrant_is_reported_and_corrected(kind):
    """A1 of 5 deg is in quadrant 0, of -5 in -1."""
    job = made({2: (-5.0,)}, kind=kind)
    stated = Configuration({"quadrants": np.full(9, 505050)}).for_motions(9)
    result = correct(replace(job, toolpath=replace(job.toolpath, configuration=stated)))
    assert [(one.code, one.line) for one in result.findings] == [("KIN013", 12)]
    assert result.state[2] == C


@pytest.mark.parametrize(("angle", "told"), [(185.0, True), (-5.0, False)])
def test_another_turn_than_that_of_config(angle, told):
    job = made({2: (angle,)}, kind=Kind.PTP)
    limits = tuple(replace(one, lower=-9.0, upper=9.0) for one in job.model.robot.joints)
    job = replace(job, model=replace(job.model, robot=replace(job.model.robot, joints=limits)))
    stated = Configuration({"revolutions": np.full(9, 7)}).for_motions(9)
    result = correct(replace(job, toolpath=replace(job.toolpath, configuration=stated)))
    assert [one.code for one in result.findings] == ["KIN006", "COR003"] * told


ABOVE = [5.0, 10.0, 110.0, 10.0, 50.0, 20.0]
"""[deg] every axis is at zero or above: T 0; and S 0 where the arm is bent the other way."""


@pytest.mark.parametrize(
    ("status", "turn", "elbow", "told"),
    [(-1, 0, 110.0, True), (-1, -1, 110.0, False), (0, -1, -10.0, False), (0, 2, -10.0, True)],
)
def test_a_number_of_zero_is_said_too(status, turn, elbow, told):
    model = full()
    robot = model.robot
    joints = tuple(replace(one, upper=max(one.upper, 0.5)) for one in robot.joints)
    model = replace(model, robot=replace(robot, joints=joints))
    q = np.tile(np.radians([*ABOVE[:2], elbow, *ABOVE[3:]]), (9, 1))
    q[:, 1] = np.radians(10.0 if elbow > 0 else -60.0)
    given = {"q": q, "model": model, "kind": Kind.PTP, "status": status, "turn": turn, "max_correction": 10.0}
    result = correct(made({2: (-5.0,)}, **given))
    assert [one.code for one in result.findings] == ["KIN006", "COR003"] * told


def test_postures_near_to_a_singular_one():
    said = "A5 near 0, the wrist over axis 1, or the arm stretched"
    for rows, more in (([6], ""), ([2, 6, 7], " (3 motions, to line 17)")):
        q = program_angles()
        q[rows, 4] = np.radians(0.9)
        assert words(correct(task(q))) == [("KIN003", 10 + rows[0], said + more, "")]
    q = program_angles()
    q[[0, 4], 4] = np.radians(0.9)
    assert words(correct(task(q))) == []  # in air
    # told whether it is corrected or not
    q[3, 4] = np.radians(0.9)
    assert [one[:2] for one in words(correct(task(q, refused={1: ONE})))] == [("COR003", 11), ("KIN003", 13)]


# cuts and states


def test_of_a_program_without_force_there_is_no_history():
    result = correct(task(carries=np.zeros(9, bool)))
    assert result.history.shape == (1, 9)
    assert np.isnan(result.history).all()
    assert not result.iterations.any()


def test_cuts_of_an_absolute_correction():
    """A run of forced motions is one, every other motion is one by itself; an unknown target is in none."""
    result = correct(replace(lost(4), process=False))
    assert result.cut.tolist() == [0, 1, 1, 1, -1, 2, 2, 2, 3]
    assert result.state.tolist() == [C, C, C, C, A, C, C, C, C]
    assert words(result) == []
    forced = np.array([0, 0, 1, 1, 0, 0, 1, 0, 1], bool)
    result = correct(task(carries=forced, process=False, refused={0: ONE, 3: OTHER, 7: ONE}))
    assert result.cut.tolist() == [0, 1, 2, 2, 3, 4, 5, 6, 7]
    assert result.state.tolist() == [LEFT, C, LEFT, LEFT, C, C, C, LEFT, C]
    assert [(one.code, one.line) for one in result.findings] == [
        ("COR003", 10),
        ("COR003", 12),
        ("COR003", 17),
    ]


def test_motions_that_do_not_follow_are_another_cut():
    runs = np.arange(9) != 3
    result = correct(task(continues=runs, predecessors={3: (0, 2)}, refused={2: ONE}))
    assert result.cut.tolist() == [-1, 0, 0, 1, -1, 2, 2, 2, -1]
    assert result.state.tolist() == [A, LEFT, LEFT, C, A, C, C, C, A]
