"""The tools of a program that is learnt from come from where the main job takes them."""

import pytest
from blind_parts.shop import write_shop

from postproc.base.findings import Refusal
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
