"""Sinumerik and KUKA.CNC: cases beside their dumps, bad cases with what is told, and laws of spelling."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from gcode_writing import DOWN, read
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.base.document import Document, apply
from postproc.base.findings import CODES
from postproc.base.geometry import rotation_from_abc, rotation_from_vector, vector_from_rotation
from postproc.base.units import DEG, MM
from postproc.languages.gcode import DIALECTS
from postproc.languages.gcode.orientation_words import UP, Angles, Vector, swing
from postproc.languages.gcode.sinumerik_expression import constant, expression_end

ROOT = Path(__file__).parent / "programs"
NAMES = {dialect.name: dialect for dialect in DIALECTS}
SINUMERIK, KUKA = NAMES["sinumerik"], NAMES["kuka_cnc"]
GOOD = [*sorted((ROOT / "sinumerik").glob("*.mpf")), *sorted((ROOT / "kuka_cnc").glob("*.nc"))]
BAD = [*sorted((ROOT / "sinumerik" / "bad").glob("*")), *sorted((ROOT / "kuka_cnc" / "bad").glob("*"))]


def dialect_of(path: Path):
    return NAMES[next(part for part in reversed(path.parts) if part in NAMES)]


def program(path: Path):
    return dialect_of(path).read((Document(path, path.read_bytes()),), DOWN)


@pytest.mark.parametrize("path", GOOD, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_case_reads_as_its_dump(path: Path) -> None:
    assert list(program(path).toolpath.dump()) == path.with_suffix(".dump").read_text().splitlines()


@pytest.mark.parametrize(
    ("code", "unit"), [("G70", 1.0), ("G71", 1.0), ("G700", 25.4), ("G710", 1.0), ("G700 G1 X2 F1\nG70", 1.0)]
)
def test_g70_is_the_unit_of_coordinates_alone(code: str, unit: float) -> None:
    """F stays mm a minute, unless G700 says the unit of both."""
    text = f"G54 G90 T1 D1\nG0 X0 Y0 Z0\n{code} G1 X1 F60\nM30\n"
    path = SINUMERIK.read((Document(Path("part.mpf"), text.encode()),), DOWN).toolpath
    assert path.feed[-1] == pytest.approx(unit * MM)
    assert path.position[-1, 0] == pytest.approx((25.4 if "G70" in code and "G71" not in code else 1.0) * MM)


def last(text: str) -> tuple[np.ndarray, int, str]:
    """Where the last motion ends [mm], its base and why it is refused, after ``text`` behind a known place."""
    raw = f"G90 G17 G54 G71 T1 D1\nG0 X0 Y0 Z5\nG1 Z-1 F100\n{text}\nM30\n".encode()
    path = SINUMERIK.read((Document(Path("part.mpf"), raw),), DOWN).toolpath
    row = len(path) - 1
    refused = path.constraints.refused
    return path.position[row] / MM, int(path.base[row]), refused[row].code if row in refused else ""


@pytest.mark.parametrize(
    "word", ["TOFFL=2", "TOFF[3]=2", "TOFFLR=2", "DL=1", "TCARR=1", "TOFFL=R1", "TOFFL=2\nZ1\nTOFFL=3"]
)
def test_a_tool_that_the_program_lengthens_or_turns_is_not_the_cells(word: str) -> None:
    place, _, code = last(f"{word}\nG1 X9 Y2 Z3")
    assert np.isnan(place).all()
    assert code == "GCO010"


@pytest.mark.parametrize("word", ["TOFFL=0", "TCARR=0", "TOFFL=2\nTOFFL=0", "TCARR=1\nTCARR=0"])
def test_it_is_the_cells_again_without_that(word: str) -> None:
    place, _, code = last(f"{word}\nG1 X9 Y2 Z3")
    assert place.tolist() == [9.0, 2.0, 3.0]
    assert code == ""


@pytest.mark.parametrize("word", ["OVR=50", "FGROUP(X,Y)", "ID=1 DO $AC_OVR=30", "FB=30"])
def test_a_feed_that_is_not_f_is_not_known(word: str) -> None:
    for text, known in (("", True), (f"{word}\n", word.startswith("FB")), (f"{word} ", False)):
        raw = f"G90 G17 G54 G71 T1 D1\nG1 X0 Y0 Z5 F100\n{text}G1 X9\nM30\n".encode()
        if word.startswith("ID") and text.endswith(" "):
            continue
        path = SINUMERIK.read((Document(Path("part.mpf"), raw),), DOWN).toolpath
        assert np.isfinite(path.feed[-1]) == known


def test_nothing_is_inserted_before_a_block_with_a_feed_of_its_own() -> None:
    """FB holds in its block alone, and what is inserted would run at the feed of the blocks before."""
    raw = b"G90 G17 G54 G71 G94 T1 D1\nG1 X0 Y0 Z5 F100\nG1 X9 FB=30\nG1 X20\nM30\n"
    path = SINUMERIK.read((Document(Path("part.mpf"), raw),), DOWN).toolpath
    assert list(path.constraints.no_insert_before) == [1]


@pytest.mark.parametrize(
    "name", ["$P_PFRAME", "$P_BFRAME", "$P_CHBFRAME[0]", "$P_ACTFRAME", "$P_UBFR", "$p_pframe"]
)
def test_a_frame_that_is_assigned_moves_the_coordinates(name: str) -> None:
    place, base, code = last(f"{name}=CTRANS(X,1)\nG1 X1 Y2 Z3")
    assert code in ("GCO014", "GCO019")
    assert base < 0 or np.isnan(place).any()


def test_the_programmed_frame_ends_with_trans() -> None:
    place, base, code = last("$P_PFRAME=CTRANS(X,1)\nTRANS\nG1 X1 Y2 Z3")
    assert (place.tolist(), base >= 0, code) == ([1.0, 2.0, 3.0], True, "")
    assert last("$P_BFRAME=CTRANS(X,1)\nTRANS\nG1 X1 Y2 Z3")[1:] == (-1, "GCO014")


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("GEOAX()\nG1 X1 Y2 Z3", ""), ("GEOAX(3,W)\nG1 X1 Y2 Z3", "GCO010"),
        ("GEOAX(3,W)\nTRAFOOF\nG1 X1 Y2 Z3", "GCO010"), ("CPRECON\nG1 X1 Y2 Z3", ""), ("CPRECOF\nG1 X1 Y2 Z3", ""),
        ('TRAFOON("A")\nG1 X1 Y2 Z3', "GCO010"), ('TRAFOON("A")\nTRAFOOF\nG1 X1 Y2 Z3', ""),
        ("TOFFON(Z,5)\nG1 X1 Y2 Z3", "GCO014"), ("LEADON(Y,X,1)\nG1 X1 Y2 Z3", "GCO014"),
        ("ID=1 WHENEVER $A_IN[1]==1 DO $AA_OFF[Z]=1\nG1 X1 Y2 Z3", "GCO019"),
        ("ID=1 WHENEVER $A_IN[1]==1 DO $A_OUT[1]=1\nG1 X1 Y2 Z3", ""),
    ],
)  # fmt: skip
def test_what_takes_the_axes_elsewhere_is_reported(text: str, code: str) -> None:
    assert last(text)[2] == code


@pytest.mark.parametrize("path", BAD, ids=lambda path: f"{path.parent.parent.name}-{path.stem}")
def test_a_bad_case_gives_the_codes_of_its_first_line(path: Path) -> None:
    found = program(path).findings
    expected = path.read_text().splitlines()[0].removeprefix("; ").split()
    assert sorted({finding.code for finding in found}) == expected
    for finding in found:
        assert finding.file == str(path)
        assert finding.line > 0
        assert finding.help or CODES[finding.code].explanation


VARIANTS = {
    "crlf": lambda raw: raw.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n"),
    "bom": lambda raw: b"\xef\xbb\xbf" + raw,
    "no final newline": lambda raw: raw.rstrip(b"\r\n"),
    "tabs": lambda raw: raw.replace(b" ", b"\t"),
    "wide": lambda raw: raw.replace(b" ", b"   ").replace(b"=", b" = "),
    "indented": lambda raw: raw.replace(b"\n", b"\n   "),
    "lower": bytes.lower,
    "upper": bytes.upper,
    "latin-1": lambda raw: raw.replace(b"\n", b" ; gr\xf6\xdfer \xb5m\n"),
}


@pytest.mark.sample(20)
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("path", GOOD, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_spelling_does_not_change_what_is_read(path: Path, variant: str) -> None:
    if variant in ("indented", "latin-1") and path.read_bytes().startswith(b"%"):
        pytest.skip("the first line is the program's name")
    raw = VARIANTS[variant](path.read_bytes())
    varied = dialect_of(path).read((Document(path, raw),), DOWN)
    assert list(varied.toolpath.dump()) == list(program(path).toolpath.dump())


@pytest.mark.parametrize("path", [*GOOD, *BAD], ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_files_are_told_apart(path: Path) -> None:
    """By their name or their words; KUKA.CNC only where it has # commands."""
    raw = path.read_bytes()
    first = next(dialect.name for dialect in DIALECTS if dialect.claims(path, raw))
    assert first == dialect_of(path).name or (b"#" not in raw and path.suffix == ".nc")


@pytest.mark.parametrize(
    "text",
    ["DEF main()\nINI\nPTP {X 1}\nEND\n", "O1000\nG90 G54\nG43.4 X1 H1\n", "%\nG20\nG0 X1\nG1 X2 F5\n%\n"],
)
def test_programs_of_others_are_not_claimed(text: str) -> None:
    assert not SINUMERIK.claims(Path("a.nc"), text.encode())
    assert not KUKA.claims(Path("a.nc"), text.encode())


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1.0),
        ("-1.5", -1.5),
        ("10+2.5*(3-1)", 15.0),
        ("1/4", 0.25),
        ("2*-3", -6.0),
        ("1.5EX-2", 0.015),
        (" ( 1 + 2 ) * 3 ", 9.0),
        ("1/0", math.nan),
        ("R1", math.nan),
        ("SIN(30)", math.nan),
        ("1+", math.nan),
        ("(" * 50 + "1" + ")" * 50, math.nan),
        ("", math.nan),
        ("1EX999", math.nan),
        ("9" * 400, math.nan),
    ],
)
def test_constant_expressions(text: str, value: float) -> None:
    assert constant(text.encode()) == pytest.approx(value, nan_ok=True)


@given(st.binary(max_size=60), st.integers(0, 59))
def test_an_expression_ends_inside_of_the_line(text: bytes, at: int) -> None:
    assert at >= len(text) or at <= expression_end(text, at) <= len(text)
    constant(text)


@pytest.mark.slow
@settings(deadline=None, max_examples=examples(300))
@given(st.binary(max_size=200).map(lambda raw: b"G54 G71 T1\nG0 X0 Y0 Z0\n" + raw))
@pytest.mark.parametrize("dialect", [SINUMERIK, KUKA], ids=lambda dialect: dialect.name)
def test_nothing_stops_the_reader(dialect, raw: bytes) -> None:
    list(read(dialect, raw).toolpath.dump())


PIECES = st.sampled_from(
    [
        "G1 ",
        "X10",
        "Y=",
        "Z=AC(",
        "IC(",
        ")",
        "=",
        "A3=",
        "CR=5 ",
        "I1=2",
        "TURN=1",
        "TRANS ",
        "ROT RPL=",
        "MCALL",
        "CYCLE81(",
        '"',
        ";",
        "%",
        ":",
        "N10 ",
        "/",
        "L1",
        "R1=",
        "\n",
        'T="A"',
        "CIP ",
        "[",
        "]",
        "#CS ON[1]",
        "#MCS ON",
        "$IF",
        "$P_UIFR[1]=",
        "IF ",
        "GOTOF A",
        "A:",
        "REPEAT",
        "TRAORI",
        "-1.5",
        "EX",
        ".5",
        "'H1'",
        " ",
    ]
)


@settings(deadline=None, max_examples=examples(300))
@given(st.lists(PIECES, max_size=30))
@pytest.mark.parametrize("dialect", [SINUMERIK, KUKA], ids=lambda dialect: dialect.name)
def test_no_words_in_any_order_stop_the_reader(dialect, pieces: list[str]) -> None:
    list(read(dialect, "G54 G71 T1\nG0 X0 Y0 Z0\n" + "".join(pieces)).toolpath.dump())


ANGLES = st.tuples(*[st.floats(-170, 170)] * 3).map(np.array)


@given(ANGLES, ANGLES)
def test_frames_turn_as_the_control_says(first: np.ndarray, second: np.ndarray) -> None:
    """ROT X Y Z turns about Z, the new Y, the new X; AROT goes on in the turned frame; TRANS takes its place."""
    x, y, z = (np.round(first, 3).tolist(),), (np.round(second, 3).tolist(),), [1.0, 2.0, 3.0]
    (a,), (b,) = x, y
    text = (
        "G54 G71 G90\nT1\nG0 X0 Y0 Z0\n"
        f"ROT X{a[0]} Y{a[1]} Z{a[2]}\nAROT X{b[0]} Y{b[1]} Z{b[2]}\nATRANS X5 Y6 Z7\nG1 X1 Y2 Z3 F100\n"
        "TRANS X5 Y6 Z7\nG1 X1 Y2 Z3\n"
    )
    path = read(SINUMERIK, text).toolpath
    turn = rotation_from_abc(np.array([a[2], a[1], a[0]]) * DEG) @ rotation_from_abc(
        np.array([b[2], b[1], b[0]]) * DEG
    )
    np.testing.assert_allclose(path.position[1] / MM, turn @ (np.array([5, 6, 7]) + z), atol=1e-9)
    np.testing.assert_allclose(path.position[2] / MM, [6, 8, 10], atol=1e-9)


def test_a_vector_keeps_its_direction_where_the_frame_turns() -> None:
    text = "G54 G71 G90\nT1\nTRAORI\nG0 X0 Y0 Z0 A3=1 B3=0 C3=0\nROT Z90\nG1 X1 F100\nG1 X2 A3=1 B3=0 C3=0\n"
    path = read(SINUMERIK, text).toolpath
    tool = np.einsum("nij,nj->ni", path.rotation, path.orientation_control.redundant_axis)
    np.testing.assert_allclose(tool, [[1, 0, 0], [1, 0, 0], [0, 1, 0]], atol=1e-12)


@given(st.tuples(*[st.floats(-1, 1)] * 3).map(np.array))
def test_swing_is_the_shortest_rotation(vector: np.ndarray) -> None:
    length = np.linalg.norm(vector)
    if length < 1e-3:
        return
    direction = vector / length
    turn = swing(direction[None])[0]
    np.testing.assert_allclose(turn @ UP, direction, atol=1e-9)
    assert np.linalg.norm(vector_from_rotation(turn)) == pytest.approx(
        np.arccos(np.clip(direction[2], -1, 1)), abs=1e-6
    )


TOOL = rotation_from_abc(np.array([0.4, -0.3, 2.8]))
KEYS = (1, 2, 3)
ORIENTATIONS = [
    Vector(KEYS, rotation_from_abc(np.array([0.5, 0.2, -0.7])), TOOL),
    Angles(KEYS, ((2, 0), (1, 1), (0, 2)), np.eye(3), np.eye(3)),
    Angles(KEYS, ((0, 0), (1, 1), (2, 2)), rotation_from_abc(np.array([0.5, 0.2, -0.7])), TOOL),
    Angles((-1, 2, 3), ((2, 2), (1, 1)), np.eye(3), TOOL, free_spin=True),
    Angles((1, -1, 3), ((2, 2), (0, 0)), np.eye(3), TOOL, free_spin=True),
    Angles(KEYS, ((2, 0), (0, 1), (2, 2)), np.eye(3), TOOL, free_spin=True, joint=True),
    Angles(KEYS, ((2, 2), (1, 1), (0, 0)), np.eye(3), TOOL, free_spin=True, joint=True),
]


@pytest.mark.parametrize("number", range(len(ORIENTATIONS)))
def test_words_of_a_turned_tool(number: int) -> None:
    """Values of a turned orientation give it back, what the words do not say apart; unturned ones stay."""
    orientation = ORIENTATIONS[number]
    random = np.random.default_rng(number)
    values = random.uniform(15, 75, (200, 3)) * random.choice([-1, 1], (200, 3))
    values[:, np.array(orientation.words) < 0] = np.nan
    before = orientation.rotation(values)
    np.testing.assert_allclose(orientation.values(before, values), values, atol=1e-9)
    turned = rotation_from_vector(random.normal(0, 0.01, (200, 3))) @ before
    there = orientation.writable(values)
    assert there.mean() > 0.8
    found = orientation.values(turned, values)
    again = orientation.rotation(found)
    if np.isfinite(orientation.redundant_axis).all():
        off = (again - turned) @ orientation.redundant_axis
    else:
        off = (again - turned).reshape(200, -1)
    assert np.abs(off[there]).max() < 1e-8
    assert np.nanmax(np.abs(found[there] - values[there])) < 60


def test_at_their_pole_two_rotary_axes_are_written_all_the_same() -> None:
    """The outer one stays near its place there."""
    rotary = ORIENTATIONS[3]
    assert rotary.writable(np.array([[np.nan, 1.0, 20.0], [np.nan, 30.0, 20.0]])).tolist() == [False, True]
    text = "G54 G71 G90\nT1\nTRAORI\nG0 X0 Y0 Z0 B1 C20\nG1 X1 B30 F100\n"
    assert read(SINUMERIK, text).toolpath.constraints.orientation_programmed.tolist() == [True, True]


HOSTILE = [
    "X=(",
    "MSG(1)",
    "FNORM ",
    "G" + " " * 20000,
    "A[",
    "((((",
    "X=AC(",
    "#CS ",
    "X1 ",
    "$P_UIFR[1]=1 ",
    "CR=5 ",
]


@pytest.mark.sample(1)
@pytest.mark.parametrize("text", HOSTILE)
@pytest.mark.parametrize("dialect", [SINUMERIK, KUKA], ids=lambda dialect: dialect.name)
def test_long_lines_are_taken_apart_in_linear_time(dialect, text: str) -> None:
    """A quadratic reader would need minutes for such a line."""
    read(dialect, "G54 G71 T1\nG0 X0 Y0 Z0\n" + text * (300000 // len(text)))


def test_the_mark_goes_behind_the_head_of_an_archive_file() -> None:
    raw = b"%_N_PART_MPF\n;$PATH=/_N_WKS_DIR\nN10 G54 G71\nT1\nG0 X0 Y0 Z0\n"
    for dialect, text, line in ((SINUMERIK, raw, 2), (KUKA, b"% program\n\nG54 G71 T1\nG0 X0\n", 1)):
        found = read(dialect, text)
        marked = apply(found.documents[0], [dialect.marked(found, "(x)")])
        assert marked.splitlines()[line] == b";COMPENSATED by compensate [x]"
        again = read(dialect, marked)
        assert again.marker is not None
        assert apply(again.documents[0], [dialect.marked(again, "(x)")]) == marked
        assert len(again.toolpath) == len(found.toolpath)
