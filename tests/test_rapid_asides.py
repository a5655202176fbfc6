"""RAPID: what traps, handlers, functions and calls that are not shown run too; where the robot stands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.core.flow_runner import FlowRunner
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.rapid.parsing import ModuleParser
from postproc.languages.rapid.program_state import ProgramState
from postproc.languages.rapid.routine_graph import RoutineGraph

EXTRA = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"
HEAD = f"""MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
CONST robtarget p:=[[1,2,3],[0,0,1,0],{EXTRA}];
VAR num n:=1;
"""
AT = "MoveL Offs(p,n,0,0),v50,z10,t;"
SUB = f"PROC sub()\n{AT}\nENDPROC\n"


def read(text: str) -> Program:
    raw = f"{HEAD}{text}ENDMODULE\n".encode()
    return DIALECTS["rapid"].read((Document(Path("part.mod"), raw),))


def row_of(program: Program, words: str) -> int:
    """The row of the first motion with these words in its line."""
    lines = program.documents[0].raw.decode().split("\n")
    return next(row for row, line in enumerate(program.toolpath.line.tolist()) if words in lines[line - 1])


AROUND = {
    "a trap": ("", "TRAP tr\nsub;\nENDTRAP\n"),
    "a handler": ("", "ERROR\nsub;\nTRYNEXT;\n"),
    "a function": ("n:=f(1);\n", "FUNC num f(num a)\nn:=7;\nsub;\nRETURN 2;\nENDFUNC\n"),
    "a text": ('n:=7;\n%"sub"%;\n', ""),
}


@pytest.mark.parametrize("name", AROUND)
def test_a_motion_that_something_else_runs_too_has_no_constant_target(name: str) -> None:
    within, after = AROUND[name]
    handler = after if after.startswith("ERROR") else ""
    program = read(
        f"PROC main()\nn:=2;\nsub;\n{within}n:=5;\n{handler}ENDPROC\n{SUB}{after if not handler else ''}"
    )
    refused = program.toolpath.constraints.refused
    assert refused[row_of(program, "Offs")].code == "RAP002"


def test_a_routine_that_calls_itself_has_several_values_of_its_parameters() -> None:
    program = read(
        "PROC main()\nsub 3;\nENDPROC\nPROC sub(num k)\nMoveL Offs(p,k,0,0),v50,z10,t;\nIF k>0 sub k-1;\nENDPROC\n"
    )
    assert program.toolpath.constraints.refused[0].code == "RAP002"
    assert any("calls itself" in finding.message for finding in program.findings)


@pytest.mark.parametrize("within", ["MoveL p,v50,fine,t;", "elsewhere;"])
def test_a_handler_that_moves_the_robot_leaves_it_elsewhere(within: str) -> None:
    arc = f"MoveC [[9,9,3],[0,0,1,0],{EXTRA}],[[5,5,3],[0,0,1,0],{EXTRA}],v50,fine,t;"
    text = "PROC main()\nMoveL p,v50,fine,t;\nWaitDI di1,1\\MaxTime:=5;\n{}\n{}ENDPROC\n"
    path = read(text.format(arc, f"ERROR\n{within}\nTRYNEXT;\n")).toolpath
    assert path.constraints.refused[1].code == "RAP012"
    assert not path.continues[1]
    kept = read(text.format(arc, f"ERROR\nStorePath;\n{within}\nRestoPath;\nRETRY;\n")).toolpath
    assert 1 not in kept.constraints.refused
    backward = read(text.format(arc, f"BACKWARD\n{within}\n")).toolpath
    assert backward.continues[1]


def test_a_call_that_is_tried_again_starts_where_it_was_left() -> None:
    sub = f"PROC sub()\nn:=n+1;\nMoveL p,v50,z10,t;\n{AT}\nWaitDI di1,1\\MaxTime:=1;\nENDPROC\n"
    text = "PROC main()\nMoveL p,v50,fine,t;\nn:=1;\nsub;\n{}ENDPROC\n"
    once = read(text.format("") + sub).toolpath
    assert once.continues[1]
    assert not once.constraints.refused
    again = read(text.format("ERROR\nRETRY;\n") + sub).toolpath
    assert again.predecessors[1] == (-2, 0)
    assert again.constraints.refused[2].code == "RAP002"


def test_runs_of_lines_start_anywhere_where_a_trap_moves_the_robot() -> None:
    lines = "".join(f"MoveL [[{x},0,0],[0,0,1,0],{EXTRA}],v50,z1,t;\n" for x in range(20))
    trap = "TRAP tr\nMoveL p,v50,fine,t;\nENDTRAP\n"
    path = read(f"PROC main()\n{lines}ENDPROC\n{trap}").toolpath
    assert not path.continues[:20].any()
    assert path.predecessors[7] == (-2, 6)
    assert read(f"PROC main()\n{lines}ENDPROC\n").toolpath.continues[:20].all()


@pytest.mark.parametrize("name", ['"change"', "texts{1}"])
def test_what_a_motion_calls_at_its_end_may_change_data(name: str) -> None:
    program = read(
        f"PROC main()\nMoveLSync p,v50,z10,t,{name};\n{AT}\nENDPROC\nPROC change()\nn:=5;\nENDPROC\n"
    )
    assert program.toolpath.constraints.refused[1].code == "RAP002"
    assert [finding.code for finding in program.findings].count("RAP010") == (name != '"change"')


@pytest.mark.parametrize(
    ("zone", "size", "stops"),
    [
        ("z10\\Inpos:=inpos50", 0.0, True),
        ("z10\\Inpos:=stoptime0_5", 0.0, True),
        ("z10\\Inpos:=own", 0.0, True),
        ("z10\\Inpos:=fllwtime0_5", np.nan, False),
        ("fine\\Inpos:=elsewhere", np.nan, False),
        ("z10", 10.0, False),
    ],
)
def test_stop_point_data_takes_the_place_of_the_zone(zone: str, size: float, stops: bool) -> None:
    own = 'PERS stoppointdata own:=[inpos,TRUE,[20,20,0,0],0,0,"",0,0];\n'
    path = read(
        f"{own}PROC main()\nMoveL p,v50,{zone},t;\nMoveL Offs(p,1,0,0),v50,fine,t;\nENDPROC\n"
    ).toolpath
    np.testing.assert_allclose(path.approximation[0] * 1e3, size)
    assert bool(path.stops[0]) is stops


@pytest.mark.parametrize(
    ("concurrent", "wait", "size"),
    [("", "1", 0.0), ("\\Conc,", "1", np.nan), ("\\Conc,", "\\InPos,1", 0.0)],
)
def test_a_wait_beside_a_motion_may_be_over_before_it(concurrent: str, wait: str, size: float) -> None:
    text = f"PROC main()\nMoveL {concurrent}p,v50,z10,t;\nWaitTime {wait};\nMoveL Offs(p,1,0,0),v50,fine,t;\nENDPROC\n"
    np.testing.assert_allclose(read(text).toolpath.approximation[0], size)


def test_nothing_is_inserted_before_a_comment_that_several_others_may_precede() -> None:
    lines = "".join(f"MoveL Offs(p,{x},0,0),v50,fine,t; ! FORCE {x} 0 0\n" for x in (1, 2, 3))
    path = read(
        f"PROC main()\nMoveL p,v50,fine,t;\nMoveL Offs(p,0,9,0),v50,fine,t;\nWHILE di1=1 DO\n{lines}ENDWHILE\nENDPROC\n"
    )
    held = path.toolpath.constraints.no_insert_before
    assert "paths" in held[2] or "comment" in held[2]
    assert 3 not in held
    # of a loop that is unrolled the comment follows another one in the first pass than in the second
    unrolled = read(
        "PROC main()\n! FORCE 9 0 0\nMoveL p,v50,fine,t;\nFOR i FROM 1 TO 2 DO\nMoveL Offs(p,0,9,0),v50,fine,t;\n"
        "MoveL p,v50,fine,t; ! FORCE 1 0 0\nMoveL Offs(p,1,0,0),v50,fine,t; ! FORCE 2 0 0\nENDFOR\nENDPROC\n"
    ).toolpath.constraints.no_insert_before
    assert "comment" in unrolled[2]
    assert 3 not in unrolled
    straight = read(
        f"PROC main()\nMoveL p,v50,fine,t;\n{lines}ENDPROC\n"
    ).toolpath.constraints.no_insert_before
    assert sorted(straight) == [0]


def test_a_long_block_is_not_run_again_with_the_same_state() -> None:
    within = "n:=n+1;\n" * 20
    text = f"{HEAD}PROC main()\nWHILE di1=1 DO\nFOR i FROM 1 TO n DO\n{within}ENDFOR\nENDWHILE\nENDPROC\nENDMODULE\n"
    graph = RoutineGraph(ModuleParser(text.encode()).file().routines[0].body)
    ran: list[int] = []
    version = 0

    def after(_: RoutineGraph, at: int, state: ProgramState) -> list[tuple[int, ProgramState]]:
        block = graph.blocks[at]
        ran.append(len(block.steps))
        return [
            (to, state) for to in ((block.follow, block.otherwise) if block.condition else (block.follow,))
        ]

    runner = FlowRunner(after, lambda: version)
    for count in (1, 1, 2, 3):
        version = int(count == 2)
        runner.start()
        runner.run(graph, ProgramState(), count == 3)
        assert ran.count(21) == count


def test_a_symbol_that_may_have_been_meant_is_named() -> None:
    text = f"MODULE m\nPROC main()\nMoveL [[1,2,3],[0,0,1,0],{EXTRA}],v50,z1,tSpindle;\nENDPROC\nENDMODULE\n"
    for symbol, named in (("TSPINDEL", True), ("WPART", False)):
        settings = ReadingSettings(symbols={symbol: 1.0})
        program = DIALECTS["rapid"].read((Document(Path("part.mod"), text.encode()),), settings)
        assert (f"the cell has the symbol {symbol}" in program.findings[0].message) is named


HUGE = "[1E200,-1E308,1]"


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "motion",
    [
        f"MoveL [[1,2,3],[0,0,1E200,1E308],{EXTRA}],v50,z10,t;",
        f"MoveL RelTool([[1,2,3],[0,0,1E200,1E308],{EXTRA}],1,1,1),v50,z10,t;",
        "MoveL p,v50,z10,[TRUE,[[0,0,200],[1E308,1,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];",
        f"q:=[[1,2,3],NOrient([1E200,1E308,0,0]),{EXTRA}];MoveL q,v50,z10,t;",
        f"MoveL [{HUGE},[0,0,1,0],{EXTRA}],v50,z10,t;",
        f"MoveC [{HUGE},[0,0,1,0],{EXTRA}],p,v50,z10,t;",
        "MoveL RelTool(p,1E308,1E308,1E308),v50,z10,t;",
        "MoveL RelTool(p,1,1,1\\Rx:=1E308),v50,z10,t;",
    ],
)
def test_numbers_that_no_robot_has_are_refused_without_a_warning_of_numpy(motion: str) -> None:
    path = read(f"VAR robtarget q;\nPROC main()\nMoveL p,v50,fine,t;\n{motion}\nENDPROC\n").toolpath
    assert 1 in path.constraints.refused


def test_a_symbol_of_the_cell_is_that_of_the_argument() -> None:
    """A routine may give it a name that means another frame in the cell."""
    settings = ReadingSettings(symbols={"TSPINDLE": 1.0, "TOTHER": 2.0, "TOOL": 3.0})

    def tools(main: str, parameter: str) -> list[int | str | None]:
        text = (
            f"MODULE m\nPROC main()\n{main}\nENDPROC\nPROC cut(PERS tooldata {parameter})\n"
            f"MoveL [[1,2,3],[0,0,1,0],{EXTRA}],v50,z1,{parameter};\nENDPROC\nENDMODULE\n"
        )
        path = DIALECTS["rapid"].read((Document(Path("part.mod"), text.encode()),), settings).toolpath
        refused = path.constraints.refused
        return [
            refused[row].code if row in refused else path.frames[path.tool[row]].number
            for row in range(len(path))
        ]

    for parameter in ("tool", "tSpindle", "tl"):
        assert tools("cut tSpindle;", parameter) == [1]
        assert tools("cut tOther;", parameter) == [2]
        assert tools("cut tool0;", parameter) == [0]
        assert tools("cut tSpindle;\ncut tOther;", parameter) == ["RAP005"]


@pytest.mark.parametrize(
    "assigned",
    [
        "tSpindle.tframe.trans.z:=5;",
        "tSpindle:=[TRUE,[[0,0,1],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];",
        "change tSpindle;",
    ],
)
def test_a_tool_that_the_cell_states_and_the_program_assigns(assigned: str) -> None:
    text = (
        f"MODULE m\nPROC main()\n{assigned}\nMoveL [[1,2,3],[0,0,1,0],{EXTRA}],v50,z1,tSpindle;\nENDPROC\n"
        "PROC change(PERS tooldata tl)\ntl.tframe.trans.z:=5;\nENDPROC\nENDMODULE\n"
    )
    settings = ReadingSettings(symbols={"TSPINDLE": 1.0})
    path = DIALECTS["rapid"].read((Document(Path("part.mod"), text.encode()),), settings).toolpath
    assert path.constraints.refused[0].code == "RAP005"


AT_START = {
    "VelSet 100,5000;": "VelSet 100,800;",
    "SingArea\\Off;": "SingArea\\Wrist;",
    "ConfL\\On;": "ConfL\\Off;",
    "ConfJ\\On;": "ConfJ\\Off;",
    "CirPathMode\\PathFrame;": "CirPathMode\\ObjectFrame;",
}
"""What is in force where a program starts, and another thing."""
ASIDE = {
    "trap": "PROC main()\nCONNECT i WITH tr;\nMoveL p,v50,z10,t;\nENDPROC\nTRAP tr\n{}\nENDTRAP\n",
    "handler": "PROC main()\nMoveL p,v50,z10,t;\nERROR\n{}\nTRYNEXT;\nENDPROC\n",
}


@pytest.mark.parametrize("aside", ASIDE)
@pytest.mark.parametrize("stated", AT_START)
def test_a_trap_that_states_what_is_in_force_anyway_changes_nothing(stated: str, aside: str) -> None:
    text = ASIDE[aside]
    program = read(text.format(stated))
    assert list(program.toolpath.constraints.refused) == []
    assert list(program.toolpath.dump()) == list(read(text.format("")).toolpath.dump())
    assert list(read(text.format(AT_START[stated])).toolpath.constraints.refused) == [0]


@pytest.mark.parametrize("aside", ASIDE)
@pytest.mark.parametrize("stated", AT_START)
def test_a_trap_that_returns_to_what_the_program_changed_is_not_passed_over(stated: str, aside: str) -> None:
    before = f"PROC main()\n{AT_START[stated]}"
    program = read(ASIDE[aside].format(stated).replace("PROC main()", before))
    assert list(program.toolpath.constraints.refused) == [0]
