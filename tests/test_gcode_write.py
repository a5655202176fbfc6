"""What the writer makes of a plan: only what must change, and read again it is what was meant."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from gcode_writing import DOWN, WRITING, assert_reads_as, random_plan, read, round_trip, written
from hypothesis import given, settings
from hypothesis import strategies as st
from test_rs274_oracle import agree, canonical, needs_rs274
from tiers import examples

from postproc.base.document import Document
from postproc.base.geometry import on_arc, rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.languages.dialect import Plan, ReadingSettings, Role, WritingSettings
from postproc.languages.gcode import DIALECTS
from postproc.toolpath import Kind

ROOT = Path(__file__).parent / "programs"
NAMES = {dialect.name: dialect for dialect in DIALECTS}
LINUXCNC, FANUC, SINUMERIK, KUKA = (NAMES[name] for name in ("linuxcnc", "fanuc", "sinumerik", "kuka_cnc"))
CASES = [
    path
    for name in NAMES
    for path in sorted((ROOT / name).rglob("*"))
    if path.is_file() and path.suffix != ".dump"
]
HEAD = "G21 G90 G17 G54\nT1 M6\nG0 X0 Y0 Z5\n"


def dialect_of(path: Path):
    return NAMES[next(part for part in reversed(path.parts) if part in NAMES)]


def settings_of(path: Path) -> ReadingSettings:
    words = "um" if "_um" in path.stem else "mm"
    return ReadingSettings(orientation=DOWN.orientation, options={"integer_words": words})


@pytest.mark.sample(21)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("path", CASES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_the_same_motions_give_no_edit(path: Path, newline: str) -> None:
    raw = path.read_bytes().replace(b"\r\n", b"\n").replace(b"\n", newline.encode())
    program = dialect_of(path).read((Document(path, raw),), settings_of(path))
    moved = dialect_of(path).edit_targets(program, Plan.of(program.toolpath), WRITING)
    assert len(moved.edits) == 0
    assert not moved.unwritten


@pytest.mark.sample(12)
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("path", CASES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_cases_moved_at_random_read_as_planned(path: Path, seed: int) -> None:
    raw = path.read_bytes()
    if seed % 3 == 2:
        raw = raw.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n")
    round_trip(dialect_of(path), raw, seed, settings_of(path), divided=0.4 * (seed % 2))


@pytest.mark.skipif("POSTPROC_PROGRAMS" not in os.environ, reason="POSTPROC_PROGRAMS names no folder")
def test_programs_of_a_folder_moved_at_random_read_as_planned() -> None:
    for path in sorted(Path(os.environ["POSTPROC_PROGRAMS"]).rglob("*")):
        if not path.is_file():
            continue
        raw = path.read_bytes()
        for dialect in DIALECTS:
            if dialect.claims(path, raw):
                round_trip(dialect, raw, 1)
                round_trip(dialect, raw, 2, divided=0.0, share=1.0)
                break


def moved_line(
    text: str, row: int, by: tuple[float, float, float], dialect=LINUXCNC, head: str = HEAD
) -> list[str]:
    """The lines after the head, once the motion ``row`` of them is moved [mm]."""
    program = read(dialect, head + text)
    plan = Plan.of(program.toolpath)
    first = len(read(dialect, head).toolpath)
    position = plan.position.copy()
    position[first + row] += np.array(by) * MM
    ways = (plan.centre, plan.normal, plan.sweep)
    raw = written(dialect, program, Plan(plan.source, plan.role, position, plan.rotation, *ways))
    return raw.decode("latin-1")[len(head) :].splitlines()


@pytest.mark.parametrize(
    ("text", "by", "result"),
    [
        ("G1 X1.000 Y2.000 Z3.000 F1", (0.1, 0, 0), "G1 X1.100 Y2.000 Z3.000 F1"),
        ("G1 X1 Y2 Z40 F1", (0.1, 0, 0), "G1 X1.100 Y2 Z40 F1"),
        ("g1x1.y2.z3.", (0, -5, 0), "g1x1.y-3.000z3."),
        ("G1 X1.00001 Y2 Z3", (0.1, 0, 0), "G1 X1.10001 Y2 Z3"),
        ("G1 X1.5 F1 (cut)", (0, 0.1, 0), "G1 X1.5 F1 Y0.100 (cut)"),
        ("G1X1.5F1", (0, 0.1, 0), "G1X1.5F1Y0.100"),
        ("N7 G1 X1.5 Y2 Z-.5 ; cut", (0, 0, 0.5), "N7 G1 X1.5 Y2 Z0.000 ; cut"),
        ("g1 x1 f1", (0, 0.1, 0.2), "g1 x1 f1 y0.100 z5.200"),
        ("G20 G1 X1 Y0 Z0", (0.254, 0, 0), "G20 G1 X1.01000 Y0 Z0"),
        ("G91 G1 X1 Y1", (0.1, 0, 0.1), "G91 G1 X1.100 Y1 Z0.100"),
        ("G1 X1 Y2 Z3", (0.0004, 0, 0), "G1 X1 Y2 Z3"),
        ("G1 X1.0 Y2 Z3", (0.0006, 0, 0), "G1 X1.001 Y2 Z3"),
    ],
)
def test_only_what_moved_is_written(text: str, by: tuple[float, float, float], result: str) -> None:
    assert moved_line(text + "\n", 0, by) == [result]


@pytest.mark.parametrize(
    ("text", "result"),
    [
        ("G1 X=1 Y=AC(2) Z=3", "G1 X=1.100 Y=AC(2.200) Z=3.300"),
        ("G1 X=IC(1) Y=IC( -2.5 ) Z3", "G1 X=IC(1.100) Y=IC( -2.300 ) Z3.300"),
        ("G1 X=10+2*3 Y2 Z=-1/4", "G1 X=16.100 Y2.200 Z=0.050"),
        ("G1 X=IC( 1 ) ;(", "G1 X=IC( 1.100 ) Y0.200 Z0.300 ;("),
        ("G1X=AC(1)", "G1X=AC(1.100)Y0.200Z0.300"),
        ("G91 G1 X=AC(1) Y2 Z3", "G91 G1 X=AC(1.100) Y2.200 Z3.300"),
    ],
)
def test_words_of_the_sinumerik_keep_their_form(text: str, result: str) -> None:
    head = "G54 G71 G90\nT1\nG0 X0 Y0 Z0\n"
    assert moved_line(text + "\n", 0, (0.1, 0.2, 0.3), SINUMERIK, head) == [result]


def test_what_inherits_from_a_moved_motion_keeps_its_own_place() -> None:
    lines = moved_line("G1 X1 Y1 Z1 F1\nX2\nX3 Y1\nG91 X1 Y1\n", 0, (0.5, 0.5, 0.5))
    assert lines == ["G1 X1.500 Y1.500 Z1.500 F1", "X2 Y1.000 Z1.000", "X3 Y1", "G91 X1 Y1"]
    lines = moved_line("G91 G1 X1 Y1 Z1 F1\nX2\nZ-1\n", 0, (0.5, 0, -0.5))
    assert lines == ["G91 G1 X1.500 Y1 Z0.500 F1", "X1.500 Z0.500", "Z-1"]


def test_increments_do_not_add_up_their_rounding() -> None:
    head = HEAD + "G91 G1 F100\n"
    program = read(LINUXCNC, head + "X1.00\n" * 400)
    plan = Plan.of(program.toolpath)
    position = plan.position.copy()
    position[1:, 0] += np.arange(1, 401) * 0.0013 * MM
    raw = written(
        LINUXCNC,
        program,
        Plan(plan.source, plan.role, position, plan.rotation, plan.centre, plan.normal, plan.sweep),
    )
    off = read(LINUXCNC, raw).toolpath.position - position
    assert np.abs(off).max() <= 0.00050001 * MM


def test_integer_words_of_a_control_that_counts_get_a_point() -> None:
    count = ReadingSettings(orientation=DOWN.orientation, options={"integer_words": "um"})
    program = read(FANUC, "O1\nG21 G90 G54\nT1 M6\nG0 X0 Y0 Z0\nG1 X1000 Y2.5 Z-500 F100\n", count)
    plan = Plan.of(program.toolpath)
    position = plan.position.copy()
    position[1] += np.array([0.25, 0.25, -0.1]) * MM
    raw = written(
        FANUC,
        program,
        Plan(plan.source, plan.role, position, plan.rotation, plan.centre, plan.normal, plan.sweep),
    )
    assert raw.endswith(b"G1 X1.250 Y2.750 Z-0.600 F100\n")


def inserted(text: str, dialect=LINUXCNC, head: str = HEAD, link: bool = True) -> list[str]:
    """The lines after the head with a link (or a piece) half a millimetre above the begin of their last motion."""
    program = read(dialect, head + text)
    path = program.toolpath
    last = len(path) - 1
    own = Plan.of(path)
    position = path.position[last - 1] + np.array([0, 0, 0.5]) * MM
    if not link:
        position = 0.5 * (path.position[last - 1] + path.position[last])

    def with_row(values, row):
        return np.concatenate([values[:last], [row], values[last:]])

    plan = Plan(
        with_row(own.source, last),
        with_row(own.role, Role.TRANSITION if link else Role.INTERMEDIATE),
        with_row(own.position, position),
        with_row(own.rotation, path.rotation[last]),
        with_row(own.centre, np.full(3, np.nan)),
        with_row(own.normal, np.full(3, np.nan)),
        with_row(own.sweep, np.nan),
    )
    raw = written(dialect, program, plan)
    assert_reads_as(dialect, program, plan, raw)
    return raw.decode("latin-1")[len(head) :].splitlines()


def test_inserted_blocks() -> None:
    assert inserted("G1 X0 F50\nN20 X10 (end)\n")[1:] == ["G1 Z5.500", "N20 X10 Z5.000 (end)"]
    assert inserted("g1x0f50\n  x10.f80\n")[1:] == ["  g1z5.500f80", "  x10.f80z5.000"]
    assert inserted("G1 X0 F50\nX10 F80\n", link=False)[1:] == ["G1 X5.000 F80", "X10 F80"]
    assert inserted("G01 X0 F50\nG91 X10\n")[1:] == ["G91 G1 Z0.500", "G91 X10 Z-0.500"]


def test_an_inserted_block_always_moves() -> None:
    """A piece that ends where the motion before did, and a link under G91."""
    for text, line in (("G1 X0 F50\nX10\n", "G1 X0.000"), ("G1 X0 F50\nG91 X10\n", "G91 G1 X0.000")):
        program = read(LINUXCNC, HEAD + text)
        own = Plan.of(program.toolpath)
        last = len(own) - 1
        rows = [*range(last), last - 1, last]
        plan = Plan(
            np.array([*range(last), last, last]),
            np.array([*[Role.ORIGINAL] * last, Role.INTERMEDIATE, Role.ORIGINAL]),
            own.position[rows],
            own.rotation[rows],
            own.centre[rows],
            own.normal[rows],
            own.sweep[rows],
        )
        raw = written(LINUXCNC, program, plan)
        assert raw.decode().splitlines()[-2] == line
        assert_reads_as(LINUXCNC, program, plan, raw)


def test_an_arc_after_a_link_says_that_it_is_one() -> None:
    lines = inserted("G2 X10 Y0 I5 J0 F50\nX20 I5\n")
    assert lines[1:] == ["G1 Z5.500", "G2 X20 I5 Z5.000"]
    lines = inserted("G3 X10 Y0 I5 J0 F50\nN5 G3 X20 I5 J0\n")
    assert lines[1:] == ["G1 Z5.500", "N5 G3 X20 I5 J0 Z5.000"]


def arc_moved(text: str, by: float, dialect=LINUXCNC, head: str = HEAD) -> str:
    """The last block, an arc, with its begin, end and centre moved the same way, its radius made larger by ``by``."""
    program = read(dialect, head + text)
    plan = Plan.of(program.toolpath)
    position, centre = plan.position.copy(), plan.centre.copy()
    for row in (-2, -1):
        out = plan.position[row] - centre[-1]
        position[row] += out / np.linalg.norm(out) * by * MM
    raw = written(
        dialect,
        program,
        Plan(plan.source, plan.role, position, plan.rotation, centre, plan.normal, plan.sweep),
    )
    return raw.decode("latin-1").splitlines()[-1]


def test_the_form_of_an_arc_stays_where_it_states_it_well() -> None:
    assert arc_moved("G1 X10 Y0 Z5 F50\nG3 X0 Y10 I-10 J0\n", 0.5) == "G3 X0 Y10.500 I-10.500 J0"
    assert arc_moved("G1 X10 Y0 Z5 F50\nG3 X0 Y10 R10\n", 0.5) == "G3 X0 Y10.500 R10.500"
    assert arc_moved("G1 X10 Y0 Z5 F50\nG2 X0 Y10 R-10\n", 0.5) == "G2 X0 Y10.500 R-10.5000"
    # The centre of half a circle is not stated by its radius.
    assert arc_moved("G1 X10 Y0 Z5 F50\nG3 X-10 R10\n", 0.5) == "G3 X-10.500 I-10.500 J0.000"
    assert arc_moved("G1X10Y0Z5F50\nG3X-10R10\n", 0.5) == "G3X-10.500I-10.500J0.000"
    assert arc_moved("G90.1\nG1 X10 Y0 Z5 F50\nG3 X0 Y10 I0 J0\n", 0.5) == "G3 X0 Y10.500 I0 J0"


def test_arcs_of_the_sinumerik() -> None:
    head = "G54 G71 G90\nT1\nG0 X0 Y0 Z0\n"
    last = lambda text: arc_moved(text, 0.5, SINUMERIK, head)  # noqa: E731
    assert last("G1 X10 F50\nG3 X0 Y10 CR=10\n") == "G3 X0 Y10.500 CR=10.500"
    assert last("G1 X10 F50\nG3 X-10 Y0 CR=10\n") == "G3 X-10.500 Y0 I-10.500 J0.000"
    assert last("G1 X10 F50\nG3 X0 Y10 I=AC(0) J=IC(0)\n") == "G3 X0 Y10.500 I=AC(0) J=IC(0)"
    assert last("G1 X10 F50\nCIP X0 Y10 Z0 I1=6 J1=8 K1=0\n") == "CIP X0 Y10.500 Z0 I1=7.425 J1=7.425 K1=0"
    assert last("G1 X10 F50\nG3 X10 Y0 I-10 J0 TURN=1\n") == "G3 X10.500 Y0 I-10.500 J0 TURN=1"


def test_a_full_circle_stays_closed() -> None:
    """With its end as it is written before, left out or written with fewer decimals."""
    for last in ("G3 I-10 J0", "G3 X10 Y0 I-10 J0", "G3 X10. Y0.0 I-10 J0"):
        text = f"G1 X10.00000 Y0 Z5 F50\n{last}\n"
        program = read(LINUXCNC, HEAD + text)
        plan = Plan.of(program.toolpath)
        position = plan.position.copy()
        position[1:] += np.array([0.12345, 0.0004, 0]) * MM
        moved = Plan(
            plan.source,
            plan.role,
            position,
            plan.rotation,
            plan.centre + np.array([0, 0.0004 * MM, 0]),
            plan.normal,
            plan.sweep,
        )
        raw = written(LINUXCNC, program, moved)
        assert_reads_as(LINUXCNC, program, moved, raw)


def held(text: str, change) -> dict[int, str]:
    program = read(LINUXCNC, HEAD + text)
    plan = Plan.of(program.toolpath)
    position, sweep = plan.position.copy(), plan.sweep.copy()
    change(position, sweep)
    moved = Plan(plan.source, plan.role, position, plan.rotation, plan.centre, plan.normal, sweep)
    found = LINUXCNC.edit_targets(program, moved, WRITING)
    assert len(found.edits) == 0
    return {row: finding.code for row, finding in found.unwritten.items()}


def test_arcs_that_no_numbers_state_are_held() -> None:
    def past(position, sweep):
        position[-1, 1] += 0.01 * MM
        sweep[-1] += 0.001

    assert held("G1 X10 F50\nG3 I-10 J0\n", past) == {2: "GCW001"}

    def short(position, sweep):
        position[-1] = position[-2] + np.array([0, 0.0001 * MM, 0])
        sweep[-1] = 0.00001

    assert held("G1 X10 F50\nG3 X0 Y10 I-10 J0\n", short) == {2: "GCW001"}


@pytest.mark.parametrize("text", ["G1 X1 F1\nG28 Z0\n", "G41 D1 G1 X1 Y1 F1\n", "G1 X1 F1\nG81 Z-1 R1 L2\n"])
def test_what_may_not_move_is_not_moved(text: str) -> None:
    program = read(LINUXCNC, HEAD + text)
    path = program.toolpath
    rows = [*path.constraints.refused, *path.constraints.locked]
    assert rows
    plan = Plan.of(path)
    position = np.where(np.isnan(plan.position), 0.0, plan.position)
    position[rows] += 1 * MM
    changed = Plan(plan.source, plan.role, position, plan.rotation, plan.centre, plan.normal, plan.sweep)
    with pytest.raises(ValueError, match="cannot be corrected"):
        LINUXCNC.edit_targets(program, changed, WRITING)


@pytest.mark.parametrize("text", ["G1 X1 F1\nM3 X2\n", "G1 X1 F1\nX2 S500\n", "G93\nG1 X2 F3\n"])
def test_what_acts_before_its_motion_is_not_divided(text: str) -> None:
    with pytest.raises(ValueError, match="cannot be divided"):
        inserted(text)


def test_a_vector_is_written_whole() -> None:
    head = "G54 G71 G90\nT1\nTRAORI\nG0 X0 Y0 Z0 A3=0 B3=0 C3=1\n"
    program = read(SINUMERIK, head + "G1 X1 A3=0.1 C3=0.995 F100\nX2\nG1 X3 A3=0 B3=0 C3=1\n")
    plan = Plan.of(program.toolpath)
    rotation = plan.rotation.copy()
    rotation[1] = rotation_from_vector(np.array([0.01, 0, 0])) @ rotation[1]
    turned = Plan(plan.source, plan.role, plan.position, rotation, plan.centre, plan.normal, plan.sweep)
    raw = written(SINUMERIK, program, turned)
    lines = raw.decode().splitlines()[4:]
    assert lines[0] == "G1 X1 A3=0.1 C3=0.99495 F100 B3=-0.00995"
    assert lines[1].startswith("X2 A3=0.1")
    assert lines[2] == "G1 X3 A3=0 B3=0 C3=1"
    assert_reads_as(SINUMERIK, program, turned, raw)


def test_angles_stay_on_their_turn() -> None:
    head = "G54 G71 G90\nT1\nTRAORI\nG0 X0 Y0 Z0 B0 C0\n"
    program = read(SINUMERIK, head + "G1 X1 B80.000 C1903.826 F100\n")
    plan = Plan.of(program.toolpath)
    rotation = plan.rotation.copy()
    rotation[1] = rotation_from_vector(np.array([0, 0, 0.25 * DEG])) @ rotation[1]
    turned = Plan(plan.source, plan.role, plan.position, rotation, plan.centre, plan.normal, plan.sweep)
    assert written(SINUMERIK, program, turned).decode().splitlines()[-1] == "G1 X1 B80.000 C1904.076 F100"


NUMBERS = st.floats(-60, 60).map(lambda v: round(v, 3))


@st.composite
def programs(draw: st.DrawFn) -> str:
    """Lines, arcs in three planes, increments, inches, offsets: what every control reads."""
    lines = ["G21 G90 G17 G54", "T1 M6", "G0 X1 Y1 Z1", "G1 X2 F100"]
    blank = draw(st.sampled_from([" ", ""]))
    for _ in range(draw(st.integers(1, 12))):
        kind = draw(st.integers(0, 9))
        words = [draw(st.sampled_from(["G1", "G1", "G01", "G0"]))]
        if kind == 0:
            lines.append(
                draw(
                    st.sampled_from(
                        ["G90", "G91", "G20", "G21", "G55", "G54", "G52 X1 Y2 Z0", "G17", "G18", "G19"]
                    )
                )
            )
            if lines[-1] in ("G54", "G55"):
                lines.append("G90 G0 X1 Y2 Z3")
            lines.append("G1")
            continue
        if kind <= 3:
            plane = draw(st.sampled_from(["G17 ", "G18 ", "G19 "]))
            u, v = {"G17 ": "XY", "G18 ": "ZX", "G19 ": "YZ"}[plane]
            one, two = {"X": "I", "Y": "J", "Z": "K"}[u], {"X": "I", "Y": "J", "Z": "K"}[v]
            radius = draw(st.integers(3, 20))
            words = [plane.strip(), "G91", draw(st.sampled_from(["G2", "G3"]))]
            form = draw(st.integers(0, 3))
            if form == 0:
                words += [f"{u}{radius}", f"{v}{radius}", f"{one}{radius}"]
            elif form == 1:
                words += [f"{u}{2 * radius}", f"{one}{radius}", f"{two}0"]
            elif form == 2:
                words += [f"{u}{radius}", f"{v}{radius}", f"R{draw(st.sampled_from(['', '-']))}{radius}."]
            else:
                words += [f"{one}{radius}", f"{two}{draw(st.integers(0, 5))}"]
            lines += [blank.join(words), draw(st.sampled_from(["G90", "G91"])) + " G1", "G17"]
            continue
        keys = draw(st.permutations("XYZ"))[: draw(st.integers(1, 3))]
        words += [f"{key}{draw(NUMBERS)}" for key in keys]
        lines.append(blank.join(words))
    return "\n".join([*lines, "M30", ""])


@settings(deadline=None, max_examples=examples(250))
@given(programs(), st.integers(0, 2**32 - 1))
def test_programs_moved_at_random_read_as_planned(text: str, seed: int) -> None:
    round_trip(LINUXCNC, text.encode(), seed)


@settings(deadline=None, max_examples=examples(60))
@given(programs(), st.integers(0, 2**32 - 1), st.integers(2, 5))
def test_any_number_of_decimals(text: str, seed: int, decimals: int) -> None:
    round_trip(LINUXCNC, text.encode(), seed, writing=WritingSettings(decimals, decimals))


@pytest.mark.sample(5)
@needs_rs274
@pytest.mark.parametrize("seed", range(40))
def test_linuxcnc_reads_the_output_as_well(tmp_path: Path, seed: int) -> None:
    """Where its interpreter takes the program, it takes the output, with the lines and arcs, the ends and the ways that
    were planned, within the written digits."""
    texts = [
        "G21 G90 G17 G54\nT1 M6\nG0 X0 Y0 Z5\nG1 Z-1 F100\nX10\nG2 X20 Y10 I10 J0\nX30 Y0 R10\nG3 X10 Y0 R-12\n"
        "G1 X0\nG18 G2 X10 Z-11 I0 K-10\nG19 G3 Y10 Z-1 J0 K10\nG91 G1 X1 Y1\nG17 G3 X5 Y5 I0 J5\nG90 G1 X3 Y3\nM2\n",
        "G20 G90 G17\nT1 M6\nG0 X0 Y0 Z1\nG1 Z-.1 F10\nX1.25\nG3 X1.5 Y.25 I0 J.25\nG2 X1.75 Y.5 R.25\nG1 X0Y0\nM2\n",
        "G21 G90 G17\nG0X0Y0Z0\nG1X10F100\nG3I-5J0Z-3\nX5Y5I-5\nG1X20Y20Z20\nG90.1\nG2X30Y30I30J20\nM2\n",
    ]
    raw = texts[seed % 3].encode()
    file = tmp_path / "part.ngc"
    file.write_bytes(raw)
    assert canonical(file, tmp_path) is not None
    program = read(LINUXCNC, raw)
    plan = random_plan(program, seed)
    file.write_bytes(written(LINUXCNC, program, plan))
    after = canonical(file, tmp_path)
    assert after is not None, file.read_text()
    kind = np.where(plan.role == Role.TRANSITION, Kind.LIN, program.toolpath.kind[plan.source])
    assert [motion.kind for motion in after] == kind.tolist()
    unit = program.text.scale[0]
    step = 10.0 ** -(WRITING.mm + (unit > 2 * MM)) * unit
    for m, motion in enumerate(after):
        assert np.abs(motion.end - plan.position[m]).max() <= 0.5 * step + 1e-4 * unit
        if motion.between is not None:
            way = (
                plan.position[[m - 1]],
                plan.position[[m]],
                plan.centre[[m]],
                plan.normal[[m]],
                plan.sweep[[m]],
            )
            for point, share in zip(motion.between, (1 / 3, 2 / 3), strict=True):
                meant = on_arc(*way, np.array([share]))[0]
                assert np.linalg.norm(point - meant) <= 2.5 * step + 2e-4 * unit


@pytest.mark.sample(4)
@needs_rs274
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    "path", [path for path in CASES if path.parent.name == "linuxcnc"], ids=lambda path: path.stem
)
def test_what_linuxcnc_accepts_it_accepts_once_moved(tmp_path: Path, path: Path, seed: int) -> None:
    if canonical(path, tmp_path) is None:
        pytest.skip("rs274 does not accept it as it is")
    output = tmp_path / "moved.ngc"
    output.write_bytes(round_trip(LINUXCNC, path.read_bytes(), seed))
    assert agree(output, tmp_path) > 0, output.read_text()
