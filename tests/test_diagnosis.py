"""The parts of a diagnosis: what parameters cost, what does not grow in proportion, what is chance."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from blind.arm import model_of, robot_file
from blind.measured import readings as blind_readings
from blind.real_worlds import campaign as drawn_campaign
from measured import MARKERS, on_markers, plan, robot

from postproc.base.geometry import Poses
from postproc.diagnosis import approach_sides, candidate_fits, diagnosis, verdict
from postproc.diagnosis.accidents import gross_errors
from postproc.diagnosis.candidate_fits import ChoiceFits
from postproc.diagnosis.candidates import candidates, fewest_parameters, is_visible
from postproc.diagnosis.decoys import AlternativeForm, decoys
from postproc.diagnosis.diagnosis import diagnose
from postproc.diagnosis.imitations import is_implausible
from postproc.diagnosis.nonlinear_effects import broyden_update, evaluate_at_size
from postproc.diagnosis.residual_patterns import ResidualPattern, residual_patterns
from postproc.diagnosis.search import SHARED, drop_confounded, limit_shared_scatter, model_unknowns, search
from postproc.diagnosis.selection import complexity_penalty, counts, explained, problem, selected
from postproc.diagnosis.verdict import (
    BUILT,
    MARGIN,
    ONLY_TOGETHER,
    OTHER_COURSE,
    ambiguity_set,
    held_out_gain,
    judge,
)
from postproc.effects import Conditions
from postproc.effects.thermal_growth import ThermalGrowth
from postproc.effects.transmission_error import TransmissionError
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Estimate, fit
from postproc.identification.unknowns import asked_for
from postproc.measurements import measurements_csv
from postproc.model import StiffnessModel
from postproc.robot.description import load_robot
from postproc.workflows.diagnose import DiagnoseRequest, diagnose_robot

SIGMA = 2e-5
SAMPLES = Path(__file__).parent.parent / "samples"
TOOL = Poses(np.eye(3), np.array([0.0, 0.5, 0.2]))


@cache
def stated():
    """The joints' compliance of an arm, c1 not stated: hung weights do not show it."""
    model = StiffnessModel.from_robot(robot("kuka_kr270")).without_effects(["gravity_compensator"])
    (term,) = model.terms
    return replace(model, terms=(replace(term, stated={k: v for k, v in term.stated.items() if k != "c1"}),))


def campaign_of(model, poses=20, seed=0, shared=0.0, wild=0.0, loads=(2600.0,), **where):
    """Readings of three targets under weights, of ``model``; those of a pose ``shared`` [m] an error, a share ``wild``
    of them is three times as far off.  ``where``: as of ``plan``."""
    rng = np.random.default_rng(seed)
    q = np.repeat(rng.uniform(*model.robot.limits.T, (poses, 6)), len(loads), axis=0)
    wrench = np.zeros((len(q), 6))
    wrench[:, 2] = -np.tile(loads, poses)
    rows, wrench, words = on_markers(q, wrench)
    readings = plan(model.robot, rows, wrench, tool=TOOL, sigma=SIGMA, **words, **where)
    campaign = Campaign(readings)
    value = campaign.expected(campaign.predicted(model), campaign.start())[0]
    size = np.where(rng.random(len(rows)) < wild, 3.0, 1.0)[:, None]
    value = value + SIGMA * size * rng.normal(size=value.shape)
    value += shared * np.repeat(rng.normal(size=(poses, 3)), len(loads) * len(MARKERS), axis=0)
    return Campaign(replace(readings, value=value))


def fitted(campaign, model=None):
    model = model or stated()
    return fit(campaign, model, model_unknowns(model))


# What parameters cost


def test_a_parameter_costs_what_it_would_have_shown():
    """One that explains the squares g costs 1 + ln g: g - 1 - ln g is the most that a normal prior of any width can
    average."""
    rng = np.random.default_rng(1)
    column = rng.normal(size=(60, 1))
    column /= np.linalg.norm(column)
    for gain in (30.0, 500.0):
        left = np.sqrt(gain) * column[:, 0]
        for scale in (1e-3, 1.0, 1e4):
            assert complexity_penalty(scale * column, left, 1.0) == pytest.approx(1 + np.log(gain), rel=0.02)


def test_what_can_not_be_seen_costs_nothing():
    rng = np.random.default_rng(2)
    basis = np.linalg.qr(rng.normal(size=(60, 3)))[0]
    left = 20.0 * basis[:, 0]
    alone = complexity_penalty(basis[:, :1], left, 1.0)
    # beside it two that would have shown as well, and are not there
    clear = complexity_penalty(basis, left, 1.0)
    assert clear > alone + 2 * 0.9 * np.log(20.0**2) - 3
    unseen = complexity_penalty(basis * [1.0, 1e-4, 1e-4], left, 1.0)
    assert unseen == pytest.approx(alone, abs=0.01)
    assert complexity_penalty(0 * basis, left, 1.0) == 0.0


# What does not grow in proportion


def test_columns_of_a_whole_effect_foresee_it():
    rng = np.random.default_rng(3)
    columns, does, values = rng.normal(size=(7, 3, 2)), rng.normal(size=(7, 3)), np.array([0.5, -2.0])
    np.testing.assert_allclose(broyden_update(columns, does, values) @ values, does, atol=1e-12)
    np.testing.assert_array_equal(broyden_update(columns, does, 0 * values), columns)
    # what foresees it already is not changed
    np.testing.assert_allclose(broyden_update(columns, columns @ values, values), columns, atol=1e-12)


@pytest.mark.parametrize("times", [0.2, 10.0])
def test_an_effect_is_looked_at_as_large_as_it_is(times):
    """A cubic spring much weaker or stiffer than usual: its columns at the null say little of what it does."""
    asked = asked_for(stated(), ["joint_stiffening.k3"])
    (unknown,) = asked.unknowns
    value = times * unknown.parameter.scale
    campaign = campaign_of(asked.model.with_values({unknown.key: value}), 30, loads=(1200.0, 2600.0))
    point = fit(campaign, stated(), ()).point
    large = evaluate_at_size(
        campaign, point, asked.model, asked.unknowns, lambda c: c.reshape(-1, c.shape[2]) / SIGMA
    )
    assert large.values[0] == pytest.approx(value, rel=0.1)
    assert np.mean(large.remaining**2) == pytest.approx(1.0, abs=0.2)
    assert np.mean(large.target**2) > np.mean(large.remaining**2) + 0.1
    (column,) = np.moveaxis(large.columns, 2, 0)
    np.testing.assert_allclose(
        column * large.values[0] / unknown.parameter.scale,
        (large.target - large.remaining).reshape(-1, 3) * SIGMA,
        atol=1e-9,
    )


# What is looked for


def test_a_gain_of_the_force_is_a_softer_arm():
    campaign = campaign_of(stated(), 20, loads=(1200.0, 2600.0))
    base = fitted(campaign)
    every = candidates(campaign, base.model, base.point.nuisances)
    left = drop_confounded(campaign, base, replace(base.weights, shared=0.0), every)
    names = [
        {u.parameter.name for u in c.unknowns}
        for several in (every, left)
        for c in several
        if c.name == "force_sensor"
    ]
    assert "gain" in names[0]
    assert names[1]
    assert "gain" not in names[1]


def test_what_only_absurd_sizes_imitate_stays_to_be_found():
    """A zero of A4 and a turn of A5 about nearly the same line, half a radian against each other, shift A6 sideways."""
    model = model_of(robot_file(True, False, [("link_geometry", "A6")]))
    full = model_of(robot_file(True, False))
    place = next(i for i, t in enumerate(full.terms) if t.effect.name == "link_geometry")
    design = replace(drawn_campaign(np.random.default_rng(5), 40, stated=True), jitter=0.0)
    empty = Campaign(blind_readings(design, np.zeros((len(design.q) * design.points, 3)), SIGMA))
    true = full.with_values({(place, "dx5"): 4e-4, (place, "dy6"): 2e-4})
    value = -empty.residual(empty.predicted(true), empty.start())[:, :3]
    value = value + SIGMA * np.random.default_rng(6).normal(size=value.shape)
    campaign = Campaign(replace(empty.readings, value=value))
    base = fit(campaign, model, model_unknowns(model))
    every = candidates(campaign, base.model, base.point.nuisances)
    left = drop_confounded(campaign, base, replace(base.weights, shared=0.0), every)
    (sixth,) = [c for c in left if (c.name, c.joint) == ("link_geometry", "A6")]
    assert "dy6" in {u.parameter.name for u in sixth.unknowns}


def test_differences_show_no_places():
    campaign = campaign_of(stated())
    base = fitted(campaign)
    every = candidates(campaign, base.model, base.point.nuisances)
    shown = {c.name for c in every if is_visible(c, base.weights)}
    assert {"gravity_compensator", "backlash", "link_compliance", "base_compliance"} <= shown
    assert not {"joint_offset", "transmission_error", "hysteresis", "thermal_growth"} & shown


def test_weights_are_looked_for_up_to_each_joint():
    model = stated()
    campaign = campaign_of(model)
    steps = [c for c in candidates(campaign, model, campaign.start()) if c.name == "link_gravity"]
    assert [c.up_to_joint for c in steps] == ["A2", "A3", "A4", "A5", ""]
    assert all(later.contains(earlier) for earlier, later in pairwise(steps))
    assert not steps[0].contains(steps[1])
    assert len({c.label for c in steps}) == len(steps)


def test_a_compensator_is_told_from_a_stiffness_that_varies():
    model = stated()
    spring = StiffnessModel.from_robot(robot("kuka_kr270"))
    campaign = campaign_of(spring, 30, loads=(1200.0, 2600.0))
    base = fitted(campaign)
    found = [
        c for c in candidates(campaign, base.model, base.point.nuisances) if c.name == "gravity_compensator"
    ]
    (foil,) = decoys(base.model, campaign, found[0])
    assert (foil.name, foil.joint) == ("joint_compliance", "A2")
    assert "varying with its angle" in foil.label
    other = next(c for c in candidates(campaign, model, campaign.start()) if c.name == "tool_compliance")
    assert not decoys(base.model, campaign, other)


@pytest.mark.slow
def test_hardware_of_the_file_is_doubted_only_where_something_else_explains_more():
    spring = StiffnessModel.from_robot(robot("kuka_kr270"))
    campaign = campaign_of(spring, 30, loads=(1200.0, 2600.0))
    plain = StiffnessModel.from_robot(load_robot(SAMPLES / "kr270_missing_compensator" / "kr270_plain.yaml"))
    found = search(ChoiceFits(campaign, fitted(campaign, plain)))
    (group,) = found.explained.groups
    foil = next(rival for rival in found.rivals if rival.is_decoy)

    def sets(worse, seen):
        other = replace(found, rivals=(replace(foil, worse=worse, more=0.0),))
        return len(ambiguity_set(other, group, seen))

    assert sets(BUILT, True) == sets(0.0, True) == sets(-0.9 * BUILT, True) == 1
    assert sets(-1.1 * BUILT, True) == 2

    def refused(worse, **change):
        other = replace(found, rivals=(replace(foil, worse=worse, more=0.0, fitted=True, **change),))
        return OTHER_COURSE in [why for _, why in judge(other).rejected]

    assert refused(-1.1 * MARGIN)
    assert not refused(-0.9 * MARGIN)
    named = next(c for c in found.linear.candidates if c.name == "backlash")
    assert not refused(-1.1 * MARGIN, candidate=named), "that has a name"
    assert not refused(-1.1 * MARGIN, of=named.key), "that is another's"
    # of which the readings do not tell that it is there
    assert sets(0.9 * MARGIN, False) == 2
    assert sets(1.1 * MARGIN, False) == 1


def wave(model, order):
    """The arm with an error of A3 over its angle that comes back ``order`` times a turn."""
    size = dict.fromkeys((f"s3_{order:g}", f"c3_{order:g}"), 2e-4)
    wider = model.with_effect(TransmissionError(model.robot.joints, (order,)))
    return wider.with_values({(len(model.terms), name): value for name, value in size.items()})


@pytest.mark.slow
def test_a_wave_of_another_order_is_no_harmonic():
    # half a wave over the range of A3 looks like its zero for the most part, and is none
    for order, word in ((1.0, "named"), (2.0, "named"), (0.5, "unknown"), (1.5, "unknown")):
        campaign = campaign_of(wave(stated(), order), 40, deflection=False, in_robot_frame=True)
        told = diagnose(campaign, stated()).verdict
        assert told.word == word, order
        assert ("transmission_error" in {n.effect for n in told.named}) == (word == "named")
        if word == "named":
            assert [(n.effect, n.joints) for n in told.named] == [("transmission_error", ("A3",))]
            (named,) = told.named
            assert named.evidence.alias is None or not isinstance(
                named.evidence.alias.effect, AlternativeForm
            )


@pytest.mark.parametrize(
    ("share", "known", "more"), [(0.05, True, False), (0.07, True, True), (0.05, False, True)]
)
def test_a_faint_pattern_leaves_a_name_as_it_is(monkeypatch, share, known, more):
    monkeypatch.setattr(verdict, "reduced_chi2_of", lambda search, last: (1.0, False))
    search = SimpleNamespace(
        linear=SimpleNamespace(problem=SimpleNamespace(known=known)), explained=None, chosen=()
    )
    assert verdict.more_remains(search, [ResidualPattern("A2 over its angle", "", share)]) == more
    assert not verdict.more_remains(search, [])


@pytest.mark.slow
def test_a_stand_that_creeps_is_no_link_that_grows():
    model, hours = stated(), np.repeat(np.linspace(0.0, 3600.0, 40), len(MARKERS))
    growth = ThermalGrowth(model.robot.joints, "time")
    grown_arm = model.with_effect(growth).with_values({(len(model.terms), "g3"): 4e-8})

    def told(arm, creep):
        campaign = campaign_of(arm, 40, deflection=False, conditions=Conditions(None, time=hours))
        value = campaign.readings.value + creep * hours[:, None] * np.array([0.3, 0.4, 0.8])
        return diagnose(Campaign(replace(campaign.readings, value=value)), model).verdict

    named = told(grown_arm, 0.0)
    assert [(n.effect, n.joints) for n in named.named] == [("thermal_growth", ("A3",))]
    creeping = told(model, 6e-8)
    assert (creeping.word, creeping.named) == ("unknown", ())
    assert OTHER_COURSE in [why for _, why in creeping.rejected]


def test_what_is_large_and_hardly_told_is_not_believed():
    unknown = asked_for(stated(), ["backlash.b2"]).unknowns[0]
    scale = unknown.parameter.scale

    def estimates(*of):
        return [Estimate(unknown, size * scale, share * size * scale, False) for size, share in of]

    assert is_implausible(estimates((30.0, 0.9)))
    assert not is_implausible(estimates((30.0, 0.1)))
    assert not is_implausible(estimates((1.0, 0.9)))
    assert not is_implausible(estimates((30.0, 0.9), (30.0, 0.1)))
    assert not is_implausible([])


# What is chance


@pytest.mark.slow
def test_no_pattern_is_seen_in_what_poses_share():
    """Errors that the readings of a pose share, and wild ones, are no structure."""
    told = 0
    for seed in range(30):
        campaign = campaign_of(stated(), 20, seed, shared=3 * SIGMA, wild=0.1)
        told += bool(residual_patterns(fitted(campaign), chance=0.01))
    assert told <= 2


def test_a_pattern_is_seen():
    spring = StiffnessModel.from_robot(robot("kuka_kr270"))
    assert any(
        "A2 over" in one.variable for one in residual_patterns(fitted(campaign_of(spring, 60)), chance=0.001)
    )
    # in fewer poses against the scatter that is known
    campaign = campaign_of(spring, 20)
    first, *_ = residual_patterns(fitted(campaign), fit(campaign, spring, ()))
    assert "A2 over" in first.variable


def test_accidents_strike_one_reading_or_one_pose():
    """Where several poses are off as a whole the arm was there: what opens under large loads alone looks like that."""
    good = campaign_of(stated(), 60)

    def struck(*rows):
        value = good.readings.value.copy()
        value[list(rows)] += [0.0, 2e-3, 0.0]
        return sorted(one.row for one in gross_errors(fitted(Campaign(replace(good.readings, value=value)))))

    assert struck() == []
    assert struck(7, 70) == [7, 70]
    assert struck(30, 31, 32, 70) == [30, 31, 32, 70]
    assert struck(30, 31, 32, 90, 91, 92) == []
    assert struck(*range(0, 180, 9)) == [], "so many are no accidents"


@pytest.mark.parametrize(("rows", "word"), [((30,), "nothing_missing"), ((30, 31), "unknown")])
def test_where_two_targets_agree_the_arm_stood_elsewhere(tmp_path, rows, word):
    """Of one reading a beam may be broken; what opens under one load alone moves all targets of a pose."""
    good = campaign_of(StiffnessModel.from_robot(robot("kuka_kr270")), 24)
    value = good.readings.value.copy()
    value[list(rows)] += [0.0, 2e-3, 0.0]
    file = tmp_path / "loads.csv"
    file.write_bytes(measurements_csv(replace(good.readings, value=value)))
    done = diagnose_robot(DiagnoseRequest(data=(file,), robot="kuka_kr270"))
    assert (done.verdict.word, done.exit) == (word, 3)
    told = [finding.message for finding in done.findings if finding.code == "DIA002"]
    assert len(told) == len(rows)
    assert all(("the arm stood elsewhere" in one) == (len(rows) > 1) for one in told)


def test_what_poses_share_is_no_more_than_scatter_can_be():
    base = fitted(campaign_of(stated(), 20, shared=20 * SIGMA))
    assert base.weights.shared > 10 * SIGMA
    assert limit_shared_scatter(base, base).shared == pytest.approx(SHARED * SIGMA)
    # what is stated is all the scatter of a coordinate, shared or not
    assert limit_shared_scatter(base, base).shared < 1.001 * SIGMA
    little = fitted(campaign_of(stated(), 20, shared=0.9 * SIGMA))
    assert 0 < little.weights.shared < SHARED * SIGMA
    assert limit_shared_scatter(base, little).shared == little.weights.shared


@pytest.mark.slow
def test_a_few_poses_do_not_foretell_a_campaign():
    """Of two sessions of which one is most of all, only the other is left out."""
    spring = StiffnessModel.from_robot(robot("kuka_kr270"))
    campaign = campaign_of(spring, 24, loads=(1200.0, 2600.0))
    found = search(ChoiceFits(campaign, fitted(campaign)))
    (group,) = found.explained.groups
    rows = np.arange(len(campaign))
    small = held_out_gain(found, found.explained, group, (rows >= len(rows) - 18).astype(np.int64))
    swapped = held_out_gain(found, found.explained, group, (rows < len(rows) - 18).astype(np.int64))
    assert small == pytest.approx(swapped)
    both = held_out_gain(found, found.explained, group, (rows >= len(rows) // 2).astype(np.int64))
    assert both > small > 0
    assert np.isnan(held_out_gain(found, found.explained, group, 0 * rows))
    assert judge(found).word in ("named", "ambiguous")


def linear_problem(count, size, far=0.0):
    """``count`` readings of unit variance and one group, whose part of them has the root mean square ``size``; ``far``:
    what two of the readings that it moves have beside that."""
    rng = np.random.default_rng(3)
    column = rng.normal(size=(count, 1))
    residual = rng.normal(size=count) + size * column[:, 0]
    most = np.argsort(-np.abs(column[:, 0]))[:2]
    residual[most] += far * np.sign(column[most, 0])
    reach = np.array([[-1e9, 1e9]])
    return problem(residual, np.zeros((count, 0)), [(column, reach)], count, True)


@pytest.mark.parametrize(
    ("count", "size", "far", "named"),
    [(3000, 0.1, 0.0, False), (3000, 0.3, 0.0, True), (200, 0.0, 12.0, False), (200, 0.5, 0.0, True)],
)
def test_what_is_worth_a_name(count, size, far, named):
    """A tenth of the scatter is not, however clearly many readings show it, nor what two readings far off ask for."""
    given = linear_problem(count, size, far)
    without, with_ = explained(given, ()), explained(given, (0,))
    assert without.squares - with_.squares > 20.0
    assert counts(given, without, with_, 30) == named


def test_two_effects_are_no_third_of_many_columns():
    """Ten columns that hold what two effects of one column do explain the most by themselves; two need fewer."""
    rng = np.random.default_rng(5)
    two = rng.normal(size=(300, 2))
    others = two @ rng.normal(size=(2, 2)) + 0.05 * rng.normal(size=(300, 2))
    many = np.concatenate([others, rng.normal(size=(300, 8))], axis=1)
    residual = two @ [1.0, 1.0] + rng.normal(size=300)
    groups = [(part, np.tile([-1e9, 1e9], (part.shape[1], 1))) for part in (many, two[:, :1], two[:, 1:])]
    given = problem(residual, np.zeros((300, 0)), groups, 300, True)
    assert explained(given, (0,)).squares < min(explained(given, (g,)).squares for g in (1, 2))
    assert sorted(selected(given, range(3), sums=[0]).groups) == [1, 2]
    assert selected(given, range(3)).groups == (0,)


def test_of_two_forms_with_the_same_parameters_one_stays():
    model = stated()
    campaign = campaign_of(model, in_robot_frame=True, deflection=False)
    every = [c for c in candidates(campaign, model, campaign.start()) if c.name == "joint_offset"]
    (whole,) = [c for c in every if c.joint == "all joints"]
    one = next(c for c in every if c.joint == "A3")
    same = replace(whole, unknowns=one.unknowns)
    assert fewest_parameters([one, same]) == [one]
    assert fewest_parameters([same, one]) == [same]
    assert fewest_parameters([whole, one]) == [one]


# What is fitted, and how often


def test_a_choice_is_fitted_once(monkeypatch):
    """A search that is done again comes by the same choices; what is exact serves where it need not be."""
    campaign = campaign_of(stated(), 12)
    base = fitted(campaign)
    one, other = (
        next(c for c in candidates(campaign, base.model, base.point.nuisances) if (c.name, c.joint) == key)
        for key in (("joint_stiffening", "A2"), ("joint_stiffening", "A3"))
    )
    asked: list[bool] = []
    done = candidate_fits.with_effects

    def counted(campaign, base, chosen, exact=True):
        asked.append(exact)
        return done(campaign, base, chosen, exact)

    monkeypatch.setattr(candidate_fits, "with_effects", counted)
    fits = ChoiceFits(campaign, base)
    assert fits.of([]) is base
    rough = fits.of([one, other], exact=False)
    assert fits.of([other, one], exact=False) is rough
    exact = fits.of([one, other])
    assert fits.of([one, other], exact=False) is fits.of([other, one]) is exact
    assert asked == [False, True]
    assert fits.of([one]) is not exact


def test_half_an_explanation_names_nobody(monkeypatch):
    """Where what is clear makes the readings worse without what is not, all that was found fits only together."""
    spring = StiffnessModel.from_robot(robot("kuka_kr270"))
    plain = StiffnessModel.from_robot(load_robot(SAMPLES / "kr270_missing_compensator" / "kr270_plain.yaml"))
    campaign = campaign_of(spring, 16, loads=(1200.0, 2600.0))

    def with_another(fits, banned=()):
        found = search(fits, banned)
        other = next(c for c in found.linear.candidates if (c.name, c.joint) == ("joint_stiffening", "A3"))
        return replace(found, chosen=(*found.chosen, other))

    def undecided(found):
        told = judge(found)
        (spring_of,), clear = told.named, found.chosen[-1]
        other = next(c for c in found.linear.candidates if (c.name, c.joint) == ("joint_stiffening", "A2"))
        named = spring_of, replace(spring_of, candidate=clear, joints=("A3",))
        return replace(told, word="ambiguous", named=named, alternatives=((spring_of.candidate, other),))

    def diagnosed(*squares):
        left = iter(squares)
        monkeypatch.setattr(diagnosis, "weighted_squares", lambda fit, weights: next(left))
        return diagnosis.diagnose(campaign, plain)

    monkeypatch.setattr(diagnosis, "search", with_another)
    monkeypatch.setattr(diagnosis, "judge", undecided)
    monkeypatch.setattr(diagnosis, "largest_disagreement", lambda *words: np.inf)
    # with what is clear, with the model's own parameters alone, as the robot file is
    half = diagnosed(2.0, 1.0, 3.0)
    assert (half.verdict.word, half.verdict.named, half.agreed) == ("unknown", (), False)
    assert [why for _, why in half.verdict.rejected] == [ONLY_TOGETHER] * 2
    assert [t.effect.name for t in half.final.model.terms] == ["joint_compliance"]
    good = diagnosed(1.0, 2.0, 3.0)
    assert (good.verdict.word, len(good.verdict.named)) == ("ambiguous", 2)
    assert good.verdict.rejected == ()


# Sides of approach


def test_many_columns_of_few_readings_are_no_sides(monkeypatch):
    """All effects of approach together explain a part of any residual, the more the fewer readings there are."""
    campaign = campaign_of(stated(), 8)
    some = Campaign(replace(campaign.readings, direction=np.zeros_like(campaign.readings.q)))
    base = fitted(some)
    done = SimpleNamespace(search=SimpleNamespace(chosen=(), final=base))
    rng = np.random.default_rng(1)
    sides = [
        Campaign(replace(campaign.readings, direction=np.repeat(rng.choice([-1.0, 1.0], (8, 6)), 3, axis=0)))
        for _ in range(10)
    ]
    tried = sum(approach_sides.may_explain(one, done) for one in sides)
    monkeypatch.setattr(approach_sides, "WORTH_TRYING", -10.0)
    assert all(approach_sides.may_explain(one, done) for one in sides)
    assert tried <= 5
