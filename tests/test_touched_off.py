"""What is corrected: touched-off bases, temperature, what the controller does itself, and what is left out."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import CELL
from plant import Plant
from scipy.spatial.transform import Rotation

from postproc.base.document import Document
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.cell import frames_of, load_cell
from postproc.compensation.touched_off import rigid_motion
from postproc.effects import EFFECTS, Conditions
from postproc.effects.thermal_growth import ThermalGrowth
from postproc.languages import detect
from postproc.model import EffectInstance, StiffnessModel
from postproc.process import wrenches
from postproc.robot.description import find_robot, load_robot
from postproc.robot.inverse import inverse
from postproc.workflows.robot_files import effect_options

MM, DEG = 1e-3, np.pi / 180

# the fit


def test_one_point_sees_a_shift():
    motion = rigid_motion(np.array([[1.0, 2.0, 3.0]]), np.array([[1.5, 1.0, 3.25]]))
    np.testing.assert_array_equal(motion.rotation, np.eye(3))
    np.testing.assert_allclose(motion.position, [0.5, -1.0, 0.25])


def test_two_points_see_the_least_turn_that_aligns_them():
    before = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    after = np.array([[0.1, 0.0, 0.0], [0.1 + 2 * math.cos(0.3), 2 * math.sin(0.3), 0.0]])
    motion = rigid_motion(before, after)
    np.testing.assert_allclose(motion.rotation, rotation_from_vector([0.0, 0.0, 0.3]), atol=1e-15)
    np.testing.assert_allclose((motion @ Poses(np.tile(np.eye(3), (2, 1, 1)), before)).position, after)
    # a distance that differs is shared by both
    longer = rigid_motion(before, np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 0.0]]))
    np.testing.assert_allclose(longer.position, [0.0, 0.5, 0.0], atol=1e-15)
    np.testing.assert_allclose(rigid_motion(before, before + 1.0).rotation, np.eye(3))


@pytest.mark.parametrize("count", [3, 4, 9])
def test_more_points_see_the_rigid_motion_of_least_squares(count):
    rng = np.random.default_rng(count)
    before = rng.normal(size=(count, 3))
    turn = rotation_from_vector(rng.normal(size=3))
    exact = rigid_motion(before, before @ turn.T + [1.0, 2.0, 3.0])
    np.testing.assert_allclose(exact.rotation, turn, atol=1e-12)
    np.testing.assert_allclose(exact.position, [1.0, 2.0, 3.0], atol=1e-12)
    after = before @ turn.T + rng.normal(size=before.shape) * 0.1
    found = rigid_motion(before, after)
    other, _ = Rotation.align_vectors(after - after.mean(axis=0), before - before.mean(axis=0))
    np.testing.assert_allclose(found.rotation, other.as_matrix(), atol=1e-7)
    np.testing.assert_allclose(found.rotation @ before.mean(axis=0) + found.position, after.mean(axis=0))
    assert np.linalg.det(found.rotation) == pytest.approx(1.0)


# the main job, held against MuJoCo

PLATE = [
    "DEF part()",
    "BAS(#INITMOV,0)",
    "$BASE=BASE_DATA[1]",
    "$TOOL=TOOL_DATA[1]",
    "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}",
    "$VEL.CP=0.05",
    "LIN {X 0,Y 0,Z 50,A 0,B 0,C 180}",
    "LIN {X 0,Y 0,Z 0,A 0,B 0,C 180}",
    ";FORCE -300 150 400 @base",
    *(f"LIN {{X {x},Y 0,Z 0,A 0,B 0,C 180}}" for x in (300, 600, 900)),
    *(f"LIN {{X {x},Y 300,Z 0,A 0,B 0,C 180}}" for x in (900, 450, 0)),
    *(f"LIN {{X {x},Y 600,Z 0,A 0,B 0,C 180}}" for x in (0, 450, 900)),
    ";FORCE OFF",
    "LIN {X 900,Y 600,Z 50,A 0,B 0,C 180}",
    "END",
]
CORNERS = "[[0, 0, 0], [900, 0, 0], [0, 600, 0]]"
MORE = """
  - effect: link_gravity
    parameters:
%s
  - effect: thermal_growth
    options: {variable: temperature, reference: 20}
    parameters:
      g3: {value: 1.4e-5, unit: m/K, source: test}
      g4: {value: 1.2e-5, unit: m/K, source: test}
  - effect: joint_offset
    parameters:
      o2: {value: 0.0004, unit: rad, source: test}
      o3: {value: -0.0003, unit: rad, source: test}
"""


def heavy_robot(folder, effects=MORE):
    """The KR 270 with weights, growth by temperature and joint offsets, in a file of its own."""
    model = StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270")))
    text = find_robot("kuka_kr270").read_text()
    if "%s" in effects:
        model = model.with_effect(EFFECTS["link_gravity"](model.robot.joints))
        moments = Plant.of(model).first_moments()
        units = {"mass": "kg"}
        effects = effects % "\n".join(
            f"      {name}: {{value: {value:.9g}, unit: {units.get(name, 'kg m')}, source: test}}"
            for name, value in moments.items()
        )
    (folder / "heavy.yaml").write_text(text.rstrip() + "\n" + effects)
    return load_robot(folder / "heavy.yaml")


def cell_of(job, *lines, robot="heavy.yaml"):
    """The cell, with a tool that points down and more lines."""
    job.cell(CELL.replace("kuka_kr270", robot) + "".join(line + "\n" for line in lines))


STATED = "controller: {absolute_accuracy: false}\nmax_growth: 20"


class OnPlant:
    """The written program on MuJoCo: nothing of the touching, the fit and the prediction of the package is used."""

    def __init__(self, job, temperature):
        self.cell = load_cell(job.folder / "cell.yaml")
        robot = load_robot(job.folder / self.cell.robot)
        self.model = StiffnessModel.from_robot(robot)
        self.plant, self.robot = Plant.of(self.model), robot
        self.wanted, self.written = (self._read(path) for path in (job.program, job.output))
        self.frames = frames_of(self.cell, self.wanted, job.program)
        self.force = wrenches(job.program, self.wanted, self.frames, self.cell, "")
        self.base, self.tool = self.frames.base_in_robot[1], self.frames.tool_in_flange[1]
        self.temperature = temperature

    @staticmethod
    def _read(path):
        raw = path.read_bytes()
        return detect(path, raw).read((Document(path, raw),)).toolpath

    def real(self, target, wrench):
        """TCP (K, 3) in the robot base when the controller is sent to ``target`` (K) in the base."""
        flange = self.base @ target @ self.tool.inverse()
        n = len(wrench)
        q = inverse(self.robot.nominal, flange, np.full(n, 2), np.zeros((n, 6))).q
        warm = Conditions(temperature=np.full(n, self.temperature))
        tool = Poses(np.tile(self.tool.rotation, (n, 1, 1)), np.tile(self.tool.position, (n, 1)))
        return np.array([self.plant.rest(q[i], wrench[i], tool[i], warm, i).position for i in range(n)])

    def base_motion(self, points):
        """Rotation and shift between the places that the controller reads and those that it touches."""
        n = len(points)
        down = np.tile(self.wanted.rotation[-2], (n, 1, 1))
        real = self.real(Poses(down, points), np.zeros((n, 6)))
        read = (self.base @ Poses(np.eye(3), points)).position
        if n == 1:
            return np.eye(3), (real - read)[0]
        turn, _ = Rotation.align_vectors(real - real.mean(axis=0), read - read.mean(axis=0))
        turn = turn.as_matrix()
        return turn, real.mean(axis=0) - turn @ read.mean(axis=0)

    def errors(self, points):
        """(K,) [m] of the cutting motions as they are written, from where the base puts them."""
        rows = np.flatnonzero(self.force.carries)
        # the motions of the original among those written: each is the nearest one
        place = self.written.position
        there = [int(np.nanargmin(np.linalg.norm(place - self.wanted.position[row], axis=1))) for row in rows]
        real = self.real(self.written.target_in_base[np.array(there)], self.force.values[rows])
        turn, shift = self.base_motion(points)
        wanted = (self.base @ self.wanted.target_in_base[rows]).position
        return np.linalg.norm(real - (wanted @ turn.T + shift), axis=1)


POINTS = np.array([[0, 0, 0], [900, 0, 0], [0, 600, 0]]) * MM


@pytest.mark.sample(1)
@pytest.mark.parametrize("points", [POINTS, POINTS[:1]], ids=["three corners", "one corner"])
def test_a_touched_off_base_is_corrected_on_the_plant(compensate, job, points):
    heavy_robot(job.folder)
    job.write(PLATE)
    stated = (points / MM).round(6).tolist()
    cell_of(job, STATED, "correct: touched_off", f"touch_points: {stated}", "temperature: 32")
    done = compensate(job.program, "--force", "--json", "-")
    # where a retraction begins no motion is inserted, which COR006 reports
    assert {f["code"] for f in done.json["findings"] if f["severity"] != "info"} <= {"COR006"}
    there = OnPlant(job, 12.0)
    assert there.errors(points).max() < 0.005 * MM
    # what the other points, or none, would have seen is another correction
    other = POINTS if len(points) == 1 else POINTS[:1]
    assert there.errors(other).max() > 0.1 * MM
    told = [finding for finding in done.json["findings"] if finding["code"] == "COR032"]
    assert len(told) == 1
    assert f"base 1 is touched off at {len(points)} point" in told[0]["message"]
    assert told[0]["line"] == 10


@pytest.mark.slow
def test_the_temperature_counts_from_the_reference(compensate, job):
    heavy_robot(job.folder)
    job.write(PLATE)
    cell_of(job, STATED, "correct: touched_off", f"touch_points: {CORNERS}", "temperature: 8")
    assert compensate(job.program, "--force", "-q").code in (0, 3)
    assert OnPlant(job, -12.0).errors(POINTS).max() < 0.005 * MM
    assert OnPlant(job, 0.0).errors(POINTS).max() > 0.02 * MM


@pytest.mark.slow
def test_points_see_more_of_the_sag_of_a_plate_than_one_corner(compensate, job):
    """The error that a correction of the process alone leaves on a plate of 900 x 600 mm."""
    heavy_robot(job.folder)
    job.write(PLATE)
    cell_of(job)
    assert compensate(job.program, "--force", "-q").code == 0
    plant = OnPlant(job, 0.0)
    corner, three = (plant.errors(points).max() for points in (POINTS[:1], POINTS))
    assert corner > 3.0 * MM
    assert three < 0.35 * MM


# wrong input

TWO_BASES = [line.replace("BASE_DATA[1]", "BASE_DATA[2]") for line in PLATE[2:-1]]


def refused(compensate, job, code, line, *words):
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code == 1
    found = done.json["findings"][0]
    assert (found["code"], found["line"]) == (code, line), found
    assert found["file"].endswith(".yaml")
    for word in words:
        assert word in found["message"] + found["help"], found
    assert job.nothing_written()


@pytest.mark.parametrize(
    ("points", "code", "words"),
    [
        ("[[0, 0, 0], [450, 0, 0], [900, 0, 0]]", "YML004", ["are on one line"]),
        ("[[0, 0, 0], [5000, 0, 0]]", "CEL012", ["touch point 5000, 0, 0 is out of reach", "line 10", "mm"]),
        ("[[-1500, 0, -600]]", "CEL012", ["the touch point -1500, 0, -600 is beyond the limits of an axis"]),
        ("{2: [[0, 0, 0]]}", "CEL012", ["the program uses base 1, none of which has touch points"]),
    ],
)
def test_points_that_can_not_be_touched_are_refused(compensate, job, points, code, words):
    job.write(PLATE)
    cell_of(job, STATED, "correct: touched_off", f"touch_points: {points}", robot="kuka_kr270")
    if code == "CEL012" and "none of" in words[0]:
        words = ["base 1 has no touch points, and the program cuts in it (line 10)"]
    refused(compensate, job, code, CELL.count("\n") + 4, *words)


@pytest.mark.slow
def test_of_several_bases_it_must_be_clear_which_was_touched(compensate, job):
    heavy_robot(job.folder)
    job.write([*PLATE[:-1], *TWO_BASES, "END"])
    second = "  2: {x: 1500, y: -250, z: 600, a: 0, b: 0, c: 0}\n"
    text = CELL.replace("kuka_kr270", "heavy.yaml").replace("start:", second + "start:")
    text += STATED + "\ncorrect: touched_off\n"
    line = text.count("\n") + 1
    job.cell(text + f"touch_points: {CORNERS}\n")
    refused(
        compensate, job, "CEL012", line, "base 1, 2: it is not clear which", "touch_points: {1: [[x, y, z]"
    )
    job.cell(text + f"touch_points: {{1: {CORNERS}}}\n")
    refused(
        compensate, job, "CEL012", line, "base 2 has no touch points, and the program cuts in it (line 28)"
    )
    job.cell(text + f"touch_points: {{1: {CORNERS}, 2: [[0, 0, 0]], 7: [[0, 0, 0]]}}\n")
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code in (0, 3)
    told = [f["message"] for f in done.json["findings"] if f["code"] == "COR032"]
    assert [message.split(" with")[0] for message in told] == [
        "base 1 is touched off at 3 points",
        "base 2 is touched off at 1 point",
    ]


def test_a_temperature_needs_a_reference(compensate, job):
    heavy_robot(job.folder, MORE.replace(", reference: 20", ""))
    job.write(PLATE)
    cell_of(job, STATED, "correct: absolute", "temperature: 32")
    text = (job.folder / "heavy.yaml").read_text()
    line = text[: text.index("effect: thermal_growth")].count("\n") + 1
    refused(compensate, job, "CEL011", line, "temperature of its calibration", "reference: 20")


def test_a_reference_of_a_growth_by_time_is_refused(compensate, job):
    heavy_robot(job.folder, MORE.replace("variable: temperature", "variable: time").replace("m/K", "m/s"))
    job.write(PLATE)
    cell_of(job)
    done = compensate(job.program, "--force", "--json", "-")
    assert done.json["findings"][0]["code"] == "YML004"
    assert "variable: time" in done.json["findings"][0]["message"]


# what is left out


def told(compensate, job, *lines, effects=MORE):
    """Code -> messages of what is said of effects that are not corrected."""
    heavy_robot(job.folder, effects)
    job.write(PLATE)
    cell_of(job, *lines)
    done = compensate(job.program, "--force", "--json", "-")
    assert done.code in (0, 3), done.out
    found = {}
    for finding in done.json["findings"]:
        if finding["code"] in ("COR030", "COR031"):
            found.setdefault(finding["code"], []).append(finding["message"])
    return found


@pytest.mark.slow
def test_what_the_process_leaves_is_named(compensate, job):
    words = "weights (link_gravity), temperature (thermal_growth), geometry (joint_offset)"
    said = f"correct: process does not correct errors of the robot without force: {words}"
    assert told(compensate, job) == {"COR030": [said]}
    found = told(compensate, job, "temperature: 24")
    assert found == {"COR030": ["temperature: is not used with correct: process", said]}
    assert told(compensate, job, effects="") == {}


def test_lost_motion_by_direction_is_corrected_and_not_named(compensate, job):
    loop = "  - effect: hysteresis\n    parameters:\n      w1: {value: 1e-3, unit: rad, source: test}\n"
    assert told(compensate, job, effects=loop) == {}
    gap = loop.replace("hysteresis", "backlash").replace("w1", "b1")
    words = "the side of a gap that weights choose (backlash)"
    said = f"correct: process does not correct errors of the robot without force: {words}"
    assert told(compensate, job, effects=gap) == {"COR030": [said]}


@pytest.mark.slow
def test_what_is_left_to_the_controller_is_named(compensate, job):
    mode = ["correct: absolute", "temperature: 24"]
    assert told(compensate, job, STATED, *mode) == {}
    found = told(compensate, job, "controller: {absolute_accuracy: true, gravity_compensated: true}", *mode)
    words = "weights (link_gravity), geometry (joint_offset)"
    assert found == {"COR030": [f"the controller corrects these, as the cell states: {words}"]}


@pytest.mark.slow
def test_growth_without_a_temperature_and_a_temperature_without_growth(compensate, job):
    growth = "thermal_growth of the robot file is not corrected: the cell states no temperature"
    assert told(compensate, job, STATED, "correct: absolute") == {"COR031": [growth]}
    none = "temperature: the robot file has no thermal_growth by temperature, so the growth is not corrected"
    found = told(compensate, job, STATED, "correct: absolute", "temperature: 24", effects="")
    assert found == {"COR031": [none]}
    by_time = MORE.replace(", reference: 20", "").replace("variable: temperature", "variable: time")
    found = told(compensate, job, STATED, "correct: absolute", effects=by_time.replace("m/K", "m/s"))
    assert found == {"COR031": ["thermal_growth by time is not corrected: the time of a run is not known"]}


@pytest.mark.slow
def test_an_accurate_controller_still_grows_warm(compensate, job):
    """Geometry is the controller's business; that of a warm robot is not the one it was calibrated with."""
    heavy_robot(job.folder)
    job.write(PLATE)
    sizes = []
    for temperature in (20, 40):
        accurate = STATED.replace("false", "true")
        cell_of(job, accurate, "correct: absolute", f"temperature: {temperature}")
        done = compensate(job.program, "--force", "--json", "-")
        sizes.append(done.json["correction_mm"]["max"])
    assert abs(sizes[1] - sizes[0]) > 0.05


@pytest.mark.slow
def test_weights_that_the_controller_carries_are_not_corrected(compensate, job):
    heavy_robot(job.folder)
    job.write(PLATE)
    sizes = []
    for said in ("false", "true"):
        line = f"controller: {{absolute_accuracy: false, gravity_compensated: {said}}}"
        cell_of(
            job, line, "max_growth: 20", "correct: touched_off", f"touch_points: {CORNERS}", "temperature: 20"
        )
        sizes.append(compensate(job.program, "--force", "--json", "-").json["correction_mm"]["rms"])
    assert abs(sizes[1] - sizes[0]) > 0.02


def test_identified_growth_states_its_reference(tmp_path):
    """A file that is written from warm readings states the temperature from which their growth counts."""
    robot = heavy_robot(tmp_path)
    by_temperature, by_time = (
        EffectInstance(ThermalGrowth(robot.joints, word), {}, {}) for word in ("temperature", "time")
    )
    warm, unknown = SimpleNamespace(calibrated_at=21.5), SimpleNamespace(calibrated_at=None)
    assert effect_options(by_temperature, warm) == {"variable": "temperature", "reference": 21.5}
    assert effect_options(by_temperature, unknown) == {"variable": "temperature"}
    assert effect_options(by_time, warm) == {"variable": "time"}
    model = StiffnessModel.from_robot(robot)
    effect = next(term.effect for term in model.terms if isinstance(term.effect, ThermalGrowth))
    assert effect.reference == 20.0
