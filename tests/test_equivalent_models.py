"""Intervals hold what predicts the same readings; what could be there and not be seen is stated, and is true."""

from dataclasses import replace

import numpy as np
import pytest
from blind import measured
from blind.arm import model_of, robot_file
from blind.cases import cases, made
from blind.real_worlds import campaign

from postproc.diagnosis.diagnosis import diagnose
from postproc.diagnosis.effect_sizes import detection_limits
from postproc.diagnosis.equivalent_models import cover_equivalent_models
from postproc.diagnosis.search import model_unknowns
from postproc.effects import EFFECTS
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.joint_scatter import with_scatter_of_joints
from postproc.identification.unknowns import PLAUSIBLE

SIGMA = 2e-5


def read(design, model, rng):
    """Readings of ``model``, with scatter."""
    empty = Campaign(measured.readings(design, np.zeros((len(design.q) * design.points, 3)), SIGMA))
    value = -empty.residual(empty.predicted(model), empty.start())[:, :3]
    return Campaign(replace(empty.readings, value=value + SIGMA * rng.normal(size=value.shape)))


def deviations(seed):
    """How far lengths, twists and zeros of a fit are from the truth, in standard deviations: without and with what is
    not told from them.  The zero of A3 is in no robot file, and wrong as all others are."""
    rng = np.random.default_rng(seed)
    full = model_of(robot_file(True, False))
    names = [
        (i, p.name, PLAUSIBLE[t.effect.name][p.unit])
        for i, t in enumerate(full.terms)
        for p in t.effect.parameters
        if t.effect.name in PLAUSIBLE
    ]
    off = {(i, p): size * rng.normal() for i, p, size in names}
    design = replace(campaign(rng, 30, stated=True), jitter=0.0)
    seen = read(design, full.with_values(off), rng)
    model = model_of(robot_file(True, False, [("joint_offset", "A3")]))
    alone = with_scatter_of_joints(fit(seen, model, model_unknowns(model)))
    covered = cover_equivalent_models(alone, alone, alone, ())
    true = {f"{full.terms[i].effect.name}.{p}": value for (i, p), value in off.items()}
    one = [e for e in alone.estimates if e.unknown.name in true]
    other = [e for e in covered.estimates if e.unknown.name in true]
    assert all(b.ci95 > 0.999 * a.ci95 for a, b in zip(one, other, strict=True))
    return [[(e.value - true[e.unknown.name]) / e.ci95 for e in several] for several in (one, other)]


@pytest.mark.slow
def test_intervals_hold_a_zero_that_no_file_states():
    alone, covered = np.concatenate([deviations(seed) for seed in range(8)], axis=1)
    assert np.mean(np.abs(alone) < 1.0) < 0.85
    assert np.mean(np.abs(covered) < 1.0) > 0.9
    # no wider than need be
    assert 0.3 < np.sqrt(np.mean(covered**2)) < 0.75


def test_what_shows_by_itself_keeps_its_interval():
    model = model_of(robot_file(False, False))
    run = made(cases("null_clean", 1, 3)[0])
    assert run.design.deflection
    alone = fit(Campaign(run.readings), model, model_unknowns(model))
    covered = cover_equivalent_models(alone, alone, alone, ())
    assert len(alone.estimates) >= 4
    # a zero that is off by some mrad turns what is measured by as much
    for one, other in zip(alone.estimates, covered.estimates, strict=True):
        assert one.ci95 <= other.ci95 < 1.5 * one.ci95


@pytest.mark.slow
def test_an_effect_at_its_limit_is_seen_and_a_third_of_it_is_not():
    """In an arm in which nothing is missing, of which there are 15 poses, effects as large as is stated."""
    number = 2
    run = made(cases("null_clean", number + 1, 7)[number])
    model, rng = model_of(run.robot), np.random.default_rng(number)
    result = diagnose(Campaign(run.readings), model)
    assert result.verdict.word == "nothing_missing"
    limits = [
        one
        for one in detection_limits(result.search)
        if one.candidate.joint and len(one.parameters) == 1 and np.isfinite(one.parameters[0])
    ]
    assert {one.candidate.name for one in limits} >= {"backlash", "joint_stiffening"}
    assert set(EFFECTS) >= {one.candidate.name for one in limits}
    seen, unseen = [], []
    some = [limits[k] for k in rng.permutation(len(limits))]
    bent = [one for one in some if one.candidate.nonlinear]
    for limit in [*bent[:3], *(one for one in some if one not in bent[:3])][:5]:
        (unknown,), (size,) = limit.candidate.shown, limit.parameters
        for share, words in ((1.0, seen), (0.3, unseen)):
            larger = limit.candidate.model.with_values({unknown.key: unknown.parameter.null + share * size})
            campaign, given = Campaign(run.readings), result.final.point.nuisances
            there, here = (
                campaign.expected(campaign.predicted(m), given)[0] for m in (larger, limit.candidate.model)
            )
            value = run.without + there - here + run.sigma * rng.normal(size=run.without.shape)
            words.append(diagnose(Campaign(replace(run.readings, value=value)), model).verdict.word)
    assert len(bent) >= 3
    assert sum(word != "nothing_missing" for word in seen) >= 4
    assert unseen.count("nothing_missing") >= 4
