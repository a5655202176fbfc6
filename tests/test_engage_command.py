"""``compensate engage``: its files and results, and what it refuses: an error with its place, nothing written."""

import csv
import json
import shutil
import struct

import numpy as np
import pytest

pytest.importorskip("numba")

import jsonschema_rs
from click.testing import CliRunner

from postproc.base.findings import Refusal
from postproc.cli.main import main
from postproc.robot.description import find_robot
from postproc.schemas import schema_of
from postproc.workflows.engage import EngageRequest, engage

CELL = """
robot: {robot}
tools:
  1: {{x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}}
  2: {{x: 120, y: 0, z: 240, a: 0, b: 30, c: 0, axis: +z}}
bases: {{1: {{x: 1450, y: -100, z: 600, a: 0, b: 0, c: 0}}}}
start: [0, -90, 90, 0, 45, 0]
orientation: {{a: 0, b: 0, c: 180}}
process: milling.yaml
dialect: {{name: linuxcnc}}
"""
STOCK = "stock: {box: [[0, 0, -30], [100, 60, 0]]}\n"
TOOLS = """tools:
  1: {shape: flat, diameter: 16, length: 40, teeth: 3, helix: 30, spindle: 12000}
defaults: {material: EN AW-7075-T6}
"""
SLOT = "G21 G90 G17 G54\nT1 M6\nG0 X-20 Y30 Z5\nG0 Z-5\nG1 X50 F3600\nG1 X120\nG0 Z30\nM2\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "cell.yaml").write_text(CELL.format(robot=find_robot("kuka_kr270")))
    (tmp_path / "milling.yaml").write_text(STOCK + TOOLS)
    (tmp_path / "part.ngc").write_text(SLOT)
    return tmp_path


def call(folder, *words, code=0):
    result = CliRunner().invoke(main, ["engage", str(folder / "part.ngc"), *map(str, words)])
    assert result.exit_code == code, result.output + result.stderr
    return result


def refused(folder, name, *words, line=None):
    before = sorted(folder.iterdir())
    out = call(
        folder, "--csv", folder / "out.csv", "--stock-out", folder / "out.stock", "--json", "-", code=1
    )
    assert sorted(folder.iterdir()) == before
    (finding, *_) = json.loads(out.stdout)["findings"]
    assert finding["code"] == name, finding
    for word in words:
        assert word in finding["message"] + finding["help"], finding
    if line is not None:
        assert finding["line"] == line
    return finding


def state(folder, text):
    (folder / "milling.yaml").write_text(text)


def test_the_result_and_its_files(folder):
    out = call(folder, "--csv", folder / "out.csv", "--stock-out", folder / "out.stock", "--json", "-")
    result = json.loads(out.stdout)
    jsonschema_rs.validate(schema_of("engage"), result)
    assert result["removal_mm3"] == pytest.approx(100 * 16 * 5, rel=0.003)
    assert result["states"] == {"air": 3, "cut": 2, "collision": 0}
    assert result["collisions"] == []
    rows = list(csv.DictReader((folder / "out.csv").read_text().splitlines()))
    assert [row["state"] for row in rows] == ["air", "air", "cut", "cut", "air"]
    cut = {key: float(value) for key, value in rows[2].items() if key != "state"}
    assert (cut["line"], cut["ap_mm"]) == (5, pytest.approx(5, abs=0.01))
    assert (cut["phi_entry_deg"], cut["phi_exit_deg"]) == (
        pytest.approx(0, abs=0.1),
        pytest.approx(180, abs=0.1),
    )
    assert cut["chip_mm"] == pytest.approx(0.1, abs=1e-4)
    # the second motion is a slot from its start on, with the mean force of the whole
    assert result["force"]["max_n"] == pytest.approx(float(rows[3]["force_max_n"]), rel=1e-3)
    assert result["force"]["ci95"] == pytest.approx(0.469, abs=0.001)


def test_the_next_program_finds_what_the_first_left(folder):
    call(folder, "--stock-out", folder / "one.stock")
    state(folder, "stock: {from: one.stock}\n" + TOOLS)
    (folder / "part.ngc").write_text(SLOT.replace("Y30", "Y30.5"))
    result = json.loads(call(folder, "--json", "-").stdout)
    assert result["removal_mm3"] == pytest.approx(100 * 0.5 * 5, rel=0.01)
    (folder / "part.ngc").write_text(SLOT)
    refused(folder, "STK008", "no motion cuts")


def test_drill_cycles_are_named_as_what_is_not_simulated(folder):
    """Alone they are refused; beside other motions they are a warning."""
    holes = "G0 X20 Y30 Z5\nG81 X20 Y30 Z-10 R2 F300\nX40\nG80\nG0 Z30\n"
    (folder / "part.ngc").write_text(f"G21 G90 G17 G54\nT1 M6\n{holes}M2\n")
    refused(folder, "STK007", "drill cycles are not simulated")
    (folder / "part.ngc").write_text(SLOT.replace("M2", f"{holes}M2"))
    findings = json.loads(call(folder, "--json", "-", code=3).stdout)["findings"]
    (found,) = [one for one in findings if one["code"] == "STK013"]
    assert found["message"].startswith("2 motions")
    assert "it is a drill cycle" in found["message"]


@pytest.mark.parametrize(
    ("option", "name"), [("--stock-out", "one.stock"), ("--csv", "milling.yaml"), ("--json", "part.ngc")]
)
def test_no_output_replaces_an_input(folder, option, name):
    """What an earlier program left would be lost, and the next run would start from something else."""
    call(folder, "--stock-out", folder / "one.stock")
    state(folder, "stock: {from: one.stock}\n" + TOOLS)
    (folder / "part.ngc").write_text(SLOT.replace("Y30", "Y38"))
    before = {path: path.read_bytes() for path in folder.iterdir()}
    result = CliRunner().invoke(main, ["engage", str(folder / "part.ngc"), option, str(folder / name)])
    assert result.exit_code in (1, 2), result.output
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.slow
@pytest.mark.parametrize("name", ["part.ngc", "milling.yaml", "cell.yaml"])
def test_what_changes_during_the_run_is_told(folder, name):
    """Before the cut is simulated: what was read is another state than what is there when it is written."""

    def change(stage):
        if stage == "cutting":
            (folder / name).write_text((folder / name).read_text() + "\n")

    request = EngageRequest(folder / "part.ngc", stock_out=folder / "left.stock", csv=folder / "part.csv")
    with pytest.raises(Refusal) as refused:
        engage(request, change)
    assert [finding.code for finding in refused.value.findings] == ["FIL010"]
    assert not (folder / "left.stock").exists()
    assert not (folder / "part.csv").exists()


def test_a_blank_as_a_mesh_is_that_of_the_box(folder):
    whole = json.loads(call(folder, "--json", "-").stdout)
    write_stl(folder / "blank.stl", cuboid([0, 0, -30], [100, 60, 0]))
    state(folder, "stock: {stl: blank.stl}\n" + TOOLS)
    meshed = json.loads(call(folder, "--json", "-").stdout)
    assert meshed["removal_mm3"] == pytest.approx(whole["removal_mm3"], rel=1e-3)
    assert meshed["force"]["max_n"] == pytest.approx(whole["force"]["max_n"], rel=1e-3)
    write_stl(folder / "blank.stl", cuboid([0, 0, -30], [100, 60, 0]), ascii=True)
    assert json.loads(call(folder, "--json", "-").stdout)["removal_mm3"] == meshed["removal_mm3"]
    write_stl(folder / "blank.stl", cuboid([0, 0, -0.03], [0.1, 0.06, 0]))
    state(folder, "stock: {stl: {file: blank.stl, scale: 1000}}\n" + TOOLS)
    assert json.loads(call(folder, "--json", "-").stdout)["removal_mm3"] == pytest.approx(
        meshed["removal_mm3"], rel=1e-4
    )


def test_a_round_blank(folder):
    state(folder, "stock: {cylinder: {center: [50, 30, -30], diameter: 50, height: 30}}\n" + TOOLS)
    result = json.loads(call(folder, "--json", "-").stdout)
    y = np.linspace(-8, 8, 100_001)
    assert result["removal_mm3"] == pytest.approx(5 * np.trapezoid(2 * np.sqrt(25**2 - y**2), y), rel=0.005)


def test_a_tool_without_teeth_is_geometry_only(folder):
    state(folder, STOCK + "tools:\n  1: {shape: flat, diameter: 16}\n")
    out = call(folder, "--json", "-", code=3)
    result = json.loads(out.stdout)
    jsonschema_rs.validate(schema_of("engage"), result)
    assert result["force"] == {"max_n": None, "mean_n": None, "ci95": None}
    assert [finding["code"] for finding in result["findings"]] == ["STK015", "STK017", "STK029"]
    assert "teeth, helix, spindle (or S in the program), material" in result["findings"][0]["message"]


def test_collisions_have_their_line(folder):
    (folder / "part.ngc").write_text(SLOT.replace("G1 X50 F3600", "G0 X50"))
    result = json.loads(call(folder, "--json", "-", code=3).stdout)
    assert result["collisions"] == [{"line": 5, "part": "cutter"}]
    assert [finding["line"] for finding in result["findings"] if finding["code"] == "STK011"] == [5]
    call(folder, "--strict", "--csv", folder / "out.csv", code=1)
    assert not (folder / "out.csv").exists()


def test_a_holder_wider_than_its_clearance_has_its_line(folder):
    """A slot of 5 mm with a holder 4.5 mm above the tip: it is in the stock beside."""
    state(
        folder,
        STOCK + TOOLS.replace("length: 40,", "length: 4.2, shank: 15, holder: {diameter: 40, from: 4.5},"),
    )
    result = json.loads(call(folder, "--json", "-", code=3).stdout)
    assert {"line": 5, "part": "holder"} in result["collisions"]
    found = [one for one in result["findings"] if one["code"] == "STK012"]
    assert found
    assert "the shank and the holder are in the stock" in found[0]["message"]
    call(folder, "--strict", "--csv", folder / "out.csv", code=1)
    assert not (folder / "out.csv").exists()
    clear = TOOLS.replace("length: 40,", "length: 5.2, shank: 15, holder: {diameter: 40, from: 5.5},")
    state(folder, STOCK + clear)
    assert json.loads(call(folder, "--json", "-").stdout)["collisions"] == []


@pytest.mark.parametrize(
    ("text", "code", "words", "line"),
    [
        (STOCK + TOOLS.replace("teeth: 3", "teeth: 0"), "YML004", ["teeth", "whole number"], 3),
        (STOCK + TOOLS.replace("teeth: 3", "tooths: 3"), "YML002", ["teeth"], 3),
        (STOCK.replace("box", "boxx") + TOOLS, "YML002", ["box"], 1),
        (STOCK + TOOLS.replace("flat", "square"), "YML004", ["flat"], 3),
        (
            STOCK + TOOLS.replace("length: 40,", "length: 40, holder: {diameter: 63, from: 30},"),
            "YML004",
            ["edges"],
            3,
        ),
        (STOCK + TOOLS.replace("1: {", "2: {"), "STK006", ["tool 1"], 5),
        ("stock: {box: [[0, 0, 0], [100, 60, 0]]}\n" + TOOLS, "YML004", ["no volume"], 1),
        (
            "stock: {box: [[0, 0, -40], [100, 60, -10]]}\n" + TOOLS,
            "STK008",
            ["the blank is in", "Z -40..-10"],
            1,
        ),
        (
            "stock: {box: [[0, 0, -0.03], [0.1, 0.06, 0]]}\n" + TOOLS,
            "STK008",
            ["no motion cuts", "in metres?"],
            1,
        ),
        (
            STOCK + TOOLS.replace("diameter: 16, length: 40", "diameter: 0.016, length: 0.04"),
            "YML004",
            ["0.016 mm", "in metres? state mm: diameter: 16"],
            3,
        ),
        ("stock: {stl: none.stl}\n" + TOOLS, "FIL001", [], None),
        ("stock: {from: cell.yaml}\n" + TOOLS, "STK016", ["no stock file"], 1),
        ("stock: {base: 7, box: [[0, 0, -30], [100, 60, 0]]}\n" + TOOLS, "STK010", ["base 7"], 1),
        (STOCK + TOOLS + "operations: []\n", "YML004", ["stock"], 5),
        (
            "stock: {cylinder: {diameter: 60, height: 20}}\n" + TOOLS,
            "YML003",
            ["center", "middle of a cylinder's foot", "goes along +axis"],
            1,
        ),
        ("stock: {base: 1}\n" + TOOLS, "YML003", ["cylinder: {center", "middle of a cylinder's foot"], 1),
        (
            "stock: {cylinder: {center: [50, 30, -40], diameter: 60, height: 30}}\n" + TOOLS,
            "STK008",
            ["Z -40..-10", "center is the middle of a cylinder's foot"],
            1,
        ),
        (TOOLS, "YML003", ["stock"], None),
        (STOCK + TOOLS.replace("shape: flat,", "shape: bull, corner_radius: 9,"), "YML004", ["radius"], 3),
        (
            STOCK + TOOLS.replace("defaults", "  01: {shape: ball, diameter: 6}\ndefaults"),
            "YML004",
            ["stated twice"],
            4,
        ),
        (
            STOCK + TOOLS.replace("shape: flat,", "shape: cone, angle: 1.05,"),  # rad
            "YML004",
            ["the diameter where the edges end is 0.733", "below 16 mm"],
            3,
        ),
    ],
)
def test_what_is_wrong_is_refused(folder, text, code, words, line):
    state(folder, text)
    refused(folder, code, *words, line=line)


def cuboid(low, high):
    corners = np.array([[(low, high)[n >> k & 1][k] for k in range(3)] for n in range(8)], float)
    faces = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4)]
    faces += [(2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]
    return corners[np.array(faces)]


def write_stl(path, triangles, ascii=False):
    if ascii:
        lines = ["solid blank"]
        for triangle in triangles:
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex " + " ".join(map(repr, corner)) for corner in triangle.tolist()]
            lines += ["endloop", "endfacet"]
        path.write_text("\n".join([*lines, "endsolid blank"]))
        return
    raw = b"\0" * 80 + struct.pack("<I", len(triangles))
    path.write_bytes(raw + b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in triangles))


BOX = cuboid([0, 0, -30], [100, 60, 0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("triangles", "code", "words"),
    [
        (BOX[:-1], "STK003", ["not closed"]),
        (BOX[:, ::-1], "STK004", ["face inward"]),
        (BOX / 1000, "STK005", ["metres", "scale: 1000"]),
        (BOX * 1000, "STK005", ["scale: 0.001"]),
        (BOX - np.array([0, 0, 100.0]), "STK008", ["the blank is in"]),
        (BOX[:0], "STK002", ["0 triangles"]),
        (
            np.concatenate([BOX, cuboid([130, 0, -30], [150, 60, 0])[:, ::-1]]),
            "STK004",
            ["face inward, and is no cavity"],
        ),
        (np.where(BOX == 60, np.nan, BOX), "STK002", ["not a number"]),
    ],
)
def test_a_mesh_that_is_no_blank_is_refused(folder, triangles, code, words):
    write_stl(folder / "blank.stl", triangles)
    state(folder, "stock: {stl: blank.stl}\n" + TOOLS)
    refused(folder, code, *words)


def test_a_body_within_another_that_faces_inward_is_a_cavity(folder):
    """A slot 5 mm deep opens a cavity from 4 to 3 mm below the top: its volume is missing in what is removed."""
    solid = json.loads(call(folder, "--json", "-").stdout)["removal_mm3"]
    cavity = cuboid([40, 28, -4], [60, 32, -3])[:, ::-1]
    write_stl(folder / "blank.stl", np.concatenate([BOX, cavity]))
    state(folder, "stock: {stl: blank.stl}\n" + TOOLS)
    removed = json.loads(call(folder, "--json", "-").stdout)["removal_mm3"]
    assert solid - removed == pytest.approx(20 * 4 * 1, rel=0.1)


@pytest.mark.parametrize("cut", [83, 84, 200, -1])
def test_a_mesh_that_is_cut_short_is_refused(folder, cut):
    write_stl(folder / "blank.stl", BOX)
    raw = (folder / "blank.stl").read_bytes()
    (folder / "blank.stl").write_bytes(raw[:cut])
    state(folder, "stock: {stl: blank.stl}\n" + TOOLS)
    refused(folder, "STK002")


def test_a_damaged_stock_file_is_refused(folder):
    call(folder, "--stock-out", folder / "one.stock")
    raw = (folder / "one.stock").read_bytes()
    (folder / "one.stock").write_bytes(raw[: len(raw) // 2])
    state(folder, "stock: {from: one.stock}\n" + TOOLS)
    refused(folder, "STK016")


def test_the_main_job_takes_the_forces_of_the_stock(folder):
    result = CliRunner().invoke(main, ["program", str(folder / "part.ngc"), "--force=", "--json", "-"])
    assert result.exit_code in (0, 3), result.output
    report = json.loads(result.stdout)
    assert report["force"]["source"] == "cell: milling.yaml"
    engaged = json.loads(call(folder, "--json", "-").stdout)
    assert report["force"]["max_n"] == pytest.approx(engaged["force"]["max_n"], rel=0.01)
    shutil.rmtree(folder / "compensated")
    state(folder, STOCK + "tools:\n  1: {shape: flat, diameter: 16}\n")
    result = CliRunner().invoke(main, ["program", str(folder / "part.ngc"), "--force=", "--json", "-"])
    assert result.exit_code == 1
    assert [finding["code"] for finding in json.loads(result.stdout)["findings"]] == ["STK009"]
    assert not (folder / "compensated").exists()


@pytest.mark.slow
def test_a_plunge_has_its_force_in_the_main_job(folder):
    """Straight down there is no feed across the spindle: the thrust acts along it, away from the part."""
    (folder / "part.ngc").write_text("G21 G90 G17 G54\nT1 M6\nG0 X50 Y30 Z5\nG1 Z-5 F600\nG0 Z30\nM2\n")
    result = CliRunner().invoke(main, ["predict", str(folder / "part.ngc"), "--force=", "--json", "-"])
    assert result.exit_code in (0, 3), result.output
    chip = 0.01 / 600  # m: 600 mm/min, 600 teeth a second
    thrust = 3 * 0.008 * (168.8e6 * chip + 26.6e3)
    assert json.loads(result.stdout)["force"]["max_n"] == pytest.approx(thrust, rel=0.01)


@pytest.mark.slow
def test_the_main_job_reports_the_error_of_the_part(folder):
    """A slot: its floor and walls as posted and as compensated; the files of the mesh say the same."""
    result = CliRunner().invoke(main, ["program", str(folder / "part.ngc"), "--force=", "--json", "-"])
    assert result.exit_code in (0, 3), result.output
    report = json.loads(result.stdout)
    jsonschema_rs.validate(schema_of("report"), report)
    part = report["part_error_mm"]
    across = report["across_feed_mm"]["before"]["max"]
    assert part["area_mm2"] == pytest.approx(100 * (16 + 2 * 5), rel=0.1)
    assert {group["name"] for group in part["features"]} >= {"floor", "wall"}
    before, after = part["before"], part["after"]
    largest = max(before["gouge_max"], before["excess_max"])
    assert 0.1 * across < largest < 1.1 * report["error_before_mm"]["max"]
    # the force of the slot pushes the tool to one side: one wall keeps what the other loses
    wall = next(group for group in part["features"] if group["name"] == "wall")["before"]
    assert wall["gouge_max"] == pytest.approx(wall["excess_max"], rel=0.1)
    assert abs(before["worst"]["error"]) == pytest.approx(largest)
    assert before["worst"]["line"] in (5, 6)
    assert before["ci95"] == pytest.approx(0.47 * largest, rel=0.1)
    # but for the ends, where the tool enters and leaves, and settles from 4 mm beside
    assert after["rms"] < 0.5 * before["rms"]
    assert after["out_of_tolerance"] < 0.7 < 0.9 < before["out_of_tolerance"]
    beyond = max(after["gouge_max"], after["excess_max"]) > report["tolerance_mm"]
    assert [one["code"] for one in report["findings"]].count("PRT002") == beyond
    # what stays beyond lies where the tool enters and leaves, and is said to
    (left,) = [one for one in report["findings"] if one["code"] == "PRT003"]
    assert "where the tool enters, leaves" in left["message"]
    assert left["line"] in (5, 6)
    ply = (folder / "compensated" / "part.part.ply").read_bytes()
    head, _, body = ply.partition(b"end_header\n")
    vertices = int(head.split(b"element vertex ")[1].split()[0])
    rows = np.frombuffer(body, [("at", "<f4", 3), ("colour", "u1", 4), ("quality", "<f4")], vertices)
    assert (rows["at"].min(axis=0) > [-0.01, -0.01, -30.01]).all()
    error = rows["quality"][np.isfinite(rows["quality"])]
    assert np.abs(error).max() == pytest.approx(max(after["gouge_max"], after["excess_max"]), rel=1e-3)
    faces = int(head.split(b"element face ")[1].split()[0])
    assert len(body) == vertices * rows.dtype.itemsize + 13 * faces
    glb = (folder / "compensated" / "part.part.glb").read_bytes()
    magic, version, size, length = struct.unpack("<4sIII", glb[:16])
    assert (magic, version, size) == (b"glTF", 2, len(glb))
    scene = json.loads(glb[20 : 20 + length])
    assert scene["accessors"][0]["count"] == vertices
    assert scene["accessors"][2]["count"] == 3 * faces


def test_without_a_stock_there_is_no_part(folder):
    result = CliRunner().invoke(main, ["predict", str(folder / "part.ngc"), "--force=0,100,0", "--json", "-"])
    assert json.loads(result.stdout)["part_error_mm"] is None


def test_the_largest_depth_is_that_of_the_whole_motion(folder):
    """A turn of a helix into solid material: 3 mm deep at its end, where its force is not the largest one."""
    helix = SLOT.replace(
        "G0 X-20 Y30 Z5\nG0 Z-5\nG1 X50 F3600\nG1 X120\n", "G0 X40 Y30 Z1\nG3 X40 Y30 Z-3 I6 J0 F1000\n"
    )
    (folder / "part.ngc").write_text(helix)
    result = json.loads(call(folder, "--json", "-").stdout)
    assert result["tools"]["1"]["ap_max_mm"] == pytest.approx(3.0, abs=0.15)
    assert result["tools"]["1"]["ae_max_mm"] == pytest.approx(16.0, abs=0.1)
