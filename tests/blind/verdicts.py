"""Right or wrong: a verdict against the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.diagnosis.search import model_unknowns
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.unknowns import unknowns_of
from postproc.model import StiffnessModel

from . import measured
from .arm import model_of
from .cases import Run
from .gap import closed, fresh
from .oracle import MARGIN, Rival

GEOMETRY = ("link_geometry", "joint_offset")

SOLVED = ("exact", "ambiguous", "undecided")
"""Outcomes that name the truth, or have it in their sets."""

WITHOUT_JOINTS = ("link_gravity",)
"""Effects of an arm as a whole, whatever joints their parameters stand beside."""


def judged(
    run: Run,
    answer: dict,
    found: StiffnessModel | None = None,
    with_gap: bool = False,
    with_fresh: bool = False,
) -> dict:
    """The record of a run: what was hidden, what was said (``compensate diagnose --json``), and whether that is right.
    ``found``: the model of the robot file that was written; ``with_gap``: how much of the gap that closes;
    ``with_fresh``: what it leaves at fresh poses, where the answer is right or has the truth in its set.

    outcome: exact; ambiguous (with the truth, where an oracle can not tell it from something else), undecided (the
    same where it can); unseen (nothing is said of what an oracle can not tell from nothing, and all else is right);
    partly (some of the truth and no more), missed, unknown, wrong, refused.
    """
    rest = run.readings.value - run.without
    rivals = [nearest(run, k, rest) for k in range(len(run.hidden))]
    outcome = outcome_of(run, answer, rivals)
    return {
        "key": run.case.key,
        "row": run.case.row,
        "effects": list(run.case.effects),
        "truth": sorted([list(pair) for pair in truth_of(run)]),
        "snr": run.case.snr,
        "shown": [round(snr, 3) for snr in run.snr],
        "poses": run.case.poses,
        "readings": len(run.readings),
        "deflection": run.design.deflection,
        "reached": run.reached or run.case.row == "unidentifiable",
        "rivals": [[[r.effect, r.joint, round(float(r.margin), 1)] for r in of[:3]] for of in rivals],
        "outcome": outcome,
        "right": right(run.case.row, outcome),
        "covered": covered(run, found) if outcome == "exact" and found else None,
        "closed": closed(run, found) if with_gap and found else None,
        "fresh": fresh(run, found) if with_fresh and found and outcome in SOLVED else None,
        "answer": {key: value for key, value in answer.items() if key in TOLD},
    }


TOLD = ("verdict", "named", "alternatives", "rejected", "lack", "next_poses_separation", "seconds", "told")
"""What a record keeps of an answer."""


def truth_of(run: Run) -> set[tuple[str, str]]:
    return {named(h.effect, h.joint) for h, _ in run.hidden}


def outcome_of(run: Run, answer: dict, rivals: list[list[Rival]]) -> str:
    """Of an answer on ``run``, ``rivals`` of each effect as the oracle has them."""
    names = {
        named(one["effect"], joint) for one in answer.get("named", ()) for joint in one["joints"] or [""]
    }
    sets = [
        {named(one["effect"], one["joint"] or "") for one in alternatives}
        for alternatives in answer.get("alternatives", ())
    ]
    # two forms of one effect on one joint are no doubt about its name
    names = names.union(*(one for one in sets if len(one) == 1))
    sets = [one for one in sets if len(one) > 1]
    outside = any(h.outside for h, _ in run.hidden)
    truth = truth_of(run) - (of_own_geometry(run, answer) - names.union(*sets))
    of_truth = {named(h.effect, h.joint): of for (h, _), of in zip(run.hidden, rivals, strict=True)}
    of_truth = {one: of for one, of in of_truth.items() if one in truth}
    # what nobody who knows it would see beside the rest may be left out, and may be named
    unseen = {one for one, of in of_truth.items() if is_unseen(of)}
    gone = unseen - names.union(*sets)
    if answer["verdict"] not in ("named", "partly_named", "ambiguous") or not truth - gone:
        gone = set()
    apart = [of for one, of in of_truth.items() if one not in gone]
    outcome = outcome_of_words(answer["verdict"], truth - gone, names, sets, outside, apart)
    return "unseen" if gone and outcome == "exact" else outcome


def is_unseen(rivals: list[Rival]) -> bool:
    """Whether an oracle that has these ``rivals`` of an effect could not tell it from nothing."""
    return any(rival.effect == "nothing" and rival.margin < MARGIN for rival in rivals)


def of_own_geometry(run: Run, answer: dict) -> set[tuple[str, str]]:
    """What of the truth is a change of lengths and twists that the robot file states, where it is said that these have
    changed."""
    if run.case.row == "unidentifiable":
        return set()
    moved = {one["parameter"].split(".")[0] for one in answer.get("refitted", ())}
    if not moved & set(GEOMETRY):
        return set()
    return {
        named(h.effect, h.joint)
        for h, size in run.hidden
        if h.effect in GEOMETRY and run.oracle.is_own(h, size)
    }


def named(effect: str, joint: str) -> tuple[str, str]:
    return effect, "" if effect in WITHOUT_JOINTS else joint


def nearest(run: Run, k: int, rest: np.ndarray) -> list[Rival]:
    """What else might be in the place of the ``k``-th hidden effect, nearest first."""
    hidden, size = run.hidden[k]
    if hidden.outside:
        return []
    others = [pair for j, pair in enumerate(run.hidden) if j != k]
    found = run.oracle.rivals(hidden, size, rest, others)
    same = named(hidden.effect, hidden.joint)
    return [rival for rival in found if named(rival.effect, rival.joint) != same]


def outcome_of_words(
    word: str, truth: set, names: set, sets: list[set], outside: bool, rivals: list[list[Rival]]
) -> str:
    apart = all(of and of[0].margin >= MARGIN for of in rivals if of)
    unseen = any(is_unseen(of) for of in rivals)
    if word in ("refused", "crashed", "unknown"):
        return word
    if word == "nothing_missing":
        return "exact" if not truth else "unseen" if unseen else "missed"
    if outside or not truth:
        return "wrong"
    if word == "ambiguous" and sets:
        # each name must be one that is there, or stand in a set with one
        meant = truth.union(*(alternatives for alternatives in sets if alternatives & truth))
        if (
            names <= meant
            and all(alternatives & truth for alternatives in sets)
            and truth <= names.union(*sets)
        ):
            return "undecided" if apart else "ambiguous"
        return "wrong"
    if names == truth:
        return "partly" if word == "partly_named" else "exact"
    return "partly" if word == "partly_named" and names < truth else "wrong"


def right(row: str, outcome: str) -> bool:
    if row == "outside":
        return outcome == "unknown"
    if row == "unidentifiable":
        return outcome in ("ambiguous", "undecided", "missed", "unseen")
    return outcome in ("exact", "ambiguous", "unseen")


def covered(run: Run, found: StiffnessModel) -> dict[str, list]:
    """Whether the 95 % intervals of the robot file that was written hold the values that its parameters take where the
    readings have no scatter; and the true values themselves (None of what has none).

    The two differ by what stays as the robot file before stated it: a zero of the last joint that no reading tells from
    a turn of the tool is in that turn.  After these two: value, interval, and what the two are held against (SI).
    """
    told = {
        (term, name): value
        for term, of in enumerate(found.terms)
        for name, value in of.stated.items()
        if value.source.startswith("diagnose:") and value.interval
    }
    own = {u.key: u for u in model_unknowns(model_of(run.robot))}
    new = {u.key: u for term in range(len(found.terms)) for u in unknowns_of(found, term)}
    exact = replace(run.readings, value=measured.observed(run.scene, run.design))
    fitted = fit(Campaign(exact), found, [own.get(key, replace(new[key], prior=None)) for key in told])
    true, holds = run.true(), {}
    for (term, name), value in told.items():
        there = [fitted.model.terms[term].values[name], true.get(f"{found.terms[term].effect.name}.{name}")]
        inside = [None if one is None else bool(abs(value.value - one) <= value.interval) for one in there]
        holds[f"{found.label(term)}.{name}"] = [*inside, value.value, value.interval, *there]
    return holds
