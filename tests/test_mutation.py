"""The mutation driver: what is mutated, what a sample is, and that a judgement tells a mutant from the original."""

import pytest

pytest.importorskip("cosmic_ray", reason="pip install .[mutation]")

from mutation import judging, stream
from mutation.command import Drawn, changed, confirm, judge, meet, row, wilson
from mutation.mutants import mutants, sample
from mutation.probes import NOTE, Probes, with_probes
from mutation.second_stage import further_tests

SOURCE = '''\
"""A document of 3 words."""
from dataclasses import dataclass

TABLE = {"a": 1}


@dataclass(frozen=True)
class Thing:
    size: int | None = 2


def grown(thing: Thing | None, by: float = 0.5) -> float:
    """Adds 7 to nothing."""
    pairs = zip([thing], [by], strict=True)
    if thing is None or not by > 0:
        return -1.0
    return thing.size + by * len(list(pairs))
'''

TESTS = """\
from thing import Thing, grown

def test_quick():
    assert grown(None) < 0

def test_slow():
    assert grown(Thing(3), 2.0) == 5.0

def test_far():
    assert True
"""


@pytest.fixture
def tree(tmp_path):
    made = tmp_path / "tree"
    (made / "tests").mkdir(parents=True)
    (made / "thing.py").write_text(SOURCE)
    (made / "tests" / "test_thing.py").write_text(TESTS)
    return made


def texts(tree):
    found = mutants(tree, "thing.py")
    return {changed(SOURCE, text) for m in found if (text := m.text(SOURCE)) is not None}


def test_only_what_runs_is_mutated(tree):
    """Neither words, nor annotations, decorators and strict; signs stay signs, comparisons comparisons."""
    before = {old for old, _ in texts(tree)}
    assert before == {
        line.strip() for line in SOURCE.splitlines() if line.strip()[:2] in ("TA", "si", "if", "re", "de")
    }
    after = {new.replace(" ", "") for _, new in texts(tree)}
    assert "returnthing.size-by*len(list(pairs))" in after
    assert "size:int|None=3" in after
    assert "ifthingisnotNoneornotby>0:" in after
    assert "ifthingisNoneandnotby>0:" in after
    assert not any(
        word in new for new in after for word in ("<<", "strict=False", "frozen=False", "int&None")
    )


def test_a_sample_draws_sites_once_and_again_the_same(tree):
    found = mutants(tree, "thing.py")
    sites = {mutant.site for mutant in found}
    drawn = [mutant for mutant, _ in sample(found, 1000, 3, {"thing.py": SOURCE})]
    assert len(drawn) == len({mutant.site for mutant in drawn}) <= len(sites)
    again = [mutant for mutant, _ in sample(found, 5, 3, {"thing.py": SOURCE})]
    assert again == drawn[:5]
    assert again != [mutant for mutant, _ in sample(found, 5, 4, {"thing.py": SOURCE})]


def test_the_interval_is_wilsons():
    assert wilson(0, 0) == (0.0, 1.0)
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    low, high = wilson(10, 10)
    assert low == pytest.approx(0.7225, abs=1e-4)
    assert high == pytest.approx(1.0)


def test_a_probe_is_before_the_statement_of_its_mutant(tree):
    """A mutant that runs at import is reached by whoever calls a function of the file."""
    numbered = dict(enumerate(mutants(tree, "thing.py")))
    lines = {mutant.line for mutant in numbered.values()}
    run: dict[str, object] = {NOTE: lambda *numbers: reached.update(numbers)}
    exec(compile(with_probes(SOURCE, numbered), "thing.py", "exec", dont_inherit=True), run)
    reached: set[int] = set()
    assert run["grown"](None) == -1.0
    assert {numbered[number].line for number in reached} == lines - {17}
    assert run["grown"].__doc__ == "Adds 7 to nothing."
    assert run["grown"](run["Thing"](3), 2.0) == 5.0
    assert {numbered[number].line for number in reached} == lines


def test_what_a_table_says_may_be_met_by_every_test(tree):
    """In a file without functions no probe can tell who reads it."""
    (tree / "table.py").write_text("SIZES = {1: 2}\n")
    of_table = mutants(tree, "table.py")
    probes = Probes(tree, [*mutants(tree, "thing.py"), *of_table])
    count = len(mutants(tree, "thing.py"))
    assert probes.of_tables == set(range(count, count + len(of_table)))
    assert probes.at_import["table"] == probes.of_tables
    lines = {
        mutant.line
        for number, mutant in enumerate(mutants(tree, "thing.py"))
        if number in probes.at_import["thing"]
    }
    assert lines == {4, 9, 12}


def test_a_test_is_near_what_its_helpers_import(tree):
    tests = tree / "tests"
    for name, text in (
        ("near", "from package.room import thing"),
        ("around", "import package"),
        ("far", "import other"),
        ("helped", "from helper.part import thing"),
        ("helped_twice", "import helpers"),
    ):
        (tests / f"test_{name}.py").write_text(text + "\n")
    (tests / "helper").mkdir()
    (tests / "helper" / "part.py").write_text("import helpers\nfrom package.room.inner import thing\n")
    (tests / "helpers.py").write_text("import helper.part\n")

    def near(*rooms: str) -> set[str]:
        return {
            path.stem.removeprefix("test_")
            for path in tests.glob("test_*.py")
            if stream.is_near(tree, f"tests/{path.name}", rooms)
        }

    assert near("package/room") == {"near", "helped", "helped_twice"}
    assert near("package/room/inner") == {"near", "helped", "helped_twice"}
    assert near("other/room") == set()


CACHED = """\
import functools
import pytest
from thing import Thing, grown

@functools.cache
def three():
    return grown(Thing(3), 0.5)

@pytest.fixture(scope="module")
def five():
    return grown(Thing(3), 2.0)

def test_fixture(five):
    assert five == 5.0

def test_cached():
    assert three() == 3.5

def test_none():
    assert grown(None) < 0
"""


@pytest.mark.slow
def test_one_run_finds_what_falls_to_which_test(tree, tmp_path):
    """Mutants behind fixtures of a file and cached results too; what runs at import is left over, with its tests."""
    (tree / "tests" / "test_thing.py").write_text(CACHED)
    judging.warm(judging.FAST)
    chosen = [(one, text) for one in mutants(tree, "thing.py") if (text := one.text(SOURCE)) is not None]
    log = tmp_path / "stream.jsonl"
    seen = stream.run(tree, chosen, ["tests/test_thing.py"], log, 30.0, judging.FAST)
    fixture, cached, none = (f"tests/test_thing.py::test_{word}" for word in ("fixture", "cached", "none"))
    assert list(seen.seconds) == [fixture, cached, none]
    verdicts, by_line = {}, {16: [none], 17: [fixture, cached]}
    for number, (mutant, text) in enumerate(chosen):
        after = changed(SOURCE, text)[1].replace(" ", "")
        verdicts[after] = seen.verdicts.get(number)
        assert seen.reached[number] == by_line.get(mutant.line, [fixture, cached, none])
    assert verdicts["returnthing.size-by*len(list(pairs))"] in (("killed", fixture), ("killed", cached))
    assert verdicts["ifthingisnotNoneornotby>0:"][0] == "killed"
    assert verdicts["ifthingisNoneornotby>1:"] == ("killed", cached)
    assert verdicts["return+1.0"] == ("killed", none)
    assert verdicts["return-2.0"] == ("survived", "")
    assert verdicts["size:int|None=3"] is None
    left = log.read_text()
    assert stream.run(tree, chosen, ["tests/test_thing.py"], log, 30.0, judging.FAST) == seen
    assert log.read_text() == left


@pytest.mark.slow
def test_mutants_fall_by_the_tests_that_reach_them(tree, tmp_path):
    """And the tree is afterwards what it was, with nothing left of them."""
    quick, slow = (f"tests/test_thing.py::test_{word}" for word in ("quick", "slow"))
    reached = {15: [quick, slow], 16: [quick], 17: [slow]}
    stat = (tree / "thing.py").stat()
    verdicts = {}
    for mutant in mutants(tree, "thing.py"):
        text = mutant.text(SOURCE)
        if text is not None and mutant.line in reached:
            after = changed(SOURCE, text)[1].replace(" ", "")
            tests = dict.fromkeys(reached[mutant.line], 0.01)
            verdicts[after] = judge(tmp_path, tree, mutant, text, tests, judging.ALL)
    assert judge(tmp_path, tree, mutant, SOURCE, {}, judging.ALL) == ("not reached", "")
    assert verdicts["returnthing.size-by*len(list(pairs))"] == ("killed", slow)
    assert verdicts["return-2.0"] == ("survived", "")
    assert verdicts["return+1.0"] == ("killed", quick)
    assert verdicts["ifthingisnotNoneornotby>0:"][0] == "killed"
    assert (tree / "thing.py").read_text() == SOURCE
    assert (tree / "thing.py").stat().st_mtime_ns == stat.st_mtime_ns
    assert not list((tree / "__pycache__").glob("thing*")) if (tree / "__pycache__").exists() else True


def test_quick_tests_and_those_that_killed_come_first():
    seen = stream.Stream(seconds={"a": 1.0, "b": 0.5, "c": 9.0, "d": 2.0}, reached={0: ["a", "b", "c", "d"]})
    assert list(seen.choice(0, 4.0)) == ["b", "a", "d"]
    assert list(seen.choice(1, 4.0)) == []
    for number in (5, 6):
        seen.add({"mutant": number, "verdict": "killed", "test": "a"})
    assert list(seen.choice(0, 1.2)) == ["a"]
    assert list(seen.choice(0, 0.1)) == ["a"]


class Item:
    """A test as pytest has it, by name; a slow one ends with "slow"."""

    def __init__(self, nodeid: str) -> None:
        self.nodeid = nodeid

    def get_closest_marker(self, name: str) -> str | None:
        return name if self.nodeid.endswith(name) else None


def test_survivors_meet_what_may_come_by_them_fast_tests_first():
    seen = stream.Stream(
        seconds={"a::1": 1.0, "a::2": 1.0, "b::1": 1.0}, reached={0: ["a::1"], 1: ["a::2"], 2: ["b::1"]}
    )
    names = ["z::1", "c::slow", "c::1", "b::slow", "b::1", "a::slow", "a::2", "a::1"]
    further = further_tests(seen, [0], ["b", "c"], 5.0)
    order = [item.nodeid for item in further.in_order([Item(name) for name in names])]
    assert order == ["a::1", "c::1", "z::1", "a::slow", "c::slow", "b::slow"]
    assert (further.each, further.all) == (5.0, 5.0)
    assert further_tests(seen, [0, 1], [], 5.0).all == 10.0


LEFT_OUT = """\
import pytest
from thing import Thing, grown

def test_left_out():
    assert grown(Thing(3), 2.0) == 5.0

@pytest.mark.slow
def test_slow():
    assert grown(None) == -1.0

def test_ever():
    while True:
        pass
"""


@pytest.mark.slow
def test_what_lived_only_for_want_of_a_test_falls_in_the_second_stage(tree, tmp_path):
    """Of a file left out of the first stage, or of the slow tier; what hangs, unmutated, takes its seconds and is
    no test; what no test sees lives on."""
    quick = "from thing import grown\n\ndef test_quick():\n    assert grown(None) < 0\n"
    (tree / "tests" / "test_thing.py").write_text(quick)
    (tree / "tests" / "test_more.py").write_text(LEFT_OUT)
    judging.warm(judging.FAST)
    chosen = [
        Drawn("room", one, text, *changed(SOURCE, text))
        for one in mutants(tree, "thing.py")
        if one.line in (15, 16, 17) and (text := one.text(SOURCE)) is not None
    ]
    first = meet(
        tmp_path, tree, chosen, ["tests/test_thing.py"], tmp_path / "stream.jsonl", 9.0, judging.FAST
    )
    results = [{"verdict": first.verdicts[k][0], "test": "", "tests": 1} for k in range(len(chosen))]

    def verdicts() -> dict[str, str]:
        pairs = zip(chosen, results, strict=True)
        return {one.after.replace(" ", ""): str(result["verdict"]) for one, result in pairs}

    before = verdicts()
    assert before["return-2.0"] == "survived"
    assert before["returnthing.size-by*len(list(pairs))"] == "not reached"
    assert before["return+1.0"] == "killed"
    confirm(tmp_path, tree, chosen, first, ["thing"], 1.0, results)
    after = verdicts()
    assert after["return-2.0"] == after["returnthing.size-by*len(list(pairs))"] == "killed"
    assert {one["test"].split("::")[1] for one in results if one["test"]} == {"test_left_out", "test_slow"}
    assert all(after[word] == "killed" for word, verdict in before.items() if verdict == "killed")
    assert after["ifthingisNoneornotby>1:"] == "survived"
    seen = stream.load(tmp_path / "confirmed.jsonl")
    assert 0.9 < seen.seconds["tests/test_more.py::test_ever"] < 3.0
    assert not any("tests/test_more.py::test_ever" in names for names in seen.reached.values())


def test_what_hangs_is_a_timeout(tree, tmp_path, monkeypatch):
    monkeypatch.setattr(judging, "LIMIT_S", 0.3)
    (tree / "tests" / "test_thing.py").write_text("def test_ever():\n    while True:\n        pass\n")
    name = "tests/test_thing.py::test_ever"
    assert judging.judge(tree, {name: 0.01}, tmp_path) == ("timeout", name)


def test_tests_that_do_not_run_are_no_verdict(tree, tmp_path):
    with pytest.raises(RuntimeError, match="did not run"):
        judging.judge(tree, {"tests/test_thing.py::test_none": 0.01}, tmp_path)


def test_the_row_counts_what_was_not_reached_as_alive():
    verdicts = ["killed"] * 6 + ["timeout"] + ["survived"] * 2 + ["not reached"]
    assert "70.0 % (39.7 to 89.2)" in row("room", 99, [{"verdict": verdict} for verdict in verdicts])
