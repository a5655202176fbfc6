"""The tools of a program that is learnt from come from where the main job takes them."""

from types import SimpleNamespace

import numpy as np
import pytest
from blind_parts.shop import write_shop

from postproc.base.findings import Refusal
from postproc.base.geometry import Poses
from postproc.learning.surface_displacement import SurfaceDisplacement
from postproc.workflows.learn_points import read_job
from postproc.workflows.preparation import Request

BALL = ";T1  D=16. CR=8. - ZMIN=-12. - ball end mill"
STOCK = "stock: {box: [[0, 0, -30], [500, 400, 0]]}\n"
STOCK += "defaults: {teeth: 3, helix: 30, spindle: 12000, material: EN AW-7075-T6}\n"


def shop(folder, *comments: str, diameter: str = "", process: str = ""):
    program = write_shop(folder / "shop", pockets="A")
    lines = program.read_text().splitlines()
    program.write_text("\n".join([lines[0], *comments, *lines[1:], ""]))
    cell = program.parent / "cell.yaml"
    text = cell.read_text().replace(" diameter: 16,", diameter)
    if process:
        (program.parent / "milling.yaml").write_text(process)
        text += "process: milling.yaml\n"
    cell.write_text(text)
    return program


def cutters(program):
    return read_job(Request(program, force="")).motions.cutters


def test_a_comment_of_the_program_states_the_tool(tmp_path):
    (one,) = cutters(shop(tmp_path, BALL))
    assert (one.number, one.shape, one.radius, one.corner) == (1, "ball", 0.008, 0.008)


def test_a_diameter_of_the_cell_that_contradicts_the_comment_counts(tmp_path):
    (one,) = cutters(shop(tmp_path, BALL, diameter=" diameter: 12,"))
    assert (one.shape, one.radius) == ("flat", 0.006)


def test_a_process_file_takes_its_tools_from_comments(tmp_path):
    """As the main job does, which accepts a file with a stock and no tools."""
    (one,) = cutters(shop(tmp_path, BALL, process=STOCK))
    assert (one.number, one.shape, one.radius) == (1, "ball", 0.008)


def test_without_any_tool_nothing_is_learnt(tmp_path):
    with pytest.raises(Refusal) as caught:
        cutters(shop(tmp_path))
    assert caught.value.findings[0].code == "LRN011"


def test_a_ball_with_its_tip_in_place_moves_the_surface_by_its_lean():
    """A path along x over surfaces that lean more and more: where the ball is 0.02 mm larger, the larger one about the
    centre that lies higher by as much touches planes of these normals by so much deeper."""
    count, radius, more = 31, 8e-3, 2e-5
    lean = np.linspace(0.0, np.pi / 2, count)
    normal = np.column_stack([0 * lean, np.sin(lean), np.cos(lean)])
    tip = np.column_stack([np.linspace(0, 0.6, count), 0 * lean, 0 * lean])
    spindle = np.tile([0.0, 0.0, -1.0], (count, 1))

    def depth(size: float) -> np.ndarray:
        """How far a ball of this radius reaches against the normals."""
        return size - np.sum((tip - size * spindle) * normal, axis=1)

    contact = tip - radius * spindle - radius * normal
    points = SimpleNamespace(
        row=np.arange(count), normal=normal, spindle=spindle, point=contact, to_contact=contact - tip
    )
    zero = np.zeros(2 * count, int)
    ball = SurfaceDisplacement(
        {1: more}, (1,), zero + 1, np.repeat([0, 1], count), np.ones(2 * count, bool), points
    )
    poses = Poses(np.tile(np.eye(3), (count, 1, 1)), tip)
    moved = ball.at(np.arange(count), poses)
    deeper = depth(radius + more) - depth(radius)
    assert np.ptp(deeper) > 0.9 * more
    np.testing.assert_allclose(np.sum(moved * normal, axis=1), -deeper, atol=0.1 * more)
    assert not ball.at(np.arange(count, 2 * count), poses).any(), "nothing was measured of this operation"
