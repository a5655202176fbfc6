"""The part on the page of a program: the numbers that its script draws, the robot, and what a browser shows."""

import base64
import importlib.util
import json
import re
import shutil
import zlib

import numpy as np
import pytest

pytest.importorskip("numba")

from postproc.base.geometry import Poses
from postproc.report import part_page
from postproc.report.page import FOLDER
from postproc.report.part_page import part_data
from postproc.report.part_scene import robot_chain
from postproc.robot.chain import Chain
from postproc.robot.description import load_robot
from postproc.workflows.preparation import Request
from postproc.workflows.program import compensate

pytest_plugins = ("browser",)

SAMPLE = "samples/kr270_stock"


@pytest.fixture(scope="module")
def made(tmp_path_factory, pytestconfig):
    """The page, the report, and the part that the page is drawn from."""
    folder = tmp_path_factory.mktemp("page")
    shutil.copytree(pytestconfig.rootpath / "robots", folder / "robots")
    shutil.copytree(pytestconfig.rootpath / SAMPLE, folder / SAMPLE)
    parts = []

    def kept(part, scene):
        parts.append(part)
        return part_data(part, scene)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(part_page, "part_data", kept)
        report = compensate(Request(folder / SAMPLE / "part.ngc", force=""))
    return folder / SAMPLE / "compensated" / "part.report.html", report, parts[-1]


@pytest.fixture(scope="module")
def page(made):
    return made[:2]


def numbers(data, name, form):
    return np.frombuffer(base64.b64decode(data[name]), form)


def drawn(path, name="part-data"):
    return json.loads(re.search(f'id="{name}">(.*?)</script>', path.read_text(encoding="utf-8"), re.S)[1])


def followed(scene, base, values):
    """The flange (4, 4) of the chain that the page draws, multiplied out joint by joint."""
    whole = lambda rows: np.vstack([np.reshape(rows, (3, 4)), [0, 0, 0, 1]])  # noqa: E731
    at = whole(base)
    for joint in scene["joints"]:
        value = sum(ratio * values[column] for column, ratio in joint["follows"])
        move = np.eye(4)
        if joint["turns"]:
            move[:2, :2] = [[np.cos(value), -np.sin(value)], [np.sin(value), np.cos(value)]]
        else:
            move[2, 3] = value
        at = at @ whole(joint["placement"]) @ move
    return at @ whole(scene["flange"])


@pytest.mark.parametrize("name", ["kuka_kr270", "fanuc_m900ib_700"])
def test_the_drawn_chain_is_that_of_the_robot(name, pytestconfig):
    robot = load_robot(pytestconfig.rootpath / "robots" / f"{name}.yaml")
    values = np.random.default_rng(1).uniform(-1, 1, len(robot.joints))
    chain = Chain(robot.joints, robot.flange)
    coordinates = np.zeros((chain.size, 1))
    coordinates[chain.motor_rows, 0] = values
    pose = chain.evaluate(coordinates, Poses.identity()).pose
    flange = followed(robot_chain(robot), [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0], values)
    np.testing.assert_allclose(flange[:3, 3] / 1000, pose.position[0], atol=1e-8)
    np.testing.assert_allclose(flange[:3, :3], pose.rotation[0], atol=1e-8)


@pytest.mark.slow
def test_what_the_script_draws_is_what_the_report_says(made):
    path, report, drawn_from = made
    text = path.read_text(encoding="utf-8")
    assert len(text) < 10e6
    data = drawn(path)
    part = report.as_json()["part_error_mm"]
    places = numbers(data, "vertices", "<u2").reshape(-1, 4)[:, :3]
    errors = numbers(data, "errors", "<i2").reshape(-1, 2).astype(float)
    faces = numbers(data, "faces", "<u4")
    assert data["corners"] == len(faces)
    assert faces.max() < len(places) == len(errors)
    assert data["extent"] == pytest.approx([120, 80, 30], abs=0.1)
    # the largest gouge and excess are those of the report
    # up to where all that is larger has one colour
    after = errors[errors[:, 1] > -32768, 1] / 32767 * data["range"]
    for found, key in ((after.max(), "excess_max"), (-after.min(), "gouge_max")):
        assert found == pytest.approx(min(part["after"][key], 0.99 * data["range"]), abs=1e-5)
    # each vertex has the largest error of the points around it, and those are the points that the report counts
    surface, own = drawn_from.surface, drawn_from.own
    around, area = surface.vertex[own], surface.area[own]
    tolerance = drawn_from.figures.tolerance
    for column, name in enumerate(("before", "after")):
        size = np.abs(getattr(drawn_from, name).error)
        share = area[size > tolerance].sum() / area.sum()
        assert share == pytest.approx(part[name]["out_of_tolerance"], abs=1e-6)
        largest = np.full(len(places), -1.0)
        np.maximum.at(largest, around.ravel(), np.repeat(size, 4))
        seen = errors[:, column]
        np.testing.assert_array_equal(seen > -32768, largest >= 0)
        known = largest >= 0
        wanted = np.minimum(largest[known] * 1000, 0.99 * data["range"])
        np.testing.assert_allclose(np.abs(seen[known]) / 32767 * data["range"], wanted, atol=2e-6)
        # a spot beyond the tolerance is drawn so at all its corners: no less is drawn than the report counts
        off = np.abs(seen) / 32767 * data["range"] > data["tolerance"]
        off &= seen > -32768
        clear = np.abs(size - tolerance) > 2e-9  # of the steps in which the errors are drawn
        assert np.all(off[around][(size > tolerance) & clear])
        touched = np.bincount(around[(size > tolerance) | ~clear].ravel(), minlength=len(places)) > 0
        assert not np.any(off & ~touched)
    # which the page says, because narrow strips within the tolerance between others do not show
    assert f"the largest error of the points around it, which are {part['spacing']:.2g} mm apart" in text
    for side in ("before", "after"):
        assert f"{part[side]['gouge_max']:.4f}" in text


@pytest.mark.slow
def test_robot_tool_and_path_are_where_the_program_has_them(page):
    """The flange of the drawn robot carries the tool of the cell to the programmed point, motion by motion."""
    path, _ = page
    scene = drawn(path)["scene"]
    columns = drawn(path, "data")["columns"]
    points = np.frombuffer(base64.b64decode(columns["position"]["base64"]), "<f4").reshape(-1, 3)
    values = numbers(scene, "joint_values", "<f4").reshape(len(points), -1)
    axes = numbers(scene, "axes", "<i2").reshape(-1, 3) / 32767
    frame = np.reshape(scene["frame"], (3, 4))
    turn = np.radians(30)
    spindle = np.array([np.sin(turn), 0, np.cos(turn)])  # b: 30 of both tools in cell.yaml
    for i in (1, 10, 27, 60, len(points) - 1):
        length = {1: 250, 2: 240}[scene["numbers"][numbers(scene, "cutter", "<u1")[i]]]
        flange = followed(scene, scene["robot"], values[i])
        tip = flange @ [120, 0, length, 1]
        wanted = frame[:, :3] @ points[i] + frame[:, 3]
        np.testing.assert_allclose(tip[:3], wanted, atol=0.002)
        np.testing.assert_allclose(-flange[:3, :3] @ spindle, axes[i], atol=1e-4)
    # the path: its ends are the programmed points of part.ngc, in the axes of the stock
    packed = scene["path"]
    raw = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), np.uint8).astype(int)
    steps = raw.reshape(3, 2, packed["count"])
    grid = np.cumsum(steps[:, 0] + 256 * steps[:, 1], axis=1).T % 65536
    places = np.array(packed["low"]) + grid / 65535 * packed["size"]
    program = [[-20, 4, 30], [-12, 4, 30], [-12, 4, -4], [132, 4, -4], [132, 14, -4]]
    np.testing.assert_allclose(places[:5], program, atol=0.01)


SET = """([id, value]) => {
  const input = document.getElementById(id);
  input.value = value;
  input.dispatchEvent(new Event('input'));
}"""


def changed(one, other):
    return int((np.abs(one - other).sum(axis=2) > 60).sum())


def blue(pixels):
    """The share of what is too deep by more than the tolerance."""
    r, g, b = np.moveaxis(pixels, 2, 0)
    return ((b > 2 * r) & (b > 1.3 * g) & (b > 60)).mean()


def green(pixels):
    """Places (K, 2) of the arrow."""
    r, g, b = np.moveaxis(pixels, 2, 0)
    return np.argwhere((g > 1.6 * r) & (g > 1.25 * b) & (g > 70))


@pytest.mark.slow
@pytest.mark.parametrize(("wide", "scheme"), [(1400, "light"), (390, "dark")])
def test_a_browser_shows_part_robot_and_force(window, page, wide, scheme):
    size = {"width": wide, "height": 800}
    shown = window(page[0], viewport=size, color_scheme=scheme, bypass_csp=True)
    web = shown.page
    if web.eval_on_selector("#part-live", "e => e.hidden"):
        pytest.skip("this Chromium has no WebGL 2")
    assert web.evaluate("document.documentElement.scrollWidth") <= wide
    assert shown.violations() == []
    # as posted the wall is blue, too deep by more than twice the tolerance; as compensated next to nothing is
    web.evaluate(SET, ["part-side", 0])
    posted = shown.pixels("#part")
    web.evaluate(SET, ["part-side", 1])
    after = shown.pixels("#part")
    assert blue(posted) > 0.02
    assert blue(after) < 0.1 * blue(posted)
    # the arrow is there, and turns with the motion: line 120 goes back along X, line 60 forth
    heads = {}
    for line in (60, 120):
        web.fill("#line", str(line))
        web.keyboard.press("Tab")
        assert web.locator("#part-line").inner_text().startswith(f"line {line}: G1")
        arrow = green(shown.pixels("#part"))
        assert len(arrow) > 100
        thin = np.cov(arrow.T)
        heads[line] = np.degrees(np.arctan2(2 * thin[0, 1], thin[1, 1] - thin[0, 0])) / 2
    assert abs(heads[60] - heads[120]) > 20
    web.uncheck("#part-force")
    assert len(green(shown.pixels("#part"))) == 0
    # the robot fills the view on demand, is above and beside the part, and goes away
    web.click("#part-cell")
    robot = shown.pixels("#part")
    web.uncheck("#part-robot")
    assert changed(robot, shown.pixels("#part")) > 0.03 * robot.shape[0] * robot.shape[1]
    assert not [said for said in shown.complaints if "GPU stall" not in said]


MOVING = """() => {
  const canvas = document.getElementById('part'), view = canvas.view, gl = view.gl;
  const bytes = Uint8Array.from(atob(view.data.errors), (letter) => letter.charCodeAt(0));
  const errors = new Int16Array(bytes.buffer), largest = (side, chosen) => {
    let most = 0;
    for (const i of chosen) { const e = errors[2 * i + side]; if (e > -32767) most = Math.max(most, Math.abs(e)); }
    return most;
  };
  const all = [...Array(errors.length / 2).keys()], sides = [];
  for (let side = 0; side < view.data.sides; side++) {
    const few = view.coarser(side), corners = new Uint32Array(few.count);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, few.buffer);
    gl.getBufferSubData(gl.ELEMENT_ARRAY_BUFFER, 0, corners);
    sides.push([few.count, view.faces.count, largest(side, corners), largest(side, all)]);
  }
  const still = canvas.width;
  view.moving = true;
  const levels = [0, 20, 70, 90, 140, 190, 240, 290, 340].map((now) => { view.watch(now); return view.level; });
  view.paint();
  const moving = canvas.width;
  view.moving = false;
  view.watch(400);
  view.paint();
  return { sides, levels, widths: [still, moving, canvas.width], shown: canvas.dataset.level };
}"""


@pytest.mark.slow
def test_a_view_that_moves_slowly_has_less_detail_until_it_rests(window, page):
    shown = window(page[0], viewport={"width": 900, "height": 700}, device_scale_factor=1)
    if shown.page.eval_on_selector("#part-live", "e => e.hidden"):
        pytest.skip("this Chromium has no WebGL 2")
    found = shown.page.evaluate(MOVING)
    for few, every, largest, of_all in found["sides"]:
        assert 3_000 < few < 0.2 * every
        assert largest == of_all  # the worst place is still there
    # two slow frames in a row take a level each time, one alone does not
    assert found["levels"] == [0, 0, 0, 0, 0, 1, 1, 2, 2]
    still, moving, after = found["widths"]
    assert (moving, after) == (round(still / 2), still)
    assert found["shown"] == "0"


@pytest.mark.slow
def test_playing_along_the_path(window, page):
    shown = window(page[0], viewport={"width": 900, "height": 700})
    web = shown.page
    if web.eval_on_selector("#part-live", "e => e.hidden"):
        pytest.skip("this Chromium has no WebGL 2")
    at = lambda: int(web.input_value("#part-motion"))  # noqa: E731
    web.evaluate(SET, ["part-motion", 2])
    web.evaluate(SET, ["part-speed", 70])
    first = shown.pixels("#part")
    web.focus("#part")
    web.keyboard.press(" ")
    assert web.inner_text("#part-play") == "pause"
    web.wait_for_function("() => +document.getElementById('part-motion').value > 8")
    web.keyboard.press(" ")
    there = at()
    assert there == int(web.input_value("#motion"))  # one motion is chosen in all figures
    assert changed(first, shown.pixels("#part")) > 500
    shown.frames(10)
    assert at() == there
    web.keyboard.press("n")
    assert at() == there + 1
    web.keyboard.press("r")
    assert not shown.complaints or all("GPU stall" in said for said in shown.complaints)


@pytest.mark.slow
def test_without_webgl_there_is_a_picture(window, page, tmp_path):
    text = page[0].read_text(encoding="utf-8")
    policy = re.compile(r'<meta http-equiv="Content-Security-Policy"[^>]*>')
    blind = "<script>HTMLCanvasElement.prototype.getContext = (get => function (kind, ...more) {"
    blind += " return kind === 'webgl2' ? null : get.call(this, kind, ...more); })"
    blind += "(HTMLCanvasElement.prototype.getContext);</script>"
    (tmp_path / "x.html").write_text(policy.sub(blind, text, count=1), encoding="utf-8")
    shown = window(tmp_path / "x.html")
    assert shown.page.eval_on_selector("#part-live", "e => e.hidden")
    pixels = shown.pixels("#part-static img >> nth=0")
    assert blue(pixels) > 0.02
    assert shown.complaints == []


@pytest.mark.slow
def test_the_browser_follows_the_same_chain(window, page):
    """Joint angles to flange: the page's script against the chain multiplied out here."""
    shown = window(page[0])
    scene = drawn(page[0])["scene"]
    script = (FOLDER / "robot.js").read_text(encoding="utf-8")
    values = numbers(scene, "joint_values", "<f4").reshape(-1, scene["columns"])[40].astype(float)
    code = "([chain, values]) => { " + script + "; return jointFrames(chain, chain.robot, values).flange; }"
    flange = shown.page.evaluate(code, [scene, values.tolist()])
    np.testing.assert_allclose(
        np.reshape(flange, (3, 4)), followed(scene, scene["robot"], values)[:3], atol=1e-6
    )


@pytest.mark.slow
def test_the_picture_of_the_sample_is_what_the_page_shows(window, chromium, page, pytestconfig):
    """Both halves of part.png, in squares of 10 pixels."""
    from PIL import Image

    shown = window(page[0])
    if shown.page.eval_on_selector("#part-live", "e => e.hidden"):
        pytest.skip("this Chromium has no WebGL 2")
    shown.page.close()
    folder = pytestconfig.rootpath / SAMPLE
    script = importlib.util.spec_from_file_location("draw_part", folder / "draw_part.py")
    draw_part = importlib.util.module_from_spec(script)
    script.loader.exec_module(draw_part)
    kept = Image.open(folder / "part.png").convert("RGB")
    for index, shot in enumerate(draw_part.photograph(page[0], chromium)):
        wide, high = shot.size
        assert kept.size == (2 * wide, high)
        half = kept.crop((index * wide, 0, (index + 1) * wide, high))
        small = [np.asarray(one.reduce(10), float) for one in (shot, half)]
        assert np.abs(small[0] - small[1]).mean() < 3
        assert (np.abs(small[0] - small[1]).max(axis=2) > 40).mean() < 0.01
