"""Collisions of the arm with itself and with a table: against MuJoCo's contacts, and what places they exclude."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from collision_cases import LENGTHS, urdf_of

from postproc.base.findings import Finding, Refusal
from postproc.placement import collisions
from postproc.placement.collisions import between_postures, read_collision_shapes
from postproc.robot.description import find_robot, load_robot
from postproc.workflows.place import place
from postproc.workflows.place_collisions import collision_of
from postproc.workflows.place_problem import PlaceRequest, place_problem, prepared_at

HOME = np.radians([0, -90, 90, 0, 90, 0])
TABLE = "1.6 0 0.35"
RANGES = {"x": (1300.0, 1700.0), "z": (300.0, 700.0)}


@pytest.fixture(scope="module")
def robot():
    return load_robot(find_robot("kuka_kr270", None))


def shapes_of(folder, robot, text, start=HOME):
    path = folder / "arm.urdf"
    path.write_text(text)
    return read_collision_shapes(path, robot, start)


def test_overlaps_are_mujocos_contacts(tmp_path, robot):
    """Of links that are not side by side; MuJoCo reads the same URDF, and places and intersects by its own means."""
    text = urdf_of(LENGTHS, TABLE)
    shapes = shapes_of(tmp_path, robot, text)
    options = '<mujoco><compiler fusestatic="false" discardvisual="false"/></mujoco>'
    model = mujoco.MjModel.from_xml_string(text.replace("</robot>", f"{options}</robot>"))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    low, high = robot.limits.T
    q = rng.uniform(low, high, (300, 6))
    own = shapes.colliding(q)
    names = [model.body(k).name for k in range(model.nbody)]
    checked = {frozenset((f"l{k}", f"l{j}")) for k in range(7) for j in range(k + 2, 7)}
    checked |= {frozenset((f"l{k}", "table")) for k in range(1, 7)}
    seen = []
    for one in q:
        data.qpos[:] = one
        mujoco.mj_forward(model, data)
        pairs = [[names[model.geom_bodyid[geom]] for geom in data.contact[k].geom] for k in range(data.ncon)]
        seen.append(any(frozenset("l0" if n == "world" else n for n in pair) in checked for pair in pairs))
    assert 30 < sum(seen) < 270
    assert (own == seen).mean() > 0.99


@pytest.mark.slow
def test_a_place_that_collides_is_not_listed(job):
    """A table in the way of the wrist at the best place: another place is proposed, whose motions are clear of it."""
    asked = {"ranges": {"x": (1300.0, 1700.0)}, "top": 3}
    free = place(PlaceRequest((job.program,), "", **asked))
    assert free.shapes is None
    assert [one.code for one in free.findings].count("PLC001") == 1
    problem = place_problem(PlaceRequest((job.program,), "", **asked))
    task = prepared_at(problem.moved, free.best.place, problem.request)[0].task
    row = np.flatnonzero(task.carries)[-1]
    wrist = (task.wanted[[row]] @ task.tool[[row]].inverse()).position[0]
    side = np.sign(free.best.place[0] - 1.5)
    at = f"{wrist[0] + side * 0.1:.4f} {wrist[1]:.4f} {wrist[2]:.4f}"
    urdf = job.folder / "arm.urdf"
    urdf.write_text(urdf_of(LENGTHS, at, wide=0.1))
    with_shapes = PlaceRequest((job.program,), "", collisions=urdf, **asked)
    checked, checked_problem = place(with_shapes), place_problem(with_shapes)
    assert checked.shapes.fixed == ("l0", "table")
    assert "PLC001" not in [one.code for one in checked.findings]
    assert checked.best.score > free.best.score
    shapes = checked_problem.shapes
    for at, collides in ((free.best.place, True), (checked.best.place, False)):
        (ready,) = prepared_at(problem.moved, at, problem.request)
        found = collision_of(shapes, ready)
        assert (found is not None) == collides
        assert found is None or "collides with" in found.message
    everywhere = job.folder / "everywhere.urdf"
    everywhere.write_text(urdf_of(LENGTHS, f"{wrist[0]:.4f} {wrist[1]:.4f} {wrist[2]:.4f}", wide=1.5))
    with pytest.raises(Refusal) as refusal:
        place(replace(with_shapes, collisions=everywhere))
    assert refusal.value.findings[0].code == "PLC002"
    assert "collides with table in this motion" in refusal.value.findings[0].message
    assert checked.to_dict()["collisions_checked"] is True


@pytest.mark.slow
def test_the_first_line_says_what_is_checked(job, compensate):
    urdf = job.folder / "arm.urdf"
    urdf.write_text(urdf_of(LENGTHS, TABLE))
    words = ["place", job.program, "--force", "--x", "1450:1550", "--top", "1"]
    first = compensate(*words, "--collisions", urdf).out.splitlines()[0]
    assert "collisions of the arm with itself and with l0, table" in first
    assert "collisions with part and fixtures are NOT checked" in first
    assert "collisions are NOT checked" in compensate(*words).out.splitlines()[0]


def test_what_touches_before_the_program_is_left_out(tmp_path, robot):
    """A table through the upper arm at home: told, and not checked; all other pairs are."""
    low = shapes_of(tmp_path, robot, urdf_of(LENGTHS, "0.3 0 1.5"))
    assert ("table", "l2") in low.ignored or ("l2", "table") in low.ignored
    assert not low.colliding(HOME[None])[0]
    assert shapes_of(tmp_path, robot, urdf_of(LENGTHS, "0.3 0 1.5"), None).colliding(HOME[None])[0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (urdf_of(LENGTHS, shapes=False), "has no collision shapes"),
        (urdf_of(LENGTHS, a2=1.2), "do not bring the flange"),
        (urdf_of(LENGTHS).replace('type="revolute"', 'type="fixed"', 1), "not one chain of 6 joints"),
        ("<robot", "cannot be read"),
        (
            urdf_of(LENGTHS).replace('<box size="0.5 0.5 0.3"/>', '<mesh filename="none.stl"/>'),
            "cannot be read",
        ),
    ],
    ids=["no shapes", "another arm", "a joint less", "no XML", "no mesh"],
)
def test_shapes_that_cannot_be_used(tmp_path, robot, text, said):
    found = shapes_of(tmp_path, robot, text)
    assert isinstance(found, Finding)
    assert found.code == "PLC018"
    assert said in found.message


def test_shapes_that_were_asked_for_are_not_passed_over(job):
    urdf = job.folder / "arm.urdf"
    urdf.write_text(urdf_of(LENGTHS, a2=1.2))
    with pytest.raises(Refusal) as refusal:
        place(PlaceRequest((job.program,), "", RANGES, collisions=urdf))
    assert refusal.value.findings[0].code == "PLC020"


def test_without_coal(tmp_path, robot, monkeypatch):
    monkeypatch.setattr(collisions, "find_spec", lambda name: None if name == "coal" else object())
    found = shapes_of(tmp_path, robot, urdf_of(LENGTHS))
    assert isinstance(found, Finding)
    assert "not installed with coal" in found.message


def test_between_two_postures():
    before, after = np.zeros((2, 3)), np.array([[0.1, -1.0, 0.0], [0.0, 0.0, 0.0]])
    inner, motion = between_postures(before, after, 0.25)
    assert motion.tolist() == [0, 0, 0]
    assert np.allclose(inner, [[0.025, -0.25, 0], [0.05, -0.5, 0], [0.075, -0.75, 0]])
