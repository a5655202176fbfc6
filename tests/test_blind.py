"""A small fixed part of ``python -m tests.blind``, and what the benchmark itself must hold."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from blind import cases, command, gap, measured, real_command, table, verdicts, worker
from blind.cases import Case, made
from blind.hidden import EVERY, OUTSIDE
from blind.oracle import Rival, joined

from postproc.effects import EFFECTS
from postproc.identification.campaign import Campaign

SEED = 1


def case(row, effect, snr, poses, number=0):
    return Case(row, number, SEED, (effect,) if effect else (), snr, poses)


def truly(run):
    """The robot file's model with all that is there, and its true values."""
    model = run.oracle.model
    there = {name.split(".")[0] for name in run.true()}
    for hidden, _ in run.hidden:
        model = joined(model, hidden.made)
    for name in sorted(there - {term.effect.name for term in model.terms}):
        model = model.with_effect(EFFECTS[name](model.robot.joints))
    return gap.at_truth(run, model)


@pytest.mark.sample(2)
@pytest.mark.parametrize("effect", EVERY)
def test_truth_is_the_plants(effect):
    """The model with the true values says what the plant does: else the benchmark would be one of model errors."""
    run = cases.drawn_from(case("single", effect, 2.0, 15), np.random.default_rng(5))
    design = replace(run.design, jitter=0.0)
    campaign = Campaign(measured.readings(design, measured.observed(run.scene, design), run.sigma))
    model = truly(run)
    left = campaign.residual(campaign.predicted(model), run.oracle.given)
    assert np.abs(left).max() < 1e-10
    # and what is hidden shows as large as it is said to, or is as large as is plausible
    (hidden, size), shown = run.hidden[0], run.snr[0]
    assert shown == pytest.approx(2.0, rel=0.06) or (size == hidden.cap and shown < 2.0)


@pytest.mark.slow
@pytest.mark.parametrize("effect", OUTSIDE)
def test_outside_is_none_of_the_library(effect):
    """No effect of the library alone does the same."""
    run = made(case("outside", effect, 5.0, 15))
    hidden, _size = run.hidden[0]
    assert effect not in EFFECTS
    assert hidden.outside
    signal = measured.observed(run.scene, run.design) - measured.observed(run.bare, run.design)
    assert run.oracle.beyond(signal) > 0.2 * run.snr[0]


@pytest.mark.slow
def test_a_case_is_always_the_same():
    one, again = (made(case("single", "backlash", 2.0, 15)) for _ in range(2))
    other = made(replace(case("single", "backlash", 2.0, 15), seed=2))
    assert one.robot == again.robot
    assert np.array_equal(one.readings.value, again.readings.value)
    assert not np.array_equal(one.readings.q, other.readings.q)


def test_cells_come_in_turn():
    """However few runs there are, they are of all kinds."""
    first = cases.cases("single", 216, 1)
    assert len({(c.effects, c.snr, c.poses) for c in first}) == 216
    assert cases.cases("single", 300, 1)[:216] == first


@pytest.mark.slow
def test_noise_is_as_stated():
    run = made(case("null_cluttered", "", 0.0, 60, number=1))
    rng = np.random.default_rng(1)
    for design in (run.design, replace(run.design, jitter=0.0)):
        moved = design.jitter * rng.normal(size=design.q.shape)
        still = measured.observed(run.bare, design)
        off = measured.observed(run.bare, design, moved) - still + measured.noise(design, rng)
        assert off.std() == pytest.approx(measured.scatter(design, run.oracle.model), rel=0.12)


def test_the_worker_opens_nothing_else(tmp_path, monkeypatch):
    own, other = (tmp_path / f"{worker.ROOMS}{name}" for name in ("data-1", "truth-1"))
    monkeypatch.setattr(worker, "allowed_folder", str(own))
    worker.guard("open", (str(own / "data.csv"), "r", 0))
    worker.guard("open", ("/usr/lib/anything", "r", 0))
    for event in ("open", "os.listdir", "os.scandir"):
        with pytest.raises(PermissionError):
            worker.guard(event, (str(other / "truth.json"),))


TRUTH = {("backlash", "A2")}
FAR, NEAR = [[Rival("link_gravity", "", 50.0)]], [[Rival("backlash", "A3", 3.0)]]
UNSEEN = [[Rival("nothing", "", 1.0)]]


@pytest.mark.parametrize(
    ("word", "names", "sets", "rivals", "outcome"),
    [
        ("named", TRUTH, [], FAR, "exact"),
        ("named", {("backlash", "A3")}, [], FAR, "wrong"),
        ("named", TRUTH | {("payload", "")}, [], FAR, "wrong"),
        ("partly_named", TRUTH, [], FAR, "partly"),
        ("ambiguous", TRUTH, [TRUTH | {("backlash", "A3")}], NEAR, "ambiguous"),
        ("ambiguous", TRUTH, [TRUTH | {("backlash", "A3")}], FAR, "undecided"),
        ("ambiguous", {("payload", "")}, [{("payload", ""), ("backlash", "A3")}], NEAR, "wrong"),
        # the truth is in a set, and something that is not there is claimed beside it
        ("ambiguous", TRUTH | {("payload", "")}, [{("payload", ""), ("hysteresis", "A4")}], FAR, "wrong"),
        ("ambiguous", TRUTH | {("payload", "")}, [TRUTH | {("backlash", "A3")}], NEAR, "wrong"),
        ("nothing_missing", set(), [], FAR, "missed"),
        ("nothing_missing", set(), [], UNSEEN, "unseen"),
        ("unknown", set(), [], FAR, "unknown"),
    ],
)
def test_outcomes(word, names, sets, rivals, outcome):
    assert verdicts.outcome_of_words(word, TRUTH, names, sets, False, rivals) == outcome


@pytest.mark.parametrize(
    ("names", "rivals", "outcome"),
    [
        (["backlash A2"], [FAR[0], UNSEEN[0]], "unseen"),
        (["backlash A2", "payload"], [FAR[0], UNSEEN[0]], "exact"),
        (["backlash A2"], [FAR[0], FAR[0]], "wrong"),
        (["backlash A2"], [UNSEEN[0], FAR[0]], "wrong"),
        (["backlash A3"], [FAR[0], UNSEEN[0]], "wrong"),
        (["hysteresis A4"], [UNSEEN[0], UNSEEN[0]], "wrong"),
    ],
)
def test_what_nobody_could_see_beside_the_rest_may_be_left_out(names, rivals, outcome):
    hidden = [
        (SimpleNamespace(effect=e, joint=j, outside=False), 1.0)
        for e, j in (("backlash", "A2"), ("payload", ""))
    ]
    run = SimpleNamespace(hidden=hidden, case=SimpleNamespace(row="pair"))
    named = [{"effect": one.split()[0], "joints": one.split()[1:]} for one in names]
    assert verdicts.outcome_of(run, {"verdict": "named", "named": named}, rivals) == outcome


def test_nulls_and_outsiders():
    assert verdicts.outcome_of_words("nothing_missing", set(), set(), [], False, []) == "exact"
    assert verdicts.outcome_of_words("named", set(), TRUTH, [], False, []) == "wrong"
    assert verdicts.outcome_of_words("named", {("windup", "A2")}, TRUTH, [], True, [[]]) == "wrong"
    assert verdicts.right("outside", "unknown")
    assert not verdicts.right("single", "unknown")


# The small fixed part.

NULLS = [
    case("null_clean", "", 0.0, 15),
    case("null_clean", "", 0.0, 30, 2),
    *(case("null_cluttered", "", 0.0, poses, number) for poses, number in ((15, 0), (30, 4), (15, 3))),
]
CLEAR = [
    *(case("single", "gravity_compensator", 5.0, 30, number) for number in (0, 1)),
    case("single", "link_compliance", 5.0, 30),
    case("single", "tool_compliance", 5.0, 15),
    case("single", "force_sensor", 5.0, 30),
    case("single", "joint_compliance", 5.0, 30, 1),
    case("single", "backlash", 5.0, 30, 1),
    case("single", "hysteresis", 5.0, 15),
    case("single", "joint_coupling", 5.0, 15),
]
ALIKE = [
    case("single", "link_compliance", 5.0, 30, 1),
    # waves of all gears do what weights, or a loop of hysteresis, and one wave do
    *(cases.cases(row, number + 1, 8200)[number] for row, number in (("pair", 10), ("triple", 21))),
]
STRANGE = [
    case("outside", "leaning_stiffness", 5.0, 30),
    # waves of half an order whose sides of approach are free, a hose, and friction in proportion to load
    *(cases.cases("outside", number + 1, 8200)[number] for number in (13, 18, 26)),
    # of half an order on one joint, for which waves of all gears pass
    cases.cases("outside", 6, 8400)[5],
]
HOPELESS = [case("unidentifiable", "balancer_at_one_angle", 2.0, 15, number) for number in (0, 1)]


@pytest.fixture(scope="module")
def said():
    """``said(case)``: the record of a run."""
    diagnosing = command.Diagnosing()
    yield lambda one: command.record_of(one, diagnosing, more=False)
    diagnosing.close()


def name(one):
    return f"{one.row} {' '.join(one.effects)} {one.poses} {one.number}"


@pytest.mark.slow
@pytest.mark.parametrize("one", NULLS, ids=name)
def test_nothing_is_named_where_nothing_is(said, one):
    record = said(one)
    assert record["outcome"] == "exact"
    assert not table.is_named(record)


@pytest.mark.slow
@pytest.mark.parametrize("one", CLEAR, ids=name)
def test_what_is_hidden_is_named(said, one):
    assert said(one)["outcome"] == "exact"


@pytest.mark.slow
@pytest.mark.parametrize("one", ALIKE, ids=name)
def test_what_an_oracle_can_not_tell_apart_is_ambiguous(said, one):
    assert said(one)["outcome"] == "ambiguous"


@pytest.mark.slow
@pytest.mark.parametrize("one", STRANGE, ids=name)
def test_what_no_library_has_is_unknown(said, one):
    record = said(one)
    assert record["outcome"] == "unknown"
    assert not table.is_named(record)


@pytest.mark.slow
@pytest.mark.parametrize("one", HOPELESS, ids=name)
def test_what_can_not_be_told_apart_is_not_claimed(said, one):
    assert said(one)["right"]


@pytest.mark.slow
def test_poses_that_settle_it(tmp_path_factory):
    """Where A2 hardly moves, a balancer is some stiffness of it; the poses that are proposed take it through its range,
    and with them it is the balancer."""
    one, kept = cases.cases("compensator_narrow", 1, 21)[0], {}

    def diagnosing(folder, data, robot, new):
        answer = process(folder, data, robot, new)
        kept[new] = answer
        return answer

    process = command.Diagnosing()
    record = command.record_of(one, diagnosing)
    process.close()
    assert kept["new"]["verdict"] == "ambiguous"
    assert kept["new"]["ambiguous"] == [["gravity_compensator", "joint_compliance"]]
    angles = [pose["A2"] for pose in kept["new"]["next_poses"]]
    assert min(angles) < -135
    assert max(angles) > -45
    assert record["later"]["outcome"] == "exact"


def test_a_plan_is_filled_in_as_asked():
    """What is read where a plan asks for it is what the plant does there, in the plan's own columns."""
    run = made(case("single", "thermal_growth", 5.0, 15))
    design = run.design
    names = ",".join([*(f"A{i}" for i in range(1, 7)), "TARGET", "X", "Y", "Z", "T", "TEMP"])
    rows = [
        f"{','.join(map(str, np.degrees(q)))},M{k + 1},,,,,"
        for q in design.q[:2]
        for _ in range(design.wrench.shape[1])
        for k in range(design.points)
    ]
    plan = "\n".join(["# frame: tracker", names, *rows])
    filled = measured.filled(
        run.scene, replace(design, sigma=0.0, jitter=0.0), plan, np.random.default_rng(1)
    )
    again = [line.split(",") for line in filled.splitlines()[2:] if line]
    assert len(again) == len(rows)
    for given, row in zip(rows, again, strict=True):
        assert ",".join(row[:7]) == given.removesuffix(",,,,,")
        assert all(row[7:])
    warm = design.temperature[-1] - design.temperature[0]
    assert float(again[0][-1]) == pytest.approx(design.temperature[-1])
    assert warm > 1.0


@pytest.mark.slow
def test_tables_count_every_run(tmp_path):
    answer = {"verdict": "unknown", "seconds": 1.0}
    common = {"snr": 2.0, "poses": 15, "reached": True, "rivals": [], "covered": None, "answer": answer}
    records = [
        {**common, "row": "single", "effects": [effect], "outcome": "unknown", "right": False}
        for effect in EVERY
    ]
    assert table.confusion(records)[2].sum() == len(EVERY)
    assert any("0 of   18" in line for line in table.matrix(records))
    table.picture(records, tmp_path / "confusion.png")
    assert (tmp_path / "confusion.png").stat().st_size > 10_000


@pytest.mark.parametrize(("other", "there"), [("link_gravity", True), ("link_compliance", False)])
def test_a_set_counts_by_itself(other, there):
    """A set has a truth in it also where another effect was missed; another joint's is none."""
    two = [{"effect": name, "joint": "A2"} for name in (other, "joint_compliance")]
    record = {
        "truth": [["backlash", "A3"], ["link_gravity", ""], ["link_compliance", "A3"]],
        "answer": {"alternatives": [two]},
    }
    assert table.has_true_sets(record) == there


def test_intervals_are_counted_by_row_and_kind_of_parameter():
    inside, outside_, unknown = ([True, held, 1.0, 0.1, 1.0, 1.0] for held in (True, False, None))
    records = [
        {"key": "1", "row": "pair", "covered": {"payload.mass": inside, "joint_offset.o2": outside_}},
        {"key": "2", "row": "single", "covered": {"joint_offset.o3": inside, "joint_offset.o4": unknown}},
        {"key": "3", "row": "single", "covered": None},
    ]
    counted = {line.split(",")[1].split()[0]: line.split()[5:8] for line in table.of_intervals(records)}
    assert counted["joint_offset"] == ["1", "of", "2"]
    assert counted["pair"] == ["1", "of", "2"]
    assert counted["single"] == counted["payload"] == ["1", "of", "1"]


def test_what_goes_together_in_a_run_counts_as_one():
    """200 runs of twenty values each: independent ones count all, those that agree within a run as 200."""
    rng = np.random.default_rng(3)
    alone = [rng.random(20) < 0.9 for _ in range(200)]
    together = [[held] * 20 for held in rng.random(200) < 0.9]
    widths = []
    for runs in (alone, together):
        told = table.share_of_runs([[bool(held) for held in one] for one in runs])
        low, high = (float(word) for word in told.partition("(")[2].rstrip(")").split(" .. "))
        widths.append(high - low)
    assert widths[0] == pytest.approx(2 * 196 * np.sqrt(0.09 / 4000), rel=0.2)
    assert widths[1] == pytest.approx(2 * 196 * np.sqrt(0.09 / 200), rel=0.2)


def test_what_was_run_is_not_run_again(tmp_path):
    path = tmp_path / "runs.jsonl"
    path.write_text('{"key": "single/0/1", "x": 1}\n{"key": "other/0/2"}\n{"key": "single/1')
    assert command.kept_records(path) == [{"key": "single/0/1", "x": 1}, {"key": "other/0/2"}]
    path.write_text('{"row": "length", "number": 1, "seed": 2}\n{"row": "len')
    assert real_command.kept(path) == [{"row": "length", "number": 1, "seed": 2}]


@pytest.mark.slow
def test_a_zero_that_stated_lengths_express_is_their_own():
    """A robot file that states all lengths and twists, and a zero of A2 that it does not: turning what follows A2 is a
    shift of A3 and a zero there."""
    run = next(made(c) for c in cases.cases("single", 60, 1) if c.effects == ("joint_offset",))
    ((hidden, size),) = run.hidden
    assert run.oracle.is_own(hidden, size)
    other = next(made(c) for c in cases.cases("single", 60, 1) if c.effects == ("transmission_error",))
    ((hidden, size),) = other.hidden
    assert not other.oracle.is_own(hidden, size)
    changed = {"verdict": "nothing_missing", "refitted": [{"parameter": "link_geometry.dx3"}]}
    unchanged = {"verdict": "nothing_missing", "refitted": []}
    named = {
        "verdict": "named",
        "named": [{"effect": "payload", "joints": []}],
        **{"refitted": changed["refitted"]},
    }
    outcomes = [verdicts.outcome_of(run, answer, [[]]) for answer in (changed, unchanged, named)]
    assert outcomes == ["exact", "missed", "wrong"]


@pytest.mark.slow
def test_what_a_whole_arm_predicts_alike_is_an_equal_rival():
    """A weight on the flange and first moments of all links: the oracle tells them as little apart as anybody."""
    case = next(c for c in cases.cases("single", 60, 1) if c.effects == ("payload",))
    run = made(case)
    nearest = verdicts.nearest(run, 0, run.readings.value - run.without)[0]
    assert (nearest.effect, nearest.joint, nearest.margin) == ("link_gravity", "", 0.0)


def test_fresh_poses_are_as_they_were_where_nothing_was_found():
    run = made(case("single", "joint_compliance", 5.0, 15))
    old, knowing = gap.fresh(run, run.oracle.model)
    assert old == pytest.approx(1.0)
    assert knowing < 0.5
    records = [
        {"fresh": [x, y], "snr": snr, "reached": True}
        for x, y, snr in ((0.1, 0.05, 2.0), (0.3, 0.2, 5.0), (0.9, 0.9, 1.0))
    ]
    told = table.of_fresh([*records, {"fresh": None, "snr": 2.0, "reached": True}])
    assert "0.200 in the median, 0.300 at worst of 2" in told[0]
    assert "0.125 in the median, 0.200 at worst of 2" in told[1]
    assert table.of_fresh(records[2:]) == []
