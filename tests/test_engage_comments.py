"""Tools by the comments of a program: what is read, and what is not because it could be read in two ways."""

import json

import pytest

pytest.importorskip("numba")

from stock_cases import path_through
from test_engage_command import SLOT, STOCK, TOOLS, call, folder, refused, state

from postproc.process.tool_comments import read_named_diameters, read_tool_comments
from postproc.toolpath.toolpath import Annotation

__all__ = ["folder"]
EDGES = "defaults: {teeth: 3, helix: 30, spindle: 12000, material: EN AW-7075-T6}\n"
FLAT16 = "(T1  D=16. CR=0. - ZMIN=-5. - flat end mill)\n"


def read(*texts, lowest=-5.0):

    path = path_through([[0, 0, 5], [0, 0, lowest], [50, 0, lowest]])
    comments = tuple(Annotation(0, text, 1 + line) for line, text in enumerate(texts))
    return read_tool_comments(path.with_columns(comments=comments))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("T1 D=10. CR=0. - ZMIN=-5. - flat end mill", "flat, diameter 10 mm"),
        ("T1  D=6. CR=3. - ZMIN=-5 - ball end mill", "ball, diameter 6 mm"),
        ("T1 D=12 CR=1.5 - ZMIN=-5.000 - bullnose end mill", "bull, diameter 12 mm, corner radius 1.5 mm"),
        ("T1 D=5. CR=0. TAPER=118deg - ZMIN=-5. - drill", "drill, diameter 5 mm, point angle 118 deg"),
        ("T1 D=0.5 CR=0. - ZMIN=-0.19685 - flat end mill", "flat, diameter 12.7 mm"),
    ],
)
def test_what_is_unambiguous_is_read(text, words):
    assert read(text)[1].words == words


@pytest.mark.parametrize(
    "texts",
    [
        ["T1 D=10. CR=0. - ZMIN=-7. - flat end mill"],  # neither mm nor inches
        ["T1 D=10. CR=0. - ZMIN=-5. - chamfer mill"],
        ["T1 D=10. CR=2. - ZMIN=-5. - ball end mill"],
        ["T1 D=10. CR=0. TAPER=45deg - ZMIN=-5. - flat end mill"],
        ["T1 D=10. CR=0. - flat end mill"],
        ["T2 D=10. CR=0. - ZMIN=-5. - flat end mill"],
        ["TOOL - 1 DIA. OFF. - 1 LEN. - 1 DIA. - 10."],
        ["TC: 10mm Endmill"],
        ["T1 D=10. CR=0. - ZMIN=-5. - flat end mill", "T1 D=8. CR=0. - ZMIN=-5. - flat end mill"],
    ],
)
def test_what_could_mean_two_things_is_not_read(texts):
    assert 1 not in read(*texts)


def test_a_unit_is_not_guessed_at_zero():
    assert read("T1 D=10. CR=0. - ZMIN=0. - flat end mill", lowest=0.0) == {}


def test_a_tool_of_a_comment_cuts_as_that_of_the_file(folder):
    stated = json.loads(call(folder, "--json", "-").stdout)
    (folder / "part.ngc").write_text(FLAT16 + SLOT)
    for text in (STOCK + EDGES, STOCK + "tools: {1: {length: 40}}\n" + EDGES):
        state(folder, text)
        read = json.loads(call(folder, "--json", "-").stdout)
        assert read["removal_mm3"] == stated["removal_mm3"]
        assert read["force"] == stated["force"]
        (finding,) = [one for one in read["findings"] if one["code"] == "STK018"]
        assert finding["line"] == 1
        assert "flat, diameter 16 mm" in finding["message"]


def test_a_tool_that_differs_from_its_comment_is_reported(folder):
    (folder / "part.ngc").write_text(FLAT16.replace("16", "10") + SLOT)
    state(folder, STOCK + TOOLS)
    read = json.loads(call(folder, "--json", "-", code=3).stdout)
    (finding,) = [one for one in read["findings"] if one["code"] == "STK019"]
    assert "diameter 10 mm; the process file states flat, diameter 16 mm" in finding["message"]
    assert read["tools"]["1"]["ae_max_mm"] == pytest.approx(16, abs=0.01)


def test_a_comment_that_is_not_read_leaves_the_tool_missing(folder):
    (folder / "part.ngc").write_text(FLAT16.replace("-5.", "-9.") + SLOT)
    state(folder, STOCK + EDGES)
    refused(folder, "YML003", "tools")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("TC: 10mm Endmill", "10 mm"),
        ("T1 16 MM FLAT END MILL", "16 mm"),
        ("TOOL - 1 DIA. OFF. - 1 LEN. - 1 DIA. - 10.", "10"),
        ('T1 1/2" END MILL', None),
        ('T1 0.5" END MILL', "0.5 inches"),
        ("ENDMILL D16 MM", "16 mm"),
        ("T1 D=10. CR=0. - ZMIN=-7. - flat end mill", "10"),
        ("ball nose 6 mm", "6 mm"),
        ("T1 10mm Endmill, 12 mm cutter", None),  # two sizes
        ("HOLDER DIA 63 MM T1", None),
        ("STOCK D=120", None),
        ("END MILL LEAVES 0.5 MM", None),
        ("POCKET 16 MM END MILL", None),
        ("FEED 0.1 MM PER TOOTH", None),
        ("T1", None),
    ],
)
def test_a_diameter_that_a_comment_names(text, words):
    path = path_through([[0, 0, 5], [0, 0, -5], [50, 0, -5]])
    named = read_named_diameters(path.with_columns(comments=(Annotation(0, text, 1),)))
    assert [one.words for one in named.get(1, [])] == ([] if words is None else [words])


@pytest.mark.parametrize(
    ("text", "contradicts"),
    [
        ("(16mm Endmill)\n", False),
        ("(T1 DIA. 0.63)\n", False),  # it may be inches
        ("(16 mm end mill D=0.63 in)\n", False),  # two sizes: not read
        ("(T1 10 mm end mill)\n", True),
        ("(T1 16 in end mill)\n", True),
        ("(DIA. - 12.)(T1)\n", False),  # names no tool
        ("(T1 DIA. - 12.)\n", True),
        ("(T2 10 mm end mill)\n", False),
    ],
)
def test_a_named_diameter_that_differs_is_reported(folder, text, contradicts):
    (folder / "part.ngc").write_text(text + SLOT)
    result = json.loads(call(folder, "--json", "-", code=3 if contradicts else 0).stdout)
    found = [one for one in result["findings"] if one["code"] == "STK019"]
    assert bool(found) == contradicts
    assert all("diameter 16 mm, which is used" in one["message"] and one["line"] == 1 for one in found)
