"""What interrupts, triggers and routines that are not read may change: nothing is claimed that they can undo."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.krl import KrlDialect, interpreter

FULL = "{X 1,Y 2,Z 3,A 4,B 5,C 6}"
MOVED = "{X 9,Y 0,Z 0,A 0,B 0,C 0}"
HEAD = "DEF part()\nDECL FRAME Q\nBAS(#BASE,1)\nBAS(#TOOL,1)\n$VEL.CP=0.1\n$APO.CDIS=3\n"
WHEN = {
    "interrupt": "INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO {}\nINTERRUPT ON 3\n",
    "global interrupt": "GLOBAL INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO {}\nINTERRUPT ON 3\n",
    "trigger": "TRIGGER WHEN DISTANCE=0 DELAY=0 DO {} PRIO=-1\n",
}
CONFIG = f"DEFDAT $CONFIG PUBLIC\nDECL GLOBAL FRAME P={FULL}\nENDDAT\n"


def read(text: str, **siblings: str) -> Program:
    """``siblings``: modules by their names."""
    files = {"$config.dat": CONFIG, **{f"{name}.src": body for name, body in siblings.items()}}
    others = tuple(Document(Path(name), body.encode()) for name, body in files.items())
    document = Document(Path("part.src"), text.encode())
    return KrlDialect().read((document,), ReadingSettings(siblings=others))


CHANGES = {
    "base": ("$BASE=BASE_DATA[3]\n", f"LIN {FULL} C_DIS\n"),
    "tool": ("BAS(#TOOL,3)\n", f"LIN {FULL} C_DIS\n"),
    "turning": ("$ORI_TYPE=#JOINT\n", f"LIN {FULL} C_DIS\n"),
    "root": ("$ROBROOT.X=5\n", f"LIN {FULL} C_DIS\n"),
    "world": ("$WORLD.X=5\n", f"LIN {FULL} C_DIS\n"),
    "table": (f"BASE_DATA[2]={MOVED}\n", f"BASE_DATA[2]={FULL}\n$BASE=BASE_DATA[2]\nLIN {FULL} C_DIS\n"),
    "variable": ("P.X=9\n", "LIN P C_DIS\n"),
    "record": ("FDAT_ACT=FHOME\n", f"LIN {FULL} C_DIS\n"),
}
SPEED = {"feed": "$VEL.CP=0.7\n", "approximation": "$APO.CDIS=9\n", "advance run": "$ADVANCE=0\n"}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("when", WHEN)
@pytest.mark.parametrize("where", ["here", "a routine of its own", "another module", "below another module"])
def test_what_may_change_at_any_time_is_not_claimed(change: str, when: str, where: str) -> None:
    does, motion = CHANGES[change]
    later = WHEN[when].format("isr()")
    isr = f"DEF isr()\n{does}END\n"
    if where == "here":
        program = read(f"{HEAD}{later}{motion}END\n{isr}")
        plain = read(f"{HEAD}{motion}END\n{isr}")
    elif where == "a routine of its own":
        program = read(f"{HEAD}{later}{motion}END\nDEF isr()\ninner()\nEND\nDEF inner()\n{does}END\n")
        plain = read(f"{HEAD}{motion}END\nDEF inner()\n{does}END\n")
    elif where == "another module":
        program = read(f"{HEAD}{later}{motion}END\n", isr=isr)
        plain = read(f"{HEAD}{motion}END\n", isr=isr)
    else:
        program = read(f"{HEAD}init()\n{motion}END\n", init=f"DEF init()\n{later}END\n{isr}")
        plain = read(f"{HEAD}init()\n{motion}END\n", init="DEF init()\nEND\n")
    path = program.toolpath
    assert 0 in path.constraints.refused, path.dump()
    if change not in ("table", "variable") or where == "below another module":
        assert 0 not in plain.toolpath.constraints.refused


@pytest.mark.parametrize("change", SPEED)
@pytest.mark.parametrize("where", ["here", "another module"])
@pytest.mark.parametrize("motions", [2, 20])
def test_a_feed_that_may_change_at_any_time_is_none(change: str, where: str, motions: int) -> None:
    """In runs of common lines too, and whatever is set again behind."""
    isr = f"DEF isr()\n{SPEED[change]}END\n"
    later = WHEN["interrupt"].format("isr()")
    again = "$VEL.CP=0.2\n$APO.CDIS=4\n"
    body = f"LIN {FULL} C_DIS\n" * motions
    if where == "here":
        program = read(f"{HEAD}{body}{later}{again}{body}END\n{isr}")
    else:
        program = read(f"{HEAD}{body}init()\n{again}{body}END\n", init=f"DEF init()\n{later}END\n{isr}")
    path = program.toolpath
    assert not path.constraints.refused
    changed, steady = (path.feed, path.approximation)[:: 1 if change == "feed" else -1]
    assert np.isfinite(changed[:motions]).all()
    assert np.isnan(changed[motions : 2 * motions]).all()
    assert np.isfinite(steady[: 2 * motions]).all()


def test_what_is_handed_to_an_interrupt_may_come_back_changed() -> None:
    text = HEAD + f"Q={FULL}\n" + WHEN["interrupt"].format("isr(Q)") + "LIN Q\nEND\n"
    changed = read(text + "DEF isr(R:OUT)\nFRAME R\nR.X=4\nEND\n")
    kept = read(text + "DEF isr(R:IN)\nFRAME R\nR.X=4\nEND\n")
    assert list(changed.toolpath.constraints.refused) == [0]
    assert list(kept.toolpath.constraints.refused) == []


@pytest.mark.parametrize("fast", [True, False])
@pytest.mark.parametrize("motions", [1, 20])
@pytest.mark.parametrize(
    ("between", "why"),
    [
        ("TRIGGER WHEN PATH=0 DELAY=0 DO $OUT[1]=TRUE\n", "TRIGGER"),
        ("change_tool()\n", "CHANGE_TOOL runs before it and is not read"),
        ("IF $IN[1]==TRUE THEN\nchange_tool()\nENDIF\n", "CHANGE_TOOL"),
    ],
)
def test_nothing_is_inserted_behind_what_may_have_moved_the_robot(
    between: str, why: str, motions: int, fast: bool
) -> None:
    """Nor behind a trigger, before a run of common lines either; and before the motion behind that, all may be."""
    run = f"LIN {FULL}\n" * motions
    text = f"{HEAD}LIN {FULL}\n{between}{run}SPLINE\nSPL {FULL}\nENDSPLINE\nEND\n"
    path = interpreter.read((Document(Path("part.src"), text.encode()),), fast=fast).toolpath
    told = path.constraints.no_insert_before
    assert why in told[1]
    assert sorted(told) == [1, 1 + motions]
    assert list(path.constraints.spline_headers) == [1 + motions]


@pytest.mark.parametrize("inner", ["", "inner()\n"])
@pytest.mark.parametrize("when", ["interrupt", "trigger"])
def test_what_a_routine_that_is_not_followed_starts_goes_on(when: str, inner: str) -> None:
    """It knows the variable that it gets by its own name too, so that its parameters are not followed."""
    later = WHEN[when].format("$BASE=BASE_DATA[3]")
    body = f"DEF sub(w:OUT)\nREAL w\nQ.X=w\n{inner or later}LIN {FULL}\nEND\n"
    other = f"DEF inner()\n{later}LIN {FULL}\nEND\n" if inner else ""
    data = Document(Path("part.dat"), b"DEFDAT part\nDECL REAL w2=1\nDECL FRAME Q={X 1}\nENDDAT\n")
    text = f"DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\nLIN {FULL}\nsub(Q.X)\nLIN {FULL}\nEND\n{body}{other}"
    program = KrlDialect().read((Document(Path("part.src"), text.encode()), data))
    after = program.toolpath.line.tolist().index(6)
    refused = program.toolpath.constraints.refused
    assert after in refused
    assert "may change base or tool at any time" in refused[after].message


@pytest.mark.parametrize("by", ["a call", "a function"])
def test_what_another_module_changes_of_its_parameter_later_is_not_claimed(by: str) -> None:
    call, kind, end = {
        "a call": ("sub(r)", "DEF", "END"),
        "a function": ("r=sub(r)", "DEFFCT REAL", "ENDFCT"),
    }[by]
    head = HEAD.replace("DECL FRAME Q\n", "DECL REAL r\n") + f"r=7\n{call}\nr=7\n"
    text = f"{head}LIN {{X r,Y 2,Z 3,A 4,B 5,C 6}}\nEND\n"
    trigger = "TRIGGER WHEN DISTANCE=0 DELAY=0 DO w=9\n"
    later = read(text, sub=f"{kind} sub(w:OUT)\n{trigger}RETURN 1\n{end}\n")
    at_once = read(text, sub=f"{kind} sub(w:OUT)\nw=9\nRETURN 1\n{end}\n")
    assert not later.toolpath.known[0]
    assert at_once.toolpath.known[0]


def test_a_function_that_only_an_interrupt_calls_is_reported_where_it_is_not_read() -> None:
    found = read(
        f"{HEAD}INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO isr(away(2))\nINTERRUPT ON 3\nLIN {FULL}\nEND\n",
        isr="DEF isr(v:IN)\nEND\n",
    )
    assert any(one.code == "KRL010" and "AWAY" in one.message.upper() for one in found.findings)


@pytest.mark.parametrize("given", ["P.X", "r,r"])
def test_what_another_module_leaves_is_not_claimed_where_it_has_two_names_for_a_variable(given: str) -> None:
    """Of the position that it leaves the next motion inherits."""
    start = HEAD.replace("DECL FRAME Q\n", "DECL REAL r\n")
    text = f"{start}r=7\nsub({given})\nLIN {{Y 5}}\nEND\n"
    move = "LIN P\n" if given == "P.X" else "LIN {X v,Y 2,Z 3,A 4,B 5,C 6}\n"
    body = f"DEF sub(v:OUT,w:OUT)\nREAL v,w\nv=3\nw=9\n{move}END\n"
    assert not read(text, sub=body).toolpath.known[-1]
    apart = text.replace("sub(P.X)", "sub(r)").replace("sub(r,r)", "sub(r,3)")
    assert read(apart, sub=body).toolpath.known[-1]


@pytest.mark.parametrize("given", ["r,r", "r,3"])
def test_what_a_function_may_change_under_another_name_is_not_claimed(given: str) -> None:
    """In a routine of which it is not known who calls it: ``w`` may be handed over to be changed, and be ``v``."""
    start = HEAD.replace("DECL FRAME Q\n", "DECL REAL r\n")
    text = f"{start}r=7\nsub({given})\nLIN {{Y 5}}\nEND\n"
    body = (
        "DEF sub(v:OUT,w:OUT)\nREAL v,w\nv=3\nIF grow(w)>0 THEN\nENDIF\nLIN {X v,Y 2,Z 3,A 4,B 5,C 6}\nEND\n"
        "DEFFCT REAL grow(x:OUT)\nREAL x\nx=9\nRETURN 1\nENDFCT\n"
    )
    assert bool(read(text, sub=body).toolpath.known[-1]) is (given == "r,3")


SETTING = {
    "trigger": "TRIGGER WHEN DISTANCE=0 DELAY=0 DO {}\n",
    "path trigger": "TRIGGER WHEN PATH=5 DELAY=10 DO {}\n",
    "interrupt": "INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO {}\nINTERRUPT ON 3\n",
    "assignment": "{}\n",
}


@pytest.mark.parametrize("how", SETTING)
@pytest.mark.parametrize(
    ("variable", "is_reported"), [("$TECH[1].MODE=#CYCLE", True), ("$OUT[3]=TRUE", False)]
)
def test_a_variable_of_unknown_effect_is_reported_however_it_is_set(
    how: str, variable: str, is_reported: bool
) -> None:
    program = read(f"{HEAD}LIN {FULL}\n{SETTING[how].format(variable)}LIN {FULL}\nEND\n")
    codes = [finding.code for finding in program.findings]
    assert codes.count("KRL037") == is_reported


@pytest.mark.parametrize(
    ("statement", "routine", "siblings"),
    [
        ("change($TECH.CLASS)\n", "DEF change(A:OUT)\nINT A\nA=1\nEND\n", {}),
        (
            "IF change($TECH.CLASS) THEN\nENDIF\n",
            "DEFFCT BOOL change(A:OUT)\nINT A\nA=1\nRETURN TRUE\nENDFCT\n",
            {},
        ),
        (WHEN["trigger"].format("change($TECH.CLASS)"), "DEF change(A:OUT)\nINT A\nA=1\nEND\n", {}),
        ("change($TECH.CLASS)\n", "", {"change": "DEF change(A:OUT)\nINT A\nA=1\nEND\n"}),
        ("change()\n", "", {"change": "DEF change()\n$TECH.CLASS=1\nEND\n"}),
        (
            "change()\n",
            "",
            {"change": "DEF change()\ninner()\nEND\n", "inner": "DEF inner()\n$TECH.CLASS=1\nEND\n"},
        ),
        (WHEN["trigger"].format("change()"), "", {"change": "DEF change()\n$TECH.CLASS=1\nEND\n"}),
    ],
)
def test_a_variable_of_unknown_effect_is_reported_whatever_routine_sets_it(
    statement: str, routine: str, siblings: dict[str, str]
) -> None:
    program = read(f"{HEAD}LIN {FULL}\n{statement}LIN {FULL}\nEND\n{routine}", **siblings)
    assert [one.line for one in program.findings if one.code == "KRL037"] == [HEAD.count("\n") + 2]


def test_a_variable_that_a_routine_only_reads_is_not_reported() -> None:
    text = f"{HEAD}change($TECH.CLASS)\nLIN {FULL}\nEND\nDEF change(A:IN)\nINT A\nEND\n"
    assert "KRL037" not in [finding.code for finding in read(text).findings]


@pytest.mark.parametrize("how", SETTING)
@pytest.mark.parametrize("again", ["", "$ASYNC_AXIS=0\n"])
def test_external_axes_are_not_claimed_that_may_be_left_out_of_motions(how: str, again: str) -> None:
    point = FULL[:-1] + ",E1 50}"
    text = f"{HEAD}LIN {point}\n{SETTING[how].format('$ASYNC_AXIS=1')}{again}LIN {point}\nEND\n"
    before, after = read(text).toolpath.external[:, 0]
    assert before == 50.0
    assert (after == 50.0) == (how == "assignment" and again != "")


@pytest.mark.parametrize("endless", [True, False])
@pytest.mark.parametrize("resumes", [True, False])
def test_after_a_subprogram_that_an_interrupt_ends_a_motion_starts_anywhere(
    endless: bool, resumes: bool
) -> None:
    """Whether the subprogram has an end of its own or not: without both nothing after its call is reached."""
    body = f"LOOP\nLIN {MOVED}\nENDLOOP\n" if endless else f"LIN {MOVED}\n"
    resume = "BRAKE\nRESUME\n" if resumes else ""
    later = WHEN["interrupt"].format("isr()")
    text = f"{HEAD}{later}LIN {FULL}\nwork()\nLIN {FULL}\nLIN {MOVED}\nEND\n"
    program = read(f"{text}DEF work()\n{body}END\nDEF isr()\n{resume}END\n")
    path = program.toolpath
    after = HEAD.count("\n") + later.count("\n") + 3
    assert path.line.tolist()[2:] == [after, after + 1]
    before = path.sequence.predecessors.get(2, (1,))
    assert (-2 in before) is resumes  # -2: elsewhere than any motion ends
    assert 1 in before or (endless and not resumes)
    is_reached = resumes or not endless
    assert path.known[2:].tolist() == [is_reached] * 2
    assert path.continues[3] == is_reached
    assert [one.line for one in program.findings if one.code == "KRL023"] == ([] if is_reached else [after])


@pytest.mark.parametrize(
    ("statement", "is_known"),
    [("N=1", True), ("N=W.X", True), ("W.X=3", False), ("N=change(W)", False), ("N=elsewhere(W)", False)],
)
def test_what_changes_one_of_two_names_of_a_variable_changes_the_other(
    statement: str, is_known: bool
) -> None:
    """Where a parameter comes back it may be the variable that some call hands over; what is only read stays."""
    head = "GLOBAL DEF sub(W:OUT)\nDECL FRAME W\nDECL INT N\nBAS(#BASE,1)\nBAS(#TOOL,1)\n"
    sub = f"{head}P={FULL}\n{statement}\nLIN P\nEND\n"
    change = f"DEFFCT INT change(V:OUT)\nDECL FRAME V\nV={MOVED}\nRETURN 1\nENDFCT\n"
    program = read(f"DEF part()\nEND\nGLOBAL DEF other()\nsub(P)\nEND\n{sub}{change}")
    assert program.toolpath.known.tolist() == [is_known]
    assert [one.line for one in program.findings if one.code == "KRL002"] == ([] if is_known else [13])


@pytest.mark.parametrize("interrupted", [True, False])
def test_after_a_function_the_next_motion_starts_where_the_one_before_ends_but_for_interrupts(
    interrupted: bool,
) -> None:
    later = WHEN["interrupt"].format("isr()") if interrupted else ""
    count = "DEFFCT INT count()\nRETURN 1\nENDFCT\n"
    text = f"{HEAD}DECL INT N\n{later}LIN {FULL}\nN=count()\nLIN {MOVED}\nEND\n{count}"
    program = read(f"{text}DEF isr()\nBRAKE\nRESUME\nEND\n")
    assert program.toolpath.known.all()
    before = program.toolpath.sequence.predecessors[1]
    assert before == ((-2, 0) if interrupted else (0,))  # -2: elsewhere than any motion ends
