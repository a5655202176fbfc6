"""Subprograms in files beside a G-code program: which are read, what they leave, and that they are not written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import CELL

from postproc.base.document import Document
from postproc.languages import detect
from postproc.languages.dialect import Program, ReadingSettings, read_with_siblings

HEAD = "G21 G90 G17 G54\nT1 M6\nG0 X0. Y0. Z5.\nG1 Z0. F100\n"
FANUC_SUB = "G91\nG1 X10. (inside)\nX10. Y4.\nG90\nM99\n"
CASES = {
    "fanuc": ("a.nc", "%\nO0001\n" + HEAD, "M98 P1234\n", "M30\n%\n", "O1234.nc", "%\nO1234\n" + FANUC_SUB + "%\n"),
    "fanuc, no number": ("a.nc", "%\nO0001\n" + HEAD, "M98 P21234\n", "M30\n%\n", "1234", FANUC_SUB),
    "fanuc, macro": ("a.nc", "O1\n" + HEAD, "G65 P77 X20.\n", "M30\n", "o0077.NC", "G1 X10.\nX#24 Y4.\nM99\n"),
    "sinumerik": ("a.mpf", HEAD, "POCKET\n", "M30\n", "pocket.SPF", ";sub\nG1 X10 Y3\nX20 Y4\nRET\n"),
    "sinumerik, archive": (
        "a.mpf", HEAD, "POCKET\n", "M30\n", "_N_POCKET_SPF", "%_N_POCKET_SPF\n;$PATH=/_N_SPF\nG1 X10\nX20 Y4\nM17\n",
    ),
    "sinumerik, L": ("a.mpf", HEAD, "L12\n", "M30\n", "L12.spf", "G1 X10\nX20 Y4\nM17\n"),
    "linuxcnc": (
        "a.ngc", HEAD, "o<part> call [20]\n", "M2\n", "part.ngc", "o<part> sub\nG1 X10.\nX#1 Y4.\no<part> endsub\n",
    ),
}  # fmt: skip


def read(folder: Path, name: str, text: str, files: dict[str, str]) -> Program:
    for other, content in files.items():
        (folder / other).write_bytes(content.encode("latin-1"))
    path = folder / name
    path.write_bytes(text.encode("latin-1"))
    dialect = detect(path, path.read_bytes())
    return read_with_siblings(dialect, (Document(path, path.read_bytes()),), ReadingSettings())[0]


def codes(program: Program) -> list[str]:
    return [finding.code for finding in program.findings]


@pytest.mark.parametrize("case", CASES)
def test_what_a_subprogram_leaves_is_known(tmp_path: Path, case: str) -> None:
    name, head, call, end, file, sub = CASES[case]
    program = read(tmp_path, name, head + call + "X50.\n" + end, {file: sub})
    path = program.toolpath
    places = (path.position * 1000).round(6).tolist()
    first, last = (2, 2 + 2 * (2 if "P2" in call else 1))
    assert places[first - 1] == [0, 0, 0]
    assert [
        row for row in path.constraints.refused if path.constraints.refused[row].code == "GCO033"
    ] == list(range(first, last))
    assert places[last] == [50, 8 if "P2" in call else 4, 0]
    assert last not in path.constraints.refused
    assert set(path.line[first:last].tolist()) == {path.line[last] - 1}
    assert last - 1 in path.constraints.no_insert_before
    (said,) = [finding for finding in program.findings if finding.code == "GCO032"]
    assert file in said.message
    assert "GCO007" not in codes(program)
    assert "inside" not in [note.text for note in path.comments]
    # without the file the state after the call is not known
    (tmp_path / file).unlink()
    alone = read(tmp_path, name, head + call + "X50.\n" + end, {})
    assert "GCO007" in codes(alone)
    assert np.isnan(alone.toolpath.position[-1]).any()


def test_a_file_beside_is_read_as_the_same_text_in_the_program(tmp_path: Path) -> None:
    text = "O1\n" + HEAD + "M98 P5\nX60. Y1.\nM98 P5\nG1 X70.\nM30\n"
    sub = "O5\nG91 G1 X1.\n/Y2.\nG2 X2. I1.\nG90\nG55\nM99\n"
    apart = read(tmp_path, "a.nc", text, {"O5.nc": sub}).toolpath
    (tmp_path / "O5.nc").unlink()
    inside = read(tmp_path, "a.nc", text + sub, {}).toolpath
    np.testing.assert_array_equal(apart.position, inside.position)
    np.testing.assert_array_equal(apart.kind, inside.kind)
    np.testing.assert_array_equal(apart.base, inside.base)
    np.testing.assert_array_equal(apart.arcs.sweep, inside.arcs.sweep)


@pytest.mark.parametrize(
    ("call", "files"),
    [
        ("M98 P5\n", {"O5.nc": FANUC_SUB, "0005.nc": FANUC_SUB}),  # which of them is not known
        ("M98 P5\n", {"O5.txt": FANUC_SUB}),
        ("M98 P5\n", {"O5.nc": "#1=#5021\n" + FANUC_SUB}),  # reads a position
        ("M98 P5\n", {"O5.nc": "G1 X1.\n"}),  # has no end
        ("M98 P#1\n", {"O5.nc": FANUC_SUB}),
        ("M97 P5\n", {"O5.nc": FANUC_SUB}),  # leads to a block of the same file
    ],
)
def test_what_is_not_certain_is_not_read(tmp_path: Path, call: str, files: dict[str, str]) -> None:
    program = read(tmp_path, "a.nc", "O1\n" + HEAD + call + "X50.\nM30\n", files)
    assert "GCO032" not in codes(program)
    assert "GCO007" in codes(program)
    assert np.isnan(program.toolpath.position[-1]).any()


def test_a_file_without_the_subprogram_is_not_said_to_be_read(tmp_path: Path) -> None:
    program = read(tmp_path, "a.ngc", HEAD + "o<part> call\nX50.\nM2\n", {"part.ngc": "G1 X10.\nM2\n"})
    assert "GCO032" not in codes(program)
    assert "GCO007" in codes(program)
    assert np.isnan(program.toolpath.position[-1]).any()


def test_subprograms_call_one_another(tmp_path: Path) -> None:
    files = {
        "O5.nc": "O5\nM98 P6\nM98 P6\nM99\n",
        "O6.nc": "O6\nG91\nG1 X3.\nG90\nM99\n",
        "O7.nc": "O7\nM99\n",
    }
    program = read(tmp_path, "a.nc", "O1\n" + HEAD + "M98 P5\nG1 Y2.\nM30\n", files)
    np.testing.assert_allclose(program.toolpath.position[-1] * 1000, [6, 2, 0])
    assert codes(program).count("GCO032") == 2


def test_only_the_program_is_written(compensate, job) -> None:
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\nmax_growth: 20\n")
    sub = job.write(["O5", "G0 Z60.", "X80.", "G1 X85. F900", "G0 Z50.", "M99"], "\n", "O5.nc")
    lines = ["%", "O1", "G21 G90 G17 G54", "T1 M6", "G0 X0. Y0. Z50.", "G1 Z0. F500", "(FORCE 300 100 200 @BASE)",
             "G1 X40. Y5. Z0.", "(FORCE OFF)", "G0 Z50.", "M98 P5", "G0 X80. Y5. Z50.", "G1 Z0. F500",
             "(FORCE 300 100 200 @BASE)", "G1 X90. Y9. Z0.", "(FORCE OFF)", "G0 Z50.", "M30", "%"]  # fmt: skip
    before = sub.read_bytes()
    program = job.write(lines, "\n", "part.nc")
    done = compensate(program, "--force", "--json", "-")
    assert done.code == 3, done.out + done.err  # motions stay as they are
    assert done.json["corrected"] >= 1, done.out
    written = sorted(one.name for one in (job.folder / "compensated").iterdir())
    assert "part.nc" in written
    assert "O5.nc" not in written
    assert sub.read_bytes() == before
    text = (job.folder / "compensated" / "part.nc").read_text()
    assert "M98 P5" in text
    assert "G1 X90. Y9. Z0." not in text
