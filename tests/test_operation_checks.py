"""Operations with stated depths, meant in another unit or for another tool: what program, comments or cell contradict
is reported with exit 3, in every language, and a right file is silent."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from test_engage_command import CELL as GCODE_CELL

SAMPLES = Path(__file__).parents[1] / "samples"
NGC = "{units} G90 G17 G54 {feed}\n{comment}\nT1 M6\n{spindle}\nG0 X0 Y0 Z0\nG1 X{x} F{f}\nY{x}\nM2\n"
TOOL = {"diameter": 16, "teeth": 3, "helix": 30, "spindle": 12000}
CUT = {"axial_depth": 4, "direction": "down", "radial_width": 4}
ALLOY = {"ktc": 780, "krc": 190, "kac": 210, "kte": 22, "kre": 21, "kae": 1}


def stated(join="tool: 1", **changed):
    values = {**TOOL, **CUT} | {key: value for key, value in changed.items() if key not in ALLOY}
    alloy = ALLOY | {key: value for key, value in changed.items() if key in ALLOY}
    words = ", ".join(f"{key}: {value}" for key, value in values.items())
    numbers = ", ".join(f"{key}: {value}" for key, value in alloy.items())
    return f"operations:\n  - {{{join}, {words}, coefficients: {{{numbers}}}, ci95: 0.1}}\n"


@pytest.fixture
def run(compensate, tmp_path):
    """Predicts the G-code of NGC with a process and a cell; the warnings by code, and how it ended."""

    def call(process=None, of_cell="", **program):
        words = {
            "units": "G21",
            "feed": "G94",
            "comment": "",
            "spindle": "S12000 M3",
            "f": 3600,
            "x": 100,
        } | program
        cell = GCODE_CELL.format(robot="kuka_kr270").replace("axis: +z}", f"axis: +z{of_cell}}}", 1)
        (tmp_path / "cell.yaml").write_text(cell)
        (tmp_path / "milling.yaml").write_text(process or stated())
        (tmp_path / "part.ngc").write_text(NGC.format(**words))
        return warnings(compensate("predict", tmp_path / "part.ngc", "--force", "--json", "-"))

    return call


def warnings(done):
    found: dict[str, list] = {}
    for one in done.json["findings"]:
        if re.fullmatch("FRC04[1-6]", one["code"]):
            assert one["severity"] == "warning"
            found.setdefault(one["code"], []).append(one)
    assert done.code == (3 if found else 0)
    return found


@pytest.mark.parametrize(
    "program",
    [{}, {"spindle": ""}, {"comment": "(T1 D=16. CR=0. - ZMIN=0. - flat end mill)"},
     {"comment": "(16 mm Endmill)"}, {"comment": "(T1 0.63 inch end mill)"},
     {"units": "G20", "f": 141.73, "x": 4}, {"feed": "G95", "f": 0.3}],
)  # fmt: skip
def test_a_right_file_is_silent(run, program):
    assert run(of_cell=", diameter: 16", **program) == {}


@pytest.mark.parametrize(
    ("program", "words"),
    [
        ({"spindle": "S3000 M3"}, "2 motions at S 3000; the process file states spindle 12000 1/min"),
        ({"spindle": "S3000 M3", "feed": "G95", "f": 0.3}, "2 motions at S 3000"),
        ({"spindle": "S12050 M3"}, "2 motions at S 12050"),
    ],
)
def test_another_speed_than_the_programs_is_reported(run, program, words):
    (one,) = run(**program).pop("FRC042")
    assert one["line"] == 6
    assert f"operation tool 1 cuts {words}" in one["message"]


def test_a_cut_after_the_spindle_is_stopped_is_reported(run):
    found = run(spindle="S12000 M5")
    assert list(found) == ["FRC043"]
    assert "cuts in 2 motions after the program stops the spindle" in found["FRC043"][0]["message"]
    assert found["FRC043"][0]["line"] == 6


def test_the_other_direction_is_refused(compensate, run, tmp_path):
    run()
    (tmp_path / "part.ngc").write_text((tmp_path / "part.ngc").read_text().replace("M3", "M4"))
    done = compensate("predict", tmp_path / "part.ngc", "--force", "--json", "-")
    assert done.code == 1
    assert "FRC033" in [one["code"] for one in done.json["findings"]]


@pytest.mark.parametrize(
    ("program", "process", "chip"),
    [
        ({"f": 0.06}, {}, 0.06 / 12000 / 3),
        ({"f": 3.6}, {}, 3.6 / 12000 / 3),
        ({"f": 3600, "spindle": ""}, {"spindle": 600}, 3600 / 600 / 3),
        ({"units": "G20", "f": 3600, "x": 4}, {}, 25.4 * 3600 / 12000 / 3),
    ],
)
def test_a_feed_per_tooth_of_no_cutter_is_reported(run, program, process, chip):
    """By hand: F / (n z)."""
    (one,) = run(stated(**process), **program)["FRC044"]
    given = float(re.search(r"feed per tooth of (\S+) mm here", one["message"])[1])
    assert given == pytest.approx(chip, rel=0.01)
    assert one["line"] == 6


@pytest.mark.parametrize(
    ("process", "words"),
    [
        ({"ktc": 0.78, "krc": 0.19, "kac": 0.21}, "ktc of 0.78 N/mm2 is that of no material"),
        ({"ktc": 780e3, "krc": 190e3}, "ktc of 7.8e+05 N/mm2 is that of no material"),
        ({"kte": 22000}, "kte of 2.2e+04 N/mm belongs to no edge"),
        ({"krc": 19000}, "krc of 1.9e+04 N/mm2 does not belong to ktc of 780 N/mm2"),
        ({"axial_depth": 60, "spindle": 1000, "diameter": 20, "radial_width": 8, "ktc": 3000, "krc": 1500},
         "no robot mills with that"),
    ],
)  # fmt: skip
def test_coefficients_of_no_material_and_forces_of_no_robot_are_reported(run, process, words):
    found = run(stated(**process), spindle="")["FRC046"]
    assert any(words in one["message"] for one in found), found
    assert {one["line"] for one in found} == {2}


@pytest.mark.parametrize(
    ("changed", "of_cell", "words"),
    [
        ({"diameter": 8}, 16, "8 mm here, which is used, and 16 mm in the cell|one of them is a radius"),
        ({"diameter": 160}, 16, "160 mm here, which is used, and 16 mm in the cell|in centimetres"),
        ({"diameter": 0.63, "radial_width": 0.1}, 16, "25.4 times: one of them is in inches|below 1 mm"),
        ({"diameter": 160}, None, "move at 6031.9 m/min"),
        ({"diameter": 210}, None, "above 200 mm"),
        ({"diameter": 1.2, "radial_width": 0.7, "axial_depth": 5}, None, "cuts 5 mm deep at half of its width or more"),
        ({"diameter": 1.2, "radial_width": 0.2, "axial_depth": 20}, None, "cuts 20 mm deep somewhere (line 6)"),
        ({"teeth": 300}, None, "0.168 mm from one to the next"),
        ({"helix": 0.5236}, None, "is it in rad? it would be 30 deg"),
        ({"spindle": 72000}, None, "diameter 16 mm, turns at 72000 1/min"),
    ],
)  # fmt: skip
def test_a_tool_of_another_size_is_reported(run, changed, of_cell, words):
    found = run(stated(**changed), "" if of_cell is None else f", diameter: {of_cell}")["FRC045"]
    text = " ".join(one["message"] + " " + one["help"] for one in found)
    for word in words.split("|"):
        assert word in text
    assert {one["line"] for one in found} == {2}


@pytest.mark.parametrize(
    ("comment", "words"),
    [
        ("(T1 D=16. CR=0. - ZMIN=-5. - flat end mill)", "names 16 for tool 1"),
        ("(T1 D=16. CR=0. - ZMIN=0. - flat end mill)", "16"),
        ("(16 mm Endmill)", "names 16 mm for tool 1"),
    ],
)
def test_another_diameter_than_the_comments_is_reported(run, comment, words):
    found = run(stated(diameter=8), comment=comment)
    (one,) = found["FRC041"]
    assert one["line"] == 2
    assert words in one["message"]
    assert "states the diameter 8 mm for operation tool 1, which is used" in one["message"]


def test_one_number_for_two_cutters_in_turn_is_no_contradiction(run):
    assert run(stated(diameter=8), comment="(T1 8 mm Endmill)\n(T1 16 mm Endmill)") == {}


def test_programs_of_robots_are_compared_with_their_cell(compensate, job, tmp_path):
    """KRL and RAPID state no speed of the spindle; tool and coefficients are checked as in G-code."""
    text = job.program.read_bytes().replace(b";FORCE", b";").decode()
    job.program.write_text(text.replace("$VEL.CP=0.05", "$VEL.CP=0.06"))
    cell = (job.folder / "cell.yaml").read_text()
    job.cell(cell.replace("axis: +z}", "axis: +z, diameter: 16}", 1))
    process = job.folder / "milling.yaml"
    rapid = tmp_path / "rapid"
    shutil.copytree(SAMPLES / "irb6700_pocket", rapid)
    module = (rapid / "pocket.mod").read_text().replace("! FORCE", "! ")
    (rapid / "pocket.mod").write_text(module)
    for program in (job.program, rapid / "pocket.mod"):
        for changed, codes in (
            ({}, set()),
            ({"diameter": 8}, {"FRC045"}),
            ({"ktc": 0.78, "krc": 0.19, "kac": 0.21}, {"FRC046"}),
            ({"spindle": 200}, {"FRC044"}),
        ):
            process.write_text(stated(**changed | {"rapid": 0.15}))
            done = compensate("predict", program, "--force", process, "--json", "-")
            found = {one["code"] for one in done.json["findings"] if one["severity"] == "warning"}
            assert found & {"FRC041", "FRC042", "FRC043", "FRC044", "FRC045", "FRC046"} == codes, program


def test_the_same_mistake_is_named_with_a_stock_and_without(compensate, run, tmp_path):
    """Both sources of one cut: the speed, the diameter of the cell and the coefficients, in the same words."""
    pytest.importorskip("numba")
    found = run(stated(ktc=0.78, krc=0.19, kac=0.21), ", diameter: 8", spindle="S3000 M3")
    alloy = ALLOY | {"ktc": 0.78, "krc": 0.19, "kac": 0.21}
    tool = ", ".join(f"{key}: {value}" for key, value in TOOL.items())
    (tmp_path / "milling.yaml").write_text(
        "stock: {box: [[0, -4, -4], [100, 60, 4]]}\n"
        f"tools: {{1: {{shape: flat, length: 40, {tool}}}}}\n"
        f"defaults: {{coefficients: {{{', '.join(f'{k}: {v}' for k, v in alloy.items())}}}}}\n"
    )
    done = compensate("predict", tmp_path / "part.ngc", "--force", "--json", "-")
    for own, other in (("FRC042", "STK021"), ("FRC045", "STK025"), ("FRC046", "STK028")):
        here = [one["message"].replace("operation ", "") for one in found[own]]
        there = [one["message"] for one in done.json["findings"] if one["code"] == other]
        assert there
        assert [re.sub(r"\d+ motions", "motions", text) for text in here] == [
            re.sub(r"\d+ motions", "motions", text) for text in there
        ]


def test_the_spindle_of_the_sample_is_that_of_its_cut():
    """The power by hand: the mean moment is the sum of the tangential forces over the angles of all teeth."""
    from test_milling import KTC, KTE, cut_of

    from postproc.process.milling_forces import mean_torque

    cut, feed = cut_of("down", 4.0), 0.1
    angle = np.linspace(0, 2 * np.pi, 400_001)[:-1] + np.pi / 400_000
    inside = (np.cos(angle) <= -0.5) & (np.sin(angle) > 0)  # 4 of 16 mm: from 120 to 180 deg
    tangential = 5.0 * (KTC * feed * np.sin(angle) + KTE) * inside  # N, at a depth of 5 mm
    wanted = 3 * tangential.mean() * 8e-3
    assert mean_torque(cut, np.array([1e-4]))[0] == pytest.approx(wanted, rel=1e-4)
