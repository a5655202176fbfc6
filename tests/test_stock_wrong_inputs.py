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


def test_what_no_robot_can_correct_names_the_spindle_that_it_follows_from(folder):
    """200 1/min with F 3600 and 3 teeth: 6 mm per tooth bend the arm by more than may be corrected."""
    state(folder, STOCK + tool(spindle=200))
    exit, findings, written = job(folder)
    assert (exit, written) == (1, [])
    assert findings[0]["code"] == "COR002"
    (chip,) = [one for one in findings if one["code"] == "STK024"]
    assert (
        "6 mm here (spindle 200 1/min as the process file states, F 3600 mm/min, 3 teeth)" in chip["message"]
    )
    assert "a cutter of 16 mm needs at least 750 1/min for this feed: compare the spindle" in chip["help"]


ROWS = [(-10, 110, y) for y in (10, 20, 30, 40)]


def rows_of(levels, rows=ROWS):
    """A program of rows in X at levels: each starts and ends 2 mm beside a blank from 0 to 100."""
    text = "G21 G90 G17 G54\nT1 M6\n"
    for z in levels:
        for first, last, y in rows:
            text += f"G0 X{first} Y{y} Z30\nG0 Z{z}\nG1 X{last} F3600\nG0 Z30\n"
    return text + "M2\n"


def engaged(folder, text, process):
    """Findings of the engagement by code."""
    (folder / "part.ngc").write_text(text)
    state(folder, process)
    result = CliRunner().invoke(main, ["engage", str(folder / "part.ngc"), "--json", "-"])
    found = {}
    for one in json.loads(result.stdout)["findings"]:
        found.setdefault(one["code"], []).append(one)
    return result.exit_code, found


def box(x=0, y=0, z=0, length=100):
    return f"stock: {{box: [[{x}, {y}, -30], [{x + length}, {y + 60}, {z}]]}}\n"


@pytest.mark.parametrize("shift", [50, -50])
def test_a_blank_beside_its_place_is_reported(folder, shift):
    code, found = engaged(folder, rows_of([-5]), box(x=shift) + tool())
    assert code == 3
    (one,) = found["STK032"]
    side = "low" if shift > 0 else "high"
    assert (
        f"4 passes of tool 1 (lines 5 to 17) reach up to 60 mm beyond the {side} side of the blank in X"
        in one["message"]
    )
    assert "end inside of it at the other side, at least 40 mm before it" in one["message"]
    assert "compare the corners of the blank in X" in one["help"]
    assert one["line"] == 1


@pytest.mark.parametrize(
    ("process", "rows"),
    [
        (box(), ROWS),
        (box(x=10), ROWS),  # an overrun of less than two diameters is nobody's mistake
        (box(length=400), ROWS),  # one end of a bar
        (box(), [(-100, 200, y) for y in (10, 20, 30)]),  # long at both ends
        (box(), [(-60, 60, 10), (-60, 60, 20), (-60, 60, 30), (-10, 110, 40)]),  # one goes through
        (box(), [(-60, 60, 10), (-60, 60, 20)]),
    ],
)
def test_a_blank_in_its_place_is_not(folder, process, rows):
    _, found = engaged(folder, rows_of([-5], rows), process + tool())
    assert "STK032" not in found


@pytest.mark.parametrize(
    ("levels", "top", "reported"),
    [
        ((-2, -4, -6, -8), 0, False),
        ((-2, -4, -6, -8), 2, True),
        ((-2, -4, -6, -7), 2, True),  # the last is what remains
        ((-2, -4, -6, -8), -1, False),
        ((-2, -4, -6, -8), 0.4, False),
        ((-5, -5.5, -6), 0, False),  # a floor that is finished in two steps
        ((-6, -8, -9, -9.5), 0, False),  # no equal steps
    ],
)
def test_a_first_level_that_is_deeper_than_the_next_ones_is_reported(folder, levels, top, reported):
    code, found = engaged(folder, rows_of(levels), box(z=top) + tool())
    assert ("STK033" in found) == reported
    if reported:
        assert code == 3
        (one,) = found["STK033"]
        assert "cuts 4 mm deep in its first level (line 5), and goes 2 mm deeper in each" in one["message"]


@pytest.mark.parametrize(
    ("cylinder", "levels", "code"),
    [
        ("center: [50, 30, -15], diameter: 150, height: 30", (-2, -4, -6, -8), "STK033"),
        ("center: [50, 30, -30], diameter: 60, height: 100, axis: x", (-5,), "STK032"),
        ("center: [50, 30, -30], diameter: 150, height: 30", (-2, -4, -6, -8), None),
        ("center: [0, 30, -30], diameter: 60, height: 100, axis: x", (-5,), None),
    ],
)
def test_a_cylinder_by_the_middle_of_its_height_is_reported(folder, cylinder, levels, code):
    """It is stated by the middle of its foot: read so, it lies half of its height too far along its axis."""
    exit, found = engaged(folder, rows_of(levels), f"stock: {{cylinder: {{{cylinder}}}}}\n" + tool())
    assert set(found) & {"STK008", "STK032", "STK033"} == ({code} if code else set())
    if code:
        assert exit == 3
        assert "center is the middle of a cylinder's foot" in found[code][0]["help"]
