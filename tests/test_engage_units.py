"""Tools, blanks and coefficients in another unit than the file's: what the program or the cell contradicts is reported.

None of these files is wrong by itself; each was meant in another unit, and ends with exit code 3 for it.
"""

import json

import pytest

pytest.importorskip("numba")

from test_engage_command import CELL, SLOT, STOCK, TOOLS, call, folder, state

from postproc.robot.description import find_robot

__all__ = ["folder"]
OWN = "coefficients: {ktc: 767, krc: 169, kac: 222, kte: 27.7, kre: 26.6, kae: 0.7}"
HEAD = "G21 G90 G17 G54\nT1 M6\nG0 X-20 Y10 Z5\nG0 Z-5\n"
ZIGZAG = HEAD + "G1 X90 F3600\nY20\nX10\nY30\nX90\nG0 Z30\nM2\n"
FRAME = HEAD + "G1 X90 F3600\nY50\nX10\nY10\nX90\nG0 Z30\nM2\n"


def found(folder, code, exit=3):
    """The findings of a code; the command ends with ``exit``."""
    result = json.loads(call(folder, "--json", "-", code=exit).stdout)
    return [one for one in result["findings"] if one["code"] == code]


def tool(**changed):
    values = {"diameter": 16, "length": 40, "teeth": 3, "helix": 30, "spindle": 12000} | changed
    values = {"shape": "flat"} | values
    stated = ", ".join(f"{key}: {value}" for key, value in values.items())
    return f"tools:\n  1: {{{stated}}}\ndefaults: {{material: EN AW-7075-T6}}\n"


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"diameter": 0.63}, "below 1 mm|is it in inches? they would be 16.002 mm"),
        ({"diameter": 1.2}, "cuts 5 mm deep at half of its width or more (line 5): 4.17 times"),
        ({"diameter": 210}, "above 200 mm"),
        ({"diameter": 160}, "move at 6031.9 m/min"),
        ({"teeth": 300}, "0.168 mm from one to the next"),
        (
            {"holder": "{diameter: 63, from: 1524}"},
            "its holder starts 1524 mm above the tip, which the cell has",
        ),
        ({"helix": 0.5236}, "has a helix of 0.5236 deg|is it in rad? it would be 30 deg"),
        (
            {"shank": 16, "holder": "{diameter: 6.3, from: 60}"},
            "holder with the diameter 6.3 mm, below that of its shank",
        ),
        ({"length": 600}, "its edges end 600 mm above the tip"),
        ({"spindle": 72000}, "diameter 16 mm, turns at 72000 1/min"),  # deg/s
        (
            {"shape": "drill, point_angle: 118"},
            "is a drill, and cuts across its axis in 2 motions (the first in line 5)",
        ),
    ],
)
def test_a_tool_of_another_size_is_reported(folder, changed, words):
    state(folder, STOCK + tool(**changed))
    findings = found(folder, "STK025")
    text = " ".join(one["message"] + " " + one["help"] for one in findings)
    for word in words.split("|"):
        assert word in text, findings
    assert {one["line"] for one in findings} == {3}


@pytest.mark.parametrize(
    ("stated", "words"),
    [(16.0, None), (16.1, None), (0.63, "25.4 times: one of them is in inches"), (0.016, "in metres"),
     (8, "a radius"), (32, "a radius"), (1.6, "in centimetres"), (12, "state the diameter in mm")],
)  # fmt: skip
def test_the_diameter_of_the_cell_is_compared(folder, stated, words):
    text = CELL.format(robot=find_robot("kuka_kr270")).replace(
        "axis: +z}", f"axis: +z, diameter: {stated}}}", 1
    )
    (folder / "cell.yaml").write_text(text)
    findings = found(folder, "STK025", 0 if words is None else 3)
    if words is None:
        assert findings == []
        return
    (one,) = findings
    assert words in one["message"] + one["help"]
    assert f"16 mm here, which is used, and {stated:g} mm in the cell" in one["message"]


def test_passes_that_leave_ridges_contradict_a_diameter(folder):
    (folder / "part.ngc").write_text(ZIGZAG)
    assert found(folder, "STK025", 0) == []
    state(folder, STOCK + tool(diameter=8))  # the radius
    (one,) = found(folder, "STK025")
    assert "passes that are 10 mm apart (lines 5 to 9): ridges of 2 mm remain between them" in one["message"]


def test_passes_that_rise_and_fall_leave_ridges_too(folder):
    wave = "".join(f"X{x} Z{-2 - (x // 10) % 2}\n" for x in range(-10, 91, 10))
    back = "".join(f"X{x} Z{-2 - (x // 10) % 2}\n" for x in range(90, -11, -10))
    head = HEAD.replace("G0 Z-5", "G1 Z-2 F3600")
    (folder / "part.ngc").write_text(head + wave + "Y20\n" + back + "Y30\n" + wave + "G0 Z30\nM2\n")
    assert found(folder, "STK025", 0) == []
    state(folder, STOCK + tool(diameter=8))
    (one,) = found(folder, "STK025")
    assert "passes that are 10 mm apart" in one["message"]
    assert "ridges of 2 mm" in one["message"]


def test_a_drill_that_drills_is_none_of_them(folder):
    (folder / "part.ngc").write_text("G21 G90 G17 G54\nT1 M6\nG0 X30 Y30 Z5\nG1 Z-12 F600\nG0 Z30\nM2\n")
    state(folder, STOCK + tool(shape="drill, point_angle: 118"))
    assert found(folder, "STK025", 0) == []


def test_what_is_stated_once_is_reported(folder):
    """A tool stated twice as thick contradicts no cut; a second statement of its diameter would."""
    (one,) = found(folder, "STK029", 0)
    assert (one["severity"], one["line"]) == ("info", 3)
    assert "the diameter of tool 1, 16 mm, is stated here only" in one["message"]
    (folder / "part.ngc").write_text("(T1 16 mm end mill)\n" + SLOT)
    assert found(folder, "STK029", 0) == []
    (folder / "part.ngc").write_text(SLOT)
    text = (folder / "cell.yaml").read_text()
    (folder / "cell.yaml").write_text(text.replace("axis: +z}", "axis: +z, diameter: 16}", 1))
    assert found(folder, "STK029", 0) == []


@pytest.mark.parametrize(("bottom", "below"), [(-30, None), (-5, None), (-2, 3)])
def test_a_blank_that_is_cut_through_is_reported(folder, bottom, below):
    state(folder, f"stock: {{box: [[0, 0, {bottom}], [100, 60, 0]]}}\n" + tool())
    findings = found(folder, "STK030", 0)
    assert len(findings) == (below is not None)
    for one in findings:
        assert f"is up to {below} mm below its bottom here, and below it in 2 motions" in one["message"]
        assert one["line"] == 5


def test_a_frame_around_a_part_leaves_no_ridge(folder):
    (folder / "part.ngc").write_text(FRAME)
    assert found(folder, "STK025", 0) == []
    state(folder, STOCK + tool(diameter=8))
    assert found(folder, "STK025", 0) == []


@pytest.mark.parametrize(
    ("box", "words"),
    [
        (
            "[[0, 0, -1.2], [3.94, 2.36, 0]]",
            "the blank is 3.94 x 2.36 x 1.2 mm, and the tip moves over 100 x 40 x 0",
        ),
        ("[[-40000, -30000, -30], [60000, 50000, 0]]", "a smaller unit"),
    ],
)
def test_a_blank_of_another_size_is_reported(folder, box, words):
    state(folder, f"stock: {{box: {box}}}\n" + tool(diameter=6))
    head = HEAD.replace("X-20 Y10", "X-10 Y0").replace("Z-5", "Z-1")
    (folder / "part.ngc").write_text(head + "G1 X90 F3600\nY40\nX0\nG0 Z30\nM2\n")
    (one,) = found(folder, "STK026")
    assert words in one["message"] + one["help"]
    assert one["line"] == 1


def test_a_tool_that_cuts_nothing_is_reported(folder):
    (folder / "part.ngc").write_text(
        SLOT.replace("M2\n", "T2 M6\nG0 X0 Y0 Z5\nG1 Z1 F600\nX50\nG0 Z30\nM2\n")
    )
    state(
        folder,
        STOCK
        + TOOLS.replace(
            "defaults",
            "  2: {shape: ball, diameter: 10, length: 25, teeth: 2, helix: 30, spindle: 18000}\ndefaults",
        ),
    )
    (one,) = found(folder, "STK027")
    assert "tool 2 moves at a feed in 2 motions in lines 10 to 11, and cuts nothing" in one["message"]
    assert one["line"] == 10


@pytest.mark.parametrize(
    ("coefficients", "words"),
    [
        (OWN, None),
        (OWN.replace("27.7", "27700"), "kte of 2.77e+04 N/mm belongs to no edge"),
        (OWN.replace("27.7", "900"), "kte of 900 N/mm belongs to no edge"),
        (OWN.replace("ktc: 767", "ktc: 76700"), "ktc of 7.67e+04 N/mm2 is that of no material"),
        (OWN.replace("ktc: 767", "ktc: 0.767"), "ktc of 0.767 N/mm2 is that of no material"),
        (OWN.replace("ktc: 767", "ktc: 19000").replace("krc: 169", "krc: 90000"), "no robot mills with that"),
    ],
)
def test_coefficients_in_another_unit_are_reported(folder, coefficients, words):
    state(folder, STOCK + TOOLS.replace("material: EN AW-7075-T6", coefficients))
    findings = found(folder, "STK028", 0 if words is None else 3)
    assert (findings == []) == (words is None)
    assert words is None or words in " ".join(one["message"] for one in findings)


@pytest.mark.parametrize(
    ("coefficients", "words"),
    [
        (OWN.replace("krc: 169", "krc: 0.169"), "krc of 0.169 N/mm2 does not belong to ktc of 767 N/mm2"),
        (OWN.replace("kac: 222", "kac: 22200"), "kac of 2.22e+04 N/mm2 does not belong to ktc of 767 N/mm2"),
        (OWN.replace("kre: 26.6", "kre: 0.0266"), "kre of 0.0266 N/mm does not belong to kte of 27.7 N/mm"),
        (OWN.replace("kae: 0.7", "kae: 700"), "kae of 700 N/mm does not belong to kte of 27.7 N/mm"),
        (OWN.replace("krc: 169", "krc: 0").replace("kre: 26.6", "kre: 0"), None),  # left out on purpose
        (OWN.replace("kae: 0.7", "kae: 0.001"), None),
    ],
)
def test_coefficients_that_do_not_belong_to_one_another(folder, coefficients, words):
    state(folder, STOCK + TOOLS.replace("material: EN AW-7075-T6", coefficients))
    findings = found(folder, "STK028", 0 if words is None else 3)
    assert words is None or words in " ".join(one["message"] for one in findings)


@pytest.mark.parametrize(
    ("feed", "spindle", "depth", "chip"),
    [
        (60, 12000, 5, "0.00167 mm"),  # mm/s for mm/min
        (3600, 1257, 5, "0.955 mm"),  # rad/s for 1/min
        (3600, 1257, 1, None),  # what a cutter for high feeds does
        (200, 12000, 5, None),
        (7200, 4000, 5, None),
    ],
)
def test_feeds_per_tooth_of_no_cut(folder, feed, spindle, depth, chip):
    (folder / "part.ngc").write_text(SLOT.replace("F3600", f"F{feed}").replace("Z-5", f"Z-{depth}"))
    state(folder, STOCK + tool(spindle=spindle))
    findings = found(folder, "STK024", 0 if chip is None else 3)
    assert len(findings) == (chip is not None)
    assert all(f"a feed per tooth of {chip} here" in one["message"] for one in findings)


def test_a_radius_per_minute_is_an_implausible_chip(folder):
    """Hz for 1/min: 6 mm per tooth; rad/s: 0.95 mm, below what a cutter of 16 mm cannot do, and above that of 8 mm."""
    state(folder, STOCK + tool(spindle=200))
    assert "6 mm here" in found(folder, "STK024")[0]["message"]
    state(folder, STOCK + tool(spindle=1257, diameter=8))
    assert "0.955 mm here" in found(folder, "STK024")[0]["message"]


def test_the_main_job_reports_it_too(folder):
    from click.testing import CliRunner

    from postproc.cli.main import main

    state(folder, STOCK + tool(diameter=0.63))
    result = CliRunner().invoke(main, ["predict", str(folder / "part.ngc"), "--force=", "--json", "-"])
    assert result.exit_code == 3
    assert [one["code"] for one in json.loads(result.stdout)["findings"]].count("STK025") == 2
