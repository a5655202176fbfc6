"""Words whose meaning hangs on blocks before them, in drawn programs, walked block by block: feeds where units change,
external axes among increments, and offsets that move all others."""

from __future__ import annotations

import numpy as np
import pytest
from test_gcode_read import read

from postproc.toolpath import COMPUTED


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc"])
def test_the_unit_of_a_feed_where_units_change(dialect: str) -> None:
    """On LinuxCNC F is read before the G20 or G21 of its own block, elsewhere after it."""
    chance = np.random.default_rng(3)
    for _ in range(30):
        unit, feed, lines, expected = 25.4, np.nan, ["G20 G90 G17 G94 T1", "G0 X0. Y0. Z0."], []
        for block in range(12):
            words, before = [], unit
            if chance.random() < 0.6:
                code = chance.choice(["G20", "G21"])
                unit = 25.4 if code == "G20" else 1.0
                words.append(str(code))
            if chance.random() < 0.5:
                number = int(chance.integers(1, 90))
                feed = number * (before if dialect == "linuxcnc" else unit) / 60.0 * 1e-3
                words.append(f"F{number}.")
            if not np.isnan(feed):
                words.append(f"G1 X{block + 1}.")
                expected.append(feed)
            lines.append(" ".join(words) or "G90")
        path = read("\n".join(lines) + "\n", dialect).toolpath
        np.testing.assert_allclose(
            path.feed[len(path) - len(expected) :], expected, rtol=1e-9, err_msg=str(lines)
        )


@pytest.mark.parametrize("dialect", ["fanuc", "sinumerik"])
def test_where_external_axes_are_among_increments(dialect: str) -> None:
    """A number is a place where coordinates are absolute and in millimetres; AC( ) is one among increments too."""
    chance = np.random.default_rng(4)
    absolute = {"fanuc": ("G21", "G20"), "sinumerik": ("G71", "G70")}[dialect]
    for _ in range(30):
        lines = [
            f"{absolute[0]} G90 G17 T1" + (" D1" if dialect == "sinumerik" else ""),
            "G0 X0. Y0. Z0. E1=0.",
        ]
        steps, metric, place, expected = False, True, 0.0, []
        for _block in range(10):
            words = []
            if chance.random() < 0.3:
                steps = not steps
                words.append("G91" if steps else "G90")
            if chance.random() < 0.2:
                metric = not metric
                words.append(absolute[0 if metric else 1])
            words.append("G0 X1.")
            if chance.random() < 0.7:
                number, form = int(chance.integers(1, 500)), chance.random()
                if dialect == "sinumerik" and form < 0.3:
                    words.append(f"E1=AC({number}.)")
                    place = float(number) if metric else COMPUTED
                elif dialect == "sinumerik" and form < 0.5:
                    words.append(f"E1=IC({number}.)")
                    place = COMPUTED
                else:
                    words.append(f"E1={number}.")
                    place = float(number) if metric and not steps else COMPUTED
            lines.append(" ".join(words))
            expected.append(place)
        path = read("\n".join(lines) + "\n", dialect).toolpath
        found = path.external[-len(expected) :, 0]
        np.testing.assert_array_equal(found, expected, err_msg="\n".join(lines))


@pytest.mark.parametrize(
    ("words", "known"),
    [("X0. Y0. Z0.", True), ("X5.", False), ("Y5.", False), ("Z-5.", False), ("X#1", False), ("", True)],
)
def test_the_external_offset_of_a_fanuc_moves_all_others(words: str, known: bool) -> None:
    """G10 L2 P0 is none of G54 to G59: the chosen one stays as it was written, and is of use where all of P0 is 0."""
    head, end = "G21 G90 G17 T1\nG10 L2 P1 X10. Y20. Z30.\nG54 G0 X0. Y0. Z0.\n", "G1 X1. Y2. Z3. F600\n"
    last = [
        list(read(f"{head}{more}{end}", "fanuc").toolpath.dump())[-1].split(maxsplit=1)[1]
        for more in (f"G10 L2 P0 {words}\n", "")
    ]
    assert (last[0] == last[1]) is known


@pytest.mark.parametrize("switch", ["", "/"])
@pytest.mark.parametrize("mode", ["", "o999 return\n"])
def test_what_is_assigned_in_a_block_that_a_switch_leaves_out_is_not_known(switch: str, mode: str) -> None:
    """Where a run is followed, and where a return in no subprogram keeps it from being."""
    text = f"G21 G90 G17 G54 T1\n{mode}G0 X0. Y0. Z0.\nF600\n#1=4.\n{switch}#1=9.\nG1 X#1\nM30\n"
    last = read(text, "linuxcnc").toolpath.position[-1, 0] * 1e3
    assert np.isnan(last) if switch else last == pytest.approx(9.0)


MODES_NOT_READ = {
    "G54.2 P1": (), "G54.4 P1": (), "G51.2 P1 Q2": (), "G7": (), "G107": (), "G7.1 C20.": (),
    "G12.1": ("G13.1", "G113"), "G112": ("G13.1", "G113"),
}  # fmt: skip
"""A mode whose coordinates are not read, and the codes that end it."""
OF_OTHERS = (
    "G13.1", "G113", "G43 H1", "G43.4 H1", "G49", "G40", "G69", "G54", "G50.1 X0.", "G50", "G15", "G80", "G54.2 P0",
    "G54.4 P0", "M6 T1", "G94",
)  # fmt: skip


@pytest.mark.parametrize("other", OF_OTHERS)
@pytest.mark.parametrize("mode", MODES_NOT_READ)
def test_a_mode_that_is_not_read_ends_with_no_code_of_another_one(mode: str, other: str) -> None:
    text = (
        f"G21 G90 G17 G94 T1 M6\nG54\nG43 H1\nG1 X1. Y1. Z1. F100.\n{{}}\n{other}\nG43 H1\nG1 X5. Y5. Z5.\n"
    )
    path = read(text.format(mode), "fanuc").toolpath
    last = len(path) - 1
    assert (last not in path.constraints.refused) == (other in MODES_NOT_READ[mode])
    assert last not in read(text.format("G1"), "fanuc").toolpath.constraints.refused or other == "G113"


@pytest.mark.parametrize("block", ["G54.2 P0", "G54.4 P0.", "G1 X2. G54.2 P0"])
def test_no_offset_that_turns_with_a_table_changes_nothing(block: str) -> None:
    text = f"G21 G90 G17 G94 T1 M6\nG54\nG43 H1\nG1 X1. Y1. Z1. F100.\n{block}\nY5.\n"
    program = read(text, "fanuc")
    assert not program.toolpath.constraints.refused
    assert {finding.code for finding in program.findings} == set()
    assert len(read(text.replace("P0", "P2"), "fanuc").toolpath.constraints.refused) >= 1


def test_a_mode_of_a_kuka_cnc_is_ended_by_its_own_command_only() -> None:
    """#MCS are the axes of the machine, #ACS is the place of the clamped part: #ACS OFF does not end #MCS ON."""
    head = "#TRAFO ON\nG54 G90 G71 T1\nG0 X0 Y0 Z0 A0 B0 C0\nF100\n"
    for on, off, known in (
        ("#MCS ON", "#MCS OFF", True), ("#ACS ON", "#ACS OFF", True),
        ("#MCS ON", "#ACS OFF", False), ("#ACS ON", "#MCS OFF", False),
    ):  # fmt: skip
        path = read(f"{head}{on}\nG1 X1\n{off}\nG1 X2 Y2 Z2 A0 B0 C0\nM30\n", "kuka_cnc").toolpath
        assert 1 in path.constraints.refused
        assert (2 not in path.constraints.refused) is known, (on, off)


@pytest.mark.parametrize(
    ("name", "corner"),
    [("sinumerik", "RND=2"), ("sinumerik", "CHF=1.5"), ("fanuc", ",R2."), ("fanuc", ", C2.")],
)
def test_the_corner_that_the_control_rounds_is_where_the_next_motion_is_stated_from(
    name: str, corner: str
) -> None:
    """Its block and the path at it are the control's; what is programmed after it has known ends."""
    text = f"G21 G90 G17 G54 T1\nG0 X0. Y0. Z3.\nF600\nG1 X10. {corner}\nY20.\nG91 X5.\nM30\n"
    path = read(text if name == "fanuc" else text.replace("G21", "G71"), name).toolpath
    np.testing.assert_allclose(path.position[1:] * 1e3, [[10, 0, 3], [10, 20, 3], [15, 20, 3]])
    assert sorted(path.constraints.refused) == [1]
    # a short motion beside the corner would change how it is rounded
    assert "corner" in path.constraints.no_insert_before[2]
    assert 3 not in path.constraints.no_insert_before


def test_an_angle_that_states_the_end_leaves_it_unknown() -> None:
    path = read("G21 G90 G17 G54 T1\nG0 X0. Y0. Z3.\nF600\nG1 X10. ,A45.\nX20.\nM30\n", "fanuc").toolpath
    assert np.isnan(path.position[1:]).all()
