"""What the families of languages share: joins of states, graphs of flow, comments in force, numbers that change."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.base.decimals import decimals_of
from postproc.base.findings import Finding
from postproc.languages import codes as codes
from postproc.languages.core.comments_in_force import ShownComments, place_of
from postproc.languages.core.field_joins import SOMETIMES, FieldJoins, either, is_same, lost
from postproc.languages.core.flow_graph import END, FlowGraph
from postproc.languages.core.flow_runner import FlowRunner
from postproc.languages.core.motion_sources import FEW, Meeting, expanded, together
from postproc.languages.core.plan_rows import PlannedNumbers, refuse_divided, refuse_moved
from postproc.languages.core.reach import reached
from postproc.languages.core.row_facts import LockedRows, circles, used_frames
from postproc.languages.core.waits import Waits


@dataclass
class Places:
    """Values that were seen on the paths to a place."""

    seen: frozenset[str] = frozenset()
    at: int | None = 0
    known = None

    def copy(self) -> Places:
        return Places(self.seen, self.at)

    def join(self, other: Places, _: Meeting) -> bool:
        changed = PLACES.changes(self, other)
        for name, value in changed.items():
            setattr(self, name, value)
        return bool(changed)

    def is_same(self, other: Places) -> bool:
        return self == other


PLACES = FieldJoins({"seen": frozenset.union, "at": lost(None)})


@dataclass
class Ran:
    """Runs a graph whose steps are texts and whose conditions are truths, or None where they are not known."""

    steps: list[str] = field(default_factory=list)

    def over(self, graph: FlowGraph[str, tuple[bool | None], str]) -> Places | None:
        graph.link()
        runner = FlowRunner(self.after)
        self.runner = runner
        runner.start()
        return runner.run(graph, Places(), True)

    def after(
        self, graph: FlowGraph[str, tuple[bool | None], str], at: int, state: Places
    ) -> list[tuple[int, Places]]:
        block = graph.blocks[at]
        for step in block.steps:
            if self.runner.recording:
                self.steps.append(step)
            state.seen, state.at = state.seen | {step}, len(step)
        leads = [block.follow, *block.further]
        if block.condition is not None:
            [holds] = block.condition
            both = [block.follow, block.otherwise]
            leads = both if holds is None else both[:1] if holds else both[1:]
        return [(there, state) for there in leads]


def branched(holds: bool | None) -> tuple[Ran, Places | None]:
    graph: FlowGraph[str, tuple[bool | None], str] = FlowGraph()
    graph.step("a")
    head = graph.branch((holds,))
    graph.step("bb")
    end = graph.otherwise(head)
    graph.step("ccc")
    graph.meet([end])
    graph.step("d" * 4)
    ran = Ran()
    return ran, ran.over(graph)


def test_branches_meet_after_both_arms() -> None:
    for holds, wanted in ((True, ["a", "bb", "dddd"]), (False, ["a", "ccc", "dddd"])):
        ran, end = branched(holds)
        assert ran.steps == wanted
        assert end is not None
        assert end.seen == set(wanted)
    ran, end = branched(None)
    assert ran.steps == ["a", "bb", "ccc", "dddd"]
    assert end is not None
    assert end.seen == {"a", "bb", "ccc", "dddd"}


def test_a_loop_that_may_run_is_run_with_what_its_end_brings() -> None:
    graph: FlowGraph[str, tuple[bool | None], str] = FlowGraph()
    head = graph.loop((None,), ["first"])
    graph.step("body")
    graph.end_loop(head)
    graph.step("after")
    assert graph.is_structured
    ran = Ran()
    end = ran.over(graph)
    assert end is not None
    assert end.seen == {"first", "body", "after"}
    assert sorted(set(ran.steps)) == ["after", "body", "first"]


def test_jumps_lead_to_their_labels_and_may_also_go_on() -> None:
    graph: FlowGraph[str, tuple[bool | None], str] = FlowGraph()
    graph.label("again")
    graph.step("x")
    graph.may_jump(["again", "out"])
    graph.step("yy")
    graph.jump("out")
    graph.step("never")
    graph.label("out")
    graph.step("zzz")
    graph.leave(END)
    graph.step("nor this")
    ran = Ran()
    end = ran.over(graph)
    assert not graph.is_structured
    assert graph.missing == []
    assert end is not None
    assert end.seen == {"x", "yy", "zzz"}
    assert "never" not in ran.steps
    assert "nor this" not in ran.steps


def test_a_label_to_which_only_a_possible_jump_leads_is_run() -> None:
    graph: FlowGraph[str, tuple[bool | None], str] = FlowGraph()
    graph.may_jump(["out"])
    graph.leave(END)
    graph.label("out")
    graph.step("zzz")
    ran = Ran()
    end = ran.over(graph)
    assert ran.steps == ["zzz"]
    assert end is not None
    assert (end.seen, end.at) == ({"zzz"}, None), "the other path comes here too"


def test_labels_that_are_missing_or_there_twice_are_named() -> None:
    graph: FlowGraph[str, tuple[bool | None], str] = FlowGraph()
    graph.label("one")
    graph.label("one")
    graph.jump("two")
    graph.link()
    assert graph.missing == ["one", "two"]
    assert graph.blocks[-2].follow < END, "it does not come back"


values = st.tuples(
    st.sampled_from([1.0, 2.0, math.nan]), st.frozensets(st.integers(0, 3)), st.sampled_from(list(Waits))
)


@dataclass
class Fields:
    number: float
    names: frozenset[int]
    waits: Waits


FIELDS = FieldJoins({"number": lost(math.nan), "names": frozenset.union, "waits": SOMETIMES})


@given(values, values)
def test_a_join_keeps_what_both_have_and_no_more(one: tuple, other: tuple) -> None:
    a, b = Fields(*one), Fields(*other)
    changed = FIELDS.changes(a, b)
    joined = Fields(**{**vars(a), **changed})
    assert is_same(joined.number, a.number if is_same(a.number, b.number) else math.nan)
    assert joined.names == a.names | b.names
    assert joined.waits == (a.waits if a.waits == b.waits else Waits.MAYBE)
    assert FIELDS.changes(joined, b) == {}, "the same path adds nothing a second time"
    assert FIELDS.changes(a, a) == {}


def test_equal_values_stay_whatever_the_join_does_with_others() -> None:
    one, other = (Fields(float("2.5"), frozenset([1]), Waits.YES) for _ in range(2))
    assert one.number is not other.number
    assert FIELDS.changes(one, other) == {}


def test_either_keeps_the_first_that_there_is() -> None:
    assert (either(0, 7), either(3, 7), either("", "why")) == (7, 3, "why")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("FORCE 1 2 3", "force"),
        ("force,OFF", "force"),
        ("Compensate\tOFF", "switch"),
        ("FORCES 1", ""),
        ("the FORCE", ""),
        ("", ""),
    ],
)
def test_the_first_word_of_a_comment_says_what_it_is(text: str, place: str) -> None:
    assert place_of(text) == place


@dataclass(frozen=True)
class Said:
    text: str


def test_a_comment_is_shown_until_another_one_is() -> None:
    shown, force, switch = ShownComments(), Said("FORCE 1 2 3"), Said("COMPENSATE OFF")
    assert list(shown.others(None, None)) == []
    assert list(shown.others(force, None)) == [("FORCE", force)]
    shown.add(force)
    shown.add(Said("drill the holes"))
    assert list(shown.others(force, switch)) == [("COMPENSATE", switch)]
    assert list(shown.others(None, None)) == [("FORCE", None)]


def test_locked_rows_keep_their_first_reason() -> None:
    locked = LockedRows(lambda row, code, message: Finding(code, message, "a", row), "FIL008", "FIL009")
    locked.are_read([4, 2], 9)
    locked.start_arc([2, 1], 8)
    found = locked.done()
    assert list(found) == [1, 2, 4]
    assert [one.code for one in found.values()] == ["FIL008", "FIL009", "FIL009"]
    assert "line 9 reads" in found[2].message


def test_circles_through_points_too_near_to_each_other_are_none() -> None:
    starts = np.array([[1.0, 0, 0], [1.0, 0, 0], [0.0, 0, 0]])
    vias = np.array([[0.0, 1, 0], [1.0, 1e-5, 0], [1.0, 0, 0]])
    ends = np.array([[-1.0, 0, 0], [-1.0, 0, 0], [2.0, 0, 0]])
    centre, normal, sweep = circles(starts, vias, ends, 1e-4)
    assert np.allclose(centre[0], 0)
    assert np.allclose(normal[0], [0, 0, 1])
    assert np.isclose(sweep[0], np.pi)
    assert np.isnan(sweep[1:]).all()
    assert np.isnan(centre[1:]).all()


def test_frames_that_no_motion_has_are_left_out() -> None:
    base, tool, frames = used_frames(np.array([3, -1, 3]), np.array([1, 1, -1]), tuple("abcd"))  # type: ignore[arg-type]
    assert base.tolist() == [1, -1, 1]
    assert tool.tolist() == [0, 0, -1]
    assert frames == ("b", "d")


@pytest.mark.parametrize(
    ("literal", "count"), [(b"1", 0), (b"1.50", 2), (b"-2.5e-1", 2), (b"1.25E1", 1), (b"3.", 0), (b"1e3", 0)]
)
def test_an_exponent_moves_the_decimals(literal: bytes, count: int) -> None:
    assert decimals_of(literal) == count


def test_numbers_within_half_a_step_stay() -> None:
    numbers = PlannedNumbers([1.0, 2.0, math.nan], [1.0004, 2.0006, 3.0], [3, 3, 1])
    assert numbers.changed() == [1, 2]
    assert [numbers.literal(i) for i in numbers.changed()] == [b"2.001", b"3.0"]


def test_rows_that_must_not_change_are_named() -> None:
    refuse_moved([])
    refuse_divided([])
    with pytest.raises(ValueError, match=r"moved: rows \[1, 2, 3, 4, 5\]"):
        refuse_moved(list(range(1, 9)))
    with pytest.raises(ValueError, match=r"divided: rows \[7\]"):
        refuse_divided([7])


def test_many_sources_are_one_meeting_with_all_of_them() -> None:
    many = frozenset(range(FEW + 1))
    [meeting] = together(many)
    assert isinstance(meeting, Meeting)
    assert expanded([meeting, 99]) == many | {99}
    visited: set[Meeting] = set()
    assert expanded([meeting], visited) == many
    assert expanded([meeting], visited) == set()


def test_what_is_reached_has_its_start() -> None:
    steps = {1: [2], 2: [1, 3], 4: [5]}
    assert reached([1], lambda one: steps.get(one, [])) == {1, 2, 3}
    assert reached([], lambda one: steps.get(one, [])) == set()
