"""Effects that a part may hide: one that shows is named and corrected, one that has no place is not."""

import numpy as np
import pytest
from blind_parts.cutting import aligned_rms, cut, probe, surface_of, write_csv
from blind_parts.shop import surface_points, write_shop
from blind_parts.truth import draw_truth

import postproc
from postproc.learning.candidates import MissingEffect
from postproc.learning.causes import Cause, CauseKind
from postproc.learning.next_program import FeedTurns


def test_a_corner_reaches_as_far_as_the_cutter():
    """Two vertices of a quarter turn, 100 mm apart, and a path of 1 m: 1 within the radius, 0 beyond, 1/2 at it."""
    station = np.array([0.448, 0.452, 0.548, 0.552])
    turned = 0.5 * np.pi * np.array([0.0, 1.0, 1.0, 2.0])
    turns = FeedTurns(station, turned, np.array([1.0]), np.array([1.0]))
    share = np.array([0.30, 0.4395, 0.442, 0.445, 0.45, 0.458, 0.47, 0.5, 0.55, 0.7])
    weight = turns.at(np.zeros(10, int), share, np.full(10, 0.008))
    assert weight == pytest.approx([0, 0, 0.5, 1, 1, 0.5, 0, 0, 1, 0], abs=0.13)
    wide = turns.at(np.zeros(1, int), np.array([0.5]), np.array([0.06]))
    assert wide == pytest.approx([1.0])
    sigma = turns.sigma_at(np.zeros(10, int), share, np.full(10, 0.008))
    assert sigma == pytest.approx([0, 0, 0.5, 0, 0, 0.5, 0, 0, 0, 0], abs=0.2)


def test_a_size_that_cannot_be_negative_gains_nothing_from_it():
    """The same column with either sign: the evidence of the one that the data contradict is far below that of none."""
    from postproc.learning.covariance import Explanation, Layout, SmoothField
    from postproc.learning.naming import gains_with

    rng = np.random.default_rng(0)
    count = 60
    place = rng.uniform(0, 0.3, (count, 3))
    normal = np.tile([0.0, 0.0, 1.0], (count, 1))
    layout = Layout(place, normal, np.full(count, 1e-5), np.zeros((count, 0)), np.zeros(count, int))
    column = 3e-5 * np.sign(rng.normal(size=(count, 1)))
    rest = 1.2 * column[:, 0] + rng.normal(0, 1e-5, count)
    bare = Explanation(layout, SmoothField(), rest, np.zeros((count, 0)), np.zeros(count))
    cause = Cause("backlash.b1", "effect", CauseKind.VALUE, 6e-5, "rad", positive=True)
    gains = {}
    for sign in (1.0, -1.0):
        candidate = MissingEffect("backlash of A1", (cause,), None, sign * column, True)
        gains[sign] = max(gains_with(bare, candidate, np.arange(count)))
    assert gains[1.0] > 100
    assert gains[-1.0] < gains[1.0] - 100


def layout_of(rng, count):
    """Points of a plate with a normal of their own each, and a probe of 10 um."""
    from postproc.learning.covariance import Layout

    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    free = np.zeros((count, 0))
    return Layout(rng.uniform(0, 0.3, (count, 3)), normal, np.full(count, 1e-5), free, np.zeros(count, int))


@pytest.mark.parametrize("sigma", [None, 2e-5])
def test_the_gain_of_an_effect_is_the_ratio_of_two_normal_densities(sigma):
    """Against scipy's density of the whole covariance, for a shift of either sign, and where it is not sure whether it
    acts on a point."""
    from scipy.stats import multivariate_normal

    from postproc.learning.candidates import FACTORS
    from postproc.learning.covariance import Explanation, SmoothField
    from postproc.learning.naming import gains_with

    rng = np.random.default_rng(3)
    count = 25
    layout, columns = layout_of(rng, count), 1e-5 * rng.normal(size=(count, 2))
    rest, causes = 3e-5 * rng.normal(size=count), 2e-5 * rng.normal(size=(count, 3))
    bare = Explanation(layout, SmoothField(1e-5, 0.06, 3e-6), rest, causes, 1e-5 * rng.normal(size=count))
    effect = MissingEffect(
        "drift", tuple(Cause(a, "effect", CauseKind.SHIFT, 1.0) for a in "xy"), None, columns, False,
        column_sigma=None if sigma is None else sigma * rng.uniform(size=count),
    )  # fmt: skip
    covariance = layout.covariance(bare.surface, bare.by_force) + causes @ causes.T
    for factor, gain in zip(FACTORS, gains_with(bare, effect, np.arange(count)), strict=True):
        with_it = covariance + factor**2 * columns @ columns.T
        if effect.column_sigma is not None:
            with_it = with_it + factor**2 * np.diag(effect.column_sigma**2)
        likely = [multivariate_normal(cov=1e10 * one).logpdf(1e5 * rest) for one in (with_it, covariance)]
        assert gain == pytest.approx(likely[0] - likely[1], abs=1e-6)


@pytest.mark.parametrize(("sure", "named"), [(True, False), (False, True)])
def test_points_where_it_is_not_sure_that_an_effect_acts_do_not_speak_against_it(sure, named):
    """Four points in corners that agree, and four at their edge where nothing shows: a force in corners."""
    from postproc.learning.covariance import Explanation, SmoothField
    from postproc.learning.excluded_points import find_outliers
    from postproc.learning.naming import NAMED, weigh_effects

    rng = np.random.default_rng(11)
    count = 60
    layout = layout_of(rng, count)
    column, sigma = np.zeros((count, 1)), np.zeros(count)
    column[:4, 0], column[4:8, 0], sigma[4:8] = 1.5e-4, 0.7e-4, 0.7e-4
    rest = rng.normal(0, 1e-5, count)
    rest[:4] += 3e-4
    whole = Explanation(layout, SmoothField(), rest, np.zeros((count, 0)), np.zeros(count))
    kept = np.ones(count, bool)
    kept[find_outliers(whole, 6)] = False
    assert not kept[:4].any()
    cause = Cause("corner_force", "effect", CauseKind.FORCE, 0.3)
    effect = MissingEffect("corner_force", (cause,), None, column, True, column_sigma=None if sure else sigma)
    best = weigh_effects(whole.part(np.flatnonzero(kept)), whole, [effect], kept)[0]
    assert (best.gain > NAMED) == named
    assert best.kept[:4].all() == named


def test_outliers_are_those_that_all_others_contradict_whatever_their_order():
    """Each one leaves by the residual to a fit of the points that remain, made anew here."""
    from postproc.learning.covariance import Explanation, SmoothField
    from postproc.learning.excluded_points import OUTLIER, find_outliers

    rng = np.random.default_rng(5)
    count = 40
    layout, columns = layout_of(rng, count), 3e-5 * rng.normal(size=(count, 4))
    rest = columns @ rng.normal(size=4) + rng.normal(0, 1e-5, count)
    rest[[4, 17, 30]] += [2e-4, -3e-4, 1.5e-4]
    explained = Explanation(layout, SmoothField(), rest, columns, np.zeros(count))
    assert find_outliers(explained, 10).tolist() == [4, 17, 30]
    assert find_outliers(explained, 2).tolist() == [4, 17]
    inside = np.setdiff1d(np.arange(count), [4, 17, 30])
    assert np.abs(explained.part(inside).standardised()).max() < OUTLIER
    assert find_outliers(explained.part(inside), 10).size == 0


def test_a_set_of_effects_has_the_probability_that_is_asked_of_it():
    """Gains of ln 90, ln 8 and ln 2 share as 90, 8 and 2: two of them have 98 %, and one alone is named at 96 %."""
    from postproc.learning.naming import WeighedEffect, probable_set

    def ranked(*shares):
        return [WeighedEffect(None, float(np.log(share)), 1.0, np.ones(1, bool)) for share in shares]

    assert len(probable_set(ranked(90, 8, 2))) == 2
    assert len(probable_set(ranked(96, 3, 1))) == 1
    assert len(probable_set(ranked(1, 1, 1))) == 3


@pytest.mark.slow
def test_a_force_in_corners_is_named_and_corrected(tmp_path):
    """Its points are few, and look like outliers until it is known."""
    program = write_shop(tmp_path / "shop")
    first = postproc.compensate(program, force=True) and program.parent / "compensated" / "part.src"
    rng = np.random.default_rng([4, 4711])
    surface = surface_of(program.parent, *surface_points(140, rng))
    truth = draw_truth(rng, list(surface.program.operations.names), ("corner_force",))
    plant = truth.plant()
    before = cut(surface, truth, plant, first, rng)
    chosen = rng.choice(140, 120, replace=False)
    write_csv(
        program.parent / "m.csv", surface, chosen, probe(surface, before, chosen, 1e-5, rng), first, 1e-5
    )
    learned = postproc.learn(program, program.parent / "m.csv")
    assert [one.name for one in learned.attribution.named] == ["corner_force"]
    named = next(one for one in learned.to_dict()["causes"] if one["cause"] == "corner_force")
    assert named["lower"] < 1 + truth.corner < named["upper"] or named["value"] == pytest.approx(
        1 + truth.corner, rel=0.05
    )
    after = cut(surface, truth, plant, program.parent / "learned" / "part.src", rng)
    assert aligned_rms(surface, after) < 0.35 * aligned_rms(surface, before)


@pytest.mark.slow
def test_a_worn_gear_shows_in_the_few_points_after_a_reversal(tmp_path):
    """A loop of 0.22 mrad of A1: the axis lies on one side of it but for some points, where a new gear, of a narrow
    loop, would lie on the other side already."""
    program = write_shop(tmp_path / "shop")
    postproc.compensate(program, force=True)
    rng = np.random.default_rng([9005, 953544162])
    surface = surface_of(program.parent, *surface_points(140, rng))
    operations = [name for name in surface.program.operations.names if name != "tool 1"]
    truth = draw_truth(rng, operations, ("hysteresis",), worn=4.0)
    assert truth.names() == {"hysteresis of A1": pytest.approx(2.2e-4, rel=0.01)}
    chosen = rng.choice(140, 120, replace=False)
    first = program.parent / "compensated" / "part.src"
    errors = cut(surface, truth, truth.plant(), first, rng)
    deviation = probe(surface, errors, chosen, 1e-5, rng)
    write_csv(program.parent / "m.csv", surface, chosen, deviation, first, 1e-5)
    learned = postproc.learn(program, program.parent / "m.csv", dry_run=True).attribution
    names = [one.name for one in learned.named] or list(learned.alternatives)
    assert "hysteresis of A1" in names


def test_an_outlier_in_a_corner_says_that_a_force_there_would_do_the_same(tmp_path):
    """One point in a corner and one beside it have 0.4 mm more: two outliers, and one of them may be none."""
    program = write_shop(tmp_path / "shop")
    postproc.compensate(program, force=True)
    first = program.parent / "compensated" / "part.src"
    rng = np.random.default_rng(3)
    surface = surface_of(program.parent, *surface_points(140, rng))
    truth = draw_truth(rng, [name for name in surface.program.operations.names if name != "tool 1"], ())
    chosen = np.arange(100)
    deviation = probe(surface, cut(surface, truth, truth.plant(), first, rng), chosen, 1e-5, rng)
    weight = surface.program.corners.at(surface.row[chosen], surface.share[chosen], np.full(100, 0.008))
    in_corner, outside = int(np.argmax(weight)), int(np.argmin(weight))
    assert weight[in_corner] == 1.0
    assert weight[outside] == 0.0
    deviation[[in_corner, outside]] += 4e-4
    write_csv(program.parent / "m.csv", surface, chosen, deviation, first, 1e-5)
    learned = postproc.learn(program, program.parent / "m.csv", positive="material_left", dry_run=True)
    outliers = [one for one in learned.findings if one.code == "LRN006"]
    assert len(outliers) == 2
    assert ["corner" in one.message for one in outliers].count(True) == 1
    assert next(one.help for one in outliers if one.help).startswith("measure more points in the corners")
