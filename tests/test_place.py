"""Where a part should lie: the search against brute force, its figures against the main job and MuJoCo."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.path import Path as Outline
from place_cases import ROOT, Brute, about, program_of, ranges_around
from plant import Plant

import postproc
from postproc.base.findings import Refusal
from postproc.cell.stated_room import polygon_problem
from postproc.placement.force_turns import turned_forces
from postproc.placement.refine_places import refine_place
from postproc.placement.room import FREEDOMS, Room, inside_polygon
from postproc.placement.score_places import score_places
from postproc.placement.search_places import distinct, start_places
from postproc.report.placement import Placement
from postproc.workflows.place import place
from postproc.workflows.place_problem import PlaceRequest, place_problem
from postproc.workflows.place_units import metre_ranges
from postproc.workflows.preparation import Request, prepare

SLOW = pytest.mark.slow
HERE = ("--x", "1400:1600", "--y=-300:-100")


def request(folder: Path, **change) -> PlaceRequest:
    ranges = {"x": (1300.0, 1700.0), "y": (-400.0, 0.0), "turn": (-60.0, 60.0), "tool_turn": (-40.0, 40.0)}
    return PlaceRequest(**{"programs": (folder / "part.src",), "force": "", "ranges": ranges, **change})


class Placed(NamedTuple):
    """A sample with all freedoms, and the folder of the cell with its best place."""

    name: str
    placement: Placement
    folder: Path


def placed_sample(name: str, folder: Path) -> Placed:
    asked = PlaceRequest((program_of(name),), "", ranges_around(name), output=folder / "placed.yaml")
    return Placed(name, place(asked), folder)


@pytest.fixture(scope="module")
def placed(tmp_path_factory):
    """The placement of the milling sample, and where its files are."""
    return placed_sample("milling", tmp_path_factory.mktemp("placed"))[1:]


@pytest.fixture(scope="module", params=["milling", "panel", "pocket"])
def sample(request, tmp_path_factory):
    return placed_sample(request.param, tmp_path_factory.mktemp("sample"))


# the search


@pytest.mark.slow
def test_no_grid_is_better(placed):
    """A grid of 10,584 places, scored by other code."""
    done, _ = placed
    brute = Brute(program_of("milling"))
    best, count = brute.best_of_grid(ranges_around("milling"), (6, 6, 6, 7, 7))
    assert count > 10_000
    assert done.best.across.max < 1.01 * best["across"]
    assert done.reduction > 0.55


@pytest.mark.slow
def test_a_single_freedom_is_searched_whole(job):
    asked = request(job.folder, ranges={"x": (1300.0, 1700.0)}, top=1)
    done = place(asked)
    cell = (job.folder / "cell.yaml").read_text()
    errors = {}
    for x in range(1300, 1701, 50):
        (job.folder / "other.yaml").write_text(cell.replace("x: 1500", f"x: {x}"))
        there = postproc.predict(job.program, force=True, cell=job.folder / "other.yaml")
        errors[x] = there.as_json()["error_before_mm"]["max"]
    assert done.best.error.max * 1e3 <= min(errors.values()) * 1.001
    assert done.present.error.max * 1e3 == pytest.approx(errors[1500], abs=1e-6)


def test_linear_programs_improve_and_stay_feasible(job):
    problem = place_problem(request(job.folder))
    room, scoring = problem.room, problem.scoring

    def score(places):
        return score_places(problem.model, problem.motions, room, scoring, places, detailed=True)

    start = start_places(room)[:40]
    rough = score(start)
    feasible = np.flatnonzero(rough.violation == 0)
    assert len(feasible) >= 5
    for at in feasible[:3]:
        refined = refine_place(room, scoring, score, start[at])
        values = refined.value
        assert (np.diff(values) < 0).all()
        assert values[-1] < 0.98 * rough.value[at]
        assert refined.violation[-1] == 0


@pytest.mark.slow
def test_places_that_are_listed_are_apart(placed):
    done, _ = placed
    shares = done.room.shares(np.array([one.place for one in done.places]))
    away = np.abs(shares[:, None] - shares[None]).max(axis=2) + np.eye(len(shares))
    assert len(done.places) >= 5
    assert away.min() > 0.05
    scores = [one.score for one in done.places]
    assert scores == sorted(scores)


@pytest.mark.slow
def test_the_same_input_gives_the_same_places(job):
    asked = request(job.folder, top=3)
    one, other = (place(asked).to_dict() for _ in range(2))
    assert one == other


# its figures


@pytest.mark.slow
def test_the_score_is_the_error_that_is_predicted(job):
    """The linear model of the search and the main job on the moved cell."""
    done = place(request(job.folder, top=4))
    for one in done.places:
        assert one.score == pytest.approx(one.across.max, rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["max", "p95"])
def test_the_objective_is_what_is_small(job, objective):
    asked = request(job.folder, top=1)
    across, other = place(asked).best, place(replace(asked, objective=objective)).best
    assert other.figure(objective) <= across.figure(objective) * 1.002


@pytest.mark.slow
def test_the_written_cell_gives_what_is_promised(sample, compensate):
    name, done, folder = sample
    out = compensate(
        program_of(name), "--force", "--cell", folder / "placed.yaml", "--dry-run", "--json", "-"
    ).json
    assert out["error_before_mm"]["max"] == pytest.approx(done.best.error.max * 1e3, abs=1e-6)
    assert out["across_feed_mm"]["before"]["max"] == pytest.approx(done.best.across.max * 1e3, abs=1e-6)
    assert out["error_before_mm"]["rms"] == pytest.approx(done.best.error.rms * 1e3, abs=1e-6)


def wanted_by_text(program: Path, cell: Path):
    """Targets of the LIN motions (rotation, position [m]) in the robot base, from program text and cell file alone."""
    stated = yaml.safe_load(cell.read_text())
    frame = stated["bases"][1]
    base = turn_of(frame["a"], frame["b"], frame["c"])
    origin = np.array([frame[key] for key in "xyz"], float)
    words = dict.fromkeys("XYZABC", np.nan)
    words |= {key.upper(): float(value) for key, value in stated.get("orientation", {}).items()}
    found = {}
    for number, line in enumerate(program.read_text(encoding="latin-1").splitlines(), 1):
        if not line.startswith(("LIN {", "CIRC {", "G1 ", "G2 ", "G3 ", "G0 ")):
            continue
        target = line.rpartition("{")[2]
        words |= {key: float(value) for key, value in re.findall(r"([XYZABC]) ?([-\d.]+)", target)}
        if line.startswith("G0 "):
            continue
        if np.isfinite(list(words.values())).all():
            point = np.array([words[key] for key in "XYZ"])
            found[number] = base @ turn_of(*(words[key] for key in "ABC")), (origin + base @ point) / 1e3
    return found


def turn_of(a, b, c):
    z, y, x = np.eye(3)[[2, 1, 0]]
    return about(z, np.radians(a)) @ about(y, np.radians(b)) @ about(x, np.radians(c))


def at_best(sample: Placed):
    """The program as it is prepared with the written cell, and the arm in MuJoCo."""
    ready = prepare(Request(program_of(sample.name), force="", cell=sample.folder / "placed.yaml"))
    return ready, Plant.of(ready.task.model, links=())


@pytest.mark.slow
def test_every_motion_is_feasible_by_an_independent_kinematics(sample):
    """MuJoCo's forward kinematics of the axis angles brings the tool to the target that the text states."""
    name, done, folder = sample
    ready, plant = at_best(sample)
    task, cell = ready.task, yaml.safe_load((folder / "placed.yaml").read_text())
    spindle = cell["tools"][1]
    tool_turn = turn_of(spindle["a"], spindle["b"], spindle["c"])
    tool_place = np.array([spindle[key] for key in "xyz"]) / 1e3
    targets = wanted_by_text(program_of(name), folder / "placed.yaml")
    limits = np.array([[-185, 185], [-146, 0], [-119, 155], [-350, 350], [-125, 125], [-350, 350]])
    rows = [row for row in range(len(task.toolpath)) if int(task.toolpath.line[row]) in targets]
    assert len(rows) >= {"milling": 12, "panel": 2725, "pocket": 156}[name]
    flange_in_link = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    for row in rows:
        q = task.track.q[row]
        plant.place(plant.coordinates_of(q), plant.coordinates_of(q))
        rotation, position = targets[int(task.toolpath.line[row])]
        link = plant.data.xmat[plant.last_body].reshape(3, 3)
        flange = plant.data.xpos[plant.last_body] + link @ [plant.d6, 0, 0]
        tcp = flange + link @ flange_in_link @ tool_place
        assert np.abs(tcp - position).max() < 1e-8
        assert np.abs(link @ flange_in_link @ tool_turn - rotation).max() < 1e-7
        angles = np.degrees(q)
        assert np.minimum(angles - limits[:, 0], limits[:, 1] - angles).min() >= 5.0
        assert abs(angles[4]) >= 5.0
    assert done.best.limit_deg >= 5.0
    assert done.best.singular_deg >= 5.0


@pytest.mark.slow
def test_mujoco_sees_the_same_reduction(sample):
    name, done, _ = sample
    ready, _ = at_best(sample)
    now = prepare(Request(program_of(name), force=""))
    seen = []
    for one in (now, ready):
        task, plant = one.task, Plant.of(one.task.model, links=())
        rows = np.flatnonzero(task.carries)
        moved = []
        for row in rows:
            q, tool = task.track.q[row], task.tool[row]
            loaded, free = (
                plant.rest(q, wrench, tool).position for wrench in (task.wrench[row], np.zeros(6))
            )
            moved.append(loaded - free)
        tangent = task.desired_path.tangent(rows, np.ones(len(rows)))
        across = moved - np.sum(moved * tangent, axis=1, keepdims=True) * tangent
        seen.append(np.linalg.norm(across, axis=1).max())
    assert seen[0] == pytest.approx(done.present.across.max, rel=1e-4)
    assert seen[1] == pytest.approx(done.best.across.max, rel=1e-4)


@pytest.mark.slow
def test_forces_in_world_axes_do_not_turn_with_the_part(job):
    """One force in world axes, and the same one in the base: the part is turned, and only one of them goes along."""
    for frame, turns in (("world", True), ("base", False)):
        problem = place_problem(request(job.folder, force=f"-360,50,560@{frame}"))
        motions = problem.motions
        assert (motions.world[motions.scored] == turns).all()
        done = place(request(job.folder, force=f"-360,50,560@{frame}", top=2))
        for one in done.places:
            assert one.score == pytest.approx(one.across.max, rel=5e-3)


@pytest.mark.slow
def test_regret_and_averaging(job):
    plain = place(request(job.folder, top=2))
    wide = place(request(job.folder, top=2, direction=20.0))
    assert plain.direction == 0.0
    assert wide.direction == 20.0
    assert all(one.regret >= 0 for one in (*plain.places, *wide.places))
    assert wide.best.score >= plain.best.score * 0.999


def test_turned_forces_keep_their_size_and_angle():
    force = np.array([[100.0, 20.0, -30.0], [0.0, 0.0, 50.0], [0.0, 0.0, 0.0]])
    turned = turned_forces(force, np.radians(20.0), 8)
    assert turned.shape == (8, 3, 3)
    size = np.linalg.norm(force[:2], axis=1)
    assert np.allclose(np.linalg.norm(turned[:, :2], axis=2), size)
    assert np.allclose(np.sum(turned[:, :2] * force[:2], axis=2), size**2 * np.cos(np.radians(20.0)))
    assert np.allclose(turned.sum(axis=0)[:2], 8 * np.cos(np.radians(20.0)) * force[:2])
    assert not turned[:, 2].any()


# the room


@given(
    st.lists(st.tuples(st.floats(0, 10), st.floats(0, 10)), min_size=3, max_size=8),
    st.lists(st.tuples(st.floats(-1, 11), st.floats(-1, 11)), min_size=1, max_size=20),
)
def test_inside_of_a_polygon(corners, points):
    corners, points = np.array(corners), np.array(points)
    if polygon_problem(corners):
        return
    expected = Outline(corners).contains_points(points)
    grown, shrunk = (Outline(corners).contains_points(points, radius=radius) for radius in (1e-6, -1e-6))
    clear = grown == shrunk
    assert (inside_polygon(points, corners) == expected)[clear].all()


@pytest.mark.parametrize(
    ("corners", "words"),
    [
        ([[0, 0], [1, 1]], "2 corners"),
        ([[0, 0], [1, 1], [2, 2]], "touches itself"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "crosses itself"),
        ([[0, 0], [0, 0], [1, 0], [0, 1]], "same place"),
        ([[0, 0], [4, 0], [4, 4], [2, -1], [0, 4]], "crosses itself"),
        ([[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]], ""),
        ([[0, 0], [4, 0], [4, 4], [2, 0], [0, 4]], "itself"),
    ],
)
def test_what_is_no_polygon(corners, words):
    problem = polygon_problem(np.array(corners, float))
    assert words in problem
    assert bool(words) == bool(problem)


@pytest.mark.slow
def test_the_room_of_the_cell(job):
    job.cell(
        (job.folder / "cell.yaml").read_text()
        + "room: {x: [1300, 1700], turn: [-30, 30], polygon: [[1300, -400], [1700, -400], [1300, 0]]}\n"
    )
    done = place(request(job.folder, ranges={}))
    corners = np.array([[1.3, -0.4], [1.7, -0.4], [1.3, 0.0]])
    assert {FREEDOMS[i] for i in done.room.free} == {"x", "y", "turn"}
    for one in done.places:
        assert Outline(corners).contains_points([one.place[:2]], radius=1e-9) or not done.room.outside(
            one.place[None]
        )
    assert done.best.across.max < done.present.across.max


def test_rounded_places_stay_in_the_room():
    lower = np.array([0.10004, 0, 0, 0, 0, 0])
    room = Room(lower, lower + np.array([0.3, 0, 0, 0.2, 0, 0]), lower)
    places = room.places(np.random.default_rng(0).random((50, 2)))
    rounded = room.rounded(places)
    assert (rounded >= room.lower).all()
    assert (rounded <= room.upper).all()
    assert np.abs(rounded - places).max() <= 1.001e-4
    assert (distinct(room, rounded, 5) < 50).all()


# the cell file


@pytest.mark.slow
def test_comments_and_all_else_stay(placed):
    _, folder = placed
    old = (ROOT / "samples" / "kr270_milling" / "cell.yaml").read_text().splitlines()
    new = (folder / "placed.yaml").read_text().splitlines()
    assert len(old) == len(new)
    changed = [k for k, (one, other) in enumerate(zip(old, new, strict=True)) if one != other]
    assert [old[k].strip()[:8] for k in changed] == ["1: {x: 3", "1: {x: 1", "process:"]
    for k in changed:
        assert old[k].partition("#")[2] == new[k].partition("#")[2]


@pytest.mark.slow
def test_a_cell_in_another_folder_names_its_files(placed):
    _, folder = placed
    named = yaml.safe_load((folder / "placed.yaml").read_text())["process"]
    assert (folder / named).resolve() == ROOT / "samples" / "kr270_milling" / "milling.yaml"


@pytest.mark.slow
def test_several_programs_share_the_part(job):
    text = job.program.read_text(encoding="latin-1")
    (job.folder / "other.src").write_text(
        text.replace("DEF part", "DEF other").replace("-360 50 560", "360 50 560")
    )
    programs = (job.folder / "part.src", job.folder / "other.src")
    both = place(request(job.folder, programs=programs, top=2))
    alone = [place(request(job.folder, programs=(one,), top=1)) for one in programs]
    assert both.motions == sum(one.motions for one in alone)
    assert both.present.error.max == pytest.approx(max(one.present.error.max for one in alone))
    assert both.best.score >= max(one.best.score for one in alone) * 0.999


@pytest.mark.slow
def test_from_python(job):
    done = postproc.place(job.program, force=True, x=(1300, 1700), y=(-400, 0), top=3)
    assert isinstance(done, postproc.Placement)
    assert len(done.table()["x_mm"]) == len(done.places)
    assert "part" in repr(done) or "across" in repr(done)
    with pytest.raises(ValueError, match="turn is"):
        postproc.place(job.program, force=True, turn=(5, 5))


@pytest.mark.slow
def test_nothing_is_read_but_written_where_asked(job, compensate):
    words = ["place", job.program, "--force", *HERE, "-o", job.folder / "new" / "cell.yaml"]
    done = compensate(
        *words, "--page", job.folder / "p.html", "--picture", job.folder / "p.png", "--json", "-"
    )
    assert done.code == 0, done.err
    assert done.json["outputs"] == [str(job.folder / name) for name in ("new/cell.yaml", "p.png", "p.html")]
    page = (job.folder / "p.html").read_text()
    assert "collisions are NOT checked" in page
    assert page.count("data:image/svg+xml") == 1
    assert (job.folder / "p.png").read_bytes()[:4] == b"\x89PNG"
    shown = compensate("place", job.program, "--force", *HERE).out.splitlines()
    assert "collisions are NOT checked" in shown[0]


@pytest.mark.slow
def test_one_value_is_where_the_part_lies(job, compensate):
    """As a range that is hardly wider says."""
    words = ["place", job.program, "--force", "--x", "1400:1600", "--json", "-"]
    one = compensate(*words, "--y=-250").json
    narrow = compensate(*words, "--y=-250.001:-249.999").json
    assert one["room"]["y_mm"] == [-250.0, -250.0]
    assert {place["y_mm"] for place in one["places"]} == {-250.0}
    assert one["best"]["x_mm"] == pytest.approx(narrow["best"]["x_mm"], abs=2.0)
    assert one["best"]["across_feed_mm"]["max"] == pytest.approx(
        narrow["best"]["across_feed_mm"]["max"], rel=0.01
    )
    shown = compensate("place", job.program, "--force", "--x", "1400:1600", "--y=-250").out
    assert "x 1400 .. 1600 mm, y -250 mm" in shown


def test_metres_are_reported_of_feasible_places_too():
    assert [one.code for one in metre_ranges({"x": (0.01, 0.15)}, "cell.yaml")] == ["PLC022"]
    assert "--y 950" in metre_ranges({"y": (0.95, 0.95)}, "cell.yaml")[0].help
    assert metre_ranges({"x": (0.01, 10.0)}, "cell.yaml") == []
    assert metre_ranges({"turn": (0.01, 0.15)}, "cell.yaml") == []


LIMIT = ["PLC002", "deg from its limit of", "margin 80"]
SINGULAR = ["PLC002", "singularity", "margin 55"]


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ([], 1, ["PLC003", "no freedom has a range", "--x a:b"]),
        (["--x", "1500:1600:1700"], 2, ["neither one value nor a range a:b"]),
        (["--x", "1500:1500"], 2, ["no width", "for one value write 1500"]),
        (["--x", "1400"], 1, ["PLC003", "no freedom has a range"]),
        (["--x", "1400", "--spin"], 1, ["PLC003", "no freedom has a range"]),
        (["--turn=30:-30"], 2, ["no width", "not below", "write -30:30"]),
        (["--turn=-400:30"], 2, ["-400 exceeds 360"]),
        (["--x", "a:b"], 2, ["'a' is not a number"]),
        (["--x", "1400,5:1600,5"], 2, ["'1400,5' has a decimal comma; write 1400.5"]),
        (["--track", "0:100"], 1, ["PLC003", "linear track"]),
        (["--x", "1.2:1.8", "--y", "-0.5:0.5"], 1, ["PLC002", "for metres write --x 1200:1800"]),
        (
            ["--x", "9000:9500"],
            1,
            ["PLC002", "part.src:", "out of reach by", "present one, x 1500, is outside"],
        ),
        (["--x=-100:100"], 1, ["PLC002", "relative to it, write --x 1400:1600"]),
        pytest.param(["--x", "2200:2300", "--y=900:950"], 1, ["PLC002", "part.src:", "none of"], marks=SLOW),
        pytest.param(
            ["--x", "1400:1600", "--limit-margin", "80"],
            1,
            LIMIT,
            marks=SLOW,
        ),
        pytest.param(
            ["--x", "1400:1600", "--singularity-margin", "55"],
            1,
            SINGULAR,
            marks=SLOW,
        ),
        pytest.param(["--x", "1400:1600", "-o", "cell.yaml"], 1, ["FIL007"], marks=SLOW),
        (["--x", "1400:1600", "-o", "cell.txt"], 2, ["must end in .yaml"]),
        (["--x", "1400:1600", "--objective", "mean"], 2, ["mean"]),
    ],
    ids=str,
)
def test_mistakes(job, compensate, monkeypatch, words, code, said):
    monkeypatch.chdir(job.folder)
    before = {path: path.read_bytes() for path in job.folder.iterdir()}
    done = compensate("place", "part.src", "--force", *words)
    text = " ".join((done.err + done.out).split())
    assert done.code == code, text
    assert [word for word in said if word not in text] == [], text
    assert {path: path.read_bytes() for path in job.folder.iterdir()} == before


@pytest.mark.parametrize(
    ("room", "said"),
    [
        ("{x: [1600, 1400]}", ["YML004", "no width", "room.x"]),
        ("{x: [1400]}", ["YML004", "list of 2 numbers"]),
        ("{polygon: [[0, 0], [900, 900], [900, 0], [0, 900]]}", ["crosses itself"]),
        ("{polygon: [[0, 0], [900, 0]]}", ["2 corners"]),
        ("{w: [1, 2]}", ["YML002", "room.w"]),
        ("{turn: [-400, 10]}", ["YML004", "room.turn", "whole turn"]),
        ("{}", ["states nothing"]),
    ],
)
def test_rooms_that_are_none(job, compensate, room, said):
    with (job.folder / "cell.yaml").open("a") as stream:
        stream.write(f"room: {room}\n")
    done = compensate("place", job.program, "--force")
    text = " ".join((done.err + done.out).split())
    assert done.code == 1, text
    assert [word for word in said if word not in text] == [], text


def test_a_program_that_states_its_own_base(job):
    text = job.program.read_text(encoding="latin-1")
    job.program.write_text(
        text.replace("$BASE=BASE_DATA[1]", "$BASE={X 1500,Y -200,Z 600,A 0,B 0,C 0}"), encoding="latin-1"
    )
    with pytest.raises(Refusal) as refusal:
        place(request(job.folder))
    assert refusal.value.findings[0].code == "PLC003"


def test_without_force_nothing_is_placed(job, compensate):
    done = compensate("place", job.program, *HERE)
    assert done.code == 1
    assert "FRC030" in done.err
    with pytest.raises(Refusal) as refusal:
        place(request(job.folder, force="0,0,0"))
    assert refusal.value.findings[0].code == "PLC005"


def test_a_robot_without_compliance_is_not_placed(job):
    shutil.copy(ROOT / "robots" / "abb_irb6700.yaml", job.folder / "stiff.yaml")
    with pytest.raises(Refusal) as refusal:
        place(request(job.folder, robot=str(job.folder / "stiff.yaml")))
    (finding,) = refusal.value.findings
    assert finding.code == "PLC005"
    assert "has no compliance" in finding.message
    assert finding.file == str(job.folder / "stiff.yaml")


RAIL = "  rail: +y\n  kuka: {unit: mm, d1"


def rail_robot(folder: Path) -> None:
    """The KR 270 on a linear axis E1 of its own."""
    text = (ROOT / "robots" / "kuka_kr270.yaml").read_text().replace("  kuka: {unit: mm, d1", RAIL)
    text = text.replace(
        "  A1: [-185", "  E1: {kind: prismatic, limits: [-1500, 1500], unit: mm}\n  A1: [-185"
    )
    for joint in range(6, 0, -1):
        text = text.replace(f"      c{joint}:", f"      c{joint + 1}:")
    (folder / "rail.yaml").write_text(text)


@pytest.mark.slow
@pytest.mark.parametrize("own_joint", [False, True], ids=["track of the cell", "joint of the robot"])
def test_a_track_is_a_freedom(job, own_joint):
    """The score is what the main job predicts with the track there; the cell file says where it is."""
    cell = (job.folder / "cell.yaml").read_text()
    if own_joint:
        rail_robot(job.folder)
        cell = cell.replace("kuka_kr270", "rail.yaml").replace("[0, -90", "[200, 0, -90")
    else:
        cell += "robot_base: {x: 100, y: 0, z: 50, a: 30, b: 5, c: 0}\n"
        cell += "external_axes:\n  E1: {kind: track, direction: +y, limits: [-1500, 1500], start: 200}\n"
    job.cell(cell)
    ranges = {"track": (-1400.0, 1400.0), "turn": (-30.0, 30.0), "tool_turn": (-50.0, 50.0)}
    done = place(request(job.folder, ranges=ranges, top=2, output=job.folder / "new.yaml"))
    for one in done.places:
        assert one.score == pytest.approx(one.across.max, rel=5e-3)
    assert done.best.across.max < 0.9 * done.present.across.max
    new = yaml.safe_load((job.folder / "new.yaml").read_text())
    there = new["start"][0] if own_joint else new["external_axes"]["E1"]["start"]
    assert there == pytest.approx(done.best.place[5] * 1e3, abs=1e-6)
    assert abs(there - 200) > 10


def test_a_track_that_the_program_moves_is_no_freedom(job):
    job.cell(
        (job.folder / "cell.yaml").read_text()
        + "external_axes:\n  E1: {kind: track, direction: +y, limits: [-1500, 1500]}\n"
    )
    text = job.program.read_text(encoding="latin-1")
    job.program.write_text(text.replace("A6 0}", "A6 0,E1 0}"), encoding="latin-1")
    with pytest.raises(Refusal) as refusal:
        place(request(job.folder, ranges={"track": (0.0, 100.0)}))
    assert refusal.value.findings[0].code == "PLC003"
    assert "E1" in refusal.value.findings[0].message


@pytest.mark.slow
def test_a_program_that_does_not_fit_where_it_is(job):
    """Out of reach now, and placed all the same; what the present place would cut is not known."""
    job.cell((job.folder / "cell.yaml").read_text().replace("x: 1500", "x: 2600"))
    done = place(request(job.folder, top=1))
    assert np.isnan(done.reduction)
    assert done.best.across.max > 0
    (lost,) = (one for one in done.findings if one.code == "PLC006" and "no figures" in one.message)
    assert "out of reach" in lost.message
    assert done.to_dict()["reduction"] is None
    assert all(np.isnan(one.ratio) for one in done.alone)


@pytest.mark.slow
def test_a_bound_for_a_tool_that_turns_along_the_path(job):
    """No constant turn of the tool is below it, wherever it is feasible."""
    done = place(request(job.folder, top=1))
    assert done.spin <= done.best.score * (1 + 1e-9)
    still = place(request(job.folder, top=1, ranges={"x": (1300.0, 1700.0)}))
    assert np.isnan(still.spin)
