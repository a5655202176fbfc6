"""Poles of two rotary axes: what is written there, read by a reader of words that shares nothing with the package.

The judge knows lines of words, R = Rz(C) Ry(B) Rx(A), and that words run linearly between two blocks (directions on a
great circle).  It asks of every block under force, inserted or not: is the tool's axis that of its own place on the
path, and do the words stay near those of that place.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import pytest
from conftest import CELL
from test_gcode_read import body

from postproc.base import rotary_words
from postproc.compensation.orientations import shares_between, shortest
from postproc.languages.gcode.orientation_words import Angles

WORD = re.compile(r"([A-Z])(?:\d?=)?([-+]?\d*\.?\d+)")

HEADS = {
    "fanuc": ["%", "O100", "G21 G90 G17 G54", "T1 M6", "G43.4 H1"],
    "linuxcnc": ["%", "G21 G90 G17 G54", "T1 M6", "G43.4"],
    "sinumerik": ["G54 G71 G90 G17", "T1 D1", "TRAORI"],
}
NAMES = {"fanuc": "part.nc", "linuxcnc": "part.ngc", "sinumerik": "part.mpf"}
TILT = 0.07
"""[deg] By which the force of these tests turns the tool at most."""

SWING = 3.05
"""[deg] By which an axis may leave its place near its pole, and half a written step."""


def remark(control: str, text: str) -> str:
    return f";{text}" if control == "sinumerik" else f"({text})"


def program(control: str, points: list[str], force: str = "400 300 -200") -> list[str]:
    """A cut along ``points``, the first of which is where it begins, from above."""
    first, *cut = points
    return [
        *HEADS[control],
        f"G0 {first} Z30.",
        f"G1 {first} Z0. F2000",
        remark(control, f"FORCE {force} @FEED"),
        *(f"G1 {point}" for point in cut),
        remark(control, "FORCE OFF"),
        "G1 Z30.",
        "M30",
    ]


@dataclass
class Block:
    place: np.ndarray
    words: np.ndarray  # A, B, C [deg], or A3, B3, C3
    under_force: bool


def blocks(text: str) -> list[Block]:
    """The motions of a program with what is in force at their ends."""
    place, words, force, found = np.zeros(3), np.zeros(3), False, []
    for line in text.splitlines():
        if "FORCE" in line:
            force = "OFF" not in line
            continue
        line = re.sub(r"\(.*?\)|;.*", "", line)
        if not re.match(r"\s*(N\d+\s*)?(G0?[0-3]\b|[XYZABC])", line):
            continue
        moves = False
        for letter, number in WORD.findall(line):
            if letter in "XYZ":
                place["XYZ".index(letter)], moves = float(number), True
            elif letter in "ABC":
                words["ABC".index(letter)], moves = float(number), True
        if moves:
            found.append(Block(place.copy(), words.copy(), force))
    return found


def axis(words: np.ndarray) -> np.ndarray:
    """The tool's axis Rz(C) Ry(B) Rx(A) z, of words [deg]."""
    a, b, c = np.radians(words)
    x, y, z = 0.0, -np.sin(a), np.cos(a)
    x, z = np.cos(b) * x + np.sin(b) * z, -np.sin(b) * x + np.cos(b) * z
    return np.array([np.cos(c) * x - np.sin(c) * y, np.sin(c) * x + np.cos(c) * y, z])


def direction(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def along(one: np.ndarray, two: np.ndarray, share: float, vectors: bool) -> np.ndarray:
    """The tool's axis between two blocks."""
    if not vectors:
        return axis(one + share * (two - one))
    a, b = direction(one), direction(two)
    angle = np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)
    if angle < 1e-9:
        return a
    return (np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle)


def between(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


@dataclass
class Judged:
    """Of every block under force: angle [deg] of its axis from that of its place; change (K, 3) of its words from those
    of its place; step (K, 3) and due (K, 3): how the words change from the block before it, there and in the
    original."""

    angle: np.ndarray
    change: np.ndarray
    step: np.ndarray
    due: np.ndarray
    middle: np.ndarray


def judge(original: str, written: str, vectors: bool = False) -> Judged:
    """Blocks are placed along the original by their length: the correction of a cut is nearly the same all along, and
    what it differs between two blocks of the original is taken as linear."""
    before, after = blocks(original), blocks(written)
    ends = [i for i, block in enumerate(before) if block.under_force]
    begin = before[ends[0] - 1]
    cut = [block for block in after if block.under_force]
    lead_in = after[next(i for i, block in enumerate(after) if block.under_force) - 1]
    first = lead_in  # a correction that begins in the air
    if np.linalg.norm(cut[0].place - begin.place) < 8 and np.linalg.norm(lead_in.place - begin.place) < 1e-6:
        first, cut = cut[0], cut[1:]  # or with a transition
    # of each block of the original the one of the output that stands for it: the nearest with its correction
    shift, at, marks = first.place - begin.place, 0, []
    for end in ends:
        goal = before[end].place
        distance = [np.linalg.norm(block.place - goal - shift) for block in cut[at:]]
        at += int(np.argmin(distance))
        marks.append(at)
        shift = cut[at].place - goal
        at += 1
    rows, last = [], first
    rows.append((between_axes(first.words, begin.words, vectors), first.words - begin.words,
                 first.words - begin.words, np.zeros(3), 0.0))  # fmt: skip
    here, number = begin, 0
    place_before = begin.words
    for end, mark in zip(ends, marks, strict=True):
        goal = before[end]
        start_shift = last.place - here.place if number else first.place - begin.place
        end_shift = cut[mark].place - goal.place
        way = goal.place - here.place
        share_before = 0.0
        for block in cut[number : mark + 1]:
            share = 1.0
            for _ in range(3):
                shift = start_shift + share * (end_shift - start_shift)
                share = float((block.place - shift - here.place) @ way / (way @ way))
            due = here.words + share * (goal.words - here.words)
            wanted = along(here.words, goal.words, share, vectors)
            own = direction(block.words) if vectors else axis(block.words)
            half = along(last.words, block.words, 0.5, vectors)
            due_half = along(here.words, goal.words, 0.5 * (share + share_before), vectors)
            rows.append((between(own, wanted), block.words - due, block.words - last.words, due - place_before,
                         between(half, due_half)))  # fmt: skip
            last, place_before, share_before = block, due, share
        here, number = goal, mark + 1
    assert number == len(cut)
    return Judged(*(np.array(column) for column in zip(*rows, strict=True)))


def between_axes(one: np.ndarray, two: np.ndarray, vectors: bool) -> float:
    return between(direction(one), direction(two)) if vectors else between(axis(one), axis(two))


def run(compensate, job, control: str, points: list[str], **more: str):
    vectors = "A3=" in points[0]
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\nmax_growth: 20\n" + f"dialect: {{name: {control}}}\n")
    lines = program(control, points, **more)
    source = job.write(lines, "\n", NAMES[control])
    done = compensate(source, "--force", "--json", "-")
    assert done.code in (0, 3), done.out + done.err
    assert done.json["uncorrected"] == 0, done.out
    written = (job.folder / "compensated" / NAMES[control]).read_text()
    return done.json, judge("\n".join(lines), written, vectors), written


def leaning(pair: str, lean: float, outer: float) -> str:
    """Words of a lean; the outer word of the pair turns it about the upright."""
    inner, other = pair
    return f"{inner}{lean:.3f} {other}{outer:.3f}"


PAIRS = {"BC": (-45.0, -30.0), "AC": (60.0, 75.0), "AB": (3.0, -2.0)}


@pytest.mark.slow
@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("lean", range(9))
def test_a_cut_that_begins_upright_and_leans(compensate, job, pair, lean):
    one, two = PAIRS[pair]
    points = [
        f"X0 Y0 {leaning(pair, 0, one)}",
        f"X60 Y0 {leaning(pair, lean, one)}",
        f"X120 Y20 {leaning(pair, lean, two)}",
        f"X200 Y20 {leaning(pair, 0, two)}",
    ]
    report, judged, written = run(compensate, job, "fanuc", points)
    assert judged.angle.max() <= TILT, written
    assert np.abs(judged.change).max() <= SWING, written
    assert (np.abs(judged.step - judged.due) <= 2 * SWING).all(), written
    assert judged.middle.max() <= TILT, written
    assert report["path_error_deg"]["max"] <= TILT


CUTS = {
    "leans to the other side": ["X0 B0 C-45", "X60 B-3 C-45", "X150 B-5 C-30"],
    "C near 180": ["X0 B0 C178", "X60 B2 C181", "X150 B4 C185"],
    "C near -180": ["X0 B1 C-178", "X60 B0 C-182", "X150 B3 C-179"],
    "crosses the pole in the middle": ["X0 B3 C20", "X150 B-3 C20"],
    "crosses it while C turns": ["X0 B2 C20", "X150 B-4 C50"],
    "upright first, leans later": ["X0 B0 C-45", "X60 C-45", "X100 B6", "X150 B6 C-60"],
    "upright all along": ["X0 B0 C-45", "X60", "X150"],
    "hardly leans": ["X0 B0.05 C-45", "X60 B0.1 C-40", "X150 B0.02 C-45"],
    "C turns far": ["X0 B5 C-70", "X200 B5 C100"],
    "turns C where it is upright": ["X0 B0 C-45", "X60 B0 C60", "X150 B3 C60"],
    "A crosses the pole": ["X0 A2 C10", "X80 A-2 C10", "X150 A-2 C20"],
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("control", HEADS)
@pytest.mark.parametrize("name", CUTS)
def test_words_stay_near_those_of_their_own_place(compensate, job, control, name):
    points = [
        f"{point.split()[0]} Y{10 * k} {' '.join(point.split()[1:])}" for k, point in enumerate(CUTS[name])
    ]
    if control == "sinumerik":
        points = [re.sub(r"([ABC])(-?[\d.]+)", r"\1=\2", point) for point in points]
    report, judged, written = run(compensate, job, control, points)
    assert judged.angle.max() <= TILT, written
    assert np.abs(judged.change).max() <= SWING, written
    assert (np.abs(judged.step - judged.due) <= 2 * SWING).all(), written
    assert judged.middle.max() <= TILT, written
    assert report["path_error_deg"]["max"] <= TILT
    # what the report says is off is told as well
    told = {finding["code"] for finding in report["findings"]}
    assert ("COR005" in told) == (report["angle_after_deg"]["max"] > 0.01)
    assert ("COR006" in told) == (report["path_error_deg"]["max"] > 0.01)


@pytest.mark.slow
def test_how_words_run_between_blocks_is_told(compensate, job):
    """What another control would do is half a degree elsewhere here: said, by the figure of this reader."""
    one, two = np.array([0.0, 20.0, -30.0]), np.array([0.0, 20.0, 10.0])
    apart = between(axis(0.5 * (one + two)), direction(axis(one) + axis(two)))
    report, _, _ = run(compensate, job, "fanuc", ["X0 Y0 B20 C-30", "X60 Y0", "X120 Y20 C10"])
    (told,) = [finding for finding in report["findings"] if finding["code"] == "COR020"]
    assert told["severity"] == "info"
    assert f"up to {apart:.4f} deg otherwise (1 motions)" in told["message"]
    assert apart > 1.0
    report, _, _ = run(compensate, job, "fanuc", ["X0 Y0 B20 C-30", "X60 Y0", "X120 Y20 B25"])
    assert "COR020" not in [finding["code"] for finding in report["findings"]]


def vector(lean: float, about: float) -> str:
    a, b = np.radians([lean, about])
    x, y, z = np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)
    return f"A3={x:.6f} B3={y:.6f} C3={z:.6f}"


@pytest.mark.slow
@pytest.mark.parametrize("lean", range(9))
def test_vectors_have_no_pole_there(compensate, job, lean):
    points = [
        f"X0 Y0 {vector(0, 0)}",
        f"X60 Y0 {vector(lean, -45)}",
        f"X120 Y20 {vector(lean, -30)}",
        f"X200 Y20 {vector(20, 60)}",
    ]
    report, judged, written = run(compensate, job, "sinumerik", points)
    assert judged.angle.max() <= TILT, written
    assert judged.middle.max() <= TILT, written
    assert max(report["angle_after_deg"]["max"], report["path_error_deg"]["max"]) <= 0.01


@pytest.mark.slow
def test_a_lead_in_that_turns_the_tool(compensate, job):
    """In air the tool leans back to upright, passes the pole, and enters the cut on the other side of it."""
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\nmax_growth: 20\ndialect: {name: fanuc}\n")
    lines = [
        *HEADS["fanuc"], "G0 X-60 Y-20 Z60. B8. C-40.", "G1 X-20 Y-5 Z10 B3 C-42 F3000", "G1 X0 Y0 Z0 B-1 C-45",
        "(FORCE 400 300 -200 @FEED)", "G1 X60 Y5 B-3.", "G1 X140 Y0 B1. C-50.", "(FORCE OFF)",
        "G1 X160 Y10 Z10 B5 C-60", "G0 Z60 B0 C0", "M30",
    ]  # fmt: skip
    source = job.write(lines, "\n", "part.nc")
    report = compensate(source, "--force", "--json", "-").json
    written = (job.folder / "compensated" / "part.nc").read_text()
    judged = judge("\n".join(lines), written)
    assert judged.angle.max() <= TILT, written
    assert np.abs(judged.change).max() <= SWING, written
    assert report["uncorrected"] == 0
    # what is in air ends with the words that it had, or those of the corrected begin of the cut
    before, after = blocks("\n".join(lines)), blocks(written)
    for one, other in (
        (before[0], after[0]),
        (before[1], after[1]),
        (before[-2], after[-2]),
        (before[-1], after[-1]),
    ):
        np.testing.assert_allclose(one.words, other.words, atol=SWING)
        assert between(axis(one.words), axis(other.words)) <= TILT


@pytest.mark.sample(1)
@pytest.mark.parametrize("gain", ["0.5", "0.25"])
def test_a_part_of_the_correction_swings_no_more(compensate, job, gain):
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\nmax_growth: 20\ndialect: {name: fanuc}\n")
    lines = program("fanuc", ["X0 Y0 B0 C-45", "X60 Y0 B2", "X120 Y20 B-2 C-30"])
    source = job.write(lines, "\n", "part.nc")
    done = compensate(source, "--force", "--gain", gain, "--json", "-")
    judged = judge("\n".join(lines), (job.folder / "compensated" / "part.nc").read_text())
    assert done.json["uncorrected"] == 0
    assert judged.angle.max() <= TILT
    assert np.abs(judged.change).max() <= SWING


@pytest.mark.slow
def test_arcs_turn_by_their_words(compensate, job):
    """Words run evenly with the angle of an arc; inserted parts of it have those of their place."""
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\nmax_growth: 20\ndialect: {name: fanuc}\n")
    lines = program("fanuc", ["X0 Y0 B4 C-90", "X40 Y0 B4 C-90"])
    lines[-3:-3] = ["G3 X80 Y40 I0 J40 B4 C0", "G3 X0 Y40 I-40 J0 B0 C120"]
    source = job.write(lines, "\n", "part.nc")
    done = compensate(source, "--force", "--json", "-")
    assert done.json["uncorrected"] == 0, done.out
    found = [
        block for block in blocks((job.folder / "compensated" / "part.nc").read_text()) if block.under_force
    ]
    begin = int(np.argmin([np.linalg.norm(block.place - [40.0, 0.0, 0.0]) for block in found]))
    shift = found[begin].place - np.array([40.0, 0.0, 0.0])  # about the same all along
    round_ = found[begin + 1 :]
    assert len(round_) > 2
    for block in round_:
        x, y = block.place[:2] - shift[:2] - 40.0
        turn = (np.degrees(np.arctan2(y, x)) + 90.0) % 360.0
        first, second = turn / 90.0, (turn - 90.0) / 180.0
        wanted = (
            [0.0, 4.0, -90.0 + 90.0 * first] if first <= 1.01 else [0.0, 4.0 - 4.0 * second, 120.0 * second]
        )
        assert np.abs(block.words - wanted)[1] <= 0.3, block
        assert np.abs(block.words - wanted)[2] <= 10.0, block


@pytest.mark.slow
@pytest.mark.parametrize(
    "points",
    [
        ["X0 A0 B0 C-45", "X60 A1 B3 C-45", "X150 A-2 B-1 C-30"],  # three words
        ["X0 B0", "X60 B3", "X150 B-2"],  # one: the tilt across it remains
        ["X0 C10", "X60 C40", "X150 C-20"],  # one that does not tilt the tool
    ],
)
def test_other_numbers_of_words(compensate, job, points):
    points = [f"{point.split()[0]} Y0 {' '.join(point.split()[1:])}" for point in points]
    report, judged, written = run(compensate, job, "fanuc", points)
    assert judged.angle.max() <= TILT, written
    assert np.abs(judged.change).max() <= SWING, written
    assert judged.middle.max() <= TILT, written
    whole = points[0].count(" ") == 4
    assert (report["path_error_deg"]["max"] <= 0.01) == whole


@pytest.mark.slow
@pytest.mark.parametrize("turn", ["a: 30, b: 0, c: 0", "a: -120, b: 8, c: -5"])
def test_in_a_turned_base(compensate, job, turn):
    """The words turn the tool in the axes of the base, the pole is the base's z."""
    cell = re.sub(r"(bases:\n.*?)a: 0, b: 0, c: 0", rf"\1{turn}", CELL, count=1)
    assert cell != CELL
    job.cell(cell + "orientation: {a: 20, b: 0, c: 170}\nmax_growth: 20\ndialect: {name: fanuc}\n")
    lines = program("fanuc", ["X0 Y0 B0 C-45", "X60 Y0 B2", "X120 Y20 B-2 C-30"])
    source = job.write(lines, "\n", "part.nc")
    report = compensate(source, "--force", "--json", "-").json
    judged = judge("\n".join(lines), (job.folder / "compensated" / "part.nc").read_text())
    assert report["uncorrected"] == 0
    assert judged.angle.max() <= TILT
    assert np.abs(judged.change).max() <= SWING


@pytest.mark.parametrize("swing", [60.0, -0.1])
def test_an_axis_that_swings_is_not_written(compensate, job, monkeypatch, swing):
    """The read-back compares the whole orientation that the words say, though the turn about the tool is free."""
    values = Angles.values

    def swung(self, rotation, near):
        found = values(self, rotation, near)
        found[:, 2] += swing
        return found

    monkeypatch.setattr(Angles, "values", swung)
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\nmax_growth: 20\ndialect: {name: fanuc}\n")
    source = job.write(program("fanuc", ["X0 Y0 B0 C-45", "X60 Y0 B2", "X120 Y20 B-2 C-30"]), "\n", "part.nc")
    done = compensate(source, "--force", "--json", "-")
    assert (done.code, done.json["findings"][0]["code"]) == (1, "FIL008")
    assert job.nothing_written()


# The pair itself


@pytest.mark.parametrize("columns", [(2, 1), (2, 0), (1, 0)])
def test_a_pair_points_the_tool_where_it_can(columns):
    """All the way beyond a lean of 3 deg, to the last digit; nearer to the pole by no more than SWING."""
    random = np.random.default_rng(3)
    near = np.full((2000, 3), np.nan)
    near[:, columns[0]] = random.uniform(-4, 4, 2000)
    near[:, columns[1]] = np.radians(random.uniform(-10, 10, 2000)) - (
        0.0 if columns[0] == 2 else 0.5 * np.pi
    )
    tilt = np.radians(random.uniform(-0.1, 0.1, (2000, 3)))
    wanted = np.array([axis(np.degrees(np.nan_to_num(words))) for words in near]) + tilt
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    found = rotary_words.pointing(wanted, near)
    off = np.array(
        [between(axis(np.degrees(np.nan_to_num(w))), d) for w, d in zip(found, wanted, strict=True)]
    )
    away = np.abs(rotary_words.lean(near)) > np.radians(3.1)
    assert off[away].max() < 1e-5
    assert off.max() < 0.18
    change = np.abs(found - near)[:, list(columns)]
    assert np.degrees(change[:, 0]).max() <= 3.0 + 1e-9
    assert np.degrees(change[:, 1]).max() <= 0.2
    # the words are what their own rotation says
    np.testing.assert_allclose(
        rotary_words.angles_of(rotary_words.rotation_of(found), found + 0.1), found, atol=1e-9
    )


def test_the_outer_axis_moves_continuously_over_the_pole():
    """A tilt across the plane of the inner axis, from one side of the pole to the other."""
    lean = np.radians(np.linspace(-6, 6, 24001))
    near = np.stack([np.full(len(lean), np.nan), lean, np.full(len(lean), 0.7)], axis=1)
    across = np.array([-np.sin(0.7), np.cos(0.7), 0.0])
    wanted = np.array([axis(np.degrees(np.nan_to_num(words))) for words in near]) + np.radians(0.05) * across
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    outer = np.degrees(rotary_words.pointing(wanted, near)[:, 2] - 0.7)
    assert np.abs(np.diff(outer)).max() < 0.03  # of steps of 0.0005 deg
    assert outer[0] == pytest.approx(-0.05 / np.sin(np.radians(6)), rel=0.01)
    assert abs(outer[len(lean) // 2]) < 0.01
    assert np.abs(outer).max() == pytest.approx(3.0, abs=0.01)


@pytest.mark.parametrize(
    ("first", "last"),
    [
        (0.5, 12.0),
        (3.0, 30.0),
        (-4.0, 9.0),
        (20.0, 2.0),
        (5.0, 5.0),
        (183.0, 195.0),
        (171.0, 184.0),
        (-171.0, -184.0),
    ],
)
def test_the_shortest_of_many_segments_is_known(first, last):
    """They are even in u = asinh(lean / POLE); the shortest lies where the axes are nearest to their pole."""
    text = f"G43.4 H1\nG1 X0. Y0. Z0. B{first} C0. F1000\nG1 X100. B{last} C40.\n"
    path = body(text, "fanuc").toolpath
    row = np.array([len(path) - 1])
    low, high = np.zeros(1), np.ones(1)
    count = 20000
    part = np.linspace(0.0, 1.0, count + 1)
    many = np.repeat(row, count + 1)
    shares = shares_between(path, many, 0.0 * part, 0.0 * part + 1.0, part)
    smallest = float(np.diff(shares).min()) * count
    assert shortest(path, row, low, high)[0] == pytest.approx(min(1.0, smallest), rel=2e-3)
    assert (smallest < 0.99) == (first != last)


@pytest.mark.parametrize(("first", "last"), [(3.0, 15.0), (-9.0, 4.0), (0.5, 12.0)])
@pytest.mark.parametrize("turn", [180.0, -180.0])
def test_the_pole_half_a_turn_on_is_a_pole_too(first, last, turn):
    """Half a turn of the leaning axis lays the tool along the outer axis again: segments are as short as there."""

    def segments(more):
        text = f"G43.4 H1\nG1 X0. Y0. Z0. B{first + more} C0. F1000\nG1 X100. B{last + more} C40.\n"
        path = body(text, "fanuc").toolpath
        row, part = np.array([len(path) - 1]), np.linspace(0.0, 1.0, 21)
        many = np.repeat(row, len(part))
        shares = shares_between(path, many, 0.0 * part, 0.0 * part + 1.0, part)
        return [*shares, *shortest(path, row, np.zeros(1), np.ones(1))]

    np.testing.assert_allclose(segments(turn), segments(0.0), atol=1e-9)
