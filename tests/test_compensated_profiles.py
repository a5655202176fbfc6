"""Entries, corners and exits inside of motions: the written path, under a force of the test's own geometry and law."""

import shutil
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("numba")

from cutting_plant import KAC, KAE, KRC, KRE, KTC, KTE, moves_of

from postproc.base.geometry import Poses
from postproc.workflows.preparation import Request, prepare
from postproc.workflows.program import compensate

RADIUS, DEPTH, TEETH = 8.0, 4.0, 3
PATH = np.array([[-20.0, 40, -DEPTH], [60, 40, -DEPTH], [60, 62, -DEPTH], [140, 62, -DEPTH]])
PROGRAM = """%
G21 G90 G17 G54
T1 M6
S12000 M3
G0 X-20. Y40. Z30.
G1 Z-4. F6000
G1 X60. F3600
G1 Y62.
G1 X140.
G0 Z30.
M30
%
"""
ANGLES = (np.arange(1440) + 0.5) * np.pi / 1440


def distances(points, start, end):
    """(K,) mm from points (K, 2) to a line from ``start`` to ``end``."""
    step = end - start
    share = np.clip((points - start) @ step / max(step @ step, 1e-12), 0, 1)
    return np.linalg.norm(points - start - share[:, None] * step, axis=1)


def force_at(number, place):
    """(6,) [N, N m] about the tip in the base, of the tool ``place`` mm on in the line ``number`` of PATH."""
    start, end = PATH[number, :2], PATH[number + 1, :2]
    feed = (end - start) / np.linalg.norm(end - start)
    left = np.array([-feed[1], feed[0]])
    sine, cosine = np.sin(ANGLES), np.cos(ANGLES)
    tip = start + place * feed
    rim = tip + RADIUS * (sine[:, None] * feed + cosine[:, None] * left)
    stock = ((rim > 0) & (rim < [120, 80])).all(axis=1)
    for earlier in range(number):
        stock &= distances(rim, PATH[earlier, :2], PATH[earlier + 1, :2]) > RADIUS - 1e-9
    chip = 3600 / (12000 * TEETH)
    share = stock * (ANGLES[1] - ANGLES[0]) * TEETH / (2 * np.pi) * DEPTH
    t, r, a = ((k * chip * sine + e) * share for k, e in ((KTC, KTE), (KRC, KRE), (KAC, KAE)))
    parts = np.stack([-t * cosine - r * sine, t * sine - r * cosine, -a], axis=1)
    arms = np.stack([RADIUS * sine, RADIUS * cosine, np.full(len(sine), 0.5 * DEPTH)], axis=1) * 1e-3
    axes = np.array([[*feed, 0], [*left, 0], [0, 0, 1]])
    return np.concatenate([parts.sum(axis=0) @ axes, np.cross(arms, parts).sum(axis=0) @ axes])


@pytest.fixture(scope="module")
def written(tmp_path_factory, pytestconfig):
    """The task, its report, and the written path (K, 3) in mm from where it is at depth."""
    folder = tmp_path_factory.mktemp("profiles")
    shutil.copytree(pytestconfig.rootpath / "robots", folder / "robots")
    for name in ("cell.yaml", "milling.yaml"):
        (folder / "part").mkdir(exist_ok=True)
        shutil.copy(pytestconfig.rootpath / "samples/kr270_stock" / name, folder / "part")
    program = folder / "part/part.ngc"
    program.write_text(PROGRAM)
    cell = folder / "part/cell.yaml"
    cell.write_text(cell.read_text().replace("max_growth: 4\n", ""))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("postproc.workflows.program.part_error_of", lambda *_: (None, ()))
        report = compensate(Request(program, force=""))
    task = prepare(Request(program, force="")).task
    corners = [
        move.points[-1]
        for move in moves_of((folder / "part/compensated/part.ngc").read_text())
        if not move.rapid
    ]
    return program, task, report, np.array(corners)


def pieces(corners):
    """Number of the line of PATH, start and end of each written motion at depth."""
    first = int(np.argmax(corners[:, 0] > 59))
    second = first + int(np.argmax(np.where(corners[first:, 0] < 60.9, corners[first:, 1], -1)))
    for k, (start, end) in enumerate(pairwise(corners)):
        yield int(k >= first) + int(k >= second), start, end


def tool_on(task, number, point):
    """(3,) mm in the base: the predicted tool at a commanded point, under the force of the place where it is."""
    row = np.flatnonzero(task.toolpath.line == 7 + number)
    base = task.base[row]
    place = base.position[0] + base.rotation[0] @ (np.asarray(point) * 1e-3)
    command = Poses(task.wanted[row].rotation, place[None])
    feed = (PATH[number + 1] - PATH[number]) / np.linalg.norm(PATH[number + 1] - PATH[number])
    along = (point - PATH[number]) @ feed
    for _ in range(8):
        wrench = force_at(number, along)
        turned = np.concatenate([base.rotation[0] @ wrench[:3], base.rotation[0] @ wrench[3:]])
        real = task.simulated(row, command, turned[None], corrected=True).pose.position[0]
        tool = base.rotation[0].T @ (real - base.position[0]) * 1e3
        along = (tool - PATH[number]) @ feed
    off = tool - PATH[number]
    return along, np.linalg.norm(off - along * feed)


@pytest.mark.slow
def test_the_correction_follows_the_force_inside_of_motions(written):
    """At dense places of the written path: within the tolerance, but where the path turns at once."""
    _, task, report, corners = written
    assert report.exit == 0
    off = []
    for number, start, end in pieces(corners):
        for share in np.arange(0.5, np.linalg.norm(end - start)) / np.linalg.norm(end - start):
            point = start + share * (end - start)
            length = np.linalg.norm(PATH[number + 1] - PATH[number])
            along, error = tool_on(task, number, point)
            if (number == 0 or along > 1.5) and (number == 2 or along < length - 1.5):
                off.append((number, along, error))
    number, along, error = np.array(off).T
    # the foremost millimetres of the circle meet the side at once, and mark nothing that remains
    side = ((number == 0) & (np.abs(along - 13) < 2)) | ((number == 2) & (np.abs(along - 52) < 2))
    assert (~side).sum() > 150
    assert np.percentile(error[~side], 95) < 0.02
    assert error[~side].max() < 0.06
    assert error[side].max() < 0.45
    # without a correction that follows the force the tool would be as far off as it is deflected
    assert np.linalg.norm(force_at(0, 60.0)[:3]) > 100
    assert not force_at(0, 5.0).any()


@pytest.mark.slow
def test_no_motion_goes_back_and_few_are_inserted(written):
    _, _, report, corners = written
    for number, start, end in pieces(corners):
        assert (end - start) @ (PATH[number + 1] - PATH[number]) > 0
    assert len(corners) < 45
    assert report.to_dict()["backwards"] == report.to_dict()["stops_added"] == 0


@pytest.mark.slow
def test_stated_forces_have_no_profile(written):
    program, *_ = written
    stated = program.with_name("stated.ngc")
    stated.write_text(PROGRAM.replace("S12000", "(FORCE 0,150,-50)\nS12000"))
    force = prepare(Request(stated, force="")).task.force
    assert force.any
    assert force.stock is None
    assert force.ramps is None or not force.ramps.inside.any()
