"""Files beside a KRL program that say what it does not say itself: which are read, and what they make known."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.base.document import Document
from postproc.base.findings import Refusal
from postproc.batching.files_read import digest_of, readings
from postproc.cell import frames_of
from postproc.cell.read_cell import load_cell
from postproc.languages.dialect import Program, ReadingSettings, read_with_siblings
from postproc.languages.krl import KrlDialect
from postproc.languages.krl.other_modules import MOST_DEPTH
from postproc.toolpath.initial_state import Symbol

FULL = "{X 1,Y 2,Z 3,A 4,B 5,C 6}"
HEAD = "BAS(#BASE,1)\nBAS(#TOOL,1)\n"


def read(folder: Path, text: str, files: dict[str, str], symbols: dict[str, Symbol] | None = None) -> Program:
    """The program ``part.src`` in ``folder`` with other files, by their paths from there."""
    folder.mkdir(exist_ok=True, parents=True)
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_bytes(content.encode("latin-1"))
    path = folder / "part.src"
    path.write_text(f"DEF part()\n{text}END\n")
    dialect = KrlDialect()
    documents = tuple(Document(one, one.read_bytes()) for one in (path, *dialect.companions(path)))
    return read_with_siblings(dialect, documents, ReadingSettings(symbols=symbols or {}))[0]


def dump(program: Program) -> list[str]:
    return [line.partition(" ")[2] for line in program.toolpath.dump()]


def said(program: Program) -> list[str]:
    return [finding.message for finding in program.findings if finding.code == "KRL033"]


def dat(text: str, name: str = "$CONFIG") -> str:
    return f"DEFDAT {name} PUBLIC\n{text}\nENDDAT\n"


CONFIG = dat("DECL E6AXIS XHOME={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\nDECL FDAT FHOME={TOOL_NO 2,BASE_NO 3}")
HOME = "FDAT_ACT=FHOME\nBAS(#FRAMES)\nPTP XHOME\nLIN " + FULL + "\n"


@pytest.mark.parametrize(
    "place", ["$config.dat", "$CONFIG.DAT", "../System/$config.dat", "../../R1/System/$Config.dat"]
)
def test_the_controller_data_near_the_program_are_read(tmp_path: Path, place: str) -> None:
    program = read(tmp_path / "a" / "b", HOME, {place: CONFIG})
    assert dump(program) == [
        "AXIS A1 0 A2 -90 A3 90 A4 0 A5 0 A6 0 base [3] tool [2]",
        "LIN X 1 Y 2 Z 3 A 4 B 5 C 6 base [3] tool [2]",
    ]
    (message,) = said(program)
    assert message.endswith("is read for FHOME, XHOME")
    assert message.lower().split()[0].endswith("$config.dat")


def test_the_nearest_level_counts_and_two_of_one_level_must_agree(tmp_path: Path) -> None:
    far = CONFIG.replace("BASE_NO 3", "BASE_NO 7")
    near = read(tmp_path / "a" / "b", HOME, {"../System/$config.dat": CONFIG, "../../$config.dat": far})
    assert "base [3]" in dump(near)[1]
    both = read(tmp_path / "c", HOME, {"System/$config.dat": CONFIG, "$config.dat": far})
    assert "base ? tool ?" in dump(both)[1]
    same = read(tmp_path / "d", HOME, {"System/$config.dat": CONFIG, "$config.dat": CONFIG})
    assert dump(same) == dump(near)


def test_a_name_that_two_files_define_differently_is_not_known(tmp_path: Path) -> None:
    one = dat(f"DECL GLOBAL FRAME P={FULL}\nDECL GLOBAL FRAME Q={FULL}", "one")
    two = dat(f"DECL GLOBAL FRAME P={FULL.replace('X 1', 'X 9')}\nDECL GLOBAL FRAME Q={FULL}", "two")
    program = read(tmp_path, HEAD + "LIN P\nLIN Q\n", {"one.dat": one, "two.dat": two})
    first, second = dump(program)
    assert "refused KRL019" in first
    assert second == "LIN X 1 Y 2 Z 3 A 4 B 5 C 6 base [1] tool [1]"
    refused = program.toolpath.constraints.refused[0].message
    assert "P is declared differently in one.dat and two.dat" in refused


def test_only_what_is_global_counts_and_the_own_names_go_before(tmp_path: Path) -> None:
    other = dat(f"DECL FRAME P={FULL}\nDECL GLOBAL FRAME Q={FULL}\nDECL GLOBAL FRAME R={FULL}", "other")
    own = dat(f"DECL FRAME Q={FULL.replace('X 1', 'X 5')}", "part")
    files = {
        "other.dat": other,
        "part.dat": own,
        "text.dat": "GLOBAL P Q R",
        "bytes.dat": "DEFDAT\0 GLOBAL P",
    }
    program = read(tmp_path, HEAD + "LIN P\nLIN Q\nLIN R\n", files)
    lines = dump(program)
    assert "refused KRL003" in lines[0]
    assert "X 5" in lines[1]
    assert "X 1" in lines[2]
    assert [message.rpartition("/")[2] for message in said(program)] == ["other.dat is read for R"]


def test_the_cell_goes_before_the_files_and_then_none_is_read(tmp_path: Path) -> None:
    symbols: dict[str, Symbol] = {"FHOME": {"TOOL_NO": 5.0, "BASE_NO": 6.0}}
    program = read(tmp_path, HOME, {"$config.dat": CONFIG}, symbols)
    assert "base [6] tool [5]" in dump(program)[1]
    program = read(tmp_path, HEAD + f"$BASE=BASE_DATA[2]\nLIN {FULL}\n", {"$config.dat": CONFIG})
    assert said(program) == []
    assert program.unresolved == {"BASE_DATA[2]", "TOOL_DATA[1]"}


def test_what_the_last_run_left_in_a_file_is_not_known(tmp_path: Path) -> None:
    config = dat("DECL FDAT FDAT_ACT={TOOL_NO 2,BASE_NO 3}")
    program = read(tmp_path, f"BAS(#FRAMES)\nLIN {FULL}\n", {"$config.dat": config})
    assert "base ? tool ?" in dump(program)[0]


def called(folder: Path, body: str, more: str = "", main: str = "init()\n", **files: str) -> list[str]:
    """What is read of two motions with a call between them of a routine of another module."""
    module = f"DEF init()\n{body}END\n{more}"
    text = HEAD + f"LIN {FULL}\n{main}LIN {FULL}\n"
    others = {f"{name}.{'dat' if text.startswith('DEFDAT') else 'src'}": text for name, text in files.items()}
    return dump(read(folder, text, {"init.src": module, **others}))[1:]


FIXED = "LIN X 1 Y 2 Z 3 A 4 B 5 C 6 "


@pytest.mark.parametrize(
    ("body", "frames"),
    [
        ("$OUT[1]=TRUE\n", "base [1] tool [1]"),
        ("$BASE=BASE_DATA[4]\n", "base [4] tool [1]"),
        ("IF $IN[1] THEN\n$BASE=BASE_DATA[4]\nENDIF\n", "base ? tool [1]"),
        ("IF $IN[1] THEN\nBAS(#TOOL,3)\nRETURN\nENDIF\nBAS(#TOOL,3)\n", "base [1] tool [3]"),
        ("inner()\n", "base [1] tool [8]"),
        ("LOOP\ninner()\nENDLOOP\n", "base [1] tool ?"),
        ("init()\nBAS(#TOOL,2)\n", "base [1] tool [2]"),
        ("IF $IN[1] THEN\ninit()\nENDIF\n$BASE=BASE_DATA[3]\n", "base [3] tool [1]"),
        ("IF $IN[1] THEN\ninit()\nELSE\n$BASE=BASE_DATA[3]\nENDIF\n", "base ? tool [1]"),
        ("$TOOL=TOOL_DATA[n]\n", "base [1] tool ?"),
    ],
)
def test_a_routine_of_another_module_leaves_base_and_tool(tmp_path: Path, body: str, frames: str) -> None:
    inner = "DEF inner()\nBAS(#TOOL,8)\nEND\n"
    (line,) = called(tmp_path, body, inner)
    assert line.partition(" refused")[0] in (FIXED + frames, "LIN " + frames)


def test_parameters_and_data_of_the_other_module_are_known(tmp_path: Path) -> None:
    body = "BAS(#BASE,k)\nBAS(#TOOL,m)\n"
    module = f"DEF init(k:IN,o:OUT)\n{body}o=5\nEND\n"
    text = "INT q\nq=2\n" + HEAD + f"init(7,q)\nLIN {FULL}\nLIN {{X q,Y 2,Z 3,A 4,B 5,C 6}}\n"
    program = read(tmp_path, text, {"init.src": module, "init.dat": dat("DECL INT m=6", "init")})
    first, second = dump(program)
    assert first == FIXED + "base [7] tool [6]"
    assert "refused KRL002" in second


def test_global_variables_and_tables_that_it_changes_are_forgotten(tmp_path: Path) -> None:
    files = {
        "$config.dat": dat(f"DECL GLOBAL FRAME P={FULL}\nDECL GLOBAL FRAME Q={FULL}"),
        "init.src": "DEF init()\nP.X=9\nBASE_DATA[2]={X 1,Y 0,Z 0,A 0,B 0,C 0}\nEND\n",
    }
    program = read(tmp_path, HEAD + f"init()\nLIN P\nLIN Q\n$BASE=BASE_DATA[2]\nLIN {FULL}\n", files)
    first, second, third = dump(program)
    assert "refused KRL002" in first
    assert second == FIXED + "base [1] tool [1]"
    assert "base ?" in third


def test_a_motion_elsewhere_loses_the_position_only(tmp_path: Path) -> None:
    text = HEAD + f"LIN {FULL}\ninit()\nLIN {{X 5}}\nLIN {FULL}\n"
    program = read(tmp_path, text, {"init.src": f"DEF init()\nPTP {FULL}\nEND\n"})
    assert "refused KRL004" in dump(program)[1]
    assert dump(program)[2] == FIXED + "base [1] tool [1]"
    assert not any(finding.code == "KRL010" for finding in program.findings)


def test_modules_call_modules_and_what_is_missing_is_said(tmp_path: Path) -> None:
    files = {"init.src": "DEF init()\nmore()\nEND\n", "more.src": "DEF more()\nBAS(#TOOL,4)\nlost()\nEND\n"}
    program = read(tmp_path, HEAD + f"init()\nLIN {FULL}\n", files)
    assert dump(program) == [FIXED + "base [1] tool [4]"]
    messages = [finding.message for finding in program.findings if finding.code == "KRL010"]
    assert [message.split(",")[0] for message in messages] == ["LOST"]


def test_an_interrupt_of_another_module_may_change_frames(tmp_path: Path) -> None:
    files = {"init.src": "DEF init()\nINTERRUPT DECL 3 WHEN $IN[1]==TRUE DO stop()\nINTERRUPT ON 3\nEND\nDEF stop()\n"
             "$BASE=BASE_DATA[9]\nEND\n"}  # fmt: skip
    program = read(tmp_path, HEAD + f"init()\nLIN {FULL}\n", files)
    assert "refused" in dump(program)[0]


def test_numbers_stay_where_they_are_written(tmp_path: Path) -> None:
    """What comes from another file has no place in this one."""
    files = {"init.src": f"DEF init()\nP={FULL}\nEND\n", "$config.dat": dat("DECL GLOBAL FRAME P")}
    program = read(tmp_path, HEAD + "init()\nLIN P\n", files)
    assert "refused" in dump(program)[0]


def test_a_file_that_cannot_be_read_is_said(tmp_path: Path) -> None:
    (tmp_path / "$config.dat").symlink_to(tmp_path / "nowhere")
    program = read(tmp_path, HOME, {})
    assert "base ?" in dump(program)[1]
    (tmp_path / "init.src").write_text("DEF init()\nEND\n")
    (tmp_path / "init.src").chmod(0)
    try:
        (tmp_path / "init.src").read_bytes()
    except PermissionError:
        with pytest.raises(Refusal):
            read(tmp_path, "init()\n", {})


def test_a_changed_file_beside_makes_a_batch_compute_again(tmp_path: Path) -> None:
    """And one that appears: what was looked for is recorded too."""
    for name in ("$config.dat", "one.dat"):
        (tmp_path / name).write_text(CONFIG)
    with readings() as digests:
        read(tmp_path, HOME + "LIN Q\ninit()\n", {})
    assert {name: digest_of(name) for name in digests} == digests
    changes = [("$config.dat", CONFIG + "\n"), ("init.src", "DEF init()\nEND\n"), ("new.dat", CONFIG)]
    for name, text in changes:
        before = {path: digest_of(path) for path in digests}
        (tmp_path / name).write_text(text)
        assert {path: digest_of(path) for path in digests} != before, name


def test_a_compensated_program_has_the_files_of_the_original(tmp_path: Path) -> None:
    """By default it lies in a folder below; ``verify`` says where the original is."""
    text = ";COMPENSATED by compensate 1\n" + HEAD + f"init()\nLIN {FULL}\n"
    module = "DEF init()\nBAS(#TOOL,4)\nEND\n"
    assert dump(read(tmp_path / "compensated", text, {"../init.src": module})) == [
        FIXED + "base [1] tool [4]"
    ]
    path = tmp_path / "compensated" / "part.src"
    documents = (Document(path, path.read_bytes().replace(b"COMPENSATED", b"x")),)
    alone, _ = read_with_siblings(KrlDialect(), documents, ReadingSettings())
    there, _ = read_with_siblings(KrlDialect(), documents, ReadingSettings(), tmp_path)
    assert [dump(one)[0][-8:] for one in (alone, there)] == ["tool [1]", "tool [4]"]


TOOLS = "DECL FRAME TOOL_DATA[16]\nTOOL_DATA[5]={X 10,Y 0,Z 200,A 90,B 0,C 0}\nTOOL_DATA[6]={X 0,Y 0,Z 0,A 0,B 0,C 0}"


def test_a_tool_is_what_the_controller_states_where_the_cell_has_none(tmp_path: Path) -> None:
    """Entry 5 of both tables is one frame to the program, and two in the file."""
    text = f"$TOOL=TOOL_DATA[5]\n$BASE=BASE_DATA[5]\nLIN {FULL}\n"
    config = dat(TOOLS + "\nBASE_DATA[5]={X 900,Y 0,Z 700,A 0,B 0,C 0}")
    program = read(tmp_path, text, {"$config.dat": config})
    path = program.toolpath
    (message,) = said(program)
    assert message.endswith(
        "BASE_DATA[5] (where the cell has no such base), TOOL_DATA[5] (where the cell has no such tool)"
    )

    def place(tools: str) -> list[float]:
        (tmp_path / "cell.yaml").write_text(f"robot: kuka_kr270\n{tools}")
        found = frames_of(load_cell(tmp_path / "cell.yaml"), path, "part.src")
        assert (found.base_in_robot.position[0] * 1000).round(6).tolist() == [900, 0, 700]
        return [*(found.tool_in_flange.position[0] * 1000).round(6), found.tool_in_flange.rotation[0, 1, 0]]

    assert place("") == pytest.approx([10, 0, 200, 1])
    assert place("tools: {5: {x: 7, y: 8, z: 9, a: 0, b: 0, c: 0, axis: +z}}\n") == [7, 8, 9, 0]


def test_a_tool_of_zeros_is_none_that_was_measured(tmp_path: Path) -> None:
    text = f"$TOOL=TOOL_DATA[6]\n$BASE=BASE_DATA[5]\nLIN {FULL}\n"
    program = read(tmp_path, text, {"$config.dat": dat(TOOLS)})
    assert program.toolpath.frames[program.toolpath.tool[0]].declared is None
    assert "TOOL_DATA[6]" in program.unresolved
    (tmp_path / "cell.yaml").write_text(
        "robot: kuka_kr270\nbases: {5: {x: 7, y: 8, z: 9, a: 0, b: 0, c: 0}}\n"
    )
    with pytest.raises(Refusal) as refusal:
        frames_of(load_cell(tmp_path / "cell.yaml"), program.toolpath, "part.src")
    assert [finding.code for finding in refusal.value.findings] == ["CEL002"]


BASES = dat("DECL FRAME BASE_DATA[32]\nBASE_DATA[3]={X 100,Y 0,Z 0,A 90,B 0,C 0}\nBASE_DATA[4]={X 1}")
IN_BASE_3 = "$TOOL=TOOL_DATA[3]\n$BASE=BASE_DATA[3]\nLIN " + FULL + "\n"


def test_a_base_is_what_the_controller_states_where_the_cell_has_none(tmp_path: Path) -> None:
    program = read(tmp_path, IN_BASE_3, {"$config.dat": BASES})
    path = program.toolpath
    assert dump(program) == ["LIN X 1 Y 2 Z 3 A 4 B 5 C 6 base [3] tool [3]"]
    base, tool = path.frames[path.base[0]], path.frames[path.tool[0]]
    assert (base.pose, tool.declared) == (None, None)
    (message,) = said(program)
    assert message.endswith("is read for BASE_DATA[3] (where the cell has no such base)")

    named = Document(tmp_path / "$config.dat", BASES.encode())
    again = KrlDialect().read(program.documents, ReadingSettings(references=(named,)))
    assert said(again) == said(program)

    def place(bases: str) -> list[float]:
        (tmp_path / "cell.yaml").write_text(
            "robot: kuka_kr270\ntools: {3: {x: 0, y: 0, z: 0, a: 0, b: 0, c: 0, axis: +z}}\n" + bases
        )
        found = frames_of(load_cell(tmp_path / "cell.yaml"), path, "part.src").base_in_robot
        return [*(found.position[0] * 1000).round(6).tolist(), found.rotation[0, 1, 0].round(9)]

    assert place("") == [100, 0, 0, 1]
    assert place("bases: {3: {x: 7, y: 8, z: 9, a: 0, b: 0, c: 0}}\n") == [7, 8, 9, 0]


@pytest.mark.parametrize(
    ("text", "files"),
    [
        (IN_BASE_3, {}),
        (IN_BASE_3.replace("[3]", "[4]"), {"$config.dat": BASES}),  # omits components
        (IN_BASE_3, {"$config.dat": BASES, "System/$config.dat": BASES.replace("X 100", "X 101")}),
        (IN_BASE_3, {"other.dat": BASES}),
        (IN_BASE_3, {"$config.dat": dat("$BASE_DATA[3]={X 1,Y 2,Z 3,A 0,B 0,C 0}")}),
    ],
)
def test_a_base_that_no_file_states_for_sure_is_that_of_the_cell_alone(
    tmp_path: Path, text: str, files: dict[str, str]
) -> None:
    program = read(tmp_path, text, files)
    assert [frame.declared for frame in program.toolpath.frames] == [None] * len(program.toolpath.frames)
    assert not any("BASE_DATA" in message for message in said(program))
    assert any(name.startswith("BASE_DATA") for name in program.unresolved)


VARIES = "IF $IN[1] THEN\nLIN {Y 1}\nENDIF\n"


@pytest.mark.parametrize(
    ("module", "after", "second"),
    [
        (f"LIN {FULL}\nLIN {{X 70}}\n", "LIN X 5 Y 2 Z 3 A 4 B 5 C 6", "LIN X 5 Y 6 Z 3 A 4 B 5 C 6"),
        (f"LIN {FULL}\n{VARIES}", "LIN X 5 Y nan Z 3 A 4 B 5 C 6", "LIN X 5 Y 6 Z 3 A 4 B 5 C 6"),
        (f"IF $IN[1] THEN\nLIN {FULL}\nENDIF\n", "LIN", "LIN"),
        ("IF FALSE THEN\nLIN {X 70}\nENDIF\n", "LIN X 5 Y 9 Z 9 A 0 B 0 C 0", "LIN X 5 Y 6 Z 9 A 0 B 0 C 0"),
        ("LIN {X 70}\n", "LIN", "LIN"),
        (f"LIN {FULL}\nunread()\n", "LIN", "LIN"),
        (f"BAS(#BASE,2)\nLIN {FULL}\nBAS(#BASE,1)\n", "LIN", "LIN"),
        ("PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\n", "LIN", "LIN"),
    ],
)
def test_a_point_after_a_call_builds_on_where_the_other_module_ends(
    tmp_path: Path, module: str, after: str, second: str
) -> None:
    """The first motion after it stays: what it omits is not corrected with it; the next one builds on that one."""
    text = f"{HEAD}LIN {{X 9,Y 9,Z 9,A 0,B 0,C 0}}\nsub()\nLIN {{X 5}}\nLIN {{Y 6}}\n"
    program = read(tmp_path, text, {"sub.src": f"DEF sub()\n{module}END\n"})
    rows = [line.partition(" base")[0].partition(" refused")[0] for line in dump(program)]
    assert rows[1:] == [after, second]
    moves = "FALSE" not in module
    assert (1 in program.toolpath.constraints.refused) == moves
    assert (2 in program.toolpath.constraints.refused) == (second == "LIN")


@pytest.mark.parametrize("deep", [1, MOST_DEPTH, MOST_DEPTH + 1, 150])
def test_modules_that_call_each_other_are_followed_so_deep(deep: int) -> None:
    """The last of a chain of modules sets the base; beyond the depth it is not known, whatever the chain's length."""
    texts = [f"DEF m{n}()\nm{n + 1}()\nEND\n" for n in range(1, deep)] + [
        f"DEF m{deep}()\nBAS(#BASE,2)\nEND\n"
    ]
    siblings = tuple(Document(Path(f"m{n}.src"), text.encode()) for n, text in enumerate(texts, 1))
    source = Document(Path("part.src"), f"DEF part()\n{HEAD}LIN {FULL}\nm1()\nLIN {FULL}\nEND\n".encode())
    path = KrlDialect().read((source,), ReadingSettings(siblings=siblings)).toolpath
    if deep <= MOST_DEPTH:
        assert path.frames[path.base[-1]].number == 2
    else:
        assert path.constraints.refused[len(path) - 1].code == "KRL005"
