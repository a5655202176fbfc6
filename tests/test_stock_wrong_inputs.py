"""Wrong blanks, tools and laws of a cut, through the main job: refused with nothing written, or reported by name."""

import json
import struct

import numpy as np
import pytest

pytest.importorskip("numba")

from click.testing import CliRunner
from test_engage_command import SLOT, STOCK, folder, state
from test_engage_units import tool

from postproc.cli.main import main

__all__ = ["folder"]
MESH = "stock: {stl: blank.stl}\n"
WHOLE = ([0, 0, -30], [100, 60, 0])


def mesh(scale=1.0, missing=0, inward=False):
    """A binary STL of the blank."""
    low, high = (np.array(corner, float) * scale for corner in WHOLE)
    corners = np.array([[(low, high)[k >> axis & 1][axis] for axis in (2, 1, 0)][::-1] for k in range(8)])
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))][missing:]
    if inward:
        triangles = [(a, c, b) for a, b, c in triangles]
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[list(t)].ravel(), 0) for t in triangles)
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + body


def job(folder):
    """Exit code, findings and what the main job wrote."""
    before = set(folder.rglob("*"))
    result = CliRunner().invoke(main, ["program", str(folder / "part.ngc"), "--force=", "--json", "-"])
    written = [one for one in folder.rglob("*") if one not in before]
    return result.exit_code, json.loads(result.stdout)["findings"], written


def test_a_whole_mesh_is_taken(folder):
    (folder / "blank.stl").write_bytes(mesh())
    state(folder, MESH + tool())
    code, findings, written = job(folder)
    assert written
    assert code in (0, 3)
    assert {one["code"] for one in findings} >= {"STK014"}


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (mesh(missing=1), "STK003"),
        (mesh(inward=True), "STK004"),
        (mesh(scale=1e-3), "STK005"),
        (mesh(scale=1e3), "STK005"),
        (mesh(scale=1 / 25.4), "STK008"),
        (mesh(scale=0.1), "STK008"),
        (mesh()[:-20], "STK002"),
        (b"", "STK002"),
        (None, "FIL001"),
    ],
    ids=["open", "inward", "metres", "micrometres", "inches", "centimetres", "cut short", "empty", "missing"],
)
def test_a_wrong_mesh_writes_nothing(folder, data, code):
    if data is not None:
        (folder / "blank.stl").write_bytes(data)
    state(folder, MESH + tool())
    exit, findings, written = job(folder)
    assert (exit, written) == (1, [])
    assert [one["code"] for one in findings if one["severity"] == "error"] == [code]


@pytest.mark.parametrize(
    ("process", "code"),
    [
        ("stock: {box: [[0, 0, -0.03], [0.1, 0.06, 0]]}\n" + tool(), "STK008"),
        ("stock: {box: [[1000, 0, -30], [1100, 60, 0]]}\n" + tool(), "STK008"),
        ("stock: {box: [[0, 0, -36], [100, 60, -6]]}\n" + tool(), "STK008"),
        ("stock: {box: [[0, 0, 0], [100, 60, 0]]}\n" + tool(), "YML004"),
        (STOCK + tool().replace("  1:", "  7:"), "STK006"),
        (STOCK + tool(teeth=0), "YML004"),
        (STOCK + tool(spindle=0), "YML004"),
        (STOCK + tool(spindle=200), "COR002"),  # chips of 3 mm bend the arm by 158 mm
        (STOCK + tool(diameter=-16), "YML004"),
        (STOCK + tool(diameter=0.016), "YML004"),
        (STOCK + tool(holder="{diameter: 63, from: 20}"), "YML004"),
        (STOCK + tool().replace("teeth: 3, ", ""), "STK009"),
    ],
)
def test_a_wrong_blank_or_tool_writes_nothing(folder, process, code):
    state(folder, process)
    exit, findings, written = job(folder)
    assert (exit, written) == (1, []), findings
    assert code in [one["code"] for one in findings if one["severity"] == "error"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("process", "code"),
    [
        (STOCK + tool(diameter=0.63), "STK025"),
        (STOCK + tool(diameter=0.63, length=1.57), "STK025"),
        (STOCK + tool(diameter=1.6), "STK024"),
        (STOCK + tool(length=3, shank=16, holder="{diameter: 63, from: 4}"), "STK012"),
        (STOCK + tool(spindle=72000), "STK025"),
    ],
)
def test_another_unit_is_reported_and_does_not_end_with_0(folder, process, code):
    state(folder, process)
    exit, findings, _ = job(folder)
    assert exit == 3
    assert code in [one["code"] for one in findings if one["severity"] == "warning"]


def test_another_speed_of_the_program_is_reported(folder):
    (folder / "part.ngc").write_text(SLOT.replace("T1 M6", "T1 M6\nS1200 M3"))
    state(folder, STOCK + tool())
    _, findings, _ = job(folder)
    assert "STK021" in [one["code"] for one in findings]
