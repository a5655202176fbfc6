"""``compensate map``: the paper's square through the command line, laws of the survey, files, wrong input."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import matplotlib.image
import numpy as np
import pytest

from postproc.base.geometry import Poses, rotation_from_abc
from postproc.cli.main import COMMANDS
from postproc.model import StiffnessModel
from postproc.placement.workspace_map import MapLoad, WorkspaceGrid, evaluate_workspace, with_sign
from postproc.report import picture
from postproc.robot.description import find_robot, load_robot
from postproc.robot.inverse import branch_of
from postproc.workflows.map import MapRequest, map_workspace

SAMPLE = Path(__file__).resolve().parent.parent / "samples" / "kr270_paper"
ROBOT = ["map", "--robot", "kuka_kr270", "--tool", "0,0,300", "--orientation", "0,0,180"]
FORCE = "--force=-360,0,560@world"
SQUARE = [*ROBOT, "--x", "200:2200", "--y=-1000:1000", "--z", "500", "--grid", "41", FORCE, "--linear"]
COARSE = [*ROBOT, "--x", "200:2200", "--y=-1000:1000", "--z", "500", "--grid", "9", FORCE]
BOX = [*ROBOT, "--x", "400:2600", "--y=-1000:1000", "--z", "100:1700", "--grid", "4", FORCE]


def kr270() -> StiffnessModel:
    return StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270")))


def load(wrench=(-360.0, 0, 560, 0, 0, 0), **change) -> MapLoad:
    tool = Poses(np.eye(3), np.array([0.0, 0.0, 0.3]))
    return MapLoad(tool, rotation_from_abc([0.0, 0.0, np.pi]), np.array(wrench), **change)


def square(count: int = 9) -> WorkspaceGrid:
    return WorkspaceGrid(np.linspace(0.2, 2.2, count), np.linspace(-1.0, 1.0, count), np.array([0.5]))


def table(path: Path) -> dict[str, np.ndarray]:
    """The CSV as columns, NaN for an empty cell."""
    with path.open(newline="") as stream:
        rows = list(csv.reader(stream))
    cells = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows[1:]])
    return dict(zip(rows[0], cells.T, strict=True))


def robot_file(folder: Path, what: str, instead: str) -> Path:
    text, found = re.subn(what, instead, find_robot("kuka_kr270").read_text(), flags=re.DOTALL)
    assert found
    path = folder / "robot.yaml"
    path.write_text(text)
    return path


# The paper's square


@pytest.mark.parametrize(
    ("more", "unreachable", "bare", "as_is", "difference"),
    [
        ([], 235, ("0.398", "3.487"), ("0.400", "3.506"), "0.0863"),
        (["--sign", "energy"], 235, ("0.398", "3.487"), ("0.400", "3.506"), "0.0863"),
        (["--sign", "as_printed"], 235, ("0.398", "3.487"), ("0.395", "3.472"), "0.0688"),
        (["--ignore-limits"], 0, ("0.274", "3.487"), ("0.273", "3.506"), "0.0863"),
        (["--ignore-limits", "--sign", "as_printed"], 0, ("0.274", "3.487"), ("0.274", "3.472"), "0.0688"),
    ],
)
def test_square_of_the_paper(compensate, more, unreachable, bare, as_is, difference):
    done = compensate(*SQUARE, *more, "--json", "-")
    assert (done.code, done.err) == (0, "")
    found = done.json
    assert (found["cells"], found["unreachable"]) == (1681, unreachable)
    without = found["deflection_without_compensator_mm"]
    assert (f"{without['min']:.3f}", f"{without['max']:.3f}") == bare
    whole = found["deflection_mm"]
    assert (f"{whole['min']:.3f}", f"{whole['max']:.3f}") == as_is
    assert f"{found['compensator_difference_mm']['max']:.4f}" == difference
    assert found["beyond_limits"] == 235
    assert found["method"] == "linear"


def test_table_of_the_square(compensate):
    done = compensate(*SQUARE)
    assert done.code == 0
    for words in ("x 200 .. 2200 (41), y -1000 .. 1000 (41), z 500 mm", "(-360, 0, 560) N @world", "eq. (5)"):
        assert words in done.out
    assert "235 cells: 0 out of reach, 235 beyond the axis limits" in done.out
    assert re.search(
        r"without gravity compensator +0\.3976 +1550, 0, 500 +3\.4866 +2200, -1000, 500", done.out
    )
    assert re.search(r"stiffest at 1500, 0, 500 mm: 0\.400 mm, axes A1 0\.0, A2 -67\.4", done.out)
    assert "softest  at 2200, -1000, 500 mm: 3.506 mm" in done.out
    quiet = compensate(*SQUARE, "-q")
    assert (quiet.code, quiet.out) == (0, "")


@pytest.mark.slow
def test_compensated_with_and_without_the_compensator():
    done = subprocess.run(
        [sys.executable, "compare.py"], cwd=SAMPLE, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    rows = {line[:20].strip(): line.split()[-3:] for line in done.stdout.splitlines()[1:]}
    assert rows == {
        "without compensator": ["1446", "3.4867", "0.0000"],
        "sign as_printed": ["1446", "3.4723", "0.0688"],
        "sign energy": ["1446", "3.5065", "0.0863"],
    }


@pytest.mark.slow
def test_pictures_of_the_sample_are_what_the_command_draws(compensate, tmp_path):
    """Size apart: another version of the drawing library sets other pixels."""
    for name in ("fig4.png", "fig5.png"):
        assert (SAMPLE / name).stat().st_size < 120_000
    compensate(*SQUARE, "--picture", tmp_path / "fig4.png", "-q")
    drawn, kept = (matplotlib.image.imread(folder / "fig4.png") for folder in (tmp_path, SAMPLE))
    assert drawn.shape == kept.shape
    assert np.abs(drawn - kept).mean() < 0.02


# Laws


@pytest.mark.parametrize("sign", ["energy", "as_printed"])
def test_linear_is_the_limit_of_the_equilibrium(sign):
    """The relative distance of the two falls in proportion to the force."""
    model, distances = with_sign(kr270(), sign), []
    for scale in (1.0, 0.1, 0.01):
        wrench = scale * np.array([-360.0, 200, 560, 20, 0, 10])
        full, linear = (
            evaluate_workspace(model, square(), load(wrench, linear=how)) for how in (False, True)
        )
        assert np.array_equal(full.mapped, linear.mapped)
        for one, other in ((full.deflection, linear.deflection), (full.without, linear.without)):
            distances.append(np.nanmax(np.linalg.norm(one - other, axis=1)) / np.nanmax(linear.size))
    for large, small in zip(distances, distances[2:], strict=False):
        assert 0.05 < small / large < 0.2
    assert distances[-1] < 2e-4


def test_full_equilibrium_is_the_default_and_differs(compensate):
    full, linear = (compensate(*COARSE, *more, "--json", "-").json for more in ([], ["--linear"]))
    assert full["method"] == "equilibrium"
    gap = full["deflection_mm"]["max"] - linear["deflection_mm"]["max"]
    assert 0.001 < abs(gap) < 0.05


@pytest.mark.sample(1)
@pytest.mark.parametrize("linear", [False, True])
def test_a_cell_alone_is_the_cell_of_the_batch(linear):
    grid = WorkspaceGrid(np.linspace(0.5, 2.5, 4), np.linspace(-0.8, 0.8, 3), np.linspace(0.3, 1.5, 3))
    whole = evaluate_workspace(kr270(), grid, load(linear=linear))
    assert whole.mapped.any()
    assert not whole.mapped.all()
    for row, place in enumerate(grid.positions):
        alone = evaluate_workspace(kr270(), WorkspaceGrid(*place[:, None]), load(linear=linear))
        assert alone.mapped[0] == whole.mapped[row]
        for name in ("q", "deflection", "without"):
            np.testing.assert_allclose(getattr(alone, name)[0], getattr(whole, name)[row], rtol=0, atol=1e-14)


def test_a_cell_by_the_models_own_functions():
    """One cell, step by step: the angles bring the TCP there, and the deflection is loaded minus unloaded."""
    model, grid, asked = kr270(), square(), load()
    found = evaluate_workspace(model, grid, asked)
    row = int(np.flatnonzero(found.mapped)[17])
    q = found.q[row : row + 1]
    pose = model.chain.flange(q) @ asked.tool
    np.testing.assert_allclose(pose.position[0], grid.positions[row], atol=1e-12)
    np.testing.assert_allclose(pose.rotation[0], asked.orientation, atol=1e-12)
    for variant, deflection in (
        (model, found.deflection),
        (model.without_effects(["gravity_compensator"]), found.without),
    ):
        loaded = variant.equilibrium(q, asked.wrench[None], asked.tool).pose.position[0]
        free = variant.equilibrium(q, np.zeros((1, 6)), asked.tool).pose.position[0]
        np.testing.assert_allclose(deflection[row], loaded - free, atol=1e-15)
    assert found.difference[row] == pytest.approx(np.linalg.norm(found.deflection[row] - found.without[row]))


def test_many_batches_are_one(monkeypatch):
    whole = evaluate_workspace(kr270(), square(), load())
    monkeypatch.setattr("postproc.placement.workspace_map.BATCH", 7)
    parts = evaluate_workspace(kr270(), square(), load())
    for name in ("q", "mapped", "in_reach", "within", "deflection", "without"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), rtol=0, atol=1e-14)


def test_left_and_right_mirror_each_other():
    """The arm is symmetric about y = 0, and so is a force in the xz plane."""
    found = evaluate_workspace(kr270(), square(), load())
    size = found.size.reshape(9, 9)
    np.testing.assert_allclose(size, size[:, ::-1], rtol=1e-9)
    bent = found.deflection.reshape(9, 9, 3)
    np.testing.assert_allclose(bent[..., 1], -bent[:, ::-1, 1], atol=1e-12)


@pytest.mark.parametrize("status", range(8))
def test_status_is_the_branch(status):
    model = kr270()
    found = evaluate_workspace(
        model,
        WorkspaceGrid(np.linspace(0.6, 1.6, 5), np.array([0.3]), np.linspace(0.4, 1.6, 5)),
        load(branch=status, ignore_limits=True),
    )
    assert found.mapped.any()
    assert (branch_of(model.robot.nominal, found.q[found.mapped]) == status).all()
    low, high = model.robot.limits.T
    inside = ((found.q >= low) & (found.q <= high)).all(axis=1)
    assert np.array_equal(inside, found.within)


def test_force_in_tool_axes(compensate):
    """The tool points down (C = 180): its y and z are the base's -y and -z."""
    base = compensate(*COARSE[:-1], "--force=-360,50,560,10,20,30@base", "--json", "-").json
    tool = compensate(*COARSE[:-1], "--force", "-360,-50,-560,10,-20,-30@tool", "--json", "-").json
    for key in ("deflection_mm", "deflection_without_compensator_mm", "compensator_difference_mm"):
        assert tool[key] == pytest.approx(base[key], rel=1e-6, abs=1e-6)
    turned = compensate(*COARSE[:-1], "--force=-360,50,560,10,20,30@tool", "--json", "-").json
    assert turned["deflection_mm"]["max"] != pytest.approx(base["deflection_mm"]["max"], rel=1e-3)


def test_force_along_a_leaning_tool(compensate):
    words = [*COARSE[:-1], "--orientation", "30,20,170"]
    along = rotation_from_abc(np.radians([30, 20, 170])) @ [40.0, -120.0, -500.0]
    base = compensate(*words, "--force", ",".join(f"{v:.12f}" for v in along), "--json", "-").json
    tool = compensate(*words, "--force", "40,-120,-500@tool", "--json", "-").json
    assert tool["deflection_mm"] == pytest.approx(base["deflection_mm"], abs=1e-6)


def test_deflection_is_that_of_the_force_alone(compensate, tmp_path):
    """A compensator that pulls at rest bends the arm; the map shows what the force adds."""
    robot = robot_file(tmp_path, "preload: balanced", "preload: acting")
    robot.write_text(robot.read_text().replace("value: 6.944444e6", "value: 1.0e5"))
    words = [*COARSE[:-1], "--robot", robot, "--force=-3.6,0,5.6", "--json", "-"]
    full, linear = (compensate(*words, *more).json["deflection_mm"] for more in ([], ["--linear"]))
    assert full == pytest.approx(linear, rel=0.02)
    assert full["max"] < 0.05


def test_arm_that_is_no_kuka(compensate):
    words = [
        "map",
        "--robot",
        "ur5",
        "--x",
        "300:600",
        "--y=-200:200",
        "--z",
        "300",
        "--grid",
        "3",
        "--force",
        "0,0,-50",
    ]
    done = compensate(*words, "--json", "-")
    assert done.code == 3
    assert [finding["code"] for finding in done.json["findings"]] == ["MAP007", "MAP005"]
    assert done.json["grid"]["status"] is None
    assert done.json["unreachable"] == 0
    refused = compensate(*words, "--status", "2")
    assert refused.code == 1
    assert "MAP006" in refused.err


def test_orientation_and_tool_are_taken(compensate):
    """A tool turned by -90 deg on the flange and turned back in the base: the same arm, the same map."""
    words = [
        "map",
        "--robot",
        "kuka_kr270",
        "--x",
        "900:1900",
        "--y",
        "0:600",
        "--z",
        "700",
        "--grid",
        "5",
        FORCE,
    ]
    plain = compensate(*words, "--tool", "0,100,300", "--orientation", "0,0,180", "--json", "-").json
    turned = compensate(*words, "--tool", "0,100,300,90,0,0", "--orientation=-90,0,180", "--json", "-").json
    assert turned["deflection_mm"] == pytest.approx(plain["deflection_mm"], abs=1e-6)
    other = compensate(*words, "--tool", "0,100,300,90,0,0", "--orientation", "0,0,180", "--json", "-").json
    assert other["deflection_mm"] != pytest.approx(plain["deflection_mm"], abs=1e-4)


# Files


def test_json(compensate, tmp_path):
    file = tmp_path / "map.json"
    done = compensate(*COARSE, "--json", file)
    assert done.code == 0
    assert f"wrote {file}" in done.out
    straight = compensate(*COARSE, "--json", "-").json
    assert {**straight, "outputs": [str(file)]} == json.loads(file.read_text())
    assert straight["robot"] == "kuka_kr270"
    assert straight["force"] == {"values": [-360, 0, 560, 0, 0, 0], "frame": "world"}
    assert straight["grid"]["points"] == [9, 9, 1]
    assert straight["grid"]["x_mm"] == [200, 2200]
    assert straight["grid"]["z_mm"] == [500, 500]
    assert straight["extremes_at"]["deflection_mm"]["max"] == {"x_mm": 2200, "y_mm": -1000, "z_mm": 500}
    assert straight["findings"] == []


def test_csv(compensate, tmp_path):
    file = tmp_path / "deep" / "map.csv"
    done = compensate(*BOX, "--csv", file, "--json", "-")
    assert done.code == 0
    found, cells = done.json, table(file)
    assert len(cells["x_mm"]) == found["cells"] == 64
    reached = cells["reachable"] == 1
    assert set(cells["reachable"]) == {0.0, 1.0}
    assert (~reached).sum() == found["unreachable"] > 0
    places = {tuple(place) for place in np.stack([cells[f"{axis}_mm"] for axis in "xyz"], axis=1)}
    assert len(places) == 64
    np.testing.assert_allclose(
        np.unique(cells["z_mm"]), [100, 100 + 1600 / 3, 100 + 3200 / 3, 1700], atol=1e-6
    )
    for size, lead in (("deflection_mm", ""), ("without_mm", "without_")):
        vector = np.stack([cells[f"{lead}d{axis}_mm"] for axis in "xyz"])
        np.testing.assert_allclose(np.linalg.norm(vector, axis=0), cells[size], atol=2e-6)
        assert np.array_equal(np.isfinite(cells[size]), reached)
    np.testing.assert_allclose(
        sum((cells[f"d{a}_mm"] - cells[f"without_d{a}_mm"]) ** 2 for a in "xyz") ** 0.5,
        cells["difference_mm"],
        atol=3e-6,
    )
    for key, column in (
        ("deflection_mm", "deflection_mm"),
        ("deflection_without_compensator_mm", "without_mm"),
        ("compensator_difference_mm", "difference_mm"),
    ):
        assert np.nanmin(cells[column]) == pytest.approx(found[key]["min"], abs=1e-6)
        assert np.nanmax(cells[column]) == pytest.approx(found[key]["max"], abs=1e-6)
        for end in ("min", "max"):
            place = np.array([found["extremes_at"][key][end][f"{axis}_mm"] for axis in "xyz"])
            there = np.stack([cells[f"{axis}_mm"] for axis in "xyz"], axis=1) - place
            row = int(np.argmin(np.abs(there).sum(axis=1)))
            assert cells[column][row] == pytest.approx(found[key][end], abs=1e-6)
    axes = np.stack([cells[f"A{i}_deg"] for i in range(1, 7)], axis=1)
    assert np.isnan(axes).any(axis=1).sum() == found["out_of_reach"]
    low, high = np.degrees(kr270().robot.limits.T)
    assert np.array_equal(((axes > low) & (axes < high)).all(axis=1), reached)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "panels"),
    [
        (COARSE, 2),
        ([*ROBOT, "--x", "200:3000", "--y", "100", "--z=0:2500", "--grid", "12", FORCE], 2),
        ([*ROBOT, "--x", "200:3000", "--y", "0", "--z", "500", "--grid", "20", FORCE], 2),
        (BOX, 4),
        ([*BOX[:-3], "--grid", "2", FORCE], 2),
    ],
)
def test_picture(compensate, tmp_path, words, panels):
    file = tmp_path / "map.png"
    done = compensate(*words, "--picture", file)
    assert done.code == 0, done.err
    raw = file.read_bytes()
    assert raw.startswith(b"\x89PNG")
    pixels = matplotlib.image.imread(file)
    assert min(pixels.shape[:2]) > 300
    assert len(np.unique(pixels[..., :3].reshape(-1, 3), axis=0)) > 20
    vector = tmp_path / "map.svg"
    compensate(*words, "--picture", vector, "-q")
    parts = [node.get("id", "") for node in ElementTree.parse(vector).iter()]
    assert sum(bool(re.fullmatch(r"axes_\d+", part)) for part in parts) >= panels
    compensate(*words, "--picture", file, "-q")
    assert file.read_bytes() == raw


def drawn(monkeypatch, tmp_path, **change):
    """What was surveyed, and the figure that is drawn of it."""
    figures = []
    canvas = picture.FigureCanvasAgg
    monkeypatch.setattr(picture, "FigureCanvasAgg", lambda figure: figures.append(figure) or canvas(figure))
    request = {
        "robot": "kuka_kr270",
        "ranges_mm": ((200.0, 2200.0), (-1000.0, 400.0), (500.0,)),
        "points": 8,
        "tool_mm_deg": (0, 0, 300.0, 0, 0, 0),
        "orientation_deg": (0, 0, 180.0),
        "wrench": (-360.0, 0, 560, 0, 0, 0),
        "frame": "base",
        "picture": tmp_path / "map.png",
    }
    return map_workspace(MapRequest(**{**request, **change})), figures[0]


def test_the_picture_shows_each_cell_in_its_place(monkeypatch, tmp_path):
    mapped, figure = drawn(monkeypatch, tmp_path)
    left, right = (axes for axes in figure.axes if axes.images)
    assert [left.get_xlabel(), left.get_ylabel()] == ["x, mm", "y, mm"]
    for axes, values in ((left, mapped.survey.size), (right, mapped.survey.difference)):
        shown = axes.images[0].get_array().filled(np.nan)
        x0, x1, y0, y1 = axes.images[0].get_extent()
        for (x, y, _), value in zip(mapped.survey.grid.positions * 1e3, values * 1e3, strict=True):
            column = int((x - x0) / (x1 - x0) * 8)
            row = int((y - y0) / (y1 - y0) * 8)
            np.testing.assert_allclose(shown[row, column], value, rtol=1e-12)
    title = figure.get_suptitle()
    assert "kuka_kr270" in title
    assert "(-360, 0, 560) N @base" in title
    assert "mm" in left.get_title()
    assert any("out of reach" in text.get_text() for text in figure.legends[0].get_texts())


@pytest.mark.slow
def test_a_box_with_many_slices_is_told(monkeypatch, tmp_path, compensate):
    ranges = ((600.0, 2000.0), (-700.0, 700.0), (200.0, 1800.0))
    mapped, figure = drawn(monkeypatch, tmp_path, ranges_mm=ranges, points=12)
    slices = [axes for axes in figure.axes if axes.images and axes.get_title()]
    assert len(slices) == 9
    assert slices[0].get_title() == "z 200 mm"
    assert slices[-1].get_title() == "z 1800 mm"
    assert "9 of 12 slices" in figure.get_suptitle()
    assert [finding.code for finding in mapped.findings] == ["MAP004"]
    assert mapped.exit == 0
    size = mapped.survey.size.reshape(12, 12, 12) * 1e3
    levels = np.linspace(200, 1800, 12)
    for axes in slices:
        level = int(np.argmin(np.abs(levels - float(axes.get_title().split()[1]))))
        shown = axes.images[0].get_array().filled(np.nan)
        np.testing.assert_allclose(shown, size[:, :, level].T, rtol=1e-12)
    for axes in slices:
        np.testing.assert_allclose(axes.images[0].get_clim(), (np.nanmin(size), np.nanmax(size)), rtol=1e-12)


def test_two_writings_of_a_range_that_begins_below_zero(compensate):
    words = [*ROBOT, "--x", "1200", "--z", "500", "--grid", "5"]
    tied = compensate(*words, "--y=-300:-100", FORCE, "--json", "-")
    loose = compensate(*words, "--y", "-300:-100", "--force", "-360,0,560", "--json", "-")
    assert tied.code == loose.code == 0
    assert tied.json["grid"] == loose.json["grid"]
    assert tied.json["grid"]["y_mm"] == [-300, -100]
    assert tied.json["deflection_mm"] == loose.json["deflection_mm"]


def test_grid_of_one_point_is_the_middle(compensate):
    words = [*ROBOT, "--x", "1000:1400", "--y", "0", "--z", "500:700", FORCE, "--json", "-"]
    one = compensate(*words, "--grid", "1").json
    point = compensate(*ROBOT, "--x", "1200", "--y", "0", "--z", "600", FORCE, "--json", "-").json
    assert one["cells"] == point["cells"] == 1
    assert one["deflection_mm"] == point["deflection_mm"]


def test_robot_without_a_compensator(compensate, tmp_path):
    robot = robot_file(tmp_path, r"\n  - effect: gravity_compensator.*?(?=\n  - |\n[a-z]|\Z)", "")
    words = [*COARSE, "--robot", robot]
    done = compensate(*words, "--json", "-", "--csv", tmp_path / "map.csv", "--picture", tmp_path / "map.png")
    assert done.code == 0
    found = done.json
    assert found["deflection_without_compensator_mm"] is None
    assert found["compensator_difference_mm"] is None
    assert found["sign"] is None
    cells = table(tmp_path / "map.csv")
    assert np.isnan(cells["without_mm"]).all()
    assert np.nanmax(cells["deflection_mm"]) == pytest.approx(found["deflection_mm"]["max"], abs=1e-6)
    whole = compensate(*COARSE, "--json", "-").json
    assert found["deflection_mm"] == whole["deflection_without_compensator_mm"]
    shown = compensate(*words)
    assert "without gravity compensator" not in shown.out
    assert "no gravity compensator" in shown.out

    done = compensate(*words, "--sign", "as_printed", "--csv", tmp_path / "new.csv")
    assert done.code == 1
    assert "MAP001" in done.err
    assert "nothing is written" in done.err
    assert not (tmp_path / "new.csv").exists()


def test_robot_that_does_not_give_way(compensate, tmp_path):
    robot = robot_file(tmp_path, r"effects:.*?(?=\n[a-z]|\Z)", "effects: []")
    done = compensate(*COARSE, "--robot", robot, "--picture", tmp_path / "map.png")
    assert done.code == 3
    assert "MAP005" in done.out
    assert done.err == ""


def test_force_without_an_equilibrium(compensate, tmp_path):
    done = compensate(*COARSE[:-1], "--force", "0,0,-1e9", "--json", "-", "--csv", tmp_path / "map.csv")
    assert done.code == 3
    assert [finding["code"] for finding in done.json["findings"]] == ["MAP003"]
    cells = table(tmp_path / "map.csv")
    assert ((cells["reachable"] == 1) & np.isnan(cells["deflection_mm"])).any()


# Wrong input


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--x", "2200:200"], ("--x", "must ascend")),
        (["--x", "200:200"], ("--x", "must ascend")),
        (["--x", "1:2:3"], ("neither one value nor a range",)),
        (["--x", "1:"], ("'' is not a number",)),
        (["--y", "nan"], ("'nan' is not a number",)),
        (["--y", "0:1e999"], ("--y", "not a number")),
        (["--z", "1e9"], ("exceeds 100000",)),
        (["--z", "5O0"], ("'5O0' is not a number",)),
        (["--grid", "0"], ("--grid",)),
        (["--grid", "-3"], ("--grid",)),
        (["--grid", "2.5"], ("--grid",)),
        (["--grid", "1000000000"], ("--grid",)),
        (["--grid", "1001"], ("--grid", "the limit of 1000000")),
        (["--z", "0:1000", "--grid", "101"], ("--grid", "the limit of 1000000")),
        (["--tool", "0,300"], ("2 numbers", "x,y,z")),
        (["--tool", "0,0,300,0"], ("4 numbers",)),
        (["--orientation", "0,0"], ("2 numbers", "A,B,C")),
        (["--orientation", "0,0,inf"], ("'inf'",)),
        (["--force", "0,360,560@feed"], ("--force", "no feed direction")),
        (["--force", "0,360"], ("--force", "2 numbers", "fx,fy,fz")),
        (["--force", "0,360,560@wrld"], ("did you mean 'world'",)),
        (["--force=force.csv"], ("--force", "fx,fy,fz")),
        (["--force"], ("--force", "fx,fy,fz")),
        (["--force", "0,0,0"], ("zero",)),
        (["--status", "8"], ("--status",)),
        (["--sign", "printed"], ("--sign", "as_printed")),
        (["--picture", "map.jpg"], ("must end in .png or .svg",)),
        (["--picture", "map"], ("must end in .png or .svg",)),
        (["--csv", "map.xlsx"], ("must end in .csv",)),
        (["--json", "map.csv"], ("must end in .json",)),
        (["--x", "900", "--y", "0", "--picture", "one.png"], ("single cell",)),
        (["--xx", "1"], ("--xx",)),
        (["part.src"], ("unexpected",)),
    ],
)
def test_wrong_command_line(compensate, tmp_path, monkeypatch, change, words):
    monkeypatch.chdir(tmp_path)
    outputs = ["--csv", "out.csv", "--json", "out.json"]
    done = compensate(*COARSE, *outputs, *change)
    assert done.code == 2, done.out + done.err
    missing = [word for word in words if word not in done.err]
    assert not missing, done.err
    assert done.out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("option", ["--robot", "--x", "--y", "--z", "--force"])
def test_what_must_be_given(compensate, option):
    words = [word for word in COARSE if not word.startswith(f"{option}=")]
    if option in words:
        at = words.index(option)
        del words[at : at + 2]
    done = compensate(*words)
    assert done.code == 2
    assert option in done.err


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--robot", "kuka_kr27"], ("CEL003", "did you mean 'kuka_kr270'")),
        (["--robot", "none.yaml"], ("CEL003", "does not exist")),
    ],
)
def test_what_can_not_be_done(compensate, tmp_path, monkeypatch, change, words):
    monkeypatch.chdir(tmp_path)
    done = compensate(*COARSE, *change, "--csv", "out.csv", "--picture", "out.png")
    assert done.code == 1
    for word in (*words, "nothing is written"):
        assert word in done.err
    assert list(tmp_path.iterdir()) == []


def test_nothing_in_reach(compensate, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = [*ROBOT, "--x", "5000:6000", "--y", "0:100", "--z", "500", "--grid", "3", FORCE]
    done = compensate(*words, "--csv", "out.csv", "--picture", "out.png", "--json", "out.json")
    assert done.code == 3
    assert "MAP002" in done.out
    assert [path.name for path in tmp_path.iterdir()] == ["out.json"]
    found = compensate(*words, "--json", "-").json
    assert found["deflection_mm"] is None
    assert found["extremes_at"] == {}
    assert (found["unreachable"], found["cells"], found["exit"]) == (9, 9, 3)


def test_only_beyond_the_limits(compensate):
    words = [*ROBOT, "--x", "300", "--y", "0", "--z", "500", FORCE]
    done = compensate(*words, "-v")
    assert done.code == 3
    assert "--ignore-limits" in done.out
    assert compensate(*words, "--ignore-limits").code == 0


def test_a_folder_that_can_not_be_written(compensate, tmp_path):
    (tmp_path / "taken").write_text("a file, no folder")
    done = compensate(*COARSE, "--csv", tmp_path / "taken" / "map.csv", "--picture", tmp_path / "map.png")
    assert done.code == 1
    assert "FIL004" in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_map_is_a_command():
    assert "map" in COMMANDS


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ["--x", "0.8:2.2", "--y=-1:1", "--z", "0.5", "--tool", "0,0,300"],
            ["--x, --y and --z", "2.2 m is 2200 mm"],
        ),
        (
            ["--x", "800:2200", "--y=-100:100", "--z", "500", "--tool", "0,0,0.3"],
            ["--tool", "0.3 m is 300 mm"],
        ),
        (["--x", "800:2200", "--y=-100:100", "--z", "0.5"], []),
    ],
)
def test_lengths_in_metres_are_told(compensate, options, words):
    done = compensate("map", "--robot", "kuka_kr270", *options, "--force=0,0,-500", "--grid", 3, "-v")
    assert ("MAP008" in done.out + done.err) == bool(words)
    assert done.code == (3 if words else 0)
    for word in words:
        assert word in done.out
