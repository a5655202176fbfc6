"""What only the controller knows, as the cell states it: names with values, and the state at the start."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from conftest import LINES

from postproc.base.document import Document
from postproc.base.geometry import Poses, abc_from_rotation, rotation_from_abc
from postproc.base.units import DEG, MM
from postproc.cell import Cell, Tool, frames_of, load_cell
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.krl import KrlDialect
from postproc.languages.krl.spatial import product
from postproc.toolpath.initial_state import UNSTATED, InitialState, Symbol

FULL = "{X 1,Y 2,Z 3,A 4,B 5,C 6}"
POSE = {"X": 5.0, "Y": 0.0, "Z": 0.0, "A": 0.0, "B": 0.0, "C": 0.0}
HOME = {f"A{axis}": 10.0 * axis for axis in range(1, 7)}


def read(
    text: str, symbols: dict[str, Symbol] | None = None, initial: InitialState = UNSTATED, dat: str = ""
) -> Program:
    documents = [Document(Path("part.src"), f"DEF part()\n{text}END\n".encode())]
    if dat:
        documents.append(Document(Path("part.dat"), f"DEFDAT part\n{dat}ENDDAT\n".encode()))
    return KrlDialect().read(tuple(documents), ReadingSettings(symbols=symbols or {}, initial=initial))


@pytest.mark.parametrize(
    ("text", "symbols", "last"),
    [
        ("FDAT_ACT=FHOME\nBAS(#FRAMES)\nLIN " + FULL + "\n", {"FHOME": {"TOOL_NO": 1.0, "BASE_NO": 0.0}},
         "LIN X 1 Y 2 Z 3 A 4 B 5 C 6 base {0 0 0 0 0 0} tool [1]"),
        ("BAS(#FRAMES)\nLIN " + FULL + "\n", {"FDAT_ACT": {"TOOL_NO": 2.0, "BASE_NO": 3.0}},
         "LIN X 1 Y 2 Z 3 A 4 B 5 C 6 base [3] tool [2]"),
        ("PTP XHOME\n", {"XHOME": HOME}, "AXIS A1 10 A2 20 A3 30 A4 40 A5 50 A6 60 base ? tool ?"),
        ("BAS(#BASE,n)\nBAS(#TOOL,1)\nLIN {X n+1,Y 0,Z 0,A 0,B 0,C 0}\n", {"N": 3.0},
         "LIN X 4 Y 0 Z 0 A 0 B 0 C 0 base [3] tool [1]"),
        ("$BASE=BASE_DATA[2]\nBAS(#TOOL,1)\nLIN P\n", {"BASE_DATA[2]": POSE, "P": POSE},
         "LIN X 5 Y 0 Z 0 A 0 B 0 C 0 base {5 0 0 0 0 0} tool [1]"),
        # an INT or a REAL, and 7/2 is another number then
        ("BAS(#BASE,1)\nBAS(#TOOL,1)\nLIN {X n/2,Y 0,Z 0,A 0,B 0,C 0}\n", {"N": 7.0},
         "LIN base [1] tool [1] refused KRL002"),
        ("BAS(#BASE,1)\nBAS(#TOOL,1)\nLIN P\n", {}, "LIN base [1] tool [1] refused KRL003"),
    ],
)  # fmt: skip
def test_a_name_has_the_value_that_the_cell_states(text: str, symbols: dict[str, Symbol], last: str) -> None:
    assert list(read(text, symbols).toolpath.dump())[-1].partition(" ")[2] == last


def test_what_the_program_declares_or_assigns_is_its_own() -> None:
    text = "BAS(#BASE,1)\nBAS(#TOOL,1)\nLIN P\nLIN Q\nQ.X=7\n"
    path = read(text, {"P": POSE, "Q": POSE}, dat=f"DECL FRAME P={FULL}\n").toolpath
    assert path.position[0].tolist() == pytest.approx([0.001, 0.002, 0.003])
    assert list(path.constraints.refused) == [1]


def test_a_program_starts_with_the_state_of_the_cell() -> None:
    initial = InitialState(2, 3, {"X": 1.0, "Y": 2.0, "Z": 3.0, "A": 4.0, "B": 5.0, "C": 6.0})
    lines = list(read("LIN {X 9}\n", initial=initial).toolpath.dump())
    assert lines == ["2 LIN X 9 Y 2 Z 3 A 4 B 5 C 6 base [3] tool [2]"]
    part = InitialState(2, 3, {"X": 1.0})
    assert "refused KRL004" in next(read("LIN {X 9}\n", initial=part).toolpath.dump())


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("MINE=BASE_DATA[2]\n$BASE=MINE\n", "base [2]"),
        ("n=2\nMINE=BASE_DATA[n+1]\n$BASE=MINE\n", "base [3]"),
        ("MINE=BASE_DATA[2]\nBASE_DATA[2]={X 7,Y 0,Z 0,A 0,B 0,C 0}\n$BASE=MINE\n", "base ?"),
        ("BASE_DATA[2]={X 7,Y 0,Z 0,A 0,B 0,C 0}\nMINE=BASE_DATA[2]\n$BASE=MINE\n", "base {7 0 0 0 0 0}"),
        ("MINE=TOOL_DATA[2]\n$BASE=MINE\n", "base ?"),
        ("MINE=BASE_DATA[2]\nMINE.X=5\n$BASE=MINE\n", "base ?"),
        ("IF $IN[1] THEN\nMINE=BASE_DATA[2]\nELSE\nMINE=BASE_DATA[3]\nENDIF\n$BASE=MINE\n", "base ?"),
        ("IF $IN[1] THEN\nMINE=BASE_DATA[2]\nELSE\nMINE=BASE_DATA[2]\nENDIF\n$BASE=MINE\n", "base [2]"),
        ("MINE=BASE_DATA[2]\nelsewhere(MINE)\n$BASE=MINE\n", "base ?"),
        ("EXT elsewhere(FRAME:IN)\nMINE=BASE_DATA[2]\nelsewhere(MINE)\n$BASE=MINE\n", "base [2]"),
        ("EXT elsewhere(INT:IN,FRAME:OUT)\nMINE=BASE_DATA[2]\nelsewhere(1,MINE)\n$BASE=MINE\n", "base ?"),
        ("EXT elsewhere(REAL[,]:IN,FRAME:OUT)\nMINE=BASE_DATA[2]\nelsewhere(n,MINE)\n$BASE=MINE\n", "base ?"),
        ("EXTFCT INT elsewhere(FRAME:IN)\nMINE=BASE_DATA[2]\nelsewhere(MINE)\n$BASE=MINE\n", "base [2]"),
        ("MINE=BASE_DATA[2]\nelsewhere(MINE.X+1)\n$BASE=MINE\n", "base [2]"),
        ("MINE=BASE_DATA[2]\nLIN MINE\n$BASE=MINE\n", "base [2]"),
        # frames that are stated in an entry
        ("$BASE=BASE_DATA[2]:{X 7,Y 0,Z 1,A 0,B 0,C 0}\n", "base [2]{7 0 1 0 0 0}"),
        (
            "$BASE=BASE_DATA[2]:{X 1,Y 0,Z 0,A 90,B 0,C 0}:{X 7,Y 0,Z 0,A 0,B 0,C 0}\n",
            "base [2]{1 7 0 90 0 0}",
        ),
        ("n=1\nMINE={X 7,Y 0,Z 0,A 0,B 0,C 0}\n$BASE=BASE_DATA[n+1]:MINE\n", "base [2]{7 0 0 0 0 0}"),
        ("MINE=BASE_DATA[2]:{X 7,Y 0,Z 0,A 0,B 0,C 0}\n$BASE=MINE\n", "base [2]{7 0 0 0 0 0}"),
        ("BASE_DATA[3]=BASE_DATA[2]:{X 7,Y 0,Z 0,A 0,B 0,C 0}\nBAS(#BASE,3)\n", "base [2]{7 0 0 0 0 0}"),
        ("BASE_DATA[3]=BASE_DATA[2]\nBAS(#BASE,3)\n", "base [2]"),
        ("BAS(#BASE,2)\n$BASE=$BASE:{X 7,Y 0,Z 0,A 0,B 0,C 0}\n", "base [2]{7 0 0 0 0 0}"),
        ("MINE=INV_POS({X 7,Y 0,Z 0,A 90,B 0,C 0})\n$BASE=BASE_DATA[2]:MINE\n", "base [2]{0 7 0 -90 0 0}"),
        ("$BASE=BASE_DATA[2]:{X 0,Y 0,Z 0,A 0,B 0,C 0}\n", "base [2]"),
        ("$BASE={X 7,Y 0,Z 0,A 0,B 0,C 0}:BASE_DATA[2]\n", "base ?"),
        ("$BASE=BASE_DATA[2]:BASE_DATA[3]\n", "base ?"),
        ("$BASE=TOOL_DATA[2]:{X 7,Y 0,Z 0,A 0,B 0,C 0}\n", "base ?"),
        ("$BASE=INV_POS(BASE_DATA[2])\n", "base ?"),
        ("BASE_DATA[2].X=5\n$BASE=BASE_DATA[2]:{X 7,Y 0,Z 0,A 0,B 0,C 0}\n", "base ?"),
        ("$BASE=BASE_DATA[2]:{X 7,Y 0,Z 0,A 0,B 0,C 0}\n$BASE.X=3\n", "base [2]{7 0 0 0 0 0}.X=3"),
        ("BAS(#BASE,2)\n$BASE.Z=n+150\n", "base ?"),
        ("n=1\nBAS(#BASE,2)\n$BASE.Z=n+150\n$BASE.Y=2\n$BASE.Z=151.5\n", "base [2]{0 0 0 0 0 0}.Y=2.Z=151.5"),
        ("BAS(#BASE,2)\n$BASE.X=3\nMINE=$BASE\n$BASE=MINE\n", "base ?"),
        ("BAS(#BASE,2)\n$BASE.A=3\n", "base ?"),
        ("BAS(#BASE,2)\n$BASE.X=3\nBAS(#BASE,2)\n", "base [2]"),
        ("BAS(#BASE,2)\nIF $IN[1] THEN\n$BASE.X=3\nENDIF\n", "base ?"),
        ("MINE=BASE_DATA[2]:{X 7,Y 0,Z 0,A 0,B 0,C 0}\n$BASE=MINE.X\n", "base ?"),
        ("IF BASE_DATA[2]==BASE_DATA[2] THEN\n$BASE=$NULLFRAME\nELSE\nBAS(#BASE,2)\nENDIF\n", "base ?"),
        (
            "IF $IN[1] THEN\nMINE=BASE_DATA[2]\nELSE\nMINE=BASE_DATA[2]:{X 7,Y 0,Z 0,A 0,B 0,C 0}\nENDIF\n$BASE=MINE\n",
            "base ?",
        ),
    ],
)
def test_a_copy_of_a_numbered_frame_is_that_frame(text: str, frames: str) -> None:
    program = read(f"DECL FRAME MINE\nDECL INT n\nBAS(#TOOL,1)\n{text}LIN {FULL}\n")
    assert f" {frames} tool [1]" in list(program.toolpath.dump())[-1]


def test_a_point_that_varies_names_the_lines_that_set_it() -> None:
    text = "BAS(#BASE,1)\nBAS(#TOOL,1)\nIF $IN[1] THEN\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\nELSE\n"
    program = read(text + "LIN {X 9,Y 2,Z 3,A 0,B 0,C 0}\nENDIF\nLIN {Y 5,Z 3,A 0,B 0,C 0}\n")
    (refused,) = program.toolpath.constraints.refused.values()
    assert refused.message == "the point omits X, and the position is not known: it varies: line 5 or line 7"


@pytest.mark.parametrize(
    ("line", "table", "literal"),
    [
        ("$BASE=BASE_DATA[1]", "bases", "{X 20,Y -30,Z 5,A 25,B 3,C -2}"),
        ("$TOOL=TOOL_DATA[1]", "tools", "{X 3,Y -4,Z 12,A 15,B 6,C -7}"),
    ],
)
def test_a_frame_in_an_entry_is_corrected_as_the_product_of_both(compensate, job, line, table, literal):
    """The same program with the numbers of the product, once by the cell's tables, and once by the text alone."""
    at = LINES.index(line)
    job.write([*LINES[:at], f"{line}:{literal}", *LINES[at + 1 :]])
    done = compensate(job.program, "--force")
    assert done.code in (0, 3), done.err
    written = job.output.read_bytes().splitlines()
    assert written[at + 1] == f"{line}:{literal}".encode()
    cell = load_cell(job.folder / "cell.yaml")
    pose = cell.bases[1] if table == "bases" else cell.tools[1].pose
    angles = abc_from_rotation(pose.rotation)
    entry = np.concatenate([pose.position / MM, angles / DEG]).tolist()
    within = [float(part.split()[1]) for part in literal.strip("{}").split(",")]
    numbers = product(tuple(entry), tuple(within))
    stated = ",".join(f"{key} {value:.9f}" for key, value in zip("XYZABC", numbers, strict=True))
    other = job.folder / "other"
    other.mkdir()
    cell_text = (job.folder / "cell.yaml").read_text()
    if table == "tools":  # the spindle's axis of the literal tool
        axis = rotation_from_abc(np.array(within[3:]) * DEG).T @ cell.tools[1].axis
        place = ", ".join(f"{key.lower()}: {value:.9f}" for key, value in zip("XYZABC", numbers, strict=True))
        cell_text = cell_text.replace("tools:\n", f"tools:\n  2: {{{place}, axis: {axis.tolist()}}}\n")
    (other / "cell.yaml").write_text(cell_text)
    program = other / "part.src"
    program.write_text(
        "\n".join([*LINES[:at], f"{line.partition('=')[0]}={{{stated}}}", *LINES[at + 1 :], ""])
    )
    assert compensate(program, "--force").code == done.code
    others = (other / "compensated" / "part.src").read_bytes().splitlines()
    assert len(written) == len(others)
    for one, two in zip(written, others, strict=True):
        if one.startswith(b"LIN"):
            pairs = (re.findall(rb"-?\d+\.\d+", each) for each in (one, two))
            np.testing.assert_allclose(*[np.array(each, float) for each in pairs], atol=0.0021)


TOOLS = {
    1: Poses.from_abc([0.01, -0.02, 0.3], [0.3, -0.2, 1.5]),
    4: Poses.from_abc([1.0, 2.0, 3.0], [0.1, 0.2, 0.3]),
}


@pytest.mark.parametrize("number", TOOLS)
@pytest.mark.parametrize("key", "XYZ")
@pytest.mark.parametrize("within", ["", ":{X 10,Y 20,Z 30,A 40,B 50,C 60}"])
def test_a_component_that_a_program_sets_of_a_frame_of_the_cell_replaces_that_of_the_cell(
    number: int, key: str, within: str
) -> None:
    """The same motion with the whole frame as numbers has the same place."""
    cell = Cell(
        Path("cell.yaml"), "r", tools={n: Tool(pose, np.array([1.0, 0, 0])) for n, pose in TOOLS.items()}
    )

    def placed(frame: str, changed: str) -> Poses:
        text = f"DEF a()\n$BASE=$NULLFRAME\n$TOOL={frame}\n{changed}LIN {{X 1,Y 2,Z 3,A 4,B 5,C 6}}\nEND\n"
        path = KrlDialect().read((Document(Path("a.src"), text.encode()),)).toolpath
        return frames_of(cell, path, "a.src").tool_in_flange

    pose = cell.tools[number].pose
    values = [*(pose.position / MM), *(abc_from_rotation(pose.rotation) / DEG)]
    literal = ",".join(f"{name} {value!r}" for name, value in zip("XYZABC", map(float, values), strict=True))
    by_entry = placed(f"TOOL_DATA[{number}]{within}", f"$TOOL.{key}=12.5\n")
    by_numbers = placed(f"{{{literal}}}{within}", f"$TOOL.{key}=12.5\n")
    assert np.allclose(by_entry.position, by_numbers.position, atol=1e-12)
    assert np.allclose(by_entry.rotation, by_numbers.rotation, atol=1e-12)
    assert by_entry.position[0, "XYZ".index(key)] == 0.0125
