"""How cuts are entered, how their corrections go over, and that a cut which would be no better stays as it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import CELL, JUMPED_LINES, LINES
from path_cases import FORCE, circle, corner, line, task
from scipy.spatial.transform import Rotation

from postproc.base.document import Document
from postproc.base.geometry import Poses
from postproc.compensation.corners import compare_corners
from postproc.compensation.correct import correct, with_residual
from postproc.compensation.path_comparison import across_feed, cuts_not_improved, evaluate_transitions
from postproc.compensation.ramped_forces import add_force_ramps
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.languages.krl import KrlDialect
from postproc.output.write import path_errors_as_written
from postproc.robot.description import find_robot
from postproc.toolpath import Arcs, EditConstraints, Kind

FREE = Limits(max_growth=100.0)


def led(**words):
    """A straight cut behind a motion in air at feed."""
    half = 0.1
    points = [[1.6, -half, 0.6], [1.6, -half, 0.5], [1.6, half, 0.5], [1.6, half, 0.6]]
    return task(points, [False, False, True, False], kind=[Kind.PTP, Kind.LIN, Kind.LIN, Kind.LIN], **words)


def stepped(**words):
    """The corner, in one cut."""
    job = corner(**words)
    return replace(job, force=replace(job.force, steps=np.array([False, False, True, True, False])))


def divided(job, limits=FREE):
    result = correct(job)
    return result, subdivide(job, result, limits)


# entries


def test_the_motion_in_air_ends_where_the_tool_is_on_the_path_under_the_force():
    job = led()
    _result, division = divided(job)
    assert division.lead_ins.tolist() == [1]
    assert not division.transitions.any()
    end = division.command[np.flatnonzero(division.original)[[1]]]
    real = job.simulated(np.array([2]), end, job.force.along(np.array([2]), np.zeros(1)))
    assert np.linalg.norm(real.pose.position - job.wanted[[1]].position) < 2e-8
    assert division.moved.tolist().count(True) == 2 + division.inserted


@pytest.mark.parametrize(
    "change",
    [
        {"kind": [Kind.PTP, Kind.PTP, Kind.LIN, Kind.LIN]},
        {"continues": np.array([True, False, True, True])},
        {"constraints": EditConstraints(orientation_programmed=np.array([True, False, True, True]))},
        {"tool": np.array([1, 1, 0, 0])},
        {"constraints": EditConstraints(locked={1: "another motion builds on it"})},
    ],
    ids=["a jump", "runs elsewhere", "no orientation", "another tool", "pinned"],
)
def test_what_can_not_lead_in_is_left_and_a_link_does(change):
    job = led()
    job = replace(job, toolpath=job.toolpath.with_columns(**change))
    _, division = divided(job)
    assert not len(division.lead_ins)
    assert division.source[division.transitions].tolist() == [2]


def test_a_program_says_where_its_cuts_begin_corrected(compensate, job):
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.code, done.json["inserted"], done.json["lead_ins"]) == (0, 0, 2)
    assert done.json["stops_added"] == done.json["backwards"] == 0
    read = KrlDialect().read((Document(job.output, job.output.read_bytes()),)).toolpath
    # within a rounding of its own correction, which hardly changes over the first 100 mm
    for air, cut in ((2, 3), (8, 9)):
        shift = read.position[[air, cut]] - np.array([[0, 0, 0], [0.1, 0, -0.002]] if air == 2 else 0.0)
        if air == 2:
            assert np.linalg.norm(shift[0] - shift[1]) < 0.2e-3


OFFSETS = """
  - effect: joint_offset
    parameters:
      o1: {value: 3.0e-4, unit: rad, source: made up}
      o2: {value: -2.0e-4, unit: rad, source: made up}
"""
TOUCHED = "touch_points: [[0, 0, 0], [300, 0, 0], [0, 300, 0], [300, 300, 0]]\n"


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["absolute\n", f"touched_off\n{TOUCHED}"], ids=["absolute", "touched_off"])
def test_a_cut_is_entered_in_air_where_air_is_corrected_as_well(compensate, job, mode):
    """Nothing is between the motion in air and the cut, which ends and starts under the force; ``verify`` agrees."""
    known = find_robot("kuka_kr270").read_text().rstrip()
    (job.folder / "arm.yaml").write_text(known + OFFSETS)
    cell = CELL.replace("kuka_kr270", "arm.yaml")
    job.cell(f"{cell}correct: {mode}controller: {{absolute_accuracy: false}}\n")
    source = job.write(LINES)
    done = compensate(source, "--force", "--json", "-")
    assert done.code == 0, done.err
    assert (done.json["lead_ins"], done.json["stops_added"], done.json["transition_moves"]) == (2, 0, [])
    checked = compensate("verify", source, job.output, "--force", "--json", "-")
    assert checked.code == 0, checked.err
    reported = max(done.json[key]["max"] for key in ("error_after_mm", "path_error_mm"))
    assert checked.json["compensated"]["max"] == pytest.approx(reported, abs=1e-3)


def test_switched_off_air_does_not_lead_in(compensate, job):
    job.write([*LINES[:6], ";COMPENSATE OFF", *LINES[6:8], ";COMPENSATE ON", *LINES[8:]])
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.json["lead_ins"], len(done.json["transition_moves"])) == (1, 1)


SPLINE = [
    *LINES[:9],
    "SPLINE",
    "SPL {X 40.000,Y 0.000,Z -2.000,A 0.000,B 0.000,C 180.000}",
    "SPL {X 80.000,Y 10.000,Z -2.000,A 0.000,B 0.000,C 180.000}",
    "ENDSPLINE",
    *LINES[13:15],
    "END",
]


def test_a_spline_begins_corrected(compensate, job):
    job.write(SPLINE)
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.json["corrected"], done.json["lead_ins"]) == (2, 1)
    read = KrlDialect().read((Document(job.output, job.output.read_bytes()),)).toolpath
    begin, end = read.position[2], read.position[3] - [0.04, 0.0, -0.002]
    assert np.linalg.norm(begin) > 0.3e-3  # it moved
    assert np.linalg.norm(begin - end) < 0.05e-3  # as far as the end of the first spline


def test_a_spline_behind_a_jump_is_entered_by_a_transition_move(compensate, job):
    job.write([*SPLINE[:7], JUMPED_LINES[7], *SPLINE[8:]])
    done = compensate(job.program, "--force", "--json", "-")
    assert (done.json["corrected"], done.json["lead_ins"], done.json["inserted"]) == (2, 0, 1)
    lines = job.output.read_text().splitlines()
    assert lines[lines.index("SPLINE") - 1].startswith("LIN {X 0.")


@pytest.mark.parametrize("moment", [150, -150])
def test_half_a_turn_in_air_leads_in_where_it_still_turns_the_same_way(compensate, job, moment):
    turned = LINES[7].replace("Z 0.000", "X 0.000,Y 0.000,Z 0.000,A 180.000,B 0.000,C 180.000")
    cut = [
        line.replace("A 0.000", "A 180.000").replace("-360 50 560", f"0 0 100 0 0 {moment}")
        for line in LINES[8:13]
    ]
    job.write([*LINES[:7], turned, *cut, LINES[-1]])
    done = compensate(job.program, "--force", "--json", "-")
    assert done.json["corrected"] > 0
    written = job.output.read_text().splitlines()
    first = next(line for line in written if "A 179.9" in line or "A -179.9" in line)
    same = "A 179.9" in first  # from A 0 on: as the half turn was taken to go
    assert (turned in written, done.json["lead_ins"]) == ((False, 1) if same else (True, 0))


# ramps


def test_a_step_in_a_cut_is_no_stop_and_no_way_back():
    job = add_force_ramps(stepped(tolerance=2e-5), 5e-3)
    result, division = divided(job)
    assert not division.transitions[division.source == 3].any()
    pieces = np.flatnonzero((division.source == 3) & ~division.original)
    end = job.force.ramps.length[0] / job.desired_path.length[3]
    assert np.isclose(division.share[pieces], end).any()
    assert np.nanmax(path_errors_as_written(job, result, division)[0]) <= 0.9 * 2e-5
    made = evaluate_transitions(job, result, division)
    assert (made.stops, made.backwards) == (0, 0)
    assert 0.2 < made.rate <= 0.51
    # walked densely, the ramp and what is behind it
    share = np.linspace(0.0, 1.0, 201)
    rows = np.full(201, 3)
    ends = division.command[np.flatnonzero(division.source == 3)].position
    at = np.append(0.0, division.share[division.source == 3])
    points = np.vstack([division.command[[int(np.flatnonzero(division.original)[2])]].position, ends])
    command = np.stack([np.interp(share, at, points[:, i]) for i in range(3)], axis=1)
    real = job.simulated(rows, Poses(job.wanted[rows].rotation, command), job.force.along(rows, share))
    off = real.pose.position - job.desired_path.at(rows, share).position
    across_feed = off - np.outer(off @ [0, 1, 0], [0, 1, 0])
    assert np.linalg.norm(across_feed, axis=1).max() < 3e-5


def test_a_ramp_that_fits_gets_no_point():
    job = add_force_ramps(stepped(tolerance=1.0), 5e-3)
    job = replace(job, tolerance_angle=1.0)
    assert divided(job)[1].inserted == 0


@pytest.mark.parametrize(
    ("growth", "least", "allowed"), [(2.0, 0, 26), (2.0, 200, 200), (1.1, 0, 2), (1.0, 0, 0)]
)
def test_short_programs_may_grow_by_a_few_motions(growth, least, allowed):
    assert Limits(max_growth=growth, least=least).inserted(26) == allowed


@pytest.mark.slow
@pytest.mark.parametrize(("feed", "cycle"), [(0.05, 0.012), (0.5, 0.012), (0.5, 0.1)])
def test_no_piece_is_shorter_than_the_controller_runs_without_slowing(feed, cycle):
    job = circle(tolerance=1e-9)
    job = replace(job, toolpath=job.toolpath.with_columns(feed=np.full(4, feed)))
    _, division = divided(job, Limits(max_growth=1e4, cycle=cycle, min_segment=1e-3))
    pieces = np.diff(np.append(0.0, division.share[(division.source == 2) & ~division.transitions]))
    shortest = pieces.min() * job.desired_path.length[2]
    assert shortest >= max(1e-3, feed * cycle) * (1 - 1e-9)
    assert (shortest > 0.02) == (feed * cycle > 0.02)  # it would be 11 mm, as far as the tolerance goes


# across and along


def test_errors_are_parted_into_along_and_across_the_feed():
    job = corner()
    rows, error = np.array([2, 3]), np.array([[3e-3, 4e-3, 0.0], [3e-3, -4e-3, 12e-3]])
    along, beside = across_feed(job, rows, error)
    np.testing.assert_allclose(along, [3e-3, -4e-3])  # to +x, then to +y
    np.testing.assert_allclose(beside, [4e-3, np.hypot(3e-3, 12e-3)])


# never worse


def compared(job, limits):
    result, division = divided(job, limits)
    result = with_residual(job, result, division.original_command)
    before = np.full(len(result.state), np.nan)
    rows = np.flatnonzero(result.corrected)
    before[rows] = across_feed(job, rows, result.deflection[rows])[1]
    return cuts_not_improved(job, result, division, path_errors_as_written(job, result, division)[0], before)


def test_a_cut_whose_path_gets_worse_is_told():
    """Forces that turn round at each point: where nothing may be inserted, the ways between fit neither of them."""
    points = [[1.6, 0.1 * k, 0.5] for k in range(6)]
    wrench = np.array([[(-1.0) ** k * 400, 0, 0, 0, 0, 0] for k in range(6)])
    job = task(points, [False, *[True] * 5], wrench=wrench, kind=[Kind.PTP, *[Kind.LIN] * 5])
    assert compared(job, FREE) == {}
    ((row, told),) = compared(job, Limits(no_insert=True)).items()
    assert (row, told.code, told.line) == (1, "COR016", 11)


def test_a_correction_below_what_counts_is_no_better():
    small = task([[1.6, 0, 0.6], [1.6, 0, 0.5], [1.6, 0.1, 0.5]], [False, False, True], wrench=0.0 * FORCE)
    assert list(compared(small, FREE)) == [2]


REVERSED = [
    *JUMPED_LINES[:8],
    *(
        text
        for k in range(6)
        for text in (
            f";FORCE {(-1) ** k * 400} 0 0 @world",
            f"LIN {{X {100 * (k + 1)}.000,Y 0.000,Z -2.000,A 0.000,B 0.000,C 180.000}} C_DIS",
        )
    ),
    ";FORCE OFF",
    "LIN {Z 50.000}",
    "END",
]


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", ["0.02", "0.5", "10"])
@pytest.mark.parametrize(
    "words", [(), ("--no-insert",), ("--gain", "0.1"), ("--keep-points", "--gain", "0.5")]
)
def test_no_tolerance_and_no_option_makes_a_path_worse(compensate, job, tolerance, words):
    job.cell(CELL.replace("tolerance: 0.02", f"tolerance: {tolerance}\ntolerance_deg: 1"))
    job.write(REVERSED)
    done = compensate(job.program, "--force", "--json", "-", *words)
    assert done.code in (0, 3), done.err
    report = done.json
    if report["corrected"]:
        assert report["path_error_mm"]["max"] < report["across_feed_mm"]["before"]["max"]
    else:
        assert job.output.read_bytes() == job.program.read_bytes()
        assert done.code == 3


def test_a_gain_of_nothing_changes_nothing(compensate, job):
    done = compensate(job.program, "--force", "--gain", "0", "--json", "-")
    assert done.code == 0, done.err
    assert (done.json["corrected"], done.json["inserted"], done.json["lead_ins"]) == (0, 0, 0)
    assert job.output.read_bytes() == job.program.read_bytes()


# corners


def rounded(distance, force, turn=0.0):
    """Two sides of a square corner, approximated; the force of the second one turned by ``turn`` about the vertical."""
    points = [[1.5, -0.1, 0.5], [1.6, -0.1, 0.5], [1.6, 0.0, 0.5]]
    other = Rotation.from_rotvec([0, 0, turn]).apply(np.asarray(force)[:3])
    wrench = np.array([[0.0] * 6, force, [*other, 0, 0, 0]])
    job = task(
        points,
        [False, True, True],
        wrench=wrench,
        kind=[Kind.PTP, Kind.LIN, Kind.LIN],
        approximation=np.full(3, distance),
    )
    return replace(job, force=replace(job.force, steps=np.array([False, True, True])))


@pytest.mark.parametrize("distance", [1e-3, 5e-3])
def test_a_corner_whose_correction_stays_is_where_it_was(distance):
    job = rounded(distance, [100.0, 150.0, 50.0, 0, 0, 0])
    result, division = divided(job)
    found = compare_corners(job, result, division)
    assert found.row.tolist() == [1]
    assert found.distance[0] == distance
    assert found.difference[0] < 3e-6


def test_a_corner_whose_correction_turns_differs_and_more_so_without_a_ramp():
    job = rounded(2e-3, [100.0, 250.0, 50.0, 0, 0, 0], np.pi / 2)
    found = {}
    for name, ramp in (("long", 30e-3), ("short", 8e-3)):
        ramped = add_force_ramps(job, ramp)
        result, division = divided(ramped)
        found[name] = float(compare_corners(ramped, result, division).difference[0])
    assert found["long"] < found["short"] < 0.3e-3


def test_a_vertex_that_is_moved_is_seen_at_its_corner():
    """Half of what the vertex is moved by: the middle of a parabola."""
    job = rounded(5e-3, [100.0, 150.0, 50.0, 0, 0, 0])
    result, division = divided(job)
    there = division.command[np.arange(len(division))].copy()
    vertex = int(np.flatnonzero(division.original)[1])
    there.position[vertex] += [0.0, 0.0, 0.4e-3]
    off = compare_corners(job, result, replace(division, command=there)).difference[0]
    assert off == pytest.approx(0.4e-3, rel=0.1)  # all sides meet there, so all of the parabola goes with it


@pytest.mark.parametrize(("distance", "found"), [(0.0, 0), (1e-6, 0), (1e-3, 1), (np.nan, 1)])
def test_which_corners_are_looked_at(distance, found):
    job = rounded(distance, [100.0, 150.0, 50.0, 0, 0, 0])
    result, division = divided(job)
    seen = compare_corners(job, result, division)
    assert len(seen.row) == found
    if found:
        assert bool(seen.unknown[0]) == bool(np.isnan(distance))
        assert seen.distance[0] == pytest.approx(distance if np.isfinite(distance) else 0.05, rel=1e-3)


def test_a_line_has_no_corner():
    job = line(approximation=np.full(4, 5e-3))
    assert not len(compare_corners(job, *divided(job)).row)


def test_an_inserted_point_bounds_how_far_a_corner_is_rounded():
    """Half of the ramp behind it, where the original rounds 10 mm off."""
    job = add_force_ramps(rounded(10e-3, [100.0, 250.0, 50.0, 0, 0, 0], np.pi / 2), 5e-3)
    result, division = divided(job)
    found = compare_corners(job, result, division)
    own = found.row == 1
    assert found.difference[own].max() > 1.5e-3


@pytest.mark.parametrize("distance", [1e-3, 5e-3, 15e-3])
def test_a_point_inserted_into_an_arc_is_cut_off_by_what_the_arc_rises_on_the_way_to_it(distance):
    """Half way round it the tool is between the places d / 2 before and behind the point: d^2 / (8 R) inside."""
    job = circle(diameter=0.1, sweep=np.pi, tolerance=2e-5, approximation=np.full(4, distance))
    result, division = divided(job)
    inner = np.flatnonzero((division.source == 2) & ~division.original)
    assert len(inner)
    found = compare_corners(job, result, division)
    reach = min(
        distance, 0.5 * np.diff(division.share[division.source == 2]).min() * job.desired_path.length[2]
    )
    there = np.isin(found.motion, inner)
    assert found.difference[there].max() == pytest.approx(reach**2 / (8 * 0.05), rel=0.15, abs=3e-6)


def test_a_smooth_corner_of_line_and_arc_is_held_against_the_one_that_is_run():
    """The correction changes little there: the output is as round as the original."""
    begin, end, centre = [1.55, -0.1, 0.5], [1.5, 0.05, 0.5], [1.5, 0.0, 0.5]
    none = np.full(3, np.nan)
    job = task(
        [[1.55, -0.2, 0.5], begin, [1.55, 0.0, 0.5], end],
        [False, True, True, True],
        kind=[Kind.PTP, Kind.LIN, Kind.LIN, Kind.CIRC],
        arcs=Arcs(
            centre=np.array([none, none, none, centre]),
            normal=np.array([none, none, none, [0.0, 0.0, 1.0]]),
            sweep=np.array([np.nan, np.nan, np.nan, np.pi / 2]),
        ),
        approximation=np.full(4, 8e-3),
    )
    found = compare_corners(job, *divided(job, Limits(no_insert=True)))
    own = found.row == 2  # the motion before it starts uncorrected, where the tool is off
    assert own.any()
    assert found.difference[own].max() < 6e-6
    assert found.distance[own][0] ** 2 / (16 * 0.05) > 50e-6  # both are that far off the arc


def ramp_ended(distance, exact_stays=False, **limits):
    """The second side of a corner on which a ramp of 5 mm ends: its points, and what rounds them."""
    job = add_force_ramps(rounded(distance, [100.0, 250.0, 50.0, 0, 0, 0], np.pi / 2), 5e-3)
    path = replace(job.toolpath, constraints=EditConstraints(exact_stays=exact_stays))
    job = replace(job, tolerance=2e-5, toolpath=path)
    result, division = divided(job, Limits(**{"max_growth": 100.0, "ramp_end": 0.5e-3, **limits}))
    places = division.share[(division.source == 2) & ~division.original] * job.desired_path.length[2]
    return places, compare_corners(job, result, division)


@pytest.mark.slow
@pytest.mark.parametrize("distance", [2e-3, 0.0])
def test_a_point_where_a_ramp_ends_is_rounded_less_by_another_beside_it(distance):
    """A parabola leaves it at half of the shorter piece beside it at most: d k / 4 for a turn k of the correction."""
    places, found = ramp_ended(distance)
    assert places[:2] == pytest.approx([5e-3, 5.5e-3])
    assert np.diff(places).min() > 0.499e-3
    other, alone = ramp_ended(distance, ramp_end=1.6e-3)
    assert other[:2] == pytest.approx([5e-3, 6.6e-3])
    if distance:
        at = found.distance[found.row == 2], alone.distance[alone.row == 2]
        assert at[0][0] == pytest.approx(0.25e-3, rel=0.01)
        assert at[1][0] == pytest.approx(0.8e-3, rel=0.01)
        off = [float(one.difference[one.row == 2][0]) for one in (found, alone)]
        assert off[0] / off[1] == pytest.approx(0.25 / 0.8, rel=0.1)


@pytest.mark.parametrize(
    ("distance", "words"),
    [
        (0.0, {"exact_stays": True}),  # it is passed exactly
        (np.nan, {}),  # nothing is known of how it is rounded
        (0.1e-3, {}),  # it is hardly rounded
        (2e-3, {"ramp_end": 5e-3}),  # a point beside it would be no farther away than the corner is left
        (2e-3, {"max_growth": 1.0, "least": 2}),  # too few motions may be inserted
    ],
)
def test_it_stands_alone_where_another_one_would_not_help_or_not_fit(distance, words):
    places, _ = ramp_ended(distance, **words)
    assert places[0] == pytest.approx(5e-3)
    assert not len(places[1:]) or places[1] > 5.6e-3


def test_another_point_does_not_change_how_the_next_corner_is_rounded():
    """The last side ends 1 mm, twice the distance, behind where the companion would be, or a little before that."""
    for beyond, many in ((1.01e-3, 2), (0.99e-3, 1)):
        job = rounded(0.5e-3, [100.0, 250.0, 50.0, 0, 0, 0], np.pi / 2)
        job = add_force_ramps(job, 0.1 - 0.5e-3 - beyond)
        job = replace(job, tolerance=1e-6)
        at = job.desired_path.length[2] - 0.5e-3 - beyond
        places = divided(job, Limits(max_growth=1.0, least=200, ramp_end=0.5e-3))[1]
        places = places.share[(places.source == 2) & ~places.original] * job.desired_path.length[2]
        near = places[np.abs(places - at - 0.25e-3) < 0.3e-3]
        assert len(near) == many


def test_end_points_that_are_farther_off_are_no_better():
    job = led()
    result, division = divided(job)
    result = with_residual(job, result, division.original_command)
    between, before = np.zeros(len(division)), np.where(result.corrected, 1e-3, np.nan)
    for share, worse in ((0.99, False), (1.01, True)):
        other = replace(result, after=share * result.before, across_after=np.zeros(4))
        assert bool(cuts_not_improved(job, other, division, between, before)) == worse
