"""Measured forces over path length or time, brought to the motions, and what they refuse."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_forces import PTP_THEN, cell_of, codes, path_of, refused, run
from test_forces_along import arc_path
from tiers import examples

from postproc.base.findings import Finding, Refusal
from postproc.base.tables import read_table
from postproc.cell import frames_of
from postproc.process import wrenches
from postproc.process.force_logs import read_log
from postproc.toolpath import Kind

# lines 10 to 14: a PTP, then 100, 200 and 50 mm along +x
STRAIGHT = path_of([[0, 0, 0], [0.1, 0, 0], [0.3, 0, 0], [0.35, 0, 0]], PTP_THEN[:4])


def log(folder: Path, place, forces, column="s_mm", head="fx,fy,fz", name="part.force.csv") -> str:
    """A log of ``forces`` (M, 3 or 6), or of fx alone (M,), at ``place`` (M,) [mm or s]."""
    forces = np.asarray(forces, float)
    if forces.ndim == 1:
        forces = np.stack([forces, 0 * forces, 0 * forces], axis=1)
    rows = [",".join([f"{s:.6f}", *(f"{f:.9g}" for f in row)]) for s, row in zip(place, forces, strict=True)]
    path = folder / name
    path.write_text("\n".join([f"{column},{head}", *rows]) + "\n")
    return str(path)


def taken_off(toolpath, spec):
    cell = cell_of()
    return wrenches(
        Path("part.src"), toolpath, frames_of(cell, toolpath, "part.src"), cell, spec, offset=True
    )


def told(result, code) -> Finding:
    (finding,) = [finding for finding in result.findings if finding.code == code]
    return finding


S = np.arange(0.0, 350.1, 1.0)


def test_a_force_linear_in_the_path_length_is_found_again(tmp_path):
    forces = np.stack([100 + S, 0 * S + 7, -0.5 * S, 0 * S, 0.01 * S, 0 * S + 2], axis=1)
    result = run(STRAIGHT, log(tmp_path, S, forces, head="fx,fy,fz,mx,my,mz"))
    ends = np.array([100.0, 300.0, 350.0])
    wanted = np.stack([100 + ends, 0 * ends + 7, -0.5 * ends, 0 * ends, 0.01 * ends, 0 * ends + 2], axis=1)
    assert np.allclose(result.values[1:], wanted, atol=1e-6)
    assert np.allclose(result.start[:][2:], wanted[:2], atol=1e-6)
    assert np.allclose(result.start[:][1, 0], 100, atol=1e-6)
    assert np.allclose(result.along(np.array([2]), np.array([0.5]))[0], [300, 7, -100, 0, 2, 2], atol=1e-6)
    assert np.allclose(result.values[0], 0)
    assert codes(result) == ["FRC029"]
    assert result.source == "part.force.csv"


def test_time_runs_at_the_programmed_feed(tmp_path):
    path = STRAIGHT.with_columns(feed=np.array([np.nan, 0.02, 0.1, 0.01]))  # 5, 2 and 5 s
    t = np.linspace(0, 12, 241)
    result = run(path, log(tmp_path, t, 10 * t + 100, "t_s"))
    assert np.allclose(result.values[1:, 0], [150, 170, 220], atol=1e-6)
    assert np.allclose(result.start[:][1:, 0], [100, 150, 170], atol=1e-6)


def test_arcs_count_by_their_length(tmp_path):
    path = arc_path(np.pi, before=[0.1, -0.2, 0])  # 200 mm, then half a circle of 100 mm radius
    length = 200 + 100 * np.pi
    s = np.append(np.arange(0, length, 0.5), length)
    result = run(path, log(tmp_path, s, 50 + s))
    assert np.allclose(result.values[1:, 0], [250, 50 + length], atol=1e-3)


def test_the_mean_and_the_peak_of_each_motion(tmp_path):
    """A tooth that comes and goes: the mean counts for the correction, the peak is told."""
    s = np.arange(0, 350, 0.1)
    force = 200 + 150 * np.sin(2 * np.pi * s / 2.5)
    result = run(STRAIGHT, log(tmp_path, s, force))
    assert np.allclose(result.values[1:, 0], 200, atol=2)
    assert np.allclose(result.start[:][1:, 0], 200, atol=2)
    assert np.allclose(result.peak[1:], 350, atol=1)
    assert np.isnan(result.peak[0])
    what = told(result, "FRC029").message
    assert "3500 readings cover 3 motions, 1000 each in the median" in what
    assert "the largest mean force is 20" in what
    assert "the largest peak is 350 N" in what


def test_few_samples_give_a_mean_and_none_what_is_between(tmp_path):
    path = path_of([[0.001 * i, 0, 0] for i in range(30)], [Kind.PTP] + [Kind.LIN] * 29)
    s = np.arange(0, 29.1, 2.0)
    result = run(path, log(tmp_path, np.append(s, 29), 100 + np.append(s, 29)))
    assert np.allclose(result.values[2:, 0], 100 + np.arange(2, 30), atol=1.01)
    assert told(result, "FRC025").line == 12
    assert told(result, "FRC025").severity == "info"
    assert "FRC024" not in codes(result)


def test_the_force_may_step_between_two_motions(tmp_path):
    force = np.where(S < 100, 20.0, 400.0)
    result = run(STRAIGHT, log(tmp_path, S, force))
    assert np.allclose(result.values[1:, 0], [20, 400, 400])
    assert np.allclose(result.start[:][1:, 0], [20, 400, 400])
    assert result.steps.tolist() == [False, True, True, False]


def test_scatter_makes_no_steps(tmp_path):
    """Teeth that come faster than the readings scatter them by half of their mean; that is no jump of the force."""
    rng = np.random.default_rng(4)
    path = path_of([[0.001 * i, 0, 0] for i in range(301)], [Kind.PTP] + [Kind.LIN] * 300)
    s = np.arange(0, 300, 0.1)
    force = np.where(s < 150, 200.0, 800.0) * (1 + 0.7 * np.sin(rng.uniform(0, 2 * np.pi, len(s))))
    result = run(path, log(tmp_path, s, force))
    assert np.flatnonzero(result.steps).tolist() == [1, 151]
    few = run(path, log(tmp_path, s[::7], force[::7]))  # one reading or two a motion
    assert np.count_nonzero(few.steps) <= 2


def test_a_cut_that_begins_within_a_motion_is_told(tmp_path):
    rng = np.random.default_rng(1)
    s = np.arange(0, 350, 0.2)
    force = np.where(s < 180, 0.0, 400.0) + rng.normal(scale=5, size=len(s))
    finding = told(run(STRAIGHT, log(tmp_path, s, force)), "FRC026")
    assert (finding.severity, finding.line) == ("warning", 12)
    assert finding.message.startswith("the force does not change linearly along 1 motions;")


@pytest.mark.parametrize("frame", ["tool", "feed", "world"])
def test_logs_have_a_frame(tmp_path, frame):
    path = path_of([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]], PTP_THEN[:3])
    s = np.arange(0, 201.0)
    text = "s_mm;fx;fy;fz;frame\n" + "".join(f"{v:.1f};10,5;20;30;{frame}\n".replace(".", ",") for v in s)
    (tmp_path / "l.csv").write_text(text)
    found = run(path, str(tmp_path / "l.csv"))
    wanted = run(path, f"10.5,20,30@{frame}")
    assert np.allclose(found.values, wanted.values)
    assert np.allclose(found.start[:], wanted.start[:])
    assert found.steps.tolist() == wanted.steps.tolist()


# ------------------------------------------------------------------------------- the gauge

# 100 mm air by PTP, 100 mm LIN, 100 mm air marked so, 100 mm LIN
WITH_AIR = path_of(
    [[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [0.3, 0, 0], [0.4, 0, 0]],
    [Kind.PTP, Kind.PTP, Kind.LIN, Kind.LIN, Kind.LIN],
    notes=[(3, "FORCE OFF", 6), (4, "FORCE 1 2 3", 7)],
)
A = np.arange(0, 400.0)
IN_CUT = ((A >= 100) & (A < 200)) | (A >= 300)


def gauge(offset=12.0, scatter=2.0):
    rng = np.random.default_rng(3)
    return offset + np.where(IN_CUT, 300.0, 0.0) + rng.normal(scale=scatter, size=len(A))


def test_an_offset_in_air_is_told_and_stays(tmp_path):
    spec = log(tmp_path, A, gauge())
    result = run(WITH_AIR, spec)
    finding = told(result, "FRC021")
    assert finding.severity == "warning"
    assert "in air the log shows fx 12" in finding.message
    assert "the mean of 200 readings" in finding.message
    assert "--tare" in finding.help
    assert np.allclose(result.values[2, 0], 312, atol=2)
    assert result.carries.tolist() == [False, False, True, False, True]


def test_an_offset_is_taken_off_where_it_is_asked_for(tmp_path):
    result = taken_off(WITH_AIR, log(tmp_path, A, gauge()))
    assert np.allclose(result.values[[2, 4], 0], 300, atol=2)
    finding = told(result, "FRC022")
    assert (finding.severity, finding.code) == ("info", "FRC022")
    assert "fx 12" in finding.message
    assert "FRC021" not in codes(result)


@pytest.mark.parametrize(("offset", "scatter"), [(0.0, 2.0), (3.0, 2.0), (10.0, 100.0)])
def test_small_and_unclear_offsets_are_not_told(tmp_path, offset, scatter):
    assert "FRC021" not in codes(run(WITH_AIR, log(tmp_path, A, gauge(offset, scatter))))


def test_an_offset_of_a_table_by_line(tmp_path):
    (tmp_path / "l.csv").write_text("line,fx,fy,fz\n11,5,1,0\n12,105,1,0\n13,7,1,0\n14,205,1,0\n")
    result = taken_off(WITH_AIR, str(tmp_path / "l.csv"))
    assert np.allclose(result.values[[2, 4], 0], [99, 199])
    assert np.allclose(result.values[[2, 4], 1], 0)
    assert codes(result) == ["FRC022", "FRC035"]
    assert codes(run(WITH_AIR, str(tmp_path / "l.csv"))) == ["FRC009", "FRC035"]


@pytest.mark.parametrize("spec", [None, "", "0,360,560", "milling.yaml"])
def test_no_offset_without_a_log(spec):
    noted = path_of([[0, 0, 0], [0.1, 0, 0]], notes=[(0, "FORCE 1 2 3", 1)])
    with pytest.raises(Refusal) as caught:
        taken_off(noted, spec)
    (finding,) = caught.value.findings
    assert finding.code == "FRC020"
    assert "--tare subtracts the offset of a log" in finding.message


def test_no_offset_without_air(tmp_path):
    with pytest.raises(Refusal) as caught:
        taken_off(STRAIGHT, log(tmp_path, S, S))
    assert caught.value.findings[0].code == "FRC020"
    assert "no reading of this log is in air" in caught.value.findings[0].message


@pytest.mark.parametrize("sign", [1, -1])
def test_a_saturated_channel_is_told(tmp_path, sign):
    rng = np.random.default_rng(2)
    force = 300 + 300 * np.sin(S / 20) + rng.normal(scale=3, size=len(S))
    clipped = np.minimum(force, 500)
    result = run(STRAIGHT, log(tmp_path, S, np.stack([0 * S + 5, sign * clipped, S], axis=1)))
    finding = told(result, "FRC023")
    assert finding.severity == "warning"
    assert f"channel fy stays at {sign * 500} in {np.sum(clipped == 500)} readings" in finding.message
    assert finding.line == 2 + np.argmax(clipped == 500)


@pytest.mark.parametrize(
    "force",
    [
        np.where(S < 100, 20.0, 400.0),  # stated, not measured
        300 + 200 * np.sin(S / 20),  # one reading at each crest
        np.maximum(0.0, 200 * np.sin(S / 20)),  # rests at 0
        5 * np.round((100 + 90 * np.sin(S / 40)) / 5),  # coarse steps everywhere
    ],
)
def test_what_is_no_rail(tmp_path, force):
    assert "FRC023" not in codes(run(STRAIGHT, log(tmp_path, S, force)))


# ---------------------------------------------------------------- what does not fit the path


def test_a_gap_is_told(tmp_path):
    kept = (S < 130) | (S > 180)
    finding = told(run(STRAIGHT, log(tmp_path, S[kept], S[kept])), "FRC024")
    assert (finding.severity, finding.line) == ("warning", 131)
    assert "the log has 1 gaps, the widest from s = 129 mm to s = 181 mm" in finding.message


def test_a_gap_in_air_is_none(tmp_path):
    kept = IN_CUT | (A < 5) | (A > 195)
    assert "FRC024" not in codes(run(WITH_AIR, log(tmp_path, A[kept], gauge(0.0)[kept])))


@pytest.mark.parametrize("column", ["s_mm", "t_s"])
def test_a_log_that_is_too_short_is_refused(tmp_path, column):
    path = STRAIGHT.with_columns(feed=np.full(4, 0.001))  # 1 mm/s: both scales count alike
    spec = log(tmp_path, S[:300], S[:300], column)
    (finding,) = refused(path, spec)
    assert (finding.code, finding.file, finding.line) == ("FRC019", spec, 301)
    unit = {"s_mm": "s = 299 mm", "t_s": "t = 299 s"}[column]
    assert f"it ends at {unit}, and the path that cuts at {unit.replace('299', '350')}" in finding.message
    (finding,) = refused(path, log(tmp_path, S[50:], S[50:], column))
    assert (finding.code, finding.line) == ("FRC019", 2)
    assert "it starts at" in finding.message


def test_a_log_that_goes_on_is_told(tmp_path):
    s = np.arange(0, 500.0)
    finding = told(run(STRAIGHT, log(tmp_path, s, s)), "FRC027")
    assert (finding.severity, finding.line) == ("warning", 353)
    assert "the log continues to s = 499 mm, and the path ends at s = 350 mm" in finding.message
    assert "FRC027" not in codes(run(STRAIGHT, log(tmp_path, s[:353], s[:353])))


def test_forces_behind_the_path_are_of_a_cut_that_was_shifted(tmp_path):
    """A pause of half a percent in the middle: the log ends with a cut that the path does not have any more."""
    s = np.arange(0, 352.5, 0.25)
    assert "FRC027" not in codes(run(STRAIGHT, log(tmp_path, s, np.where(s > 350.4, 5, 100))))
    finding = told(run(STRAIGHT, log(tmp_path, s, np.where(s > 350.4, 20, 100))), "FRC027")
    assert finding.message.endswith("; after it the log has forces up to 20 N")


def test_motions_of_unknown_time_between_cuts_shift_what_is_behind_them(tmp_path):
    """Not those before the first and behind the last cut, and no point that is there twice."""
    places = [0, 0.1, 0.3, 0.35, 0.35, 0.4, 0.5]
    kinds = [*PTP_THEN[:4], Kind.LIN, Kind.LIN, Kind.PTP]
    path = path_of([[x, 0, 0] for x in places], kinds).with_columns(feed=np.full(7, 0.001))
    t = np.arange(0.0, 401)
    result = run(path, log(tmp_path, t, 0 * t + 100, "t_s"))
    assert {"FRC047", "FRC028"}.isdisjoint(codes(result))
    path = path_of([[x, 0, 0] for x in places], [*kinds[:5], Kind.PTP, Kind.LIN])
    rapid = path.with_columns(feed=np.where(path.kind == Kind.PTP, np.nan, 0.001))
    t = np.arange(0.0, 451)
    finding = told(run(rapid, log(tmp_path, t, 0 * t + 100, "t_s")), "FRC047")
    assert (finding.severity, finding.line) == ("warning", 15)
    assert finding.message.startswith("1 motions between cuts state no feed")


def test_without_a_feed_there_is_no_time(tmp_path):
    path = STRAIGHT.with_columns(feed=np.array([np.nan, 0.02, np.nan, 0.0]))
    (finding,) = refused(path, log(tmp_path, S, S, "t_s"))
    assert (finding.code, finding.file, finding.line) == ("FRC013", "part.src", 12)
    assert "the feed of 2 motions is not known" in finding.message
    assert run(path, log(tmp_path, S, S)).any


def test_an_unknown_way_has_no_length(tmp_path):
    points = [[0, 0, 0], [0.1, 0, 0], [np.nan] * 3, [0.3, 0, 0]]
    (finding,) = refused(path_of(points, PTP_THEN[:4]), log(tmp_path, S, S))
    assert (finding.code, finding.file, finding.line) == ("FRC019", "part.src", 12)
    assert "of 2 motions is not known" in finding.message


def test_moves_between_axis_positions_take_no_part_and_are_told(tmp_path):
    points = [[np.nan] * 3, [0, 0, 0], [0.1, 0, 0], [np.nan] * 3, [0.5, 0, 0], [0.6, 0, 0]]
    kinds = [Kind.AXIS, Kind.LIN, Kind.LIN, Kind.AXIS, Kind.PTP, Kind.LIN]
    result = run(path_of(points, kinds), log(tmp_path, S[:201], S[:201]))
    finding = told(result, "FRC028")
    assert (finding.severity, finding.line) == ("info", 13)
    assert finding.message.startswith("2 motions")
    assert np.allclose(result.values[[2, 5], 0], [100, 200], atol=1e-6)


def test_turning_on_the_spot_has_the_force_of_its_place(tmp_path):
    path = path_of([[0, 0, 0], [0.1, 0, 0], [0.1, 0, 0], [0.35, 0, 0]], PTP_THEN[:4])
    result = run(path, log(tmp_path, S, 100 + S))
    assert np.allclose(result.values[2, 0], 200, atol=1e-6)
    assert told(result, "FRC028").line == 12


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("s_mm,fx,fy,fz\n0,1,2,3\n1,nan,2,3\n", 3, "column fx: 'nan' is not a number"),
        ("s_mm,fx,fy,fz\n0,1,2,3\n1,1,-1e300,3\n", 3, "column fy: '-1e300' exceeds 1e+09"),
        ("s_mm,fx,fy,fz\n0,1,2,3\n1,,2,3\n", 3, "column fx: the cell is empty"),
        (
            "s_mm,fx,fy,fz\n0,1,2,3\n2,1,2,3\n1,1,2,3\n",
            4,
            "column s_mm: 1 is less than 2 in the row before; it must not decrease",
        ),
        ("t_s,fx,fy,fz\n0,1,2,3\n0.5,1,2,3\n0.4,1,2,3\n", 4, "column t_s: 0.4 is less than 0.5"),
        ("s_mm,fx,fy,fz,frame\n0,1,2,3,base\n1,1,2,3,bass\n", 3, "column frame: 'bass' is not a frame"),
        (
            "s_mm,fx,fy,fz,frame\n0,1,2,3,base\n400,1,2,3,tool\n",
            3,
            "the frame differs from that of the rows before",
        ),
        ("s_mm,fx,fy\n0,1,2\n", 1, "column 'fz' is missing"),
        ("s_mm,t_s,fx,fy,fz\n0,0,1,2,3\n", 1, "columns s_mm and t_s both state the place"),
        ("s,fx,fy,fz\n0,1,2,3\n", 1, "column 's' is unknown"),
        ("s_mm,fx,fy,fz\n", 1, "a header, but no rows"),
    ],
)
def test_mistakes_in_logs_are_told_with_their_line(tmp_path, text, line, words):
    path = tmp_path / "l.csv"
    path.write_text(text)
    (finding,) = refused(STRAIGHT, str(path))
    assert (finding.code, finding.file, finding.line) == ("FRC003", str(path), line)
    assert words in finding.message


def test_an_empty_program_has_no_log(tmp_path):
    assert not run(path_of([]), log(tmp_path, S, S)).any


@settings(max_examples=examples(40), deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_line_of_each_motion_keeps_the_mean_of_its_samples(tmp_path_factory, seed):
    """Even samples, as many in both halves: what the line carries along the motion is what was measured there."""
    rng = np.random.default_rng(seed)
    length = rng.integers(3, 40, 6) * 2  # samples per motion, 1 mm apart, in the middle of each mm
    ends = np.append(0, np.cumsum(length))
    path = path_of(np.stack([ends * 1e-3, 0 * ends, 0 * ends], axis=1), [Kind.PTP] + [Kind.LIN] * 6)
    s = np.arange(ends[-1]) + 0.5
    force = np.cumsum(rng.normal(size=len(s))) * 10 + 300 * np.sin(s / 30)
    columns = {"s_mm": s, "fx": force, "fy": 0 * s, "fz": 0 * s}
    rows = zip(*(map(repr, column.tolist()) for column in columns.values()), strict=True)
    log = tmp_path_factory.getbasetemp() / "l.csv"
    log.write_text("\n".join([",".join(columns), *map(",".join, rows)]))
    table = read_table(log, "FRC003")
    stated, _ = read_log(table, "s_mm", path, frames_of(cell_of(), path, "part.src"), "part.src", False)
    mean = [force[a:b].mean() for a, b in pairwise(ends)]
    assert np.allclose(0.5 * (stated.start_values + stated.values)[1:, 0], mean, atol=1e-9)
    largest = [np.abs(force[a:b]).max() for a, b in pairwise(ends)]
    assert np.allclose(stated.peak[1:], largest)
