"""What a program may change where, and the bounds up to which it is followed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from test_krl_readings import CASES, FULL, HEAD

from postproc.base.document import Document
from postproc.base.units import MM
from postproc.languages.core.motion_sources import FEW, Meeting, Source, together
from postproc.languages.dialect import Program
from postproc.languages.krl import KrlDialect, block_flow, motions, open_blocks, program_flow
from postproc.languages.krl.calls import MOST_CALLS
from postproc.languages.krl.external_axes import carried_on, reached, stated
from postproc.languages.krl.lexing import LONGEST, Statement
from postproc.languages.krl.motion_rows import NAN6, NO_ARC, MotionRow, MotionRows, RowRefusal
from postproc.languages.krl.program_blocks import Block, Routine
from postproc.languages.krl.program_structure import (
    DEEPEST,
    MOST_EFFECTS,
    ProgramStructure,
    program_structure,
)
from postproc.languages.krl.scan import FEWEST, MOST, scan
from postproc.languages.krl.statement_effects import MODAL, Effects

POINT = FULL.decode()
LINE = f"LIN {POINT}\n"


def surveyed(text: str) -> tuple[ProgramStructure, list[Statement]]:
    items = [
        item for item in scan(Document(Path("a.src"), text.encode()), False) if isinstance(item, Statement)
    ]
    return program_structure(enumerate(items)), items


def names(effects: Effects | set[bytes]) -> str:
    return " ".join(sorted(e.decode() if isinstance(e, bytes) else e for e in effects)) or "-"


def told(text: str) -> Iterator[str]:
    found, items = surveyed(text)

    def line(index: int) -> int:
        return items[index].line

    for block in found.blocks:
        out = f"{block.word.decode()} {block.line}-{line(block.end)}"
        out += (
            "".join(f"|{line(at)}" for at in block.branches)
            + " broken" * block.broken
            + " leaves" * block.leaves
        )
        yield f"{out}: {names(block.effects)} calls {names(block.calls)}"
        if isinstance(block, Routine):
            out = f"  {block.name.decode()}" + " main" * block.is_main + " function" * block.is_function
            out += " (" + ",".join(name.decode() + "*" * back for name, back in block.parameters) + ") "
            out += (
                ",".join(f"{name.decode()}:{kind.decode()}" for name, kind in block.types.items())
                + " labels "
            )
            labels = (
                f"{name.decode()}@{line(at)}" + "".join(f"/{outer.line}" for outer in around)
                for name, (at, around) in block.labels.items()
            )
            yield (out + ",".join(labels)).rstrip()
    events = (
        f"{line(at)}:" + ",".join(f"{what} {block.line}" for what, block in found.events[at])
        for at in sorted(found.events)
    )
    yield ("events " + " ".join(events)).rstrip()
    yield (
        f"assigned {names(found.assigned)}; read {names(found.read)}; later {names(found.later)}; "
        f"changed {names(found.effects)}"
    )
    jumps = " ".join(f"{name.decode()}:{line(a)}-{line(b)}" for (_, name), (a, b) in found.jumps.items())
    yield f"jumps {jumps}".rstrip()
    yield f"inline {sorted(found.inline)} unclosed {found.unclosed}"


@pytest.mark.parametrize("name", [name for name in CASES if "surveyed" in CASES[name]])
def test_a_program_is_surveyed_as_it_is_told(name: str) -> None:
    assert list(told(CASES[name][""])) == CASES[name]["surveyed"].strip("\n").splitlines()


@pytest.mark.parametrize("deep", [1, DEEPEST, DEEPEST + 1, DEEPEST + 5])
def test_blocks_are_told_apart_up_to_a_depth(deep: int) -> None:
    """What lies deeper belongs to the last that is told apart, and all of them end."""
    text = "DEF a()\n" + "".join(f"IF v{i} THEN\n" for i in range(deep)) + "ELSE\nn=1\n" + "ENDIF\n" * deep
    found, _ = surveyed(text + "m=1\nEND\n")
    assert found.unclosed == []
    assert len(found.blocks) == 1 + min(deep, DEEPEST)
    assert len(found.blocks[-1].branches) == (deep <= DEEPEST)
    assert {block.start + block.end for block in found.blocks[1:]} == {2 * deep + 3}
    assert names(found.blocks[-1].effects) == "N"
    assert names(found.blocks[0].effects) == "M N"


@pytest.mark.parametrize("count", [MOST_EFFECTS, MOST_EFFECTS + 1])
def test_what_a_block_changes_is_told_apart_up_to_a_number(count: int) -> None:
    """Tool and position count besides the variables."""
    many = count > MOST_EFFECTS
    body = "".join(f"v{i}=1\n" for i in range(count - 2)) + "LIN P\nBAS(#TOOL,1)\n"
    found, _ = surveyed(f"DEF a()\nIF x THEN\n{body}ENDIF\nEND\n")
    changed = found.blocks[1].effects
    assert changed == ({"tool", "point", "all"} if many else {"tool", "point"} | found.assigned)
    head = "INTERRUPT DECL 3 WHEN $IN[1] DO b()\n"
    found, _ = surveyed(f"{head}DEF a()\nother.X=1\nEND\nDEF b()\n{body}END\n")
    assert b"V0" in found.later
    assert (b"OTHER" in found.later) == many


@pytest.mark.parametrize("count", [MOST_EFFECTS, MOST_EFFECTS + 1])
def test_calls_are_told_apart_up_to_a_number_of_routines(count: int) -> None:
    subs = "".join(f"DEF s{i}()\nv{i}=1\nEND\n" for i in range(count - 1))
    found, _ = surveyed(f"DEF a()\nIF x THEN\ns0()\nENDIF\nIF x THEN\ny=1\nENDIF\nEND\n{subs}")
    called, other = found.blocks[1:3]
    assert names(other.effects) == "Y"
    if count > MOST_EFFECTS:
        assert called.effects >= {"all", "point", *MODAL}
    else:
        assert names(called.effects) == "V0"


def program(text: str, rest: str = "") -> Program:
    raw = f"{HEAD}DECL INT i,j\n{text}END\n{rest}"
    return KrlDialect().read((Document(Path("part.src"), raw.encode()),))


def xs(found: Program) -> list[float]:
    path = found.toolpath
    return [
        round(x, 6) for row, x in enumerate(path.position[:, 0] / MM) if row not in path.constraints.refused
    ]


def codes(found: Program) -> list[str]:
    return [f"{one.line} {one.code}" for one in found.findings]


@pytest.fixture
def budget(monkeypatch: pytest.MonkeyPatch) -> int:
    for module in block_flow, open_blocks, program_flow:
        monkeypatch.setattr(module, "BUDGET", 12)
    return 12


@pytest.mark.usefixtures("budget")
@pytest.mark.parametrize(
    ("text", "rest", "followed"),
    [
        # once more, a FOR of two lines runs two statements
        ("FOR i=1 TO 7\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\n", "", True),
        ("FOR i=1 TO 8\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\n", "", False),
        ("FOR i=7 TO 1 STEP -1\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\n", "", True),
        ("FOR i=8 TO 1 STEP -1\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\n", "", False),
        ("FOR i=1 TO 15 STEP 2\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\n", "", False),
        ("FOR i=1 TO 14 STEP 2\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\n", "", True),
        # the second has what the first leaves
        ("FOR i=1 TO 4\nENDFOR\nFOR i=1 TO 5\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\n", "", True),
        ("FOR i=1 TO 5\nENDFOR\nFOR i=1 TO 5\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\n", "", True),
        ("FOR i=1 TO 6\nENDFOR\nFOR i=1 TO 5\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\n", "", False),
        # three statements a turn
        ("i=0\nWHILE i<5\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\ni=i+1\nENDWHILE\n", "", True),
        ("i=0\nWHILE i<6\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\ni=i+1\nENDWHILE\n", "", False),
        ("i=0\nREPEAT\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\ni=i+1\nUNTIL i>=5\n", "", True),
        ("i=0\nREPEAT\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\ni=i+1\nUNTIL i>=6\n", "", False),
        # a run of lines counts as its lines, a branch as one
        (f"i=0\nREPEAT\n{LINE * 9}LIN {{X i,Y 0,Z 0,A 0,B 0,C 0}}\ni=i+1\nUNTIL i>=2\n", "", True),
        (f"i=0\nREPEAT\n{LINE * 10}LIN {{X i,Y 0,Z 0,A 0,B 0,C 0}}\ni=i+1\nUNTIL i>=2\n", "", False),
        # a case that does not hold counts, four statements a turn
        ("i=0\nREPEAT\nSWITCH 9\n" + "CASE 1\n" * 4 + "ENDSWITCH\ni=i+1\nUNTIL i>=2\n", "", True),
        ("i=0\nREPEAT\nSWITCH 9\n" + "CASE 1\n" * 5 + "ENDSWITCH\nLIN {X i}\ni=i+1\nUNTIL i>=2\n", "", False),
        # a call: its variables, those of the caller, and from the second on three statements
        ("sub()\nsub()\n", f"DEF sub()\n{LINE}$OUT[1]=TRUE\nEND\n", True),
        ("sub()\nsub()\nsub()\n", f"DEF sub()\n{LINE}$OUT[1]=TRUE\nEND\n", True),
        ("sub()\nsub()\nsub()\n", f"DEF sub()\nINT k\n{LINE}LIN {{X 5}}\nEND\n", False),
        # five statements a jump, from the second on
        ("i=0\nup:\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\ni=i+1\nIF i<4 THEN\nGOTO up\nENDIF\n", "", True),
        ("i=0\nup:\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\ni=i+1\nIF i<5 THEN\nGOTO up\nENDIF\n", "", False),
    ],
)  # fmt: skip
def test_statements_are_followed_again_up_to_a_number(text: str, rest: str, followed: bool) -> None:
    found = program(text, rest)
    assert (not found.toolpath.constraints.refused) == followed
    assert any(one.code == "KRL024" for one in found.findings) == (not followed and "GOTO" not in text)


@pytest.mark.usefixtures("budget")
def test_where_too_much_runs_is_told_and_passed_over() -> None:
    """The outermost loop or call; what it changed is taken back, and the rest is followed."""
    inner = f"j=0\nREPEAT\n{LINE}j=j+1\nUNTIL j>2\n"
    found = program(
        f"IF TRUE THEN\ni=0\nWHILE i<3\n{inner}i=i+1\nENDWHILE\nLIN {{X 5}}\nENDIF\n{LINE}LIN {{X 6}}\n"
    )
    assert codes(found) == ["7 KRL024", "15 KRL004"]
    assert (
        found.findings[0].message
        == "it executes more than the 12 statements that are followed; its passes are not distinguished"
    )
    assert xs(found) == [1, 1, 6]
    found = program("FOR i=1 TO 9\nLIN {X i,Y 0,Z 0,A 0,B 0,C 0}\nENDFOR\n" + LINE)
    assert codes(found) == ["5 KRL024", "6 KRL002"]
    assert xs(found) == [1]
    found = program("FOR i=1 TO 9\n$OUT[i]=TRUE\nENDFOR\n" + LINE)
    assert codes(found) == []
    found = program("sub()\n" * 4 + LINE, f"DEF sub()\nINT k\n{LINE}$OUT[1]=TRUE\nEND\n")
    assert [code.split()[1] for code in codes(found)] == ["KRL024", "KRL015", "KRL005"]


@pytest.mark.parametrize("deep", [1, MOST_CALLS, MOST_CALLS + 1])
def test_calls_inside_of_one_another_are_followed_up_to_a_number(deep: int) -> None:
    sub = "DEF again(n:IN)\nINT n\nLIN {X n,Y 0,Z 0,A 0,B 0,C 0}\n"
    found = program("again(1)\n", sub + f"IF n<{deep} THEN\nagain(n+1)\nENDIF\nEND\n")
    if deep > MOST_CALLS:
        assert [code.split()[1] for code in codes(found)] == ["KRL015", "KRL002"]
    else:
        assert xs(found) == list(range(1, deep + 1))


@pytest.mark.parametrize("length", [LONGEST, LONGEST + 1])
def test_motions_are_taken_apart_up_to_a_length(length: int) -> None:
    line = LINE.strip()[:-1]
    found = program(line + " " * (length - len(line) - 1) + "}\nLIN {X 2}\n").toolpath
    messages = {row: one.message for row, one in found.constraints.refused.items()}
    if length > LONGEST:
        assert messages == {
            0: "'LIN {X 1,Y 2,Z 3,A 4,B 5,C 6         ...' is not understood",
            1: "the point omits Y, Z, A, B, C, and the position is not known: after the motion in line 5",
        }
    else:
        assert messages == {}


@pytest.mark.usefixtures("budget")
def test_what_is_passed_over_does_not_count() -> None:
    """Though it was followed before."""
    body = f"{LINE}$OUT[1]=TRUE\n$OUT[2]=TRUE\ni=i+1\nIF i==2 THEN\ni=$IN[1]\nENDIF\n"
    found = program(
        f"i=0\nWHILE i<9\n{body}ENDWHILE\nFOR j=1 TO 2\nLIN {{X j,Y 0,Z 0,A 0,B 0,C 0}}\nENDFOR\n"
    )
    assert codes(found) == []
    assert xs(found) == [1, 1, 2]


@pytest.mark.parametrize(
    ("count", "sizes"),
    [
        (FEWEST - 1, [1] * (FEWEST - 1)), (FEWEST, [FEWEST]), (MOST, [MOST]), (MOST + 2, [MOST, 1, 1]),
        (MOST + FEWEST, [MOST, FEWEST]),
    ],
)  # fmt: skip
def test_common_lines_are_read_together(count: int, sizes: list[int]) -> None:
    """The first of them has the number of its line."""
    items = list(scan(Document(Path("a.src"), f"x=1\n{LINE * count}".encode()), True))[1:]
    assert [1 if isinstance(item, Statement) else len(item) for item in items] == sizes
    assert [item.line for item in items] == np.cumsum([2, *sizes])[:-1].tolist()


# rows


def row(line: int) -> MotionRow:
    return MotionRow(1, line, (0, 1, 2, 3), NAN6, NAN6, 0.0, 0, 0, 0.0, None, 0, NO_ARC)


def test_few_places_are_kept_apart_and_many_are_one() -> None:
    few: frozenset[Source] = frozenset(range(FEW))
    assert together(few) == few
    many: frozenset[Source] = frozenset(range(FEW + 1))
    meetings = [next(iter(together(frozenset([*many, last])))) for last in (50, 51)]
    assert meetings[0] != meetings[1]
    assert [one.sources for one in meetings if isinstance(one, Meeting)] == [many | {50}, many | {51}]


def test_rows_are_taken_out_from_any_on() -> None:
    """As if only those before had been added, alone or in runs."""
    raw = (LINE * 9 + "HALT\n").encode()
    bulk = next(iter(scan(Document(Path("a.src"), raw), True)))
    assert not isinstance(bulk, Statement)

    def filled(stop: int) -> MotionRows:
        rows = MotionRows(Document(Path("a.src"), raw))
        for at in range(6):
            if rows.count < stop:
                rows.add(row(at), None)
            for sparse in (
                rows.anchors, rows.reasons, rows.variables, rows.locked, rows.arcs, rows.relative,
                rows.no_insert_before, rows.approximated, rows.builds_on,
            ):  # fmt: skip
                if at < stop and at % 2:
                    sparse[at] = at  # type: ignore[index, assignment]
        return rows

    for stop in range(7):
        rows = filled(6)
        rows.truncate(stop)
        wanted = filled(stop)
        assert rows == wanted or (stop == 0 and rows.chunks == [])
        assert len(rows) == stop

    rows = MotionRows(Document(Path("a.src"), raw))
    state = motions.ModalState()
    rows.add(row(0), None)
    assert rows.add_vectorised(bulk, state, RowRefusal("KRL006", "why")) == 9
    rows.add(row(10), None)
    rows.add(row(11), None)
    assert rows.add_vectorised(bulk, state, None) == 20
    assert rows.ranges == [(1, 10, RowRefusal("KRL006", "why"))]
    for stop, chunks in (12, 3), (11, 3), (10, 2):
        rows.truncate(stop)
        assert (len(rows), len(rows.chunks), len(rows.ranges)) == (stop, chunks, 1)
    rows.truncate(1)
    assert (len(rows), len(rows.chunks), rows.ranges) == (1, 1, [])


def test_external_axes_stand_where_the_last_motion_put_them() -> None:
    """What a target leaves out stays; a step goes on from a place that is known, and from no other."""
    inf, nan = np.inf, np.nan
    said = ((b"E1", 1.5, b""), (b"E3", None, b""), (b"E6", -2.0, b""))
    np.testing.assert_array_equal(stated(said), [1.5, nan, inf, nan, nan, -2.0])
    before = (1.0, 2.0, inf, -inf, nan, 6.0)
    steps = tuple((b"E%d" % i, 0.5, b"") for i in range(1, 7))
    np.testing.assert_array_equal(reached(before, said), [1.5, 2, inf, -inf, nan, -2])
    np.testing.assert_array_equal(reached(before, steps, relative=True), [1.5, 2.5, inf, inf, inf, 6.5])
    still = tuple((key, 0.0, text) for key, _, text in steps)
    np.testing.assert_array_equal(reached(before, still, relative=True), before)
    rows = np.array([[nan, 5, nan, nan, nan, nan], [7, nan, nan, nan, nan, nan], [nan, 6, 1, nan, nan, 0]])
    wanted = [[1, 5, inf, -inf, nan, 6], [7, 5, inf, -inf, nan, 6], [7, 6, 1, -inf, nan, 0]]
    np.testing.assert_array_equal(carried_on(before, rows), wanted)
    np.testing.assert_array_equal(carried_on(before, np.broadcast_to(rows[0], (4, 6))), wanted[0])
    assert carried_on(before, None) is before


def test_a_block_of_a_program_without_routines_is_closed() -> None:
    found, _ = surveyed("IF x THEN\nn=1\nENDIF\n")
    assert [(block.word, block.start, block.end) for block in found.blocks] == [(b"", 0, 2), (b"IF", 0, 2)]
    assert isinstance(found.blocks[0], Block)
