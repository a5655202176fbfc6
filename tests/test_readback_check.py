"""What was read back is held to what was meant: each thing that is looked at is changed once, and refused."""

from __future__ import annotations

from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np
import pytest
from conftest import CELL, JUMPED_LINES, LINES

import postproc.output.write as writing_module
from postproc.base.document import Document
from postproc.base.findings import Refusal
from postproc.base.geometry import PoseRows, Poses
from postproc.base.units import DEG, MM
from postproc.output.readback_check import check_readback, check_residual
from postproc.toolpath import Configuration, FrameRef

BLOCKS = [
    "%", "(PART)", "G21 G90 G17 G94", "G54", "T1 M6", "G0 X0 Y0 Z50", "G0 Z0", "F3000",
    "(FORCE -360 50 560 @base)", "G1 X100 Y0 Z-2", "X300", "G3 X350 Y50 I0 J50", "G1 Y250", "(FORCE OFF)",
    "(and back)", "G0 Z50", "G0 X0", "M30", "%",
]  # fmt: skip


@dataclass
class Seen:
    """What a run gives to ``hold`` and to ``hold_residual``."""

    held: list[Any]
    residual: list[Any]

    def hold(self, **of_back: object) -> None:
        check_readback(*self.held[:5], self.held[5].with_columns(**of_back), self.held[6])

    def column(self, name: str, at: object, value: object) -> None:
        """Holds with one value of a column changed, of the toolpath or of a part of it (``arcs.sweep``)."""
        part, _, column = name.rpartition(".")
        stated = self.path.configuration
        values = np.array(stated[column] if part == "configuration" else attrgetter(name)(self.path))
        values[at] = value
        changed = {column: values}
        if part == "configuration":
            self.hold(configuration=Configuration({**stated.numbers, **changed}))
        else:
            self.hold(**({part: replace(getattr(self.path, part), **changed)} if part else changed))

    def residual_with(self, division=None, **of_result: object) -> None:
        task, planned, result, made, *rest = self.residual
        check_residual(task, planned, replace(result, **of_result), division or made, *rest)

    def with_task(self, **of_task: object) -> None:
        check_residual(replace(self.residual[0], **of_task), *self.residual[1:])

    @property
    def path(self):
        return self.held[5]


@pytest.fixture
def seen(compensate, job, monkeypatch):
    """Runs a program; what was given to the checks."""
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\n")

    def run(lines: list[str], name: str = "part.src", *words: str) -> Seen:
        found: dict[str, list[Any]] = {}

        def noting(check, key):
            def noted(*given):
                found[key] = list(given)
                check(*given)

            return noted

        monkeypatch.setattr(writing_module, "check_readback", noting(check_readback, "held"))
        monkeypatch.setattr(writing_module, "check_residual", noting(check_residual, "residual"))
        done = compensate(job.write(lines, name=name), "--force", *words)
        assert done.code in (0, 3), done.err
        return Seen(found["held"], found["residual"])

    return run


@pytest.fixture
def krl(seen) -> Seen:
    return seen([*JUMPED_LINES[:5], ";a remark", *JUMPED_LINES[5:]])


@pytest.fixture
def blocks(seen) -> Seen:
    return seen(BLOCKS, "part.ngc")


def refuses(words: str, call, *given, code: str = "FIL008", **named) -> None:
    with pytest.raises(Refusal) as refusal:
        call(*given, **named)
    (finding,) = refusal.value.findings
    assert finding.code == code
    assert words in finding.message


@pytest.mark.slow
def test_as_it_was_read_back_it_holds(krl, blocks):
    for one in (krl, blocks):
        one.hold()
        one.residual_with()


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "value"),
    [("approximation", 0.5), ("continues", False), ("feed", 9.0), ("configuration.status", 5),
     ("configuration.turn", 5), ("base", 7), ("tool", 7), ("inverse_time_feed", True), ("kind", 5)],
)  # fmt: skip
def test_what_a_motion_says_beside_its_target(krl, blocks, name, value):
    for one, last in ((krl, 5), (blocks, 6)):
        refuses(
            f"the {name.rpartition('.')[2].replace('_', ' ')} of a motion differs from the plan",
            one.column,
            name,
            last,
            value,
        )


def test_whether_a_motion_stops(krl, blocks):
    for one, last in ((krl, 5), (blocks, 6)):
        refuses("the stops of a motion differs", one.column, "stops", last, not one.path.stops[last])


def test_an_inserted_motion_stops_only_where_its_source_does(krl):
    division = krl.held[2]
    (link,) = np.flatnonzero(division.transitions)[:1]
    krl.column("stops", link, True)  # it leads from the air into the cut
    # the same one between two motions under force
    task = krl.held[0]
    force = replace(task.force, carries=np.ones(len(task.toolpath), bool))
    assert not krl.path.stops[link + 1]
    again = Seen([replace(task, force=force), *krl.held[1:]], krl.residual)
    refuses("stops where the program does not", again.column, "stops", link, True)


def test_whether_the_text_gives_the_orientation(krl, blocks):
    refuses(
        "the orientation programmed of a motion differs",
        krl.column,
        "constraints.orientation_programmed",
        5,
        False,
    )
    refuses(
        "the orientation programmed of a motion differs",
        blocks.column,
        "constraints.orientation_programmed",
        6,
        True,
    )


def test_no_component_of_a_target_is_lost(krl):
    for name, at in (("position", (4, 2)), ("rotation", (4, 1, 2))):
        refuses("targets differ from the plan", krl.column, name, at, np.nan)
    refuses("targets differ from the plan", krl.column, "position", (0, 1), 0.0)  # of an axis motion


def test_half_a_step_is_all_that_a_number_may_be_beside(krl):
    there = krl.path.position[4]
    krl.column("position", 4, there)
    refuses("off the plan", krl.column, "position", 4, there + 1.1e-3 * MM)
    turned = Poses.from_abc(np.zeros(3), np.array([0.1, 0.0, 0.0]) * DEG).rotation @ krl.path.rotation[4]
    refuses("deg off the plan", krl.column, "rotation", 4, turned)


def test_air_stays_in_its_place_whatever_the_division_says(krl):
    """A motion that is not corrected is held to where the program has it; one that is, to its correction."""
    task, result, division, *rest = krl.held
    air = int(np.flatnonzero(division.original & ~result.corrected[division.source])[-1])
    cut = int(np.flatnonzero(division.original & result.corrected[division.source])[0])
    moved = division.moved.copy()
    moved[air], moved[cut] = True, False
    check_readback(task, result, replace(division, moved=moved), *rest)  # what was written is right
    refuses("off the plan", krl.column, "position", air, krl.path.position[air] + 0.1 * MM)
    uncorrected = task.toolpath.position[division.source[cut]]
    refuses("off the plan", krl.column, "position", cut, uncorrected)


def test_every_motion_stands_in_its_own_line(krl, blocks):
    for one in (krl, blocks):
        division = one.held[2]
        link = int(np.flatnonzero(division.transitions)[0])
        for motion in (0, link, link + 1, len(division) - 1):
            for step in (-1, 1):
                refuses("not in its own line", one.column, "line", motion, one.path.line[motion] + step)


def test_lines_are_as_many_as_inserted_motions_and_the_mark(krl):
    task, result, division, program, again, *rest = krl.held
    more = Document(again.documents[0].path, again.documents[0].raw + b"\n")
    given = task, result, division, program, replace(again, documents=(more,)), *rest
    refuses("inserted motions occupy", check_readback, *given)
    refuses(
        "inserted motions occupy",
        check_readback,
        task,
        result,
        division,
        program,
        replace(again, marker=None),
        *rest,
    )


def test_comments_and_what_speaks_to_this_tool_stay(krl, blocks):
    for one in (krl, blocks):
        for name in ("annotations", "comments"):
            said = getattr(one.path, name)
            assert said
            refuses("comments differ from the program", one.hold, **{name: said[:-1]})
            refuses(
                "comments differ from the program",
                one.hold,
                **{name: (*said[:-1], replace(said[-1], text="FORCE 1 2 3"))},
            )
            refuses(
                "comments differ from the program",
                one.hold,
                **{name: (*said[:-1], replace(said[-1], line=said[-1].line + 1))},
            )


def test_frames_stay(seen):
    one = seen([line.replace("BASE_DATA[1]", "{X 1500,Y -200,Z 600,A 0,B 0,C 0}") for line in LINES])
    frames = one.path.frames
    at = next(k for k, frame in enumerate(frames) if frame.pose is not None)
    pose = frames[at].pose
    other = FrameRef(frames[at].number, Poses(pose.rotation, pose.position + 1e-6), frames[at].line)
    for changed in (other, FrameRef(3, None, 3)):
        refuses(
            "a frame differs from the program", one.hold, frames=(*frames[:at], changed, *frames[at + 1 :])
        )
    refuses("other frames", one.hold, frames=(*frames, other))


def test_arcs_go_through_the_middle_that_was_meant(blocks):
    division = blocks.held[2]
    arc = int(np.flatnonzero(np.isfinite(division.sweep))[0])
    refuses("off the planned arc", blocks.column, "arcs.sweep", arc, blocks.path.arcs.sweep[arc] + np.pi)
    refuses("the arcs differ", blocks.column, "arcs.sweep", arc, np.nan)


def test_corrections_are_those_that_were_planned(krl):
    result = krl.residual[2]
    row = int(np.flatnonzero(result.corrected)[0])
    for beside in (0.002 * MM, -0.002 * MM, np.nan):
        correction = result.correction.copy()
        correction[row, 1] += beside
        refuses("off the plan", krl.residual_with, correction=correction)


def test_no_correction_is_larger_than_allowed_as_it_was_read_back(krl):
    task, _, result, division, *_ = krl.residual
    size = np.linalg.norm(result.correction[result.corrected], axis=1).max()
    krl.with_task(max_correction=size)
    refuses("exceeds max_correction", krl.with_task, max_correction=0.99 * size, code="COR002")
    # inserted motions too: from the begin of the way that they lead to
    link = int(np.flatnonzero(division.transitions)[-1])
    for mm, allowed in ((9.0, True), (11.0, False)):
        begin = task.desired_path.start[division.source[[link]]]
        there = division.command[np.arange(len(division))].copy()
        there.position[link] = begin.position[0] + [0.0, 0.0, mm * MM]
        made = replace(division, command=PoseRows(len(there), lambda rows, there=there: there[rows]))
        if allowed:
            krl.residual_with(made)
        else:
            refuses("11.00 mm and exceeds max_correction (10 mm)", krl.residual_with, made, code="COR002")


def test_nothing_is_brought_further_off(krl):
    task, _, result, *_ = krl.residual
    row = int(np.flatnonzero(result.corrected)[-1])
    for name, limit in (("after", task.tolerance), ("after_angle", task.tolerance_angle)):
        before = getattr(result, name.replace("after", "before"))[row]
        for value, good in (
            (before + 0.9 * limit, True),
            (before + 1.1 * limit, False),
            (np.inf, False),
            (np.nan, False),
        ):
            changed = getattr(result, name).copy()
            changed[row] = value
            if good:
                krl.residual_with(**{name: changed})
            else:
                refuses("further than without", krl.residual_with, **{name: changed})


def test_a_point_that_may_get_none_of_its_own_is_left_and_told(compensate, job):
    """What can not be written stays, and that is no defect of the output."""
    lines = [*LINES]
    lines[9] = lines[14] = "LIN P1"
    job.write(lines)
    job.write(
        ["DEFDAT part", "DECL E6POS P1={X 100.0,Y 0.0,Z -2.0,A 0.0,B 0.0,C 180.0}", "ENDDAT"], name="part.dat"
    )
    done = compensate(job.program, "--force", "--shared-points", "keep")
    assert done.code == 3, done.err
    assert "KRL007" in done.out
    assert job.output.exists()


@pytest.mark.parametrize("gain", ["0.5", "0.9"])
def test_with_a_gain_what_it_leaves_is_no_finding(compensate, job, gain):
    done = compensate(job.program, "--force", "--gain", gain)
    assert done.code == 0, done.out
    assert "COR007" in done.out
    assert "COR005" not in done.out
    assert "COR006" not in done.out


def test_with_a_gain_what_it_does_not_leave_is_told(compensate, job, monkeypatch):
    """Half of the correction asked for, and nothing of it made: more is left than was meant to be."""
    real = writing_module.with_residual

    def uncorrected(task, result, command):
        return real(task, result, task.wanted)

    monkeypatch.setattr(writing_module, "with_residual", uncorrected)
    monkeypatch.setattr(writing_module, "check_residual", lambda *given: None)
    done = compensate(job.program, "--force", "--gain", "0.5")
    assert done.code == 3
    assert "beyond the share that --gain keeps" in done.out


def test_an_orientation_that_remains_is_told(compensate, job, monkeypatch):
    real = writing_module.with_residual

    def turned(*given):
        result = real(*given)
        return replace(result, after_angle=np.where(result.corrected, 0.09 * DEG, result.after_angle))

    monkeypatch.setattr(writing_module, "with_residual", turned)
    monkeypatch.setattr(writing_module, "check_residual", lambda *given: None)
    job.cell(CELL + "tolerance_deg: 0.08\n")
    done = compensate(job.program, "--force")
    assert done.code == 3
    assert "the residual is 0.0900 deg, tolerance 0.08 deg" in done.out
