"""Measurements: the CSV of readings is read strictly, and what is written reads back."""

import time
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.base.findings import Refusal
from postproc.base.geometry import Poses, rotation_from_abc
from postproc.base.tables import is_missing
from postproc.base.units import DEG, MM
from postproc.measurements import (
    Readings,
    joined,
    measurements_csv,
    planned,
    read_measurements,
    robot_named,
)

SIX = tuple((f"A{i}", False) for i in range(1, 7))
ANGLES = "A1,A2,A3,A4,A5,A6"
Q = "0,-90,90,0,45,10"


@pytest.fixture
def csv(tmp_path):
    """Writes lines into a file; {Q} and {A} stand for a pose and its header."""

    def write(*lines, name="data.csv"):
        text = "\n".join(line.replace("{Q}", Q).replace("{A}", ANGLES) for line in lines)
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture
def read(csv):
    def read(*lines, joints=SIX, name="data.csv"):
        return read_measurements(csv(*lines, name=name), joints)

    return read


def refused(read, *lines, joints=SIX):
    with pytest.raises(Refusal) as caught:
        read(*lines, joints=joints)
    finding = caught.value.findings[0]
    assert finding.file.endswith("data.csv")
    return finding


def told(readings):
    return [(finding.code, finding.line) for finding in readings.findings]


def test_a_file_with_everything(read):
    r = read(
        "# robot: kuka_kr270",
        "# instrument: laser tracker",
        "# tool: 0 0 200 0 90 0",
        "# sigma_mm: 0.02",
        "# sigma_deg: 0.01",
        "# target M1: 60 0 345",
        "",
        "{A},FX,FZ,MX,DX,DY,DZ,DA,DB,DC,TARGET,T,TEMP,SIGMA,REPEAT,SESSION,DIR2,DIR1",
        "{Q},100,-2500,5,0.1,,-1.2,0.01,0.02,0.03,M1,0,20.5,,a,mon,1,-1",
        "{Q},100,-2500,5,0.1,0.2,-1.2,,-,n/a,M2,1,20.5,0.05,,mon,,0",
        "{Q},100,-2500,5,0.1,0.2,-1.2,,,,M1,2,20.5,0.05,a,mon,,0",
    )
    assert (r.robot, r.deflection, r.targets, r.sessions) == ("kuka_kr270", True, ("M1", "M2"), ("mon",))
    assert len(r) == 3
    assert r.findings == ()
    assert np.allclose(r.q[1], np.array([0, -90, 90, 0, 45, 10]) * DEG, atol=1e-15)
    assert r.wrench[0].tolist() == [100, 0, -2500, 5, 0, 0]
    assert np.allclose(r.value, np.array([[0.1, np.nan, -1.2], *[[0.1, 0.2, -1.2]] * 2]) * MM, equal_nan=True)
    assert np.allclose(r.rotation[0], rotation_from_abc(np.array([0.01, 0.02, 0.03]) * DEG), atol=1e-15)
    assert np.isnan(r.rotation[1:]).all()
    assert np.allclose(r.sigma, np.array([0.02, 0.05, 0.05]) * MM)
    assert r.sigma_turn == pytest.approx(0.01 * DEG)
    assert np.allclose(r.tool.position, [0, 0, 0.2])
    assert np.allclose(r.tool.rotation, rotation_from_abc([0, np.pi / 2, 0]))
    assert r.places.keys() == {"M1"}
    assert np.allclose(r.places["M1"], [0.06, 0, 0.345])
    assert r.target.tolist() == [0, 1, 0]
    assert r.repeat.tolist() == [0, -1, 0]
    assert r.session.tolist() == [0, 0, 0]
    assert r.time.tolist() == [0, 1, 2]
    assert r.temperature.tolist() == [20.5] * 3
    assert r.direction[:, :3].tolist() == [[-1, 1, 0], [0, 0, 0], [0, 0, 0]]
    assert r.where(1) == (str(r.files[0]), 10)
    with pytest.raises(ValueError, match="read-only"):
        r.q[0, 0] = 1


def test_what_is_not_stated(read):
    r = read("{A},X,Y,Z", "{Q},1,2,3")
    assert (r.robot, r.deflection, r.in_robot_frame, r.tool) == ("", False, False, None)
    assert (r.targets, r.places, r.sessions) == ((), {}, ("",))
    assert np.isnan(r.sigma).all()
    assert not r.wrench.any()
    assert [r.rotation, r.sigma_turn, r.time, r.temperature, r.direction] == [None] * 5
    assert (r.target.tolist(), r.session.tolist(), r.repeat.tolist()) == ([0], [0], [-1])


def test_pose_in_the_robot_frame(read):
    r = read("# FRAME : Robot", "{A},X,Y,Z,A,B,C", "{Q},1,2,3,90,0,0")
    assert r.in_robot_frame
    assert np.allclose(r.rotation[0], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


@pytest.mark.parametrize(
    "lines",
    [
        ("# tool: 0 0,5 200", "a1;A2; A3 ;A4;A5;A6;x;Y;Z", "0;-90,25;90;0;45;10;1,5;2;3"),
        ("# tool: 0;0,5;200;;", "A1\tA2\tA3\tA4\tA5\tA6\tX\tY\tZ", "0\t-90,25\t90\t0\t45\t10\t1,5\t2\t3"),
        ('"# tool: 0, 0.5, 200",,,', "Z,Y,X,J6,J5,J4,J3,J2,J1", "3,2,1.5,10,45,0,90,-90.25,0"),
        ("# tool = 0,0.5,200", "X [mm],Y (mm),Z,A1 [deg],A2 (°),A3,A4,A5,A6", "1.5,2,3,0,-90.25,90,0,45,10"),
    ],
)
def test_dialects_orders_and_units_of_the_header(read, lines):
    r = read(*lines)
    assert np.allclose(r.q[0], np.array([0, -90.25, 90, 0, 45, 10]) * DEG)
    assert np.allclose(r.value[0], [0.0015, 0.002, 0.003])
    assert np.allclose(r.tool.position, [0, 0.0005, 0.2])


def test_a_slider_and_six_axes(read):
    joints = (("E1", True), *SIX)
    r = read("{A},e1 [mm],X,Y,Z", "{Q},1500,1,2,3", joints=joints)
    assert np.allclose(r.q[0], [1.5, *np.array([0, -90, 90, 0, 45, 10]) * DEG])
    # the file's A1..A7 would take A1 for the slider
    finding = refused(read, "{A},A7,X,Y,Z", "{Q},0,1,2,3", joints=joints)
    assert (finding.line, finding.message) == (1, "column 'E1' is missing")
    assert "E1 (mm), A1 (deg)" in finding.help
    finding = refused(read, "{A},E1 (deg),X,Y,Z", "{Q},0,1,2,3", joints=joints)
    assert "millimetres are expected" in finding.message


def test_joints_by_number_where_the_robot_has_names_of_its_own(read):
    joints = tuple((name, False) for name in ("base", "shoulder"))
    assert np.allclose(read("J1,J2,X,Y,Z", "1,2,0,0,0", joints=joints).q, np.array([[1, 2]]) * DEG)
    assert np.allclose(read("A1,A2,X,Y,Z", "1,2,0,0,0", joints=joints).q, np.array([[1, 2]]) * DEG)
    assert np.allclose(read("Shoulder,Base,X,Y,Z", "2,1,0,0,0", joints=joints).q, np.array([[1, 2]]) * DEG)


def test_joints_that_are_called_like_other_columns(read):
    joints = tuple((name, False) for name in "SLURBT")
    r = read("S,L,U,R,B,T,X,Y,Z", "1,2,3,4,5,6,0,0,0", joints=joints)
    assert np.allclose(r.q, np.arange(1, 7) * DEG)
    assert r.time is None
    r = read("J1,J2,J3,J4,J5,J6,X,Y,Z,A,B,C,T", "1,2,3,4,5,6,0,0,0,0,90,0,7", joints=joints)
    assert np.allclose(r.q, np.arange(1, 7) * DEG)
    assert r.time.tolist() == [7]
    again = read(measurements_csv(r).decode(), joints=joints)
    assert np.allclose(again.q, r.q)
    assert again.time.tolist() == [7]


@pytest.mark.parametrize(
    ("header", "message", "help"),
    [
        ("A1,A2,A3,A4,A5,X,Y,Z", "column 'A6' is missing", "A5 (deg), A6 (deg)"),
        ("{A},A7,X,Y,Z", "column 'a7' is none of the robot's 6 joints", "A6 (deg)"),
        ("A1,A2,A3,J4,J5,J6,X,Y,Z", "column 'A4' is missing", "A4 (deg)"),
        ("{A},J1,X,Y,Z", "column 'j1' is none of the robot's 6 joints", "A6 (deg)"),
        ("X,Y,Z", "columns of the joints are missing", "A6 (deg); or A1..A6, or J1..J6"),
        ("{A}", "the measured values are missing", "DX,DY,DZ (loaded minus unloaded)"),
        ("{A},X,Y,Z,DX,DY,DZ", "'X' and 'DX' exclude each other", "X,Y,Z (measured place)"),
        ("{A},X,Z", "column 'Y' is missing; 'X' needs it", "X,Y,Z"),
        ("{A},DX,DY", "column 'DZ' is missing; 'DX' needs it", "DX,DY,DZ"),
        ("{A},X,Y,Z,A,C", "column 'B' is missing; 'A' needs it", "A,B,C"),
        ("{A},X,Y,Z,DA,DB,DC", "column 'DA' does not belong to X,Y,Z", "A,B,C"),
        ("{A},DX,DY,DZ,A,B,C", "column 'A' does not belong to DX,DY,DZ", "DA,DB,DC"),
        ("{A},X,Y,Z,tmp", "column 'tmp' is unknown; did you mean 'temp'?", "SESSION"),
        ("{A},X,Y,Z,DIR7", "column 'dir7' is unknown", "DIR1..DIR6"),
        ("{A},X,Y,Z,Y [mm]", "columns 'y' and 'y [mm]' are the same", ""),
        (
            "A1 [rad],A2,A3,A4,A5,A6,X,Y,Z",
            "the unit of column 'a1 [rad]' is wrong: degrees are expected",
            "convert",
        ),
        ("{A},X,Y,Z (m)", "the unit of column 'z (m)' is wrong: millimetres are expected", "convert"),
        ("{A},X,Y,Z,FX [kN]", "newtons are expected", "convert"),
        ("{A},X,Y,Z,MX [N]", "newton metres are expected", "convert"),
        ("{A},X,Y,Z,T [ms]", "seconds are expected", "convert"),
        ("{A},X,Y,Z,TEMP [K]", "degrees Celsius are expected", "convert"),
        ("{A},X,Y,Z,TARGET [mm]", "has no unit", "convert"),
    ],
)
def test_wrong_headers(read, header, message, help):
    finding = refused(
        read, "# a comment", header, ",".join("0" * (header.count(",") + 1 + 5 * ("{A}" in header)))
    )
    assert (finding.code, finding.line) == ("MEA001", 2)
    assert message in finding.message
    assert help in finding.help


@pytest.mark.parametrize(
    ("columns", "cells", "message"),
    [
        ("X,Y,Z", "1,2,x", "column Z: 'x' is not a number"),
        ("X,Y,Z,FX", "1,2,3,5N", "column FX: '5N' is not a number"),
        ("X,Y,Z,A,B,C", "1,2,3,10,,30", "column B: the cell is empty"),
        ("X,Y,Z,SIGMA", "1,2,3,0", "column SIGMA: 0 is not above zero"),
        ("X,Y,Z,SIGMA", "1,2,3,-0.1", "column SIGMA: -0.1 is not above zero"),
        ("X,Y,Z,DIR6", "1,2,3,2", "column DIR6: '2' is not a direction of approach"),
        ("X,Y,Z,TARGET", "1,2,3,", "column TARGET: the cell is empty"),
        ("X,Y,Z,SESSION", "1,2,3,", "column SESSION: the cell is empty"),
        ("X,Y,Z,T", "1,2,3,", "column T: the cell is empty"),
        ("X,Y,Z,T", "1,2,3,12:30", "column T: '12:30' is not a number"),
        ("X,Y,Z,TEMP", "1,2,3,-", "column TEMP: the cell is empty"),
    ],
)
def test_wrong_cells(read, columns, cells, message):
    good = ",".join("1" * (columns.count(",") + 1))
    finding = refused(read, "{A}," + columns, "{Q}," + good, "# note", "{Q}," + cells)
    assert (finding.code, finding.line) == ("MEA001", 4)
    assert message in finding.message


@pytest.mark.parametrize("cell", ["", "-", "nan", "x"])
def test_joint_angles_are_never_missing(read, cell):
    finding = refused(read, "{A},X,Y,Z", "{Q},1,2,3", f"1,{cell},3,4,5,6,1,2,3")
    assert (finding.code, finding.line) == ("MEA001", 3)
    assert "column A2" in finding.message


@pytest.mark.parametrize(
    ("comment", "message"),
    [
        ("# robot:", "# robot: the name is missing"),
        ("# frame: world", "# frame: 'world' is not a frame"),
        ("# frame: trakcer", "did you mean 'tracker'?"),
        ("# tool: 0 0", "# tool: 2 numbers are given where x y z [a b c] (mm, deg) is expected"),
        ("# tool: 0 0 x", "# tool: '0 0 x' is not understood"),
        ("# tool: 1,5, 2,5, 3,5", "is not understood"),
        ("# tool: 0,0,200 0,0,0", "is not understood"),
        ("# tool:", "is not understood"),
        ("# sigma_mm: 0.02 mm", "one number without a unit"),
        ("# sigma_mm: 0", "# sigma_mm: 0 is not above zero"),
        ("# sigma_deg: -1", "# sigma_deg: -1 is not above zero"),
        ("# sigma_mm: nan", "is not understood"),
        ("# target M1: 1 2", "# target M1: 2 numbers are given where x y z (mm) is expected"),
        ("# target: 1 2 3", "# target: the name of the target is missing"),
        ("# frame: robot\n# Frame: robot", "# frame occurs in line 2 already"),
        ("# target M1: 1 2 3\n# target M1: 1 2 3", "# target M1 occurs in line 2 already"),
    ],
)
def test_wrong_comments(read, comment, message):
    finding = refused(read, "# note", comment, "{A},X,Y,Z,TARGET", "{Q},1,2,3,M1")
    assert (finding.code, finding.line) == ("MEA001", 2 + comment.count("\n"))
    assert message in finding.message


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("1 2 3", (1, 2, 3)),
        ("1, 2, 3", (1, 2, 3)),
        ("1,2,3", (1, 2, 3)),
        ("1.5  2 , 3", (1.5, 2, 3)),
        ("0,5 -1,5 2e1", (0.5, -1.5, 20)),
        ("0,5; 1,5;2", (0.5, 1.5, 2)),
        ("0.5;1.5;2", (0.5, 1.5, 2)),
        ("1\t2\t3", (1, 2, 3)),
    ],
)
def test_numbers_of_comments(read, text, place):
    r = read(f"# target a: {text}", "{A},X,Y,Z,TARGET", "{Q},1,2,3,a")
    assert np.allclose(r.places["a"], np.array(place) * MM)


@pytest.mark.parametrize("text", ["1.000 0,5 2", "0,5; 1.5;2", "1.000;2;3,5"])
def test_points_and_commas_in_one_comment_are_refused(read, text):
    finding = refused(read, f"# target a: {text}", "{A},X,Y,Z,TARGET", "{Q},1,2,3,a")
    assert (finding.code, finding.line) == ("MEA001", 1)
    assert "is not understood" in finding.message
    assert "in all of them" in finding.help


def test_points_beside_decimal_commas_are_refused(read):
    finding = refused(read, "A1;A2;A3;A4;A5;A6;X;Y;Z", "0;-90,25;90;0;45;10;1.500;2;3")
    assert (finding.code, finding.line) == ("MEA001", 2)
    assert "column X: '1.500' has a point" in finding.message


def test_a_single_number_may_have_a_decimal_comma(read):
    assert read("# sigma_mm: 0,02", "{A},X,Y,Z", "{Q},1,2,3").sigma[0] == pytest.approx(2e-5)


@pytest.mark.parametrize(
    ("comment", "word"),
    [
        ("# sigma: 0.02", "did you mean 'sigma_mm'?"),
        ("# sigma_m: 0.02", "did you mean 'sigma_mm'?"),
        ("# sigma mm: 0.02", "did you mean 'sigma_mm'?"),
        ("# targets M1: 1 2 3", "did you mean 'target'?"),
        ("# targets: 3", "did you mean 'target'?"),
        ("# Frames: robot", "did you mean 'frame'?"),
        ("# tool tcp: 0 0 200", "did you mean 'tool'?"),
        ("# sigma_mm 0.02", "no colon"),
        ("# frame robot", "no colon"),
    ],
)
def test_comments_that_were_meant_as_a_key(read, comment, word):
    r = read("# note", comment, "{A},X,Y,Z", "{Q},1,2,3")
    assert told(r) == [("MEA004", 2)]
    assert word in r.findings[0].message
    assert not r.in_robot_frame
    assert np.isnan(r.sigma).all()


@pytest.mark.parametrize(
    ("comment", "word"),
    [
        ("# tool: 0 0 0.2", "0.2 mm, as if it were in metres"),
        ("# target M1: 0.3 0 -0.1", "# target M1: its largest coordinate is 0.3 mm"),
        ("# base_target B: 0 -1.5 0", "1.5 mm, as if it were in metres"),
        ("# sigma_mm: 20", "20 mm, as if it were in micrometres"),
    ],
)
def test_a_number_in_another_unit_above_the_header(read, comment, word):
    r = read("# note", comment, "{A},X,Y,Z,TARGET", "{Q},1,2,3,M1")
    assert told(r)[0] == ("MEA014", 2)
    assert word in r.findings[0].message


@pytest.mark.parametrize("comment", ["# tool: 0 0 0", "# target M1: 0 0 2.5", "# sigma_mm: 2.9"])
def test_a_number_that_a_robot_has_above_the_header(read, comment):
    r = read(comment, "{A},X,Y,Z,TARGET", "{Q},1,2,3,M1")
    assert "MEA014" not in [finding.code for finding in r.findings]


@pytest.mark.parametrize(
    "comment",
    [
        "# instrument: GTS3800 laser tracker, 15 um + 6 um/m",
        "# date: 2025-11-20",
        "# operator: A. Robotnik",
        "# room: 21",
        "# robot controller: KRC4",
        "# robot serial: 4711",
        "# load: 250 kg",
        "# measured on a warm robot",
        "#",
        "## ----",
        "# : x",
    ],
)
def test_other_comments_are_kept_silently(read, comment):
    assert read(comment, "{A},X,Y,Z", "{Q},1,2,3").findings == ()


def test_keys_below_the_header_are_told(read):
    r = read("{A},X,Y,Z", "{Q},1,2,3", "# sigma_mm: 0.02", "# here it rained: 1", "{Q},1,2,3")
    assert told(r) == [("MEA004", 3)]
    assert np.isnan(r.sigma).all()


def test_rows_without_a_reading(read):
    lines = ["{A},X,Y,Z,T,TARGET,SESSION", "{Q},1,2,3,0,M1,a", *["{Q},,-,nan,,M2,b"] * 7, "{Q},,2,,5,M1,c"]
    r = read(*lines)
    assert len(r) == 2
    assert r.line.tolist() == [2, 10]
    assert r.targets == ("M1",)
    assert r.sessions == ("a", "c")
    assert np.allclose(r.value[1], [np.nan, 0.002, np.nan], equal_nan=True)
    assert told(r) == [("MEA003", 3)]
    assert "7 rows have no reading and are excluded (lines 3, 4, 5, 6, 7 and 2 more)" in r.findings[0].message
    assert r.findings[0].severity == "info"


def test_a_plan_that_is_not_filled_in(read):
    finding = refused(read, "{A},DX,DY,DZ", "{Q},,,", "{Q},,,")
    assert finding.code == "MEA002"
    assert "contains no readings yet" in finding.message


def test_targets_against_stated_places(read):
    finding = refused(read, "# target M1: 1 2 3", "{A},X,Y,Z,TARGET", "{Q},1,2,3,M2", "{Q},1,2,3,m1")
    assert (finding.code, finding.line) == ("MEA001", 4)
    assert "'m1' differs from 'M1' by its case" in finding.message
    assert "line 1" in finding.help

    r = read("# target Ma: 1 2 3", "# target Mb: 1 2 3", "{A},X,Y,Z,TARGET", "{Q},1,2,3,Ma", "{Q},1,2,3,Mc")
    assert told(r) == [("MEA005", 2)]
    assert "no row has the target 'Mb'; did you mean 'M" in r.findings[0].message
    assert r.places.keys() == {"Ma"}

    r = read("# target Ma: 1 2 3", "{A},X,Y,Z", "{Q},1,2,3")
    assert told(r) == [("MEA005", 1)]
    assert "the file has no column TARGET" in r.findings[0].message

    # two targets may differ by case alone, if both are stated
    r = read("# target a: 1 2 3", "# target A: 4 5 6", "{A},X,Y,Z,TARGET", "{Q},1,2,3,A", "{Q},1,2,3,a")
    assert r.targets == ("A", "a")
    assert r.findings == ()


def test_a_frame_stated_for_deflections(read):
    assert told(read("# frame: tracker", "{A},DX,DY,DZ", "{Q},1,2,3")) == [("MEA009", 0)]
    assert told(read("# frame: robot", "{A},DX,DY,DZ", "{Q},1,2,3")) == []


def test_time_that_runs_backwards(read):
    rows = [f"{{Q}},1,2,3,{t},{s}" for t, s in ((5, "a"), (1, "b"), (6, "a"), (2, "b"), (2, "b"))]
    assert told(read("{A},X,Y,Z,T,SESSION", *rows)) == []
    r = read("{A},X,Y,Z,T,SESSION", *rows, "{Q},1,2,3,1.5,b", "{Q},1,2,3,5,a")
    assert told(r) == [("MEA006", 7)]
    assert "1.5 is before" in r.findings[0].message
    assert "(and 1 more)" in r.findings[0].message


def test_optional_columns_that_nobody_filled_in(read):
    r = read("{A},X,Y,Z,T,TEMP,SIGMA,REPEAT,SESSION,DIR1", "{Q},1,2,3,,,,,,", "{Q},1,2,3,-,-,-,-,-,-")
    assert (r.time, r.temperature, r.direction, r.sessions) == (None, None, None, ("",))
    assert r.repeat.tolist() == [0, 0]


def test_repeats_without_the_column(read):
    """Rows that say the same repeat each other; any difference of the state parts them."""
    base = {"FX": 1, "TARGET": "M", "SESSION": "s", "DIR3": 1, "TEMP": 20, "SIGMA": 0.1, "T": 0}
    others = [
        {},
        {"FX": 2},
        {"TARGET": "N"},
        {"SESSION": "t"},
        {"DIR3": 0},
        {"TEMP": 21},
        {"SIGMA": 1, "T": 1},
    ]
    rows = [",".join(["{Q},1,2,3", *(str((base | other)[name]) for name in base)]) for other in others]
    r = read("{A},X,Y,Z," + ",".join(base), *rows, "1" + rows[0].replace("{Q}", Q)[1:])
    assert r.repeat.tolist() == [0, -1, -1, -1, -1, -1, 0, -1]
    # numbers count in the order of the first row
    rows = [f"{a2},0,0,0,0,0,1,2,3" for a2 in (5, 4, 5, 3, 4, 6)]
    assert read("{A},X,Y,Z", *rows).repeat.tolist() == [0, 1, 0, -1, 1, -1]


def test_repeats_by_the_column(read):
    cells = [
        ("p", "M", "s"),
        ("q", "M", "s"),
        ("p", "M", "s"),
        ("p", "N", "s"),
        ("p", "M", "t"),
        ("", "M", "s"),
    ]
    rows = [f"{{Q}},1,2,3,{','.join(c)}" for c in [*cells, ("", "M", "s"), ("p", "M", "t")]]
    r = read("{A},X,Y,Z,REPEAT,TARGET,SESSION", *rows)
    assert r.repeat.tolist() == [0, -1, 0, -1, 1, -1, -1, 1]
    assert r.findings == ()


def test_repeats_of_a_state_that_was_commanded_anew(read):
    r = read("{A},FZ,X,Y,Z,REPEAT", "{Q},-2500,1,2,3,1", "0,-90.05,90,0,45,10,-2600,1,2,3,1")
    assert r.repeat.tolist() == [0, 0]
    assert r.findings == ()


@pytest.mark.parametrize("other", ["0,-90.2,90,0,45,10,-2500", "0,-90,90,0,45,10,0"])
def test_a_repeat_that_is_no_repeat(read, other):
    """A REPEAT column that counts, instead of naming a state, would take deflections for noise."""
    rows = ["{Q},-2500,1,2,3,1", f"{other},1,2,3,1", "{Q},-2500,1,2,3,1", "{Q},-2500,1,2,3,2"]
    r = read("{A},FZ,X,Y,Z,REPEAT", *rows, "{Q},-2501,1,2,3,2")
    assert r.repeat.tolist() == [0, -1, 0, 1, 1]
    assert told(r) == [("MEA007", 3)]
    assert "in line 2;" in r.findings[0].message


def test_robot_named(csv):
    assert robot_named(csv("# x", "# Robot: my arm ", "nonsense,,", "1")) == "my arm"
    assert robot_named(csv("{A},X,Y,Z", "{Q},1,2,3", "# robot: late")) == ""
    with pytest.raises(Refusal, match="FIL001"):
        robot_named(csv("x").with_name("none.csv"))


def test_parts(read):
    r = read("{A},X,Y,Z,TARGET,T", *(f"{{Q}},{i},2,3,M{i % 2},{i}" for i in range(4)))
    part = r.part(r.target == 1)
    assert len(part) == 2
    assert part.targets == r.targets
    assert part.time.tolist() == [1, 3]
    assert part.line.tolist() == [3, 5]
    assert part.direction is None
    assert len(r.part([])) == 0


# --- several files


def test_joined(read):
    head = "{A},X,Y,Z,TARGET,SESSION,REPEAT"
    a = read("# robot: r", "# target M: 1 2 3", head, "{Q},1,2,3,M,x,1", "{Q},1,2,4,M,x,1", name="a.csv")
    b = read("{A},X,Y,Z,TARGET,A,B,C", "{Q},5,2,3,N,0,0,0", "{Q},6,2,3,M,,,", "{Q},7,2,3,M,,,", name="b.csv")
    both = joined([a, b])
    assert [path.name for path in both.files] == ["a.csv", "b.csv"]
    assert both.digests == a.digests + b.digests
    assert both.robot == "r"
    assert both.targets == ("M", "N")
    assert both.target.tolist() == [0, 0, 1, 0, 0]
    assert both.sessions == ("a:x", "b")
    assert both.session.tolist() == [0, 0, 1, 1, 1]
    assert both.repeat.tolist() == [0, 0, -1, 1, 1]
    assert np.allclose(both.value[:, 0], np.array([1, 1, 5, 6, 7]) * MM)
    assert np.isnan(both.rotation[[0, 1, 3, 4]]).all()
    assert np.allclose(both.rotation[2], np.eye(3))
    assert both.places.keys() == {"M"}
    assert both.where(3) == (str(b.files[0]), 3)
    assert joined([a]) is a


def test_sessions_of_files_with_the_same_name(read, tmp_path):
    (tmp_path / "1").mkdir()
    a, b = (read("{A},X,Y,Z", "{Q},1,2," + name[0], name=name) for name in ("1/x.csv", "2.csv"))
    b = replace(b, files=(tmp_path / "2" / "x.csv",))
    sessions = joined([a, b]).sessions
    assert sessions == (str(a.files[0]), str(b.files[0]))


@pytest.mark.parametrize(
    ("comments", "columns", "cells", "what"),
    [
        ((), "DX,DY,DZ,TARGET", "1,2,3,M", "values: DX,DY,DZ here, but X,Y,Z"),
        (("# frame: robot",), "X,Y,Z,TARGET", "1,2,3,M", "frame: robot here, but tracker"),
        (("# tool: 0 0 1.5",), "X,Y,Z,TARGET", "1,2,3,M", "tool: 0 0 1.5 0 0 0 here, but not stated"),
        (("# target M: 1 2 4",), "X,Y,Z,TARGET", "1,2,3,M", "place of target M: 1 2 4 here, but 1 2 3"),
        (("# robot: other",), "X,Y,Z,TARGET", "1,2,3,M", "robot: other here, but one"),
        (("# sigma_deg: 2",), "X,Y,Z,TARGET", "1,2,3,M", "sigma_deg: 2 here, but 1"),
        ((), "X,Y,Z", "1,2,3", "column TARGET: none here, but given"),
        ((), "X,Y,Z,TARGET,TEMP", "1,2,3,M,20", "column TEMP: given here, but none"),
        ((), "X,Y,Z,TARGET,T", "1,2,3,M,20", "column T: given here, but none"),
        ((), "X,Y,Z,TARGET,DIR2", "1,2,3,M,1", "column DIR1: given here, but none"),
    ],
)
def test_files_that_do_not_belong_together(read, comments, columns, cells, what):
    said = ("# robot: One", "# sigma_deg: 1", "# target M: 1 2 3")
    a = read(*said, "{A},X,Y,Z,TARGET", "{Q},1,2,3,M", name="a.csv")
    b = read(*comments, "{A}," + columns, "{Q}," + cells, name="b.csv")
    with pytest.raises(Refusal) as caught:
        joined([a, b])
    finding = caught.value.findings[0]
    assert finding.code == "MEA008"
    assert what in finding.message
    assert "a.csv" in finding.message
    assert finding.file.endswith("b.csv")


def test_files_of_other_joints_and_the_same_file_twice(read):
    a = read("{A},X,Y,Z", "{Q},1,2,3", name="a.csv")
    b = read("E1,{A},X,Y,Z", "5,{Q},1,2,3", joints=(("E1", True), *SIX), name="b.csv")
    with pytest.raises(Refusal, match=r"b.csv: MEA008 the files differ in joints: .*E1 \(mm\).*but .*a.csv"):
        joined([a, b])
    with pytest.raises(Refusal, match=r"c.csv: MEA008 the file equals .*a.csv"):
        joined([a, read("{A},X,Y,Z", "{Q},1,2,3", name="c.csv")])


# --- writing


def test_a_plan_is_filled_in_and_read(csv):
    joints = (("E1", True), *SIX)
    q = np.array([[1.5, 0, -1, 1, 0, 0.5, 0], [1.25, 0, -1, 1, 0, 0.5, 0], [1.5, 0, -1, 1, 0, 0.5, 0]])
    wrench = np.array([[0, 0, -2500.0, 0, 12.5, 0]] * 3)
    plan = planned(joints, q, wrench, True, robot="kr", tool=Poses.identity(), sigma=2e-5)
    assert plan.where(0) == ("", 0)
    assert plan.repeat.tolist() == [0, -1, 0]
    approach = np.repeat([[1], [1], [-1]], 7, axis=1)
    assert planned(joints, q, wrench, True, direction=approach).repeat.tolist() == [-1, -1, -1]
    text = measurements_csv(plan, about=["Hang 250 kg.", "Wait\nlong enough"]).decode()
    assert text.splitlines()[:8] == [
        "# Hang 250 kg.",
        "# Wait",
        "# long enough",
        "# robot: kr",
        "# tool: 0 0 0 0 0 0",
        "# sigma_mm: 0.02",
        "E1,A1,A2,A3,A4,A5,A6,FZ,MY,DX,DY,DZ,REPEAT",
        "1500.0000,0.0000,-57.2958,57.2958,0.0000,28.6479,0.0000,-2500,12.5,,,,1",
    ]
    with pytest.raises(Refusal, match="contains no readings yet"):
        read_measurements(csv(text), joints)
    filled = read_measurements(csv(text.replace(",,,,", ",0.1,0.2,-1.5,")), joints)
    assert np.allclose(filled.q, q, atol=1e-4 * DEG)
    assert filled.repeat.tolist() == [0, -1, 0]
    assert np.allclose(filled.value, np.array([0.1, 0.2, -1.5]) * MM)


def words(exclude=()):
    letters = st.characters(exclude_categories=("C", "Z"), include_characters=" ")
    return st.text(letters, min_size=1, max_size=8).map(str.strip).filter(lambda w: w and not is_missing(w))


def some(values, count):
    return st.lists(values, min_size=count, max_size=count).map(np.array)


def grouped(keys):
    """Rows with the same key share a number in the order of their first; -1 for one that is alone."""
    several = [key for key in dict.fromkeys(keys) if keys.count(key) > 1]
    return [several.index(key) if key in several else -1 for key in keys]


@st.composite
def readings(draw):
    """Readings as a file can state them: every name is used, and repeats are of one state."""
    rows = draw(st.integers(1, 6))
    slides = draw(st.lists(st.booleans(), min_size=1, max_size=7))
    joints = tuple((f"{'E' if moves else 'A'}{index}", moves) for index, moves in enumerate(slides, 1))
    deflection = draw(st.booleans())
    number = st.floats(-5000, 5000)
    q = draw(some(some(st.floats(-6, 6), len(joints)), rows))
    wrench = draw(some(some(st.one_of(st.just(0.0), number), 6), rows))
    state = draw(some(st.integers(0, rows), rows)) % rows  # rows that share a state
    q, wrench = q[state], wrench[state]
    value = draw(some(some(number, 3), rows)) * MM
    value[draw(some(st.sampled_from([[0, 0, 0], [0, 1, 0], [1, 0, 1]]), rows)).astype(bool)] = np.nan

    def named(names):
        chosen = draw(some(st.sampled_from(names), rows)).tolist()
        used = tuple(dict.fromkeys(chosen))
        return used, [used.index(name) for name in chosen]

    target_names = draw(st.lists(words(), max_size=3, unique_by=str.casefold))
    targets, target = named(target_names) if target_names else ((), [0] * rows)
    session_names = draw(st.lists(words(), max_size=2, unique=True))
    sessions, session = named(session_names) if session_names else (("",), [0] * rows)
    stated = [name for name in targets if draw(st.booleans())]
    places = {name: draw(some(number, 3)) * MM for name in stated}
    ids = draw(st.lists(st.integers(0, 1), min_size=rows, max_size=rows))
    repeat = grouped(list(zip(ids, state.tolist(), target, session, strict=True)))
    if draw(st.booleans()):
        repeat = [-1] * rows
    rotation = None
    if draw(st.booleans()):
        rotation = rotation_from_abc(draw(some(some(st.floats(-3, 3), 3), rows)))
        rotation[draw(some(st.booleans(), rows))] = np.nan
    sigma = draw(some(st.one_of(st.just(np.nan), st.just(2e-5), st.floats(1e-6, 1e-3)), rows))
    return Readings(
        files=(),
        digests=(),
        robot=draw(st.one_of(st.just(""), st.sampled_from(["kuka_kr270", "my arm: 2"]))),
        joints=joints,
        deflection=deflection,
        in_robot_frame=draw(st.booleans()) and not deflection,
        tool=draw(
            st.none() | st.builds(Poses.from_abc, some(st.floats(-1, 1), 3), some(st.floats(-3, 3), 3))
        ),
        targets=targets,
        places=places,
        q=q,
        wrench=wrench,
        value=value,
        rotation=rotation,
        target=np.array(target),
        sigma=sigma,
        sigma_turn=draw(st.none() | st.floats(1e-6, 1e-3)),
        repeat=np.array(repeat),
        session=np.array(session),
        sessions=sessions,
        time=draw(st.none() | some(st.floats(0, 1e9), rows)),
        temperature=draw(st.none() | some(st.floats(-20, 80), rows)),
        direction=draw(st.none() | some(some(st.sampled_from([-1.0, 0.0, 1.0]), len(joints)), rows)),
        file=np.full(rows, -1),
        line=np.zeros(rows),
    )


def same(one, other, absolute, relative=0.0):
    if one is None or other is None:
        return one is other
    return np.allclose(one, other, atol=absolute, rtol=relative, equal_nan=True)


@settings(max_examples=examples(150), deadline=None)
@given(readings())
def test_what_is_written_reads_back(tmp_path_factory, r):
    # 0, 0, 0 is what a tracker writes where the beam was lost
    assume(not (np.round(r.value, 7) == 0.0).all(axis=1).any())
    path = tmp_path_factory.getbasetemp() / "written.csv"
    path.write_bytes(measurements_csv(r))
    back = read_measurements(path, r.joints)
    for name in ("robot", "joints", "deflection", "in_robot_frame", "targets", "sessions"):
        assert getattr(back, name) == getattr(r, name), name
    for name in ("target", "session", "repeat"):
        assert getattr(back, name).tolist() == getattr(r, name).tolist(), name
    # a drawn tool or target may lie so close to its frame that its lengths look like metres (MEA014)
    assert {finding.code for finding in back.findings} <= {"MEA006", "MEA014"}
    half = 0.5001
    units = np.array([MM if slides else DEG for _, slides in r.joints])
    assert same(back.q / units, r.q / units, half * 1e-4)
    assert same(back.wrench, r.wrench, 0, half * 1e-5)
    assert same(back.value, r.value, half * 1e-4 * MM)
    assert same(back.rotation, r.rotation, 3 * half * 1e-4 * DEG)
    assert same(back.sigma, r.sigma, 0, half * 1e-5)
    assert same(back.sigma_turn, r.sigma_turn, 0, half * 1e-5)
    assert same(back.time, r.time, half * 1e-3)
    assert same(back.temperature, r.temperature, half * 1e-3)
    assert same(back.direction, r.direction, 0)
    assert back.places.keys() == r.places.keys()
    assert all(same(back.places[name], r.places[name], half * 1e-4 * MM) for name in r.places)
    assert (back.tool is None) == (r.tool is None)
    if r.tool is not None:
        assert same(back.tool.position, r.tool.position, half * 1e-4 * MM)
        assert same(back.tool.rotation, r.tool.rotation, 3 * half * 1e-4 * DEG)
    # the second time nothing is rounded any more
    again = replace(back, findings=(), files=(), digests=(), file=np.full(len(back), -1))
    path.write_bytes(measurements_csv(again))
    assert same(read_measurements(path, r.joints).q, back.q, 0)


@settings(max_examples=examples(200), deadline=None)
@given(st.text('A1,;XYZ=:#. -\n\t"nm[]', max_size=60), st.integers(0, 2))
def test_no_text_ends_in_anything_but_a_refusal(tmp_path_factory, text, where):
    parts = ["# tool: 0 0 1\n", "A1,X,Y,Z,REPEAT\n", "1,2,3,4,5\n"]
    parts.insert(where, text)
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_text("".join(parts), encoding="utf-8")
    with suppress(Refusal):
        assert len(read_measurements(path, (("A1", False),))) > 0


def test_a_thousand_rows_are_read_at_once(csv):
    rng = np.random.default_rng(1)
    plan = planned(SIX, rng.uniform(-3, 3, (1000, 6)), rng.uniform(-2000, 2000, (1000, 6)), False)
    path = csv(measurements_csv(replace(plan, value=rng.uniform(-2, 2, (1000, 3)))).decode())
    took = []
    for _ in range(5):
        begin = time.process_time()  # not that of others on a busy machine
        assert len(read_measurements(path, SIX)) == 1000
        took.append(time.process_time() - begin)
    assert min(took) < 0.05
