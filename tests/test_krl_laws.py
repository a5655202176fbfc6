"""Laws of KRL that hold for any program: where findings point, what runs, and that blocks of rows are seen nowhere."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fuzz.examine import dividable, movable, planned

from postproc.base.document import Document
from postproc.base.units import MM
from postproc.languages.dialect import Plan, Program, ReadingSettings, WritingSettings
from postproc.languages.krl import KrlDialect, block_flow, open_blocks, program_flow

KRL = KrlDialect()
CASES = Path(__file__).parent / "programs" / "krl"
GOOD = sorted(CASES.glob("*.src"))
BAD = sorted((CASES / "bad").glob("*.src"))
FRAMES = "BAS(#BASE,1)\nBAS(#TOOL,1)\n"
ids = {"ids": lambda path: path.stem}


def case(path: Path) -> Program:
    config = path.with_suffix(".config.dat")
    references = (Document(config, config.read_bytes()),) if config.exists() else ()
    documents = tuple(Document(p, p.read_bytes()) for p in (path, *KRL.companions(path)))
    return KRL.read(documents, ReadingSettings(references=references))


def read(text: str) -> Program:
    return KRL.read((Document(Path("part.src"), text.encode("latin-1")),))


def body(text: str) -> Program:
    return read(f"DEF part()\n{FRAMES}{text}END\n")


def runs(program: Program) -> dict[int, bool]:
    """Line -> whether the motions there are known to follow the one before them."""
    path = program.toolpath
    return {int(line): bool(known) for line, known in zip(path.line, path.continues, strict=True)}


@pytest.mark.parametrize("path", [*GOOD, *BAD], **ids)
def test_findings_point_into_their_file(path: Path) -> None:
    """At a character of the line, or the first column where the whole line is meant."""
    program = case(path)
    raws = {str(document.path): document for document in program.documents}
    for finding in [*program.findings, *program.toolpath.constraints.refused.values()]:
        if finding.code == "KRL033":  # of a file that is read as well
            continue
        document = raws[finding.file]
        assert 1 <= finding.line <= len(document.line_starts)
        line = document.line(finding.line).rstrip()
        assert 1 <= finding.column <= max(len(line), 1), finding


@pytest.mark.sample(23)
@pytest.mark.parametrize("size", [1, 2, 3, 5])
@pytest.mark.parametrize("path", GOOD, **ids)
def test_blocks_of_rows_do_not_matter(path: Path, size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Edits are the same bytes, in whatever blocks the rows are worked on."""
    program = case(path)
    rows = program.toolpath
    n = len(rows)
    random = np.random.default_rng(n)
    free = movable(rows) & (random.random(n) < 0.6)
    free[::7] = False
    divided = np.flatnonzero(dividable(rows) & (random.random(n) < 0.2))
    writing = WritingSettings(mm=3, deg=3)
    for _ in range(20):
        shift, turn = random.normal(0, 0.2 * MM, (n, 3)), random.normal(0, 1e-3, (n, 3))
        plan = planned(rows, free, shift, turn, divided)
        found = KRL.edit_targets(program, plan, writing)
        if not found.unwritten:
            break
        free[list(found.unwritten)] = False
        free[[row - 1 for row in found.unwritten if row]] = False
        divided = divided[~np.isin(divided, list(found.unwritten))]
    for name, module in list(sys.modules.items()):
        if name.startswith("postproc.languages") and isinstance(getattr(module, "BLOCK", None), int):
            monkeypatch.setattr(module, "BLOCK", size)
    again = KRL.edit_targets(program, plan, writing)
    assert list(again.edits) == list(found.edits)
    assert again.unwritten == found.unwritten


LINE = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"


@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_a_routine_that_nobody_calls_starts_anywhere(count: int) -> None:
    """Its first motion follows none, the others the one before them; base and tool are the caller's."""
    text = f"DEF part()\n{FRAMES}{LINE}{LINE}END\nDEF lonely()\n{LINE * count}END\n"
    program = read(text)
    assert runs(program) == {4: True, 5: True} | {8 + i: i > 0 for i in range(count)}
    refused = program.toolpath.constraints.refused
    assert [refused[row].code for row in sorted(refused)] == ["KRL005"] * count


@pytest.mark.parametrize("call", ["lonely()\n", "lonely()\nlonely()\n"])
@pytest.mark.parametrize("count", [1, 2, 5])
def test_all_motions_of_a_routine_that_is_called_run(call: str, count: int) -> None:
    program = read(f"DEF part()\n{FRAMES}{LINE}{call}{LINE}END\nDEF lonely()\n{LINE * count}END\n")
    assert program.toolpath.continues.all()
    assert len(program.toolpath) == 2 + count * call.count("(")


OPENS = {"IF n>1 THEN": "ENDIF", "LOOP": "ENDLOOP", "WHILE n>1": "ENDWHILE", "FOR i=1 TO 3": "ENDFOR"}


@pytest.mark.parametrize("inner", OPENS)
@pytest.mark.parametrize("outer", OPENS)
def test_a_block_that_does_not_end_is_told_at_its_line(outer: str, inner: str) -> None:
    """One finding, where it begins, in the first column; the block around it is closed as it says."""
    program = body(f"DECL INT n,i\n{LINE}{outer}\n{LINE}{inner}\n{LINE}{OPENS[outer]}\n{LINE}")
    line = 6 if outer == inner else 8  # the end belongs to the inner one
    assert [(f.line, f.column) for f in program.findings if f.code == "KRL014"] == [(line, 1)]


@pytest.mark.parametrize("style", [str.upper, str.lower])
@pytest.mark.parametrize("said", ["X 11", "Y 12", "X 11,Y 12", "Z 13,A 4.5", "B 5.5,C 6.5", "S 2,X 11"])
def test_what_is_completed_is_spelt_as_what_is_there(said: str, style) -> None:
    """Components that a point gets have letters of the case of its own."""
    text = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\nLIN {" + said + "}\nLIN {A 4,B 5,C 7}\n"
    program = body(style(text))
    path = program.toolpath
    moved = path.position + np.array([[1.0, 2.0, 3.0], [0.1, 0.2, 0.3], [-1.0, -2.0, -3.0]]) * MM
    found = KRL.edit_targets(program, replace(Plan.of(path), position=moved), WritingSettings(mm=3, deg=3))
    assert not found.unwritten
    written = b"".join(edit.text for edit in found.edits).decode()
    assert written == style(written)
    assert any(character.isalpha() for character in written)


INSIDE = """\
DEF part()
BAS(#BASE,1)
BAS(#TOOL,1)
IF TRUE THEN
LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}
sub()
LIN {X 2}
ENDIF
LIN {X 3}
END
DEF sub()
LIN {Y 10}
IF TRUE THEN
LIN {Y 11}
GOTO out
LIN {Y 99}
ENDIF
LIN {Y 98}
out:
LIN {Y 12}
END
"""


def test_a_jump_leaves_the_blocks_of_its_routine_alone() -> None:
    """Those of the caller stay open: what follows the call runs as it stands there."""
    path = read(INSIDE).toolpath
    reached = [(round(x, 9), round(y, 9)) for x, y, _ in path.position[path.continues] / MM]
    assert reached == [(1, 2), (1, 10), (1, 11), (1, 12), (2, 12), (3, 12)]


@pytest.mark.parametrize("before", [0, 1, 4])
@pytest.mark.parametrize("count", [1, 2, 5])
def test_exactly_the_motions_of_a_routine_that_an_interrupt_calls_too_are_left(
    before: int, count: int
) -> None:
    """The routine is followed where the program calls it; from elsewhere it runs at positions that nobody knows."""
    text = f"DEF part()\n{FRAMES}INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO sub()\nINTERRUPT ON 3\n"
    text += (
        LINE * before + f"other()\nsub()\n{LINE}END\nDEF other()\n{LINE}END\nDEF sub()\n{LINE * count}END\n"
    )
    program = read(text)
    first = 5 + before + 4 + 3 + 2
    left = {
        int(program.toolpath.line[row])
        for row, f in program.toolpath.constraints.refused.items()
        if f.code == "KRL015"
    }
    assert left == set(range(first, first + count))


@pytest.mark.parametrize("motion", ["PTP $AXIS_ACT", "PTP $AXIS_ACT C_DIS", "LIN $POS_ACT C_DIS C_VEL"])
def test_a_motion_to_where_the_robot_stands_loses_no_position(motion: str) -> None:
    """Whether it runs or not, the next one begins where it would."""
    program = body(f"{LINE}IF $IN[1]==TRUE THEN\n{motion}\nENDIF\nLIN {{X 5}}\n")
    assert not program.toolpath.constraints.refused
    np.testing.assert_allclose(program.toolpath.position[-1] / MM, [5.0, 2.0, 3.0])
    lost = body(f"{LINE}IF $IN[1]==TRUE THEN\nPTP XHOME\nENDIF\nLIN {{X 5}}\n")
    assert len(lost.toolpath) - 1 in lost.toolpath.constraints.refused


@pytest.mark.parametrize(("said", "holds"), [("4.4", 4.0), ("4.5", 5.0), ("-4.5", -5.0), ("-4.4", -4.0)])
def test_an_integer_variable_rounds_what_it_is_given(said: str, holds: float) -> None:
    """To the nearest one, halves away from zero."""
    program = body(f"DECL INT n\nDECL REAL r\nn={said}\nr={said}\nLIN {{X n,Y r,Z 3,A 4,B 5,C 6}}\n")
    np.testing.assert_allclose(program.toolpath.position[0] / MM, [holds, float(said), 3.0])


@pytest.mark.parametrize("count", [1, 2, 5])
def test_exactly_the_motions_of_a_routine_that_is_also_called_with_other_frames_are_left(
    count: int,
) -> None:
    calls = "sub()\nIF $IN[1]==TRUE THEN\nsub()\nENDIF\n"
    text = f"DEF part()\n{FRAMES}{LINE}{calls}{LINE}END\nDEF sub()\n{LINE * count}END\n"
    assert not read(text).toolpath.constraints.refused
    function = f"DEFFCT INT f()\nsub()\nRETURN 1\nENDFCT\nDEF sub()\n{LINE * count}END\n"
    program = read(f"DEF part()\n{FRAMES}DECL INT i\n{LINE}sub()\ni=f()\n{LINE}END\n{function}")
    left = {
        int(program.toolpath.line[row]): f.code for row, f in program.toolpath.constraints.refused.items()
    }
    assert left == {15 + i: "KRL005" for i in range(count)}
    refused = [f.code for f in program.toolpath.constraints.refused.values()]
    assert sorted(refused) == ["KRL005"] * 2 * count + ["KRL015"] * count


@pytest.mark.parametrize("value", ["TRUE", "FALSE", '"word"', "#NAME"])
@pytest.mark.parametrize("kind", ["INT", "REAL"])
def test_a_number_is_not_made_of_what_is_none(kind: str, value: str) -> None:
    program = body(f"DECL {kind} n\nn={value}\nLIN {{X n,Y 2,Z 3,A 4,B 5,C 6}}\n")
    assert [f.code for f in program.toolpath.constraints.refused.values()] == ["KRL002"]


def test_an_exit_ends_no_loop_of_the_caller() -> None:
    path = read(
        f"DEF part()\n{FRAMES}DECL INT i\nFOR i=1 TO 3\nsub()\nENDFOR\nEND\nDEF sub()\nEXIT\n{LINE}END\n"
    )
    assert path.toolpath.line.tolist() == [11, 11, 11]


FIELDS = ("base ", "tool ")


def known(program: Program) -> dict[int, set[tuple[str, ...]]]:
    """Line -> the frames and positions of its rows, as far as they are known."""
    found: dict[int, set[tuple[str, ...]]] = {}
    path = program.toolpath
    for row, text in enumerate(path.dump()):
        words = [text.partition(name)[2].split(" tool ")[0].split(" ")[0] for name in FIELDS]
        if row not in path.constraints.refused:
            words += np.round(path.position[row], 6).astype(str).tolist()
        found.setdefault(int(path.line[row]), set()).update(enumerate(words))
    return found


BLOCKS = (
    "GOTO IN\nLOOP\nBAS(#BASE,3)\nIN:\nLIN {X 1,Y 0,Z 0,A 0,B 0,C 0}\nIF $IN[1] THEN\nEXIT\nENDIF\nENDLOOP\n",
    "GOTO IN\nWHILE $IN[2]\nn=n+1\nIN:\nBAS(#TOOL,n)\nLIN {X 2,Y 0,Z 0,A 0,B 0,C 0}\nENDWHILE\n",
    "FOR n=1 TO 3\nBAS(#BASE,n)\nLIN {X n,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\nBAS(#BASE,n)\n",
    "REPEAT\nLIN {X 1,Y 0,Z 0,A 0,B 0,C 0}\nIF $IN[1] THEN\nGOTO OUT\nENDIF\nBAS(#TOOL,2)\nUNTIL $IN[2]\nOUT:\n",
    "n=1\nLOOP\nn=n+1\nIF n>4 THEN\nEXIT\nENDIF\nBAS(#TOOL,n)\nLIN {X n,Y 0,Z 0,A 0,B 0,C 0}\nENDLOOP\n",
)


@pytest.mark.parametrize("limit", [0, 5, 20])
@pytest.mark.parametrize("name", ["BUDGET", "MOST_STEPS"])
def test_who_follows_less_knows_less_and_nothing_else(
    name: str, limit: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of every two blocks behind and within each other: what is still known is what is known with all steps."""
    last = "LIN {X 9,Y 0,Z 0,A 0,B 0,C 0}\n"
    behind = [
        block.replace("IN\n", "HERE\n").replace("IN:", "HERE:").replace("OUT", "THERE") for block in BLOCKS
    ]
    texts = [f"DECL INT n\nn=1\n{one}{last}{other}{last}" for one in BLOCKS for other in behind]
    texts += [f"DECL INT n\nn=1\nLOOP\n{one}ENDLOOP\n{last}" for one in BLOCKS]
    whole = [known(body(text)) for text in texts]
    for module in (block_flow, open_blocks, program_flow):
        if hasattr(module, name):
            monkeypatch.setattr(module, name, limit - 50 * (name == "MOST_STEPS"))
    fewer = 0
    for text, every in zip(texts, whole, strict=True):
        less = known(body(text))
        for line, words in less.items():
            unknown = {word for word in words if word[1] in ("?", "nan")}
            assert words - unknown <= every[line], text
            fewer += bool(unknown - every[line])
    assert fewer or (name, limit) != ("BUDGET", 0)
