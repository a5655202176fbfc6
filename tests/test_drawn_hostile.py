"""What hostile programs cost, in counts: arrays, calls of calls, loops in loops, blocks that declare."""

from __future__ import annotations

import random

import pytest
from drawn_hostile import LANGUAGES, draw
from linear import MEGABYTES, SECONDS, import_readers, is_linear, measure
from linear_robots import TP_POINT

from postproc.languages.gcode import execution
from postproc.languages.gcode.expression_values import LINUXCNC
from postproc.languages.gcode.run_flow import RunFlow
from postproc.languages.gcode.variable_values import VariableValues
from postproc.languages.krl import open_blocks
from postproc.languages.krl.program_flow import ProgramFlow
from postproc.languages.rapid.array_items import CHUNK, ArrayItems, repeated, with_item
from postproc.languages.rapid.parsing import ModuleParser
from postproc.languages.rapid.propagation import Propagation
from postproc.languages.rapid.routine_graph import RoutineGraph
from postproc.languages.rapid.step_budget import MOST_CALLS, MOST_IN_RUN, StepBudget
from postproc.languages.rapid.values import GroupValue, Leaf, UnknownData, joined, plain, unknown_in
from postproc.languages.tp.tp_propagation import TpPropagation
from postproc.workflows.preparation import read_program


def test_a_long_array_is_the_tuple_that_it_stands_for():
    random_ = random.Random(5)
    items, same = repeated(Leaf(0.0), 3 * CHUNK + 7), [Leaf(0.0)] * (3 * CHUNK + 7)
    for _ in range(200):
        at, item = random_.randrange(len(same)), Leaf(random_.random(), 3, 4)
        items = with_item(items, at, item)
        same[at] = item
    assert isinstance(items, ArrayItems)
    assert tuple(items) == tuple(same)
    assert len(items) == len(same)
    assert items[2:1000:3] == tuple(same)[2:1000:3]
    assert [items[at] for at in (-1, 0, CHUNK, len(same) - 1)] == [
        same[at] for at in (-1, 0, CHUNK, len(same) - 1)
    ]
    with pytest.raises(IndexError):
        items[len(same)]
    assert plain(GroupValue(items)) == GroupValue(items.mapped(plain))
    assert tuple(plain(GroupValue(items)).items) == tuple(map(plain, same))
    other = with_item(items, 700, UnknownData("it is not known"))
    assert unknown_in(GroupValue(items)) is None
    assert unknown_in(GroupValue(other)) == UnknownData("it is not known")
    assert tuple(joined(GroupValue(items), GroupValue(other), "they differ").items) == tuple(
        joined(one, two, "they differ") for one, two in zip(items, other, strict=True)
    )
    assert items != other
    assert with_item(other, 700, items[700]) == items


def test_an_element_of_a_long_array_is_set_without_its_other_chunks():
    items = repeated(Leaf(0.0), 100 * CHUNK)
    changed = with_item(items, 40 * CHUNK, Leaf(1.0))
    shared = [one is two for one, two in zip(items.chunks, changed.chunks, strict=True)]
    assert shared.count(False) == 1
    assert items.joined(items.mapped(plain), joined) is items


def _propagation(body: str, more: str = "") -> Propagation:
    head = "MODULE m\nVAR num n;\nVAR num a{200000};\nVAR robtarget p;\nPROC main()\n"
    raw = f"{head}{body}ENDPROC\n{more}ENDMODULE\n".encode()
    found = Propagation(ModuleParser(raw).file(), raw)
    found.run()
    return found


def test_a_declared_array_is_kept_in_chunks():
    found = _propagation("a{7}:=n;\n")
    value, _ = found.data.look(b"A")
    assert isinstance(value, GroupValue)
    assert isinstance(value.items, ArrayItems)
    assert len(value.items) == 200_000


@pytest.fixture
def taken(monkeypatch):
    """The statements that a run of RAPID takes from its budget."""
    statements: list[object] = []
    take = StepBudget.take

    def counted(budget: StepBudget, statement: object) -> None:
        statements.append(statement)
        take(budget, statement)

    monkeypatch.setattr(StepBudget, "take", counted)
    return statements


@pytest.mark.parametrize("calls", [1, 2, 10])
def test_calls_of_calls_are_followed_up_to_a_number_of_statements(taken, calls):
    routines = "".join(f"PROC f{n}()\n{f'f{n + 1};' * calls}\nn:=n+1;\nENDPROC\n" for n in range(1, 11))
    leaf = "PROC f11()\nMoveL Offs(p,n,0,0),v1,z1,tool0;\nENDPROC\n"
    found = _propagation("n:=0;\nf1;\n", routines + leaf)
    assert len(found.facts) == 1
    assert len(taken) < 40 * MOST_IN_RUN
    [fact] = found.facts.values()
    assert (unknown_in(fact.target) is None) == (calls == 1)  # of many calls each has another n


def test_a_call_that_changes_nothing_any_more_is_passed_where_it_is_repeated(taken):
    """Its motion has the same fact as where each call is followed."""
    routine = "PROC f()\nMoveL Offs(p,1,0,0),v1,z1,tool0;\nENDPROC\n"
    found = _propagation("f;\n" * 1000, routine)
    [fact] = found.facts.values()
    assert unknown_in(fact.target) is None
    assert len(taken) < 1000 + 2 * 12
    apart = _propagation("f;\nWaitTime 0;\n" * 1000, routine)
    assert len(taken) > 3000
    assert next(iter(apart.facts.values())).target.items[0] == fact.target.items[0]


@pytest.mark.parametrize("statement", ["f;", "unread;"])
def test_a_repeated_call_is_passed_only_once_nothing_changes(statement):
    """A routine that counts goes on counting, and what comes between two calls starts anew."""
    routine = "PROC f()\nn:=n+1;\nENDPROC\n"
    for times in (2, 3, 7, 64, 100):
        found = _propagation(f"n:=0;\n{'f;' * times}{statement}\nMoveL Offs(p,n,0,0),v1,z1,tool0;\n", routine)
        [fact] = found.facts.values()
        number = unknown_in(fact.target)
        if statement == "f;":
            assert number is None
            assert fact.target.items[0].items[0].value == times + 1


def test_no_more_than_so_many_calls_are_followed_in_a_run(taken):
    """Beyond it what a routine sets is not known; one that does not move leaves the robot where it is."""
    routine = "PROC f()\nn:=n+1;\nENDPROC\n"
    motion = "MoveL Offs(p,n,0,0),v1,z1,tool0;\n"
    found = _propagation(f"{motion}n:=0;\n" + "f;\n" * (MOST_CALLS + 3000) + motion, routine)
    first, last = found.facts.values()
    assert unknown_in(last.target) is not None
    assert last.before == frozenset([first.statement.start])
    assert len(taken) < 3 * (2 * MOST_CALLS + 3000) + 100
    assert b"F" in found.calls


def test_loops_in_a_loop_of_unknown_length_are_run_few_times(monkeypatch):
    """What a loop does with a state is remembered: the loop around it comes with the same again."""
    blocks = 0
    after = Propagation.after_block

    def counted(flow: Propagation, *arguments: object):
        nonlocal blocks
        blocks += 1
        return after(flow, *arguments)

    monkeypatch.setattr(Propagation, "after_block", counted)
    monkeypatch.setattr("postproc.languages.core.flow_runner.UNROLLED", 0)
    inner = "FOR k FROM 1 TO 9 DO\nMoveL p,v1,z1,tool0;\nENDFOR\n"
    _propagation(f"WHILE di1=1 DO\nFOR i FROM 1 TO 9 DO\n{inner * 100}ENDFOR\nENDWHILE\n")
    assert blocks < 2300


def test_what_is_remembered_of_a_loop_is_of_its_state():
    """Two calls of a routine with a loop, with other values of what it reads."""
    loop = "PROC f()\nWHILE di1=1 DO\nWHILE di2=1 DO\nMoveL Offs(p,n,0,0),v1,z1,tool0;\nENDWHILE\nENDWHILE\nENDPROC\n"
    same = _propagation(
        "p:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nn:=5;\nf;\nn:=5;\nf;\n", loop
    )
    other = _propagation(
        "p:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nn:=5;\nf;\nn:=6;\nf;\n", loop
    )
    [one], [two] = same.facts.values(), other.facts.values()
    assert [leaf.value for leaf in one.target.items[0].items] == [6.0, 2.0, 3.0]
    assert unknown_in(two.target) is not None


@pytest.mark.parametrize(("operator", "value"), [("+", 3001.0), ("-", -2999.0), ("*", 1.0)])
def test_a_long_expression_has_its_value(operator, value):
    text = operator.join(["1"] * 3001)
    found = _propagation(
        f"p:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nMoveL Offs(p,{text},0,0),v1,z1,t;\n"
    )
    [fact] = found.facts.values()
    assert fact.target.items[0].items[0].value == value + 1


@pytest.mark.parametrize(
    ("head", "steps"),
    [("1 TO 9", 3), ("1 TO 9 STEP 2", 3), ("1 TO n", 7), ("n TO 9", 5), ("1 TO 9 STEP n", 5), ("9 TO -n", 7)],
)
def test_numbers_of_a_loop_stand_for_themselves(head, steps):
    raw = f"MODULE m\nPROC main()\nFOR i FROM {head} DO\nENDFOR\nENDPROC\nENDMODULE\n".encode()
    [routine] = ModuleParser(raw).file().routines
    assert sum(len(block.steps) for block in RoutineGraph(routine.body).blocks) == steps


def test_blocks_in_each_other_that_declare_are_gone_over_once_more(monkeypatch, tmp_path):
    flows = []
    run_all = ProgramFlow.all
    monkeypatch.setattr(ProgramFlow, "all", lambda flow: (flows.append(flow), run_all(flow))[1])
    monkeypatch.setattr(open_blocks, "MOST_STEPS", 0)
    depth = 40
    opened = "".join(f"FOR I=1 TO R\nDECL INT Q{n}\n" for n in range(depth))
    text = f"DEF part()\nDECL INT I,R\n{(opened + depth * f'ENDFOR{chr(10)}') * 20}LIN {{X 1}}\nEND\n"
    path = tmp_path / "part.src"
    path.write_text(text)
    read_program(path)
    lines = text.count("\n")
    assert max(flow.steps for flow in flows) < 4 * lines


def _steps_of_krl(monkeypatch, path, count: int) -> int:
    flows = []
    run_all = ProgramFlow.all
    with monkeypatch.context() as patch:
        patch.setattr(ProgramFlow, "all", lambda flow: (flows.append(flow), run_all(flow))[1])
        patch.setattr(open_blocks, "MOST_STEPS", 0)
        names = range(1, count)
        declared = "".join(f"DECL INT V{n}\n" for n in range(count)) + "".join(
            f"V{n}=0\n" for n in range(count)
        )
        moved = "".join(f"V{n}=V{n - 1}\n" for n in reversed(names))
        end = "V0=V0+1\nIF $IN[1] THEN\nEXIT\nENDIF\nENDLOOP\nLIN {X 1}\nEND\n"
        path.write_text(f"DEF part()\n{declared}LOOP\n{moved}{end}")
        read_program(path)
    return max(flow.steps for flow in flows)


def test_a_chain_of_values_through_a_loop_takes_few_passes_in_krl(monkeypatch, tmp_path):
    """So many variables that all that the program assigns counts as changed."""
    once, twice = (_steps_of_krl(monkeypatch, tmp_path / "part.src", count) for count in (400, 800))
    assert twice < 2.5 * once
    assert once < 400 * 16


@pytest.mark.parametrize("end", ["WHILE", "GOTO"])
def test_a_chain_of_values_through_a_loop_takes_few_passes(monkeypatch, taken, end):
    """Each pass makes one more of its variables unknown: after some passes all are."""
    monkeypatch.setattr("postproc.languages.core.flow_runner.UNROLLED", 0)
    declared = "".join(f"VAR num v{n}:=0;\n" for n in range(200))
    moved = (
        "".join(f"v{n}:=v{n - 1};\n" for n in range(199, 0, -1))
        + "v0:=v0+1;\nMoveL Offs(p,v199,0,0),v1,z1,tool0;\n"
    )
    start, back = {"WHILE": ("WHILE di1=1 DO\n", "ENDWHILE\n"), "GOTO": ("x:\n", "IF di1=1 GOTO x;\n")}[end]
    found = _propagation(f"{declared}{start}{moved}{back}")
    assert len(taken) < 400 * 60
    [fact] = found.facts.values()
    assert unknown_in(fact.target) is not None


def test_registers_through_a_loop_are_lost_after_some_passes(monkeypatch, tmp_path):
    """What does not go through the loop stays known, and what a long chain makes unknown does not."""
    found, run = {}, TpPropagation.run
    flows: list[TpPropagation] = []
    for count in (5, 60):
        moved = "".join(f"1:R[{n}]=R[{n - 1}] ;\n" for n in range(count, 1, -1))
        text = (
            "/PROG A\n/ATTR\n/MN\n1:R[99]=1 ;\n"
            + "".join(f"1:R[{n}]=0 ;\n" for n in range(1, count + 1))
            + f"1:LBL[1] ;\n{moved}1:R[1]=R[1]+1 ;\n1:IF DI[1]=ON,JMP LBL[1] ;\n"
            + f"1:UFRAME_NUM=R[99] ;\n1:UTOOL_NUM=R[{count}] ;\n1:L P[1] 9mm/sec FINE ;\n/POS\n{TP_POINT % 1}/END\n"
        )
        path = tmp_path / "part.ls"
        path.write_text(text)
        with monkeypatch.context() as patch:
            patch.setattr(TpPropagation, "run", lambda flow, state: (flows.append(flow), run(flow, state)))
            read_program(path)
        state = flows[-1].before[-1]
        assert state is not None
        found[count] = (state.base, state.tool)
    assert found == {5: (1, None), 60: (None, None)}


def test_a_call_takes_the_time_of_its_own_variables(monkeypatch):
    asked = 0
    is_local = VariableValues.is_local

    def counted(values: VariableValues, name: str) -> bool:
        nonlocal asked
        asked += 1
        return is_local(values, name)

    values = VariableValues(LINUXCNC, {}, "linuxcnc")
    for number in range(1, 3000):
        values.set(f"#{number}", float(number))
    values.set("#<_GLOBAL>", 7.0)
    values.set("#<LOCAL>", 8.0)
    monkeypatch.setattr(VariableValues, "is_local", counted)
    outer = values.enter({"#1": 5.0, "#2": float("nan")})
    assert asked < 10
    assert [values.evaluate(name, set())[0] for name in ("#1", "#31", "#<_GLOBAL>")] == [5.0, 31.0, 7.0]
    assert [values.evaluate(name, set())[1] for name in ("#2", "#30", "#<LOCAL>")] == [
        ["#2"],
        ["#30"],
        ["#<LOCAL>"],
    ]
    values.set("#1", 6.0)
    values.set("#<_GLOBAL>", 9.0)
    values.leave(outer)
    assert asked < 40
    wanted = [1.0, 30.0, 31.0, 9.0, 8.0]
    names = ("#1", "#30", "#31", "#<_GLOBAL>", "#<LOCAL>")
    assert [values.evaluate(name, set())[0] for name in names] == wanted
    values.forget()
    assert all(values.evaluate(name, set())[1] for name in names)


def test_a_program_is_not_followed_again_and_again(monkeypatch, tmp_path):
    attempts = 0
    follow = RunFlow.follow

    def counted(run: RunFlow) -> int:
        nonlocal attempts
        attempts += 1
        return follow(run)

    monkeypatch.setattr(RunFlow, "follow", counted)
    odd = "".join(
        f"#2=0\no{n} while [#2 LT 3]\n#2=[#2+1]\no{n + 1} if [#5399 EQ 1]\no{n} break\no{n + 1} endif\nG1 X1\n"
        f"o{n} endwhile\n"
        for n in range(2, 40, 2)
    )
    path = tmp_path / "part.ngc"
    path.write_text(f"G21 G90 F9\n#1=0\no1 while [#1 LT 3000]\n#1=[#1+1]\no1 endwhile\n{odd}M2\n")
    monkeypatch.setattr(execution, "MOST_STEPS", 20_000)
    read_program(path)
    assert 2 < attempts < 8


SEEDS = [(name, seed) for seed in range(8) for name in sorted(LANGUAGES)]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), SEEDS)
def test_drawn_hostile_programs_are_read_in_linear_time(name, seed):
    import_readers()
    case = draw(seed, name)
    small = measure(case, 100_000)
    assert not small.error
    assert small.seconds < 2 * SECONDS
    assert small.megabytes < MEGABYTES
    if small.seconds > 0.5:
        assert is_linear(case)
